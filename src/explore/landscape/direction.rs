//! Directions in the space of parameters, one or two of which span a slice.

use crate::body::{Group, Pppr, Skeleton};
use crate::explore::moves::{across, angle_about, limb_of, move_person, turn_limb, yaw_between};
use crate::explore::plane::SampleAxis;
use crate::geometry::{Vec3, mean, sub};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What a person chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SliceAlong {
    /// The whole body, along x.
    #[default]
    BodyX,
    /// Along y.
    BodyY,
    /// Along z.
    BodyZ,
    /// The whole body, turned about the vertical axis.
    BodyYaw,
    /// The chosen joint alone, along x.
    JointX,
    /// Along y.
    JointY,
    /// Along z.
    JointZ,
    /// The limb of the chosen joint, turned about the vertical axis.
    BoneTurn,
    /// The same, lifted about the horizontal axis across its bone.
    BoneLift,
    /// Against the gradient.
    Gradient,
    /// The last step of the fit.
    LastStep,
    /// From one pin to another, or from a pin to the state on screen.
    Pins,
}

impl SliceAlong {
    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::BodyX,
        Self::BodyY,
        Self::BodyZ,
        Self::BodyYaw,
        Self::JointX,
        Self::JointY,
        Self::JointZ,
        Self::BoneTurn,
        Self::BoneLift,
        Self::Gradient,
        Self::LastStep,
        Self::Pins,
    ];

    /// The word on the command line.
    pub fn key(self) -> &'static str {
        match self {
            Self::BodyX => "x",
            Self::BodyY => "y",
            Self::BodyZ => "z",
            Self::BodyYaw => "yaw",
            Self::JointX => "joint_x",
            Self::JointY => "joint_y",
            Self::JointZ => "joint_z",
            Self::BoneTurn => "bone_turn",
            Self::BoneLift => "bone_lift",
            Self::Gradient => "gradient",
            Self::LastStep => "last_step",
            Self::Pins => "pins",
        }
    }

    /// That of a word.
    pub fn of_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|along| along.key() == key)
    }

    /// On screen.
    pub fn title(self) -> &'static str {
        match self {
            Self::BodyX => "body along x",
            Self::BodyY => "body along y",
            Self::BodyZ => "body along z",
            Self::BodyYaw => "body's yaw",
            Self::JointX => "joint along x",
            Self::JointY => "joint along y",
            Self::JointZ => "joint along z",
            Self::BoneTurn => "bone's turn",
            Self::BoneLift => "bone's lift",
            Self::Gradient => "down the gradient",
            Self::LastStep => "last step",
            Self::Pins => "between pins",
        }
    }

    /// What it is.
    pub fn help(self) -> &'static str {
        match self {
            Self::BodyX => "The whole person moved away from the radar (+) or towards it.",
            Self::BodyY => "The whole person moved to the radar's left (+) or right.",
            Self::BodyZ => "The whole person moved up (+) or down.",
            Self::BodyYaw => "The whole person turned about the vertical axis through its root, to the left (+).",
            Self::JointX | Self::JointY | Self::JointZ => "The selected joint alone; its bones stretch.",
            Self::BoneTurn => "The selected joint's limb turned about the vertical axis through its inner end.",
            Self::BoneLift => "The selected joint's limb turned about the horizontal axis across its bone.",
            Self::Gradient => "All parameters against ∂L/∂Θ, in m of the joint that moves most.",
            Self::LastStep => "All parameters along the step that led to the state on screen, in steps.",
            Self::Pins => "All parameters from one pin (0) to another (1), or to the state on screen.",
        }
    }

    /// How far a slice reaches at a reach of 1, in the unit of its axis.
    pub fn span(self) -> [f64; 2] {
        match self {
            Self::BodyX | Self::BodyY => [-1.0, 1.0],
            Self::BodyZ | Self::JointX | Self::JointY | Self::JointZ => [-0.5, 0.5],
            Self::BodyYaw => [-180.0, 180.0],
            Self::BoneTurn | Self::BoneLift => [-90.0, 90.0],
            Self::Gradient => [-0.15, 0.3],
            Self::LastStep => [-30.0, 30.0],
            Self::Pins => [-0.5, 1.5],
        }
    }

    /// Whether it is of a joint that must be chosen.
    pub fn needs_joint(self) -> bool {
        matches!(self, Self::JointX | Self::JointY | Self::JointZ | Self::BoneTurn | Self::BoneLift)
    }
}

/// A direction with all that it is made of.
#[derive(Debug, Clone, PartialEq)]
pub enum Direction {
    /// A person along an axis of the world, m.
    Body {
        /// Which.
        person: usize,
        /// 0 to 2.
        axis: usize,
    },
    /// A person about the vertical axis, degrees.
    Yaw {
        /// Which.
        person: usize,
    },
    /// A joint alone, m.
    Joint {
        /// Flat index.
        joint: usize,
        /// 0 to 2.
        axis: usize,
        /// Its name.
        name: String,
    },
    /// A limb about an axis, degrees.
    Bone {
        /// Flat index of a joint of it.
        joint: usize,
        /// About the horizontal axis across the bone instead of the vertical one.
        lift: bool,
        /// Its name.
        name: String,
    },
    /// All parameters along a line.
    Line {
        /// A step of 1.
        by: Arc<Pppr>,
        /// What it is.
        name: String,
        /// Unit of the coordinate, or "".
        unit: &'static str,
    },
}

impl Direction {
    /// The axis of a slice from one end to the other.
    pub fn axis(&self, [from, to]: [f64; 2], cells: usize) -> SampleAxis {
        const NAMES: [&str; 3] = ["x", "y", "z"];
        let (name, unit) = match self {
            Self::Body { axis, .. } => (format!("body along {}", NAMES[axis % 3]), "m"),
            Self::Yaw { .. } => ("body's yaw".to_owned(), "°"),
            Self::Joint { axis, name, .. } => (format!("{name} along {}", NAMES[axis % 3]), "m"),
            Self::Bone { lift, name, .. } => (format!("{name}, bone's {}", if *lift { "lift" } else { "turn" }), "°"),
            Self::Line { name, unit, .. } => (name.clone(), *unit),
        };
        // All the way round: the last sample is the neighbour of the first.
        let closed = matches!(self, Self::Yaw { .. }) && (to - from - 360.0).abs() < 1e-9;
        let to = if closed { to - 360.0 / cells as f64 } else { to };
        SampleAxis { name, unit, from, to, cells, closed }
    }

    /// Moves `params` from where they are by `s`.
    pub fn apply(&self, params: &mut Pppr, skeleton: &Skeleton, s: f64) {
        match self {
            Self::Body { person, axis } => {
                let by: Vec3 = std::array::from_fn(|k| if k == *axis { s } else { 0.0 });
                move_person(params, skeleton, *person, by, 0.0);
            }
            Self::Yaw { person } => move_person(params, skeleton, *person, [0.0; 3], s.to_radians()),
            Self::Joint { joint, axis, .. } => {
                let mut at = params.position(*joint);
                at[*axis] += s;
                params.set_vec3(Group::Position, *joint, at);
            }
            Self::Bone { joint, lift, .. } => {
                if let Some(limb) = limb_of(params, skeleton, *joint) {
                    let axis = bone_axis(params, &limb, *lift);
                    turn_limb(params, &limb, axis, s.to_radians());
                }
            }
            Self::Line { by, .. } => params.add_scaled(s, by),
        }
    }

    /// Where a pose (all joints, m) lies along the direction from `origin`; `None` where it has other joints or the direction
    /// moves none.
    pub fn coordinate(&self, origin: &Pppr, skeleton: &Skeleton, pose: &[Vec3]) -> Option<f64> {
        let joints = origin.shape().joints.max(1);
        if pose.len() != origin.positions().len() {
            return None;
        }
        let of_person = |person: usize| -> Option<[&[Vec3]; 2]> {
            Some([origin.person(person), pose.get(person * joints..(person + 1) * joints)?])
        };
        match self {
            Self::Body { person, axis } => {
                let [from, to] = of_person(*person)?;
                Some(mean(to)[*axis] - mean(from)[*axis])
            }
            Self::Yaw { person } => {
                let [from, to] = of_person(*person)?;
                Some(yaw_between(from, to).to_degrees())
            }
            Self::Joint { joint, axis, .. } => Some(pose.get(*joint)?[*axis] - origin.position(*joint)[*axis]),
            Self::Bone { joint, lift, .. } => {
                let limb = limb_of(origin, skeleton, *joint)?;
                let axis = bone_axis(origin, &limb, *lift);
                let (inner, outer) = (limb.1 + limb.0.inner, limb.1 + limb.0.outer);
                let was = sub(origin.position(outer), origin.position(inner));
                Some(angle_about(axis, was, sub(*pose.get(outer)?, *pose.get(inner)?)).to_degrees())
            }
            Self::Line { by, .. } => {
                let (mut along, mut length) = (0.0, 0.0);
                for ((a, b), d) in origin.positions().iter().zip(pose).zip(by.positions()) {
                    for k in 0..3 {
                        along += (b[k] - a[k]) * d[k];
                        length += d[k] * d[k];
                    }
                }
                (length > 0.0).then(|| along / length)
            }
        }
    }
}

fn bone_axis(params: &Pppr, (limb, first): &(crate::mhp::Limb, usize), lift: bool) -> Vec3 {
    let bone = sub(params.position(first + limb.outer), params.position(first + limb.inner));
    if lift { across(bone) } else { [0.0, 0.0, 1.0] }
}
