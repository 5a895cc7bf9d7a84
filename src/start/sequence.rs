//! Starts that the frames of a sequence decide together.
//!
//! ```text
//! SOUGHT   what the persons of each frame may be, searched in that frame's own window
//! CARRIED  that, and what bodies of the frames beside become in it, where there is one person
//! start    the body on the cheapest path through what the frames around carried
//! ```
//!
//! Each is worked out once: the frames around ask for it, too, and so does whoever fits them next. The decision of a frame hangs on
//! a fixed number of frames on each side of it and not on which frames are fitted with it, in which order or by how many threads.

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
type Found = Result<Arc<Sought>, FitError>;

static SOUGHT: Recent<Key, Found> = Recent::new(KEPT);
static CARRIED: Recent<Key, Found> = Recent::new(KEPT);

/// Frames on each side that decide which of their bodies are carried on.
const CARRY: usize = 6;

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
    let along = Along { dataset, frame, problem, config };
    let (own, others) = along.decided(frame, reach.clone(), along.carried(reach))?;
    own.start(problem, config, &each(&others))
}

/// A frame that is started with those around it.
struct Along<'a> {
    dataset: &'a Dataset,
    frame: usize,
    problem: &'a Arc<Problem>,
    config: &'a FitConfig,
}

impl Along<'_> {
    fn keys(&self, frames: Range<usize>, config: &FitConfig) -> impl Iterator<Item = Key> {
        let (dataset, config) = (self.dataset.id(), *config);
        frames.map(move |frame| Key { dataset, frame, config })
    }

    fn problem(&self, frame: usize) -> Result<Arc<Problem>, FitError> {
        if frame == self.frame {
            return Ok(Arc::clone(self.problem));
        }
        let read = self.dataset.load(frame).map_err(|error| FitError::NoStart { reason: error.to_string() })?;
        Ok(Arc::new(problem_of(self.dataset, &read)?))
    }

    fn sought(&self, frames: Range<usize>) -> Vec<Found> {
        SOUGHT.all(self.keys(frames, &search_key(self.config)), |key| {
            seek_in(self.dataset, key.frame, &self.problem(key.frame)?, self.config).map(Arc::new)
        })
    }

    fn carried(&self, frames: Range<usize>) -> Vec<Found> {
        let decode_frames = self.config.decode_frames.min(CARRY);
        let carried = FitConfig { decode_frames, ..search_key(self.config) };
        CARRIED.all(self.keys(frames, &carried), |key| {
            let alone = self.sought(key.frame..key.frame + 1)[0].clone()?;
            if !alone.is_carried_on() {
                return Ok(alone);
            }
            let reach = around(self.dataset, key.frame, self.config, decode_frames);
            let (own, others) = self.decided(key.frame, reach.clone(), self.sought(reach))?;
            own.carried_on(&self.problem(key.frame)?, self.config, &each(&others)).map(Arc::new)
        })
    }

    /// What was found in `frame`, and in the others of `reach`, with their times, s after it; what is wrong with one of those decides
    /// nothing.
    fn decided(&self, frame: usize, reach: Range<usize>, found: Vec<Found>) -> Result<(Arc<Sought>, Timed), FitError> {
        let t_s = |other: usize| (other as f64 - frame as f64) / rate_hz(self.dataset);
        let own = found[frame - reach.start].clone()?;
        let others = reach.zip(found).filter(|(other, _)| *other != frame);
        Ok((own, others.filter_map(|(other, found)| Some((t_s(other), found.ok()?))).collect()))
    }
}

/// What was found in frames, and when those are, s.
type Timed = Vec<(f64, Arc<Sought>)>;

fn each(found: &Timed) -> Vec<(f64, &Sought)> {
    found.iter().map(|(t_s, found)| (*t_s, found.as_ref())).collect()
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
