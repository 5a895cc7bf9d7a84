//! What lessons say of the weights, and steps down.

use super::super::glimpse::{ACROSS, RANGES, UP};
use super::super::layers::{
    BODIES, JOINTS, OUT, STRIDES, Shape, TOLD, convolved, flat, product, rectify, shapes, shifted,
};
use super::PoseLesson;
use rand::{Rng, rngs::StdRng};
use std::borrow::Cow;
use std::ops::Range;

/// ln b where training begins, b in m.
const LN_B: f32 = -2.0;
/// Where the joints of somebody who stands are, to the left and up from the radar, m: where training begins, turned every way.
const STANDING: [[f32; 2]; JOINTS] = [
    [0.0, 0.6],
    [0.03, 0.63],
    [-0.03, 0.63],
    [0.07, 0.62],
    [-0.07, 0.62],
    [0.19, 0.4],
    [-0.19, 0.4],
    [0.25, 0.12],
    [-0.25, 0.12],
    [0.25, -0.1],
    [-0.25, -0.1],
    [0.1, -0.08],
    [-0.1, -0.08],
    [0.1, -0.5],
    [-0.1, -0.5],
    [0.1, -0.9],
    [-0.1, -0.9],
];
/// What the joints of a body say counts as much as that of so many that know nothing of each other, of one.
const APART: f32 = super::super::APART as f32;
/// Share of the numbers between dense layers that is dropped.
const DROPPED: f64 = 0.1;
/// Adam's, and the share of the weights that a step of size 1 takes off; a gradient is no longer than this.
const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const DECAY: f32 = 1e-4;
const LONGEST: f32 = 1.0;

/// Where a layer's numbers lie.
#[derive(Debug, Clone)]
struct Place {
    inputs: usize,
    outputs: usize,
    weights: Range<usize>,
    bias: Range<usize>,
}

/// Where the numbers of all layers lie, in the order of `Layers::from_numbers`.
#[derive(Debug)]
pub(super) struct Plan {
    towers: [Vec<Place>; 2],
    dense: Vec<Place>,
    numbers: usize,
}

/// What some lessons say.
pub(super) struct Learned {
    /// Sums over the lessons.
    pub(super) gradient: Vec<f32>,
    /// The mean distance of a joint of the likeliest body, m, and −ln of how likely the truth is, a joint: a mixture of bodies, with a
    /// distribution e^(−d/b) about each joint. Sums over the lessons.
    pub(super) losses: [f32; 2],
}

/// What is kept of a convolution for the way back.
struct Kept {
    /// Of the maps before it.
    size: [usize; 2],
    /// What it multiplies its weights by.
    shifted: Vec<f32>,
    out: Vec<f32>,
    /// Rows and columns of that.
    after: [usize; 2],
}

impl Plan {
    pub(super) fn new() -> Self {
        let mut end = 0;
        let place = |shape: Shape| {
            let weights = end..end + shape.inputs * shape.outputs;
            let bias = weights.end..weights.end + shape.outputs;
            end = bias.end;
            Place { inputs: shape.inputs, outputs: shape.outputs, weights, bias }
        };
        let mut all: Vec<Place> = shapes().into_iter().map(place).collect();
        let dense = all.split_off(2 * STRIDES.len());
        let vertical = all.split_off(STRIDES.len());
        let towers = [all, vertical];
        Self { towers, dense, numbers: end }
    }

    /// Weights uniform in ±√(6/inputs) (He); what the last layer adds are bodies that stand, turned every way.
    pub(super) fn first(&self, rng: &mut StdRng) -> Vec<f32> {
        let mut numbers = vec![0.0; self.numbers];
        for place in self.towers.iter().flatten().chain(&self.dense) {
            let last = place.outputs == TOLD;
            let bound = (6.0 / place.inputs as f32).sqrt() * if last { 0.1 } else { 1.0 };
            numbers[place.weights.clone()].iter_mut().for_each(|w| *w = rng.random_range(-bound..bound));
            if last {
                let mut said = vec![0.0; BODIES];
                for body in 0..BODIES {
                    let (sin, cos) = (std::f32::consts::TAU * body as f32 / BODIES as f32).sin_cos();
                    for [left, up] in STANDING {
                        said.extend([-sin * left, cos * left, up, LN_B]);
                    }
                }
                numbers[place.bias.clone()].copy_from_slice(&said);
            }
        }
        numbers
    }

    /// What lessons say, each mirrored or not and with numbers dropped by chance; as they are without one.
    pub(super) fn learn(&self, numbers: &[f32], lessons: &[&PoseLesson], mut rng: Option<&mut StdRng>) -> Learned {
        let n = lessons.len();
        let mut is_mirrored = || rng.as_deref_mut().is_some_and(|rng| rng.random_bool(0.5));
        let lessons: Vec<Cow<PoseLesson>> = lessons
            .iter()
            .map(|&lesson| if is_mirrored() { Cow::Owned(lesson.mirrored()) } else { Cow::Borrowed(lesson) })
            .collect();
        let mut gradient = vec![0.0; self.numbers];
        // (lessons, numbers) of each dense layer.
        let mut inputs = Vec::with_capacity(n * flat());
        let mut kept: Vec<[Vec<Kept>; 2]> = Vec::with_capacity(n);
        for lesson in &lessons {
            let towers = [
                forwards(numbers, &self.towers[0], &lesson.seen.horizontal, ACROSS),
                forwards(numbers, &self.towers[1], &lesson.seen.vertical, UP),
            ];
            towers.iter().filter_map(|tower| tower.last()).for_each(|last| inputs.extend_from_slice(&last.out));
            inputs.extend(lesson.seen.about);
            kept.push(towers);
        }
        let mut layers = vec![inputs];
        let mut masks = Vec::new();
        for (k, place) in self.dense.iter().enumerate() {
            let last = k + 1 == self.dense.len();
            let mut x = std::mem::take(&mut layers[k]);
            let mask: Vec<f32> = match rng.as_deref_mut().filter(|_| !last) {
                Some(rng) => {
                    let kept = (1.0 / (1.0 - DROPPED)) as f32;
                    x.iter().map(|_| if rng.random_bool(DROPPED) { 0.0 } else { kept }).collect()
                }
                None => vec![1.0; x.len()],
            };
            x.iter_mut().zip(&mask).for_each(|(x, mask)| *x *= mask);
            let mut out = numbers[place.bias.clone()].repeat(n);
            product(&mut out, [n, place.outputs], (&x, false), (&numbers[place.weights.clone()], true), 1.0);
            if !last {
                rectify(&mut out);
            }
            layers[k] = x;
            masks.push(mask);
            layers.push(out);
        }
        let mut losses = [0.0; 2];
        let mut bars = vec![0.0; n * TOLD];
        let told = layers.pop().unwrap_or_default();
        for ((said, bars), lesson) in told.chunks_exact(TOLD).zip(bars.chunks_exact_mut(TOLD)).zip(&lessons) {
            losses.iter_mut().zip(unlikely(said, &lesson.joints, bars)).for_each(|(sum, x)| *sum += x);
        }
        for (k, place) in self.dense.iter().enumerate().rev() {
            let x = &layers[k];
            product(
                &mut gradient[place.weights.clone()],
                [place.outputs, place.inputs],
                (&bars, true),
                (x, false),
                0.0,
            );
            for bars in bars.chunks_exact(place.outputs) {
                gradient[place.bias.clone()].iter_mut().zip(bars).for_each(|(sum, bar)| *sum += bar);
            }
            let mut before = vec![0.0; n * place.inputs];
            let weights = (&numbers[place.weights.clone()], false);
            product(&mut before, [n, place.inputs], (&bars, false), weights, 0.0);
            // Nothing comes through where a number was dropped, or, but for the towers' own, not positive.
            before.iter_mut().zip(&masks[k]).for_each(|(bar, mask)| *bar *= mask);
            if k > 0 {
                before.iter_mut().zip(x).filter(|(_, x)| **x <= 0.0).for_each(|(bar, _)| *bar = 0.0);
            }
            bars = before;
        }
        for (towers, bars) in kept.iter().zip(bars.chunks_exact(flat())) {
            let mut from = 0;
            for (tower, places) in towers.iter().zip(&self.towers) {
                let end = tower.last().map_or(0, |last| last.out.len());
                backwards(numbers, places, tower, &bars[from..from + end], &mut gradient);
                from += end;
            }
        }
        Learned { gradient, losses }
    }
}

fn forwards(numbers: &[f32], places: &[Place], maps: &[f32], columns: usize) -> Vec<Kept> {
    let mut kept: Vec<Kept> = Vec::with_capacity(places.len());
    for (place, stride) in places.iter().zip(STRIDES) {
        let (x, size) = kept.last().map_or((maps, [RANGES, columns]), |kept| (kept.out.as_slice(), kept.after));
        let (shifted, after) = shifted(x, size, stride);
        let out = convolved((&numbers[place.weights.clone()], &numbers[place.bias.clone()]), &shifted, after);
        kept.push(Kept { size, shifted, out, after });
    }
    kept
}

fn backwards(numbers: &[f32], places: &[Place], tower: &[Kept], bars: &[f32], gradient: &mut [f32]) {
    let mut bars = bars.to_vec();
    for (k, (place, kept)) in places.iter().zip(tower).enumerate().rev() {
        bars.iter_mut().zip(&kept.out).filter(|(_, x)| **x <= 0.0).for_each(|(bar, _)| *bar = 0.0);
        let cells = kept.out.len() / place.outputs;
        let size = [place.outputs, place.inputs];
        product(&mut gradient[place.weights.clone()], size, (&bars, false), (&kept.shifted, true), 1.0);
        for (sum, bars) in gradient[place.bias.clone()].iter_mut().zip(bars.chunks_exact(cells)) {
            *sum += bars.iter().sum::<f32>();
        }
        if k == 0 {
            break;
        }
        let mut of_taps = vec![0.0; place.inputs * cells];
        let weights = (&numbers[place.weights.clone()], true);
        product(&mut of_taps, [place.inputs, cells], weights, (&bars, false), 0.0);
        bars = unshifted(&of_taps, kept.size, STRIDES[k]);
    }
}

/// What `shifted` does, backwards: what the cells under all weights say of the maps.
fn unshifted(of_taps: &[f32], [rows, columns]: [usize; 2], stride: usize) -> Vec<f32> {
    let [high, wide] = [rows.div_ceil(stride), columns.div_ceil(stride)];
    let channels = of_taps.len() / (9 * high * wide);
    let mut x = vec![0.0; channels * rows * columns];
    for (tap, of_tap) in of_taps.chunks_exact(high * wide).enumerate() {
        let (channel, dy, dx) = (tap / 9, tap % 9 / 3, tap % 3);
        let map = &mut x[channel * rows * columns..(channel + 1) * rows * columns];
        for (i, of_row) in of_tap.chunks_exact(wide).enumerate() {
            let Some(row) = (i * stride + dy).checked_sub(1).filter(|&row| row < rows) else { continue };
            let map = &mut map[row * columns..(row + 1) * columns];
            for (j, y) in of_row.iter().enumerate() {
                if let Some(value) = (j * stride + dx).checked_sub(1).and_then(|column| map.get_mut(column)) {
                    *value += y;
                }
            }
        }
    }
    x
}

/// Of a lesson: the mean distance of the joints of the likeliest body, m, and −ln of how likely the truth is, a joint; its gradient is
/// written over `bars`.
pub(super) fn unlikely(said: &[f32], truth: &[[f32; 3]; JOINTS], bars: &mut [f32]) -> [f32; 2] {
    let (chances, bodies) = said.split_at(BODIES);
    let whole = ln_sum_exp(chances);
    let mut likely = [0.0; BODIES];
    let mut distances = [0.0; BODIES];
    for (body, joints) in bodies.chunks_exact(JOINTS * OUT).enumerate() {
        let mut sum = 0.0;
        for (said, truth) in joints.chunks_exact(OUT).zip(truth) {
            let off = off(said, truth);
            distances[body] += off / JOINTS as f32;
            sum += 3.0 * said[3] + off * (-said[3]).exp();
        }
        likely[body] = chances[body] - whole - APART * sum;
    }
    let all = ln_sum_exp(&likely);
    let (of_chances, of_bodies) = bars.split_at_mut(BODIES);
    for (body, (bars, joints)) in
        of_bodies.chunks_exact_mut(JOINTS * OUT).zip(bodies.chunks_exact(JOINTS * OUT)).enumerate()
    {
        let share = (likely[body] - all).exp();
        of_chances[body] = ((chances[body] - whole).exp() - share) / (APART * JOINTS as f32);
        let gain = share / JOINTS as f32;
        for ((bars, said), truth) in bars.chunks_exact_mut(OUT).zip(joints.chunks_exact(OUT)).zip(truth) {
            let (off, narrow) = (off(said, truth), (-said[3]).exp());
            for k in 0..3 {
                bars[k] = gain * narrow * (said[k] - truth[k]) / off;
            }
            bars[3] = gain * (3.0 - off * narrow);
        }
    }
    let best = (0..BODIES).max_by(|a, b| chances[*a].total_cmp(&chances[*b])).unwrap_or(0);
    [distances[best], -all / (APART * JOINTS as f32)]
}

fn off(said: &[f32], truth: &[f32; 3]) -> f32 {
    ((0..3).map(|k| (said[k] - truth[k]).powi(2)).sum::<f32>() + 1e-8).sqrt()
}

fn ln_sum_exp(of: &[f32]) -> f32 {
    let most = of.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    most + of.iter().map(|x| (x - most).exp()).sum::<f32>().ln()
}

/// Moments of the gradient.
pub(super) struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    steps: i32,
}

impl Adam {
    pub(super) fn new(numbers: usize) -> Self {
        Self { first: vec![0.0; numbers], second: vec![0.0; numbers], steps: 0 }
    }

    /// One step of size `rate`.
    pub(super) fn step(&mut self, numbers: &mut [f32], gradient: &mut [f32], rate: f32) {
        let length = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
        let shortened = (LONGEST / length.max(1e-12)).min(1.0);
        self.steps += 1;
        let unbias = [BETA_1, BETA_2].map(|beta| 1.0 / (1.0 - beta.powi(self.steps)));
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((x, g), (m, v)) in numbers.iter_mut().zip(gradient).zip(moments) {
            let g = shortened * *g;
            *m = BETA_1 * *m + (1.0 - BETA_1) * g;
            *v = BETA_2 * *v + (1.0 - BETA_2) * g * g;
            *x -= rate * (*m * unbias[0] / ((*v * unbias[1]).sqrt() + 1e-8) + DECAY * *x);
        }
    }
}
