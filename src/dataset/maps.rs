//! The maps of many frames, one after the other: what a study over a whole data set needs, without labels and truth.

use super::source::Source;
use super::{Dataset, DatasetError, Heatmap, generic, hupr, mmvr, xrf55};
use crate::radar::View;
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

/// Maps of a stacked file that are read in one pass, bytes: every pass reads the file from its start.
const STACKED_BYTES: usize = 64 << 20;

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
        let maps = Arc::new(self.read_maps(&(index..index + 1))?.into_iter().next().unwrap_or_default());
        let bytes = maps.iter().map(|map| map.data.len() * size_of::<f64>()).sum();
        recent().insert(index, Arc::clone(&maps), bytes);
        Ok(maps)
    }

    /// Frames whose maps [`Self::maps`] reads in one go: 1, or as many of a stacked file as make 64 MiB.
    pub fn maps_at_once(&self) -> usize {
        match &self.source {
            Source::Bare { stacked: true, .. } => {
                let cells: usize = self.info.views.iter().map(View::cells).sum();
                (STACKED_BYTES / (cells * size_of::<f64>()).max(1)).max(1)
            }
            _ => 1,
        }
    }

    /// The maps of consecutive frames, in this thread; at most [`Self::maps_at_once`] are asked for.
    fn read_maps(&self, frames: &Range<usize>) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        let past = || DatasetError::NoSuchFrame {
            index: frames.end.saturating_sub(1),
            count: self.len(),
            path: self.info.root.clone(),
        };
        if frames.end > self.len() {
            return Err(past());
        }
        let one = match &self.source {
            Source::Bare { stacked: true, sums, .. } => {
                sums.of(&self.info.root, &self.info)?;
                return generic::stacked_maps(frames, &self.info.root, &self.info);
            }
            Source::Files(_) | Source::Bare { .. } => generic::maps_only(&self.frame_path(frames.start), &self.info),
            Source::Stacks { steps, .. } => {
                xrf55::maps_only(&self.frame_path(frames.start), frames.start % steps, &self.info)
            }
            Source::Hupr { .. } => {
                let (segment, k) = self.segment(frames.start).ok_or_else(past)?;
                hupr::maps_only(&segment.path, segment.stem(k), &self.info)
            }
            Source::Mmvr { .. } => {
                let (segment, k) = self.segment(frames.start).ok_or_else(past)?;
                mmvr::maps_only(&segment.path, segment.stem(k), &self.info)
            }
        };
        Ok(vec![one?])
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
            match self.dataset.read_maps(&(first..end)) {
                Ok(maps) => self.ready = maps.into(),
                // Something in there cannot be read: from here on each frame answers for itself.
                Err(_) => self.at_once = 1,
            }
        }
        self.left.start = first + 1;
        let ready = self.ready.pop_front().map(Ok);
        let read =
            || self.dataset.read_maps(&(first..first + 1)).map(|maps| maps.into_iter().next().unwrap_or_default());
        Some(ready.unwrap_or_else(read))
    }
}
