//! Where frames lie in the folder, and that nothing else of their kind lies there.

use crate::dataset::Layout;
use crate::dataset::layout::{FrameWriter, NewPlace};
use crate::simulate::Recording;
use anyhow::{Context as _, ensure};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What writes the files of a recording's layout.
///
/// # Errors
/// Where nothing does.
pub(super) fn writer(recording: &Recording) -> anyhow::Result<&'static dyn FrameWriter> {
    let word = recording.options().layout.files();
    let writer = <dyn Layout>::named(word).and_then(|layout| layout.writer());
    writer.with_context(|| format!("no frames can be written in the layout \"{word}\""))
}

/// Makes the folders of all frames, and refuses any npz or npy below them that would not be overwritten: it would become part of the
/// new data set.
///
/// # Errors
/// As told, or where a folder cannot be made or listed; for stacks, where the frames do not fill them.
pub(super) fn prepare(root: &Path, recording: &Recording, writer: &dyn FrameWriter) -> anyhow::Result<()> {
    let (a_file, sequences) = (writer.frames_a_file(), recording.sequences());
    let lengths = (0..sequences).map(|sequence| recording.frames_of(sequence).len());
    ensure!(
        lengths.clone().all(|length| length % a_file == 0),
        "layout {} stores {a_file} maps a file; expected --frames and --sequence-length to be multiples of it",
        recording.options().layout.word()
    );
    let files = |sequence, number| writer.files(&NewPlace { root, sequence, sequences, number });
    let ours: BTreeSet<PathBuf> = lengths
        .enumerate()
        .flat_map(|(sequence, length)| (0..length).flat_map(move |number| files(sequence, number)))
        .collect();
    refuse(root, &ours)?;
    for folder in ours.iter().filter_map(|path| path.parent()).collect::<BTreeSet<_>>() {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    Ok(())
}

/// Refuses npz and npy files below `folder` that are not `ours`.
fn refuse(folder: &Path, ours: &BTreeSet<PathBuf>) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))? {
        let entry = entry.with_context(|| format!("cannot list {}", folder.display()))?;
        let path = entry.path();
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            refuse(&path, ours)?;
        }
        ensure!(
            !path.extension().is_some_and(|ending| ending == "npz" || ending == "npy") || ours.contains(&path),
            "{} would become part of the new data set; remove it first or choose another folder",
            path.display()
        );
    }
    Ok(())
}
