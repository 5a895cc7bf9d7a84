//! Skeleton topologies: joints by name, bones, reference lengths and limited angles; SPEC section 5.
//!
//! Sides come from the names, never from an index: data sets disagree about which of 1–3 is left.

use serde::{Deserialize, Serialize};

/// Which side of the body a joint or bone is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The person's left.
    Left,
    /// The person's right.
    Right,
    /// On the median plane.
    Middle,
}

/// A skeleton; the `[skeleton]` table of a manifest has the same keys.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Skeleton {
    /// Joint names, for example `left_wrist`.
    pub joints: Vec<String>,
    /// Pairs of joint indices.
    pub bones: Vec<[usize; 2]>,
    /// Reference length of each bone, m.
    pub bone_lengths_m: Vec<f64>,
    /// Triplets (m, n, o), n the vertex, whose angle is limited.
    pub angles: Vec<[usize; 3]>,
}

impl Skeleton {
    /// The side of a joint, from its name.
    pub fn side(&self, joint: usize) -> Side {
        let name = self.joints.get(joint).map_or("", String::as_str);
        let has = |word: &str| name.split('_').any(|part| part == word);
        if has("left") || has("l") {
            Side::Left
        } else if has("right") || has("r") {
            Side::Right
        } else {
            Side::Middle
        }
    }

    /// The side of a bone: that of its joints where they agree or one is in the middle, else the middle.
    pub fn bone_side(&self, bone: [usize; 2]) -> Side {
        match (self.side(bone[0]), self.side(bone[1])) {
            (a, b) if a == b => a,
            (Side::Middle, b) => b,
            (a, Side::Middle) => a,
            _ => Side::Middle,
        }
    }

    /// The name of a joint as shown on screen: `left wrist`.
    pub fn shown_name(&self, joint: usize) -> String {
        self.joints.get(joint).map_or_else(|| format!("joint {joint}"), |name| name.replace('_', " "))
    }

    /// Index of the joint called `name`.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint == name)
    }
}
