//! Where the fit of a data set's frame begins: the frame with those around it, how many people it shows, and a start for
//! each. The window's worker, batches, studies and exports all begin here, so that they begin alike.

mod people;
mod problem;

pub use people::{FoundStart, find_start};
pub use problem::{problem_alone, problem_of};
