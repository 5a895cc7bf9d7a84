//! Where the fit of a data set's frame begins: the frame with those around it, how many people it shows, and a start for
//! each. The window's worker, batches, studies and exports all begin here, so that they begin alike.

mod people;
mod problem;
mod recent;
mod scans;
mod sequence;

pub use people::{FoundStart, find_start, find_start_in};
pub use problem::{problem_alone, problem_of};
pub use scans::{LEAD_IN, ScanWindow, count_people};
pub use sequence::{find_start_along, start_key};
