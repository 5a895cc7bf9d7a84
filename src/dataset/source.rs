//! What a data set is made of, and the names of its frames.

use super::files::Segment;
use super::hupr::Annotations;
use std::fmt::Write as _;
use std::path::PathBuf;

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
    Bare { frames: usize, stacked: bool },
}

impl Source {
    pub(super) fn names(&self, dataset: &str) -> Names {
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
            Self::Bare { frames, stacked: true } => {
                for i in 0..*frames {
                    names.push(format_args!("{dataset}/{i:06}"));
                }
            }
            Self::Bare { .. } => names.push(format_args!("{dataset}")),
        }
        names
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
