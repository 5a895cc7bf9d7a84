//! A start perturbed on purpose: the perturbations of the paper's robustness table.
//!
//! Positions and velocities are perturbed last, of a start from the frame's own peaks and of one from the frame before alike. A
//! peak that is missed takes its hill of the map with it: a start looks at all that is lit around a person, and would not
//! notice the loss of a few maxima.
//!
//! Every frame draws its own numbers, from the seed and from the maps themselves: the draw depends neither on the order
//! in which frames are fitted nor on how many.

use crate::body::{Group, Pppr};
use crate::config::InitConfig;
use crate::geometry::{Vec3, norm, scale};
use crate::mhp::Problem;
use rand::{Rng, SeedableRng, rngs::StdRng};
use rand_distr::StandardNormal;

/// What a generator is for; each purpose has its own, so that adding one changes no other.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    Dropout = 1,
    Bias,
    Position,
    Velocity,
}

/// The generator of one frame.
pub(super) fn generator(problem: &Problem, seed: u64, purpose: Purpose) -> StdRng {
    // FNV-1a over the cells' bits.
    let cells = (0..problem.views.len()).flat_map(|k| problem.map(k));
    let frame = cells.fold(0xcbf2_9ce4_8422_2325_u64, |hash, x| (hash ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3));
    StdRng::seed_from_u64(frame ^ seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(purpose as u64))
}

/// Parts `items` into those that are seen and those that are missed, each with probability `init.peak_dropout`, but never
/// all of them.
pub(super) fn missed<T>(problem: &Problem, init: &InitConfig, items: Vec<T>) -> (Vec<T>, Vec<T>) {
    if init.peak_dropout <= 0.0 || items.is_empty() {
        return (items, Vec::new());
    }
    let mut rng = generator(problem, init.seed, Purpose::Dropout);
    let mut keep: Vec<bool> = items.iter().map(|_| rng.random_range(0.0..1.0) >= init.peak_dropout).collect();
    if !keep.contains(&true) {
        let survivor = rng.random_range(0..keep.len());
        keep[survivor] = true;
    }
    let (kept, missed): (Vec<_>, Vec<_>) = items.into_iter().zip(keep).partition(|(_, keep)| *keep);
    let items = |parted: Vec<(T, bool)>| parted.into_iter().map(|(item, _)| item).collect();
    (items(kept), items(missed))
}

/// Adds the bias and noise that settings ask for to positions (m) and velocities (m/s) of a start; paper section 5.5.3.
pub fn perturb(problem: &Problem, init: &InitConfig, params: &mut Pppr) {
    if init.position_bias_m > 0.0 {
        let mut rng = generator(problem, init.seed, Purpose::Bias);
        let joints = params.shape().joints.max(1);
        for person in 0..params.shape().persons {
            let shift = scale(direction(&mut rng), init.position_bias_m);
            for joint in person * joints..(person + 1) * joints {
                let moved = crate::geometry::add(params.position(joint), shift);
                params.set_vec3(Group::Position, joint, moved);
            }
        }
    }
    let noises = [
        (Group::Position, init.position_noise_m, Purpose::Position),
        (Group::Velocity, init.velocity_noise_mps, Purpose::Velocity),
    ];
    for (group, sigma, purpose) in noises.into_iter().filter(|(_, sigma, _)| *sigma > 0.0) {
        let mut rng = generator(problem, init.seed, purpose);
        for x in params.group_mut(group) {
            *x += sigma * rng.sample::<f64, _>(StandardNormal);
        }
    }
}

/// Evenly distributed over the sphere.
fn direction(rng: &mut StdRng) -> Vec3 {
    loop {
        let v: Vec3 = std::array::from_fn(|_| rng.sample(StandardNormal));
        let length = norm(v);
        if length > 1e-9 {
            return scale(v, 1.0 / length);
        }
    }
}
