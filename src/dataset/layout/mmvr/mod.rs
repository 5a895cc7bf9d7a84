//! MMVR: folders of `NNNNN_radar.npz` and their companions, any of which may be missing.
//!
//! The labels are pixels of a camera image and stay that; only the boxes drawn on the radar maps are in bins. Those lie
//! on disk as (column 0, row 0, column 1, row 1).

mod labels;
mod write;

use super::arrays::{read_map, truth_beside};
use super::index::{Folders, Segment};
use super::{DataFolder, FrameSource, FrameWriter, Layout, Opened, manifest_beside, no_single_file};
use crate::dataset::Origin;
use crate::dataset::manifest::Manifest;
use crate::dataset::npz::{NpzArchive, shape_text};
use crate::dataset::set::{DatasetInfo, MANIFEST_NAME, parent};
use crate::dataset::walk::Walk;
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::{PinholeCamera, View};
use crate::task::Progress;
use labels::load_labels;
use rayon::prelude::*;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The ending of a file that makes a frame.
const RADAR_SUFFIX: &str = "_radar.npz";
/// What may lie beside it; the last is this program's own.
const COMPANIONS: [&str; 5] = ["meta", "bbox", "pose", "mask", "truth"];
/// Folders inside each other: the data set has four.
const MAX_DEPTH: usize = 12;
/// Camera images, (width, height), px.
const IMAGE_SIZE: [usize; 2] = [640, 480];
/// The published intrinsics; lens distortion left out, as the code published with the data does.
const CAMERA: PinholeCamera = PinholeCamera { focal_px: [379.476, 379.476], centre_px: [322.457, 241.627] };

/// The layout.
#[derive(Debug)]
pub(super) struct Mmvr;

impl Layout for Mmvr {
    fn word(&self) -> &'static str {
        "mmvr"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((include_str!("../../../../assets/mmvr.toml"), "assets/mmvr.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("MMVR's NNNNN_radar.npz")
    }

    fn claims(&self, file: &Path) -> bool {
        stem_of(file).is_some()
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        open(place, None, progress)
    }

    fn open_file(&self, file: &Path, manifest: Option<&Manifest>, progress: &Progress) -> Result<Opened, DatasetError> {
        let Some(stem) = stem_of(file) else { return Err(no_single_file(self.word(), file, manifest)) };
        let manifest = manifest.map_or_else(|| manifest_beside(file, &Self), |manifest| Ok(manifest.clone()))?;
        open(&DataFolder { root: parent(file), manifest: &manifest, allow_outside: false }, Some(stem), progress)
    }

    fn writer(&self) -> Option<&dyn FrameWriter> {
        Some(self)
    }

    fn camera(&self) -> Option<PinholeCamera> {
        Some(CAMERA)
    }
}

/// All frames at or below a folder; those of the folder alone where it is opened for one of them, that of the stem `named`.
fn open(place: &DataFolder<'_>, named: Option<&str>, progress: &Progress) -> Result<Opened, DatasetError> {
    let depth = if named.is_some() { 0 } else { MAX_DEPTH };
    let (segments, notes) = segments(place.root, depth, progress)?;
    if segments.is_empty() {
        let expected = format!("{MANIFEST_NAME}, or MMVR's NNNNN{RADAR_SUFFIX} in it or in a folder below");
        return Err(place.without_frames(notes.iter().fold(expected, |text, note| format!("{text}; {note}"))));
    }
    let frames = Folders::new(segments);
    let at = |named| (0..frames.count()).find(|&i| frames.find(i).is_some_and(|(_, stem)| stem == named));
    let named = named.map(|named| at(named).unwrap_or(0));
    let preset = place.manifest.layout.preset()?;
    let mut info = place.info(&preset);
    info.notes = notes;
    if info.frame_rate_hz == preset.frame_rate_hz {
        info.assumptions.push("frame rate: 900 frames a minute-long segment, hence 15 a second".into());
    }
    if *info.views == *preset.views {
        info.assumptions.push("point spread: 0.06 m and 0.03 rad are assumed; MMVR does not publish its own".into());
        info.assumptions.push("quantity: amplitudes are assumed, from the spread of the values".into());
    }
    Ok(Opened { info, frames: Box::new(Frames(frames)), named })
}

/// The folders with frames at or below `root`, in natural order; and notes about what was left out.
///
/// # Errors
/// As [`Walk::of`].
fn segments(root: &Path, depth: usize, progress: &Progress) -> Result<(Vec<Segment>, Vec<String>), DatasetError> {
    progress.begin("listing folders", 0);
    // Links to companions are not asked whether they are folders; HIBER's folders hold hundreds of thousands of names.
    let skip = |name: &str| {
        Path::new(name).extension().is_some_and(|ending| ending == "npz") || super::hiber::FOLDERS.contains(&name)
    };
    let (folders, notes) = Walk { depth, stem: radar_stem, skip, progress }.of(root)?;
    // The root itself keeps the path that was typed: without a separator at its end.
    let path = |below: &Path| if below.as_os_str().is_empty() { root.to_owned() } else { root.join(below) };
    let segment = |folder: crate::dataset::walk::Folder| {
        let path = path(&folder.below);
        Segment::new(path.clone(), sequence_of(&path), folder.stems)
    };
    Ok((folders.into_iter().map(segment).collect(), notes))
}

/// `00383` of `00383_radar.npz`.
fn radar_stem(name: &str) -> Option<&str> {
    name.strip_suffix(RADAR_SUFFIX).filter(|stem| !stem.is_empty())
}

/// `00383` of `.../00383_radar.npz`.
fn stem_of(path: &Path) -> Option<&str> {
    radar_stem(path.file_name()?.to_str()?)
}

/// `d1s1/000` where the path has such a folder in it, else the folder's own name.
fn sequence_of(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let parts: Vec<String> = whole.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    let session = parts.iter().rposition(|part| is_session(part));
    let from = session.unwrap_or(parts.len().saturating_sub(1));
    parts.get(from..).unwrap_or_default().join("/")
}

/// `d<day>s<session>`.
fn is_session(name: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    name.strip_prefix('d')
        .and_then(|rest| rest.split_once('s'))
        .is_some_and(|(day, session)| digits(day) && digits(session))
}

/// The session of `d5s1/000`, and its scene: days 1 to 4 are the open room of P1, days 5 to 9 one of the five furnished rooms of P2
/// each. That a day is a room is concluded from their numbers, and published nowhere.
fn origin_of(sequence: &str) -> Origin {
    let session = sequence.split('/').next().filter(|part| is_session(part));
    let day = session.and_then(|session| session[1..].split('s').next()?.parse::<u32>().ok());
    let scene = day.filter(|day| (1..=9).contains(day)).map(|day| day.saturating_sub(3).max(1).to_string());
    Origin { scene, session: session.map(ToOwned::to_owned), ..Origin::default() }
}

/// The frames of a tree.
#[derive(Debug)]
struct Frames(Folders);

impl FrameSource for Frames {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        self.0.name(i, out)
    }

    fn sequences(&self) -> usize {
        self.0.segments().len()
    }

    fn sequence<'a>(&'a self, i: usize, _name: &'a str) -> Option<&'a str> {
        self.0.sequence(i)
    }

    fn origin(&self, i: usize) -> Origin {
        self.0.sequence(i).map_or_else(Origin::default, origin_of)
    }

    fn files(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        self.0.find(i).map(|(segment, stem)| segment.path.join(format!("{stem}{RADAR_SUFFIX}"))).into_iter().collect()
    }

    fn companions(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        let Some((segment, stem)) = self.0.find(i) else { return Vec::new() };
        COMPANIONS.map(|kind| segment.path.join(format!("{stem}_{kind}.npz"))).to_vec()
    }

    /// The maps in this thread, one after the other.
    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        let maps = |i| {
            let (segment, stem) = self.0.at(i, info)?;
            let mut file = NpzArchive::open(&segment.path.join(format!("{stem}{RADAR_SUFFIX}")))?;
            info.views.iter().map(|view| ungrouped_map(&mut file, view)).collect()
        };
        frames.map(maps).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let (Segment { path: folder, .. }, stem) = self.0.at(i, info)?;
        let radar = folder.join(format!("{stem}{RADAR_SUFFIX}"));
        let (maps, mut labels) = rayon::join(|| load_maps(&radar, info), || load_labels(folder, stem, info));
        let beside = folder.join(format!("{stem}_truth.npz"));
        let known = truth_beside(&beside, info.skeleton.joints.len(), &mut labels.notes);
        Ok(Frame {
            truth: known.truth,
            person_count: known.person_count.or(labels.person_count),
            timestamp_s: info
                .frame_rate_hz
                .and_then(|rate| stem.parse::<u32>().ok().map(|number| f64::from(number) / rate)),
            maps: maps?,
            ..labels
        })
    }
}

/// One map a view. Inflating is what takes the time, so each view has its own reader and thread.
fn load_maps(path: &Path, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
    let maps: Vec<_> = info.views.par_iter().map(|view| load_map(path, view)).collect();
    // Of several errors the first view's is told, whichever thread was faster.
    maps.into_iter().collect()
}

fn load_map(path: &Path, view: &View) -> Result<Heatmap, DatasetError> {
    ungrouped_map(&mut NpzArchive::open(path)?, view)
}

/// The map of a view, told from the variant with four frames in a file.
fn ungrouped_map(file: &mut NpzArchive, view: &View) -> Result<Heatmap, DatasetError> {
    let expected = view.shape();
    let got = file.entry(&view.array)?.shape;
    if got.len() == expected.len() + 1 && got.ends_with(&expected) {
        let message = format!(
            "array `{}` has shape {}: this is the grouped variant of MMVR, several frames in one file, which is not read; \
             expected {}: open the ungrouped data set",
            view.array,
            shape_text(&got),
            shape_text(&expected)
        );
        return Err(DatasetError::Frame { message, path: file.path().to_owned() });
    }
    Ok(read_map(file, view)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_sequences_by_session_and_segment() {
        assert_eq!(sequence_of(Path::new("/data/MMVR/P1/d1s1/000")), "d1s1/000");
        assert_eq!(sequence_of(Path::new("/data/mmvr")), "mmvr");
        assert_eq!(sequence_of(Path::new("/data/dxs1/007")), "007");
    }

    #[test]
    fn a_day_is_a_scene() {
        assert_eq!(origin_of("d3s2/004").to_string(), "scene 1, session d3s2");
        assert_eq!(origin_of("d5s1/000").to_string(), "scene 2, session d5s1");
        assert_eq!(origin_of("d9s6/010").to_string(), "scene 6, session d9s6");
        assert!(origin_of("mmvr").is_unknown());
    }
}
