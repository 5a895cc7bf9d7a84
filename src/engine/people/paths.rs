//! Places for a given number of people along the frames of a sequence: one path a person.
//!
//! A wall that mirrors somebody makes a cluster of its own for some frames, who stands still is not seen for some, and two who pass each
//! other become one cluster: which clusters of a frame are the people is decided by the frames around it as well. A path goes from
//! cluster to cluster and may leave frames out; the cheapest is taken, then the cheapest beside it (Berclaz et al., *Multiple object
//! tracking using k-shortest paths optimization*, 2011, without taking back what an earlier path took),
//!
//! ```text
//! Σ over clusters −κ ln p(n)/p(n − 1) + Σ over steps min(d²/2(σ² + (v Δt)²), J) + κ m (frames left out)
//! ```
//!
//! n persons going through a cluster with the new one, and p what the classifier says of it. κ < 1 because frames that follow each other
//! err alike; J is what a jump costs.

use super::counter::{Count, Counted};
use super::network::CLASSES;
use super::seeds::{middle, room};
use crate::geometry::{Vec3, add, flat_distance, scale, sub};

/// κ
const TEMPER: f64 = 0.2;
/// What the classifier excludes has this probability yet.
const DOUBT: f64 = 0.05;
/// σ: how far a cluster's middle is from that of a body, standard deviation, m.
const PLACE_M: f64 = 0.2;
/// v: how fast people walk, m/s.
const WALK_MPS: f64 = 1.0;
/// J
const JUMP: f64 = 8.0;
/// m
const MISSED: f64 = 0.7;

/// A cluster of a frame.
struct Node {
    frame: usize,
    cluster: usize,
    place: Vec3,
    /// What a person through it costs: the first, the second, …
    costs: Vec<f64>,
    /// Persons who go through it.
    persons: usize,
}

impl Node {
    /// The clusters of all frames, in the order of time.
    fn all(counts: &[(f64, &Count)]) -> Vec<Self> {
        let clusters = counts.iter().enumerate().flat_map(|(frame, (_, count))| {
            count.clusters.iter().enumerate().map(move |(cluster, counted)| (frame, cluster, counted))
        });
        let node = |(frame, cluster, counted): (usize, usize, &Counted)| {
            let ln = |n: usize| (counted.probabilities[n.min(CLASSES - 1)] + DOUBT).ln();
            let costs = (1..=room(counted)).map(|n| TEMPER * (ln(n - 1) - ln(n))).collect();
            Self { frame, cluster, place: middle(&counted.cluster.points), costs, persons: 0 }
        };
        clusters.map(node).collect()
    }
}

/// As [`Count::seeds`] of the count `counts[now]`, a place a person, world frame, m, decided by all of `counts`: in the order of their
/// times, s. None where there is no such count. Source: the module's sum; the paper (4.4) takes each frame's clusters alone.
pub fn seeds_along(counts: &[(f64, &Count)], now: usize, people: usize) -> Vec<Vec3> {
    let Some(&(now_s, own)) = counts.get(now) else { return Vec::new() };
    let mut nodes = Node::all(counts);
    let (mut shares, mut unseen) = (vec![0; own.clusters.len()], Vec::new());
    for _ in 0..people {
        let path = cheapest(&nodes, counts);
        for &k in &path {
            nodes[k].persons += 1;
        }
        let before = path.iter().rev().map(|&k| &nodes[k]).find(|node| node.frame <= now);
        let after = path.iter().map(|&k| &nodes[k]).find(|node| node.frame >= now);
        match (before, after) {
            (Some(node), Some(_)) if node.frame == now => shares[node.cluster] += 1,
            (Some(a), Some(b)) => {
                let share = (now_s - counts[a.frame].0) / (counts[b.frame].0 - counts[a.frame].0);
                unseen.push(add(a.place, scale(sub(b.place, a.place), share)));
            }
            (Some(node), None) | (None, Some(node)) => unseen.push(node.place),
            (None, None) => {}
        }
    }
    own.places(&shares, &unseen, people)
}

/// The nodes of the cheapest path, in the order of time; none where no cluster has room.
fn cheapest(nodes: &[Node], counts: &[(f64, &Count)]) -> Vec<usize> {
    let missed = |frames: usize| TEMPER * MISSED * frames as f64;
    // Of the cheapest path that ends at a node, what it costs and the node before.
    let mut best: Vec<(f64, Option<usize>)> = Vec::with_capacity(nodes.len());
    for (k, node) in nodes.iter().enumerate() {
        let mut way = (missed(node.frame), None);
        for (j, from) in nodes[..k].iter().enumerate().take_while(|(_, from)| from.frame < node.frame) {
            let dt_s = counts[node.frame].0 - counts[from.frame].0;
            let width = 2.0 * (PLACE_M * PLACE_M + (WALK_MPS * dt_s).powi(2));
            let step = (flat_distance(node.place, from.place).powi(2) / width).min(JUMP);
            let cost = best[j].0 + step + missed(node.frame - from.frame - 1);
            if cost < way.0 {
                way = (cost, Some(j));
            }
        }
        let own = node.costs.get(node.persons).copied().unwrap_or(f64::INFINITY);
        best.push((way.0 + own, way.1));
    }
    let last = counts.len().saturating_sub(1);
    let whole = |k: usize| best[k].0 + missed(last - nodes[k].frame);
    let ends = (0..nodes.len()).filter(|&k| best[k].0.is_finite());
    let end = ends.min_by(|a, b| whole(*a).total_cmp(&whole(*b)));
    let mut path: Vec<usize> = std::iter::successors(end, |&k| best[k].1).collect();
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::super::cluster::Cluster;
    use super::super::scan::Point;
    use super::*;

    /// A cluster about a place, and what the classifier says of it.
    fn cluster(x: f64, y: f64, probabilities: [f64; CLASSES]) -> Counted {
        let point = |k: i32| {
            let position = [x, y + 0.1 * f64::from(k), 0.0];
            Point { position, heights_m: None, contrast: 2.0, level: 0.0, range_m: x.hypot(y), age: 0 }
        };
        Counted { cluster: Cluster::new((-3..=3).map(point).collect(), 1), probabilities }
    }

    fn frame(clusters: Vec<Counted>) -> Count {
        Count { probabilities: [0.0, 0.0, 1.0, 0.0, 0.0], clusters, loose: Vec::new(), alone: false }
    }

    const ONE: [f64; CLASSES] = [0.02, 0.95, 0.03, 0.0, 0.0];
    const MAYBE: [f64; CLASSES] = [0.3, 0.68, 0.02, 0.0, 0.0];
    const BOTH: [f64; CLASSES] = [0.0, 0.6, 0.4, 0.0, 0.0];

    fn along(frames: &[Count], now: usize) -> Vec<Vec3> {
        let counts: Vec<(f64, &Count)> = frames.iter().enumerate().map(|(k, count)| (0.1 * k as f64, count)).collect();
        seeds_along(&counts, now, 2)
    }

    fn at(places: &[Vec3], [x, y]: [f64; 2], within: f64) -> bool {
        places.iter().any(|p| (p[0] - x).hypot(p[1] - y) < within)
    }

    #[test]
    fn a_mirror_that_shows_somebody_for_some_frames_is_nobody() {
        // One walks past the other; in two frames they are one cluster, and a wall shows somebody.
        let mut frames: Vec<Count> = (0..9)
            .map(|k| frame(vec![cluster(2.4, -1.2 + 0.1 * f64::from(k), ONE), cluster(2.8, -1.3, ONE)]))
            .collect();
        for k in [4, 5] {
            frames[k] = frame(vec![cluster(2.6, -1.0, BOTH), cluster(3.9, -1.6, ONE)]);
        }
        for k in 0..frames.len() {
            let places = along(&frames, k);
            assert!(at(&places, [2.85, -1.3], 0.5) && !at(&places, [3.9, -1.6], 0.5), "{k}: {places:?}");
        }
        assert!(at(&frames[4].seeds(2), [4.0, -1.6], 0.3), "alone, the frame takes the mirror for somebody");
    }

    #[test]
    fn who_is_not_seen_for_some_frames_is_where_the_others_saw_him() {
        let mut frames: Vec<Count> =
            (0..9).map(|k| frame(vec![cluster(3.0, 0.1 * f64::from(k), ONE), cluster(2.0, -1.5, ONE)])).collect();
        for k in [3, 4, 8] {
            frames[k].clusters.truncate(1);
        }
        frames[4].clusters.push(cluster(3.5, 1.8, MAYBE));
        for k in [3, 4, 8] {
            let places = along(&frames, k);
            assert!(at(&places, [2.1, -1.55], 0.2) && at(&places, [3.1, 0.1 * k as f64], 0.2), "{k}: {places:?}");
        }
    }

    #[test]
    fn a_frame_alone_and_frames_without_clusters_have_places() {
        let two = frame(vec![cluster(3.0, 0.0, ONE), cluster(2.0, -1.5, ONE)]);
        assert_eq!(along(std::slice::from_ref(&two), 0), two.seeds(2));
        assert_eq!(along(&[frame(vec![]), frame(vec![])], 1).len(), 2);
        assert_eq!(along(&[two, frame(vec![])], 1).len(), 2);
        assert!(seeds_along(&[], 0, 2).is_empty());
    }
}
