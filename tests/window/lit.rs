//! Who lit a cell: the list, the worth of the joints, footprints, maps with and without a joint.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, pos2};
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::explore::{IdleCores, leave_one_out};
use mhp_inspector::mhp::{JointReturns, KeptJoints};
use mhp_inspector::session::{Command, Isolate};
use mhp_inspector::task::Progress;

#[test]
fn the_joints_that_light_a_cell_are_told() {
    let mut window = Window::fitted(1);
    window.show("Who lit it");
    window.key(Key::R);
    window.harness.run_steps(3);
    assert!(window.says("The brightest cell of H_sim"));
    let map = window.node("H_sim map of hori").rect();
    let at = pos2(map.left() + 0.5 * map.width(), map.top() + 0.5 * map.height());
    window.harness.hover_at(at);
    window.until("the returns", |w| w.text_of("3-D scene").contains("glowing"));
    window.harness.run_steps(4);
    let shown = window.fit().shown.clone().unwrap();
    let problem = window.fit().problem.clone().unwrap();
    let returns = JointReturns::new(&problem, &shown.config, &shown.params);
    // 48 rows and 32 columns: the pointer is on the cell behind the middle.
    let cell = 24 * 32 + 16;
    let first = returns.at(0, cell).remove(0);
    let name = format!("Joint {}", problem.skeleton.shown_name(first.joint));
    let told =
        format!("{:.0} % of the amplitudes, {:+.0} % of the cell", 100.0 * first.amplitude_share, 100.0 * first.share);
    assert!(window.texts_of(&name).contains(&told), "{name}: {told} in {}", window.texts_of(&name));
    assert!(window.named("Phasor diagram") == returns.is_coherent());
    // The same joints glow in 3-D, strongest first.
    let glows = window.text_of("3-D scene");
    let share = format!("glowing: {} {:.0} %", problem.skeleton.shown_name(first.joint), 100.0 * first.amplitude_share);
    assert!(glows.starts_with("places of the cell of hori at column 16, row ") && glows.contains(&share), "{glows}");
    // The worth of every joint, as the library has it.
    window.until("the joints left out", |w| w.says("its drop without a joint"));
    let state = window.session().explored_state().unwrap();
    let worth = leave_one_out(&state, (&IdleCores::all(), &Progress::new())).unwrap();
    let best = worth.joints[0];
    let name = format!("Joint {}", problem.skeleton.shown_name(best.joint));
    let told = format!("IoU {:+.4} without it", -best.drop);
    assert!(window.texts_of(&name).contains(&told), "{name}: {told} in {}", window.texts_of(&name));
    // A joint that is pointed at leaves its footprint on every map.
    let row = window.harness.query_all_by_label(&name).last().unwrap();
    row.hover();
    let (print, joint) = (format!("footprint of {}: ", problem.skeleton.shown_name(best.joint)), best.joint);
    window.until("the footprint", |w| w.text_of("H_ori map of vert").starts_with(&print));
    let told = window.text_of("H_sim map of hori");
    let alone = returns.whole(0, KeptJoints::Only(joint));
    let most = alone.iter().copied().fold(0.0, f64::max);
    let within = |db: f64| alone.iter().filter(|x| **x >= most * 10f64.powf(-db / 20.0)).count();
    assert_eq!(told, format!("{print}{} cells within 3 dB, {} within 10 dB", within(3.0), within(10.0)));
    // A click selects the joint; the key goes through the maps without and of it alone.
    let row = window.harness.query_all_by_label(&name).last().unwrap();
    row.scroll_to_me();
    window.harness.run_steps(4);
    let row = window.harness.query_all_by_label(&name).last().unwrap();
    row.click();
    window.harness.run_steps(3);
    assert_eq!(window.session().joint, Some(best.joint));
    window.key(Key::I);
    assert_eq!(window.session().view.isolate, Isolate::Without);
    window.harness.run_steps(3);
    assert!(window.named("H_sim without the joint map of hori"), "{:?}", window.names());
    window.key(Key::I);
    window.harness.run_steps(3);
    assert!(window.named("H_sim of the joint alone map of vert"));
    window.key(Key::I);
    assert_eq!(window.session().view.isolate, Isolate::All);
    let only = returns.whole(0, KeptJoints::Only(best.joint));
    assert_eq!(only.len(), 48 * 32);
    // Another frame has another fit: the list follows.
    window.apply(Command::SelectJoint(None));
    window.harness.run_steps(2);
}
