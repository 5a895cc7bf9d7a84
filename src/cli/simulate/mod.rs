//! `mhp-inspector simulate`: writes a synthetic data set with truth, from scatterers to ADC samples to maps.
//!
//! Sequences are made side by side, frames are named by sequence and number, and the same options give the same bytes whatever
//! the number of threads. `plan.rs` sees to the files that there will be; the layout of the data set writes them.

mod args;
mod manifest;
mod plan;

pub use args::{HELP, SimulateArgs};

use crate::dataset::MANIFEST_NAME;
use crate::dataset::layout::{FrameWriter, NewFrame, NewPlace};
use crate::output::{FolderLock, Inputs, replace_file};
use crate::simulate::{Recording, Sequence};
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
    let writer = plan::writer(recording)?;
    plan::prepare(out, recording, writer)?;
    let sequences: Vec<usize> = (0..recording.sequences()).collect();
    let kept = sequences
        .par_iter()
        .map(|&number| write_sequence(out, recording, &recording.sequence(number), (writer, style.narrow), &done))
        .collect::<anyhow::Result<Vec<Vec<String>>>>()?;
    writer.finish(out, &kept)?;
    let (path, text) = (out.join(MANIFEST_NAME), manifest::text(recording, writer, style)?);
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

/// Writes the frames of a sequence, file by file; answers what the writer keeps of them.
fn write_sequence(
    out: &Path,
    recording: &Recording,
    sequence: &Sequence,
    (writer, narrow): (&dyn FrameWriter, bool),
    done: &(impl Fn() + Sync),
) -> anyhow::Result<Vec<String>> {
    let (length, a_file) = (recording.frames_of(sequence.index()).len(), writer.frames_a_file());
    let device = recording.device();
    let write = |first: usize| -> anyhow::Result<Option<String>> {
        let made = |number| {
            let raw = sequence.raw(number);
            let frame = (sequence.processed(number, &raw), device.cubes(&raw.cubes));
            done();
            frame
        };
        let made: Vec<_> = (first..first + a_file).into_par_iter().map(made).collect();
        let new = made.iter().map(|(frame, cubes)| NewFrame {
            maps: &frame.maps,
            cubes,
            joints: &frame.joints,
            velocities: &frame.velocities,
            timestamp_s: frame.timestamp_s,
            scenario: &frame.scenario,
        });
        let at = NewPlace { root: out, sequence: sequence.index(), sequences: recording.sequences(), number: first };
        Ok(writer.write(&at, &device.views, &new.collect::<Vec<_>>(), narrow)?)
    };
    let files: Vec<usize> = (0..length).step_by(a_file).collect();
    let kept: Vec<Option<String>> = files.into_par_iter().map(write).collect::<anyhow::Result<_>>()?;
    Ok(kept.into_iter().flatten().collect())
}
