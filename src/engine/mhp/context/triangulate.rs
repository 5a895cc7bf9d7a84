//! The point in space that the echoes of several views agree on.

use crate::geometry::{Vec3, add_scaled, dot, mat_t_vec, scale};
use crate::mhp::triad::SphericalTriad;
use crate::radar::{AxisKind, View};
use smallvec::SmallVec;

/// A step this short ends the search for the point that peaks agree on, m.
const CONVERGED_M: f64 = 1e-4;
/// Where the search begins when nothing is known of the point: before the radar, m.
const BEFORE_RADAR: Vec3 = [2.0, 0.0, 0.0];

/// Where an echo lies in a view, in fractions of bins.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::mhp) struct Mark {
    pub view: usize,
    /// A bin a spatial axis, in the order of the view's axes without Doppler.
    pub bin: SmallVec<[f64; 3]>,
}

/// The world point that best agrees with all `marks` at once, and the root mean square disagreement, m. What no axis
/// tells stays at the radar's boresight.
pub(in crate::mhp) fn triangulate(views: &[View], marks: &[&Mark]) -> (Vec3, f64) {
    triangulate_from(BEFORE_RADAR, f64::INFINITY, views, marks)
}

/// As [`triangulate`], looking first at `p`: what no axis tells stays there. Where it is clear that the disagreement will stay
/// above `tolerated_m`, any point with such a disagreement is the answer.
pub(in crate::mhp) fn triangulate_from(mut p: Vec3, tolerated_m: f64, views: &[View], marks: &[&Mark]) -> (Vec3, f64) {
    let mut misfit = f64::INFINITY;
    for _ in 0..25 {
        let (mut normal, mut pull) = ([[0.0; 3]; 3], [0.0; 3]);
        let (mut squares, mut count) = (0.0, 0.0);
        for mark in marks {
            equations(&views[mark.view], mark, p, |direction, gap_m| {
                for i in 0..3 {
                    add_scaled(&mut normal[i], direction, direction[i]);
                }
                add_scaled(&mut pull, direction, gap_m);
                squares += gap_m * gap_m;
                count += 1.0;
            });
        }
        misfit = (squares / f64::max(count, 1.0)).sqrt();
        for (i, row) in normal.iter_mut().enumerate() {
            row[i] += 1e-3;
        }
        let step = solve(&normal, pull);
        // A long step would jump to the other side of the radar.
        let length = dot(step, step).sqrt();
        add_scaled(&mut p, step, if length > 1.0 { 1.0 / length } else { 1.0 });
        // No coordinate changes faster than the point moves, and steps more than halve.
        if length < CONVERGED_M || misfit - 2.0 * length > tolerated_m {
            break;
        }
    }
    (p, misfit)
}

/// Tells for each spatial axis of the mark's view the unit direction in which the coordinate grows (world) and the gap
/// between the mark's coordinate and that of `p`, m.
fn equations(view: &View, mark: &Mark, p: Vec3, mut tell: impl FnMut(Vec3, f64)) {
    let triad = SphericalTriad::new(view.seen_at(p));
    let spatial = view.axes.iter().filter(|axis| axis.kind != AxisKind::Doppler);
    for (axis, &bin) in spatial.zip(&mark.bin) {
        let (direction, arm) = triad.direction_and_arm(axis.kind);
        let gap = (axis.at(bin) - triad.coordinate(axis, 0.0)) * arm / triad.slope(axis);
        tell(mat_t_vec(&view.pose.rotation, direction), gap);
    }
}

/// Solves the 3×3 system by Cramer's rule; the matrix is positive definite.
fn solve(m: &[Vec3; 3], b: Vec3) -> Vec3 {
    use crate::geometry::cross;
    let (c12, c20, c01) = (cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    let mut x = scale(c12, b[0]);
    add_scaled(&mut x, c20, b[1]);
    add_scaled(&mut x, c01, b[2]);
    scale(x, 1.0 / dot(m[0], c12))
}
