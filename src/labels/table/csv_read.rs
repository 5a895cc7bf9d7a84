//! CSV as records.

use super::check::check;
use super::{COLUMNS, LabelRow, ReadTable, TableError, machine_column, shortened};
use crate::escape::from_cell;
use crate::labels::{CellRegion, FrameId, Judged, Label, Record, Tag, Tags, Verdict};
use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

/// Characters of the longest region or verdict.
const LONGEST: usize = 1000;

/// Reads header and rows.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<ReadTable, TableError> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(bytes);
    let header = reader.byte_headers().map_err(|error| row_error(&error, path))?.clone();
    let (columns, unknown) = columns(&header, path)?;
    let (mut rows, mut lines) = (Vec::new(), Lines { bytes, at: 0, line: 1 });
    for cells in reader.into_byte_records() {
        let cells = cells.map_err(|error| row_error(&error, path))?;
        let line = lines.of_row(cells.position().map_or(0, csv::Position::byte));
        if cells.len() != header.len() {
            let message = format!("{} cells; the header has {}", cells.len(), header.len());
            return Err(TableError::Row { line, message, path: path.to_owned() });
        }
        rows.push(LabelRow { line, record: Cells { row: &cells, columns: &columns, line, path }.record()? });
    }
    let note = |name: &String| format!("column `{name}` is passed over; it is none of a table of labels");
    Ok(ReadTable { rows, notes: unknown.iter().map(note).collect() })
}

fn row_error(error: &csv::Error, path: &Path) -> TableError {
    let line = error.position().map_or(1, csv::Position::line);
    TableError::Row { line, message: error.to_string(), path: path.to_owned() }
}

/// Counts the lines up to a row. The reader's own count lags by one where lines end in CR LF, and is at the first of the
/// blank lines before a row.
struct Lines<'b> {
    bytes: &'b [u8],
    at: usize,
    line: u64,
}

impl Lines<'_> {
    /// The line of the row that begins at `byte` or at the first sign after it that ends no line. Rows come in order.
    fn of_row(&mut self, byte: u64) -> u64 {
        while let Some(sign) = self.bytes.get(self.at) {
            let ends_line = matches!(sign, b'\r' | b'\n');
            if self.at as u64 >= byte && !ends_line {
                break;
            }
            let whole = *sign == b'\n' || (*sign == b'\r' && self.bytes.get(self.at + 1) != Some(&b'\n'));
            self.line += u64::from(whole);
            self.at += 1;
        }
        self.line
    }
}

/// Where each known column is.
type Columns = BTreeMap<&'static str, usize>;

/// The known columns, and the names of the others.
fn columns(header: &csv::ByteRecord, path: &Path) -> Result<(Columns, Vec<String>), TableError> {
    let wrong = |message| TableError::Header { message, path: path.to_owned() };
    let (mut columns, mut unknown) = (Columns::new(), Vec::new());
    for (place, name) in header.iter().enumerate() {
        let name = String::from_utf8_lossy(name);
        let name = name.trim();
        match COLUMNS.into_iter().find(|known| known.eq_ignore_ascii_case(name)) {
            None => unknown.push(shortened(name)),
            Some(known) if columns.insert(known, place).is_some() => {
                return Err(wrong(format!("column `{known}` is there twice")));
            }
            Some(_) => {}
        }
    }
    let needed = ["frame"].into_iter().chain(Tag::ALL.into_iter().map(Tag::code));
    let missing: Vec<String> = needed.filter(|name| !columns.contains_key(name)).map(|c| format!("`{c}`")).collect();
    if missing.is_empty() {
        return Ok((columns, unknown));
    }
    let found = shortened(&header.iter().map(String::from_utf8_lossy).collect::<Vec<_>>().join(","));
    let plural = if missing.len() == 1 { "column" } else { "columns" };
    Err(wrong(format!(
        "no {plural} {}; expected a header of names separated by commas, found `{found}`",
        missing.join(", ")
    )))
}

/// The cells of one row.
struct Cells<'r> {
    row: &'r csv::ByteRecord,
    columns: &'r Columns,
    line: u64,
    path: &'r Path,
}

impl Cells<'_> {
    fn record(&self) -> Result<Record, TableError> {
        let path = self.text("frame")?.to_owned();
        let index = self.optional("index", "a whole number")?.unwrap_or(0);
        let record = Record {
            dataset: self.text("dataset")?.to_owned(),
            frame: FrameId { path, index },
            label: self.label()?,
            annotator: self.text("annotator")?.to_owned(),
            time: self.text("time")?.to_owned(),
            after: None,
            act: self.text("act")?.to_owned(),
            program: self.text("program")?.to_owned(),
            judged: self.judged()?,
        };
        check(&record).map_err(|(column, message)| self.wrong(&column, message))?;
        Ok(record)
    }

    fn label(&self) -> Result<Label, TableError> {
        let mut tags = Tags::NONE;
        for tag in Tag::ALL {
            if self.yes(tag.code())? {
                tags = tags.with(tag);
            }
        }
        Ok(Label {
            tags,
            note: self.text("note")?.to_owned(),
            person: self.optional("person", "a person's number, counted from 0")?,
            region: self.in_words::<CellRegion>("region")?,
            verdict: self.in_words::<Verdict>("verdict")?,
        })
    }

    fn judged(&self) -> Result<Judged, TableError> {
        let hash = |column| -> Result<_, TableError> {
            Ok(Some(self.text(column)?.to_owned()).filter(|hash| !hash.is_empty()))
        };
        let mut machine = BTreeMap::new();
        for mode in Tag::MODES {
            let column = machine_column(mode);
            machine.extend(self.optional::<f64>(&column, "a score from 0 to 1")?.map(|score| (mode, score)));
        }
        Ok(Judged {
            fit: hash("judged_fit")?,
            config: hash("judged_config")?,
            iteration: self.optional("judged_iteration", "a whole number")?,
            erased: self.erased()?,
            machine,
            machine_shown: self.yes("machine_shown")?,
        })
    }

    fn erased(&self) -> Result<Vec<CellRegion>, TableError> {
        let text = self.text("judged_erased")?;
        let wrong =
            |_| self.wrong("judged_erased", "is no JSON list of regions; expected [{\"view\", \"lo\", \"hi\"}]".into());
        if text.trim().is_empty() { Ok(Vec::new()) } else { serde_json::from_str(text).map_err(wrong) }
    }

    /// What the cell says, without the sign that keeps spreadsheets from computing it; empty where the table lacks the
    /// column.
    fn text(&self, column: &str) -> Result<&str, TableError> {
        let bytes = self.columns.get(column).and_then(|&place| self.row.get(place)).unwrap_or_default();
        std::str::from_utf8(bytes).map(from_cell).map_err(|_| self.wrong(column, "is not UTF-8 text".into()))
    }

    fn yes(&self, column: &str) -> Result<bool, TableError> {
        let text = self.text(column)?.trim();
        match text.to_ascii_lowercase().as_str() {
            "1" | "true" | "yes" => Ok(true),
            "0" | "false" | "no" | "" => Ok(false),
            _ => {
                let message = format!("`{}`; expected 1 or 0 (or true, false, yes, no, or nothing)", shortened(text));
                Err(self.wrong(column, message))
            }
        }
    }

    /// A number, or none where the cell is empty.
    fn optional<T: FromStr>(&self, column: &str, expected: &str) -> Result<Option<T>, TableError> {
        let text = self.text(column)?.trim();
        let wrong = |_| self.wrong(column, format!("`{}`; expected {expected}, or nothing", shortened(text)));
        if text.is_empty() { Ok(None) } else { text.parse().map(Some).map_err(wrong) }
    }

    /// What says itself what it expected.
    fn in_words<T: FromStr<Err = String>>(&self, column: &str) -> Result<Option<T>, TableError> {
        let text = self.text(column)?;
        let wrong = |why: String| self.wrong(column, why.escape_debug().to_string());
        // A parser says again what it read; nobody reads more than a line of it.
        let text = if text.chars().nth(LONGEST).is_some() { &shortened(text) } else { text };
        if text.trim().is_empty() { Ok(None) } else { text.parse().map(Some).map_err(wrong) }
    }

    fn wrong(&self, column: &str, message: String) -> TableError {
        TableError::Cell { line: self.line, column: column.to_owned(), message, path: self.path.to_owned() }
    }
}
