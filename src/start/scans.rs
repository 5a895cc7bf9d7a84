//! Counting people with the frames before: twenty of them agree on a number that the few around a frame do not know.

use super::recent::Recent;
use crate::dataset::{Dataset, Heatmap, map_cells};
use crate::mhp::fill_missing;
use crate::people::{COMPARED, Count, Counter, HISTORY, Scan};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Frames read before the first one asked for: those that are looked at, those whose detections are looked at with these,
/// and those that these are compared with.
pub const LEAD_IN: usize = HISTORY + 2 * COMPARED;

/// Counts that are kept: those around the frames that are fitted at a time.
const KEPT: usize = 256;

/// The counts of frames that were asked for last, by data set and frame.
static COUNTS: Recent<(u64, usize), Result<Arc<Count>, String>> = Recent::new(KEPT);

/// What a thread counted last: the next frame of the sequence takes one scan, not all of them.
struct Latest {
    dataset: u64,
    frame: usize,
    window: ScanWindow,
}

thread_local! {
    static LATEST: RefCell<Option<Latest>> = const { RefCell::new(None) };
}

/// Counts the people of a frame with those before it in its sequence, up to two seconds of most radars; the same, whatever
/// was counted before.
///
/// # Errors
/// Where people cannot be counted in these views, or the frame cannot be read, in words.
pub fn count_people(dataset: &Dataset, frame: usize) -> Result<Count, String> {
    let counted = count_each(dataset, frame..frame + 1).pop();
    counted.unwrap_or_else(|| Err("no frame".to_owned())).map(Arc::unwrap_or_clone)
}

/// As [`count_people`] for each of consecutive frames.
pub(super) fn count_each(dataset: &Dataset, frames: Range<usize>) -> Vec<Result<Arc<Count>, String>> {
    COUNTS.all(frames.map(|frame| (dataset.id(), frame)), |&(_, frame)| counted(dataset, frame).map(Arc::new))
}

fn counted(dataset: &Dataset, frame: usize) -> Result<Count, String> {
    LATEST.with_borrow_mut(|latest| {
        let follows = |known: &Latest| {
            let next = (known.dataset, known.frame + 1) == (dataset.id(), frame);
            next && dataset.sequence(known.frame) == dataset.sequence(frame)
        };
        let mut window = match latest.take().filter(follows) {
            Some(known) => known.window,
            None => before(dataset, frame)?,
        };
        let count = step(dataset, frame, &mut window);
        *latest = Some(Latest { dataset: dataset.id(), frame, window });
        count
    })
}

/// The scans of the frames before one, none of it.
fn before(dataset: &Dataset, frame: usize) -> Result<ScanWindow, String> {
    let counter = Counter::new(&dataset.info().views).map_err(|error| error.to_string())?;
    let mut window = ScanWindow::new(&Arc::new(counter));
    let sequence = dataset.sequence(frame);
    let earlier = (frame.saturating_sub(LEAD_IN)..frame).skip_while(|&other| dataset.sequence(other) != sequence);
    for other in earlier {
        // One that cannot be read ends what is known, as it does where all frames are counted.
        let _ = step(dataset, other, &mut window);
    }
    Ok(window)
}

fn step(dataset: &Dataset, frame: usize, window: &mut ScanWindow) -> Result<Count, String> {
    window.look_ahead(dataset, frame);
    window.push(dataset.recent_maps(frame).map(|maps| maps.to_vec()).map_err(|error| error.to_string()))
}

/// Counts the frames of a sequence one after the other: the scans before the present frame, the latest first. Where there are none, those after it, the next first: what stands
/// still does so in both directions of time, and in one frame alone furniture is as good as people.
#[derive(Debug)]
pub struct ScanWindow {
    counter: Arc<Counter>,
    scans: VecDeque<Scan>,
    ahead: VecDeque<Scan>,
}

impl ScanWindow {
    /// Before the first frame.
    pub fn new(counter: &Arc<Counter>) -> Self {
        Self { counter: Arc::clone(counter), scans: VecDeque::new(), ahead: VecDeque::new() }
    }

    /// Forgets the frames before: the next one begins a sequence.
    pub fn begin_sequence(&mut self) {
        self.scans.clear();
    }

    /// Reads the frames after `frame` in its sequence where none before it is known. One that cannot be read is left out: it
    /// is told in its own row.
    pub fn look_ahead(&mut self, dataset: &Dataset, frame: usize) {
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
    ///
    /// # Errors
    /// Where `maps` is one, or they are not those of the views, in words.
    pub fn push(&mut self, maps: Result<Vec<Heatmap>, String>) -> Result<Count, String> {
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
