//! Lessons from the synthetic source: frames with known counts as the counter sees them.

use super::{CounterLesson, MapLesson};
use crate::people::{Counter, HISTORY, IMAGE, PeopleError, Scan, map_image, map_statistics};
use crate::radar::{AxisKind, View};
use crate::simulate::{Options, Recording, ScenePreset, SimulateError};
use rayon::prelude::*;
use std::ops::Range;

/// Scenarios of the lessons; the sequences take them in turn.
const PRESETS: [ScenePreset; 3] = [ScenePreset::Easy, ScenePreset::Medium, ScenePreset::Hard];
/// Of every so many sequences with one person there is one with 0, 1, 2, 3, 4: one person is what is seen most.
const ONE_OF: [usize; 5] = [8, 1, 2, 4, 8];
/// Frames of a sequence: long enough for somebody to fall and to lie, and to sit down and to rise.
const LENGTH: usize = 30;
/// From the first frame that is looked at in a sequence to that in the next: prime to how many there may be, so that all
/// occur.
const STRIDE: usize = 11;

/// One frame, as the counter sees it and as the classifier alone does.
#[derive(Debug, Clone, PartialEq)]
pub struct CounterExample {
    /// Its clusters' features.
    pub counted: CounterLesson,
    /// Statistics of its maps.
    pub alone: CounterLesson,
    /// Its maps themselves.
    pub maps: MapLesson,
    /// Frames before it in its sequence.
    pub history: usize,
    /// Easy, medium, hard.
    pub preset: ScenePreset,
}

/// MMVR-like recordings of a seed, one for each number of people: `sequences` sequences with one person, half as many with
/// two, a quarter with three, an eighth with four and with nobody.
///
/// # Errors
/// Where there are no sequences.
pub fn recordings(seed: u64, sequences: usize) -> Result<Vec<Recording>, SimulateError> {
    let recording = |(people, one_of): (usize, &usize)| {
        Recording::new(&Options {
            presets: PRESETS.to_vec(),
            frames: sequences.div_ceil(*one_of) * LENGTH,
            sequence_length: LENGTH,
            people: Some(people..=people),
            // A scene of its own for each number.
            seed: seed.wrapping_mul(ONE_OF.len() as u64).wrapping_add(people as u64),
            ..Options::default()
        })
    };
    ONE_OF.iter().enumerate().map(recording).collect()
}

/// Simulates and scans so many frames of every sequence of the recordings, from anywhere in it on, sequences side by side;
/// `done` hears of every frame.
///
/// # Errors
/// As [`Counter::scan`].
pub fn examples(
    recordings: &[Recording],
    frames: usize,
    counter: &Counter,
    done: impl Fn() + Sync,
) -> Result<Vec<CounterExample>, PeopleError> {
    let places: Vec<(usize, usize)> =
        recordings.iter().enumerate().flat_map(|(r, all)| (0..all.sequences()).map(move |k| (r, k))).collect();
    let frames = frames.min(LENGTH);
    let first = |k: usize| k * STRIDE % (LENGTH - frames + 1);
    let of = |&(r, k): &(usize, usize)| {
        let shown = first(k)..first(k) + frames;
        recordings.get(r).map_or(Ok(Vec::new()), |all| sequence(all, k, shown, counter, &done))
    };
    let found: Result<Vec<Vec<CounterExample>>, PeopleError> = places.par_iter().map(of).collect();
    Ok(found?.concat())
}

fn sequence(
    recording: &Recording,
    number: usize,
    shown: Range<usize>,
    counter: &Counter,
    done: &(impl Fn() + Sync),
) -> Result<Vec<CounterExample>, PeopleError> {
    let sequence = recording.sequence(number);
    let (mut scans, mut found): (Vec<Scan>, Vec<CounterExample>) = (Vec::new(), Vec::new());
    let views = recording.views();
    let shapes: Vec<Vec<usize>> = views.iter().map(View::shape).collect();
    for (history, k) in shown.enumerate() {
        let frame = sequence.frame(k);
        let maps: Vec<Vec<f64>> = frame.maps.iter().map(|map| map.iter().map(|&x| f64::from(x)).collect()).collect();
        let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        let before: Vec<&Scan> = scans.iter().rev().take(HISTORY).collect();
        let now = counter.scan(&maps, &before)?;
        let people = frame.joints.len();
        found.push(CounterExample {
            counted: CounterLesson::of(counter, &now, &before, people),
            alone: CounterLesson { rows: vec![map_statistics(&maps).to_vec()], people, placed: false },
            maps: lesson_of_maps(&views, &shapes, &maps, people),
            history,
            preset: sequence.preset(),
        });
        scans.push(now);
        done();
    }
    Ok(found)
}

fn lesson_of_maps(views: &[View], shapes: &[Vec<usize>], maps: &[&[f64]], people: usize) -> MapLesson {
    let shaped: Vec<(&[usize], &[f64])> = shapes.iter().map(Vec::as_slice).zip(maps.iter().copied()).collect();
    let lateral = |view: &View| view.axes.last().is_some_and(|axis| axis.kind == AxisKind::Y);
    let image = map_image(&shaped);
    let mirrored = views.iter().zip(image.chunks_exact(IMAGE[0] * IMAGE[1])).flat_map(|(view, plane)| {
        let rows = plane.chunks_exact(IMAGE[1]);
        rows.flat_map(|row| if lateral(view) { row.iter().rev().copied().collect() } else { row.to_vec() })
            .collect::<Vec<f32>>()
    });
    MapLesson { mirrored: mirrored.collect(), image, people }
}
