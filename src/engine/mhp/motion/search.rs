//! Where a fit in a window begins: clusters of the prior and headings, coarse, then the best of them fine.
//!
//! Clusters stand, walk and sit; of one person alone bodies that lie and, where it moves, fall are tried beside them (`tilt.rs`).
//! The more promising starts are moved a little with their poses held, by few points of skin; the few with the lowest loss are fitted
//! with it, and in the end with the bodies that a network expects, by the bend of the loss ([`lbfgs`]). What wins is the start; the
//! runner-up with another heading and how far it is behind are told, for a body seen from behind is a hypothesis, not an error. So is
//! what the network expects, as it says it.

use super::hypothesis::{Hypothesis, Searched, away, sort_by_loss, spin};
use super::{
    BODY, Detail, HEIGHT, Held, LN_SIZE, MotionState, STILL, TILT, UNITS, Window, WindowLoss, YAW, kind, lbfgs, tilt,
    ways,
};
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::geometry::{Vec3, mean, mean_distance, norm, sub};
use crate::mhp::skin::{Skin, radar_place};
use crate::mhp::{FitError, Precision, Problem, tiles};
use std::f64::consts::PI;
use std::iter::zip;
use std::ops::Range;

/// The sieves that starts go through, coarse then fine.
const SIEVES: [Sieve; 3] = [
    Sieve { moved: 0.3, steps: 4, every: 4, coarse: true, way: Way::Held, kept: 5 },
    Sieve { moved: 1.0, steps: 7, every: 2, coarse: false, way: Way::Free, kept: 4 },
    Sieve { moved: 1.0, steps: 7, every: 2, coarse: false, way: Way::Bent, kept: 3 },
];
/// Evaluations of what is left, and of each body that is carried on from another frame.
const FINE: usize = 9;
/// What a search may cost: Gaussians times cells, over all frames and evaluations. A map of 256 × 128 cells as a whole, five frames of
/// two views, takes all the starts of the recommended settings.
const MOST_WORK: f64 = 2e10;
/// Where every cell is summed by itself each costs so many.
const PLAIN: f64 = 10.0;
/// Evaluations of a person's search beside those of the first sieve, with those of what is carried on and of what the network
/// expects, and those of a start in it, in whole windows.
const LATER: f64 = 176.0;
const FIRST: f64 = 3.0 / 4.0;
/// w_EM and w_prior of a search, whatever those of the fit are: settings that weigh terms share their start, but for what a network
/// expects, whose weight says whether it is asked.
const WEIGHTS: [f64; 2] = [0.5, 8e-3];
/// Starts whose joints have come nearer to each other than this, on average, have become one, m.
const ONE_M: f64 = 0.03;
/// Of the bodies that fall or lie, those with the lowest loss that are tried beside the others.
const FALLEN: usize = 4;
/// A body that is tilted farther is tried on its other sides, rad.
const LIES_RAD: f64 = 0.3;
/// What a body that a network calls e times less likely than another has more than its loss of 1.
const UNLIKELIER: f64 = 0.25;
/// What a metre between the middle of a body and that of the start counts of L_EM: echo shows where somebody is to a few
/// centimetres, and a body that has to be elsewhere explains something else.
const OF_WAY: f64 = 0.4;
/// The share of the start's L_EM below which another place is believed even where the pose there is not, and how far it may be, m.
const CLEARER: f64 = 0.85;
const MOST_MOVED_M: f64 = 0.5;

/// Moves starts by some steps and keeps the few with the lowest loss.
struct Sieve {
    /// The share of the starts that are moved: those with the lowest loss where they begin.
    moved: f64,
    steps: usize,
    /// Every so manyth frame is looked at.
    every: usize,
    /// Whether the body has few points of skin.
    coarse: bool,
    way: Way,
    kept: usize,
}

/// How a sieve moves starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// By steps of Adam, with poses held, so that place, heading and size alone move.
    Held,
    /// By steps of Adam.
    Free,
    /// By the bend of the loss.
    Bent,
}

/// A start on its way.
#[derive(Clone)]
struct Tried {
    state: MotionState,
    loss: f64,
    /// Its parts, unweighted.
    em: f64,
    prior: f64,
    network: f64,
}

impl Tried {
    fn at(coordinates: Vec<f64>) -> Self {
        Self { state: MotionState::at(coordinates), loss: f64::INFINITY, em: 0.0, prior: 0.0, network: 0.0 }
    }

    /// Takes what is found where it is lower.
    fn take(&mut self, loss: f64, parts: &WindowLoss) -> bool {
        let better = loss.is_finite() && loss < self.loss;
        if better {
            (self.loss, self.em, self.prior, self.network) = (loss, parts.em, parts.prior, parts.network);
        }
        better
    }
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
    /// Whether frames are given bodies with few points of skin, and the skin that each has not now, once it was asked for.
    coarse: bool,
    other_skins: Vec<Option<Skin>>,
}

impl<'a> Search<'a> {
    /// Among the poses of `window`, as settings with [`WEIGHTS`] compare them.
    fn new((problem, config): (&'a Problem, &'a FitConfig), window: &'a mut Window, params: &'a Pppr) -> Self {
        Self {
            problem,
            config,
            window,
            params,
            loss: WindowLoss::default(),
            next: MotionState::default(),
            every: 1,
            coarse: false,
            other_skins: Vec::new(),
        }
    }

    /// Looks at every so manyth frame from now on, at a body with few points or many.
    fn look(&mut self, every: usize, coarse: bool) {
        self.every = every;
        if coarse != self.coarse {
            let Self { window, other_skins, problem, .. } = self;
            if other_skins.is_empty() {
                other_skins.extend(window.frames.iter().map(|frame| frame.em.coarse_skin(&problem.skeleton)));
            }
            zip(&mut window.frames, other_skins).for_each(|(frame, other)| frame.em.change_skin(other));
            self.coarse = coarse;
        }
    }

    fn evaluate(&mut self, coordinates: &[f64]) -> f64 {
        let how = (self.problem, self.config);
        self.window.evaluate_some(self.every, how, Precision::F32, (coordinates, self.params), None, &mut self.loss);
        self.config.w_em * self.loss.em + self.config.w_prior * self.loss.prior + self.config.w_net * self.loss.network
    }

    /// Takes `steps` from a start, its pose `held` or not, and stays at the best that is met.
    fn descend(&mut self, tried: &mut Tried, steps: usize, held: bool) {
        let mut state = tried.state.clone();
        let mut best = state.coordinates.clone();
        for step in 0..=steps {
            let loss = self.evaluate(&state.coordinates);
            if tried.take(loss, &self.loss) {
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

    /// Lowers the loss of a start by the bend that it meets.
    fn settle(&mut self, tried: &mut Tried, evaluations: usize) {
        let stride = self.window.stride;
        let units: Vec<f64> = (0..tried.state.coordinates.len()).map(|k| UNITS[kind(k % stride)]).collect();
        let mut coordinates = std::mem::take(&mut tried.state.coordinates);
        lbfgs::minimise(&mut coordinates, &units, evaluations, |coordinates, gradient| {
            let found = self.evaluate(coordinates);
            tried.take(found, &self.loss);
            gradient.clone_from(&self.loss.gradient);
            found
        });
        tried.state = MotionState::at(coordinates);
    }

    /// Where a start ended.
    fn hypothesis(&self, tried: &Tried, person: usize) -> Hypothesis {
        let mut placed = self.params.clone();
        self.window.place(&tried.state.coordinates, &mut placed);
        let joints = placed.shape().joints;
        let own = person * joints..(person + 1) * joints;
        let middle = mean(placed.person(person));
        let way = sub(middle, mean(self.params.person(person)));
        let velocities = placed.velocities()[own.clone()].to_vec();
        let yaw = tried.state.coordinates[person * self.window.stride + YAW];
        let to_radar = sub(radar_place(&self.problem.views), middle);
        let mine = &tried.state.coordinates[person * self.window.stride..];
        let upright = mine[TILT].hypot(mine[TILT + 1]).cos().max(0.0);
        let [away, averted] = away(yaw, &velocities, to_radar).map(|share| upright * share);
        let network = self.config.w_net * tried.network;
        Hypothesis {
            loss: tried.loss - network,
            network,
            unlikeness: super::unlikeness(self.config, tried.em, tried.prior / self.window.scarcity)
                + OF_WAY * way[0].hypot(way[1]),
            yaw,
            away: 1.0 - upright + away,
            averted,
            spin: spin(&placed.positions()[own.clone()], &velocities),
            joints: placed.positions()[own.clone()].to_vec(),
            velocities,
            beta: placed.group(Group::Beta)[own].to_vec(),
            still: tried.state.coordinates[person * self.window.stride + STILL],
        }
    }

    /// The most promising of the bodies that fall or lie, of a person that goes this way, m/s, with its hips about here, m, the radar
    /// so high above the floor, m.
    fn fallen(
        &mut self,
        coordinates: &[f64],
        own: Range<usize>,
        (hips, radar_height_m, way): (Vec3, Option<f64>, Vec3),
    ) -> Vec<Tried> {
        self.look(SIEVES[0].every, SIEVES[0].coarse);
        let mut all: Vec<(f64, Tried)> = tilt::fallen(way)
            .map(|fallen| {
                let mut of = coordinates.to_vec();
                self.window.space.lay(&mut of[own.clone()], &fallen, hips, radar_height_m);
                (self.evaluate(&of), Tried::at(of))
            })
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().take(FALLEN).map(|(_, tried)| tried).collect()
    }

    /// The bodies that the network expects a person to be, the others as in `coordinates`, each with ln of its chance.
    fn expected(&self, coordinates: &[f64], person: usize) -> Vec<(f64, Tried)> {
        let own = person * self.window.stride..(person + 1) * self.window.stride;
        let starts = self.window.expected(person).into_iter().flat_map(|expected| expected.starts(person, self.params));
        let tried = |(ln_chance, start): (f64, Pppr)| {
            let mut of = coordinates.to_vec();
            of[own.clone()].copy_from_slice(&self.window.coordinates_of(&start)[own.clone()]);
            of[own.start + STILL] = coordinates[own.start + STILL];
            (ln_chance, Tried::at(of))
        };
        starts.map(tried).collect()
    }

    /// These bodies as they are: their losses are how unlikely the network calls them.
    fn said(&self, expected: &[(f64, Tried)], person: usize) -> Vec<Hypothesis> {
        let best = expected.iter().map(|(ln_chance, _)| *ln_chance).fold(f64::NEG_INFINITY, f64::max);
        let loss = |ln_chance: f64| 1.0 + UNLIKELIER * (best - ln_chance);
        let body =
            |(ln_chance, tried): &(f64, Tried)| Hypothesis { loss: loss(*ln_chance), ..self.hypothesis(tried, person) };
        let mut said: Vec<Hypothesis> = expected.iter().map(body).collect();
        said.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        said
    }

    /// What a sieve leaves of `all`, the best first; of those that have become one, one.
    fn sift(&mut self, all: &mut Vec<Tried>, sieve: &Sieve, own: &Range<usize>) {
        self.look(sieve.every, sieve.coarse);
        if sieve.moved < 1.0 {
            for tried in &mut *all {
                tried.loss = self.evaluate(&tried.state.coordinates);
            }
            all.sort_by(|a, b| a.loss.total_cmp(&b.loss));
            all.truncate(((sieve.moved * all.len() as f64).ceil() as usize).max(sieve.kept));
        }
        for tried in &mut *all {
            // What was seen of fewer frames is no measure any more.
            tried.loss = f64::INFINITY;
            match sieve.way {
                Way::Bent => self.settle(tried, sieve.steps),
                way => self.descend(tried, sieve.steps, way == Way::Held),
            }
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
        let apart_m = ends.map(|frame| {
            for (of, pose) in [a, b].into_iter().zip(&mut poses) {
                let (mine, space) = (&of.state.coordinates[own.clone()], &self.window.space);
                space.pose(mine, &space.stance(mine), frame, pose);
            }
            mean_distance(&poses[0], &poses[1])
        });
        f64::midpoint(apart_m[0], apart_m[1])
    }
}

/// Searches around `params`, one person after the other.
///
/// # Errors
/// Where a position is not finite.
pub(in crate::mhp) fn search(
    problem: &Problem,
    config: &FitConfig,
    params: &Pppr,
) -> Result<Result<Searched, Held>, FitError> {
    let config = &weighted(config);
    let mut window = match Window::new(problem, config, (Precision::F32, Detail::Search), params)? {
        Ok(window) => window.ask(problem, config, params),
        Err(held) => return Ok(Err(held)),
    };
    let Some(most_starts) = affordable(&window, config, params) else { return Ok(Err(Held::Large)) };
    let mut coordinates = window.coordinates_of(params);
    let mut found = WindowLoss::default();
    window.choose_brightness((problem, config), Precision::F32, (&mut coordinates, params), &mut found);
    let (stride, joints) = (window.stride, params.shape().joints.max(1));
    let ways = ways(params);
    let walks: Vec<bool> = ways.iter().map(|way| way[0].hypot(way[1]) > 0.5).collect();
    let (floor, grounded) = (problem.radar.height_m, window.space.ground.is_some());
    let starts = window.space.starts.clone();
    let mut search = Search::new((problem, config), &mut window, params);
    let begun = search.evaluate(&coordinates);
    let begun_em = search.loss.em;
    let mut persons: Vec<Vec<Hypothesis>> = Vec::with_capacity(params.shape().persons);
    let mut expected: Vec<Vec<Hypothesis>> = Vec::with_capacity(params.shape().persons);
    for person in 0..params.shape().persons {
        let own = person * stride..(person + 1) * stride;
        let hips = hips_of(problem, params, person, joints);
        let mut all = vec![Tried::at(coordinates.clone())];
        let turns: &[f64] = if walks[person] { &[0.0, PI] } else { &[0.0, 0.5 * PI, PI, 1.5 * PI] };
        for (c, hip_height) in starts.iter().take(config.starts.min(most_starts).saturating_sub(1)) {
            for turn in turns {
                let mut of = coordinates.clone();
                let mine = &mut of[own.clone()];
                mine[BODY..].copy_from_slice(c);
                mine[YAW] += turn;
                mine[..3].copy_from_slice(&hips);
                if grounded {
                    mine[HEIGHT] = 0.0;
                } else if let Some(height_m) = floor {
                    mine[HEIGHT] = hip_height * mine[LN_SIZE].exp() - height_m;
                }
                all.push(Tried::at(of));
            }
        }
        // Among several, who lies would lie through others.
        if params.shape().persons == 1 {
            all.extend(search.fallen(&coordinates, own.clone(), (hips, floor, ways[person])));
        }
        let of_network = search.expected(&coordinates, person);
        expected.push(search.said(&of_network, person));
        let [coarse @ .., last] = &SIEVES;
        for sieve in coarse {
            search.sift(&mut all, sieve, &own);
        }
        // What the network expects needs no way there.
        all.extend(of_network.iter().map(|(_, tried)| tried.clone()));
        search.sift(&mut all, last, &own);
        search.look(1, false);
        for tried in &mut all {
            tried.loss = f64::INFINITY;
            search.settle(tried, FINE);
        }
        // A stride with the other leg in front looks much the same from afar, and so does a back.
        if let Some(best) = all.iter().min_by(|a, b| a.loss.total_cmp(&b.loss)) {
            let found = best.state.coordinates.clone();
            let mut others = vec![found.clone()];
            search.window.space.mirror(&mut others[0][own.clone()]);
            let tilted = found[own.start + TILT].hypot(found[own.start + TILT + 1]) > LIES_RAD;
            let sides: &[f64] = match () {
                () if tilted => &[0.5 * PI, PI, 1.5 * PI],
                () if walks[person] => &[],
                () => &[PI],
            };
            for side in sides {
                let mut rolled = found.clone();
                tilt::roll(&mut rolled[own.clone()], *side);
                others.push(rolled);
            }
            for of in others {
                let mut tried = Tried::at(of);
                search.settle(&mut tried, FINE);
                all.push(tried);
            }
        }
        all.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        if let Some(best) = all.first() {
            coordinates.clone_from(&best.state.coordinates);
        }
        let mut ends: Vec<Hypothesis> = all.iter().map(|tried| search.hypothesis(tried, person)).collect();
        // Of maps that no body explains the search ends anywhere; a path can go through what the network expects there.
        for (_, mut tried) in of_network {
            let loss = search.evaluate(&tried.state.coordinates);
            tried.take(loss, &search.loss);
            ends.push(search.hypothesis(&tried, person));
        }
        sort_by_loss(&mut ends);
        persons.push(ends);
    }
    search.look(1, false);
    search.evaluate(&coordinates);
    let em = search.loss.em;
    // Among reflectors that nothing is known of, another place may be theirs.
    let clearer = window.clear && em < CLEARER * begun_em;
    let moved = (0..persons.len()).map(|k| if clearer { way(problem, params, k, &persons[k]) } else { [0.0; 3] });
    let moved = moved.collect();
    Ok(Ok(Searched { begun, moved, persons, expected, network: window.expected }))
}

/// Adds to what a search around the one person of these `params` ended at what bodies of other frames become in this one, each with its
/// time, s after this frame, moved and turned as it goes as a whole; those that are nearer than [`ONE_M`] to another are left out.
///
/// # Errors
/// Where a position is not finite.
pub(in crate::mhp) fn carry_on(
    problem: &Problem,
    config: &FitConfig,
    params: &Pppr,
    searched: &mut Searched,
    others: &[(f64, &Hypothesis)],
) -> Result<(), FitError> {
    let Some(found) = searched.persons.first_mut() else { return Ok(()) };
    // What begins where another body is already is left to it.
    let mut starts: Vec<Hypothesis> = Vec::with_capacity(others.len());
    for (t_s, other) in others {
        let joints = tilt::later(&other.joints, &other.velocities, -t_s);
        if found.iter().chain(&starts).all(|body| mean_distance(&body.joints, &joints) > ONE_M) {
            starts.push(Hypothesis { joints, ..(*other).clone() });
        }
    }
    if starts.is_empty() {
        return Ok(());
    }
    let config = &weighted(config);
    let Ok(mut window) = Window::new(problem, config, (Precision::F32, Detail::Search), params)? else { return Ok(()) };
    window.expected.clone_from(&searched.network);
    let mut search = Search::new((problem, config), &mut window, params);
    for start in starts {
        let mut moved = params.clone();
        start.place(0, &mut moved);
        let mut coordinates = search.window.coordinates_of(&moved);
        coordinates[STILL] = start.still;
        let mut tried = Tried::at(coordinates);
        search.settle(&mut tried, FINE);
        found.push(search.hypothesis(&tried, 0));
    }
    sort_by_loss(found);
    Ok(())
}

/// The settings, with a search's weights.
fn weighted(config: &FitConfig) -> FitConfig {
    let [w_em, w_prior] = WEIGHTS;
    FitConfig { w_em, w_prior, ..*config }
}

/// How many starts a search of these persons may have; `None` where one is too many: nothing that is asked for takes minutes.
fn affordable(window: &Window, config: &FitConfig, params: &Pppr) -> Option<usize> {
    let each = if tiles::holds(config.softness) { 1.0 } else { PLAIN };
    let work: f64 = window.frames.iter().map(|frame| frame.em.work(params)).sum::<f64>() * each;
    let evaluations = MOST_WORK / work.max(1.0) / params.shape().persons.max(1) as f64;
    // Who stands is tried in four headings.
    (evaluations >= LATER).then(|| ((evaluations - LATER) / (4.0 * FIRST)) as usize + 1)
}

/// The way from where a person is to where its best hypothesis is, where that is no farther than [`MOST_MOVED_M`]: maps with few
/// looks are explained well by no pose, and still tell the place better than what is lit does.
fn way(problem: &Problem, params: &Pppr, person: usize, found: &[Hypothesis]) -> Vec3 {
    let joints = params.shape().joints.max(1);
    let mut there = params.clone();
    found.iter().take(1).for_each(|best| best.place(person, &mut there));
    let [from, to] = [params, &there].map(|of| hips_of(problem, of, person, joints));
    let way = sub(to, from);
    if norm(way) <= MOST_MOVED_M { way } else { [0.0; 3] }
}

/// The middle of a person's hips, or of all its joints where it has none, world frame, m.
pub(super) fn hips_of(problem: &Problem, params: &Pppr, person: usize, joints: usize) -> [f64; 3] {
    let named = (0..joints).filter(|&joint| crate::body::is_named(&problem.skeleton, joint, &["hip", "pelvis"]));
    let hips: Vec<_> = named.map(|joint| params.position(person * joints + joint)).collect();
    if hips.is_empty() { crate::geometry::mean(params.person(person)) } else { crate::geometry::mean(&hips) }
}
