//! What several tests need.

use std::path::PathBuf;

/// Folder of shared material, or `None` (with the reason printed) where this machine has none.
pub(crate) fn shared() -> Option<PathBuf> {
    let folder = std::env::var_os("MHP_SHARED")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no folder {} (set MHP_SHARED)", folder.display());
    None
}
