//! The first visit, and those after it: what the window shows by itself, and what it remembers.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::window::Window;
use egui::{Key, Modifiers};
use egui_kittest::Harness;
use mhp_inspector::app::{Begin, InspectorApp, Pane};
use mhp_inspector::config::Preset;
use mhp_inspector::session::{FitStatus, RunSpeed, ThemeChoice};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a profile keeps.
#[derive(Debug, Clone, Default)]
struct Profile(BTreeMap<String, String>);

impl eframe::Storage for Profile {
    fn get_string(&self, key: &str) -> Option<String> {
        self.0.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        self.0.insert(key.into(), value);
    }

    fn remove_string(&mut self, key: &str) {
        self.0.remove(key);
    }

    fn flush(&mut self) {}
}

/// The window of somebody with this profile.
fn visit(profile: &Profile, begin: &Begin) -> Window {
    // The harness asks for a profile that outlives it.
    let profile: &'static Profile = Box::leak(Box::new(profile.clone()));
    let harness =
        Harness::builder().with_size([1440.0, 900.0]).with_step_dt(1.0 / 60.0).with_max_steps(200).build_eframe(|cc| {
            cc.storage = Some(profile);
            InspectorApp::begin(cc, begin)
        });
    Window { harness, folder: tempfile::tempdir().unwrap() }
}

fn on(path: &Path) -> Begin {
    Begin { paths: vec![path.to_owned()], ..Begin::default() }
}

/// The window is closed.
fn close(mut window: Window) -> Profile {
    let mut profile = Profile::default();
    eframe::App::save(window.harness.state_mut(), &mut profile);
    profile
}

/// Two presets side by side on the first frame; the first run slow enough to be watched; neither on the next visit, which
/// opens what was open and shows it as it was shown.
#[test]
fn the_first_visit_begins_with_two_presets_and_a_run_to_watch() {
    let data = tempfile::tempdir().unwrap();
    blob::write_dataset(data.path(), 3);
    let mut window = visit(&Profile::default(), &on(data.path()));
    window.until("both fits", |w| w.named("Take recommended") && w.named("Take paper"));
    assert!(window.says("One frame, two ways to fit it"));
    window.click("Take recommended");
    window.until("the card gone", |w| !w.named("Take paper"));
    assert_eq!(window.session().config, Preset::Recommended.config());
    window.ready(0);
    assert_eq!(window.session().view.speed, RunSpeed::Max);
    window.key(Key::Enter);
    window.until("what is said of the first run", |w| w.told("Your first run, slowed to"));
    window.until("its end", |w| w.fit().status == FitStatus::Paused && w.fit().head() > 0);
    let took = window.fit().run_ms.unwrap();
    assert!(took > 2000.0, "{took} ms");
    window.key_with(Modifiers::COMMAND, Key::T);

    let profile = close(window);
    let mut window = visit(&profile, &Begin::default());
    window.ready(0);
    assert_eq!(window.session().data.dataset.as_ref().unwrap().info().root, data.path());
    assert_eq!(window.session().view.theme, ThemeChoice::Light);
    window.harness.run_steps(5);
    assert!(!window.named("Take paper"), "once is enough");
    window.key(Key::Enter);
    window.until("a run as fast as it goes", |w| w.fit().status == FitStatus::Paused && w.fit().head() > 0);
    assert!(window.fit().run_ms.unwrap() < took);
}

#[test]
fn the_last_data_set_opens_again_and_one_that_is_gone_does_not() {
    let data = tempfile::tempdir().unwrap();
    blob::write_dataset(data.path(), 2);
    let mut window = visit(&Profile::default(), &on(data.path()));
    window.until("the frame", |w| w.session().data.frame.is_some());
    let profile = close(window);
    drop(data);
    let mut window = visit(&profile, &Begin::default());
    window.until("the bundled sample", |w| w.session().data.dataset.is_some());
    assert_eq!(window.session().data.dataset.as_ref().unwrap().info().name, "walk");
}

/// Borders that nobody moved go with the size of the window on the next visit too.
#[test]
fn the_layout_fits_another_window_on_the_next_visit() {
    let data = tempfile::tempdir().unwrap();
    blob::write_dataset(data.path(), 2);
    let mut window = visit(&Profile::default(), &on(data.path()));
    window.until("the frame", |w| w.session().data.frame.is_some());
    window.harness.run_steps(3);
    let profile = close(window);
    let mut window = visit(&profile, &Begin::default());
    window.ready(0);
    let width = |w: &mut Window, size: [f32; 2]| {
        w.harness.set_size(size.into());
        w.harness.run_steps(4);
        w.harness.state().pane_rect(Pane::called("Frames").unwrap()).unwrap().width()
    };
    let (small, large) = (width(&mut window, [1024.0, 640.0]), width(&mut window, [3840.0, 2160.0]));
    assert!((212.0..=230.0).contains(&small) && (300.0..=340.0).contains(&large), "{small} {large}");
}

#[test]
fn the_title_names_the_data_and_the_frame() {
    let data = tempfile::tempdir().unwrap();
    blob::write_dataset(data.path(), 2);
    let harness = Window::empty(&[data.path().to_owned()], [1440.0, 900.0]);
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    let title = |w: &Window| w.harness.state().title().to_owned();
    window.until("the first frame", |w| w.session().data.frame.is_some());
    assert_eq!(title(&window), "blob · frames/000 – MHP Inspector");
    window.key(Key::ArrowRight);
    window.ready(1);
    assert_eq!(title(&window), "blob · frames/001 – MHP Inspector");
}

/// No portal answers, as in a container: a path can be typed, and that is told; so in every sheet that browses.
#[test]
fn without_a_file_dialog_a_path_is_typed() {
    let data = tempfile::tempdir().unwrap();
    blob::write_dataset(data.path(), 2);
    let mut window = visit(&Profile::default(), &Begin { pick: Some(|_| None), ..on(data.path()) });
    window.until("the card", |w| w.named("Take recommended"));
    window.key(Key::Escape);
    window.until("the card gone", |w| !w.named("Take recommended"));
    for item in ["Open folder…", "Open file…"] {
        window.choose("File", item);
        window.until("the sheet", |w| w.named("Path"));
        assert!(window.says("this desktop shows no file dialog"));
        window.key(Key::Escape);
        window.until("the sheet gone", |w| !w.named("Path"));
        window.dismiss_all();
    }
    let other = tempfile::tempdir().unwrap();
    blob::write_dataset(other.path(), 4);
    window.choose("File", "Open folder…");
    let path: PathBuf = other.path().to_owned();
    window.answer_path("Path", &path);
    window.until("the other data set", |w| w.session().data.len() == 4);
}
