//! How many persons a fit has: as many as the settings say, or as many as are counted (paper section 4.4).

use crate::config::{FitConfig, StartPlace};
use crate::geometry::Vec3;
use crate::mhp::{FitError, Initialisation, Neighbour, Problem, initialise_people};
use crate::people::{Count, Counter, Scan};
use std::sync::Arc;

/// A start, and the count that it rests on where people were counted.
#[derive(Debug, Clone)]
pub struct FoundStart {
    /// The start.
    pub initialisation: Initialisation,
    /// How many people were found, with probabilities; `None` for a fit of one person, which no count decides.
    pub count: Option<Count>,
}

/// Finds a start for `config.people` persons, or for as many as are counted where that is 0.
///
/// # Errors
/// [`FitError::NoStart`] where nothing stands above the background, nobody was counted, or people cannot be counted in
/// these views.
pub fn find_start(problem: &Arc<Problem>, config: &FitConfig) -> Result<FoundStart, FitError> {
    if config.people == 1 {
        // The paper looks for one person without a count, and so it goes where nothing can be counted, or nobody is.
        let asked = config.place == StartPlace::Counted && !problem.neighbours_in(config.frames_around).is_empty();
        let counted = asked.then(|| count(problem, config).ok()).flatten().filter(|count| count.people() > 0);
        let seeds = counted.map_or_else(Vec::new, |count| [count.seeds(1), count.seeds(count.people())].concat());
        return Ok(FoundStart { initialisation: initialise_people(problem, config, &seeds)?, count: None });
    }
    let count = count(problem, config)?;
    let people = if config.people == 0 { count.people() } else { config.people };
    if people == 0 {
        let reason = format!("nobody is counted (p = {:.2})", count.probability(0));
        return Err(FitError::NoStart { reason });
    }
    let seeds: Vec<Vec3> = count.seeds(people);
    let mut initialisation = initialise_people(problem, config, &seeds)?;
    let counted = count.people();
    let note = format!("{counted} counted (p = {:.2}), {people} fitted", count.probability(counted));
    initialisation.notes.insert(0, note);
    Ok(FoundStart { initialisation, count: Some(count) })
}

/// Counts the people of a frame, with those of the frames around it that a start may look at: those after it tell as much as
/// those before. The nearest in time are scanned last.
fn count(problem: &Problem, config: &FitConfig) -> Result<Count, FitError> {
    let told = |error: crate::people::PeopleError| FitError::NoStart { reason: error.to_string() };
    let counter = Counter::new(&problem.views).map_err(told)?;
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
