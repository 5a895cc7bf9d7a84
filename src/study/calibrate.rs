//! Simulated frames of known modes, fitted and measured: what the evidence's scores are calibrated on (feature `train`).
//!
//! A frame has the mode that its preset provokes (`simulate --preset f1` … `f4`). Those of the other scenarios have none,
//! though some of them have people who stand, or metal in the room: the curves tell how sure one can be in spite of that.
//! Two people 0.6 to 2 m apart are among them, so that F3 learns to tell several people who stand close from several who
//! do not. Of every sequence one frame is judged, with the four before it.

use super::evidence::masks_around;
use crate::body::Skeleton;
use crate::config::{FitConfig, Preset};
use crate::diagnose::{Annotated, EarlierFrame, EvidenceExample, EvidenceInput, Measured, STATIC_FRAMES, evidence};
use crate::labels::Tag;
use crate::mhp::{FitError, Fitter, Precision, Problem};
use crate::simulate::{Options, Recording, ScenePreset, SimulateError, SimulatedLayout};
use crate::start::find_start;
use rayon::prelude::*;
use std::sync::Arc;

/// Layouts that are simulated: MMVR-like Cartesian maps, polar maps with Doppler, HuPR's cubes.
pub const LAYOUTS: [SimulatedLayout; 3] = [SimulatedLayout::Mmvr, SimulatedLayout::Generic, SimulatedLayout::Hupr];
/// Scenarios in equal shares: preset, number of people where it is not the preset's own, and the mode.
pub const SCENARIOS: [(&str, ScenePreset, Option<usize>, Option<Tag>); 8] = [
    ("easy", ScenePreset::Easy, None, None),
    ("medium", ScenePreset::Medium, None, None),
    ("hard", ScenePreset::Hard, None, None),
    ("medium, two people", ScenePreset::Medium, Some(2), None),
    ("f1", ScenePreset::F1, None, Some(Tag::F1)),
    ("f2", ScenePreset::F2, None, Some(Tag::F2)),
    ("f3", ScenePreset::F3, None, Some(Tag::F3)),
    ("f4", ScenePreset::F4, None, Some(Tag::F4)),
];
/// Fits that are judged: the paper's, which `evidence` makes by default, and the recommended one of as many people as are
/// counted.
pub const FITS: [&str; 2] = ["paper", "recommended, people counted"];
/// Frames of a sequence, two seconds of most radars: long enough for people to sit down and to rise.
const LENGTH: usize = 20;
/// From the first frame that is looked at in a sequence to that in the next: prime to how many there may be.
const STRIDE: usize = 7;

/// A judged fit.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedFit {
    /// Whose maps.
    pub layout: SimulatedLayout,
    /// Index in [`SCENARIOS`].
    pub scenario: usize,
    /// Index in [`FITS`].
    pub fit: usize,
    /// What a curve learns from it.
    pub example: EvidenceExample,
}

/// One frame to make and to judge.
struct Job {
    seed: u64,
    layout: SimulatedLayout,
    scenario: usize,
    number: usize,
}

/// Sequences of a layout and scenario. HuPR's processing removes what stands still and its maps begin at 1.3 m, so that
/// neither F1 nor F2 can be made in them; the other layouts have the more of these, for equal shares in all.
fn sequences_of(layout: SimulatedLayout, mode: Option<Tag>, sequences: usize) -> usize {
    match (mode, layout) {
        (Some(Tag::F1 | Tag::F2), SimulatedLayout::Hupr) => 0,
        (Some(Tag::F1 | Tag::F2), _) => sequences.div_ceil(2) * 3,
        _ => sequences.div_ceil(2) * 2,
    }
}

/// Simulates, fits and measures: `sequences` sequences a layout and scenario of each seed, rounded up to an even number.
/// Frames that show nobody to a fit are left out. `done` hears of every frame.
///
/// # Errors
/// Where a recording's options make no sense, which would be a mistake in here.
pub fn judged(seeds: &[u64], sequences: usize, done: impl Fn() + Sync) -> Result<Vec<JudgedFit>, SimulateError> {
    let found: Result<Vec<Vec<JudgedFit>>, SimulateError> = jobs(seeds, sequences)
        .par_iter()
        .map(|job| {
            let judged = judge(job)?;
            done();
            Ok(judged)
        })
        .collect();
    Ok(found?.concat())
}

/// How many frames [`judged`] makes.
pub fn frame_count(seeds: &[u64], sequences: usize) -> usize {
    jobs(seeds, sequences).len()
}

fn jobs(seeds: &[u64], sequences: usize) -> Vec<Job> {
    let mut jobs = Vec::new();
    for &seed in seeds {
        for layout in LAYOUTS {
            for (scenario, (.., mode)) in SCENARIOS.iter().enumerate() {
                let numbers = 0..sequences_of(layout, *mode, sequences);
                jobs.extend(numbers.map(|number| Job { seed, layout, scenario, number }));
            }
        }
    }
    jobs
}

fn judge(job: &Job) -> Result<Vec<JudgedFit>, SimulateError> {
    let &Job { seed, layout, scenario, number } = job;
    let Some(&(_, preset, people, mode)) = SCENARIOS.get(scenario) else { return Ok(Vec::new()) };
    let recording = Recording::new(&Options {
        layout,
        presets: vec![preset],
        frames: LENGTH * (number + 1),
        sequence_length: LENGTH,
        people: people.map(|people| people..=people),
        // A scene of its own for each scenario.
        seed: seed.wrapping_mul(SCENARIOS.len() as u64).wrapping_add(scenario as u64),
        ..Options::default()
    })?;
    let sequence = recording.sequence(number);
    let first = number * STRIDE % (LENGTH - STATIC_FRAMES + 1);
    let wide = |map: &Vec<f32>| map.iter().map(|&x| f64::from(x)).collect::<Vec<f64>>();
    let frames: Vec<Vec<Vec<f64>>> =
        (first..first + STATIC_FRAMES).map(|k| sequence.frame(k).maps.iter().map(wide).collect()).collect();
    let told = |error: &FitError| tracing::debug!("{}: {error}", sequence.scenario());
    let skeleton = Skeleton::preset("coco17");
    let problem = skeleton.and_then(|skeleton| problem(&recording, skeleton, &frames).inspect_err(told).ok());
    let configs = [FitConfig::default(), FitConfig { people: 0, ..Preset::Recommended.config() }];
    let of_fit = |(fit, config): (usize, &FitConfig)| {
        let judged = measured(problem.as_ref()?, &frames, config).inspect_err(told).ok()?;
        Some(JudgedFit { layout, scenario, fit, example: EvidenceExample { seed, made_with: mode, judged } })
    };
    Ok(configs.iter().enumerate().filter_map(of_fit).collect())
}

/// The last of the frames, with those before it.
fn problem(recording: &Recording, skeleton: Skeleton, frames: &[Vec<Vec<f64>>]) -> Result<Arc<Problem>, FitError> {
    let mut ages =
        frames.iter().rev().map(|frame| frame.iter().map(Vec::as_slice).collect::<Vec<&[f64]>>()).enumerate();
    let now = ages.next().map(|(_, maps)| maps).unwrap_or_default();
    let mut problem = Problem::new(recording.radar(), skeleton, recording.views(), &now)?;
    for (age, maps) in ages {
        problem.add_neighbour(-(age as f64) / recording.frame_rate_hz(), &maps)?;
    }
    Ok(Arc::new(problem))
}

/// Fits a problem and measures what speaks for each mode.
fn measured(problem: &Arc<Problem>, frames: &[Vec<Vec<f64>>], config: &FitConfig) -> Result<Measured, FitError> {
    let initial = find_start(problem, config)?.initialisation.params;
    let mut fitter = Fitter::new(Arc::clone(problem), *config, Precision::F32, initial.clone())?;
    fitter.run_unseen(config.iterations, |_| false)?;
    let masks = masks_around(problem, &initial, fitter.params(), config, Precision::F32)?;
    let before = frames.iter().take(frames.len().saturating_sub(1)).enumerate();
    let before: Vec<EarlierFrame<'_>> =
        before.map(|(index, maps)| EarlierFrame { index, maps: maps.iter().map(Vec::as_slice).collect() }).collect();
    let input = EvidenceInput {
        problem,
        config,
        params: fitter.params(),
        masks: &masks,
        before: &before,
        annotated: Annotated::default(),
    };
    let mut found = evidence(&input).into_iter().map(|one| Some((one.raw?, one.measures)));
    Ok(std::array::from_fn(|_| found.next().flatten()))
}
