//! CSV: a header and a table of joints.

use super::MOST_BYTES;
use super::table::{Cell, Table};
use crate::escape::from_cell;
use crate::input::read_text;
use crate::predictions::error::PredictionError;
use crate::predictions::raw::RawPredictions;
use std::path::Path;

pub(super) fn read(path: &Path) -> Result<RawPredictions, PredictionError> {
    let text = read_text(path, "a table of joints", MOST_BYTES)
        .map_err(|reason| PredictionError::Read { reason, path: path.to_owned() })?;
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let wrong = |error: &csv::Error| {
        let line = error.position().map_or(1, |at| at.line() as usize);
        PredictionError::at_line(path, line, error.to_string())
    };
    let columns: Vec<String> = reader.headers().map_err(|error| wrong(&error))?.iter().map(str::to_owned).collect();
    let mut rows = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|error| wrong(&error))?;
        let line = row.position().map(|at| at.line() as usize);
        let cells =
            row.iter().map(|cell| if cell.is_empty() { Cell::Empty } else { Cell::Text(from_cell(cell).to_string()) });
        rows.push((line, cells.collect()));
    }
    let stated = |key: &str| {
        let comments = text.lines().take_while(|line| line.starts_with('#'));
        comments
            .filter_map(|line| line.trim_start_matches('#').split_once('='))
            .find_map(|(k, v)| (k.trim() == key).then(|| v.trim().to_owned()))
    };
    Table { columns, rows, format: "csv", unit: stated("unit"), axes: stated("axes") }.joints(path)
}
