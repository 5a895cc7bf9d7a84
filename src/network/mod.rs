//! MLP+PPPR: a small network that reads what a fit found, or the maps themselves, and says where the joints are (paper A.6).
//!
//! ```text
//! frame ──> features (PPPR, PPPR-Heatmap, heatmap, joints of the fit) ──> 2048 ──ReLU──> 1792 ──ReLU──> 3 N_j
//! ```
//!
//! **Where the paper's 48 comes from.** A joint of PPPR has 3 + 3 + 4 + 3 + 1 + N_d numbers, 46 for N_d = 32; with the opacity α = σ(β)
//! and the radial velocity v_r they are 48. The paper does not say which 48; this is what was taken. With another N_d the width is
//! 16 + N_d. The mean over the joints throws the pose away: `mlp` is the paper's network, `mlp-joints` the same on every joint's
//! numbers, `mlp-window` on those of five frames. Both of the latter read and answer joints about the middle of the fitted body.
//!
//! Models of others come in ONNX, with a description of their tensors ([`OnnxDescription`]); [`open_model`] opens either.
//!
//! Weights are a safetensors file whose metadata is the model's card ([`ModelCard`]). Reading and answering ([`PoseNetwork`]) need
//! nothing of what training needs, which is candle behind the feature `train`.

mod card;
mod examples;
mod features;
mod joint_model;
mod model;
mod onnx;
#[cfg(feature = "train")]
mod train;

pub use card::{Architecture, Features, ModelCard};
pub use examples::{Example, ExampleSet, ParamsOf, examples, prediction_inputs};
pub use features::{input_width, person_input};
pub use joint_model::{JointModel, ModelInput, open_model};
pub use model::{DenseLayer, ModelError, PoseNetwork};
pub use onnx::{About, InputDescription, InputKind, Normalisation, OnnxDescription, OnnxModel, OutputDescription};
#[cfg(feature = "train")]
pub use train::{TrainFault, TrainPoseOptions, TrainedEpoch, train_pose};
