//! The numerics of `mhp-inspector`: geometry, radar, body, settings, the fit, people in maps, and the synthetic source.
//!
//! It opens no data set, draws nothing and starts no thread that outlives a call. The program hands its rooms on under their own
//! names: `mhp_inspector::mhp` is [`mhp`]. Why a crate of its own: what is slow here is optimised in every profile, and compiled
//! once for the program, its tests and its benches.

pub mod body;
pub mod config;
pub mod dense;
pub mod geometry;
pub mod input;
pub mod mhp;
pub mod people;
pub mod radar;
pub mod simulate;
