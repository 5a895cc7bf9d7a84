//! Initialisation of one person from the maps alone.
//!
//! 1. Background off, local maxima above an adaptive percentile ([`evidence`]).
//! 2. Peaks of different views are paired where their coordinates agree on one point in space.
//! 3. A standing body is tried at every such point, at several heights and depths. The place where all views show
//!    the most echo over their background wins: a wall arc has none, a strong echo in one view only has little.
//! 4. The body is shifted until it covers what is lit, then until L_EM is smallest.
//!
//! Nothing here reads a label.

mod evidence;
mod height;
mod template;

pub use evidence::Peak;

use super::{FitError, Objective, Precision, Problem};
use crate::body::{Group, Pppr, PpprShape};
use crate::config::{FitConfig, Summation};
use crate::geometry::{Vec3, add, norm, scale, sub};
use evidence::{Evidence, locate};
use height::Expectation;
use std::sync::Arc;
use template::Template;

/// Peaks of two views that disagree by more are not one body, m.
const LARGEST_MISFIT_M: f64 = 0.35;
/// Places nearer to each other are one, m.
const DISTINCT_M: f64 = 0.7;
/// At most this many places are looked at closely.
const MOST_PLACES: usize = 8;
/// A place with less than this share of the strongest place's echo is no rival to it.
const WEAKEST_RIVAL: f64 = 0.3;
/// Initial standard deviation of a joint's Gaussian, m.
const INITIAL_SCALE_M: f64 = 0.08;
/// Height of the ripples of L_EM along a shift of the body.
const RIPPLE: f64 = 0.02;

/// A start for the fit, and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Initialisation {
    /// One person on the problem's skeleton.
    pub params: Pppr,
    /// Local maxima of every view, strongest over the background first within a view.
    pub peaks: Vec<Peak>,
    /// What was found and assumed, in words.
    pub notes: Vec<String>,
}

/// Finds one person; SPEC section 2 says what the parameters are.
///
/// # Errors
/// [`FitError::NoStart`] where no view shows anything above its background.
pub fn initialise(problem: &Problem, config: &FitConfig) -> Result<Initialisation, FitError> {
    let evidence: Vec<Evidence<'_>> =
        problem.views.iter().enumerate().map(|(k, view)| Evidence::new(k, view, problem.map(k))).collect();
    let peaks: Vec<Peak> = evidence.iter().flat_map(Evidence::peaks).collect();
    let template = Template::new(&problem.skeleton);
    let mut notes: Vec<String> = (0..problem.views.len())
        .filter(|&k| problem.filled_cells(k) > 0)
        .map(|k| format!("{}: {} missing cells filled", problem.views[k].array, problem.filled_cells(k)))
        .collect();
    let candidates = candidates(problem, &peaks);
    notes.push(format!("{} peaks, {} places tried", peaks.len(), candidates.len()));
    let ranked = |score: &dyn Fn(&[Vec3]) -> f64| {
        let scored = candidates.iter().map(|&at| (at, score(&template.facing_origin(at))));
        let mut scored: Vec<(Vec3, f64)> = scored.filter(|(_, score)| *score > 0.0).collect();
        scored.sort_by(|a, b| b.1.total_cmp(&a.1));
        let least = WEAKEST_RIVAL * scored.first().map_or(0.0, |(_, score)| *score);
        scored.into_iter().filter(|(_, score)| *score >= least).map(|(at, _)| at).collect::<Vec<Vec3>>()
    };
    let mut places = ranked(&|body| shared_excess(&evidence, body));
    if places.is_empty() {
        notes.push("the views agree on no place: the strongest echo of one view was taken".to_owned());
        places = ranked(&|body| evidence.iter().map(|e| e.mean_excess(body)).sum());
    }
    let Some((at, expected)) = most_bodily(&evidence, &template, &places) else {
        return Err(FitError::NoStart { reason: format!("none of {} peaks stands above its background", peaks.len()) });
    };
    let at = settle(problem, config, &evidence, &template, expected, at)?;
    let (params, velocity_note) = standing(problem, &evidence, &template, at);
    notes.push(format!("standing at x {:.2} m, y {:.2} m, facing the radar", at[0], at[1]));
    notes.push(match expected.extent_m {
        Some([low, high]) => format!("feet at z {low:.2} m and head at {high:.2} m seen"),
        None => format!("no feet and head seen: middle of the body expected at z {:.2} m", expected.middle_m),
    });
    notes.push(velocity_note);
    Ok(Initialisation { params, peaks, notes })
}

/// Points where peaks of two views may be one body; each peak by itself where no two agree or there is one view.
fn candidates(problem: &Problem, peaks: &[Peak]) -> Vec<Vec3> {
    let mut found = Vec::new();
    for (i, a) in peaks.iter().enumerate() {
        for b in peaks.iter().skip(i + 1).filter(|b| b.view != a.view) {
            found.push(locate(&problem.views, &[a, b]));
        }
    }
    let sound = |(p, misfit): &(Vec3, f64)| *misfit < LARGEST_MISFIT_M && norm(*p).is_finite();
    found.retain(sound);
    if found.is_empty() {
        found = peaks.iter().map(|peak| locate(&problem.views, &[peak])).filter(sound).collect();
    }
    // A body stands behind its nearest echo, and its brightest part may be high or low on it.
    let places = found.iter().flat_map(|(p, _)| {
        [0.0, 0.15].into_iter().flat_map(move |behind| {
            [-0.6, -0.3, 0.0, 0.3, 0.6].map(|up| add(scale(*p, 1.0 + behind / norm(*p).max(0.5)), [0.0, 0.0, up]))
        })
    });
    places.collect()
}

/// The first of the strongest distinct `places` where something stands from feet to head, or the strongest: a corner of
/// the room may outshine a person in both views, but it is a spot.
fn most_bodily(evidence: &[Evidence<'_>], template: &Template, places: &[Vec3]) -> Option<(Vec3, Expectation)> {
    let mut tried: Vec<(Vec3, Expectation)> = Vec::new();
    let mut starts: Vec<Vec3> = Vec::new();
    for &place in places {
        if starts.iter().any(|start| (start[0] - place[0]).hypot(start[1] - place[1]) < DISTINCT_M) {
            continue;
        }
        starts.push(place);
        let at = cover(evidence, template, place);
        let expected = Expectation::new(evidence, at);
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
fn shared_excess(evidence: &[Evidence<'_>], body: &[Vec3]) -> f64 {
    let logs: f64 = evidence.iter().map(|e| e.mean_excess(body).ln()).sum();
    (logs / evidence.len().max(1) as f64).exp()
}

/// Walks downhill on a grid that is halved `halvings` times: to the best of the six neighbours until none is better.
fn descend(start: Vec3, step_m: f64, halvings: usize, mut cost: impl FnMut(Vec3) -> f64) -> Vec3 {
    let (mut at, mut lowest, mut step) = (start, cost(start), step_m);
    for _ in 0..=halvings {
        for _ in 0..12 {
            let moves = (0..6).map(|k| {
                let mut to = at;
                to[k / 2] += if k % 2 == 0 { step } else { -step };
                (to, cost(to))
            });
            let Some((to, value)) = moves.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, value)| *value < lowest)
            else {
                break;
            };
            (at, lowest) = (to, value);
        }
        step *= 0.5;
    }
    at
}

/// Shifts the body until as much of it as possible lies on what is lit in every view.
fn cover(evidence: &[Evidence<'_>], template: &Template, at: Vec3) -> Vec3 {
    let expected = Expectation::new(evidence, at);
    descend(at, 0.2, 3, |p| {
        let body = template.facing_origin(p);
        let lit: f64 = evidence.iter().map(|e| e.mean_lit(&body)).sum::<f64>() / evidence.len().max(1) as f64;
        expected.cost(p[2]) - lit
    })
}

/// Shifts the body until L_EM is smallest, in the EM region around where it was found.
fn settle(
    problem: &Problem,
    config: &FitConfig,
    evidence: &[Evidence<'_>],
    template: &Template,
    expected: Expectation,
    at: Vec3,
) -> Result<Vec3, FitError> {
    let start = standing(problem, evidence, template, at).0;
    // Where the joints are is not known to a wavelength, so their interference says nothing yet.
    let config = FitConfig { summation: Summation::Incoherent, ..*config };
    let objective = Objective::new(Arc::new(problem.clone()), config, Precision::F32, &start)?;
    let mut cost = |p: Vec3| {
        let loss = objective.em_loss(&standing(problem, evidence, template, p).0);
        loss + expected.cost(p[2])
    };
    let mut at = descend(at, 0.1, 1, &mut cost);
    for (axis, reach_m) in [(2, 0.6), (0, 0.3), (1, 0.3)] {
        at[axis] += mean_shift(reach_m, |shift| {
            let mut moved = at;
            moved[axis] += shift;
            cost(moved)
        });
    }
    Ok(at)
}

/// The mean shift within ± `reach_m` under exp(−cost/T). L_EM along a shift of the body is a wide valley with ripples
/// where single joints meet single speckles; its deepest ripple says less than its middle.
fn mean_shift(reach_m: f64, mut cost: impl FnMut(f64) -> f64) -> f64 {
    let shifts: Vec<f64> = (-6..=6).map(|k| reach_m * f64::from(k) / 6.0).collect();
    let costs: Vec<f64> = shifts.iter().map(|&shift| cost(shift)).collect();
    let lowest = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (shift, cost) in shifts.into_iter().zip(costs).filter(|(_, cost)| cost.is_finite()) {
        let weight = (-(cost - lowest) / RIPPLE).exp();
        sum += weight * shift;
        weights += weight;
    }
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// The parameters of a body that stands at `at`.
fn standing(problem: &Problem, evidence: &[Evidence<'_>], template: &Template, at: Vec3) -> (Pppr, String) {
    let body = template.facing_origin(at);
    let doppler_features = problem.radar.doppler_features;
    let mut params = Pppr::zeros(PpprShape { persons: 1, joints: body.len(), doppler_features });
    let radial = evidence.iter().zip(&problem.views).find_map(|(e, view)| {
        let from_radar = sub(at, view.pose.world_from_view([0.0; 3]));
        e.radial_mps(at).map(|v| (v, scale(from_radar, v / norm(from_radar).max(1e-6))))
    });
    for (joint, &p) in body.iter().enumerate() {
        params.set_vec3(Group::Position, joint, p);
        params.set_vec3(Group::LogScale, joint, [INITIAL_SCALE_M.ln(); 3]);
        params.joint_mut(Group::Rotation, joint).copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        params.set_vec3(Group::Velocity, joint, radial.map_or([0.0; 3], |(_, v)| v));
    }
    let note = match radial {
        Some((v, _)) => format!("radial velocity {v:.2} m/s from the Doppler axis"),
        None => "velocity 0: no Doppler axis".to_owned(),
    };
    (params, note)
}
