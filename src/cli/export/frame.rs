//! One frame of an export.

use super::{CLOUDS, CloudFormat, Job, PARAMS, What};
use crate::body::Pppr;
use crate::dataset::{Dataset, read_pppr, write_pppr};
use crate::mhp::{Precision, Problem};
use crate::representation::{CLOUD_POINTS, CloudPoint, detected_cells, point_cloud, pppr_heatmap};
use crate::start::problem_of;
use crate::study::{BatchOptions, fit_frame, write_cloud_npz, write_cloud_pcd, write_cloud_ply};
use std::path::PathBuf;
use std::sync::Arc;

/// What is left to write of a frame: its maps go into files that frames may share.
pub(super) struct Exported {
    /// H_sim of each view; empty where no maps are wanted.
    pub(super) maps: Vec<Vec<f64>>,
}

impl Job<'_> {
    /// Fits frame `index` or reads its parameters, and writes what has files of its own.
    ///
    /// # Errors
    /// In one line that names the file.
    pub(super) fn frame(&self, index: usize) -> Result<Exported, String> {
        let Job { args, dataset, .. } = self;
        let in_file = |error: &dyn std::fmt::Display| format!("{}: {error}", dataset.frame_path(index).display());
        let precision: Precision = args.precision.into();
        let params = self.params(index)?;
        if args.wants(What::Pppr) {
            let file = self.file(index, PARAMS, "npz")?;
            write_pppr(&file, &params).map_err(|error| error.to_string())?;
        }
        if !args.wants(What::Heatmap) && !args.wants(What::Pc) {
            return Ok(Exported { maps: Vec::new() });
        }
        let problem = problem(dataset, index)?;
        problem.check(&params).map_err(|error| in_file(&error))?;
        let maps =
            pppr_heatmap(&problem, &self.config, precision, &params, args.scale()).map_err(|error| in_file(&error))?;
        if args.wants(What::Pc) {
            let points =
                point_cloud(&problem, &self.config, &params, &maps, &detected_cells(&problem, &maps, CLOUD_POINTS));
            for format in &args.format {
                self.write_cloud(*format, index, &points)?;
            }
        }
        Ok(Exported { maps })
    }

    /// The file of results of a frame, which is no input.
    fn file(&self, index: usize, folder: &str, ending: &str) -> Result<PathBuf, String> {
        let name = self.names.of(index, self.dataset.frame_name(index));
        let file = self.args.out.join(folder).join(format!("{name}.{ending}"));
        self.inputs.check_replaced(&file).map_err(|error| error.to_string())?;
        Ok(file)
    }

    fn write_cloud(&self, format: CloudFormat, index: usize, points: &[CloudPoint]) -> Result<(), String> {
        let file = |ending| self.file(index, CLOUDS, ending);
        let written = match format {
            CloudFormat::Npz => write_cloud_npz(&file("npz")?, points),
            CloudFormat::Ply => write_cloud_ply(&file("ply")?, points),
            CloudFormat::Pcd => write_cloud_pcd(&file("pcd")?, points),
        };
        written.map_err(|error| error.to_string())
    }

    fn params(&self, index: usize) -> Result<Pppr, String> {
        if let Some(folder) = &self.args.params {
            let name = self.names.of(index, self.dataset.frame_name(index));
            return read_pppr(&folder.join(format!("{name}.npz")), None).map_err(|error| error.to_string());
        }
        let options = BatchOptions {
            config: self.config,
            precision: self.args.precision.into(),
            warm_start: false,
            params_folder: None,
            ply: false,
            curves_folder: None,
            ..BatchOptions::default()
        };
        fit_frame(self.dataset, index, &options, None).map(|fit| fit.params)
    }
}

fn problem(dataset: &Dataset, index: usize) -> Result<Arc<Problem>, String> {
    let frame = dataset.load(index).map_err(|error| error.to_string())?;
    problem_of(dataset, &frame)
        .map(Arc::new)
        .map_err(|error| format!("{}: {error}", dataset.frame_path(index).display()))
}
