//! `explore known`: what the echo fixes of a pose, and what only the prior does.

use super::frame::StateArgs;
use super::target::halted;
use crate::cli::common::{complain, print, print_json, progress_bar};
use crate::cli::frames::{FrameRange, chosen};
use crate::cli::{EXIT_BAD_INPUT, EXIT_SOME_FAILED};
use crate::explore::{IdleCores, Noise, Observability, observability};
use crate::task::Progress;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

/// What `explore known` is told.
#[derive(Debug, Args)]
pub struct KnownArgs {
    #[command(flatten)]
    state: StateArgs,
    /// Frames, counted from 0, as in Rust: 5..12, 5..=11, 5.., ..12, or 7 alone. Default: all, or the one that PATH names.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// Noise so many dB below the largest cell of each map. Default: as strong as the lowest cells of each map say.
    #[arg(long, value_name = "DB")]
    snr: Option<f64>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &KnownArgs) -> anyhow::Result<ExitCode> {
    let (dataset, config) = args.state.open()?;
    let frames = chosen(args.frames, &args.state.path, &dataset)?;
    let noise = args.snr.map_or(Noise::Measured, Noise::SnrDb);
    let bar = progress_bar(frames.len());
    let (mut text, mut rows, mut failed) = (String::new(), Vec::new(), 0);
    let _ = writeln!(
        text,
        "{:<20}{:>11}{:>11}{:>9}{:>11}{:>12}  least observable",
        "frame", "cond echo", "cond all", "fixed", "refits mm", "echo mm"
    );
    let count = frames.len();
    for index in frames {
        let told = args.state.state(&dataset, index, &config).and_then(|state| {
            let known = observability(&state.of, noise, (&IdleCores::all(), &Progress::new())).map_err(halted)?;
            Ok((state.frame.name, known))
        });
        bar.inc(1);
        match told {
            Ok((name, known)) => {
                row(&mut text, &name, &known);
                rows.push(object(&name, &known));
            }
            Err(why) => {
                failed += 1;
                complain(&format!("warning: {why:#}"));
            }
        }
    }
    bar.finish_and_clear();
    if args.json {
        print_json(&(serde_json::to_string_pretty(&json!({ "frames": rows }))? + "\n"))?;
    } else {
        print(&text)?;
    }
    Ok(match failed {
        0 => ExitCode::SUCCESS,
        n if n == count => ExitCode::from(EXIT_BAD_INPUT),
        _ => ExitCode::from(EXIT_SOME_FAILED),
    })
}

fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:.1e}") } else { "∞".into() }
}

fn row(text: &mut String, name: &str, known: &Observability) {
    let [echo, all] = known.condition.map(number);
    let [refits, open] = known.spread_mm;
    let fixed = format!("{:.1}/{:.0}", known.fixed[0], known.fixed[1]);
    let first = known.unseen.first().map_or_else(String::new, |of| of.name.clone());
    let _ = writeln!(text, "{name:<20}{echo:>11}{all:>11}{fixed:>9}{refits:>11.1}{open:>12.1}  {first}");
    for of in &known.unseen {
        let _ = writeln!(
            text,
            "    {:<44}±{:>6.0} mm  {:>3.0} % of what fixes it is echo  (likeness {:.2})",
            of.name,
            of.spread_mm,
            100.0 * of.echo_share,
            of.likeness
        );
    }
}

fn object(name: &str, known: &Observability) -> Value {
    let finite = |x: f64| x.is_finite().then_some(x);
    json!({
        "frame": name,
        "condition_echo": finite(known.condition[0]),
        "condition_all": finite(known.condition[1]),
        "directions_fixed_by_echo": known.fixed[0],
        "directions": known.fixed[1],
        "noise_of_largest": known.noise,
        "refit_spread_mm": known.spread_mm[0],
        "open_by_echo_alone_mm": known.spread_mm[1],
        "least_observable": known.unseen,
    })
}
