//! HIBER: its tree in every published variant, its labels, the room's frame of its joints, and where the radars stand in it.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its input has failed")]

use mhp_inspector::cli::simulate::{Style, write_data_set};
use mhp_inspector::dataset::npz::{ArrayView, read_array, write_npy};
use mhp_inspector::dataset::{Dataset, ROOMS_NAME, RoomTransforms};
use mhp_inspector::geometry::{mat_mul, norm, sub, transpose};
use mhp_inspector::simulate::{Action, Options, Recording, ScenePreset, SimulatedLayout};
use mhp_inspector::study::{RoomError, environments, estimate_room};
use mhp_inspector::task::Progress;
use num_complex::Complex64;
use std::path::{Path, PathBuf};
use std::process::Command;

fn written(
    frames: usize,
    sequence_length: usize,
    actions: Vec<Action>,
    people: usize,
) -> (tempfile::TempDir, Recording) {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        layout: SimulatedLayout::Hiber,
        presets: vec![ScenePreset::Easy],
        frames,
        sequence_length,
        actions,
        people: Some(people..=people),
        seed: 7,
        ..Options::default()
    };
    let recording = Recording::new(&options).unwrap();
    write_data_set(folder.path(), &recording, Style::default(), || ()).unwrap();
    std::fs::remove_file(folder.path().join("dataset.toml")).unwrap();
    (folder, recording)
}

fn open(path: &Path) -> Dataset {
    Dataset::open(path, &Progress::new()).unwrap()
}

/// The folder's stated transforms, as if they had been found.
fn with_stated_rooms(folder: &Path) -> RoomTransforms {
    std::fs::copy(folder.join("rooms-stated.toml"), folder.join(ROOMS_NAME)).unwrap();
    RoomTransforms::of(folder, None)
}

#[test]
fn a_tree_opens_from_every_folder_and_file_inside_it() {
    let (folder, _) = written(4, 2, vec![Action::Walk], 1);
    let category = folder.path().join("WALK");
    for (inside, frames) in [
        ("", 4),
        ("HORIZONTAL_HEATMAPS", 4),
        ("VERTICAL_HEATMAPS/01_02", 2),
        ("ANNOTATIONS", 4),
        ("ANNOTATIONS/3DPOSE", 4),
        ("ANNOTATIONS/BOUNDINGBOX/HORIZONTAL", 4),
    ] {
        let dataset = open(&category.join(inside));
        assert_eq!((dataset.info().layout.word(), dataset.len()), ("hiber", frames), "{inside}");
        assert!(dataset.frame_name(0).starts_with("WALK/01_0"), "{}", dataset.frame_name(0));
    }
    let whole = open(folder.path());
    assert_eq!((whole.len(), whole.sequences(), whole.sequence(3)), (4, 2, "WALK/01_02"));
    let one = open(&category.join("VERTICAL_HEATMAPS/01_02/0001.npy"));
    assert_eq!((one.named_frame(), one.frame_name(1)), (Some(1), "WALK/01_02/0001"));
    let info = whole.info();
    assert!(info.static_removed && info.skeleton.preset_name() == Some("hiber14"));
    assert!(info.assumptions.iter().any(|text| text.contains("two radar frames") && text.contains("mean power")));
    assert!(info.assumptions.iter().any(|text| text.contains("cannot be measured")), "{:?}", info.assumptions);
    assert!(info.notes.iter().any(|note| note.contains("calibrate-room")), "{:?}", info.notes);
}

#[test]
fn every_variant_of_a_file_is_told_by_shape_dtype_and_signs() {
    let (folder, recording) = written(1, 1, vec![Action::Walk], 1);
    let path = |view: usize| {
        let part = ["HORIZONTAL_HEATMAPS", "VERTICAL_HEATMAPS"][view];
        folder.path().join("WALK").join(part).join("01_01/0000.npy")
    };
    let exact = recording.frame(0).maps;
    let planes: Vec<Vec<f64>> = (0..2).map(|view| read_array(&path(view), "array").unwrap().data).collect();
    let cells = 160 * 200;
    let check = |kind: &str, wanted: &str, scale: f64| {
        let dataset = open(folder.path());
        let text = dataset.info().assumptions[0].clone();
        assert!(text.contains(wanted), "{kind}: {text}");
        for (map, exact) in dataset.load(0).unwrap().maps.iter().zip(&exact) {
            assert_eq!(map.shape, [160, 200]);
            let top = exact.iter().copied().fold(0.0_f32, f32::max);
            let worst = map.data.iter().zip(exact).map(|(a, b)| (a * scale - f64::from(*b)).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-6 * f64::from(top), "{kind}: {worst}");
        }
    };
    check("two frames first", "two radar frames a file (2, 160, 200)", 1.0);
    let write = |write_one: &dyn Fn(&Path, &[f64])| (0..2).for_each(|view| write_one(&path(view), &planes[view]));
    write(&|path, both| {
        let last: Vec<f64> = (0..cells).flat_map(|cell| [both[cell], both[cells + cell]]).collect();
        write_npy(path, &ArrayView::f64(&[160, 200, 2], &last)).unwrap();
    });
    check("two frames last", "two radar frames a file (160, 200, 2)", 1.0);
    // Real and imaginary part: the amplitude is √2 of the root of the mean.
    write(&|path, both| {
        let parts: Vec<f64> = (0..cells).flat_map(|cell| [both[cell], -both[cells + cell]]).collect();
        write_npy(path, &ArrayView::f64(&[160, 200, 2], &parts)).unwrap();
    });
    check("parts", "real and imaginary part of one radar frame", 0.5_f64.sqrt());
    write(&|path, both| {
        let turned: Vec<Complex64> = both.iter().map(|&h| Complex64::from_polar(h, 0.7)).collect();
        write_npy(path, &ArrayView::complex128(&[2, 160, 200], &turned)).unwrap();
    });
    check("complex", "two complex radar frames", 1.0);
    write(&|path, both| {
        let parts: Vec<Complex64> = (0..cells).map(|cell| Complex64::new(both[cell], both[cells + cell])).collect();
        write_npy(path, &ArrayView::complex128(&[160, 200], &parts)).unwrap();
    });
    check("one complex", "one complex radar frame", 0.5_f64.sqrt());
    write_npy(&path(1), &ArrayView::f64(&[160, 100], &planes[0][..16000])).unwrap();
    let told = open(folder.path()).load(0).unwrap_err().to_string();
    assert!(
        told.contains("0000.npy") && told.contains("expected (2, 160, 200), (160, 200, 2) or (160, 200)"),
        "{told}"
    );
    std::fs::remove_file(path(1)).unwrap();
    let told = open(folder.path()).load(0).unwrap_err().to_string();
    assert!(told.contains("a frame of HIBER has two maps"), "{told}");
}

#[test]
fn rounded_maps_have_no_zeros_in_their_background() {
    let (folder, recording) = written(1, 1, vec![Action::Walk], 1);
    for (view, part) in ["HORIZONTAL_HEATMAPS", "VERTICAL_HEATMAPS"].iter().enumerate() {
        let map = &recording.frame(0).maps[view];
        let top = map.iter().copied().fold(0.0, f32::max);
        let rounded: Vec<f32> = map.iter().map(|h| (255.0 * h / top).round()).collect();
        let path = folder.path().join("WALK").join(part).join("01_01/0000.npy");
        write_npy(&path, &ArrayView::f32(&[160, 200], &rounded)).unwrap();
    }
    let frame = open(folder.path()).load(0).unwrap();
    assert!(frame.maps.iter().all(|map| map.data.iter().copied().fold(f64::INFINITY, f64::min) == 0.5));
    assert!(frame.notes.iter().any(|note| note.contains("half of the smallest")), "{:?}", frame.notes);
    // The body lands where the person is, with either preset.
    with_stated_rooms(folder.path());
    let truth = open(folder.path()).load(0).unwrap().truth.unwrap().joints;
    let middle = |joints: &[[f64; 3]]| mhp_inspector::geometry::mean(joints);
    for preset in ["recommended", "baseline"] {
        let out = tempfile::tempdir().unwrap();
        run(folder.path(), &["fit", ".", "--preset", preset, "--people", "1", "--out", &out.path().to_string_lossy()]);
        let file = out.path().join("pppr/WALK_01_01_0000.npz");
        let fitted = mhp_inspector::dataset::read_pppr(&file, None).unwrap();
        let off = sub(middle(fitted.positions()), middle(&truth));
        assert!(off.iter().all(|x| x.abs() < 0.15), "{preset}: {off:?}");
    }
}

fn run(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    let home = folder.join("home");
    let done = command.args(arguments).env("MHP_INSPECTOR_HOME", home).current_dir(folder).output().unwrap();
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

#[test]
fn labels_are_read_and_missing_persons_and_files_are_told() {
    let (folder, recording) = written(2, 2, vec![Action::Walk], 2);
    let rooms = with_stated_rooms(folder.path());
    let annotations = folder.path().join("WALK/ANNOTATIONS");
    let silhouettes = annotations.join("SILHOUETTE/01_01/0000.npy");
    std::fs::create_dir_all(silhouettes.parent().unwrap()).unwrap();
    let mask: Vec<bool> = (0..2 * 6 * 8).map(|k| k % 3 == 0).collect();
    write_npy(&silhouettes, &ArrayView::flags(&[2, 6, 8], &mask)).unwrap();
    let dataset = open(folder.path());
    let (frame, exact) = (dataset.load(0).unwrap(), recording.frame(0));
    let truth = frame.truth.unwrap();
    assert_eq!((truth.persons, frame.person_count, frame.timestamp_s), (2, Some(2), Some(0.0)));
    for person in 0..2 {
        // Nose, right wrist and left ankle are COCO's 0, 10 and 15.
        for (own, coco) in [(0, 0), (4, 10), (13, 15)] {
            assert!(norm(sub(truth.joints[14 * person + own], exact.joints[person][coco])) < 1e-9);
        }
    }
    let room = rooms.of_environment("01").unwrap().radar_from_room;
    let in_room = dataset.room_joints().unwrap().joints(0).unwrap();
    assert!(norm(sub(room.view_from_world(in_room[1][0]), exact.joints[1][0])) < 1e-9);
    let image = frame.image.unwrap();
    assert_eq!((image.size, image.masks.len(), image.keypoints.len()), ([8, 6], 2, 2));
    assert_eq!(image.masks[1], mask[48..]);
    let [row0, column0, row1, column1] = frame.map_boxes[1][0];
    let bins = dataset.info().views[1].bins_of(exact.joints[0][11]);
    assert!((row0..row1).contains(&bins[0]) && (column0..column1).contains(&bins[1]), "{bins:?}");
    assert!(dataset.load(1).unwrap().notes.iter().any(|note| note.contains("no silhouettes")));
    // A person without joints, and a damaged file.
    let file = annotations.join("3DPOSE/01_01.npy");
    let mut joints = read_array(&file, "array").unwrap().data;
    joints[..42].fill(0.0);
    write_npy(&file, &ArrayView::f64(&[2, 2, 14, 3], &joints)).unwrap();
    let frame = dataset.load(0).unwrap();
    assert_eq!(frame.truth.unwrap().persons, 1);
    assert!(frame.notes.iter().any(|note| note.contains("1 of 2 persons have no joints")), "{:?}", frame.notes);
    write_npy(&file, &ArrayView::f64(&[1, 2, 14, 3], &joints[..84])).unwrap();
    let frame = dataset.load(1).unwrap();
    assert!(frame.truth.is_none() && frame.notes.iter().any(|note| note.contains("more than 1 frames")));
}

#[test]
fn the_place_of_the_radar_is_found_to_3_cm_and_1_degree_from_200_frames() {
    let (folder, _) = written(200, 20, Vec::new(), 1);
    let dataset = open(folder.path());
    let all = environments(&dataset).unwrap();
    assert_eq!((all.len(), all[0].0.as_str(), all[0].1.len()), (1, "01", 200));
    let found = estimate_room(&dataset, "01", 200, &Progress::new()).unwrap();
    let rooms = with_stated_rooms(folder.path());
    let (pose, known) = (found.transform.radar_from_room, rooms.of_environment("01").unwrap().radar_from_room);
    let turn = mat_mul(&pose.rotation, &transpose(&known.rotation));
    let angle = (0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0)).clamp(-1.0, 1.0).acos().to_degrees();
    let place = norm(sub(pose.world_from_view([0.0; 3]), known.world_from_view([0.0; 3])));
    let shift = norm(sub(pose.translation, known.translation));
    println!("{angle:.2}°, the radar {:.1} cm off, translation {:.1} cm off", 100.0 * place, 100.0 * shift);
    assert!(angle < 1.0 && place < 0.03 && shift < 0.03, "{angle}° {place} m {shift} m");
    assert!(found.transform.residual_m.unwrap() < 0.25 && found.warnings.is_empty(), "{found:?}");
    let unknown = estimate_room(&dataset, "07", 200, &Progress::new());
    assert!(matches!(unknown, Err(RoomError::NoEnvironment { .. })));
    // Of joints that have nothing to do with the maps nothing is found.
    let file = folder.path().join("WALK/ANNOTATIONS/3DPOSE");
    let entries: Vec<PathBuf> = std::fs::read_dir(file).unwrap().map(|entry| entry.unwrap().path()).collect();
    for path in entries {
        let array = read_array(&path, "array").unwrap();
        let still = vec![0.5; array.data.len()];
        write_npy(&path, &ArrayView::f64(&array.shape, &still)).unwrap();
    }
    let lost = estimate_room(&dataset, "01", 60, &Progress::new());
    assert!(matches!(lost, Err(RoomError::NoAgreement { .. })), "{lost:?}");
}

#[test]
fn what_is_found_is_remembered_told_and_used_and_never_in_the_data_set() {
    let (folder, _) = written(60, 20, vec![Action::Walk], 1);
    let told = run(folder.path(), &["calibrate-room", ".", "--frames", "60", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!((found[0]["environment"].as_str(), found[0]["frames_looked_at"].as_u64()), (Some("01"), Some(60)));
    assert!(folder.path().join("home").join(ROOMS_NAME).is_file() && !folder.path().join(ROOMS_NAME).exists());
    let info = run(folder.path(), &["info", "WALK/HORIZONTAL_HEATMAPS"]);
    assert!(
        info.contains("environment 01 (60 frames): the radar is at") && info.contains("truth       joints in metres")
    );
    let fit =
        run(folder.path(), &["fit", ".", "--frames", "2..4", "--preset", "baseline", "--out", "out", "--into-data"]);
    assert!(fit.contains("majpe_mm"), "{fit}");
    let evidence = run(folder.path(), &["evidence", ".", "--frames", "6..7", "--preset", "baseline", "--json"]);
    assert!(evidence.contains("It cannot be measured here"), "{evidence}");
    run(folder.path(), &["calibrate-room", ".", "--frames", "60", "--into-data"]);
    assert!(folder.path().join(ROOMS_NAME).is_file());
    // PPPR-Heatmap in the files' own form: both radar frames, every number of the map's cell in proportion.
    run(
        folder.path(),
        &["export", ".", "--what", "heatmap", "--frames", "0..1", "--iterations", "2", "--out", "maps", "--into-data"],
    );
    let file = "WALK/HORIZONTAL_HEATMAPS/01_01/0000.npy";
    let made = read_array(&folder.path().join("maps/heatmap").join(file), "array").unwrap();
    assert_eq!((made.shape, made.dtype.as_str()), (vec![2, 160, 200], "<f8"));
    assert!(made.data.iter().all(|x| x.is_finite()) && made.data.iter().any(|x| *x > 0.0));
}
