//! `run.toml`: what a run is. Two runs with the same specification give the same rows, on any machine, in any number of
//! shards; a folder is gone on with only where its specification is the one asked for.

use super::super::FileError;
use super::error::RunError;
use super::kind::StudyKind;
use super::output::TABLE_FILE;
use super::paper;
use super::variant::Variant;
use crate::digest;
use crate::input::{MOST_TEXT, read_text};
use crate::mhp::{ErasedCells, Precision};
use crate::output::replace_file;
use crate::study::shard::{DataSpec, Difference, Part, Shard};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};

/// The name of the file in a run folder.
pub const RUN_FILE: &str = "run.toml";

/// One part of a specification, in words.
type Told<'a> = &'a dyn Fn(&RunSpec) -> String;

/// Everything that the rows of a run depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSpec {
    /// [`Self::digest`] as the program that began the run computed it: a later one may know more settings.
    pub id: String,
    /// Which study.
    pub study: StudyKind,
    /// Of this program.
    pub version: String,
    /// Scalar of the per-cell kernel.
    pub precision: Precision,
    /// Name of the preset that the variants build on, or the configuration's file.
    pub base: String,
    /// Seed of the perturbations.
    pub seed: u64,
    /// Which part of the run this folder holds; absent for the whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// Heads of the label columns.
    pub columns: Vec<String>,
    /// The data.
    pub data: DataSpec,
    /// Cells that no fit sees.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub erased: Vec<ErasedCells>,
    /// What is compared, in the order of the table.
    #[serde(rename = "variant")]
    pub variants: Vec<Variant>,
}

impl RunSpec {
    /// The file of a run folder.
    ///
    /// # Errors
    /// Where it cannot be read or is not one.
    pub fn read(folder: &Path) -> Result<Self, RunError> {
        let file = folder.join(RUN_FILE);
        let text = read_text(&file, "what a run is (TOML)", MOST_TEXT).map_err(FileError::reading(&file))?;
        let wrong = |message: String| FileError::Damaged { message, path: file.clone() };
        let spec: Self = toml::from_str(&text).map_err(|error| wrong(error.message().replace('\n', "; ")))?;
        let lengths = spec.variants.iter().all(|variant| variant.labels.len() == spec.columns.len());
        if spec.variants.is_empty() || !lengths {
            return Err(wrong("expected one [[variant]] or more, with a label for each of `columns`".into()).into());
        }
        Ok(spec)
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), RunError> {
        let file = folder.join(RUN_FILE);
        let text = toml::to_string(self).map_err(|error| FileError::Damaged {
            message: format!("cannot be written: {error}"),
            path: file.clone(),
        })?;
        let head =
            format!("# mhp-inspector study {}; `table.md` is its table, `rows.csv` a row a frame.\n", self.study);
        Ok(replace_file(&file, |out| out.write_all((head + &text).as_bytes())).map_err(FileError::writing(&file))?)
    }

    /// Names the run: 16 hexadecimal digits over everything but where the data lay.
    pub fn digest(&self) -> String {
        let mut spec = self.clone();
        spec.id = String::new();
        spec.data.root = PathBuf::new();
        digest::short(Sha256::new_with_prefix(serde_json::to_string(&spec).unwrap_or_default()))
    }

    /// Which cells no fit sees, in words.
    fn erased_told(&self) -> String {
        let one = |cells: &ErasedCells| format!("{} of view {} in {:?}", cells.count(), cells.view, cells.bins);
        let all: Vec<String> = self.erased.iter().map(one).collect();
        if all.is_empty() { "none".into() } else { all.join(", ") }
    }

    /// What the paper's figures beside ours are of; `None` where there are none.
    pub fn paper(&self) -> Option<String> {
        paper::told(self.study, &self.data.layout)
    }

    /// Why there are none, where the paper has such a table.
    pub fn paper_missing(&self) -> Option<String> {
        paper::missing(self.study, &self.data.layout)
    }
}

impl Part for RunSpec {
    type Error = RunError;
    const FILE: &'static str = RUN_FILE;

    fn read(folder: &Path) -> Result<Self, RunError> {
        Self::read(folder)
    }

    fn is_finished(folder: &Path) -> bool {
        folder.join(TABLE_FILE).is_file()
    }

    fn shard(&self) -> Option<Shard> {
        self.shard
    }

    fn whole(&self) -> Self {
        let whole = Self { shard: None, ..self.clone() };
        Self { id: whole.digest(), ..whole }
    }

    fn difference(&self, other: &Self) -> Option<Difference> {
        let shard = |spec: &Self| spec.shard.map_or_else(|| "the whole".to_owned(), |shard| shard.to_string());
        let precision = |spec: &Self| format!("{:?}", spec.precision).to_lowercase();
        let named: [(&str, Told<'_>); 9] = [
            ("study", &|spec| spec.study.to_string()),
            ("version", &|spec| spec.version.clone()),
            ("precision", &precision),
            ("preset or configuration file", &|spec| spec.base.clone()),
            ("seed", &|spec| spec.seed.to_string()),
            ("shard", &shard),
            ("data set", &|spec| spec.data.told()),
            ("choice of frames", &|spec| spec.data.told_frames()),
            ("erased cells", &|spec| spec.erased_told()),
        ];
        let found = named.into_iter().find(|(_, text)| text(self) != text(other));
        if let Some((what, text)) = found {
            return Some((what.to_owned(), text(self), text(other)));
        }
        // A variant that both have may be set otherwise; what else there is differs as a whole.
        let pairs = || self.variants.iter().zip(&other.variants);
        let setting = pairs().find_map(|(a, b)| Some((a, b, a.config.changes(&b.config).next()?)));
        if let Some((a, b, field)) = setting
            && pairs().all(|(a, b)| a.labels == b.labels)
        {
            let text = |variant: &Variant| field.text(field.get(&variant.config));
            return Some((format!("value of {}", field.key), text(a), text(b)));
        }
        (self.digest() != other.digest()).then(|| ("configuration".to_owned(), self.digest(), other.digest()))
    }
}
