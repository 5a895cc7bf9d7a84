//! The real window without a display, driven by the names that a screen reader would say.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::window::Window;
use egui::accesskit::Toggled;
use egui::{Key, Modifiers, pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use mhp_inspector::app::{Begin, InspectorApp, Pane};
use mhp_inspector::body::Group;
use mhp_inspector::config::{FitConfig, Preset};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::geometry::{norm, sub};
use mhp_inspector::session::{Command, Compare, FitStatus, ThemeChoice};
use mhp_inspector::start::{find_start, problem_of};
use mhp_inspector::task::Progress;
use std::sync::Arc;
use std::time::{Duration, Instant};

#[test]
fn a_data_set_opens_runs_pauses_and_steps() {
    let mut window = Window::open(3);
    assert_eq!((window.session().data.len(), window.fit().head()), (3, 0));
    window.slowly();
    window.type_value("Iterations value", "100000");
    window.click("Run fit");
    window.until("some iterations", |w| w.fit().is_running() && w.fit().head() > 5);
    window.click("Pause fit");
    window.until("the pause", |w| w.fit().status == FitStatus::Paused);
    let head = window.fit().head();
    let first = window.fit().branch().unwrap().rows[0].report.loss;
    assert!(window.fit().branch().unwrap().rows[head].report.loss < first);
    window.click("Step forward");
    window.paused_at(head + 1);
    window.click("Ten steps forward");
    window.paused_at(head + 11);
    window.click("Step back");
    window.until("the iteration before", |w| w.fit().shown.as_ref().is_some_and(|s| s.iteration == head + 10));
    assert_eq!(window.fit().cursor, Some(head + 10));
    assert!(window.says("looking back"));
    window.click("Follow newest");
    window.until("the newest", |w| w.fit().shown.as_ref().is_some_and(|s| s.iteration == head + 11));
    assert_eq!(window.fit().cursor, None);
}

#[test]
fn presets_are_chosen_by_what_they_stand_for() {
    let mut window = Window::open(2);
    for preset in [Preset::Paper, Preset::Recommended, Preset::Baseline] {
        window.click(&format!("Preset {}", preset.name()));
        window.harness.run_steps(2);
        assert_eq!(window.session().config, preset.config(), "{}", preset.name());
        assert!(window.says(preset.brief()), "{}", preset.name());
    }
}

/// A fit that will not move says why before it is run, beside the button that runs it.
#[test]
fn a_fit_that_leaves_the_joints_where_they_start_says_so() {
    let mut window = Window::open(1);
    window.ready(0);
    assert!(!window.says("held at the start"));
    window.click("Preset recommended");
    window.until("a start of motion", |w| {
        w.fit().found_start.as_ref().is_some_and(|found| found.initialisation.motion.is_some())
    });
    let found = window.fit().found_start.clone().unwrap().initialisation;
    window.harness.run_steps(2);
    match found.motion.unwrap() {
        Err(held) => {
            assert!(held.starts_with("held at the start: ") && found.notes.iter().any(|note| note == held), "{held}");
            let what = held.split(';').next().unwrap();
            assert!(window.named(what), "{what}");
        }
        Ok(told) => {
            assert!(found.notes.contains(&told), "{told}");
            assert!(!window.says("held at the start"));
        }
    }
}

/// A start is found as soon as a data set is open: settings that come later would not be in it.
#[test]
fn settings_given_at_the_beginning_are_in_the_first_start() {
    let sample = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk");
    let config = Preset::Recommended.config();
    let begin = Begin { paths: vec![sample.clone()], config: Some(config), ..Begin::default() };
    let harness = Harness::builder().with_size([1280.0, 800.0]).build_eframe(|cc| InspectorApp::begin(cc, &begin));
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    let dataset = Dataset::open(&sample, &Progress::new()).unwrap();
    let problem = Arc::new(problem_of(&dataset, &dataset.load(0).unwrap()).unwrap());
    let start = find_start(&problem, &config).unwrap().initialisation.params;
    assert_eq!(window.session().config, config);
    assert_eq!(window.fit().initial.as_ref(), Some(&start));
    // Where nothing was fitted yet, another preset finds another start; a slider does not, nor a preset after a run.
    let plain = FitConfig::default();
    window.apply(Command::SetConfig(Box::new(plain)));
    window.ready(0);
    let other = find_start(&problem, &plain).unwrap().initialisation.params;
    assert!(window.fit().initial.as_ref() == Some(&other) && other != start);
    window.switch_live_off();
    let job = window.fit().job;
    window.apply(Command::SetConfig(Box::new(FitConfig { w_em: 0.7, ..plain })));
    window.apply(Command::StepFit(2));
    window.paused_at(2);
    window.apply(Command::SetConfig(Box::new(config)));
    window.ready(0);
    assert!(window.fit().job == job && window.fit().head() == 2, "what was fitted is kept");
}

#[test]
fn the_scrubber_shows_any_earlier_iteration() {
    let mut window = Window::fitted(1);
    window.drag("Iteration scrubber", 0.9, 0.25);
    window.until("iteration 5", |w| w.fit().shown.as_ref().is_some_and(|s| s.iteration == 5));
    assert_eq!(window.fit().cursor, Some(5));
    window.drag("Iteration scrubber", 0.25, 1.0);
    window.paused_at(20);
    assert_eq!(window.fit().cursor, None);
}

#[test]
fn a_setting_typed_during_a_run_takes_effect_and_is_flagged() {
    let mut window = Window::open(1);
    window.run_forever();
    window.type_value("τ_pct value", "20");
    window.until("the flag", |w| !w.fit().branch().unwrap().flags.is_empty());
    assert!(window.fit().is_running(), "the run goes on");
    assert_eq!(window.fit().branch().unwrap().flags[0].text, "τ_pct 10 → 20");
    assert_eq!(window.fit().history.branches().len(), 1);
    // Keys work after numbers were typed and sliders dragged.
    window.key(Key::Enter);
    window.until("the pause", |w| w.fit().status == FitStatus::Paused);
    let head = window.fit().head();
    window.drag("w_EM", 0.5, 0.7);
    assert!(window.session().config.w_em != 0.5);
    window.key(Key::Period);
    window.paused_at(head + 1);
    window.drag("w_kine value", 0.5, 0.9);
    assert!(window.session().config.w_kine > 0.5);
    window.key(Key::Comma);
    window.until("the step back", |w| w.fit().cursor == Some(head));
    window.key(Key::L);
    window.until("the newest", |w| w.fit().cursor.is_none());
    window.key(Key::Enter);
    window.until("another run", |w| w.fit().is_running());
    let weights: Vec<&str> = window.fit().branch().unwrap().flags.iter().map(|flag| flag.text.as_str()).collect();
    assert!(weights.iter().any(|text| text.contains("w_EM")), "{weights:?}");
}

#[test]
fn a_setting_changed_at_an_earlier_iteration_branches_and_discard_goes_back() {
    let mut window = Window::fitted(1);
    window.switch_live_off();
    window.key_with(Modifiers::SHIFT, Key::Comma);
    window.until("iteration 10", |w| w.fit().shown.as_ref().is_some_and(|s| s.iteration == 10));
    // Two keystrokes: the branch that the first one begins must not take the field away from the second.
    window.type_value("w_EM value", "2.5");
    window.paused_at(10);
    assert_eq!(window.session().config.w_em, 2.5);
    let branches: Vec<_> = window.fit().history.branches().iter().map(|b| (b.id, b.parent, b.head())).collect();
    assert_eq!(branches, [(0, None, 20), (1, Some((0, 10)), 10)]);
    window.key(Key::Enter);
    window.paused_at(20);
    let row =
        |branch: u32| window.fit().history.branch(branch).unwrap().row(20).unwrap().report.terms.get("em").unwrap();
    assert_ne!(row(0), row(1));
    window.click("Discard run");
    window.until("branch 0", |w| w.fit().history.active_id() == 0);
    window.paused_at(20);
    assert_eq!((window.fit().history.branches().len(), window.session().config.w_em), (1, 0.5));
    window.click("Discard run");
    window.paused_at(0);
}

#[test]
fn branches_are_chosen_by_name() {
    let mut window = Window::fitted(1);
    window.switch_live_off();
    window.key_with(Modifiers::SHIFT, Key::Comma);
    window.type_value("w_EM value", "2");
    window.paused_at(10);
    window.click("Branch");
    window.click("branch 0: 0 → 20");
    window.paused_at(20);
    assert_eq!((window.fit().history.active_id(), window.session().config.w_em), (0, 0.5));
}

#[test]
fn frames_change_at_any_time_and_fits_are_found_again() {
    let mut window = Window::open(12);
    window.run_forever();
    window.key(Key::ArrowRight);
    window.ready(1);
    assert_eq!((window.fit().head(), window.fit().status.clone()), (0, FitStatus::Paused));
    window.key(Key::ArrowLeft);
    window.ready(0);
    assert!(window.fit().head() > 3 && !window.fit().is_running(), "the fit that was left");
    window.key(Key::End);
    window.ready(11);
    window.click("Previous frame");
    window.ready(10);
    window.key_with(Modifiers::SHIFT, Key::ArrowLeft);
    window.ready(0);
    window.key_with(Modifiers::COMMAND, Key::J);
    assert!(window.named("Frame number"));
    window.key_with(Modifiers::COMMAND, Key::A);
    window.type_text("7");
    window.key(Key::Enter);
    window.ready(7);
    assert!(!window.named("Frame number"));
    window.drag("Timeline", 0.1, 0.3);
    window.ready(3);
    window.click("Frame frames/005");
    window.ready(5);
    window.key(Key::Home);
    window.ready(0);
    window.key(Key::Space);
    window.until("the end of the film", |w| w.session().data.frame_index == 11 && !w.session().data.playing);
}

#[test]
fn reset_forgets_and_warm_start_carries_over() {
    let mut window = Window::fitted(2);
    window.key_with(Modifiers::COMMAND, Key::K);
    window.type_text("warm");
    window.key(Key::Enter);
    assert!(window.session().warm_start);
    let state = Arc::clone(window.fit().branch().unwrap().rows[20].state.as_ref().unwrap());
    window.key(Key::ArrowRight);
    window.ready(1);
    // Moved as the two frames' maps tell: the whole body, on the floor, by less than a fast step.
    let initial = window.fit().initial.clone().unwrap();
    let moved = |joint: usize| sub(initial.position(joint), state.params.position(joint));
    let (first, length) = (moved(0), norm(moved(0)));
    assert!(first[2] == 0.0 && length < 0.4, "{first:?}");
    for joint in 1..state.params.shape().joints {
        assert!(norm(sub(moved(joint), first)) < 1e-12);
    }
    assert_eq!(initial.group(Group::LogScale), state.params.group(Group::LogScale));
    window.click("Reset fit");
    window.until("the new start pose", |w| w.fit().is_ready() && w.fit().shown.is_some());
    assert_ne!(window.fit().initial.as_ref(), Some(&state.params), "its own start pose");
    window.key(Key::ArrowLeft);
    window.ready(0);
    assert_eq!(window.fit().head(), 20);
}

#[test]
fn keys_toggle_what_is_compared_and_the_theme() {
    let mut window = Window::open(1);
    let compare = |w: &Window| w.session().view.compare;
    assert!(!window.named("Wipe position"));
    window.key(Key::W);
    assert_eq!(compare(&window), Compare::Wipe);
    window.key(Key::D);
    assert_eq!(compare(&window), Compare::Difference);
    assert!(window.named("H_sim − H_ori map of hori"));
    window.key(Key::D);
    assert_eq!(compare(&window), Compare::Flip);
    window.click("Wipe");
    assert_eq!(compare(&window), Compare::Wipe);
    window.key_with(Modifiers::COMMAND, Key::T);
    assert_eq!(window.session().view.theme, ThemeChoice::Light);
    window.key_with(Modifiers::COMMAND, Key::T);
    assert_eq!(window.session().view.theme, ThemeChoice::Dark);
    // While text is typed its letters are text.
    window.click("Filter frames");
    window.key(Key::D);
    window.type_text("d");
    assert_eq!(compare(&window), Compare::Wipe);
    assert!(window.says("No frame matches"));
}

#[test]
fn the_palette_finds_and_does_a_command() {
    let mut window = Window::open(1);
    window.key_with(Modifiers::COMMAND, Key::K);
    assert!(window.named("Command palette"));
    window.type_text("wipe");
    window.key(Key::Enter);
    assert_eq!(window.session().view.compare, Compare::Wipe);
    assert!(!window.named("Command palette"));
    window.key_with(Modifiers::COMMAND, Key::K);
    window.type_text("no such command");
    assert!(window.says("No command has these words."));
    window.key(Key::Escape);
    assert!(!window.named("Command palette"));
    window.key(Key::Questionmark);
    assert!(window.says("Keys and gestures"));
    window.key(Key::Escape);
    assert!(!window.says("Keys and gestures"));
}

#[test]
fn one_row_of_the_palette_is_lit_and_enter_takes_it() {
    let mut window = Window::open(1);
    window.key_with(Modifiers::COMMAND, Key::K);
    let rows = |w: &Window| -> Vec<(String, bool, egui::Rect)> {
        let field = w.node("Command palette").rect();
        let rows = w.harness.root().children_recursive().filter(|node| {
            // Tabs behind the sheet are buttons of the same height.
            let under = || (node.rect().left() - field.left()).abs() < 5.0 && node.rect().width() > 400.0;
            node.accesskit_node().role() == egui::Role::Button && under()
        });
        let toggled = |node: &egui_kittest::Node<'_>| node.accesskit_node().toggled() == Some(Toggled::True);
        rows.filter_map(|node| Some((node.accesskit_node().label()?, toggled(&node), node.rect()))).collect()
    };
    let lit =
        |w: &Window| -> Vec<String> { rows(w).into_iter().filter(|(_, lit, _)| *lit).map(|(name, ..)| name).collect() };
    window.harness.step();
    let top = window.node("Command palette").rect().bottom();
    let seen = rows(&window).iter().filter(|(_, _, rect)| rect.top() > top && rect.bottom() < 860.0).count();
    assert!(seen >= 12, "{seen} rows");
    assert_eq!(lit(&window), ["Open folder…"]);
    window.type_text("frames");
    let found: Vec<String> = rows(&window).into_iter().map(|(name, ..)| name).collect();
    assert_eq!(lit(&window), found[..1], "the best");
    for _ in 0..3 {
        window.key(Key::ArrowDown);
    }
    window.key(Key::ArrowUp);
    assert_eq!(lit(&window), found[2..3]);
    window.key(Key::PageUp);
    window.key(Key::ArrowUp);
    assert_eq!(lit(&window), found[..1], "never none");
    window.key_with(Modifiers::COMMAND, Key::A);
    window.type_text("wipe");
    assert_eq!(lit(&window), ["Wipe H_ori | H_sim"]);
    window.key(Key::ArrowDown);
    window.key(Key::ArrowUp);
    window.key(Key::Enter);
    assert_eq!(window.session().view.compare, Compare::Wipe);
}

/// Names of pictures of single curves, and what is behind the axes.
#[test]
fn curves_have_a_log_axis_of_iterations_smoothing_and_a_wheel() {
    use mhp_inspector::session::Smoothing;
    let mut window = Window::fitted(1);
    let view = |w: &Window| (w.session().view.log_iterations, w.session().view.smoothing);
    assert_eq!(view(&window), (false, Smoothing::Off));
    window.click("Loss");
    assert_eq!(window.session().view.curves, mhp_inspector::session::CurvesShown::Loss);
    window.click("Each");
    window.click("log x");
    window.click("Smoothing");
    window.click("smooth 0.95");
    assert_eq!(view(&window), (true, Smoothing::Strong));
    // On a log axis the middle of the picture is an early iteration: log₁₀(21) / 2 is 3.6 of 20.
    let middle = window.node("Curve of L").rect().center();
    window.harness.hover_at(middle);
    window.harness.drag_at(middle);
    window.harness.drop_at(middle);
    window.harness.step();
    window.until("an early iteration", |w| w.fit().shown_iteration() == 4);
    // Zoomed in at the right edge, the left edge is a late iteration.
    window.harness.run_steps(60);
    let rect = window.node("Curve of L").rect();
    let turn = |w: &mut Window, at: egui::Pos2| {
        w.harness.hover_at(at);
        let delta = egui::vec2(0.0, 400.0);
        let (unit, phase, modifiers) = (egui::MouseWheelUnit::Point, egui::TouchPhase::Move, Modifiers::NONE);
        let source = egui::MouseWheelSource::Unknown;
        w.harness.event(egui::Event::MouseWheel { unit, delta, phase, modifiers, source });
        w.harness.run_steps(40);
    };
    turn(&mut window, rect.right_center() - egui::vec2(3.0, 0.0));
    let left = rect.left_center() + egui::vec2(3.0, 0.0);
    let click = |w: &mut Window| {
        w.harness.hover_at(left);
        w.harness.drag_at(left);
        w.harness.drop_at(left);
        w.harness.step();
    };
    click(&mut window);
    window.until("a late iteration", |w| w.fit().shown_iteration() > 8);
    let shown = window.fit().shown_iteration();
    // A double click shows all, and the iteration stays.
    window.harness.run_steps(60);
    click(&mut window);
    click(&mut window);
    window.until("the same iteration", |w| w.fit().shown_iteration() == shown);
    // Also where both clicks come in one pass, in each way of drawing.
    let pane = Pane::called("Curves").unwrap();
    for way in ["Each", "Loss"] {
        window.click(way);
        window.harness.run_steps(60);
        let pos = match way {
            "Each" => window.node("Curve of L").rect().center(),
            _ => window.harness.state().pane_rect(pane).unwrap().center(),
        } + egui::vec2(40.0, 0.0);
        let input = window.harness.input_mut();
        input.events.push(egui::Event::PointerMoved(pos));
        for pressed in [true, false, true, false] {
            let (button, modifiers) = (egui::PointerButton::Primary, Modifiers::NONE);
            input.events.push(egui::Event::PointerButton { pos, button, pressed, modifiers });
        }
        window.harness.run_steps(4);
        assert_eq!(window.fit().shown_iteration(), shown, "{way}");
    }
    window.click("Each");
    window.harness.run_steps(60);
    click(&mut window);
    window.until("the start", |w| w.fit().shown_iteration() == 0);
}

/// What the window asks of the desktop about being closed.
fn closing(window: &Window) -> (bool, bool) {
    let output = &window.harness.output().viewport_output[&egui::ViewportId::ROOT];
    let has = |command| output.commands.contains(&command);
    (has(egui::ViewportCommand::Close), has(egui::ViewportCommand::CancelClose))
}

fn press_the_close_button(window: &mut Window) {
    let root = window.harness.input_mut().viewports.entry(egui::ViewportId::ROOT).or_default();
    root.events.push(egui::ViewportEvent::Close);
    window.harness.step();
}

#[test]
fn leaving_asks_while_something_would_be_cut_off() {
    let mut window = Window::open(2);
    press_the_close_button(&mut window);
    assert!(!window.says("Quit now?") && !closing(&window).1, "nothing is under way");
    window.run_forever();
    press_the_close_button(&mut window);
    assert!(closing(&window).1, "the desktop is told to wait");
    window.harness.step();
    assert!(window.says("The fit of frames/000 runs") && window.says("Labels and the fits of batches are on disk"));
    press_the_close_button(&mut window);
    assert!(closing(&window).1, "asked again, it still waits");
    window.key(Key::Escape);
    window.harness.step();
    assert!(!window.says("Quit now?") && window.fit().is_running());
    window.key_with(Modifiers::COMMAND, Key::Q);
    window.harness.step();
    assert!(window.says("Quit now?") && !closing(&window).0);
    window.key(Key::Enter);
    window.harness.step();
    assert!(!window.says("Quit now?") && window.fit().is_running(), "Enter stays");
    window.choose("File", "Quit");
    window.node("Stop and quit").click();
    window.harness.step();
    assert!(closing(&window).0);
    press_the_close_button(&mut window);
    assert!(!closing(&window).1, "it was said once");
}

#[test]
fn a_folder_dropped_on_the_window_opens() {
    let other = tempfile::tempdir().unwrap();
    blob::write_dataset(other.path(), 5);
    let mut window = Window::open(2);
    window.run_forever();
    window.drop_file(other.path());
    window.until("the other data set", |w| w.session().data.len() == 5);
    window.ready(0);
    assert_eq!(window.fit().head(), 0);
    let recent = &window.session().data.recent;
    assert_eq!(recent[..], [other.path().to_path_buf(), window.folder.path().to_path_buf()]);
    // The same folder again is opened again.
    window.key(Key::ArrowRight);
    window.ready(1);
    window.drop_file(other.path());
    window.until("the first frame", |w| w.session().data.frame_index == 0);
    window.ready(0);
}

#[test]
fn a_text_called_npz_is_told_and_the_window_lives_on() {
    let mut window = Window::fitted(2);
    let bad = window.folder.path().join("notes.npz");
    std::fs::write(&bad, "these are my notes\n").unwrap();
    window.drop_file(&bad);
    window.until("the notification", |w| w.named("Dismiss notification"));
    assert!(window.says("notes.npz"));
    assert_eq!((window.session().data.len(), window.fit().head()), (2, 20));
    window.click("Dismiss notification");
    assert!(!window.named("Dismiss notification"));
    window.key(Key::Period);
    window.paused_at(21);
}

#[test]
fn a_frame_deleted_while_open_is_told_and_the_others_are_fine() {
    let mut window = Window::open(9);
    std::fs::remove_file(window.folder.path().join("frames/008.npz")).unwrap();
    window.key(Key::End);
    window.until("the error", |w| w.session().data.error.is_some() && w.named("Dismiss notification"));
    assert!(window.says("008.npz"));
    assert!(window.says("This frame cannot be shown"));
    window.key(Key::Home);
    window.ready(0);
}

#[test]
fn a_map_without_numbers_is_told_and_the_others_are_fine() {
    use mhp_inspector::dataset::npz::{ArrayView, write};
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 2);
    let nan = vec![f64::NAN; 48 * 32];
    let maps = [("hori", ArrayView::f64(&[48, 32], &nan)), ("vert", ArrayView::f64(&[48, 32], &nan))];
    write(&folder.path().join("frames/001.npz"), &maps).unwrap();
    let harness = Window::empty(&[folder.path().into()], [1440.0, 900.0]);
    let mut window = Window { harness, folder };
    window.ready(0);
    window.key(Key::ArrowRight);
    window.until("the error", |w| matches!(w.fit().status, FitStatus::Failed(_)) && w.named("Dismiss notification"));
    assert!(window.says("`hori` has no finite cell"));
    window.harness.run_steps(3);
    window.key(Key::ArrowLeft);
    window.ready(0);
}

#[test]
fn closing_during_a_run_takes_no_time() {
    let mut window = Window::open(1);
    window.run_forever();
    let begun = Instant::now();
    drop(window);
    assert!(begun.elapsed() < Duration::from_secs(2), "{:?}", begun.elapsed());
}

#[test]
fn a_window_without_data_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = folder.path().join("nothing here");
    let harness = Window::empty(&[nowhere], [1440.0, 900.0]);
    let mut window = Window { harness, folder };
    window.until("the error", |w| w.named("Dismiss notification"));
    assert!(window.says("no such file or folder"));
    assert!(window.says("No data set"));
    for key in [Key::Enter, Key::Period, Key::Comma, Key::ArrowRight, Key::Space, Key::F, Key::R, Key::End] {
        window.key(key);
    }
    assert_eq!(window.harness.unnamed_widgets(), Vec::<String>::new());
}

#[test]
fn everything_that_can_be_used_has_a_name() {
    let mut window = Window::fitted(2);
    window.switch_live_off();
    window.key(Key::W);
    window.key_with(Modifiers::SHIFT, Key::Comma);
    window.type_value("w_EM value", "2");
    window.paused_at(10);
    let mut unnamed = Vec::new();
    let mut look = |window: &mut Window, place: &str| {
        window.harness.run_steps(2);
        let found = window.harness.unnamed_widgets();
        unnamed.extend(found.into_iter().map(|what| format!("{place}: {what}")));
    };
    look(&mut window, "the panes");
    window.key(Key::P);
    for tab in [
        "Log",
        "Compare",
        "Agreement",
        "Statistics",
        "Curves",
        "Image plane",
        "3-D",
        "IoU and error",
        "Kinematic limits",
    ] {
        window.click(tab);
        look(&mut window, tab);
    }
    for menu in ["File", "Edit", "Frame", "Fit", "Labels", "View", "Help"] {
        window.open_menu(menu);
        look(&mut window, menu);
        window.key(Key::Escape);
    }
    for (sheet, modifiers, key) in [
        ("palette", Modifiers::COMMAND, Key::K),
        ("help", Modifiers::NONE, Key::F1),
        ("go to", Modifiers::COMMAND, Key::J),
        ("path", Modifiers::COMMAND, Key::L),
    ] {
        window.key_with(modifiers, key);
        look(&mut window, sheet);
        window.key(Key::Escape);
    }
    // A joint, and the question about a bare file.
    let bare = window.folder.path().join("bare.npy");
    let map = vec![1.0; 64 * 32];
    let array = mhp_inspector::dataset::npz::ArrayView::f64(&[64, 32], &map);
    mhp_inspector::dataset::npz::write_npy(&bare, &array).unwrap();
    window.drop_file(&bare);
    window.until("the question", |w| w.says("What do these maps measure?"));
    look(&mut window, "the question");
    window.key(Key::Escape);
    let capture = window.folder.path().join("adc_data.bin");
    std::fs::write(&capture, [0; 64]).unwrap();
    window.drop_file(&capture);
    window.until("the form", |w| w.says("How was this recorded?"));
    look(&mut window, "the form");
    assert_eq!(unnamed, Vec::<String>::new());
}

#[test]
fn a_window_in_which_nothing_happens_is_not_drawn_again() {
    let mut window = Window::fitted(2);
    window.harness.remove_cursor();
    window.harness.run_steps(5);
    let delay = |w: &Window| w.harness.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
    window.until("rest", |w| delay(w) > Duration::from_mins(1));
    for _ in 0..5 {
        window.harness.step();
        assert!(delay(&window) > Duration::from_mins(1), "{:?}", window.harness.ctx.repaint_causes());
    }
}

/// True where pictures are drawn by Mesa's software renderer, whose pixels the committed pictures are.
fn software_renderer(harness_adapter: Option<&str>) -> bool {
    let name = harness_adapter.unwrap_or("no adapter");
    let known = ["llvmpipe", "lavapipe"].iter().any(|part| name.to_lowercase().contains(part));
    if !known {
        println!("skipped: the pictures were drawn by llvmpipe, this is {name}");
    }
    known
}

fn picture(theme: ThemeChoice, name: &str) {
    use eframe::wgpu::{Backends, Instance, InstanceDescriptor};
    let mut wanted = InstanceDescriptor::new_without_display_handle();
    wanted.backends = Backends::VULKAN;
    let adapters = pollster::block_on(Instance::new(wanted).enumerate_adapters(Backends::VULKAN));
    let adapter = adapters.first().map(|adapter| adapter.get_info().name);
    if !software_renderer(adapter.as_deref()) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("blob");
    blob::write_dataset(&data, 4);
    let paths = [data];
    let harness = Harness::builder()
        .with_size([1000.0, 640.0])
        .with_step_dt(1.0 / 60.0)
        .with_max_steps(200)
        .wgpu()
        .build_eframe(|cc| InspectorApp::new(cc, &paths));
    let mut window = Window { harness, folder };
    window.apply(Command::SetAnnotator("ada".into()));
    window.ready(0);
    if theme == ThemeChoice::Light {
        window.key_with(Modifiers::COMMAND, Key::T);
    }
    window.key_with(Modifiers::SHIFT, Key::Period);
    window.paused_at(10);
    assert_eq!(window.session().view.theme, theme);
    window.at_rest();
    window.harness.remove_cursor();
    window.harness.run_steps(20);
    // Times differ from run to run, and what is beside them on the bar moves with their width.
    window.harness.mask(egui::Rect::from_min_max(pos2(90.0, 0.0), pos2(1000.0, 27.0)));
    window.harness.snapshot(name);
}

#[test]
fn the_default_layout_in_the_dark() {
    picture(ThemeChoice::Dark, "default_dark");
}

#[test]
fn the_default_layout_in_the_light() {
    picture(ThemeChoice::Light, "default_light");
}

/// As in a container: nothing says where a Wayland server is, and nobody asked for one.
#[test]
#[cfg(unix)]
fn a_picture_without_a_session_is_drawn_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 1);
    let home = tempfile::tempdir().unwrap();
    let picture = home.path().join("window.png");
    let drawn = std::process::Command::new(env!("CARGO_BIN_EXE_mhp-inspector"))
        .args(["screenshot", folder.path().to_str().unwrap(), "--iterations", "2", "--size", "640x400"])
        .args(["--preset", "baseline", "--people", "2"])
        .args(["--out", picture.to_str().unwrap()])
        .env("MHP_INSPECTOR_HOME", home.path().join("home"))
        .env_remove("XDG_RUNTIME_DIR")
        .env_remove("NODEVICE_SELECT")
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&drawn.stderr);
    assert!(drawn.status.success() && picture.exists(), "{told}");
    assert_eq!(told, "");
    let wrong = std::process::Command::new(env!("CARGO_BIN_EXE_mhp-inspector"))
        .args(["screenshot", folder.path().to_str().unwrap(), "--preset", "bold"])
        .args(["--out", picture.to_str().unwrap()])
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&wrong.stderr);
    assert!(wrong.status.code() == Some(2) && told.contains("bold") && told.contains("recommended"), "{told}");
}

/// The body follows the finger; when it is lifted one branch, one line and one act are left.
#[test]
fn a_dragged_weight_fits_anew_under_the_finger() {
    let mut window = Window::fitted(1);
    if !window.session().is_live() {
        // The machine is busy; a finger can be followed all the same.
        window.key_with(Modifiers::SHIFT, Key::L);
    }
    let before = window.fit().shown.clone().unwrap();
    window.reveal("w_EM");
    let rect = window.node("w_EM").rect();
    let at = |share: f32| egui::pos2(rect.left() + share * rect.width(), rect.center().y);
    window.harness.hover_at(at(0.3));
    window.harness.run_steps(60);
    let told = "Weight of the electromagnetic term";
    assert!(window.says(told), "what the slider is, where the pointer rests");
    window.harness.drag_at(at(0.3));
    let mut shown = std::collections::BTreeSet::new();
    for k in 1..=12 {
        window.harness.hover_at(at(0.3 + 0.05 * k as f32));
        window.until("a fit with the value under the finger", |w| {
            w.fit().shown.as_ref().is_some_and(|shown| shown.config == w.session().config && shown.iteration == 20)
        });
        shown.insert(window.fit().shown.as_ref().unwrap().config.w_em.to_bits());
        assert!(window.session().is_dragging());
        assert!(!window.says(told), "nothing lies over what the finger moves");
        assert_eq!(window.fit().history.branches().len(), 2, "one branch, written anew");
        let curves: Vec<String> = window.names().into_iter().filter(|name| name.starts_with("Curve of ")).collect();
        let rows = window.fit().branch().unwrap().rows.len();
        assert!(
            curves.len() > 3,
            "its curves are on screen: {curves:?} of {rows} rows, {}",
            window.fit().history.active_id()
        );
    }
    window.harness.drop_at(at(0.9));
    window.until("the lifted finger", |w| !w.session().is_dragging());
    assert!(shown.len() >= 6, "{shown:?}");
    assert_ne!(window.fit().shown.as_ref().unwrap().params, before.params);
    let told = window.session().log.iter().filter(|line| line.text.contains("w_EM 0.5 → ")).count();
    assert_eq!(told, 1, "{:?}", window.session().log);
    window.key_with(Modifiers::COMMAND, Key::Z);
    window.paused_at(20);
    assert_eq!((window.session().config.w_em, window.fit().history.active_id()), (0.5, 0));
}

#[test]
fn settings_are_found_by_what_is_said_of_them() {
    let mut window = Window::open(1);
    window.click("Search the settings");
    window.type_text("adam step size");
    window.harness.run_steps(2);
    assert!(window.named("Learning rate value") && !window.named("d_sep value"));
    // Those that stand above are found too.
    for (words, name) in [("kinematic weight", "w_kine value"), ("people", "People value")] {
        let times = |w: &Window| w.harness.query_all_by_label(name).count();
        let before = times(&window);
        window.key_with(Modifiers::COMMAND, Key::A);
        window.type_text(words);
        window.harness.run_steps(2);
        assert_eq!(times(&window), before + 1, "{words}");
    }
    window.type_text(" no such thing");
    window.harness.run_steps(2);
    assert!(window.says("No setting is called that"));
}

/// The maps are what one looks at: most of the middle, and nearly half of a small window.
#[test]
fn the_maps_take_nearly_half_of_the_window() {
    let maps = Pane::called("Maps").unwrap();
    for (size, least) in [([1280.0, 800.0], 0.45), ([1440.0, 900.0], 0.45), ([1024.0, 640.0], 0.35)] {
        let folder = tempfile::tempdir().unwrap();
        blob::write_dataset(folder.path(), 1);
        let harness = Window::empty(&[folder.path().into()], size);
        let mut window = Window { harness, folder };
        window.ready(0);
        let rect = window.harness.state().pane_rect(maps).unwrap();
        let share = rect.area() / (size[0] * size[1]);
        assert!(share >= least, "{share:.3} of {size:?}");
    }
}

/// The person is in the middle of the maps and stays there; the whole map, one map alone, and back.
#[test]
fn maps_show_the_person_all_or_one_alone() {
    let mut window = Window::open(3);
    let overview = "Overview of hori";
    assert!(window.named(overview), "the person fills the map");
    window.key(Key::ArrowRight);
    window.ready(1);
    assert!(window.named(overview));
    window.key(Key::F);
    assert!(!window.named(overview), "the whole map");
    window.key(Key::ArrowRight);
    window.ready(2);
    assert!(!window.named(overview), "stays the whole map");
    window.key(Key::F);
    assert!(window.named(overview));

    let before = window.node("H_sim map of vert").rect();
    window.harness.hover_at(before.center());
    window.harness.run_steps(2);
    assert!(
        window.text_of("Cell under the pointer").contains("H_sim "),
        "{}",
        window.text_of("Cell under the pointer")
    );
    window.key(Key::Z);
    window.harness.run_steps(2);
    let alone = window.node("H_sim map of vert").rect();
    assert!(alone.area() > 4.0 * before.area() && !window.named("H_ori map of vert"), "{before} {alone}");
    window.key(Key::Escape);
    window.harness.run_steps(2);
    assert_eq!(window.node("H_sim map of vert").rect(), before);
    // The same by a double click, there and back.
    let double = |w: &mut Window| {
        let at = w.node("H_sim map of vert").rect().center();
        w.harness.run_steps(60);
        for _ in 0..2 {
            w.harness.hover_at(at);
            w.harness.drag_at(at);
            w.harness.drop_at(at);
            w.harness.step();
        }
        w.harness.run_steps(3);
        w.node("H_sim map of vert").rect()
    };
    assert!(double(&mut window).area() > 4.0 * before.area() && !window.named("H_ori map of vert"));
    assert_eq!(double(&mut window), before);
}

/// What is seen of a map follows the frame in its overview: another cell is under the same place.
#[test]
fn an_overview_is_dragged() {
    let mut window = Window::open(1);
    let cell = |w: &mut Window| {
        let at = w.node("H_ori map of hori").rect().center();
        w.harness.hover_at(at);
        w.harness.run_steps(2);
        w.text_of("Cell under the pointer")
    };
    let before = cell(&mut window);
    assert!(before.contains("H_ori"), "{before}");
    let overview = window.node("Overview of hori").rect();
    window.pull(overview.center(), egui::vec2(0.0, -0.3 * overview.height()));
    let after = cell(&mut window);
    assert!(after.contains("H_ori") && after != before, "{before} {after}");
}

/// A run is seen again at the chosen speed: the iteration on screen and what the curves say of it go on by themselves.
#[test]
fn a_run_is_replayed_as_slowly_as_chosen() {
    let mut window = Window::fitted(1);
    let last = window.fit().shown_iteration();
    window.click("Speed of a run");
    window.click("10/s");
    window.click("Replay");
    window.until("the begin of the run", |w| w.fit().shown_iteration() < last);
    let (first, told) = (window.fit().shown_iteration(), window.text_of("Curve of L"));
    window.until("a later iteration", |w| w.fit().shown_iteration() > first && w.text_of("Curve of L") != told);
    window.click("Stop replay");
    let stopped = window.fit().shown_iteration();
    window.harness.run_steps(40);
    assert_eq!((window.fit().shown_iteration(), window.fit().replay), (stopped, None));
}

/// A batch waits, goes on and is cancelled by its own buttons, and what it had stays in list and strip.
#[test]
fn a_batch_is_held_by_its_buttons() {
    let mut window = Window::open(60);
    // Long enough for a hand, on a busy machine too.
    window.apply(Command::SetConfig(Box::new(FitConfig { iterations: 3000, ..window.session().config })));
    window.at_rest();
    window.click("Fit listed");
    window.until("how long it takes", |w| w.says(" of 60 · ") && w.says(" left"));
    window.until("some fits", |w| w.session().batch.fitted() > 2);
    window.click("Pause the batch");
    window.until("the pause", |w| w.named("Go on with the batch"));
    assert!(window.says("paused at "));
    window.click("Go on with the batch");
    window.until("the batch again", |w| w.named("Pause the batch"));
    window.click("Cancel the batch");
    window.until("its end", |w| !w.session().batch.is_running());
    let (fitted, all) = (window.session().batch.fitted(), window.session().queue.rows().len());
    assert!(fitted > 2 && fitted < all, "{fitted} of {all}");
    let kept = window.session().summaries.values().filter(|summary| summary.iou.is_some()).count();
    assert_eq!(kept, fitted);
}

/// All that is listed, by one key, with its progress; the results are in the list.
#[test]
fn listed_frames_are_fitted_by_one_key() {
    let mut window = Window::open(6);
    window.at_rest();
    let listed = window.session().queue.rows().len();
    assert_eq!(listed, 6);
    window.key_with(Modifiers::COMMAND, Key::Enter);
    window.until("the batch", |w| !w.session().batch.is_running() && w.session().batch.fitted() == listed);
    assert!(window.session().log.iter().any(|line| line.text.contains("frames fitted")));
    assert!(window.session().summaries.values().filter(|summary| summary.iou.is_some()).count() >= listed - 1);
    window.click("Fit listed");
    window.until("the kept ones", |w| !w.session().batch.is_running());
    // The statistics say what they come to.
    let ious: Vec<f64> = (0..listed).filter_map(|frame| window.session().frame_row(frame).iou).collect();
    window.click("Statistics");
    window.harness.run_steps(3);
    let mean = format!("{:.3}", ious.iter().sum::<f64>() / ious.len() as f64);
    assert!(window.named("fitted") && window.named(&mean), "{mean} in {:?}", window.names());
    window.click("By scene");
    window.harness.run_steps(2);
    assert!(window.named(&mean));
    // Results of other settings are told as such.
    let stale = format!("results of {listed} frames are stale: ");
    assert!(!window.says(&stale));
    window.type_value("w_EM value", "3.5");
    window.harness.run_steps(2);
    assert!(window.says(&format!("{stale}with w_EM 0.5 → 3.5")) || window.says(&format!("{stale}with w_EM 3.5 → 0.5")));
}

/// Each curve has a picture of its own; a click shows the iteration under it, and the head is followed again from its end.
#[test]
fn every_curve_has_its_own_picture_and_leads_to_an_iteration() {
    let start = Window::open(1);
    assert!(start.named("Curve of L") && start.text_of("Curve of L") != "–", "its value, before the first step");
    let mut window = Window::fitted(1);
    for name in ["Curve of L", "Curve of L_EM", "Curve of IoU hori", "Curve of MAJPE / m"] {
        assert!(window.named(name), "{name}: {:?}", window.names());
    }
    let rect = window.node("Curve of L_EM").rect();
    window.harness.hover_at(rect.center());
    window.harness.drag_at(rect.center());
    window.harness.drop_at(rect.center());
    window.until("the middle of the run", |w| w.fit().cursor.is_some_and(|cursor| (9..=11).contains(&cursor)));
    let shown = window.fit().shown_row().unwrap().report.loss;
    let told = window.text_of("Curve of L");
    assert!((told.parse::<f64>().unwrap() - shown).abs() < 1e-3 * shown, "{told} for {shown}");
    // A term that is 0 throughout has none.
    assert!(!window.named("Curve of L_sep"));
}

/// A map with three axes shows two of them, and says what it makes of the third.
#[test]
fn a_cube_is_seen_along_another_axis() {
    let sample = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/hupr");
    let harness = Window::empty(&[sample], [1440.0, 900.0]);
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    let told = |window: &mut Window| {
        let map = window.node("H_ori map of hori").rect();
        window.harness.hover_at(map.center());
        window.harness.run_steps(3);
        window.text_of("Cell under the pointer")
    };
    let first = told(&mut window);
    assert!(first.contains("radial velocity") && first.contains("largest over cone angle"), "{first}");
    window.click("Axes of the maps");
    window.click("range × cone angle");
    window.click("one bin");
    window.key(Key::Escape);
    window.harness.run_steps(2);
    let second = told(&mut window);
    assert!(second.contains("cone angle") && !second.contains("largest over"), "{second}");
    assert_ne!(first.lines().last(), second.lines().last());
}

/// A row of words that has no room goes on in the next line, and does not push the pane's edge out of sight.
#[test]
fn what_is_said_of_a_fit_stays_in_its_pane() {
    let sample = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/xrf55");
    let begin = Begin { paths: vec![sample], config: Some(Preset::Recommended.config()), ..Begin::default() };
    let harness = Harness::builder()
        .with_size([1280.0, 800.0])
        .with_max_steps(200)
        .build_eframe(|cc| InspectorApp::begin(cc, &begin));
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    window.apply(Command::StepFit(30));
    window.paused_at(30);
    window.harness.run_steps(3);
    assert!(window.says("not explained"), "{:#?}", window.names());
    let pane = window.harness.state().pane_rect(Pane::called("Fit").unwrap()).unwrap();
    for name in ["not explained", "Convergence criterion holds", "Branch", "People value"] {
        let rect = window.harness.get_by_label(name).rect();
        assert!(rect.right() <= pane.right(), "{name}: {rect:?} in {pane:?}");
    }
}

/// What is said of a fit takes the same room whatever is said: the sliders below it stay under the finger. Settings that only
/// a start reads offer a new one there.
#[test]
fn nothing_moves_when_a_run_begins_or_ends_or_needs_a_new_start() {
    let mut window = Window::open(1);
    let place = |w: &Window| w.node("w_EM").rect();
    window.apply(Command::SetConfig(Box::new(FitConfig { iterations: 100_000, ..window.session().config })));
    window.harness.run_steps(3);
    let at = place(&window);
    window.key(Key::Enter);
    window.until("some iterations", |w| w.fit().is_running() && w.fit().head() > 0);
    let at_run = place(&window);
    window.key(Key::Enter);
    window.until("the pause", |w| w.fit().status == FitStatus::Paused);
    window.harness.run_steps(3);
    assert_eq!((at_run, place(&window)), (at, at));
    assert!(window.named("paused") && !window.named("↺ new start needed"));
    window.switch_live_off();
    window.type_value("People value", "2");
    window.harness.run_steps(3);
    assert_eq!(place(&window), at);
    assert!(window.says(", modified: "), "{:?}", window.names());
    window.click("↺ new start needed");
    window.until("two people", |w| w.fit().is_ready() && w.fit().head() == 0);
    assert_eq!(window.fit().initial.as_ref().unwrap().shape().persons, 2);
    assert!(!window.named("↺ new start needed"));
}

/// In a small window panes become words at its edge: what is left of the maps first, then what is right of them, then what is
/// below; a click on a word shows its pane, and with room they are back.
#[test]
fn panes_give_way_in_a_stated_order_and_come_back() {
    let mut window = Window::open(2);
    let strip = |w: &Window| {
        let all = ["Frames", "Failure modes", "Fit", "Joint", "3-D", "Image plane", "Curves"];
        all.into_iter().filter(|pane| w.named(&format!("{pane} on the strip"))).collect::<Vec<_>>()
    };
    let resize = |w: &mut Window, width, height| {
        w.harness.set_size(egui::vec2(width, height));
        w.harness.run_steps(3);
    };
    for (width, height, wanted) in [
        (1280.0, 800.0, &[][..]),
        (1024.0, 640.0, &[]),
        (853.0, 533.0, &["Frames", "Failure modes"]),
        (640.0, 540.0, &["Frames", "Failure modes", "Fit", "Joint", "3-D", "Image plane"]),
        (512.0, 320.0, &["Frames", "Failure modes", "Fit", "Joint", "3-D", "Image plane", "Curves"]),
    ] {
        resize(&mut window, width, height);
        assert_eq!(strip(&window), wanted, "{width} x {height}");
        assert!(window.named("H_ori map of hori"), "the maps are always there");
    }
    // A word shows its pane beside the maps, another one in its place, and the same again takes it away.
    assert!(!window.named("Filter frames") && !window.named("Run fit"));
    window.click("Frames on the strip");
    window.harness.run_steps(3);
    assert!(window.named("Filter frames") && window.named("H_ori map of hori") && !window.named("Run fit"));
    window.click("Fit on the strip");
    window.harness.run_steps(3);
    assert!(window.named("Run fit") && !window.named("Filter frames"));
    window.click("Joint on the strip");
    window.harness.run_steps(3);
    assert!(!window.named("Run fit") && window.harness.state().pane_rect(Pane::called("Joint").unwrap()).is_some());
    window.click("Joint on the strip");
    window.harness.run_steps(3);
    assert!(window.harness.state().pane_rect(Pane::called("Joint").unwrap()).is_none());
    // A key that brings a pane to the front does so here too.
    window.harness.state_mut().show_pane(Pane::called("Curves").unwrap());
    window.harness.run_steps(3);
    assert!(window.harness.state().pane_rect(Pane::called("Curves").unwrap()).is_some());
    resize(&mut window, 1280.0, 800.0);
    assert_eq!(strip(&window), [""; 0]);
    assert!(
        window.named("Filter frames") && window.harness.state().pane_rect(Pane::called("Joint").unwrap()).is_some()
    );
}

/// What a toolbar switches the palette switches too.
#[test]
fn the_palette_switches_how_maps_and_curves_are_drawn() {
    let mut window = Window::open(1);
    let mut choose = |words: &str| {
        window.key_with(Modifiers::COMMAND, Key::K);
        window.harness.run_steps(2);
        window.type_text(words);
        window.key(Key::Enter);
        window.harness.run_steps(2);
        window.session().view.clone()
    };
    let plain = choose("normal size");
    assert!(choose("bird's-eye").cube.birds_eye && choose("polar").cube.polar);
    assert!(choose("cells round").neighbours != plain.neighbours);
    assert!(choose("logarithmic iterations").log_iterations != plain.log_iterations);
    assert!(choose("logarithmic losses").log_loss != plain.log_loss);
}
