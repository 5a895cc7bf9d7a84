//! Starts that the frames of a sequence decide together.
//!
//! What the persons of each frame may be is searched in that frame's own window, once: the frames around it ask for it, too, and
//! so does whoever fits them next. The decision of a frame hangs on a fixed number of frames on each side of it and not on which
//! frames are fitted with it, in which order or by how many threads.

use super::people::{FoundStart, Sought, find_start_in, seek_in};
use super::problem::{problem_of, rate_hz};
use super::recent::Recent;
use crate::config::{EmLoss, FIELDS, FitConfig, FramesAround, Parameterization};
use crate::dataset::Dataset;
use crate::mhp::{FitError, Problem};
use std::ops::Range;
use std::sync::Arc;

/// Frames whose hypotheses are kept: those around one, under all variants of the largest study.
const KEPT: usize = 1024;

/// What a search looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Key {
    dataset: u64,
    frame: usize,
    config: FitConfig,
}

/// What was found, or why nothing.
static SOUGHT: Recent<Key, Result<Arc<Sought>, FitError>> = Recent::new(KEPT);

/// A configuration with everything at its default that a start does not depend on: two with the same key start from the same
/// pose. Where postures are tried, the unweighted L_EM alone decides between them, and a search in a space of motion has weights of
/// its own.
pub fn start_key(config: &FitConfig) -> FitConfig {
    let (mut key, plain) = (*config, FitConfig::default());
    FIELDS.iter().filter(|field| !field.read_by.by_cold_start()).for_each(|field| field.take(&mut key, &plain));
    key
}

/// As [`start_key`], of what a search in a space of motion depends on: neither who else decides nor, where levels are compared, how
/// masks are made.
fn search_key(config: &FitConfig) -> FitConfig {
    let plain = FitConfig::default();
    let tau_pct = if config.objective == EmLoss::Iou { config.tau_pct } else { plain.tau_pct };
    FitConfig { decode_frames: plain.decode_frames, tau_pct, ..start_key(config) }
}

/// As [`find_start_in`], but the [`FitConfig::decode_frames`] frames on each side, as far as the settings look at frames around,
/// decide with this one which body is fitted.
///
/// # Errors
/// As [`find_start_in`]. What is wrong with another frame is said there; it decides nothing here.
pub fn find_start_along(
    dataset: &Dataset,
    frame: usize,
    problem: &Arc<Problem>,
    config: &FitConfig,
) -> Result<FoundStart, FitError> {
    let reach = around(dataset, frame, config, config.decode_frames);
    if reach.len() < 2 || config.parameterization != Parameterization::Motion {
        return find_start_in(dataset, frame, problem, config);
    }
    let searched = search_key(config);
    let keys = reach.clone().map(|frame| Key { dataset: dataset.id(), frame, config: searched });
    let found = SOUGHT.all(keys, |key| {
        let own = key.frame == frame;
        let sought = if own { seek_in(dataset, frame, problem, config) } else { seek(dataset, key.frame, config) };
        sought.map(Arc::new)
    });
    let t_s = |other: usize| (other as f64 - frame as f64) / rate_hz(dataset);
    let own = found[frame - reach.start].clone()?;
    let others: Vec<(f64, Arc<Sought>)> = reach
        .zip(found)
        .filter(|(other, _)| *other != frame)
        .filter_map(|(other, found)| Some((t_s(other), found.ok()?)))
        .collect();
    let around: Vec<(f64, &Sought)> = others.iter().map(|(t_s, found)| (*t_s, found.as_ref())).collect();
    own.start(problem, config, &around)
}

/// The frames of the sequence of `frame` that may decide with it, itself among them: at most so many on each side that the settings look
/// at.
pub(super) fn around(dataset: &Dataset, frame: usize, config: &FitConfig, most: usize) -> Range<usize> {
    let [before, after] = match config.frames_around {
        FramesAround::Both => [most, most],
        FramesAround::Past => [most, 0],
        FramesAround::None => [0, 0],
    };
    let sequence = dataset.sequence(frame);
    let own = |other: &usize| dataset.sequence(*other) == sequence;
    let first = (frame.saturating_sub(before)..frame).rev().take_while(own).last().unwrap_or(frame);
    let last = (frame + 1..(frame + 1 + after).min(dataset.len())).take_while(own).last().unwrap_or(frame);
    first..last + 1
}

fn seek(dataset: &Dataset, frame: usize, config: &FitConfig) -> Result<Sought, FitError> {
    let read = dataset.load(frame).map_err(|error| FitError::NoStart { reason: error.to_string() })?;
    seek_in(dataset, frame, &Arc::new(problem_of(dataset, &read)?), config)
}
