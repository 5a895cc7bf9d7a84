//! Where labels lie, whose file is whose, and what the program says of them.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::labels::{Case, commit, frame, name, tags};
use mhp_inspector::labels::{Change, Journal, LabelPlace, LabelStore, Tag, place_acts};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

#[test]
fn where_nothing_can_be_written_beside_the_data_the_users_folder_is_taken_and_said() {
    let case = Case::new(2);
    std::fs::write(case.labels(), "in the way").unwrap();
    let place = LabelPlace::of_or(&case.data(), "f00d", Some(&case.home())).unwrap();
    assert_eq!(place.folder, case.home().join("labels/f00d"));
    assert!(!place.beside_data);
    let reason = place.reason.clone().unwrap();
    assert!(reason.starts_with(&format!("{} cannot be written: ", case.labels().display())), "{reason}");
    assert!(!place.folder.exists(), "nothing is left of the trial");
    commit(&mut Journal::open(&place, "anna", "f00d").unwrap(), 0, Change::adding(Tag::F1));
    assert_eq!(tags(&place, "anna", 0), "F1");
    let (said, warned) = case.told(&["tag", "--annotator", "anna", "--frame", "1", "--add", "F2"]);
    assert!(warned.contains("labels are kept in") && warned.contains("cannot be written"), "{warned}");
    assert!(said.contains(&case.home().display().to_string()), "{said}");
    assert!(case.told(&["show"]).0.contains("F2"));
    let error = LabelPlace::of_or(&case.data(), "f00d", None).unwrap_err().to_string();
    assert!(error.starts_with(&format!("{}: no place for labels: ", case.data().display())), "{error}");
    let error = LabelPlace::of_or(&case.data(), "f00d", Some(&case.labels())).unwrap_err().to_string();
    assert!(
        error.contains("no place for labels") && error.contains("in the way") || error.contains("Not a directory"),
        "{error}"
    );
}

#[test]
fn labels_of_a_time_when_the_data_could_not_be_written_stay_in_sight() {
    let case = Case::new(3);
    std::fs::write(case.labels(), "in the way").unwrap();
    let away = LabelPlace::of_or(&case.data(), "f00d", Some(&case.home())).unwrap();
    let mut journal = Journal::open(&away, "anna", "f00d").unwrap();
    commit(&mut journal, 0, Change::adding(Tag::F1));
    commit(&mut journal, 1, Change::adding(Tag::F2));
    std::fs::remove_file(case.labels()).unwrap();
    let beside = LabelPlace::of_or(&case.data(), "f00d", Some(&case.home())).unwrap();
    assert!(beside.beside_data && beside.reason.is_none());
    assert_eq!(std::fs::read_dir(case.data()).unwrap().count(), 2, "nothing is left of the trial");
    assert_eq!(tags(&beside, "anna", 0), "F1");
    let mut journal = Journal::open(&beside, "anna", "f00d").unwrap();
    let outcomes = commit(&mut journal, 0, Change::adding(Tag::F3));
    assert_eq!(outcomes[0].before.tags.to_string(), "F1");
    assert_eq!((tags(&beside, "anna", 0), tags(&beside, "anna", 1)), ("F1 F3".into(), "F2".into()));
    // And back, in the same millisecond or with a clock that was set back.
    let mut journal = Journal::open(&away, "anna", "f00d").unwrap();
    assert_eq!(commit(&mut journal, 0, Change::removing(Tag::F1))[0].after.label.tags.to_string(), "F3");
    for place in [&away, &beside] {
        assert_eq!(tags(place, "anna", 0), "F3");
        let store = LabelStore::read(place).unwrap();
        let history = store.history("anna", &name(0)).unwrap();
        let acts: Vec<String> = history.iter().map(|record| record.label.tags.to_string()).collect();
        assert_eq!(acts, ["F1", "F1 F3", "F3"]);
        assert_eq!(store.last_edited("anna").unwrap().frame, frame(0));
    }
}

/// Two machines whose clocks differ by centuries write one after the other, one beside the data, one in its own folder.
#[test]
fn two_folders_with_clocks_that_differ_keep_the_order_of_the_acts() {
    let case = Case::new(2);
    let (beside, home) = (case.place().folder, case.home().join("labels/f00d"));
    let place =
        |folder: &Path, also: &Path| LabelPlace { also: vec![also.to_owned()], ..LabelPlace::in_folder(folder) };
    let (here, there) = (place(&beside, &home), place(&home, &beside));
    commit(&mut Journal::open(&there, "anna", "f00d").unwrap(), 0, Change::adding(Tag::F1));
    // The clock there was at the end of time; what it wrote stays as it is.
    let file = home.join("anna.labels.jsonl");
    let text = std::fs::read_to_string(&file).unwrap();
    let time = text.lines().nth(1).unwrap().split("\"time\":\"").nth(1).unwrap().split('"').next().unwrap();
    std::fs::write(&file, text.replace(time, "9999-12-31T23:59:59.999Z")).unwrap();
    let mut wanted = vec!["F1".to_owned()];
    let changes =
        [Change::adding(Tag::F2), Change::removing(Tag::F1), Change::adding(Tag::F3), Change::adding(Tag::Clean)];
    for (k, change) in changes.into_iter().enumerate() {
        let writer = if k % 2 == 0 { &here } else { &there };
        let mut journal = Journal::open(writer, "anna", "f00d").unwrap();
        let done = commit(&mut journal, 0, change);
        assert_eq!(done[0].before.tags.to_string(), *wanted.last().unwrap());
        wanted.push(done[0].after.label.tags.to_string());
        for reader in [&here, &there] {
            assert_eq!(&tags(reader, "anna", 0), wanted.last().unwrap(), "act {k}");
            let (acts, _) = place_acts(reader).unwrap();
            assert_eq!(acts.last().unwrap().label, done[0].after.label, "act {k}");
            let history = LabelStore::read(reader).unwrap().history("anna", &name(0)).unwrap();
            assert_eq!(history.iter().map(|record| record.label.tags.to_string()).collect::<Vec<_>>(), wanted);
        }
    }
    assert!(std::fs::read_to_string(&file).unwrap().contains("9999-12-31"), "nothing is rewritten");
}

/// Every file and folder below, with its bytes and its time.
fn state(folder: &Path) -> Vec<(PathBuf, SystemTime, Vec<u8>)> {
    let mut all = vec![(folder.to_owned(), std::fs::metadata(folder).unwrap().modified().unwrap(), Vec::new())];
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            all.extend(state(&path));
        } else {
            let modified = std::fs::metadata(&path).unwrap().modified().unwrap();
            all.push((path.clone(), modified, std::fs::read(&path).unwrap()));
        }
    }
    all
}

#[test]
fn who_only_reads_leaves_the_data_set_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    blob::write_dataset(&data, 4);
    let program = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"))
            .args(arguments)
            .current_dir(folder.path())
            .env("MHP_INSPECTOR_HOME", folder.path().join("home"))
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    };
    std::fs::write(
        folder.path().join("s.csv"),
        "frame,annotator,F1,F2,F3,F4,clean,unsure\nframes/000,bo,1,0,0,0,0,0\n",
    )
    .unwrap();
    for labelled in [false, true] {
        if labelled {
            program(&["labels", "tag", "data", "--annotator", "ada", "--frame", "0", "--add", "F1"]);
        }
        let before = state(&data);
        let reads: [&[&str]; 12] = [
            &["labels", "show", "data"],
            &["labels", "show", "data", "--json"],
            &["labels", "stats", "data"],
            &["labels", "stats", "data", "--by", "stratum"],
            &["labels", "agreement", "data", "data"],
            &["labels", "agreement", "data", "--machine"],
            &["labels", "export", "data", "--csv", "out.csv", "--json", "out.json"],
            &["labels", "import", "data", "s.csv", "--dry-run"],
            &["info", "data"],
            &["complexity", "data"],
            &["evidence", "data", "--frames", "1", "--iterations", "3"],
            &["count", "data"],
        ];
        for arguments in reads {
            program(arguments);
            assert!(state(&data) == before, "{arguments:?} changed the data set");
        }
        // The window: what it reads when it opens.
        let place = LabelPlace::to_read(&data, "f00d");
        let (journal, store) = (Journal::open(&place, "ada", "f00d").unwrap(), LabelStore::read(&place).unwrap());
        assert_eq!(journal.label("frames/000").is_some(), labelled);
        assert_eq!(store.annotators().count(), usize::from(labelled));
        assert!(state(&data) == before, "opening changed the data set");
    }
    // `info` tells what is wrong with the journals, and touches them as little.
    let own = std::fs::read_to_string(data.join("mhp-labels/ada.labels.jsonl")).unwrap();
    std::fs::write(data.join("mhp-labels/eve.labels.jsonl"), own).unwrap();
    let before = state(&data);
    let told = Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).arg("info").arg(&data).output().unwrap().stdout;
    let told = String::from_utf8(told).unwrap();
    assert!(told.contains("labels note ") && told.contains("only ada.labels.jsonl speaks"), "{told}");
    assert!(state(&data) == before);
}

#[test]
fn labels_of_a_bare_file_lie_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("maps.npz");
    std::fs::write(&file, b"").unwrap();
    let place = LabelPlace::of_or(&file, "f00d", None).unwrap();
    assert_eq!(place.folder, folder.path().join("maps.npz.mhp-labels"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    commit(&mut Journal::open(&place, "anna", "f00d").unwrap(), 0, Change::adding(Tag::F1));
    assert_eq!(tags(&place, "anna", 0), "F1");
}

#[test]
fn bad_input_to_the_program_is_one_line() {
    let case = Case::new(3);
    let tag = |rest: &[&str], stdin: &str| {
        let mut all = vec!["tag", "--annotator", "anna"];
        all.extend(rest);
        case.refusal(&all, stdin)
    };
    assert!(tag(&["--add", "F1"], "").contains("no frame; expected --frame, --frames or --from-stdin"));
    assert!(tag(&["--frame", "0"], "").contains("nothing to do; expected --add"));
    let error = tag(&["--frame", "frames/0009", "--add", "F1"], "");
    assert!(error.contains("--frame: no frame `frames/0009`") && error.contains("an index in 0..=2"), "{error}");
    assert!(tag(&["--frame", "3", "--add", "F1"], "").contains("no frame `3`"));
    assert!(tag(&["--frames", "0..9", "--add", "F1"], "").contains("--frames: frames 0..9 were asked for"));
    assert!(tag(&["--frame", "0", "--add", "F1", "--remove", "F1"], "").contains("F1 is to be added and removed"));
    assert!(tag(&["--frame", "0", "--add", "F1", "--add", "clean"], "").contains("exclude each other"));
    assert!(tag(&["--from-stdin"], "{\"frame\":0}\n\nno\n").contains("standard input, line 3: expected"));
    assert!(tag(&["--from-stdin"], "{\"frame\":0,\"tags\":[]}").contains("line 1: unknown field `tags`"));
    assert!(tag(&["--from-stdin"], "{\"add\":[\"F1\"]}").contains("line 1: missing field `frame`"));
    assert!(tag(&["--from-stdin"], "{\"frame\":77}").contains("line 1: no frame `77`"));
    assert!(!case.labels().exists(), "nothing was written");
    for wrong in [["--add", "F9"], ["--verdict", "maybe"], ["--person", "-1"]] {
        let output = case.program(&["tag", "--annotator", "a", "--frame", "0"]).args(wrong).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
    std::fs::create_dir_all(case.file("anna")).unwrap();
    let error = tag(&["--frame", "0", "--add", "F1"], "");
    assert!(error.starts_with(&format!("error: {}: labels cannot be ", case.file("anna").display())), "{error}");
}

/// The superuser may write everything, so the program is then run as somebody else.
#[cfg(unix)]
#[test]
fn a_journal_that_belongs_to_somebody_else_is_named() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
    use std::os::unix::process::CommandExt as _;
    const NOBODY: u32 = 65_534;
    let case = Case::new(1);
    let set = |path: &Path, mode: u32| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    std::fs::create_dir_all(case.home()).unwrap();
    for path in [case.folder.path(), &case.home(), &case.data()] {
        set(path, 0o777);
    }
    let run = |arguments: &[&str]| {
        let mut command = case.program(arguments);
        if std::fs::metadata("/proc/self").is_ok_and(|meta| meta.uid() == 0) {
            command.uid(NOBODY).gid(NOBODY);
        }
        command.output()
    };
    let act = ["tag", "--annotator", "anna", "--frame", "0", "--add", "F1"];
    match run(&["tag", "--help"]) {
        Ok(output) if output.status.success() => {}
        _ => return println!("skipped: the program cannot be started as another user than root"),
    }
    commit(&mut case.journal("anna"), 0, Change::adding(Tag::F2));
    set(&case.labels(), 0o777);
    set(&case.file("anna"), 0o444);
    let output = run(&act).unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    let wanted = format!("error: {}: labels cannot be written: Permission denied", case.file("anna").display());
    assert!(stderr.starts_with(&wanted), "{stderr}");
    // A folder that nobody else may write: their labels go to their own folder, and see what is there.
    set(&case.labels(), 0o555);
    let output = run(&act).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stderr).contains("labels are kept in"));
    let shown = String::from_utf8(run(&["show"]).unwrap().stdout).unwrap();
    assert_eq!(shown, "anna  frames/0000  F1 F2\n");
    set(&case.labels(), 0o755);
}
