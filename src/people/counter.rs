//! Counting: detections of a few frames → clusters → the classifier's word on each → the count.
//!
//! The paper feeds "cluster statistics" to a classifier of the count and leaves open how the statistics of several clusters
//! become one vector of twelve. Here every cluster is asked by itself how many people it holds (0: clutter, 1, or several
//! who stand too close), and so is what belongs to no cluster; the distribution of the sum is the convolution of theirs. The
//! classifier is trained through that sum, on nothing but the true count of a frame.

use super::cfar::CfarOptions;
use super::cluster::{Cluster, ClusterOptions, cluster, refined};
use super::error::PeopleError;
use super::network::{CLASSES, FEATURES, Network};
use super::scan::{HISTORY, Point, Scan, Scanner};
use crate::radar::View;

/// Clusters that are asked, those of most points first; more are not people.
pub(super) const MOST_CLUSTERS: usize = 8;

/// Share of the frames in which a cluster must be detected: what comes and goes is noise.
const PERSISTENT: f64 = 0.5;

/// What the counter is told.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CounterOptions {
    /// Detection.
    pub cfar: CfarOptions,
    /// Clustering.
    pub cluster: ClusterOptions,
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

    /// Detections of a frame. `maps`: one a view, C order, missing cells filled; `before`: the frames before it in its
    /// sequence, the latest first, at most [`HISTORY`] are looked at.
    ///
    /// # Errors
    /// Where the maps are not those of the views, or hold no number.
    pub fn scan(&self, maps: &[&[f64]], before: &[&Scan]) -> Result<Scan, PeopleError> {
        self.scanner.scan(maps, before)
    }

    /// The count of a scanned frame, given those before it, the latest first.
    pub fn count(&self, now: &Scan, before: &[&Scan]) -> Count {
        let Described { clusters, loose, features, rest } = self.describe(now, before);
        let asked: Vec<[f64; CLASSES]> = features.iter().map(|x| self.network.probabilities(x)).collect();
        let sum = asked.iter().fold(self.network.probabilities(&rest), |sum, p| convolve(&sum, p));
        let clusters =
            clusters.into_iter().zip(asked).map(|(cluster, probabilities)| Counted { cluster, probabilities });
        Count { probabilities: sum, clusters: clusters.collect(), loose }
    }

    /// Clusters and what the classifier sees of them.
    pub(super) fn describe(&self, now: &Scan, before: &[&Scan]) -> Described {
        // What stands still in a sequence's first frame would be clutter among what moves.
        let before: Vec<&&Scan> = before.iter().take(HISTORY).filter(|scan| scan.moving == now.moving).collect();
        let aged = |(age, scan): (usize, &&&Scan)| {
            let age = age as u8 + 1;
            scan.points.iter().map(move |point| Point { age, ..*point }).collect::<Vec<Point>>()
        };
        let mut points = now.points.clone();
        points.extend(before.iter().enumerate().flat_map(aged));
        let frames = before.len() + 1;
        let (found, rest) = cluster(&points, &self.options.cluster);
        let found = refined(found, &self.options.cluster);
        let described = found.into_iter().map(|points| Cluster::new(points, frames));
        let (mut clusters, passing): (Vec<Cluster>, Vec<Cluster>) =
            described.partition(|cluster| cluster.consistency >= PERSISTENT);
        let rest = passing.into_iter().flat_map(|cluster| cluster.points).chain(rest).collect::<Vec<Point>>();
        clusters.sort_by(|a, b| b.points.len().cmp(&a.points.len()).then(b.intensity.total_cmp(&a.intensity)));
        clusters.truncate(MOST_CLUSTERS);
        let features = clusters.iter().map(|c| c.features(clusters.len(), points.len())).collect();
        let loose = rest.clone();
        let rest = Cluster::new(rest, frames).features(clusters.len(), points.len());
        Described { clusters, loose, features, rest }
    }
}

/// Clusters, the features of each, and those of what belongs to none.
pub(super) struct Described {
    pub(super) clusters: Vec<Cluster>,
    pub(super) loose: Vec<Point>,
    pub(super) features: Vec<[f32; FEATURES]>,
    pub(super) rest: [f32; FEATURES],
}

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

impl Count {
    /// The most probable number of people; 4 stands for 4 or more.
    pub fn people(&self) -> usize {
        (0..CLASSES).fold(0, |best, n| if self.probabilities[n] > self.probabilities[best] { n } else { best })
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
}
