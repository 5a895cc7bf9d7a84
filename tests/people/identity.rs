//! Who is who: assignment, and identities kept from frame to frame.
#![expect(clippy::unwrap_used, reason = "a test that finds nobody has failed")]

use mhp_inspector::people::{Tracker, TrackerOptions, match_people};
use proptest::prelude::*;

/// The least sum over all ways to pair rows and columns, most pairs first.
fn least(cost: &[Vec<f64>], row: usize, used: &mut Vec<bool>) -> (usize, f64) {
    let Some(line) = cost.get(row) else { return (0, 0.0) };
    let mut best = least(cost, row + 1, used);
    for (column, &price) in line.iter().enumerate().filter(|(_, price)| price.is_finite()) {
        if !used[column] {
            used[column] = true;
            let (pairs, sum) = least(cost, row + 1, used);
            used[column] = false;
            if pairs + 1 > best.0 || (pairs + 1 == best.0 && sum + price < best.1) {
                best = (pairs + 1, sum + price);
            }
        }
    }
    best
}

proptest! {
    #[test]
    fn the_assignment_is_the_cheapest_of_all(
        rows in 0_usize..5, columns in 0_usize..5, prices in prop::collection::vec(0.0_f64..9.0, 25),
        forbidden in prop::collection::vec(prop::bool::weighted(0.25), 25),
    ) {
        let price = |k: usize| if forbidden[k] { f64::INFINITY } else { prices[k] };
        let cost: Vec<Vec<f64>> = (0..rows).map(|i| (0..columns).map(|j| price(5 * i + j)).collect()).collect();
        let matched = match_people(&cost);
        prop_assert_eq!(matched.len(), rows);
        let mut columns_used: Vec<usize> = matched.iter().flatten().copied().collect();
        let pairs = columns_used.len();
        columns_used.sort_unstable();
        columns_used.dedup();
        prop_assert_eq!(columns_used.len(), pairs, "one to one");
        let sum: f64 = matched.iter().enumerate().filter_map(|(i, j)| j.map(|j| cost[i][j])).sum();
        let (most, lowest) = least(&cost, 0, &mut vec![false; columns]);
        prop_assert_eq!(pairs, most);
        prop_assert!((sum - lowest).abs() < 1e-5, "{} instead of {}", sum, lowest);
    }
}

#[test]
fn nothing_and_nonsense_match_nobody() {
    assert_eq!(match_people(&[]), Vec::<Option<usize>>::new());
    assert_eq!(match_people(&[vec![], vec![]]), [None, None]);
    assert_eq!(match_people(&[vec![f64::NAN, 1.0], vec![f64::NEG_INFINITY, f64::INFINITY]]), [Some(1), None]);
    assert_eq!(match_people(&[vec![3.0], vec![1.0, 2.0]]), [Some(0), Some(1)], "short rows");
    assert_eq!(match_people(&[vec![1e300, 2e300], vec![5.0, 1e300]]), [Some(1), Some(0)]);
}

#[test]
fn people_who_cross_keep_their_identities() {
    let mut tracker = Tracker::new(TrackerOptions::default());
    let at = |t: f64| [[3.0, -1.0 + 1.2 * t, 0.0], [3.25, 1.0 - 1.2 * t, 0.1]];
    let first = tracker.step(&at(0.0), 0.1);
    for k in 1..=16 {
        let [a, b] = at(0.1 * f64::from(k));
        // The detections come in another order every other frame.
        let (places, expected) = if k % 2 == 0 { ([a, b], first.clone()) } else { ([b, a], vec![first[1], first[0]]) };
        assert_eq!(tracker.step(&places, 0.1), expected, "frame {k}");
    }
    let speed = tracker.tracks()[0].velocity[1];
    assert!((speed - 1.2).abs() < 0.1, "{speed} m/s");
}

#[test]
fn who_was_missed_for_a_moment_is_the_same_and_who_was_away_is_new() {
    let mut tracker = Tracker::new(TrackerOptions::default());
    let person = tracker.step(&[[2.0, 0.0, 0.0]], 0.1)[0];
    for _ in 0..5 {
        assert!(tracker.step(&[], 0.1).is_empty());
    }
    assert_eq!(tracker.step(&[[2.2, 0.1, 0.0]], 0.1), [person]);
    for _ in 0..15 {
        tracker.step(&[], 0.1);
    }
    let later = tracker.step(&[[2.2, 0.1, 0.0]], 0.1)[0];
    assert!(later != person, "dead after a second");
    assert_eq!(tracker.tracks().len(), 1);
}

#[test]
fn a_newcomer_far_away_is_nobody_known() {
    let mut tracker = Tracker::new(TrackerOptions::default());
    let known = tracker.step(&[[2.0, 0.0, 0.0], [4.0, 1.0, 0.0]], 0.1);
    let next = tracker.step(&[[4.05, 1.0, 0.0], [6.0, -2.0, 0.0]], 0.1);
    assert_eq!(next[0], known[1]);
    assert!(!known.contains(&next[1]));
    let strange = tracker.step(&[[4.05, 1.0, 0.0]], f64::NAN);
    assert_eq!(strange, [known[1]], "a time that is no number counts as none");
}

#[test]
fn one_frame_a_second_still_follows_a_walker() {
    let mut tracker = Tracker::new(TrackerOptions::default());
    let mut identities = (0..5).map(|k| tracker.step(&[[1.0 + f64::from(k), 0.0, 0.0]], 1.0)[0]);
    let first = identities.next().unwrap();
    assert!(identities.all(|identity| identity == first));
}
