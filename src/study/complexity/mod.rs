//! The hard subset: how difficult each frame of a data set is, told from its maps alone (paper, section 5.4.1).
//!
//! Three statistics a frame, each on H_ori (missing cells filled, SPEC section 4) and each the mean over the views:
//! peak density ρ_peak = cells above all their neighbours and above the percentile 100 − κ, over all cells; static
//! dominance s_static = the share of the bins above that percentile that were so in each of the last T frames;
//! human saliency r_human = the sum over the top-τ mask over the sum of the map. Hardness is the mean of their
//! normalised ranks, r_human reversed; its terciles are the strata.
//!
//! [`compute`] scans with all cores and keeps what it found on disk, [`measure`] does so for some frames, which [`ranked`] ranks
//! when all are there, [`ComplexityJob`] does so off the window's thread,
//! [`rank`] is the pure part. From the inside out: `map.rs` is one map, `history.rs` the last T frames, `scan.rs` the
//! threads, `plan.rs` who reads what, `cache.rs` the file, `prune.rs` how many there are, `stamps.rs` what makes a cached frame stale.

mod cache;
mod compute;
mod history;
mod job;
mod map;
mod options;
mod plan;
mod prune;
mod rank;
mod scan;
pub(in crate::study) mod stamps;
mod table;
mod types;

pub use cache::{cache_folder, cached_share};
pub use compute::{compute, measure, ranked};
pub use job::ComplexityJob;
pub use options::ComplexityOptions;
pub use rank::rank;
pub use table::{json, write_csv};
pub use types::{Complexity, Counts, FrameComplexity, MeasuredFrame, Statistics, Stratum};
