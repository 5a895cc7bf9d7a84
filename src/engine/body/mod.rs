//! The human body: skeleton topologies, the PPPR parameters that are optimised, and bodies that move.

mod figure;
mod gait;
mod motion;
mod parts;
mod pppr;
mod prior;
mod segment;
mod skeleton;
mod skeletons;
mod surface;

pub use figure::{Anchor, Build, Posture};
pub use gait::{Gait, Path};
pub use motion::{Motion, Performer};
pub use parts::{HEAD, PARTS, Parts, Scatterer, is_named, scatterer};
pub use pppr::{Group, Pppr, PpprShape};
#[cfg(feature = "train")]
pub use prior::{MOTION_COUNTS, MOTION_JOINTS, MotionClip, MotionCoverage, learn_motion, motion_coverage};
pub use prior::{Mixture, MotionPrior, MotionStart};
pub use segment::{BodyPose, Segment, SegmentFrame};
pub use skeleton::{Side, Skeleton};
pub(crate) use skeletons::COCO_JOINTS;
pub use surface::{BodySurface, Capsule, SurfacePoint};
