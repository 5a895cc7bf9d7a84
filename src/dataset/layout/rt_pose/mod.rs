//! RT-Pose: `<sequence>/npy/F.npy`, cubes (z, y, x), or with Doppler bins before them: `DZYX_npy_f16`, `npy_DZYX_complex` (complex
//! numbers), `DZYX_npy_f16_complex` (a leading axis of two, real and imaginary part). Joints of 15 in the radar's frame in
//! `Train.json` and `Test.json`.
//!
//! A view has three axes at most: of Doppler bins the root of the summed power is taken, as everywhere in this program where Doppler is
//! left out. They are read in pieces, so that no more than a cube is held. A view whose axes are a part of the published grid, such as
//! the region of interest that the published training uses, takes that part of every cube. Raw captures of the cascade become the same
//! cubes (`raw.rs`).

mod labels;
mod raw;
mod write;

use super::index::{Folders, Segment};
use super::{DataFolder, FrameSource, FrameWriter, Layout, MapArray, Opened, Stored, manifest_beside, no_single_file};
use crate::dataset::manifest::Manifest;
use crate::dataset::natural::natural;
use crate::dataset::npz::{Fold, NPY_KEY, NpzArchive, shape_text};
use crate::dataset::set::{DatasetInfo, parent};
use crate::dataset::walk::Walk;
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::View;
use crate::task::Progress;
use labels::{Labels, calibration};
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The folders of cubes of a sequence; of several the first is taken.
const CUBES: [&str; 4] = ["npy", "DZYX_npy_f16", "npy_DZYX_complex", "DZYX_npy_f16_complex"];
/// Where messages say that the preset is.
const PRESET_PATH: &str = "assets/rt_pose.toml";
/// Cells of a published cube, z, y, x.
const GRID: [usize; 3] = [32, 128, 256];
/// Of a step so much may an axis be off the published grid.
const OFF_GRID: f64 = 0.01;
/// Folders inside each other that are looked into, those of the cubes included.
const MAX_DEPTH: usize = 5;

/// The layout.
#[derive(Debug)]
pub(super) struct RtPose;

impl Layout for RtPose {
    fn word(&self) -> &'static str {
        "rt_pose"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((include_str!("../../../../assets/rt_pose.toml"), PRESET_PATH))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("RT-Pose's npy/F.npy")
    }

    fn claims(&self, file: &Path) -> bool {
        stem_of(file).is_some()
    }

    fn writer(&self) -> Option<&dyn FrameWriter> {
        Some(self)
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        open(place, None, progress)
    }

    fn open_file(&self, file: &Path, manifest: Option<&Manifest>, progress: &Progress) -> Result<Opened, DatasetError> {
        let Some(stem) = stem_of(file) else { return Err(no_single_file(self.word(), file, manifest)) };
        let manifest = manifest.map_or_else(|| manifest_beside(file, &Self), |manifest| Ok(manifest.clone()))?;
        open(&DataFolder { root: parent(file), manifest: &manifest, allow_outside: false }, Some(stem), progress)
    }
}

/// `000123` of `npy/000123.npy`.
fn stem_of(file: &Path) -> Option<&str> {
    let folder = file.parent()?.file_name()?;
    CUBES.iter().any(|cubes| folder == *cubes).then(|| cube_stem(file.file_name()?.to_str()?)).flatten()
}

fn cube_stem(name: &str) -> Option<&str> {
    let stem = name.strip_suffix(".npy")?;
    ((1..=12).contains(&stem.len()) && stem.bytes().all(|b| b.is_ascii_digit())).then_some(stem)
}

/// All frames at or below a folder; of a folder of cubes the frame of the stem `named`.
fn open(place: &DataFolder<'_>, named: Option<&str>, progress: &Progress) -> Result<Opened, DatasetError> {
    progress.begin("listing folders", 0);
    let (segments, mut notes) = sequences(place.root, progress)?;
    let Some(first) = segments.first() else { return raw::open(place, progress) };
    let (labels, calibration) = (Labels::near(&first.path), calibration(&first.path));
    let folders = Folders::new(segments);
    let at = |named| (0..folders.count()).find(|&i| folders.find(i).is_some_and(|(_, stem)| stem == named));
    let named = named.map(|named| at(named).unwrap_or(0));
    let preset = place.manifest.layout.preset()?;
    let mut info = place.info(&preset);
    let form = folders.find(0).and_then(|(segment, stem)| {
        info.views.first().and_then(|view| Form::of(&segment.path.join(format!("{stem}.npy")), view).ok())
    });
    let form = form.unwrap_or_default();
    notes.extend(calibration);
    info.notes = notes;
    info.assumptions.extend(assumptions(form));
    if *info.views == *preset.views {
        info.assumptions.push(
            "chirp and point spread: not published with the cubes; 3.31 GHz follow from the 256 steps of 4.53 cm, the widths from a \
             cascade's line of 86 elements and its four rows"
                .into(),
        );
    }
    Ok(Opened { info, frames: Box::new(Frames { folders, labels, form }), named })
}

/// The folders of cubes at or below `root`, one a sequence, in natural order; and notes about what was left out.
///
/// # Errors
/// As [`Walk::of`].
fn sequences(root: &Path, progress: &Progress) -> Result<(Vec<Segment>, Vec<String>), DatasetError> {
    let skip = |name: &str| super::hiber::FOLDERS.contains(&name);
    let (folders, mut notes) = Walk { depth: MAX_DEPTH, stem: cube_stem, skip, progress }.of(root)?;
    let mut found: Vec<(usize, PathBuf, Vec<String>)> = Vec::new();
    for folder in folders {
        let path = if folder.below.as_os_str().is_empty() { root.to_owned() } else { root.join(&folder.below) };
        let whole = std::path::absolute(&path).unwrap_or_else(|_| path.clone());
        let Some(form) = CUBES.iter().position(|cubes| whole.file_name().is_some_and(|name| name == *cubes)) else {
            continue;
        };
        found.push((form, path, folder.stems));
    }
    found.sort_by(|(a_form, a, _), (b_form, b, _)| {
        natural(&parent(a).to_string_lossy(), &parent(b).to_string_lossy()).then(a_form.cmp(b_form))
    });
    let mut segments: Vec<Segment> = Vec::new();
    for (form, path, stems) in found {
        let name = sequence_of(&path);
        match segments.last() {
            Some(taken) if parent(&taken.path) == parent(&path) => {
                let taken = taken.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                notes.push(format!("{name}: the cubes of {taken}/ are taken, those of {}/ are not", CUBES[form]));
            }
            _ => segments.push(Segment::new(path, name, stems)),
        }
    }
    Ok((segments, notes))
}

/// The name of the folder that a folder of cubes is in.
fn sequence_of(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    parent(&whole).file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// What the numbers of a file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Form {
    /// Doppler bins, 1 where there are none.
    dopplers: usize,
    /// 2 where real and imaginary part have an axis of their own.
    parts: usize,
    complex: bool,
    /// The first cell of the part of the published grid that is taken, where it is not all of the file.
    window: Option<[usize; 3]>,
}

impl Default for Form {
    fn default() -> Self {
        Self { dopplers: 1, parts: 1, complex: false, window: None }
    }
}

impl Form {
    /// By the header of a file.
    fn of(path: &Path, view: &View) -> Result<Self, DatasetError> {
        let mut file = NpzArchive::open(path)?;
        let (entry, cells) = (file.entry(NPY_KEY)?, view.shape());
        let complex = !entry.is_real && entry.dtype.contains('c');
        let window = window_of(view).filter(|_| cells != GRID && entry.shape.ends_with(&GRID));
        let of_file = if window.is_some() { &GRID[..] } else { &cells[..] };
        let (dopplers, parts) = match entry.shape.strip_suffix(of_file) {
            Some([]) => (1, 1),
            Some([dopplers]) => (*dopplers, 1),
            Some([2, dopplers]) if !complex => (*dopplers, 2),
            _ => {
                let bins = cells.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
                let expected =
                    format!("{}, the bins of its axes, (Doppler, {bins}) or (2, Doppler, {bins})", shape_text(&cells));
                return Err(file.wrong_shape(NPY_KEY, &entry.shape, expected).into());
            }
        };
        Ok(Self { dopplers, parts, complex, window })
    }

    fn words(self) -> String {
        let numbers = match (self.complex, self.parts) {
            (true, _) => "complex numbers",
            (false, 2) => "real and imaginary parts",
            _ => "real numbers, taken for amplitudes",
        };
        let part = if self.window.is_some() { "; a part of the published grid is taken" } else { "" };
        if self.dopplers == 1 {
            return format!("cubes: {numbers}, one a cell{part}");
        }
        format!(
            "cubes: {numbers} of {} Doppler bins a cell; the map is the root of their summed power{part}",
            self.dopplers
        )
    }
}

/// The first cell, on the published grid, of a view whose axes are a part of it.
fn window_of(view: &View) -> Option<[usize; 3]> {
    let preset = <dyn Layout>::preset(&RtPose).ok()?;
    let grid = &preset.views.first()?.axes;
    let mut first = [0; 3];
    for ((axis, of), first) in view.axes.iter().zip(grid).zip(&mut first) {
        let at = of.bin(axis.lo);
        let same_step = (axis.step() / of.step() - 1.0).abs() * (axis.bins as f64) < OFF_GRID;
        let inside = at > -OFF_GRID && at.round() as usize + axis.bins <= of.bins;
        if axis.kind != of.kind || !same_step || !inside || (at - at.round()).abs() > OFF_GRID {
            return None;
        }
        *first = at.round() as usize;
    }
    (view.axes.len() == 3).then_some(first)
}

/// The cells of `shape` from `first` on, of a cube of the published grid.
fn part_of(cube: &[f64], first: [usize; 3], shape: &[usize]) -> Vec<f64> {
    let &[z, y, x] = shape else { return Vec::new() };
    let row = |z: usize, y: usize| {
        let from = ((first[0] + z) * GRID[1] + first[1] + y) * GRID[2] + first[2];
        cube.get(from..from + x).unwrap_or_default()
    };
    (0..z).flat_map(|z| (0..y).map(move |y| (z, y))).flat_map(|(z, y)| row(z, y).iter().copied()).collect()
}

/// The frames of sequences.
#[derive(Debug)]
struct Frames {
    folders: Folders,
    labels: Labels,
    /// What the first file is.
    form: Form,
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

    fn files(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        self.folders.find(i).map(|(segment, stem)| segment.path.join(format!("{stem}.npy"))).into_iter().collect()
    }

    fn arrays(&self, _place: usize, info: &DatasetInfo) -> Vec<MapArray> {
        let stored = match self.form {
            // A part of the stored numbers is no map that could be put in their place.
            Form { window: Some(_), .. } => return Vec::new(),
            Form { dopplers: 1, parts: 1, complex: false, .. } => Stored::Numbers,
            Form { dopplers, parts, .. } => Stored::Folded { before: dopplers * parts, after: 1, over: 1 },
        };
        let array = |view: usize| MapArray { key: NPY_KEY.to_owned(), view, stored };
        (0..info.views.len()).map(array).collect()
    }

    fn label_files(&self) -> Vec<PathBuf> {
        self.labels.paths()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| self.folders.at(i, info).and_then(|(segment, stem)| maps(segment, stem, info))).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let (segment, stem) = self.folders.at(i, info)?;
        let maps = maps(segment, stem, info)?;
        let mut notes = Vec::new();
        let truth = self.labels.of(&segment.sequence, stem, info.skeleton.joints.len(), &mut notes);
        let number = stem.parse::<u32>().ok();
        Ok(Frame {
            timestamp_s: info.frame_rate_hz.and_then(|rate| number.map(|number| f64::from(number) / rate)),
            map_boxes: vec![Vec::new(); info.views.len()],
            person_count: truth.as_ref().map(|truth| truth.persons),
            maps,
            truth,
            notes,
            ..Frame::default()
        })
    }
}

/// The maps of a frame: the same cube for every view of these axes.
fn maps(segment: &Segment, stem: &str, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
    let path = segment.path.join(format!("{stem}.npy"));
    let read = |view: &View| {
        let form = Form::of(&path, view)?;
        let cells = form.window.map_or_else(|| view.cells(), |_| GRID.iter().product());
        let fold = Fold { before: form.dopplers * form.parts, cells, after: 1, over: 1 };
        let folded = NpzArchive::open(&path)?.read_folded(NPY_KEY, fold)?;
        let shape = view.shape();
        let data = match form.window {
            Some(first) => part_of(&folded.data, first, &shape),
            None => folded.data,
        };
        Ok(Heatmap { shape, data, dtype: folded.dtype })
    };
    info.views.iter().map(read).collect()
}

/// What was assumed, in words.
fn assumptions(form: Form) -> [String; 3] {
    [
        form.words(),
        "axes: x away from the radar, y to the left, z up, on the grid of the published loader; left is assumed".into(),
        "frame rate: 10 a second is assumed".into(),
    ]
}
