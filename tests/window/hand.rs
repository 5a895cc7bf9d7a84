//! The body moved with the mouse, in 3-D and on a map.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, Modifiers, Pos2, Rect, pos2, vec2};
use mhp_inspector::app::Pane;
use mhp_inspector::geometry::{norm, sub};
use mhp_inspector::render::{Camera, Vec2, Vec3};
use mhp_inspector::session::Command;

/// COCO's joints.
const RIGHT_WRIST: usize = 10;
const NOSE: usize = 0;

impl Window {
    pub(crate) fn joint(&self, joint: usize) -> [f64; 3] {
        self.session().shown_positions()[joint]
    }

    /// Where the camera that nobody has moved sees a place.
    pub(crate) fn seen(&self, rect: Rect, at: [f64; 3]) -> Pos2 {
        let positions = self.session().shown_positions();
        let places = positions.iter().map(|p| Vec3::from(p.map(|x| x as f32)));
        let middle = places.fold(Vec3::ZERO, |sum, p| sum + p) / positions.len() as f32;
        let camera = Camera::overview(middle * 0.62, (middle.length() * 0.62).max(2.4 * 0.8));
        let seen = camera.project(Vec3::from(at.map(|x| x as f32)), Vec2::new(rect.width(), rect.height())).unwrap();
        rect.min + vec2(seen.px.x, seen.px.y)
    }

    /// Presses the mouse, moves it in small steps, and lets it go.
    pub(crate) fn pull(&mut self, from: Pos2, by: egui::Vec2) {
        self.harness.hover_at(from);
        self.harness.step();
        self.harness.drag_at(from);
        for k in 1..=6 {
            self.harness.hover_at(from + by * k as f32 / 6.0);
            self.harness.step();
        }
        self.harness.drop_at(from + by);
        self.until("the lifted finger", |w| !w.session().is_dragging());
    }

    /// Presses a key so many times while Alt is held, and lifts both.
    pub(crate) fn nudge(&mut self, key: Key, times: usize) {
        let modifiers = Modifiers::ALT;
        self.harness.event(egui::Event::ModifiersChanged(modifiers));
        for _ in 0..times {
            for pressed in [true, false] {
                let event = egui::Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
                self.harness.event(event);
            }
            self.harness.step();
        }
        assert!(self.session().is_moving(), "held until Alt is lifted");
        self.harness.event(egui::Event::ModifiersChanged(Modifiers::NONE));
        self.until("Alt lifted", |w| !w.session().is_dragging());
    }

    fn moved(&mut self, joint: usize, from: [f64; 3]) -> [f64; 3] {
        self.until("a joint that moved", |w| norm(sub(w.joint(joint), from)) > 0.02);
        sub(self.joint(joint), from)
    }
}

#[test]
fn a_joint_dragged_in_3d_moves_and_comes_back() {
    let mut window = Window::fitted(1);
    let from = window.joint(RIGHT_WRIST);
    let scene = window.node("3-D scene").rect();
    let at = window.seen(scene, from);
    window.pull(at, vec2(40.0, -10.0));
    window.moved(RIGHT_WRIST, from);
    assert_eq!(window.fit().history.branches().len(), 2);
    let name = window.session().undo_name().unwrap().to_owned();
    assert!(name.starts_with("right wrist moved 0."), "{name}");
    assert_eq!(window.session().log.iter().filter(|line| line.text.contains(&name)).count(), 1);
    window.key_with(Modifiers::COMMAND, Key::Z);
    window.until("the joint where it was", |w| w.joint(RIGHT_WRIST) == from);
    window.key_with(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
    window.moved(RIGHT_WRIST, from);
}

#[test]
fn empty_space_turns_the_camera_and_a_click_selects() {
    let mut window = Window::fitted(1);
    let scene = window.node("3-D scene").rect();
    window.pull(scene.left_center() + vec2(8.0, 40.0), vec2(30.0, 5.0));
    assert_eq!(window.fit().history.branches().len(), 1);
    window.key(Key::R);
    window.harness.run_steps(2);
    let at = window.seen(scene, window.joint(RIGHT_WRIST));
    window.pull(at, vec2(0.0, 0.0));
    window.harness.run_steps(3);
    assert!(window.session().joint.is_some());
    let joint_pane = |w: &Window| w.harness.state().pane_rect(Pane::called("Joint").unwrap());
    assert!(joint_pane(&window).is_some(), "its pane is in front");
    // Behind another pane, a click on the same joint brings it back.
    window.key_with(Modifiers::COMMAND, Key::Num6);
    window.until("another pane in front", |w| joint_pane(w).is_none());
    // No double click.
    window.harness.run_steps(60);
    window.pull(at, vec2(0.0, 0.0));
    window.until("the joint's pane", |w| joint_pane(w).is_some());
    assert_eq!(window.fit().history.branches().len(), 1);
}

/// The cell under the pointer is drawn in the room, and the joint under it on the maps, whichever of them it is over.
#[test]
fn what_is_pointed_at_is_shown_in_3d_and_on_the_maps() {
    let mut window = Window::fitted(1);
    window.key(Key::R);
    window.harness.run_steps(3);
    let circles = |w: &Window, inside: Rect| -> usize {
        let is_ring = |shape: &egui::Shape| matches!(shape, egui::Shape::Circle(ring) if ring.radius == 9.0);
        let shapes = w.harness.output().shapes.iter();
        shapes.filter(|s| is_ring(&s.shape) && inside.contains(s.shape.visual_bounding_rect().center())).count()
    };
    let (scene, map) = (window.node("3-D scene").rect(), window.node("H_ori map of hori").rect());
    assert_eq!((circles(&window, scene), circles(&window, map)), (0, 0));
    // Over the joint in 3-D: a ring there and on the map.
    let at = window.seen(scene, window.joint(RIGHT_WRIST));
    window.harness.hover_at(at);
    window.harness.run_steps(3);
    assert!(circles(&window, scene) > 0 && circles(&window, map) > 0);
    // Over its mark on the map, which is not where the pointer was.
    let bins = window.session().data.dataset.as_ref().unwrap().info().views[0].bins_of(window.joint(RIGHT_WRIST));
    let share = |bin: f64, bins: f32| (bin as f32 + 0.5) / bins;
    window.harness.hover_at(map.lerp_inside(vec2(share(bins[1], 32.0), share(bins[0], 48.0))));
    window.harness.run_steps(3);
    assert!(circles(&window, scene) > 0 && circles(&window, map) > 0);
    assert!(window.text_of("3-D scene").contains("cell of hori"), "{}", window.text_of("3-D scene"));
    window.harness.hover_at(map.right_top() + vec2(-3.0, 3.0));
    window.harness.run_steps(3);
    assert_eq!(circles(&window, map), 0);
    assert!(window.text_of("3-D scene").contains("cell of hori"));
    window.harness.remove_cursor();
    window.harness.run_steps(3);
    assert!(!window.text_of("3-D scene").contains("cell of hori"));
}

#[test]
fn a_joint_dragged_on_a_map_stays_at_its_height() {
    let mut window = Window::fitted(1);
    let from = window.joint(RIGHT_WRIST);
    window.key(Key::R);
    window.harness.run_steps(3);
    let rect = window.node("H_ori map of hori").rect();
    // Depth 0..6 m upward, 2 m at the left.
    let bins = window.session().data.dataset.as_ref().unwrap().info().views[0].bins_of(from);
    let share = |bin: f64, bins: f32| (bin as f32 + 0.5) / bins;
    let at = pos2(rect.left() + share(bins[1], 32.0) * rect.width(), rect.top() + share(bins[0], 48.0) * rect.height());
    window.apply(Command::SetView(Box::new(mhp_inspector::session::ViewState {
        keep_bones: false,
        ..window.session().view.clone()
    })));
    window.pull(at, vec2(0.2 * rect.width(), 0.0));
    let by = window.moved(RIGHT_WRIST, from);
    assert!((by[1] + 0.8).abs() < 0.1 && by[2].abs() < 1e-6, "to the right, level: {by:?}");
}

#[test]
fn a_body_is_moved_and_turned_by_its_handles() {
    let mut window = Window::fitted(1);
    assert!(!window.named("Move along x"));
    window.key(Key::H);
    window.harness.run_steps(2);
    let from = window.joint(NOSE);
    let tip = window.node("Move along z").rect().center();
    window.pull(tip, vec2(0.0, -25.0));
    let by = window.moved(NOSE, from);
    assert!(by[2] > 0.05 && by[0].abs() + by[1].abs() < 1e-9, "{by:?}");
    assert!(window.session().undo_name().unwrap().starts_with("body moved 0."));
    let (nose, wrist) = (window.joint(NOSE), window.joint(RIGHT_WRIST));
    let knob = window.node("Turn").rect().center();
    window.pull(knob, vec2(-30.0, 4.0));
    let by = window.moved(RIGHT_WRIST, wrist);
    assert!(by[2].abs() < 1e-9);
    let apart = |a, b| norm(sub(a, b));
    let now = apart(window.joint(NOSE), window.joint(RIGHT_WRIST));
    assert!((now - apart(nose, wrist)).abs() < 1e-9, "a turn keeps every distance");
    assert!(window.session().undo_name().unwrap().contains("turned"));
    window.key(Key::H);
    window.harness.run_steps(2);
    assert!(!window.named("Move along z"));
}

#[test]
fn a_run_is_told_to_be_paused_first() {
    let mut window = Window::open(1);
    window.run_forever();
    let scene = window.node("3-D scene").rect();
    let at = window.seen(scene, window.joint(RIGHT_WRIST));
    window.pull(at, vec2(30.0, 0.0));
    assert!(window.told("pause the run to move the body by hand"));
    assert_eq!(window.fit().history.branches().len(), 1);
}

#[test]
fn a_joint_and_a_body_are_moved_by_keys() {
    let mut window = Window::fitted(1);
    window.key_with(Modifiers::ALT, Key::ArrowLeft);
    assert!(window.told("select a joint to move it"));
    window.harness.run_steps(2);
    window.key(Key::J);
    assert_eq!(window.session().joint, Some(NOSE));
    window.key_with(Modifiers::SHIFT, Key::J);
    let last = window.session().shown_positions().len() - 1;
    assert_eq!(window.session().joint, Some(last), "round the body");
    while window.session().joint != Some(RIGHT_WRIST) {
        window.key(Key::J);
    }
    let from = window.joint(RIGHT_WRIST);
    window.nudge(Key::ArrowRight, 3);
    let by = window.moved(RIGHT_WRIST, from);
    assert!(by[1] < -0.02, "{by:?}");
    assert_eq!(window.fit().history.branches().len(), 2, "three presses are one act");
    assert!(window.session().undo_name().unwrap().starts_with("right wrist moved 0."));
    window.key_with(Modifiers::COMMAND, Key::Z);
    window.until("the joint where it was", |w| w.joint(RIGHT_WRIST) == from);
    window.key(Key::H);
    window.harness.run_steps(2);
    let from = window.joint(NOSE);
    window.nudge(Key::ArrowLeft, 3);
    let by = window.moved(NOSE, from);
    assert!((by[1] - 0.06).abs() < 1e-9 && by[0].abs() + by[2].abs() < 1e-9, "{by:?}");
    assert_eq!(window.session().undo_name().unwrap(), "body moved 0.06 m");
}
