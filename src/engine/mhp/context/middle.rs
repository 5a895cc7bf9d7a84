//! The middle of the body that is lit around a place.

use super::height::Expectation;
use super::saliency::SaliencyMap;
use super::triangulate::{Mark, triangulate};
use crate::geometry::{Vec3, flat_distance};
use crate::radar::View;

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

/// How far the nearest of the other `places` is from the `k`-th on the floor, m; infinite where there is no other.
pub(in crate::mhp) fn apart_m(places: &[Vec3], k: usize) -> f64 {
    let others = places.iter().enumerate().filter(|(other, _)| *other != k);
    others.map(|(_, &other)| flat_distance(other, places[k])).fold(f64::INFINITY, f64::min)
}

/// The body that is lit near the `k`-th of `seeds`.
pub(in crate::mhp) fn near(views: &[View], maps: &[SaliencyMap], seeds: &[Vec3], k: usize) -> (Vec3, Expectation) {
    let seed = seeds[k];
    let apart_m = apart_m(seeds, k);
    let (at, expectation) = centre(views, maps, seed, apart_m);
    // Somebody else may shine brighter: a person is not looked for beyond arm's reach of the place it was given.
    if flat_distance(at, seed) > SEED_REACH_M.min(SEED_SHARE * apart_m) {
        let at = [seed[0], seed[1], at[2]];
        return (at, Expectation::new(maps, at));
    }
    (at, expectation)
}

/// The middle of what all views show lit around `at`, on the body's axis: the echoes come from the skin before it. Where
/// height is not seen it stays. What is nearer to the nearest other person, `apart_m` away, is theirs.
pub(in crate::mhp) fn centre(views: &[View], maps: &[SaliencyMap], mut at: Vec3, apart_m: f64) -> (Vec3, Expectation) {
    for [floor_m, up_m] in [WIDE_REACH_M, NARROW_REACH_M, NARROW_REACH_M] {
        let reach_m = [floor_m.min(OWN_SHARE * apart_m), up_m];
        let marks: Vec<Mark> = maps.iter().filter_map(|e| e.centroid(at, reach_m)).collect();
        if marks.is_empty() {
            break;
        }
        let (found, misfit) = triangulate(views, &marks.iter().collect::<Vec<_>>());
        if misfit > LARGEST_MISFIT_M || !found.iter().all(|x| x.is_finite()) {
            break;
        }
        let height_seen = maps.iter().any(|e| e.resolves(found, [0.0, 0.0, 1.0]));
        at = if height_seen { found } else { [found[0], found[1], at[2]] };
    }
    // The middle of what is lit says little of a body's height: heads outshine feet, or the other way round.
    let expectation = Expectation::new(maps, at);
    ([at[0], at[1], expectation.middle_m], expectation)
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
