//! Data sets: what a frame is, and how it is read from disk.
//!
//! A [`Dataset`] is an index of names and what is true of every frame ([`DatasetInfo`]); it opens without reading a
//! single frame. Where files say nothing of their axes, nobody guesses behind the user's back: a manifest, a preset or a
//! remembered choice says it, and what had to be assumed is listed. [`OpenJob`] and [`Loader`] do both off the window's
//! thread.

mod bare;
mod cache;
mod error;
mod files;
mod frame;
mod generic;
mod hupr;
mod inputs;
mod job;
mod loader;
mod manifest;
mod maps;
mod mmvr;
pub mod npz;
mod pppr_io;
mod sample;
mod set;
mod source;
mod truth;
mod walk;
mod words;
mod xrf55;

/// Persons of a frame that labels or truth may speak of. A room holds fewer; a damaged count would take all memory.
pub const MAX_PERSONS: usize = 256;

pub use bare::{BareCatalog, BareChoice, Remembered};
pub use cache::{Cache, DEFAULT_BUDGET, FrameCache};
pub use error::DatasetError;
pub use frame::{Frame, Heatmap, ImageAnnotations, Truth};
pub(crate) use hupr::{LEVEL as HUPR_LEVEL, LEVELS as HUPR_LEVELS};
pub use job::OpenJob;
pub use loader::{Loaded, Loader};
pub use manifest::{Layout, Manifest};
pub use maps::MapReader;
pub use npz::NpzError;
pub use pppr_io::{read_pppr, write_pppr};
pub use sample::bundled_sample;
pub use set::{Dataset, DatasetInfo, MANIFEST_NAME, OpenOptions};
pub use words::{axes_badge, axis_position, axis_words, system_words, view_words};
pub use xrf55::STEPS as XRF55_STEPS;
