//! Data sets: what a frame is, and how it is read from disk.
//!
//! A [`Dataset`] is an index of names and what is true of every frame ([`DatasetInfo`]); it opens without reading a
//! single frame. Where files say nothing of their axes, nobody guesses behind the user's back: a manifest, a preset or a
//! remembered choice says it, and what had to be assumed is listed. [`OpenJob`] and [`Loader`] do both off the window's
//! thread.
//!
//! **What each layout says and does not.** *MMVR* as it is published: Cartesian maps, row 0 far, NaN cells filled before the fit, key
//! points and masks shown as what they are, image pixels; neither chirp nor point-spread function is published. *HuPR*:
//! `single_<k>/{hori,vert}/*.npy` cubes; the map is the amplitude at the elevation bin where all twelve antennas sum, which side
//! is left is assumed. *XRF55*: stacks of 17 maps, assumed to be range × azimuth, as the data set publishes no axes; raw clips, whose
//! maps the chain makes. The loaders of the last two are tested on files synthesised in the published form, no real file was at hand. *HIBER*: two Cartesian maps a frame with
//! what stands still subtracted, chirp and array published; its joints are in the room's frame, and where the radars stand in it is
//! found by `calibrate-room`. *RT-Pose*: Cartesian cubes, Doppler bins summed, or the part of them that a manifest asks for, or its raw
//! cascades made into such cubes; joints in the radar's frame; the chirp of the published cubes is assumed. No real file of these was at
//! hand either. *Captures* of a DCA1000 or a cascade, and
//! cubes of samples: the configuration beside them, `[capture.chirp]`, or the form that the window shows, says the chirp; which side is left and the antennas' places are assumed. *Generic*: a folder with
//! `dataset.toml` and one npz a frame; `samples/walk/dataset.toml` has every key. What is assumed is said on screen and by `info`.

pub mod adc;
mod axes_text;
mod cache;
mod calibration;
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
mod origin;
mod pppr_io;
mod room;
mod sample;
mod set;
mod walk;

/// Persons of a frame that labels or truth may speak of. A room holds fewer; a damaged count would take all memory.
pub const MAX_PERSONS: usize = 256;

pub use axes_text::{axes_badge, axis_position, axis_words, system_words, view_words};
pub use cache::{Cache, DEFAULT_BUDGET, FrameCache};
pub use calibration::{ArrayText, FftText, RadarPreset, SweepText, ViewCalibration, user_radars};
pub use error::DatasetError;
pub use frame::{Frame, Heatmap, ImageAnnotations, Truth, map_cells};
pub use job::OpenJob;
pub use layout::{BareCatalog, BareChoice, ChirpForm, LAYOUTS, Layout, MapArray, Remembered, Stored};
pub use loader::{Loaded, Loader};
pub use manifest::Manifest;
pub use maps::MapReader;
pub(crate) use natural::natural;
pub use npz::NpzError;
pub use origin::{Origin, OriginPart, OriginRule};
pub use pppr_io::{read_pppr, write_pppr};
pub use room::{
    FrameDifference, ROOMS_NAME, RoomJoints, RoomTransform, RoomTransforms, remember_room, write_stated_rooms,
};
pub use sample::bundled_sample;
pub use set::{Dataset, DatasetInfo, MANIFEST_NAME, OpenOptions};
