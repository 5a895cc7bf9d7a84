//! `explore ambiguity`: the minima of L_EM over the floor, and over heading and height; both maps as JSON.

use super::target::{TargetArgs, halted};
use crate::cli::common::{print, print_json};
use crate::explore::{AmbiguityRequest, EmPlane, RegionOf, ambiguity_map, heading, root_of};
use crate::task::Progress;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

/// Shown under the options of `explore ambiguity --help`.
pub(super) const HELP: &str = "\
The body at the end of the fit keeps its posture and is put everywhere on the floor (128 × 128), and turned to every heading at
every height (128 × 128). A minimum is a place where the fit could have gone as well; how deep it is says how much higher L_EM is
on the way to a lower one.

JSON: {here, floor: {axes, values, minima}, turn: {…}}; the first axis is the fastest.

Examples:
  mhp-inspector explore ambiguity samples/f1 --frame 5 --preset baseline
      Why did it go there? The reflector and the person are both minima.
  mhp-inspector explore ambiguity samples/walk --frame 3 --region fit --json
      As the fit itself sees it: within its own EM region.";

/// What `explore ambiguity` is told.
#[derive(Debug, Args)]
pub struct AmbiguityArgs {
    #[command(flatten)]
    target: TargetArgs,
    /// The EM region of the floor plan.
    #[arg(long, value_enum, default_value = "body")]
    region: RegionArg,
    /// The person that is moved, counted from 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    person: usize,
}

/// The regions as typed.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum RegionArg {
    /// Around the body, wherever it is put: the whole room.
    Body,
    /// That of the fit.
    Fit,
}

/// Runs `explore ambiguity`.
///
/// # Errors
/// Where an argument or the data are bad, or the frame cannot be fitted.
pub(super) fn run(args: &AmbiguityArgs) -> anyhow::Result<ExitCode> {
    let target = args.target.open(true)?;
    let region = match args.region {
        RegionArg::Body => RegionOf::Body,
        RegionArg::Fit => RegionOf::Fit,
    };
    let request = AmbiguityRequest { state: target.state(false), person: args.person, region };
    let map = ambiguity_map(&request, &target.cores, &Progress::new()).map_err(halted)?;
    if args.target.json {
        let told = json!({"here": map.floor.here_value, "floor": plane(&map.floor), "turn": plane(&map.turn)});
        print_json(&(serde_json::to_string(&told)? + "\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let skeleton = &target.problem.skeleton;
    let mut text = format!("frame {}  {}\n", target.frame.index, target.frame.name);
    let [y, x] = map.floor.here;
    let looks = heading(target.params().person(args.person), skeleton);
    let looks = looks.map_or_else(String::new, |deg| format!(", looks {deg:+.0}° from the radar"));
    let _ = writeln!(text, "here: x {x:.2} m, y {y:+.2} m{looks}, L_EM {:.4}", map.floor.here_value);
    if let Some(truth) = target.truth() {
        let joints = skeleton.joints.len().max(1);
        for person in truth.chunks_exact(joints) {
            let root = root_of(person, skeleton);
            let looks =
                heading(person, skeleton).map_or_else(String::new, |deg| format!(", looks {deg:+.0}° from the radar"));
            let _ = writeln!(text, "truth: x {:.2} m, y {:+.2} m{looks}", root[0], root[1]);
        }
    }
    text.push_str("\nminima over the floor, lowest first\n");
    for minimum in &map.floor.minima {
        let [y, x] = map.floor.at(minimum.cell);
        let _ = writeln!(text, "  {:.4}  {:.4} deep  at x {x:.2} m, y {y:+.2} m", minimum.value, minimum.depth);
    }
    text.push_str("\nminima over heading and height\n");
    for minimum in &map.turn.minima {
        let [yaw, up] = map.turn.at(minimum.cell);
        let _ = writeln!(text, "  {:.4}  {:.4} deep  turned {yaw:+.0}°, {up:+.2} m up", minimum.value, minimum.depth);
    }
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}

fn plane(plane: &EmPlane) -> Value {
    let minima: Vec<Value> = plane
        .minima
        .iter()
        .map(|minimum| json!({"at": plane.at(minimum.cell), "em": minimum.value, "depth": minimum.depth}))
        .collect();
    json!({"axes": plane.axes, "values": plane.values, "here": plane.here, "minima": minima})
}
