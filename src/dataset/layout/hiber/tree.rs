//! Finding the groups of frames: whichever folder of the tree was opened, the category it belongs to is found, and of it what lies
//! at or below that folder.

use crate::dataset::layout::index::Segment;
use crate::dataset::natural::natural;
use crate::dataset::walk::{Folder, Walk};
use crate::dataset::{DatasetError, set::parent};
use crate::task::Progress;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The folders of the two maps of a frame, in the order of the views.
pub(super) const HEATMAPS: [&str; 2] = ["HORIZONTAL_HEATMAPS", "VERTICAL_HEATMAPS"];
/// The folder of the labels.
pub(super) const ANNOTATIONS: &str = "ANNOTATIONS";
/// From what is opened down to a category.
const MAX_DEPTH: usize = 4;
/// Folders that are looked at on the way.
const MOST_FOLDERS: usize = 20_000;

/// What was found.
#[derive(Debug)]
pub(super) struct Found {
    /// One for each group: the folder of its horizontal maps, called `WALK/01_05`.
    pub(super) segments: Vec<Segment>,
    /// The folder of the categories.
    pub(super) tree: PathBuf,
    /// What was left out.
    pub(super) notes: Vec<String>,
}

/// The groups at or below `root`, or those that it is a part of.
///
/// # Errors
/// Where a folder of maps cannot be read, or on cancel.
pub(super) fn find(root: &Path, progress: &Progress) -> Result<Found, DatasetError> {
    progress.begin("listing folders", 0);
    let (categories, only) = match inside(root) {
        Some((category, only)) => (vec![category], only),
        None => (categories(root, progress)?, None),
    };
    let mut found = Found { segments: Vec::new(), tree: root.to_owned(), notes: Vec::new() };
    if let Some(first) = categories.first() {
        parent(first).clone_into(&mut found.tree);
    }
    for category in &categories {
        groups(category, only.as_deref(), progress, &mut found)?;
    }
    found.segments.sort_by(|a, b| natural(&a.path.to_string_lossy(), &b.path.to_string_lossy()));
    Ok(found)
}

/// The category and, where it names one, the group of a folder inside a category.
fn inside(root: &Path) -> Option<(PathBuf, Option<String>)> {
    let whole = std::path::absolute(root).ok()?;
    let is_part = |path: &Path| {
        path.file_name().is_some_and(|name| HEATMAPS.iter().any(|part| name == *part) || name == ANNOTATIONS)
    };
    let part = whole.ancestors().find(|path| is_part(path))?;
    let category = part.parent()?;
    let below = whole.strip_prefix(part).ok()?;
    let names = below.components().map(|name| name.as_os_str().to_string_lossy().into_owned());
    Some((category.to_owned(), names.into_iter().find(|name| environment_of(name).is_some())))
}

/// The folders at or below `root` that have maps; a link is followed as any folder, and depth and number are bounded.
fn categories(root: &Path, progress: &Progress) -> Result<Vec<PathBuf>, DatasetError> {
    let is_category = |folder: &Path| HEATMAPS.iter().any(|part| folder.join(part).is_dir());
    let (mut found, mut left, mut seen) = (Vec::new(), vec![(root.to_owned(), 0)], 0);
    while let Some((folder, depth)) = left.pop() {
        progress.check()?;
        seen += 1;
        if is_category(&folder) {
            found.push(folder);
            continue;
        }
        if depth == MAX_DEPTH || seen > MOST_FOLDERS {
            continue;
        }
        // What cannot be read is not of this data set: another layout may say more.
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let hidden = |entry: &std::fs::DirEntry| entry.file_name().to_string_lossy().starts_with('.');
        let folders = entries.flatten().filter(|entry| !hidden(entry) && is_folder(entry));
        left.extend(folders.take(MOST_FOLDERS).map(|entry| (entry.path(), depth + 1)));
    }
    found.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(found)
}

fn is_folder(entry: &std::fs::DirEntry) -> bool {
    entry.file_type().is_ok_and(|kind| kind.is_dir() || kind.is_symlink() && entry.path().is_dir())
}

/// Adds the groups of a category, all or one.
fn groups(category: &Path, only: Option<&str>, progress: &Progress, found: &mut Found) -> Result<(), DatasetError> {
    let mut groups: BTreeMap<String, [BTreeSet<String>; 2]> = BTreeMap::new();
    for (view, part) in HEATMAPS.iter().enumerate() {
        let folder = category.join(part);
        if !folder.is_dir() {
            found.notes.push(format!("{} is missing", folder.display()));
            continue;
        }
        let walk = Walk { depth: 1, stem: frame_stem, skip: |name| environment_of(name).is_none(), progress };
        let (folders, notes) = walk.of(&folder)?;
        found.notes.extend(notes);
        for Folder { below, stems } in folders {
            let name = below.to_string_lossy().into_owned();
            if environment_of(&name).is_some() && only.is_none_or(|only| only == name) {
                groups.entry(name).or_default()[view] = stems.into_iter().collect();
            }
        }
    }
    let called = std::path::absolute(category).unwrap_or_else(|_| category.to_owned());
    let called = called.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    for (group, [horizontal, vertical]) in groups {
        let missing = horizontal.symmetric_difference(&vertical).count();
        if missing > 0 {
            found.notes.push(format!("{called}/{group}: {missing} frames have only one of the two maps"));
        }
        let stems = horizontal.union(&vertical).cloned().collect();
        let path = category.join(HEATMAPS[0]).join(&group);
        found.segments.push(Segment::new(path, format!("{called}/{group}"), stems));
    }
    Ok(())
}

/// `01` of `01_05`.
pub(super) fn environment_of(group: &str) -> Option<&str> {
    let digits = |text: &str| (1..=4).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    let (environment, number) = group.split_once('_')?;
    (digits(environment) && digits(number)).then_some(environment)
}

/// `0123` of `0123.npy`.
pub(super) fn frame_stem(name: &str) -> Option<&str> {
    let stem = name.strip_suffix(".npy")?;
    ((1..=9).contains(&stem.len()) && stem.bytes().all(|b| b.is_ascii_digit())).then_some(stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_and_frames_are_told_by_their_names() {
        assert_eq!((environment_of("01_05"), environment_of("1_77")), (Some("01"), Some("1")));
        assert_eq!((environment_of("01_05_02"), environment_of("a_1"), environment_of("_")), (None, None, None));
        assert_eq!((frame_stem("0123.npy"), frame_stem("a.npy"), frame_stem("0123.npz")), (Some("0123"), None, None));
    }

    #[test]
    fn a_folder_inside_a_category_leads_to_it() {
        let told = |path: &str| inside(Path::new(path)).map(|(category, only)| (category.display().to_string(), only));
        let group = Some("01_05".to_owned());
        assert_eq!(told("/d/WALK/HORIZONTAL_HEATMAPS/01_05"), Some(("/d/WALK".to_owned(), group.clone())));
        assert_eq!(told("/d/WALK/ANNOTATIONS/SILHOUETTE/01_05"), Some(("/d/WALK".to_owned(), group)));
        assert_eq!(told("/d/WALK/ANNOTATIONS/3DPOSE"), Some(("/d/WALK".to_owned(), None)));
        assert_eq!(told("/d/WALK"), None);
    }
}
