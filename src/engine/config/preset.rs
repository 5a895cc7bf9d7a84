//! Settings with a name.

use super::{
    Background, BodyModel, Clutter, Convergence, EmLoss, EmRegion, FitConfig, FramesAround, GradientVelocity, Height,
    InitConfig, LearningRates, Parameterization, RangeOffset, Scatterers, Sidelobes, StartPlace, StaticEcho, Still,
    Summation, WarmStart, Yaw,
};

/// A whole [`FitConfig`] with a name. Without a name, every command and the window take the recommended one; a FIT.toml begins at
/// the baseline.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Preset {
    /// What SPEC fixes of the paper, and a start that leaves the room out.
    Baseline,
    /// The paper to the letter, as far as its words say one thing; [`super::deviations`] lists what they do not.
    Paper,
    /// What fits walkers of another simulator than this program's best; `study switches` tells by how much each switch helps.
    #[default]
    Recommended,
}

/// What the baseline was called when every command took it.
const FORMER_NAME: &str = "default";

impl Preset {
    /// Every preset.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Paper, Self::Recommended];

    /// The word on the command line and the screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Paper => "paper",
            Self::Recommended => "recommended",
        }
    }

    /// Words of earlier versions that are understood, too.
    pub fn former_names(self) -> &'static [&'static str] {
        if self == Self::Baseline { &[FORMER_NAME] } else { &[] }
    }

    /// The preset with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name || preset.former_names().contains(&name))
    }

    /// The preset of which the fewest settings are set otherwise.
    pub fn nearest(config: &FitConfig) -> Self {
        Self::ALL.into_iter().min_by_key(|preset| preset.config().changes(config).count()).unwrap_or_default()
    }

    /// What it is, in a few words.
    pub fn brief(self) -> &'static str {
        match self {
            Self::Baseline => "the paper's fit, the room left out",
            Self::Paper => "the paper to the letter",
            Self::Recommended => "people counted, frames fitted together",
        }
    }

    /// What it is, in a line.
    pub fn help(self) -> &'static str {
        match self {
            Self::Baseline => "The paper's fit within 1.25 m of the person, from a start that leaves the room out",
            Self::Paper => "The paper to the letter: the whole map, the strongest cluster of peaks, one frame alone",
            Self::Recommended => {
                "As many people as are counted, in windows of frames fitted at once: levels instead of masks, skin, poses that real people have, and what lies beside a person; whom no body explains is where they were seen last, or a network expects them"
            }
        }
    }

    /// Its settings.
    pub fn config(self) -> FitConfig {
        match self {
            Self::Baseline => FitConfig::default(),
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
                objective: EmLoss::NccDb,
                body: BodyModel::Skin,
                clutter: Clutter::Modelled,
                static_echo: StaticEcho::Fitted,
                dynamic_range_db: 40.0,
                range_offset: RangeOffset::Measured,
                sidelobes: Sidelobes::Removed,
                parameterization: Parameterization::Motion,
                // What a body can do is what the prior says.
                w_kine: 0.0,
                w_prior: 8e-3,
                w_net: 2e-3,
                w_given: 1.6e-3,
                decode_frames: 12,
                scatterers: Scatterers::BodyParts,
                place: StartPlace::Counted,
                yaw: Yaw::Motion,
                height: Height::Floor,
                summation: Summation::Incoherent,
                em_region: EmRegion::HalfWidth(1.0),
                surface_offset_m: 0.04,
                starts: 17,
                people: 0,
                // A search has been there before, among fewer components: sixty steps end 0.4 mm nearer of simulated walkers, and no
                // nearer of another simulator's; twenty end 2 mm farther away.
                iterations: 40,
                // How bright and how wide each part is differs from person to person; points of skin have areas.
                learning_rates: LearningRates {
                    beta: Some(0.0),
                    log_scale: Some(0.0),
                    rotation: Some(0.0),
                    ..LearningRates::default()
                },
                ..FitConfig::default()
            },
        }
    }
}
