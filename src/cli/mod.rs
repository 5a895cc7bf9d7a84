//! The command line: one file a subcommand. Arguments as typed become a validated configuration and one library call.

pub mod bench;
mod calibrate;
mod calibrate_room;
mod chain;
mod common;
mod complexity;
mod convert;
mod count;
mod evidence;
mod explore;
mod export;
mod fit;
mod frames;
mod info;
mod labels;
mod merge;
mod pose;
mod predict;
mod predictions;
mod radars;
mod score;
#[cfg(feature = "viewer")]
mod screenshot;
mod shards;
pub mod simulate;
mod sources;
mod study;
#[cfg(feature = "train")]
mod train_counter;
#[cfg(feature = "train")]
mod train_evidence;
#[cfg(feature = "train")]
mod train_motion;
#[cfg(feature = "train")]
mod train_pose;
#[cfg(feature = "train")]
mod train_pose_network;
mod transfer;

pub use common::allow_outside;

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// The exit code of bad input: a file, a key, a value that is not what it should be.
pub const EXIT_BAD_INPUT: u8 = 2;
/// The exit code of a batch of which some frames could not be fitted or read.
pub const EXIT_SOME_FAILED: u8 = 1;

/// Shown under the options of `--help`.
const HELP: &str = "\
Exit codes: 0 done; 1 some frames of a batch could not be fitted or read; 2 bad input, told in one line on standard error.

Examples:
  mhp-inspector
      The window on the bundled sample.
  mhp-inspector data/mmvr --frame 12 --iteration 40
      The window on an MMVR folder, at frame 12 after 40 iterations.
  mhp-inspector --session talk.mhp-session
      The window as it was when the session was saved.
  mhp-inspector info data/mmvr
      What is in it: frames, views, axes, ranges of values.
  mhp-inspector complexity data/mmvr --csv complexity.csv
      Which frames are easy, medium, hard.
  mhp-inspector count data/mmvr
      How many people each frame shows, and where.
  mhp-inspector fit data/mmvr --frames 0..10 --out results
      Ten fits without a window. `mhp-inspector fit --help` tells more.
  mhp-inspector study operators data/mmvr --out runs/operators
      A table of the paper, on one's own data. `mhp-inspector study --help` lists them.";

/// Fit parametric human models to mmWave radar heatmaps, frame by frame, and see why a fit fails.
#[derive(Debug, Parser)]
#[command(version, about, args_conflicts_with_subcommands = true, after_help = HELP)]
pub struct Cli {
    /// Let results be written into the data set's own folder, which is refused otherwise. Inputs are never replaced.
    #[arg(long, global = true)]
    pub into_data: bool,
    /// Open data sets whose manifest names frames outside its own folder.
    #[arg(long, global = true)]
    pub allow_outside: bool,
    /// What to do; without a subcommand the window opens.
    #[command(subcommand)]
    pub command: Option<CliCommand>,
    /// What the window begins with.
    #[command(flatten)]
    pub window: WindowArgs,
}

/// What the window begins with.
#[derive(Debug, Args)]
pub struct WindowArgs {
    /// Data sets or files to open in the window: an MMVR tree or any folder inside one, a `*_radar.npz`, a folder with
    /// `dataset.toml`, or an `.npy`/`.npz` of maps. Without one, the bundled sample opens.
    pub paths: Vec<PathBuf>,
    /// Take the results of a batch into the frame list: the `summary.csv` that `fit --out` wrote.
    #[arg(long, value_name = "FILE")]
    pub results: Option<PathBuf>,
    /// Show predictions of others beside the fits: FILE, NAME=FILE or NAME#RRGGBB=FILE; several times for several sources.
    #[arg(long = "pred", value_name = "[NAME[#RRGGBB]=]FILE")]
    predictions: Vec<sources::SourceFile>,
    /// Show the run folder of a study, as `study NAME --out RUN` wrote it.
    #[arg(long, value_name = "RUN")]
    pub study: Option<PathBuf>,
    /// Show this frame first: a name as in the frame list, or an index from 0.
    #[arg(long, value_name = "FRAME")]
    pub frame: Option<String>,
    /// Run its fit until this iteration.
    #[arg(long, value_name = "K")]
    pub iteration: Option<usize>,
    /// The settings to begin with.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    pub config: Option<PathBuf>,
    /// The settings to begin with, by their name.
    #[arg(long, value_name = "NAME", default_value = crate::config::Preset::default().name(), value_parser = common::presets())]
    pub preset: crate::config::Preset,
    /// Open a session file: the same frame, iteration, camera, pins and layout.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["paths", "frame", "iteration", "results", "predictions", "study", "config", "preset"])]
    pub session: Option<PathBuf>,
}

#[cfg(feature = "viewer")]
impl WindowArgs {
    /// As the window takes it.
    ///
    /// # Errors
    /// Where a path is not there, or a session or results file cannot be read: no window is opened for them.
    pub fn begin(self) -> anyhow::Result<crate::app::Begin> {
        for path in &self.paths {
            anyhow::ensure!(path.exists(), "{}: no such file or folder", path.display());
        }
        if let Some(session) = &self.session {
            crate::session::SessionFile::read(session)?.dataset_path(session)?;
        }
        if let Some(results) = &self.results {
            crate::study::read_summary(results)?;
        }
        if let Some(run) = &self.study {
            crate::study::run::RunSpec::read(run)?;
        }
        let aim = crate::session::StartAt { frame: self.frame, iteration: self.iteration };
        Ok(crate::app::Begin {
            paths: self.paths,
            aim,
            results: self.results,
            predictions: self.predictions.into_iter().map(|source| (source.path.clone(), source.reading())).collect(),
            study: self.study,
            config: Some(common::settings(self.config.as_deref(), self.preset, None)?),
            session: self.session,
            allow_outside: common::outside_allowed(),
            pick: None,
        })
    }
}

/// The subcommands; everything the window does, one of them can do headless.
#[derive(Debug, Subcommand)]
pub enum CliCommand {
    /// Measure what an iteration, a simulation and a whole frame cost on this machine.
    #[command(after_help = bench::HELP)]
    Bench(bench::BenchArgs),
    /// Measure point-spread widths on a frame's reflectors, beside those that the data set states or derives.
    #[command(after_help = calibrate::HELP)]
    Calibrate(calibrate::CalibrateArgs),
    /// Show the stages of a capture's processing: what each resolves, and what the numbers warn of.
    #[command(after_help = chain::HELP)]
    Chain(chain::ChainArgs),
    /// Find where the radars of a data set stand in the room whose frame its joints are in (HIBER), and remember it.
    ///
    /// Nothing is written into the data set, unless --into-data says so.
    #[command(after_help = calibrate_room::HELP)]
    CalibrateRoom(calibrate_room::CalibrateRoomArgs),
    /// Tell which frames of a data set are hard, before anything is fitted: three statistics of each frame's maps, the
    /// hardness that follows from their ranks, and the stratum.
    #[command(after_help = complexity::HELP)]
    Complexity(complexity::ComplexityArgs),
    /// Write a data set, a raw capture above all, as a folder with `dataset.toml` and one npz a frame.
    #[command(after_help = convert::HELP)]
    Convert(convert::ConvertArgs),
    /// Count the people of each frame: the number with its probabilities, and where they are.
    #[command(after_help = count::HELP)]
    Count(count::CountArgs),
    /// Tell what speaks for each failure mode of a fit, F1 to F4, in numbers: evidence, not verdicts.
    ///
    /// Each frame is fitted from its own peaks as `fit` does, unless --params says where the joints are. The frames before
    /// it in its sequence are read for what stays and what moves.
    #[command(after_help = evidence::HELP)]
    Evidence(evidence::EvidenceArgs),
    /// Ask what a fit rests on, and what else it could have done: cells, radar, tau; settings, starts, places.
    #[command(subcommand, after_help = explore::HELP)]
    Explore(explore::ExploreCommand),
    /// Write what other programs read: parameters, simulated maps in the input's own files, point clouds.
    ///
    /// Each frame is fitted from its own peaks as `fit` does, unless --params says where fitted parameters lie.
    #[command(after_help = export::HELP)]
    Export(export::ExportArgs),
    /// Fit frames of a data set: a row a frame, a table of all, the parameters as npz.
    ///
    /// Each frame starts from the peaks of its own maps, or with --warm-start from the frame before, and takes the
    /// configured number of Adam steps. Frames are fitted side by side; rows are in the order of the data set.
    #[command(after_help = fit::HELP, after_long_help = fit::long_help())]
    Fit(fit::FitArgs),
    /// Tell what is in a data set: layout, frames, views and axes, ranges of values, skeleton, people, labels.
    #[command(after_help = info::HELP)]
    Info(info::InfoArgs),
    /// Tag frames and list labels: what the window writes, for scripts.
    #[command(subcommand, after_help = labels::HELP)]
    Labels(labels::LabelsCommand),
    /// Make one whole of the shards of `fit`, `complexity`, `count`, `evidence` or a study: what each did with --shard.
    #[command(after_help = merge::HELP)]
    Merge(merge::MergeArgs),
    /// Say where the joints are by a network, one of `train-pose` or one in ONNX: a file of predictions.
    #[command(after_help = predict::HELP)]
    Predict(predict::PredictArgs),
    /// Compare joints that networks or other programs predict with truth and fit: a table, per joint, frames by disagreement.
    #[command(after_help = predictions::HELP)]
    Predictions(predictions::PredictionsArgs),
    /// List the radars that manifests can name, or print one.
    #[command(after_help = radars::HELP)]
    Radars(radars::RadarsArgs),
    /// Evaluate the objective at given parameters: simulated maps, losses and gradients.
    #[command(long_about = score::about(), after_help = score::HELP)]
    Score(score::ScoreArgs),
    /// Draw the real window offscreen after a number of iterations, and save it as a PNG.
    #[cfg(feature = "viewer")]
    #[command(after_help = screenshot::HELP)]
    Screenshot(screenshot::ScreenshotArgs),
    /// Write a synthetic data set with 3-D truth: people and rooms before an FMCW radar, as maps of any supported layout.
    #[command(after_help = simulate::HELP)]
    Simulate(simulate::SimulateArgs),
    /// Compare variants of a configuration over many frames: the paper's tables, sweeps, shards of them.
    #[command(subcommand, after_help = study::HELP)]
    Study(study::StudyCommand),
    /// Simulate a fitted pose for another radar; fit one body from three radars by calibration alone.
    #[command(subcommand, after_help = transfer::HELP)]
    Transfer(transfer::TransferCommand),
    /// Train the person counter on synthetic recordings and write its weights.
    #[cfg(feature = "train")]
    #[command(after_help = train_counter::HELP)]
    TrainCounter(train_counter::TrainCounterArgs),
    /// Calibrate the scores of the failure modes anew on simulated frames.
    #[cfg(feature = "train")]
    #[command(after_help = train_evidence::HELP)]
    TrainEvidence(train_evidence::TrainEvidenceArgs),
    /// Make the prior of human motion anew
    #[cfg(feature = "train")]
    #[command(after_help = train_motion::HELP)]
    TrainMotion(train_motion::TrainMotionArgs),
    /// Teach a network MLP+PPPR on data with joints in metres
    #[cfg(feature = "train")]
    #[command(after_help = train_pose::HELP)]
    TrainPose(train_pose::TrainPoseArgs),
    /// Make the network anew that a fit asks where joints are expected
    #[cfg(feature = "train")]
    #[command(after_help = train_pose_network::HELP)]
    TrainPoseNetwork(train_pose_network::TrainPoseNetworkArgs),
}

/// Starts the program once more where a subcommand needs another environment than it has, and never returns then. For `main`
/// alone, before anything else.
pub fn begin_again(command: Option<&CliCommand>) {
    #[cfg(all(feature = "viewer", unix))]
    if let Some(CliCommand::Screenshot(_)) = command {
        screenshot::without_device_selection();
    }
    #[cfg(not(all(feature = "viewer", unix)))]
    let _ = command;
}

/// Runs a subcommand.
///
/// # Errors
/// Whatever the subcommand could not do, naming file, key and what was expected.
pub fn run(command: CliCommand) -> anyhow::Result<ExitCode> {
    match command {
        CliCommand::Bench(args) => bench::run(&args),
        CliCommand::Calibrate(args) => calibrate::run(&args),
        CliCommand::Chain(args) => chain::run(&args),
        CliCommand::CalibrateRoom(args) => calibrate_room::run(&args),
        CliCommand::Complexity(args) => complexity::run(&args),
        CliCommand::Convert(args) => convert::run(&args),
        CliCommand::Count(args) => count::run(&args),
        CliCommand::Evidence(args) => evidence::run(&args),
        CliCommand::Explore(command) => explore::run(&command),
        CliCommand::Export(args) => export::run(&args),
        CliCommand::Fit(args) => fit::run(&args),
        CliCommand::Info(args) => info::run(&args),
        CliCommand::Labels(command) => labels::run(&command),
        CliCommand::Merge(args) => merge::run(&args),
        CliCommand::Predict(args) => predict::run(&args),
        CliCommand::Predictions(args) => predictions::run(&args),
        CliCommand::Radars(args) => radars::run(&args),
        CliCommand::Score(args) => score::run(&args),
        #[cfg(feature = "viewer")]
        CliCommand::Screenshot(args) => screenshot::run(&args),
        CliCommand::Study(command) => study::run(&command),
        CliCommand::Simulate(args) => simulate::run(&args),
        CliCommand::Transfer(command) => transfer::run(&command),
        #[cfg(feature = "train")]
        CliCommand::TrainCounter(args) => train_counter::run(&args),
        #[cfg(feature = "train")]
        CliCommand::TrainEvidence(args) => train_evidence::run(&args),
        #[cfg(feature = "train")]
        CliCommand::TrainMotion(args) => train_motion::run(&args),
        #[cfg(feature = "train")]
        CliCommand::TrainPose(args) => train_pose::run(&args),
        #[cfg(feature = "train")]
        CliCommand::TrainPoseNetwork(args) => train_pose_network::run(&args),
    }
}
