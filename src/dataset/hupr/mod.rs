//! HuPR: `single_<k>/{hori,vert}/NNNNNNNNN.npy`, complex cubes (16, 64, 64, 8) of Doppler, range, angle and "elevation".
//!
//! The last axis is no angle: four of the eight antennas of the line skip its FFT, so that a target stays in bin 3 whatever its
//! height. Bin 3 is also the one at which all twelve antennas are summed in phase; its amplitude is the map, (16, 64, 64).
//! A cube is 8 MiB; it is read in pieces, and only the map is held.

mod annotations;

pub(super) use annotations::Annotations;

use super::files::{Segment, natural};
use super::npz::{NPY_KEY, NpzArchive, shape_text};
use super::truth::truth_beside;
use super::walk::Walk;
use super::{DatasetError, DatasetInfo, Frame, Heatmap};
use crate::radar::View;
use crate::task::Progress;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Bins of the last axis, and the one that is taken.
pub(crate) const LEVELS: usize = 8;
pub(crate) const LEVEL: usize = 3;
/// The folders of the two cubes of a frame.
pub(super) const RADARS: [&str; 2] = ["hori", "vert"];
/// Folders inside each other that are looked into: those of the two radars included.
const MAX_DEPTH: usize = 7;

/// The sequences at or below `root`, in natural order, and notes about frames of which one cube is missing.
///
/// # Errors
/// As [`Walk::of`].
pub(super) fn sequences(root: &Path, progress: &Progress) -> Result<(Vec<Segment>, Vec<String>), DatasetError> {
    let (folders, mut notes) = Walk { depth: MAX_DEPTH, stem: cube_stem, skip: |_| false, progress }.of(root)?;
    let mut sequences: BTreeMap<PathBuf, [BTreeSet<String>; 2]> = BTreeMap::new();
    for folder in folders {
        let Some(radar) = RADARS.iter().position(|radar| folder.below.ends_with(radar)) else { continue };
        let parent = folder.below.parent().unwrap_or(Path::new(""));
        sequences.entry(root.join(parent)).or_default()[radar] = folder.stems.into_iter().collect();
    }
    let mut found = Vec::new();
    for (folder, [hori, vert]) in sequences {
        let missing = hori.symmetric_difference(&vert).count();
        if missing > 0 {
            notes.push(format!("{}: {missing} frames have only one of hori and vert", folder.display()));
        }
        let name = folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let all = hori.union(&vert).cloned().collect();
        found.push(Segment::named(folder, name, all));
    }
    found.sort_by(|a: &Segment, b: &Segment| natural(&a.path.to_string_lossy(), &b.path.to_string_lossy()));
    notes.sort();
    Ok((found, notes))
}

/// `000000007` of `000000007.npy`.
fn cube_stem(name: &str) -> Option<&str> {
    name.strip_suffix(".npy").filter(|stem| !stem.is_empty() && !stem.starts_with('.'))
}

/// Loads the frame `stem` of a sequence.
pub(super) fn load(
    index: usize,
    folder: &Path,
    sequence: &str,
    stem: &str,
    labels: &Annotations,
    info: &DatasetInfo,
) -> Result<Frame, DatasetError> {
    let maps = maps_only(folder, stem, info)?;
    let mut notes = Vec::new();
    let image = labels.of(sequence, stem, &mut notes);
    let beside = folder.join("truth").join(format!("{stem}.npz"));
    let known = truth_beside(&beside, info.skeleton.joints.len(), &mut notes);
    let number = stem.parse::<u32>().ok();
    let labelled = image.as_ref().map(|image| image.keypoints.len().max(image.boxes.len()));
    Ok(Frame {
        index,
        name: format!("{sequence}/{stem}"),
        global_id: None,
        timestamp_s: known
            .timestamp_s
            .or_else(|| info.frame_rate_hz.and_then(|rate| number.map(|number| f64::from(number) / rate))),
        maps,
        map_boxes: vec![Vec::new(); info.views.len()],
        person_count: known.person_count.or(labelled),
        truth: known.truth,
        image,
        notes,
    })
}

/// The maps alone, one cube after the other.
pub(super) fn maps_only(folder: &Path, stem: &str, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
    info.views.iter().map(|view| read_map(folder, stem, view)).collect()
}

fn read_map(folder: &Path, stem: &str, view: &View) -> Result<Heatmap, DatasetError> {
    let path = folder.join(&view.array).join(format!("{stem}.npy"));
    let other = RADARS.into_iter().find(|radar| *radar != view.array).unwrap_or("hori");
    if !path.exists() && folder.join(other).join(format!("{stem}.npy")).exists() {
        return Err(DatasetError::HalfFrame { present: other.to_owned(), path });
    }
    let mut file = NpzArchive::open(&path)?;
    let expected = [view.shape(), vec![LEVELS]].concat();
    let entry = file.entry(NPY_KEY)?;
    if entry.shape != expected {
        let expected = format!("{}, the bins of its axes and {LEVELS} of elevation", shape_text(&expected));
        return Err(file.wrong_shape(NPY_KEY, &entry.shape, expected).into());
    }
    let map = file.read_amplitudes(NPY_KEY, LEVELS, LEVEL)?;
    Ok(Heatmap { shape: view.shape(), data: map.data, dtype: map.dtype })
}

/// What was assumed, in words.
pub(super) fn assumptions() -> [String; 3] {
    [
        "chirp: HuPR does not publish it; 77 GHz, 60.012 MHz/µs and 4.4 Msps follow from its range step of 4.3 cm"
            .into(),
        "elevation: the cube's last axis is no angle; its bin 3, where all antennas are summed, is the map".into(),
        "left and right: the antennas are taken to be numbered from left to right (hori), from top to bottom (vert)"
            .into(),
    ]
}
