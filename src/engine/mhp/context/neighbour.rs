//! A frame shortly before or after.

use std::sync::Arc;

/// The maps of a frame shortly before or after; a clone shares them.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbour {
    /// Seconds after the frame that is fitted; negative before it.
    pub offset_s: f64,
    /// One map a view, C-ordered, missing cells filled.
    maps: Arc<Vec<Vec<f64>>>,
}

impl Neighbour {
    /// `maps`, one a view, C-ordered, `offset_s` seconds after the frame that is fitted.
    pub(in crate::mhp) fn new(offset_s: f64, maps: Vec<Vec<f64>>) -> Self {
        Self { offset_s, maps: Arc::new(maps) }
    }

    /// H_ori of a view at that time; empty where there is no such view.
    pub fn map(&self, view: usize) -> &[f64] {
        self.maps.get(view).map_or(&[], Vec::as_slice)
    }

    /// H_ori of every view at that time.
    pub(in crate::mhp) fn slices(&self) -> Vec<&[f64]> {
        self.maps.iter().map(Vec::as_slice).collect()
    }
}
