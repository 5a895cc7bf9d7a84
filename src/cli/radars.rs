//! `radars`: the radars that manifests can name.

use super::common::{print, print_json};
use crate::dataset::{RadarPreset, user_radars};
use anyhow::Context as _;
use clap::Args;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

/// Shown under the options of `radars --help`.
pub(super) const HELP: &str = "\
A manifest takes one by its name instead of a [radar] table: `radar = \"iwr1843\"`. Views that state neither `psf` nor [view.fft] then
take the widths that follow from its FFTs. `calibrate --save NAME` adds one.

Exit codes: 0 told; 2 no such radar.

Examples:
  mhp-inspector radars
      All of them, with the widths that follow from their FFTs.
  mhp-inspector radars iwr1843
      Its file: a start for one's own.";

/// What `radars` is told.
#[derive(Debug, Args)]
pub struct RadarsArgs {
    /// The radar whose file is printed; without it, all are listed.
    name: Option<String>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Runs `radars`.
///
/// # Errors
/// Where there is no radar of that name, or its file makes no sense.
pub(super) fn run(args: &RadarsArgs) -> anyhow::Result<ExitCode> {
    if let Some(name) = &args.name {
        let preset = RadarPreset::named(name)?;
        if args.json {
            print_json(&format!("{}\n", serde_json::to_string_pretty(&as_json(&preset)?)?))?;
        } else {
            print(&preset.to_toml())?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let (mut text, mut all) = (String::new(), Map::new());
    for name in RadarPreset::names() {
        let preset = RadarPreset::named(&name).with_context(|| name.clone())?;
        let psf = widths(&preset)?;
        let _ = writeln!(text, "{name:<14}{}", preset.about);
        let _ = writeln!(
            text,
            "{:<14}widths: range {:.2} cm, azimuth {:.2}°, elevation {:.2}°, speed {:.3} m/s",
            "",
            100.0 * psf.range_m,
            psf.azimuth_rad.to_degrees(),
            psf.elevation_rad.to_degrees(),
            psf.doppler_mps
        );
        all.insert(name, as_json(&preset)?);
    }
    if args.json {
        print_json(&format!("{}\n", serde_json::to_string_pretty(&Value::Object(all))?))?;
    } else {
        if let Some(folder) = user_radars() {
            let _ = writeln!(text, "\nyour own: {}", folder.display());
        }
        print(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn widths(preset: &RadarPreset) -> anyhow::Result<crate::radar::PointSpread> {
    let derived = preset.view_fft().map_err(anyhow::Error::msg)?.map(|fft| fft.point_spread());
    Ok(preset.psf.or(derived).unwrap_or_default())
}

fn as_json(preset: &RadarPreset) -> anyhow::Result<Value> {
    Ok(json!({
        "about": preset.about,
        "radar": preset.radar,
        "fft": preset.fft,
        "psf": widths(preset)?,
        "psf_source": if preset.psf.is_some() { "stated" } else { "derived" },
    }))
}
