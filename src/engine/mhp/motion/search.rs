//! Where a fit in a window begins: clusters of the prior and headings, coarse, then the best of them fine.
//!
//! Every start is moved a little with its pose held; the few with the lowest loss are fitted with it. What wins is the start; the
//! runner-up with another heading and how far it is behind are told, for a body seen from behind is a hypothesis, not an error.

use super::{BODY, Held, LN_SIZE, MotionState, Window, WindowLoss, YAW, ways};
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::geometry::{add, norm, sub};
use crate::mhp::{FitError, Precision, Problem, tiles};
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// The sieves that starts go through, coarse then fine.
const SIEVES: [Sieve; 3] = [
    Sieve { steps: 6, every: 4, held: true, kept: 8 },
    Sieve { steps: 6, every: 2, held: false, kept: 4 },
    Sieve { steps: 14, every: 1, held: false, kept: 2 },
];
/// Steps of what is left.
const FINE: usize = 28;
/// What a search may cost: Gaussians times cells, over all frames and evaluations. A map of 256 × 128 cells as a whole, five frames of
/// two views, takes all the starts of the recommended settings.
const MOST_WORK: f64 = 2e10;
/// Where every cell is summed by itself each costs so many.
const PLAIN: f64 = 10.0;
/// Evaluations of a person's search beside those of the first sieve, and those of a start in it, in whole windows.
const LATER: f64 = 250.0;
const FIRST: f64 = 7.0 / 4.0;
/// Starts whose joints have come nearer to each other than this, on average, have become one, m.
const ONE_M: f64 = 0.03;
/// A heading whose loss is larger by a smaller share than this is as good.
const AMBIGUOUS: f64 = 0.1;
/// Headings farther apart than this are different ones.
const ANOTHER_HEADING: f64 = PI / 3.0;
/// The share of the start's L_EM below which another place is believed even where the pose there is not, and how far it may be, m.
const CLEARER: f64 = 0.85;
const MOST_MOVED_M: f64 = 0.5;

/// Moves every start by some steps and keeps the few with the lowest loss.
struct Sieve {
    steps: usize,
    /// Every so manyth frame is looked at.
    every: usize,
    /// Whether poses are held, so that place, heading and size alone move.
    held: bool,
    kept: usize,
}

/// What a search found.
pub(in crate::mhp) struct Searched {
    /// The start's own loss, and that of what was found.
    pub(in crate::mhp) losses: [f64; 2],
    /// How far the best start that looks elsewhere is behind, share of its loss, and by how much it is turned, rad.
    pub(in crate::mhp) runner_up: Option<(f64, f64)>,
}

/// A start on its way.
#[derive(Clone)]
struct Tried {
    state: MotionState,
    loss: f64,
}

struct Search<'a> {
    problem: &'a Problem,
    config: &'a FitConfig,
    window: &'a mut Window,
    params: &'a Pppr,
    loss: WindowLoss,
    next: MotionState,
    /// Every so manyth frame is looked at.
    every: usize,
}

impl Search<'_> {
    fn evaluate(&mut self, coordinates: &[f64]) -> f64 {
        let how = (self.problem, self.config);
        self.window.evaluate_some(self.every, how, Precision::F32, (coordinates, self.params), None, &mut self.loss);
        self.config.w_em * self.loss.em + self.config.w_prior * self.loss.prior
    }

    /// Takes `steps` from a start, its pose `held` or not, and stays at the best that is met.
    fn descend(&mut self, tried: &mut Tried, steps: usize, held: bool) {
        let mut state = tried.state.clone();
        let mut best = state.coordinates.clone();
        for step in 0..=steps {
            let loss = self.evaluate(&state.coordinates);
            if loss.is_finite() && loss < tried.loss {
                tried.loss = loss;
                best.clone_from(&state.coordinates);
            }
            if step < steps {
                let stride = self.window.stride;
                let pace = if step as f64 > super::SLOW_FROM * steps as f64 { 0.5 } else { 1.0 };
                state.step_into(stride, &self.loss.gradient, pace, held, &mut self.next);
                std::mem::swap(&mut state, &mut self.next);
            }
        }
        tried.state = MotionState { coordinates: best, ..state };
    }

    /// What a sieve leaves of `all`, the best first; of those that have become one, one.
    fn sift(&mut self, all: &mut Vec<Tried>, sieve: &Sieve, own: &Range<usize>) {
        self.every = sieve.every;
        for tried in &mut *all {
            // What was seen of fewer frames is no measure any more.
            tried.loss = f64::INFINITY;
            self.descend(tried, sieve.steps, sieve.held);
        }
        all.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        let mut kept: Vec<Tried> = Vec::with_capacity(sieve.kept);
        for tried in all.drain(..) {
            if kept.len() < sieve.kept && kept.iter().all(|other| self.apart_m(&tried, other, own) > ONE_M) {
                kept.push(tried);
            }
        }
        *all = kept;
    }

    /// The mean distance between the joints of two starts at the window's ends, m.
    fn apart_m(&self, a: &Tried, b: &Tried, own: &Range<usize>) -> f64 {
        let joints = self.params.shape().joints;
        let mut poses = [vec![[0.0; 3]; joints], vec![[0.0; 3]; joints]];
        let ends = [0, self.window.frames.len() - 1];
        let apart = ends.map(|frame| {
            for (of, pose) in [a, b].into_iter().zip(&mut poses) {
                self.window.space.pose(&of.state.coordinates[own.clone()], frame, pose);
            }
            poses[0].iter().zip(&poses[1]).map(|(p, q)| norm(sub(*p, *q))).sum::<f64>()
        });
        apart.iter().sum::<f64>() / (ends.len() * joints.max(1)) as f64
    }
}

/// Searches around `params`, one person after the other, and puts them where it found them.
///
/// # Errors
/// Where a position is not finite.
pub(in crate::mhp) fn search(
    problem: &Problem,
    config: &FitConfig,
    params: &mut Pppr,
) -> Result<Result<Searched, Held>, FitError> {
    let mut window = match Window::new(problem, config, Precision::F32, params)? {
        Ok(window) => window,
        Err(held) => return Ok(Err(held)),
    };
    let Some(most_starts) = affordable(&window, config, params) else { return Ok(Err(Held::Large)) };
    let mut coordinates = window.coordinates_of(params);
    let mut found = WindowLoss::default();
    window.choose_brightness((problem, config), Precision::F32, (&mut coordinates, params), &mut found);
    let (stride, joints) = (window.stride, params.shape().joints.max(1));
    let walks: Vec<bool> = ways(params).iter().map(|way| way[0].hypot(way[1]) > 0.5).collect();
    let floor = problem.radar.height_m;
    let starts = window.space.starts.clone();
    let mut search = Search {
        problem,
        config,
        window: &mut window,
        params,
        loss: WindowLoss::default(),
        next: MotionState::default(),
        every: 1,
    };
    let begun = search.evaluate(&coordinates);
    let begun_em = search.loss.em;
    let mut answer = (begun, None);
    for person in 0..params.shape().persons {
        let own = person * stride..(person + 1) * stride;
        let hips = hips_of(problem, params, person, joints);
        let begun_at = Tried { state: MotionState::at(coordinates.clone()), loss: f64::INFINITY };
        let mut all = vec![begun_at.clone()];
        let turns: &[f64] = if walks[person] { &[0.0, PI] } else { &[0.0, 0.5 * PI, PI, 1.5 * PI] };
        for (c, hip_height) in starts.iter().take(config.starts.min(most_starts).saturating_sub(1)) {
            for turn in turns {
                let mut of = coordinates.clone();
                let mine = &mut of[own.clone()];
                mine[BODY..].copy_from_slice(c);
                mine[YAW] += turn;
                mine[..3].copy_from_slice(&hips);
                if let Some(height_m) = floor {
                    mine[2] = hip_height * mine[LN_SIZE].exp() - height_m;
                }
                all.push(Tried { state: MotionState::at(of), loss: f64::INFINITY });
            }
        }
        for sieve in &SIEVES {
            search.sift(&mut all, sieve, &own);
        }
        search.every = 1;
        // What the start itself becomes is among those that are compared in the end.
        let mut own_start = begun_at;
        search.descend(&mut own_start, SIEVES[0].steps, true);
        all.push(own_start);
        for tried in &mut all {
            tried.state = MotionState::at(tried.state.coordinates.clone());
            search.descend(tried, FINE, false);
        }
        // A stride with the other leg in front looks much the same from afar, and so does a back.
        if let Some(best) = all.iter().min_by(|a, b| a.loss.total_cmp(&b.loss)) {
            let found = best.state.coordinates.clone();
            let mut others = vec![found.clone()];
            search.window.space.mirror(&mut others[0][own.clone()]);
            if !walks[person] {
                let mut behind = found;
                behind[own.start + YAW] += PI;
                others.push(behind);
            }
            for of in others {
                let mut tried = Tried { state: MotionState::at(of), loss: f64::INFINITY };
                search.descend(&mut tried, FINE, false);
                all.push(tried);
            }
        }
        all.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        let Some(best) = all.first() else { continue };
        let yaw = |tried: &Tried| tried.state.coordinates[own.start + YAW];
        let turned = |tried: &Tried| {
            let turn = (yaw(tried) - yaw(best)).rem_euclid(TAU);
            turn.min(TAU - turn)
        };
        let runner_up = all.iter().find(|tried| turned(tried) > ANOTHER_HEADING);
        answer = (best.loss, runner_up.map(|tried| (tried.loss / best.loss - 1.0, turned(tried))));
        coordinates.clone_from(&best.state.coordinates);
    }
    search.every = 1;
    search.evaluate(&coordinates);
    let em = search.loss.em;
    if super::is_unlike(config, em, window.clear) {
        // Among reflectors that nothing is known of, another place may be theirs.
        if window.clear && em < CLEARER * begun_em {
            move_there(problem, &window, &coordinates, params);
        }
        return Ok(Err(Held::Unlike));
    }
    window.place(&coordinates, params);
    Ok(Ok(Searched { losses: [begun, answer.0], runner_up: answer.1 }))
}

/// How many starts a search of these persons may have; `None` where one is too many: nothing that is asked for takes minutes.
fn affordable(window: &Window, config: &FitConfig, params: &Pppr) -> Option<usize> {
    let each = if tiles::holds(config.softness) { 1.0 } else { PLAIN };
    let work: f64 = window.frames.iter().map(|frame| frame.em.work(params)).sum::<f64>() * each;
    let evaluations = MOST_WORK / work.max(1.0) / params.shape().persons.max(1) as f64;
    // Who stands is tried in four headings.
    (evaluations >= LATER).then(|| ((evaluations - LATER) / (4.0 * FIRST)) as usize + 1)
}

/// Moves the persons as they are to where the search found them, by no more than [`MOST_MOVED_M`]: maps with few looks are explained
/// well by no pose, and still tell the place better than what is lit does.
fn move_there(problem: &Problem, window: &Window, coordinates: &[f64], params: &mut Pppr) {
    let mut found = params.clone();
    window.place(coordinates, &mut found);
    let joints = params.shape().joints.max(1);
    for person in 0..params.shape().persons {
        let [from, to] = [&*params, &found].map(|of| hips_of(problem, of, person, joints));
        let way = sub(to, from);
        if norm(way) <= MOST_MOVED_M {
            for joint in person * joints..(person + 1) * joints {
                let moved = add(params.position(joint), way);
                params.set_vec3(Group::Position, joint, moved);
            }
        }
    }
}

/// The middle of a person's hips, or of all its joints where it has none, world frame, m.
pub(super) fn hips_of(problem: &Problem, params: &Pppr, person: usize, joints: usize) -> [f64; 3] {
    let named = (0..joints).filter(|&joint| crate::body::is_named(&problem.skeleton, joint, &["hip", "pelvis"]));
    let hips: Vec<_> = named.map(|joint| params.position(person * joints + joint)).collect();
    if hips.is_empty() { crate::geometry::mean(params.person(person)) } else { crate::geometry::mean(&hips) }
}

impl Searched {
    /// In words.
    pub(in crate::mhp) fn note(&self) -> String {
        let [from, to] = self.losses;
        let other = match self.runner_up {
            Some((behind, turned)) => {
                let doubt = if behind < AMBIGUOUS { "; heading ambiguous: " } else { "; " };
                format!("{doubt}turned by {:.0}° it is {:.1} % worse", turned.to_degrees(), 100.0 * behind)
            }
            None => String::new(),
        };
        format!("motion: loss {from:.3} → {to:.3}{other}")
    }
}
