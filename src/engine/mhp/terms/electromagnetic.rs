//! L_EM: how far the masks of the simulated and the measured maps differ. The objective computes it.

use super::{Evaluate, Hue, Scope, Term, Weight};

pub(super) const EM: Term = Term {
    key: "em",
    label: "L_EM",
    formula: "1 − soft IoU",
    unit: "",
    help: "How far the masks of H_sim and H_ori differ, mean over the views.",
    weight: Weight::Em,
    scope: Scope::Always,
    hue: Hue::Teal,
    evaluate: Evaluate::Maps,
};
