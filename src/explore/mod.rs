//! Explorations: what else could the fit have done, and what does it rest on? Many fits or evaluations around the one on screen, shown as they come.
//!
//! | exploration | question |
//! |---|---|
//! | [`TuningMap`] | how does the end of a fit depend on one or two settings? |
//! | [`LossSlice`] | what does the loss look like around this state, and between two? |
//! | [`AmbiguityMap`] | where in the room, and how turned, would this body explain the echo as well? |
//! | [`RestartCloud`] | is the frame ambiguous, or was the start unlucky? |
//! | [`leave_one_out`] | who lit the maps: how much of their agreement is each joint's? |
//! | [`Observability`] | what does the echo fix of the pose, and what only the prior? |
//! | [`TauRibbon`] | which τ would one take? |
//! | [`ClosureTest`] | could this pose have been recovered from this radar at all? |
//! | [`WhatIf`] | what would another radar see? |
//!
//! **How they run.** Each is a plain function from a request to an answer, which knows neither window nor thread: the command
//! line calls it, and the window lets it run beside itself ([`IdleCores`]), the newest request of a kind first, an older one
//! cancelled at once. It works coarse to fine and shows what is there several times a second ([`Showing`]). What a running fit needs
//! is left to it. The same request gives the same numbers with any number of threads.
//!
//! To add one, write its file, and name it in the tables of this file.

mod ambiguity;
mod closure;
mod coarse;
mod cores;
mod echo_radar;
mod joints;
mod landscape;
mod modes;
mod moves;
mod observe;
mod plane;
mod restarts;
mod state;
mod task;
mod tau;
mod tuning;
mod what_if;

pub use ambiguity::{AMBIGUITY_CELLS, AmbiguityMap, AmbiguityRequest, AmbiguitySettings, EmPlane, RegionOf};
pub use closure::{ClosureRequest, ClosureTest, closure_test};
pub use cores::IdleCores;
pub use joints::{LeaveOneOut, LeftOut, leave_one_out};
pub use landscape::{
    Direction, LossSlice, SliceAlong, SliceRequest, SliceSettings, SliceValue, down_the_gradient, line,
};
pub use modes::PoseMode;
pub use moves::{move_person, root_of, yaw_between};
pub use observe::{Noise, Observability, UnseenDirection, observability};
pub use plane::{Minimum, SampleAxis, minima};
pub use restarts::{
    Basin, Restart, RestartCloud, RestartRequest, RestartSettings, StartFeature, StartOffset, Telling, heading,
};
pub use state::ExploredState;
pub use task::{Halt, Showing};
pub use tau::{TauClouds, TauRibbon, tau_clouds, tau_ribbon};
pub use tuning::{AxisValues, TunedFrames, TunedQuantity, TuningAxis, TuningMap, TuningRequest, TuningSettings};
pub use what_if::{RadarChange, Seen, WhatIf, preset_of, what_if};

use crate::task::Progress;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The explorations there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ExplorationKind {
    /// [`TuningMap`]
    Tuning,
    /// [`LossSlice`]
    Landscape,
    /// [`AmbiguityMap`]
    Ambiguity,
    /// [`RestartCloud`]
    Restarts,
}

impl ExplorationKind {
    /// Every one.
    pub const ALL: [Self; 4] = [Self::Tuning, Self::Landscape, Self::Ambiguity, Self::Restarts];

    /// In words, as the title of its pane.
    pub fn title(self) -> &'static str {
        match self {
            Self::Tuning => "tuning map",
            Self::Landscape => "loss landscape",
            Self::Ambiguity => "ambiguity map",
            Self::Restarts => "restart cloud",
        }
    }
}

/// What is to be explored.
#[derive(Debug, Clone)]
pub enum Exploration {
    /// For a [`TuningMap`].
    Tuning(Box<TuningRequest>),
    /// For a [`LossSlice`].
    Landscape(Box<SliceRequest>),
    /// For an [`AmbiguityMap`].
    Ambiguity(Box<AmbiguityRequest>),
    /// For a [`RestartCloud`].
    Restarts(Box<RestartRequest>),
}

/// What was found, all of it or so far.
#[derive(Debug, Clone)]
pub enum Explored {
    /// Fits of a grid of settings.
    Tuning(Arc<TuningMap>),
    /// The loss along a direction or over two.
    Landscape(Arc<LossSlice>),
    /// L_EM over the floor, and over heading and height.
    Ambiguity(Arc<AmbiguityMap>),
    /// Fits from many starts.
    Restarts(Arc<RestartCloud>),
}

/// What a person chose of each exploration.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ExploreSettings {
    /// Of the tuning map.
    pub tuning: TuningSettings,
    /// Of the loss landscape.
    pub landscape: SliceSettings,
    /// Of the ambiguity map.
    pub ambiguity: AmbiguitySettings,
    /// Of the restart cloud.
    pub restarts: RestartSettings,
}

impl Exploration {
    /// Which it is.
    pub fn kind(&self) -> ExplorationKind {
        match self {
            Self::Tuning(_) => ExplorationKind::Tuning,
            Self::Landscape(_) => ExplorationKind::Landscape,
            Self::Ambiguity(_) => ExplorationKind::Ambiguity,
            Self::Restarts(_) => ExplorationKind::Restarts,
        }
    }

    /// Whether another request asks for the same.
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Tuning(a), Self::Tuning(b)) => a.is_same(b),
            (Self::Landscape(a), Self::Landscape(b)) => a.is_same(b),
            (Self::Ambiguity(a), Self::Ambiguity(b)) => a.is_same(b),
            (Self::Restarts(a), Self::Restarts(b)) => a.is_same(b),
            _ => false,
        }
    }

    /// Explores on these cores; `look` gets what is there so far.
    ///
    /// # Errors
    /// Where it was cancelled, or cannot be done.
    pub fn explore(
        &self,
        cores: &IdleCores,
        progress: &Progress,
        look: &(dyn Fn(Explored) + Sync),
    ) -> Result<Explored, Halt> {
        match self {
            Self::Tuning(request) => {
                let look = |map| look(Explored::Tuning(Arc::new(map)));
                tuning::explore(request, cores, &Showing::new(progress, &look)).map(Arc::new).map(Explored::Tuning)
            }
            Self::Landscape(request) => {
                let look = |slice| look(Explored::Landscape(Arc::new(slice)));
                landscape::explore(request, cores, &Showing::new(progress, &look))
                    .map(Arc::new)
                    .map(Explored::Landscape)
            }
            Self::Ambiguity(request) => {
                let look = |map| look(Explored::Ambiguity(Arc::new(map)));
                ambiguity::explore(request, cores, &Showing::new(progress, &look))
                    .map(Arc::new)
                    .map(Explored::Ambiguity)
            }
            Self::Restarts(request) => {
                let look = |cloud| look(Explored::Restarts(Arc::new(cloud)));
                restarts::explore(request, cores, &Showing::new(progress, &look)).map(Arc::new).map(Explored::Restarts)
            }
        }
    }
}

/// Fits the points of a tuning map on these cores.
///
/// # Errors
/// As [`Exploration::explore`].
pub fn tuning_map(request: &TuningRequest, cores: &IdleCores, progress: &Progress) -> Result<TuningMap, Halt> {
    tuning::explore(request, cores, &Showing::new(progress, &|_| {}))
}

/// Evaluates a slice on these cores.
///
/// # Errors
/// As [`Exploration::explore`].
pub fn loss_slice(request: &SliceRequest, cores: &IdleCores, progress: &Progress) -> Result<LossSlice, Halt> {
    landscape::explore(request, cores, &Showing::new(progress, &|_| {}))
}

/// Evaluates an ambiguity map on these cores.
///
/// # Errors
/// As [`Exploration::explore`].
pub fn ambiguity_map(request: &AmbiguityRequest, cores: &IdleCores, progress: &Progress) -> Result<AmbiguityMap, Halt> {
    ambiguity::explore(request, cores, &Showing::new(progress, &|_| {}))
}

/// Fits from many starts on these cores.
///
/// # Errors
/// As [`Exploration::explore`].
pub fn restart_cloud(request: &RestartRequest, cores: &IdleCores, progress: &Progress) -> Result<RestartCloud, Halt> {
    restarts::explore(request, cores, &Showing::new(progress, &|_| {}))
}
