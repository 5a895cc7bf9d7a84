//! F1, static reflector dominance: how much of what the fit is told to explain never moves.
//!
//! A cell is bright in a frame where it exceeds that frame's percentile 100 − κ, or lies in that frame's mask (above the
//! percentile 100 − τ of the EM region's cells). It is static where it is bright in every one of the last T frames, this
//! one included. The raw value is the share of B_ori's cells that are static, averaged over the views:
//!
//! ```text
//! raw = mean over views of |static ∩ B_ori| / |B_ori|
//! ```
//!
//! A person who stands still is static too, and of one who moves most cells stay bright for half a second. Therefore the
//! findings say how much of the static part lies on the fitted joints, and the score rests on what is *beside* the body:
//! the cells of the EM region farther than two resolution cells from every joint, set B. With h_t the maps of the T frames,
//!
//! ```text
//! persistence  = mean over views of Σ_B min_t h_t / Σ_B mean_t h_t       1 where nothing beside the body ever fades
//! static_level = mean over views of ln(max_B min_t h_t / max h_T within one resolution cell of a joint)
//! ```
//!
//! Noise and sidelobes of who moves fade within five frames (for noise alone it is about 0.3); an echo that was not removed
//! does not. The second is how much stronger than the body the strongest such echo is.
//!
//! Maps that a data set made of differences of frames (HIBER) have no static echoes: there is no score then, and it is said.

use super::cells::{largest_patch, members, place};
use super::number_text::{cell_box, cells, percent};
use super::resolution::JointCells;
use super::{
    EvidenceInput, Finding, FindingPlace, Found, Measure, Past, STATIC_FRAMES, STATIC_KAPPA_PCT, masks_of, mean,
};
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
    /// Persistence and static level; `None` where nothing lies beside the body, or nothing at all on it.
    beside: Option<[f64; 2]>,
}

/// Cells farther than so many resolution cells from every joint are beside the body.
const BESIDE: f64 = 2.0;

/// Why F1 has no score where a data set's maps are differences of frames.
const REMOVED: &str = "It cannot be measured here: the data set subtracts what stands still from its maps, so that static reflectors, and \
                       people who stand still, are not in them.";

pub(super) fn judge(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Found {
    if input.annotated.static_removed {
        return Found::unknown(Tag::F1, REMOVED);
    }
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
    let raw = share.filter(|_| enough);
    let measures = if raw.is_some() { measures(&seen) } else { Vec::new() };
    Found { mode: Tag::F1, raw, measures, summary, findings }
}

/// Means over the views that have something beside the body.
fn measures(seen: &[Seen<'_>]) -> Vec<Measure> {
    let names = ["persistence", "static_level"].into_iter().enumerate();
    let of = |k: usize| mean(seen.iter().filter_map(|seen| seen.beside).map(|beside| beside[k]));
    names.filter_map(|(k, name)| Some(Measure { name: name.into(), value: of(k)? })).collect()
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
    let beside = beside(input, past, index, masks);
    Some(Seen { index, view, masks, still, counts, patch, beside })
}

/// Persistence and static level of one view.
fn beside(input: &EvidenceInput<'_>, past: &[Past<'_>], index: usize, masks: &Masks) -> Option<[f64; 2]> {
    let now = input.problem.map(index);
    let maps: Vec<&[f64]> =
        past.iter().filter_map(|frame| Some(frame.maps.get(index)?.as_ref())).chain(std::iter::once(now)).collect();
    let joints = JointCells::new(input.problem.views.get(index)?, input.config, input.params);
    // The least, the mean, and the largest of the least; half of each, because the sum of huge numbers may overflow.
    let (mut least, mut usual, mut strongest, mut body) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    for cell in members(&masks.inside) {
        let Some(distance) = joints.distance(cell) else { continue };
        let h = || maps.iter().filter_map(|map| map.get(cell)).map(|h| h.max(0.0));
        if distance <= 1.0 {
            body = body.max(now.get(cell).copied().unwrap_or(0.0));
        } else if distance > BESIDE {
            let low = h().fold(f64::INFINITY, f64::min);
            least += low / 2.0 / masks.inside.len() as f64;
            usual += mean(h())? / 2.0 / masks.inside.len() as f64;
            strongest = strongest.max(low);
        }
    }
    let persistence = least / usual;
    let level = strongest.max(f64::MIN_POSITIVE).ln() - body.max(f64::MIN_POSITIVE).ln();
    (persistence.is_finite() && body > 0.0 && level.is_finite()).then_some([persistence, level])
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

    fn place_of(&self, cells: &[usize]) -> Option<FindingPlace> {
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
        findings.extend(seen.beside.filter(|_| frames >= STATIC_FRAMES).map(|beside| beside_body(seen.view, beside)));
        if still > 0 {
            findings.extend(patch(seen));
            findings.push(on_joints(input, seen));
        }
    }
    findings
}

/// How lasting and how strong what lies beside the body is.
fn beside_body(view: &View, [persistence, level]: [f64; 2]) -> Finding {
    let db = view.quantity.db_factor() / std::f64::consts::LN_10 * level;
    let (size, than) = (db.abs(), if db < 0.0 { "below" } else { "above" });
    let text = format!(
        "{}: beside the body {} of the echo lasts through {STATIC_FRAMES} frames, at most {size:.0} dB {than} the body's own.",
        view.array,
        percent(persistence)
    );
    Finding::new(text, None)
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
    Some(Finding::new(text, Some(FindingPlace::Cells { view: seen.index, lo, hi })))
}

/// How much of the static part lies within a resolution cell of a joint.
fn on_joints(input: &EvidenceInput<'_>, seen: &Seen<'_>) -> Finding {
    let joints = JointCells::new(seen.view, input.config, input.params);
    let near = |cell: &usize| joints.distance(*cell).is_some_and(|distance| distance <= 1.0);
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
