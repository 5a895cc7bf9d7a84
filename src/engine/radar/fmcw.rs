//! FMCW synthesis: point scatterers to ADC samples.
//!
//! The transmitters send linear up-chirps in turn (TDM-MIMO); the receivers mix the echoes with them. An echo that leaves a
//! transmitter towards p_out and reaches a receiver from p_back (the same place, unless a wall is in between) has the delay
//! τ = (‖p_out − tx‖ + ‖p_back − rx‖)/c and gives the beat signal
//!
//! ```text
//! s(t) = a · g/(d_tx d_rx) · exp(i 2π (f₀ τ + S τ t − S τ²/2)),   t = n T_c/N
//! ```
//!
//! (transmitted times conjugate received: beat and Doppler frequencies are positive for positive ranges and for scatterers
//! that move away). Delays are exact per transmitter, receiver and chirp: wavefront curvature, range migration, Doppler and the
//! Doppler phase between the transmitters' turns are in the samples. What is assumed: scatterers stand still during a chirp's 60 µs
//! (the shift that this leaves out is v·f·T_c/B, 2 mm at 1.5 m/s) and accelerate evenly during a frame.

use super::tones::Tones;
use super::{MimoArray, RadarConfig, SPEED_OF_LIGHT};
use crate::geometry::{Vec3, norm, sub};
use num_complex::Complex64;
use rand::Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

/// What the synthesis needs besides the chirp.
#[derive(Debug, Clone, PartialEq)]
pub struct Fmcw {
    /// The chirp; `frame_s` spans all chirps of a frame.
    pub radar: RadarConfig,
    /// ADC samples a chirp N (complex: I and Q), spread evenly over `chirp_s`.
    pub samples: usize,
    /// Times that every transmitter sends in a frame.
    pub loops: usize,
    /// Transmitters and receivers.
    pub array: MimoArray,
}

/// Where a point is about the middle of a frame: p(t) = position + velocity t + ½ acceleration t².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PointMotion {
    /// m, world frame.
    pub position: Vec3,
    /// m/s.
    pub velocity: Vec3,
    /// m/s².
    pub acceleration: Vec3,
}

impl PointMotion {
    /// A point that stays.
    pub fn still(position: Vec3) -> Self {
        Self { position, ..Self::default() }
    }

    /// The parabola through the places at −`half_s`, 0 and `half_s`.
    pub fn through(before: Vec3, now: Vec3, after: Vec3, half_s: f64) -> Self {
        let of = |f: &dyn Fn(usize) -> f64| -> Vec3 { std::array::from_fn(f) };
        Self {
            position: now,
            velocity: of(&|k| (after[k] - before[k]) / (2.0 * half_s)),
            acceleration: of(&|k| (after[k] - 2.0 * now[k] + before[k]) / (half_s * half_s)),
        }
    }

    /// The place at `t` seconds from the middle of the frame, m.
    pub fn at(&self, t: f64) -> Vec3 {
        let half = 0.5 * t * t;
        std::array::from_fn(|k| self.position[k] + t * self.velocity[k] + half * self.acceleration[k])
    }
}

/// One path from the transmitters to the receivers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// Where the path leads to, as the transmitters see it.
    pub out: PointMotion,
    /// Where it comes from, as the receivers see it.
    pub back: PointMotion,
    /// Amplitude and phase of the echo of a point at 1 m on boresight.
    pub reflectivity: Complex64,
}

impl Echo {
    /// The direct echo of a point.
    pub fn direct(track: PointMotion, reflectivity: Complex64) -> Self {
        Self { out: track, back: track, reflectivity }
    }

    /// The direct echo of a point that stays.
    pub fn still(position: Vec3, reflectivity: Complex64) -> Self {
        Self::direct(PointMotion::still(position), reflectivity)
    }

    /// The direct echo of a point that moves evenly.
    pub fn moving(position: Vec3, velocity: Vec3, reflectivity: f64) -> Self {
        Self::direct(PointMotion { velocity, ..PointMotion::still(position) }, Complex64::new(reflectivity, 0.0))
    }
}

/// The ADC samples of one frame, ordered (loop, channel, sample), channels as in [`MimoArray`].
#[derive(Debug, Clone, PartialEq)]
pub struct AdcCube {
    /// Loops.
    pub loops: usize,
    /// Channels.
    pub channels: usize,
    /// Samples.
    pub samples: usize,
    /// loops · channels · samples numbers.
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
    /// Seconds from one chirp to the next, whichever transmitter sends it.
    pub fn slot_s(&self) -> f64 {
        self.loop_s() / self.array.tx.len() as f64
    }

    /// Seconds from one chirp of a transmitter to its next.
    pub fn loop_s(&self) -> f64 {
        self.radar.frame_s / self.loops as f64
    }

    /// Time of a chirp relative to the middle of the frame, s.
    pub fn chirp_time_s(&self, index: usize, tx: usize) -> f64 {
        let slots = self.loops * self.array.tx.len();
        let slot = index * self.array.tx.len() + tx;
        (slot as f64 - (slots as f64 - 1.0) / 2.0) * self.slot_s()
    }

    /// Range at which the beat frequency reaches the sampling rate, N c/(2B), m.
    pub fn unambiguous_range_m(&self) -> f64 {
        self.samples as f64 * self.radar.range_resolution_m()
    }

    /// Largest radial speed without ambiguity, λ/(4 T_loop), m/s.
    pub fn unambiguous_speed_mps(&self) -> f64 {
        self.radar.wavelength_m() / (4.0 * self.loop_s())
    }

    /// The beat signals of one loop, (channels, samples), of what does not move.
    pub fn loop_of(&self, still: &[Echo]) -> Vec<Complex64> {
        let mut lines = vec![Complex64::ZERO; self.array.channels() * self.samples];
        let mut bench = Bench::new(self);
        for (tx, lines) in lines.chunks_exact_mut(self.array.rx.len() * self.samples).enumerate() {
            bench.add(self, still, 0.0, tx, lines);
        }
        lines
    }

    /// The frame of a scene: `background` is one loop of what stands still ([`Self::loop_of`]), `moving` are the echoes of the
    /// rest. No noise, no quantisation: see [`AdcCube::digitise`].
    pub fn synthesise(&self, background: &[Complex64], moving: &[Echo]) -> AdcCube {
        let mut data = Vec::with_capacity(self.loops * background.len());
        let mut bench = Bench::new(self);
        let block = self.array.rx.len() * self.samples;
        for index in 0..self.loops {
            let from = data.len();
            data.extend_from_slice(background);
            for (tx, lines) in data[from..].chunks_exact_mut(block).enumerate() {
                bench.add(self, moving, self.chirp_time_s(index, tx), tx, lines);
            }
        }
        AdcCube { loops: self.loops, channels: self.array.channels(), samples: self.samples, data }
    }
}

/// What adding echoes to the lines of one transmitter's turn needs again and again.
struct Bench {
    tones: Tones,
    grids: Vec<Vec<Complex64>>,
    work: Vec<Complex64>,
}

impl Bench {
    fn new(fmcw: &Fmcw) -> Self {
        let tones = Tones::new(fmcw.samples);
        let grids = vec![vec![Complex64::ZERO; tones.cells()]; fmcw.array.rx.len()];
        Self { tones, grids, work: Vec::new() }
    }

    /// Adds the echoes at time `t` of what transmitter `tx` sends to the lines of all receivers.
    fn add(&mut self, fmcw: &Fmcw, echoes: &[Echo], t: f64, tx: usize, lines: &mut [Complex64]) {
        let Some(&transmitter) = fmcw.array.tx.get(tx) else { return };
        let (start, slope) = (fmcw.radar.start_hz, fmcw.radar.slope_hz_per_s());
        let sample_s = fmcw.radar.chirp_s / fmcw.samples as f64;
        for echo in echoes {
            let (out, back) = (echo.out.at(t), echo.back.at(t));
            let d_tx = norm(sub(out, transmitter));
            let gain = path_gain(out, back) / d_tx;
            if gain <= 0.0 || !gain.is_finite() {
                continue;
            }
            let strength = echo.reflectivity * gain;
            for (receiver, grid) in fmcw.array.rx.iter().zip(&mut self.grids) {
                let d_rx = norm(sub(back, *receiver));
                let delay = (d_tx + d_rx) / SPEED_OF_LIGHT;
                let phase = start * delay - 0.5 * slope * delay * delay;
                self.tones.add(grid, strength / d_rx, phase, slope * delay * sample_s);
            }
        }
        for (grid, line) in self.grids.iter_mut().zip(lines.chunks_exact_mut(fmcw.samples)) {
            self.tones.finish(grid, &mut self.work, line);
        }
    }
}

/// Two-way amplitude pattern: each of transmitter and receiver has power cos θ about boresight, 120° wide at −3 dB, and nothing
/// behind.
pub fn path_gain(out: Vec3, back: Vec3) -> f64 {
    let cosine = |p: Vec3| (p[0] / norm(p)).max(0.0);
    (cosine(out) * cosine(back)).sqrt()
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

/// Leakage from the transmitters straight into the receivers: for each channel a steady beat tone of `amplitude` at the length of
/// `path_m`, with a phase of its own. Adds it to one loop of background.
pub fn add_leakage(fmcw: &Fmcw, amplitude: f64, path_m: f64, rng: &mut impl Rng, background: &mut [Complex64]) {
    let step = fmcw.radar.slope_hz_per_s() * path_m / SPEED_OF_LIGHT * fmcw.radar.chirp_s / fmcw.samples as f64;
    for line in background.chunks_exact_mut(fmcw.samples) {
        let phase: f64 = rng.random_range(0.0..1.0);
        for (n, sample) in line.iter_mut().enumerate() {
            *sample += amplitude * Complex64::cis(TAU * (phase + step * n as f64));
        }
    }
}
