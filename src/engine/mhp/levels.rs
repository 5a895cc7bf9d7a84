//! L_EM that compares levels instead of one mask; SPEC section 8.
//!
//! With I the measured power of a cell, n its noise and S the simulated power, M = g S + n, g so that both have the same power
//! above the noise. `ncc_db` is one minus the correlation of ln(I + n̂) with ln(M + n̂), `gamma` the mean of the Itakura–Saito
//! divergence of I from M. Under a body's main lobe are its sidelobes, which no model of a person has: n̂ = max(n, 10^(−D/10)) of the
//! brightest cell's power, so that beyond the dynamic range D (`dynamic_range_db`) levels are not told apart; SPEC's formula has n̂ = n.
//! What a cell without an echo says is the same in every evaluation and is summed once: an evaluation
//! adds what the simulated power changes of it, d = ln(1 + g S / (n + n̂)) or y = g S / n.

use super::cell_box::CellBox;
use super::level_rows::LevelRows;
use super::tiles::LevelTiles;
use crate::config::EmLoss;
use crate::radar::Quantity;

/// The share of a map's cells, percent, that lie at or below the noise.
pub(super) const NOISE_PCT: f64 = 30.0;
/// The least noise and the least power of a cell, of the largest: zeros have no logarithm.
pub(super) const LEAST_POWER: f64 = 1e-12;
/// The least power above the noise, of all.
const LEAST_ABOVE: f64 = 1e-6;
/// Below a correlation and a sum of powers, so that both have a slope everywhere.
pub(super) const REGULARISER: f64 = 1e-20;

/// What is measured over a region's cells, in the order of its sum.
pub(super) struct Levels {
    kind: EmLoss,
    /// ln(I + n̂) less its mean (`ncc_db`), or I/n (`gamma`).
    measured: Vec<f64>,
    /// 1/(n + n̂) or 1/n: what turns g S into x or y.
    by_noise: Vec<f64>,
    /// ln(n + n̂) less its mean; 0 where the noise is the same everywhere.
    base: Vec<f64>,
    pub(super) totals: LevelTotals,
    /// The same in tiles; empty in double precision, and where there are rows.
    pub(super) tiles: LevelTiles,
    /// The same in rows, where the view has two axes and powers add.
    pub(super) rows: Option<LevelRows>,
}

/// What is the same in every evaluation.
#[derive(Debug, Clone, Copy)]
pub(super) struct LevelTotals {
    pub(super) kind: EmLoss,
    /// Cells.
    pub(super) count: f64,
    /// max(Σ (I − n), 10⁻⁶ Σ I)
    pub(super) above: f64,
    /// The least (n + n̂)/2 or n.
    pub(super) noise: f64,
    /// Σ a², Σ a b₀ and Σ b₀² of the deviations from the means (`ncc_db`).
    pub(super) variation: f64,
    pub(super) common: f64,
    pub(super) base_variation: f64,
    /// The mean over a map of noise alone (`gamma`).
    pub(super) idle: f64,
}

/// Where a correlation of sums stands, and what its slopes are made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correlation {
    pub(super) loss: f64,
    /// ∂L/∂d of a cell is `by_measured` · a + `by_level` · (b₀ + d − `mean`).
    pub(super) by_measured: f64,
    pub(super) by_level: f64,
    pub(super) mean: f64,
}

impl LevelTotals {
    /// g, for a sum of simulated powers.
    pub(super) fn gain(&self, power: f64) -> f64 {
        self.above / (power + REGULARISER)
    }

    /// `ncc_db` from Σ d, Σ a d and Σ (2 b₀ + d) d.
    pub(super) fn correlation(&self, [d, a_d, d_d]: [f64; 3]) -> Correlation {
        let mean = d / self.count;
        let variation = self.base_variation + d_d - d * mean;
        let common = self.common + a_d;
        let root = (self.variation * variation + REGULARISER).sqrt();
        Correlation {
            loss: 1.0 - common / root,
            by_measured: -1.0 / root,
            by_level: common * self.variation / (root * root * root),
            mean,
        }
    }
}

impl Levels {
    /// Of the cells of `cell_box`, whose measured numbers in C order of the view's own axes are `cells`; `noise` is the power of the
    /// whole map's noise and `background` a power to be added to the noise of each cell, of the same unit as the map's power, if there is one. Cells
    /// that are NaN are erased: the others alone are compared, and what is handed to [`Self::compare`] is theirs.
    pub(super) fn new(
        (kind, dynamic_range_db): (EmLoss, f64),
        quantity: Quantity,
        cell_box: &CellBox,
        (cells, noise): (&[f64], f64),
        background: Option<&[f64]>,
        in_rows: bool,
    ) -> Self {
        let power = |x: f64| quantity.power(x);
        let largest = cells.iter().copied().fold(0.0, f64::max);
        let unit = if largest > 0.0 { power(largest) } else { 1.0 };
        let noise = (noise / unit).max(LEAST_POWER);
        let ordered = cell_box.in_order_of_sum(cells);
        let left = |(x, _): &(&f64, f64)| !x.is_nan();
        let noises: Vec<f64> = match background {
            None => vec![noise; ordered.len()],
            Some(of) => cell_box.in_order_of_sum(of).iter().map(|&b| noise + b.max(0.0) / unit).collect(),
        };
        let (intensity, noises): (Vec<f64>, Vec<f64>) =
            ordered.iter().zip(noises).filter(left).map(|(&x, n)| (power(x) / unit, n)).unzip();
        let count = intensity.len().max(1) as f64;
        let (total, above) =
            intensity.iter().zip(&noises).fold((0.0, 0.0), |(total, above), (&i, &n)| (total + i, above + (i - n)));
        let centred = |values: Vec<f64>| -> Vec<f64> {
            let mean = values.iter().sum::<f64>() / count;
            values.into_iter().map(|x| x - mean).collect()
        };
        let levels = || intensity.iter().zip(&noises);
        let least = 10f64.powf(-0.1 * dynamic_range_db);
        // n̂, and n + n̂
        let raised = |n: f64| n.max(least);
        let both = |n: f64| n + raised(n);
        let (measured, by_noise, base): (Vec<f64>, Vec<f64>, Vec<f64>) = match kind {
            EmLoss::Gamma => (
                levels().map(|(&i, &n)| if i > 0.0 { i / n } else { LEAST_POWER / n }).collect(),
                noises.iter().map(|n| 1.0 / n).collect(),
                vec![0.0; intensity.len()],
            ),
            EmLoss::Iou | EmLoss::NccDb => (
                centred(levels().map(|(&i, &n)| (i + raised(n)).ln()).collect()),
                noises.iter().map(|&n| 1.0 / both(n)).collect(),
                if background.is_some() {
                    centred(noises.iter().map(|&n| both(n).ln()).collect())
                } else {
                    vec![0.0; intensity.len()]
                },
            ),
        };
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // ln n + I/n − ln I − 1
        let idle = measured.iter().map(|of| of - of.max(f64::MIN_POSITIVE).ln() - 1.0).sum::<f64>() / count;
        let totals = LevelTotals {
            kind,
            count,
            above: above.max(LEAST_ABOVE * total).max(f64::MIN_POSITIVE),
            noise: noises
                .iter()
                .map(|&n| if kind == EmLoss::Gamma { n } else { 0.5 * both(n) })
                .fold(f64::INFINITY, f64::min),
            variation: product(&measured, &measured),
            common: product(&measured, &base),
            base_variation: product(&base, &base),
            idle: if kind == EmLoss::Gamma { idle } else { 0.0 },
        };
        // Tiles and rows hold whole boxes: an erased cell says nothing there, whatever is simulated in it.
        let whole = [&measured, &by_noise, &base].map(|values| {
            let mut values = values.iter();
            let of_cell = |x: &f64| if x.is_nan() { 0.0 } else { values.next().copied().unwrap_or_default() };
            ordered.iter().map(of_cell).collect::<Vec<f64>>()
        });
        let values = [whole[0].as_slice(), &whole[1], &whole[2]];
        let marks = (cell_box.marked.as_slice(), cell_box.there.as_deref());
        let rows = in_rows.then(|| LevelRows::new(&cell_box.bins, marks, values)).flatten();
        let tiles = if rows.is_some() { LevelTiles::default() } else { LevelTiles::new(&cell_box.grid, values) };
        Self { kind, measured, by_noise, base, totals, tiles, rows }
    }

    /// L_view without any echo (`ncc_db`), or 1.
    pub(super) fn empty_loss(&self) -> f64 {
        if self.kind == EmLoss::NccDb { self.totals.correlation([0.0; 3]).loss } else { 1.0 }
    }

    /// L_view where the cells' simulated powers are `power`; and, where a `factor` is given, its product with ∂L_view/∂ln|S| of
    /// each cell, S = H_sim.
    pub(super) fn compare(&self, power: &[f64], factor: Option<f64>) -> (f64, Option<Vec<f64>>) {
        let totals = &self.totals;
        let sum: f64 = power.iter().sum();
        let gain = totals.gain(sum);
        // g S in units of the noise.
        let above: Vec<f64> = power.iter().zip(&self.by_noise).map(|(s, by_noise)| gain * s * by_noise).collect();
        // ∂L/∂(g S) of each cell.
        let (loss, slopes): (f64, Vec<f64>) = match self.kind {
            EmLoss::Gamma => {
                let cell = |(&y, &i): (&f64, &f64)| y.ln_1p() - i * y / (1.0 + y);
                let loss = totals.idle + above.iter().zip(&self.measured).map(cell).sum::<f64>() / totals.count;
                let slope = |((&y, &i), by_noise): ((&f64, &f64), &f64)| {
                    let m = 1.0 / (1.0 + y);
                    by_noise * m * (1.0 - i * m) / totals.count
                };
                (loss, above.iter().zip(&self.measured).zip(&self.by_noise).map(slope).collect())
            }
            EmLoss::Iou | EmLoss::NccDb => {
                let d: Vec<f64> = above.iter().map(|x| x.ln_1p()).collect();
                let cells = || d.iter().zip(&self.measured).zip(&self.base);
                let sums = cells()
                    .fold([0.0; 3], |[s, a_s, s_s], ((&d, &a), &b)| [s + d, a_s + a * d, s_s + (2.0 * b + d) * d]);
                let found = totals.correlation(sums);
                let slope = |(k, (&d, &x)): (usize, (&f64, &f64))| {
                    let level = self.base[k] + d - found.mean;
                    (found.by_measured * self.measured[k] + found.by_level * level) * self.by_noise[k] / (1.0 + x)
                };
                (found.loss, d.iter().zip(&above).enumerate().map(slope).collect())
            }
        };
        let weights = factor.map(|factor| {
            let through_gain = slopes.iter().zip(power).map(|(c, s)| c * s).sum::<f64>() / (sum + REGULARISER);
            power.iter().zip(&slopes).map(|(s, c)| 2.0 * factor * s * gain * (c - through_gain)).collect()
        });
        (loss, weights)
    }
}
