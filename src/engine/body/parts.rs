//! Parts of a body by name: what was learned of one skeleton holds for the others.

use super::{Side, Skeleton};
use crate::geometry::{Vec3, add, scale};

/// How many parts there are: the head, and left and right of shoulder, elbow, wrist, hip, knee and ankle.
pub const PARTS: usize = 1 + 2 * LIMBS.len();
/// The place of the head among the parts.
pub const HEAD: usize = 0;
const LIMBS: [&str; 6] = ["shoulder", "elbow", "wrist", "hip", "knee", "ankle"];
const HEADS: [&str; 6] = ["nose", "eye", "ear", "head", "jaw", "top"];

/// The parts of a skeleton.
#[derive(Debug, Clone)]
pub struct Parts {
    /// Joints whose mean is the part.
    joints: [Vec<usize>; PARTS],
    /// For each joint the parts with which it goes.
    goes_with: Vec<Vec<usize>>,
}

impl Parts {
    /// `None` where a part has no joint.
    pub fn of(skeleton: &Skeleton) -> Option<Self> {
        let all = 0..skeleton.joints.len();
        let joints: [Vec<usize>; PARTS] =
            std::array::from_fn(|part| all.clone().filter(|&joint| own(skeleton, joint) == Some(part)).collect());
        let goes_with = all.map(|joint| goes_with(skeleton, joint)).collect();
        joints.iter().all(|joints| !joints.is_empty()).then_some(Self { joints, goes_with })
    }

    /// Where each part is.
    pub fn places(&self, joints: &[Vec3]) -> [Vec3; PARTS] {
        std::array::from_fn(|part| mean(self.joints[part].iter().map(|&joint| joints[joint])))
    }

    /// What each joint takes of what the parts have.
    pub fn of_joints(&self, by_part: &[Vec3; PARTS]) -> impl Iterator<Item = Vec3> {
        self.goes_with.iter().map(|parts| mean(parts.iter().map(|&part| by_part[part])))
    }

    /// Joints whose mean is a part.
    pub fn joints_of(&self, part: usize) -> &[usize] {
        &self.joints[part]
    }

    /// The same part on the other side.
    pub fn mirrored(part: usize) -> usize {
        if part == HEAD { HEAD } else { ((part - 1) ^ 1) + 1 }
    }
}

/// Whether one of `words` is in the joint's name.
pub fn is_named(skeleton: &Skeleton, joint: usize, words: &[&str]) -> bool {
    skeleton.joints[joint].to_lowercase().split(['_', ' ', '-']).any(|word| words.contains(&word))
}

/// What a part of the body looks like to a radar: standard deviations along and across its bones, m, and its opacity α.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatterer {
    /// Along its bones, m.
    pub along_m: f64,
    /// Across them, m.
    pub across_m: f64,
    /// α
    pub alpha: f64,
}

/// Skin area and width of the parts that meet at a joint of this name, after the segment tables of Winter: trunk 0.5 m long and
/// 0.3 m wide, thigh 0.15 m, shank 0.11 m, arm 0.09 m, head 0.16 m. What shares a part shares its brightness.
pub fn scatterer(name: &str) -> Option<Scatterer> {
    name.to_lowercase().split(['_', ' ', '-']).rev().find_map(of_word)
}

fn of_word(word: &str) -> Option<Scatterer> {
    let part = |along_m, across_m, alpha| Some(Scatterer { along_m, across_m, alpha });
    match word {
        "nose" | "eye" | "ear" | "jaw" => part(0.06, 0.06, 0.08),
        "head" | "top" => part(0.08, 0.07, 0.3),
        "neck" | "collar" | "clavicle" => part(0.08, 0.08, 0.3),
        "thorax" | "chest" | "spine" | "torso" | "belly" => part(0.14, 0.11, 0.6),
        "shoulder" => part(0.14, 0.10, 0.6),
        "pelvis" | "root" => part(0.12, 0.11, 0.6),
        "hip" => part(0.14, 0.09, 0.55),
        "elbow" => part(0.11, 0.05, 0.25),
        "wrist" | "hand" => part(0.07, 0.04, 0.15),
        "knee" => part(0.15, 0.06, 0.4),
        "ankle" | "heel" | "foot" | "toe" => part(0.08, 0.05, 0.2),
        _ => None,
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
