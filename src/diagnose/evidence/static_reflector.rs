//! F1, static reflector dominance: how much of what the fit is told to explain never moves.
//!
//! A cell is bright in a frame where it exceeds that frame's percentile 100 − κ, or lies in that frame's mask (above the
//! percentile 100 − τ of the EM region's cells). It is static where it is bright in every one of the last T frames, this
//! one included. The score is the share of B_ori's cells that are static, averaged over the views:
//!
//! ```text
//! score = mean over views of |static ∩ B_ori| / |B_ori|
//! ```
//!
//! A person who stands still is static too. Therefore the findings say how much of the static part lies on the fitted
//! joints, and the score does not decide between the two.

use super::cells::{largest_patch, members, place};
use super::resolution::{Resolution, echo, joint_bins};
use super::words::{cell_box, cells, percent};
use super::{Evidence, EvidenceInput, Finding, Past, Place, STATIC_FRAMES, STATIC_KAPPA_PCT, masks_of, mean};
use crate::labels::Tag;
use crate::mhp::{Masks, percentile};
use crate::radar::View;

/// What one view shows.
struct Seen<'a> {
    index: usize,
    view: &'a View,
    masks: &'a Masks,
    /// Static cells of B_ori.
    still: Vec<bool>,
    /// Cells of B_ori and of those the static ones.
    counts: [usize; 2],
    /// The largest connected part of the static ones, ascending.
    patch: Vec<usize>,
}

pub(super) fn judge(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Evidence {
    let frames = past.len() + 1;
    let seen: Vec<Seen<'_>> = (0..input.problem.views.len()).filter_map(|view| look(input, past, view)).collect();
    let share = mean(seen.iter().filter_map(Seen::share));
    let enough = frames >= STATIC_FRAMES;
    let findings = if frames > 1 { findings(input, &seen, frames) } else { Vec::new() };
    let summary = match share {
        None => "The mask of H_ori is empty: there is nothing that could be static.".to_owned(),
        Some(_) if !enough => {
            format!("It needs {STATIC_FRAMES} frames of the sequence in a row, this is number {frames}.")
        }
        Some(share) => format!("{} of the mask is static over {frames} frames{}.", percent(share), mostly_at(&seen)),
    };
    Evidence { mode: Tag::F1, score: share.filter(|_| enough), summary, findings }
}

/// `, most of it at …`: the largest patch of all views.
fn mostly_at(seen: &[Seen<'_>]) -> String {
    // The last of equals would be taken; reversed, the first view's is.
    let largest = seen.iter().rev().max_by_key(|seen| seen.patch.len());
    largest.and_then(|seen| Some((seen, seen.patch_box()?))).map_or_else(String::new, |(seen, (lo, hi))| {
        format!(", the largest patch at {} in {}", cell_box(seen.view, &lo, &hi), seen.view.array)
    })
}

fn look<'a>(input: &EvidenceInput<'a>, past: &[Past<'_>], index: usize) -> Option<Seen<'a>> {
    let (view, masks) = (input.problem.views.get(index)?, masks_of(input, index)?);
    let mut still = masks.ori.clone();
    for frame in past {
        let bright = bright(frame.maps.get(index)?, &masks.inside, input.config.tau_pct);
        for (still, bright) in still.iter_mut().zip(bright) {
            *still &= bright;
        }
    }
    let counts = [&masks.ori, &still].map(|mask| members(mask).len());
    let patch = largest_patch(&view.shape(), &still);
    Some(Seen { index, view, masks, still, counts, patch })
}

/// The bright cells of a map.
fn bright(map: &[f64], inside: &[bool], tau_pct: f64) -> Vec<bool> {
    let region: Vec<f64> = map.iter().zip(inside).filter(|(_, inside)| **inside).map(|(h, _)| *h).collect();
    let (whole, mask) = (percentile(map, 100.0 - STATIC_KAPPA_PCT), percentile(&region, 100.0 - tau_pct));
    map.iter().zip(inside).map(|(&h, &inside)| h > whole || (inside && h > mask)).collect()
}

impl Seen<'_> {
    /// `None` where B_ori is empty.
    fn share(&self) -> Option<f64> {
        let [mask, still] = self.counts;
        (mask > 0).then(|| still as f64 / mask as f64)
    }

    fn patch_box(&self) -> Option<(Vec<usize>, Vec<usize>)> {
        super::cells::bounds(&self.view.shape(), &self.patch)
    }

    fn place_of(&self, cells: &[usize]) -> Option<Place> {
        place(self.index, &self.view.shape(), cells)
    }
}

fn findings(input: &EvidenceInput<'_>, seen: &[Seen<'_>], frames: usize) -> Vec<Finding> {
    let mut findings = Vec::new();
    if frames < STATIC_FRAMES {
        findings.push(Finding::new("The fewer frames, the more seems static; hence no score yet.", None));
    }
    for seen in seen {
        let Some(share) = seen.share() else {
            findings.push(Finding::new(format!("{}: the mask of H_ori is empty.", seen.view.array), None));
            continue;
        };
        let [mask, still] = seen.counts;
        let text = format!(
            "{}: {still} of the mask's {} ({}) are bright in each of {frames} frames.",
            seen.view.array,
            cells(mask),
            percent(share)
        );
        findings.push(Finding::new(text, seen.place_of(&members(&seen.still))));
        if still > 0 {
            findings.extend(patch(seen));
            findings.push(on_joints(input, seen));
        }
    }
    findings
}

/// Where the largest static patch is, and how much of it H_sim leaves unexplained.
fn patch(seen: &Seen<'_>) -> Option<Finding> {
    let (lo, hi) = seen.patch_box()?;
    let missed = seen.patch.iter().filter(|&&cell| seen.masks.sim.get(cell) != Some(&true)).count();
    let text = format!(
        "{}: the largest static patch has {}, at {}; H_sim does not explain {} of it.",
        seen.view.array,
        cells(seen.patch.len()),
        cell_box(seen.view, &lo, &hi),
        percent(missed as f64 / seen.patch.len().max(1) as f64)
    );
    Some(Finding::new(text, Some(Place::Cells { view: seen.index, lo, hi })))
}

/// How much of the static part lies within a resolution cell of a joint.
fn on_joints(input: &EvidenceInput<'_>, seen: &Seen<'_>) -> Finding {
    let shape = seen.view.shape();
    let joints: Vec<(Vec<f64>, Vec<f64>)> = (0..input.params.shape().total_joints())
        .map(|joint| {
            let at = joint_bins(seen.view, input.config, input.params, joint);
            let p = echo(seen.view, input.config, input.params, joint);
            (at, Resolution::new(seen.view, p).cells(seen.view))
        })
        .collect();
    let near = |cell: &usize| {
        let cell = super::cells::index(&shape, *cell);
        joints.iter().any(|(at, width)| {
            let offsets = cell.iter().zip(at).zip(width);
            offsets.map(|((&cell, at), width)| ((cell as f64 - at) / width).powi(2)).sum::<f64>() <= 1.0
        })
    };
    let still = members(&seen.still);
    let covered: Vec<usize> = still.iter().copied().filter(near).collect();
    let share = covered.len() as f64 / still.len().max(1) as f64;
    let meaning = if share >= 0.5 {
        "a person who stands still looks like this too, and so does a fit on a reflector"
    } else {
        "the rest is no part of the fitted body"
    };
    let text = format!(
        "{}: {} of the static cells lie within one resolution cell of a fitted joint: {meaning}.",
        seen.view.array,
        percent(share)
    );
    Finding::new(text, seen.place_of(if covered.is_empty() { &still } else { &covered }))
}
