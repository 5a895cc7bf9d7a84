//! The terms of the loss, L = Σ_w w Σ_t L_t over the weights and the terms that each weighs: one table that everything
//! iterates that computes, records, shows or asks for them.
//!
//! A term is added in three places: its file here (a row, and how it is evaluated with its gradient), its line in
//! [`TERMS`], and its weight (a field of [`FitConfig`] and a variant of [`Weight`], where none of those that are there will
//! do). Loss, report, curves, inspector, filter, tables and exports then have it; tests named `dummy_term` say so.
//!
//! | file | terms |
//! |---|---|
//! | `electromagnetic.rs` | L_EM: only its row, for the objective computes it from the maps |
//! | `bones.rs` | L_bone and L_rigid, in one pass: both need each bone's length and direction, and their slopes are added once |
//! | `angles.rs` | L_joint |
//! | `separation.rs` | L_sep |
//! | `collision.rs` | L_coll |
//! | `time.rs` | L_time |
//! | `given.rs` | L_given |
//! | `prior.rs` | L_prior: only its row, for the fit of a window computes it |
//! | `network.rs` | L_net: only its row, for the fit of a window computes it |
//! | `penalties.rs` | what they share: ψ, lengths that have a slope everywhere, repulsion |

mod angles;
mod bones;
mod collision;
#[cfg(any(test, feature = "dummies"))]
mod dummy;
mod electromagnetic;
mod given;
mod network;
mod penalties;
mod prior;
mod separation;
#[cfg(test)]
pub(super) mod tests;
mod time;
mod values;
mod weight;

pub use values::Terms;
pub(super) use weight::weighted_sum_into;
pub use weight::{TermGroup, Weight};

use crate::body::{Pppr, Skeleton};
use crate::config::FitConfig;
use crate::geometry::Vec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::Deref;

/// Every term, in the order of columns and curves.
pub const TERMS: &[Term] = &[
    electromagnetic::EM,
    bones::BONE,
    bones::RIGID,
    angles::JOINT,
    separation::SEP,
    collision::COLL,
    time::TIME,
    prior::PRIOR,
    network::NET,
    given::GIVEN,
    #[cfg(any(test, feature = "dummies"))]
    dummy::DUMMY,
];

/// One term of the loss.
#[derive(Debug)]
pub struct Term {
    /// The name of its column, its curve and its filter.
    pub key: &'static str,
    /// As the paper writes it.
    pub label: &'static str,
    /// What is summed.
    pub formula: &'static str,
    /// The unit of its value, or "".
    pub unit: &'static str,
    /// What it says of the body, in a sentence.
    pub help: &'static str,
    /// What it is multiplied by.
    pub weight: Weight,
    /// Where it can be other than 0.
    pub scope: Scope,
    /// Its colour on screen.
    pub hue: Hue,
    evaluate: Evaluate,
}

/// Where a term can be other than 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// In every fit.
    Always,
    /// Where several people are fitted.
    People,
    /// Where its weight is above 0: elsewhere it is not evaluated.
    Weighed,
    /// The same, where joints were given ([`crate::mhp::FitState::given`]).
    Given,
}

impl Scope {
    /// Whether a term is evaluated where its weight is above 0 alone.
    pub(super) fn needs_weight(self) -> bool {
        matches!(self, Self::Weighed | Self::Given)
    }
}

/// A colour by its role; the theme says which shade it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hue {
    /// Of the maps.
    Blue,
    /// Of bones.
    Orange,
    /// Of motion.
    Violet,
    /// Of angles.
    Green,
    /// Of people who stand close.
    Amber,
    /// Of people who touch.
    Red,
    /// Of the frames around.
    Rose,
    /// Of what people do.
    Teal,
    /// Of what a network expects.
    Orchid,
    /// Of what was given.
    Slate,
}

/// How a term is evaluated: its value, and `gain` times its gradient on top of what is there.
#[derive(Debug)]
enum Evaluate {
    /// From the maps, by the objective.
    Maps,
    /// By itself.
    Alone(fn(&Inputs<'_>, f64, &mut Pppr) -> f64),
    /// In one pass with the term after it, which has the same weight.
    WithNext(fn(&Inputs<'_>, [f64; 2], &mut Pppr) -> [f64; 2]),
    /// In the pass of the term before it.
    WithPrevious,
    /// By the fit of a window, which knows more than one frame; 0 elsewhere.
    Window,
}

/// What a term reads.
pub(super) struct Inputs<'a> {
    pub(super) skeleton: &'a Skeleton,
    pub(super) config: &'a FitConfig,
    pub(super) params: &'a Pppr,
    /// Where the frames around say that each person's middle is, m; empty where they say nothing.
    pub(super) anchors: &'a [Vec3],
    /// Where joints were given, m; empty where none was.
    pub(super) given: &'a [Option<Vec3>],
}

impl Term {
    /// What a tooltip says: `L_rigid = Σ ψ(Δv·u), m/s. …`.
    pub fn tooltip(&self) -> String {
        let Self { label, formula, unit, help, .. } = self;
        let comma = if unit.is_empty() { "" } else { ", " };
        format!("{label} = {formula}{comma}{unit}. {help}")
    }
}

/// A line of [`TERMS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TermId(usize);

impl TermId {
    /// Every term, in the order of the table.
    pub fn all() -> impl DoubleEndedIterator<Item = Self> + ExactSizeIterator + Clone {
        (0..TERMS.len()).map(Self)
    }

    /// The term whose key this is.
    pub fn of(key: &str) -> Option<Self> {
        Self::all().find(|term| term.key == key)
    }

    /// Gains that leave nothing but this term.
    pub(super) fn alone(self) -> [f64; TERMS.len()] {
        std::array::from_fn(|place| f64::from(u8::from(place == self.0)))
    }

    /// Whether the fit of a window computes it, which knows more than one frame.
    pub fn is_of_windows(self) -> bool {
        matches!(self.evaluate, Evaluate::Window)
    }

    /// Whether the objective computes it, from the maps.
    pub(super) fn is_of_maps(self) -> bool {
        matches!(self.evaluate, Evaluate::Maps)
    }
}

impl Deref for TermId {
    type Target = Term;

    fn deref(&self) -> &'static Term {
        &TERMS[self.0]
    }
}

/// As its key.
impl Serialize for TermId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.key)
    }
}

impl<'de> Deserialize<'de> for TermId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let key = String::deserialize(deserializer)?;
        Self::of(&key).ok_or_else(|| serde::de::Error::custom(format!("`{key}` is no term of the loss")))
    }
}

/// All of every term's gradient.
pub(super) const WHOLE: [f64; TERMS.len()] = [1.0; TERMS.len()];

/// The terms, where L_EM is `em`. Adds to `gradients`, one a weight, the gradients of the terms that it weighs, each times
/// its `gain`; that of L_EM is the objective's affair.
pub(super) fn evaluate(
    inputs: &Inputs<'_>,
    em: f64,
    gains: &[f64; TERMS.len()],
    gradients: &mut [Pppr; Weight::COUNT],
) -> Terms {
    let mut values = Terms::default();
    for (place, term) in TERMS.iter().enumerate() {
        if term.scope.needs_weight() && term.weight.of(inputs.config) <= 0.0 {
            continue;
        }
        let gradient = &mut gradients[term.weight as usize];
        match term.evaluate {
            Evaluate::Maps => values.set(place, em),
            Evaluate::Alone(evaluate) => values.set(place, evaluate(inputs, gains[place], gradient)),
            Evaluate::WithNext(evaluate) => {
                let both = evaluate(inputs, [gains[place], gains[place + 1]], gradient);
                values.set(place, both[0]);
                values.set(place + 1, both[1]);
            }
            Evaluate::WithPrevious | Evaluate::Window => {}
        }
    }
    values
}

/// L as a formula: `L = w_EM·L_EM + w_kine·(L_bone + …) + …`.
pub fn formula() -> String {
    let weighed = |&weight: &Weight| {
        let labels: Vec<&str> = weight.terms().map(|term| TERMS[term.0].label).collect();
        let sum = labels.join(" + ");
        if labels.len() > 1 { format!("{}·({sum})", weight.label()) } else { format!("{}·{sum}", weight.label()) }
    };
    format!("L = {}", Weight::ALL.iter().map(weighed).collect::<Vec<_>>().join(" + "))
}
