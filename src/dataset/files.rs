//! Which files a data set is made of: names only, nothing is opened and nothing is asked of a file but its name, because
//! 1.7 million calls to `stat` take longer than anybody waits.

use super::DatasetError;
use super::walk::{Walk, is_special};
use crate::task::Progress;
use std::cmp::Ordering;
use std::path::{Component, Path, PathBuf};

/// The ending of a file that makes a frame of MMVR.
pub(super) const RADAR_SUFFIX: &str = "_radar.npz";
/// Folders inside each other: a data set has four.
const MAX_DEPTH: usize = 12;
/// Files that match a pattern at most.
const MAX_MATCHES: usize = 1_000_000;

/// One folder of frames: names in one string, because 345,000 small strings are slow and large.
#[derive(Debug)]
pub(super) struct Segment {
    /// The folder.
    pub(super) path: PathBuf,
    /// What the frames in it are called by: `d1s1/000`.
    pub(super) sequence: String,
    names: String,
    ends: Vec<u32>,
}

impl Segment {
    fn new(path: PathBuf, stems: Vec<String>) -> Self {
        let sequence = sequence_of(&path);
        Self::named(path, sequence, stems)
    }

    /// A folder whose frames are called by `sequence`.
    pub(super) fn named(path: PathBuf, sequence: String, mut stems: Vec<String>) -> Self {
        stems.sort_by(|a, b| natural(a, b));
        let mut segment = Self { sequence, path, names: String::new(), ends: Vec::with_capacity(stems.len()) };
        for stem in stems {
            segment.names.push_str(&stem);
            segment.ends.push(segment.names.len() as u32);
        }
        segment
    }

    /// Frames.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The stem of frame `i`, for example `00383`.
    pub(super) fn stem(&self, i: usize) -> &str {
        let end = self.ends.get(i).map_or(0, |&end| end as usize);
        let start = i.checked_sub(1).and_then(|before| self.ends.get(before)).map_or(0, |&start| start as usize);
        self.names.get(start..end).unwrap_or_default()
    }
}

/// `d1s1/000` where the path has such a folder in it, else the folder's own name.
fn sequence_of(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let parts: Vec<String> = whole.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    let session = parts.iter().rposition(|part| is_session(part));
    let from = session.unwrap_or(parts.len().saturating_sub(1));
    parts.get(from..).unwrap_or_default().join("/")
}

/// `d<day>s<session>`.
fn is_session(name: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    name.strip_prefix('d')
        .and_then(|rest| rest.split_once('s'))
        .is_some_and(|(day, session)| digits(day) && digits(session))
}

/// The folders with MMVR frames at or below `root`, in natural order; and notes about what was left out.
///
/// # Errors
/// As [`Walk::of`].
pub(super) fn segments(
    root: &Path,
    deep: bool,
    progress: &Progress,
) -> Result<(Vec<Segment>, Vec<String>), DatasetError> {
    progress.begin("listing folders", 0);
    // Links to companions are not asked whether they are folders.
    let skip = |name: &str| Path::new(name).extension().is_some_and(|ending| ending == "npz");
    let depth = if deep { MAX_DEPTH } else { 0 };
    let (folders, notes) = Walk { depth, stem: radar_stem, skip, progress }.of(root)?;
    Ok((folders.into_iter().map(|folder| Segment::new(joined(root, &folder.below), folder.stems)).collect(), notes))
}

/// `00383` of `00383_radar.npz`.
pub(super) fn radar_stem(name: &str) -> Option<&str> {
    name.strip_suffix(RADAR_SUFFIX).filter(|stem| !stem.is_empty())
}

/// `root` itself where nothing is below it: a path that ends in no separator.
fn joined(root: &Path, below: &Path) -> PathBuf {
    if below.as_os_str().is_empty() { root.to_owned() } else { root.join(below) }
}

/// Numbers inside names by value, the rest by character: `d9s1` before `d10s1`.
pub(super) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.as_bytes(), b.as_bytes());
    while let (Some((&x, rest_x)), Some((&y, rest_y))) = (left.split_first(), right.split_first()) {
        let order = if x.is_ascii_digit() && y.is_ascii_digit() {
            let (number_x, after_x) = leading_number(left);
            let (number_y, after_y) = leading_number(right);
            (left, right) = (after_x, after_y);
            number_x.len().cmp(&number_y.len()).then(number_x.cmp(number_y))
        } else {
            (left, right) = (rest_x, rest_y);
            x.cmp(&y)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

/// The digits at the start without leading zeros, and what follows them.
fn leading_number(text: &[u8]) -> (&[u8], &[u8]) {
    let end = text.iter().position(|b| !b.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    let zeros = digits.iter().position(|&b| b != b'0').unwrap_or(digits.len());
    (digits.get(zeros..).unwrap_or_default(), rest)
}

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
    fn sorts_numbers_by_value() {
        let mut names = ["d10s1", "d9s2", "d9s10", "P1", "00010", "2", "x"].map(str::to_owned);
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["2", "00010", "P1", "d9s2", "d9s10", "d10s1", "x"]);
    }

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

    #[test]
    fn names_sequences_by_session_and_segment() {
        assert_eq!(sequence_of(Path::new("/data/MMVR/P1/d1s1/000")), "d1s1/000");
        assert_eq!(sequence_of(Path::new("/data/mmvr")), "mmvr");
        assert_eq!(sequence_of(Path::new("/data/dxs1/007")), "007");
    }

    #[test]
    fn segments_give_their_names_back_in_order() {
        let stems = ["00010", "00002", "x"].map(str::to_owned).to_vec();
        let segment = Segment::new(PathBuf::from("/d1s1/000"), stems);
        assert_eq!((0..segment.len()).map(|i| segment.stem(i)).collect::<Vec<_>>(), ["00002", "00010", "x"]);
        assert_eq!(segment.stem(3), "");
    }
}
