//! The studies by name.

use serde::{Deserialize, Serialize};

/// A study: what is varied, and how its table is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StudyKind {
    /// One configuration, by easy, medium and hard frames.
    Complexity,
    /// Starts perturbed on purpose.
    Robustness,
    /// The forward model without one of its operators.
    Operators,
    /// Shares of cells in a mask.
    Threshold,
    /// Weights of the two constraints.
    Weights,
    /// The start without P or V.
    Init,
    /// Iterations against error, IoU and time.
    Budget,
    /// Each switch in which the presets differ.
    Switches,
    /// How often the number of people is right.
    Counting,
    /// Fits from the truth beside fits from the program's own start.
    Truth,
    /// Any grid over the configuration.
    Sweep,
}

impl StudyKind {
    /// Every study.
    pub const ALL: [Self; 11] = [
        Self::Complexity,
        Self::Robustness,
        Self::Operators,
        Self::Threshold,
        Self::Weights,
        Self::Init,
        Self::Budget,
        Self::Switches,
        Self::Counting,
        Self::Truth,
        Self::Sweep,
    ];

    /// The word on the command line and in `run.toml`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Complexity => "complexity",
            Self::Robustness => "robustness",
            Self::Operators => "operators",
            Self::Threshold => "threshold",
            Self::Weights => "weights",
            Self::Init => "init",
            Self::Budget => "budget",
            Self::Switches => "switches",
            Self::Counting => "counting",
            Self::Truth => "truth",
            Self::Sweep => "sweep",
        }
    }

    /// The head of its table.
    pub fn title(self) -> &'static str {
        match self {
            Self::Complexity => "Fits by complexity of the frame",
            Self::Robustness => "Robustness against perturbed starts",
            Self::Operators => "Radar simulation without one operator",
            Self::Threshold => "Reconstruction threshold τ",
            Self::Weights => "Weights of electromagnetic and kinematic constraints",
            Self::Init => "Initialisation modules",
            Self::Budget => "Iteration budget",
            Self::Switches => "Switches of the presets",
            Self::Counting => "Counting people",
            Self::Truth => "Whether the loss knows the truth",
            Self::Sweep => "Sweep over the configuration",
        }
    }

    /// Whether its table is cut by stratum.
    pub fn by_stratum(self) -> bool {
        self == Self::Complexity
    }
}

impl std::fmt::Display for StudyKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}
