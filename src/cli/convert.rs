//! `convert`: any data set, a raw capture above all, as a manifest folder: `dataset.toml` and one npz a frame.

use super::common::{complain, inputs, open, progress_bar};
use super::frames::{FrameRange, chosen};
use crate::body::Skeleton;
use crate::dataset::npz::{ArrayView, write_deflated};
use crate::dataset::{Dataset, FftText, Frame, MANIFEST_NAME};
use crate::geometry::{Mat3, Vec3};
use crate::output::{FolderLock, replace_file};
use crate::radar::{Axis, PointSpread, Quantity, RadarConfig, View};
use anyhow::Context as _;
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;

/// Shown under the options of `convert --help`.
pub(super) const HELP: &str = "\
Frames are made and written one after the other, whatever the length of a capture. Widths that follow from an FFT configuration are
written as that configuration ([view.fft]).

Exit codes: 0 done; 2 bad input.

Examples:
  mhp-inspector convert captures/adc_data.bin --out data/room
      Every frame of a capture as maps; then `mhp-inspector data/room`.
  mhp-inspector convert captures --frames 100..200 --out data/part
      A hundred of them.";

/// What `convert` is told.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// A capture, or whatever else the program opens.
    path: PathBuf,
    /// Folder for the manifest and the frames; it must hold no data set yet.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Frames, counted from 0, as in Rust: 5..12 (12 not included), 5..=11, 5.., ..12, or 7 alone. Default: all.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

#[derive(Serialize)]
struct Written<'a> {
    name: &'a str,
    layout: &'static str,
    frames: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_rate_hz: Option<f64>,
    skeleton: &'a Skeleton,
    radar: &'a RadarConfig,
    view: Vec<WrittenView<'a>>,
}

#[derive(Serialize)]
struct WrittenView<'a> {
    array: &'a str,
    quantity: Quantity,
    #[serde(skip_serializing_if = "Option::is_none")]
    psf: Option<PointSpread>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fft: Option<FftText>,
    rotation: Mat3,
    translation: Vec3,
    axes: &'a [Axis],
    #[serde(skip_serializing_if = "Option::is_none")]
    region: Option<&'a Vec<[usize; 2]>>,
}

/// Runs `convert`.
///
/// # Errors
/// Where the data set cannot be opened, a frame not read, or DIR not written or holds a data set already.
pub(super) fn run(args: &ConvertArgs) -> anyhow::Result<ExitCode> {
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = chosen(args.frames, &args.path, &dataset)?;
    let inputs = inputs(&dataset, &args.path, &[args.manifest.as_deref()]);
    let manifest = args.out.join(MANIFEST_NAME);
    anyhow::ensure!(
        !manifest.exists(),
        "{}: there is a data set already; expected an empty or new folder",
        args.out.display()
    );
    let _lock = FolderLock::claim(&args.out, &["frames"], &inputs)?;
    let folder = args.out.join("frames");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let bar = progress_bar(frames.len());
    let first_failure = Mutex::new(None);
    let count = frames.len();
    frames.into_par_iter().for_each(|index| {
        if first_failure.lock().is_ok_and(|failure| failure.is_some()) {
            return;
        }
        let done =
            dataset.load(index).map_err(anyhow::Error::from).and_then(|frame| write_frame(&folder, &dataset, &frame));
        if let (Err(why), Ok(mut failure)) = (done, first_failure.lock()) {
            failure.get_or_insert(why);
        }
        bar.inc(1);
    });
    bar.finish_and_clear();
    if let Ok(Some(why)) = first_failure.into_inner() {
        return Err(why);
    }
    let text = manifest_text(&dataset, &args.path)?;
    replace_file(&manifest, |out| out.write_all(text.as_bytes())).with_context(|| manifest.display().to_string())?;
    complain(&format!("{count} frames in {}", args.out.display()));
    Ok(ExitCode::SUCCESS)
}

/// A frame's maps as float32, with its time and truth where they are known.
fn write_frame(folder: &Path, dataset: &Dataset, frame: &Frame) -> anyhow::Result<()> {
    let views = &dataset.info().views;
    let maps: Vec<Vec<f32>> = frame.maps.iter().map(|map| map.data.iter().map(|&x| x as f32).collect()).collect();
    let shapes: Vec<Vec<usize>> = views.iter().map(View::shape).collect();
    let mut arrays: Vec<(&str, ArrayView<'_>)> = Vec::new();
    for ((view, map), shape) in views.iter().zip(&maps).zip(&shapes) {
        arrays.push((&view.array, ArrayView::f32(shape, map)));
    }
    let flat = |points: &[Vec3]| -> Vec<f32> { points.iter().flatten().map(|&x| x as f32).collect() };
    let truth = frame.truth.as_ref().map(|truth| {
        let joints = truth.joints.len() / truth.persons.max(1);
        ([truth.persons, joints, 3], flat(&truth.joints), truth.velocities.as_deref().map(flat))
    });
    if let Some((shape, joints, velocities)) = &truth {
        arrays.push(("joints", ArrayView::f32(shape, joints)));
        if let Some(velocities) = velocities {
            arrays.push(("velocities", ArrayView::f32(shape, velocities)));
        }
    }
    let time = frame.timestamp_s.map(|time| [time]);
    if let Some(time) = &time {
        arrays.push(("timestamp_s", ArrayView::f64(&[], time)));
    }
    let people = frame.person_count.map(|count| [count as i64]);
    if let Some(people) = &people {
        arrays.push(("person_count", ArrayView::i64(&[], people)));
    }
    write_deflated(&folder.join(format!("{:06}.npz", frame.index)), &arrays)?;
    Ok(())
}

fn manifest_text(dataset: &Dataset, from: &Path) -> anyhow::Result<String> {
    let info = dataset.info();
    let view = |(k, view): (usize, &'_ View)| {
        let calibration = info.calibration(k);
        let fft = calibration.fft.as_ref().map(|fft| FftText::beside(fft, &info.radar, &view.axes));
        // Widths that follow from the configuration are not stated beside it.
        ((!calibration.derived || fft.is_none()).then_some(view.psf), fft)
    };
    let calibrated: Vec<_> = info.views.iter().enumerate().map(view).collect();
    let views = info.views.iter().zip(calibrated).map(|(view, (psf, fft))| WrittenView {
        array: &view.array,
        quantity: view.quantity,
        psf,
        fft,
        rotation: view.pose.rotation,
        translation: view.pose.translation,
        axes: &view.axes,
        region: view.region.as_ref(),
    });
    let written = Written {
        name: &info.name,
        layout: "npz",
        frames: "frames/*.npz",
        frame_rate_hz: info.frame_rate_hz,
        skeleton: &info.skeleton,
        radar: &info.radar,
        view: views.collect(),
    };
    let mut text = format!(
        "# Made by `mhp-inspector convert` of {}.\n",
        from.display().to_string().replace(char::is_control, "?")
    );
    for said in info.assumptions.iter().chain(&info.notes) {
        // Writing to a text does not fail.
        let _ = writeln!(text, "# {}", said.replace(char::is_control, " "));
    }
    Ok(text + &toml::to_string(&written)?)
}
