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
