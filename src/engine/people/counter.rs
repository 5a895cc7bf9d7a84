//! Counting: detections of a few frames → clusters → the classifier's word on each → the sum → what twenty frames agree on.
//!
//! The paper feeds "cluster statistics" to a classifier of the count and leaves open how the statistics of several clusters
//! become one vector of twelve. Here every cluster is asked by itself how many people it holds (0: clutter or a limb, 1, or
//! several who stand too close); the distribution of the sum is the convolution of theirs. The classifier is trained
//! through that sum, on nothing but the true count of a frame. The frames of the last two seconds are then pooled: an arm that
//! looks like a second person does so for some frames, and who stands behind another is hidden for some; the number of
//! people stays.

use super::cfar::CfarOptions;
use super::cluster::{Cluster, ClusterOptions, bodies, cluster, refined};
use super::error::PeopleError;
use super::features::{FEATURES, features};
use super::network::{CLASSES, Network};
use super::scan::{COMPARED, HISTORY, Point, Scan, Scanner};
use crate::radar::View;

/// Clusters that are asked, those of most points first; more are not people.
pub(super) const MOST_CLUSTERS: usize = 8;

/// A frame alone is believed from this probability on.
const SURE: f64 = 0.9;

/// A number that one frame excludes still has this probability.
const DOUBT: f64 = 0.01;

/// What the counter is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CounterOptions {
    /// Detection.
    pub cfar: CfarOptions,
    /// Clustering.
    pub cluster: ClusterOptions,
}

impl Default for CounterOptions {
    /// The paper's, but β is 2: logarithms have no heavy tail, the fainter of two people is found more often, and what
    /// noise comes with it the classifier knows.
    fn default() -> Self {
        Self { cfar: CfarOptions { beta: 2.0, ..CfarOptions::default() }, cluster: ClusterOptions::default() }
    }
}

/// Counts the people of frames with the same views.
#[derive(Debug, Clone)]
pub struct Counter {
    scanner: Scanner,
    options: CounterOptions,
    network: Network,
}

/// How many people a frame shows, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Count {
    /// Probabilities of 0, 1, 2, 3, and 4 or more people.
    pub probabilities: [f64; CLASSES],
    /// Clusters of detections, those of most points first.
    pub clusters: Vec<Counted>,
    /// Detections that belong to no cluster.
    pub loose: Vec<Point>,
    /// Whether there was no other frame to compare it with: furniture and people look alike then.
    pub alone: bool,
}

/// A cluster and how many people it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Counted {
    /// The cluster.
    pub cluster: Cluster,
    /// Probabilities that it is 0, 1, 2, 3, or 4 and more people.
    pub probabilities: [f64; CLASSES],
}

impl Counter {
    /// A counter for frames of these views, with the weights that come with the program.
    ///
    /// # Errors
    /// [`PeopleError::NoPlace`] where no view tells where an echo is.
    pub fn new(views: &[View]) -> Result<Self, PeopleError> {
        Self::with(views, CounterOptions::default(), Network::bundled()?)
    }

    /// A counter with weights of one's own.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with(views: &[View], options: CounterOptions, network: Network) -> Result<Self, PeopleError> {
        Ok(Self { scanner: Scanner::new(views, options.cfar)?, options, network })
    }

    /// Detections and clusters of a frame. `maps`: one a view, C order, missing cells filled; `before`: the frames before it
    /// in its sequence, the latest first, at most [`HISTORY`] are looked at.
    ///
    /// # Errors
    /// Where the maps are not those of the views, or hold no number.
    pub fn scan(&self, maps: &[&[f64]], before: &[&Scan]) -> Result<Scan, PeopleError> {
        let mut scan = self.scanner.scan(maps, before)?;
        let Described { clusters, loose, features } = self.describe(&scan, before);
        let asked =
            features.iter().zip(&clusters).map(|(x, cluster)| self.held(self.network.probabilities(x), cluster));
        let asked: Vec<[f64; CLASSES]> = asked.collect();
        scan.said = asked.iter().fold(NOBODY, |sum, p| convolve(&sum, p));
        let counted = clusters.into_iter().zip(asked);
        scan.clusters = counted.map(|(cluster, probabilities)| Counted { cluster, probabilities }).collect();
        scan.loose = loose;
        Ok(scan)
    }

    /// What the classifier says of a cluster, as far as it has room for so many: more bodies than stand
    /// [`ClusterOptions::one_body_m`] apart in it are one seen twice.
    fn held(&self, mut said: [f64; CLASSES], cluster: &Cluster) -> [f64; CLASSES] {
        // What is below the doubt decides nothing, and most clusters are one body.
        if said[2..].iter().sum::<f64>() < DOUBT {
            return said;
        }
        let room = bodies(&cluster.points, &self.options.cluster, CLASSES - 1);
        for n in room + 1..CLASSES {
            said[room] += std::mem::take(&mut said[n]);
        }
        said
    }

    /// The count of a scanned frame, given those before it, the latest first: what they agree on.
    pub fn count(&self, now: &Scan, before: &[&Scan]) -> Count {
        let alike = before.iter().take(HISTORY).filter(|scan| scan.moving == now.moving);
        let said: Vec<[f64; CLASSES]> = std::iter::once(now.said).chain(alike.map(|scan| scan.said)).collect();
        Count {
            probabilities: agreed(&said),
            clusters: now.clusters.clone(),
            loose: now.loose.clone(),
            alone: !now.moving,
        }
    }

    /// Clusters and what the classifier sees of them.
    pub(super) fn describe(&self, now: &Scan, before: &[&Scan]) -> Described {
        // What stands still in a sequence's first frame would be clutter among what moves.
        let before: Vec<&&Scan> = before.iter().take(COMPARED).filter(|scan| scan.moving == now.moving).collect();
        let aged = |(age, scan): (usize, &&&Scan)| {
            let age = age as u8 + 1;
            scan.points.iter().map(move |point| Point { age, ..*point }).collect::<Vec<Point>>()
        };
        let mut points = now.points.clone();
        points.extend(before.iter().enumerate().flat_map(aged));
        let frames = before.len() + 1;
        let (found, rest) = cluster(&points, &self.options.cluster);
        let found = refined(found, &self.options.cluster);
        let mut clusters: Vec<Cluster> = found.into_iter().map(|points| Cluster::new(points, frames)).collect();
        clusters.sort_by(|a, b| b.points.len().cmp(&a.points.len()).then(b.intensity.total_cmp(&a.intensity)));
        clusters.truncate(MOST_CLUSTERS);
        let features = features(&clusters, points.len(), frames);
        Described { clusters, loose: rest, features }
    }
}

/// Clusters, the features of each, and the detections that belong to none.
pub(super) struct Described {
    pub(super) clusters: Vec<Cluster>,
    pub(super) loose: Vec<Point>,
    pub(super) features: Vec<[f32; FEATURES]>,
}

/// The distribution of a count where there is nobody.
pub(super) const NOBODY: [f64; CLASSES] = [1.0, 0.0, 0.0, 0.0, 0.0];

/// The distribution of the sum of two counts; the last class takes all that is above.
pub(super) fn convolve(a: &[f64; CLASSES], b: &[f64; CLASSES]) -> [f64; CLASSES] {
    let mut sum = [0.0; CLASSES];
    for (i, p) in a.iter().enumerate() {
        for (j, q) in b.iter().enumerate() {
            sum[(i + j).min(CLASSES - 1)] += p * q;
        }
    }
    sum
}

/// What several frames agree on: the geometric mean of their distributions. None of them is sure beyond [`DOUBT`], because
/// frames that follow each other err alike.
pub(super) fn agreed(said: &[[f64; CLASSES]]) -> [f64; CLASSES] {
    let mean = |k: usize| said.iter().map(|p| (p[k] + DOUBT).ln()).sum::<f64>() / said.len().max(1) as f64;
    let shares: [f64; CLASSES] = std::array::from_fn(|k| mean(k).exp());
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum)
}

impl Count {
    /// The most probable number of people; 4 stands for 4 or more.
    pub fn people(&self) -> usize {
        (0..CLASSES).fold(0, |best, n| if self.probabilities[n] > self.probabilities[best] { n } else { best })
    }

    /// Whether the number may well be wrong: it is of a frame alone, and not clear.
    pub fn is_uncertain(&self) -> bool {
        self.alone && self.probability(self.people()) < SURE
    }

    /// The probability of a number of people; 4 and above share one.
    pub fn probability(&self, people: usize) -> f64 {
        self.probabilities[people.min(CLASSES - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_counts_is_their_convolution_and_saturates() {
        let (coin, two) = ([0.5, 0.5, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!(convolve(&coin, &coin), [0.25, 0.5, 0.25, 0.0, 0.0]);
        assert_eq!(convolve(&convolve(&two, &two), &two), [0.0, 0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn one_frame_does_not_outvote_the_second_before_it() {
        let (one, two) = ([0.0, 0.9, 0.1, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]);
        let p = agreed(&[two, one, one, one, one]);
        assert!(p[1] > p[2] && (p.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{p:?}");
        assert!(agreed(&[one])[1] > 0.8);
    }
}
