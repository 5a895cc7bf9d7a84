//! `score`: the objective at given parameters, with maps and gradients; SPEC section 7.

use super::common::{PrecisionArg, config, inputs, open, print_json};
use crate::body::{Group, Pppr};
use crate::dataset::npz::{ArrayView, write};
use crate::dataset::read_pppr;
use crate::mhp::{CellValue, Evaluation, Objective, Problem, TERMS, simulate, simulate_signal};
use crate::radar::View;
use crate::start::problem_of;
use anyhow::Context as _;
use clap::Args;
use serde_json::{Map, Value};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// Shown under the options of `score --help`.
pub(super) const HELP: &str = "\
Exit codes: 0 the answer is written; 2 bad input.

Examples:
  mhp-inspector score --dataset case --frame 0 --params case/params.npz --out answer.npz
      Maps, losses and gradients at these parameters, with the default configuration.
  mhp-inspector score --dataset case --frame 0 --params p.npz --config fit.toml --precision f32 --out a.npz
      The same under other settings, in single precision.
  mhp-inspector score --dataset case --frame 0 --params p.npz --signal --out a.npz
      Also the maps that the signals themselves give, which the closed form approximates.";

/// What `score --help` says it does.
pub(super) fn about() -> String {
    let keys: Vec<&str> = TERMS.iter().map(|term| term.key).collect();
    format!(
        "Evaluate the objective at given parameters: simulated maps, losses and gradients.\n\nWrites an npz with \
         `sim_<array>`, `iou_<array>`, `loss`, its terms `{}`, and the gradients `grad_<group>` (of the total) and \
         `grad_em_<group>` (of L_EM alone), all float64. Prints the scalars as one JSON object; an IoU of two empty masks \
         is null there and NaN in the npz. The EM region is that of the given positions.",
        keys.join(" ")
    )
}

/// What `score` is told.
#[derive(Debug, Args)]
pub struct ScoreArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    #[arg(long, value_name = "DIR")]
    dataset: PathBuf,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I")]
    frame: usize,
    /// PPPR npz: position, log_scale, rotation, velocity, beta, omega.
    #[arg(long, value_name = "P.npz")]
    params: PathBuf,
    /// Fit configuration; without it the defaults.
    #[arg(long, value_name = "FIT.toml")]
    config: Option<PathBuf>,
    /// Scalar of the per-cell kernel.
    #[arg(long, value_enum, default_value = "f64")]
    precision: PrecisionArg,
    /// Where the answer is written.
    #[arg(long, value_name = "OUT.npz")]
    out: PathBuf,
    /// A manifest (as `dataset.toml`) that says what the data set is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    /// Also write `signal_<array>`: the same joints as signals over samples, chirps and antennas through windowed FFTs, the exact
    /// version of the closed form. Every view needs an FFT configuration (`[view.fft]` in a manifest).
    #[arg(long)]
    signal: bool,
}

/// Runs `score`.
///
/// # Errors
/// Where the data set, frame, parameters or configuration cannot be read or do not fit each other, or the answer cannot
/// be written.
pub(super) fn run(args: &ScoreArgs) -> anyhow::Result<ExitCode> {
    let config = config(args.config.as_deref())?;
    let dataset = open(&args.dataset, args.manifest.as_deref())?;
    let named = [Some(args.params.as_path()), args.config.as_deref(), args.manifest.as_deref()];
    inputs(&dataset, &args.dataset, &named).check_file(&args.out)?;
    let frame = dataset.load(args.frame)?;
    let params = read_pppr(&args.params, None)?;
    // With the frames around, which the temporal term is about.
    let problem = problem_of(&dataset, &frame).with_context(|| dataset.frame_path(args.frame).display().to_string())?;
    problem.check(&params).with_context(|| args.params.display().to_string())?;

    let (problem, precision) = (Arc::new(problem), args.precision.into());
    let mut objective = Objective::new(Arc::clone(&problem), config, precision, &params)?;
    for warning in objective.warnings() {
        tracing::warn!("{warning}");
    }
    let evaluation = objective.evaluate(&params);
    let mut maps = vec![("sim", simulate(&problem, &config, precision, &params))];
    if args.signal {
        let ffts = dataset.info().ffts();
        maps.push(("signal", simulate_signal(&problem, &ffts, &config, &params, CellValue::Centre)?));
    }
    let scalars = scalars(&problem.views, &evaluation);
    write_answer(args, &problem, &evaluation, &maps, &scalars)?;
    let json: Map<String, Value> = scalars.into_iter().map(|(key, x)| (key, Value::from(x))).collect();
    print_json(&format!("{}\n", Value::Object(json)))?;
    Ok(ExitCode::SUCCESS)
}

/// Key and value; NaN where undefined.
fn scalars(views: &[View], evaluation: &Evaluation) -> Vec<(String, f64)> {
    let terms = evaluation.terms.iter().map(|(term, value)| (term.key, value));
    let losses = [("loss", evaluation.loss)].into_iter().chain(terms);
    let ious = views.iter().zip(&evaluation.iou);
    let ious = ious.map(|(view, iou)| (format!("iou_{}", view.array), iou.unwrap_or(f64::NAN)));
    losses.map(|(key, x)| (key.to_owned(), x)).chain(ious).collect()
}

fn write_answer(
    args: &ScoreArgs,
    problem: &Problem,
    evaluation: &Evaluation,
    maps: &[(&str, Vec<Vec<f64>>)],
    scalars: &[(String, f64)],
) -> anyhow::Result<()> {
    let mut arrays: Vec<(String, ArrayView<'_>)> = Vec::new();
    for (prefix, maps) in maps {
        for (view, map) in problem.views.iter().zip(maps) {
            arrays.push((format!("{prefix}_{}", view.array), ArrayView::f64(&view.shape(), map)));
        }
    }
    for (key, value) in scalars {
        arrays.push((key.clone(), ArrayView::f64(&[], std::slice::from_ref(value))));
    }
    let gradients: [(&str, &Pppr); 2] = [("grad", &evaluation.gradient), ("grad_em", evaluation.em_gradient())];
    for (prefix, gradient) in gradients {
        for group in Group::ALL {
            let shape = gradient.shape().array_shape(group);
            arrays.push((format!("{prefix}_{}", group.key()), ArrayView::f64(&shape, gradient.group(group))));
        }
    }
    let named: Vec<(&str, ArrayView<'_>)> = arrays.iter().map(|(key, array)| (key.as_str(), array.clone())).collect();
    write(&args.out, &named)?;
    Ok(())
}

#[cfg(all(test, feature = "dummies"))]
mod tests {
    use super::*;
    use crate::body::PpprShape;
    use crate::mhp::Terms;

    #[test]
    fn the_dummy_term_is_answered() {
        let mut evaluation = Evaluation::zeros(PpprShape { persons: 1, joints: 0, doppler_features: 1 });
        evaluation.terms = Terms::from_fn(|term| if term.key == "dummy" { 0.7 } else { 0.1 });
        let answer = scalars(&[], &evaluation);
        assert!(answer.contains(&("dummy".to_owned(), 0.7)), "{answer:?}");
        assert!(about().contains(" dummy`"), "{}", about());
    }
}
