//! The kinematic terms and their gradients: bone lengths, rigid motion, joint angles, separation, collision; SPEC section 4.

use super::Terms;
use crate::body::{Group, Pppr, Skeleton};
use crate::config::FitConfig;
use crate::geometry::{Vec3, add, add_scaled, cross, dot, norm, scale, sub};

/// δ of the pseudo-Huber function ψ.
const HUBER_DELTA: f64 = 1e-3;
/// Under the root of a length: keeps its derivative finite.
const LENGTH_FLOOR_SQ: f64 = 1e-12;

/// ψ(x) = √(x² + δ²) − δ, written so that small x keeps its digits, and its derivative.
fn pseudo_huber(x: f64) -> (f64, f64) {
    let root = (x * x + HUBER_DELTA * HUBER_DELTA).sqrt();
    (x * x / (root + HUBER_DELTA), x / root)
}

fn length(e: Vec3) -> f64 {
    (dot(e, e) + LENGTH_FLOOR_SQ).sqrt()
}

fn add_to(gradient: &mut Pppr, group: Group, joint: usize, term: Vec3, k: f64) {
    let mut sum = gradient.vec3(group, joint);
    add_scaled(&mut sum, term, k);
    gradient.set_vec3(group, joint, sum);
}

/// Adds ∂(Σ of the kinematic terms)/∂Θ to `gradient` and returns the terms (with `em` = 0).
pub(super) fn evaluate(skeleton: &Skeleton, config: &FitConfig, params: &Pppr, gradient: &mut Pppr) -> Terms {
    let mut terms = Terms::default();
    for person in 0..params.shape().persons {
        let first = person * params.shape().joints;
        for (&[m, n], &reference) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
            let (bone, rigid) = bone(params, [first + m, first + n], reference, gradient);
            terms.bone += bone;
            terms.rigid += rigid;
        }
        for triplet in &skeleton.angles {
            terms.joint += angle(params, triplet.map(|j| first + j), config.theta_max_deg.to_radians(), gradient);
        }
    }
    terms.sep = separation(params, config.d_sep_m, gradient);
    terms.coll = collision(params, config.d_joint_m, gradient);
    terms
}

/// L_bone and L_rigid of one bone.
fn bone(params: &Pppr, [m, n]: [usize; 2], reference: f64, gradient: &mut Pppr) -> (f64, f64) {
    let e = sub(params.position(m), params.position(n));
    let l = length(e);
    let (stretch, stretch_slope) = pseudo_huber(l - reference);

    let dv = sub(params.velocity(m), params.velocity(n));
    let (rigid, rigid_slope) = pseudo_huber(dot(dv, e) / l);
    let mut e_bar = scale(e, stretch_slope / l - rigid_slope * dot(dv, e) / (l * l * l));
    add_scaled(&mut e_bar, dv, rigid_slope / l);

    for (joint, sign) in [(m, 1.0), (n, -1.0)] {
        add_to(gradient, Group::Position, joint, e_bar, sign);
        add_to(gradient, Group::Velocity, joint, e, sign * rigid_slope / l);
    }
    (stretch, rigid)
}

/// max(0, θ − θ_max)² at the vertex n of (m, n, o).
fn angle(params: &Pppr, [m, n, o]: [usize; 3], theta_max: f64, gradient: &mut Pppr) -> f64 {
    let a = sub(params.position(m), params.position(n));
    let b = sub(params.position(o), params.position(n));
    let c = cross(a, b);
    let (y, x) = (length(c), dot(a, b));
    let over = y.atan2(x) - theta_max;
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
    add_to(gradient, Group::Position, m, a_bar, 1.0);
    add_to(gradient, Group::Position, o, b_bar, 1.0);
    add_to(gradient, Group::Position, n, add(a_bar, b_bar), -1.0);
    over * over
}

/// max(0, limit − √(‖e‖² + …))² for both orders of a pair, and the gradient with respect to e.
fn repulsion(e: Vec3, limit: f64) -> Option<(f64, Vec3)> {
    let l = length(e);
    let gap = limit - l;
    (gap > 0.0).then(|| (2.0 * gap * gap, scale(e, -4.0 * gap / l)))
}

fn separation(params: &Pppr, limit: f64, gradient: &mut Pppr) -> f64 {
    let (persons, joints) = (params.shape().persons, params.shape().joints);
    let centroid = |person: usize| {
        let sum = (0..joints).fold([0.0; 3], |sum, j| add(sum, params.position(person * joints + j)));
        scale(sum, 1.0 / joints as f64)
    };
    let mut total = 0.0;
    for s in 0..persons {
        for t in 0..s {
            let Some((term, e_bar)) = repulsion(sub(centroid(s), centroid(t)), limit) else { continue };
            total += term;
            for j in 0..joints {
                add_to(gradient, Group::Position, s * joints + j, e_bar, 1.0 / joints as f64);
                add_to(gradient, Group::Position, t * joints + j, e_bar, -1.0 / joints as f64);
            }
        }
    }
    total
}

fn collision(params: &Pppr, limit: f64, gradient: &mut Pppr) -> f64 {
    let (total_joints, joints) = (params.shape().total_joints(), params.shape().joints);
    let mut total = 0.0;
    for m in 0..total_joints {
        let first_of_person = m - m % joints;
        for n in 0..first_of_person {
            let Some((term, e_bar)) = repulsion(sub(params.position(m), params.position(n)), limit) else { continue };
            total += term;
            add_to(gradient, Group::Position, m, e_bar, 1.0);
            add_to(gradient, Group::Position, n, e_bar, -1.0);
        }
    }
    total
}

/// Length of bone (m, n), m, without the floor: for the convergence criterion.
pub(super) fn bone_length(params: &Pppr, [m, n]: [usize; 2]) -> f64 {
    norm(sub(params.position(m), params.position(n)))
}
