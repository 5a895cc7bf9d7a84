//! `explore radar`: what another radar would see and know of the same pose.

use super::frame::StateArgs;
use super::target::halted;
use crate::cli::common::{complain, print, print_json};
use crate::dataset::npz::{ArrayView, write};
use crate::explore::{IdleCores, RadarChange, Seen, preset_of, what_if};
use crate::radar::Window;
use crate::task::Progress;
use anyhow::{Context as _, ensure};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// What `explore radar` is told.
#[derive(Debug, Args)]
pub struct RadarArgs {
    #[command(flatten)]
    state: StateArgs,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    frame: usize,
    /// Only this view is changed, by its array; without it all.
    #[arg(long, value_name = "ARRAY")]
    view: Option<String>,
    /// Swept bandwidth, Hz.
    #[arg(long, value_name = "HZ")]
    bandwidth: Option<f64>,
    /// Virtual elements of the line.
    #[arg(long, value_name = "N")]
    elements: Option<usize>,
    /// Window over samples and elements: rectangular, hann, hamming, blackman, chebyshev-30.
    #[arg(long, value_name = "NAME")]
    window: Option<String>,
    /// How much higher the radar stands, m.
    #[arg(long, value_name = "M", default_value_t = 0.0, allow_hyphen_values = true)]
    raise: f64,
    /// How far it looks down, degrees.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    tilt: f64,
    /// Noise below the largest cell, dB; 40 where it is not given.
    #[arg(long, value_name = "DB")]
    snr: Option<f64>,
    /// Keep the radar as a preset that manifests can name.
    #[arg(long, value_name = "NAME")]
    save: Option<String>,
    /// Write the maps, `today_<array>` and `other_<array>`, as npz.
    #[arg(long, value_name = "FILE.npz")]
    out: Option<PathBuf>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &RadarArgs) -> anyhow::Result<ExitCode> {
    let (dataset, config) = args.state.open()?;
    ensure!(args.frame < dataset.len(), "--frame {}: expected less than {}", args.frame, dataset.len());
    let window = args
        .window
        .as_deref()
        .map(|name| Window::named(name).with_context(|| format!("--window {name}: expected {}", Window::NAMES)));
    let change = RadarChange {
        bandwidth_hz: args.bandwidth,
        elements: args.elements,
        window: window.transpose()?,
        raised_m: args.raise,
        tilt_deg: args.tilt,
        snr_db: args.snr,
    };
    change.check().map_err(anyhow::Error::msg)?;
    let views = &dataset.info().views;
    if let Some(name) = &args.view {
        let names: Vec<&str> = views.iter().map(|view| view.array.as_str()).collect();
        ensure!(names.contains(&name.as_str()), "--view {name}: no such map; expected one of {}", names.join(", "));
    }
    if let Some(file) = &args.out {
        crate::cli::common::inputs(&dataset, &args.state.path, &[]).check_file(file)?;
    }
    let of_view = |view: &crate::radar::View| {
        let meant = args.view.as_ref().is_none_or(|name| *name == view.array);
        if meant { change } else { RadarChange::default() }
    };
    let changes: Vec<RadarChange> = views.iter().map(of_view).collect();
    let state = args.state.state(&dataset, args.frame, &config)?;
    let with = (&IdleCores::all(), &Progress::new());
    let found = what_if(dataset.info(), &state.of, &changes, with).map_err(halted)?;
    if let Some(file) = &args.out {
        let both = [("today", &found.today), ("other", &found.other)];
        let named: Vec<(String, Vec<usize>, &[f64])> = both
            .iter()
            .flat_map(|(word, seen)| {
                let maps = seen.views.iter().zip(&seen.maps);
                maps.map(move |(view, map)| (format!("{word}_{}", view.array), view.shape(), map.as_slice()))
            })
            .collect();
        let arrays: Vec<(&str, ArrayView<'_>)> =
            named.iter().map(|(name, shape, map)| (name.as_str(), ArrayView::f64(shape, map))).collect();
        write(file, &arrays)?;
    }
    if let Some(name) = &args.save {
        let path = preset_of(dataset.info(), &changes).save(name)?;
        complain(&format!("radar {name} in {}", path.display()));
    }
    if args.json {
        let object = json!({ "frame": state.frame.name, "today": object(&found.today), "other": object(&found.other) });
        print_json(&(serde_json::to_string_pretty(&object)? + "\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut text = format!("{}\n{:<34}{:>12}{:>12}\n", state.frame.name, "", "today", "other");
    let both = [&found.today, &found.other];
    for (k, view) in found.today.views.iter().enumerate() {
        let widths = |name: &str, of: fn(&crate::radar::PointSpread) -> f64, unit: f64, text: &mut String| {
            let [a, b] = both.map(|seen| unit * of(&seen.views[k].psf));
            if a > 0.0 || b > 0.0 {
                let _ = writeln!(text, "{:<34}{a:>12.3}{b:>12.3}", format!("{} {name}", view.array));
            }
        };
        widths("range width, cm", |psf| psf.range_m, 100.0, &mut text);
        widths("azimuth width, °", |psf| psf.azimuth_rad.to_degrees(), 1.0, &mut text);
        widths("elevation width, °", |psf| psf.elevation_rad.to_degrees(), 1.0, &mut text);
    }
    let mut line = |name: &str, of: &dyn Fn(&Seen) -> f64| {
        let [a, b] = both.map(of);
        let _ = writeln!(text, "{name:<34}{a:>12.1}{b:>12.1}");
    };
    line("directions that the echo fixes", &|seen| seen.known.fixed[0]);
    line("refits spread, mm", &|seen| seen.known.spread_mm[0]);
    line("open by the echo alone, mm", &|seen| seen.known.spread_mm[1]);
    for (word, seen) in ["today", "other"].iter().zip(both) {
        let first = seen.known.unseen.first();
        let told = first.map_or_else(String::new, |of| format!("{} ±{:.0} mm", of.name, of.spread_mm));
        let _ = writeln!(text, "least observable, {word}: {told}");
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

fn object(seen: &Seen) -> Value {
    let views: Vec<Value> = seen.views.iter().map(|view| json!({ "array": view.array, "psf": view.psf })).collect();
    json!({
        "views": views, "directions_fixed_by_echo": seen.known.fixed[0], "refit_spread_mm": seen.known.spread_mm[0],
        "open_by_echo_alone_mm": seen.known.spread_mm[1], "least_observable": seen.known.unseen,
    })
}
