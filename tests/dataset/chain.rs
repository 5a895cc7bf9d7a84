//! What is made of captures besides the usual two maps: cascades, cubes of samples, other views, stages, and manifest folders.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::captures::{Order, cfg, check, chirp, open, peak, scene, shared, words};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::radar::{AdcCube, AxisKind, Board, ChirpSettings, Echo, Receiver};
use num_complex::Complex64;
use rand::SeedableRng as _;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

const TWO_LANES: Order = Order::TwoLanes { q_first: false };

/// A folder with a capture of one frame, its `.cfg`, and this in `[capture]`.
fn folder(adc: &AdcCube, chirp: &ChirpSettings, said: &str) -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("adc_data.bin"), words(adc, chirp.rx, TWO_LANES, false)).unwrap();
    std::fs::write(home.path().join("chirps.cfg"), cfg(chirp)).unwrap();
    if !said.is_empty() {
        manifest(home.path(), said);
    }
    home
}

fn manifest(folder: &Path, said: &str) {
    let text = format!("layout = \"capture\"\nskeleton = \"coco17\"\n{said}");
    std::fs::write(folder.join("dataset.toml"), text).unwrap();
}

/// Where the strongest cell of a view is, in the units of its axes.
fn strongest(dataset: &Dataset, view: usize) -> Vec<f64> {
    let frame = dataset.load(0).unwrap();
    let (map, axes) = (&frame.maps[view], &dataset.info().views[view].axes);
    if axes.len() == 2 {
        let (row, column) = peak(map);
        return vec![axes[0].at(row), axes[1].at(column)];
    }
    let top = (0..map.data.len()).max_by(|&a, &b| map.data[a].total_cmp(&map.data[b])).unwrap();
    let [_, columns, deep] = map.shape[..] else { unreachable!("three axes") };
    let bins = [top / (columns * deep), top / deep % columns, top % deep];
    axes.iter().zip(bins).map(|(axis, bin)| axis.at(bin as f64)).collect()
}

#[test]
fn a_mover_is_where_it_was_put_in_every_view() {
    let said =
        "[capture]\nviews = [\"cartesian\", \"range_elevation\", \"cube\", \"range_doppler\"]\nmax_range_m = 6.0\n";
    let home = folder(&scene(&chirp()), &chirp(), said);
    let dataset = open(home.path()).unwrap();
    let kinds: Vec<Vec<AxisKind>> =
        dataset.info().views.iter().map(|view| view.axes.iter().map(|axis| axis.kind).collect()).collect();
    assert_eq!(kinds[0], [AxisKind::DepthH, AxisKind::Y]);
    assert_eq!(kinds[1], [AxisKind::Range, AxisKind::Elevation]);
    assert_eq!(kinds[2], [AxisKind::Range, AxisKind::Cone, AxisKind::Doppler]);
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let step = chirp().range_step_m();
    let near = |found: &[f64], wanted: &[f64], by: &[f64]| {
        assert!(found.iter().zip(wanted).zip(by).all(|((a, b), c)| (a - b).abs() <= *c), "{found:?} {wanted:?}");
    };
    near(&strongest(&dataset, 0), &[3.0 * cos, 3.0 * sin], &[step, 0.15]);
    near(&strongest(&dataset, 1), &[3.0, 0.0], &[step, 0.1]);
    near(&strongest(&dataset, 2), &[3.0, sin, 1.0], &[step, 0.04, chirp().speed_step_mps()]);
    near(&strongest(&dataset, 3), &[3.0, 1.0], &[step, chirp().speed_step_mps()]);
    let widths: Vec<_> =
        dataset.info().views.iter().map(|view| (view.psf.azimuth_rad, view.psf.elevation_rad)).collect();
    // Eight antennas beside each other, two above each other.
    assert!(widths[0].0 > 0.1 && widths[0].0 < 0.14 && widths[0].1 == 0.0, "{widths:?}");
    assert!(widths[1].1 > 0.4 && widths[1].0 == 0.0 && widths[3] == (0.0, 0.0), "{widths:?}");
    assert!((0..4).all(|view| dataset.info().calibration(view).derived));
}

/// A board on its side: what was to its left is above, and its line of antennas measures height.
#[test]
fn an_upright_board_measures_height() {
    let home = folder(
        &scene(&chirp()),
        &chirp(),
        "[capture]\nmount = \"upright\"\nviews = [\"range_elevation\", \"cartesian\"]\n",
    );
    let dataset = open(home.path()).unwrap();
    let sin = 20f64.to_radians().sin();
    let found = strongest(&dataset, 0);
    assert!((found[0] - 3.0).abs() < chirp().range_step_m() && (found[1] - sin).abs() < 0.04, "{found:?}");
    let view = &dataset.info().views[1];
    assert_eq!((view.axes[0].kind, view.axes[1].kind), (AxisKind::DepthV, AxisKind::Z));
    assert!((strongest(&dataset, 1)[1] - 3.0 * sin).abs() < 0.15);
}

/// The four files of a cascade, with the JSON of four devices: a target sits where it was put, to the breadth of 86 elements.
#[test]
fn the_files_of_a_cascade_are_one_capture() {
    let tx: Vec<usize> = (0..12).rev().collect();
    let chirp = ChirpSettings { samples: 64, loops: 8, tx: tx.clone(), rx: 16, sample_rate_hz: 2e6, ..chirp() };
    let fmcw = chirp.fmcw(Board::Cascade, 8.0);
    let (sin, cos) = (-14f64).to_radians().sin_cos();
    let place = [2.1 * cos, 2.1 * sin, 0.0];
    let echo = Echo::moving(place, place.map(|x| 0.3 * x / 2.1), 1.0);
    let mut adc = fmcw.synthesise(&fmcw.loop_of(&[]), &[echo]);
    adc.digitise(&Receiver { noise: 1e-4, full_scale: 1.0, bits: 14 }, &mut rand::rngs::StdRng::seed_from_u64(3));
    let home = tempfile::tempdir().unwrap();
    cascade(home.path(), &adc, &chirp, 2);
    std::fs::write(home.path().join("cascade.mmwave.json"), studio(&chirp)).unwrap();
    let dataset = open(home.path()).unwrap();
    assert_eq!((dataset.len(), dataset.frame_name(1)), (2, "master_0000_data/000001"));
    let found = strongest(&dataset, 0);
    assert!((found[0] - 2.1).abs() < chirp.range_step_m() && (found[1] - sin).abs() < 0.012, "{found:?}, sine {sin}");
    // A line of 86 elements: 0.98 · 2/86.
    let width = dataset.info().views[0].psf.azimuth_rad;
    assert!((width - 0.0114).abs() < 4e-4, "{width}");
    assert!(dataset.info().assumptions[3].contains("86 of them"), "{:?}", dataset.info().assumptions);
    std::fs::remove_file(home.path().join("slave2_0000_data.bin")).unwrap();
    let told = open(home.path()).unwrap_err().to_string();
    assert!(told.contains("slave2_0000_data.bin is not beside it"), "{told}");
}

/// Writes the four files of a cascade, the frame so many times; samples of at most 1 are scaled to whole numbers.
pub(super) fn cascade(folder: &Path, adc: &AdcCube, chirp: &ChirpSettings, times: usize) {
    let most = adc.data.iter().fold(0.0f64, |most, x| most.max(x.re.abs()).max(x.im.abs()));
    let gain = if most <= 1.0 { 8000.0 / most.max(1e-12) } else { 1.0 };
    for (chip, name) in ["master", "slave1", "slave2", "slave3"].into_iter().enumerate() {
        let mut bytes = Vec::new();
        for turn in 0..chirp.loops * chirp.tx.len() {
            for sample in 0..adc.samples {
                for receiver in 0..4 {
                    let x = gain * adc.data[(turn * 16 + chip * 4 + receiver) * adc.samples + sample];
                    bytes.extend((x.re as i16).to_le_bytes());
                    bytes.extend((x.im as i16).to_le_bytes());
                }
            }
        }
        std::fs::write(folder.join(format!("{name}_0000_data.bin")), bytes.repeat(times)).unwrap();
        std::fs::write(folder.join(format!("{name}_0000_idx.bin")), [0; 48]).unwrap();
    }
}

/// What mmWave Studio writes of a cascade, as far as it is read.
pub(super) fn studio(chirp: &ChirpSettings) -> String {
    let device = |chip: usize| {
        let chirps: Vec<serde_json::Value> = chirp
            .tx
            .iter()
            .enumerate()
            .map(|(k, tx)| {
                let mask = if tx / 3 == chip { 1 << (tx % 3) } else { 0 };
                serde_json::json!({ "rlChirpCfg_t": {
                    "chirpStartIdx": k, "chirpEndIdx": k, "profileId": 0, "txEnable": format!("0x{mask}") } })
            })
            .collect();
        serde_json::json!({ "mmWaveDeviceId": chip, "rfConfig": {
            "rlChanCfg_t": { "rxChannelEn": "0xF", "txChannelEn": "0x7" },
            "rlAdcOutCfg_t": { "fmt": { "b2AdcBits": 2, "b2AdcOutFmt": 1 } },
            "rlProfiles": [{ "rlProfileCfg_t": {
                "profileId": 0,
                "startFreqConst_GHz": 1e-9 * chirp.start_hz,
                "idleTimeConst_usec": 1e6 * chirp.idle_s,
                "adcStartTimeConst_usec": 1e6 * chirp.adc_start_s,
                "rampEndTime_usec": 1e6 * chirp.ramp_s,
                "freqSlopeConst_MHz_usec": 1e-12 * chirp.slope_hz_per_s,
                "numAdcSamples": chirp.samples,
                "digOutSampleRate": 1e-3 * chirp.sample_rate_hz } }],
            "rlChirps": chirps,
            "rlFrameCfg_t": { "chirpStartIdx": 0, "chirpEndIdx": chirp.tx.len() - 1, "numLoops": chirp.loops,
                "framePeriodicity_msec": 1e3 * chirp.period_s } } })
    };
    serde_json::json!({ "mmWaveDevices": (0..4).map(device).collect::<Vec<_>>() }).to_string()
}

/// A `.npy` of complex numbers, C order.
pub(super) fn npy(path: &Path, shape: &[usize], data: &[Complex64]) {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let mut header = format!("{{'descr': '<c16', 'fortran_order': False, 'shape': ({}), }}", shape.join(", "));
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for x in data {
        bytes.extend(x.re.to_le_bytes());
        bytes.extend(x.im.to_le_bytes());
    }
    std::fs::write(path, bytes).unwrap();
}

/// `[capture.chirp]` of a chirp.
fn form(chirp: &ChirpSettings) -> String {
    let mut text = "[capture.chirp]\n".to_owned();
    writeln!(text, "start_ghz = {:.6}\nslope_mhz_per_us = {:.6}", 1e-9 * chirp.start_hz, 1e-12 * chirp.slope_hz_per_s)
        .unwrap();
    writeln!(text, "idle_us = {:.3}\nadc_start_us = {:.3}", 1e6 * chirp.idle_s, 1e6 * chirp.adc_start_s).unwrap();
    writeln!(text, "ramp_us = {:.3}\nsamples = {}", 1e6 * chirp.ramp_s, chirp.samples).unwrap();
    writeln!(text, "rate_ksps = {:.3}\nloops = {}", 1e-3 * chirp.sample_rate_hz, chirp.loops).unwrap();
    writeln!(text, "tx = {:?}\nrx = {}\nperiod_ms = {:.3}", chirp.tx, chirp.rx, 1e3 * chirp.period_s).unwrap();
    text
}

#[test]
fn cubes_of_samples_are_captures_where_a_form_says_their_chirp() {
    let adc = scene(&chirp());
    let unsigned = |x: f64| if x < 0.0 { x + 65_536.0 } else { x };
    let lost: Vec<Complex64> = adc.data.iter().map(|x| Complex64::new(unsigned(x.re), unsigned(x.im))).collect();
    for (data, shape, note) in [
        (adc.data.clone(), vec![32, 12, 128], false),
        (lost.clone(), vec![32, 12, 128], true),
        (lost.repeat(2), vec![2, 32, 12, 128], true),
    ] {
        let home = tempfile::tempdir().unwrap();
        npy(&home.path().join("cube.npy"), &shape, &data);
        manifest(home.path(), &format!("frames = \"cube.npy\"\n{}", form(&chirp())));
        let dataset = open(home.path()).unwrap();
        assert_eq!(dataset.len(), if shape.len() == 4 { 2 } else { 1 });
        assert_eq!(dataset.info().notes.iter().any(|said| said.contains("without their sign")), note);
        check(&dataset);
        check(&open(&home.path().join("cube.npy")).unwrap());
    }
    let home = tempfile::tempdir().unwrap();
    npy(&home.path().join("cube.npy"), &[32, 11, 128], &adc.data[..32 * 11 * 128]);
    manifest(home.path(), &format!("frames = \"cube.npy\"\n{}", form(&chirp())));
    let told = open(home.path()).unwrap_err().to_string();
    assert!(told.contains("[32, 11, 128]") && told.contains("[32, 12, 128]") && told.contains("cube.npy"), "{told}");
}

/// Moving echoes near range bin 60, Doppler +7 to 8 and −6 to −10, as is written beside the file.
#[test]
fn the_real_cube_shows_its_movers() {
    let Some(shared) = shared() else { return };
    let home = tempfile::tempdir().unwrap();
    std::fs::copy(shared.join("data/openradar/doppler_example_1.npy"), home.path().join("cube.npy")).unwrap();
    let chirp = ChirpSettings {
        start_hz: 77.4201e9,
        slope_hz_per_s: 60e12,
        idle_s: 30e-6,
        adc_start_s: 6e-6,
        ramp_s: 62e-6,
        samples: 128,
        sample_rate_hz: 2.5e6,
        loops: 128,
        tx: vec![0, 1],
        rx: 4,
        period_s: 0.1,
    };
    manifest(home.path(), &format!("frames = \"cube.npy\"\n[capture]\nboard = \"line\"\n{}", form(&chirp)));
    let dataset = open(home.path()).unwrap();
    assert!((chirp.range_step_m() - 0.0488).abs() < 1e-4);
    let (frame, axes) = (dataset.load(0).unwrap(), &dataset.info().views[1].axes);
    let map = &frame.maps[1];
    let bins = |cell: usize| (cell / axes[1].bins, (cell % axes[1].bins) as i64 - 64);
    let mut cells: Vec<usize> = (0..map.data.len()).filter(|&cell| bins(cell).1.abs() > 2).collect();
    cells.sort_by(|&a, &b| map.data[b].total_cmp(&map.data[a]));
    let strongest: Vec<(usize, i64)> = cells.iter().take(12).map(|&cell| bins(cell)).collect();
    println!("strongest cells (range bin, Doppler bin): {strongest:?}");
    assert!(strongest[0].0 == 60 && (7..=8).contains(&strongest[0].1), "{strongest:?}");
    assert!(strongest.iter().all(|(range, _)| (59..=62).contains(range)), "{strongest:?}");
    assert!(strongest.iter().any(|(_, doppler)| (-10..=-6).contains(doppler)), "{strongest:?}");
}

/// HuPR's length: 600 frames of 786,432 bytes. Nothing but the frame that is asked for is read.
#[test]
fn a_long_capture_opens_at_once_and_steps() {
    let chirp = ChirpSettings { samples: 256, loops: 64, tx: vec![0, 1, 2], ..chirp() };
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("adc_data.bin");
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(471_859_200).unwrap();
    std::fs::write(home.path().join("chirps.cfg"), cfg(&chirp)).unwrap();
    // The middle frame holds something.
    let frame = words(&scene(&chirp), 4, TWO_LANES, false);
    assert_eq!(frame.len(), 786_432);
    std::os::unix::fs::FileExt::write_all_at(&file, &frame, 300 * 786_432).unwrap();
    let begin = Instant::now();
    let dataset = open(home.path()).unwrap();
    let opened = begin.elapsed();
    assert_eq!(dataset.len(), 600);
    let begin = Instant::now();
    for i in [0, 299, 300, 301, 599] {
        let frame = dataset.load(i).unwrap();
        let most = frame.maps[1].data.iter().copied().fold(0.0, f64::max);
        assert_eq!(most > 1.0, i == 300, "frame {i}: {most}");
        assert_eq!(frame.timestamp_s, Some(i as f64 * 0.1));
    }
    let step = begin.elapsed() / 5;
    println!("opened in {:.0} ms, a frame in {:.0} ms", 1e3 * opened.as_secs_f64(), 1e3 * step.as_secs_f64());
    assert!(opened.as_secs_f64() < 2.0 && step.as_secs_f64() < 2.0);
}

fn program(args: &[&str]) -> (bool, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).args(args).output().unwrap();
    let text = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    (done.status.success(), text)
}

#[test]
fn a_capture_becomes_a_manifest_folder() {
    let home = folder(&scene(&chirp()), &chirp(), "");
    let elsewhere = tempfile::tempdir().unwrap();
    let out = elsewhere.path().join("converted");
    let capture = home.path().join("adc_data.bin");
    let (fine, told) = program(&["convert", capture.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert!(fine && told.contains("1 frames in"), "{told}");
    let (before, after) = (open(&capture).unwrap(), open(&out).unwrap());
    assert_eq!((after.info().layout.word(), after.len()), ("npz", 1));
    check(&after);
    for (k, (a, b)) in before.info().views.iter().zip(&after.info().views).enumerate() {
        assert_eq!((&a.array, &a.axes), (&b.array, &b.axes));
        assert!(after.info().calibration(k).derived, "{:?}", after.info().calibration(k));
        assert!(
            (a.psf.range_m / b.psf.range_m - 1.0).abs() < 1e-9 && (a.psf.azimuth_rad - b.psf.azimuth_rad).abs() < 1e-9
        );
    }
    let (a, b) = (before.load(0).unwrap(), after.load(0).unwrap());
    let most = a.maps[0].data.iter().copied().fold(0.0, f64::max);
    assert!(a.maps[0].data.iter().zip(&b.maps[0].data).all(|(a, b)| (a - b).abs() < 1e-6 * most));
    let (fine, told) = program(&["convert", capture.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert!(!fine && told.contains("there is a data set already"), "{told}");
}

#[test]
fn the_stages_say_what_is_resolved_and_what_is_wrong() {
    let home = folder(&scene(&chirp()), &chirp(), "");
    let dataset = open(home.path()).unwrap();
    let stages = dataset.stages(0).unwrap().unwrap();
    let step = chirp().range_step_m();
    let limits: Vec<(&str, f64, f64)> =
        stages.limits.iter().map(|limit| (limit.quantity, limit.resolution, limit.most)).collect();
    assert_eq!(limits[0], ("range", step, 128.0 * step));
    assert_eq!(limits[1], ("speed", chirp().speed_step_mps(), chirp().speed_max_mps()));
    assert!(
        limits[2].0 == "angle" && (limits[2].1 - 14.48).abs() < 0.01 && (limits[2].2 - 90.0).abs() < 1e-6,
        "{limits:?}"
    );
    assert!((stages.strongest.0 - 3.0).abs() < step && (stages.strongest.1 - 1.0).abs() < chirp().speed_step_mps());
    let top = |profile: &[f64]| profile.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0 as f64 * step;
    // The wall is the strongest of all, the mover of what moves.
    assert!((top(&stages.profile) - 20.36f64.sqrt()).abs() < step, "{}", top(&stages.profile));
    assert!((top(&stages.moving) - 3.0).abs() < step, "{}", top(&stages.moving));
    assert_eq!((stages.adc.len(), stages.clipped), (128, 0.0));
    let said = stages.warnings.join("; ");
    assert!(!said.contains("swapped") && !said.contains("folded"), "{said}");

    // Taken the wrong way round.
    manifest(home.path(), "[capture]\niq = \"q_first\"\n");
    let swapped = open(home.path()).unwrap().stages(0).unwrap().unwrap();
    assert!(swapped.warnings.iter().any(|said| said.contains("I/Q swapped")), "{:?}", swapped.warnings);
}

/// An echo at the end of the range, and one that moves as fast as can be told.
#[test]
fn folding_is_warned_of() {
    let chirp = chirp();
    let fmcw = chirp.fmcw(Board::Isk, 10.0);
    let far = Echo::still([0.963 * chirp.range_max_m(), 0.0, 0.0], Complex64::new(40.0, 0.0));
    let fast = Echo::moving([3.0, 0.0, 0.0], [0.97 * chirp.speed_max_mps(), 0.0, 0.0], 1.0);
    for (still, moving, wanted, other) in
        [(vec![far], vec![], "range folded", "ambiguous"), (vec![], vec![fast], "speed ambiguous", "range folded")]
    {
        let mut adc = fmcw.synthesise(&fmcw.loop_of(&still), &moving);
        adc.digitise(&Receiver { noise: 1e-4, full_scale: 1.0, bits: 14 }, &mut rand::rngs::StdRng::seed_from_u64(9));
        let home = folder(&adc, &chirp, "[capture]\niq = \"i_first\"\n");
        let said = open(home.path()).unwrap().stages(0).unwrap().unwrap().warnings.join("; ");
        assert!(said.contains(wanted) && !said.contains(other), "{wanted}: {said}");
    }
}

#[test]
fn the_chain_is_told_without_a_window() {
    let home = folder(&scene(&chirp()), &chirp(), "");
    let elsewhere = tempfile::tempdir().unwrap();
    let (capture, csv) = (home.path().join("adc_data.bin"), elsewhere.path().join("curves.csv"));
    let (fine, text) = program(&["chain", capture.to_str().unwrap(), "--csv", csv.to_str().unwrap()]);
    assert!(fine && text.contains("range       resolution 0.0774 m, at most 9.910 m"), "{text}");
    assert!(text.contains("strongest   3.0"), "{text}");
    let curves = std::fs::read_to_string(&csv).unwrap();
    let stages: std::collections::BTreeSet<&str> =
        curves.lines().skip(1).map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(stages.into_iter().collect::<Vec<_>>(), ["adc_i", "adc_q", "angle", "range", "range_moving"]);
    let (fine, text) = program(&["chain", capture.to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(fine && (json["strongest"]["angle_deg"].as_f64().unwrap() - 20.0).abs() < 2.0, "{text}");
    let (fine, text) = program(&["chain", "samples/walk"]);
    assert!(!fine && text.contains("not the samples of a converter"), "{text}");
    // The form is a manifest as it stands.
    let (_, form) = program(&["chain", "--form"]);
    let parsed = mhp_inspector::dataset::Manifest::parse(&form, Path::new("form")).unwrap();
    assert_eq!(parsed.capture.unwrap().chirp.unwrap().settings().fault(), None);
}

/// What a real capture says: 3.93 cm a range bin, speeds that fold early, its strongest mover.
#[test]
fn the_real_capture_tells_its_chain() {
    let Some(shared) = shared() else { return };
    let stages = open(&shared.join("data/mmwave_eyes")).unwrap().stages(0).unwrap().unwrap();
    println!("limits {:?}\nstrongest {:?}\nwarnings {:?}", stages.limits, stages.strongest, stages.warnings);
    assert!((stages.limits[0].resolution - 0.0393).abs() < 1e-4);
    assert!((0.5..4.5).contains(&stages.strongest.0), "{:?}", stages.strongest);
    assert!(!stages.warnings.iter().any(|said| said.contains("swapped")));
}
