//! `mhp-inspector simulate`: writes a synthetic data set with truth, from scatterers to ADC samples to maps.
//!
//! Sequences are made side by side, frames are named by sequence and number, and the same options give the same bytes whatever
//! the number of threads. `plan.rs` knows which files there will be; one file a layout writes them.

mod args;
mod hupr_tree;
mod image;
mod manifest;
mod mmvr_tree;
mod npz_frames;
mod plan;
mod stacks;

pub use args::{HELP, SimulateArgs};

use crate::dataset::MANIFEST_NAME;
use crate::output::{FolderLock, Inputs, replace_file};
use crate::simulate::{Recording, Sequence, SimulatedLayout};
use anyhow::Context as _;
use rayon::prelude::*;
use std::path::Path;
use std::process::ExitCode;

/// Writes the data set.
///
/// # Errors
/// Where an option makes no sense, or the folder cannot be written or holds frames that would not be overwritten.
pub fn run(args: &SimulateArgs) -> anyhow::Result<ExitCode> {
    let recording = Recording::new(&args.options()?)?;
    let bar = super::common::progress_bar(recording.len());
    let typed = args.typed();
    let style = Style { command: &typed, name: args.name.as_deref(), narrow: args.narrow };
    write_data_set(&args.out, &recording, style, || bar.inc(1))?;
    bar.finish_and_clear();
    let (frames, sequences) = (recording.len(), recording.sequences());
    let word = if sequences == 1 { "sequence" } else { "sequences" };
    super::common::complain(&format!("{frames} frames in {sequences} {word} in {}", args.out.display()));
    Ok(ExitCode::SUCCESS)
}

/// How a recording is written.
#[derive(Debug, Clone, Copy, Default)]
pub struct Style<'a> {
    /// The command that makes it again, for the manifest's comment.
    pub command: &'a str,
    /// Name of the data set; `None` is layout and presets.
    pub name: Option<&'a str>,
    /// Halves the numbers of files that are not packed.
    pub narrow: bool,
}

/// Writes a recording into `out`; `done` hears of every frame.
///
/// # Errors
/// Where the folder cannot be written, holds frames that would not be overwritten, or another data set, or another process writes it.
pub fn write_data_set(
    out: &Path,
    recording: &Recording,
    style: Style<'_>,
    done: impl Fn() + Sync,
) -> anyhow::Result<()> {
    refuse_another(out)?;
    let _lock = FolderLock::claim(out, &[], &Inputs::default())?;
    plan::prepare(out, recording)?;
    let sequences: Vec<usize> = (0..recording.sequences()).collect();
    let labels = sequences
        .par_iter()
        .map(|&number| write_sequence(out, recording, &recording.sequence(number), style.narrow, &done))
        .collect::<anyhow::Result<Vec<hupr_tree::Annotations>>>()?;
    if recording.options().layout == SimulatedLayout::Hupr {
        hupr_tree::write_annotations(out, &labels)?;
    }
    let (path, text) = (out.join(MANIFEST_NAME), manifest::text(recording, style)?);
    let written = replace_file(&path, |out| out.write_all(text.as_bytes()));
    written.with_context(|| format!("{}: cannot be written", path.display()))
}

/// Refuses the folder of a data set that was not simulated.
fn refuse_another(out: &Path) -> anyhow::Result<()> {
    match std::fs::read_to_string(out.join(MANIFEST_NAME)) {
        Ok(text) if !text.starts_with(manifest::FIRST_WORDS) => {
            Ok(Inputs::default().with_folder(out).check_folder(out)?)
        }
        _ => Ok(()),
    }
}

/// Writes the frames of a sequence; the labels are those of HuPR's annotation file, else empty.
fn write_sequence(
    out: &Path,
    recording: &Recording,
    sequence: &Sequence,
    narrow: bool,
    done: &(impl Fn() + Sync),
) -> anyhow::Result<hupr_tree::Annotations> {
    let numbers: Vec<usize> = (0..recording.frames_of(sequence.index()).len()).collect();
    let views = &recording.device().views;
    if recording.options().layout == SimulatedLayout::Xrf55Stack {
        return stacks::write(out, sequence, numbers.len(), narrow, done).map(|()| Vec::new());
    }
    let write = |&number: &usize| -> anyhow::Result<Option<hupr_tree::Block>> {
        let raw = sequence.raw(number);
        let frame = sequence.processed(number, &raw);
        let place = (out, sequence.index(), number);
        let labels = match recording.options().layout {
            SimulatedLayout::Hupr => hupr_tree::write(place, recording.device(), &raw, &frame, narrow)?,
            SimulatedLayout::MmvrTree => mmvr_tree::write(place, views, &frame).map(|()| None)?,
            _ => npz_frames::write(&plan::npz_path(place, recording.sequences() == 1), views, &frame).map(|()| None)?,
        };
        done();
        Ok(labels)
    };
    let blocks: Vec<Option<hupr_tree::Block>> = numbers.par_iter().map(write).collect::<anyhow::Result<_>>()?;
    Ok(blocks.into_iter().flatten().collect())
}
