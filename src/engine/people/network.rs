//! The classifier: features → 64 → 32 → 5 with ReLU, read from its committed weights; f32.

use super::error::PeopleError;
use super::features::FEATURES;
use super::map_statistics::STATISTICS;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Classes: 0, 1, 2, 3, 4 and more.
pub const CLASSES: usize = 5;
/// Widths of the layers after the inputs.
pub const LAYERS: [usize; 3] = [64, 32, CLASSES];

/// A fully connected layer: y = W x + b.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Rows: outputs; columns: inputs.
    pub weight: Vec<Vec<f32>>,
    /// One an output.
    pub bias: Vec<f32>,
}

/// The network with the scale of its inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Network {
    /// How it came about: the command, the seeds and what was measured.
    pub header: Vec<String>,
    /// Subtracted from the features.
    pub mean: Vec<f32>,
    /// Then divided by.
    pub scale: Vec<f32>,
    /// The three layers.
    pub layers: Vec<Layer>,
}

impl Network {
    /// Zeros for so many inputs: says that every count is as probable as every other.
    pub fn untrained(inputs: usize) -> Self {
        let layer = |(from, to): (usize, usize)| Layer { weight: vec![vec![0.0; from]; to], bias: vec![0.0; to] };
        let layers = widths(inputs).map(layer).collect();
        Self { header: Vec::new(), mean: vec![0.0; inputs], scale: vec![1.0; inputs], layers }
    }

    /// Reads a network of so many inputs.
    ///
    /// # Errors
    /// Where the text is no such network of [`LAYERS`] with finite weights.
    pub fn from_json(text: &str, inputs: usize) -> Result<Self, PeopleError> {
        let network: Self =
            serde_json::from_str(text).map_err(|error| PeopleError::Weights { message: error.to_string() })?;
        network.check(inputs)?;
        Ok(network)
    }

    /// The weights of the counter that come with the program.
    ///
    /// # Errors
    /// Where they are damaged.
    pub fn bundled() -> Result<Self, PeopleError> {
        // A counter is made for every frame of a batch; its weights are read once.
        static READ: OnceLock<Network> = OnceLock::new();
        if let Some(network) = READ.get() {
            return Ok(network.clone());
        }
        let network = Self::from_json(include_str!("../../../assets/counter.json"), FEATURES)?;
        Ok(READ.get_or_init(|| network).clone())
    }

    /// Those of the classifier alone ([`super::map_statistics`]), which the counter is compared with.
    ///
    /// # Errors
    /// Where they are damaged.
    pub fn alone() -> Result<Self, PeopleError> {
        Self::from_json(include_str!("../../../assets/counter-alone.json"), STATISTICS)
    }

    fn check(&self, inputs: usize) -> Result<(), PeopleError> {
        let wrong = |message: String| Err(PeopleError::Weights { message });
        if self.mean.len() != inputs || self.scale.len() != inputs || self.layers.len() != LAYERS.len() {
            return wrong(format!("expected {inputs} means and scales and {} layers", LAYERS.len()));
        }
        for (layer, (from, to)) in self.layers.iter().zip(widths(inputs)) {
            let rows = layer.weight.len() == to && layer.weight.iter().all(|row| row.len() == from);
            if !rows || layer.bias.len() != to {
                return wrong(format!("expected a layer of {to} by {from}"));
            }
        }
        let numbers = self.layers.iter().flat_map(|l| l.weight.iter().flatten().chain(&l.bias));
        if !numbers.chain(&self.mean).chain(&self.scale).all(|x| x.is_finite()) || self.scale.contains(&0.0) {
            return wrong("a weight is not finite, or a scale is zero".into());
        }
        Ok(())
    }

    /// Softmax probabilities of the classes.
    pub fn probabilities(&self, features: &[f32]) -> [f64; CLASSES] {
        let mut x: Vec<f32> =
            features.iter().zip(&self.mean).zip(&self.scale).map(|((x, mean), scale)| (x - mean) / scale).collect();
        for (k, layer) in self.layers.iter().enumerate() {
            let dot = |row: &Vec<f32>| row.iter().zip(&x).map(|(w, x)| w * x).sum::<f32>();
            let y = layer.weight.iter().zip(&layer.bias).map(|(row, bias)| dot(row) + bias);
            x = if k + 1 < self.layers.len() { y.map(|y| y.max(0.0)).collect() } else { y.collect() };
        }
        softmax(&x)
    }
}

/// Inputs and outputs of each layer.
pub(super) fn widths(inputs: usize) -> impl Iterator<Item = (usize, usize)> {
    std::iter::once(inputs).chain(LAYERS).zip(LAYERS)
}

pub(super) fn softmax(logits: &[f32]) -> [f64; CLASSES] {
    let top = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let mut p: [f64; CLASSES] = std::array::from_fn(|k| logits.get(k).map_or(0.0, |x| f64::from(x - top).exp()));
    let sum: f64 = p.iter().sum();
    for p in &mut p {
        *p /= sum;
    }
    p
}
