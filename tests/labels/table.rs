//! Labels as CSV and JSON: what is written is what is read, and what is no table of labels is refused in one sentence.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::labels::{
    COLUMNS, CellRegion, FrameId, Judged, Label, LabelRow, Record, Tag, Verdict, plan_import, read_table, write_csv,
    write_json,
};
use proptest::prelude::*;
use std::path::PathBuf;

/// Text that tables stumble over, besides any other.
fn nasty() -> impl Strategy<Value = String> {
    let known = [
        "",
        "=1+2",
        "+1",
        "-1",
        "@cmd",
        "\"",
        "\"\"",
        "a,b",
        "a\nb",
        "a\r\nb",
        "\r",
        "\n",
        " x ",
        "\t",
        "τ ω ±",
        "\u{feff}x",
        "'",
        ";",
        "#no comment",
        "\0",
        "1",
        "null",
        "[1]",
    ];
    prop_oneof![prop::sample::select(known.to_vec()).prop_map(str::to_owned), any::<String>(), "[ -~\r\n\"]{0,30}"]
}

fn region() -> impl Strategy<Value = CellRegion> {
    let axes = prop::collection::vec((0..500_usize, 0..500_usize), 0..4);
    ("[a-z_\\[ ,=.0-9]{1,12}", axes).prop_map(|(view, axes)| {
        let (lo, hi) = axes.into_iter().map(|(lo, size)| (lo, lo + size)).unzip();
        CellRegion { view, lo, hi }
    })
}

prop_compose! {
    fn label()(
        tags in prop::collection::vec(prop::sample::select(Tag::ALL.to_vec()), 0..6),
        note in nasty(),
        person in prop::option::of(any::<u32>()),
        region in prop::option::of(region()),
        verdict in prop::option::of(prop::sample::select(Verdict::ALL.to_vec())),
    ) -> Label {
        Label { tags: tags.into_iter().collect(), note, person, region, verdict }
    }
}

prop_compose! {
    fn judged()(
        fit in prop::option::of("[0-9a-f]{16}"),
        config in prop::option::of("[0-9a-f]{16}"),
        iteration in prop::option::of(any::<usize>()),
        machine in prop::collection::btree_map(prop::sample::select(Tag::MODES.to_vec()), 0.0..=1.0_f64, 0..4),
        erased in prop::collection::vec(region(), 0..3),
        machine_shown in any::<bool>(),
    ) -> Judged {
        Judged { fit, config, iteration, erased, machine, machine_shown }
    }
}

prop_compose! {
    fn record()(
        (path, annotator, act) in (nasty().prop_map(|text| format!("f{text}")), nasty(), nasty()),
        index in any::<usize>(),
        label in label(),
        judged in judged(),
        millis in 0..999_u32,
        (dataset, program) in ("[0-9a-f]{16}", "[0-9.]{1,8}"),
    ) -> Record {
        let time = format!("2025-03-01T12:00:00.{millis:03}Z");
        let after = None;
        Record { dataset, frame: FrameId { path, index }, label, annotator, time, after, act, program, judged }
    }
}

/// As many records as there are, each frame once for an annotator, in the order of a table.
fn records() -> impl Strategy<Value = Vec<Record>> {
    prop::collection::vec(record(), 0..12).prop_map(|mut records| {
        let key = |record: &Record| (record.frame.index, record.frame.path.clone(), record.annotator.clone());
        records.sort_by_key(|record| (record.frame.path.clone(), record.annotator.clone()));
        records.dedup_by_key(|record| (record.frame.path.clone(), record.annotator.clone()));
        records.sort_by_key(key);
        records
    })
}

struct File(tempfile::TempDir);

impl File {
    fn of(bytes: &[u8]) -> Self {
        let file = Self(tempfile::tempdir().unwrap());
        std::fs::write(file.path(), bytes).unwrap();
        file
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("labels")
    }

    fn records(&self) -> Vec<Record> {
        read_table(&self.path()).unwrap().rows.into_iter().map(|row| row.record).collect()
    }

    /// What is said of it, without the file's name.
    fn refusal(&self) -> String {
        let message = read_table(&self.path()).unwrap_err().to_string();
        assert!(message.len() < 500 && !message.contains('\n'), "one line: {message}");
        message.strip_prefix(&format!("{}: ", self.path().display())).unwrap().to_owned()
    }
}

proptest! {
    #[test]
    fn csv_reads_back_what_it_writes(mut written in records()) {
        let mut bytes = Vec::new();
        write_csv(&mut bytes, written.iter().rev()).unwrap();
        let read = File::of(&bytes).records();
        prop_assert_eq!(&read, &written);
        written.reverse();
        let mut again = Vec::new();
        write_csv(&mut again, &read).unwrap();
        prop_assert_eq!(again, bytes);
    }

    #[test]
    fn json_reads_back_what_it_writes(written in records()) {
        let mut bytes = Vec::new();
        write_json(&mut bytes, &written).unwrap();
        prop_assert_eq!(File::of(&bytes).records(), written);
    }

    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), cells in "[0-9a-z,\"\r\n.=\\[\\]]{0,300}") {
        let _ = read_table(&File::of(&bytes).path());
        let _ = read_table(&File::of(format!("{}\n{cells}", COLUMNS.join(",")).as_bytes()).path());
    }
}

const HEAD: &str = "frame,F1,F2,F3,F4,clean,unsure";

#[test]
fn the_order_of_columns_and_the_case_of_words_do_not_matter() {
    let file = File::of(
        "\u{feff}Unsure, f4 ,F1,clean,F2,F3,person,frame\nYES,no,1,,FALSE,True,,a\n\n0,,,true,,,3,b\n".as_bytes(),
    );
    let read = file.records();
    let said: Vec<(String, Option<u32>)> = read.iter().map(|r| (r.label.tags.to_string(), r.label.person)).collect();
    assert_eq!(said, [("F1 F3 unsure".to_owned(), None), ("clean".to_owned(), Some(3))]);
}

#[test]
fn an_empty_file_and_a_header_alone_have_no_rows() {
    for text in ["", "\n \n", HEAD, "[]", " [ ] "] {
        assert!(File::of(text.as_bytes()).records().is_empty(), "{text:?}");
    }
}

#[test]
fn bad_cells_are_named_by_line_and_column() {
    let wide = format!("{HEAD},verdict,person,region,time,machine_F2,index,note");
    let cases = [
        ("a,1,0,2,0,0,0,,,,,,,", "line 3, column `F3`: `2`; expected 1 or 0"),
        ("a,1,0,0,0,0,maybe,,,,,,,", "line 3, column `unsure`: `maybe`; expected 1 or 0"),
        (",1,0,0,0,0,0,,,,,,,", "line 3, column `frame`: is empty; expected a frame's name"),
        ("a,1,0,0,0,0,0,wrong,,,,,,", "line 3, column `verdict`: `wrong` is no verdict; expected annotation-error"),
        ("a,1,0,0,0,0,0,,-1,,,,,", "line 3, column `person`: `-1`; expected a person's number, counted from 0"),
        ("a,1,0,0,0,0,0,,,hm[3],,,,", "line 3, column `region`: `hm[3]` is no region; expected a view"),
        ("a,1,0,0,0,0,0,,,,yesterday,,,", "line 3, column `time`: `yesterday`; expected a time such as"),
        ("a,1,0,0,0,0,0,,,,,1.5,,", "line 3, column `machine_F2`: is 1.5; expected a score from 0 to 1"),
        ("a,1,0,0,0,0,0,,,,,NaN,,", "line 3, column `machine_F2`: is NaN; expected a score from 0 to 1"),
        ("a,1,0,0,0,0,0,,,,,,first,", "line 3, column `index`: `first`; expected a whole number"),
        ("a,1,0,0", "line 3: 4 cells; the header has 14"),
        ("ok,1,0,0,0,0,0,,,,,,,", "line 3: frame `ok` of annotator `` is on line 2 already"),
    ];
    for (row, wanted) in cases {
        let message = File::of(format!("{wide}\nok,1,0,0,0,0,0,,,,,,,\n{row}\n").as_bytes()).refusal();
        assert!(message.starts_with(wanted), "{row}: {message}");
    }
}

#[test]
fn lines_are_counted_over_notes_of_many_lines_and_blank_lines() {
    let text = format!("{HEAD},note\r\na,1,0,0,0,0,0,\"one\r\ntwo\nthree\"\r\n\r\n\r\nb,x,0,0,0,0,0,\r\n");
    assert!(
        File::of(text.as_bytes()).refusal().starts_with("line 7, column `F1`"),
        "{}",
        File::of(text.as_bytes()).refusal()
    );
}

#[test]
fn what_is_no_table_says_what_was_expected() {
    let missing = File::of(b"frame,F1,F2,F4,clean,note\n").refusal();
    assert!(missing.starts_with("line 1: no columns `F3`, `unsure`; expected a header of names"), "{missing}");
    let semicolons = File::of(HEAD.replace(',', ";").as_bytes()).refusal();
    assert!(semicolons.contains("separated by commas, found `frame;F1;F2"), "{semicolons}");
    let twice = File::of(format!("{HEAD},f1\n").as_bytes()).refusal();
    assert_eq!(twice, "line 1: column `F1` is there twice");
    let journal = File::of(b" {\"format\":\"mhp-labels\"}\n").refusal();
    assert!(journal.starts_with("is a journal, not a table"), "{journal}");
    let latin = [HEAD.as_bytes(), b",note\na,1,0,0,0,0,0,caf\xe9\n"].concat();
    assert_eq!(File::of(&latin).refusal(), "line 2, column `note`: is not UTF-8 text");
    assert!(File::of(&[0xff, 0xd8, 0xff, 0x00, 0x10]).refusal().starts_with("line 1: no columns `frame`"));
    assert!(File::of(b"[{\"frame\": 3}]").refusal().contains("expected a JSON array of records"));
    assert!(File::of(b"[{}").refusal().starts_with("line 1, sign 3: "));
    let folder = tempfile::tempdir().unwrap();
    assert!(read_table(folder.path()).unwrap_err().to_string().contains("is a folder; expected a journal"));
    assert!(read_table(&folder.path().join("none")).unwrap_err().to_string().contains("cannot be read"));
}

#[test]
fn huge_lines_are_refused_in_a_short_sentence() {
    let huge = "x".repeat(20_000_000);
    assert!(File::of(huge.as_bytes()).refusal().starts_with("line 1: no columns `frame`"));
    for (row, column) in [("{},1,0,0,0,0,0,v", "verdict"), ("a,{},0,0,0,0,0,", "F1"), ("a,1,0,0,0,0,0,{}", "verdict")] {
        let text = format!("{HEAD},verdict\n{}\n", row.replace("{}", &huge));
        let message = File::of(text.as_bytes()).refusal();
        assert!(message.starts_with(&format!("line 2, column `{column}`")), "{message}");
    }
    let text =
        format!("[{{\"dataset\":\"\",\"frame\":{{\"path\":\"a\",\"index\":0}},\"label\":{{\"tags\":[\"{huge}\"]}}}}]");
    assert!(File::of(text.as_bytes()).refusal().contains("unknown variant"));
}

#[test]
fn an_import_writes_what_is_new_or_newer() {
    let record = |frame: &str, tags: &str, time: &str| Record {
        dataset: String::new(),
        frame: FrameId { path: frame.into(), index: 0 },
        label: Label { tags: tags.parse().unwrap(), ..Label::default() },
        annotator: "ann".into(),
        time: time.into(),
        after: None,
        act: String::new(),
        program: String::new(),
        judged: Judged::default(),
    };
    let noon = "2025-03-01T12:00:00.000Z";
    let known = ["same", "older", "newer", "untimed", "equal time"].map(|frame| record(frame, "F1", noon));
    let taken_back = ["taken back", "taken back later"].map(|frame| record(frame, "", noon));
    let known: Vec<&Record> = known.iter().chain(&taken_back).collect();
    let rows = [
        record("same", "F1", "2025-03-02T12:00:00Z"),
        record("older", "F2", "2025-03-01T11:59:59.999Z"),
        // An hour later in words, earlier in time.
        record("newer", "F2", "2025-03-01T13:30:00+01:00"),
        record("untimed", "F2", ""),
        record("equal time", "F2", noon),
        record("taken back", "F2", "2025-03-01T12:00:00.001Z"),
        record("taken back later", "F2", "2025-03-01T11:00:00Z"),
        record("unknown", "F2", ""),
        record("nothing said", "", ""),
    ];
    let rows: Vec<LabelRow> = (2..).zip(rows).map(|(line, record)| LabelRow { line, record }).collect();
    let find = |row: &Record| known.iter().find(|known| known.frame == row.frame).copied();
    let plan = plan_import(&rows, false, find);
    let frames = |rows: &[&LabelRow]| rows.iter().map(|row| row.record.frame.path.clone()).collect::<Vec<_>>();
    assert_eq!((plan.same, plan.kept), (2, 4));
    assert_eq!(frames(&plan.write), ["newer", "taken back", "unknown"]);
    let replacing = plan_import(&rows, true, find);
    assert_eq!((replacing.same, replacing.kept, replacing.write.len()), (2, 0, 7));
}

#[test]
fn both_forms_check_the_same_and_say_the_same() {
    let head = format!("{HEAD},region,machine_F2,time");
    let record = |frame: &str, label: &str, machine: &str, time: &str| {
        format!(
            r#"{{"frame":{{"path":"{frame}"}},"label":{{"tags":["F1"]{label}}},"annotator":"","time":"{time}","judged":{{"machine":{{{machine}}}}}}}"#
        )
    };
    let region = |lo: &str, hi: &str| format!(r#","region":{{"view":"hm","lo":{lo},"hi":{hi}}}"#);
    let same = [
        (
            "a,1,0,0,0,0,0,,7.5,",
            record("a", "", r#""F2":7.5"#, ""),
            "column `machine_F2`: is 7.5; expected a score from 0 to 1",
        ),
        ("a,1,0,0,0,0,0,,-0.1,", record("a", "", r#""F2":-0.1"#, ""), "column `machine_F2`: is -0.1; expected a score"),
        (
            "a,1,0,0,0,0,0,hm[9..=3],,",
            record("a", &region("[9]", "[3]"), "", ""),
            "column `region`: `hm[9..=3]` is no region; expected a view and the bins of its axes",
        ),
        ("a,1,0,0,0,0,0,,,noon", record("a", "", "", "noon"), "column `time`: `noon`; expected a time such as"),
        (",1,0,0,0,0,0,,,", record("", "", "", ""), "column `frame`: is empty; expected a frame's name"),
    ];
    for (row, json, wanted) in same {
        let csv = File::of(format!("{head}\n{row}\n").as_bytes()).refusal();
        let json = File::of(format!("[{json}]").as_bytes()).refusal();
        assert!(csv.starts_with(&format!("line 2, {wanted}")), "{csv}");
        assert_eq!(json.strip_prefix("line 1, "), csv.strip_prefix("line 2, "), "{row}");
    }
    // What a CSV cannot say at all.
    let uneven = File::of(format!("[{}]", record("a", &region("[1,2]", "[3]"), "", "")).as_bytes()).refusal();
    assert_eq!(uneven, "line 1, column `region`: has 2 first and 1 last bins; expected one of each for each axis");
    let clean = File::of(format!("[{}]", record("a", "", r#""clean":0.5"#, "")).as_bytes()).refusal();
    assert!(clean.starts_with("line 1, column `machine_clean`: is 0.5; expected scores of F1"), "{clean}");
    let fine = record("a", &region("[3]", "[9]"), r#""F2":1.0"#, "2025-03-01T12:30:00Z");
    assert_eq!(File::of(format!("[{fine}]").as_bytes()).records()[0].label.region.as_ref().unwrap().hi, [9]);
}

#[test]
fn what_a_spreadsheet_would_compute_is_kept_from_it_and_comes_back() {
    for text in ["=HYPERLINK(1)", "+1", "-1", "@x", "\t=1", "\r=1", "'=1", "''-1", "'quoted'", "plain"] {
        let said = Record {
            dataset: text.into(),
            frame: FrameId { path: text.into(), index: 0 },
            label: Label { note: text.into(), ..Label::default() },
            annotator: text.into(),
            time: String::new(),
            after: None,
            act: text.into(),
            program: text.into(),
            judged: Judged { machine: [(Tag::F1, 0.5)].into(), ..Judged::default() },
        };
        let mut bytes = Vec::new();
        write_csv(&mut bytes, [&said]).unwrap();
        let mut reader = csv::Reader::from_reader(bytes.as_slice());
        let cells: Vec<String> = reader.records().next().unwrap().unwrap().iter().map(str::to_owned).collect();
        for cell in &cells {
            assert!(!cell.starts_with(['=', '+', '-', '@', '\t', '\r']), "{text:?}: {cell:?}");
        }
        assert_eq!(cells[18], "0.5", "numbers are as they are");
        assert_eq!(File::of(&bytes).records(), [said]);
    }
}
