//! The network as it answers: layers of weights, what its inputs and outputs are scaled by, its file.

use super::card::ModelCard;
use crate::dense::dense;
use crate::geometry::Vec3;
use crate::input::{place, read_bytes};
use crate::output::replace_file;
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Bytes of a model that are read.
pub(super) const MOST_BYTES: u64 = 512 << 20;
/// The key of the card in the file's metadata.
const CARD: &str = "card";

/// Why a model could not be read or used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The operating system refused.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What it said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// It cannot be written.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// It is no model of this program, or a damaged one.
    #[error("{path}: no model of MLP+PPPR: {message}", path = path.display())]
    Content {
        /// What is wrong, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// The description of a model in ONNX has a key that is none, or one without meaning.
    #[error("{place}: {message}", place = place(path, *line))]
    Description {
        /// What is wrong, and what was expected.
        message: String,
        /// The line, counted from 1, where one is known.
        line: Option<usize>,
        /// The file.
        path: PathBuf,
    },
    /// Nothing says what a model in ONNX reads.
    #[error("{path}: nothing says what its tensors are; expected {beside}, or --description FILE (`predict --help` shows one). {has}",
            path = path.display(), beside = beside.display())]
    NotDescribed {
        /// Its tensors, in words.
        has: String,
        /// Where the description was looked for.
        beside: PathBuf,
        /// The model.
        path: PathBuf,
    },
    /// It is no model in ONNX, or none that can be run.
    #[error("{path}: {message}", path = path.display())]
    Onnx {
        /// What is wrong.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// It does not fit the data.
    #[error("{path}: the model does not fit the data: {message}", path = path.display())]
    Misfit {
        /// What differs.
        message: String,
        /// The model.
        path: PathBuf,
    },
}

/// Weights (outputs, inputs), row by row, and biases.
#[derive(Debug, Clone, PartialEq)]
pub struct DenseLayer {
    /// Inputs.
    pub inputs: usize,
    /// Row-major (outputs × inputs).
    pub weight: Vec<f32>,
    /// One an output.
    pub bias: Vec<f32>,
}

impl DenseLayer {
    fn apply(&self, x: &[f32]) -> Vec<f32> {
        dense(&self.weight, &self.bias, x)
    }
}

/// A network with its card.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseNetwork {
    /// What it is.
    pub card: ModelCard,
    /// Taken off the inputs, and what they are then divided by.
    pub input: [Vec<f32>; 2],
    /// Added to the outputs, once multiplied by the second, m.
    pub output: [Vec<f32>; 2],
    /// From the first to the last, with ReLU between them.
    pub layers: Vec<DenseLayer>,
}

impl PoseNetwork {
    /// The joints that it answers, m: in the radar's frame, or about the body's middle where its card says so.
    pub fn answer(&self, input: &[f32]) -> Vec<Vec3> {
        let [mean, scale] = &self.input;
        let mut x: Vec<f32> = input.iter().zip(mean).zip(scale).map(|((x, m), s)| (x - m) / s).collect();
        for (k, layer) in self.layers.iter().enumerate() {
            x = layer.apply(&x);
            if k + 1 < self.layers.len() {
                for x in &mut x {
                    *x = x.max(0.0);
                }
            }
        }
        let [mean, scale] = &self.output;
        let out: Vec<f64> = x.iter().zip(mean).zip(scale).map(|((x, m), s)| f64::from(x * s + m)).collect();
        out.as_chunks().0.to_vec()
    }

    /// Numbers that it reads.
    pub fn inputs(&self) -> usize {
        self.input[0].len()
    }

    /// All weights and biases.
    pub fn parameters(&self) -> usize {
        self.layers.iter().map(|layer| layer.weight.len() + layer.bias.len()).sum()
    }

    fn arrays(&self) -> Vec<(String, Vec<usize>, &[f32])> {
        let mut arrays: Vec<(String, Vec<usize>, &[f32])> = vec![
            ("input.mean".into(), vec![self.inputs()], &self.input[0]),
            ("input.scale".into(), vec![self.inputs()], &self.input[1]),
            ("output.mean".into(), vec![self.output[0].len()], &self.output[0]),
            ("output.scale".into(), vec![self.output[1].len()], &self.output[1]),
        ];
        for (k, layer) in self.layers.iter().enumerate() {
            arrays.push((format!("layers.{k}.weight"), vec![layer.bias.len(), layer.inputs], &layer.weight));
            arrays.push((format!("layers.{k}.bias"), vec![layer.bias.len()], &layer.bias));
        }
        arrays
    }

    /// Writes the weights with the card as safetensors, whole or not at all; the same network gives the same bytes.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ModelError> {
        write_arrays(path, &self.arrays(), &[(CARD, serde_json::to_string(&self.card).unwrap_or_default())])
    }

    /// Reads a model.
    ///
    /// # Errors
    /// Where it cannot be read, is none, or its layers do not fit together.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        let bytes = read_bytes(path, "a model as safetensors", MOST_BYTES)
            .map_err(|reason| ModelError::Read { reason, path: path.to_owned() })?;
        let wrong = |message: String| ModelError::Content { message, path: path.to_owned() };
        let (arrays, metadata) = read_arrays(&bytes).map_err(wrong)?;
        let card =
            metadata.get(CARD).ok_or_else(|| wrong("no card in its metadata; expected a file of train-pose".into()))?;
        let card: ModelCard = serde_json::from_str(card).map_err(|error| wrong(format!("its card: {error}")))?;
        let array = |name: &str| arrays.get(name).cloned().ok_or_else(|| wrong(format!("no tensor `{name}`")));
        let mut layers = Vec::new();
        while arrays.contains_key(&format!("layers.{}.weight", layers.len())) {
            let k = layers.len();
            let ((shape, weight), (_, bias)) =
                (array(&format!("layers.{k}.weight"))?, array(&format!("layers.{k}.bias"))?);
            let [outputs, inputs] = shape[..] else {
                return Err(wrong(format!("`layers.{k}.weight` has shape {shape:?}; expected (outputs, inputs)")));
            };
            if bias.len() != outputs {
                return Err(wrong(format!("`layers.{k}.bias` has {} numbers; expected {outputs}", bias.len())));
            }
            layers.push(DenseLayer { inputs, weight, bias });
        }
        let of = |name: &str| array(name).map(|(_, numbers)| numbers);
        let network = Self {
            input: [of("input.mean")?, of("input.scale")?],
            output: [of("output.mean")?, of("output.scale")?],
            layers,
            card,
        };
        network.fault().map_or(Ok(network), |message| Err(wrong(message)))
    }

    /// What does not fit together.
    fn fault(&self) -> Option<String> {
        let outputs = 3 * self.card.joints.len();
        let mut width = self.inputs();
        for (k, layer) in self.layers.iter().enumerate() {
            if layer.inputs != width {
                return Some(format!("layer {k} reads {} numbers; the one before gives {width}", layer.inputs));
            }
            width = layer.bias.len();
        }
        let scales = [(&self.input, self.inputs()), (&self.output, outputs)];
        if self.layers.is_empty() || width != outputs || scales.iter().any(|(of, n)| of.iter().any(|of| of.len() != *n))
        {
            return Some(format!(
                "it gives {width} numbers for {} joints; expected three a joint",
                self.card.joints.len()
            ));
        }
        let all = self.arrays();
        let bad = all.iter().find(|(.., numbers)| numbers.iter().any(|x| !x.is_finite()));
        bad.map(|(name, ..)| format!("`{name}` holds what is no finite number"))
    }
}

/// Arrays of f32 with texts, as safetensors.
pub(super) fn write_arrays(
    path: &Path,
    arrays: &[(String, Vec<usize>, &[f32])],
    texts: &[(&str, String)],
) -> Result<(), ModelError> {
    let failed = |reason| ModelError::Write { reason, path: path.to_owned() };
    let bytes: Vec<Vec<u8>> =
        arrays.iter().map(|(.., data)| data.iter().flat_map(|x| x.to_le_bytes()).collect()).collect();
    let mut views = Vec::with_capacity(arrays.len());
    for ((name, shape, _), bytes) in arrays.iter().zip(&bytes) {
        let view = TensorView::new(Dtype::F32, shape.clone(), bytes).map_err(|e| failed(std::io::Error::other(e)))?;
        views.push((name.clone(), view));
    }
    let metadata: HashMap<String, String> = texts.iter().map(|(key, text)| ((*key).to_owned(), text.clone())).collect();
    let whole = serialize(views, Some(metadata)).map_err(|error| failed(std::io::Error::other(error)))?;
    replace_file(path, |out| out.write_all(&whole)).map_err(failed)
}

/// Arrays by name: shape and numbers.
pub(super) type Arrays = HashMap<String, (Vec<usize>, Vec<f32>)>;

/// The arrays and the texts of a file.
pub(super) fn read_arrays(bytes: &[u8]) -> Result<(Arrays, HashMap<String, String>), String> {
    let file = SafeTensors::deserialize(bytes).map_err(|error| format!("no safetensors: {error}"))?;
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|error| format!("no safetensors: {error}"))?;
    let mut arrays = Arrays::new();
    for (name, view) in file.iter() {
        if view.dtype() != Dtype::F32 {
            return Err(format!("`{name}` is {:?}; expected F32", view.dtype()));
        }
        let numbers = view.data().as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
        arrays.insert(name.to_owned(), (view.shape().to_vec(), numbers));
    }
    Ok((arrays, metadata.metadata().clone().unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where a file cannot be written")]
    use super::super::card::{Architecture, Features};
    use super::*;

    fn network() -> PoseNetwork {
        let layer = |inputs: usize, outputs: usize| DenseLayer {
            inputs,
            weight: (0..inputs * outputs).map(|k| ((k % 7) as f32 - 3.0) * 0.1).collect(),
            bias: (0..outputs).map(|k| k as f32 * 0.01).collect(),
        };
        let card = ModelCard {
            features: Features::FitJoints,
            architecture: Architecture::Mlp,
            joints: vec!["a".into(), "b".into()],
            doppler_features: 32,
            maps: Vec::new(),
            centred: false,
            parameters: 0,
            notes: vec!["note".into()],
        };
        let layers = vec![layer(6, 11), layer(11, 6)];
        PoseNetwork { card, input: [vec![0.5; 6], vec![2.0; 6]], output: [vec![1.0; 6], vec![0.3; 6]], layers }
    }

    #[test]
    fn a_network_answers_as_it_is_written_on_paper() {
        let network = network();
        let x: Vec<f32> = (0..6).map(|k| k as f32).collect();
        let hidden: Vec<f32> = (0..11)
            .map(|r| {
                let sum: f32 = (0..6).map(|c| network.layers[0].weight[r * 6 + c] * (x[c] - 0.5) / 2.0).sum();
                (sum + network.layers[0].bias[r]).max(0.0)
            })
            .collect();
        let out = |r: usize| {
            let sum: f32 = (0..11).map(|c| network.layers[1].weight[r * 11 + c] * hidden[c]).sum();
            (sum + network.layers[1].bias[r]) * 0.3 + 1.0
        };
        let answer = network.answer(&x);
        for k in 0..6 {
            assert!((answer[k / 3][k % 3] - f64::from(out(k))).abs() < 1e-6);
        }
        assert_eq!(network.parameters(), 6 * 11 + 11 + 11 * 6 + 6);
    }

    #[test]
    fn a_file_reads_back_and_damage_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.safetensors");
        network().write(&path).unwrap();
        assert_eq!(PoseNetwork::read(&path).unwrap(), network());
        let first = std::fs::read(&path).unwrap();
        network().write(&path).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), first, "the same bytes");
        let told = |network: PoseNetwork| {
            network.write(&path).unwrap();
            PoseNetwork::read(&path).unwrap_err().to_string()
        };
        let mut short = network();
        short.card.joints.pop();
        assert!(told(short).contains("it gives 6 numbers for 1 joints"));
        let mut odd = network();
        odd.layers[1].inputs = 6;
        odd.layers[1].weight.truncate(36);
        assert!(told(odd).contains("layer 1 reads 6 numbers; the one before gives 11"));
        let mut bad = network();
        bad.layers[0].bias[2] = f32::NAN;
        assert!(told(bad).contains("`layers.0.bias` holds what is no finite number"));
        std::fs::write(&path, &first[..first.len() / 2]).unwrap();
        assert!(PoseNetwork::read(&path).unwrap_err().to_string().contains("no model of MLP+PPPR: no safetensors"));
    }
}
