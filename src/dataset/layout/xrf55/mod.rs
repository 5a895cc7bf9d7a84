//! XRF55: `mmWave/XX_YY_ZZ.npy`, real stacks (17, 256, 128), with or without a leading axis of one.
//!
//! What the axes are is not published. A view of two axes takes each of the 17 as a frame, a view of three takes a file as one;
//! the preset (`assets/xrf55.toml`) says which is assumed. Raw clips, complex and of five axes, are captures (`raw.rs`). XX_YY_ZZ are volunteer, action and repetition, however they are padded.

mod raw;
mod write;

use super::arrays::truth_beside;
use super::index::{folder_of, folders_of};
use super::{DataFolder, FrameSource, FrameWriter, Layout, Opened};
use crate::dataset::Origin;
use crate::dataset::natural::natural;
use crate::dataset::npz::{NPY_KEY, NpzArchive, shape_text};
use crate::dataset::set::DatasetInfo;
use crate::dataset::walk::{Folder, Walk};
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::task::Progress;
use std::collections::BTreeSet;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Maps of a file.
const STEPS: usize = 17;
/// Folders inside each other that are looked into.
const MAX_DEPTH: usize = 6;
/// The last repetition of the training split.
const LAST_OF_TRAINING: u32 = 14;
/// The other sensors' folders, whose files have the same names.
const OTHERS: [&str; 2] = ["rfid", "wifi"];

/// The layout.
#[derive(Debug)]
pub(super) struct Xrf55;

impl Layout for Xrf55 {
    fn word(&self) -> &'static str {
        "xrf55"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((include_str!("../../../../assets/xrf55.toml"), "assets/xrf55.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("XRF55's XX_YY_ZZ.npy")
    }

    fn writer(&self) -> Option<&dyn FrameWriter> {
        Some(self)
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        progress.begin("listing files", 0);
        let (files, notes) = stacks(place.root, progress)?;
        if files.is_empty() {
            return Err(place.without_frames("XRF55's XX_YY_ZZ.npy in it or in a folder below".into()));
        }
        if raw::is_raw(&place.root.join(&files[0])) {
            return raw::open(place, &files, notes, progress);
        }
        let preset = place.manifest.layout.preset()?;
        let mut info = place.info(&preset);
        info.notes = notes;
        info.notes.push(told(&files));
        info.assumptions.push("joints: XRF55 publishes none, and none are made up".into());
        if *info.views == *preset.views {
            info.assumptions.extend(assumptions());
        }
        let steps = if info.views.iter().all(|view| view.axes.len() == 2) { STEPS } else { 1 };
        Ok(Opened { info, frames: Box::new(Frames { files, steps }), named: None })
    }
}

/// The stacks at or below `root`, in natural order, relative to it; and notes about what was left out.
///
/// # Errors
/// As [`Walk::of`].
fn stacks(root: &Path, progress: &Progress) -> Result<(Vec<PathBuf>, Vec<String>), DatasetError> {
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
fn is_stack(stem: &str) -> bool {
    let number = |part: &str| !part.is_empty() && part.len() <= 4 && part.bytes().all(|b| b.is_ascii_digit());
    let parts: Vec<&str> = stem.split('_').collect();
    parts.len() == 3 && parts.into_iter().all(number)
}

/// Volunteer, action and repetition of a stack, however they are padded.
fn numbers(file: &Path) -> Option<[u32; 3]> {
    let stem = file.file_stem()?.to_str()?;
    let mut parts = stem.split('_').map(str::parse::<u32>);
    let mut next = || parts.next()?.ok();
    Some([next()?, next()?, next()?])
}

/// `Scene2` of `Scene2/mmWave/01_01_01.npy`.
fn scene(file: &Path) -> Option<String> {
    let names = file.components().map(|part| part.as_os_str().to_string_lossy().into_owned());
    names
        .into_iter()
        .find(|name| name.to_lowercase().strip_prefix("scene").is_some_and(|rest| rest.parse::<u32>().is_ok()))
}

/// How many volunteers, actions and scenes there are, in words.
fn told(files: &[PathBuf]) -> String {
    let distinct = |of: &dyn Fn(&PathBuf) -> Option<u32>| files.iter().filter_map(of).collect::<BTreeSet<u32>>().len();
    let number = |k: usize| distinct(&|file: &PathBuf| numbers(file).and_then(|numbers| numbers.get(k).copied()));
    let scenes: BTreeSet<String> = files.iter().filter_map(|file| scene(file)).collect();
    let scenes = if scenes.is_empty() {
        String::new()
    } else {
        format!(", in {}", scenes.into_iter().collect::<Vec<_>>().join(", "))
    };
    format!("{} clips: volunteers {}, actions {}, repetitions {}{scenes}", files.len(), number(0), number(1), number(2))
}

/// What the name of a clip and its folder say.
fn origin_of(file: &Path) -> Origin {
    let [subject, action, session] = numbers(file).map_or([None; 3], |numbers| numbers.map(Some));
    let text = |number: Option<u32>| number.map(|number| number.to_string());
    Origin { scene: scene(file), subject: text(subject), session: text(session), action: text(action) }
}

/// What a clip is, as its name and folder say; repetitions up to 14 are the published training split.
fn clip_words(file: &Path) -> Option<String> {
    let [volunteer, action, repetition] = numbers(file)?;
    let split = if repetition <= LAST_OF_TRAINING { "training" } else { "test" };
    let scene = scene(file).map(|scene| format!(", {scene}")).unwrap_or_default();
    Some(format!("volunteer {volunteer}, action {action}, repetition {repetition} ({split}){scene}"))
}

/// The truth beside a file, one for each of its maps.
fn truth_path(file: &Path, step: usize) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!("{stem}_truth_{step:02}.npz"))
}

/// The frames of files relative to the root, each of so many.
#[derive(Debug)]
struct Frames {
    files: Vec<PathBuf>,
    /// [`STEPS`], or 1 where a file is one map of three axes.
    steps: usize,
}

impl Frames {
    /// The file of frame `i`; the data set's folder past the end.
    fn path(&self, i: usize, info: &DatasetInfo) -> PathBuf {
        self.files.get(i / self.steps).map_or_else(|| info.root.clone(), |file| info.root.join(file))
    }

    fn truth_path(&self, i: usize, info: &DatasetInfo) -> PathBuf {
        truth_path(&self.path(i, info), i % self.steps)
    }
}

impl FrameSource for Frames {
    fn count(&self) -> usize {
        self.files.len() * self.steps
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        let Some(file) = self.files.get(i / self.steps) else { return Ok(()) };
        out.write_str(&file.with_extension("").to_string_lossy())?;
        if self.steps > 1 { write!(out, "/{:02}", i % self.steps) } else { Ok(()) }
    }

    fn sequences(&self) -> usize {
        if self.steps > 1 { self.files.len() } else { folders_of(&self.files) }
    }

    fn sequence<'a>(&'a self, i: usize, name: &'a str) -> Option<&'a str> {
        if self.steps > 1 {
            return name.rsplit_once('/').map(|(clip, _)| clip);
        }
        self.files.get(i).and_then(|file| folder_of(file))
    }

    fn origin(&self, i: usize) -> Origin {
        self.files.get(i / self.steps.max(1)).map_or_else(Origin::default, |file| origin_of(file))
    }

    fn files(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        vec![self.path(i, info)]
    }

    fn companions(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        vec![self.truth_path(i, info)]
    }

    fn frames_a_file(&self) -> Option<usize> {
        (self.steps > 1).then_some(self.steps)
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| maps(&self.path(i, info), i % self.steps, info)).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let step = i % self.steps;
        let maps = maps(&self.path(i, info), step, info)?;
        let mut notes = Vec::new();
        let known = truth_beside(&self.truth_path(i, info), info.skeleton.joints.len(), &mut notes);
        Ok(Frame {
            global_id: self.files.get(i / self.steps).and_then(|file| clip_words(file)),
            timestamp_s: known.timestamp_s.or_else(|| info.frame_rate_hz.map(|rate| step as f64 / rate)),
            maps,
            map_boxes: vec![Vec::new(); info.views.len()],
            person_count: known.person_count,
            truth: known.truth,
            notes,
            ..Frame::default()
        })
    }
}

/// The maps of step `step` of a file, or all of it where views have three axes.
fn maps(path: &Path, step: usize, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
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
fn assumptions() -> [String; 2] {
    [
        "axes: XRF55 does not publish them; each file is taken for 17 maps of range (256) × azimuth (128, uniform in the sine) in 5 s"
            .into(),
        "chirp: that of XRF55's capture script, 60 GHz and 27.013 MHz/µs over 256 samples".into(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_numbers_however_they_are_padded_and_folders_are_scenes() {
        let words = |file: &str| clip_words(Path::new(file));
        assert_eq!(words("mmWave/15_4_3.npy"), words("mmWave/015_04_03.npy"));
        assert_eq!(
            words("Scene2/mmWave/03_07_15.npy").as_deref(),
            Some("volunteer 3, action 7, repetition 15 (test), Scene2")
        );
        let origin = origin_of(Path::new("Scene2/mmWave/03_07_15.npy"));
        assert_eq!(origin.to_string(), "scene Scene2, subject 3, session 15, action 7");
        let files = ["Scene1/1_2_3.npy", "Scene2/01_05_03.npy"].map(PathBuf::from);
        assert_eq!(told(&files), "2 clips: volunteers 1, actions 2, repetitions 1, in Scene1, Scene2");
    }
}
