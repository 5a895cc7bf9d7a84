//! Where frames lie in the folder, and that nothing else of their kind lies there.

use crate::dataset::XRF55_STEPS;
use crate::simulate::{Recording, SimulatedLayout};
use anyhow::{Context as _, ensure};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The data set's folder, the sequence, the frame's number in it.
pub(super) type FramePlace<'a> = (&'a Path, usize, usize);

/// `frames/s000/000000.npz`, or `frames/000000.npz` where there is one sequence only.
pub(super) fn npz_path((out, sequence, number): FramePlace<'_>, only: bool) -> PathBuf {
    let folder = out.join("frames");
    let folder = if only { folder } else { folder.join(format!("s{sequence:03}")) };
    folder.join(format!("{number:06}.npz"))
}

/// MMVR's `d1s1/000/00000_<kind>.npz`.
pub(super) fn mmvr_path((out, sequence, number): FramePlace<'_>, kind: &str) -> PathBuf {
    out.join("d1s1").join(format!("{sequence:03}")).join(format!("{number:05}_{kind}.npz"))
}

/// HuPR's `single_1/<part>/000000000.<ending>`; sequences count from 1.
pub(super) fn hupr_path((out, sequence, number): FramePlace<'_>, part: &str, ending: &str) -> PathBuf {
    out.join(format!("single_{}", sequence + 1)).join(part).join(format!("{number:09}.{ending}"))
}

/// XRF55's `mmWave/01_01_01.npy`: volunteer, action, repetition; twenty repetitions an action.
pub(super) fn stack_path((out, sequence, clip): FramePlace<'_>) -> PathBuf {
    out.join("mmWave").join(format!("01_{:02}_{:02}.npy", sequence + 1, clip + 1))
}

/// The truth of one of a stack's maps.
pub(super) fn stack_truth_path(stack: &Path, step: usize) -> PathBuf {
    let stem = stack.file_stem().unwrap_or_default().to_string_lossy();
    stack.with_file_name(format!("{stem}_truth_{step:02}.npz"))
}

/// Every file of a frame.
fn files(layout: SimulatedLayout, place: FramePlace<'_>, only: bool) -> Vec<PathBuf> {
    match layout {
        SimulatedLayout::Mmvr | SimulatedLayout::Xrf55 | SimulatedLayout::Generic => vec![npz_path(place, only)],
        SimulatedLayout::MmvrTree => {
            ["radar", "bbox", "pose", "meta", "truth"].map(|kind| mmvr_path(place, kind)).to_vec()
        }
        SimulatedLayout::Hupr => {
            vec![hupr_path(place, "hori", "npy"), hupr_path(place, "vert", "npy"), hupr_path(place, "truth", "npz")]
        }
        SimulatedLayout::Xrf55Stack => {
            let (out, sequence, number) = place;
            let stack = stack_path((out, sequence, number / XRF55_STEPS));
            vec![stack_truth_path(&stack, number % XRF55_STEPS), stack]
        }
    }
}

/// Makes the folders of all frames, and refuses any npz or npy below them that would not be overwritten: it would become part of the
/// new data set.
///
/// # Errors
/// As told, or where a folder cannot be made or listed; for stacks, where the frames do not fill them.
pub(super) fn prepare(out: &Path, recording: &Recording) -> anyhow::Result<()> {
    let layout = recording.options().layout;
    let lengths = (0..recording.sequences()).map(|sequence| recording.frames_of(sequence).len());
    ensure!(
        layout != SimulatedLayout::Xrf55Stack || lengths.clone().all(|length| length % XRF55_STEPS == 0),
        "layout xrf55-stack stores {XRF55_STEPS} maps a file; expected --frames and --sequence-length to be multiples of it"
    );
    let only = recording.sequences() == 1;
    let ours: BTreeSet<PathBuf> = lengths
        .enumerate()
        .flat_map(|(sequence, length)| (0..length).flat_map(move |number| files(layout, (out, sequence, number), only)))
        .collect();
    refuse(out, &ours)?;
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
