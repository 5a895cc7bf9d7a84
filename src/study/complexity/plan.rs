//! Who reads what: sequences are cut into chunks, so that all cores have work even where there is one sequence only.
//!
//! A chunk begins its reading T − 1 frames early, for the masks of the frames before it; those are read twice.

use crate::dataset::Dataset;
use std::ops::Range;

/// Frames of a chunk at most: the overlap of T − 1 = 4 frames is then 6 % more to read.
const LONGEST: usize = 64;
/// Chunks for each thread, so that none waits long for the last one.
const CHUNKS_A_THREAD: usize = 4;

/// Where the sequences of a data set begin.
#[derive(Debug)]
pub(super) struct Sequences {
    starts: Vec<usize>,
    frames: usize,
}

impl Sequences {
    /// Compares the names of neighbouring frames' sequences.
    pub(super) fn of(dataset: &Dataset) -> Self {
        let frames = dataset.len();
        let begins = |&i: &usize| i == 0 || dataset.sequence(i) != dataset.sequence(i - 1);
        Self { starts: (0..frames).filter(begins).collect(), frames }
    }

    /// Each sequence's frames.
    pub(super) fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        let ends = self.starts.iter().skip(1).copied().chain([self.frames]);
        self.starts.iter().copied().zip(ends).map(|(start, end)| start..end)
    }
}

/// Frames that one thread works through.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Chunk {
    /// The first frame that is read.
    pub(super) from: usize,
    /// The frames whose statistics are wanted.
    pub(super) frames: Range<usize>,
}

/// Frames of a chunk, for `unknown` frames on `threads` threads: short enough to share the work, long against the overlap,
/// and no shorter than what is read `at_once`.
pub(super) fn chunk_length(unknown: usize, threads: usize, window: usize, at_once: usize) -> usize {
    let fair = unknown.div_ceil((threads * CHUNKS_A_THREAD).max(1));
    fair.clamp(1, LONGEST).max(4 * (window - 1).max(1)).max(at_once)
}

/// The unknown frames in chunks of at most `length`, each within one sequence.
pub(super) fn chunks(sequences: &Sequences, window: usize, length: usize, known: impl Fn(usize) -> bool) -> Vec<Chunk> {
    let mut chunks = Vec::new();
    for sequence in sequences.ranges() {
        let mut next = sequence.start;
        while let Some(first) = (next..sequence.end).find(|&i| !known(i)) {
            let end = (first + 1..sequence.end.min(first + length)).find(|&i| known(i));
            next = end.unwrap_or(sequence.end.min(first + length));
            chunks.push(Chunk { from: (first + 1).saturating_sub(window).max(sequence.start), frames: first..next });
        }
    }
    chunks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unknown_frame_is_in_one_chunk_that_sees_the_frames_before_it() {
        let sequences = Sequences { starts: vec![0, 10, 13], frames: 20 };
        assert_eq!(sequences.ranges().collect::<Vec<_>>(), [0..10, 10..13, 13..20]);
        let known = |i: usize| i == 6 || i == 15;
        let cut = chunks(&sequences, 3, 4, known);
        let frames: Vec<_> = cut.iter().map(|chunk| (chunk.from, chunk.frames.clone())).collect();
        assert_eq!(frames, [(0, 0..4), (2, 4..6), (5, 7..10), (10, 10..13), (13, 13..15), (14, 16..20)]);
        assert_eq!(chunks(&sequences, 3, 4, |_| true), []);
    }

    #[test]
    fn a_short_set_is_shared_and_a_long_one_is_not_shredded() {
        assert_eq!(chunk_length(32, 2, 5, 1), 16);
        assert_eq!(chunk_length(100_000, 8, 5, 1), 64);
        assert_eq!(chunk_length(1, 8, 1, 1), 4);
        assert_eq!(chunk_length(100_000, 8, 1000, 1), 3996);
        assert_eq!(chunk_length(100_000, 8, 5, 128), 128);
    }
}
