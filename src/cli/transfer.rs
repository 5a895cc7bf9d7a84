//! `transfer`: a fitted pose before another radar, and one body before three.

use super::common::{PrecisionArg, complain, open, print, progress_bar};
use crate::body::Skeleton;
use crate::dataset::npz::{ArrayView, write};
use crate::dataset::{DatasetInfo, LAYOUTS, Layout, RadarPreset, read_pppr};
use crate::mhp::{CellValue, Problem, simulate, simulate_signal};
use crate::output::{Inputs, replace_file};
use crate::radar::{RadarConfig, View, ViewFft};
use crate::study::radars::ThreeRadars;
use anyhow::{Context as _, bail, ensure};
use clap::{Args, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `transfer --help`.
pub(super) const HELP: &str = "\
Exit codes: 0 done; 2 bad input.

Examples:
  mhp-inspector transfer map --params fits/d1s1_000_00003.npz --radar hupr --out seen-by-hupr.npz
      The maps that HuPR's radars would make of a pose that was fitted on another's.
  mhp-inspector transfer map --params p.npz --like data/room --signal --out seen.npz
      Those of the radar of another data set, by the closed form and by the signals themselves.
  mhp-inspector transfer study --out radars.md
      One walking body fitted from MMVR-, HuPR- and XRF55-like radars by calibration alone: the three errors side by side.";

/// What `transfer` does.
#[derive(Debug, Subcommand)]
pub enum TransferCommand {
    /// Simulate fitted parameters for another radar: `sim_<array>` a view.
    Map(MapArgs),
    /// Fit the same simulated bodies from three radars, by calibration alone, and write the errors side by side.
    Study(StudyArgs),
}

/// What `transfer map` is told.
#[derive(Debug, Args)]
pub struct MapArgs {
    /// PPPR npz: position, log_scale, rotation, velocity, beta, omega.
    #[arg(long, value_name = "P.npz")]
    params: PathBuf,
    /// The radar, by a layout whose views are published: mmvr, hupr, xrf55.
    #[arg(long, value_name = "LAYOUT", required_unless_present = "like")]
    radar: Option<String>,
    /// The radar of a data set instead: its views, chirp and calibration.
    #[arg(long, value_name = "DIR", conflicts_with = "radar")]
    like: Option<PathBuf>,
    /// Skeleton of the parameters: needed for settings with a body of skin. Default: that with as many joints.
    #[arg(long, value_name = "NAME")]
    skeleton: Option<String>,
    /// Fit configuration; without it the defaults.
    #[arg(long, value_name = "FIT.toml")]
    config: Option<PathBuf>,
    /// Also write `signal_<array>`, by the signals themselves.
    #[arg(long)]
    signal: bool,
    /// Scalar of the per-cell kernel.
    #[arg(long, value_enum, default_value = "f64")]
    precision: PrecisionArg,
    /// Where the maps are written.
    #[arg(long, value_name = "OUT.npz")]
    out: PathBuf,
}

/// What `transfer study` is told.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Sequences: a person, a room and a motion each.
    #[arg(long, value_name = "N", default_value_t = ThreeRadars::default().sequences)]
    sequences: usize,
    /// Frames that are fitted of each sequence, at most 12.
    #[arg(long, value_name = "N", default_value_t = ThreeRadars::default().frames)]
    frames: usize,
    /// Seed of people, rooms and motions.
    #[arg(long, default_value_t = ThreeRadars::default().seed)]
    seed: u64,
    /// Write the section (Markdown) here too.
    #[arg(long, value_name = "FILE.md")]
    out: Option<PathBuf>,
}

/// Runs `transfer`.
///
/// # Errors
/// Where an input cannot be read or does not fit, or an output not be written.
pub(super) fn run(command: &TransferCommand) -> anyhow::Result<ExitCode> {
    match command {
        TransferCommand::Map(args) => map(args),
        TransferCommand::Study(args) => study(args),
    }
}

/// Views, chirp and FFTs of the radar that is asked for.
fn target(args: &MapArgs) -> anyhow::Result<(Vec<View>, RadarConfig, Vec<Option<ViewFft>>)> {
    if let Some(path) = &args.like {
        let dataset = open(path, None)?;
        let info: &DatasetInfo = dataset.info();
        dataset.inputs().with_named([Some(args.params.as_path())]).check_file(&args.out)?;
        return Ok((info.views.to_vec(), info.radar.clone(), info.ffts()));
    }
    let name = args.radar.as_deref().unwrap_or_default();
    // Whoever publishes views says what radar made them.
    let published = |layout: &&dyn Layout| layout.preset_text().is_some();
    let (mut known, mut found) = (Vec::new(), None);
    for &layout in LAYOUTS.iter().filter(|layout| published(layout)) {
        let preset = layout.preset()?;
        if !preset.views.is_empty() {
            known.push(layout.word());
            found = found.or((layout.word() == name).then_some(preset));
        }
    }
    let Some(preset) = found else {
        bail!("--radar {name}: no published views; expected one of {}", known.join(", "));
    };
    // MMVR publishes no chirp.
    let radar = match preset.radar {
        Some(radar) => radar,
        None => RadarPreset::named("generic")?.radar,
    };
    let ffts = preset.calibrations.into_iter().map(|calibration| calibration.fft).collect();
    Ok((preset.views, radar, ffts))
}

fn map(args: &MapArgs) -> anyhow::Result<ExitCode> {
    let config = super::common::config(args.config.as_deref())?;
    let params = read_pppr(&args.params, None)?;
    let inputs = Inputs::default().with_named([Some(args.params.as_path()), args.config.as_deref()]);
    inputs.check_file(&args.out)?;
    let (views, radar, ffts) = target(args)?;
    let shape = params.shape();
    let radar = RadarConfig { doppler_features: shape.doppler_features, ..radar };
    let of_size = || Skeleton::PRESETS.iter().filter_map(|name| Skeleton::preset(name));
    let skeleton = match &args.skeleton {
        Some(name) => Skeleton::preset(name).with_context(|| {
            format!("--skeleton {name}: no such skeleton; expected one of {}", Skeleton::PRESETS.join(", "))
        })?,
        None => of_size().find(|skeleton| skeleton.joints.len() == shape.joints).with_context(|| {
            format!(
                "{}: {} joints are of no skeleton that is known; expected --skeleton",
                args.params.display(),
                shape.joints
            )
        })?,
    };
    // Nothing is measured: only the views' axes are asked.
    let empty: Vec<Vec<f64>> = views.iter().map(|view| vec![1.0; view.cells()]).collect();
    let empty: Vec<&[f64]> = empty.iter().map(Vec::as_slice).collect();
    let problem = Problem::new(radar, skeleton, views, &empty)?;
    problem.check(&params).with_context(|| args.params.display().to_string())?;
    let mut maps = vec![("sim", simulate(&problem, &config, args.precision.into(), &params))];
    if args.signal {
        maps.push(("signal", simulate_signal(&problem, &ffts, &config, &params, CellValue::Centre)?));
    }
    let mut arrays: Vec<(String, ArrayView<'_>)> = Vec::new();
    for (prefix, maps) in &maps {
        for (view, map) in problem.views.iter().zip(maps) {
            arrays.push((format!("{prefix}_{}", view.array), ArrayView::f64(&view.shape(), map)));
        }
    }
    let named: Vec<(&str, ArrayView<'_>)> = arrays.iter().map(|(key, array)| (key.as_str(), array.clone())).collect();
    write(&args.out, &named)?;
    let keys: Vec<&str> = named.iter().map(|(key, _)| *key).collect();
    complain(&format!("{} in {}", keys.join(", "), args.out.display()));
    Ok(ExitCode::SUCCESS)
}

fn study(args: &StudyArgs) -> anyhow::Result<ExitCode> {
    ensure!((1..=200).contains(&args.sequences), "--sequences {}: expected 1 to 200", args.sequences);
    ensure!((1..=12).contains(&args.frames), "--frames {}: expected 1 to 12", args.frames);
    if let Some(out) = &args.out {
        Inputs::default().check_file(out)?;
    }
    let study =
        ThreeRadars { sequences: args.sequences, frames: args.frames, seed: args.seed, ..ThreeRadars::default() };
    let bar = progress_bar(3 * study.fits());
    let rows = study.run(|| bar.inc(1))?;
    bar.finish_and_clear();
    let text = study.markdown(&rows);
    if let Some(out) = &args.out {
        replace_file(out, |file| file.write_all(text.as_bytes())).with_context(|| out.display().to_string())?;
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}
