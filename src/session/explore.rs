//! The explorations of the session: what was asked last of each, and what is known of it.

use super::work::Work;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::explore::{
    AmbiguityMap, Exploration, ExplorationKind, Explored, IdleCores, LossSlice, RestartCloud, TuningMap,
};
use crate::mhp::ErasedCells;
use std::collections::BTreeMap;
use std::sync::Arc;

/// One exploration.
#[derive(Debug, Default)]
pub struct ExplorationState {
    /// How far it is.
    pub work: Work,
    /// What was asked last, and the number of that request.
    pub(super) asked: Option<(u64, Exploration)>,
    /// What was found so far of what was asked, or of what was asked before, and the frame that was on screen then.
    pub(super) found: Option<(u64, Explored)>,
    /// The frame that was on screen when the newest was asked.
    pub(super) frame: usize,
    /// That of what was found.
    pub(super) found_frame: usize,
    /// Why the newest request has no answer.
    pub fault: Option<String>,
}

/// All of them.
#[derive(Debug, Default)]
pub struct Explorations {
    /// The cores that they share, and what panes ask of the state on screen with them.
    pub cores: IdleCores,
    states: BTreeMap<ExplorationKind, ExplorationState>,
    pub(super) requests: u64,
}

impl Explorations {
    /// One of them; `None` where nothing was asked of it yet.
    pub fn state(&self, kind: ExplorationKind) -> Option<&ExplorationState> {
        self.states.get(&kind)
    }

    pub(super) fn change(&mut self, kind: ExplorationKind) -> &mut ExplorationState {
        self.states.entry(kind).or_default()
    }

    /// Nothing was asked, but numbers of requests go on.
    pub(super) fn forget(&mut self) {
        self.states.clear();
    }

    /// Whether one is under way.
    pub fn is_running(&self, kind: ExplorationKind) -> bool {
        self.state(kind).is_some_and(|state| state.work.is_running())
    }

    /// Whether any is under way.
    pub fn any_running(&self) -> bool {
        self.states.values().any(|state| state.work.is_running())
    }

    /// What is under way.
    pub(super) fn under_way(&self) -> Vec<ExplorationKind> {
        self.states.iter().filter(|(_, state)| state.work.is_running()).map(|(kind, _)| *kind).collect()
    }

    /// What was asked last.
    pub fn asked(&self, kind: ExplorationKind) -> Option<&Exploration> {
        self.state(kind)?.asked.as_ref().map(|(_, asked)| asked)
    }

    /// What is known, all of it or so far; of an older request until there is something of the newer one.
    pub fn found(&self, kind: ExplorationKind) -> Option<&Explored> {
        self.state(kind)?.found.as_ref().map(|(_, found)| found)
    }

    /// Whether what is known is of what was asked last.
    pub fn is_current(&self, kind: ExplorationKind) -> bool {
        let state = self.state(kind);
        state.is_some_and(|s| s.asked.as_ref().map(|(n, _)| n) == s.found.as_ref().map(|(n, _)| n))
    }

    /// What is known as far as it is of this frame.
    fn found_of(&self, kind: ExplorationKind, frame: usize) -> Option<&Explored> {
        self.state(kind).filter(|state| state.found_frame == frame)?;
        self.found(kind)
    }

    /// The tuning map, of whichever frames.
    pub fn tuning(&self) -> Option<&Arc<TuningMap>> {
        match self.found(ExplorationKind::Tuning)? {
            Explored::Tuning(map) => Some(map),
            _ => None,
        }
    }

    /// The slice of the loss of a frame.
    pub fn landscape(&self, frame: usize) -> Option<&Arc<LossSlice>> {
        match self.found_of(ExplorationKind::Landscape, frame)? {
            Explored::Landscape(slice) => Some(slice),
            _ => None,
        }
    }

    /// The ambiguity map of a frame.
    pub fn ambiguity(&self, frame: usize) -> Option<&Arc<AmbiguityMap>> {
        match self.found_of(ExplorationKind::Ambiguity, frame)? {
            Explored::Ambiguity(map) => Some(map),
            _ => None,
        }
    }

    /// The restart cloud of a frame.
    pub fn restarts(&self, frame: usize) -> Option<&Arc<RestartCloud>> {
        match self.found_of(ExplorationKind::Restarts, frame)? {
            Explored::Restarts(cloud) => Some(cloud),
            _ => None,
        }
    }
}

/// What a thread tells of an exploration.
#[derive(Debug)]
pub enum ExploreNews {
    /// So much is done, of so much.
    Progress(u64, u64),
    /// So much was found.
    Grew(Explored),
    /// It ended: with its answer, or cancelled (`None`), or why it cannot be.
    Ended(Result<Option<Explored>, String>),
}

/// A fit that is taken from an exploration as a branch: it is made again, from its start, step by step.
#[derive(Debug, Clone)]
pub struct AdoptedFit {
    /// Where it begins.
    pub start: Arc<Pppr>,
    /// The pose that its EM region is laid around, where that is not the first start of the frame.
    pub around: Option<Arc<Pppr>>,
    /// Cells that it does not see.
    pub erased: Arc<[ErasedCells]>,
    /// Its settings.
    pub config: FitConfig,
    /// What it is, besides its settings, in words.
    pub words: String,
}
