//! Where runs stop: conditions that a person set, switched on or off, and how often each was hit.

use crate::condition::Breakpoint;
use serde::{Deserialize, Serialize};

/// A condition at which runs stop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopPoint {
    /// Its number; never given again.
    pub id: u32,
    /// The condition, as it was typed.
    pub text: String,
    /// Whether runs stop there.
    pub enabled: bool,
    /// How often one did.
    #[serde(default)]
    pub hits: usize,
    /// Frame and iteration of the last time.
    #[serde(default)]
    pub last: Option<(usize, usize)>,
}

/// All of them, in the order they were set.
#[derive(Debug, Clone, Default)]
pub struct Breakpoints {
    list: Vec<StopPoint>,
    next: u32,
}

impl Breakpoints {
    /// All of them.
    pub fn list(&self) -> &[StopPoint] {
        &self.list
    }

    /// As a session file kept them.
    pub(super) fn restored(list: Vec<StopPoint>) -> Self {
        let next = list.iter().map(|point| point.id + 1).max().unwrap_or(0);
        Self { list, next }
    }

    /// Sets one that is understood, switched on.
    pub(super) fn add(&mut self, condition: &Breakpoint) {
        self.list.push(StopPoint { id: self.next, text: condition.to_string(), enabled: true, hits: 0, last: None });
        self.next += 1;
    }

    pub(super) fn remove(&mut self, id: u32) {
        self.list.retain(|point| point.id != id);
    }

    pub(super) fn of(&mut self, id: u32) -> Option<&mut StopPoint> {
        self.list.iter_mut().find(|point| point.id == id)
    }

    /// Those that are switched on, as the worker takes them.
    pub(super) fn watched(&self) -> Vec<(u32, Breakpoint)> {
        let on = self.list.iter().filter(|point| point.enabled);
        on.filter_map(|point| Some((point.id, point.text.parse().ok()?))).collect()
    }
}
