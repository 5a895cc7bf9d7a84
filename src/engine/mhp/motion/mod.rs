//! A window of frames fitted as one: the body moves through a space of poses that real people have taught.
//!
//! With `parameterization = "motion"` a fit's coordinates are, for each person, place (where the floor is known, height above it:
//! [`ground`]), heading, size and tilt ([`tilt`]) in the middle of the window and the coefficients of `body::MotionPrior` ([`space`]).
//! They place the joints in all frames of the window at once; each frame compares its own maps (`mhp/frame_em.rs`), in which powers
//! along a Doppler axis have been added and what is finer across the sight than a limb has been blurred (`mhp/reduced.rs`), and
//!
//! ```text
//! L = w_EM · mean over frames of L_EM + w_kine · (…) + w_prior · L_prior + w_net · L_net + w_given · L_given
//! L_prior = W/F · ((ρ(c) + ((s − s₀)/σ_s)² + ((q − q₀)/σ_q)² + ρ_w(w, ẇ))/30 + mean over frames and bones of ((l/(e^s λ) − 1)/σ_b)² + ρ_h(h/σ_h))
//! ```
//!
//! where ρ(c) is −2 ln of how likely a Gaussian mixture has the first coefficients (`body::Mixture`), and the squares of the others.
//! F are the frames there are and W those that are asked for (`window`), for fewer frames are less evidence against a prior that
//! stays, but not against a network, which has seen no more of them. The parts behind it are those of the body's proportions
//! (`proportions.rs`) and of the floor (`ground.rs`); for several persons there is one for bodies that stand in one another or go
//! far from where they were counted (`apart.rs`). The kinematic terms, and L_given, are those of the frame that is fitted.
//! q says how bright what stands still is (`static_echo.rs`). PPPR stays the state that is shown, kept and exported: positions and
//! velocities follow the coordinates, and opacities do where the settings ask for it; scales and the rest move by themselves and
//! are the same in all frames of the window. The frame stands as near the window's middle as its
//! sequence lets it; without frames around the window is one frame. A start is searched from clusters of the prior and from
//! several headings, coarse then fine ([`search`]).

mod apart;
mod clutter;
mod decode;
mod ground;
mod hypothesis;
mod lbfgs;
mod proportions;
mod reduced;
mod search;
mod space;
mod static_echo;
#[cfg(test)]
mod tests;
mod tilt;
mod turn;

pub(super) use decode::{Decoded, Stage, carried, decode, lowest};
pub(super) use hypothesis::{Hypothesis, Searched};
pub(super) use reduced::ReducedViews;
pub(super) use search::{carry_on, search};
pub(super) use tilt::later;
pub(super) use turn::turn;

use super::frame_em::FrameEm;
use super::pose_network::Expected;
use super::region;
use super::{FitError, Precision, Problem};
use crate::body::{Group, MotionPrior, Pppr};
use crate::config::{EmLoss, FitConfig, Height};
use crate::geometry::{Vec3, add_scaled, mean, norm};
use serde::{Deserialize, Serialize};
use smallvec::{SmallVec, smallvec};
use space::{BODY, Detail, HEIGHT, LN_SIZE, MOST_JOINTS, PoseSpace, STILL, Stance, TILT, YAW};
use static_echo::{Echo, StaticEchoModel};
use std::iter::zip;

/// Frames of a window lie no farther from its middle, s: the prior reaches no farther.
const REACH_S: f64 = 0.201;
/// Adam's, for the coordinates: the steps are few.
const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.99;
const EPSILON: f64 = 1e-8;
/// How far t and h, y, s, q, w, ẇ and c may go in a step of L-BFGS.
const UNITS: [f64; 7] = [0.03, 0.12, 0.03, 1.0, 0.06, 0.3, 0.5];
/// Steps of t and h, y, s, q, w, ẇ and c at the default learning rate.
const RATES: [f64; 7] = [0.01, 0.04, 0.006, 0.2, 0.02, 0.1, 0.08];
/// Which of both the numbers of the pose have; r has no gradient and takes no step.
const POSE: usize = 6;
const DEFAULT_RATE: f64 = 1e-3;
/// From this share of the iterations on steps are shorter, by so much.
const SLOW_FROM: f64 = 0.6;
const SLOW: f64 = 0.3;
/// The L_EM of dB maps (1 − their correlation, no unit; SPEC section 8) beyond which, with a share of L_prior and of how far a body is
/// from the start, they are of something else than bodies: of one person alone, and of several, who explain more. Of walkers it is
/// 0.15 at most, also among furniture, of somebody who stands in a bright room or lies 0.3, of a crowd 0.45. Measured.
pub const MOST_UNLIKE: [f64; 2] = [0.38, 0.27];
/// The L_EM of dB maps (as in [`MOST_UNLIKE`]) up to which a fit goes on from where it begins: of one person, or where what stands
/// around several is known; and of several where it is not. Measured.
pub const MOST_BEGUN: [f64; 2] = [0.2, 0.16];
/// What a window's L_prior counts of its L_EM there: a pose that nobody takes explains maps, too.
const OF_PRIOR: f64 = 0.1;
/// Slower than this nobody leaves the cells that it stands in while the frames around last, m/s.
const WALKING_MPS: f64 = 0.35;

/// Which of [`RATES`] and [`UNITS`] a person's coordinate `at` has.
fn kind(at: usize) -> usize {
    match at {
        0..YAW => 0,
        YAW => 1,
        LN_SIZE => 2,
        STILL => 3,
        TILT..BODY => 4 + (at - TILT) / 2,
        _ => POSE,
    }
}

/// The coordinates of a fit in a window, and Adam's moments of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MotionState {
    /// A person after the other: t (3, m; the third is the height above the floor where that is known), heading y (rad), ln size s, what is left of static echoes q, tilt w (2, rad) and ẇ (2, rad/s), c in standard deviations, and the residual r (3 a joint, sizes), which stays.
    pub coordinates: Vec<f64>,
    /// Exponential mean of the gradient.
    pub first: Vec<f64>,
    /// Exponential mean of its square.
    pub second: Vec<f64>,
    /// Steps since the moments were zero.
    pub steps: u32,
}

/// What is said of [`Held::Large`].
pub(super) const TOO_LARGE: &str =
    "held at the start: too many cells and persons to search among bodies; a smaller em_region can be";

/// Why a fit in a window leaves the persons where they start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Held {
    /// The prior knows nothing of the skeleton.
    Skeleton,
    /// No body of the prior explains the maps.
    Unlike,
    /// As [`Self::Unlike`], but bodies explain those of a frame nearby.
    Seen,
    /// As [`Self::Unlike`], but a network expects one.
    Expected,
    /// There are too many cells and persons to try bodies.
    Large,
}

impl Held {
    /// In words: that, and after a semicolon why.
    pub(super) fn note(self) -> &'static str {
        match self {
            Self::Skeleton => "held at the start: an unknown skeleton; the prior of motion has nothing of it",
            Self::Large => TOO_LARGE,
            Self::Seen => {
                "held where the nearest frame that shows a body has it; none explains the maps here: each leaves too much of their levels, takes a pose that nobody takes, or stands too far from the echo"
            }
            Self::Expected => {
                "held where a network expects the joints; no body explains the maps: each leaves too much of their levels, takes a pose that nobody takes, or stands too far from the echo"
            }
            Self::Unlike => {
                "held at the start: no body explains the maps; each leaves too much of their levels, takes a pose that nobody takes, or stands too far from the echo"
            }
        }
    }
}

/// The frames that are fitted together.
pub(super) struct Window {
    space: PoseSpace,
    /// How bright joints are, where that is fitted.
    echo: Option<StaticEchoModel>,
    /// The frame that is fitted, among them.
    own: usize,
    frames: Vec<WindowFrame>,
    /// Numbers of one person.
    stride: usize,
    /// Whether what stands around the persons is known: they walk, or static echoes were removed.
    clear: bool,
    /// W/F.
    scarcity: f64,
    /// Where several persons began, floor plan, m; of one alone empty.
    places: Vec<[f64; 2]>,
    /// Where the network expects each person; empty where it is not asked.
    expected: Vec<Option<Expected>>,
}

struct WindowFrame {
    em: FrameEm,
    /// The persons as they are in this frame, and what the frame says of them.
    params: Pppr,
    gradient: Pppr,
    /// What their joints do along the line of sight, where that is modelled.
    echoes: Vec<Echo>,
}

/// What a window says of its coordinates.
#[derive(Debug, Default)]
pub(super) struct WindowLoss {
    /// The mean of L_EM over the frames.
    pub(super) em: f64,
    /// L_prior.
    pub(super) prior: f64,
    /// L_net.
    pub(super) network: f64,
    /// ∂(w_EM L_EM + w_prior L_prior + w_net L_net) by the coordinates.
    pub(super) gradient: Vec<f64>,
    /// What the frame that is fitted alone says of the positions, kept while the others are asked.
    pub(super) places: Vec<f64>,
}

/// How little bodies explain maps whose levels they are compared with, or zero where masks are compared.
fn unlikeness(config: &FitConfig, em: f64, prior: f64) -> f64 {
    if config.objective == EmLoss::NccDb { em + OF_PRIOR * prior } else { 0.0 }
}

/// Whether maps with this [`unlikeness`], on average over frames, are of something else than so many bodies.
pub(super) fn is_unlike(unlikeness: f64, persons: usize) -> bool {
    unlikeness > MOST_UNLIKE[usize::from(persons > 1)]
}

impl Window {
    /// That of a fit: see [`Self::new`]; the network is asked.
    ///
    /// # Errors
    /// Where a position is not finite.
    pub(super) fn fitted(
        problem: &Problem,
        config: &FitConfig,
        precision: Precision,
        initial: &Pppr,
    ) -> Result<Result<Self, Held>, FitError> {
        let window = Self::new(problem, config, (precision, Detail::Fit), initial)?;
        Ok(window.map(|window| window.ask(problem, config, initial)))
    }

    /// Whether the window's maps are explained by persons with these coordinates.
    pub(super) fn explains(
        &mut self,
        (problem, config): (&Problem, &FitConfig),
        precision: Precision,
        of: (&[f64], &Pppr),
        loss: &mut WindowLoss,
    ) -> bool {
        self.evaluate((problem, config), precision, of, None, loss);
        let sure = self.clear || self.places.is_empty();
        config.objective != EmLoss::NccDb || loss.em <= MOST_BEGUN[usize::from(!sure)]
    }

    /// Around the persons of `initial`, who move as their velocities say; or why they stay where they are. The space of their poses
    /// has this `detail`, and no network is asked.
    ///
    /// # Errors
    /// Where a position is not finite.
    fn new(
        problem: &Problem,
        config: &FitConfig,
        (precision, detail): (Precision, Detail),
        initial: &Pppr,
    ) -> Result<Result<Self, Held>, FitError> {
        let Some(prior) = MotionPrior::committed() else { return Ok(Err(Held::Skeleton)) };
        let neighbours = problem.neighbours_in(config.frames_around);
        let offsets: Vec<f64> = neighbours.iter().map(|neighbour| neighbour.offset_s).collect();
        let (chosen, middle_s) = chosen(&offsets, config.window);
        let times: Vec<f64> = chosen.iter().map(|frame| frame.map_or(0.0, |k| offsets[k]) - middle_s).collect();
        if problem.skeleton.joints.len() > MOST_JOINTS {
            return Ok(Err(Held::Skeleton));
        }
        let floor_z_m = problem.radar.height_m.filter(|_| config.height == Height::Floor).map(|height_m| -height_m);
        let Some(space) = PoseSpace::new(prior, &problem.skeleton, &times, floor_z_m, detail) else {
            return Ok(Err(Held::Skeleton));
        };
        let (centres, ways) = (region::centres(initial), ways(initial));
        let reduced = ReducedViews::new(problem, config, initial);
        let views = reduced.views();
        let (own_regions, _) = region::regions(views, config.em_region, &centres)?;
        let walks = !neighbours.is_empty() && ways.iter().all(|way| norm(*way) >= WALKING_MPS);
        let moved = |frame: Option<usize>| -> Vec<Vec3> {
            let t_s = frame.map_or(0.0, |k| offsets[k]);
            let at = |(&centre, &way): (&Vec3, &Vec3)| {
                let mut at = centre;
                add_scaled(&mut at, way, t_s);
                at
            };
            centres.iter().zip(&ways).map(at).collect()
        };
        let compared = |background: Option<&[Vec<f64>]>| -> Result<Vec<FrameEm>, FitError> {
            let of_frame = |&frame: &Option<usize>| {
                let (regions, _) = region::regions(views, config.em_region, &moved(frame))?;
                Ok(reduced.compared(frame, &regions, (config, precision), background))
            };
            chosen.iter().map(of_frame).collect()
        };
        let background = clutter::known((problem, config), &reduced, &own_regions, (&centres, walks))?;
        let mut ems = compared(background.as_deref())?;
        if background.is_some() && !walks {
            let empty = ems.iter().map(FrameEm::empty_loss).sum::<f64>() / ems.len().max(1) as f64;
            if empty < clutter::HIDDEN {
                ems = compared(None)?;
            }
        }
        let frame = |em| WindowFrame {
            em,
            params: initial.clone(),
            gradient: Pppr::zeros(initial.shape()),
            echoes: Vec::new(),
        };
        let frames = ems.into_iter().map(frame).collect();
        let own = chosen.iter().position(Option::is_none).unwrap_or(0);
        let stride = space.coordinates();
        let echo = StaticEchoModel::new(problem, config);
        let scarcity = config.window.max(1) as f64 / chosen.len() as f64;
        let clear = walks || problem.static_removed;
        let mut window =
            Self { space, echo, own, frames, stride, clear, scarcity, places: Vec::new(), expected: Vec::new() };
        if initial.shape().persons > 1 {
            window.places = window.coordinates_of(initial).chunks_exact(stride).map(|of| [of[0], of[1]]).collect();
        }
        Ok(Ok(window))
    }

    /// Asks the network where the persons of `initial` are expected, where it is to be asked.
    fn ask(mut self, problem: &Problem, config: &FitConfig, initial: &Pppr) -> Self {
        if config.w_net > 0.0 {
            let places: Vec<Vec3> = (0..initial.shape().persons).map(|person| mean(initial.person(person))).collect();
            let about = |person| Expected::about(problem, config, &places, person);
            self.expected = (0..places.len()).map(about).collect();
        }
        self
    }

    /// Where the network expects a person; `None` where it is not asked, or knows nothing.
    fn expected(&self, person: usize) -> Option<&Expected> {
        self.expected.get(person)?.as_ref()
    }

    /// Gives all persons of `coordinates` the q at which the loss is lowest, where it is fitted.
    pub(super) fn choose_brightness(
        &mut self,
        how: (&Problem, &FitConfig),
        precision: Precision,
        (coordinates, params): (&mut [f64], &Pppr),
        loss: &mut WindowLoss,
    ) {
        if self.echo.is_none() {
            return;
        }
        let mut best = (f64::INFINITY, static_echo::USUAL);
        for q in static_echo::TRIED {
            coordinates.chunks_exact_mut(self.stride).for_each(|of| of[STILL] = q);
            self.evaluate_some(2, how, precision, (coordinates, params), None, loss);
            if loss.em < best.0 {
                best = (loss.em, q);
            }
        }
        coordinates.chunks_exact_mut(self.stride).for_each(|of| of[STILL] = best.1);
    }

    /// The coordinates that come nearest to `params`, joints and velocities.
    pub(super) fn coordinates_of(&self, params: &Pppr) -> Vec<f64> {
        let joints = params.shape().joints;
        let persons = 0..params.shape().persons;
        persons
            .flat_map(|person| {
                let velocities = &params.velocities()[person * joints..(person + 1) * joints];
                self.space.project(self.own, params.person(person), velocities)
            })
            .collect()
    }

    /// Coordinates of all persons.
    pub(super) fn numbers(&self) -> usize {
        self.frames.first().map_or(0, |frame| frame.params.shape().persons * self.stride)
    }

    /// Puts the persons of `params` where the coordinates have them in the frame that is fitted.
    pub(super) fn place(&self, coordinates: &[f64], params: &mut Pppr) {
        let joints = params.shape().joints;
        let [positions, velocities] = params.motion_mut();
        for (person, of) in coordinates.chunks_exact(self.stride).enumerate() {
            let own = person * joints..(person + 1) * joints;
            let stance = self.space.stance(of);
            self.space.pose(of, &stance, self.own, &mut positions[own.clone()]);
            self.space.velocity(of, &stance, (self.own, &positions[own.clone()]), &mut velocities[own]);
        }
        self.dim(coordinates, params);
    }

    /// Makes the persons of `params` as bright as static echoes leave them, where that is fitted.
    fn dim(&self, coordinates: &[f64], params: &mut Pppr) {
        let Some(echo) = &self.echo else { return };
        for (person, of) in coordinates.chunks_exact(self.stride).enumerate() {
            echo.dim(of[STILL], person, params, |_| ());
        }
    }

    /// L_EM and L_prior of persons with these coordinates who look as `params` says; the gradient by how they look is added to
    /// `looks`, unweighted.
    pub(super) fn evaluate(
        &mut self,
        (problem, config): (&Problem, &FitConfig),
        precision: Precision,
        (coordinates, params): (&[f64], &Pppr),
        looks: Option<&mut Pppr>,
        loss: &mut WindowLoss,
    ) {
        self.evaluate_some(1, (problem, config), precision, (coordinates, params), looks, loss);
    }

    /// The same from every so manyth frame alone.
    fn evaluate_some(
        &mut self,
        every: usize,
        (problem, config): (&Problem, &FitConfig),
        precision: Precision,
        (coordinates, params): (&[f64], &Pppr),
        looks: Option<&mut Pppr>,
        loss: &mut WindowLoss,
    ) {
        let Self { space, echo, frames, stride, scarcity, .. } = self;
        let joints = params.shape().joints;
        loss.gradient.clear();
        loss.gradient.resize(coordinates.len(), 0.0);
        let share = 1.0 / frames.len().div_ceil(every) as f64;
        let persons = (coordinates.len() / *stride).max(1) as f64;
        let prior_share = *scarcity / persons;
        let prior_gain = config.w_prior * prior_share;
        (loss.em, loss.prior) = (0.0, 0.0);
        let mut kept = looks;
        let stances: SmallVec<[Stance; 4]> = coordinates.chunks_exact(*stride).map(|own| space.stance(own)).collect();
        for (frame, of) in frames.iter_mut().enumerate().step_by(every) {
            for group in Group::ALL[1..].iter().filter(|&&group| group != Group::Velocity) {
                of.params.group_mut(*group).copy_from_slice(params.group(*group));
            }
            let [positions, velocities] = of.params.motion_mut();
            for (person, own) in coordinates.chunks_exact(*stride).enumerate() {
                let joints = person * joints..(person + 1) * joints;
                space.pose(own, &stances[person], frame, &mut positions[joints.clone()]);
                space.velocity(own, &stances[person], (frame, &positions[joints.clone()]), &mut velocities[joints]);
            }
            if let Some(echo) = echo {
                of.echoes.clear();
                for (person, own) in coordinates.chunks_exact(*stride).enumerate() {
                    echo.dim(own[STILL], person, &mut of.params, |joint| of.echoes.push(joint));
                }
            }
            of.gradient.reset(params.shape());
            let em = of.em.evaluate((&problem.radar, config), precision, &of.params, &mut of.gradient, None);
            loss.em += share * em;
            let each = coordinates.chunks_exact(*stride).zip(loss.gradient.chunks_exact_mut(*stride));
            for (person, (own, bars)) in each.enumerate() {
                let of_person = person * joints..(person + 1) * joints;
                let (pose, velocities) =
                    (&of.params.positions()[of_person.clone()], &of.params.velocities()[of_person.clone()]);
                let (mut pose_bar, mut velocity_bar) = ([[0.0; 3]; MOST_JOINTS], [[0.0; 3]; MOST_JOINTS]);
                let em_gain = share * config.w_em;
                for (bars, em) in
                    [(&mut pose_bar, of.gradient.positions()), (&mut velocity_bar, of.gradient.velocities())]
                {
                    bars.iter_mut().zip(&em[of_person.clone()]).for_each(|(bar, em)| *bar = em.map(|x| em_gain * x));
                }
                if let Some(echo) = echo {
                    let mut beta_bar = [0.0; MOST_JOINTS];
                    let em = &of.gradient.group(Group::Beta)[of_person];
                    beta_bar.iter_mut().zip(em).for_each(|(bar, em)| *bar = em_gain * em);
                    let onto = (&mut pose_bar[..], &mut velocity_bar[..]);
                    bars[STILL] += echo.pull_back(own[STILL], person, (&of.params, &of.echoes), &beta_bar, onto);
                }
                let gain = share * prior_gain;
                let misfit = space.proportions.misfit(own, pose, gain, (&mut pose_bar, &mut *bars));
                loss.prior += share * prior_share * misfit;
                let moving = Some((velocities, &velocity_bar[..joints]));
                space.pull_back(own, &stances[person], frame, ((pose, &pose_bar[..joints]), moving), bars);
            }
            if let Some(looks) = kept.as_deref_mut() {
                looks.add_scaled(share, &of.gradient);
            }
        }
        for (own, bars) in coordinates.chunks_exact(*stride).zip(loss.gradient.chunks_exact_mut(*stride)) {
            loss.prior += prior_share * space.unlikeliness(own, prior_gain, bars);
        }
        self.weigh_joints(config, coordinates, &stances, loss);
    }

    /// Adds what the network and other persons say of persons with these coordinates and stances.
    fn weigh_joints(&self, config: &FitConfig, coordinates: &[f64], stances: &[Stance], loss: &mut WindowLoss) {
        loss.network = 0.0;
        if stances.len() == 1 && self.expected(0).is_none() {
            return;
        }
        let (Self { space, stride, own: own_frame, .. }, persons) = (self, stances.len() as f64);
        let joints = space.joints;
        let mut poses: SmallVec<[[Vec3; MOST_JOINTS]; 4]> = smallvec![[[0.0; 3]; MOST_JOINTS]; stances.len()];
        let mut slopes = poses.clone();
        for ((own, stance), pose) in zip(zip(coordinates.chunks_exact(*stride), stances), &mut poses) {
            space.pose(own, stance, *own_frame, &mut pose[..joints]);
        }
        for ((pose, bar), expected) in zip(zip(&poses, &mut slopes), &self.expected) {
            let Some(expected) = expected else { continue };
            loss.network += expected.misfit(&pose[..joints], config.w_net / persons, &mut bar[..joints]) / persons;
        }
        // The other parts are means over persons and grow as frames get fewer; nobody stands in another, however many look.
        let hips: SmallVec<[[f64; 2]; 4]> = coordinates.chunks_exact(*stride).map(|own| [own[0], own[1]]).collect();
        loss.prior += apart::overlap(&hips, config.w_prior, |person, slope| {
            zip(&mut loss.gradient[person * stride..], slope).for_each(|(bar, slope)| *bar += slope);
        });
        let middle = |pose: &[Vec3; MOST_JOINTS]| {
            let [x, y, _] = mean(&pose[..joints]);
            [x, y]
        };
        let middles: SmallVec<[[f64; 2]; 4]> = poses.iter().map(middle).collect();
        loss.prior += apart::overlap(&middles, config.w_prior, |person, [x, y]| {
            slopes[person][..joints].iter_mut().for_each(|bar| add_scaled(bar, [x, y, 0.0], 1.0 / joints as f64));
        });
        let each = zip(coordinates.chunks_exact(*stride), loss.gradient.chunks_exact_mut(*stride));
        for ((own, bars), (stance, (pose, bar))) in zip(each, zip(stances, zip(&poses, &slopes))) {
            space.pull_back(own, stance, *own_frame, ((&pose[..joints], &bar[..joints]), None), bars);
        }
        loss.prior += apart::astray(coordinates, *stride, &self.places, config.w_prior, &mut loss.gradient);
    }

    /// Adds what a gradient by the joints of the frame that is fitted says of the coordinates.
    pub(super) fn pull_back(&self, coordinates: &[f64], params: &Pppr, gradient: &Pppr, bars: &mut [f64]) {
        let joints = params.shape().joints;
        for (person, (own, bars)) in
            coordinates.chunks_exact(self.stride).zip(bars.chunks_exact_mut(self.stride)).enumerate()
        {
            let joints = person * joints..(person + 1) * joints;
            let pose = (&params.positions()[joints.clone()], &gradient.positions()[joints]);
            self.space.pull_back(own, &self.space.stance(own), self.own, (pose, None), bars);
        }
    }
}

impl MotionState {
    /// These coordinates, and moments of nothing.
    pub(super) fn at(coordinates: Vec<f64>) -> Self {
        let zeros = vec![0.0; coordinates.len()];
        Self { first: zeros.clone(), second: zeros, coordinates, steps: 0 }
    }

    /// One step of Adam of persons with `stride` numbers each against `gradient`, written over `next`; `pace` scales the steps,
    /// and a pose that is `held` takes none.
    fn step_into(&self, stride: usize, gradient: &[f64], pace: f64, held: bool, next: &mut Self) {
        next.coordinates.clone_from(&self.coordinates);
        next.first.clone_from(&self.first);
        next.second.clone_from(&self.second);
        next.steps = self.steps + 1;
        let unbias = [BETA_1, BETA_2].map(|beta| 1.0 / (1.0 - beta.powf(f64::from(next.steps))));
        let moments = next.first.iter_mut().zip(&mut next.second);
        for (k, ((x, (m, v)), g)) in next.coordinates.iter_mut().zip(moments).zip(gradient).enumerate() {
            let kind = kind(k % stride);
            let rate = if held && kind == POSE { 0.0 } else { RATES[kind] };
            *m = BETA_1 * *m + (1.0 - BETA_1) * g;
            *v = BETA_2 * *v + (1.0 - BETA_2) * g * g;
            *x -= pace * rate * *m * unbias[0] / ((*v * unbias[1]).sqrt() + EPSILON);
        }
    }

    /// The step of iteration `iteration` of a fit.
    pub(super) fn advance(
        &self,
        window: &Window,
        gradient: &[f64],
        (config, iteration): (&FitConfig, usize),
        next: &mut Self,
    ) {
        let late = iteration as f64 > SLOW_FROM * config.iterations as f64;
        let pace = config.learning_rate / DEFAULT_RATE * if late { SLOW } else { 1.0 };
        self.step_into(window.stride, gradient, pace, false, next);
    }
}

/// The frames of a window, in the order of time, `None` the one that is fitted, and its middle, s: `most` that follow each other,
/// that one among them and as near their middle as can be.
fn chosen(offsets: &[f64], most: usize) -> (Vec<Option<usize>>, f64) {
    let before = offsets.partition_point(|&offset| offset < 0.0);
    let mut all: Vec<Option<usize>> = (0..offsets.len()).map(Some).collect();
    all.insert(before, None);
    let time = |frame: &Option<usize>| frame.map_or(0.0, |k| offsets[k]);
    let mut best: (Vec<Option<usize>>, f64) = (vec![None], 0.0);
    for length in (2..=most.max(1).min(all.len())).rev() {
        let windows = (before.saturating_sub(length - 1)..=before).filter(|first| first + length <= all.len());
        let found = windows
            .map(|first| &all[first..first + length])
            .map(|frames| (frames, f64::midpoint(time(&frames[0]), time(&frames[length - 1]))))
            .filter(|(frames, middle)| frames.iter().all(|frame| (time(frame) - middle).abs() <= REACH_S))
            .min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        if let Some((frames, middle)) = found {
            best = (frames.to_vec(), middle);
            break;
        }
    }
    best
}

/// How each person moves as a whole, m/s.
fn ways(params: &Pppr) -> Vec<Vec3> {
    let joints = params.shape().joints.max(1);
    params.velocities().chunks(joints).map(mean).collect()
}
