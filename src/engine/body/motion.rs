//! What a body does over time: walking, turning on the spot, sitting down, raising the arms, standing, falling.
//!
//! Every motion is a smooth function of time (no jump in speed), so that velocities are central differences of joints.

use super::figure::{rotation_x, rotation_y, rotation_z};
use super::{Anchor, BodyPose, Build, Gait, Posture};
use crate::geometry::{Mat3, Vec3, mat_mul, scale, sub, transpose};
use std::f64::consts::{PI, TAU};

/// Half step of the central difference that gives velocities, s; its error is below 1e−7 m/s for these motions.
const VELOCITY_STEP_S: f64 = 1e-5;
/// Height of the seat's angle: thighs level.
const SEATED_RAD: f64 = 0.5 * PI;

/// A motion and its own numbers. Phases are in cycles, rates in cycles a second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Walks along a path.
    Walk(Gait),
    /// Turns on the spot with small steps.
    Turn {
        /// rad/s, positive to the left.
        rate_radps: f64,
        /// Steps of one foot a second.
        step_hz: f64,
    },
    /// Sits down and stands up again.
    Sit {
        /// Both, a second.
        rate_hz: f64,
    },
    /// Raises arms and lowers them again.
    Raise {
        /// Times a second.
        rate_hz: f64,
        /// Highest angle of the (left, right) arm from hanging, rad.
        reach_rad: [f64; 2],
        /// Sideways instead of forward.
        sideways: bool,
    },
    /// Stands, breathes, sways.
    Stand,
    /// Stands, then falls to the floor and lies.
    Fall {
        /// Where the fall begins, s.
        begins_s: f64,
        /// How long it takes, s.
        lasts_s: f64,
        /// To which side, rad from the heading towards the left.
        towards_rad: f64,
    },
}

impl Motion {
    /// One word.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Walk(_) => "walk",
            Self::Turn { .. } => "turn",
            Self::Sit { .. } => "sit",
            Self::Raise { .. } => "raise",
            Self::Stand => "stand",
            Self::Fall { .. } => "fall",
        }
    }
}

/// Somebody who does something somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Performer {
    /// Height and build.
    pub build: Build,
    /// World z of the floor, m.
    pub floor_z_m: f64,
    /// Where the feet are (x, y), m; a walker has a path instead.
    pub place: [f64; 2],
    /// Heading at time 0, rad from x towards y; a walker has a path instead.
    pub heading_rad: f64,
    /// Phase at time 0 of what repeats, in cycles.
    pub phase: f64,
    /// What is done.
    pub motion: Motion,
}

impl Performer {
    /// Joints and segment frames at time `t`, s.
    pub fn pose(&self, t: f64) -> BodyPose {
        self.build.pose(&self.posture(t), self.floor_z_m)
    }

    /// Joint velocities at time `t`, m/s, COCO order.
    pub fn velocities(&self, t: f64) -> [Vec3; 17] {
        let (before, after) = (self.pose(t - VELOCITY_STEP_S).joints, self.pose(t + VELOCITY_STEP_S).joints);
        std::array::from_fn(|j| scale(sub(after[j], before[j]), 0.5 / VELOCITY_STEP_S))
    }

    fn posture(&self, t: f64) -> Posture {
        let standing = self.standing(t);
        match self.motion {
            Motion::Walk(gait) => gait.posture(t),
            Motion::Turn { rate_radps, step_hz } => self.turning(&standing, rate_radps * t, step_hz * t),
            Motion::Sit { rate_hz } => seated(&standing, self.there_and_back(rate_hz * t)),
            Motion::Raise { rate_hz, reach_rad, sideways } => {
                let share = self.there_and_back(rate_hz * t);
                let arm = |side: usize| raised(reach_rad[side] * share, [1.0, -1.0][side], sideways);
                Posture { arms: [arm(0), arm(1)], ..standing }
            }
            Motion::Stand => standing,
            Motion::Fall { begins_s, lasts_s, towards_rad } => {
                fallen(&standing, smooth((t - begins_s) / lasts_s), towards_rad)
            }
        }
    }

    /// From 0 to 1 and back once a cycle.
    fn there_and_back(&self, cycles: f64) -> f64 {
        0.5 - 0.5 * (TAU * (cycles + self.phase)).cos()
    }

    /// Upright with sway (some millimetres to centimetres at the head) and breath.
    fn standing(&self, t: f64) -> Posture {
        let wave = |hz: f64, offset: f64| (TAU * (hz * t + self.phase + offset)).sin();
        let lean = mat_mul(&rotation_y(0.02 + 0.012 * wave(0.31, 0.0)), &rotation_x(0.010 * wave(0.23, 0.4)));
        let arm = |side: f64| {
            let hang = mat_mul(&rotation_x(0.10 * side), &rotation_y(-0.05 - 0.01 * wave(0.4, 0.2 * side)));
            (hang, mat_mul(&hang, &rotation_y(-0.20)))
        };
        let leg = |side: f64| (rotation_x(0.05 * side), rotation_x(0.05 * side));
        Posture {
            trunk: lean,
            arms: [arm(1.0), arm(-1.0)],
            legs: [leg(1.0), leg(-1.0)],
            shift: [0.004 * wave(0.27, 0.7), 0.003 * wave(0.19, 0.1), 0.0],
            ..Posture::upright(self.heading_rad, Anchor::Feet(self.place))
        }
    }

    fn turning(&self, standing: &Posture, turned: f64, steps: f64) -> Posture {
        let leg = |side: f64| {
            let lift = 0.35 * (0.5 - 0.5 * (TAU * (steps + self.phase + 0.25 * side)).cos());
            let spread = rotation_x(0.05 * side);
            (mat_mul(&spread, &rotation_y(-lift)), mat_mul(&spread, &rotation_y(0.8 * lift)))
        };
        Posture {
            heading_rad: self.heading_rad + turned,
            legs: [leg(1.0), leg(-1.0)],
            anchor: Anchor::Pelvis(self.place),
            ..*standing
        }
    }
}

/// Thighs level and shanks upright at `share` = 1; the trunk leans forward on the way.
fn seated(standing: &Posture, share: f64) -> Posture {
    let hip = SEATED_RAD * share;
    let lean = 0.06 + 0.55 * (PI * share).sin();
    let leg = |side: f64| {
        let spread = rotation_x(0.08 * side);
        // The shank leans forward a little on the way, as the knees come forward.
        (mat_mul(&spread, &rotation_y(-hip)), mat_mul(&spread, &rotation_y(0.25 * (PI * share).sin())))
    };
    let arm = |side: f64| {
        let spread = rotation_x(0.10 * side);
        (mat_mul(&spread, &rotation_y(-0.5 * share)), mat_mul(&spread, &rotation_y(-0.2 - 1.0 * share)))
    };
    let trunk = mat_mul(&standing.trunk, &rotation_y(lean));
    Posture { trunk, legs: [leg(1.0), leg(-1.0)], arms: [arm(1.0), arm(-1.0)], ..*standing }
}

/// An arm `angle` from hanging; the elbow is a little bent.
fn raised(angle: f64, side: f64, sideways: bool) -> (Mat3, Mat3) {
    if sideways {
        let upper = rotation_x(side * (0.10 + angle));
        (upper, mat_mul(&upper, &rotation_x(0.15 * side)))
    } else {
        let upper = mat_mul(&rotation_x(0.10 * side), &rotation_y(-angle));
        (upper, mat_mul(&upper, &rotation_y(-0.20)))
    }
}

/// Lying at `share` = 1; the knees give way in between and the arms reach out.
fn fallen(standing: &Posture, share: f64, towards_rad: f64) -> Posture {
    let way = rotation_z(towards_rad);
    let tilt = mat_mul(&mat_mul(&way, &rotation_y(0.48 * PI * share)), &transpose(&way));
    let bend = 0.6 * (PI * share).sin();
    let leg = |side: f64| {
        let spread = rotation_x(0.05 * side);
        (mat_mul(&spread, &rotation_y(-0.5 * bend)), mat_mul(&spread, &rotation_y(bend)))
    };
    let reach = |side: f64| raised(0.9 * (PI * share).sin(), side, false);
    Posture { tilt, legs: [leg(1.0), leg(-1.0)], arms: [reach(1.0), reach(-1.0)], ..*standing }
}

/// 0 before 0, 1 after 1, a quintic in between: neither speed nor acceleration jumps.
fn smooth(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Segment;
    use crate::geometry::norm;

    fn all() -> Vec<Performer> {
        let motions = [
            Motion::Walk(Gait::default()),
            Motion::Turn { rate_radps: 1.4, step_hz: 0.8 },
            Motion::Sit { rate_hz: 0.2 },
            Motion::Raise { rate_hz: 0.4, reach_rad: [2.8, 1.2], sideways: false },
            Motion::Raise { rate_hz: 0.4, reach_rad: [1.6, 1.6], sideways: true },
            Motion::Stand,
            Motion::Fall { begins_s: 0.4, lasts_s: 1.2, towards_rad: 0.7 },
        ];
        let build = Build { height_m: 1.82, girth: 1.1 };
        motions
            .map(|motion| Performer { build, floor_z_m: -1.0, place: [3.0, 0.4], heading_rad: 2.5, phase: 0.3, motion })
            .to_vec()
    }

    #[test]
    fn bones_keep_their_lengths_and_frames_carry_the_joints() {
        for performer in all() {
            let skeleton = performer.build.skeleton();
            for step in 0..60 {
                let pose = performer.pose(f64::from(step) * 0.063);
                for (bone, length) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
                    let found = norm(sub(pose.joints[bone[0]], pose.joints[bone[1]]));
                    assert!((found - length).abs() < 1e-9, "{:?} {bone:?}", performer.motion);
                }
                for (segment, end) in [(1, 7), (2, 8), (3, 9), (4, 10), (5, 13), (6, 14), (7, 15), (8, 16)] {
                    let length = performer.build.segment_length_m(Segment::ALL[segment]);
                    assert!(norm(sub(pose.segments[segment].place([0.0, 0.0, -length]), pose.joints[end])) < 1e-12);
                }
            }
        }
    }

    #[test]
    fn nobody_sinks_into_the_floor_or_floats() {
        for performer in all() {
            for step in 0..40 {
                let joints = performer.pose(f64::from(step) * 0.1).joints;
                let lowest = joints.iter().map(|p| p[2] + 1.0).fold(f64::INFINITY, f64::min);
                assert!((0.02..0.20).contains(&lowest), "{:?}: {lowest} m", performer.motion);
            }
        }
    }

    #[test]
    fn somebody_who_fell_lies_and_somebody_seated_is_lower() {
        let performers = all();
        let height = |who: &Performer, t: f64| who.pose(t).joints[0][2] + 1.0;
        assert!(height(&performers[6], 0.2) > 1.5 && height(&performers[6], 2.0) < 0.5);
        let heads: Vec<f64> = (0..50).map(|i| height(&performers[2], f64::from(i) * 0.1)).collect();
        let (low, high) = heads.iter().fold((9.0f64, 0.0f64), |(l, h), &x| (l.min(x), h.max(x)));
        assert!(high - low > 0.35, "{low} {high}");
    }

    #[test]
    fn velocities_are_the_derivative_of_positions() {
        let dt = 1e-3;
        for performer in all() {
            for t in [0.2, 1.1, 1.7, 2.4] {
                let five = |j: usize, k: usize| {
                    let at = |s: f64| performer.pose(t + s * dt).joints[j][k];
                    (at(-2.0) - 8.0 * at(-1.0) + 8.0 * at(1.0) - at(2.0)) / (12.0 * dt)
                };
                for (j, v) in performer.velocities(t).iter().enumerate() {
                    for k in 0..3 {
                        assert!((v[k] - five(j, k)).abs() < 1e-4, "{t} {j} {k}: {} {}", v[k], five(j, k));
                        assert!(v[k].abs() < 6.0);
                    }
                }
            }
        }
    }
}
