//! FMCW synthesis: point scatterers to ADC samples.
//!
//! One transmitter sends a linear up-chirp; a line of receivers mixes the echoes with it. A scatterer with the delay
//! τ = (‖p − p_tx‖ + ‖p − p_rx‖)/c gives the beat signal
//!
//! ```text
//! s(t) = a/(d_tx d_rx) · g · exp(i 2π (f₀ τ + S τ t − S τ²/2)),   t = n T_c/N
//! ```
//!
//! (transmitted times conjugate received: beat and Doppler frequencies are positive for positive ranges and for scatterers
//! that move away). Delays are exact per element and chirp: wavefront curvature, range migration and Doppler are in the
//! samples. What is assumed: scatterers stand still during a chirp's 60 µs (the shift that this leaves out is
//! v·f·T_c/B, 2 mm at 1.5 m/s), all elements are sampled at once (a real device may build its virtual array by
//! time division), single scattering, no coupling from transmitter to receivers.

use super::RadarConfig;
use super::SPEED_OF_LIGHT;
use crate::geometry::{Vec3, add, norm, scale, sub};
use num_complex::Complex64;
use rand::Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// What the synthesis needs besides the chirp.
#[derive(Debug, Clone, PartialEq)]
pub struct Fmcw {
    /// The chirp; `frame_s` spans all chirps of a frame.
    pub radar: RadarConfig,
    /// ADC samples a chirp N (complex: I and Q), spread evenly over `chirp_s`.
    pub samples: usize,
    /// Chirps a frame.
    pub chirps: usize,
    /// The receivers.
    pub array: LinearArray,
}

/// Receivers in a line, centred on the transmitter at the origin; boresight is x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearArray {
    /// Unit vector from element to element.
    pub direction: Vec3,
    /// Number of elements.
    pub elements: usize,
    /// Distance between elements, m.
    pub spacing_m: f64,
}

impl LinearArray {
    /// Position of an element, m.
    pub fn element(&self, index: usize) -> Vec3 {
        scale(self.direction, (index as f64 - (self.elements as f64 - 1.0) / 2.0) * self.spacing_m)
    }
}

/// A point that scatters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatterer {
    /// World position, m.
    pub position: Vec3,
    /// Amplitude and phase of its echo at 1 m on boresight.
    pub reflectivity: Complex64,
}

/// The ADC samples of one frame, ordered (chirp, element, sample).
#[derive(Debug, Clone, PartialEq)]
pub struct AdcCube {
    /// Chirps.
    pub chirps: usize,
    /// Elements.
    pub elements: usize,
    /// Samples.
    pub samples: usize,
    /// chirps · elements · samples numbers.
    pub data: Vec<Complex64>,
}

/// The receiver's imperfections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Standard deviation of the thermal noise in I and in Q, in units of the echo at 1 m.
    pub noise: f64,
    /// Largest I or Q that the converter takes, same units; beyond it clips.
    pub full_scale: f64,
    /// Bits of the converter, sign included.
    pub bits: u32,
}

impl Fmcw {
    /// Seconds from one chirp to the next.
    pub fn chirp_interval_s(&self) -> f64 {
        self.radar.frame_s / self.chirps as f64
    }

    /// Time of a chirp relative to the middle of the frame, s.
    pub fn chirp_time_s(&self, chirp: usize) -> f64 {
        (chirp as f64 - (self.chirps as f64 - 1.0) / 2.0) * self.chirp_interval_s()
    }

    /// Range at which the beat frequency reaches the sampling rate, N c/(2B), m.
    pub fn unambiguous_range_m(&self) -> f64 {
        self.samples as f64 * self.radar.range_resolution_m()
    }

    /// The frame of a scene: `at(t)` gives the moving scatterers at t seconds from the middle of the frame, `still` those
    /// that never move. No noise, no quantisation: see [`AdcCube::digitise`].
    pub fn synthesise(&self, still: &[Scatterer], at: impl Fn(f64) -> Vec<Scatterer> + Sync) -> AdcCube {
        let background = self.chirp(still);
        let data = (0..self.chirps)
            .into_par_iter()
            .flat_map_iter(|chirp| {
                let mut signal = background.clone();
                self.add_chirp(&at(self.chirp_time_s(chirp)), &mut signal);
                signal
            })
            .collect();
        AdcCube { chirps: self.chirps, elements: self.array.elements, samples: self.samples, data }
    }

    /// The beat signals of one chirp, (elements, samples).
    pub fn chirp(&self, scatterers: &[Scatterer]) -> Vec<Complex64> {
        let mut signal = vec![Complex64::ZERO; self.array.elements * self.samples];
        self.add_chirp(scatterers, &mut signal);
        signal
    }

    fn add_chirp(&self, scatterers: &[Scatterer], signal: &mut [Complex64]) {
        for (index, line) in signal.chunks_exact_mut(self.samples).enumerate() {
            let element = self.array.element(index);
            for scatterer in scatterers {
                self.add_echo(scatterer, element, line);
            }
        }
    }

    /// Adds one scatterer's echo at one element. The phase is linear in time, so that one rotation a sample is exact
    /// up to rounding (relative error below 1e−12 after 1024 samples).
    fn add_echo(&self, scatterer: &Scatterer, element: Vec3, line: &mut [Complex64]) {
        let d_tx = norm(scatterer.position);
        let d_rx = norm(sub(scatterer.position, element));
        let gain = element_gain(scatterer.position) / (d_tx * d_rx);
        if gain <= 0.0 || !gain.is_finite() {
            return;
        }
        let (slope, delay) = (self.radar.slope_hz_per_s(), (d_tx + d_rx) / SPEED_OF_LIGHT);
        let cycles = self.radar.start_hz * delay - 0.5 * slope * delay * delay;
        let step_cycles = slope * delay * self.radar.chirp_s / self.samples as f64;
        let first = scatterer.reflectivity * gain * Complex64::cis(TAU * cycles.fract());
        let step = Complex64::cis(TAU * step_cycles.fract());
        rotate_into(first, step, line);
    }
}

/// line[n] += first · stepⁿ, in four interleaved recurrences: one alone waits for its own multiplication every sample.
fn rotate_into(first: Complex64, step: Complex64, line: &mut [Complex64]) {
    let two = step * step;
    let four = two * two;
    let (mut a, mut b, mut c, mut d) = (first, first * step, first * two, first * step * two);
    let mut quads = line.chunks_exact_mut(4);
    for quad in &mut quads {
        if let [w, x, y, z] = quad {
            *w += a;
            *x += b;
            *y += c;
            *z += d;
        }
        (a, b, c, d) = (a * four, b * four, c * four, d * four);
    }
    for (sample, phasor) in quads.into_remainder().iter_mut().zip([a, b, c]) {
        *sample += phasor;
    }
}

/// Two-way amplitude pattern of transmitter and element: the cosine of the angle from boresight, nothing behind. Each of the
/// two has power cos θ, 120° wide at −3 dB.
pub fn element_gain(position: Vec3) -> f64 {
    (position[0] / norm(position)).max(0.0)
}

impl AdcCube {
    /// Adds thermal noise, clips at full scale and rounds to the converter's steps; the samples become integers
    /// (least significant bits). Returns how many I or Q values were clipped.
    pub fn digitise(&mut self, receiver: &Receiver, rng: &mut impl Rng) -> usize {
        let top = 2f64.powi(receiver.bits as i32 - 1);
        let mut clipped = 0;
        let mut convert = |value: f64, noise: f64| {
            let counts = ((value + receiver.noise * noise) / receiver.full_scale * top).round();
            clipped += usize::from(counts < -top || counts > top - 1.0);
            counts.clamp(-top, top - 1.0)
        };
        for sample in &mut self.data {
            let (i, q) = (rng.sample(StandardNormal), rng.sample(StandardNormal));
            *sample = Complex64::new(convert(sample.re, i), convert(sample.im, q));
        }
        clipped
    }
}

/// A scatterer that moves evenly: a convenience for tests and single targets.
pub fn moving_point(position: Vec3, velocity: Vec3, reflectivity: f64) -> impl Fn(f64) -> Vec<Scatterer> + Sync {
    move |t| {
        vec![Scatterer { position: add(position, scale(velocity, t)), reflectivity: Complex64::new(reflectivity, 0.0) }]
    }
}
