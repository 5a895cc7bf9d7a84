//! The radar: its chirp, the axes of its maps, and the views that a frame is made of.

mod axis;
mod config;
mod view;

pub use axis::{Axis, AxisKind, Spacing};
pub use config::{RadarConfig, SPEED_OF_LIGHT};
pub use view::{PointSpread, Quantity, View};
