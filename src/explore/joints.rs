//! What each joint is worth to the agreement of the maps: the drop of IoU where it sends nothing back.

use crate::body::Pppr;
use crate::config::FitConfig;
use crate::mhp::{FitError, JointReturns, KeptJoints, Objective, Precision, Problem, masks};
use crate::task::{Cancelled, Progress};
use std::sync::Arc;

/// A joint that is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Flat index.
    pub joint: usize,
    /// Mean IoU of the views without it.
    pub iou: Option<f64>,
    /// How much less that is; negative where the maps agree better without it.
    pub drop: f64,
}

/// Every joint left out in turn.
#[derive(Debug, Clone, PartialEq)]
pub struct LeaveOneOut {
    /// Mean IoU of the views with all of them.
    pub iou: Option<f64>,
    /// Those that are missed most first.
    pub joints: Vec<LeftOut>,
}

/// Leaves every joint out of H_sim in turn; the EM region is that around `initial`. Nothing is fitted anew.
///
/// # Errors
/// As [`Objective::new`]; `Ok(None)` where it was cancelled.
pub fn leave_one_out(
    problem: &Arc<Problem>,
    config: &FitConfig,
    (initial, params): (&Pppr, &Pppr),
    progress: &Progress,
) -> Result<Option<LeaveOneOut>, FitError> {
    let objective = Objective::new(Arc::clone(problem), *config, Precision::F64, initial)?;
    let returns = JointReturns::new(problem, config, params);
    let iou = |kept: KeptJoints| {
        let of_view = |(view, of): (usize, &crate::radar::View)| {
            let region = &objective.regions()[view];
            let cells = returns.map(view, &region.bins, kept);
            let mut whole = vec![0.0; of.cells()];
            for (cell, value) in region.indices(&of.shape()).into_iter().zip(cells) {
                whole[cell] = value;
            }
            masks(&objective, view, &whole).iou()
        };
        let known: Vec<f64> = problem.views.iter().enumerate().filter_map(of_view).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    };
    progress.begin("leaving joints out", returns.joints() as u64);
    let all = iou(KeptJoints::All);
    let mut joints = Vec::with_capacity(returns.joints());
    for joint in 0..returns.joints() {
        if let Err(Cancelled) = progress.check() {
            return Ok(None);
        }
        let without = iou(KeptJoints::Without(joint));
        let drop = all.unwrap_or(0.0) - without.unwrap_or(0.0);
        joints.push(LeftOut { joint, iou: without, drop });
        progress.advance(1);
    }
    joints.sort_by(|a, b| b.drop.total_cmp(&a.drop).then(a.joint.cmp(&b.joint)));
    Ok(Some(LeaveOneOut { iou: all, joints }))
}
