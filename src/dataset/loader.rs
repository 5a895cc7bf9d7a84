//! Frames off the window's thread: the latest request wins, what is likely next is read while nobody waits.

use super::{Dataset, DatasetError, Frame, FrameCache};
use crate::task::catch_panic;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Frames read ahead of the one asked for.
const AHEAD: usize = 3;

/// A frame, or why there is none.
pub type Loaded = Result<Arc<Frame>, DatasetError>;

#[derive(Debug, Default)]
struct State {
    /// The request that the thread has not begun.
    wanted: Option<usize>,
    /// The newest request, whose answer is the only one that matters.
    current: Option<usize>,
    ahead: VecDeque<usize>,
    answer: Option<(usize, Loaded)>,
    /// The newest request has no answer yet.
    pending: bool,
    cache: FrameCache,
    stop: bool,
}

struct Shared {
    dataset: Arc<Dataset>,
    state: Mutex<State>,
    changed: Condvar,
    wake: Box<dyn Fn() + Send + Sync>,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The thread `frame-loader` with a data set and a cache. Dropping it ends the thread.
pub struct Loader {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Loader {
    /// Starts with the default budget; `wake` is called whenever an answer is there.
    pub fn start(dataset: Arc<Dataset>, wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self::with_cache(dataset, FrameCache::default(), wake)
    }

    /// Starts with this cache.
    pub fn with_cache(dataset: Arc<Dataset>, cache: FrameCache, wake: impl Fn() + Send + Sync + 'static) -> Self {
        let state = Mutex::new(State { cache, ..State::default() });
        let shared = Arc::new(Shared { dataset, state, changed: Condvar::new(), wake: Box::new(wake) });
        let inside = Arc::clone(&shared);
        let spawned = std::thread::Builder::new().name("frame-loader".into()).spawn(move || run(&inside));
        let thread = spawned.inspect_err(|reason| tracing::error!("no thread to load frames: {reason}")).ok();
        Self { shared, thread }
    }

    /// The data set.
    pub fn dataset(&self) -> &Arc<Dataset> {
        &self.shared.dataset
    }

    /// Asks for frame `i`; any earlier request that is not answered yet is dropped. A frame in the cache is answered at
    /// once: the next [`Self::poll`] has it.
    pub fn request(&self, i: usize) {
        let mut state = self.shared.lock();
        state.current = Some(i);
        state.answer = None;
        state.ahead = (i + 1..).take(AHEAD).take_while(|&next| next < self.shared.dataset.len()).collect();
        let cached = state.cache.get(i);
        if let Some(frame) = cached {
            state.wanted = None;
            state.pending = false;
            state.answer = Some((i, Ok(frame)));
            drop(state);
            (self.shared.wake)();
        } else {
            state.wanted = Some(i);
            state.pending = true;
            drop(state);
        }
        self.shared.changed.notify_one();
    }

    /// The answer to the latest request, once, when it is there.
    pub fn poll(&self) -> Option<(usize, Loaded)> {
        self.shared.lock().answer.take()
    }

    /// True while the latest request is not answered.
    pub fn is_loading(&self) -> bool {
        self.shared.lock().pending
    }

    /// Bytes and frames in the cache.
    pub fn cached(&self) -> (usize, usize) {
        let state = self.shared.lock();
        (state.cache.bytes(), state.cache.len())
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        self.shared.lock().stop = true;
        self.shared.changed.notify_one();
        if let Some(thread) = self.thread.take() {
            // It cannot have panicked: loading is caught.
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared) {
    while let Some((index, asked)) = next(shared) {
        let load = || shared.dataset.load(index).map(Arc::new);
        let broken = |message| Err(DatasetError::Internal { message, path: shared.dataset.frame_path(index) });
        let loaded = catch_panic(load).unwrap_or_else(broken);
        let mut state = shared.lock();
        if let Ok(frame) = &loaded {
            state.cache.insert(index, Arc::clone(frame), frame.bytes());
        }
        // A frame read ahead may have been asked for meanwhile; one asked for may be stale.
        let answers = state.current == Some(index) && (asked || state.wanted == Some(index));
        if answers {
            state.wanted = state.wanted.filter(|&wanted| wanted != index);
            state.answer = Some((index, loaded));
            state.pending = false;
            drop(state);
            (shared.wake)();
        }
    }
}

/// Waits for work; `None` to stop. The flag says whether somebody asked for it.
fn next(shared: &Shared) -> Option<(usize, bool)> {
    let mut state = shared.lock();
    loop {
        if state.stop {
            return None;
        }
        if let Some(index) = state.wanted.take() {
            return Some((index, true));
        }
        if let Some(index) = state.ahead.pop_front() {
            if state.cache.contains(index) {
                continue;
            }
            return Some((index, false));
        }
        state = shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
    }
}
