//! `labels show`: everybody's labels as they are now.

use super::source::{listed, warn_of_unknown};
use crate::cli::common::{open, print, print_json};
use crate::escape::one_line;
use crate::labels::{LabelPlace, LabelStore, Record};
use anyhow::{Context as _, bail};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `labels show --help`.
pub(super) const HELP: &str = "\
Told on standard error: damaged lines of a journal, which are skipped; labels dated in the future; labels of frames that the
data set does not have; and files that speak for others. Only X's own journal says what X says: records by X in any other
file (a copy, a joined file, another annotator's) count where that journal says nothing of a frame. Nothing is written.
What is not ordinary text in names and notes (control characters, marks that turn the direction) is shown as \\u{1b}.

Exit codes: 0 told; 2 bad input.

Examples:
  mhp-inspector labels show data/mmvr --annotator anna
      A line a frame: annotator, frame, tags, person, verdict, region, note.
  mhp-inspector labels show data/mmvr --json
      An array of records, as in the journal.";

/// What `labels show` is told.
#[derive(Debug, clap::Args)]
pub struct ShowArgs {
    /// The data set.
    path: PathBuf,
    /// Only this annotator's.
    #[arg(long, value_name = "NAME")]
    annotator: Option<String>,
    /// A JSON array of records instead of text.
    #[arg(long)]
    json: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// Reads the journals of a data set and prints the labels that say something.
///
/// # Errors
/// Where the data set or the folder of labels cannot be read, or the annotator has no labels there.
pub(super) fn run(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let place = LabelPlace::to_read(&dataset.info().root, dataset.fingerprint());
    let store = LabelStore::read(&place)?;
    store.warnings().iter().for_each(|warning| tracing::warn!("{warning}"));
    let everybody: Vec<&str> = store.annotators().collect();
    let wanted = args.annotator.as_deref().map(str::trim);
    if let Some(name) = wanted.filter(|name| !everybody.contains(name)) {
        bail!("{}: no labels by `{name}`; there are some by {}", place.folder.display(), listed(&everybody));
    }
    let names = everybody.iter().filter(|name| wanted.is_none_or(|wanted| **name == wanted));
    let records = names.flat_map(|name| store.records(name)).filter(|record| !record.label.is_empty());
    let records: Vec<&Record> = records.collect();
    warn_of_unknown(&dataset, records.iter().map(|record| record.frame.path.as_str()));
    if args.json {
        print_json(&(serde_json::to_string_pretty(&records).context("writing JSON")? + "\n"))?;
    } else {
        print(&as_text(&records))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A line a record; columns are as wide as their widest entry.
fn as_text(records: &[&Record]) -> String {
    let rows: Vec<[String; 4]> = records.iter().map(|record| row(record)).collect();
    let width = |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max();
    let (annotator, frame, tags) = (width(0).unwrap_or(0), width(1).unwrap_or(0), width(2).unwrap_or(0));
    rows.iter().fold(String::new(), |mut text, [a, f, t, rest]| {
        let line = format!("{a:<annotator$}  {f:<frame$}  {t:<tags$}  {rest}");
        let _ = writeln!(text, "{}", line.trim_end());
        text
    })
}

fn row(record: &Record) -> [String; 4] {
    let label = &record.label;
    let mut rest = Vec::new();
    rest.extend(label.person.map(|person| format!("person {person}")));
    rest.extend(label.verdict.map(|verdict| verdict.to_string()));
    rest.extend(label.region.as_ref().map(ToString::to_string));
    rest.extend((!label.note.is_empty()).then(|| format!("\"{}\"", label.note.replace('"', "\\\""))));
    // A note may have several lines; a record has one.
    let cells = [&record.annotator, &record.frame.path, &label.tags.to_string(), &rest.join("  ")];
    cells.map(|cell| one_line(cell).into_owned())
}
