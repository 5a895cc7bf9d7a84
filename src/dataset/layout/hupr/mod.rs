//! HuPR: `single_<k>/{hori,vert}/NNNNNNNNN.npy`, complex cubes (16, 64, 64, 8) of Doppler, range, angle and "elevation".
//!
//! The last axis is no angle: four of the eight antennas of the line skip its FFT, so that a target stays in bin 3 whatever its
//! height. Bin 3 is also the one at which all twelve antennas are summed in phase; its amplitude is the map, (16, 64, 64).
//! A cube is 8 MiB; it is read in pieces, and only the map is held.
//!
//! Raw captures, `single_<k>/{hori,vert}/adc_data.bin`, become the same maps by the same processing, a frame when it is asked for
//! (`raw.rs`). The chirp is not published: what is inferred of it is said, and `[capture.chirp]` of a manifest says another.

mod annotations;
mod raw;
mod write;

use super::arrays::truth_beside;
use super::index::{Folders, Segment};
use super::{DataFolder, FrameSource, FrameWriter, Layout, MapArray, Opened, Stored};
use crate::dataset::Origin;
use crate::dataset::natural::natural;
use crate::dataset::npz::{NPY_KEY, NpzArchive, shape_text};
use crate::dataset::set::DatasetInfo;
use crate::dataset::walk::Walk;
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::View;
use crate::task::Progress;
use annotations::Annotations;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bins of the last axis, and the one that is taken.
const LEVELS: usize = 8;
const LEVEL: usize = 3;
/// The folders of the two cubes of a frame.
const RADARS: [&str; 2] = ["hori", "vert"];
/// Folders inside each other that are looked into: those of the two radars included.
const MAX_DEPTH: usize = 7;

/// The layout.
#[derive(Debug)]
pub(super) struct Hupr;

impl Layout for Hupr {
    fn word(&self) -> &'static str {
        "hupr"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((include_str!("../../../../assets/hupr.toml"), "assets/hupr.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("HuPR's hori/ and vert/")
    }

    fn writer(&self) -> Option<&dyn FrameWriter> {
        Some(self)
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        progress.begin("listing folders", 0);
        let (segments, notes) = sequences(place.root, progress)?;
        if segments.is_empty() {
            return raw::open(place, progress);
        }
        let mut info = place.info(&place.manifest.layout.preset()?);
        raw::with_chirp(place, &mut info)?;
        info.notes = notes;
        info.notes.push(annotations::splits_of(&segments));
        info.assumptions.extend(assumptions());
        let labels = Annotations::beside(place.root, &segments);
        let frames = Frames { folders: Folders::new(segments), labels };
        Ok(Opened { info, frames: Box::new(frames), named: None })
    }
}

/// The sequences at or below `root`, in natural order, and notes about frames of which one cube is missing.
///
/// # Errors
/// As [`Walk::of`].
fn sequences(root: &Path, progress: &Progress) -> Result<(Vec<Segment>, Vec<String>), DatasetError> {
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
        found.push(Segment::new(folder, name, all));
    }
    found.sort_by(|a: &Segment, b: &Segment| natural(&a.path.to_string_lossy(), &b.path.to_string_lossy()));
    notes.sort();
    Ok((found, notes))
}

/// `000000007` of `000000007.npy`.
fn cube_stem(name: &str) -> Option<&str> {
    name.strip_suffix(".npy").filter(|stem| !stem.is_empty() && !stem.starts_with('.'))
}

/// The frames of all sequences, and the label files of all.
#[derive(Debug)]
struct Frames {
    folders: Folders,
    labels: Annotations,
}

impl FrameSource for Frames {
    fn count(&self) -> usize {
        self.folders.count()
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        self.folders.name(i, out)
    }

    fn sequences(&self) -> usize {
        self.folders.segments().len()
    }

    fn sequence<'a>(&'a self, i: usize, _name: &'a str) -> Option<&'a str> {
        self.folders.sequence(i)
    }

    fn origin(&self, i: usize) -> Origin {
        self.folders.sequence(i).map_or_else(Origin::default, |sequence| self.labels.origin(sequence))
    }

    fn files(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        let Some((segment, stem)) = self.folders.find(i) else { return Vec::new() };
        info.views.iter().map(|view| segment.path.join(&view.array).join(format!("{stem}.npy"))).collect()
    }

    /// One cube a view.
    fn arrays(&self, place: usize, _info: &DatasetInfo) -> Vec<MapArray> {
        let stored = Stored::Amplitude { every: LEVELS, first: LEVEL };
        vec![MapArray { key: NPY_KEY.to_owned(), view: place, stored }]
    }

    fn companions(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        self.folders.find(i).map(|(segment, stem)| truth_path(segment, stem)).into_iter().collect()
    }

    fn label_files(&self) -> Vec<PathBuf> {
        self.labels.paths().map(Path::to_owned).collect()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| self.folders.at(i, info).and_then(|(segment, stem)| maps(&segment.path, stem, info))).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let (segment, stem) = self.folders.at(i, info)?;
        let maps = maps(&segment.path, stem, info)?;
        let mut notes = Vec::new();
        let image = self.labels.of(&segment.sequence, stem, &mut notes);
        let known = truth_beside(&truth_path(segment, stem), info.skeleton.joints.len(), &mut notes);
        let number = stem.parse::<u32>().ok();
        let labelled = image.as_ref().map(|image| image.keypoints.len().max(image.boxes.len()));
        Ok(Frame {
            global_id: self.labels.who(&segment.sequence),
            timestamp_s: known
                .timestamp_s
                .or_else(|| info.frame_rate_hz.and_then(|rate| number.map(|number| f64::from(number) / rate))),
            maps,
            map_boxes: vec![Vec::new(); info.views.len()],
            person_count: known.person_count.or(labelled),
            truth: known.truth,
            image,
            notes,
            ..Frame::default()
        })
    }
}

/// The truth beside the cubes of a frame.
fn truth_path(segment: &Segment, stem: &str) -> PathBuf {
    segment.path.join("truth").join(format!("{stem}.npz"))
}

/// The maps of a frame, one cube after the other.
fn maps(folder: &Path, stem: &str, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
    info.views.iter().map(|view| read_map(folder, stem, view)).collect()
}

fn read_map(folder: &Path, stem: &str, view: &View) -> Result<Heatmap, DatasetError> {
    let path = folder.join(&view.array).join(format!("{stem}.npy"));
    let other = RADARS.into_iter().find(|radar| *radar != view.array).unwrap_or("hori");
    if !path.exists() && folder.join(other).join(format!("{stem}.npy")).exists() {
        let message = format!("no such file; a frame of HuPR has two cubes, and the one in {other}/ is there");
        return Err(DatasetError::Frame { message, path });
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
fn assumptions() -> [String; 3] {
    [
        "chirp: inferred, HuPR does not publish it; 77 GHz, 60.012 MHz/µs and 4.4 Msps follow from its range step of 4.3 cm; \
         [capture.chirp] in a dataset.toml says another"
            .into(),
        "elevation: the cube's last axis is no angle; its bin 3, where all antennas are summed, is the map".into(),
        "left and right: the antennas are taken to be numbered from left to right (hori), from top to bottom (vert)"
            .into(),
    ]
}
