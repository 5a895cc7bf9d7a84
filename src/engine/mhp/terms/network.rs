//! L_net: how unlikely a network calls the joints, of the maps alone. The fit of a window computes it.

use super::{Evaluate, Hue, Scope, Term, Weight};

pub(super) const NET: Term = Term {
    key: "net",
    label: "L_net",
    formula: "−ln(p(x)/p(μ))/(0.3 J)",
    unit: "",
    help: "How unlikely a network that looks at the maps alone calls the joints, against the bodies that it expects: about the mean distance from them, in what it may be off.",
    weight: Weight::Network,
    scope: Scope::Weighed,
    hue: Hue::Orchid,
    evaluate: Evaluate::Window,
};
