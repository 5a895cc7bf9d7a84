//! One npz a frame: the maps under their views' names, and the truth (SPEC section 6).

use crate::dataset::npz::{ArrayView, NpzError, write_deflated};
use crate::geometry::Vec3;
use crate::radar::View;
use crate::simulate::SimulatedFrame;
use std::path::Path;

/// Bits of the mantissa that the stored floats keep; the rest is zero and deflates away. Half a step is 1e−4 of a value.
pub(super) const MANTISSA_BITS: u32 = 12;

/// Joints of COCO's skeleton.
pub(super) const COCO_JOINTS: usize = 17;

pub(super) fn write(path: &Path, views: &[View], frame: &SimulatedFrame) -> Result<(), NpzError> {
    let maps: Vec<Vec<f32>> = frame.maps.iter().map(|map| map.iter().map(|&x| rounded(x)).collect()).collect();
    let truth = StoredTruth::of(frame, COCO_JOINTS);
    let mut arrays: Vec<(&str, ArrayView<'_>)> =
        views.iter().zip(&maps).map(|(view, map)| (&*view.array, ArrayView::f32(&view.shape(), map))).collect();
    arrays.extend(truth.arrays());
    write_deflated(path, &arrays)
}

/// What is true of a frame, as it is stored.
pub(super) struct StoredTruth<'a> {
    shape: [usize; 3],
    joints: Vec<f32>,
    velocities: Vec<f32>,
    count: [i64; 1],
    timestamp_s: [f64; 1],
    scenario: &'a str,
}

impl<'a> StoredTruth<'a> {
    /// `joints` a person: an empty frame has as many as any other.
    pub(super) fn of(frame: &'a SimulatedFrame, joints: usize) -> Self {
        let flat =
            |persons: &[Vec<Vec3>]| -> Vec<f32> { persons.iter().flatten().flatten().map(|&x| x as f32).collect() };
        let persons = frame.joints.len();
        Self {
            shape: [persons, joints, 3],
            joints: flat(&frame.joints),
            velocities: flat(&frame.velocities),
            count: [persons as i64],
            timestamp_s: [frame.timestamp_s],
            scenario: &frame.scenario,
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

/// `x` with [`MANTISSA_BITS`] bits of mantissa, to nearest.
pub(super) fn rounded(x: f32) -> f32 {
    let dropped = f32::MANTISSA_DIGITS - 1 - MANTISSA_BITS;
    let bits = x.to_bits() + (1 << (dropped - 1));
    f32::from_bits(bits & !((1 << dropped) - 1))
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
