//! Settings under a finger: the fit follows, and what the finger did is one act.

use crate::blob;
use mhp_inspector::config::{FitConfig, LearningRates, Preset, Summation};
use mhp_inspector::session::{Command, FitStatus, Live, LiveFrom, RunSpeed, Runtime, Session, ViewState};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_mins(1);

/// A session with its threads on a data set of blobs, fitted by the baseline.
pub(crate) struct Rig {
    pub(crate) runtime: Runtime,
    _folder: tempfile::TempDir,
}

fn config() -> FitConfig {
    FitConfig { iterations: 12, ..Preset::Baseline.config() }
}

impl Rig {
    pub(crate) fn new(live: Live) -> Self {
        let folder = tempfile::tempdir().unwrap();
        blob::write_dataset(folder.path(), 2);
        let path = folder.path().to_owned();
        Self::on(&path, folder, live, &config())
    }

    fn on(path: &Path, folder: tempfile::TempDir, live: Live, config: &FitConfig) -> Self {
        let view = ViewState { live, ..ViewState::default() };
        let mut runtime = Runtime::new(Session::remembered(view, Vec::new()), Arc::new(|| ()), None);
        runtime.apply(Command::SetConfig(Box::new(*config)));
        runtime.apply(Command::Open(path.into()));
        let mut rig = Self { runtime, _folder: folder };
        rig.until("a fit that is ready", |s| s.fit.is_ready() && s.fit.shown.is_some());
        rig
    }

    pub(crate) fn session(&self) -> &Session {
        self.runtime.session()
    }

    pub(crate) fn until(&mut self, what: &str, done: impl Fn(&Session) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !done(self.session()) {
            let log: Vec<&str> = self.session().log.iter().map(|line| line.text.as_str()).collect();
            assert!(Instant::now() < deadline, "waited for {what}; {:?}; {log:#?}", self.session().fit.status);
            self.runtime.poll();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// The worker has done what it was asked, with the settings that hold.
    pub(crate) fn settled(&mut self) {
        self.until("the end of the fit", |s| {
            let shown = s.fit.shown.as_ref().map(|shown| (shown.iteration, shown.config));
            s.fit.status == FitStatus::Paused && shown == Some((s.fit.head(), s.config))
        });
    }

    fn drag(&mut self, w_em: f64) {
        let config = FitConfig { w_em, ..self.session().config };
        self.runtime.apply(Command::DragConfig(Box::new(config)));
        self.runtime.poll();
    }

    pub(crate) fn lines(&self, text: &str) -> usize {
        self.session().log.iter().filter(|line| line.text.contains(text)).count()
    }
}

#[test]
fn a_drag_is_one_branch_one_line_and_one_act() {
    let mut rig = Rig::new(Live::On);
    rig.runtime.apply(Command::ToggleRun);
    rig.settled();
    let plain = rig.session().fit.shown.clone().unwrap();
    for k in 0..=30 {
        rig.drag(0.5 + 0.1 * f64::from(k));
    }
    assert!(rig.session().is_dragging());
    rig.runtime.apply(Command::EndDrag);
    rig.settled();
    let fit = &rig.session().fit;
    let branches: Vec<_> =
        fit.history.branches().iter().map(|b| (b.id, b.parent, b.config.w_em, b.rows.len())).collect();
    assert_eq!(branches, [(0, None, 0.5, 13), (1, Some((0, 0)), 3.5, 13)], "the whole fit anew, on one branch");
    assert_eq!((rig.lines("w_EM 0.5 → 3.5"), rig.lines("w_EM")), (1, 1), "{:?}", rig.session().log);
    assert_eq!(rig.session().undo_name(), Some("w_EM 0.5 → 3.5"));
    // As if it had been fitted with these settings from the start.
    assert_eq!(fit.history.flags(), [(0, "w_EM 0.5 → 3.5".to_owned())], "one flag");
    let dragged = fit.shown.clone().unwrap();
    let mut alone = Rig::new(Live::Off);
    alone.runtime.apply(Command::SetConfig(Box::new(FitConfig { w_em: 3.5, ..config() })));
    alone.runtime.apply(Command::ToggleRun);
    alone.settled();
    assert_eq!(alone.session().fit.shown.as_ref().unwrap().params, dragged.params);
    assert_ne!(plain.params, dragged.params);

    rig.runtime.apply(Command::Undo);
    rig.settled();
    let session = rig.session();
    assert_eq!((session.config.w_em, session.fit.history.active_id()), (0.5, 0));
    assert_eq!(session.fit.shown.as_ref().unwrap().params, plain.params);
    assert_eq!((session.undo_name(), session.redo_name()), (None, Some("w_EM 0.5 → 3.5")));
    rig.runtime.apply(Command::Redo);
    rig.settled();
    assert_eq!((rig.session().config.w_em, rig.session().fit.history.active_id()), (3.5, 1));
    assert_eq!(rig.session().fit.shown.as_ref().unwrap().params, dragged.params);
}

/// In a window of frames too: what a finger leaves is the fit that these settings give, wherever it had been before, and going
/// back is going back to the last digit.
#[test]
fn a_dragged_fit_of_a_window_is_that_of_its_settings() {
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk");
    let recommended = FitConfig { iterations: 12, ..Preset::Recommended.config() };
    let rig = |live| Rig::on(&sample, tempfile::tempdir().unwrap(), live, &recommended);
    let mut dragged = rig(Live::On);
    dragged.runtime.apply(Command::ToggleRun);
    dragged.settled();
    let (plain, row) = {
        let fit = &dragged.session().fit;
        (fit.shown.clone().unwrap(), fit.shown_row().unwrap().report.clone())
    };
    for w_em in [0.8, 2.0, 1.3] {
        let config = FitConfig { w_em, ..dragged.session().config };
        dragged.runtime.apply(Command::DragConfig(Box::new(config)));
        dragged.settled();
    }
    dragged.runtime.apply(Command::EndDrag);
    dragged.settled();
    let mut alone = rig(Live::On);
    alone.runtime.apply(Command::SetConfig(Box::new(FitConfig { w_em: 1.3, ..recommended })));
    alone.settled();
    let of = |rig: &Rig| rig.session().fit.shown.clone().unwrap();
    assert_eq!(of(&dragged).params, of(&alone).params);
    assert_eq!(of(&dragged).evaluation.loss, of(&alone).evaluation.loss);
    dragged.runtime.apply(Command::Undo);
    dragged.settled();
    let back = of(&dragged);
    assert_eq!((&back.params, back.evaluation.loss), (&plain.params, plain.evaluation.loss));
    assert_eq!(back.evaluation.loss, row.loss, "what is shown is what the curve says");
}

/// By itself a fit follows a finger where it takes less than 50 ms.
#[test]
fn live_is_on_by_itself_where_a_fit_is_quick() {
    let mut rig = Rig::new(Live::Auto);
    let ms = rig.session().fit_ms().unwrap();
    assert!(rig.session().is_live() == (ms < Live::QUICK_MS) && ms > 0.0, "{ms} ms");
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { iterations: 100_000, ..config() })));
    assert!(rig.session().fit_ms().unwrap() > Live::QUICK_MS && !rig.session().is_live());
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { iterations: 1, ..config() })));
    assert!(rig.session().is_live(), "{:?} ms", rig.session().fit_ms());
}

/// A choice is an act at once: a fit anew with the other answer, on a branch of its own.
#[test]
fn a_choice_fits_anew_too() {
    let mut rig = Rig::new(Live::On);
    rig.drag(0.9);
    rig.runtime.apply(Command::EndDrag);
    rig.settled();
    let before = rig.session().fit.shown.as_ref().unwrap().params.clone();
    let other = FitConfig { summation: Summation::Incoherent, ..rig.session().config };
    assert_ne!(other, rig.session().config);
    rig.runtime.apply(Command::SetConfig(Box::new(other)));
    rig.settled();
    let session = rig.session();
    assert_eq!((session.fit.history.branches().len(), session.fit.head()), (3, config().iterations));
    assert_ne!(session.fit.shown.as_ref().unwrap().params, before);
    assert!(session.undo_name().is_some_and(|name| name.contains("incoherent")), "{:?}", session.undo_name());
}

#[test]
fn a_finger_that_comes_back_did_nothing() {
    let mut rig = Rig::new(Live::On);
    for w_em in [0.9, 2.0, 0.5] {
        rig.drag(w_em);
    }
    rig.runtime.apply(Command::EndDrag);
    rig.settled();
    let session = rig.session();
    assert_eq!((session.fit.history.branches().len(), session.fit.head(), session.undo_name()), (1, 0, None));
    assert_eq!(rig.lines("w_EM"), 0);
}

#[test]
fn a_live_fit_begins_at_the_iteration_on_screen_where_that_is_chosen() {
    let mut rig = Rig::new(Live::On);
    rig.runtime.apply(Command::SetView(Box::new(ViewState {
        live: Live::On,
        live_from: LiveFrom::Shown,
        ..ViewState::default()
    })));
    rig.runtime.apply(Command::ToggleRun);
    rig.settled();
    rig.runtime.apply(Command::GotoIteration(5));
    rig.drag(2.0);
    rig.drag(2.5);
    rig.runtime.apply(Command::EndDrag);
    rig.settled();
    let branch = rig.session().fit.branch().unwrap();
    assert_eq!((branch.parent, branch.start(), branch.head()), (Some((0, 5)), 5, 12));
}

/// Off, settings count from the next step on; a drag is one act all the same.
#[test]
fn a_drag_that_is_not_live_is_one_flag() {
    let mut rig = Rig::new(Live::Off);
    rig.runtime.apply(Command::ToggleRun);
    rig.settled();
    for k in 1..=10 {
        rig.drag(0.5 + 0.1 * f64::from(k));
    }
    rig.runtime.apply(Command::EndDrag);
    rig.settled();
    let branch = rig.session().fit.branch().unwrap();
    assert_eq!((branch.id, branch.head()), (0, 12));
    let flags: Vec<&str> = branch.flags.iter().map(|flag| flag.text.as_str()).collect();
    assert_eq!((flags, rig.lines("w_EM 0.5 → 1.5"), rig.lines("w_EM")), (vec!["w_EM 0.5 → 1.5"], 1, 1));
    rig.runtime.apply(Command::Undo);
    rig.settled();
    assert_eq!(rig.session().config.w_em, 0.5);
}

#[test]
fn the_iterations_asked_for_end_a_run_that_is_past_them() {
    let mut rig = Rig::new(Live::Off);
    rig.runtime.apply(Command::SetView(Box::new(ViewState {
        live: Live::Off,
        speed: RunSpeed::Hundred,
        ..ViewState::default()
    })));
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { iterations: 100_000, ..config() })));
    rig.runtime.apply(Command::ToggleRun);
    rig.until("a few iterations", |s| s.fit.head() >= 3);
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { iterations: 2, ..config() })));
    rig.until("the end of the run", |s| s.fit.status == FitStatus::Paused);
    assert!(rig.session().fit.head() < 1000, "{}", rig.session().fit.head());
}

#[test]
fn a_run_is_as_slow_as_it_is_watched_and_can_be_seen_again() {
    let mut rig = Rig::new(Live::Off);
    rig.runtime.apply(Command::SetView(Box::new(ViewState {
        live: Live::Off,
        speed: RunSpeed::Ten,
        ..ViewState::default()
    })));
    let began = Instant::now();
    rig.runtime.apply(Command::ToggleRun);
    rig.until("four iterations", |s| s.fit.head() >= 4);
    assert!(began.elapsed() >= Duration::from_millis(250), "ten a second: {:?}", began.elapsed());
    rig.runtime.apply(Command::SetView(Box::new(ViewState {
        live: Live::Off,
        speed: RunSpeed::Max,
        ..ViewState::default()
    })));
    rig.until("the end of the run", |s| s.fit.status == FitStatus::Paused);
    let head = rig.session().fit.head();
    rig.runtime.apply(Command::ToggleReplay);
    assert_eq!(rig.session().fit.shown_iteration(), 0);
    // At full speed a replay takes a second, however long the run.
    rig.runtime.apply(Command::PlayOn(0.5));
    assert_eq!(rig.session().fit.shown_iteration(), head / 2);
    rig.runtime.apply(Command::PlayOn(0.6));
    assert_eq!((rig.session().fit.shown_iteration(), rig.session().fit.replay), (head, None));
}

/// What only a start reads asks for a new one, and says so.
#[test]
fn settings_of_the_start_are_told_to_need_a_new_one() {
    let mut rig = Rig::new(Live::On);
    rig.runtime.apply(Command::ToggleRun);
    rig.settled();
    assert!(!rig.session().needs_new_start());
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { people: 2, ..config() })));
    rig.settled();
    assert!(rig.session().needs_new_start());
    rig.runtime.apply(Command::Undo);
    rig.settled();
    assert!(!rig.session().needs_new_start());
    rig.runtime.apply(Command::Redo);
    rig.runtime.apply(Command::Reset);
    rig.settled();
    assert!(!rig.session().needs_new_start());
}

/// A loss that is flat because steps are tiny is no fit that has settled: the gradient is as large as it was.
#[test]
fn a_fit_with_tiny_steps_has_not_settled() {
    for (position, settled) in [(1e-6, Some(false)), (0.0, Some(true))] {
        let folder = tempfile::tempdir().unwrap();
        blob::write_dataset(folder.path(), 1);
        let path = folder.path().to_owned();
        let learning_rates = LearningRates { position: Some(position), ..LearningRates::default() };
        let slow = FitConfig { learning_rate: 1e-6, learning_rates, iterations: 9, ..config() };
        let mut rig = Rig::on(&path, folder, Live::Off, &slow);
        rig.runtime.apply(Command::ToggleRun);
        rig.until("nine iterations", |s| s.fit.head() == 9 && s.fit.status == FitStatus::Paused);
        assert_eq!(rig.session().fit.settled(), None, "too few to tell");
        rig.runtime.apply(Command::StepFit(1));
        rig.until("the tenth", |s| s.fit.head() == 10 && s.fit.status == FitStatus::Paused);
        let losses = [0, 10].map(|at| rig.session().fit.branch().unwrap().row(at).unwrap().report.loss);
        assert!((losses[1] / losses[0] - 1.0).abs() < 1e-3, "flat: {losses:?}");
        assert_eq!(rig.session().fit.settled(), settled, "at {position}");
    }
}
