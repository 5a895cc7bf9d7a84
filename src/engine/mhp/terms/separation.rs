//! L_sep: several people do not stand in one place.

use super::penalties::repulsion;
use super::{Evaluate, Hue, Inputs, Scope, Term, Weight};
use crate::body::Pppr;
use crate::geometry::{Vec3, add_scaled, mean, sub};
use smallvec::SmallVec;

pub(super) const SEP: Term = Term {
    key: "sep",
    label: "L_sep",
    formula: "Σ max(0, d_sep − ‖c_s − c_t‖)²",
    unit: "m²",
    help: "People whose middles are closer than d_sep.",
    weight: Weight::Kine,
    scope: Scope::People,
    hue: Hue::Orange,
    evaluate: Evaluate::Alone(evaluate),
};

fn evaluate(inputs: &Inputs<'_>, gain: f64, gradient: &mut Pppr) -> f64 {
    let (joints, limit) = (inputs.params.shape().joints, inputs.config.d_sep_m);
    let [bars, _] = gradient.motion_mut();
    let share = 1.0 / joints as f64;
    let bodies = inputs.params.positions().chunks_exact(joints.max(1));
    let centroids: SmallVec<[Vec3; 4]> = bodies.map(mean).collect();
    let mut total = 0.0;
    for s in 0..centroids.len() {
        for t in 0..s {
            let Some((term, e_bar)) = repulsion(sub(centroids[s], centroids[t]), limit) else { continue };
            total += term;
            for j in 0..joints {
                add_scaled(&mut bars[s * joints + j], e_bar, gain * share);
                add_scaled(&mut bars[t * joints + j], e_bar, -(gain * share));
            }
        }
    }
    total
}
