//! Idle cores: threads that work through a list of pieces, the first pieces first, and make way for a running fit.
//!
//! A fit that a person waits for has a thread of its own, and the window another. While it runs, explorations have what cores
//! are left beside these two; where none is left they wait between two pieces, so that the fit is as fast as without them. A
//! piece is short, a fit of milliseconds or some hundred evaluations; longer ones ask [`IdleCores::make_way`] in between.

use crate::task::{Cancelled, Progress};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, LazyLock, Mutex, PoisonError};
use std::time::Duration;

/// Cores that a running fit and the window need.
const NEEDED: usize = 2;
/// Who waits looks so often whether it is still wanted.
const LOOK: Duration = Duration::from_millis(20);

/// The cores that explorations may use; cheap to clone, every clone sees the same.
#[derive(Debug, Clone, Default)]
pub struct IdleCores(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    /// Whether a fit runs that nothing must slow down.
    fit: Mutex<bool>,
    ended: Condvar,
    /// Threads at most; 0: one a core.
    threads: usize,
}

impl IdleCores {
    /// As many threads as there are cores.
    pub fn all() -> Self {
        Self::default()
    }

    /// So many threads.
    pub fn of(threads: usize) -> Self {
        Self(Arc::new(Inner { threads, ..Inner::default() }))
    }

    /// A fit begins, or has ended, that nothing must slow down.
    pub fn fit_runs(&self, runs: bool) {
        *self.0.fit.lock().unwrap_or_else(PoisonError::into_inner) = runs;
        self.0.ended.notify_all();
    }

    /// Threads that work where no fit runs.
    pub fn threads(&self) -> usize {
        if self.0.threads > 0 { self.0.threads } else { cores() }
    }

    /// Returns once thread `number` (from 0) may go on.
    ///
    /// # Errors
    /// Where nobody wants the work any more.
    pub(super) fn make_way(&self, number: usize, progress: &Progress) -> Result<(), Cancelled> {
        let left = cores().saturating_sub(NEEDED);
        let mut runs = self.0.fit.lock().unwrap_or_else(PoisonError::into_inner);
        while *runs && number >= left {
            progress.check()?;
            runs = self.0.ended.wait_timeout(runs, LOOK).unwrap_or_else(PoisonError::into_inner).0;
        }
        progress.check()
    }
}

fn cores() -> usize {
    // Asked between the steps of a fit: the system answers from files.
    static CORES: LazyLock<usize> = LazyLock::new(|| std::thread::available_parallelism().map_or(1, usize::from));
    *CORES
}

/// A thread at work: what a long piece asks between its steps.
pub(super) struct Hand<'a> {
    cores: &'a IdleCores,
    progress: &'a Progress,
    number: usize,
    /// Another thread has failed or was cancelled.
    halted: &'a AtomicBool,
}

impl Hand<'_> {
    /// Whether to go on; returns only when no fit is in the way.
    pub(super) fn go_on(&self) -> bool {
        !self.halted.load(Ordering::Relaxed) && self.cores.make_way(self.number, self.progress).is_ok()
    }
}

/// Does the pieces 0 to `pieces`, in this order as far as they begin, and hands what each comes to to `done`, one at a time.
/// Each thread keeps what `room` makes for it.
///
/// # Errors
/// Where it was cancelled, or the first error of `work`.
pub(super) fn each<R, T: Send, E: Send + From<Cancelled>>(
    (cores, progress): (&IdleCores, &Progress),
    pieces: usize,
    room: impl Fn() -> R + Sync,
    work: impl Fn(&mut R, usize, &Hand<'_>) -> Result<T, E> + Sync,
    done: impl FnMut(usize, T) + Send,
) -> Result<(), E> {
    let (next, halted) = (AtomicUsize::new(0), AtomicBool::new(false));
    let told = Mutex::new((done, None::<E>));
    let thread = |number: usize| {
        let hand = Hand { cores, progress, number, halted: &halted };
        let mut kept = room();
        loop {
            let piece = next.fetch_add(1, Ordering::Relaxed);
            if piece >= pieces {
                return;
            }
            let answer = if hand.go_on() { work(&mut kept, piece, &hand) } else { Err(Cancelled.into()) };
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            match answer {
                Ok(answer) => (told.0)(piece, answer),
                Err(error) => {
                    halted.store(true, Ordering::Relaxed);
                    told.1.get_or_insert(error);
                    return;
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for number in 1..cores.threads().clamp(1, pieces.max(1)) {
            let (thread, named) = (&thread, std::thread::Builder::new().name(format!("explore {number}")));
            // With fewer threads it takes longer, no more.
            if let Err(reason) = named.spawn_scoped(scope, move || thread(number)) {
                tracing::warn!("no thread to explore on: {reason}");
            }
        }
        thread(0);
    });
    let error = told.into_inner().unwrap_or_else(PoisonError::into_inner).1;
    error.map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    fn squares(cores: &IdleCores, progress: &Progress) -> Result<Vec<usize>, Cancelled> {
        let mut found = vec![0; 100];
        let work = |(): &mut (), piece: usize, hand: &Hand<'_>| {
            if piece == 50 && !hand.go_on() {
                return Err(Cancelled);
            }
            Ok(piece * piece)
        };
        each((cores, progress), 100, || (), work, |piece, square| found[piece] = square)?;
        Ok(found)
    }

    #[test]
    fn every_piece_is_done_with_any_number_of_threads() {
        let wanted: Vec<usize> = (0..100).map(|k| k * k).collect();
        for threads in [1, 2, 7] {
            assert_eq!(squares(&IdleCores::of(threads), &Progress::new()), Ok(wanted.clone()));
        }
    }

    #[test]
    fn cancelled_work_ends_at_once_also_while_it_makes_way() {
        let (cores, progress) = (IdleCores::of(1), Progress::new());
        progress.cancel();
        assert_eq!(squares(&cores, &progress), Err(Cancelled));
        let (cores, progress) = (IdleCores::of(64), Progress::new());
        cores.fit_runs(true);
        let canceller = progress.clone();
        let waits = std::thread::spawn(move || squares(&cores, &progress));
        canceller.cancel();
        // With cores left beside the fit some pieces may be done, but not all of them waited for.
        let answer = waits.join().unwrap();
        assert!(answer.is_err() || answer.is_ok_and(|found| found.len() == 100));
    }

    #[test]
    fn what_waits_goes_on_when_the_fit_has_ended() {
        let (cores, progress) = (IdleCores::of(2), Progress::new());
        cores.fit_runs(true);
        let waits = {
            let (cores, progress) = (cores.clone(), progress.clone());
            std::thread::spawn(move || squares(&cores, &progress))
        };
        cores.fit_runs(false);
        assert_eq!(waits.join().unwrap().unwrap().len(), 100);
    }
}
