//! Central differences against the hand-written gradients: every parameter group, random scenes, every kind of axis.
//!
//! The threshold of the soft mask is a percentile of H_sim and is held constant in the gradient (SPEC section 4). So
//! that L itself can be differenced here, the soft loss is recomputed in this file, from `simulate`'s maps, with the
//! threshold frozen at the base point; the other terms of the table are differenced as the program gives them.
//!
//! Beside a coherent null, |S| ≈ 0, the loss bends within one step, and a difference quotient misses the slope by more
//! than the gradient may. A quotient that contradicts the gradient is therefore refined until it agrees with itself, and
//! only then believed. The cases are the same in every run; a longer hunt elsewhere:
//! `PROPTEST_CASES=5000 PROPTEST_RNG_SEED=7 cargo test --test numerics gradients`.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::{EmLoss, EmRegion, FitConfig, LobeShape, Operators, Summation};
use mhp_inspector::geometry::{Pose, rotation_from_quaternion};
use mhp_inspector::mhp::{Evaluation, Objective, Precision, Problem, TermId, simulate};
use mhp_inspector::radar::{Axis, AxisKind, Lobe, Lobes, PointSpread, Quantity, RadarConfig, Spacing, View};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use std::sync::Arc;

const JOINTS: usize = 5;
const FEATURES: usize = 6;
const SOFT_FLOOR: f64 = 1e-30;
/// Random scenes keep |S| above this part of the incoherent sum.
const NULL_DEPTH: f64 = 0.02;
/// How often a step is halved before a difference quotient is given up.
const HALVINGS: i32 = 6;

/// Lobes without a foot, and no narrower than Gaussians with a cell's width, so that scenes have no more nulls; how large the ratios are is nothing to gradients.
const LOBES: Lobes = Lobes {
    range: Some(Lobe { ratios: [1.5, 0.9], untapered: None }),
    azimuth: Some(Lobe { ratios: [1.6, 1.0], untapered: None }),
    elevation: Some(Lobe { ratios: [1.4, 0.8], untapered: None }),
    doppler: Some(Lobe { ratios: [1.5, 1.1], untapered: None }),
};

/// Steps that balance truncation and rounding; from the README of the reference cases.
fn step(group: Group) -> f64 {
    match group {
        Group::Position | Group::Velocity => 1e-5,
        Group::LogScale => 1e-4,
        Group::Rotation => 2e-4,
        Group::Beta => 1e-3,
        Group::Omega => 2e-3,
    }
}

fn skeleton() -> Skeleton {
    Skeleton {
        joints: (0..JOINTS).map(|j| format!("joint_{j}")).collect(),
        bones: vec![[0, 1], [1, 2], [2, 3], [3, 4]],
        bone_lengths_m: vec![0.3, 0.35, 0.25, 0.4],
        angles: vec![[0, 1, 2], [2, 3, 4]],
    }
}

fn axis(kind: AxisKind, sine: bool, rng: &mut StdRng) -> Axis {
    let bins = rng.random_range(10..16);
    let (mut lo, mut hi) = match kind {
        AxisKind::Range | AxisKind::DepthH | AxisKind::DepthV | AxisKind::X => (1.6, 4.4),
        AxisKind::Azimuth | AxisKind::Cone | AxisKind::Elevation => (-0.7, 0.7),
        AxisKind::Doppler => (-1.5, 1.5),
        AxisKind::Y | AxisKind::Z => (-1.3, 1.3),
    };
    if rng.random_bool(0.4) {
        (lo, hi) = (hi, lo);
    }
    let spacing = if sine && kind.is_angular() { Spacing::Sine } else { Spacing::Linear };
    Axis { kind, bins, lo, hi, spacing }
}

fn view(name: &str, kinds: &[AxisKind], rng: &mut StdRng) -> View {
    let q = [1.0, rng.random_range(-0.1..0.1), rng.random_range(-0.1..0.1), rng.random_range(-0.1..0.1)];
    let axes = kinds.iter().map(|&kind| {
        let sine = rng.random_bool(0.5);
        axis(kind, sine, rng)
    });
    View {
        array: name.to_owned(),
        quantity: Quantity::default(),
        axes: axes.collect(),
        psf: PointSpread {
            range_m: 0.08,
            azimuth_rad: 0.06,
            elevation_rad: 0.05,
            doppler_mps: 0.2,
            lobes: LOBES,
            ..PointSpread::default()
        },
        pose: Pose {
            rotation: rotation_from_quaternion(q),
            translation: std::array::from_fn(|_| rng.random_range(-0.2..0.2)),
        },
        region: None,
    }
}

fn params(persons: usize, rng: &mut StdRng) -> Pppr {
    let mut params = Pppr::zeros(PpprShape { persons, joints: JOINTS, doppler_features: FEATURES });
    for joint in 0..persons * JOINTS {
        let side = if joint < JOINTS { -0.25 } else { 0.25 };
        let along = (joint % JOINTS) as f64 * 0.25 - 0.5;
        let p = [2.8 + rng.random_range(-0.2..0.2), side + rng.random_range(-0.2..0.2), along];
        params.set_vec3(Group::Position, joint, p);
        params.set_vec3(Group::Velocity, joint, std::array::from_fn(|_| rng.random_range(-0.5..0.5)));
        params.set_vec3(Group::LogScale, joint, std::array::from_fn(|_| rng.random_range(-2.6_f64..-1.4)));
        let q: [f64; 4] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        params.joint_mut(Group::Rotation, joint).copy_from_slice(&q);
        params.joint_mut(Group::Beta, joint)[0] = rng.random_range(-1.5..1.5);
        for omega in params.joint_mut(Group::Omega, joint) {
            *omega = rng.random_range(-1.0..1.0);
        }
    }
    params
}

struct Scene {
    problem: Arc<Problem>,
    config: FitConfig,
    params: Pppr,
}

fn scene(seed: u64, kinds: &[AxisKind], summation: Summation, operators: Operators, offset_m: f64) -> Scene {
    let mut rng = StdRng::seed_from_u64(seed);
    let views = vec![view("a", kinds, &mut rng), view("b", &[AxisKind::Range, AxisKind::Azimuth], &mut rng)];
    let maps: Vec<Vec<f64>> =
        views.iter().map(|v| (0..v.cells()).map(|_| rng.random_range(0.0..1.0)).collect()).collect();
    let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    let radar = RadarConfig { doppler_features: FEATURES, ..RadarConfig::default() };
    let config = FitConfig {
        summation,
        operators,
        surface_offset_m: offset_m,
        em_region: EmRegion::Full,
        tau_pct: 25.0,
        softness: 1.0,
        theta_max_deg: 120.0,
        w_time: 2.0,
        ..FitConfig::default()
    };
    let problem = Arc::new(Problem::new(radar, skeleton(), views, &maps).unwrap());
    Scene { problem, config, params: params(2, &mut rng) }
}

/// The other terms see no map, so two cells do: most of the time of the objective goes into maps. With a frame before, so
/// that the temporal term says something, and people who began elsewhere, so that it is not 0.
fn map_free_objective(config: &FitConfig, params: &Pppr) -> Objective {
    let radar = RadarConfig { doppler_features: FEATURES, ..RadarConfig::default() };
    let mut view = view("none", &[AxisKind::X], &mut StdRng::seed_from_u64(0));
    view.axes[0].bins = 2;
    let mut problem = Problem::new(radar, skeleton(), vec![view], &[&[0.0, 1.0]]).unwrap();
    problem.add_neighbour(-0.1, &[&[1.0, 0.0]]).unwrap();
    let mut initial = params.clone();
    initial.group_mut(Group::Position).iter_mut().enumerate().for_each(|(k, x)| *x += 0.05 + 0.1 * (k % 3) as f64);
    Objective::new(Arc::new(problem), *config, Precision::F64, &initial).unwrap()
}

/// numpy's percentile, by the textbook.
fn percentile(values: &[f64], q_pct: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = q_pct / 100.0 * (sorted.len() - 1) as f64;
    let (lower, t) = (at.floor() as usize, at.fract());
    let upper = (lower + 1).min(sorted.len() - 1);
    sorted[lower] * (1.0 - t) + sorted[upper] * t
}

impl Scene {
    fn maps(&self, params: &Pppr) -> Vec<Vec<f64>> {
        simulate(&self.problem, &self.config, Precision::F64, params)
    }

    fn thresholds(&self) -> Vec<f64> {
        self.maps(&self.params).iter().map(|map| percentile(map, 100.0 - self.config.tau_pct)).collect()
    }

    /// L_EM by its formula, with the thresholds given where it compares masks.
    fn em(&self, params: &Pppr, thresholds: &[f64]) -> f64 {
        let views = self.maps(params);
        if self.config.objective != EmLoss::Iou {
            let losses = views.iter().enumerate().map(|(view, map)| self.levels(self.problem.map(view), map));
            return losses.sum::<f64>() / views.len() as f64;
        }
        let losses = views.iter().zip(thresholds).enumerate().map(|(view, (map, threshold))| {
            let ori = self.problem.map(view);
            let level = percentile(ori, 100.0 - self.config.tau_pct);
            let (mut common, mut union) = (0.0, 0.0);
            for (h, o) in map.iter().zip(ori) {
                let x = ((h + SOFT_FLOOR).ln() - (threshold + SOFT_FLOOR).ln()) / self.config.softness;
                let (m, b) = (1.0 / (1.0 + (-x).exp()), f64::from(u8::from(*o > level)));
                common += m * b;
                union += m + b - m * b;
            }
            1.0 - common / union
        });
        losses.sum::<f64>() / views.len() as f64
    }

    /// L_view by levels; SPEC section 8, word for word.
    fn levels(&self, ori: &[f64], sim: &[f64]) -> f64 {
        let largest = ori.iter().copied().fold(0.0, f64::max);
        let measured: Vec<f64> = ori.iter().map(|h| (h / largest).powi(2)).collect();
        let (noise, count) = (percentile(&measured, 30.0), measured.len() as f64);
        let power: Vec<f64> = sim.iter().map(|h| h * h).collect();
        let above: f64 = measured.iter().map(|i| i - noise).sum();
        let gain = above.max(1e-6 * measured.iter().sum::<f64>()) / (power.iter().sum::<f64>() + 1e-20);
        let model: Vec<f64> = power.iter().map(|s| gain * s + noise).collect();
        if self.config.objective == EmLoss::Gamma {
            let cell = |(i, m): (&f64, &f64)| m.ln() + i.max(1e-12) / m - i.max(1e-12).ln() - 1.0;
            return measured.iter().zip(&model).map(cell).sum::<f64>() / count;
        }
        let centred = |values: Vec<f64>| {
            let mean = values.iter().sum::<f64>() / count;
            values.into_iter().map(|x| x - mean).collect::<Vec<f64>>()
        };
        let a = centred(measured.iter().map(|i| (i + noise).ln()).collect());
        let b = centred(model.iter().map(|m| (m + noise).ln()).collect());
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        1.0 - product(&a, &b) / (product(&a, &a) * product(&b, &b) + 1e-20).sqrt()
    }

    /// The smallest |S| relative to the incoherent sum: near 0 the scene has a null that differences cannot resolve.
    fn depth_of_nulls(&self) -> f64 {
        let incoherent = FitConfig { summation: Summation::Incoherent, ..self.config };
        let plain = simulate(&self.problem, &incoherent, Precision::F64, &self.params);
        let pairs = self.maps(&self.params).into_iter().flatten().zip(plain.into_iter().flatten());
        pairs.map(|(s, p)| s / p).fold(f64::INFINITY, f64::min)
    }

    fn check(&self) -> Result<(), TestCaseError> {
        let mut objective =
            Objective::new(Arc::clone(&self.problem), self.config, Precision::F64, &self.params).unwrap();
        let base = objective.evaluate(&self.params);
        let thresholds = self.thresholds();
        let em = TermId::of("em").unwrap();
        prop_assert!((base.terms[em] - self.em(&self.params, &thresholds)).abs() < 1e-9, "L_EM itself");
        for group in Group::ALL {
            let got = base.em_gradient().group(group);
            compare(group, em.label, got, step(group), &self.params, |p| self.em(p, &thresholds))?;
        }
        let mut map_free = map_free_objective(&self.config, &self.params);
        for term in TermId::all().filter(|&term| term != em) {
            let gradient = map_free.term_gradient(term, &self.params);
            for group in Group::ALL {
                let value = |params: &Pppr| map_free.evaluate(params).terms[term];
                compare(group, term.label, gradient.group(group), 3e-6, &self.params, value)?;
            }
        }
        self.check_sum(&mut objective, &base)
    }

    /// The total is the weighted sum of the terms' own gradients.
    fn check_sum(&self, objective: &mut Objective, base: &Evaluation) -> Result<(), TestCaseError> {
        let mut sum = Pppr::zeros(self.params.shape());
        for term in TermId::all() {
            sum.add_scaled(term.weight.of(&self.config), &objective.term_gradient(term, &self.params));
        }
        for group in Group::ALL {
            let (got, want) = (base.gradient.group(group), sum.group(group));
            let largest = want.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
            let off = got.iter().zip(want).map(|(got, want)| (got - want).abs()).fold(0.0, f64::max);
            prop_assert!(off <= 1e-12 * largest, "{}: the sum is {off:.2e} of {largest:.2e} off", group.key());
        }
        Ok(())
    }
}

/// How many entries of a group to go on: no divisor of a joint's share, so that each component has its turn.
fn stride(group: Group) -> usize {
    match group {
        Group::Position | Group::Velocity | Group::LogScale | Group::Beta => 2,
        Group::Rotation => 3,
        Group::Omega => 7,
    }
}

/// Compares some entries of a group with fourth-order central differences.
fn compare(
    group: Group,
    what: &str,
    got: &[f64],
    step: f64,
    params: &Pppr,
    mut loss: impl FnMut(&Pppr) -> f64,
) -> Result<(), TestCaseError> {
    let largest = got.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
    // What rounding of the loss leaves of a quotient grows as the step shrinks.
    let limit = |h: f64| 2e-5 * largest + 4e-15 / h + 1e-10;
    for i in (0..got.len()).step_by(stride(group)) {
        let mut at = |offset: f64| {
            let mut moved = params.clone();
            moved.group_mut(group)[i] += offset;
            loss(&moved)
        };
        let mut quotient = |h: f64| (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let coarse = quotient(step);
        if (got[i] - coarse).abs() <= limit(step) {
            continue;
        }
        let entry = format!("{what}, {} [{i}]: {} by hand", group.key(), got[i]);
        let Some((h, slope)) = settle(&mut quotient, coarse, step, limit) else {
            let fail = format!("{entry}, {coarse} by differences, which do not settle as their step shrinks");
            return Err(TestCaseError::fail(fail));
        };
        prop_assert!(
            (got[i] - slope).abs() <= limit(h),
            "{entry}, {slope} by differences at step {h:.2e}, at most {:.2e} of {largest:.2e} apart",
            limit(h)
        );
    }
    Ok(())
}

/// Halves the step until two quotients in a row agree within the limit; the last step and its quotient. Their
/// truncation error falls sixteenfold each time, so the last is much nearer than the limit. What the gradient says has
/// no part in it.
fn settle(
    mut quotient: impl FnMut(f64) -> f64,
    mut coarse: f64,
    step: f64,
    limit: impl Fn(f64) -> f64,
) -> Option<(f64, f64)> {
    (1..=HALVINGS).find_map(|k| {
        let h = step * 0.5_f64.powi(k);
        let fine = quotient(h);
        let settled = (fine - coarse).abs() <= limit(h);
        coarse = fine;
        settled.then_some((h, fine))
    })
}

fn kinds() -> impl Strategy<Value = Vec<AxisKind>> {
    let kind = prop::sample::select(AxisKind::ALL.to_vec());
    prop::collection::vec(kind, 2..4)
}

fn operators() -> impl Strategy<Value = Operators> {
    // Mostly on: an axis that is switched off has no gradient to be wrong.
    let on = || prop::bool::weighted(0.8);
    (on(), on(), on(), on()).prop_map(|(attenuation, range, doppler, angle)| Operators {
        attenuation,
        range,
        doppler,
        angle,
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 48,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn agree_with_central_differences(
        seed in any::<u64>(),
        kinds in kinds(),
        coherent in prop::bool::weighted(0.7),
        operators in operators(),
        offset_m in prop::sample::select(vec![0.0, 0.08]),
        objective in prop::sample::select(vec![EmLoss::Iou, EmLoss::NccDb, EmLoss::Gamma]),
        lobe in prop::sample::select(vec![LobeShape::Gaussian, LobeShape::Gaussian, LobeShape::Window]),
        dynamic_range_db in prop::sample::select(vec![200.0, 25.0]),
    ) {
        let summation = if coherent { Summation::Coherent } else { Summation::Incoherent };
        let mut scene = scene(seed, &kinds, summation, operators, offset_m);
        (scene.config.objective, scene.config.lobe) = (objective, lobe);
        scene.config.dynamic_range_db = dynamic_range_db;
        prop_assume!(scene.depth_of_nulls() > NULL_DEPTH);
        scene.check()?;
    }
}

/// Every kind once more by name, so that a failure says which axis is wrong.
#[test]
fn every_axis_kind_alone() {
    for kind in AxisKind::ALL {
        for seed in 0..40 {
            let scene = scene(seed, &[kind, AxisKind::Z], Summation::Coherent, Operators::default(), 0.03);
            if scene.depth_of_nulls() > NULL_DEPTH {
                let verdict = scene.check();
                assert!(verdict.is_ok(), "{}: {verdict:?}", kind.name());
                break;
            }
            assert!(seed < 39, "no scene without a null for {}", kind.name());
        }
    }
}

/// The same with the windows' own lobes, which are several Gaussians a joint: in two axes and in three, with spectra, and tilted.
#[test]
fn every_axis_kind_with_the_lobe_of_its_window() {
    for kind in AxisKind::ALL {
        for others in [&[AxisKind::Z][..], &[AxisKind::Doppler, AxisKind::Y]] {
            let kinds = [&[kind], others].concat();
            let of = |seed: u64| {
                let mut scene = scene(seed, &kinds, Summation::Coherent, Operators::default(), 0.03);
                scene.config.lobe = LobeShape::Window;
                scene
            };
            // The scene farthest from a null: three axes hardly ever have none at all.
            let scenes = (0..24).map(of).map(|scene| (scene.depth_of_nulls(), scene));
            let (_, scene) = scenes.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let verdict = scene.check();
            assert!(verdict.is_ok(), "{kinds:?}: {verdict:?}");
        }
    }
}

/// Scenes with a lit cell that almost cancels: the first quotients are wrong there and the gradient is not.
#[test]
fn beside_a_null() {
    use AxisKind::{Azimuth, Cone, DepthV, Elevation, X, Z};
    let all = Operators::default();
    let no_angle = Operators { angle: false, ..all };
    for (seed, kinds, operators, offset_m) in [
        (10998409863981825022, &[Elevation, Elevation] as &[_], all, 0.0),
        (11496887695202309176, &[DepthV, Azimuth, Cone], all, 0.08),
        (6729971952418478566, &[X, DepthV, Z], no_angle, 0.08),
    ] {
        let scene = scene(seed, kinds, Summation::Coherent, operators, offset_m);
        assert!(scene.depth_of_nulls() < 1.1 * NULL_DEPTH, "no null in {kinds:?}");
        let verdict = scene.check();
        assert!(verdict.is_ok(), "{kinds:?}: {verdict:?}");
    }
}

/// What a map adds to a range moves a joint along its ray, as its skin does the other way: the same loss and the same gradient.
#[test]
fn a_range_offset_is_a_skin_behind_the_joint() {
    use AxisKind::{Azimuth, DepthV, Range, Z};
    for (seed, kinds) in [(5, &[Range, Azimuth] as &[_]), (6, &[DepthV, Z])] {
        let before = scene(seed, kinds, Summation::Coherent, Operators::default(), 0.08);
        let views: Vec<View> = before.problem.views.iter().cloned().collect();
        let behind = views.iter().map(|view| {
            let psf = PointSpread { range_offset_m: -0.05, measured_offset_m: -0.03, ..view.psf };
            View { psf, ..view.clone() }
        });
        let maps: Vec<&[f64]> = (0..views.len()).map(|view| before.problem.map(view)).collect();
        let (radar, skeleton) = (before.problem.radar.clone(), before.problem.skeleton.clone());
        let offset = Arc::new(Problem::new(radar, skeleton, behind.collect::<Vec<_>>(), &maps).unwrap());
        let of = |problem: &Arc<Problem>, surface_offset_m: f64| {
            let em_region = EmRegion::Full;
            let config = FitConfig { surface_offset_m, em_region, ..before.config };
            let objective = Objective::new(Arc::clone(problem), config, Precision::F64, &before.params);
            objective.unwrap().evaluate(&before.params)
        };
        let [a, b] = [of(&before.problem, 0.08), of(&offset, 0.0)];
        assert!((a.loss - b.loss).abs() < 1e-12, "{} {}", a.loss, b.loss);
        for group in Group::ALL {
            let pairs = a.em_gradient().group(group).iter().zip(b.em_gradient().group(group));
            let largest = a.em_gradient().group(group).iter().fold(0.0, |m: f64, g| m.max(g.abs()));
            assert!(pairs.clone().all(|(a, b)| (a - b).abs() <= 1e-9 * largest), "{}", group.key());
        }
    }
}

/// One entry of each group wrong by a thousandth of the largest: the comparison must see it.
#[test]
fn slightly_wrong_gradients_are_caught() {
    let kinds = [AxisKind::Range, AxisKind::Azimuth, AxisKind::Doppler];
    let scene = scene(3, &kinds, Summation::Coherent, Operators::default(), 0.03);
    let objective = Objective::new(Arc::clone(&scene.problem), scene.config, Precision::F64, &scene.params);
    let gradient = objective.unwrap().evaluate(&scene.params).em_gradient().clone();
    let thresholds = scene.thresholds();
    for group in Group::ALL {
        let mut got = gradient.group(group).to_vec();
        got[0] += 1e-3 * got.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
        let verdict = compare(group, "L_EM", &got, step(group), &scene.params, |p| scene.em(p, &thresholds));
        assert!(verdict.is_err(), "{} was wrong and passed", group.key());
    }
}
