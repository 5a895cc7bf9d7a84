//! The command line: one file a subcommand. Arguments as typed become a validated configuration and one library call.

mod info;
mod score;
pub mod sample;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// The exit code of bad input: a file, a key, a value that is not what it should be.
pub const EXIT_BAD_INPUT: u8 = 2;

/// Fit parametric human models to mmWave radar heatmaps, frame by frame, and see why a fit fails.
#[derive(Debug, Parser)]
#[command(version, about, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to do; without a subcommand the window opens.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Data sets or files to open in the window: an MMVR tree or any folder inside one, a `*_radar.npz`, a folder with
    /// `dataset.toml`, or an `.npy`/`.npz` of maps. Without one, the bundled sample opens.
    pub paths: Vec<PathBuf>,
}

/// The subcommands; everything the window does, one of them can do headless.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Tell what is in a data set: frames, views and axes, ranges of values, skeleton, people, labels.
    Info(info::Args),
    /// Evaluate the objective at given parameters: simulated maps, losses and gradients.
    ///
    /// Writes an npz with `sim_<array>`, `iou_<array>`, `loss`, its terms `em bone rigid joint sep coll`, and the gradients
    /// `grad_<group>` (of the total) and `grad_em_<group>` (of L_EM alone), all float64. Prints the scalars as one JSON
    /// object; an IoU of two empty masks is null there and NaN in the npz. The EM region is that of the given positions.
    Score(score::ScoreArgs),
    /// Write the bundled sample data set anew: a person who walks before two FMCW arrays, with 3-D truth.
    Sample(sample::Args),
}

/// Runs a subcommand.
///
/// # Errors
/// Whatever the subcommand could not do, naming file, key and what was expected.
pub fn run(command: Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::Info(args) => info::run(&args),
        Command::Score(args) => score::run(&args),
        Command::Sample(args) => sample::run(&args),
    }
}
