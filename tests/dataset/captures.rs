//! Raw captures: real ones, and synthetic ones whose point targets must be where they were put, in every order of words.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::dataset::adc::Payload;
use mhp_inspector::dataset::{Dataset, DatasetError, Heatmap};
use mhp_inspector::radar::{AdcCube, AxisKind, Board, ChirpSettings, Echo, Receiver};
use mhp_inspector::task::Progress;
use rand::SeedableRng as _;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

pub(super) fn shared() -> Option<PathBuf> {
    let named = std::env::var_os("MHP_SHARED").map(PathBuf::from);
    let path = named.unwrap_or_else(|| Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")).to_owned());
    let there = path.join("data").is_dir();
    if !there {
        println!("skipped: {} is not there", path.display());
    }
    there.then_some(path)
}

pub(super) fn open(path: &Path) -> Result<Dataset, DatasetError> {
    Dataset::open(path, &Progress::new())
}

/// Three transmitters, the raised one last, as captures often have them.
pub(super) fn chirp() -> ChirpSettings {
    ChirpSettings {
        start_hz: 77e9,
        slope_hz_per_s: 60.5e12,
        idle_s: 7.5e-6,
        adc_start_s: 5e-6,
        ramp_s: 60e-6,
        samples: 128,
        sample_rate_hz: 4e6,
        loops: 32,
        tx: vec![0, 2, 1],
        rx: 4,
        period_s: 0.1,
    }
}

/// The commands of a `.cfg`, numbers with fractions among them.
pub(super) fn cfg(chirp: &ChirpSettings) -> String {
    let mut text = "% a comment\nchannelCfg 15 7 0\nadcCfg 2 1 % complex\n".to_owned();
    let micro = |s: f64| 1e6 * s;
    let (idle, start, ramp) = (micro(chirp.idle_s), micro(chirp.adc_start_s), micro(chirp.ramp_s));
    let (slope, rate) = (1e-12 * chirp.slope_hz_per_s, 1e-3 * chirp.sample_rate_hz);
    writeln!(text, "profileCfg 0 77.0 {idle} {start} {ramp} 0 0 {slope} 1 {} {rate} 0 0 30", chirp.samples).unwrap();
    for (k, tx) in chirp.tx.iter().enumerate() {
        writeln!(text, "chirpCfg {k} {k} 0 0 0 0 0 {}", 1 << tx).unwrap();
    }
    writeln!(text, "frameCfg 0 {} {} 0 {} 1 0", chirp.tx.len() - 1, chirp.loops, 1e3 * chirp.period_s).unwrap();
    text
}

/// How a test writes the words of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Order {
    TwoLanes {
        q_first: bool,
    },
    FourLanes,
    /// Real samples, a receiver after the other.
    Real,
}

pub(super) fn words(adc: &AdcCube, rx: usize, order: Order, offset: bool) -> Vec<u8> {
    let change = move |word: u16| word ^ if offset { 0x8000 } else { 0 };
    words_as(adc, rx, order, change)
}

/// As a converter with fewer bits, or another middle, writes its words.
fn words_as(adc: &AdcCube, rx: usize, order: Order, change: impl Fn(u16) -> u16) -> Vec<u8> {
    let mut out = Vec::new();
    let mut put = |x: f64| out.extend(change(x as i16 as u16).to_le_bytes());
    for chirp in adc.data.chunks(rx * adc.samples) {
        match order {
            Order::TwoLanes { q_first } => {
                for line in chirp.chunks(adc.samples) {
                    for pair in line.chunks(2) {
                        for second in [false, true] {
                            for x in pair {
                                put(if q_first == second { x.re } else { x.im });
                            }
                        }
                    }
                }
            }
            Order::Real => chirp.iter().for_each(|x| put(x.re)),
            Order::FourLanes => {
                for sample in 0..adc.samples {
                    (0..rx).for_each(|k| put(chirp[k * adc.samples + sample].re));
                    (0..rx).for_each(|k| put(chirp[k * adc.samples + sample].im));
                }
            }
        }
    }
    out
}

/// A frame of a mover at 3 m, 20° to the left, and of a wall.
pub(super) fn scene(chirp: &ChirpSettings) -> AdcCube {
    let fmcw = chirp.fmcw(Board::Isk, 10.0);
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let place = [3.0 * cos, 3.0 * sin, 0.0];
    let speed = place.map(|x| x / 3.0);
    let wall = Echo::still([4.4, -1.0, 0.0], num_complex::Complex64::new(3.0, 0.0));
    let mover = Echo::moving(place, speed, 1.0);
    let mut adc = fmcw.synthesise(&fmcw.loop_of(&[wall]), &[mover]);
    let receiver = Receiver { noise: 1e-4, full_scale: 1.0, bits: 14 };
    adc.digitise(&receiver, &mut rand::rngs::StdRng::seed_from_u64(7));
    adc
}

pub(super) fn peak(map: &Heatmap) -> (f64, f64) {
    let finite = map.data.iter().enumerate().filter(|(_, x)| x.is_finite());
    let at = finite.max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
    ((at / map.shape[1]) as f64, (at % map.shape[1]) as f64)
}

/// The mover is where it was put: range, angle, speed; the wall is taken away.
pub(super) fn check(dataset: &Dataset) {
    let frame = dataset.load(0).unwrap();
    let views = &dataset.info().views;
    assert_eq!(views.iter().map(|view| view.array.as_str()).collect::<Vec<_>>(), ["range_azimuth", "range_doppler"]);
    let at = |k: usize| {
        let (row, column) = peak(&frame.maps[k]);
        (views[k].axes[0].at(row), views[k].axes[1].at(column))
    };
    let step = chirp().range_step_m();
    let (range, sine) = at(0);
    assert!((range - 3.0).abs() < step && (sine - 20f64.to_radians().sin()).abs() < 0.04, "{range} {sine}");
    let (range, speed) = at(1);
    assert!((range - 3.0).abs() < step && (speed - 1.0).abs() < chirp().speed_step_mps(), "{range} {speed}");
    assert_eq!(views[1].axes[1].kind, AxisKind::Doppler);
    assert_eq!(frame.timestamp_s, Some(0.0));
}

#[test]
fn a_target_is_where_it_was_put_in_every_order_of_words() {
    let adc = scene(&chirp());
    let cases = [
        (Order::TwoLanes { q_first: false }, false, "I first", ""),
        (Order::TwoLanes { q_first: true }, false, "Q first", ""),
        (Order::TwoLanes { q_first: false }, true, "I first", "offset_binary = true\n"),
        (Order::FourLanes, false, "I first", "lanes = 4\n"),
    ];
    for (order, offset, iq, said) in cases {
        let home = tempfile::tempdir().unwrap();
        let frame = words(&adc, 4, order, offset);
        std::fs::write(home.path().join("adc_data.bin"), [&frame[..], &frame, &frame[..10]].concat()).unwrap();
        std::fs::write(home.path().join("chirps.cfg"), cfg(&chirp())).unwrap();
        if !said.is_empty() {
            let manifest = format!("layout = \"capture\"\nskeleton = \"coco17\"\n[capture]\n{said}");
            std::fs::write(home.path().join("dataset.toml"), manifest).unwrap();
        }
        let dataset = open(home.path()).unwrap();
        assert_eq!((dataset.len(), dataset.frame_name(1)), (2, "adc_data/000001"), "{order:?}");
        let info = dataset.info();
        assert_eq!(info.frame_rate_hz, Some(10.0));
        assert!(info.assumptions.iter().any(|said| said.contains(iq)), "{order:?}: {:?}", info.assumptions);
        assert!(info.notes.iter().any(|note| note.starts_with("10 bytes at the end")), "{:?}", info.notes);
        check(&dataset);
        check(&open(&home.path().join("adc_data.bin")).unwrap());
    }
}

/// Real samples have no sign of the beat frequency, and converters of fewer bits write no sign into the upper ones.
#[test]
fn real_samples_and_fewer_bits_are_understood() {
    let adc = scene(&chirp());
    let quieter = |bits: u32| {
        let mut adc = adc.clone();
        let by = 2f64.powi(14 - bits as i32);
        adc.data.iter_mut().for_each(|x| *x = num_complex::Complex64::new((x.re / by).round(), (x.im / by).round()));
        adc
    };
    let cases = [
        (words(&adc, 4, Order::Real, false), "complex = false\n", "samples are real"),
        (words(&adc, 4, Order::Real, true), "complex = false\noffset_binary = true\n", "samples are real"),
        (words_as(&quieter(12), 4, Order::FourLanes, |w| w & 0x0FFF), "bits = 12\nlanes = 4\n", "I first"),
        (words_as(&quieter(14), 4, Order::TwoLanes { q_first: true }, |w| w & 0x3FFF), "bits = 14\n", "Q first"),
    ];
    for (bytes, said, how) in cases {
        let home = tempfile::tempdir().unwrap();
        std::fs::write(home.path().join("adc_data.bin"), bytes).unwrap();
        std::fs::write(home.path().join("chirps.cfg"), cfg(&chirp())).unwrap();
        let manifest = format!("layout = \"capture\"\nskeleton = \"coco17\"\n[capture]\n{said}");
        std::fs::write(home.path().join("dataset.toml"), manifest).unwrap();
        let dataset = open(home.path()).unwrap();
        assert!(dataset.info().assumptions[1].contains(how), "{said}: {:?}", dataset.info().assumptions);
        check(&dataset);
    }
}

#[test]
fn what_stands_still_stays_where_that_is_asked_for() {
    let home = tempfile::tempdir().unwrap();
    let frame = words(&scene(&chirp()), 4, Order::TwoLanes { q_first: false }, false);
    std::fs::write(home.path().join("adc_data.bin"), frame).unwrap();
    std::fs::write(home.path().join("chirps.cfg"), cfg(&chirp())).unwrap();
    let manifest = "layout = \"capture\"\nskeleton = \"coco17\"\n[capture]\nremove_static = false\npadding = 2\nwindow = \"blackman\"\n";
    std::fs::write(home.path().join("dataset.toml"), manifest).unwrap();
    let dataset = open(home.path()).unwrap();
    let frame = dataset.load(0).unwrap();
    let view = &dataset.info().views[1];
    let (row, column) = peak(&frame.maps[1]);
    assert!(
        (view.axes[0].at(row) - 20.36f64.sqrt()).abs() < chirp().range_step_m(),
        "the wall at {}",
        view.axes[0].at(row)
    );
    assert_eq!((view.axes[1].at(column), view.axes[1].bins), (0.0, 64));
    // A wider window, a wider lobe.
    let hann = 0.825_362 * chirp().range_step_m();
    assert!(view.psf.range_m > 1.1 * hann && view.psf.range_m < 1.3 * hann, "{}", view.psf.range_m);
}

/// Bytes as a DCA1000 sends them, and as a capture of the wire has them; every packet but the lost ones.
fn packets(payload: &[u8], lost: &[usize]) -> (Vec<u8>, Vec<u8>) {
    let mut headed = Vec::new();
    let mut pcap = [&0xA1B2_C3D4_u32.to_le_bytes()[..], &[0; 20]].concat();
    for (k, data) in payload.chunks(1456).enumerate().filter(|(k, _)| !lost.contains(k)) {
        let count = (1456 * k as u64).to_le_bytes();
        let packet = [&(k as u32 + 1).to_le_bytes()[..], &count[..6], data].concat();
        headed.extend(&packet);
        let len = (packet.len() as u16 + 8).to_be_bytes();
        let head = [&[0; 12][..], &[8, 0, 0x45], &[0; 8], &[17], &[0; 10], &[0x10, 2, 0x10, 2], &len, &[0; 2]].concat();
        let frame = [head, packet].concat();
        let size = (frame.len() as u32).to_le_bytes();
        pcap.extend([&[0; 8][..], &size, &size, &frame].concat());
    }
    (headed, pcap)
}

#[test]
fn headers_are_taken_off_and_gaps_are_zeros_and_told() {
    let home = tempfile::tempdir().unwrap();
    let frame = words(&scene(&chirp()), 4, Order::TwoLanes { q_first: false }, false);
    for lost in [&[][..], &[3, 4, 9]] {
        let (headed, pcap) = packets(&frame, lost);
        for (name, bytes) in [("a.bin", &headed), ("a.pcap", &pcap)] {
            let path = home.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let payload = Payload::open(&path).unwrap();
            let mut wanted = frame.clone();
            for k in lost {
                wanted[1456 * k..1456 * (k + 1)].fill(0);
            }
            assert_eq!(payload.len(), frame.len() as u64, "{name}");
            assert_eq!(payload.read(0, frame.len()).unwrap(), wanted, "{name}");
            assert_eq!(payload.read(1450, 20).unwrap(), wanted[1450..1470], "across a packet's end");
            let gaps = payload.gaps();
            assert_eq!((gaps.bytes, gaps.count), (1456 * lost.len() as u64, lost.len().min(2)), "{name}");
        }
        std::fs::write(home.path().join("chirps.cfg"), cfg(&chirp())).unwrap();
        let dataset = open(&home.path().join("a.pcap")).unwrap();
        check(&dataset);
        let told = dataset.info().notes.iter().any(|note| note.contains("4368 bytes in 2 gaps were lost"));
        assert_eq!(told, !lost.is_empty(), "{:?}", dataset.info().notes);
    }
}

#[test]
fn what_is_wrong_is_named() {
    let home = tempfile::tempdir().unwrap();
    let bin = home.path().join("adc_data.bin");
    std::fs::write(&bin, [0; 100]).unwrap();
    let said = |config: Option<String>| {
        let path = home.path().join("chirps.cfg");
        match config {
            Some(text) => std::fs::write(path, text).unwrap(),
            None => drop(std::fs::remove_file(path)),
        }
        open(&bin).unwrap_err().to_string()
    };
    let sound = cfg(&chirp());
    let cases = [
        (None, "nothing beside it says what it is; expected its .cfg or .mmwave.json"),
        (Some(String::new()), "no `frameCfg`; expected a radar's configuration"),
        (
            Some(sound.replace("60.5 1 128", "fast 1 128")),
            "cfg:4: `profileCfg`: field 8, slope, MHz/µs, is \"fast\"; expected a number",
        ),
        (
            Some(sound.replace("0 0 0 0 0 4", "0 0 0 0 0 6")),
            "2 transmitters send at once in a chirp; expected one after the other",
        ),
        (Some(sound.replace("frameCfg 0 2", "frameCfg 0 3")), "chirp 3 has no `chirpCfg`"),
        (Some(sound.replace("1 128 4000", "1 0 4000")), "samples a chirp: 0; expected 1 to 65536"),
        (Some(sound), "100 bytes of samples; expected at least 196608, a frame of"),
    ];
    for (config, wanted) in cases {
        let told = said(config);
        assert!(told.contains(wanted) && told.starts_with(&home.path().display().to_string()), "{told}");
    }
    let manifest = |table: &str| {
        let text = format!("layout = \"capture\"\nskeleton = \"coco17\"\n[capture]\n{table}\n");
        std::fs::write(home.path().join("dataset.toml"), text).unwrap();
        open(home.path()).unwrap_err().to_string()
    };
    for (table, wanted) in [
        ("lanes = 3", "`lanes` is 3; expected 2 or 4"),
        ("iq = \"maybe\"", "`iq` is \"maybe\"; expected \"i_first\" or \"q_first\""),
        ("window = \"round\"", "`window` is \"round\"; expected"),
        ("board = \"ods\"", "`board` is unknown; expected \"isk\", \"line\" or \"cascade\""),
        ("config = \"../elsewhere.cfg\"", "leads out of the data set's folder"),
        ("colour = 1", "unknown key `colour`"),
    ] {
        let told = manifest(table);
        assert!(told.contains(wanted), "{told}");
    }
}

#[test]
fn the_real_capture_opens_with_its_json() {
    let Some(shared) = shared() else { return };
    let dataset = open(&shared.join("data/mmwave_eyes")).unwrap();
    let info = dataset.info();
    assert_eq!((dataset.len(), info.layout.word(), info.name.as_str()), (1, "capture", "adc_data"));
    assert!(info.assumptions[0].contains("3.925 cm a range bin"), "{}", info.assumptions[0]);
    assert!(info.assumptions[1].contains("I first"), "{}", info.assumptions[1]);
    let frame = dataset.load(0).unwrap();
    // Slow movement at 0.9 to 3.9 m: there is more beside zero speed there than farther away.
    let (map, axes) = (&frame.maps[1], &info.views[1].axes);
    let power = |from: f64, to: f64| {
        let cells = (0..map.data.len()).filter(|cell| {
            let (range, speed) = (axes[0].at((cell / axes[1].bins) as f64), axes[1].at((cell % axes[1].bins) as f64));
            (from..to).contains(&range) && (0.015..0.2).contains(&speed.abs())
        });
        let powers: Vec<f64> = cells.map(|cell| map.data[cell].powi(2)).collect();
        powers.iter().sum::<f64>() / powers.len() as f64
    };
    assert!(power(0.9, 3.9) > 10.0 * power(5.0, 10.0), "{} {}", power(0.9, 3.9), power(5.0, 10.0));
}

#[test]
fn the_real_pcap_holds_the_bytes_of_its_bin() {
    let Some(shared) = shared() else { return };
    let folder = shared.join("data/mmwave_capture_std");
    let payload = Payload::open(&folder.join("test_one_frame.pcap")).unwrap();
    let bytes = std::fs::read(folder.join("test_one_frame.adc.bin")).unwrap();
    assert!(payload.is_packets() && payload.gaps().count == 0);
    assert_eq!(payload.len(), bytes.len() as u64);
    assert!(payload.read(0, bytes.len()).unwrap() == bytes);
}
