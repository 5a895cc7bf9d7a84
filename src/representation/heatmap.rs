//! PPPR-Heatmap: H_sim of a fit in the scale of the maps that it was fitted to.

use crate::body::Pppr;
use crate::config::FitConfig;
use crate::mhp::{FitError, Objective, Precision, Problem, masks, simulate};
use std::sync::Arc;

/// What becomes of the values of H_sim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeatmapScale {
    /// One factor a view: the mean of H_ori over its mask by that of H_sim over its own; then nothing below the smallest
    /// value of H_ori, so that a logarithm of the map stays in the input's range.
    Match,
    /// As computed.
    None,
}

/// H_sim of every view at `params`, C order, in the scale asked for.
///
/// # Errors
/// Where `params` have the wrong sizes or are not finite.
pub fn pppr_heatmap(
    problem: &Arc<Problem>,
    config: &FitConfig,
    precision: Precision,
    params: &Pppr,
    scale: HeatmapScale,
) -> Result<Vec<Vec<f64>>, FitError> {
    let mut maps = simulate(problem, config, precision, params);
    if scale == HeatmapScale::None {
        return Ok(maps);
    }
    let objective = Objective::new(Arc::clone(problem), *config, precision, params)?;
    for (view, map) in maps.iter_mut().enumerate() {
        let masks = masks(&objective, view, map);
        let input = problem.map(view);
        let factor = masked_mean(input, &masks.ori) / masked_mean(map, &masks.sim);
        let factor = if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        let least = input.iter().copied().fold(f64::INFINITY, f64::min);
        for cell in map.iter_mut() {
            *cell = (*cell * factor).max(least);
        }
    }
    Ok(maps)
}

fn masked_mean(map: &[f64], mask: &[bool]) -> f64 {
    let (sum, count) =
        map.iter().zip(mask).filter(|(_, inside)| **inside).fold((0.0, 0_usize), |(s, n), (x, _)| (s + x, n + 1));
    sum / count as f64
}
