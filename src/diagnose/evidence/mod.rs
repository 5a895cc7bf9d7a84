//! Evidence for the failure modes F1 to F4 (paper section 5.4.2): numbers and where they are seen, never a verdict.
//!
//! [`evidence`] is a pure function of one fitted frame and the frames before it. Each mode has a file that says its formulas:
//! measures that rise with what speaks for the mode, and of them a raw value in 0..1. `calibration.rs` makes a probability of
//! the measures, the score: **0.5 means even odds that the mode is there**, for data in which each mode has one frame in
//! eight. It has been learned from simulated frames of known modes, and says no more than that; a person judges.
//!
//! **What does not carry over.** The frames learned from are this program's own. In a second, independent simulator (70 frames
//! with five in a row, never learned from) F1 is above 0.5 on 10 of 48 frames of walkers with reflectors kept and on none of
//! the others (the raw value: 19 of 48, and all 16 of somebody who stands), but F4 stays at 0.00 on all 16 frames of
//! somebody who stands: simulated F4 has a fan in the room, and there nothing else moves. F2 knows people within a metre and
//! beyond 1.7 m alone: at about the Fraunhofer distance of an array whose width is assumed, it claims more than it can know
//! (0.98 on the one real MMVR frame at hand, at 1.12 of that distance). Coarse arrays do not tell F3 at all.
//!
//! What the committed table (`assets/evidence.json`, made by `train-evidence`) reaches:
//!
#![doc = include_str!("../../../assets/evidence.svg")]
//!
#![doc = include_str!("../../../assets/evidence.md")]

mod calibration;
mod cells;
mod counted;
mod low_motion;
mod near_field;
mod number_text;
mod resolution;
mod static_reflector;
mod superposition;
#[cfg(feature = "train")]
mod train;

pub use calibration::{Calibration, CalibrationError, Curve, Figures, FrameSet, Input, with_share};
#[cfg(feature = "train")]
pub use train::{EvidenceExample, Measured, chosen as chosen_examples, learn as learn_curves};

use crate::body::Pppr;
use crate::config::FitConfig;
use crate::labels::Tag;
use crate::mhp::{Masks, Problem, fill_missing};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// T: frames of one sequence over which a cell must stay bright to be static; paper section 5.4.1.
pub const STATIC_FRAMES: usize = 5;
/// κ: the share of a frame's cells that count as bright, percent; paper section 5.4.1.
pub const STATIC_KAPPA_PCT: f64 = 5.0;

/// What speaks for one failure mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// F1 to F4.
    pub mode: Tag,
    /// The probability that the mode is there: 0.5 is even odds where the mode has the share of the frames that
    /// [`Calibration`] says. `None` where it cannot be judged, with the reason in `summary`.
    pub score: Option<f64>,
    /// The mode's own value, 0 (nothing speaks for it) to 1, with the formula of its file; it is no probability.
    pub raw: Option<f64>,
    /// What the score is computed from.
    pub measures: Vec<Measure>,
    /// One sentence with the decisive number.
    pub summary: String,
    /// The numbers behind it, each with where it is seen.
    pub findings: Vec<Finding>,
}

/// A number that rises with what speaks for a mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// As in the calibration's table.
    pub name: Cow<'static, str>,
    /// In units of its own.
    pub value: f64,
}

/// What a mode's file finds.
struct Found {
    mode: Tag,
    raw: Option<f64>,
    measures: Vec<Measure>,
    summary: String,
    findings: Vec<Finding>,
}

impl Found {
    /// The mode cannot be judged.
    fn unknown(mode: Tag, summary: impl Into<String>) -> Self {
        Self { mode, raw: None, measures: Vec::new(), summary: summary.into(), findings: Vec::new() }
    }

    /// With the score that the committed table gives its measures.
    fn calibrated(mut self) -> Evidence {
        let curve = Calibration::bundled().and_then(|table| table.curve(self.mode, &self.measures));
        let score = curve.and_then(|curve| curve.probability(&self.measures));
        self.findings.extend(curve.map(|curve| Finding::new(curve.told(), None)));
        let Self { mode, raw, measures, summary, findings } = self;
        Evidence { mode, score, raw, measures, summary, findings }
    }
}

/// One number or comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Plain words, numbers with units.
    pub text: String,
    /// Where it is seen.
    pub place: Option<FindingPlace>,
}

/// Where a finding is seen.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingPlace {
    /// A box of cells of one view's map.
    Cells {
        /// Index of the view.
        view: usize,
        /// First cell along each axis.
        lo: Vec<usize>,
        /// Last cell along each axis, included.
        hi: Vec<usize>,
    },
    /// A flat joint, person · joints + joint.
    Joint(usize),
    /// A frame of the data set that this one is compared with.
    Frame(usize),
}

impl Finding {
    fn new(text: impl Into<String>, place: Option<FindingPlace>) -> Self {
        Self { text: text.into(), place }
    }
}

/// A frame of the same sequence, before the one that is judged.
#[derive(Debug, Clone, PartialEq)]
pub struct EarlierFrame<'a> {
    /// Index in the data set.
    pub index: usize,
    /// One map a view, C order, as stored.
    pub maps: Vec<&'a [f64]>,
}

/// What the data set says of how many people there are, and of its maps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Annotated<'a> {
    /// The annotated number of people.
    pub persons: Option<usize>,
    /// Labelled boxes on each view's map, in bins: axis-0 lo, axis-1 lo, axis-0 hi, axis-1 hi.
    pub map_boxes: &'a [Vec<[f64; 4]>],
    /// Labelled people in the camera image, where there is one.
    pub image_boxes: Option<usize>,
    /// Whether the data set took away by itself what stands still: then nothing static is left to be measured.
    pub static_removed: bool,
}

/// One fitted frame.
#[derive(Debug, Clone, Copy)]
pub struct EvidenceInput<'a> {
    /// Radar, skeleton, views and the filled maps.
    pub problem: &'a Problem,
    /// The settings of the fit.
    pub config: &'a FitConfig,
    /// The fitted parameters.
    pub params: &'a Pppr,
    /// Masks of each view over its whole map, as [`crate::mhp::masks`] gives them.
    pub masks: &'a [Masks],
    /// Frames of the same sequence right before this one, oldest first; of more than T − 1 the newest count.
    pub before: &'a [EarlierFrame<'a>],
    /// What the labels say of people.
    pub annotated: Annotated<'a>,
}

/// An earlier frame whose maps have the views' sizes and no missing cell.
struct Past<'a> {
    index: usize,
    maps: Vec<Cow<'a, [f64]>>,
}

/// Judges the four modes, in the order F1 to F4.
///
/// What cannot be judged has no score; nothing here fails. Masks, maps or parameters of other sizes than the problem's
/// count as absent.
pub fn evidence(input: &EvidenceInput<'_>) -> Vec<Evidence> {
    let past = past(input);
    let found = [
        static_reflector::judge(input, &past),
        near_field::judge(input),
        superposition::judge(input, &past),
        low_motion::judge(input, &past),
    ];
    found.into_iter().map(Found::calibrated).collect()
}

/// The newest usable frames in a row before this one, at most T − 1, oldest first.
fn past<'a>(input: &EvidenceInput<'a>) -> Vec<Past<'a>> {
    let newest = input.before.iter().rev().take(STATIC_FRAMES - 1);
    let mut past: Vec<Past<'a>> = newest.map_while(|frame| usable(input, frame)).collect();
    past.reverse();
    past
}

fn usable<'a>(input: &EvidenceInput<'a>, frame: &EarlierFrame<'a>) -> Option<Past<'a>> {
    let views = &input.problem.views;
    if frame.maps.len() != views.len() {
        return None;
    }
    let maps = frame.maps.iter().zip(views).map(|(map, view)| {
        if map.len() != view.cells() {
            return None;
        }
        if map.iter().all(|x| x.is_finite()) {
            return Some(Cow::Borrowed(*map));
        }
        let mut filled = map.to_vec();
        fill_missing(&mut filled, &view.shape())?;
        Some(Cow::Owned(filled))
    });
    Some(Past { index: frame.index, maps: maps.collect::<Option<_>>()? })
}

/// The masks of a view, where they have its size.
fn masks_of<'a>(input: &EvidenceInput<'a>, view: usize) -> Option<&'a Masks> {
    let cells = input.problem.views.get(view)?.cells();
    input.masks.get(view).filter(|m| [&m.ori, &m.sim, &m.inside].iter().all(|mask| mask.len() == cells))
}

/// Mean of what is known; running, so that the sum of huge numbers does not overflow.
fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mean, count) = values.into_iter().fold((0.0, 0.0), |(mean, n), x| (mean + (x - mean) / (n + 1.0), n + 1.0));
    (count > 0.0).then_some(mean)
}

/// ½ at `x` = 1, falling from 1 at 0 to 0: the share that a squared deviation of 1 has beside one of `x`.
fn falling(x: f64) -> f64 {
    1.0 / (1.0 + x * x)
}
