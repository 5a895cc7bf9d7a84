//! Where the numbers of a view lie in f32's range, and what is too weak to be summed.

use crate::mhp::floors::{EPSILON, SOFT_FLOOR};
use std::f64::consts::LOG2_E;

/// Below e^−15T of the threshold, `MAX_GUESS_TOO_HIGH_LN` included, a cell neither counts nor pulls (3e-7).
const MASK_REACH_PER_SOFTNESS_LN: f64 = 14.0;
/// A joint this much weaker than the threshold is dropped, ln, and at least `JOINT_MARGIN_LN` under the weakest cell that
/// counts.
const MIN_JOINT_REACH_LN: f64 = 13.0;
const JOINT_MARGIN_LN: f64 = 3.0;
/// The guess of the threshold may be this much too high, ln.
pub(super) const MAX_GUESS_TOO_HIGH_LN: f64 = 1.0;
/// And this much too low, ln: beyond it the strongest returns would leave f32's range.
pub(super) const MAX_GUESS_TOO_LOW_LN: f64 = 12.0;
/// A joint this much weaker, ln, than the strongest at its cells is dropped: from the objective (3e-4), whose mask is
/// soft, and from a map (5e-5).
const MAX_BELOW_STRONGEST_LN: f64 = 8.0;
const MAX_BELOW_STRONGEST_IN_MAPS_LN: f64 = 10.0;
/// The weakest return that counts, relative to the view's scale.
const MIN_COUNTED_LN: f64 = -36.0;
/// log₂ below which no return is taken: squares of its parts are normal f32, for others cost a hundred cycles.
pub(super) const MIN_RETURN_LOG2: f32 = -54.0;
/// log₂ of the strongest return relative to the view's scale; what is stronger is far above any threshold.
pub(super) const MAX_RETURN_LOG2: f32 = 54.0;
/// log₂ of how far the strongest joint of a map stays under what is strongest in f32, for the sum of all.
const MAP_HEADROOM_LOG2: f64 = 8.0;

/// Where f32's range lies in this view.
pub(super) struct F32Range {
    /// log₂ of what 1 stands for.
    pub(super) log2: f64,
    /// log₂ relative to it below which nothing counts.
    pub(super) cut: f32,
    /// ε and h of SPEC section 3 and 4 relative to it.
    pub(super) epsilon_sq: f32,
    pub(super) soft_floor: f32,
    /// log₂ of the lowest threshold that the guess allows, and by how many powers a cell below it pulls less than a joint
    /// that is as strong as the threshold: 1/T − 1.
    pub(super) low: f32,
    pub(super) fading: f32,
    /// log₂ of how much weaker than the strongest a joint counts.
    pub(super) relative: f32,
}

impl F32Range {
    /// For a whole map whose strongest joint has `log2` at its middle: all that f32's range holds below it.
    pub(super) fn below(log2: f64) -> Self {
        let relative = (MAX_BELOW_STRONGEST_IN_MAPS_LN * LOG2_E) as f32;
        Self {
            log2: log2 - f64::from(MAX_RETURN_LOG2) + MAP_HEADROOM_LOG2,
            fading: 0.0,
            relative,
            ..Self::new(0.0, 1.0)
        }
    }

    pub(super) fn new(guess: f64, softness: f64) -> Self {
        let below = ((MASK_REACH_PER_SOFTNESS_LN * softness + JOINT_MARGIN_LN).max(MIN_JOINT_REACH_LN)
            + MAX_GUESS_TOO_HIGH_LN)
            * LOG2_E;
        let log2 = guess - below - MIN_COUNTED_LN * LOG2_E;
        let epsilon = (EPSILON.log2() - log2).exp2();
        let soft_floor = (SOFT_FLOOR.log2() - log2).exp2() as f32;
        Self {
            log2,
            cut: (MIN_COUNTED_LN * LOG2_E) as f32,
            epsilon_sq: (epsilon * epsilon) as f32,
            soft_floor,
            low: (guess - MAX_GUESS_TOO_HIGH_LN * LOG2_E) as f32,
            fading: (1.0 / softness - 1.0).max(0.0) as f32,
            relative: (MAX_BELOW_STRONGEST_LN * LOG2_E) as f32,
        }
    }
}
