//! Adam with bias correction over the groups of PPPR; SPEC section 4. No renormalisation between steps.

use crate::body::{Group, Pppr, PpprShape};
use serde::{Deserialize, Serialize};

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// The two moments, and how many steps they have seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Adam {
    /// Exponential mean of the gradient.
    pub first: Pppr,
    /// Exponential mean of its square.
    pub second: Pppr,
    /// Steps since the moments were zero.
    pub steps: u32,
}

impl Adam {
    /// Zero moments.
    pub fn new(shape: PpprShape) -> Self {
        Self { first: Pppr::zeros(shape), second: Pppr::zeros(shape), steps: 0 }
    }

    /// One update of `params` against `gradient` (same sizes); the moments move on.
    pub(super) fn update(&mut self, params: &mut Pppr, gradient: &Pppr, learning_rate: f64) {
        self.steps += 1;
        let steps = f64::from(self.steps);
        let (unbias_1, unbias_2) = (1.0 / (1.0 - BETA_1.powf(steps)), 1.0 / (1.0 - BETA_2.powf(steps)));
        for group in Group::ALL {
            let moments = self.first.group_mut(group).iter_mut().zip(self.second.group_mut(group));
            for ((x, &g), (m, v)) in params.group_mut(group).iter_mut().zip(gradient.group(group)).zip(moments) {
                *m = BETA_1 * *m + (1.0 - BETA_1) * g;
                *v = BETA_2 * *v + (1.0 - BETA_2) * g * g;
                *x -= learning_rate * (*m * unbias_1) / ((*v * unbias_2).sqrt() + EPSILON);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two steps by hand on one number: g = 2, then g = −1, rate 0.1.
    #[test]
    fn two_steps_by_hand() {
        let shape = PpprShape { persons: 1, joints: 1, doppler_features: 0 };
        let (mut adam, mut params, mut gradient) = (Adam::new(shape), Pppr::zeros(shape), Pppr::zeros(shape));
        gradient.group_mut(Group::Beta)[0] = 2.0;
        adam.update(&mut params, &gradient, 0.1);
        // m̂ = 2, v̂ = 4: a full step of the rate.
        assert!((params.group(Group::Beta)[0] + 0.1).abs() < 1e-9);
        gradient.group_mut(Group::Beta)[0] = -1.0;
        adam.update(&mut params, &gradient, 0.1);
        let (m, v) = (0.9 * 0.2 - 0.1, 0.999 * 0.004 + 0.001);
        let want = -0.1 - 0.1 * (m / 0.19) / (f64::sqrt(v / (1.0 - 0.999 * 0.999)) + 1e-8);
        assert!((params.group(Group::Beta)[0] - want).abs() < 1e-9);
        assert_eq!(params.group(Group::Position), [0.0; 3]);
    }
}
