//! L_time: a person is where the frames around say.

use super::{Evaluate, Hue, Inputs, Scope, Term, Weight};
use crate::body::Pppr;
use crate::geometry::{add_scaled, dot, mean, sub};

pub(super) const TIME: Term = Term {
    key: "time",
    label: "L_time",
    formula: "Σ ‖c − ĉ‖²",
    unit: "m²",
    help: "Middle of each person, the mean of its joints, against where the frames around say that it is.",
    weight: Weight::Time,
    scope: Scope::Weighed,
    hue: Hue::Rose,
    evaluate: Evaluate::Alone(evaluate),
};

fn evaluate(inputs: &Inputs<'_>, gain: f64, gradient: &mut Pppr) -> f64 {
    let joints = inputs.params.shape().joints;
    let share = 1.0 / joints.max(1) as f64;
    let [bars, _] = gradient.motion_mut();
    let bodies = inputs.params.positions().chunks_exact(joints.max(1)).zip(bars.chunks_exact_mut(joints.max(1)));
    let mut sum = 0.0;
    for ((body, bars), &anchor) in bodies.zip(inputs.anchors) {
        let off = sub(mean(body), anchor);
        sum += dot(off, off);
        for bar in bars {
            add_scaled(bar, off, 2.0 * gain * share);
        }
    }
    sum
}
