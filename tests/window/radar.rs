//! The panes of the radar itself in the real window: the chain of a capture, calibration, and the map of the signals.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::folders::HOME_VARIABLE;
use mhp_inspector::radar::{Board, ChirpSettings, Echo, Receiver};
use mhp_inspector::task::Progress;
use num_complex::Complex64;
use rand::SeedableRng as _;
use std::path::Path;
use std::process::Command;

/// A capture of a mover at 3 m and of a wall, with its `.cfg`, taken as `said` has it.
fn write_capture(folder: &Path, said: &str) {
    let chirp = ChirpSettings {
        start_hz: 77e9,
        slope_hz_per_s: 60e12,
        idle_s: 7e-6,
        adc_start_s: 5e-6,
        ramp_s: 60e-6,
        samples: 128,
        sample_rate_hz: 4e6,
        loops: 16,
        tx: vec![0, 2],
        rx: 4,
        period_s: 0.1,
    };
    let fmcw = chirp.fmcw(Board::Isk, 10.0);
    let wall = Echo::still([4.4, -1.0, 0.0], Complex64::new(3.0, 0.0));
    let mover = Echo::moving([2.8, 1.0, 0.0], [0.9, 0.3, 0.0], 1.0);
    let mut adc = fmcw.synthesise(&fmcw.loop_of(&[wall]), &[mover]);
    adc.digitise(&Receiver { noise: 1e-4, full_scale: 1.0, bits: 14 }, &mut rand::rngs::StdRng::seed_from_u64(5));
    let mut words: Vec<i16> = Vec::new();
    for pair in adc.data.chunks(2) {
        words.extend([pair[0].re as i16, pair[1].re as i16, pair[0].im as i16, pair[1].im as i16]);
    }
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    std::fs::write(folder.join("adc_data.bin"), bytes.repeat(3)).unwrap();
    let cfg = "channelCfg 15 5 0\nadcCfg 2 1\nprofileCfg 0 77.0 7 5 60 0 0 60 1 128 4000 0 0 30\nchirpCfg 0 0 0 0 0 0 0 1\n\
               chirpCfg 1 1 0 0 0 0 0 4\nframeCfg 0 1 16 0 100 1 0\n";
    std::fs::write(folder.join("chirps.cfg"), cfg).unwrap();
    let manifest = format!("layout = \"capture\"\nskeleton = \"coco17\"\n[capture]\nmax_range_m = 6.0\n{said}");
    std::fs::write(folder.join("dataset.toml"), manifest).unwrap();
}

fn window(said: &str) -> Window {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path(), said);
    Window::on(folder)
}

#[test]
fn a_capture_shows_its_chain_and_what_is_wrong_with_it() {
    let mut shown = window("");
    shown.click("Radar chain");
    shown.until("the stages", |w| w.named("Range and Doppler, all antennas"));
    for part in ["Range profile", "Angle spectrum in the strongest cell"] {
        assert!(shown.named(part), "{part}: {:?}", shown.names());
    }
    // c·4 Msps/(2·60 MHz/µs·128), and twice 64 of them.
    assert!(shown.says("range 0.0781 m, to 9.99 m") && shown.says("strongest: 2.9"), "{:?}", shown.names());
    assert!(!shown.says("I/Q swapped"), "{:?}", shown.names());
    let mut swapped = window("iq = \"q_first\"\n");
    swapped.click("Radar chain");
    swapped.until("the stages", |w| w.named("Range profile"));
    assert!(swapped.says("I/Q swapped"), "{:?}", swapped.names());
    // A data set of maps says what would fill the pane.
    let mut maps = Window::open(1);
    maps.click("Radar chain");
    assert!(maps.says("No samples of a converter"), "{:?}", maps.names());
}

/// A capture that came alone: the window asks how it was recorded, tells what follows while it is typed, and remembers.
#[test]
fn a_capture_without_a_configuration_is_asked_for() {
    // What is remembered must not go into the home of whoever runs the tests.
    if std::env::var_os(HOME_VARIABLE).is_none() {
        let home = tempfile::tempdir().unwrap();
        let mut alone = Command::new(std::env::current_exe().unwrap());
        alone.args(["--exact", "radar::a_capture_without_a_configuration_is_asked_for", "--nocapture"]);
        let done = alone.env(HOME_VARIABLE, home.path()).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        assert!(home.path().join("captures.toml").is_file());
        return;
    }
    let mut shown = Window::open(1);
    let folder = shown.folder.path().join("alone");
    std::fs::create_dir(&folder).unwrap();
    write_capture(&folder, "");
    for file in ["chirps.cfg", "dataset.toml"] {
        std::fs::remove_file(folder.join(file)).unwrap();
    }
    let capture = folder.join("adc_data.bin");
    shown.drop_file(&capture);
    shown.until("the question", |w| w.says("How was this recorded?"));
    assert!(shown.says("256 samples at 5.00 Msps"), "{:?}", shown.names());
    for (name, value) in [
        ("Samples a chirp", "128"),
        ("Sampling rate", "4000"),
        ("Loops a frame", "16"),
        ("End of the ramp", "60"),
        ("Begin of sampling", "40"),
    ] {
        shown.type_value(name, value);
    }
    // 128 samples at 4 Msps after 40 µs of a ramp of 60.
    assert!(
        shown.says("128 samples at 4.00 Msps over 1.92 GHz") && shown.says("after the ramp"),
        "{:?}",
        shown.names()
    );
    shown.type_value("Begin of sampling", "5");
    assert!(!shown.says("after the ramp"), "{:?}", shown.names());
    shown.click("Open this capture");
    shown.until("the capture", |w| {
        w.session().data.dataset.as_ref().is_some_and(|dataset| dataset.info().layout.word() == "capture")
    });
    let dataset = shown.session().data.dataset.clone().unwrap();
    assert_eq!((dataset.len(), dataset.info().views.len()), (3, 2));
    // Remembered for this file, and for its folder.
    let again = Dataset::open(&folder, &Progress::new()).unwrap();
    assert_eq!(again.info().radar, dataset.info().radar);
    assert!(!folder.join("dataset.toml").exists(), "nothing is written beside the capture");
}

#[test]
fn calibration_measures_and_keeps_a_radar() {
    let mut shown = window("remove_static = false\npadding = 2\n");
    shown.click("Calibration");
    shown.until("the cuts", |w| w.named("Map with its reflectors"));
    assert!(shown.says("derived from the FFTs: 128 samples hann"), "{:?}", shown.names());
    // The map can be clicked; then that reflector alone is measured.
    shown.click("Map with its reflectors");
    shown.until("one reflector", |w| w.named("Map with its reflectors"));
}

#[test]
fn the_signals_stand_beside_the_closed_form() {
    let mut shown = window("padding = 2\n");
    shown.ready(0);
    shown.click("Signal path");
    shown.until("the map of the signals", |w| w.named("Closed form − signals"));
    assert!(shown.says("where the map is within 3 dB of it"), "{:?}", shown.names());
    // Widths that are stated say nothing of windows.
    let mut stated = Window::open(1);
    stated.click("Signal path");
    assert!(stated.says("FFTs not known"), "{:?}", stated.names());
}
