//! One frame of a generic data set (an npz beside a manifest) and of a bare file.

use super::npz::{Array, NpzArchive, shape_text};
use super::{DatasetError, DatasetInfo, Frame, Heatmap, MAX_PERSONS, NpzError, Truth};
use crate::geometry::Vec3;
use crate::radar::View;
use std::ops::Range;
use std::path::Path;

/// Loads an npz of maps, with joints, velocities, person count and time where it has them; SPEC section 6.
pub(super) fn load(index: usize, name: String, path: &Path, info: &DatasetInfo) -> Result<Frame, DatasetError> {
    let mut file = NpzArchive::open(path)?;
    let mut notes = Vec::new();
    let maps = read_maps(&mut file, info)?;
    let truth = read_truth(&mut file, info.skeleton.joints.len())?;
    let person_count = match scalar(&mut file, "person_count")? {
        Some(count) if count >= 0.0 && count.fract() == 0.0 => Some(count as usize),
        Some(count) => {
            notes.push(format!("person_count is {count}; expected a whole number, it is ignored"));
            None
        }
        None => None,
    };
    if let (Some(count), Some(truth)) = (person_count, &truth)
        && count != truth.persons
    {
        notes.push(format!("person_count is {count}, joints has {} persons", truth.persons));
    }
    let timestamp_s = scalar(&mut file, "timestamp_s")?;
    Ok(Frame {
        index,
        name,
        global_id: None,
        timestamp_s: timestamp_s.or_else(|| info.frame_rate_hz.map(|rate| index as f64 / rate)),
        maps,
        map_boxes: vec![Vec::new(); info.views.len()],
        person_count: person_count.or_else(|| truth.as_ref().map(|truth| truth.persons)),
        truth,
        image: None,
        notes,
    })
}

/// The maps of an npz alone, or the arrays of a bare file that holds one frame.
pub(super) fn maps_only(path: &Path, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
    Ok(read_maps(&mut NpzArchive::open(path)?, info)?)
}

fn read_maps(file: &mut NpzArchive, info: &DatasetInfo) -> Result<Vec<Heatmap>, NpzError> {
    info.views.iter().map(|view| read_map(file, view)).collect()
}

/// The map of a view, refused by its header where it is another.
fn read_map(file: &mut NpzArchive, view: &View) -> Result<Heatmap, NpzError> {
    file.require_shape(&view.array, &view.shape(), ", the bins of its axes")?;
    let Array { shape, data, dtype } = file.read(&view.array)?;
    Ok(Heatmap { shape, data, dtype })
}

/// The maps of consecutive frames of a stacked bare file, read in one pass.
pub(super) fn stacked_maps(
    frames: &Range<usize>,
    path: &Path,
    info: &DatasetInfo,
) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
    let mut file = NpzArchive::open(path)?;
    let mut maps: Vec<Vec<Heatmap>> = frames.clone().map(|_| Vec::with_capacity(info.views.len())).collect();
    for view in &info.views {
        let shape = view.shape();
        require_stack(&mut file, view)?;
        let slabs = file.read_slabs(&view.array, frames.clone())?;
        for (maps, cells) in maps.iter_mut().zip(slabs.data.chunks_exact(view.cells().max(1))) {
            maps.push(Heatmap { shape: shape.clone(), data: cells.to_vec(), dtype: slabs.dtype.clone() });
        }
    }
    Ok(maps)
}

/// Loads frame `index` of a bare file: the arrays themselves, or slab `index` of each.
pub(super) fn load_bare(
    index: usize,
    name: String,
    path: &Path,
    stacked: bool,
    info: &DatasetInfo,
) -> Result<Frame, DatasetError> {
    let mut file = NpzArchive::open(path)?;
    let maps = info.views.iter().map(|view| {
        if !stacked {
            return read_map(&mut file, view);
        }
        require_stack(&mut file, view)?;
        let Array { shape, data, dtype } = file.read_slab(&view.array, index)?;
        Ok(Heatmap { shape, data, dtype })
    });
    Ok(Frame {
        index,
        name,
        global_id: None,
        timestamp_s: info.frame_rate_hz.map(|rate| index as f64 / rate),
        maps: maps.collect::<Result<Vec<_>, NpzError>>()?,
        map_boxes: vec![Vec::new(); info.views.len()],
        person_count: None,
        truth: None,
        image: None,
        notes: Vec::new(),
    })
}

/// Refuses an array that is not frames of a view's maps, one after the other.
fn require_stack(file: &mut NpzArchive, view: &View) -> Result<(), NpzError> {
    let shape = view.shape();
    file.require(&view.array, |got| match got.split_first() {
        Some((_, rest)) if rest == shape => Ok(()),
        _ => Err(format!("(frames, …) of {}, the bins of its axes", shape_text(&shape))),
    })
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
