//! What other panes draw in 3-D while they are in front: ghosts of skeletons, ellipsoids, arrows, points. A pane publishes it in
//! every pass that it is drawn in; what was not published lately is gone.

use crate::geometry::{Mat3, Vec3};
use egui::{Color32, Context, Id};
use std::sync::Arc;

/// Passes after which something that is not published any more is gone: a pane may be drawn after the scene.
const LATELY: u64 = 2;
/// Pieces of a circle about an ellipsoid.
const PIECES: usize = 28;

/// Things in the room, m, world frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Extras {
    /// Lines of a width, points of the screen.
    pub(super) lines: Vec<(Vec<Vec3>, Color32, f32)>,
    /// From, to.
    pub(super) arrows: Vec<([Vec3; 2], Color32)>,
    /// Joints whose bones are drawn.
    pub(super) skeletons: Vec<(Vec<Vec3>, Color32, f32)>,
    /// Small crosses of a size, m.
    pub(super) points: Vec<(Vec3, f64, Color32)>,
    /// Texts.
    pub(super) labels: Vec<(Vec3, String, Color32)>,
}

/// The panes that publish something.
const KEYS: [&str; 4] = ["known", "closure", "what-if", "tau"];

type Published = (u64, Arc<Extras>);

/// A pane that is drawn shows these.
pub(super) fn publish(ctx: &Context, key: &'static str, extras: Arc<Extras>) {
    debug_assert!(KEYS.contains(&key), "{key}");
    let now: Published = (ctx.cumulative_pass_nr(), extras);
    let fresh = ctx.data_mut(|data| {
        let id = Id::unique(("extras", key));
        let before: Option<Published> = data.get_temp(id);
        let fresh = before.is_none_or(|before| before.1 != now.1 || before.0 + LATELY < now.0);
        data.insert_temp(id, now);
        fresh
    });
    // The scene may have been drawn before in this pass.
    if fresh {
        ctx.request_repaint();
    }
}

/// What is published now.
pub(super) fn published(ctx: &Context) -> Vec<Arc<Extras>> {
    let now = ctx.cumulative_pass_nr();
    let of = |key: &&str| {
        let known: Option<Published> = ctx.data(|data| data.get_temp(Id::unique(("extras", *key))));
        known.filter(|(pass, _)| pass + LATELY >= now).map(|(_, extras)| extras)
    };
    KEYS.iter().filter_map(of).collect()
}

/// A lower triangle L with L Lᵀ = m, of a covariance; 0 where it has no extent.
fn root(m: &Mat3) -> Mat3 {
    let mut l = [[0.0; 3]; 3];
    for i in 0..3 {
        for k in 0..=i {
            let sum: f64 = (0..k).map(|n| l[i][n] * l[k][n]).sum();
            let rest = m[i][k] - sum;
            l[i][k] = match i == k {
                true => rest.max(0.0).sqrt(),
                false if l[k][k] > 0.0 => rest / l[k][k],
                false => 0.0,
            };
        }
    }
    l
}

impl Extras {
    /// The surface of a covariance at `sigma` standard deviations, as three closed lines.
    pub(super) fn ellipsoid(&mut self, centre: Vec3, covariance: &Mat3, sigma: f64, color: Color32, width: f32) {
        let l = root(covariance);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let line = (0..=PIECES).map(|k| {
                let (s, c) = (std::f64::consts::TAU * k as f64 / PIECES as f64).sin_cos();
                std::array::from_fn(|i| centre[i] + sigma * (c * l[i][a] + s * l[i][b]))
            });
            self.lines.push((line.collect(), color, width));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipsoid_is_as_wide_as_its_covariance() {
        let mut extras = Extras::default();
        let covariance = [[4.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]];
        extras.ellipsoid([0.0; 3], &covariance, 1.0, Color32::WHITE, 1.0);
        let l = root(&covariance);
        for i in 0..3 {
            for k in 0..3 {
                let product: f64 = (0..3).map(|n| l[i][n] * l[k][n]).sum();
                assert!((product - covariance[i][k]).abs() < 1e-12);
            }
        }
        assert_eq!(extras.lines.len(), 3);
        assert!(extras.lines.iter().flat_map(|line| &line.0).all(|p| p[0].abs() <= 2.0 + 1e-9));
    }
}
