//! Frames, or parts of them, in memory within a byte budget.

use lru::LruCache;
use std::sync::Arc;

/// The budget where nobody sets another: 512 MiB.
pub const DEFAULT_BUDGET: usize = 512 << 20;

/// Least recently used frames go first, so that what is held never exceeds the budget.
#[derive(Debug)]
pub struct Cache<T> {
    /// Each with its bytes.
    frames: LruCache<usize, (Arc<T>, usize)>,
    bytes: usize,
    budget: usize,
}

/// Whole frames.
pub type FrameCache = Cache<super::Frame>;

impl<T> Default for Cache<T> {
    fn default() -> Self {
        Self::new(DEFAULT_BUDGET)
    }
}

impl<T> Cache<T> {
    /// An empty cache that will hold at most `budget` bytes of frames.
    pub fn new(budget: usize) -> Self {
        Self { frames: LruCache::unbounded(), bytes: 0, budget }
    }

    /// The frame `index`, which is now the most recently used.
    pub fn get(&mut self, index: usize) -> Option<Arc<T>> {
        self.frames.get(&index).map(|(frame, _)| Arc::clone(frame))
    }

    /// True where the frame is held; its time of last use stays.
    pub fn contains(&self, index: usize) -> bool {
        self.frames.contains(&index)
    }

    /// Keeps a frame of `bytes`, dropping old ones for it. A frame larger than the whole budget is not kept.
    pub fn insert(&mut self, index: usize, frame: Arc<T>, bytes: usize) {
        self.remove(index);
        if bytes > self.budget {
            return;
        }
        while self.bytes + bytes > self.budget {
            let Some((_, (_, freed))) = self.frames.pop_lru() else { break };
            self.bytes -= freed;
        }
        self.frames.put(index, (frame, bytes));
        self.bytes += bytes;
    }

    /// Forgets a frame.
    pub fn remove(&mut self, index: usize) {
        if let Some((_, bytes)) = self.frames.pop(&index) {
            self.bytes -= bytes;
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Bytes that may be held.
    pub fn budget(&self) -> usize {
        self.budget
    }

    /// Frames held.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// True where nothing is held.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }
}
