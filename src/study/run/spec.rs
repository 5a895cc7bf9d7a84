//! `run.toml`: what a run is. Two runs with the same specification give the same rows, on any machine, in any number of
//! shards; a folder is gone on with only where its specification is the one asked for.

use super::error::RunError;
use super::kind::StudyKind;
use super::paper;
use super::variant::Variant;
use crate::digest;
use crate::input::{MOST_TEXT, read_text};
use crate::mhp::Precision;
use crate::output::replace_file;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};

/// The name of the file in a run folder.
pub const RUN_FILE: &str = "run.toml";

/// Part `index` of `count`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Which part, from 1.
    pub index: usize,
    /// Parts in all.
    pub count: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no shard; expected i/n with 1 ≤ i ≤ n, for example 2/4");
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let number = |part: &str| part.trim().parse::<usize>().map_err(|_| wrong());
        let shard = Self { index: number(index)?, count: number(count)? };
        let sound = (1..=100_000).contains(&shard.count) && (1..=shard.count).contains(&shard.index);
        sound.then_some(shard).ok_or_else(wrong)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// Which frames of the range are studied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Subset {
    /// All.
    All,
    /// The hard stratum.
    Hard,
}

/// The data that a run is about.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataSpec {
    /// Name of the data set.
    pub name: String,
    /// Where it lay; the only part that may differ between shards.
    #[serde(with = "crate::folders::portable_path")]
    pub root: PathBuf,
    /// How it lies on disk, as [`crate::dataset::Layout::word`] says it; "" in a run of an older program.
    #[serde(default)]
    pub layout: String,
    /// [`crate::dataset::Dataset::fingerprint`]: layout, arrays, shapes, names.
    pub fingerprint: String,
    /// Of the files' sizes and of the maps of three frames.
    pub content: String,
    /// Arrays of the views, in order.
    pub arrays: Vec<String>,
    /// First frame of the range.
    pub first: usize,
    /// One past the last frame of the range.
    pub end: usize,
    /// Frames that are studied.
    pub frames: usize,
    /// Which of the range.
    pub subset: Subset,
}

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
        let text = read_text(&file, "what a run is (TOML)", MOST_TEXT).map_err(RunError::reading(&file))?;
        let wrong = |message: String| RunError::Damaged { message, path: file.clone() };
        let spec: Self = toml::from_str(&text).map_err(|error| wrong(error.message().replace('\n', "; ")))?;
        let lengths = spec.variants.iter().all(|variant| variant.labels.len() == spec.columns.len());
        if spec.variants.is_empty() || !lengths {
            return Err(wrong("expected one [[variant]] or more, with a label for each of `columns`".into()));
        }
        Ok(spec)
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), RunError> {
        let file = folder.join(RUN_FILE);
        let text = toml::to_string(self).map_err(|error| RunError::Damaged {
            message: format!("cannot be written: {error}"),
            path: file.clone(),
        })?;
        let head =
            format!("# mhp-inspector study {}; `table.md` is its table, `rows.csv` a row a frame.\n", self.study);
        replace_file(&file, |out| out.write_all((head + &text).as_bytes())).map_err(RunError::writing(&file))
    }

    /// Names the run: 16 hexadecimal digits over everything but where the data lay.
    pub fn digest(&self) -> String {
        let mut spec = self.clone();
        spec.id = String::new();
        spec.data.root = PathBuf::new();
        digest::short(Sha256::new_with_prefix(serde_json::to_string(&spec).unwrap_or_default()))
    }

    /// What the paper's figures beside ours are of; `None` where there are none.
    pub fn paper(&self) -> Option<String> {
        paper::told(self.study, &self.data.layout)
    }

    /// Why there are none, where the paper has such a table.
    pub fn paper_missing(&self) -> Option<String> {
        paper::missing(self.study, &self.data.layout)
    }

    /// The whole that this is a shard of.
    pub(super) fn whole(&self) -> Self {
        let whole = Self { shard: None, ..self.clone() };
        Self { id: whole.digest(), ..whole }
    }

    /// The first thing, in words, in which another specification differs, with both values; where the data lay may.
    pub(super) fn difference(&self, other: &Self) -> Option<(&'static str, String, String)> {
        let shard = |spec: &Self| spec.shard.map_or_else(|| "the whole".to_owned(), |shard| shard.to_string());
        let data = |spec: &Self| format!("{} {} {}", spec.data.name, spec.data.fingerprint, spec.data.content);
        let frames = |spec: &Self| {
            let DataSpec { first, end, frames, subset, .. } = &spec.data;
            format!("{frames} of {first}..{end} ({})", if *subset == Subset::Hard { "hard" } else { "all" })
        };
        let precision = |spec: &Self| format!("{:?}", spec.precision).to_lowercase();
        let named: [(&str, Told<'_>); 8] = [
            ("study", &|spec| spec.study.to_string()),
            ("version", &|spec| spec.version.clone()),
            ("precision", &precision),
            ("preset or configuration file", &|spec| spec.base.clone()),
            ("seed", &|spec| spec.seed.to_string()),
            ("shard", &shard),
            ("data set", &data),
            ("choice of frames", &frames),
        ];
        let found = named.into_iter().find(|(_, text)| text(self) != text(other));
        if let Some((what, text)) = found {
            return Some((what, text(self), text(other)));
        }
        // A variant that both have may be set otherwise; what else there is differs as a whole.
        let pairs = || self.variants.iter().zip(&other.variants);
        let setting = pairs().find_map(|(a, b)| Some((a, b, a.config.changes(&b.config).next()?)));
        if let Some((a, b, field)) = setting
            && pairs().all(|(a, b)| a.labels == b.labels)
        {
            let text = |variant: &Variant| field.text(field.get(&variant.config));
            return Some((field.key, text(a), text(b)));
        }
        (self.digest() != other.digest()).then(|| ("configuration", self.digest(), other.digest()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_written_as_i_of_n() {
        assert_eq!("2/4".parse(), Ok(Shard { index: 2, count: 4 }));
        for text in ["0/4", "5/4", "1", "a/b", "1/0", "-1/2", "1/99999999"] {
            assert!(text.parse::<Shard>().is_err_and(|why| why.contains("expected i/n")), "{text}");
        }
    }
}
