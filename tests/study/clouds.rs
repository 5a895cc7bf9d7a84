//! `export --what pc`: the same points as npz, PLY and PCD, each where its cell of the exported map is.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::dataset::npz::{NpzArchive, read_array};
use mhp_inspector::mhp::Problem;
use mhp_inspector::representation::{CloudPoint, point_cloud};
use mhp_inspector::task::Progress;
use std::path::Path;
use std::process::Command;

const FIELDS: [&str; 6] = ["x", "y", "z", "v_r", "intensity", "view"];

fn export(path: &Path, out: &Path, words: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.arg("export").arg(path).arg("--out").arg(out).args(words).env("MHP_INSPECTOR_HOME", out);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Rows of six numbers behind a header that ends with `end`.
fn rows(bytes: &[u8], end: &str) -> (String, Vec<[f64; 6]>) {
    let at = bytes.windows(end.len()).position(|window| window == end.as_bytes()).unwrap() + end.len();
    let words = bytes[at..].chunks_exact(4).map(|word| <[u8; 4]>::try_from(word).unwrap()).collect::<Vec<_>>();
    assert!((bytes.len() - at).is_multiple_of(24));
    let row = |words: &[[u8; 4]]| {
        let mut row = [0.0; 6];
        for (k, word) in words.iter().enumerate() {
            row[k] = if k < 5 { f64::from(f32::from_le_bytes(*word)) } else { f64::from(i32::from_le_bytes(*word)) };
        }
        row
    };
    (String::from_utf8(bytes[..at].to_vec()).unwrap(), words.chunks_exact(6).map(row).collect())
}

#[test]
fn three_formats_hold_the_same_points_and_each_lies_at_its_cell() {
    let (folder, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    blob::write_dataset(folder.path(), 2);
    export(folder.path(), out.path(), &["--iterations", "5", "--frames", "1", "--what", "pc,heatmap"]);
    let file = |ending: &str| out.path().join(format!("pc/frames_001.{ending}"));
    let npz = NpzArchive::open(&file("npz")).unwrap().entries().unwrap();
    let told: Vec<_> = npz.iter().map(|e| (e.key.as_str(), e.dtype.as_str(), e.shape.len())).collect();
    assert_eq!(told, [("points", "<f4", 2), ("view", "<i8", 1)]);
    let (points, views) = (read_array(&file("npz"), "points").unwrap(), read_array(&file("npz"), "view").unwrap());
    assert!(points.shape[0] > 0 && points.shape[1] == 5);
    let (head, ply) = rows(&std::fs::read(file("ply")).unwrap(), "end_header\n");
    assert!(head.starts_with("ply\nformat binary_little_endian 1.0\n"));
    let declared: Vec<&str> = head.lines().filter_map(|l| l.strip_prefix("property ")).collect();
    let wanted: Vec<String> =
        FIELDS.iter().map(|name| format!("{} {name}", if *name == "view" { "int" } else { "float" })).collect();
    assert_eq!(declared, wanted);
    let (head, pcd) = rows(&std::fs::read(file("pcd")).unwrap(), "DATA binary\n");
    let line = |key: &str| head.lines().find_map(|l| l.strip_prefix(key)).unwrap().trim().to_owned();
    assert_eq!(line("VERSION "), "0.7");
    assert_eq!((line("FIELDS "), line("WIDTH ")), (FIELDS.join(" "), points.shape[0].to_string()));
    assert_eq!(
        (line("SIZE "), line("TYPE "), line("HEIGHT ")),
        ("4 4 4 4 4 4".into(), "F F F F F I".into(), "1".into())
    );
    assert!(ply == pcd && ply.len() == points.shape[0]);
    let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
    for ((row, point), view) in ply.iter().zip(points.data.chunks_exact(5)).zip(&views.data) {
        assert_eq!((&row[..5], row[5]), (point, *view));
        let view = &dataset.info().views[*view as usize];
        let bins = view.bins_of([point[0], point[1], point[2]]);
        assert!(bins.iter().all(|bin| (bin - bin.round()).abs() < 0.02), "{bins:?} of {}", view.array);
        let map = read_array(&out.path().join("heatmap/frames/001.npz"), &view.array).unwrap();
        let cell = map.data[bins[0].round() as usize * map.shape[1] + bins[1].round() as usize];
        assert!((cell - point[4]).abs() <= 1e-6 * cell.abs(), "the intensity is the map's: {cell} and {}", point[4]);
        assert!((2.0..4.0).contains(&point[0]), "the person stands 3 m away: {point:?}");
    }
}

/// What a map does not tell is taken from the joint that makes the cell.
#[test]
fn height_and_velocity_come_from_the_joints() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 1);
    let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
    let (info, frame) = (dataset.info(), dataset.load(0).unwrap());
    let maps: Vec<&[f64]> = frame.maps.iter().map(|map| map.data.as_slice()).collect();
    let skeleton = Skeleton::preset("coco17").unwrap();
    let problem = Problem::new(info.radar.clone(), skeleton, info.views.clone(), &maps).unwrap();
    let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features: 4 });
    for joint in 0..17 {
        params.set_vec3(Group::Position, joint, [3.0, 0.5, 0.4]);
        params.set_vec3(Group::LogScale, joint, [0.05_f64.ln(); 3]);
        params.set_vec3(Group::Velocity, joint, [1.0, 0.0, 0.0]);
        params.joint_mut(Group::Rotation, joint)[0] = 1.0;
    }
    let view = &info.views[0];
    let bins: Vec<usize> = view.bins_of([3.0, 0.5, 0.4]).iter().map(|bin| bin.round() as usize).collect();
    let cell = bins[0] * view.shape()[1] + bins[1];
    let maps: Vec<Vec<f64>> = info.views.iter().map(|view| vec![7.0; view.cells()]).collect();
    let found = point_cloud(&problem, &FitConfig::default(), &params, &maps, &[vec![cell], vec![]]);
    let [CloudPoint { position: [x, y, z], radial_mps, intensity, view: 0 }] = found[..] else {
        unreachable!("one cell of one view is one point: {found:?}");
    };
    assert!((x - 3.0).abs() < 0.07 && (y - 0.5).abs() < 0.07 && (z - 0.4).abs() < 0.02, "{x} {y} {z}");
    let d = (9.0_f64 + 0.25 + 0.16).sqrt();
    assert!((radial_mps - 3.0 / d).abs() < 1e-6, "{radial_mps}");
    assert_eq!(intensity, 7.0);
    let far: Vec<usize> = vec![0];
    let nothing = point_cloud(&problem, &FitConfig::default(), &params, &maps, &[far, vec![]]);
    assert!(nothing.len() <= 1);
}
