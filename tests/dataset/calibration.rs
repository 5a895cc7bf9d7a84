//! Widths from an FFT configuration, radars by name, and widths measured on reflectors.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::captures::{Order, cfg, chirp, open, words};
use mhp_inspector::dataset::{Manifest, RadarPreset};
use mhp_inspector::radar::{
    AxisKind, Board, Echo, FftSetup, RadarConfig, ReflectorMap, ViewFft, Window, refined_widths,
};
use num_complex::Complex64;
use std::path::Path;
use std::process::Command;

const RADAR: &str = "[radar]\nstart_hz = 77e9\nbandwidth_hz = 2.5e9\nchirp_s = 60e-6\nframe_s = 0.0128\nr_max_m = 12.0\nl_az_m = 0.0019\n\
                     l_el_m = 0.0019\ndoppler_features = 4\n";
const AXES: &str = "axes = [{ kind = \"range\", bins = 128, lo = 0.0, hi = 3.837503 }, { kind = \"cone\", bins = 32, lo = -1.0, hi = 1.0, \
                    spacing = \"sine\" }]\n";

fn parse(radar: &str, view: &str) -> Result<Manifest, String> {
    let text = format!(
        "layout = \"npz\"\nframes = \"*.npz\"\nskeleton = \"coco17\"\n{radar}[[view]]\narray = \"map\"\n{AXES}{view}"
    );
    Manifest::parse(&text, Path::new("dataset.toml")).map_err(|error| error.to_string())
}

const FFT: &str = "[view.fft]\nsamples = 256\nchirps = 64\nwindow = { range = \"hann\", angle = \"hamming\" }\npadding = { range = 2 }\narray = { azimuth = 8 }\n";

#[test]
fn widths_follow_from_the_configuration_instead_of_being_stated() {
    let found = parse(RADAR, FFT).unwrap();
    let setup = FftSetup {
        range: (256, Window::Hann),
        doppler: (64, Window::Rectangular),
        azimuth: Some((8, Window::Hamming)),
        elevation: None,
    };
    let radar = RadarConfig { l_az_m: 0.0019, l_el_m: 0.0019, doppler_features: 4, ..RadarConfig::default() };
    assert_eq!(found.views[0].psf, setup.point_spread(&radar));
    assert_eq!(found.calibrations[0].fft, Some(ViewFft { setup, radar: radar.clone() }));
    assert!(found.calibrations[0].derived);
    // The view's own chirp and spacing.
    let own = FFT.replace(
        "array = { azimuth = 8 }",
        "array = { azimuth = 8, azimuth_m = 0.0038 }\nchirp = { bandwidth_hz = 1.25e9 }",
    );
    let own = own.replace("padding = { range = 2 }", "padding = { range = 4 }");
    let other = parse(RADAR, &own).unwrap();
    assert!((other.views[0].psf.range_m / found.views[0].psf.range_m - 2.0).abs() < 1e-9);
    assert!(other.views[0].psf.azimuth_rad < 0.52 * found.views[0].psf.azimuth_rad);
    // Widths that are said are taken, and the configuration is kept.
    let psf = "psf = { range_m = 0.07, azimuth_rad = 0.2, elevation_rad = 0.0, doppler_mps = 0.1 }\n";
    let said = parse(RADAR, &format!("{psf}{FFT}")).unwrap();
    assert_eq!((said.views[0].psf.range_m, said.calibrations[0].derived), (0.07, false));
    assert!(said.calibrations[0].fft.is_some());
}

#[test]
fn a_radar_by_name_says_the_widths() {
    let axes = "array = \"map\"\naxes = [{ kind = \"range\", bins = 64, lo = 0.0, hi = 2.7 }, { kind = \"cone\", bins = 64, lo = -1.0, hi = 1.0, spacing = \"sine\" }]\n";
    let of = |name: &str| {
        let text = format!(
            "layout = \"npz\"\nframes = \"*.npz\"\nskeleton = \"coco17\"\nradar = \"{name}\"\n[[view]]\n{axes}"
        );
        Manifest::parse(&text, Path::new("dataset.toml")).map_err(|error| error.to_string())
    };
    let found = of("iwr1843").unwrap();
    // HuPR's widths, to the digits that its preset used to state.
    let psf = found.views[0].psf;
    assert!((psf.range_m - 0.020935545).abs() < 1e-6 && (psf.azimuth_rad - 0.122555273).abs() < 5e-6, "{psf:?}");
    assert!((psf.doppler_mps - 0.067155506).abs() < 5e-6 && psf.elevation_rad == 0.0, "{psf:?}");
    assert_eq!(found.radar.unwrap().start_hz, 77e9);
    let xrf55 = of("iwr6843").unwrap().views[0].psf;
    assert!((xrf55.range_m - 0.053671442).abs() < 1e-6 && (xrf55.azimuth_rad - 0.106321264).abs() < 5e-6, "{xrf55:?}");
    let told = of("iwr9999").unwrap_err();
    assert!(
        told.starts_with("dataset.toml:4: `radar`: unknown radar \"iwr9999\"; expected awr2243, iwr1843"),
        "{told}"
    );
}

#[test]
fn what_is_wrong_with_a_configuration_is_named() {
    let line = |view: &str| view.lines().count();
    for (view, wanted) in [
        (FFT.replace("samples = 256", "samples = 1"), "view `map`: [view.fft]: `samples` is 1; expected 2 to 65536"),
        (FFT.replace("\"hann\"", "\"round\""), "`window` is \"round\"; expected \"rectangular\", \"hann\""),
        (FFT.replace("angle =", "elbow ="), "unknown key `elbow` in `window`; expected `range`, `doppler` or `angle`"),
        (FFT.replace("range = 2 }", "range = 0 }"), "`padding` is 0; expected a whole number, 1 to 16"),
        (
            FFT.replace("range = 2 }", "range = 3 }"),
            "`padding` 3 of range with 256 points makes bins of 0.019986; axis 0 (range) has bins of 0.029980",
        ),
        (FFT.replace("array = { azimuth = 8 }", ""), "axis 1 (cone) needs `array.azimuth`"),
        (
            FFT.replace("azimuth = 8", "azimuth = 8, azimuth_m = -1.0"),
            "`array.azimuth_m` is -1e0; expected 1e-9 to 1e3",
        ),
        (FFT.replace("samples", "sample"), "unknown key `sample`"),
        (String::new(), "view `map`: missing key `psf`, or [view.fft] from which it follows"),
    ] {
        let told = parse(RADAR, &view).unwrap_err();
        assert!(told.contains(wanted) && told.starts_with("dataset.toml:"), "{} lines: {told}", line(&view));
    }
    let told = parse("", FFT).unwrap_err();
    assert!(told.contains("[view.fft] needs a chirp; expected [radar]"), "{told}");
}

/// A reflector in a still room, through the whole chain: bytes, samples, FFTs, maps.
fn room(window: &str, padding: usize, views: &str, places: &[([f64; 3], f64)]) -> tempfile::TempDir {
    let chirp = chirp();
    let fmcw = chirp.fmcw(Board::Isk, 10.0);
    let echoes: Vec<Echo> = places.iter().map(|&(at, level)| Echo::still(at, Complex64::new(level, 0.0))).collect();
    let mut adc = fmcw.synthesise(&fmcw.loop_of(&echoes), &[]);
    adc.data.iter_mut().for_each(|x| *x = Complex64::new((x.re * 2e4).round(), (x.im * 2e4).round()));
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("adc_data.bin"), words(&adc, 4, Order::TwoLanes { q_first: false }, false))
        .unwrap();
    std::fs::write(home.path().join("chirps.cfg"), cfg(&chirp)).unwrap();
    let text = format!(
        "layout = \"capture\"\nskeleton = \"coco17\"\n[capture]\nremove_static = false\nmax_range_m = 6.0\nviews = {views}\n\
         window = {{ range = \"{window}\", doppler = \"{window}\", angle = \"{window}\" }}\n\
         padding = {{ range = {padding}, doppler = {padding}, angle = {padding} }}\n"
    );
    std::fs::write(home.path().join("dataset.toml"), text).unwrap();
    home
}

fn at(range: f64, degrees: f64) -> [f64; 3] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [range * cos, range * sin, 0.0]
}

/// Derived widths are those of a point's echo, whatever window, padding and kind of map.
#[test]
fn measured_widths_are_the_derived_ones() {
    println!("window padding view            axis   measured / derived");
    for window in ["hann", "hamming", "blackman", "rectangular"] {
        for padding in [1, 2, 4] {
            // A lobe of two bins is not measured without padding.
            if window == "rectangular" && padding == 1 {
                continue;
            }
            let views = "[\"range_azimuth\", \"range_doppler\", \"cartesian\"]";
            let home = room(window, padding, views, &[(at(3.13, 17.0), 1.0)]);
            let dataset = open(home.path()).unwrap();
            let frame = dataset.load(0).unwrap();
            for (k, view) in dataset.info().views.iter().enumerate() {
                // Cells of a Cartesian map are too coarse for a lobe that padding does not widen in bins; and sidelobes along the
                // range make waves of the cut along the angle.
                if view.array == "cartesian" && (padding < 4 || window == "rectangular") {
                    continue;
                }
                let fft = dataset.info().calibration(k).fft;
                let map = ReflectorMap::new(view, &frame.maps[k].data, fft.as_ref()).unwrap();
                let reflector = map.strongest(None).unwrap();
                for cut in &reflector.cuts {
                    let ratio = cut.sigma.unwrap() / cut.model_sigma;
                    println!("{window:11} x{padding} {:15} {:9} {ratio:.3}", view.array, cut.kind.name());
                    let most = if padding == 1 { 0.12 } else { 0.06 };
                    assert!((ratio - 1.0).abs() < most, "{window} x{padding} {} {:?}: {ratio}", view.array, cut.kind);
                }
                let range = reflector.coordinates.iter().find(|(kind, _)| *kind == AxisKind::Range).unwrap().1;
                assert!((range - 3.13).abs() < 0.02, "{window} {}: {range}", view.array);
            }
        }
    }
}

#[test]
fn isolated_peaks_are_found_and_others_left_out() {
    // Two alone, and two in one lobe.
    let places = [(at(1.8, -30.0), 0.5), (at(3.0, 25.0), 1.0), (at(4.6, -8.0), 2.0), (at(4.68, -8.0), 2.0)];
    let home = room("hann", 2, "[\"range_azimuth\"]", &places);
    let dataset = open(home.path()).unwrap();
    let (view, frame) = (&dataset.info().views[0], dataset.load(0).unwrap());
    let fft = dataset.info().calibration(0).fft;
    let found = ReflectorMap::new(view, &frame.maps[0].data, fft.as_ref()).unwrap().isolated();
    let ranges: Vec<f64> = found.iter().map(|reflector| reflector.coordinates[0].1).collect();
    assert!([1.8, 3.0].iter().all(|wanted| ranges.iter().any(|range| (range - wanted).abs() < 0.03)), "{ranges:?}");
    // The double one is wider, and does not count.
    let widths = refined_widths(&found);
    assert!((widths[0].1 / view.psf.range_m - 1.0).abs() < 0.08, "{widths:?} of {:?}", view.psf);
}

fn program(home: &Path, args: &[&str]) -> (bool, String) {
    let program = env!("CARGO_BIN_EXE_mhp-inspector");
    let done = Command::new(program).env("MHP_INSPECTOR_HOME", home).args(args).output().unwrap();
    let text = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    (done.status.success(), text)
}

#[test]
fn calibration_is_told_written_and_kept_as_a_radar() {
    let home = room("hann", 2, "[\"range_azimuth\", \"range_doppler\"]", &[(at(3.13, 17.0), 1.0)]);
    let user = tempfile::tempdir().unwrap();
    let (path, csv) = (home.path().to_str().unwrap(), user.path().join("cuts.csv"));
    let run = |more: &[&str]| program(user.path(), &[&["calibrate", path, "--at", "3.1,17"], more].concat());
    let (fine, text) = run(&["--csv", csv.to_str().unwrap(), "--save", "lab-radar"]);
    assert!(fine && text.contains("derived from the FFTs: 128 samples hann") && text.contains("saved"), "{text}");
    assert!(text.contains("reflector 3.1") && text.contains("cone      measured"), "{text}");
    let cuts = std::fs::read_to_string(&csv).unwrap();
    assert!(cuts.starts_with("view,reflector,axis,offset,measured,model,fitted,window\n"), "{cuts}");
    // Measured and the window's own lobe agree point by point.
    let mut rows = 0;
    for row in cuts.lines().skip(1).filter(|row| row.starts_with("range_azimuth,0,range")) {
        let cells: Vec<&str> = row.split(',').collect();
        let [measured, window] = [4, 7].map(|k| cells[k].parse::<f64>().unwrap());
        assert!((measured - window).abs() < 0.03, "{row}");
        rows += 1;
    }
    assert!(rows >= 5, "{rows}: {cuts}");
    // The radar that was kept says its refined widths to a manifest.
    let (fine, listed) = program(user.path(), &["radars"]);
    assert!(fine && listed.contains("lab-radar") && listed.contains("iwr1843"), "{listed}");
    let (_, file) = program(user.path(), &["radars", "lab-radar"]);
    let kept = RadarPreset::parse(&file, Path::new("kept")).unwrap();
    let (psf, derived) = (kept.psf.unwrap(), kept.view_fft().unwrap().unwrap().point_spread());
    assert!((psf.range_m / derived.range_m - 1.0).abs() < 0.06, "{psf:?} {derived:?}");
    for (args, wanted) in [
        (vec!["--save", "iwr1843"], "is a radar of the program"),
        (vec!["--save", "Lab Radar"], "is no radar's name"),
        (vec!["--view", "nothing"], "expected one of range_azimuth, range_doppler"),
    ] {
        let (fine, text) = run(&args);
        assert!(!fine && text.contains(wanted), "{text}");
    }
    let (fine, text) = program(user.path(), &["calibrate", path, "--at", "3.1"]);
    assert!(!fine && text.contains("expected metres and degrees"), "{text}");
    let (fine, text) = program(user.path(), &["info", path]);
    assert!(fine && text.contains("widths") && text.contains("derived from the FFTs"), "{text}");
}
