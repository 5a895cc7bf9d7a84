//! From statistics to hardness and strata: pure, and blind to anything but order.

use super::types::Counts;
use super::{Complexity, ComplexityOptions, FrameComplexity, Statistics, Stratum};
use crate::mhp::percentile;

/// Ranks the frames of a data set among each other. A statistic's normalised rank is (rank − 1)/(n − 1) over the n frames
/// where it is defined, ties averaged, human saliency reversed; hardness is the mean of those that a frame has. Where
/// n is 1 the rank is 0/0 and left out. `None` is a frame that could not be read; numbers that are not finite count as
/// undefined.
pub fn rank(options: ComplexityOptions, statistics: &[Option<Statistics>]) -> Complexity {
    let column = |of: fn(&Statistics) -> Option<f64>| -> Vec<Option<f64>> {
        normalised(&statistics.iter().map(|s| s.as_ref().and_then(of).filter(|x| x.is_finite())).collect::<Vec<_>>())
    };
    let peaks = column(|s| s.peak_density);
    let statics = column(|s| s.static_dominance);
    let saliencies = column(|s| s.human_saliency);
    let hardness: Vec<Option<f64>> = peaks
        .into_iter()
        .zip(statics)
        .zip(saliencies)
        .map(|((peak, stays), human)| mean([peak, stays, human.map(|rank| 1.0 - rank)]))
        .collect();
    let defined: Vec<f64> = hardness.iter().copied().flatten().collect();
    let bounds = [100.0 / 3.0, 200.0 / 3.0].map(|q| percentile(&defined, q));
    let frames: Vec<Option<FrameComplexity>> = statistics
        .iter()
        .zip(hardness)
        .map(|(&statistics, hardness)| {
            let stratum = hardness.map(|hardness| stratum(hardness, bounds));
            statistics.map(|statistics| FrameComplexity { statistics, hardness, stratum })
        })
        .collect();
    let counts = Counts::of(&frames);
    Complexity { options, frames, failures: Vec::new(), counts, scanned: 0 }
}

fn stratum(hardness: f64, [easy, medium]: [f64; 2]) -> Stratum {
    if hardness <= easy {
        Stratum::Easy
    } else if hardness <= medium {
        Stratum::Medium
    } else {
        Stratum::Hard
    }
}

fn mean(values: [Option<f64>; 3]) -> Option<f64> {
    let defined = values.into_iter().flatten();
    let count = defined.clone().count();
    (count > 0).then(|| defined.sum::<f64>() / count as f64)
}

/// (rank − 1)/(n − 1) of each defined value, equal values sharing the mean of their ranks.
fn normalised(values: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut order: Vec<(f64, usize)> = values.iter().enumerate().filter_map(|(i, x)| x.map(|x| (x, i))).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut ranks = vec![None; values.len()];
    let Some(last) = order.len().checked_sub(1).filter(|&last| last > 0) else { return ranks };
    let mut first = 0;
    // Both zeros are one number, which `total_cmp` only sorts side by side.
    for tied in order.chunk_by(|a, b| a.0 == b.0) {
        let middle = (2 * first + tied.len() - 1) as f64 / 2.0;
        for &(_, i) in tied {
            if let Some(rank) = ranks.get_mut(i) {
                *rank = Some(middle / last as f64);
            }
        }
        first += tied.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_share_the_mean_of_their_ranks() {
        let values = [Some(3.0), None, Some(0.0), Some(-0.0), Some(3.0), Some(3.0)];
        let want = [Some(3.0 / 4.0), None, Some(0.125), Some(0.125), Some(0.75), Some(0.75)];
        assert_eq!(normalised(&values), want);
        assert_eq!(normalised(&[None, Some(1.0)]), [None, None], "one value has no rank");
        assert_eq!(normalised(&[]), []);
    }
}
