//! `calibrate-room`: where the radars of each environment stand in the room whose frame the joints are in; found, told, remembered.

use super::common::{complain, open, print, print_json};
use crate::dataset::{Dataset, ROOMS_NAME, remember_room};
use crate::folders::user_data;
use crate::geometry::{Pose, Vec3};
use crate::output::into_data_allowed;
use crate::study::{RoomEstimate, environments, estimate_room};
use crate::task::Progress;
use anyhow::Context as _;
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `calibrate-room --help`.
pub(super) const HELP: &str = "\
What is found is kept in rooms.toml in the program's own folder ($MHP_INSPECTOR_HOME, else the platform's), which may be edited; with
--into-data in the data set itself. `info` tells it. From then on the joints are truth in the radar's frame, and fits are scored.

Exit codes: 0 found; 1 not found for some environments; 2 bad input.

Examples:
  mhp-inspector calibrate-room data/HIBER
      All environments, from 200 frames each.
  mhp-inspector calibrate-room data/HIBER --environment 03 --frames 400 --dry-run
      One of them, and nothing is kept.";

/// Find where the radars of a data set stand in the room whose frame its joints are in.
#[derive(Debug, clap::Args)]
pub struct CalibrateRoomArgs {
    /// A tree of HIBER, or any folder inside one.
    path: PathBuf,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    /// Only this environment, for example 03; may be given several times.
    #[arg(long, value_name = "E")]
    environment: Vec<String>,
    /// Frames of an environment that are looked at, evenly taken.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(12..=100_000))]
    frames: u32,
    /// Tell what is found and keep nothing.
    #[arg(long)]
    dry_run: bool,
    /// One JSON array instead of text.
    #[arg(long)]
    json: bool,
}

/// Finds, keeps and tells the transforms.
///
/// # Errors
/// Where the data set cannot be opened or has no joints in a room's frame, an environment is not in it, or nothing can be kept.
pub(super) fn run(args: &CalibrateRoomArgs) -> anyhow::Result<ExitCode> {
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let all: Vec<String> = environments(&dataset)?.into_iter().map(|(name, _)| name).collect();
    if let Some(unknown) = args.environment.iter().find(|asked| !all.contains(asked)) {
        anyhow::bail!("no frames of environment \"{unknown}\"; expected one of {}", all.join(", "));
    }
    let chosen = if args.environment.is_empty() { &all } else { &args.environment };
    let file = if args.dry_run { None } else { Some(file_of(&dataset)?) };
    let (mut told, mut failed) = (Vec::new(), false);
    for environment in chosen {
        match estimate_room(&dataset, environment, args.frames as usize, &Progress::new()) {
            Ok(found) => {
                if let (Some(file), Some(rooms)) = (&file, dataset.room_joints()) {
                    remember_room(rooms.tree(), file, &found.transform)?;
                }
                if !args.json {
                    print(&as_text(&found))?;
                }
                told.push(as_json(&found));
            }
            Err(error) => {
                complain(&error.to_string());
                failed = true;
            }
        }
    }
    if args.json {
        print_json(&(serde_json::to_string_pretty(&told).context("writing JSON")? + "\n"))?;
    }
    if let Some(file) = file.filter(|_| !told.is_empty()) {
        complain(&format!("kept in {}", file.display()));
    }
    Ok(if failed { ExitCode::from(super::EXIT_SOME_FAILED) } else { ExitCode::SUCCESS })
}

/// Where transforms are kept.
fn file_of(dataset: &Dataset) -> anyhow::Result<PathBuf> {
    if let Some(rooms) = dataset.room_joints().filter(|_| into_data_allowed()) {
        return Ok(rooms.tree().join(ROOMS_NAME));
    }
    let home =
        user_data().context("there is no home folder to keep it in; set MHP_INSPECTOR_HOME, or give --into-data")?;
    Ok(home.join(ROOMS_NAME))
}

fn as_text(found: &RoomEstimate) -> String {
    let room = &found.transform;
    let Pose { rotation, translation } = room.radar_from_room;
    let numbers = |v: Vec3| v.map(|x| format!("{x:8.4}")).join(" ");
    let [agree, looked] = room.frames.unwrap_or_default();
    let [moved, turned] = found.refined_by;
    let [x, y, z] = room.radar_from_room.world_from_view([0.0; 3]);
    let mut text = format!(
        "environment {}: the radar is at ({x:.3}, {y:.3}, {z:.3}) m of the room\n  frames       {looked} looked at, {} with one person and \
         an echo in both maps, {agree} agree\n  residual     {:.1} cm, joints' middles to echoes' middles, of those that agree\n  \
         explained    soft IoU {:.3} of bodies and maps; this moved the middles' transform by {:.1} cm and {:.2}°\n",
        room.environment,
        found.usable,
        100.0 * room.residual_m.unwrap_or_default(),
        found.overlap,
        100.0 * moved,
        turned.to_degrees()
    );
    for (k, (row, t)) in rotation.into_iter().zip(translation).enumerate() {
        let name = if k == 0 { "radar_from_room, m" } else { "" };
        // Writing to a text does not fail.
        let _ = writeln!(text, "  {name:<19}[{}]   [{t:8.4}]", numbers(row));
    }
    found.warnings.iter().fold(text, |text, warning| text + &format!("  warning      {warning}\n"))
}

fn as_json(found: &RoomEstimate) -> serde_json::Value {
    let room = &found.transform;
    json!({
        "environment": room.environment,
        "rotation": room.radar_from_room.rotation,
        "translation_m": room.radar_from_room.translation,
        "residual_m": room.residual_m,
        "frames_agree": room.frames.map(|[agree, _]| agree),
        "frames_looked_at": room.frames.map(|[_, looked]| looked),
        "frames_usable": found.usable,
        "overlap": found.overlap,
        "refined_by_m": found.refined_by[0],
        "refined_by_rad": found.refined_by[1],
        "warnings": found.warnings,
    })
}
