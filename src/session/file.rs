//! The session file: opens to the same frame, iteration, pins and view.
//!
//! JSON, `"format": "mhp-session"`, version 1. The fit on screen is kept as its rows and the states at its head and at the
//! iteration on screen, so that nothing is computed again and no later version can compute something else; simulated maps
//! are not kept, they follow from the states. Data are not copied: the data set is named by its path, absolute and relative
//! to the session file, and told from others by its fingerprint. What only the window knows (camera, layout) is kept in
//! `window` as the window gives it.

use super::breakpoints::StopPoint;
use super::compared::ResultSet;
use super::pins::PinRow;
use super::state::{FrameSummary, Session};
use super::view::ViewState;
use crate::body::Pppr;
use crate::condition::Breakpoint;
use crate::config::FitConfig;
use crate::input::read_bytes;
use crate::mhp::{ErasedCells, FitState, Precision};
use crate::output::replace_file;
use crate::predictions::Reading;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

const FORMAT: &str = "mhp-session";
const VERSION: u32 = 1;
/// A session file is small; a larger file is another one.
const MOST_BYTES: u64 = 256 << 20;

/// What can be wrong with a session file.
#[derive(Debug, thiserror::Error)]
pub enum SessionFileError {
    /// It cannot be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// It cannot be written.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// It is no session file, or a damaged one.
    #[error("{path}: no session file of version 1: {reason}", path = path.display())]
    Content {
        /// What was found or missing.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// Its data set is gone.
    #[error("{path}: its data set was at {dataset} and is there no more; open it where it is now", path = path.display(),
        dataset = dataset.display())]
    NoDataset {
        /// Where it was.
        dataset: PathBuf,
        /// The file.
        path: PathBuf,
    },
}

/// A session as it is kept.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SessionFile {
    format: String,
    version: u32,
    /// Version of the program that wrote it.
    pub program: String,
    /// Where the data set was.
    pub dataset: SavedDataset,
    /// The frame on screen.
    pub frame: SavedFrame,
    /// Settings, as `FIT.toml`.
    pub config: String,
    /// True for single precision.
    pub single_precision: bool,
    /// Start the next frame from the result of the one before.
    pub warm_start: bool,
    /// Starts are decided by the frames around, too.
    #[serde(default)]
    pub along: bool,
    /// How things are shown.
    pub view: ViewState,
    /// The filter of the frame list.
    pub filter: String,
    /// The selected joint.
    pub joint: Option<usize>,
    /// The fit on screen.
    pub fit: Option<SavedFit>,
    /// What the frame list knows of frames that were fitted in the session, by index.
    #[serde(default)]
    pub summaries: BTreeMap<usize, FrameSummary>,
    /// Shares of starts in the best basin, by frame.
    #[serde(default)]
    pub best_basins: BTreeMap<usize, f64>,
    /// Results A and B, where they were kept.
    #[serde(default)]
    pub results: [Option<ResultSet>; 2],
    /// Pinned fits.
    pub pins: Vec<SavedPin>,
    /// The pin that others are compared with, by its place in the list.
    pub baseline: Option<usize>,
    /// Where runs stop.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub breakpoints: Vec<StopPoint>,
    /// Files of predictions, as they were read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub predictions: Vec<SavedSource>,
    /// Camera, layout and zoom, as the window gives them.
    pub window: serde_json::Value,
}

/// A data set, found again by either path.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedDataset {
    /// From the root.
    #[serde(with = "crate::folders::portable_path")]
    pub absolute: PathBuf,
    /// From the session file's folder, where there is one that is text.
    pub relative: Option<PathBuf>,
    /// What it must be.
    pub fingerprint: String,
}

/// A file of predictions.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedSource {
    /// Where it was.
    #[serde(with = "crate::folders::portable_path")]
    pub path: PathBuf,
    /// How it was read.
    pub reading: Reading,
}

/// A frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedFrame {
    /// Its name.
    pub path: String,
    /// Its index; a hint.
    pub index: usize,
}

/// A fit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedFit {
    /// The pose that fixes the EM region.
    pub initial: Pppr,
    /// Every iteration.
    pub rows: Vec<PinRow>,
    /// The states at the head and at the iteration on screen.
    pub states: Vec<FitState>,
    /// An earlier iteration that is looked at.
    pub cursor: Option<usize>,
    /// Settings at the first iteration, as `FIT.toml`.
    pub config: String,
    /// Where they were changed, ascending.
    #[serde(default)]
    pub changes: Vec<SavedChange>,
    /// Parameters were edited by hand.
    pub edited: bool,
    /// Cells that the fit does not see.
    #[serde(default)]
    pub erased: Vec<ErasedCells>,
    /// Iterations at which a breakpoint stopped it, and which one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stops: Vec<(usize, String)>,
}

/// A change of settings along the lineage.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedChange {
    /// The last iteration with the old ones.
    pub after: usize,
    /// The new ones, as `FIT.toml`.
    pub config: String,
}

/// A pinned fit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedPin {
    /// Its name.
    pub name: String,
    /// Its frame.
    pub frame: SavedFrame,
    /// Settings, as `FIT.toml`.
    pub config: String,
    /// True for single precision.
    pub single_precision: bool,
    /// The pose that fixes the EM region.
    pub initial: Pppr,
    /// The parameters.
    pub params: Pppr,
    /// Every iteration up to it.
    pub rows: Vec<PinRow>,
}

impl SavedSource {
    fn of(source: &super::sources::Source) -> Self {
        let of = &source.predictions;
        let path = std::path::absolute(&of.path).unwrap_or_else(|_| of.path.clone());
        Self { path, reading: Reading { name: Some(of.name.clone()), colour: source.colour, ..of.reading.clone() } }
    }
}

impl SessionFile {
    /// The session as it is now; `window` is what only the window knows. `None` without a data set.
    pub fn of(session: &Session, window: serde_json::Value) -> Option<Self> {
        let dataset = session.data.dataset.as_ref()?;
        let root = &dataset.info().root;
        let frame = |index: usize| SavedFrame { path: dataset.frame_name(index).to_owned(), index };
        let pins = &session.pins;
        Some(Self {
            format: FORMAT.into(),
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").into(),
            dataset: SavedDataset {
                absolute: std::path::absolute(root).unwrap_or_else(|_| root.clone()),
                relative: None,
                fingerprint: dataset.fingerprint().to_owned(),
            },
            frame: frame(session.data.frame_index),
            config: session.config.to_toml(),
            single_precision: session.precision == Precision::F32,
            warm_start: session.warm_start,
            along: session.along,
            view: session.view.clone(),
            filter: session.queue.text.clone(),
            joint: session.joint,
            fit: saved_fit(session),
            // Rows of a table of results are not the session's own; the table has them.
            summaries: session
                .summaries
                .iter()
                .filter(|(_, summary)| summary.hashes.is_some())
                .map(|(&frame, summary)| (frame, summary.clone()))
                .collect(),
            best_basins: (*session.best_basins).clone(),
            results: session.results.saved(),
            pins: pins
                .list()
                .iter()
                .map(|pin| SavedPin {
                    name: pin.name.clone(),
                    frame: SavedFrame { path: pin.frame_name.clone(), index: pin.frame },
                    config: pin.config.to_toml(),
                    single_precision: pin.precision == Precision::F32,
                    initial: pin.initial.clone(),
                    params: pin.params.clone(),
                    rows: pin.rows.clone(),
                })
                .collect(),
            baseline: pins.baseline().and_then(|base| pins.list().iter().position(|pin| pin.id == base.id)),
            breakpoints: session.breakpoints.list().to_vec(),
            predictions: session.sources.list().iter().map(SavedSource::of).collect(),
            window,
        })
    }

    /// Writes the file, replacing an older one as a whole.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write(mut self, path: &Path) -> Result<(), SessionFileError> {
        let failed = |reason| SessionFileError::Write { reason, path: path.to_owned() };
        let absolute = std::path::absolute(path).map_err(failed)?;
        let relative = absolute.parent().and_then(|folder| relative_path(folder, &self.dataset.absolute));
        self.dataset.relative = relative.filter(|relative| relative.to_str().is_some());
        let text = serde_json::to_vec(&self).map_err(|error| failed(error.into()))?;
        replace_file(path, |out| out.write_all(&text)).map_err(failed)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// Where it cannot be read, is no session file, or of a newer version.
    pub fn read(path: &Path) -> Result<Self, SessionFileError> {
        let failed = |reason| SessionFileError::Read { reason, path: path.to_owned() };
        let wrong = |reason: String| SessionFileError::Content { reason, path: path.to_owned() };
        let text = read_bytes(path, "a session file", MOST_BYTES).map_err(failed)?;
        let head: Head = serde_json::from_slice(&text).map_err(|error| wrong(error.to_string()))?;
        if head.format != FORMAT {
            return Err(wrong(format!("`format` is {:?}; expected \"{FORMAT}\"", head.format)));
        }
        if head.version != VERSION {
            return Err(wrong(format!("`version` is {}; this program reads {VERSION}", head.version)));
        }
        let file: Self = serde_json::from_slice(&text).map_err(|error| wrong(error.to_string()))?;
        for point in &file.breakpoints {
            let parsed = point.text.parse::<Breakpoint>();
            parsed.map_err(|error| wrong(format!("`breakpoints`: {error}")))?;
        }
        for config in file.configs() {
            FitConfig::parse(config, path).map_err(|error| wrong(format!("`config`: {error}")))?;
        }
        Ok(file)
    }

    fn configs(&self) -> impl Iterator<Item = &str> {
        let changes = self.fit.iter().flat_map(|fit| fit.changes.iter().map(|change| change.config.as_str()));
        let fit = self.fit.iter().map(|fit| fit.config.as_str()).chain(changes);
        std::iter::once(self.config.as_str()).chain(fit).chain(self.pins.iter().map(|pin| pin.config.as_str()))
    }

    /// Where the data set is now.
    ///
    /// # Errors
    /// Where it is at neither of its paths.
    pub fn dataset_path(&self, file: &Path) -> Result<PathBuf, SessionFileError> {
        let beside = self.dataset.relative.as_ref().and_then(|relative| {
            let joined: PathBuf = file.parent()?.join(relative).components().collect();
            // A way up and down again is kept by what it leads to: the next session file begins elsewhere.
            let up = joined.components().any(|part| part == Component::ParentDir);
            Some(if up { joined.canonicalize().unwrap_or(joined) } else { joined })
        });
        let found = beside.into_iter().chain([self.dataset.absolute.clone()]).find(|path| path.exists());
        let gone = || SessionFileError::NoDataset { dataset: self.dataset.absolute.clone(), path: file.to_owned() };
        found.ok_or_else(gone)
    }
}

#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    format: String,
    #[serde(default)]
    version: u32,
}

fn saved_fit(session: &Session) -> Option<SavedFit> {
    let fit = &session.fit;
    let (branch, initial) = (fit.branch()?, fit.region_pose()?.clone());
    let head = branch.state_at(branch.head()).filter(|(at, _)| *at == branch.head())?.1;
    let shown = fit.cursor.and_then(|at| branch.state_at(at)).filter(|(at, _)| *at != branch.head());
    let rows = fit.history.lineage().into_iter().flatten();
    let (config, changes) = fit.history.lineage_settings()?;
    let changes = changes.into_iter().map(|(after, config)| SavedChange { after, config: config.to_toml() });
    Some(SavedFit {
        initial,
        rows: rows.map(|row| PinRow { report: row.report.clone(), majpe_mm: row.majpe_mm }).collect(),
        states: std::iter::once(head).chain(shown.map(|(_, state)| state)).map(|state| (**state).clone()).collect(),
        cursor: shown.map(|(at, _)| at),
        config: config.to_toml(),
        changes: changes.collect(),
        edited: fit.edited,
        erased: branch.erased.to_vec(),
        stops: fit.history.lineage_stops(),
    })
}

/// The relative path from a folder to a path that share a beginning.
fn relative_path(from: &Path, to: &Path) -> Option<PathBuf> {
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if common < 2 {
        return None;
    }
    let up = from.components().skip(common).map(|_| std::path::Component::ParentDir);
    Some(up.chain(to.components().skip(common)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_to_the_data_goes_up_and_down() {
        let relative_path = |from: &str, to: &str| relative_path(Path::new(from), Path::new(to));
        assert_eq!(relative_path("/a/b/c", "/a/d"), Some("../../d".into()));
        assert_eq!(relative_path("/a/b", "/a/b/data"), Some("data".into()));
        assert_eq!(relative_path("/a", "/b"), None);
    }
}
