//! A walking body with 17 COCO joints: forward kinematics of a textbook gait along a path that turns.
//!
//! **Body.** Segment ratios of Winter (*Biomechanics and Motor Control of Human Movement*): thigh 0.245 H, shank 0.246 H, ankle
//! 0.039 H above the floor, upper arm 0.186 H, forearm 0.146 H, shoulders 0.288 H above the hips. Trunk and head are one rigid
//! segment, because the bones of COCO's skeleton run from the shoulders to the hips and the ears; all 19 keep their lengths.
//!
//! **Gait.** Sagittal hip and knee angles are trigonometric interpolants of the normative curves at every tenth of a
//! stride, the left leg half a stride after the right; arms swing against the legs of their side. The pelvis rides on
//! the lower foot (a smooth maximum), sways over the standing leg and turns a little with each step.
//!
//! **Path.** Constant speed; the heading turns smoothly (quintic, so that acceleration has no jump) over one stretch of the
//! path, position is the integral of the heading.

use super::Skeleton;
use crate::geometry::{Mat3, Vec3, add, add_scaled, mat_mul, mat_vec, norm, scale, sub};
use std::f64::consts::{PI, TAU};

/// Hip flexion at every tenth of a stride from heel strike, degrees.
const HIP_DEG: [f64; 10] = [30.0, 25.0, 15.0, 4.0, -5.0, -11.0, -4.0, 14.0, 27.0, 32.0];
/// Knee flexion likewise, degrees.
const KNEE_DEG: [f64; 10] = [6.0, 17.0, 16.0, 9.0, 6.0, 10.0, 34.0, 59.0, 52.0, 22.0];
/// Sharpness of the smooth maximum that puts the lower foot on the floor, 1/m.
const FOOT_SHARPNESS: f64 = 60.0;
/// Half step of the central difference that gives velocities, s; its error is below 1e−7 m/s for this gait.
const VELOCITY_STEP_S: f64 = 1e-5;

const NOSE: Vec3 = [0.100, 0.0, 0.660];
const LEFT_EYE: Vec3 = [0.078, 0.032, 0.700];
const LEFT_EAR: Vec3 = [0.000, 0.075, 0.680];
const BONES: [[usize; 2]; 19] = [
    [15, 13],
    [13, 11],
    [16, 14],
    [14, 12],
    [11, 12],
    [5, 11],
    [6, 12],
    [5, 6],
    [5, 7],
    [6, 8],
    [7, 9],
    [8, 10],
    [1, 2],
    [0, 1],
    [0, 2],
    [1, 3],
    [2, 4],
    [3, 5],
    [4, 6],
];
const JOINTS: [&str; 17] = [
    "nose",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
];

/// The rigid parts of the body, in the order of [`Pose::segments`]. Limbs hang along −z of their frame from its origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it; left and right are the person's own")]
pub enum Segment {
    /// Trunk and head; origin between the hips.
    Trunk,
    LeftUpperArm,
    RightUpperArm,
    LeftForearm,
    RightForearm,
    LeftThigh,
    RightThigh,
    LeftShank,
    RightShank,
}

impl Segment {
    /// All segments.
    pub const ALL: [Self; 9] = [
        Self::Trunk,
        Self::LeftUpperArm,
        Self::RightUpperArm,
        Self::LeftForearm,
        Self::RightForearm,
        Self::LeftThigh,
        Self::RightThigh,
        Self::LeftShank,
        Self::RightShank,
    ];
}

/// A rigid motion of a segment: `p_world = rotation · p_segment + origin`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentFrame {
    /// World from segment.
    pub rotation: Mat3,
    /// m, world frame.
    pub origin: Vec3,
}

impl SegmentFrame {
    /// A point of the segment in the world, m.
    pub fn place(&self, point: Vec3) -> Vec3 {
        add(mat_vec(&self.rotation, point), self.origin)
    }
}

/// The body at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyPose {
    /// Joints in COCO order, m, world frame.
    pub joints: [Vec3; 17],
    /// Frames of the rigid segments, in the order of [`Segment::ALL`].
    pub segments: [SegmentFrame; 9],
}

/// Where the walker goes: straight, then a turn, then straight again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// Point on the floor below the pelvis at time 0 (x, y), m.
    pub start: [f64; 2],
    /// First heading, rad from x towards y.
    pub heading_rad: f64,
    /// Walking speed, m/s.
    pub speed_mps: f64,
    /// Distance walked before the turn begins, m.
    pub straight_m: f64,
    /// Distance walked while turning, m.
    pub turn_m: f64,
    /// Angle of the turn, rad, positive to the left.
    pub turn_rad: f64,
}

impl Path {
    /// Heading after `walked` metres, rad.
    fn heading(&self, walked: f64) -> f64 {
        let u = ((walked - self.straight_m) / self.turn_m).clamp(0.0, 1.0);
        self.heading_rad + self.turn_rad * u * u * u * (10.0 + u * (6.0 * u - 15.0))
    }

    /// Position after `walked` metres (x, y), m: three-point Gauss–Legendre on panels of 2 cm between the joins.
    fn position(&self, walked: f64) -> [f64; 2] {
        let mut at = self.start;
        let mut done = 0.0;
        for end in [self.straight_m, self.straight_m + self.turn_m, f64::INFINITY].map(|s| s.min(walked)) {
            let panels = ((end - done).abs() / 0.02).ceil();
            let half = (end - done) / panels.max(1.0) / 2.0;
            for panel in 0..panels as usize {
                let middle = done + half * (2 * panel + 1) as f64;
                for (node, weight) in [(-0.6f64.sqrt(), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6f64.sqrt(), 5.0 / 9.0)] {
                    let (sin, cos) = self.heading(middle + half * node).sin_cos();
                    at[0] += half * weight * cos;
                    at[1] += half * weight * sin;
                }
            }
            done = end;
        }
        at
    }
}

/// A person who walks. Times before 0 continue the first straight backwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walker {
    /// Body height H, m.
    pub height_m: f64,
    /// World z of the floor, m.
    pub floor_z_m: f64,
    /// Strides (two steps) a second.
    pub stride_hz: f64,
    /// Stride phase at time 0, in strides from the right heel strike.
    pub phase: f64,
    /// The way.
    pub path: Path,
}

impl Default for Walker {
    /// 1.70 m tall, radar 1.0 m above the floor: from 4 m almost straight towards the radar, a half turn
    /// to the left at 1.8 m, and back.
    fn default() -> Self {
        Self {
            height_m: 1.70,
            floor_z_m: -1.0,
            stride_hz: 0.92,
            phase: 0.15,
            path: Path {
                start: [4.0, 0.55],
                heading_rad: PI - 0.12,
                speed_mps: 1.25,
                straight_m: 1.7,
                turn_m: 1.3,
                turn_rad: PI,
            },
        }
    }
}

impl Walker {
    /// Joints and segment frames at time `t`, s.
    pub fn pose(&self, t: f64) -> BodyPose {
        let h = self.height_m;
        let (thigh, shank, upper_arm, forearm) = (0.245 * h, 0.246 * h, 0.186 * h, 0.146 * h);
        let walked = self.path.speed_mps * t;
        let turn = rotation_z(self.path.heading(walked));
        let stride = self.stride_hz * t + self.phase;
        let swing = TAU * stride;

        let trunk_in_body = mat_mul(&rotation_z(-0.07 * swing.cos()), &rotation_y(0.06));
        let leg = |side: f64| {
            let phase = if side > 0.0 { stride + 0.5 } else { stride };
            let (hip, knee) = (curve(&HIP_DEG, phase).to_radians(), curve(&KNEE_DEG, phase).to_radians());
            let spread = rotation_x(0.02 * side);
            (mat_mul(&spread, &rotation_y(-hip)), mat_mul(&spread, &rotation_y(knee - hip)))
        };
        let arm = |side: f64| {
            let phase = if side > 0.0 { swing } else { swing + PI };
            let shoulder = 0.10 + 0.38 * phase.cos();
            let elbow = 0.40 + 0.18 * phase.cos();
            let spread = rotation_x(0.12 * side);
            (mat_mul(&spread, &rotation_y(-shoulder)), mat_mul(&spread, &rotation_y(-shoulder - elbow)))
        };

        // Everything first in the body's frame (heading along x, origin between the hips), then placed in the world.
        let hip = |side: f64| mat_vec(&trunk_in_body, [0.0, side * 0.0647 * h, 0.0]);
        let chain = |root: Vec3, (upper, lower): (Mat3, Mat3), upper_m: f64, lower_m: f64| {
            let middle = add(root, mat_vec(&upper, [0.0, 0.0, -upper_m]));
            (middle, add(middle, mat_vec(&lower, [0.0, 0.0, -lower_m])))
        };
        let (legs, arms) = ([1.0, -1.0].map(leg), [1.0, -1.0].map(arm));
        let hips = [1.0, -1.0].map(hip);
        let shoulders = [1.0, -1.0].map(|side| mat_vec(&trunk_in_body, [0.0, side * 0.106 * h, 0.288 * h]));
        let [left_leg, right_leg] = [0, 1].map(|i| chain(hips[i], legs[i], thigh, shank));
        let [left_arm, right_arm] = [0, 1].map(|i| chain(shoulders[i], arms[i], upper_arm, forearm));

        let (ground, sway) = (smooth_max(-left_leg.1[2], -right_leg.1[2]), -0.018 * (swing - 0.6 * PI).cos());
        let [x, y] = self.path.position(walked);
        let mut pelvis = [x, y, self.floor_z_m + 0.039 * h + ground];
        add_scaled(&mut pelvis, mat_vec(&turn, [0.0, 1.0, 0.0]), sway);

        let place = |p: Vec3| add(mat_vec(&turn, p), pelvis);
        let face = |p: Vec3| place(mat_vec(&trunk_in_body, scale(p, h / 1.70)));
        let mirrored = |p: Vec3| [p[0], -p[1], p[2]];
        let joints = [
            face(NOSE),
            face(LEFT_EYE),
            face(mirrored(LEFT_EYE)),
            face(LEFT_EAR),
            face(mirrored(LEFT_EAR)),
            place(shoulders[0]),
            place(shoulders[1]),
            place(left_arm.0),
            place(right_arm.0),
            place(left_arm.1),
            place(right_arm.1),
            place(hips[0]),
            place(hips[1]),
            place(left_leg.0),
            place(right_leg.0),
            place(left_leg.1),
            place(right_leg.1),
        ];
        let frame =
            |rotation: &Mat3, joint: usize| SegmentFrame { rotation: mat_mul(&turn, rotation), origin: joints[joint] };
        let segments = [
            SegmentFrame { rotation: mat_mul(&turn, &trunk_in_body), origin: pelvis },
            frame(&arms[0].0, 5),
            frame(&arms[1].0, 6),
            frame(&arms[0].1, 7),
            frame(&arms[1].1, 8),
            frame(&legs[0].0, 11),
            frame(&legs[1].0, 12),
            frame(&legs[0].1, 13),
            frame(&legs[1].1, 14),
        ];
        BodyPose { joints, segments }
    }

    /// Joint velocities at time `t`, m/s, COCO order.
    pub fn velocities(&self, t: f64) -> [Vec3; 17] {
        let (before, after) = (self.pose(t - VELOCITY_STEP_S).joints, self.pose(t + VELOCITY_STEP_S).joints);
        std::array::from_fn(|j| scale(sub(after[j], before[j]), 0.5 / VELOCITY_STEP_S))
    }

    /// The COCO skeleton with this body's own bone lengths, m.
    pub fn skeleton(&self) -> Skeleton {
        let joints = self.pose(0.0).joints;
        Skeleton {
            joints: JOINTS.map(str::to_owned).to_vec(),
            bones: BONES.to_vec(),
            bone_lengths_m: BONES.map(|[a, b]| norm(sub(joints[a], joints[b]))).to_vec(),
            angles: vec![[5, 7, 9], [6, 8, 10], [11, 13, 15], [12, 14, 16]],
        }
    }

    /// Length of a segment along −z of its frame, m; for the trunk, from the hips up to the shoulders.
    pub fn segment_length_m(&self, segment: Segment) -> f64 {
        self.height_m
            * match segment {
                Segment::Trunk => 0.288,
                Segment::LeftUpperArm | Segment::RightUpperArm => 0.186,
                Segment::LeftForearm | Segment::RightForearm => 0.146,
                Segment::LeftThigh | Segment::RightThigh => 0.245,
                Segment::LeftShank | Segment::RightShank => 0.246,
            }
    }
}

/// ln(eᵏᵃ + eᵏᵇ)/k
fn smooth_max(a: f64, b: f64) -> f64 {
    a.max(b) + (-FOOT_SHARPNESS * (a - b).abs()).exp().ln_1p() / FOOT_SHARPNESS
}

/// Trigonometric interpolation of ten samples a period at `phase` periods (harmonics 0–4).
fn curve(samples: &[f64; 10], phase: f64) -> f64 {
    let kernel = |x: f64| 0.1 * (1.0 + 2.0 * (1..=4).map(|k| (TAU * f64::from(k) * x).cos()).sum::<f64>());
    samples.iter().enumerate().map(|(i, s)| s * kernel(phase - i as f64 / 10.0)).sum()
}

fn rotation_x(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]
}

/// Positive leans +z towards +x.
fn rotation_y(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
}

fn rotation_z(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_pass_through_their_samples() {
        for (i, &expected) in HIP_DEG.iter().enumerate() {
            let smoothed: f64 = (0..10).map(|k| HIP_DEG[k] * if (i + k) % 2 == 0 { 0.1 } else { -0.1 }).sum();
            assert!((curve(&HIP_DEG, i as f64 / 10.0) - (expected - smoothed)).abs() < 1e-9);
        }
    }

    #[test]
    fn the_path_is_the_integral_of_its_heading() {
        let path = Walker::default().path;
        for walked in [-0.5, 0.3, 1.7, 2.2, 3.0, 3.9] {
            let (a, b) = (path.position(walked - 1e-4), path.position(walked + 1e-4));
            let (sin, cos) = path.heading(walked).sin_cos();
            assert!(((b[0] - a[0]) / 2e-4 - cos).abs() < 1e-6, "{walked}");
            assert!(((b[1] - a[1]) / 2e-4 - sin).abs() < 1e-6, "{walked}");
        }
    }

    #[test]
    fn bones_keep_their_lengths_and_frames_carry_the_joints() {
        let walker = Walker::default();
        let skeleton = walker.skeleton();
        for step in 0..60 {
            let pose = walker.pose(f64::from(step) * 0.063);
            for (bone, length) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
                assert!((norm(sub(pose.joints[bone[0]], pose.joints[bone[1]])) - length).abs() < 1e-9, "{bone:?}");
            }
            for (segment, end) in [(1, 7), (2, 8), (3, 9), (4, 10), (5, 13), (6, 14), (7, 15), (8, 16)] {
                let length = walker.segment_length_m(Segment::ALL[segment]);
                assert!(norm(sub(pose.segments[segment].place([0.0, 0.0, -length]), pose.joints[end])) < 1e-12);
            }
        }
    }

    #[test]
    fn the_gait_stands_on_the_floor_and_hardly_slides() {
        let walker = Walker::default();
        let (mut slid, mut count) = (0.0, 0.0);
        for step in 0..120 {
            let t = f64::from(step) / 100.0;
            let (joints, velocities) = (walker.pose(t).joints, walker.velocities(t));
            let lower = if joints[15][2] < joints[16][2] { 15 } else { 16 };
            let above = joints[lower][2] - walker.floor_z_m;
            assert!((0.05..0.08).contains(&above), "ankle {above} m above the floor at {t} s");
            slid += norm(velocities[lower]);
            count += 1.0;
        }
        assert!(slid / count < 0.4, "the standing ankle moves at {} m/s", slid / count);
    }

    #[test]
    fn velocities_are_the_derivative_of_positions() {
        let walker = Walker::default();
        let dt = 1e-3;
        for t in [0.2, 1.1, 1.7, 2.4] {
            let five = |j: usize, k: usize| {
                let at = |s: f64| walker.pose(t + s * dt).joints[j][k];
                (at(-2.0) - 8.0 * at(-1.0) + 8.0 * at(1.0) - at(2.0)) / (12.0 * dt)
            };
            for (j, v) in walker.velocities(t).iter().enumerate() {
                for k in 0..3 {
                    assert!((v[k] - five(j, k)).abs() < 1e-5, "{t} {j} {k}: {} {}", v[k], five(j, k));
                }
            }
        }
    }
}
