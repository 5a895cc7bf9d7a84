//! Scenarios in numbers.
//!
//! `easy`, `medium` and `hard` rise in distance, clutter, noise and share of the static echo that is kept, and fall in motion: the
//! three things that the strata of the study `complexity` look at. `f1` to `f4` provoke the failure modes of the paper
//! (section 5.4.2).

use super::Action;
use std::ops::RangeInclusive;

/// A scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ScenePreset {
    /// Near, lively, an empty room, little noise.
    Easy,
    /// Farther, furniture, moderate noise.
    Medium,
    /// Far, calm, furniture and multipath, more noise; the person can still be seen.
    Hard,
    /// Static reflector dominance: metal beside the person, nothing static removed.
    F1,
    /// Near-field distortion: within arm's reach of the radar.
    F2,
    /// Close superposition: two or three people side by side.
    F3,
    /// Low-motion ambiguity: people who stand in a furnished room.
    F4,
}

/// What a scenario means.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Nearest and farthest distance of a person from the radar on the floor plan, m.
    pub distance_m: [f64; 2],
    /// What people do, drawn evenly; more than once is more often.
    pub actions: Vec<Action>,
    /// Walking speed, m/s.
    pub speed_mps: [f64; 2],
    /// People.
    pub people: RangeInclusive<usize>,
    /// Distance between neighbours, m.
    pub apart_m: [f64; 2],
    /// Standard deviation of the thermal noise in I and in Q, echo of a unit scatterer at 1 m = 1.
    pub noise: f64,
    /// What is kept of the mean over the chirps.
    pub still_share: f64,
    /// Echo of the walls relative to those of `medium`.
    pub walls: f64,
    /// Pieces of furniture.
    pub furniture: usize,
    /// A metal shelf beside the people.
    pub shelf: bool,
    /// A fan that turns.
    pub fan: bool,
    /// Amplitude that a wall reflects; 0 is no multipath.
    pub multipath: f64,
    /// Amplitude of the leakage from transmitter to receiver.
    pub leakage: f64,
}

impl ScenePreset {
    /// All.
    pub const ALL: [Self; 7] = [Self::Easy, Self::Medium, Self::Hard, Self::F1, Self::F2, Self::F3, Self::F4];

    /// The word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Easy => "easy",
            Self::Medium => "medium",
            Self::Hard => "hard",
            Self::F1 => "f1",
            Self::F2 => "f2",
            Self::F3 => "f3",
            Self::F4 => "f4",
        }
    }

    /// Its numbers.
    pub fn recipe(self) -> Recipe {
        use Action::{Fall, Raise, Sit, Stand, Turn, Walk};
        let medium = Recipe {
            distance_m: [2.4, 4.4],
            actions: vec![Walk, Walk, Turn, Sit, Raise, Stand, Fall],
            speed_mps: [0.7, 1.3],
            people: 1..=1,
            apart_m: [0.6, 2.0],
            noise: 0.02,
            still_share: 0.3,
            walls: 1.0,
            furniture: 2,
            shelf: false,
            fan: false,
            multipath: 0.12,
            leakage: 0.3,
        };
        match self {
            Self::Easy => Recipe {
                distance_m: [1.7, 3.2],
                actions: vec![Walk, Walk, Walk, Turn, Raise, Sit],
                speed_mps: [0.9, 1.4],
                noise: 0.002,
                still_share: 0.1,
                walls: 0.6,
                furniture: 0,
                multipath: 0.0,
                ..medium
            },
            Self::Medium => medium,
            Self::Hard => Recipe {
                distance_m: [2.6, 4.6],
                speed_mps: [0.5, 1.0],
                noise: 0.05,
                still_share: 0.3,
                walls: 0.8,
                furniture: 4,
                multipath: 0.2,
                ..medium
            },
            Self::F1 => Recipe {
                distance_m: [2.6, 4.4],
                actions: vec![Sit, Raise, Turn, Walk],
                speed_mps: [0.4, 0.8],
                still_share: 1.0,
                walls: 1.5,
                furniture: 3,
                shelf: true,
                ..medium
            },
            Self::F2 => Recipe {
                distance_m: [0.55, 1.0],
                actions: vec![Raise, Turn, Stand, Sit],
                noise: 0.01,
                walls: 0.6,
                furniture: 0,
                multipath: 0.0,
                ..medium
            },
            Self::F3 => Recipe {
                distance_m: [1.8, 3.8],
                actions: vec![Turn, Raise, Stand, Sit, Walk],
                people: 2..=3,
                apart_m: [0.42, 0.75],
                ..medium
            },
            Self::F4 => Recipe {
                distance_m: [2.4, 4.6],
                actions: vec![Stand],
                still_share: 0.5,
                furniture: 3,
                fan: true,
                ..medium
            },
        }
    }
}
