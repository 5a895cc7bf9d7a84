//! numpy's default percentile (linear interpolation), bit for bit, so that a strict comparison with it decides as numpy's.

/// The two order statistics around a percentile and the weight of the upper one.
fn neighbours(values: &[f64], q_pct: f64) -> Option<(f64, f64, f64)> {
    let last = values.len().checked_sub(1)?;
    let at = last as f64 * (q_pct / 100.0);
    let lower_index = (at.floor() as usize).min(last);
    let weight = at - lower_index as f64;
    let mut scratch = values.to_vec();
    let (_, &mut lower, above) = scratch.select_nth_unstable_by(lower_index, f64::total_cmp);
    let upper = above.iter().copied().min_by(f64::total_cmp).unwrap_or(lower);
    Some((lower, upper, weight))
}

/// numpy's lerp, with its second branch at t ≥ ½.
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    if t >= 0.5 { b - (b - a) * (1.0 - t) } else { a + (b - a) * t }
}

/// The `q_pct` percentile of `values` (q in 0 ..= 100); NaN where there are none.
pub(crate) fn percentile(values: &[f64], q_pct: f64) -> f64 {
    neighbours(values, q_pct).map_or(f64::NAN, |(a, b, t)| if a == b { a } else { lerp(a, b, t) })
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
}
