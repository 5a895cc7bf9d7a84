//! Several bodies are not in one another, and each is where it was counted.
//!
//! Of two people who stand close a radar often shows one echo, and both bodies are drawn to it. L_prior therefore has, for every
//! pair of persons whose hips are nearer than shoulders let them stand side by side,
//!
//! ```text
//! ((D − d)/σ_d)² where d < D,  d = |t_a − t_b| on the floor plan,  D = 0.45 m, σ_d = 0.05 m
//! ```
//!
//! with t where the hips are in the middle of the window, and the same with t the middle of all joints in the frame that is fitted,
//! for hips apart under one pair of shoulders are no two people; and one for every person who is farther from where it began, t₀, than
//! counting is wrong by: who stands where static echoes were removed is not seen, and his body would go to where others are
//!
//! ```text
//! ((d₀ − D₀)/σ₀)² where d₀ > D₀,  d₀ = |t − t₀|,  D₀ = 0.35 m, σ₀ = 0.1 m
//! ```
//!
//! The search begins where people were counted, the fit where the search ended. One alone goes where he wants.

/// D and σ_d, m.
const NEAREST_M: f64 = 0.45;
const SPREAD_M: f64 = 0.05;
/// D₀ and σ₀, m.
const FREE_M: f64 = 0.35;
const ASTRAY_M: f64 = 0.1;
/// The least d, m: two at one point have a slope of zero instead of none.
const LEAST_M: f64 = 1e-6;

/// The sum over the pairs of persons at these `places`; `pull` is told of persons `gain` times its gradient by where they are.
pub(super) fn overlap(places: &[[f64; 2]], gain: f64, mut pull: impl FnMut(usize, [f64; 2])) -> f64 {
    let mut sum = 0.0;
    for a in 0..places.len() {
        for b in 0..a {
            let way = [0, 1].map(|k| places[a][k] - places[b][k]);
            let distance = way[0].hypot(way[1]).max(LEAST_M);
            if distance >= NEAREST_M {
                continue;
            }
            let off = (NEAREST_M - distance) / SPREAD_M;
            sum += off * off;
            let slope = -2.0 * gain * off / (SPREAD_M * distance);
            pull(a, way.map(|x| slope * x));
            pull(b, way.map(|x| -slope * x));
        }
    }
    sum
}

/// The sum over the persons, of `stride` coordinates each, of how far each is from its own of `places`, where it began; adds `gain`
/// times its gradient to `bars`.
pub(super) fn astray(coordinates: &[f64], stride: usize, places: &[[f64; 2]], gain: f64, bars: &mut [f64]) -> f64 {
    let mut sum = 0.0;
    for (k, place) in places.iter().enumerate() {
        let at = k * stride;
        let way = [0, 1].map(|axis| coordinates[at + axis] - place[axis]);
        let distance = way[0].hypot(way[1]).max(LEAST_M);
        let off = (distance - FREE_M).max(0.0) / ASTRAY_M;
        sum += off * off;
        let slope = 2.0 * gain * off / (ASTRAY_M * distance);
        for axis in 0..2 {
            bars[at + axis] += slope * way[axis];
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three persons of three coordinates: two close to each other, one elsewhere.
    const PERSONS: [f64; 9] = [3.0, 0.1, 0.0, 3.1, 0.25, 0.4, 3.0, 1.5, 0.0];

    /// What `of` says of the three persons; its slope is compared with central differences.
    fn checked(of: impl Fn(&[f64], f64, &mut [f64]) -> f64) -> f64 {
        let mut bars = [0.0; 9];
        let value = of(&PERSONS, 0.7, &mut bars);
        for (k, got) in bars.iter().enumerate() {
            let at = |offset: f64| {
                let mut moved = PERSONS;
                moved[k] += offset;
                of(&moved, 0.0, &mut [0.0; 9])
            };
            let slope = 0.7 * (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((got - slope).abs() < 1e-6, "{k}: {got}, {slope}");
        }
        value
    }

    #[test]
    fn who_stands_in_another_is_pushed_away() {
        let value = checked(|coordinates, gain, bars| {
            let places: Vec<[f64; 2]> = coordinates.chunks_exact(3).map(|of| [of[0], of[1]]).collect();
            overlap(&places, gain, |person, slope| {
                bars[3 * person] += slope[0];
                bars[3 * person + 1] += slope[1];
            })
        });
        let distance = 0.1f64.hypot(0.15);
        assert!((value - ((0.45 - distance) / 0.05).powi(2)).abs() < 1e-9);
    }

    #[test]
    fn who_went_astray_is_pulled_back_and_who_is_near_is_free() {
        // The second began 0.5 m from where he is, the third 0.3 m.
        let places = [[3.0, 0.1], [3.4, -0.15], [3.0, 1.8]];
        let value = checked(|coordinates, gain, bars| astray(coordinates, 3, &places, gain, bars));
        assert!((value - 1.5 * 1.5).abs() < 1e-9, "{value}");
        assert!(astray(&PERSONS, 3, &[], 1.0, &mut [0.0; 9]) == 0.0);
    }

    #[test]
    fn one_alone_and_two_at_one_point_are_finite() {
        let mut pulls = Vec::new();
        assert!(overlap(&[[1.0, 2.0]], 1.0, |_, slope| pulls.push(slope)) == 0.0 && pulls.is_empty());
        let both = overlap(&[[1.0, 2.0]; 2], 1.0, |_, slope| pulls.push(slope));
        assert!((both - 81.0).abs() < 1e-3 && pulls.as_flattened().iter().all(|slope| *slope == 0.0));
    }
}
