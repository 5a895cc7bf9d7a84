//! `Session::apply` without threads: commands and reports in, effects and state out.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use crate::{SLOW_MS, dataset};
use mhp_inspector::body::{Group, Pppr};
use mhp_inspector::config::{FIELDS, Field, FieldKind, FitConfig, Number, ReadBy, Value};
use mhp_inspector::dataset::{BareCatalog, BareChoice, ChirpForm, Dataset, DatasetError};
use mhp_inspector::mhp::{Adam, Evaluation, FitState, StepReport, StopReason, Terms, initialise};
use mhp_inspector::session::{
    Command, Effect, FitStatus, History, IterationRow, LogLevel, Notice, PickKind, Report, Session, ThemeChoice,
    ViewState,
};
use mhp_inspector::start::problem_alone;
use mhp_inspector::worker::{
    HistoryRow, JobId, Kept, Prepare, PreparedFit, Snapshot, Start, WorkerCommand, WorkerEvent, WorkerMessage,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A session on a data set of four frames, and what the worker would answer.
pub(crate) struct Bench {
    pub(crate) session: Session,
    dataset: Arc<Dataset>,
    pub(crate) params: Pppr,
    folder: tempfile::TempDir,
}

/// Labels, strata and evidence are tested elsewhere.
fn of_data_and_fit(mut effects: Vec<Effect>) -> Vec<Effect> {
    effects.retain(|effect| {
        !matches!(
            effect,
            Effect::OpenLabels { .. }
                | Effect::RefreshLabels
                | Effect::ComputeStrata { .. }
                | Effect::CancelStrata
                | Effect::Evidence(_)
                | Effect::FindKept(_)
        )
    });
    effects
}

impl Bench {
    /// Frame 0 is on screen and its fit is ready at iteration 0.
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let dataset = dataset(folder.path(), 4);
        let frame = dataset.load(0).unwrap();
        let problem = Arc::new(problem_alone(&dataset, &frame).unwrap());
        let params = initialise(&problem, &FitConfig::default()).unwrap().params;
        let mut bench = Self { session: Session::default(), dataset, params, folder };
        let effects = bench.report(Report::Opened(bench.folder.path().into(), Ok(Arc::clone(&bench.dataset))));
        assert!(matches!(&effects[..], [Effect::UseDataset(_), Effect::Load(0)]), "{effects:?}");
        let prepare = bench.load(0);
        bench.answer(prepare);
        bench
    }

    /// Another data set is opened, and the fit of its first frame is ready.
    pub(crate) fn open_another(&mut self) {
        let folder = tempfile::tempdir().unwrap();
        self.dataset = dataset(folder.path(), 4);
        self.folder = folder;
        self.report(Report::Opened(self.folder.path().into(), Ok(Arc::clone(&self.dataset))));
        let prepare = self.load(0);
        self.answer(prepare);
    }

    /// What follows for data and fit of what a person asks.
    pub(crate) fn apply(&mut self, command: Command) -> Vec<Effect> {
        of_data_and_fit(self.session.apply(command))
    }

    /// What follows for data and fit of what a thread tells.
    pub(crate) fn report(&mut self, report: Report) -> Vec<Effect> {
        of_data_and_fit(self.session.report(report))
    }

    /// The frame that was asked for arrives; answers what the worker is told.
    fn load(&mut self, index: usize) -> Prepare {
        let frame = Arc::new(self.dataset.load(index).unwrap());
        let effects = self.report(Report::FrameLoaded(index, Ok(frame)));
        prepare_of(effects)
    }

    pub(crate) fn goto(&mut self, index: usize) -> Prepare {
        let effects = self.apply(Command::GotoFrame(index));
        assert!(matches!(effects[..], [Effect::Load(i)] if i == index), "{effects:?}");
        self.load(index)
    }

    /// The worker answers a preparation.
    pub(crate) fn answer(&mut self, prepare: Prepare) {
        let Prepare { job, branch, dataset, frame, start, .. } = prepare;
        let problem = Arc::new(problem_alone(&dataset, &frame).unwrap());
        let (initial, resumed) = match start {
            Start::Initialise | Start::Along => (self.params.clone(), false),
            Start::Warm(params) => (params, false),
            Start::Given(start) => (start.params, false),
            Start::Resume { initial, .. } => (initial, true),
        };
        if !resumed {
            self.rows(job, branch, 0..=0);
        }
        let prepared =
            PreparedFit { problem, found_start: None, initial, warnings: Vec::new(), init_ms: 1.5, step_ms: SLOW_MS };
        self.event(job, WorkerEvent::Prepared(Box::new(prepared)));
        assert_eq!(self.session.fit.status, FitStatus::Paused);
    }

    fn state(&self, iteration: usize) -> Arc<FitState> {
        let mut params = self.params.clone();
        params.group_mut(Group::Position)[0] += 0.001 * iteration as f64;
        let adam = Adam::new(params.shape());
        Arc::new(FitState {
            iteration,
            params,
            adam,
            motion: mhp_inspector::mhp::MotionState::default(),
            given: Vec::new(),
            losses: vec![loss(iteration)].into(),
        })
    }

    fn rows(&mut self, job: JobId, branch: u32, iterations: std::ops::RangeInclusive<usize>) {
        let rows =
            iterations.map(|k| HistoryRow { branch, report: report(k), kept: Kept::State(self.state(k)) }).collect();
        assert!(self.report(Report::Worker(WorkerMessage::Rows(job, rows))).is_empty());
    }

    fn event(&mut self, job: JobId, event: WorkerEvent) -> Vec<Effect> {
        self.report(Report::Worker(WorkerMessage::Event(job, event)))
    }

    fn job(&self) -> JobId {
        self.session.fit.job
    }

    /// Runs the active branch to an iteration.
    pub(crate) fn run_to(&mut self, last: usize) {
        let (job, branch, head) = (self.job(), self.session.fit.history.active_id(), self.session.fit.head());
        self.apply(Command::StepFit(last - head));
        self.rows(job, branch, head + 1..=last);
        self.finished(branch, last);
    }

    fn finished(&mut self, branch: u32, iteration: usize) {
        let reason = StopReason::Iterations;
        let run = self.session.fit.run.0;
        self.event(self.job(), WorkerEvent::Finished { run, branch, iteration, reason, run_ms: 3.0 });
    }

    fn snapshot(&mut self, job: JobId, branch: u32, iteration: usize, live: bool) {
        let params = self.state(iteration).params.clone();
        let zeros = Evaluation::zeros(params.shape());
        let evaluation = Evaluation { loss: loss(iteration), iou: vec![None; 2].into(), ..zeros };
        let config = FitConfig::default();
        let (h_sim, masks) = (Vec::new(), Vec::new());
        let iterations_per_s = 0.0;
        let snapshot =
            Snapshot { job, branch, iteration, live, config, params, evaluation, h_sim, masks, iterations_per_s };
        assert!(self.report(Report::Snapshot(Box::new(snapshot))).is_empty());
    }

    fn shown(&self) -> Option<(u32, usize)> {
        self.session.fit.shown.as_ref().map(|shown| (shown.branch, shown.iteration))
    }

    fn errors(&self) -> Vec<&str> {
        self.session.log.iter().filter(|l| l.level == LogLevel::Error).map(|l| l.text.as_str()).collect()
    }
}

fn loss(iteration: usize) -> f64 {
    5.0 / (1.0 + iteration as f64)
}

fn report(iteration: usize) -> StepReport {
    let iou = vec![Some(0.5), Some(0.25)].into();
    StepReport { iteration, loss: loss(iteration), terms: Terms::default(), iou, converged: false }
}

fn prepare_of(effects: Vec<Effect>) -> Prepare {
    let shown = format!("{effects:?}");
    let prepare = effects.into_iter().find_map(|effect| match effect {
        Effect::Send(WorkerCommand::Prepare(prepare)) => Some(*prepare),
        _ => None,
    });
    prepare.unwrap_or_else(|| panic!("no preparation in {shown:.300}"))
}

fn sent(effects: &[Effect]) -> &WorkerCommand {
    match effects {
        [Effect::Send(command)] => command,
        other => panic!("one command for the worker, not {other:?}"),
    }
}

#[test]
fn opening_shows_progress_and_then_the_first_frame() {
    let mut session = Session::default();
    let effects = session.apply(Command::Pick(PickKind::Folder));
    assert!(matches!(effects[..], [Effect::Pick(PickKind::Folder)]));
    let effects = session.apply(Command::Open("/somewhere".into()));
    assert!(matches!(&effects[..], [Effect::Open(path)] if path == Path::new("/somewhere")));
    session.report(Report::OpenProgress { stage: "listing".into(), done: 3, total: 9 });
    let opening = session.data.opening.as_ref().unwrap();
    assert_eq!((opening.stage.as_str(), opening.done, opening.total), ("listing", 3, 9));
    assert!(matches!(session.apply(Command::CancelOpen)[..], [Effect::CancelOpen]));
    assert_eq!(session.data.opening, None);
    session.report(Report::OpenProgress { stage: "late".into(), done: 4, total: 9 });
    assert_eq!(session.data.opening, None, "late progress of what was cancelled");

    let bench = Bench::new();
    assert_eq!((bench.session.data.len(), bench.session.data.frame_index), (4, 0));
    assert_eq!(bench.session.data.frame.as_ref().unwrap().index, 0);
    assert_eq!(bench.session.fit.shown_iteration(), 0);
    let majpe = bench.session.fit.shown_row().unwrap().majpe_mm.unwrap();
    assert!((1.0..500.0).contains(&majpe), "the data set has truth: {majpe}");
    assert!(bench.session.summaries.is_empty(), "a start pose is no fit");
}

#[test]
fn an_error_while_opening_keeps_what_is_on_screen() {
    let mut bench = Bench::new();
    bench.run_to(3);
    let job = bench.job();
    bench.apply(Command::Open("/gone".into()));
    assert!(bench.session.data.frame.is_some() && bench.session.data.dataset.is_some());
    let effects = bench.report(Report::Opened("/gone".into(), Err(DatasetError::NotFound { path: "/gone".into() })));
    assert!(effects.is_empty());
    assert_eq!(bench.errors(), ["/gone: no such file or folder"]);
    let Notice { count, level, text, .. } = bench.session.notice.clone().unwrap();
    assert_eq!((level, text.as_str()), (LogLevel::Error, "/gone: no such file or folder"));
    assert_eq!((bench.session.data.opening.clone(), bench.job(), bench.session.fit.head()), (None, job, 3));
    assert!(!bench.session.data.recent.contains(&PathBuf::from("/gone")), "what cannot be opened is not remembered");
    bench.report(Report::Opened("/gone".into(), Err(DatasetError::NotFound { path: "/gone".into() })));
    assert_eq!(bench.session.notice.unwrap().count, count + 1, "the same text again is told again");
}

#[test]
fn a_cancelled_opening_is_no_error() {
    let mut bench = Bench::new();
    bench.apply(Command::Open("/slow".into()));
    bench.report(Report::Opened("/slow".into(), Err(DatasetError::Cancelled)));
    assert!(bench.errors().is_empty() && bench.session.notice.is_none());
    assert!(bench.session.log.back().unwrap().text.contains("/slow was cancelled"));
}

#[test]
fn a_bare_file_asks_for_its_axes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("maps.npy");
    let map: Vec<f64> = (0..32 * 16).map(f64::from).collect();
    mhp_inspector::dataset::npz::write_npy(&path, &mhp_inspector::dataset::npz::ArrayView::f64(&[32, 16], &map))
        .unwrap();
    let catalog = BareCatalog::read(&path).unwrap();
    let mut bench = Bench::new();
    let asks = |bench: &mut Bench| {
        bench.apply(Command::Open(path.clone()));
        bench.report(Report::Opened(path.clone(), Err(DatasetError::NeedsAxes(catalog.clone()))));
    };
    asks(&mut bench);
    assert_eq!(bench.session.data.bare, Some((path.clone(), catalog.clone())));
    assert!(bench.errors().is_empty(), "a question is no error");
    bench.apply(Command::DismissBare);
    assert_eq!(bench.session.data.bare, None);
    asks(&mut bench);
    let choice = BareChoice::guess(&catalog);
    let effects = bench.apply(Command::OpenBare(path.clone(), choice.clone()));
    assert!(matches!(&effects[..], [Effect::OpenBare(p, c)] if *p == path && *c == choice));
    assert!(bench.session.data.bare.is_none() && bench.session.data.opening.is_some());
}

#[test]
fn a_capture_without_a_configuration_asks_for_its_chirps() {
    let (mut bench, path) = (Bench::new(), PathBuf::from("/data/adc_data.bin"));
    let asks = |bench: &mut Bench| {
        bench.apply(Command::Open(path.clone()));
        bench.report(Report::Opened(path.clone(), Err(DatasetError::NeedsChirp { path: path.clone() })));
    };
    asks(&mut bench);
    assert_eq!(bench.session.data.capture.as_ref(), Some(&path));
    assert!(bench.errors().is_empty(), "a question is no error");
    bench.apply(Command::DismissCapture);
    assert_eq!(bench.session.data.capture, None);
    asks(&mut bench);
    let form = ChirpForm::usual().unwrap();
    let effects = bench.apply(Command::OpenCapture(path.clone(), Box::new(form.clone())));
    assert!(matches!(&effects[..], [Effect::OpenCapture(p, f)] if *p == path && **f == form));
    assert!(bench.session.data.capture.is_none() && bench.session.data.opening.is_some());
}

#[test]
fn recents_are_newest_first_without_repeats_and_few() {
    let mut bench = Bench::new();
    bench.apply(Command::ClearRecent);
    for path in ["/a", "/b", "/a", "/c"] {
        bench.report(Report::Opened(path.into(), Ok(Arc::clone(&bench.dataset))));
    }
    let recent: Vec<_> = bench.session.data.recent.iter().map(|path| path.display().to_string()).collect();
    assert_eq!(recent, ["/c", "/a", "/b"]);
    for i in 0..40 {
        bench.report(Report::Opened(format!("/many/{i}").into(), Ok(Arc::clone(&bench.dataset))));
    }
    assert_eq!(bench.session.data.recent.len(), 12);
    assert_eq!(bench.session.data.recent[0], Path::new("/many/39"));
    bench.apply(Command::ClearRecent);
    assert!(bench.session.data.recent.is_empty());
}

#[test]
fn frames_are_reached_within_bounds_only() {
    let mut bench = Bench::new();
    assert!(bench.apply(Command::GotoFrame(4)).is_empty());
    assert!(bench.apply(Command::GotoFrame(usize::MAX)).is_empty());
    assert!(bench.apply(Command::GotoFrame(0)).is_empty(), "it is on screen");
    assert_eq!((bench.session.data.frame_index, bench.session.data.loading), (0, None));
    assert!(bench.apply(Command::StepFrames(-10)).is_empty());
    assert!(matches!(bench.apply(Command::StepFrames(10))[..], [Effect::Load(3)]));
    assert!(matches!(bench.apply(Command::StepFrames(isize::MIN))[..], [Effect::Load(0)]));
    let mut empty = Session::default();
    for command in [Command::GotoFrame(0), Command::StepFrames(1), Command::TogglePlay, Command::Reset] {
        assert!(empty.apply(command).is_empty());
    }
    assert!(!empty.data.playing);
}

#[test]
fn playing_ends_at_the_last_frame() {
    let mut bench = Bench::new();
    bench.apply(Command::TogglePlay);
    assert!(bench.session.data.playing);
    bench.apply(Command::StepFrames(3));
    assert!(bench.session.data.playing);
    assert!(bench.apply(Command::StepFrames(1)).is_empty());
    assert!(!bench.session.data.playing);
}

#[test]
fn a_frame_that_arrives_too_late_is_dropped() {
    let mut bench = Bench::new();
    bench.apply(Command::GotoFrame(1));
    bench.apply(Command::GotoFrame(2));
    let stale = Arc::new(bench.dataset.load(1).unwrap());
    assert!(bench.report(Report::FrameLoaded(1, Ok(stale))).is_empty());
    assert_eq!((bench.session.data.frame.as_ref().unwrap().index, bench.session.data.loading), (0, Some(2)));
    let prepare = bench.load(2);
    assert_eq!((prepare.frame.index, bench.session.data.loading), (2, None));
    let again = Arc::new(bench.dataset.load(2).unwrap());
    assert!(bench.report(Report::FrameLoaded(2, Ok(again))).is_empty(), "nobody asked twice");
}

#[test]
fn a_frame_that_cannot_be_read_is_told_and_the_next_one_is_fine() {
    let mut bench = Bench::new();
    bench.run_to(5);
    bench.apply(Command::TogglePlay);
    bench.apply(Command::GotoFrame(1));
    let error = DatasetError::NotFound { path: "frames/001.npz".into() };
    let effects = bench.report(Report::FrameLoaded(1, Err(error)));
    assert!(matches!(sent(&effects), WorkerCommand::Discard));
    let data = &bench.session.data;
    assert!(data.frame.is_none() && !data.playing && data.error.as_ref().unwrap().contains("001.npz"));
    assert_eq!(bench.session.fit.status, FitStatus::Idle);
    // It can be tried again, and the fit that was left is still there.
    assert!(matches!(bench.apply(Command::GotoFrame(1))[..], [Effect::Load(1)]));
    let prepare = bench.goto(0);
    assert!(matches!(&prepare.start, Start::Resume { state, .. } if state.iteration == 5));
    assert_eq!(bench.session.data.error, None);
}

#[test]
fn a_run_goes_to_the_asked_iterations_and_then_as_many_more() {
    let mut bench = Bench::new();
    let effects = bench.apply(Command::ToggleRun);
    assert!(matches!(sent(&effects), WorkerCommand::RunTo { target: 100, .. }));
    assert!(bench.session.fit.is_running());
    assert!(bench.apply(Command::StepFit(1)).is_empty(), "no step during a run");
    let effects = bench.apply(Command::ToggleRun);
    assert!(matches!(sent(&effects), WorkerCommand::Pause));
    assert!(bench.session.fit.is_running(), "until the worker says so");
    bench.rows(bench.job(), 0, 1..=100);
    bench.finished(0, 100);
    assert_eq!(
        (bench.session.fit.status.clone(), bench.session.fit.reason),
        (FitStatus::Paused, Some("all iterations done"))
    );
    let effects = bench.apply(Command::ToggleRun);
    assert!(matches!(sent(&effects), WorkerCommand::RunTo { target: 200, .. }));
    let summary = &bench.session.summaries[&0];
    assert_eq!((summary.iterations, summary.iou, summary.converged), (Some(100), Some(0.375), Some(false)));
}

#[test]
fn commands_to_the_optimiser_need_a_fit() {
    let mut bench = Bench::new();
    let prepare = bench.goto(1);
    assert_eq!(bench.session.fit.status, FitStatus::Preparing);
    let params = bench.params.clone();
    for command in [
        Command::ToggleRun,
        Command::StepFit(1),
        Command::StepBack(1),
        Command::Discard,
        Command::SelectBranch(0),
        Command::EditParams(Box::new(params)),
    ] {
        let name = format!("{command:.20?}");
        assert!(bench.apply(command).is_empty(), "{name}");
    }
    assert_eq!(bench.session.fit.status, FitStatus::Preparing);
    bench.answer(prepare);
    assert!(matches!(sent(&bench.apply(Command::ToggleRun)), WorkerCommand::RunTo { target: 100, .. }));
}

#[test]
fn messages_of_another_job_are_dropped() {
    let mut bench = Bench::new();
    bench.run_to(4);
    let old = bench.job();
    let prepare = bench.goto(1);
    assert!(bench.job() > old);
    bench.rows(old, 0, 5..=9);
    bench.event(old, WorkerEvent::Failed("too late".into()));
    bench.event(old, WorkerEvent::Lost("too late".into()));
    bench.snapshot(old, 0, 9, true);
    assert_eq!((bench.session.fit.head(), bench.shown()), (0, None));
    assert!(bench.errors().is_empty());
    bench.answer(prepare);
    assert_eq!(bench.session.summaries.keys().collect::<Vec<_>>(), [&0]);
}

#[test]
fn looking_back_and_forward_again() {
    let mut bench = Bench::new();
    bench.run_to(10);
    let effects = bench.apply(Command::StepBack(3));
    let WorkerCommand::Inspect { branch: 0, state, .. } = sent(&effects) else { panic!("{effects:?}") };
    assert_eq!((state.iteration, bench.session.fit.cursor), (7, Some(7)));
    assert_eq!(bench.session.fit.shown_row().unwrap().report, report(7));
    assert!(bench.apply(Command::GotoIteration(7)).is_empty(), "it is shown");
    let effects = bench.apply(Command::StepFit(2));
    assert!(matches!(sent(&effects), WorkerCommand::Inspect { state, .. } if state.iteration == 9));
    let effects = bench.apply(Command::StepFit(5));
    assert!(matches!(sent(&effects), WorkerCommand::Inspect { state, .. } if state.iteration == 10));
    assert_eq!(bench.session.fit.cursor, None, "the newest iteration is live");
    assert!(matches!(sent(&bench.apply(Command::StepFit(1))), WorkerCommand::RunTo { target: 11, .. }));
    bench.finished(0, 10);
    bench.apply(Command::StepBack(usize::MAX));
    assert_eq!(bench.session.fit.cursor, Some(0));
    assert!(bench.apply(Command::StepBack(1)).is_empty());
    let effects = bench.apply(Command::FollowLive);
    assert!(matches!(sent(&effects), WorkerCommand::Inspect { state, .. } if state.iteration == 10));
    assert!(bench.apply(Command::FollowLive).is_empty());
}

#[test]
fn the_newest_picture_of_what_is_looked_at_wins() {
    let mut bench = Bench::new();
    let job = bench.job();
    bench.run_to(10);
    bench.snapshot(job, 0, 10, true);
    assert_eq!(bench.shown(), Some((0, 10)));
    bench.apply(Command::GotoIteration(4));
    assert_eq!(bench.shown(), Some((0, 10)), "the old picture stays until there is a new one");
    bench.snapshot(job, 0, 11, true);
    assert_eq!(bench.shown(), Some((0, 10)), "a live picture does not replace the past");
    bench.snapshot(job, 0, 5, false);
    assert_eq!(bench.shown(), Some((0, 10)), "an answer about another iteration is late");
    bench.snapshot(job, 0, 4, false);
    assert_eq!(bench.shown(), Some((0, 4)));
    bench.apply(Command::FollowLive);
    bench.snapshot(job, 0, 4, false);
    bench.snapshot(job, 0, 10, false);
    assert_eq!(bench.shown(), Some((0, 10)));
    bench.snapshot(job, 0, 4, false);
    assert_eq!(bench.shown(), Some((0, 10)), "a late look back does not replace the present");
    bench.snapshot(job, 7, 12, true);
    bench.snapshot(job + 1, 0, 12, true);
    assert_eq!(bench.shown(), Some((0, 10)), "another branch, another job");
}

#[test]
fn a_setting_changed_at_an_earlier_iteration_starts_a_branch() {
    let mut bench = Bench::new();
    bench.run_to(10);
    bench.apply(Command::GotoIteration(6));
    let config = FitConfig { w_em: 2.0, ..FitConfig::default() };
    let effects = bench.apply(Command::SetConfig(Box::new(config)));
    let WorkerCommand::Branch { branch: 1, state, config: told, .. } = sent(&effects) else { panic!("{effects:?}") };
    assert_eq!((state.iteration, **told), (6, config));
    let history = &bench.session.fit.history;
    let branches: Vec<_> = history.branches().iter().map(|b| (b.id, b.parent, b.config.w_em, b.head())).collect();
    assert_eq!(branches, [(0, None, 0.5, 10), (1, Some((0, 6)), 2.0, 6)]);
    assert_eq!((bench.session.fit.cursor, bench.session.fit.shown_iteration()), (None, 6));
    assert!(bench.session.log.back().unwrap().text.contains("w_EM 0.5 → 2"));
    // A step that is asked for before the worker has answered is a step from there.
    assert!(matches!(sent(&bench.apply(Command::StepFit(1))), WorkerCommand::RunTo { target: 7, .. }));
    let job = bench.job();
    bench.rows(job, 1, 6..=8);
    bench.finished(1, 8);
    assert_eq!(bench.session.fit.head(), 8);
    assert_eq!(bench.session.fit.history.branch(0).unwrap().head(), 10, "the old branch is kept");

    // Back on the first branch with its own settings, and on the second again.
    let effects = bench.apply(Command::SelectBranch(0));
    assert!(
        matches!(sent(&effects), WorkerCommand::Branch { branch: 0, state, config, .. } if state.iteration == 10 && config.w_em == 0.5)
    );
    assert_eq!(bench.session.config.w_em, 0.5);
    bench.rows(job, 0, 10..=10);
    assert_eq!(bench.session.fit.history.branch(0).unwrap().rows.len(), 11, "a row is not doubled");
    assert!(bench.apply(Command::SelectBranch(9)).len() <= 1);
    assert_eq!(bench.session.fit.history.active_id(), 0);
    bench.apply(Command::SelectBranch(1));
    assert_eq!(bench.session.config.w_em, 2.0);

    // Discarded: back to where it left its parent.
    let effects = bench.apply(Command::Discard);
    assert!(matches!(sent(&effects), WorkerCommand::Branch { branch: 0, .. }));
    assert_eq!(bench.session.fit.history.branches().len(), 1);
    // And on the first branch back to the start pose.
    let effects = bench.apply(Command::Discard);
    assert!(matches!(sent(&effects), WorkerCommand::Branch { branch: 0, state, .. } if state.iteration == 0));
    assert_eq!((bench.session.fit.head(), bench.session.summaries.len()), (0, 0));
}

#[test]
fn discarding_a_branch_takes_its_own_branches_along() {
    let config = FitConfig::default();
    let mut history = History::new(config);
    let b = history.begin(Some((0, 3)), config);
    let c = history.begin(Some((b, 5)), config);
    let d = history.begin(Some((0, 4)), config);
    assert_eq!(history.discard(b), Some((0, 3)));
    let left: Vec<u32> = history.branches().iter().map(|branch| branch.id).collect();
    assert_eq!((left, history.active_id()), (vec![0, d], 0));
    assert_eq!((history.discard(c), history.discard(0)), (None, None));
    assert!(history.begin(None, config) > d, "numbers are not used twice");
}

#[test]
fn a_setting_changed_while_running_is_a_flag() {
    let mut bench = Bench::new();
    let job = bench.job();
    bench.apply(Command::ToggleRun);
    bench.rows(job, 0, 1..=4);
    let mut config = FitConfig { tau_pct: 15.0, ..FitConfig::default() };
    let effects = bench.apply(Command::SetConfig(Box::new(config)));
    assert!(matches!(sent(&effects), WorkerCommand::Configure(told) if **told == config));
    assert!(bench.session.fit.is_running());
    bench.event(job, WorkerEvent::ConfigApplied { branch: 0, iteration: 4, config: Box::new(config) });
    // A slider sends many values between two steps; what held is one flag.
    config.tau_pct = 20.0;
    bench.event(job, WorkerEvent::ConfigApplied { branch: 0, iteration: 4, config: Box::new(config) });
    bench.rows(job, 0, 5..=6);
    let branch = bench.session.fit.branch().unwrap();
    let flags: Vec<_> = branch.flags.iter().map(|flag| (flag.iteration, flag.text.as_str())).collect();
    assert_eq!(flags, [(4, "τ_pct 10 → 20")]);
    assert_eq!([4, 5].map(|k| branch.config_at(k).tau_pct), [10.0, 20.0]);
    assert!(bench.apply(Command::SetConfig(Box::new(FitConfig { tau_pct: 30.0, ..config }))).len() == 1);
    assert!(
        bench.apply(Command::SetConfig(Box::new(FitConfig { tau_pct: 30.0, ..config }))).is_empty(),
        "nothing changed"
    );
}

/// Another value than a configuration has.
fn another(field: &Field, config: &FitConfig) -> Value {
    match (field.get(config), &field.kind) {
        (Value::Switch(on), _) => Value::Switch(!on),
        (Value::Answer(k), FieldKind::Choice(answers)) => Value::Answer((k + 1) % answers.len()),
        (Value::Unset, FieldKind::Number(Number { unset: Some(unset), .. })) => Value::Number(unset.first),
        (value, FieldKind::Number(number)) if value == Value::Number(number.offered.0) => {
            Value::Number(number.offered.1)
        }
        (_, FieldKind::Number(number)) => Value::Number(number.offered.0),
        (value, _) => panic!("{}: {value:?}", field.key),
    }
}

/// Whatever is set, while it runs or at an earlier iteration: a flag or a branch tells it, and other branches keep theirs.
#[test]
fn no_setting_is_lost_on_the_way() {
    let mut bench = Bench::new();
    bench.run_to(2);
    for field in FIELDS {
        let mut config = bench.session.config;
        field.set(&mut config, another(field, &bench.session.config));
        let (job, head) = (bench.job(), bench.session.fit.head());
        let effects = bench.apply(Command::SetConfig(Box::new(config)));
        assert!(matches!(sent(&effects), WorkerCommand::Configure(told) if **told == config), "{}", field.key);
        bench.event(job, WorkerEvent::ConfigApplied { branch: 0, iteration: head, config: Box::new(config) });
        bench.run_to(head + 1);
        let flag = bench.session.fit.branch().unwrap().flags.last().unwrap();
        assert!(flag.iteration == head && flag.config == config, "{}", field.key);
        assert!(flag.text.to_lowercase().starts_with(&field.name.to_lowercase()), "{}: {}", field.key, flag.text);
    }
    bench.run_to(bench.session.fit.head() + 2);
    let (first, head) = (bench.session.config, bench.session.fit.head());
    for field in FIELDS.iter().filter(|field| field.read_by != ReadBy::Run) {
        bench.apply(Command::GotoIteration(head - 1));
        let mut config = first;
        field.set(&mut config, another(field, &first));
        let effects = bench.apply(Command::SetConfig(Box::new(config)));
        let WorkerCommand::Branch { branch, config: told, .. } = sent(&effects) else { panic!("{}", field.key) };
        let (branch, told) = (*branch, **told);
        assert_eq!(told, config);
        let history = &bench.session.fit.history;
        let departure = history.departure(history.branch(branch).unwrap());
        assert!(departure.to_lowercase().contains(&field.name.to_lowercase()), "{}: {departure}", field.key);
        assert!(bench.session.log.iter().any(|line| line.text.ends_with(&departure)), "{}: {departure}", field.key);
        // There and back again.
        for (id, settings) in [(0, first), (branch, config), (0, first)] {
            bench.apply(Command::SelectBranch(id));
            assert_eq!(bench.session.config, settings, "{}", field.key);
        }
    }
}

#[test]
fn how_long_to_run_is_no_reason_for_a_branch() {
    let mut bench = Bench::new();
    bench.run_to(10);
    bench.apply(Command::GotoIteration(5));
    let config = FitConfig { iterations: 40, stop_when_converged: true, ..FitConfig::default() };
    assert!(matches!(sent(&bench.apply(Command::SetConfig(Box::new(config)))), WorkerCommand::Configure(_)));
    assert_eq!((bench.session.fit.cursor, bench.session.fit.history.branches().len()), (Some(5), 1));
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let mut bench = Bench::new();
    for (config, name) in [
        (FitConfig { tau_pct: 100.5, ..FitConfig::default() }, "tau_pct is 100.5"),
        (FitConfig { w_em: f64::NAN, ..FitConfig::default() }, "w_em is NaN"),
        (FitConfig { iterations: 0, ..FitConfig::default() }, "iterations is 0"),
        (FitConfig { learning_rate: -1.0, ..FitConfig::default() }, "learning_rate is -1"),
    ] {
        assert!(bench.apply(Command::SetConfig(Box::new(config))).is_empty());
        let text = bench.errors().pop().unwrap().to_owned();
        assert!(text.contains(name) && text.contains("expected"), "{text}");
        assert_eq!(bench.session.config, FitConfig::default());
    }
}

#[test]
fn parameters_edited_by_hand_start_a_branch() {
    let mut bench = Bench::new();
    bench.run_to(5);
    let mut params = bench.params.clone();
    params.group_mut(Group::Position)[1] += 0.2;
    let effects = bench.apply(Command::EditParams(Box::new(params.clone())));
    assert!(matches!(
        &effects[..],
        [Effect::Send(WorkerCommand::Branch { branch: 1, .. }), Effect::Send(WorkerCommand::Edit(told))] if **told == params
    ));
    assert_eq!(bench.session.fit.history.branch(1).unwrap().parent, Some((0, 5)));
    params.group_mut(Group::Position)[1] = f64::NAN;
    assert!(bench.apply(Command::EditParams(Box::new(params))).is_empty());
    assert!(bench.errors()[0].contains("not a finite number"));
}

#[test]
fn a_warm_start_takes_the_result_of_the_frame_before() {
    let mut bench = Bench::new();
    bench.run_to(8);
    let prepare = bench.goto(1);
    assert!(matches!(prepare.start, Start::Initialise), "off at first");
    bench.answer(prepare);
    bench.apply(Command::SetWarmStart(true));
    let prepare = bench.goto(2);
    assert!(matches!(prepare.start, Start::Initialise), "frame 1 was not fitted");
    bench.answer(prepare);
    bench.run_to(6);
    let prepare = bench.goto(3);
    let Start::Warm(params) = &prepare.start else { panic!("not warm") };
    assert_eq!(*params, bench.state(6).params);
    bench.answer(prepare);
    assert_eq!(bench.session.fit.initial.as_ref(), Some(&bench.state(6).params));
    // A fit that was left wins over a warm start.
    assert!(matches!(bench.goto(0).start, Start::Resume { .. }));
}

#[test]
fn a_start_along_the_sequence_begins_the_frame_anew_and_goes_on_with_the_next() {
    let mut bench = Bench::new();
    bench.run_to(4);
    let prepare = prepare_of(bench.apply(Command::SetAlong(true)));
    assert!(matches!(prepare.start, Start::Along), "{:?}", prepare.start);
    bench.answer(prepare);
    assert_eq!(bench.session.fit.head(), 0);
    assert!(bench.apply(Command::SetAlong(true)).is_empty(), "it is on");
    assert!(matches!(bench.goto(1).start, Start::Along));
    let prepare = prepare_of(bench.apply(Command::SetAlong(false)));
    assert!(matches!(prepare.start, Start::Initialise), "{:?}", prepare.start);
}

#[test]
fn a_fit_that_was_left_is_found_again() {
    let mut bench = Bench::new();
    bench.run_to(10);
    bench.apply(Command::GotoIteration(6));
    bench.apply(Command::SetConfig(Box::new(FitConfig { w_em: 2.0, ..FitConfig::default() })));
    bench.rows(bench.job(), 1, 6..=8);
    bench.apply(Command::GotoIteration(7));
    let prepare = bench.goto(1);
    assert_eq!(bench.session.fit.history.branches().len(), 1);
    bench.answer(prepare);
    bench.apply(Command::SetConfig(Box::new(FitConfig { w_em: 3.0, ..FitConfig::default() })));

    let prepare = bench.goto(0);
    let Start::Resume { initial, state } = &prepare.start else { panic!("not resumed") };
    assert_eq!((initial, state.iteration, prepare.branch, prepare.config.w_em), (&bench.params, 8, 1, 3.0));
    let fit = &bench.session.fit;
    assert_eq!((fit.history.branches().len(), fit.head(), fit.status.clone()), (2, 8, FitStatus::Preparing));
    assert_eq!(fit.branch().unwrap().flags.last().unwrap().iteration, 8, "settings that changed meanwhile");
    let job = bench.job();
    let prepared = PreparedFit {
        problem: fit.problem.clone().unwrap(),
        found_start: None,
        initial: bench.params.clone(),
        warnings: Vec::new(),
        init_ms: 0.0,
        step_ms: SLOW_MS,
    };
    let effects = bench.event(job, WorkerEvent::Prepared(Box::new(prepared)));
    assert!(matches!(sent(&effects), WorkerCommand::Inspect { branch: 1, state, .. } if state.iteration == 7));
    assert_eq!(bench.session.fit.cursor, Some(7), "still looking at the same iteration");
    // A reset forgets it.
    let prepare = prepare_of(bench.apply(Command::Reset));
    assert!(matches!(prepare.start, Start::Initialise));
    assert_eq!((bench.session.fit.head(), bench.session.summaries.contains_key(&0)), (0, false));
}

#[test]
fn another_data_set_begins_anew_and_keeps_how_things_are_shown() {
    let mut bench = Bench::new();
    bench.run_to(5);
    bench.goto(1);
    let view = ViewState { theme: ThemeChoice::Light, wipe: 0.25, ..ViewState::default() };
    bench.apply(Command::SetView(Box::new(view.clone())));
    bench.apply(Command::SelectJoint(Some(3)));
    let config = FitConfig { w_em: 0.75, ..FitConfig::default() };
    bench.apply(Command::SetConfig(Box::new(config)));
    let other = tempfile::tempdir().unwrap();
    let dataset = dataset(other.path(), 2);
    bench.report(Report::Opened(other.path().into(), Ok(dataset)));
    let session = &bench.session;
    assert_eq!((session.data.len(), session.data.frame_index, session.data.loading), (2, 0, Some(0)));
    assert!(session.fits.is_empty() && session.summaries.is_empty() && session.data.frame.is_none());
    assert_eq!((session.joint, &session.view, session.config), (None, &view, config));
}

#[test]
fn only_so_many_left_fits_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let many = dataset(folder.path(), 20);
    let mut bench = Bench::new();
    bench.report(Report::Opened(folder.path().into(), Ok(Arc::clone(&many))));
    bench.dataset = many;
    let mut prepare = bench.load(0);
    for index in 1..20 {
        bench.answer(prepare);
        bench.run_to(1);
        prepare = bench.goto(index);
    }
    assert_eq!(bench.session.fits.keys().copied().collect::<Vec<_>>(), (3..19).collect::<Vec<_>>());
    assert_eq!(bench.session.summaries.len(), 19, "what is known of them stays");
}

#[test]
fn a_job_that_is_lost_can_only_be_reset() {
    let mut bench = Bench::new();
    bench.run_to(5);
    bench.event(bench.job(), WorkerEvent::Failed("diverged".into()));
    assert_eq!(bench.session.fit.status, FitStatus::Paused, "there is still something to go back to");
    bench.event(bench.job(), WorkerEvent::Lost("a panic".into()));
    assert_eq!(bench.session.fit.status, FitStatus::Failed("a panic".into()));
    assert_eq!(bench.errors(), ["diverged", "a panic"]);
    assert!(bench.apply(Command::ToggleRun).is_empty());
    assert!(bench.apply(Command::SetConfig(Box::new(FitConfig { w_em: 1.0, ..FitConfig::default() }))).is_empty());
    let prepare = prepare_of(bench.apply(Command::Reset));
    assert_eq!((prepare.config.w_em, bench.session.fit.status.clone()), (1.0, FitStatus::Preparing));
}

#[test]
fn a_run_begins_by_itself_only_where_asked() {
    let mut bench = Bench::new();
    let view = ViewState { run_on_open: true, ..ViewState::default() };
    bench.apply(Command::SetView(Box::new(view)));
    let prepare = bench.goto(1);
    let job = prepare.job;
    bench.rows(job, 0, 0..=0);
    let prepared = PreparedFit {
        problem: Arc::new(problem_alone(&prepare.dataset, &prepare.frame).unwrap()),
        found_start: None,
        initial: bench.params.clone(),
        warnings: vec!["the region has no cell".into()],
        init_ms: 0.0,
        step_ms: SLOW_MS,
    };
    let effects = bench.event(job, WorkerEvent::Prepared(Box::new(prepared)));
    assert!(matches!(sent(&effects), WorkerCommand::RunTo { target: 100, .. }));
    assert_eq!(bench.session.notice.as_ref().unwrap().text, "the region has no cell");
}

#[test]
fn a_long_history_thins_its_states_and_keeps_every_row() {
    let mut bench = Bench::new();
    let job = bench.job();
    // 17 joints of 18 numbers, three times, 8 bytes each: the budget of 128 MiB is 18,275 states.
    let bytes = 3 * 8 * bench.params.shape().total();
    let count = (128 << 20) / bytes + 500;
    let state = bench.state(0);
    let rows = (1..=count)
        .map(|k| HistoryRow { branch: 0, report: report(k), kept: Kept::State(Arc::clone(&state)) })
        .collect();
    bench.report(Report::Worker(WorkerMessage::Rows(job, rows)));
    let branch = bench.session.fit.branch().unwrap();
    assert_eq!((branch.rows.len(), branch.head()), (count + 1, count));
    let kept = |row: &IterationRow| row.state.is_some();
    let states = branch.rows.iter().filter(|row| kept(row)).count();
    assert!(states * bytes <= 128 << 20 && states > count / 3, "{states} of {count}");
    assert!(kept(&branch.rows[0]) && kept(&branch.rows[count]));
    // Forward over what was thinned out: every step arrives somewhere else.
    bench.apply(Command::GotoIteration(100));
    let mut at = bench.session.fit.shown_iteration();
    for _ in 0..4 {
        assert_eq!(bench.apply(Command::StepFit(1)).len(), 1);
        let now = bench.session.fit.shown_iteration();
        assert!(now > at && now <= at + 2, "{at} to {now}");
        at = now;
    }
    for _ in 0..4 {
        bench.apply(Command::StepBack(1));
        let now = bench.session.fit.shown_iteration();
        assert!(now < at && now + 2 >= at, "{at} to {now}");
        at = now;
    }
}

#[test]
fn the_log_is_bounded() {
    let mut session = Session::default();
    for i in 0..2500 {
        session.report(Report::Log(LogLevel::Info, format!("line {i}")));
    }
    assert_eq!((session.log.len(), session.log.front().unwrap().text.as_str()), (2000, "line 500"));
    assert_eq!(session.notice, None, "information is not a notification");
    session.apply(Command::ClearLog);
    assert!(session.log.is_empty());
}

#[test]
fn the_end_of_an_older_run_does_not_end_the_newer_one() {
    let mut bench = Bench::new();
    let job = bench.job();
    bench.apply(Command::StepFit(4));
    bench.rows(job, 0, 1..=4);
    let old = bench.session.fit.run.0;
    bench.apply(Command::Discard);
    bench.apply(Command::ToggleRun);
    let reason = StopReason::Iterations;
    bench.event(job, WorkerEvent::Finished { run: old, branch: 0, iteration: 4, reason, run_ms: 3.0 });
    assert!(bench.session.fit.is_running(), "the end of the discarded run came late");
    bench.finished(0, 100);
    assert!(!bench.session.fit.is_running());
}
