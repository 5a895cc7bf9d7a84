//! V: how fast the echoes at a person move along the line of sight; paper section 4.1 and appendix A.
//!
//! With a Doppler axis the strongest bin says it. Without one, γ times the magnitude of the intensity gradient at the place,
//! in units of the steepest gradient of the map. A magnitude has no sign; the sign is that of the optical flow: where the
//! map brightens on the far side of the slope, the echo goes away. The paper gives it none, which is a choice
//! ([`GradientVelocity::Magnitude`]).

use crate::config::{FitConfig, GradientVelocity};
use crate::geometry::{Vec3, norm, scale, sub};
use crate::mhp::Problem;
use crate::mhp::context::SaliencyMap;

/// Radial velocity of a place and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Radial {
    /// m/s along the line of sight, positive moving away.
    pub mps: f64,
    /// The same as a vector, m/s.
    pub vector: Vec3,
    pub source: Source,
}

/// What a velocity was read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Doppler,
    Gradient,
}

/// The radial velocity at `at` from the first view that tells a finite one.
pub(super) fn radial(problem: &Problem, config: &FitConfig, at: Vec3) -> Option<Radial> {
    let (context, gain_mps) = (problem.context(config), config.init.velocity_gain_mps);
    let now = &context.now;
    let along = |k: usize, mps: f64, source: Source| {
        let from_radar = sub(at, problem.views[k].pose.world_from_view([0.0; 3]));
        let vector = scale(from_radar, mps / norm(from_radar).max(1e-6));
        // The bins of an axis may be any numbers.
        vector.iter().all(|v| v.is_finite()).then_some(Radial { mps, vector, source })
    };
    let doppler = now.iter().enumerate().find_map(|(k, e)| along(k, e.radial_mps(at)?, Source::Doppler));
    doppler.or_else(|| {
        if config.init.gradient == GradientVelocity::Magnitude {
            let steepness = |(k, e): (usize, &SaliencyMap)| Some((k, e.steepness(at)?));
            let (k, steepness) = now.iter().enumerate().find_map(steepness)?;
            return along(k, gain_mps * steepness, Source::Gradient);
        }
        // The nearest frame in time tells the change best.
        let (offset_s, near) = context.around().min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
        now.iter().zip(near()).enumerate().find_map(|(k, (now, then))| {
            let flow = now.flow(then, at)?;
            along(k, gain_mps * flow.steepness * flow.sign * offset_s.signum(), Source::Gradient)
        })
    })
}
