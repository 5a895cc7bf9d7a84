//! Statistics on disk: one npz for each data set, views and options, in the user's cache folder.
//!
//! `head` is a JSON text that says what the rest belongs to, version included; `keys` (rows, 2) names each frame by the
//! hash of its window of files, in two whole numbers below 2⁴⁸; `statistics` (rows, 3) are peak density, static dominance
//! and human saliency, NaN where undefined; `failures` is a JSON object of row to reason. The archive's checksums tell a
//! damaged file, which is then ignored. A file is replaced in one step, so that two programs at once leave one of two whole
//! files; what the other one knew is computed again. The folder is kept to 200 files and 256 MiB (`prune.rs`).

use super::prune::{prune, touch};
use super::stamps::Key;
use super::{ComplexityOptions, Statistics};
use crate::dataset::Dataset;
use crate::dataset::npz::{ArrayView, NpzArchive, NpzError, write};
use crate::digest;
use crate::folders;
use serde_json::json;
use sha2::{Digest as _, Sha256};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Counts the formats and the definitions: a file of another version is never looked at.
const VERSION: u32 = 1;
/// Reasons that are kept; frames beyond are read again next time. A data set with more is broken as a whole.
const MAX_FAILURES: usize = 10_000;

/// Two jobs of one program would write through one temporary file.
static WRITING: Mutex<()> = Mutex::new(());

/// What is kept of a frame: its statistics, or why it cannot be read.
pub(super) type CachedStatistics = Result<Statistics, String>;

/// The user's folder of cached statistics; `None` where there is no home.
pub fn cache_folder() -> Option<PathBuf> {
    folders::user_cache().map(|cache| cache.join("complexity"))
}

/// The share of the data set's frames, 0..1, for which `folder` holds statistics with these options, told from the head of
/// one file: no frame is looked at, so some may have changed since. With 1.0 [`super::compute`] only asks the files for
/// their sizes and times.
pub fn cached_share(dataset: &Dataset, options: &ComplexityOptions, folder: Option<&Path>) -> f64 {
    let rows = folder.and_then(|folder| CacheFile::new(folder, dataset, options).rows().ok()).unwrap_or(0);
    (rows as f64 / dataset.len().max(1) as f64).min(1.0)
}

/// One file of the cache; it need not exist.
#[derive(Debug)]
pub(super) struct CacheFile {
    path: PathBuf,
    head: String,
}

impl CacheFile {
    /// The file in `folder` of this data set and these options.
    pub(super) fn new(folder: &Path, dataset: &Dataset, options: &ComplexityOptions) -> Self {
        let info = dataset.info();
        let root = info.root.canonicalize().unwrap_or_else(|_| info.root.clone());
        let views: Vec<_> = info.views.iter().map(|view| json!([view.array, view.shape()])).collect();
        let head = json!({
            "version": VERSION,
            "root": root.to_string_lossy(),
            "layout": info.layout.word(),
            "views": views,
            "kappa_pct": options.kappa_pct,
            "window": options.window,
            "tau_pct": options.tau_pct,
        });
        let head = head.to_string();
        let name = digest::short(Sha256::new_with_prefix(&head));
        Self { path: folder.join(format!("{name}.npz")), head }
    }

    /// How many frames it holds, from the headers alone.
    fn rows(&self) -> Result<usize, NpzError> {
        let mut file = NpzArchive::open(&self.path)?;
        self.check_head(&mut file)?;
        Ok(file.entry("keys")?.shape.first().copied().unwrap_or(0))
    }

    fn corrupt(&self, key: &str, message: &str) -> NpzError {
        NpzError::Corrupt { key: key.into(), message: message.into(), path: self.path.clone() }
    }

    fn check_head(&self, file: &mut NpzArchive) -> Result<(), NpzError> {
        let same = file.read_texts("head")?.first() == Some(&self.head);
        if same { Ok(()) } else { Err(self.corrupt("head", "it belongs to another data set")) }
    }

    /// All that it holds; nothing where it does not exist, or with a warning where it cannot be read.
    pub(super) fn read(&self) -> HashMap<Key, CachedStatistics> {
        match self.try_read() {
            Ok(kept) => {
                touch(&self.path);
                kept
            }
            Err(error) if error.is_not_found() => HashMap::new(),
            Err(error) => {
                tracing::warn!("cached statistics are ignored: {error}");
                HashMap::new()
            }
        }
    }

    fn try_read(&self) -> Result<HashMap<Key, CachedStatistics>, NpzError> {
        let mut file = NpzArchive::open(&self.path)?;
        self.check_head(&mut file)?;
        let (keys, statistics) = (file.read("keys")?, file.read("statistics")?);
        let rows = keys.shape.first().copied().unwrap_or(0);
        if keys.shape != [rows, 2] || statistics.shape != [rows, 3] {
            return Err(self.corrupt("statistics", "its shape does not fit that of `keys`"));
        }
        let failures = file.read_texts("failures")?.concat();
        let failures: BTreeMap<usize, String> =
            serde_json::from_str(&failures).map_err(|error| self.corrupt("failures", &error.to_string()))?;
        let pairs = keys.data.as_chunks::<2>().0.iter().zip(statistics.data.as_chunks::<3>().0).enumerate();
        let mut kept = HashMap::with_capacity(rows);
        for (row, (key, numbers)) in pairs {
            if numbers.iter().any(|x| x.is_infinite()) {
                return Err(self.corrupt("statistics", "a number is infinite"));
            }
            let [peak_density, static_dominance, human_saliency] = numbers.map(|x| Some(x).filter(|x| !x.is_nan()));
            let statistics = Statistics { peak_density, static_dominance, human_saliency };
            kept.insert(Key(key.map(|half| half as u64)), failures.get(&row).cloned().map_or(Ok(statistics), Err));
        }
        Ok(kept)
    }

    /// Replaces the file by these frames. That it cannot be written is a warning: everything can be computed again.
    pub(super) fn write<'a>(&self, frames: impl Iterator<Item = (Key, &'a CachedStatistics)>) {
        let (mut keys, mut statistics, mut failures) = (Vec::new(), Vec::new(), BTreeMap::new());
        for (Key(key), kept) in frames {
            let numbers = match kept {
                Ok(s) => [s.peak_density, s.static_dominance, s.human_saliency],
                Err(_) if failures.len() >= MAX_FAILURES => continue,
                Err(why) => {
                    failures.insert(keys.len() / 2, why);
                    [None; 3]
                }
            };
            keys.extend(key.map(|half| half as f64));
            statistics.extend(numbers.map(|x| x.unwrap_or(f64::NAN)));
        }
        let failures = json!(failures).to_string();
        let rows = keys.len() / 2;
        let arrays = [
            ("head", ArrayView::text(&self.head)),
            ("keys", ArrayView::f64(&[rows, 2], &keys)),
            ("statistics", ArrayView::f64(&[rows, 3], &statistics)),
            ("failures", ArrayView::text(&failures)),
        ];
        let _one_at_a_time = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(Err(error)) = self.path.parent().map(std::fs::create_dir_all) {
            tracing::warn!("{}: cannot be written, statistics are not kept: {error}", self.path.display());
        } else if let Err(error) = write(&self.path, &arrays) {
            tracing::warn!("statistics are not kept: {error}");
        } else if let Some(folder) = self.path.parent() {
            prune(folder, &self.path);
        }
    }
}
