//! Whether a file that was dropped is one of predictions: told by its name and its head.

use crate::body::Group;
use crate::dataset::npz::NpzArchive;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

/// Bytes of a header that are looked at.
const HEAD: u64 = 1 << 16;

/// True for JSON, Parquet, tables with coordinates of joints, arrays that hold joints and no map, PPPR files, and folders of results.
pub fn looks_like_predictions(path: &Path) -> bool {
    if path.is_dir() {
        return path.join("pppr").is_dir();
    }
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match ending.as_str() {
        "parquet" => true,
        "json" => !path.to_string_lossy().ends_with(".mmwave.json"),
        "csv" => header(path).is_some_and(|header| {
            let has = |name: &str| header.split(',').any(|column| column.trim() == name);
            let coordinate =
                |column: &str| ["_x", "_x_m", "_x_mm", "_x_cm"].iter().any(|end| column.trim().ends_with(end));
            has("joint") || header.split(',').any(coordinate)
        }),
        "npz" | "npy" => arrays(path).unwrap_or(false),
        _ => false,
    }
}

fn header(path: &Path) -> Option<String> {
    let file = crate::input::open_file(path, "a table").ok()?;
    let lines = BufReader::new(std::io::Read::take(file, HEAD)).lines();
    lines.map_while(Result::ok).find(|line| !line.starts_with('#')).map(|line| line.to_lowercase())
}

fn arrays(path: &Path) -> Option<bool> {
    let mut file = NpzArchive::open(path).ok()?;
    if Group::ALL.iter().all(|group| file.contains(group.key())) {
        return Some(true);
    }
    let entries = file.entries().ok()?;
    let joints = |shape: &[usize]| (3..=4).contains(&shape.len()) && shape.last() == Some(&3);
    let map = |shape: &[usize]| shape.len() >= 2 && shape.last() != Some(&3);
    let real = || entries.iter().filter(|entry| entry.is_real);
    Some(real().any(|entry| joints(&entry.shape)) && !real().any(|entry| map(&entry.shape)))
}
