//! A state taken home: its Gaussians as PLY, its curves as CSV. (Its parameters as npz: [`crate::dataset::write_pppr`].)

mod curves;
mod ply;

pub use curves::{CurveRow, curve_columns, curves_csv, write_curves};
pub use ply::{ply, write_ply};
