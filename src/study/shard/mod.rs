//! Parts of a whole, for more than one machine: which frames a part takes, what its folder says of itself, and when all of them
//! make the whole.
//!
//! [`Shard`] is part i of n, as typed or as a Slurm job array numbers its tasks. `fit`, `complexity`, `count` and `evidence` give a
//! shard a stretch of neighbouring frames ([`Shard::stretch`]), because what lies around a frame is read with it; a study deals
//! its units out one by one ([`Shard::takes`]), because some cost a hundred times as much as others. Neither shows in the rows.
//!
//! The folder of a shard says what it belongs to: `run.toml` of a study, `shard.toml` ([`ShardSpec`]) of the other four, whose
//! rows lie in `rows.jsonl` once all are known. `gather.rs` takes the folders of one whole, in any order, and says which shards are missing
//! and what differs: command, program version, data, frames, settings. `merge` then writes what one run writes, from the same
//! rows by the same code, so that the bytes are the same, times apart.
//!
//! `samples/slurm` holds a job array and the merge that depends on it. A shard that failed is done again by itself, by its command
//! with `--shard i/n` in words: an array of that one task would be a whole of one part.

mod data;
mod error;
mod folder;
mod frames;
mod gather;
mod part;
mod rows;
mod spec;
mod stamp;

pub use data::{DataSpec, Subset};
pub use error::ShardError;
pub use folder::{SHARD_FILE, ShardFolder, is_shard_folder};
pub use frames::FrameRanges;
pub(in crate::study) use gather::{Difference, Part, gather};
pub use part::Shard;
pub use rows::{ShardRow, Whole};
pub use spec::{FrameCommand, ShardSpec, of_command};
