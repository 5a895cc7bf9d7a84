//! What the maps of a frame show, and those of the frames around it: below the problem, which keeps it, and below the start
//! and the objective, which read it.
//!
//! `saliency.rs` tells how far each cell of a map rises above its background, `variation.rs` what changes with time, and
//! `temporal.rs` puts both together for the frame and its neighbours. `triangulate.rs` finds the point that the views agree
//! on, `middle.rs` and `height.rs` the body there, `range_offset.rs` by how much their ranges differ, `track.rs` follows it through the frames around, and `anchors.rs` says
//! where the temporal term wants each person.

mod anchors;
mod height;
mod middle;
mod neighbour;
mod range_offset;
mod saliency;
mod temporal;
mod track;
mod triangulate;
mod variation;

pub(super) use anchors::{anchors, behind_skin};
pub(super) use height::{Expectation, Stature, bent_if_below};
pub(super) use middle::{apart_m, centre, near};
pub use neighbour::Neighbour;
pub(super) use range_offset::range_offsets;
pub use saliency::Peak;
pub(super) use saliency::SaliencyMap;
pub(super) use temporal::{Contexts, Reading, TemporalContext};
pub(super) use track::{Sighting, Track, track};
pub(super) use triangulate::{Mark, triangulate, triangulate_from};
