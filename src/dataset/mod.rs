//! Data sets: what a frame is, and how it is read from disk.
//!
//! A [`Dataset`] is an index of names and what is true of every frame ([`DatasetInfo`]); it opens without reading a
//! single frame. Where files say nothing of their axes, nobody guesses behind the user's back: a manifest, a preset or a
//! remembered choice says it, and what had to be assumed is listed. [`OpenJob`] and [`Loader`] do both off the window's
//! thread.

mod axes_text;
mod cache;
mod error;
mod frame;
mod inputs;
mod job;
pub mod layout;
mod loader;
mod manifest;
mod maps;
mod names;
mod natural;
pub mod npz;
mod pppr_io;
mod sample;
mod set;
mod walk;

/// Persons of a frame that labels or truth may speak of. A room holds fewer; a damaged count would take all memory.
pub const MAX_PERSONS: usize = 256;

pub use axes_text::{axes_badge, axis_position, axis_words, system_words, view_words};
pub use cache::{Cache, DEFAULT_BUDGET, FrameCache};
pub use error::DatasetError;
pub use frame::{Frame, Heatmap, ImageAnnotations, Truth};
pub use job::OpenJob;
pub use layout::{BareCatalog, BareChoice, LAYOUTS, Layout, MapArray, Remembered, Stored, XRF55_STEPS};
pub use loader::{Loaded, Loader};
pub use manifest::Manifest;
pub use maps::MapReader;
pub use npz::NpzError;
pub use pppr_io::{read_pppr, write_pppr};
pub use sample::bundled_sample;
pub use set::{Dataset, DatasetInfo, MANIFEST_NAME, OpenOptions};
