//! The evidence of a frame and of those around it, worked out once for a problem and a way of reading it.

use super::evidence::{self, Evidence};
use super::layout::Layout;
use crate::config::{Background, FitConfig, FramesAround, Still};
use crate::mhp::{Neighbour, Problem};
use std::sync::{Arc, OnceLock};

/// Coefficients of variation over time: below the first of a pair a cell stands still, above the second it does not (a
/// Rayleigh amplitude has 0.52). The second pair is for who only breathes.
const VARIATIONS: [[f32; 2]; 2] = [[0.05, 0.25], [0.015, 0.075]];
/// The largest of 30,000 Rayleigh amplitudes over their median, ln: a peak above it is no noise.
const NOISE: f64 = 1.4;

/// How maps are read: what decides what they are evidence of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::mhp) struct Reading {
    /// Which frames beside this one are looked at.
    pub(super) frames: FramesAround,
    still: Still,
    background: Background,
}

impl From<&FitConfig> for Reading {
    fn from(config: &FitConfig) -> Self {
        Self { frames: config.frames_around, still: config.init.still, background: config.init.background }
    }
}

/// One view's evidence each.
type Views = Vec<Evidence>;

/// What the maps of a frame and of those around it show.
#[derive(Debug)]
pub(in crate::mhp) struct Surroundings {
    /// The frame itself.
    pub(super) now: Views,
    /// Which frames are around.
    frames: FramesAround,
    /// What each frame around shows, when it is first asked for: most starts look at one of them, or at none.
    around: Vec<OnceLock<Views>>,
}

impl Surroundings {
    fn new(problem: &Problem, reading: Reading) -> Self {
        let layouts: Vec<Arc<Layout>> = problem.views.iter().enumerate().map(|(k, view)| Layout::of(k, view)).collect();
        let of_view = |(k, layout)| Evidence::new(layout, problem.map(k), reading.background);
        let plain: Views = layouts.iter().enumerate().map(of_view).collect();
        let around = problem.neighbours_in(reading.frames);
        let moving = (reading.still == Still::LeftOut).then(|| moving(problem, around, &plain)).flatten();
        let around = around.iter().map(|_| OnceLock::new()).collect();
        Self { now: moving.unwrap_or(plain), frames: reading.frames, around }
    }

    /// The frames around with their times after this one, s, in the order of time, each worked out when it is taken.
    pub(super) fn around<'a>(
        &'a self,
        problem: &'a Problem,
    ) -> impl DoubleEndedIterator<Item = (f64, impl FnOnce() -> &'a [Evidence])> {
        self.around.iter().zip(problem.neighbours_in(self.frames)).map(move |(known, neighbour)| {
            let views = || self.now.iter().enumerate().map(|(k, now)| now.at_another_time(neighbour.map(k))).collect();
            (neighbour.offset_s, move || known.get_or_init(views).as_slice())
        })
    }
}

/// The evidence of what moves; `None` where nothing does, for then stillness tells nobody from the room.
fn moving(problem: &Problem, around: &[Neighbour], plain: &[Evidence]) -> Option<Views> {
    if around.len() < 2 {
        return None;
    }
    let of_view = |k: usize| {
        let others = around.iter().map(|neighbour| neighbour.map(k));
        evidence::variation(&std::iter::once(problem.map(k)).chain(others).collect::<Vec<_>>(), plain[k].largest())
    };
    let variations: Vec<Vec<f32>> = (0..plain.len()).map(of_view).collect();
    VARIATIONS.into_iter().find_map(|limits| {
        let moving = |(evidence, variation): (&Evidence, &Vec<f32>)| {
            let moving = evidence.clone().where_restless(variation, limits);
            // Every view must show something that moves, and noise always does: a place is where views agree.
            moving.peaks().iter().any(|peak| peak.salience > NOISE).then_some(moving)
        };
        plain.iter().zip(&variations).map(moving).collect()
    })
}

/// Ways of reading a problem.
const READINGS: usize = 3 * 2 * 2;

/// A problem's surroundings for each way of reading it, worked out when first asked for. Equal to any other: they follow from
/// the problem.
#[derive(Debug, Clone, Default)]
pub(in crate::mhp) struct Cached([OnceLock<Arc<Surroundings>>; READINGS]);

impl PartialEq for Cached {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Cached {
    pub(in crate::mhp) fn of<'a>(&'a self, problem: &Problem, reading: Reading) -> &'a Surroundings {
        let Reading { frames, still, background } = reading;
        let place = 4 * frames as usize + 2 * still as usize + background as usize;
        self.0[place].get_or_init(|| Arc::new(Surroundings::new(problem, reading)))
    }
}
