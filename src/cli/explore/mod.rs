//! `explore`: what else a fit could have done, headless and with the numbers of the window.

mod ambiguity;
mod landscape;
mod restarts;
mod target;
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
      200 fits from other starts: is the frame ambiguous, or was the start unlucky?";

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
    }
}
