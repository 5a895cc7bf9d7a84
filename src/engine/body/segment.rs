//! The rigid parts of a body, and the body at one time.

use crate::geometry::{Mat3, Vec3, add, mat_vec};

/// The rigid parts of the body, in the order of [`BodyPose::segments`]. Limbs hang along −z of their frame from its origin.
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
