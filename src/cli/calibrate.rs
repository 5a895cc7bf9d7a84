//! `calibrate`: point-spread widths measured on a frame's reflectors, beside those that the data set states or derives.

use super::common::{inputs, open, print, print_json};
use crate::dataset::{Dataset, FftText, RadarPreset};
use crate::escape::to_cell;
use crate::output::replace_file;
use crate::radar::{
    AxisKind, LobeCut, PointSpread, Reflector, ReflectorMap, ReflectorPlace, refined_widths, sine_deg, with_width,
};
use anyhow::{Context as _, bail, ensure};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `calibrate --help`.
pub(super) const HELP: &str = "\
The width is the standard deviation of the unit-peak Gaussian closest to the main lobe, as a view's `psf` is. Echoes wider than a
point's make it too large: take a corner reflector, or a small bright thing that stands alone.

Exit codes: 0 measured; 2 bad input, or no echo that stands alone.

Examples:
  mhp-inspector calibrate data/room --frame 0
      From all isolated peaks of the frame: model and measured width of every axis.
  mhp-inspector calibrate data/room --frame 0 --at 3.2,-15 --csv cuts.csv
      From the reflector near 3.2 m, 15° to the right; the cuts through it, measured, modelled and fitted.
  mhp-inspector calibrate data/room --at 3.2,-15 --save lab-radar
      Keeps chirp, FFTs and these widths as a radar of one's own: `radar = \"lab-radar\"` in a manifest takes them.";

/// What `calibrate` is told.
#[derive(Debug, Args)]
pub struct CalibrateArgs {
    /// An MMVR tree or any folder inside one, a folder with `dataset.toml`, a capture, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    frame: usize,
    /// Where the reflector is: metres and degrees (left positive, or up), and its speed where a map has one. Without it, every peak
    /// that stands alone is measured.
    #[arg(long, value_name = "RANGE,ANGLE[,SPEED]", value_parser = place, allow_hyphen_values = true)]
    at: Option<ReflectorPlace>,
    /// Only this view.
    #[arg(long, value_name = "ARRAY")]
    view: Option<String>,
    /// Write the cuts: view, reflector, axis, offset, measured, model, fitted and the window's own lobe.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Keep chirp, FFT configuration and the refined widths as a radar of that name.
    #[arg(long, value_name = "NAME")]
    save: Option<String>,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

fn place(text: &str) -> Result<ReflectorPlace, String> {
    let fault = || format!("`{text}` is no place; expected metres and degrees, such as 3.2,-15");
    let numbers: Vec<f64> =
        text.split(',').map(|part| part.trim().parse().map_err(|_| fault())).collect::<Result<_, _>>()?;
    let (range_m, degrees, speed_mps) = match numbers[..] {
        [range, degrees] => (range, degrees, None),
        [range, degrees, speed] => (range, degrees, Some(speed)),
        _ => return Err(fault()),
    };
    if !(range_m > 0.0 && range_m.is_finite() && degrees.abs() <= 90.0) {
        return Err(fault());
    }
    Ok(ReflectorPlace { range_m, sine: degrees.to_radians().sin(), speed_mps })
}

/// What was measured on one view.
struct OfView {
    array: String,
    reflectors: Vec<Reflector>,
    /// A kind of axis with its measured and its stated or derived width.
    widths: Vec<(AxisKind, f64, f64)>,
    source: String,
}

/// Runs `calibrate`.
///
/// # Errors
/// Where the data set, the frame or the view is not there, no echo stands alone, or a file cannot be written.
pub(super) fn run(args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let dataset = open(&args.path, args.manifest.as_deref())?;
    if let Some(csv) = &args.csv {
        inputs(&dataset, &args.path, &[args.manifest.as_deref()]).check_file(csv)?;
    }
    let measured = measure(&dataset, args)?;
    let psf = refined(&dataset, &measured);
    if let Some(path) = &args.csv {
        let text = cuts(&measured)?;
        replace_file(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())?;
    }
    let saved = args.save.as_deref().map(|name| save(&dataset, name, psf)).transpose()?;
    if args.json {
        let views: Vec<Value> = measured.iter().map(as_json).collect();
        let saved = saved.as_ref().map(|path| path.display().to_string());
        let whole = json!({ "frame": args.frame, "views": views, "psf": psf, "saved": saved });
        print_json(&format!("{}\n", serde_json::to_string_pretty(&whole).context("writing JSON")?))?;
    } else {
        let mut text = measured.iter().map(as_text).collect::<String>();
        if let Some(path) = saved {
            let _ = writeln!(text, "saved       {}", path.display());
        }
        print(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn measure(dataset: &Dataset, args: &CalibrateArgs) -> anyhow::Result<Vec<OfView>> {
    let (info, frame) = (dataset.info(), dataset.load(args.frame)?);
    if let Some(name) = &args.view {
        let known: Vec<&str> = info.views.iter().map(|view| view.array.as_str()).collect();
        ensure!(known.contains(&name.as_str()), "--view {name}: no such view; expected one of {}", known.join(", "));
    }
    let (mut measured, mut why) = (Vec::new(), Vec::new());
    for (k, (view, map)) in info.views.iter().zip(&frame.maps).enumerate() {
        if args.view.as_ref().is_some_and(|name| *name != view.array) {
            continue;
        }
        let calibration = info.calibration(k);
        let map = match ReflectorMap::new(view, &map.data, calibration.fft.as_ref()) {
            Ok(map) => map,
            Err(reason) => {
                why.push(format!("view `{}`: {reason}", view.array));
                continue;
            }
        };
        let reflectors = match args.at {
            Some(at) => map.strongest(Some(at)).into_iter().collect(),
            None => map.isolated(),
        };
        let found = refined_widths(&reflectors);
        if found.is_empty() {
            why.push(format!("view `{}`: no echo there stands alone", view.array));
            continue;
        }
        let model = |kind| {
            reflectors.iter().flat_map(|r| &r.cuts).find(|cut| cut.kind == kind).map_or(0.0, |cut| cut.model_sigma)
        };
        let widths = found.into_iter().map(|(kind, sigma)| (kind, sigma, model(kind))).collect();
        measured.push(OfView { array: view.array.clone(), reflectors, widths, source: calibration.words() });
    }
    if measured.is_empty() {
        bail!("{}: frame {}: nothing to measure: {}", args.path.display(), args.frame, why.join("; "));
    }
    Ok(measured)
}

/// The widths of the data set's radar with those that were measured: of several views, the narrowest.
fn refined(dataset: &Dataset, measured: &[OfView]) -> PointSpread {
    let mut psf = PointSpread::default();
    for view in &dataset.info().views {
        psf.range_m = psf.range_m.max(view.psf.range_m);
        psf.azimuth_rad = psf.azimuth_rad.max(view.psf.azimuth_rad);
        psf.elevation_rad = psf.elevation_rad.max(view.psf.elevation_rad);
        psf.doppler_mps = psf.doppler_mps.max(view.psf.doppler_mps);
    }
    let mut all: Vec<(AxisKind, f64)> =
        measured.iter().flat_map(|view| &view.widths).map(|&(kind, sigma, _)| (kind, sigma)).collect();
    // Narrowest last: it stays.
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.into_iter().fold(psf, |psf, (kind, sigma)| with_width(psf, kind, sigma))
}

/// Keeps a radar of the user.
fn save(dataset: &Dataset, name: &str, psf: PointSpread) -> anyhow::Result<PathBuf> {
    let info = dataset.info();
    let mut known = info.ffts().into_iter().flatten();
    let fft = known.next().map(|first| {
        // Both angles, where different views have them.
        known.fold(first, |mut all, fft| {
            all.setup.azimuth = all.setup.azimuth.or(fft.setup.azimuth);
            all.setup.elevation = all.setup.elevation.or(fft.setup.elevation);
            all
        })
    });
    let radar = fft.as_ref().map_or_else(|| info.radar.clone(), |fft| fft.radar.clone());
    let about = format!("widths refined on {}", info.name);
    let preset = RadarPreset { about, radar, fft: fft.as_ref().map(FftText::of), psf: Some(psf) };
    Ok(preset.save(name)?)
}

/// A width as a person reads it.
fn shown(kind: AxisKind, sigma: f64) -> String {
    match kind {
        AxisKind::Doppler => format!("{sigma:.4} m/s"),
        kind if kind.is_angular() => format!("{:.3}°", sigma.to_degrees()),
        _ => format!("{:.3} cm", 100.0 * sigma),
    }
}

fn at_words(reflector: &Reflector) -> String {
    let one = |(kind, x): &(AxisKind, f64)| match kind {
        AxisKind::Doppler => format!("{x:.3} m/s"),
        kind if kind.is_angular() => format!("{:.2}°", sine_deg(*x)),
        _ => format!("{x:.3} m"),
    };
    reflector.coordinates.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn as_text(view: &OfView) -> String {
    let mut text = format!("view        {}: {}\n", view.array, view.source);
    for reflector in view.reflectors.iter().take(8) {
        let _ = writeln!(text, "  reflector {}", at_words(reflector));
    }
    if view.reflectors.len() > 8 {
        let _ = writeln!(text, "            and {} more", view.reflectors.len() - 8);
    }
    for (kind, sigma, model) in &view.widths {
        let ratio = if *model > 0.0 { format!(" ({:+.1} %)", 100.0 * (sigma / model - 1.0)) } else { String::new() };
        let _ = writeln!(
            text,
            "  {:<9} measured {}, model {}{ratio}",
            kind.name(),
            shown(*kind, *sigma),
            shown(*kind, *model)
        );
    }
    text
}

fn as_json(view: &OfView) -> Value {
    let cut = |cut: &LobeCut| json!({ "axis": cut.kind, "sigma": cut.sigma, "model_sigma": cut.model_sigma });
    let reflector = |reflector: &Reflector| {
        let place: Vec<Value> =
            reflector.coordinates.iter().map(|(kind, x)| json!({ "axis": kind, "value": x })).collect();
        json!({ "at": place, "level": reflector.level, "cuts": reflector.cuts.iter().map(cut).collect::<Vec<_>>() })
    };
    let width =
        |(kind, sigma, model): &(AxisKind, f64, f64)| json!({ "axis": kind, "measured": sigma, "model": model });
    json!({
        "array": view.array,
        "widths_from": view.source,
        "reflectors": view.reflectors.iter().map(reflector).collect::<Vec<_>>(),
        "widths": view.widths.iter().map(width).collect::<Vec<_>>(),
    })
}

/// Every point of every cut, a row each.
fn cuts(measured: &[OfView]) -> anyhow::Result<String> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(["view", "reflector", "axis", "offset", "measured", "model", "fitted", "window"])?;
    let number = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.6}"));
    for view in measured {
        for (k, reflector) in view.reflectors.iter().enumerate() {
            for cut in &reflector.cuts {
                for (&offset, &value) in cut.offset.iter().zip(&cut.measured) {
                    out.write_record([
                        to_cell(&view.array).into_owned(),
                        k.to_string(),
                        cut.kind.name().to_owned(),
                        format!("{offset:.6}"),
                        format!("{value:.6}"),
                        format!("{:.6}", cut.model(offset)),
                        number(cut.fitted(offset)),
                        number(cut.lobe(offset)),
                    ])?;
                }
            }
        }
    }
    Ok(String::from_utf8(out.into_inner().map_err(csv::IntoInnerError::into_error)?)?)
}
