//! One frame as it lies in memory: maps, and whatever labels the data set has.

use crate::geometry::Vec3;

/// One map: a C-ordered array, cast to f64, NaN cells as stored.
#[derive(Debug, Clone, PartialEq)]
pub struct Heatmap {
    /// Bins of each axis.
    pub shape: Vec<usize>,
    /// Cells, last axis fastest.
    pub data: Vec<f64>,
    /// The dtype in the file, for example `<f4`.
    pub dtype: String,
}

/// Joints that a data set publishes in metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// (persons · joints) positions, m, world frame.
    pub joints: Vec<Vec3>,
    /// (persons · joints) velocities, m/s, where the data set has them.
    pub velocities: Option<Vec<Vec3>>,
    /// Persons.
    pub persons: usize,
}

/// Labels in the pixels of a camera image. They are pixels, never metres, and are never compared with 3-D joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImageAnnotations {
    /// Image size (width, height), px.
    pub size: [usize; 2],
    /// Key points per person: (x px to the right, y px down, score), in the order of `joint_names`.
    pub keypoints: Vec<Vec<[f64; 3]>>,
    /// Name of the skeleton whose joints the key points are, for example `coco17`.
    pub keypoint_skeleton: String,
    /// Boxes per person: x0, y0, x1, y1 px, score.
    pub boxes: Vec<[f64; 5]>,
    /// One mask per person, row-major height × width.
    pub masks: Vec<Vec<bool>>,
}

/// One frame of a data set.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Index in the data set.
    pub index: usize,
    /// What identifies it for a person: a path without its ending, for example `d1s1/000/00383`.
    pub name: String,
    /// The data set's own id, where it has one.
    pub global_id: Option<String>,
    /// Seconds since the sequence began, where known.
    pub timestamp_s: Option<f64>,
    /// One map a view, in the order of the data set's views.
    pub maps: Vec<Heatmap>,
    /// Labelled boxes on each view's map, in bins: [axis-0 lo, axis-1 lo, axis-0 hi, axis-1 hi] (row, column order).
    pub map_boxes: Vec<Vec<[f64; 4]>>,
    /// Annotated number of people, where known.
    pub person_count: Option<usize>,
    /// Joints in metres, where the data set has them.
    pub truth: Option<Truth>,
    /// Labels in image pixels, where the data set has them.
    pub image: Option<ImageAnnotations>,
    /// Companion files or keys that are missing or unreadable, in words.
    pub notes: Vec<String>,
}

/// The cells of each map, C order.
pub fn map_cells(maps: &[Heatmap]) -> Vec<&[f64]> {
    maps.iter().map(|map| map.data.as_slice()).collect()
}

impl Frame {
    /// Memory that this frame holds, bytes; small parts rounded up.
    pub fn bytes(&self) -> usize {
        let maps: usize = self.maps.iter().map(|m| m.data.len() * size_of::<f64>()).sum();
        let truth = self.truth.as_ref().map_or(0, |t| (t.joints.len() * 2) * size_of::<Vec3>());
        let image = self.image.as_ref().map_or(0, |image| {
            let masks: usize = image.masks.iter().map(Vec::len).sum();
            let points: usize = image.keypoints.iter().map(Vec::len).sum();
            masks + points * size_of::<[f64; 3]>() + image.boxes.len() * size_of::<[f64; 5]>()
        });
        let boxes: usize = self.map_boxes.iter().map(|boxes| boxes.len() * size_of::<[f64; 4]>()).sum();
        let notes: usize = self.notes.iter().map(String::len).sum();
        maps + truth + image + boxes + notes + 4096
    }
}
