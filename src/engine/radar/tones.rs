//! Sums of many complex tones at once, by the non-uniform FFT.
//!
//! An ADC line is a sum of tones, one a scatterer, at frequencies off every grid. Adding each sample by sample costs samples ×
//! scatterers. Here each tone is spread over the [`WIDTH`] nearest cells of a frequency grid twice as fine as the line's own, one
//! inverse FFT turns the grid into samples, and a division takes the spreading kernel's own transform out again. The kernel
//! exp(β(√(1 − (2x/w)²) − 1)) with β = 2.3 w (Barnett, Magland, af Klinteberg 2019) leaves a relative error below 2e−6,
//! far below the step of a 16-bit converter.

use num_complex::Complex64;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Cells that a tone is spread over.
const WIDTH: usize = 8;
/// Rows of the kernel's table a cell; between rows it is interpolated linearly, with an error of 2e−7.
const ROWS: usize = 1024;
/// Points of the quadrature of the kernel's transform.
const QUADRATURE: usize = 128;

/// The plan for lines of one length.
pub(super) struct Tones {
    samples: usize,
    /// Kernel values of the [`WIDTH`] cells about a tone that lies `row/ROWS` of a cell behind the fourth.
    table: Vec<[f64; WIDTH]>,
    /// One over the kernel's transform at each sample.
    correction: Vec<f64>,
    plan: Arc<dyn Fft<f64>>,
}

fn kernel(x: f64) -> f64 {
    let u = 2.0 * x / WIDTH as f64;
    let inside = 1.0 - u * u;
    if inside <= 0.0 { 0.0 } else { (2.3 * WIDTH as f64 * (inside.sqrt() - 1.0)).exp() }
}

impl Tones {
    pub(super) fn new(samples: usize) -> Self {
        let cells = 2 * samples;
        let row = |row: usize| {
            let behind = row as f64 / ROWS as f64;
            std::array::from_fn(|cell| kernel(cell as f64 - (WIDTH / 2 - 1) as f64 - behind))
        };
        let step = WIDTH as f64 / QUADRATURE as f64;
        let transform = |frequency: f64| -> f64 {
            let at = |i: usize| (i as f64 + 0.5) * step - WIDTH as f64 / 2.0;
            (0..QUADRATURE).map(|i| kernel(at(i)) * (TAU * frequency * at(i)).cos()).sum::<f64>() * step
        };
        let offset = |n: usize| n as f64 - (samples / 2) as f64;
        Self {
            samples,
            table: (0..=ROWS).map(row).collect(),
            correction: (0..samples).map(|n| 1.0 / transform(offset(n) / cells as f64)).collect(),
            plan: FftPlanner::new().plan_fft_inverse(cells),
        }
    }

    /// Cells of a grid: the FFT's, and a margin so that spreading needs no wrapping.
    pub(super) fn cells(&self) -> usize {
        2 * self.samples + WIDTH
    }

    /// Adds amplitude · exp(i2π(phase + frequency·n)), n = 0…samples − 1, to a grid; phase in cycles, frequency in cycles a
    /// sample (only its fraction counts).
    #[inline]
    pub(super) fn add(&self, grid: &mut [Complex64], amplitude: Complex64, phase: f64, frequency: f64) {
        let frequency = frequency - frequency.floor();
        let middle = phase + frequency * (self.samples / 2) as f64;
        let weight = amplitude * Complex64::cis(TAU * (middle - middle.floor()));
        let at = frequency * (2 * self.samples) as f64;
        let cell = (at as usize).min(2 * self.samples - 1);
        let row = (at - cell as f64) * ROWS as f64;
        let first = (row as usize).min(ROWS - 1);
        let share = row - first as f64;
        if let (Some(cells), [low, high]) = (grid.get_mut(cell..cell + WIDTH), &self.table[first..first + 2]) {
            for (k, cell) in cells.iter_mut().enumerate() {
                *cell += weight * (low[k] + share * (high[k] - low[k]));
            }
        }
    }

    /// Adds the samples of a grid to `line`, and empties the grid. `work` has [`Self::cells`] cells and is overwritten.
    pub(super) fn finish(&self, grid: &mut [Complex64], work: &mut Vec<Complex64>, line: &mut [Complex64]) {
        let cells = 2 * self.samples;
        work.clear();
        // Grid cell k stands for frequency cell k − 3: the margin in front and behind wraps round.
        let front = WIDTH / 2 - 1;
        work.extend((0..cells).map(|k| grid[k + front]));
        for k in 0..front {
            work[cells - front + k] += grid[k];
        }
        for k in 0..WIDTH - front {
            work[k] += grid[cells + front + k];
        }
        self.plan.process(work);
        let half = self.samples / 2;
        for (n, (sample, correction)) in line.iter_mut().zip(&self.correction).enumerate() {
            *sample += work[(n + cells - half) % cells] * correction;
        }
        grid.fill(Complex64::ZERO);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_equal_tones_added_one_by_one() {
        for samples in [64, 256] {
            let tones = Tones::new(samples);
            let mut grid = vec![Complex64::ZERO; tones.cells()];
            let mut line = vec![Complex64::ZERO; samples];
            let parts: Vec<(Complex64, f64, f64)> = (0..40)
                .map(|i| {
                    let i = f64::from(i);
                    (Complex64::new(1.0 - 0.03 * i, 0.4), 0.37 * i, (i * 0.618_034 + 1e-4) % 1.0)
                })
                .chain([(Complex64::ONE, 0.0, 0.0), (Complex64::ONE, 0.2, 0.999_999)])
                .collect();
            for &(amplitude, phase, frequency) in &parts {
                tones.add(&mut grid, amplitude, phase, frequency);
            }
            tones.finish(&mut grid, &mut Vec::new(), &mut line);
            assert!(grid.iter().all(|x| *x == Complex64::ZERO));
            let total: f64 = parts.iter().map(|part| part.0.norm()).sum();
            for (n, sample) in line.iter().enumerate() {
                let exact: Complex64 =
                    parts.iter().map(|&(a, phase, f)| a * Complex64::cis(TAU * (phase + f * n as f64))).sum();
                assert!((sample - exact).norm() < 2e-6 * total, "{samples} {n}: {sample} {exact}");
            }
        }
    }
}
