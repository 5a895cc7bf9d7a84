//! Where a path really leads, also where it does not exist yet; and what makes two paths one file.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

/// The path with every link resolved, as far as it exists; what does not exist yet is taken as it is written.
///
/// # Errors
/// Where there is no current folder.
pub(crate) fn resolved(path: &Path) -> std::io::Result<PathBuf> {
    let mut real = PathBuf::new();
    for part in std::path::absolute(path)?.components() {
        match part {
            Component::ParentDir => {
                real.pop();
            }
            Component::CurDir => {}
            _ => {
                real.push(part);
                real = real.canonicalize().unwrap_or(real);
            }
        }
    }
    Ok(real)
}

/// What a file is, whatever its names: device and number where the system has them, else the resolved path.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Identity {
    #[cfg(unix)]
    Number(u64, u64),
    #[cfg(not(unix))]
    Path(PathBuf),
}

impl Identity {
    /// Of the file that a path leads to; `None` where there is none.
    #[cfg(unix)]
    pub(super) fn of(path: &Path) -> Option<Self> {
        std::fs::metadata(path).ok().map(|meta| Self::of_metadata(&meta))
    }

    #[cfg(unix)]
    pub(super) fn of_metadata(meta: &std::fs::Metadata) -> Self {
        use std::os::unix::fs::MetadataExt as _;
        Self::Number(meta.dev(), meta.ino())
    }

    /// Of the file that a path leads to; `None` where there is none.
    #[cfg(not(unix))]
    pub(super) fn of(path: &Path) -> Option<Self> {
        path.canonicalize().ok().map(Self::Path)
    }
}

/// The folder that a file lies in; the current one for a bare name.
pub(super) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A name in front of another's, for files that are not there for long.
pub(super) fn short_name(name: &OsStr) -> String {
    const MOST_BYTES: usize = 200;
    let name = name.to_string_lossy();
    let end = (0..=MOST_BYTES.min(name.len())).rev().find(|&end| name.is_char_boundary(end)).unwrap_or(0);
    name.get(..end).unwrap_or_default().to_owned()
}
