//! The queue: which frames are in the list, and in what order.
//!
//! A [`FrameFilter`] chooses them and a [`Sort`] orders them. What "next" means follows from both: along the queue it is the next
//! row, along time it is the next frame that matches.

mod filter;
mod row;

use super::compared::ComparedNumber;
use super::labels::LabelMode;
use super::sources::SourceNumber;
use super::tracked::Tracked;
pub use filter::{FrameFilter, syntax};
pub use row::{FrameNumber, FrameRow, Reads};

use crate::dataset::OriginPart;
use crate::labels::Tags;
use crate::mhp::TermId;
use serde::{Deserialize, Serialize};

/// What the list is ordered by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum SortKey {
    /// As in the data set.
    #[default]
    Index,
    /// Easy to hard.
    Stratum,
    /// Hardness.
    Hardness,
    /// ρ_peak.
    PeakDensity,
    /// s_static.
    StaticDominance,
    /// r_human.
    HumanSaliency,
    /// Mean IoU.
    Iou,
    /// Converged or not.
    Converged,
    /// MAJPE.
    Majpe,
    /// Share of starts in the best basin.
    BestBasin,
    /// Tags, in the order of their digits.
    Tags,
    /// Who labelled it.
    Annotator,
    /// What result set A says.
    ResultA,
    /// What result set B says.
    ResultB,
    /// B − A.
    Difference,
    /// The largest distance between a source of predictions and the fit.
    Disagreement,
    /// A number of the source of predictions at a place of their list.
    Source(u8, SourceNumber),
    /// Where it comes from.
    Origin(OriginPart),
    /// An unweighted term of the loss.
    Term(TermId),
}

impl SortKey {
    /// What of a row it depends on.
    pub fn reads(self) -> Reads {
        let none = Reads::default();
        match self {
            Self::Index => none,
            Self::Stratum | Self::Hardness | Self::PeakDensity | Self::StaticDominance | Self::HumanSaliency => {
                Reads { strata: true, ..none }
            }
            Self::Iou | Self::Converged | Self::Majpe | Self::Term(_) => Reads { fit: true, ..none },
            Self::BestBasin => Reads { basins: true, ..none },
            Self::ResultA | Self::ResultB | Self::Difference => Reads { results: true, ..none },
            Self::Disagreement => SourceNumber::ToFit.reads(),
            Self::Source(_, number) => number.reads(),
            Self::Tags => Reads { tags: true, ..none },
            Self::Origin(_) => Reads { origin: true, ..none },
            Self::Annotator => Reads { annotators: true, ..none },
        }
    }
}

/// Order of the list. Frames without a value come last, whichever way it is sorted; equal ones stay in the data set's order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Sort {
    /// By what.
    pub key: SortKey,
    /// Largest first.
    pub descending: bool,
}

/// A filter with an order, kept under a name. It is the text that is kept, not the frames it found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedView {
    /// Its name.
    pub name: String,
    /// The filter's text.
    #[serde(rename = "rule")]
    pub filter: String,
    /// The order.
    pub sort: Sort,
}

/// What a list is filled from: it is filled again when that is another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ListedFrom {
    pub(super) frames: usize,
    /// Revisions: of the filter, of the strata, which are others for every data set, and of what else the list reads.
    pub(super) filter: u64,
    pub(super) strata: u64,
    pub(super) fits: Option<u64>,
    pub(super) labels: Option<u64>,
    pub(super) basins: Option<u64>,
    pub(super) results: Option<(u64, ComparedNumber)>,
    /// Revisions of the sources, and of the fits that they are compared with.
    pub(super) sources: Option<(u64, Option<u64>)>,
    pub(super) sort: Sort,
    pub(super) label_mode: LabelMode,
}

/// The frames of the list.
#[derive(Debug, Default)]
pub struct Queue {
    /// The filter as typed.
    pub text: String,
    /// Why the text is no filter; the list then keeps the last one that was.
    pub error: Option<String>,
    /// The filter in force.
    pub filter: Tracked<FrameFilter>,
    /// Frames in the order of the list.
    rows: Vec<u32>,
    /// The same frames in the order of the data set.
    matching: Vec<u32>,
    /// Position of each frame in `rows`; `u32::MAX` for one that does not match.
    positions: Vec<u32>,
    /// Where in `rows` the frame on screen was when it last was there.
    pub(super) last_position: usize,
    /// Counts up with every change of the rows.
    pub revision: u64,
}

const ABSENT: u32 = u32::MAX;

impl Queue {
    /// Frames in the order of the list.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Frames that match, in the order of the data set.
    pub fn matching(&self) -> &[u32] {
        &self.matching
    }

    /// Where a frame is in the list.
    pub fn position(&self, frame: usize) -> Option<usize> {
        self.positions.get(frame).copied().filter(|&at| at != ABSENT).map(|at| at as usize)
    }

    /// True where a frame matches the filter.
    pub fn contains(&self, frame: usize) -> bool {
        self.position(frame).is_some()
    }

    /// Takes a new filter. One that cannot be understood leaves the last one in force.
    pub(super) fn set_text(&mut self, text: String) {
        match FrameFilter::parse(&text) {
            Ok(filter) => {
                *self.filter.change() = filter;
                self.error = None;
            }
            Err(error) => self.error = Some(error),
        }
        self.text = text;
    }

    /// What of a row the list depends on.
    pub fn reads(&self, sort: Sort) -> Reads {
        self.filter.reads().or(sort.key.reads())
    }

    /// Fills the list again: the rows of `frames` frames, asked for in the order of the data set.
    pub(super) fn fill<'a>(&mut self, frames: usize, sort: Sort, mut row_of: impl FnMut(usize) -> FrameRow<'a>) {
        self.matching.clear();
        self.rows.clear();
        if self.filter.is_empty() && sort == Sort::default() {
            self.matching.extend(0..frames as u32);
            self.rows.extend_from_slice(&self.matching);
        } else {
            let mut keyed: Vec<u128> = Vec::with_capacity(frames);
            for frame in 0..frames {
                let row = row_of(frame);
                if self.filter.matches(&row) {
                    // One whole number to compare: the key, then the frame, so that equal ones keep their order.
                    keyed.push(u128::from(key(sort, &row)) << 32 | frame as u128);
                    self.matching.push(frame as u32);
                }
            }
            if sort != Sort::default() {
                keyed.sort_unstable();
            }
            self.rows.extend(keyed.into_iter().map(|key| key as u32));
        }
        self.positions.clear();
        self.positions.resize(frames, ABSENT);
        for (at, &frame) in self.rows.iter().enumerate() {
            if let Some(position) = self.positions.get_mut(frame as usize) {
                *position = at as u32;
            }
        }
        self.revision += 1;
    }

    /// The row `by` further in the list than `frame`; `None` at its ends. From a frame that left the list, the first step
    /// is to the row that took its place.
    pub fn step(&self, frame: usize, by: isize) -> Option<usize> {
        let last = self.rows.len().checked_sub(1)?;
        let target = match self.position(frame) {
            Some(at) => at.checked_add_signed(by).filter(|&to| to <= last)?,
            None if by > 0 => (self.last_position + by as usize - 1).min(last),
            None => self.last_position.checked_sub(by.unsigned_abs())?.min(last),
        };
        self.rows.get(target).map(|&frame| frame as usize)
    }

    /// The next row after `frame` for which `wanted` holds, from the top again after the end; never `frame` itself.
    pub fn next_where(&self, frame: usize, wanted: impl Fn(usize) -> bool) -> Option<usize> {
        let start = self.position(frame).map_or(self.last_position, |at| at + 1);
        let (before, after) = self.rows.split_at(start.min(self.rows.len()));
        let mut frames = after.iter().chain(before).map(|&row| row as usize);
        frames.find(|&row| row != frame && wanted(row))
    }

    /// The matching frame `by` further in the order of the data set, at most the last; `None` where there is none that way.
    pub fn step_in_time(&self, frame: usize, by: isize) -> Option<usize> {
        let at = self.matching.partition_point(|&row| (row as usize) < frame);
        let here = self.matching.get(at).is_some_and(|&row| row as usize == frame);
        let last = self.matching.len().checked_sub(1)?;
        let target = if by >= 0 {
            let first = if here { at } else { at.saturating_sub(1) };
            let steps = if !here && at == 0 { by as usize - 1 } else { by as usize };
            (first + steps).min(last)
        } else {
            at.checked_sub(1)?;
            at.saturating_sub(by.unsigned_abs())
        };
        self.matching.get(target).map(|&row| row as usize).filter(|&row| row != frame)
    }
}

/// Sorts last: what has no value.
const NOTHING: u64 = u64::MAX;

/// The place in the order as a whole number: smaller comes first, what has no value comes last either way.
fn key(sort: Sort, row: &FrameRow<'_>) -> u64 {
    let rising = match sort.key {
        SortKey::Index => Some(row.index as u64),
        SortKey::Stratum => row.stratum.map(|stratum| stratum as u64),
        SortKey::Hardness => row.hardness.and_then(ordered),
        SortKey::PeakDensity => row.peak_density.and_then(ordered),
        SortKey::StaticDominance => row.static_dominance.and_then(ordered),
        SortKey::HumanSaliency => row.human_saliency.and_then(ordered),
        SortKey::Iou => row.iou.and_then(ordered),
        SortKey::Converged => row.converged.map(u64::from),
        SortKey::Majpe => row.majpe_mm.and_then(ordered),
        SortKey::BestBasin => row.best_basin.and_then(ordered),
        SortKey::ResultA => row.results[0].and_then(ordered),
        SortKey::ResultB => row.results[1].and_then(ordered),
        SortKey::Difference => row.number(FrameNumber::Difference).and_then(ordered),
        SortKey::Disagreement => row.disagreement_mm().and_then(ordered),
        SortKey::Source(slot, number) => {
            row.sources.get(usize::from(slot)).and_then(|(_, numbers)| numbers.get(number)).and_then(ordered)
        }
        SortKey::Tags => Some(tag_rank(row.tags)).filter(|&rank| rank > 0),
        // Subject 2 comes before subject 10, and numbers before names.
        SortKey::Origin(part) => row.origin.part(part).map(|name| name.parse::<u32>().map_or(letters(name), u64::from)),
        SortKey::Annotator => row.annotators.first().map(|name| letters(name)),
        SortKey::Term(term) => row.number(FrameNumber::Term(term)).and_then(ordered),
    };
    // Nothing but NaN, which is left out, comes near the ends of the range.
    rising.map_or(NOTHING, |rising| if sort.descending { NOTHING - 1 - rising } else { rising })
}

/// A whole number in the same order: of negative numbers all bits turn round, of others the sign. `None` for NaN.
fn ordered(x: f64) -> Option<u64> {
    let bits = x.to_bits();
    (!x.is_nan()).then_some(if x.is_sign_negative() { !bits } else { bits | 1 << 63 })
}

/// Sets of tags in the order of their lowest digit, then the next: as words of six letters, of which the missing are least.
fn tag_rank(tags: Tags) -> u64 {
    let letters = tags.iter().map(|tag| tag as u64 + 1);
    letters.chain(std::iter::repeat(0)).take(crate::labels::Tag::ALL.len()).fold(0, |rank, letter| rank * 7 + letter)
}

/// The first eight letters of a name, enough to order by.
fn letters(name: &str) -> u64 {
    let letters = name.bytes().map(|byte| byte.to_ascii_lowercase()).chain(std::iter::repeat(0)).take(8);
    letters.fold(0, |rank, byte| rank << 8 | u64::from(byte))
}

#[cfg(test)]
mod tests {
    #![cfg_attr(feature = "dummies", expect(clippy::unwrap_used, reason = "tests fail by panicking"))]

    use super::*;
    use crate::dataset::Origin;
    #[cfg(feature = "dummies")]
    use crate::mhp::Terms;

    fn queue(text: &str, sort: Sort, iou: &[Option<f64>]) -> Queue {
        let mut queue = Queue::default();
        queue.set_text(text.into());
        queue.fill(iou.len(), sort, |index| FrameRow { index, iou: iou[index], ..FrameRow::default() });
        queue
    }

    #[cfg(feature = "dummies")]
    #[test]
    fn frames_are_ordered_by_the_dummy_term() {
        let key = SortKey::Term(TermId::of("dummy").unwrap());
        let sort = Sort { key, descending: false };
        let terms = [0.5, 0.1, 0.3].map(|value| Terms::from_fn(|term| (term.key == "dummy").then_some(value)));
        let mut queue = Queue::default();
        queue.fill(terms.len(), sort, |index| FrameRow { index, terms: Some(&terms[index]), ..FrameRow::default() });
        assert_eq!(queue.rows(), [1, 2, 0]);
        let text = serde_json::to_string(&sort).unwrap();
        assert_eq!((text.contains("\"dummy\""), serde_json::from_str(&text).unwrap()), (true, sort));
    }

    #[test]
    fn numbers_of_subjects_are_ordered_as_numbers() {
        let sort = Sort { key: SortKey::Origin(OriginPart::Subject), descending: false };
        let subjects = ["10", "anna", "2", ""];
        let mut queue = Queue::default();
        queue.fill(subjects.len(), sort, |index| {
            let subject = Some(subjects[index].to_owned()).filter(|name| !name.is_empty());
            FrameRow { index, origin: Origin { subject, ..Origin::default() }, ..FrameRow::default() }
        });
        assert_eq!(queue.rows(), [2, 0, 1, 3]);
    }

    const IOU: [Option<f64>; 6] = [Some(0.5), None, Some(0.1), Some(0.5), None, Some(0.3)];

    #[test]
    fn unknown_values_are_last_either_way_and_ties_keep_their_order() {
        let by = |descending| queue("", Sort { key: SortKey::Iou, descending }, &IOU).rows().to_vec();
        assert_eq!(by(false), [2, 5, 0, 3, 1, 4]);
        assert_eq!(by(true), [0, 3, 5, 2, 1, 4]);
    }

    #[test]
    fn whole_numbers_are_in_the_order_of_what_they_stand_for() {
        let numbers = [f64::NEG_INFINITY, -2.5, -1e-300, 0.0, 1e-300, 0.5, 2.0, f64::INFINITY];
        assert!(numbers.windows(2).all(|pair| ordered(pair[0]) < ordered(pair[1])));
        assert_eq!(ordered(f64::NAN), None);
        let tags = |text: &str| tag_rank(text.parse().unwrap_or_default());
        let sets = ["F1", "F1 F2", "F1 F2 F3", "F1 F3", "F2", "F2 unsure", "clean", "unsure"];
        assert!(sets.windows(2).all(|pair| tags(pair[0]) < tags(pair[1])));
        assert!(letters("ada") < letters("Adam") && letters("Adam") < letters("bo"));
        let by = |key, descending, row: &FrameRow<'_>| super::key(Sort { key, descending }, row);
        let (none, some) = (FrameRow::default(), FrameRow { iou: Some(0.3), ..FrameRow::default() });
        assert!(by(SortKey::Iou, true, &some) < by(SortKey::Iou, true, &none));
    }

    #[test]
    fn next_follows_the_list_and_time_follows_the_data_set() {
        let sort = Sort { key: SortKey::Iou, descending: false };
        let mut q = queue("iou<0.5", sort, &IOU);
        assert_eq!(q.rows(), [2, 5]);
        assert_eq!((q.step(2, 1), q.step(5, 1), q.step(5, -1), q.step(2, -1)), (Some(5), None, Some(2), None));
        assert_eq!((q.step_in_time(0, 1), q.step_in_time(2, 1), q.step_in_time(3, 1)), (Some(2), Some(5), Some(5)));
        assert_eq!((q.step_in_time(5, 1), q.step_in_time(5, -1), q.step_in_time(3, -10)), (None, Some(2), Some(2)));
        assert_eq!((q.step_in_time(0, 10), q.step_in_time(1, -1)), (Some(5), None));
        assert_eq!((q.contains(2), q.contains(0), q.position(5)), (true, false, Some(1)));
        // Frame 2 leaves the list, as one does that is tagged under `tag:none`: the next one is what took its place.
        q.last_position = 0;
        q.set_text("iou<0.5 -index=2".into());
        q.fill(IOU.len(), sort, |index| FrameRow { index, iou: IOU[index], ..FrameRow::default() });
        assert_eq!((q.step(2, 1), q.step(2, -1)), (Some(5), None));
    }

    #[test]
    fn a_search_goes_round_but_not_to_itself() {
        let q = queue("", Sort::default(), &IOU);
        assert_eq!(q.next_where(3, |frame| IOU[frame].is_none()), Some(4));
        assert_eq!(q.next_where(4, |frame| IOU[frame].is_none()), Some(1));
        assert_eq!(q.next_where(2, |frame| frame == 2), None);
    }

    #[test]
    fn a_wrong_filter_keeps_the_last_one() {
        let mut q = queue("iou<0.2", Sort::default(), &IOU);
        q.set_text("iou<".into());
        assert!(q.error.as_ref().is_some_and(|why| why.contains("not a number")));
        q.fill(IOU.len(), Sort::default(), |index| FrameRow { index, iou: IOU[index], ..FrameRow::default() });
        assert_eq!(q.rows(), [2]);
        q.set_text(String::new());
        assert_eq!(q.error, None);
    }

    #[test]
    fn an_empty_list_has_no_next() {
        let q = queue("iou>9", Sort::default(), &IOU);
        assert_eq!((q.step(0, 1), q.step_in_time(0, 1), q.next_where(0, |_| true)), (None, None, None));
    }
}
