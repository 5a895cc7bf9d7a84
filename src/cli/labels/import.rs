//! `labels import`: labels that were exported, or made elsewhere, into the journals of a data set.

use super::request::Frames;
use super::source::counted;
use crate::cli::common::{CsvArgs, open, print};
use crate::escape::one_line;
use crate::labels::{
    CellRegion, Change, FrameId, Journal, LabelPlace, LabelRow, LabelStore, ReadTable, Record, SaidElsewhere,
    is_dated_ahead, plan_import, read_table,
};
use crate::radar::View;
use anyhow::{Context as _, anyhow, bail};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `labels import --help`.
pub(super) const HELP: &str = "\
CSV with a header; `frame` and the tags F1 F2 F3 F4 clean unsure must be there, in any order, tags as 1/0, true/false, \
yes/no or nothing. `labels export --help` lists the columns that may be there too; others are passed over with a note. A \
JSON array of records is read as well, and checked alike. The apostrophe that `labels export` puts before text that a \
spreadsheet would compute is taken away (--csv-plain leaves it).

Each row is an act of its annotator, `import from FILE`, and replaces the label of its frame: where there is none, and \
where the row's time is later than the label's; other labels are kept and counted. A row of a time that has \
not come yet is told, and is kept as said now. Rows that say what the label says already write nothing. Nothing is ever deleted: the journal keeps what was there. Where one row is wrong nothing is imported.

Exit codes: 0 on disk; 2 bad input, or a journal cannot be written.

Examples:
  mhp-inspector labels import data/mmvr anna.csv bo.csv
      The rows of both, each to the journal of its annotator.
  mhp-inspector labels import data/mmvr sheet.csv --annotator anna --replace
      All rows as anna's, also over labels that are newer.";

/// What `labels import` is told.
#[derive(Debug, clap::Args)]
pub struct ImportArgs {
    /// The data set.
    path: PathBuf,
    /// Exported labels.
    #[arg(required = true, value_name = "CSV")]
    files: Vec<PathBuf>,
    /// Whose labels these are, instead of what each row says.
    #[arg(long, value_name = "NAME")]
    annotator: Option<String>,
    /// Replace labels that differ also where they are newer.
    #[arg(long)]
    replace: bool,
    /// Take rows of frames that the data set does not have.
    #[arg(long)]
    keep_unknown: bool,
    #[command(flatten)]
    cells: CsvArgs,
    /// Tell what would be done, and do nothing.
    #[arg(long)]
    dry_run: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// The rows of one annotator, and the act that each file is.
type Sheets = BTreeMap<String, Vec<(String, Vec<LabelRow>)>>;

/// Reads everything, then writes.
///
/// # Errors
/// Where a file, a row, the data set or a journal is bad: then nothing is written. Where writing fails.
pub(super) fn run(args: &ImportArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let sheets = sheets(args, &Frames::new(&dataset), &dataset.info().views)?;
    let (root, fingerprint) = (&dataset.info().root, dataset.fingerprint());
    let place = if args.dry_run { LabelPlace::to_read(root, fingerprint) } else { LabelPlace::of(root, fingerprint)? };
    let store = LabelStore::read(&place)?;
    let open = |name: &String| Journal::open(&place, name, dataset.fingerprint());
    let journals = sheets.keys().map(open).collect::<Result<Vec<_>, _>>()?;
    for ((name, files), mut journal) in sheets.iter().zip(journals) {
        let (mut written, mut same, mut kept) = (0, 0, 0);
        for (act, rows) in files {
            // What only files of others say keeps no row out.
            let known =
                |row: &Record| store.label(name, &row.frame.path).filter(|known| store.is_own(name, &known.frame.path));
            let plan = plan_import(rows, args.replace, known);
            (same, kept) = (same + plan.same, kept + plan.kept);
            let said: Vec<SaidElsewhere> = plan.write.iter().map(|row| said(row, &journal)).collect();
            written += if args.dry_run { said.len() } else { journal.bring(act, &said)?.len() };
        }
        print(&told(args, name, [written, same, kept], journal.path()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn told(args: &ImportArgs, name: &str, [written, same, kept]: [usize; 3], path: &Path) -> String {
    let verb = if args.dry_run { "would be imported" } else { "imported" };
    let mut text = format!("{name}: {} {verb}, {same} the same", counted(written, "label"));
    if kept > 0 {
        let _ = write!(text, ", {kept} kept because the row is not newer (--replace takes the row)");
    }
    one_line(&format!("{text}; in {}", path.display())).into_owned() + "\n"
}

/// The whole label, as a change of the one that is there.
fn said(row: &LabelRow, journal: &Journal) -> SaidElsewhere {
    let record = &row.record;
    let before = journal.label(&record.frame.path).cloned().unwrap_or_default();
    SaidElsewhere {
        frame: record.frame.clone(),
        change: Change::between(&before, &record.label),
        judged: record.judged.clone(),
        time: record.time.clone(),
    }
}

/// Reads all files and gives each row its annotator and its frame.
fn sheets(args: &ImportArgs, frames: &Frames<'_>, views: &[View]) -> anyhow::Result<Sheets> {
    let mut sheets = Sheets::new();
    let mut seen: HashMap<(String, String), (PathBuf, u64)> = HashMap::new();
    let mut ahead = Vec::new();
    for path in &args.files {
        let act = format!("import from {}", path.file_name().unwrap_or_default().to_string_lossy());
        let ReadTable { rows, notes } = read_table(path)?;
        for note in notes {
            tracing::warn!("{}: {note}", path.display());
        }
        for mut row in rows {
            let place = || format!("{}: line {}", path.display(), row.line);
            let name = annotator(args, &row).with_context(place)?;
            let frame = frame(args, &row, frames).map_err(|why| anyhow!("{why}")).with_context(place)?;
            let key = (name.clone(), frame.path.clone());
            if let Some((first, line)) = seen.insert(key, (path.clone(), row.line)) {
                let (frame, first) = (&frame.path, first.display());
                bail!("{}: frame `{frame}` of `{name}` is also on line {line} of {first}; expected one row", place());
            }
            row.record.frame = frame;
            if is_dated_ahead(&row.record) {
                ahead.push(format!("{}: dated in the future, {}; it counts as said now", place(), row.record.time));
            }
            if let Some(region) = &row.record.label.region {
                within(region, views).map_err(|why| anyhow!("column `region`: {why}")).with_context(place)?;
            }
            let files = sheets.entry(name).or_default();
            match files.last_mut() {
                Some((last, rows)) if *last == act => rows.push(row),
                _ => files.push((act.clone(), vec![row])),
            }
        }
    }
    for warning in &ahead {
        tracing::warn!("{warning}");
    }
    Ok(sheets)
}

/// Refuses cells that no map of the data set has.
fn within(region: &CellRegion, views: &[View]) -> Result<(), String> {
    let shape = views.iter().find(|view| view.array == region.view).map(View::shape);
    if shape.is_some_and(|shape| shape.len() == region.hi.len() && region.hi.iter().zip(&shape).all(|(k, n)| k < n)) {
        return Ok(());
    }
    let map = |view: &View| {
        format!("{} of {} bins", view.array, view.shape().iter().map(usize::to_string).collect::<Vec<_>>().join(" × "))
    };
    let maps: Vec<String> = views.iter().map(map).collect();
    Err(format!("`{region}` is in no map; expected cells of {}", maps.join(" or ")))
}

fn annotator(args: &ImportArgs, row: &LabelRow) -> anyhow::Result<String> {
    let name = args.annotator.as_deref().unwrap_or(&row.record.annotator).trim();
    if name.is_empty() {
        bail!("no annotator; expected a name in the column `annotator`, or --annotator NAME");
    }
    Ok(name.to_owned())
}

/// The frame of this name in the data set.
fn frame(args: &ImportArgs, row: &LabelRow, frames: &Frames<'_>) -> Result<FrameId, String> {
    match frames.named(&row.record.frame.path) {
        Some(frame) => Ok(frame),
        None if args.keep_unknown => Ok(row.record.frame.clone()),
        None => Err(format!(
            "frame `{}` is not in the data set {}; --keep-unknown takes such rows",
            row.record.frame.path.escape_debug(),
            args.path.display()
        )),
    }
}
