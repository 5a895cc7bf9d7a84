//! Metrics of a fit.

mod metrics;

pub use metrics::{JointErrors, joint_errors, majpe_mm, pa_majpe_mm};
