//! One frame of an export.

use super::{CloudFormat, ExportArgs, What};
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::{Dataset, read_pppr, write_pppr};
use crate::mhp::{Precision, Problem};
use crate::people::{CfarOptions, detect};
use crate::start::problem_of;
use crate::study::{
    BatchOptions, ExportError, fit_frame, point_cloud, scaled_maps, write_cloud_npz, write_cloud_pcd, write_cloud_ply,
};
use std::path::Path;
use std::sync::Arc;

/// Points of a view at most, those highest above their threshold.
const MOST_POINTS: usize = 2048;

/// What is left to write of a frame: its maps go into files that frames may share.
pub(super) struct Exported {
    /// H_sim of each view; empty where no maps are wanted.
    pub(super) maps: Vec<Vec<f64>>,
}

/// Fits frame `index` or reads its parameters, and writes what has files of its own.
///
/// # Errors
/// In one line that names the file.
pub(super) fn export_frame(
    args: &ExportArgs,
    config: &FitConfig,
    dataset: &Dataset,
    index: usize,
) -> Result<Exported, String> {
    let in_file = |error: &dyn std::fmt::Display| format!("{}: {error}", dataset.frame_path(index).display());
    let precision: Precision = args.precision.into();
    let name = dataset.frame_name(index).replace(['/', '\\'], "_");
    let params = params(args, config, dataset, index, &name)?;
    if args.wants(What::Pppr) {
        let file = args.out.join("pppr").join(format!("{name}.npz"));
        write_pppr(&file, &params).map_err(|error| error.to_string())?;
    }
    if !args.wants(What::Heatmap) && !args.wants(What::Pc) {
        return Ok(Exported { maps: Vec::new() });
    }
    let problem = problem(dataset, index)?;
    problem.check(&params).map_err(|error| in_file(&error))?;
    let maps = scaled_maps(&problem, config, precision, &params, args.scale()).map_err(|error| in_file(&error))?;
    if args.wants(What::Pc) {
        let points = point_cloud(&problem, config, &params, &maps, &detections(&problem, &maps));
        for format in &args.format {
            let file = |ending: &str| args.out.join("pc").join(format!("{name}.{ending}"));
            write_cloud(*format, file, &points).map_err(|error| error.to_string())?;
        }
    }
    Ok(Exported { maps })
}

/// The detector's cells in the map of each view; none where a view tells no place.
fn detections(problem: &Problem, maps: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let of_view = problem.views.iter().zip(maps);
    let options = CfarOptions { spacing_m: 0.0, most: MOST_POINTS, ..CfarOptions::default() };
    let found = of_view.map(|(view, map)| detect(view, map, &options).unwrap_or_default());
    found.map(|found| found.iter().map(|detection| detection.cell).collect()).collect()
}

fn write_cloud(
    format: CloudFormat,
    file: impl Fn(&str) -> std::path::PathBuf,
    points: &[crate::study::CloudPoint],
) -> Result<(), ExportError> {
    match format {
        CloudFormat::Npz => write_cloud_npz(&file("npz"), points),
        CloudFormat::Ply => write_cloud_ply(&file("ply"), points),
        CloudFormat::Pcd => write_cloud_pcd(&file("pcd"), points),
    }
}

fn params(args: &ExportArgs, config: &FitConfig, dataset: &Dataset, index: usize, name: &str) -> Result<Pppr, String> {
    if let Some(folder) = &args.params {
        return read_params(folder, name, index);
    }
    let options = BatchOptions {
        config: *config,
        precision: args.precision.into(),
        warm_start: false,
        params_folder: None,
        ply: false,
        curves_folder: None,
    };
    fit_frame(dataset, index, &options, None).map(|fit| fit.params)
}

/// As `fit --out` names them: with the index where two names would be one.
fn read_params(folder: &Path, name: &str, index: usize) -> Result<Pppr, String> {
    let numbered = folder.join(format!("{name}_{index}.npz"));
    let file = if numbered.is_file() { numbered } else { folder.join(format!("{name}.npz")) };
    read_pppr(&file, None).map_err(|error| error.to_string())
}

fn problem(dataset: &Dataset, index: usize) -> Result<Arc<Problem>, String> {
    let frame = dataset.load(index).map_err(|error| error.to_string())?;
    problem_of(dataset, &frame)
        .map(Arc::new)
        .map_err(|error| format!("{}: {error}", dataset.frame_path(index).display()))
}
