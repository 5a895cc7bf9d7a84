//! Forward kinematics: from the angles of the limbs to joints and segment frames.
//!
//! Segment ratios of Winter (*Biomechanics and Motor Control of Human Movement*): thigh 0.245 H, shank 0.246 H, ankle 0.039 H
//! above the floor, upper arm 0.186 H, forearm 0.146 H, shoulders 0.288 H above the hips. Trunk and head are one rigid segment,
//! because the bones of COCO's skeleton run from the shoulders to the hips and the ears; all 19 keep their lengths.
//!
//! The body rests on the floor with whatever is lowest: the feet of somebody who stands, the whole side of somebody who fell.

use super::skeletons::{COCO_BONES, COCO_JOINTS};
use super::{BodyPose, Segment, SegmentFrame, Skeleton};
use crate::geometry::{IDENTITY, Mat3, Vec3, add, mat_mul, mat_vec, norm, scale, sub};

/// Sharpness of the smooth maximum that puts the lowest point on the floor, 1/m.
const FLOOR_SHARPNESS: f64 = 60.0;
const NOSE: Vec3 = [0.100, 0.0, 0.660];
const LEFT_EYE: Vec3 = [0.078, 0.032, 0.700];
const LEFT_EAR: Vec3 = [0.000, 0.075, 0.680];
/// Joints that may touch the floor, and how far above it they then are, in body heights.
const SUPPORTS: [(usize, f64); 11] = [
    (15, 0.039),
    (16, 0.039),
    (13, 0.035),
    (14, 0.035),
    (11, 0.075),
    (12, 0.075),
    (5, 0.060),
    (6, 0.060),
    (9, 0.025),
    (10, 0.025),
    (0, 0.050),
];

/// Height and build of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Build {
    /// Body height H, m.
    pub height_m: f64,
    /// Widths of trunk and limbs relative to those of an average person of that height.
    pub girth: f64,
}

impl Default for Build {
    /// 1.70 m, average.
    fn default() -> Self {
        Self { height_m: 1.70, girth: 1.0 }
    }
}

/// What a posture keeps in place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Anchor {
    /// The pelvis is above this point of the floor (x, y), m.
    Pelvis([f64; 2]),
    /// The middle between the ankles is above it.
    Feet([f64; 2]),
}

/// Rotations of the segments, each from its own rest (trunk upright, limbs hanging down) to the body's frame: x the way that the
/// pelvis faces, y left, z up. Pairs are (left, right).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posture {
    /// Heading, rad from world x towards y.
    pub heading_rad: f64,
    /// The whole body about the pelvis: identity but for somebody who falls.
    pub tilt: Mat3,
    /// Trunk and head.
    pub trunk: Mat3,
    /// (thigh, shank).
    pub legs: [(Mat3, Mat3); 2],
    /// (upper arm, forearm).
    pub arms: [(Mat3, Mat3); 2],
    /// What is kept in place.
    pub anchor: Anchor,
    /// Moves all of the body, m, in the body's frame.
    pub shift: Vec3,
}

impl Posture {
    /// Upright, arms hanging, at `anchor`.
    pub fn upright(heading_rad: f64, anchor: Anchor) -> Self {
        let straight = (IDENTITY, IDENTITY);
        Self {
            heading_rad,
            tilt: IDENTITY,
            trunk: IDENTITY,
            legs: [straight; 2],
            arms: [straight; 2],
            anchor,
            shift: [0.0; 3],
        }
    }
}

impl Build {
    /// The body in a posture on a floor at world z = `floor_z_m`.
    pub fn pose(&self, posture: &Posture, floor_z_m: f64) -> BodyPose {
        let h = self.height_m;
        let turn = mat_mul(&rotation_z(posture.heading_rad), &posture.tilt);
        // Everything first about the middle of the hips with the world's axes, then moved to its place.
        let hip = |side: f64| mat_vec(&posture.trunk, [0.0, side * 0.0647 * h, 0.0]);
        let shoulder = |side: f64| mat_vec(&posture.trunk, [0.0, side * 0.106 * h, 0.288 * h]);
        let face = |p: Vec3| mat_vec(&posture.trunk, scale(p, h / 1.70));
        let mirrored = |p: Vec3| [p[0], -p[1], p[2]];
        let chain = |root: Vec3, (upper, lower): &(Mat3, Mat3), lengths: [f64; 2]| {
            let middle = add(root, mat_vec(upper, [0.0, 0.0, -lengths[0] * h]));
            [middle, add(middle, mat_vec(lower, [0.0, 0.0, -lengths[1] * h]))]
        };
        let legs = [0, 1].map(|i| chain(hip([1.0, -1.0][i]), &posture.legs[i], [0.245, 0.246]));
        let arms = [0, 1].map(|i| chain(shoulder([1.0, -1.0][i]), &posture.arms[i], [0.186, 0.146]));
        let mut joints = [
            face(NOSE),
            face(LEFT_EYE),
            face(mirrored(LEFT_EYE)),
            face(LEFT_EAR),
            face(mirrored(LEFT_EAR)),
            shoulder(1.0),
            shoulder(-1.0),
            arms[0][0],
            arms[1][0],
            arms[0][1],
            arms[1][1],
            hip(1.0),
            hip(-1.0),
            legs[0][0],
            legs[1][0],
            legs[0][1],
            legs[1][1],
        ]
        .map(|p| mat_vec(&turn, p));
        let pelvis = add(self.rest(&joints, posture.anchor, floor_z_m), mat_vec(&turn, posture.shift));
        joints = joints.map(|p| add(p, pelvis));
        let frame =
            |rotation: &Mat3, joint: usize| SegmentFrame { rotation: mat_mul(&turn, rotation), origin: joints[joint] };
        let segments = [
            SegmentFrame { rotation: mat_mul(&turn, &posture.trunk), origin: pelvis },
            frame(&posture.arms[0].0, 5),
            frame(&posture.arms[1].0, 6),
            frame(&posture.arms[0].1, 7),
            frame(&posture.arms[1].1, 8),
            frame(&posture.legs[0].0, 11),
            frame(&posture.legs[1].0, 12),
            frame(&posture.legs[0].1, 13),
            frame(&posture.legs[1].1, 14),
        ];
        BodyPose { joints, segments }
    }

    /// Where the pelvis is when joints about it stand at `anchor` on the floor.
    fn rest(&self, joints: &[Vec3; 17], anchor: Anchor, floor_z_m: f64) -> Vec3 {
        let needed = SUPPORTS.map(|(joint, above)| above * self.height_m - joints[joint][2]);
        let z = floor_z_m + smooth_maximum(&needed);
        match anchor {
            Anchor::Pelvis([x, y]) => [x, y, z],
            Anchor::Feet([x, y]) => {
                let feet = scale(add(joints[15], joints[16]), 0.5);
                [x - feet[0], y - feet[1], z]
            }
        }
    }

    /// The COCO skeleton with this body's own bone lengths, m.
    pub fn skeleton(&self) -> Skeleton {
        let joints = self.pose(&Posture::upright(0.0, Anchor::Pelvis([0.0; 2])), 0.0).joints;
        Skeleton {
            joints: COCO_JOINTS.map(str::to_owned).to_vec(),
            bones: COCO_BONES.map(|(a, b, _)| [a, b]).to_vec(),
            bone_lengths_m: COCO_BONES.map(|(a, b, _)| norm(sub(joints[a], joints[b]))).to_vec(),
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

/// ln(Σ eᵏˣ)/k
fn smooth_maximum(values: &[f64]) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + values.iter().map(|x| (FLOOR_SHARPNESS * (x - top)).exp()).sum::<f64>().ln() / FLOOR_SHARPNESS
}

pub(super) fn rotation_x(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]
}

/// Positive leans +z towards +x.
pub(super) fn rotation_y(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
}

pub(super) fn rotation_z(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
}
