//! F3, close multi-person superposition: how much of the maps two people share.
//!
//! Each person is simulated alone. The echoes are summed incoherently, because the phases between joints say nothing of where
//! they are. With p and q the two maps, each divided by its sum (a near person must not hide that a far one is covered):
//!
//! ```text
//! raw = the highest, over pairs of persons, of the lowest, over views that show both, of Σ min(p, q)
//! ```
//!
//! The lowest, because one view that keeps two people apart is enough to tell them apart; the findings have every view.
//! Σ min(p, q) is 1 for equal maps, 0 for maps with no common cell, and one minus their total variation distance; it falls
//! as the two part. Where the data set annotates more people than are fitted, the labelled boxes on the maps stand in, with
//! the common part of two boxes as a share of the smaller one. One person alone has 0.
//!
//! **The score does not rest on what is fitted**: who fits one person where three stand has the mode all the more. It rests on
//! what `people` counts in this frame and those before it, with P the probability of two or more and d the distance on the
//! floor of the two nearest of the counted places:
//!
//! ```text
//! close_pair = P/(1 + (d/0.5 m)²)
//! ```
//!
//! Arrays that do not part two people half a metre from each other at 3 m (half-value width of the finest azimuth, HuPR's for
//! example) have a curve of their own (`close_pair_coarse`): their scores stay near the share of the frames with the mode.

use super::cells::{members, place};
use super::counted::count;
use super::number_text::{cell_box, length, percent};
use super::resolution::{FWHM, Resolution};
use super::{EvidenceInput, Finding, FindingPlace, Found, Measure, Past, falling};
use crate::body::{Group, Pppr, PpprShape};
use crate::config::{FitConfig, Summation};
use crate::geometry::{flat_distance, mean, norm, sub};
use crate::labels::Tag;
use crate::mhp::{Precision, simulate};
use crate::people::Count;
use crate::radar::View;

/// ε of H_sim (SPEC section 3): what a cell without any echo holds.
const FLOOR: f64 = 1e-30;
/// Cells of the common echo above this share of its largest are shown as its place.
const SHOWN_SHARE: f64 = 0.25;

/// Two people at this distance are half as close as at none, m.
const CLOSE_M: f64 = 0.5;
/// How far away people usually are, m.
const USUAL_M: f64 = 3.0;

pub(super) fn judge(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Found {
    let persons = input.params.shape().persons;
    let (told, annotated) = annotations(input);
    let (raw, summary, mut findings) = match (persons, annotated) {
        (0 | 1, Some(count)) if count > persons => by_boxes(input, persons, count),
        (0 | 1, _) => {
            (Some(0.0), "One person is fitted: nobody's fitted echo covers another's.".to_owned(), Vec::new())
        }
        _ => by_maps(input),
    };
    let (measures, counted) = counted(count(input, past).as_ref(), parts_neighbours(&input.problem.views));
    let summary = format!("{summary} {}", counted.text);
    findings.push(counted);
    findings.extend(told);
    Found { mode: Tag::F3, raw, measures, summary, findings }
}

/// P of two people or more, and the distance of the nearest two places that they could have, m.
fn nearest_pair(count: &Count) -> Option<(f64, f64)> {
    let several: f64 = count.probabilities.iter().skip(2).sum();
    let places = count.seeds(count.people().max(2));
    let pairs = places.iter().enumerate().flat_map(|(k, a)| places.iter().skip(k + 1).map(move |b| (a, b)));
    let apart_m = pairs.map(|(a, b)| flat_distance(*a, *b)).fold(f64::INFINITY, f64::min);
    (several.is_finite() && apart_m.is_finite()).then_some((several, apart_m))
}

/// Whether a view parts two people [`CLOSE_M`] apart, side by side at [`USUAL_M`].
fn parts_neighbours(views: &[View]) -> bool {
    let widths = views.iter().map(|view| view.psf.azimuth_rad).filter(|&sigma| sigma.is_finite() && sigma > 0.0);
    widths.fold(f64::INFINITY, f64::min) * FWHM * USUAL_M <= CLOSE_M
}

/// What counting says of several people and of how close they are.
fn counted(count: Option<&Count>, fine: bool) -> (Vec<Measure>, Finding) {
    let Some((several, apart_m)) = count.and_then(nearest_pair) else {
        let text = "How many people these maps show cannot be counted: there is no score.";
        return (Vec::new(), Finding::new(text, None));
    };
    let name = if fine { "close_pair" } else { "close_pair_coarse" };
    let measures = vec![Measure { name: name.into(), value: several * falling(apart_m / CLOSE_M) }];
    let text =
        format!("Two people or more are counted with probability {several:.2}, the nearest {} apart.", length(apart_m));
    (measures, Finding::new(text, None))
}

/// What the labels say of how many there are, and the number that counts.
fn annotations(input: &EvidenceInput<'_>) -> (Vec<Finding>, Option<usize>) {
    let labels = &input.annotated;
    let boxes = labels.map_boxes.iter().zip(&input.problem.views).filter(|(boxes, _)| !boxes.is_empty());
    let mut parts: Vec<String> = labels.persons.iter().map(|n| format!("{n} by its count of people")).collect();
    parts.extend(boxes.map(|(boxes, view)| format!("{} by the boxes on {}", boxes.len(), view.array)));
    parts.extend(labels.image_boxes.map(|n| format!("{n} in the camera image")));
    let count = labels.persons.or_else(|| labels.map_boxes.iter().map(Vec::len).chain(labels.image_boxes).max());
    let count = count.filter(|_| !parts.is_empty());
    let fitted = input.params.shape().persons;
    let text = match count {
        None => format!("The data set says nothing of how many people there are; {fitted} fitted."),
        Some(count) => {
            let meaning = if count == fitted { "as many as are fitted" } else { "another number than is fitted" };
            format!("The data set annotates {}: {meaning} ({fitted}).", parts.join(", "))
        }
    };
    (vec![Finding::new(text, None)], count)
}

type Judged = (Option<f64>, String, Vec<Finding>);

/// More people are annotated than fitted: what their boxes share.
fn by_boxes(input: &EvidenceInput<'_>, fitted: usize, annotated: usize) -> Judged {
    let views = input.problem.views.iter().zip(input.annotated.map_boxes).enumerate();
    let pairs: Vec<(f64, Finding)> = views.filter_map(|(k, (view, boxes))| closest_boxes(k, view, boxes)).collect();
    let count = format!("{annotated} people are annotated and {fitted} fitted");
    let Some(share) = pairs.iter().map(|pair| pair.0).min_by(f64::total_cmp) else {
        return (None, format!("{count}: how much their echoes overlap is unknown."), Vec::new());
    };
    let summary = format!("{count}: in the view that parts them best, two labelled boxes share {}.", percent(share));
    (Some(share), summary, pairs.into_iter().map(|pair| pair.1).collect())
}

/// The two boxes of a view that share most.
fn closest_boxes(index: usize, view: &View, boxes: &[[f64; 4]]) -> Option<(f64, Finding)> {
    if view.axes.len() != 2 {
        return None;
    }
    let pairs = boxes.iter().enumerate().flat_map(|(k, a)| boxes.iter().skip(k + 1).map(move |b| (a, b)));
    let shares = pairs.filter_map(|(a, b)| Some((shared(a, b)?, a, b)));
    let (share, a, b) = shares.max_by(|x, y| x.0.total_cmp(&y.0))?;
    let corners = |k: usize| [a[k], a[k + 2], b[k], b[k + 2]];
    let cell = |(k, x): (usize, f64)| (x.round().max(0.0) as usize).min(view.shape()[k].saturating_sub(1));
    let lo = (0..2).map(|k| (k, corners(k).into_iter().fold(f64::INFINITY, f64::min))).map(cell).collect();
    let hi = (0..2).map(|k| (k, corners(k).into_iter().fold(f64::NEG_INFINITY, f64::max))).map(cell).collect();
    let text = format!("{}: two labelled boxes share {} of the smaller one.", view.array, percent(share));
    Some((share, Finding::new(text, Some(FindingPlace::Cells { view: index, lo, hi }))))
}

/// The common area of two boxes as a share of the smaller one.
fn shared(a: &[f64; 4], b: &[f64; 4]) -> Option<f64> {
    let area = |b: &[f64; 4]| (b[2] - b[0]).max(0.0) * (b[3] - b[1]).max(0.0);
    let common = [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])];
    let share = area(&common) / area(a).min(area(b));
    share.is_finite().then(|| share.clamp(0.0, 1.0))
}

/// Several people are fitted: what their simulated maps share.
fn by_maps(input: &EvidenceInput<'_>) -> Judged {
    let persons = input.params.shape().persons;
    let alone: Vec<Vec<Option<Vec<f64>>>> = (0..persons).map(|person| normalised(input, person)).collect();
    let pairs = (0..persons).flat_map(|a| (a + 1..persons).map(move |b| (a, b)));
    let judged = pairs.filter_map(|(a, b)| {
        let shares: Vec<Option<f64>> =
            alone[a].iter().zip(&alone[b]).map(|(p, q)| common(p.as_ref()?, q.as_ref()?)).collect();
        Some((shares.iter().copied().flatten().min_by(f64::total_cmp)?, a, b, shares))
    });
    let Some((share, a, b, shares)) = judged.max_by(|x, y| x.0.total_cmp(&y.0)) else {
        return (None, "No view shows the echoes of two of the fitted people.".to_owned(), Vec::new());
    };
    let apart_m = norm(sub(mean(input.params.person(a)), mean(input.params.person(b))));
    let pair = format!("Persons {} and {}, {} apart,", a + 1, b + 1, length(apart_m));
    let summary = format!("{pair} share {} of their echo in the view that parts them best.", percent(share));
    let views = input.problem.views.iter().enumerate().zip(shares);
    let findings = views.map(|((k, view), share)| {
        let apart = apart(view, input.params, a, b);
        let Some(share) = share else {
            return Finding::new(format!("{} does not show both; {apart}.", view.array), None);
        };
        let overlap = alone[a][k].as_ref().zip(alone[b][k].as_ref()).and_then(|(p, q)| overlap(k, view, p, q));
        let at = match &overlap {
            Some(FindingPlace::Cells { lo, hi, .. }) => format!(", at {}", cell_box(view, lo, hi)),
            _ => String::new(),
        };
        Finding::new(format!("{}: they share {} of their echo{at}; {apart}.", view.array, percent(share)), overlap)
    });
    (Some(share), summary, findings.collect())
}

/// The map of one person alone in each view, divided by its sum; `None` where the view does not show them.
fn normalised(input: &EvidenceInput<'_>, person: usize) -> Vec<Option<Vec<f64>>> {
    let config = FitConfig { summation: Summation::Incoherent, ..*input.config };
    let maps = simulate(input.problem, &config, Precision::F64, &one_person(input.params, person));
    let normalise = |map: Vec<f64>| {
        let map: Vec<f64> = map.into_iter().map(|h| if h.is_finite() { (h - FLOOR).max(0.0) } else { 0.0 }).collect();
        let largest = map.iter().copied().fold(0.0, f64::max);
        // Two steps, because the sum of large numbers may overflow.
        let relative: Vec<f64> = map.iter().map(|h| h / largest).collect();
        let sum: f64 = relative.iter().sum();
        (largest > 0.0 && sum.is_finite()).then(|| relative.iter().map(|h| h / sum).collect())
    };
    maps.into_iter().map(normalise).collect()
}

fn one_person(params: &Pppr, person: usize) -> Pppr {
    let shape = params.shape();
    let mut one = Pppr::zeros(PpprShape { persons: 1, ..shape });
    for group in Group::ALL {
        let numbers = shape.width(group) * shape.joints;
        let of_person = params.group(group).iter().skip(person * numbers);
        for (to, from) in one.group_mut(group).iter_mut().zip(of_person) {
            *to = *from;
        }
    }
    one
}

/// Σ min(p, q).
fn common(p: &[f64], q: &[f64]) -> Option<f64> {
    let share: f64 = p.iter().zip(q).map(|(p, q)| p.min(*q)).sum();
    share.is_finite().then(|| share.clamp(0.0, 1.0))
}

/// The box around the cells where both are strong.
fn overlap(index: usize, view: &View, p: &[f64], q: &[f64]) -> Option<FindingPlace> {
    let both: Vec<f64> = p.iter().zip(q).map(|(p, q)| p.min(*q)).collect();
    let largest = both.iter().copied().fold(0.0, f64::max);
    let strong: Vec<bool> = both.iter().map(|&h| h > 0.0 && h >= SHOWN_SHARE * largest).collect();
    place(index, &view.shape(), &members(&strong))
}

/// `2.1 range cells and 0.4 azimuth cells apart`: between the middles of two people, in half-value widths of the point
/// spread.
fn apart(view: &View, params: &Pppr, a: usize, b: usize) -> String {
    let [a, b] = [a, b].map(|person| Resolution::new(view, view.pose.view_from_world(mean(params.person(person)))));
    let width = |k: usize| f64::midpoint(a.sigma_m[k], b.sigma_m[k]) * FWHM;
    let turn = |k: usize| {
        let angle = (a.angles[k] - b.angles[k]).abs();
        angle.min(std::f64::consts::TAU - angle)
    };
    let range = f64::midpoint(a.range_m, b.range_m);
    let offsets = [
        ("range", (a.range_m - b.range_m).abs(), width(0)),
        ("azimuth", turn(0) * range, width(1)),
        ("elevation", turn(1) * range, width(2)),
    ];
    let parts: Vec<String> = offsets
        .into_iter()
        .filter(|(.., width)| *width > 0.0)
        .map(|(name, offset, width)| format!("{:.1} {name} cells", offset / width))
        .collect();
    match parts.split_last() {
        None => "its resolution is unknown".to_owned(),
        Some((one, [])) => format!("their middles are {one} apart"),
        Some((last, first)) => format!("their middles are {} and {last} apart", first.join(", ")),
    }
}
