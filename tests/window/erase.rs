//! The eraser: a box of cells that the fit is not to see, while it is drawn and after.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, Modifiers, Rect, pos2};
use mhp_inspector::session::Command;

/// H_ori's mask of a view.
fn measured(window: &Window, view: usize) -> Vec<bool> {
    window.fit().shown.as_ref().unwrap().masks[view].ori.clone()
}

/// Draws a box over a map with the eraser, and stops while it is under the finger.
fn draw(window: &mut Window, map: Rect, [from, to]: [[f32; 2]; 2]) {
    let at = |share: [f32; 2]| pos2(map.left() + share[0] * map.width(), map.top() + share[1] * map.height());
    window.key_with(Modifiers::SHIFT, Key::G);
    window.harness.step();
    window.harness.hover_at(at(from));
    window.harness.drag_at(at(from));
    window.harness.step();
    for k in 1..=6 {
        let share: [f32; 2] = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * k as f32 / 6.0);
        window.harness.hover_at(at(share));
        window.harness.step();
    }
}

fn lift(window: &mut Window, map: Rect, at: [f32; 2]) {
    window.harness.drop_at(pos2(map.left() + at[0] * map.width(), map.top() + at[1] * map.height()));
    window.until("the lifted finger", |w| !w.session().is_dragging());
}

fn live(window: &mut Window) {
    if !window.session().is_live() {
        window.key_with(Modifiers::SHIFT, Key::L);
    }
}

/// The fit follows the box; lifted, it is one branch, one flag, one line and one act, on the same frame and on another.
#[test]
fn the_fit_follows_the_eraser() {
    let mut window = Window::fitted(2);
    live(&mut window);
    window.key(Key::R);
    window.harness.run_steps(3);
    let (before, seen) = (window.fit().shown.clone().unwrap(), measured(&window, 0));
    let map = window.node("H_ori map of hori").rect();
    draw(&mut window, map, [[0.02, 0.02], [0.98, 0.98]]);
    window.until("a fit without these cells", |w| {
        let shown = w.fit().shown.as_ref();
        shown.is_some_and(|shown| shown.branch == 1 && shown.iteration == 20) && measured(w, 0) != seen
    });
    assert!(window.session().is_dragging());
    assert_eq!(window.fit().history.branches().len(), 2, "one branch, written anew");
    assert_ne!(measured(&window, 0), seen, "another mask");
    assert_ne!(window.fit().shown.as_ref().unwrap().params, before.params);
    lift(&mut window, map, [0.98, 0.98]);
    let name = window.session().undo_name().unwrap().to_owned();
    assert!(name.starts_with("erased hori["), "{name}");
    assert_eq!(window.session().log.iter().filter(|line| line.text.contains(&name)).count(), 1);
    assert_eq!(window.fit().history.flags(), [(0, name.clone())]);
    let (fitted, without) = (window.fit().shown.clone().unwrap().params.clone(), measured(&window, 0));

    window.key_with(Modifiers::COMMAND, Key::Z);
    window.until("the first fit", |w| w.fit().shown.as_ref().is_some_and(|shown| shown.branch == 0));
    assert_eq!((measured(&window, 0), &window.fit().shown.as_ref().unwrap().params), (seen, &before.params));
    window.key_with(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
    window.until("the second", |w| w.fit().shown.as_ref().is_some_and(|shown| shown.branch == 1));
    assert_eq!((&measured(&window, 0), &window.fit().shown.as_ref().unwrap().params), (&without, &fitted));
    // Left and found again, it still does not see them.
    window.key(Key::ArrowRight);
    window.ready(1);
    assert!(window.fit().erased().is_empty());
    window.key(Key::ArrowLeft);
    window.ready(0);
    assert_eq!((window.fit().erased().len(), measured(&window, 0)), (1, without));
}

/// Without live fits the finger is waited for; settings changed later still leave the cells out; a second box joins the first.
#[test]
fn what_is_erased_stays_erased() {
    let mut window = Window::fitted(1);
    window.switch_live_off();
    window.key(Key::R);
    window.harness.run_steps(3);
    let map = window.node("H_sim map of vert").rect();
    draw(&mut window, map, [[0.1, 0.1], [0.4, 0.4]]);
    assert_eq!(window.fit().history.branches().len(), 1, "nothing yet");
    lift(&mut window, map, [0.4, 0.4]);
    window.paused_at(20);
    assert_eq!((window.fit().history.active_id(), window.fit().erased().len()), (1, 1));
    live(&mut window);
    window.type_value("w_EM value", "2");
    window.paused_at(20);
    assert_eq!((window.fit().history.active_id(), window.fit().erased().len()), (2, 1));
    let map = window.node("H_sim map of vert").rect();
    draw(&mut window, map, [[0.6, 0.6], [0.9, 0.9]]);
    lift(&mut window, map, [0.9, 0.9]);
    window.paused_at(20);
    assert_eq!(window.fit().erased().len(), 2);
    // A session file keeps it.
    let elsewhere = tempfile::tempdir().unwrap();
    let path = elsewhere.path().join("kept.mhp-session");
    let without = measured(&window, 1);
    window.key_with(Modifiers::COMMAND, Key::S);
    window.answer_path("Save to", &path);
    window.until("the file", |_| path.is_file());
    window.apply(Command::OpenSession(path));
    window
        .until("the session", |w| w.fit().history.branches().len() == 1 && w.fit().is_ready() && w.fit().head() == 20);
    window.until("its picture", |w| w.fit().shown.is_some());
    assert_eq!((window.fit().erased().len(), measured(&window, 1)), (2, without));
}

/// Where nothing of a map would be left that is told, and the box stays as it was before; Esc puts the eraser down.
#[test]
fn a_map_that_is_erased_as_a_whole_is_told() {
    let mut window = Window::fitted(1);
    live(&mut window);
    window.key(Key::R);
    window.harness.run_steps(3);
    window.click("Erase cells");
    window.key(Key::Escape);
    window.harness.run_steps(2);
    let map = window.node("H_ori map of hori").rect();
    draw(&mut window, map, [[0.001, 0.001], [0.999, 0.999]]);
    window.until("why not", |w| w.told("nothing of hori would be left"));
    lift(&mut window, map, [0.999, 0.999]);
    window.key_with(Modifiers::COMMAND, Key::Z);
    window.paused_at(20);
    assert_eq!(window.fit().history.active_id(), 0);
}
