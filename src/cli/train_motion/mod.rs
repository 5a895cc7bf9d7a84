//! `train-motion`: makes the prior of human motion anew, from recordings of joints.

use super::common::print;
use crate::body::{MOTION_COUNTS, MOTION_JOINTS, MotionClip, MotionCoverage, learn_motion, motion_coverage};
use crate::dataset::npz::NpzArchive;
use anyhow::{Context as _, bail};
use clap::Args;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `train-motion --help`.
pub(super) const HELP: &str = "\
Learns what windows of nine poses, 0.05 s apart, have in common: principal components of them and of their mirror images,
as the person sees them, kinds of motion weighing the same. The same recordings give the same files.

A recording is an npz with `joints` (T, 20, 3), m: COCO's 17 joints, then pelvis, neck, head top; x and y on the floor, z up
from it; `hz`, 20; `starts`, where clips begin, and the total; and of each clip `groups`, what kind of motion it is,
`subjects`, whose, and `sources`.

Examples:
  mhp-inspector train-motion train.npz --validation validation.npz --out /tmp
      Writes /tmp/motion.json (the prior) and /tmp/motion.md (what it covers), and prints the latter.";

/// Samples of a recording in a second.
const HZ: f64 = 20.0;
/// Sources whose bodies have the sizes of the people: the others were brought to a common skeleton, or scaled.
const OWN_SIZE: [&str; 2] = ["asfamc", "vicon"];

/// The card up to the figures.
const CARD: &str = include_str!("card.md");

/// Recorded motion.
#[derive(Debug, Args)]
pub(super) struct RecordingsArgs {
    /// Recordings to learn from.
    #[arg(value_name = "NPZ")]
    pub(super) recordings: PathBuf,
    /// Recordings of other people, to test on.
    #[arg(long, value_name = "NPZ")]
    pub(super) validation: Option<PathBuf>,
}

/// What `train-motion` is told.
#[derive(Debug, Args)]
pub struct TrainMotionArgs {
    #[command(flatten)]
    motion: RecordingsArgs,
    /// Folder for `motion.json` and `motion.md`.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Runs `train-motion`.
///
/// # Errors
/// Where recordings cannot be read or teach nothing, or a file cannot be written.
pub(super) fn run(args: &TrainMotionArgs) -> anyhow::Result<ExitCode> {
    let clips = clips(&args.motion.recordings)?;
    let nothing = || format!("{}: no clip is long enough to teach anything", args.motion.recordings.display());
    let learned = learn_motion(&clips).with_context(nothing)?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let validation = args.motion.validation.as_deref().map(|path| format!(" --validation {}", name(path)));
    let command = format!(
        "cargo run --release --no-default-features --features train -- train-motion {}{} --out assets",
        name(&args.motion.recordings),
        validation.unwrap_or_default()
    );
    let mut header = vec![command, amount("learned", &clips)];
    header.extend(learned.header().iter().cloned());
    let mut card = format!("{CARD}\nMade by `{}`; {}; {}.\n", header[0], header[1], header[2]);
    let mut tables = table("Recordings learned from", &motion_coverage(&learned, &clips))?;
    if let Some(path) = &args.motion.validation {
        let others = self::clips(path)?;
        let coverage = motion_coverage(&learned, &others);
        header.push(amount("validation", &others));
        header.extend(coverage.first().map(told));
        tables = table("Validation: people not learned from", &coverage)? + &tables;
    }
    card += &tables;
    let prior = learned.with_header(header);
    let text = prior.to_json().map_err(anyhow::Error::msg)?;
    for (file, text) in [("motion.json", &text), ("motion.md", &card)] {
        let path = args.out.join(file);
        std::fs::write(&path, text).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    print(&card)?;
    Ok(ExitCode::SUCCESS)
}

/// The clips of a recording.
pub(super) fn clips(path: &Path) -> anyhow::Result<Vec<MotionClip>> {
    let mut archive = NpzArchive::open(path)?;
    let joints = archive.read("joints")?;
    let pose = 3 * MOTION_JOINTS.len();
    if joints.shape.len() != 3 || joints.shape[1..] != [MOTION_JOINTS.len(), 3] {
        bail!("{}: `joints` has shape {:?}; expected (T, {}, 3)", path.display(), joints.shape, MOTION_JOINTS.len());
    }
    let hz = archive.read("hz")?.data;
    if hz != [HZ] {
        bail!("{}: `hz` is {hz:?}; expected {HZ}", path.display());
    }
    let starts: Vec<usize> = archive.read("starts")?.data.into_iter().map(|start| start as usize).collect();
    let [groups, subjects, sources] = ["groups", "subjects", "sources"].map(|key| archive.read_texts(key));
    let (groups, subjects, sources) = (groups?, subjects?, sources?);
    let count = starts.len().saturating_sub(1);
    if [&groups, &subjects, &sources].iter().any(|texts| texts.len() != count) {
        bail!(
            "{}: `groups`, `subjects` and `sources`: expected one a clip, and {count} clips by `starts`",
            path.display()
        );
    }
    let clip = |k: usize| {
        let (from, to) = (starts[k].saturating_mul(pose), starts[k + 1].saturating_mul(pose));
        let numbers = joints.data.get(from..to)?;
        let mut poses = vec![[[0.0; 3]; MOTION_JOINTS.len()]; numbers.len() / pose];
        poses.as_flattened_mut().as_flattened_mut().copy_from_slice(numbers);
        let own_size = OWN_SIZE.contains(&sources[k].as_str());
        Some(MotionClip { group: groups[k].clone(), subject: subjects[k].clone(), own_size, poses })
    };
    let bad = |k: usize| format!("{}: `starts` {} and {} are no clip", path.display(), starts[k], starts[k + 1]);
    (0..count).map(|k| clip(k).with_context(|| bad(k))).collect()
}

/// How much there is, for people.
pub(super) fn amount(what: &str, clips: &[MotionClip]) -> String {
    let mut subjects: Vec<&str> = clips.iter().map(|clip| clip.subject.as_str()).collect();
    subjects.sort_unstable();
    subjects.dedup();
    let poses: usize = clips.iter().map(|clip| clip.poses.len()).sum();
    format!("{what}: {} clips, {:.1} minutes, {} people", clips.len(), poses as f64 / HZ / 60.0, subjects.len())
}

/// What the prior reaches, for people.
fn told(coverage: &MotionCoverage) -> String {
    let of = |k: usize| {
        let (residual, mahalanobis) = (1e3 * coverage.residual_m[k], coverage.mahalanobis[k]);
        format!("{residual:.0} mm and {mahalanobis:.2} by {}", MOTION_COUNTS[k])
    };
    let figures: Vec<String> = (0..MOTION_COUNTS.len()).map(of).collect();
    let (windows, gain, figures) = (coverage.windows, coverage.gain, figures.join(", "));
    format!(
        "of its {windows} windows, residual and squared distance a component: {figures}; by the mixture: {gain:+.1} nats"
    )
}

/// Figures by kind of motion, in Markdown.
fn table(title: &str, of_groups: &[MotionCoverage]) -> anyhow::Result<String> {
    let mut text = format!("\n{title}:\n\n| motion | windows |");
    for count in MOTION_COUNTS {
        write!(text, " {count} |")?;
    }
    writeln!(text, " mixture |\n|---|---|{}", "---|".repeat(MOTION_COUNTS.len() + 1))?;
    for coverage in of_groups {
        let group = if coverage.group.is_empty() { "**all**" } else { &coverage.group };
        write!(text, "| {group} | {} |", coverage.windows)?;
        for (residual, mahalanobis) in coverage.residual_m.iter().zip(coverage.mahalanobis) {
            write!(text, " {:.0} / {mahalanobis:.2} |", 1e3 * residual)?;
        }
        writeln!(text, " {:+.1} |", coverage.gain)?;
    }
    Ok(text)
}
