//! Reading back what [`super::Summary`] writes, so that the fits of a whole data set are known to a window that did none.
//!
//! Columns are found by their names: a table of another program with `frame` and some of the others will do. An empty cell
//! is unknown. The IoU is the mean over the columns `iou_<array>`, as in the window.

use super::StudyError;
use crate::escape::from_cell;
use crate::input::open_file;
use crate::mhp::Terms;
use std::path::Path;

/// What a table says of one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SummaryRow {
    /// The frame's name.
    pub frame: String,
    /// Iterations done; `None` where the fit failed.
    pub iterations: Option<usize>,
    /// The convergence criterion.
    pub converged: Option<bool>,
    /// Why the run ended: `iterations`, `converged`, `error: …`.
    pub reason: Option<String>,
    /// Persons fitted.
    pub people: Option<usize>,
    /// Persons annotated.
    pub annotated: Option<usize>,
    /// L.
    pub loss: Option<f64>,
    /// Its unweighted terms, as far as they are known.
    pub terms: Terms<Option<f64>>,
    /// Mean forward-consistency IoU over the views where it is known, 0..1.
    pub iou: Option<f64>,
    /// MAJPE, mm.
    pub majpe_mm: Option<f64>,
}

/// Reads a table that `mhp-inspector fit --out` wrote. Where a frame comes twice, both rows are given, in their order.
///
/// # Errors
/// Where the file cannot be read, has no column `frame` or none of the others, or a cell is not what its column says;
/// naming file, line and column.
pub fn read_summary(path: &Path) -> Result<Vec<SummaryRow>, StudyError> {
    let failed = |reason| StudyError::Read { reason, path: path.to_owned() };
    let file = open_file(path, "a table of results (CSV)").map_err(failed)?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::Headers).from_reader(file);
    let head = reader.byte_headers().map_err(|error| broken(&error, path))?.clone();
    let columns = Columns::of(&head, path)?;
    let mut rows = Vec::new();
    let mut record = csv::ByteRecord::new();
    while reader.read_byte_record(&mut record).map_err(|error| broken(&error, path))? {
        let number = record.position().map_or(0, csv::Position::line);
        rows.push(columns.row(&Line { record: &record, number, path })?);
    }
    Ok(rows)
}

fn broken(error: &csv::Error, path: &Path) -> StudyError {
    let line = error.position().map_or(1, csv::Position::line);
    let message = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("it has {len} cells; expected {expected_len}, as the first line has")
        }
        csv::ErrorKind::Io(reason) => format!("cannot be read: {reason}"),
        _ => error.to_string(),
    };
    StudyError::Table { line, message, path: path.to_owned() }
}

/// Where each column is.
struct Columns {
    frame: usize,
    iterations: Option<usize>,
    converged: Option<usize>,
    reason: Option<usize>,
    people: Option<usize>,
    annotated: Option<usize>,
    loss: Option<usize>,
    terms: Terms<Option<usize>>,
    ious: Vec<usize>,
    majpe_mm: Option<usize>,
}

impl Columns {
    fn of(head: &csv::ByteRecord, path: &Path) -> Result<Self, StudyError> {
        // A spreadsheet may have put a byte order mark first.
        let names: Vec<String> =
            head.iter().map(|name| String::from_utf8_lossy(name).trim_start_matches('\u{feff}').to_owned()).collect();
        let wrong = |message: String| StudyError::Table { line: 1, message, path: path.to_owned() };
        let place = |wanted: &str| names.iter().position(|name| name == wanted);
        if let Some(twice) = (0..names.len()).find(|&k| place(&names[k]) != Some(k) && !names[k].is_empty()) {
            return Err(wrong(format!("the column `{}` is there twice", shortened(&names[twice]))));
        }
        let first = names.first().map_or("", String::as_str);
        let expected =
            "expected a table that `mhp-inspector fit --out` wrote: frame, iterations, converged, reason, loss, …";
        let frame = place("frame");
        let frame = frame
            .ok_or_else(|| wrong(format!("no column `frame` (the first is `{}`); {expected}", shortened(first))))?;
        let ious = names.iter().enumerate().filter(|(_, name)| name.starts_with("iou_") || *name == "iou");
        let columns = Self {
            frame,
            iterations: place("iterations"),
            converged: place("converged"),
            reason: place("reason"),
            people: place("people"),
            annotated: place("annotated"),
            loss: place("loss"),
            terms: Terms::from_fn(|term| place(term.key)),
            ious: ious.map(|(k, _)| k).collect(),
            majpe_mm: place("majpe_mm"),
        };
        let known = [columns.iterations, columns.converged, columns.reason, columns.loss, columns.majpe_mm];
        if columns.ious.is_empty() && known.iter().all(Option::is_none) {
            return Err(wrong(format!("it says nothing of fits; {expected}")));
        }
        Ok(columns)
    }

    fn row(&self, line: &Line<'_>) -> Result<SummaryRow, StudyError> {
        let frame = line.text(self.frame, "frame")?.to_owned();
        if frame.trim().is_empty() {
            return Err(line.wrong("frame", "is empty; expected the name of a frame"));
        }
        let mut known = Vec::with_capacity(self.ious.len());
        for &column in &self.ious {
            known.extend(line.number(Some(column), "iou", 0.0..=1.0)?);
        }
        let iou = (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64);
        let reason = self.reason.map(|column| line.text(column, "reason").map(str::trim)).transpose()?;
        Ok(SummaryRow {
            frame,
            iterations: line.parsed(self.iterations, "iterations", "a whole number")?,
            converged: line.parsed(self.converged, "converged", "true or false")?,
            reason: reason.filter(|reason| !reason.is_empty()).map(str::to_owned),
            people: line.parsed(self.people, "people", "a whole number")?,
            annotated: line.parsed(self.annotated, "annotated", "a whole number")?,
            loss: line.number(self.loss, "loss", f64::MIN..=f64::MAX)?,
            // What another program calls `time` or `joint` may be anything.
            terms: self.terms.map(|column| line.number(column, "", f64::MIN..=f64::MAX).ok().flatten()),
            iou,
            majpe_mm: line.number(self.majpe_mm, "majpe_mm", 0.0..=f64::MAX)?,
        })
    }
}

/// One line of the table.
struct Line<'a> {
    record: &'a csv::ByteRecord,
    number: u64,
    path: &'a Path,
}

impl Line<'_> {
    /// The cell as it was written: a frame's name may begin or end with a space.
    fn text(&self, column: usize, name: &str) -> Result<&str, StudyError> {
        let bytes = self.record.get(column).unwrap_or_default();
        std::str::from_utf8(bytes).map(from_cell).map_err(|_| self.wrong(name, "is not UTF-8 text"))
    }

    fn parsed<T: std::str::FromStr>(
        &self,
        column: Option<usize>,
        name: &str,
        expected: &str,
    ) -> Result<Option<T>, StudyError> {
        let Some(column) = column else { return Ok(None) };
        let text = self.text(column, name)?.trim();
        let wrong = |_| self.wrong(name, &format!("is `{}`; expected {expected}, or nothing", shortened(text)));
        if text.is_empty() { Ok(None) } else { text.parse().map(Some).map_err(wrong) }
    }

    fn number(
        &self,
        column: Option<usize>,
        name: &str,
        range: std::ops::RangeInclusive<f64>,
    ) -> Result<Option<f64>, StudyError> {
        let value = self.parsed::<f64>(column, name, "a number")?;
        match value.filter(|value| !range.contains(value)) {
            // NaN is in no range.
            Some(value) => {
                let (lo, hi) = (*range.start(), *range.end());
                let expected =
                    if hi == f64::MAX { "a finite number".into() } else { format!("a number from {lo} to {hi}") };
                Err(self.wrong(name, &format!("is {value}; expected {expected}, or nothing")))
            }
            None => Ok(value),
        }
    }

    fn wrong(&self, column: &str, message: &str) -> StudyError {
        StudyError::Table {
            line: self.number,
            message: format!("column {column} {message}"),
            path: self.path.to_owned(),
        }
    }
}

/// Nobody reads more of a wrong cell.
fn shortened(text: &str) -> String {
    let short: String = text.chars().take(40).collect();
    let dots = if short.len() < text.len() { "…" } else { "" };
    format!("{}{dots}", short.escape_debug())
}
