//! Settings with a name.

use super::{
    Background, Convergence, EmRegion, FitConfig, FramesAround, GradientVelocity, Height, InitConfig, LearningRates,
    Limbs, Parameterization, Scatterers, StartPlace, Still, Summation, WarmStart, Yaw,
};

/// A whole [`FitConfig`] with a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// What SPEC fixes of the paper, and the start that the program finds: what every command takes without `--preset`.
    Default,
    /// The paper to the letter, as far as its words say one thing; [`super::deviations`] lists what they do not.
    Paper,
    /// What fits best on synthetic data with truth; `study switches` tells by how much each switch helps.
    Recommended,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Self; 3] = [Self::Default, Self::Paper, Self::Recommended];

    /// The word on the command line and the screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Paper => "paper",
            Self::Recommended => "recommended",
        }
    }

    /// The preset with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// What it is, in a line.
    pub fn help(self) -> &'static str {
        match self {
            Self::Default => "The paper's fit within 1.25 m of the person, from a start that leaves the room out",
            Self::Paper => "The paper to the letter: the whole map, the strongest cluster of peaks, one frame alone",
            Self::Recommended => {
                "What fits synthetic data with truth best: the body moves as one, posture and place are looked for"
            }
        }
    }

    /// Its settings.
    pub fn config(self) -> FitConfig {
        match self {
            Self::Default => FitConfig::default(),
            Self::Paper => FitConfig {
                em_region: EmRegion::Full,
                bone_tolerance_m: 0.05,
                convergence: Convergence::Improvement,
                place: StartPlace::Cluster,
                frames_around: FramesAround::Past,
                warm_start: WarmStart::AsLeft,
                init: InitConfig {
                    still: Still::Kept,
                    background: Background::Map,
                    gradient: GradientVelocity::Magnitude,
                    ..InitConfig::default()
                },
                ..FitConfig::default()
            },
            Self::Recommended => FitConfig {
                parameterization: Parameterization::Bones,
                scatterers: Scatterers::BodyParts,
                place: StartPlace::Counted,
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
