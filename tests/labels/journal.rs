//! The journal keeps every label that was shown as kept: through kills, two windows at once, undo, and files that are
//! replaced.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::labels::{Case, commit, frame, name, tags};
use mhp_inspector::labels::{CellRegion, Change, Journal, Judged, Label, LabelStore, Record, Tag, read_journal};
use rand::rngs::StdRng;
use rand::{Rng as _, SeedableRng as _};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Stdio};
use std::sync::mpsc;

/// The program that tags what it reads, and what it acknowledges.
struct Tagger {
    child: Child,
    stdin: ChildStdin,
    acknowledged: mpsc::Receiver<Value>,
}

impl Tagger {
    fn start(case: &Case, annotator: &str) -> Self {
        let mut command = case.program(&["tag", "--annotator", annotator, "--from-stdin"]);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let stdin = child.stdin.take().unwrap();
        let acknowledged = read_lines(child.stdout.take().unwrap());
        Self { child, stdin, acknowledged }
    }

    /// False where the program is gone.
    fn ask(&mut self, index: usize, tags: &[&str]) -> bool {
        let line = json!({ "frame": name(index), "add": tags });
        writeln!(self.stdin, "{line}").is_ok()
    }

    /// Lets the program come to its end, and gives all that it acknowledged.
    fn finish(self) -> Vec<Value> {
        drop(self.stdin);
        let all = self.acknowledged.iter().collect();
        let mut child = self.child;
        assert!(child.wait().unwrap().success());
        all
    }
}

/// Whole lines only: half an acknowledgement is none.
fn read_lines(stdout: ChildStdout) -> mpsc::Receiver<Value> {
    let (send, receive) = mpsc::channel();
    std::thread::spawn(move || {
        let mut reader = BufReader::new(stdout);
        let mut line = String::new();
        while reader.read_line(&mut line).unwrap() > 0 {
            if let Some(whole) = line.strip_suffix('\n') {
                let _ = send.send(serde_json::from_str(whole).unwrap());
            }
            line.clear();
        }
    });
    receive
}

/// Every line that is neither header nor record; what a kill tore.
fn torn_lines(file: &Path) -> usize {
    let bytes = std::fs::read(file).unwrap();
    let lines = bytes.split(|&byte| byte == b'\n').filter(|line| !line.is_empty());
    let torn = lines.filter(|line| {
        let value = serde_json::from_slice::<Value>(line);
        let is_header = value.as_ref().is_ok_and(|value| value["format"] == "mhp-labels");
        !is_header && serde_json::from_slice::<Record>(line).is_err()
    });
    torn.count()
}

/// Keeps the machine busy for about as long as a few acts take, so that a kill falls between any two instructions.
fn dawdle(random: &mut StdRng) {
    let rounds = random.random_range(0..200_000_u32);
    (0..rounds).for_each(|round| {
        std::hint::black_box(round);
    });
}

#[test]
fn fifty_kills_while_a_thousand_frames_are_tagged_lose_nothing_that_was_acknowledged() {
    const FRAMES: usize = 1000;
    const KILLS: usize = 50;
    let case = Case::new(FRAMES);
    let mut random = StdRng::seed_from_u64(5);
    let wanted: Vec<Vec<&str>> = (0..FRAMES)
        .map(|_| Tag::MODES.iter().map(|tag| tag.code()).filter(|_| random.random_bool(0.5)).collect::<Vec<_>>())
        .map(|tags| if tags.is_empty() { vec!["unsure"] } else { tags })
        .collect();
    let mut acknowledged: BTreeMap<String, Value> = BTreeMap::new();
    let (mut next, mut kills) = (0, 0);
    while next < FRAMES {
        let mut tagger = Tagger::start(&case, "anna");
        let (from, killing) = (next, kills < KILLS);
        // A frame is left for every kill to come, and what is left beyond that is shared among them.
        let end = FRAMES - (KILLS - kills);
        let share = (end - from) / (KILLS - kills).max(1);
        let wait_for = random.random_range(0..=share);
        // More is asked for than is waited for: the kill meets a program at work.
        let ahead = if killing { (from + wait_for + 40).min(end) } else { FRAMES };
        for index in from..ahead {
            if !tagger.ask(index, &wanted[index]) {
                break;
            }
        }
        if !killing {
            acknowledged.extend(tagger.finish().into_iter().map(|ack| (ack["frame"].as_str().unwrap().into(), ack)));
            next = FRAMES;
            continue;
        }
        let mut acks: Vec<Value> = tagger.acknowledged.iter().take(wait_for).collect();
        dawdle(&mut random);
        tagger.child.kill().unwrap();
        assert!(!tagger.child.wait().unwrap().success(), "it was killed, it did not end");
        kills += 1;
        acks.extend(tagger.acknowledged.iter());
        next = from + acks.len();
        acknowledged.extend(acks.into_iter().map(|ack| (ack["frame"].as_str().unwrap().into(), ack)));
        // At once, not only at the end: what a restart would repair must not hide what was lost.
        let store = LabelStore::read(&case.place()).unwrap();
        for (frame, ack) in &acknowledged {
            let found = store.label("anna", frame).map(|record| json!(record.label.tags));
            assert_eq!(found.as_ref(), Some(&ack["tags"]), "{frame} was acknowledged: {ack}; after kill {kills}");
        }
    }
    assert_eq!((acknowledged.len(), kills), (FRAMES, KILLS));
    let store = LabelStore::read(&case.place()).unwrap();
    for (index, wanted) in wanted.iter().enumerate() {
        let record = store.label("anna", &name(index)).unwrap();
        assert_eq!(json!(record.label.tags), json!(wanted), "{index}");
        assert_eq!(acknowledged[&name(index)]["tags"], json!(wanted), "{index}");
    }
    let torn = torn_lines(&case.file("anna"));
    assert_eq!(store.warnings().len(), torn, "{:?}", store.warnings());
    println!("{kills} kills, {torn} torn lines, {} bytes", std::fs::metadata(case.file("anna")).unwrap().len());
}

#[test]
fn two_processes_of_one_annotator_and_one_of_another_lose_nothing() {
    const FRAMES: usize = 150;
    let case = Case::new(FRAMES);
    let mut first = Tagger::start(&case, "anna");
    let mut second = Tagger::start(&case, "anna");
    let mut third = Tagger::start(&case, "Berta");
    for index in 0..FRAMES {
        // Every frame by both, in opposite orders, with tags of their own; a third with yet others.
        assert!(first.ask(index, &["F1"]));
        assert!(second.ask(FRAMES - 1 - index, &["F3"]));
        assert!(third.ask(index, &["clean"]));
    }
    assert_eq!(first.finish().len(), FRAMES);
    assert_eq!(second.finish().len(), FRAMES);
    assert_eq!(third.finish().len(), FRAMES);
    let store = LabelStore::read(&case.place()).unwrap();
    assert_eq!(store.annotators().collect::<Vec<_>>(), ["Berta", "anna"]);
    for index in 0..FRAMES {
        let said = |who| store.label(who, &name(index)).unwrap().label.tags.to_string();
        assert_eq!((said("anna"), said("Berta")), ("F1 F3".into(), "clean".into()), "{index}");
        assert_eq!(store.history("anna", &name(index)).unwrap().len(), 2, "{index}");
    }
    assert_eq!(store.warnings(), Vec::<String>::new());
    assert_eq!(torn_lines(&case.file("anna")), 0);
    assert_eq!(std::fs::read_dir(case.labels()).unwrap().count(), 2, "a file an annotator and nothing else");
}

#[test]
fn two_windows_in_one_process_merge_their_acts() {
    let case = Case::new(3);
    let (mut left, mut right) = (case.journal("anna"), case.journal("anna"));
    let threads = [(&mut left, Tag::F1), (&mut right, Tag::F4)];
    std::thread::scope(|scope| {
        for (journal, tag) in threads {
            scope.spawn(move || (0..100).for_each(|index| drop(commit(journal, index, Change::adding(tag)))));
        }
    });
    let store = LabelStore::read(&case.place()).unwrap();
    assert_eq!(store.records("anna").filter(|record| record.label.tags.to_string() == "F1 F4").count(), 100);
}

#[test]
fn undo_gives_back_the_label_and_leaves_what_another_window_did() {
    let case = Case::new(2);
    let (mut here, mut there) = (case.journal("anna"), case.journal("anna"));
    commit(&mut here, 0, Change { note: Some("far".into()), ..Change::adding(Tag::Clean) });
    let act = commit(&mut here, 0, Change { note: Some("near".into()), ..Change::adding(Tag::F2) });
    let undo = Change::between(&act[0].after.label, &act[0].before);
    let undone = commit(&mut here, 0, undo.clone());
    assert_eq!(undone[0].after.label, act[0].before);
    let redone = commit(&mut here, 0, Change::between(&undone[0].after.label, &undone[0].before));
    assert_eq!(redone[0].after.label, act[0].after.label);
    commit(&mut there, 0, Change { person: Some(Some(1)), ..Change::adding(Tag::F3) });
    let undone = commit(&mut here, 0, undo);
    let wanted = Label {
        tags: [Tag::F3, Tag::Clean].into_iter().collect(),
        note: "far".into(),
        person: Some(1),
        ..Label::default()
    };
    assert_eq!(undone[0].after.label, wanted);
}

#[test]
fn a_frame_whose_label_stays_gets_no_record() {
    let case = Case::new(3);
    let mut journal = case.journal("anna");
    let both = [(frame(0), Change::adding(Tag::F1)), (frame(1), Change::removing(Tag::F1))];
    let outcomes = journal.commit("tag F1", &both, &Judged::default()).unwrap();
    assert_eq!(outcomes.iter().map(|outcome| outcome.frame.index).collect::<Vec<_>>(), [0]);
    let size = std::fs::metadata(case.file("anna")).unwrap().len();
    assert_eq!(commit(&mut journal, 0, Change::adding(Tag::F1)), []);
    assert_eq!(std::fs::metadata(case.file("anna")).unwrap().len(), size);
    // One frame twice in an act: the second change applies to what the first made of it.
    let twice = [(frame(2), Change::adding(Tag::F1)), (frame(2), Change::adding(Tag::F2))];
    let outcomes = journal.commit("tag", &twice, &Judged::default()).unwrap();
    assert_eq!(outcomes[1].before.tags.to_string(), "F1");
    assert_eq!(tags(&case.place(), "anna", 2), "F1 F2");
}

#[test]
fn a_record_keeps_all_that_is_asked_of_it() {
    let case = Case::new(1);
    let machine = BTreeMap::from([(Tag::F1, 0.8125), (Tag::F4, f64::NAN)]);
    let judged = Judged {
        fit: Some("abc".into()),
        config: Some("def".into()),
        iteration: Some(40),
        erased: vec![CellRegion { view: "hm".into(), lo: vec![1], hi: vec![4] }],
        machine,
        machine_shown: true,
    };
    let mut journal = case.journal("  anna ");
    journal.commit("tag F1", &[(frame(0), Change::adding(Tag::F1))], &judged).unwrap();
    let record = read_journal(&case.file("anna")).unwrap().remove(0);
    assert_eq!((record.annotator.as_str(), record.dataset.as_str(), record.act.as_str()), ("anna", "f00d", "tag F1"));
    assert_eq!((record.frame, record.program.as_str()), (frame(0), env!("CARGO_PKG_VERSION")));
    assert!(record.time.len() == 24 && record.time.ends_with('Z'), "{}", record.time);
    let finite = BTreeMap::from([(Tag::F1, 0.8125)]);
    assert_eq!(record.judged, Judged { machine: finite, ..judged });
    let text = std::fs::read_to_string(case.file("anna")).unwrap();
    let header: Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
    assert_eq!(
        (&header["version"], &header["annotator"], &header["dataset"]),
        (&json!(1), &json!("anna"), &json!("f00d"))
    );
}

#[test]
fn a_file_that_is_replaced_or_deleted_is_read_anew_and_written_where_it_is_seen() {
    let case = Case::new(4);
    let mut journal = case.journal("anna");
    let mut store = LabelStore::read(&case.place()).unwrap();
    commit(&mut journal, 0, Change::adding(Tag::F1));
    commit(&mut journal, 1, Change::adding(Tag::F1));
    let both = std::fs::read(case.file("anna")).unwrap();
    assert!(store.refresh().unwrap());
    // Deleted: the next act makes a file, not a ghost.
    std::fs::remove_file(case.file("anna")).unwrap();
    assert!(store.refresh().unwrap());
    assert_eq!(store.records("anna").count(), 0);
    assert_eq!(commit(&mut journal, 2, Change::adding(Tag::F2))[0].before, Label::default());
    assert!(store.refresh().unwrap());
    assert_eq!(store.records("anna").map(|record| record.frame.index).collect::<Vec<_>>(), [2]);
    // Another file of the same name, moved there.
    std::fs::write(case.labels().join("other"), &both).unwrap();
    std::fs::rename(case.labels().join("other"), case.file("anna")).unwrap();
    assert_eq!(commit(&mut journal, 0, Change::adding(Tag::F2))[0].before.tags.to_string(), "F1");
    assert!(store.refresh().unwrap());
    assert_eq!(store.records("anna").map(|record| record.frame.index).collect::<Vec<_>>(), [0, 1]);
    // Shorter, in place.
    std::fs::write(case.file("anna"), &both).unwrap();
    assert!(store.refresh().unwrap());
    assert_eq!(store.label("anna", &name(0)).unwrap().label.tags.to_string(), "F1");
    assert_eq!(journal.commit("x", &[(frame(0), Change::adding(Tag::F1))], &Judged::default()).unwrap(), []);
    // Longer, in place, with other bytes where the reader stands.
    let other = String::from_utf8(both).unwrap().replace("\"F1\"", "\"F3\",\"F4\"");
    std::fs::write(case.file("anna"), other).unwrap();
    assert!(store.refresh().unwrap());
    assert_eq!(store.label("anna", &name(1)).unwrap().label.tags.to_string(), "F3 F4");
    assert_eq!(commit(&mut journal, 1, Change::removing(Tag::F3))[0].after.label.tags.to_string(), "F4");
    // The whole folder.
    std::fs::remove_dir_all(case.labels()).unwrap();
    assert_eq!(commit(&mut journal, 3, Change::adding(Tag::F1)).len(), 1);
    assert_eq!(LabelStore::read(&case.place()).unwrap().records("anna").count(), 1);
}

#[test]
fn a_store_follows_what_others_write() {
    let case = Case::new(9);
    let mut store = LabelStore::read(&case.place()).unwrap();
    assert_eq!(store.annotators().count(), 0);
    case.told(&["tag", "--annotator", "anna", "--frames", "2..5", "--add", "F1", "--note", "x"]);
    assert!(store.refresh().unwrap());
    assert!(!store.refresh().unwrap());
    assert_eq!(store.records("anna").map(|record| record.frame.index).collect::<Vec<_>>(), [2, 3, 4]);
    case.told(&["tag", "--annotator", "anna", "--frame", "3", "--frame", "frames/0007", "--add", "F2"]);
    case.told(&["tag", "--annotator", "berta", "--frame", "1", "--verdict", "true-negative", "--person", "2"]);
    assert!(store.refresh().unwrap());
    assert_eq!(store.label("anna", &name(3)).unwrap().label.tags.to_string(), "F1 F2");
    assert_eq!(store.last_edited("anna").unwrap().frame, frame(7));
    assert_eq!(store.last_edited("berta").unwrap().label.person, Some(2));
    let acts: Vec<String> = store.history("anna", &name(3)).unwrap().into_iter().map(|record| record.act).collect();
    assert_eq!(acts, ["tag F1, note on 3 frames", "tag F2 on 2 frames"]);
    let (table, _) = case.told(&["show", "--annotator", "anna"]);
    assert_eq!(table.lines().count(), 4);
    assert!(table.contains("anna  frames/0003  F1 F2  \"x\""), "{table}");
    let records: Vec<Record> = serde_json::from_str(&case.told(&["show", "--json"]).0).unwrap();
    assert_eq!(records.len(), 5);
    case.told(&["tag", "--annotator", "berta", "--frame", "1", "--verdict", "none", "--person", "none"]);
    assert_eq!(case.told(&["show", "--annotator", "berta"]).0, "", "a label that says nothing is not listed");
}

#[test]
fn names_of_annotators_that_look_alike_have_files_of_their_own() {
    let case = Case::new(1);
    let names = ["anna", "Anna", "ANNA", "anna.b", "anna/b", "änna", "安娜", "../anna", "an\nna", "con"];
    for name in names {
        commit(&mut case.journal(name), 0, Change { note: Some(name.into()), ..Change::default() });
    }
    assert_eq!(std::fs::read_dir(case.labels()).unwrap().count(), names.len());
    let store = LabelStore::read(&case.place()).unwrap();
    for who in names {
        assert_eq!(store.label(who, &name(0)).unwrap().label.note, who);
    }
    for nobody in ["", "  ", "\t\n"] {
        let error = Journal::open(&case.place(), nobody, "f00d").unwrap_err().to_string();
        assert!(error.starts_with(&format!("{}: the annotator's name is empty", case.labels().display())), "{error}");
        assert!(case.refusal(&["tag", "--annotator", nobody, "--frame", "0", "--add", "F1"], "").contains("is empty"));
    }
}

/// A line of a journal: `who` gives a frame tags at a time.
fn line(who: &str, index: usize, tags: &[&str], time: &str) -> String {
    let record = json!({
        "dataset": "f00d", "frame": { "path": name(index), "index": index }, "label": { "tags": tags },
        "annotator": who, "time": time, "act": "tag", "program": "0"
    });
    format!("{record}\n")
}

const LATEST: &str = "9999-12-31T23:59:59.999Z";

/// Everything that shows labels shows these tags of the frame, and nobody else's.
fn is_shown(case: &Case, who: &str, index: usize, wanted: &str) {
    assert_eq!(tags(&case.place(), who, index), wanted);
    let (shown, _) = case.told(&["show", "--annotator", who, "--json"]);
    let records: Vec<Record> = serde_json::from_str(&shown).unwrap();
    let find = |records: &[Record]| {
        let found: Vec<String> = records
            .iter()
            .filter(|record| record.frame.index == index)
            .map(|record| record.label.tags.to_string())
            .collect();
        found.join("; ")
    };
    assert_eq!(find(&records), wanted, "labels show");
    let (exported, _) = case.told(&["export", "--annotator", who, "--json", "-"]);
    assert_eq!(find(&serde_json::from_str::<Vec<Record>>(&exported).unwrap()), wanted, "labels export");
}

#[test]
fn an_acknowledged_act_is_shown_whatever_other_files_and_clocks_say() {
    let case = Case::new(4);
    std::fs::create_dir_all(case.labels()).unwrap();
    // A copy beside the journal whose clock was ahead, and somebody else's file with records by ada, of the last moment.
    let copy = line("ada", 0, &["F4"], "2999-01-01T00:00:00.000Z") + &line("ada", 1, &["F4"], LATEST);
    std::fs::write(case.labels().join("ada copy.labels.jsonl"), copy).unwrap();
    std::fs::write(case.file("eve"), line("ada", 0, &["F3"], LATEST) + &line("eve", 0, &["clean"], LATEST)).unwrap();
    is_shown(&case, "ada", 0, "F3");
    let (_, warned) = case.told(&["tag", "--annotator", "ada", "--frame", "0", "--add", "F1"]);
    is_shown(&case, "ada", 0, "F1 F3");
    case.told(&["tag", "--annotator", "ada", "--frame", "0", "--remove", "F3"]);
    is_shown(&case, "ada", 0, "F1");
    // What only the copy says stands until ada says something.
    is_shown(&case, "ada", 1, "F4");
    // A window that has been open all the while, and its undo.
    let (mut window, mut store) = (case.journal("ada"), LabelStore::read(&case.place()).unwrap());
    let act = commit(&mut window, 1, Change::adding(Tag::F2));
    is_shown(&case, "ada", 1, "F2 F4");
    let undone = commit(&mut window, 1, Change::between(&act[0].after.label, &act[0].before));
    assert_eq!(undone[0].after.label, act[0].before);
    is_shown(&case, "ada", 1, "F4");
    std::fs::write(case.labels().join("late.labels.jsonl"), line("ada", 1, &["unsure"], LATEST)).unwrap();
    commit(&mut window, 1, Change::removing(Tag::F4));
    assert!(store.refresh().unwrap());
    assert_eq!(store.label("ada", &name(1)).unwrap().label, Label::default());
    // The times are those of the clock, not of whoever was ahead.
    let own = read_journal(&case.file("ada")).unwrap();
    assert!(own.iter().all(|record| record.time.as_str() < "2999"), "{own:?}");
    // eve's own file speaks for eve, whatever its time, and what she says next is seen.
    case.told(&["tag", "--annotator", "eve", "--frame", "0", "--add", "F2"]);
    is_shown(&case, "eve", 0, "F2");
    assert!(!warned.contains("eve.labels.jsonl"), "a file that only speaks for others is told to who reads: {warned}");
}

#[test]
fn files_that_speak_for_others_and_times_to_come_are_told() {
    let case = Case::new(3);
    std::fs::create_dir_all(case.labels()).unwrap();
    std::fs::write(case.file("eve"), line("ada", 0, &["F3"], LATEST) + &line("eve", 1, &["F1"], LATEST)).unwrap();
    let eve = case.file("eve").display().to_string();
    let others = format!(
        "{eve}: 1 record by `ada`, for whom only ada.labels.jsonl speaks: they count where that file says nothing of a frame"
    );
    let ahead =
        |who: &str| format!("{eve}: 1 label by `{who}` dated in the future, as late as {LATEST}: a clock was wrong");
    let unknown = "1 label of frames that are not in this data set, for example frames/0077; they are kept";
    std::fs::write(case.file("zoe"), line("zoe", 77, &["F1"], "2020-01-01T00:00:00Z")).unwrap();
    for arguments in [&["show"][..], &["stats"], &["export", "--csv", "-"]] {
        let (_, told) = case.told(arguments);
        for wanted in [&others, &ahead("ada"), &ahead("eve"), unknown] {
            assert!(told.contains(wanted), "{arguments:?}: {wanted}\nis not in\n{told}");
        }
    }
    let store = LabelStore::read(&case.place()).unwrap();
    assert!(store.warnings().contains(&others), "{:?}", store.warnings());
    // Once ada has spoken herself, her label is not of the future any more; the stranger's file is still told.
    case.told(&["tag", "--annotator", "ada", "--frame", "0", "--add", "F1"]);
    let (_, told) = case.told(&["show"]);
    assert!(told.contains(&others) && !told.contains(&ahead("ada")), "{told}");
    commit(&mut case.journal("ADA"), 0, Change::adding(Tag::F1));
    let (_, told) = case.told(&["show"]);
    assert!(told.contains("`ADA` and `ada` are different annotators, though only the case differs"), "{told}");
}

#[test]
fn an_import_from_a_clock_that_is_ahead_does_not_hide_what_is_tagged_afterwards() {
    let case = Case::new(2);
    let sheet = case.folder.path().join("sheet.csv");
    let rows = format!("frame,annotator,time,F1,F2,F3,F4,clean,unsure\n{},ada,{LATEST},1,0,0,0,0,0\n", name(0));
    std::fs::write(&sheet, rows).unwrap();
    let (_, warned) = case.told(&["import", sheet.to_str().unwrap()]);
    assert!(warned.contains(&format!("line 2: dated in the future, {LATEST}; it counts as said now")), "{warned}");
    is_shown(&case, "ada", 0, "F1");
    assert!(read_journal(&case.file("ada")).unwrap()[0].time.as_str() < "2999");
    case.told(&["tag", "--annotator", "ada", "--frame", "0", "--add", "F2"]);
    is_shown(&case, "ada", 0, "F1 F2");
    // What a stranger's file says of the last moment keeps no row of ada's out.
    std::fs::write(case.file("eve"), line("ada", 1, &["F3"], LATEST)).unwrap();
    let rows =
        format!("frame,annotator,time,F1,F2,F3,F4,clean,unsure\n{},ada,2026-01-01T00:00:00Z,0,1,0,0,0,0\n", name(1));
    std::fs::write(&sheet, rows).unwrap();
    assert!(case.told(&["import", sheet.to_str().unwrap()]).0.starts_with("ada: 1 label imported, 0 the same; in "));
    is_shown(&case, "ada", 1, "F2");
}
