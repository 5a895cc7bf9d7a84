//! Counting the people of a data set: every frame with those before it in its sequence, on all cores. Who is who is told afterwards,
//! over all frames.

use crate::dataset::{Dataset, DatasetError, Frame, Heatmap, map_cells};
use crate::geometry::Vec3;
use crate::mhp::fill_missing;
use crate::people::{
    CLASSES, COMPARED, Confusion, Count, Counter, HISTORY, PeopleError, Scan, Tracker, TrackerOptions,
};
use crate::study::shard::{FrameCommand, ShardRow};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::ops::Range;

/// Frames that one thread counts at a time.
const CHUNK: usize = 64;
/// Frames read before the first one asked for: those that are looked at, those whose detections are looked at with these,
/// and those that these are compared with.
pub(super) const LEAD_IN: usize = HISTORY + 2 * COMPARED;

/// One frame of a data set, counted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameCount {
    /// Index in the data set.
    pub index: usize,
    /// The frame's name.
    pub frame: String,
    /// The sequence that it is of.
    pub sequence: String,
    /// How many and where, or why nobody can tell.
    pub count: Result<People, String>,
    /// Annotated number of people, where known.
    pub annotated: Option<usize>,
    /// Who is who, once [`identify`] has told: the same number is the same person within a sequence.
    #[serde(skip)]
    pub identities: Vec<usize>,
}

/// The people of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct People {
    /// How many, most probably; 4 stands for 4 or more.
    pub people: usize,
    /// Probabilities of 0, 1, 2, 3, and 4 or more people.
    pub probabilities: [f64; CLASSES],
    /// Counted from this frame alone, and not clear.
    pub uncertain: bool,
    /// Place of each person, world frame, m.
    pub places: Vec<Vec3>,
}

impl People {
    fn of(count: &Count) -> Self {
        let people = count.people();
        let places = count.seeds(people);
        Self { people, probabilities: count.probabilities, uncertain: count.is_uncertain(), places }
    }

    /// Of the number that is told.
    pub fn probability(&self) -> f64 {
        self.probabilities[self.people.min(CLASSES - 1)]
    }
}

impl FrameCount {
    /// Place of each person, world frame, m; none where nobody can tell.
    pub fn places(&self) -> &[Vec3] {
        self.count.as_ref().map_or(&[], |count| &count.places)
    }
}

impl ShardRow for FrameCount {
    const COMMAND: FrameCommand = FrameCommand::Count;

    fn index(&self) -> usize {
        self.index
    }

    fn failure(&self) -> Option<&str> {
        self.count.as_ref().err().map(String::as_str)
    }
}

/// Counts `frames`, each with those before it in its sequence, of the range or not; `done` hears of every frame, in no order. A
/// frame that cannot be read is a row without a count, and the frames after it begin anew.
///
/// # Errors
/// [`PeopleError::NoPlace`] where the views tell no place, or where the weights are damaged.
pub fn count_frames(
    dataset: &Dataset,
    frames: Range<usize>,
    done: impl Fn() + Sync,
) -> Result<Vec<FrameCount>, PeopleError> {
    let counter = Counter::new(&dataset.info().views)?;
    let chunks: Vec<Range<usize>> =
        frames.clone().step_by(CHUNK).map(|start| start..(start + CHUNK).min(frames.end)).collect();
    let rows: Vec<Vec<FrameCount>> =
        chunks.into_par_iter().map(|chunk| count_chunk(dataset, &counter, chunk, &done)).collect();
    Ok(rows.concat())
}

fn count_chunk(dataset: &Dataset, counter: &Counter, chunk: Range<usize>, done: &impl Fn()) -> Vec<FrameCount> {
    let mut window = ScanWindow::new(counter);
    let sequence = dataset.sequence(chunk.start);
    let earliest = chunk.start.saturating_sub(LEAD_IN);
    let first = (earliest..chunk.start).find(|&i| dataset.sequence(i) == sequence).unwrap_or(chunk.start);
    // Frames that fail here are told in their own row, where they were asked for.
    for (frame, maps) in (first..chunk.start).zip(dataset.maps(first..chunk.start)) {
        window.look_ahead(dataset, frame);
        let _ = window.push(maps.map_err(|error| error.to_string()));
    }
    let mut rows = Vec::with_capacity(chunk.len());
    for frame in chunk {
        if frame > 0 && dataset.sequence(frame) != dataset.sequence(frame - 1) {
            window.scans.clear();
        }
        let (annotated, maps) = labelled(dataset.load(frame));
        window.look_ahead(dataset, frame);
        let count = window.push(maps).map(|count| People::of(&count));
        let (name, sequence) = (dataset.frame_name(frame).to_owned(), dataset.sequence(frame).to_owned());
        rows.push(FrameCount { index: frame, frame: name, sequence, count, annotated, identities: Vec::new() });
        done();
    }
    rows
}

fn labelled(frame: Result<Frame, DatasetError>) -> (Option<usize>, Result<Vec<Heatmap>, String>) {
    match frame {
        Ok(frame) => (frame.person_count, Ok(frame.maps)),
        Err(error) => (None, Err(error.to_string())),
    }
}

/// The scans before the present frame, the latest first. Where there are none, those after it, the next first: what stands
/// still does so in both directions of time, and in one frame alone furniture is as good as people.
pub(super) struct ScanWindow<'a> {
    counter: &'a Counter,
    scans: VecDeque<Scan>,
    ahead: VecDeque<Scan>,
}

impl<'a> ScanWindow<'a> {
    /// Before the first frame.
    pub(super) fn new(counter: &'a Counter) -> Self {
        Self { counter, scans: VecDeque::new(), ahead: VecDeque::new() }
    }

    /// Reads the frames after `frame` in its sequence where none before it is known. One that cannot be read is left out: it
    /// is told in its own row.
    pub(super) fn look_ahead(&mut self, dataset: &Dataset, frame: usize) {
        self.ahead.clear();
        if !self.scans.is_empty() {
            return;
        }
        let sequence = dataset.sequence(frame);
        let after = (frame + 1)..(frame + 1 + COMPARED).min(dataset.len());
        for other in after.rev().filter(|&other| dataset.sequence(other) == sequence) {
            let Ok(maps) = dataset.recent_maps(other) else { continue };
            if let Ok((scan, _)) = self.count(&filled(maps.to_vec()), &self.ahead) {
                self.ahead.push_front(scan);
            }
        }
    }

    /// Counts the next frame; one that fails ends what is known of the frames before.
    pub(super) fn push(&mut self, maps: Result<Vec<Heatmap>, String>) -> Result<Count, String> {
        let counted = maps.and_then(|maps| {
            let maps = filled(maps);
            let (scan, alone) = self.count(&maps, &self.scans)?;
            // Only its own count knows the frames after it: those that follow are told of it what the counter was taught with.
            let ahead = self.scans.is_empty() && !self.ahead.is_empty();
            Ok((scan, if ahead { self.count(&maps, &self.ahead)?.1 } else { alone }))
        });
        match counted {
            Ok((scan, count)) => {
                self.scans.push_front(scan);
                self.scans.truncate(HISTORY);
                self.scans.iter_mut().skip(COMPARED).for_each(Scan::forget_maps);
                Ok(count)
            }
            Err(why) => {
                self.scans.clear();
                Err(why)
            }
        }
    }

    fn count(&self, maps: &[Heatmap], known: &VecDeque<Scan>) -> Result<(Scan, Count), String> {
        let before: Vec<&Scan> = known.iter().collect();
        let scan = self.counter.scan(&map_cells(maps), &before).map_err(|error| error.to_string())?;
        let count = self.counter.count(&scan, &before);
        Ok((scan, count))
    }
}

/// The maps without missing cells.
fn filled(mut maps: Vec<Heatmap>) -> Vec<Heatmap> {
    for map in &mut maps {
        // A map without any number is the counter's error: it names the array.
        let _ = fill_missing(&mut map.data, &map.shape);
    }
    maps
}

/// Tells who is who, in the order of the frames; 10 frames a second where nobody says.
pub fn identify(rows: &mut [FrameCount], frame_rate_hz: Option<f64>) {
    let between_s = frame_rate_hz.filter(|rate| *rate > 0.0).map_or(0.1, f64::recip);
    for sequence in rows.chunk_by_mut(|a, b| a.sequence == b.sequence) {
        let mut tracker = Tracker::new(TrackerOptions::default());
        for row in sequence {
            row.identities = tracker.step(row.places(), between_s);
        }
    }
}

/// Annotated against predicted, over the frames that have both.
pub fn confusion(rows: &[FrameCount]) -> Confusion {
    let mut confusion = Confusion::default();
    for row in rows {
        if let (Some(annotated), Ok(count)) = (row.annotated, &row.count) {
            confusion.add(annotated, count.people);
        }
    }
    confusion
}
