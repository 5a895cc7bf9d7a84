//! Settings with a name.

use super::{EmRegion, FitConfig, Height, LearningRates, Limbs, Parameterization, Place, Scatterers, Summation, Yaw};

/// A whole [`FitConfig`] with a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// The paper's setting, as SPEC section 4 fixes it; the default.
    Paper,
    /// What fits best on synthetic data with truth; the README tells by how much each switch helps.
    Recommended,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Self; 2] = [Self::Paper, Self::Recommended];

    /// The word on the command line and the screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Recommended => "recommended",
        }
    }

    /// The preset with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// What it is, in a sentence.
    pub fn help(self) -> &'static str {
        match self {
            Self::Paper => "The paper's setting: every joint moves by itself, equal round Gaussians, coherent sum.",
            Self::Recommended => {
                "What fits best on synthetic data with truth: the body moves as one, skin in front of the joints, Gaussians by body \
                 part, heading and place from the frames around, feet on the floor, the posture that fits, limbs as learned from simulated people, powers add."
            }
        }
    }

    /// Its settings.
    pub fn config(self) -> FitConfig {
        match self {
            Self::Paper => FitConfig::default(),
            Self::Recommended => FitConfig {
                parameterization: Parameterization::Bones,
                scatterers: Scatterers::BodyParts,
                place: Place::Counted,
                yaw: Yaw::Motion,
                height: Height::Floor,
                limbs: Limbs::Learned,
                summation: Summation::Incoherent,
                em_region: EmRegion::HalfWidth(1.0),
                surface_offset_m: 0.04,
                starts: 9,
                w_time: 8.0,
                learning_rates: LearningRates {
                    position: Some(2e-3),
                    bone: Some(0.0),
                    // How bright and how wide each part is differs from person to person and says nothing of the pose.
                    beta: Some(1e-1),
                    log_scale: Some(3e-2),
                    rotation: Some(1e-2),
                    ..LearningRates::default()
                },
                ..FitConfig::default()
            },
        }
    }
}
