//! Initialisation from the maps alone; paper section 4.1, and for several people 4.4.
//!
//! 1. Background off, and where frames around are known all that stands still, unless the settings keep them; local maxima
//!    above an adaptive percentile ([`context`]).
//! 2. P: peaks of different views are paired where their coordinates agree on one point in space, and the points are
//!    grouped by hierarchical clustering ([`place`]).
//! 3. A standing body is tried at every group, at several heights and depths. The place where all views show
//!    the most echo over their background wins: a wall arc has none, a strong echo in one view only has little. To the letter
//!    of the paper the strongest group wins as it is, and the next step is left out.
//! 4. The body's middle is that of what all views show lit around the place; its height that of feet and head.
//! 5. V: velocities from the Doppler axis or the intensity gradients ([`velocity`]); heading, where asked for, from the
//!    places in the frames around ([`context`]).
//! 6. Every joint gets its Gaussian ([`scatterers`]), and the start is perturbed where the settings ask for it
//!    ([`perturb`]).
//!
//! Switches beside the default setting refine the start: where counting finds the one person, behind the skin, on the
//! line through the frames around, as high as floor and head say in all of them ([`context`]), in the posture that fits
//! ([`pose`]). What it is without them is kept beside it. A search in the space of motion ends at several bodies; which of them
//! a person is, the frames around may decide ([`Hypotheses`]); where none explains the maps, it is where it was seen last ([`seen`]),
//! or one that a network expects.
//! What the maps show is worked out once for a problem ([`context`]). A warm start goes where the persons of the frame before went
//! ([`warm`]).
//!
//! Nothing here reads a label.

mod find;
mod given;
mod notes;
mod perturb;
mod place;
mod pose;
mod scatterers;
mod seen;
#[cfg(test)]
mod tests;
mod velocity;
mod warm;

pub use given::{standing_joints, start_at};
pub use perturb::perturb;
pub use warm::predict;

use super::context::{
    self, Expectation, Peak, SaliencyMap, Sighting, Stature, Track, apart_m, behind_skin, bent_if_below, near,
};
use super::motion::{self, Decoded, Held, Hypothesis, Searched, Stage};
use super::template::Template;
use super::{FitError, Objective, Precision, Problem};
use crate::body::{Group, Pppr, PpprShape};
use crate::config::{BodyModel, EmLoss, FitConfig, Height, Parameterization, StartPlace, Summation, Yaw};
use crate::geometry::{Vec3, add, flat_distance, mean, norm, sub};
use find::{find_one, middle_of_views};
use notes::notes_of;
use pose::Posture;
use scatterers::ScattererModel;
use std::borrow::Cow;
use std::sync::Arc;
use velocity::{Radial, Source};

/// Steps in which a posture's place is looked for, m.
const POSTURE_STEP_M: f64 = 0.06;
const MOST_STEPS: usize = 12;
/// Postures tried at most: more starts are those of a search in a space of motion.
const POSTURES: usize = 9;
/// What counting finds farther from a place than this is another place, m.
const ELSEWHERE_M: f64 = 1.0;
/// Two bodies whose middles are nearer over the floor than this are one, m.
const ONE_PLACE_M: f64 = 0.3;
/// The L_EM of a posture other than standing, of that of standing, at which it is believed of somebody who does not walk.
const CLEARLY_BETTER: f64 = 0.9;

/// A start for the fit, and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Initialisation {
    /// Where the fit begins: the persons on the problem's skeleton.
    pub params: Pppr,
    /// The same persons as this frame's peaks alone place them: standing, facing the radar, the middle of the body where the
    /// echo is. The same as `params` where no switch beside the default setting refines a start.
    pub unrefined: Pppr,
    /// Local maxima of every view, strongest over the background first within a view.
    pub peaks: Vec<Peak>,
    /// What was found and assumed, in words.
    pub notes: Vec<String>,
    /// What a search in the space of motion found, or why a fit in it leaves the persons where they start; both are among the
    /// notes.
    pub motion: Option<Result<String, &'static str>>,
}

impl Initialisation {
    /// Tells of a fit that is held at the body which a search found ([`super::Fitter::is_held`]).
    pub fn tell_held(&mut self) {
        if let Some(Ok(note)) = &mut self.motion {
            let line = self.notes.iter().position(|other| other == note);
            note.push_str("; the fit leaves it there: its levels correlate by less than 0.8 (0.84 of who stands)");
            if let Some(line) = line {
                self.notes[line].clone_from(note);
            }
        }
    }
}

/// A person before it has parameters.
#[derive(Debug, Clone)]
struct Person {
    at: Vec3,
    expected: Option<Expectation>,
    track: Option<Track>,
    radial: Option<Radial>,
    posture: Posture,
    /// The template in that posture.
    body: Arc<Template>,
}

impl Person {
    /// What its head says of it, where the floor is known and asked for.
    fn stature(&self, problem: &Problem, config: &FitConfig) -> Option<Stature> {
        let radar_height_m = problem.radar.height_m.filter(|_| config.height == Height::Floor)?;
        let own = self.expected.and_then(|expected| expected.lit);
        let in_track = self.track.iter().flat_map(|track| track.sightings.iter().filter_map(|seen| seen.lit_m));
        let lit_m: Vec<[f64; 2]> = if self.track.is_some() { in_track.collect() } else { own.into_iter().collect() };
        Some(Stature::new(lit_m.into_iter(), radar_height_m))
    }

    /// How fast its middle moves along the line from the radar and across it, m/s; 0 without frames around.
    fn speeds(&self) -> [f64; 2] {
        let ([x, y], [vx, vy, _]) =
            (towards_radar(self.at), self.track.as_ref().map_or([0.0; 3], |track| track.velocity));
        [(x * vx + y * vy).abs(), (x * vy - y * vx).abs()]
    }

    fn walks(&self) -> bool {
        self.track.as_ref().is_some_and(|track| track.heading.is_some())
    }

    /// The direction in which it looks, on the floor.
    fn forward(&self, yaw: Yaw) -> [f64; 2] {
        let walking = self.track.as_ref().filter(|_| yaw == Yaw::Motion).and_then(|track| track.heading);
        walking.unwrap_or_else(|| towards_radar(self.at))
    }

    /// Its joints in its posture, world frame, m.
    fn joints(&self, problem: &Problem, config: &FitConfig) -> Vec<Vec3> {
        let at = match &self.track {
            Some(track) if config.w_time > 0.0 || config.parameterization == Parameterization::Motion => {
                [track.at[0], track.at[1], self.at[2]]
            }
            _ => self.at,
        };
        let bent = matches!(self.posture, Posture::Bent(_));
        let mut at = if bent { at } else { behind_skin(config, at) };
        if let (Some(stature), Some(radar_height_m)) = (self.stature(problem, config), problem.radar.height_m) {
            let top_m = stature.top_m.filter(|_| bent).unwrap_or(stature.standing_m);
            at[2] = self.body.middle_as_tall_as_m(top_m) - radar_height_m;
        }
        self.body.facing(at, self.forward(config.yaw))
    }

    fn velocity(&self, config: &FitConfig) -> Vec3 {
        let tracked = self.track.as_ref().filter(|_| config.yaw == Yaw::Motion).map(|track| track.velocity);
        match (self.radial, tracked) {
            _ if !config.init.velocity => [0.0; 3],
            (Some(radial), _) if radial.source == Source::Doppler => radial.vector,
            (_, Some(velocity)) => velocity,
            (Some(radial), None) => radial.vector,
            (None, None) => [0.0; 3],
        }
    }
}

fn towards_radar(at: Vec3) -> [f64; 2] {
    let distance = at[0].hypot(at[1]);
    if distance > 0.0 { [-at[0] / distance, -at[1] / distance] } else { [-1.0, 0.0] }
}

/// Finds one person; SPEC section 2 says what the parameters are.
///
/// # Errors
/// [`FitError::NoStart`] where no view shows anything above its background.
pub fn initialise(problem: &Arc<Problem>, config: &FitConfig) -> Result<Initialisation, FitError> {
    initialise_people(problem, config, &[])
}

/// Finds one person near each of `seeds` (world frame, m), or one anywhere where there are none. Where one person is asked for
/// with [`StartPlace::Counted`], they are where counting found people, the likeliest first: that one decides only where the frame's
/// own peaks show somebody where nobody was counted.
///
/// # Errors
/// [`FitError::NoStart`] where no view shows anything above its background.
pub fn initialise_people(
    problem: &Arc<Problem>,
    config: &FitConfig,
    seeds: &[Vec3],
) -> Result<Initialisation, FitError> {
    Hypotheses::new(problem, config, seeds)?.start(problem, config, &[])
}

/// What the persons of a frame may be, before one of the bodies that a search ended at is chosen.
#[derive(Debug, Clone)]
pub struct Hypotheses {
    /// The persons that the frame's own peaks show, and those that are fitted.
    own: Vec<Person>,
    persons: Vec<Person>,
    /// What a search in the space of motion ended at, or why there is none; `None` where no setting asks for one.
    searched: Option<Result<Searched, Held>>,
    peaks: Vec<Peak>,
    notes: Vec<String>,
}

impl Hypotheses {
    /// Looks for persons as [`initialise_people`] does.
    ///
    /// # Errors
    /// [`FitError::NoStart`] where no view shows anything above its background.
    pub fn new(problem: &Arc<Problem>, config: &FitConfig, seeds: &[Vec3]) -> Result<Self, FitError> {
        let problem = &Arc::clone(problem).shared_under(config);
        let (maps, peaks) = shown(problem, config);
        let mut notes: Vec<String> = (0..problem.views.len())
            .filter(|&k| problem.filled_cells(k) > 0)
            .map(|k| format!("{}: {} missing cells filled", problem.views[k].array, problem.filled_cells(k)))
            .collect();
        let offsets = problem.views.iter().filter(|view| view.psf.measured_offset_m != 0.0);
        let told: Vec<String> =
            offsets.map(|view| format!("{} {:+.2} m", view.array, view.psf.measured_offset_m)).collect();
        if !told.is_empty() {
            notes.push(format!("ranges differ: {}", told.join(", ").replace('-', "−")));
        }
        let (own, persons) = persons(problem, config, (maps.as_ref(), &peaks), seeds, &mut notes)?;
        // It begins at standing persons: its own starts are the postures.
        let standing = || {
            let model = ScattererModel::new(&problem.skeleton, config.scatterers);
            motion::search(problem, config, &assemble(problem, config, &model, &persons))
        };
        let searched = (config.parameterization == Parameterization::Motion).then(standing).transpose()?;
        Ok(Self { own, persons, searched, peaks, notes })
    }

    /// Whether there is one person, with bodies that a search ended at: those of several would be carried on into each other.
    pub fn is_carried_on(&self) -> bool {
        self.searched.as_ref().is_some_and(|found| found.as_ref().is_ok_and(|found| found.persons.len() == 1))
    }

    /// These, and what the body of the one person becomes that the frames `around` have on the cheapest path, each frame with its
    /// time, s after this one; the same where [`Self::is_carried_on`] says no.
    ///
    /// # Errors
    /// Where a position is not finite.
    pub fn carried_on(
        &self,
        problem: &Arc<Problem>,
        config: &FitConfig,
        around: &[(f64, &Self)],
    ) -> Result<Self, FitError> {
        let mut all = self.clone();
        let (Some(Ok(searched)), Some(Ok(found))) = (&self.searched, &mut all.searched) else { return Ok(all) };
        let [own] = searched.persons.as_slice() else { return Ok(all) };
        let problem = &Arc::clone(problem).shared_under(config);
        let model = ScattererModel::new(&problem.skeleton, config.scatterers);
        let params = assemble(problem, config, &model, &self.persons);
        let others = motion::carried(own, &stages(around, |found| &found.persons));
        motion::carry_on(problem, config, &params, found, &others)?;
        Ok(all)
    }

    /// The start. Of what a search ended at it is the body on the cheapest path through what the frames `around` ended at, each
    /// with its time, s after this one; of a frame alone the one with the lowest loss. Where bodies do not explain the maps of
    /// all these frames, it is a posture.
    ///
    /// # Errors
    /// Where a position is not finite.
    pub fn start(
        &self,
        problem: &Arc<Problem>,
        config: &FitConfig,
        around: &[(f64, &Self)],
    ) -> Result<Initialisation, FitError> {
        let problem = &Arc::clone(problem).shared_under(config);
        let model = ScattererModel::new(&problem.skeleton, config.scatterers);
        let (mut persons, mut notes) = (self.persons.clone(), self.notes.clone());
        let chosen = self.searched.as_ref().map(|searched| {
            let searched = searched.as_ref().map_err(|held| *held)?;
            chosen(searched, around).ok_or(Held::Unlike)
        });
        let placed = |bodies: Vec<&Hypothesis>| {
            let mut params = assemble(problem, config, &model, &self.persons);
            bodies.iter().enumerate().for_each(|(person, body)| body.place(person, &mut params));
            params
        };
        let (params, motion) = match chosen {
            Some(Ok((bodies, note))) => {
                notes.push(note.clone());
                (placed(bodies), Some(Ok(note)))
            }
            Some(Err(Held::Unlike)) if let Some(body) = self.seen_elsewhere(problem.radar.height_m, around) => {
                notes.push(Held::Seen.note().to_owned());
                (placed(vec![&body]), Some(Err(Held::Seen.note())))
            }
            Some(Err(Held::Unlike)) if let Some(bodies) = self.expected(around) => {
                notes.push(Held::Expected.note().to_owned());
                (placed(bodies), Some(Err(Held::Expected.note())))
            }
            Some(Err(held)) => {
                (self.posture(problem, config, Some(held), (&mut persons, &mut notes))?, Some(Err(held.note())))
            }
            None => (self.posture(problem, config, None, (&mut persons, &mut notes))?, None),
        };
        let (mut params, mut unrefined) = (params, assemble(problem, &unrefined(config), &model, &self.own));
        for start in [&mut params, &mut unrefined] {
            perturb::perturb(problem, &config.init, start);
        }
        notes.extend(persons.iter().flat_map(|person| notes_of(person, config)));
        Ok(Initialisation { params, unrefined, peaks: self.peaks.clone(), notes, motion })
    }

    /// The body that the one person was last seen with ([`seen`]), unless a network expects one there, too: it knows the way that they look
    /// now.
    fn seen_elsewhere(&self, radar_height_m: Option<f64>, around: &[(f64, &Self)]) -> Option<Hypothesis> {
        let seen = self.last_seen(radar_height_m, around)?;
        let away_m = |other: &Hypothesis| norm(sub(mean(&other.joints), mean(&seen.joints)));
        let is_expected = self.expected(around).is_some_and(|of| of.iter().all(|body| away_m(body) < ONE_PLACE_M));
        (!is_expected).then_some(seen)
    }

    /// The bodies that a network expects, each on the cheapest path through those that it expects in the frames `around`; `None` where
    /// it expects nobody in one of the places, or the same one in two.
    fn expected(&self, around: &[(f64, &Self)]) -> Option<Vec<&Hypothesis>> {
        let of_network: Bodies = |found| &found.expected;
        let own = self.stage(0.0, of_network)?;
        let seen = stages(around, of_network);
        let likeliest = |own: &'_ Vec<Hypothesis>| motion::lowest(&motion::decode(own, &seen).costs);
        let bodies = own.persons.iter().map(|own| own.get(likeliest(own)?)).collect::<Option<Vec<_>>>()?;
        let places: Vec<Vec3> = bodies.iter().map(|body| mean(&body.joints)).collect();
        let is_one = |k: usize| places[..k].iter().any(|other| flat_distance(*other, places[k]) < ONE_PLACE_M);
        (!(1..places.len()).any(is_one)).then_some(bodies)
    }

    /// The `persons` in the postures that explain their masks best; where `held` they are turned and moved as levels say.
    fn posture(
        &self,
        problem: &Arc<Problem>,
        config: &FitConfig,
        held: Option<Held>,
        (persons, notes): (&mut [Person], &mut Vec<String>),
    ) -> Result<Pppr, FitError> {
        if config.starts > 1 {
            choose_postures(problem, config, &Template::new(&problem.skeleton), persons)?;
        }
        let model = ScattererModel::new(&problem.skeleton, config.scatterers);
        let mut params = assemble(problem, config, &model, persons);
        let joints = params.shape().joints;
        let moved = self.searched.iter().flatten().flat_map(|searched| &searched.moved);
        for (k, &way) in moved.enumerate().filter(|(_, way)| norm(**way) > 0.0) {
            for joint in k * joints..(k + 1) * joints {
                params.set_vec3(Group::Position, joint, add(params.position(joint), way));
            }
            notes.push(format!("moved by {:.2} m to where a body explains the maps better", norm(way)));
        }
        notes.extend(held.map(|held| held.note().to_owned()));
        // Whom there are too many cells to search for there are too many to turn.
        if held.is_some_and(|held| held != Held::Large) {
            notes.extend(motion::turn(problem, config, &mut params)?);
        }
        Ok(params)
    }

    /// What other frames are told of these bodies of this one, `t_s` after them.
    fn stage(&self, t_s: f64, bodies: Bodies) -> Option<Stage<'_>> {
        let searched = self.searched.as_ref()?.as_ref().ok()?;
        Some(Stage { t_s, persons: bodies(searched) })
    }
}

/// Some of the bodies of each person.
type Bodies = fn(&Searched) -> &[Vec<Hypothesis>];

/// What is told of these bodies of the frames around.
fn stages<'a>(around: &[(f64, &'a Hypotheses)], bodies: Bodies) -> Vec<Stage<'a>> {
    around.iter().filter_map(|&(t_s, other)| other.stage(t_s, bodies)).collect()
}

/// The body of each person on the cheapest path, and what is said of them; `None` where bodies do not explain the maps.
fn chosen<'a>(searched: &'a Searched, around: &[(f64, &Hypotheses)]) -> Option<(Vec<&'a Hypothesis>, String)> {
    let seen = stages(around, |found| &found.persons);
    let decoded: Vec<Decoded> = searched.persons.iter().map(|own| motion::decode(own, &seen)).collect();
    let unlikeness = decoded.iter().map(|person| person.unlikeness).sum::<f64>() / decoded.len().max(1) as f64;
    if motion::is_unlike(unlikeness, decoded.len()) {
        return None;
    }
    let best = searched.persons.iter().zip(&decoded).filter_map(|(own, of)| own.get(motion::lowest(&of.costs)?));
    let note = searched.note(decoded.last().map_or(&[], |last| &last.costs));
    let along = if seen.is_empty() { String::new() } else { format!(", along {} frames", seen.len() + 1) };
    Some((best.collect(), note + &along))
}

/// The persons that the frame's own peaks show, and those that are fitted.
fn persons(
    problem: &Arc<Problem>,
    config: &FitConfig,
    (maps, peaks): (&[SaliencyMap], &[Peak]),
    seeds: &[Vec3],
    notes: &mut Vec<String>,
) -> Result<(Vec<Person>, Vec<Person>), FitError> {
    let template = Arc::new(Template::new(&problem.skeleton));
    let seen = |(at, expected): (Vec3, Expectation)| (at, Some(expected));
    let nearby = |k: usize| seen(near(&problem.views, maps, seeds, k));
    let mut alone = || find_one(problem, config.place, maps, &template, peaks, notes).map(seen);
    let one_counted = config.people == 1 && config.place == StartPlace::Counted && !seeds.is_empty();
    let found = match seeds {
        _ if !config.init.position => vec![(middle_of_views(problem), None)],
        [] => vec![alone()?],
        _ if one_counted => vec![alone().unwrap_or_else(|_| nearby(0))],
        seeds => (0..seeds.len()).map(nearby).collect(),
    };
    let places: Vec<Vec3> = found.iter().map(|(at, _)| *at).collect();
    let person = |at: Vec3, expected: Option<Expectation>, apart_m: f64| {
        let here = Sighting { t_s: 0.0, at, lit_m: expected.and_then(|expected| expected.lit) };
        let track = followed(config).then(|| context::track(problem.context(config), here, apart_m)).flatten();
        let radial = velocity::radial(problem, config, at);
        Person { at, expected, track, radial, posture: Posture::Standing, body: Arc::clone(&template) }
    };
    let own: Vec<Person> =
        found.into_iter().enumerate().map(|(k, (at, expected))| person(at, expected, apart_m(&places, k))).collect();
    let counted_at = |place: Vec3| seeds.iter().any(|&seed| flat_distance(seed, place) <= ELSEWHERE_M);
    let elsewhere = (one_counted && config.init.position && !counted_at(places[0])).then(|| nearby(0));
    let fitted = match elsewhere {
        Some((at, expected)) => {
            let [x, y, _] = own[0].at;
            notes.push(format!("the peaks alone show somebody at x {x:.2} m, y {y:.2} m; the frames around do not"));
            vec![person(at, expected, f64::INFINITY)]
        }
        None => own.clone(),
    };
    Ok((own, fitted))
}

/// Gives each person the posture whose L_EM is smallest where it stands best near its place; the place itself is left
/// to the fit.
fn choose_postures(
    problem: &Arc<Problem>,
    config: &FitConfig,
    template: &Template,
    persons: &mut [Person],
) -> Result<(), FitError> {
    // Masks tell postures apart also where levels are those of a room.
    let (objective, body) = (EmLoss::Iou, BodyModel::Joints);
    let config = FitConfig { objective, body, summation: Summation::Incoherent, w_time: 0.0, ..*config };
    let model = ScattererModel::new(&problem.skeleton, config.scatterers);
    for k in 0..persons.len() {
        let walks = persons[k].walks();
        let stature = persons[k].stature(problem, &config).filter(|_| !walks);
        let tried = postures(template, problem, config.starts.min(POSTURES), walks, stature, persons[k].speeds());
        let mut best: Option<(f64, Posture, Arc<Template>)> = None;
        for (posture, better) in tried {
            let posed = Arc::new(pose::posed(template, &problem.skeleton, posture));
            let own = |at: Vec3| Person { at, posture, body: Arc::clone(&posed), ..persons[k].clone() };
            let body = |at: Vec3| assemble(problem, &config, &model, &[own(at)]);
            let at = persons[k].at;
            let objective = Objective::new(Arc::clone(problem), config, Precision::F32, &body(at))?;
            let lowest = lowest_near(at, POSTURE_STEP_M, |p| objective.em_loss(&body(p)));
            if best.as_ref().is_none_or(|(loss, ..)| lowest < better * loss) {
                best = Some((lowest, posture, posed));
            }
        }
        if let Some((_, posture, body)) = best {
            (persons[k].posture, persons[k].body) = (posture, body);
        }
    }
    Ok(())
}

/// Postures to try, and the share of the best L_EM so far below which each is believed: who stands is as likely to stand as
/// all else together. `speeds` are those of [`Person::speeds`].
fn postures(
    template: &Template,
    problem: &Problem,
    starts: usize,
    walks: bool,
    stature: Option<Stature>,
    speeds: [f64; 2],
) -> Vec<(Posture, f64)> {
    let believed = |posture: Posture| (posture, if walks { 1.0 } else { CLEARLY_BETTER });
    let tried = pose::tried(starts, walks).into_iter().map(believed);
    let Some(top_m) = stature.and_then(|stature| stature.top_m) else { return tried.collect() };
    // Where the head's height is known, it says how far a body is bent.
    let upright = tried.filter(|(posture, _)| !matches!(posture, Posture::Bent(_)));
    upright.chain([(pose::bent(template, &problem.skeleton, top_m), bent_if_below(top_m, speeds))]).collect()
}

/// What a start sees of its frame: the saliency of its maps and its peaks, less what the settings ask to miss.
fn shown<'a>(problem: &'a Problem, config: &FitConfig) -> (Cow<'a, [SaliencyMap]>, Vec<Peak>) {
    let maps = problem.context(config).now.as_slice();
    let peaks: Vec<Peak> = maps.iter().flat_map(SaliencyMap::peaks).collect();
    let (kept, missed) = perturb::missed(problem, &config.init, peaks);
    if missed.is_empty() {
        return (Cow::Borrowed(maps), kept);
    }
    let of_view = |(k, view): (usize, &SaliencyMap)| view.without(missed.iter().filter(|peak| peak.view == k));
    (Cow::Owned(maps.iter().enumerate().map(of_view).collect()), kept)
}

/// The lowest `cost` on the way downhill from `at` on a grid, to the best of the six neighbours until none is better.
fn lowest_near(mut at: Vec3, step_m: f64, cost: impl Fn(Vec3) -> f64) -> f64 {
    let mut lowest = cost(at);
    for _ in 0..MOST_STEPS {
        let moves = (0..6).map(|k| {
            let mut to = at;
            to[k / 2] += if k % 2 == 0 { step_m } else { -step_m };
            (to, cost(to))
        });
        let Some((to, value)) = moves.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, value)| *value < lowest) else {
            break;
        };
        (at, lowest) = (to, value);
    }
    lowest
}

/// Whether some setting asks where a person is in the frames around.
fn followed(config: &FitConfig) -> bool {
    config.yaw == Yaw::Motion || config.height == Height::Floor || config.w_time > 0.0 || config.starts > 1
}

/// The settings under which a start is what this frame's peaks alone say.
fn unrefined(config: &FitConfig) -> FitConfig {
    FitConfig {
        place: StartPlace::Peaks,
        yaw: Yaw::Radar,
        height: Height::Echo,
        w_time: 0.0,
        surface_offset_m: 0.0,
        ..*config
    }
}

/// The parameters of `persons`.
fn assemble(problem: &Problem, config: &FitConfig, model: &ScattererModel, persons: &[Person]) -> Pppr {
    let joints = problem.skeleton.joints.len();
    let doppler_features = problem.radar.doppler_features;
    let mut params = Pppr::zeros(PpprShape { persons: persons.len(), joints, doppler_features });
    for (k, person) in persons.iter().enumerate() {
        let velocity = person.velocity(config);
        for (joint, p) in person.joints(problem, config).into_iter().enumerate() {
            params.set_vec3(Group::Position, k * joints + joint, p);
            params.set_vec3(Group::Velocity, k * joints + joint, velocity);
        }
    }
    model.apply(&mut params, &problem.skeleton);
    params
}
