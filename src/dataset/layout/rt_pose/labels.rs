//! `Train.json` and `Test.json`, `{sequence id: {frame: [{"Radar_frameID": …, "pose": [[x, y, z] × 15]}]}}`, metres in the radar's
//! frame; `file_meta.txt`, a line `id,name` a sequence; and a calibration, which is told and not needed for a fit.

use crate::dataset::Truth;
use crate::dataset::set::parent;
use crate::geometry::Vec3;
use crate::input::{MOST_TEXT, open_file, read_text};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Joints of a person.
pub(super) const JOINTS: usize = 15;
/// Bytes of a file of labels that are read.
const MOST_BYTES: u64 = 256 << 20;
/// Files of labels, and the names of sequences.
pub(super) const FILES: [&str; 2] = ["Train.json", "Test.json"];
pub(super) const META: &str = "file_meta.txt";
/// From a folder of cubes up to that of the labels.
const HEIGHT: usize = 4;
/// Persons of a frame that are kept.
const MOST_PERSONS: usize = crate::dataset::MAX_PERSONS;

/// The label files of a data set; read when the first frame is.
#[derive(Debug)]
pub(super) struct Labels {
    files: Vec<PathBuf>,
    meta: Option<PathBuf>,
    read: OnceLock<Known>,
}

#[derive(Debug, Default)]
struct Known {
    /// (sequence's name, radar frame) to the joints of its persons.
    persons: HashMap<(String, u64), Vec<[[f32; 3]; JOINTS]>>,
    /// What is wrong with the files.
    faults: Vec<String>,
}

/// A person of a frame.
#[derive(Deserialize)]
struct Object {
    #[serde(rename = "Radar_frameID")]
    radar_frame: FrameId,
    pose: Vec<[f32; 3]>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum FrameId {
    Number(u64),
    Text(String),
}

impl FrameId {
    fn number(&self) -> Option<u64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Text(text) => text.trim().trim_end_matches(".npy").parse().ok(),
        }
    }
}

type OfFile = HashMap<String, HashMap<String, Vec<Object>>>;

impl Labels {
    /// Looks for label files in the folder of cubes and those above it; reads none.
    pub(super) fn near(cubes: &Path) -> Self {
        let found = |name: &str| {
            let whole = std::path::absolute(cubes).ok()?;
            whole.ancestors().take(HEIGHT).map(|folder| folder.join(name)).find(|path| path.is_file())
        };
        Self { files: FILES.iter().filter_map(|name| found(name)).collect(), meta: found(META), read: OnceLock::new() }
    }

    /// The label files.
    pub(super) fn paths(&self) -> Vec<PathBuf> {
        self.files.iter().chain(&self.meta).cloned().collect()
    }

    /// The joints of the persons of a frame; what is wrong goes to `notes`.
    pub(super) fn of(&self, sequence: &str, stem: &str, joints: usize, notes: &mut Vec<String>) -> Option<Truth> {
        if self.files.is_empty() {
            notes.push("Train.json and Test.json are missing: no joints".into());
            return None;
        }
        let known = self.read.get_or_init(|| self.all());
        notes.extend(known.faults.iter().cloned());
        let persons = stem.parse().ok().and_then(|number| known.persons.get(&(sequence.to_owned(), number)));
        let Some(persons) = persons else {
            notes.push("no joints of this frame in Train.json or Test.json".into());
            return None;
        };
        if joints != JOINTS {
            notes.push(format!("its persons have {JOINTS} joints, the skeleton {joints}: no joints"));
            return None;
        }
        let all: Vec<Vec3> = persons.iter().flatten().map(|joint| joint.map(f64::from)).collect();
        Some(Truth { joints: all, velocities: None, persons: persons.len() })
    }

    fn all(&self) -> Known {
        let mut known = Known::default();
        let names = self.names(&mut known.faults);
        for path in &self.files {
            if let Err(fault) = add(path, &names, &mut known) {
                known.faults.push(format!("{}: {fault}; its joints are left out", path.display()));
            }
        }
        known
    }

    /// The names of the sequences by their ids; an id that no line names is its own name.
    fn names(&self, faults: &mut Vec<String>) -> HashMap<String, String> {
        let Some(path) = &self.meta else {
            faults.push(format!("{META} is missing: the ids of sequences are taken for their names"));
            return HashMap::new();
        };
        match read_text(path, "the names of sequences", MOST_TEXT) {
            Ok(text) => {
                let pair =
                    |line: &str| line.trim().split_once(',').map(|(id, name)| (id.trim().into(), name.trim().into()));
                text.lines().filter_map(pair).collect()
            }
            Err(error) => {
                faults.push(format!("{}: {error}", path.display()));
                HashMap::new()
            }
        }
    }
}

fn add(path: &Path, names: &HashMap<String, String>, known: &mut Known) -> Result<(), String> {
    let file = open_file(path, "joints (JSON)").map_err(|error| error.to_string())?;
    let bytes = file.metadata().map_err(|error| error.to_string())?.len();
    if bytes > MOST_BYTES {
        return Err(format!("it has {bytes} bytes; expected at most {MOST_BYTES}"));
    }
    let read: OfFile = serde_json::from_reader(std::io::BufReader::new(file)).map_err(|error| error.to_string())?;
    for (id, frames) in read {
        let name = names.get(&id).cloned().unwrap_or(id);
        for (frame, objects) in frames {
            for object in objects {
                let wrong = |what: String| format!("sequence {name}, frame {frame}: {what}");
                let number = object.radar_frame.number();
                let number = number.ok_or_else(|| wrong("`Radar_frameID` is no number".into()))?;
                let pose = <[[f32; 3]; JOINTS]>::try_from(object.pose)
                    .map_err(|pose| wrong(format!("`pose` has {} joints; expected {JOINTS}", pose.len())))?;
                if !pose.iter().flatten().all(|x| x.is_finite() && x.abs() < 1e4) {
                    return Err(wrong("`pose` has numbers that are no metres".into()));
                }
                let persons = known.persons.entry((name.clone(), number)).or_default();
                if persons.len() < MOST_PERSONS {
                    persons.push(pose);
                }
            }
        }
    }
    // Of several persons of a frame the order of a map is none.
    Ok(())
}

#[derive(Deserialize)]
struct Calibration {
    radar: Option<Extrinsic>,
    left_cam: Option<Camera>,
}

#[derive(Deserialize)]
struct Extrinsic {
    extrinsic: Numbers,
}

#[derive(Deserialize)]
struct Camera {
    intrinsic: Numbers,
}

/// A matrix in rows, or all in one.
#[derive(Deserialize)]
#[serde(untagged)]
enum Numbers {
    Flat(Vec<f64>),
    Rows(Vec<Vec<f64>>),
}

impl Numbers {
    fn flat(self) -> Vec<f64> {
        match self {
            Self::Flat(numbers) => numbers,
            Self::Rows(rows) => rows.concat(),
        }
    }
}

/// What a calibration near the cubes says, in words: `calib.json`, or the first JSON of a folder `calib`.
pub(super) fn calibration(cubes: &Path) -> Option<String> {
    let whole = std::path::absolute(cubes).ok()?;
    let of_folder = |folder: PathBuf| {
        let entries = std::fs::read_dir(folder).ok()?;
        let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        files.retain(|path| path.extension().is_some_and(|ending| ending == "json") && path.is_file());
        files.sort();
        files.into_iter().next()
    };
    let in_folder = |folder: &Path| {
        let plain = folder.join("calib.json");
        if plain.is_file() { Some(plain) } else { of_folder(folder.join("calib")) }
    };
    let path = whole.ancestors().skip(1).take(HEIGHT).find_map(in_folder)?;
    let name = path.strip_prefix(parent(parent(&path))).unwrap_or(&path).display().to_string();
    let told =
        read_text(&path, "a calibration (JSON)", MOST_TEXT).map_err(|error| error.to_string()).and_then(|text| {
            let read: Calibration = serde_json::from_str(&text).map_err(|error| error.to_string())?;
            let radar = read.radar.map(|radar| radar.extrinsic.flat()).filter(|numbers| numbers.len() == 16);
            let camera = read.left_cam.map(|camera| camera.intrinsic.flat()).filter(|numbers| numbers.len() == 12);
            let radar = radar.ok_or("`radar.extrinsic` is no 4 × 4 matrix")?;
            let camera = camera
                .map(|k| format!(", left camera of {:.0} × {:.0} px focal length", k[0], k[5]))
                .unwrap_or_default();
            Ok(format!("lidar at ({:.2}, {:.2}, {:.2}) m of the radar{camera}", radar[3], radar[7], radar[11]))
        });
    Some(match told {
        Ok(told) => format!("calibration {name}: {told}"),
        Err(fault) => format!("calibration {name} is not read: {fault}"),
    })
}
