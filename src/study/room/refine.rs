//! The transform with which bodies explain the maps best.
//!
//! Every frame's person stands where its joints are, and is compared with the maps in two ways that count alike: a round Gaussian a
//! part of the body, a skin's depth before which its echo comes from, with their bright cells (the soft IoU of masks, SPEC section 4),
//! and the skin of the recommended fit with their levels (`ncc_db`, section 8). Levels tell a roll about boresight several times as well,
//! but how deep the trunk's skin lies before the legs' is a tilt to them; the bright cells hardly see that.
//! Two things that follow from how such maps are made ([`FrameDifference`]) are part of it:
//!
//! - What is left of an echo after the frame before is taken away, is 1 − e^{iφ} of it, φ = 4π d/λ, d its way towards the radar
//!   meanwhile. Of who stands and waves an arm the maps show that arm. A part that goes d has 1 − exp(−φ²/2) of its power, for its points
//!   do not all go as far; and a frame counts by how much of the body is left.
//! - Transmitters that send one after the other show who goes away at v by v T/λ of the distance aside, in both maps. Which way
//!   depends on which end sends first, and nobody publishes that: of the four cases that counts which explains the maps best.
//!
//! Of 200 simulated frames of people who walk, ten sequences of twenty (`simulate DIR --layout hiber --frames 200 --seed S`), seeds
//! 101 to 108, on which nothing was chosen: it turns 0.27° to 0.73° too far, the translation is 0.6 to 1.7 cm off, the radar's place in
//! the room 0.3 to 3.1 cm. Of seeds 1 to 10 and 41 to 45, on which both comparisons were chosen before the bright cells alone: 0.24° to
//! 0.85° (0.57° on average), 0.5 to 1.7 cm and 0.6 to 3.2 cm; by the bright cells alone 0.33° to 1.40° (0.64°). Of four people a set who
//! mostly act on one spot (seeds 21 to 30 with `--sequence-length 50 --action walk,walk,walk,turn,raise,sit`), 0.1° to 1.7°: who stays
//! on a spot tells the place of that spot and little of a tilt.
//!
//! The gradient by the joints' places gives that by a shift and a turn; BFGS goes down it. A frame counts the less the worse it is
//! explained (Tukey, by the median), so that a wrong one has no say.

use super::{RoomError, Seen};
use crate::body::{Group, Pppr, PpprShape, Skeleton, scatterer};
use crate::config::{BodyModel, EmLoss, EmRegion, FitConfig, Summation};
use crate::dataset::{Dataset, FrameDifference, RoomJoints, map_cells};
use crate::geometry::{
    Pose, Vec3, add, cross, dot, mat_mul, mat_vec, mean, norm, rotation_from_quaternion, scale, sub,
};
use crate::mhp::{Evaluation, Objective, Precision, Problem};
use crate::task::Progress;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Times that the regions of comparison and the weights are chosen anew.
const ROUNDS: u64 = 2;
/// Steps of a round at most.
const STEPS: usize = 30;
/// The first step, m and rad.
const FIRST_STEP: f64 = 0.02;
/// Longest step, m and rad.
const LONGEST_STEP: f64 = 0.15;
/// Shorter than this nothing more is gained, m and rad.
const SHORTEST_STEP: f64 = 2e-4;
/// From a joint to the skin before it that its echo comes from, on the average of a body's, m.
const SKIN_M: f64 = 0.06;
/// Half the width of the region of comparison, m.
const HALF_WIDTH_M: f64 = 1.2;
/// Nearer than this no joint is, m.
const NEAREST_M: f64 = 0.1;
/// Of the power of a part that does not move at all so much is left: people sway.
const LEFT_OF_STILL: f64 = 0.1;
/// Numbers of a rigid motion: a shift and a turn.
const N: usize = 6;

/// A transform and how well it explains the maps.
pub(super) struct Refined {
    pub(super) pose: Pose,
    /// What is made small: the mean of both comparisons over the frames that count.
    loss: f64,
    /// Mean soft IoU over the frames that count.
    pub(super) overlap: f64,
}

/// A way of comparing a frame's person with its maps.
struct Comparison {
    objective: Objective,
    params: Pppr,
    evaluation: Evaluation,
}

impl Comparison {
    fn new(problem: &Arc<Problem>, of: (EmLoss, BodyModel, f64), params: &Pppr) -> Result<Self, RoomError> {
        let (objective, body, surface_offset_m) = of;
        let config = FitConfig {
            em_region: EmRegion::HalfWidth(HALF_WIDTH_M),
            objective,
            body,
            summation: Summation::Incoherent,
            surface_offset_m,
            w_em: 1.0,
            w_kine: 0.0,
            w_prior: 0.0,
            w_time: 0.0,
            ..FitConfig::default()
        };
        Ok(Self {
            objective: Objective::new(Arc::clone(problem), config, Precision::F32, params)?,
            evaluation: Evaluation::zeros(params.shape()),
            params: params.clone(),
        })
    }

    fn evaluate(&mut self, joints: &[Vec3]) {
        for (joint, &at) in joints.iter().enumerate() {
            self.params.set_vec3(Group::Position, joint, at);
        }
        self.objective.evaluate_into(&self.params, &mut self.evaluation);
    }
}

/// A frame with its comparison.
struct FrameTerm<'a> {
    seen: &'a Seen,
    /// Where the maps show the body besides, radar frame, m.
    aside: Vec3,
    /// Bright cells, and levels.
    comparisons: [Comparison; 2],
    /// Share of the body's power that is left of it.
    left: f64,
    weight: f64,
}

/// Refines `pose` on the frames `seen`.
///
/// # Errors
/// Where a frame is no problem for a fit, or on cancel.
pub(super) fn refine(dataset: &Dataset, seen: &[&Seen], pose: Pose, progress: &Progress) -> Result<Refined, RoomError> {
    let made = dataset.room_joints().and_then(RoomJoints::frame_difference);
    let aside = made.map_or(0.0, |made| made.chirp_s / dataset.info().radar.wavelength_m());
    let both = |y: f64| [[y, aside], [y, -aside]];
    let cases = if aside > 0.0 { [both(aside), both(-aside)].concat() } else { vec![[0.0; 2]] };
    progress.begin("explaining the maps", ROUNDS * cases.len() as u64);
    let mut best = Refined { pose, loss: f64::INFINITY, overlap: 0.0 };
    for case in cases {
        let mut refined = Refined { pose, ..best };
        for _ in 0..ROUNDS {
            let mut terms = seen
                .par_iter()
                .filter_map(|seen| FrameTerm::new(dataset, seen, &refined.pose, made, case).transpose())
                .collect::<Result<Vec<_>, _>>()?;
            refined = descend(&mut terms, refined.pose, progress)?;
            progress.advance(1);
        }
        if refined.loss < best.loss {
            best = refined;
        }
    }
    Ok(best)
}

impl<'a> FrameTerm<'a> {
    /// `None` where the frame cannot be read any more. `case` is how far aside the maps show who is 1 m away and goes away at 1 m/s.
    fn new(
        dataset: &Dataset,
        seen: &'a Seen,
        pose: &Pose,
        made: Option<FrameDifference>,
        case: [f64; 2],
    ) -> Result<Option<Self>, RoomError> {
        let Some(Ok(maps)) = dataset.maps(seen.index..seen.index + 1).next() else { return Ok(None) };
        let info = dataset.info();
        let problem = Problem::new(info.radar.clone(), info.skeleton.clone(), info.views.clone(), &map_cells(&maps))?;
        let mut params = body(&info.skeleton, info.radar.doppler_features, &placed(seen, pose, [0.0; 3]));
        let (mut left, mut aside) = (1.0, [0.0; 3]);
        if let (Some(velocities), Some(made)) = (&seen.velocities, made) {
            let speeds = speeds_away(&params, pose, velocities);
            left = leave_what_moves(&mut params, &speeds, made.interval_s, info.radar.wavelength_m());
            let away = speeds.iter().sum::<f64>() / speeds.len().max(1) as f64;
            let distance = norm(pose.view_from_world(mean(&seen.joints)));
            aside = [0.0, case[0] * away * distance, case[1] * away * distance];
        }
        let problem = Arc::new(problem);
        let bright = Comparison::new(&problem, (EmLoss::Iou, BodyModel::Joints, SKIN_M), &params)?;
        let levels = Comparison::new(&problem, (EmLoss::NccDb, BodyModel::Skin, 0.0), &params)?;
        Ok(Some(Self { seen, aside, comparisons: [bright, levels], left, weight: 1.0 }))
    }

    /// The mean L_EM of both comparisons with the person at `pose`, and its gradient by a shift and a turn about `pivot`.
    fn evaluate(&mut self, pose: &Pose, pivot: Vec3) -> (f64, [f64; N]) {
        let joints = placed(self.seen, pose, self.aside);
        let share = 1.0 / self.comparisons.len() as f64;
        let (mut loss, mut gradient) = (0.0, [0.0; N]);
        for comparison in &mut self.comparisons {
            comparison.evaluate(&joints);
            loss += share * comparison.evaluation.loss;
            for (joint, &at) in joints.iter().enumerate() {
                let force = scale(comparison.evaluation.gradient.vec3(Group::Position, joint), share);
                let torque = cross(sub(at, pivot), force);
                for k in 0..3 {
                    gradient[k] += force[k];
                    gradient[3 + k] += torque[k];
                }
            }
        }
        (loss, gradient)
    }

    /// The soft IoU of the last evaluation.
    fn overlap(&self) -> f64 {
        let [bright, _] = &self.comparisons;
        1.0 - bright.evaluation.loss
    }
}

/// The joints in the radar's frame, as far aside as the maps show them.
fn placed(seen: &Seen, pose: &Pose, aside: Vec3) -> Vec<Vec3> {
    seen.joints.iter().map(|&joint| add(pose.view_from_world(joint), aside)).collect()
}

/// How fast each joint goes away from the radar, m/s.
fn speeds_away(params: &Pppr, pose: &Pose, velocities: &[Vec3]) -> Vec<f64> {
    let speed = |(joint, v): (usize, &Vec3)| {
        let at = params.vec3(Group::Position, joint);
        dot(mat_vec(&pose.rotation, *v), at) / norm(at).max(NEAREST_M)
    };
    velocities.iter().enumerate().map(speed).collect()
}

/// Takes from each joint what the subtraction of the frame before takes; the share of all joints' power that is left.
fn leave_what_moves(params: &mut Pppr, speeds: &[f64], interval_s: f64, wavelength_m: f64) -> f64 {
    let mut sum = 0.0;
    for (joint, speed) in speeds.iter().enumerate() {
        let phase = 2.0 * TAU * speed * interval_s / wavelength_m;
        let power = 1.0 - (1.0 - LEFT_OF_STILL) * (-0.5 * phase * phase).exp();
        sum += power;
        let beta = params.joint(Group::Beta, joint).first().copied().unwrap_or(0.0);
        let alpha = power.sqrt() / (1.0 + (-beta).exp());
        params.joint_mut(Group::Beta, joint).fill((alpha / (1.0 - alpha)).ln());
    }
    sum / speeds.len().max(1) as f64
}

/// A person with these joints whose parts look as a body's do.
fn body(skeleton: &Skeleton, doppler_features: usize, joints: &[Vec3]) -> Pppr {
    let mut params = Pppr::zeros(PpprShape { persons: 1, joints: joints.len(), doppler_features });
    for (joint, &at) in joints.iter().enumerate() {
        let look = skeleton.joints.get(joint).and_then(|name| scatterer(name));
        // Round, as large as the part: which way it lies differs from frame to frame.
        let round = |of: crate::body::Scatterer| (of.along_m.ln() + 2.0 * of.across_m.ln()) / 3.0;
        let (ln_scale, alpha) = look.map_or((0.08_f64.ln(), 0.5), |of| (round(of), of.alpha));
        params.set_vec3(Group::Position, joint, at);
        params.set_vec3(Group::LogScale, joint, [ln_scale; 3]);
        params.joint_mut(Group::Rotation, joint).copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        params.joint_mut(Group::Beta, joint).fill((alpha / (1.0 - alpha)).ln());
    }
    params
}

/// The weighted mean of the frames' losses and its gradient; the losses too.
fn evaluate(terms: &mut [FrameTerm<'_>], pose: &Pose, pivot: Vec3) -> (f64, [f64; N], Vec<f64>) {
    let each: Vec<(f64, [f64; N])> = terms.par_iter_mut().map(|term| term.evaluate(pose, pivot)).collect();
    let total: f64 = terms.iter().map(|term| term.weight).sum::<f64>().max(f64::MIN_POSITIVE);
    let (mut loss, mut gradient) = (0.0, [0.0; N]);
    for (term, (of_frame, by)) in terms.iter().zip(&each) {
        let share = term.weight / total;
        loss += share * of_frame;
        gradient.iter_mut().zip(by).for_each(|(sum, x)| *sum += share * x);
    }
    (loss, gradient, each.into_iter().map(|(loss, _)| loss).collect())
}

/// A pose after a shift and a turn about `pivot` in the radar's frame.
fn moved(pose: &Pose, pivot: Vec3, step: &[f64; N]) -> Pose {
    let [x, y, z, a, b, c] = *step;
    let angle = norm([a, b, c]);
    let sine = if angle > 0.0 { (0.5 * angle).sin() / angle } else { 0.5 };
    let turn = rotation_from_quaternion([(0.5 * angle).cos(), sine * a, sine * b, sine * c]);
    let translation = add(add(pivot, [x, y, z]), mat_vec(&turn, sub(pose.translation, pivot)));
    Pose { rotation: mat_mul(&turn, &pose.rotation), translation }
}

/// Goes down from `pose`, by BFGS.
fn descend(terms: &mut [FrameTerm<'_>], mut pose: Pose, progress: &Progress) -> Result<Refined, RoomError> {
    let places: Vec<Vec3> = terms.iter().map(|term| mean(&placed(term.seen, &pose, term.aside))).collect();
    let pivot = mean(&places);
    let (_, _, losses) = evaluate(terms, &pose, pivot);
    weigh(terms, &losses);
    let (mut loss, mut gradient, _) = evaluate(terms, &pose, pivot);
    let mut inverse: Option<[[f64; N]; N]> = None;
    for _ in 0..STEPS {
        progress.check()?;
        let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        if length.is_nan() || length < 1e-12 {
            break;
        }
        let mut step: [f64; N] = match &inverse {
            Some(inverse) => std::array::from_fn(|k| -product(&inverse[k], &gradient)),
            None => gradient.map(|g| -g * FIRST_STEP / length),
        };
        if product(&step, &gradient) >= 0.0 {
            step = gradient.map(|g| -g * FIRST_STEP / length);
            inverse = None;
        }
        let size = product(&step, &step).sqrt();
        let shrink = (LONGEST_STEP / size).min(1.0);
        step = step.map(|x| x * shrink);
        let mut accepted = None;
        while product(&step, &step).sqrt() > SHORTEST_STEP {
            let there = moved(&pose, pivot, &step);
            let (next, by, _) = evaluate(terms, &there, pivot);
            if next <= loss + 1e-4 * product(&step, &gradient) {
                accepted = Some((there, next, by));
                break;
            }
            step = step.map(|x| 0.4 * x);
        }
        let Some((there, next, by)) = accepted else { break };
        let change: [f64; N] = std::array::from_fn(|k| by[k] - gradient[k]);
        inverse = updated(inverse.as_ref(), &step, &change).or(inverse);
        (pose, loss, gradient) = (there, next, by);
    }
    let (loss, _, _) = evaluate(terms, &pose, pivot);
    let total: f64 = terms.iter().map(|term| term.weight).sum::<f64>().max(f64::MIN_POSITIVE);
    let overlap = terms.iter().map(|term| term.weight * term.overlap()).sum::<f64>() / total;
    Ok(Refined { pose, loss, overlap })
}

/// Tukey's weights about the median of the losses.
fn weigh(terms: &mut [FrameTerm<'_>], losses: &[f64]) {
    let middle = |mut numbers: Vec<f64>| {
        numbers.sort_by(f64::total_cmp);
        numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
    };
    let median = middle(losses.to_vec());
    let spread = middle(losses.iter().map(|loss| (loss - median).abs()).collect()).max(1e-3);
    for (term, loss) in terms.iter_mut().zip(losses) {
        // 4.685 standard deviations, each 1.4826 median deviations.
        let far = ((loss - median).max(0.0) / (4.685 * 1.4826 * spread)).min(1.0);
        term.weight = if loss.is_finite() { term.left * (1.0 - far * far).powi(2) } else { 0.0 };
    }
}

fn product(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The inverse of the Hessian after a step that changed the gradient by `change`; `None` where that tells nothing.
fn updated(inverse: Option<&[[f64; N]; N]>, step: &[f64; N], change: &[f64; N]) -> Option<[[f64; N]; N]> {
    let curvature = product(step, change);
    if curvature <= 1e-14 {
        return None;
    }
    let first = curvature / product(change, change);
    let h = inverse
        .copied()
        .unwrap_or_else(|| std::array::from_fn(|i| std::array::from_fn(|k| if i == k { first } else { 0.0 })));
    let hy: [f64; N] = std::array::from_fn(|i| product(&h[i], change));
    let share = 1.0 + product(change, &hy) / curvature;
    Some(std::array::from_fn(|i| {
        std::array::from_fn(|k| h[i][k] + (share * step[i] * step[k] - hy[i] * step[k] - step[i] * hy[k]) / curvature)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::IDENTITY;

    #[test]
    fn of_who_stands_and_moves_one_joint_that_joint_is_left() {
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 4, doppler_features: 1 });
        let wavelength_m = 0.0038;
        // At 0.1 m/s the echo turns by 16 rad in 0.05 s, at 1 mm/s by a sixth.
        let left = leave_what_moves(&mut params, &[0.0, 0.1, 0.001, -0.1], 0.05, wavelength_m);
        let alpha = |joint: usize| 1.0 / (1.0 + (-params.joint(Group::Beta, joint)[0]).exp());
        let phase = 4.0 * std::f64::consts::PI * 0.001 * 0.05 / wavelength_m;
        let slow = 1.0 - (1.0 - LEFT_OF_STILL) * (-0.5 * phase * phase).exp();
        let expected = [LEFT_OF_STILL, 1.0, slow, 1.0];
        for (joint, power) in expected.into_iter().enumerate() {
            assert!((alpha(joint) - 0.5 * power.sqrt()).abs() < 1e-12, "{joint}");
        }
        assert!((left - expected.iter().sum::<f64>() / 4.0).abs() < 1e-12);
    }

    #[test]
    fn speed_away_is_along_the_line_of_sight() {
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 2, doppler_features: 1 });
        params.set_vec3(Group::Position, 0, [3.0, 0.0, 0.0]);
        params.set_vec3(Group::Position, 1, [0.0, 2.0, 0.0]);
        let pose = Pose { rotation: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], translation: [0.0; 3] };
        let speeds = speeds_away(&params, &pose, &[[0.3, -0.7, 9.0]; 2]);
        assert!((speeds[0] + 0.7).abs() < 1e-12 && (speeds[1] - 0.3).abs() < 1e-12, "{speeds:?}");
    }

    #[test]
    fn a_turn_about_the_pivot_leaves_it_and_small_ones_follow_the_cross_product() {
        let pose = Pose { rotation: IDENTITY, translation: [1.0, 0.5, -0.2] };
        let pivot = [3.0, 0.0, 0.0];
        let there = moved(&pose, pivot, &[0.0, 0.0, 0.0, 0.0, 0.0, 1e-4]);
        let back = sub(pivot, pose.translation);
        assert!(norm(sub(there.view_from_world(back), pivot)) < 1e-12);
        let point = [2.0, 0.0, 0.3];
        let arm = sub(pose.view_from_world(point), pivot);
        let shift = sub(there.view_from_world(point), pose.view_from_world(point));
        assert!(norm(sub(shift, scale(cross([0.0, 0.0, 1.0], arm), 1e-4))) < 1e-7);
    }
}
