//! Breakpoints: typed, hit, told, switched off, kept in a session file.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::Key;
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::session::{Command, FitStatus};

fn type_condition(window: &mut Window, text: &str) {
    let field = window.harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "Stop where");
    field.focus();
    window.harness.run_steps(2);
    window.type_text(text);
}

#[test]
fn a_run_stops_where_a_person_said() {
    let mut window = Window::open(1);
    window.type_value("Iterations value", "30");
    window.show("Breakpoints");
    assert!(window.says("No breakpoint. Runs go to their end"));
    type_condition(&mut window, "iou<x");
    assert!(window.says("`x` is not a number"), "{:?}", window.names());
    window.key_with(egui::Modifiers::COMMAND, Key::A);
    window.type_text("iteration>=7");
    window.click("Add breakpoint");
    assert_eq!(window.session().breakpoints.list().len(), 1);
    assert!(window.says("not hit"));
    window.key(Key::Enter);
    window.paused_at(7);
    window.until("the toast", |w| w.told("stopped at iteration 7: iteration>=7"));
    assert_eq!(window.fit().reason, Some("stopped at a breakpoint"));
    assert!(window.says("hit once"));
    assert_eq!(window.fit().history.flags(), [(7, "stopped: iteration>=7".to_owned())]);
    // The run goes on from there; switched off, a new one goes to its end.
    window.key(Key::Enter);
    window.paused_at(30);
    window.click("Stop where iteration>=7");
    assert!(!window.session().breakpoints.list()[0].enabled);
    window.apply(Command::Reset);
    window.ready(0);
    window.key(Key::Enter);
    window.paused_at(30);
    assert_eq!(window.session().breakpoints.list()[0].hits, 1);
    window.click("Stop where iteration>=7");
    window.apply(Command::Reset);
    window.ready(0);
    window.key(Key::Enter);
    window.paused_at(7);
    // A session file keeps all of it.
    let elsewhere = tempfile::tempdir().unwrap();
    let path = elsewhere.path().join("kept.mhp-session");
    window.key_with(egui::Modifiers::COMMAND, Key::S);
    window.answer_path("Save to", &path);
    window.until("the file", |_| path.is_file());
    window.click("Remove iteration>=7");
    assert!(window.session().breakpoints.list().is_empty());
    window.apply(Command::OpenSession(path));
    window.until("the session", |w| {
        !w.session().breakpoints.list().is_empty() && w.fit().status == FitStatus::Paused && w.fit().head() == 7
    });
    assert_eq!(window.session().breakpoints.list()[0].hits, 2);
    assert_eq!(window.fit().history.flags(), [(7, "stopped: iteration>=7".to_owned())]);
    window.click("iteration>=7: at iteration 7");
}
