//! Which τ? The IoU of a state at every τ, without a refit, and the points that are kept of the maps at one.

use super::{ExploredState, Halt, IdleCores};
use crate::mhp::{Masks, erased_marks, percentile};
use crate::representation::{CloudPoint, detected_cells, point_cloud};
use crate::task::Progress;

/// The least and the greatest τ, and the step between two, %.
const TAU: [f64; 3] = [0.5, 60.0, 0.5];

/// The agreement of the masks at every τ.
#[derive(Debug, Clone, PartialEq)]
pub struct TauRibbon {
    /// %, ascending.
    pub taus: Vec<f64>,
    /// Of each view, IoU at each τ.
    pub views: Vec<Vec<Option<f64>>>,
    /// Mean over the views at each τ.
    pub iou: Vec<Option<f64>>,
}

/// The IoU of H_sim's mask and H_ori's over the EM region at every τ from 0.5 to 60 %: what `Masks::iou` is at each.
/// `maps` has H_ori and H_sim of each view, `masks` says which cells are inside.
pub fn tau_ribbon(maps: &[(&[f64], &[f64])], masks: &[Masks]) -> TauRibbon {
    let [least, most, step] = TAU;
    let taus: Vec<f64> = (0..=((most - least) / step) as usize).map(|k| least + step * k as f64).collect();
    let of_view = |((ori, sim), masks): (&(&[f64], &[f64]), &Masks)| -> Vec<Option<f64>> {
        let inside = |map: &[f64]| -> Vec<f64> {
            map.iter().zip(&masks.inside).filter(|(_, inside)| **inside).map(|(x, _)| *x).collect()
        };
        ious(&inside(ori), &inside(sim), &taus)
    };
    let views: Vec<Vec<Option<f64>>> = maps.iter().zip(masks).map(of_view).collect();
    let mean = |k: usize| {
        let known: Vec<f64> = views.iter().filter_map(|view| view[k]).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    };
    let iou = (0..taus.len()).map(mean).collect();
    TauRibbon { taus, views, iou }
}

/// IoU of the cells above P_{100−τ} of both, at each τ. Cells are taken in by the rank of the lower of their two, so that all of it
/// costs two sorts.
fn ious(ori: &[f64], sim: &[f64], taus: &[f64]) -> Vec<Option<f64>> {
    let sorted = |of: &[f64]| {
        let mut of = of.to_vec();
        of.sort_unstable_by(f64::total_cmp);
        of
    };
    let [ordered_ori, ordered_sim] = [sorted(ori), sorted(sim)];
    let one = |&tau: &f64| {
        let [a, b] = [&ordered_ori, &ordered_sim].map(|of| threshold(of, tau));
        let (mut both, mut either) = (0_usize, 0_usize);
        for (o, s) in ori.iter().zip(sim) {
            let (o, s) = (*o > a, *s > b);
            both += usize::from(o && s);
            either += usize::from(o || s);
        }
        (either > 0).then(|| both as f64 / either as f64)
    };
    taus.iter().map(one).collect()
}

/// P_{100−τ} of sorted values: of two neighbours alone it is what it is of all.
fn threshold(sorted: &[f64], tau: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = last as f64 * ((100.0 - tau) / 100.0);
    let lower = (at.floor() as usize).min(last);
    let upper = (lower + 1).min(last);
    let (a, b, t) = (sorted[lower], sorted[upper], at - lower as f64);
    if a == b || t == 0.0 { a } else { percentile(&[a, b], 100.0 * t) }
}

impl TauRibbon {
    /// τ and mean IoU where that is largest.
    pub fn best(&self) -> Option<(f64, f64)> {
        self.largest(|_, iou| iou)
    }

    /// τ and mean IoU where that is farthest above what two masks of the size have in common by chance, as a share of what is
    /// left: (IoU − c)/(1 − c), c = τ/(200 − τ). Large masks agree whatever they show; this is where agreement says most.
    pub fn most_telling(&self) -> Option<(f64, f64)> {
        self.largest(|tau, iou| {
            let chance = tau / (200.0 - tau);
            (iou - chance) / (1.0 - chance)
        })
    }

    fn largest(&self, worth: impl Fn(f64, f64) -> f64) -> Option<(f64, f64)> {
        let known = self.taus.iter().zip(&self.iou).filter_map(|(tau, iou)| Some((*tau, (*iou)?)));
        // Of equals the smallest τ.
        known.fold(None, |best: Option<(f64, f64)>, (tau, iou)| match best {
            Some((t, i)) if worth(t, i) >= worth(tau, iou) => best,
            _ => Some((tau, iou)),
        })
    }

    /// Mean IoU at the τ of the ribbon that is nearest.
    pub fn at(&self, tau: f64) -> Option<f64> {
        let nearest =
            (0..self.taus.len()).min_by(|&a, &b| (self.taus[a] - tau).abs().total_cmp(&(self.taus[b] - tau).abs()))?;
        self.iou[nearest]
    }
}

/// The points that are kept of a frame (paper, figure 6).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TauClouds {
    /// Of H_ori, by constant false alarm rate.
    pub cfar: Vec<CloudPoint>,
    /// Of H_ori, the largest τ % of the EM region.
    pub threshold: Vec<CloudPoint>,
    /// Of H_sim, by the same detector: PPPR-PC.
    pub pppr: Vec<CloudPoint>,
}

/// Points that are placed of each view at most, the strongest first.
const MOST_POINTS: usize = 400;

/// The points that CFAR and a threshold at τ keep of H_ori, and those of H_sim. What a map leaves open of a place is that of the
/// joints that make the cell ([`point_cloud`]). No point of H_ori is where cells are erased.
///
/// # Errors
/// Where it was cancelled.
pub fn tau_clouds(
    state: &ExploredState,
    (h_sim, masks): (&[Vec<f64>], &[Masks]),
    (cores, progress): (&IdleCores, &Progress),
) -> Result<TauClouds, Halt> {
    let ExploredState { problem, config, params, .. } = state;
    let ori: Vec<Vec<f64>> = (0..problem.views.len()).map(|view| problem.map(view).to_vec()).collect();
    let above = |(map, masks): (&Vec<f64>, &Masks)| -> Vec<usize> {
        let inside: Vec<f64> = map.iter().zip(&masks.inside).filter(|(_, inside)| **inside).map(|(x, _)| *x).collect();
        let threshold = percentile(&inside, 100.0 - config.tau_pct);
        let mut cells: Vec<usize> =
            (0..map.len()).filter(|&cell| masks.inside.get(cell) == Some(&true) && map[cell] > threshold).collect();
        cells.sort_by(|a, b| map[*b].total_cmp(&map[*a]));
        cells.truncate(MOST_POINTS);
        cells
    };
    let thresholded: Vec<Vec<usize>> = ori.iter().zip(masks).map(above).collect();
    let mut detected = detected_cells(problem, &ori, MOST_POINTS);
    if !state.erased.is_empty() {
        for (cells, marks) in detected.iter_mut().zip(erased_marks(&problem.views, &state.erased)) {
            cells.retain(|&cell| marks.get(cell) != Some(&true));
        }
    }
    let cloud = |maps: &[Vec<f64>], cells: &[Vec<usize>]| -> Result<Vec<CloudPoint>, Halt> {
        cores.make_way(0, progress)?;
        Ok(point_cloud(problem, config, params, maps, cells))
    };
    Ok(TauClouds {
        cfar: cloud(&ori, &detected)?,
        threshold: cloud(&ori, &thresholded)?,
        pppr: cloud(h_sim, &detected_cells(problem, h_sim, MOST_POINTS))?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At every τ the ribbon is the IoU of the masks as `Masks` has it.
    #[test]
    fn the_ribbon_is_the_iou_at_every_tau() {
        let value = |k: u32, of: u32| f64::from((k.wrapping_mul(2_654_435_761) >> 7) % of) / 7.0;
        let ori: Vec<f64> = (0..500).map(|k| value(k, 83)).collect();
        let sim: Vec<f64> = (0..500).map(|k| value(k, 83) + value(k + 9000, 41)).collect();
        let inside: Vec<bool> = (0..500).map(|k| k % 3 != 0).collect();
        let masks = Masks { ori: Vec::new(), sim: Vec::new(), inside: inside.clone() };
        let ribbon = tau_ribbon(&[(&ori, &sim)], &[masks]);
        assert_eq!((ribbon.taus[0], ribbon.taus[119], ribbon.taus.len()), (0.5, 60.0, 120));
        let within =
            |map: &[f64]| -> Vec<f64> { map.iter().zip(&inside).filter(|(_, i)| **i).map(|(x, _)| *x).collect() };
        for (tau, iou) in ribbon.taus.iter().zip(&ribbon.iou) {
            let mask = |map: &[f64]| -> Vec<bool> {
                let p = percentile(&within(map), 100.0 - tau);
                map.iter().zip(&inside).map(|(x, inside)| *inside && *x > p).collect()
            };
            let masks = Masks { ori: mask(&ori), sim: mask(&sim), inside: inside.clone() };
            assert_eq!(*iou, masks.iou(), "τ {tau}");
        }
        let (tau, best) = ribbon.best().unwrap_or_default();
        assert!(ribbon.iou.iter().flatten().all(|iou| *iou <= best) && ribbon.at(tau) == Some(best));
        assert!(ribbon.most_telling().is_some_and(|(t, _)| t <= tau));
    }
}
