//! A view: one map of a frame, with its pose, its point-spread function and its axes.

use super::{Axis, AxisKind};
use crate::geometry::{Pose, Vec3, add, dot, norm, sub};
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

/// What the stored numbers are: decides 20 or 10 log₁₀ on screen and nothing else (SPEC sections 4 and 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Magnitude: dB = 20 log₁₀.
    #[default]
    Amplitude,
    /// Squared magnitude: dB = 10 log₁₀.
    Power,
}

impl Quantity {
    /// The power of a stored number; what is stored as power and negative has none.
    pub fn power(self, stored: f64) -> f64 {
        match self {
            Self::Amplitude => stored * stored,
            Self::Power => stored.max(0.0),
        }
    }

    /// What is stored of a power: the other way of [`Self::power`].
    pub fn stored(self, power: f64) -> f64 {
        match self {
            Self::Amplitude => power.sqrt(),
            Self::Power => power,
        }
    }

    /// The factor before log₁₀ that makes decibels.
    pub fn db_factor(self) -> f64 {
        match self {
            Self::Amplitude => 20.0,
            Self::Power => 10.0,
        }
    }
}

/// Standard deviations of the Gaussian closest to the main lobe of the FFT's window; SPEC section 3, `psf`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSpread {
    /// σ_r, m.
    pub range_m: f64,
    /// σ_az at boresight, rad.
    pub azimuth_rad: f64,
    /// σ_el at boresight, rad.
    pub elevation_rad: f64,
    /// σ_dop, m/s.
    pub doppler_mps: f64,
    /// What the map adds to a range, m: cables, filters, the sample at which a chirp is taken to begin.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub range_offset_m: f64,
    /// What it adds beside that, as the maps themselves tell, m.
    #[serde(skip)]
    pub measured_offset_m: f64,
    /// What shape the lobes have besides, where the FFTs are known.
    #[serde(skip)]
    pub lobes: Lobes,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "what serde hands over")]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// The main lobe of each quantity in its window's own shape; `None` where that is not known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lobes {
    /// Along range.
    pub range: Option<Lobe>,
    /// Along azimuth.
    pub azimuth: Option<Lobe>,
    /// Along elevation.
    pub elevation: Option<Lobe>,
    /// Along Doppler.
    pub doppler: Option<Lobe>,
}

/// A window's main lobe as a difference of Gaussians, Σ_c w_c exp(−½ (x/(σ f_c))²) with w of [`Lobe::WEIGHTS`] and σ that of the
/// one Gaussian closest to it. A Gaussian has no foot; the difference follows a lobe down to its first minimum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    /// f of each Gaussian.
    pub ratios: [f64; 2],
    /// How many σ a natural bin is, where no window tapers the samples: then sidelobes fall no faster than 1/(πu)², u in such bins.
    pub untapered: Option<f64>,
}

impl Lobe {
    /// w of each Gaussian: 1 at the peak.
    pub const WEIGHTS: [f64; 2] = [2.0, -1.0];
}

/// What is resolved by an FFT of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolves {
    /// Samples of a chirp.
    Range,
    /// Elements along y.
    Azimuth,
    /// Elements along z.
    Elevation,
    /// Chirps.
    Doppler,
}

impl Resolves {
    /// What the width along an axis comes from.
    pub fn of(kind: AxisKind) -> Self {
        match kind {
            AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => Self::Range,
            AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y => Self::Azimuth,
            AxisKind::Elevation | AxisKind::Z => Self::Elevation,
            AxisKind::Doppler => Self::Doppler,
        }
    }
}

impl PointSpread {
    /// What the map adds to a range in all, m.
    pub fn offset_m(&self) -> f64 {
        self.range_offset_m + self.measured_offset_m
    }

    /// The lobe of a quantity.
    pub fn lobe(&self, of: Resolves) -> Option<Lobe> {
        let Lobes { range, azimuth, elevation, doppler } = self.lobes;
        match of {
            Resolves::Range => range,
            Resolves::Azimuth => azimuth,
            Resolves::Elevation => elevation,
            Resolves::Doppler => doppler,
        }
    }

    /// The same, to be changed.
    pub fn lobe_mut(&mut self, of: Resolves) -> &mut Option<Lobe> {
        let Lobes { range, azimuth, elevation, doppler } = &mut self.lobes;
        match of {
            Resolves::Range => range,
            Resolves::Azimuth => azimuth,
            Resolves::Elevation => elevation,
            Resolves::Doppler => doppler,
        }
    }

    /// The width of a quantity.
    pub fn width_mut(&mut self, of: Resolves) -> &mut f64 {
        match of {
            Resolves::Range => &mut self.range_m,
            Resolves::Azimuth => &mut self.azimuth_rad,
            Resolves::Elevation => &mut self.elevation_rad,
            Resolves::Doppler => &mut self.doppler_mps,
        }
    }
}

/// One map of a frame. The map is a C-ordered array whose shape is the axes' bins.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Key of the array in the frame's npz.
    pub array: String,
    /// Amplitude or power.
    pub quantity: Quantity,
    /// Point-spread widths.
    pub psf: PointSpread,
    /// `p_view = rotation · p_world + translation`.
    pub pose: Pose,
    /// Two or three axes.
    pub axes: Vec<Axis>,
    /// A fixed EM region in bins, `[lo, hi)` per axis; wins over the configuration's `em_region`.
    pub region: Option<Vec<[usize; 2]>>,
}

/// The bin on each axis of a cell in C order; `shape` is the axes' bins.
pub fn unravel(mut cell: usize, shape: &[usize]) -> SmallVec<[usize; 3]> {
    let mut bins = SmallVec::from_elem(0, shape.len());
    for (bin, &size) in bins.iter_mut().zip(shape).rev() {
        *bin = cell % size.max(1);
        cell /= size.max(1);
    }
    bins
}

impl View {
    /// Bins of each axis.
    pub fn shape(&self) -> Vec<usize> {
        self.axes.iter().map(|axis| axis.bins).collect()
    }

    /// Where the view sees a point, view frame, m: along its ray by what the map adds to a range.
    pub fn seen_at(&self, p_world: Vec3) -> Vec3 {
        let p_view = self.pose.view_from_world(p_world);
        let offset_m = self.psf.offset_m();
        if offset_m == 0.0 {
            return p_view;
        }
        let range_m = norm(p_view).max(1e-9);
        p_view.map(|x| x * (1.0 + offset_m / range_m).max(0.0))
    }

    /// The point that the view sees at a place, world metres: what [`Self::seen_at`] undoes.
    pub fn place_of(&self, p_seen: Vec3) -> Vec3 {
        let range_m = norm(p_seen).max(1e-9);
        self.pose.world_from_view(p_seen.map(|x| x * (1.0 - self.psf.offset_m() / range_m).max(0.0)))
    }

    /// Bin coordinates of a point at rest, world metres: where a drawing of it belongs on the map.
    pub fn bins_of(&self, p_world: Vec3) -> Vec<f64> {
        let p_view = self.seen_at(p_world);
        self.axes.iter().map(|axis| axis.bin(axis.coordinate(p_view))).collect()
    }

    /// Bin coordinates of a point that moves at `v_world`, m/s: on a Doppler axis it is at its radial velocity.
    pub fn bins_of_moving(&self, p_world: Vec3, v_world: Vec3) -> Vec<f64> {
        let p_view = self.pose.view_from_world(p_world);
        let v_view = sub(self.pose.view_from_world(add(p_world, v_world)), p_view);
        let radial = dot(v_view, p_view) / norm(p_view).max(1e-9);
        let p_view = self.seen_at(p_world);
        let coordinate = |axis: &Axis| if axis.kind == AxisKind::Doppler { radial } else { axis.coordinate(p_view) };
        self.axes.iter().map(|axis| axis.bin(coordinate(axis))).collect()
    }

    /// Number of cells of the whole map.
    pub fn cells(&self) -> usize {
        self.axes.iter().map(|axis| axis.bins).product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Spacing;

    /// Who comes closer is at a negative radial velocity, who walks across at 0, whatever way the radar looks.
    #[test]
    fn a_moving_point_is_at_its_radial_velocity() {
        let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        let axes = vec![axis(AxisKind::Range, 11, 0.0, 10.0), axis(AxisKind::Doppler, 9, -4.0, 4.0)];
        let turned = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        for rotation in [Pose::default().rotation, turned] {
            let pose = Pose { rotation, ..Pose::default() };
            let (array, quantity) = ("m".into(), Quantity::Amplitude);
            let view = View { array, quantity, psf: PointSpread::default(), pose, axes: axes.clone(), region: None };
            for (v, doppler) in [([-1.5, 0.0, 0.0], -1.5), ([0.0, 2.0, 0.0], 0.0), ([2.0, 0.0, 1.0], 2.0)] {
                let bins = view.bins_of_moving([3.0, 0.0, 0.0], v);
                let expected = [view.axes[0].bin(3.0), view.axes[1].bin(doppler)];
                assert!((0..2).all(|axis| (bins[axis] - expected[axis]).abs() < 1e-9), "{v:?}: {bins:?}");
            }
        }
    }
}
