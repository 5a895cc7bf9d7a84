//! What the mouse does to the body: which joint or handle it holds, and where that goes.

use crate::geometry;
use crate::render::{Camera, Ray, Vec2, Vec3};
use crate::session::BodyMove;
use egui::{Key, Pos2, Rect, Ui, vec2};

/// How the scene is seen: where in the window, and how large, px.
#[derive(Clone, Copy)]
pub(super) struct Sight {
    pub(super) camera: Camera,
    pub(super) rect: Rect,
    pub(super) viewport: Vec2,
    pub(super) scale: f32,
}

impl Sight {
    /// Pixel of the picture under a point of the window.
    pub(super) fn pixel(&self, at: Pos2) -> Vec2 {
        Vec2::new((at.x - self.rect.min.x) * self.scale, (at.y - self.rect.min.y) * self.scale)
    }

    /// Where in the window a place of the room is seen.
    pub(super) fn on_screen(&self, world: Vec3) -> Option<Pos2> {
        let seen = self.camera.project(world, self.viewport)?;
        Some(self.rect.min + vec2(seen.px.x, seen.px.y) / self.scale)
    }

    fn ray(&self, at: Pos2) -> Ray {
        self.camera.ray(self.pixel(at), self.viewport)
    }
}

/// What is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Holds {
    /// A joint, flat index.
    Joint(usize),
    /// An arrow of a person's handles: along x, y or z.
    Arrow(usize, usize),
    /// The ring of a person's handles.
    Ring(usize),
}

/// A hold on the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grab {
    /// What is held.
    pub(super) holds: Holds,
    /// Where it was when it was taken, m.
    pub(super) start: geometry::Vec3,
    /// Where the pointer was pressed.
    pub(super) press: Pos2,
}

impl Grab {
    /// What moving the pointer to `at` does to the body; `None` where the view does not say.
    pub(super) fn moved(&self, sight: &Sight, at: Pos2, axis: Option<usize>, keep_bones: bool) -> Option<BodyMove> {
        let [press, now] = [self.press, at].map(|at| sight.ray(at));
        let through = Vec3::from(self.start.map(|x| x as f32));
        let along =
            |axis: usize| Some(AXES[axis] * (along(&now, through, AXES[axis])? - along(&press, through, AXES[axis])?));
        let wide = |v: Vec3| v.to_array().map(f64::from);
        Some(match self.holds {
            Holds::Joint(joint) => {
                let facing = sight.camera.target - sight.camera.eye();
                let by = match axis {
                    Some(axis) => along(axis)?,
                    None => on_plane(&now, through, facing)? - on_plane(&press, through, facing)?,
                };
                BodyMove::Joint { joint, to: geometry::add(self.start, wide(by)), keep_bones }
            }
            Holds::Arrow(person, axis) => BodyMove::Person { person, by: wide(along(axis)?), yaw: 0.0 },
            Holds::Ring(person) => {
                let bearing = |ray: &Ray| {
                    let from = on_plane(ray, through, Vec3::Z)? - through;
                    Some(from.y.atan2(from.x))
                };
                let turn = bearing(&now)? - bearing(&press)?;
                let half = std::f32::consts::PI;
                let yaw = f64::from((turn + half).rem_euclid(2.0 * half) - half);
                BodyMove::Person { person, by: [0.0; 3], yaw }
            }
        })
    }
}

/// The axes of the room.
pub(super) const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

/// The axis whose key is held: 0, 1, 2 with X, Y, Z.
pub(super) fn held_axis(ui: &Ui) -> Option<usize> {
    ui.input(|i| [Key::X, Key::Y, Key::Z].into_iter().position(|key| i.key_down(key)))
}

/// Where a ray meets the plane through a point; `None` where it does not, before the eye.
fn on_plane(ray: &Ray, through: Vec3, normal: Vec3) -> Option<Vec3> {
    let towards = ray.direction.dot(normal) / normal.length();
    let distance = (through - ray.origin).dot(normal) / normal.length() / towards;
    (towards.abs() > 0.02 && distance > 0.0).then(|| ray.origin + ray.direction * distance)
}

/// How far along the line through a point in the direction `axis`, of length 1, a ray comes nearest to it, m.
fn along(ray: &Ray, through: Vec3, axis: Vec3) -> Option<f32> {
    let between = through - ray.origin;
    let cosine = axis.dot(ray.direction);
    let sine_square = 1.0 - cosine * cosine;
    (sine_square > 1e-3).then(|| (cosine * ray.direction.dot(between) - axis.dot(between)) / sine_square)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]
    use super::*;
    use egui::pos2;

    fn sight() -> Sight {
        let rect = Rect::from_min_size(pos2(100.0, 50.0), vec2(400.0, 300.0));
        let camera = Camera::overview(Vec3::new(2.0, 0.0, 0.0), 2.0);
        Sight { camera, rect, viewport: Vec2::new(800.0, 600.0), scale: 2.0 }
    }

    fn grab(holds: Holds, start: geometry::Vec3, press: Pos2) -> Grab {
        Grab { holds, start, press }
    }

    #[test]
    fn a_held_joint_stays_under_the_pointer_in_the_plane_that_faces_the_camera() {
        let (sight, start) = (sight(), [3.0, 0.3, 0.5]);
        let press = sight.on_screen(Vec3::new(3.0, 0.3, 0.5)).unwrap();
        let at = press + vec2(30.0, -20.0);
        let grab = grab(Holds::Joint(4), start, press);
        let Some(BodyMove::Joint { joint: 4, to, keep_bones: true }) = grab.moved(&sight, at, None, true) else {
            panic!("no move of the joint")
        };
        let to32 = Vec3::from(to.map(|x| x as f32));
        assert!(sight.on_screen(to32).unwrap().distance(at) < 0.05);
        let facing = sight.camera.target - sight.camera.eye();
        assert!((to32 - Vec3::new(3.0, 0.3, 0.5)).dot(facing).abs() < 1e-3);
        // With a key held, along that axis only.
        for axis in 0..3 {
            let Some(BodyMove::Joint { to, .. }) = grab.moved(&sight, at, Some(axis), true) else { panic!("no move") };
            let by = geometry::sub(to, start);
            assert!((0..3).all(|k| (k == axis) == (by[k].abs() > 1e-3)), "{axis}: {by:?}");
        }
    }

    #[test]
    fn the_ring_turns_by_the_angle_between_the_two_bearings() {
        let (sight, start) = (sight(), [3.0, 0.0, -0.5]);
        let rim = |angle: f32| sight.on_screen(Vec3::new(3.0 + 0.4 * angle.cos(), 0.4 * angle.sin(), -0.5)).unwrap();
        for (from, to, turn) in [(0.2, 1.1, 0.9), (3.0, -3.0, 2.0 * std::f64::consts::PI - 6.0)] {
            let held = grab(Holds::Ring(1), start, rim(from));
            let Some(BodyMove::Person { person: 1, yaw, by: [0.0, 0.0, 0.0] }) =
                held.moved(&sight, rim(to), None, true)
            else {
                panic!("no turn")
            };
            assert!((yaw - turn).abs() < 1e-3, "{yaw} {turn}");
        }
        let tip = |m: f32| sight.on_screen(Vec3::new(3.0, m, -0.5)).unwrap();
        let held = grab(Holds::Arrow(0, 1), start, tip(0.4));
        let Some(BodyMove::Person { by, .. }) = held.moved(&sight, tip(0.9), None, true) else { panic!("no move") };
        assert!((by[1] - 0.5).abs() < 1e-3 && by[0] == 0.0 && by[2] == 0.0, "{by:?}");
    }
}
