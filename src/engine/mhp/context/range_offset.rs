//! By how much the ranges of two radars in one place differ, told by their maps alone.
//!
//! Radars that look from one place see the same echoes at the same ranges, whatever angle they resolve: people, walls and their
//! multipath. What differs is how each range axis begins: cables, the delay of a filter, the sample at which a chirp is taken to
//! begin. Of a real set the two differ by 0.2 m, which no body can explain.
//!
//! The power over all angles at each range, in dB less its course over a metre, is shifted against that of the first view until both
//! correlate best: the mean over the frame and those around it, whatever frames a start may look at, for it is the radars' and no
//! person's. What is found counts where it is larger than 6 cm, explains the profiles clearly better, and explains them well; else it is 0, which is what is found of a simulated radar.
//! Nobody can tell which of the two is right: the offsets of all views have mean 0.

use crate::geometry::{norm, sub};
use crate::radar::{View, ViewSet};

/// Step of the profiles, m.
const STEP_M: f64 = 0.02;
/// The ranges that are compared, m: nearer is leakage.
const NEAREST_M: f64 = 0.6;
const FARTHEST_M: f64 = 6.0;
/// Offsets that are tried, m.
const MOST_M: f64 = 0.5;
/// Steps of a profile.
const STEPS: usize = ((FARTHEST_M + MOST_M) / STEP_M + 0.5) as usize;
/// Standard deviations of the smoothing of a profile, and of the course that is taken away, m; at least of a ring's width.
const SMOOTH_M: f64 = 0.04;
const COURSE_M: f64 = 0.8;
/// A smaller offset is none, m.
const LEAST_M: f64 = 0.06;
/// By how much the correlation is better than without it, and how good it is, at least.
const LEAST_GAIN: f64 = 0.02;
const LEAST_LIKENESS: f64 = 0.7;
/// Views whose radars are farther apart are of different places, m.
const ONE_PLACE_M: f64 = 0.02;
/// Ranges that two profiles have in common at least, m.
const LEAST_COMMON_M: f64 = 1.5;
/// Wider rings tell no offset, m.
const WIDEST_RING_M: f64 = 0.3;
/// Powers below this share of the largest are alike.
const FAINTEST: f64 = 1e-12;

/// The range offset of each view, m: what its map adds to a range beside what is stated. `None` where the maps tell of none: the views are no two of one
/// place that resolve range, or agree. `frames` has the maps of each frame that is looked at, a map a view.
pub(in crate::mhp) fn range_offsets<'a>(
    views: &ViewSet,
    frames: impl Iterator<Item = Vec<&'a [f64]>>,
) -> Option<Vec<f64>> {
    let place = |view: &View| view.pose.world_from_view([0.0; 3]);
    let first = views.first()?;
    let beside = |view: &&View| norm(sub(place(view), place(first))) <= ONE_PLACE_M;
    let alike: Vec<usize> = (0..views.len()).filter(|&k| beside(&&views[k])).collect();
    // Rings as wide as the offsets that are looked for tell none.
    let tells = |&k: &usize| views.grid(k).and_then(|grid| Some(grid.ring_m(1)? - grid.ring_m(0)?));
    if alike.len() < 2 || !alike.iter().all(|k| tells(k).is_some_and(|width| width > 0.0 && width <= WIDEST_RING_M)) {
        return None;
    }
    let lags = (MOST_M / STEP_M).round() as isize;
    let mut likeness = vec![vec![0.0; 2 * lags as usize + 1]; alike.len()];
    let mut count = 0.0;
    let mut ranges = alike.iter().map(|&view| Ranges::new(views, view)).collect::<Option<Vec<_>>>()?;
    for maps in frames {
        let profile = |of: &mut Ranges| of.profile(views, maps.get(of.view)?);
        let Some(profiles) = ranges.iter_mut().map(profile).collect::<Option<Vec<_>>>() else { continue };
        for (sums, of) in likeness.iter_mut().zip(&profiles).skip(1) {
            for (sum, lag) in sums.iter_mut().zip(-lags..=lags) {
                *sum += correlation(&profiles[0], of, lag);
            }
        }
        count += 1.0;
    }
    let mut offsets = vec![0.0; views.len()];
    for (of, &view) in likeness.iter().zip(&alike).skip(1) {
        offsets[view] = best(of, lags as usize, count).unwrap_or(0.0);
    }
    let middle = alike.iter().map(|&view| offsets[view]).sum::<f64>() / alike.len() as f64;
    for &view in &alike {
        offsets[view] -= middle;
    }
    offsets.iter().any(|offset| *offset != 0.0).then_some(offsets)
}

/// The offset at which summed likenesses are largest, m, where it says something.
fn best(likeness: &[f64], lags: usize, count: f64) -> Option<f64> {
    let at = (0..likeness.len()).max_by(|a, b| likeness[*a].total_cmp(&likeness[*b]))?;
    // At an end the best may lie beyond.
    let (before, here, after) = (likeness.get(at.checked_sub(1)?)?, likeness[at], likeness.get(at + 1)?);
    let curvature = before - 2.0 * here + after;
    let within = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    let offset_m = (at as f64 + within - lags as f64) * STEP_M;
    let says = here >= LEAST_LIKENESS * count && here - likeness[lags] >= LEAST_GAIN * count;
    (says && offset_m.abs() >= LEAST_M).then_some(offset_m)
}

/// The ranges that a view has, in steps, and what smooths along them.
struct Ranges {
    view: usize,
    /// The step of each ring, if it is looked at.
    steps: Vec<Option<usize>>,
    fine: Smoothing,
    course: Smoothing,
    /// How many cells the rings of the last map had that are numbers, and what follows from that: it hardly ever changes.
    counted: Vec<f64>,
    cells: Vec<f64>,
    known: Vec<f64>,
}

impl Ranges {
    fn new(views: &ViewSet, view: usize) -> Option<Self> {
        let (grid, of) = (views.grid(view)?, views.get(view)?);
        // What is stated is taken away before anything is measured.
        let step = |ring: usize| ((grid.ring_m(ring).unwrap_or(f64::NAN) - of.psf.range_offset_m) / STEP_M).round();
        let steps = (0..grid.rings()).map(step).map(|at| (0.0..STEPS as f64).contains(&at).then_some(at as usize));
        let sigma = SMOOTH_M.max(0.6 * (grid.ring_m(1)? - grid.ring_m(0)?)) / STEP_M;
        Some(Self {
            view,
            steps: steps.collect(),
            fine: Smoothing::new(sigma),
            course: Smoothing::new(COURSE_M / STEP_M),
            counted: Vec::new(),
            cells: Vec::new(),
            known: Vec::new(),
        })
    }

    /// Powers over all angles by range, ln less their course, `None` at ranges that the map has not; none at all of a dark map.
    fn profile(&mut self, views: &ViewSet, map: &[f64]) -> Option<Vec<Option<f64>>> {
        let (sums, counted) = views.grid(self.view)?.power_by_ring(map, views.get(self.view)?.quantity);
        if self.counted != counted {
            self.cells = self.fine.of(&self.by_step(&counted));
            let there: Vec<f64> = self.cells.iter().map(|&cells| f64::from(u8::from(is_known(cells)))).collect();
            self.known = self.course.of(&there);
            self.counted = counted;
        }
        let power = self.fine.of(&self.by_step(&sums));
        let mean: Vec<Option<f64>> =
            power.iter().zip(&self.cells).map(|(p, cells)| is_known(*cells).then(|| p / cells)).collect();
        let largest = mean.iter().flatten().copied().fold(0.0, f64::max);
        if largest <= 0.0 || !largest.is_finite() {
            return None;
        }
        let levels: Vec<Option<f64>> = mean.iter().map(|p| p.map(|p| (p / largest).max(FAINTEST).ln())).collect();
        // The course is that of the ranges that the map has.
        let filled: Vec<f64> = levels.iter().map(|level| level.unwrap_or(0.0)).collect();
        let course = self.course.of(&filled);
        let less = |(level, (course, known)): (&Option<f64>, (f64, &f64))| level.map(|level| level - course / known);
        Some(levels.iter().zip(course.into_iter().zip(&self.known)).map(less).collect())
    }

    /// The sum of what the rings of each step have.
    fn by_step(&self, of_rings: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; STEPS];
        for (step, of_ring) in self.steps.iter().zip(of_rings) {
            if let Some(at) = *step {
                sums[at] += of_ring;
            }
        }
        sums
    }
}

/// Whether so many cells, smoothed, tell a power.
fn is_known(cells: f64) -> bool {
    cells > 1e-9
}

/// The convolution with a Gaussian of so many steps.
struct Smoothing {
    reach: usize,
    kernel: Vec<f64>,
}

impl Smoothing {
    fn new(sigma: f64) -> Self {
        let reach = (3.0 * sigma).ceil() as usize;
        let kernel: Vec<f64> =
            (0..=2 * reach).map(|k| (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp()).collect();
        let total: f64 = kernel.iter().sum();
        Self { reach, kernel: kernel.into_iter().map(|w| w / total).collect() }
    }

    fn of(&self, values: &[f64]) -> Vec<f64> {
        let mut padded = vec![0.0; values.len() + 2 * self.reach];
        padded[self.reach..][..values.len()].copy_from_slice(values);
        let mut smoothed = vec![0.0; values.len()];
        for (k, weight) in self.kernel.iter().enumerate() {
            smoothed.iter_mut().zip(&padded[k..]).for_each(|(sum, value)| *sum += weight * value);
        }
        smoothed
    }
}

/// Of the first profile's compared ranges with those of the other, `lag` steps farther; 0 where both have too few in common.
fn correlation(first: &[Option<f64>], other: &[Option<f64>], lag: isize) -> f64 {
    let compared = (NEAREST_M / STEP_M).round() as usize..(FARTHEST_M / STEP_M).round() as usize;
    let pairs: Vec<[f64; 2]> =
        compared.filter_map(|k| Some([(*first.get(k)?)?, (*other.get(k.checked_add_signed(lag)?)?)?])).collect();
    if (pairs.len() as f64) < LEAST_COMMON_M / STEP_M {
        return 0.0;
    }
    let n = pairs.len() as f64;
    let mean = [0, 1].map(|side| pairs.iter().map(|pair| pair[side]).sum::<f64>() / n);
    let [mut aa, mut bb, mut ab] = [0.0; 3];
    for [a, b] in pairs {
        let (a, b) = (a - mean[0], b - mean[1]);
        (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
    }
    ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::radar::{Axis, AxisKind, PointSpread, Quantity, Spacing};

    fn view(array: &str, depth: AxisKind, across: AxisKind, place: f64) -> View {
        let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        View {
            array: array.into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread { range_m: 0.06, azimuth_rad: 0.03, elevation_rad: 0.03, ..PointSpread::default() },
            pose: Pose { translation: [0.0, place, 0.0], ..Pose::default() },
            axes: vec![axis(depth, 200, 8.0, 0.0), axis(across, 100, 2.5, -2.5)],
            region: None,
        }
    }

    /// Somebody, two walls and noise, their ranges so much farther.
    fn map(view: &View, farther_m: f64, seed: u64) -> Vec<f64> {
        let shape = view.shape();
        let mut state = seed;
        (0..view.cells())
            .map(|cell| {
                let (depth, across) =
                    (view.axes[0].value_at((cell / shape[1]) as f64), view.axes[1].value_at((cell % shape[1]) as f64));
                let range = depth.hypot(across) - farther_m;
                let echo = |at: f64, wide: f64, strength: f64| strength * (-((range - at) / wide).powi(2)).exp();
                let body = echo(2.4, 0.12, 40.0) * (-((across - 0.3) / 0.4).powi(2)).exp();
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let noise = 0.5 + ((state >> 40) as f64) / (1u64 << 24) as f64;
                body + echo(3.7, 0.08, 6.0) + echo(4.9, 0.1, 9.0) + noise
            })
            .collect()
    }

    fn found(views: &[View; 2], farther_m: f64) -> Option<Vec<f64>> {
        let maps = [map(&views[0], 0.0, 1), map(&views[1], farther_m, 2)];
        let views = ViewSet::from(views.to_vec());
        range_offsets(&views, std::iter::once(maps.iter().map(Vec::as_slice).collect()))
    }

    #[test]
    fn an_offset_between_two_radars_of_one_place_is_found_to_two_centimetres() {
        let views =
            |place| [view("h", AxisKind::DepthH, AxisKind::Y, 0.0), view("v", AxisKind::DepthV, AxisKind::Z, place)];
        for farther_m in [0.2, -0.15, 0.37] {
            let offsets = found(&views(0.0), farther_m).unwrap_or_default();
            assert_eq!(offsets.len(), 2, "{farther_m}");
            assert!((offsets[1] - offsets[0] - farther_m).abs() < 0.02, "{farther_m}: {offsets:?}");
            assert!((offsets[0] + offsets[1]).abs() < 1e-12, "nobody can tell which is right");
        }
        // Where a map begins and ends is no echo.
        let cropped = |lo: f64| {
            let mut views = views(0.0);
            for (view, lo) in views.iter_mut().zip([0.8, lo]) {
                view.axes[0] = Axis { bins: 120, lo: 4.2, hi: lo, ..view.axes[0].clone() };
            }
            views
        };
        assert_eq!(found(&cropped(1.1), 0.0), None);
        let offsets = found(&cropped(0.8), 0.2).unwrap_or_default();
        assert!((offsets[1] - offsets[0] - 0.2).abs() < 0.03, "{offsets:?}");
        // What agrees has none, and what looks from elsewhere sees other ranges.
        assert_eq!(found(&views(0.0), 0.0), None);
        assert_eq!(found(&views(0.0), 0.03), None);
        assert_eq!(found(&views(0.3), 0.2), None);
    }
}
