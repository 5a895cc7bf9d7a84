//! The fast path against the oracle on random scenes: every kind of axis, one to three persons, joints at the edge, outside
//! and near the radar, Gaussians from 5 mm to 1 m. A longer hunt:
//! `PROPTEST_CASES=20000 PROPTEST_RNG_SEED=7 cargo test --release --test numerics single_precision`.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use crate::common;
use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::{EmLoss, EmRegion, FitConfig, Operators, Parameterization, Preset, Summation};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::geometry::{Pose, norm, rotation_from_quaternion, sub};
use mhp_inspector::mhp::{
    ErasedCells, Evaluation, Fitter, Objective, Precision, Problem, erased_marks, initialise, simulate, without,
};
use mhp_inspector::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View};
use mhp_inspector::start::problem_alone;
use mhp_inspector::task::Progress;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

const JOINTS: usize = 5;
const FEATURES: usize = 6;
/// Beside a coherent null ln|S| has no digits in single precision: scenes keep |S| above this part of the incoherent sum.
const NULL_DEPTH: f64 = 0.02;
/// Frames of a sample that are fitted.
const FRAMES: usize = 2;
/// Scenes in every run.
const SCENES: u64 = 2000;

/// Bins of an axis that are drawn from, and those of the largest maps.
const BINS: Range<usize> = 5..40;
const MANY_BINS: Range<usize> = 1024..1025;
/// Scenes of the largest maps.
const LARGE_SCENES: u64 = 12;

fn axis(kind: AxisKind, bins: Range<usize>, rng: &mut StdRng) -> Axis {
    let (lo, hi) = match kind {
        AxisKind::Range | AxisKind::DepthH | AxisKind::DepthV | AxisKind::X => (0.0, 6.0),
        AxisKind::Doppler => (-2.0, 2.0),
        AxisKind::Y | AxisKind::Z => (-2.5, 2.5),
        _ => (-1.0, 1.0),
    };
    let sine = kind.is_angular() && rng.random_bool(0.5);
    let spacing = if sine { Spacing::Sine } else { Spacing::Linear };
    let (lo, hi) = if rng.random_bool(0.3) { (hi, lo) } else { (lo, hi) };
    Axis { kind, bins: rng.random_range(bins), lo, hi, spacing }
}

fn view(index: usize, bins: &Range<usize>, rng: &mut StdRng) -> View {
    let dims = if *bins == BINS { *[1, 2, 2, 2, 3].get(rng.random_range(0..5_usize)).unwrap() } else { 2 };
    let mut kinds = AxisKind::ALL.to_vec();
    let axes = (0..dims).map(|_| kinds.swap_remove(rng.random_range(0..kinds.len()))).collect::<Vec<_>>();
    let turned = rng.random_bool(0.3);
    let q = [1.0, 0.2, -0.1, 0.3].map(|x| if turned { x } else { f64::from(u8::from(x == 1.0)) });
    View {
        array: format!("map{index}"),
        quantity: Quantity::default(),
        psf: PointSpread {
            range_m: 0.06,
            azimuth_rad: 0.04,
            elevation_rad: 0.05,
            doppler_mps: 0.15,
            ..PointSpread::default()
        },
        pose: Pose { rotation: rotation_from_quaternion(q), translation: [0.0, 0.05, -0.1] },
        axes: axes.into_iter().map(|kind| axis(kind, bins.clone(), rng)).collect(),
        region: None,
    }
}

fn params(persons: usize, rng: &mut StdRng) -> Pppr {
    let mut params = Pppr::zeros(PpprShape { persons, joints: JOINTS, doppler_features: FEATURES });
    let far = if rng.random_bool(0.1) { 0.3 } else { rng.random_range(1.0..5.5) };
    for joint in 0..persons * JOINTS {
        let outside = if rng.random_bool(0.05) { 2.5 } else { 0.4 };
        let mut around = |x: f64, by: f64| x + rng.random_range(-by..by);
        let place = [around(far, 0.5_f64.min(far * 0.5)), around(0.0, outside), around(0.0, outside)];
        params.set_vec3(Group::Position, joint, place);
        params.set_vec3(Group::Velocity, joint, [around(0.0, 1.0), around(0.0, 1.0), around(0.0, 1.0)]);
        let (lo, hi) = if rng.random_bool(0.1) { (0.005_f64, 1.0_f64) } else { (0.03, 0.12) };
        for x in params.joint_mut(Group::LogScale, joint) {
            *x = rng.random_range(lo.ln()..hi.ln());
        }
        for group in [Group::Rotation, Group::Beta, Group::Omega] {
            for x in params.joint_mut(group, joint) {
                *x = rng.random_range(-1.0..1.0);
            }
        }
    }
    params
}

fn radar() -> RadarConfig {
    RadarConfig {
        start_hz: 77e9,
        bandwidth_hz: 2.5e9,
        chirp_s: 60e-6,
        frame_s: 0.0128,
        r_max_m: 12.0,
        l_az_m: 0.0019,
        l_el_m: 0.0021,
        doppler_features: FEATURES,
        height_m: None,
    }
}

fn skeleton() -> Skeleton {
    Skeleton {
        joints: (0..JOINTS).map(|k| format!("joint {k}")).collect(),
        bones: (1..JOINTS).map(|k| [k - 1, k]).collect(),
        bone_lengths_m: vec![0.3; JOINTS - 1],
        angles: vec![[0, 1, 2]],
    }
}

/// Boxes and single cells of each view that are erased, one of three at most of a map.
fn erased(views: &[View], rng: &mut StdRng) -> Vec<ErasedCells> {
    let mut erased = Vec::new();
    for (index, view) in views.iter().enumerate() {
        for _ in 0..rng.random_range(0..3) {
            let side = |axis: &Axis| {
                let lo = rng.random_range(0..axis.bins);
                [lo, rng.random_range(lo..(lo + 1 + axis.bins / 3).min(axis.bins)) + 1]
            };
            let bins = view.axes.iter().map(side).collect();
            erased.push(ErasedCells { view: index, bins, cells: Vec::new() });
        }
        let cells: Vec<usize> = (0..view.cells()).filter(|_| rng.random_bool(0.05)).collect();
        erased.extend(ErasedCells::of_cells((index, view), cells));
    }
    erased
}

/// Loss and gradients of one scene in both precisions; `None` beside a coherent null.
fn scene(seed: u64, bins: &Range<usize>, (objective, erases): (EmLoss, bool)) -> Option<[Evaluation; 2]> {
    let rng = &mut StdRng::seed_from_u64(seed);
    let views: Vec<View> = (0..rng.random_range(1..3)).map(|k| view(k, bins, rng)).collect();
    let maps: Vec<Vec<f64>> =
        views.iter().map(|v| (0..v.cells()).map(|_| rng.random_range(0.0..1.0)).collect()).collect();
    let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    let on = |rng: &mut StdRng| rng.random_bool(0.85);
    let config = FitConfig {
        objective,
        summation: if rng.random_bool(0.5) { Summation::Coherent } else { Summation::Incoherent },
        em_region: if rng.random_bool(0.5) { EmRegion::Full } else { EmRegion::HalfWidth(1.25) },
        softness: *[0.1, 0.5, 0.5, 1.0, 1.5, 4.0].get(rng.random_range(0..6_usize)).unwrap(),
        tau_pct: *[2.0, 10.0, 10.0, 40.0, 100.0].get(rng.random_range(0..5_usize)).unwrap(),
        operators: Operators { attenuation: on(rng), range: on(rng), doppler: on(rng), angle: on(rng) },
        dynamic_range_db: if seed.is_multiple_of(2) { 200.0 } else { 25.0 },
        ..FitConfig::default()
    };
    // Over a region the powers of a whole map do not tell whether somebody is in it.
    let em_region = if objective == EmLoss::Iou { config.em_region } else { EmRegion::Full };
    let config = FitConfig { em_region, ..config };
    let params = params(rng.random_range(1..4), rng);
    let problem = Arc::new(Problem::new(radar(), skeleton(), views, &maps).unwrap());
    let erased = if erases { erased(&problem.views, rng) } else { Vec::new() };
    let seen = without(&problem, &erased).ok()?;
    // Where nobody is in a view, SPEC's regularisers of levels decide, and they are beyond f32.
    let marks = erased_marks(&problem.views, &erased);
    let powers = |(map, marks): (&Vec<f64>, &Vec<bool>)| {
        map.iter().zip(marks).filter(|(_, erased)| !**erased).map(|(h, _)| h * h).sum::<f64>()
    };
    if objective != EmLoss::Iou {
        let maps = simulate(&problem, &config, Precision::F64, &params);
        // Of what is left of a body whose most is erased a gain makes a whole one, and of its digits a few.
        let whole = |map: &Vec<f64>| map.iter().map(|h| h * h).sum::<f64>();
        if maps.iter().zip(&marks).any(|of| powers(of) < (1e-3 * whole(of.0)).max(1e-18)) {
            return None;
        }
    }
    if config.summation == Summation::Coherent {
        let incoherent = FitConfig { summation: Summation::Incoherent, ..config };
        let [sum, most] =
            [config, incoherent].map(|config| simulate(&problem, &config, Precision::F64, &params).concat());
        if sum.iter().zip(&most).any(|(sum, most)| *sum < NULL_DEPTH * most) {
            return None;
        }
    }
    Some(
        [Precision::F64, Precision::F32]
            .map(|precision| Objective::new(Arc::clone(&seen), config, precision, &params).unwrap().evaluate(&params)),
    )
}

/// What the reference cases ask of single precision, by group; levels are sums of logarithms, of which the gain takes away
/// most, and have a digit less.
fn misses([want, got]: &[Evaluation; 2], objective: EmLoss) -> Vec<String> {
    let share = if objective == EmLoss::Iou { 2e-3 } else { 5e-3 };
    let mut misses = Vec::new();
    let [got_em, want_em] = [got, want].map(|evaluation| evaluation.terms.get("em").unwrap());
    let (off, limit) = ((got_em - want_em).abs(), (1e-4 * want_em).max(1e-6));
    if off > limit || !got.loss.is_finite() {
        misses.push(format!("L_EM {got_em} for {want_em}"));
    }
    for group in Group::ALL {
        let (got, want) = (got.em_gradient().group(group), want.em_gradient().group(group));
        let largest = want.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let worst = got.iter().zip(want).map(|(g, w)| (g - w).abs()).fold(0.0, f64::max);
        if worst > (share * largest).max(if objective == EmLoss::Iou { 1e-6 } else { 5e-6 }) {
            misses.push(format!("{}: {worst:.2e} of {largest:.2e}", group.key()));
        }
    }
    misses
}

fn check(seeds: Range<u64>, bins: &Range<usize>, objective: EmLoss, erases: bool) {
    let scenes = seeds.end - seeds.start;
    let wrong: Vec<String> = seeds
        .filter_map(|seed| {
            let misses = misses(&scene(seed, bins, (objective, erases))?, objective);
            (!misses.is_empty()).then(|| format!("scene {seed}: {}", misses.join("; ")))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {scenes}:\n{}", wrong.len(), wrong.join("\n"));
}

/// A spectrum may raise a return far above the joint's own strength, whichever axis it lies along.
#[test]
fn a_strong_spectrum_along_any_axis_is_not_cut_off() {
    let kinds = [AxisKind::Doppler, AxisKind::Range, AxisKind::Azimuth];
    for first in 0..kinds.len() {
        let rng = &mut StdRng::seed_from_u64(1);
        let mut spectral = view(0, &(24..25), rng);
        spectral.axes = (0..kinds.len()).map(|k| axis(kinds[(first + k) % kinds.len()], 24..25, rng)).collect();
        let map = vec![1.0; spectral.cells()];
        let problem = Problem::new(radar(), skeleton(), vec![spectral], &[&map]).unwrap();
        let mut params = params(1, rng);
        for joint in 0..JOINTS {
            params.joint_mut(Group::Omega, joint).copy_from_slice(&[-20.0, -20.0, 0.0, 40.0, 0.0, 0.0]);
        }
        let config = FitConfig { summation: Summation::Incoherent, ..FitConfig::default() };
        let [want, got] =
            [Precision::F64, Precision::F32].map(|precision| simulate(&problem, &config, precision, &params).concat());
        let most = want.iter().copied().fold(0.0, f64::max);
        let off = want.iter().zip(&got).map(|(want, got)| (want - got).abs()).fold(0.0, f64::max);
        assert!(most > 0.0 && off <= 2e-4 * most, "{first}: {off} of {most}");
    }
}

#[test]
fn single_precision_agrees_on_random_scenes() {
    let number = |key: &str| std::env::var(key).ok().and_then(|text| text.parse::<u64>().ok());
    let (first, scenes) = (number("PROPTEST_RNG_SEED").unwrap_or(0) << 32, number("PROPTEST_CASES").unwrap_or(SCENES));
    check(first..first + scenes, &BINS, EmLoss::Iou, false);
    for objective in [EmLoss::NccDb, EmLoss::Gamma] {
        check(first..first + scenes / 4, &BINS, objective, false);
    }
}

/// Erased cells are as those beyond the region, in tiles as in rows.
#[test]
fn single_precision_agrees_where_cells_are_erased() {
    let number = |key: &str| std::env::var(key).ok().and_then(|text| text.parse::<u64>().ok());
    let (first, scenes) = (number("PROPTEST_RNG_SEED").unwrap_or(1) << 32, number("PROPTEST_CASES").unwrap_or(SCENES));
    for objective in [EmLoss::Iou, EmLoss::NccDb, EmLoss::Gamma] {
        check(first..first + scenes / 4, &BINS, objective, true);
    }
}

/// An erased echo costs a fit no more than it saves: it goes through tiles and rows as the others.
#[test]
fn the_masks_agree_where_cells_are_erased() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/samples/walk"));
    let dataset = Dataset::open(folder, &Progress::new()).unwrap();
    let problem = Arc::new(problem_alone(&dataset, &dataset.load(3).unwrap()).unwrap());
    for preset in Preset::ALL {
        let config = FitConfig { parameterization: Parameterization::Joints, people: 1, ..preset.config() };
        let start = initialise(&problem, &config).unwrap().params;
        for view in 0..2 {
            let bins = vec![[60, 180], [10, 50]];
            let seen = without(&problem, &[ErasedCells { view, bins, cells: Vec::new() }]).unwrap();
            let [a, b] = [Precision::F64, Precision::F32].map(|precision| {
                Objective::new(Arc::clone(&seen), config, precision, &start).unwrap().evaluate(&start)
            });
            for (want, got) in a.iou.iter().zip(&b.iou) {
                let off = want.zip(*got).map(|(want, got)| (want - got).abs());
                assert!(off.is_some_and(|off| off < 5e-3), "{}: {want:?} {got:?}", preset.name());
            }
        }
    }
}

#[test]
fn single_precision_agrees_on_the_largest_maps() {
    check(0..LARGE_SCENES, &MANY_BINS, EmLoss::Iou, false);
    check(0..LARGE_SCENES / 4, &MANY_BINS, EmLoss::NccDb, false);
}

/// A hundred iterations of a data set's first frames, from their own start; mean distance of the joints between precisions.
fn fits_end_together(folder: &Path) {
    let dataset = Dataset::open(folder, &Progress::new()).unwrap();
    for index in 0..dataset.len().min(FRAMES) {
        let frame = dataset.load(index).unwrap();
        let problem = Arc::new(problem_alone(&dataset, &frame).unwrap());
        let config = FitConfig::default();
        let start = initialise(&problem, &config).unwrap().params;
        let [a, b] = [Precision::F64, Precision::F32].map(|precision| {
            let mut fitter = Fitter::new(Arc::clone(&problem), config, precision, start.clone()).unwrap();
            for _ in 0..100 {
                fitter.step().unwrap();
            }
            fitter.params().clone()
        });
        let joints = a.shape().total_joints();
        let apart = (0..joints).map(|joint| norm(sub(a.position(joint), b.position(joint)))).sum::<f64>();
        let mean_mm = 1e3 * apart / joints as f64;
        println!("{} frame {index}: {mean_mm:.4} mm", folder.display());
        assert!(mean_mm < 2.0, "{} frame {index}: {mean_mm} mm", folder.display());
    }
}

#[test]
fn fits_of_the_samples_end_within_two_millimetres_of_double_precision() {
    let samples = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/samples"));
    for sample in ["generic", "mmvr-tree", "walk"] {
        fits_end_together(&samples.join(sample));
    }
}

#[test]
fn a_fit_of_the_real_frame_ends_within_two_millimetres_of_double_precision() {
    let Some(shared) = common::shared() else { return };
    fits_end_together(&shared.join("data/mmvr/00383_radar.npz"));
}
