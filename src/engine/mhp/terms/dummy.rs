//! A term that only unit tests have: whatever knows it knows the table.

use super::{Evaluate, Hue, Inputs, Scope, Term, Weight};
use crate::body::Pppr;
use crate::geometry::{add_scaled, dot};

pub(super) const DUMMY: Term = Term {
    key: "dummy",
    label: "L_dummy",
    formula: "½ Σ ‖p‖²",
    unit: "m²",
    help: "How far the joints are from the radar.",
    weight: Weight::Dummy,
    scope: Scope::Weighed,
    hue: Hue::Rose,
    evaluate: Evaluate::Alone(evaluate),
};

fn evaluate(inputs: &Inputs<'_>, gain: f64, gradient: &mut Pppr) -> f64 {
    let [bars, _] = gradient.motion_mut();
    let joints = inputs.params.positions().iter().zip(bars);
    joints
        .map(|(&p, bar)| {
            add_scaled(bar, p, gain);
            0.5 * dot(p, p)
        })
        .sum()
}
