//! Data sets: what a frame is, and how it is read from disk.

mod frame;

pub use frame::{Frame, Heatmap, ImageAnnotations, Truth};
