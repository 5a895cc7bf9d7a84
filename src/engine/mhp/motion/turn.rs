//! Which way somebody looks who stands among reflectors.
//!
//! Place and posture of such a person stay those of the start (`Held`), for levels of a room cannot move them. But a body from its
//! side is another body than from its front: the loss of the start, turned about its hips, has its lowest point where the person
//! looks to, far below that of other headings. Nobody turns by much from a frame to the next, so that headings are paths through
//! the frames around (Viterbi's algorithm, from both ends to the frame that is fitted). Front and back are told apart by little,
//! and who stands before a radar is as likely as not to look at it: only a loss that is clearly lower turns somebody's back.

use super::reduced::ReducedViews;
use super::search::hips_of;
use super::{WALKING_MPS, ways};
use crate::body::Pppr;
use crate::config::{EmLoss, EmRegion, FitConfig};
use crate::geometry::{norm, turned_about};
use crate::mhp::{FitError, Precision, Problem, region};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Headings that are tried.
const HEADINGS: usize = 24;
/// What of the maps is looked at, m around the person.
const AROUND_M: f64 = 0.6;
/// Frames farther away in time are not looked at, s: over many, a path that looks away says as much as one that looks here.
const NEAR_S: f64 = 0.15;
/// Headings between one frame and the next at most, and what each of them costs of a loss.
const MOST_TURN: usize = 2;
const TURN: f64 = 0.004;
/// The share of the start's own loss below which it is turned at all, and the share of the best heading's that does not turn it
/// by more than a right angle, below which it is turned farther.
const CLEARER: f64 = 0.85;
const BEHIND: f64 = 0.7;
/// Levels that correlate less than by one less this are of something else than the body in any heading.
const MOST_UNLIKE: f64 = 0.2;

/// A number a heading.
type Headings = [f64; HEADINGS];

/// Turns the persons of `params` who stand to where they look; what was done, a line a person who was turned.
///
/// # Errors
/// Where a position is not finite.
pub(in crate::mhp) fn turn(problem: &Problem, config: &FitConfig, params: &mut Pppr) -> Result<Vec<String>, FitError> {
    let stands: Vec<bool> = ways(params).iter().map(|way| norm(*way) < WALKING_MPS).collect();
    let mut notes = Vec::new();
    for person in (0..params.shape().persons).filter(|&person| stands[person]) {
        let (own, profiles) = profiles(problem, config, params, person)?;
        let losses = through(&profiles, own);
        let stayed = profiles.iter().map(|of| of[0]).sum::<f64>() / profiles.len() as f64;
        let Some((angle, lowest)) =
            chosen(&losses, stayed).filter(|(_, lowest)| *lowest <= MOST_UNLIKE || config.objective != EmLoss::NccDb)
        else {
            continue;
        };
        turn_person(problem, params, person, angle);
        let degrees = if angle > PI { angle - TAU } else { angle }.to_degrees();
        notes.push(format!("heading: turned by {degrees:.0}°, where the loss is {lowest:.3} instead of {stayed:.3}"));
    }
    Ok(notes)
}

fn turn_person(problem: &Problem, params: &mut Pppr, person: usize, angle: f64) {
    let joints = params.shape().joints;
    let hips = hips_of(problem, params, person, joints);
    let [positions, velocities] = params.motion_mut();
    for joint in person * joints..(person + 1) * joints {
        positions[joint] = turned_about(hips, angle, positions[joint]);
        velocities[joint] = turned_about([0.0; 3], angle, velocities[joint]);
    }
}

/// L_EM at each heading of a person in each frame, in the order of time, and which of them is the one that is fitted.
fn profiles(
    problem: &Problem,
    config: &FitConfig,
    params: &Pppr,
    person: usize,
) -> Result<(usize, Vec<Headings>), FitError> {
    let em_region = match config.em_region {
        EmRegion::Full => EmRegion::Full,
        EmRegion::HalfWidth(half_m) => EmRegion::HalfWidth(half_m.min(AROUND_M)),
    };
    let all = problem.neighbours_in(config.frames_around);
    let near: Vec<usize> = (0..all.len()).filter(|&k| all[k].offset_s.abs() <= NEAR_S).collect();
    let own = near.partition_point(|&k| all[k].offset_s < 0.0);
    let reduced = ReducedViews::new(problem, config, params);
    let centre = region::centres(params)[person];
    let (regions, _) = region::regions(reduced.views(), em_region, &[centre])?;
    let turned: Vec<Pppr> = (0..HEADINGS)
        .map(|k| {
            let mut turned = params.clone();
            turn_person(problem, &mut turned, person, TAU * k as f64 / HEADINGS as f64);
            turned
        })
        .collect();
    let profile = |frame: Option<usize>| -> Headings {
        let em = reduced.compared(frame, &regions, (config, Precision::F32), None);
        std::array::from_fn(|k| em.loss((&problem.radar, config), Precision::F32, &turned[k]))
    };
    let mut frames: Vec<Option<usize>> = near.into_iter().map(Some).collect();
    frames.insert(own, None);
    Ok((own, frames.into_iter().map(profile).collect()))
}

/// Of each heading in frame `own`, the mean loss of the best path through all frames that has it there.
fn through(profiles: &[Headings], own: usize) -> Headings {
    let onwards = |costs: Headings, next: &Headings| -> Headings {
        std::array::from_fn(|k| {
            let turns = (0..=2 * MOST_TURN).map(|turn| {
                let from = (k + HEADINGS + turn - MOST_TURN) % HEADINGS;
                costs[from] + TURN * turn.abs_diff(MOST_TURN) as f64
            });
            next[k] + turns.fold(f64::INFINITY, f64::min)
        })
    };
    let before = profiles[..=own].iter().skip(1).fold(profiles[0], onwards);
    let last = profiles[profiles.len() - 1];
    let after = profiles[own..].iter().rev().skip(1).fold(last, onwards);
    std::array::from_fn(|k| (before[k] + after[k] - profiles[own][k]) / profiles.len() as f64)
}

/// The angle, rad, to turn by and the loss there; `None` where staying, whose loss is `stayed`, is as good.
fn chosen(losses: &Headings, stayed: f64) -> Option<(f64, f64)> {
    let angle = |k: usize| TAU * k as f64 / HEADINGS as f64;
    let behind = |k: usize| angle(k).min(TAU - angle(k)) > FRAC_PI_2 + 1e-9;
    let lowest = |farther: bool| {
        let there = (0..HEADINGS).filter(move |&k| behind(k) == farther);
        there.min_by(|&a, &b| losses[a].total_cmp(&losses[b])).map(|k| (k, losses[k]))
    };
    let (ahead, back) = (lowest(false)?, lowest(true)?);
    let (k, loss) = if back.1 < BEHIND * ahead.1 { back } else { ahead };
    if k == 0 || loss.is_nan() || loss >= CLEARER * stayed {
        return None;
    }
    // A parabola through it and the headings beside it.
    let (before, after) = (losses[(k + HEADINGS - 1) % HEADINGS], losses[(k + 1) % HEADINGS]);
    let bend = before - 2.0 * loss + after;
    let between = if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some(((k as f64 + between) * TAU / HEADINGS as f64, loss))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lowest at a heading, and less low at its opposite.
    fn losses(at_deg: f64, opposite: f64) -> Headings {
        std::array::from_fn(|k| {
            let apart = (360.0 * k as f64 / HEADINGS as f64 - at_deg).to_radians();
            0.2 - 0.1 * apart.cos().max(0.0).powi(2) - (0.2 - opposite) * (-apart.cos()).max(0.0).powi(2)
        })
    }

    fn found(losses: &Headings) -> Option<(f64, f64)> {
        chosen(losses, losses[0])
    }

    #[test]
    fn a_side_is_found_between_the_headings_that_are_tried() {
        let (angle, loss) = found(&losses(52.0, 0.11)).unwrap_or_default();
        assert!((angle.to_degrees() - 52.0).abs() < 2.0, "{}", angle.to_degrees());
        assert!(loss < 0.11);
    }

    #[test]
    fn a_back_is_turned_only_where_that_is_clearly_better() {
        assert_eq!(found(&losses(180.0, 0.105)), None, "0.1 behind, 0.105 as it stands");
        let (angle, _) = found(&losses(180.0, 0.15)).unwrap_or_default();
        assert!((angle - PI).abs() < 0.05);
        assert_eq!(found(&losses(0.0, 0.11)), None);
        assert_eq!(found(&[0.3; HEADINGS]), None);
        assert_eq!(found(&[f64::NAN; HEADINGS]), None);
    }

    #[test]
    fn one_frame_that_misleads_is_outvoted_and_a_turn_is_followed() {
        let true_deg = |frame: usize| 30.0 + 12.0 * frame as f64;
        let mut profiles: Vec<Headings> = (0..7).map(|frame| losses(true_deg(frame), 0.105)).collect();
        profiles[3] = losses(true_deg(3) + 180.0, 0.105);
        for own in [0, 3, 6] {
            let (angle, _) = chosen(&through(&profiles, own), 0.2).unwrap_or_default();
            let apart = (angle.to_degrees() - true_deg(own) + 180.0).rem_euclid(360.0) - 180.0;
            assert!(apart.abs() < 12.0, "frame {own}: {apart}°");
        }
    }
}
