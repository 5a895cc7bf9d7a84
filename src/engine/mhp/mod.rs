//! MHP, the fit: initialisation, forward model, objective with hand-written gradients, Adam, convergence, one `step`.
//!
//! [`Problem`] is one frame; [`Objective`] answers loss and gradient for parameters; [`Fitter`] takes Adam steps. The
//! forward model goes from joints to cells in two steps, `splat.rs` (a joint in a view, f64; in `batch.rs` several at once)
//! and `kernel.rs` (cells, plainly) or `tiles/mod.rs` (cells, f32, fast), and back in the same (moments) and
//! `adjoint.rs`. `em.rs` compares the masks, `terms/mod.rs` has the table of all terms, `objective.rs` adds them up.
//!
//! The stages, each of which uses those above it only:
//!
//! 1. the terms of the loss, `terms/mod.rs`; numbers: `types.rs`, `percentile.rs`, `fill.rs`, `scalar.rs`, `lanes.rs`,
//!    `batch.rs`, `floors.rs`
//! 2. a joint in a view: `triad.rs`, `gaussian.rs`, `splat.rs`, `adjoint.rs`; the skin between the joints, `skin.rs`
//! 3. cells: `kernel.rs`, `tiles/mod.rs`, `cell_box.rs`; masks and levels over them, `levels.rs`, `em.rs`
//! 4. what the maps of a frame and those around it show: `region.rs`, `template.rs`, `context/mod.rs`; without the stars of
//!    echoes, `sidelobes.rs`
//! 5. a frame: `frame_em.rs`, `problem.rs`, `reduced.rs`, `erased.rs`, `simulate.rs`, `returns.rs`, `signal.rs`
//! 6. where a network expects the joints: `pose_network/mod.rs`
//! 7. the objective: `objective.rs`; a window of frames: `motion/mod.rs`
//! 8. the fit: `convergence.rs`, `articulation.rs`, `adam.rs`, `fitter.rs`; and the start of one: `init/mod.rs`
//!
//! **What it does not do.** A fit by masks moves the body onto its echo and does not find the pose; one of a window by levels
//! (`motion/mod.rs`) finds that of who walks. Yaw and left/right are hardly visible
//! in a single frame, and the echoes come from the skin, some centimetres before the joints. What error is left is of people
//! who stand with their back to the radar, of tall people who sit, of arms and falls, and of people so still that they look like
//! furniture. `sep` and `coll` matter where people are closer than 0.9 m. Single precision drops a gradient entry now and then
//! where gradients are tiny: of 20,000 random scenes 4 to 7 are off by up to 8e-6, where 1e-6 is asked.

mod adam;
mod adjoint;
mod articulation;
mod batch;
mod cell_box;
mod context;
mod convergence;
mod em;
mod em_around;
mod erased;
mod fill;
mod fitter;
mod floors;
mod frame_em;
mod gaussian;
mod init;
mod kernel;
mod lanes;
mod level_rows;
mod levels;
mod motion;
mod objective;
mod percentile;
mod pose_network;
mod problem;
mod reduced;
mod region;
mod returns;
mod scalar;
mod sidelobes;
mod signal;
mod simulate;
mod skin;
mod splat;
mod template;
mod terms;
mod tiles;
mod triad;
mod types;

pub use adam::Adam;
pub use articulation::Limb;
pub use context::{Neighbour, Peak};
pub use convergence::{SETTLED_OVER, has_settled};
pub use em_around::{EmAround, FrameEmLoss};
pub use erased::{ErasedCells, connected_echo, erased_marks, leaves_any, without};
pub use fill::fill_missing;
pub use fill::for_neighbours;
pub use fitter::{FitState, Fitter, GivenStart};
pub use frame_em::EmScratch;
pub use init::{
    Hypotheses, Initialisation, initialise, initialise_people, perturb, predict, standing_joints, start_at,
};
pub use motion::{MOST_BEGUN, MOST_UNLIKE, MotionState};
pub use objective::{Masks, Objective, masks};
pub use percentile::{percentile, percentiles};
pub use pose_network::MixtureDensityNetwork;
#[cfg(feature = "train")]
pub use pose_network::{Actors, POSE_STRETCH, PoseTrainOptions, pose_network_reach, train_pose_network};
pub use problem::Problem;
pub use region::Region;
pub use returns::{JointReturn, JointReturns, KeptJoints};
pub use signal::{CellValue, simulate_signal};
pub use simulate::simulate;
pub use terms::{Hue, Scope, TERMS, Term, TermGroup, TermId, Terms, Weight, formula};
pub use tiles::simd_path;
pub use types::{Evaluation, FitError, Ious, Precision, StepReport, StopReason};
