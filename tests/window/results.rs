//! Results of a batch in the window: the sheet, a dropped table, what the list then knows, and tables that are wrong.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::config::{FitConfig, Preset};
use mhp_inspector::session::{Command, LogLevel, Session};
use std::path::PathBuf;

const HEAD: &str = "frame,iterations,converged,reason,loss,em,iou_hori,iou_vert,majpe_mm";

fn until(window: &mut Window, what: &str, done: impl Fn(&Session) -> bool) {
    window.until(what, |w| done(w.session()));
}

fn write_table(window: &Window, name: &str, rows: &[&str]) -> PathBuf {
    let path = window.folder.path().join(name);
    std::fs::write(&path, format!("{HEAD}\n{}\n", rows.join("\n"))).unwrap();
    path
}

/// What the list shows under a filter: frames in its order.
fn filter(window: &mut Window, text: &str) -> Vec<u32> {
    window.apply(Command::SetFilter(text.into()));
    window.harness.step();
    window.session().queue.rows().to_vec()
}

const ROWS: [&str; 4] = [
    "frames/000,40,false,iterations,2.5,0.7,0.25,0.75,120.5",
    "frames/002,12,true,converged,1.5,0.4,0.9,,80",
    "frames/003,,,error: frames/003.npz: cannot be read,,,,,",
    "elsewhere/7,40,true,converged,1.0,0.2,0.8,0.8,",
];

#[test]
fn a_table_that_is_dropped_fills_the_list() {
    let mut window = Window::open(6);
    let table = write_table(&window, "summary.csv", &ROWS);
    window.drop_file(&table);
    until(&mut window, "the results", |s| s.summaries.len() == 3);
    let told = window.session().log.iter().rev().find(|line| line.text.contains("results of")).unwrap();
    assert!(told.text.contains("results of 3 of 6 frames; 1 rows are of frames that are not"), "{}", told.text);
    assert!(told.text.ends_with("elsewhere/7") && told.level == LogLevel::Info, "{}", told.text);
    let facts = window.session().frame_row(0);
    assert_eq!((facts.iou, facts.majpe_mm, facts.converged), (Some(0.5), Some(120.5), Some(false)));
    let second = window.session().frame_row(2);
    assert_eq!((second.iou, second.iterations, second.reason), (Some(0.9), Some(12), Some("converged")));
    assert_eq!(filter(&mut window, "iou<0.6"), [0]);
    assert_eq!(filter(&mut window, "converged:yes"), [2]);
    assert_eq!(filter(&mut window, "reason:error"), [3]);
    assert_eq!(filter(&mut window, "fitted:yes"), [0, 2]);
    assert!(window.session().summaries[&0].hashes.is_none(), "not fitted here");
}

#[test]
fn a_frame_that_was_fitted_here_keeps_its_own() {
    let mut window = Window::open(6);
    window.apply(Command::StepFit(3));
    until(&mut window, "three steps", |s| s.fit.head() == 3 && !s.fit.is_running());
    let own = window.session().summaries[&0].clone();
    let table = write_table(&window, "summary.csv", &ROWS);
    window.apply(Command::LoadResults(table));
    until(&mut window, "the results", |s| s.summaries.len() == 3);
    assert_eq!(window.session().summaries[&0], own);
    // To look at a frame of the table is not to fit it: what the table says stays.
    window.apply(Command::GotoFrame(2));
    until(&mut window, "frame 2", |s| s.fit.frame == 2 && s.fit.is_ready() && s.fit.shown.is_some());
    assert_eq!(window.session().frame_row(2).iou, Some(0.9));
    window.apply(Command::StepFit(1));
    until(&mut window, "a step", |s| s.fit.head() == 1 && !s.fit.is_running());
    assert_eq!(window.session().frame_row(2).iterations, Some(1));
    let foreign = write_table(&window, "summary.csv", &ROWS[3..]);
    window.apply(Command::LoadResults(foreign));
    until(&mut window, "that nothing matches", |s| s.log.iter().any(|line| line.text.contains("results of 0 of 6")));
    assert_eq!(window.session().frame_row(2).iterations, Some(1));
}

#[test]
fn the_sheet_takes_a_path() {
    let mut window = Window::open(6);
    let table = write_table(&window, "summary.csv", &ROWS);
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::K);
    window.harness.run_steps(2);
    window.harness.event(egui::Event::Text("load results".into()));
    window.harness.run_steps(2);
    window.harness.key_press(egui::Key::Enter);
    window.harness.run_steps(3);
    assert!(window.harness.query_all_by_label("Table of results").next().is_some());
    window.harness.event(egui::Event::Text(table.display().to_string()));
    window.harness.run_steps(2);
    window.harness.key_press(egui::Key::Enter);
    until(&mut window, "the results", |s| s.summaries.len() == 3);
    assert!(window.harness.query_all_by_label("Table of results").next().is_none(), "the sheet is closed");
}

#[test]
fn a_wrong_table_is_told_and_nothing_changes() {
    let mut window = Window::open(6);
    let wrong =
        |w: &Window| w.session().log.iter().rev().find(|l| l.level == LogLevel::Error).map(|line| line.text.clone());
    let row = |cells: &str| format!("{HEAD}\nframes/000,{cells}\n");
    for (text, expected) in [
        (row("40,maybe,iterations,2.5,0.7,0.25,0.75,"), "line 2: column converged is `maybe`; expected true or false"),
        (row("40,true,iterations,2.5,0.7,1.25,0.75,"), "line 2: column iou is 1.25; expected a number from 0 to 1"),
        (row("40,true,iterations,NaN,0.7,,,"), "line 2: column loss is NaN; expected a finite number"),
        (row("-4,true,iterations,2.5,0.7,,,"), "line 2: column iterations is `-4`; expected a whole number"),
        (row("40,true"), "line 2: it has 3 cells; expected 9"),
        (format!("{HEAD}\n,40,true,iterations,1,1,,,\n"), "line 2: column frame is empty"),
        ("name,loss\na,1\n".into(), "line 1: no column `frame` (the first is `name`)"),
        ("frame,tags\na,F1\n".into(), "line 1: it says nothing of fits"),
        ("frame,loss,loss\na,1,1\n".into(), "line 1: the column `loss` is there twice"),
        (String::new(), "line 1: no column `frame`"),
    ] {
        let path = window.folder.path().join("wrong.csv");
        std::fs::write(&path, text).unwrap();
        window.apply(Command::LoadResults(path));
        let before = window.session().log.len();
        until(&mut window, expected, |s| s.log.len() > before);
        let told = wrong(&window).unwrap_or_default();
        assert!(told.contains("wrong.csv") && told.contains(expected), "{told}");
        assert!(window.session().summaries.is_empty());
    }
    window.apply(Command::LoadResults("no/such/table.csv".into()));
    until(&mut window, "that it is missing", |s| {
        s.log.iter().any(|l| l.text.starts_with("no/such/table.csv: cannot be read"))
    });
}

/// Whether people were counted as annotated is known where as many are fitted as are counted, and not where somebody says how many.
#[test]
fn a_mismatch_is_of_the_count() {
    let mut window = Window::open(2);
    for (people, known) in [(1, false), (0, true)] {
        let config = FitConfig { people, iterations: 4, ..Preset::Baseline.config() };
        window.apply(Command::SetConfig(Box::new(config)));
        window.until("the fit on screen", |w| w.fit().is_ready());
        let before = window.session().batch.fitted();
        window.key_with(Modifiers::COMMAND, Key::Enter);
        window.until("the batch", |w| !w.session().batch.is_running() && w.session().batch.fitted() >= before.max(2));
        let (mismatch, summary) = (window.session().frame_row(1).mismatch, window.session().summaries.get(&1).cloned());
        assert_eq!(mismatch.is_some(), known, "{people} people: {summary:?}");
    }
    window.apply(Command::SetFilter("mismatch:no".into()));
    assert!(window.session().queue.rows().contains(&1));
}
