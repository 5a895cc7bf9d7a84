//! `explore tuning`: the tuning map as a table, JSON, or the run folder of a sweep.

use crate::cli::common::{
    EraseArg, PeopleArg, PrecisionArg, complain, inputs, open, presets, print, print_json, settings,
};
use crate::cli::frames::{FrameRange, chosen_set};
use crate::cli::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::config::Preset;
use crate::dataset::Dataset;
use crate::explore::{Halt, IdleCores, TunedQuantity, TuningAxis, TuningMap, TuningRequest, tuning_map};
use crate::study::run::{RunFolder, RunPlan, RunRequest, StudyKind, check_run_folder, execute_run, seed_run};
use crate::study::shard::Subset;
use crate::task::Progress;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// Shown under the options of `explore tuning --help`.
pub(super) const HELP: &str = "\
The fits are those of `study sweep`, cell by cell; --out keeps them as its run folder. L does not compare between weights, L_EM
not between regions, objectives and tau: IoU does, and the errors where there is truth.

JSON: {axes: [{key, values}], frames, cells: [{labels, frame, loss, em, iou, majpe, pa_majpe, reprojection, settled}], best}.

Examples:
  mhp-inspector explore tuning samples/walk --frames 3 --preset baseline --grid tau_pct=2..40:24log --by iou
      A curve: which tau would one take for this frame?
  mhp-inspector explore tuning data/mmvr --preset baseline --grid w_em=0.1,0.5,1 --grid summation=coherent,incoherent --json
      Choices as well as numbers.";

/// The settings, for `--help`.
pub(super) fn long_help() -> String {
    format!("{HELP}\n\n{}", crate::config::listing())
}

/// What `explore tuning` is told.
#[derive(Debug, Args)]
pub struct TuningArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// A key of FIT.toml (`table.key` inside a table) and its values, once or twice: KEY=FROM..TO:STEPS, with `log` at the end
    /// for equal factors, or KEY=V,V,….
    #[arg(long, required = true, value_name = "KEY=…")]
    grid: Vec<TuningAxis>,
    /// Frames to fit, counted from 0, as in Rust: 5..12 (12 not included), 5..=11, 5.., ..12, or 7 alone; several with
    /// commas between. Default: the first, or the one that PATH names.
    #[arg(long, value_name = "A..B,…", value_delimiter = ',')]
    frames: Vec<FrameRange>,
    /// What the map is printed of and the best is best by.
    #[arg(long, value_name = "QUANTITY", default_value = "loss", value_parser = quantity)]
    by: TunedQuantity,
    /// The settings that the cells build on.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = presets())]
    preset: Preset,
    /// A fit configuration instead of a preset; keys that it lacks are those of `baseline`.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
    #[command(flatten)]
    people: PeopleArg,
    /// Adam steps of every fit, instead of the configuration's.
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Scalar of the per-cell kernel.
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
    /// Threads; default: one for each core. The result is the same with any number.
    #[arg(long, value_name = "N")]
    threads: Option<std::num::NonZeroUsize>,
    #[command(flatten)]
    erase: EraseArg,
    /// Keep the fits as the run folder that `study sweep` would write.
    #[arg(long, value_name = "RUN")]
    out: Option<PathBuf>,
    /// Every fit as JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

fn quantity(text: &str) -> Result<TunedQuantity, String> {
    let keys = || TunedQuantity::ALL.map(TunedQuantity::key).join(", ");
    TunedQuantity::of_key(text).ok_or_else(|| format!("expected one of {}", keys()))
}

/// Runs `explore tuning`.
///
/// # Errors
/// Where an argument, the data set, the grid or the folder is bad.
pub(super) fn run(args: &TuningArgs) -> anyhow::Result<ExitCode> {
    anyhow::ensure!(
        args.grid.len() <= 2,
        "--grid: {} settings; expected one or two (`study sweep` takes any number)",
        args.grid.len()
    );
    let base = args.people.of(&settings(args.config.as_deref(), args.preset, args.iterations)?);
    let dataset = Arc::new(open(&args.path, args.manifest.as_deref())?);
    if let Some(out) = &args.out {
        check_run_folder(
            out,
            &inputs(&dataset, &args.path, &[args.config.as_deref(), args.manifest.as_deref(), args.erase.file()]),
        )?;
    }
    let frames = if args.frames.is_empty() {
        let first = dataset.named_frame().unwrap_or(0);
        (first..first + 1).into()
    } else {
        chosen_set(&args.frames, &args.path, &dataset)?
    };
    let grid = args
        .grid
        .iter()
        .map(TuningAxis::grid)
        .collect::<Result<Vec<_>, _>>()
        .map_err(|why| anyhow::anyhow!("--grid: {why}"))?;
    let request = TuningRequest {
        dataset: Arc::clone(&dataset),
        frames: frames.iter().filter_map(|frame| u32::try_from(frame).ok()).collect(),
        base,
        precision: args.precision.into(),
        grid,
        erased: args.erase.read(&dataset)?.into(),
    };
    let cores = args.threads.map_or_else(IdleCores::all, |threads| IdleCores::of(threads.into()));
    let map = match tuning_map(&request, &cores, &Progress::new()) {
        Ok(map) => map,
        Err(Halt::Failed(why)) => anyhow::bail!("--grid: {why}"),
        Err(Halt::Cancelled) => anyhow::bail!("internal error: it was cancelled by nobody"),
    };
    if let Some(out) = &args.out {
        keep(&map, &request, frames, args, out)?;
    }
    if args.json {
        print_json(&(serde_json::to_string_pretty(&json_of(&map, &dataset, args.by))? + "\n"))?;
    } else {
        print(&text(&map, args.by))?;
    }
    Ok(told(&map))
}

/// Writes the run folder of the sweep: what is fitted is not fitted again.
fn keep(
    map: &TuningMap,
    request: &TuningRequest,
    frames: crate::study::shard::FrameRanges,
    args: &TuningArgs,
    out: &std::path::Path,
) -> anyhow::Result<()> {
    let run = RunRequest {
        study: StudyKind::Sweep,
        base: request.base,
        base_name: if args.config.is_some() { "configuration file" } else { args.preset.name() }.into(),
        precision: request.precision,
        frames,
        subset: Subset::All,
        grid: request.grid.clone(),
        iterations: None,
        shard: None,
        erased: Arc::clone(&request.erased),
    };
    let plan = RunPlan::new(&request.dataset, &run, None)?;
    let folder = RunFolder::of_data(out, &request.dataset);
    seed_run(&plan, &folder, &map.rows())?;
    execute_run(&request.dataset, &plan, &folder, 1, &Progress::new(), None)?;
    Ok(())
}

/// The exit code, and on standard error what failed.
fn told(map: &TuningMap) -> ExitCode {
    let rows = map.rows();
    let failed: Vec<&String> = rows.iter().filter_map(|row| row.fit.as_ref().err()).collect();
    let Some(first) = failed.first() else { return ExitCode::SUCCESS };
    let (count, all) = (failed.len(), rows.len());
    if count == all {
        complain(&format!("error: none of {all} fits worked; the first: {first}"));
        return ExitCode::from(EXIT_BAD_INPUT);
    }
    complain(&format!("warning: {count} of {all} fits did not work; the first: {first}"));
    ExitCode::from(EXIT_SOME_FAILED)
}

fn json_of(map: &TuningMap, dataset: &Dataset, by: TunedQuantity) -> Value {
    let labels = |point: usize| map.variants.get(point).map(|variant| variant.labels.clone());
    let cells: Vec<Value> = (0..map.points())
        .flat_map(|point| map.frames.iter().enumerate().map(move |(place, frame)| (point, place, *frame as usize)))
        .filter_map(|(point, place, frame)| {
            let fit = map.fit(point, place)?;
            let mut cell = serde_json::Map::new();
            cell.insert("labels".into(), json!(labels(point)));
            cell.insert("frame".into(), json!(dataset.frame_name(frame)));
            for quantity in TunedQuantity::ALL {
                cell.insert(quantity.key().into(), json!(quantity.of(fit)));
            }
            if let Err(why) = &fit.row.fit {
                cell.insert("error".into(), json!(why));
            }
            Some(Value::Object(cell))
        })
        .collect();
    let axes: Vec<Value> = map.grid.iter().map(|axis| json!({"key": axis.key, "values": axis.values})).collect();
    let frames: Vec<&str> = map.frames.iter().map(|&frame| dataset.frame_name(frame as usize)).collect();
    json!({"axes": axes, "frames": frames, "cells": cells, "best": map.best(by).and_then(labels)})
}

/// The map of a quantity, the first setting across and the second down; then the best point with all its numbers.
fn text(map: &TuningMap, by: TunedQuantity) -> String {
    let mut text = String::new();
    let value = |point: usize| map.value(point, by).map_or_else(|| "-".to_owned(), |(value, _)| by.text(value));
    let head = |name: &str| if by.unit().is_empty() { name.to_owned() } else { format!("{name}, {}", by.unit()) };
    let count = map.frames.len();
    let of = if count == 1 { String::new() } else { format!(", mean of {count} frames") };
    if let [across, down] = map.grid.as_slice() {
        let _ = writeln!(text, "{} by {} (across) and {} (down){of}", head(by.title()), across.key, down.key);
        let width = |texts: &mut dyn Iterator<Item = usize>| texts.max().unwrap_or(0).max(6);
        let column = width(&mut across.values.iter().map(String::len)) + 1;
        let first = width(&mut down.values.iter().map(String::len));
        let _ = write!(text, "{:first$}", "");
        for value in &across.values {
            let _ = write!(text, "{value:>column$}");
        }
        for (j, label) in down.values.iter().enumerate() {
            let _ = write!(text, "\n{label:>first$}");
            for i in 0..across.values.len() {
                let _ = write!(text, "{:>column$}", value(map.point(&[i, j])));
            }
        }
        text.push('\n');
    } else if let [axis] = map.grid.as_slice() {
        let _ = writeln!(text, "{} by {}{of}", head(by.title()), axis.key);
        for (point, label) in axis.values.iter().enumerate() {
            let spread = map.value(point, by).map(|(_, spread)| spread).filter(|spread| *spread > 0.0);
            let spread = spread.map_or_else(String::new, |spread| format!(" ± {}", by.text(spread)));
            let _ = writeln!(text, "{label:>10}  {:>10}{spread}", value(point));
        }
    }
    if let Some(best) = map.best(by) {
        let labels = map.variants.get(best).map(|variant| variant.labels.clone()).unwrap_or_default();
        let named: Vec<String> =
            map.grid.iter().zip(labels).map(|(axis, value)| format!("{} = {value}", axis.key)).collect();
        let _ = writeln!(text, "\nbest by {}: {}", by.title(), named.join(", "));
        for quantity in TunedQuantity::ALL {
            if let Some((value, _)) = map.value(best, quantity) {
                let _ = writeln!(text, "  {:<13}{:>10} {}", quantity.title(), quantity.text(value), quantity.unit());
            }
        }
    }
    text
}
