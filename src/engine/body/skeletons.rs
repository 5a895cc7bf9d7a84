//! The skeletons that data sets use; SPEC section 5.
//!
//! Lengths are those of a person of 1.70 m: `coco17` has the reference cases' own, the others follow the segment ratios
//! of Winter, *Biomechanics and Motor Control of Human Movement* (thigh 0.245 H, shank 0.246 H, upper arm 0.186 H,
//! forearm 0.146 H, shoulders 0.129 H and hips 0.0955 H from the middle, hips at 0.530 H, shoulders at 0.818 H).

use super::Skeleton;

const HEIGHT_M: f64 = 1.70;
const THIGH: f64 = 0.245 * HEIGHT_M;
const SHANK: f64 = 0.246 * HEIGHT_M;
const UPPER_ARM: f64 = 0.186 * HEIGHT_M;
const FOREARM: f64 = 0.146 * HEIGHT_M;
const HALF_SHOULDERS: f64 = 0.129 * HEIGHT_M;
const HALF_HIPS: f64 = 0.0955 * HEIGHT_M;
const TRUNK: f64 = (0.818 - 0.530) * HEIGHT_M;
const NECK_TO_TOP: f64 = (1.0 - 0.818) * HEIGHT_M;
/// From the middle of the shoulders to a hip, √(trunk² + half hips²) = 0.30342 H.
const NECK_TO_HIP: f64 = 0.515_815_55;
/// From the middle of the shoulders to the nose of a person who looks ahead: 0.1 m before it and 0.17 m above.
const NECK_TO_NOSE: f64 = 0.197_230_8;

/// The joints of COCO's 17 keypoints.
pub(crate) const COCO_JOINTS: [&str; 17] = [
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
/// Its bones with the reference cases' lengths, m.
pub(super) const COCO_BONES: [(usize, usize, f64); 19] = [
    (15, 13, 0.4318564576337837),
    (13, 11, 0.4305810028322197),
    (16, 14, 0.4318564576337837),
    (14, 12, 0.4305810028322197),
    (11, 12, 0.22),
    (5, 11, 0.5048762224545735),
    (6, 12, 0.5048762224545735),
    (5, 6, 0.36),
    (5, 7, 0.2989983277545211),
    (6, 8, 0.2989983277545211),
    (7, 9, 0.25079872407968895),
    (8, 10, 0.25079872407968895),
    (1, 2, 0.06),
    (0, 1, 0.053851648071344904),
    (0, 2, 0.053851648071344904),
    (1, 3, 0.0806225774829855),
    (2, 4, 0.0806225774829855),
    (3, 5, 0.2156385865284782),
    (4, 6, 0.2156385865284782),
];

/// Name, joints, bones with lengths in metres, angles.
struct Preset {
    name: &'static str,
    joints: &'static [&'static str],
    bones: &'static [(usize, usize, f64)],
    angles: &'static [[usize; 3]],
}

const PRESETS: [Preset; 5] = [
    Preset {
        name: "coco17",
        joints: &COCO_JOINTS,
        bones: &COCO_BONES,
        angles: &[[5, 7, 9], [6, 8, 10], [11, 13, 15], [12, 14, 16]],
    },
    Preset {
        name: "h36m17",
        joints: &[
            "pelvis",
            "right_hip",
            "right_knee",
            "right_ankle",
            "left_hip",
            "left_knee",
            "left_ankle",
            "spine",
            "thorax",
            "nose",
            "head",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "right_shoulder",
            "right_elbow",
            "right_wrist",
        ],
        bones: &[
            (0, 1, HALF_HIPS),
            (1, 2, THIGH),
            (2, 3, SHANK),
            (0, 4, HALF_HIPS),
            (4, 5, THIGH),
            (5, 6, SHANK),
            (0, 7, 0.5 * TRUNK),
            (7, 8, 0.5 * TRUNK),
            (8, 9, 0.5 * NECK_TO_TOP),
            (9, 10, 0.5 * NECK_TO_TOP),
            (8, 11, HALF_SHOULDERS),
            (11, 12, UPPER_ARM),
            (12, 13, FOREARM),
            (8, 14, HALF_SHOULDERS),
            (14, 15, UPPER_ARM),
            (15, 16, FOREARM),
        ],
        angles: &[[11, 12, 13], [14, 15, 16], [4, 5, 6], [1, 2, 3]],
    },
    Preset {
        name: "hupr14",
        joints: &[
            "right_hip",
            "right_knee",
            "right_ankle",
            "left_hip",
            "left_knee",
            "left_ankle",
            "neck",
            "head",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "right_shoulder",
            "right_elbow",
            "right_wrist",
        ],
        bones: &[
            (0, 1, THIGH),
            (1, 2, SHANK),
            (3, 4, THIGH),
            (4, 5, SHANK),
            (0, 3, 2.0 * HALF_HIPS),
            (6, 0, NECK_TO_HIP),
            (6, 3, NECK_TO_HIP),
            (6, 7, NECK_TO_TOP),
            (6, 8, HALF_SHOULDERS),
            (8, 9, UPPER_ARM),
            (9, 10, FOREARM),
            (6, 11, HALF_SHOULDERS),
            (11, 12, UPPER_ARM),
            (12, 13, FOREARM),
        ],
        angles: &[[8, 9, 10], [11, 12, 13], [3, 4, 5], [0, 1, 2]],
    },
    // The published bones, and one between the hips: with it the trunk is one rigid part.
    Preset {
        name: "hiber14",
        joints: &[
            "nose",
            "neck",
            "right_shoulder",
            "right_elbow",
            "right_wrist",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "right_hip",
            "right_knee",
            "right_ankle",
            "left_hip",
            "left_knee",
            "left_ankle",
        ],
        bones: &[
            (0, 1, NECK_TO_NOSE),
            (1, 2, HALF_SHOULDERS),
            (1, 5, HALF_SHOULDERS),
            (2, 3, UPPER_ARM),
            (3, 4, FOREARM),
            (5, 6, UPPER_ARM),
            (6, 7, FOREARM),
            (8, 9, THIGH),
            (9, 10, SHANK),
            (11, 12, THIGH),
            (12, 13, SHANK),
            (1, 8, NECK_TO_HIP),
            (1, 11, NECK_TO_HIP),
            (8, 11, 2.0 * HALF_HIPS),
        ],
        angles: &[[5, 6, 7], [2, 3, 4], [11, 12, 13], [8, 9, 10]],
    },
    Preset {
        name: "rt_pose15",
        joints: &[
            "pelvis",
            "right_hip",
            "right_knee",
            "right_ankle",
            "left_hip",
            "left_knee",
            "left_ankle",
            "thorax",
            "head",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "right_shoulder",
            "right_elbow",
            "right_wrist",
        ],
        bones: &[
            (0, 1, HALF_HIPS),
            (1, 2, THIGH),
            (2, 3, SHANK),
            (0, 4, HALF_HIPS),
            (4, 5, THIGH),
            (5, 6, SHANK),
            (0, 7, TRUNK),
            (7, 8, NECK_TO_TOP),
            (7, 9, HALF_SHOULDERS),
            (9, 10, UPPER_ARM),
            (10, 11, FOREARM),
            (7, 12, HALF_SHOULDERS),
            (12, 13, UPPER_ARM),
            (13, 14, FOREARM),
        ],
        angles: &[[9, 10, 11], [12, 13, 14], [4, 5, 6], [1, 2, 3]],
    },
];

/// Joints, bones or angles of a skeleton at most: every pair of joints of two people is looked at in every iteration.
const MAX_PARTS: usize = 256;
/// Bytes of a joint's name at most.
const MAX_NAME: usize = 100;
/// Length of a bone at most, m.
const MAX_BONE_M: f64 = 10.0;

impl Skeleton {
    /// The names that [`Self::preset`] knows.
    pub const PRESETS: [&'static str; 5] = ["coco17", "h36m17", "hupr14", "hiber14", "rt_pose15"];

    /// The skeleton called `name`; SPEC section 5.
    pub fn preset(name: &str) -> Option<Self> {
        let preset = PRESETS.iter().find(|preset| preset.name == name)?;
        Some(Self {
            joints: preset.joints.iter().map(|&joint| joint.to_owned()).collect(),
            bones: preset.bones.iter().map(|&(m, n, _)| [m, n]).collect(),
            bone_lengths_m: preset.bones.iter().map(|&(_, _, length)| length).collect(),
            angles: preset.angles.to_vec(),
        })
    }

    /// The name of the preset with these joints in this order, whatever its lengths.
    pub fn preset_name(&self) -> Option<&'static str> {
        PRESETS
            .iter()
            .find(|preset| preset.joints.iter().copied().eq(self.joints.iter().map(String::as_str)))
            .map(|p| p.name)
    }

    /// What is wrong with the indices and lengths, in words; `None` if nothing is.
    pub fn fault(&self) -> Option<String> {
        let n = self.joints.len();
        if n == 0 {
            return Some("`joints` is empty; expected at least one name".into());
        }
        let lists = [("joints", n), ("bones", self.bones.len()), ("angles", self.angles.len())];
        if let Some((key, long)) = lists.into_iter().find(|(_, long)| *long > MAX_PARTS) {
            return Some(format!("`{key}` has {long} entries; expected at most {MAX_PARTS}"));
        }
        if let Some(long) = self.joints.iter().find(|name| name.len() > MAX_NAME) {
            let begin: String = long.chars().take(20).collect();
            return Some(format!("joint `{begin}…` has a name of {} bytes; expected at most {MAX_NAME}", long.len()));
        }
        if let Some(twice) = self.joints.iter().enumerate().find(|(i, name)| self.joint(name) != Some(*i)) {
            return Some(format!("joint `{}` is listed twice", twice.1));
        }
        if self.bones.len() != self.bone_lengths_m.len() {
            let (bones, lengths) = (self.bones.len(), self.bone_lengths_m.len());
            return Some(format!("{lengths} `bone_lengths_m` for {bones} `bones`; expected one length a bone"));
        }
        let bone = |&[m, n_]: &[usize; 2]| m >= n || n_ >= n || m == n_;
        if let Some(bad) = self.bones.iter().find(|b| bone(b)) {
            return Some(format!("bone {bad:?}: expected two different joint indices below {n}"));
        }
        if let Some(bad) = self.bone_lengths_m.iter().find(|l| !(**l > 0.0 && **l <= MAX_BONE_M)) {
            return Some(format!("bone length {bad}: expected metres above 0, at most {MAX_BONE_M}"));
        }
        let angle = |&[a, b, c]: &[usize; 3]| a >= n || b >= n || c >= n || a == b || b == c || a == c;
        self.angles
            .iter()
            .find(|t| angle(t))
            .map(|bad| format!("angle {bad:?}: expected three different joint indices below {n}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Side;

    #[test]
    fn every_preset_is_sound_and_symmetric() {
        for name in Skeleton::PRESETS {
            let skeleton = Skeleton::preset(name).unwrap_or_else(|| unreachable!("{name}"));
            assert_eq!(skeleton.fault(), None, "{name}");
            assert_eq!(skeleton.preset_name(), Some(name));
            assert_eq!(skeleton.angles.len(), 4, "{name}");
            let other = |joint: usize| {
                let name = &skeleton.joints[joint];
                let twin = if name.starts_with("left_") {
                    name.replace("left_", "right_")
                } else {
                    name.replace("right_", "left_")
                };
                skeleton.joint(&twin).unwrap_or(joint)
            };
            for (bone, length) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
                let twin = bone.map(other);
                let at = skeleton.bones.iter().position(|b| *b == twin || (b[0] == twin[1] && b[1] == twin[0]));
                assert_eq!(at.map(|i| skeleton.bone_lengths_m[i]), Some(*length), "{name}: {bone:?} has no twin");
            }
            let sided = (0..skeleton.joints.len()).filter(|&j| skeleton.side(j) == Side::Left).count();
            assert_eq!(sided * 2, (0..skeleton.joints.len()).filter(|&j| skeleton.side(j) != Side::Middle).count());
        }
        assert!((0.288_f64.hypot(0.0955) * HEIGHT_M - NECK_TO_HIP).abs() < 1e-6);
        assert!((0.10_f64.hypot(0.17) - NECK_TO_NOSE).abs() < 1e-6);
        assert_eq!(Skeleton::preset("smpl"), None);
    }
}
