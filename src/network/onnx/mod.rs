//! Models of others in ONNX: RETR, HuprModel, PoseformerV2 or whatever was exported, run by tract.
//!
//! ```text
//! frame, fits around ──> an input a tensor (maps, PPPR-Heatmap, PPPR-PC, PPPR, joints of the fit) ──> M.onnx ──> joints, m
//! ```
//!
//! A model says of its tensors no more than their names and sizes. What they are, [`OnnxDescription`] says: `M.onnx.toml` beside
//! `M.onnx`.

mod describe;
mod input;
mod run;

pub use describe::{About, InputDescription, InputKind, Normalisation, OnnxDescription, OutputDescription};
pub use run::OnnxModel;
