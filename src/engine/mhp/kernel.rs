//! The per-cell kernel: sums the joints' returns over a box of cells, and collects each joint's moments on the way back.
//!
//! A row of cells is a run along the view's last axis. On a row every joint's exponent is `c − ½P(i − i₀)²` and its
//! phase turns by a fixed table, so that a cell costs one exponential and one complex product a joint. Rows are taken
//! relative to their strongest joint, so f32 neither under- nor overflows; everything that is done once a row or once
//! a joint is f64. The same code serves both precisions.

use super::adjoint::{Moments, Sums};
use super::scalar::Real;
use super::splat::{Splat, Splats};
use crate::config::Summation;

/// The last axis among three.
const LAST: usize = 2;

/// A joint along the last axis: what does not change from row to row.
struct Inner<T> {
    /// ½ P_nn
    half_precision: T,
    /// Bin coordinate of the joint, whole and fractional part, so that i − b keeps its digits in f32. The whole part is no
    /// integer: a joint far beyond a fine axis lies at a bin that none holds.
    bin: (f64, T),
    /// Re and Im of e^{iκ_n(i − b_n)} a cell of the row.
    turn: (Vec<T>, Vec<T>),
    /// ln of the spectrum a cell of the row; empty unless the last axis is a Doppler axis.
    spectrum: Vec<T>,
}

/// A joint on one row.
#[derive(Clone, Copy)]
struct OnRow<T> {
    /// Largest exponent, relative to the row's reference.
    top: T,
    /// Where it lies, whole and fractional bin.
    centre: (f64, T),
    /// e^{i(φ + κ·Δ)} of the outer axes.
    turn: (T, T),
}

/// Joints' splats over a box of cells of one view.
pub(super) struct Kernel<'a, T> {
    splats: Vec<Splat<'a>>,
    inner: Vec<Inner<T>>,
    bins: &'a [[usize; 2]],
    summation: Summation,
    // Scratch of one row, (joints, cells of the row).
    amplitude: Vec<T>,
    on_row: Vec<OnRow<T>>,
    reference: Vec<T>,
    sum: (Vec<T>, Vec<T>),
}

fn split<T: Real>(x: f64) -> (f64, T) {
    let whole = x.floor();
    (whole, T::from_f64(x - whole))
}

/// The cells of the outer axes in C order: two indices (those of missing axes, which come first, are 0).
fn outer_cells(bins: &[[usize; 2]]) -> impl Iterator<Item = [usize; 2]> + use<> {
    let mut outer = bins.iter().rev().skip(1).copied();
    let second = outer.next().unwrap_or([0, 1]);
    let first = outer.next().unwrap_or([0, 1]);
    (first[0]..first[1]).flat_map(move |a| (second[0]..second[1]).map(move |b| [a, b]))
}

impl<'a, T: Real> Kernel<'a, T> {
    /// Prepares the sum of `splats` over the box `bins` ([lo, hi) per axis).
    pub(super) fn new(splats: &'a Splats, bins: &'a [[usize; 2]], summation: Summation) -> Self {
        let splats: Vec<_> = splats.iter().collect();
        let [lo, hi] = bins.last().copied().unwrap_or([0, 0]);
        let (width, joints) = (hi.saturating_sub(lo), splats.len());
        Self {
            inner: splats.iter().map(|splat| Inner::new(splat, lo, hi)).collect(),
            splats,
            bins,
            summation,
            amplitude: vec![T::zero(); width * joints],
            on_row: Vec::with_capacity(joints),
            reference: vec![T::zero(); width],
            sum: (vec![T::zero(); width], vec![T::zero(); width]),
        }
    }

    fn width(&self) -> usize {
        self.reference.len()
    }

    /// ln |S| of every cell of the box in C order (−∞ where nothing returns).
    pub(super) fn forward(&mut self, ln_s: &mut [f64]) {
        let width = self.width();
        if width == 0 {
            return;
        }
        for (outer, out) in outer_cells(self.bins).zip(ln_s.chunks_exact_mut(width)) {
            let row_top = self.row(outer);
            for (i, value) in out.iter_mut().enumerate() {
                *value = row_top + self.reference[i].into_f64() + 0.5 * self.power(i).into_f64().ln();
            }
        }
    }

    /// Adds to each joint's `moments` what the cells want: `weight` is ∂L/∂ln|S| a cell of the box.
    pub(super) fn backward(&mut self, weight: &[f64], moments: &mut Moments) {
        let width = self.width();
        if width == 0 {
            return;
        }
        let mut scaled = vec![T::zero(); width];
        for (outer, weight) in outer_cells(self.bins).zip(weight.chunks_exact(width)) {
            self.row(outer);
            for (i, scaled) in scaled.iter_mut().enumerate() {
                let power = self.power(i);
                *scaled = if power > T::zero() { T::from_f64(weight[i] / power.into_f64()) } else { T::zero() };
            }
            for joint in 0..self.splats.len() {
                self.collect(joint, outer, &scaled, moments);
            }
        }
    }

    /// |s|² of cell `i` of the current row, relative to its reference.
    fn power(&self, i: usize) -> T {
        match self.summation {
            Summation::Coherent => self.sum.0[i] * self.sum.0[i] + self.sum.1[i] * self.sum.1[i],
            Summation::Incoherent => self.sum.0[i],
        }
    }

    /// Evaluates one row: amplitudes relative to each cell's strongest joint, and their sum. Returns the row's
    /// reference exponent.
    fn row(&mut self, outer: [usize; 2]) -> f64 {
        let row_top = self.place(outer);
        self.exponents();
        let width = self.width();
        self.sum.0.fill(T::zero());
        self.sum.1.fill(T::zero());
        for (joint, amplitudes) in self.amplitude.chunks_exact_mut(width).enumerate() {
            for (amplitude, &reference) in amplitudes.iter_mut().zip(&self.reference) {
                let below = reference - *amplitude;
                // A NaN goes through: it must reach the loss.
                *amplitude = if below > T::CUTOFF_LN { T::zero() } else { (-below).exp() };
            }
            let inner = &self.inner[joint];
            match self.summation {
                Summation::Coherent => {
                    let (c, s) = self.on_row[joint].turn;
                    let cells = amplitudes.iter().zip(&inner.turn.0).zip(&inner.turn.1);
                    for (((&a, &re), &im), (sum_re, sum_im)) in
                        cells.zip(self.sum.0.iter_mut().zip(self.sum.1.iter_mut()))
                    {
                        *sum_re += a * (c * re - s * im);
                        *sum_im += a * (c * im + s * re);
                    }
                }
                Summation::Incoherent => {
                    for (&a, sum) in amplitudes.iter().zip(self.sum.0.iter_mut()) {
                        *sum += a * a;
                    }
                }
            }
        }
        row_top
    }

    /// Completes the square of every joint's exponent along the row.
    fn place(&mut self, outer: [usize; 2]) -> f64 {
        let tops: Vec<(f64, f64, f64)> = self.splats.iter().map(|splat| on_row(splat, outer)).collect();
        let row_top = tops.iter().map(|t| t.0).fold(f64::NEG_INFINITY, f64::max);
        self.on_row.clear();
        self.on_row.extend(tops.iter().map(|&(top, centre, phase)| OnRow {
            top: T::from_f64(top - row_top),
            centre: split(centre),
            turn: (T::from_f64(phase.cos()), T::from_f64(phase.sin())),
        }));
        row_top
    }

    /// Writes every joint's exponents along the row, and each cell's largest.
    fn exponents(&mut self) {
        let (width, lo) = (self.width(), self.bins.last().map_or(0, |b| b[0]));
        self.reference.fill(T::neg_infinity());
        for (joint, exponents) in self.amplitude.chunks_exact_mut(width).enumerate() {
            let (on_row, inner) = (&self.on_row[joint], &self.inner[joint]);
            let (start, fraction) = (lo as f64 - on_row.centre.0, on_row.centre.1);
            for (i, exponent) in exponents.iter_mut().enumerate() {
                let x = T::from_f64(start + i as f64) - fraction;
                *exponent = on_row.top - inner.half_precision * x * x;
            }
            for (exponent, &spectrum) in exponents.iter_mut().zip(&inner.spectrum) {
                *exponent += spectrum;
            }
            for (reference, &exponent) in self.reference.iter_mut().zip(exponents.iter()) {
                if exponent > *reference || exponent.is_nan() {
                    *reference = exponent;
                }
            }
        }
    }

    fn collect(&self, joint: usize, outer: [usize; 2], weight: &[T], moments: &mut Moments) {
        let (width, lo) = (self.width(), self.bins.last().map_or(0, |b| b[0]));
        let (inner, (c, s)) = (&self.inner[joint], self.on_row[joint].turn);
        let start = lo as f64 - inner.bin.0;
        let coherent = self.summation == Summation::Coherent;
        let [mut r0, mut r1, mut r2, mut q0, mut q1] = [T::zero(); 5];
        let by_bin = moments.by_bin(joint, LAST);
        for (i, &a) in self.amplitude[joint * width..(joint + 1) * width].iter().enumerate() {
            let delta = T::from_f64(start + i as f64) - inner.bin.1;
            let r = if coherent {
                let (re, im) = (inner.turn.0[i], inner.turn.1[i]);
                let (z_re, z_im) = (a * (c * re - s * im), a * (c * im + s * re));
                let (s_re, s_im) = (self.sum.0[i], self.sum.1[i]);
                let q = weight[i] * (s_im * z_re - s_re * z_im);
                q0 += q;
                q1 += q * delta;
                weight[i] * (s_re * z_re + s_im * z_im)
            } else {
                weight[i] * a * a
            };
            r0 += r;
            r1 += r * delta;
            r2 += r * delta * delta;
            if let Some(sum) = by_bin.get_mut(lo + i) {
                *sum += r.into_f64();
            }
        }
        let row = [r0, r1, r2, q0, q1].map(T::into_f64);
        let splat = &self.splats[joint];
        moments.add(joint, &row_sums(splat, outer, row));
        for k in 0..LAST {
            if let Some(sum) = moments.by_bin(joint, k).get_mut(outer[k]) {
                *sum += row[0];
            }
        }
    }
}

/// A joint's sums on a row from [Σr, ΣrΔ, ΣrΔ², Σq, ΣqΔ] (Δ along the last axis).
fn row_sums(splat: &Splat<'_>, outer: [usize; 2], [r, r2, r22, q, q2]: [f64; 5]) -> Sums {
    let [d0, d1] = outer_deltas(splat, outer);
    Sums {
        r,
        q,
        r_delta: [d0 * r, d1 * r, r2],
        q_delta: [d0 * q, d1 * q, q2],
        r_delta_delta: [d0 * d0 * r, d1 * d0 * r, d1 * d1 * r, d0 * r2, d1 * r2, r22],
    }
}

/// From the joint to the row at `outer`.
fn outer_deltas(splat: &Splat<'_>, outer: [usize; 2]) -> [f64; 2] {
    std::array::from_fn(|k| outer[k] as f64 - splat.bin[k])
}

/// A joint on the row at `outer`: largest exponent, the bin where it lies, and the phase at Δ_n = 0.
fn on_row(splat: &Splat<'_>, outer: [usize; 2]) -> (f64, f64, f64) {
    let ([d0, d1], [w0, w1, _], [s10, s20, s21]) = (outer_deltas(splat, outer), splat.weight, splat.skew);
    let from_ridge = d1 + s10 * d0;
    let spectrum = |k: usize| splat.spectrum[k].get(outer[k]).copied().unwrap_or(0.0);
    let top = splat.ln_weight + spectrum(0) + spectrum(1) - 0.5 * (w0 * d0 * d0 + w1 * from_ridge * from_ridge);
    let phase = splat.phase + splat.kappa[0] * d0 + splat.kappa[1] * d1;
    (top, splat.bin[LAST] - (s20 * d0 + s21 * d1), phase)
}

impl<T: Real> Inner<T> {
    fn new(splat: &Splat<'_>, lo: usize, hi: usize) -> Self {
        let turns = (lo..hi).map(|i| splat.kappa[LAST] * (i as f64 - splat.bin[LAST]));
        Self {
            half_precision: T::from_f64(0.5 * splat.weight[LAST]),
            bin: split(splat.bin[LAST]),
            turn: turns.map(|psi| (T::from_f64(psi.cos()), T::from_f64(psi.sin()))).unzip(),
            spectrum: splat.spectrum[LAST].get(lo..hi).unwrap_or(&[]).iter().map(|&x| T::from_f64(x)).collect(),
        }
    }
}
