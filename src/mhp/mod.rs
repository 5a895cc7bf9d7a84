//! MHP, the fit: initialisation, forward model, objective with hand-written gradients, Adam, convergence, one `step`.
//!
//! [`Problem`] is one frame; [`Objective`] answers loss and gradient for parameters; [`Fitter`] takes Adam steps. The
//! forward model goes from joints to cells in two steps, `splat.rs` (a joint in a view, f64; in `batch.rs` several at once)
//! and `kernel.rs` (cells, plainly) or `tiles/mod.rs` (cells, f32, fast), and back in the same (moments) and
//! `adjoint.rs`. `em.rs` compares the masks, `terms/mod.rs` has the table of all terms, `objective.rs` adds them up.

mod adam;
mod adjoint;
mod articulation;
mod batch;
mod convergence;
mod em;
mod fill;
mod fitter;
mod form;
mod init;
mod kernel;
mod laid;
mod lanes;
mod objective;
mod percentile;
mod problem;
mod region;
mod scalar;
mod seen;
mod simulate;
mod splat;
mod terms;
mod tiles;
mod types;

pub use adam::Adam;
pub use fill::fill_missing;
pub(crate) use fill::for_neighbours;
pub use fitter::{FitState, Fitter};
pub use init::{Initialisation, LimbMap, Peak, initialise, initialise_people, predict};
#[cfg(feature = "train")]
pub use init::{LimbLesson, learn_limbs};
pub use objective::{Masks, Objective, masks};
pub(crate) use percentile::{percentile, percentiles};
pub use problem::{Neighbour, Problem};
pub use region::Region;
pub use simulate::simulate;
pub use terms::{Hue, Scope, TERMS, Term, TermGroup, TermId, Terms, Weight, formula};
pub use tiles::simd_path;
pub use types::{Evaluation, FitError, Ious, Precision, StepReport, StopReason};
