//! The FFT chain: ADC samples → range → Doppler → angle → polar map → Cartesian map.
//!
//! A linear array measures range and *cone* angle (sin = y/d for an array along y), so that the polar map becomes a Cartesian
//! one without loss in the array's own plane: a cell at depth D and lateral L lies at range √(D² + L²) and sine L/√(D² + L²).
//! A point (x, y, z) therefore lands at depth √(x² + z²) and column y in the map of an array along y (the axis `depth_h`), and at
//! depth √(x² + y²) and column z in that of an array along z (`depth_v`); SPEC section 1.

use super::fmcw::{AdcCube, Fmcw};
use super::{Axis, Window};
use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Windows and FFT lengths (zero-padded to them; at least the number of samples, chirps, elements).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chain {
    /// Taper over the samples of a chirp.
    pub range_window: Window,
    /// Length of the range FFT.
    pub range_fft: usize,
    /// Taper over the chirps.
    pub doppler_window: Window,
    /// Length of the Doppler FFT.
    pub doppler_fft: usize,
    /// Taper over the elements.
    pub angle_window: Window,
    /// Length of the angle FFT.
    pub angle_fft: usize,
    /// What is kept of the mean over the chirps, which is the echo of all that stands still: 1 keeps all, 0 removes it.
    pub still_share: f64,
    /// Ranges beyond this are dropped, m.
    pub max_range_m: f64,
}

/// Range × Doppler × sine of one frame, complex. Doppler and sine run from negative to positive.
#[derive(Debug, Clone, PartialEq)]
pub struct RadarCube {
    /// Range bins; bin i lies at `range_step_m`·i.
    pub ranges: usize,
    /// Doppler bins; bin i lies at `doppler_step_mps`·(i − ⌊dopplers/2⌋), positive moving away.
    pub dopplers: usize,
    /// Sine bins; bin i lies at `sine_step`·(i − ⌊sines/2⌋).
    pub sines: usize,
    /// m a bin.
    pub range_step_m: f64,
    /// m/s a bin.
    pub doppler_step_mps: f64,
    /// Sine a bin.
    pub sine_step: f64,
    /// ranges · dopplers · sines numbers, sine fastest.
    pub data: Vec<Complex64>,
}

/// Range × sine of one frame, amplitude: the root of the power summed over Doppler.
#[derive(Debug, Clone, PartialEq)]
pub struct PolarMap {
    /// Range bins; bin i lies at `range_step_m`·i.
    pub ranges: usize,
    /// Sine bins; bin i lies at `sine_step`·(i − ⌊sines/2⌋).
    pub sines: usize,
    /// m a bin.
    pub range_step_m: f64,
    /// Sine a bin.
    pub sine_step: f64,
    /// ranges · sines amplitudes, sine fastest.
    pub data: Vec<f64>,
}

/// One windowed, zero-padded FFT.
struct Stage {
    weights: Vec<f64>,
    plan: Arc<dyn Fft<f64>>,
}

impl Stage {
    fn new(window: Window, n: usize, length: usize, inverse: bool) -> Self {
        let mut planner = FftPlanner::new();
        let length = length.max(n);
        let plan = if inverse { planner.plan_fft_inverse(length) } else { planner.plan_fft_forward(length) };
        Self { weights: window.weights(n), plan }
    }

    /// The spectrum of `input`, in the FFT's own order.
    fn run(&self, input: impl Iterator<Item = Complex64>) -> Vec<Complex64> {
        let mut buffer = vec![Complex64::ZERO; self.plan.len()];
        self.run_in(input, &mut buffer);
        buffer
    }

    /// Likewise into `buffer`, which has the FFT's length.
    fn run_in(&self, input: impl Iterator<Item = Complex64>, buffer: &mut [Complex64]) {
        buffer.fill(Complex64::ZERO);
        for (cell, (x, w)) in buffer.iter_mut().zip(input.zip(&self.weights)) {
            *cell = x * w;
        }
        self.plan.process(buffer);
    }

    /// The spectrum of `input` with frequency 0 at bin ⌊length/2⌋.
    fn run_centred(&self, input: impl Iterator<Item = Complex64>) -> Vec<Complex64> {
        let mut spectrum = self.run(input);
        let half = spectrum.len() / 2;
        spectrum.rotate_right(half);
        spectrum
    }
}

impl Chain {
    /// Range, Doppler and angle FFTs of a frame.
    ///
    /// The angle transform has the sign that gives a scatterer on the side of the last element a positive sine: its delay
    /// falls along the array, and with it the phase.
    pub fn cube(&self, fmcw: &Fmcw, adc: &AdcCube) -> RadarCube {
        let angle = Stage::new(self.angle_window, adc.elements, self.angle_fft, true);
        let profiles = self.range_doppler(fmcw, adc);
        let (dopplers, sines) = (self.doppler_fft.max(adc.chirps), angle.plan.len());
        let ranges = profiles.len();
        let data = profiles
            .par_iter()
            .flat_map_iter(|elements| {
                (0..dopplers).flat_map(|bin| angle.run_centred(elements.iter().map(move |spectrum| spectrum[bin])))
            })
            .collect();
        RadarCube {
            ranges,
            dopplers,
            sines,
            range_step_m: self.range_step_m(fmcw),
            doppler_step_mps: fmcw.radar.wavelength_m() / (2.0 * dopplers as f64 * fmcw.chirp_interval_s()),
            sine_step: fmcw.radar.wavelength_m() / (fmcw.array.spacing_m * sines as f64),
            data,
        }
    }

    /// The whole chain to the polar map; the cube is summed as it is made and never held.
    pub fn polar(&self, fmcw: &Fmcw, adc: &AdcCube) -> PolarMap {
        let angle = Stage::new(self.angle_window, adc.elements, self.angle_fft, true);
        let dopplers = self.doppler_fft.max(adc.chirps);
        let row = |elements: &Vec<Vec<Complex64>>| {
            let mut power = vec![0.0; angle.plan.len()];
            let mut buffer = vec![Complex64::ZERO; angle.plan.len()];
            for bin in 0..dopplers {
                angle.run_in(elements.iter().map(|spectrum| spectrum[bin]), &mut buffer);
                for (sum, x) in power.iter_mut().zip(&buffer) {
                    *sum += x.norm_sqr();
                }
            }
            let half = power.len() / 2;
            power.rotate_right(half);
            power.into_iter().map(f64::sqrt).collect::<Vec<f64>>()
        };
        let rows: Vec<Vec<f64>> = self.range_doppler(fmcw, adc).par_iter().map(row).collect();
        PolarMap {
            ranges: rows.len(),
            sines: angle.plan.len(),
            range_step_m: self.range_step_m(fmcw),
            sine_step: fmcw.radar.wavelength_m() / (fmcw.array.spacing_m * angle.plan.len() as f64),
            data: rows.concat(),
        }
    }

    fn range_step_m(&self, fmcw: &Fmcw) -> f64 {
        fmcw.unambiguous_range_m() / self.range_fft.max(fmcw.samples) as f64
    }

    /// Doppler spectra (centred), ordered [range][element][Doppler].
    fn range_doppler(&self, fmcw: &Fmcw, adc: &AdcCube) -> Vec<Vec<Vec<Complex64>>> {
        let range = Stage::new(self.range_window, adc.samples, self.range_fft, false);
        let doppler = Stage::new(self.doppler_window, adc.chirps, self.doppler_fft, false);
        let ranges = ((self.max_range_m / self.range_step_m(fmcw)).ceil() as usize + 2).min(range.plan.len());
        let lines: Vec<Vec<Complex64>> = adc
            .data
            .par_chunks_exact(adc.samples)
            .map(|line| {
                let mut spectrum = range.run(line.iter().copied());
                spectrum.truncate(ranges);
                spectrum
            })
            .collect();
        let spectrum = |bin: usize, element: usize| {
            let slow = (0..adc.chirps).map(|chirp| lines[chirp * adc.elements + element][bin]);
            let still = slow.clone().sum::<Complex64>() / adc.chirps as f64 * (1.0 - self.still_share);
            doppler.run_centred(slow.map(|x| x - still))
        };
        let of_range = |bin: usize| (0..adc.elements).map(|element| spectrum(bin, element)).collect();
        (0..ranges).into_par_iter().map(of_range).collect()
    }
}

impl RadarCube {
    /// (range m, speed m/s, sine) of fractional bin coordinates.
    pub fn coordinates(&self, range: f64, doppler: f64, sine: f64) -> (f64, f64, f64) {
        (
            range * self.range_step_m,
            (doppler - (self.dopplers / 2) as f64) * self.doppler_step_mps,
            (sine - (self.sines / 2) as f64) * self.sine_step,
        )
    }

    /// The amplitude summed in power over Doppler.
    pub fn polar(&self) -> PolarMap {
        let row = |range: &[Complex64]| {
            let power = |sine: usize| range.iter().skip(sine).step_by(self.sines).map(Complex64::norm_sqr).sum::<f64>();
            (0..self.sines).map(|sine| power(sine).sqrt()).collect::<Vec<f64>>()
        };
        let data = self.data.chunks_exact(self.dopplers * self.sines).flat_map(row).collect();
        let Self { ranges, sines, range_step_m, sine_step, .. } = *self;
        PolarMap { ranges, sines, range_step_m, sine_step, data }
    }
}

impl PolarMap {
    /// Amplitude at a range and a sine, bilinear between bins; NaN beyond the last range. The sine axis is periodic, as the
    /// angle FFT is.
    pub fn sample(&self, range_m: f64, sine: f64) -> f64 {
        let (r, s) = (range_m / self.range_step_m, sine / self.sine_step + (self.sines / 2) as f64);
        if !(r >= 0.0 && r <= (self.ranges - 1) as f64 && s.is_finite()) {
            return f64::NAN;
        }
        let (i, a) = ((r as usize).min(self.ranges - 2), s.floor());
        let (r, s) = (r - i as f64, s - a);
        let column = |a: f64| (a as i64).rem_euclid(self.sines as i64) as usize;
        let (j, k) = (column(a), column(a + 1.0));
        let row = |i: usize| (1.0 - s) * self.data[i * self.sines + j] + s * self.data[i * self.sines + k];
        (1.0 - r) * row(i) + r * row(i + 1)
    }

    /// The map on a `depth_h` or `depth_v` axis (rows) and the array's own Cartesian axis (columns), row-major.
    pub fn cartesian(&self, depth: &Axis, lateral: &Axis) -> Vec<f64> {
        let cell = |row: usize, column: usize| {
            let (d, l) = (depth.at(row as f64), lateral.at(column as f64));
            let range = d.hypot(l);
            self.sample(range, l / range)
        };
        (0..depth.bins).flat_map(|row| (0..lateral.bins).map(move |column| cell(row, column))).collect()
    }
}
