//! The start pose on scenes with truth: the one-person reference cases. And whatever maps, axes and radars hold that is still
//! a number: a start, a fit, a count and the evidence are finite then, or say what is wrong.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use crate::cases::Case;
use crate::reading::{case_folders, read};
use mhp_inspector::body::Skeleton;
use mhp_inspector::body::{Group, Pppr, PpprShape};
use mhp_inspector::config::{FitConfig, FramesAround, Preset, StartPlace, WarmStart};
use mhp_inspector::diagnose::{Annotated, EarlierFrame, EvidenceInput, evidence};
use mhp_inspector::geometry::{Pose, norm, sub};
use mhp_inspector::mhp::{
    FitError, Fitter, Precision, Problem, initialise, initialise_people, masks, predict, simulate,
};
use mhp_inspector::people::{Counter, Scan};
use mhp_inspector::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View};
use mhp_inspector::start::find_start;
use proptest::prelude::*;
use proptest::sample::select;
use std::sync::Arc;

fn centroid(flat: &[f64]) -> [f64; 3] {
    std::array::from_fn(|k| flat.iter().skip(k).step_by(3).sum::<f64>() / (flat.len() / 3) as f64)
}

/// Horizontal and vertical distance of the joints' centroids, m.
fn miss(found: [f64; 3], truth: [f64; 3]) -> [f64; 2] {
    [(found[0] - truth[0]).hypot(found[1] - truth[1]), (found[2] - truth[2]).abs()]
}

#[test]
fn finds_the_person_of_the_reference_cases() {
    for folder in case_folders() {
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        let case = Case::open(&folder);
        let truth = read(&folder.join("frames/000000.npz"), "joints");
        let start = initialise(&Arc::new(case.problem.clone()), &case.config).unwrap();
        let expected = PpprShape { persons: 1, ..case.params.shape() };
        assert_eq!(start.params.shape(), expected);
        assert!(start.params.is_finite());
        let [across, up] = miss(centroid(start.params.group(Group::Position)), centroid(&truth));
        println!("{name}: {across:.2} m across, {up:.2} m up; {:?}", start.notes);
        // Range and Doppler switched off leave nothing to see the distance by.
        if name != "range-off-doppler-off" {
            assert!(across < 0.45 && up < 0.25, "{name}: {across:.2} m across, {up:.2} m up");
        }
    }
}

/// A wall that outshines the person in one view, and a ring of sidelobes, must not draw the start away.
#[test]
fn is_not_drawn_to_a_wall() {
    let folder = case_folders().into_iter().find(|f| f.ends_with("mmvr-size")).unwrap();
    let case = Case::open(&folder);
    let truth = centroid(&read(&folder.join("frames/000000.npz"), "joints"));
    let views = case.problem.views.clone();
    let mut maps: Vec<Vec<f64>> = (0..2).map(|view| case.problem.map(view).to_vec()).collect();
    let largest = maps[0].iter().copied().fold(0.0, f64::max);
    for (cell, value) in maps[0].iter_mut().enumerate() {
        let depth = views[0].axes[0].at((cell / 128) as f64);
        let across = views[0].axes[1].at((cell % 128) as f64);
        let range = depth.hypot(across);
        *value += 3.0 * largest * (-((range - 5.5) / 0.1).powi(2)).exp();
        *value += 0.3 * largest * (-((range - 2.4) / 0.15).powi(2)).exp();
    }
    let slices: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    let problem = Arc::new(Problem::new(case.problem.radar, case.problem.skeleton, views, &slices).unwrap());
    let start = initialise(&problem, &case.config).unwrap();
    let [across, up] = miss(centroid(start.params.group(Group::Position)), truth);
    assert!(across < 0.35 && up < 0.3, "{across:.2} m across, {up:.2} m up");
}

/// Something as tall as a person that outshines the person in both views: only the frames around tell.
#[test]
fn counting_tells_where_the_peaks_alone_are_wrong() {
    let folder = case_folders().into_iter().find(|f| f.ends_with("mmvr-size")).unwrap();
    let case = Case::open(&folder);
    let truth = centroid(&read(&folder.join("frames/000000.npz"), "joints"));
    let (views, shelf) = (case.problem.views.clone(), [truth[0] + 2.0, truth[1] + 1.0]);
    let depths = [shelf[0], shelf[0].hypot(shelf[1])];
    let maps: Vec<Vec<f64>> = (0..2)
        .map(|view| {
            let mut map = case.problem.map(view).to_vec();
            let largest = map.iter().copied().fold(0.0, f64::max);
            for (cell, value) in map.iter_mut().enumerate() {
                let [depth, beside] =
                    [views[view].axes[0].at((cell / 128) as f64), views[view].axes[1].at((cell % 128) as f64)];
                let beside = if view == 0 { (beside - shelf[1]) / 0.15 } else { (beside.abs() - 0.8).max(0.0) / 0.1 };
                *value += 3.0 * largest * (-((depth - depths[view]) / 0.12).powi(2) - beside * beside).exp();
            }
            map
        })
        .collect();
    let slices: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    let problem = Arc::new(Problem::new(case.problem.radar, case.problem.skeleton, views, &slices).unwrap());
    let config = FitConfig { place: StartPlace::Counted, ..case.config };
    let across = |params: &Pppr, place: [f64; 2]| {
        let [x, y, _] = centroid(params.group(Group::Position));
        (x - place[0]).hypot(y - place[1])
    };
    let person = [truth[0], truth[1]];
    let begun = |seeds: &[[f64; 3]]| initialise_people(&problem, &config, seeds).unwrap();
    let alone = begun(&[]);
    assert!(across(&alone.params, shelf) < 0.4, "the peaks alone show the shelf: {:?}", alone.notes);
    let counted = begun(&[truth]);
    assert!(across(&counted.params, person) < 0.45 && across(&counted.unrefined, shelf) < 0.4, "{:?}", counted.notes);
    assert!(counted.notes.iter().any(|note| note.contains("the frames around do not")), "{:?}", counted.notes);
    // What counting finds nearby is less exact than the peaks.
    let agreed = begun(&[[shelf[0] + 0.5, shelf[1], 0.0]]);
    assert_eq!(agreed.params, alone.params);
}

/// The reference case with itself as the frame before: nothing has moved.
fn twice() -> (Arc<Problem>, FitConfig) {
    let folder = case_folders().into_iter().find(|f| f.ends_with("mmvr-size")).unwrap();
    let case = Case::open(&folder);
    let mut problem = case.problem.clone();
    let maps: Vec<&[f64]> = (0..2).map(|view| case.problem.map(view)).collect();
    problem.add_neighbour(-0.1, &maps).unwrap();
    (Arc::new(problem), case.config)
}

/// Noise of positions acts on a start from the frame before as on one from the frame's own peaks.
#[test]
fn a_warm_start_is_perturbed_like_a_cold_one() {
    let (problem, plain) = twice();
    let before = initialise(&problem, &plain).unwrap().params;
    let unperturbed = predict(&problem, &plain, &before);
    let mut config = plain;
    config.init.position_noise_m = 0.05;
    let perturbed = predict(&problem, &config, &before);
    let off = |k: usize| norm(sub(perturbed.position(k), unperturbed.position(k)));
    let joints = before.shape().joints;
    let square = (0..joints).map(|k| off(k) * off(k)).sum::<f64>() / (3 * joints) as f64;
    assert!((0.03..0.07).contains(&square.sqrt()), "the deviation of a coordinate is {:.3} m", square.sqrt());
    config.init.position_noise_m = 0.0;
    config.init.position_bias_m = 0.1;
    let shifted = predict(&problem, &config, &before);
    for joint in 0..joints {
        assert!((norm(sub(shifted.position(joint), unperturbed.position(joint))) - 0.1).abs() < 1e-9);
    }
    let left = predict(&problem, &FitConfig { warm_start: WarmStart::AsLeft, ..plain }, &before);
    assert_eq!(left, before, "the paper's warm start is the result of the frame before as it is");
}

/// Missed peaks take their hills along: the place that is read from what is lit around a person changes too.
#[test]
fn missed_peaks_move_a_start() {
    let (problem, plain) = twice();
    let found = initialise(&problem, &plain).unwrap();
    for peak_dropout in [0.2, 0.4] {
        let mut config = plain;
        config.init.peak_dropout = peak_dropout;
        let missed = initialise(&problem, &config).unwrap();
        assert!(missed.peaks.len() < found.peaks.len() && missed.peaks.iter().all(|peak| found.peaks.contains(peak)));
        let moved = norm(sub(missed.params.position(0), found.params.position(0)));
        assert!((1e-4..1.0).contains(&moved), "{peak_dropout}: {moved} m");
    }
}

/// To the letter of the paper a start reads its own frame alone, and its velocity has no sign.
#[test]
fn to_the_letter_a_start_knows_no_other_frame() {
    let (with_before, _) = twice();
    let folder = case_folders().into_iter().find(|f| f.ends_with("mmvr-size")).unwrap();
    let alone = Arc::new(Case::open(&folder).problem);
    let paper = Preset::Paper.config();
    let start = initialise(&alone, &paper).unwrap();
    assert_eq!(start.params, initialise(&with_before, &paper).unwrap().params);
    let radial = |params: &Pppr| {
        let ([x, y, z], [vx, vy, vz]) = (centroid(params.group(Group::Position)), params.velocity(0));
        (x * vx + y * vy + z * vz) / norm([x, y, z])
    };
    let speed = radial(&start.params);
    assert!((0.0..=0.5).contains(&speed) && speed > 0.0, "γ·g ≤ 0.5 m/s, away: {speed}");
    let plain = initialise(&alone, &FitConfig::default()).unwrap().params;
    assert_eq!(plain.velocity(0), [0.0; 3], "by default nothing tells the sign");
    assert!(start.notes.iter().any(|note| note.contains("the middle of the strongest")), "{:?}", start.notes);
}

/// What comes after a frame tells nothing of it where only the frames before may be looked at.
#[test]
fn past_frames_are_those_before() {
    let (problem, _) = twice();
    let mut both = Problem::clone(&problem);
    let dark: Vec<Vec<f64>> = (0..2).map(|view| problem.map(view).iter().map(|x| 0.5 * x).collect()).collect();
    let dark: Vec<&[f64]> = dark.iter().map(Vec::as_slice).collect();
    for offset_s in [0.1, 0.2] {
        both.add_neighbour(offset_s, &dark).unwrap();
    }
    let count = |frames: FramesAround| both.neighbours_in(frames).len();
    assert_eq!([FramesAround::Both, FramesAround::Past, FramesAround::None].map(count), [3, 1, 0]);
    let past = FitConfig { frames_around: FramesAround::Past, ..FitConfig::default() };
    let start = |problem: &Problem| initialise(&Arc::new(problem.clone()), &past).unwrap().params;
    assert_eq!(start(&both), start(&problem));
}

#[test]
fn a_constant_map_has_no_start() {
    let folder = case_folders().into_iter().find(|f| f.ends_with("mmvr-size")).unwrap();
    let case = Case::open(&folder);
    let flat = vec![1.0; 256 * 128];
    let problem =
        Arc::new(Problem::new(case.problem.radar, case.problem.skeleton, case.problem.views, &[&flat, &flat]).unwrap());
    assert!(matches!(initialise(&problem, &case.config), Err(FitError::NoStart { .. })));
}

#[test]
fn starts_with_bones_of_reference_length_and_the_stated_values() {
    let folder = case_folders().into_iter().find(|f| f.ends_with("mmvr-size")).unwrap();
    let case = Case::open(&folder);
    let params = initialise(&Arc::new(case.problem.clone()), &case.config).unwrap().params;
    let skeleton = &case.problem.skeleton;
    for (&[m, n], want) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
        let length = norm(sub(params.position(m), params.position(n)));
        assert!((length - want).abs() < 0.02, "{} to {}: {length}", skeleton.joints[m], skeleton.joints[n]);
    }
    for joint in 0..params.shape().joints {
        assert!(params.scale(joint).iter().all(|s| (s - 0.08).abs() < 1e-12));
        assert_eq!(params.rotation(joint), [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(params.velocity(joint), [0.0; 3]);
        assert_eq!(params.opacity(joint), 0.5);
    }
}

/// How a map is filled.
#[derive(Debug, Clone, Copy)]
enum Pattern {
    Constant,
    Spike,
    Alternating,
    Ramp,
    Holes,
}

/// A map of such values: all of them finite but for holes.
fn filled(pattern: Pattern, cells: usize, [a, b]: [f64; 2], at: usize) -> Vec<f64> {
    let value = |cell: usize| match pattern {
        Pattern::Constant => a,
        Pattern::Spike => {
            if cell == at % cells {
                a
            } else {
                b
            }
        }
        Pattern::Alternating => {
            if cell.is_multiple_of(2) {
                a
            } else {
                b
            }
        }
        Pattern::Ramp => a * (cell as f64 / cells as f64) + b * (((cell * 7 + at) % 13) as f64 / 13.0),
        Pattern::Holes => {
            if cell % 3 == at % 3 {
                a
            } else {
                f64::NAN
            }
        }
    };
    (0..cells).map(value).collect()
}

fn patterns() -> impl Strategy<Value = (Pattern, [f64; 2], usize)> {
    let pattern = select(vec![Pattern::Constant, Pattern::Spike, Pattern::Alternating, Pattern::Ramp, Pattern::Holes]);
    let size = || select(vec![0.0, 5e-324, 1e-308, 1e-30, 1.0, 3.5, 1e30, 1e155, 1e300, 1.7e308, -1e308]);
    (pattern, [size(), size()], 0..10_000_usize)
}

/// Two axes that tell places, and a third that may be there.
fn kinds() -> impl Strategy<Value = Vec<AxisKind>> {
    use AxisKind::{Azimuth, Cone, DepthH, DepthV, Doppler, Elevation, Range, X, Y, Z};
    select(vec![
        vec![DepthH, Y],
        vec![DepthV, Z],
        vec![Range, Azimuth],
        vec![Range, Cone, Elevation],
        vec![Range, Azimuth, Doppler],
        vec![Doppler, Range],
        vec![X, Y, Z],
        vec![Elevation, Range],
    ])
}

fn axis_of(kind: AxisKind, bins: usize, [lo, hi]: [f64; 2]) -> Axis {
    let [lo, hi] = if kind.is_angular() { [lo, hi].map(|x: f64| x.clamp(-1.5, 1.5)) } else { [lo, hi] };
    Axis { kind, bins, lo, hi, spacing: Spacing::Linear }
}

/// The usual sizes as often as the others, so that some fits are only strange in one thing.
fn axes() -> impl Strategy<Value = Vec<Axis>> {
    let end = || {
        prop_oneof![
            3 => Just([0.0, 6.0]),
            2 => Just([-2.0, 2.0]),
            3 => [0, 1].map(|_| select(vec![-1e300, -1e9, -2.0, -1e-9, 0.0, 1e-308, 1e-9, 0.5, 6.0, 1e9, 1e300, 1e308])),
        ]
    };
    let bins = || prop_oneof![2 => 8..24_usize, 1 => select(vec![1, 2, 3, 60])];
    kinds().prop_flat_map(move |kinds| {
        kinds
            .into_iter()
            .map(|kind| (bins(), end()).prop_map(move |(bins, ends)| axis_of(kind, bins, ends)))
            .collect::<Vec<_>>()
    })
}

fn views() -> impl Strategy<Value = Vec<View>> {
    let width = || prop_oneof![2 => Just(0.05), 1 => select(vec![0.0, 1e-300, 1e-9, 1e9, 1e300])];
    let view = (axes(), [width(), width(), width(), width()], any::<bool>()).prop_map(|(axes, psf, power)| View {
        array: "map".into(),
        quantity: if power { Quantity::Power } else { Quantity::Amplitude },
        psf: PointSpread {
            range_m: psf[0],
            azimuth_rad: psf[1],
            elevation_rad: psf[2],
            doppler_mps: psf[3],
            ..PointSpread::default()
        },
        pose: Pose::default(),
        axes,
        region: None,
    });
    prop::collection::vec(view, 1..3)
}

fn radars() -> impl Strategy<Value = RadarConfig> {
    let of = |usual: f64| prop_oneof![3 => Just(usual), 1 => select(vec![1e-300, 1e-9, 1.0, 1e30, 1e300])];
    (of(77e9), of(2.5e9), of(60e-6), of(0.0128), of(8.0), of(0.0019)).prop_map(
        |(start, band, chirp, frame, far, apart)| RadarConfig {
            start_hz: start,
            bandwidth_hz: band,
            chirp_s: chirp,
            frame_s: frame,
            r_max_m: far,
            l_az_m: apart,
            l_el_m: apart,
            doppler_features: 4,
            height_m: Some(1.0),
        },
    )
}

/// Start, three steps, maps, masks and evidence of a problem: finite, or an error that says something.
fn fitted(problem: &Arc<Problem>, config: &FitConfig, precision: Precision, earlier: &[&[f64]]) -> Result<(), String> {
    let start = find_start(problem, config).map_err(|error| error.to_string())?.initialisation.params;
    assert!(start.is_finite(), "{start:?}");
    let mut fitter = Fitter::new(Arc::clone(problem), *config, precision, start).map_err(|error| error.to_string())?;
    for _ in 0..3 {
        let report = fitter.step().map_err(|error| error.to_string())?;
        assert!(report.loss.is_finite() && report.iou.iter().flatten().all(|iou| (0.0..=1.0).contains(iou)));
    }
    let simulated = simulate(problem, config, precision, fitter.params());
    let masks: Vec<_> = simulated.iter().enumerate().map(|(k, map)| masks(fitter.objective(), k, map)).collect();
    let before = [EarlierFrame { index: 0, maps: earlier.to_vec() }];
    let annotated = Annotated::default();
    let input = EvidenceInput { problem, config, params: fitter.params(), masks: &masks, before: &before, annotated };
    for mode in evidence(&input) {
        assert!(mode.score.is_none_or(|score| (0.0..=1.0).contains(&score)), "{mode:?}");
    }
    Ok(())
}

/// The count of two frames: probabilities whatever they hold.
fn counted(views: &[View], frames: [&[&[f64]]; 2]) -> Result<(), String> {
    let counter = Counter::new(views).map_err(|error| error.to_string())?;
    let mut scans: Vec<Scan> = Vec::new();
    for maps in frames {
        let before: Vec<&Scan> = scans.iter().rev().collect();
        let scan = counter.scan(maps, &before).map_err(|error| error.to_string())?;
        let count = counter.count(&scan, &before);
        let sum: f64 = count.probabilities.iter().sum();
        assert!((sum - 1.0).abs() < 1e-6, "{:?}", count.probabilities);
        assert!(count.seeds(2).iter().flatten().all(|x| x.is_finite()), "{:?}", count.clusters);
        scans.push(scan);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_is_a_number_ends_finite_or_with_an_error(
        views in views(),
        radar in radars(),
        patterns in [patterns(), patterns(), patterns(), patterns()],
        recommended in any::<bool>(),
        neighbours in 0..3_usize,
    ) {
        let map = |frame: usize, k: usize| {
            let (pattern, sizes, at) = patterns[(frame + 2 * k) % 4];
            filled(pattern, views[k].cells(), sizes, at + frame)
        };
        let frames: Vec<Vec<Vec<f64>>> = (0..3).map(|frame| (0..views.len()).map(|k| map(frame, k)).collect()).collect();
        let of = |frame: usize| frames[frame].iter().map(Vec::as_slice).collect::<Vec<&[f64]>>();
        let skeleton = Skeleton::preset("coco17").unwrap();
        let mut told = Vec::new();
        match Problem::new(radar, skeleton, views.clone(), &of(0)) {
            Err(error) => told.push(Err(error.to_string())),
            Ok(mut problem) => {
                for frame in 1..=neighbours {
                    let offset_s = if frame == 1 { -0.1 } else { 0.1 };
                    // A neighbour without a finite cell is refused, and the frame goes on without it.
                    told.extend(problem.add_neighbour(offset_s, &of(frame)).err().map(|error| Err(error.to_string())));
                }
                let problem = Arc::new(problem);
                let preset = if recommended { Preset::Recommended } else { Preset::Paper };
                for precision in [Precision::F64, Precision::F32] {
                    told.push(fitted(&problem, &preset.config(), precision, &of(1)));
                }
                let filled: Vec<&[f64]> = (0..views.len()).map(|k| problem.map(k)).collect();
                told.push(counted(&views, [&filled, &of(0)]));
            }
        }
        for error in told.into_iter().filter_map(Result::err) {
            prop_assert!(!error.is_empty());
        }
    }
}
