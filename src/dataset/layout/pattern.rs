//! The files that a manifest's pattern names, `frames/*.npz`: names only, nothing is opened.

use crate::dataset::DatasetError;
use crate::dataset::walk::is_special;
use crate::task::Progress;
use std::path::{Component, Path, PathBuf};
use wildmatch::WildMatch;

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
    let wanted = WildMatch::new(part);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name();
        let text = name.to_string_lossy();
        let hidden = text.starts_with('.') && !part.starts_with('.');
        if hidden || !wanted.matches(&text) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The patterns that manifests have, as they are meant: names with brackets and braces are names.
    #[test]
    fn stars_and_question_marks_are_all_that_is_special() {
        let fits = |pattern: &str, name: &str| WildMatch::new(pattern).matches(name);
        for (pattern, name) in
            [("*.npz", "000000.npz"), ("a*b*c", "a_b_b_c"), ("f?", "f1"), ("*", ""), ("[a]{b}*", "[a]{b}7")]
        {
            assert!(fits(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("*.npz", "000000.npy"), ("a*b", "abc"), ("f?", "f"), ("[a]*", "a7")] {
            assert!(!fits(pattern, name), "{pattern} {name}");
        }
    }
}
