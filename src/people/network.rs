//! The classifier: 12 → 64 → 32 → 5 with ReLU, read from its committed weights; f32.

use super::error::PeopleError;
use serde::{Deserialize, Serialize};

/// Features of a vector.
pub const FEATURES: usize = 12;
/// Classes: 0, 1, 2, 3, 4 and more.
pub const CLASSES: usize = 5;
/// Widths of the layers.
pub const LAYERS: [usize; 4] = [FEATURES, 64, 32, CLASSES];

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
    /// Zeros of the right shape: says that every count is as probable as every other.
    pub fn untrained() -> Self {
        let layer =
            |widths: &[usize]| Layer { weight: vec![vec![0.0; widths[0]]; widths[1]], bias: vec![0.0; widths[1]] };
        let layers = LAYERS.windows(2).map(layer).collect();
        Self { header: Vec::new(), mean: vec![0.0; FEATURES], scale: vec![1.0; FEATURES], layers }
    }

    /// Reads a network.
    ///
    /// # Errors
    /// Where the text is no network of [`LAYERS`] with finite weights.
    pub fn from_json(text: &str) -> Result<Self, PeopleError> {
        let network: Self =
            serde_json::from_str(text).map_err(|error| PeopleError::Weights { message: error.to_string() })?;
        network.check()?;
        Ok(network)
    }

    /// The weights of the counter that come with the program.
    ///
    /// # Errors
    /// Where they are damaged.
    pub fn bundled() -> Result<Self, PeopleError> {
        Self::from_json(include_str!("../../assets/counter.json"))
    }

    /// Those of the classifier alone ([`super::map_statistics`]), which the counter is compared with.
    ///
    /// # Errors
    /// Where they are damaged.
    pub fn alone() -> Result<Self, PeopleError> {
        Self::from_json(include_str!("../../assets/counter-alone.json"))
    }

    fn check(&self) -> Result<(), PeopleError> {
        let wrong = |message: String| Err(PeopleError::Weights { message });
        if self.mean.len() != FEATURES || self.scale.len() != FEATURES || self.layers.len() + 1 != LAYERS.len() {
            return wrong(format!("expected {FEATURES} means and scales and {} layers", LAYERS.len() - 1));
        }
        for (layer, widths) in self.layers.iter().zip(LAYERS.windows(2)) {
            let rows = layer.weight.len() == widths[1] && layer.weight.iter().all(|row| row.len() == widths[0]);
            if !rows || layer.bias.len() != widths[1] {
                return wrong(format!("expected a layer of {} by {}", widths[1], widths[0]));
            }
        }
        let numbers = self.layers.iter().flat_map(|l| l.weight.iter().flatten().chain(&l.bias));
        if !numbers.chain(&self.mean).chain(&self.scale).all(|x| x.is_finite()) || self.scale.contains(&0.0) {
            return wrong("a weight is not finite, or a scale is zero".into());
        }
        Ok(())
    }

    /// Softmax probabilities of the classes.
    pub fn probabilities(&self, features: &[f32; FEATURES]) -> [f64; CLASSES] {
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

fn softmax(logits: &[f32]) -> [f64; CLASSES] {
    let top = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let mut p: [f64; CLASSES] = std::array::from_fn(|k| logits.get(k).map_or(0.0, |x| f64::from(x - top).exp()));
    let sum: f64 = p.iter().sum();
    for p in &mut p {
        *p /= sum;
    }
    p
}
