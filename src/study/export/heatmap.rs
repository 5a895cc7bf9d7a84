//! PPPR-Heatmap: H_sim in the place of H_ori, file by file, so that a model made for the data set reads it unchanged.
//!
//! A file keeps its place in the tree, its keys, each map's shape, dtype, byte and memory order; arrays that are no maps are copied,
//! and so are labels beside it. Of complex cubes the amplitude that is the map becomes H_sim, and the phases stay; of several
//! numbers a cell the ratios. H_sim is in units of its own: [`crate::representation::HeatmapScale::Match`] brings it to the input's. The manifest comes
//! last: where it is missing the copy is not complete.

use super::ExportError;
use super::layout::{MapFile, STRANGERS_PATTERN, Tree};
use crate::dataset::npz::{Fold, Form, NpzArchive, copy_with, shape_text};
use crate::dataset::{Dataset, MANIFEST_NAME, MapArray, Stored};
use crate::output::{FolderGuard, Inputs, replace_file, resolved};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Writes maps into a copy of a data set, frame by frame.
///
/// A stacked file (frames along the first axis of its arrays) is written once it is full, or by [`Self::finish`] with the frames
/// that were added and no others.
#[derive(Debug)]
pub struct HeatmapExport<'a> {
    dataset: &'a Dataset,
    inputs: &'a Inputs<'a>,
    tree: Tree<'a>,
    folder: FolderGuard,
    manifest: Option<PathBuf>,
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

impl<'a> HeatmapExport<'a> {
    /// Of `frames` into `folder`; the data set's manifest, or `manifest` where it was opened with another, goes with it. Nothing
    /// is written yet.
    ///
    /// # Errors
    /// Where the folder is the data set's own, or the files are such that no maps can be written in their form.
    pub fn new(
        dataset: &'a Dataset,
        inputs: &'a Inputs<'a>,
        folder: &Path,
        manifest: Option<&Path>,
        frames: &Range<usize>,
    ) -> Result<Self, ExportError> {
        let root = &dataset.info().root;
        let home = if root.is_dir() { root.as_path() } else { root.parent().unwrap_or(Path::new("")) };
        if matches!((resolved(home), resolved(folder)), (Ok(home), Ok(folder)) if home == folder) {
            return Err(ExportError::Itself { path: folder.to_owned() });
        }
        let own = home.join(MANIFEST_NAME);
        let manifest = manifest.map(Path::to_owned).or_else(|| (root.is_dir() && own.is_file()).then_some(own));
        let folder = FolderGuard::new(folder);
        let export = Self { dataset, inputs, tree: Tree::new(dataset), folder, manifest, stacked: BTreeMap::new() };
        export.check_whole_stacks(frames)?;
        export.check_forms(frames.start)?;
        Ok(export)
    }

    /// Where every reader expects all frames of a file.
    fn check_whole_stacks(&self, frames: &Range<usize>) -> Result<(), ExportError> {
        let Some(steps) = self.dataset.frames_a_file() else { return Ok(()) };
        if frames.start.is_multiple_of(steps) && frames.end.is_multiple_of(steps) {
            return Ok(());
        }
        Err(ExportError::Part { steps, frames: frames.clone(), path: self.dataset.info().root.clone() })
    }

    /// Whether maps can be written as the arrays of the first frame are. A frame that cannot be read is told of later.
    fn check_forms(&self, index: usize) -> Result<(), ExportError> {
        for file in self.tree.map_files(index) {
            let Ok(forms) = forms_of(&file) else { continue };
            for (array, form) in file.arrays.iter().zip(&forms) {
                let Some(view) = self.dataset.info().views.get(array.view) else { continue };
                let one = |axis| form.with_axis(axis, 1);
                let fits = match array.stored {
                    Stored::Numbers => {
                        form.stack_axis(view.axes.len()).map_or_else(|| form.clone(), one).fits(view.cells())
                    }
                    Stored::Amplitude { every, .. } => form.fits_amplitudes(view.cells(), every),
                    Stored::Folded { before, after, over } => {
                        form.fits_folded(view.cells(), Fold { before, cells: view.cells(), after, over })
                    }
                };
                fits.map_err(|reason| wrong(&file, array, form, reason))?;
            }
        }
        Ok(())
    }

    /// Takes the manifest of an earlier export away: from here on the folder is not complete.
    ///
    /// # Errors
    /// Where it is an input, or cannot be removed.
    pub fn begin(&self) -> Result<(), ExportError> {
        let old = self.folder.path().join(MANIFEST_NAME);
        self.inputs.check_replaced(&old)?;
        match std::fs::remove_file(&old) {
            Err(reason) if reason.kind() != std::io::ErrorKind::NotFound => Err(ExportError::writing(&old)(reason)),
            _ => Ok(()),
        }
    }

    /// Adds the maps of a frame, one a view, C order.
    ///
    /// # Errors
    /// Where the frame's file cannot be read, is no longer what it was, or the copy cannot be written.
    pub fn add(&mut self, index: usize, maps: &[Vec<f64>]) -> Result<(), ExportError> {
        for file in self.tree.map_files(index) {
            let forms = forms_of(&file)?;
            let maps: Vec<&Vec<f64>> = file.arrays.iter().filter_map(|array| maps.get(array.view)).collect();
            let axes = |array: &MapArray| self.dataset.info().views.get(array.view).map_or(0, |view| view.axes.len());
            let numbers = file.arrays.iter().all(|array| array.stored == Stored::Numbers);
            let mut arrays = forms.iter().zip(&file.arrays);
            if numbers && arrays.all(|(form, array)| form.stack_axis(axes(array)).is_some()) {
                self.stack(index, file, forms, maps)?;
            } else {
                let arrays = encoded(&file, &forms, maps.into_iter().map(Vec::as_slice))?;
                self.copy(&file, &arrays)?;
            }
        }
        self.tree.companions(index).iter().try_for_each(|(from, to)| self.copy_labels(from, to))
    }

    fn stack(
        &mut self,
        index: usize,
        file: MapFile,
        forms: Vec<Form>,
        maps: Vec<&Vec<f64>>,
    ) -> Result<(), ExportError> {
        let from = file.from.clone();
        let stack = self.stacked.entry(from.clone()).or_insert_with(|| Stack { file, forms, frames: BTreeMap::new() });
        stack.frames.insert(index, maps.into_iter().cloned().collect());
        if self.dataset.frames_a_file() != self.stacked.get(&from).map(|stack| stack.frames.len()) {
            return Ok(());
        }
        self.stacked.remove(&from).map_or(Ok(()), |full| self.write_stack(&full))
    }

    /// Writes what is stacked, labels of many frames, and where the export is `complete` the manifest.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub fn finish(mut self, complete: bool) -> Result<(), ExportError> {
        if self.dataset.frames_a_file().is_none() {
            let stacks = std::mem::take(&mut self.stacked);
            stacks.values().try_for_each(|stack| self.write_stack(stack))?;
        }
        self.tree.labels().iter().try_for_each(|(from, to)| self.copy_labels(from, to))?;
        match self.manifest.clone().filter(|_| complete) {
            Some(manifest) => self.write_manifest(&manifest),
            None => Ok(()),
        }
    }

    fn write_stack(&mut self, stack: &Stack) -> Result<(), ExportError> {
        let views = &self.dataset.info().views;
        let resized = |(form, array): (&Form, &MapArray)| {
            let axis = form.stack_axis(views.get(array.view).map_or(0, |view| view.axes.len()));
            axis.map_or_else(|| form.clone(), |axis| form.with_axis(axis, stack.frames.len()))
        };
        let forms: Vec<Form> = stack.forms.iter().zip(&stack.file.arrays).map(resized).collect();
        let whole: Vec<Vec<f64>> = (0..forms.len())
            .map(|k| stack.frames.values().filter_map(|arrays| arrays.get(k)).flatten().copied().collect())
            .collect();
        let arrays = encoded(&stack.file, &forms, whole.iter().map(Vec::as_slice))?;
        self.copy(&stack.file, &arrays)
    }

    fn copy(&mut self, file: &MapFile, arrays: &[(String, Vec<u8>)]) -> Result<(), ExportError> {
        let to = self.folder.place(&file.inside, self.inputs)?;
        Ok(copy_with(&file.from, &to, arrays)?)
    }

    fn copy_labels(&mut self, from: &Path, inside: &Path) -> Result<(), ExportError> {
        let to = self.folder.place(inside, self.inputs)?;
        let mut file = std::fs::File::open(from).map_err(ExportError::reading(from))?;
        replace_file(&to, |out| std::io::copy(&mut file, out).map(drop)).map_err(ExportError::writing(&to))
    }

    fn write_manifest(&mut self, from: &Path) -> Result<(), ExportError> {
        let mut text = std::fs::read_to_string(from).map_err(ExportError::reading(from))?;
        if self.tree.has_strangers() {
            let reading = |why: String| ExportError::reading(from)(std::io::Error::other(why));
            let mut table: toml::Table = text.parse().map_err(|error: toml::de::Error| reading(error.to_string()))?;
            table.insert("frames".into(), STRANGERS_PATTERN.into());
            text = toml::to_string(&table).map_err(|error| reading(error.to_string()))?;
        }
        let to = self.folder.place(Path::new(MANIFEST_NAME), self.inputs)?;
        replace_file(&to, |out| out.write_all(text.as_bytes())).map_err(ExportError::writing(&to))
    }
}

fn forms_of(file: &MapFile) -> Result<Vec<Form>, ExportError> {
    let mut archive = NpzArchive::open(&file.from)?;
    file.arrays.iter().map(|array| Ok(archive.form(&array.key)?)).collect()
}

fn wrong(file: &MapFile, array: &MapArray, form: &Form, reason: String) -> ExportError {
    ExportError::Form {
        key: array.key.clone(),
        form: format!("{} {}", form.dtype(), shape_text(form.shape())),
        reason,
        path: file.from.clone(),
    }
}

fn encoded<'m>(
    file: &MapFile,
    forms: &[Form],
    maps: impl Iterator<Item = &'m [f64]>,
) -> Result<Vec<(String, Vec<u8>)>, ExportError> {
    let arrays = file.arrays.iter().zip(forms).zip(maps);
    arrays
        .map(|((array, form), cells)| {
            let bytes = match array.stored {
                Stored::Numbers => form.encode(cells),
                Stored::Amplitude { every, first } => {
                    let measured = NpzArchive::open(&file.from)?.bytes(&array.key)?;
                    form.with_amplitudes(&measured, cells, every, first)
                }
                Stored::Folded { before, after, over } => {
                    let measured = NpzArchive::open(&file.from)?.bytes(&array.key)?;
                    form.with_folded(&measured, cells, Fold { before, cells: cells.len(), after, over })
                }
            };
            Ok((array.key.clone(), bytes.map_err(|reason| wrong(file, array, form, reason))?))
        })
        .collect()
}
