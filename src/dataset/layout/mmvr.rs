//! MMVR: folders of `NNNNN_radar.npz` and their companions, any of which may be missing.
//!
//! The labels are pixels of a camera image and stay that; only the boxes drawn on the radar maps are in bins. Those lie
//! on disk as (column 0, row 0, column 1, row 1).

use super::arrays::{read_map, truth_beside};
use super::index::{Folders, Segment};
use super::{FrameSource, Layout, Opened, Place, manifest_beside, no_single_file};
use crate::dataset::manifest::Manifest;
use crate::dataset::npz::{NpzArchive, NpzError, shape_text};
use crate::dataset::set::{DatasetInfo, MANIFEST_NAME, parent};
use crate::dataset::walk::Walk;
use crate::dataset::{DatasetError, Frame, Heatmap, ImageAnnotations, MAX_PERSONS};
use crate::radar::{PinholeCamera, View};
use crate::task::Progress;
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
/// Bytes of a frame's global id: the grouped variant has four of five characters.
const ID_BYTES: u64 = 4096;
/// Width or height of an image that is accepted, px.
const MAX_SIDE: usize = 8192;
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
        Some((include_str!("../../../assets/mmvr.toml"), "assets/mmvr.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("MMVR's NNNNN_radar.npz")
    }

    fn claims(&self, file: &Path) -> bool {
        stem_of(file).is_some()
    }

    fn open(&self, place: &Place<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        open(place, None, progress)
    }

    fn open_file(&self, file: &Path, manifest: Option<&Manifest>, progress: &Progress) -> Result<Opened, DatasetError> {
        let Some(stem) = stem_of(file) else { return Err(no_single_file(self.word(), file, manifest)) };
        let manifest = manifest.map_or_else(|| manifest_beside(file, &Self), |manifest| Ok(manifest.clone()))?;
        open(&Place { root: parent(file), manifest: &manifest, allow_outside: false }, Some(stem), progress)
    }

    fn camera(&self) -> Option<PinholeCamera> {
        Some(CAMERA)
    }
}

/// All frames at or below a folder; those of the folder alone where it is opened for one of them, that of the stem `named`.
fn open(place: &Place<'_>, named: Option<&str>, progress: &Progress) -> Result<Opened, DatasetError> {
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
    // Links to companions are not asked whether they are folders.
    let skip = |name: &str| Path::new(name).extension().is_some_and(|ending| ending == "npz");
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

/// A frame without its maps: what the companions say, and notes about those that are missing.
fn load_labels(folder: &Path, stem: &str, info: &DatasetInfo) -> Frame {
    let mut labels = Labels { folder, stem, notes: Vec::new() };
    let global_id = labels.open("meta", "no global frame id").and_then(|mut file| {
        let ids = file.require_bytes("global_frame_id", ID_BYTES).and_then(|()| file.read_texts("global_frame_id"));
        labels.keep(ids).map(|ids| ids.join(", "))
    });
    let Boxes { on_maps: map_boxes, in_image: image_boxes } = labels.boxes(info);
    let keypoints = labels.keypoints();
    let masks = labels.masks();
    let person_count = labels.count([
        ("boxes", image_boxes.as_ref().map(Vec::len)),
        ("key points", keypoints.as_ref().map(Vec::len)),
        ("masks", masks.as_ref().map(|(_, masks)| masks.len())),
    ]);
    let size = masks.as_ref().map_or(IMAGE_SIZE, |(size, _)| *size);
    let image = (image_boxes.is_some() || keypoints.is_some() || masks.is_some()).then(|| ImageAnnotations {
        size,
        keypoints: keypoints.unwrap_or_default(),
        keypoint_skeleton: "coco17".into(),
        boxes: image_boxes.unwrap_or_default(),
        masks: masks.map(|(_, masks)| masks).unwrap_or_default(),
    });
    Frame { global_id, map_boxes, person_count, image, notes: labels.notes, ..Frame::default() }
}

/// Labelled boxes.
struct Boxes {
    /// On each view's map, in bins: row, column, row, column.
    on_maps: Vec<Vec<[f64; 4]>>,
    /// In the image: x0, y0, x1, y1 px, score; `None` where the file or the array is missing.
    in_image: Option<Vec<[f64; 5]>>,
}

/// The companions of one frame, and what is wrong with them.
struct Labels<'a> {
    folder: &'a Path,
    stem: &'a str,
    notes: Vec<String>,
}

impl Labels<'_> {
    /// Opens a companion; a missing or damaged one becomes a note.
    fn open(&mut self, kind: &str, without: &str) -> Option<NpzArchive> {
        let path = self.folder.join(format!("{}_{kind}.npz", self.stem));
        match NpzArchive::open(&path) {
            Ok(file) => Some(file),
            Err(error) if error.is_not_found() => {
                self.notes.push(format!("{}_{kind}.npz is missing: {without}", self.stem));
                None
            }
            Err(error) => {
                self.notes.push(format!("{without}: {error}"));
                None
            }
        }
    }

    /// An unreadable array becomes a note too.
    fn keep<T>(&mut self, result: Result<T, NpzError>) -> Option<T> {
        result.map_err(|error| self.notes.push(error.to_string())).ok()
    }

    /// An array of shape (n, …rest), as rows of its first axis.
    fn rows(&mut self, file: &mut NpzArchive, key: &str, rest: &[usize]) -> Option<Vec<Vec<f64>>> {
        let fits = file.require(key, |shape| match shape.split_first() {
            // No person at all is stored with any number of axes.
            _ if shape.contains(&0) => Ok(()),
            Some((&persons, got)) if got == rest && persons <= MAX_PERSONS => Ok(()),
            Some((_, got)) if got == rest => Err(format!("at most {MAX_PERSONS} persons")),
            _ => Err(format!("(persons, {})", rest.iter().map(usize::to_string).collect::<Vec<_>>().join(", "))),
        });
        self.keep(fits)?;
        let array = self.keep(file.read(key))?;
        let width: usize = rest.iter().product();
        Some(array.data.chunks_exact(width.max(1)).map(<[f64]>::to_vec).collect())
    }

    /// Boxes on each view's map, in bins; and boxes in the image, px.
    fn boxes(&mut self, info: &DatasetInfo) -> Boxes {
        let Some(mut file) = self.open("bbox", "no boxes") else {
            return Boxes { on_maps: vec![Vec::new(); info.views.len()], in_image: None };
        };
        let mut on_maps = Vec::with_capacity(info.views.len());
        for view in &info.views {
            let key = format!("bbox_{}", view.array.strip_prefix("hm_").unwrap_or(&view.array));
            let rows = self.rows(&mut file, &key, &[4]).unwrap_or_default();
            let boxes = rows.iter().filter_map(|row| <[f64; 4]>::try_from(row.as_slice()).ok());
            on_maps.push(boxes.map(|[column0, row0, column1, row1]| [row0, column0, row1, column1]).collect());
        }
        let image = self.rows(&mut file, "bbox_i", &[5]);
        let in_image =
            image.map(|rows| rows.iter().filter_map(|row| <[f64; 5]>::try_from(row.as_slice()).ok()).collect());
        Boxes { on_maps, in_image }
    }

    /// Key points of each person: (x, y, score), px.
    fn keypoints(&mut self) -> Option<Vec<Vec<[f64; 3]>>> {
        let mut file = self.open("pose", "no key points")?;
        let persons = self.rows(&mut file, "kp", &[17, 3])?;
        let points = |person: &Vec<f64>| person.as_chunks::<3>().0.to_vec();
        Some(persons.iter().map(points).collect())
    }

    /// One mask a person and the image's size (width, height).
    fn masks(&mut self) -> Option<([usize; 2], Vec<Vec<bool>>)> {
        let mut file = self.open("mask", "no masks")?;
        let fits = file.require("mask", |shape| match *shape {
            [n, height, width] if n <= MAX_PERSONS && height <= MAX_SIDE && width <= MAX_SIDE => Ok(()),
            [_, _, _] => Err(format!("at most {MAX_PERSONS} persons of {MAX_SIDE} × {MAX_SIDE} px")),
            _ => Err("(persons, height, width)".into()),
        });
        self.keep(fits)?;
        let (shape, flags) = self.keep(file.read_flags("mask"))?;
        let [_, height, width] = shape[..] else { return None };
        if flags.is_empty() {
            return Some((IMAGE_SIZE, Vec::new()));
        }
        Some(([width, height], flags.chunks_exact((height * width).max(1)).map(<[bool]>::to_vec).collect()))
    }

    /// The number of persons that the labels agree on; where they do not, the first and a note.
    fn count(&mut self, counts: [(&str, Option<usize>); 3]) -> Option<usize> {
        let known: Vec<(&str, usize)> = counts.into_iter().filter_map(|(what, n)| n.map(|n| (what, n))).collect();
        if known.windows(2).any(|w| w[0].1 != w[1].1) {
            let told: Vec<String> = known.iter().map(|(what, n)| format!("{n} {what}")).collect();
            self.notes.push(format!("the labels disagree about the number of persons: {}", told.join(", ")));
        }
        known.first().map(|&(_, n)| n)
    }
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
}
