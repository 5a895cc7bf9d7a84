//! One process a folder of results.
//!
//! The lock is the operating system's, on a file `.lock` that holds the id of its process: it ends with the process, however
//! that ends. Nothing that is there already is ever written to, because `.lock` may be a link to something else.

use super::error::OutputError;
use super::inputs::Inputs;
#[cfg(unix)]
use super::resolve::Identity;
use super::resolve::resolved;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

const NAME: &str = ".lock";
/// Digits of an id and the end of the line.
const MOST_BYTES: u64 = 16;

/// A folder of results that this process alone writes, until it is dropped.
#[derive(Debug)]
pub struct FolderLock {
    file: File,
    path: PathBuf,
}

impl FolderLock {
    /// Makes `folder` and the folders `below` it, which results of many names go into, and holds it.
    ///
    /// # Errors
    /// Where it lies in the data set, would hold an input, leads elsewhere, cannot be made, or another process writes it.
    pub fn claim(folder: &Path, below: &[&str], inputs: &Inputs<'_>) -> Result<Self, OutputError> {
        inputs.check_folder(folder)?;
        make(folder)?;
        let home = resolved(folder).map_err(OutputError::writing(folder))?;
        let lock = Self::take(folder)?;
        for shelf in below.iter().map(|name| folder.join(name)) {
            make(&shelf)?;
            let target = resolved(&shelf).map_err(OutputError::writing(&shelf))?;
            if !target.starts_with(&home) {
                return Err(OutputError::Elsewhere { target, path: shelf });
            }
            inputs.check_shelf(&shelf)?;
        }
        Ok(lock)
    }

    fn take(folder: &Path) -> Result<Self, OutputError> {
        let path = folder.join(NAME);
        loop {
            match OpenOptions::new().create_new(true).write(true).open(&path) {
                Ok(file) => {
                    if !hold(&file, folder, &path)? {
                        continue;
                    }
                    let lock = Self { file, path: path.clone() };
                    writeln!(&lock.file, "{}", std::process::id()).map_err(OutputError::writing(&path))?;
                    return Ok(lock);
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => remove_left(folder, &path)?,
                Err(error) => return Err(OutputError::writing(&path)(error)),
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        if is_at(&self.file, &self.path) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn make(folder: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(folder).map_err(OutputError::writing(folder))
}

/// Removes the lock of a process that is gone.
fn remove_left(folder: &Path, path: &Path) -> Result<(), OutputError> {
    let strange = || OutputError::NoLock { path: path.to_owned() };
    match std::fs::symlink_metadata(path) {
        Ok(meta) if !meta.is_file() || meta.len() > MOST_BYTES => return Err(strange()),
        Ok(_) => {}
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(OutputError::writing(path)(error)),
    }
    let file = match OpenOptions::new().read(true).write(true).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(OutputError::writing(path)(error)),
    };
    let mut text = String::new();
    let read = (&file).take(MOST_BYTES).read_to_string(&mut text);
    if read.is_err() || !text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'\n') {
        return Err(strange());
    }
    if hold(&file, folder, path)? {
        std::fs::remove_file(path).map_err(OutputError::writing(path))?;
    }
    Ok(())
}

/// Locks an open file; false where it is no longer the one at `path`.
fn hold(file: &File, folder: &Path, path: &Path) -> Result<bool, OutputError> {
    match file.try_lock() {
        Ok(()) => Ok(is_at(file, path)),
        Err(TryLockError::WouldBlock) => {
            let holder = std::fs::read_to_string(path).ok().and_then(|text| text.trim().parse().ok());
            Err(OutputError::Busy { holder, path: folder.to_owned() })
        }
        Err(TryLockError::Error(reason)) => {
            // Some network file systems know no locks; a folder there is the user's to keep to one process.
            tracing::warn!("{}: cannot be locked: {reason}", folder.display());
            Ok(is_at(file, path))
        }
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    let there = std::fs::symlink_metadata(path).map(|meta| Identity::of_metadata(&meta));
    file.metadata().is_ok_and(|meta| there.is_ok_and(|there| there == Identity::of_metadata(&meta)))
}

/// An open file cannot be removed there.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}
