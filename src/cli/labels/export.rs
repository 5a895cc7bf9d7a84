//! `labels export`: labels as CSV or JSON, to take home.

use super::source::{acts, annotators, counted, is_table, listed, only};
use crate::cli::common::{CsvArgs, inputs, open, print, print_table};
use crate::escape::one_line;
use crate::labels::{Record, standing, write_csv, write_json};
use crate::output::{Inputs, replace_file};
use anyhow::{Context as _, bail};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `labels export --help`.
pub(super) const HELP: &str = "\
Columns: frame index annotator time F1 F2 F3 F4 clean unsure verdict person region note judged_fit judged_config \
judged_iteration judged_erased machine_F1 machine_F2 machine_F3 machine_F4 machine_shown act dataset program. Tags are 1 or 0, what is \
unknown is empty; region is view[first..=last, first..=last]. A row is what one annotator says of one frame now, by index, \
name and annotator; labels that were taken back have none. Text is quoted as RFC 4180 asks; text that a spreadsheet would \
compute has an apostrophe before it (--csv-plain leaves it out), which `labels import` and `labels agreement` take away \
again. The JSON is an array of records as in the journal. F is replaced whole or not at all; `-` is standard output.

Exit codes: 0 written; 2 bad input, or F cannot be written.

Examples:
  mhp-inspector labels export data/mmvr --csv labels.csv
      Everybody's labels of a data set.
  mhp-inspector labels export data/mmvr/mhp-labels/anna.labels.jsonl --csv anna.csv --json anna.json
      One journal, both ways.";

/// What `labels export` is told.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("out").required(true).multiple(true)))]
pub struct LabelExportArgs {
    /// A data set, a journal (*.labels.jsonl), or labels exported before.
    path: PathBuf,
    /// Write CSV; without F to standard output.
    #[arg(long, value_name = "F", group = "out", num_args = 0..=1, default_missing_value = "-")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    cells: CsvArgs,
    /// Write a JSON array; without F to standard output.
    #[arg(long, value_name = "F", group = "out", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
    /// Only this annotator's.
    #[arg(long, value_name = "NAME")]
    annotator: Option<String>,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// Reads, and writes each file that is asked for.
///
/// # Errors
/// Where PATH cannot be read, the annotator has no labels, or a file cannot be written.
pub(super) fn run(args: &LabelExportArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    for file in [&args.csv, &args.json].into_iter().flatten().filter(|file| !is_stdout(file)) {
        check(args, file)?;
    }
    let acts = only(acts(&args.path, args.manifest.as_deref())?, args.annotator.as_deref(), &args.path)?;
    let records: Vec<&Record> = annotators(&acts).into_iter().flat_map(|name| standing(said_by(name, &acts))).collect();
    let names: Vec<&str> = annotators(&acts);
    let what = format!("{} by {}", counted(records.len(), "label"), listed(&names));
    if let Some(path) = &args.csv {
        save(path, &what, |out| write_csv(out, records.iter().copied()))?;
    }
    if let Some(path) = &args.json {
        save(path, &what, |out| write_json(out, records.iter().copied()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses what would replace an input, or lie in the data set.
fn check(args: &LabelExportArgs, file: &Path) -> anyhow::Result<()> {
    let named = [Some(args.path.as_path()), args.manifest.as_deref()];
    if is_table(&args.path) {
        return Ok(Inputs::default().with_named(named).check_file(file)?);
    }
    let dataset = open(&args.path, args.manifest.as_deref())?;
    Ok(inputs(&dataset, &args.path, &named).check_file(file)?)
}

fn is_stdout(file: &Path) -> bool {
    file == Path::new("-")
}

fn said_by<'a>(name: &'a str, acts: &'a [Record]) -> impl Iterator<Item = &'a Record> {
    acts.iter().filter(move |record| record.annotator == name)
}

fn save(path: &Path, what: &str, fill: impl Fn(&mut dyn Write) -> std::io::Result<()>) -> anyhow::Result<()> {
    if is_stdout(path) {
        let mut text = Vec::new();
        fill(&mut text).context("writing labels")?;
        return print_table(&String::from_utf8_lossy(&text));
    }
    if path.to_string_lossy().to_lowercase().ends_with(".jsonl") {
        bail!("{}: is named like a journal, which is never replaced; expected another name", path.display());
    }
    replace_file(path, |mut out| fill(&mut out)).with_context(|| format!("{}: cannot be written", path.display()))?;
    print(&(one_line(&format!("{what}, in {}", path.display())).into_owned() + "\n"))
}
