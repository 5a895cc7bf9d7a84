//! The synthesiser against physics that it does not share code with.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its input has failed")]

use mhp_inspector::radar::{
    AdcCube, Axis, AxisKind, Chain, Echo, Fmcw, MimoArray, PointMotion, RadarCube, Receiver, SPEED_OF_LIGHT, Spacing,
    Window, main_lobe_sigma_bins, sine_sigma,
};
use mhp_inspector::simulate::{Device, Radar, SimulatedLayout};
use num_complex::Complex64;
use rand::{SeedableRng, rngs::StdRng};
use std::f64::consts::TAU;

/// The MMVR-like radar along y (0) or z (1).
fn radar(index: usize) -> Radar {
    Device::new(SimulatedLayout::Mmvr).radars.swap_remove(index)
}

/// Everything kept, and fine bins.
fn fine(radar: &Radar) -> Chain {
    Chain { range_fft: 1024, doppler_fft: 64, angle_fft: 128, still_share: 1.0, ..radar.chain }
}

fn frame(fmcw: &Fmcw, echoes: &[Echo]) -> AdcCube {
    fmcw.synthesise(&fmcw.loop_of(&[]), echoes)
}

fn standing(x: f64) -> [Echo; 1] {
    [Echo::still([x, 0.0, 0.0], Complex64::ONE)]
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
fn beat_signal_equals_the_textbook_formula() {
    let fmcw = radar(0).fmcw;
    let echoes = [([2.3, 0.7, -0.4], 0.8), ([6.1, -2.0, 0.9], -1.3), ([1.1, 0.2, 0.1], 0.2)]
        .map(|(position, a)| Echo::still(position, Complex64::new(a, 0.3)));
    let lines = fmcw.loop_of(&echoes);
    let (f0, slope) = (fmcw.radar.start_hz, fmcw.radar.bandwidth_hz / fmcw.radar.chirp_s);
    for (tx, rx) in [(0, 0), (1, 3), (2, 7)] {
        // 3 transmitters 8 · 1.9 mm apart, 8 receivers 1.9 mm apart, both about the origin.
        let (y_tx, y_rx) = ((tx as f64 - 1.0) * 8.0 * 0.0019, (rx as f64 - 3.5) * 0.0019);
        let (mut worst, mut strongest) = (0.0f64, 0.0f64);
        for n in 0..256 {
            let t = n as f64 * fmcw.radar.chirp_s / 256.0;
            let exact: Complex64 = echoes
                .iter()
                .map(|echo| {
                    let [x, y, z] = echo.out.position;
                    let from = |y0: f64| (x * x + (y - y0).powi(2) + z * z).sqrt();
                    let (out, back, d) = (from(y_tx), from(y_rx), from(0.0));
                    let tau = (out + back) / SPEED_OF_LIGHT;
                    let cycles = f0 * tau + slope * tau * t - 0.5 * slope * tau * tau;
                    echo.reflectivity * (x / d / (out * back)) * Complex64::cis(TAU * cycles)
                })
                .sum();
            worst = worst.max((lines[(tx * 8 + rx) * 256 + n] - exact).norm());
            strongest = strongest.max(exact.norm());
        }
        assert!(worst < 3e-6 * strongest, "{tx} {rx}: {worst} of {strongest}");
    }
}

#[test]
fn point_targets_peak_at_their_range_angle_and_speed() {
    for index in [0, 1] {
        let radar = radar(index);
        let (fmcw, chain) = (&radar.fmcw, fine(&radar));
        let bin_mps = fmcw.radar.wavelength_m() / (2.0 * fmcw.radar.frame_s);
        for (range, degrees, speed) in [(3.017, 40.0f64, 1.3), (4.402, -40.0, -2.1), (2.0, 0.0, 0.0), (7.77, 15.0, 3.6)]
        {
            let (sin, cos) = degrees.to_radians().sin_cos();
            // Out of the array's own plane as well: it measures the cone angle.
            let across = 0.3 * cos;
            let ahead = (cos * cos - across * across).sqrt();
            let unit = if index == 0 { [ahead, sin, across] } else { [ahead, across, sin] };
            let echo = Echo::moving(unit.map(|u| u * range), unit.map(|u| u * speed), 1.0);
            let (r, v, s, _) = peak(&chain.cube(fmcw, radar.spacing_m, &frame(fmcw, &[echo])));
            let error = (r - range).abs() / fmcw.radar.range_resolution_m();
            assert!(error < 0.1, "{index} {range} m: {r}");
            assert!((s.asin().to_degrees() - degrees).abs() < 0.2, "{index} {degrees}°: {}", s.asin().to_degrees());
            assert!((v - speed).abs() < 0.1 * bin_mps, "{index} {speed} m/s: {v}, bins of {bin_mps}");
        }
    }
}

#[test]
fn the_phase_between_the_transmitters_turns_is_taken_out() {
    let radar = radar(0);
    let chain = fine(&radar);
    let echo = Echo::moving([3.0, 0.0, 0.0], [2.4, 0.0, 0.0], 1.0);
    let adc = frame(&radar.fmcw, &[echo]);
    let (_, _, sine, compensated) = peak(&chain.cube(&radar.fmcw, radar.spacing_m, &adc));
    assert!(sine.asin().to_degrees().abs() < 0.1, "{sine}");
    // Processed as if all had sent at once: the later transmitters' channels are out of phase, the peak falls and moves.
    let mut blind = radar.fmcw.clone();
    blind.array.rx = (0..24).map(|_| [0.0; 3]).collect();
    blind.array.tx.truncate(1);
    let (_, _, moved, level) = peak(&chain.cube(&blind, radar.spacing_m, &adc));
    assert!(level < 0.98 * compensated && moved.asin().to_degrees().abs() > 1.0, "{moved} {level} {compensated}");
    // And one transmitter alone needs no compensation: 24 receivers give the same angle.
    let single = Fmcw { array: MimoArray::line([0.0, 1.0, 0.0], 1, 24, radar.spacing_m), ..radar.fmcw.clone() };
    let (_, _, sine, _) = peak(&chain.cube(&single, radar.spacing_m, &frame(&single, &[echo])));
    assert!(sine.asin().to_degrees().abs() < 0.1, "{sine}");
}

#[test]
fn power_falls_with_the_fourth_power_of_range() {
    let radar = radar(0);
    let fmcw = &radar.fmcw;
    let at = |x: f64| peak(&fine(&radar).cube(fmcw, radar.spacing_m, &frame(fmcw, &standing(x)))).3;
    // Both ranges at the middle of a range bin, so that no scalloping enters.
    let bin = fmcw.unambiguous_range_m() / 1024.0;
    let (near, far) = (bin * 160.0, bin * 480.0);
    let exponent = 2.0 * (at(near) / at(far)).ln() / (far / near).ln();
    assert!((exponent - 4.0).abs() < 0.01, "{exponent}");
}

#[test]
fn main_lobes_have_the_textbook_half_power_widths() {
    // Full widths at half power in bins, Harris 1978, table 1; rounded there to two decimals.
    for (window, expected) in
        [(Window::Rectangular, 0.8859), (Window::Hann, 1.4406), (Window::Hamming, 1.3008), (Window::Blackman, 1.6439)]
    {
        let n = 256;
        let half = (1..40_000).map(|i| f64::from(i) * 1e-4).find(|&b| window.response(n, b).powi(2) < 0.5).unwrap();
        assert!((2.0 * half / expected - 1.0).abs() < 0.02, "{window:?}: {}", 2.0 * half);
        // The range FFT of a synthesised point shows that lobe.
        let radar = radar(0);
        let chain = Chain { range_window: window, range_fft: 16384, doppler_fft: 32, max_range_m: 3.4, ..fine(&radar) };
        let fmcw = Fmcw { loops: 1, array: MimoArray::line([0.0, 1.0, 0.0], 1, 1, 0.0019), ..radar.fmcw };
        let spectrum = chain.range_doppler(&fmcw, &frame(&fmcw, &standing(3.0)));
        let profile: Vec<f64> =
            spectrum.data.chunks_exact(spectrum.dopplers).map(|x| x[spectrum.dopplers / 2].norm()).collect();
        let top = profile.iter().copied().fold(0.0, f64::max);
        let above = profile.iter().filter(|&&a| a > top / 2f64.sqrt()).count() as f64;
        let width_bins = above * spectrum.range_step_m / fmcw.radar.range_resolution_m();
        assert!((width_bins / (2.0 * half) - 1.0).abs() < 0.02, "{window:?}: {width_bins}");
    }
}

/// Standard deviation of the unit-peak Gaussian nearest to a sampled lobe, by trying them.
fn measured_sigma(lobe: &[(f64, f64)]) -> f64 {
    let misfit =
        |sigma: f64| lobe.iter().map(|(x, a)| (a - (-x * x / (2.0 * sigma * sigma)).exp()).powi(2)).sum::<f64>();
    (1..4000).map(|i| f64::from(i) * 1e-4).min_by(|&a, &b| misfit(a).total_cmp(&misfit(b))).unwrap()
}

#[test]
fn manifest_widths_are_those_of_a_blob_in_the_cartesian_map() {
    let device = Device::new(SimulatedLayout::Mmvr);
    for (index, (radar, view)) in device.radars.iter().zip(&device.views).enumerate() {
        let [depth, lateral] = &view.axes[..] else { unreachable!("two axes") };
        // A cell's own centre on boresight, so that rows are range and columns are range · sine.
        let (row, column) = (160, lateral.bin(0.0).round() as usize);
        let (d, l) = (depth.at(row as f64), lateral.at(column as f64));
        let point = if index == 0 { [d, l, 0.0] } else { [d, 0.0, l] };
        let adc = frame(&radar.fmcw, &[Echo::still(point, Complex64::ONE)]);
        let chain = Chain { range_fft: 1024, angle_fft: 256, ..fine(radar) };
        let map = chain.polar(&radar.fmcw, radar.spacing_m, &adc).cartesian(depth, lateral);
        let top = map[row * lateral.bins + column];
        let sine_sigma = view.psf.azimuth_rad.max(view.psf.elevation_rad);
        // Sampled from the first minimum to the other, at the map's own cells.
        let lobe = |step: f64, null: f64, at: &dyn Fn(i64) -> f64| -> Vec<(f64, f64)> {
            let reach = (null / step.abs()) as i64;
            (-reach..=reach).map(|i| (i as f64 * step, at(i) / top)).collect()
        };
        let null_range = 2.0078 * radar.fmcw.radar.range_resolution_m();
        let along = lobe(depth.step(), null_range, &|i| map[(row as i64 + i) as usize * lateral.bins + column]);
        let null_sine = 1.46496 * radar.fmcw.radar.wavelength_m() / (24.0 * 0.0019);
        let across = lobe(lateral.step(), null_sine * d, &|i| map[row * lateral.bins + (column as i64 + i) as usize]);
        let (range_m, width_m) = (measured_sigma(&along), measured_sigma(&across));
        assert!((range_m / view.psf.range_m - 1.0).abs() < 0.02, "{index}: {range_m} against {}", view.psf.range_m);
        assert!((width_m / (d * sine_sigma) - 1.0).abs() < 0.02, "{index}: {width_m} against {}", d * sine_sigma);
    }
    assert!((main_lobe_sigma_bins(Window::Hann, 256) - 0.825).abs() < 1e-3);
    assert!(sine_sigma(Window::Rectangular, 8, 0.0019, 0.0038) > 0.1);
}

#[test]
fn cartesian_maps_put_a_point_at_its_own_depth() {
    let device = Device::new(SimulatedLayout::Mmvr);
    let echo = Echo::moving([2.4, 0.6, -0.9], [1.5, 0.0, 0.0], 1.0);
    let cubes: Vec<AdcCube> = device.radars.iter().map(|radar| frame(&radar.fmcw, &[echo])).collect();
    let maps = device.maps(&cubes, 0.3);
    for (k, (depth_m, lateral_m)) in
        [((2.4f64.powi(2) + 0.81).sqrt(), 0.6), ((2.4f64.powi(2) + 0.36).sqrt(), -0.9)].into_iter().enumerate()
    {
        let (map, [depth, lateral]) = (&maps[k], &device.views[k].axes[..]) else { unreachable!("two axes") };
        let top = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
        let (d, l) = (depth.at((top / lateral.bins) as f64), lateral.at((top % lateral.bins) as f64));
        assert!((d - depth_m).abs() < 0.04 && (l - lateral_m).abs() < 0.04, "{k}: {d} {l}");
    }
}

#[test]
fn what_stands_still_is_attenuated_by_the_stated_share() {
    let radar = radar(0);
    let adc = radar.fmcw.synthesise(&radar.fmcw.loop_of(&standing(3.0)), &[]);
    let top = |still_share| {
        let chain = Chain { still_share, ..radar.chain };
        chain.polar(&radar.fmcw, radar.spacing_m, &adc).data.iter().copied().fold(0.0, f64::max)
    };
    assert!((top(0.3) / top(1.0) - 0.3).abs() < 1e-9);
    assert!(top(0.0) / top(1.0) < 1e-9);
}

#[test]
fn an_echo_by_way_of_a_wall_lies_at_the_mean_of_the_two_ranges() {
    let radar = radar(0);
    let chain = Chain { max_range_m: 8.0, ..fine(&radar) };
    let point = PointMotion::still([3.0, 0.5, 0.0]);
    let image = PointMotion::still([3.0, 2.0 * 2.2 - 0.5, 0.0]);
    let (direct, mirrored) = (3f64.hypot(0.5), 3f64.hypot(3.9));
    for (out, back, range) in [(point, image, f64::midpoint(direct, mirrored)), (image, image, mirrored)] {
        let adc = frame(&radar.fmcw, &[Echo { out, back, reflectivity: Complex64::ONE }]);
        let spectrum = chain.range_doppler(&radar.fmcw, &adc);
        let profile = spectrum.amplitudes();
        let at = |r: usize| profile[r * spectrum.dopplers + spectrum.dopplers / 2];
        let top = (0..spectrum.ranges).max_by(|&a, &b| at(a).total_cmp(&at(b))).unwrap();
        assert!((top as f64 * spectrum.range_step_m - range).abs() < 0.01, "{range}: {top}");
    }
}

#[test]
fn hupr_cubes_put_a_point_where_the_closed_form_says() {
    let device = Device::new(SimulatedLayout::Hupr);
    let Radar { fmcw, .. } = &device.radars[0];
    let bin = fmcw.unambiguous_range_m() / 256.0;
    let mps = fmcw.radar.wavelength_m() / (2.0 * fmcw.radar.frame_s);
    for (b, d, sine) in [(60.0, 3.0, 0.25), (40.0, -5.0, -0.5), (88.0, 1.0, 0.0)] {
        let (range, speed) = (b * bin, d * mps);
        let unit = [(1.0f64 - sine * sine).sqrt(), sine, 0.0];
        let echo = Echo::moving(unit.map(|u| u * range), unit.map(|u| u * speed), 1.0);
        let map = &device.maps(&[frame(fmcw, &[echo])], 0.0)[0];
        let top = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
        let found = [top / 4096, top / 64 % 64, top % 64].map(|i| i as f64);
        // Between the transmitters' turns the Doppler phase is left in, 4 elements a 2/3 of a
        // turn apart: d/6 bins of angle.
        let wanted = [d + 8.0, 94.0 - b, 31.0 - 32.0 * sine];
        assert!((found[0] - wanted[0]).abs() < 1.0 && (found[1] - wanted[1]).abs() <= 1.0, "{found:?} {wanted:?}");
        assert!((found[2] - wanted[2]).abs() <= 1.0 + d.abs() / 6.0, "{found:?} {wanted:?}");
        let views: Vec<&Axis> = device.views[0].axes.iter().collect();
        assert!((views[0].at(found[0]) - speed).abs() < mps && (views[1].at(found[1]) - range).abs() < 1.5 * bin);
    }
}

#[test]
fn the_axes_of_every_layout_tell_where_a_point_is() {
    let point = [2.6f64, 0.5, 0.35];
    let range = point.iter().map(|x| x * x).sum::<f64>().sqrt();
    for layout in SimulatedLayout::ALL {
        let device = Device::new(layout);
        let echo = Echo::moving(point, point.map(|x| x * 0.6 / range), 1.0);
        let cubes: Vec<AdcCube> = device.radars.iter().map(|radar| frame(&radar.fmcw, &[echo])).collect();
        for (map, view) in device.maps(&cubes, 1.0).iter().zip(&device.views) {
            assert_eq!(map.len(), view.cells(), "{layout:?} {}", view.array);
            let top = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
            let mut rest = top;
            for axis in view.axes.iter().rev() {
                let bin = (rest % axis.bins) as f64;
                rest /= axis.bins;
                let (found, wanted) = match axis.kind {
                    AxisKind::Doppler => (axis.at(bin), 0.6),
                    _ => (axis.at(bin), axis.coordinate(point)),
                };
                // HuPR leaves the Doppler phase between the turns in its angles.
                let cells = if layout == SimulatedLayout::Hupr { 4.0 } else { 1.5 };
                assert!((found - wanted).abs() < cells * axis.step().abs(), "{layout:?} {axis:?}: {found} {wanted}");
                assert!(axis.spacing == Spacing::Linear || axis.kind.is_angular());
            }
        }
    }
}

#[test]
fn quantisation_noise_is_a_twelfth_of_a_step_squared() {
    let fmcw = Fmcw { loops: 4, ..radar(0).fmcw };
    let exact = frame(&fmcw, &standing(2.0));
    for bits in [12, 14, 16] {
        let mut adc = exact.clone();
        let receiver = Receiver { noise: 0.0, full_scale: 0.5, bits };
        assert_eq!(adc.digitise(&receiver, &mut StdRng::seed_from_u64(1)), 0);
        let step = 0.5 / 2f64.powi(bits as i32 - 1);
        let errors = adc.data.iter().zip(&exact.data).map(|(x, e)| (x * step - e).norm_sqr());
        let power = errors.sum::<f64>() / exact.data.len() as f64;
        assert!((power / (step * step / 6.0) - 1.0).abs() < 0.03, "{bits} bits: {power}");
    }
}

#[test]
fn the_converter_rounds_clips_and_adds_noise() {
    let cube =
        |value: f64| AdcCube { loops: 1, channels: 1, samples: 4000, data: vec![Complex64::new(value, -value); 4000] };
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
