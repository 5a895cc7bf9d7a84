//! What a crash, a full disk or another program leaves in a journal costs nothing but itself.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests fail by panicking")]

use crate::labels::{Case, commit, frame, name, tags};
use mhp_inspector::folders::HOME_VARIABLE;
use mhp_inspector::labels::{Change, Journal, Judged, LabelStore, Tag, Tags, read_acts, read_journal};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
fn a_record_cut_at_any_byte_loses_only_itself() {
    let case = Case::new(4);
    let mut journal = case.journal("anna");
    commit(&mut journal, 0, Change::adding(Tag::F1));
    commit(&mut journal, 1, Change { note: Some("zwei Leute, 两个人".into()), ..Change::adding(Tag::F2) });
    let before = std::fs::metadata(case.file("anna")).unwrap().len() as usize;
    commit(&mut journal, 2, Change { note: Some("Ende, 完".into()), ..Change::adding(Tag::F3) });
    let whole = std::fs::read(case.file("anna")).unwrap();
    for keep in 0..=whole.len() {
        std::fs::write(case.file("anna"), &whole[..keep]).unwrap();
        let store = LabelStore::read(&case.place()).unwrap();
        let complete = whole[..keep].split(|&byte| byte == b'\n').count() - 1;
        // A record that has all but its newline is whole.
        let last_is_whole = whole.get(keep) == Some(&b'\n');
        let records = (complete + usize::from(last_is_whole)).saturating_sub(1);
        assert_eq!(store.records("anna").count(), records, "{keep} bytes");
        let torn = keep > 0 && whole[keep - 1] != b'\n' && !last_is_whole;
        assert_eq!(store.warnings().len(), usize::from(torn), "{keep} bytes: {:?}", store.warnings());
        if keep >= before {
            assert_eq!(store.label("anna", &name(1)).unwrap().label.note, "zwei Leute, 两个人");
        }
        let mut journal = case.journal("anna");
        commit(&mut journal, 3, Change::adding(Tag::F4));
        drop(store);
        let after = LabelStore::read(&case.place()).unwrap();
        assert_eq!(after.records("anna").count(), records + 1, "{keep} bytes");
        assert_eq!(after.label("anna", &name(3)).unwrap().label.tags, Tags::NONE.with(Tag::F4));
        assert_eq!(after.warnings().len(), usize::from(torn), "{keep} bytes: {:?}", after.warnings());
        let text = std::fs::read(case.file("anna")).unwrap();
        assert!(text.starts_with(&whole[..keep]), "what was there is not touched");
        let headers = text.windows(22).filter(|bytes| bytes == b"{\"format\":\"mhp-labels\"").count();
        assert!(headers >= 1, "a file always gets a header");
    }
}

#[test]
fn a_torn_line_is_told_with_file_and_line_and_a_living_reader_gets_over_it() {
    let case = Case::new(3);
    commit(&mut case.journal("anna"), 0, Change::adding(Tag::F1));
    let mut store = LabelStore::read(&case.place()).unwrap();
    append(&case.file("anna"), b"{\"dataset\":\"f00d\",\"fra");
    assert!(store.refresh().unwrap());
    let place = format!("{}:3: the last line is cut off after 22 bytes", case.file("anna").display());
    assert!(store.warnings()[0].starts_with(&place), "{:?}", store.warnings());
    commit(&mut case.journal("anna"), 1, Change::adding(Tag::F2));
    assert!(store.refresh().unwrap());
    assert_eq!(store.warnings(), [format!("{}:3: damaged line, skipped", case.file("anna").display())]);
    assert_eq!(store.records("anna").count(), 2);
    assert!(!store.refresh().unwrap());
}

fn append(file: &Path, bytes: &[u8]) {
    std::fs::OpenOptions::new().append(true).open(file).unwrap().write_all(bytes).unwrap();
}

#[test]
fn garbage_and_nul_bytes_are_skipped_and_named() {
    let case = Case::new(4);
    let mut journal = case.journal("anna");
    commit(&mut journal, 0, Change::adding(Tag::F1));
    append(&case.file("anna"), b"\xff\xfe garbage\n[1,2]\n{\"frame\":7}\n\n");
    commit(&mut journal, 1, Change::adding(Tag::F2));
    append(&case.file("anna"), &[0; 300]);
    let store = LabelStore::read(&case.place()).unwrap();
    let file = case.file("anna").display().to_string();
    let told: Vec<&str> = store.warnings().iter().map(|text| text.strip_prefix(&file).unwrap()).collect();
    let damaged = |line| format!(":{line}: damaged line, skipped");
    assert_eq!(told[..3], [damaged(3), damaged(4), damaged(5)]);
    assert!(told[3].starts_with(":8: the last line is cut off after 300 bytes"), "{told:?}");
    commit(&mut journal, 2, Change::adding(Tag::F3));
    assert_eq!(journal.warnings().len(), 4, "{:?}", journal.warnings());
    let store = LabelStore::read(&case.place()).unwrap();
    let all: Vec<String> = store.records("anna").map(|record| record.label.tags.to_string()).collect();
    assert_eq!(all, ["F1", "F2", "F3"]);
    assert_eq!(read_journal(&case.file("anna")).unwrap().len(), 3);
}

#[test]
fn a_damaged_header_costs_no_record() {
    let case = Case::new(3);
    commit(&mut case.journal("anna"), 0, Change::adding(Tag::F1));
    let text = std::fs::read_to_string(case.file("anna")).unwrap();
    std::fs::write(case.file("anna"), text.replacen("{\"format\":", "X#format\":", 1)).unwrap();
    commit(&mut case.journal("anna"), 1, Change::adding(Tag::F2));
    let store = LabelStore::read(&case.place()).unwrap();
    assert_eq!((tags(&case.place(), "anna", 0), tags(&case.place(), "anna", 1)), ("F1".into(), "F2".into()));
    assert!(store.warnings()[0].ends_with(":1: damaged line, skipped"));
    assert_eq!(store.warnings().len(), 1);
    let text = std::fs::read_to_string(case.file("anna")).unwrap();
    assert!(text.lines().nth(2).unwrap().starts_with("{\"format\":\"mhp-labels\",\"version\":1,"), "a new header");
}

#[test]
fn a_newer_version_is_refused_and_not_written_to() {
    let case = Case::new(2);
    std::fs::create_dir_all(case.labels()).unwrap();
    let newer = "{\"format\":\"mhp-labels\",\"version\":2,\"people\":[\"anna\"]}\n{\"new\":true}\n";
    std::fs::write(case.file("anna"), newer).unwrap();
    let wanted =
        format!("{}: written in version 2 of the label format, this program knows 1", case.file("anna").display());
    let error = Journal::open(&case.place(), "anna", "f00d").unwrap_err().to_string();
    assert!(error.starts_with(&wanted), "{error}");
    assert!(read_journal(&case.file("anna")).unwrap_err().to_string().starts_with(&wanted));
    let error = case.refusal(&["tag", "--annotator", "anna", "--frame", "0", "--add", "F1"], "");
    assert_eq!(error, format!("error: {}", Journal::open(&case.place(), "anna", "f00d").unwrap_err()));
    assert_eq!(std::fs::read_to_string(case.file("anna")).unwrap(), newer);
    // One file of the future does not hide the others.
    commit(&mut case.journal("berta"), 0, Change::adding(Tag::F1));
    let store = LabelStore::read(&case.place()).unwrap();
    assert_eq!(store.annotators().collect::<Vec<_>>(), ["berta"]);
    assert!(store.warnings()[0].starts_with(&wanted), "{:?}", store.warnings());
    // It comes while the file is open.
    let mut journal = case.journal("berta");
    append(&case.file("berta"), newer.as_bytes());
    let before = std::fs::read(case.file("berta")).unwrap();
    for _ in 0..2 {
        let error = journal.commit("tag", &[(frame(1), Change::adding(Tag::F1))], &Judged::default()).unwrap_err();
        assert!(error.to_string().contains("version 2"), "{error}");
    }
    assert_eq!(std::fs::read(case.file("berta")).unwrap(), before);
}

#[test]
fn fields_of_a_later_program_of_the_same_version_are_left_alone() {
    let case = Case::new(2);
    commit(&mut case.journal("anna"), 0, Change::adding(Tag::F1));
    let text = std::fs::read_to_string(case.file("anna")).unwrap();
    let text =
        text.replace("{\"dataset\"", "{\"mood\":[\"good\"],\"dataset\"").replace("\"tags\"", "\"x\":{},\"tags\"");
    std::fs::write(case.file("anna"), text.replacen("\"version\"", "\"y\":1,\"version\"", 1)).unwrap();
    let store = LabelStore::read(&case.place()).unwrap();
    assert_eq!((store.records("anna").count(), store.warnings().len()), (1, 0), "{:?}", store.warnings());
}

#[test]
fn what_is_no_journal_is_refused_and_not_written_to() {
    let case = Case::new(1);
    std::fs::create_dir_all(case.labels()).unwrap();
    for text in ["frame,tags\na,F1\n", "no newline", "{\"a\":1}\n", "[]\n"] {
        std::fs::write(case.file("anna"), text).unwrap();
        for error in [
            Journal::open(&case.place(), "anna", "f00d").unwrap_err().to_string(),
            read_journal(&case.file("anna")).unwrap_err().to_string(),
        ] {
            let wanted = format!(
                "{}: no journal of labels: line 1 is {:?}",
                case.file("anna").display(),
                text.lines().next().unwrap()
            );
            assert!(error.starts_with(&wanted), "{error}");
        }
        assert_eq!(std::fs::read_to_string(case.file("anna")).unwrap(), text);
    }
    let folder = read_journal(&case.labels()).unwrap_err().to_string();
    assert!(folder.starts_with(&format!("{}: labels cannot be read: ", case.labels().display())), "{folder}");
    let missing = read_journal(&case.file("nobody")).unwrap_err().to_string();
    assert!(missing.contains("No such file") && missing.contains("nobody.labels.jsonl"), "{missing}");
    std::fs::write(case.file("empty"), "").unwrap();
    assert_eq!(read_journal(&case.file("empty")).unwrap(), []);
}

/// A limit on the size of files stands for a full disk.
#[cfg(unix)]
#[test]
fn a_full_disk_is_an_error_and_nothing_is_acknowledged() {
    let case = Case::new(2);
    let script = "trap '' XFSZ; ulimit -f 0; exec \"$@\"";
    let program = case.program(&["tag", "--annotator", "anna", "--from-stdin"]);
    let mut limited = Command::new("sh");
    limited.args(["-c", script, "sh"]).arg(program.get_program()).args(program.get_args());
    // Where not even the trial finds room, it is the place that is refused; a journal that is there is not.
    commit(&mut case.journal("anna"), 1, Change::adding(Tag::F2));
    let before = std::fs::read(case.file("anna")).unwrap();
    limited.env(HOME_VARIABLE, case.home());
    let mut child = limited.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let _ = child.stdin.take().unwrap().write_all(b"{\"frame\":0,\"add\":[\"F1\"]}\n");
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(2), &b""[..]));
    assert!(String::from_utf8_lossy(&output.stderr).contains("File too large"), "{output:?}");
    assert_eq!(std::fs::read(case.file("anna")).unwrap(), before);
}

/// Within ten seconds: what waits for a pipe's other end waits for ever.
#[cfg(unix)]
#[test]
fn pipes_devices_and_links_to_nothing_are_refused_at_once() {
    let case = Case::new(2);
    std::fs::create_dir_all(case.labels()).unwrap();
    let made = Command::new("mkfifo").arg(case.file("pipe")).arg(case.file("anna")).status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo");
    std::os::unix::fs::symlink("/dev/null", case.file("device")).unwrap();
    std::os::unix::fs::symlink(case.folder.path().join("elsewhere"), case.file("link")).unwrap();
    let (send, answer) = std::sync::mpsc::channel();
    let place = case.place();
    let pipe = case.file("pipe");
    std::thread::spawn(move || {
        let refused = |name: &str| {
            let commit = |mut journal: Journal| {
                journal.commit("tag", &[(frame(0), Change::adding(Tag::F1))], &Judged::default()).map(|_| ())
            };
            Journal::open(&place, name, "f00d").and_then(commit).unwrap_err().to_string()
        };
        let names = ["anna", "device", "link"].map(refused);
        let store = LabelStore::read(&place).unwrap();
        let read = [read_journal(&pipe).unwrap_err().to_string(), read_acts(&pipe).unwrap_err().to_string()];
        let _ = send.send((names, store.warnings().to_vec(), read));
    });
    let (names, warnings, read) = answer.recv_timeout(std::time::Duration::from_secs(10)).expect("no answer: it hangs");
    let said = |name: &str, what: &str| {
        format!("{}: no journal of labels: it is {what}; expected a file", case.file(name).display())
    };
    assert_eq!(names[0], said("anna", "a named pipe"));
    assert_eq!(names[1], said("device", "a device"));
    assert!(names[2].ends_with("it is a link to a file that is not there; expected a file"), "{}", names[2]);
    assert!(!case.folder.path().join("elsewhere").exists(), "nothing is made at the other end of a link");
    assert_eq!(warnings, [said("anna", "a named pipe"), said("device", "a device"), said("pipe", "a named pipe")]);
    assert_eq!(read, [said("pipe", "a named pipe"), said("pipe", "a named pipe")]);
    // What is refused hides nobody else, also in the program.
    commit(&mut case.journal("berta"), 0, Change::adding(Tag::F1));
    let (shown, warned) = case.told(&["show"]);
    assert_eq!(shown, "berta  frames/0000  F1\n");
    assert_eq!(warned.matches("it is a named pipe; expected a file").count(), 2, "{warned}");
    assert_eq!(
        case.refusal(&["tag", "--annotator", "anna", "--frame", "0", "--add", "F1"], ""),
        format!("error: {}", said("anna", "a named pipe"))
    );
}

/// A limit on the size of files stands for a disk that takes the first half of an act.
#[cfg(unix)]
#[test]
fn half_an_act_on_a_full_disk_is_taken_back() {
    let case = Case::new(200);
    commit(&mut case.journal("anna"), 0, Change::adding(Tag::F1));
    let before = std::fs::read(case.file("anna")).unwrap();
    let script = "trap '' XFSZ; ulimit -f 16; exec \"$@\"";
    let program = case.program(&["tag", "--annotator", "anna", "--frames", "..", "--add", "F2"]);
    let mut limited = Command::new("sh");
    limited.args(["-c", script, "sh"]).arg(program.get_program()).args(program.get_args());
    let output = limited.env(HOME_VARIABLE, case.home()).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("labels cannot be written: File too large"), "{stderr}");
    assert!(before.len() < 8192, "the first act fits");
    assert_eq!(std::fs::read(case.file("anna")).unwrap(), before);
    case.told(&["tag", "--annotator", "anna", "--frames", "..", "--add", "F2"]);
    let store = LabelStore::read(&case.place()).unwrap();
    assert_eq!((store.records("anna").count(), store.warnings().len()), (200, 0));
    assert_eq!(store.label("anna", &name(0)).unwrap().label.tags.to_string(), "F1 F2");
}
