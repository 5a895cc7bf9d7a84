//! What a fit looks like as the input of a network that was made for measured data: PPPR-Heatmap, maps in the place of measured
//! ones, and PPPR-PC, points where a detector finds something in them.

mod cloud;
mod heatmap;

pub use cloud::{CLOUD_POINTS, CloudPoint, detected_cells, point_cloud};
pub use heatmap::{HeatmapScale, pppr_heatmap};
