//! Places for a given number of people: the clusters where they are as many, otherwise clusters split, or weak ones left out.
//!
//! Which cluster stands for how many people is the most probable way to share the number among them; a cluster of several
//! is cut by hierarchical clustering (Ward). Where there are not enough clusters, detections that belong to none fill up.

use super::cluster::split;
use super::counter::{Count, Counted};
use super::network::CLASSES;
use super::scan::Point;
use crate::geometry::{Vec3, add, flat_distance};

/// Echoes come from the skin: the middle of a body is this much farther from the radar, m.
const SKIN_M: f64 = 0.10;
/// Two people's middles are not nearer, m.
const APART_M: f64 = 0.45;
/// Rounds in which places that are too near to each other are moved: one would do for two people.
const PASSES: usize = 8;
/// What a share that the classifier excludes still counts.
const LEAST: f64 = 1e-6;
/// Where somebody is looked for when nothing at all was detected, m.
const NOWHERE: Vec3 = [2.5, 0.0, 0.0];
/// From one such place to the next, m.
const BESIDE_M: f64 = 0.7;

impl Count {
    /// `people` places, world frame, m: about the middles of the bodies, those of the largest clusters first. The number
    /// may be the predicted one or set by hand; there are always as many places as asked for.
    pub fn seeds(&self, people: usize) -> Vec<Vec3> {
        self.places(&self.shares(people), &[], people)
    }

    /// Places of `people` of whom the clusters stand for so many each, and of whom some are `unseen`; what is missing are detections that
    /// belong to no cluster.
    pub(super) fn places(&self, shares: &[usize], unseen: &[Vec3], people: usize) -> Vec<Vec3> {
        let mut places: Vec<Vec3> = shares
            .iter()
            .zip(&self.clusters)
            .filter(|(share, _)| **share > 0)
            .flat_map(|(share, counted)| split(&counted.cluster.points, *share))
            .map(|group| middle(&group))
            .chain(unseen.iter().copied())
            .collect();
        places.truncate(people);
        let mut loose: Vec<&Point> = self.loose.iter().collect();
        loose.sort_by(|a, b| a.age.cmp(&b.age).then(b.contrast.total_cmp(&a.contrast)));
        for point in loose {
            let place = middle(std::slice::from_ref(point));
            if places.len() < people && places.iter().all(|other| flat_distance(*other, place) >= APART_M) {
                places.push(place);
            }
        }
        while places.len() < people {
            places.push(places.last().map_or(NOWHERE, |last| add(*last, [0.0, BESIDE_M, 0.0])));
        }
        stand_apart(&mut places);
        places
    }

    /// How many of `people` each cluster stands for: the most probable shares, by dynamic programming over the clusters.
    fn shares(&self, people: usize) -> Vec<usize> {
        // best[n]: log-probability and shares of the clusters so far that hold n people; fewer than asked for is allowed.
        let mut best: Vec<Option<(f64, Vec<usize>)>> = vec![None; people + 1];
        best[0] = Some((0.0, Vec::new()));
        for counted in &self.clusters {
            let mut next: Vec<Option<(f64, Vec<usize>)>> = vec![None; people + 1];
            for (n, (score, shares)) in best.iter().enumerate().filter_map(|(n, way)| Some((n, way.as_ref()?))) {
                for share in 0..=room(counted).min(people - n) {
                    let score = score + counted.probabilities[share.min(CLASSES - 1)].max(LEAST).ln();
                    if next[n + share].as_ref().is_none_or(|(other, _)| score > *other) {
                        next[n + share] = Some((score, shares.iter().copied().chain([share]).collect()));
                    }
                }
            }
            best = next;
        }
        best.into_iter().rev().flatten().next().map_or_else(Vec::new, |(_, shares)| shares)
    }
}

/// Moves places that are nearer to each other than two bodies can stand apart about their middle, along the line between them:
/// the halves of a cluster that is cut in two may be a hand's breadth apart.
fn stand_apart(places: &mut [Vec3]) {
    for _ in 0..PASSES {
        let mut moved = false;
        for a in 0..places.len() {
            for b in 0..a {
                let (one, other) = (places[a], places[b]);
                let apart = flat_distance(one, other);
                if apart >= APART_M * (1.0 - 1e-9) {
                    continue;
                }
                // Across, where nothing says which way.
                let way =
                    if apart > 1e-6 { [(one[0] - other[0]) / apart, (one[1] - other[1]) / apart] } else { [0.0, 1.0] };
                let step = 0.5 * (APART_M - apart);
                (0..2).for_each(|k| {
                    places[a][k] += step * way[k];
                    places[b][k] -= step * way[k];
                });
                moved = true;
            }
        }
        if !moved {
            return;
        }
    }
}

/// People that a cluster may stand for: no more than its points.
pub(super) fn room(counted: &Counted) -> usize {
    counted.cluster.points.len().min(CLASSES - 1)
}

/// The middle of a body of these echoes: their mean weighted by contrast, of the present frame where it has any, and
/// moved from the skin to the middle.
pub(super) fn middle(points: &[Point]) -> Vec3 {
    let present = points.iter().any(|p| p.age == 0);
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for p in points.iter().filter(|p| p.age == 0 || !present) {
        let weight = f64::from(p.contrast).max(1e-3);
        (0..3).for_each(|k| sum[k] += weight * p.position[k]);
        weights += weight;
    }
    let [x, y, z] = sum.map(|s| if weights > 0.0 { s / weights } else { 0.0 });
    let behind = 1.0 + SKIN_M / x.hypot(y).max(SKIN_M);
    [x * behind, y * behind, z]
}

#[cfg(test)]
mod tests {
    use super::super::cluster::Cluster;
    use super::*;

    fn point(x: f64, y: f64) -> Point {
        Point { position: [x, y, 0.0], heights_m: None, contrast: 2.0, level: 0.0, range_m: x.hypot(y), age: 0 }
    }

    fn counted(points: Vec<Point>, probabilities: [f64; CLASSES]) -> Counted {
        Counted { cluster: Cluster::new(points, 1), probabilities }
    }

    fn scene() -> Count {
        let pair = vec![point(3.0, 0.0), point(3.05, 0.1), point(3.0, 0.6), point(3.1, 0.65)];
        let single = vec![point(2.0, -1.0), point(2.0, -1.1), point(2.1, -1.0)];
        let clutter = vec![point(6.0, 2.0), point(6.0, 2.1), point(6.0, 2.2)];
        Count {
            probabilities: [0.0, 0.0, 0.0, 1.0, 0.0],
            clusters: vec![
                counted(pair, [0.0, 0.3, 0.7, 0.0, 0.0]),
                counted(single, [0.05, 0.9, 0.05, 0.0, 0.0]),
                counted(clutter, [0.9, 0.1, 0.0, 0.0, 0.0]),
            ],
            loose: vec![point(5.0, 1.0)],
            alone: true,
        }
    }

    fn near(places: &[Vec3], x: f64, y: f64) -> bool {
        places.iter().any(|p| (p[0] - x).hypot(p[1] - y) < 0.25)
    }

    #[test]
    fn the_most_probable_shares_win() {
        let three = scene().seeds(3);
        assert_eq!(three.len(), 3);
        assert!(near(&three, 3.1, 0.05) && near(&three, 3.1, 0.65) && near(&three, 2.1, -1.05), "{three:?}");
        let two = scene().seeds(2);
        assert!(near(&two, 2.1, -1.05) && near(&two, 3.1, 0.35), "one each: {two:?}");
    }

    #[test]
    fn nobody_stands_in_another() {
        let crowd = vec![point(3.0, 0.0), point(3.0, 0.05), point(3.0, 0.2), point(3.05, 0.25)];
        let count = Count {
            probabilities: [0.0, 0.0, 1.0, 0.0, 0.0],
            clusters: vec![counted(crowd.clone(), [0.0, 0.1, 0.9, 0.0, 0.0])],
            loose: Vec::new(),
            alone: false,
        };
        let places = count.seeds(2);
        assert!(flat_distance(places[0], places[1]) > 0.999 * APART_M, "{places:?}");
        let mean = 0.5 * (places[0][1] + places[1][1]);
        assert!((mean - 0.125).abs() < 0.03, "about where the cluster is: {places:?}");
        for (k, a) in count.seeds(4).iter().enumerate() {
            assert!(count.seeds(4).iter().skip(k + 1).all(|b| flat_distance(*a, *b) > 0.29));
        }
    }

    #[test]
    fn there_are_as_many_places_as_asked_for() {
        for people in 0..7 {
            assert_eq!(scene().seeds(people).len(), people);
        }
        let nothing = Count { probabilities: [1.0, 0.0, 0.0, 0.0, 0.0], clusters: vec![], loose: vec![], alone: true };
        let places = nothing.seeds(3);
        assert_eq!(places.len(), 3);
        assert!(flat_distance(places[0], places[1]) > 0.5);
    }
}
