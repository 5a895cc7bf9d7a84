//! The maps of many frames, one after the other: what a study over a whole data set needs, without labels and truth.

use super::{Dataset, DatasetError, Heatmap};
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Arc, PoisonError};

/// Reads the maps of consecutive frames in the calling thread, in the order of the data set. An item is the maps of one
/// frame in the order of its views, or why they cannot be read; the frames after it are read nevertheless.
#[derive(Debug)]
pub struct MapReader<'a> {
    dataset: &'a Dataset,
    left: Range<usize>,
    at_once: usize,
    ready: VecDeque<Vec<Heatmap>>,
}

impl Dataset {
    /// The maps of `frames`, read as they are asked for. Frames of a stacked file are read many at a time.
    pub fn maps(&self, frames: Range<usize>) -> MapReader<'_> {
        MapReader { dataset: self, left: frames, at_once: self.maps_at_once(), ready: VecDeque::new() }
    }

    /// The maps of one frame, kept for a while: whoever looks at the frames around each of many frames asks for the same
    /// ones again and again.
    ///
    /// # Errors
    /// As [`Self::load`], for what the maps need.
    pub fn recent_maps(&self, index: usize) -> Result<Arc<Vec<Heatmap>>, DatasetError> {
        let recent = || self.recent.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(maps) = recent().get(index) {
            return Ok(maps);
        }
        let maps = Arc::new(self.read_maps(index..index + 1)?.into_iter().next().unwrap_or_default());
        let bytes = maps.iter().map(|map| map.data.len() * size_of::<f64>()).sum();
        recent().insert(index, Arc::clone(&maps), bytes);
        Ok(maps)
    }

    /// Frames whose maps [`Self::maps`] reads in one go: 1, or as many of a stacked file as make 64 MiB.
    pub fn maps_at_once(&self) -> usize {
        self.frames.maps_at_once(&self.info)
    }

    /// The maps of consecutive frames, in this thread; at most [`Self::maps_at_once`] are asked for.
    fn read_maps(&self, frames: Range<usize>) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        if frames.end > self.len() {
            let index = frames.end.saturating_sub(1);
            return Err(DatasetError::NoSuchFrame { index, count: self.len(), path: self.info.root.clone() });
        }
        self.frames.maps(frames, &self.info)
    }
}

impl Iterator for MapReader<'_> {
    type Item = Result<Vec<Heatmap>, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.left.is_empty() {
            return None;
        }
        let first = self.left.start;
        if self.ready.is_empty() && self.at_once > 1 {
            let end = first.saturating_add(self.at_once).min(self.left.end);
            match self.dataset.read_maps(first..end) {
                Ok(maps) => self.ready = maps.into(),
                // Something in there cannot be read: from here on each frame answers for itself.
                Err(_) => self.at_once = 1,
            }
        }
        self.left.start = first + 1;
        let ready = self.ready.pop_front().map(Ok);
        let read = || self.dataset.read_maps(first..first + 1).map(|maps| maps.into_iter().next().unwrap_or_default());
        Some(ready.unwrap_or_else(read))
    }
}
