//! The worker's loop: drain every command, take one step, publish; block while nothing runs.

use super::handle::Latest;
use super::protocol::{
    HistoryRow, JobId, Kept, Prepare, PreparedFit, Snapshot, Start, WorkerCommand, WorkerEvent, WorkerMessage,
};
use crate::body::Pppr;
use crate::condition::{Breakpoint, Watch};
use crate::config::{FitConfig, Parameterization};
use crate::dataset::Truth;
use crate::diagnose::joint_errors;
use crate::mhp::{
    ErasedCells, FitError, FitState, Fitter, GivenStart, Objective, Precision, Problem, StepReport, StopReason, masks,
    predict, simulate, without,
};
use crate::start::{find_start_along, find_start_in, problem_of};
use crate::task::{catch_panic, milliseconds};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Snapshots are published at most this often while running.
const SNAPSHOT_INTERVAL: Duration = Duration::from_millis(50);
/// However busy the machine is, a run is seen to go on.
const LONGEST_SNAPSHOT_INTERVAL: Duration = Duration::from_millis(500);
/// A running fit spends at most one part in this many on snapshots, as long as these are not too far apart.
const SNAPSHOT_SHARE: u32 = 40;
/// Rows are sent in batches at most this often while running.
const ROWS_INTERVAL: Duration = Duration::from_millis(33);
/// So many iterations keep every state; in twice as many every second is kept, in four times as many every fourth: nobody
/// goes through thousands one by one, and fresh memory for each is a large part of what being watched costs.
const CLOSELY: usize = 1024;

/// A fit that is done anew is shown when it has ended, or with what it came to in this time: then newer settings count.
const REFIT_SHOWN: Duration = Duration::from_millis(16);
/// Steps that are taken to tell how long one takes.
const TIMED_STEPS: usize = 3;
/// A step this slow is timed once, ms: longer than a busy machine keeps a thread waiting.
const SLOW_STEP_MS: f64 = 20.0;

/// The start of a branch whose first row this job did not make.
const NOWHERE: usize = usize::MAX;

/// One fit.
struct Job {
    id: JobId,
    branch: u32,
    /// The iteration of the branch's first row.
    branch_start: usize,
    /// What was measured.
    problem: Arc<Problem>,
    /// The pose that fixes the EM region.
    initial: Pppr,
    precision: Precision,
    /// What of it the fit sees.
    seen: Arc<Problem>,
    /// What of it the fit does not see.
    erased: Arc<[ErasedCells]>,
    /// The pose that fixes the EM region instead of the initial one.
    around: Option<Arc<Pppr>>,
    fitter: Fitter,
    /// A second objective with the same EM region, for looking at states that are not the current one.
    viewer: Objective,
    target: usize,
    /// Number of the newest run.
    run: u64,
    rows: Vec<HistoryRow>,
    run_began: Instant,
    steps_in_run: usize,
    rows_sent: Instant,
    snapshot_sent: Instant,
    snapshot_cost: Duration,
    dirty: bool,
    /// Time from step to step; `None` as fast as it goes.
    pause: Option<Duration>,
    /// The run is a fit that is done anew.
    anew: bool,
    /// When a paced run takes its next step.
    next_step: Instant,
    /// A branch that is written anew, until its first rows are sent.
    refit: Option<Refit>,
    /// Where runs stop, the numbers of what is watched for, and what held at the last step.
    watch: Watch,
    watched: Vec<u32>,
    broke: Option<u32>,
    truth: Option<Truth>,
}

/// A fit that is done anew, of which nothing was shown yet.
struct Refit {
    began: Instant,
    config: Box<FitConfig>,
}

/// The thread's state.
pub(super) struct Thread {
    inbox: Receiver<WorkerCommand>,
    outbox: Sender<WorkerMessage>,
    snapshot: Arc<Latest>,
    wake: Box<dyn Fn() + Send>,
    job: Option<Job>,
    /// The job that the last `Prepare` named, also when it failed.
    current: JobId,
    /// Iterations a second that runs may take; `None` as fast as they go.
    pace: Option<f64>,
    /// Where runs stop.
    breakpoints: Vec<(u32, Breakpoint)>,
}

impl Thread {
    pub(super) fn new(
        inbox: Receiver<WorkerCommand>,
        outbox: Sender<WorkerMessage>,
        snapshot: Arc<Latest>,
        wake: Box<dyn Fn() + Send>,
    ) -> Self {
        Self { inbox, outbox, snapshot, wake, job: None, current: 0, pace: None, breakpoints: Vec::new() }
    }

    /// Until `Shutdown` or until the window is gone.
    pub(super) fn run(&mut self) {
        loop {
            match catch_panic(|| self.turn()) {
                Ok(true) => {}
                Ok(false) => return,
                Err(text) => {
                    self.event(WorkerEvent::Lost(format!("the fit stopped on an internal error: {text}")));
                    self.job = None;
                }
            }
        }
    }

    /// Drains the commands and takes one step. False at the end.
    fn turn(&mut self) -> bool {
        let mut first = None;
        match self.job.as_ref().filter(|job| job.is_running()).map(Job::wait) {
            Some(Wait::Not) => {
                self.step();
                return true;
            }
            Some(Wait::For(time)) => match self.inbox.recv_timeout(time) {
                Ok(command) => first = Some(command),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return false,
            },
            Some(Wait::Look) => {}
            None => {
                self.publish();
                match self.inbox.recv() {
                    Ok(command) => first = Some(command),
                    Err(_) => return false,
                }
            }
        }
        let mut commands = first.into_iter().chain(self.inbox.try_iter()).collect::<Vec<_>>().into_iter().peekable();
        while let Some(command) = commands.next() {
            let overtaken = commands.peek().is_some_and(|next| is_overtaken(&command, next));
            if !overtaken && !self.handle(command) {
                return false;
            }
        }
        if self.job.as_ref().is_some_and(Job::is_due) {
            self.step();
        }
        true
    }

    fn step(&mut self) {
        let Some(job) = self.job.as_mut().filter(|job| job.is_running()) else { return };
        match job.step() {
            Ok(None) => {}
            Ok(Some(reason)) => {
                let finished = job.finished(reason);
                let (branch, iteration) = (job.branch, job.iteration());
                let broke = job.broke.take();
                self.publish();
                if let Some(breakpoint) = broke {
                    self.event(WorkerEvent::Broke { branch, iteration, breakpoint });
                }
                self.event(finished);
                return;
            }
            Err(error) => {
                job.target = 0;
                self.publish();
                self.event(WorkerEvent::Failed(error.to_string()));
                return;
            }
        }
        self.publish_in_passing();
    }

    fn handle(&mut self, command: WorkerCommand) -> bool {
        match command {
            WorkerCommand::Prepare(prepare) => self.prepare(*prepare),
            WorkerCommand::Discard => self.job = None,
            WorkerCommand::Pace(pace) => {
                self.pace = pace;
                self.job.iter_mut().for_each(|job| job.set_pace(pace));
            }
            WorkerCommand::Watch(breakpoints) => {
                self.job.iter_mut().for_each(|job| job.watch_for(&breakpoints));
                self.breakpoints = breakpoints;
            }
            WorkerCommand::Shutdown => return false,
            command => {
                if let Some(job) = self.job.as_mut() {
                    match job.handle(command) {
                        Ok(Reply::Nothing) => {}
                        Ok(Reply::Event(event)) => self.event(event),
                        Ok(Reply::Show(snapshot)) => {
                            self.snapshot.put(*snapshot);
                            (self.wake)();
                        }
                        Err(error) => {
                            job.target = 0;
                            self.event(WorkerEvent::Failed(error.to_string()));
                        }
                    }
                } else if matches!(command, WorkerCommand::RunTo { .. }) {
                    self.event(WorkerEvent::Lost("there is no fit to run: reset it".into()));
                }
            }
        }
        true
    }

    fn prepare(&mut self, prepare: Prepare) {
        self.job = None;
        self.current = prepare.job;
        match Job::new(prepare) {
            Ok((mut job, prepared)) => {
                job.set_pace(self.pace);
                job.watch_for(&self.breakpoints);
                self.job = Some(job);
                self.event(WorkerEvent::Prepared(Box::new(prepared)));
            }
            Err(error) => self.event(WorkerEvent::Lost(error.to_string())),
        }
    }

    /// Everything that waits: at pause, stop and end.
    fn publish(&mut self) {
        self.send_rows();
        if let Some(job) = self.job.as_mut().filter(|job| job.dirty) {
            self.snapshot.put(job.snapshot());
            (self.wake)();
        }
    }

    /// While running: rows and snapshots at their own pace.
    fn publish_in_passing(&mut self) {
        let Some(job) = self.job.as_mut() else { return };
        if job.refit.is_some() {
            // As far as it came, or nothing: rows without their picture would be of two fits.
            if !job.hurries() {
                self.publish();
            }
            return;
        }
        let pause = SNAPSHOT_INTERVAL.max(job.snapshot_cost * SNAPSHOT_SHARE).min(LONGEST_SNAPSHOT_INTERVAL);
        if job.snapshot_sent.elapsed() >= pause {
            self.snapshot.put(job.snapshot());
            self.send_rows();
            (self.wake)();
        } else if job.rows_sent.elapsed() >= ROWS_INTERVAL {
            self.send_rows();
            (self.wake)();
        }
    }

    fn send_rows(&mut self) {
        if let Some(job) = self.job.as_mut().filter(|job| !job.rows.is_empty()) {
            job.rows_sent = Instant::now();
            if let Some(Refit { config, .. }) = job.refit.take() {
                let event = WorkerEvent::Refitted { branch: job.branch, config };
                let _ = self.outbox.send(WorkerMessage::Event(job.id, event));
            }
            let _ = self.outbox.send(WorkerMessage::Rows(job.id, job.take_rows()));
            (self.wake)();
        }
    }

    fn event(&mut self, event: WorkerEvent) {
        self.send_rows();
        let _ = self.outbox.send(WorkerMessage::Event(self.current, event));
        (self.wake)();
    }
}

/// Whether what a finger asks next leaves nothing of what it asked before.
fn is_overtaken(command: &WorkerCommand, next: &WorkerCommand) -> bool {
    use WorkerCommand::{Edit, Refit};
    matches!((command, next), (Refit { .. }, Refit { .. }) | (Edit(_), Edit(_)))
}

/// Milliseconds of a step, the least of a few that are taken back again.
fn step_ms(fitter: &mut Fitter) -> Result<f64, FitError> {
    let begin = fitter.state();
    let mut least = f64::INFINITY;
    for _ in 0..TIMED_STEPS {
        let began = Instant::now();
        // A start that cannot be stepped from is told when somebody asks for steps.
        if fitter.step().is_err() {
            break;
        }
        least = least.min(milliseconds(began));
        if least > SLOW_STEP_MS {
            break;
        }
    }
    fitter.restore(begin)?;
    Ok(if least.is_finite() { least } else { 0.0 })
}

/// Of so many iterations the state of one is kept.
fn stride(iteration: usize) -> usize {
    (iteration / CLOSELY).next_power_of_two()
}

/// What a run does before its next step.
enum Wait {
    /// Take it.
    Not,
    /// Look whether somebody asks for something.
    Look,
    /// Wait that long for somebody to ask for something.
    For(Duration),
}

enum Reply {
    Nothing,
    Event(WorkerEvent),
    Show(Box<Snapshot>),
}

impl Job {
    fn new(prepare: Prepare) -> Result<(Self, PreparedFit), FitError> {
        let Prepare { job, branch, dataset, frame, config, precision, start, erased, around } = prepare;
        let problem = Arc::new(problem_of(&dataset, &frame)?);
        let began = Instant::now();
        let mut given = Vec::new();
        let (mut found_start, initial, state) = match start {
            Start::Initialise | Start::Along => {
                let find = if matches!(start, Start::Along) { find_start_along } else { find_start_in };
                let found = find(&dataset, frame.index, &problem, &config)?;
                let initial = found.initialisation.params.clone();
                (Some(found), initial, None)
            }
            Start::Warm(params) => (None, predict(&problem, &config, &params), None),
            Start::Given(start) => {
                given = start.given;
                (None, start.params, None)
            }
            Start::Resume { initial, state } => (None, initial, Some(state)),
        };
        let init_ms = milliseconds(began);
        let seen = without(&problem, &erased)?;
        let region = around.as_deref().unwrap_or(&initial);
        let begun = FitState::given(GivenStart { params: region.clone(), given });
        let mut fitter = Fitter::starting_at(Arc::clone(&seen), config, precision, begun)?;
        if let Some(found) = found_start.as_mut().filter(|_| fitter.is_held()) {
            found.initialisation.tell_held();
        }
        let viewer = Objective::new(Arc::clone(&seen), config, precision, region)?;
        let warnings = viewer.warnings().to_vec();
        let resumed = state.is_some();
        if let Some(state) = state {
            fitter.restore(state)?;
        }
        let step_ms = step_ms(&mut fitter)?;
        let now = Instant::now();
        let mut new = Self {
            id: job,
            branch,
            branch_start: if resumed { NOWHERE } else { 0 },
            problem: Arc::clone(&problem),
            initial: initial.clone(),
            precision,
            seen,
            erased,
            around,
            fitter,
            viewer,
            target: 0,
            run: 0,
            rows: Vec::new(),
            run_began: now,
            steps_in_run: 0,
            rows_sent: now,
            snapshot_sent: now,
            snapshot_cost: Duration::ZERO,
            dirty: true,
            pause: None,
            anew: false,
            next_step: now,
            refit: None,
            watch: Watch::default(),
            watched: Vec::new(),
            broke: None,
            truth: frame.truth.clone(),
        };
        if !resumed {
            new.push_row(new.fitter.report());
        }
        Ok((new, PreparedFit { problem, found_start, initial, warnings, init_ms, step_ms }))
    }

    fn iteration(&self) -> usize {
        self.fitter.iteration()
    }

    /// From now on the fit has these settings, does not see these cells and has its EM region around this pose, as if it had
    /// been begun so. A window of frames is laid around that pose: where the fit stood before must not be in it.
    fn begin_with(
        &mut self,
        config: &FitConfig,
        erased: Arc<[ErasedCells]>,
        around: Option<Arc<Pppr>>,
    ) -> Result<(), FitError> {
        let same = self.erased == erased && self.around == around;
        let in_window = |config: &FitConfig| config.parameterization == Parameterization::Motion;
        if same && !in_window(config) && !in_window(self.fitter.config()) {
            return self.fitter.set_config(*config);
        }
        if !same {
            let seen = without(&self.problem, &erased)?;
            let region = around.as_deref().unwrap_or(&self.initial);
            self.viewer = Objective::new(Arc::clone(&seen), *config, self.precision, region)?;
            (self.seen, self.erased, self.around) = (seen, erased, around);
        }
        let region = self.around.as_deref().unwrap_or(&self.initial).clone();
        self.fitter = Fitter::new(Arc::clone(&self.seen), *config, self.precision, region)?;
        Ok(())
    }

    fn is_running(&self) -> bool {
        self.target > self.iteration()
    }

    /// Whether a fit that is done anew has time left before it is shown.
    fn hurries(&self) -> bool {
        self.refit.as_ref().is_some_and(|refit| refit.began.elapsed() < REFIT_SHOWN)
    }

    fn unpaced(&self) -> bool {
        self.anew || self.pause.is_none()
    }

    fn wait(&self) -> Wait {
        if self.hurries() {
            return Wait::Not;
        }
        let left = self.next_step.saturating_duration_since(Instant::now());
        if self.unpaced() || left.is_zero() { Wait::Look } else { Wait::For(left) }
    }

    /// Whether the next step is to be taken now.
    fn is_due(&self) -> bool {
        self.is_running() && (self.unpaced() || self.next_step <= Instant::now())
    }

    fn set_pace(&mut self, pace: Option<f64>) {
        self.pause = pace.filter(|pace| *pace > 0.0).and_then(|pace| Duration::try_from_secs_f64(1.0 / pace).ok());
        self.next_step = Instant::now();
    }

    /// Runs stop where one of these holds.
    fn watch_for(&mut self, breakpoints: &[(u32, Breakpoint)]) {
        self.watched = breakpoints.iter().map(|(number, _)| *number).collect();
        let majpe_mm = self.majpe_mm();
        self.watch.replace(breakpoints.iter().map(|(_, of)| of.clone()).collect(), &self.fitter, majpe_mm);
    }

    /// What is watched begins anew where the fit stands.
    fn begin_watch(&mut self) {
        let majpe_mm = self.majpe_mm();
        self.watch.begin(&self.fitter, majpe_mm);
    }

    /// Mean joint error, mm, where there is truth and somebody watches.
    fn majpe_mm(&self) -> Option<f64> {
        let truth = self.truth.as_ref().filter(|_| !self.watched.is_empty())?;
        let joints = self.problem.skeleton.joints.len();
        joint_errors(self.fitter.params().positions(), &truth.joints, joints).map(|errors| errors.majpe_mm)
    }

    fn finished(&self, reason: StopReason) -> WorkerEvent {
        WorkerEvent::Finished {
            run: self.run,
            branch: self.branch,
            iteration: self.iteration(),
            reason,
            run_ms: milliseconds(self.run_began),
        }
    }

    fn push_row(&mut self, report: StepReport) {
        let begins = report.iteration == self.branch_start;
        let kept = if begins || report.iteration.is_multiple_of(stride(report.iteration)) {
            Kept::State(self.fitter.state())
        } else {
            Kept::Positions(self.fitter.params().positions().into())
        };
        self.rows.push(HistoryRow { branch: self.branch, report, kept });
        self.dirty = true;
    }

    /// The rows since the last call.
    fn take_rows(&mut self) -> Vec<HistoryRow> {
        self.keep_last();
        std::mem::take(&mut self.rows)
    }

    /// Where the fit stands it can always be gone back to: before it is led elsewhere, and before anybody hears of it.
    fn keep_last(&mut self) {
        if let Some(last) = self.rows.last_mut().filter(|last| last.kept.state().is_none()) {
            last.kept = Kept::State(self.fitter.state());
        }
    }

    fn step(&mut self) -> Result<Option<StopReason>, FitError> {
        let report = self.fitter.step()?;
        if let Some(pause) = self.pause {
            // What a step takes is part of the pause; who was held up does not hurry after it.
            self.next_step = (self.next_step + pause).max(Instant::now());
        }
        self.steps_in_run += 1;
        let (iteration, converged) = (report.iteration, report.converged);
        self.push_row(report);
        // A fit under a finger goes to its end.
        if !self.anew && !self.watch.is_empty() {
            let majpe_mm = self.majpe_mm();
            if let Some(which) = self.watch.step(&self.fitter, majpe_mm) {
                self.broke = self.watched.get(which).copied();
                self.target = 0;
                return Ok(Some(StopReason::Breakpoint));
            }
        }
        if converged && self.fitter.config().stop_when_converged {
            self.target = 0;
            return Ok(Some(StopReason::Converged));
        }
        Ok((iteration >= self.target).then_some(StopReason::Iterations))
    }

    fn handle(&mut self, command: WorkerCommand) -> Result<Reply, FitError> {
        self.keep_last();
        match command {
            WorkerCommand::RunTo { target, run } => {
                self.begin_run(target, run);
                if !self.is_running() {
                    return Ok(Reply::Event(self.finished(StopReason::Iterations)));
                }
            }
            WorkerCommand::Refit { branch, state, config, target, run, erased, around } => {
                self.rows.clear();
                self.begin_with(&config, erased, around)?;
                self.fitter.restore(state)?;
                (self.branch, self.branch_start) = (branch, self.iteration());
                self.push_row(self.fitter.report());
                self.begin_watch();
                self.begin_run(target, run);
                self.anew = true;
                self.refit = Some(Refit { began: self.run_began, config });
                if !self.is_running() {
                    return Ok(Reply::Event(self.finished(StopReason::Iterations)));
                }
            }
            WorkerCommand::Pause => {
                let was_running = self.is_running();
                self.target = 0;
                if was_running {
                    return Ok(Reply::Event(self.finished(StopReason::Stopped)));
                }
            }
            WorkerCommand::Configure(config) => {
                self.fitter.set_config(*config)?;
                self.dirty = true;
                let (branch, iteration) = (self.branch, self.iteration());
                if iteration == self.branch_start {
                    // The branch begins with these settings, so its first row is theirs.
                    self.push_row(self.fitter.report());
                }
                return Ok(Reply::Event(WorkerEvent::ConfigApplied { branch, iteration, config }));
            }
            WorkerCommand::Branch { branch, state, config, erased, around } => {
                self.target = 0;
                self.begin_with(&config, erased, around)?;
                self.fitter.restore(state)?;
                self.branch = branch;
                self.branch_start = self.iteration();
                self.push_row(self.fitter.report());
                self.begin_watch();
            }
            WorkerCommand::Edit(params) => {
                self.fitter.set_params(*params)?;
                self.push_row(self.fitter.report());
                self.begin_watch();
            }
            WorkerCommand::Inspect { branch, state, config } => {
                return Ok(Reply::Show(Box::new(self.inspect(branch, &state, &config))));
            }
            #[expect(clippy::panic, reason = "the test hook that proves the window survives a panic")]
            WorkerCommand::PanicForTest => panic!("asked to panic"),
            WorkerCommand::Prepare(_)
            | WorkerCommand::Discard
            | WorkerCommand::Pace(_)
            | WorkerCommand::Watch(_)
            | WorkerCommand::Shutdown => {}
        }
        Ok(Reply::Nothing)
    }

    fn begin_run(&mut self, target: usize, run: u64) {
        (self.target, self.run, self.anew) = (target, run, false);
        self.next_step = Instant::now();
        self.run_began = Instant::now();
        self.steps_in_run = 0;
    }

    fn inspect(&mut self, branch: u32, state: &FitState, config: &FitConfig) -> Snapshot {
        self.viewer.set_config(*config);
        self.viewer.hold_to(&state.given);
        let evaluation = self.viewer.evaluate(&state.params);
        let h_sim = simulate(&self.problem, config, Precision::F32, &state.params);
        let masks = (0..h_sim.len()).map(|view| masks(&self.viewer, view, &h_sim[view])).collect();
        Snapshot {
            job: self.id,
            branch,
            iteration: state.iteration,
            live: false,
            config: *config,
            params: state.params.clone(),
            evaluation,
            h_sim,
            masks,
            iterations_per_s: 0.0,
        }
    }

    fn snapshot(&mut self) -> Snapshot {
        let began = Instant::now();
        let config = *self.fitter.config();
        let params = self.fitter.params().clone();
        let h_sim = simulate(&self.problem, &config, Precision::F32, &params);
        let masks = (0..h_sim.len()).map(|view| masks(self.fitter.objective(), view, &h_sim[view])).collect();
        let running = self.is_running();
        let seconds = self.run_began.elapsed().as_secs_f64();
        let snapshot = Snapshot {
            job: self.id,
            branch: self.branch,
            iteration: self.iteration(),
            live: true,
            config,
            params,
            evaluation: self.fitter.evaluation().clone(),
            h_sim,
            masks,
            iterations_per_s: if running && seconds > 0.0 { self.steps_in_run as f64 / seconds } else { 0.0 },
        };
        self.dirty = false;
        self.snapshot_cost = began.elapsed();
        self.snapshot_sent = Instant::now();
        snapshot
    }
}
