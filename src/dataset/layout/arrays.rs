//! What layouts read alike: the map of a view, and truth in metres with the keys of SPEC section 6.

use crate::dataset::npz::{Array, NpzArchive, NpzError};
use crate::dataset::{Heatmap, MAX_PERSONS, Truth};
use crate::geometry::Vec3;
use crate::radar::View;
use std::path::Path;

/// The map of a view, refused by its header where it is another.
pub(super) fn read_map(file: &mut NpzArchive, view: &View) -> Result<Heatmap, NpzError> {
    file.require_shape(&view.array, &view.shape(), ", the bins of its axes")?;
    let Array { shape, data, dtype } = file.read(&view.array)?;
    Ok(Heatmap { shape, data, dtype })
}

/// The share of zeros of which a map was rounded to few steps, as one that was taken from a picture is.
const ROUNDED_SHARE: f64 = 0.01;

/// Takes the zeros of a map that was rounded for half of its smallest number: nothing would stand out from a background of 0 by any
/// finite ratio. What was done, in words; `None` where there are few zeros.
pub(super) fn lift_zeros(data: &mut [f64]) -> Option<String> {
    let least = data.iter().copied().filter(|x| *x > 0.0).fold(f64::INFINITY, f64::min);
    let zeros = data.iter().filter(|x| **x == 0.0).count();
    let share = zeros as f64 / data.len().max(1) as f64;
    if !least.is_finite() || share < ROUNDED_SHARE {
        return None;
    }
    data.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = 0.5 * least);
    Some(format!("{:.0} % of its cells are 0: taken for half of the smallest number, {least:.3e}", 100.0 * share))
}

/// A number: 0-d, or one element.
pub(super) fn scalar(file: &mut NpzArchive, key: &str) -> Result<Option<f64>, NpzError> {
    if !file.contains(key) {
        return Ok(None);
    }
    let one = |shape: &[usize]| shape.iter().all(|&n| n == 1);
    file.require(key, |shape| if one(shape) { Ok(()) } else { Err("one number".into()) })?;
    Ok(file.read(key)?.data.first().copied())
}

/// Joints and velocities, where the file has them.
pub(super) fn read_truth(file: &mut NpzArchive, joints: usize) -> Result<Option<Truth>, NpzError> {
    let Some((persons, positions)) = vectors(file, "joints", joints)? else { return Ok(None) };
    let velocities = vectors(file, "velocities", joints)?;
    if let Some((moving, _)) = &velocities
        && *moving != persons
    {
        let expected = format!("({persons}, {joints}, 3), as `joints`");
        return Err(file.wrong_shape("velocities", &[*moving, joints, 3], expected));
    }
    Ok(Some(Truth { joints: positions, velocities: velocities.map(|(_, v)| v), persons }))
}

/// (persons, joints, 3) as persons and 3-vectors.
fn vectors(file: &mut NpzArchive, key: &str, joints: usize) -> Result<Option<(usize, Vec<Vec3>)>, NpzError> {
    if !file.contains(key) {
        return Ok(None);
    }
    file.require(key, |shape| match *shape {
        [persons, n, 3] if n == joints && persons <= MAX_PERSONS => Ok(()),
        [_, n, 3] if n == joints => Err(format!("at most {MAX_PERSONS} persons")),
        _ => Err(format!("(persons, {joints}, 3), {joints} being the joints of the skeleton")),
    })?;
    let array = file.read(key)?;
    Ok(Some((array.shape.first().copied().unwrap_or(0), array.data.as_chunks::<3>().0.to_vec())))
}

/// What an npz beside a frame says whose own files have no room for truth; all `None` where there is none. Public data sets have
/// none, simulated ones in the same layout do.
#[derive(Debug, Default)]
pub(super) struct Known {
    pub(super) truth: Option<Truth>,
    pub(super) person_count: Option<usize>,
    pub(super) timestamp_s: Option<f64>,
}

/// Reads the file where it is; what is wrong with it becomes a note.
pub(super) fn truth_beside(path: &Path, joints: usize, notes: &mut Vec<String>) -> Known {
    if !path.exists() {
        return Known::default();
    }
    let read = || {
        let mut file = NpzArchive::open(path)?;
        let truth = read_truth(&mut file, joints)?;
        let timestamp_s = scalar(&mut file, "timestamp_s")?;
        let person_count = truth.as_ref().map(|truth| truth.persons);
        Ok::<Known, NpzError>(Known { truth, person_count, timestamp_s })
    };
    read().unwrap_or_else(|error| {
        notes.push(format!("no truth: {error}"));
        Known::default()
    })
}
