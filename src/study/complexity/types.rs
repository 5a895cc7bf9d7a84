//! What is known of a frame's complexity.

use super::ComplexityOptions;
use crate::study::shard::{FrameCommand, ShardRow};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A third of the data set, by hardness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stratum {
    /// Up to the percentile 100/3.
    Easy,
    /// Up to the percentile 200/3.
    Medium,
    /// Above.
    Hard,
}

impl Stratum {
    /// All, the easiest first.
    pub const ALL: [Self; 3] = [Self::Easy, Self::Medium, Self::Hard];

    /// `easy`, `medium`, `hard`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Easy => "easy",
            Self::Medium => "medium",
            Self::Hard => "hard",
        }
    }

    /// `E`, `M`, `H`: what stands beside the colour.
    pub fn letter(self) -> char {
        match self {
            Self::Easy => 'E',
            Self::Medium => 'M',
            Self::Hard => 'H',
        }
    }
}

impl fmt::Display for Stratum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

impl FromStr for Stratum {
    type Err = String;

    /// Reads what [`Self::word`] or [`Self::letter`] writes, in any case.
    fn from_str(text: &str) -> Result<Self, String> {
        let same = |stratum: &Self| {
            text.eq_ignore_ascii_case(stratum.word()) || text.eq_ignore_ascii_case(&stratum.letter().to_string())
        };
        Self::ALL.into_iter().find(same).ok_or_else(|| format!("`{text}` is no stratum; expected easy, medium or hard"))
    }
}

/// The three statistics of one frame, each the mean over the views where it is defined; `None` where it is in none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Statistics {
    /// ρ_peak, peaks a cell, 0..1.
    pub peak_density: Option<f64>,
    /// s_static, 0..1; undefined for the first T − 1 frames of a sequence.
    pub static_dominance: Option<f64>,
    /// r_human; in 0..1 where no cell is negative; undefined where the map's sum is 0.
    pub human_saliency: Option<f64>,
}

/// One frame by itself: what its hardness is told from, once all others are known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredFrame {
    /// Index in the data set.
    pub index: usize,
    /// The frame's name.
    pub frame: String,
    /// Its statistics, or why it cannot be read: one line that names the file.
    pub measured: Result<Statistics, String>,
}

impl ShardRow for MeasuredFrame {
    const COMMAND: FrameCommand = FrameCommand::Complexity;

    fn index(&self) -> usize {
        self.index
    }

    fn failure(&self) -> Option<&str> {
        self.measured.as_ref().err().map(String::as_str)
    }
}

/// One frame among the others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameComplexity {
    /// What was measured.
    pub statistics: Statistics,
    /// Mean of the normalised ranks, 0 (easiest) to 1; `None` where no statistic has one.
    pub hardness: Option<f64>,
    /// The third it falls in; `None` without hardness.
    pub stratum: Option<Stratum>,
}

/// How many frames are what. Their sum is the number of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// In the easy stratum.
    pub easy: usize,
    /// In the medium stratum.
    pub medium: usize,
    /// In the hard stratum.
    pub hard: usize,
    /// Read, but without a hardness.
    pub unranked: usize,
    /// Not readable.
    pub failed: usize,
}

impl Counts {
    /// Counts frames.
    pub(super) fn of(frames: &[Option<FrameComplexity>]) -> Self {
        let mut counts = Self::default();
        for frame in frames {
            match frame.map(|frame| frame.stratum) {
                Some(Some(Stratum::Easy)) => counts.easy += 1,
                Some(Some(Stratum::Medium)) => counts.medium += 1,
                Some(Some(Stratum::Hard)) => counts.hard += 1,
                Some(None) => counts.unranked += 1,
                None => counts.failed += 1,
            }
        }
        counts
    }

    /// Frames of a stratum.
    pub fn in_stratum(&self, stratum: Stratum) -> usize {
        match stratum {
            Stratum::Easy => self.easy,
            Stratum::Medium => self.medium,
            Stratum::Hard => self.hard,
        }
    }
}

/// The complexity of every frame of a data set.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Complexity {
    /// What it was computed with.
    pub options: ComplexityOptions,
    /// One a frame, in the order of the data set; `None` where the frame could not be read.
    pub frames: Vec<Option<FrameComplexity>>,
    /// The frames that could not be read, ascending, and why: one line that names the file.
    pub failures: Vec<(usize, String)>,
    /// How many frames are what.
    pub counts: Counts,
    /// Frames whose maps were read for this answer; the others' statistics were on disk.
    pub scanned: usize,
}

impl Complexity {
    /// What is known of frame `i`; `None` where it could not be read or does not exist.
    pub fn frame(&self, i: usize) -> Option<&FrameComplexity> {
        self.frames.get(i)?.as_ref()
    }

    /// Why frame `i` has no complexity, where that is so.
    pub fn failure(&self, i: usize) -> Option<&str> {
        let at = self.failures.binary_search_by_key(&i, |failure| failure.0).ok()?;
        self.failures.get(at).map(|failure| failure.1.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_read_back_what_they_write_and_are_ordered() {
        for stratum in Stratum::ALL {
            assert_eq!(stratum.word().parse(), Ok(stratum));
            assert_eq!(stratum.letter().to_string().parse(), Ok(stratum));
        }
        assert_eq!("HARD".parse(), Ok(Stratum::Hard));
        assert!("har".parse::<Stratum>().is_err_and(|why| why.contains("expected easy, medium or hard")));
        assert!(Stratum::Easy < Stratum::Medium && Stratum::Medium < Stratum::Hard);
    }
}
