//! `explore closure`: a pose before an independent radar, started and fitted as a new frame.

use super::frame::StateArgs;
use super::target::halted;
use crate::body::Group;
use crate::cli::common::{print, print_json};
use crate::dataset::npz::{ArrayView, write};
use crate::explore::{ClosureRequest, IdleCores, closure_test};
use crate::task::Progress;
use anyhow::{Context as _, bail, ensure};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// What `explore closure` is told.
#[derive(Debug, Args)]
pub struct ClosureArgs {
    #[command(flatten)]
    state: StateArgs,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    frame: usize,
    /// The pose is that of the data set's own joints, instead of the fit's.
    #[arg(long)]
    truth: bool,
    /// Noise of the receiver, in units of the echo of a square metre at 1 m: 0.002 is little, 0.05 much.
    #[arg(long, value_name = "X", default_value_t = 0.02)]
    noise: f64,
    /// Of speckle and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the synthetic maps, `syn_<array>`, as npz.
    #[arg(long, value_name = "FILE.npz")]
    out: Option<PathBuf>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &ClosureArgs) -> anyhow::Result<ExitCode> {
    let (dataset, config) = args.state.open()?;
    ensure!(args.frame < dataset.len(), "--frame {}: expected less than {}", args.frame, dataset.len());
    ensure!(args.noise.is_finite() && args.noise >= 0.0, "--noise {}: expected 0 or more", args.noise);
    if let Some(file) = &args.out {
        crate::cli::common::inputs(&dataset, &args.state.path, &[]).check_file(file)?;
    }
    let state = args.state.state(&dataset, args.frame, &config)?;
    let mut pose = state.of.params.clone();
    if args.truth {
        let truth = state.frame.truth.as_ref().context("--truth: the frame has no joints in metres")?;
        if truth.joints.len() != pose.shape().total_joints() {
            bail!(
                "--truth: {} joints are annotated and {} fitted; --people says how many persons",
                truth.joints.len(),
                pose.shape().total_joints()
            );
        }
        for (joint, at) in truth.joints.iter().enumerate() {
            pose.set_vec3(Group::Position, joint, *at);
            if let Some(velocity) = truth.velocities.as_ref().and_then(|of| of.get(joint)) {
                pose.set_vec3(Group::Velocity, joint, *velocity);
            }
        }
    }
    let request = ClosureRequest {
        info: Arc::new(dataset.info().clone()),
        pose,
        config,
        precision: args.state.precision(),
        noise: args.noise,
        seed: args.seed,
    };
    let test = closure_test(&request, (&IdleCores::all(), &Progress::new())).map_err(halted)?;
    if let Some(file) = &args.out {
        let named: Vec<(String, Vec<usize>)> =
            state.of.problem.views.iter().map(|view| (format!("syn_{}", view.array), view.shape())).collect();
        let arrays: Vec<(&str, ArrayView<'_>)> = named
            .iter()
            .zip(&test.maps)
            .map(|((name, shape), map)| (name.as_str(), ArrayView::f64(shape, map)))
            .collect();
        write(file, &arrays)?;
    }
    let [start, fit] = test.errors;
    if args.json {
        let joints: Vec<_> =
            test.joints_mm.iter().enumerate().map(|(k, mm)| json!({ "joint": state.name(k), "mm": mm })).collect();
        let object = json!({
            "frame": state.frame.name, "majpe_mm": fit.majpe_mm, "pa_majpe_mm": fit.pa_majpe_mm,
            "start_majpe_mm": start.majpe_mm, "start_pa_majpe_mm": start.pa_majpe_mm, "middle_mm": test.middle_mm,
            "iou": test.iou, "iterations": test.iterations, "joints": joints, "radar_assumed": test.assumed,
        });
        print_json(&(serde_json::to_string_pretty(&object)? + "\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut text =
        format!("{}: this pose through an independent FMCW synthesis, fitted as a new frame\n", state.frame.name);
    let _ = writeln!(
        text,
        "start  MAJPE {:>6.0} mm, PA {:>4.0} mm, middle {:>5.0} mm off",
        start.majpe_mm, start.pa_majpe_mm, test.middle_mm[0]
    );
    let _ = writeln!(
        text,
        "fit    MAJPE {:>6.0} mm, PA {:>4.0} mm, middle {:>5.0} mm off, IoU {:.3}",
        fit.majpe_mm,
        fit.pa_majpe_mm,
        test.middle_mm[1],
        test.iou.unwrap_or(f64::NAN)
    );
    for (k, mm) in test.joints_mm.iter().enumerate() {
        let _ = writeln!(text, "  {:<22}{mm:>6.0} mm", state.name(k));
    }
    if !test.assumed.is_empty() {
        let _ = writeln!(
            text,
            "The FFTs of {} are not known: a radar with these widths was put in their place.",
            test.assumed.join(", ")
        );
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}
