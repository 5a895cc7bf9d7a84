//! Point-spread widths from the FFT set-up; SPEC section 3, `psf`.
//!
//! The forward model wants, per quantity, the standard deviation of the Gaussian closest to the amplitude main lobe of
//! the window after the FFT. Closest means here: unit peak as the lobe, least squares over the lobe between its first
//! minima, at evenly spaced frequencies. Zero padding interpolates the lobe and does not change its width, so that the width
//! is stated in *natural* bins (cycles over the number of samples) and then in metres, radians and metres a second.

use super::window::response;
use super::{PointSpread, RadarConfig, SPEED_OF_LIGHT, Window};

/// Points of the lobe that the least squares sum over.
const LOBE_POINTS: usize = 400;
/// Step of the search for the first minimum, natural bins.
const SEARCH_STEP: f64 = 1.0 / 64.0;

/// Where the main lobe of `window` over `n` samples ends: the first minimum of its amplitude, in natural bins. Half the
/// number of samples where it never turns up again (n < 3).
pub fn first_null_bins(window: Window, n: usize) -> f64 {
    let weights = window.weights(n);
    let amplitude = |bins: f64| response(&weights, bins);
    let limit = n as f64 / 2.0;
    let mut bins = SEARCH_STEP;
    while bins + SEARCH_STEP < limit && amplitude(bins + SEARCH_STEP) <= amplitude(bins) {
        bins += SEARCH_STEP;
    }
    minimise(amplitude, bins - SEARCH_STEP, (bins + SEARCH_STEP).min(limit))
}

/// Standard deviation, in natural bins, of the unit-peak Gaussian closest to the main lobe of `window` over `n` samples.
pub fn main_lobe_sigma_bins(window: Window, n: usize) -> f64 {
    let weights = window.weights(n);
    let null = first_null_bins(window, n);
    let lobe: Vec<(f64, f64)> = (0..LOBE_POINTS)
        .map(|i| null * (i as f64 + 0.5) / LOBE_POINTS as f64)
        .map(|bins| (bins, response(&weights, bins)))
        .collect();
    let misfit = |sigma: f64| lobe.iter().map(|(b, a)| (a - (-b * b / (2.0 * sigma * sigma)).exp()).powi(2)).sum();
    minimise(misfit, 0.05 * null, null)
}

/// Golden-section search of the minimum of `f`, one minimum between `lo` and `hi`.
fn minimise(f: impl Fn(f64) -> f64, mut lo: f64, mut hi: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    while hi - lo > 1e-10 * hi.abs().max(1.0) {
        let (a, b) = (hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo));
        if f(a) < f(b) { hi = b } else { lo = a }
    }
    f64::midpoint(lo, hi)
}

/// σ_r, m: `samples` ADC samples that span the swept bandwidth.
pub fn range_sigma_m(window: Window, samples: usize, bandwidth_hz: f64) -> f64 {
    main_lobe_sigma_bins(window, samples) * SPEED_OF_LIGHT / (2.0 * bandwidth_hz)
}

/// σ_dop, m/s: `chirps` chirps, one every `chirp_interval_s`.
pub fn doppler_sigma_mps(window: Window, chirps: usize, chirp_interval_s: f64, wavelength_m: f64) -> f64 {
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
        }
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
