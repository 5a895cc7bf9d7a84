//! RT-Pose: cubes in every published form, joints, names of sequences, calibration.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its input has failed")]

use half::f16;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::dataset::npz::{ArrayView, write_npy};
use mhp_inspector::task::Progress;
use num_complex::Complex32;
use std::path::{Path, PathBuf};

type Write = Box<dyn Fn(&Path)>;

/// A manifest of small cubes: 2 × 3 × 4 cells.
const SMALL: &str = r#"
layout = "rt_pose"
[[view]]
array = "cube"
psf = { range_m = 0.05, azimuth_rad = 0.02, elevation_rad = 0.14, doppler_mps = 0.2 }
axes = [
  { kind = "z", bins = 2, lo = -1.0, hi = 1.0 },
  { kind = "y", bins = 3, lo = -1.5, hi = 1.5 },
  { kind = "x", bins = 4, lo = 0.0, hi = 4.0 },
]
"#;

fn pose(shift: f32) -> String {
    let joints: Vec<String> = (0..15).map(|k| format!("[{}, 0.5, {}]", 2.0 + shift, 0.1 * k as f32)).collect();
    format!("[{}]", joints.join(","))
}

/// A tree with one sequence and its labels; the folder of its cubes.
fn tree(home: &Path, cubes: &str) -> PathBuf {
    let folder = home.join("2023_0718_1700").join(cubes);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(home.join("dataset.toml"), SMALL).unwrap();
    std::fs::write(home.join("file_meta.txt"), "7,2023_0718_1700\n8,2023_0718_1701\n").unwrap();
    let labels = format!(
        r#"{{"7": {{"000010": [{{"Radar_frameID": "000012", "pose": {}}}, {{"Radar_frameID": 12, "pose": {}}}]}}}}"#,
        pose(0.0),
        pose(1.0)
    );
    std::fs::write(home.join("Test.json"), labels).unwrap();
    std::fs::create_dir_all(home.join("calib")).unwrap();
    let extrinsic = "[1,0,0,0.1, 0,1,0,0.2, 0,0,1,-0.3, 0,0,0,1]";
    std::fs::write(home.join("calib/calib.json"), format!(r#"{{"radar": {{"extrinsic": {extrinsic}}}}}"#)).unwrap();
    folder
}

fn open(path: &Path) -> Dataset {
    Dataset::open(path, &Progress::new()).unwrap()
}

#[test]
fn cubes_of_every_form_become_maps_of_three_axes() {
    let ramp: Vec<f32> = (0..24).map(|k| k as f32 + 1.0).collect();
    // Of three Doppler bins with the amplitudes a, 2a and 2a the root of the summed power is 3a.
    let dopplers: Vec<f32> = [1.0, 2.0, 2.0].iter().flat_map(|gain| ramp.iter().map(move |x| gain * x)).collect();
    let halves = |numbers: &[f32]| numbers.iter().map(|&x| f16::from_f32(x)).collect::<Vec<_>>();
    let (plain, half, parts) = (ramp.clone(), halves(&dopplers), [halves(&dopplers), halves(&dopplers)].concat());
    let turned: Vec<Complex32> = dopplers.iter().map(|&x| Complex32::from_polar(x, 1.0)).collect();
    let forms: [(&str, f64, &str, Write); 4] = [
        ("npy", 1.0, "one a cell", Box::new(move |p| write_npy(p, &ArrayView::f32(&[2, 3, 4], &plain)).unwrap())),
        (
            "DZYX_npy_f16",
            3.0,
            "3 Doppler bins",
            Box::new(move |p| write_npy(p, &ArrayView::f16(&[3, 2, 3, 4], &half)).unwrap()),
        ),
        (
            "npy_DZYX_complex",
            3.0,
            "complex numbers of 3",
            Box::new(move |p| write_npy(p, &ArrayView::complex64(&[3, 2, 3, 4], &turned)).unwrap()),
        ),
        (
            "DZYX_npy_f16_complex",
            3.0 * 2.0_f64.sqrt(),
            "real and imaginary parts of 3",
            Box::new(move |p| write_npy(p, &ArrayView::f16(&[2, 3, 2, 3, 4], &parts)).unwrap()),
        ),
    ];
    for (cubes, gain, words, write) in forms {
        let home = tempfile::tempdir().unwrap();
        let folder = tree(home.path(), cubes);
        write(&folder.join("000012.npy"));
        let dataset = open(home.path());
        let info = dataset.info();
        assert_eq!((info.layout.word(), dataset.len(), dataset.frame_name(0)), ("rt_pose", 1, "2023_0718_1700/000012"));
        assert!(info.assumptions.iter().any(|text| text.contains(words)), "{cubes}: {:?}", info.assumptions);
        assert!(info.notes.iter().any(|note| note.contains("lidar at (0.10, 0.20, -0.30) m")), "{:?}", info.notes);
        let frame = dataset.load(0).unwrap();
        assert_eq!(frame.maps[0].shape, [2, 3, 4]);
        let wrong = frame.maps[0].data.iter().zip(&ramp).find(|(h, x)| (*h / f64::from(**x) - gain).abs() > 1e-3);
        assert_eq!(wrong, None, "{cubes}");
        let truth = frame.truth.unwrap();
        assert_eq!((truth.persons, truth.joints.len(), frame.person_count), (2, 30, Some(2)));
        assert_eq!(truth.joints[15], [3.0, 0.5, 0.0]);
    }
}

#[test]
fn labels_that_are_wrong_become_notes_and_files_that_are_an_error() {
    let home = tempfile::tempdir().unwrap();
    let folder = tree(home.path(), "npy");
    let cube = folder.join("000012.npy");
    let ramp = [1.0_f32; 24];
    write_npy(&cube, &ArrayView::f32(&[2, 3, 4], &ramp)).unwrap();
    let notes = || open(home.path()).load(0).unwrap().notes.join("; ");
    for (text, wanted) in [
        ("{", "EOF"),
        (r#"{"7": {"10": [{"Radar_frameID": "x", "pose": []}]}}"#, "is no number"),
        (r#"{"7": {"10": [{"Radar_frameID": 12, "pose": [[1,2,3]]}]}}"#, "has 1 joints; expected 15"),
        (r#"{"8": {}}"#, "no joints of this frame"),
    ] {
        std::fs::write(home.path().join("Test.json"), text).unwrap();
        assert!(notes().contains(wanted), "{}", notes());
    }
    std::fs::remove_file(home.path().join("Test.json")).unwrap();
    assert!(notes().contains("are missing"));
    write_npy(&cube, &ArrayView::f32(&[4, 3, 2], &ramp)).unwrap();
    let told = open(home.path()).load(0).unwrap_err().to_string();
    assert!(told.contains("expected (2, 3, 4), the bins of its axes, (Doppler, 2, 3, 4)"), "{told}");
}

#[test]
fn of_several_folders_of_cubes_the_first_is_taken_and_said_and_a_folder_of_cubes_opens_alone() {
    let home = tempfile::tempdir().unwrap();
    let ramp = [1.0_f32; 24];
    for cubes in ["npy", "DZYX_npy_f16"] {
        write_npy(&tree(home.path(), cubes).join("000012.npy"), &ArrayView::f32(&[2, 3, 4], &ramp)).unwrap();
    }
    let dataset = open(home.path());
    assert_eq!(dataset.len(), 1);
    assert!(dataset.info().notes.iter().any(|note| note.contains("npy/ are taken, those of DZYX_npy_f16/ are not")));
    std::fs::write(home.path().join("2023_0718_1700/DZYX_npy_f16/dataset.toml"), SMALL).unwrap();
    let alone = open(&home.path().join("2023_0718_1700/DZYX_npy_f16"));
    assert_eq!((alone.len(), alone.frame_name(0)), (1, "2023_0718_1700/000012"));
    assert!(alone.load(0).unwrap().truth.is_some(), "labels are looked for above");
}
