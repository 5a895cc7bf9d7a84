//! Point-spread widths from the FFT set-up; SPEC section 3, `psf`.
//!
//! The forward model wants, per quantity, the standard deviation of the Gaussian closest to the amplitude main lobe of
//! the window after the FFT. Closest means here: unit peak as the lobe, least squares over the lobe between its first
//! minima, at evenly spaced frequencies. Zero padding interpolates the lobe and does not change its width, so that the width
//! is stated in *natural* bins (cycles over the number of samples) and then in metres, radians and metres a second.

use super::{AxisKind, Lobe, Lobes, PointSpread, RadarConfig, SPEED_OF_LIGHT, Window};
use num_complex::Complex64;
use rustfft::FftPlanner;
use std::collections::VecDeque;
use std::f64::consts::PI;
use std::sync::{Mutex, PoisonError};

/// Points of the lobe that the least squares sum over.
const LOBE_POINTS: usize = 400;
/// Zero padding of the spectrum that the lobe is read from: points a natural bin.
const POINTS_A_BIN: usize = 128;

/// The shape of a lobe is fitted to every so manyth of them, and its ratios to so many digits.
const SHAPE_STEP: usize = 8;
const SHAPE_DIGITS: f64 = 1e-5;

/// Samples from which on a lobe in natural bins changes by less than 3e−4.
const MOST_POINTS: usize = 4096;

/// The main lobe of `window` over `n` samples by a zero-padded FFT, relative to its peak and about the middle sample, where a
/// symmetric window's spectrum is real: [`POINTS_A_BIN`] points a natural bin, from the peak to half the sampling rate.
fn spectrum(window: Window, n: usize) -> Vec<f64> {
    let n = n.min(MOST_POINTS);
    let weights = window.weights(n);
    let length = POINTS_A_BIN * n.max(1);
    let mut line: Vec<Complex64> = weights.iter().map(|&w| Complex64::new(w, 0.0)).collect();
    line.resize(length, Complex64::ZERO);
    FftPlanner::new().plan_fft_forward(length).process(&mut line);
    let peak = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let turn = PI * (n as f64 - 1.0) / length as f64;
    let centred = |(k, x): (usize, &Complex64)| (x * Complex64::cis(turn * k as f64)).re / peak;
    line.iter().take(length / 2 + 1).enumerate().map(centred).collect()
}

/// Where the lobe of a spectrum ends, in natural bins: where it crosses 0, or turns before that; half the number of samples where
/// it does neither.
fn first_minimum(spectrum: &[f64]) -> f64 {
    let ends = |i: &usize| spectrum[i + 1] <= 0.0 || spectrum[*i] <= spectrum[i - 1] && spectrum[*i] < spectrum[i + 1];
    let Some(at) = (1..spectrum.len().saturating_sub(1)).find(ends) else {
        return spectrum.len().saturating_sub(1) as f64 / POINTS_A_BIN as f64;
    };
    let [l, m, h] = [at - 1, at, at + 1].map(|i| spectrum[i]);
    let shift = if h <= 0.0 && m > h {
        m / (m - h)
    } else if l - 2.0 * m + h > 0.0 {
        0.5 * (l - h) / (l - 2.0 * m + h)
    } else {
        0.0
    };
    (at as f64 + shift) / POINTS_A_BIN as f64
}

/// Where the main lobe of `window` over `n` samples ends: the first minimum of its amplitude, in natural bins. Half the
/// number of samples where it never turns up again (n < 3).
pub fn first_null_bins(window: Window, n: usize) -> f64 {
    first_minimum(&spectrum(window, n))
}

/// (place, amplitude) points of the main lobe of `window` over `n` samples, evenly from its peak to its first minimum, natural bins;
/// and that minimum.
fn main_lobe(window: Window, n: usize) -> (Vec<(f64, f64)>, f64) {
    let spectrum = spectrum(window, n);
    let null = first_minimum(&spectrum);
    // Between the points by the cubic through the four nearest; the amplitude is even.
    let point = |i: i64| spectrum.get(i.unsigned_abs() as usize).copied().unwrap_or(0.0);
    let amplitude = |bins: f64| {
        let at = bins * POINTS_A_BIN as f64;
        let (below, t) = (at.floor() as i64, at - at.floor());
        let [a, b, c, d] = [-1, 0, 1, 2].map(|k| point(below + k));
        let (u, v, w) = (t + 1.0, t - 1.0, t - 2.0);
        (-a * t * v * w + 3.0 * b * u * v * w - 3.0 * c * u * t * w + d * u * t * v) / 6.0
    };
    let lobe = (0..LOBE_POINTS)
        .map(|i| null * (i as f64 + 0.5) / LOBE_POINTS as f64)
        .map(|bins| (bins, amplitude(bins)))
        .collect();
    (lobe, null)
}

/// What Gaussians come closest to a main lobe.
#[derive(Debug, Clone, Copy)]
struct ClosestGaussians {
    /// Of one, natural bins.
    sigma: f64,
    /// The difference of two.
    shape: Option<Lobe>,
}

impl ClosestGaussians {
    /// How many windows are remembered.
    const REMEMBERED: usize = 64;

    /// Those to the lobe of `window` over `n` samples. A shape takes milliseconds, and every view and file of a data set asks for
    /// the same few.
    fn of(window: Window, n: usize) -> Self {
        static RECENT: Mutex<VecDeque<(Window, usize, ClosestGaussians)>> = Mutex::new(VecDeque::new());
        let recent = || RECENT.lock().unwrap_or_else(PoisonError::into_inner);
        let known = recent().iter().find(|of| (of.0, of.1) == (window, n)).map(|of| of.2);
        known.unwrap_or_else(|| {
            let (lobe, null) = main_lobe(window, n);
            let sigma = closest_sigma(&lobe, null);
            let closest = Self { sigma, shape: (n > 2).then(|| closest_shape(window, &lobe, sigma)).flatten() };
            let mut recent = recent();
            recent.truncate(Self::REMEMBERED - 1);
            recent.push_front((window, n, closest));
            closest
        })
    }
}

/// Standard deviation, in natural bins, of the unit-peak Gaussian closest to the main lobe of `window` over `n` samples.
pub fn main_lobe_sigma_bins(window: Window, n: usize) -> f64 {
    ClosestGaussians::of(window, n).sigma
}

/// The difference of Gaussians closest to the main lobe of `window` over `n` samples, least squares from the peak to the first
/// minimum; `None` where two or fewer samples make no lobe, or the difference is no better than one Gaussian.
pub fn main_lobe_shape(window: Window, n: usize) -> Option<Lobe> {
    ClosestGaussians::of(window, n).shape
}

/// The same of the points of a lobe, to which one Gaussian of `sigma` is closest.
fn closest_shape(window: Window, lobe: &[(f64, f64)], sigma: f64) -> Option<Lobe> {
    let [first, second] = Lobe::WEIGHTS;
    let misfit = |ratios: [f64; 2]| -> f64 {
        let falls = ratios.map(|ratio| -0.5 / (ratio * sigma * ratio * sigma));
        let of = |(at, a): &(f64, f64)| {
            let [p, q] = falls.map(|fall| (fall * at * at).exp());
            (first * p + second * q - a).powi(2)
        };
        lobe.iter().step_by(SHAPE_STEP).map(of).sum()
    };
    let minimise = |f: &dyn Fn(f64) -> f64, (lo, hi): (f64, f64)| minimise_to(SHAPE_DIGITS, f, lo, hi);
    // Along the second ratio the best first one; both sides of equal widths, where the difference is one Gaussian.
    let best_of = |ratio: f64| minimise(&|first| misfit([first, ratio]), (0.3, 2.0));
    let [narrow, wide] = [(0.3, 1.0), (1.0, 4.0)].map(|range| {
        let second = minimise(&|ratio| misfit([best_of(ratio), ratio]), range);
        [best_of(second), second]
    });
    let ratios = if misfit(narrow) < misfit(wide) { narrow } else { wide };
    (misfit(ratios) < misfit([1.0, 1.0]))
        .then_some(Lobe { ratios, untapered: (window == Window::Rectangular).then_some(1.0 / sigma) })
}

/// Standard deviation of the unit-peak Gaussian about 0 that is closest to (place, amplitude) points of a lobe which ends at
/// `null`.
pub(super) fn closest_sigma(lobe: &[(f64, f64)], null: f64) -> f64 {
    let misfit = |sigma: f64| lobe.iter().map(|(b, a)| (a - (-b * b / (2.0 * sigma * sigma)).exp()).powi(2)).sum();
    minimise(misfit, 0.05 * null, null)
}

/// Golden-section search of the minimum of `f`, one minimum between `lo` and `hi`.
fn minimise(f: impl Fn(f64) -> f64, lo: f64, hi: f64) -> f64 {
    minimise_to(1e-10, f, lo, hi)
}

/// The same to so small a share of `hi`.
fn minimise_to(least: f64, f: impl Fn(f64) -> f64, mut lo: f64, mut hi: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    while hi - lo > least * hi.abs().max(1.0) {
        let (a, b) = (hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo));
        if f(a) < f(b) { hi = b } else { lo = a }
    }
    f64::midpoint(lo, hi)
}

/// σ_r, m: `samples` ADC samples that span the swept bandwidth.
pub fn range_sigma_m(window: Window, samples: usize, bandwidth_hz: f64) -> f64 {
    main_lobe_sigma_bins(window, samples) * SPEED_OF_LIGHT / (2.0 * bandwidth_hz)
}

/// σ_dop, m/s: `chirps` chirps, one every `chirp_interval_s`; 0 where one chirp resolves no speed.
pub fn doppler_sigma_mps(window: Window, chirps: usize, chirp_interval_s: f64, wavelength_m: f64) -> f64 {
    if chirps < 2 {
        return 0.0;
    }
    main_lobe_sigma_bins(window, chirps) * wavelength_m / (2.0 * chirps as f64 * chirp_interval_s)
}

/// σ of the sine of the angle, which is σ_az or σ_el in radians at boresight: `elements` elements `spacing_m` apart.
pub fn sine_sigma(window: Window, elements: usize, spacing_m: f64, wavelength_m: f64) -> f64 {
    main_lobe_sigma_bins(window, elements) * wavelength_m / (elements as f64 * spacing_m)
}

/// The FFT set-up that point-spread widths follow from. A dimension that a map does not resolve has no taper: width 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FftSetup {
    /// Samples a chirp and their taper.
    pub range: (usize, Window),
    /// Chirps a frame and their taper.
    pub doppler: (usize, Window),
    /// Elements along y and their taper.
    pub azimuth: Option<(usize, Window)>,
    /// Elements along z and their taper.
    pub elevation: Option<(usize, Window)>,
}

impl FftSetup {
    /// The shape of each lobe.
    pub fn lobes(&self) -> Lobes {
        let shape = |(n, window): (usize, Window)| main_lobe_shape(window, n);
        Lobes {
            range: shape(self.range),
            azimuth: self.azimuth.and_then(shape),
            elevation: self.elevation.and_then(shape),
            doppler: shape(self.doppler),
        }
    }

    /// The widths with the chirp and element spacings of `radar`; chirps follow each other evenly over `radar.frame_s`.
    pub fn point_spread(&self, radar: &RadarConfig) -> PointSpread {
        let wavelength = radar.wavelength_m();
        let sine = |set: Option<(usize, Window)>, spacing| {
            set.map_or(0.0, |(elements, window)| sine_sigma(window, elements, spacing, wavelength))
        };
        let (chirps, taper) = self.doppler;
        PointSpread {
            range_m: range_sigma_m(self.range.1, self.range.0, radar.bandwidth_hz),
            azimuth_rad: sine(self.azimuth, radar.l_az_m),
            elevation_rad: sine(self.elevation, radar.l_el_m),
            doppler_mps: doppler_sigma_mps(taper, chirps, radar.frame_s / chirps as f64, wavelength),
            lobes: self.lobes(),
            ..PointSpread::default()
        }
    }
}

/// The FFT configuration of a view: what its widths are computed from, and what the signal-level path runs.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFft {
    /// Samples, chirps, elements and their tapers.
    pub setup: FftSetup,
    /// The chirp and the spacings that they are of.
    pub radar: RadarConfig,
}

/// What a view resolves with an FFT of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolved {
    /// Samples, chirps or elements N.
    pub count: usize,
    /// Their taper.
    pub window: Window,
    /// What one bin of an FFT of N points is: m, m/s, or a sine.
    pub natural: f64,
}

impl ViewFft {
    /// Whether a view with these axes has an angle along y, and one along z.
    pub fn angles(kinds: impl Iterator<Item = AxisKind>) -> [bool; 2] {
        let mut seen = [false; 2];
        for kind in kinds {
            seen[0] |= matches!(kind, AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y);
            seen[1] |= matches!(kind, AxisKind::Elevation | AxisKind::Z);
        }
        seen
    }

    /// This configuration for a view with these axes: an angle that they do not resolve has no FFT.
    pub fn for_axes(&self, kinds: impl Iterator<Item = AxisKind>) -> Self {
        let [horizontal, vertical] = Self::angles(kinds);
        let setup = FftSetup {
            azimuth: self.setup.azimuth.filter(|_| horizontal),
            elevation: self.setup.elevation.filter(|_| vertical),
            ..self.setup
        };
        Self { setup, radar: self.radar.clone() }
    }

    /// The widths that follow from it.
    pub fn point_spread(&self) -> PointSpread {
        self.setup.point_spread(&self.radar)
    }

    /// The FFT behind an axis of that kind; `None` where nothing resolves it.
    pub fn resolved(&self, kind: AxisKind) -> Option<Resolved> {
        let (radar, wavelength) = (&self.radar, self.radar.wavelength_m());
        let sine = |(count, window): (usize, Window), spacing: f64| Resolved {
            count,
            window,
            natural: wavelength / (count as f64 * spacing),
        };
        match kind {
            AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y => self.setup.azimuth.map(|set| sine(set, radar.l_az_m)),
            AxisKind::Elevation | AxisKind::Z => self.setup.elevation.map(|set| sine(set, radar.l_el_m)),
            AxisKind::Doppler => {
                let (count, window) = self.setup.doppler;
                (count > 1).then(|| Resolved { count, window, natural: wavelength / (2.0 * radar.frame_s) })
            }
            AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => {
                let (count, window) = self.setup.range;
                Some(Resolved { count, window, natural: radar.range_resolution_m() })
            }
        }
    }

    /// In words: samples, chirps and elements with their windows.
    pub fn words(&self) -> String {
        let FftSetup { range, doppler, azimuth, elevation } = self.setup;
        let mut parts = vec![format!("{} samples {}", range.0, range.1.name())];
        if doppler.0 > 1 {
            parts.push(format!("{} chirps {}", doppler.0, doppler.1.name()));
        }
        for (set, along) in [(azimuth, "along y"), (elevation, "along z")] {
            if let Some((count, window)) = set {
                parts.push(format!("{count} elements {along} {}", window.name()));
            }
        }
        parts.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Direct fits with scipy (`minimize_scalar` on a 20001-point grid of the lobe, `scipy.signal.windows`).
    const DIRECT: [(Window, usize, f64, f64); 7] = [
        (Window::Rectangular, 256, 1.0, 0.487_661_998),
        (Window::Rectangular, 20, 1.0, 0.488_066_107),
        (Window::Hann, 256, 2.0078, 0.825_362_320),
        (Window::Hann, 64, 2.031_68, 0.835_188_494),
        (Window::Hamming, 256, 2.0167, 0.753_002_119),
        (Window::Blackman, 64, 3.047_68, 0.972_379_208),
        (Window::Chebyshev { sidelobe_db: 30.0 }, 24, 1.464_96, 0.621_051_543),
    ];

    #[test]
    fn widths_agree_with_direct_fits() {
        for (window, n, null, sigma) in DIRECT {
            let (null_here, sigma_here) = (first_null_bins(window, n), main_lobe_sigma_bins(window, n));
            assert!((null_here - null).abs() < 2e-4, "{window:?} {n}: null {null_here}");
            assert!((sigma_here - sigma).abs() < 2e-4 * sigma, "{window:?} {n}: sigma {sigma_here}");
        }
    }

    /// scipy's `least_squares` found the same ratios.
    #[test]
    fn a_difference_of_gaussians_has_the_whole_main_lobe() {
        for (window, n, ratios) in [
            (Window::Rectangular, 128, [1.477, 2.796]),
            (Window::Hann, 128, [1.2445, 1.5725]),
            (Window::Hamming, 12, [0.8926, 0.7877]),
            (Window::Blackman, 12, [1.1403, 1.2974]),
        ] {
            let found = main_lobe_shape(window, n).map(|lobe| lobe.ratios).unwrap_or_default();
            assert!((0..2).all(|k| (found[k] - ratios[k]).abs() < 0.02), "{window:?} {n}: {found:?}");
            let sigma = main_lobe_sigma_bins(window, n);
            let (lobe, _) = main_lobe(window, n);
            let shape = |at: f64| -> f64 {
                let of = |(w, f): (f64, f64)| w * (-0.5 * (at / (f * sigma)).powi(2)).exp();
                Lobe::WEIGHTS.into_iter().zip(found).map(of).sum()
            };
            let worst = lobe.iter().map(|(at, a)| (shape(*at) - a).abs()).fold(0.0, f64::max);
            assert!(worst < 0.0105, "{window:?} {n}: {worst}");
        }
        assert_eq!(main_lobe_shape(Window::Hann, 1), None);
    }

    #[test]
    fn metres_radians_and_speeds_follow_from_the_chirp() {
        let radar = RadarConfig { bandwidth_hz: 3e9, l_az_m: 0.0019, l_el_m: 0.0021, ..RadarConfig::default() };
        let setup = FftSetup {
            range: (256, Window::Hann),
            doppler: (64, Window::Hann),
            azimuth: Some((20, Window::Rectangular)),
            elevation: None,
        };
        let psf = setup.point_spread(&radar);
        assert!((psf.range_m - 0.825_362 * 0.049_965_4).abs() < 1e-6, "{psf:?}");
        assert!((psf.azimuth_rad - 0.488_066 * radar.wavelength_m() / (20.0 * 0.0019)).abs() < 1e-5, "{psf:?}");
        assert!((psf.doppler_mps - 0.835_188 * radar.wavelength_m() / (2.0 * 0.0128)).abs() < 1e-4, "{psf:?}");
        assert_eq!(psf.elevation_rad, 0.0);
    }
}
