//! `count`: how many people each frame shows, how sure that is, and where they are.

mod report;

use super::common::{CsvArgs, complain, inputs, open, print, print_json, progress_bar};
use super::frames::{FrameRange, chosen};
use super::merge::MergeArgs;
use super::shards::{ShardArgs, end};
use super::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::study::count::{FrameCount, count_frames, identify};
use crate::study::shard::{FrameCommand, ShardFolder, ShardSpec, Whole};
use anyhow::Context as _;
use clap::Args;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `count --help`.
pub(super) const HELP: &str = "\
What is done: what changed since the frames before (people never stand as still as a room), cells above mean + 2 standard
deviations of the logarithms around, in metres with heights from the other view, DBSCAN (0.3 m, 3 points) over the
detections of four frames, and a small network that says of each cluster how many people it is. What the last twenty frames
agree on is the count. The first frame of a sequence is compared with those after it; a frame that is all there is shows
furniture as well as people, and where its count is not clear a ? stands behind it.

Columns of the CSV: frame, people, probability (of that number), p0 p1 p2 p3 p4 (4 and more), annotated (where the data
set knows), persons: `identity:x:y:z` of each, metres, separated by spaces, uncertain (true or false). The same identity is
the same person within a sequence. What is unknown is empty (null in JSON).

Exit codes: 0 every frame was counted; 1 some were not; 2 none was, or the input is bad.

Examples:
  mhp-inspector count data/mmvr
      A line a frame, and how often the count is that of the labels.
  mhp-inspector count data/mmvr --frames 0..100 --csv counts.csv
      The first hundred frames, and a table of them.
  mhp-inspector count data/mmvr --shard 2/8 --out shards/2
      The second of eight parts; `mhp-inspector merge shards/* --out whole` writes the table of all.";

/// What `count` is told.
#[derive(Debug, Args)]
pub struct CountArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    /// Frames to count, counted from 0, the end not included. [default: all; of a `*_radar.npz` that one]
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// Write a row a frame.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    cells: CsvArgs,
    /// One JSON object instead of the table: an array `frames`, and `confusion` where counts are annotated.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    part: ShardArgs,
}

/// Runs `count`.
///
/// # Errors
/// Where an option or the data set is bad, its views tell no place, or FILE cannot be written.
pub(super) fn run(args: &CountArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = chosen(args.frames, &args.path, &dataset)?;
    let inputs = inputs(&dataset, &args.path, &[args.manifest.as_deref()]);
    let settings = Settings { frame_rate_hz: dataset.info().frame_rate_hz };
    let count = |frames: Range<usize>| {
        let bar = progress_bar(frames.len());
        let rows = count_frames(&dataset, frames, || bar.inc(1)).with_context(|| args.path.display().to_string());
        bar.finish_and_clear();
        rows
    };
    if let Some((shard, out)) = args.part.asked() {
        let spec = ShardSpec::new(FrameCommand::Count, &dataset, &frames, shard, &settings)?;
        let folder = ShardFolder::begin(out, &[], spec, &inputs)?;
        let rows = count(shard.stretch(&frames))?;
        folder.finish(&rows)?;
        return Ok(end(shard, out, &rows));
    }
    if let Some(file) = &args.csv {
        inputs.check_file(file)?;
    }
    tell(&dataset.info().name, count(frames)?, &settings, args.csv.as_deref(), args.json)
}

/// Runs `merge` on shards of `count`.
///
/// # Errors
/// Where they are not one whole, or the folder cannot be written.
pub(super) fn merge(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    let Whole { spec, rows, folders } = Whole::<FrameCount>::read(&args.shards)?;
    let whole = args.begin(&spec, &folders, &[])?;
    let file = whole.file("count.csv")?;
    tell(&spec.data.name, rows, &spec.settings()?, Some(&file), args.json)
}

/// What the identities depend on, besides the frames.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frame_rate_hz: Option<f64>,
}

/// Tells who is who, writes the table, prints.
fn tell(
    data_set: &str,
    mut rows: Vec<FrameCount>,
    settings: &Settings,
    csv: Option<&Path>,
    json: bool,
) -> anyhow::Result<ExitCode> {
    identify(&mut rows, settings.frame_rate_hz);
    if let Some(file) = csv {
        report::write_csv(file, &rows)?;
    }
    if json {
        print_json(&report::json(data_set, &rows)?)?;
    } else {
        print(&report::table(&rows))?;
    }
    Ok(tell_failures(&rows))
}

/// Failures that are told one by one.
const TOLD: usize = 10;

fn tell_failures(rows: &[FrameCount]) -> ExitCode {
    let failed: Vec<&String> = rows.iter().filter_map(|row| row.count.as_ref().err()).collect();
    if failed.is_empty() {
        return ExitCode::SUCCESS;
    }
    for why in failed.iter().take(TOLD) {
        complain(&format!("warning: {why}"));
    }
    if failed.len() == rows.len() {
        complain(&format!("error: none of {} frames could be counted", rows.len()));
        return ExitCode::from(EXIT_BAD_INPUT);
    }
    complain(&format!("warning: {} of {} frames could not be counted", failed.len(), rows.len()));
    ExitCode::from(EXIT_SOME_FAILED)
}
