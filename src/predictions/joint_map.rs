//! The joints of one skeleton on another, by their names.
//!
//! Names are brought to one spelling first (`LShoulder`, `l_shoulder`, `Left Shoulder`). What a skeleton does not have and another
//! does is taken from joints that lie there: the pelvis between the hips, thorax and neck between the shoulders, the spine
//! between the two. What would have to be invented (the top of the head of COCO's face) is left out.

use crate::body::Skeleton;
use crate::geometry::{Vec3, mean};

/// Fewer joints in common are no skeleton that can be compared.
const FEWEST: usize = 4;

/// Where a joint comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JointSource {
    /// The joint of that name.
    Same(usize),
    /// The middle of these.
    Between(Vec<usize>),
}

impl JointSource {
    /// Where a joint called `wanted` is among joints called `names`.
    pub fn find(names: &[String], wanted: &str) -> Option<Self> {
        let canonical: Vec<String> = names.iter().map(|name| canonical_joint(name)).collect();
        source(&canonical, &canonical_joint(wanted))
    }

    /// The place among those of all joints.
    pub fn place(&self, joints: &[Vec3]) -> Vec3 {
        match self {
            Self::Same(k) => joints[*k],
            Self::Between(of) => mean(&of.iter().map(|&k| joints[k]).collect::<Vec<_>>()),
        }
    }
}

/// Which joints of a data set's skeleton a list of joints tells, and how.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointMap {
    /// Joints of the data set that are known, ascending.
    pub known: Vec<usize>,
    /// Where each of them comes from.
    pub sources: Vec<JointSource>,
}

impl JointMap {
    /// Of joints called `names` on `skeleton`.
    ///
    /// # Errors
    /// In words, where too few of them have a place.
    pub fn new(names: &[String], skeleton: &Skeleton) -> Result<Self, String> {
        let canonical: Vec<String> = names.iter().map(|name| canonical_joint(name)).collect();
        if let Some(twice) = (0..names.len()).find(|&k| canonical[..k].contains(&canonical[k])) {
            return Err(format!("joint `{}` is there twice", names[twice]));
        }
        let (mut known, mut sources) = (Vec::new(), Vec::new());
        for (joint, name) in skeleton.joints.iter().enumerate() {
            if let Some(source) = source(&canonical, &canonical_joint(name)) {
                known.push(joint);
                sources.push(source);
            }
        }
        if known.len() < FEWEST.min(skeleton.joints.len()) {
            let shown = |names: &[String]| {
                let first: Vec<&str> = names.iter().take(6).map(String::as_str).collect();
                format!("{}{}", first.join(", "), if names.len() > 6 { ", …" } else { "" })
            };
            return Err(format!(
                "{} of its {} joints ({}) are joints of the data set ({}); expected at least {FEWEST}; a table [mapping] of a \
                 description says which is which",
                known.len(),
                names.len(),
                shown(names),
                shown(&skeleton.joints),
            ));
        }
        Ok(Self { known, sources })
    }

    /// Joints that lie between others.
    pub fn derived(&self) -> usize {
        self.sources.iter().filter(|source| matches!(source, JointSource::Between(_))).count()
    }

    /// The known joints of a person, in the order of [`Self::known`].
    pub fn apply(&self, joints: &[Vec3]) -> Vec<Vec3> {
        self.sources.iter().map(|source| source.place(joints)).collect()
    }
}

fn source(names: &[String], wanted: &str) -> Option<JointSource> {
    let at = |name: &str| names.iter().position(|known| known == name);
    let between = |a: &str, b: &str| Some(JointSource::Between(vec![at(a)?, at(b)?]));
    let pelvis = || at("pelvis").map(|k| vec![k]).or_else(|| Some(vec![at("left_hip")?, at("right_hip")?]));
    let thorax = || {
        let one = at("thorax").or_else(|| at("neck")).map(|k| vec![k]);
        one.or_else(|| Some(vec![at("left_shoulder")?, at("right_shoulder")?]))
    };
    if let Some(k) = at(wanted) {
        return Some(JointSource::Same(k));
    }
    match wanted {
        "pelvis" => between("left_hip", "right_hip"),
        "thorax" => at("neck").map(JointSource::Same).or_else(|| between("left_shoulder", "right_shoulder")),
        "neck" => at("thorax").map(JointSource::Same).or_else(|| between("left_shoulder", "right_shoulder")),
        "spine" => {
            let (pelvis, thorax) = (pelvis()?, thorax()?);
            // Both ends count the same, however many joints tell them.
            let repeat = |of: Vec<usize>, n: usize| of.into_iter().flat_map(move |k| std::iter::repeat_n(k, n));
            let (a, b) = (pelvis.len(), thorax.len());
            Some(JointSource::Between(repeat(pelvis, b).chain(repeat(thorax, a)).collect()))
        }
        _ => None,
    }
}

/// A joint's name in the spelling of the known skeletons: `LShoulder`, `l_shoulder`, `Shoulder.L` are `left_shoulder`.
pub fn canonical_joint(name: &str) -> String {
    let mut spaced = String::with_capacity(name.len() + 4);
    let mut before = ' ';
    let letters: Vec<char> = name.chars().collect();
    for (k, &c) in letters.iter().enumerate() {
        let next_is_lower = letters.get(k + 1).is_some_and(|next| next.is_lowercase());
        let begins = c.is_uppercase() && (before.is_lowercase() || (before.is_uppercase() && next_is_lower));
        if begins {
            spaced.push('_');
        }
        spaced.push(if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '_' });
        before = c;
    }
    let (mut side, mut words) = (None, Vec::new());
    for word in spaced.split('_').filter(|word| !word.is_empty()) {
        match word {
            "left" | "l" => side = Some("left"),
            "right" | "r" => side = Some("right"),
            "joint" | "j" | "kp" => {}
            _ => words.push(word),
        }
    }
    let part = match words.join("_").as_str() {
        "hip" | "hips" | "mid_hip" | "midhip" | "hip_center" | "root" if side.is_none() => "pelvis".to_owned(),
        "mid_shoulder" | "shoulder_center" | "chest" | "upper_torso" if side.is_none() => "thorax".to_owned(),
        "neck_base" if side.is_none() => "neck".to_owned(),
        "belly" | "torso" | "mid_spine" | "spine1" if side.is_none() => "spine".to_owned(),
        "head_top" | "top_head" | "headtop" | "top" if side.is_none() => "head".to_owned(),
        other => other.to_owned(),
    };
    side.map_or_else(|| part.clone(), |side| format!("{side}_{part}"))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where a skeleton is missing")]
    use super::*;

    #[test]
    fn names_are_one_spelling() {
        for (name, want) in [
            ("LShoulder", "left_shoulder"),
            ("RightHip", "right_hip"),
            ("right hip", "right_hip"),
            ("hip.R", "right_hip"),
            ("Hip", "pelvis"),
            ("left_wrist", "left_wrist"),
            ("nose", "nose"),
            ("RAnkle", "right_ankle"),
            ("Neck", "neck"),
        ] {
            assert_eq!(canonical_joint(name), want, "{name}");
        }
    }

    #[test]
    fn every_known_skeleton_has_a_place_on_every_other() {
        let cases =
            [("coco17", "h36m17", 16), ("h36m17", "coco17", 13), ("hupr14", "coco17", 12), ("coco17", "hupr14", 13)];
        for (from, to, joints) in cases {
            let (from_skeleton, to_skeleton) = (Skeleton::preset(from).unwrap(), Skeleton::preset(to).unwrap());
            let map = JointMap::new(&from_skeleton.joints, &to_skeleton).unwrap();
            assert_eq!(map.known.len(), joints, "{from} on {to}");
        }
        for from in Skeleton::PRESETS {
            for to in Skeleton::PRESETS {
                let names = Skeleton::preset(from).unwrap().joints;
                let map = JointMap::new(&names, &Skeleton::preset(to).unwrap()).unwrap();
                assert!(map.known.len() >= 12, "{from} on {to}: {}", map.known.len());
                assert!(from != to || (map.derived() == 0 && map.known.len() == names.len()));
            }
        }
    }

    #[test]
    fn a_spine_lies_half_way_between_hips_and_shoulders() {
        let coco = Skeleton::preset("coco17").unwrap();
        let map = JointMap::new(&coco.joints, &Skeleton::preset("h36m17").unwrap()).unwrap();
        let joints: Vec<Vec3> = coco
            .joints
            .iter()
            .map(|name| if name.ends_with("hip") { [0.0, 0.0, 1.0] } else { [0.0, 0.0, 1.5] })
            .collect();
        let spine = map.known.iter().position(|&joint| joint == 7).unwrap();
        assert!((map.apply(&joints)[spine][2] - 1.25).abs() < 1e-12);
    }

    #[test]
    fn other_things_are_no_skeleton() {
        let names: Vec<String> = (0..17).map(|k| format!("p{k}")).collect();
        let why = JointMap::new(&names, &Skeleton::preset("coco17").unwrap()).unwrap_err();
        assert!(why.contains("0 of its 17 joints (p0, p1") && why.contains("[mapping]"), "{why}");
    }
}
