//! What a fit rests on: what the radar knows, the closure test, τ under the finger, another radar, the eraser's ways.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, Modifiers, pos2};
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::explore::{IdleCores, Noise, observability, tau_ribbon};
use mhp_inspector::folders::HOME_VARIABLE;
use mhp_inspector::task::Progress;

#[test]
fn what_the_radar_knows_is_told_as_the_library_has_it() {
    let mut window = Window::fitted(1);
    window.show("Radar knows");
    window.until("the matrix", |w| w.says("Least observable, widest first"));
    let state = window.session().explored_state().unwrap();
    let known = observability(&state, Noise::Measured, (&IdleCores::all(), &Progress::new())).unwrap();
    assert!(window.says(&format!("{:.1} of {:.0}", known.fixed[0], known.fixed[1])), "{:?}", window.names());
    let second = format!("Direction {}", known.unseen[1].name);
    let row = window.harness.query_all_by_label(&second).last().unwrap();
    row.click();
    window.harness.run_steps(3);
    assert!(
        window
            .harness
            .query_all_by_label(&second)
            .any(|node| node.value().unwrap_or_default().contains("of what fixes it"))
    );
    window.click("SNR");
    window.until("another matrix", |w| !w.says("differences of the gradient"));
}

#[test]
fn a_pose_is_tested_with_one_click() {
    let mut window = Window::fitted(1);
    window.show("Closure test");
    assert!(window.says("Could this pose have been recovered"));
    window.click("Test this pose");
    window.until("the test", |w| w.named("Closure test result"));
    assert!(window.says("MAJPE of the fit"), "{:?}", window.names());
    assert!(window.text_of("Closure error of left knee").ends_with(" mm"));
    assert!(window.named("Synthetic map of hori") && window.named("Synthetic map of vert"));
    assert!(window.says("The FFTs of hori, vert are not known"));
}

#[test]
fn tau_is_seen_at_every_value_and_taken_by_a_click() {
    let mut window = Window::fitted(1);
    window.until("the ribbon", |w| w.value("IoU at every τ").starts_with("IoU"));
    let (shown, problem) = (window.fit().shown.clone().unwrap(), window.fit().problem.clone().unwrap());
    let maps: Vec<(&[f64], &[f64])> =
        shown.h_sim.iter().enumerate().map(|(k, sim)| (problem.map(k), sim.as_slice())).collect();
    let ribbon = tau_ribbon(&maps, &shown.masks);
    let (tau, iou) = ribbon.best().unwrap();
    let told = window.value("IoU at every τ");
    assert!(told.contains(&format!("largest at τ {tau} % (IoU {iou:.3})")), "{told}");
    // What is under the pointer is told, whichever τ is set.
    window.reveal("IoU at every τ");
    let rect = window.node("IoU at every τ").rect();
    window.harness.hover_at(pos2(rect.left() + 0.25 * rect.width(), rect.center().y));
    let at = format!("τ 15.0 %: IoU {:.3}", ribbon.at(15.0).unwrap());
    window.until("the τ under the pointer", |w| w.value("IoU at every τ").starts_with(&at));
    window.click("Mask outlines at τ");
    assert!(window.session().view.show_outlines);
    window.click("Point clouds at τ");
    window.until("the clouds", |w| w.says("PPPR "));
    let rect = window.node("IoU at every τ").rect();
    let at = pos2(rect.left() + 0.5 * rect.width(), rect.center().y);
    window.harness.hover_at(at);
    window.harness.drag_at(at);
    window.harness.run_steps(2);
    window.harness.drop_at(at);
    window.until("another τ", |w| w.session().config.tau_pct == 30.0);
}

#[test]
fn another_radar_is_put_beside_todays() {
    let mut window = Window::fitted(1);
    window.show("Radar what-if");
    window.until("both radars", |w| w.named("What-if map of hori, other"));
    let before = window.text_of("What-if numbers");
    assert!(before.contains("directions the echo fixes: today"), "{before}");
    let slider = window.node("Elements").rect();
    window.harness.hover_at(slider.center());
    window.harness.drag_at(slider.center());
    window.harness.run_steps(1);
    let right = pos2(slider.right() - 4.0, slider.center().y);
    window.harness.hover_at(right);
    window.harness.run_steps(1);
    window.harness.drop_at(right);
    window.until("the other radar", |w| w.named("What-if numbers") && w.text_of("What-if numbers") != before);
    let after = window.text_of("What-if numbers");
    let width = |text: &str, which: &str| {
        let row = text.split("; ").find(|row| row.starts_with("hori angle width")).unwrap().to_owned();
        let at = row.split(which).nth(1).unwrap().trim_start().split('°').next().unwrap().to_owned();
        at.parse::<f64>().unwrap()
    };
    assert!(width(&after, "other") < width(&after, "today"), "{after}");
}

/// A radar is kept under a name of the user's, and one of the program's is refused; alone in a process, with a home of its own.
#[test]
fn another_radar_is_kept_as_a_preset() {
    if std::env::var_os(HOME_VARIABLE).is_none() {
        let home = tempfile::tempdir().unwrap();
        let mut alone = std::process::Command::new(std::env::current_exe().unwrap());
        alone.args(["rests_on::another_radar_is_kept_as_a_preset", "--exact", "--nocapture"]);
        let done = alone.env(HOME_VARIABLE, home.path()).output().unwrap();
        let said = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success() && said.contains("1 passed"), "{said}");
        return;
    }
    let mut window = Window::fitted(1);
    window.show("Radar what-if");
    window.until("both radars", |w| w.named("What-if map of hori, other"));
    let refused = window.session().log.len();
    for (name, expected) in [("awr2243", "is a radar of the program"), ("rooftop", "radar rooftop kept in")] {
        window.node("Name of the preset").focus();
        window.harness.step();
        window.key_with(Modifiers::COMMAND, Key::A);
        window.type_text(name);
        window.harness.run_steps(2);
        window.click("Save as preset");
        window.until(expected, |w| w.told(expected));
    }
    assert!(window.session().log.len() > refused);
    let kept = mhp_inspector::dataset::RadarPreset::named("rooftop").unwrap();
    assert!(kept.about.starts_with("what-if of "), "{}", kept.about);
}

/// The card of F1 offers the eraser for the reflector that it names.
#[test]
fn the_reflector_that_f1_names_is_erased() {
    let sample = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/f1");
    let harness = Window::empty(&[sample], [1440.0, 900.0]);
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    for frame in 1..=5 {
        window.click("Next frame");
        window.ready(frame);
    }
    window.key(Key::Enter);
    window.until("the end of the run", |w| w.fit().head() > 0 && !w.fit().is_running());
    window.at_rest();
    window.show("Failure modes");
    let name = |w: &Window| w.names().into_iter().find(|name| name.starts_with("erase where F1 is seen"));
    window.click("Findings of F1");
    window.until("a reflector", |w| name(w).is_some());
    let link = name(&window).unwrap();
    window.reveal(&link);
    window.click(&link);
    window.until("the fit without it", |w| w.fit().erased().len() == 1 && !w.fit().is_running());
    assert!(window.session().undo_name().unwrap().starts_with("erased "), "{:?}", window.session().undo_name());
    window.until("what it was worth", |w| w.named("Without the erased cells"));
}

/// A whole echo goes by one click, cells go under the brush; what they were worth is told, and a label remembers them.
#[test]
fn echoes_and_strokes_are_erased() {
    let mut window = Window::fitted(1);
    window.key(Key::R);
    window.harness.run_steps(3);
    window.click("Erase cells");
    window.click("Erase by echo");
    let map = window.node("H_ori map of hori").rect();
    let at = |x: f32, y: f32| pos2(map.left() + x * map.width(), map.top() + y * map.height());
    // The body stands in the middle of the map, at half its depth.
    window.harness.hover_at(at(0.5, 0.5));
    window.harness.run_steps(1);
    window.harness.drag_at(at(0.5, 0.5));
    window.harness.drop_at(at(0.5, 0.5));
    window.until("the echo gone", |w| w.fit().erased().len() == 1 && !w.fit().is_running());
    let erased = window.fit().erased();
    assert!(erased[0].cells.len() > 4, "{erased:?}");
    assert!(window.session().undo_name().unwrap().starts_with("erased an echo of "));
    window.until("what it was worth", |w| w.named("Without the erased cells"));
    assert!(window.text_of("Without the erased cells").contains("With → without: L_EM"));
    window.click("Erase by brush");
    window.harness.hover_at(at(0.2, 0.2));
    window.harness.drag_at(at(0.2, 0.2));
    for k in 0..6 {
        window.harness.hover_at(at(0.2 + 0.03 * k as f32, 0.2));
        window.harness.step();
    }
    window.harness.drop_at(at(0.35, 0.2));
    window.until("the stroke", |w| w.fit().erased().len() == 2 && !w.session().is_dragging() && !w.fit().is_running());
    assert!(window.fit().erased()[1].cells.len() > 10);
    window.key_with(Modifiers::COMMAND, Key::Z);
    window.until("the stroke taken back", |w| w.fit().erased().len() == 1);
}

/// A label that is given to a fit without some cells says which.
#[test]
fn a_label_remembers_what_its_fit_did_not_see() {
    let folder = tempfile::tempdir().unwrap();
    crate::blob::write_dataset(folder.path(), 1);
    let mut window = Window::on(folder);
    window.until("the journals", |w| w.session().labels.status == mhp_inspector::session::LabelStatus::Ready);
    let region: mhp_inspector::labels::CellRegion = "vert[3..=9, 4..=12]".parse().unwrap();
    window.apply(mhp_inspector::session::Command::DragErase(region.clone()));
    window.apply(mhp_inspector::session::Command::EndDrag);
    window.until("a fit without them", |w| !w.fit().erased().is_empty() && !w.fit().is_running());
    window.key(Key::Num1);
    window.until("F1", |w| w.tags(0) == "F1");
    let journal = window.folder.path().join("mhp-labels/ada.labels.jsonl");
    let record = mhp_inspector::labels::read_journal(&journal).unwrap().pop().unwrap();
    assert_eq!(record.judged.erased, [region]);
}
