//! Opening journals: only regular files, and never one that a link would make somewhere else.
//!
//! A pipe that is opened waits for its other end, and a device takes what it is given for orders. Both are known by their
//! metadata, before anything is opened.

use super::LabelError;
use std::fs::{File, FileType, Metadata, OpenOptions};
use std::io::{Error, ErrorKind};
use std::path::Path;

/// Refuses what is no regular file.
///
/// # Errors
/// Names what it is instead.
pub(super) fn regular(meta: &Metadata, path: &Path) -> Result<(), LabelError> {
    if meta.is_file() {
        return Ok(());
    }
    if meta.is_dir() {
        return Err(LabelError::Read { reason: ErrorKind::IsADirectory.into(), path: path.to_owned() });
    }
    Err(LabelError::NotAFile { found: kind(meta.file_type()), path: path.to_owned() })
}

#[cfg(unix)]
fn kind(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt as _;
    if kind.is_fifo() {
        "a named pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(not(unix))]
fn kind(_: FileType) -> &'static str {
    "no regular file"
}

/// Opens a journal to be read.
///
/// # Errors
/// Where it is not there, is no regular file, or cannot be opened.
pub(super) fn open_to_read(path: &Path) -> Result<File, LabelError> {
    let failed = |reason| LabelError::Read { reason, path: path.to_owned() };
    regular(&std::fs::metadata(path).map_err(failed)?, path)?;
    File::open(path).map_err(failed)
}

/// Opens a journal to be appended to; makes it, and its folder, where there is none.
///
/// # Errors
/// Where it is no regular file, is a link to nothing, or cannot be opened.
pub(super) fn open_to_append(path: &Path) -> Result<File, LabelError> {
    let failed = |reason| LabelError::Write { reason, path: path.to_owned() };
    let mut append = OpenOptions::new();
    append.read(true).append(true);
    match std::fs::metadata(path) {
        Ok(meta) => {
            regular(&meta, path)?;
            return append.open(path).map_err(failed);
        }
        Err(reason) if reason.kind() != ErrorKind::NotFound => return Err(failed(reason)),
        Err(_) => {}
    }
    if path.symlink_metadata().is_ok_and(|meta| meta.is_symlink()) {
        return Err(failed(Error::other("it is a link to a file that is not there; expected a file")));
    }
    path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(failed)?;
    // What is there by now is not made, and a link is not followed.
    match append.create_new(true).open(path) {
        Err(reason) if reason.kind() == ErrorKind::AlreadyExists => append.create_new(false).open(path).map_err(failed),
        done => done.map_err(failed),
    }
}
