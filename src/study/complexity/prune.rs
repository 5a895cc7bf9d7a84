//! Keeps the cache small: statistics of other data sets and options are thrown away, those longest unused first.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Files that the cache holds at most.
const MOST_FILES: usize = 200;
/// Bytes that they may take. A frame takes 40, hence MMVR's 345,000 frames 14 MB.
const MOST_BYTES: u64 = 256 << 20;

/// Removes the files of `folder` that are too many or too large together; `newest` stays whatever it takes. What cannot be
/// removed, or is not a file of statistics, is left alone.
pub(super) fn prune(folder: &Path, newest: &Path) {
    prune_to(folder, newest, MOST_FILES, MOST_BYTES);
}

fn prune_to(folder: &Path, newest: &Path, most_files: usize, most_bytes: u64) {
    let (mut files, mut bytes) = (0, 0);
    for (path, _, size) in newest_first(folder, newest) {
        files += 1;
        bytes += size;
        if path != newest && (files > most_files || bytes > most_bytes) {
            tracing::debug!("{}: statistics that were long not used are thrown away", path.display());
            if let Err(error) = std::fs::remove_file(&path) {
                tracing::debug!("{}: cannot be removed: {error}", path.display());
            }
        }
    }
}

/// The files of statistics with time and size; `newest` is first.
fn newest_first(folder: &Path, newest: &Path) -> Vec<(PathBuf, SystemTime, u64)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| is_ours(path))
        .filter_map(|path| {
            let known = std::fs::metadata(&path).ok()?;
            Some((path, known.modified().ok()?, known.len()))
        })
        .collect();
    files.sort_by(|a, b| (b.0 == newest, b.1, &b.0).cmp(&(a.0 == newest, a.1, &a.0)));
    files
}

/// Sixteen hexadecimal digits and `.npz`.
fn is_ours(path: &Path) -> bool {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    path.extension().is_some_and(|ending| ending == "npz")
        && stem.len() == 16
        && stem.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// Says that a file was used. Where that cannot be said, it counts as unused since it was written.
pub(super) fn touch(path: &Path) {
    if let Ok(file) = std::fs::File::options().write(true).open(path) {
        let _ = file.set_modified(SystemTime::now());
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use std::time::Duration;

    /// Files of ten bytes, each a minute older than the one before.
    fn folder(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (age, name) in names.iter().enumerate() {
            std::fs::write(folder.path().join(name), [0; 10]).unwrap();
            let file = std::fs::File::options().write(true).open(folder.path().join(name)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_mins(1 + age as u64)).unwrap();
        }
        folder
    }

    fn left(folder: &tempfile::TempDir) -> Vec<String> {
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    const NAMES: [&str; 5] =
        ["000000000000000a.npz", "000000000000000b.npz", "000000000000000c.npz", "notes.txt", "x.npz"];

    #[test]
    fn the_longest_unused_go_first_and_foreign_files_stay() {
        let files = folder(&NAMES);
        prune_to(files.path(), &files.path().join(NAMES[2]), 2, 1000);
        assert_eq!(left(&files), [NAMES[0], NAMES[2], NAMES[3], NAMES[4]], "the newest by word, then by time");
        let files = folder(&NAMES);
        touch(&files.path().join(NAMES[1]));
        prune_to(files.path(), &files.path().join("none"), 200, 10);
        assert_eq!(left(&files), [NAMES[1], NAMES[3], NAMES[4]], "by size; what was used last stays");
        prune_to(files.path(), &files.path().join(NAMES[1]), 0, 0);
        assert_eq!(left(&files), [NAMES[1], NAMES[3], NAMES[4]], "the newest stays whatever it takes");
        prune(&files.path().join("no such folder"), Path::new("x"));
    }
}
