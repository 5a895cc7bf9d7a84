//! Acts of labelling through `Session::apply`, without threads: what is asked of the journal, what its answers change.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::labels::{FrameId, Judged, Label, LabelPlace, Record, Tag, Tags};
use mhp_inspector::session::{
    ActKind, Asked, Changes, Command, Commit, Done, Effect, LabelTable, OpenedLabels, Report, Session, Written,
};
use mhp_inspector::task::Progress;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A session on a hundred frames whose journal is open, and what the journal holds.
struct Bench {
    session: Session,
    held: Vec<Label>,
    _folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        blob::write_dataset(folder.path(), 100);
        let dataset = Arc::new(Dataset::open(folder.path(), &Progress::new()).unwrap());
        let mut session = Session::default();
        session.apply(Command::SetAnnotator("ada".into()));
        let effects = session.report(Report::Opened(folder.path().into(), Ok(dataset)));
        let reading = effects.iter().find_map(|effect| match effect {
            Effect::OpenLabels { id, .. } => Some(*id),
            _ => None,
        });
        let place = LabelPlace::in_folder(folder.path());
        let opened = OpenedLabels { place, table: LabelTable::new(), last_edited: None, warnings: Vec::new() };
        session.report(Report::LabelsOpened(reading.unwrap(), Ok(Box::new(opened))));
        Self { session, held: vec![Label::default(); 100], _folder: folder }
    }

    fn ask(&mut self, command: Command) -> Commit {
        let effects = self.session.apply(command);
        let commit = effects.into_iter().find_map(|effect| match effect {
            Effect::CommitLabels(commit) => Some(commit),
            _ => None,
        });
        commit.unwrap_or_else(|| panic!("nothing was asked of the journal"))
    }

    /// What the journal's thread would answer.
    fn answer(&mut self, commit: Commit) {
        let Commit { id, kind, act, asked, .. } = commit;
        let (mut changes, mut records) = (Vec::new(), Vec::new());
        for (index, change) in asked.each() {
            let after = change.applied(&self.held[index]);
            if after == self.held[index] {
                continue;
            }
            changes.push((index, self.held[index].clone(), after.clone()));
            records.push(Arc::new(record(index, &after)));
            self.held[index] = after;
        }
        let result = Ok(Done { changes: Changes::of(changes), records, scored: BTreeSet::new() });
        self.session.report(Report::LabelsWritten(Written { id, kind, act, result }));
    }

    fn tags(&self, frame: usize) -> String {
        self.session.labels.label(frame).tags.to_string()
    }

    fn filter(&mut self, text: &str) -> usize {
        self.session.apply(Command::SetFilter(text.into()));
        self.session.queue.rows().len()
    }
}

fn record(index: usize, label: &Label) -> Record {
    Record {
        dataset: String::new(),
        frame: FrameId { path: format!("frames/{index:03}"), index },
        label: label.clone(),
        annotator: "ada".into(),
        time: "2026-03-01T09:31:12.345Z".into(),
        after: None,
        act: String::new(),
        program: String::new(),
        judged: Judged::default(),
    }
}

#[test]
fn an_act_on_every_frame_is_one_act_that_is_undone_and_done_again() {
    let mut bench = Bench::new();
    bench.session.apply(Command::SelectFrames((0..100).chain([100, 7_000]).collect()));
    assert_eq!(bench.session.labels.selection.len(), 100, "frames that there are");
    let commit = bench.ask(Command::ToggleTag(Tag::F2));
    assert_eq!((commit.act.as_str(), commit.asked.len(), commit.kind), ("tag F2 on 100 frames", 100, ActKind::Do));
    assert_eq!(bench.tags(3), "", "nothing is shown before it is on disk");
    bench.answer(commit);
    assert_eq!((bench.tags(3), bench.session.labels.count()), ("F2".into(), 100));
    assert_eq!(bench.session.labels.common_tags(&bench.session.label_targets()), Tags::NONE.with(Tag::F2));
    assert_eq!(bench.session.labels.undo_name(), Some("tag F2 on 100 frames"));
    let undo = bench.ask(Command::Undo);
    assert!(matches!(&undo.asked, Asked::Back(changes) if changes.len() == 100));
    bench.answer(undo);
    assert_eq!((bench.tags(3), bench.session.labels.count()), (String::new(), 0));
    let redo = bench.ask(Command::Redo);
    bench.answer(redo);
    assert_eq!((bench.tags(99), bench.session.labels.undo_name()), ("F2".into(), Some("tag F2 on 100 frames")));
    assert_eq!(bench.session.labels.redo_name(), None);
}

#[test]
fn an_act_on_more_frames_than_can_be_seen_is_told_and_offers_to_be_taken_back() {
    let mut bench = Bench::new();
    let told = |bench: &Bench| bench.session.notice.as_ref().map(|notice| notice.text.clone()).unwrap_or_default();
    bench.session.apply(Command::SelectFrames((0..20).collect()));
    let commit = bench.ask(Command::ToggleTag(Tag::F2));
    bench.answer(commit);
    assert_eq!(bench.session.notice, None, "twenty rows are in sight");
    bench.session.apply(Command::SelectFrames((0..100).collect()));
    assert!(told(&bench).starts_with("100 frames are selected"), "{}", told(&bench));
    bench.session.apply(Command::SelectFrames((0..30).collect()));
    bench.session.notice = None;
    bench.session.apply(Command::SelectFrames((0..31).collect()));
    assert_eq!(bench.session.notice, None, "who selects one after the other sees each");
    let commit = bench.ask(Command::ToggleTag(Tag::F1));
    assert_eq!(bench.session.notice, None, "nothing is told before it is on disk");
    bench.answer(commit);
    assert_eq!(told(&bench), "tag F1 on 31 frames");
    let offered = bench.session.notice.as_ref().and_then(|notice| notice.act);
    assert!(offered.is_some() && offered == bench.session.undo_act());
    let undo = bench.ask(Command::Undo);
    bench.answer(undo);
    assert_ne!(bench.session.undo_act(), offered, "it cannot be taken back twice");
    assert_eq!((bench.tags(3), bench.tags(25)), ("F2".into(), String::new()));
}

#[test]
fn an_act_counts_what_is_still_being_written() {
    let mut bench = Bench::new();
    bench.session.apply(Command::SelectFrames((0..100).collect()));
    let first = bench.ask(Command::ToggleTag(Tag::F1));
    let second = bench.ask(Command::ToggleTag(Tag::F1));
    assert_eq!(second.act, "untag F1 on 100 frames", "the same key again takes it back");
    bench.session.apply(Command::SelectFrames(BTreeSet::from([2, 50])));
    let third = bench.ask(Command::ToggleTag(Tag::Clean));
    let fourth = bench.ask(Command::ToggleTag(Tag::Clean));
    assert_eq!((third.act.as_str(), fourth.act.as_str()), ("tag clean on 2 frames", "untag clean on 2 frames"));
    assert_eq!(bench.session.labels.undo_name(), None, "nothing can be undone while acts are under way");
    for commit in [first, second, third] {
        bench.answer(commit);
    }
    assert_eq!((bench.tags(2), bench.tags(3)), ("clean".into(), String::new()));
    bench.answer(fourth);
    assert_eq!(bench.session.labels.count(), 0);
}

#[test]
fn what_would_change_nothing_is_not_asked() {
    let mut bench = Bench::new();
    let effects = bench.session.apply(Command::ClearLabel);
    assert!(!effects.iter().any(|effect| matches!(effect, Effect::CommitLabels(_))), "{effects:?}");
    let commit = bench.ask(Command::SetNote(Arc::new([0]), "a wall".into()));
    bench.answer(commit);
    let cleared = bench.ask(Command::ClearLabel);
    bench.answer(cleared);
    assert_eq!((bench.session.labels.count(), bench.held[0].clone()), (0, Label::default()));
}

#[test]
fn a_list_that_asks_for_labels_follows_them() {
    let mut bench = Bench::new();
    assert_eq!(bench.filter("tag:none"), 100);
    let commit = bench.ask(Command::ToggleTag(Tag::F3));
    bench.answer(commit);
    assert_eq!(bench.session.queue.rows().len(), 99, "the frame that was tagged left the list");
    assert_eq!(bench.filter("tag:F3 by:ad"), 1);
    let revision = bench.session.queue.revision;
    let undo = bench.ask(Command::Undo);
    bench.answer(undo);
    assert!(bench.session.queue.rows().is_empty() && bench.session.queue.revision > revision);
    assert_eq!(bench.filter(""), 100);
    let revision = bench.session.queue.revision;
    let redo = bench.ask(Command::Redo);
    bench.answer(redo);
    assert_eq!(bench.session.queue.revision, revision, "one that does not ask is left alone");
}
