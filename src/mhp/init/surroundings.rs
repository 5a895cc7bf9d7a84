//! The evidence of a frame and of those around it, worked out once for a problem.

use super::evidence::{self, Evidence};
use super::layout::Layout;
use crate::mhp::Problem;
use std::sync::{Arc, OnceLock};

/// Coefficients of variation over time: below the first of a pair a cell stands still, above the second it does not (a
/// Rayleigh amplitude has 0.52). The second pair is for who only breathes.
const VARIATIONS: [[f32; 2]; 2] = [[0.05, 0.25], [0.015, 0.075]];
/// The largest of 30,000 Rayleigh amplitudes over their median, ln: a peak above it is no noise.
const NOISE: f64 = 1.4;

/// One view's evidence each.
type Views = Vec<Evidence>;

/// What the maps of a frame and of those around it show.
#[derive(Debug)]
pub(in crate::mhp) struct Surroundings {
    /// The frame itself.
    pub(super) now: Views,
    /// What each frame around shows, when it is first asked for: most starts look at one of them, or at none.
    around: Vec<OnceLock<Views>>,
}

impl Surroundings {
    fn new(problem: &Problem) -> Self {
        let layouts: Vec<Arc<Layout>> = problem.views.iter().enumerate().map(|(k, view)| Layout::of(k, view)).collect();
        let plain: Views =
            layouts.iter().enumerate().map(|(k, layout)| Evidence::new(layout, problem.map(k))).collect();
        let now = moving(problem, &plain).unwrap_or(plain);
        Self { now, around: problem.neighbours().iter().map(|_| OnceLock::new()).collect() }
    }

    /// The frames around with their times after this one, s, in the order of time, each worked out when it is taken.
    pub(super) fn around<'a>(
        &'a self,
        problem: &'a Problem,
    ) -> impl DoubleEndedIterator<Item = (f64, impl FnOnce() -> &'a [Evidence])> {
        self.around.iter().zip(problem.neighbours()).map(move |(known, neighbour)| {
            let views = || self.now.iter().enumerate().map(|(k, now)| now.at_another_time(neighbour.map(k))).collect();
            (neighbour.offset_s, move || known.get_or_init(views).as_slice())
        })
    }
}

/// The evidence of what moves; `None` where nothing does, for then stillness tells nobody from the room.
fn moving(problem: &Problem, plain: &[Evidence]) -> Option<Views> {
    if problem.neighbours().len() < 2 {
        return None;
    }
    let of_view = |k: usize| {
        let others = problem.neighbours().iter().map(|neighbour| neighbour.map(k));
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

/// A problem's surroundings, worked out when first asked for. Equal to any other: it follows from the problem.
#[derive(Debug, Clone, Default)]
pub(in crate::mhp) struct Cached(OnceLock<Arc<Surroundings>>);

impl PartialEq for Cached {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Cached {
    pub(in crate::mhp) fn of<'a>(&'a self, problem: &Problem) -> &'a Surroundings {
        self.0.get_or_init(|| Arc::new(Surroundings::new(problem)))
    }
}
