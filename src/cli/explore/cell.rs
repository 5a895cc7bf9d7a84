//! `explore cell`: who lit a cell, and what each joint is worth.

use super::frame::StateArgs;
use super::target::halted;
use crate::cli::common::{print, print_json};
use crate::explore::{IdleCores, leave_one_out};
use crate::mhp::JointReturns;
use crate::radar::{View, unravel};
use crate::task::Progress;
use anyhow::{Context as _, bail, ensure};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::process::ExitCode;

/// What `explore cell` is told.
#[derive(Debug, Args)]
pub struct CellArgs {
    #[command(flatten)]
    state: StateArgs,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    frame: usize,
    /// The map, by its array; without it the first.
    #[arg(long, value_name = "ARRAY")]
    view: Option<String>,
    /// The cell by its bins, one an axis, from 0. Default: the largest cell of H_sim.
    #[arg(long, value_name = "I,J[,K]", value_delimiter = ',', conflicts_with = "at")]
    cell: Option<Vec<usize>>,
    /// The cell by its coordinates, one an axis: m, degrees, m/s.
    #[arg(long, value_name = "X,Y[,Z]", value_delimiter = ',', allow_hyphen_values = true)]
    at: Option<Vec<f64>>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &CellArgs) -> anyhow::Result<ExitCode> {
    let (dataset, config) = args.state.open()?;
    ensure!(args.frame < dataset.len(), "--frame {}: expected less than {}", args.frame, dataset.len());
    let views = &dataset.info().views;
    let index = match &args.view {
        None => 0,
        Some(name) => views.iter().position(|view| view.array == *name).with_context(|| {
            let names: Vec<&str> = views.iter().map(|view| view.array.as_str()).collect();
            format!("--view {name}: no such map; expected one of {}", names.join(", "))
        })?,
    };
    let Some(view) = views.get(index) else { bail!("there is no map") };
    let state = args.state.state(&dataset, args.frame, &config)?;
    let returns = JointReturns::new(&state.of.problem, &state.of.config, &state.of.params);
    let (h_sim, _) = state.maps()?;
    let cell = chosen(args, view, &h_sim[index])?;
    let bins = unravel(cell, &view.shape());
    let at = returns.at(index, cell);
    let worth = leave_one_out(&state.of, (&IdleCores::all(), &Progress::new())).map_err(halted)?;
    let place: Vec<String> = view
        .axes
        .iter()
        .zip(&bins)
        .map(|(axis, &bin)| format!("{} {:.3} {}", axis.shown_name(), axis.shown_at(bin as f64), axis.shown_unit()))
        .collect();
    if args.json {
        let lit: Vec<_> = at
            .iter()
            .map(|of| {
                json!({ "joint": state.name(of.joint), "share": of.share, "amplitude_share": of.amplitude_share,
                        "amplitude": of.amplitude, "phase_deg": of.phase_rad.to_degrees() })
            })
            .collect();
        let worth_of: Vec<_> = worth
            .joints
            .iter()
            .map(|of| json!({ "joint": state.name(of.joint), "iou": of.iou, "drop": of.drop }))
            .collect();
        let object = json!({
            "frame": state.frame.name, "view": view.array, "cell": bins.to_vec(), "place": place,
            "h_ori": state.of.problem.map(index).get(cell), "h_sim": h_sim[index].get(cell), "coherent": returns.is_coherent(),
            "lit_by": lit, "iou": worth.iou, "without": worth_of,
        });
        print_json(&(serde_json::to_string_pretty(&object)? + "\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut text = format!("{} · {} {:?}: {}\n", state.frame.name, view.array, bins.to_vec(), place.join(", "));
    let _ = writeln!(text, "{:<22}{:>9}{:>11}{:>10}", "joint", "share %", "amplitude %", "phase °");
    for of in at.iter().filter(|of| of.amplitude_share > 5e-4) {
        let phase = if returns.is_coherent() { format!("{:.0}", of.phase_rad.to_degrees()) } else { "—".into() };
        let shares = [of.share, of.amplitude_share].map(|x| 100.0 * x);
        let _ = writeln!(text, "{:<22}{:>9.1}{:>11.1}{:>10}", state.name(of.joint), shares[0], shares[1], phase);
    }
    let _ = writeln!(text, "\nIoU {:.4}; without a joint:", worth.iou.unwrap_or(f64::NAN));
    for of in &worth.joints {
        let _ = writeln!(text, "{:<22}{:>9.4}{:>+11.4}", state.name(of.joint), of.iou.unwrap_or(f64::NAN), -of.drop);
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// The cell that is meant, flat.
fn chosen(args: &CellArgs, view: &View, h_sim: &[f64]) -> anyhow::Result<usize> {
    let shape = view.shape();
    let flat = |bins: &[usize]| bins.iter().zip(&shape).fold(0, |flat, (bin, n)| flat * n + bin);
    if let Some(bins) = &args.cell {
        let fits = bins.len() == shape.len() && bins.iter().zip(&shape).all(|(bin, n)| bin < n);
        ensure!(fits, "--cell {bins:?}: expected a bin of each axis, less than {shape:?}");
        return Ok(flat(bins));
    }
    if let Some(at) = &args.at {
        ensure!(at.len() == shape.len(), "--at {at:?}: expected {} coordinates", shape.len());
        let mut bins = Vec::with_capacity(shape.len());
        for (k, (axis, &value)) in view.axes.iter().zip(at).enumerate() {
            // The cell whose shown coordinate is nearest.
            let off = |bin: &usize| (axis.shown_at(*bin as f64) - value).abs();
            let nearest = (0..axis.bins).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0);
            let step = (axis.shown_at(nearest as f64) - axis.shown_at(nearest as f64 + 1.0)).abs();
            ensure!(
                off(&nearest) <= step,
                "--at: {value} {} lies outside axis {k} of {}",
                axis.shown_unit(),
                view.array
            );
            bins.push(nearest);
        }
        return Ok(flat(&bins));
    }
    let largest = h_sim.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    Ok(largest.map_or(0, |(cell, _)| cell))
}
