//! Records as a JSON array.

use super::check::check;
use super::{LabelRow, ReadTable, TableError, at_most};
use crate::labels::Record;
use std::io::Write;
use std::path::Path;

/// Reads an array of records.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<ReadTable, TableError> {
    let failed = |error: serde_json::Error| {
        // The place stands at the end, and what stands before may be as long as the file.
        let (line, column, message) = (error.line(), error.column(), at_most(100, &error.to_string()));
        TableError::Json { message: format!("line {line}, sign {column}: {message}"), path: path.to_owned() }
    };
    let records: Vec<Record> = serde_json::from_slice(bytes).map_err(failed)?;
    let rows: Vec<LabelRow> = (1..).zip(records).map(|(line, record)| LabelRow { line, record }).collect();
    for LabelRow { line, record } in &rows {
        let wrong = |(column, message)| TableError::Cell { line: *line, column, message, path: path.to_owned() };
        check(record).map_err(wrong)?;
    }
    Ok(ReadTable { rows, notes: Vec::new() })
}

/// One record a line, so that tools for text see what changed.
pub(super) fn write(out: &mut dyn Write, records: &[&Record]) -> std::io::Result<()> {
    out.write_all(b"[")?;
    for (k, record) in records.iter().enumerate() {
        out.write_all(if k == 0 { b"\n" } else { b",\n" })?;
        serde_json::to_writer(&mut *out, record)?;
    }
    out.write_all(b"\n]\n")
}
