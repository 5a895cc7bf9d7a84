//! Bodies are not in one another.
//!
//! Of two people who stand close a radar often shows one echo, and both bodies are drawn to it. L_prior therefore has, for every
//! pair of persons whose hips are nearer than shoulders let them stand side by side,
//!
//! ```text
//! ((D − d)/σ_d)² where d < D,  d = |t_a − t_b| on the floor plan,  D = 0.4 m, σ_d = 0.1 m
//! ```
//!
//! with t where the hips are in the middle of the window.

/// D and σ_d, m.
const NEAREST_M: f64 = 0.4;
const SPREAD_M: f64 = 0.1;
/// The least d, m: two at one point have a slope of zero instead of none.
const LEAST_M: f64 = 1e-6;

/// The sum over the pairs of persons of `stride` coordinates each; adds `gain` times its gradient to `bars`.
pub(super) fn overlap(coordinates: &[f64], stride: usize, gain: f64, bars: &mut [f64]) -> f64 {
    let persons = coordinates.len() / stride.max(1);
    let mut sum = 0.0;
    for a in 0..persons {
        for b in 0..a {
            let (a, b) = (a * stride, b * stride);
            let way = [0, 1].map(|k| coordinates[a + k] - coordinates[b + k]);
            let distance = way[0].hypot(way[1]).max(LEAST_M);
            let off = (NEAREST_M - distance).max(0.0) / SPREAD_M;
            sum += off * off;
            let slope = -2.0 * gain * off / (SPREAD_M * distance);
            for k in 0..2 {
                bars[a + k] += slope * way[k];
                bars[b + k] -= slope * way[k];
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three persons of three coordinates: two close to each other, one elsewhere.
    const PERSONS: [f64; 9] = [3.0, 0.1, 0.0, 3.1, 0.25, 0.4, 3.0, 1.5, 0.0];

    #[test]
    fn the_slope_agrees_with_central_differences() {
        let mut bars = [0.0; 9];
        let value = overlap(&PERSONS, 3, 0.7, &mut bars);
        let distance = 0.1f64.hypot(0.15);
        assert!((value - ((0.4 - distance) / 0.1).powi(2)).abs() < 1e-12);
        for (k, got) in bars.iter().enumerate() {
            let at = |offset: f64| {
                let mut moved = PERSONS;
                moved[k] += offset;
                overlap(&moved, 3, 0.0, &mut [0.0; 9])
            };
            let slope = 0.7 * (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((got - slope).abs() < 1e-6, "{k}: {got}, {slope}");
        }
    }

    #[test]
    fn one_alone_and_two_at_one_point_are_finite() {
        let mut bars = [0.0; 6];
        assert!(overlap(&PERSONS[..3], 3, 1.0, &mut bars) == 0.0);
        let both = overlap(&[1.0, 2.0, 3.0, 1.0, 2.0, 3.0], 3, 1.0, &mut bars);
        assert!((both - 16.0).abs() < 1e-3 && bars.iter().all(|bar| *bar == 0.0));
    }
}
