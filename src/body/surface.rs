//! The skin of a [`Walker`]: points that scatter, fixed on the rigid segments.
//!
//! Limbs are tapered cylinders, the trunk an elliptic cylinder, the head an ellipsoid, hands and feet ellipsoids at
//! the ends of their limbs. Points are spread evenly over the area of each part; a point's reflectivity is a circular
//! complex Gaussian (speckle: at millimetre waves the skin between two points is many wavelengths of unknown relief)
//! times the root of the area it stands for. A point is seen as far as its normal faces the radar; one part does not
//! hide another.

use super::{BodyPose, Segment, Walker};
use crate::geometry::{Vec3, dot, mat_vec, norm, scale};
use num_complex::Complex64;
use rand::Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

/// One point of the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The segment that carries it.
    pub segment: Segment,
    /// m, in the segment's frame.
    pub position: Vec3,
    /// Outward unit normal, in the segment's frame.
    pub normal: Vec3,
    /// Complex amplitude of its echo, seen face on.
    pub reflectivity: Complex64,
}

/// All points of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySurface {
    points: Vec<SurfacePoint>,
}

/// A part of the body: an elliptic cylinder that tapers from its top to its bottom along z, or an ellipsoid.
#[derive(Clone, Copy)]
struct Part {
    segment: Segment,
    /// Middle of the top (cylinder) or of the body (ellipsoid), m, for a person of 1.70 m.
    top: Vec3,
    shape: Shape,
    /// Amplitude relative to bare skin.
    strength: f64,
}

#[derive(Clone, Copy)]
enum Shape {
    /// Half widths (x, y) at the top, the share of them left at the bottom, and the length down along −z, m.
    Cylinder { half: [f64; 2], taper: f64, length: f64 },
    /// Half axes, m.
    Ellipsoid([f64; 3]),
}

impl BodySurface {
    /// Spreads about `count` points over the skin of `walker`; the same generator state gives the same skin.
    pub fn new(walker: &Walker, count: usize, rng: &mut impl Rng) -> Self {
        let parts = parts(walker);
        let area: f64 = parts.iter().map(Part::area_m2).sum();
        let mut points = Vec::with_capacity(count + parts.len());
        for part in &parts {
            let share = (count as f64 * part.area_m2() / area).round().max(1.0);
            for _ in 0..share as usize {
                points.push(part.point(part.area_m2() / share, rng));
            }
        }
        Self { points }
    }

    /// The points.
    pub fn points(&self) -> &[SurfacePoint] {
        &self.points
    }

    /// World positions, m, and amplitudes of the points that a radar at the origin sees when the body stands in `pose`:
    /// reflectivity times the square of the cosine between normal and line of sight, none from behind.
    pub fn seen(&self, pose: &BodyPose) -> Vec<(Vec3, Complex64)> {
        let seen = |point: &SurfacePoint| {
            let frame = &pose.segments[point.segment as usize];
            let position = frame.place(point.position);
            let facing = -dot(mat_vec(&frame.rotation, point.normal), position) / norm(position);
            (facing > 0.0).then(|| (position, point.reflectivity * facing * facing))
        };
        self.points.iter().filter_map(seen).collect()
    }
}

impl Part {
    /// Area, m²; that of a cylinder without its ends, an ellipsoid's by Thomsen's formula (1 % off).
    fn area_m2(&self) -> f64 {
        match self.shape {
            Shape::Cylinder { half: [a, b], taper, length } => {
                TAU * (f64::midpoint(a * a, b * b)).sqrt() * f64::midpoint(1.0, taper) * length
            }
            Shape::Ellipsoid([a, b, c]) => {
                let p = 1.6075;
                let mean = ((a * b).powf(p) + (a * c).powf(p) + (b * c).powf(p)) / 3.0;
                2.0 * TAU * mean.powf(1.0 / p)
            }
        }
    }

    fn point(&self, area_m2: f64, rng: &mut impl Rng) -> SurfacePoint {
        let (offset, normal) = match self.shape {
            Shape::Cylinder { half: [a, b], taper, length } => {
                let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
                let down: f64 = rng.random_range(0.0..1.0);
                let width = 1.0 + (taper - 1.0) * down;
                ([a * width * cos, b * width * sin, -length * down], [cos / a, sin / b, 0.0])
            }
            Shape::Ellipsoid([a, b, c]) => {
                let direction: [f64; 3] = std::array::from_fn(|_| rng.sample(StandardNormal));
                let u = scale(direction, 1.0 / norm(direction));
                ([a * u[0], b * u[1], c * u[2]], [u[0] / a, u[1] / b, u[2] / c])
            }
        };
        let speckle = Complex64::new(rng.sample(StandardNormal), rng.sample(StandardNormal));
        SurfacePoint {
            segment: self.segment,
            position: crate::geometry::add(self.top, offset),
            normal: scale(normal, 1.0 / norm(normal)),
            reflectivity: speckle * (self.strength * (area_m2 / 2.0).sqrt()),
        }
    }
}

/// The parts of a body of the walker's height. Trunk and head are stronger than the limbs (clothing and curvature).
fn parts(walker: &Walker) -> Vec<Part> {
    let k = walker.height_m / 1.70;
    let limb = |segment: Segment, half: [f64; 2], taper: f64| {
        let length = walker.segment_length_m(segment);
        Part {
            segment,
            top: [0.0; 3],
            shape: Shape::Cylinder { half: half.map(|w| w * k), taper, length },
            strength: 1.0,
        }
    };
    let end = |segment: Segment, forward: f64, half: [f64; 3]| Part {
        segment,
        top: [forward * k, 0.0, -walker.segment_length_m(segment) - 0.5 * half[2] * k],
        shape: Shape::Ellipsoid(half.map(|w| w * k)),
        strength: 1.0,
    };
    let trunk = Shape::Cylinder { half: [0.115 * k, 0.170 * k], taper: 0.95, length: 0.60 * k };
    let head = Shape::Ellipsoid([0.095 * k, 0.075 * k, 0.115 * k]);
    let mut parts = vec![
        Part { segment: Segment::Trunk, top: [0.0, 0.0, 0.53 * k], shape: trunk, strength: 1.5 },
        Part { segment: Segment::Trunk, top: [0.015 * k, 0.0, 0.685 * k], shape: head, strength: 1.2 },
    ];
    for segment in [Segment::LeftUpperArm, Segment::RightUpperArm] {
        parts.push(limb(segment, [0.048, 0.048], 0.85));
    }
    for segment in [Segment::LeftForearm, Segment::RightForearm] {
        parts.extend([limb(segment, [0.040, 0.040], 0.7), end(segment, 0.0, [0.04, 0.02, 0.08])]);
    }
    for segment in [Segment::LeftThigh, Segment::RightThigh] {
        parts.push(limb(segment, [0.080, 0.080], 0.7));
    }
    for segment in [Segment::LeftShank, Segment::RightShank] {
        parts.extend([limb(segment, [0.055, 0.055], 0.65), end(segment, 0.07, [0.12, 0.045, 0.035])]);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sub;
    use rand::{SeedableRng, rngs::StdRng};

    #[test]
    fn points_stay_near_the_bones_and_only_the_near_side_is_seen() {
        let walker = Walker::default();
        let skin = BodySurface::new(&walker, 600, &mut StdRng::seed_from_u64(1));
        assert!((560..680).contains(&skin.points().len()), "{}", skin.points().len());
        for point in skin.points() {
            assert!((norm(point.normal) - 1.0).abs() < 1e-12);
        }
        let pose = walker.pose(0.7);
        let seen = skin.seen(&pose);
        let share = seen.len() as f64 / skin.points().len() as f64;
        assert!((0.4..0.6).contains(&share), "{share}");
        for (position, _) in seen {
            let nearest = pose.joints.iter().map(|&j| norm(sub(position, j))).fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.40, "{position:?} is {nearest} m from every joint");
        }
    }
}
