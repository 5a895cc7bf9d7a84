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
use crate::radar::{AxisKind, Quantity, Resolves, Spacing, View, interpolate};
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

/// The map of a view over range and the sine of the angle, and where its cells and the view's lie in each other.
pub(super) struct Polar {
    /// Bins of range and sine, of [`STEP`] natural bins each.
    bins: [usize; 2],
    /// Rows and columns of a slice of the view: all but its speeds.
    slice: [usize; 2],
    /// Where in the view a slice begins, and the cells of each from there.
    slices: Vec<usize>,
    cells: Vec<usize>,
    /// Of each cell of a slice where it is in the polar map, and of each of that where it is in a slice; bins.
    places: Vec<[f64; 2]>,
    sources: Vec<[f64; 2]>,
}

impl Polar {
    /// `None` where the view has no range and angle of FFTs without a window, or is no plane of them.
    pub(super) fn of(view: &View) -> Option<Self> {
        let find = |kinds: &[AxisKind]| view.axes.iter().position(|axis| kinds.contains(&axis.kind));
        let far = find(&[AxisKind::Range, AxisKind::DepthH, AxisKind::DepthV])?;
        let aside = find(&[AxisKind::Azimuth, AxisKind::Cone, AxisKind::Elevation, AxisKind::Y, AxisKind::Z])?;
        let speeds: Vec<usize> = (0..view.axes.len()).filter(|axis| ![far, aside].contains(axis)).collect();
        let (rows, columns) = (&view.axes[far], &view.axes[aside]);
        let flat = rows.kind.is_depth();
        if speeds.iter().any(|&axis| view.axes[axis].kind != AxisKind::Doppler) || flat == columns.kind.is_angular() {
            return None;
        }
        let untapered = |of: Resolves| view.psf.lobe(of)?.untapered;
        let across = Resolves::of(columns.kind);
        let width = if across == Resolves::Elevation { view.psf.elevation_rad } else { view.psf.azimuth_rad };
        let natural = [view.psf.range_m * untapered(Resolves::Range)?, width * untapered(across)?];
        if natural.iter().any(|step| !(1e-6..1e6).contains(step)) || 2.0 < FEWEST_AROUND * natural[1] {
            return None;
        }
        let slice = [rows.bins, columns.bins];
        let each = |[rows, columns]: [usize; 2]| (0..rows).flat_map(move |i| (0..columns).map(move |k| [i, k]));
        let place = |[i, k]: [usize; 2]| {
            let (depth, along) = (rows.value_at(i as f64), columns.value_at(k as f64));
            let range = if flat { depth.hypot(along) } else { depth };
            [range, if flat { along / range.max(1e-6) } else { along.sin() }]
        };
        let ends = |k: usize| {
            let wider = |(lo, hi): (f64, f64), place: [f64; 2]| (lo.min(place[k]), hi.max(place[k]));
            each(slice).map(place).fold((f64::INFINITY, f64::NEG_INFINITY), wider)
        };
        let ends = [ends(0), ends(1)];
        let step = natural.map(|natural| STEP * natural);
        let bins = [0, 1].map(|k| ((ends[k].1 - ends[k].0) / step[k]).ceil().max(1.0) as usize + 1);
        if bins[0].saturating_mul(bins[1]) > MOST_CELLS {
            return None;
        }
        let back = |at: [usize; 2]| {
            let [range, sine] = [0, 1].map(|k| ends[k].0 + step[k] * at[k] as f64);
            let sine = sine.clamp(-1.0, 1.0);
            let along = match (flat, columns.spacing) {
                (true, _) => range * sine,
                (false, Spacing::Sine) => sine,
                (false, Spacing::Linear) => sine.asin(),
            };
            [rows.bin(if flat { range * (1.0 - sine * sine).sqrt() } else { range }), columns.bin(along)]
        };
        let stride = |axis: usize| -> usize { view.axes[axis + 1..].iter().map(|axis| axis.bins).product() };
        let slices = speeds
            .first()
            .map_or_else(|| vec![0], |&axis| (0..view.axes[axis].bins).map(|k| k * stride(axis)).collect());
        let (down, right) = (stride(far), stride(aside));
        Some(Self {
            bins,
            slice,
            slices,
            cells: each(slice).map(|[i, k]| i * down + k * right).collect(),
            places: each(slice).map(place).map(|at| [0, 1].map(|k| (at[k] - ends[k].0) / step[k])).collect(),
            sources: each(bins).map(back).collect(),
        })
    }

    /// b of each cell of a slice whose cells have these powers.
    fn sidelobes(&self, power: &[f64]) -> Vec<f64> {
        let [rows, columns] = self.bins;
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
        for (cell, place) in self.sources.iter().enumerate() {
            let echo = interpolate(power, &self.slice, place);
            // Not a number outside the view.
            if echo.is_nan() || echo <= FAINTEST * largest {
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
        self.places.iter().map(|place| interpolate(&lobes, &self.bins, place)).collect()
    }

    /// A map of the view, C order, without its sidelobes; `None` where none are there. Erased cells, NaN, stay so.
    pub(super) fn without_sidelobes(&self, quantity: Quantity, map: &[f64]) -> Option<Vec<f64>> {
        let all: Vec<f64> = map.iter().map(|&h| if h.is_nan() { 0.0 } else { quantity.power(h) }).collect();
        let of_slice = |slice: &usize| -> (Vec<f64>, Vec<f64>) {
            let powers =
                self.cells.iter().map(|cell| all.get(slice + cell).copied().unwrap_or(0.0)).collect::<Vec<_>>();
            let lobes = self.sidelobes(&powers);
            (powers, lobes)
        };
        let slices: Vec<(Vec<f64>, Vec<f64>)> = self.slices.iter().map(of_slice).collect();
        let (largest, noise) = (all.iter().copied().fold(0.0, f64::max), percentile(&all, NOISE_PCT));
        let both = slices.iter().flat_map(|(powers, lobes)| powers.iter().zip(lobes));
        let told: Vec<f64> = both.filter(|(_, b)| **b > ABOVE_NOISE * noise).map(|(i, b)| i / b).collect();
        let share = if told.len() < FEWEST { 0.0 } else { (percentile(&told, 50.0) / LN_2).min(1.0) };
        if share.is_nan() || share < LEAST_SHARE {
            return None;
        }
        let mut out = map.to_vec();
        for (slice, (powers, lobes)) in self.slices.iter().zip(&slices) {
            for (cell, (i, b)) in self.cells.iter().zip(powers.iter().zip(lobes)) {
                let Some(slot) = out.get_mut(slice + cell).filter(|h| !h.is_nan()) else { continue };
                *slot = quantity.stored((i - TIMES * share * b).max(LEAST * largest));
            }
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::geometry::Pose;
    use crate::radar::{Axis, FftSetup, Lobes, PointSpread, RadarConfig, Window};

    fn removed(view: &View, map: &[f64]) -> Option<Vec<f64>> {
        Polar::of(view)?.without_sidelobes(view.quantity, map)
    }

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
