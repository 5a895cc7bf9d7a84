//! What is taken home: a state's Gaussians as PLY and its curves as CSV, and the simulated maps of whole data sets in the
//! input's own files. (Parameters as npz: [`crate::dataset::write_pppr`].)

mod cloud_files;
mod curves;
mod error;
mod heatmap;
mod layout;
mod ply;

pub use cloud_files::{write_cloud_npz, write_cloud_pcd, write_cloud_ply};
pub use curves::{CurveRow, curve_columns, curves_csv, write_curves};
pub use error::ExportError;
pub use heatmap::HeatmapExport;
pub use ply::{ply, write_ply};
