//! What a start and the convergence test read: where the program goes beyond the paper's words, or the words leave a choice.
//!
//! Each default is what SPEC and the program settled on; [`super::Preset::Paper`] takes the other side, and
//! [`super::deviations`] tells why and what it costs.

use serde::{Deserialize, Serialize};

/// Which frames beside its own a start may look at: for what stands still, the count, heading, place and velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FramesAround {
    /// Those before and after it.
    #[default]
    Both,
    /// Those before it alone: what a radar that runs can know.
    Past,
    /// None.
    None,
}

impl FramesAround {
    /// How many choices there are.
    pub const COUNT: usize = 3;
}

/// What becomes of echoes that do not change over the frames around.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Still {
    /// They are no evidence of a person.
    #[default]
    LeftOut,
    /// They count as all others do.
    Kept,
}

/// What a cell is compared with before it counts as an echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Background {
    /// The median of the cells at its range.
    #[default]
    Range,
    /// The median of the map: the order of the peaks is that of H itself.
    Map,
}

/// How the intensity gradient becomes a velocity, where there is no Doppler axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GradientVelocity {
    /// γ·g with the sign of the change to the nearest frame; 0 without such a frame.
    #[default]
    Flow,
    /// γ·g as printed: a magnitude, hence away from the radar, of the frame alone.
    Magnitude,
}

/// Where a warm start begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WarmStart {
    /// At the result of the frame before, moved as the echo moved since.
    #[default]
    Moved,
    /// At that result as it is.
    AsLeft,
}

/// When five iterations count as no more progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Convergence {
    /// The loss changed by less than half a percent, up or down.
    #[default]
    Change,
    /// The loss fell by less than half a percent; a loss that rises has done so too.
    Improvement,
}
