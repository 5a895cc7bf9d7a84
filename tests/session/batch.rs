//! Fits of many frames from the window: into the list as they come, stopped, gone on with, found again.

use crate::blob;
use mhp_inspector::config::{FitConfig, Preset};
use mhp_inspector::session::{
    Command, ComparedNumber, FrameSummary, Live, ResultSide, Runtime, Session, StudyOrder, ViewState, WorkStatus,
};
use mhp_inspector::study::run::{Run, StudyKind};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_mins(1);

fn config() -> FitConfig {
    FitConfig { iterations: 5, ..Preset::Baseline.config() }
}

fn opened(folder: &Path, config: &FitConfig) -> Runtime {
    // A fit by hand would keep its own numbers.
    let view = ViewState { live: Live::Off, ..ViewState::default() };
    let mut runtime = Runtime::new(Session::remembered(view, Vec::new()), Arc::new(|| ()), None);
    runtime.apply(Command::SetConfig(Box::new(*config)));
    runtime.apply(Command::SetAnnotator("ada".into()));
    runtime.apply(Command::Open(folder.into()));
    until(&mut runtime, "a fit that is ready", |s| s.fit.is_ready() && !s.queue.rows().is_empty());
    runtime
}

fn until(runtime: &mut Runtime, what: &str, done: impl Fn(&Session) -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !done(runtime.session()) {
        let session = runtime.session();
        let log: Vec<&str> = session.log.iter().map(|line| line.text.as_str()).collect();
        assert!(Instant::now() < deadline, "waited for {what}; {:?}; {log:#?}", session.batch.work.status);
        runtime.poll();
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn fitted(session: &Session) -> Vec<usize> {
    session.summaries.iter().filter(|(_, summary)| summary.batch).map(|(&frame, _)| frame).collect()
}

#[test]
fn listed_frames_are_fitted_kept_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 9);
    let mut runtime = opened(folder.path(), &config());
    // A selection is fitted alone.
    runtime.apply(Command::SelectFrames([2, 5].into()));
    runtime.apply(Command::FitListed);
    assert!(runtime.session().batch.is_running());
    until(&mut runtime, "two fits", |s| !s.batch.is_running());
    assert_eq!(fitted(runtime.session()), [2, 5]);
    runtime.apply(Command::SelectFrames([].into()));
    runtime.apply(Command::FitListed);
    until(&mut runtime, "all fits", |s| !s.batch.is_running());
    let session = runtime.session();
    assert_eq!(fitted(session), (0..9).collect::<Vec<_>>());
    let summary = &session.summaries[&4];
    assert!(summary.iou.is_some() && summary.majpe_mm.is_some() && summary.iterations == Some(5), "{summary:?}");
    assert_eq!(session.batch.stale(&session.config, session.precision), None);
    // Joints are not kept: predictions are compared with fits of the same visit.
    assert_eq!(summary.joints.as_ref().map(|joints| joints.len()), Some(17));
    let all: Vec<_> =
        session.summaries.values().map(|summary| FrameSummary { joints: None, ..summary.clone() }).collect();
    drop(runtime);

    // Another day.
    let mut runtime = opened(folder.path(), &config());
    until(&mut runtime, "the kept fits", |s| s.batch.fitted() == 9);
    assert!(all.iter().eq(runtime.session().summaries.values()), "to the last digit");
    // With other settings they are told to be others'; a new batch takes their place.
    let other = FitConfig { w_em: 2.0, ..config() };
    let precision = runtime.session().precision;
    runtime.apply(Command::SetConfig(Box::new(other)));
    assert_eq!(runtime.session().batch.stale(&other, precision).as_deref(), Some("with w_EM 2 → 0.5"));
    runtime.apply(Command::FitListed);
    assert_eq!(fitted(runtime.session()), [0; 0], "two settings are not mixed in one list");
    until(&mut runtime, "all fits", |s| !s.batch.is_running());
    assert_eq!((runtime.session().batch.stale(&other, precision), fitted(runtime.session()).len()), (None, 9));
    // Back to the first ones: nothing is fitted, all of it is there.
    runtime.apply(Command::SetConfig(Box::new(config())));
    let began = runtime.session().log.len();
    runtime.apply(Command::FitListed);
    until(&mut runtime, "the kept ones", |s| !s.batch.is_running());
    assert!(all.iter().eq(runtime.session().summaries.values()), "{began}");
}

#[test]
fn a_batch_waits_stops_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 40);
    let config = FitConfig { iterations: 60, ..config() };
    let mut runtime = opened(folder.path(), &config);
    runtime.apply(Command::FitListed);
    until(&mut runtime, "some fits", |s| matches!(s.batch.work.status, WorkStatus::Running { done: 1.., .. }));
    runtime.apply(Command::PauseBatch);
    std::thread::sleep(Duration::from_millis(300));
    runtime.poll();
    let waiting = fitted(runtime.session()).len();
    std::thread::sleep(Duration::from_millis(300));
    runtime.poll();
    let WorkStatus::Running { paused: true, .. } = runtime.session().batch.work.status else {
        unreachable!("{:?}", runtime.session().batch.work.status)
    };
    // One row may have been on its way.
    assert!(fitted(runtime.session()).len() <= waiting + 1 && waiting < 40, "{waiting}");
    runtime.apply(Command::PauseBatch);
    until(&mut runtime, "another fit", |s| fitted(s).len() > waiting + 1);
    runtime.apply(Command::CancelBatch);
    until(&mut runtime, "the end", |s| !s.batch.is_running());
    let there = fitted(runtime.session()).len();
    assert!(there < 40, "stopped before the end");
    assert!(runtime.session().log.back().unwrap().text.starts_with(&format!("stopped after {there} of 40 frames")));
    drop(runtime);

    let mut runtime = opened(folder.path(), &config);
    until(&mut runtime, "the kept fits", |s| s.batch.fitted() == there);
    runtime.apply(Command::FitListed);
    until(&mut runtime, "the others", |s| !s.batch.is_running());
    assert_eq!((fitted(runtime.session()).len(), runtime.session().batch.fitted()), (40, 40), "no frame counts twice");
}

/// A data set that nobody can fit fills the list with the reason.
#[test]
fn frames_that_cannot_be_fitted_say_why() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 3);
    let mut runtime = opened(folder.path(), &config());
    std::fs::write(runtime.session().data.dataset.as_ref().unwrap().frame_path(1), b"no array").unwrap();
    runtime.apply(Command::FitListed);
    until(&mut runtime, "the end", |s| !s.batch.is_running());
    let session = runtime.session();
    assert_eq!((session.batch.fitted(), session.batch.failed()), (2, 1));
    let why = session.summaries[&1].reason.clone().unwrap();
    assert!(why.starts_with("error: "), "{why}");
    assert!(session.log.back().unwrap().text.contains("1 could not be fitted"), "{:?}", session.log.back());
}

fn sweep(axes: &[&str]) -> Command {
    let grid = axes.iter().map(|axis| axis.parse().unwrap()).collect();
    Command::RunStudy(StudyOrder { study: StudyKind::Sweep, grid })
}

/// The same rows as on the command line, in a folder beside the labels; the table is there while it grows.
#[test]
fn a_sweep_of_the_listed_frames_grows_stops_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 12);
    let mut runtime = opened(folder.path(), &config());
    runtime.apply(Command::SetFilter("-index<2".into()));
    runtime.apply(Command::SelectFrames([1, 4, 5, 9].into()));
    runtime.apply(sweep(&["w_em=0.1,1"]));
    until(&mut runtime, "the end", |s| !s.study.work.is_running());
    let run = runtime.session().study.shown().unwrap();
    assert!(run.complete && run.rows.len() == 8 && run.table.len() == 2, "{:?}", run.table);
    assert_eq!(run.spec.data.asked(), "1,4..6,9");
    assert_eq!(run.spec.base, "baseline, Iterations 100 → 5");
    let (shown, _) = runtime.session().study.run.as_ref().unwrap();
    assert!(shown.starts_with(folder.path().join("mhp-labels/studies")), "{}", shown.display());
    assert_eq!(&Run::read(shown).unwrap(), run, "what is on screen is what is on disk");

    // All that match, stopped half way.
    runtime.apply(Command::SelectFrames([].into()));
    runtime.apply(sweep(&["w_em=0.1,0.5,1", "iterations=200,300"]));
    until(&mut runtime, "a table that grows", |s| s.study.shown().is_some_and(|run| run.table.len() == 6));
    assert!(!runtime.session().study.shown().unwrap().complete);
    runtime.apply(sweep(&["w_em=0.1"]));
    assert!(runtime.session().log.back().unwrap().text.contains("under way"));
    runtime.apply(Command::PauseStudy);
    let WorkStatus::Running { paused: true, .. } = runtime.session().study.work.status else {
        unreachable!("{:?}", runtime.session().study.work.status)
    };
    runtime.apply(Command::CancelStudy);
    until(&mut runtime, "the end", |s| !s.study.work.is_running());
    let told = &runtime.session().log.back().unwrap().text;
    assert!(told.starts_with("sweep: stopped after") && told.ends_with("goes on from there"), "{told}");
    let before = runtime.session().study.shown().unwrap().rows.clone();
    assert!(!before.is_empty() && before.len() < 60);
    runtime.apply(sweep(&["w_em=0.1,0.5,1", "iterations=200,300"]));
    until(&mut runtime, "the end", |s| !s.study.work.is_running());
    let run = runtime.session().study.shown().unwrap();
    assert!(run.complete && run.rows.len() == 60);
    let mut times = before.iter().map(|row| (row.variant, row.frame, row.fit_ms));
    assert!(times.all(|known| run.rows.iter().any(|row| (row.variant, row.frame, row.fit_ms) == known)), "not again");
}

#[test]
fn what_cannot_be_studied_is_told() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 3);
    let mut runtime = opened(folder.path(), &config());
    for (axes, told) in [
        (&["tau_pct=500"] as &[&str], "tau_pct is 500; expected a number in 0.1 ..= 100"),
        (&["nothing=1"], "unknown key `nothing`"),
        (&[], "at least one"),
    ] {
        runtime.apply(sweep(axes));
        let text = &runtime.session().log.back().unwrap().text;
        assert!(text.contains(told) && !runtime.session().study.work.is_running(), "{text}");
    }
    runtime.apply(Command::SetFilter("iou>2".into()));
    runtime.apply(sweep(&["w_em=1"]));
    assert!(runtime.session().log.back().unwrap().text.contains("nothing to study"));
}

#[test]
fn results_are_kept_as_a_and_b_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 6);
    let mut runtime = opened(folder.path(), &config());
    runtime.apply(Command::KeepResults(ResultSide::A));
    assert!(runtime.session().log.back().unwrap().text.contains("nothing to keep"));
    runtime.apply(Command::FitListed);
    until(&mut runtime, "the fits", |s| !s.batch.is_running());
    runtime.apply(Command::KeepResults(ResultSide::A));
    let other = Preset::Baseline.config();
    runtime.apply(Command::SetConfig(Box::new(other)));
    runtime.apply(Command::FitListed);
    until(&mut runtime, "the fits", |s| !s.batch.is_running());
    runtime.apply(Command::KeepResults(ResultSide::B));
    let session = runtime.session();
    assert_eq!(session.results.get(ResultSide::A).unwrap().name, "baseline, Iterations 100 → 5");
    assert_eq!(session.results.get(ResultSide::B).unwrap().name, "baseline");
    let found = session.results.difference(ComparedNumber::Loss).unwrap();
    assert!(found.frames == 6 && found.mean < 0.0 && found.better > 3, "{found:?}");
    let mut view = ViewState { compared: ComparedNumber::Loss, ..session.view.clone() };
    view.sort = mhp_inspector::session::Sort { key: mhp_inspector::session::SortKey::Difference, descending: false };
    runtime.apply(Command::SetView(Box::new(view)));
    runtime.apply(Command::SetFilter("diff<0 b<100".into()));
    let session = runtime.session();
    assert_eq!(session.queue.rows().len(), found.better);
    let differences: Vec<f64> = session
        .queue
        .rows()
        .iter()
        .map(|&row| session.frame_row(row as usize))
        .map(|row| row.results[1].unwrap() - row.results[0].unwrap())
        .collect();
    assert!(differences.is_sorted(), "{differences:?}");
    runtime.apply(Command::ForgetResults(ResultSide::A));
    assert_eq!(runtime.session().queue.rows().len(), 0, "what is not known satisfies no comparison");
}

/// A file that changed under its name is other data: what was fitted of it is no result any more.
#[test]
fn fits_of_files_that_changed_are_done_again() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 3);
    let mut runtime = opened(folder.path(), &config());
    runtime.apply(Command::FitListed);
    until(&mut runtime, "all fits", |s| !s.batch.is_running() && s.batch.fitted() == 3);
    drop(runtime);
    let frame = std::fs::read_dir(folder.path().join("frames")).unwrap().next().unwrap().unwrap().path();
    let file = std::fs::OpenOptions::new().append(true).open(frame).unwrap();
    file.set_modified(std::time::SystemTime::now() + Duration::from_secs(5)).unwrap();
    drop(file);
    let mut runtime = opened(folder.path(), &config());
    // One frame is read by the fits of all three.
    until(&mut runtime, "what is stale", |s| s.log.iter().any(|line| line.text.contains("3 fits are stale")));
    assert_eq!((runtime.session().batch.fitted(), fitted(runtime.session())), (0, vec![]));
    runtime.apply(Command::FitListed);
    until(&mut runtime, "all fits", |s| !s.batch.is_running() && s.batch.fitted() == 3);
}
