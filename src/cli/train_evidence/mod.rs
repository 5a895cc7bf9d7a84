//! `train-evidence`: calibrates the scores of the failure modes anew, on simulated frames of known modes.

mod report;

use super::common::{at_least_one, print, progress_bar};
use crate::diagnose::{Calibration, EvidenceExample, FrameSet, learn_curves};
use crate::study::calibrate::{JudgedFit, frame_count, judged};
use anyhow::Context as _;
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `train-evidence --help`.
pub(super) const HELP: &str = "\
Simulates frames with each of the failure modes and without (presets easy, medium, hard, medium with two people, f1, f2, f3, f4 in
equal shares; MMVR-like, polar with Doppler, HuPR-like), fits them, measures what speaks for each mode, and fits for each a curve from
its measures to a probability. All that is reported is of seeds that were not learned from. The same options give the same bytes.

Examples:
  mhp-inspector train-evidence --out assets
      Writes evidence.json (the table), evidence.svg (the reliability diagram) and evidence.md (the figures).
  mhp-inspector train-evidence --out /tmp --sequences 2
      A quick look at whether it works.";

/// What `train-evidence` is told.
#[derive(Debug, Args)]
pub struct TrainEvidenceArgs {
    /// Folder for `evidence.json`, `evidence.svg` and `evidence.md`.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Sequences a scenario, layout and seed, rounded up to an even number; one frame of each is judged.
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = at_least_one)]
    sequences: usize,
    /// Seeds of what is learned from; each is left out in turn to choose between a logistic and an isotonic curve.
    #[arg(long, value_name = "SEED", value_delimiter = ',', default_values_t = [61, 62, 63])]
    seeds: Vec<u64>,
    /// Seeds of what is reported.
    #[arg(long, value_name = "SEED", value_delimiter = ',', default_values_t = [9061, 9062])]
    test_seeds: Vec<u64>,
}

/// Runs `train-evidence`.
///
/// # Errors
/// Where a seed is both learned from and tested on, or a file cannot be written.
pub(super) fn run(args: &TrainEvidenceArgs) -> anyhow::Result<ExitCode> {
    let both = args.seeds.iter().find(|seed| args.test_seeds.contains(seed));
    if let Some(seed) = both {
        anyhow::bail!("--test-seeds has {seed}, which --seeds has too: a test on what was learned tells nothing");
    }
    let [learned, held_out] = [&args.seeds, &args.test_seeds].map(|seeds| simulated(seeds, args.sequences));
    let (learned, held_out) = (learned?, held_out?);
    let table = table(args, &learned, &held_out);
    let json = serde_json::to_string_pretty(&table)? + "\n";
    // What cannot be read back must not be committed.
    let table = Calibration::from_json(&json).context("the new table")?;
    write(&args.out.join("evidence.json"), &json)?;
    write(&args.out.join("evidence.svg"), &report::diagram(&table, &held_out))?;
    let tables = report::tables(&table, &held_out);
    write(&args.out.join("evidence.md"), &tables)?;
    print(&tables)?;
    Ok(ExitCode::SUCCESS)
}

fn simulated(seeds: &[u64], sequences: usize) -> anyhow::Result<Vec<JudgedFit>> {
    let bar = progress_bar(frame_count(seeds, sequences));
    let found = judged(seeds, sequences, || bar.inc(1))?;
    bar.finish_and_clear();
    Ok(found)
}

fn table(args: &TrainEvidenceArgs, learned: &[JudgedFit], held_out: &[JudgedFit]) -> Calibration {
    let list = |seeds: &[u64]| seeds.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
    let set = |role: &str, seeds: &[u64], fits: &[JudgedFit]| FrameSet {
        role: role.to_owned(),
        seeds: seeds.to_vec(),
        sequences: args.sequences,
        frames: frame_count(seeds, args.sequences),
        fits: fits.len(),
    };
    let examples =
        |judged: &[JudgedFit]| judged.iter().map(|one| one.example.clone()).collect::<Vec<EvidenceExample>>();
    let command = format!(
        "cargo run --release --no-default-features --features train -- train-evidence --out assets --sequences {} --seeds {} \
         --test-seeds {}",
        args.sequences,
        list(&args.seeds),
        list(&args.test_seeds)
    );
    let sets = vec![set("learned", &args.seeds, learned), set("held out", &args.test_seeds, held_out)];
    Calibration::new(command, sets, learn_curves(&examples(learned), &examples(held_out)))
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}
