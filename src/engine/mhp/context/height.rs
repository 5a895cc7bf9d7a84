//! How high a body stands: the extent of what is lit above and below the place where it was found.

use super::saliency::{DEPTH_LN, SPECKLE, SaliencyMap};
use crate::geometry::Vec3;
use crate::mhp::percentile;

/// Where the middle of a body is expected when nothing tells its height: a radar stands at about chest height, m.
const UNSEEN_MIDDLE_M: f64 = -0.2;
/// A joint's echo may be this far before or behind the body's middle, m.
const REACH_M: f64 = 0.35;
const STEP_M: f64 = 0.04;
/// Dark stretches up to this length do not end a body, m.
const LARGEST_GAP_M: f64 = 0.2;
/// An extent outside this is no whole standing body, m.
const PLAUSIBLE_M: (f64, f64) = (1.2, 2.2);

/// How far above the head its echo still stands out beyond [`SHARED_HALO`] of what it does below the feet, m, and that
/// share: least squares over simulated people.
const HALO_M: f64 = 0.05;
const SHARED_HALO: f64 = 0.58;
/// What is lit lower than this below the floor is no foot; then feet are taken to shine as far below it as they usually do, m.
const LOWEST_FOOT_M: f64 = -0.35;
const USUAL_FOOT_M: f64 = -0.12;
/// Stature of adults and its standard deviation, and that of the top of the echo, m.
const STATURE_M: f64 = 1.72;
const STATURE_SPREAD_M: f64 = 0.13;
const TOP_SPREAD_M: f64 = 0.09;
/// An echo that ends higher above the floor than this misses the feet: it may be a piece of a body, m.
const FEET_M: f64 = 0.15;
/// What exceeds this is nobody, m.
const TALLEST_M: f64 = 2.1;
/// ln of L_EM of a bent body over that of an upright one up to which somebody is believed to sit, sit down or get up: at 0,
/// less a metre of the head's height, more for each m/s towards or away from the radar (where the chair is), less for each
/// sideways. Logistic regression over simulated people who do not walk.
const BENT_LN: f64 = 1.6;
const BENT_LN_PER_M: f64 = 1.11;
const BENT_LN_PER_MPS_ALONG: f64 = 0.90;
const BENT_LN_PER_MPS_ACROSS: f64 = 0.47;

/// What the top of an echo says of somebody on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mhp) struct Stature {
    /// Most likely stature of somebody who stands, m.
    pub standing_m: f64,
    /// Height of the head's top where feet and head are seen, m.
    pub top_m: Option<f64>,
}

impl Stature {
    /// From the lowest and highest lit heights (world frame, m) in the frames that show any, for a radar `radar_height_m`
    /// above the floor.
    pub(in crate::mhp) fn new(lit_m: impl Iterator<Item = [f64; 2]>, radar_height_m: f64) -> Self {
        let (lows, tops): (Vec<f64>, Vec<f64>) = lit_m.map(|[low, top]| (low, top)).unzip();
        let unknown = Self { standing_m: STATURE_M, top_m: None };
        if lows.is_empty() {
            return unknown;
        }
        let [low, top] = [lows, tops].map(|heights| percentile(&heights, 50.0) + radar_height_m);
        // What shines beyond the feet shines beyond the head; feet are often dark, heads are not.
        let foot = if low < LOWEST_FOOT_M { USUAL_FOOT_M } else { low.min(0.0) };
        let seen_m = top + SHARED_HALO * foot - HALO_M;
        if seen_m > TALLEST_M {
            return unknown;
        }
        let trust = STATURE_SPREAD_M.powi(2) / (STATURE_SPREAD_M.powi(2) + TOP_SPREAD_M.powi(2));
        Self { standing_m: STATURE_M + trust * (seen_m - STATURE_M), top_m: (low < FEET_M).then_some(seen_m) }
    }
}

/// The share of an upright body's L_EM below which a bent one is believed of somebody whose head is seen at `top_m` and whose
/// middle moves at these speeds along the line from the radar and across it, m/s.
pub(in crate::mhp) fn bent_if_below(top_m: f64, [along, across]: [f64; 2]) -> f64 {
    (BENT_LN - BENT_LN_PER_M * top_m + BENT_LN_PER_MPS_ALONG * along - BENT_LN_PER_MPS_ACROSS * across).exp()
}

/// Where the middle of the body is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mhp) struct Expectation {
    /// Height of the middle, world frame, m.
    pub middle_m: f64,
    /// Lowest and highest lit height around the place, m.
    pub lit: Option<[f64; 2]>,
    /// The same where they may be feet and head of somebody who stands or sits.
    pub extent_m: Option<[f64; 2]>,
}

impl Expectation {
    /// Looks for feet and head of a body found near `at`.
    pub(in crate::mhp) fn new(maps: &[SaliencyMap], at: Vec3) -> Self {
        let telling: Vec<&SaliencyMap> = maps.iter().filter(|e| e.resolves(at, [0.0, 0.0, 1.0])).collect();
        let salience = |z: f64| {
            let sum: f64 = telling.iter().map(|e| e.salience_at_height(at, z, REACH_M)).sum();
            sum / telling.len().max(1) as f64
        };
        let profile: Vec<(f64, f64)> =
            (-50..=50).map(|k| at[2] + STEP_M * f64::from(k)).map(|z| (z, salience(z))).collect();
        // Where a body is bright its sidelobes rise over the background too, above its head and below its feet.
        let strongest = profile.iter().map(|(_, salience)| *salience).fold(0.0, f64::max);
        let level = SPECKLE.max(strongest - DEPTH_LN);
        let heights: Vec<f64> = profile.into_iter().filter(|(_, salience)| *salience > level).map(|(z, _)| z).collect();
        let lit = extent_around(&heights, at[2]);
        let extent_m = lit.filter(|[low, high]| (PLAUSIBLE_M.0..=PLAUSIBLE_M.1).contains(&(high - low)));
        let middle_m = extent_m.map_or(UNSEEN_MIDDLE_M, |[low, high]| f64::midpoint(low, high));
        Self { middle_m, lit, extent_m }
    }
}

/// First and last of the rising `heights` that hang together with the one nearest to `z_m`.
fn extent_around(heights: &[f64], z_m: f64) -> Option<[f64; 2]> {
    let nearest = (0..heights.len()).min_by(|&a, &b| (heights[a] - z_m).abs().total_cmp(&(heights[b] - z_m).abs()))?;
    let joined = |pair: &[f64]| pair[1] - pair[0] <= LARGEST_GAP_M;
    let below = heights[..=nearest].windows(2).rev().take_while(|pair| joined(pair)).count();
    let above = heights[nearest..].windows(2).take_while(|pair| joined(pair)).count();
    Some([heights[nearest - below], heights[nearest + above]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_tells_who_is_tall_and_who_sits() {
        let stature = |lit_m: &[[f64; 2]]| Stature::new(lit_m.iter().copied(), 1.0);
        let unknown = Stature { standing_m: STATURE_M, top_m: None };
        assert_eq!(stature(&[]), unknown);
        let (tall, small) = (stature(&[[-1.1, 1.0]]), stature(&[[-1.1, 0.65]]));
        assert!(tall.standing_m > 1.8 && tall.standing_m < 1.9 && small.standing_m < 1.65);
        let sits = stature(&[[-1.1, 0.4], [-1.1, 0.8], [-1.1, 0.38]]).top_m;
        assert!(sits.is_some_and(|top| top < 1.4), "one frame of three is not believed");
        assert!(stature(&[[-0.5, 0.3]]).top_m.is_none(), "without feet it may be a piece");
        assert_eq!(stature(&[[-1.1, 1.6]]), unknown, "nobody is that tall");
    }

    #[test]
    fn the_lower_a_head_and_the_more_it_comes_and_goes_the_likelier_somebody_sits() {
        let better = |top_m: f64, along: f64, across: f64| bent_if_below(top_m, [along, across]);
        assert!(better(1.3, 0.0, 0.0) > 1.1 && better(1.6, 0.0, 0.0) < 0.9);
        assert!(better(1.6, 0.3, 0.0) > 1.05 && better(1.6, 0.0, 0.3) < better(1.6, 0.0, 0.0));
    }

    #[test]
    fn what_shines_below_the_feet_is_taken_off_the_head() {
        let stature = |low: f64| Stature::new([[low, 0.8]].into_iter(), 1.0).standing_m;
        assert!(stature(-1.2) < stature(-1.0) && stature(-0.5) == stature(-1.0), "dark feet say nothing");
        assert!((stature(-1.9) - stature(-1.0 + USUAL_FOOT_M)).abs() < 1e-12, "a ghost below the floor neither");
    }

    #[test]
    fn an_extent_ends_at_a_gap() {
        let heights = [-2.0, -1.0, -0.9, -0.75, 0.0, 0.1, 0.25, 0.9];
        assert_eq!(extent_around(&heights, -0.8), Some([-1.0, -0.75]));
        assert_eq!(extent_around(&heights, 0.2), Some([0.0, 0.25]));
        assert_eq!(extent_around(&heights, 5.0), Some([0.9, 0.9]));
        assert_eq!(extent_around(&[], 0.0), None);
    }
}
