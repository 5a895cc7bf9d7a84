//! Where results are written: names that stay inside their folder, folders that no data set lies in, files that are there as a
//! whole or not at all.
//!
//! Names of frames, patterns and keys come from data sets, which strangers make. Every command writes through this room, so that
//! none of them can leave its folder ([`FileNames`]), touch the data that it reads ([`Inputs`]), share a folder with another
//! process ([`FolderLock`]) or leave half a file behind (`replace_file`). It knows paths only: [`crate::dataset::Dataset::inputs`]
//! tells it what a data set is.

mod error;
mod folder;
mod growing;
mod inputs;
mod lock;
mod names;
mod replace;
mod resolve;
mod sink;
mod sweep;

pub use error::OutputError;
pub use folder::FolderGuard;
pub(crate) use growing::Growing;
pub use inputs::{INTO_DATA_FLAG, Inputs, allow_into_data, into_data_allowed};
pub use lock::FolderLock;
pub use names::FileNames;
#[cfg(feature = "viewer")]
pub(crate) use names::portable;
pub(crate) use replace::replace_file;
pub(crate) use resolve::resolved;
pub(crate) use sink::Sink;

/// Turns the signal that ends a process at its limit of file size (`ulimit -f`) into the error "File too large" of the write that
/// reached it, which is told and cleaned up after like a full disk.
///
/// # Errors
/// Where the operating system takes no handler.
#[cfg(unix)]
pub fn survive_size_limit() -> std::io::Result<()> {
    // What the handler notes is of no use: the write itself tells.
    let noted = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, noted).map(drop)
}

/// There is no such signal.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn survive_size_limit() -> std::io::Result<()> {
    Ok(())
}
