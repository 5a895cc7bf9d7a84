//! Metrics of a fit, and the evidence for each of the paper's failure modes.

mod assign;
mod evidence;
mod metrics;
mod reprojection;

pub use evidence::{
    Annotated, EarlierFrame, Evidence, EvidenceInput, Finding, Place, STATIC_FRAMES, STATIC_KAPPA_PCT, evidence,
};
pub use metrics::{JointErrors, joint_errors, majpe_mm, pa_majpe_mm};
pub use reprojection::{Camera, Reprojection, map_box_coverage, reprojection};
