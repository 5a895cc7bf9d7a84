//! Clusters of detections: DBSCAN on the floor (ε 0.3 m, 3 points; paper appendix B), and their features.
//!
//! Distance is taken on the floor: the echoes of one body stand above each other, so that head and feet are one cluster.

use super::scan::Point;
use crate::geometry::{Vec3, flat_distance};
use kodama::{Method, linkage};
use ndarray::Array2;
use petal_clustering::{Dbscan, Fit as _};
use petal_neighbors::distance::Euclidean;

/// What DBSCAN is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusterOptions {
    /// ε, m.
    pub epsilon_m: f64,
    /// Points that make a core point, itself included.
    pub points: usize,
    /// Halves of a cluster that are two bodies are at least this far apart, m,
    pub apart_m: f64,
    /// and this many times their standard deviation.
    pub wider: f64,
    /// Clusters whose middles are nearer than this are one body, m.
    pub one_body_m: f64,
    /// So are clusters nearer than this, m,
    pub limb_m: f64,
    /// one of which has less than this share of the other's points: an arm or a leg that moves by itself.
    pub limb_share: f64,
}

impl Default for ClusterOptions {
    fn default() -> Self {
        Self { epsilon_m: 0.3, points: 3, apart_m: 0.5, wider: 2.5, one_body_m: 0.3, limb_m: 0.75, limb_share: 0.2 }
    }
}

/// Detections that hang together.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    /// Its detections.
    pub points: Vec<Point>,
    /// Mean position, weighted by contrast, world frame, m.
    pub centroid: Vec3,
    /// Extent along x, y and z, m.
    pub extent: Vec3,
    /// Mean of the contrasts (ln of the amplitude over the cells around).
    pub intensity: f64,
    /// Their variance.
    pub variance: f64,
    /// Share of the present and earlier frames in which it was detected; ½ where there is only one frame.
    pub consistency: f64,
}

/// Clusters in the order of their first points, and the points that belong to none.
pub(super) fn cluster(points: &[Point], options: &ClusterOptions) -> (Vec<Vec<Point>>, Vec<Point>) {
    let flat: Vec<f64> = points.iter().flat_map(|p| [p.position[0], p.position[1]]).collect();
    let Ok(array) = Array2::from_shape_vec((points.len(), 2), flat) else { return (Vec::new(), points.to_vec()) };
    let (found, rest) = Dbscan::new(options.epsilon_m, options.points, Euclidean::default()).fit(&array, None);
    let mut members: Vec<Vec<usize>> = found.into_values().collect();
    for member in &mut members {
        member.sort_unstable();
    }
    members.sort_unstable();
    let take = |indices: &[usize]| indices.iter().filter_map(|&i| points.get(i)).copied().collect::<Vec<Point>>();
    (members.iter().map(|m| take(m)).collect(), take(&rest))
}

/// Cuts points into `groups` by Ward's linkage on the floor; fewer where there are fewer points. Groups are in the order of
/// their first points.
pub(super) fn split(points: &[Point], groups: usize) -> Vec<Vec<Point>> {
    let n = points.len();
    let mut group: Vec<usize> = (0..n).collect();
    if groups < n {
        let pairs = points.iter().enumerate().flat_map(|(i, a)| points.iter().skip(i + 1).map(move |b| (a, b)));
        let mut distances: Vec<f64> = pairs.map(|(a, b)| flat_distance(a.position, b.position)).collect();
        let steps = linkage(&mut distances, n, Method::Ward);
        // The cluster that step k makes is called n + k.
        let mut members: Vec<Vec<usize>> = (0..n).map(|i| vec![i]).collect();
        for step in steps.steps().iter().take(n - groups.max(1)) {
            let of = |cluster: usize| members.get(cluster).cloned().unwrap_or_default();
            let joined: Vec<usize> = of(step.cluster1).into_iter().chain(of(step.cluster2)).collect();
            let first = joined.iter().copied().min().unwrap_or(0);
            for &i in &joined {
                group[i] = first;
            }
            members.push(joined);
        }
    }
    let mut names = group.clone();
    names.sort_unstable();
    names.dedup();
    let of = |name: usize| (0..n).filter(|&i| group[i] == name).filter_map(|i| points.get(i)).copied().collect();
    names.into_iter().map(of).collect()
}

/// As how many bodies, one to `most`, these points may be seen: cut into so many, all middles are as far apart as two bodies'.
pub(super) fn bodies(points: &[Point], options: &ClusterOptions, most: usize) -> usize {
    let apart = |&groups: &usize| {
        let middles: Vec<Vec3> = split(points, groups).iter().map(|group| mean(group)).collect();
        let far =
            |(k, a): (usize, &Vec3)| middles.iter().skip(k + 1).all(|&b| flat_distance(*a, b) >= options.one_body_m);
        middles.len() == groups && middles.iter().enumerate().all(far)
    };
    (2..=most).take_while(apart).last().unwrap_or(1)
}

/// Clusters of one body's size: those that are clearly several are cut, those too near to each other to be two are joined.
pub(super) fn refined(clusters: Vec<Vec<Point>>, options: &ClusterOptions) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut waiting = clusters;
    waiting.reverse();
    while let Some(cluster) = waiting.pop() {
        match <[Vec<Point>; 2]>::try_from(split(&cluster, 2)) {
            Ok(halves) if are_two(&halves, options) => waiting.extend(halves),
            _ => parts.push(cluster),
        }
    }
    joined(parts, options)
}

/// Whether two groups of points are two bodies: far enough apart, each of enough points, and wider apart than wide.
fn are_two(halves: &[Vec<Point>; 2], options: &ClusterOptions) -> bool {
    let [apart, within] = apart(halves);
    halves.iter().all(|half| half.len() >= options.points)
        && apart >= options.apart_m
        && apart >= options.wider * within
}

/// The distance of the middles of two groups of points, and the standard deviation of the points about them, m.
pub(super) fn apart(halves: &[Vec<Point>; 2]) -> [f64; 2] {
    let [a, b] = halves.each_ref().map(|half| mean(half));
    let spread =
        |half: &[Point], middle: Vec3| half.iter().map(|p| flat_distance(p.position, middle).powi(2)).sum::<f64>();
    let points = halves[0].len() + halves[1].len();
    [flat_distance(a, b), ((spread(&halves[0], a) + spread(&halves[1], b)) / points.max(1) as f64).sqrt()]
}

fn mean(points: &[Point]) -> Vec3 {
    let weight = |p: &Point| f64::from(p.contrast).max(1e-3);
    let all: f64 = points.iter().map(weight).sum::<f64>().max(1e-9);
    std::array::from_fn(|k| points.iter().map(|p| weight(p) * p.position[k]).sum::<f64>() / all)
}

/// Joins the two nearest clusters as long as they are nearer than two bodies can be, or one is a limb of the other.
fn joined(mut clusters: Vec<Vec<Point>>, options: &ClusterOptions) -> Vec<Vec<Point>> {
    loop {
        let middles: Vec<Vec3> = clusters.iter().map(|c| mean(c)).collect();
        let reach = |i: usize, j: usize| {
            let (few, many) = (clusters[i].len().min(clusters[j].len()), clusters[i].len().max(clusters[j].len()));
            let limb = (few as f64) < options.limb_share * many as f64;
            if limb { options.limb_m.max(options.one_body_m) } else { options.one_body_m }
        };
        let pairs = (0..middles.len()).flat_map(|i| (i + 1..middles.len()).map(move |j| (i, j)));
        let nearest = pairs
            .map(|(i, j)| (flat_distance(middles[i], middles[j]), i, j))
            .filter(|&(apart, i, j)| apart < reach(i, j))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, i, j)) = nearest else { return clusters };
        let other = clusters.remove(j);
        clusters[i].extend(other);
    }
}

impl Cluster {
    /// Describes points of `frames` frames.
    pub(super) fn new(points: Vec<Point>, frames: usize) -> Self {
        let n = points.len().max(1) as f64;
        let weight: f64 = points.iter().map(|p| f64::from(p.contrast).max(1e-3)).sum::<f64>().max(1e-9);
        let mut centroid = [0.0; 3];
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in &points {
            let [bottom, top] = p.heights_m.unwrap_or([p.position[2]; 2]);
            for k in 0..3 {
                centroid[k] += p.position[k] * f64::from(p.contrast).max(1e-3) / weight;
                low[k] = low[k].min(if k == 2 { bottom } else { p.position[k] });
                high[k] = high[k].max(if k == 2 { top } else { p.position[k] });
            }
        }
        // Along the line of sight and across it: that is how a radar blurs.
        let length = centroid[0].hypot(centroid[1]).max(1e-3);
        let (sin, cos) = (centroid[1] / length, centroid[0] / length);
        let turned = |p: Vec3| [cos * p[0] + sin * p[1], cos * p[1] - sin * p[0]];
        for k in 0..2 {
            let along: Vec<f64> = points.iter().map(|p| turned(p.position)[k]).collect();
            low[k] = along.iter().copied().fold(f64::INFINITY, f64::min);
            high[k] = along.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        }
        let intensity = points.iter().map(|p| f64::from(p.contrast)).sum::<f64>() / n;
        let variance = points.iter().map(|p| (f64::from(p.contrast) - intensity).powi(2)).sum::<f64>() / n;
        let seen = (0..frames).filter(|&age| points.iter().any(|p| usize::from(p.age) == age)).count();
        let consistency = if frames > 1 { seen as f64 / frames as f64 } else { 0.5 };
        let extent = std::array::from_fn(|k| if points.is_empty() { 0.0 } else { high[k] - low[k] });
        Self { points, centroid, extent, intensity, variance, consistency }
    }

    /// ln of the largest amplitude, as it would be at 1 m: echoes fall with the square of the distance.
    pub(super) fn strength(&self) -> f64 {
        let strength = |p: &Point| f64::from(p.level) + 2.0 * p.range_m.max(0.1).ln();
        self.points.iter().map(strength).fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far the middle of the detections moved from the older frames to the latest two, m.
    pub(super) fn moved(&self) -> f64 {
        let middle = |new: bool| {
            let some: Vec<Point> = self.points.iter().filter(|p| (p.age < 2) == new).copied().collect();
            (!some.is_empty()).then(|| mean(&some))
        };
        middle(true).zip(middle(false)).map_or(0.0, |(a, b)| flat_distance(a, b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` points within some centimetres of a place on the floor.
    fn body(x: f64, y: f64, n: u32) -> Vec<Point> {
        let point = |k: u32| {
            let position = [x, y + 0.02 * f64::from(k % 5), 0.0];
            Point { position, heights_m: None, contrast: 2.0, level: 0.0, range_m: x.hypot(y), age: 0 }
        };
        (0..n).map(point).collect()
    }

    #[test]
    fn a_cluster_has_room_for_bodies_that_stand_apart() {
        let options = ClusterOptions::default();
        let room = |groups: &[Vec<Point>]| bodies(&groups.concat(), &options, 4);
        assert_eq!(room(&[body(3.0, 0.0, 10)]), 1);
        assert_eq!(room(&[body(3.0, 0.0, 10), body(3.0, 0.2, 10)]), 1, "0.2 m is no distance of two people");
        assert_eq!(room(&[body(3.0, 0.0, 10), body(3.0, 0.6, 10)]), 2);
        assert_eq!(room(&[body(3.0, 0.0, 10), body(3.0, 0.6, 10), body(3.6, 0.0, 10)]), 3);
        assert_eq!(room(&[body(3.0, 0.0, 1)]), 1);
    }

    #[test]
    fn a_limb_belongs_to_its_body_and_a_second_body_does_not() {
        let options = ClusterOptions::default();
        let groups = |second: Vec<Point>| refined(vec![body(3.0, 0.0, 30), second], &options).len();
        assert_eq!(groups(body(2.45, 0.0, 5)), 1, "an arm in front of the body");
        assert_eq!(groups(body(2.4, 0.0, 25)), 2, "somebody as large in front of it");
        assert_eq!(groups(body(2.1, 0.0, 6)), 2, "too far for an arm");
    }
}
