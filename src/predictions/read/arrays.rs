//! npz and npy: an array (frames, persons, joints, 3) or (frames, joints, 3), and beside it what an npz can say.
//!
//! | key | what |
//! |---|---|
//! | `joints` (or one of the names below, or the only array whose last axis is 3) | the joints |
//! | `frames`, `frame_names`, `names` | names of the frames, or their numbers |
//! | `joint_names` | names of the joints |
//! | `unit`, `axes` | m, cm, mm; as `z,-x,-y` |
//! | `persons`, `count` | how many persons a frame has; the rest of the axis is padding |

use super::pppr;
use crate::body::Group;
use crate::dataset::npz::{Entry, NPY_KEY, NpzArchive};
use crate::geometry::Vec3;
use crate::predictions::error::PredictionError;
use crate::predictions::raw::{FileFrame, FrameKey, RawPredictions};
use crate::predictions::reading::Reading;
use std::path::Path;

/// Keys of joints, in the order in which they are looked for.
const JOINTS: [&str; 10] = [
    "joints",
    "keypoints",
    "keypoints_3d",
    "joints_3d",
    "pred_joints",
    "pred",
    "predictions",
    "predicted_3d_pos",
    "poses",
    NPY_KEY,
];
const FRAMES: [&str; 5] = ["frames", "frame_names", "names", "frame_index", "index"];
const COUNTS: [&str; 3] = ["persons", "count", "person_count"];

pub(super) fn read(path: &Path, reading: &Reading) -> Result<RawPredictions, PredictionError> {
    let mut file = NpzArchive::open(path)?;
    if Group::ALL.iter().all(|group| file.contains(group.key())) {
        return pppr::read_file(path);
    }
    let entries = file.entries()?;
    let key = joints_key(&entries, reading, path)?;
    let array = file.read(&key)?;
    let (frames, persons, joints) = match array.shape[..] {
        [frames, persons, joints, 3] => (frames, persons, joints),
        [frames, joints, 3] => (frames, 1, joints),
        _ => {
            let expected = "(frames, joints, 3) or (frames, persons, joints, 3)".to_owned();
            return Err(file.wrong_shape(&key, &array.shape, expected).into());
        }
    };
    let keys = frame_keys(&mut file, frames, path)?;
    let counts = COUNTS.iter().find(|key| file.contains(key)).map(|key| file.read(key)).transpose()?;
    if let Some(counts) = counts.as_ref().filter(|counts| counts.shape != [frames]) {
        let (found, frames) = (counts.data.len(), frames);
        return Err(PredictionError::format(
            path,
            format!("{found} numbers of persons for {frames} frames; expected one a frame"),
        ));
    }
    let points: &[Vec3] = array.data.as_chunks().0;
    let mut raw = RawPredictions {
        joints: texts(&mut file, "joint_names")?,
        joint_count: joints,
        unit: texts(&mut file, "unit")?.into_iter().next(),
        axes: texts(&mut file, "axes")?.into_iter().next(),
        form: format!("npz {key} {}x{joints}", if array.shape.len() == 4 { "persons" } else { "one" }),
        whole: keys.is_none(),
        frames: Vec::with_capacity(frames),
    };
    for (index, of_frame) in points.chunks_exact((persons * joints).max(1)).enumerate() {
        let present = counts.as_ref().and_then(|counts| counts.data.get(index)).map_or(persons, |n| *n as usize);
        let key = keys.as_ref().map_or(FrameKey::Index(index), |keys| keys[index].clone());
        let persons = of_frame.chunks_exact(joints.max(1)).take(present).map(<[Vec3]>::to_vec).collect();
        raw.frames.push(FileFrame { key, persons });
    }
    Ok(raw)
}

fn joints_key(entries: &[Entry], reading: &Reading, path: &Path) -> Result<String, PredictionError> {
    let present =
        || entries.iter().map(|entry| format!("`{}` {:?}", entry.key, entry.shape)).collect::<Vec<_>>().join(", ");
    if let Some(asked) = &reading.array {
        if entries.iter().any(|entry| entry.key == *asked) {
            return Ok(asked.clone());
        }
        return Err(PredictionError::format(path, format!("no array `{asked}`; the file holds {}", present())));
    }
    let fits = |entry: &&Entry| entry.is_real && (3..=4).contains(&entry.shape.len()) && entry.shape.last() == Some(&3);
    let candidates: Vec<&Entry> = entries.iter().filter(fits).collect();
    let named = JOINTS.iter().find_map(|name| candidates.iter().find(|entry| entry.key == *name));
    match (named, &candidates[..]) {
        (Some(entry), _) | (None, [entry]) => Ok(entry.key.clone()),
        (None, []) => Err(PredictionError::format(
            path,
            format!(
                "no array can be joints; expected (frames, joints, 3) or (frames, persons, joints, 3); it holds {}",
                present()
            ),
        )),
        (None, _) => Err(PredictionError::format(
            path,
            format!("several arrays can be joints: {}; expected one, or --array KEY", present()),
        )),
    }
}

fn frame_keys(file: &mut NpzArchive, frames: usize, path: &Path) -> Result<Option<Vec<FrameKey>>, PredictionError> {
    let Some(key) = FRAMES.iter().find(|key| file.contains(key)) else { return Ok(None) };
    let names = file.read_texts(key)?;
    if names.len() != frames {
        let message =
            format!("`{key}` has {} entries for {frames} frames of joints; expected one a frame", names.len());
        return Err(PredictionError::format(path, message));
    }
    let mut keys: Vec<FrameKey> = names.iter().map(|name| FrameKey::of(name)).collect();
    keys.sort();
    if let Some([twice, _]) = keys.array_windows().find(|[a, b]| a == b) {
        return Err(PredictionError::format(path, format!("`{key}` names frame {twice} twice; expected each once")));
    }
    Ok(Some(names.iter().map(|name| FrameKey::of(name)).collect()))
}

fn texts(file: &mut NpzArchive, key: &str) -> Result<Vec<String>, PredictionError> {
    if file.contains(key) { Ok(file.read_texts(key)?) } else { Ok(Vec::new()) }
}
