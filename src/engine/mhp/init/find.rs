//! Who stands where: the place that all views show lit, anywhere or near a place that is given.

use super::place::{self, Place};
use super::towards_radar;
use crate::config;
use crate::geometry::{Vec3, add, flat_distance, norm, scale};
use crate::mhp::context::{Expectation, Mark, Peak, SaliencyMap, centre, triangulate};
use crate::mhp::template::Template;
use crate::mhp::{FitError, Problem};
use crate::radar::{AxisKind, View};

/// Places nearer to each other are one, m.
const DISTINCT_M: f64 = 0.7;
/// At most this many places are looked at closely.
const MOST_PLACES: usize = 8;
/// A place with less than this share of the strongest place's echo is no rival to it.
const WEAKEST_RIVAL: f64 = 0.3;
/// The strongest place where somebody stands; with [`config::StartPlace::Cluster`] the strongest cluster of peaks, whatever stands there.
pub(super) fn find_one(
    problem: &Problem,
    how: config::StartPlace,
    maps: &[SaliencyMap],
    template: &Template,
    peaks: &[Peak],
    notes: &mut Vec<String>,
) -> Result<(Vec3, Expectation), FitError> {
    let places = place::places(problem, maps, peaks);
    if how == config::StartPlace::Cluster {
        let strongest = places.first().map(|place| place.at).ok_or_else(|| dark(peaks))?;
        notes.push(format!("{} peaks in {} clusters: the middle of the strongest", peaks.len(), places.len()));
        return Ok((strongest, Expectation { middle_m: strongest[2], ..Expectation::new(maps, strongest) }));
    }
    let plural = if places.len() == 1 { "" } else { "s" };
    notes.push(format!("{} peaks, {} place{plural} tried", peaks.len(), places.len()));
    let mut ranked = rank(&places, template, |body| shared_excess(maps, body));
    if ranked.is_empty() {
        notes.push("the views agree on no place: the strongest echo of one view was taken".to_owned());
        ranked = rank(&places, template, |body| maps.iter().map(|map| map.mean_excess(body)).sum());
    }
    most_bodily(problem, maps, &ranked).ok_or_else(|| dark(peaks))
}

fn dark(peaks: &[Peak]) -> FitError {
    FitError::NoStart { reason: format!("none of {} peaks stands above its background", peaks.len()) }
}

/// The middle of what the first view covers: where a body stands when nothing may be read from the peaks.
pub(super) fn middle_of_views(problem: &Problem) -> Vec3 {
    let middle = |(view, v): (usize, &View)| {
        let spatial = v.axes.iter().filter(|axis| axis.kind != AxisKind::Doppler);
        Mark { view, bin: spatial.map(|axis| axis.bins as f64 / 2.0).collect() }
    };
    let marks: Vec<Mark> = problem.views.iter().enumerate().map(middle).collect();
    triangulate(&problem.views, &marks.iter().collect::<Vec<_>>()).0
}

/// Bodies at `places`, at several heights and depths each, best first: a body stands behind its nearest echo, and its
/// brightest part may be high or low on it.
fn rank(places: &[Place], template: &Template, score: impl Fn(&[Vec3]) -> f64) -> Vec<Vec3> {
    let moved = places.iter().flat_map(|place| {
        [0.0, 0.15].into_iter().flat_map(move |behind| {
            [-0.6, -0.3, 0.0, 0.3, 0.6]
                .map(|up| add(scale(place.at, 1.0 + behind / norm(place.at).max(0.5)), [0.0, 0.0, up]))
        })
    });
    let scored = moved.map(|at| (at, score(&template.facing(at, towards_radar(at)))));
    let mut scored: Vec<(Vec3, f64)> = scored.filter(|(_, score)| *score > 0.0).collect();
    scored.sort_by(|a, b| b.1.total_cmp(&a.1));
    let least = WEAKEST_RIVAL * scored.first().map_or(0.0, |(_, score)| *score);
    scored.into_iter().filter(|(_, score)| *score >= least).map(|(at, _)| at).collect()
}

/// The first of the strongest distinct `places` where something stands from feet to head, or the strongest: a corner of
/// the room may outshine a person in both views, but it is a spot.
fn most_bodily(problem: &Problem, maps: &[SaliencyMap], places: &[Vec3]) -> Option<(Vec3, Expectation)> {
    let mut tried: Vec<(Vec3, Expectation)> = Vec::new();
    let mut starts: Vec<Vec3> = Vec::new();
    for &place in places {
        if starts.iter().any(|&start| flat_distance(start, place) < DISTINCT_M) {
            continue;
        }
        starts.push(place);
        let (at, expected) = centre(&problem.views, maps, place, f64::INFINITY);
        if expected.extent_m.is_some() {
            return Some((at, expected));
        }
        tried.push((at, expected));
        if tried.len() == MOST_PLACES {
            break;
        }
    }
    tried.first().copied()
}

/// How much echo over the background all views show at a body: the geometric mean over views, so that each must agree.
fn shared_excess(maps: &[SaliencyMap], body: &[Vec3]) -> f64 {
    let logs: f64 = maps.iter().map(|map| map.mean_excess(body).ln()).sum();
    (logs / maps.len().max(1) as f64).exp()
}
