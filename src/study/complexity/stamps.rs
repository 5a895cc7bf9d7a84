//! What makes a cached frame stale: the paths, sizes and times of the files of its last T frames.
//!
//! A frame's key is a hash over those, so that a file that is changed, added, removed or renamed gives itself and the
//! T − 1 frames after it other keys, wherever they now stand in the data set. Nothing is opened for that.

use super::super::StudyError;
use super::plan::Sequences;
use crate::dataset::Dataset;
use crate::task::Progress;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use std::path::Path;
use std::time::UNIX_EPOCH;

/// Two times 48 bits: exact as two `f64`, and two of a million frames share one once in 10¹⁶ data sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(in crate::study) struct Key(pub(super) [u64; 2]);

impl Key {
    fn of(hash: Sha256) -> Self {
        let digest = hash.finalize();
        let half = |at: usize| digest.iter().skip(at).take(6).fold(0, |bits, &byte| bits << 8 | u64::from(byte));
        Self([half(0), half(6)])
    }

    /// In hexadecimal digits.
    pub(in crate::study) fn text(self) -> String {
        self.0.map(|half| format!("{half:012x}")).concat()
    }
}

/// The key of every frame; `None` where a file of its window cannot even be asked for its size.
///
/// # Errors
/// On cancel.
pub(super) fn keys(
    dataset: &Dataset,
    sequences: &Sequences,
    window: usize,
    progress: &Progress,
) -> Result<Vec<Option<Key>>, StudyError> {
    progress.begin("looking for changed files", dataset.len() as u64);
    let stamps = (0..dataset.len()).into_par_iter().map(|i| {
        if progress.is_cancelled() {
            return Err(StudyError::Cancelled);
        }
        progress.advance(1);
        Ok(stamp(dataset, i))
    });
    let stamps = stamps.collect::<Result<Vec<_>, _>>()?;
    let mut keys = Vec::with_capacity(stamps.len());
    for sequence in sequences.ranges() {
        let stamps = stamps.get(sequence).unwrap_or_default();
        keys.extend((1..=stamps.len()).map(|end| stamps.get(end.saturating_sub(window)..end).and_then(joined)));
    }
    Ok(keys)
}

/// Path below the root, name, size and time of each file that the maps of one frame are made of.
pub(in crate::study) fn stamp(dataset: &Dataset, i: usize) -> Option<Key> {
    let mut hash = Sha256::new();
    for path in dataset.map_paths(i) {
        let meta = std::fs::metadata(&path).ok()?;
        let modified = meta.modified().ok()?;
        let nanoseconds = modified
            .duration_since(UNIX_EPOCH)
            .map_or_else(|before| -(before.duration().as_nanos() as i128), |after| after.as_nanos() as i128);
        hash.update(below(&path, &dataset.info().root).as_os_str().as_encoded_bytes());
        hash.update([0]);
        hash.update(dataset.frame_name(i));
        hash.update([0]);
        hash.update(meta.len().to_le_bytes());
        hash.update(nanoseconds.to_le_bytes());
    }
    Some(Key::of(hash))
}

fn below<'a>(path: &'a Path, root: &Path) -> &'a Path {
    path.strip_prefix(root).unwrap_or(path)
}

/// One key of the stamps of a window, the frame itself last.
pub(in crate::study) fn joined(stamps: &[Option<Key>]) -> Option<Key> {
    let mut hash = Sha256::new();
    for stamp in stamps {
        let Key(halves) = (*stamp)?;
        hash.update(halves.map(u64::to_le_bytes).concat());
    }
    Some(Key::of(hash))
}
