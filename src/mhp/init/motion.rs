//! Where a person goes: its place in the frames around, a line through them, and from the line velocity and heading.
//!
//! Left and right, front and back can hardly be told in one frame, but people walk forwards. Each neighbour's map is
//! searched around the place of the frame before it on the way out, so that the track does not jump to somebody else.

use super::centre;
use super::evidence::{self, Evidence};
use crate::geometry::{Vec3, add_scaled, scale, sub};
use crate::mhp::Problem;
use crate::radar::View;

/// Slower than this, a person stands and the track's direction is its errors', m/s.
const WALKING_MPS: f64 = 0.5;
/// Coefficients of variation over time: below the first of a pair a cell stands still, above the second it does not (a
/// Rayleigh amplitude has 0.52). The second pair is for who only breathes.
const VARIATIONS: [[f64; 2]; 2] = [[0.05, 0.25], [0.015, 0.075]];
/// The largest of 30,000 Rayleigh amplitudes over their median, ln: a peak above it is no noise.
const NOISE: f64 = 1.4;
/// Farther from the place that the frame before leads to, the track is somebody else, m.
const LEASH_M: f64 = 0.35;

/// A line through a person's places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Track {
    /// Place at the time of the frame, m.
    pub at: Vec3,
    /// m/s; heights do not move.
    pub velocity: Vec3,
    /// Frames that the line goes through, the one in the middle included.
    pub frames: usize,
}

impl Track {
    /// The direction of walking on the floor; `None` where the person stands.
    pub(super) fn heading(&self) -> Option<[f64; 2]> {
        let speed = self.velocity[0].hypot(self.velocity[1]);
        (speed > WALKING_MPS).then(|| [self.velocity[0] / speed, self.velocity[1] / speed])
    }
}

/// How restless each cell of each view is over the frame and those around it; nothing where nothing moves at all, for
/// then stillness tells nobody from the room.
pub(super) fn unrest(problem: &Problem) -> Vec<Option<Vec<f64>>> {
    let of_view = |k: usize, limits: [f64; 2]| {
        let others = problem.neighbours().iter().map(|neighbour| neighbour.map(k));
        evidence::unrest(&std::iter::once(problem.map(k)).chain(others).collect::<Vec<_>>(), limits)
    };
    let moves = |(k, (view, unrest)): (usize, (&View, &Option<Vec<f64>>))| {
        let peaks = Evidence::new(k, view, problem.map(k), unrest.as_deref()).peaks();
        peaks.iter().any(|peak| peak.salience > NOISE)
    };
    if problem.neighbours().len() < 2 {
        return vec![None; problem.views.len()];
    }
    // Every view must show something that moves, and noise always does: a place is where views agree.
    let found = VARIATIONS.iter().find_map(|&limits| {
        let found: Vec<Option<Vec<f64>>> = (0..problem.views.len()).map(|k| of_view(k, limits)).collect();
        problem.views.iter().zip(&found).enumerate().all(moves).then_some(found)
    });
    found.unwrap_or_else(|| vec![None; problem.views.len()])
}

/// Evidence of each neighbour, with its time.
pub(super) fn around<'a>(problem: &'a Problem, unrest: &[Option<Vec<f64>>]) -> Vec<(f64, Vec<Evidence<'a>>)> {
    let of = |neighbour: &'a crate::mhp::Neighbour| {
        let views = problem.views.iter().zip(unrest).enumerate();
        let evidence = views.map(|(k, (view, unrest))| Evidence::new(k, view, neighbour.map(k), unrest.as_deref()));
        (neighbour.offset_s, evidence.collect())
    };
    problem.neighbours().iter().map(of).collect()
}

/// Follows the person who stands at `at` through the frames around; `None` where there are none.
pub(super) fn track(problem: &Problem, around: &[(f64, Vec<Evidence<'_>>)], at: Vec3) -> Option<Track> {
    let mut places = vec![(0.0, at)];
    for forwards in [true, false] {
        let side = around.iter().filter(|(t, _)| (*t > 0.0) == forwards && *t != 0.0);
        let mut ordered: Vec<&(f64, Vec<Evidence<'_>>)> = side.collect();
        ordered.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let mut last = (0.0, at);
        let mut velocity = [0.0; 3];
        for (t, evidence) in ordered {
            let mut expected = last.1;
            add_scaled(&mut expected, velocity, t - last.0);
            let found = follow(problem, evidence, expected);
            velocity = scale(sub(found, last.1), 1.0 / (t - last.0));
            last = (*t, found);
            places.push(last);
        }
    }
    (places.len() > 1).then(|| line(&places))
}

/// The middle of what is lit near `expected`; `expected` itself where that is somebody else.
fn follow(problem: &Problem, evidence: &[Evidence<'_>], expected: Vec3) -> Vec3 {
    let found = centre(problem, evidence, expected);
    let off = sub(found, expected);
    if off[0].hypot(off[1]) < LEASH_M { found } else { expected }
}

/// Least squares through (time, place).
fn line(places: &[(f64, Vec3)]) -> Track {
    let n = places.len() as f64;
    let (mut mean, mut time) = ([0.0; 3], 0.0);
    for (t, at) in places {
        add_scaled(&mut mean, *at, 1.0 / n);
        time += t / n;
    }
    let (mut slope, mut spread) = ([0.0; 3], 0.0);
    for (t, at) in places {
        add_scaled(&mut slope, sub(*at, mean), t - time);
        spread += (t - time) * (t - time);
    }
    let mut velocity = if spread > 0.0 { scale(slope, 1.0 / spread) } else { [0.0; 3] };
    velocity[2] = 0.0;
    let mut at = mean;
    add_scaled(&mut at, velocity, -time);
    Track { at, velocity, frames: places.len() }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn a_line_gives_place_and_velocity_at_the_frame() {
        let places: Vec<(f64, Vec3)> =
            [0.0, 0.1, 0.2, -0.1].iter().map(|&t| (t, [3.0 - 1.2 * t, 0.5 + 0.4 * t, 0.1])).collect();
        let track = line(&places);
        assert!((track.at[0] - 3.0).abs() < 1e-12 && (track.at[1] - 0.5).abs() < 1e-12);
        assert!((track.velocity[0] + 1.2).abs() < 1e-12 && (track.velocity[1] - 0.4).abs() < 1e-12);
        let heading = track.heading().unwrap();
        assert!((heading[0] + 1.2 / 1.2f64.hypot(0.4)).abs() < 1e-12);
        assert_eq!(line(&[(0.0, [1.0; 3]), (0.1, [1.01, 1.0, 1.0])]).heading(), None);
    }
}
