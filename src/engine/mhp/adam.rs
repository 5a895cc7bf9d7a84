//! Adam with bias correction over the groups of PPPR; SPEC section 4. No renormalisation between steps.
#![expect(
    clippy::inline_always,
    reason = "in single precision it belongs into the function that is compiled for an instruction set"
)]

use super::Precision;
use super::articulation::{Articulation, is_turn};
use crate::body::{Group, Pppr, PpprShape};
use crate::config::{FitConfig, Parameterization};
use pulp::Arch;
use serde::{Deserialize, Serialize};

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;
/// What a second moment is taken for at least before it becomes single precision: nothing beside ε², and normal.
const FAINTEST: f64 = 1e-36;

/// The two moments, and how many steps they have seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Adam {
    /// Exponential mean of the gradient.
    pub first: Pppr,
    /// Exponential mean of its square.
    pub second: Pppr,
    /// The same two by the coordinates of root and bones, (persons · coordinates); empty while joints move by themselves.
    #[serde(default)]
    pub bones: [Vec<f64>; 2],
    /// Steps since the moments were zero.
    pub steps: u32,
}

/// One number's update.
#[derive(Clone, Copy)]
struct Step {
    unbias: [f64; 2],
}

impl Step {
    fn new(steps: u32) -> Self {
        Self { unbias: [BETA_1, BETA_2].map(|beta| 1.0 / (1.0 - beta.powf(f64::from(steps)))) }
    }

    /// What is to be added at unit rate; the moments move on.
    fn of(self, gradient: f64, first: &mut f64, second: &mut f64) -> f64 {
        let [first, second] = self.moments(gradient, first, second);
        -first / (second.sqrt() + EPSILON)
    }

    /// The same with the root and the quotient in single precision, relative error 1e-7: they are most of the work.
    #[inline(always)]
    fn quickly(self, gradient: f64, first: &mut f64, second: &mut f64) -> f64 {
        let [first, second] = self.moments(gradient, first, second);
        let root = (second.clamp(FAINTEST, f64::from(f32::MAX)) as f32).sqrt() + EPSILON as f32;
        -first * f64::from(1.0 / root)
    }

    /// Both moments without their bias.
    #[inline(always)]
    fn moments(self, gradient: f64, first: &mut f64, second: &mut f64) -> [f64; 2] {
        *first = BETA_1 * *first + (1.0 - BETA_1) * gradient;
        *second = BETA_2 * *second + (1.0 - BETA_2) * gradient * gradient;
        [*first * self.unbias[0], *second * self.unbias[1]]
    }
}

/// Some parameters or moments before a step and after it.
struct Change<'a> {
    before: &'a [f64],
    after: &'a mut [f64],
}

/// Moves parameters and their two moments, each by `of` of its gradient and moments.
#[inline(always)]
fn advance(
    [params, first, second]: [Change<'_>; 3],
    gradient: &[f64],
    rate: f64,
    of: impl Fn(f64, &mut f64, &mut f64) -> f64,
) {
    let before = params.before.iter().zip(first.before).zip(second.before);
    let after = params.after.iter_mut().zip(first.after).zip(second.after);
    for ((&g, ((&x, &m), &v)), ((next_x, next_m), next_v)) in gradient.iter().zip(before).zip(after) {
        (*next_m, *next_v) = (m, v);
        *next_x = x + rate * of(g, next_m, next_v);
    }
}

impl Adam {
    /// Zero moments.
    pub fn new(shape: PpprShape) -> Self {
        Self { first: Pppr::zeros(shape), second: Pppr::zeros(shape), bones: [const { Vec::new() }; 2], steps: 0 }
    }

    /// One update of `params` against `gradient` (same sizes), written over what is in `next`: moments and parameters.
    /// `turns` is overwritten.
    pub(super) fn update(
        &self,
        params: &Pppr,
        gradient: &Pppr,
        (config, precision): (&FitConfig, Precision),
        body: &Articulation,
        turns: &mut Vec<f64>,
        (next, moved): (&mut Self, &mut Pppr),
    ) {
        for numbers in [&mut next.first, &mut next.second, &mut *moved] {
            numbers.resize(params.shape());
        }
        for (bones, before) in next.bones.iter_mut().zip(&self.bones) {
            bones.clone_from(before);
        }
        next.steps = self.steps + 1;
        let step = Step::new(next.steps);
        let held = config.parameterization != Parameterization::Joints;
        let by_group = if held { &Group::ALL[1..] } else { &Group::ALL };
        for groups in by_group.chunk_by(|&a, &b| rate(config, a) == rate(config, b)) {
            let (&[from, ..], &[.., to]) = (groups, groups) else { continue };
            let changes = [
                Change { before: params.groups(from, to), after: moved.groups_mut(from, to) },
                Change { before: self.first.groups(from, to), after: next.first.groups_mut(from, to) },
                Change { before: self.second.groups(from, to), after: next.second.groups_mut(from, to) },
            ];
            let (gradient, rate) = (gradient.groups(from, to), rate(config, from));
            match precision {
                Precision::F64 => advance(changes, gradient, rate, |g, m, v| step.of(g, m, v)),
                Precision::F32 => {
                    Arch::new().dispatch(|| advance(changes, gradient, rate, |g, m, v| step.quickly(g, m, v)));
                }
            }
        }
        if held {
            // The first group, positions, follows root and bones, or a window's coordinates; its own moments stand still.
            for (after, before) in
                [(&mut *moved, params), (&mut next.first, &self.first), (&mut next.second, &self.second)]
            {
                after.group_mut(Group::Position).copy_from_slice(before.group(Group::Position));
            }
            if config.parameterization == Parameterization::Bones {
                body.pull_back(params, gradient, turns);
                next.turn(turns, config, body);
                body.advance(moved, turns);
            }
        }
    }

    /// From the gradient by the coordinates of root and bones to the step by them.
    fn turn(&mut self, turns: &mut [f64], config: &FitConfig, body: &Articulation) {
        let step = Step::new(self.steps);
        for moment in &mut self.bones {
            moment.resize(turns.len(), 0.0);
        }
        let [first, second] = &mut self.bones;
        let rates = [rate(config, Group::Position), config.learning_rates.bone.unwrap_or(config.learning_rate)];
        for (k, (x, (m, v))) in turns.iter_mut().zip(first.iter_mut().zip(second)).enumerate() {
            *x = rates[usize::from(is_turn(k % body.coordinates()))] * step.of(*x, m, v);
        }
    }
}

fn rate(config: &FitConfig, group: Group) -> f64 {
    let rates = &config.learning_rates;
    let own = match group {
        Group::Position => rates.position,
        Group::LogScale => rates.log_scale,
        Group::Rotation => rates.rotation,
        Group::Velocity => rates.velocity,
        Group::Beta => rates.beta,
        Group::Omega => rates.omega,
    };
    own.unwrap_or(config.learning_rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lone_joint() -> crate::body::Skeleton {
        crate::body::Skeleton { joints: vec!["pelvis".into()], bones: vec![], bone_lengths_m: vec![], angles: vec![] }
    }

    fn updated(
        adam: &Adam,
        params: &Pppr,
        gradient: &Pppr,
        how: (&FitConfig, Precision),
        body: &Articulation,
    ) -> (Adam, Pppr) {
        // Over what is of other sizes.
        let other = PpprShape { persons: 0, joints: 0, doppler_features: 0 };
        let mut next = (Adam::new(other), Pppr::zeros(other));
        adam.update(params, gradient, how, body, &mut Vec::new(), (&mut next.0, &mut next.1));
        next
    }

    /// Two steps by hand on one number: g = 2, then g = −1, rate 0.1.
    #[test]
    fn two_steps_by_hand() {
        let shape = PpprShape { persons: 1, joints: 1, doppler_features: 0 };
        let (mut adam, mut params, mut gradient) = (Adam::new(shape), Pppr::zeros(shape), Pppr::zeros(shape));
        let config = FitConfig { learning_rate: 0.1, ..FitConfig::default() };
        let body = Articulation::new(&lone_joint());
        gradient.group_mut(Group::Beta)[0] = 2.0;
        (adam, params) = updated(&adam, &params, &gradient, (&config, Precision::F64), &body);
        // m̂ = 2, v̂ = 4: a full step of the rate.
        assert!((params.group(Group::Beta)[0] + 0.1).abs() < 1e-9);
        gradient.group_mut(Group::Beta)[0] = -1.0;
        (_, params) = updated(&adam, &params, &gradient, (&config, Precision::F64), &body);
        let (m, v) = (0.9 * 0.2 - 0.1, 0.999 * 0.004 + 0.001);
        let want = -0.1 - 0.1 * (m / 0.19) / (f64::sqrt(v / (1.0 - 0.999 * 0.999)) + 1e-8);
        assert!((params.group(Group::Beta)[0] - want).abs() < 1e-9);
        assert_eq!(params.group(Group::Position), [0.0; 3]);
    }

    #[test]
    fn groups_have_their_own_rates_and_bones_leave_positions_to_the_root() {
        let shape = PpprShape { persons: 1, joints: 1, doppler_features: 0 };
        let (mut adam, mut params, mut gradient) = (Adam::new(shape), Pppr::zeros(shape), Pppr::zeros(shape));
        gradient.group_mut(Group::Beta)[0] = 1.0;
        gradient.group_mut(Group::Position)[1] = -1.0;
        let mut config = FitConfig { parameterization: Parameterization::Bones, ..FitConfig::default() };
        config.learning_rates.beta = Some(0.5);
        config.learning_rates.position = Some(0.25);
        (adam, params) =
            updated(&adam, &params, &gradient, (&config, Precision::F64), &Articulation::new(&lone_joint()));
        assert!((params.group(Group::Beta)[0] + 0.5).abs() < 1e-6);
        assert!((params.group(Group::Position)[1] - 0.25).abs() < 1e-6);
        assert_eq!(adam.first.group(Group::Position), [0.0; 3]);
    }

    #[test]
    fn single_precision_takes_the_same_steps() {
        let shape = PpprShape { persons: 1, joints: 1, doppler_features: 9 };
        let (mut config, body) = (FitConfig::default(), Articulation::new(&lone_joint()));
        config.learning_rates.omega = Some(0.5);
        let run = |precision| {
            let (mut adam, mut params, mut gradient) = (Adam::new(shape), Pppr::zeros(shape), Pppr::zeros(shape));
            for step in 0..50 {
                for group in Group::ALL {
                    for (k, g) in gradient.group_mut(group).iter_mut().enumerate() {
                        // From nothing to a thousand, and down to what single precision does not hold squared.
                        let size = [0.0, 1e3, 1.0, 1e-8, 1e-25][k % 5];
                        *g = size * f64::from((step * 7 + k as i32 * 3) % 11 - 5);
                    }
                }
                (adam, params) = updated(&adam, &params, &gradient, (&config, precision), &body);
            }
            params
        };
        let [want, got] = [Precision::F64, Precision::F32].map(run);
        for group in Group::ALL {
            for (want, got) in want.group(group).iter().zip(got.group(group)) {
                assert!((want - got).abs() <= 1e-6 * want.abs() + 1e-12, "{group:?}: {got} for {want}");
            }
        }
        assert_ne!(want.group(Group::Omega)[1], 0.0);
    }
}
