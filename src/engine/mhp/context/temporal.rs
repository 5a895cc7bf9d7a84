//! The saliency of a frame's maps and of those around it, worked out once for each way of reading them.

use super::neighbour::Neighbour;
use super::saliency::SaliencyMap;
use super::variation::coefficients_of_variation;
use crate::config::{Background, FitConfig, FramesAround, Still};
use crate::radar::{View, ViewSet};
use std::sync::OnceLock;

/// Coefficients of variation over time: below the first of a pair a cell stands still, above the second it does not (a
/// Rayleigh amplitude has 0.52). The second pair is for who only breathes.
const VARIATIONS: [[f32; 2]; 2] = [[0.05, 0.25], [0.015, 0.075]];
/// The largest of 30,000 Rayleigh amplitudes over their median, ln: a peak above it is no noise.
const NOISE: f64 = 1.4;

/// How maps are read: what decides what stands out in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::mhp) struct Reading {
    /// Which frames beside this one are looked at.
    pub frames: FramesAround,
    still: Still,
    background: Background,
}

impl From<&FitConfig> for Reading {
    fn from(config: &FitConfig) -> Self {
        Self { frames: config.frames_around, still: config.init.still, background: config.init.background }
    }
}

/// What the maps of a frame and of those around it show.
#[derive(Debug)]
pub(in crate::mhp) struct TemporalContext {
    views: ViewSet,
    /// The frame itself, a map a view.
    pub now: Vec<SaliencyMap>,
    /// The frames around in the order of time, and what each shows, when it is first asked for: most starts look at one of
    /// them, or at none.
    around: Vec<(Neighbour, OnceLock<Vec<SaliencyMap>>)>,
}

impl TemporalContext {
    /// Of the frame's `maps`, one a view, and the frames `around` that may be looked at.
    fn new(views: &ViewSet, maps: &[Vec<f64>], around: &[Neighbour], reading: Reading) -> Self {
        let grids = views.grids().zip(maps).enumerate();
        let plain: Vec<SaliencyMap> =
            grids.map(|(view, (grid, map))| SaliencyMap::new(view, grid, map, reading.background)).collect();
        let moving = (reading.still == Still::LeftOut).then(|| moving(maps, around, &plain)).flatten();
        let around = around.iter().map(|neighbour| (neighbour.clone(), OnceLock::new())).collect();
        Self { views: views.clone(), now: moving.unwrap_or(plain), around }
    }

    /// The views of the frame.
    pub(in crate::mhp) fn views(&self) -> &[View] {
        &self.views
    }

    /// The frames around with their times after this one, s, in the order of time, each worked out when it is taken.
    pub(in crate::mhp) fn around<'a>(
        &'a self,
    ) -> impl DoubleEndedIterator<Item = (f64, impl FnOnce() -> &'a [SaliencyMap])> {
        self.around.iter().map(|(neighbour, known)| {
            let views = || self.now.iter().enumerate().map(|(k, now)| now.at_another_time(neighbour.map(k))).collect();
            (neighbour.offset_s, move || known.get_or_init(views).as_slice())
        })
    }
}

/// The saliency of what moves; `None` where nothing does, for then stillness tells nobody from the room.
fn moving(maps: &[Vec<f64>], around: &[Neighbour], plain: &[SaliencyMap]) -> Option<Vec<SaliencyMap>> {
    if around.len() < 2 {
        return None;
    }
    let of_view = |(k, now): (usize, &Vec<f64>)| {
        let others = around.iter().map(|neighbour| neighbour.map(k));
        coefficients_of_variation(
            &std::iter::once(now.as_slice()).chain(others).collect::<Vec<_>>(),
            plain[k].largest(),
        )
    };
    let variations: Vec<Vec<f32>> = maps.iter().enumerate().map(of_view).collect();
    VARIATIONS.into_iter().find_map(|limits| {
        let moving = |(plain, variation): (&SaliencyMap, &Vec<f32>)| {
            let moving = plain.clone().where_varying(variation, limits);
            // Every view must show something that moves, and noise always does: a place is where views agree.
            moving.peaks().iter().any(|peak| peak.salience > NOISE).then_some(moving)
        };
        plain.iter().zip(&variations).map(moving).collect()
    })
}

/// Ways of reading maps.
const READINGS: usize = FramesAround::COUNT * 2 * 2;

/// A frame's context for each way of reading it, worked out when first asked for.
#[derive(Debug, Default)]
pub(in crate::mhp) struct Contexts([OnceLock<TemporalContext>; READINGS]);

impl Contexts {
    /// What a frame's `maps`, one a view, show with the frames `around` that `reading` looks at; the arguments must be the
    /// same whenever it is asked for.
    pub(in crate::mhp) fn of(
        &self,
        views: &ViewSet,
        maps: &[Vec<f64>],
        around: &[Neighbour],
        reading: Reading,
    ) -> &TemporalContext {
        let Reading { frames, still, background } = reading;
        let place = 4 * frames as usize + 2 * still as usize + background as usize;
        self.0[place].get_or_init(|| TemporalContext::new(views, maps, around, reading))
    }
}
