//! The complexity of every frame as a table.

use super::super::StudyError;
use super::{Complexity, FrameComplexity, Stratum};
use crate::escape::to_cell;
use crate::output::replace_file;
use serde::Serialize;
use std::path::Path;

/// One frame, as JSON and CSV name it.
#[derive(Serialize)]
struct Row {
    frame: String,
    peak_density: Option<f64>,
    static_dominance: Option<f64>,
    human_saliency: Option<f64>,
    hardness: Option<f64>,
    stratum: Option<&'static str>,
}

fn rows<'a>(name: impl Fn(usize) -> &'a str, complexity: &'a Complexity) -> impl Iterator<Item = Row> {
    complexity.frames.iter().enumerate().map(move |(i, frame)| {
        let FrameComplexity { statistics, hardness, stratum } = frame.unwrap_or_default();
        Row {
            frame: name(i).to_owned(),
            peak_density: statistics.peak_density,
            static_dominance: statistics.static_dominance,
            human_saliency: statistics.human_saliency,
            hardness,
            stratum: stratum.map(Stratum::word),
        }
    })
}

/// A JSON array, a line a frame, in the order of the data set, whose frames `name` tells: `frame peak_density static_dominance human_saliency
/// hardness stratum`, null where undefined.
///
/// # Errors
/// As `serde_json`; none is known for these rows.
pub fn json<'a>(name: impl Fn(usize) -> &'a str, complexity: &'a Complexity) -> serde_json::Result<String> {
    let lines = rows(name, complexity).map(|row| serde_json::to_string(&row));
    let lines = lines.collect::<serde_json::Result<Vec<_>>>()?;
    Ok(format!("[\n{}\n]\n", lines.join(",\n")))
}

/// Replaces `file` by a table with a row a frame and the columns of [`json`], empty where undefined.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_csv<'a>(
    file: &Path,
    name: impl Fn(usize) -> &'a str,
    complexity: &'a Complexity,
) -> Result<(), StudyError> {
    let written = replace_file(file, |out| {
        let mut table = csv::Writer::from_writer(out);
        for row in rows(name, complexity) {
            let row = Row { frame: to_cell(&row.frame).into_owned(), ..row };
            table.serialize(row).map_err(std::io::Error::other)?;
        }
        table.flush()
    });
    written.map_err(|reason| StudyError::Write { reason, path: file.to_owned() })
}
