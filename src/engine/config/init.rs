//! How a fit starts and what it moves. Every default is the paper's word, or says what the paper leaves open, except where
//! [`super::deviations`] tells otherwise.

use super::{Background, GradientVelocity, Still};
use serde::{Deserialize, Serialize};

/// What Adam moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Parameterization {
    /// Every joint's position by itself; the paper.
    #[default]
    Joints,
    /// A root that moves and turns, and bones that turn about their inner joint: bone lengths stay as they are.
    Bones,
    /// Place, heading, size and pose of a window of frames, the pose in the space that real motion has taught.
    Motion,
}

/// What the Gaussians of a start look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scatterers {
    /// Equal round Gaussians with α = 0.5; the paper.
    #[default]
    Equal,
    /// Scales elongated along the bones and opacities by body part: trunk and limbs are filled, hands and face are small.
    BodyParts,
}

/// What tells where the one person stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartPlace {
    /// Where the views' peaks agree best, in the frame alone.
    #[default]
    Peaks,
    /// In the middle of the strongest cluster of peaks, as it is; the paper.
    Cluster,
    /// As `peaks`, unless counting people over the frames around finds that person elsewhere.
    Counted,
}

/// Where a start looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Yaw {
    /// Towards the radar.
    #[default]
    Radar,
    /// Where the person goes, from the places found in the frames around; towards the radar where it stands.
    Motion,
}

/// What tells how high a body stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Height {
    /// The middle of the echo.
    #[default]
    Echo,
    /// The floor and the top of the echo, where the data set tells the radar's height; else as `echo`. In a window bodies stand on
    /// that floor.
    Floor,
}

/// Adam's step size a group; `None` takes `learning_rate`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LearningRates {
    /// Joint positions, or the root's, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<f64>,
    /// Turns of root and bones, rad; only where bones are moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bone: Option<f64>,
    /// ln of the scales.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log_scale: Option<f64>,
    /// Quaternions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<f64>,
    /// Velocities, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<f64>,
    /// Opacities before the sigmoid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beta: Option<f64>,
    /// Doppler features.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub omega: Option<f64>,
}

/// How a start is found (paper 4.1, appendix A), and how it is perturbed on purpose (the paper's robustness table).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InitConfig {
    /// P: positions from the peaks. Off: the body stands in the middle of what the views cover.
    pub position: bool,
    /// V: velocities from the Doppler axis or the intensity gradients. Off: 0.
    pub velocity: bool,
    /// What becomes of what stands still.
    pub still: Still,
    /// What a cell is compared with.
    pub background: Background,
    /// How an intensity gradient becomes a velocity.
    pub gradient: GradientVelocity,
    /// γ of appendix A, m/s.
    pub velocity_gain_mps: f64,
    /// Standard deviation of the noise on every coordinate of every joint, m.
    pub position_noise_m: f64,
    /// Shift of the whole body in a direction drawn for each frame, m.
    pub position_bias_m: f64,
    /// Standard deviation of the noise on every velocity component, m/s.
    pub velocity_noise_mps: f64,
    /// Share of the peaks that is dropped before they are clustered.
    pub peak_dropout: f64,
    /// Seed of the perturbations.
    pub seed: u64,
}

impl Default for InitConfig {
    fn default() -> Self {
        Self {
            position: true,
            velocity: true,
            still: Still::default(),
            background: Background::default(),
            gradient: GradientVelocity::default(),
            velocity_gain_mps: 0.5,
            position_noise_m: 0.0,
            position_bias_m: 0.0,
            velocity_noise_mps: 0.0,
            peak_dropout: 0.0,
            seed: 0,
        }
    }
}
