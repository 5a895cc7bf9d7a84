//! `evidence`: what speaks for each failure mode of a fit, as cards, JSON or CSV.

use super::common::{
    CsvArgs, PeopleArg, PrecisionArg, complain, inputs, open, presets, print, print_json, progress_bar, settings,
};
use super::frames::{FrameRange, chosen};
use super::merge::MergeArgs;
use super::shards::{ShardArgs, end};
use super::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::body::Pppr;
use crate::config::{FitConfig, Preset};
use crate::dataset::{Dataset, read_pppr};
use crate::diagnose::{Evidence, Finding, FindingPlace};
use crate::escape::{one_line, to_cell};
use crate::labels::Tag;
use crate::mhp::Precision;
use crate::output::replace_file;
use crate::start::problem_alone;
use crate::study::shard::{FrameCommand, ShardFolder, ShardSpec, Whole};
use crate::study::{BatchOptions, FrameEvidence, frame_evidence};
use anyhow::Context as _;
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `evidence --help`.
pub(super) const HELP: &str = "\
A score is the probability that the mode is there: 0.5 means even odds. The odds are those of data in which each mode has about
one frame in eight (the card says the share). Where you expect the share p instead, with P the share on the card, read
  odds' = odds * p/(1 - p) * (1 - P)/P,   odds = score/(1 - score)
so that a score of 0.5 becomes 0.88 where half of the frames have the mode (P = 1/8), and 0.07 where one in a hundred has.
Scores are learned from simulated frames; the last line of a card says how well they told the mode there on frames that were not
learned from. A mode that cannot be told has scores near its share. `-` (null in JSON, empty in CSV) where a frame cannot be
judged, and the text says why. `raw` in JSON is the value by these formulas, which orders frames but is no probability:
  F1  share of H_ori's mask that is bright in each of the last 5 frames, mean over the views.
  F2  1/(1 + (r/d_F)^2): r the nearest joint's range, d_F = 2D^2/lambda the array's Fraunhofer distance.
  F3  share of the simulated echo that two persons have in common, in the view that parts them best; 0 with one person.
  F4  1/(1 + u^2): u the joints' radial velocity in Doppler cells, or where no axis measures it how many times as
      much as the rest of the map the EM region changed since the frame before, less one.
The scores rest on these measures (`measures` in JSON):
  F1  persistence, static_level: how much of what lies beside the body lasts through 5 frames, and how strong it is.
  F2  nearness: ln(d_F/r).
  F3  close_pair: probability that the maps show two people or more, less the farther apart they are counted; whatever is fitted.
  F4  quiet, steadiness: strongest change over 5 frames outside the EM region against inside, and how little the body's own echo
      varies (over 2 frames: quiet_pair, steadiness_pair); in a single frame with a Doppler axis slowness, -ln u.

With --restarts N each frame is fitted from N starts too (`explore restarts` says how they are spread): `best_basin` is the share
whose fits end in the best basin. Near 1 every start finds the same; a small one is a frame that is ambiguous, or a fit that does
not find out of its start.

JSON: an array of {frame, index, best_basin, F1: {score, raw, measures: [{name, value}], summary, findings: [{text, place}]}, F2, F3, \
F4}; place is null, {cells: {view, \
lo, hi}}, {joint: N} or {frame: INDEX}. A frame that fails has `error` instead of F1 to F4.

Exit codes: 0 every frame was judged; 1 some were not; 2 none was, or the input is bad.

Examples:
  mhp-inspector evidence samples/walk --frames 7
      Fits frame 7, reads frames 3 to 6, prints four cards.
  mhp-inspector evidence data/d1s1 --frames 0..900 --csv evidence.csv
      A minute of MMVR as a table; add --json for the findings.
  mhp-inspector evidence data/d1s1 --shard 2/8 --out shards/2
      The second of eight parts; `mhp-inspector merge shards/* --out whole` writes the table of all.";

/// What `evidence` is told.
#[derive(Debug, Args)]
pub struct EvidenceArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// Frames to judge, counted from 0, as in Rust: 5..12 (12 not included), 5..=11, 5.., ..12, or 7 alone. Default: all,
    /// or the one that PATH names.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// PPPR npz of the joints, for one frame; without it each frame is fitted.
    #[arg(long, value_name = "P.npz", conflicts_with_all = ["iterations", "shard"])]
    params: Option<PathBuf>,
    /// Adam steps of a frame, instead of the configuration's.
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Fit configuration; without it the preset.
    #[arg(long, value_name = "FIT.toml", conflicts_with = "preset")]
    config: Option<PathBuf>,
    /// Settings with a name. The scores were calibrated on fits of the baseline.
    #[arg(long, value_name = "NAME", default_value = Preset::Baseline.name(), value_parser = presets())]
    preset: Preset,
    #[command(flatten)]
    people: PeopleArg,
    /// Scalar of the per-cell kernel.
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
    /// Also fit each frame from this many starts, and tell the share that ends in the best basin.
    #[arg(long, value_name = "N", value_parser = super::explore::starts)]
    restarts: Option<usize>,
    /// One JSON array instead of cards.
    #[arg(long)]
    json: bool,
    /// Also write a table: frame, index, F1 to F4, their summaries, best_basin, error.
    #[arg(long, value_name = "F")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    cells: CsvArgs,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    #[command(flatten)]
    part: ShardArgs,
}

/// Runs `evidence`.
///
/// # Errors
/// Where the configuration, the data set, the range of frames or the parameters are bad, or the table cannot be written.
pub(super) fn run(args: &EvidenceArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let config = args.people.of(&settings(args.config.as_deref(), args.preset, args.iterations)?);
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = chosen(args.frames, &args.path, &dataset)?;
    let named = [args.params.as_deref(), args.config.as_deref(), args.manifest.as_deref()];
    let inputs = inputs(&dataset, &args.path, &named);
    let options = BatchOptions {
        config,
        precision: args.precision.into(),
        warm_start: false,
        params_folder: None,
        ply: false,
        curves_folder: None,
        ..BatchOptions::default()
    };
    let params = args.params.as_deref().map(|path| params(path, &dataset, &frames)).transpose()?;
    let judge = |frames: Range<usize>| -> Vec<FrameEvidence> {
        let bar = progress_bar(frames.len());
        let judge = |index| {
            let mut judged = frame_evidence(&dataset, index, &options, params.as_ref());
            if let Some(starts) = args.restarts {
                judged.best_basin = super::explore::best_basin(&dataset, index, &options, starts);
            }
            bar.inc(1);
            judged
        };
        let judged = frames.into_par_iter().map(judge).collect();
        bar.finish_and_clear();
        judged
    };
    if let Some((shard, out)) = args.part.asked() {
        let settings = Settings { precision: options.precision, fit: config, restarts: args.restarts };
        let spec = ShardSpec::new(FrameCommand::Evidence, &dataset, &frames, shard, &settings)?;
        let folder = ShardFolder::begin(out, &[], spec, &inputs)?;
        let judged = judge(shard.stretch(&frames));
        folder.finish(&judged)?;
        return Ok(end(shard, out, &judged));
    }
    if let Some(file) = &args.csv {
        inputs.check_file(file)?;
    }
    let arrays: Vec<String> = dataset.info().views.iter().map(|view| view.array.clone()).collect();
    tell(&judge(frames), &arrays, args.csv.as_deref(), args.json)
}

/// Runs `merge` on shards of `evidence`.
///
/// # Errors
/// Where they are not one whole, or the folder cannot be written.
pub(super) fn merge(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    let Whole { spec, rows, folders } = Whole::<FrameEvidence>::read(&args.shards)?;
    let whole = args.begin(&spec, &folders, &[])?;
    let file = whole.file("evidence.csv")?;
    tell(&rows, &spec.data.arrays, Some(&file), args.json)
}

/// What the evidence depends on, besides the frames.
#[derive(Serialize)]
struct Settings {
    precision: Precision,
    fit: FitConfig,
    #[serde(skip_serializing_if = "Option::is_none")]
    restarts: Option<usize>,
}

/// Writes the table, prints.
fn tell(judged: &[FrameEvidence], arrays: &[String], csv: Option<&Path>, json: bool) -> anyhow::Result<ExitCode> {
    if let Some(path) = csv {
        let table = table(judged).context("making the table")?;
        let written = replace_file(path, |out| out.write_all(&table));
        written.with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    if json {
        let rows: Vec<Value> = judged.iter().map(json_row).collect();
        print_json(&(serde_json::to_string_pretty(&rows).context("writing JSON")? + "\n"))?;
    } else {
        print(&cards(judged, arrays))?;
    }
    Ok(told(judged))
}

/// The parameters of the one frame that is asked for.
fn params(path: &Path, dataset: &Dataset, frames: &Range<usize>) -> anyhow::Result<Pppr> {
    if frames.len() != 1 {
        let count = frames.len();
        anyhow::bail!("{}: --params is of one frame, {count} were asked for; expected --frames N", path.display());
    }
    let params = read_pppr(path, None)?;
    let frame = dataset.load(frames.start)?;
    let problem =
        problem_alone(dataset, &frame).with_context(|| dataset.frame_path(frames.start).display().to_string())?;
    problem.check(&params).with_context(|| path.display().to_string())?;
    Ok(params)
}

/// The exit code, and on standard error what failed.
fn told(judged: &[FrameEvidence]) -> ExitCode {
    let mut errors = judged.iter().filter_map(|frame| frame.evidence.as_ref().err());
    let Some(first) = errors.next() else { return ExitCode::SUCCESS };
    let (failed, count) = (1 + errors.count(), judged.len());
    match count {
        1 => complain(&format!("error: {first}")),
        _ if failed == count => complain(&format!("error: none of {count} frames could be judged; the first: {first}")),
        _ => complain(&format!("warning: {failed} of {count} frames could not be judged; the first: {first}")),
    }
    ExitCode::from(if failed == count { EXIT_BAD_INPUT } else { EXIT_SOME_FAILED })
}

fn json_row(frame: &FrameEvidence) -> Value {
    let mut row = Map::new();
    row.insert("frame".into(), frame.frame.clone().into());
    row.insert("index".into(), frame.index.into());
    row.insert("best_basin".into(), frame.best_basin.into());
    match &frame.evidence {
        Ok(modes) => row.extend(modes.iter().map(|mode| {
            let Evidence { score, raw, measures, summary, findings, .. } = mode;
            let card = json!({
                "score": score, "raw": raw, "measures": measures, "summary": summary, "findings": findings
            });
            (mode.mode.code().to_owned(), card)
        })),
        Err(why) => {
            row.insert("error".into(), why.clone().into());
        }
    }
    Value::Object(row)
}

/// `frame index F1 F2 F3 F4 F1_summary … F4_summary best_basin error`.
fn table(judged: &[FrameEvidence]) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let codes = Tag::MODES.map(|mode| mode.code().to_owned());
    let summaries = codes.clone().map(|code| code + "_summary");
    let head = ["frame".to_owned(), "index".to_owned()].into_iter().chain(codes).chain(summaries);
    writer.write_record(head.chain(["best_basin".to_owned(), "error".to_owned()]))?;
    for frame in judged {
        let modes: &[Evidence] = frame.evidence.as_ref().map_or(&[], Vec::as_slice);
        let find = |tag: Tag| modes.iter().find(|mode| mode.mode == tag);
        let score = |tag| find(tag).and_then(|mode| mode.score).map(|score| score.to_string()).unwrap_or_default();
        let summary = |tag| find(tag).map(|mode| to_cell(&mode.summary).into_owned()).unwrap_or_default();
        let first = [to_cell(&frame.frame).into_owned(), frame.index.to_string()];
        let cells = first.into_iter().chain(Tag::MODES.map(score)).chain(Tag::MODES.map(summary));
        let error = frame.evidence.as_ref().map_or_else(|why| to_cell(why).into_owned(), |_| String::new());
        let basin = frame.best_basin.map(|share| share.to_string()).unwrap_or_default();
        writer.write_record(cells.chain([basin, error]))?;
    }
    writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))
}

/// Four cards a frame.
fn cards(judged: &[FrameEvidence], arrays: &[String]) -> String {
    let mut text = String::new();
    for frame in judged {
        if !text.is_empty() {
            text.push('\n');
        }
        let _ = writeln!(text, "frame {}  {}", frame.index, one_line(&frame.frame));
        match &frame.evidence {
            Err(why) => {
                let _ = writeln!(text, "  cannot be judged: {}", one_line(why));
            }
            Ok(modes) => modes.iter().for_each(|mode| card(&mut text, mode, arrays)),
        }
        if let Some(share) = frame.best_basin {
            let _ = writeln!(text, "  restarts: {:.0} % of the starts end in the best basin", 100.0 * share);
        }
    }
    text
}

fn card(text: &mut String, mode: &Evidence, arrays: &[String]) {
    let score = mode.score.map_or_else(|| "-".to_owned(), |score| format!("{score:.2}"));
    let title = format!("{} {}", mode.mode, mode.mode.words());
    let _ = writeln!(text, "  {title:<36} {score:>4}  {}", one_line(&mode.summary));
    for finding in &mode.findings {
        let _ = writeln!(text, "    · {}", one_line(&(finding.text.clone() + &place(finding, arrays))));
    }
}

/// Where a finding is seen, in words.
fn place(finding: &Finding, arrays: &[String]) -> String {
    match &finding.place {
        None => String::new(),
        Some(FindingPlace::Joint(joint)) => format!(" [joint {joint}]"),
        Some(FindingPlace::Frame(index)) => format!(" [frame {index}]"),
        Some(FindingPlace::Cells { view, lo, hi }) => {
            let array = arrays.get(*view).map_or("", String::as_str);
            let spans: Vec<String> = lo.iter().zip(hi).map(|(lo, hi)| format!("{lo}..={hi}")).collect();
            format!(" [{array}[{}]]", spans.join(", "))
        }
    }
}
