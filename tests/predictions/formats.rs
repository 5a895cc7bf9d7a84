//! What is written in each format reads back to the same joints, and files as others write them are read.

use crate::{Frames, open, shifted_truth, walk};
use mhp_inspector::body::Skeleton;
use mhp_inspector::dataset::npz::{ArrayView, write, write_npy};
use mhp_inspector::dataset::{Dataset, write_pppr};
use mhp_inspector::geometry::{Vec3, norm, sub};
use mhp_inspector::predictions::{
    Axes, Predictions, Reading, RememberedReadings, Unit, WriteFormat, prediction_row, write_predictions,
};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

fn same(source: &Predictions, dataset: &Dataset, frames: &Frames) {
    assert_eq!(source.len(), frames.len());
    for (index, (_, persons)) in frames.iter().enumerate() {
        let read = source.frame(index).unwrap();
        let wanted: Vec<Vec3> = persons.concat();
        assert_eq!(read.persons, persons.len());
        let apart = read.joints.iter().zip(&wanted).map(|(&a, &b)| norm(sub(a, b))).fold(0.0, f64::max);
        assert!(apart < 1e-9, "frame {index}: {apart}");
    }
    assert_eq!(source.map.known.len(), dataset.info().skeleton.joints.len());
}

/// Told: metres, the radar's axes, COCO's joints.
fn told() -> Reading {
    Reading { unit: Some(Unit::M), axes: Some(Axes::WORLD), skeleton: Some("coco17".into()), ..Reading::default() }
}

#[test]
fn every_format_reads_back_what_was_written() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let mut frames = shifted_truth(&dataset, 0.05);
    // Two people in one frame, nobody in none: a table has no row for a frame without people.
    let second = frames[1].1[0].iter().map(|&[x, y, z]| [x + 1.0, y, z]).collect();
    frames[1].1.push(second);
    for name in ["p.npz", "p.csv", "p.json", "p.parquet"] {
        let path = folder.path().join(name);
        write_predictions(&path, WriteFormat::of(&path).unwrap(), &dataset.info().skeleton.joints, &frames).unwrap();
        let source = open(&path, &dataset).unwrap_or_else(|why| panic!("{name}: {why}"));
        same(&source, &dataset, &frames);
        assert_eq!((source.notes.len(), source.name.as_str()), (0, "p"), "{name}");
        let row = prediction_row(&dataset, 0, std::slice::from_ref(&source), None).unwrap();
        let truth = row.sources[0].truth.as_ref().unwrap();
        assert!((truth.errors.majpe_mm - 50.0).abs() < 1e-6 && truth.errors.pa_majpe_mm < 1e-6, "{name}");
        assert_eq!(truth.joints_mm.len(), 17);
        assert!(truth.joints_mm.iter().all(|(_, mm)| (mm - 50.0).abs() < 1e-6));
    }
}

#[test]
fn an_npy_is_told_once_what_it_is() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.0);
    // As a camera sees it, millimetres.
    let numbers: Vec<f64> = frames
        .iter()
        .flat_map(|(_, persons)| persons[0].iter().flat_map(|&p| Axes::CAMERA.file(p).map(|x| 1000.0 * x)))
        .collect();
    let path = folder.path().join("retr.npy");
    write_npy(&path, &ArrayView::f64(&[frames.len(), 17, 3], &numbers)).unwrap();
    let why = open(&path, &dataset).unwrap_err();
    assert!(why.is_question());
    let why = why.to_string();
    assert!(why.contains("which 17 joints they are, the unit, which way the axes point"), "{why}");
    assert!(why.contains("--skeleton coco17|h36m17 --unit m|cm|mm --axes") && why.contains("would be in mm"), "{why}");
    let memory = RememberedReadings::in_folder(folder.path());
    let camera = Reading { unit: Some(Unit::Mm), axes: Some(Axes::CAMERA), ..told() };
    same(&Predictions::open(&path, &dataset, &camera, Some(&memory)).unwrap(), &dataset, &frames);
    let again = Predictions::open(&path, &dataset, &Reading::default(), Some(&memory)).unwrap();
    same(&again, &dataset, &frames);
    assert_eq!(again.name, "retr");
    // A description beside the file comes before memory.
    std::fs::write(folder.path().join("retr.npy.toml"), "name = \"other\"\nunit = \"m\"\n").unwrap();
    let why = Predictions::open(&path, &dataset, &Reading::default(), Some(&memory)).unwrap_err().to_string();
    assert!(
        why.contains("wrong unit: in m half of the people would be") && why.contains("they would fit in mm"),
        "{why}"
    );
}

#[test]
fn padding_counts_and_numbers_of_frames_are_understood() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.0);
    let mut numbers = vec![f64::NAN; 2 * 2 * 17 * 3];
    for (k, index) in [3usize, 1].into_iter().enumerate() {
        let flat = frames[index].1[0].as_flattened();
        numbers[k * 102..k * 102 + 51].copy_from_slice(flat);
    }
    let path = folder.path().join("padded.npz");
    let arrays = [("keypoints", ArrayView::f64(&[2, 2, 17, 3], &numbers)), ("frames", ArrayView::i64(&[2], &[3, 1]))];
    write(&path, &arrays).unwrap();
    let source = Predictions::open(&path, &dataset, &told(), None).unwrap();
    assert_eq!(source.frames().collect::<Vec<_>>(), [1, 3]);
    assert_eq!(source.frame(3).unwrap().persons, 1);
    assert_eq!(source.frame(1).unwrap().joints, frames[1].1[0]);
    assert!(source.notes[0].contains(&format!("{} of {} frames have no prediction", dataset.len() - 2, dataset.len())));
}

#[test]
fn tables_of_a_row_a_joint_and_mmpose_are_read() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let (frames, names) = (shifted_truth(&dataset, 0.0), dataset.info().skeleton.joints.clone());
    let mut text = String::from("frame_id,person,joint,x_mm,y_mm,z_mm\n");
    for (index, (_, persons)) in frames.iter().enumerate() {
        for (name, [x, y, z]) in names.iter().zip(&persons[0]) {
            writeln!(text, "{index},0,{name},{},{},{}", 1e3 * x, 1e3 * y, 1e3 * z).unwrap();
        }
    }
    let path = folder.path().join("long.csv");
    std::fs::write(&path, text).unwrap();
    let axes = Reading { axes: Some(Axes::WORLD), ..Reading::default() };
    same(&Predictions::open(&path, &dataset, &axes, None).unwrap(), &dataset, &frames);

    let id2name: serde_json::Map<String, serde_json::Value> =
        names.iter().enumerate().map(|(k, name)| (k.to_string(), json!(name))).collect();
    let with_scores = |person: &Vec<Vec3>| person.iter().map(|[x, y, z]| json!([x, y, z, 0.5])).collect::<Vec<_>>();
    let info: Vec<_> = frames
        .iter()
        .enumerate()
        .map(|(k, (_, persons))| json!({ "frame_id": k, "instances": [{ "keypoints": with_scores(&persons[0]) }] }))
        .collect();
    let path = folder.path().join("mmpose.json");
    let whole =
        json!({ "meta_info": { "keypoint_id2name": id2name }, "instance_info": info, "unit": "m", "axes": "radar" });
    std::fs::write(&path, whole.to_string()).unwrap();
    same(&open(&path, &dataset).unwrap(), &dataset, &frames);

    // A plain list with flat keypoints, frames by the end of their names and an ending.
    let list: Vec<_> = frames
        .iter()
        .map(|(name, persons)| json!({ "file_name": format!("/data/x/{name}.png"), "keypoints": persons[0].as_flattened() }))
        .collect();
    let path = folder.path().join("list.json");
    std::fs::write(&path, json!(list).to_string()).unwrap();
    same(&Predictions::open(&path, &dataset, &told(), None).unwrap(), &dataset, &frames);
}

#[test]
fn the_parameters_of_an_earlier_run_are_a_source() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.1);
    std::fs::create_dir(folder.path().join("pppr")).unwrap();
    let names = dataset.file_names();
    for (index, (name, persons)) in frames.iter().enumerate() {
        let shape = mhp_inspector::body::PpprShape { persons: 1, joints: 17, doppler_features: 2 };
        let mut params = mhp_inspector::body::Pppr::zeros(shape);
        for (joint, &p) in persons[0].iter().enumerate() {
            params.set_vec3(mhp_inspector::body::Group::Position, joint, p);
        }
        let file = folder.path().join("pppr").join(format!("{}.npz", names.of(index, name)));
        write_pppr(&file, &params).unwrap();
    }
    // The folder of results, the one of parameters, and one file.
    same(&open(folder.path(), &dataset).unwrap(), &dataset, &frames);
    same(&open(&folder.path().join("pppr"), &dataset).unwrap(), &dataset, &frames);
    let one = folder.path().join("pppr").join(format!("{}.npz", names.of(2, &frames[2].0)));
    let source = open(&one, &dataset).unwrap();
    assert_eq!(source.frames().collect::<Vec<_>>(), [2]);
}

#[test]
fn another_skeleton_is_compared_over_the_joints_in_common() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.0);
    let h36m = Skeleton::preset("h36m17").unwrap();
    let coco = &dataset.info().skeleton;
    let place = |person: &Vec<Vec3>, name: &str| -> Vec3 {
        let at = |name: &str| person[coco.joint(name).unwrap()];
        let middle = |a: Vec3, b: Vec3| std::array::from_fn(|k| f64::midpoint(a[k], b[k]));
        match name {
            "pelvis" => middle(at("left_hip"), at("right_hip")),
            "thorax" => middle(at("left_shoulder"), at("right_shoulder")),
            "spine" | "head" => [at("nose")[0], at("nose")[1], 0.0],
            other => at(other),
        }
    };
    let theirs: Frames = frames
        .iter()
        .map(|(name, persons)| {
            (name.clone(), vec![h36m.joints.iter().map(|joint| place(&persons[0], joint)).collect()])
        })
        .collect();
    let path = folder.path().join("h.npz");
    write_predictions(&path, WriteFormat::Npz, &h36m.joints, &theirs).unwrap();
    let source = open(&path, &dataset).unwrap();
    assert_eq!(source.map.known.len(), 13);
    assert!(source.notes[0].starts_with("13 of the data set's 17 joints"), "{:?}", source.notes);
    let row = prediction_row(&dataset, 2, &[source], None).unwrap();
    assert!(row.sources[0].truth.as_ref().unwrap().errors.majpe_mm < 1e-6);
}

#[test]
fn frames_are_found_under_a_longer_path() {
    let (dataset, folder) = (walk(), tempfile::tempdir().unwrap());
    let frames = shifted_truth(&dataset, 0.0);
    let longer: Frames = frames.iter().map(|(name, p)| (format!("sets/walk/{name}.npz"), p.clone())).collect();
    let path = folder.path().join("longer.csv");
    write_predictions(Path::new(&path), WriteFormat::Csv, &dataset.info().skeleton.joints, &longer).unwrap();
    same(&open(&path, &dataset).unwrap(), &dataset, &frames);
}
