//! The window's end of the worker.

use super::protocol::{Snapshot, WorkerCommand, WorkerMessage};
use super::thread::Thread;
use crossbeam_channel::{Receiver, Sender, TrySendError, bounded, unbounded};
use std::sync::{Arc, Mutex, PoisonError};

/// Commands that may wait; more than a person can issue between two steps.
const COMMAND_QUEUE: usize = 256;

/// Snapshots of which only the newest of a kind matters: a run's pictures must not replace the answer to somebody who
/// looks back, however slow the window is to take it.
#[derive(Debug, Default)]
pub(super) struct Latest {
    live: Mutex<Option<Snapshot>>,
    answer: Mutex<Option<Snapshot>>,
}

impl Latest {
    pub(super) fn put(&self, snapshot: Snapshot) {
        let cell = if snapshot.live { &self.live } else { &self.answer };
        *cell.lock().unwrap_or_else(PoisonError::into_inner) = Some(snapshot);
    }

    pub(super) fn take(&self) -> Option<Snapshot> {
        let take = |cell: &Mutex<Option<Snapshot>>| cell.lock().unwrap_or_else(PoisonError::into_inner).take();
        take(&self.answer).or_else(|| take(&self.live))
    }
}

/// The worker thread; dropping it ends the thread and waits for the step that is being taken.
#[derive(Debug)]
pub struct Worker {
    commands: Sender<WorkerCommand>,
    messages: Receiver<WorkerMessage>,
    snapshot: Arc<Latest>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread `mhp-worker`. `wake` is called after every message, from that thread.
    ///
    /// # Errors
    /// Where the operating system gives no thread.
    pub fn spawn(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (commands, inbox) = bounded(COMMAND_QUEUE);
        let (outbox, messages) = unbounded();
        let snapshot = Arc::new(Latest::default());
        let mut body = Thread::new(inbox, outbox, Arc::clone(&snapshot), Box::new(wake));
        let thread = std::thread::Builder::new().name("mhp-worker".into()).spawn(move || body.run())?;
        Ok(Self { commands, messages, snapshot, thread: Some(thread) })
    }

    /// Sends a command. Blocks only when the queue is full, which means that the worker is still draining it.
    pub fn send(&self, command: WorkerCommand) {
        match self.commands.try_send(command) {
            Ok(()) => {}
            Err(TrySendError::Full(command)) => {
                let _ = self.commands.send(command);
            }
            Err(TrySendError::Disconnected(_)) => tracing::error!("the fit worker is gone"),
        }
    }

    /// The next row batch or event, if one waits.
    pub fn poll(&self) -> Option<WorkerMessage> {
        self.messages.try_recv().ok()
    }

    /// Blocks until the next row batch or event; `None` when the thread is gone. For tests and headless use.
    pub fn wait(&self, timeout: std::time::Duration) -> Option<WorkerMessage> {
        self.messages.recv_timeout(timeout).ok()
    }

    /// The newest answer to [`WorkerCommand::Inspect`], else the newest picture of the run, each once. Call until `None`.
    pub fn take_snapshot(&self) -> Option<Snapshot> {
        self.snapshot.take()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        let _ = self.commands.send(WorkerCommand::Shutdown);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the fit worker ended in a panic");
        }
    }
}
