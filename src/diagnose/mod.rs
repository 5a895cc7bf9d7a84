//! Metrics of a fit, and the evidence for each of the paper's failure modes.

mod assign;
mod evidence;
mod metrics;
mod reprojection;

pub use evidence::{
    Annotated, Calibration, CalibrationError, Curve, EarlierFrame, Evidence, EvidenceInput, Figures, Finding,
    FindingPlace, FrameSet, Input, Measure, STATIC_FRAMES, STATIC_KAPPA_PCT, evidence, with_share,
};
#[cfg(feature = "train")]
pub use evidence::{EvidenceExample, Measured, chosen_examples, learn_curves};
pub use metrics::{
    JointErrors, OSPA_CUTOFF_MM, Similarity, joint_errors, majpe_mm, pa_majpe_mm, paired_joint_distances_mm,
    person_pairs,
};
pub use reprojection::{Reprojection, map_box_coverage, reprojection};
