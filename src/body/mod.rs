//! The human body: skeleton topologies, the PPPR parameters that are optimised, and a body that walks.

mod pppr;
mod skeleton;
mod skeletons;
mod surface;
mod walker;

pub use pppr::{Group, Pppr, PpprShape};
pub use skeleton::{Side, Skeleton};
pub use surface::{BodySurface, SurfacePoint};
pub use walker::{BodyPose, Path, Segment, SegmentFrame, Walker};
