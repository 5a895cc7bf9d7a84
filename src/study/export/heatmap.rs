//! PPPR-Heatmap: H_sim in the place of H_ori, file by file, so that a model made for the data set reads it unchanged.
//!
//! A file keeps its name, its keys, each map's shape, dtype, byte and memory order; arrays that are no maps are copied, and so
//! are labels beside it. H_sim is in units of its own: [`MapScale::Match`] brings it to the input's.

use super::ExportError;
use super::layout::{MapFile, inside, map_files};
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::npz::{Form, NpzArchive, copy_with, shape_text};
use crate::dataset::{Dataset, MANIFEST_NAME};
use crate::mhp::{Objective, Precision, Problem, masks, simulate};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What becomes of the values of H_sim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapScale {
    /// One factor a view: the mean of H_ori over its mask by that of H_sim over its own; then nothing below the smallest
    /// value of H_ori, so that a logarithm of the map stays in the input's range.
    Match,
    /// As computed.
    None,
}

/// H_sim of every view at `params`, C order, in the scale asked for.
///
/// # Errors
/// Where `params` have the wrong sizes or are not finite.
pub fn scaled_maps(
    problem: &Arc<Problem>,
    config: &FitConfig,
    precision: Precision,
    params: &Pppr,
    scale: MapScale,
) -> Result<Vec<Vec<f64>>, ExportError> {
    let mut maps = simulate(problem, config, precision, params);
    if scale == MapScale::None {
        return Ok(maps);
    }
    let objective = Objective::new(Arc::clone(problem), *config, precision, params)
        .map_err(|reason| ExportError::Fit { reason: reason.to_string() })?;
    for (view, map) in maps.iter_mut().enumerate() {
        let masks = masks(&objective, view, map);
        let input = problem.map(view);
        let factor = masked_mean(input, &masks.ori) / masked_mean(map, &masks.sim);
        let factor = if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        let least = input.iter().copied().fold(f64::INFINITY, f64::min);
        for cell in map.iter_mut() {
            *cell = (*cell * factor).max(least);
        }
    }
    Ok(maps)
}

fn masked_mean(map: &[f64], mask: &[bool]) -> f64 {
    let (sum, count) =
        map.iter().zip(mask).filter(|(_, inside)| **inside).fold((0.0, 0_usize), |(s, n), (x, _)| (s + x, n + 1));
    sum / count as f64
}

/// Writes maps into a copy of a data set, frame by frame.
///
/// A stacked file (frames along the first axis of its arrays) is written by [`Self::finish`], with the frames that were added
/// and no others.
#[derive(Debug)]
pub struct HeatmapExport {
    folder: PathBuf,
    stacked: BTreeMap<PathBuf, Stack>,
}

/// The frames of a stacked file that were added so far.
#[derive(Debug)]
struct Stack {
    file: MapFile,
    forms: Vec<Form>,
    /// Cells of each array by frame.
    frames: BTreeMap<usize, Vec<Vec<f64>>>,
}

impl HeatmapExport {
    /// Into `folder`, which is made; the data set's manifest, or `manifest` where it was opened with another, goes with it.
    ///
    /// # Errors
    /// Where the folder cannot be written, or is the data set's own.
    pub fn create(dataset: &Dataset, folder: &Path, manifest: Option<&Path>) -> Result<Self, ExportError> {
        std::fs::create_dir_all(folder).map_err(ExportError::writing(folder))?;
        let root = &dataset.info().root;
        let home = if root.is_dir() { root.clone() } else { root.parent().unwrap_or(Path::new(".")).to_owned() };
        let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
        if same(&home, folder) {
            return Err(ExportError::Itself { path: folder.to_owned() });
        }
        let own = home.join(MANIFEST_NAME);
        let manifest = manifest.map(Path::to_owned).or_else(|| (root.is_dir() && own.is_file()).then_some(own));
        if let Some(manifest) = manifest {
            let to = folder.join(MANIFEST_NAME);
            std::fs::copy(&manifest, &to).map_err(ExportError::writing(&to))?;
        }
        Ok(Self { folder: folder.to_owned(), stacked: BTreeMap::new() })
    }

    /// Adds the maps of a frame, one a view, C order.
    ///
    /// # Errors
    /// Where the frame's file cannot be read, is no longer what it was, or the copy cannot be written.
    pub fn add(&mut self, dataset: &Dataset, index: usize, maps: &[Vec<f64>]) -> Result<Vec<PathBuf>, ExportError> {
        let mut written = Vec::new();
        for file in map_files(dataset, index) {
            let mut archive = NpzArchive::open(&file.from)?;
            let forms = file.arrays.iter().map(|(key, _)| archive.form(key)).collect::<Result<Vec<_>, _>>()?;
            drop(archive);
            let maps: Vec<&Vec<f64>> = file.arrays.iter().filter_map(|&(_, view)| maps.get(view)).collect();
            let axes = |k: &(String, usize)| dataset.info().views.get(k.1).map_or(0, |view| view.axes.len());
            let is_stacked = forms.iter().zip(&file.arrays).all(|(form, array)| form.shape().len() == axes(array) + 1);
            if is_stacked {
                let cells = maps.into_iter().cloned().collect();
                let stack = self.stacked.entry(file.from.clone());
                let stack = stack.or_insert_with(|| Stack { file, forms, frames: BTreeMap::new() });
                stack.frames.insert(index, cells);
            } else {
                let arrays = encoded(&file, &forms, maps.into_iter().map(Vec::as_slice))?;
                written.push(self.copy(&file, &arrays)?);
            }
        }
        Ok(written)
    }

    /// Writes what is stacked; the files.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub fn finish(self) -> Result<Vec<PathBuf>, ExportError> {
        self.stacked.values().map(|stack| self.write_stack(stack)).collect()
    }

    fn write_stack(&self, stack: &Stack) -> Result<PathBuf, ExportError> {
        let forms: Vec<Form> = stack.forms.iter().map(|form| form.with_first_axis(stack.frames.len())).collect();
        let whole: Vec<Vec<f64>> = (0..forms.len())
            .map(|k| stack.frames.values().filter_map(|arrays| arrays.get(k)).flatten().copied().collect())
            .collect();
        self.copy(&stack.file, &encoded(&stack.file, &forms, whole.iter().map(Vec::as_slice))?)
    }

    fn copy(&self, file: &MapFile, arrays: &[(String, Vec<u8>)]) -> Result<PathBuf, ExportError> {
        let to = self.folder.join(&file.inside);
        let home = to.parent().unwrap_or(&self.folder);
        std::fs::create_dir_all(home).map_err(ExportError::writing(home))?;
        copy_with(&file.from, &to, arrays)?;
        for companion in &file.companions {
            let beside = home.join(inside(file.from.parent().unwrap_or(Path::new("")), companion));
            std::fs::copy(companion, &beside).map_err(ExportError::writing(&beside))?;
        }
        Ok(to)
    }
}

fn encoded<'a>(
    file: &MapFile,
    forms: &[Form],
    maps: impl Iterator<Item = &'a [f64]>,
) -> Result<Vec<(String, Vec<u8>)>, ExportError> {
    let arrays = file.arrays.iter().zip(forms).zip(maps);
    arrays
        .map(|(((key, _), form), cells)| {
            let wrong = |reason: String| ExportError::Form {
                key: key.clone(),
                form: format!("{} {}", form.dtype(), shape_text(form.shape())),
                reason,
                path: file.from.clone(),
            };
            Ok((key.clone(), form.encode(cells).map_err(wrong)?))
        })
        .collect()
}
