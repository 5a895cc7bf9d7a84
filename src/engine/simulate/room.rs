//! What is in a scene besides people: walls, furniture, a metal shelf, a fan, and the mirrors that walls and floor are.
//!
//! Reflectivities are amplitudes of the echo at 1 m. Surfaces are random points with circular Gaussian speckle; metal edges are
//! single strong points.

use super::Recipe;
use crate::geometry::Vec3;
use crate::radar::{Echo, PointMotion};
use num_complex::Complex64;
use rand::{Rng, rngs::StdRng};
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

/// A plane at `at` metres along world axis `axis`, which reflects `share` of the amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mirror {
    pub(super) axis: usize,
    pub(super) at: f64,
    pub(super) share: f64,
}

impl Mirror {
    /// The mirror image of a track.
    pub(super) fn image(&self, track: &PointMotion) -> PointMotion {
        let mut image = *track;
        image.position[self.axis] = 2.0 * self.at - image.position[self.axis];
        image.velocity[self.axis] = -image.velocity[self.axis];
        image.acceleration[self.axis] = -image.acceleration[self.axis];
        image
    }

    /// The three paths of first order of a point: there and back by way of the plane, and by way of it once, either way round.
    pub(super) fn echoes(&self, track: &PointMotion, reflectivity: Complex64) -> [Echo; 3] {
        let image = self.image(track);
        let once = reflectivity * self.share;
        [
            Echo { out: *track, back: image, reflectivity: once },
            Echo { out: image, back: *track, reflectivity: once },
            Echo { out: image, back: image, reflectivity: once * self.share },
        ]
    }
}

/// A fan: blades that turn about an axis, each a few points.
#[derive(Debug, Clone, PartialEq)]
struct Fan {
    hub: Vec3,
    /// Two unit vectors that span the plane of the blades.
    plane: [Vec3; 2],
    turns_hz: f64,
    phase: f64,
    /// Radius, angle in cycles, amplitude.
    points: Vec<(f64, f64, Complex64)>,
}

impl Fan {
    fn at(&self, t: f64, radius: f64, angle: f64) -> Vec3 {
        let (sin, cos) = (TAU * (self.turns_hz * t + self.phase + angle)).sin_cos();
        std::array::from_fn(|k| self.hub[k] + radius * (cos * self.plane[0][k] + sin * self.plane[1][k]))
    }
}

/// Everything but the people.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Room {
    pub(super) still: Vec<Echo>,
    pub(super) mirrors: Vec<Mirror>,
    fan: Option<Fan>,
}

impl Room {
    /// Draws a room round a stage that reaches from `lateral[0]` to `lateral[1]` in y; `centre` is where people are.
    pub(super) fn new(
        recipe: &Recipe,
        multipath: bool,
        lateral: [f64; 2],
        floor_z_m: f64,
        centre: [f64; 2],
        rng: &mut StdRng,
    ) -> Self {
        let back = recipe.distance_m[1].max(4.6) + rng.random_range(0.8..1.8);
        let sides = [lateral[0] - rng.random_range(0.3..0.9), lateral[1] + rng.random_range(0.3..0.9)];
        let mut builder = Builder { still: Vec::new(), rng };
        let (floor, ceiling) = (floor_z_m, floor_z_m + 2.5);
        let wall = 0.4 * recipe.walls;
        builder.surface([back, sides[0], floor], [back + 0.03, sides[1], ceiling], 240, wall);
        for (side, strength) in [(sides[0], 0.16), (sides[1], 0.12)] {
            builder.surface([0.8, side, floor], [back, side + 0.03, ceiling], 120, strength * recipe.walls);
        }
        for _ in 0..recipe.furniture {
            builder.furniture(sides, back, floor);
        }
        if recipe.shelf {
            builder.shelf(sides, centre, floor);
        }
        let fan = recipe.fan.then(|| builder.fan(sides, back, floor));
        let mirror = |axis, at, share: f64| Mirror { axis, at, share: share * recipe.multipath };
        let mirrors = if multipath && recipe.multipath > 0.0 {
            vec![mirror(1, sides[0], 1.0), mirror(1, sides[1], 0.8), mirror(2, floor, 0.6)]
        } else {
            Vec::new()
        };
        Self { still: builder.still, mirrors, fan }
    }

    /// What moves at time `t`, s; `half_s` is half a frame.
    pub(super) fn moving(&self, t: f64, half_s: f64) -> Vec<Echo> {
        let Some(fan) = &self.fan else { return Vec::new() };
        let echo = |&(radius, angle, reflectivity): &(f64, f64, Complex64)| {
            let at = |dt| fan.at(t + dt, radius, angle);
            Echo::direct(PointMotion::through(at(-half_s), at(0.0), at(half_s), half_s), reflectivity)
        };
        fan.points.iter().map(echo).collect()
    }
}

struct Builder<'a> {
    still: Vec<Echo>,
    rng: &'a mut StdRng,
}

impl Builder<'_> {
    fn speckle(&mut self, amplitude: f64) -> Complex64 {
        Complex64::new(self.rng.sample(StandardNormal), self.rng.sample(StandardNormal)) * (amplitude / 2f64.sqrt())
    }

    /// `count` points in a box, each of `amplitude` on average.
    fn surface(&mut self, from: Vec3, to: Vec3, count: usize, amplitude: f64) {
        for _ in 0..count {
            let position = std::array::from_fn(|k| from[k] + (to[k] - from[k]) * self.rng.random_range(0.0..1.0));
            let reflectivity = self.speckle(amplitude);
            self.still.push(Echo::still(position, reflectivity));
        }
    }

    /// A table, a chair or a cupboard along a wall.
    fn furniture(&mut self, sides: [f64; 2], back: f64, floor: f64) {
        let size = [self.rng.random_range(0.4..1.0), self.rng.random_range(0.4..0.9), self.rng.random_range(0.5..1.4)];
        let left = self.rng.random_bool(0.5);
        let x = self.rng.random_range(1.6..(back - 1.2).max(1.7));
        let y = if left { sides[1] - size[1] - 0.05 } else { sides[0] + 0.05 };
        self.surface([x, y, floor], [x + size[0], y + size[1], floor + size[2]], 40, 0.14);
    }

    /// Metal: boards as rows of points, and corners that answer strongly, within a metre of where people are.
    fn shelf(&mut self, sides: [f64; 2], centre: [f64; 2], floor: f64) {
        let side = if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let x = (centre[0] + self.rng.random_range(0.3..0.9)).max(1.2);
        let y = (centre[1] + side * self.rng.random_range(0.6..1.0)).clamp(sides[0] + 0.2, sides[1] - 0.2);
        for board in 0..5 {
            let z = floor + 0.2 + 0.4 * f64::from(board);
            self.surface([x, y - 0.35, z], [x + 0.3, y + 0.35, z + 0.02], 24, 0.22);
            for _ in 0..2 {
                let position = [x, y + self.rng.random_range(-0.3..0.3), z];
                let phase = self.rng.random_range(0.0..TAU);
                let amplitude = self.rng.random_range(0.8..1.6);
                self.still.push(Echo::still(position, Complex64::from_polar(amplitude, phase)));
            }
        }
    }

    /// Three blades of five points on a stand by the wall.
    fn fan(&mut self, sides: [f64; 2], back: f64, floor: f64) -> Fan {
        let side = usize::from(self.rng.random_bool(0.5));
        let y = if side == 0 { sides[0] + 0.3 } else { sides[1] - 0.3 };
        let hub = [self.rng.random_range(2.0..back - 0.8), y, floor + 1.1];
        let (sin, cos) = self.rng.random_range(0.0..TAU).sin_cos();
        let points =
            (0..15).map(|i| (0.04 + 0.035 * f64::from(i % 5), f64::from(i / 5) / 3.0, self.speckle(0.10))).collect();
        self.surface([hub[0], y, floor], [hub[0] + 0.03, y + 0.03, floor + 1.1], 12, 0.08);
        Fan {
            hub,
            plane: [[cos, sin, 0.0], [0.0, 0.0, 1.0]],
            turns_hz: self.rng.random_range(2.0..4.0),
            phase: self.rng.random_range(0.0..1.0),
            points,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_image_of_a_point_is_as_far_behind_the_wall() {
        let wall = Mirror { axis: 1, at: 2.0, share: 0.5 };
        let track = PointMotion { position: [3.0, 0.5, 0.1], velocity: [1.0, 0.4, 0.0], acceleration: [0.0; 3] };
        let image = wall.image(&track);
        assert_eq!((image.position, image.velocity), ([3.0, 3.5, 0.1], [1.0, -0.4, 0.0]));
        let [there, back, twice] = wall.echoes(&track, Complex64::ONE);
        assert_eq!((there.out, there.back), (back.back, back.out));
        assert_eq!((twice.reflectivity.re, there.reflectivity.re), (0.25, 0.5));
    }
}
