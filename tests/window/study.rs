//! A study in the window: opened by menu and by dropping its folder, its table and plots, and from a row to its frames.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::window::Window;
use egui::Key;
use mhp_inspector::app::Pane;
use mhp_inspector::config::{FitConfig, Parameterization, Preset, Summation};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::mhp::Precision;
use mhp_inspector::session::PresetCard;
use mhp_inspector::session::{Command, LogLevel};
use mhp_inspector::study::complexity::{ComplexityOptions, compute};
use mhp_inspector::study::run::{RunFolder, RunPlan, RunRequest, StudyKind, execute_run};
use mhp_inspector::study::shard::Subset;
use mhp_inspector::task::Progress;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Runs a small study of the window's data set.
fn run(window: &Window, study: StudyKind, grid: &[&str]) -> PathBuf {
    let dataset = Dataset::open(window.folder.path(), &Progress::new()).unwrap();
    // As with --into-data: the folder lives as long as the window.
    mhp_inspector::output::allow_into_data(true);
    let out = window.folder.path().join(format!("run-{study}-{}", grid.len()));
    run_of(&dataset, &out, study, grid);
    out
}

fn run_of(dataset: &Dataset, out: &Path, study: StudyKind, grid: &[&str]) {
    run_with(dataset, out, study, grid, &Preset::Baseline.config());
}

fn run_with(dataset: &Dataset, out: &Path, study: StudyKind, grid: &[&str], base: &FitConfig) {
    let request = RunRequest {
        study,
        base: *base,
        base_name: "test".into(),
        precision: Precision::F32,
        frames: (0..dataset.len().min(4)).into(),
        subset: Subset::All,
        grid: grid.iter().map(|axis| axis.parse().unwrap()).collect(),
        iterations: Some(2),
        shard: None,
        erased: Arc::default(),
    };
    let complexity = RunPlan::needs_strata(&request)
        .then(|| compute(dataset, &ComplexityOptions::default(), None, &Progress::new()).unwrap());
    let plan = RunPlan::new(dataset, &request, complexity.as_ref()).unwrap();
    execute_run(dataset, &plan, &RunFolder::of_data(out, dataset), 2, &Progress::new(), None).unwrap();
}

fn shown(window: &mut Window, study: StudyKind) {
    window.until("the study", |w| w.session().study.shown().is_some_and(|run| run.spec.study == study));
    window.harness.run_steps(3);
}

#[test]
fn an_empty_pane_says_how_it_is_filled() {
    let mut window = Window::open(2);
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    window.harness.run_steps(2);
    assert!(window.says("A study fits the listed frames with several settings"));
    assert!(window.named("Run study") && window.named("Which study"));
}

#[test]
fn a_dropped_run_folder_shows_its_table_and_bars() {
    let mut window = Window::open(5);
    let folder = run(&window, StudyKind::Operators, &[]);
    window.drop_file(&folder);
    shown(&mut window, StudyKind::Operators);
    assert!(window.says("Radar simulation without one operator"));
    for name in ["Study row full pipeline", "Study row without range", "Plot PA-MAJPE"] {
        assert!(window.named(name), "{name}: {:#?}", window.names());
    }
    let bar = window.names().into_iter().find(|name| name.starts_with("Bar without range: ")).unwrap();
    assert!(bar.contains("mm") && !bar.contains("paper"), "the paper's figures are of MMVR: {bar}");
    assert!(window.says("are of MMVR and not shown: the layout here is npz."));
    window.click("Plot PA-MAJPE");
    window.harness.run_steps(2);
    let bar = window.names().into_iter().find(|name| name.starts_with("Bar without range: ")).unwrap();
    assert!(bar.contains("mm"), "{bar}");
}

#[test]
fn a_row_that_cannot_differ_says_why() {
    let mut window = Window::open(3);
    let dataset = Dataset::open(window.folder.path(), &Progress::new()).unwrap();
    let folder = window.folder.path().join("run-robustness");
    // Powers that add, and a body that moves as one.
    let mut deaf = FitConfig {
        parameterization: Parameterization::Bones,
        summation: Summation::Incoherent,
        ..FitConfig::default()
    };
    deaf.learning_rates.bone = Some(0.0);
    run_with(&dataset, &folder, StudyKind::Robustness, &[], &deaf);
    window.apply(Command::OpenRun(folder));
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    shown(&mut window, StudyKind::Robustness);
    let why = "[1] cannot move a joint: velocities reach none, for powers add, and no map has a Doppler axis";
    assert!(window.says(why), "{:#?}", window.names());
}

#[test]
fn a_row_puts_its_frames_into_the_list() {
    let mut window = Window::open(5);
    let folder = run(&window, StudyKind::Init, &[]);
    window.apply(Command::OpenRun(folder));
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    shown(&mut window, StudyKind::Init);
    window.click("Study row without position (P)");
    window.until("its frames", |w| w.session().summaries.len() == 4);
    assert_eq!(window.session().queue.rows(), [0, 1, 2, 3], "frame 4 was not studied");
    let run = window.session().study.shown().unwrap();
    let wanted: Vec<Option<f64>> = run.rows_of(&run.table[1]).map(|row| row.fit.as_ref().unwrap().majpe_mm).collect();
    let listed: Vec<Option<f64>> = (0..4).map(|frame| window.session().frame_row(frame).majpe_mm).collect();
    assert_eq!(listed, wanted);
    assert_eq!(window.session().study.row, Some(1));
    // The other row's frames replace them.
    window.click("Study row full (P + V)");
    window.until("the other row", |w| w.session().study.row == Some(0) && w.session().summaries.len() == 4);
}

#[test]
fn each_scene_has_its_table_and_its_frames() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 4);
    let said =
        "\n[[origin]]\nframes = \"*000\"\nscene = \"room 1\"\nsubject = \"b\"\n[[origin]]\nscene = \"room 10\"\n";
    std::fs::write(folder.path().join("dataset.toml"), blob::MANIFEST.to_owned() + said).unwrap();
    let mut window = Window::on(folder);
    let folder = run(&window, StudyKind::Init, &[]);
    window.apply(Command::OpenRun(folder));
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    shown(&mut window, StudyKind::Init);
    assert!(window.named("All scenes") && window.named("Scene room 1") && window.named("Scene room 10"));
    window.click("Scene room 10");
    window.click("Study row without position (P)");
    window.until("its frames in room 10", |w| w.session().queue.rows() == [1, 2, 3]);
    window.click("Scene room 1");
    window.click("Study row full (P + V)");
    window.until("the frame in room 1", |w| w.session().queue.rows() == [0]);
    window.click("All scenes");
    window.click("Study row without velocity (V)");
    window.until("all of them", |w| w.session().queue.rows().len() == 4);
    // The list says where frames come from, for who asks.
    assert!(window.session().frame_row(0).origin.subject.as_deref() == Some("b"));
    window.click("Columns");
    window.click("Scene");
    window.key(Key::Escape);
    window.harness.run_steps(2);
    window.click("Sort by Scene");
    window.harness.run_steps(2);
    assert_eq!(window.session().queue.rows(), [0, 1, 2, 3], "room 1 before room 10");
}

#[test]
fn a_stratum_shows_its_own_frames_only() {
    let mut window = Window::open(4);
    let folder = run(&window, StudyKind::Complexity, &[]);
    window.apply(Command::OpenRun(folder));
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    shown(&mut window, StudyKind::Complexity);
    let hard = window.session().study.shown().unwrap().table[2].frames;
    assert!(hard > 0 && hard < 4);
    window.click("Study row hard");
    window.until("the hard frames", |w| w.session().summaries.len() == hard);
    assert_eq!(window.session().queue.rows().len(), hard);
}

#[test]
fn sweeps_are_curves_maps_or_parallel_lines() {
    let mut window = Window::open(2);
    let cases: [(&[&str], &str); 3] = [
        (&["tau_pct=5,10,20"], "Plot of MAJPE, mm by tau_pct"),
        (&["tau_pct=5,10,20", "w_em=0.1,1"], "Contour of MAJPE, mm over tau_pct and w_em"),
        (
            &["tau_pct=5,10", "w_em=0.1,1", "summation=coherent,incoherent"],
            "Parallel coordinates of MAJPE, mm over tau_pct, w_em, summation",
        ),
    ];
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    for (grid, name) in cases {
        let folder = run(&window, StudyKind::Sweep, grid);
        window.apply(Command::OpenRun(folder));
        let points = grid.iter().map(|axis| axis.matches(',').count() + 1).product::<usize>();
        window.until("the sweep", |w| w.session().study.shown().is_some_and(|run| run.table.len() == points));
        window.harness.run_steps(3);
        assert!(window.named(name), "{name}: {:#?}", window.names());
    }
    let folder = run(&window, StudyKind::Sweep, cases[1].0);
    window.apply(Command::OpenRun(folder));
    window.until("the map", |w| w.session().study.shown().is_some_and(|run| run.table.len() == 6));
    window.harness.run_steps(3);
    let point = window.names().into_iter().find(|name| name.starts_with("Point 10, 1: ")).unwrap();
    window.click(&point);
    window.until("the point's frames", |w| w.session().study.row == Some(3));
}

#[test]
fn a_run_of_other_data_says_so_and_offers_them() {
    let mut window = Window::open(2);
    let other = tempfile::tempdir().unwrap();
    blob::write_dataset(other.path(), 3);
    let manifest = blob::MANIFEST.replace("\"blob\"", "\"elsewhere\"");
    std::fs::write(other.path().join("dataset.toml"), manifest).unwrap();
    let dataset = Dataset::open(other.path(), &Progress::new()).unwrap();
    run_of(&dataset, &other.path().join("run"), StudyKind::Init, &[]);
    window.apply(Command::OpenRun(other.path().join("run/run.toml")));
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    shown(&mut window, StudyKind::Init);
    assert!(window.says("Another data set is open"));
    window.click("Open its data set");
    window.until("its data set", |w| w.session().data.dataset.as_ref().is_some_and(|d| d.info().name == "elsewhere"));
    window.harness.run_steps(3);
    assert!(!window.says("Another data set is open"));
}

#[test]
fn what_is_no_run_is_told() {
    let mut window = Window::open(2);
    window.choose("File", "Open study…");
    let nothing = window.folder.path().join("nothing");
    window.answer_path("Run folder", &nothing);
    window.until("the error", |w| w.session().log.iter().any(|line| line.level == LogLevel::Error));
    assert!(window.told("nothing/run.toml: cannot be read"));
    let damaged = window.folder.path().join("damaged");
    std::fs::create_dir_all(&damaged).unwrap();
    std::fs::write(damaged.join("run.toml"), "study = \"dance\"").unwrap();
    window.apply(Command::OpenRun(damaged));
    window.until("the second error", |w| w.told("damaged/run.toml"));
    assert!(window.session().study.shown().is_none());
}

#[test]
fn a_sweep_is_put_together_and_run_in_the_pane() {
    let mut window = Window::open(4);
    window.switch_live_off();
    window.apply(Command::SetConfig(Box::new(FitConfig { iterations: 5, ..Preset::Baseline.config() })));
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    window.harness.run_steps(3);
    assert!(window.says("25 variants × 4 frames = 100 fits"), "{:#?}", window.names());
    window.node("Values of setting 1").focus();
    window.harness.step();
    window.key_with(egui::Modifiers::COMMAND, egui::Key::A);
    window.type_text("0.1, 1, x");
    window.harness.run_steps(2);
    assert!(window.says("w_em is x; expected a number in"), "{:#?}", window.names());
    window.key_with(egui::Modifiers::COMMAND, egui::Key::A);
    window.type_text("0.1, 1");
    window.harness.run_steps(2);
    window.click("Setting 2");
    window.harness.run_steps(2);
    window.click("no second setting");
    window.harness.run_steps(2);
    assert!(window.says("2 variants × 4 frames = 8 fits"), "{:#?}", window.names());
    window.click("Run study");
    window.until("the table", |w| w.session().study.shown().is_some_and(|run| run.complete));
    window.harness.run_steps(3);
    assert!(window.named("Study row 0.1") && window.named("Study row 1") && window.named("New study"));
    // Its settings for the fit on screen: one act, that can be taken back.
    let before = window.session().config;
    window.click("Take settings of 1");
    assert_eq!((window.session().config.w_em, window.session().config.iterations), (1.0, 5));
    window.key_with(egui::Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(window.session().config, before);
    // A row's frames, kept as A; another row's as B.
    for (row, side) in [("0.1", "A"), ("1", "B")] {
        window.click(&format!("Study row {row}"));
        window.until("its frames", |w| {
            w.session().summaries.len() == 4 && w.session().results_name() == format!("sweep {row}")
        });
        window.click("A | B");
        window.harness.run_steps(2);
        window.click(&format!("Keep these as {side}"));
        window.harness.run_steps(2);
        window.key(egui::Key::Escape);
    }
    window.harness.run_steps(2);
    assert!(window.named("Sort by Difference of results"), "{:#?}", window.names());
}

/// Whatever the command line studies is chosen by name and run on the listed frames.
#[test]
fn every_study_of_the_command_line_is_run_from_the_pane() {
    let mut window = Window::open(3);
    window.switch_live_off();
    window.apply(Command::SetConfig(Box::new(FitConfig { iterations: 2, ..Preset::Baseline.config() })));
    window.at_rest();
    window.harness.state_mut().show_pane(Pane::called("Study").unwrap());
    window.harness.run_steps(3);
    for kind in StudyKind::ALL {
        if window.named("New study") {
            window.click("New study");
            window.harness.run_steps(2);
        }
        window.click("Which study");
        window.harness.run_steps(2);
        window.click(kind.word());
        window.harness.run_steps(2);
        window.click("Run study");
        window.until(kind.word(), |w| {
            let run = w.session().study.shown();
            !w.session().study.work.is_running() && run.is_some_and(|run| run.complete && run.spec.study == kind)
        });
        assert!(window.session().study.shown().unwrap().rows.iter().all(|row| row.fit.is_ok()), "{}", kind.word());
        window.harness.run_steps(3);
    }
}

#[test]
fn two_presets_are_compared_on_one_frame() {
    let mut window = Window::open(3);
    window.switch_live_off();
    let before = window.session().config;
    window.key_with(egui::Modifiers::SHIFT, egui::Key::C);
    window.until("both fits", |w| w.named("Take paper"));
    for what in [
        "Body fitted with paper, from the front and from above",
        "Body fitted with recommended, from the front and from above",
    ] {
        assert!(window.named(what), "{what}: {:#?}", window.names());
    }
    assert!(window.says("MAJPE") && window.says("PA-MAJPE") && window.says("IoU, mean of views"));
    window.key(egui::Key::N);
    assert_eq!(window.frame(), 0, "keys belong to the card");
    window.click("Take paper");
    assert_eq!(window.session().config, Preset::Paper.config());
    window.until("the card gone", |w| !w.named("Take paper"));
    assert!(!matches!(window.session().presets, PresetCard::Shown(_)));
    window.key_with(egui::Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(window.session().config, before, "one act");
}
