//! What the removal of static echoes leaves of a body.
//!
//! Processing that subtracts the mean over the chirps of a frame takes away what stands still, people's trunks and the foot on the
//! floor included. Of the power of a joint that moves at v_r along the line of sight it leaves
//!
//! ```text
//! κ² = 1 − (1 − s²) sinc²(v_r/v₀),   v₀ = λ/(2 T_frame),   s² = 1/(1 + e^(−q))
//! ```
//!
//! where s is the share of the amplitude that is kept of what stands still: 1 where nothing was removed. How much was is hardly
//! ever published, so that q is a coordinate of the fit. A joint's opacity is that of its part of the body (`scatterers`) times κ:
//! opacities are what PPPR has for how bright a joint is, so that pictures and exports show what is compared.

use crate::body::{Group, Pppr, scatterer};
use crate::config::{FitConfig, Scatterers, StaticEcho};
use crate::geometry::{Vec3, add_scaled, dot, norm, scale, sub};
use crate::mhp::Problem;
use crate::mhp::skin::radar_place;
use crate::radar::RadarConfig;
use std::f64::consts::PI;
use std::iter::zip;

/// Mean and standard deviation of q: from −30 dB to nothing removed.
pub(super) const USUAL: f64 = -1.0;
const SPREAD: f64 = 3.0;
/// A frame that is shorter than this is one set of chirps, s: what is removed of static echoes is then a mean over other times.
const SHORTEST_S: f64 = 2e-3;
/// α of a joint of which nothing is known, as of a start's.
const EQUAL_OPACITY: f64 = 0.5;
/// v₀ where the frame's length tells nothing, m/s.
const USUAL_WIDTH_MPS: f64 = 0.2;
/// q of which a fit takes the best to begin with.
pub(super) const TRIED: [f64; 4] = [-4.6, -2.3, 0.0, 3.0];

/// The removal, and the joints without it.
#[derive(Debug, Clone)]
pub(super) struct StaticEchoModel {
    width_mps: f64,
    /// Where the radar is, world frame, m.
    radar: Vec3,
    /// α of each joint of a body.
    opacities: Vec<f64>,
}

/// What a joint does along the line of sight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Echo {
    sight: Vec3,
    /// m
    distance: f64,
    /// v_r, m/s.
    radial_mps: f64,
    /// sinc²(v_r/v₀), and its derivative.
    power: f64,
    slope: f64,
}

/// v₀ of a radar, m/s.
fn width_mps(radar: &RadarConfig) -> f64 {
    let width = radar.wavelength_m() / (2.0 * radar.frame_s);
    if radar.frame_s >= SHORTEST_S && width.is_finite() { width } else { USUAL_WIDTH_MPS }
}

/// s² and its derivative by q.
fn kept(q: f64) -> (f64, f64) {
    let share = 1.0 / (1.0 + (-q).exp());
    (share, share * (1.0 - share))
}

/// sinc²(x), and its derivative by x; sinc(x) = sin(πx)/(πx).
fn sinc_sq(x: f64) -> (f64, f64) {
    let y = PI * x;
    if y.abs() < 1e-4 {
        return (1.0 - y * y / 3.0, -2.0 * PI * y / 3.0);
    }
    let (sine, cosine) = y.sin_cos();
    let sinc = sine / y;
    (sinc * sinc, 2.0 * PI * sinc * (cosine - sinc) / y)
}

/// How unlikely q is, and its derivative.
pub(super) fn unlikeliness(q: f64) -> (f64, f64) {
    let off = (q - USUAL) / SPREAD;
    (off * off, 2.0 * off / SPREAD)
}

impl StaticEchoModel {
    /// Of a problem's radar; `None` where the settings keep opacities as they are.
    pub(super) fn new(problem: &Problem, config: &FitConfig) -> Option<Self> {
        let opacity = |name: &String| match config.scatterers {
            Scatterers::BodyParts => scatterer(name).map_or(EQUAL_OPACITY, |part| part.alpha),
            Scatterers::Equal => EQUAL_OPACITY,
        };
        (config.static_echo == StaticEcho::Fitted).then(|| Self {
            width_mps: width_mps(&problem.radar),
            radar: radar_place(&problem.views),
            opacities: problem.skeleton.joints.iter().map(opacity).collect(),
        })
    }

    fn echo(&self, position: Vec3, velocity: Vec3) -> Echo {
        let from = sub(position, self.radar);
        let distance = norm(from).max(1e-3);
        let sight = scale(from, 1.0 / distance);
        let radial_mps = dot(velocity, sight);
        let (power, slope) = sinc_sq(radial_mps / self.width_mps);
        Echo { sight, distance, radial_mps, power, slope }
    }

    /// Gives person `person` of `params` the opacities that q, its positions and its velocities leave; `told` is what each joint does.
    pub(super) fn dim(&self, q: f64, person: usize, params: &mut Pppr, mut told: impl FnMut(Echo)) {
        let joints = self.opacities.len();
        let gone = 1.0 - kept(q).0;
        for (own, opacity) in self.opacities.iter().enumerate() {
            let joint = person * joints + own;
            let echo = self.echo(params.position(joint), params.velocity(joint));
            let alpha = opacity * (1.0 - gone * echo.power).max(f64::MIN_POSITIVE).sqrt();
            params.joint_mut(Group::Beta, joint)[0] = (alpha / (1.0 - alpha)).ln();
            told(echo);
        }
    }

    /// ∂L/∂q, where `params` are dimmed, `echoes` are what their joints do and `beta_bar` is ∂L/∂β of a person's joints; what positions
    /// and velocities want is added to theirs.
    pub(super) fn pull_back(
        &self,
        q: f64,
        person: usize,
        (params, echoes): (&Pppr, &[Echo]),
        beta_bar: &[f64],
        (position_bar, velocity_bar): (&mut [Vec3], &mut [Vec3]),
    ) -> f64 {
        let first = person * self.opacities.len();
        let (share, by_q) = kept(q);
        let mut q_bar = 0.0;
        for (own, (opacity, echo)) in zip(&self.opacities, &echoes[first..]).enumerate() {
            let Echo { sight, distance, radial_mps, power, slope } = *echo;
            let velocity = params.velocity(first + own);
            let left = (1.0 - (1.0 - share) * power).max(f64::MIN_POSITIVE);
            // By κ²: ln α has half its logarithm, and β has 1/(1 − α) of that.
            let bar = 0.5 * beta_bar[own] / ((1.0 - opacity * left.sqrt()) * left);
            q_bar += bar * power * by_q;
            let x_bar = -bar * (1.0 - share) * slope / self.width_mps;
            add_scaled(&mut velocity_bar[own], sight, x_bar);
            for k in 0..3 {
                position_bar[own][k] += x_bar * (velocity[k] - radial_mps * sight[k]) / distance;
            }
        }
        q_bar
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_stays_and_what_stands_is_dimmed_by_the_share() {
        for q in TRIED {
            let (share, by_q) = kept(q);
            let left = |x: f64| 1.0 - (1.0 - share) * sinc_sq(x).0;
            assert!((left(0.0) - share).abs() < 1e-9);
            assert!((left(1.0) - 1.0).abs() < 1e-9, "the first null is v₀");
            assert!(left(0.5) > share && left(2.5) > 0.9);
            let h = 1e-6;
            assert!(((kept(q + h).0 - kept(q - h).0) / (2.0 * h) - by_q).abs() < 1e-8);
        }
        for x in [0.0, 1e-6, 0.3, 1.4, -0.7] {
            let h = 1e-6;
            let slope = (sinc_sq(x + h).0 - sinc_sq(x - h).0) / (2.0 * h);
            assert!((sinc_sq(x).1 - slope).abs() < 1e-6, "{x}: {} {slope}", sinc_sq(x).1);
        }
    }

    #[test]
    fn the_width_is_that_of_the_frame_where_it_has_one() {
        let radar = |frame_s| RadarConfig { start_hz: 77e9, bandwidth_hz: 2.5e9, frame_s, ..RadarConfig::default() };
        assert!((width_mps(&radar(0.0128)) - 0.150).abs() < 2e-3);
        assert_eq!(width_mps(&radar(540e-6)), USUAL_WIDTH_MPS);
        assert_eq!(width_mps(&radar(0.0)), USUAL_WIDTH_MPS);
    }
}
