//! Predictions in the real window: opened by command, drop and form, in list, filter and table, as the start of a fit.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::Key;
use mhp_inspector::dataset::npz::{ArrayView, write_npy};
use mhp_inspector::folders::HOME_VARIABLE;
use mhp_inspector::geometry::Vec3;
use mhp_inspector::predictions::{Axes, Colour, Unit, WriteFormat, write_predictions};
use mhp_inspector::session::{Command as Ask, SortKey, TimelineStrip};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Marks a home that is this test's own.
const ALONE: &str = "alone";

/// The truth of every frame so much aside, growing with the frame, as a file.
fn predictions(window: &Window, name: &str, aside_m: f64) -> PathBuf {
    let dataset = window.session().data.dataset.clone().unwrap();
    let frame = |index: usize| {
        let truth = dataset.load(index).unwrap().truth.unwrap().joints;
        let aside = aside_m * (index + 1) as f64;
        let moved: Vec<Vec3> = truth.iter().map(|&[x, y, z]| [x, y + aside, z]).collect();
        (dataset.frame_name(index).to_owned(), vec![moved])
    };
    let frames: Vec<_> = (0..dataset.len()).map(frame).collect();
    let path = window.folder.path().join(name);
    write_predictions(&path, WriteFormat::of(&path).unwrap(), &dataset.info().skeleton.joints, &frames).unwrap();
    path
}

fn read(window: &mut Window, sources: usize) {
    window.until("the predictions", |w| {
        let list = w.session().sources.list();
        list.len() == sources && list.iter().all(|source| source.errors.is_some())
    });
}

#[test]
fn sources_come_into_list_filter_and_table() {
    let mut window = Window::open(3);
    window.show("Predictions");
    assert!(window.says("No predictions"));
    let near = predictions(&window, "near.npz", 0.03);
    let far = predictions(&window, "far.json", 0.10);
    window.choose("File", "Open predictions…");
    window.answer_path("File of predictions", &near);
    read(&mut window, 1);
    window.drop_file(&far);
    read(&mut window, 2);
    assert!(window.named("near") && window.named("far"), "{:?}", window.names());
    let row = window.session().frame_row(1);
    assert!((row.of_source("near", mhp_inspector::session::SourceNumber::Error).unwrap() - 60.0).abs() < 1e-6);
    assert!(window.value("Frame frames/001").contains("near 60 mm"), "{}", window.value("Frame frames/001"));
    assert!(window.named("Sort by far, MAJPE"));

    // Two of three frames are more than 150 mm off.
    window.apply(Ask::SetFilter("pred.far>150".into()));
    assert_eq!(window.session().queue.rows(), [1, 2]);
    window.apply(Ask::SetFilter("pred.far>150 -pred.near>80".into()));
    assert_eq!(window.session().queue.rows(), [1]);
    window.apply(Ask::SetFilter(String::new()));
    window.click("Sort by far, MAJPE");
    window.click("Sort by far, MAJPE");
    assert_eq!(window.session().queue.rows(), [2, 1, 0]);

    // Drawn or not, and gone.
    window.click("far");
    assert!(!window.session().sources.list()[1].shown);
    window.click("Remove far");
    window.until("the source to go", |w| w.session().sources.list().len() == 1);
    assert!(!window.named("Remove far") && far.is_file());
}

#[test]
fn what_a_file_does_not_say_is_asked_in_a_form() {
    // What is remembered must not go into the home of whoever runs the tests.
    if std::env::var_os(HOME_VARIABLE).is_none_or(|home| !Path::new(&home).join(ALONE).exists()) {
        let home = tempfile::tempdir().unwrap();
        std::fs::write(home.path().join(ALONE), "").unwrap();
        let mut alone = Command::new(std::env::current_exe().unwrap());
        alone.args(["--exact", "predictions::what_a_file_does_not_say_is_asked_in_a_form", "--nocapture"]);
        let done = alone.env(HOME_VARIABLE, home.path()).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        assert!(home.path().join("predictions.toml").is_file());
        return;
    }
    let mut window = Window::open(2);
    let dataset = window.session().data.dataset.clone().unwrap();
    let truth = |index: usize| dataset.load(index).unwrap().truth.unwrap().joints;
    let numbers: Vec<f64> = (0..2).flat_map(truth).flat_map(|p| Axes::CAMERA.file(p).map(|x| 1000.0 * x)).collect();
    let path = window.folder.path().join("net.npy");
    write_npy(&path, &ArrayView::f64(&[2, 17, 3], &numbers)).unwrap();
    window.drop_file(&path);
    window.until("the question", |w| w.says("How are these joints to be read?"));
    // Millimetres are what people of usual size would be in; the axes are not to be guessed.
    assert_eq!(window.session().sources.question.as_ref().unwrap().reading.unit, None);
    window.click("camera");
    window.click("Skeleton of the joints");
    window.click("coco17, 17 joints");
    window.click("Read these joints");
    read(&mut window, 1);
    let source = &window.session().sources.list()[0];
    assert_eq!(
        (source.predictions.reading.unit, source.predictions.reading.axes),
        (Some(Unit::Mm), Some(Axes::CAMERA))
    );
    assert!(source.errors.as_ref().unwrap().summary.truth.errors().unwrap().majpe_mm < 1e-6);
    assert!(window.session().sources.question.is_none());
}

#[test]
fn a_fit_begins_at_a_prediction_and_the_list_is_sorted_by_disagreement() {
    let mut window = Window::open(2);
    let near = predictions(&window, "near.csv", 0.04);
    window.apply(Ask::OpenPredictions(near, Box::default()));
    read(&mut window, 1);
    window.apply(Ask::StartFromPredictions(0));
    window.ready(0);
    let wanted = window.session().sources.list()[0].predictions.frame(0).unwrap().joints.clone();
    assert_eq!(window.session().shown_positions(), wanted);
    assert!(window.told("the fit begins at what near predicts: 1 person"));
    window.key_with(egui::Modifiers::SHIFT, Key::Period);
    window.paused_at(10);
    let row = window.session().frame_row(0);
    let apart = row.disagreement_mm().unwrap();
    assert!(apart > 0.0 && apart < 300.0, "{apart}");
    // A fit from its own peaks elsewhere.
    window.apply(Ask::GotoFrame(1));
    window.ready(1);
    window.key_with(egui::Modifiers::SHIFT, Key::Period);
    window.paused_at(10);
    window.show("Predictions");
    window.click("Sort frames by disagreement");
    assert_eq!(window.session().view.sort.key, SortKey::Disagreement);
    let of = |frame: usize| window.session().frame_row(frame).disagreement_mm().unwrap();
    let wanted = if of(0) > of(1) { [0, 1] } else { [1, 0] };
    assert_eq!(window.session().queue.rows(), wanted);
    window.apply(Ask::SetFilter(format!("disagree>{}", of(0).max(of(1)) - 0.001)));
    assert_eq!(window.session().queue.rows().len(), 1);
    let mut view = window.session().view.clone();
    view.strip = TimelineStrip::Disagreement;
    window.apply(Ask::SetView(Box::new(view)));
    window.harness.run_steps(3);
    // Against the truth: of each frame the farthest source.
    let errors = window.session().prediction_errors_mm();
    for (frame, of) in &errors {
        let row = window.session().frame_row(*frame);
        let largest = row.sources.iter().filter_map(|(_, numbers)| numbers.majpe_mm).fold(0.0, f64::max);
        assert_eq!(*of, largest, "frame {frame}");
    }
    assert_eq!(errors.len(), window.session().data.len());
    window.click("Strip shows");
    window.harness.run_steps(2);
    window.click("Pred. mm");
    window.harness.run_steps(3);
    assert_eq!(window.session().view.strip, TimelineStrip::PredictionError);
}

#[test]
fn a_session_opens_with_its_predictions() {
    let mut window = Window::open(2);
    let near = predictions(&window, "near.parquet", 0.02);
    window.apply(Ask::OpenPredictions(near, Box::default()));
    read(&mut window, 1);
    let chosen = Some(Colour([0x10, 0xA3, 0x7F]));
    window.apply(Ask::ColourPredictions(0, chosen));
    let talks = tempfile::tempdir().unwrap();
    let file = talks.path().join("talk.mhp-session");
    window.apply(Ask::SaveSession(file.clone(), serde_json::Value::Null));
    window.until("the session file", |_| file.is_file());
    window.apply(Ask::RemovePredictions(0));
    window.apply(Ask::OpenSession(file));
    read(&mut window, 1);
    assert_eq!(window.session().sources.list()[0].name(), "near");
    assert_eq!(window.session().sources.list()[0].colour, chosen);
    window.show("Predictions");
    assert!(window.named("Colour of near"), "{:?}", window.names());
}
