//! The synthetic source: what its recordings hold, and the files that it writes.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its input has failed")]

use mhp_inspector::cli::simulate::{Style, write_data_set};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::geometry::{norm, sub};
use mhp_inspector::output::{FolderLock, Inputs};
use mhp_inspector::simulate::{Action, Options, Recording, ScenePreset, SimulatedLayout};
use mhp_inspector::task::Progress;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn recording(options: &Options) -> Recording {
    Recording::new(options).unwrap()
}

/// Every file below a folder with its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path).into_iter().map(|(name, bytes)| (path.join(name), bytes)));
        } else {
            found.insert(path.clone(), std::fs::read(&path).unwrap());
        }
    }
    found.into_iter().map(|(path, bytes)| (path.strip_prefix(folder).unwrap().to_owned(), bytes)).collect()
}

#[test]
fn one_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let write = |seed: u64, threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let options = Options { frames: 3, sequence_length: 2, seed, ..Options::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| write_data_set(folder.path(), &recording(&options), Style::default(), || ()).unwrap());
        files(folder.path())
    };
    let [one, again, other] = [write(3, 1), write(3, 3), write(4, 2)];
    assert_eq!(one.len(), 4);
    assert!(one == again);
    let frame = Path::new("frames/s000/000000.npz");
    // Not even the time of writing: the date in the archive's first header is DOS time 0, 1980-01-01.
    assert_eq!(one[frame][10..14], [0, 0, 33, 0]);
    assert!(one[frame] != other[frame]);
}

#[test]
fn every_preset_loads_with_the_people_that_it_claims() {
    for preset in ScenePreset::ALL {
        let folder = tempfile::tempdir().unwrap();
        let options = Options { presets: vec![preset], frames: 2, sequence_length: 1, ..Options::default() };
        let made = recording(&options);
        write_data_set(folder.path(), &made, Style::default(), || ()).unwrap();
        let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
        assert_eq!((dataset.len(), dataset.sequences()), (2, 2), "{preset:?}");
        for index in 0..2 {
            let (frame, exact) = (dataset.load(index).unwrap(), made.frame(index));
            let truth = frame.truth.unwrap();
            assert_eq!(frame.notes, Vec::<String>::new());
            assert_eq!(frame.person_count, Some(exact.joints.len()));
            assert!(preset.recipe().people.contains(&truth.persons), "{preset:?}");
            assert_eq!(truth.joints.len(), 17 * truth.persons);
            let wanted = exact.joints.iter().flatten();
            assert!(truth.joints.iter().zip(wanted).all(|(a, b)| norm(sub(*a, *b)) < 1e-6));
            assert!(exact.scenario.starts_with(preset.word()), "{}", exact.scenario);
            assert!(frame.maps.iter().flat_map(|map| &map.data).all(|x| x.is_finite() && *x > 0.0));
        }
    }
}

#[test]
fn nobody_to_four_people_are_drawn_and_stored() {
    let options = |people| Options {
        presets: vec![ScenePreset::Medium],
        frames: 2,
        sequence_length: 1,
        people: Some(people),
        ..Options::default()
    };
    for people in [0, 4] {
        let folder = tempfile::tempdir().unwrap();
        write_data_set(folder.path(), &recording(&options(people..=people)), Style::default(), || ()).unwrap();
        let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
        let frame = dataset.load(1).unwrap();
        assert_eq!(frame.notes, Vec::<String>::new());
        assert_eq!((frame.person_count, frame.truth.unwrap().persons), (Some(people), people));
    }
    let made = recording(&options(0..=4));
    let drawn: BTreeSet<usize> = (0..40).map(|k| made.sequence(k).performers().len()).collect();
    assert_eq!(drawn.into_iter().collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
}

#[test]
fn neighbours_keep_the_distance_that_the_preset_says() {
    for (preset, people) in [(ScenePreset::Easy, 2), (ScenePreset::Medium, 3)] {
        let options = Options {
            presets: vec![preset],
            frames: 30,
            sequence_length: 5,
            people: Some(people..=people),
            seed: 11,
            ..Options::default()
        };
        let made = recording(&options);
        for number in 0..made.sequences() {
            let sequence = made.sequence(number);
            let hips: Vec<_> = sequence.performers().map(|p| p.pose(0.2).joints[11]).collect();
            for (k, hip) in hips.iter().enumerate() {
                let nearest = hips.iter().enumerate().filter(|(other, _)| *other != k);
                let nearest = nearest.map(|(_, p)| (p[0] - hip[0]).hypot(p[1] - hip[1])).fold(9.0, f64::min);
                assert!((0.5..2.5).contains(&nearest), "{preset:?} {number}: {nearest} m");
            }
        }
    }
}

#[test]
fn a_sequence_moves_on_as_its_velocities_say() {
    for action in Action::ALL {
        let options = Options { frames: 4, actions: vec![action], seed: 9, ..Options::default() };
        let sequence = recording(&options).sequence(0);
        let performer = *sequence.performers().next().unwrap();
        let dt = 0.1;
        let (a, b) = (performer.pose(0.1), performer.pose(0.1 + dt));
        let velocity = performer.velocities(0.1 + 0.5 * dt);
        for joint in 0..17 {
            for k in 0..3 {
                let mean = (b.joints[joint][k] - a.joints[joint][k]) / dt;
                assert!((mean - velocity[joint][k]).abs() < 0.35, "{action:?} {joint}: {mean} {:?}", velocity[joint]);
            }
        }
        assert!(sequence.scenario().contains(action.word()));
    }
}

#[test]
fn nothing_clips_and_maps_show_the_person_where_the_truth_says() {
    let options = Options {
        presets: vec![ScenePreset::Easy, ScenePreset::Medium],
        actions: vec![Action::Walk],
        frames: 6,
        sequence_length: 1,
        seed: 21,
        ..Options::default()
    };
    let made = recording(&options);
    let views = made.views();
    for number in 0..made.sequences() {
        let sequence = made.sequence(number);
        let raw = sequence.raw(0);
        assert!(raw.clipped < 1e-5, "{number}: {}", raw.clipped);
        let frame = sequence.processed(0, &raw);
        let torso: [f64; 3] =
            std::array::from_fn(|k| [5, 6, 11, 12].iter().map(|&j| frame.joints[0][j][k] / 4.0).sum());
        for (map, view) in frame.maps.iter().zip(&views) {
            let centre = view.bins_of(torso);
            let near = |&i: &usize| {
                let (row, column) = ((i / 128) as f64, (i % 128) as f64);
                (row - centre[0]).abs() < 32.0 && (column - centre[1]).abs() < 26.0
            };
            let top = (0..map.len()).filter(near).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
            let miss = ((top / 128) as f64 - centre[0]).hypot((top % 128) as f64 - centre[1]);
            // Cells of 3 and 4 cm; feet and head are up to a metre from the torso.
            assert!(miss < 24.0, "{number} {}: {miss} cells", view.array);
        }
    }
}

#[test]
fn shadows_lie_behind_people_and_nowhere_else() {
    let made = |shadows: bool| {
        let (presets, actions) = (vec![ScenePreset::Medium], vec![Action::Stand]);
        let (still_share, multipath) = (Some(1.0), Some(false));
        recording(&Options {
            presets,
            actions,
            still_share,
            multipath,
            shadows,
            frames: 6,
            seed: 5,
            ..Options::default()
        })
    };
    let [plain, shadowed] = [false, true].map(made);
    let view = &plain.views()[0];
    let (mut behind, mut beside) = ([0.0; 2], [0.0; 2]);
    for number in 0..6 {
        let [lit, dim] = [&plain, &shadowed].map(|made| made.sequence(0).frame(number));
        assert_eq!(lit.joints, dim.joints);
        let hips = lit.joints[0][11];
        for k in 0..lit.maps[0].len() {
            let [depth, lateral] = [view.axes[0].at((k / 128) as f64), view.axes[1].at((k % 128) as f64)];
            let (range, off_rad) = (depth.hypot(lateral), (lateral.atan2(depth) - hips[1].atan2(hips[0])).abs());
            let sum = match () {
                () if range > norm(hips) + 1.0 && off_rad < 0.03 => &mut behind,
                () if range > norm(hips) + 1.0 && off_rad > 0.4 => &mut beside,
                () => continue,
            };
            for (sum, made) in sum.iter_mut().zip([&lit, &dim]) {
                *sum += f64::from(made.maps[0][k]).powi(2);
            }
        }
    }
    assert!(behind[1] < 0.5 * behind[0], "{behind:?}");
    assert!((beside[1] / beside[0] - 1.0).abs() < 0.05, "{beside:?}");
}

#[test]
fn leftover_frames_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path().join("frames/s007");
    std::fs::create_dir_all(&home).unwrap();
    std::fs::write(home.join("000005.npz"), b"old").unwrap();
    let told = write_data_set(folder.path(), &recording(&Options::default()), Style::default(), || ())
        .unwrap_err()
        .to_string();
    assert!(told.contains("000005.npz") && told.contains("remove it first"), "{told}");
}

#[test]
fn numbers_without_sense_are_refused() {
    for (options, word) in [
        (Options { frames: 0, ..Options::default() }, "frames is 0"),
        (Options { bits: 8, ..Options::default() }, "bits is 8"),
        (Options { people: Some(2..=9), ..Options::default() }, "people is 2..=9"),
        (Options { sequence_length: 0, ..Options::default() }, "sequence length"),
        (Options { still_share: Some(f64::NAN), ..Options::default() }, "still share"),
        (Options { presets: Vec::new(), layout: SimulatedLayout::Hupr, ..Options::default() }, "presets"),
    ] {
        let told = Recording::new(&options).unwrap_err().to_string();
        assert!(told.contains(word), "{told}");
    }
}

#[test]
fn another_data_set_and_a_folder_in_use_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = folder.path().join("dataset.toml");
    std::fs::write(&manifest, "name = \"measured\"\nlayout = \"mmvr\"\n").unwrap();
    let write = || {
        write_data_set(folder.path(), &recording(&Options { frames: 1, ..Options::default() }), Style::default(), || ())
    };
    let told = write().unwrap_err().to_string();
    assert!(told.contains("lies in the data set") && told.contains("--into-data"), "{told}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    std::fs::remove_file(&manifest).unwrap();
    let lock = FolderLock::claim(folder.path(), &[], &Inputs::default()).unwrap();
    assert!(write().unwrap_err().to_string().contains("another process"));
    drop(lock);
    write().unwrap();
    write().unwrap();
    assert!(manifest.is_file() && !folder.path().join(".lock").exists());
}
