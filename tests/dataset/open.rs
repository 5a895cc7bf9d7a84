//! Opening and loading: MMVR trees, single frames, generic data sets, bare files.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::body::Skeleton;
use mhp_inspector::dataset::npz::{ArrayView, write, write_npy};
use mhp_inspector::dataset::{
    BareCatalog, BareChoice, Dataset, DatasetError, Layout, Manifest, OpenOptions, Remembered, read_pppr,
};
use mhp_inspector::radar::{AxisKind, PointSpread, RadarConfig};
use mhp_inspector::task::Progress;
use std::path::{Path, PathBuf};

/// The documents and data beside the repository; `None`, with a printed reason, where they are not.
fn shared() -> Option<PathBuf> {
    let named = std::env::var_os("MHP_SHARED").map(PathBuf::from);
    let path = named.unwrap_or_else(|| Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")).to_owned());
    let there = path.join("data").is_dir();
    if !there {
        println!("skipped: {} is not there", path.display());
    }
    there.then_some(path)
}

fn open(path: &Path) -> Result<Dataset, DatasetError> {
    Dataset::open(path, &Progress::new())
}

fn names(dataset: &Dataset) -> Vec<String> {
    (0..dataset.len()).map(|i| dataset.frame_name(i).to_owned()).collect()
}

/// A frame of MMVR as its authors write it, without companions.
fn write_radar(folder: &Path, stem: &str, value: f32) {
    std::fs::create_dir_all(folder).unwrap();
    let map = vec![value; 256 * 128];
    let maps = [("hm_hori", ArrayView::f32(&[256, 128], &map)), ("hm_vert", ArrayView::f32(&[256, 128], &map))];
    write(&folder.join(format!("{stem}_radar.npz")), &maps).unwrap();
}

#[test]
fn the_real_mmvr_frame_is_read_as_measured() {
    let Some(shared) = shared() else { return };
    let dataset = open(&shared.join("data/mmvr/00383_radar.npz")).unwrap();
    let info = dataset.info();
    assert_eq!((info.layout.word(), dataset.len(), dataset.start_index()), ("mmvr", 1, 0));
    assert_eq!((dataset.frame_name(0), dataset.sequence(0)), ("mmvr/00383", "mmvr"));
    assert_eq!(
        info.axes_badge,
        "Cartesian · rows: depth 8→0 m, row 0 far · columns: y 1→−4 m from left to right (hm_hori), z −2…3 m up (hm_vert)"
    );
    let frame = dataset.load(0).unwrap();
    assert_eq!(frame.notes, Vec::<String>::new());
    assert_eq!(frame.global_id.as_deref(), Some("00476"));
    assert_eq!(frame.person_count, Some(1));
    assert!(frame.truth.is_none(), "key points in pixels are not truth");
    let nan = |map: usize| frame.maps[map].data.iter().filter(|x| x.is_nan()).count();
    assert_eq!((nan(0), nan(1)), (0, 63));
    assert_eq!(frame.maps[0].dtype, "<f4");
    let peak = frame.maps[0].data.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
    assert_eq!((peak / 128, peak % 128), (188, 42));
    assert_eq!(frame.map_boxes[0], [[167.0, 32.0, 190.5, 48.0]], "row, column, row, column");
    let image = frame.image.as_ref().unwrap();
    assert_eq!((image.size, image.keypoints.len(), image.boxes.len(), image.masks.len()), ([640, 480], 1, 1, 1));
    assert_eq!(image.keypoints[0].len(), 17);
    let inside = image.masks[0].iter().filter(|&&m| m).count();
    assert!(inside > 1000 && inside < 640 * 480 / 4, "{inside}");

    // The first load of a process also warms the disk: the second is timed, with room for a busy machine.
    let begun = std::time::Instant::now();
    for _ in 0..20 {
        dataset.load(0).unwrap();
    }
    let each = begun.elapsed() / 20;
    println!("one MMVR frame with its companions: {each:?}");
    assert!(each.as_millis() < 50, "{each:?}");
}

#[test]
fn the_preset_of_mmvr_is_the_geometry_of_the_reference_case() {
    let preset = <dyn Layout>::named("mmvr").unwrap().preset().unwrap();
    let [hori, vert] = &preset.views[..] else { unreachable!("two views") };
    assert_eq!([hori.axes[0].kind, hori.axes[1].kind], [AxisKind::DepthH, AxisKind::Y]);
    assert_eq!([vert.axes[0].kind, vert.axes[1].kind], [AxisKind::DepthV, AxisKind::Z]);
    assert_eq!([hori.axes[0].at(-0.5), hori.axes[0].at(255.5)], [8.0, 0.0]);
    assert_eq!([hori.axes[1].at(-0.5), hori.axes[1].at(127.5)], [1.0, -4.0]);
    assert_eq!([vert.axes[1].at(-0.5), vert.axes[1].at(127.5)], [-2.0, 3.0]);
    let Some(shared) = shared() else { return };
    let reference = Manifest::from_file(&shared.join("reference/mmvr-size/dataset.toml")).unwrap();
    assert_eq!(preset.views, reference.views);
    assert_eq!(preset.skeleton, reference.skeleton);
}

#[test]
fn every_reference_case_opens_loads_and_has_readable_parameters() {
    let Some(shared) = shared() else { return };
    let mut cases = 0;
    for case in std::fs::read_dir(shared.join("reference")).unwrap().map(|entry| entry.unwrap().path()) {
        if !case.join("dataset.toml").is_file() {
            continue;
        }
        cases += 1;
        let dataset = open(&case).unwrap();
        assert_eq!(open(&case.join("dataset.toml")).unwrap().len(), dataset.len());
        let frame = dataset.load(0).unwrap();
        for (view, map) in dataset.info().views.iter().zip(&frame.maps) {
            assert_eq!(map.shape, view.shape());
        }
        let pppr = read_pppr(&case.join("params.npz"), None).unwrap();
        assert_eq!(pppr.shape().joints, dataset.info().skeleton.joints.len());
        assert_eq!(pppr.shape().doppler_features, dataset.info().radar.doppler_features);
        if let Some(truth) = &frame.truth {
            assert_eq!(truth.joints.len(), truth.persons * pppr.shape().joints);
        }
        let fit = mhp_inspector::config::FitConfig::from_file(&case.join("fit.toml"));
        assert!(fit.is_ok(), "{fit:?}");
    }
    assert_eq!(cases, 8);
}

#[test]
fn an_mmvr_tree_opens_at_any_depth_in_natural_order() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("MMVR");
    for (segment, stem) in
        [("P1/d10s1/000", "00001"), ("P1/d9s1/001", "00010"), ("P1/d9s1/001", "00002"), ("P2/d11s1/000", "00000")]
    {
        write_radar(&root.join(segment), stem, 1.0);
    }
    std::fs::write(root.join("P1/d9s1/001/00003_bbox.npz"), b"").unwrap();
    std::fs::write(root.join("README.md"), b"text").unwrap();
    let dataset = open(&root).unwrap();
    assert_eq!(names(&dataset), ["d9s1/001/00002", "d9s1/001/00010", "d10s1/000/00001", "d11s1/000/00000"]);
    assert_eq!((dataset.sequences(), dataset.sequence(1), dataset.sequence(2)), (3, "d9s1/001", "d10s1/000"));
    assert_eq!(dataset.frame_path(2), root.join("P1/d10s1/000/00001_radar.npz"));
    assert_eq!((dataset.frame_name(4), dataset.sequence(4)), ("", "MMVR"));
    assert!(matches!(dataset.load(4), Err(DatasetError::NoSuchFrame { index: 4, count: 4, .. })));

    assert_eq!(open(&root.join("P1")).unwrap().len(), 3);
    assert_eq!(names(&open(&root.join("P1/d9s1")).unwrap()), ["d9s1/001/00002", "d9s1/001/00010"]);
    let single = open(&root.join("P1/d9s1/001/00010_radar.npz")).unwrap();
    assert_eq!((single.len(), single.start_index()), (2, 1));

    let frame = dataset.load(1).unwrap();
    assert_eq!(
        (frame.index, frame.timestamp_s, frame.person_count, frame.image.clone()),
        (1, Some(10.0 / 15.0), None, None)
    );
    let missing: Vec<&str> = frame.notes.iter().filter_map(|note| note.split(' ').next()).collect();
    assert_eq!(missing, ["00010_meta.npz", "00010_bbox.npz", "00010_pose.npz", "00010_mask.npz"]);
}

#[test]
fn mmvr_companions_may_be_damaged_disagree_or_number_frames_by_integers() {
    let folder = tempfile::tempdir().unwrap();
    let at = |kind: &str| folder.path().join(format!("00000_{kind}.npz"));
    write_radar(folder.path(), "00000", 2.0);
    write(&at("meta"), &[("global_frame_id", ArrayView::i64(&[2], &[476, 477]))]).unwrap();
    let (boxes, image) = ([1.0, 2.0, 3.0, 4.0], [5.0; 10]);
    let arrays = [
        ("bbox_i", ArrayView::f64(&[2, 5], &image)),
        ("bbox_hori", ArrayView::f64(&[1, 4], &boxes)),
        ("bbox_vert", ArrayView::f64(&[2, 2], &boxes)),
    ];
    write(&at("bbox"), &arrays).unwrap();
    write(&at("pose"), &[("kp", ArrayView::f64(&[0, 17, 3], &[]))]).unwrap();
    std::fs::write(at("mask"), b"PK\x03\x04").unwrap();
    let frame = open(folder.path()).unwrap().load(0).unwrap();
    assert_eq!(frame.global_id.as_deref(), Some("476, 477"));
    assert_eq!(frame.map_boxes, [vec![[2.0, 1.0, 4.0, 3.0]], vec![]]);
    assert_eq!(frame.person_count, Some(2));
    let notes = frame.notes.join("\n");
    assert!(notes.contains("array `bbox_vert` has shape (2, 2); expected (persons, 4)"), "{notes}");
    assert!(notes.contains("no masks: ") && notes.contains("truncated or damaged npz archive"), "{notes}");
    assert!(notes.contains("disagree about the number of persons: 2 boxes, 0 key points"), "{notes}");
}

#[test]
fn a_manifest_overrides_the_preset_of_mmvr() {
    let folder = tempfile::tempdir().unwrap();
    let map = [1.0_f32; 12];
    write(&folder.path().join("00007_radar.npz"), &[("hm_hori", ArrayView::f32(&[4, 3], &map))]).unwrap();
    let text = r#"
        layout = "mmvr"
        name = "ours"
        [radar]
        start_hz = 60e9
        bandwidth_hz = 1e9
        chirp_s = 60e-6
        frame_s = 0.01
        r_max_m = 9
        l_az_m = 0.0025
        l_el_m = 0.0025
        [[view]]
        array = "hm_hori"
        psf = { range_m = 0.1, azimuth_rad = 0.1, elevation_rad = 0, doppler_mps = 0 }
        axes = [{ kind = "depth_h", bins = 4, lo = 4, hi = 0 }, { kind = "y", bins = 3, lo = 1, hi = -2 }]
    "#;
    let manifest = Manifest::parse(text, Path::new("ours.toml")).unwrap();
    let dataset = Dataset::open_with(
        folder.path(),
        OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() },
        &Progress::new(),
    )
    .unwrap();
    let info = dataset.info();
    assert_eq!((info.name.as_str(), info.layout.word(), info.radar.start_hz), ("ours", "mmvr", 60e9));
    assert_eq!(info.radar.doppler_features, 32);
    assert!(!info.assumptions.iter().any(|text| text.starts_with("radar")), "{:?}", info.assumptions);
    assert_eq!(info.skeleton, Skeleton::preset("coco17").unwrap());
    assert_eq!(dataset.load(0).unwrap().maps[0].shape, [4, 3]);
    let single = folder.path().join("00007_radar.npz");
    assert_eq!(
        Dataset::open_with(
            &single,
            OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() },
            &Progress::new()
        )
        .unwrap()
        .info(),
        info
    );
    std::fs::write(folder.path().join("dataset.toml"), text).unwrap();
    assert_eq!(open(folder.path()).unwrap().info(), info, "beside the frames it needs no flag");
}

const GENERIC: &str = r#"
layout = "npz"
frames = "run_*/f?.npz"
skeleton = { joints = ["head", "l_foot"], bones = [[0, 1]], bone_lengths_m = [1.5], angles = [] }
[[view]]
array = "rd"
quantity = "power"
psf = { range_m = 0.1, azimuth_rad = 0.1, elevation_rad = 0, doppler_mps = 0.2 }
rotation = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
translation = [0.5, 0, -1]
axes = [{ kind = "range", bins = 2, lo = 0, hi = 4 }, { kind = "doppler", bins = 3, lo = -1, hi = 2 }]
region = [[0, 1], [1, 3]]
"#;

#[test]
fn a_generic_data_set_keeps_truth_pose_region_and_order() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("dataset.toml"), GENERIC).unwrap();
    let map = [1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0];
    let joints: Vec<f64> = (0..12).map(f64::from).collect();
    for (k, name) in ["run_b/f1", "run_a/f2", "run_a/f1", "run_a/other"].iter().enumerate() {
        let path = folder.path().join(format!("{name}.npz"));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        let number = [k as f64];
        let arrays = [
            ("rd", ArrayView::f64(&[2, 3], &map)),
            ("joints", ArrayView::f64(&[2, 2, 3], &joints)),
            ("velocities", ArrayView::f64(&[2, 2, 3], &joints)),
            ("person_count", ArrayView::i64(&[], &[2])),
            ("timestamp_s", ArrayView::f64(&[1], &number)),
        ];
        write(&path, &arrays).unwrap();
    }
    let dataset = open(folder.path()).unwrap();
    assert_eq!(names(&dataset), ["run_a/f1", "run_a/f2", "run_b/f1"]);
    assert_eq!((dataset.sequences(), dataset.sequence(1), dataset.sequence(2)), (2, "run_a", "run_b"));
    let info = dataset.info();
    assert_eq!(info.radar, RadarConfig::default());
    assert!(info.assumptions[0].starts_with("radar: "), "an absent radar table is told");
    assert_eq!(info.views[0].region, Some(vec![[0, 1], [1, 3]]));
    assert_eq!(info.views[0].pose.view_from_world([1.0, 2.0, 3.0]), [2.5, -1.0, 2.0]);
    let expected =
        PointSpread { range_m: 0.1, azimuth_rad: 0.1, elevation_rad: 0.0, doppler_mps: 0.2, ..PointSpread::default() };
    assert_eq!(info.views[0].psf, expected);
    let frame = dataset.load(0).unwrap();
    assert_eq!((frame.timestamp_s, frame.person_count), (Some(2.0), Some(2)));
    let truth = frame.truth.unwrap();
    assert_eq!((truth.persons, truth.joints[3]), (2, [9.0, 10.0, 11.0]));
    assert_eq!(truth.velocities.unwrap()[1], [3.0, 4.0, 5.0]);
    assert!(frame.maps[0].data[2].is_nan() && frame.maps[0].data[5] == 6.0);
}

#[test]
fn a_bare_file_asks_once_and_is_remembered() {
    let folder = tempfile::tempdir().unwrap();
    let remembered = Remembered::in_folder(&folder.path().join("home/deeper"));
    let path = folder.path().join("maps.npz");
    let map: Vec<f64> = (0..48).map(f64::from).collect();
    let arrays = [
        ("hm_vert", ArrayView::f64(&[2, 6, 4], &map)),
        ("hm_hori", ArrayView::f64(&[2, 6, 4], &map)),
        ("time", ArrayView::f64(&[2], &[0.0, 1.0])),
        ("joints", ArrayView::f64(&[2, 8, 3], &map)),
        ("id", ArrayView::text("x")),
    ];
    write(&path, &arrays).unwrap();
    let catalog = BareCatalog::read(&path).unwrap();
    assert_eq!(catalog.arrays.iter().map(|entry| entry.key.as_str()).collect::<Vec<_>>(), ["hm_hori", "hm_vert"]);
    assert_eq!(remembered.recall(&catalog), None);
    let mut choice = BareChoice::guess(&catalog);
    assert!(choice.first_axis_is_frame);
    let kinds: Vec<_> = choice.views.iter().map(|view| [view.axes[0].kind, view.axes[1].kind]).collect();
    assert_eq!(kinds, [[AxisKind::DepthH, AxisKind::Y], [AxisKind::DepthV, AxisKind::Z]]);
    choice.frame_rate_hz = Some(20.0);
    choice.views[0].axes[1].lo = 0.3;
    let dataset = Dataset::open_bare_remembering(&path, &choice, Some(&remembered)).unwrap();
    assert_eq!((dataset.len(), dataset.info().layout.word(), dataset.frame_name(1)), (2, "bare", "maps/000001"));
    let frame = dataset.load(1).unwrap();
    assert_eq!((frame.maps[1].shape.as_slice(), frame.maps[1].data[0]), ([6, 4].as_slice(), 24.0));
    assert_eq!(frame.timestamp_s, Some(0.05));
    assert_eq!(remembered.recall(&catalog), Some(choice.clone()), "another file with these arrays needs no question");

    choice.first_axis_is_frame = false;
    let wrong = Dataset::open_bare_remembering(&path, &choice, Some(&remembered)).unwrap_err().to_string();
    assert!(wrong.contains("array `hm_hori` has shape (2, 6, 4); its axes' bins make (6, 4)"), "{wrong}");
    choice.views.clear();
    let none = Dataset::open_bare_remembering(&path, &choice, None).unwrap_err().to_string();
    assert!(none.contains("expected at least one"), "{none}");
}

#[test]
fn a_bare_npy_opens_with_a_manifest_or_a_guess() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.npy");
    let map = vec![1.0; 256 * 128];
    write_npy(&path, &ArrayView::f64(&[256, 128], &map)).unwrap();
    let choice = BareChoice::guess(&BareCatalog::read(&path).unwrap());
    assert_eq!(
        choice.views[0].axes,
        <dyn Layout>::named("mmvr").unwrap().preset().unwrap().views[0].axes,
        "256 by 128 are taken for MMVR"
    );
    let text = GENERIC.replace("\"rd\"", "\"array\"").replace("bins = 2", "bins = 256");
    let text = text.replace("bins = 3", "bins = 128");
    let manifest = Manifest::parse(&text, Path::new("m.toml")).unwrap();
    let dataset = Dataset::open_with(
        &path,
        OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() },
        &Progress::new(),
    )
    .unwrap();
    assert_eq!((dataset.len(), dataset.info().skeleton.joints.len()), (1, 2));
    assert_eq!(dataset.load(0).unwrap().maps[0].data.len(), 256 * 128);
}

/// 395 folders of 900 frames of 5 empty files, made under `MHP_BIG_TREE` where they are missing: 1.8 million files.
#[test]
#[ignore = "makes 1.8 million files; run with MHP_BIG_TREE=/tmp/tree"]
fn three_hundred_and_fifty_thousand_frames_open_in_two_seconds() {
    let root = PathBuf::from(std::env::var_os("MHP_BIG_TREE").unwrap());
    for segment in 0..395 {
        let folder = root.join(format!(
            "P{}/d{}s{}/{:03}",
            1 + segment / 122,
            1 + segment / 60,
            1 + segment / 12 % 5,
            segment % 12
        ));
        if folder.exists() {
            continue;
        }
        std::fs::create_dir_all(&folder).unwrap();
        for frame in 0..900 {
            for kind in ["radar", "meta", "bbox", "pose", "mask"] {
                std::fs::File::create(folder.join(format!("{frame:05}_{kind}.npz"))).unwrap();
            }
        }
    }
    open(&root).unwrap();
    let begun = std::time::Instant::now();
    let dataset = open(&root).unwrap();
    let taken = begun.elapsed();
    println!("{} frames in {} sequences: {taken:?}", dataset.len(), dataset.sequences());
    assert_eq!((dataset.len(), dataset.sequences()), (395 * 900, 395));
    assert!(taken.as_secs_f64() < 2.0, "{taken:?}");
}
