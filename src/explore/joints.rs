//! What each joint is worth to the agreement of the maps: the drop of IoU where it sends nothing back.

use super::cores::{Hand, IdleCores, each};
use super::{ExploredState, Halt};
use crate::mhp::{JointReturns, KeptJoints, masks};
use crate::task::Progress;

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

/// Leaves every joint out of H_sim in turn; the EM region is that of the fit. Nothing is fitted anew.
///
/// # Errors
/// As [`Objective::new`](crate::mhp::Objective::new), or where it was cancelled.
pub fn leave_one_out(state: &ExploredState, (cores, progress): (&IdleCores, &Progress)) -> Result<LeaveOneOut, Halt> {
    let seen = state.seen()?;
    let objective = state.objective(&seen)?;
    let returns = JointReturns::new(&seen, &state.config, &state.params);
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
        let known: Vec<f64> = seen.views.iter().enumerate().filter_map(of_view).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    };
    progress.begin("leaving joints out", returns.joints() as u64);
    let all = iou(KeptJoints::All);
    let mut joints = Vec::with_capacity(returns.joints());
    let leave_out = |(): &mut (), joint: usize, _: &Hand<'_>| -> Result<LeftOut, Halt> {
        let without = iou(KeptJoints::Without(joint));
        progress.advance(1);
        Ok(LeftOut { joint, iou: without, drop: all.unwrap_or(0.0) - without.unwrap_or(0.0) })
    };
    each((cores, progress), returns.joints(), || (), leave_out, |_, left_out| joints.push(left_out))?;
    joints.sort_by(|a, b| b.drop.total_cmp(&a.drop).then(a.joint.cmp(&b.joint)));
    Ok(LeaveOneOut { iou: all, joints })
}
