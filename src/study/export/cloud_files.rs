//! Point clouds as npz, PLY (binary little endian 1.0) and PCD (0.7, binary), with the same five numbers a point: `x y z` (m),
//! `v_r` (m/s), `intensity`; and `view`, the map that it was found in.

use super::ExportError;
use crate::dataset::npz::{ArrayView, write};
use crate::output::replace_file;
use crate::representation::CloudPoint;
use std::path::Path;

const FIELDS: [&str; 5] = ["x", "y", "z", "v_r", "intensity"];

fn numbers(point: &CloudPoint) -> [f32; 5] {
    let [x, y, z] = point.position;
    [x, y, z, point.radial_mps, point.intensity].map(|n| n.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32)
}

/// `points` (n, 5) float32 with the columns `x y z v_r intensity`, and `view` (n,) int64.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_cloud_npz(path: &Path, points: &[CloudPoint]) -> Result<(), ExportError> {
    let flat: Vec<f32> = points.iter().flat_map(numbers).collect();
    let views: Vec<i64> = points.iter().map(|point| point.view as i64).collect();
    let arrays = [
        ("points", ArrayView::f32(&[points.len(), FIELDS.len()], &flat)),
        ("view", ArrayView::i64(&[points.len()], &views)),
    ];
    Ok(write(path, &arrays)?)
}

/// A vertex a point: five floats and an int.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_cloud_ply(path: &Path, points: &[CloudPoint]) -> Result<(), ExportError> {
    let properties = FIELDS.map(|name| format!("property float {name}\n")).concat();
    let head = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres and m/s; x forward, y left, z up, radar at the origin\n\
         element vertex {}\n{properties}property int view\nend_header\n",
        points.len()
    );
    put(path, head, points)
}

/// Version 0.7, unorganised, binary.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_cloud_pcd(path: &Path, points: &[CloudPoint]) -> Result<(), ExportError> {
    let n = points.len();
    let head = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {} view\nSIZE 4 4 4 4 4 4\nTYPE F F F F F I\n\
         COUNT 1 1 1 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA binary\n",
        FIELDS.join(" ")
    );
    put(path, head, points)
}

fn put(path: &Path, head: String, points: &[CloudPoint]) -> Result<(), ExportError> {
    let mut bytes = head.into_bytes();
    for point in points {
        for number in numbers(point) {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend((point.view as i32).to_le_bytes());
    }
    replace_file(path, |out| out.write_all(&bytes)).map_err(ExportError::writing(path))
}
