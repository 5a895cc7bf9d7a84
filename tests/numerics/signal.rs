//! The closed form of H_sim against the signals themselves: samples, chirps and antennas through windowed FFTs.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::{FitConfig, LobeShape, Summation};
use mhp_inspector::geometry::Pose;
use mhp_inspector::mhp::{CellValue, Precision, Problem, simulate, simulate_signal};
use mhp_inspector::radar::{
    Axis, AxisKind, Chain, Echo, FftSetup, Fmcw, MimoArray, Quantity, RadarConfig, Spacing, View, ViewFft, Window,
    first_null_bins,
};
use num_complex::Complex64;

const SAMPLES: usize = 128;
const CHIRPS: usize = 32;
const ELEMENTS: usize = 12;

fn radar() -> RadarConfig {
    let mut radar = RadarConfig { bandwidth_hz: 2.5e9, doppler_features: 4, ..RadarConfig::default() };
    (radar.l_az_m, radar.l_el_m) = (radar.wavelength_m() / 2.0, radar.wavelength_m() / 2.0);
    radar
}

fn fft(window: Window) -> ViewFft {
    let setup = FftSetup {
        range: (SAMPLES, window),
        doppler: (CHIRPS, window),
        azimuth: Some((ELEMENTS, window)),
        elevation: Some((ELEMENTS, window)),
    };
    ViewFft { setup, radar: radar() }
}

/// A view whose bins are those of FFTs with so much padding.
fn view(fft: &ViewFft, kinds: &[AxisKind], padding: usize) -> View {
    let axis = |&kind: &AxisKind| {
        let resolved = fft.resolved(kind).unwrap();
        let (step, spacing) =
            (resolved.natural / padding as f64, if kind.is_angular() { Spacing::Sine } else { Spacing::Linear });
        let bins = resolved.count * padding;
        let lo = if kind == AxisKind::Range { 0.0 } else { -((bins / 2) as f64) * step };
        Axis { kind, bins, lo, hi: lo + bins as f64 * step, spacing }
    };
    let axes: Vec<Axis> = kinds.iter().map(axis).collect();
    let fft = fft.for_axes(kinds.iter().copied());
    let (array, quantity, pose) = ("map".into(), Quantity::Amplitude, Pose::default());
    View { array, quantity, psf: fft.point_spread(), pose, axes, region: None }
}

fn problem(view: &View, joints: usize) -> Problem {
    let skeleton = Skeleton {
        joints: (0..joints).map(|k| format!("joint {k}")).collect(),
        bones: vec![],
        bone_lengths_m: vec![],
        angles: vec![],
    };
    let map = vec![1.0; view.cells()];
    Problem::new(radar(), skeleton, vec![view.clone()], &[&map]).unwrap()
}

/// Joints at rest or not, all alike but for their place.
fn joints(places: &[[f64; 3]], velocity: [f64; 3], scale_m: f64) -> Pppr {
    let shape = PpprShape { persons: 1, joints: places.len(), doppler_features: 4 };
    let mut params = Pppr::zeros(shape);
    for (k, place) in places.iter().enumerate() {
        params.set_vec3(Group::Position, k, *place);
        params.set_vec3(Group::LogScale, k, [scale_m.ln(); 3]);
        params.set_vec3(Group::Velocity, k, velocity);
        params.joint_mut(Group::Rotation, k)[0] = 1.0;
    }
    params
}

fn at(range: f64, degrees: f64) -> [f64; 3] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [range * cos, range * sin, 0.0]
}

/// Places of the strongest cell, refined along each axis by the parabola through the logarithms of three cells, which is exact for a
/// Gaussian.
fn peak(map: &[f64], shape: &[usize]) -> (Vec<f64>, f64) {
    refined_peak(map, shape, |_, [l, m, h]| {
        let [l, m, h] = [l, m, h].map(f64::ln);
        0.5 * (l - h) / (l - 2.0 * m + h)
    })
}

/// The same where each axis has the lobe of a window: the shift at which that lobe comes closest to the three cells (least squares,
/// its height free). A parabola through three cells of a sinc is up to a quarter of a bin off its peak.
fn lobe_peak(map: &[f64], view: &View, fft: &ViewFft, window: Window) -> (Vec<f64>, f64) {
    refined_peak(map, &view.shape(), |k, cells| {
        let resolved = fft.resolved(view.axes[k].kind).unwrap();
        let bins = view.axes[k].step().abs() / resolved.natural;
        let misfit = |shift: f64| {
            let lobe: Vec<f64> =
                [-1.0, 0.0, 1.0].map(|at| window.response(resolved.count, (at - shift) * bins)).to_vec();
            let gain =
                lobe.iter().zip(cells).map(|(a, b)| a * b).sum::<f64>() / lobe.iter().map(|a| a * a).sum::<f64>();
            lobe.iter().zip(cells).map(|(a, b)| (gain * a - b).powi(2)).sum::<f64>()
        };
        let (mut lo, mut hi) = (-0.6, 0.6);
        for _ in 0..40 {
            let (a, b) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
            if misfit(a) < misfit(b) { hi = b } else { lo = a }
        }
        f64::midpoint(lo, hi)
    })
}

/// The same of the strongest cell and the stronger one beside it: the shift at which the lobe's values there have their ratio.
fn ratio_peak(map: &[f64], view: &View, fft: &ViewFft, window: Window) -> Vec<f64> {
    let of_axis = |k: usize, [l, m, h]: [f64; 3]| {
        let resolved = fft.resolved(view.axes[k].kind).unwrap();
        let bins = view.axes[k].step().abs() / resolved.natural;
        let (side, beside) = if h > l { (1.0, h) } else { (-1.0, l) };
        let ratio = |shift: f64| {
            window.response(resolved.count, (1.0 - shift) * bins) / window.response(resolved.count, shift * bins)
        };
        let (mut lo, mut hi) = (0.0, 0.6);
        for _ in 0..50 {
            let middle = f64::midpoint(lo, hi);
            if ratio(middle) < beside / m { lo = middle } else { hi = middle }
        }
        side * f64::midpoint(lo, hi)
    };
    refined_peak(map, &view.shape(), of_axis).0
}

/// The strongest cell, along each axis with the shift that `refine` sees in it and its neighbours.
fn refined_peak(map: &[f64], shape: &[usize], refine: impl Fn(usize, [f64; 3]) -> f64) -> (Vec<f64>, f64) {
    let top = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
    let mut places = Vec::new();
    let mut stride = map.len();
    for (k, &size) in shape.iter().enumerate() {
        stride /= size;
        let bin = top / stride % size;
        let value = |k: i64| {
            let to = (bin as i64 + k).rem_euclid(size as i64) as usize;
            map[top - bin * stride + to * stride]
        };
        places.push(bin as f64 + refine(k, [-1, 0, 1].map(value)));
    }
    (places, map[top])
}

/// Closed form and signals of a joint.
struct Compared {
    /// Largest difference over the lobe down to its first minimum, over that down to −10 dB, and to half power; of the peak.
    whole: f64,
    tenth: f64,
    half: f64,
    /// Root of the mean square over the whole lobe.
    rms: f64,
    /// Level below the peak, dB, above which no cell of the lobe differs by more than 3 % of the peak; infinite where none does.
    within: f64,
    /// Largest difference of the peak's place along an axis, bins.
    place: f64,
    /// Of the peaks' values.
    peak: f64,
}

fn compare(kinds: &[AxisKind], window: Window, padding: usize, params: &Pppr, cells: CellValue) -> Compared {
    compare_with(&FitConfig::default(), kinds, window, padding, params, cells)
}

fn compare_with(
    config: &FitConfig,
    kinds: &[AxisKind],
    window: Window,
    padding: usize,
    params: &Pppr,
    cells: CellValue,
) -> Compared {
    let fft = fft(window);
    let view = view(&fft, kinds, padding);
    let problem = problem(&view, params.shape().joints);
    let closed = &simulate(&problem, config, Precision::F64, params)[0];
    let signal = &simulate_signal(&problem, &[Some(fft.clone())], config, params, cells).unwrap()[0];
    let shape = view.shape();
    let (mut place, top) = lobe_peak(signal, &view, &fft, window);
    let (mut wanted, level) = peak(closed, &shape);
    if config.lobe == LobeShape::Window && padding == 1 {
        // The third cell may lie beyond the first minimum, where neither says anything of the peak.
        [place, wanted] = [signal, closed].map(|map| ratio_peak(map, &view, &fft, window));
    }
    let joint = view.bins_of_moving(params.position(0), params.velocity(0));
    // The lobe of the window, wider where the joint itself is wide.
    let reach: Vec<f64> = view
        .axes
        .iter()
        .map(|axis| {
            let resolved = fft.resolved(axis.kind).unwrap();
            first_null_bins(window, resolved.count) * padding as f64
        })
        .collect();
    let (mut whole, mut tenth, mut half, mut sum, mut count) = (0.0f64, 0.0f64, 0.0f64, 0.0, 0.0);
    let mut within = f64::INFINITY;
    for (cell, (c, s)) in closed.iter().zip(signal).enumerate() {
        let mut stride = closed.len();
        let inside = shape.iter().enumerate().all(|(k, &size)| {
            stride /= size;
            let bin = (cell / stride % size) as f64;
            (bin - joint[k]).abs() <= reach[k]
        });
        if inside {
            let difference = (c - s).abs() / top;
            whole = whole.max(difference);
            sum += difference * difference;
            count += 1.0;
            if difference > 0.03 {
                within = within.min(-20.0 * (s / top).log10());
            }
            if s / top > 0.1f64.sqrt() {
                tenth = tenth.max(difference);
            }
            if s / top > 0.5f64.sqrt() {
                half = half.max(difference);
            }
        }
    }
    let place = place.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let (rms, peak) = ((sum / f64::max(count, 1.0)).sqrt(), (level / top - 1.0).abs());
    Compared { whole, tenth, half, rms, within, place, peak }
}

/// Windows with what is accepted at padding 1 and from padding 2 on: largest difference to half power, down to −10 dB, and over the
/// whole lobe to its first minimum, % of the peak; and the level below the peak, dB, down to which 3 % hold. What the Gaussian of SPEC
/// section 3 can do is measured here, not wished: its tail is higher than a window's near the minimum, most so for the rectangular
/// one, and at padding 1 the closed form's I/12 widens it.
const BOUNDS: [(Window, [f64; 4], [f64; 4]); 4] = [
    (Window::Hann, [1.0, 4.5, 7.5, 9.5], [3.0, 3.6, 5.8, 3.2]),
    (Window::Hamming, [2.5, 4.7, 7.5, 6.2], [2.2, 2.6, 4.0, 20.0]),
    (Window::Blackman, [1.0, 3.4, 4.0, 9.5], [1.9, 2.3, 2.8, 60.0]),
    // Unpadded, the peak itself is 8 % off.
    (Window::Rectangular, [13.0, 15.0, 24.0, -1.0], [5.2, 6.0, 15.0, 0.5]),
];

/// SPEC section 3's closed form against the path it stands for: point targets off the bins' centres, up to 50° off boresight.
#[test]
fn the_closed_form_has_the_main_lobe_of_the_signals() {
    println!("maps of range and angle, and of range and speed; point targets at −50 to 50°, off the bins' centres");
    println!(
        "window       padding  cells   to half power  to -10 dB  whole lobe  rms of it  3 % hold to, dB  peak value  peak place, bins"
    );
    let places = [(2.013, 0.0), (3.377, 17.3), (2.741, -33.0), (4.158, 50.0), (3.02, -50.0)];
    for (window, first, other) in BOUNDS {
        for padding in 1..=4 {
            for cells in [CellValue::Centre, CellValue::Mean] {
                let (mut most, mut place, mut within) = ([0.0f64; 5], 0.0f64, f64::INFINITY);
                for kinds in [[AxisKind::Range, AxisKind::Cone], [AxisKind::Range, AxisKind::Doppler]] {
                    for (range, degrees) in places {
                        let target = at(range, degrees);
                        let params = joints(&[target], target.map(|x| x / range * 0.83), 1e-4);
                        let c = compare(&kinds, window, padding, &params, cells);
                        for (most, x) in most.iter_mut().zip([c.half, c.tenth, c.whole, c.rms, c.peak]) {
                            *most = most.max(100.0 * x);
                        }
                        within = within.min(c.within);
                        place = place.max(c.place);
                    }
                }
                let [half, tenth, whole, rms, peak] = most;
                println!(
                    "{:12} {padding:7}  {cells:6?}  {half:11.2} %  {tenth:7.2} %  {whole:8.2} %  {rms:7.2} %  {within:15.1}  \
                     {peak:8.2} %  {place:16.3}",
                    window.name()
                );
                // The estimator of a blurred lobe is not that of the lobe.
                if cells == CellValue::Centre {
                    let bounds = if padding == 1 { first } else { other };
                    let holds = half < bounds[0] && tenth < bounds[1] && whole < bounds[2] && within > bounds[3];
                    assert!(holds, "{window:?} x{padding}: {half} {tenth} {whole} {within}");
                    assert!(place < 0.1, "{window:?} x{padding}: {place}");
                }
            }
        }
    }
}

/// With `lobe = "window"` the closed form follows the signals to 3 % of the peak down to the first minimum, for every window and
/// padding, in two axes and in three, and its peak lies within 0.1 bin of theirs.
#[test]
fn the_windows_own_lobe_holds_to_3_percent_over_all_of_it() {
    let config = FitConfig { lobe: LobeShape::Window, ..FitConfig::default() };
    println!("lobe = \"window\": largest difference over the whole lobe to its first minimum, % of the peak");
    println!("window       padding  range, cone  range, Doppler  range, Doppler, cone  extent 3 cm  peak place, bins");
    let places = [(2.013, 0.0), (3.377, 17.3), (2.741, -33.0), (4.158, 50.0), (3.02, -50.0)];
    let two = [&[AxisKind::Range, AxisKind::Cone][..], &[AxisKind::Range, AxisKind::Doppler]];
    for (window, ..) in BOUNDS {
        for padding in 1..=4 {
            let (mut most, mut place) = ([0.0f64; 4], 0.0f64);
            for (range, degrees) in places {
                let target = at(range, degrees);
                let velocity = target.map(|x| x / range * 0.83);
                for (k, kinds) in two.into_iter().enumerate() {
                    let c = compare_with(
                        &config,
                        kinds,
                        window,
                        padding,
                        &joints(&[target], velocity, 1e-4),
                        CellValue::Centre,
                    );
                    (most[k], place) = (most[k].max(100.0 * c.whole), place.max(c.place));
                    let wide = joints(&[target], velocity, 0.03);
                    let c = compare_with(&config, kinds, window, padding, &wide, CellValue::Centre);
                    most[3] = most[3].max(100.0 * c.whole);
                }
            }
            if padding == 1 {
                let (target, kinds) = (at(3.377, 17.3), [AxisKind::Range, AxisKind::Doppler, AxisKind::Cone]);
                let params = joints(&[target], [0.5, 0.2, 0.0], 1e-4);
                most[2] = 100.0 * compare_with(&config, &kinds, window, padding, &params, CellValue::Centre).whole;
            }
            let [cone, doppler, three, wide] = most;
            println!(
                "{:12} {padding:7}  {cone:9.2} %  {doppler:12.2} %  {three:18.2} %  {wide:9.2} %  {place:16.3}",
                window.name()
            );
            // An extent blurs into the lobe what lies beyond its first minimum: of the rectangular window high sidelobes, which the
            // closed form has not.
            let most_wide = if window == Window::Rectangular { 6.5 } else { 1.5 };
            let holds = [cone, doppler, three].iter().all(|most| *most < 1.0) && wide < most_wide;
            assert!(holds && place < 0.1, "{window:?} x{padding}: {most:?} {place}");
        }
    }
}

/// Joints have an extent of their own, which makes their lobes rounder: the widths of a start's Gaussians.
#[test]
fn joints_with_an_extent_agree_as_points_do() {
    println!("window       padding  extent, cm  to half power, bins' centres  bins' means");
    for window in [Window::Hann, Window::Hamming, Window::Blackman] {
        for padding in [1, 2, 4] {
            for scale in [0.03, 0.06] {
                let target = at(3.377, 17.3);
                let params = joints(&[target], [0.0; 3], scale);
                let kinds = [AxisKind::Range, AxisKind::Cone];
                let of = |cells| 100.0 * compare(&kinds, window, padding, &params, cells).half;
                let (centre, mean) = (of(CellValue::Centre), of(CellValue::Mean));
                println!("{:12} {padding:7}  {:10.0}  {centre:26.2} %  {mean:9.2} %", window.name(), 100.0 * scale);
                assert!(
                    mean < 3.5 && centre < if padding == 1 { 5.5 } else { 3.5 },
                    "{window:?} x{padding}: {centre} {mean}"
                );
            }
        }
    }
}

/// A joint without extent is the window's own response along each axis, exactly; bins of no FFT's grid too.
#[test]
fn a_point_is_the_response_of_the_windows() {
    for (window, shift) in [(Window::Blackman, 0.0), (Window::Rectangular, 0.37)] {
        let fft = fft(window);
        let mut view = view(&fft, &[AxisKind::Range, AxisKind::Cone], 2);
        // Off the grid, falling, and stretched: a plain transform, bin by bin.
        if shift > 0.0 {
            let axis = &mut view.axes[0];
            (axis.lo, axis.hi, axis.bins) = (3.9, 1.1, 53);
            view.axes[1].lo += shift * view.axes[1].step();
            view.axes[1].hi += shift * view.axes[1].step();
        }
        let (problem, config) = (problem(&view, 1), FitConfig::default());
        let target = at(2.417, 21.0);
        let params = joints(&[target], [0.0; 3], 1e-6);
        let map = &simulate_signal(&problem, &[Some(fft.clone())], &config, &params, CellValue::Centre).unwrap()[0];
        let joint = view.bins_of(target);
        let response = |cell: usize| -> f64 {
            let bins = [cell / view.axes[1].bins, cell % view.axes[1].bins];
            (0..2)
                .map(|k| {
                    let resolved = fft.resolved(view.axes[k].kind).unwrap();
                    let natural = view.axes[k].step().abs() / resolved.natural;
                    window.response(resolved.count, (bins[k] as f64 - joint[k]) * natural)
                })
                .product()
        };
        let best = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
        let top = map[best] / response(best);
        let worst = (0..map.len()).map(|cell| (map[cell] / top - response(cell)).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-5, "{window:?}: {worst}");
    }
}

/// Two joints in one lobe add with their phases: where the closed form has them out of phase, so have the signals.
#[test]
fn joints_add_with_their_phases() {
    let fft = fft(Window::Blackman);
    let view = view(&fft, &[AxisKind::Range, AxisKind::Cone], 3);
    let problem = problem(&view, 2);
    for apart in [0.011, 0.023, 0.037] {
        let params = joints(&[at(3.0, 9.0), at(3.0 + apart, 10.5)], [0.4, 0.1, 0.0], 0.02);
        for summation in [Summation::Coherent, Summation::Incoherent] {
            let config = FitConfig { summation, ..FitConfig::default() };
            let closed = &simulate(&problem, &config, Precision::F64, &params)[0];
            let signal =
                &simulate_signal(&problem, &[Some(fft.clone())], &config, &params, CellValue::Centre).unwrap()[0];
            let alone = joints(&[at(3.0, 9.0), at(30.0, 0.0)], [0.4, 0.1, 0.0], 0.02);
            let one = simulate(&problem, &config, Precision::F64, &alone)[0].iter().copied().fold(0.0, f64::max);
            let worst = closed.iter().zip(signal).map(|(c, s)| (c - s).abs()).fold(0.0, f64::max);
            assert!(worst < 0.06 * one, "{apart} {summation:?}: {} of one joint's peak", worst / one);
        }
    }
}

/// The radar itself, sample by sample, has the lobe of the signal path: the array's own place, curvature of wavefronts and all.
#[test]
fn the_radar_has_the_lobe_of_the_signals() {
    let (fft, range) = (fft(Window::Hann), 3.377);
    let view = view(&fft, &[AxisKind::Range, AxisKind::Cone], 2);
    let fmcw = Fmcw {
        radar: radar(),
        samples: SAMPLES,
        loops: 1,
        array: MimoArray::line([0.0, 1.0, 0.0], 1, ELEMENTS, radar().l_az_m),
    };
    let chain = Chain {
        range_window: Window::Hann,
        range_fft: 2 * SAMPLES,
        doppler_window: Window::Rectangular,
        doppler_fft: 1,
        angle_window: Window::Hann,
        angle_fft: 2 * ELEMENTS,
        still_share: 1.0,
        max_range_m: 1e3,
    };
    for degrees in [0.0, -33.0, 50.0] {
        let target = at(range, degrees);
        let adc = fmcw.synthesise(&fmcw.loop_of(&[Echo::still(target, Complex64::ONE)]), &[]);
        let polar = chain.polar(&fmcw, radar().l_az_m, &adc);
        let params = joints(&[target], [0.0; 3], 1e-5);
        let problem = problem(&view, 1);
        let config = FitConfig::default();
        let signal = &simulate_signal(&problem, &[Some(fft.clone())], &config, &params, CellValue::Centre).unwrap()[0];
        assert_eq!(polar.data.len(), signal.len());
        let [most, top] = [&polar.data, signal].map(|map| map.iter().copied().fold(0.0, f64::max));
        let worst = polar.data.iter().zip(signal).map(|(a, b)| (a / most - b / top).abs()).fold(0.0, f64::max);
        assert!(worst < 0.02, "{degrees}°: {worst}");
    }
}

/// Cartesian cells and even steps of angle are read from range and sines: the joint is where the view has it.
#[test]
fn resampled_views_have_the_joint_in_its_cell() {
    let fft = fft(Window::Hann);
    let linear = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
    let target = [2.6, 0.7, -0.5];
    for axes in [
        vec![linear(AxisKind::DepthH, 96, 5.0, 1.0), linear(AxisKind::Y, 64, 2.0, -2.0)],
        vec![linear(AxisKind::DepthV, 96, 5.0, 1.0), linear(AxisKind::Z, 64, -2.0, 2.0)],
        vec![linear(AxisKind::Range, 96, 1.0, 5.0), linear(AxisKind::Azimuth, 64, 1.0, -1.0)],
        vec![linear(AxisKind::X, 40, 1.0, 5.0), linear(AxisKind::Y, 24, 1.5, -1.5), linear(AxisKind::Z, 24, -1.5, 1.5)],
    ] {
        let of = fft.for_axes(axes.iter().map(|axis| axis.kind));
        let (array, quantity, pose) = ("map".into(), Quantity::Amplitude, Pose::default());
        let view = View { array, quantity, psf: of.point_spread(), pose, axes, region: None };
        let params = joints(&[target], [0.0; 3], 0.03);
        let (problem, config) = (problem(&view, 1), FitConfig::default());
        let closed = &simulate(&problem, &config, Precision::F64, &params)[0];
        let signal = &simulate_signal(&problem, &[Some(of)], &config, &params, CellValue::Centre).unwrap()[0];
        let shape = view.shape();
        let ((place, top), (_, level)) = (peak(signal, &shape), peak(closed, &shape));
        let joint = view.bins_of(target);
        let off = place.iter().zip(&joint).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let kinds: Vec<&str> = view.axes.iter().map(|axis| axis.kind.name()).collect();
        println!("{kinds:?}: {off:.3} cells off, peak {:+.1} %", 100.0 * (level / top - 1.0));
        // Lobes are arcs some cells long and less than two deep: their highest cell may lie beside the joint's.
        assert!(off < 1.5 && (level / top - 1.0).abs() < 0.1, "{kinds:?}: {off} {}", level / top);
    }
}

/// A view whose FFTs nobody told cannot be simulated so; said with its name.
#[test]
fn a_view_without_its_ffts_is_refused() {
    let view = view(&fft(Window::Hann), &[AxisKind::Range, AxisKind::Cone], 1);
    let params = joints(&[at(3.0, 0.0)], [0.0; 3], 0.05);
    let told = simulate_signal(&problem(&view, 1), &[None], &FitConfig::default(), &params, CellValue::Centre);
    assert!(told.unwrap_err().to_string().contains("view `map`: its FFT configuration is not known"));
}
