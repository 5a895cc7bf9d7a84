//! The human body: skeleton topologies and the PPPR parameters that are optimised.

mod pppr;
mod skeleton;
mod skeletons;

pub use pppr::{Group, Pppr, PpprShape};
pub use skeleton::{Side, Skeleton};
