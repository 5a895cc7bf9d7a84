//! `FitConfig`: every setting that steers a fit, with its default, range and explanation.
//!
//! [`FIELDS`] is the only table of them: the *Fit* pane, tooltips, the words for a change ([`difference`]), new starts, the study
//! `switches`, sweeps, the list under `--help` and the errors of `FIT.toml` read it. The default is what SPEC fixes of the paper;
//! [`Preset`] names it, the paper to the letter and the recommended setting, and [`deviations`] tells how they differ and why.

mod answers;
pub mod deviations;
mod difference;
mod error;
mod field;
mod fields;
mod init;
mod preset;
mod reading;
mod rows;
#[cfg(any(test, feature = "samples"))]
pub mod samples;
#[cfg(test)]
mod tests;

pub use difference::{difference, from_preset, listing};
pub use error::ConfigError;
pub use field::{Answer, Field, FieldGroup, FieldKind, Number, ReadBy, Unset, Value};
pub use fields::FIELDS;
pub use init::{Height, InitConfig, LearningRates, Parameterization, Scatterers, StartPlace, Yaw};
pub use preset::Preset;
pub use reading::{Background, Convergence, FramesAround, GradientVelocity, Still, WarmStart};

use crate::input::{MOST_TEXT, read_text};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How the joints' returns are combined; SPEC section 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Summation {
    /// |Σ A K e^{iψ}|.
    #[default]
    Coherent,
    /// √Σ (A K)².
    Incoherent,
}

/// The shape of the point spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LobeShape {
    /// The Gaussian of SPEC section 3.
    #[default]
    Gaussian,
    /// The main lobe of each FFT's window, down to its first minimum.
    Window,
}

/// What the ranges of a map have too much.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RangeOffset {
    /// What the manifest states, `range_offset_m` of a view's point spread; 0 where it states none.
    #[default]
    Stated,
    /// Besides what the maps tell: the ranges at which the views of one place see the same echoes.
    Measured,
}

/// What is done with the sidelobes of FFTs that no window tapers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sidelobes {
    /// They are part of the map, as any echo.
    #[default]
    Kept,
    /// Their mean power is taken from the map, as far as they are there; only where a view's FFTs are known.
    Removed,
}

/// How L_EM compares the simulated map with the measured one; SPEC sections 4 and 8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EmLoss {
    /// One minus the soft IoU of their masks: the paper.
    #[default]
    Iou,
    /// One minus the correlation of their levels, dB.
    NccDb,
    /// The divergence of the measured from the simulated power that is likeliest under speckle (Itakura–Saito).
    Gamma,
}

/// What the forward model takes for the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyModel {
    /// The Gaussians of the joints: the paper.
    #[default]
    Joints,
    /// Points of the skin that faces the radar, between the joints.
    Skin,
}

/// What is known of echoes that are not the person's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clutter {
    /// Noise, as strong in every cell: SPEC section 8.
    #[default]
    None,
    /// What is lit beside the person at each range; in a window also what does not change over time, but for the trunk of who stands.
    Modelled,
}

/// How bright a joint is that stands still.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StaticEcho {
    /// As bright as one that moves: the paper.
    #[default]
    Kept,
    /// As bright as the removal of static echoes leaves it, which is fitted.
    Fitted,
}

/// Where the electromagnetic term is evaluated; SPEC section 4. A view's own `region` wins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EmRegion {
    /// The whole map.
    Full,
    /// A box of this half width, m, around the persons.
    HalfWidth(f64),
}

impl Default for EmRegion {
    fn default() -> Self {
        Self::HalfWidth(1.25)
    }
}

/// A dynamic range beyond any noise, dB: all levels are told apart.
const WHOLE_RANGE_DB: f64 = 200.0;
/// What `FIT.toml` holds of an EM region.
const EM_REGION_FORM: &str = "\"full\" or { half_width_m = METRES } with METRES > 0";

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum EmRegionText {
    Word(String),
    Table { half_width_m: f64 },
}

impl Serialize for EmRegion {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            Self::Full => EmRegionText::Word("full".into()),
            Self::HalfWidth(half_width_m) => EmRegionText::Table { half_width_m },
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for EmRegion {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        match EmRegionText::deserialize(deserializer) {
            Ok(EmRegionText::Word(word)) if word == "full" => Ok(Self::Full),
            Ok(EmRegionText::Table { half_width_m }) if half_width_m > 0.0 && half_width_m.is_finite() => {
                Ok(Self::HalfWidth(half_width_m))
            }
            _ => Err(D::Error::custom(format!("em_region must be {EM_REGION_FORM}"))),
        }
    }
}

/// The four operators of the paper's equation for H_sim; an operator that is off contributes factor 1 and phase 0, and
/// its axis sees the joint at zero frequency (SPEC section 3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Operators {
    /// (r_max/d)⁴.
    pub attenuation: bool,
    /// Beat-frequency phase and the range axis.
    pub range: bool,
    /// Doppler phase, the phase ramp and the Doppler axis.
    pub doppler: bool,
    /// Array phase and the angular axes.
    pub angle: bool,
}

impl Default for Operators {
    fn default() -> Self {
        Self { attenuation: true, range: true, doppler: true, angle: true }
    }
}

/// Every setting of a fit; the keys of `FIT.toml` (SPEC section 7).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitConfig {
    /// Weight of L_EM.
    pub w_em: f64,
    /// Weight of the kinematic terms.
    pub w_kine: f64,
    /// What L_EM compares.
    pub objective: EmLoss,
    /// What returns an echo.
    pub body: BodyModel,
    /// What levels know of echoes that are not the person's.
    pub clutter: Clutter,
    /// How bright a joint is that stands still.
    pub static_echo: StaticEcho,
    /// How far below the brightest cell of a region `ncc_db` compares levels, dB (`mhp/levels.rs`).
    pub dynamic_range_db: f64,
    /// Share of cells in a mask, percent.
    pub tau_pct: f64,
    /// Temperature T of the soft mask.
    pub softness: f64,
    /// Largest joint angle, degrees.
    pub theta_max_deg: f64,
    /// Smallest distance of two persons' centroids, m.
    pub d_sep_m: f64,
    /// Smallest distance of two persons' joints, m.
    pub d_joint_m: f64,
    /// Coherent or incoherent sum.
    pub summation: Summation,
    /// Gaussian or the window's own lobe; the latter where joints are summed coherently and the view's FFTs are known.
    pub lobe: LobeShape,
    /// Range offsets as stated, or measured in the maps.
    pub range_offset: RangeOffset,
    /// Sidelobes of FFTs without a window, kept or removed.
    pub sidelobes: Sidelobes,
    /// Where L_EM is evaluated.
    pub em_region: EmRegion,
    /// How far in front of the joint its echo comes from, m.
    pub surface_offset_m: f64,
    /// Largest standard deviation that a step may grow a Gaussian to, m.
    pub scale_max_m: f64,
    /// Iterations of a run.
    pub iterations: usize,
    /// Adam's learning rate.
    pub learning_rate: f64,
    /// Stop the run as soon as the convergence criterion holds.
    pub stop_when_converged: bool,
    /// When five iterations count as no more progress.
    pub convergence: Convergence,
    /// How far a bone may be from its reference length at no cost, m.
    pub bone_tolerance_m: f64,
    /// What Adam moves: every joint by itself, or a root and the bones' directions.
    pub parameterization: Parameterization,
    /// What the start's Gaussians look like.
    pub scatterers: Scatterers,
    /// What tells where the start of one person stands.
    pub place: StartPlace,
    /// Where the start looks.
    pub yaw: Yaw,
    /// Persons that are fitted; 0: as many as are counted.
    pub people: usize,
    /// Which frames beside its own a start may look at.
    pub frames_around: FramesAround,
    /// Where a warm start begins.
    pub warm_start: WarmStart,
    /// Start poses that are tried.
    pub starts: usize,
    /// Weight of the temporal term.
    pub w_time: f64,
    /// Weight of the prior of motion.
    pub w_prior: f64,
    /// Weight of what a network expects.
    pub w_net: f64,
    /// Weight of joints that were given.
    pub w_given: f64,
    /// Frames that are fitted together in a space of motion.
    pub window: usize,
    /// Frames on each side whose hypotheses decide with this frame's which is fitted, and whose bodies are tried in it; 0: a frame
    /// decides by itself.
    pub decode_frames: usize,
    /// Weight of a term that only tests know.
    #[cfg(any(test, feature = "dummies"))]
    pub w_dummy: f64,
    /// What tells how high a start stands.
    pub height: Height,
    /// The four operators.
    pub operators: Operators,
    /// Step sizes of single groups.
    pub learning_rates: LearningRates,
    /// How a start is found, and perturbed on purpose.
    pub init: InitConfig,
}

impl Default for FitConfig {
    fn default() -> Self {
        Self {
            w_em: 0.5,
            w_kine: 0.5,
            objective: EmLoss::default(),
            body: BodyModel::default(),
            clutter: Clutter::default(),
            static_echo: StaticEcho::default(),
            dynamic_range_db: WHOLE_RANGE_DB,
            tau_pct: 10.0,
            softness: 0.5,
            theta_max_deg: 170.0,
            d_sep_m: 0.5,
            d_joint_m: 0.1,
            summation: Summation::default(),
            lobe: LobeShape::default(),
            range_offset: RangeOffset::default(),
            sidelobes: Sidelobes::default(),
            em_region: EmRegion::default(),
            surface_offset_m: 0.0,
            scale_max_m: 0.43,
            iterations: 100,
            learning_rate: 1e-3,
            stop_when_converged: false,
            convergence: Convergence::default(),
            bone_tolerance_m: 0.0,
            parameterization: Parameterization::default(),
            scatterers: Scatterers::default(),
            place: StartPlace::default(),
            yaw: Yaw::default(),
            people: 1,
            frames_around: FramesAround::default(),
            warm_start: WarmStart::default(),
            starts: 1,
            w_time: 0.0,
            w_prior: 0.0,
            w_net: 0.0,
            w_given: 0.0,
            window: 5,
            decode_frames: 0,
            #[cfg(any(test, feature = "dummies"))]
            w_dummy: 0.0,
            height: Height::default(),
            operators: Operators::default(),
            learning_rates: LearningRates::default(),
            init: InitConfig::default(),
        }
    }
}

impl FitConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// Names the first key that is out of range or not finite.
    pub fn validated(self) -> Result<Self, ConfigError> {
        FIELDS.iter().try_for_each(|field| field.check(field.get(&self)))?;
        Ok(self)
    }

    /// The settings that another configuration sets otherwise, in the order they are shown.
    pub fn changes<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = &'static Field> + 'a {
        FIELDS.iter().filter(|field| field.get(self) != field.get(other))
    }

    /// Whether all settings but those that `left_out` takes are the same.
    pub fn same_but(&self, other: &Self, left_out: impl Fn(ReadBy) -> bool) -> bool {
        self.changes(other).all(|field| left_out(field.read_by))
    }

    /// Reads `FIT.toml`; missing keys take their defaults.
    ///
    /// # Errors
    /// Where the file cannot be read, is not TOML, has an unknown key (named, with its line), or a number out of range.
    pub fn from_file(path: &Path) -> Result<Self, ConfigError> {
        let text = read_text(path, "a fit configuration (TOML)", MOST_TEXT)
            .map_err(|reason| ConfigError::Read { reason, path: path.to_owned() })?;
        Self::parse(&text, path)
    }

    /// Reads the text of a `FIT.toml`; `path` is for messages.
    ///
    /// # Errors
    /// As [`Self::from_file`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        error::parse(text, path)
    }

    /// The configuration as `FIT.toml`.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }
}
