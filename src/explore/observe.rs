//! What the radar knows of a pose, and what only the prior does.
//!
//! With A the Gauss-Newton matrix of w_EM L_EM in the joints' positions and B that of the other terms, both by central differences
//! of the exact gradient and without their negative directions, and C the covariance of ∂(w_EM L_EM) over maps with added noise,
//!
//! ```text
//! spread of a refit    Σ = M C M,  M = (A + B)⁻¹                   a minimum moves by −M times what the gradient gains
//! fixed by the echo    E = s² (A + ρ)⁻¹                            s² the median of vᵀ C v / vᵀ A v where A is large: noise by curvature
//! share of the echo    vᵀ A v / vᵀ (A + B) v                       of a direction v
//! ```
//!
//! ρ lets nothing spread beyond half a metre, so that a direction of which nothing is known has an end on screen. The directions that
//! are told are those of the largest s² (A + B + ρ)⁻¹. Everything is of the frame alone, also where a window of frames is fitted; the
//! body's own terms count with the paper's weight at least, also where a pose space holds the body in their place. Noise is complex and Gaussian under every cell, by default as strong as what the map's lowest third shows.

use super::cores::{IdleCores, each};
use super::modes::{PoseMode, modes};
use super::{ExploredState, Halt};
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::geometry::{Mat3, Vec3};
use crate::mhp::{FitError, Objective, Problem, Weight, percentile, without};
use crate::radar::{Quantity, View};
use crate::task::Progress;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::{Rng, SeedableRng, rngs::StdRng};
use rand_distr::StandardNormal;
use serde::Serialize;
use std::sync::Arc;

/// Step of the differences, m: that over which a bone's penalty bends.
const STEP_M: f64 = 1e-3;
/// What the body's own terms weigh at least: where a pose space holds the body the settings leave them out, and nothing else of the
/// prior is in the joints' positions.
const LEAST_KINE: f64 = 0.5;
/// Maps with added noise that the gradient is taken at.
const DRAWS: usize = 48;
/// Nothing spreads farther than this, m.
const LOOSE_M: f64 = 0.5;
/// The least curvature of a direction that the echo fixes well, of the largest.
const WELL: f64 = 0.02;
/// Directions that are told.
const TOLD: usize = 6;
/// The share of a map's cells, percent, that show noise alone, and −ln of the rest: the quantile of an exponential.
const NOISE_PCT: f64 = 30.0;

/// How strong the noise is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub enum Noise {
    /// As strong as the lowest cells of each map say.
    #[default]
    Measured,
    /// So many dB below the largest cell of each map's EM region.
    SnrDb(f64),
}

/// A direction in which the pose is hardly fixed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnseenDirection {
    /// The named direction that it is most like.
    pub name: String,
    /// How much: the cosine between the two.
    pub likeness: f64,
    /// How far the joints may move along it, mm: one standard deviation, the longest way of a joint.
    pub spread_mm: f64,
    /// What the echo has in what fixes it, 0..1; the rest is the prior's.
    pub echo_share: f64,
    /// Displacement of every joint at one standard deviation, m.
    #[serde(skip)]
    pub displacement: Vec<Vec3>,
}

/// What the echo and the prior fix of a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Observability {
    /// Where the joints are, m.
    pub positions: Vec<Vec3>,
    /// Covariance of each joint as far as the echo alone fixes it, m².
    pub echo: Vec<Mat3>,
    /// Covariance of each joint over refits of maps with that noise, m².
    pub refits: Vec<Mat3>,
    /// Largest over smallest eigenvalue of the echo's matrix, and of echo's and prior's together; infinite where one is 0.
    pub condition: [f64; 2],
    /// Directions that the echo fixes, of all: tr((A + B + ρ)⁻¹ A).
    pub fixed: [f64; 2],
    /// Standard deviation of the noise in each map, of its largest cell in the EM region.
    pub noise: Vec<f64>,
    /// Root mean square over the joints of how far refits spread, mm; and what the echo alone leaves open, mm.
    pub spread_mm: [f64; 2],
    /// The least observable directions, the widest first.
    pub unseen: Vec<UnseenDirection>,
}

/// The gradient in the joints' positions: that of w_EM L_EM, and that of all other terms.
fn gradients(objective: &mut Objective, config: &FitConfig, params: &Pppr) -> [Vec<f64>; 2] {
    let evaluation = objective.evaluate(params);
    let em: Vec<f64> = evaluation.em_gradient().group(Group::Position).iter().map(|x| config.w_em * x).collect();
    let mut rest = vec![0.0; em.len()];
    for weight in Weight::ALL.iter().filter(|weight| **weight != Weight::Em) {
        let of = evaluation.gradients[*weight as usize].group(Group::Position);
        let factor = if *weight == Weight::Kine { weight.of(config).max(LEAST_KINE) } else { weight.of(config) };
        rest.iter_mut().zip(of).for_each(|(sum, x)| *sum += factor * x);
    }
    [em, rest]
}

/// The symmetric part of a matrix without its negative directions.
fn positive(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut eigen = SymmetricEigen::new((matrix + matrix.transpose()) * 0.5);
    eigen.eigenvalues.iter_mut().for_each(|x| *x = x.max(0.0));
    eigen.recompose()
}

/// Largest over smallest eigenvalue.
fn condition(matrix: &DMatrix<f64>) -> f64 {
    let eigen = SymmetricEigen::new(matrix.clone()).eigenvalues;
    let (least, most) = (eigen.min(), eigen.max());
    // What rounding makes of 0 is no eigenvalue.
    if least > most * 1e-14 { most / least } else { f64::INFINITY }
}

fn blocks(matrix: &DMatrix<f64>) -> Vec<Mat3> {
    let block = |joint: usize| std::array::from_fn(|i| std::array::from_fn(|k| matrix[(3 * joint + i, 3 * joint + k)]));
    (0..matrix.nrows() / 3).map(block).collect()
}

/// The standard deviation of the noise in I and in Q of a map, and of its largest cell in a region.
fn noise_of(noise: Noise, view: &View, map: &[f64], region: &[usize]) -> (f64, f64) {
    let power = |x: f64| match view.quantity {
        Quantity::Amplitude => x * x,
        Quantity::Power => x.max(0.0),
    };
    let largest = region.iter().filter_map(|&cell| map.get(cell)).map(|&x| power(x)).fold(0.0, f64::max);
    let variance = match noise {
        Noise::SnrDb(snr) => largest * 10f64.powf(-snr / 10.0) / 2.0,
        Noise::Measured => {
            let powers: Vec<f64> = map.iter().filter(|x| x.is_finite()).map(|&x| power(x)).collect();
            percentile(&powers, NOISE_PCT) / (-2.0 * (1.0 - NOISE_PCT / 100.0_f64).ln())
        }
    };
    let sigma = variance.max(0.0).sqrt();
    (sigma, if largest > 0.0 { sigma / largest.sqrt() } else { 0.0 })
}

/// A map with complex Gaussian noise of this standard deviation in I and Q added to every cell, whose phase does not matter.
pub(super) fn noisy(map: &[f64], quantity: Quantity, sigma: f64, rng: &mut impl Rng) -> Vec<f64> {
    let one = |&x: &f64| {
        let amplitude = if quantity == Quantity::Power { x.max(0.0).sqrt() } else { x };
        let (i, q): (f64, f64) = (rng.sample(StandardNormal), rng.sample(StandardNormal));
        let power = (amplitude + sigma * i).powi(2) + (sigma * q).powi(2);
        if quantity == Quantity::Power { power } else { power.sqrt() }
    };
    map.iter().map(one).collect()
}

/// The problem with noise on its own maps, drawn by number; without the frames around it.
pub(super) fn noisy_problem(problem: &Problem, sigmas: &[f64], draw: u64) -> Result<Problem, FitError> {
    let mut rng = StdRng::seed_from_u64(0x0B5E_4E0B ^ draw.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let maps: Vec<Vec<f64>> = problem
        .views
        .iter()
        .enumerate()
        .map(|(k, view)| noisy(problem.map(k), view.quantity, sigmas.get(k).copied().unwrap_or(0.0), &mut rng))
        .collect();
    let slices: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    let noisy = Problem::new(problem.radar.clone(), problem.skeleton.clone(), problem.views.clone(), &slices)?;
    Ok(noisy.calibrated_as(problem))
}

/// What fixes the pose of a state. Directions are told from the middle of the views' radars; erased cells are those of no map, with
/// noise or without.
///
/// # Errors
/// As [`Objective::new`], or where it was cancelled.
pub fn observability(
    state: &ExploredState,
    noise: Noise,
    (cores, progress): (&IdleCores, &Progress),
) -> Result<Observability, Halt> {
    let (problem, params, seen) = (&state.problem, &state.params, state.seen()?);
    let plain = state.objective(&seen)?;
    let sigmas: Vec<(f64, f64)> = problem
        .views
        .iter()
        .enumerate()
        .map(|(k, view)| noise_of(noise, view, seen.map(k), &plain.regions()[k].indices(&view.shape())))
        .collect();
    let size = params.group(Group::Position).len();
    progress.begin("differences of the gradient", size as u64 + DRAWS as u64);
    let only: Vec<f64> = sigmas.iter().map(|(sigma, _)| *sigma).collect();
    let mut draws = vec![Vec::new(); DRAWS];
    let draw = |(): &mut (), draw: usize, _: &super::cores::Hand<'_>| -> Result<Vec<f64>, Halt> {
        let noisy = Arc::new(noisy_problem(problem, &only, draw as u64).map_err(Halt::failed)?);
        let noisy = without(&noisy, &state.erased).map_err(Halt::failed)?;
        progress.advance(1);
        let [em, _] = gradients(&mut state.objective(&noisy)?, &state.config, params);
        Ok(em)
    };
    each((cores, progress), DRAWS, || (), draw, |k, gradient| draws[k] = gradient)?;
    let c = covariance(&draws, size);
    let [a, b] = curvature((state, &seen), size, (cores, progress))?;
    let spread = Spread::of(a, &b, &c);
    let noise = sigmas.iter().map(|(_, of)| *of).collect();
    Ok(judged(problem, params, &spread, noise))
}

/// A and B by central differences along each coordinate.
fn curvature(
    (state, seen): (&ExploredState, &Arc<Problem>),
    size: usize,
    (cores, progress): (&IdleCores, &Progress),
) -> Result<[DMatrix<f64>; 2], Halt> {
    let mut columns: Vec<[Vec<f64>; 2]> = vec![Default::default(); size];
    let difference = |objective: &mut Result<Objective, Halt>, column: usize, _: &super::cores::Hand<'_>| {
        let objective = objective.as_mut().map_err(|halt| halt.clone())?;
        let mut at = |by: f64| {
            let mut moved = state.params.clone();
            moved.group_mut(Group::Position)[column] += by;
            gradients(objective, &state.config, &moved)
        };
        let (more, less) = (at(STEP_M), at(-STEP_M));
        progress.advance(1);
        let slope = |k: usize| more[k].iter().zip(&less[k]).map(|(a, b)| (a - b) / (2.0 * STEP_M)).collect();
        Ok::<[Vec<f64>; 2], Halt>(std::array::from_fn(slope))
    };
    each((cores, progress), size, || state.objective(seen), difference, |k, column| columns[k] = column)?;
    let matrix = |which: usize| positive(&DMatrix::from_fn(size, size, |row, column| columns[column][which][row]));
    Ok([matrix(0), matrix(1)])
}

/// What curvature and noise make of each other.
struct Spread {
    a: DMatrix<f64>,
    together: DMatrix<f64>,
    /// Σ
    refits: DMatrix<f64>,
    /// E
    echo: DMatrix<f64>,
    /// s² (A + B + ρ)⁻¹
    left: DMatrix<f64>,
    /// tr((A + B + ρ)⁻¹ A)
    fixed: f64,
}

impl Spread {
    fn of(a: DMatrix<f64>, b: &DMatrix<f64>, c: &DMatrix<f64>) -> Self {
        let together = &a + b;
        let along = |matrix: &DMatrix<f64>, v: &DVector<f64>| (v.transpose() * matrix * v)[(0, 0)];
        let eigen = SymmetricEigen::new(a.clone());
        // The noise in units of the curvature: the median over the directions that the echo fixes well.
        let most = eigen.eigenvalues.max();
        let mut ratios: Vec<f64> = (0..a.nrows())
            .filter(|&k| eigen.eigenvalues[k] > WELL * most)
            .map(|k| along(c, &eigen.eigenvectors.column(k).into_owned()) / eigen.eigenvalues[k])
            .collect();
        ratios.sort_by(f64::total_cmp);
        let scale_sq = ratios.get(ratios.len() / 2).copied().unwrap_or(0.0).max(1e-300);
        let bound = scale_sq / (LOOSE_M * LOOSE_M);
        let floored = |matrix: &DMatrix<f64>| {
            let mut eigen = SymmetricEigen::new(matrix.clone());
            eigen.eigenvalues.iter_mut().for_each(|x| *x = 1.0 / (*x + bound));
            eigen.recompose()
        };
        // Where the noise pulls and nothing holds, a refit goes as far as the bound.
        let mut moves = SymmetricEigen::new(together.clone());
        for k in 0..a.nrows() {
            let pull = along(c, &moves.eigenvectors.column(k).into_owned()).max(0.0).sqrt();
            moves.eigenvalues[k] = 1.0 / moves.eigenvalues[k].max(pull / LOOSE_M).max(bound);
        }
        let m = moves.recompose();
        let inverse = floored(&together);
        let fixed = (&inverse * &a).trace();
        Self { refits: &m * c * &m, echo: floored(&a) * scale_sq, left: inverse * scale_sq, fixed, a, together }
    }
}

fn covariance(draws: &[Vec<f64>], size: usize) -> DMatrix<f64> {
    let count = draws.len().max(2) as f64;
    let mean = DVector::from_fn(size, |k, _| draws.iter().map(|draw| draw[k]).sum::<f64>() / count);
    let mut sum = DMatrix::zeros(size, size);
    for draw in draws {
        let off = DVector::from_column_slice(draw) - &mean;
        sum += &off * off.transpose();
    }
    sum / (count - 1.0)
}

fn judged(problem: &Problem, params: &Pppr, spread: &Spread, noise: Vec<f64>) -> Observability {
    let Spread { a, together, refits, echo, left, fixed } = spread;
    let (size, positions) = (a.nrows(), params.positions().to_vec());
    let rms = |of: &DMatrix<f64>| 1000.0 * (of.trace() / (size / 3).max(1) as f64).max(0.0).sqrt();
    let spread_mm = [rms(refits), rms(echo)];
    let named = modes(
        &problem.skeleton,
        &positions,
        crate::geometry::mean(
            &problem.views.iter().map(|view| view.pose.world_from_view([0.0; 3])).collect::<Vec<_>>(),
        ),
    );
    let eigen = SymmetricEigen::new(left.clone());
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&i, &k| eigen.eigenvalues[k].total_cmp(&eigen.eigenvalues[i]));
    let unseen = order.into_iter().take(TOLD).filter_map(|k| {
        let v: DVector<f64> = eigen.eigenvectors.column(k).into_owned();
        unseen(&named, &v, eigen.eigenvalues[k].max(0.0).sqrt(), (a, together))
    });
    Observability {
        echo: blocks(echo),
        refits: blocks(refits),
        condition: [condition(a), condition(together)],
        fixed: [*fixed, size as f64],
        noise,
        spread_mm,
        unseen: unseen.collect(),
        positions,
    }
}

fn unseen(
    named: &[PoseMode],
    v: &DVector<f64>,
    sigma: f64,
    (a, together): (&DMatrix<f64>, &DMatrix<f64>),
) -> Option<UnseenDirection> {
    let like = named.iter().map(|mode| (mode, mode.likeness(v)));
    let (mode, likeness) = like.max_by(|x, y| x.1.abs().total_cmp(&y.1.abs()))?;
    let along = |matrix: &DMatrix<f64>| (v.transpose() * matrix * v)[(0, 0)];
    let all = along(together);
    // Pointing the way that its name does.
    let sign = if likeness < 0.0 { -sigma } else { sigma };
    let displacement: Vec<Vec3> =
        (0..v.len() / 3).map(|joint| std::array::from_fn(|k| sign * v[3 * joint + k])).collect();
    let spread_mm = displacement.iter().map(|d| 1000.0 * crate::geometry::norm(*d)).fold(0.0, f64::max);
    Some(UnseenDirection {
        name: mode.name.clone(),
        likeness: likeness.abs(),
        spread_mm,
        echo_share: if all > 0.0 { (along(a) / all).clamp(0.0, 1.0) } else { 0.0 },
        displacement,
    })
}
