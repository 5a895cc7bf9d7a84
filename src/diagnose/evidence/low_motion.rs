//! F4, low-motion ambiguity: whether motion tells the person from the room.
//!
//! **Where a view has a Doppler axis**, the joints' radial velocities are compared with a Doppler cell: the larger of a
//! bin's step and the half-value width of the point spread. With u = √(mean of v_r²) / cell,
//!
//! ```text
//! raw = 1/(1 + u²),   ½ where the joints move by one cell
//! slowness = −ln u
//! ```
//!
//! **Elsewhere** the map must have changed since the frame before. With c the mean of |H − H'| over the cells inside the EM
//! region, and c₀ its median over the cells outside, which is what noise and the room do by themselves (the median, so that
//! somebody else who walks there does not count as noise),
//!
//! ```text
//! raw = 1/(1 + x²),  x = max(0, c/c₀ − 1),   1 where the region changes no more than the rest, ½ at twice as much
//! ```
//!
//! Sums of relative changes would not do: where there is no echo all is noise, and noise changes by a third of itself.
//!
//! One view that shows motion is enough to tell a person: the lowest value of the views counts.
//!
//! Neither tells a person who stands from one who moves as well as what the maps do over half a second. With s the standard
//! deviation of a cell over the T frames and h̄ its mean,
//!
//! ```text
//! quiet      = mean over views of ln(max s outside the EM region / max s inside)     what moves is somewhere else
//! steadiness = − mean over views of Σ s/Σ h̄ within one resolution cell of a joint   the body's own echo stays
//! ```
//!
//! The score rests on these; with fewer earlier frames on the same over this frame and the one before (`quiet_pair`,
//! `steadiness_pair`); in a single frame with a Doppler axis on the slowness.

use super::cells::{largest_patch, place};
use super::number_text::{cell_box, joint, percent};
use super::resolution::{FWHM, JointCells, radial_mps};
use super::{EvidenceInput, Finding, FindingPlace, Found, Measure, Past, STATIC_FRAMES, falling, masks_of, mean};
use crate::labels::Tag;
use crate::mhp::percentile;
use crate::radar::{AxisKind, View};

/// Cells that changed by more than this share of the largest change are shown as the place of the change.
const SHOWN_SHARE: f64 = 0.5;

pub(super) fn judge(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Found {
    let seen: Vec<Measured> = input.problem.views.iter().filter_map(|view| by_doppler(input, view)).collect();
    let change = by_change(input, past);
    let mut measures = measures(input, past);
    if let Some(clearest) = seen.iter().max_by(|a, b| a.cells.total_cmp(&b.cells)) {
        let (rms_mps, cells) = (clearest.rms_mps, clearest.cells);
        let summary =
            format!("The joints' radial velocity is {rms_mps:.2} m/s (root mean square), {cells:.1} Doppler cells.");
        measures.push(Measure { name: "slowness".into(), value: -cells.max(f64::MIN_POSITIVE).ln() });
        let findings = seen.into_iter().map(|found| found.finding).chain(change.into_iter().flat_map(|c| c.findings));
        let findings = findings.chain(variation_told(&measures)).collect();
        return Found { mode: Tag::F4, raw: Some(falling(cells)), measures, summary, findings };
    }
    let velocity = fitted_velocity(input);
    let Some(change) = change else {
        let unknown = Found::unknown(Tag::F4, "It needs a Doppler axis or the frame before this one in the sequence.");
        return Found { findings: velocity.into_iter().collect(), ..unknown };
    };
    let summary = match change.ratio {
        Some(ratio) => {
            format!("Since the frame before, the EM region changed {} in the view that shows it best.", times(ratio))
        }
        None => "The EM region is the whole map: there is no rest to compare its change with.".to_owned(),
    };
    let raw = change.ratio.map(|ratio| falling((ratio - 1.0).max(0.0)));
    let findings = change.findings.into_iter().chain(variation_told(&measures)).chain(velocity).collect();
    Found { mode: Tag::F4, raw, measures, summary, findings }
}

/// Quiet and steadiness over the T frames where there are as many, and over this frame and the one before.
fn measures(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Vec<Measure> {
    let newest = past.len().saturating_sub(1);
    let all = (past.len() + 1 >= STATIC_FRAMES).then_some((past, ["quiet", "steadiness"]));
    let pair = past.get(newest..).filter(|pair| !pair.is_empty()).map(|pair| (pair, ["quiet_pair", "steadiness_pair"]));
    let of = |(frames, names): (&[Past<'_>], [&'static str; 2])| {
        let views: Vec<[f64; 2]> =
            (0..input.problem.views.len()).filter_map(|view| variation(input, frames, view)).collect();
        let value = |k: usize| mean(views.iter().map(|view| view[k]));
        names
            .into_iter()
            .enumerate()
            .filter_map(|(k, name)| Some(Measure { name: name.into(), value: value(k)? }))
            .collect::<Vec<_>>()
    };
    all.into_iter().chain(pair).flat_map(of).collect()
}

/// Quiet and steadiness of one view; `None` where nothing changes, or nothing lies within the region or outside.
fn variation(input: &EvidenceInput<'_>, past: &[Past<'_>], index: usize) -> Option<[f64; 2]> {
    let masks = masks_of(input, index)?;
    let joints = JointCells::new(input.problem.views.get(index)?, input.config, input.params);
    let maps: Vec<&[f64]> = past.iter().filter_map(|frame| frame.maps.get(index).map(AsRef::as_ref)).collect();
    let mut maps = maps;
    maps.push(input.problem.map(index));
    // Every number is divided by the largest: squares of huge numbers may overflow.
    let largest = maps.iter().flat_map(|map| map.iter()).fold(0.0_f64, |most, h| most.max(h.abs()));
    let (mut inside, mut outside, mut varying, mut level) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    for (cell, &within) in masks.inside.iter().enumerate() {
        let h = || maps.iter().filter_map(|map| map.get(cell)).map(|h| h / largest);
        let usual = mean(h())?;
        let spread = mean(h().map(|h| (h - usual).powi(2)))?.sqrt();
        if !within {
            outside = outside.max(spread);
            continue;
        }
        inside = inside.max(spread);
        if joints.distance(cell).is_some_and(|distance| distance <= 1.0) {
            varying += spread;
            level += usual;
        }
    }
    let (quiet, steadiness) = ((outside / inside).ln(), -varying / level);
    (quiet.is_finite() && steadiness.is_finite()).then_some([quiet, steadiness])
}

/// The same in words.
fn variation_told(measures: &[Measure]) -> Option<Finding> {
    let of = |name: &str| measures.iter().find(|measure| measure.name == name).map(|measure| measure.value);
    let (frames, quiet, steadiness) = match (of("quiet"), of("steadiness")) {
        (Some(quiet), Some(steadiness)) => (STATIC_FRAMES, quiet, steadiness),
        _ => (2, of("quiet_pair")?, of("steadiness_pair")?),
    };
    let text = format!(
        "Over {frames} frames the strongest change outside the EM region is {:.2} times the strongest inside; the body's own \
         echo varies by {} of its level.",
        quiet.exp(),
        percent(-steadiness)
    );
    Some(Finding::new(text, None))
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
    cells.is_finite().then(|| Measured {
        rms_mps,
        cells,
        finding: Finding::new(text, Some(FindingPlace::Joint(fastest))),
    })
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
    cell_mps.is_finite().then(|| Finding::new(text, Some(FindingPlace::Joint(fastest))))
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
    let mut findings = vec![Finding::new(text, Some(FindingPlace::Frame(before)))];
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
    let FindingPlace::Cells { lo, hi, .. } = &place else { return None };
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
