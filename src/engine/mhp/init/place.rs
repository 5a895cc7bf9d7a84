//! Where bodies may stand: peaks of different views that agree on a point, grouped by hierarchical clustering.
//!
//! Echoes of one body scatter over half a metre and over its whole height, so points are joined by their distance on the
//! floor alone (average linkage, cut at the width of a body). A cluster is a place where somebody may stand.

use crate::geometry::{Vec3, add_scaled, flat_distance, norm, scale};
use crate::mhp::Problem;
use crate::mhp::context::{Mark, Peak, SaliencyMap, triangulate, triangulate_from};
use kodama::{Method, linkage};

/// Peaks of two views that disagree by more are not one body, m.
const LARGEST_MISFIT_M: f64 = 0.35;
/// Clusters farther apart on the floor are two, m.
const CUT_M: f64 = 0.6;
/// At most this many points are clustered, strongest first.
const MOST_POINTS: usize = 200;

/// A point that peaks agree on.
#[derive(Debug, Clone, PartialEq)]
struct Point {
    at: Vec3,
    weight: f64,
}

/// A cluster of points: its weighted middle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub at: Vec3,
    pub weight: f64,
}

/// Places where somebody may stand, strongest first.
pub(super) fn places(problem: &Problem, maps: &[SaliencyMap], peaks: &[Peak]) -> Vec<Place> {
    let mut points = pairs(problem, maps, peaks);
    if points.is_empty() {
        let alone = peaks.iter().filter_map(|peak| {
            let e = maps.get(peak.view)?;
            Some((triangulate(&problem.views, &[&e.mark(peak)]), e.excess_of(peak)))
        });
        points =
            alone.filter(|((p, _), _)| norm(*p).is_finite()).map(|((at, _), weight)| Point { at, weight }).collect();
    }
    points.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    points.truncate(MOST_POINTS);
    let mut places: Vec<Place> = groups(&points).iter().map(|group| place(&points, group)).collect();
    places.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    places
}

/// Points where peaks of two views may be one body.
fn pairs(problem: &Problem, maps: &[SaliencyMap], peaks: &[Peak]) -> Vec<Point> {
    let marks: Vec<(Mark, f64)> =
        peaks.iter().filter_map(|peak| maps.get(peak.view).map(|e| (e.mark(peak), e.excess_of(peak)))).collect();
    let mut points = Vec::new();
    for (i, (a, excess_a)) in marks.iter().enumerate() {
        let (near, _) = triangulate(&problem.views, &[a]);
        for (b, excess_b) in marks[i + 1..].iter().filter(|(b, _)| b.view != a.view) {
            let (at, misfit) = triangulate_from(near, LARGEST_MISFIT_M, &problem.views, &[a, b]);
            if misfit < LARGEST_MISFIT_M && norm(at).is_finite() {
                let weight = (excess_a * excess_b).sqrt();
                points.push(Point { at, weight: weight * (1.0 - misfit / LARGEST_MISFIT_M) });
            }
        }
    }
    points
}

/// Indices of the points of each cluster; lists and their members ascending.
fn groups(points: &[Point]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Option<Vec<usize>>> = (0..points.len()).map(|i| Some(vec![i])).collect();
    if points.len() > 1 {
        let mut distances: Vec<f64> = Vec::with_capacity(points.len() * (points.len() - 1) / 2);
        for (i, a) in points.iter().enumerate() {
            distances.extend(points[i + 1..].iter().map(|b| flat_distance(a.at, b.at)));
        }
        let tree = linkage(&mut distances, points.len(), Method::Average);
        for step in tree.steps() {
            let joined = (step.dissimilarity <= CUT_M).then(|| {
                let mut joined = groups[step.cluster1].take()?;
                joined.append(groups[step.cluster2].as_mut()?);
                groups[step.cluster2] = None;
                joined.sort_unstable();
                Some(joined)
            });
            groups.push(joined.flatten());
        }
    }
    let mut groups: Vec<Vec<usize>> = groups.into_iter().flatten().collect();
    groups.sort_unstable();
    groups
}

fn place(points: &[Point], group: &[usize]) -> Place {
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for point in group.iter().map(|&i| &points[i]) {
        add_scaled(&mut sum, point.at, point.weight);
        weight += point.weight;
    }
    let at = if weight > 0.0 { scale(sum, 1.0 / weight) } else { points[group[0]].at };
    Place { at, weight }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_a_metre_apart_are_two_groups_whatever_their_height() {
        let point = |x: f64, y: f64, z: f64| Point { at: [x, y, z], weight: 1.0 };
        let points = [
            point(3.0, 0.0, -0.8),
            point(4.2, 0.1, 0.0),
            point(3.1, 0.2, 0.7),
            point(4.1, 0.0, 0.5),
            point(3.0, 0.1, 0.0),
        ];
        assert_eq!(groups(&points), [vec![0, 2, 4], vec![1, 3]]);
        assert_eq!(groups(&points[..1]), [vec![0]]);
        assert!(groups(&[]).is_empty());
        let middle = place(&points, &[1, 3]);
        assert!((middle.at[0] - 4.15).abs() < 1e-12 && middle.weight == 2.0);
    }
}
