//! L_given: joints are where somebody put them.
//!
//! A start that the program finds comes from the maps, and says nothing that they do not say. One that is given does: by hand, by a
//! network, by an annotation. Maps leave directions of a pose open, along which noise and what the forward model lacks lead a fit away
//! from where it begins; this term holds it there as far as [`OFF_M`] says.

use super::{Evaluate, Hue, Inputs, Scope, Term, Weight};
use crate::body::Pppr;
use crate::geometry::{add_scaled, dot, sub};
use std::iter::zip;

/// What a joint that is given may be off, in each direction, m: a network of radar maps, or a hand that drags.
const OFF_M: f64 = 0.05;

pub(super) const GIVEN: Term = Term {
    key: "given",
    label: "L_given",
    formula: "Σ ‖p − p₀‖²/(P J (0.05 m)²)",
    unit: "",
    help: "Joints against where they were given: by hand, by a prediction or by an annotation. A start that the program finds gives none.",
    weight: Weight::Given,
    scope: Scope::Given,
    hue: Hue::Slate,
    evaluate: Evaluate::Alone(evaluate),
};

fn evaluate(inputs: &Inputs<'_>, gain: f64, gradient: &mut Pppr) -> f64 {
    let scale = 1.0 / (inputs.params.shape().total_joints().max(1) as f64 * OFF_M * OFF_M);
    let [bars, _] = gradient.motion_mut();
    let mut sum = 0.0;
    for ((&joint, bar), given) in zip(zip(inputs.params.positions(), bars), inputs.given) {
        let Some(given) = given else { continue };
        let off = sub(joint, *given);
        sum += scale * dot(off, off);
        add_scaled(bar, off, 2.0 * gain * scale);
    }
    sum
}
