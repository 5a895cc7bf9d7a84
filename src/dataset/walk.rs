//! Going through a folder tree: names only, nothing is opened, and every folder once, however often links lead to it.
//!
//! Folders themselves come first, side by side; the links among them are followed afterwards, one by one in natural order, so
//! that a folder keeps the same path in every run and a link to what was already seen adds nothing. Only names of regular files
//! (or of links, which are looked at) are told to the caller: a named pipe is never opened. Depth and number are bounded, and what
//! was left out is said.

use super::DatasetError;
use super::natural::natural;
use crate::task::Progress;
use rayon::prelude::*;
use std::collections::HashSet;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Folders that are looked into at most; the largest public data set has some four hundred.
const MAX_FOLDERS: usize = 100_000;
/// Files that make frames at most.
const MAX_FILES: usize = 8_000_000;
/// Links that are told one by one.
const TOLD: usize = 3;

/// What is looked for.
pub(super) struct Walk<'a> {
    /// Folders inside each other; 0 looks into the root alone.
    pub(super) depth: usize,
    /// What a file's name stands for; `None` for a file of no interest.
    pub(super) stem: fn(&str) -> Option<&str>,
    /// Folders that are not looked into, by name.
    pub(super) skip: fn(&str) -> bool,
    /// To count folders, and to be stopped.
    pub(super) progress: &'a Progress,
}

/// One folder with files of interest.
#[derive(Debug)]
pub(super) struct Folder {
    /// Below the root; empty for the root itself.
    pub(super) below: PathBuf,
    /// What [`Walk::stem`] made of its files, in the order of the file system.
    pub(super) stems: Vec<String>,
}

/// What one pass through real folders found.
#[derive(Default)]
struct Found {
    folders: Vec<Folder>,
    /// Links to folders, and how deep they lie.
    links: Vec<(PathBuf, usize)>,
    notes: Vec<String>,
    /// The folders that were looked into.
    seen: Vec<Identity>,
}

impl Found {
    fn add(&mut self, other: Self) {
        self.folders.extend(other.folders);
        self.links.extend(other.links);
        self.notes.extend(other.notes);
        self.seen.extend(other.seen);
    }
}

impl Walk<'_> {
    /// The folders at or below `root` that have files of interest, in natural order of their paths, and what was left out.
    ///
    /// # Errors
    /// Where `root` cannot be read, there are more folders or files than any data set has, or on cancel.
    pub(super) fn of(&self, root: &Path) -> Result<(Vec<Folder>, Vec<String>), DatasetError> {
        let pass = Pass { walk: self, root, folders: AtomicUsize::new(0), files: AtomicUsize::new(0) };
        let (mut whole, mut seen, mut again) = (Found::default(), HashSet::new(), Vec::new());
        whole.add(pass.list(PathBuf::new(), 0, &seen)?);
        while !whole.links.is_empty() {
            let mut links = std::mem::take(&mut whole.links);
            links.sort_by(|a, b| natural(&a.0.to_string_lossy(), &b.0.to_string_lossy()));
            for (link, depth) in links {
                seen.extend(whole.seen.drain(..));
                if identity(&root.join(&link)).is_none_or(|id| seen.contains(&id)) {
                    again.push(link);
                    continue;
                }
                match pass.list(link, depth, &seen) {
                    Ok(more) => whole.add(more),
                    Err(error) if ends(&error) => return Err(error),
                    Err(error) => whole.notes.push(format!("skipped: {error}")),
                }
            }
        }
        whole.folders.sort_by(|a, b| natural(&a.below.to_string_lossy(), &b.below.to_string_lossy()));
        whole.notes.sort();
        whole.notes.extend(told_links(root, &again));
        Ok((whole.folders, whole.notes))
    }
}

/// A walk under way, with what it has met so far.
struct Pass<'a> {
    walk: &'a Walk<'a>,
    root: &'a Path,
    folders: AtomicUsize,
    files: AtomicUsize,
}

impl Pass<'_> {
    /// Lists `below` and the folders in it that are not among `seen`, links left for later.
    fn list(&self, below: PathBuf, depth: usize, seen: &HashSet<Identity>) -> Result<Found, DatasetError> {
        self.walk.progress.check()?;
        self.walk.progress.grow(1);
        self.count(&self.folders, 1, "folders", MAX_FOLDERS)?;
        let folder = self.root.join(&below);
        let (mut found, mut inside, mut stems) = (Found::default(), Vec::new(), Vec::new());
        found.seen.extend(identity(&folder));
        if found.seen.iter().any(|id| seen.contains(id)) {
            return Ok(Found::default());
        }
        let failed = |reason| DatasetError::Read { reason, path: folder.clone() };
        for entry in std::fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let name = entry.file_name();
            match self.meaning(&entry, depth) {
                Some(Meaning::Frame(stem)) => stems.push(stem),
                Some(Meaning::Folder) => inside.push(below.join(&name)),
                Some(Meaning::Link) => found.links.push((below.join(&name), depth + 1)),
                Some(Meaning::Special) => {
                    found.notes.push(format!("skipped: {}: it is no regular file", entry.path().display()));
                }
                None => {}
            }
        }
        self.walk.progress.advance(1);
        self.count(&self.files, stems.len(), "frames", MAX_FILES)?;
        if !stems.is_empty() {
            found.folders.push(Folder { below, stems });
        }
        let deeper = inside.into_par_iter().map(|path| self.list(path, depth + 1, seen)).collect::<Vec<_>>();
        for listed in deeper {
            match listed {
                Ok(more) => found.add(more),
                Err(error) if ends(&error) => return Err(error),
                Err(error) => found.notes.push(format!("skipped: {error}")),
            }
        }
        Ok(found)
    }

    /// What a name in a folder is to a data set; only links are looked up, all else comes with the name.
    fn meaning(&self, entry: &DirEntry, depth: usize) -> Option<Meaning> {
        let (name, kind) = (entry.file_name(), entry.file_type().ok()?);
        let name = name.to_string_lossy();
        if let Some(stem) = (self.walk.stem)(&name) {
            let regular = kind.is_file() || kind.is_symlink() && !is_special(&entry.path());
            return Some(if regular { Meaning::Frame(stem.to_owned()) } else { Meaning::Special });
        }
        let deeper = depth < self.walk.depth && !name.starts_with('.') && !(self.walk.skip)(&name);
        if deeper && kind.is_dir() {
            return Some(Meaning::Folder);
        }
        (deeper && kind.is_symlink() && entry.path().is_dir()).then_some(Meaning::Link)
    }

    fn count(&self, met: &AtomicUsize, more: usize, what: &'static str, most: usize) -> Result<(), DatasetError> {
        if met.fetch_add(more, Ordering::Relaxed) + more > most {
            return Err(DatasetError::TooMany { what, most, path: self.root.to_owned() });
        }
        Ok(())
    }
}

/// What a name in a folder is to a data set.
enum Meaning {
    /// A file with a frame.
    Frame(String),
    Folder,
    /// A link to a folder.
    Link,
    /// Named as a frame, and no regular file.
    Special,
}

/// Whether a whole walk ends with this error; a folder that cannot be read is passed over.
fn ends(error: &DatasetError) -> bool {
    matches!(error, DatasetError::Cancelled | DatasetError::TooMany { .. })
}

/// Something that is there and no regular file. A link to nothing stays a frame, whose error says what is missing.
pub(super) fn is_special(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|meta| !meta.is_file())
}

/// What was not followed, a few by name.
fn told_links(root: &Path, again: &[PathBuf]) -> Option<String> {
    let names: Vec<String> = again.iter().take(TOLD).map(|link| root.join(link).display().to_string()).collect();
    let more = if again.len() > TOLD { format!(" and {} more", again.len() - TOLD) } else { String::new() };
    let links = if again.len() == 1 { "link leads" } else { "links lead" };
    (!again.is_empty())
        .then(|| format!("{} {links} to folders that were already listed: {}{more}", again.len(), names.join(", ")))
}

/// Which folder it is, whatever path leads there.
#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

#[cfg(unix)]
fn identity(folder: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt as _;
    std::fs::metadata(folder).ok().map(|meta| (meta.dev(), meta.ino()))
}

#[cfg(not(unix))]
fn identity(folder: &Path) -> Option<Identity> {
    folder.canonicalize().ok()
}
