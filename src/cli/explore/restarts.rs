//! `explore restarts`: the basins of a frame as a table or JSON.

use super::target::{TargetArgs, halted};
use crate::cli::common::{print, print_json};
use crate::explore::{RestartCloud, RestartRequest, RestartSettings, restart_cloud};
use crate::mhp::TermId;
use crate::task::Progress;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

/// Shown under the options of `explore restarts --help`.
pub(super) const HELP: &str = "\
Start 0 is the fit's own; the others are spread around it. Ends are one basin where their joints are less than --apart apart on the
mean (average linkage). The best basin has the lowest L; `what decides` is the number of the starts that tells a basin best from
the others, with the probability (AUC) that it orders a start in it and one outside rightly.

JSON: {best_share, verdict, basins: [{share, loss, iou, majpe_mm, heading_deg, spread_mm, members, telling}], restarts: [{loss,
iou, majpe_mm, offset}]}.

Examples:
  mhp-inspector explore restarts samples/walk --frame 3 --preset baseline
      Is this frame ambiguous, or was the start unlucky?
  mhp-inspector explore restarts samples/walk --frame 3 --starts 500 --yaw 30 --json
      Only starts that look about the same way.";

/// Basins that are listed.
const MOST: usize = 12;

/// What `explore restarts` is told.
#[derive(Debug, Args)]
pub struct RestartArgs {
    #[command(flatten)]
    target: TargetArgs,
    #[command(flatten)]
    spread: SpreadArgs,
}

/// How starts are spread.
#[derive(Debug, Args)]
pub(in crate::cli) struct SpreadArgs {
    /// How many starts.
    #[arg(long, value_name = "N", default_value_t = RestartSettings::default().starts, value_parser = starts)]
    starts: usize,
    /// Standard deviation of their place on the floor, m; in height a quarter of it.
    #[arg(long, value_name = "M", default_value_t = RestartSettings::default().position_m, value_parser = within::<1>)]
    position: f64,
    /// They are turned by as much to either side at most, degrees.
    #[arg(long, value_name = "DEG", default_value_t = RestartSettings::default().yaw_deg, value_parser = within::<2>)]
    yaw: f64,
    /// Standard deviation of the turn of each limb, degrees.
    #[arg(long, value_name = "DEG", default_value_t = RestartSettings::default().posture_deg, value_parser = within::<3>)]
    posture: f64,
    /// Ends farther apart are of two basins, mm.
    #[arg(long, value_name = "MM", default_value_t = RestartSettings::default().apart_mm, value_parser = within::<4>)]
    apart: f64,
    /// Seed of the spread.
    #[arg(long, value_name = "S", default_value_t = RestartSettings::default().seed)]
    seed: u64,
}

/// Reads a number of starts.
///
/// # Errors
/// In words.
pub(in crate::cli) fn starts(text: &str) -> Result<usize, String> {
    let (lo, hi) = RestartSettings::RANGES[0];
    let whole = text.parse::<usize>().ok().filter(|n| (lo as usize..=hi as usize).contains(n));
    whole.ok_or_else(|| format!("expected a whole number in {lo} ..= {hi}"))
}

fn within<const K: usize>(text: &str) -> Result<f64, String> {
    let (lo, hi) = RestartSettings::RANGES[K];
    text.parse()
        .ok()
        .filter(|x: &f64| (lo..=hi).contains(x))
        .ok_or_else(|| format!("expected a number in {lo} ..= {hi}"))
}

impl SpreadArgs {
    /// As the exploration takes it.
    pub(in crate::cli) fn settings(&self) -> RestartSettings {
        let &Self { starts, position, yaw, posture, apart, seed } = self;
        RestartSettings { starts, position_m: position, yaw_deg: yaw, posture_deg: posture, apart_mm: apart, seed }
    }
}

/// Runs `explore restarts`.
///
/// # Errors
/// Where an argument or the data are bad, or the frame cannot be fitted.
pub(super) fn run(args: &RestartArgs) -> anyhow::Result<ExitCode> {
    let target = args.target.open(false)?;
    let request = RestartRequest { state: target.state(true), settings: args.spread.settings(), truth: target.truth() };
    let cloud = restart_cloud(&request, &target.cores, &Progress::new()).map_err(halted)?;
    if args.target.json {
        print_json(&(serde_json::to_string_pretty(&json_of(&cloud))? + "\n"))?;
    } else {
        let head = format!("frame {}  {}\n", target.frame.index, target.frame.name);
        print(&(head + &text(&cloud)))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn json_of(cloud: &RestartCloud) -> Value {
    let basins = cloud.basins.iter().map(|basin| {
        json!({
            "share": basin.share, "loss": basin.loss, "mean_loss": basin.mean_loss, "iou": basin.iou,
            "majpe_mm": basin.majpe_mm, "heading_deg": basin.heading_deg, "spread_mm": basin.spread_mm,
            "mean": basin.mean, "members": basin.members, "telling": basin.telling,
        })
    });
    let restarts = cloud.restarts.iter().map(|restart| {
        restart.as_ref().map_or(Value::Null, |restart| {
            json!({"loss": restart.loss, "iou": restart.iou, "majpe_mm": restart.majpe_mm, "offset": restart.offset})
        })
    });
    json!({
        "best_share": cloud.best_share(), "verdict": cloud.verdict(), "diverged": cloud.diverged(),
        "basins": basins.collect::<Vec<_>>(), "restarts": restarts.collect::<Vec<_>>(),
    })
}

fn text(cloud: &RestartCloud) -> String {
    let mut text = cloud.verdict() + "\n\n";
    let _ = writeln!(text, "basin  share       L    IoU  MAJPE  looks  spread  what decides");
    let number = |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |x| format!("{x:.digits$}"));
    for (k, basin) in cloud.basins.iter().enumerate().take(MOST) {
        let own = if basin.members.contains(&0) { "*" } else { " " };
        let told = basin.telling.map_or_else(String::new, |told| {
            let of = |value| told.feature.text(value);
            format!("{} {} against {} (AUC {:.2})", told.feature.title(), of(told.inside), of(told.outside), told.auc)
        });
        let looks = basin.heading_deg.map_or_else(|| "-".to_owned(), |deg| format!("{deg:+.0}°"));
        let _ = writeln!(
            text,
            "{own}{:>4} {:>5.0} % {:>7.4} {:>6} {:>6} {looks:>6} {:>4.0} mm  {told}",
            k + 1,
            100.0 * basin.share,
            basin.loss,
            number(basin.iou, 3),
            number(basin.majpe_mm, 0),
            basin.spread_mm,
        );
        if let Some(best) = cloud.basins.first().filter(|_| k > 0) {
            let more = |term: TermId| term.weight.of(&cloud.config) * (basin.terms[term] - best.terms[term]);
            let term = TermId::all().max_by(|a, b| more(*a).abs().total_cmp(&more(*b).abs()));
            if let Some(term) = term.filter(|term| more(*term) != 0.0) {
                let _ = writeln!(text, "{:>56}on the mean {} {:+.4} from the best basin's", "", term.label, more(term));
            }
        }
    }
    if let Some(rest) = cloud.basins.get(MOST..).filter(|rest| !rest.is_empty()) {
        let share: f64 = rest.iter().map(|basin| basin.share).sum();
        let _ = writeln!(text, "and {} basins more with {:.0} % of the starts", rest.len(), 100.0 * share);
    }
    let _ = writeln!(text, "\n* where the fit's own start ends");
    text
}
