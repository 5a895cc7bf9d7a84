//! The files that a manifest's pattern names, `frames/*.npz`: names only, nothing is opened.

use crate::dataset::DatasetError;
use crate::dataset::walk::is_special;
use crate::task::Progress;
use std::path::{Component, Path, PathBuf};

/// Files that match a pattern at most.
const MAX_MATCHES: usize = 1_000_000;

/// Whether a pattern names files outside the folder that it begins in.
pub(super) fn leads_out(pattern: &str) -> bool {
    let path = Path::new(pattern);
    let inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    !path.components().all(inside) || pattern.split(['/', '\\']).any(|part| part == "..")
}

/// The files below `root` that match a pattern with `*` and `?` in any of its parts, sorted by name; relative paths.
///
/// # Errors
/// Where a folder cannot be read, or on cancel.
pub(super) fn matching(root: &Path, pattern: &str, progress: &Progress) -> Result<Vec<PathBuf>, DatasetError> {
    progress.begin("listing frames", 0);
    let parts: Vec<&str> = pattern.split('/').filter(|part| !part.is_empty()).collect();
    let mut found = vec![if pattern.starts_with('/') { PathBuf::from("/") } else { PathBuf::new() }];
    for (k, part) in parts.iter().enumerate() {
        let last = k + 1 == parts.len();
        let mut next = Vec::new();
        for base in &found {
            progress.check()?;
            if part.contains(['*', '?']) {
                next.extend(matches_in(root, base, part, last)?);
            } else if root.join(base).join(part).exists() {
                next.push(base.join(part));
            }
            progress.advance(1);
            if next.len() > MAX_MATCHES {
                return Err(DatasetError::TooMany { what: "frames", most: MAX_MATCHES, path: root.to_owned() });
            }
        }
        next.sort();
        found = next;
    }
    Ok(found)
}

fn matches_in(root: &Path, base: &Path, part: &str, file: bool) -> Result<Vec<PathBuf>, DatasetError> {
    let folder = root.join(base);
    let failed = |reason| DatasetError::Read { reason, path: folder.clone() };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name();
        let text = name.to_string_lossy();
        let hidden = text.starts_with('.') && !part.starts_with('.');
        if hidden || !fits(part.as_bytes(), text.as_bytes()) {
            continue;
        }
        let kind = entry.file_type().map_err(failed)?;
        let is_folder = kind.is_dir() || kind.is_symlink() && entry.path().is_dir();
        let special =
            !is_folder && (!kind.is_file() && !kind.is_symlink() || kind.is_symlink() && is_special(&entry.path()));
        if is_folder != file && !special {
            names.push(base.join(&name));
        }
        if names.len() > MAX_MATCHES {
            return Err(DatasetError::TooMany { what: "frames", most: MAX_MATCHES, path: root.to_owned() });
        }
    }
    Ok(names)
}

/// `*` is any run of characters, `?` any one. Greedy with one point to return to: linear for one `*`, never exponential.
fn fits(pattern: &[u8], text: &[u8]) -> bool {
    let (mut p, mut t, mut back) = (0, 0, None);
    while t < text.len() {
        match pattern.get(p) {
            Some(b'*') => {
                back = Some((p + 1, t));
                p += 1;
            }
            Some(&c) if c == b'?' || text.get(t) == Some(&c) => {
                p += 1;
                t += 1;
            }
            _ => {
                let Some((after_star, start)) = back else { return false };
                back = Some((after_star, start + 1));
                (p, t) = (after_star, start + 1);
            }
        }
    }
    pattern.get(p..).unwrap_or_default().iter().all(|&c| c == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_stars_and_question_marks() {
        assert!(fits(b"*.npz", b"000000.npz"));
        assert!(fits(b"a*b*c", b"a_b_b_c"));
        assert!(fits(b"f?", b"f1"));
        assert!(fits(b"*", b""));
        assert!(!fits(b"*.npz", b"000000.npy"));
        assert!(!fits(b"a*b", b"abc"));
        assert!(!fits(b"f?", b"f"));
    }
}
