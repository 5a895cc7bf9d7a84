//! Transmitters and receivers: where they are, and the virtual array that they make together.

use crate::geometry::{Mat3, Vec3, mat_vec, scale};

/// A MIMO array about the origin; boresight is x. Channels are ordered (transmitter, receiver): channel
/// `tx · receivers + rx` measures the path from one transmitter to one receiver, as an element at the sum of both places would.
#[derive(Debug, Clone, PartialEq)]
pub struct MimoArray {
    /// Transmitters, m, in the order in which they send.
    pub tx: Vec<Vec3>,
    /// Receivers, m.
    pub rx: Vec<Vec3>,
}

impl MimoArray {
    /// `tx` transmitters and `rx` receivers along the unit vector `direction`, so that the virtual elements are a centred line
    /// with even spacing.
    pub fn line(direction: Vec3, tx: usize, rx: usize, spacing_m: f64) -> Self {
        let row = |count: usize, step: f64| {
            (0..count).map(|i| scale(direction, (i as f64 - (count as f64 - 1.0) / 2.0) * step)).collect()
        };
        Self { tx: row(tx, rx as f64 * spacing_m), rx: row(rx, spacing_m) }
    }

    /// Virtual elements.
    pub fn channels(&self) -> usize {
        self.tx.len() * self.rx.len()
    }

    /// The array turned about the origin.
    pub fn turned(&self, rotation: &Mat3) -> Self {
        let turn = |places: &[Vec3]| places.iter().map(|&place| mat_vec(rotation, place)).collect();
        Self { tx: turn(&self.tx), rx: turn(&self.rx) }
    }
}
