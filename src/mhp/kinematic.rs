//! The kinematic terms and their gradients: bone lengths, rigid motion, joint angles, separation, collision; SPEC section 4.

use super::Terms;
use crate::body::{Pppr, Skeleton};
use crate::config::FitConfig;
use crate::geometry::{Vec3, add, add_scaled, cross, dot, mean, scale, sub};
use smallvec::SmallVec;

/// δ of the pseudo-Huber function ψ.
const HUBER_DELTA: f64 = 1e-3;
/// Under the root of a length: keeps its derivative finite.
const LENGTH_FLOOR_SQ: f64 = 1e-12;

/// ψ(x) = √(x² + δ²) − δ, written so that small x keeps its digits, and its derivative.
fn pseudo_huber(x: f64) -> (f64, f64) {
    let root = (x * x + HUBER_DELTA * HUBER_DELTA).sqrt();
    let beyond = root + HUBER_DELTA;
    let by_both = x / (root * beyond);
    (x * root * by_both, beyond * by_both)
}

/// How far `x` lies outside ± `tolerance`, with its sign.
fn beyond(x: f64, tolerance: f64) -> f64 {
    x - x.max(-tolerance).min(tolerance)
}

fn length(e: Vec3) -> f64 {
    (dot(e, e) + LENGTH_FLOOR_SQ).sqrt()
}

/// θ_max, rad.
struct Limit {
    theta: f64,
    sin: f64,
    cos: f64,
}

impl Limit {
    fn new(theta: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self { theta, sin, cos }
    }
}

/// What the terms read of the joints, and where they add their slopes.
struct Joints<'a> {
    positions: &'a [Vec3],
    velocities: &'a [Vec3],
    position_bars: &'a mut [Vec3],
    velocity_bars: &'a mut [Vec3],
    /// Of a person.
    count: usize,
}

/// Adds ∂(Σ of the kinematic terms)/∂Θ to `gradient` and returns the terms (with `em` = 0).
pub(super) fn evaluate(skeleton: &Skeleton, config: &FitConfig, params: &Pppr, gradient: &mut Pppr) -> Terms {
    let [position_bars, velocity_bars] = gradient.motion_mut();
    let mut joints = Joints {
        positions: params.positions(),
        velocities: params.velocities(),
        position_bars,
        velocity_bars,
        count: params.shape().joints,
    };
    let mut terms = Terms::default();
    let limit = Limit::new(config.theta_max_deg.to_radians());
    for person in 0..params.shape().persons {
        let first = person * joints.count;
        for (&[m, n], &reference) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
            let (bone, rigid) = joints.bone([first + m, first + n], reference, config.bone_tolerance_m);
            terms.bone += bone;
            terms.rigid += rigid;
        }
        for triplet in &skeleton.angles {
            terms.joint += joints.angle(triplet.map(|j| first + j), &limit);
        }
    }
    terms.sep = joints.separation(config.d_sep_m);
    terms.coll = joints.collision(config.d_joint_m);
    terms
}

impl Joints<'_> {
    /// L_bone and L_rigid of one bone.
    fn bone(&mut self, [m, n]: [usize; 2], reference: f64, tolerance: f64) -> (f64, f64) {
        let e = sub(self.positions[m], self.positions[n]);
        let l = length(e);
        let unit = scale(e, 1.0 / l);
        let (stretch, stretch_slope) = pseudo_huber(beyond(l - reference, tolerance));

        let dv = sub(self.velocities[m], self.velocities[n]);
        let along = dot(dv, unit);
        let (rigid, rigid_slope) = pseudo_huber(along);
        let by_l = rigid_slope / l;
        let mut e_bar = scale(unit, stretch_slope - by_l * along);
        add_scaled(&mut e_bar, dv, by_l);

        for (joint, sign) in [(m, 1.0), (n, -1.0)] {
            add_scaled(&mut self.position_bars[joint], e_bar, sign);
            add_scaled(&mut self.velocity_bars[joint], unit, sign * rigid_slope);
        }
        (stretch, rigid)
    }

    /// max(0, θ − θ_max)² at the vertex n of (m, n, o).
    fn angle(&mut self, [m, n, o]: [usize; 3], limit: &Limit) -> f64 {
        let a = sub(self.positions[m], self.positions[n]);
        let b = sub(self.positions[o], self.positions[n]);
        let c = cross(a, b);
        let (y, x) = (length(c), dot(a, b));
        // sin(θ − θ_max): most angles are far below, and need no arctangent.
        if y * limit.cos <= x * limit.sin {
            return 0.0;
        }
        let over = y.atan2(x) - limit.theta;
        if over <= 0.0 {
            return 0.0;
        }
        let by_theta = 2.0 * over / (x * x + y * y);
        let (y_bar, x_bar) = (by_theta * x, -by_theta * y);
        // dy = c·dc/y, c·(da × b) = da·(b × c), c·(a × db) = db·(c × a)
        let mut a_bar = scale(cross(b, c), y_bar / y);
        add_scaled(&mut a_bar, b, x_bar);
        let mut b_bar = scale(cross(c, a), y_bar / y);
        add_scaled(&mut b_bar, a, x_bar);
        add_scaled(&mut self.position_bars[m], a_bar, 1.0);
        add_scaled(&mut self.position_bars[o], b_bar, 1.0);
        add_scaled(&mut self.position_bars[n], add(a_bar, b_bar), -1.0);
        over * over
    }

    fn separation(&mut self, limit: f64) -> f64 {
        let centroids: SmallVec<[Vec3; 4]> = self.positions.chunks_exact(self.count.max(1)).map(mean).collect();
        let share = 1.0 / self.count as f64;
        let mut total = 0.0;
        for s in 0..centroids.len() {
            for t in 0..s {
                let Some((term, e_bar)) = repulsion(sub(centroids[s], centroids[t]), limit) else { continue };
                total += term;
                for j in 0..self.count {
                    add_scaled(&mut self.position_bars[s * self.count + j], e_bar, share);
                    add_scaled(&mut self.position_bars[t * self.count + j], e_bar, -share);
                }
            }
        }
        total
    }

    fn collision(&mut self, limit: f64) -> f64 {
        let mut total = 0.0;
        for m in self.count..self.positions.len() {
            let first_of_person = m - m % self.count;
            for n in 0..first_of_person {
                let Some((term, e_bar)) = repulsion(sub(self.positions[m], self.positions[n]), limit) else { continue };
                total += term;
                add_scaled(&mut self.position_bars[m], e_bar, 1.0);
                add_scaled(&mut self.position_bars[n], e_bar, -1.0);
            }
        }
        total
    }
}

/// max(0, limit − √(‖e‖² + …))² for both orders of a pair, and the gradient with respect to e.
fn repulsion(e: Vec3, limit: f64) -> Option<(f64, Vec3)> {
    let l = length(e);
    let gap = limit - l;
    (gap > 0.0).then(|| (2.0 * gap * gap, scale(e, -4.0 * gap / l)))
}

/// Square of the length of bone (m, n), m², without the floor: for the convergence criterion.
pub(super) fn bone_length_sq(params: &Pppr, [m, n]: [usize; 2]) -> f64 {
    let e = sub(params.position(m), params.position(n));
    dot(e, e)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::body::Group;
    use crate::mhp::convergence::tests::two_joints;

    /// L_bone of a bone of 0.4 m that is `length_m` long, and its slope by the length.
    fn bone(length_m: f64, bone_tolerance_m: f64) -> (f64, f64) {
        let (skeleton, params) = two_joints(length_m);
        let mut gradient = Pppr::zeros(params.shape());
        let config = FitConfig { bone_tolerance_m, ..FitConfig::default() };
        let terms = evaluate(&skeleton, &config, &params, &mut gradient);
        (terms.bone, *gradient.joint(Group::Position, 1).first().unwrap())
    }

    #[test]
    fn a_bone_within_its_tolerance_costs_nothing() {
        for length_m in [0.36, 0.4, 0.44] {
            assert_eq!(bone(length_m, 0.05), (0.0, 0.0), "{length_m}");
            assert!(length_m == 0.4 || bone(length_m, 0.0).0 > 0.03, "without one it does: {length_m}");
        }
        for length_m in [0.2, 0.345, 0.455, 0.9] {
            let (loss, slope) = bone(length_m, 0.05);
            assert!((loss - pseudo_huber((length_m - 0.4_f64).abs() - 0.05).0).abs() < 1e-9, "{length_m}");
            let difference = (bone(length_m + 1e-6, 0.05).0 - bone(length_m - 1e-6, 0.05).0) / 2e-6;
            assert!((slope - difference).abs() < 1e-5, "{length_m}: {slope}, not {difference}");
        }
    }
}
