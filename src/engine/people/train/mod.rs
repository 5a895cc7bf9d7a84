//! Training of the classifier, through candle: cross-entropy of the count, Adam 1e-3, dropout 0.3 (appendix B); besides that a
//! step that falls to nothing, and noise on the features: with some hundred scenes a network learns them by heart.
//!
//! The truth is the count of a frame, never of a cluster: the distributions of a frame's clusters are convolved, and the
//! gradient goes through that sum.

mod examples;
mod maps;

pub use examples::{CounterExample, examples, recordings};
pub use maps::{MapLesson, train_on_maps};

use super::counter::{Counter, MOST_CLUSTERS, NOBODY, agreed, convolve};
use super::network::{CLASSES, Layer, Network, widths};
use super::scan::{HISTORY, Scan};
use candle_core::{D, DType, Device, Result, Tensor, Var};
use candle_nn::optim::{AdamW, Optimizer as _, ParamsAdamW};
use rand::{Rng, SeedableRng, rngs::StdRng, seq::SliceRandom as _};
use rand_distr::StandardNormal;

/// Vectors of a frame at most.
const ROWS: usize = MOST_CLUSTERS;

/// The feature that changes its sign in a mirror: y of the centroid.
const LATERAL: usize = 1;

/// How much all lessons with 0, 1, 2, 3, 4 people together count: much as 1, 2 and 3 occur (91, 8, 1 %), the rare ones more,
/// so that they are learnt at all.
const OCCURRENCE: [f32; CLASSES] = [8.0, 80.0, 14.0, 4.0, 2.0];

/// What a frame teaches.
#[derive(Debug, Clone, PartialEq)]
pub struct CounterLesson {
    /// Features of up to eight clusters, whose counts add up.
    pub rows: Vec<Vec<f32>>,
    /// How many people there are.
    pub people: usize,
    /// Whether the rows are features of clusters, which a mirror changes.
    pub placed: bool,
}

impl CounterLesson {
    /// A frame with `people` people, scanned after those `before` it, the latest first.
    pub fn of(counter: &Counter, now: &Scan, before: &[&Scan], people: usize) -> Self {
        let rows = counter.describe(now, before).features.iter().map(|row| row.to_vec()).collect();
        Self { rows, people, placed: true }
    }

    /// The same scene left and right exchanged: a radar does not care, and what is learnt must not either.
    fn mirrored(&self) -> Self {
        let mirror = |row: &Vec<f32>| {
            let mut row = row.clone();
            row[LATERAL] *= if self.placed { -1.0 } else { 1.0 };
            row
        };
        Self { rows: self.rows.iter().map(mirror).collect(), ..*self }
    }

    /// What a network says of it alone: the probabilities of the counts.
    pub fn answer(&self, network: &Network) -> [f64; CLASSES] {
        self.rows.iter().fold(NOBODY, |sum, row| convolve(&sum, &network.probabilities(row)))
    }
}

/// What the frames of a sequence up to a lesson agree on, as the counter does: `said` of each of them, the earliest first. The
/// first frame of a sequence has nothing to be compared with; it counts as long as it is alone.
pub fn pooled(said: &[[f64; CLASSES]]) -> [f64; CLASSES] {
    let known = if said.len() > 1 { &said[1..] } else { said };
    agreed(&known[known.len().saturating_sub(HISTORY + 1)..])
}

/// How to train.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainOptions {
    /// Passes over the lessons.
    pub epochs: usize,
    /// Lessons a step.
    pub batch: usize,
    /// Adam's first step; it falls to nothing along half a cosine.
    pub learning_rate: f64,
    /// Share of the weights that a step of size 1 would take off.
    pub weight_decay: f64,
    /// Standard deviation of what is added to the features, of which each varies by 1: no two frames are quite alike.
    pub noise: f64,
    /// Share of the first layer's outputs that is dropped.
    pub dropout: f64,
    /// How much all lessons with 0, 1, … people together count, one against the other.
    pub weights: [f32; CLASSES],
    /// Seed of the first weights, the order of the lessons and the dropped outputs.
    pub seed: u64,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self {
            epochs: 40,
            batch: 32,
            learning_rate: 1e-3,
            weight_decay: 0.05,
            noise: 0.2,
            dropout: 0.3,
            weights: OCCURRENCE,
            seed: 1,
        }
    }
}

impl TrainOptions {
    /// Adam's step in an epoch, counted from 0.
    fn step_of(&self, epoch: usize) -> f64 {
        let done = epoch as f64 / self.epochs as f64;
        0.5 * self.learning_rate * (1.0 + (std::f64::consts::PI * done).cos())
    }
}

/// Trains a network; `told` hears epoch and mean loss.
///
/// # Errors
/// candle's, which would be a mistake in here.
pub fn train(lessons: &[CounterLesson], options: &TrainOptions, told: impl FnMut(usize, f32)) -> Result<Network> {
    let mut rng = StdRng::seed_from_u64(options.seed);
    let lessons: Vec<CounterLesson> = lessons.iter().flat_map(|lesson| [lesson.clone(), lesson.mirrored()]).collect();
    let (mean, scale) = moments(&lessons);
    let people: Vec<usize> = lessons.iter().map(|lesson| lesson.people).collect();
    let weights = shared(&people, options.weights);
    let options = TrainOptions { weights, ..*options };
    let model = Model::new(mean.len(), &mut rng)?;
    let loss = |chosen: &[usize], rng: &mut StdRng| {
        let batch: Vec<&CounterLesson> = chosen.iter().filter_map(|&i| lessons.get(i)).collect();
        model.loss(&batch, (&mean, &scale), &options, rng)
    };
    descend((model.vars(), lessons.len()), &options, &mut rng, loss, told)?;
    Ok(Network { header: Vec::new(), mean, scale, layers: model.layers()? })
}

/// Goes down the loss of batches of so many lessons, told by their places, with AdamW; `told` hears epoch and mean loss.
fn descend(
    (vars, lessons): (Vec<Var>, usize),
    options: &TrainOptions,
    rng: &mut StdRng,
    loss: impl Fn(&[usize], &mut StdRng) -> Result<Tensor>,
    mut told: impl FnMut(usize, f32),
) -> Result<()> {
    let parameters =
        ParamsAdamW { lr: options.learning_rate, weight_decay: options.weight_decay, ..ParamsAdamW::default() };
    let mut adam = AdamW::new(vars, parameters)?;
    let mut order: Vec<usize> = (0..lessons).collect();
    for epoch in 0..options.epochs {
        order.shuffle(rng);
        adam.set_learning_rate(options.step_of(epoch));
        let mut sum = 0.0;
        for chosen in order.chunks(options.batch.max(1)) {
            let loss = loss(chosen, rng)?;
            adam.backward_step(&loss)?;
            sum += loss.to_scalar::<f32>()? * chosen.len() as f32;
        }
        told(epoch + 1, sum / lessons.max(1) as f32);
    }
    Ok(())
}

/// What one lesson of each number of people counts, so that together they count as asked for; 1 on average.
fn shared(people: &[usize], weights: [f32; CLASSES]) -> [f32; CLASSES] {
    let all: f32 = weights.iter().sum();
    let of = |k: usize| people.iter().filter(|people| (**people).min(CLASSES - 1) == k).count().max(1);
    std::array::from_fn(|k| weights[k] / all * people.len() as f32 / of(k) as f32)
}

/// What the outputs of a layer are multiplied by where some are dropped: 0, or what makes up for those.
fn dropped(elements: usize, dropout: f64, rng: &mut StdRng) -> Vec<f32> {
    let kept = (1.0 / (1.0 - dropout)) as f32;
    (0..elements).map(|_| if rng.random_bool(dropout) { 0.0 } else { kept }).collect()
}

/// Mean and standard deviation of each feature.
fn moments(lessons: &[CounterLesson]) -> (Vec<f32>, Vec<f32>) {
    let rows: Vec<&Vec<f32>> = lessons.iter().flat_map(|lesson| &lesson.rows).collect();
    let inputs = rows.first().map_or(0, |row| row.len());
    let n = rows.len().max(1) as f64;
    let (mut means, mut scales) = (Vec::new(), Vec::new());
    for k in 0..inputs {
        let mean = rows.iter().map(|row| f64::from(row[k])).sum::<f64>() / n;
        let variance = rows.iter().map(|row| (f64::from(row[k]) - mean).powi(2)).sum::<f64>() / n;
        means.push(mean as f32);
        scales.push(if variance > 1e-12 { variance.sqrt() as f32 } else { 1.0 });
    }
    (means, scales)
}

struct Model {
    /// Weight (outputs, inputs) and bias of each layer.
    layers: Vec<(Var, Var)>,
    /// (CLASSES², CLASSES): which sum a pair of counts gives.
    sums: Tensor,
}

impl Model {
    /// Weights uniform in ±√(6/inputs) (He), no bias.
    fn new(inputs: usize, rng: &mut StdRng) -> Result<Self> {
        let mut layers = Vec::new();
        for (inputs, outputs) in widths(inputs) {
            let bound = (6.0 / inputs as f32).sqrt();
            let weights: Vec<f32> = (0..inputs * outputs).map(|_| rng.random_range(-bound..bound)).collect();
            let weight = Var::from_vec(weights, (outputs, inputs), &Device::Cpu)?;
            layers.push((weight, Var::zeros(outputs, DType::F32, &Device::Cpu)?));
        }
        let pair = |k: usize| (k / CLASSES + k % CLASSES).min(CLASSES - 1);
        let sums = (0..CLASSES * CLASSES * CLASSES).map(|k| f32::from(u8::from(pair(k / CLASSES) == k % CLASSES)));
        let sums = Tensor::from_vec(sums.collect::<Vec<f32>>(), (CLASSES * CLASSES, CLASSES), &Device::Cpu)?;
        Ok(Self { layers, sums })
    }

    fn vars(&self) -> Vec<Var> {
        self.layers.iter().flat_map(|(weight, bias)| [weight.clone(), bias.clone()]).collect()
    }

    /// Cross-entropy of the counts of a batch.
    fn loss(
        &self,
        batch: &[&CounterLesson],
        (mean, scale): (&[f32], &[f32]),
        options: &TrainOptions,
        rng: &mut StdRng,
    ) -> Result<Tensor> {
        let n = batch.len();
        let (mut inputs, mut there, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for lesson in batch {
            for k in 0..ROWS {
                let row = lesson.rows.get(k);
                there.push(f32::from(u8::from(row.is_some())));
                match row {
                    Some(row) => inputs.extend(row.iter().zip(mean).zip(scale).map(|((x, m), s)| (x - m) / s)),
                    None => inputs.extend(std::iter::repeat_n(0.0, mean.len())),
                }
            }
            let class = lesson.people.min(CLASSES - 1);
            truth.extend((0..CLASSES).map(|k| if k == class { options.weights[k] } else { 0.0 }));
        }
        for x in &mut inputs {
            *x += options.noise as f32 * rng.sample::<f32, _>(StandardNormal);
        }
        let inputs = Tensor::from_vec(inputs, (n * ROWS, mean.len()), &Device::Cpu)?;
        let there = Tensor::from_vec(there, (n, ROWS, 1), &Device::Cpu)?;
        let truth = Tensor::from_vec(truth, (n, CLASSES), &Device::Cpu)?;
        let logits = self.forward(&inputs, options.dropout, rng)?;
        let each = candle_nn::ops::softmax(&logits, D::Minus1)?.reshape((n, ROWS, CLASSES))?;
        // A row that is not there is nobody for certain.
        let nobody = Tensor::new(&[1.0f32, 0.0, 0.0, 0.0, 0.0], &Device::Cpu)?.reshape((1, 1, CLASSES))?;
        let each = (each.broadcast_mul(&there)? + there.affine(-1.0, 1.0)?.broadcast_mul(&nobody)?)?;
        let mut sum = each.narrow(1, 0, 1)?.squeeze(1)?;
        for k in 1..ROWS {
            let next = each.narrow(1, k, 1)?;
            let pairs = sum.unsqueeze(2)?.broadcast_mul(&next)?.reshape((n, CLASSES * CLASSES))?;
            sum = pairs.matmul(&self.sums)?;
        }
        let likelihood = (sum + 1e-9)?.log()?;
        (truth.mul(&likelihood)?.sum_all()?.neg()? / n as f64)?.reshape(())
    }

    fn forward(&self, inputs: &Tensor, dropout: f64, rng: &mut StdRng) -> Result<Tensor> {
        let mut x = inputs.clone();
        for (k, (weight, bias)) in self.layers.iter().enumerate() {
            x = x.matmul(&weight.t()?)?.broadcast_add(bias)?;
            if k + 1 < self.layers.len() {
                x = x.relu()?;
            }
            if k == 0 && dropout > 0.0 {
                let mask = dropped(x.elem_count(), dropout, rng);
                x = x.mul(&Tensor::from_vec(mask, x.shape().clone(), &Device::Cpu)?)?;
            }
        }
        Ok(x)
    }

    fn layers(&self) -> Result<Vec<Layer>> {
        let layer = |(weight, bias): &(Var, Var)| Ok(Layer { weight: weight.to_vec2()?, bias: bias.to_vec1()? });
        self.layers.iter().map(layer).collect()
    }
}
