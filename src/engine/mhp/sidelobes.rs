//! What the sidelobes of FFTs without a window put into a map, taken from it.
//!
//! Samples that no window tapers have sidelobes at −13 dB which fall with the square of the distance: every echo is a star, a ring at its
//! range and a ray along its direction, and a body of thirty resolution cells outshines with them all that lies beside it. No Gaussian
//! has such a foot ([`crate::radar::Lobe`]), and levels ([`super::levels`]) see down to the noise. The power that they bring to a cell is
//! on average
//!
//! ```text
//! b = Σ_echoes I Δu ½/(πu)²,  |u| > 1      along range, and along the sine of the angle; u in natural bins, Δu of a cell
//! ```
//!
//! for sin²(πu) is ½ on average and ∫ sinc² du = 1 makes a cell's I Δu its share of an echo's peak. Whether they are there is measured:
//! a window takes them away, whatever a configuration says. Where b is far above the map's noise, the median of I/b would be ln 2 under
//! speckle; if it is less, as much less is taken away. What is left is I − 2 b: speckle is more than its mean in a third of the cells,
//! more than twice of it in an eighth.
//!
//! Of 200 simulated frames of HIBER's radars (`simulate DIR --layout hiber --frames 200 --seed 1`) `recommended` comes with it to 129 / 66 mm
//! (MAJPE / PA-MAJPE; 97 % of frames better than the start), without it to 350 / 132 (75 %); the start from 450 to 285 mm. Of HuPR's, whose
//! array has eight elements, to 283 / 76 instead of 265 / 80 mm: no star, and so it is not done there.

use super::percentile::percentile;
use crate::radar::{Axis, AxisKind, Quantity, Resolves, Spacing, View};
use std::f64::consts::{LN_2, PI};

/// Steps of the polar map, of a natural bin.
const STEP: f64 = 0.4;
/// Weaker cells' sidelobes are nothing, of the largest power.
const FAINTEST: f64 = 1e-3;
/// The least power that is left of a cell, of the largest.
const LEAST: f64 = 1e-6;
/// Times the mean power of sidelobes that is taken away.
const TIMES: f64 = 2.0;
/// Sidelobes tell whether they are there where they are so many times the noise, if in so many cells.
const ABOVE_NOISE: f64 = 10.0;
const NOISE_PCT: f64 = 30.0;
const FEWEST: usize = 200;
/// A share of sidelobes below this is none.
const LEAST_SHARE: f64 = 0.1;
/// A ring of fewer natural bins is no star: before an array of eight a person is a bin or two wide.
const FEWEST_AROUND: f64 = 16.0;
/// Cells of a polar map at most.
const MOST_CELLS: usize = 1 << 20;

/// Where the cells of a map lie in range and sine, and how far apart natural bins are.
struct Polar {
    /// Of each cell of a slice: range, m, and sine.
    places: Vec<[f64; 2]>,
    /// Of each cell of the polar map, the four cells of a slice around it with their weights.
    sources: Vec<[(usize, f64); 4]>,
    natural: [f64; 2],
    /// Lowest range and sine, and steps of each.
    lowest: [f64; 2],
    steps: [usize; 2],
    /// Offsets of the slices in the map, and of the cells in a slice.
    slices: Vec<usize>,
    cells: Vec<usize>,
}

impl Polar {
    /// `None` where the view has no range and angle of FFTs without a window.
    fn of(view: &View) -> Option<Self> {
        let find = |kinds: &[AxisKind]| view.axes.iter().position(|axis| kinds.contains(&axis.kind));
        let far = find(&[AxisKind::Range, AxisKind::DepthH, AxisKind::DepthV])?;
        let aside = find(&[AxisKind::Azimuth, AxisKind::Cone, AxisKind::Elevation, AxisKind::Y, AxisKind::Z])?;
        let rest: Vec<usize> = (0..view.axes.len()).filter(|axis| ![far, aside].contains(axis)).collect();
        if rest.iter().any(|&axis| view.axes[axis].kind != AxisKind::Doppler) {
            return None;
        }
        let bare = |of: Resolves| view.psf.lobe(of)?.bare;
        let across = Resolves::of(view.axes[aside].kind);
        let width = if across == Resolves::Elevation { view.psf.elevation_rad } else { view.psf.azimuth_rad };
        let natural = [view.psf.range_m * bare(Resolves::Range)?, width * bare(across)?];
        if natural.iter().any(|step| !(1e-6..1e6).contains(step)) || 2.0 < FEWEST_AROUND * natural[1] {
            return None;
        }
        let strides: Vec<usize> =
            (0..view.axes.len()).map(|axis| view.axes[axis + 1..].iter().map(|axis| axis.bins).product()).collect();
        let flat = view.axes[far].kind.is_depth();
        let (mut places, mut cells) = (Vec::new(), Vec::new());
        for i in 0..view.axes[far].bins {
            for k in 0..view.axes[aside].bins {
                let (depth, along) = (view.axes[far].value_at(i as f64), view.axes[aside].value_at(k as f64));
                let range = if flat { depth.hypot(along) } else { depth };
                places.push([range, if flat { along / range.max(1e-6) } else { along.sin() }]);
                cells.push(i * strides[far] + k * strides[aside]);
            }
        }
        let slices = rest
            .first()
            .map_or_else(|| vec![0], |&axis| (0..view.axes[axis].bins).map(|k| k * strides[axis]).collect());
        let bounds = |k: usize| {
            let ends = |(lo, hi): (f64, f64), place: &[f64; 2]| (lo.min(place[k]), hi.max(place[k]));
            places.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends)
        };
        let (near, left) = (bounds(0), bounds(1));
        let steps = [near, left].map(|(lo, hi)| hi - lo);
        let steps = [0, 1].map(|k| (steps[k] / (STEP * natural[k])).ceil().max(1.0) as usize + 1);
        if steps[0].saturating_mul(steps[1]) > MOST_CELLS {
            return None;
        }
        let lowest = [near.0, left.0];
        let (rows, columns) = (&view.axes[far], &view.axes[aside]);
        let source = |cell: usize| {
            let [range, sine] = [cell / steps[1], cell % steps[1]];
            let range = lowest[0] + STEP * natural[0] * range as f64;
            let sine = (lowest[1] + STEP * natural[1] * sine as f64).clamp(-1.0, 1.0);
            let along = match (flat, columns.spacing) {
                (true, _) => range * sine,
                (false, Spacing::Sine) => sine,
                (false, Spacing::Linear) => sine.asin(),
            };
            let depth = if flat { range * (1.0 - sine * sine).sqrt() } else { range };
            let weigh = |axis: &Axis, at: f64| {
                let at = axis.bin(at).clamp(0.0, axis.bins as f64 - 1.0);
                let below = (at as usize).min(axis.bins.saturating_sub(2));
                [(below, 1.0 - at + below as f64), ((below + 1).min(axis.bins - 1), at - below as f64)]
            };
            let (down, across) = (weigh(rows, depth), weigh(columns, along));
            std::array::from_fn(|k| {
                let ((i, p), (j, q)) = (down[k / 2], across[k % 2]);
                (i * columns.bins + j, p * q)
            })
        };
        Some(Self {
            sources: (0..steps[0] * steps[1]).map(source).collect(),
            places,
            natural,
            lowest,
            steps,
            slices,
            cells,
        })
    }

    /// The four cells of the polar map around a place, and their weights.
    fn around(&self, place: [f64; 2]) -> [(usize, f64); 4] {
        let at = |k: usize| {
            let at = ((place[k] - self.lowest[k]) / (STEP * self.natural[k])).clamp(0.0, (self.steps[k] - 1) as f64);
            let below = (at as usize).min(self.steps[k].saturating_sub(2));
            (below, at - below as f64)
        };
        let ((i, p), (j, q)) = (at(0), at(1));
        let cell = |i: usize, j: usize| i.min(self.steps[0] - 1) * self.steps[1] + j.min(self.steps[1] - 1);
        [
            (cell(i, j), (1.0 - p) * (1.0 - q)),
            (cell(i, j + 1), (1.0 - p) * q),
            (cell(i + 1, j), p * (1.0 - q)),
            (cell(i + 1, j + 1), p * q),
        ]
    }

    /// b of each cell of a slice whose cells have these powers.
    fn sidelobes(&self, power: &[f64]) -> Vec<f64> {
        let [rows, columns] = self.steps;
        let largest = power.iter().copied().fold(0.0, f64::max);
        let foot = |n: usize| -> Vec<f64> {
            let at = |k: usize| {
                let u = STEP * k as f64;
                if u > 1.0 { STEP * 0.5 / (PI * u).powi(2) } else { 0.0 }
            };
            (0..n).map(at).collect()
        };
        let [down, across] = [foot(rows), foot(columns)];
        let mut lobes = vec![0.0; rows * columns];
        for (cell, around) in self.sources.iter().enumerate() {
            let echo: f64 = around.iter().map(|(cell, weight)| weight * power[*cell]).sum();
            if echo <= FAINTEST * largest {
                continue;
            }
            let (i, j) = (cell / columns, cell % columns);
            for (k, slot) in lobes[i * columns..(i + 1) * columns].iter_mut().enumerate() {
                *slot += echo * across[k.abs_diff(j)];
            }
            for (k, slot) in lobes[j..].iter_mut().step_by(columns).enumerate() {
                *slot += echo * down[k.abs_diff(i)];
            }
        }
        let read = |place: &[f64; 2]| self.around(*place).into_iter().map(|(cell, weight)| weight * lobes[cell]).sum();
        self.places.iter().map(read).collect()
    }
}

/// A map of `view` without its sidelobes, C order; `None` where none are known of or none are there. Erased cells, NaN, stay so.
pub(super) fn removed(view: &View, map: &[f64]) -> Option<Vec<f64>> {
    let polar = Polar::of(view)?;
    let power = |h: f64| if h.is_nan() { 0.0 } else { view.quantity.power(h) };
    let slices: Vec<(Vec<f64>, Vec<f64>)> = polar
        .slices
        .iter()
        .map(|slice| {
            let powers: Vec<f64> =
                polar.cells.iter().map(|cell| map.get(slice + cell).map_or(0.0, |&h| power(h))).collect();
            let lobes = polar.sidelobes(&powers);
            (powers, lobes)
        })
        .collect();
    let all: Vec<f64> = map.iter().map(|&h| power(h)).collect();
    let (largest, noise) = (all.iter().copied().fold(0.0, f64::max), percentile(&all, NOISE_PCT));
    let both = || slices.iter().flat_map(|(powers, lobes)| powers.iter().zip(lobes));
    let told: Vec<f64> = both().filter(|(_, b)| **b > ABOVE_NOISE * noise).map(|(i, b)| i / b).collect();
    if told.len() < FEWEST {
        return None;
    }
    let share = (percentile(&told, 50.0) / LN_2).min(1.0);
    if share.is_nan() || share < LEAST_SHARE {
        return None;
    }
    let mut out = map.to_vec();
    for (slice, (powers, lobes)) in polar.slices.iter().zip(&slices) {
        for (cell, (i, b)) in polar.cells.iter().zip(powers.iter().zip(lobes)) {
            let Some(slot) = out.get_mut(slice + cell).filter(|h| !h.is_nan()) else { continue };
            let left = (i - TIMES * share * b).max(LEAST * largest);
            *slot = if view.quantity == Quantity::Amplitude { left.sqrt() } else { left };
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::geometry::Pose;
    use crate::radar::{FftSetup, Lobes, PointSpread, RadarConfig, Window};

    /// Depth and y before a line of 86 elements, as HIBER's.
    fn view(window: Window) -> View {
        let radar = RadarConfig { bandwidth_hz: 1.232e9, ..RadarConfig::default() };
        let radar = RadarConfig { l_az_m: 0.5 * radar.wavelength_m(), ..radar };
        let setup =
            FftSetup { range: (256, window), doppler: (1, window), azimuth: Some((86, window)), elevation: None };
        let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        View {
            array: "map".into(),
            quantity: Quantity::Amplitude,
            psf: setup.point_spread(&radar),
            pose: Pose::default(),
            axes: vec![axis(AxisKind::DepthH, 120, 6.0, 0.0), axis(AxisKind::Y, 160, 4.0, -4.0)],
            region: None,
        }
    }

    /// An echo at 3 m and a sine of 0.2, with sidelobes or the foot of its main lobe alone, over noise; and its place.
    fn echo(view: &View, sidelobes: bool) -> (Vec<f64>, usize) {
        let sinc = |u: f64| if u.abs() < 1e-9 { 1.0 } else { (PI * u).sin() / (PI * u) };
        let (depth, across) = (&view.axes[0], &view.axes[1]);
        let mut map = Vec::new();
        for i in 0..depth.bins {
            for k in 0..across.bins {
                let (d, y) = (depth.at(i as f64), across.at(k as f64));
                let range = d.hypot(y).max(1e-6);
                let u = [(range - 3.0) / 0.1217, (y / range - 0.2) * 43.0];
                let there = sidelobes || u.iter().all(|u| u.abs() < 1.0);
                let h = if there { sinc(u[0]) * sinc(u[1]) } else { 0.0 };
                map.push((h * h + 1e-6).sqrt());
            }
        }
        let top = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
        (map, top)
    }

    #[test]
    fn a_star_is_taken_away_and_its_echo_stays() {
        let view = view(Window::Rectangular);
        let (map, top) = echo(&view, true);
        let left = removed(&view, &map).unwrap();
        assert!((left[top] / map[top] - 1.0).abs() < 0.05, "{} of {}", left[top], map[top]);
        // The power of the ring and the rays, farther than two natural bins from the echo.
        let place = |cell: usize| {
            let (d, y) = (view.axes[0].at((cell / 160) as f64), view.axes[1].at((cell % 160) as f64));
            [(d.hypot(y) - 3.0) / 0.1217, (y / d.hypot(y).max(1e-6) - 0.2) * 43.0]
        };
        let far: Vec<usize> = (0..map.len())
            .filter(|&cell| place(cell).iter().any(|u| u.abs() > 2.0) && map[cell] * map[cell] > 1e-5)
            .collect();
        let power = |map: &[f64]| far.iter().map(|&cell| map[cell] * map[cell]).sum::<f64>();
        assert!(far.len() > 500 && power(&left) < 0.2 * power(&map), "{} of {}", power(&left), power(&map));
    }

    #[test]
    fn where_no_sidelobes_are_or_are_known_of_nothing_is_taken_away() {
        let bare = view(Window::Rectangular);
        assert_eq!(removed(&bare, &echo(&bare, false).0), None, "a window took them away");
        let tapered = view(Window::Hann);
        assert_eq!(removed(&tapered, &echo(&tapered, true).0), None);
        let widths = View { psf: PointSpread { lobes: Lobes::default(), ..bare.psf }, ..bare };
        assert_eq!(removed(&widths, &echo(&widths, true).0), None);
    }

    #[test]
    fn erased_cells_stay_erased_and_tell_nothing() {
        let view = view(Window::Rectangular);
        let (mut map, _) = echo(&view, true);
        let whole = removed(&view, &map).unwrap();
        map[5] = f64::NAN;
        let left = removed(&view, &map).unwrap();
        assert!(left[5].is_nan());
        let same = left.iter().zip(&whole).filter(|(a, b)| (*a - *b).abs() < 1e-3).count();
        assert!(same + 1 == map.len(), "{same}");
    }
}
