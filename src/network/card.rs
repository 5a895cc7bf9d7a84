//! What a model is: what it reads, how it is built, what it was taught with. The metadata of its file.

use crate::dataset::DatasetInfo;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What a network reads of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Features {
    /// The parameters of every joint.
    Pppr,
    /// The maps that the parameters simulate.
    PpprHeatmap,
    /// The measured maps.
    Heatmap,
    /// The joints of the fit alone.
    FitJoints,
}

impl Features {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Pppr, Self::PpprHeatmap, Self::Heatmap, Self::FitJoints];

    /// As typed.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pppr => "pppr",
            Self::PpprHeatmap => "pppr-heatmap",
            Self::Heatmap => "heatmap",
            Self::FitJoints => "fit-joints",
        }
    }

    /// Whether a fit must be there.
    pub fn needs_fit(self) -> bool {
        self != Self::Heatmap
    }

    /// Whether there is something of each joint.
    pub fn of_joints(self) -> bool {
        matches!(self, Self::Pppr | Self::FitJoints)
    }
}

/// How a network is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// The paper's: the mean over the joints of each person's parameters.
    Mlp,
    /// The numbers of every joint, about the body's middle.
    MlpJoints,
    /// The same of five frames.
    MlpWindow,
}

impl Architecture {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Mlp, Self::MlpJoints, Self::MlpWindow];

    /// As typed.
    pub fn word(self) -> &'static str {
        match self {
            Self::Mlp => "mlp",
            Self::MlpJoints => "mlp-joints",
            Self::MlpWindow => "mlp-window",
        }
    }

    /// Frames on each side that it reads.
    pub fn reach(self) -> usize {
        if self == Self::MlpWindow { 2 } else { 0 }
    }
}

macro_rules! typed {
    ($type:ty, $what:literal) => {
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.word())
            }
        }

        impl FromStr for $type {
            type Err = String;

            fn from_str(text: &str) -> Result<Self, String> {
                let known = Self::ALL.into_iter().find(|known| known.word() == text);
                known.ok_or_else(|| {
                    let all = Self::ALL.map(Self::word).join(", ");
                    format!("{} \"{}\"; expected {all}", $what, text.escape_debug())
                })
            }
        }
    };
}
typed!(Features, "features");
typed!(Architecture, "model");

/// A model's card.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelCard {
    /// What it reads.
    pub features: Features,
    /// How it is built.
    pub architecture: Architecture,
    /// The joints that it answers, in order.
    pub joints: Vec<String>,
    /// Doppler features N_d of the parameters that it reads.
    pub doppler_features: usize,
    /// Arrays and shapes of the maps that it reads; of none where it reads parameters.
    pub maps: Vec<(String, Vec<usize>)>,
    /// Whether joints are read and answered about the middle of the fitted body.
    pub centred: bool,
    /// Weights.
    pub parameters: usize,
    /// The command that made it, the program's version, the data, the figures: one line each.
    pub notes: Vec<String>,
}

impl ModelCard {
    /// That of a network that is to be taught on a data set: no weights yet, and no notes.
    pub fn of_data(info: &DatasetInfo, features: Features, architecture: Architecture) -> Self {
        let views = if features.of_joints() { &[] } else { &info.views[..] };
        Self {
            features,
            architecture,
            joints: info.skeleton.joints.clone(),
            doppler_features: info.radar.doppler_features,
            maps: views.iter().map(|view| (view.array.clone(), view.shape())).collect(),
            centred: features.of_joints() && architecture != Architecture::Mlp,
            parameters: 0,
            notes: Vec::new(),
        }
    }
}
