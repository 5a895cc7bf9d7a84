//! `explore landscape`: a slice of the loss as a table or JSON.

use super::target::{Target, TargetArgs, halted};
use crate::cli::common::{print, print_json};
use crate::explore::{Direction, LossSlice, SliceAlong, SliceRequest, down_the_gradient, line, loss_slice};
use crate::mhp::TermId;
use crate::task::Progress;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

/// Shown under the options of `explore landscape --help`.
pub(super) const HELP: &str = "\
Directions: x, y, z and yaw of the body; joint_x, joint_y, joint_z, bone_turn and bone_lift of --joint; gradient; last_step. The
slice goes through the end of the fit. In a window of frames (the preset recommended) it is of the frame's own share of the loss.

JSON: {axes, values: [{loss, em, …}], minima, way: where each iteration passes, in the axes' units}; the first axis is the fastest.

Examples:
  mhp-inspector explore landscape samples/walk --frame 3 --preset baseline --along yaw
      Which way does the body face, as far as the loss knows?
  mhp-inspector explore landscape samples/walk --frame 3 --along x --and y --reach 0.5 --json
      L and its terms over half a metre of floor.";

/// What `explore landscape` is told.
#[derive(Debug, Args)]
pub struct LandscapeArgs {
    #[command(flatten)]
    target: TargetArgs,
    /// The first direction.
    #[arg(long, value_name = "DIRECTION", default_value = "x", value_parser = along)]
    along: SliceAlong,
    /// A second one, for a map.
    #[arg(long, value_name = "DIRECTION", value_parser = along)]
    and: Option<SliceAlong>,
    /// How far, as a multiple of what is usual.
    #[arg(long, value_name = "TIMES", default_value_t = 1.0, value_parser = reach)]
    reach: f64,
    /// The joint of a direction that is of one, for example left_wrist.
    #[arg(long, value_name = "NAME")]
    joint: Option<String>,
    /// PPPR npz of another body: the slice goes from the fit (0) to it (1).
    #[arg(long, value_name = "P.npz", conflicts_with = "along")]
    to: Option<std::path::PathBuf>,
}

fn along(text: &str) -> Result<SliceAlong, String> {
    let known = SliceAlong::of_key(text).filter(|along| *along != SliceAlong::Pins);
    known.ok_or_else(|| {
        let keys = SliceAlong::ALL.into_iter().filter(|along| *along != SliceAlong::Pins).map(SliceAlong::key);
        format!("expected one of {}", keys.collect::<Vec<_>>().join(", "))
    })
}

fn reach(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|x: &f64| (0.02..=5.0).contains(x))
        .ok_or_else(|| "expected a number in 0.02 ..= 5".to_owned())
}

/// Runs `explore landscape`.
///
/// # Errors
/// Where an argument or the data are bad, or the frame cannot be fitted.
pub(super) fn run(args: &LandscapeArgs) -> anyhow::Result<ExitCode> {
    let target = args.target.open(true)?;
    let mut request = SliceRequest { state: target.state(false), directions: Vec::new(), spans: Vec::new() };
    if let Some(path) = &args.to {
        let to = crate::dataset::read_pppr(path, None)?;
        let between = line(target.params(), &to, "from the fit to the other", "");
        let told = || format!("{}: expected parameters of as many people, other than the fit's", path.display());
        request.directions.push(between.ok_or_else(|| anyhow::anyhow!(told()))?);
        request.spans.push(SliceAlong::Pins.span().map(|end| end * args.reach));
    } else {
        request.directions.push(direction(args.along, &target, args.joint.as_deref())?);
        request.spans.push(args.along.span().map(|end| end * args.reach));
    }
    if let Some(and) = args.and {
        request.directions.push(direction(and, &target, args.joint.as_deref())?);
        request.spans.push(and.span().map(|end| end * args.reach));
    }
    let slice = loss_slice(&request, &target.cores, &Progress::new()).map_err(halted)?;
    let skeleton = &target.problem.skeleton;
    let way: Vec<Option<Vec<f64>>> =
        target.states.iter().map(|state| slice.project(skeleton, state.params.positions())).collect();
    if args.target.json {
        let truth = target.truth().and_then(|truth| slice.project(skeleton, &truth));
        let values: Vec<Value> = slice.values.iter().map(|of| value(*of)).collect();
        let told = json!({"axes": slice.axes, "values": values, "minima": minima(&slice), "way": way, "truth": truth});
        print_json(&(serde_json::to_string(&told)? + "\n"))?;
    } else {
        print(&text(&slice, &target))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn direction(along: SliceAlong, target: &Target, joint: Option<&str>) -> anyhow::Result<Direction> {
    let joint = || -> anyhow::Result<(usize, String)> {
        let name = joint.ok_or_else(|| anyhow::anyhow!("--along {}: give --joint NAME too", along.key()))?;
        let joint = target.joint(name)?;
        Ok((joint, target.problem.skeleton.shown_name(joint)))
    };
    let of_joint = |axis: usize| joint().map(|(joint, name)| Direction::Joint { joint, axis, name });
    let bone = |lift: bool| -> anyhow::Result<Direction> {
        let (joint, name) = joint()?;
        let hangs = crate::mhp::Limb::of(&target.problem.skeleton, joint).is_some();
        anyhow::ensure!(hangs, "--joint: {name} is of the trunk: no bone turns it");
        Ok(Direction::Bone { joint, lift, name })
    };
    Ok(match along {
        SliceAlong::BodyX => Direction::Body { person: 0, axis: 0 },
        SliceAlong::BodyY => Direction::Body { person: 0, axis: 1 },
        SliceAlong::BodyZ => Direction::Body { person: 0, axis: 2 },
        SliceAlong::BodyYaw => Direction::Yaw { person: 0 },
        SliceAlong::JointX => of_joint(0)?,
        SliceAlong::JointY => of_joint(1)?,
        SliceAlong::JointZ => of_joint(2)?,
        SliceAlong::BoneTurn => bone(false)?,
        SliceAlong::BoneLift => bone(true)?,
        SliceAlong::Gradient => {
            down_the_gradient(&target.gradient).ok_or_else(|| anyhow::anyhow!("the gradient moves no joint"))?
        }
        SliceAlong::LastStep | SliceAlong::Pins => {
            let [.., before, last] = target.states.as_slice() else { anyhow::bail!("no step was taken") };
            let step = line(&before.params, &last.params, "last step", "steps");
            step.ok_or_else(|| anyhow::anyhow!("the last step moved nothing"))?
        }
    })
}

fn value(value: Option<crate::explore::SliceValue>) -> Value {
    let Some(value) = value else { return Value::Null };
    let mut row = serde_json::Map::new();
    row.insert("loss".into(), json!(value.loss));
    for term in TermId::all() {
        row.insert(term.key.into(), json!(value.terms[term]));
    }
    Value::Object(row)
}

/// The minima of L with their places.
fn minima(slice: &LossSlice) -> Vec<Value> {
    let found = slice.minima(None).into_iter().map(|minimum| {
        let at: Vec<f64> = slice.axes.iter().zip(minimum.cell).map(|(axis, k)| axis.at(k as f64)).collect();
        json!({"at": at, "loss": minimum.value, "depth": minimum.depth})
    });
    found.collect()
}

fn text(slice: &LossSlice, target: &Target) -> String {
    let mut text = format!("frame {}  {}\n", target.frame.index, target.frame.name);
    let titles: Vec<String> = slice.axes.iter().map(crate::explore::SampleAxis::title).collect();
    let _ = writeln!(text, "L through the end of the fit, along {}", titles.join(" and "));
    if slice.axes.len() == 1 {
        let terms: Vec<TermId> =
            TermId::all().filter(|term| slice.values.iter().flatten().any(|value| value.terms[*term] != 0.0)).collect();
        let _ = write!(text, "{:>10} {:>10}", slice.axes[0].unit, "L");
        for term in &terms {
            let _ = write!(text, " {:>10}", term.key);
        }
        text.push('\n');
        let last = slice.shape()[0] - 1;
        for k in (0..=24).map(|k| k * last / 24) {
            let _ = write!(
                text,
                "{:>10.3} {:>10.4}",
                slice.axes[0].at(k as f64),
                slice.value([k, 0], None).unwrap_or(f64::NAN)
            );
            for term in &terms {
                let _ = write!(text, " {:>10.4}", slice.value([k, 0], Some(*term)).unwrap_or(f64::NAN));
            }
            text.push('\n');
        }
    }
    text.push_str("\nminima of L, lowest first\n");
    for minimum in slice.minima(None) {
        let at =
            slice.axes.iter().zip(minimum.cell).map(|(axis, k)| format!("{:+.3} {}", axis.at(k as f64), axis.unit));
        let at: Vec<String> = at.collect();
        let _ = writeln!(text, "  {:.4}  {:.4} deep  at {}", minimum.value, minimum.depth, at.join(", "));
    }
    text
}
