//! One piece of work on a thread of its own, with progress, an answer and a way to stop it.

use super::{Progress, catch_panic};
use crossbeam_channel::{Receiver, TryRecvError, bounded};
use std::sync::Arc;

/// Work under way. Dropping the job cancels it.
pub(crate) struct Job<T, E> {
    progress: Progress,
    answer: Receiver<Result<T, E>>,
    answered: bool,
    /// The error for what is a defect of this program or of the machine.
    broken: Arc<dyn Fn(String) -> E + Send + Sync>,
}

impl<T: Send + 'static, E: Send + 'static> Job<T, E> {
    /// Begins on the thread `name`; `wake` is called once, when the answer is there. `broken` makes an error of a panic's
    /// text, or of why there is no thread.
    pub(crate) fn start(
        name: &str,
        work: impl FnOnce(&Progress) -> Result<T, E> + Send + 'static,
        broken: impl Fn(String) -> E + Send + Sync + 'static,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let progress = Progress::new();
        let (sender, answer) = bounded(1);
        let broken: Arc<dyn Fn(String) -> E + Send + Sync> = Arc::new(broken);
        let (told, of_panic) = (progress.clone(), Arc::clone(&broken));
        let spawned = std::thread::Builder::new().name(name.into()).spawn(move || {
            let done = catch_panic(|| work(&told)).unwrap_or_else(|text| Err(of_panic(text)));
            // Nobody listens any more where the job was dropped.
            let _ = sender.send(done);
            wake();
        });
        if let Err(reason) = spawned {
            tracing::error!("no thread for {name}: {reason}");
        }
        Self { progress, answer, answered: false, broken }
    }

    /// How far it is.
    pub(crate) fn progress(&self) -> &Progress {
        &self.progress
    }

    /// The answer, once, when it is there.
    pub(crate) fn poll(&mut self) -> Option<Result<T, E>> {
        if self.answered {
            return None;
        }
        let answer = match self.answer.try_recv() {
            Ok(answer) => answer,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err((self.broken)("its thread could not run".into())),
        };
        self.answered = true;
        Some(answer)
    }

    /// Asks it to stop.
    pub(crate) fn cancel(&self) {
        self.progress.cancel();
    }
}

impl<T, E> Drop for Job<T, E> {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
