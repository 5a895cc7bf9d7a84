//! `labels`: what people say of frames, without a window.

mod agreement;
mod export;
mod import;
mod request;
mod show;
mod source;
mod stats;
mod tag;
mod verification;

pub(super) use source::acts_of;
use std::process::ExitCode;

/// Shown under the options of `labels --help`.
pub(super) const HELP: &str = "\
Labels lie beside the data, in mhp-labels/ of a folder or <file>.mhp-labels/ of a file, one journal an annotator; in the
user's data folder where nothing can be written beside the data. Only X's own journal speaks for X: what other files say in
X's name counts where that journal says nothing of a frame, and is told.

Examples:
  mhp-inspector labels tag data/mmvr --annotator anna --frame d1s1/000/00383 --add F2
      Tags one frame; done when it is on disk.
  mhp-inspector labels show data/mmvr
      Everybody's labels as they are now.";

/// What to do with labels.
#[derive(Debug, clap::Subcommand)]
pub enum LabelsCommand {
    /// Tag frames, as the window does: one act, on disk when the program ends.
    #[command(after_help = tag::HELP)]
    Tag(tag::TagArgs),
    /// List the labels of a data set as they are now.
    #[command(after_help = show::HELP)]
    Show(show::ShowArgs),
    /// Tell how far two annotators agree, tag by tag: Cohen's kappa, raw agreement, counts.
    #[command(after_help = agreement::HELP)]
    Agreement(agreement::AgreementArgs),
    /// Write labels as CSV or JSON.
    #[command(after_help = export::HELP)]
    Export(export::LabelExportArgs),
    /// Bring labels from CSV into the journals of a data set.
    #[command(after_help = import::HELP)]
    Import(import::ImportArgs),
    /// Count labels: by tag, by scene, stratum or day; and the time that one took.
    #[command(after_help = stats::HELP)]
    Stats(stats::StatsArgs),
    /// Tell which frames the count-matched protocol keeps, and what reviewers said of the others.
    #[command(after_help = verification::HELP)]
    Verification(verification::VerificationArgs),
}

/// Runs a subcommand of `labels`.
///
/// # Errors
/// Whatever it could not do, naming file, key and what was expected.
pub(super) fn run(command: &LabelsCommand) -> anyhow::Result<ExitCode> {
    match command {
        LabelsCommand::Tag(args) => tag::run(args),
        LabelsCommand::Show(args) => show::run(args),
        LabelsCommand::Agreement(args) => agreement::run(args),
        LabelsCommand::Export(args) => export::run(args),
        LabelsCommand::Import(args) => import::run(args),
        LabelsCommand::Stats(args) => stats::run(args),
        LabelsCommand::Verification(args) => verification::run(args),
    }
}
