//! How people move, as motion capture of real people has taught.
//!
//! A window is a few poses in a row, seen from the person: the origin is the middle of the hips at the middle sample, +x is
//! where the person faces then, +y its left, z is up, and all is divided by the size of the body. What such windows have in
//! common is learned from recorded motion (`train-motion`) and committed in `assets/motion.json`: their mean, the
//! principal components about it, a mixture that says how likely their coefficients are, and the middles of clusters, from
//! which a search may start. Joints have names, so that the same prior serves every skeleton that has some of them. `assets/motion.md` says from which recordings it comes,
//! what it covers and what it does not.

#[cfg(feature = "train")]
mod clusters;
#[cfg(feature = "train")]
mod learn_mixture;
mod mixture;
#[cfg(feature = "train")]
mod train;

pub use mixture::Mixture;

#[cfg(feature = "train")]
pub use train::{MOTION_COUNTS, MOTION_JOINTS, MotionClip, MotionCoverage, learn_motion, motion_coverage};

use mixture::MixtureComponent;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Numbers of a prior at most: times × joints × 3 of each component.
const MAX_NUMBERS: usize = 1 << 20;

/// Windows of poses as a mean and components: joints = size · (mean + Σ coefficient · component).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionPrior {
    /// How it came about, and what it reaches.
    header: Vec<String>,
    /// When the poses of a window are, from its middle, s.
    times_s: Vec<f64>,
    /// Names of the joints.
    joints: Vec<String>,
    /// Mean and standard deviation over people of ln of the size, m.
    ln_size: [f64; 2],
    /// (times, joints, 3), last axis fastest, in sizes.
    mean: Vec<f64>,
    /// (components, times × joints × 3), each as long as its standard deviation, in sizes; the largest first.
    components: Vec<Vec<f64>>,
    /// From where a search may start, the most frequent first.
    starts: Vec<MotionStart>,
    /// How likely the first coefficients are; empty: each is normal, as the others are.
    mixture: Vec<MixtureComponent>,
    /// The same, when first asked for.
    #[serde(skip)]
    likelihood: OnceLock<Mixture>,
    /// What becomes of each component where left and right are exchanged, when first asked for.
    #[serde(skip)]
    signs: OnceLock<Vec<f64>>,
}

/// The middle of a cluster of windows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionStart {
    /// The share of the windows that it stands for.
    pub share: f64,
    /// How high the middle of the hips is above the floor at the middle sample, in sizes.
    pub hip_height: f64,
    /// One a component, in standard deviations.
    pub coefficients: Vec<f64>,
}

impl MotionPrior {
    /// The prior that comes with the program; `None` where it is damaged.
    pub fn committed() -> Option<&'static Self> {
        static READ: OnceLock<Option<MotionPrior>> = OnceLock::new();
        let read = || Self::from_json(include_str!("../../../../assets/motion.json"));
        READ.get_or_init(|| read().inspect_err(|error| tracing::error!("assets/motion.json: {error}")).ok()).as_ref()
    }

    /// Reads a prior, and checks that its parts fit together.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn from_json(text: &str) -> Result<Self, String> {
        let prior: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        prior.fault().map_or(Ok(prior), Err)
    }

    /// Writes it: a line a list, so that a difference can be read.
    ///
    /// # Errors
    /// What is wrong with it, in words, as in [`Self::from_json`].
    pub fn to_json(&self) -> Result<String, String> {
        if let Some(fault) = self.fault() {
            return Err(fault);
        }
        let text = || {
            Ok::<_, serde_json::Error>(format!(
                "{{\"header\":[{}],\n\"times_s\":{},\n\"joints\":{},\n\"ln_size\":{},\n\"mean\":{},\n\"components\":[{}],\n\"starts\":[{}],\n\"mixture\":[{}]}}\n",
                lines(&self.header)?,
                serde_json::to_string(&self.times_s)?,
                serde_json::to_string(&self.joints)?,
                serde_json::to_string(&self.ln_size)?,
                serde_json::to_string(&self.mean)?,
                lines(&self.components)?,
                lines(&self.starts)?,
                lines(&self.mixture)?
            ))
        };
        text().map_err(|error| error.to_string())
    }

    /// 1 or −1 for each component: what becomes of it where left and right are exchanged.
    pub fn mirror_signs(&self) -> &[f64] {
        self.signs.get_or_init(|| self.components.iter().map(|component| self.mirror_sign(component)).collect())
    }

    fn mirror_sign(&self, component: &[f64]) -> f64 {
        let other = |name: &str| match (name.strip_prefix("left_"), name.strip_prefix("right_")) {
            (Some(rest), _) => self.joint(&format!("right_{rest}")),
            (_, Some(rest)) => self.joint(&format!("left_{rest}")),
            _ => None,
        };
        let there: Vec<usize> = self.joints.iter().enumerate().map(|(own, name)| other(name).unwrap_or(own)).collect();
        let mut sum = 0.0;
        for window in component.chunks_exact(3 * there.len()) {
            for (own, &there) in there.iter().enumerate() {
                let (a, b) = (&window[3 * own..3 * own + 3], &window[3 * there..3 * there + 3]);
                sum += a[0] * b[0] - a[1] * b[1] + a[2] * b[2];
            }
        }
        if sum < 0.0 { -1.0 } else { 1.0 }
    }

    /// What does not fit; `None` if all does.
    fn fault(&self) -> Option<String> {
        let [times, joints, components] = [self.times_s.len(), self.joints.len(), self.components.len()];
        let numbers = times.saturating_mul(joints).saturating_mul(3);
        if times == 0 || joints == 0 || components == 0 || numbers.saturating_mul(components) > MAX_NUMBERS {
            return Some(format!(
                "{times} times, {joints} joints, {components} components; expected at least one of each, and at most {MAX_NUMBERS} numbers"
            ));
        }
        if let Some(twice) = (1..joints).find(|&i| self.joints[..i].contains(&self.joints[i])) {
            return Some(format!("joint `{}` is listed twice", self.joints[twice]));
        }
        if !self.times_s.is_sorted_by(|a, b| a < b) {
            return Some("`times_s`: expected each time after the one before".into());
        }
        let lengths = std::iter::once(("mean", self.mean.len(), numbers))
            .chain(self.components.iter().map(|component| ("components", component.len(), numbers)))
            .chain(self.starts.iter().map(|start| ("coefficients", start.coefficients.len(), components)));
        if let Some((key, found, expected)) = lengths.into_iter().find(|(_, found, expected)| found != expected) {
            return Some(format!("`{key}` has {found} numbers; expected {expected}"));
        }
        let of_starts = self
            .starts
            .iter()
            .flat_map(|start| [start.share, start.hip_height].into_iter().chain(start.coefficients.iter().copied()));
        let lists = [&self.times_s, &self.mean].into_iter().chain(&self.components).flatten().copied();
        if !lists.chain(self.ln_size).chain(of_starts).all(f64::is_finite) {
            return Some("expected finite numbers".into());
        }
        if self.ln_size[1] <= 0.0 {
            return Some(format!("`ln_size` has the standard deviation {}; expected one above 0", self.ln_size[1]));
        }
        let bad = self.starts.iter().find(|start| !(0.0..=1.0).contains(&start.share));
        bad.map(|start| format!("`share` is {}; expected 0 to 1", start.share))
            .or_else(|| mixture::fault(&self.mixture, components))
    }

    /// How it came about, and what it reaches.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// The same prior with another header.
    pub fn with_header(self, header: Vec<String>) -> Self {
        Self { header, ..self }
    }

    /// When the poses of a window are, from its middle, s.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Names of the joints.
    pub fn joints(&self) -> &[String] {
        &self.joints
    }

    /// The place of a joint in a pose.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint == name)
    }

    /// Mean and standard deviation over people of ln of the size, m.
    pub fn ln_size(&self) -> [f64; 2] {
        self.ln_size
    }

    /// (times, joints, 3), last axis fastest, in sizes.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Each (times, joints, 3) and as long as its standard deviation, in sizes; the largest first.
    pub fn components(&self) -> &[Vec<f64>] {
        &self.components
    }

    /// How likely the first coefficients are.
    pub fn mixture(&self) -> &Mixture {
        self.likelihood.get_or_init(|| Mixture::new(&self.mixture, self.mirror_signs()))
    }

    /// From where a search may start, the most frequent first.
    pub fn starts(&self) -> &[MotionStart] {
        &self.starts
    }
}

/// JSON of each, a line each.
fn lines<T: Serialize>(all: &[T]) -> Result<String, serde_json::Error> {
    Ok(all.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?.join(",\n"))
}

#[cfg(test)]
mod tests;
