//! Frames, or parts of them, in memory within a byte budget.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// The budget where nobody sets another: 512 MiB.
pub const DEFAULT_BUDGET: usize = 512 << 20;

/// Least recently used frames go first, so that what is held never exceeds the budget.
#[derive(Debug)]
pub struct Cache<T> {
    frames: HashMap<usize, (Arc<T>, usize, u64)>,
    /// Index by time of last use.
    order: BTreeMap<u64, usize>,
    clock: u64,
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
        Self { frames: HashMap::new(), order: BTreeMap::new(), clock: 0, bytes: 0, budget }
    }

    /// The frame `index`, which is now the most recently used.
    pub fn get(&mut self, index: usize) -> Option<Arc<T>> {
        let (frame, _, used) = self.frames.get_mut(&index)?;
        self.order.remove(used);
        self.clock += 1;
        *used = self.clock;
        self.order.insert(self.clock, index);
        Some(Arc::clone(frame))
    }

    /// True where the frame is held; its time of last use stays.
    pub fn contains(&self, index: usize) -> bool {
        self.frames.contains_key(&index)
    }

    /// Keeps a frame of `bytes`, dropping old ones for it. A frame larger than the whole budget is not kept.
    pub fn insert(&mut self, index: usize, frame: Arc<T>, bytes: usize) {
        self.remove(index);
        if bytes > self.budget {
            return;
        }
        while self.bytes + bytes > self.budget {
            let Some((_, oldest)) = self.order.pop_first() else { break };
            if let Some((_, freed, _)) = self.frames.remove(&oldest) {
                self.bytes -= freed;
            }
        }
        self.clock += 1;
        self.order.insert(self.clock, index);
        self.frames.insert(index, (frame, bytes, self.clock));
        self.bytes += bytes;
    }

    /// Forgets a frame.
    pub fn remove(&mut self, index: usize) {
        if let Some((_, bytes, used)) = self.frames.remove(&index) {
            self.order.remove(&used);
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
