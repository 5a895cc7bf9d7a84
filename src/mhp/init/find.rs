//! Who stands where: the place that all views show lit, anywhere or near a place that is given.

use super::evidence::{Evidence, Peak};
use super::height::Expectation;
use super::locate::{Mark, locate};
use super::place::{self, Place};
use super::template::Template;
use super::towards_radar;
use crate::config;
use crate::geometry::{Vec3, add, flat_distance, norm, scale};
use crate::mhp::{FitError, Problem};
use crate::radar::{AxisKind, View};

/// Places nearer to each other are one, m.
const DISTINCT_M: f64 = 0.7;
/// At most this many places are looked at closely.
const MOST_PLACES: usize = 8;
/// A place with less than this share of the strongest place's echo is no rival to it.
const WEAKEST_RIVAL: f64 = 0.3;
/// Reach of the search for a body's middle, on the floor and up and down, m: first that of a start that may be at its
/// edge, then that of a body.
const WIDE_REACH_M: [f64; 2] = [0.8, 1.3];
const NARROW_REACH_M: [f64; 2] = [0.6, 1.1];
/// Views whose middles disagree by more see different things, m.
const LARGEST_MISFIT_M: f64 = 0.5;
/// A person is looked for no farther than this from the place that counting gave it, m, and no farther than this share of
/// the way to the nearest other person: two would find the same echo.
const SEED_REACH_M: f64 = 0.3;
const SEED_SHARE: f64 = 0.25;
/// Share of the way to the nearest other person within which what is lit belongs to this one.
const OWN_SHARE: f64 = 0.6;

/// The strongest place where somebody stands; with [`config::Place::Cluster`] the strongest cluster of peaks, whatever stands there.
pub(super) fn find_one(
    problem: &Problem,
    how: config::Place,
    evidence: &[Evidence],
    template: &Template,
    peaks: &[Peak],
    notes: &mut Vec<String>,
) -> Result<(Vec3, Expectation), FitError> {
    let places = place::places(problem, evidence, peaks);
    if how == config::Place::Cluster {
        let strongest = places.first().map(|place| place.at).ok_or_else(|| dark(peaks))?;
        notes.push(format!("{} peaks in {} clusters: the middle of the strongest", peaks.len(), places.len()));
        return Ok((strongest, Expectation { middle_m: strongest[2], ..Expectation::new(evidence, strongest) }));
    }
    notes.push(format!("{} peaks, {} places tried", peaks.len(), places.len()));
    let mut ranked = rank(&places, template, |body| shared_excess(evidence, body));
    if ranked.is_empty() {
        notes.push("the views agree on no place: the strongest echo of one view was taken".to_owned());
        ranked = rank(&places, template, |body| evidence.iter().map(|e| e.mean_excess(body)).sum());
    }
    most_bodily(problem, evidence, &ranked).ok_or_else(|| dark(peaks))
}

fn dark(peaks: &[Peak]) -> FitError {
    FitError::NoStart { reason: format!("none of {} peaks stands above its background", peaks.len()) }
}

/// How far the nearest of the other `places` is from the `k`-th on the floor, m; infinite where there is no other.
pub(super) fn apart_m(places: &[Vec3], k: usize) -> f64 {
    let others = places.iter().enumerate().filter(|(other, _)| *other != k);
    others.map(|(_, &other)| flat_distance(other, places[k])).fold(f64::INFINITY, f64::min)
}

/// The body that is lit near the `k`-th of `seeds`.
pub(super) fn near(problem: &Problem, evidence: &[Evidence], seeds: &[Vec3], k: usize) -> (Vec3, Expectation) {
    let seed = seeds[k];
    let apart_m = apart_m(seeds, k);
    let (at, expectation) = centre(problem, evidence, seed, apart_m);
    // Somebody else may shine brighter: a person is not looked for beyond arm's reach of the place it was given.
    if flat_distance(at, seed) > SEED_REACH_M.min(SEED_SHARE * apart_m) {
        let at = [seed[0], seed[1], at[2]];
        return (at, Expectation::new(evidence, at));
    }
    (at, expectation)
}

/// The middle of what all views show lit around `at`, on the body's axis: the echoes come from the skin before it. Where
/// height is not seen it stays. What is nearer to the nearest other person, `apart_m` away, is theirs.
pub(super) fn centre(problem: &Problem, evidence: &[Evidence], mut at: Vec3, apart_m: f64) -> (Vec3, Expectation) {
    for [floor_m, up_m] in [WIDE_REACH_M, NARROW_REACH_M, NARROW_REACH_M] {
        let reach_m = [floor_m.min(OWN_SHARE * apart_m), up_m];
        let marks: Vec<Mark> = evidence.iter().filter_map(|e| e.centroid(at, reach_m)).collect();
        if marks.is_empty() {
            break;
        }
        let (found, misfit) = locate(&problem.views, &marks.iter().collect::<Vec<_>>());
        if misfit > LARGEST_MISFIT_M || !found.iter().all(|x| x.is_finite()) {
            break;
        }
        let height_seen = evidence.iter().any(|e| e.resolves(found, [0.0, 0.0, 1.0]));
        at = if height_seen { found } else { [found[0], found[1], at[2]] };
    }
    // The middle of what is lit says little of a body's height: heads outshine feet, or the other way round.
    let expectation = Expectation::new(evidence, at);
    ([at[0], at[1], expectation.middle_m], expectation)
}

/// The middle of what the first view covers: where a body stands when nothing may be read from the peaks.
pub(super) fn middle_of_views(problem: &Problem) -> Vec3 {
    let middle = |(view, v): (usize, &View)| {
        let spatial = v.axes.iter().filter(|axis| axis.kind != AxisKind::Doppler);
        Mark { view, bin: spatial.map(|axis| axis.bins as f64 / 2.0).collect() }
    };
    let marks: Vec<Mark> = problem.views.iter().enumerate().map(middle).collect();
    locate(&problem.views, &marks.iter().collect::<Vec<_>>()).0
}

/// Bodies at `places`, at several heights and depths each, best first: a body stands behind its nearest echo, and its
/// brightest part may be high or low on it.
fn rank(places: &[Place], template: &Template, score: impl Fn(&[Vec3]) -> f64) -> Vec<Vec3> {
    let moved = places.iter().flat_map(|place| {
        [0.0, 0.15].into_iter().flat_map(move |behind| {
            [-0.6, -0.3, 0.0, 0.3, 0.6]
                .map(|up| add(scale(place.at, 1.0 + behind / norm(place.at).max(0.5)), [0.0, 0.0, up]))
        })
    });
    let scored = moved.map(|at| (at, score(&template.facing(at, towards_radar(at)))));
    let mut scored: Vec<(Vec3, f64)> = scored.filter(|(_, score)| *score > 0.0).collect();
    scored.sort_by(|a, b| b.1.total_cmp(&a.1));
    let least = WEAKEST_RIVAL * scored.first().map_or(0.0, |(_, score)| *score);
    scored.into_iter().filter(|(_, score)| *score >= least).map(|(at, _)| at).collect()
}

/// The first of the strongest distinct `places` where something stands from feet to head, or the strongest: a corner of
/// the room may outshine a person in both views, but it is a spot.
fn most_bodily(problem: &Problem, evidence: &[Evidence], places: &[Vec3]) -> Option<(Vec3, Expectation)> {
    let mut tried: Vec<(Vec3, Expectation)> = Vec::new();
    let mut starts: Vec<Vec3> = Vec::new();
    for &place in places {
        if starts.iter().any(|&start| flat_distance(start, place) < DISTINCT_M) {
            continue;
        }
        starts.push(place);
        let (at, expected) = centre(problem, evidence, place, f64::INFINITY);
        if expected.extent_m.is_some() {
            return Some((at, expected));
        }
        tried.push((at, expected));
        if tried.len() == MOST_PLACES {
            break;
        }
    }
    tried.first().copied()
}

/// How much echo over the background all views show at a body: the geometric mean over views, so that each must agree.
fn shared_excess(evidence: &[Evidence], body: &[Vec3]) -> f64 {
    let logs: f64 = evidence.iter().map(|e| e.mean_excess(body).ln()).sum();
    (logs / evidence.len().max(1) as f64).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_other_person_is_found_on_the_floor() {
        let places = [[3.0, 0.0, 0.0], [3.0, 0.7, 1.0], [5.0, 0.0, 0.0]];
        assert!((apart_m(&places, 0) - 0.7).abs() < 1e-12 && (apart_m(&places, 2) - 2.0).abs() < 1e-12);
        assert_eq!(apart_m(&places[..1], 0), f64::INFINITY);
    }
}
