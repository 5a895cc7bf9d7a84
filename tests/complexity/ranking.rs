//! `rank`: what holds for any statistics.

use super::naive::normalised;
use mhp_inspector::study::complexity::{Complexity, ComplexityOptions, Statistics, Stratum, rank};
use proptest::prelude::*;

/// Few different values, hence ties; some undefined; some frames that could not be read.
fn statistics() -> impl Strategy<Value = Vec<Option<Statistics>>> {
    let value = || prop::option::weighted(0.8, (0_u8..12).prop_map(|x| f64::from(x) / 11.0));
    let frame = (value(), value(), value()).prop_map(|(peak_density, static_dominance, human_saliency)| Statistics {
        peak_density,
        static_dominance,
        human_saliency,
    });
    prop::collection::vec(prop::option::weighted(0.9, frame), 0..80)
}

fn ranked(statistics: &[Option<Statistics>]) -> Complexity {
    rank(ComplexityOptions::default(), statistics)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn order_does_not_matter(all in statistics(), turn in 0_usize..80) {
        let mut turned = all.clone();
        turned.rotate_left(turn % all.len().max(1));
        turned.reverse();
        let mut frames = ranked(&all).frames;
        frames.rotate_left(turn % all.len().max(1));
        frames.reverse();
        prop_assert_eq!(ranked(&turned).frames, frames);
    }

    #[test]
    fn hardness_lies_in_0_to_1_and_is_the_mean_of_counted_ranks(all in statistics()) {
        let column = |of: fn(&Statistics) -> Option<f64>| -> Vec<Option<f64>> {
            normalised(&all.iter().map(|s| s.as_ref().and_then(of)).collect::<Vec<_>>())
        };
        let ranks = [column(|s| s.peak_density), column(|s| s.static_dominance), column(|s| s.human_saliency)];
        for (i, frame) in ranked(&all).frames.iter().enumerate() {
            prop_assert_eq!(frame.is_none(), all[i].is_none());
            let mut parts: Vec<f64> = ranks[..2].iter().filter_map(|rank| rank[i]).collect();
            parts.extend(ranks[2][i].map(|rank| 1.0 - rank));
            let hardness = frame.and_then(|frame| frame.hardness);
            prop_assert_eq!(hardness.is_some(), !parts.is_empty());
            if let Some(hardness) = hardness {
                prop_assert!((0.0..=1.0).contains(&hardness));
                prop_assert!((hardness - parts.iter().sum::<f64>() / parts.len() as f64).abs() < 1e-12);
            }
            prop_assert_eq!(frame.and_then(|frame| frame.stratum).is_some(), hardness.is_some());
        }
    }

    #[test]
    fn strata_are_ordered_and_no_more_than_a_third_is_hard(all in statistics()) {
        let complexity = ranked(&all);
        let mut sorted: Vec<(f64, Stratum)> =
            complexity.frames.iter().flatten().filter_map(|frame| Some((frame.hardness?, frame.stratum?))).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        prop_assert!(sorted.windows(2).all(|pair| pair[0].1 <= pair[1].1));
        prop_assert!(sorted.windows(2).all(|pair| pair[0].0 != pair[1].0 || pair[0].1 == pair[1].1));
        let counts = complexity.counts;
        let n = sorted.len();
        prop_assert_eq!(counts.easy + counts.medium + counts.hard, n);
        prop_assert_eq!(counts.unranked + counts.failed, all.len() - n);
        // With numpy's percentile at least ⌊(n − 1)/3⌋ + 1 frames lie at or below the first bound.
        prop_assert!(n == 0 || counts.easy > (n - 1) / 3 || (n - 1).is_multiple_of(3) && counts.easy >= (n - 1) / 3);
        prop_assert!(counts.hard <= n.div_ceil(3));
    }

    /// Only order counts: any rising map of a statistic leaves hardness as it is.
    #[test]
    fn a_rising_map_of_a_statistic_changes_no_hardness(all in statistics()) {
        let risen: Vec<_> = all
            .iter()
            .map(|s| s.map(|s| Statistics { peak_density: s.peak_density.map(|x| (3.0 * x).exp() - 20.0), ..s }))
            .collect();
        let hardness = |c: &Complexity| c.frames.iter().map(|f| f.and_then(|f| f.hardness)).collect::<Vec<_>>();
        prop_assert_eq!(hardness(&ranked(&all)), hardness(&ranked(&risen)));
    }
}

#[test]
fn distinct_hardnesses_make_thirds() {
    let all: Vec<_> = (0..30)
        .map(|i| Some(Statistics { peak_density: Some(f64::from(i)), static_dominance: None, human_saliency: None }))
        .collect();
    let counts = ranked(&all).counts;
    assert_eq!((counts.easy, counts.medium, counts.hard), (10, 10, 10));
    assert_eq!(ranked(&[]).frames, []);
}

#[test]
fn numbers_that_are_none_count_as_undefined() {
    let of = |x: f64| Some(Statistics { peak_density: Some(x), static_dominance: Some(1.0), human_saliency: None });
    let complexity = ranked(&[of(f64::NAN), of(1.0), of(2.0), of(f64::INFINITY)]);
    let hardness: Vec<_> = complexity.frames.iter().map(|frame| frame.unwrap().hardness.unwrap()).collect();
    assert_eq!(hardness, [0.5, 0.25, 0.75, 0.5]);
}
