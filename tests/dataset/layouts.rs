//! The layouts of public data sets, read from files that the synthetic source writes in their exact format.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its input has failed")]

use mhp_inspector::cli::simulate::{Style, write_data_set};
use mhp_inspector::dataset::npz::{ArrayView, write_npy};
use mhp_inspector::dataset::{Dataset, Layout};
use mhp_inspector::geometry::{norm, sub};
use mhp_inspector::radar::{Axis, View};
use mhp_inspector::simulate::{Device, Options, Recording, ScenePreset, SimulatedLayout};
use mhp_inspector::task::Progress;
use num_complex::{Complex32, Complex64};
use std::path::Path;
use std::process::Command;

fn written(layout: SimulatedLayout, frames: usize, people: usize, narrow: bool) -> (tempfile::TempDir, Recording) {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        layout,
        presets: vec![ScenePreset::Easy],
        frames,
        sequence_length: frames,
        people: Some(people..=people),
        seed: 4,
        ..Options::default()
    };
    let recording = Recording::new(&options).unwrap();
    write_data_set(folder.path(), &recording, Style { narrow, ..Style::default() }, || ()).unwrap();
    (folder, recording)
}

fn open(path: &Path) -> Dataset {
    Dataset::open(path, &Progress::new()).unwrap()
}

fn told(path: &Path) -> String {
    Dataset::open(path, &Progress::new()).and_then(|dataset| dataset.load(0)).unwrap_err().to_string()
}

/// The largest difference between a stored and a simulated map, relative to the largest value.
fn difference(stored: &[f64], simulated: &[f32], scale: f64) -> f64 {
    let top = simulated.iter().copied().fold(0.0f32, f32::max);
    let worst = stored.iter().zip(simulated).map(|(a, b)| (a * scale - f64::from(*b)).abs()).fold(0.0, f64::max);
    worst / f64::from(top)
}

fn same_axes(a: &[View], b: &[View]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert_eq!(a.array, b.array);
        let near = |x: f64, y: f64| (x - y).abs() < 1e-6 * (1.0 + y.abs());
        let psf = [
            (a.psf.range_m, b.psf.range_m),
            (a.psf.azimuth_rad, b.psf.azimuth_rad),
            (a.psf.elevation_rad, b.psf.elevation_rad),
        ];
        assert!(psf.into_iter().all(|(x, y)| near(x, y)), "{:?} {:?}", a.psf, b.psf);
        for (x, y) in a.axes.iter().zip(&b.axes) {
            let Axis { kind, bins, lo, hi, spacing } = *y;
            assert_eq!((x.kind, x.bins, x.spacing), (kind, bins, spacing));
            assert!(near(x.lo, lo) && near(x.hi, hi), "{x:?} {y:?}");
        }
    }
}

#[test]
fn presets_have_the_axes_that_follow_from_the_processing() {
    let views = |layout| Device::new(layout).views;
    let published = |word| <dyn Layout>::named(word).unwrap().preset().unwrap().views;
    same_axes(&published("hupr"), &views(SimulatedLayout::Hupr));
    same_axes(&published("xrf55"), &views(SimulatedLayout::Xrf55Stack));
    same_axes(&published("hiber"), &views(SimulatedLayout::Hiber));
    same_axes(&published("rt_pose"), &views(SimulatedLayout::RtPose));
}

#[test]
fn hupr_is_read_with_its_labels_and_without_a_manifest() {
    let (folder, recording) = written(SimulatedLayout::Hupr, 2, 1, false);
    let path = folder.path().join("single_1/hori/000000001.npy");
    // Header and 16·64·64·8 numbers of sixteen bytes.
    assert_eq!(std::fs::metadata(&path).unwrap().len() - 8_388_608, 128);
    std::fs::remove_file(folder.path().join("dataset.toml")).unwrap();
    let dataset = open(folder.path());
    let info = dataset.info();
    assert_eq!((info.layout.word(), dataset.len(), dataset.sequences()), ("hupr", 2, 1));
    assert_eq!((info.frame_rate_hz, info.skeleton.joints.len()), (Some(10.0), 14));
    assert!(info.assumptions.iter().any(|text| text.contains("elevation")), "{:?}", info.assumptions);
    let (frame, exact) = (dataset.load(1).unwrap(), recording.frame(1));
    assert_eq!((frame.name.as_str(), dataset.sequence(1)), ("single_1/000000001", "single_1"));
    assert_eq!(frame.notes, Vec::<String>::new());
    assert_eq!(frame.timestamp_s, Some(0.1));
    for (map, simulated) in frame.maps.iter().zip(&exact.maps) {
        assert_eq!(map.shape, [16, 64, 64]);
        assert!(difference(&map.data, simulated, 1.0) < 1e-6);
    }
    assert_eq!(dataset.maps(1..2).next().unwrap().unwrap(), frame.maps);
    let image = frame.image.unwrap();
    assert_eq!((image.size, image.keypoint_skeleton.as_str(), image.keypoints[0].len()), ([256, 256], "hupr14", 14));
    let truth = frame.truth.unwrap();
    // R_Hip and L_Wrist are COCO's 12 and 9.
    assert!(norm(sub(truth.joints[0], exact.joints[0][12])) < 1e-6);
    assert!(norm(sub(truth.joints[10], exact.joints[0][9])) < 1e-6);
    let head = truth.joints[7][2] - truth.joints[2][2];
    assert!((1.2..1.95).contains(&head), "from ankle to crown {head} m");
    // A sequence's own folder will do.
    assert_eq!(open(&folder.path().join("single_1")).len(), 2);
}

#[test]
fn damaged_hupr_frames_have_one_clear_error_and_damaged_labels_a_note() {
    let (folder, _) = written(SimulatedLayout::Hupr, 1, 1, true);
    let (hori, vert) =
        (folder.path().join("single_1/hori/000000000.npy"), folder.path().join("single_1/vert/000000000.npy"));
    assert_eq!(open(folder.path()).load(0).unwrap().maps[0].dtype, "<c8");
    let labels = folder.path().join("hrnet_annot_train.json");
    for (text, wanted) in [
        ("[[{", "EOF"),
        ("[[],[],[]]", "lists 3 sequences"),
        (r#"[[{"image":"x.jpg","joints":[],"bbox":[0,0,1,1]}]]"#, "names no frame"),
        (r#"[[{"image":"000000000.jpg","joints":[[1,2]],"bbox":[0,0,1,1]}]]"#, "1 joints"),
    ] {
        std::fs::write(&labels, text).unwrap();
        let frame = open(folder.path()).load(0).unwrap();
        assert!(frame.image.is_none() && frame.notes.iter().any(|note| note.contains(wanted)), "{:?}", frame.notes);
    }
    std::fs::remove_file(&labels).unwrap();
    assert!(open(folder.path()).load(0).unwrap().notes[0].contains("missing"));
    let whole = std::fs::read(&vert).unwrap();
    std::fs::write(&vert, &whole[..whole.len() / 2]).unwrap();
    assert!(told(folder.path()).contains("vert"), "{}", told(folder.path()));
    let halves = vec![Complex32::ONE; 16 * 64 * 64 * 4];
    write_npy(&vert, &ArrayView::complex64(&[16, 64, 64, 4], &halves)).unwrap();
    assert!(told(folder.path()).contains("expected (16, 64, 64, 8)"), "{}", told(folder.path()));
    write_npy(&vert, &ArrayView::f32(&[16, 64, 64, 8], &vec![1.0; 16 * 64 * 64 * 8])).unwrap();
    assert!(told(folder.path()).contains("complex64 or complex128"), "{}", told(folder.path()));
    std::fs::remove_file(&vert).unwrap();
    let text = told(folder.path());
    assert!(text.contains("two cubes") && text.contains("hori/ is there"), "{text}");
    let dataset = open(folder.path());
    assert!(dataset.info().notes[0].contains("only one of hori and vert"), "{:?}", dataset.info().notes);
    let nan = vec![Complex64::new(f64::NAN, 0.0); 16 * 64 * 64 * 8];
    for path in [&hori, &vert] {
        write_npy(path, &ArrayView::complex128(&[16, 64, 64, 8], &nan)).unwrap();
    }
    assert!(open(folder.path()).load(0).unwrap().maps[0].data.iter().all(|x| x.is_nan()));
}

#[test]
fn xrf55_stacks_are_seventeen_frames_or_one() {
    let (folder, recording) = written(SimulatedLayout::Xrf55Stack, 17, 1, false);
    std::fs::remove_file(folder.path().join("dataset.toml")).unwrap();
    let dataset = open(folder.path());
    assert_eq!((dataset.info().layout.word(), dataset.len(), dataset.sequences()), ("xrf55", 17, 1));
    assert!(dataset.info().assumptions.iter().any(|text| text.contains("does not publish")));
    assert_eq!((dataset.frame_name(3), dataset.sequence(3)), ("mmWave/01_01_01/03", "mmWave/01_01_01"));
    let (frame, exact) = (dataset.load(3).unwrap(), recording.frame(3));
    assert_eq!(frame.notes, Vec::<String>::new());
    assert!(difference(&frame.maps[0].data, &exact.maps[0], 1.0) < 1e-6);
    assert!(norm(sub(frame.truth.unwrap().joints[0], exact.joints[0][0])) < 1e-6);
    // With an axis of one in front.
    let path = folder.path().join("mmWave/01_01_01.npy");
    let cells: Vec<f32> =
        (0..17).flat_map(|step| dataset.load(step).unwrap().maps.remove(0).data).map(|x| x as f32).collect();
    write_npy(&path, &ArrayView::f32(&[1, 17, 256, 128], &cells)).unwrap();
    assert_eq!(open(folder.path()).load(3).unwrap().maps, frame.maps);
    // The other sensors' files have the same names and are left alone.
    std::fs::create_dir(folder.path().join("WiFi")).unwrap();
    std::fs::write(folder.path().join("WiFi/01_01_01.npy"), b"x").unwrap();
    assert_eq!(open(folder.path()).len(), 17);
    // As one map of three axes.
    let manifest = r#"
        layout = "xrf55"
        [[view]]
        array = "array"
        psf = { range_m = 0.05, azimuth_rad = 0.1, elevation_rad = 0.0, doppler_mps = 0.1 }
        axes = [
          { kind = "doppler", bins = 17, lo = -1.0, hi = 1.0 },
          { kind = "range", bins = 256, lo = 0.0, hi = 16.6 },
          { kind = "cone", bins = 128, lo = -1.0, hi = 1.0, spacing = "sine" },
        ]"#;
    std::fs::write(folder.path().join("dataset.toml"), manifest).unwrap();
    let cube = open(folder.path());
    assert_eq!((cube.len(), cube.load(0).unwrap().maps[0].shape.clone()), (1, vec![17, 256, 128]));
    // And damaged.
    std::fs::remove_file(folder.path().join("dataset.toml")).unwrap();
    write_npy(&path, &ArrayView::f32(&[2, 256, 128], &cells[..2 * 256 * 128])).unwrap();
    assert!(told(folder.path()).contains("expected (17, 256, 128)"), "{}", told(folder.path()));
}

#[test]
fn half_floats_keep_three_digits() {
    let (folder, recording) = written(SimulatedLayout::Xrf55Stack, 17, 1, true);
    let frame = open(folder.path()).load(2).unwrap();
    assert_eq!(frame.maps[0].dtype, "<f2");
    assert!(difference(&frame.maps[0].data, &recording.frame(2).maps[0], 256.0) < 1e-3);
}

#[test]
fn mmvr_folders_have_labels_in_pixels_and_truth_beside_them() {
    for people in [0, 2] {
        let (folder, recording) = written(SimulatedLayout::MmvrTree, 1, people, false);
        std::fs::remove_file(folder.path().join("dataset.toml")).unwrap();
        let dataset = open(folder.path());
        assert_eq!((dataset.info().layout.word(), dataset.frame_name(0)), ("mmvr", "d1s1/000/00000"));
        let (frame, exact) = (dataset.load(0).unwrap(), recording.frame(0));
        assert_eq!(frame.notes, ["00000_mask.npz is missing: no masks"]);
        assert_eq!((frame.person_count, frame.global_id.as_deref()), (Some(people), Some("00000")));
        assert!(difference(&frame.maps[0].data, &exact.maps[0], 1.0) < 2e-4);
        let (truth, image) = (frame.truth.unwrap(), frame.image.unwrap());
        assert_eq!((truth.persons, image.keypoints.len()), (people, people));
        for (person, joints) in exact.joints.iter().enumerate() {
            let [row0, column0, row1, column1] = frame.map_boxes[0][person];
            let bins = dataset.info().views[0].bins_of(joints[11]);
            assert!((row0..row1).contains(&bins[0]) && (column0..column1).contains(&bins[1]), "{bins:?}");
            assert!(norm(sub(truth.joints[17 * person], joints[0])) < 1e-6);
        }
    }
}

#[test]
fn the_remaining_layouts_load_with_their_maps_and_nobody_in_them() {
    for layout in [SimulatedLayout::Generic, SimulatedLayout::Xrf55, SimulatedLayout::Hupr] {
        let (folder, recording) = written(layout, 1, 0, true);
        let dataset = open(folder.path());
        same_axes(&dataset.info().views, &recording.views());
        let frame = dataset.load(0).unwrap();
        assert_eq!((frame.person_count, frame.truth.unwrap().persons), (Some(0), 0), "{layout:?}");
        for (map, simulated) in frame.maps.iter().zip(&recording.frame(0).maps) {
            assert!(difference(&map.data, simulated, 1.0) < 2e-4, "{layout:?}");
        }
    }
}

#[test]
fn info_fit_and_complexity_work_on_every_layout() {
    for layout in SimulatedLayout::ALL {
        let frames = if layout == SimulatedLayout::Xrf55Stack { 17 } else { 2 };
        let (folder, _) = written(layout, frames, 1, true);
        if layout == SimulatedLayout::Hiber {
            // As if they had been found: its joints are in the room's frame.
            std::fs::copy(folder.path().join("rooms-stated.toml"), folder.path().join("rooms.toml")).unwrap();
        }
        let run = |arguments: &[&str]| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
            let home = folder.path().join("home");
            let done =
                command.args(arguments).env("MHP_INSPECTOR_HOME", home).current_dir(folder.path()).output().unwrap();
            let text = String::from_utf8_lossy(&done.stderr).into_owned();
            assert!(done.status.success(), "{layout:?} {arguments:?}: {text}");
            String::from_utf8(done.stdout).unwrap()
        };
        assert!(run(&["info", "."]).contains("truth       joints in metres"), "{layout:?}");
        run(&["complexity", ".", "--csv", "complexity.csv", "--into-data"]);
        run(&["fit", ".", "--frames", "0", "--iterations", "2", "--out", "results", "--into-data"]);
    }
}

#[test]
fn stacks_want_whole_clips() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options { layout: SimulatedLayout::Xrf55Stack, frames: 20, ..Options::default() };
    let recording = Recording::new(&options).unwrap();
    let text = write_data_set(folder.path(), &recording, Style::default(), || ()).unwrap_err().to_string();
    assert!(text.contains("17 maps a file"), "{text}");
}

#[test]
fn the_committed_samples_load_with_truth_and_stay_small() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    let mut count = 0;
    for entry in std::fs::read_dir(&home).unwrap() {
        let path = entry.unwrap().path();
        if path.join("dataset.toml").is_file() {
            let dataset = open(&path);
            let frame = dataset.load(0).unwrap();
            assert_eq!(frame.person_count, Some(frame.truth.unwrap().persons), "{}", path.display());
            assert!(
                std::fs::read_to_string(path.join("dataset.toml")).unwrap().contains("`mhp-inspector simulate DIR")
            );
            count += 1;
        }
    }
    assert_eq!(count, 10);
    assert!(bytes(&home) <= 16_500_000, "{}", bytes(&home));
}

fn bytes(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.map(|path| if path.is_dir() { bytes(&path) } else { path.metadata().unwrap().len() }).sum()
}
