//! Files of predictions, each format one file: what they say and how it lies in them.

mod arrays;
mod csv_file;
mod json;
mod parquet_file;
mod pppr;
mod table;

use super::error::PredictionError;
use super::raw::RawPredictions;
use super::reading::Reading;
use std::path::Path;

/// The endings of files that are read.
pub const ENDINGS: [&str; 5] = ["npz", "npy", "csv", "json", "parquet"];
/// Bytes of a text file that are read.
const MOST_BYTES: u64 = 512 << 20;
/// Joints of a person at most: the skeletons of whole-body estimators have 133.
const MOST_JOINTS: usize = 512;

/// Reads a file, or a folder of PPPR files as `fit --out` writes it.
///
/// # Errors
/// Where it cannot be read, or is none of predictions; one message that names the file and what was expected.
pub fn read_raw(path: &Path, reading: &Reading) -> Result<RawPredictions, PredictionError> {
    let meta = std::fs::metadata(path).map_err(|reason| PredictionError::Read { reason, path: path.to_owned() })?;
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let mut raw = match ending.as_str() {
        _ if meta.is_dir() => pppr::read_folder(path)?,
        "npz" | "npy" => arrays::read(path, reading)?,
        "csv" => csv_file::read(path)?,
        "json" => json::read(path, reading)?,
        "parquet" => parquet_file::read(path)?,
        _ => {
            let known = ENDINGS.map(|ending| format!(".{ending}")).join(", ");
            return Err(PredictionError::format(
                path,
                format!("ending \".{ending}\"; expected {known}, or a folder of PPPR npz"),
            ));
        }
    };
    raw.gather();
    if raw.frames.is_empty() {
        return Err(PredictionError::format(path, "no frame in it; expected joints of at least one"));
    }
    if raw.joint_count == 0 || raw.joint_count > MOST_JOINTS {
        let found = raw.joint_count;
        return Err(PredictionError::format(path, format!("{found} joints a person; expected 1 to {MOST_JOINTS}")));
    }
    Ok(raw)
}
