//! Counting the people of a data set: every frame with those before it in its sequence, on all cores. Who is who is told afterwards,
//! over all frames.

use crate::dataset::{Dataset, DatasetError, Frame, Heatmap};
use crate::geometry::Vec3;
use crate::people::{CLASSES, Confusion, Count, Counter, PeopleError, Tracker, TrackerOptions};
use crate::start::{LEAD_IN, ScanWindow};
use crate::study::shard::{FrameCommand, ShardRow};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// Frames that one thread counts at a time.
const CHUNK: usize = 64;
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
    let counter = Arc::new(Counter::new(&dataset.info().views)?);
    let chunks: Vec<Range<usize>> =
        frames.clone().step_by(CHUNK).map(|start| start..(start + CHUNK).min(frames.end)).collect();
    let rows: Vec<Vec<FrameCount>> =
        chunks.into_par_iter().map(|chunk| count_chunk(dataset, &counter, chunk, &done)).collect();
    Ok(rows.concat())
}

fn count_chunk(dataset: &Dataset, counter: &Arc<Counter>, chunk: Range<usize>, done: &impl Fn()) -> Vec<FrameCount> {
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
            window.begin_sequence();
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
