//! The skin of a body: points that scatter, fixed on the rigid segments.
//!
//! Limbs are tapered cylinders, the trunk an elliptic cylinder, the head an ellipsoid, hands and feet ellipsoids at
//! the ends of their limbs. Points are spread evenly over the area of each part; a point's reflectivity is a circular
//! complex Gaussian (speckle: at millimetre waves the skin between two points is many wavelengths of unknown relief)
//! times the root of the area it stands for; as the body moves, the phases between points change and the speckle with them.
//! A point is seen as far as its normal faces the radar and no part of anybody's body is in the way. Parts that hide are capsules
//! about the segments' axes, with an edge that is soft as diffraction makes it.

use super::{BodyPose, Build, Segment};
use crate::geometry::{Vec3, add, dot, mat_vec, norm, scale, sub};
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
    /// Axis ends in the segment's frame, m, and radius, m.
    cores: Vec<(Segment, [Vec3; 2], f64)>,
}

/// A part of a body that hides what is behind it: all within `radius_m` of the line between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// Ends of the axis, m, world frame.
    pub ends: [Vec3; 2],
    /// m.
    pub radius_m: f64,
}

/// Amplitude that reaches round a body that is in the way: some 20 dB less, two ways.
const BEHIND: f64 = 0.1;
/// Share of a capsule's radius at which it begins to be transparent.
const CORE_SHARE: f64 = 0.7;
/// How far behind a capsule's surface something must be to be hidden by it, m: a part does not hide its own skin.
const CLEARANCE_M: f64 = 0.05;

impl Capsule {
    /// Share of the amplitude from `point` that passes the capsule on its way to the radar at the origin.
    pub fn lets_through(&self, point: Vec3) -> f64 {
        let (along, distance) = nearest(point, self.ends);
        let ahead = (1.0 - along) * norm(point);
        if ahead < self.radius_m + CLEARANCE_M || distance >= self.radius_m {
            return 1.0;
        }
        let share = ((distance / self.radius_m - CORE_SHARE) / (1.0 - CORE_SHARE)).max(0.0);
        BEHIND + (1.0 - BEHIND) * share
    }
}

/// Where the line from the origin to `point` is nearest to the line between `ends`, as a share of the way to `point`, and how
/// near, m (Ericson, *Real-Time Collision Detection*, 5.1.9).
fn nearest(point: Vec3, ends: [Vec3; 2]) -> (f64, f64) {
    let (d1, d2, r) = (point, sub(ends[1], ends[0]), scale(ends[0], -1.0));
    let (a, e, f) = (dot(d1, d1).max(1e-12), dot(d2, d2).max(1e-12), dot(d2, r));
    let (b, c) = (dot(d1, d2), dot(d1, r));
    let parallel = a * e - b * b;
    let s = if parallel > 1e-12 { ((b * f - c * e) / parallel).clamp(0.0, 1.0) } else { 0.0 };
    let t = (b * s + f) / e;
    let (s, t) = if t < 0.0 {
        ((-c / a).clamp(0.0, 1.0), 0.0)
    } else if t > 1.0 {
        (((b - c) / a).clamp(0.0, 1.0), 1.0)
    } else {
        (s, t)
    };
    (s, norm(sub(scale(d1, s), add(ends[0], scale(d2, t)))))
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
    /// Spreads about `count` points over the skin of a body; the same generator state gives the same skin.
    pub fn new(build: &Build, count: usize, rng: &mut impl Rng) -> Self {
        let parts = parts(build);
        let area: f64 = parts.iter().map(Part::area_m2).sum();
        let mut points = Vec::with_capacity(count + parts.len());
        for part in &parts {
            let share = (count as f64 * part.area_m2() / area).round().max(1.0);
            for _ in 0..share as usize {
                points.push(part.point(part.area_m2() / share, rng));
            }
        }
        Self { points, cores: parts.iter().map(Part::core).collect() }
    }

    /// The points.
    pub fn points(&self) -> &[SurfacePoint] {
        &self.points
    }

    /// The body in `pose` as capsules, to hide what is behind.
    pub fn capsules(&self, pose: &BodyPose) -> Vec<Capsule> {
        let place = |&(segment, ends, radius_m): &(Segment, [Vec3; 2], f64)| {
            let frame = &pose.segments[segment as usize];
            Capsule { ends: ends.map(|end| frame.place(end)), radius_m }
        };
        self.cores.iter().map(place).collect()
    }

    /// The points that a radar at the origin sees when the body stands in `pose`, and the amplitude that reaches it of each:
    /// the square of the cosine between normal and line of sight (none from behind), times what the capsules let through.
    pub fn seen<'a>(
        &'a self,
        pose: &'a BodyPose,
        capsules: &'a [Capsule],
    ) -> impl Iterator<Item = (&'a SurfacePoint, Vec3, f64)> + 'a {
        self.points.iter().filter_map(move |point| {
            let frame = &pose.segments[point.segment as usize];
            let position = frame.place(point.position);
            let facing = -dot(mat_vec(&frame.rotation, point.normal), position) / norm(position);
            let passes = || capsules.iter().map(|capsule| capsule.lets_through(position)).product::<f64>();
            (facing > 0.0).then(|| (point, position, facing * facing * passes()))
        })
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

    /// The capsule that hides as the part does.
    fn core(&self) -> (Segment, [Vec3; 2], f64) {
        let (ends, radius) = match self.shape {
            Shape::Cylinder { half: [a, b], taper, length } => {
                let radius = f64::midpoint(a, b) * f64::midpoint(1.0, taper);
                ([[0.0, 0.0, -radius], [0.0, 0.0, radius - length]], radius)
            }
            Shape::Ellipsoid([a, b, c]) => {
                let radius = f64::midpoint(a.min(b).min(c), a.max(b).max(c).min(1.5 * b));
                ([[0.0; 3]; 2], radius)
            }
        };
        (self.segment, ends.map(|end| add(self.top, end)), radius)
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
            position: add(self.top, offset),
            normal: scale(normal, 1.0 / norm(normal)),
            reflectivity: speckle * (self.strength * (area_m2 / 2.0).sqrt()),
        }
    }
}

/// The parts of a body. Trunk and head are stronger than the limbs (clothing and curvature).
fn parts(build: &Build) -> Vec<Part> {
    let k = build.height_m / 1.70;
    let w = k * build.girth;
    let limb = |segment: Segment, half: f64, taper: f64| {
        let length = build.segment_length_m(segment);
        Part { segment, top: [0.0; 3], shape: Shape::Cylinder { half: [half * w; 2], taper, length }, strength: 1.0 }
    };
    let end = |segment: Segment, forward: f64, half: [f64; 3]| Part {
        segment,
        top: [forward * k, 0.0, -build.segment_length_m(segment) - 0.5 * half[2] * k],
        shape: Shape::Ellipsoid(half.map(|w| w * k)),
        strength: 1.0,
    };
    let trunk = Shape::Cylinder { half: [0.115 * w, 0.170 * w], taper: 0.95, length: 0.60 * k };
    let head = Shape::Ellipsoid([0.095 * k, 0.075 * k, 0.115 * k]);
    let mut parts = vec![
        Part { segment: Segment::Trunk, top: [0.0, 0.0, 0.53 * k], shape: trunk, strength: 1.5 },
        Part { segment: Segment::Trunk, top: [0.015 * k, 0.0, 0.685 * k], shape: head, strength: 1.2 },
    ];
    for segment in [Segment::LeftUpperArm, Segment::RightUpperArm] {
        parts.push(limb(segment, 0.048, 0.85));
    }
    for segment in [Segment::LeftForearm, Segment::RightForearm] {
        parts.extend([limb(segment, 0.040, 0.7), end(segment, 0.0, [0.04, 0.02, 0.08])]);
    }
    for segment in [Segment::LeftThigh, Segment::RightThigh] {
        parts.push(limb(segment, 0.080, 0.7));
    }
    for segment in [Segment::LeftShank, Segment::RightShank] {
        parts.extend([limb(segment, 0.055, 0.65), end(segment, 0.07, [0.12, 0.045, 0.035])]);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Gait, Motion, Performer};
    use rand::{SeedableRng, rngs::StdRng};

    #[test]
    fn points_stay_near_the_bones_and_only_the_near_side_is_seen() {
        let build = Build::default();
        let skin = BodySurface::new(&build, 600, &mut StdRng::seed_from_u64(1));
        assert!((560..680).contains(&skin.points().len()), "{}", skin.points().len());
        for point in skin.points() {
            assert!((norm(point.normal) - 1.0).abs() < 1e-12);
        }
        let motion = Motion::Walk(Gait::default());
        let walker = Performer { build, floor_z_m: -1.0, place: [0.0; 2], heading_rad: 0.0, phase: 0.0, motion };
        let pose = walker.pose(0.7);
        let seen: Vec<_> = skin.seen(&pose, &[]).collect();
        let share = seen.len() as f64 / skin.points().len() as f64;
        assert!((0.4..0.6).contains(&share), "{share}");
        for &(_, position, _) in &seen {
            let nearest = pose.joints.iter().map(|&j| norm(sub(position, j))).fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.40, "{position:?} is {nearest} m from every joint");
        }
        // The body's own parts hide some of it, but not most.
        let sideways = Performer { place: [3.0, 0.0], motion: Motion::Stand, heading_rad: 1.57, ..walker }.pose(0.0);
        let capsules = skin.capsules(&sideways);
        let strength = |capsules: &[Capsule]| skin.seen(&sideways, capsules).map(|(_, _, a)| a * a).sum::<f64>();
        let left = strength(&capsules) / strength(&[]);
        assert!((0.5..0.97).contains(&left), "{left}");
    }

    #[test]
    fn a_capsule_hides_what_is_behind_it_and_nothing_else() {
        let post = Capsule { ends: [[2.0, 0.0, -1.0], [2.0, 0.0, 1.0]], radius_m: 0.15 };
        assert_eq!(post.lets_through([4.0, 0.0, 0.3]), BEHIND);
        assert_eq!(post.lets_through([1.5, 0.0, 0.3]), 1.0);
        assert_eq!(post.lets_through([1.85, 0.0, 0.3]), 1.0);
        assert_eq!(post.lets_through([4.0, 0.5, 0.3]), 1.0);
        assert_eq!(post.lets_through([4.0, 0.0, 3.0]), 1.0);
        let edge = post.lets_through([4.0, 0.26, 0.0]);
        assert!(edge > BEHIND && edge < 1.0, "{edge}");
    }
}
