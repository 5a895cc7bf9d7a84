//! L_prior: how unlikely a window's motion is. The fit of a window computes it.

use super::{Evaluate, Hue, Scope, Term, Weight};

pub(super) const PRIOR: Term = Term {
    key: "prior",
    label: "L_prior",
    formula: "(ρ(c) + ((s − s₀)/σ_s)²)/30 + ⟨((l/(e^s λ) − 1)/σ_b)²⟩",
    unit: "",
    help: "How far a window's pose, motion and size are from what real people do, and its bones from their lengths for that size; −2 ln of how likely a mixture of poses has it, and squares in standard deviations.",
    weight: Weight::Prior,
    scope: Scope::Weighed,
    hue: Hue::Blue,
    evaluate: Evaluate::Window,
};
