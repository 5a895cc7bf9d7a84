//! What a finished run leaves: rows, table, times.

use super::super::FileError;
use super::error::RunError;
use super::journal::Rows;
use super::row::{Cell, RunRow, cells};
use super::spec::RunSpec;
use super::table::{SceneTable, TableRow, by_scene, table};
use super::{markdown, parquet_rows};
use crate::escape::to_cell;
use crate::output::replace_file;
use serde_json::json;
use std::path::Path;

/// The table for programs; it is there once the run is complete.
pub const TABLE_FILE: &str = "table.json";

/// Everything that [`write()`] writes.
pub(super) const FILES: [&str; 6] = ["rows.csv", "rows.parquet", "table.md", "timing.csv", "timing.md", TABLE_FILE];

/// Writes `rows.csv`, `rows.parquet`, `table.md`, `timing.csv`, `timing.md` and last `table.json`, which says that the run
/// is complete. All but the times are the same bytes for the same specification.
///
/// # Errors
/// Where a file cannot be written.
pub(super) fn write(folder: &Path, spec: &RunSpec, rows: &Rows) -> Result<(), RunError> {
    let (table, scenes) = (table(spec, rows), by_scene(spec, rows));
    let studied: Vec<&RunRow> = rows.values().filter(|row| !row.passing).collect();
    write_rows(folder, spec, &studied)?;
    write_text(&folder.join("table.md"), &markdown::text(spec, &table, &scenes))?;
    write_times(folder, spec, &studied)?;
    write_text(&folder.join("timing.md"), &markdown::timing(spec, rows))?;
    write_text(&folder.join(TABLE_FILE), &json_text(spec, &table, &scenes))
}

/// The table as JSON: the study, the label columns, the data, a row each.
pub(super) fn json_text(spec: &RunSpec, table: &[TableRow], scenes: &[SceneTable]) -> String {
    let data = &spec.data;
    let mut object = json!({
        "study": spec.study,
        "version": spec.version,
        "precision": spec.precision,
        "base": spec.base,
        "seed": spec.seed,
        "shard": spec.shard.map(|shard| shard.to_string()),
        "data": { "name": data.name, "fingerprint": data.fingerprint, "content": data.content, "layout": data.layout,
                  "frames": data.frames,
                  "first": data.first, "end": data.end, "subset": data.subset },
        "columns": spec.columns,
        "paper": spec.paper(),
        "paper_missing": spec.paper_missing(),
        "rows": table,
    });
    if let Some(listed) = &data.listed {
        object["data"]["listed"] = json!(listed);
    }
    if !scenes.is_empty() {
        object["scenes"] = json!(scenes);
    }
    serde_json::to_string_pretty(&object).unwrap_or_default() + "\n"
}

fn write_rows(folder: &Path, spec: &RunSpec, rows: &[&RunRow]) -> Result<(), RunError> {
    let all: Vec<Vec<(String, Cell)>> = rows.iter().map(|row| cells(spec, row)).collect();
    let Some(first) = all.first() else { return Ok(()) };
    let columns: Vec<String> = first.iter().map(|(name, _)| name.clone()).collect();
    let kinds: Vec<Cell> = first.iter().map(|(_, cell)| cell.clone()).collect();
    let all: Vec<Vec<Cell>> = all.into_iter().map(|row| row.into_iter().map(|(_, cell)| cell).collect()).collect();
    let csv_file = folder.join("rows.csv");
    let written = replace_file(&csv_file, |out| {
        let mut table = csv::Writer::from_writer(out);
        table.write_record(&columns).map_err(std::io::Error::other)?;
        for row in &all {
            table.write_record(row.iter().map(Cell::text)).map_err(std::io::Error::other)?;
        }
        table.flush()
    });
    written.map_err(FileError::writing(&csv_file))?;
    let mut bytes = Vec::new();
    let file = folder.join("rows.parquet");
    let made = parquet_rows::write(&mut bytes, &columns, &kinds, &all).map_err(std::io::Error::other);
    let written = made.and_then(|()| replace_file(&file, |out| out.write_all(&bytes)));
    Ok(written.map_err(FileError::writing(&file))?)
}

fn write_times(folder: &Path, spec: &RunSpec, rows: &[&RunRow]) -> Result<(), RunError> {
    let file = folder.join("timing.csv");
    let written = replace_file(&file, |out| {
        let mut table = csv::Writer::from_writer(out);
        table.write_record(["variant", "name", "frame", "init_ms", "fit_ms"]).map_err(std::io::Error::other)?;
        for row in rows {
            let name = spec.variants.get(row.variant).map(super::Variant::name).unwrap_or_default();
            let number = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
            let cells = [
                row.variant.to_string(),
                to_cell(&name).into_owned(),
                to_cell(&row.name).into_owned(),
                number(row.init_ms),
                number(row.fit_ms),
            ];
            table.write_record(cells).map_err(std::io::Error::other)?;
        }
        table.flush()
    });
    Ok(written.map_err(FileError::writing(&file))?)
}

fn write_text(file: &Path, text: &str) -> Result<(), RunError> {
    Ok(replace_file(file, |out| out.write_all(text.as_bytes())).map_err(FileError::writing(file))?)
}
