//! One source of predictions, read, checked and brought onto the data set: its frames, its skeleton, metres, the radar's axes.

use super::convention::{Axes, Unit};
use super::error::PredictionError;
use super::joint_map::{JointMap, canonical_joint};
use super::matching::frames_of;
use super::raw::{FileFrame, FrameKey, RawPredictions};
use super::read::read_raw;
use super::reading::{Colour, Reading, RememberedReadings};
use crate::body::Skeleton;
use crate::dataset::{Dataset, MAX_PERSONS};
use crate::geometry::{Vec3, mean, norm, sub};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Half the people of a file are no larger and no smaller than this between their farthest joints, m: children who sit, giants.
const SIZES_M: [f64; 2] = [0.35, 3.0];
/// Nobody is farther from the radar, m.
const FARTHEST_M: f64 = 200.0;
/// The bodies of a file whose middles are all nearer to the origin than this are relative to a joint, m.
const AT_ORIGIN_M: f64 = 0.6;

/// The people of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedFrame {
    /// Known joints of all persons, person by person, m, world frame.
    pub joints: Vec<Vec3>,
    /// Persons.
    pub persons: usize,
}

/// A source of predictions on a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Predictions {
    /// What it is called: a word.
    pub name: String,
    /// What it is drawn in, where somebody chose.
    pub colour: Option<Colour>,
    /// The file or folder.
    pub path: PathBuf,
    /// Its joints on the data set's skeleton.
    pub map: JointMap,
    /// How it was read: all that was stated, told or remembered.
    pub reading: Reading,
    /// What somebody should know: frames that it does not have, joints that lie between others.
    pub notes: Vec<String>,
    frames: BTreeMap<usize, PredictedFrame>,
}

impl Predictions {
    /// Reads a file and brings it onto `dataset`. `told` comes before a description beside the file, that before what the file says,
    /// and that before what `memory` has of files of its form. What had to be told is remembered once the file is read with it.
    ///
    /// # Errors
    /// One message that names the file: it cannot be read, its skeleton is none that can be compared, nothing says its unit or axes,
    /// the unit cannot be, no frame is one of the data set, a number is not finite.
    pub fn open(
        path: &Path,
        dataset: &Dataset,
        told: &Reading,
        memory: Option<&RememberedReadings>,
    ) -> Result<Self, PredictionError> {
        let told = told.clone().or(&Reading::beside(path)?);
        let raw = read_raw(path, &told)?;
        let remembered = memory.map(|memory| memory.recall(&raw.form)).unwrap_or_default();
        let predictions = Self::of(path, &raw, dataset, &told, &remembered)?;
        // What a file states itself needs no memory.
        if let Some(memory) = memory
            && (told.unit.is_some()
                || told.axes.is_some()
                || told.skeleton.is_some()
                || told.joints.is_some()
                || !told.mapping.is_empty())
        {
            memory.remember(&raw.form, &told.or(&remembered))?;
        }
        Ok(predictions)
    }

    fn of(
        path: &Path,
        raw: &RawPredictions,
        dataset: &Dataset,
        told: &Reading,
        remembered: &Reading,
    ) -> Result<Self, PredictionError> {
        let skeleton = &dataset.info().skeleton;
        let stated = stated(path, raw)?;
        let reading = told.clone().or(&stated).or(remembered);
        let joints = joint_names(path, raw, &reading, skeleton)?;
        let (unit, axes) = (reading.unit, reading.axes);
        if joints.is_none() || unit.is_none() || axes.is_none() {
            return Err(not_stated(path, raw, joints.is_none(), unit, axes));
        }
        let (Some(joints), Some(unit), Some(axes)) = (joints, unit, axes) else { unreachable!("asked for above") };
        let map = JointMap::new(&joints, skeleton)
            .map_err(|message| PredictionError::Skeleton { message, path: path.to_owned() })?;
        let frames = present(path, raw, &joints)?;
        check_unit(path, &frames, unit)?;
        let keys: Vec<&FrameKey> = frames.iter().map(|frame| &frame.key).collect();
        let found = frames_of(dataset, &keys);
        let mut by_index: BTreeMap<usize, PredictedFrame> = BTreeMap::new();
        for (frame, index) in frames.iter().zip(&found) {
            let Some(index) = *index else { continue };
            let metres = |p: &Vec3| axes.world(p.map(|x| x * unit.metres()));
            let mut joints = Vec::with_capacity(frame.persons.len() * map.known.len());
            for person in &frame.persons {
                joints.extend(map.apply(&person.iter().map(metres).collect::<Vec<_>>()));
            }
            let predicted = PredictedFrame { joints, persons: frame.persons.len() };
            if by_index.insert(index, predicted).is_some() {
                let message = format!("frame {} is there twice, under different names; expected each once", frame.key);
                return Err(PredictionError::Frames { message, path: path.to_owned() });
            }
        }
        let mut notes = check_frames(path, raw, dataset, &keys, &found, by_index.len())?;
        notes.extend(joint_notes(&map, &joints, skeleton));
        notes.extend(origin_note(&frames, unit));
        let name = reading.name.clone().unwrap_or_else(|| source_name(path));
        let reading = Reading { unit: Some(unit), axes: Some(axes), ..reading };
        Ok(Self { name, colour: reading.colour, path: path.to_owned(), map, reading, notes, frames: by_index })
    }

    /// The people of frame `index`; `None` where the source does not have it.
    pub fn frame(&self, index: usize) -> Option<&PredictedFrame> {
        self.frames.get(&index)
    }

    /// Frames that it has of the data set.
    pub fn frames(&self) -> impl Iterator<Item = usize> + '_ {
        self.frames.keys().copied()
    }

    /// Tells its joints from others, wherever the file lies: 16 hexadecimal digits.
    pub fn digest(&self) -> String {
        let mut hash = Sha256::new();
        hash.update(format!("{:?}", self.map.known));
        for (index, frame) in &self.frames {
            hash.update(format!("{index} {}", frame.persons));
            frame.joints.iter().flatten().for_each(|x| hash.update(x.to_le_bytes()));
        }
        crate::digest::short(hash)
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// True without frames; a source that was opened has at least one.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }
}

/// What a source is called where nobody says: the file's name as a word that a filter can hold.
pub fn source_name(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let word: String =
        stem.chars().map(|c| if c.is_alphanumeric() || c == '-' { c.to_ascii_lowercase() } else { '_' }).collect();
    let word = word.trim_matches('_').to_owned();
    if word.is_empty() { "prediction".into() } else { word }
}

/// What the file says itself.
fn stated(path: &Path, raw: &RawPredictions) -> Result<Reading, PredictionError> {
    let wrong = |message: String| PredictionError::format(path, message);
    Ok(Reading {
        unit: raw.unit.as_deref().map(str::parse).transpose().map_err(wrong)?,
        axes: raw.axes.as_deref().map(str::parse).transpose().map_err(wrong)?,
        ..Reading::default()
    })
}

/// The names of the file's joints: as told, as in the file, or those of the data set for its own PPPR; `None` where nobody says.
fn joint_names(
    path: &Path,
    raw: &RawPredictions,
    reading: &Reading,
    skeleton: &Skeleton,
) -> Result<Option<Vec<String>>, PredictionError> {
    let wrong = |message: String| PredictionError::Skeleton { message, path: path.to_owned() };
    let count = raw.joint_count;
    let mut names = if let Some(joints) = &reading.joints {
        joints.clone()
    } else if let Some(name) = &reading.skeleton {
        let unknown = || wrong(format!("skeleton \"{name}\"; expected one of {}", Skeleton::PRESETS.join(", ")));
        Skeleton::preset(name).ok_or_else(unknown)?.joints
    } else if !raw.joints.is_empty() {
        raw.joints.clone()
    } else if raw.form == "pppr" {
        skeleton.joints.clone()
    } else {
        return Ok(None);
    };
    if names.len() != count {
        return Err(wrong(format!("{count} joints a person; {} are named", names.len())));
    }
    for name in &mut names {
        if let Some(to) = reading.mapping.get(name) {
            name.clone_from(to);
        }
    }
    Ok(Some(names))
}

fn not_stated(
    path: &Path,
    raw: &RawPredictions,
    joints: bool,
    unit: Option<Unit>,
    axes: Option<Axes>,
) -> PredictionError {
    let (mut missing, mut flags) = (Vec::new(), Vec::new());
    let mut hints = Vec::new();
    if joints {
        missing.push(format!("which {} joints they are", raw.joint_count));
        let known = Skeleton::PRESETS.into_iter();
        let fits: Vec<&str> =
            known.filter(|name| Skeleton::preset(name).is_some_and(|of| of.joints.len() == raw.joint_count)).collect();
        flags.push(format!("--skeleton {}", if fits.is_empty() { "NAME".to_owned() } else { fits.join("|") }));
        if fits.is_empty() {
            hints.push("a description FILE.toml with joints = [\"…\"] names them".to_owned());
        }
    }
    if unit.is_none() {
        missing.push("the unit".into());
        flags.push("--unit m|cm|mm".into());
        if let Some(likely) = likely_unit(&raw.frames) {
            hints.push(format!("people of usual size would be in {likely}"));
        }
    }
    if axes.is_none() {
        missing.push("which way the axes point".into());
        flags.push("--axes radar|camera|z,-x,-y (forward, left, up)".into());
    }
    let hint = if hints.is_empty() { String::new() } else { format!("; {}", hints.join("; ")) };
    PredictionError::NotStated { missing: missing.join(", "), flags: flags.join(" "), hint, path: path.to_owned() }
}

/// The persons who are there, every number of them finite.
fn present(path: &Path, raw: &RawPredictions, joints: &[String]) -> Result<Vec<FileFrame>, PredictionError> {
    let mut frames = Vec::with_capacity(raw.frames.len());
    for frame in &raw.frames {
        let mut persons = Vec::with_capacity(frame.persons.len());
        for (person, points) in frame.persons.iter().enumerate() {
            let finite = |p: &Vec3| p.iter().all(|x| x.is_finite());
            if points.iter().flatten().all(|x| x.is_nan()) {
                continue;
            }
            if let Some(joint) = points.iter().position(|p| !finite(p)) {
                return Err(PredictionError::NotFinite {
                    frame: frame.key.to_string(),
                    person,
                    joint: joints.get(joint).cloned().unwrap_or_default(),
                    path: path.to_owned(),
                });
            }
            persons.push(points.clone());
        }
        if persons.len() > MAX_PERSONS {
            let message = format!("frame {}: {} persons; expected at most {MAX_PERSONS}", frame.key, persons.len());
            return Err(PredictionError::format(path, message));
        }
        frames.push(FileFrame { key: frame.key.clone(), persons });
    }
    Ok(frames)
}

/// The median over all persons of the distance between their farthest joints, in the file's unit.
fn median_size(frames: &[FileFrame]) -> Option<f64> {
    let size = |person: &Vec<Vec3>| {
        let middle = mean(person);
        2.0 * person.iter().map(|&p| norm(sub(p, middle))).fold(0.0, f64::max)
    };
    let mut sizes: Vec<f64> =
        frames.iter().flat_map(|frame| &frame.persons).map(size).filter(|x| x.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied()
}

fn likely_unit(frames: &[FileFrame]) -> Option<Unit> {
    let size = median_size(frames)?;
    Unit::ALL.into_iter().find(|unit| (SIZES_M[0]..=SIZES_M[1]).contains(&(size * unit.metres())))
}

fn check_unit(path: &Path, frames: &[FileFrame], unit: Unit) -> Result<(), PredictionError> {
    let Some(size) = median_size(frames) else { return Ok(()) };
    let size_m = size * unit.metres();
    let farthest = frames.iter().flat_map(|frame| frame.persons.iter().flatten()).map(|&p| norm(p)).fold(0.0, f64::max);
    let wrong = |what: String| {
        let likely = likely_unit(frames).map_or_else(String::new, |likely| format!("; they would fit in {likely}"));
        Err(PredictionError::Unit { message: format!("in {unit} {what}{likely}"), path: path.to_owned() })
    };
    if !(SIZES_M[0]..=SIZES_M[1]).contains(&size_m) {
        let [least, most] = SIZES_M;
        return wrong(format!(
            "half of the people would be {size_m:.4} m and less from end to end; expected {least} to {most} m"
        ));
    }
    if farthest * unit.metres() > FARTHEST_M {
        return wrong(format!(
            "somebody would be {:.0} m away; expected at most {FARTHEST_M} m",
            farthest * unit.metres()
        ));
    }
    Ok(())
}

fn check_frames(
    path: &Path,
    raw: &RawPredictions,
    dataset: &Dataset,
    keys: &[&FrameKey],
    found: &[Option<usize>],
    matched: usize,
) -> Result<Vec<String>, PredictionError> {
    let wrong = |message: String| Err(PredictionError::Frames { message, path: path.to_owned() });
    if raw.whole && keys.len() != dataset.len() {
        return wrong(format!(
            "{} frames without names; the data set has {}; expected as many, or an array `frames` with names or numbers",
            keys.len(),
            dataset.len()
        ));
    }
    if matched == 0 {
        let first = keys.first().map_or_else(String::new, ToString::to_string);
        return wrong(format!(
            "none of its {} frames is one of the data set's; the first is \"{}\", the data set's \"{}\"",
            keys.len(),
            first.escape_debug(),
            dataset.frame_name(0)
        ));
    }
    let mut notes = Vec::new();
    let strangers = found.iter().filter(|found| found.is_none()).count();
    if strangers > 0 {
        let first = keys.iter().zip(found).find(|(_, found)| found.is_none()).map(|(key, _)| key.to_string());
        notes.push(format!(
            "{strangers} of its frames are not in the data set: {}, …",
            first.unwrap_or_default().escape_debug()
        ));
    }
    if matched < dataset.len() {
        let has: std::collections::BTreeSet<usize> = found.iter().copied().flatten().collect();
        let first = (0..dataset.len()).find(|index| !has.contains(index)).unwrap_or(0);
        let missing = dataset.len() - matched;
        notes.push(format!(
            "{missing} of {} frames have no prediction: {}, …",
            dataset.len(),
            dataset.frame_name(first)
        ));
    }
    Ok(notes)
}

fn joint_notes(map: &JointMap, joints: &[String], skeleton: &Skeleton) -> Option<String> {
    let (known, all, derived) = (map.known.len(), skeleton.joints.len(), map.derived());
    let same = joints.iter().zip(&skeleton.joints).all(|(a, b)| canonical_joint(a) == canonical_joint(b));
    if known == all && derived == 0 && (joints.len() == all || same) {
        return None;
    }
    let between = if derived > 0 { format!(", {derived} of them between its own") } else { String::new() };
    Some(format!("{known} of the data set's {all} joints{between}; errors are of these"))
}

fn origin_note(frames: &[FileFrame], unit: Unit) -> Option<String> {
    let near = |person: &Vec<Vec3>| norm(mean(person)) * unit.metres() < AT_ORIGIN_M;
    let mut persons = frames.iter().flat_map(|frame| &frame.persons).peekable();
    let all = persons.peek().is_some() && persons.all(near);
    all.then(|| {
        "every body stands at the origin: joints seem to be relative to one of them; PA-MAJPE alone tells something"
            .into()
    })
}
