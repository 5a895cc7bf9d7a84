//! The threads that read maps and measure them.

use super::cache::CachedStatistics;
use super::history::MaskHistory;
use super::plan::Chunk;
use super::{ComplexityOptions, Statistics};
use crate::dataset::{Dataset, DatasetError, MapReader, NpzError};
use crate::study::StudyError;
use crate::task::{Progress, catch_panic};
use crossbeam_channel::{Sender, bounded};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Results that may wait to be taken: few, so that little is lost where the taker stops.
const WAITING: usize = 64;

/// What became of one frame.
#[derive(Debug)]
pub(super) struct Scanned {
    /// Its statistics, or why there are none.
    pub(super) kept: CachedStatistics,
    /// False where a frame of its window failed for a reason that may pass without any file changing.
    pub(super) lasting: bool,
}

/// Reads and measures the frames of `chunks` with `threads` threads, and hands them to `sink` in no order. Returns early
/// where `progress` is cancelled.
///
/// # Errors
/// Where the operating system gives no thread.
pub(super) fn scan(
    dataset: &Dataset,
    options: &ComplexityOptions,
    chunks: &[Chunk],
    threads: usize,
    progress: &Progress,
    mut sink: impl FnMut(usize, Scanned),
) -> Result<(), StudyError> {
    let work = Work { dataset, options, chunks, next: AtomicUsize::new(0), progress };
    std::thread::scope(|scope| {
        let (outbox, inbox) = bounded(WAITING);
        for k in 0..threads.clamp(1, chunks.len().max(1)) {
            let (work, outbox) = (&work, outbox.clone());
            let named = std::thread::Builder::new().name(format!("complexity-{k}"));
            named.spawn_scoped(scope, move || work.run(&outbox)).map_err(|reason| StudyError::Thread { reason })?;
        }
        drop(outbox);
        for (i, scanned) in inbox {
            sink(i, scanned);
        }
        Ok(())
    })
}

/// What the threads share.
struct Work<'a> {
    dataset: &'a Dataset,
    options: &'a ComplexityOptions,
    chunks: &'a [Chunk],
    next: AtomicUsize,
    progress: &'a Progress,
}

/// Why a frame has no statistics, and whether the same file may have some later.
struct Fault {
    text: String,
    passing: bool,
}

impl From<DatasetError> for Fault {
    fn from(error: DatasetError) -> Self {
        let passing = matches!(
            error,
            DatasetError::Read { .. } | DatasetError::Npz(NpzError::Read { .. }) | DatasetError::Internal { .. }
        );
        Self { text: error.to_string(), passing }
    }
}

impl Work<'_> {
    /// Takes chunks until none is left, nobody listens, or somebody pressed cancel.
    fn run(&self, outbox: &Sender<(usize, Scanned)>) {
        let views = self.dataset.info().views.iter().map(|view| (view.array.clone(), view.shape()));
        let mut history = MaskHistory::new(views, *self.options);
        while let Some(chunk) = self.chunks.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            if self.run_chunk(chunk, &mut history, outbox).is_none() {
                return;
            }
        }
    }

    /// `None` to stop.
    fn run_chunk(&self, chunk: &Chunk, history: &mut MaskHistory, outbox: &Sender<(usize, Scanned)>) -> Option<()> {
        history.forget();
        let end = chunk.frames.end;
        let mut maps = self.dataset.maps(chunk.from..end);
        // Frames, from this one on, whose window holds a failure that may pass.
        let mut doubtful = 0;
        for i in chunk.from..end {
            if self.progress.is_cancelled() {
                return None;
            }
            let measured = catch_panic(|| self.measure(i, &mut maps, history)).unwrap_or_else(|message| {
                maps = self.dataset.maps(i + 1..end);
                Err(DatasetError::Internal { message, path: self.dataset.frame_path(i) }.into())
            });
            if let Err(fault) = &measured {
                history.forget();
                doubtful = if fault.passing { self.options.window } else { doubtful };
            }
            let scanned = Scanned { kept: measured.map_err(|fault| fault.text), lasting: doubtful == 0 };
            doubtful = doubtful.saturating_sub(1);
            if chunk.frames.contains(&i) {
                outbox.send((i, scanned)).ok()?;
            }
        }
        Some(())
    }

    fn measure(&self, i: usize, maps: &mut MapReader<'_>, history: &mut MaskHistory) -> Result<Statistics, Fault> {
        let mut maps = maps.next().transpose()?.unwrap_or_default();
        history
            .push(&mut maps)
            .map_err(|why| Fault { text: format!("{}: {why}", self.dataset.frame_path(i).display()), passing: false })
    }
}
