//! The three numbers that the statistics depend on.

use super::super::StudyError;
use crate::diagnose::{STATIC_FRAMES, STATIC_KAPPA_PCT};
use serde::{Deserialize, Serialize};

/// What counts as a peak, as static and as human.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComplexityOptions {
    /// κ, %: a bin is strong above the percentile 100 − κ of its map.
    pub kappa_pct: f64,
    /// T, frames: static is what is strong in the last T frames, the frame itself included.
    pub window: usize,
    /// τ, %: the human mask is what lies above the percentile 100 − τ of its map.
    pub tau_pct: f64,
}

impl Default for ComplexityOptions {
    /// The paper's, section 5.4.1; the evidence for F1 counts cells as static by the same κ and T.
    fn default() -> Self {
        Self { kappa_pct: STATIC_KAPPA_PCT, window: STATIC_FRAMES, tau_pct: 10.0 }
    }
}

impl ComplexityOptions {
    /// The longest window that is accepted, frames.
    pub const MAX_WINDOW: usize = 1000;

    /// Checks every number.
    ///
    /// # Errors
    /// Names the first that is out of range.
    pub fn validated(self) -> Result<Self, StudyError> {
        for (key, value) in [("kappa", self.kappa_pct), ("tau", self.tau_pct)] {
            if !(0.1..=99.9).contains(&value) {
                return Err(StudyError::Setting { key, value, expected: "a percentage in 0.1 ..= 99.9" });
            }
        }
        if !(1..=Self::MAX_WINDOW).contains(&self.window) {
            let expected = "a number of frames in 1 ..= 1000";
            return Err(StudyError::Setting { key: "window", value: self.window as f64, expected });
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_makes_no_sense() {
        let default = ComplexityOptions::default();
        assert_eq!(default.validated().ok(), Some(default));
        let told = |options: ComplexityOptions| options.validated().map_or_else(|e| e.to_string(), |_| String::new());
        assert!(told(ComplexityOptions { kappa_pct: 100.0, ..default }).starts_with("kappa is 100; expected"));
        assert!(told(ComplexityOptions { tau_pct: f64::NAN, ..default }).starts_with("tau is NaN; expected"));
        assert!(told(ComplexityOptions { window: 0, ..default }).starts_with("window is 0; expected"));
        assert!(told(ComplexityOptions { window: 1001, ..default }).ends_with("1 ..= 1000"));
    }
}
