//! The thread of a fit: nothing lost, nothing stale, nothing spent while idle, and it survives what goes wrong.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use crate::blob;
use crossbeam_channel::{Receiver, unbounded};
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::{Dataset, Frame};
use mhp_inspector::mhp::{FitState, Precision, StopReason, Terms};
use mhp_inspector::task::Progress;
use mhp_inspector::worker::{
    HistoryRow, JobId, Prepare, PreparedFit, Snapshot, Start, Worker, WorkerCommand, WorkerEvent, WorkerMessage,
};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Nothing here takes a second; where it does, the machine is busy, not the program wrong.
const PATIENCE: Duration = Duration::from_secs(30);
/// An iteration that no run reaches.
const FOREVER: usize = 100_000_000;

/// A worker, what it says, and a frame to give it.
struct Rig {
    worker: Worker,
    wakes: Receiver<PathBuf>,
    dataset: Arc<Dataset>,
    frame: Arc<Frame>,
    waiting: VecDeque<WorkerMessage>,
    _folder: tempfile::TempDir,
}

impl Rig {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        blob::write_dataset(folder.path(), 1);
        let dataset = Arc::new(Dataset::open(folder.path(), &Progress::new()).unwrap());
        let frame = Arc::new(dataset.load(0).unwrap());
        let (wake, wakes) = unbounded();
        // The callback runs on the worker's thread, so the link names that thread.
        let wake = move || wake.send(std::fs::read_link("/proc/thread-self").unwrap_or_default()).unwrap_or(());
        let worker = Worker::spawn(wake).unwrap();
        Self { worker, wakes, dataset, frame, waiting: VecDeque::new(), _folder: folder }
    }

    fn send(&self, command: WorkerCommand) {
        self.worker.send(command);
    }

    fn prepare_with(&self, job: JobId, config: &FitConfig, start: Start) {
        self.send(WorkerCommand::Prepare(Box::new(Prepare {
            job,
            branch: 0,
            dataset: Arc::clone(&self.dataset),
            frame: Arc::clone(&self.frame),
            config: *config,
            precision: Precision::F64,
            start,
            erased: Arc::default(),
            around: None,
        })));
    }

    /// Prepares job 1 and answers its row 0 and what was prepared.
    fn prepared(&mut self) -> (HistoryRow, PreparedFit) {
        self.prepare_with(1, &FitConfig::default(), Start::Initialise);
        let (mut rows, event) = self.rows_until(1, |event| matches!(event, WorkerEvent::Prepared(_)));
        let WorkerEvent::Prepared(prepared) = event else { panic!("{event:?}") };
        assert_eq!(rows.len(), 1);
        (rows.remove(0), *prepared)
    }

    fn message(&mut self) -> WorkerMessage {
        self.waiting.pop_front().unwrap_or_else(|| self.worker.wait(PATIENCE).unwrap())
    }

    /// Every row up to an event that `ends`; each must be of `job`.
    fn rows_until(&mut self, job: JobId, ends: impl Fn(&WorkerEvent) -> bool) -> (Vec<HistoryRow>, WorkerEvent) {
        let mut all = Vec::new();
        loop {
            match self.message() {
                WorkerMessage::Rows(from, rows) => {
                    assert_eq!(from, job);
                    all.extend(rows);
                }
                WorkerMessage::Event(from, event) => {
                    assert_eq!(from, job);
                    if ends(&event) {
                        return (all, event);
                    }
                    panic!("did not expect {event:?}");
                }
            }
        }
    }

    fn finish(&mut self) -> (Vec<HistoryRow>, usize, StopReason) {
        let (rows, event) = self.rows_until(1, |event| matches!(event, WorkerEvent::Finished { .. }));
        let WorkerEvent::Finished { iteration, reason, .. } = event else { panic!("{event:?}") };
        (rows, iteration, reason)
    }

    /// Begins a run that never ends by itself and answers the rows of at least `steps` iterations.
    fn run_forever(&mut self, steps: usize) -> Vec<HistoryRow> {
        self.send(WorkerCommand::RunTo { target: FOREVER, run: 1 });
        self.more_rows(steps)
    }

    fn more_rows(&mut self, steps: usize) -> Vec<HistoryRow> {
        let mut all = Vec::new();
        while all.len() < steps {
            match self.message() {
                WorkerMessage::Rows(1, rows) => all.extend(rows),
                other => panic!("did not expect {other:?}"),
            }
        }
        all
    }

    fn snapshot(&self, wanted: impl Fn(&Snapshot) -> bool) -> Snapshot {
        let deadline = Instant::now() + PATIENCE;
        loop {
            if let Some(snapshot) = self.worker.take_snapshot().filter(&wanted) {
                return snapshot;
            }
            self.wakes.recv_deadline(deadline).unwrap();
        }
    }

    /// The folder of the worker's thread under `/proc`, where there is one.
    fn thread(&self) -> Option<PathBuf> {
        let thread = PathBuf::from("/proc").join(self.wakes.recv_timeout(PATIENCE).unwrap());
        let there = thread.join("comm").is_file();
        if !there {
            println!("skipped: no /proc on this system");
        }
        there.then_some(thread)
    }
}

fn iterations(rows: &[HistoryRow]) -> Vec<usize> {
    rows.iter().map(|row| row.report.iteration).collect()
}

/// L of these terms under these weights.
fn weighted(terms: &Terms, config: &FitConfig) -> f64 {
    terms.iter().map(|(term, value)| term.weight.of(config) * value).sum()
}

fn assert_weights(rows: &[HistoryRow], config: &FitConfig) {
    for row in rows {
        let expected = weighted(&row.report.terms, config);
        let error = (row.report.loss - expected).abs();
        assert!(error <= 1e-12 * expected.abs(), "iteration {}: {error}", row.report.iteration);
    }
}

fn state(row: &HistoryRow) -> &Arc<FitState> {
    row.kept.state().unwrap()
}

fn same(a: &[HistoryRow], b: &[HistoryRow]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert_eq!(a.report, b.report);
        assert_eq!(a.kept, b.kept);
    }
}

#[test]
fn preparing_answers_the_start_pose_its_row_and_a_picture_of_it() {
    let mut rig = Rig::new();
    let (row, prepared) = rig.prepared();
    assert_eq!((row.branch, row.report.iteration), (0, 0));
    assert_eq!(state(&row).params, prepared.initial);
    assert_eq!(prepared.found_start.unwrap().initialisation.params, prepared.initial);
    assert_eq!(prepared.problem.views.len(), 2);
    assert_eq!(prepared.warnings, Vec::<String>::new());
    let snapshot = rig.snapshot(|_| true);
    assert_eq!((snapshot.job, snapshot.branch, snapshot.iteration, snapshot.live), (1, 0, 0, true));
    assert_eq!(snapshot.params, prepared.initial);
    assert_eq!(snapshot.evaluation.loss, row.report.loss);
    assert_eq!(snapshot.iterations_per_s, 0.0);
    for (sim, masks) in snapshot.h_sim.iter().zip(&snapshot.masks) {
        assert_eq!(sim.len(), 48 * 32);
        assert!(sim.iter().all(|x| x.is_finite()) && sim.iter().any(|x| *x > 0.0));
        assert_eq!(masks.inside.len(), 48 * 32);
    }
    assert!(rig.worker.poll().is_none(), "a prepared job is paused");
}

#[test]
fn a_run_gives_every_row_once_and_in_order() {
    let mut rig = Rig::new();
    let (first, _) = rig.prepared();
    rig.send(WorkerCommand::RunTo { target: 60, run: 1 });
    let (rows, at, reason) = rig.finish();
    assert_eq!((at, reason), (60, StopReason::Iterations));
    assert_eq!(iterations(&rows), (1..=60).collect::<Vec<_>>());
    assert!(rows.iter().all(|row| row.branch == 0 && state(row).iteration == row.report.iteration));
    assert!(rows[59].report.loss < first.report.loss, "{} after {}", rows[59].report.loss, first.report.loss);
    let snapshot = rig.snapshot(|snapshot| snapshot.iteration == 60);
    assert_eq!(snapshot.params, state(&rows[59]).params);
    assert_eq!(snapshot.iterations_per_s, 0.0, "at its end a run is paused");
    rig.send(WorkerCommand::RunTo { target: 61, run: 1 });
    assert_eq!(iterations(&rig.finish().0), [61]);
}

#[test]
fn a_long_run_keeps_fewer_states_but_every_pose_and_always_the_last() {
    let mut rig = Rig::new();
    let (row, prepared) = rig.prepared();
    let late = FitState { iteration: 2044, ..FitState::clone(state(&row)) };
    rig.send(WorkerCommand::Branch {
        branch: 0,
        state: Arc::new(late),
        config: Box::new(FitConfig::default()),
        erased: Arc::default(),
        around: None,
    });
    rig.send(WorkerCommand::RunTo { target: 2053, run: 1 });
    let (rows, ..) = rig.finish();
    assert_eq!(iterations(&rows), (2044..=2053).collect::<Vec<_>>());
    let kept = |row: &&HistoryRow| row.kept.state().is_some_and(|state| state.iteration == row.report.iteration);
    let kept: Vec<usize> = rows.iter().filter(kept).map(|row| row.report.iteration).collect();
    assert!([2044, 2045, 2046, 2047, 2048, 2050, 2052, 2053].iter().all(|k| kept.contains(k)), "{kept:?}");
    // A batch of rows may end anywhere, and what it ends with is kept; the machine is not so slow that all do.
    let (before, after) = (&rows[4], &rows[5]);
    assert_ne!(before.kept.positions(), after.kept.positions());
    assert_eq!(after.kept.positions().len(), prepared.initial.positions().len());
    rig.send(WorkerCommand::Branch {
        branch: 1,
        state: Arc::clone(state(before)),
        config: Box::default(),
        erased: Arc::default(),
        around: None,
    });
    rig.send(WorkerCommand::RunTo { target: 2049, run: 2 });
    let (again, ..) = rig.finish();
    assert_eq!(again[1].kept.positions(), after.kept.positions(), "a pose without its state is the pose all the same");
}

#[test]
fn a_branch_that_begins_late_keeps_where_it_begins_and_where_the_one_before_ended() {
    let mut rig = Rig::new();
    let (row, _) = rig.prepared();
    let late = |iteration: usize| Arc::new(FitState { iteration, ..FitState::clone(state(&row)) });
    // Odd iterations, of which nothing would be kept there; the commands come at once, so that rows wait together.
    let config = Box::<FitConfig>::default();
    for (branch, begins) in [(1, 2049), (2, 4099)] {
        rig.send(WorkerCommand::Branch {
            branch,
            state: late(begins),
            config: config.clone(),
            erased: Arc::default(),
            around: None,
        });
        rig.send(WorkerCommand::RunTo { target: begins + 4, run: u64::from(branch) });
        if branch == 1 {
            let (rows, ..) = rig.finish();
            assert!(rows[0].report.iteration == 2049 && rows[0].kept.state().is_some());
            rig.send(WorkerCommand::RunTo { target: FOREVER, run: 3 });
        }
    }
    let (mut rows, mut ended) = (Vec::new(), false);
    while !ended {
        match rig.message() {
            WorkerMessage::Rows(1, more) => rows.extend(more),
            WorkerMessage::Event(1, WorkerEvent::Finished { branch: 2, .. }) => ended = true,
            other => panic!("did not expect {other:?}"),
        }
    }
    let of = |branch: u32| rows.iter().filter(move |row| row.branch == branch);
    assert!(of(1).next_back().is_none_or(|row| row.kept.state().is_some()), "the head of a branch that is left");
    assert!(of(2).next().unwrap().kept.state().is_some() && of(2).next_back().unwrap().kept.state().is_some());
}

#[test]
fn a_run_that_is_already_there_says_so() {
    let mut rig = Rig::new();
    rig.prepared();
    rig.send(WorkerCommand::RunTo { target: 5, run: 1 });
    rig.finish();
    rig.send(WorkerCommand::RunTo { target: 3, run: 1 });
    let (rows, at, reason) = rig.finish();
    assert_eq!((rows.len(), at, reason), (0, 5, StopReason::Iterations));
}

#[test]
fn pause_stops_after_the_step_and_nothing_follows() {
    let mut rig = Rig::new();
    rig.prepared();
    let mut rows = rig.run_forever(3);
    rig.send(WorkerCommand::Pause);
    let (rest, at, reason) = rig.finish();
    rows.extend(rest);
    assert_eq!(reason, StopReason::Stopped);
    assert_eq!(iterations(&rows), (1..=at).collect::<Vec<_>>());
    let last = Arc::clone(state(&rows[at - 1]));
    // The answer to a later command proves that nothing was on its way.
    let config = FitConfig::default();
    rig.send(WorkerCommand::Inspect { branch: 0, state: last, config: Box::new(config) });
    let answer = rig.snapshot(|snapshot| !snapshot.live);
    assert_eq!(answer.iteration, at);
    assert!(rig.worker.poll().is_none());
    // A pause of what does not run is no event.
    rig.send(WorkerCommand::Pause);
    rig.send(WorkerCommand::RunTo { target: at + 1, run: 1 });
    let (rows, ..) = rig.finish();
    assert_eq!(iterations(&rows), [at + 1]);
}

#[test]
fn settings_changed_during_a_run_hold_from_the_next_step() {
    let mut rig = Rig::new();
    rig.prepared();
    let old = FitConfig::default();
    let mut rows = rig.run_forever(4);
    let new = FitConfig { w_em: 2.0, w_kine: 0.125, tau_pct: 20.0, ..old };
    rig.send(WorkerCommand::Configure(Box::new(new)));
    let (before, event) = rig.rows_until(1, |event| matches!(event, WorkerEvent::ConfigApplied { .. }));
    rows.extend(before);
    let WorkerEvent::ConfigApplied { branch: 0, iteration: k, config } = event else { panic!("{event:?}") };
    assert_eq!(*config, new);
    assert_eq!(iterations(&rows), (1..=k).collect::<Vec<_>>(), "everything before the event is before the change");
    let mut after = rig.more_rows(4);
    rig.send(WorkerCommand::Pause);
    after.extend(rig.finish().0);
    assert_eq!(after[0].report.iteration, k + 1);
    assert_weights(&rows, &old);
    assert_weights(&after, &new);
    assert!(
        (after[0].report.loss - weighted(&after[0].report.terms, &old)).abs() > 1e-6,
        "the weights make a difference"
    );
    let size = |row: &HistoryRow| state(row).losses.len();
    assert!(size(&after[0]) <= 6, "losses to look back on");
}

#[test]
fn settings_changed_before_the_first_step_give_row_0_anew() {
    let mut rig = Rig::new();
    rig.prepared();
    let new = FitConfig { w_em: 3.0, ..FitConfig::default() };
    rig.send(WorkerCommand::Configure(Box::new(new)));
    let (rows, _) = rig.rows_until(1, |event| matches!(event, WorkerEvent::ConfigApplied { iteration: 0, .. }));
    assert_eq!(iterations(&rows), [0]);
    assert_weights(&rows, &new);
}

#[test]
fn a_branch_with_the_same_settings_repeats_the_run_bit_for_bit() {
    let mut rig = Rig::new();
    let (first, _) = rig.prepared();
    rig.send(WorkerCommand::RunTo { target: 25, run: 1 });
    let (mut rows, ..) = rig.finish();
    rows.insert(0, first);
    // Other settings meanwhile must leave no trace.
    let other = FitConfig { learning_rate: 0.02, tau_pct: 30.0, softness: 0.1, ..FitConfig::default() };
    rig.send(WorkerCommand::Configure(Box::new(other)));
    rig.rows_until(1, |event| matches!(event, WorkerEvent::ConfigApplied { iteration: 25, .. }));
    rig.send(WorkerCommand::RunTo { target: 30, run: 1 });
    rig.finish();
    let config = FitConfig::default();
    rig.send(WorkerCommand::Branch {
        branch: 1,
        state: Arc::clone(state(&rows[7])),
        config: Box::new(config),
        erased: Arc::default(),
        around: None,
    });
    rig.send(WorkerCommand::RunTo { target: 25, run: 1 });
    let (again, at, _) = rig.finish();
    assert_eq!(at, 25);
    assert!(again.iter().all(|row| row.branch == 1));
    same(&again, &rows[7..]);
    // And with other settings it is another run from the first step on.
    rig.send(WorkerCommand::Branch {
        branch: 2,
        state: Arc::clone(state(&rows[7])),
        config: Box::new(other),
        erased: Arc::default(),
        around: None,
    });
    rig.send(WorkerCommand::RunTo { target: 8, run: 1 });
    let (differs, ..) = rig.finish();
    assert_eq!(iterations(&differs), [7, 8]);
    assert_weights(&differs, &other);
    assert_ne!(state(&differs[1]).params, state(&rows[8]).params);
}

#[test]
fn a_fit_that_is_resumed_goes_on_bit_for_bit() {
    let mut rig = Rig::new();
    let (_, prepared) = rig.prepared();
    rig.send(WorkerCommand::RunTo { target: 20, run: 1 });
    let (rows, ..) = rig.finish();
    let start = Start::Resume { initial: prepared.initial, state: Arc::clone(state(&rows[9])) };
    rig.prepare_with(1, &FitConfig::default(), start);
    let (none, event) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Prepared(_)));
    let WorkerEvent::Prepared(prepared) = event else { panic!("{event:?}") };
    assert!(none.is_empty() && prepared.found_start.is_none());
    rig.send(WorkerCommand::RunTo { target: 20, run: 1 });
    same(&rig.finish().0, &rows[10..]);
}

#[test]
fn a_new_job_ends_the_old_one_and_its_messages() {
    let mut rig = Rig::new();
    rig.prepared();
    rig.run_forever(2);
    rig.prepare_with(2, &FitConfig::default(), Start::Initialise);
    // Rows of job 1 may be on their way; after the first word of job 2 there are none.
    let mut message = rig.message();
    while let WorkerMessage::Rows(1, _) = message {
        message = rig.message();
    }
    rig.waiting.push_front(message);
    let (rows, _) = rig.rows_until(2, |event| matches!(event, WorkerEvent::Prepared(_)));
    assert_eq!(iterations(&rows), [0]);
    rig.send(WorkerCommand::RunTo { target: 3, run: 1 });
    let (rows, _) = rig.rows_until(2, |event| matches!(event, WorkerEvent::Finished { iteration: 3, .. }));
    assert_eq!(iterations(&rows), [1, 2, 3]);
    assert_eq!(rig.snapshot(|snapshot| snapshot.iteration == 3).job, 2);
}

#[test]
fn a_panic_is_told_and_the_thread_takes_another_job() {
    let mut rig = Rig::new();
    rig.prepared();
    rig.run_forever(2);
    rig.send(WorkerCommand::PanicForTest);
    let (_, event) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Lost(_)));
    let WorkerEvent::Lost(text) = event else { panic!("{event:?}") };
    assert!(text.contains("internal error") && text.contains("asked to panic"), "{text}");
    // The job is gone: asking it for more is answered, not ignored.
    rig.send(WorkerCommand::RunTo { target: FOREVER, run: 1 });
    rig.rows_until(1, |event| matches!(event, WorkerEvent::Lost(_)));
    rig.prepare_with(1, &FitConfig::default(), Start::Initialise);
    rig.rows_until(1, |event| matches!(event, WorkerEvent::Prepared(_)));
    rig.send(WorkerCommand::RunTo { target: 2, run: 1 });
    assert_eq!(iterations(&rig.finish().0), [1, 2]);
}

#[test]
fn a_start_that_is_impossible_is_told() {
    let mut rig = Rig::new();
    let mut frame = Frame::clone(&rig.frame);
    frame.maps[1].data.fill(f64::NAN);
    rig.frame = Arc::new(frame);
    rig.prepare_with(1, &FitConfig::default(), Start::Initialise);
    let (rows, event) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Lost(_)));
    assert!(rows.is_empty());
    let WorkerEvent::Lost(text) = event else { panic!("{event:?}") };
    assert!(text.contains("`vert`") && text.contains("no finite cell"), "{text}");
}

#[test]
fn an_impossible_edit_is_told_and_the_job_stays() {
    let mut rig = Rig::new();
    let (_, prepared) = rig.prepared();
    let mut bad = prepared.initial.clone();
    bad.group_mut(mhp_inspector::body::Group::Position)[4] = f64::NAN;
    rig.send(WorkerCommand::Edit(Box::new(bad)));
    let (rows, event) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Failed(_)));
    assert!(rows.is_empty());
    let WorkerEvent::Failed(text) = event else { panic!("{event:?}") };
    assert!(text.contains("not finite") && text.contains("left eye"), "{text}");
    let mut good = prepared.initial.clone();
    good.group_mut(mhp_inspector::body::Group::Position)[4] += 0.01;
    rig.send(WorkerCommand::Edit(Box::new(good.clone())));
    rig.send(WorkerCommand::RunTo { target: 1, run: 1 });
    let (rows, ..) = rig.finish();
    assert_eq!(iterations(&rows), [0, 1]);
    assert_eq!(state(&rows[0]).params, good);
}

#[test]
fn looking_back_neither_disturbs_the_run_nor_is_lost() {
    let mut rig = Rig::new();
    rig.prepared();
    let rows = rig.run_forever(6);
    let state = Arc::clone(state(&rows[2]));
    let config = FitConfig { w_em: 7.0, ..FitConfig::default() };
    rig.send(WorkerCommand::Inspect { branch: 0, state: Arc::clone(&state), config: Box::new(config) });
    // A slow window: live pictures are published meanwhile, and none of them may replace the answer.
    let mut later = 0;
    let mut last = rows.last().unwrap().report.iteration;
    while later < 6 {
        let WorkerMessage::Rows(1, rows) = rig.message() else { panic!("an event") };
        assert_eq!(rows[0].report.iteration, last + 1);
        last = rows.last().unwrap().report.iteration;
        assert_weights(&rows, &FitConfig::default());
        later += 1;
    }
    let answer = rig.worker.take_snapshot().unwrap();
    assert!(!answer.live);
    assert_eq!((answer.iteration, &answer.params, answer.config.w_em), (3, &state.params, 7.0));
    let expected = weighted(&answer.evaluation.terms, &config);
    assert!((answer.evaluation.loss - expected).abs() < 1e-12);
    let live = rig.snapshot(|snapshot| snapshot.live && snapshot.iteration > 6);
    assert!(live.iterations_per_s > 0.0);
    assert_eq!(live.config, FitConfig::default());
}

#[test]
fn a_paused_worker_sleeps() {
    let mut rig = Rig::new();
    rig.prepared();
    rig.run_forever(2);
    rig.send(WorkerCommand::Pause);
    rig.finish();
    let Some(thread) = rig.thread() else { return };
    assert_eq!(std::fs::read_to_string(thread.join("comm")).unwrap().trim(), "mhp-worker");
    let at = |key: &str| -> u64 {
        let status = std::fs::read_to_string(thread.join("status")).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix(key)).unwrap();
        line.trim().parse().unwrap()
    };
    let ticks = || -> u64 {
        let stat = std::fs::read_to_string(thread.join("stat")).unwrap();
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
    };
    // Its last pictures are published after the event; the thread is asleep when it is scheduled no more.
    let measure = || (ticks(), at("voluntary_ctxt_switches:"), at("nonvoluntary_ctxt_switches:"));
    let deadline = Instant::now() + PATIENCE;
    loop {
        let before = measure();
        std::thread::sleep(Duration::from_millis(200));
        if measure() == before {
            return;
        }
        assert!(Instant::now() < deadline, "the paused thread is still scheduled: {before:?}, {:?}", measure());
    }
}

#[test]
fn dropping_the_worker_during_a_run_ends_its_thread() {
    let mut rig = Rig::new();
    rig.prepared();
    rig.run_forever(2);
    let thread = rig.thread();
    let begun = Instant::now();
    drop(rig);
    assert!(begun.elapsed() < Duration::from_secs(2), "{:?}", begun.elapsed());
    assert!(thread.is_none_or(|thread| !thread.exists()));
}

#[test]
fn every_command_in_the_queue_is_obeyed_in_order() {
    let mut rig = Rig::new();
    let (first, _) = rig.prepared();
    let state = Arc::clone(state(&first));
    for branch in 1..=200 {
        rig.send(WorkerCommand::Branch {
            branch,
            state: Arc::clone(&state),
            config: Box::new(FitConfig::default()),
            erased: Arc::default(),
            around: None,
        });
        rig.send(WorkerCommand::RunTo { target: 1, run: 1 });
        rig.send(WorkerCommand::Pause);
    }
    rig.send(WorkerCommand::RunTo { target: 2, run: 1 });
    let mut branches = Vec::new();
    loop {
        match rig.message() {
            WorkerMessage::Rows(1, rows) => {
                branches.extend(rows.iter().filter(|row| row.report.iteration == 0).map(|row| row.branch));
            }
            WorkerMessage::Event(1, WorkerEvent::Finished { branch: 200, iteration: 2, .. }) => break,
            WorkerMessage::Event(1, WorkerEvent::Finished { .. }) => {}
            other => panic!("did not expect {other:?}"),
        }
    }
    assert_eq!(branches, (1..=200).collect::<Vec<_>>());
}

/// While the worker was busy a finger went over forty values: the newest is fitted, the others never were.
#[test]
fn of_the_fits_that_wait_to_be_done_anew_the_newest_is() {
    let mut rig = Rig::new();
    let (row, prepared) = rig.prepared();
    let begin = Arc::clone(state(&row));
    rig.prepare_with(2, &FitConfig::default(), Start::Warm(prepared.initial));
    for k in 1..=40_u32 {
        let config = Box::new(FitConfig { w_em: f64::from(k), ..FitConfig::default() });
        rig.send(WorkerCommand::Refit {
            branch: 1,
            state: Arc::clone(&begin),
            config,
            target: 5,
            run: u64::from(k),
            erased: Arc::default(),
            around: None,
        });
    }
    let (rows, _) = rig.rows_until(2, |event| matches!(event, WorkerEvent::Prepared(_)));
    assert_eq!(iterations(&rows), [0]);
    let (rows, event) = rig.rows_until(2, |event| matches!(event, WorkerEvent::Refitted { .. }));
    let WorkerEvent::Refitted { branch: 1, config } = event else { panic!("{event:?}") };
    assert_eq!((rows.len(), config.w_em), (0, 40.0));
    let (rows, event) = rig.rows_until(2, |event| matches!(event, WorkerEvent::Finished { .. }));
    assert!(matches!(event, WorkerEvent::Finished { run: 40, branch: 1, iteration: 5, .. }), "{event:?}");
    assert_eq!(iterations(&rows), [0, 1, 2, 3, 4, 5]);
    assert!(rows.iter().all(|row| row.branch == 1));
    let snapshot = rig.snapshot(|snapshot| snapshot.iteration == 5);
    assert_eq!((snapshot.branch, snapshot.config.w_em), (1, 40.0));
}

/// A fit that takes longer than a picture is shown as far as it came, and goes on.
#[test]
fn a_long_fit_that_is_done_anew_is_shown_on_the_way() {
    let mut rig = Rig::new();
    let (row, _) = rig.prepared();
    let began = Instant::now();
    let (state, config) = (Arc::clone(state(&row)), Box::new(FitConfig { w_em: 2.0, ..FitConfig::default() }));
    rig.send(WorkerCommand::Refit {
        branch: 1,
        state,
        config,
        target: FOREVER,
        run: 7,
        erased: Arc::default(),
        around: None,
    });
    let first = rig.snapshot(|snapshot| snapshot.branch == 1);
    assert!(first.iteration > 0 && first.iteration < 10_000, "{} after {:?}", first.iteration, began.elapsed());
    let later = rig.snapshot(|snapshot| snapshot.branch == 1 && snapshot.iteration > first.iteration);
    assert_eq!((first.config.w_em, later.config.w_em), (2.0, 2.0));
    rig.send(WorkerCommand::Pause);
    rig.rows_until(1, |event| matches!(event, WorkerEvent::Refitted { .. }));
    let (rows, event) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Finished { run: 7, .. }));
    assert!(matches!(event, WorkerEvent::Finished { reason: StopReason::Stopped, .. }), "{event:?}");
    assert!(iterations(&rows).windows(2).all(|pair| pair[1] == pair[0] + 1), "no iteration is lost");
}

/// A fit that is not to see some cells is the fit of a frame in which they say nothing, whatever they hold; told otherwise, it
/// sees them.
#[test]
fn erased_cells_take_no_part() {
    use mhp_inspector::mhp::{ErasedCells, Fitter, Problem, erased_marks, masks, percentile};
    let mut rig = Rig::new();
    let (row, prepared) = rig.prepared();
    let erased: Arc<[ErasedCells]> = [ErasedCells { view: 0, bins: vec![[10, 30], [8, 20]], cells: Vec::new() }].into();
    let config = FitConfig { iterations: 5, ..FitConfig::default() };
    let (begin, told) = (Arc::clone(state(&row)), Box::new(config));
    let again = |erased: &Arc<[ErasedCells]>, run: u64| WorkerCommand::Refit {
        branch: 1,
        state: Arc::clone(&begin),
        config: told.clone(),
        target: 5,
        run,
        erased: Arc::clone(erased),
        around: None,
    };
    rig.send(again(&erased, 1));
    rig.rows_until(1, |event| matches!(event, WorkerEvent::Refitted { .. }));
    let (without, _) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Finished { .. }));
    rig.send(again(&Arc::default(), 2));
    rig.rows_until(1, |event| matches!(event, WorkerEvent::Refitted { .. }));
    let (with, _) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Finished { .. }));

    let problem = &prepared.problem;
    let mut map = problem.map(0).to_vec();
    let width = problem.views[0].axes[1].bins;
    (10..30).for_each(|row| map[row * width + 8..row * width + 20].fill(1e6));
    let maps = [map.as_slice(), problem.map(1)];
    let (radar, skeleton) = (problem.radar.clone(), problem.skeleton.clone());
    let loud = Problem::new(radar, skeleton, problem.views.clone(), &maps).unwrap();
    let marks = erased_marks(&problem.views, &erased);
    let left = Arc::new(loud.without(&marks).unwrap());
    for (problem, rows) in [(Arc::clone(&left), &without), (Arc::clone(problem), &with)] {
        let mut fitter = Fitter::new(problem, config, Precision::F64, prepared.initial.clone()).unwrap();
        let mut losses = vec![fitter.report().loss];
        losses.extend((0..5).map(|_| fitter.step().unwrap().loss));
        assert_eq!(rows.iter().map(|row| row.report.loss).collect::<Vec<_>>(), losses);
    }
    assert_ne!(with[0].report.loss, without[0].report.loss);
    // The percentile of H_ori is that of what is left of the region, and nothing erased is inside it; in single precision too.
    for precision in [Precision::F64, Precision::F32] {
        let fitter = Fitter::new(Arc::clone(&left), config, precision, prepared.initial.clone()).unwrap();
        let h_sim = mhp_inspector::mhp::simulate(problem, &config, Precision::F32, fitter.params());
        let seen = masks(fitter.objective(), 0, &h_sim[0]);
        let inside: Vec<usize> = (0..map.len()).filter(|&cell| seen.inside[cell]).collect();
        assert!(!inside.is_empty() && inside.iter().all(|&cell| !marks[0][cell]));
        let values: Vec<f64> = inside.iter().map(|&cell| problem.map(0)[cell]).collect();
        let threshold = percentile(&values, 100.0 - config.tau_pct);
        assert!(inside.iter().all(|&cell| seen.ori[cell] == (problem.map(0)[cell] > threshold)));
        let iou = fitter.report().iou[0].unwrap();
        assert!((seen.iou().unwrap() - iou).abs() < 0.02, "{precision:?}: {iou}");
        let told = fitter.report().loss;
        assert!((told - without[0].report.loss).abs() < 1e-4 * told, "{precision:?}: {told}");
    }
}

/// A breakpoint stops a run once where it holds, says which, and lets the run go on from there.
#[test]
fn a_run_stops_at_a_breakpoint_and_goes_on() {
    let mut rig = Rig::new();
    rig.prepared();
    let watched = ["iteration>=3", "loss<0"].map(|text| text.parse().unwrap());
    rig.send(WorkerCommand::Watch(watched.into_iter().enumerate().map(|(k, of)| (k as u32 + 40, of)).collect()));
    rig.send(WorkerCommand::RunTo { target: 10, run: 1 });
    let (rows, event) = rig.rows_until(1, |event| matches!(event, WorkerEvent::Broke { .. }));
    assert!(matches!(event, WorkerEvent::Broke { branch: 0, iteration: 3, breakpoint: 40 }), "{event:?}");
    assert_eq!(iterations(&rows), [1, 2, 3]);
    assert_eq!(rig.finish().1, 3);
    // It still holds: the run that goes on is not stopped again.
    rig.send(WorkerCommand::RunTo { target: 10, run: 2 });
    let (rows, iteration, reason) = rig.finish();
    assert_eq!((rows.len(), iteration, reason), (7, 10, StopReason::Iterations));
    // Another fit begins: it is armed again.
    rig.prepare_with(2, &FitConfig::default(), Start::Initialise);
    rig.rows_until(2, |event| matches!(event, WorkerEvent::Prepared(_)));
    rig.send(WorkerCommand::RunTo { target: 10, run: 3 });
    let (_, event) = rig.rows_until(2, |event| matches!(event, WorkerEvent::Broke { .. }));
    assert!(matches!(event, WorkerEvent::Broke { iteration: 3, .. }), "{event:?}");
    let (_, event) = rig.rows_until(2, |event| matches!(event, WorkerEvent::Finished { .. }));
    assert!(matches!(event, WorkerEvent::Finished { reason: StopReason::Breakpoint, .. }), "{event:?}");
}
