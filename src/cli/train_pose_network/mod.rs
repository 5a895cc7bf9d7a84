//! `train-pose-network`: makes the network anew that a fit asks where joints are expected.

use super::common::{at_least_one, epochs_bar, print};
use super::train_motion::{RecordingsArgs, amount, clips};
use crate::geometry::Vec3;
use crate::mhp::{Actors, POSE_STRETCH, PoseTrainOptions, pose_network_reach, train_pose_network};
use crate::simulate::{Options, Recording, ScenePreset};
use anyhow::Context as _;
use clap::Args;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `train-pose-network --help`.
pub(super) const HELP: &str = "\
Draws lessons (people who move before radars that are drawn anew for each), teaches the network, and tests it on lessons of other people.
The same options give the same weights on one machine.

Recordings are those of `train-motion`.

Examples:
  mhp-inspector train-pose-network train.npz --validation validation.npz --out /tmp
      Writes /tmp/pose-network.safetensors and /tmp/pose-network.md, and prints the latter.
  mhp-inspector train-pose-network train.npz --rounds 2 --lessons 256 --out /tmp
      A quick look at whether it works.";

/// The card up to the figures.
const CARD: &str = include_str!("card.md");
/// Sequences of the synthetic source's actors to test on.
const OTHER_ACTORS: usize = 300;
/// Seeds of the actors that are learned from, and that are tested on.
const ACTORS_SEEDS: [u64; 2] = [77, 9077];
/// Lessons to test on.
const TESTS: usize = 2048;

/// What `train-pose-network` is told.
#[derive(Debug, Args)]
pub struct TrainPoseNetworkArgs {
    #[command(flatten)]
    motion: RecordingsArgs,
    /// Folder for `pose-network.safetensors` and `pose-network.md`.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Rounds; each draws its lessons anew.
    #[arg(long, default_value_t = PoseTrainOptions::default().rounds, value_parser = at_least_one)]
    rounds: usize,
    /// Lessons of a round.
    #[arg(long, default_value_t = PoseTrainOptions::default().lessons, value_parser = at_least_one)]
    lessons: usize,
    /// Passes over the lessons of a round.
    #[arg(long, default_value_t = PoseTrainOptions::default().passes, value_parser = at_least_one)]
    passes: usize,
    /// Sequences of the synthetic source's actors to draw from.
    #[arg(long, default_value_t = 6000, value_parser = at_least_one)]
    actors: usize,
    /// Share of the lessons that they give.
    #[arg(long, value_name = "SHARE", default_value_t = PoseTrainOptions::default().acted)]
    acted: f64,
    /// Seed of everything.
    #[arg(long, default_value_t = PoseTrainOptions::default().seed)]
    seed: u64,
}

/// Runs `train-pose-network`.
///
/// # Errors
/// Where recordings cannot be read or teach nothing, or a file cannot be written.
pub(super) fn run(args: &TrainPoseNetworkArgs) -> anyhow::Result<ExitCode> {
    anyhow::ensure!((0.0..=1.0).contains(&args.acted), "--acted {}: expected a share, 0 to 1", args.acted);
    let recorded = clips(&args.motion.recordings)?;
    let actors = Actors::new(&recorded, acted(args.actors, ACTORS_SEEDS[0])?)
        .with_context(|| format!("{}: no clip is long enough to teach anything", args.motion.recordings.display()))?;
    let options = PoseTrainOptions {
        rounds: args.rounds,
        lessons: args.lessons,
        passes: args.passes,
        acted: args.acted,
        seed: args.seed,
        ..PoseTrainOptions::default()
    };
    let bar = epochs_bar(args.rounds);
    let network = train_pose_network(&actors, &options, |round, [distance, unlikely]| {
        bar.set_position(round as u64);
        bar.set_message(format!("{:.0} mm, {unlikely:.2} nats a joint", 1e3 * distance));
    })
    .context("the layers do not fit together")?;
    bar.finish_and_clear();
    let name = |path: &std::path::Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let validation = args.motion.validation.as_deref().map(|path| format!(" --validation {}", name(path)));
    let made_by = format!(
        "cargo run --release --no-default-features --features train -- train-pose-network {}{} --out assets --rounds {} --lessons {} --passes {} --actors {} --acted {} --seed {}",
        name(&args.motion.recordings),
        validation.unwrap_or_default(),
        args.rounds,
        args.lessons,
        args.passes,
        args.actors,
        args.acted,
        args.seed
    );
    let learned = amount("learned", &recorded);
    let mut told = HashMap::from([("made_by".to_owned(), made_by.clone()), ("data".to_owned(), learned.clone())]);
    let mut card = format!("{CARD}\nMade by `{made_by}`; {learned}, and {} acted sequences.\n", args.actors);
    if let Some(path) = &args.motion.validation {
        let others = clips(path)?;
        let seed = args.seed.wrapping_add(1);
        let others_act = Actors::new(&others, acted(OTHER_ACTORS, ACTORS_SEEDS[1])?)
            .with_context(|| format!("{}: no clip is long enough to test on", path.display()))?;
        card += "\nLessons of people and actors not learned from, mean distance of a joint of the likeliest body:\n\n| | mm | nats a joint |\n|---|---|---|\n";
        for (what, acted) in [("recorded", 0.0), ("acted", 1.0)] {
            let options = PoseTrainOptions { lessons: TESTS, acted, seed, ..options };
            let [distance, unlikely] = pose_network_reach(&network, &others_act, &options);
            writeln!(card, "| {what} | {:.0} | {unlikely:.2} |", 1e3 * distance)?;
            told.insert(format!("{what}_mm"), format!("{:.0}", 1e3 * distance));
        }
    }
    let bytes = network.to_bytes(told).map_err(anyhow::Error::msg)?;
    for (file, bytes) in [("pose-network.safetensors", bytes.as_slice()), ("pose-network.md", card.as_bytes())] {
        let path = args.out.join(file);
        std::fs::write(&path, bytes).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    print(&card)?;
    Ok(ExitCode::SUCCESS)
}

/// Frames of a sequence of the synthetic source.
const SEQUENCE: usize = 20;

/// What the synthetic source's actors do in so many sequences: joints at 20 Hz, radar's frame, m.
fn acted(sequences: usize, seed: u64) -> anyhow::Result<Vec<Vec<[Vec3; 17]>>> {
    let recording = Recording::new(&Options {
        presets: vec![ScenePreset::Easy, ScenePreset::Medium, ScenePreset::Hard],
        frames: sequences * SEQUENCE,
        sequence_length: SEQUENCE,
        seed,
        radar_height_m: Some(1.0),
        ..Options::default()
    })?;
    let act = |k: usize| {
        let sequence = recording.sequence(k);
        let performer = sequence.performers().next();
        (0..POSE_STRETCH).filter_map(|i| Some(performer?.pose(0.05 * i as f64).joints)).collect()
    };
    Ok((0..sequences).map(act).collect())
}
