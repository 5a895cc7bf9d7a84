//! F4, low-motion ambiguity: whether motion tells the person from the room.
//!
//! **Where a view has a Doppler axis**, the joints' radial velocities are compared with a Doppler cell: the larger of a
//! bin's step and the half-value width of the point spread. With u = √(mean of v_r²) / cell,
//!
//! ```text
//! score = 1/(1 + u²),   ½ where the joints move by one cell
//! ```
//!
//! **Elsewhere** the map must have changed since the frame before. With c the mean of |H − H'| over the cells inside the EM
//! region, and c₀ its median over the cells outside, which is what noise and the room do by themselves (the median, so that
//! somebody else who walks there does not count as noise),
//!
//! ```text
//! score = 1/(1 + x²),  x = max(0, c/c₀ − 1),   1 where the region changes no more than the rest, ½ at twice as much
//! ```
//!
//! Sums of relative changes would not do: where there is no echo all is noise, and noise changes by a third of itself.
//!
//! One view that shows motion is enough to tell a person: the lowest score of the views counts.

use super::cells::{largest_patch, place};
use super::resolution::{FWHM, radial_mps};
use super::words::{cell_box, joint, percent};
use super::{Evidence, EvidenceInput, Finding, Past, Place, falling, masks_of, mean};
use crate::labels::Tag;
use crate::mhp::percentile;
use crate::radar::{AxisKind, View};

/// Cells that changed by more than this share of the largest change are shown as the place of the change.
const SHOWN_SHARE: f64 = 0.5;

pub(super) fn judge(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Evidence {
    let measured: Vec<Measured> = input.problem.views.iter().filter_map(|view| by_doppler(input, view)).collect();
    let change = by_change(input, past);
    if let Some(clearest) = measured.iter().max_by(|a, b| a.cells.total_cmp(&b.cells)) {
        let (rms_mps, cells) = (clearest.rms_mps, clearest.cells);
        let summary =
            format!("The joints' radial velocity is {rms_mps:.2} m/s (root mean square), {cells:.1} Doppler cells.");
        let score = Some(falling(cells));
        let findings =
            measured.into_iter().map(|found| found.finding).chain(change.into_iter().flat_map(|c| c.findings));
        return Evidence { mode: Tag::F4, score, summary, findings: findings.collect() };
    }
    let velocity = fitted_velocity(input);
    let Some(change) = change else {
        let summary = "It needs a Doppler axis or the frame before this one in the sequence.".to_owned();
        return Evidence { mode: Tag::F4, score: None, summary, findings: velocity.into_iter().collect() };
    };
    let summary = match change.ratio {
        Some(ratio) => {
            format!("Since the frame before, the EM region changed {} in the view that shows it best.", times(ratio))
        }
        None => "The EM region is the whole map: there is no rest to compare its change with.".to_owned(),
    };
    let score = change.ratio.map(|ratio| falling((ratio - 1.0).max(0.0)));
    let findings = change.findings.into_iter().chain(velocity).collect();
    Evidence { mode: Tag::F4, score, summary, findings }
}

/// What a view with a Doppler axis says.
struct Measured {
    /// √(mean of v_r²), m/s.
    rms_mps: f64,
    /// The same in Doppler cells: u.
    cells: f64,
    finding: Finding,
}

/// `None` without a Doppler axis.
fn by_doppler(input: &EvidenceInput<'_>, view: &View) -> Option<Measured> {
    let axis = view.axes.iter().find(|axis| axis.kind == AxisKind::Doppler)?;
    let cell_mps = axis.step().abs().max(FWHM * view.psf.doppler_mps);
    let (rms_mps, fastest, fastest_mps) = radial(input, view)?;
    let cells = rms_mps / cell_mps;
    let text = format!(
        "{}: the joints move at {rms_mps:.2} m/s radially (root mean square), {} fastest at {:.2} m/s; a Doppler cell is \
         {cell_mps:.2} m/s.",
        view.array,
        joint(input.problem, input.params, fastest),
        fastest_mps.abs()
    );
    cells.is_finite().then(|| Measured { rms_mps, cells, finding: Finding::new(text, Some(Place::Joint(fastest))) })
}

/// Root mean square of v_r, the fastest joint and its v_r, m/s.
fn radial(input: &EvidenceInput<'_>, view: &View) -> Option<(f64, usize, f64)> {
    let joints = input.params.shape().total_joints();
    let speeds: Vec<f64> = (0..joints).map(|joint| radial_mps(view, input.params, joint)).collect();
    let rms = (speeds.iter().map(|v| v * v).sum::<f64>() / joints.max(1) as f64).sqrt();
    let fastest = speeds.iter().copied().enumerate().rev().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    rms.is_finite().then_some((rms, fastest.0, fastest.1))
}

/// What the fit says of velocity where no axis measures it.
fn fitted_velocity(input: &EvidenceInput<'_>) -> Option<Finding> {
    let (_, fastest, mps) = radial(input, input.problem.views.first()?)?;
    let radar = &input.problem.radar;
    let cell_mps = radar.wavelength_m() / (2.0 * radar.frame_s);
    let text = format!(
        "No axis of these maps measures velocity. The fit's own says at most {:.2} m/s radially ({}), where the chirps of a \
         frame resolve λ/(2 T_frame) = {cell_mps:.2} m/s.",
        mps.abs(),
        joint(input.problem, input.params, fastest)
    );
    cell_mps.is_finite().then(|| Finding::new(text, Some(Place::Joint(fastest))))
}

/// The change since the frame before.
struct Change {
    /// The highest c/c₀ of the views; `None` where no view has cells inside and outside the EM region.
    ratio: Option<f64>,
    findings: Vec<Finding>,
}

/// `None` without a frame before.
fn by_change(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Option<Change> {
    let before = past.last()?;
    let mut change = Change { ratio: None, findings: Vec::new() };
    for (index, view) in input.problem.views.iter().enumerate() {
        let found = masks_of(input, index).zip(before.maps.get(index)).and_then(|(masks, old)| {
            view_change(index, view, input.problem.map(index), old, &masks.inside, before.index)
        });
        let Some((ratio, told)) = found else {
            let text = format!("{}: the EM region is the whole map; there is no rest to compare with.", view.array);
            change.findings.push(Finding::new(text, None));
            continue;
        };
        change.findings.extend(told);
        change.ratio = Some(change.ratio.map_or(ratio, |highest: f64| highest.max(ratio)));
    }
    Some(change)
}

/// c/c₀ of one view (infinite where the rest did not change at all and the region did), and what to say of it.
fn view_change(
    index: usize,
    view: &View,
    new: &[f64],
    old: &[f64],
    inside: &[bool],
    before: usize,
) -> Option<(f64, Vec<Finding>)> {
    let changes: Vec<f64> = new.iter().zip(old).map(|(new, old)| halved_difference(*new, *old)).collect();
    let side = |wanted: bool| {
        let cells = changes.iter().zip(inside).filter(|(_, inside)| **inside == wanted);
        cells.map(|(change, _)| *change).collect::<Vec<f64>>()
    };
    let (within, around) = (side(true), side(false));
    if around.is_empty() {
        return None;
    }
    let (change, floor) = (mean(within)?, percentile(&around, 50.0));
    let sums = new.iter().zip(old).map(|(new, old)| new.abs() / 2.0 + old.abs() / 2.0);
    let level = mean(sums.zip(inside).filter(|(_, inside)| **inside).map(|(sum, _)| sum))?;
    let ratio = if change == 0.0 { 0.0 } else { change / floor };
    let text = format!(
        "{}: since the frame before, the EM region changed by {} (Σ|H − H'|/Σ(H + H')), {}.",
        view.array,
        percent(if level > 0.0 { change / level } else { 0.0 }),
        times(ratio)
    );
    let mut findings = vec![Finding::new(text, Some(Place::Frame(before)))];
    findings.extend(where_it_changed(index, view, &changes, inside));
    (!ratio.is_nan()).then_some((ratio, findings))
}

/// ½|a − b|: half, because the difference of two huge numbers may overflow.
fn halved_difference(a: f64, b: f64) -> f64 {
    (a / 2.0 - b / 2.0).abs()
}

/// The largest patch of cells that changed by at least half of the largest change.
fn where_it_changed(index: usize, view: &View, changes: &[f64], inside: &[bool]) -> Option<Finding> {
    let changes: Vec<f64> = changes.iter().zip(inside).map(|(&c, &inside)| if inside { c } else { 0.0 }).collect();
    let largest = changes.iter().copied().fold(0.0, f64::max);
    let strong: Vec<bool> = changes.iter().map(|&c| c > 0.0 && c >= SHOWN_SHARE * largest).collect();
    let place = place(index, &view.shape(), &largest_patch(&view.shape(), &strong))?;
    let Place::Cells { lo, hi, .. } = &place else { return None };
    let text = format!("{}: it changed most at {}.", view.array, cell_box(view, lo, hi));
    Some(Finding::new(text, Some(place)))
}

fn times(ratio: f64) -> String {
    if ratio.is_finite() {
        format!("{ratio:.1} times as much a cell as the rest of the map")
    } else {
        "while the rest of the map did not".to_owned()
    }
}
