//! What is seen of data and bodies: the read-out, the person in the middle, joints at their velocities, who is who.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::sizes::texts;
use crate::window::Window;
use egui::epaint::Shape;
use egui::{Color32, Key, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::body::Group;
use mhp_inspector::config::FitConfig;
use mhp_inspector::geometry::sub;
use mhp_inspector::session::Command;

/// COCO's.
const RIGHT_WRIST: usize = 10;

/// Opens one of the samples.
fn sample(name: &str) -> Window {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples").join(name);
    let harness = Window::empty(&[folder], [1440.0, 900.0]);
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    window
}

/// What the strip says of a place of the screen.
fn told(window: &mut Window, at: Pos2) -> String {
    window.harness.hover_at(at);
    window.harness.run_steps(3);
    window.text_of("Cell under the pointer")
}

/// The cell that the strip names: `hm_hori[12, 34]`.
fn cell(told: &str) -> [i64; 2] {
    let inside = told.split('[').nth(1).and_then(|rest| rest.split(']').next()).unwrap();
    let mut bins = inside.split(", ").map(|bin| bin.parse().unwrap());
    [bins.next().unwrap(), bins.next().unwrap()]
}

/// Stored value, dB, rank, H_sim, mask and place of the cell under the pointer, in the strip and never over a picture; a cell
/// at 0 is at the floor.
#[test]
fn the_readout_says_all_of_a_cell() {
    let mut window = sample("hupr");
    let map = window.node("H_ori map of hori").rect();
    let peak = told(&mut window, map.center());
    for part in ["hori[", "radial velocity ", " m/s", "range ", " m ", "H_ori ", " dB re max P", "H_sim ", "mask"] {
        assert!(peak.contains(part), "{part} in {peak}");
    }
    let strip = window.harness.get_by_label("Cell under the pointer").rect();
    assert!(strip.top() >= window.node("H_ori map of vert").rect().bottom(), "under the maps");
    // Nothing below the floor is written, whatever the map holds.
    let mut levels = Vec::new();
    for at in [0.02, 0.2, 0.4, 0.6, 0.8, 0.98] {
        let told = told(&mut window, map.lerp_inside(vec2(0.99, at)));
        let level =
            told.lines().nth(1).unwrap().split(" dB").next().unwrap().split_whitespace().last().unwrap().to_owned();
        assert!(level.replace('−', "-").parse::<f64>().unwrap() >= -60.0, "{told}");
        levels.push(told.contains("≤ "));
    }
    assert!(levels.contains(&true), "some of it is at the floor");
}

/// Maps go with the person from frame to frame, or stay where they are: a switch.
#[test]
fn the_focus_follows_the_person_or_stays() {
    let mut window = sample("walk");
    let last = window.session().data.len() - 1;
    let middle = |w: &mut Window| {
        let at = w.node("H_ori map of hm_hori").rect().center();
        cell(&told(w, at))
    };
    let off = |w: &mut Window| {
        let joints = w.session().shown_positions();
        let n = joints.len() as f64;
        let mean = [0, 1, 2].map(|k| joints.iter().map(|p| p[k]).sum::<f64>() / n);
        let bins = w.session().data.dataset.as_ref().unwrap().info().views[0].bins_of(mean);
        let seen = middle(w);
        (0..2).map(|k| (bins[k] - seen[k] as f64).abs()).fold(0.0, f64::max)
    };
    let (first, near) = (middle(&mut window), off(&mut window));
    assert!(near < 24.0, "{near} bins from the person");
    window.key(Key::End);
    window.ready(last);
    let (then, near) = (middle(&mut window), off(&mut window));
    assert!(then != first && near < 24.0, "{first:?} {then:?}, {near} bins from the person");
    window.click("What the maps show");
    window.click("Follow the person");
    window.key(Key::Escape);
    window.key(Key::Home);
    window.ready(0);
    assert_eq!(middle(&mut window), then, "stays");
}

/// On a Doppler axis a joint stands at its own radial velocity: there a click selects it.
#[test]
fn joints_stand_at_their_radial_velocities() {
    let mut window = sample("xrf55");
    window.key(Key::F);
    window.harness.run_steps(3);
    // A wrist that swings: its velocity is none of the body's.
    let (joint, velocity) = (RIGHT_WRIST, [0.9, 0.0, 0.0]);
    let mut params = window.fit().shown.as_ref().unwrap().params.clone();
    params.set_vec3(Group::Velocity, joint, velocity);
    window.apply(Command::EditParams(Box::new(params)));
    window.until("the other velocity", |w| {
        w.fit().shown.as_ref().is_some_and(|shown| (shown.params.velocity(joint)[0] - 0.9).abs() < 1e-3)
    });
    window.harness.run_steps(3);
    let view = window.session().data.dataset.as_ref().unwrap().info().views[1].clone();
    let map = window.node(&format!("H_ori map of {}", view.array)).rect();
    let at = |bins: Vec<f64>| {
        let unit = |axis: usize| (bins[axis] as f32 + 0.5) / view.axes[axis].bins as f32;
        // Range upward, from near to far or the other way round; velocity to the right.
        let near_first = view.axes[0].value_at(0.0) < view.axes[0].value_at(1.0);
        let up = if near_first { 1.0 - unit(0) } else { unit(0) };
        map.lerp_inside(vec2(unit(1), up))
    };
    let position = window.joint(joint);
    let (moving, still) = (view.bins_of_moving(position, velocity), view.bins_of(position));
    let (moving, still) = (at(moving), at(still));
    assert!((moving.x - still.x).abs() > 15.0, "{moving} {still}");
    window.pull(moving, vec2(0.0, 0.0));
    window.harness.run_steps(3);
    assert_eq!(window.session().joint, Some(joint));
}

/// Texts of the scene, with their colours and whether they lie on a ground of their own.
fn captions(window: &Window) -> Vec<(String, Color32, bool)> {
    fn grounds(shape: &Shape, into: &mut Vec<Rect>) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| grounds(shape, into)),
            Shape::Rect(rect) if rect.fill.a() > 150 => into.push(rect.rect),
            _ => {}
        }
    }
    let scene = window.node("3-D scene").rect();
    let mut found = Vec::new();
    for clipped in &window.harness.output().shapes {
        grounds(&clipped.shape, &mut found);
    }
    // Here is no graphics adapter, which is told in the middle.
    let told = |text: &egui::epaint::TextShape| text.galley.text().starts_with("No graphics");
    let inside = texts(window).into_iter().filter(|(text, clip)| scene.expand(1.0).contains_rect(*clip) && !told(text));
    let caption = |(text, _): (egui::epaint::TextShape, Rect)| {
        let (words, rect) = (text.galley.text().to_owned(), text.visual_bounding_rect().shrink(1.0));
        let ground = found.iter().any(|ground| ground.width() < 0.9 * scene.width() && ground.contains_rect(rect));
        let color = text.galley.job.sections.first().map_or(text.fallback_color, |section| section.format.color);
        (words, color, ground)
    };
    inside.map(caption).collect()
}

/// A person has one colour in the legend and over the head; what is written in the scene has a ground of its own.
#[test]
fn people_have_one_colour_and_captions_a_ground() {
    let mut window = sample("f3");
    window.apply(Command::SetConfig(Box::new(FitConfig { people: 2, ..window.session().config })));
    window.until("two people", |w| w.fit().shown.as_ref().is_some_and(|shown| shown.params.shape().persons == 2));
    window.harness.run_steps(3);
    let captions = captions(&window);
    let colors = |name: &str| -> Vec<Color32> {
        captions.iter().filter(|(words, ..)| words == name).map(|(_, color, _)| *color).collect()
    };
    let (first, second) = (colors("P1"), colors("P2"));
    assert!(first.len() >= 2 && second.len() >= 2, "in the legend and over the head: {captions:?}");
    assert!(first.iter().all(|color| *color == first[0]) && second.iter().all(|color| *color == second[0]));
    assert_ne!(first[0], second[0]);
    let bare: Vec<_> = captions.iter().filter(|(words, _, ground)| !ground && words.len() > 1).collect();
    assert!(bare.is_empty(), "{bare:?}");
}

/// With a key held, a joint that is dragged goes along one axis of the room.
#[test]
fn a_joint_is_dragged_along_an_axis() {
    let mut window = Window::fitted(1);
    window.apply(Command::SetView(Box::new(mhp_inspector::session::ViewState {
        keep_bones: false,
        ..window.session().view.clone()
    })));
    let from = window.joint(RIGHT_WRIST);
    let scene = window.node("3-D scene").rect();
    let at = window.seen(scene, from);
    let key = |pressed| egui::Event::Key {
        key: Key::Z,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: egui::Modifiers::NONE,
    };
    window.harness.hover_at(at);
    window.harness.step();
    window.harness.drag_at(at);
    window.harness.hover_at(at + vec2(5.0, 2.0));
    window.harness.step();
    window.harness.event(key(true));
    for k in 1..=6 {
        window.harness.hover_at(at + vec2(4.0, -6.0) * k as f32);
        window.harness.step();
    }
    window.harness.drop_at(at + vec2(24.0, -36.0));
    window.harness.event(key(false));
    window.until("the lifted finger", |w| !w.session().is_dragging());
    window.until("a joint that moved", |w| w.joint(RIGHT_WRIST) != from);
    let by = sub(window.joint(RIGHT_WRIST), from);
    assert!(by[2] > 0.05 && by[0].abs() + by[1].abs() < 1e-6, "{by:?}");
}
