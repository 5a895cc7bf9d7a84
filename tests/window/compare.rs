//! Comparing fits and taking things home in the real window, by name and without a display.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::window::Window;
use egui::{Key, Modifiers};
use egui_kittest::Harness;
use mhp_inspector::app::InspectorApp;
use mhp_inspector::dataset::read_pppr;
use mhp_inspector::session::{Against, Command, LogLevel, ThemeChoice};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

const CTRL: Modifiers = Modifiers::COMMAND;

/// Frame `index` of a data set of `frames` has run for ten iterations.
fn run_ten(frames: usize, index: usize) -> Window {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), frames);
    let mut window = Window::on(folder);
    window.apply(Command::GotoFrame(index));
    window.ready(index);
    window.key_with(Modifiers::SHIFT, Key::Period);
    window.paused_at(10);
    window
}

fn number(text: f64, digits: usize) -> String {
    format!("{text:+.digits$}").replace('-', "−")
}

#[test]
fn a_pinned_fit_is_the_baseline_of_the_next_one() {
    let mut window = run_ten(2, 0);
    window.switch_live_off();
    assert!(!window.named("Compare with the baseline"));
    window.click("Compare");
    assert!(window.says("No pinned fit"));
    window.key(Key::P);
    window.until("the pin", |w| w.named("Baseline A"));
    assert!(window.is_on("Baseline A") && window.says("pinned A: iteration 10 of frames/000"));
    window.type_value("w_EM value", "2.5");
    window.key_with(Modifiers::SHIFT, Key::Period);
    window.paused_at(20);
    assert!(window.says("w_EM 0.5 → 2.5"));
    let pinned = window.session().pins.list()[0].numbers();
    let row = window.fit().shown_row().unwrap();
    let now = mhp_inspector::session::numbers(&row.report, row.majpe_mm);
    for (digits, (now, pinned)) in [4, 3, 1].into_iter().zip(now.into_iter().zip(pinned)) {
        let delta = number(now.unwrap() - pinned.unwrap(), digits);
        assert!(window.says(&delta), "{delta} in {:?}", window.names());
    }

    // The maps: against H_ori, against the baseline, and back.
    window.key(Key::D);
    assert!(window.named("H_sim − H_ori map of hori"));
    window.key(Key::B);
    assert_eq!(window.session().view.against, Against::Baseline);
    window.until("the difference", |w| w.named("H_sim − baseline map of hori"));
    window.key(Key::D);
    let map = window.node("H_sim map of hori").rect().center();
    window.harness.event(egui::Event::ModifiersChanged(Modifiers::SHIFT));
    window.harness.hover_at(map);
    window.harness.run_steps(2);
    assert!(window.named("H_sim of the baseline map of hori"), "flipped while Shift is held");
    window.harness.event(egui::Event::ModifiersChanged(Modifiers::NONE));
    window.harness.remove_cursor();
    window.harness.run_steps(2);
    window.key(Key::W);
    assert!(window.named("Wipe position"));
    window.key(Key::D);

    // A second pin, another baseline, none, and removed.
    window.key(Key::P);
    window.until("the second pin", |w| w.named("Baseline B"));
    window.click("Baseline B");
    assert!(window.is_on("Baseline B") && !window.is_on("Baseline A"));
    window.click("Baseline B");
    assert!(window.session().pins.baseline().is_none() && !window.named("Compare with the baseline"));
    assert!(window.named("H_sim − H_ori map of hori"), "without a baseline the maps are against H_ori");
    window.click("Baseline A");
    window.click("Remove pin A");
    assert!(!window.named("Baseline A") && window.is_on("Baseline B"));
    window.click("Remove pin B");
    assert!(window.says("No pinned fit"));
}

#[test]
fn a_pin_can_be_named_and_leads_back_to_its_frame() {
    let mut window = run_ten(3, 1);
    window.key(Key::P);
    window.click("Compare");
    window.type_value("Name of pin A", "start");
    window.until("the name", |w| w.named("Baseline start"));
    window.key(Key::End);
    window.ready(2);
    window.click("001");
    window.ready(1);
    assert_eq!(window.fit().head(), 10);
}

/// A window with all that a session file keeps: an earlier iteration on screen, changed settings on the way, a pin, a filter,
/// a moved camera, zoomed maps, another pane in front.
fn busy() -> Window {
    let mut window = run_ten(4, 2);
    window.switch_live_off();
    window.type_value("w_EM value", "2");
    window.key_with(Modifiers::SHIFT, Key::Period);
    window.paused_at(20);
    window.key(Key::P);
    window.key_with(Modifiers::SHIFT, Key::Comma);
    window.key(Key::Comma);
    window.until("iteration 9", |w| w.fit().shown.as_ref().is_some_and(|shown| shown.iteration == 9));
    window.key(Key::P);
    window.click("Compare");
    window.click("Baseline B");
    window.key(Key::B);
    window.key(Key::W);
    window.key_with(CTRL, Key::T);
    window.key(Key::T);
    window.key(Key::F);
    window.click("Filter frames");
    window.type_text("index>0");
    window.key(Key::Enter);
    window.harness.run_steps(3);
    window
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_session_file_opens_to_the_same_state_without_running() {
    let (mut window, out) = (busy(), tempfile::tempdir().unwrap());
    let path = out.path().join("kept.mhp-session");
    window.key_with(CTRL, Key::S);
    window.answer_path("Save to", &path);
    window.until("the file", |w| w.told("session saved to"));
    let kept = read(&path);
    // Once it has a file, no question is asked.
    std::fs::remove_file(&path).unwrap();
    window.key_with(CTRL, Key::S);
    window.until("the file again", |_| path.is_file());
    assert!(!window.named("Save to"));

    let elsewhere = tempfile::tempdir().unwrap();
    blob::write_dataset(elsewhere.path(), 1);
    let mut fresh = Window::on(elsewhere);
    fresh.choose("File", "Open session…");
    fresh.answer_path("Session file", &path);
    fresh.until("the session", |w| {
        w.frame() == 2 && w.fit().is_ready() && w.fit().shown.as_ref().is_some_and(|shown| shown.iteration == 9)
    });
    let (old, new) = (window.session(), fresh.session());
    assert_eq!((new.fit.head(), new.fit.cursor, new.fit.run.0), (20, Some(9), 0), "nothing ran");
    let bits = |w: &Window| w.fit().shown.as_ref().map(|shown| shown.evaluation.loss.to_bits());
    assert_eq!(bits(&fresh), bits(&window));
    assert_eq!(new.fit.shown_row().map(|row| row.report.clone()), old.fit.shown_row().map(|row| row.report.clone()));
    assert_eq!(new.shown_hashes(), old.shown_hashes(), "the same parameters and the settings of that time");
    assert_eq!(new.fit.branch().unwrap().flags, old.fit.branch().unwrap().flags);
    assert_eq!((&new.view, new.config), (&old.view, old.config));
    assert_eq!((new.view.theme, new.queue.text.as_str(), new.queue.rows().len()), (ThemeChoice::Light, "index>0", 3));

    fresh.until("the maps of the pins", |w| w.session().pins.list().iter().all(|pin| pin.snapshot.is_some()));
    for (new, old) in fresh.session().pins.list().iter().zip(window.session().pins.list()) {
        assert_eq!((&new.name, new.frame, new.config, &new.params), (&old.name, old.frame, old.config, &old.params));
        let [new, old] = [new, old].map(|pin| pin.snapshot.as_ref().unwrap());
        assert_eq!((&new.h_sim, new.evaluation.loss.to_bits()), (&old.h_sim, old.evaluation.loss.to_bits()));
    }
    assert_eq!(fresh.session().pins.baseline().map(|pin| pin.name.as_str()), Some("B"));
    assert!(fresh.is_on("Baseline B"), "the pane that was in front");

    // All of it, also camera, zoom and layout: saved again it is the same file.
    let again = path.with_file_name("again.mhp-session");
    fresh.save_as("Save session as…", &again);
    let again = read(&again);
    assert!(again["window"]["panes"]["camera"].is_array() && again["window"]["panes"]["maps"] != json!([]));
    for key in ["dataset", "frame", "config", "view", "filter", "fit", "pins", "baseline", "window"] {
        assert_eq!(again[key], kept[key], "{key}");
    }
    // The next pin has a name of its own, and the run goes on.
    fresh.key(Key::L);
    fresh.until("the newest", |w| w.fit().cursor.is_none());
    fresh.key(Key::P);
    fresh.until("the pin", |w| w.named("Baseline C"));
    fresh.key(Key::Period);
    fresh.paused_at(21);
}

/// The session file of a small window, changed.
fn broken(kept: &Value, change: impl Fn(&mut Value)) -> Vec<u8> {
    let mut value = kept.clone();
    change(&mut value);
    serde_json::to_vec(&value).unwrap()
}

#[test]
fn a_bad_session_file_is_one_error_and_changes_nothing() {
    let (mut window, out) = (run_ten(2, 1), tempfile::tempdir().unwrap());
    window.key(Key::P);
    let good = out.path().join("good.mhp-session");
    window.save_as("Save session as…", &good);
    let (kept, text) = (read(&good), std::fs::read(&good).unwrap());
    let gone = json!("/nowhere/at/all");
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("no session file of version 1", Vec::new()),
        ("no session file of version 1", b"{}".to_vec()),
        ("no session file of version 1", b"these are my notes".to_vec()),
        ("no session file of version 1", text[..text.len() / 2].to_vec()),
        ("`version` is 2; this program reads 1", broken(&kept, |v| v["version"] = json!(2))),
        ("`format` is \"other\"", broken(&kept, |v| v["format"] = json!("other"))),
        ("expected", broken(&kept, |v| v["fit"]["rows"] = json!("none"))),
        ("tau_pct", broken(&kept, |v| v["config"] = json!("tau_pct = 400.0"))),
        ("`config`", broken(&kept, |v| v["pins"][0]["config"] = json!("nonsense = 1"))),
        (
            "its data set was at /nowhere/at/all",
            broken(&kept, |v| {
                v["dataset"]["absolute"] = gone.clone();
                v["dataset"]["relative"] = Value::Null;
            }),
        ),
    ];
    let state = |w: &Window| {
        let (session, errors) = (w.session(), w.session().log.iter().filter(|l| l.level == LogLevel::Error).count());
        let dataset = session.data.dataset.as_ref().map(|dataset| Arc::as_ptr(dataset) as usize);
        let view = (session.view.clone(), session.queue.text.clone(), session.session_path.clone());
        ((dataset, w.frame(), session.fit.job, w.fit().head(), session.pins.list().len(), view), errors)
    };
    let bad = out.path().join("bad.mhp-session");
    for (words, content) in cases {
        std::fs::write(&bad, content).unwrap();
        refuse(&mut window, &bad, words, &state);
    }
    std::fs::remove_file(&bad).unwrap();
    refuse(&mut window, &bad, "cannot be read", &state);
    std::fs::create_dir(&bad).unwrap();
    refuse(&mut window, &bad, "cannot be read", &state);
}

fn refuse<S: PartialEq + std::fmt::Debug>(
    window: &mut Window,
    path: &Path,
    words: &str,
    state: &dyn Fn(&Window) -> (S, usize),
) {
    let (before, errors) = state(window);
    window.choose("File", "Open session…");
    window.answer_path("Session file", path);
    window.until(words, |w| state(w).1 > errors);
    assert!(window.told(words) && window.told("bad.mhp-session"), "{words}: {:?}", window.session().notice);
    window.harness.run_steps(3);
    assert_eq!(state(window), (before, errors + 1), "{words}");
    window.dismiss_all();
}

#[test]
fn a_session_whose_fit_is_not_whole_still_opens() {
    let (mut window, out) = (run_ten(2, 1), tempfile::tempdir().unwrap());
    let path = out.path().join("kept.mhp-session");
    window.save_as("Save session as…", &path);
    let kept = read(&path);
    let hurt = broken(&kept, |v| {
        v["fit"]["states"] = json!([]);
        v["view"]["zoom"] = json!(1e30);
        v["window"] = json!({ "layout": 7 });
    });
    std::fs::write(&path, hurt).unwrap();
    window.apply(Command::OpenSession(path));
    window.until("the session", |w| w.told("camera and layout of the session could not be put back"));
    assert!(window.session().log.iter().any(|line| line.text.contains("its fit is not whole and was left out")));
    window.until("a fit", |w| w.frame() == 1 && w.fit().is_ready() && w.fit().shown.is_some());
    assert_eq!((window.fit().head(), window.session().view.zoom), (0, 2.0));
}

#[test]
fn what_is_exported_reads_back() {
    let (mut window, out) = (run_ten(2, 0), tempfile::tempdir().unwrap());
    let file = |name: &str| out.path().join(name);
    let curves = file("curves.csv");
    window.save_as("Export curves as CSV…", &curves);
    let mut table = csv::Reader::from_path(&curves).unwrap();
    let column = table.headers().unwrap().iter().position(|name| name == "loss").unwrap();
    let losses: Vec<f64> = table.records().map(|row| row.unwrap()[column].parse().unwrap()).collect();
    let known: Vec<f64> = window.fit().branch().unwrap().rows.iter().map(|row| row.report.loss).collect();
    assert_eq!(losses, known, "to the bit");

    let npz = file("params.npz");
    window.save_as("Export parameters as npz…", &npz);
    let shown = window.fit().shown.as_ref().unwrap().params.clone();
    assert_eq!(read_pppr(&npz, Some(shown.shape())).unwrap(), shown);

    let ply = file("gaussians.ply");
    window.save_as("Export Gaussians as PLY…", &ply);
    let bytes = std::fs::read(&ply).unwrap();
    let header = String::from_utf8_lossy(&bytes[..bytes.len().min(1500)]).into_owned();
    assert!(header.starts_with("ply\n") && header.contains("element vertex 17"), "{header}");

    window.at_rest();
    let strata = file("strata.csv");
    window.save_as("Export strata as CSV…", &strata);
    assert_eq!(csv::Reader::from_path(&strata).unwrap().records().count(), 2);

    // Where nothing can be written, that is told and no file is left.
    let nowhere = file("no such folder/curves.csv");
    window.choose("File", "Export curves as CSV…");
    window.answer_path("Save to", &nowhere);
    window.until("the error", |w| w.told("no such folder"));
    assert!(window.says("curves.csv") && !nowhere.exists());

    // Neither an input nor its folder is written.
    let frame = window.folder.path().join("frames/000.npz");
    let (before, inside) = (std::fs::read(&frame).unwrap(), window.folder.path().join("curves.csv"));
    for place in [&frame, &inside] {
        window.choose("File", "Export curves as CSV…");
        window.answer_path("Save to", place);
        window.until("the refusal", |w| w.told("lies in the data set"));
        window.dismiss_all();
    }
    assert!(std::fs::read(&frame).unwrap() == before && !inside.exists());
}

#[test]
fn captions_say_what_a_figure_shows() {
    let mut window = run_ten(1, 0);
    assert_eq!(window.texts_of("H_sim map of hori"), "");
    window.key_with(Modifiers::SHIFT, Key::F);
    window.harness.run_steps(2);
    for name in ["H_ori map of hori", "H_sim map of vert", "Masks map of hori", "3-D scene", "Curves"] {
        let caption = window.texts_of(name);
        for part in
            ["frames/000", "iteration 10", "τ_pct 10 %", "seed", concat!("inspector ", env!("CARGO_PKG_VERSION"))]
        {
            assert!(caption.contains(part), "{name}: {part} in {caption:?}");
        }
    }
    assert!(window.texts_of("3-D scene").starts_with("3-D, metres, z up"));
}

/// False, with the reason printed, where nothing can draw pictures.
fn can_draw() -> bool {
    use eframe::wgpu::{Backends, Instance, InstanceDescriptor};
    let mut wanted = InstanceDescriptor::new_without_display_handle();
    wanted.backends = Backends::VULKAN;
    let adapters = pollster::block_on(Instance::new(wanted).enumerate_adapters(Backends::VULKAN));
    if adapters.is_empty() {
        println!("skipped: no graphics adapter");
    }
    !adapters.is_empty()
}

#[test]
fn pictures_have_the_size_of_what_they_show() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 1);
    let paths = [folder.path().to_path_buf()];
    let harness = Harness::builder()
        .with_size([1000.0, 640.0])
        .with_step_dt(1.0 / 60.0)
        .wgpu()
        .build_eframe(|cc| InspectorApp::new(cc, &paths));
    let mut window = Window { harness, folder };
    window.ready(0);
    let out = tempfile::tempdir().unwrap();
    let whole = out.path().join("window.png");
    window.key_with(CTRL | Modifiers::SHIFT, Key::S);
    window.answer_path("Save to", &whole);
    window.until("the picture", |w| w.told("picture of 1000 × 640 pixels written to"));
    let picture = image::open(&whole).unwrap().to_rgba8();
    assert_eq!(picture.dimensions(), (1000, 640));
    let first = *picture.get_pixel(0, 0);
    assert!(picture.pixels().any(|pixel| *pixel != first), "something was drawn");
    assert_eq!(
        first.0,
        [0x17, 0x1A, 0x20, 0xFF],
        "the window as it was, without the question where to keep its picture"
    );

    let pane = out.path().join("pane.png");
    let map = window.node("Masks map of hori").rect();
    window.node("Maps").click_secondary();
    window.harness.run_steps(2);
    window.click("Save picture of this pane…");
    window.answer_path("Save to", &pane);
    window.until("the picture", |_| pane.is_file());
    let part = image::open(&pane).unwrap().to_rgba8();
    assert!(f64::from(part.width()) > f64::from(map.width()) && part.width() < 700, "{:?}", part.dimensions());
    let contains = (0..=1000 - part.width()).any(|x| {
        (0..=640 - part.height()).any(|y| {
            let same = |px: u32, py: u32| part.get_pixel(px, py) == picture.get_pixel(x + px, y + py);
            (0..part.width()).step_by(7).all(|px| (0..part.height()).step_by(5).all(|py| same(px, py)))
        })
    });

    assert!(contains, "the pane is a part of the window");
}
