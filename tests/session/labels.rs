//! Labels, evidence and strata in `Session::apply` without threads: what a window meets only when answers come late.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use crate::{SLOW_MS, dataset};
use mhp_inspector::body::Pppr;
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::diagnose::Evidence;
use mhp_inspector::labels::{Change, FrameId, Judged, Label, LabelPlace, Record, Tag};
use mhp_inspector::mhp::{Evaluation, initialise};
use mhp_inspector::session::{
    ActKind, Changes, Command, Commit, Done, Effect, FitHashes, LabelStatus, LabelTable, LogLevel, OpenedLabels,
    Report, Session, SessionFile, StrataStatus, Written,
};
use mhp_inspector::start::problem_alone;
use mhp_inspector::study::complexity::Complexity;
use mhp_inspector::worker::{PreparedFit, Snapshot, WorkerCommand, WorkerEvent, WorkerMessage};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// A session on a data set, and a journal that answers when it is told to.
struct Bench {
    session: Session,
    dataset: Arc<Dataset>,
    journal: HashMap<usize, Label>,
    folder: tempfile::TempDir,
}

impl Bench {
    /// Ada labels a data set of six frames; its journals are open.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let dataset = dataset(folder.path(), 6);
        let mut bench = Self { session: Session::default(), dataset, journal: HashMap::new(), folder };
        bench.session.apply(Command::SetAnnotator("ada".into()));
        let id = bench.open();
        bench.opened(id, LabelTable::new());
        bench
    }

    /// Opens the data set; answers the number under which its journals are read.
    fn open(&mut self) -> u64 {
        let path = self.folder.path().to_path_buf();
        let effects = self.session.report(Report::Opened(path, Ok(Arc::clone(&self.dataset))));
        reading(&effects)
    }

    fn opened(&mut self, id: u64, table: LabelTable) {
        let place = LabelPlace::in_folder(&self.folder.path().join("mhp-labels"));
        let opened = OpenedLabels { place, table, last_edited: None, warnings: Vec::new() };
        self.session.report(Report::LabelsOpened(id, Ok(Box::new(opened))));
    }

    /// Applies a command that asks the journal for one act.
    fn asks(&mut self, command: Command) -> Commit {
        let shown = format!("{command:?}");
        let effects = self.session.apply(command);
        commit_of(effects).unwrap_or_else(|| panic!("{shown} asks for nothing"))
    }

    /// True where a command asks the journal for nothing.
    fn asks_nothing(&mut self, command: Command) -> bool {
        commit_of(self.session.apply(command)).is_none()
    }

    /// The journal writes an act and says so; answers the frames that it changed.
    fn write(&mut self, commit: &Commit) -> Vec<usize> {
        let (mut changes, mut records) = (Vec::new(), Vec::new());
        for (index, change, judged) in asked(commit) {
            let before = self.journal.get(&index).cloned().unwrap_or_default();
            let after = change.applied(&before);
            if after == before {
                continue;
            }
            self.journal.insert(index, after.clone());
            changes.push((index, before, after.clone()));
            records.push(Arc::new(record("ada", index, after, judged)));
        }
        let frames = changes.iter().map(|(frame, ..)| *frame).collect();
        let result = Ok(Done { changes: Changes::of(changes), records, scored: BTreeSet::new() });
        self.answer(commit, result);
        frames
    }

    fn fail(&mut self, commit: &Commit) {
        self.answer(commit, Err("no space left on device".into()));
    }

    fn answer(&mut self, commit: &Commit, result: Result<Done, String>) {
        let Commit { id, kind, act, .. } = commit.clone();
        self.session.report(Report::LabelsWritten(Written { id, kind, act, result }));
    }

    fn tags(&self, frame: usize) -> String {
        self.session.labels.label(frame).tags.to_string()
    }

    fn names(&self) -> (Option<&str>, Option<&str>) {
        (self.session.labels.undo_name(), self.session.labels.redo_name())
    }

    fn told(&self, level: LogLevel, words: &str) -> bool {
        self.session.log.iter().any(|line| line.level == level && line.text.contains(words))
    }

    /// Frame `index` is read, prepared and drawn at its start pose.
    fn show(&mut self, index: usize) {
        let frame = Arc::new(self.dataset.load(index).unwrap());
        let effects = self.session.report(Report::FrameLoaded(index, Ok(frame)));
        let prepare = effects.into_iter().find_map(|effect| match effect {
            Effect::Send(WorkerCommand::Prepare(prepare)) => Some(*prepare),
            _ => None,
        });
        let prepare = prepare.unwrap();
        let problem = Arc::new(problem_alone(&prepare.dataset, &prepare.frame).unwrap());
        let params = initialise(&problem, &FitConfig::default()).unwrap().params;
        let initial = params.clone();
        let prepared =
            PreparedFit { problem, found_start: None, initial, warnings: Vec::new(), init_ms: 1.0, step_ms: SLOW_MS };
        let event = WorkerEvent::Prepared(Box::new(prepared));
        self.session.report(Report::Worker(WorkerMessage::Event(prepare.job, event)));
        self.draw(params);
    }

    /// The worker shows these parameters; answers under which key evidence on them is asked for.
    fn draw(&mut self, params: Pppr) -> Option<FitHashes> {
        let zeros = Evaluation::zeros(params.shape());
        let evaluation = Evaluation { loss: 1.0, iou: vec![None; 2].into(), ..zeros };
        let (job, config) = (self.session.fit.job, FitConfig::default());
        let (h_sim, masks) = (Vec::new(), Vec::new());
        let (branch, iteration, live, iterations_per_s) = (0, 0, true, 0.0);
        let snapshot =
            Snapshot { job, branch, iteration, live, config, params, evaluation, h_sim, masks, iterations_per_s };
        let effects = self.session.report(Report::Snapshot(Box::new(snapshot)));
        effects.into_iter().find_map(|effect| match effect {
            Effect::Evidence(request) => Some(request.fit),
            _ => None,
        })
    }

    /// Draws a pose that differs by `by` metres.
    fn draw_moved(&mut self, by: f64) -> FitHashes {
        let mut params = self.session.fit.initial.clone().unwrap();
        params.group_mut(mhp_inspector::body::Group::Position)[0] += by;
        self.draw(params).unwrap()
    }
}

fn reading(effects: &[Effect]) -> u64 {
    let found = effects.iter().find_map(|effect| match effect {
        Effect::OpenLabels { id, .. } => Some(*id),
        _ => None,
    });
    found.unwrap()
}

/// Frame, change and what is judged, of an act.
fn asked(commit: &Commit) -> Vec<(usize, Change, Judged)> {
    let judged = |frame| commit.judged.get(&frame).cloned().unwrap_or_default();
    commit.asked.each().map(|(frame, change)| (frame, change, judged(frame))).collect()
}

fn commit_of(effects: Vec<Effect>) -> Option<Commit> {
    effects.into_iter().find_map(|effect| match effect {
        Effect::CommitLabels(commit) => Some(commit),
        _ => None,
    })
}

fn record(annotator: &str, index: usize, label: Label, judged: Judged) -> Record {
    Record {
        dataset: "f00d".into(),
        frame: FrameId { path: format!("frames/{index:03}"), index },
        label,
        annotator: annotator.into(),
        time: "2026-01-01T00:00:00.000Z".into(),
        after: None,
        act: "test".into(),
        program: "0".into(),
        judged,
    }
}

fn tagged(annotator: &str, index: usize, tag: Tag) -> (usize, Arc<Record>) {
    let label = Label { tags: mhp_inspector::labels::Tags::NONE.with(tag), ..Label::default() };
    (index, Arc::new(record(annotator, index, label, Judged::default())))
}

fn evidence(score: f64) -> Vec<Evidence> {
    vec![Evidence {
        mode: Tag::F1,
        score: Some(score),
        raw: None,
        measures: Vec::new(),
        summary: String::new(),
        findings: Vec::new(),
    }]
}

#[test]
fn a_second_press_before_the_first_answer_toggles_back() {
    let mut bench = Bench::new();
    let first = bench.asks(Command::ToggleTag(Tag::F1));
    assert_eq!((first.act.as_str(), bench.tags(0).as_str()), ("tag F1", ""), "nothing is shown before it is written");
    let second = bench.asks(Command::ToggleTag(Tag::F1));
    assert_eq!(second.act, "untag F1");
    bench.write(&first);
    assert_eq!(bench.tags(0), "F1");
    bench.write(&second);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("", (Some("untag F1"), None)));
}

#[test]
fn what_could_not_be_written_is_not_shown_and_is_told() {
    let mut bench = Bench::new();
    let commit = bench.asks(Command::ToggleTag(Tag::F3));
    bench.fail(&commit);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("", (None, None)));
    assert!(bench.told(LogLevel::Error, "“tag F3” was not written and is not done: no space left on device"));
    // The next press asks for the tag again, not for its removal.
    assert_eq!(bench.asks(Command::ToggleTag(Tag::F3)).act, "tag F3");
}

#[test]
fn undo_waits_for_the_journal_and_survives_its_failure() {
    let mut bench = Bench::new();
    let commit = bench.asks(Command::ToggleTag(Tag::F1));
    assert_eq!(bench.names(), (None, None));
    assert!(bench.asks_nothing(Command::Undo) && bench.asks_nothing(Command::Redo));
    bench.write(&commit);
    assert_eq!(bench.names(), (Some("tag F1"), None));
    let undo = bench.asks(Command::Undo);
    assert_eq!((undo.kind, bench.names()), (ActKind::Undo, (None, None)));
    assert!(bench.asks_nothing(Command::Undo), "one at a time");
    bench.fail(&undo);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("F1", (Some("tag F1"), None)), "still there to be undone");
    let undo = bench.asks(Command::Undo);
    bench.write(&undo);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("", (None, Some("tag F1"))));
    let redo = bench.asks(Command::Redo);
    bench.fail(&redo);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("", (None, Some("tag F1"))), "still there to be done again");
    let redo = bench.asks(Command::Redo);
    bench.write(&redo);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("F1", (Some("tag F1"), None)));
}

#[test]
fn an_undo_that_changes_nothing_any_more_is_dropped() {
    let mut bench = Bench::new();
    let commit = bench.asks(Command::ToggleTag(Tag::F1));
    bench.write(&commit);
    bench.session.report(Report::LabelsRefreshed(LabelTable::new()));
    assert!(bench.asks_nothing(Command::Undo));
    assert_eq!(bench.names(), (None, None));
    assert!(bench.told(LogLevel::Info, "another window changed the same labels"));
}

#[test]
fn a_bulk_act_leaves_out_what_is_so_already_and_is_one_undo() {
    let mut bench = Bench::new();
    let commit = bench.asks(Command::ToggleTag(Tag::F2));
    bench.write(&commit);
    bench.session.apply(Command::SelectFrames(BTreeSet::from([0, 2, 3, 99])));
    assert_eq!(bench.session.labels.selection, BTreeSet::from([0, 2, 3]), "frame 99 does not exist");
    let commit = bench.asks(Command::ToggleTag(Tag::F2));
    assert_eq!(commit.act, "tag F2 on 3 frames");
    assert_eq!(bench.write(&commit), [2, 3], "frame 0 has it already");
    // All have it now: the same key takes it away.
    assert_eq!(bench.asks(Command::ToggleTag(Tag::F2)).act, "untag F2 on 3 frames");
    // A note is for the frames that it was typed for.
    let note = bench.asks(Command::SetNote(Arc::new([5]), "wall".into()));
    assert_eq!(asked(&note).into_iter().map(|(frame, ..)| frame).collect::<Vec<_>>(), [5]);
}

#[test]
fn answers_for_a_data_set_that_was_left_change_nothing() {
    let mut bench = Bench::new();
    let written = bench.asks(Command::ToggleTag(Tag::F1));
    bench.write(&written);
    let late = bench.asks(Command::ToggleTag(Tag::F4));
    bench.session.apply(Command::SelectFrames(BTreeSet::from([1, 2])));
    let old = bench.open();
    let new = bench.open();
    assert_eq!(bench.session.labels.status, LabelStatus::Opening);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("", (None, None)));
    assert!(bench.session.labels.selection.is_empty());
    assert!(bench.asks_nothing(Command::ToggleTag(Tag::F1)));
    assert!(bench.told(LogLevel::Warning, "nothing was tagged: the journal is not open yet"));

    bench.write(&late);
    assert_eq!((bench.tags(0).as_str(), bench.names()), ("", (None, None)), "an act for the data set before");
    let others = || LabelTable::from([("eve".to_owned(), [tagged("eve", 3, Tag::F3)].into_iter().collect())]);
    bench.session.report(Report::LabelsRefreshed(others()));
    bench.opened(old, others());
    assert_eq!(bench.session.labels.status, LabelStatus::Opening);
    assert!(bench.session.labels.table().is_empty(), "labels of the data set before");
    bench.opened(new, LabelTable::from([("ada".to_owned(), [tagged("ada", 4, Tag::F2)].into_iter().collect())]));
    assert_eq!(bench.session.labels.status, LabelStatus::Ready);
    assert_eq!(bench.tags(4), "F2");
}

#[test]
fn an_act_of_one_annotator_never_becomes_another_ones() {
    let mut bench = Bench::new();
    let late = bench.asks(Command::ToggleTag(Tag::F1));
    let effects = bench.session.apply(Command::SetAnnotator(" bob ".into()));
    let id = reading(&effects);
    bench.write(&late);
    bench.opened(id, LabelTable::from([("ada".to_owned(), [tagged("ada", 0, Tag::F1)].into_iter().collect())]));
    assert_eq!((bench.session.labels.annotator.as_str(), bench.tags(0).as_str()), ("bob", ""));
    assert_eq!(bench.session.labels.others(0).map(|record| record.annotator.as_str()).collect::<Vec<_>>(), ["ada"]);
    bench.session.apply(Command::SetAnnotator("  ".into()));
    assert_eq!(bench.session.labels.annotator, "bob");
    assert!(bench.told(LogLevel::Error, "an annotator needs a name"));
}

#[test]
fn journals_that_cannot_be_opened_take_no_tag() {
    let mut bench = Bench::new();
    let id = bench.open();
    bench.session.report(Report::LabelsOpened(id, Err("ada.labels.jsonl: is a folder".into())));
    assert!(bench.asks_nothing(Command::ToggleTag(Tag::F1)));
    assert_eq!(bench.tags(0), "");
    assert!(bench.told(LogLevel::Error, "nothing was tagged: ada.labels.jsonl: is a folder"));
}

#[test]
fn a_list_that_is_filtered_by_tags_follows_them() {
    let mut bench = Bench::new();
    bench.session.apply(Command::SetFilter("tag:none".into()));
    assert_eq!(bench.session.queue.rows(), [0, 1, 2, 3, 4, 5]);
    bench.session.apply(Command::GotoFrame(2));
    let commit = bench.asks(Command::ToggleTag(Tag::F1));
    assert_eq!(bench.session.queue.rows().len(), 6);
    bench.write(&commit);
    assert_eq!(bench.session.queue.rows(), [0, 1, 3, 4, 5]);
    let table = LabelTable::from([("eve".to_owned(), [tagged("eve", 5, Tag::F3)].into_iter().collect())]);
    bench.session.report(Report::LabelsRefreshed(table));
    assert_eq!(bench.session.queue.rows(), [0, 1, 2, 3, 4], "what others wrote counts too");
    // The next one is what took its place.
    bench.session.apply(Command::StepQueue(1));
    assert_eq!(bench.session.data.frame_index, 3);
}

#[test]
fn evidence_of_an_older_fit_is_dropped_and_not_recorded() {
    let mut bench = Bench::new();
    bench.show(0);
    let first = bench.draw_moved(0.1);
    bench.session.report(Report::EvidenceFound(0, first.clone(), Ok(evidence(0.9))));
    let judged = |commit: &Commit| asked(commit)[0].2.clone();
    let commit = bench.asks(Command::ToggleTag(Tag::F1));
    assert_eq!(judged(&commit).machine.get(&Tag::F1), Some(&0.9));
    bench.write(&commit);

    let second = bench.draw_moved(0.2);
    assert!(bench.session.evidence_is_stale(), "an older answer is shown until the newer one is there");
    let commit = bench.asks(Command::ToggleTag(Tag::F2));
    assert!(judged(&commit).machine.is_empty(), "a score of another fit is no score of this one");
    assert_eq!(judged(&commit).fit, bench.session.shown_hashes().map(|hashes| hashes.fit.clone()));
    bench.write(&commit);
    bench.session.report(Report::EvidenceFound(0, first, Ok(evidence(0.8))));
    assert!(bench.session.evidence_is_stale(), "a late answer on the fit before");
    bench.session.report(Report::EvidenceFound(0, second, Ok(evidence(0.2))));
    assert_eq!(bench.session.evidence_of(0).unwrap()[0].score, Some(0.2));
    assert!(!bench.session.evidence_is_stale());

    bench.open();
    assert!(bench.session.evidence_of(0).is_none(), "frame 0 of another data set");
}

#[test]
fn a_frame_that_is_still_being_read_is_not_judged_on_the_fit_before() {
    let mut bench = Bench::new();
    bench.show(0);
    let key = bench.draw_moved(0.1);
    bench.session.report(Report::EvidenceFound(0, key, Ok(evidence(0.9))));
    let shown = bench.session.shown_hashes().cloned().unwrap();
    bench.session.apply(Command::GotoFrame(1));
    let commit = bench.asks(Command::ToggleTag(Tag::F1));
    assert_eq!((asked(&commit)[0].0, asked(&commit)[0].2.clone()), (1, Judged::default()));
    // A note that was typed for the frame that is still on screen is judged on what is on screen.
    let note = bench.asks(Command::SetNote(Arc::new([0]), "wall".into()));
    let judged = &asked(&note)[0].2;
    assert_eq!((judged.fit.as_deref(), judged.machine_shown), (Some(shown.fit.as_str()), true));
}

#[test]
fn strata_of_another_data_set_are_dropped() {
    let mut bench = Bench::new();
    let of = |frames: usize| Arc::new(Complexity { frames: vec![None; frames], ..Complexity::default() });
    bench.session.report(Report::StrataDone(Ok(Some(of(5)))));
    assert!(matches!(bench.session.strata.status, StrataStatus::Running { .. }), "five are not six");
    assert!(bench.session.strata.result().is_none());
    bench.session.report(Report::StrataDone(Ok(Some(of(6)))));
    assert_eq!(bench.session.strata.status, StrataStatus::Ready);
    bench.open();
    assert!(bench.session.strata.result().is_none() && bench.session.strata.status != StrataStatus::Ready);
    bench.session.report(Report::StrataDone(Err("disk gone".into())));
    assert_eq!(bench.session.strata.status, StrataStatus::Failed("disk gone".into()));
    assert!(bench.told(LogLevel::Error, "the strata could not be computed: disk gone"));
}

#[test]
fn a_session_file_is_not_put_back_onto_a_data_set_opened_by_hand() {
    let mut bench = Bench::new();
    let other = Bench::new();
    bench.session.apply(Command::SetFilter("hardness>0.5".into()));
    let file = || Box::new(SessionFile::of(&bench.session, serde_json::Value::Null).unwrap());
    let path = other.folder.path().to_path_buf();
    for by_hand in [Command::Open(path.clone()), Command::CancelOpen] {
        let mut session = Session::default();
        let effects = session.report(Report::SessionRead("kept.mhp-session".into(), Ok(file())));
        assert!(matches!(&effects[..], [Effect::Open(path)] if *path == bench.folder.path()), "{effects:?}");
        session.apply(by_hand);
        session.report(Report::Opened(path.clone(), Ok(Arc::clone(&other.dataset))));
        assert_eq!((session.queue.text.as_str(), session.session_path.as_ref()), ("", None));
    }
    let mut session = Session::default();
    session.report(Report::SessionRead("kept.mhp-session".into(), Ok(file())));
    session.report(Report::Opened(bench.folder.path().into(), Ok(Arc::clone(&bench.dataset))));
    assert_eq!(session.queue.text, "hardness>0.5");
}
