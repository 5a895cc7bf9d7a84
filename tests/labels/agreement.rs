//! Agreement of two annotators: equal to scikit-learn's on random labels and where they degenerate.
//!
//! The answers in `reference/agreement` are scikit-learn 1.9's `cohen_kappa_score`, `accuracy_score` and
//! `confusion_matrix` on the frames that both judged, κ `null` where it gives NaN, and all null and 0 without such a frame
//! (it refuses an empty array). `cases.json`: labels by frame as a sum of 1 F1, 2 F2, 4 F3, 8 F4, 16 clean, 32 unsure,
//! drawn by numpy's `default_rng(20260303)`: 1 to 160 frames at four prevalences, each side judging nine in ten, the second
//! independent or the first with 15 % flipped; then the degenerate ones. `ann.csv`, `bo.csv`: tables as Python's csv module
//! writes them, with other columns in another order; their answers are `ann-bo.json`.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::labels::{
    Agreement, FrameId, Judged, Label, Record, Tag, TagAgreement, Tags, Verdict, against_machine, agreement, judged,
    judged_in_acts, read_table, verdict_agreement,
};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/agreement");

fn json(name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(Path::new(FOLDER).join(name)).unwrap()).unwrap()
}

fn tags(bits: u64) -> Tags {
    Tag::ALL.into_iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1).map(|(_, tag)| tag).collect()
}

fn side(labels: &Value) -> BTreeMap<String, Record> {
    let label = |bits: &Value| Label { tags: tags(bits.as_u64().unwrap()), ..Label::default() };
    labels.as_object().unwrap().iter().map(|(frame, bits)| (frame.clone(), record(frame, label(bits)))).collect()
}

fn equals(name: &str, got: Option<f64>, want: &Value) {
    match (got, want.as_f64()) {
        (Some(got), Some(want)) => assert!((got - want).abs() <= 1e-12, "{name}: {got}, not {want}"),
        (got, want) => assert_eq!(got, want, "{name}"),
    }
}

fn is_table(name: &str, got: &TagAgreement, want: &Value) {
    equals(&format!("{name}, kappa"), got.kappa, &want["kappa"]);
    equals(&format!("{name}, raw"), got.raw, &want["raw"]);
    let counts = [got.both, got.only_a, got.only_b, got.neither].map(|n| n as u64);
    let wanted = ["both", "only_a", "only_b", "neither"].map(|key| want[key].as_u64().unwrap());
    assert_eq!(counts, wanted, "{name}");
    assert_eq!(
        got.unreliable.is_none(),
        counts[..3].iter().sum::<u64>() >= 10 && counts[1..].iter().sum::<u64>() >= 10
    );
}

fn is_agreement(name: &str, got: &Agreement, want: &Value) {
    let counts = [got.frames, got.only_in_a, got.only_in_b].map(|n| n as u64);
    assert_eq!(counts, ["frames", "only_in_a", "only_in_b"].map(|key| want[key].as_u64().unwrap()), "{name}");
    assert_eq!(got.tags.iter().map(|(tag, _)| *tag).collect::<Vec<_>>(), Tag::ALL);
    for (tag, table) in &got.tags {
        is_table(&format!("{name}, {tag}"), table, &want["tags"][tag.code()]);
    }
    is_table(&format!("{name}, pooled"), &got.pooled, &want["tags"]["pooled"]);
    assert_eq!(got.disputes.len(), got.pooled.only_a + got.pooled.only_b, "{name}");
    assert!(got.disputes.is_sorted() && got.disputes.iter().all(|dispute| dispute.a != dispute.b));
}

#[test]
fn every_case_equals_scikit_learn() {
    let cases = json("cases.json");
    let mut undefined = 0;
    for case in cases.as_array().unwrap() {
        let (a, b) = (side(&case["a"]), side(&case["b"]));
        let found = agreement(judged_in_acts(a.values()), judged_in_acts(b.values()));
        is_agreement(case["name"].as_str().unwrap(), &found, &case["expected"]);
        for dispute in &found.disputes {
            let given = [&a, &b].map(|side| side[&dispute.frame].label.tags.contains(dispute.tag));
            assert_eq!(given, [dispute.a, dispute.b]);
        }
        undefined += found.tags.iter().filter(|(_, table)| table.kappa.is_none()).count();
    }
    assert!(cases.as_array().unwrap().len() > 40 && undefined > 40, "{undefined} undefined among all cases");
}

#[test]
fn tables_of_another_program_are_read_as_it_reads_them() {
    let read = |name: &str| read_table(&Path::new(FOLDER).join(name)).unwrap();
    let (ann, bo) = (read("ann.csv"), read("bo.csv"));
    assert_eq!(ann.notes, ["column `colour` is passed over; it is none of a table of labels"]);
    let records =
        |rows: Vec<mhp_inspector::labels::LabelRow>| rows.into_iter().map(|row| row.record).collect::<Vec<_>>();
    let (ann, bo) = (records(ann.rows), records(bo.rows));
    assert!(ann.iter().any(|record| record.label.note == "two\r\nlines"), "notes keep their line ends");
    is_agreement("ann and bo", &agreement(judged_in_acts(&ann), judged_in_acts(&bo)), &json("ann-bo.json"));
}

fn record(frame: &str, label: Label) -> Record {
    Record {
        dataset: "0123456789abcdef".into(),
        frame: FrameId { path: frame.into(), index: 0 },
        label,
        annotator: "ann".into(),
        time: "2025-03-01T12:00:00.000Z".into(),
        after: None,
        act: "tag".into(),
        program: "0.1.0".into(),
        judged: Judged::default(),
    }
}

fn tagged(frame: &str, tags: &str) -> Record {
    record(frame, Label { tags: tags.parse().unwrap(), ..Label::default() })
}

#[test]
fn a_frame_is_judged_by_what_is_said_of_it_last() {
    let noted = Label { note: "look again".into(), ..Label::default() };
    let verdict = Label { verdict: Some("true-negative".parse().unwrap()), ..Label::default() };
    let acts = [
        tagged("changed", "F1"),
        tagged("taken back", "F2"),
        record("only a note", noted),
        tagged("stated as nothing", ""),
        record("a verdict", verdict),
        tagged("taken back", ""),
        tagged("changed", "F3 unsure"),
    ];
    let told = |record: &Record| format!("{}: {}", record.frame.path, record.label.tags);
    let found: Vec<String> = judged_in_acts(&acts).map(told).collect();
    assert_eq!(found, ["changed: F3 unsure", "stated as nothing: "]);
    // Of newest records alone nobody knows what an empty one took back.
    let newest: Vec<String> = judged(&acts[2..]).map(told).collect();
    assert_eq!(newest, ["changed: F3 unsure"]);
}

/// F1 on ten frames that both tagged: both on 2, only a on 3, only b on 3, neither on 2. p_o = 4/10 and p_e = (5·5 + 5·5)/100,
/// hence κ = (0.4 − 0.5)/(1 − 0.5) = −0.2. Twenty frames of which both only said whose count is wrong would make it
/// p_o = 24/30, p_e = (5·5 + 25·25)/900, κ = (0.8 − 0.7222)/0.2778 = 0.28: agreement on something else.
#[test]
fn a_verdict_alone_is_no_judgement_of_tags() {
    let of = |which: &dyn Fn(usize) -> bool, verdict: &str| -> Vec<Record> {
        let tags = (0..10).map(|k| tagged(&format!("tagged {k}"), if which(k) { "F1" } else { "clean" }));
        let review = Label { verdict: Some(verdict.parse().unwrap()), ..Label::default() };
        let noted = Label { note: "by the door".into(), ..review.clone() };
        let labels = [review, noted];
        let reviewed = (0..20).map(|k| record(&format!("reviewed {k}"), labels[k % 2].clone()));
        tags.chain(reviewed).collect()
    };
    let a = of(&|k| k < 5, "true-negative");
    let b = of(&|k| k < 2 || (5..8).contains(&k), "detection-error");
    let found = agreement(judged_in_acts(&a), judged_in_acts(&b));
    assert_eq!((found.frames, found.only_in_a, found.only_in_b), (10, 0, 0));
    let f1 = &found.tags[0].1;
    assert_eq!([f1.both, f1.only_a, f1.only_b, f1.neither], [2, 3, 3, 2]);
    assert!((f1.kappa.unwrap() + 0.2).abs() < 1e-12, "{:?}", f1.kappa);
    // `clean` is the complement, the other tags were never given: of them κ is undefined.
    let kappas: Vec<Option<f64>> = found.tags.iter().map(|(_, table)| table.kappa).collect();
    assert_eq!(kappas[1..4], [None; 3]);
    assert!((kappas[4].unwrap() + 0.2).abs() < 1e-12 && kappas[5].is_none());
    // All decisions: 4 of both yes, 6 + 6 disputed, 44 neither; κ = (48/60 − (10·10 + 50·50)/3600)/(1 − …) = 0.28.
    let pooled = &found.pooled;
    assert_eq!([pooled.both, pooled.only_a, pooled.only_b, pooled.neither], [4, 6, 6, 44]);
    assert!((pooled.kappa.unwrap() - 0.28).abs() < 1e-12, "{:?}", pooled.kappa);
}

/// Of ten frames, rows A's, columns B's: true negative 5 and 1 detection error, detection error 1 and 3. Σ r c = 6·6 + 4·4 = 52,
/// κ = (10·8 − 52)/(100 − 52) = 0.5833.
#[test]
fn verdicts_have_a_kappa_of_their_own() {
    let judged = |frame: usize, verdict: &str| {
        record(&format!("{frame}"), Label { verdict: Some(verdict.parse().unwrap()), ..Label::default() })
    };
    let (tn, de) = ("true-negative", "detection-error");
    let mut a: Vec<Record> = (0..10).map(|k| judged(k, if k < 6 { tn } else { de })).collect();
    let mut b: Vec<Record> = (0..10).map(|k| judged(k, if k < 5 || k == 6 { tn } else { de })).collect();
    // Alone, taken back, or only a tag: none of them counts.
    a.extend([judged(11, tn), judged(12, tn), record("12", Label::default()), tagged("13", "F1")]);
    b.extend([judged(12, tn), tagged("13", "F1")]);
    let found = verdict_agreement(&a, &b);
    assert_eq!((found.frames, found.raw), (10, Some(0.8)));
    assert!((found.kappa.unwrap() - 28.0 / 48.0).abs() < 1e-12, "{:?}", found.kappa);
    assert_eq!(found.table, [[0; 4], [0, 3, 0, 1], [0; 4], [0, 1, 0, 5]]);
    let one = verdict_agreement(&a[..3], &b[..3]);
    assert_eq!((one.frames, one.kappa), (3, None), "one answer by both everywhere tells nothing");
}

#[test]
fn the_verdicts_say_what_the_paper_says() {
    let words = Verdict::ALL.map(Verdict::words);
    assert!(words[0].contains("annotation is wrong") && words[1].contains("detection is wrong"));
    assert!(words[2].contains("Both are wrong"));
    assert!(words[3].contains("Both are right") && words[3].contains("tracking that passes"), "{}", words[3]);
}

#[test]
fn a_person_and_the_machine_are_compared_where_there_is_a_score() {
    let scored = |frame: &str, tags: &str, scores: &[(Tag, f64)], shown| {
        let judged = Judged { machine: scores.iter().copied().collect(), machine_shown: shown, ..Judged::default() };
        Record { judged, ..tagged(frame, tags) }
    };
    let acts = [
        scored("a", "F1", &[(Tag::F1, 0.5), (Tag::F2, 0.9)], true),
        scored("b", "clean", &[(Tag::F1, 0.499)], false),
        scored("c", "F2 F4", &[(Tag::F1, 1.0), (Tag::F4, f64::NAN)], false),
        scored("d", "F1", &[(Tag::F3, f64::NAN)], true),
        tagged("e", "F1"),
        scored("f", "F1", &[(Tag::F1, 1.0)], true),
        tagged("f", ""),
    ];
    let found = against_machine(judged_in_acts(&acts), 0.5);
    assert_eq!((found.agreement.frames, found.shown, found.unscored), (3, 1, 2));
    let counts = |table: &TagAgreement| [table.both, table.only_a, table.only_b, table.neither];
    let tables: Vec<(Tag, [usize; 4])> =
        found.agreement.tags.iter().map(|(tag, table)| (*tag, counts(table))).collect();
    let wanted = [(Tag::F1, [1, 0, 1, 1]), (Tag::F2, [0, 0, 1, 0]), (Tag::F3, [0; 4]), (Tag::F4, [0; 4])];
    assert_eq!(tables, wanted);
    assert_eq!(counts(&found.agreement.pooled), [1, 0, 2, 1]);
    // F1: p_o = 2/3, p_e = (1·2 + 2·1)/9.
    assert!((found.agreement.tags[0].1.kappa.unwrap() - 0.4).abs() < 1e-12);
    let disputes: Vec<String> =
        found.agreement.disputes.iter().map(|d| format!("{} {} {}", d.frame, d.tag, d.b)).collect();
    assert_eq!(disputes, ["a F2 true", "c F1 true"]);
}
