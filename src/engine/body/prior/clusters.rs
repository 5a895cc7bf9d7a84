//! k-means of weighted points: the same clusters for the same points.

/// Attempts from other first centres, of which the best counts.
const ATTEMPTS: usize = 6;
/// Rounds of an attempt at most.
const ROUNDS: usize = 100;
/// The golden ratio's fractional part: its multiples lie evenly between 0 and 1, and take the place of random numbers.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Points of one length, each counting as much as its weight (above 0).
#[derive(Clone, Copy)]
struct Cloud<'a> {
    points: &'a [&'a [f64]],
    weights: &'a [f64],
}

/// The cluster of each point, of at most `count`, by the first `dimensions` numbers of each.
pub(super) fn clusters(points: &[Vec<f64>], weights: &[f64], dimensions: usize, count: usize) -> Vec<usize> {
    let points: Vec<&[f64]> = points.iter().map(|point| &point[..dimensions.min(point.len())]).collect();
    let cloud = Cloud { points: &points, weights };
    let attempts = (0..ATTEMPTS).map(|attempt| cloud.settled(cloud.spread_out(count, attempt)));
    attempts.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, members)| members).unwrap_or_default()
}

impl Cloud<'_> {
    /// First centres that are far from each other: each at a point drawn by its squared distance from those before.
    fn spread_out(self, count: usize, attempt: usize) -> Vec<Vec<f64>> {
        let mut chances = self.weights.to_vec();
        let mut nearest = vec![f64::INFINITY; self.points.len()];
        let mut centres: Vec<Vec<f64>> = Vec::new();
        for k in 0..count {
            let total: f64 = chances.iter().sum();
            let mut left = total * (GOLDEN * (1 + attempt * count + k) as f64).fract();
            let drawn = chances.iter().position(|chance| {
                left -= chance;
                left < 0.0
            });
            // None where every point is a centre already.
            let Some(&centre) = drawn.and_then(|drawn| self.points.get(drawn)) else { break };
            for (((point, near), chance), weight) in
                self.points.iter().zip(&mut nearest).zip(&mut chances).zip(self.weights)
            {
                *near = near.min(squared(point, centre));
                *chance = *near * weight;
            }
            centres.push(centre.to_vec());
        }
        centres
    }

    /// Moves each centre into the middle of its points until they stay: the sum of squared distances, and the clusters.
    fn settled(self, mut centres: Vec<Vec<f64>>) -> (f64, Vec<usize>) {
        let (mut spread, mut members) = self.assigned(&centres);
        for _ in 0..ROUNDS {
            self.to_means(&mut centres, &members);
            let (now, moved) = self.assigned(&centres);
            let stays = moved == members;
            (spread, members) = (now, moved);
            if stays {
                break;
            }
        }
        (spread, members)
    }

    fn assigned(self, centres: &[Vec<f64>]) -> (f64, Vec<usize>) {
        let nearest = |point: &[f64]| {
            let distances = centres.iter().map(|centre| squared(point, centre)).enumerate();
            distances.min_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap_or((0, 0.0))
        };
        let of_points: Vec<(usize, f64)> = self.points.iter().map(|point| nearest(point)).collect();
        let spread = of_points.iter().zip(self.weights).map(|((_, distance), weight)| distance * weight).sum();
        (spread, of_points.into_iter().map(|(cluster, _)| cluster).collect())
    }

    fn to_means(self, centres: &mut [Vec<f64>], members: &[usize]) {
        let mut sums: Vec<(f64, Vec<f64>)> = centres.iter().map(|centre| (0.0, vec![0.0; centre.len()])).collect();
        for ((point, weight), &cluster) in self.points.iter().zip(self.weights).zip(members) {
            let (total, sum) = &mut sums[cluster];
            *total += weight;
            sum.iter_mut().zip(*point).for_each(|(sum, x)| *sum += weight * x);
        }
        for (centre, (total, sum)) in centres.iter_mut().zip(sums) {
            // A cluster that lost all its points stays where it was.
            if total > 0.0 {
                *centre = sum.into_iter().map(|x| x / total).collect();
            }
        }
    }
}

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heaps_are_found_and_what_lies_beyond_the_dimensions_is_not_asked() {
        let heaps = [[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]];
        let points: Vec<Vec<f64>> = (0..60)
            .map(|i| vec![heaps[i % 3][0] + 0.01 * i as f64, heaps[i % 3][1] - 0.01 * i as f64, 100.0 * i as f64])
            .collect();
        let weights: Vec<f64> = (0..60).map(|i| 1.0 + f64::from(i % 2)).collect();
        let found = clusters(&points, &weights, 2, 3);
        assert!((0..60).all(|i| found[i] == found[i % 3]), "{found:?}");
        assert!(found[0] != found[1] && found[1] != found[2] && found[0] != found[2]);
        assert_eq!(found, clusters(&points, &weights, 2, 3));
    }

    #[test]
    fn fewer_points_than_clusters_are_a_cluster_each() {
        let points = vec![vec![0.0], vec![1.0], vec![1.0]];
        let found = clusters(&points, &[1.0; 3], 1, 5);
        assert!(found[0] != found[1] && found[1] == found[2], "{found:?}");
        assert!(clusters(&[], &[], 1, 5).is_empty());
    }
}
