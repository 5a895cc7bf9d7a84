//! The axes that the FFTs of a view make, and the way between them and the view's own cells.
//!
//! FFTs resolve range, radial speed and sines of angles. A view has those axes itself, or its map was brought from them onto others:
//! angles in even steps, or Cartesian cells. A linear array measures the angle against its own line, so that a cell at depth D
//! and y, z across lies at range √(D² + y² + z²) and at the sines y/range and z/range.

use super::{Axis, AxisKind, Spacing, View, ViewFft};
use std::f64::consts::PI;

/// Points that a resampled view's FFTs have for each natural bin, at least.
const FINE: f64 = 4.0;

/// What a view's own axes have to do with the FFTs' axes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    /// Axis `k` of the FFTs, as it is.
    Same(usize),
    /// The angle whose sine is axis `k` of the FFTs.
    Angle(usize),
    /// Metres along boresight, in the plane (or the space) of the Cartesian axes.
    Depth,
    /// Metres across, range times the sine on axis `k` of the FFTs.
    Across(usize),
}

/// The axes of a view's FFTs.
#[derive(Debug, Clone, PartialEq)]
pub struct NativeAxes {
    /// Range, speed and sines, at most three; those that are the view's own have its bins.
    pub axes: Vec<Axis>,
    roles: Vec<Role>,
    /// Of a Cartesian view: the axis that is range, and those that are sines.
    cartesian: Option<(usize, Vec<usize>)>,
}

impl NativeAxes {
    /// Those of a view whose FFT configuration is `fft`.
    ///
    /// # Errors
    /// Where the view has an axis that the configuration does not resolve, or coordinates across without a depth; in words.
    pub fn of(view: &View, fft: &ViewFft) -> Result<Self, String> {
        let kinds = || view.axes.iter().map(|axis| axis.kind);
        let is_across = |kind| matches!(kind, AxisKind::Y | AxisKind::Z);
        let is_depth = |kind| matches!(kind, AxisKind::X | AxisKind::DepthH | AxisKind::DepthV);
        let resampled = kinds().any(|kind| is_across(kind) || is_depth(kind));
        if resampled && (kinds().filter(|&kind| is_depth(kind)).count() != 1 || !kinds().any(is_across)) {
            return Err("its Cartesian axes are no plane of range and angle; expected one depth and y or z".into());
        }
        // The farthest corner decides how far the range axis goes.
        let reach = |axis: &Axis| axis.lo.abs().max(axis.hi.abs());
        let corner = view.axes.iter().filter(|axis| is_across(axis.kind) || is_depth(axis.kind)).map(reach);
        let farthest = corner.map(|x| x * x).sum::<f64>().sqrt();
        let (mut axes, mut roles, mut range, mut sines) = (Vec::new(), Vec::new(), 0, Vec::new());
        for (k, axis) in view.axes.iter().enumerate() {
            let resolved = fft.resolved(axis.kind).filter(|resolved| resolved.natural.is_finite());
            let resolved =
                resolved.ok_or_else(|| format!("its FFT configuration resolves no {} axis", axis.kind.name()))?;
            let sine = |kind| {
                // Once round the circle of an FFT, so that every sine has a place on it.
                let length = (FINE * resolved.count as f64).ceil() as usize;
                let step = resolved.natural * resolved.count as f64 / length as f64;
                let lo = -((length / 2) as f64) * step;
                Axis { kind, bins: length, lo, hi: lo + length as f64 * step, spacing: Spacing::Sine }
            };
            match axis.kind {
                AxisKind::Y => {
                    axes.push(sine(AxisKind::Cone));
                    roles.push(Role::Across(k));
                    sines.push(k);
                }
                AxisKind::Z => {
                    axes.push(sine(AxisKind::Elevation));
                    roles.push(Role::Across(k));
                    sines.push(k);
                }
                AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => {
                    let step = resolved.natural / FINE;
                    let bins = (farthest / step).ceil() as usize + 2;
                    let hi = bins as f64 * step;
                    axes.push(Axis { kind: AxisKind::Range, bins, lo: 0.0, hi, spacing: Spacing::Linear });
                    roles.push(Role::Depth);
                    range = k;
                }
                kind if kind.is_angular() && axis.spacing == Spacing::Linear => {
                    axes.push(sine(kind));
                    roles.push(Role::Angle(k));
                }
                _ => {
                    axes.push(axis.clone());
                    roles.push(Role::Same(k));
                }
            }
        }
        Ok(Self { axes, roles, cartesian: resampled.then_some((range, sines)) })
    }

    /// Whether the view's cells are the FFTs' own.
    pub fn are_the_views(&self) -> bool {
        self.roles.iter().all(|role| matches!(role, Role::Same(_)))
    }

    /// What the FFTs' axes measure at a place in bins of `view`: m, m/s, sines; NaN where a Cartesian cell has no angle.
    pub fn coordinates(&self, view: &View, bins: &[f64]) -> [f64; 3] {
        let at = |k: usize| view.axes.get(k).map_or(0.0, |axis| axis.at(bins.get(k).copied().unwrap_or(0.0)));
        let cartesian = self.roles.iter().enumerate().filter(|(_, role)| matches!(role, Role::Depth | Role::Across(_)));
        let range = cartesian.map(|(k, _)| at(k) * at(k)).sum::<f64>().sqrt();
        let mut coordinates = [0.0; 3];
        for (k, (role, coordinate)) in self.roles.iter().zip(&mut coordinates).enumerate() {
            *coordinate = match role {
                Role::Same(_) => at(k),
                Role::Angle(_) => at(k).sin(),
                Role::Depth => range,
                Role::Across(_) => at(k) / range,
            };
        }
        coordinates
    }

    /// Where in bins of `view` the FFTs' axes measure this; the inverse of [`Self::coordinates`]. `None` for sines of no angle.
    pub fn bins(&self, view: &View, coordinates: [f64; 3]) -> Option<[f64; 3]> {
        let depth = match &self.cartesian {
            None => 0.0,
            Some((range, sines)) => {
                let across: f64 = sines.iter().map(|&k| coordinates[k] * coordinates[k]).sum();
                let ahead = 1.0 - across;
                (ahead >= 0.0).then(|| coordinates[*range] * ahead.sqrt())?
            }
        };
        let range = self.cartesian.as_ref().map_or(0.0, |(range, _)| coordinates[*range]);
        let mut bins = [0.0; 3];
        for (k, (role, axis)) in self.roles.iter().zip(&view.axes).enumerate() {
            let on_axis = match role {
                Role::Same(_) => coordinates[k],
                Role::Angle(_) if coordinates[k].abs() <= 1.0 => coordinates[k].asin(),
                Role::Angle(_) => return None,
                Role::Depth => depth,
                Role::Across(_) => range * coordinates[k],
            };
            bins[k] = axis.bin(on_axis);
        }
        Some(bins)
    }
}

/// A map between its bins, linear along each axis; NaN outside. `shape` has at most three axes.
pub fn interpolate(map: &[f64], shape: &[usize], bins: &[f64]) -> f64 {
    let (mut base, mut strides, mut shares) = (0_usize, [0_usize; 3], [0.0; 3]);
    let mut stride = map.len();
    for (k, (&size, &bin)) in shape.iter().zip(bins).take(3).enumerate() {
        stride /= size.max(1);
        // Half a cell beyond the last centre still belongs to it.
        if !(bin >= -0.5 && bin <= size as f64 - 0.5) {
            return f64::NAN;
        }
        let bin = bin.clamp(0.0, (size - 1) as f64);
        let below = (bin as usize).min(size.saturating_sub(2));
        base += below * stride;
        (strides[k], shares[k]) = (if size > 1 { stride } else { 0 }, bin - below as f64);
    }
    let axes = shape.len().min(3);
    (0..1_usize << axes)
        .map(|corner| {
            let (mut at, mut share) = (base, 1.0);
            for k in 0..axes {
                let upper = corner >> k & 1 == 1;
                at += if upper { strides[k] } else { 0 };
                share *= if upper { shares[k] } else { 1.0 - shares[k] };
            }
            // A NaN beside a cell that has no share does not count.
            if share == 0.0 { 0.0 } else { share * map.get(at).copied().unwrap_or(f64::NAN) }
        })
        .sum()
}

/// The angle of a sine, degrees; ±90 beyond.
pub fn sine_deg(sine: f64) -> f64 {
    sine.clamp(-1.0, 1.0).asin() * 180.0 / PI
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::geometry::Pose;
    use crate::radar::{FftSetup, PointSpread, Quantity, RadarConfig, Window};

    fn fft() -> ViewFft {
        let set = |n| (n, Window::Hann);
        let setup = FftSetup { range: set(256), doppler: set(32), azimuth: Some(set(8)), elevation: Some(set(8)) };
        ViewFft { setup, radar: RadarConfig::default() }
    }

    fn view(axes: &[(AxisKind, usize, f64, f64, Spacing)]) -> View {
        let axes = axes.iter().map(|&(kind, bins, lo, hi, spacing)| Axis { kind, bins, lo, hi, spacing }).collect();
        let (array, quantity, psf) = ("m".into(), Quantity::Amplitude, PointSpread::default());
        View { array, quantity, psf, pose: Pose::default(), axes, region: None }
    }

    #[test]
    fn every_cell_leads_to_the_ffts_and_back() {
        use AxisKind::{Azimuth, Cone, DepthH, DepthV, Doppler, Elevation, Range, X, Y, Z};
        use Spacing::{Linear, Sine};
        let views = [
            view(&[(Range, 64, 0.0, 8.0, Linear), (Cone, 32, -1.0, 1.0, Sine)]),
            view(&[(Range, 64, 8.0, 0.0, Linear), (Azimuth, 32, -1.0, 1.0, Linear), (Doppler, 8, -2.0, 2.0, Linear)]),
            view(&[(DepthH, 64, 8.0, 0.0, Linear), (Y, 32, 1.0, -4.0, Linear)]),
            view(&[(DepthV, 64, 8.0, 0.0, Linear), (Z, 32, -2.0, 3.0, Linear)]),
            view(&[(Z, 8, -2.0, 2.0, Linear), (Y, 8, 3.0, -3.0, Linear), (X, 16, 0.5, 8.0, Linear)]),
            view(&[(Doppler, 8, -1.0, 1.0, Linear), (Range, 8, 1.0, 4.0, Linear), (Elevation, 8, 0.9, -0.9, Sine)]),
        ];
        for view in &views {
            let native = NativeAxes::of(view, &fft()).unwrap();
            let whole = view.axes.iter().map(|axis| axis.kind).collect::<Vec<_>>();
            assert_eq!(native.are_the_views(), !whole.contains(&Azimuth) && !whole.iter().any(|k| matches!(k, Y | Z)));
            for cell in [[3.0, 2.0, 1.0], [7.0, 7.0, 6.0], [5.5, 3.25, 0.0]] {
                let cell = &cell[..view.axes.len()];
                let back = native.bins(view, native.coordinates(view, cell)).unwrap();
                assert!(cell.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-9), "{whole:?} {cell:?}: {back:?}");
            }
        }
        let point = views[2].bins_of([3.0, -1.0, 0.0]);
        let [range, sine, _] = NativeAxes::of(&views[2], &fft()).unwrap().coordinates(&views[2], &point);
        assert!((range - 10f64.sqrt()).abs() < 1e-9 && (sine + 1.0 / 10f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn what_no_fft_resolves_is_named() {
        let across =
            view(&[(AxisKind::Y, 8, -1.0, 1.0, Spacing::Linear), (AxisKind::Z, 8, -1.0, 1.0, Spacing::Linear)]);
        assert!(NativeAxes::of(&across, &fft()).unwrap_err().contains("one depth"));
        let cone =
            view(&[(AxisKind::Range, 8, 0.0, 1.0, Spacing::Linear), (AxisKind::Cone, 8, -1.0, 1.0, Spacing::Sine)]);
        let setup = FftSetup { azimuth: None, ..fft().setup };
        assert!(NativeAxes::of(&cone, &ViewFft { setup, ..fft() }).unwrap_err().contains("no cone axis"));
    }

    #[test]
    fn maps_are_linear_between_their_bins() {
        let map: Vec<f64> = (0..24).map(|i| f64::from(i / 12 + 10 * (i / 4 % 3) + 100 * (i % 4))).collect();
        let of = |bins: &[f64]| interpolate(&map, &[2, 3, 4], bins);
        assert!((of(&[0.5, 1.25, 2.75]) - (0.5 + 12.5 + 275.0)).abs() < 1e-12);
        assert_eq!(of(&[1.0, 2.0, 3.0]), 1.0 + 20.0 + 300.0);
        assert!(of(&[0.0, 0.0, 3.6]).is_nan() && of(&[-0.6, 0.0, 0.0]).is_nan() && of(&[f64::NAN, 0.0, 0.0]).is_nan());
        assert_eq!(interpolate(&[f64::NAN, 2.0], &[2], &[1.0]), 2.0);
    }
}
