//! A walking body: a textbook gait along a path that turns.
//!
//! **Gait.** Sagittal hip and knee angles are trigonometric interpolants of the normative curves at every tenth of a
//! stride, the left leg half a stride after the right; arms swing against the legs of their side. The pelvis rides on
//! the lower foot (a smooth maximum), sways over the standing leg and turns a little with each step.
//!
//! **Path.** Constant speed; the heading turns smoothly (quintic, so that acceleration has no jump) over one stretch of the
//! path, position is the integral of the heading.

use super::figure::{rotation_x, rotation_y, rotation_z};
use super::{Anchor, Posture};
use crate::geometry::mat_mul;
use std::f64::consts::{PI, TAU};

/// Hip flexion at every tenth of a stride from heel strike, degrees.
const HIP_DEG: [f64; 10] = [30.0, 25.0, 15.0, 4.0, -5.0, -11.0, -4.0, 14.0, 27.0, 32.0];
/// Knee flexion likewise, degrees.
const KNEE_DEG: [f64; 10] = [6.0, 17.0, 16.0, 9.0, 6.0, 10.0, 34.0, 59.0, 52.0, 22.0];
/// Where the walker goes: straight, then a turn, then straight again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// Point on the floor below the pelvis at time 0 (x, y), m.
    pub start: [f64; 2],
    /// First heading, rad from x towards y.
    pub heading_rad: f64,
    /// Walking speed, m/s.
    pub speed_mps: f64,
    /// Distance walked before the turn begins, m.
    pub straight_m: f64,
    /// Distance walked while turning, m.
    pub turn_m: f64,
    /// Angle of the turn, rad, positive to the left.
    pub turn_rad: f64,
}

impl Path {
    /// Heading after `walked` metres, rad.
    pub fn heading(&self, walked: f64) -> f64 {
        let u = ((walked - self.straight_m) / self.turn_m).clamp(0.0, 1.0);
        self.heading_rad + self.turn_rad * u * u * u * (10.0 + u * (6.0 * u - 15.0))
    }

    /// Position after `walked` metres (x, y), m: three-point Gauss–Legendre on panels of 2 cm between the joins.
    pub fn position(&self, walked: f64) -> [f64; 2] {
        let mut at = self.start;
        let mut done = 0.0;
        for end in [self.straight_m, self.straight_m + self.turn_m, f64::INFINITY].map(|s| s.min(walked)) {
            let panels = ((end - done).abs() / 0.02).ceil();
            let half = (end - done) / panels.max(1.0) / 2.0;
            for panel in 0..panels as usize {
                let middle = done + half * (2 * panel + 1) as f64;
                for (node, weight) in [(-0.6f64.sqrt(), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6f64.sqrt(), 5.0 / 9.0)] {
                    let (sin, cos) = self.heading(middle + half * node).sin_cos();
                    at[0] += half * weight * cos;
                    at[1] += half * weight * sin;
                }
            }
            done = end;
        }
        at
    }
}

/// How a person walks. Times before 0 continue the first straight backwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gait {
    /// Strides (two steps) a second.
    pub stride_hz: f64,
    /// Stride phase at time 0, in strides from the right heel strike.
    pub phase: f64,
    /// The way.
    pub path: Path,
}

impl Default for Gait {
    /// From 4 m almost straight towards the radar, a half turn to the left at 1.8 m, and back.
    fn default() -> Self {
        Self {
            stride_hz: 0.92,
            phase: 0.15,
            path: Path {
                start: [4.0, 0.55],
                heading_rad: PI - 0.12,
                speed_mps: 1.25,
                straight_m: 1.7,
                turn_m: 1.3,
                turn_rad: PI,
            },
        }
    }
}

impl Gait {
    /// The posture at time `t`, s, of a body of average proportions.
    pub fn posture(&self, t: f64) -> Posture {
        let walked = self.path.speed_mps * t;
        let stride = self.stride_hz * t + self.phase;
        let swing = TAU * stride;
        let leg = |side: f64| {
            let phase = if side > 0.0 { stride + 0.5 } else { stride };
            let (hip, knee) = (curve(&HIP_DEG, phase).to_radians(), curve(&KNEE_DEG, phase).to_radians());
            let spread = rotation_x(0.02 * side);
            (mat_mul(&spread, &rotation_y(-hip)), mat_mul(&spread, &rotation_y(knee - hip)))
        };
        let arm = |side: f64| {
            let phase = if side > 0.0 { swing } else { swing + PI };
            let shoulder = 0.10 + 0.38 * phase.cos();
            let elbow = 0.40 + 0.18 * phase.cos();
            let spread = rotation_x(0.12 * side);
            (mat_mul(&spread, &rotation_y(-shoulder)), mat_mul(&spread, &rotation_y(-shoulder - elbow)))
        };
        let sway = -0.018 * (swing - 0.6 * PI).cos();
        Posture {
            trunk: mat_mul(&rotation_z(-0.07 * swing.cos()), &rotation_y(0.06)),
            legs: [1.0, -1.0].map(leg),
            arms: [1.0, -1.0].map(arm),
            shift: [0.0, sway, 0.0],
            ..Posture::upright(self.path.heading(walked), Anchor::Pelvis(self.path.position(walked)))
        }
    }
}

/// Trigonometric interpolation of ten samples a period at `phase` periods (harmonics 0–4).
fn curve(samples: &[f64; 10], phase: f64) -> f64 {
    let kernel = |x: f64| 0.1 * (1.0 + 2.0 * (1..=4).map(|k| (TAU * f64::from(k) * x).cos()).sum::<f64>());
    samples.iter().enumerate().map(|(i, s)| s * kernel(phase - i as f64 / 10.0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Build;
    use crate::geometry::{norm, sub};

    #[test]
    fn curves_pass_through_their_samples() {
        for (i, &expected) in HIP_DEG.iter().enumerate() {
            let smoothed: f64 = (0..10).map(|k| HIP_DEG[k] * if (i + k) % 2 == 0 { 0.1 } else { -0.1 }).sum();
            assert!((curve(&HIP_DEG, i as f64 / 10.0) - (expected - smoothed)).abs() < 1e-9);
        }
    }

    #[test]
    fn the_path_is_the_integral_of_its_heading() {
        let path = Gait::default().path;
        for walked in [-0.5, 0.3, 1.7, 2.2, 3.0, 3.9] {
            let (a, b) = (path.position(walked - 1e-4), path.position(walked + 1e-4));
            let (sin, cos) = path.heading(walked).sin_cos();
            assert!(((b[0] - a[0]) / 2e-4 - cos).abs() < 1e-6, "{walked}");
            assert!(((b[1] - a[1]) / 2e-4 - sin).abs() < 1e-6, "{walked}");
        }
    }

    #[test]
    fn the_gait_stands_on_the_floor_and_hardly_slides() {
        let (gait, build) = (Gait::default(), Build::default());
        let joints = |t: f64| build.pose(&gait.posture(t), -1.0).joints;
        let (mut slid, mut count) = (0.0, 0.0);
        for step in 0..120 {
            let t = f64::from(step) / 100.0;
            let now = joints(t);
            let lower = if now[15][2] < now[16][2] { 15 } else { 16 };
            let above = now[lower][2] + 1.0;
            assert!((0.05..0.08).contains(&above), "ankle {above} m above the floor at {t} s");
            slid += norm(sub(joints(t + 1e-4)[lower], joints(t - 1e-4)[lower])) / 2e-4;
            count += 1.0;
        }
        assert!(slid / count < 0.4, "the standing ankle moves at {} m/s", slid / count);
    }
}
