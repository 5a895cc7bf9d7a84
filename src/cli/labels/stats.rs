//! `labels stats`: how many labels there are, of what, where, when, and how long one took.

use super::source::{acts, counted, only};
use crate::cli::common::print;
use crate::labels::{AnnotatorStatistics, LabelCounts, PAUSE_S, Pace, Tag, Verdict, statistics};
use anyhow::Context as _;
use clap::ValueEnum;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `labels stats --help`.
pub(super) const HELP: &str = "\
JSON: an object an annotator with frames, tags, verdicts, notes, groups (the same counts by scene), acts, first, last, \
days, hours, median_s. Days and hours are UTC. median_s is the median time from one act to the next, gaps of more than \
ten minutes left out. Labels that were taken back do not count, the acts do.

Exit codes: 0 told; 2 bad input.

Examples:
  mhp-inspector labels stats data/mmvr
      Everybody's labels, by scene.
  mhp-inspector labels stats anna.csv --by sequence --json
      One exported table, by folder, for a program to read.";

/// What frames are counted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Grouping {
    /// The first part of a frame's name: `d1s1` of `d1s1/000/00383`.
    Scene,
    /// All but the last part: `d1s1/000`.
    Sequence,
}

impl Grouping {
    /// The group of the frame of this name; a name of one part has none.
    fn of(self, frame: &str) -> Option<String> {
        let parts = match self {
            Self::Scene => frame.split_once('/'),
            Self::Sequence => frame.rsplit_once('/'),
        };
        parts.map(|(group, _)| group.to_owned())
    }
}

/// What `labels stats` is told.
#[derive(Debug, clap::Args)]
pub struct Args {
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
pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let acts = only(acts(&args.path, args.manifest.as_deref())?, args.annotator.as_deref(), &args.path)?;
    let found = statistics(&acts, &|frame| args.by.of(frame));
    let text = if args.json {
        let object: Map<String, Value> = found.iter().map(|(name, one)| (name.clone(), as_json(one))).collect();
        serde_json::to_string_pretty(&Value::Object(object)).context("writing JSON")? + "\n"
    } else if found.is_empty() {
        format!("{}: no labels yet\n", args.path.display())
    } else {
        found.iter().map(|(name, one)| as_text(name, one)).collect::<Vec<_>>().join("\n")
    };
    print(&text)?;
    Ok(ExitCode::SUCCESS)
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
    let mut text = format!("{name}\n");
    let groups = one.groups.iter().map(|(name, counts)| (name.as_str(), counts));
    let rows: Vec<(&str, &LabelCounts)> = groups.chain([("all", &one.all)]).collect();
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
        let _ = write!(text, " on {}, {first} to {last}", counted(pace.days.len(), "day"));
    }
    if let Some(median) = pace.median_s {
        let _ = write!(text, "; median {median:.1} s from one to the next (pauses over {PAUSE_S:.0} s left out)");
    }
    text + "\n"
}
