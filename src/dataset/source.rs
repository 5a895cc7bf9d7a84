//! What a data set is made of, and the names of its frames.

use super::files::Segment;
use super::hupr::Annotations;
use super::npz::NpzArchive;
use super::{DatasetInfo, NpzError};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

#[derive(Debug)]
pub(super) enum Source {
    /// Folders of frames, and the index of the first frame of each.
    Mmvr { segments: Vec<Segment>, starts: Vec<usize>, frames: usize },
    /// As above, with the label files of all.
    Hupr { segments: Vec<Segment>, starts: Vec<usize>, frames: usize, labels: Annotations },
    /// Files relative to the root, each of so many frames.
    Stacks { files: Vec<PathBuf>, steps: usize },
    /// Files relative to the root.
    Files(Vec<PathBuf>),
    /// One file; `stacked` where the arrays' first axis counts frames.
    Bare { frames: usize, stacked: bool, sums: Sums },
}

/// The checksums of a stacked file. Its frames are read one by one, which no checksum covers; so the whole file is read once,
/// by whoever asks for the first frame, and what is wrong with it is told with every frame.
#[derive(Debug, Default)]
pub(super) struct Sums(Mutex<Option<Verdict>>);

/// The array that is damaged and how, if one is.
type Verdict = Option<(String, String)>;

impl Sums {
    /// Compares them where that was not done before. One thread does, the others wait for it.
    ///
    /// # Errors
    /// Where an array is damaged, or the file cannot be read.
    pub(super) fn of(&self, path: &Path, info: &DatasetInfo) -> Result<(), NpzError> {
        let mut verdict = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if verdict.is_none() {
            let mut file = NpzArchive::open(path)?;
            *verdict = Some(match info.views.iter().try_for_each(|view| file.verify(&view.array)) {
                Ok(()) => None,
                Err(NpzError::Corrupt { key, message, .. }) => Some((key, message)),
                Err(error) => return Err(error),
            });
        }
        let damaged = verdict.clone().flatten();
        damaged.map_or(Ok(()), |(key, message)| Err(NpzError::Corrupt { key, message, path: path.to_owned() }))
    }
}

/// Bytes that the names of all frames may take together.
pub(super) const MAX_NAME_BYTES: usize = 256 << 20;

impl Source {
    pub(super) fn bare(frames: usize, stacked: bool) -> Self {
        Self::Bare { frames, stacked, sums: Sums::default() }
    }

    /// The names of all frames of the data set `dataset`; `None` where they are too long to be held.
    pub(super) fn names(&self, dataset: &str) -> Option<Names> {
        if let Self::Bare { frames, .. } = self {
            // The only number of frames that a few bytes can claim.
            (*frames).checked_mul(dataset.len() + 7 + size_of::<u32>()).filter(|&bytes| bytes <= MAX_NAME_BYTES)?;
        }
        let mut names = Names::default();
        match self {
            Self::Mmvr { segments, .. } | Self::Hupr { segments, .. } => {
                for segment in segments {
                    for k in 0..segment.len() {
                        names.push(format_args!("{}/{}", segment.sequence, segment.stem(k)));
                    }
                }
            }
            Self::Stacks { files, steps } => {
                for file in files {
                    let name = file.with_extension("");
                    for step in 0..*steps {
                        if *steps > 1 {
                            names.push(format_args!("{}/{step:02}", name.to_string_lossy()));
                        } else {
                            names.push(format_args!("{}", name.to_string_lossy()));
                        }
                    }
                }
            }
            Self::Files(files) => {
                for file in files {
                    names.push(format_args!("{}", file.with_extension("").to_string_lossy()));
                }
            }
            Self::Bare { frames, stacked: true, .. } => {
                for i in 0..*frames {
                    names.push(format_args!("{dataset}/{i:06}"));
                }
            }
            Self::Bare { .. } => names.push(format_args!("{dataset}")),
        }
        (names.text.len() <= MAX_NAME_BYTES).then_some(names)
    }
}

/// The frames' names, one after the other in one text.
#[derive(Debug, Default)]
pub(super) struct Names {
    text: String,
    ends: Vec<u32>,
}

impl Names {
    fn push(&mut self, name: std::fmt::Arguments<'_>) {
        // Writing to a text does not fail.
        let _ = self.text.write_fmt(name);
        self.ends.push(self.text.len() as u32);
    }

    pub(super) fn get(&self, i: usize) -> &str {
        let end = self.ends.get(i).copied().unwrap_or_default() as usize;
        let start = i.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or_default() as usize;
        self.text.get(start..end).unwrap_or_default()
    }
}
