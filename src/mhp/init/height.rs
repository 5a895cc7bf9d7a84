//! How high a body stands: the extent of what is lit above and below the place where it was found.

use super::evidence::{DEPTH_LN, Evidence, SPECKLE};
use crate::geometry::Vec3;

/// Where the middle of a body is expected when nothing tells its height: a radar stands at about chest height, m.
const UNSEEN_MIDDLE_M: f64 = -0.2;
/// A joint's echo may be this far before or behind the body's middle, m.
const REACH_M: f64 = 0.35;
const STEP_M: f64 = 0.04;
/// Dark stretches up to this length do not end a body, m.
const LARGEST_GAP_M: f64 = 0.2;
/// An extent outside this is no whole standing body, m.
const PLAUSIBLE_M: (f64, f64) = (1.2, 2.2);

/// How far above the head its echo still stands out, m: the mean over simulated people.
const HALO_M: f64 = 0.12;
/// Stature of adults and its standard deviation, and that of the top of the echo, m.
const STATURE_M: f64 = 1.70;
const STATURE_SPREAD_M: f64 = 0.13;
const TOP_SPREAD_M: f64 = 0.08;
/// Who does not reach this height sits, m.
const SITTING_M: f64 = 1.36;
/// An echo that ends higher above the floor than this misses the feet, and may miss the head as well, m.
const FEET_M: f64 = 0.15;

/// What the top of an echo says of somebody on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stature {
    /// Most likely stature, m.
    pub height_m: f64,
    /// Whether the head is lower than that of anybody who stands.
    pub sits: bool,
}

impl Stature {
    /// From the lowest and highest lit height (world frame, m), where they are seen, for a radar `radar_height_m` above the
    /// floor.
    pub(super) fn new(extent_m: Option<[f64; 2]>, radar_height_m: f64) -> Self {
        let whole = extent_m.filter(|[low, _]| low + radar_height_m < FEET_M);
        let Some(seen_m) = whole.map(|[_, top]| top - HALO_M + radar_height_m) else {
            return Self { height_m: STATURE_M, sits: false };
        };
        let trust = STATURE_SPREAD_M.powi(2) / (STATURE_SPREAD_M.powi(2) + TOP_SPREAD_M.powi(2));
        Self { height_m: STATURE_M + trust * (seen_m - STATURE_M), sits: seen_m < SITTING_M }
    }
}

/// Where the middle of the body is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expectation {
    /// Height of the middle, world frame, m.
    pub middle_m: f64,
    /// Lowest and highest lit height, m, where they were seen.
    pub extent_m: Option<[f64; 2]>,
}

impl Expectation {
    /// Looks for feet and head of a body found near `at`.
    pub(super) fn new(evidence: &[Evidence<'_>], at: Vec3) -> Self {
        let telling: Vec<&Evidence<'_>> = evidence.iter().filter(|e| e.resolves_height(at)).collect();
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
        let extent_m = extent_around(&heights, at[2])
            .filter(|[low, high]| (PLAUSIBLE_M.0..=PLAUSIBLE_M.1).contains(&(high - low)));
        match extent_m {
            Some([low, high]) => Self { middle_m: f64::midpoint(low, high), extent_m },
            None => Self { middle_m: UNSEEN_MIDDLE_M, extent_m },
        }
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
        let stature = |extent_m| Stature::new(extent_m, 1.0);
        assert_eq!(stature(None), Stature { height_m: STATURE_M, sits: false });
        let (tall, small) = (stature(Some([-1.0, 1.0])), stature(Some([-1.0, 0.65])));
        assert!(tall.height_m > 1.8 && tall.height_m < 1.88 && small.height_m < 1.62);
        assert!(!tall.sits && !small.sits && stature(Some([-1.0, 0.4])).sits);
        assert!(!stature(Some([-0.5, 0.4])).sits, "without feet the head may be missed too");
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
