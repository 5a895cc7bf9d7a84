//! What the network sees of a cluster: the paper's twelve numbers, and how the cluster stands to the stronger ones.
//!
//! A raised arm, a lying leg, the sidelobe of a strong echo and a person's image in a wall are clusters like any other when
//! looked at alone. They differ from a second person in where they lie beside something stronger, and by how much it is
//! stronger. So every cluster is described together with the nearest stronger one, with the strongest of all, and with the
//! best cut of itself into two.

use super::cluster::{Cluster, apart, split};
use crate::geometry::{Vec3, flat_distance};

/// Features of a cluster.
pub const FEATURES: usize = 31;
/// A distance where there is nothing, m.
const FAR_M: f64 = 3.0;
/// A difference of strength where there is nothing, ln of amplitudes.
const FAINT: f64 = 5.0;

/// The features of every cluster of a frame, given all its clusters, how many detections and how many frames they are of.
pub(super) fn features(clusters: &[Cluster], detections: usize, frames: usize) -> Vec<[f32; FEATURES]> {
    let strengths: Vec<f64> = clusters.iter().map(Cluster::strength).collect();
    (0..clusters.len()).map(|i| of(i, clusters, &strengths, detections, frames)).collect()
}

fn of(i: usize, clusters: &[Cluster], strengths: &[f64], detections: usize, frames: usize) -> [f32; FEATURES] {
    let (cluster, strength) = (&clusters[i], strengths[i]);
    let n = cluster.points.len() as f64;
    let [x, y, z] = cluster.centroid;
    let [dx, dy, dz] = cluster.extent;
    let stronger = |&j: &usize| strengths[j] > strength || (strengths[j] == strength && j < i);
    let near = |a: usize, b: usize| {
        let to = |j: usize| flat_distance(clusters[j].centroid, cluster.centroid);
        to(a).total_cmp(&to(b))
    };
    let rank = (0..clusters.len()).filter(stronger).count();
    let master = (0..clusters.len()).filter(stronger).min_by(|&a, &b| near(a, b));
    let strongest = (0..clusters.len()).max_by(|&a, &b| strengths[a].total_cmp(&strengths[b])).unwrap_or(i);
    let beside = master.map_or([FAR_M, 0.0, FAR_M, FAINT, 0.0], |j| {
        let [along, across] = differences(clusters[j].centroid, cluster.centroid);
        let share = n / clusters[j].points.len().max(1) as f64;
        [along.hypot(across), along, across, strengths[j] - strength, share]
    });
    let weaker = (0..clusters.len()).filter(|&j| j != i && !stronger(&j)).min_by(|&a, &b| near(a, b));
    let follower = weaker.map_or([FAR_M, FAINT], |j| {
        [flat_distance(clusters[j].centroid, cluster.centroid).min(FAR_M), strength - strengths[j]]
    });
    let halves = <[_; 2]>::try_from(split(&cluster.points, 2));
    let [cut, wide, least] = halves.map_or([0.0; 3], |halves| {
        let [cut, within] = apart(&halves);
        [cut, cut / within.max(0.05), halves[0].len().min(halves[1].len()) as f64 / n.max(1.0)]
    });
    let low = cluster.points.iter().filter_map(|p| p.heights_m).map(|h| h[0]).fold(f64::INFINITY, f64::min);
    let top = cluster.points.iter().map(|p| f64::from(p.contrast)).fold(0.0, f64::max);
    [
        x,
        y,
        z,
        dx,
        dy,
        dz,
        cluster.intensity,
        cluster.variance,
        n,
        cluster.consistency,
        clusters.len() as f64,
        detections as f64,
        rank as f64,
        beside[0].min(FAR_M),
        beside[1].clamp(-FAR_M, FAR_M),
        beside[2].min(FAR_M),
        beside[3].min(FAINT),
        beside[4].min(2.0),
        flat_distance(clusters[strongest].centroid, cluster.centroid).min(FAR_M),
        (strengths[strongest] - strength).min(FAINT),
        follower[0],
        follower[1].min(FAINT),
        n / frames.max(1) as f64,
        frames as f64,
        cut,
        wide,
        least,
        if low.is_finite() { low } else { 0.0 },
        top,
        x.hypot(y),
        cluster.moved(),
    ]
    .map(|value| value as f32)
}

/// From one place to another along the line of sight of the first and across it, m; across without a sign.
fn differences(from: Vec3, to: Vec3) -> [f64; 2] {
    let length = from[0].hypot(from[1]).max(1e-3);
    let (cos, sin) = (from[0] / length, from[1] / length);
    let d = [to[0] - from[0], to[1] - from[1]];
    [cos * d[0] + sin * d[1], (cos * d[1] - sin * d[0]).abs()]
}
