//! The labels of a frame: boxes on the maps, key points and silhouettes in the pixels of the camera beside the radars, and joints in
//! the room's frame. Each kind has a file a group, of which a frame is one slab; silhouettes have a file a frame.

use super::tree::ANNOTATIONS;
use crate::dataset::npz::{Array, NPY_KEY, NpzArchive, NpzError};
use crate::dataset::{ImageAnnotations, MAX_PERSONS};
use crate::geometry::Vec3;
use std::path::{Path, PathBuf};

/// Joints of a person.
pub(super) const JOINTS: usize = 14;
/// Camera images, (width, height), px.
pub(super) const IMAGE_SIZE: [usize; 2] = [1640, 1248];
/// Width or height of an image that is accepted, px.
const MAX_SIDE: usize = 8192;

/// Where the labels of a group lie.
#[derive(Debug, Clone)]
pub(super) struct GroupLabels {
    annotations: PathBuf,
    group: String,
}

impl GroupLabels {
    /// Those of a group of a category.
    pub(super) fn new(category: &Path, group: &str) -> Self {
        Self { annotations: category.join(ANNOTATIONS), group: group.to_owned() }
    }

    /// One of the files of the whole group: `3DPOSE`, `2DPOSE`, `BOUNDINGBOX/HORIZONTAL`.
    pub(super) fn file(&self, kind: &str) -> PathBuf {
        self.annotations.join(kind).join(format!("{}.npy", self.group))
    }

    /// All files of the whole group.
    pub(super) fn files(&self) -> [PathBuf; 4] {
        ["3DPOSE", "2DPOSE", "BOUNDINGBOX/HORIZONTAL", "BOUNDINGBOX/VERTICAL"].map(|kind| self.file(kind))
    }

    /// The silhouettes of a frame.
    pub(super) fn silhouettes_file(&self, stem: &str) -> PathBuf {
        self.annotations.join("SILHOUETTE").join(&self.group).join(format!("{stem}.npy"))
    }

    /// (persons, …rest) of a frame; `None` where the file is missing. A file without an axis of persons has one.
    fn of_frame(&self, kind: &str, frame: usize, rest: &[usize]) -> Result<Option<Array>, NpzError> {
        let path = self.file(kind);
        let mut file = match NpzArchive::open(&path) {
            Ok(file) => file,
            Err(error) if error.is_not_found() => return Ok(None),
            Err(error) => return Err(error),
        };
        let words = rest.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let expected =
            format!("(frames, persons, {words}), of more than {frame} frames and at most {MAX_PERSONS} persons");
        file.require(NPY_KEY, |shape| match shape.split_first() {
            Some((&frames, of_one)) if frames > frame => match of_one.split_first() {
                _ if of_one == rest => Ok(()),
                Some((&persons, each)) if each == rest && persons <= MAX_PERSONS => Ok(()),
                _ => Err(expected),
            },
            _ => Err(expected),
        })?;
        file.read_slab(NPY_KEY, frame).map(Some)
    }

    /// The joints of each person of a frame, room frame, m; of who has none (zeros or NaN) nothing, and a note.
    ///
    /// # Errors
    /// Where the file is there and cannot be read.
    pub(super) fn joints(&self, frame: usize, notes: &mut Vec<String>) -> Result<Option<Vec<Vec<Vec3>>>, NpzError> {
        let Some(array) = self.of_frame("3DPOSE", frame, &[JOINTS, 3])? else { return Ok(None) };
        let persons = array.data.chunks_exact(3 * JOINTS).map(|person| person.as_chunks::<3>().0.to_vec());
        let all: Vec<Vec<Vec3>> = persons.collect();
        let is_known = |joints: &&Vec<Vec3>| {
            joints.iter().flatten().all(|x| x.is_finite() && x.abs() < 1e3)
                && joints.iter().any(|joint| joint.iter().any(|x| *x != 0.0))
        };
        let known: Vec<Vec<Vec3>> = all.iter().filter(is_known).cloned().collect();
        if known.len() < all.len() {
            notes.push(format!("{} of {} persons have no joints (zeros or NaN)", all.len() - known.len(), all.len()));
        }
        Ok(Some(known))
    }

    /// The boxes of a frame on both maps, in bins: row, column, row, column.
    pub(super) fn boxes(&self, frame: usize, notes: &mut Vec<String>) -> Vec<Vec<[f64; 4]>> {
        let mut of_view = |kind: &str| {
            let read = self.of_frame(kind, frame, &[4]);
            let rows = kept(read, kind, notes).map(|array| array.data.as_chunks::<4>().0.to_vec()).unwrap_or_default();
            let real = rows.into_iter().filter(|b| b.iter().all(|x| x.is_finite()) && b.iter().any(|x| *x != 0.0));
            real.map(|[column0, row0, column1, row1]| [row0, column0, row1, column1]).collect()
        };
        vec![of_view("BOUNDINGBOX/HORIZONTAL"), of_view("BOUNDINGBOX/VERTICAL")]
    }

    /// Key points and silhouettes, px; `None` where there are neither.
    pub(super) fn image(&self, frame: usize, stem: &str, notes: &mut Vec<String>) -> Option<ImageAnnotations> {
        let points = kept(self.of_frame("2DPOSE", frame, &[JOINTS, 2]), "2DPOSE", notes);
        let keypoints = points.map(|array| {
            let person = |person: &[f64]| {
                let point = |&[x, y]: &[f64; 2]| {
                    let known = x.is_finite() && y.is_finite() && (x, y) != (0.0, 0.0);
                    if known { [x, y, 1.0] } else { [0.0; 3] }
                };
                person.as_chunks::<2>().0.iter().map(point).collect::<Vec<_>>()
            };
            array.data.chunks_exact(2 * JOINTS).map(person).collect::<Vec<_>>()
        });
        let silhouettes = self.silhouettes(stem, notes);
        if keypoints.is_none() && silhouettes.is_none() {
            return None;
        }
        let (size, masks) = silhouettes.unwrap_or((IMAGE_SIZE, Vec::new()));
        Some(ImageAnnotations {
            size,
            keypoints: keypoints.unwrap_or_default(),
            keypoint_skeleton: "hiber14".into(),
            boxes: Vec::new(),
            masks,
        })
    }

    /// The image's size and one mask a person.
    fn silhouettes(&self, stem: &str, notes: &mut Vec<String>) -> Option<([usize; 2], Vec<Vec<bool>>)> {
        let path = self.silhouettes_file(stem);
        let read = || {
            let mut file = NpzArchive::open(&path)?;
            file.require(NPY_KEY, |shape| match *shape {
                [n, height, width] if n <= MAX_PERSONS && height <= MAX_SIDE && width <= MAX_SIDE => Ok(()),
                _ => Err(format!(
                    "(persons, height, width), at most {MAX_PERSONS} persons of {MAX_SIDE} × {MAX_SIDE} px"
                )),
            })?;
            match file.read_flags(NPY_KEY) {
                Err(NpzError::WrongType { .. }) => {
                    let array = file.read(NPY_KEY)?;
                    Ok((array.shape, array.data.into_iter().map(|x| x > 0.0).collect()))
                }
                flags => flags,
            }
        };
        let (shape, flags): (Vec<usize>, Vec<bool>) = match read() {
            Ok(read) => read,
            Err(error) if error.is_not_found() => {
                notes.push(format!("SILHOUETTE/{}/{stem}.npy is missing: no silhouettes", self.group));
                return None;
            }
            Err(error) => {
                notes.push(format!("no silhouettes: {error}"));
                return None;
            }
        };
        let [_, height, width] = shape[..] else { return None };
        let size = if flags.is_empty() { IMAGE_SIZE } else { [width, height] };
        Some((size, flags.chunks_exact((height * width).max(1)).map(<[bool]>::to_vec).collect()))
    }
}

/// What was read; that a file is missing or damaged becomes a note.
fn kept(read: Result<Option<Array>, NpzError>, kind: &str, notes: &mut Vec<String>) -> Option<Array> {
    match read {
        Ok(None) => notes.push(format!("{kind} is missing")),
        Err(error) => notes.push(error.to_string()),
        Ok(array) => return array,
    }
    None
}
