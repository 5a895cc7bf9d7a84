//! `FitConfig`: every number that steers a fit, with its default, range and explanation.
//!
//! This is the only source: the command line, the sliders, their tooltips and `FIT.toml` all read [`FIELDS`] and [`CHOICES`]. The
//! default is what SPEC fixes of the paper; [`Preset`] names it, the paper to the letter and the recommended setting, and
//! [`deviations`] tells how they differ and why.

mod choices;
pub mod deviations;
mod fields;
mod init;
mod preset;
mod reading;

pub use choices::{Answer, CHOICES, Choice, ChoiceGroup};
pub use fields::{FIELDS, Field, FieldGroup};
pub use init::{Height, InitConfig, LearningRates, Limbs, Parameterization, Place, Scatterers, Yaw};
pub use preset::Preset;
pub use reading::{Background, Convergence, FramesAround, GradientVelocity, Still, WarmStart};

use crate::input::{MOST_TEXT, place, read_text};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

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
            _ => Err(D::Error::custom("em_region must be \"full\" or { half_width_m = METRES } with METRES > 0")),
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
    pub place: Place,
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
    /// Weight of a term that only tests know.
    #[cfg(test)]
    pub w_dummy: f64,
    /// What tells how high a start stands.
    pub height: Height,
    /// What tells where the limbs of a start are.
    pub limbs: Limbs,
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
            tau_pct: 10.0,
            softness: 0.5,
            theta_max_deg: 170.0,
            d_sep_m: 0.5,
            d_joint_m: 0.1,
            summation: Summation::default(),
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
            place: Place::default(),
            yaw: Yaw::default(),
            people: 1,
            frames_around: FramesAround::default(),
            warm_start: WarmStart::default(),
            starts: 1,
            w_time: 0.0,
            #[cfg(test)]
            w_dummy: 0.0,
            height: Height::default(),
            limbs: Limbs::default(),
            operators: Operators::default(),
            learning_rates: LearningRates::default(),
            init: InitConfig::default(),
        }
    }
}

/// What is wrong with a configuration.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A number is outside its range.
    #[error("{key} is {value}; expected a number in {lo} ..= {hi}", value = plainly(*value))]
    OutOfRange {
        /// The key.
        key: &'static str,
        /// What was given.
        value: f64,
        /// Smallest accepted.
        lo: f64,
        /// Largest accepted.
        hi: f64,
    },
    /// A file that is not TOML, has a wrong key or a wrong value.
    #[error("{place}: {message}", place = place(path, *line))]
    Invalid {
        /// What is wrong, naming the key.
        message: String,
        /// The line, counted from 1, where one can be named.
        line: Option<usize>,
        /// The file.
        path: PathBuf,
    },
    /// The file could not be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
}

impl FitConfig {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// Names the first key that is out of range or not finite.
    pub fn validated(self) -> Result<Self, ConfigError> {
        for field in FIELDS {
            let (value, (lo, hi)) = ((field.get)(&self), field.range);
            if !(lo..=hi).contains(&value) {
                return Err(ConfigError::OutOfRange { key: field.key, value, lo, hi });
            }
        }
        for (key, value) in self.learning_rates.given() {
            if !(0.0..=1.0).contains(&value) {
                return Err(ConfigError::OutOfRange { key, value, lo: 0.0, hi: 1.0 });
            }
        }
        Ok(self)
    }

    /// Whether a start is found in the same way, as far as switches decide; a slider that is moved asks for no new start.
    pub fn starts_as(&self, other: &Self) -> bool {
        let switches =
            |c: &Self| (c.scatterers, c.place, c.yaw, c.people, c.starts, c.height, c.limbs, c.frames_around);
        switches(self) == switches(other) && self.init == other.init
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
        let invalid = |message: String, at: Option<usize>| ConfigError::Invalid {
            message,
            line: at.map(|at| 1 + text.bytes().take(at).filter(|&byte| byte == b'\n').count()),
            path: path.to_owned(),
        };
        let parsed = toml::from_str::<Self>(text)
            .map_err(|error| invalid(in_our_words(error.message()), error.span().map(|span| span.start)))?;
        parsed.validated().map_err(|error| {
            let ConfigError::OutOfRange { key, .. } = error else { return error };
            invalid(error.to_string(), offset_of(text, key))
        })
    }

    /// The configuration as `FIT.toml`.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }
}

/// A number as somebody would write it: not with three hundred zeros.
fn plainly(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-6..1e15).contains(&size) { format!("{value:e}") } else { value.to_string() }
}

/// `unknown field` is the parser's word; a configuration has keys.
fn in_our_words(message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    match message.strip_prefix("unknown field ") {
        Some(rest) => format!("unknown key {}", rest.replacen(", expected", "; expected", 1)),
        None => message,
    }
}

/// Where the line begins that sets a key of the top table.
fn offset_of(text: &str, key: &str) -> Option<usize> {
    let mut at = 0;
    text.split_inclusive('\n').find_map(|line| {
        let here = at;
        at += line.len();
        let rest = line.trim_start().strip_prefix(key.rsplit('.').next().unwrap_or(key))?;
        rest.trim_start().starts_with('=').then_some(here)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        FitConfig::parse(text, Path::new("fit.toml")).err().map_or_else(|| "accepted".into(), |e| e.to_string())
    }

    #[test]
    fn what_is_written_reads_back() {
        let full = FitConfig {
            em_region: EmRegion::Full,
            summation: Summation::Incoherent,
            learning_rate: 3e-3,
            operators: Operators { range: false, ..Operators::default() },
            stop_when_converged: true,
            ..FitConfig::default()
        };
        for config in [FitConfig::default(), full] {
            let text = config.to_toml();
            assert_eq!(FitConfig::parse(&text, Path::new("fit.toml")).ok(), Some(config), "{text}");
        }
    }

    #[test]
    fn a_wrong_key_or_value_names_file_line_key_and_expectation() {
        let text = refusal("w_em = 1\nw_kin = 2\n");
        assert!(text.starts_with("fit.toml:2: unknown key `w_kin`; expected one of `w_em`, `w_kine`"), "{text}");
        assert_eq!(refusal("\ntau_pct = 101\n"), "fit.toml:2: tau_pct is 101; expected a number in 0.1 ..= 100");
        let text = refusal("iterations = -1");
        assert!(text.starts_with("fit.toml:1: ") && !text.contains('\n'), "{text}");
        let text = refusal("em_region = \"half\"");
        assert!(text.starts_with("fit.toml:1: em_region must be \"full\" or"), "{text}");
        let text = refusal("[operators]\nrang = true");
        assert!(text.starts_with("fit.toml:2: unknown key `rang`; expected one of `attenuation`"), "{text}");
        assert!(refusal("w_em = ").starts_with("fit.toml:1: "));
        assert!(refusal("softness = nan").starts_with("fit.toml:1: softness is NaN; expected"));
    }
}
