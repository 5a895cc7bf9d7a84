//! `chain`: the stages of a radar's processing, from the converter to the angle spectrum, in numbers.

use super::common::{inputs, open, print, print_json};
use crate::dataset::Dataset;
use crate::dataset::adc::{ChainStages, StageLimit};
use crate::output::replace_file;
use crate::radar::sine_deg;
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The manifest of a capture, to fill in.
const FORM: &str = include_str!("../../assets/capture_form.toml");

/// Shown under the options of `chain --help`.
pub(super) const HELP: &str = "\
Exit codes: 0 told; 2 bad input, or a data set without samples of a converter.

Examples:
  mhp-inspector chain captures/adc_data.bin
      What range, speed and angle resolve, the strongest echo, and what the numbers warn of.
  mhp-inspector chain captures --frame 12 --csv profile.csv --json
      The range profile of frame 12 as a table, all else as JSON.
  mhp-inspector chain --form > dataset.toml
      A manifest to fill in, for a capture without a configuration file.";

/// What `chain` is told.
#[derive(Debug, Args)]
pub struct ChainArgs {
    /// A capture (.bin, .pcap), its folder, or a `dataset.toml` that describes it.
    #[arg(required_unless_present = "form")]
    path: Option<PathBuf>,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    frame: usize,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Write the curves: stage, place, unit, amplitude; ADC samples, range profile with and without what stands still, angle.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print a `dataset.toml` for a capture without a configuration file, to fill in.
    #[arg(long, conflicts_with_all = ["path", "json", "csv"])]
    form: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// Runs `chain`.
///
/// # Errors
/// Where the capture cannot be opened or read, or the data set holds maps only.
pub(super) fn run(args: &ChainArgs) -> anyhow::Result<ExitCode> {
    let Some(path) = args.path.as_deref().filter(|_| !args.form) else {
        print(FORM)?;
        return Ok(ExitCode::SUCCESS);
    };
    let dataset = open(path, args.manifest.as_deref())?;
    let Some(stages) = dataset.stages(args.frame)? else {
        bail!(
            "{}: layout \"{}\" holds maps, not the samples of a converter; expected a capture (.bin, .pcap, .npy)",
            path.display(),
            dataset.info().layout
        );
    };
    if let Some(csv) = &args.csv {
        write_curves(csv, &dataset, path, args, &stages)?;
    }
    if args.json {
        let text = serde_json::to_string_pretty(&as_json(&dataset, args.frame, &stages)).context("writing JSON")?;
        print_json(&format!("{text}\n"))?;
    } else {
        print(&as_text(&dataset, args.frame, &stages))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn as_text(dataset: &Dataset, frame: usize, stages: &ChainStages) -> String {
    let mut text = format!("capture     {}, frame {frame} of {}\n", dataset.info().name, dataset.len());
    for assumed in &dataset.info().assumptions {
        let _ = writeln!(text, "assumed     {assumed}");
    }
    for limit in &stages.limits {
        let StageLimit { quantity, resolution, most, unit, formula } = limit;
        let _ =
            writeln!(text, "{quantity:<12}resolution {resolution:.4} {unit}, at most {most:.3} {unit}   ({formula})");
    }
    let (range, speed) = stages.strongest;
    let angle = strongest_angle(stages).map_or_else(String::new, |angle| format!(", {angle:.1}°"));
    let _ = writeln!(text, "strongest   {range:.3} m, {speed:+.3} m/s{angle}");
    for warning in &stages.warnings {
        let _ = writeln!(text, "warning     {warning}");
    }
    text
}

/// Where the angle spectrum is highest, degrees.
fn strongest_angle(stages: &ChainStages) -> Option<f64> {
    let (at, _) = stages.angle.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    Some(sine_deg((at as f64 - (stages.angle.len() / 2) as f64) * stages.sine_step))
}

fn as_json(dataset: &Dataset, frame: usize, stages: &ChainStages) -> Value {
    let limit = |limit: &StageLimit| json!({ "quantity": limit.quantity, "resolution": limit.resolution, "most": limit.most, "unit": limit.unit });
    json!({
        "name": dataset.info().name,
        "frame": frame,
        "frames": dataset.len(),
        "limits": stages.limits.iter().map(limit).collect::<Vec<_>>(),
        "clipped": stages.clipped,
        "range_bin_m": stages.range_step_m,
        "strongest": { "range_m": stages.strongest.0, "speed_mps": stages.strongest.1, "angle_deg": strongest_angle(stages) },
        "warnings": stages.warnings,
        "assumptions": dataset.info().assumptions,
    })
}

fn write_curves(
    file: &Path,
    dataset: &Dataset,
    path: &Path,
    args: &ChainArgs,
    stages: &ChainStages,
) -> anyhow::Result<()> {
    inputs(dataset, path, &[args.manifest.as_deref()]).check_file(file)?;
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(["stage", "place", "unit", "amplitude"])?;
    let mut curve = |stage: &str, unit: &str, points: &mut dyn Iterator<Item = (f64, f64)>| {
        for (place, x) in points {
            out.write_record([stage, &format!("{place:.6}"), unit, &format!("{x:.6}")])?;
        }
        Ok::<(), csv::Error>(())
    };
    let at = |step: f64| move |(bin, &x): (usize, &f64)| (bin as f64 * step, x);
    curve("adc_i", "sample", &mut stages.adc.iter().enumerate().map(|(n, x)| (n as f64, x.re)))?;
    curve("adc_q", "sample", &mut stages.adc.iter().enumerate().map(|(n, x)| (n as f64, x.im)))?;
    curve("range", "m", &mut stages.profile.iter().enumerate().map(at(stages.range_step_m)))?;
    curve("range_moving", "m", &mut stages.moving.iter().enumerate().map(at(stages.range_step_m)))?;
    let half = (stages.angle.len() / 2) as f64;
    let angle = stages.angle.iter().enumerate().map(|(bin, &x)| (sine_deg((bin as f64 - half) * stages.sine_step), x));
    curve("angle", "deg", &mut angle.into_iter())?;
    let bytes = out.into_inner().map_err(csv::IntoInnerError::into_error)?;
    replace_file(file, |out| out.write_all(&bytes)).with_context(|| file.display().to_string())
}
