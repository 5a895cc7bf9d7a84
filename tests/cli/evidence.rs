//! `evidence` as it is run: cards, JSON, table, exit codes, bad input.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::dataset::{Dataset, read_pppr, write_pppr};
use mhp_inspector::study::{BatchOptions, fit_frame};
use mhp_inspector::task::Progress;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn inspector(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.args(args).env("MHP_INSPECTOR_HOME", "/nonexistent").output().unwrap()
}

fn evidence(path: &Path, args: &[&str]) -> Output {
    inspector(&[&["evidence", path.to_str().unwrap()], args].concat())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn blob(frames: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), frames);
    folder
}

fn damage(folder: &Path, frame: usize) {
    let bad = vec![f64::NAN; 48 * 32];
    let arrays = ["hori", "vert"].map(|key| (key, ArrayView::f64(&[48, 32], &bad)));
    write(&folder.join(format!("frames/{frame:03}.npz")), &arrays).unwrap();
}

#[test]
fn json_has_a_card_a_mode_and_a_score_once_there_are_five_frames() {
    let folder = blob(6);
    let output = evidence(folder.path(), &["--frames", "3..6", "--iterations", "3", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let rows: Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = rows.as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["index"].as_u64().unwrap()).collect::<Vec<_>>(), [3, 4, 5]);
    assert_eq!(rows[0]["frame"], "frames/003");
    assert!(rows[0]["F1"]["score"].is_null() && rows[1]["F1"]["score"].is_f64());
    for row in rows {
        for mode in ["F1", "F2", "F3", "F4"] {
            let card = &row[mode];
            let score = card["score"].as_f64();
            assert!(score.is_none_or(|score| (0.0..=1.0).contains(&score)), "{card}");
            assert!(card["raw"].as_f64().is_none_or(|raw| (0.0..=1.0).contains(&raw)), "{card}");
            let measured = card["measures"].as_array().unwrap();
            assert!(measured.iter().all(|one| one["name"].is_string() && one["value"].is_f64()), "{card}");
            assert!(score.is_none() || !measured.is_empty(), "{card}");
            assert!(!card["summary"].as_str().unwrap().is_empty());
            for finding in card["findings"].as_array().unwrap() {
                let place = &finding["place"];
                let known = place["joint"].is_u64()
                    || place["frame"].is_u64()
                    || (place["cells"]["view"].is_u64()
                        && place["cells"]["lo"].is_array()
                        && place["cells"]["hi"].is_array());
                assert!(finding["text"].is_string() && (place.is_null() || known), "{finding}");
            }
        }
        let before = row["index"].as_u64().unwrap() - 1;
        let frames = row["F4"]["findings"].as_array().unwrap().iter().filter_map(|f| f["place"]["frame"].as_u64());
        assert!(frames.into_iter().all(|frame| frame == before));
        assert!(row["F4"]["score"].as_f64().is_some_and(|score| score < 0.5), "the person walks: {}", row["F4"]);
    }
}

#[test]
fn help_and_cards_say_what_a_score_means() {
    let help = text(&inspector(&["evidence", "--help"]).stdout);
    assert!(help.contains("A score is the probability that the mode is there: 0.5 means even odds."), "{help}");
    assert!(help.contains("odds' = odds * p/(1 - p) * (1 - P)/P"), "{help}");
    let folder = blob(2);
    let cards = text(&evidence(folder.path(), &["--frames", "1", "--iterations", "2"]).stdout);
    // F1 has no score yet, and nothing to say of one.
    assert_eq!(cards.matches("0.5 is even odds where").count(), 3, "{cards}");
}

#[test]
fn parameters_given_are_those_judged() {
    let folder = blob(5);
    let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
    let options = BatchOptions {
        config: mhp_inspector::config::FitConfig { iterations: 3, ..Default::default() },
        precision: mhp_inspector::mhp::Precision::F64,
        warm_start: false,
        params_folder: None,
        ply: false,
        curves_folder: None,
        ..BatchOptions::default()
    };
    let mut params = fit_frame(&dataset, 4, &options, None).unwrap().params;
    for joint in 0..17 {
        let [_, y, z] = params.position(joint);
        params.set_vec3(mhp_inspector::body::Group::Position, joint, [0.5, y, z]);
    }
    let file = folder.path().join("p.npz");
    write_pppr(&file, &params).unwrap();
    assert_eq!(read_pppr(&file, None).unwrap(), params);
    let file = file.to_str().unwrap();
    let output = evidence(folder.path(), &["--frames", "4", "--params", file, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let rows: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(rows[0]["F2"]["score"].as_f64().unwrap() > 0.8, "half a metre away: {}", rows[0]["F2"]);

    let several = evidence(folder.path(), &["--params", file]);
    assert_eq!(several.status.code(), Some(2));
    assert!(
        text(&several.stderr).contains("p.npz: --params is of one frame, 5 were asked for"),
        "{}",
        text(&several.stderr)
    );
    let missing = evidence(folder.path(), &["--frames", "4", "--params", "/nowhere/p.npz"]);
    assert_eq!((missing.status.code(), text(&missing.stderr).lines().count()), (Some(2), 1));
}

#[test]
fn cards_are_read_by_people_and_the_table_by_programs() {
    let folder = blob(6);
    damage(folder.path(), 1);
    let out = tempfile::tempdir().unwrap();
    let table = out.path().join("evidence.csv");
    let output = evidence(folder.path(), &["--iterations", "2", "--csv", table.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(text(&output.stderr).starts_with("warning: 1 of 6 frames could not be judged; the first: "));
    let cards = text(&output.stdout);
    assert_eq!(cards.lines().filter(|line| line.starts_with("frame ")).count(), 6);
    assert_eq!(cards.lines().filter(|line| line.starts_with("  F1 static reflector dominance")).count(), 5);
    assert!(cards.contains("cannot be judged: ") && cards.contains("001.npz"), "{cards}");
    assert!(cards.contains("[hori[") && cards.contains("[frame 3]") && cards.contains("[joint "), "{cards}");

    let mut reader = csv::Reader::from_path(&table).unwrap();
    let head = "frame,index,F1,F2,F3,F4,F1_summary,F2_summary,F3_summary,F4_summary,best_basin,error";
    assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>().join(","), head);
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 6);
    assert!(rows[1].iter().take(11).skip(2).all(str::is_empty) && rows[1][11].contains("no finite cell"));
    assert!(
        rows[5][2].is_empty() && rows[5][6].ends_with("this is number 4."),
        "frame 1 breaks the row: {:?}",
        &rows[5]
    );
    assert!(rows[2][5].is_empty(), "nothing usable right before frame 2");
    assert!(rows[3][5].parse::<f64>().is_ok_and(|score| (0.0..=1.0).contains(&score)));
}

#[test]
fn where_nothing_can_be_judged_the_code_is_two() {
    let folder = blob(1);
    damage(folder.path(), 0);
    let output = evidence(folder.path(), &["--iterations", "1"]);
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    assert!(told.starts_with("error: ") && told.contains("no finite cell") && told.lines().count() == 1, "{told}");
    let range = evidence(folder.path(), &["--frames", "3"]);
    assert!(text(&range.stderr).contains("frame 3 was asked for; the data set has 1"), "{}", text(&range.stderr));
    let table = evidence(folder.path(), &["--csv", "/nowhere/at/all.csv"]);
    assert_eq!(table.status.code(), Some(2));
    assert!(text(&table.stderr).contains("/nowhere/at/all.csv: cannot be written"), "{}", text(&table.stderr));
}

/// The fit that is judged is that of the preset, and of as many people, that are asked for.
#[test]
fn the_preset_and_the_number_of_people_are_those_asked_for() {
    let folder = blob(2);
    let of = |args: &[&str]| {
        let output = evidence(folder.path(), &[&["--frames", "0..1", "--iterations", "3", "--json"], args].concat());
        assert_eq!(output.status.code(), Some(0), "{args:?}: {}", text(&output.stderr));
        text(&output.stdout)
    };
    let usual = of(&[]);
    assert_eq!(of(&["--preset", "baseline"]), usual, "what the scores are calibrated on");
    assert_ne!(of(&["--preset", "paper"]), usual);
    assert_ne!(of(&["--people", "2"]), usual);
    for (args, expected) in [(["--preset", "best"], "recommended"), (["--people", "many"], "--people")] {
        let output = evidence(folder.path(), &args);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
    }
}
