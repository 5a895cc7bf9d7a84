//! Pictures of what a fit could have come to and rests on, and of networks beside it, to be looked at and to be put into a paper:
//! `MHP_PICTURES=FOLDER MHP_DATA=DATA cargo test --release --test window pictures -- --ignored`; `MHP_FRAME` names the frame,
//! `MHP_PREDICTIONS` files of predictions with commas between.
#![expect(clippy::unwrap_used, reason = "a picture that cannot be made is no picture")]

use crate::window::Window;
use egui::{Key, Modifiers, pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::app::{InspectorApp, Pane};
use mhp_inspector::config::Preset;
use mhp_inspector::explore::{ExplorationKind, SliceAlong};
use mhp_inspector::session::{Command, Isolate, ThemeChoice};
use std::path::{Path, PathBuf};

/// The window with a graphics adapter.
fn open(path: &Path, frame: usize) -> Window {
    let paths: Vec<PathBuf> = vec![path.into()];
    let harness: Harness<'static, InspectorApp> = Harness::builder()
        .with_size([1440.0, 900.0])
        .with_step_dt(1.0 / 60.0)
        .with_max_steps(200)
        .wgpu()
        .build_eframe(|cc| InspectorApp::new(cc, &paths));
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    window.apply(Command::SetConfig(Box::new(Preset::Recommended.config())));
    window.apply(Command::Reset);
    window.ready(0);
    if frame > 0 {
        window.apply(Command::GotoFrame(frame));
        window.ready(frame);
    }
    let iterations = window.session().config.iterations;
    window.apply(Command::StepFit(iterations));
    window.paused_at(iterations);
    window.at_rest();
    window
}

fn picture(window: &mut Window, folder: &Path, name: &str) {
    window.dismiss_all();
    for theme in [ThemeChoice::Dark, ThemeChoice::Light] {
        let mut view = window.session().view.clone();
        view.theme = theme;
        window.apply(Command::SetView(Box::new(view)));
        window.harness.run_steps(6);
        let word = if theme == ThemeChoice::Dark { "dark" } else { "light" };
        window.harness.render().unwrap().save(folder.join(format!("{name}-{word}.png"))).unwrap();
    }
}

/// What else the fit could have come to.
fn others(window: &mut Window, folder: &Path) {
    for kind in ExplorationKind::ALL {
        let mut view = window.session().view.clone();
        view.explore.landscape.and = Some(SliceAlong::BodyY);
        window.apply(Command::SetView(Box::new(view)));
        let pane = Pane::all().iter().find(|pane| pane.title().eq_ignore_ascii_case(kind.title())).unwrap();
        window.harness.state_mut().show_pane(pane);
        window.harness.run_steps(3);
        window.apply(Command::Explore(kind));
        window.until(kind.title(), |w| !w.session().explore.is_running(kind) && w.session().explore.is_current(kind));
        window.harness.run_steps(4);
        if kind == ExplorationKind::Restarts {
            window.node("Take basin 1").hover();
            window.harness.run_steps(4);
        }
        picture(window, folder, &kind.title().replace(' ', "-"));
        window.harness.remove_cursor();
    }
}

/// The strongest echo is taken away, and the fit done anew.
fn eraser(window: &mut Window, folder: &Path, array: &str) {
    window.harness.state_mut().show_pane(Pane::called("Curves").unwrap());
    let problem = window.fit().problem.clone().unwrap();
    let map = problem.map(0);
    let strongest = (0..map.len()).max_by(|a, b| map[*a].total_cmp(&map[*b])).unwrap();
    window.apply(Command::EraseEcho(0, strongest));
    window.until("the fit without it", |w| w.fit().erased().len() == 1 && !w.fit().is_running());
    window.until("what it was worth", |w| w.named("Without the erased cells"));
    println!("{array}: {}", window.text_of("Without the erased cells"));
    picture(window, folder, "eraser");
    window.apply(Command::Undo);
    window.until("the echo back", |w| w.fit().erased().is_empty() && !w.fit().is_running());
}

/// Networks beside fit and truth, the list sorted by how far the first is from the fit.
fn predictions(window: &mut Window, folder: &Path) {
    let Ok(files) = std::env::var("MHP_PREDICTIONS") else { return };
    let known = files.split(',').count();
    for file in files.split(',') {
        window.apply(Command::OpenPredictions(file.into(), Box::default()));
    }
    window.until("the predictions", |w| w.session().sources.list().len() == known);
    // Every frame has a fit to be compared with.
    window.key_with(Modifiers::COMMAND, Key::Enter);
    window.until("the batch", |w| !w.session().batch.is_running() && w.session().batch.fitted() > 0);
    window.harness.state_mut().show_pane(Pane::called("Predictions").unwrap());
    window.harness.run_steps(4);
    let slot = window.session().sources.list()[0].name().to_owned();
    window.click("Sort frames by disagreement");
    window.harness.run_steps(4);
    println!("sorted by how far {slot} is from the fit");
    picture(window, folder, "predictions");
    for _ in 0..known {
        window.apply(Command::RemovePredictions(0));
    }
}

#[test]
#[ignore = "writes pictures to be looked at"]
fn pictures() {
    let Some(folder) = std::env::var_os("MHP_PICTURES").map(PathBuf::from) else { return println!("no MHP_PICTURES") };
    let data = std::env::var_os("MHP_DATA").map_or_else(|| "samples/walk".into(), PathBuf::from);
    let frame = std::env::var("MHP_FRAME").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    std::fs::create_dir_all(&folder).unwrap();
    let mut window = open(&data, frame);
    let view = window.session().data.dataset.as_ref().unwrap().info().views[0].array.clone();
    others(&mut window, &folder);
    eraser(&mut window, &folder, &view);
    predictions(&mut window, &folder);

    window.show("Who lit it");
    window.until("the joints left out", |w| w.says("its drop without a joint"));
    let map = window.node(&format!("H_sim map of {view}")).rect();
    window.harness.hover_at(pos2(map.left() + 0.46 * map.width(), map.top() + 0.5 * map.height()));
    window.harness.run_steps(6);
    picture(&mut window, &folder, "lit");
    let joint = window.harness.query_all_by_label("Joint left knee").next().map(|node| node.rect().center());
    window.harness.hover_at(joint.unwrap());
    window.harness.run_steps(30);
    picture(&mut window, &folder, "footprint");
    window.harness.remove_cursor();
    window.apply(Command::SelectJoint(Some(13)));
    let mut shown = window.session().view.clone();
    shown.isolate = Isolate::Without;
    window.apply(Command::SetView(Box::new(shown.clone())));
    window.harness.run_steps(30);
    picture(&mut window, &folder, "without");
    shown.isolate = Isolate::All;
    window.apply(Command::SetView(Box::new(shown)));
    window.apply(Command::SelectJoint(None));

    window.show("Radar knows");
    window.until("the matrix", |w| w.says("Least observable, widest first"));
    picture(&mut window, &folder, "known");
    window.show("Closure test");
    window.click("Test this pose");
    window.until("the test", |w| w.named("Closure test result"));
    window.harness.run_steps(4);
    picture(&mut window, &folder, "closure");
    window.click("Mask outlines at τ");
    window.click("Point clouds at τ");
    window.until("the clouds", |w| w.says("PPPR "));
    window.show("Curves");
    picture(&mut window, &folder, "tau");
    window.click("Mask outlines at τ");
    window.click("Point clouds at τ");
    window.show("Breakpoints");
    window.apply(Command::AddBreakpoint("iteration=30".into()));
    window.apply(Command::AddBreakpoint("em·kine<-0.9".into()));
    window.apply(Command::Reset);
    window.ready(frame);
    window.key(Key::Enter);
    window.until("a stop", |w| w.session().breakpoints.list().iter().any(|point| point.hits > 0));
    picture(&mut window, &folder, "breakpoints");
    window.apply(Command::StepFit(70));
    window.until("the end", |w| !w.fit().is_running());
    window.harness.state_mut().show_pane(Pane::called("Radar what-if").unwrap());
    window.until("both radars", |w| w.named(&format!("What-if map of {view}, other")));
    let slider = window.node("Elements").rect();
    let along = |share: f32| pos2(slider.left() + share * slider.width(), slider.center().y);
    window.harness.hover_at(along(0.3));
    window.harness.drag_at(along(0.3));
    window.harness.run_steps(1);
    window.harness.hover_at(along(0.5));
    window.harness.run_steps(1);
    window.harness.drop_at(along(0.5));
    window.harness.run_steps(2);
    window.harness.remove_cursor();
    window.until("the other radar", |w| w.named("What-if numbers") && !w.harness.state().panes_are_working());
    picture(&mut window, &folder, "what-if");
}
