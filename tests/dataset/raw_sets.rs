//! Data sets of raw captures: XRF55's clips of samples, RT-Pose's cascades with its labels, and a part of RT-Pose's grid.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::captures::{open, peak};
use super::chain::{cascade, npy, studio};
use mhp_inspector::cli::simulate::{Style, write_data_set};
use mhp_inspector::dataset::npz::{ArrayView, write_npy};
use mhp_inspector::geometry::norm;
use mhp_inspector::radar::{AdcCube, AxisKind, Board, ChirpSettings, Echo};
use mhp_inspector::simulate::{Options, Recording, ScenePreset, SimulatedLayout};
use num_complex::Complex64;
use std::path::Path;

/// The chirp of XRF55's capture script over fewer samples and chirps.
fn xrf55(tx: usize, loops: usize) -> ChirpSettings {
    ChirpSettings {
        start_hz: 60e9,
        slope_hz_per_s: 27.013e12,
        idle_s: 7e-6,
        adc_start_s: 5e-6,
        ramp_s: 140e-6,
        samples: 128,
        sample_rate_hz: 3e6,
        loops,
        tx: (0..tx).collect(),
        rx: 4,
        period_s: 0.05,
    }
}

/// (loop, channel, sample) as (transmitter, sample, receiver, loop).
fn segmented(adc: &AdcCube, chirp: &ChirpSettings) -> Vec<Complex64> {
    let (tx, rx) = (chirp.tx.len(), chirp.rx);
    let mut out = Vec::new();
    for t in 0..tx {
        for s in 0..chirp.samples {
            for r in 0..rx {
                for l in 0..chirp.loops {
                    out.push(adc.data[(l * adc.channels + t * rx + r) * adc.samples + s]);
                }
            }
        }
    }
    out
}

#[test]
fn raw_clips_of_xrf55_are_captures_whose_movers_are_where_they_were_put() {
    // One transmitter, as the script seems to have it, and three in turn.
    for (tx, loops, elements) in [(1, 48, 4), (3, 16, 8)] {
        let chirp = xrf55(tx, loops);
        let fmcw = chirp.fmcw(Board::Isk, 10.0);
        let (sin, cos) = 20f64.to_radians().sin_cos();
        let place = [2.5 * cos, 2.5 * sin, 0.0];
        let mover = |speed: f64| Echo::moving(place, place.map(|x| speed * x / norm(place)), 1.0);
        let frames: Vec<Complex64> = [0.4, -0.4]
            .into_iter()
            .flat_map(|speed| segmented(&fmcw.synthesise(&fmcw.loop_of(&[]), &[mover(speed)]), &chirp))
            .collect();
        let home = tempfile::tempdir().unwrap();
        let clips = home.path().join("Raw_dataset/mmWave");
        std::fs::create_dir_all(&clips).unwrap();
        for name in ["03_07_15.npy", "3_8_1.npy"] {
            npy(&clips.join(name), &[2, tx, 128, 4, loops], &frames);
        }
        // Another sensor's file of the same name, and a clip of other sizes.
        npy(&clips.join("03_09_01.npy"), &[2, tx, 64, 4, loops], &frames);
        let dataset = open(home.path()).unwrap();
        let info = dataset.info();
        assert_eq!((info.layout.word(), dataset.len(), dataset.sequences()), ("xrf55", 4, 2));
        assert!(dataset.frame_name(1).ends_with("mmWave/03_07_15/001"), "{}", dataset.frame_name(1));
        assert_eq!(info.frame_rate_hz, Some(20.0));
        assert!(info.notes.iter().any(|note| note.starts_with("1 clips are left out")), "{:?}", info.notes);
        assert!(info.assumptions.iter().any(|text| text.contains("XRF55's capture script: 128 samples")));
        assert!(info.assumptions.iter().any(|text| text.contains(&format!("{elements} of them a line"))));
        for (frame, speed) in [(0, 0.4), (1, -0.4)] {
            let loaded = dataset.load(frame).unwrap();
            assert_eq!(loaded.global_id.as_deref(), Some("volunteer 3, action 7, repetition 15 (test)"));
            assert!((loaded.timestamp_s.unwrap() - 0.05 * frame as f64).abs() < 1e-9 && loaded.truth.is_none());
            let axes = |view: usize| &info.views[view].axes;
            let ((row, column), (_, fast)) = (peak(&loaded.maps[0]), peak(&loaded.maps[1]));
            assert_eq!((axes(0)[1].kind, axes(1)[1].kind), (AxisKind::Cone, AxisKind::Doppler));
            assert!((axes(0)[0].at(row) - 2.5).abs() < chirp.range_step_m(), "{tx}: {}", axes(0)[0].at(row));
            assert!((axes(0)[1].at(column) - sin).abs() < 0.05, "{tx}: {}", axes(0)[1].at(column));
            assert!((axes(1)[1].at(fast) - speed).abs() < chirp.speed_step_mps(), "{tx}: {}", axes(1)[1].at(fast));
        }
        assert!(dataset.has_samples() && dataset.stages(1).unwrap().is_some());
        // A chirp that does not fit is told with what would.
        let said = "layout = \"xrf55\"\n[capture.chirp]\nstart_ghz = 60.0\nslope_mhz_per_us = 27.0\nidle_us = 7.0\nadc_start_us = 5.0\n\
                    ramp_us = 140.0\nsamples = 256\nrate_ksps = 3000.0\nloops = 9\ntx = [0]\nrx = 4\nperiod_ms = 50.0\n";
        std::fs::write(home.path().join("dataset.toml"), said).unwrap();
        let told = open(home.path()).unwrap_err().to_string();
        assert!(told.contains("expected [1, 256, 4, 9], as the manifest's chirp says"), "{told}");
    }
}

/// RT-Pose's tree with the four files of each cascade, its JSON in a folder above, and labels.
#[test]
fn raw_cascades_of_rt_pose_become_its_cubes_with_their_joints() {
    let chirp = ChirpSettings {
        start_hz: 77e9,
        slope_hz_per_s: 60e12,
        idle_s: 5e-6,
        adc_start_s: 5e-6,
        ramp_s: 40e-6,
        samples: 64,
        sample_rate_hz: 2e6,
        loops: 4,
        tx: (0..12).rev().collect(),
        rx: 16,
        period_s: 0.1,
    };
    let home = tempfile::tempdir().unwrap();
    let place = [2.3, 0.8, 0.4];
    let fmcw = chirp.fmcw(Board::Cascade, 8.0);
    let mover = Echo::moving(place, place.map(|x| 0.5 * x / norm(place)), 1.0);
    let adc = fmcw.synthesise(&fmcw.loop_of(&[]), &[mover]);
    for sequence in ["2023_0001", "2023_0002"] {
        let bin = home.path().join(sequence).join("radar/bin");
        std::fs::create_dir_all(&bin).unwrap();
        cascade(&bin, &adc, &chirp, 2);
    }
    let told = open(home.path()).unwrap_err().to_string();
    assert!(told.contains("no .mmwave.json beside it or in the folders above"), "{told}");
    for sequence in ["2023_0001", "2023_0002"] {
        std::fs::write(home.path().join(sequence).join("radar/cascade.mmwave.json"), studio(&chirp)).unwrap();
    }
    let joints = vec!["[2.3, 0.8, 0.4]"; 15].join(",");
    let labels = format!(r#"{{"4": {{"000009": [{{"Radar_frameID": "000001", "pose": [{joints}]}}]}}}}"#);
    std::fs::write(home.path().join("Train.json"), labels).unwrap();
    std::fs::write(home.path().join("file_meta.txt"), "3,2023_0001\n4,2023_0002\n").unwrap();
    // Small cubes; the grid of the preset has a million cells.
    let manifest = r#"
layout = "rt_pose"
[[view]]
array = "cube"
psf = { range_m = 0.05, azimuth_rad = 0.02, elevation_rad = 0.14, doppler_mps = 0.2 }
axes = [
  { kind = "z", bins = 10, lo = -1.6, hi = 1.6 },
  { kind = "y", bins = 32, lo = -1.6, hi = 1.6 },
  { kind = "x", bins = 40, lo = 1.0, hi = 4.0 },
]
"#;
    std::fs::write(home.path().join("dataset.toml"), manifest).unwrap();
    let dataset = open(home.path()).unwrap();
    let info = dataset.info();
    assert_eq!((info.layout.word(), dataset.len(), dataset.sequences()), ("rt_pose", 4, 2));
    assert_eq!((dataset.frame_name(0), dataset.frame_name(3)), ("2023_0001/000000", "2023_0002/000001"));
    assert!((info.radar.bandwidth_hz - chirp.bandwidth_hz()).abs() < 1.0 && info.views[0].psf.range_m == 0.05);
    assert!(info.assumptions.iter().any(|text| text.contains("taken for radar frame n")), "{:?}", info.assumptions);
    let frame = dataset.load(3).unwrap();
    // Labels are read as single precision.
    let joints = frame.truth.as_ref().map(|truth| truth.joints.clone()).unwrap();
    assert!(joints.len() == 15 && joints.iter().flatten().zip(place.iter().cycle()).all(|(a, b)| (a - b).abs() < 1e-6));
    assert!(dataset.load(0).unwrap().truth.is_none());
    let map = &frame.maps[0];
    assert_eq!(map.shape, [10, 32, 40]);
    let top = (0..map.data.len()).max_by(|&a, &b| map.data[a].total_cmp(&map.data[b])).unwrap();
    let axes = &info.views[0].axes;
    let found = [axes[2].at((top % 40) as f64), axes[1].at((top / 40 % 32) as f64), axes[0].at((top / 1280) as f64)];
    let off: Vec<f64> = found.iter().zip(place).map(|(a, b)| (a - b).abs()).collect();
    assert!(off[0] < 0.15 && off[1] < 0.1 && off[2] < 0.33, "{found:?}");
    assert!(dataset.has_samples() && dataset.stages(0).unwrap().is_some());
    // Without the manifest the folders tell what it is; of a capture elsewhere they do not.
    std::fs::remove_file(home.path().join("dataset.toml")).unwrap();
    let of_folders = open(&home.path().join("2023_0001")).unwrap();
    assert_eq!((of_folders.info().layout.word(), of_folders.len()), ("rt_pose", 2));
    assert_eq!(of_folders.info().views[0].shape(), [32, 128, 256]);
    assert!(of_folders.info().calibration(0).derived && of_folders.info().views[0].psf.range_m > 0.05);
}

/// A view on a part of the published grid takes that part of every cube.
#[test]
fn the_region_of_the_published_training_is_cut_out_of_the_cubes() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("2023_0001/npy");
    std::fs::create_dir_all(&folder).unwrap();
    let (z, y, x) = (32, 128, 256);
    let cells: Vec<f32> = (0..z * y * x).map(|cell| 1.0 + (cell % 99_991) as f32).collect();
    write_npy(&folder.join("000000.npy"), &ArrayView::f32(&[z, y, x], &cells)).unwrap();
    let said = |axes: &str| {
        let text = format!(
            "layout = \"rt_pose\"\n[[view]]\narray = \"cube\"\npsf = {{ range_m = 0.05, azimuth_rad = 0.02, elevation_rad = 0.14, \
             doppler_mps = 0.2 }}\naxes = [\n{axes}\n]\n"
        );
        std::fs::write(home.path().join("dataset.toml"), text).unwrap();
    };
    // As the preset's own comment writes it.
    let preset = include_str!("../../assets/rt_pose.toml");
    let roi: Vec<&str> = preset.lines().filter_map(|line| line.strip_prefix("#   {")).collect();
    assert_eq!(roi.len(), 3);
    said(&roi.iter().map(|line| format!("{{{line}")).collect::<Vec<_>>().join("\n"));
    let dataset = open(home.path()).unwrap();
    let map = dataset.load(0).unwrap().maps.remove(0);
    assert_eq!(map.shape, [16, 64, 160]);
    assert!(dataset.info().assumptions[0].contains("a part of the published grid"), "{:?}", dataset.info().assumptions);
    for (k, at) in [(0, [13, 32, 17]), (159, [13, 32, 176]), (160, [13, 33, 17]), (16 * 64 * 160 - 1, [28, 95, 176])] {
        let stored = f64::from(cells[(at[0] * y + at[1]) * x + at[2]]);
        assert_eq!(map.data[k].to_bits(), stored.to_bits(), "cell {k}");
    }
    // Off the grid it is another cube.
    said(
        "{ kind = \"z\", bins = 16, lo = -1.0, hi = 4.8 },\n{ kind = \"y\", bins = 64, lo = -5.0, hi = 5.0 },\n{ kind = \"x\", bins = 160, lo = 0.8, hi = 8.0 }",
    );
    assert!(open(home.path()).unwrap().load(0).unwrap_err().to_string().contains("expected (16, 64, 160)"));
}

/// What `simulate` says of the FFTs gives back the widths, and the vertical radar of HIBER its own chirp.
#[test]
fn simulated_manifests_say_their_ffts() {
    for layout in SimulatedLayout::ALL {
        let home = tempfile::tempdir().unwrap();
        // XRF55's stacks are of seventeen.
        let frames = if layout == SimulatedLayout::Xrf55Stack { 17 } else { 1 };
        let presets = vec![ScenePreset::Easy];
        let options = Options { layout, presets, frames, sequence_length: frames, ..Options::default() };
        let recording = Recording::new(&options).unwrap();
        write_data_set(home.path(), &recording, Style::default(), || ()).unwrap();
        let text = std::fs::read_to_string(home.path().join("dataset.toml")).unwrap();
        assert!(text.contains("[view.fft]") && !text.contains("psf"), "{layout:?}: {text}");
        let dataset = open(home.path()).unwrap();
        for (k, (view, made)) in dataset.info().views.iter().zip(recording.views()).enumerate() {
            assert_eq!(view.psf, made.psf, "{layout:?}: {}", view.array);
            assert!(dataset.info().calibration(k).derived);
        }
        if layout == SimulatedLayout::Hiber {
            assert!(text.contains("79000000000.0"), "{text}");
            let told = &dataset.info().notes;
            assert!(
                told.iter()
                    .any(|note| note.contains("of 1 groups 0 are of HIBER's training, 0 of validation, 1 of test"))
            );
            assert_eq!(dataset.load(0).unwrap().global_id.as_deref(), Some("WALK (test)"));
            assert!(dataset.info().axes_badge.contains("z 5→−5 m, column 0 top (vertical)"));
        }
    }
}

/// A capture alone, whatever its folder is called, is no RT-Pose.
#[test]
fn a_cascade_elsewhere_is_a_capture() {
    let chirp = ChirpSettings { samples: 32, loops: 2, tx: (0..12).collect(), rx: 16, ..xrf55(1, 2) };
    let home = tempfile::tempdir().unwrap();
    let adc = AdcCube { loops: 2, channels: 192, samples: 32, data: vec![Complex64::ONE; 2 * 192 * 32] };
    cascade(home.path(), &adc, &chirp, 1);
    std::fs::write(home.path().join("a.mmwave.json"), studio(&chirp)).unwrap();
    let word = |path: &Path| open(path).unwrap().info().layout.word();
    assert_eq!(word(home.path()), "capture");
    let said = "layout = \"capture\"\n[capture]\nviews = [\"cartesian_cube\"]\nmax_range_m = 6.0\n";
    std::fs::write(home.path().join("dataset.toml"), said).unwrap();
    let dataset = open(home.path()).unwrap();
    let kinds: Vec<AxisKind> = dataset.info().views[0].axes.iter().map(|axis| axis.kind).collect();
    assert_eq!(kinds, [AxisKind::Z, AxisKind::Y, AxisKind::X]);
    assert_eq!(dataset.load(0).unwrap().maps[0].data.len(), dataset.info().views[0].cells());
}
