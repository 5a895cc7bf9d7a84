//! Directions in which a pose can move, with names: what a vector of joint displacements says is told by the named one that it is
//! most like.

use crate::body::{Side, Skeleton, is_named};
use crate::geometry::{Vec3, cross, dot, mean, norm, scale, sub};
use nalgebra::DVector;

/// A direction with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseMode {
    /// In words: `turning about the vertical axis`, `left foot along the ray`.
    pub name: String,
    /// Displacement of every joint, unit length as one vector.
    pub displacement: Vec<Vec3>,
}

/// Parts of a body that move for themselves: the words in their joints' names, and what they are called.
const LIMBS: [(&[&str], &str); 3] = [
    (&["elbow", "wrist", "hand"], "arm"),
    (&["knee", "ankle", "foot"], "leg"),
    (&["nose", "eye", "ear", "head"], "head"),
];
/// What is called otherwise than its joint.
const WORDS: [(&str, &str); 1] = [("ankle", "foot")];

impl PoseMode {
    fn new(name: String, of: Vec<Vec3>) -> Option<Self> {
        let length = of.iter().map(|v| dot(*v, *v)).sum::<f64>().sqrt();
        let displacement: Vec<Vec3> = of.into_iter().map(|v| scale(v, 1.0 / length)).collect();
        (length > 1e-9 && length.is_finite()).then_some(Self { name, displacement })
    }

    /// Cosine between this and a vector of displacements.
    pub(super) fn likeness(&self, of: &DVector<f64>) -> f64 {
        self.displacement.iter().flatten().zip(of.iter()).map(|(a, b)| a * b).sum::<f64>() / of.norm().max(1e-300)
    }
}

/// The named directions of the bodies at `positions` before a radar at `radar`: of each person as a whole, of its limbs, of each
/// joint.
pub(super) fn modes(skeleton: &Skeleton, positions: &[Vec3], radar: Vec3) -> Vec<PoseMode> {
    let joints = skeleton.joints.len().max(1);
    let persons = positions.len() / joints;
    let mut modes = Vec::new();
    for person in 0..persons {
        let of = person * joints..(person + 1) * joints;
        let body = &positions[of.clone()];
        let centre = mean(body);
        let who = if persons > 1 { format!("person {}: ", person + 1) } else { String::new() };
        // Along the ray on the floor, to its left, up.
        let sight = sub(centre, radar);
        let flat = [sight[0], sight[1], 0.0];
        let ray = scale(flat, 1.0 / norm(flat).max(1e-9));
        let axes: [Vec3; 3] = [ray, [-ray[1], ray[0], 0.0], [0.0, 0.0, 1.0]];
        let words = ["along the ray", "across the ray", "up and down"];
        let mut add = |name: String, which: &dyn Fn(usize) -> Option<Vec3>| {
            let all = (0..positions.len()).map(|k| {
                let inside = of.contains(&k).then(|| which(k - of.start)).flatten();
                inside.unwrap_or([0.0; 3])
            });
            modes.extend(PoseMode::new(format!("{who}{name}"), all.collect()));
        };
        for (axis, word) in axes.iter().zip(words) {
            add(format!("the whole body {word}"), &|_| Some(*axis));
        }
        let turns = [
            (axes[2], "turning about the vertical axis"),
            (axes[1], "leaning along the ray"),
            (axes[0], "leaning across the ray"),
        ];
        for (axis, word) in turns {
            add(word.to_owned(), &|k| Some(cross(axis, sub(body[k], centre))));
        }
        add("growing and shrinking".to_owned(), &|k| Some(sub(body[k], centre)));
        for (parts, limb) in LIMBS {
            for (side, prefix) in [(Side::Left, "left "), (Side::Right, "right "), (Side::Middle, "")] {
                let named = |k: usize| is_named(skeleton, k, parts) && (limb == "head" || skeleton.side(k) == side);
                if (limb == "head") != (side == Side::Middle) || !(0..joints).any(named) {
                    continue;
                }
                for (axis, word) in axes.iter().zip(words) {
                    add(format!("{prefix}{limb} {word}"), &|k| named(k).then_some(*axis));
                }
            }
        }
        for joint in 0..joints {
            let mut name = skeleton.shown_name(joint);
            for (from, to) in WORDS {
                name = name.replace(from, to);
            }
            let sight = sub(body[joint], radar);
            let own = scale(sight, 1.0 / norm(sight).max(1e-9));
            for (axis, word) in [own, axes[1], axes[2]].iter().zip(words) {
                add(format!("{name} {word}"), &|k| (k == joint).then_some(*axis));
            }
        }
    }
    modes
}
