//! Loss landscape: L and each of its terms along one direction in the space of parameters, or over two.
//!
//! The directions start at one state, the origin: that on screen, or of two pins the first. What the fit went through is
//! projected onto them ([`Direction::coordinate`]): that is where it passed the slice, not that it was on it.

mod direction;

pub use direction::{Direction, SliceAlong};

use super::Halt;
use super::cores::{IdleCores, each};
use super::plane::{Minimum, Row, SampleAxis, minima, rows};
use super::state::ExploredState;
use super::task::Showing;
use crate::body::{Group, Pppr};
use crate::geometry::{Vec3, norm};
use crate::mhp::{Evaluation, Objective, TermId, Terms};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Samples of a slice along one direction, and along each of two.
const ALONG: usize = 241;
const OVER: usize = 81;
/// Samples of one piece of work.
const PIECE: usize = 27;

/// What a person chose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SliceSettings {
    /// The first direction.
    pub along: SliceAlong,
    /// The second one, where there is one.
    pub and: Option<SliceAlong>,
    /// How far, as a multiple of [`SliceAlong::span`].
    pub reach: f64,
    /// The term that a picture over two directions is of, by its key; "loss" is L.
    pub shown: String,
    /// The two pins, by their names, of a slice between pins; the state on screen where there is none of the name.
    pub pins: [String; 2],
}

impl Default for SliceSettings {
    fn default() -> Self {
        Self {
            along: SliceAlong::BodyX,
            and: None,
            reach: 1.0,
            shown: "loss".into(),
            pins: [String::new(), String::new()],
        }
    }
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct SliceRequest {
    /// The fit, at the origin of the slice.
    pub state: ExploredState,
    /// One or two directions.
    pub directions: Vec<Direction>,
    /// From where to where along each, in its unit.
    pub spans: Vec<[f64; 2]>,
}

impl SliceRequest {
    /// Whether another one asks for the same.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.directions == other.directions && self.spans == other.spans && self.state.is_same(&other.state)
    }
}

/// L and its unweighted terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceValue {
    /// L.
    pub loss: f64,
    /// Its terms.
    pub terms: Terms,
}

/// A slice, as far as it is done.
#[derive(Debug, Clone, PartialEq)]
pub struct LossSlice {
    /// One axis or two, the first across.
    pub axes: Vec<SampleAxis>,
    /// The directions.
    pub directions: Vec<Direction>,
    /// The state that it goes through.
    pub origin: Arc<Pppr>,
    /// Settings.
    pub config: crate::config::FitConfig,
    /// A value a sample, the first axis fastest.
    pub values: Vec<Option<SliceValue>>,
    /// Every so many samples along each axis are done.
    pub stride: usize,
}

impl LossSlice {
    /// Samples across and up; 1 up where there is one axis.
    pub fn shape(&self) -> [usize; 2] {
        [self.axes.first().map_or(1, |axis| axis.cells), self.axes.get(1).map_or(1, |axis| axis.cells)]
    }

    /// L, or an unweighted term, of a sample.
    pub fn value(&self, [i, j]: [usize; 2], term: Option<TermId>) -> Option<f64> {
        let value = self.values.get(j * self.shape()[0] + i).copied().flatten()?;
        Some(term.map_or(value.loss, |term| value.terms[term]))
    }

    /// The parameters at places along the axes, in their units.
    pub fn params_at(&self, skeleton: &crate::body::Skeleton, at: &[f64]) -> Pppr {
        let mut params = (*self.origin).clone();
        for (direction, s) in self.directions.iter().zip(at) {
            direction.apply(&mut params, skeleton, *s);
        }
        params
    }

    /// Where a pose lies on the slice, in the axes' units.
    pub fn project(&self, skeleton: &crate::body::Skeleton, pose: &[Vec3]) -> Option<Vec<f64>> {
        self.directions.iter().map(|direction| direction.coordinate(&self.origin, skeleton, pose)).collect()
    }

    /// The minima of L, or of a term; none before the slice is whole.
    pub fn minima(&self, term: Option<TermId>) -> Vec<Minimum> {
        if self.stride > 1 {
            return Vec::new();
        }
        let [across, up] = self.shape();
        let values: Vec<Option<f64>> = (0..across * up).map(|k| self.value([k % across, k / across], term)).collect();
        let closed = |k: usize| self.axes.get(k).is_some_and(|axis| axis.closed);
        minima(&values, [across, up], [closed(0), closed(1)])
    }
}

/// Against a gradient of L, so long that the joint that moves most moves 1 m; `None` where it moves none.
pub fn down_the_gradient(gradient: &Pppr) -> Option<Direction> {
    let longest = (0..gradient.shape().total_joints()).map(|joint| norm(gradient.vec3(Group::Position, joint)));
    let longest = longest.fold(0.0, f64::max);
    if longest <= 0.0 || !longest.is_finite() {
        return None;
    }
    let mut by = Pppr::zeros(gradient.shape());
    by.add_scaled(-1.0 / longest, gradient);
    Some(Direction::Line { by: Arc::new(by), name: "down the gradient".into(), unit: "m" })
}

/// From one set of parameters to another, which is at 1; `None` where they are of other sizes or the same.
pub fn line(from: &Pppr, to: &Pppr, name: &str, unit: &'static str) -> Option<Direction> {
    if from.shape() != to.shape() || from == to {
        return None;
    }
    let mut by = to.clone();
    by.add_scaled(-1.0, from);
    Some(Direction::Line { by: Arc::new(by), name: name.to_owned(), unit })
}

/// Evaluates a slice, coarse to fine.
///
/// # Errors
/// Where the loss cannot be evaluated, or it was cancelled.
pub(super) fn explore(
    request: &SliceRequest,
    cores: &IdleCores,
    show: &Showing<'_, LossSlice>,
) -> Result<LossSlice, Halt> {
    let SliceRequest { state, directions, spans } = request;
    let seen = state.seen()?;
    // What cannot be evaluated is told before threads begin.
    state.objective(&seen)?;
    let cells = if directions.len() > 1 { OVER } else { ALONG };
    let axes: Vec<SampleAxis> = directions.iter().zip(spans).map(|(of, span)| of.axis(*span, cells)).collect();
    let mut slice = LossSlice {
        directions: directions.clone(),
        origin: Arc::new(state.params.clone()),
        config: state.config,
        values: vec![None; axes.iter().map(|axis| axis.cells).product()],
        axes,
        stride: usize::MAX,
    };
    let (shape, axes) = (slice.shape(), slice.axes.clone());
    let pieces: Vec<Row> = rows(shape, PIECE);
    show.begin("evaluating", slice.values.len());
    let room = || (state.objective(&seen), Evaluation::zeros(state.params.shape()), state.params.clone());
    let evaluate =
        |room: &mut (Result<Objective, Halt>, Evaluation, Pppr), k: usize| -> Result<Vec<SliceValue>, Halt> {
            let (objective, evaluation, params) = room;
            let objective = objective.as_mut().map_err(|halt| halt.clone())?;
            let (_, j, columns) = &pieces[k];
            let values = columns.iter().map(|&i| {
                params.clone_from(&state.params);
                for ((direction, axis), at) in directions.iter().zip(&axes).zip([i, *j]) {
                    direction.apply(params, &seen.skeleton, axis.at(at as f64));
                }
                objective.evaluate_into(params, evaluation);
                SliceValue { loss: evaluation.loss, terms: evaluation.terms }
            });
            Ok(values.collect())
        };
    let mut left = super::coarse::left_by_stride(&pieces, |(stride, ..)| *stride);
    each(
        (cores, show.progress()),
        pieces.len(),
        room,
        |room, k, _| evaluate(room, k),
        |k, values| {
            let (stride, j, columns) = &pieces[k];
            show.advance(values.len());
            for (&i, value) in columns.iter().zip(values) {
                slice.values[j * shape[0] + i] = Some(value);
            }
            let ended = super::coarse::ended(&mut left, *stride);
            if let Some(stride) = ended {
                slice.stride = stride;
            }
            show.maybe(ended.is_some(), || slice.clone());
        },
    )?;
    Ok(slice)
}
