//! Acts on settings and on the body: one from where a finger goes down until it is lifted, whatever it did in between.

use crate::config::FitConfig;
use crate::mhp::ErasedCells;
use serde::{Deserialize, Serialize};

/// Acts that can be undone.
const UNDO_DEPTH: usize = 200;

/// When a change of settings fits anew at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Live {
    /// Where a fit takes less than [`Live::QUICK_MS`].
    #[default]
    Auto,
    /// Always; a fit that takes longer is shown as far as it came.
    On,
    /// Never: settings count from the next step on.
    Off,
}

impl Live {
    /// A fit that takes less follows a finger, ms.
    pub const QUICK_MS: f64 = 50.0;
}

/// Where a live fit begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LiveFrom {
    /// At the start pose.
    #[default]
    Start,
    /// At the iteration that was on screen when the finger went down.
    Shown,
}

/// Iterations a second of a run that is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum RunSpeed {
    /// One.
    One,
    /// Ten.
    Ten,
    /// A hundred.
    Hundred,
    /// As fast as it goes.
    #[default]
    Max,
}

impl RunSpeed {
    /// All of them, slow to fast.
    pub const ALL: [Self; 4] = [Self::One, Self::Ten, Self::Hundred, Self::Max];

    /// Iterations a second; `None` as fast as it goes.
    pub fn pace(self) -> Option<f64> {
        match self {
            Self::One => Some(1.0),
            Self::Ten => Some(10.0),
            Self::Hundred => Some(100.0),
            Self::Max => None,
        }
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::One => "1/s",
            Self::Ten => "10/s",
            Self::Hundred => "100/s",
            Self::Max => "max",
        }
    }
}

/// Settings under a finger.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drag {
    /// The settings when it went down.
    pub(super) before: FitConfig,
    /// The branch that was active then.
    pub(super) from: u32,
    /// The branch that is fitted anew meanwhile, and the iteration of `from` that it begins at.
    pub(super) live: Option<(u32, usize)>,
    /// Cells that the finger takes away from what was measured, and what that is called.
    pub(super) erasing: Option<(ErasedCells, String)>,
    /// Another start that the finger has taken, and what that is called.
    pub(super) adopted: Option<String>,
}

/// An act that can be undone.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SettingsAct {
    /// Its place among all acts of the session.
    pub(super) at: u64,
    /// In words: `w_EM 0.5 → 3.5`.
    pub(super) name: String,
    /// Settings before and after.
    pub(super) settings: [FitConfig; 2],
    /// The frame, and the branches that were active before and after.
    pub(super) frame: usize,
    pub(super) branches: [u32; 2],
    /// The body was moved by hand, where the second branch begins; the iteration of the first that it left.
    pub(super) moved_at: Option<usize>,
    /// Cells were erased by hand where the second branch begins.
    pub(super) erased: bool,
}

/// Acts on settings, done and undone.
#[derive(Debug, Default)]
pub(super) struct SettingsActs {
    pub(super) undo: Vec<SettingsAct>,
    pub(super) redo: Vec<SettingsAct>,
}

impl SettingsActs {
    /// Something was done: it can be undone, and what was undone before can not be done again.
    pub(super) fn push(&mut self, act: SettingsAct) {
        self.redo.clear();
        self.undo.push(act);
        if self.undo.len() > UNDO_DEPTH {
            self.undo.remove(0);
        }
    }
}
