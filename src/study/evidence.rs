//! Evidence for a frame of a data set: fits it or takes given parameters, reads the frames before, judges.

use super::{BatchOptions, fit_frame};
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::{Dataset, Frame, map_cells};
use crate::diagnose::{Annotated, EarlierFrame, Evidence, EvidenceInput, STATIC_FRAMES, evidence};
use crate::mhp::{FitError, Masks, Objective, Precision, Problem, masks, simulate};
use crate::start::problem_alone;
use crate::study::shard::{FrameCommand, ShardRow};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// The evidence of one frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameEvidence {
    /// Index in the data set.
    pub index: usize,
    /// The frame's name.
    pub frame: String,
    /// F1 to F4, or why the frame cannot be judged: one line that names the file.
    pub evidence: Result<Vec<Evidence>, String>,
    /// Share of its starts whose fits end in the best basin, where that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub best_basin: Option<f64>,
}

impl ShardRow for FrameEvidence {
    const COMMAND: FrameCommand = FrameCommand::Evidence;

    fn index(&self) -> usize {
        self.index
    }

    fn failure(&self) -> Option<&str> {
        self.evidence.as_ref().err().map(String::as_str)
    }
}

/// The frames right before frame `index` that are of its sequence, at most T − 1.
pub fn frames_before(dataset: &Dataset, index: usize) -> Range<usize> {
    let of_sequence = |&before: &usize| dataset.sequence(before) == dataset.sequence(index);
    let count = (0..index).rev().take(STATIC_FRAMES - 1).take_while(of_sequence).count();
    index - count..index
}

/// Judges frame `index` at `params`, or at the end of a fit from its own peaks. The EM region lies around the start of the
/// fit, or around the given parameters.
pub fn frame_evidence(dataset: &Dataset, index: usize, options: &BatchOptions, params: Option<&Pppr>) -> FrameEvidence {
    let evidence = judge(dataset, index, options, params);
    FrameEvidence { index, frame: dataset.frame_name(index).to_owned(), evidence, best_basin: None }
}

fn judge(
    dataset: &Dataset,
    index: usize,
    options: &BatchOptions,
    params: Option<&Pppr>,
) -> Result<Vec<Evidence>, String> {
    let in_file = |error: &dyn std::fmt::Display| format!("{}: {error}", dataset.frame_path(index).display());
    let frame = dataset.load(index).map_err(|error| error.to_string())?;
    let problem = Arc::new(problem_alone(dataset, &frame).map_err(|error| in_file(&error))?);
    let (initial, params) = match params {
        Some(params) => (params.clone(), params.clone()),
        None => fit_frame(dataset, index, options, None).map(|fit| (fit.initial, fit.params))?,
    };
    let masks = masks_around(&problem, &initial, &params, &options.config, options.precision);
    let masks = masks.map_err(|error| in_file(&error))?;
    Ok(state_evidence(dataset, &frame, &problem, &options.config, &params, &masks))
}

/// The masks of each view at `params`, over its whole map; the EM region lies around `initial`.
pub(super) fn masks_around(
    problem: &Arc<Problem>,
    initial: &Pppr,
    params: &Pppr,
    config: &FitConfig,
    precision: Precision,
) -> Result<Vec<Masks>, FitError> {
    let objective = Objective::new(Arc::clone(problem), *config, precision, initial)?;
    let simulated = simulate(problem, config, precision, params);
    Ok(simulated.iter().enumerate().map(|(view, map)| masks(&objective, view, map)).collect())
}

/// Judges a state of a fit of `frame`: its parameters and the masks of each view over its whole map. Reads the frames
/// before; one that cannot be read, and those before it, count as absent.
pub fn state_evidence(
    dataset: &Dataset,
    frame: &Frame,
    problem: &Problem,
    config: &FitConfig,
    params: &Pppr,
    masks: &[Masks],
) -> Vec<Evidence> {
    let frames = earlier(dataset, frame.index);
    let before: Vec<EarlierFrame<'_>> =
        frames.iter().map(|frame| EarlierFrame { index: frame.index, maps: map_cells(&frame.maps) }).collect();
    let annotated = Annotated {
        persons: frame.person_count,
        map_boxes: &frame.map_boxes,
        image_boxes: frame.image.as_ref().map(|image| image.boxes.len().max(image.keypoints.len())),
        static_removed: dataset.info().static_removed,
    };
    let problem = problem.under(config);
    evidence(&EvidenceInput { problem, config, params, masks, before: &before, annotated })
}

/// The frames before `index`, oldest first; from one that cannot be read only those after it.
fn earlier(dataset: &Dataset, index: usize) -> Vec<Frame> {
    let newest_first = frames_before(dataset, index).rev();
    let loaded = newest_first.map(|before| dataset.load(before).inspect_err(|error| tracing::warn!("{error}")).ok());
    let mut frames: Vec<Frame> = loaded.map_while(|frame| frame).collect();
    frames.reverse();
    frames
}
