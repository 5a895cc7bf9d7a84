//! `shard.toml`: what a shard of a command over frames belongs to. Shards with the same specification, their number apart, make
//! one whole.

use super::super::FileError;
use super::folder::{ROWS_FILE, SHARD_FILE};
use super::gather::{Difference, Part};
use super::{DataSpec, Shard, ShardError, Subset};
use crate::dataset::Dataset;
use crate::digest;
use crate::input::{MOST_TEXT, read_text};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The commands that compute a row a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FrameCommand {
    /// Fits and their summary.
    Fit,
    /// How hard each frame is.
    Complexity,
    /// How many people each frame shows.
    Count,
    /// What speaks for each failure mode.
    Evidence,
}

impl FrameCommand {
    /// As typed.
    pub fn word(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Complexity => "complexity",
            Self::Count => "count",
            Self::Evidence => "evidence",
        }
    }
}

/// Everything that the rows of a shard depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardSpec {
    /// 16 hexadecimal digits over everything else but where the data lay, as the program that wrote it computed them; the rows bear
    /// them too.
    pub id: String,
    /// Whose rows they are.
    pub command: FrameCommand,
    /// Of this program.
    pub version: String,
    /// Which part; absent for the whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// The data; its range is that of the whole.
    pub data: DataSpec,
    /// What the command was told, as it names it itself.
    pub settings: toml::Table,
}

impl ShardSpec {
    /// Of a part of `frames`.
    ///
    /// # Errors
    /// Where `settings` are no table of TOML: a defect of the command.
    pub fn new(
        command: FrameCommand,
        dataset: &Dataset,
        frames: &Range<usize>,
        shard: Shard,
        settings: &impl Serialize,
    ) -> Result<Self, ShardError> {
        let wrong = |error: toml::ser::Error| FileError::Damaged {
            message: format!("settings cannot be written: {error}"),
            path: SHARD_FILE.into(),
        };
        let spec = Self {
            id: String::new(),
            command,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            shard: Some(shard),
            data: DataSpec::of(dataset, &frames.clone().into(), frames.len(), Subset::All),
            settings: toml::Table::try_from(settings).map_err(wrong)?,
        };
        Ok(Self { id: spec.digest(), ..spec })
    }

    /// What the command was told.
    ///
    /// # Errors
    /// Where it is not what the command tells.
    pub fn settings<S: DeserializeOwned>(&self) -> Result<S, ShardError> {
        let wrong = |error: toml::de::Error| FileError::Damaged {
            message: format!("settings: {}", error.message().replace('\n', "; ")),
            path: SHARD_FILE.into(),
        };
        Ok(self.settings.clone().try_into().map_err(wrong)?)
    }

    /// 16 hexadecimal digits over everything but where the data lay.
    fn digest(&self) -> String {
        let mut spec = self.clone();
        spec.id = String::new();
        spec.data.root = PathBuf::new();
        digest::short(Sha256::new_with_prefix(serde_json::to_string(&spec).unwrap_or_default()))
    }

    /// The text of the file.
    pub(super) fn text(&self) -> Result<String, toml::ser::Error> {
        let shard = self.shard.map(|shard| format!(", shard {shard}")).unwrap_or_default();
        let head = format!("# mhp-inspector {}{shard}; `{ROWS_FILE}` holds a line a frame.\n", self.command.word());
        Ok(head + &toml::to_string(self)?)
    }
}

/// Which command the shard in `folder` is of.
///
/// # Errors
/// Where its file cannot be read or is none.
pub fn of_command(folder: &Path) -> Result<FrameCommand, ShardError> {
    ShardSpec::read(folder).map(|spec| spec.command)
}

impl Part for ShardSpec {
    type Error = ShardError;
    const FILE: &'static str = SHARD_FILE;

    fn read(folder: &Path) -> Result<Self, ShardError> {
        let file = folder.join(SHARD_FILE);
        let text = read_text(&file, "what a shard is (TOML)", MOST_TEXT).map_err(FileError::reading(&file))?;
        let wrong =
            |error: toml::de::Error| FileError::Damaged { message: error.message().replace('\n', "; "), path: file };
        Ok(toml::from_str(&text).map_err(wrong)?)
    }

    fn is_finished(folder: &Path) -> bool {
        folder.join(ROWS_FILE).is_file()
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
        let named = |what: &str, text: &dyn Fn(&Self) -> String| {
            let (here, there) = (text(self), text(other));
            (here != there).then(|| (what.to_owned(), here, there))
        };
        named("command", &|spec| spec.command.word().to_owned())
            .or_else(|| named("version", &|spec| spec.version.clone()))
            .or_else(|| named("shard", &shard))
            .or_else(|| named("data set", &|spec| spec.data.told()))
            .or_else(|| named("choice of frames", &|spec| spec.data.told_frames()))
            .or_else(|| setting("", &self.settings, &other.settings))
            .or_else(|| named("specification", &Self::digest))
    }
}

/// The first key, `table.key` inside a table, that two tables have not alike.
fn setting(within: &str, here: &toml::Table, there: &toml::Table) -> Option<Difference> {
    let keys = here.keys().chain(there.keys().filter(|key| !here.contains_key(*key)));
    let told = |value: Option<&toml::Value>| value.map_or_else(|| "not set".to_owned(), ToString::to_string);
    keys.filter(|key| here.get(*key) != there.get(*key)).find_map(|key| match (here.get(key), there.get(key)) {
        (Some(toml::Value::Table(here)), Some(toml::Value::Table(there))) => {
            setting(&format!("{within}{key}."), here, there)
        }
        (here, there) => Some((format!("setting {within}{key}"), told(here), told(there))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_setting_that_differs_is_named_with_its_table() {
        let table = |text: &str| toml::from_str::<toml::Table>(text).unwrap_or_default();
        let (one, two) = (table("a = 1\n[fit]\nw_em = 0.5\nx = 1"), table("a = 1\n[fit]\nw_em = 0.25\nx = 2"));
        let told = |text: &str| text.to_owned();
        assert_eq!(setting("", &one, &two), Some((told("setting fit.w_em"), told("0.5"), told("0.25"))));
        assert_eq!(
            setting("", &table("a = 1"), &one),
            Some((told("setting fit"), told("not set"), told("{ w_em = 0.5, x = 1 }")))
        );
        assert_eq!(setting("", &one, &one.clone()), None);
    }
}
