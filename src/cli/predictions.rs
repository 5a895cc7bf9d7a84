//! `predictions`: joints of networks and other programs beside truth and fit.

use super::common::{CsvArgs, complain, inputs, open, print, print_json};
use super::frames::{FrameRange, chosen};
use super::sources::{ReadingArgs, SourceFile};
use crate::body::Skeleton;
use crate::dataset::Dataset;
use crate::escape::{one_line, to_cell};
use crate::geometry::Vec3;
use crate::output::replace_file;
use crate::predictions::{
    Comparison, PredictionRow, Predictions, SourceRow, SourceSummary, WriteFormat, complete_bodies, prediction_row,
    write_predictions,
};
use crate::start::problem_alone;
use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `predictions --help`.
pub(super) const HELP: &str = "\
Files: npz or npy (frames, persons, joints, 3), beside it frames, joint_names, unit, axes; CSV and Parquet with a row a person \
(frame,person,nose_x,nose_y,nose_z,...) or a row a joint (frame,person,joint,x,y,z); JSON as COCO, MMPose or a list of persons; a \
PPPR npz of an earlier run or the folder of `fit --out`. What a file does not say, a description FILE.toml beside it can: name, \
colour, skeleton or joints, unit, axes, array, [mapping]. Frames are matched by name, by the end of a name, or by number; joints by \
name, over those that both skeletons have. People are paired best; a person of whom every joint is NaN is not there.

Exit codes: 0 done; 2 a file cannot be used.

Examples:
  mhp-inspector predictions data/walk --pred retr=retr.npz --unit m --axes camera
      MAJPE, PA-MAJPE, OSPA of RETR's joints against the truth. Unit and axes are remembered.
  mhp-inspector predictions data/walk --pred retr=retr.npz --pred hupr=out.json --fit results --sort disagreement
      Two networks beside a fit; the frames where they are farthest from it first.
  mhp-inspector predictions data/walk --pred retr.npz --joints --csv errors.csv
      Errors of each joint; a row a frame and source as CSV.
  mhp-inspector predictions data/walk --pred retr.npz --write retr.parquet
      The same joints in another format, in metres, on the data set's skeleton.";

/// Rows that are shown; the rest is in the means and in the CSV.
const SHOWN: usize = 20;

/// What `predictions` is told.
#[derive(Debug, Args)]
pub struct PredictionsArgs {
    /// The data set.
    path: PathBuf,
    /// Predictions: FILE or NAME=FILE; several times for several sources.
    #[arg(long = "pred", value_name = "[NAME=]FILE", required = true)]
    sources: Vec<SourceFile>,
    /// The fit to compare with: the folder of `fit --out`, or of PPPR npz.
    #[arg(long, value_name = "DIR")]
    fit: Option<PathBuf>,
    /// Frames, counted from 0: 5..12, 5.., ..12 or 7. Default: all, or the one that PATH names.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Order of the frames that are shown.
    #[arg(long, value_enum, default_value = "frame")]
    sort: Order,
    /// Print also the mean error of each joint.
    #[arg(long)]
    joints: bool,
    /// Write a row a frame and source.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    cells: CsvArgs,
    /// Write the joints of the only source on the data set's skeleton: .npz, .csv, .json or .parquet.
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// One JSON object instead of tables.
    #[arg(long)]
    json: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// In which order frames are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Order {
    /// As in the data set.
    Frame,
    /// The largest error against the truth first.
    Error,
    /// The largest distance from the fit first.
    Disagreement,
}

/// Runs `predictions`.
///
/// # Errors
/// Where the data set or a source cannot be used, or a file not be written.
pub(super) fn run(args: &PredictionsArgs) -> anyhow::Result<ExitCode> {
    args.cells.apply();
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = chosen(args.frames, &args.path, &dataset)?;
    let sources = open_all(args, &dataset)?;
    let fit = args.fit.as_ref().map(|path| {
        let file = SourceFile { name: Some("fit".into()), colour: None, path: path.clone() };
        args.reading.open(&file, &dataset)
    });
    let fit = fit.transpose()?;
    if args.sort == Order::Disagreement && fit.is_none() {
        bail!("--sort disagreement: expected --fit DIR, the fit to disagree with");
    }
    for source in &sources {
        for note in &source.notes {
            complain(&format!("note: {}: {note}", source.name));
        }
    }
    let mut rows = Vec::with_capacity(frames.len());
    for index in frames {
        rows.push(prediction_row(&dataset, index, &sources, fit.as_ref())?);
    }
    let named: Vec<Option<&Path>> = args.sources.iter().map(|source| Some(source.path.as_path())).collect();
    let guarded = inputs(&dataset, &args.path, &[args.manifest.as_deref(), args.fit.as_deref()]).with_named(named);
    if let Some(path) = &args.csv {
        guarded.check_replaced(path)?;
        write_csv(path, &rows, &sources, &dataset.info().skeleton)?;
    }
    if let Some(path) = &args.write {
        guarded.check_replaced(path)?;
        write_joints(path, &sources, &dataset)?;
    }
    let report = Report { rows: &rows, sources: &sources, fit: fit.as_ref(), skeleton: &dataset.info().skeleton };
    if args.json {
        print_json(&(serde_json::to_string_pretty(&report.json()).context("writing JSON")? + "\n"))?;
    } else {
        print(&report.text(args.sort, args.joints))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn open_all(args: &PredictionsArgs, dataset: &Dataset) -> anyhow::Result<Vec<Predictions>> {
    let mut sources: Vec<Predictions> = Vec::with_capacity(args.sources.len());
    for file in &args.sources {
        let source = args.reading.open(file, dataset)?;
        if source.name == "fit" || sources.iter().any(|other| other.name == source.name) {
            bail!(
                "--pred {}: a source called `{}` is there already; name it: --pred NAME=FILE",
                file.path.display(),
                source.name
            );
        }
        sources.push(source);
    }
    Ok(sources)
}

/// Writes the joints of a source, completed where the skeleton has more.
fn write_joints(path: &Path, sources: &[Predictions], dataset: &Dataset) -> anyhow::Result<()> {
    let [source] = sources else { bail!("--write: {} sources; expected one --pred", sources.len()) };
    let format = WriteFormat::of(path)
        .with_context(|| format!("{}: expected a name that ends in .npz, .csv, .json or .parquet", path.display()))?;
    let skeleton = &dataset.info().skeleton;
    let complete = source.map.known.len() == skeleton.joints.len();
    let first = source.frames().next().context("a source without frames")?;
    let problem =
        (!complete).then(|| problem_alone(dataset, &dataset.load(first)?).map_err(anyhow::Error::from)).transpose()?;
    let mut frames: Vec<(String, Vec<Vec<Vec3>>)> = Vec::with_capacity(source.len());
    for index in source.frames() {
        let Some(frame) = source.frame(index) else { continue };
        let joints =
            problem.as_ref().map_or_else(|| frame.joints.clone(), |problem| complete_bodies(source, frame, problem));
        let persons = joints.chunks_exact(skeleton.joints.len().max(1)).map(<[Vec3]>::to_vec).collect();
        frames.push((dataset.frame_name(index).to_owned(), persons));
    }
    Ok(write_predictions(path, format, &skeleton.joints, &frames)?)
}

/// The columns of `--csv`, without those of the joints.
const COLUMNS: [&str; 12] = [
    "frame",
    "source",
    "people",
    "annotated",
    "joints",
    "majpe_mm",
    "pa_majpe_mm",
    "ospa_mm",
    "fit_majpe_mm",
    "fit_pa_majpe_mm",
    "fit_ospa_mm",
    "fit_people",
];

fn write_csv(path: &Path, rows: &[PredictionRow], sources: &[Predictions], skeleton: &Skeleton) -> anyhow::Result<()> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let joints = skeleton.joints.iter().map(|joint| to_cell(&format!("{joint}_mm")).into_owned());
    table.write_record(COLUMNS.map(str::to_owned).into_iter().chain(joints))?;
    let number = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
    let count = |n: Option<usize>| n.map_or_else(String::new, |n| n.to_string());
    for row in rows {
        for (source, of) in sources.iter().zip(&row.sources) {
            let (truth, fit) = (of.truth.as_ref(), of.fit.as_ref());
            let errors = |of: Option<&Comparison>| {
                let errors = of.map(|of| of.errors);
                [errors.map(|e| e.majpe_mm), errors.map(|e| e.pa_majpe_mm), errors.map(|e| e.ospa_mm)].map(number)
            };
            let mut cells = vec![
                to_cell(&row.frame).into_owned(),
                source.name.clone(),
                count(of.persons),
                count(row.annotated),
                source.map.known.len().to_string(),
            ];
            cells.extend(errors(truth));
            cells.extend(errors(fit));
            cells.push(count(fit.map(|fit| fit.persons[1])));
            let of_joint =
                |joint| truth.and_then(|of| of.joints_mm.iter().find(|(k, _)| *k == joint)).map(|(_, mm)| *mm);
            cells.extend((0..skeleton.joints.len()).map(|joint| number(of_joint(joint))));
            table.write_record(cells)?;
        }
    }
    let bytes = table.into_inner().context("writing CSV")?;
    replace_file(path, |out| out.write_all(&bytes)).with_context(|| format!("{}: cannot be written", path.display()))
}

struct Report<'a> {
    rows: &'a [PredictionRow],
    sources: &'a [Predictions],
    fit: Option<&'a Predictions>,
    skeleton: &'a Skeleton,
}

impl Report<'_> {
    /// The fit first, where there is one.
    fn summaries(&self) -> Vec<(&str, usize, SourceSummary)> {
        let of = |pick: &dyn Fn(&PredictionRow) -> Option<SourceRow>| {
            let mut summary = SourceSummary::default();
            self.rows.iter().filter_map(pick).for_each(|row| summary.add(&row));
            summary
        };
        let fit = self.fit.map(|fit| ("fit", fit.map.known.len(), of(&|row| Some(row.reference.clone()))));
        let sources = self.sources.iter().enumerate();
        let sources =
            sources.map(|(k, s)| (s.name.as_str(), s.map.known.len(), of(&|row| row.sources.get(k).cloned())));
        fit.into_iter().chain(sources).collect()
    }

    fn text(&self, order: Order, joints: bool) -> String {
        let summaries = self.summaries();
        let head = [
            "source",
            "frames",
            "missing",
            "people",
            "joints",
            "majpe_mm",
            "pa_majpe_mm",
            "ospa_mm",
            "to_fit_mm",
            "to_fit_pa_mm",
        ];
        let mut lines = vec![head.map(str::to_owned).to_vec()];
        for (name, joints, of) in &summaries {
            let (truth, fit) = (of.truth.errors(), of.fit.errors());
            let mm = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.1}"));
            lines.push(vec![
                (*name).to_owned(),
                of.frames.to_string(),
                of.missing.to_string(),
                format!("{:.2}", of.persons as f64 / of.frames.max(1) as f64),
                joints.to_string(),
                mm(truth.map(|e| e.majpe_mm)),
                mm(truth.map(|e| e.pa_majpe_mm)),
                mm(truth.map(|e| e.ospa_mm)),
                mm(fit.map(|e| e.majpe_mm)),
                mm(fit.map(|e| e.pa_majpe_mm)),
            ]);
        }
        let mut text = aligned(&lines);
        if joints {
            text.push('\n');
            text += &aligned(&self.joint_lines(&summaries));
        }
        text.push('\n');
        text + &self.frame_lines(order)
    }

    fn joint_lines(&self, summaries: &[(&str, usize, SourceSummary)]) -> Vec<Vec<String>> {
        let head = std::iter::once("joint, mm".to_owned()).chain(summaries.iter().map(|(name, ..)| (*name).to_owned()));
        let mut lines = vec![head.collect::<Vec<_>>()];
        for (joint, name) in self.skeleton.joints.iter().enumerate() {
            let of = |summary: &SourceSummary| {
                summary.truth.joint_mm(joint).map_or_else(|| "-".to_owned(), |mm| format!("{mm:.1}"))
            };
            lines.push(
                std::iter::once(name.clone()).chain(summaries.iter().map(|(_, _, summary)| of(summary))).collect(),
            );
        }
        lines
    }

    fn frame_lines(&self, order: Order) -> String {
        let mut rows: Vec<&PredictionRow> = self.rows.iter().collect();
        let by = |of: fn(&PredictionRow) -> Option<f64>| {
            move |row: &&PredictionRow| std::cmp::Reverse(of(row).map(|mm| (mm * 1000.0) as i64))
        };
        match order {
            Order::Frame => {}
            Order::Error => rows.sort_by_key(by(PredictionRow::error_mm)),
            Order::Disagreement => rows.sort_by_key(by(PredictionRow::disagreement_mm)),
        }
        let mm = |of: Option<&Comparison>| of.map_or_else(|| "-".to_owned(), |of| format!("{:.1}", of.errors.majpe_mm));
        let mut head = vec!["frame".to_owned()];
        if self.fit.is_some() {
            head.push("fit_majpe_mm".into());
        }
        for source in self.sources {
            head.push(format!("{}_majpe_mm", source.name));
            head.push(format!("{}_pa_mm", source.name));
            if self.fit.is_some() {
                head.push(format!("{}_to_fit_mm", source.name));
            }
        }
        let mut lines = vec![head];
        for row in rows.iter().take(SHOWN) {
            let mut cells = vec![row.frame.clone()];
            if self.fit.is_some() {
                cells.push(mm(row.reference.truth.as_ref()));
            }
            for of in &row.sources {
                cells.push(mm(of.truth.as_ref()));
                cells.push(
                    of.truth.as_ref().map_or_else(|| "-".to_owned(), |of| format!("{:.1}", of.errors.pa_majpe_mm)),
                );
                if self.fit.is_some() {
                    cells.push(mm(of.fit.as_ref()));
                }
            }
            lines.push(cells);
        }
        let mut text = aligned(&lines);
        if rows.len() > SHOWN {
            let _ = writeln!(text, "... and {} more frames", rows.len() - SHOWN);
        }
        text
    }

    fn json(&self) -> Value {
        let comparison = |of: &Option<Comparison>| {
            of.as_ref().map(|of| {
                let joints: serde_json::Map<String, Value> = of
                    .joints_mm
                    .iter()
                    .map(|(joint, mm)| (self.skeleton.joints[*joint].clone(), json!(mm)))
                    .collect();
                let e = of.errors;
                json!({ "majpe_mm": e.majpe_mm, "pa_majpe_mm": e.pa_majpe_mm, "ospa_mm": e.ospa_mm, "joints_mm": joints })
            })
        };
        let of_row = |row: &SourceRow| json!({ "people": row.persons, "truth": comparison(&row.truth), "fit": comparison(&row.fit) });
        let frames: Vec<Value> = self
            .rows
            .iter()
            .map(|row| {
                let sources: serde_json::Map<String, Value> =
                    self.sources.iter().zip(&row.sources).map(|(source, row)| (source.name.clone(), of_row(row))).collect();
                json!({ "frame": row.frame, "annotated": row.annotated, "fit": self.fit.map(|_| of_row(&row.reference)), "sources": sources })
            })
            .collect();
        let mut means = serde_json::Map::new();
        for (name, joints, of) in self.summaries() {
            let errors = |of: Option<crate::diagnose::JointErrors>| {
                of.map(|e| json!({ "majpe_mm": e.majpe_mm, "pa_majpe_mm": e.pa_majpe_mm, "ospa_mm": e.ospa_mm }))
            };
            let value = json!({
                "frames": of.frames, "missing": of.missing, "joints": joints,
                "truth": errors(of.truth.errors()), "fit": errors(of.fit.errors()),
            });
            means.insert(name.to_owned(), value);
        }
        json!({ "sources": means, "frames": frames })
    }
}

/// Columns two spaces apart, the first to the left, the others to the right.
fn aligned(lines: &[Vec<String>]) -> String {
    let lines: Vec<Vec<String>> =
        lines.iter().map(|line| line.iter().map(|cell| one_line(cell).into_owned()).collect()).collect();
    let columns = lines.first().map_or(0, Vec::len);
    let width =
        |k: usize| lines.iter().filter_map(|line| line.get(k)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for line in &lines {
        let cells = line
            .iter()
            .zip(&widths)
            .enumerate()
            .map(|(k, (cell, &width))| if k == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") });
        text.push_str(cells.collect::<Vec<_>>().join("  ").trim_end());
        text.push('\n');
    }
    text
}
