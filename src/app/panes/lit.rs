//! Who lit what, for every pane: the returns of the joints of the fit on screen, made once for each of its states, and the maps of
//! single joints: both beside the window's thread.

use crate::app::map_image::Orientation;
use crate::mhp::{JointReturns, KeptJoints};
use crate::radar::View;
use crate::session::{Isolate, Session, ThirdAxis};
use crate::worker::Snapshot;
use egui::{Context, Id};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Maps that are kept of a state: a person's joints, on every view.
const MOST_MAPS: usize = 96;

/// A map of some of the joints, of a view; `None` while it is being made.
type Made = BTreeMap<(usize, u8, usize), Option<Arc<Vec<f64>>>>;

/// The returns of one state of the fit.
pub(super) struct Lit {
    of: Arc<Snapshot>,
    pub(super) returns: JointReturns,
    maps: Mutex<Made>,
}

/// What is known of the returns of the fit on screen: those of a state, and whether those of another are being made.
#[derive(Clone, Default)]
struct Known {
    lit: Option<Arc<Lit>>,
    working: bool,
}

/// The returns of the fit on screen, those of a state before as long as its own are being made, which wakes the window; `None` where
/// there is none.
pub(super) fn lit(ctx: &Context, session: &Session) -> Option<Arc<Lit>> {
    let (problem, shown) = (session.fit.problem.as_ref()?, session.fit.shown.as_ref()?);
    let id = Id::unique("lit");
    let known: Known = ctx.data(|data| data.get_temp(id)).unwrap_or_default();
    let lit = known.lit.filter(|lit| lit.of.job == shown.job);
    // One at a time; the newest state then is asked for when it has answered.
    if !known.working && lit.as_ref().is_none_or(|lit| !Arc::ptr_eq(&lit.of, shown)) {
        problem.check(&shown.params).ok()?;
        ctx.data_mut(|data| data.insert_temp(id, Known { lit: lit.clone(), working: true }));
        let (problem, of, ctx) = (Arc::clone(problem), Arc::clone(shown), ctx.clone());
        rayon::spawn(move || {
            let made = crate::task::catch_panic(|| JointReturns::new(&problem, &of.config, &of.params));
            let lit = made.ok().map(|returns| Arc::new(Lit { of, returns, maps: Mutex::default() }));
            ctx.data_mut(|data| {
                let known = data.get_temp_mut_or_default::<Known>(id);
                known.working = false;
                known.lit = lit.or_else(|| known.lit.take());
            });
            ctx.request_repaint();
        });
    }
    lit
}

impl Lit {
    /// The map of some of the returns in a view; `None` until it is there, which wakes the window.
    pub(super) fn map(self: &Arc<Self>, ctx: &Context, view: usize, kept: KeptJoints) -> Option<Arc<Vec<f64>>> {
        let key = match kept {
            KeptJoints::All => (view, 0, 0),
            KeptJoints::Only(joint) => (view, 1, joint),
            KeptJoints::Without(joint) => (view, 2, joint),
        };
        let mut maps = self.maps.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = maps.get(&key) {
            return made.clone();
        }
        if maps.len() >= MOST_MAPS {
            maps.retain(|_, made| made.is_none());
        }
        maps.insert(key, None);
        let (of, ctx) = (Arc::clone(self), ctx.clone());
        rayon::spawn(move || {
            let map = Arc::new(of.returns.whole(view, kept));
            of.maps.lock().unwrap_or_else(PoisonError::into_inner).insert(key, Some(map));
            ctx.request_repaint();
        });
        None
    }
}

/// What a joint is called, with its person where there are several.
pub(super) fn joint_name(session: &Session, joint: usize) -> String {
    let Some(problem) = &session.fit.problem else { return String::new() };
    let joints = problem.skeleton.joints.len().max(1);
    let name = problem.skeleton.shown_name(joint % joints);
    if session.shown_positions().len() > joints { format!("P{} {name}", joint / joints + 1) } else { name }
}

/// What H_sim is made of instead of all joints, where that was chosen and a joint is selected.
pub(super) fn isolated(session: &Session) -> Option<KeptJoints> {
    let joint = session.joint.filter(|joint| *joint < session.shown_positions().len())?;
    match session.view.isolate {
        Isolate::All => None,
        Isolate::Without => Some(KeptJoints::Without(joint)),
        Isolate::Only => Some(KeptJoints::Only(joint)),
    }
}

/// The flat index of the cell at a pixel of a view's picture; of an axis that is not drawn the shown bin, or the one where `map` is
/// largest.
pub(super) fn cell_at(view: &View, o: Orientation, pixel: [usize; 2], map: Option<&[f64]>) -> Option<usize> {
    let shape = view.shape();
    let [across, up] = o.bins_of_pixel(view, pixel);
    let flat = |third: usize| {
        let bin = |axis: usize| match axis {
            axis if axis == o.horizontal => across.round().max(0.0) as usize,
            axis if axis == o.vertical => up.round().max(0.0) as usize,
            _ => third,
        };
        (0..shape.len()).try_fold(0, |flat, axis| (bin(axis) < shape[axis]).then(|| flat * shape[axis] + bin(axis)))
    };
    match (o.collapsed, o.third) {
        (None, _) => flat(0),
        (Some(_), ThirdAxis::Bin(bin)) => flat(bin),
        (Some(axis), _) => {
            let value = |bin: &usize| flat(*bin).and_then(|cell| map?.get(cell).copied()).unwrap_or(0.0);
            (0..shape[axis]).max_by(|a, b| value(a).total_cmp(&value(b))).and_then(flat)
        }
    }
}

/// Pieces of the line at which a picture of `size` (columns, rows) is `level`, between the middles of its cells; picture coordinates
/// 0..1. Written here, not by a crate: those that there are close the lines along the border, which no echo does.
pub(super) fn contour([columns, rows]: [usize; 2], values: &[f64], level: f64) -> Vec<[[f64; 2]; 2]> {
    let at = |x: usize, y: usize| values.get(y * columns + x).copied().filter(|v| v.is_finite()).unwrap_or(0.0);
    let mut pieces = Vec::new();
    for y in 0..rows.saturating_sub(1) {
        for x in 0..columns.saturating_sub(1) {
            let corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
            let heights = corners.map(|(x, y)| at(x, y));
            if heights.iter().all(|h| *h < level) || heights.iter().all(|h| *h >= level) {
                continue;
            }
            let mut cuts: Vec<[f64; 2]> = Vec::with_capacity(4);
            for k in 0..4 {
                let (a, b) = (heights[k], heights[(k + 1) % 4]);
                if (a < level) != (b < level) {
                    let t = (level - a) / (b - a);
                    let (p, q) = (corners[k], corners[(k + 1) % 4]);
                    let between =
                        |p: usize, q: usize, n: usize| (p as f64 + t * (q as f64 - p as f64) + 0.5) / n as f64;
                    cuts.push([between(p.0, q.0, columns), between(p.1, q.1, rows)]);
                }
            }
            pieces.extend(cuts.chunks_exact(2).map(|two| [two[0], two[1]]));
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hill_has_a_round_line_about_it() {
        let (columns, rows) = (40, 30);
        let height = |x: usize, y: usize| {
            let (dx, dy) = (x as f64 - 20.0, y as f64 - 14.0);
            (-(dx * dx + dy * dy) / 50.0).exp()
        };
        let values: Vec<f64> = (0..rows).flat_map(|y| (0..columns).map(move |x| height(x, y))).collect();
        let pieces = contour([columns, rows], &values, 0.5);
        assert!(pieces.len() > 30);
        for [x, y] in pieces.into_iter().flatten() {
            let (dx, dy) = (x * columns as f64 - 20.5, y * rows as f64 - 14.5);
            assert!(((dx * dx + dy * dy).sqrt() - (50.0 * 2f64.ln()).sqrt()).abs() < 0.1, "{x} {y}");
        }
    }
}
