//! L_EM on one view: soft mask of H_sim against the hard mask of H_ori; SPEC section 4.

use super::Precision;
use super::adjoint::{Moments, pull_back};
use super::cell_box::CellBox;
use super::floors::{EPSILON, SOFT_FLOOR, ViewLoss, floored, hard_iou, ln_floored};
use super::gaussian::{WorldGaussianBars, WorldGaussians};
use super::kernel::Kernel;
use super::level_rows::{RowQuery, RowScratch};
use super::levels::Levels;
use super::percentile::percentile;
use super::scalar::Real;
use super::splat::{Splats, ViewModel};
use super::tiles::{self, EmQuery, LevelQuery, Tiles};
use crate::body::Pppr;
use crate::config::FitConfig;

/// Returns below this share of the noise are left out of levels: of those that are shown, and of those of a search or a window.
const LEAST_SHOWN: f64 = 1e-9;
const LEAST_SEARCHED: f64 = 1e-3;

/// What one evaluation of a view needs besides its answer; kept, so that the next one allocates nothing.
#[derive(Default)]
pub(super) struct Workspace {
    splats: Splats,
    moments: Moments,
    /// Of one Gaussian of the lobes, where they are several.
    lobe: (Splats, Moments),
    tiles: Tiles,
    rows: RowScratch,
}

/// Where L_view is evaluated, and B_ori there.
pub(super) struct EmTarget {
    /// B_ori over the region's cells in C order.
    pub ori: Vec<bool>,
    /// The region as it is summed, marked by B_ori.
    pub cell_box: CellBox,
    /// What is measured there, where levels are compared; `None` where masks are.
    pub levels: Option<Levels>,
    /// Where cells are erased, what is left of them.
    pub left: Option<Left>,
}

/// What is left of a region where cells are erased.
pub(super) struct Left {
    /// Whether each cell of the region is, C order.
    pub cells: Vec<bool>,
    /// Places of those that are, in the order of the sum.
    pub places: Vec<usize>,
}

impl Workspace {
    /// Projects the joints of `params`, which have these Gaussians.
    pub(super) fn project(&mut self, model: &ViewModel<'_>, of: (&Pppr, &WorldGaussians), precision: Precision) {
        let Self { splats, lobe: (scratch, _), .. } = self;
        model.splats_of(&model.lobes(), of, precision, (splats, scratch));
    }

    /// Evaluates L_view at `target`, of whose view `model` is, for the joints last projected, and where a gradient is wanted
    /// what the cells say of them, times `factor`.
    pub(super) fn compare(
        &mut self,
        model: &ViewModel<'_>,
        target: &EmTarget,
        (factor, with_iou): (Option<f64>, bool),
        precision: Precision,
    ) -> ViewLoss {
        let Self { splats, moments, tiles, rows, .. } = self;
        moments.reset(splats.joints(), &model.view.axes);
        match precision {
            Precision::F64 => plain::<f64>(model, splats, target, factor, moments),
            Precision::F32 if tiles::holds(model.config.softness) => {
                let FitConfig { summation, tau_pct, softness, .. } = *model.config;
                let query = EmQuery {
                    splats,
                    grid: &target.cell_box.grid,
                    summation,
                    tau_pct,
                    softness,
                    gradient_factor: factor,
                    levels: target
                        .levels
                        .as_ref()
                        .map(|levels| LevelQuery { tiles: &levels.tiles, totals: &levels.totals }),
                    with_iou,
                };
                let levels = target.levels.as_ref();
                let Some((levels, of)) = levels.and_then(|levels| Some((levels, levels.rows.as_ref()?))) else {
                    return tiles.evaluate(&query, moments);
                };
                let (least, tau_pct) = if with_iou { (LEAST_SHOWN, Some(tau_pct)) } else { (LEAST_SEARCHED, None) };
                let asked = RowQuery { splats, rows: of, totals: &levels.totals, least, factor, tau_pct };
                let (answer, among) = rows.evaluate(&asked, moments);
                if among {
                    return answer;
                }
                // Rare: the body is above the noise in fewer cells than a mask has.
                let masks = EmQuery { levels: None, gradient_factor: None, ..query };
                ViewLoss { loss: answer.loss, iou: tiles.evaluate(&masks, moments).iou }
            }
            Precision::F32 => plain::<f32>(model, splats, target, factor, moments),
        }
    }

    /// Hands what the cells said to the joints' Gaussians and features.
    pub(super) fn pull_back(
        &mut self,
        model: &ViewModel<'_>,
        gaussians: &WorldGaussians,
        (gradient, bars): (&mut Pppr, &mut WorldGaussianBars),
        precision: Precision,
    ) {
        let (lobes, joints) = (model.lobes(), gaussians.joints());
        if lobes.is_empty() {
            return pull_back(model, gaussians, &self.moments, (gradient, bars), precision);
        }
        let Self { moments, lobe: (_, scratch), .. } = self;
        for (k, lobe) in lobes.iter().enumerate() {
            moments.part(k * joints, joints, scratch);
            pull_back(lobe, gaussians, scratch, (&mut *gradient, &mut *bars), precision);
        }
    }
}

/// Every cell by itself, as SPEC reads: the oracle, and the way out for masks softer than f32's range.
fn plain<T: Real>(
    model: &ViewModel<'_>,
    splats: &Splats,
    EmTarget { cell_box, levels, left, .. }: &EmTarget,
    scale: Option<f64>,
    moments: &mut Moments,
) -> ViewLoss {
    let mut kernel = Kernel::<T>::new(splats, &cell_box.bins, model.config.summation);
    let mut ln_s = vec![f64::NEG_INFINITY; cell_box.marked.len()];
    kernel.forward(&mut ln_s);
    let marked;
    let (ln_s, marked) = match left {
        None => (ln_s, cell_box.marked.as_slice()),
        Some(left) => {
            marked = left.of(&cell_box.marked);
            (left.of(&ln_s), marked.as_slice())
        }
    };
    let mask = SoftMask::new(&ln_s, marked, model.config.tau_pct, model.config.softness);
    let (loss, weight) = match levels {
        None => (mask.loss(), scale.map(|scale| mask.weight(&ln_s, marked, scale))),
        Some(levels) => {
            let power: Vec<f64> = ln_s.iter().map(|&x| floored(x).powi(2)).collect();
            levels.compare(&power, scale)
        }
    };
    if let Some(weight) = weight {
        let weight = match left {
            None => weight,
            Some(left) => left.back(&weight, cell_box.marked.len()),
        };
        kernel.backward(&weight, moments);
    }
    ViewLoss { loss, iou: mask.iou }
}

impl Left {
    /// The values of what is left, of those of all cells in the order of the sum.
    fn of<T: Copy>(&self, all: &[T]) -> Vec<T> {
        self.places.iter().filter_map(|&place| all.get(place).copied()).collect()
    }

    /// The values of all cells, 0 where they are erased.
    fn back(&self, values: &[f64], cells: usize) -> Vec<f64> {
        let mut all = vec![0.0; cells];
        for (&place, &value) in self.places.iter().zip(values) {
            all[place] = value;
        }
        all
    }
}

/// The soft mask of H_sim and what it has in common with the hard mask of H_ori.
struct SoftMask {
    ln_h: Vec<f64>,
    /// m
    soft: Vec<f64>,
    softness: f64,
    /// Σ m B
    common: f64,
    /// Σ (m + B − m B)
    union: f64,
    /// IoU of the hard masks.
    iou: Option<f64>,
}

impl SoftMask {
    fn new(ln_s: &[f64], target: &[bool], tau_pct: f64, softness: f64) -> Self {
        let ln_h: Vec<f64> = ln_s.iter().map(|&x| ln_floored(x)).collect();
        let h: Vec<f64> = ln_s.iter().map(|&x| floored(x)).collect();
        let threshold = percentile(&h, 100.0 - tau_pct);
        let iou = hard_iou(h.iter().zip(target).map(|(&h, &b)| (h > threshold, b)));
        let soft_threshold = ln_sum(threshold.ln(), SOFT_FLOOR.ln());
        let soften = |&h: &f64| sigmoid((ln_sum(h, SOFT_FLOOR.ln()) - soft_threshold) / softness);
        let soft: Vec<f64> = ln_h.iter().map(soften).collect();
        let (mut common, mut union) = (0.0, 0.0);
        for (&m, &b) in soft.iter().zip(target) {
            let b = f64::from(u8::from(b));
            common += m * b;
            union += m + b - m * b;
        }
        Self { ln_h, soft, softness, common, union, iou }
    }

    /// L_view; 1 where both masks are empty.
    fn loss(&self) -> f64 {
        if self.union == 0.0 { 1.0 } else { 1.0 - self.common / self.union }
    }

    /// ∂(scale · L)/∂ln|S| of every cell; the threshold is held constant.
    fn weight(&self, ln_s: &[f64], target: &[bool], scale: f64) -> Vec<f64> {
        if self.union == 0.0 {
            return vec![0.0; ln_s.len()];
        }
        let cells = self.soft.iter().zip(target).zip(ln_s.iter().zip(&self.ln_h));
        let weight = cells.map(|((&m, &b), (&ln_s, &ln_h))| {
            let loss_by_m = if b { -1.0 / self.union } else { self.common / (self.union * self.union) };
            // d ln(H + h)/d ln H and d ln H/d ln|S|
            let above_soft_floor = sigmoid(ln_h - SOFT_FLOOR.ln());
            let above_floor = sigmoid(2.0 * (ln_s - EPSILON.ln()));
            scale * loss_by_m * m * (1.0 - m) / self.softness * above_soft_floor * above_floor
        });
        weight.collect()
    }
}

/// ln(eᵃ + eᵇ)
fn ln_sum(a: f64, b: f64) -> f64 {
    let (high, low) = if a >= b { (a, b) } else { (b, a) };
    high + (low - high).exp().ln_1p()
}

fn sigmoid(x: f64) -> f64 {
    if x >= 0.0 { 1.0 / (1.0 + (-x).exp()) } else { x.exp() / (1.0 + x.exp()) }
}
