//! `labels agreement`: Cohen's kappa of two annotators, or of one and the machine.

use super::source::{acts, annotators, counted, listed, only};
use crate::cli::common::{print, print_json};
use crate::escape::one_line;
use crate::labels::{
    Agreement, MACHINE_THRESHOLD, MachineAgreement, Record, TagAgreement, Verdict, VerdictAgreement, against_machine,
    agreement as compare, judged_in_acts, verdict_agreement,
};
use anyhow::{Context as _, bail};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `labels agreement --help`.
pub(super) const HELP: &str = "\
Compared are the frames that both judged: a frame is judged where it has a tag, or a table has a row for it that \
says nothing at all (none of the tags). A note or a verdict on the count alone is no judgement of tags, nor is a label that \
was taken back.

JSON: {\"F1\": {\"kappa\", \"raw\", \"both\", \"only_a\", \"only_b\", \"neither\", ...}, ..., \"pooled\": {...}} for F1 F2 F3 F4 \
clean unsure. kappa is Cohen's, null where undefined: no frame in common, or the same one answer by both everywhere. raw \
is the share of equal decisions, null without a frame. pooled takes the decisions of all six tags as one table. Besides: \
frames, prevalence_a, prevalence_b, unreliable (why kappa should not be trusted, or null), and with --disputes the frames \
seen differently; in pooled also frames_only_in_a, frames_only_in_b.

Verdicts on the count are compared apart from tags: with \"verdicts\" in JSON {\"frames\", \"kappa\", \"raw\", \"table\"}, where both \
gave some; rows are A's, columns B's annotation-error, detection-error, both-incorrect, true-negative.

With --machine B is the program: its scores of F1 to F4 at the moment of judging, yes from --threshold on; pooled then \
counts machine_shown, the frames judged with the scores on screen, which are not blind, and unscored.

Exit codes: 0 compared; 2 bad input.

Examples:
  mhp-inspector labels agreement mhp-labels/anna.labels.jsonl mhp-labels/bo.labels.jsonl
      Two journals, as a table.
  mhp-inspector labels agreement all.csv all.csv --annotator-a anna --annotator-b bo --json
      Two annotators of one exported table, for a program to read.
  mhp-inspector labels agreement anna.csv --machine --threshold 0.7
      One annotator and the machine.";

/// What `labels agreement` is told.
#[derive(Debug, clap::Args)]
pub struct AgreementArgs {
    /// The first: a journal (*.labels.jsonl), labels exported as CSV or JSON, or a data set.
    a: PathBuf,
    /// The second, likewise.
    #[arg(required_unless_present = "machine", conflicts_with = "machine")]
    b: Option<PathBuf>,
    /// Who is meant in A, where it has labels of several.
    #[arg(long, value_name = "NAME")]
    annotator_a: Option<String>,
    /// Who is meant in B.
    #[arg(long, value_name = "NAME")]
    annotator_b: Option<String>,
    /// Compare A with the program's own scores instead of B.
    #[arg(long)]
    machine: bool,
    /// The score from which the machine says yes.
    #[arg(long, value_name = "S", default_value_t = MACHINE_THRESHOLD, requires = "machine", value_parser = threshold)]
    threshold: f64,
    /// Also every frame and tag that the two see differently.
    #[arg(long)]
    disputes: bool,
    /// One JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

/// Compares and prints.
///
/// # Errors
/// Where a file cannot be read, or has several annotators and none is named.
pub(super) fn run(args: &AgreementArgs) -> anyhow::Result<ExitCode> {
    let a = of_one(&args.a, args.annotator_a.as_deref(), "--annotator-a")?;
    if let Some(path) = &args.b {
        let b = of_one(path, args.annotator_b.as_deref(), "--annotator-b")?;
        let found = compare(judged_in_acts(&a), judged_in_acts(&b));
        let verdicts = verdict_agreement(&a, &b);
        let text = || two_as_text(args, &found, &a, &b) + &verdict_table(&verdicts);
        tell(args, || two_as_json(&found, &verdicts, args.disputes), text)?;
    } else {
        let found = against_machine(judged_in_acts(&a), args.threshold);
        tell(args, || machine_as_json(&found, args.disputes), || machine_as_text(args, &found, &a))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn tell(
    args: &AgreementArgs,
    json: impl FnOnce() -> anyhow::Result<String>,
    text: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    if args.json { print_json(&json()?) } else { print(&text()) }
}

fn threshold(text: &str) -> Result<f64, String> {
    let score = text.parse().ok().filter(|score| (0.0..=1.0).contains(score));
    score.ok_or_else(|| "expected a score from 0 to 1".into())
}

/// The acts of the one annotator that is meant.
fn of_one(path: &Path, annotator: Option<&str>, option: &str) -> anyhow::Result<Vec<Record>> {
    let acts = only(acts(path, None)?, annotator, path)?;
    let names = annotators(&acts);
    if names.len() > 1 {
        bail!("{}: labels of {}: {}; expected {option} NAME", path.display(), names.len(), listed(&names));
    }
    Ok(acts)
}

fn two_as_json(found: &Agreement, verdicts: &VerdictAgreement, disputes: bool) -> anyhow::Result<String> {
    let more = json!({
        "frames": found.frames,
        "frames_only_in_a": found.only_in_a,
        "frames_only_in_b": found.only_in_b,
    });
    let verdicts = (verdicts.frames > 0).then(|| json!(verdicts));
    as_json(found, more, verdicts, disputes)
}

fn machine_as_json(found: &MachineAgreement, disputes: bool) -> anyhow::Result<String> {
    let agreement = &found.agreement;
    let more = json!({ "frames": agreement.frames, "machine_shown": found.shown, "unscored": found.unscored });
    as_json(agreement, more, None, disputes)
}

/// An object a tag, and the pooled one, which also has the keys of `more`: whoever walks over the keys finds the same
/// numbers under each.
fn as_json(found: &Agreement, more: Value, verdicts: Option<Value>, disputes: bool) -> anyhow::Result<String> {
    let mut object = Map::new();
    for (tag, table) in &found.tags {
        let mut value = json!(table);
        value["frames"] = json!(table.total());
        if disputes {
            value["disputes"] = found
                .disputes
                .iter()
                .filter(|dispute| dispute.tag == *tag)
                .map(|dispute| json!({ "frame": dispute.frame, "a": dispute.a, "b": dispute.b }))
                .collect();
        }
        object.insert(tag.code().into(), value);
    }
    let mut pooled = json!(found.pooled);
    if let (Value::Object(pooled), Value::Object(more)) = (&mut pooled, more) {
        pooled.extend(more);
    }
    object.insert("pooled".into(), pooled);
    object.extend(verdicts.map(|verdicts| ("verdicts".to_owned(), verdicts)));
    Ok(serde_json::to_string_pretty(&Value::Object(object)).context("writing JSON")? + "\n")
}

fn two_as_text(args: &AgreementArgs, found: &Agreement, a: &[Record], b: &[Record]) -> String {
    let b_path = args.b.as_deref().unwrap_or(Path::new(""));
    let mut text = side("A", a, &args.a) + &side("B", b, b_path);
    let (frames, a, b) = (counted(found.frames, "frame"), found.only_in_a, found.only_in_b);
    let _ = writeln!(text, "{frames} judged by both; {a} by A alone, {b} by B alone");
    text + &table(found, args.disputes)
}

fn machine_as_text(args: &AgreementArgs, found: &MachineAgreement, a: &[Record]) -> String {
    let mut text = side("A", a, &args.a);
    let _ = writeln!(text, "B  the machine: a score of {} or more", args.threshold);
    let frames = counted(found.agreement.frames, "frame");
    let (shown, unscored) = (found.shown, found.unscored);
    let _ =
        writeln!(text, "{frames} judged with scores, of them {shown} with the scores on screen; {unscored} without");
    text + &table(&found.agreement, args.disputes)
}

fn side(name: &str, acts: &[Record], path: &Path) -> String {
    one_line(&format!("{name}  {}  {}", listed(&annotators(acts)), path.display())).into_owned() + "\n"
}

/// A line a tag, remarks on those that are not to be trusted, and perhaps the disputes.
fn table(found: &Agreement, disputes: bool) -> String {
    let head = ["", "kappa", "raw", "both", "only A", "only B", "neither", "in A", "in B"].map(String::from);
    let rows = found.tags.iter().map(|(tag, table)| (tag.code(), table)).chain([("pooled", &found.pooled)]);
    let rows: Vec<(&str, &TagAgreement)> = rows.collect();
    let mut text = String::from("\n");
    for cells in std::iter::once(head).chain(rows.iter().map(|(name, table)| row(name, table))) {
        let [name, rest @ ..] = cells;
        let line = rest.iter().fold(format!("{name:<8}"), |line, cell| format!("{line} {cell:>8}"));
        let _ = writeln!(text, "{}", line.trim_end());
    }
    for (name, table) in rows {
        if let Some(why) = &table.unreliable {
            let _ = writeln!(text, "* {name}: {why}");
        }
    }
    for dispute in found.disputes.iter().filter(|_| disputes) {
        let who = if dispute.a { "A" } else { "B" };
        let _ = writeln!(text, "{}  {} only by {who}", one_line(&dispute.frame), dispute.tag);
    }
    text
}

/// The verdicts on the count, where both gave some: κ, and a line a verdict of A with how often B gave which.
fn verdict_table(found: &VerdictAgreement) -> String {
    if found.frames == 0 {
        return String::new();
    }
    let kappa = found.kappa.map_or_else(|| "-".to_owned(), |kappa| format!("{kappa:.3}"));
    let raw = found.raw.map_or_else(|| "-".to_owned(), |raw| format!("{:.1} %", 100.0 * raw));
    let frames = counted(found.frames, "frame");
    let mut text = format!("\nverdicts on the count: {frames} of both, kappa {kappa}, raw {raw}\n{:<18}", "A \\ B");
    for verdict in Verdict::ALL {
        let _ = write!(text, " {:>16}", verdict.code());
    }
    for (verdict, row) in Verdict::ALL.iter().zip(&found.table) {
        let _ = write!(text, "\n{:<18}", verdict.code());
        for count in row {
            let _ = write!(text, " {count:>16}");
        }
    }
    text + "\n"
}

fn row(name: &str, table: &TagAgreement) -> [String; 9] {
    let percent = |share: Option<f64>| share.map_or("-".into(), |share| format!("{:.1} %", 100.0 * share));
    let mark = if table.unreliable.is_some() { "*" } else { "" };
    [
        name.to_owned(),
        table.kappa.map_or("-".into(), |kappa| format!("{kappa:.3}")) + mark,
        percent(table.raw),
        table.both.to_string(),
        table.only_a.to_string(),
        table.only_b.to_string(),
        table.neither.to_string(),
        percent(table.prevalence_a),
        percent(table.prevalence_b),
    ]
}
