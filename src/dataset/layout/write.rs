//! Frames that are written in the files of a layout: what a source of frames hands over, and what layouts write alike.

use crate::dataset::DatasetError;
use crate::dataset::npz::ArrayView;
use crate::geometry::Vec3;
use crate::radar::{PinholeCamera, View};
use num_complex::Complex64;
use std::path::{Path, PathBuf};

/// Bits of the mantissa that stored floats keep in packed files; the rest is zero and deflates away. Half a step is 1e−4 of a
/// value.
pub const MANTISSA_BITS: u32 = 12;
/// Joints of COCO's skeleton.
pub(super) const COCO_JOINTS: usize = 17;
/// Skin beyond the joints, m.
pub(super) const SKIN_M: f64 = 0.10;

/// Writes frames in the files of a layout.
pub trait FrameWriter: Sync {
    /// Frames of a file; every file is written whole.
    fn frames_a_file(&self) -> usize {
        1
    }

    /// Every file that frame `at` is written into, or that is its own.
    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf>;

    /// Writes the frames of one file, or of one each: those from `at` on, whose maps are those of `views`. What it answers is
    /// kept for [`Self::finish`].
    ///
    /// # Errors
    /// Where a file cannot be written.
    fn write(
        &self,
        at: &NewPlace<'_>,
        views: &[View],
        frames: &[NewFrame<'_>],
        narrow: bool,
    ) -> Result<Option<String>, DatasetError>;

    /// Writes what belongs to all frames: `kept` has what [`Self::write`] answered, sequence by sequence.
    ///
    /// # Errors
    /// Where a file cannot be written.
    fn finish(&self, _root: &Path, _kept: &[Vec<String>]) -> Result<(), DatasetError> {
        Ok(())
    }

    /// The pattern of a manifest that finds the files of so many sequences, where a manifest has to say it.
    fn pattern(&self, _sequences: usize) -> Option<&'static str> {
        None
    }

    /// Whether the truth is in joints of the layout's own, which its preset knows, and not in COCO's.
    fn has_own_joints(&self) -> bool {
        false
    }
}

/// Where a frame goes.
#[derive(Debug, Clone, Copy)]
pub struct NewPlace<'a> {
    /// The data set's folder.
    pub root: &'a Path,
    /// The sequence, from 0, and how many there are.
    pub sequence: usize,
    /// Sequences in all.
    pub sequences: usize,
    /// The frame's number in its sequence, from 0.
    pub number: usize,
}

/// A frame that is to be written.
#[derive(Debug, Clone, Copy)]
pub struct NewFrame<'a> {
    /// One map a view, C order.
    pub maps: &'a [Vec<f32>],
    /// What is stored instead of the maps, one a view: a complex cube, or several maps one after the other; for layouts that do.
    pub cubes: &'a [Vec<Complex64>],
    /// COCO's joints of each person, m.
    pub joints: &'a [Vec<Vec3>],
    /// Their velocities, m/s.
    pub velocities: &'a [Vec<Vec3>],
    /// Seconds since the sequence began.
    pub timestamp_s: f64,
    /// What happens, in words.
    pub scenario: &'a str,
}

/// What is true of a frame, as it is stored; SPEC section 6.
pub(super) struct TruthArrays<'a> {
    shape: [usize; 3],
    joints: Vec<f32>,
    velocities: Vec<f32>,
    count: [i64; 1],
    timestamp_s: [f64; 1],
    scenario: &'a str,
}

impl<'a> TruthArrays<'a> {
    /// `joints` a person: an empty frame has as many as any other.
    pub(super) fn of(frame: &NewFrame<'a>, joints: usize) -> Self {
        let flat =
            |persons: &[Vec<Vec3>]| -> Vec<f32> { persons.iter().flatten().flatten().map(|&x| x as f32).collect() };
        let persons = frame.joints.len();
        Self {
            shape: [persons, joints, 3],
            joints: flat(frame.joints),
            velocities: flat(frame.velocities),
            count: [persons as i64],
            timestamp_s: [frame.timestamp_s],
            scenario: frame.scenario,
        }
    }

    pub(super) fn arrays(&self) -> [(&'static str, ArrayView<'_>); 5] {
        [
            ("joints", ArrayView::f32(&self.shape, &self.joints)),
            ("velocities", ArrayView::f32(&self.shape, &self.velocities)),
            ("person_count", ArrayView::i64(&[], &self.count)),
            ("timestamp_s", ArrayView::f64(&[], &self.timestamp_s)),
            ("scenario", ArrayView::text(self.scenario)),
        ]
    }
}

/// The maps with [`MANTISSA_BITS`] bits of mantissa.
pub(super) fn rounded_maps(frame: &NewFrame<'_>) -> Vec<Vec<f32>> {
    frame.maps.iter().map(|map| map.iter().map(|&x| rounded(x)).collect()).collect()
}

/// Maps under the names of their views.
pub(super) fn named<'a>(views: &'a [View], maps: &'a [Vec<f32>]) -> Vec<(&'a str, ArrayView<'a>)> {
    views.iter().zip(maps).map(|(view, map)| (&*view.array, ArrayView::f32(&view.shape(), map))).collect()
}

/// `x` with [`MANTISSA_BITS`] bits of mantissa, to nearest.
fn rounded(x: f32) -> f32 {
    let dropped = f32::MANTISSA_DIGITS - 1 - MANTISSA_BITS;
    let bits = x.to_bits() + (1 << (dropped - 1));
    f32::from_bits(bits & !((1 << dropped) - 1))
}

/// A joint in the image of a camera, px; what is at the camera or behind is taken for just before it.
pub(super) fn pixel(camera: &PinholeCamera, joint: Vec3) -> [f64; 2] {
    let ([fu, fv], [cu, cv], depth) = (camera.focal_px, camera.centre_px, joint[0].max(0.05));
    [cu - fu * joint[1] / depth, cv - fv * joint[2] / depth]
}

/// The box about a body, clipped to an image of that width and height: x0, y0, x1, y1 px.
pub(super) fn image_box(camera: &PinholeCamera, size: [usize; 2], joints: &[Vec3]) -> [f64; 4] {
    let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for &joint in joints {
        let margin = camera.focal_px[0] * SKIN_M / joint[0].max(0.05);
        let [x, y] = pixel(camera, joint);
        bounds = [
            bounds[0].min(x - margin),
            bounds[1].min(y - margin),
            bounds[2].max(x + margin),
            bounds[3].max(y + margin),
        ];
    }
    let [width, height] = size.map(|px| px as f64);
    [
        bounds[0].clamp(0.0, width),
        bounds[1].clamp(0.0, height),
        bounds[2].clamp(0.0, width),
        bounds[3].clamp(0.0, height),
    ]
}

/// The box about a body on a map of two axes, with so much about its joints: column 0, row 0, column 1, row 1.
pub(super) fn map_box(view: &View, joints: &[Vec3], margin_m: f64) -> [f64; 4] {
    let bins: Vec<Vec<f64>> = joints.iter().map(|&joint| view.bins_of(joint)).collect();
    let span = |axis: usize| {
        let (margin, last) = view.axes.get(axis).map_or((0.0, 0.0), |a| (margin_m / a.step().abs(), a.bins as f64));
        let values = bins.iter().filter_map(|bins| bins.get(axis).copied());
        let low = values.clone().fold(f64::INFINITY, f64::min) - margin;
        let high = values.fold(f64::NEG_INFINITY, f64::max) + margin;
        [low.clamp(0.0, last), high.clamp(0.0, last)]
    };
    let ([row0, row1], [column0, column1]) = (span(0), span(1));
    [column0, row0, column1, row1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_twelve_bits_and_the_nearest_value() {
        for x in [1.0f32, 1.000_2, 3.371_592_7, 12_345.678, 7.7e8] {
            let r = rounded(x);
            assert_eq!(r.to_bits() & 0x7FF, 0);
            assert!((r - x).abs() <= x * 2f32.powi(-13), "{x} {r}");
        }
    }
}
