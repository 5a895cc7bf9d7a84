//! Studies and their run folders, the evidence of failure modes, and what is exported.

#[path = "../common/blob.rs"]
mod blob;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/scenes.rs"]
mod scenes;

// The first by name: it waits more than it works, beside the others.
#[cfg(unix)]
mod array_jobs;
mod clouds;
mod evidence;
mod explore;
mod export;
mod maps;
mod radars;
mod runs;
mod shards;
mod verification;
