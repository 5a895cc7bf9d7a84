//! `explore tau`: the agreement of the masks at every τ.

use super::frame::StateArgs;
use super::target::halted;
use crate::cli::common::{print, print_json};
use crate::explore::{IdleCores, tau_clouds, tau_ribbon};
use crate::output::{Inputs, replace_file};
use crate::task::Progress;
use anyhow::{Context as _, ensure};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// What `explore tau` is told.
#[derive(Debug, Args)]
pub struct TauArgs {
    #[command(flatten)]
    state: StateArgs,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    frame: usize,
    /// Write tau_pct, iou and iou_ARRAY of every view as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &TauArgs) -> anyhow::Result<ExitCode> {
    let (dataset, config) = args.state.open()?;
    ensure!(args.frame < dataset.len(), "--frame {}: expected less than {}", args.frame, dataset.len());
    if let Some(file) = &args.csv {
        let inputs: Inputs<'_> = crate::cli::common::inputs(&dataset, &args.state.path, &[]);
        inputs.check_file(file)?;
    }
    let state = args.state.state(&dataset, args.frame, &config)?;
    let (h_sim, masks) = state.maps()?;
    let maps: Vec<(&[f64], &[f64])> =
        h_sim.iter().enumerate().map(|(k, sim)| (state.of.problem.map(k), sim.as_slice())).collect();
    let ribbon = tau_ribbon(&maps, &masks);
    let with = (&IdleCores::all(), &Progress::new());
    let clouds = tau_clouds(&state.of, (&h_sim, &masks), with).map_err(halted)?;
    let (best, telling) = (ribbon.best(), ribbon.most_telling());
    if let Some(file) = &args.csv {
        let mut csv = String::from("tau_pct,iou");
        for view in &state.of.problem.views {
            let _ = write!(csv, ",iou_{}", view.array);
        }
        csv.push('\n');
        let cell = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
        for (k, tau) in ribbon.taus.iter().enumerate() {
            let _ = write!(csv, "{tau},{}", cell(ribbon.iou[k]));
            for view in &ribbon.views {
                let _ = write!(csv, ",{}", cell(view[k]));
            }
            csv.push('\n');
        }
        replace_file(file, |out| out.write_all(csv.as_bytes())).with_context(|| file.display().to_string())?;
    }
    let now = state.of.config.tau_pct;
    if args.json {
        let object = json!({
            "frame": state.frame.name, "tau_pct": now, "iou": ribbon.at(now),
            "best": best, "most_telling": telling, "taus": ribbon.taus, "iou_at": ribbon.iou,
            "points": { "cfar": clouds.cfar.len(), "threshold": clouds.threshold.len(), "pppr_pc": clouds.pppr.len() },
        });
        print_json(&(serde_json::to_string_pretty(&object)? + "\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let shown = |x: Option<(f64, f64)>| x.map_or_else(|| "—".into(), |(tau, iou)| format!("{tau} % (IoU {iou:.3})"));
    let mut text = format!("{}: IoU {:.3} at τ {now} %\n", state.frame.name, ribbon.at(now).unwrap_or(f64::NAN));
    let _ = writeln!(text, "largest IoU          τ {}", shown(best));
    let _ = writeln!(text, "farthest from chance τ {}", shown(telling));
    let _ = writeln!(
        text,
        "points kept          CFAR {}, threshold {}, PPPR-PC {}",
        clouds.cfar.len(),
        clouds.threshold.len(),
        clouds.pppr.len()
    );
    for tau in [0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0] {
        let iou = ribbon.at(tau);
        let bar = "█".repeat((40.0 * iou.unwrap_or(0.0)).round() as usize);
        let _ = writeln!(text, "{tau:>5} %  {:>6.3}  {bar}", iou.unwrap_or(f64::NAN));
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}
