//! `labels stats`: how many labels there are, of what, where, when, and how long one took.

use super::source::{acts, acts_of, counted, is_table, only};
use crate::cli::common::{open, print, print_json};
use crate::cli::complexity;
use crate::escape::one_line;
use crate::labels::{AnnotatorStatistics, LabelCounts, PAUSE_S, Pace, Record, Tag, Verdict, day, statistics};
use crate::study::complexity::{ComplexityOptions, Stratum, cache_folder};
use anyhow::{Context as _, bail};
use clap::ValueEnum;
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// Shown under the options of `labels stats --help`.
pub(super) const HELP: &str = "\
JSON: an object an annotator with frames, tags, verdicts, notes, groups (the same counts by what --by says), acts, first, last, \
days, hours, median_s. Days and hours are UTC. median_s is the median time from one act to the next, gaps of more than \
ten minutes left out. Labels that were taken back do not count, the acts do. Labels dated in the future, of frames that the
data set does not have, and in files that do not speak for their annotator are told on standard error. Nothing is written.

--by stratum grades the frames as `complexity` does, which reads all of them the first time; what was measured is kept.

Exit codes: 0 told; 2 bad input.

Examples:
  mhp-inspector labels stats data/mmvr
      Everybody's labels, by scene.
  mhp-inspector labels stats data/mmvr --by stratum
      Which tags the hard frames have.
  mhp-inspector labels stats anna.csv --by sequence --json
      One exported table, by folder, for a program to read.";

/// What frames are counted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Grouping {
    /// The first part of a frame's name: `d1s1` of `d1s1/000/00383`.
    Scene,
    /// All but the last part: `d1s1/000`.
    Sequence,
    /// Easy, medium or hard, graded as `complexity` does; PATH must be a data set.
    Stratum,
    /// The day in UTC on which the frame was labelled last.
    Day,
}

/// What the frames that no stratum is known of are counted under.
const NOT_GRADED: &str = "not graded";

/// The group of a frame, by its newest record.
type Group = Box<dyn Fn(&Record) -> Option<String>>;

/// The scene or sequence of a frame; a name of one part has none.
fn part(split: for<'a> fn(&'a str) -> Option<(&'a str, &'a str)>) -> Group {
    Box::new(move |record| split(&record.frame.path).map(|(group, _)| group.to_owned()))
}

/// What `labels stats` is told.
#[derive(Debug, clap::Args)]
pub struct StatsArgs {
    /// A data set, a journal (*.labels.jsonl), or labels exported as CSV or JSON.
    path: PathBuf,
    /// Only this annotator's.
    #[arg(long, value_name = "NAME")]
    annotator: Option<String>,
    /// What frames are counted together.
    #[arg(long, value_enum, default_value = "scene")]
    by: Grouping,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// Reads, counts, prints.
///
/// # Errors
/// Where PATH cannot be read, or the annotator has no labels there.
pub(super) fn run(args: &StatsArgs) -> anyhow::Result<ExitCode> {
    let (acts, group) = read(args)?;
    let acts = only(acts, args.annotator.as_deref(), &args.path)?;
    let found = statistics(&acts, &group);
    if args.json {
        let object: Map<String, Value> = found.iter().map(|(name, one)| (name.clone(), as_json(one))).collect();
        print_json(&(serde_json::to_string_pretty(&Value::Object(object)).context("writing JSON")? + "\n"))?;
    } else if found.is_empty() {
        print(&format!("{}: no labels yet\n", one_line(&args.path.display().to_string())))?;
    } else {
        print(&found.iter().map(|(name, one)| as_text(name, one)).collect::<Vec<_>>().join("\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Every act, and what frames are counted together.
fn read(args: &StatsArgs) -> anyhow::Result<(Vec<Record>, Group)> {
    let manifest = args.manifest.as_deref();
    let group: Group = match args.by {
        Grouping::Scene => part(|frame| frame.split_once('/')),
        Grouping::Sequence => part(|frame| frame.rsplit_once('/')),
        Grouping::Day => Box::new(day),
        Grouping::Stratum => return by_stratum(args),
    };
    Ok((acts(&args.path, manifest)?, group))
}

fn by_stratum(args: &StatsArgs) -> anyhow::Result<(Vec<Record>, Group)> {
    if is_table(&args.path) {
        bail!("{}: --by stratum grades the frames; expected a data set, not a file of labels", args.path.display());
    }
    let dataset = Arc::new(open(&args.path, args.manifest.as_deref())?);
    let acts = acts_of(&dataset)?;
    let graded = complexity::compute(&dataset, ComplexityOptions::default(), cache_folder())?;
    let strata: HashMap<String, Stratum> = graded
        .frames
        .iter()
        .enumerate()
        .filter_map(|(index, frame)| Some((dataset.frame_name(index).to_owned(), frame.as_ref()?.stratum?)))
        .collect();
    let group = move |record: &Record| {
        Some(strata.get(&record.frame.path).map_or(NOT_GRADED, |stratum| stratum.word()).to_owned())
    };
    Ok((acts, Box::new(group)))
}

fn as_json(one: &AnnotatorStatistics) -> Value {
    let groups: Map<String, Value> =
        one.groups.iter().map(|(name, counts)| (name.clone(), counts_json(counts))).collect();
    let Pace { acts, span, days, hours, median_s } = &one.pace;
    let (first, last) = span.clone().unzip();
    let mut object = counts_json(&one.all);
    let more = json!({
        "groups": groups,
        "acts": acts,
        "first": first,
        "last": last,
        "days": days,
        "hours": hours,
        "median_s": median_s,
    });
    if let (Value::Object(object), Value::Object(more)) = (&mut object, more) {
        object.extend(more);
    }
    object
}

fn counts_json(counts: &LabelCounts) -> Value {
    let tags: Map<String, Value> = Tag::ALL.iter().map(|tag| (tag.code().into(), counts.tag(*tag).into())).collect();
    let verdicts = Verdict::ALL.iter().zip(counts.verdicts);
    let verdicts: Map<String, Value> = verdicts.map(|(verdict, n)| (verdict.code().into(), n.into())).collect();
    json!({ "frames": counts.frames, "tags": tags, "verdicts": verdicts, "notes": counts.notes })
}

fn as_text(name: &str, one: &AnnotatorStatistics) -> String {
    let mut text = format!("{}\n", one_line(name));
    let mut rows: Vec<(Cow<'_, str>, &LabelCounts)> =
        one.groups.iter().map(|(name, counts)| (one_line(name), counts)).collect();
    // Strata from easy to hard; any other group stays in the order of names.
    rows.sort_by_key(|(name, _)| name.parse::<Stratum>().ok().filter(|stratum| stratum.word() == name));
    rows.push(("all".into(), &one.all));
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let heads = Tag::ALL.map(|tag| format!("{:>7}", tag.code())).concat();
    let _ = writeln!(text, "  {:<width$} {:>7}{heads} {:>7}", "", "frames", "notes");
    for (group, counts) in rows {
        let tags = counts.tags.map(|n| format!("{n:>7}")).concat();
        let _ = writeln!(text, "  {group:<width$} {:>7}{tags} {:>7}", counts.frames, counts.notes);
    }
    let verdicts = Verdict::ALL.iter().zip(one.all.verdicts).filter(|(_, n)| *n > 0);
    let verdicts: Vec<String> = verdicts.map(|(verdict, n)| format!("{verdict} {n}")).collect();
    if !verdicts.is_empty() {
        let _ = writeln!(text, "  verdicts: {}", verdicts.join(", "));
    }
    text + &pace_text(&one.pace)
}

fn pace_text(pace: &Pace) -> String {
    let mut text = format!("  {}", counted(pace.acts, "act"));
    if let Some((first, last)) = &pace.span {
        let (first, last) = (one_line(first), one_line(last));
        let _ = write!(text, " on {}, {first} to {last}", counted(pace.days.len(), "day"));
    }
    if let Some(median) = pace.median_s {
        let _ = write!(text, "; median {median:.1} s from one to the next (pauses over {PAUSE_S:.0} s left out)");
    }
    text + "\n"
}
