//! The per-cell kernel: sums the joints' returns over a box of cells, and collects each joint's moments on the way back.
//!
//! A row of cells is a run along the view's last axis. On a row every joint's exponent is `c − ½P(i − i₀)²` and its
//! phase turns by a fixed table, so that a cell costs one exponential and one complex product a joint. Rows are taken
//! relative to their strongest joint, so f32 neither under- nor overflows; everything that is done once a row or once
//! a joint is f64. The same code serves both precisions.

use super::adjoint::Moments;
use super::scalar::Real;
use super::splat::Splat;
use crate::config::Summation;

/// A joint along the last axis: what does not change from row to row.
struct Inner<T> {
    /// ½ P_nn
    half_precision: T,
    /// Bin coordinate of the joint, whole and fractional part, so that i − b keeps its digits in f32.
    bin: (i64, T),
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
    centre: (i64, T),
    /// e^{i(φ + κ·Δ)} of the outer axes.
    turn: (T, T),
}

/// Joints' splats over a box of cells of one view.
pub(super) struct Kernel<'a, T> {
    splats: &'a [Splat],
    inner: Vec<Inner<T>>,
    bins: &'a [[usize; 2]],
    summation: Summation,
    // Scratch of one row, (joints, cells of the row).
    amplitude: Vec<T>,
    on_row: Vec<OnRow<T>>,
    reference: Vec<T>,
    sum: (Vec<T>, Vec<T>),
}

fn split<T: Real>(x: f64) -> (i64, T) {
    let whole = x.floor();
    (whole as i64, T::of(x - whole))
}

/// The cells of the outer axes in C order: up to two indices (unused ones are 0).
fn outer_cells(bins: &[[usize; 2]]) -> impl Iterator<Item = [usize; 2]> + use<> {
    let outer = bins.split_last().map_or(&[] as &[_], |(_, outer)| outer);
    let first = outer.first().map_or([0, 1], |b| *b);
    let second = outer.get(1).map_or([0, 1], |b| *b);
    (first[0]..first[1]).flat_map(move |a| (second[0]..second[1]).map(move |b| [a, b]))
}

impl<'a, T: Real> Kernel<'a, T> {
    /// Prepares the sum of `splats` over the box `bins` ([lo, hi) per axis).
    pub(super) fn new(splats: &'a [Splat], bins: &'a [[usize; 2]], summation: Summation) -> Self {
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
                *value = row_top + self.reference[i].wide() + 0.5 * self.power(i).wide().ln();
            }
        }
    }

    /// Adds to each joint's `moments` what the cells want: `weight` is ∂L/∂ln|S| a cell of the box.
    pub(super) fn backward(&mut self, weight: &[f64], moments: &mut [Moments]) {
        let width = self.width();
        if width == 0 {
            return;
        }
        let mut scaled = vec![T::zero(); width];
        for (outer, weight) in outer_cells(self.bins).zip(weight.chunks_exact(width)) {
            self.row(outer);
            for (i, scaled) in scaled.iter_mut().enumerate() {
                let power = self.power(i);
                *scaled = if power > T::zero() { T::of(weight[i] / power.wide()) } else { T::zero() };
            }
            for (joint, moments) in moments.iter_mut().enumerate() {
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
                *amplitude = if below > T::CUTOFF { T::zero() } else { (-below).exp() };
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
            top: T::of(top - row_top),
            centre: split(centre),
            turn: (T::of(phase.cos()), T::of(phase.sin())),
        }));
        row_top
    }

    /// Writes every joint's exponents along the row, and each cell's largest.
    fn exponents(&mut self) {
        let (width, lo) = (self.width(), self.bins.last().map_or(0, |b| b[0]) as i64);
        self.reference.fill(T::neg_infinity());
        for (joint, exponents) in self.amplitude.chunks_exact_mut(width).enumerate() {
            let (on_row, inner) = (&self.on_row[joint], &self.inner[joint]);
            let (start, fraction) = ((lo - on_row.centre.0) as i32, on_row.centre.1);
            for (i, exponent) in exponents.iter_mut().enumerate() {
                let x = T::of(f64::from(start + i as i32)) - fraction;
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
        let start = (lo as i64 - inner.bin.0) as i32;
        let coherent = self.summation == Summation::Coherent;
        let last = self.bins.len().saturating_sub(1);
        let [mut r0, mut r1, mut r2, mut q0, mut q1] = [T::zero(); 5];
        for (i, &a) in self.amplitude[joint * width..(joint + 1) * width].iter().enumerate() {
            let delta = T::of(f64::from(start + i as i32)) - inner.bin.1;
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
            if let Some(sum) = moments.r_by_bin[last].get_mut(lo + i) {
                *sum += r.wide();
            }
        }
        let row = [r0, r1, r2, q0, q1].map(T::wide);
        add_row(moments, &self.splats[joint], outer, row);
    }
}

/// Folds a row's sums [Σr, ΣrΔ, ΣrΔ², Σq, ΣqΔ] (Δ along the last axis) into a joint's moments.
fn add_row(moments: &mut Moments, splat: &Splat, outer: [usize; 2], [r0, r1, r2, q0, q1]: [f64; 5]) {
    let last = splat.dims - 1;
    let delta: [f64; 2] = std::array::from_fn(|k| outer[k] as f64 - splat.bin[k]);
    moments.r += r0;
    moments.q += q0;
    moments.r_delta[last] += r1;
    moments.q_delta[last] += q1;
    moments.r_delta_delta[last][last] += r2;
    for k in 0..last {
        moments.r_delta[k] += delta[k] * r0;
        moments.q_delta[k] += delta[k] * q0;
        moments.r_delta_delta[k][last] += delta[k] * r1;
        moments.r_delta_delta[last][k] += delta[k] * r1;
        for l in 0..last {
            moments.r_delta_delta[k][l] += delta[k] * delta[l] * r0;
        }
        if let Some(sum) = moments.r_by_bin[k].get_mut(outer[k]) {
            *sum += r0;
        }
    }
}

/// A joint on the row at `outer`: largest exponent, the bin where it lies, and the phase at Δ_n = 0.
fn on_row(splat: &Splat, outer: [usize; 2]) -> (f64, f64, f64) {
    let (last, p) = (splat.dims - 1, &splat.precision);
    let (mut top, mut shift, mut phase) = (splat.ln_weight, 0.0, splat.phase);
    for k in 0..last {
        let delta = outer[k] as f64 - splat.bin[k];
        phase += splat.kappa[k] * delta;
        shift += p[k][last] * delta;
        top += splat.spectrum[k].get(outer[k]).copied().unwrap_or(0.0);
        for l in 0..last {
            let schur = p[k][l] - p[k][last] * p[l][last] / p[last][last];
            top -= 0.5 * schur * delta * (outer[l] as f64 - splat.bin[l]);
        }
    }
    (top, splat.bin[last] - shift / p[last][last], phase)
}

impl<T: Real> Inner<T> {
    fn new(splat: &Splat, lo: usize, hi: usize) -> Self {
        let last = splat.dims - 1;
        let turns = (lo..hi).map(|i| splat.kappa[last] * (i as f64 - splat.bin[last]));
        Self {
            half_precision: T::of(0.5 * splat.precision[last][last]),
            bin: split(splat.bin[last]),
            turn: turns.map(|psi| (T::of(psi.cos()), T::of(psi.sin()))).unzip(),
            spectrum: splat.spectrum[last].get(lo..hi).unwrap_or(&[]).iter().map(|&x| T::of(x)).collect(),
        }
    }
}
