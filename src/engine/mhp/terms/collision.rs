//! L_coll: joints of different people do not touch.

use super::penalties::repulsion;
use super::{Evaluate, Hue, Inputs, Scope, Term, Weight};
use crate::body::Pppr;
use crate::geometry::{add_scaled, sub};

pub(super) const COLL: Term = Term {
    key: "coll",
    label: "L_coll",
    formula: "Σ max(0, d_joint − ‖p_sm − p_tn‖)²",
    unit: "m²",
    help: "Joints of different people closer than d_joint.",
    weight: Weight::Kine,
    scope: Scope::People,
    hue: Hue::Red,
    evaluate: Evaluate::Alone(evaluate),
};

fn evaluate(inputs: &Inputs<'_>, gain: f64, gradient: &mut Pppr) -> f64 {
    let (joints, limit) = (inputs.params.shape().joints, inputs.config.d_joint_m);
    let (positions, [bars, _]) = (inputs.params.positions(), gradient.motion_mut());
    let mut total = 0.0;
    for m in joints..positions.len() {
        let first_of_person = m - m % joints;
        for n in 0..first_of_person {
            let Some((term, e_bar)) = repulsion(sub(positions[m], positions[n]), limit) else { continue };
            total += term;
            add_scaled(&mut bars[m], e_bar, gain);
            add_scaled(&mut bars[n], e_bar, -gain);
        }
    }
    total
}
