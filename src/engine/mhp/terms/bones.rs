//! L_bone and L_rigid, in one pass over the bones: both need each bone's length and direction, and what they want of a
//! joint is added to its slope once.

use super::penalties::{beyond, length, pseudo_huber};
use super::{Evaluate, Hue, Inputs, Scope, Term, Weight};
use crate::body::Pppr;
use crate::geometry::{Vec3, add_scaled, dot, scale, sub};

pub(super) const BONE: Term = Term {
    key: "bone",
    label: "L_bone",
    formula: "Σ ψ(l − ℓ)",
    unit: "m",
    help: "Length of each bone against its reference, beyond the tolerance.",
    weight: Weight::Kine,
    scope: Scope::Always,
    hue: Hue::Amber,
    evaluate: Evaluate::WithNext(evaluate),
};

pub(super) const RIGID: Term = Term {
    key: "rigid",
    label: "L_rigid",
    formula: "Σ ψ(Δv·u)",
    unit: "m/s",
    help: "Relative velocity of its two joints along each bone.",
    weight: Weight::Kine,
    scope: Scope::Always,
    hue: Hue::Violet,
    evaluate: Evaluate::WithPrevious,
};

fn evaluate(inputs: &Inputs<'_>, gains: [f64; 2], gradient: &mut Pppr) -> [f64; 2] {
    let Inputs { skeleton, config, params, .. } = inputs;
    let [position_bars, velocity_bars] = gradient.motion_mut();
    let mut joints =
        Joints { positions: params.positions(), velocities: params.velocities(), position_bars, velocity_bars };
    let (mut bone, mut rigid) = (0.0, 0.0);
    for person in 0..params.shape().persons {
        let first = person * params.shape().joints;
        for (&[m, n], &reference) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
            let [stretch, along] = joints.bone([first + m, first + n], reference, config.bone_tolerance_m, gains);
            bone += stretch;
            rigid += along;
        }
    }
    [bone, rigid]
}

struct Joints<'a> {
    positions: &'a [Vec3],
    velocities: &'a [Vec3],
    position_bars: &'a mut [Vec3],
    velocity_bars: &'a mut [Vec3],
}

impl Joints<'_> {
    fn bone(&mut self, [m, n]: [usize; 2], reference: f64, tolerance: f64, gains: [f64; 2]) -> [f64; 2] {
        let e = sub(self.positions[m], self.positions[n]);
        let l = length(e);
        let unit = scale(e, 1.0 / l);
        let (stretch, stretch_slope) = pseudo_huber(beyond(l - reference, tolerance));

        let dv = sub(self.velocities[m], self.velocities[n]);
        let along = dot(dv, unit);
        let (rigid, rigid_slope) = pseudo_huber(along);
        let [stretch_slope, rigid_slope] = [gains[0] * stretch_slope, gains[1] * rigid_slope];
        let by_l = rigid_slope / l;
        let mut e_bar = scale(unit, stretch_slope - by_l * along);
        add_scaled(&mut e_bar, dv, by_l);

        for (joint, sign) in [(m, 1.0), (n, -1.0)] {
            add_scaled(&mut self.position_bars[joint], e_bar, sign);
            add_scaled(&mut self.velocity_bars[joint], unit, sign * rigid_slope);
        }
        [stretch, rigid]
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::super::tests::two_joints;
    use super::*;
    use crate::body::Group;
    use crate::config::FitConfig;

    /// L_bone of a bone of 0.4 m that is `length_m` long, and its slope by the length.
    fn bone(length_m: f64, bone_tolerance_m: f64) -> (f64, f64) {
        let (skeleton, params) = two_joints(length_m);
        let mut gradient = Pppr::zeros(params.shape());
        let config = FitConfig { bone_tolerance_m, ..FitConfig::default() };
        let inputs = Inputs { skeleton: &skeleton, config: &config, params: &params, anchors: &[], given: &[] };
        let [bone, _] = evaluate(&inputs, [1.0; 2], &mut gradient);
        (bone, *gradient.joint(Group::Position, 1).first().unwrap())
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
