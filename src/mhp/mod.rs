//! MHP, the fit: initialisation, forward model, objective with hand-written gradients, Adam, convergence, one `step`.

mod types;

pub use types::{Evaluation, FitError, Precision, StepReport, StopReason, Terms};
