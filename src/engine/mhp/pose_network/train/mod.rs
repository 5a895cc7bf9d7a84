//! Teaching the network: lessons are drawn as they are needed, each is seen twice, mirrored or not.

mod echo;
mod learn;
mod motion;
#[cfg(test)]
mod tests;

pub use motion::{Actors, POSE_STRETCH};

use super::glimpse::{ACROSS, CHANNELS, RANGES, Seen, UP, about, told};
use super::layers::{JOINTS, Layers};
use super::{MIRRORED, MixtureDensityNetwork};
use crate::body::Capsule;
use crate::geometry::Vec3;
use echo::{Frame, Radar, Skin, beside};
use learn::{Adam, Learned, Plan};
use motion::{HZ, Scene, Stretch, shift, trunk};
use rand::{Rng, SeedableRng, rngs::StdRng, seq::SliceRandom as _};
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

/// Frames beside the window that tell what stands there.
const FRAMES_BESIDE: usize = 3;
/// Standard deviation of where the place is taken to be, m: as a rule, and of this share.
const OFF_M: [f64; 2] = [0.1, 0.25];
const FAR_OFF: f64 = 0.15;
/// Shares of lessons with somebody beside, of a frame alone, and without a vertical view.
const BESIDE: f64 = 0.15;
const ALONE: f64 = 0.07;
const FLAT: f64 = 0.04;
/// Shares of windows that end at their middle or one frame after it, and that begin so.
const CUT: [f64; 4] = [0.1, 0.05, 0.05, 0.05];
/// Steps over which training warms up, and lessons that are learned from at once, one after the other.
const WARMING: f64 = 300.0;
const SHARE: usize = 16;

/// How to teach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseTrainOptions {
    /// Rounds; each draws its lessons anew.
    pub rounds: usize,
    /// Lessons of a round.
    pub lessons: usize,
    /// Passes over the lessons of a round.
    pub passes: usize,
    /// Lessons a step.
    pub batch: usize,
    /// Adam's first step; it falls to nothing along half a cosine.
    pub learning_rate: f64,
    /// Share of the lessons with actors of the synthetic source.
    pub acted: f64,
    /// Seed of everything.
    pub seed: u64,
}

impl Default for PoseTrainOptions {
    fn default() -> Self {
        Self { rounds: 160, lessons: 4096, passes: 2, batch: 64, learning_rate: 6e-4, acted: 0.45, seed: 1 }
    }
}

/// What is seen of a person, and where they are.
#[derive(Debug, Clone)]
pub(super) struct PoseLesson {
    pub(super) seen: Seen,
    /// Along the sight, to its left, and up from the radar, from the place, m.
    pub(super) joints: [[f32; 3]; JOINTS],
}

impl PoseLesson {
    /// With left and right exchanged.
    fn mirrored(&self) -> Self {
        let joint = |joint: usize| {
            let [along, left, up] = self.joints[joint];
            [along, -left, up]
        };
        Self { seen: self.seen.mirrored(), joints: MIRRORED.map(joint) }
    }

    /// Lesson `number` of a seed.
    pub(super) fn draw(actors: &Actors, (acted, seed): (f64, u64), number: u64) -> Self {
        let rng = &mut StdRng::seed_from_u64(seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let scene = actors.draw(acted, rng);
        let at = trunk(&scene.stretch[scene.middle]);
        let off = OFF_M[usize::from(rng.random_bool(FAR_OFF))];
        let place = [at[0] + off * normal(rng), at[1] + off * normal(rng)];
        let distance = place[0].hypot(place[1]).max(0.3);
        let sight = [place[0] / distance, place[1] / distance];
        let maps = maps(&scene, (place, distance), (actors, acted), rng);
        let joints = scene.stretch[scene.middle].map(|[x, y, z]| {
            let [x, y] = [x - place[0], y - place[1]];
            [sight[0] * x + sight[1] * y, sight[0] * y - sight[1] * x, z].map(|x| x as f32)
        });
        let alone = rng.random_bool(ALONE);
        let flat = rng.random_bool(FLAT);
        let of_plane = |columns: std::ops::Range<usize>| -> Vec<Vec<f32>> {
            let of_map = |map: &Frame| -> Vec<f32> {
                map.chunks_exact(ACROSS + UP).flat_map(|row| &row[columns.clone()]).copied().collect()
            };
            maps.iter().map(of_map).collect()
        };
        let plane = |columns: std::ops::Range<usize>| {
            let all = of_plane(columns);
            let window: Vec<&[f32]> =
                (0..CHANNELS - 1).map(|k| all[if alone { CHANNELS / 2 - 1 } else { k }].as_slice()).collect();
            let all: Vec<&[f32]> = if alone { Vec::new() } else { all.iter().map(Vec::as_slice).collect() };
            told(&window, &all)
        };
        let seen = Seen {
            horizontal: plane(0..ACROSS),
            vertical: if flat { super::glimpse::nothing(UP) } else { plane(ACROSS..ACROSS + UP) },
            about: about(distance, sight[1], scene.height_m),
        };
        Self { seen, joints }
    }
}

fn normal(rng: &mut StdRng) -> f64 {
    StandardNormal.sample(rng)
}

/// Powers about a place at the times of the window, and at some more.
fn maps(
    scene: &Scene,
    (place, distance): ([f64; 2], f64),
    (actors, acted): (&Actors, f64),
    rng: &mut StdRng,
) -> Vec<Frame> {
    let middle = scene.middle as i64;
    let mut offsets = [-4, -2, 0, 2, 4];
    let drawn: f64 = rng.random_range(0.0..1.0);
    let cut = CUT.iter().scan(0.0, |sum, share| {
        *sum += share;
        Some(*sum)
    });
    match cut.take_while(|sum| *sum <= drawn).count() {
        0 => offsets[3..].fill(0),
        1 => offsets[4] = 2,
        2 => offsets[..2].fill(0),
        3 => offsets[0] = -2,
        _ => {}
    }
    let mut times: Vec<usize> =
        offsets.iter().map(|offset| (middle + offset).clamp(0, POSE_STRETCH as i64 - 1) as usize).collect();
    times.extend((0..FRAMES_BESIDE).map(|_| rng.random_range(0..POSE_STRETCH)));
    let radar = Radar::draw(place, scene.height_m, rng);
    let person = Skin::draw(false, rng);
    let other = rng.random_bool(BESIDE).then(|| {
        let mut other = actors.draw(acted, rng);
        let way = beside(&other.stretch, other.middle, place, rng);
        shift(&mut other.stretch, way);
        (other.stretch, Skin::draw(true, rng))
    });
    let sine = place[1] / distance;
    let looks = 10.0_f64.powf(rng.random_range(0.0..1.6)).sqrt() as f32;
    let mut maps: Vec<Frame> = Vec::with_capacity(times.len());
    for &time in &times {
        let mut map = vec![0.0; RANGES * (ACROSS + UP)];
        let beside = other.iter().flat_map(|(stretch, skin)| skin.hiding(&stretch[time]));
        let hiding: Vec<Capsule> = person.hiding(&scene.stretch[time]).chain(beside).collect();
        let of =
            |stretch: &Stretch, skin: &Skin| skin.echoes(&radar, (&stretch[time], &velocity(stretch, time)), &hiding);
        let mut echoes = of(&scene.stretch, &person);
        echoes.extend(radar.standing(&hiding));
        radar.add(&echoes, (distance, sine), &mut map);
        if let Some((stretch, skin)) = &other {
            radar.add(&of(stretch, skin), (distance, sine), &mut map);
        }
        maps.push(map);
    }
    let brightest = maps[..CHANNELS - 1].iter().flatten().copied().fold(0.0_f32, f32::max);
    let noise = brightest * 10.0_f32.powf(-rng.random_range(2.6..6.2));
    for power in maps.iter_mut().flatten() {
        let drawn: f32 = StandardNormal.sample(rng);
        *power += noise * (1.0 + drawn / looks).abs();
    }
    maps
}

/// Of the joints at a sample of a stretch, m/s.
fn velocity(stretch: &Stretch, at: usize) -> [Vec3; JOINTS] {
    let (before, after) = (at.saturating_sub(1), (at + 1).min(stretch.len() - 1));
    let rate = HZ / (after - before).max(1) as f64;
    std::array::from_fn(|joint| std::array::from_fn(|k| rate * (stretch[after][joint][k] - stretch[before][joint][k])))
}

/// Teaches a network; `on` hears of each round its number, the mean distance of a joint of the likeliest body, m, and −ln of how likely
/// the truth was, a joint.
pub fn train_pose_network(
    actors: &Actors,
    options: &PoseTrainOptions,
    mut on: impl FnMut(usize, [f32; 2]),
) -> Option<MixtureDensityNetwork> {
    let mut rng = StdRng::seed_from_u64(options.seed);
    let plan = Plan::new();
    let mut numbers = plan.first(&mut rng);
    let mut adam = Adam::new(numbers.len());
    let batch = options.batch.max(1);
    let steps = options.rounds * options.passes * options.lessons.div_ceil(batch);
    let mut step = 0;
    for round in 0..options.rounds {
        let drawn = (round * options.lessons) as u64..((round + 1) * options.lessons) as u64;
        let draw = |number: u64| PoseLesson::draw(actors, (options.acted, options.seed), number);
        let lessons: Vec<PoseLesson> = drawn.into_par_iter().map(draw).collect();
        let mut order: Vec<usize> = (0..lessons.len()).collect();
        let mut sums = [0.0_f32; 2];
        for _ in 0..options.passes {
            order.shuffle(&mut rng);
            for chosen in order.chunks(batch) {
                let seed: u64 = rng.random();
                let shares: Vec<&[usize]> = chosen.chunks(SHARE).collect();
                let learned: Vec<Learned> = shares
                    .par_iter()
                    .enumerate()
                    .map(|(k, share)| {
                        let rng = &mut StdRng::seed_from_u64(seed.wrapping_add(k as u64));
                        let share: Vec<&PoseLesson> = share.iter().map(|&k| &lessons[k]).collect();
                        plan.learn(&numbers, &share, Some(rng))
                    })
                    .collect();
                let mut gradient = vec![0.0_f32; numbers.len()];
                for of in learned {
                    gradient.iter_mut().zip(&of.gradient).for_each(|(sum, x)| *sum += x / chosen.len() as f32);
                    sums.iter_mut().zip(of.losses).for_each(|(sum, x)| *sum += x);
                }
                let done = step as f64 / steps as f64;
                let warm = ((step + 1) as f64 / WARMING).min(1.0);
                let rate = options.learning_rate * warm * (0.5 + 0.5 * (std::f64::consts::PI * done).cos());
                adam.step(&mut numbers, &mut gradient, rate as f32);
                step += 1;
            }
        }
        let seen = (options.passes * lessons.len()).max(1) as f32;
        on(round + 1, sums.map(|sum| sum / seen));
    }
    Layers::from_numbers(&numbers).map(MixtureDensityNetwork)
}

/// What a network reaches in lessons of another seed: the mean distance of a joint of the likeliest body, m, and −ln of how likely the
/// truth was, a joint.
pub fn pose_network_reach(network: &MixtureDensityNetwork, actors: &Actors, options: &PoseTrainOptions) -> [f32; 2] {
    let numbers = network.0.numbers();
    let plan = Plan::new();
    let count = options.lessons.max(1);
    let of = |share: usize| {
        let drawn = (share * SHARE..((share + 1) * SHARE).min(count)).map(|k| k as u64);
        let lessons: Vec<PoseLesson> =
            drawn.map(|number| PoseLesson::draw(actors, (options.acted, options.seed), number)).collect();
        plan.learn(&numbers, &lessons.iter().collect::<Vec<_>>(), None).losses
    };
    let all: Vec<[f32; 2]> = (0..count.div_ceil(SHARE)).into_par_iter().map(of).collect();
    std::array::from_fn(|k| all.iter().map(|of| of[k]).sum::<f32>() / count as f32)
}
