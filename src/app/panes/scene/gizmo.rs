//! Handles that move a whole person along x, y and z and turn it about the vertical axis.

use super::hand::{AXES, Grab, Holds, Sight};
use crate::render::shapes::{AXIS_COLORS, Stroke};
use crate::render::{Scene, Vec3};
use crate::session::{Session, root_of};
use egui::{Color32, CursorIcon, Role, Sense, Ui, WidgetInfo, vec2};
use std::f32::consts::TAU;

/// Most length of an arrow on the screen, points, and the ring's radius as a share of it.
const LENGTH: f32 = 58.0;
const RING: f32 = 0.8;
/// Where on the ring its knob is, rad: where no arrow is.
const KNOB: f32 = -0.25 * TAU / 2.0;
/// Reach of a handle, points.
const REACH: f32 = 18.0;

/// The handles of a person.
pub(super) struct Gizmo {
    person: usize,
    root: crate::geometry::Vec3,
    at: Vec3,
    /// Length of the arrows, m.
    length: f32,
}

impl Gizmo {
    /// Those of the selected person, where they are shown.
    pub(super) fn of(session: &Session, sight: &Sight) -> Option<Self> {
        let (problem, shown) = (session.fit.problem.as_ref()?, session.fit.shown.as_ref()?);
        let joints = problem.skeleton.joints.len().max(1);
        let person = session.joint.unwrap_or(0) / joints;
        let body = shown.params.person(person);
        let root = root_of(body, &problem.skeleton);
        let at = Vec3::from(root.map(|x| x as f32));
        let depth = sight.camera.project(at, sight.viewport)?.depth;
        let height = 2.0 * depth * (0.5 * sight.camera.fov_y).tan();
        let shorter = sight.rect.size().min_elem().max(1.0);
        let length = LENGTH.min(0.18 * shorter) * height / sight.rect.height().max(1.0);
        (session.view.move_body && !body.is_empty()).then_some(Self { person, root, at, length })
    }

    /// Its handles: what each holds, where it is, what it is called.
    fn handles(&self) -> [(Holds, Vec3, &'static str, usize); 4] {
        let tip = |axis: usize| self.at + AXES[axis] * self.length;
        let arrow = |axis: usize, name| (Holds::Arrow(self.person, axis), tip(axis), name, axis);
        [
            arrow(0, "Move along x"),
            arrow(1, "Move along y"),
            arrow(2, "Move along z"),
            (Holds::Ring(self.person), self.on_ring(KNOB), "Turn", 2),
        ]
    }

    fn on_ring(&self, angle: f32) -> Vec3 {
        self.at + Vec3::new(angle.cos(), angle.sin(), 0.0) * (RING * self.length)
    }

    /// Draws the lines of the handles.
    pub(super) fn draw(&self, scene: &mut Scene, px: f32) {
        let stroke = |axis: usize| Stroke { color: AXIS_COLORS[axis], width_px: 2.5 * px };
        scene.overlay.extend((0..3).map(|axis| stroke(axis).line(self.at, self.at + AXES[axis] * self.length)));
        let ring = |k: usize| self.on_ring(TAU * k as f32 / 48.0);
        scene.overlay.extend((0..48).map(|k| stroke(2).line(ring(k), ring(k + 1))));
    }

    /// Shows the knobs; answers what was taken hold of, and whether a knob is held.
    pub(super) fn show(&self, ui: &Ui, sight: &Sight) -> (Option<Grab>, bool) {
        let (mut taken, mut held) = (None, false);
        for (holds, place, name, axis) in self.handles() {
            let Some(at) = sight.on_screen(place).filter(|at| sight.rect.contains(*at)) else { continue };
            let rect = egui::Rect::from_center_size(at, vec2(REACH, REACH));
            let response = ui.interact(rect, ui.scope_id().with(("handle", name)), Sense::drag());
            response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, name));
            if response.drag_started() {
                let press = ui.input(|i| i.pointer.press_origin()).unwrap_or(at);
                taken = Some(Grab { holds, start: self.root, press });
            }
            held |= response.dragged();
            let [r, g, b, _] = AXIS_COLORS[axis].map(|x| (x * 255.0) as u8);
            let radius = if response.hovered() || response.dragged() { 7.0 } else { 5.0 };
            let painter = ui.painter().with_clip_rect(sight.rect);
            painter.circle(
                at,
                radius,
                Color32::from_rgb(r, g, b),
                egui::Stroke::new(1.0, Color32::from_black_alpha(140)),
            );
            response.on_hover_and_drag_cursor(CursorIcon::Grab);
        }
        (taken, held)
    }
}
