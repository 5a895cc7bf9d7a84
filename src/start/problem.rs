//! A frame as an optimisation problem, with the frames shortly before and after it.
//!
//! A start reads heading and velocity from them. They are those of the frame's own sequence, whatever range of frames is
//! worked on: what a frame starts from does not depend on which others are fitted with it.

use crate::dataset::{Dataset, Frame, map_cells};
use crate::mhp::{FitError, Problem};

/// Frames looked at on each side.
const REACH: usize = 4;
/// Frames a second where a data set does not say.
const USUAL_RATE_HZ: f64 = 10.0;

/// The problem of `frame` without the frames around it: to look at a fit that began elsewhere.
///
/// # Errors
/// As [`Problem::new`].
pub fn problem_alone(dataset: &Dataset, frame: &Frame) -> Result<Problem, FitError> {
    let info = dataset.info();
    let maps = map_cells(&frame.maps);
    let mut problem = Problem::new(info.radar.clone(), info.skeleton.clone(), info.views.clone(), &maps)?;
    problem.static_removed = info.static_removed;
    Ok(problem)
}

/// The problem of `frame`. A neighbour that cannot be read, or does not fit, is left out.
///
/// # Errors
/// As [`Problem::new`].
pub fn problem_of(dataset: &Dataset, frame: &Frame) -> Result<Problem, FitError> {
    let mut problem = problem_alone(dataset, frame)?;
    let rate_hz = rate_hz(dataset);
    let sequence = dataset.sequence(frame.index);
    let around = frame.index.saturating_sub(REACH)..(frame.index + REACH + 1).min(dataset.len());
    for other in around.filter(|&other| other != frame.index && dataset.sequence(other) == sequence) {
        let Ok(maps) = dataset.recent_maps(other) else { continue };
        let offset_s = (other as f64 - frame.index as f64) / rate_hz;
        if let Err(error) = problem.add_neighbour(offset_s, &map_cells(&maps)) {
            tracing::debug!("{}: not looked at: {error}", dataset.frame_name(other));
        }
    }
    Ok(problem)
}

/// Frames a second.
pub(super) fn rate_hz(dataset: &Dataset) -> f64 {
    dataset.info().frame_rate_hz.filter(|rate| *rate > 0.0).unwrap_or(USUAL_RATE_HZ)
}
