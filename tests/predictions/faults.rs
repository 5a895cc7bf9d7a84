//! One clear message for each thing that can be wrong.

use crate::{Frames, refusal, shifted_truth, walk};
use mhp_inspector::dataset::npz::{ArrayView, write, write_npy};
use mhp_inspector::predictions::{Axes, Reading, Unit, WriteFormat, write_predictions};
use serde_json::json;

fn told(unit: Unit) -> Reading {
    Reading { unit: Some(unit), axes: Some(Axes::WORLD), ..Reading::default() }
}

#[test]
fn a_wrong_skeleton_names_both() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.0);
    let path = folder.path().join("p.npz");
    let names: Vec<String> = (0..17).map(|k| format!("marker{k}")).collect();
    write_predictions(&path, WriteFormat::Npz, &names, &frames).unwrap();
    let why = refusal(&path, &dataset, &Reading::default());
    assert!(
        why.contains("p.npz: wrong skeleton: 0 of its 17 joints (marker0, marker1") && why.contains("(nose, left_eye"),
        "{why}"
    );
    let hupr = Reading { skeleton: Some("hupr14".into()), ..told(Unit::M) };
    assert!(refusal(&path, &dataset, &hupr).contains("wrong skeleton: 17 joints a person; 14 are named"));
    // A mapping mends it.
    let mapping = (0..17).map(|k| (format!("marker{k}"), dataset.info().skeleton.joints[k].clone())).collect();
    let mended = Reading { mapping, ..told(Unit::M) };
    assert!(mhp_inspector::predictions::Predictions::open(&path, &dataset, &mended, None).is_ok());
}

#[test]
fn units_that_cannot_be_say_which_could() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.0);
    let numbers: Vec<f64> = frames.iter().flat_map(|(_, persons)| persons[0].as_flattened().to_vec()).collect();
    let path = folder.path().join("p.npy");
    write_npy(&path, &ArrayView::f64(&[frames.len(), 17, 3], &numbers)).unwrap();
    let coco = |unit| Reading { skeleton: Some("coco17".into()), ..told(unit) };
    let why = refusal(&path, &dataset, &coco(Unit::Mm));
    assert!(
        why.contains("wrong unit: in mm half of the people would be 0.00") && why.contains("they would fit in m"),
        "{why}"
    );
    let stated = folder.path().join("q.npz");
    let arrays = [("joints", ArrayView::f64(&[frames.len(), 17, 3], &numbers)), ("unit", ArrayView::text("feet"))];
    write(&stated, &arrays).unwrap();
    assert!(refusal(&stated, &dataset, &coco(Unit::M)).contains("unit \"feet\"; expected m, cm or mm"));
}

#[test]
fn missing_and_unknown_frames_are_told() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.0);
    let numbers: Vec<f64> = frames[..3].iter().flat_map(|(_, persons)| persons[0].as_flattened().to_vec()).collect();
    let path = folder.path().join("p.npy");
    write_npy(&path, &ArrayView::f64(&[3, 17, 3], &numbers)).unwrap();
    let coco = Reading { skeleton: Some("coco17".into()), ..told(Unit::M) };
    let why = refusal(&path, &dataset, &coco);
    assert!(
        why.contains(&format!("3 frames without names; the data set has {}; expected as many", dataset.len())),
        "{why}"
    );
    let others: Frames =
        frames.iter().map(|(name, p)| (format!("other-{}", name.replace('/', "-")), p.clone())).collect();
    let path = folder.path().join("p.csv");
    write_predictions(&path, WriteFormat::Csv, &dataset.info().skeleton.joints, &others).unwrap();
    let why = refusal(&path, &dataset, &told(Unit::M));
    assert!(
        why.contains("none of its") && why.contains("the first is \"other-") && why.contains(dataset.frame_name(0)),
        "{why}"
    );
}

#[test]
fn a_joint_that_is_no_number_is_named() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let mut frames = shifted_truth(&dataset, 0.0);
    frames[2].1[0][9][1] = f64::NAN;
    for name in ["p.npz", "p.csv", "p.parquet"] {
        let path = folder.path().join(name);
        write_predictions(&path, WriteFormat::of(&path).unwrap(), &dataset.info().skeleton.joints, &frames).unwrap();
        let why = refusal(&path, &dataset, &Reading::default());
        let wanted = format!("frame {}, person 0, joint `left_wrist` is not finite", frames[2].0);
        assert!(why.contains(&wanted), "{why}");
    }
}

#[test]
fn files_of_other_things_say_what_was_expected() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let cases: [(&str, String, &str); 8] = [
        ("a.csv", "frame,score\nx,1\n".into(), "no columns of joints; expected nose_x,nose_y,nose_z"),
        ("b.csv", "frame,nose_x,nose_y\nx,1,2\n".into(), "joint `nose` lacks a column"),
        ("c.csv", "person,nose_x,nose_y,nose_z\n0,1,2,3\n".into(), "no column `frame`"),
        ("d.csv", "frame,nose_x,nose_y,nose_z\nx,1,two,3\n".into(), "d.csv:2: column `nose_y`: `two` is no number"),
        ("e.json", "{\"a\": 1}".into(), "expected a list of persons with `keypoints`"),
        ("f.json", "[{\"image_id\": 0".into(), "f.json:1: EOF"),
        (
            "g.json",
            json!([{ "image_id": 0, "keypoints": [10.0, 20.0, 2.0, 30.0, 40.0, 1.0] }]).to_string(),
            "image points with visibility",
        ),
        ("h.txt", String::new(), "ending \".txt\"; expected .npz, .npy, .csv, .json, .parquet"),
    ];
    for (name, text, wanted) in cases {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let why = refusal(&path, &dataset, &told(Unit::M));
        assert!(why.contains(wanted) && why.contains(name), "{name}: {why}");
    }
    let path = folder.path().join("i.parquet");
    std::fs::write(&path, b"PAR1 no table PAR1").unwrap();
    assert!(refusal(&path, &dataset, &told(Unit::M)).contains("i.parquet: "));
    assert!(refusal(&folder.path().join("none.npz"), &dataset, &told(Unit::M)).contains("cannot be read"));
}
