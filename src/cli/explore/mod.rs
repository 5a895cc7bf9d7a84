//! `explore`: what else a fit could have done and what it rests on, headless and with the numbers of the window.

mod ambiguity;
mod cell;
mod closure;
mod frame;
mod known;
mod landscape;
mod radar;
mod restarts;
mod target;
mod tau;
mod tuning;

pub(super) use restarts::starts;
pub(super) use target::best_basin;

use clap::Subcommand;
use std::process::ExitCode;

/// Shown under the options of `explore --help`.
pub(super) const HELP: &str = "\
Each is a pane of the window, with the same numbers.

Exit codes: 0 done; 1 some fits did not work; 2 none did, or the input is bad.

Examples:
  mhp-inspector explore tuning samples/walk --frames 3 --preset baseline --grid w_em=0.05..5:24log --grid tau_pct=2..40:24log
      576 fits of one frame: a map of L, and the best.
  mhp-inspector explore ambiguity samples/f1 --frame 5 --preset baseline
      Where else in the room would this body explain the echo?
  mhp-inspector explore restarts samples/walk --frame 3 --preset baseline
      200 fits from other starts: is the frame ambiguous, or was the start unlucky?
  mhp-inspector explore cell data/walk --frame 3 --view hm_hori --at 3.1,0.4
      Which joints light the cell at 3.1 m depth, 0.4 m to the left, and how much each joint is worth to the IoU.
  mhp-inspector explore known data/walk --frames 0..8
      What the echo fixes of each pose and what only the prior does: a condition number a frame, the least observable directions.
  mhp-inspector explore tau data/walk --frame 3 --csv tau.csv
      The IoU at every tau from 0.5 to 60 %, without a refit.
  mhp-inspector explore closure data/walk --frame 3
      The fitted pose through an independent FMCW synthesis, fitted again: could it have been recovered?
  mhp-inspector explore radar data/walk --frame 3 --elements 86 --bandwidth 4e9 --save cascade
      What another radar would know of the same pose; kept as a preset that manifests can name.";

/// The explorations.
#[derive(Debug, Subcommand)]
pub enum ExploreCommand {
    /// What the fit comes to under every combination of the values of one or two settings.
    #[command(after_help = tuning::HELP, after_long_help = tuning::long_help())]
    Tuning(tuning::TuningArgs),
    /// L and its terms along a direction through the end of the fit, or over two.
    #[command(after_help = landscape::HELP)]
    Landscape(landscape::LandscapeArgs),
    /// L_EM of the fitted body over the floor, and over heading and height: where else could the fit have gone?
    #[command(after_help = ambiguity::HELP)]
    Ambiguity(ambiguity::AmbiguityArgs),
    /// Fits from many starts, and the basins that they end in.
    #[command(after_help = restarts::HELP)]
    Restarts(restarts::RestartArgs),
    /// Who lit a cell: the joints that send something back there, with their shares and phases; and what each joint is worth.
    Cell(cell::CellArgs),
    /// What the radar knows: what the echo fixes of a pose, and what only the prior does.
    Known(known::KnownArgs),
    /// The agreement of the masks at every tau.
    Tau(tau::TauArgs),
    /// The closure test: a pose before an independent radar, started and fitted as a new frame.
    Closure(closure::ClosureArgs),
    /// What another radar would see and know of the same pose.
    Radar(radar::RadarArgs),
}

/// Runs `explore`.
///
/// # Errors
/// As the exploration.
pub(super) fn run(command: &ExploreCommand) -> anyhow::Result<ExitCode> {
    match command {
        ExploreCommand::Tuning(args) => tuning::run(args),
        ExploreCommand::Landscape(args) => landscape::run(args),
        ExploreCommand::Ambiguity(args) => ambiguity::run(args),
        ExploreCommand::Restarts(args) => restarts::run(args),
        ExploreCommand::Cell(args) => cell::run(args),
        ExploreCommand::Known(args) => known::run(args),
        ExploreCommand::Tau(args) => tau::run(args),
        ExploreCommand::Closure(args) => closure::run(args),
        ExploreCommand::Radar(args) => radar::run(args),
    }
}
