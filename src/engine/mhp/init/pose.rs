//! Postures that a start may have: standing, walking at several moments of a stride, arms raised, sitting.
//!
//! A fit moves limbs by centimetres, a stride moves them by half a metre: what limb is where has to be guessed before. Each
//! posture is the standing template with its limbs turned about hips, knees, shoulders and elbows, found by their names; a
//! skeleton without such names only stands. The angles are textbook ones: legs and arms swing as sines, half a stride apart.

use crate::body::{Side, Skeleton, is_named};
use crate::geometry::{Vec3, add, mat_vec, rotation_from_quaternion, scale, sub};
use crate::mhp::template::Template;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// How far hips and knees are bent on a chair, and at most: on the floor, knees up, rad.
const ON_A_CHAIR: f64 = FRAC_PI_2;
const ON_THE_FLOOR: f64 = 2.4;
/// Where the top of the head of somebody on a chair usually is and at the lowest, m, and how much less bent somebody is
/// whose head is seen higher, rad/m.
const USUAL_SEATED_M: f64 = 1.22;
const LOWEST_SEATED_M: f64 = 1.1;
const UNBENT_PER_M: f64 = 1.5;
/// How far the trunk leans and the shanks tilt forwards half way to a chair, rad: whoever sits down keeps its balance.
const MOST_LEAN: f64 = 0.6;
const MOST_TILT: f64 = 0.25;

/// How a body holds its limbs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Posture {
    Standing,
    /// Share of a stride since the left leg was farthest ahead.
    Walking(f64),
    /// Both arms raised sideways, or to the front.
    ArmsSideways,
    ArmsForward,
    /// Hips and knees bent by this much, rad: a right angle sits on a chair, more on the floor.
    Bent(f64),
}

/// Postures in the order in which they are tried; a person who walks is not tried sitting, nor one who stands walking.
pub(super) fn tried(starts: usize, walks: bool) -> Vec<Posture> {
    let others = if walks {
        (0..starts.saturating_sub(1)).map(|k| Posture::Walking(k as f64 / (starts - 1) as f64)).collect()
    } else {
        vec![Posture::ArmsForward, Posture::ArmsSideways, Posture::Bent(ON_A_CHAIR)]
    };
    std::iter::once(Posture::Standing).chain(others).take(starts.max(1)).collect()
}

/// Flexion of a limb forwards at its upper and its lower joint, and its spread sideways, rad.
struct Limb {
    upper: f64,
    lower: f64,
    spread: f64,
}

impl Posture {
    /// What somebody in this posture does.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Standing => "standing",
            Self::Walking(_) => "walking",
            Self::ArmsSideways => "standing with arms raised sideways",
            Self::ArmsForward => "standing with arms raised forwards",
            Self::Bent(_) => "sitting or crouching",
        }
    }

    fn leg(self, side: Side) -> Limb {
        match self {
            Self::Walking(stride) => {
                let phase = TAU * (stride + if side == Side::Left { 0.0 } else { 0.5 });
                // The knee bends while the leg swings forward.
                let swinging = (-phase.sin()).max(0.0);
                Limb { upper: 0.17 + 0.38 * phase.cos(), lower: -0.15 - 0.85 * swinging, spread: 0.0 }
            }
            Self::Bent(angle) => Limb { upper: angle, lower: -angle - MOST_TILT * half_way(angle), spread: 0.0 },
            _ => Limb { upper: 0.0, lower: 0.0, spread: 0.0 },
        }
    }

    /// How far the trunk leans forwards, rad.
    fn lean(self) -> f64 {
        match self {
            Self::Bent(angle) => MOST_LEAN * half_way(angle),
            _ => 0.0,
        }
    }

    fn arm(self, side: Side) -> Limb {
        match self {
            Self::Walking(stride) => {
                let phase = TAU * (stride + if side == Side::Left { 0.5 } else { 0.0 });
                Limb { upper: 0.1 + 0.35 * phase.cos(), lower: 0.4 + 0.15 * phase.cos(), spread: 0.0 }
            }
            Self::ArmsSideways => Limb { upper: 0.0, lower: 0.0, spread: 1.7 },
            Self::ArmsForward => Limb { upper: 1.6, lower: 0.1, spread: 0.0 },
            // The hands of somebody on a chair lie on the thighs.
            Self::Bent(angle) => {
                let seated = (angle / ON_A_CHAIR).min(1.0);
                Limb { upper: 0.5 * seated, lower: seated, spread: 0.0 }
            }
            Self::Standing => Limb { upper: 0.0, lower: 0.0, spread: 0.0 },
        }
    }
}

/// 1 half way to a chair, 0 before and on it.
fn half_way(angle: f64) -> f64 {
    (PI * (angle / ON_A_CHAIR).min(1.0)).sin()
}

/// How somebody is bent the top of whose head is seen `top_m` above the floor. On a chair that says little, for who sits may
/// be tall: least squares over simulated people. Whoever is lower than a chair is bent until the head comes down there.
pub(super) fn bent(template: &Template, skeleton: &Skeleton, top_m: f64) -> Posture {
    if top_m > LOWEST_SEATED_M {
        return Posture::Bent((ON_A_CHAIR - UNBENT_PER_M * (top_m - USUAL_SEATED_M)).clamp(0.0, ON_A_CHAIR));
    }
    let top_of = |angle: f64| posed(template, skeleton, Posture::Bent(angle)).top_m();
    let (mut high, mut low) = (ON_A_CHAIR, ON_THE_FLOOR);
    for _ in 0..12 {
        let angle = f64::midpoint(high, low);
        if top_of(angle) > top_m { high = angle } else { low = angle }
    }
    Posture::Bent(high)
}

/// The template in `posture`; feet on the height where the template's are.
pub(super) fn posed(template: &Template, skeleton: &Skeleton, posture: Posture) -> Template {
    let mut joints = template.joints.clone();
    let floor = lowest(&joints);
    lean(&mut joints, skeleton, posture.lean());
    for side in [Side::Left, Side::Right] {
        let named = |words: &[&str]| -> Vec<usize> {
            let own = |joint: &usize| skeleton.side(*joint) == side && is_named(skeleton, *joint, words);
            (0..skeleton.joints.len()).filter(own).collect()
        };
        let ends = (named(&["ankle", "heel", "foot", "toe"]), named(&["wrist", "hand"]));
        bend(&mut joints, &named(&["hip"]), &named(&["knee"]), &ends.0, &posture.leg(side), side);
        bend(&mut joints, &named(&["shoulder"]), &named(&["elbow"]), &ends.1, &posture.arm(side), side);
    }
    let sunk = floor - lowest(&joints);
    // Knees and shins shine as the trunk does: bent forwards they take the middle of what is lit with them.
    let bent = matches!(posture, Posture::Bent(_));
    let ahead = if bent { mean_ahead(&joints) - mean_ahead(&template.joints) } else { 0.0 };
    for joint in &mut joints {
        joint[0] -= ahead;
        joint[2] += sunk;
    }
    Template { joints, crown_m: template.crown_m }
}

/// Turns all above the hips forwards about their middle.
fn lean(joints: &mut [Vec3], skeleton: &Skeleton, angle: f64) {
    let hips: Vec<usize> = (0..joints.len()).filter(|&joint| is_named(skeleton, joint, &["hip"])).collect();
    if hips.is_empty() {
        return;
    }
    let sum = hips.iter().fold([0.0; 3], |sum, &hip| add(sum, joints[hip]));
    let pivot = scale(sum, 1.0 / hips.len() as f64);
    let lower = ["hip", "pelvis", "root", "knee", "ankle", "heel", "foot", "toe"];
    for joint in (0..joints.len()).filter(|&joint| !is_named(skeleton, joint, &lower)) {
        joints[joint] = turned(joints[joint], pivot, [0.0, 1.0, 0.0], angle);
    }
}

/// Turns the upper part of a limb and what hangs on it, then the lower part.
fn bend(joints: &mut [Vec3], top: &[usize], middle: &[usize], ends: &[usize], limb: &Limb, side: Side) {
    let (&[top], &[middle]) = (top, middle) else { return };
    // Forwards is a turn about −y of what hangs down; sideways one about x, away from the body.
    let outwards = if side == Side::Left { limb.spread } else { -limb.spread };
    let (pivot, knee) = (joints[top], std::iter::once(middle));
    for joint in knee.chain(ends.iter().copied()) {
        let flexed = turned(joints[joint], pivot, [0.0, -1.0, 0.0], limb.upper);
        joints[joint] = turned(flexed, pivot, [1.0, 0.0, 0.0], outwards);
    }
    let pivot = joints[middle];
    // The lower part's axis has turned with the upper part.
    let axis = sub(turned([0.0, -1.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0], outwards), [0.0; 3]);
    for &joint in ends {
        joints[joint] = turned(joints[joint], pivot, axis, limb.lower);
    }
}

fn turned(p: Vec3, pivot: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    let (sin, cos) = (0.5 * angle).sin_cos();
    let q = [cos, sin * axis[0], sin * axis[1], sin * axis[2]];
    add(pivot, mat_vec(&rotation_from_quaternion(q), sub(p, pivot)))
}

fn mean_ahead(joints: &[Vec3]) -> f64 {
    joints.iter().map(|j| j[0]).sum::<f64>() / joints.len().max(1) as f64
}

fn lowest(joints: &[Vec3]) -> f64 {
    joints.iter().map(|j| j[2]).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::geometry::norm;

    #[test]
    fn limbs_turn_the_right_way_and_keep_their_lengths() {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let template = Template::new(&skeleton);
        let walking = posed(&template, &skeleton, Posture::Walking(0.0));
        assert!(walking.joints[15][0] > walking.joints[16][0] + 0.3, "the left foot is ahead");
        assert!(walking.joints[10][0] > walking.joints[9][0] + 0.2, "and the right hand");
        let forward = posed(&template, &skeleton, Posture::ArmsForward);
        assert!(forward.joints[9][0] > 0.4 && forward.joints[10][0] > 0.4);
        let sideways = posed(&template, &skeleton, Posture::ArmsSideways);
        assert!(sideways.joints[9][1] > 0.5 && sideways.joints[10][1] < -0.5);
        let sitting = posed(&template, &skeleton, Posture::Bent(ON_A_CHAIR));
        assert!(sitting.joints[0][2] < template.joints[0][2] - 0.2, "a head is lower");
        for body in [&walking, &forward, &sideways, &sitting] {
            for &[m, n] in &skeleton.bones {
                let length = |t: &Template| norm(sub(t.joints[m], t.joints[n]));
                assert!((length(&template) - length(body)).abs() < 1e-9, "bone {m}-{n}");
            }
            assert!((lowest(&body.joints) - lowest(&template.joints)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_bent_body_leans_half_way_and_stays_where_it_was() {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let template = Template::new(&skeleton);
        let angle = |top_m: f64| {
            let Posture::Bent(angle) = bent(&template, &skeleton, top_m) else { return f64::NAN };
            angle
        };
        assert!((angle(1.15) - ON_A_CHAIR).abs() < 1e-12 && angle(1.4) < angle(1.3) && angle(2.4) == 0.0);
        let crouching = posed(&template, &skeleton, bent(&template, &skeleton, 1.05));
        assert!((crouching.top_m() - 1.05).abs() < 0.01, "{} m", crouching.top_m());
        let ahead = |body: &Template| body.joints[5][0] - body.joints[11][0];
        let [half, seated] = [0.5, 1.0].map(|share| posed(&template, &skeleton, Posture::Bent(share * ON_A_CHAIR)));
        assert!(ahead(&half) > ahead(&seated) + 0.2, "the shoulders are before the hips");
        for body in [&half, &seated, &crouching] {
            assert!((mean_ahead(&body.joints) - mean_ahead(&template.joints)).abs() < 1e-12);
            assert!(template.is_bent(&body.joints) && !template.is_bent(&template.joints));
        }
    }

    #[test]
    fn as_many_postures_are_tried_as_asked_for() {
        assert_eq!(tried(1, true), [Posture::Standing]);
        assert_eq!(tried(9, true).len(), 9);
        assert_eq!(tried(9, false).len(), 4);
        assert_eq!(tried(3, false), [Posture::Standing, Posture::ArmsForward, Posture::ArmsSideways]);
    }
}
