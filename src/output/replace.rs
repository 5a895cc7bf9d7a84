//! A file takes another's place when it is complete, so that neither a crash nor a full disk leaves half a file behind.

use super::resolve::{folder_of, short_name};
use super::sink::{Sink, Swallowing};
use super::sweep::sweep_once;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Cursor, ErrorKind, Result, Write as _};
use std::path::{Path, PathBuf};

/// Writes a file beside `path` and moves it into place; on failure what was there stays, and the temporary file is removed. A
/// link is replaced, not followed; a device or pipe is written to.
///
/// # Errors
/// What the operating system or `fill` said.
pub(crate) fn replace_file(path: &Path, fill: impl FnOnce(&mut dyn Sink) -> Result<()>) -> Result<()> {
    if is_stream(path) {
        let mut bytes = Cursor::new(Vec::new());
        fill(&mut bytes)?;
        return OpenOptions::new().write(true).open(path)?.write_all(bytes.get_ref());
    }
    let temporary = Temporary::beside(path)?;
    let mut out = Swallowing::new(BufWriter::new(&temporary.file));
    let filled = fill(&mut out);
    out.finish()?;
    filled?;
    temporary.put()
}

/// A device or a pipe, or a link among the devices (`/dev/stdout`): nothing that another file may take the place of.
fn is_stream(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|meta| {
        let device = std::path::absolute(path).is_ok_and(|whole| whole.parent() == Some(Path::new("/dev")));
        !meta.is_dir() && (!meta.is_file() || device)
    })
}

/// A file `.NAME.PID.tmp` beside its place; removed unless it is put there.
#[derive(Debug)]
pub(super) struct Temporary {
    pub(super) file: File,
    own: PathBuf,
    place: PathBuf,
    is_put: bool,
}

impl Temporary {
    /// Begins a file, after what killed processes left in the folder is removed.
    pub(super) fn beside(path: &Path) -> Result<Self> {
        let name = path.file_name().ok_or_else(|| std::io::Error::other("it is not a file name"))?;
        if path.is_dir() {
            return Err(std::io::Error::other("it is a folder"));
        }
        sweep_once(folder_of(path));
        let (name, pid) = (short_name(name), std::process::id());
        let mut again = 0_u32;
        loop {
            let number = if again == 0 { String::new() } else { format!(".{again}") };
            let own = path.with_file_name(format!(".{name}{number}.{pid}.tmp"));
            match OpenOptions::new().read(true).write(true).create_new(true).open(&own) {
                Ok(file) => {
                    // Tells others that it is in use; where there are no locks the process's id does.
                    let _ = file.try_lock();
                    return Ok(Self { file, own, place: path.to_owned(), is_put: false });
                }
                // Of another thread, or of a process of long ago that had the same id.
                Err(error) if error.kind() == ErrorKind::AlreadyExists && again < 1000 => again += 1,
                Err(error) => return Err(error),
            }
        }
    }

    /// Moves it into its place.
    pub(super) fn put(mut self) -> Result<()> {
        std::fs::rename(&self.own, &self.place)?;
        self.is_put = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.is_put {
            let _ = std::fs::remove_file(&self.own);
        }
    }
}
