//! HuPR's raw captures against its published cubes, and against the closed form at the corners of a cube.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its input has failed")]

use mhp_inspector::cli::simulate::{Style, write_data_set};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::radar::{AdcCube, Echo};
use mhp_inspector::simulate::{Device, Options, Recording, ScenePreset, SimulatedLayout};
use mhp_inspector::task::Progress;
use num_complex::Complex64;
use std::path::Path;

/// The bytes of a frame as a DCA1000 writes them: two lanes, I first; samples must be whole numbers.
fn captured(adc: &AdcCube) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 * adc.data.len());
    for pair in adc.data.chunks_exact(2) {
        for word in [pair[0].re, pair[1].re, pair[0].im, pair[1].im] {
            bytes.extend((word as i16).to_le_bytes());
        }
    }
    bytes
}

fn write_captures(folder: &Path, cubes: &[Vec<u8>; 2]) {
    for (radar, bytes) in ["hori", "vert"].iter().zip(cubes) {
        let folder = folder.join(radar);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("adc_data.bin"), bytes).unwrap();
    }
}

fn open(path: &Path) -> Dataset {
    Dataset::open(path, &Progress::new()).unwrap()
}

#[test]
fn captures_become_the_maps_of_the_published_cubes() {
    let home = tempfile::tempdir().unwrap();
    let options = Options {
        layout: SimulatedLayout::Hupr,
        presets: vec![ScenePreset::Easy],
        frames: 2,
        sequence_length: 2,
        seed: 9,
        ..Options::default()
    };
    let recording = Recording::new(&options).unwrap();
    let cubes = home.path().join("cubes");
    write_data_set(&cubes, &recording, Style::default(), || ()).unwrap();
    let mut captures = [Vec::new(), Vec::new()];
    for number in 0..2 {
        for (capture, adc) in captures.iter_mut().zip(recording.sequence(0).raw(number).cubes) {
            capture.extend(captured(&adc));
        }
    }
    assert_eq!(captures[0].len(), 2 * 786_432);
    // Half a frame more is none.
    for capture in &mut captures {
        capture.extend([0; 1000]);
    }
    let raw = home.path().join("raw_data/iwr1843/HuPR");
    write_captures(&raw.join("single_14"), &captures);
    let (processed, dataset) = (open(&cubes), open(&raw));
    let info = dataset.info();
    assert_eq!((info.layout.word(), dataset.len(), dataset.frame_name(1)), ("hupr", 2, "single_14/000000001"));
    assert!(info.assumptions.iter().any(|text| text.contains("inferred")), "{:?}", info.assumptions);
    assert!(
        info.notes.iter().any(|note| note.contains("0 are of HuPR's training, 1 of validation")),
        "{:?}",
        info.notes
    );
    assert_eq!(*info.views, *open(&raw.join("single_14")).info().views);
    // Who was recorded is not published: a file beside the sequences says it.
    assert_eq!(dataset.load(0).unwrap().global_id.as_deref(), Some("validation split"));
    std::fs::write(raw.join("subjects.csv"), "sequence,subject\nsingle_14,anna\n").unwrap();
    assert_eq!(open(&raw).load(0).unwrap().global_id.as_deref(), Some("subject anna, validation split"));
    assert!(dataset.has_samples() && dataset.stages(1).unwrap().is_some_and(|stages| stages.limits.len() == 3));
    for frame in 0..2 {
        let (made, stored) = (dataset.load(frame).unwrap(), processed.load(frame).unwrap());
        for (made, stored) in made.maps.iter().zip(&stored.maps) {
            assert_eq!(made.shape, stored.shape);
            let top = stored.data.iter().copied().fold(0.0, f64::max);
            let worst = made.data.iter().zip(&stored.data).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-9 * top, "{worst} of {top}");
        }
    }
    // Another chirp: axes and widths follow, samples and maps stay.
    let chirp = "layout = \"hupr\"\n[capture.chirp]\nstart_ghz = 77\nslope_mhz_per_us = 30.006\nidle_us = 7\nadc_start_us = 0\n\
                 ramp_us = 65\nsamples = 256\nrate_ksps = 4400\nloops = 64\ntx = [0, 1, 2]\nrx = 4\nperiod_ms = 100\n";
    std::fs::write(raw.join("dataset.toml"), chirp).unwrap();
    let other = open(&raw);
    let far = |dataset: &Dataset| dataset.info().views[0].axes[1].lo;
    assert!((far(&other) / far(&dataset) - 2.0).abs() < 1e-6, "{} {}", far(&other), far(&dataset));
    let wide = |dataset: &Dataset| dataset.info().views[0].psf.range_m;
    assert!((wide(&other) / wide(&dataset) - 2.0).abs() < 1e-6);
    std::fs::write(raw.join("dataset.toml"), chirp.replace("loops = 64", "loops = 32")).unwrap();
    let told = Dataset::open(&raw, &Progress::new()).unwrap_err().to_string();
    assert!(told.contains("[capture.chirp]") && told.contains("64 loops"), "{told}");
    std::fs::remove_file(raw.join("dataset.toml")).unwrap();
    std::fs::remove_file(raw.join("single_14/vert/adc_data.bin")).unwrap();
    let told = Dataset::open(&raw, &Progress::new()).unwrap_err().to_string();
    assert!(told.contains("vert/adc_data.bin: no such file"), "{told}");
}

/// A target with range bin b, Doppler bin d and azimuth frequency fa lands at (d + 8, 94 − b, 31 − 64 fa), fa = ½ sin az: exactly so
/// where its tones lie on the bins, which samples of our own make do.
#[test]
fn point_targets_at_every_corner_of_the_cube_land_where_the_closed_form_says() {
    let device = Device::new(SimulatedLayout::Hupr);
    let fmcw = &device.radars[0].fmcw;
    let home = tempfile::tempdir().unwrap();
    let corners: Vec<[f64; 3]> = [31.0, 94.0]
        .into_iter()
        .flat_map(|range| [-8.0, 7.0].into_iter().flat_map(move |speed| [-32.0, 31.0].map(|sine| [range, speed, sine])))
        .collect();
    let tone = |[b, d, j]: [f64; 3]| {
        let mut data = Vec::with_capacity(64 * 12 * 256);
        for index in 0..64 {
            for channel in 0..12 {
                // Transmitters 0 and 2 are the line of eight; 1 lies above its middle four.
                let place = [0, 1, 2, 3, 2, 3, 4, 5, 4, 5, 6, 7][channel];
                for n in 0..256 {
                    let turns = b * f64::from(n) / 256.0 + d * f64::from(index) / 64.0 + j * f64::from(place) / 64.0;
                    let x = 1000.0 * Complex64::cis(std::f64::consts::TAU * turns);
                    data.push(Complex64::new(x.re.round(), x.im.round()));
                }
            }
        }
        AdcCube { loops: 64, channels: 12, samples: 256, data }
    };
    let bytes: Vec<u8> = corners.iter().flat_map(|&corner| captured(&tone(corner))).collect();
    write_captures(&home.path().join("single_1"), &[bytes.clone(), bytes]);
    let dataset = open(home.path());
    assert_eq!(dataset.len(), 8);
    for (frame, [b, d, j]) in corners.into_iter().enumerate() {
        for map in dataset.load(frame).unwrap().maps {
            let top = (0..map.data.len()).max_by(|&a, &b| map.data[a].total_cmp(&map.data[b])).unwrap();
            let found = [top / 4096, top / 64 % 64, top % 64].map(|i| i as f64);
            assert_eq!(found, [d + 8.0, 94.0 - b, 31.0 - j], "{b} {d} {j}");
            // All twelve antennas in phase, over all chirps and samples.
            assert!((map.data[top] / (1000.0 * 12.0 * 64.0 * 256.0) - 1.0).abs() < 1e-3, "{}", map.data[top]);
        }
    }
    // And of the physics itself: delays of a real scatterer, within a bin, and what the turns of the transmitters add to the angle.
    let (bin, mps) = (fmcw.unambiguous_range_m() / 256.0, fmcw.radar.wavelength_m() / (2.0 * fmcw.radar.frame_s));
    for (b, d, sine) in [(33.0, 0.0 + 2.0, 0.9), (33.0, -2.0, -0.9), (92.0, 6.0, 0.9), (92.0, -7.0, -0.9)] {
        let unit = [(1.0f64 - sine * sine).sqrt(), sine, 0.0];
        let echo = Echo::moving(unit.map(|u| u * b * bin), unit.map(|u| u * d * mps), 1.0);
        let lines = vec![Complex64::ZERO; fmcw.array.channels() * fmcw.samples];
        let map = &device.maps(&[fmcw.synthesise(&lines, &[echo])], 0.0)[0];
        let top = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
        let found = [top / 4096, top / 64 % 64, top % 64].map(|i| i as f64);
        let wanted = [d + 8.0, 94.0 - b, 31.0 - 32.0 * sine];
        assert!((found[0] - wanted[0]).abs() <= 1.0 && (found[1] - wanted[1]).abs() <= 1.5, "{found:?} {wanted:?}");
        assert!((found[2] - wanted[2]).abs() <= 1.5 + d.abs() / 6.0, "{found:?} {wanted:?}");
    }
}
