//! The weights of the loss, what each weighs, and the sums of loss and gradient.

use super::{TERMS, TermId, Terms};
use crate::body::Pppr;
use crate::config::{Field, FitConfig};

/// A factor of the loss. Terms that share one are summed before they are weighed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// w_EM, of L_EM.
    Em,
    /// w_kine, of the paper's kinematic terms.
    Kine,
    /// w_time, of L_time.
    Time,
    /// w_prior, of L_prior.
    Prior,
    /// w_net, of L_net.
    Network,
    /// w_given, of L_given.
    Given,
    /// Of the term that unit tests have.
    #[cfg(any(test, feature = "dummies"))]
    Dummy,
}

/// What a gradient comes from; the joint inspector and the arrows of the 3-D view tell them apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TermGroup {
    /// The maps.
    Electromagnetic,
    /// The body.
    Kinematic,
    /// The frames around.
    Temporal,
}

impl TermGroup {
    /// Every group.
    pub const ALL: [Self; 3] = [Self::Electromagnetic, Self::Kinematic, Self::Temporal];

    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Electromagnetic => "electromagnetic",
            Self::Kinematic => "kinematic",
            Self::Temporal => "temporal",
        }
    }

    /// The weights of its terms.
    pub fn weights(self) -> impl Iterator<Item = Weight> {
        Weight::ALL.iter().copied().filter(move |weight| weight.group() == self)
    }

    /// The terms of this group, in the order of the table.
    pub fn terms(self) -> impl Iterator<Item = TermId> {
        TermId::all().filter(move |term| term.weight.group() == self)
    }
}

impl Weight {
    /// Every weight.
    pub const ALL: &[Self] = &[
        Self::Em,
        Self::Kine,
        Self::Time,
        Self::Prior,
        Self::Network,
        Self::Given,
        #[cfg(any(test, feature = "dummies"))]
        Self::Dummy,
    ];
    /// Number of weights.
    pub const COUNT: usize = Self::ALL.len();

    /// What it is called in [`FitConfig`], and the group that its terms are of.
    fn row(self) -> (&'static str, TermGroup) {
        match self {
            Self::Em => ("w_em", TermGroup::Electromagnetic),
            Self::Kine => ("w_kine", TermGroup::Kinematic),
            Self::Time => ("w_time", TermGroup::Temporal),
            Self::Prior => ("w_prior", TermGroup::Temporal),
            Self::Network => ("w_net", TermGroup::Electromagnetic),
            Self::Given => ("w_given", TermGroup::Kinematic),
            #[cfg(any(test, feature = "dummies"))]
            Self::Dummy => ("w_dummy", TermGroup::Temporal),
        }
    }

    /// Its value.
    pub fn of(self, config: &FitConfig) -> f64 {
        match self {
            Self::Em => config.w_em,
            Self::Kine => config.w_kine,
            Self::Time => config.w_time,
            Self::Prior => config.w_prior,
            Self::Network => config.w_net,
            Self::Given => config.w_given,
            #[cfg(any(test, feature = "dummies"))]
            Self::Dummy => config.w_dummy,
        }
    }

    /// The key of its field.
    pub fn key(self) -> &'static str {
        self.row().0
    }

    /// The label of its field.
    pub fn label(self) -> &'static str {
        let key = self.key();
        Field::of_key(key).map_or(key, |field| field.label)
    }

    /// The group that its terms are of.
    pub fn group(self) -> TermGroup {
        self.row().1
    }

    /// The terms that it weighs, in the order of the table.
    pub fn terms(self) -> impl Iterator<Item = TermId> {
        TermId::all().filter(move |term| term.weight == self)
    }

    /// What it weighs: the one term, or `L_kine` for a sum of several.
    pub fn sum_label(self) -> String {
        let mut terms = TERMS.iter().filter(|term| term.weight == self);
        match (terms.next(), terms.next()) {
            (Some(only), None) => only.label.to_owned(),
            _ => self.key().replacen("w_", "L_", 1),
        }
    }
}

impl Terms {
    /// L under the weights of `config`.
    pub fn loss(&self, config: &FitConfig) -> f64 {
        let mut sums = [0.0; Weight::COUNT];
        for (term, value) in self.iter() {
            sums[term.weight as usize] += value;
        }
        let weighed = |weight: Weight| weight.of(config) * sums[weight as usize];
        // The long sum last: the order in which every loss on record was added up, to the last bit.
        let others = Weight::ALL.iter().filter(|&&weight| weight != Weight::Kine);
        others.fold(0.0, |sum, &weight| sum + weighed(weight)) + weighed(Weight::Kine)
    }
}

/// ∂L/∂Θ from the gradients by weight.
pub(in crate::mhp) fn weighted_sum_into(config: &FitConfig, gradients: &[Pppr; Weight::COUNT], total: &mut Pppr) {
    let part = |weight: Weight| (weight.of(config), &gradients[weight as usize]);
    total.set_mix(part(Weight::Kine), part(Weight::Em));
    for &weight in Weight::ALL.iter().filter(|weight| !matches!(weight, Weight::Kine | Weight::Em)) {
        let (share, gradient) = part(weight);
        if share != 0.0 {
            total.add_scaled(share, gradient);
        }
    }
}
