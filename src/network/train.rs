//! Training through candle: AdamW, dropout, early stopping; every epoch can be the last one before the power fails.
//!
//! A checkpoint holds weights, moments and the best weights so far after each epoch, whole or not at all. The order of the examples and
//! what is dropped follow from seed and epoch alone, so that a training that goes on from a checkpoint comes to the same weights as
//! one that was never stopped (on as many threads).

use super::card::ModelCard;
use super::examples::Example;
use super::model::{DenseLayer, ModelError, PoseNetwork, read_arrays, write_arrays};
use crate::geometry::{norm, sub};
use crate::input::read_bytes;
use candle_core::{Device, Tensor, Var};
use rand::rngs::StdRng;
use rand::seq::SliceRandom as _;
use rand::{Rng as _, SeedableRng as _};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};

/// Adam's.
const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;
/// The smallest spread that inputs and outputs are divided by.
const LEAST_SCALE: f64 = 1e-4;
/// Bytes of a checkpoint that are read.
const MOST_BYTES: u64 = 2 << 30;

/// How to train; the paper's schedule by default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainPoseOptions {
    /// Passes over the examples at most.
    pub epochs: usize,
    /// Passes without a better validation error after which it ends.
    pub patience: usize,
    /// Examples a step.
    pub batch: usize,
    /// AdamW's step.
    pub learning_rate: f64,
    /// AdamW's decay.
    pub weight_decay: f64,
    /// Share of the hidden outputs that is dropped.
    pub dropout: f64,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Seed of weights, order and dropout.
    pub seed: u64,
}

impl Default for TrainPoseOptions {
    fn default() -> Self {
        Self {
            epochs: 200,
            patience: 20,
            batch: 64,
            learning_rate: 1e-3,
            weight_decay: 1e-2,
            dropout: 0.30,
            hidden: vec![2048, 1792],
            seed: 1,
        }
    }
}

/// One epoch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrainedEpoch {
    /// Counted from 1.
    pub epoch: usize,
    /// Mean squared error of the standardised outputs, with dropout.
    pub loss: f64,
    /// MAJPE of the validation, mm.
    pub validation_mm: f64,
    /// The best so far, mm.
    pub best_mm: f64,
}

/// Why a training ended without a model.
#[derive(Debug, thiserror::Error)]
pub enum TrainFault {
    /// candle's.
    #[error("candle: {0}")]
    Candle(#[from] candle_core::Error),
    /// The checkpoint cannot be written.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The checkpoint is of another training.
    #[error("{path}: {message}", path = path.display())]
    Checkpoint {
        /// What differs.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// Nothing to learn from.
    #[error("{0}")]
    Nothing(String),
}

/// What a checkpoint says besides its arrays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State {
    options: TrainPoseOptions,
    data: String,
    card: ModelCard,
    steps: u32,
    best_epoch: usize,
    curves: Vec<TrainedEpoch>,
}

/// Weights with Adam's moments.
struct Learner {
    network: PoseNetwork,
    best: PoseNetwork,
    /// First and second moments of each weight array, then each bias, layer by layer.
    moments: Vec<[Vec<f32>; 2]>,
    state: State,
}

/// Trains on `train`, and stops where the error of `validation` no longer falls. `checkpoint` is written after every epoch, and read
/// first where it is there; `told` hears of every epoch and answers whether to go on: where not, what is there so far comes back.
///
/// # Errors
/// Where there is nothing to learn from, the checkpoint is of another training, or cannot be written.
pub fn train_pose(
    card: &ModelCard,
    train: &[&Example],
    validation: &[&Example],
    options: &TrainPoseOptions,
    checkpoint: Option<&Path>,
    mut told: impl FnMut(&TrainedEpoch) -> bool,
) -> Result<(PoseNetwork, Vec<TrainedEpoch>), TrainFault> {
    if train.is_empty() || validation.is_empty() {
        return Err(TrainFault::Nothing("no examples to learn from, or none to validate with".into()));
    }
    let data = digest(train, validation);
    let known = checkpoint.filter(|path| path.is_file());
    let mut learner = match known {
        Some(path) => Learner::read(path, card, options, &data)?,
        None => Learner::new(card, train, options, data),
    };
    while learner.state.curves.len() < options.epochs && !learner.is_over() {
        let epoch = learner.state.curves.len() + 1;
        let loss = learner.epoch(epoch, train)?;
        let validation_mm = majpe_mm(&learner.network, validation);
        let before = learner.state.curves.last().map_or(f64::INFINITY, |curve| curve.best_mm);
        if validation_mm < before {
            learner.best = learner.network.clone();
            learner.state.best_epoch = epoch;
        }
        let curve = TrainedEpoch { epoch, loss, validation_mm, best_mm: before.min(validation_mm) };
        learner.state.curves.push(curve);
        if let Some(path) = checkpoint {
            learner.write(path)?;
        }
        if !told(&curve) {
            break;
        }
    }
    Ok((learner.best, learner.state.curves))
}

/// Mean distance of the joints over examples, mm.
fn majpe_mm(network: &PoseNetwork, examples: &[&Example]) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for example in examples {
        let truth = example.target.as_chunks::<3>().0;
        for (answer, truth) in network.answer(&example.input).into_iter().zip(truth) {
            sum += norm(sub(answer, truth.map(f64::from)));
            count += 1;
        }
    }
    1000.0 * sum / count.max(1) as f64
}

/// Tells these examples from others.
fn digest(train: &[&Example], validation: &[&Example]) -> String {
    let mut hash = Sha256::new();
    for (part, examples) in [("train", train), ("validation", validation)] {
        hash.update(part);
        for example in examples {
            hash.update(example.frame.to_le_bytes());
            example.input.iter().chain(&example.target).for_each(|x| hash.update(x.to_le_bytes()));
        }
    }
    crate::digest::short(hash)
}

/// Mean and standard deviation of each number.
fn moments<'a>(rows: impl Iterator<Item = &'a [f32]> + Clone, width: usize) -> [Vec<f32>; 2] {
    let n = rows.clone().count().max(1) as f64;
    let mut mean = vec![0.0f64; width];
    for row in rows.clone() {
        mean.iter_mut().zip(row).for_each(|(sum, x)| *sum += f64::from(*x) / n);
    }
    let mut square = vec![0.0f64; width];
    for row in rows {
        square.iter_mut().zip(row).zip(&mean).for_each(|((sum, x), m)| *sum += (f64::from(*x) - m).powi(2) / n);
    }
    let scale = |v: f64| if v.sqrt() < LEAST_SCALE { 1.0 } else { v.sqrt() as f32 };
    [mean.into_iter().map(|x| x as f32).collect(), square.into_iter().map(scale).collect()]
}

impl Learner {
    /// Weights uniform in ±1/√inputs, as PyTorch begins a linear layer; no bias.
    fn new(card: &ModelCard, train: &[&Example], options: &TrainPoseOptions, data: String) -> Self {
        let mut rng = StdRng::seed_from_u64(options.seed);
        let inputs = train.first().map_or(0, |example| example.input.len());
        let outputs = 3 * card.joints.len();
        let widths: Vec<usize> =
            std::iter::once(inputs).chain(options.hidden.iter().copied()).chain([outputs]).collect();
        let layers: Vec<DenseLayer> = widths
            .windows(2)
            .map(|pair| {
                let bound = (1.0 / pair[0].max(1) as f32).sqrt();
                let weight = (0..pair[0] * pair[1]).map(|_| rng.random_range(-bound..bound)).collect();
                DenseLayer { inputs: pair[0], weight, bias: vec![0.0; pair[1]] }
            })
            .collect();
        let input = moments(train.iter().map(|example| example.input.as_slice()), inputs);
        let output = moments(train.iter().map(|example| example.target.as_slice()), outputs);
        let mut network = PoseNetwork { card: card.clone(), input, output, layers };
        network.card.parameters = network.parameters();
        let moments = network
            .layers
            .iter()
            .flat_map(|layer| [layer.weight.len(), layer.bias.len()])
            .map(|n| [vec![0.0; n], vec![0.0; n]])
            .collect();
        let state =
            State { options: options.clone(), data, card: card.clone(), steps: 0, best_epoch: 0, curves: Vec::new() };
        Self { best: network.clone(), network, moments, state }
    }

    fn is_over(&self) -> bool {
        self.state.curves.len() >= self.state.best_epoch + self.state.options.patience
    }

    /// One pass over the examples; the mean loss.
    fn epoch(&mut self, epoch: usize, train: &[&Example]) -> Result<f64, TrainFault> {
        let options = self.state.options.clone();
        let mut rng =
            StdRng::seed_from_u64(options.seed.wrapping_add((epoch as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        let mut order: Vec<usize> = (0..train.len()).collect();
        order.shuffle(&mut rng);
        let mut sum = 0.0;
        for chosen in order.chunks(options.batch.max(1)) {
            let batch: Vec<&Example> = chosen.iter().map(|&k| train[k]).collect();
            sum += self.step(&batch, &options, &mut rng)? * batch.len() as f64;
        }
        Ok(sum / train.len().max(1) as f64)
    }

    fn step(&mut self, batch: &[&Example], options: &TrainPoseOptions, rng: &mut StdRng) -> Result<f64, TrainFault> {
        let (cpu, n) = (Device::Cpu, batch.len());
        let standard = |row: &[f32], [mean, scale]: &[Vec<f32>; 2]| {
            row.iter().zip(mean).zip(scale).map(|((x, m), s)| (x - m) / s).collect::<Vec<f32>>()
        };
        let gather =
            |of: &dyn Fn(&Example) -> Vec<f32>| batch.iter().flat_map(|example| of(example)).collect::<Vec<f32>>();
        let inputs = gather(&|example| standard(&example.input, &self.network.input));
        let targets = gather(&|example| standard(&example.target, &self.network.output));
        let mut x = Tensor::from_vec(inputs, (n, self.network.inputs()), &cpu)?;
        let targets = Tensor::from_vec(targets, (n, self.network.output[0].len()), &cpu)?;
        let mut vars = Vec::with_capacity(self.moments.len());
        let last = self.network.layers.len() - 1;
        for (k, layer) in self.network.layers.iter().enumerate() {
            let outputs = layer.bias.len();
            let weight = Var::from_vec(layer.weight.clone(), (outputs, layer.inputs), &cpu)?;
            let bias = Var::from_vec(layer.bias.clone(), outputs, &cpu)?;
            x = x.matmul(&weight.t()?)?.broadcast_add(&bias)?;
            if k < last {
                x = x.relu()?;
                if options.dropout > 0.0 {
                    let kept = (1.0 / (1.0 - options.dropout)) as f32;
                    let mask: Vec<f32> =
                        (0..n * outputs).map(|_| if rng.random_bool(options.dropout) { 0.0 } else { kept }).collect();
                    x = x.mul(&Tensor::from_vec(mask, (n, outputs), &cpu)?)?;
                }
            }
            vars.extend([weight, bias]);
        }
        let loss = x.sub(&targets)?.sqr()?.mean_all()?;
        let gradients = loss.backward()?;
        self.state.steps += 1;
        for (k, var) in vars.iter().enumerate() {
            let Some(gradient) = gradients.get(var) else { continue };
            let gradient: Vec<f32> = gradient.flatten_all()?.to_vec1()?;
            let layer = &mut self.network.layers[k / 2];
            let (weights, decay) =
                if k % 2 == 0 { (&mut layer.weight, options.weight_decay) } else { (&mut layer.bias, 0.0) };
            adam(weights, &gradient, &mut self.moments[k], self.state.steps, options.learning_rate, decay);
        }
        Ok(f64::from(loss.to_scalar::<f32>()?))
    }

    /// Every array of a checkpoint.
    fn write(&self, path: &Path) -> Result<(), TrainFault> {
        let mut arrays: Vec<(String, Vec<usize>, &[f32])> = Vec::new();
        for (prefix, network) in [("now", &self.network), ("best", &self.best)] {
            for (k, layer) in network.layers.iter().enumerate() {
                arrays.push((format!("{prefix}.{k}.weight"), vec![layer.bias.len(), layer.inputs], &layer.weight));
                arrays.push((format!("{prefix}.{k}.bias"), vec![layer.bias.len()], &layer.bias));
            }
        }
        for (k, [first, second]) in self.moments.iter().enumerate() {
            arrays.push((format!("first.{k}"), vec![first.len()], first));
            arrays.push((format!("second.{k}"), vec![second.len()], second));
        }
        for (name, [mean, scale]) in [("input", &self.network.input), ("output", &self.network.output)] {
            arrays.push((format!("{name}.mean"), vec![mean.len()], mean));
            arrays.push((format!("{name}.scale"), vec![scale.len()], scale));
        }
        let state = serde_json::to_string(&self.state).unwrap_or_default();
        Ok(write_arrays(path, &arrays, &[("state", state)])?)
    }

    fn read(path: &Path, card: &ModelCard, options: &TrainPoseOptions, data: &str) -> Result<Self, TrainFault> {
        let wrong = |message: String| TrainFault::Checkpoint { message, path: path.to_owned() };
        let bytes = read_bytes(path, "a checkpoint", MOST_BYTES).map_err(|error| wrong(error.to_string()))?;
        let (arrays, texts) = read_arrays(&bytes).map_err(wrong)?;
        let state: State = texts
            .get("state")
            .and_then(|text| serde_json::from_str(text).ok())
            .ok_or_else(|| wrong("no checkpoint of train-pose".into()))?;
        // More epochs or patience may be asked for than before.
        let same = TrainPoseOptions { epochs: options.epochs, patience: options.patience, ..state.options.clone() };
        let same_card = (&state.card.joints, state.card.features, state.card.architecture)
            == (&card.joints, card.features, card.architecture);
        if same != *options || state.data != data || !same_card {
            return Err(wrong("it is of a training with other data or options; remove it to begin anew".into()));
        }
        let of = |name: &str| {
            arrays.get(name).map(|(_, numbers)| numbers.clone()).ok_or_else(|| wrong(format!("no tensor `{name}`")))
        };
        let mut networks = Vec::new();
        for prefix in ["now", "best"] {
            let mut layers = Vec::new();
            while let Some((shape, weight)) = arrays.get(&format!("{prefix}.{}.weight", layers.len())) {
                let bias = of(&format!("{prefix}.{}.bias", layers.len()))?;
                layers.push(DenseLayer { inputs: shape.get(1).copied().unwrap_or(0), weight: weight.clone(), bias });
            }
            let input = [of("input.mean")?, of("input.scale")?];
            let output = [of("output.mean")?, of("output.scale")?];
            let mut network = PoseNetwork { card: card.clone(), input, output, layers };
            network.card.parameters = network.parameters();
            networks.push(network);
        }
        let (Some(best), Some(network)) = (networks.pop(), networks.pop()) else {
            return Err(wrong("no weights in it".into()));
        };
        let moments = (0..2 * network.layers.len())
            .map(|k| Ok([of(&format!("first.{k}"))?, of(&format!("second.{k}"))?]))
            .collect::<Result<Vec<_>, TrainFault>>()?;
        Ok(Self { network, best, moments, state: State { options: options.clone(), ..state } })
    }
}

/// One step of AdamW.
fn adam(weights: &mut [f32], gradient: &[f32], moments: &mut [Vec<f32>; 2], step: u32, rate: f64, decay: f64) {
    let [first, second] = moments;
    let (c1, c2) = (1.0 - BETA_1.powi(step as i32), 1.0 - BETA_2.powi(step as i32));
    for (((w, g), m), v) in weights.iter_mut().zip(gradient).zip(first).zip(second) {
        *m = (BETA_1 as f32) * *m + (1.0 - BETA_1 as f32) * g;
        *v = (BETA_2 as f32) * *v + (1.0 - BETA_2 as f32) * g * g;
        let way = f64::from(*m) / c1 / ((f64::from(*v) / c2).sqrt() + EPSILON);
        *w -= (rate * (way + decay * f64::from(*w))) as f32;
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where training fails")]
    use super::super::card::{Architecture, Features};
    use super::*;

    fn examples(count: usize, from: usize) -> Vec<Example> {
        let example = |k: usize| {
            let at = |c: usize| (((k + from) * (c + 3) * 37) % 101) as f32 / 50.0 - 1.0;
            let input: Vec<f32> = (0..6).map(at).collect();
            let target = (0..6).map(|c| 0.7 * input[c] - 0.4 * input[(c + 1) % 6] + 2.0).collect();
            Example { frame: k, input, target, middle: [0.0; 3] }
        };
        (0..count).map(example).collect()
    }

    fn card() -> ModelCard {
        ModelCard {
            features: Features::FitJoints,
            architecture: Architecture::Mlp,
            joints: vec!["a".into(), "b".into()],
            doppler_features: 4,
            maps: Vec::new(),
            centred: false,
            parameters: 0,
            notes: Vec::new(),
        }
    }

    #[test]
    fn a_training_that_is_killed_goes_on_to_the_same_weights() {
        let (train, validation) = (examples(80, 0), examples(20, 1000));
        let (train, validation): (Vec<&Example>, Vec<&Example>) = (train.iter().collect(), validation.iter().collect());
        let options = TrainPoseOptions {
            epochs: 9,
            hidden: vec![24, 16],
            batch: 16,
            learning_rate: 1e-2,
            ..TrainPoseOptions::default()
        };
        let whole = train_pose(&card(), &train, &validation, &options, None, |_| true).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = folder.path().join("checkpoint.safetensors");
        for killed_after in [1, 4, 6] {
            let _ = train_pose(&card(), &train, &validation, &options, Some(&checkpoint), |curve| {
                curve.epoch < killed_after
            });
        }
        let resumed = train_pose(&card(), &train, &validation, &options, Some(&checkpoint), |_| true).unwrap();
        assert_eq!(resumed, whole, "bit by bit");
        let first = whole.1[0].validation_mm;
        assert!(whole.1[8].best_mm < 0.9 * first, "{:?}", whole.1);
        // Another seed is another training.
        let other = TrainPoseOptions { seed: 2, ..options };
        let refused = train_pose(&card(), &train, &validation, &other, Some(&checkpoint), |_| true).unwrap_err();
        assert!(refused.to_string().contains("other data or options"));
    }

    #[test]
    fn it_stops_where_the_validation_no_longer_gets_better() {
        let train = examples(40, 0);
        let validation: Vec<Example> = examples(10, 0)
            .into_iter()
            // Mirrored about the mean: what is learnt makes it worse.
            .map(|example| Example { target: example.target.iter().map(|x| 4.0 - x).collect(), ..example })
            .collect();
        let (train, validation): (Vec<&Example>, Vec<&Example>) = (train.iter().collect(), validation.iter().collect());
        let options = TrainPoseOptions { epochs: 100, patience: 3, hidden: vec![16], ..TrainPoseOptions::default() };
        let (_, curves) = train_pose(&card(), &train, &validation, &options, None, |_| true).unwrap();
        let best = curves.iter().min_by(|a, b| a.validation_mm.total_cmp(&b.validation_mm)).unwrap().epoch;
        assert_eq!(curves.len(), best + 3);
    }
}
