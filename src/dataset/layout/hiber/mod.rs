//! HIBER: `{ACTION,DARK,MULTI,OCCLUSION,WALK}/{HORIZONTAL,VERTICAL}_HEATMAPS/EE_GG/FFFF.npy` and `ANNOTATIONS`; EE is the place of the
//! radars in the room (environment), GG the group of one minute.
//!
//! A file has the two radar frames (20 a second) of one frame of the camera (10 a second), as (2, 160, 200), or older as
//! (160, 200, 2); it is one frame, and its map the root of their mean power. A variant has real and imaginary parts instead, or
//! complex numbers: parts have both signs, which amplitudes have not. What the first file is is said. What stands still has been
//! subtracted by the data set. Joints are in the frame of the room: truth needs the place of the radars ([`crate::dataset::RoomTransform`]).

mod labels;
mod splits;
mod tree;
mod write;

use super::arrays::lift_zeros;
use super::index::{Folders, Segment};
use super::{DataFolder, FrameSource, FrameWriter, Layout, MapArray, Opened, Stored, manifest_beside, no_single_file};
use crate::dataset::Origin;
use crate::dataset::manifest::Manifest;
use crate::dataset::npz::{Fold, NPY_KEY, NpzArchive, shape_text};
use crate::dataset::room::{FrameDifference, RoomJoints, RoomTransforms};
use crate::dataset::set::{DatasetInfo, parent};
use crate::dataset::{DatasetError, Frame, Heatmap, Truth};
use crate::geometry::Vec3;
use crate::radar::View;
use crate::task::Progress;
use labels::GroupLabels;
use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use tree::{ANNOTATIONS, HEATMAPS, environment_of, find, frame_stem};

/// Folders of this data set that no other layout needs to look into.
pub(super) const FOLDERS: [&str; 3] = [HEATMAPS[0], HEATMAPS[1], ANNOTATIONS];

/// Radar frames a second, of which each is less the one before it (as published).
const RADAR_FRAMES_HZ: f64 = 20.0;
/// A chirp with the idle time before it, s (as published): the next is the next transmitter's.
const CHIRP_S: f64 = 45e-6;

/// The layout.
#[derive(Debug)]
pub(super) struct Hiber;

impl Layout for Hiber {
    fn word(&self) -> &'static str {
        "hiber"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((include_str!("../../../../assets/hiber.toml"), "assets/hiber.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("HIBER's HORIZONTAL_HEATMAPS/ and VERTICAL_HEATMAPS/")
    }

    fn claims(&self, file: &Path) -> bool {
        group_of(file).is_some()
    }

    fn writer(&self) -> Option<&dyn FrameWriter> {
        Some(self)
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        open(place, None, progress)
    }

    fn open_file(&self, file: &Path, manifest: Option<&Manifest>, progress: &Progress) -> Result<Opened, DatasetError> {
        let Some(stem) = group_of(file) else { return Err(no_single_file(self.word(), file, manifest)) };
        let manifest = manifest.map_or_else(|| manifest_beside(file, &Self), |manifest| Ok(manifest.clone()))?;
        open(&DataFolder { root: parent(file), manifest: &manifest, allow_outside: false }, Some(stem), progress)
    }
}

/// `0123` of `HORIZONTAL_HEATMAPS/01_05/0123.npy`.
fn group_of(file: &Path) -> Option<&str> {
    let stem = frame_stem(file.file_name()?.to_str()?)?;
    environment_of(file.parent()?.file_name()?.to_str()?)?;
    let part = file.parent()?.parent()?.file_name()?;
    HEATMAPS.iter().any(|name| part == *name).then_some(stem)
}

/// All frames at or below a folder; of a group the frame of the stem `named`.
fn open(place: &DataFolder<'_>, named: Option<&str>, progress: &Progress) -> Result<Opened, DatasetError> {
    let found = find(place.root, progress)?;
    if found.segments.is_empty() {
        let expected = "HIBER's HORIZONTAL_HEATMAPS/EE_GG/FFFF.npy and VERTICAL_HEATMAPS in it or in a folder below";
        return Err(place.without_frames(expected.into()));
    }
    let splits = splits::told(&found.segments);
    let folders = Folders::new(found.segments);
    let at = |named| (0..folders.count()).find(|&i| folders.find(i).is_some_and(|(_, stem)| stem == named));
    let named = named.map(|named| at(named).unwrap_or(0));
    let preset = place.manifest.layout.preset()?;
    let mut info = place.info(&preset);
    let rooms = RoomTransforms::of(&found.tree, crate::folders::user_data().as_deref());
    let kind = folders.find(0).and_then(|(segment, stem)| {
        let path = map_path(segment, 0, stem);
        info.views.first().and_then(|view| read(&path, view).ok()).map(|(_, kind)| kind)
    });
    let kind = kind.unwrap_or_default();
    info.notes = [found.notes, vec![splits], rooms.notes.clone(), places(&folders, &rooms)].concat();
    info.static_removed = true;
    info.assumptions.extend(assumptions(kind));
    if *info.views == *preset.views {
        info.assumptions.push(
            "point spread: it follows from 256 samples, the line of 86 elements and the chirp, without windows; HIBER publishes none"
                .into(),
        );
    }
    Ok(Opened { info, frames: Box::new(Frames { folders, tree: found.tree, rooms, kind }), named })
}

/// What the numbers of a file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Kind {
    /// Numbers of a cell before the map's axes and after them.
    before: usize,
    after: usize,
    /// Radar frames, of which the mean power is taken; else parts of one.
    frames: usize,
    complex: bool,
}

impl Kind {
    /// What is taken, in words.
    fn words(self) -> String {
        let (shape, parts) = match (self.before, self.after) {
            (2, _) => ("(2, 160, 200)", 2),
            (_, 2) => ("(160, 200, 2)", 2),
            _ => ("(160, 200)", 1),
        };
        match (self.frames, self.complex, parts) {
            (2, true, _) => format!("two complex radar frames a file {shape}: the map is the root of their mean power"),
            (2, false, _) => {
                format!(
                    "two radar frames a file {shape}, as no number is negative: the map is the root of their mean power"
                )
            }
            (_, true, _) => format!("one complex radar frame a file {shape}: the map is its amplitude"),
            (_, false, 2) => format!(
                "real and imaginary part of one radar frame a file {shape}, as there are negative numbers: the map is its amplitude"
            ),
            _ => format!("one radar frame a file {shape}, its amplitudes"),
        }
    }
}

/// The frames of groups.
#[derive(Debug)]
struct Frames {
    folders: Folders,
    tree: PathBuf,
    rooms: RoomTransforms,
    /// What the first file is.
    kind: Kind,
}

/// Where the labels of a group lie.
fn labels_of(segment: &Segment) -> GroupLabels {
    let group = segment.path.file_name().unwrap_or_default().to_string_lossy();
    GroupLabels::new(category_of(segment), &group)
}

/// The folder of the category of a group.
fn category_of(segment: &Segment) -> &Path {
    segment.path.parent().map_or(Path::new("."), parent)
}

/// `01` of `WALK/01_05`.
fn environment(segment: &Segment) -> Option<&str> {
    environment_of(segment.sequence.rsplit('/').next()?)
}

/// The file of a map of a frame.
fn map_path(segment: &Segment, view: usize, stem: &str) -> PathBuf {
    let part = HEATMAPS.get(view).copied().unwrap_or(HEATMAPS[0]);
    let group = segment.path.file_name().unwrap_or_default();
    category_of(segment).join(part).join(group).join(format!("{stem}.npy"))
}

impl RoomJoints for Frames {
    fn tree(&self) -> &Path {
        &self.tree
    }

    fn environment(&self, i: usize) -> Option<&str> {
        self.folders.find(i).and_then(|(segment, _)| environment(segment))
    }

    fn joints(&self, i: usize) -> Result<Vec<Vec<Vec3>>, DatasetError> {
        let Some((segment, stem)) = self.folders.find(i) else { return Ok(Vec::new()) };
        let number = stem.parse().unwrap_or(usize::MAX);
        Ok(labels_of(segment).joints(number, &mut Vec::new())?.unwrap_or_default())
    }

    fn frame_difference(&self) -> Option<FrameDifference> {
        Some(FrameDifference { interval_s: 1.0 / RADAR_FRAMES_HZ, chirp_s: CHIRP_S })
    }
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

    /// The environment is the scene, the category what is done.
    fn origin(&self, i: usize) -> Origin {
        let Some((segment, _)) = self.folders.find(i) else { return Origin::default() };
        let action = segment.sequence.split_once('/').map(|(category, _)| category.to_owned());
        let session = segment.sequence.rsplit('/').next().map(ToOwned::to_owned);
        Origin { scene: environment(segment).map(ToOwned::to_owned), session, action, ..Origin::default() }
    }

    fn files(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        let Some((segment, stem)) = self.folders.find(i) else { return Vec::new() };
        (0..info.views.len()).map(|view| map_path(segment, view, stem)).collect()
    }

    /// One map a view, in the form that the first file has.
    fn arrays(&self, place: usize, _info: &DatasetInfo) -> Vec<MapArray> {
        let Kind { before, after, frames, .. } = self.kind;
        let stored = Stored::Folded { before: before.max(1), after: after.max(1), over: frames.max(1) };
        vec![MapArray { key: NPY_KEY.to_owned(), view: place, stored }]
    }

    fn companions(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        let silhouettes = |(segment, stem): (&Segment, &str)| labels_of(segment).silhouettes_file(stem);
        self.folders.find(i).map(silhouettes).into_iter().collect()
    }

    fn label_files(&self) -> Vec<PathBuf> {
        let files = self.folders.segments().iter().flat_map(|segment| labels_of(segment).files());
        files.filter(|file| file.is_file()).collect()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames
            .map(|i| self.folders.at(i, info).and_then(|(segment, stem)| maps(segment, stem, info, &mut Vec::new())))
            .collect()
    }

    fn room_joints(&self) -> Option<&dyn RoomJoints> {
        Some(self)
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let (segment, stem) = self.folders.at(i, info)?;
        let labels = labels_of(segment);
        let (mut notes, mut of_maps) = (Vec::new(), Vec::new());
        let (maps, rest) = rayon::join(
            || maps(segment, stem, info, &mut of_maps),
            || {
                let number: usize = stem.parse().unwrap_or(usize::MAX);
                let joints = labels.joints(number, &mut notes).unwrap_or_else(|error| {
                    notes.push(format!("no joints: {error}"));
                    None
                });
                let boxes = labels.boxes(number, &mut notes);
                (number, joints, boxes, labels.image(number, stem, &mut notes))
            },
        );
        let (number, joints, map_boxes, image) = rest;
        notes.extend(of_maps);
        let labelled = image.as_ref().map(|image| image.keypoints.len()).filter(|n| *n > 0);
        let person_count = joints.as_ref().map(Vec::len).or(labelled);
        let truth = joints.and_then(|joints| self.truth(segment, &joints, &mut notes));
        Ok(Frame {
            global_id: splits::words(&segment.sequence),
            timestamp_s: info.frame_rate_hz.map(|rate| number as f64 / rate),
            maps: maps?,
            map_boxes,
            person_count,
            truth,
            image,
            notes,
            ..Frame::default()
        })
    }
}

impl Frames {
    /// The joints in the radar's frame, where its place in the room is known.
    fn truth(&self, segment: &Segment, joints: &[Vec<Vec3>], notes: &mut Vec<String>) -> Option<Truth> {
        let environment = environment(segment)?;
        let Some(room) = self.rooms.of_environment(environment) else {
            notes.push(format!(
                "joints are in the room's frame; `calibrate-room` finds environment {environment} in it"
            ));
            return None;
        };
        let moved = joints.iter().flatten().map(|&joint| room.radar_from_room.view_from_world(joint));
        Some(Truth { joints: moved.collect(), velocities: None, persons: joints.len() })
    }
}

/// The maps of a frame; of those that were rounded to few steps what was done with their zeros goes to `notes`.
fn maps(
    segment: &Segment,
    stem: &str,
    info: &DatasetInfo,
    notes: &mut Vec<String>,
) -> Result<Vec<Heatmap>, DatasetError> {
    let mut read_view = |(k, view): (usize, &View)| {
        let (path, other) = (map_path(segment, k, stem), map_path(segment, usize::from(k == 0), stem));
        if !path.exists() && other.exists() {
            let message = format!("no such file; a frame of HIBER has two maps, and {} is there", other.display());
            return Err(DatasetError::Frame { message, path });
        }
        let (mut map, _) = read(&path, view)?;
        notes.extend(lift_zeros(&mut map.data).map(|note| format!("{}: {note}", view.array)));
        Ok(map)
    };
    info.views.iter().enumerate().map(&mut read_view).collect()
}

/// A map, and what its file's numbers were taken for.
fn read(path: &Path, view: &View) -> Result<(Heatmap, Kind), DatasetError> {
    let mut file = NpzArchive::open(path)?;
    let (entry, cells) = (file.entry(NPY_KEY)?, view.shape());
    let [before, after] = match &entry.shape[..] {
        shape if *shape == cells[..] => [1, 1],
        [first, rest @ ..] if *first <= 2 && *rest == cells[..] => [*first, 1],
        [rest @ .., last] if *last <= 2 && *rest == cells[..] => [1, *last],
        shape => {
            let bins = cells.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
            let expected =
                format!("(2, {bins}), {}, 2) or {}", shape_text(&cells).trim_end_matches(')'), shape_text(&cells));
            return Err(file.wrong_shape(NPY_KEY, shape, expected).into());
        }
    };
    let folded = file.read_folded(NPY_KEY, Fold { before, cells: view.cells(), after, over: 1 })?;
    let parts = before * after == 2 && folded.has_signs;
    let frames = if parts { 1 } else { before * after };
    let scale = 1.0 / (frames.max(1) as f64).sqrt();
    let data = folded.data.into_iter().map(|h| h * scale).collect();
    let map = Heatmap { shape: cells, data, dtype: folded.dtype };
    Ok((map, Kind { before, after, frames, complex: folded.is_complex }))
}

/// Where the radars of each environment are known to be, in words.
fn places(folders: &Folders, rooms: &RoomTransforms) -> Vec<String> {
    let mut environments: BTreeMap<&str, usize> = BTreeMap::new();
    for segment in folders.segments() {
        *environments.entry(environment(segment).unwrap_or_default()).or_default() += segment.len();
    }
    let (known, unknown): (Vec<_>, Vec<_>) =
        environments.into_iter().partition(|(environment, _)| rooms.of_environment(environment).is_some());
    let told = |(environment, frames): (&str, usize)| {
        let room = rooms.of_environment(environment)?;
        let [x, y, z] = room.radar_from_room.world_from_view([0.0; 3]);
        let from = match (room.residual_m, room.frames) {
            (Some(residual), Some([agree, of])) => {
                format!("found in {of} frames, of which {agree} agree to {:.1} cm", 100.0 * residual)
            }
            _ => "as typed".into(),
        };
        Some(format!(
            "environment {environment} ({frames} frames): the radar is at ({x:.2}, {y:.2}, {z:.2}) m of the room, {from}"
        ))
    };
    let missing = (!unknown.is_empty()).then(|| {
        let names = unknown.iter().map(|(environment, _)| *environment).collect::<Vec<_>>().join(", ");
        format!(
            "joints are in the room's frame, and where the radars are in it is not known for environment {names}: there is no truth \
             there until `mhp-inspector calibrate-room` has found it"
        )
    });
    known.into_iter().filter_map(told).chain(missing).collect()
}

/// What was assumed, in words.
fn assumptions(kind: Kind) -> [String; 5] {
    [
        format!("maps: {}", kind.words()),
        "what stands still: subtracted frame by frame in the data set itself; who stands still vanishes, and static dominance (F1) \
         cannot be measured in these maps"
            .into(),
        "axes: row 0 is 8 m away; columns of the horizontal map run from left to right, those of the vertical map from the head down"
            .into(),
        "radars: both at one place, one on its side; the horizontal one's 77 GHz stand for both (the other has 79 GHz)".into(),
        "frame rate: that of the camera and its labels, 10 a second; of each the radar has two frames, 20 a second".into(),
    ]
}
