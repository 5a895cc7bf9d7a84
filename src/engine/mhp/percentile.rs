//! numpy's default percentile (linear interpolation), bit for bit, so that a strict comparison with it decides as numpy's.

/// Where a percentile lies among `last + 1` sorted values: the order statistic at or below it, and the weight of the next.
pub(super) fn place(last: usize, q_pct: f64) -> (usize, f64) {
    let at = last as f64 * (q_pct / 100.0);
    let lower = (at.floor() as usize).min(last);
    (lower, at - lower as f64)
}

/// The two order statistics around a percentile and the weight of the upper one.
fn neighbours(values: &[f64], q_pct: f64) -> Option<(f64, f64, f64)> {
    let (lower_index, weight) = place(values.len().checked_sub(1)?, q_pct);
    let mut scratch: Vec<i64> = values.iter().map(|&x| ordered(x)).collect();
    let (_, &mut lower, above) = scratch.select_nth_unstable(lower_index);
    let upper = above.iter().copied().min().unwrap_or(lower);
    Some((unordered(lower), unordered(upper), weight))
}

/// numpy's lerp, with its second branch at t ≥ ½.
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    if t >= 0.5 { b - (b - a) * (1.0 - t) } else { a + (b - a) * t }
}

/// The percentile between two neighbouring order statistics, `t` the weight of the upper one.
pub(super) fn between(a: f64, b: f64, t: f64) -> f64 {
    match a == b {
        true => a,
        // What numpy loses to an overflow: the two lie farther apart than the largest number.
        false if !(b - a).is_finite() => a * (1.0 - t) + b * t,
        false => lerp(a, b, t),
    }
}

/// The `q_pct` percentile of `values` (q in 0 ..= 100); NaN where there are none.
pub fn percentile(values: &[f64], q_pct: f64) -> f64 {
    neighbours(values, q_pct).map_or(f64::NAN, |(a, b, t)| between(a, b, t))
}

/// Several percentiles of `values` in one go, each as [`percentile`] gives it; `q_pct` must not fall. `scratch` is
/// overwritten and may be handed in again, so that a scan of many maps allocates once.
pub fn percentiles<const N: usize>(values: &[f64], q_pct: [f64; N], scratch: &mut Vec<i64>) -> [f64; N] {
    let Some(last) = values.len().checked_sub(1) else { return [f64::NAN; N] };
    scratch.clear();
    scratch.extend(values.iter().map(|&x| ordered(x)));
    // Everything before `begin` is at or below everything after it: each percentile is looked for above the one before.
    let (mut rest, mut begin) = (&mut scratch[..], 0);
    q_pct.map(|q| {
        let (lower_index, weight) = place(last, q);
        let (_, &mut lower, above) = rest.select_nth_unstable(lower_index.saturating_sub(begin));
        let upper = above.iter().copied().min().unwrap_or(lower);
        // The slice kept starts at the order statistic itself, for the next percentile may share it.
        let from = lower_index.saturating_sub(begin);
        rest = std::mem::take(&mut rest).get_mut(from..).unwrap_or_default();
        begin = lower_index;
        between(unordered(lower), unordered(upper), weight)
    })
}

/// A float as an integer that sorts as [`f64::total_cmp`] does: integers are partitioned several times as fast.
fn ordered(x: f64) -> i64 {
    unfold(x.to_bits() as i64)
}

fn unordered(key: i64) -> f64 {
    f64::from_bits(unfold(key) as u64)
}

/// Its own inverse.
fn unfold(bits: i64) -> i64 {
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_numpy() {
        // numpy.percentile([3.0, 1.0, 4.0, 1.5, 9.0, 2.6], [0, 10, 37, 90, 100])
        let values = [3.0, 1.0, 4.0, 1.5, 9.0, 2.6];
        let want = [1.0, 1.25, 2.435, 6.5, 9.0];
        for (q, want) in [0.0, 10.0, 37.0, 90.0, 100.0].into_iter().zip(want) {
            assert!((percentile(&values, q) - want).abs() < 1e-12, "{q}: {}", percentile(&values, q));
        }
    }

    #[test]
    fn a_value_that_is_the_percentile_comes_back_exactly() {
        let values = [1e-30, 1e-30, 1e-30, 0.05];
        assert_eq!(percentile(&values, 50.0), 1e-30);
        assert_eq!(percentile(&values, 100.0), 0.05);
        assert!(percentile(&[], 50.0).is_nan());
    }

    #[test]
    fn what_lies_between_the_ends_of_all_numbers_is_finite() {
        assert_eq!(percentile(&[-1.6e308, 1.6e308], 50.0), 0.0);
        assert_eq!(percentile(&[-1.6e308, 1.6e308], 100.0), 1.6e308);
    }

    #[test]
    fn several_at_once_are_those_one_by_one() {
        let mut state = 1_u64;
        let mut scratch = Vec::new();
        for count in [1, 2, 3, 7, 40, 333] {
            let values: Vec<f64> = (0..count)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    // Ties, both signs and both zeros.
                    f64::from((state >> 60) as i32 - 8) * if state & 4 == 0 { 0.1 } else { -1e200 }
                })
                .collect();
            for q in [[0.0, 100.0], [90.0, 95.0], [95.0, 95.0], [0.1, 0.2], [99.8, 99.9]] {
                assert_eq!(percentiles(&values, q, &mut scratch), q.map(|q| percentile(&values, q)), "{count} {q:?}");
            }
        }
        assert!(percentiles(&[], [5.0, 6.0], &mut scratch).iter().all(|x| x.is_nan()));
    }
}
