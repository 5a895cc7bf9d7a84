//! What was looked for last, by a key: each is looked for once, and who asks meanwhile waits for the one who looks.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// A key and what was found; `None` before anybody looked. Who looks holds the lock.
struct Slot<K, V> {
    key: K,
    found: Mutex<Option<V>>,
}

/// The answers to the keys that were asked for last.
pub(super) struct Recent<K, V> {
    /// The latest first.
    slots: Mutex<VecDeque<Arc<Slot<K, V>>>>,
    kept: usize,
}

impl<K: PartialEq, V: Clone> Recent<K, V> {
    /// Keeps so many answers.
    pub(super) const fn new(kept: usize) -> Self {
        Self { slots: Mutex::new(VecDeque::new()), kept }
    }

    /// The answer to each key, in their order: first those are looked for that nobody looks for, then those that others look for meanwhile.
    pub(super) fn all(&self, keys: impl Iterator<Item = K>, look: impl Fn(&K) -> V) -> Vec<V> {
        let slots: Vec<Arc<Slot<K, V>>> = keys.map(|key| self.slot(key)).collect();
        for slot in &slots {
            if let Ok(mut found) = slot.found.try_lock() {
                found.get_or_insert_with(|| look(&slot.key));
            }
        }
        let looked = |slot: &Arc<Slot<K, V>>| {
            let mut found = slot.found.lock().unwrap_or_else(PoisonError::into_inner);
            found.get_or_insert_with(|| look(&slot.key)).clone()
        };
        slots.iter().map(looked).collect()
    }

    fn slot(&self, key: K) -> Arc<Slot<K, V>> {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let known = slots.iter().position(|slot| slot.key == key).and_then(|k| slots.remove(k));
        let slot = known.unwrap_or_else(|| Arc::new(Slot { key, found: Mutex::default() }));
        slots.push_front(Arc::clone(&slot));
        slots.truncate(self.kept);
        slot
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn each_is_looked_for_once_until_it_is_forgotten() {
        let (recent, looks) = (Recent::new(2), Cell::new(0));
        let ask = |keys: &[u32]| {
            recent.all(keys.iter().copied(), |key| {
                looks.set(looks.get() + 1);
                key * 10
            })
        };
        assert_eq!((ask(&[1, 2, 1]), looks.get()), (vec![10, 20, 10], 2));
        assert_eq!((ask(&[2]), looks.get()), (vec![20], 2));
        assert_eq!((ask(&[3]), looks.get()), (vec![30], 3));
        assert_eq!((ask(&[1]), looks.get()), (vec![10], 4), "1 is the one that was asked for longest ago");
    }
}
