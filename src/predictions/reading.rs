//! How a file of predictions is to be read: what the file itself does not say. Told once, by flags, by a description beside the
//! file or in the window's form; remembered by the form of the file.

use super::convention::{Axes, Unit};
use super::error::PredictionError;
use crate::input::{MOST_TEXT, read_text};
use crate::output::replace_file;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A colour as `#RRGGBB`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Colour(pub [u8; 3]);

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [r, g, b] = self.0;
        write!(f, "#{r:02X}{g:02X}{b:02X}")
    }
}

impl From<Colour> for String {
    fn from(colour: Colour) -> Self {
        colour.to_string()
    }
}

impl TryFrom<String> for Colour {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl FromStr for Colour {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("colour \"{}\"; expected #RRGGBB", text.escape_debug());
        let digits =
            text.trim().strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii()).ok_or_else(wrong)?;
        let part = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).map_err(|_| wrong());
        Ok(Self([part(0)?, part(2)?, part(4)?]))
    }
}

/// How a file of predictions is to be read; the keys of a description, `FILE.toml` beside FILE. What is not given is taken from
/// the file, else from what was told before of such a file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// What the source is called; a word.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What it is drawn in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour: Option<Colour>,
    /// A known skeleton whose joints are in its order: `coco17`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skeleton: Option<String>,
    /// The joints by name, in the file's order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<String>>,
    /// The unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// The axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<Axes>,
    /// The array or the key of the joints, where a file holds several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub array: Option<String>,
    /// Names of the file's joints, and what the data set calls them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub mapping: BTreeMap<String, String>,
}

impl Reading {
    /// The description beside a file, `FILE.toml`; nothing where there is none.
    ///
    /// # Errors
    /// Where it cannot be read or has a key that is none.
    pub fn beside(path: &Path) -> Result<Self, PredictionError> {
        let mut name = path.as_os_str().to_owned();
        name.push(".toml");
        let beside = PathBuf::from(name);
        if beside.is_file() { Self::from_file(&beside) } else { Ok(Self::default()) }
    }

    /// A description.
    ///
    /// # Errors
    /// As [`Self::beside`].
    pub fn from_file(path: &Path) -> Result<Self, PredictionError> {
        let text = read_text(path, "a description of predictions", MOST_TEXT)
            .map_err(|reason| PredictionError::Read { reason, path: path.to_owned() })?;
        toml::from_str(&text).map_err(|error| {
            let line = error.span().map(|span| text.get(..span.start).unwrap_or_default().matches('\n').count() + 1);
            PredictionError::Format { message: error.message().to_owned(), line, path: path.to_owned() }
        })
    }

    /// What is given here, and of the rest what `other` gives.
    pub fn or(self, other: &Self) -> Self {
        let joints_given = self.joints.is_some() || self.skeleton.is_some();
        Self {
            name: self.name.or_else(|| other.name.clone()),
            colour: self.colour.or(other.colour),
            skeleton: if joints_given { self.skeleton } else { other.skeleton.clone() },
            joints: if joints_given { self.joints } else { other.joints.clone() },
            unit: self.unit.or(other.unit),
            axes: self.axes.or(other.axes),
            array: self.array.or_else(|| other.array.clone()),
            mapping: if self.mapping.is_empty() { other.mapping.clone() } else { self.mapping },
        }
    }

    /// What holds for every file of a form: neither name nor colour.
    fn of_form(&self) -> Self {
        Self { name: None, colour: None, ..self.clone() }
    }
}

/// What was told of files before: one TOML in the user's data folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RememberedReadings {
    file: PathBuf,
}

impl RememberedReadings {
    /// The user's own; `None` where there is no home.
    pub fn of_user() -> Option<Self> {
        crate::folders::user_data().map(|home| Self::in_folder(&home))
    }

    /// Those kept in `folder`.
    pub fn in_folder(folder: &Path) -> Self {
        Self { file: folder.join("predictions.toml") }
    }

    fn all(&self) -> BTreeMap<String, Reading> {
        let text = read_text(&self.file, "remembered descriptions of predictions", MOST_TEXT).unwrap_or_default();
        toml::from_str(&text).unwrap_or_else(|error| {
            tracing::warn!("{}: unreadable and ignored: {}", self.file.display(), error.message());
            BTreeMap::new()
        })
    }

    /// What was told of files of this form.
    pub fn recall(&self, form: &str) -> Reading {
        self.all().remove(form).unwrap_or_default()
    }

    /// Keeps it for files of this form.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn remember(&self, form: &str, reading: &Reading) -> Result<(), PredictionError> {
        let failed = |reason| PredictionError::Write { reason, path: self.file.clone() };
        let mut all = self.all();
        let kept = reading.of_form();
        if all.get(form) == Some(&kept) {
            return Ok(());
        }
        all.insert(form.to_owned(), kept);
        let text = toml::to_string(&all).map_err(|error| failed(std::io::Error::other(error)))?;
        if let Some(folder) = self.file.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        replace_file(&self.file, |out| out.write_all(text.as_bytes())).map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where a file cannot be written")]
    use super::*;

    #[test]
    fn what_was_told_is_remembered_by_form() {
        let home = tempfile::tempdir().unwrap();
        let memory = RememberedReadings::in_folder(home.path());
        assert_eq!(memory.recall("csv 17"), Reading::default());
        let told =
            Reading { name: Some("retr".into()), unit: Some(Unit::Mm), axes: Some(Axes::CAMERA), ..Reading::default() };
        memory.remember("csv 17", &told).unwrap();
        assert_eq!(memory.recall("csv 17"), Reading { name: None, ..told });
        assert_eq!(memory.recall("csv 14"), Reading::default());
    }

    #[test]
    fn a_description_names_its_wrong_key() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("p.npz.toml");
        std::fs::write(&file, "unit = \"mm\"\naxis = \"x,y,z\"\n").unwrap();
        let why = Reading::beside(&home.path().join("p.npz")).unwrap_err().to_string();
        assert!(why.contains("p.npz.toml:2") && why.contains("axis"), "{why}");
        std::fs::write(&file, "unit = \"mm\"\naxes = \"camera\"\ncolour = \"#10A37F\"\n[mapping]\nA = \"nose\"\n")
            .unwrap();
        let read = Reading::beside(&home.path().join("p.npz")).unwrap();
        assert_eq!((read.axes, read.colour), (Some(Axes::CAMERA), Some(Colour([0x10, 0xA3, 0x7F]))));
        assert!("#12".parse::<Colour>().is_err() && "123456".parse::<Colour>().is_err());
    }
}
