//! Two named sets of results, A and B, beside each other in the frame list.

use super::state::FrameSummary;
use super::tracked::Tracked;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One of the two sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResultSide {
    /// The first.
    A,
    /// The second.
    B,
}

impl ResultSide {
    /// Both.
    pub const ALL: [Self; 2] = [Self::A, Self::B];

    /// Its letter.
    pub fn letter(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
        }
    }
}

/// Which number of a frame the two sets are compared by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ComparedNumber {
    /// Mean forward-consistency IoU.
    #[default]
    Iou,
    /// MAJPE, mm.
    Majpe,
    /// L.
    Loss,
}

impl ComparedNumber {
    /// Every one.
    pub const ALL: [Self; 3] = [Self::Iou, Self::Majpe, Self::Loss];

    /// On screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::Iou => "IoU",
            Self::Majpe => "MAJPE",
            Self::Loss => "L",
        }
    }

    /// As text, with the digits that count.
    pub fn text(self, value: f64) -> String {
        match self {
            Self::Iou => format!("{value:.2}"),
            Self::Majpe => format!("{value:.0}"),
            Self::Loss => format!("{value:.3}"),
        }
    }

    /// Whether a larger one is a better fit.
    pub fn larger_is_better(self) -> bool {
        self == Self::Iou
    }

    fn of(self, summary: &FrameSummary) -> Option<f64> {
        match self {
            Self::Iou => summary.iou,
            Self::Majpe => summary.majpe_mm,
            Self::Loss => summary.loss,
        }
    }
}

/// What a set of fits says of the frames of a data set.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ResultSet {
    /// What it is of.
    pub name: String,
    /// By frame, then as [`ComparedNumber::ALL`].
    values: Vec<[Option<f64>; 3]>,
}

impl ResultSet {
    /// Of what the list knows now of a data set with this many frames.
    pub(super) fn of(name: String, frames: usize, summaries: &BTreeMap<usize, FrameSummary>) -> Self {
        let mut values = vec![[None; 3]; frames];
        for (&frame, summary) in summaries {
            if let Some(value) = values.get_mut(frame) {
                *value = ComparedNumber::ALL.map(|number| number.of(summary));
            }
        }
        Self { name, values }
    }

    /// What it says of a frame.
    pub fn value(&self, frame: usize, number: ComparedNumber) -> Option<f64> {
        self.values.get(frame)?[number as usize]
    }

    /// Frames of which it says something.
    pub fn len(&self) -> usize {
        self.values.iter().filter(|values| values.iter().any(Option::is_some)).count()
    }

    /// Whether it says nothing.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Both sets.
#[derive(Debug, Default)]
pub struct ResultSets {
    sets: Tracked<[Option<ResultSet>; 2]>,
}

/// How B differs from A over the frames that both know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetDifference {
    /// Frames that both know.
    pub frames: usize,
    /// Mean of B − A.
    pub mean: f64,
    /// Frames on which B is the better fit.
    pub better: usize,
}

impl ResultSets {
    /// One of them.
    pub fn get(&self, side: ResultSide) -> Option<&ResultSet> {
        self.sets[side as usize].as_ref()
    }

    /// Whether there is any.
    pub fn any(&self) -> bool {
        self.sets.iter().any(Option::is_some)
    }

    /// Another number after every change.
    pub fn revision(&self) -> u64 {
        self.sets.revision()
    }

    /// As they are kept in a session file.
    pub(super) fn saved(&self) -> [Option<ResultSet>; 2] {
        (*self.sets).clone()
    }

    pub(super) fn set(&mut self, side: ResultSide, set: Option<ResultSet>) {
        self.sets.change()[side as usize] = set;
    }

    /// What a set says of a frame.
    pub fn value(&self, side: ResultSide, frame: usize, number: ComparedNumber) -> Option<f64> {
        self.get(side)?.value(frame, number)
    }

    /// B against A; `None` where no frame is in both.
    pub fn difference(&self, number: ComparedNumber) -> Option<SetDifference> {
        let (a, b) = (self.get(ResultSide::A)?, self.get(ResultSide::B)?);
        let both = (0..a.values.len().max(b.values.len()))
            .filter_map(|frame| Some(b.value(frame, number)? - a.value(frame, number)?));
        let (mut frames, mut sum, mut better) = (0, 0.0, 0);
        for difference in both {
            frames += 1;
            sum += difference;
            better += usize::from(if number.larger_is_better() { difference > 0.0 } else { difference < 0.0 });
        }
        (frames > 0).then(|| SetDifference { frames, mean: sum / frames as f64, better })
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    fn set(values: &[(usize, f64)]) -> ResultSet {
        let summary = |mm: f64| FrameSummary { majpe_mm: Some(mm), iou: Some(mm / 100.0), ..FrameSummary::default() };
        ResultSet::of("x".into(), 9, &values.iter().map(|&(frame, mm)| (frame, summary(mm))).collect())
    }

    #[test]
    fn the_difference_is_over_frames_that_both_know() {
        let mut sets = ResultSets::default();
        assert!(!sets.any() && sets.difference(ComparedNumber::Majpe).is_none());
        sets.set(ResultSide::A, Some(set(&[(0, 50.0), (3, 80.0), (4, 10.0), (20, 1.0)])));
        sets.set(ResultSide::B, Some(set(&[(3, 60.0), (4, 16.0), (7, 5.0)])));
        let of = |number| sets.difference(number).unwrap();
        assert_eq!(of(ComparedNumber::Majpe), SetDifference { frames: 2, mean: -7.0, better: 1 });
        assert_eq!((of(ComparedNumber::Iou).frames, of(ComparedNumber::Iou).better), (2, 1));
        assert_eq!(sets.difference(ComparedNumber::Loss), None);
        assert_eq!(sets.get(ResultSide::A).unwrap().len(), 3, "a frame that the data set does not have is left out");
        assert_eq!(sets.value(ResultSide::B, 4, ComparedNumber::Majpe), Some(16.0));
        assert_eq!(sets.value(ResultSide::B, 0, ComparedNumber::Majpe), None);
    }
}
