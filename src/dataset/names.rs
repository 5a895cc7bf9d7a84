//! The names of all frames, one after the other in one text: 345,000 small strings are slow and large.

use super::layout::FrameSource;
use super::set::DatasetInfo;

/// Bytes that the names of all frames may take together.
pub(super) const MAX_NAME_BYTES: usize = 256 << 20;

/// The frames' names.
#[derive(Debug, Default)]
pub(super) struct Names {
    text: String,
    ends: Vec<u32>,
}

impl Names {
    /// Of all frames; `None` where they are too long to be held.
    pub(super) fn of(frames: &dyn FrameSource, info: &DatasetInfo) -> Option<Self> {
        let mut names = Self::default();
        for i in 0..frames.count() {
            // Writing to a text does not fail.
            let _ = frames.name(i, info, &mut names.text);
            if names.text.len() > MAX_NAME_BYTES {
                return None;
            }
            names.ends.push(names.text.len() as u32);
        }
        Some(names)
    }

    /// Of frame `i`; empty past the end.
    pub(super) fn get(&self, i: usize) -> &str {
        let end = self.ends.get(i).copied().unwrap_or_default() as usize;
        let start = i.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or_default() as usize;
        self.text.get(start..end).unwrap_or_default()
    }
}
