//! The two ways in which files make frames: folders of frames whose names count, and files in a list.

use crate::dataset::natural::natural;
use crate::dataset::{DatasetError, DatasetInfo};
use std::fmt::{self, Write};
use std::path::{Path, PathBuf};

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
    /// A folder whose frames are called by `sequence`.
    pub(super) fn new(path: PathBuf, sequence: String, mut stems: Vec<String>) -> Self {
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

/// Folders of frames, one after the other.
#[derive(Debug)]
pub(super) struct Folders {
    segments: Vec<Segment>,
    /// The index of the first frame of each.
    starts: Vec<usize>,
    frames: usize,
}

impl Folders {
    pub(super) fn new(segments: Vec<Segment>) -> Self {
        let starts = segments.iter().scan(0, |at, segment| Some(std::mem::replace(at, *at + segment.len()))).collect();
        let frames = segments.iter().map(Segment::len).sum();
        Self { segments, starts, frames }
    }

    /// Frames in all.
    pub(super) fn count(&self) -> usize {
        self.frames
    }

    /// The folders.
    pub(super) fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The folder of frame `i`, and the frame's stem.
    pub(super) fn find(&self, i: usize) -> Option<(&Segment, &str)> {
        let at = self.starts.partition_point(|&start| start <= i).checked_sub(1).filter(|_| i < self.frames)?;
        let segment = self.segments.get(at)?;
        Some((segment, segment.stem(i - self.starts.get(at)?)))
    }

    /// As [`Self::find`].
    ///
    /// # Errors
    /// Past the end.
    pub(super) fn at(&self, i: usize, info: &DatasetInfo) -> Result<(&Segment, &str), DatasetError> {
        let (count, path) = (self.frames, &info.root);
        self.find(i).ok_or_else(|| DatasetError::NoSuchFrame { index: i, count, path: path.clone() })
    }

    /// `d1s1/000/00383`.
    pub(super) fn name(&self, i: usize, out: &mut dyn Write) -> fmt::Result {
        self.find(i).map_or(Ok(()), |(segment, stem)| write!(out, "{}/{stem}", segment.sequence))
    }

    /// The folder of frame `i`, as its frames are called.
    pub(super) fn sequence(&self, i: usize) -> Option<&str> {
        self.find(i).map(|(segment, _)| segment.sequence.as_str())
    }
}

/// Folders of a list of files: those that follow one another in one folder are one.
pub(super) fn folders_of(files: &[PathBuf]) -> usize {
    let mut folders: Vec<_> = files.iter().map(|file| file.parent()).collect();
    folders.dedup();
    folders.len()
}

/// The folder of a file in a list, relative to the data set's; `None` for that itself.
pub(super) fn folder_of(file: &Path) -> Option<&str> {
    file.parent()?.to_str().filter(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_give_their_names_back_in_order() {
        let stems = ["00010", "00002", "x"].map(str::to_owned).to_vec();
        let segment = Segment::new(PathBuf::from("/d1s1/000"), "d1s1/000".into(), stems);
        assert_eq!((0..segment.len()).map(|i| segment.stem(i)).collect::<Vec<_>>(), ["00002", "00010", "x"]);
        assert_eq!(segment.stem(3), "");
        let more = Segment::new(PathBuf::from("/d1s1/001"), "d1s1/001".into(), vec!["7".into()]);
        let folders = Folders::new(vec![segment, more]);
        let stem = |i| folders.find(i).map(|(segment, stem)| (segment.sequence.as_str(), stem));
        assert_eq!((folders.count(), stem(2), stem(3)), (4, Some(("d1s1/000", "x")), Some(("d1s1/001", "7"))));
        assert_eq!(stem(4), None);
    }
}
