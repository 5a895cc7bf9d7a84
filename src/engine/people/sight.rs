//! What one cell of a view tells about a place in the world: how far, and where across.
//!
//! Views differ in what their axes are (polar, Cartesian, cubes) and in how the radar is mounted. All of them come down to
//! a distance from the view's origin and one or two coordinates across. A coordinate across that lies flat in the world
//! tells *where in the room*, one that stands upright tells *how high*.

use crate::geometry::{Vec3, mat_t_vec, norm, sub};
use crate::radar::{Axis, AxisKind, View};

/// An axis whose direction in the world has more than this along z tells heights.
const UPRIGHT: f64 = 0.7;
/// Rounds in which a plan cell's place is moved to a height that another view tells.
const HEIGHT_ROUNDS: usize = 3;

/// A coordinate across the line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Across {
    /// The coordinate itself, m.
    Metres(f64),
    /// Its share of the distance is the sine of this angle (cone and elevation), rad.
    OfRange(f64),
    /// Its share of the distance on the floor is the sine of this angle (azimuth), rad.
    OfFloor(f64),
}

/// What a cell tells, in the view's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    /// Distance from the view's origin, m.
    pub(super) range_m: f64,
    y: Option<Across>,
    z: Option<Across>,
}

/// What a view can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Where in the room.
    Plan,
    /// How high.
    Height,
    /// Both.
    Whole,
}

/// A view that tells places.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sight {
    pub(super) view: View,
    pub(super) role: Role,
    /// Place of the axis that tells the distance, among the view's axes.
    pub(super) depth: usize,
    /// Place of an axis across.
    pub(super) across: usize,
}

impl Sight {
    /// `None` where the axes tell no place.
    pub(super) fn new(view: &View) -> Option<Self> {
        let depth = view.axes.iter().position(|axis| axis.kind.is_depth())?;
        let upright = |axis: &Axis| {
            let along = if is_z(axis.kind) { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
            mat_t_vec(&view.pose.rotation, along)[2].abs() > UPRIGHT
        };
        let across: Vec<(usize, bool)> = view
            .axes
            .iter()
            .enumerate()
            .filter(|(_, axis)| is_y(axis.kind) || is_z(axis.kind))
            .map(|(k, axis)| (k, upright(axis)))
            .collect();
        let flat = across.iter().find(|(_, upright)| !upright).map(|(k, _)| *k);
        let standing = across.iter().find(|(_, upright)| *upright).map(|(k, _)| *k);
        let (role, across) = match (flat, standing) {
            (Some(k), Some(_)) => (Role::Whole, k),
            (Some(k), None) => (Role::Plan, k),
            (None, Some(k)) => (Role::Height, k),
            (None, None) => return None,
        };
        Some(Self { view: view.clone(), role, depth, across })
    }

    /// What a cell tells.
    pub(super) fn reading(&self, bins: &[usize]) -> Reading {
        let (mut y, mut z) = (None, None);
        for (axis, &bin) in self.view.axes.iter().zip(bins) {
            let value = axis.value_at(bin as f64);
            match axis.kind {
                AxisKind::Y => y = Some(Across::Metres(value)),
                AxisKind::Cone => y = Some(Across::OfRange(value)),
                AxisKind::Azimuth => y = Some(Across::OfFloor(value)),
                AxisKind::Z => z = Some(Across::Metres(value)),
                AxisKind::Elevation => z = Some(Across::OfRange(value)),
                _ => {}
            }
        }
        let (kind, depth) = self.view.axes.iter().zip(bins).nth(self.depth).map_or((AxisKind::Range, 0.0), at);
        let (range_m, offset_m) = (range_m(kind, depth, y, z), self.view.psf.offset_m());
        if offset_m == 0.0 {
            return Reading { range_m, y, z };
        }
        // Metres across are nearer with the range; angles are what they are.
        let true_m = (range_m - offset_m).max(0.0);
        let nearer = |across: Across| match across {
            Across::Metres(x) => Across::Metres(x * true_m / range_m.max(1e-9)),
            angle => angle,
        };
        Reading { range_m: true_m, y: y.map(nearer), z: z.map(nearer) }
    }

    /// Metres from one bin to the next of the axis across, at a bin of the depth axis.
    pub(super) fn across_step_m(&self, depth_bin: usize) -> f64 {
        let (Some(axis), Some(depth)) = (self.view.axes.get(self.across), self.view.axes.get(self.depth)) else {
            return f64::INFINITY;
        };
        let step = axis.step().abs();
        if axis.kind.is_angular() { step * depth.value_at(depth_bin as f64).abs().max(0.3) } else { step }
    }

    /// Metres from one bin to the next of the depth axis.
    pub(super) fn depth_step_m(&self) -> f64 {
        self.view.axes.get(self.depth).map_or(f64::INFINITY, |axis| axis.step().abs())
    }

    /// The place of a reading, world frame, m; `z_m` is the height where another view tells it. What nothing tells is 0
    /// in the view's frame.
    pub(super) fn place(&self, reading: &Reading, z_m: Option<f64>) -> Vec3 {
        let mut p = self.view.pose.world_from_view(reading.point(0.0));
        let (Some(z_m), Role::Plan) = (z_m, self.role) else { return p };
        // The coordinate that the view does not tell, moved until the height is right.
        let mut free_m = 0.0;
        let unseen = if reading.y.is_none() { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let up = mat_t_vec(&self.view.pose.rotation, unseen)[2];
        for _ in 0..HEIGHT_ROUNDS {
            free_m += (z_m - p[2]) * up;
            p = self.view.pose.world_from_view(reading.point(free_m));
        }
        p
    }

    /// Where the view stands, world frame, m.
    pub(super) fn origin(&self) -> Vec3 {
        self.view.pose.world_from_view([0.0; 3])
    }
}

fn at((axis, &bin): (&Axis, &usize)) -> (AxisKind, f64) {
    (axis.kind, axis.value_at(bin as f64))
}

fn is_y(kind: AxisKind) -> bool {
    matches!(kind, AxisKind::Y | AxisKind::Cone | AxisKind::Azimuth)
}

fn is_z(kind: AxisKind) -> bool {
    matches!(kind, AxisKind::Z | AxisKind::Elevation)
}

/// The distance from the view's origin: a depth lacks what lies across its plane.
fn range_m(kind: AxisKind, depth: f64, y: Option<Across>, z: Option<Across>) -> f64 {
    let metres = |across: Option<Across>| match across {
        None => 0.0,
        Some(Across::Metres(m)) => m,
        Some(Across::OfRange(angle) | Across::OfFloor(angle)) => depth * angle.tan(),
    };
    let missing = match kind {
        AxisKind::DepthH => [metres(y), 0.0],
        AxisKind::DepthV => [metres(z), 0.0],
        AxisKind::X => [metres(y), metres(z)],
        _ => [0.0; 2],
    };
    depth.hypot(missing[0]).hypot(missing[1])
}

impl Reading {
    /// The point in the view's frame, m; `free_m` is the coordinate across that the view does not tell.
    fn point(&self, free_m: f64) -> Vec3 {
        let r = self.range_m;
        let z = match self.z {
            None => {
                if self.y.is_none() {
                    0.0
                } else {
                    free_m.clamp(-r, r)
                }
            }
            Some(Across::Metres(m)) => m.clamp(-r, r),
            Some(Across::OfRange(angle) | Across::OfFloor(angle)) => r * angle.sin(),
        };
        let floor = (r * r - z * z).max(0.0).sqrt();
        let y = match self.y {
            None => free_m.clamp(-floor, floor),
            Some(Across::Metres(m)) => m.clamp(-floor, floor),
            Some(Across::OfRange(angle)) => (r * angle.sin()).clamp(-floor, floor),
            Some(Across::OfFloor(angle)) => floor * angle.sin(),
        };
        [(floor * floor - y * y).max(0.0).sqrt(), y, z]
    }
}

/// Distance between the origins of two views, m.
pub(super) fn baseline_m(a: &Sight, b: &Sight) -> f64 {
    norm(sub(a.origin(), b.origin()))
}
