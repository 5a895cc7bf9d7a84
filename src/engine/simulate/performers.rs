//! Who is in a sequence, what they do, and where: drawn until everybody stays on the stage and keeps their distance.

use super::{Action, Recipe};
use crate::body::{Build, Gait, Motion, Path, Performer};
use rand::{Rng, rngs::StdRng};
use std::f64::consts::{PI, TAU};

/// Draws for one person before the best so far is taken.
const TRIES: usize = 300;
/// Times of a sequence at which places are checked.
const CHECKS: usize = 6;
/// People are not nearer than this to the side of the maps, m.
const MARGIN_M: f64 = 0.30;
/// Largest angle off boresight on the floor plan, tangent.
const WIDEST: f64 = 1.0;

/// Where people may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage {
    /// From the radar, m.
    pub(super) distance_m: [f64; 2],
    /// y, m.
    pub(super) lateral_m: [f64; 2],
    pub(super) floor_z_m: f64,
    /// How long the sequence lasts, s.
    pub(super) lasts_s: f64,
}

/// Draws `count` people.
pub(super) fn draw_performers(
    recipe: &Recipe,
    actions: &[Action],
    count: usize,
    stage: &Stage,
    rng: &mut StdRng,
) -> Vec<Performer> {
    let mut people: Vec<Performer> = Vec::with_capacity(count);
    for _ in 0..count {
        let action = actions[rng.random_range(0..actions.len())];
        let mut best: Option<(f64, Performer)> = None;
        for _ in 0..TRIES {
            let candidate = draw(recipe, action, stage, people.last(), rng);
            let fault = fault(&candidate, recipe, stage, &people);
            if best.as_ref().is_none_or(|(least, _)| fault < *least) {
                best = Some((fault, candidate));
            }
            if fault <= 0.0 {
                break;
            }
        }
        people.extend(best.map(|(_, performer)| performer));
    }
    people
}

/// Who acts before the radar looks at it within this angle, rad.
const FACING_SPREAD_RAD: f64 = 0.5;

/// One person, near `neighbour` where there is one.
fn draw(recipe: &Recipe, action: Action, stage: &Stage, neighbour: Option<&Performer>, rng: &mut StdRng) -> Performer {
    let build = Build { height_m: rng.random_range(1.50..1.95), girth: rng.random_range(0.85..1.25) };
    let place = match neighbour {
        None => {
            let distance = rng.random_range(stage.distance_m[0]..stage.distance_m[1]);
            let widest = WIDEST.atan();
            let angle: f64 = rng.random_range(-widest..widest);
            [distance * angle.cos(), distance * angle.sin()]
        }
        Some(other) => {
            let [x, y] = middle(other, stage);
            let apart = rng.random_range(recipe.apart_m[0]..recipe.apart_m[1]);
            let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
            [x + apart * cos, y + apart * sin]
        }
    };
    let heading_rad = heading(action, place, rng);
    let phase = rng.random_range(0.0..1.0);
    let motion = motion(recipe, action, place, heading_rad, stage, rng);
    Performer { build, floor_z_m: stage.floor_z_m, place, heading_rad, phase, motion }
}

/// Who walks or turns looks anywhere; who acts on the spot does so before the radar, as the people of the data sets do.
fn heading(action: Action, place: [f64; 2], rng: &mut StdRng) -> f64 {
    let share = rng.random_range(0.0..1.0);
    match action {
        Action::Walk | Action::Turn => TAU * share,
        Action::Sit | Action::Raise | Action::Stand | Action::Fall => {
            (-place[1]).atan2(-place[0]) + FACING_SPREAD_RAD * (2.0 * share - 1.0)
        }
    }
}

fn motion(
    recipe: &Recipe,
    action: Action,
    place: [f64; 2],
    heading_rad: f64,
    stage: &Stage,
    rng: &mut StdRng,
) -> Motion {
    match action {
        Action::Walk => {
            let speed_mps = rng.random_range(recipe.speed_mps[0]..recipe.speed_mps[1]);
            let length = speed_mps * stage.lasts_s;
            let turn_rad: f64 = if rng.random_bool(0.6) { rng.random_range(-PI..PI) } else { 0.0 };
            // The middle of the way is near `place`.
            let start = [place[0] - 0.5 * length * heading_rad.cos(), place[1] - 0.5 * length * heading_rad.sin()];
            let path = Path {
                start,
                heading_rad,
                speed_mps,
                straight_m: rng.random_range(0.0..0.6) * length,
                turn_m: rng.random_range(0.8..1.6),
                turn_rad,
            };
            // Longer strides at higher speed: about the root of it, as people do.
            let stride_hz = 0.84 * speed_mps.sqrt() * rng.random_range(0.95..1.05);
            Motion::Walk(Gait { stride_hz, phase: rng.random_range(0.0..1.0), path })
        }
        Action::Turn => {
            let way = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            Motion::Turn { rate_radps: way * rng.random_range(0.6..1.8), step_hz: rng.random_range(0.6..1.0) }
        }
        Action::Sit => Motion::Sit { rate_hz: rng.random_range(0.16..0.28) },
        Action::Raise => {
            let both = rng.random_bool(0.6);
            let first = rng.random_range(1.4..2.9);
            let second = if both { first } else { 0.0 };
            let reach_rad = if rng.random_bool(0.5) { [first, second] } else { [second, first] };
            Motion::Raise { rate_hz: rng.random_range(0.25..0.55), reach_rad, sideways: rng.random_bool(0.5) }
        }
        Action::Stand => Motion::Stand,
        Action::Fall => Motion::Fall {
            begins_s: rng.random_range(0.0..0.5) * stage.lasts_s,
            lasts_s: rng.random_range(1.2..1.6),
            towards_rad: rng.random_range(0.0..TAU),
        },
    }
}

/// The middle of the hips (x, y) halfway through, m.
fn middle(performer: &Performer, stage: &Stage) -> [f64; 2] {
    hips(performer, 0.5 * stage.lasts_s)
}

fn hips(performer: &Performer, t: f64) -> [f64; 2] {
    let joints = performer.pose(t).joints;
    [0, 1].map(|k| 0.5 * (joints[11][k] + joints[12][k]))
}

/// By how many metres a person leaves the stage or is too near to or too far from the others, at most; 0 is fine.
fn fault(candidate: &Performer, recipe: &Recipe, stage: &Stage, others: &[Performer]) -> f64 {
    let mut worst = 0.0f64;
    for check in 0..CHECKS {
        let t = stage.lasts_s * check as f64 / (CHECKS - 1) as f64;
        let [x, y] = hips(candidate, t);
        let distance = x.hypot(y);
        worst = worst.max(stage.distance_m[0] - distance).max(distance - stage.distance_m[1]);
        worst = worst.max(stage.lateral_m[0] + MARGIN_M - y).max(y - stage.lateral_m[1] + MARGIN_M);
        worst = worst.max(y.abs() - WIDEST * x);
        let nearest = others
            .iter()
            .map(|other| {
                let [a, b] = hips(other, t);
                (x - a).hypot(y - b)
            })
            .fold(f64::INFINITY, f64::min);
        if nearest.is_finite() {
            // Too near for two bodies weighs more than too far for a group.
            worst = worst.max(3.0 * (recipe.apart_m[0] - nearest)).max(0.5 * (nearest - recipe.apart_m[1] - 0.3));
        }
    }
    worst
}
