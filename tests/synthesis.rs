//! The synthesiser against physics that it does not share code with, and the committed sample against its own truth.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its input has failed")]

use mhp_inspector::cli::sample::{CHAIN, Plane, Scene, write_data_set};
use mhp_inspector::radar::{
    AdcCube, Chain, Fmcw, RadarCube, Receiver, SPEED_OF_LIGHT, Scatterer, Window, main_lobe_sigma_bins, moving_point,
};
use num_complex::Complex64;
use rand::{SeedableRng, rngs::StdRng};
use std::f64::consts::TAU;
use std::path::PathBuf;

/// The sample's chain with everything kept, for the short frames below.
const FINE: Chain = Chain { range_fft: 1024, doppler_fft: 64, angle_fft: 128, still_share: 1.0, ..CHAIN };

fn short(plane: Plane) -> Fmcw {
    let fmcw = plane.fmcw();
    let interval = fmcw.chirp_interval_s();
    let mut short = Fmcw { chirps: 16, ..fmcw };
    short.radar.frame_s = 16.0 * interval;
    short
}

/// (range m, speed m/s, sine, amplitude) of the strongest cell, refined by a parabola through the logarithms along each axis.
fn peak(cube: &RadarCube) -> (f64, f64, f64, f64) {
    let amplitude = |r: usize, d: usize, s: usize| cube.data[(r * cube.dopplers + d) * cube.sines + s].norm();
    let strongest =
        (0..cube.data.len()).max_by(|&a, &b| cube.data[a].norm_sqr().total_cmp(&cube.data[b].norm_sqr())).unwrap();
    let (r, rest) = (strongest / (cube.dopplers * cube.sines), strongest % (cube.dopplers * cube.sines));
    let (d, s) = (rest / cube.sines, rest % cube.sines);
    let refine = |l: f64, m: f64, h: f64| {
        let (l, m, h) = (l.ln(), m.ln(), h.ln());
        0.5 * (l - h) / (l - 2.0 * m + h)
    };
    let m = amplitude(r, d, s);
    let (dd, dn) = (cube.dopplers - 1, cube.dopplers);
    let r_at = r as f64 + refine(amplitude(r - 1, d, s), m, amplitude(r + 1, d, s));
    let d_at = d as f64 + refine(amplitude(r, (d + dd) % dn, s), m, amplitude(r, (d + 1) % dn, s));
    let s_at = s as f64 + refine(amplitude(r, d, s - 1), m, amplitude(r, d, s + 1));
    let (range, speed, sine) = cube.coordinates(r_at, d_at, s_at);
    (range, speed, sine, m)
}

#[test]
fn beat_signal_equals_the_textbook_formula_to_1e_9() {
    let fmcw = short(Plane::Horizontal);
    let scatterers = [([2.3, 0.7, -0.4], 0.8), ([6.1, -2.0, 0.9], -1.3), ([1.1, 0.2, 0.1], 0.2)]
        .map(|(position, a)| Scatterer { position, reflectivity: Complex64::new(a, 0.3) });
    let line = fmcw.chirp(&scatterers);
    let (f0, slope) = (fmcw.radar.start_hz, fmcw.radar.bandwidth_hz / fmcw.radar.chirp_s);
    for element in [0, 11, 23] {
        let e_y = (element as f64 - 11.5) * 0.0019;
        let mut strongest = 0.0f64;
        for n in 0..256 {
            let t = n as f64 * fmcw.radar.chirp_s / 256.0;
            let exact: Complex64 = scatterers
                .iter()
                .map(|s| {
                    let [x, y, z] = s.position;
                    let (tx, rx) = ((x * x + y * y + z * z).sqrt(), (x * x + (y - e_y).powi(2) + z * z).sqrt());
                    let tau = (tx + rx) / SPEED_OF_LIGHT;
                    let cycles = f0 * tau + slope * tau * t - 0.5 * slope * tau * tau;
                    s.reflectivity * (x / tx / (tx * rx)) * Complex64::cis(TAU * cycles)
                })
                .sum();
            strongest = strongest.max((line[element * 256 + n] - exact).norm() / exact.norm().max(1e-3));
        }
        assert!(strongest < 1e-9, "element {element}: {strongest}");
    }
}

#[test]
fn point_targets_peak_at_their_range_angle_and_speed() {
    for plane in [Plane::Horizontal, Plane::Vertical] {
        let fmcw = short(plane);
        for (range, degrees, speed) in [(3.017, 40.0f64, 1.3), (4.402, -40.0, -2.1), (2.0, 0.0, 0.0), (7.77, 15.0, 3.9)]
        {
            let (sin, cos) = degrees.to_radians().sin_cos();
            // Out of the array's own plane as well: it measures the cone angle.
            let across = 0.3 * cos;
            let ahead = (cos * cos - across * across).sqrt();
            let unit = if plane == Plane::Horizontal { [ahead, sin, across] } else { [ahead, across, sin] };
            let at = moving_point(unit.map(|u| u * range), unit.map(|u| u * speed), 1.0);
            let (r, v, s, _) = peak(&FINE.cube(&fmcw, &fmcw.synthesise(&[], at)));
            assert!((r - range).abs() < 0.1 * fmcw.radar.range_resolution_m(), "{plane:?} {range} m: {r}");
            assert!((s.asin().to_degrees() - degrees).abs() < 0.2, "{plane:?} {degrees}°: {}", s.asin().to_degrees());
            assert!((v - speed).abs() < 0.03, "{plane:?} {speed} m/s: {v}");
        }
    }
}

#[test]
fn power_falls_with_the_fourth_power_of_range() {
    let fmcw = short(Plane::Horizontal);
    let at = |x: f64| peak(&FINE.cube(&fmcw, &fmcw.synthesise(&[], moving_point([x, 0.0, 0.0], [0.0; 3], 1.0)))).3;
    // Both ranges at the middle of a range bin, so that no scalloping enters.
    let bin = fmcw.unambiguous_range_m() / 1024.0;
    let (near, far) = (bin * 160.0, bin * 480.0);
    let exponent = 2.0 * (at(near) / at(far)).ln() / (far / near).ln();
    assert!((exponent - 4.0).abs() < 0.01, "{exponent}");
}

#[test]
fn main_lobes_have_the_textbook_half_power_widths() {
    // Full widths at half power in bins, Harris 1978, table 1.
    for (window, expected) in
        [(Window::Rectangular, 0.89), (Window::Hann, 1.44), (Window::Hamming, 1.30), (Window::Blackman, 1.68)]
    {
        let n = 256;
        let half = (1..40_000).map(|i| f64::from(i) * 1e-4).find(|&b| window.response(n, b).powi(2) < 0.5).unwrap();
        assert!((2.0 * half / expected - 1.0).abs() < 0.03, "{window:?}: {}", 2.0 * half);
    }
    // And the range FFT shows that lobe: half the amplitude is one bin from the peak for Hann (exactly 1 for large n).
    let fmcw = short(Plane::Horizontal);
    let chain = Chain { range_fft: 8192, angle_fft: 32, doppler_fft: 16, max_range_m: 4.0, ..FINE };
    let polar = chain.polar(&fmcw, &fmcw.synthesise(&[], moving_point([3.0, 0.0, 0.0], [0.0; 3], 1.0)));
    let profile: Vec<f64> = (0..polar.ranges).map(|r| polar.data[r * polar.sines + polar.sines / 2]).collect();
    let top = profile.iter().copied().fold(0.0, f64::max);
    let above = profile.iter().filter(|&&a| a > top / 2.0).count() as f64;
    let width_bins = above * polar.range_step_m / fmcw.radar.range_resolution_m();
    assert!((width_bins / 2.0 - 1.0).abs() < 0.02, "{width_bins}");
}

/// Standard deviation of the unit-peak Gaussian nearest to a sampled lobe, by trying them.
fn measured_sigma(lobe: &[(f64, f64)]) -> f64 {
    let misfit =
        |sigma: f64| lobe.iter().map(|(x, a)| (a - (-x * x / (2.0 * sigma * sigma)).exp()).powi(2)).sum::<f64>();
    (1..4000).map(|i| f64::from(i) * 1e-4).min_by(|&a, &b| misfit(a).total_cmp(&misfit(b))).unwrap()
}

#[test]
fn manifest_widths_are_those_of_a_blob_in_the_cartesian_map() {
    for plane in Plane::ALL {
        let fmcw = Fmcw { chirps: 8, ..short(plane) };
        let [depth, lateral] = plane.axes();
        // A cell's own centre on boresight, so that rows are range and columns are range · sine.
        let (row, column) = (160, lateral.bin(0.0).round() as usize);
        let (d, l) = (depth.at(row as f64), lateral.at(column as f64));
        let point = if plane == Plane::Horizontal { [d, l, 0.0] } else { [d, 0.0, l] };
        let chain = Chain { still_share: 1.0, doppler_fft: 8, ..CHAIN };
        let adc = fmcw.synthesise(&[], moving_point(point, [0.0; 3], 1.0));
        let map = chain.polar(&fmcw, &adc).cartesian(&depth, &lateral);
        let top = map[row * lateral.bins + column];
        let psf = plane.point_spread();
        let sine_sigma = psf.azimuth_rad.max(psf.elevation_rad);
        // Sampled from the first minimum to the other, at the map's own cells.
        let lobe = |step: f64, null: f64, at: &dyn Fn(i64) -> f64| -> Vec<(f64, f64)> {
            let reach = (null / step.abs()) as i64;
            (-reach..=reach).map(|i| (i as f64 * step, at(i) / top)).collect()
        };
        let null_range = 2.0078 * fmcw.radar.range_resolution_m();
        let along = lobe(depth.step(), null_range, &|i| map[(row as i64 + i) as usize * lateral.bins + column]);
        let null_sine = 1.46496 * fmcw.radar.wavelength_m() / (24.0 * 0.0019);
        let across = lobe(lateral.step(), null_sine * d, &|i| map[row * lateral.bins + (column as i64 + i) as usize]);
        let (range_m, width_m) = (measured_sigma(&along), measured_sigma(&across));
        println!("{plane:?}: {range_m} / {}, {width_m} / {}", psf.range_m, d * sine_sigma);
        assert!((range_m / psf.range_m - 1.0).abs() < 0.02, "{plane:?}: {range_m} against {}", psf.range_m);
        assert!((width_m / (d * sine_sigma) - 1.0).abs() < 0.02, "{plane:?}: {width_m} against {}", d * sine_sigma);
    }
    assert!((main_lobe_sigma_bins(Window::Hann, 256) - 0.825).abs() < 1e-3);
}

#[test]
fn cartesian_maps_put_a_point_at_its_own_depth() {
    let point = [2.4f64, 0.6, -0.9];
    for (plane, depth_m, lateral_m) in [
        (Plane::Horizontal, (2.4f64.powi(2) + 0.9 * 0.9).sqrt(), 0.6),
        (Plane::Vertical, (2.4f64.powi(2) + 0.6 * 0.6).sqrt(), -0.9),
    ] {
        let fmcw = short(plane);
        let map = plane.map(&fmcw.synthesise(&[], moving_point(point, [1.5, 0.0, 0.0], 1.0)));
        let [depth, lateral] = plane.axes();
        let top = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
        let (d, l) = (depth.at((top / lateral.bins) as f64), lateral.at((top % lateral.bins) as f64));
        assert!((d - depth_m).abs() < 0.04 && (l - lateral_m).abs() < 0.04, "{plane:?}: {d} {l}");
    }
}

#[test]
fn what_stands_still_is_attenuated_by_the_stated_share() {
    let fmcw = short(Plane::Horizontal);
    let adc = fmcw.synthesise(&[Scatterer { position: [3.0, 0.0, 0.0], reflectivity: Complex64::ONE }], |_| vec![]);
    let top = |chain: Chain| chain.polar(&fmcw, &adc).data.iter().copied().fold(0.0, f64::max);
    let kept = top(Chain { still_share: 1.0, ..CHAIN });
    assert!((top(CHAIN) / kept - CHAIN.still_share).abs() < 1e-9);
    assert!(top(Chain { still_share: 0.0, ..CHAIN }) / kept < 1e-9);
}

#[test]
fn the_converter_rounds_clips_and_adds_noise() {
    let cube =
        |value: f64| AdcCube { chirps: 1, elements: 1, samples: 4000, data: vec![Complex64::new(value, -value); 4000] };
    let receiver = Receiver { noise: 0.0, full_scale: 1.0, bits: 12 };
    let mut quiet = cube(0.3);
    assert_eq!(quiet.digitise(&receiver, &mut StdRng::seed_from_u64(1)), 0);
    assert!(quiet.data.iter().all(|x| *x == Complex64::new(614.0, -614.0)));
    let mut loud = cube(2.0);
    assert_eq!(loud.digitise(&receiver, &mut StdRng::seed_from_u64(1)), 8000);
    assert!(loud.data.iter().all(|x| *x == Complex64::new(2047.0, -2048.0)));
    let mut noisy = cube(0.0);
    noisy.digitise(&Receiver { noise: 0.1, ..receiver }, &mut StdRng::seed_from_u64(1));
    let rms = (noisy.data.iter().map(Complex64::norm_sqr).sum::<f64>() / 8000.0).sqrt();
    assert!((rms / 204.8 - 1.0).abs() < 0.03, "{rms}");
}

#[test]
fn one_seed_gives_the_same_bytes_and_another_gives_others() {
    let folders = [(), (), ()].map(|()| tempfile::tempdir().unwrap());
    for (folder, seed) in folders.iter().zip([3, 3, 4]) {
        write_data_set(folder.path(), 1, seed, |_| ()).unwrap();
    }
    let bytes = folders.each_ref().map(|folder| std::fs::read(folder.path().join("frames/000000.npz")).unwrap());
    assert!(bytes[0] == bytes[1]);
    // Not even the time of writing: the date in the archive's first header is DOS time 0, 1980-01-01.
    assert_eq!(bytes[0][10..14], [0, 0, 33, 0]);
    assert!(bytes[0] != bytes[2]);
}

#[test]
fn nothing_clips_where_the_walker_is_nearest() {
    let scene = Scene::new(7);
    for index in [18, 19, 20] {
        assert_eq!(scene.frame(index).clipped, 0.0, "frame {index}");
    }
}

fn array<T: npyz::Deserialize>(path: &PathBuf, key: &str) -> Vec<T> {
    let mut npz = npyz::npz::NpzArchive::open(path).unwrap();
    npz.by_name(key).unwrap().unwrap().into_vec().unwrap()
}

#[test]
fn the_committed_sample_shows_its_walker_where_the_truth_says() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/samples/walk/frames"));
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 24);
    let size: u64 = paths.iter().map(|path| path.metadata().unwrap().len()).sum();
    assert!(size < 8_000_000, "{size} bytes");
    for path in &paths {
        let joints: Vec<f32> = array(path, "joints");
        let torso: [f64; 3] =
            std::array::from_fn(|k| [5, 6, 11, 12].iter().map(|j| f64::from(joints[3 * j + k])).sum::<f64>() / 4.0);
        let mut distances = vec![];
        for plane in Plane::ALL {
            let map: Vec<f32> = array(path, plane.array());
            assert!(map.iter().all(|x| x.is_finite() && *x >= 0.0));
            let [depth, lateral] = plane.axes();
            let (side, lat) = if plane == Plane::Horizontal { (torso[2], torso[1]) } else { (torso[1], torso[2]) };
            let (d0, l0) = (torso[0].hypot(side), lat);
            let cell = |i: usize| (depth.at((i / lateral.bins) as f64), lateral.at((i % lateral.bins) as f64));
            let near = |&i: &usize| (cell(i).0 - d0).abs() < 1.0 && (cell(i).1 - l0).abs() < 1.0;
            let top = (0..map.len()).filter(near).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
            distances.push((cell(top).0 - d0).hypot(cell(top).1 - l0));
        }
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        assert!(mean < 0.3, "{}: {distances:?}", path.display());
    }
}
