//! Parts of a body by name: what was learned of one skeleton holds for the others.

use super::super::pose::is_named;
use crate::body::{Side, Skeleton};
use crate::geometry::{Vec3, add, scale};

/// The head, and left and right of each of [`LIMBS`].
pub(super) const PARTS: usize = 1 + 2 * LIMBS.len();
const HEAD: usize = 0;
const LIMBS: [&str; 6] = ["shoulder", "elbow", "wrist", "hip", "knee", "ankle"];
const HEADS: [&str; 6] = ["nose", "eye", "ear", "head", "jaw", "top"];

/// The parts of a skeleton.
#[derive(Debug)]
pub(super) struct Parts {
    /// Joints whose mean is the part.
    joints: [Vec<usize>; PARTS],
    /// For each joint the parts with which it goes.
    goes_with: Vec<Vec<usize>>,
}

impl Parts {
    /// `None` where a part has no joint.
    pub(super) fn of(skeleton: &Skeleton) -> Option<Self> {
        let all = 0..skeleton.joints.len();
        let joints: [Vec<usize>; PARTS] =
            std::array::from_fn(|part| all.clone().filter(|&joint| own(skeleton, joint) == Some(part)).collect());
        let goes_with = all.map(|joint| goes_with(skeleton, joint)).collect();
        joints.iter().all(|joints| !joints.is_empty()).then_some(Self { joints, goes_with })
    }

    /// Where each part is.
    pub(super) fn places(&self, joints: &[Vec3]) -> [Vec3; PARTS] {
        std::array::from_fn(|part| mean(self.joints[part].iter().map(|&joint| joints[joint])))
    }

    /// What each joint takes of what the parts have.
    pub(super) fn of_joints(&self, by_part: &[Vec3; PARTS]) -> impl Iterator<Item = Vec3> {
        self.goes_with.iter().map(|parts| mean(parts.iter().map(|&part| by_part[part])))
    }

    /// The same part on the other side.
    #[cfg(any(test, feature = "train"))]
    pub(super) fn mirrored(part: usize) -> usize {
        if part == HEAD { HEAD } else { ((part - 1) ^ 1) + 1 }
    }
}

fn mean(points: impl Iterator<Item = Vec3>) -> Vec3 {
    let (count, sum) = points.fold((0, [0.0; 3]), |(count, sum), p| (count + 1, add(sum, p)));
    scale(sum, 1.0 / f64::from(count.max(1)))
}

fn limb(limb: usize, side: Side) -> Option<usize> {
    match side {
        Side::Left => Some(1 + 2 * limb),
        Side::Right => Some(2 + 2 * limb),
        Side::Middle => None,
    }
}

/// The part that a joint makes up.
fn own(skeleton: &Skeleton, joint: usize) -> Option<usize> {
    if is_named(skeleton, joint, &HEADS) {
        return Some(HEAD);
    }
    LIMBS.iter().position(|word| is_named(skeleton, joint, &[word])).and_then(|k| limb(k, skeleton.side(joint)))
}

fn goes_with(skeleton: &Skeleton, joint: usize) -> Vec<usize> {
    if let Some(part) = own(skeleton, joint) {
        return vec![part];
    }
    let named = |words: &[&str]| is_named(skeleton, joint, words);
    let both = |k: usize| vec![1 + 2 * k, 2 + 2 * k];
    let end = |k: usize| limb(k, skeleton.side(joint)).map_or_else(|| both(k), |part| vec![part]);
    if named(&["hand", "finger", "thumb"]) {
        end(2)
    } else if named(&["heel", "foot", "toe"]) {
        end(5)
    } else if named(&["pelvis", "root", "hip"]) {
        both(3)
    } else if named(&["neck", "collar", "clavicle", "thorax", "chest"]) {
        both(0)
    } else if named(&["spine", "torso", "belly"]) {
        [both(0), both(3)].concat()
    } else {
        (0..PARTS).collect()
    }
}
