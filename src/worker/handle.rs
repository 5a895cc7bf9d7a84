//! The window's end of the worker.

use super::protocol::{Snapshot, WorkerCommand, WorkerMessage};
use super::thread::Thread;
use crossbeam_channel::{Receiver, Sender, TrySendError, bounded, unbounded};
use std::sync::{Arc, Mutex, PoisonError};

/// Commands that may wait; more than a person can issue between two steps.
const COMMAND_QUEUE: usize = 256;

/// A cell of which only the newest value matters.
#[derive(Debug)]
pub(super) struct Latest<T>(Mutex<Option<T>>);

impl<T> Latest<T> {
    pub(super) fn empty() -> Self {
        Self(Mutex::new(None))
    }

    pub(super) fn put(&self, value: T) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(value);
    }

    pub(super) fn take(&self) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// The worker thread; dropping it ends the thread and waits for the step that is being taken.
#[derive(Debug)]
pub struct Worker {
    commands: Sender<WorkerCommand>,
    messages: Receiver<WorkerMessage>,
    snapshot: Arc<Latest<Snapshot>>,
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
        let snapshot = Arc::new(Latest::empty());
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

    /// The newest snapshot since the last call.
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
