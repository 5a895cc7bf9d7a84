//! What the radar knows, checked against refits: how far they spread on maps with added noise.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::body::{Group, Pppr};
use mhp_inspector::config::{BodyModel, EmLoss, FitConfig, Parameterization, Preset, Summation};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::explore::{ExploredState, IdleCores, Noise, observability};
use mhp_inspector::mhp::{Fitter, Precision, Problem, simulate};
use mhp_inspector::radar::Quantity;
use mhp_inspector::start::problem_alone;
use mhp_inspector::task::Progress;
use rand::{Rng as _, SeedableRng as _, rngs::StdRng};
use std::path::Path;
use std::sync::Arc;

/// Maps with noise that are fitted anew.
const REFITS: usize = 24;
/// Weak noise: the matrix tells of small moves, and where they are wide the loss bends, and refits come to rest late.
const SNR_DB: f64 = 50.0;
/// Iterations at the usual rate before those at a tenth of it.
const BUDGET: usize = 1000;

fn with_maps(problem: &Problem, maps: &[Vec<f64>]) -> Arc<Problem> {
    let slices: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    Arc::new(Problem::new(problem.radar.clone(), problem.skeleton.clone(), problem.views.clone(), &slices).unwrap())
}

fn normal(rng: &mut StdRng) -> f64 {
    // The sum of twelve is close enough to a Gaussian, and drawn apart from the library's own.
    (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
}

/// The spread that the Gauss-Newton matrix tells is that of refits, within a factor of two.
#[test]
fn the_spread_that_is_told_is_that_of_refits() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk");
    let dataset = Dataset::open(&root, &Progress::new()).unwrap();
    let frame = dataset.load(3).unwrap();
    let problem = problem_alone(&dataset, &frame).unwrap();
    let config = FitConfig {
        objective: EmLoss::Gamma,
        summation: Summation::Incoherent,
        body: BodyModel::Joints,
        parameterization: Parameterization::Joints,
        w_em: 1.0,
        w_kine: 0.5,
        people: 1,
        ..Preset::Baseline.config()
    };
    // A body that is measured as it is simulated: the fit is at its minimum.
    let truth = frame.truth.as_ref().unwrap();
    let mut params = Pppr::zeros(mhp_inspector::body::PpprShape {
        persons: 1,
        joints: problem.skeleton.joints.len(),
        doppler_features: problem.radar.doppler_features,
    });
    for (joint, at) in truth.joints.iter().enumerate() {
        params.set_vec3(Group::Position, joint, *at);
        params.set_vec3(Group::LogScale, joint, [0.07_f64.ln(); 3]);
        params.joint_mut(Group::Rotation, joint)[0] = 1.0;
    }
    let clean = simulate(&problem, &config, Precision::F64, &params);
    let sigmas: Vec<f64> = clean
        .iter()
        .map(|map| map.iter().copied().fold(0.0, f64::max) * 10f64.powf(-SNR_DB / 20.0) / 2f64.sqrt())
        .collect();
    let noisy = |seed: u64| {
        let mut rng = StdRng::seed_from_u64(seed);
        let maps: Vec<Vec<f64>> = clean
            .iter()
            .zip(&sigmas)
            .map(|(map, sigma)| {
                map.iter().map(|x| (x + sigma * normal(&mut rng)).hypot(sigma * normal(&mut rng))).collect()
            })
            .collect();
        with_maps(&problem, &maps)
    };
    assert!(problem.views.iter().all(|view| view.quantity == Quantity::Amplitude));
    // Only the joints move, slowly enough to come to rest.
    let mut still = config;
    still.learning_rate = 1e-3;
    still.learning_rates.position = Some(1e-3);
    for rate in [
        &mut still.learning_rates.log_scale,
        &mut still.learning_rates.rotation,
        &mut still.learning_rates.velocity,
        &mut still.learning_rates.beta,
        &mut still.learning_rates.omega,
    ] {
        *rate = Some(0.0);
    }
    let fit = |problem: Arc<Problem>, from: &Pppr, budget: usize| {
        let mut fitter = Fitter::new(problem, still, Precision::F32, from.clone()).unwrap();
        fitter.run_to(budget, |_, _| {}).unwrap();
        let mut slow = still;
        slow.learning_rates.position = Some(1e-4);
        fitter.set_config(slow).unwrap();
        fitter.run_to(budget + 500, |_, _| {}).unwrap();
        fitter.params().clone()
    };
    let begin = fit(noisy(0), &params, BUDGET);
    let ends: Vec<Vec<f64>> =
        (1..=REFITS as u64).map(|seed| fit(noisy(seed), &begin, BUDGET).group(Group::Position).to_vec()).collect();
    let count = ends.len() as f64;
    let size = ends[0].len();
    let spread: Vec<f64> = (0..size)
        .map(|k| {
            let mean = ends.iter().map(|end| end[k]).sum::<f64>() / count;
            ends.iter().map(|end| (end[k] - mean).powi(2)).sum::<f64>() / (count - 1.0)
        })
        .collect();
    let measured_mm = 1000.0 * (spread.iter().sum::<f64>() / (size / 3) as f64).sqrt();

    let state = ExploredState {
        problem: noisy(0),
        erased: Arc::default(),
        config: still,
        precision: Precision::F32,
        initial: params.clone(),
        params: begin.clone(),
    };
    let known = observability(&state, Noise::SnrDb(SNR_DB), (&IdleCores::all(), &Progress::new())).unwrap();
    let told_mm = known.spread_mm[0];
    println!("refits spread {measured_mm:.2} mm, told {told_mm:.2} mm, ratio {:.2}", told_mm / measured_mm);
    assert!(told_mm < 2.0 * measured_mm && measured_mm < 2.0 * told_mm, "{told_mm} mm told, {measured_mm} mm measured");
    // Joint by joint the order is right: those that are told to spread most do.
    let of = |joint: usize| {
        let told: f64 = (0..3).map(|k| known.refits[joint][k][k]).sum();
        let measured: f64 = spread[3 * joint..3 * joint + 3].iter().sum();
        (told.sqrt(), measured.sqrt())
    };
    let within = (0..size / 3).filter(|&joint| {
        let (told, measured) = of(joint);
        told < 3.0 * measured && measured < 3.0 * told
    });
    assert!(within.count() * 3 >= size / 3 * 2, "{:?}", (0..size / 3).map(of).collect::<Vec<_>>());
    // The echo alone leaves more open than refits spread, and fixes some directions, not all.
    assert!(known.spread_mm[1] > told_mm && known.fixed[0] > 5.0 && known.fixed[0] < known.fixed[1]);
    assert!(known.condition[1] < known.condition[0], "the prior fixes what the echo does not: {:?}", known.condition);
}
