//! From the measures of a mode to the probability that the mode is there.
//!
//! What a mode's file measures has units of its own: shares, log odds, decibels. A [`Curve`] makes a probability of them,
//!
//! ```text
//! z = b + Σ_k w_k (x_k − mean_k)/scale_k,  w_k ≥ 0,      score = 1/(1 + e^(−z)), or the step of an isotonic curve at z
//! ```
//!
//! so that a score rises with each measure and 0.5 means even odds. Beyond the values that were learned from (their 0.5 and
//! 99.5 % quantiles) a measure counts as the last of them: what is unlike all that was seen must not be claimed the more for
//! it. The curves are fitted to simulated frames of known modes (`train-evidence`) and committed in `assets/evidence.json`,
//! with what they reach on frames of other seeds.
//!
//! **The odds are those of a data set in which a mode has the share `prior` of the frames** ([`Curve::prior`]). Where
//! another share π is expected, [`with_share`] tells what a score means there:
//! odds(score) · (π/(1 − π)) / (prior/(1 − prior)).

use super::Measure;
use crate::labels::Tag;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// What the file says that it is.
const FORMAT: &str = "mhp-evidence";
/// The version that is written, and the only one that is read.
const VERSION: u32 = 1;
/// Each curve of the table: its mode, and the measures that it reads. Of a mode's curves the first whose measures are known
/// is used.
pub(super) const CURVES: [(Tag, &[&str]); 7] = [
    (Tag::F1, &["persistence", "static_level"]),
    (Tag::F2, &["nearness"]),
    (Tag::F3, &["close_pair"]),
    (Tag::F3, &["close_pair_coarse"]),
    (Tag::F4, &["quiet", "steadiness"]),
    (Tag::F4, &["quiet_pair", "steadiness_pair"]),
    (Tag::F4, &["slowness"]),
];
/// A mode is called hard to tell where a frame with it has a higher score than one without in less than this share of pairs.
const TELLING_AUC: f64 = 0.7;

/// Why a table cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// No JSON, or other keys than the format has.
    #[error("{message}")]
    Json {
        /// What the parser says, with line and column.
        message: String,
    },
    /// Another file, or one of another version.
    #[error("format is `{format}`, version {version}; expected `{FORMAT}`, version {VERSION}")]
    Format {
        /// As found.
        format: String,
        /// As found.
        version: u32,
    },
    /// A curve that is missing, or one too many.
    #[error("curves are {found}; expected {expected}")]
    Curves {
        /// As found.
        found: String,
        /// As they should be.
        expected: String,
    },
    /// A number that makes no sense.
    #[error("{curve}: {key} is {value}; expected {expected}")]
    Number {
        /// Mode and measures.
        curve: String,
        /// Which.
        key: &'static str,
        /// As found.
        value: String,
        /// What would do.
        expected: &'static str,
    },
}

/// The table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// `mhp-evidence`.
    pub format: String,
    /// 1.
    pub version: u32,
    /// The command that made it.
    pub command: String,
    /// Frames that were learned from and tested on.
    pub sets: Vec<FrameSet>,
    /// One a mode, or one a way to measure it.
    pub curves: Vec<Curve>,
}

/// Simulated frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameSet {
    /// `learned` or `held out`.
    pub role: String,
    /// Seeds of the recordings.
    pub seeds: Vec<u64>,
    /// Sequences a preset, layout and seed.
    pub sequences: usize,
    /// Judged frames, one a sequence.
    pub frames: usize,
    /// Fits of these frames that were judged.
    pub fits: usize,
}

/// Measures to probability.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// The mode.
    pub mode: Tag,
    /// Share of the frames learned from that have the mode, to which the odds refer; 0..1.
    pub prior: f64,
    /// What is read.
    pub inputs: Vec<Input>,
    /// b.
    pub bias: f64,
    /// Isotonic curve: (lowest z, probability), both rising; empty for a logistic one.
    pub steps: Vec<[f64; 2]>,
    /// Log loss of the logistic and of the isotonic curve on learned seeds, each left out in turn; the lower one is used.
    pub log_loss_left_out: [f64; 2],
    /// On held-out seeds: what the uncalibrated score says.
    pub before: Figures,
    /// On held-out seeds: what this curve says.
    pub after: Figures,
}

/// One measure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Name of the measure.
    pub name: String,
    /// Subtracted.
    pub mean: f64,
    /// Then divided by; above 0.
    pub scale: f64,
    /// Values beyond these count as these.
    pub range: [f64; 2],
    /// w, 0 or more.
    pub weight: f64,
}

/// How good probabilities are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// Judged fits that have the mode, and that have not.
    pub counts: [usize; 2],
    /// Share of pairs, one with the mode and one without, in which the former has the higher score; ties count half.
    pub auc: f64,
    /// Mean squared deviation from 1 or 0.
    pub brier: f64,
    /// Mean −ln of the probability of what is true; probabilities are held within 1e-3..1 − 1e-3.
    pub log_loss: f64,
    /// Share of the frames with the mode that score above 0.5.
    pub hits: f64,
    /// Share of those without it.
    pub false_alarms: f64,
}

/// What a score with odds of the share `prior` is where the mode has the share `share` of the frames.
pub fn with_share(score: f64, prior: f64, share: f64) -> f64 {
    let (for_it, against) = (score * share * (1.0 - prior), (1.0 - score) * (1.0 - share) * prior);
    let sum = for_it + against;
    if sum > 0.0 { for_it / sum } else { share }
}

impl Calibration {
    /// A table of the version that is written.
    #[cfg(feature = "train")]
    pub fn new(command: String, sets: Vec<FrameSet>, curves: Vec<Curve>) -> Self {
        Self { format: FORMAT.to_owned(), version: VERSION, command, sets, curves }
    }

    /// The table that comes with the program; `None` where it is damaged.
    pub fn bundled() -> Option<&'static Self> {
        static READ: OnceLock<Option<Calibration>> = OnceLock::new();
        let read = || Self::from_json(include_str!("../../../assets/evidence.json"));
        READ.get_or_init(|| read().inspect_err(|error| tracing::error!("assets/evidence.json: {error}")).ok()).as_ref()
    }

    /// Reads a table and checks all of it.
    ///
    /// # Errors
    /// Where it is of another format, lacks a curve or a key, has one too many, or has a number that makes no sense.
    pub fn from_json(text: &str) -> Result<Self, CalibrationError> {
        let table: Self =
            serde_json::from_str(text).map_err(|error| CalibrationError::Json { message: error.to_string() })?;
        if table.format != FORMAT || table.version != VERSION {
            return Err(CalibrationError::Format { format: table.format, version: table.version });
        }
        let names = |curve: &Curve| curve.inputs.iter().map(|input| input.name.clone()).collect::<Vec<_>>();
        let found: Vec<String> = table.curves.iter().map(|curve| titled(curve.mode, &names(curve))).collect();
        let expected = CURVES.map(|(mode, inputs)| titled(mode, inputs));
        if found != expected {
            return Err(CalibrationError::Curves { found: found.join(", "), expected: expected.join(", ") });
        }
        table.curves.iter().zip(found).try_for_each(|(curve, title)| curve.check(&title))?;
        Ok(table)
    }

    /// The curve for what is known of a mode.
    pub fn curve(&self, mode: Tag, measures: &[Measure]) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.mode == mode && curve.z(measures).is_some())
    }
}

/// `F3 (several, overlap)`.
fn titled<S: AsRef<str>>(mode: Tag, inputs: &[S]) -> String {
    format!("{mode} ({})", inputs.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(", "))
}

impl Curve {
    fn check(&self, curve: &str) -> Result<(), CalibrationError> {
        let wrong = |key, value: String, expected| {
            Err(CalibrationError::Number { curve: curve.to_owned(), key, value, expected })
        };
        if !(self.prior > 0.0 && self.prior < 1.0) {
            return wrong("prior", self.prior.to_string(), "a share between 0 and 1");
        }
        if !self.bias.is_finite() {
            return wrong("bias", self.bias.to_string(), "a finite number");
        }
        for input in &self.inputs {
            let [lo, hi] = input.range;
            if !(input.weight >= 0.0 && input.weight.is_finite()) {
                return wrong("weight", input.weight.to_string(), "0 or more");
            }
            if !(input.scale > 0.0 && input.scale.is_finite() && input.mean.is_finite()) {
                return wrong("scale", input.scale.to_string(), "a finite mean, and a scale above 0");
            }
            if !(lo <= hi && lo.is_finite() && hi.is_finite()) {
                return wrong("range", format!("{lo} to {hi}"), "two finite numbers that rise");
            }
        }
        let rising = self.steps.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] <= pair[1][1]);
        let probable = self.steps.iter().all(|[z, p]| z.is_finite() && (0.0..=1.0).contains(p));
        if !(rising && probable) {
            return wrong("steps", format!("{:?}", self.steps), "rising z, and probabilities that do not fall");
        }
        Ok(())
    }

    /// b + Σ w x; `None` where a measure is not known.
    fn z(&self, measures: &[Measure]) -> Option<f64> {
        let term = |input: &Input| {
            let x = measures.iter().find(|measure| measure.name == input.name)?.value;
            (!x.is_nan()).then(|| input.weight * (x.clamp(input.range[0], input.range[1]) - input.mean) / input.scale)
        };
        self.inputs.iter().map(term).sum::<Option<f64>>().map(|sum| self.bias + sum)
    }

    /// The probability of the mode; `None` where a measure is not known.
    pub fn probability(&self, measures: &[Measure]) -> Option<f64> {
        self.z(measures).map(|z| self.at(z))
    }

    pub(super) fn at(&self, z: f64) -> f64 {
        match self.steps.first() {
            None => 1.0 / (1.0 + (-z).exp()),
            Some(first) => self.steps.iter().rev().find(|step| step[0] <= z).unwrap_or(first)[1],
        }
    }

    /// What a score of this curve is worth, for people.
    pub fn told(&self) -> String {
        let Figures { auc, hits, false_alarms, .. } = self.after;
        let percent = |share: f64| super::number_text::percent(share);
        let worth = if auc < TELLING_AUC {
            "hardly told from frames without it, so that the score claims little and stays near that share"
        } else {
            "told apart"
        };
        format!(
            "0.5 is even odds where {} of the frames have the mode. On simulated frames that were not learned from it is \
             {worth}: AUC {auc:.2}; above 0.5 are {} of the frames with it and {} of those without.",
            percent(self.prior),
            percent(hits),
            percent(false_alarms)
        )
    }
}
