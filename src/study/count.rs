//! Counting the people of a data set: every frame with those before it in its sequence, on all cores.

use crate::dataset::{Dataset, DatasetError, Frame, Heatmap, map_cells};
use crate::geometry::Vec3;
use crate::mhp::fill_missing;
use crate::people::{COMPARED, Confusion, Count, Counter, HISTORY, PeopleError, Scan, Tracker, TrackerOptions};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::Range;

/// Frames that one thread counts at a time.
const CHUNK: usize = 64;
/// Frames read before the first one asked for: those that are looked at, those whose detections are looked at with these,
/// and those that these are compared with.
pub(super) const LEAD_IN: usize = HISTORY + 2 * COMPARED;

/// One frame of a data set, counted.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameCount {
    /// Index in the data set.
    pub frame: usize,
    /// Number and clusters, or why there is none.
    pub count: Result<Count, String>,
    /// Annotated number of people, where known.
    pub annotated: Option<usize>,
    /// Place of each person, world frame, m.
    pub places: Vec<Vec3>,
    /// Who is who: the same number is the same person within a sequence.
    pub identities: Vec<usize>,
}

/// Counts `frames`; `done` hears of every frame, in no order. A frame that cannot be read is a row without a count, and
/// the frames after it begin anew.
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
    let mut rows = rows.concat();
    identify(dataset, &mut rows);
    Ok(rows)
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
        let count = window.push(maps);
        rows.push(FrameCount { frame, count, annotated, places: Vec::new(), identities: Vec::new() });
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

/// Places, and who is who, in the order of the frames.
fn identify(dataset: &Dataset, rows: &mut [FrameCount]) {
    let between_s = dataset.info().frame_rate_hz.filter(|rate| *rate > 0.0).map_or(0.1, f64::recip);
    let mut tracker = Tracker::new(TrackerOptions::default());
    let mut last: Option<usize> = None;
    for row in rows {
        if last.is_none_or(|last| dataset.sequence(last) != dataset.sequence(row.frame)) {
            tracker = Tracker::new(TrackerOptions::default());
        }
        if let Ok(count) = &row.count {
            row.places = count.seeds(count.people());
        }
        row.identities = tracker.step(&row.places, between_s);
        last = Some(row.frame);
    }
}

/// Annotated against predicted, over the frames that have both.
pub fn confusion(rows: &[FrameCount]) -> Confusion {
    let mut confusion = Confusion::default();
    for row in rows {
        if let (Some(annotated), Ok(count)) = (row.annotated, &row.count) {
            confusion.add(annotated, count.people());
        }
    }
    confusion
}
