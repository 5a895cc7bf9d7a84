//! One axis of a map: what it measures and where its bins lie.

use crate::geometry::{Vec3, norm};
use serde::{Deserialize, Serialize};

/// What an axis measures; SPEC section 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AxisKind {
    /// d = ‖p‖, m.
    Range,
    /// atan2(p_y, p_x), rad.
    Azimuth,
    /// atan2(p_z, √(p_x² + p_y²)), rad.
    Elevation,
    /// v·p/d, m/s, positive moving away.
    Doppler,
    /// asin(p_y/d), rad: what a linear horizontal array measures.
    Cone,
    /// p_x, m.
    X,
    /// p_y, m.
    Y,
    /// p_z, m.
    Z,
    /// √(p_x² + p_z²), m: depth in the plane of a horizontal array.
    DepthH,
    /// √(p_x² + p_y²), m: depth in the plane of a vertical array.
    DepthV,
}

impl AxisKind {
    /// Every kind, in the order of SPEC section 1.
    pub const ALL: [Self; 10] = [
        Self::Range,
        Self::Azimuth,
        Self::Elevation,
        Self::Doppler,
        Self::Cone,
        Self::X,
        Self::Y,
        Self::Z,
        Self::DepthH,
        Self::DepthV,
    ];

    /// The name used in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::Range => "range",
            Self::Azimuth => "azimuth",
            Self::Elevation => "elevation",
            Self::Doppler => "doppler",
            Self::Cone => "cone",
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::DepthH => "depth_h",
            Self::DepthV => "depth_v",
        }
    }

    /// True for azimuth, elevation and cone: stored in radians, shown in degrees.
    pub fn is_angular(self) -> bool {
        matches!(self, Self::Azimuth | Self::Elevation | Self::Cone)
    }

    /// True for a coordinate in metres that grows away from the radar: range, x and the depths.
    pub fn is_depth(self) -> bool {
        matches!(self, Self::Range | Self::X | Self::DepthH | Self::DepthV)
    }
}

/// How the bins of an axis are spaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spacing {
    /// Uniform in the quantity itself.
    #[default]
    Linear,
    /// Uniform in the sine of the angle; `lo` and `hi` are sines.
    Sine,
}

/// One axis: ξ(i) = lo + i·step, step = (hi − lo)/bins. `lo` is the centre of bin 0, `hi` one step past the last centre;
/// `lo > hi` is legal and describes a falling axis. Units: metres, radians, m/s, or sines.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// What the axis measures.
    pub kind: AxisKind,
    /// Number of bins.
    pub bins: usize,
    /// Centre of bin 0.
    pub lo: f64,
    /// One step past the centre of the last bin.
    pub hi: f64,
    /// Linear, or uniform in the sine.
    #[serde(default)]
    pub spacing: Spacing,
}

impl Axis {
    /// Step between bin centres, in axis units (may be negative).
    #[inline]
    pub fn step(&self) -> f64 {
        (self.hi - self.lo) / self.bins as f64
    }

    /// Axis coordinate ξ of a point at rest in the view frame, m (0 on a Doppler axis); SPEC section 1.
    #[inline]
    pub fn coordinate(&self, p_view: Vec3) -> f64 {
        let [x, y, z] = p_view;
        let angle = match self.kind {
            AxisKind::Range => return norm(p_view),
            AxisKind::Doppler => return 0.0,
            AxisKind::X => return x,
            AxisKind::Y => return y,
            AxisKind::Z => return z,
            AxisKind::DepthH => return x.hypot(z),
            AxisKind::DepthV => return x.hypot(y),
            AxisKind::Azimuth => y.atan2(x),
            AxisKind::Elevation => z.atan2(x.hypot(y)),
            AxisKind::Cone => (y / norm(p_view).max(1e-9)).clamp(-1.0, 1.0).asin(),
        };
        match self.spacing {
            Spacing::Linear => angle,
            Spacing::Sine => angle.sin(),
        }
    }

    /// Axis coordinate at bin coordinate `bin` (an integer is a bin centre).
    #[inline]
    pub fn at(&self, bin: f64) -> f64 {
        self.lo + bin * self.step()
    }

    /// Bin coordinate of the axis coordinate `xi`.
    #[inline]
    pub fn bin(&self, xi: f64) -> f64 {
        (xi - self.lo) / self.step()
    }

    /// The physical value at a bin coordinate: metres, m/s or radians (the arcsine is taken on a sine axis).
    #[inline]
    pub fn value_at(&self, bin: f64) -> f64 {
        match self.spacing {
            Spacing::Linear => self.at(bin),
            Spacing::Sine => self.at(bin).clamp(-1.0, 1.0).asin(),
        }
    }

    /// The value as shown to a person: degrees on an angular axis, else the SI value.
    pub fn shown_at(&self, bin: f64) -> f64 {
        let value = self.value_at(bin);
        if self.kind.is_angular() { value.to_degrees() } else { value }
    }

    /// Unit of [`Self::shown_at`].
    pub fn shown_unit(&self) -> &'static str {
        match self.kind {
            AxisKind::Doppler => "m/s",
            kind if kind.is_angular() => "°",
            _ => "m",
        }
    }

    /// The name shown on screen.
    pub fn shown_name(&self) -> &'static str {
        match self.kind {
            AxisKind::Range => "range",
            AxisKind::Azimuth => "azimuth",
            AxisKind::Elevation => "elevation",
            AxisKind::Doppler => "radial velocity",
            AxisKind::Cone => "cone angle",
            AxisKind::X => "x",
            AxisKind::Y => "y",
            AxisKind::Z => "z",
            AxisKind::DepthH | AxisKind::DepthV => "depth",
        }
    }
}
