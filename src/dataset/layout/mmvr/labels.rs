//! The companions of a frame: boxes, key points and masks in pixels, boxes on the maps in bins, the data set's own id.

use super::IMAGE_SIZE;
use crate::dataset::npz::{NpzArchive, NpzError};
use crate::dataset::set::DatasetInfo;
use crate::dataset::{Frame, ImageAnnotations, MAX_PERSONS};
use std::path::Path;

/// Bytes of a frame's global id: the grouped variant has four of five characters.
const ID_BYTES: u64 = 4096;
/// Width or height of an image that is accepted, px.
const MAX_SIDE: usize = 8192;

/// A frame without its maps: what the companions say, and notes about those that are missing.
pub(super) fn load_labels(folder: &Path, stem: &str, info: &DatasetInfo) -> Frame {
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
