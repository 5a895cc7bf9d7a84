//! L_joint: elbows and knees that bend further than they can.

use super::penalties::length;
use super::{Evaluate, Hue, Inputs, Scope, Term, Weight};
use crate::body::Pppr;
use crate::geometry::{Vec3, add, add_scaled, cross, dot, scale, sub};

pub(super) const JOINT: Term = Term {
    key: "joint",
    label: "L_joint",
    formula: "Σ max(0, θ − θ_max)²",
    unit: "rad²",
    help: "Angles of elbows and knees beyond their limit.",
    weight: Weight::Kine,
    scope: Scope::Always,
    hue: Hue::Green,
    evaluate: Evaluate::Alone(evaluate),
};

fn evaluate(inputs: &Inputs<'_>, gain: f64, gradient: &mut Pppr) -> f64 {
    let Inputs { skeleton, config, params, .. } = inputs;
    let limit = Limit::new(config.theta_max_deg.to_radians());
    let (positions, [bars, _]) = (params.positions(), gradient.motion_mut());
    let mut sum = 0.0;
    for person in 0..params.shape().persons {
        let first = person * params.shape().joints;
        for triplet in &skeleton.angles {
            sum += angle(positions, triplet.map(|joint| first + joint), &limit, gain, bars);
        }
    }
    sum
}

/// θ_max, rad.
struct Limit {
    theta: f64,
    sin: f64,
    cos: f64,
}

impl Limit {
    fn new(theta: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self { theta, sin, cos }
    }
}

/// max(0, θ − θ_max)² at the vertex n of (m, n, o).
fn angle(positions: &[Vec3], [m, n, o]: [usize; 3], limit: &Limit, gain: f64, bars: &mut [Vec3]) -> f64 {
    let a = sub(positions[m], positions[n]);
    let b = sub(positions[o], positions[n]);
    let c = cross(a, b);
    let (y, x) = (length(c), dot(a, b));
    // sin(θ − θ_max): most angles are far below, and need no arctangent.
    if y * limit.cos <= x * limit.sin {
        return 0.0;
    }
    let over = y.atan2(x) - limit.theta;
    if over <= 0.0 {
        return 0.0;
    }
    let by_theta = gain * (2.0 * over / (x * x + y * y));
    let (y_bar, x_bar) = (by_theta * x, -by_theta * y);
    // dy = c·dc/y, c·(da × b) = da·(b × c), c·(a × db) = db·(c × a)
    let mut a_bar = scale(cross(b, c), y_bar / y);
    add_scaled(&mut a_bar, b, x_bar);
    let mut b_bar = scale(cross(c, a), y_bar / y);
    add_scaled(&mut b_bar, a, x_bar);
    add_scaled(&mut bars[m], a_bar, 1.0);
    add_scaled(&mut bars[o], b_bar, 1.0);
    add_scaled(&mut bars[n], add(a_bar, b_bar), -1.0);
    over * over
}
