//! How many persons a fit has: as many as the settings say, or as many as are counted (paper section 4.4).

use super::problem::rate_hz;
use super::scans::{count_each, count_people};
use super::sequence::around;
use crate::config::{FitConfig, FramesAround, StartPlace};
use crate::dataset::Dataset;
use crate::geometry::Vec3;
use crate::mhp::{FitError, Hypotheses, Initialisation, Neighbour, Problem};
use crate::people::{Count, Counter, Scan, seeds_along};
use std::sync::Arc;

/// A start, and the count that it rests on where people were counted.
#[derive(Debug, Clone)]
pub struct FoundStart {
    /// The start.
    pub initialisation: Initialisation,
    /// How many people were found, with probabilities; `None` for a fit of one person, which no count decides.
    pub count: Option<Count>,
}

/// What the persons of a frame may be, before the frames around decide.
#[derive(Debug, Clone)]
pub(super) struct Sought {
    hypotheses: Hypotheses,
    count: Option<Count>,
    /// What the count said.
    note: Option<String>,
}

impl Sought {
    /// Whether bodies of the frames around become something here.
    pub(super) fn is_carried_on(&self) -> bool {
        self.hypotheses.is_carried_on()
    }

    /// These, and what bodies of the frames `around`, each with its time, s after this one, become here.
    pub(super) fn carried_on(
        &self,
        problem: &Arc<Problem>,
        config: &FitConfig,
        around: &[(f64, &Self)],
    ) -> Result<Self, FitError> {
        let hypotheses = self.hypotheses.carried_on(problem, config, &of_each(around))?;
        Ok(Self { hypotheses, ..self.clone() })
    }

    /// The start, decided by the frames `around` with it, each with its time, s after this one.
    pub(super) fn start(
        &self,
        problem: &Arc<Problem>,
        config: &FitConfig,
        around: &[(f64, &Self)],
    ) -> Result<FoundStart, FitError> {
        let mut initialisation = self.hypotheses.start(problem, config, &of_each(around))?;
        initialisation.notes.splice(0..0, self.note.clone());
        Ok(FoundStart { initialisation, count: self.count.clone() })
    }
}

fn of_each<'a>(around: &[(f64, &'a Sought)]) -> Vec<(f64, &'a Hypotheses)> {
    around.iter().map(|&(t_s, other)| (t_s, &other.hypotheses)).collect()
}

/// A number of people is believed from this probability on, where the other is that there is nobody at all.
const SURE: f64 = 0.9;

/// Finds a start for `config.people` persons, or for as many as are counted where that is 0: in the frame and those that the
/// problem holds around it. One who knows the data set asks [`find_start_in`].
///
/// # Errors
/// [`FitError::NoStart`] where nothing stands above the background, or surely nobody is there.
pub fn find_start(problem: &Arc<Problem>, config: &FitConfig) -> Result<FoundStart, FitError> {
    seek(problem, config, || count(problem, config), Count::seeds)?.start(problem, config, &[])
}

/// As [`find_start`] for frame `frame` of a data set; people are counted with up to two seconds of frames before it
/// ([`count_people`]), unless the frame is to be taken alone.
///
/// # Errors
/// As [`find_start`].
pub fn find_start_in(
    dataset: &Dataset,
    frame: usize,
    problem: &Arc<Problem>,
    config: &FitConfig,
) -> Result<FoundStart, FitError> {
    seek_in(dataset, frame, problem, config)?.start(problem, config, &[])
}

/// As [`find_start_in`], before one of the hypotheses is chosen.
pub(super) fn seek_in(
    dataset: &Dataset,
    frame: usize,
    problem: &Arc<Problem>,
    config: &FitConfig,
) -> Result<Sought, FitError> {
    let count = || match config.frames_around {
        FramesAround::None => count(problem, config),
        _ => count_people(dataset, frame).map_err(|reason| FitError::NoStart { reason }),
    };
    seek(problem, config, count, |count, people| match config.frames_around {
        FramesAround::None => count.seeds(people),
        _ => along(dataset, frame, config, people).unwrap_or_else(|| count.seeds(people)),
    })
}

/// Frames on each side that decide with a frame where its people are: longer than a mirror or a passing makes two of them one.
const DECIDE: usize = 12;

/// Places of `people` on paths through the frames around.
fn along(dataset: &Dataset, frame: usize, config: &FitConfig, people: usize) -> Option<Vec<Vec3>> {
    let frames = around(dataset, frame, config, DECIDE);
    let t_s = |other: usize| other as f64 / rate_hz(dataset);
    let counted: Vec<(usize, Arc<Count>)> = frames
        .clone()
        .zip(count_each(dataset, frames))
        .filter_map(|(other, count)| Some((other, count.ok()?)))
        .collect();
    let now = counted.iter().position(|(other, _)| *other == frame)?;
    let counts: Vec<(f64, &Count)> = counted.iter().map(|(other, count)| (t_s(*other), count.as_ref())).collect();
    Some(seeds_along(&counts, now, people))
}

fn seek(
    problem: &Arc<Problem>,
    config: &FitConfig,
    count: impl FnOnce() -> Result<Count, FitError>,
    places: impl FnOnce(&Count, usize) -> Vec<Vec3>,
) -> Result<Sought, FitError> {
    if config.people == 1 {
        // The paper looks for one person without a count, and so it goes where nothing can be counted, or nobody is.
        let asked = config.place == StartPlace::Counted && !problem.neighbours_in(config.frames_around).is_empty();
        let counted = asked.then(|| count().ok()).flatten().filter(|count| count.people() > 0);
        return one(problem, config, counted.as_ref());
    }
    let count = match count() {
        Ok(count) => count,
        // Views that tell no place show one person, as the paper takes it.
        Err(_) if config.people == 0 && Counter::new(&problem.views).is_err() => return one(problem, config, None),
        Err(error) => return Err(error),
    };
    let people = if config.people == 0 { count.people() } else { config.people };
    if people == 0 {
        let probability = count.probability(0);
        if probability >= SURE {
            return Err(FitError::NoStart { reason: format!("nobody is counted (p = {probability:.2})") });
        }
        let note = Some(format!("nobody is counted (p = {probability:.2}), 1 fitted"));
        return Ok(Sought { count: Some(count), note, ..one(problem, config, None)? });
    }
    let found = if people == 1 && config.place == StartPlace::Counted {
        one(problem, config, Some(&count))?
    } else {
        sought(problem, config, &places(&count, people))?
    };
    let counted = count.people();
    let note = format!("{counted} counted (p = {:.2}), {people} fitted", count.probability(counted));
    Ok(Sought { count: Some(count), note: Some(note), ..found })
}

/// One person, near where people were counted.
fn one(problem: &Arc<Problem>, config: &FitConfig, counted: Option<&Count>) -> Result<Sought, FitError> {
    let seeds = counted.map_or_else(Vec::new, |count| [count.seeds(1), count.seeds(count.people())].concat());
    sought(problem, &FitConfig { people: 1, ..*config }, &seeds)
}

fn sought(problem: &Arc<Problem>, config: &FitConfig, seeds: &[Vec3]) -> Result<Sought, FitError> {
    Ok(Sought { hypotheses: Hypotheses::new(problem, config, seeds)?, count: None, note: None })
}

/// Counts the people of a frame, with those of the frames around it that a start may look at: those after it tell as much as
/// those before. The nearest in time are scanned last.
fn count(problem: &Problem, config: &FitConfig) -> Result<Count, FitError> {
    let told = |error: crate::people::PeopleError| FitError::NoStart { reason: error.to_string() };
    let counter = Counter::new(problem.views_under(config)).map_err(told)?;
    let mut around: Vec<&Neighbour> = problem.neighbours_in(config.frames_around).iter().collect();
    around.sort_by(|a, b| b.offset_s.abs().total_cmp(&a.offset_s.abs()));
    let views = 0..problem.views.len();
    let others = around.into_iter().map(|neighbour| views.clone().map(|k| neighbour.map(k)).collect());
    let mut scans: Vec<Scan> = Vec::new();
    for maps in others.chain(std::iter::once(views.clone().map(|k| problem.map(k)).collect::<Vec<&[f64]>>())) {
        let known: Vec<&Scan> = scans.iter().rev().collect();
        let scan = counter.scan(&maps, &known).map_err(told)?;
        scans.push(scan);
    }
    let latest: Vec<&Scan> = scans.iter().rev().collect();
    match latest.split_first() {
        Some((now, known)) => Ok(counter.count(now, known)),
        None => Err(FitError::NoStart { reason: "no map".to_owned() }),
    }
}
