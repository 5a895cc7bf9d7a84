//! `labels verification`: the count-matched protocol and its table (paper A.3, table 18).

use super::source::acts_of;
use crate::cli::common::{open, print, print_json, progress_bar};
use crate::escape::one_line;
use crate::labels::Verdict;
use crate::study::run::PaperVerification;
use crate::study::verification::{Verification, verify};
use anyhow::Context as _;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `labels verification --help`.
pub(super) const HELP: &str = "\
A frame is kept where the counter's number is the annotated one and no reviewer says that annotation, count or both are wrong; a \
frame whose reviewers are not of one mind is not kept. Retention is the share that is kept. Of mismatched frames the verdicts \
are told as the paper's table 18 does. Annotations in metres that are no bodies are listed: a limb under 2 cm, or, where one person \
is in a sequence, a bone more than 5 cm from its median. `study … --verified` leaves reviewed frames out in the same way; in the \
window the filter mismatch:yes shows what there is to review.

Examples:
  mhp-inspector labels verification data/mmvr
      Retention, verdicts, implausible annotations.
  mhp-inspector labels verification data/mmvr data/xrf55 --json
      Two data sets, for a program.";

/// What `labels verification` is told.
#[derive(Debug, clap::Args)]
pub struct VerificationArgs {
    /// Data sets with annotated numbers of people.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Counts, compares, prints.
///
/// # Errors
/// Where a data set or its labels cannot be read, or its views tell no place.
pub(super) fn run(args: &VerificationArgs) -> anyhow::Result<ExitCode> {
    let mut all = Vec::with_capacity(args.data.len());
    for path in &args.data {
        let dataset = open(path, None)?;
        let acts = acts_of(&dataset)?;
        let bar = progress_bar(dataset.len());
        let found = verify(&dataset, &acts, || bar.inc(1)).with_context(|| path.display().to_string())?;
        bar.finish_and_clear();
        all.push(found);
    }
    if args.json {
        let retention: Vec<_> = all.iter().map(Verification::retention).collect();
        let object = serde_json::json!({ "data": all, "retention": retention });
        print_json(&(serde_json::to_string_pretty(&object)? + "\n"))?;
    } else {
        print(&text(&all))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn text(all: &[Verification]) -> String {
    let percent = |share: Option<f64>| share.map_or("–".to_owned(), |share| format!("{:.1} %", 100.0 * share));
    let name = |of: &Verification| one_line(&of.data).into_owned();
    let width = all.iter().map(|of| name(of).chars().count()).max().unwrap_or(0).max(20);
    let mut text =
        format!("{:<width$}  {:>8}  {:>10}  {:>15}  {:>9}\n", "", "frames", "retention", "several people", "retention");
    for of in all {
        let [share, several] = of.retention().map(percent);
        let _ =
            write!(text, "{:<width$}  {:>8}  {share:>10}  {:>15}  {several:>9}", name(of), of.frames[0], of.frames[1]);
        if let Some(paper) = PaperVerification::beside(of.layout) {
            let _ = write!(text, "  (paper {:.1} %)", paper.retention_pct);
        }
        text.push('\n');
    }
    let _ = writeln!(
        text,
        "\n{:<width$}  {}",
        "mismatched, reviewed",
        all.iter().map(|of| format!("{:>16}", name(of))).collect::<Vec<_>>().join("  ")
    );
    let share = |count: usize, of: usize| match of {
        0 => format!("{count}/0"),
        of => format!("{count}/{of} ({:.0} %)", 100.0 * count as f64 / of as f64),
    };
    for (k, verdict) in Verdict::ALL.iter().enumerate() {
        let mut cells: Vec<String> = all.iter().map(|of| share(of.verdicts[k], of.reviewed())).collect();
        if all.len() > 1 {
            let sum = |get: fn(&Verification, usize) -> usize| all.iter().map(|of| get(of, k)).sum();
            cells.push(format!("combined {}", share(sum(|of, k| of.verdicts[k]), sum(|of, _| of.reviewed()))));
        }
        let cells: Vec<String> = cells.iter().map(|cell| format!("{cell:>16}")).collect();
        let papers = all.iter().filter_map(|of| PaperVerification::beside(of.layout));
        let papers: Vec<String> = papers.map(|paper| format!("{} {} %", paper.name, paper.verdicts[k])).collect();
        let papers = if papers.is_empty() { String::new() } else { format!("  (paper {})", papers.join(", ")) };
        let _ = writeln!(text, "{:<width$}  {}{papers}", verdict.code().replace('-', " "), cells.join("  "));
    }
    for of in all {
        let open = of.mismatched - of.reviewed();
        let _ = writeln!(
            text,
            "\n{}: {} mismatched, {open} of them without a verdict of one mind; {} matched frames taken out by a verdict; {} disputed",
            name(of),
            of.mismatched,
            of.overruled,
            of.disputed
        );
        let _ = writeln!(
            text,
            "{} annotations are no bodies{}",
            of.implausible.len(),
            if of.implausible.is_empty() { "" } else { ":" }
        );
        for odd in of.implausible.iter().take(SHOWN) {
            let [from, to] = &odd.bone;
            let _ = writeln!(
                text,
                "  {} person {}: {from} to {to} {:.0} cm, in this sequence {:.0} cm",
                one_line(&odd.frame),
                odd.person,
                100.0 * odd.length_m,
                100.0 * odd.median_m
            );
        }
        if of.implausible.len() > SHOWN {
            let _ = writeln!(text, "  … and {} more (--json lists all)", of.implausible.len() - SHOWN);
        }
    }
    text
}

/// Implausible annotations that are listed.
const SHOWN: usize = 10;
