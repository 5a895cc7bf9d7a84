//! The FFT chain: ADC samples → range → Doppler → angle → polar map → Cartesian map.
//!
//! A linear array measures range and *cone* angle (sin = y/d for an array along y), so that the polar map becomes a Cartesian
//! one without loss in the array's own plane: a cell at depth D and lateral L lies at range √(D² + L²) and sine L/√(D² + L²).
//! A point (x, y, z) therefore lands at depth √(x² + z²) and column y in the map of an array along y (the axis `depth_h`), and at
//! depth √(x² + y²) and column z in that of an array along z (`depth_v`); SPEC section 1.

use super::fmcw::{AdcCube, Fmcw};
use super::{Axis, Window};
use num_complex::Complex64;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
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

/// Range × channel × Doppler of one frame, complex; Doppler from negative to positive.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeDoppler {
    /// Range bins; bin i lies at `range_step_m`·i.
    pub ranges: usize,
    /// Channels.
    pub channels: usize,
    /// Doppler bins; bin i lies at `doppler_step_mps`·(i − ⌊dopplers/2⌋), positive moving away.
    pub dopplers: usize,
    /// m a bin.
    pub range_step_m: f64,
    /// m/s a bin.
    pub doppler_step_mps: f64,
    /// ranges · channels · dopplers numbers, Doppler fastest.
    pub data: Vec<Complex64>,
}

/// One windowed, zero-padded FFT.
struct Stage {
    weights: Vec<f64>,
    plan: Arc<dyn Fft<f64>>,
}

/// The memory of a transform.
struct Bench {
    buffer: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Stage {
    fn new(window: Window, n: usize, length: usize, inverse: bool) -> Self {
        let mut planner = FftPlanner::new();
        let length = length.max(n);
        let plan = if inverse { planner.plan_fft_inverse(length) } else { planner.plan_fft_forward(length) };
        Self { weights: window.weights(n), plan }
    }

    fn bench(&self) -> Bench {
        let zeros = |n| vec![Complex64::ZERO; n];
        Bench { buffer: zeros(self.plan.len()), scratch: zeros(self.plan.get_inplace_scratch_len()) }
    }

    /// The spectrum of `input`, in the FFT's own order.
    fn run_in<'a>(&self, input: impl Iterator<Item = Complex64>, bench: &'a mut Bench) -> &'a [Complex64] {
        bench.buffer.fill(Complex64::ZERO);
        for (cell, (x, w)) in bench.buffer.iter_mut().zip(input.zip(&self.weights)) {
            *cell = x * w;
        }
        self.plan.process_with_scratch(&mut bench.buffer, &mut bench.scratch);
        &bench.buffer
    }

    /// The spectrum of `input` with frequency 0 at bin ⌊length/2⌋.
    fn run_centred(&self, input: impl Iterator<Item = Complex64>) -> Vec<Complex64> {
        let mut bench = self.bench();
        self.run_in(input, &mut bench);
        let half = bench.buffer.len() / 2;
        bench.buffer.rotate_right(half);
        bench.buffer
    }
}

impl Chain {
    /// Range bins that are kept.
    pub fn ranges(&self, fmcw: &Fmcw) -> usize {
        let length = self.range_fft.max(fmcw.samples);
        let step_m = fmcw.unambiguous_range_m() / length as f64;
        ((self.max_range_m / step_m).ceil() as usize).saturating_add(2).min(length)
    }

    /// Range, Doppler and angle FFTs of a frame whose channels are an even line.
    ///
    /// The angle transform has the sign that gives a scatterer on the side of the last element a positive sine: its delay
    /// falls along the array, and with it the phase.
    pub fn cube(&self, fmcw: &Fmcw, spacing_m: f64, adc: &AdcCube) -> RadarCube {
        self.cube_of(fmcw, spacing_m, &self.range_doppler(fmcw, adc))
    }

    /// The angle FFT of channels that are an even line.
    pub fn cube_of(&self, fmcw: &Fmcw, spacing_m: f64, spectra: &RangeDoppler) -> RadarCube {
        let angle = Stage::new(self.angle_window, spectra.channels, self.angle_fft, true);
        let sines = angle.plan.len();
        let mut data = Vec::with_capacity(spectra.ranges * spectra.dopplers * sines);
        for range in 0..spectra.ranges {
            for doppler in 0..spectra.dopplers {
                data.extend(angle.run_centred(spectra.channels_at(range, doppler)));
            }
        }
        RadarCube {
            ranges: spectra.ranges,
            dopplers: spectra.dopplers,
            sines,
            range_step_m: spectra.range_step_m,
            doppler_step_mps: spectra.doppler_step_mps,
            sine_step: fmcw.radar.wavelength_m() / (spacing_m * sines as f64),
            data,
        }
    }

    /// Amplitude over the sine, from negative to positive, of one range and Doppler bin of channels that are an even line.
    pub fn angle_spectrum(&self, spectra: &RangeDoppler, range: usize, doppler: usize) -> Vec<f64> {
        if range >= spectra.ranges || doppler >= spectra.dopplers {
            return Vec::new();
        }
        let angle = Stage::new(self.angle_window, spectra.channels, self.angle_fft, true);
        angle.run_centred(spectra.channels_at(range, doppler)).iter().map(|x| x.norm()).collect()
    }

    /// The whole chain to the polar map; the cube is summed as it is made and never held.
    pub fn polar(&self, fmcw: &Fmcw, spacing_m: f64, adc: &AdcCube) -> PolarMap {
        self.polar_of(fmcw, spacing_m, &self.range_doppler(fmcw, adc))
    }

    /// The angle FFT of channels that are an even line, summed in power over Doppler.
    pub fn polar_of(&self, fmcw: &Fmcw, spacing_m: f64, spectra: &RangeDoppler) -> PolarMap {
        let angle = Stage::new(self.angle_window, spectra.channels, self.angle_fft, true);
        let sines = angle.plan.len();
        let mut data = Vec::with_capacity(spectra.ranges * sines);
        let (mut power, mut bench) = (vec![0.0; sines], angle.bench());
        for range in 0..spectra.ranges {
            power.fill(0.0);
            for doppler in 0..spectra.dopplers {
                let spectrum = angle.run_in(spectra.channels_at(range, doppler), &mut bench);
                for (sum, x) in power.iter_mut().zip(spectrum) {
                    *sum += x.norm_sqr();
                }
            }
            power.rotate_right(sines / 2);
            data.extend(power.iter().map(|p: &f64| p.sqrt()));
        }
        PolarMap {
            ranges: spectra.ranges,
            sines,
            range_step_m: spectra.range_step_m,
            sine_step: fmcw.radar.wavelength_m() / (spacing_m * sines as f64),
            data,
        }
    }

    /// Range and Doppler FFTs of every channel. A transmitter that sends later in its loop sees a moving scatterer with the phase
    /// that it gained meanwhile; that is turned back, bin by bin, which is right for speeds without ambiguity.
    pub fn range_doppler(&self, fmcw: &Fmcw, adc: &AdcCube) -> RangeDoppler {
        let range = Stage::new(self.range_window, adc.samples, self.range_fft, false);
        let doppler = Stage::new(self.doppler_window, adc.loops, self.doppler_fft, false);
        let range_step_m = fmcw.unambiguous_range_m() / range.plan.len() as f64;
        let ranges = self.ranges(fmcw);
        let (channels, dopplers) = (adc.channels, doppler.plan.len());
        let mut lines = Vec::with_capacity(adc.loops * channels * ranges);
        let mut bench = range.bench();
        for line in adc.data.chunks_exact(adc.samples) {
            lines.extend_from_slice(&range.run_in(line.iter().copied(), &mut bench)[..ranges]);
        }
        let transmitters = fmcw.array.tx.len();
        let turns: Vec<Complex64> = (0..transmitters * dopplers)
            .map(|k| {
                let (tx, bin) = ((k / dopplers) as f64, k % dopplers);
                let cycles = (bin as f64 - (dopplers / 2) as f64) / dopplers as f64;
                Complex64::cis(-TAU * cycles * tx / transmitters as f64)
            })
            .collect();
        let mut data = Vec::with_capacity(ranges * channels * dopplers);
        let (mut slow, mut bench) = (vec![Complex64::ZERO; adc.loops], doppler.bench());
        for bin in 0..ranges {
            for channel in 0..channels {
                for (index, x) in slow.iter_mut().enumerate() {
                    *x = lines[(index * channels + channel) * ranges + bin];
                }
                let still = slow.iter().sum::<Complex64>() / adc.loops as f64 * (1.0 - self.still_share);
                let spectrum = doppler.run_in(slow.iter().map(|x| x - still), &mut bench);
                let turns = &turns[channel / fmcw.array.rx.len() * dopplers..][..dopplers];
                let (low, high) = spectrum.split_at(dopplers - dopplers / 2);
                data.extend(high.iter().chain(low).zip(turns).map(|(x, turn)| x * turn));
            }
        }
        RangeDoppler {
            ranges,
            channels,
            dopplers,
            range_step_m,
            doppler_step_mps: fmcw.radar.wavelength_m() / (2.0 * dopplers as f64 * fmcw.loop_s()),
            data,
        }
    }
}

impl AdcCube {
    /// Amplitudes over range, roots of the mean power over channels and chirps: of everything, and without the mean over the
    /// chirps, which is what stands still. As long as the samples.
    pub fn range_profiles(&self, window: Window) -> (Vec<f64>, Vec<f64>) {
        let stage = Stage::new(window, self.samples, self.samples, false);
        let mut bench = stage.bench();
        let (block, lines) = (self.channels * self.samples, (self.loops * self.channels).max(1) as f64);
        let (mut all, mut mean) = (vec![0.0; self.samples], vec![Complex64::ZERO; block]);
        for chirp in self.data.chunks_exact(block.max(1)) {
            for (channel, line) in chirp.chunks_exact(self.samples.max(1)).enumerate() {
                let spectrum = stage.run_in(line.iter().copied(), &mut bench);
                for (bin, x) in spectrum.iter().enumerate() {
                    all[bin] += x.norm_sqr();
                    mean[channel * self.samples + bin] += x / self.loops as f64;
                }
            }
        }
        // The variance over the chirps is what is left without their mean.
        let mut still = vec![0.0; self.samples];
        for line in mean.chunks_exact(self.samples.max(1)) {
            still.iter_mut().zip(line).for_each(|(sum, x)| *sum += self.loops as f64 * x.norm_sqr());
        }
        let moving = all.iter().zip(&still).map(|(all, still)| ((all - still).max(0.0) / lines).sqrt()).collect();
        (all.iter().map(|power| (power / lines).sqrt()).collect(), moving)
    }

    /// Energy of the range spectra beyond half the sampling rate over that below, without bin 0. Echoes of a room lie below
    /// where I and Q of the samples are in order: their delays are short against what the sampling rate could tell.
    pub fn upper_to_lower(&self) -> f64 {
        let stage = Stage::new(Window::Rectangular, self.samples, self.samples, false);
        let (mut bench, half) = (stage.bench(), self.samples / 2);
        let energy = |bins: &[Complex64]| bins.iter().map(Complex64::norm_sqr).sum::<f64>();
        let (mut lower, mut upper) = (0.0, 0.0);
        for chirp in self.data.chunks_exact(self.samples.max(1)) {
            let spectrum = stage.run_in(chirp.iter().copied(), &mut bench);
            lower += energy(spectrum.get(1..half).unwrap_or_default());
            upper += energy(spectrum.get(half + 1..).unwrap_or_default());
        }
        upper / lower.max(f64::MIN_POSITIVE)
    }
}

impl RangeDoppler {
    /// These channels of it, in this order.
    pub fn of_channels(&self, channels: &[usize]) -> Self {
        let line = |range: usize, channel: usize| {
            let from = (range * self.channels + channel) * self.dopplers;
            self.data.get(from..from + self.dopplers).unwrap_or_default()
        };
        let ranges = 0..self.ranges;
        let data =
            ranges.flat_map(|range| channels.iter().flat_map(move |&channel| line(range, channel).iter().copied()));
        Self { channels: channels.len(), data: data.collect(), ..*self }
    }

    /// The channels of one range and Doppler bin.
    fn channels_at(&self, range: usize, doppler: usize) -> impl Iterator<Item = Complex64> + '_ {
        let from = range * self.channels * self.dopplers + doppler;
        (0..self.channels).map(move |channel| self.data[from + channel * self.dopplers])
    }

    /// Amplitude of each (range, Doppler): the root of the power summed over the channels.
    pub fn amplitudes(&self) -> Vec<f64> {
        let row = |range: &[Complex64]| {
            let power =
                |bin: usize| range.iter().skip(bin).step_by(self.dopplers).map(Complex64::norm_sqr).sum::<f64>();
            (0..self.dopplers).map(|bin| power(bin).sqrt()).collect::<Vec<f64>>()
        };
        self.data.chunks_exact((self.channels * self.dopplers).max(1)).flat_map(row).collect()
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
        let Some(last) = self.ranges.checked_sub(2).filter(|&last| r >= 0.0 && r <= (last + 1) as f64 && s.is_finite())
        else {
            return f64::NAN;
        };
        let (i, a) = ((r as usize).min(last), s.floor());
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
