//! `train-limbs`: makes the linear map of the limbs anew, from data sets with truth.

use super::common::{print, progress_bar};
use crate::config::{FitConfig, Limbs, Parameterization, Preset};
use crate::dataset::Dataset;
use crate::mhp::{LimbLesson, LimbMap, Problem, learn_limbs};
use crate::start::{find_start, problem_alone, problem_of};
use crate::task::Progress;
use anyhow::Context as _;
use clap::Args;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Shown under the options of `train-limbs --help`.
pub(super) const HELP: &str = "\
Finds a start in every frame with one person, without what is learned, and learns by ridge regression how far from it the
parts of the body are. The same data sets give the same map.

Examples:
  mhp-inspector simulate /tmp/people --preset easy,medium,hard --frames 900 --sequence-length 9 --seed 5
  mhp-inspector train-limbs /tmp/people --out /tmp
      Writes /tmp/limbs.json and prints what it reaches.

The committed map was learned from these, all with `--sequence-length 9 --people 1`:
  simulate mmvr-K  --layout mmvr --preset easy,medium,hard --frames 900 --seed 100K    (K = 1 to 8)
  simulate any     --layout mmvr --radar-height any --preset easy,medium,hard,f1,f2,f4 --frames 1800 --seed 2301
  simulate generic --layout generic --preset easy,medium,hard --frames 1800 --seed 2101
  simulate hupr    --layout hupr --narrow --preset easy,medium,hard --frames 360 --seed 2201";

/// Every so many frames are also learned from without those around them.
const ALONE: usize = 3;

/// What `train-limbs` is told.
#[derive(Debug, Args)]
pub struct TrainLimbsArgs {
    /// Data sets to learn from.
    #[arg(value_name = "DIR", required = true)]
    paths: Vec<PathBuf>,
    /// Folder for `limbs.json`.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Data sets to test on.
    #[arg(long, value_name = "DIR")]
    test: Vec<PathBuf>,
    /// How much the weights are held down, in lessons' worth of each input.
    #[arg(long, value_name = "SHARE", default_value_t = 0.35, value_parser = above_zero)]
    ridge: f64,
}

fn above_zero(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "expected a number above 0".to_owned())
}

/// Runs `train-limbs`.
///
/// # Errors
/// Where a data set cannot be opened or has no frame that teaches anything, or the file cannot be written.
pub(super) fn run(args: &TrainLimbsArgs) -> anyhow::Result<ExitCode> {
    let lessons = lessons(&args.paths)?;
    let mut map = learn_limbs(&lessons, args.ridge).context("no frame with one person and truth teaches anything")?;
    map.header = vec![format!(
        "cargo run --release --no-default-features --features train -- train-limbs {} --out assets --ridge {}",
        args.paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" "),
        args.ridge
    )];
    map.header.push(told("learned", &lessons, &map));
    if !args.test.is_empty() {
        map.header.push(told("test", &self::lessons(&args.test)?, &map));
    }
    write(&args.out.join("limbs.json"), &map)?;
    print(&(map.header.join("\n") + "\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn lessons(paths: &[PathBuf]) -> anyhow::Result<Vec<LimbLesson>> {
    let config = FitConfig {
        limbs: Limbs::Posture,
        parameterization: Parameterization::Bones,
        starts: 9,
        w_time: 8.0,
        ..Preset::Recommended.config()
    };
    let mut lessons = Vec::new();
    for path in paths {
        let dataset = Dataset::open(path, &Progress::new())?;
        let bar = progress_bar(dataset.len());
        let of_frame = |index: usize| -> Vec<LimbLesson> {
            bar.inc(1);
            let Ok(frame) = dataset.load(index) else { return Vec::new() };
            let Some(truth) = &frame.truth else { return Vec::new() };
            let lesson = |problem: Problem| {
                let problem = Arc::new(problem);
                let found = find_start(&problem, &config).ok()?;
                LimbLesson::of(&problem, &found.initialisation.params, &truth.joints)
            };
            // Some without the frames around, which not every data set has.
            let alone = index.is_multiple_of(ALONE).then(|| problem_alone(&dataset, &frame).ok()).into_iter();
            problem_of(&dataset, &frame).into_iter().chain(alone.flatten()).filter_map(lesson).collect()
        };
        lessons.par_extend((0..dataset.len()).into_par_iter().flat_map_iter(of_frame));
        bar.finish_and_clear();
    }
    Ok(lessons)
}

/// What the map reaches, for people.
fn told(what: &str, lessons: &[LimbLesson], map: &LimbMap) -> String {
    let errors: Vec<[f64; 2]> = lessons.iter().map(|lesson| lesson.errors_m(map)).collect();
    let count = errors.len().max(1) as f64;
    let [before, after] = [0, 1].map(|k| 1e3 * errors.iter().map(|error| error[k]).sum::<f64>() / count);
    let better = errors.iter().filter(|[before, after]| after < before).count() as f64 / count;
    format!(
        "{what}: {} frames, parts of the body {before:.0} mm from where they are in the start, {after:.0} mm as moved, nearer in {:.1} % of frames",
        errors.len(),
        100.0 * better
    )
}

fn write(path: &Path, map: &LimbMap) -> anyhow::Result<()> {
    let text = serde_json::to_string(map)?.replace("],[", "],\n[").replace("\",\"", "\",\n\"") + "\n";
    std::fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}
