//! XRF55: `mmWave/XX_YY_ZZ.npy`, real stacks (17, 256, 128), with or without a leading axis of one.
//!
//! What the axes are is not published. A view of two axes takes each of the 17 as a frame, a view of three takes a file as one;
//! the preset (`assets/xrf55.toml`) says which is assumed. XX_YY_ZZ are volunteer, action and repetition, however they are padded.

use super::files::natural;
use super::npz::{NPY_KEY, NpzArchive, shape_text};
use super::truth::truth_beside;
use super::walk::{Folder, Walk};
use super::{DatasetError, DatasetInfo, Frame, Heatmap};
use crate::task::Progress;
use std::path::{Path, PathBuf};

/// Maps of a file.
pub const STEPS: usize = 17;
/// Folders inside each other that are looked into.
const MAX_DEPTH: usize = 6;
/// The other sensors' folders, whose files have the same names.
const OTHERS: [&str; 2] = ["rfid", "wifi"];

/// The stacks at or below `root`, in natural order, relative to it; and notes about what was left out.
///
/// # Errors
/// As [`Walk::of`].
pub(super) fn stacks(root: &Path, progress: &Progress) -> Result<(Vec<PathBuf>, Vec<String>), DatasetError> {
    let skip = |name: &str| OTHERS.iter().any(|sensor| name.eq_ignore_ascii_case(sensor));
    let (folders, notes) = Walk { depth: MAX_DEPTH, stem: stack_name, skip, progress }.of(root)?;
    let inside = |folder: Folder| folder.stems.into_iter().map(move |name| folder.below.join(name));
    let mut found: Vec<PathBuf> = folders.into_iter().flat_map(inside).collect();
    found.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok((found, notes))
}

/// The name itself where it is that of a stack.
fn stack_name(name: &str) -> Option<&str> {
    name.strip_suffix(".npy").is_some_and(is_stack).then_some(name)
}

/// Three whole numbers: `01_07_12`, `15_4_3`.
pub(super) fn is_stack(stem: &str) -> bool {
    let number = |part: &str| !part.is_empty() && part.len() <= 4 && part.bytes().all(|b| b.is_ascii_digit());
    let parts: Vec<&str> = stem.split('_').collect();
    parts.len() == 3 && parts.into_iter().all(number)
}

/// Loads step `step` of a file, or all of it where views have three axes.
pub(super) fn load(
    index: usize,
    name: String,
    path: &Path,
    step: usize,
    info: &DatasetInfo,
) -> Result<Frame, DatasetError> {
    let maps = maps_only(path, step, info)?;
    let mut notes = Vec::new();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let beside = path.with_file_name(format!("{stem}_truth_{step:02}.npz"));
    let known = truth_beside(&beside, info.skeleton.joints.len(), &mut notes);
    Ok(Frame {
        index,
        name,
        global_id: None,
        timestamp_s: known.timestamp_s.or_else(|| info.frame_rate_hz.map(|rate| step as f64 / rate)),
        maps,
        map_boxes: vec![Vec::new(); info.views.len()],
        person_count: known.person_count,
        truth: known.truth,
        image: None,
        notes,
    })
}

/// The maps alone.
pub(super) fn maps_only(path: &Path, step: usize, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
    let mut file = NpzArchive::open(path)?;
    let read = |view: &crate::radar::View| {
        let expected = view.shape();
        let stacked = expected.len() == 2;
        let wanted = if stacked { [vec![STEPS], expected.clone()].concat() } else { expected.clone() };
        let entry = file.entry(NPY_KEY)?;
        let batched = entry.shape.first() == Some(&1) && entry.shape.get(1..) == Some(&wanted[..]);
        if entry.shape != wanted && !batched {
            let expected = format!("{}, the maps of a clip and the bins of their axes", shape_text(&wanted));
            return Err(DatasetError::from(file.wrong_shape(NPY_KEY, &entry.shape, expected)));
        }
        let (data, dtype) = if stacked && !batched {
            let slab = file.read_slab(NPY_KEY, step)?;
            (slab.data, slab.dtype)
        } else {
            let whole = file.read(NPY_KEY)?;
            let cells = view.cells();
            let part = if stacked { step * cells..(step + 1) * cells } else { 0..cells };
            (whole.data.get(part).unwrap_or_default().to_vec(), whole.dtype)
        };
        Ok(Heatmap { shape: expected, data, dtype })
    };
    info.views.iter().map(read).collect()
}

/// What was assumed, in words.
pub(super) fn assumptions() -> [String; 2] {
    [
        "axes: XRF55 does not publish them; each file is taken for 17 maps of range (256) × azimuth (128, uniform in the sine) in 5 s"
            .into(),
        "chirp: that of XRF55's capture script, 60 GHz and 27.013 MHz/µs over 256 samples".into(),
    ]
}
