//! A capture without a configuration file: what a person says of it, as the manifest that it could have, and the memory of that.
//!
//! The window asks with a form ([`ChirpForm`]); the answer is kept for that file in the user's own folder (`captures.toml`), never
//! beside the capture, and every command takes it from there.

use crate::dataset::DatasetError;
use crate::dataset::adc::{AdcText, ChirpText};
use crate::dataset::manifest::Manifest;
use crate::dataset::set::{Dataset, OpenOptions};
use crate::input::{MOST_TEXT, read_text};
use crate::output::replace_file;
use crate::task::Progress;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The form that `chain --form` prints, which is where an answer begins.
const USUAL: &str = include_str!("../../../../assets/capture_form.toml");
/// The file of answers.
const NAME: &str = "captures.toml";
/// Captures that are remembered; the oldest names go first.
const MOST: usize = 1000;

/// What a person says of a capture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChirpForm {
    layout: &'static str,
    /// Name of the skeleton to fit.
    pub skeleton: String,
    /// Chirps, words and processing; the chirps are always there.
    pub capture: AdcText,
}

impl ChirpForm {
    /// The form as it is printed: a start to be edited.
    ///
    /// # Errors
    /// Never for the form that the program was built with; a test holds it.
    pub fn usual() -> Result<Self, DatasetError> {
        let path = Path::new("assets/capture_form.toml");
        let capture = Manifest::parse(USUAL, path)?.capture.unwrap_or_default();
        Ok(Self { layout: "capture", skeleton: "coco17".into(), capture })
    }

    /// As the text of a manifest.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }

    /// What is wrong with the chirps, or what follows from them, in a line.
    ///
    /// # Errors
    /// The first number that cannot be right.
    pub fn told(&self) -> Result<String, String> {
        let chirp = self.capture.chirp.as_ref().ok_or("no chirps")?.settings();
        chirp.fault().map_or_else(|| Ok(chirp.words()), Err)
    }

    /// What the chirps warn of, in words.
    pub fn warnings(&self) -> Vec<String> {
        let chirp = self.capture.chirp.as_ref().map(ChirpText::settings);
        chirp.filter(|chirp| chirp.fault().is_none()).map_or_else(Vec::new, |chirp| chirp.warnings())
    }

    fn manifest(&self, path: &Path) -> Result<Manifest, DatasetError> {
        Manifest::parse(&self.to_toml(), path)
    }
}

/// The answers of earlier sessions.
#[derive(Debug, Clone)]
pub(super) struct Forms {
    file: PathBuf,
}

impl Forms {
    /// The user's own; `None` where there is no home.
    pub(super) fn of_user() -> Option<Self> {
        crate::folders::user_data().map(|home| Self { file: home.join(NAME) })
    }

    fn all(&self) -> BTreeMap<String, String> {
        let text = read_text(&self.file, "remembered captures", MOST_TEXT).unwrap_or_default();
        toml::from_str(&text).unwrap_or_else(|error: toml::de::Error| {
            tracing::warn!(
                "{}: remembered captures are unreadable and ignored: {}",
                self.file.display(),
                error.message()
            );
            BTreeMap::new()
        })
    }

    /// What was said of a capture, if it still makes sense.
    pub(super) fn recall(&self, capture: &Path) -> Option<Manifest> {
        let text = self.all().remove(&key(capture))?;
        Manifest::parse(&text, &self.file).ok().filter(|manifest| manifest.capture.is_some())
    }

    fn remember(&self, capture: &Path, form: &ChirpForm) -> Result<(), DatasetError> {
        let failed = |reason| DatasetError::Write { reason, path: self.file.clone() };
        let mut all = self.all();
        while all.len() >= MOST {
            all.pop_first();
        }
        all.insert(key(capture), form.to_toml());
        let text = toml::to_string(&all).map_err(|error| failed(std::io::Error::other(error)))?;
        if let Some(folder) = self.file.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        replace_file(&self.file, |out| out.write_all(text.as_bytes())).map_err(failed)
    }
}

/// A capture's whole path.
fn key(capture: &Path) -> String {
    std::path::absolute(capture).unwrap_or_else(|_| capture.to_owned()).to_string_lossy().into_owned()
}

impl Dataset {
    /// Opens a capture as a form says, and remembers the form for it.
    ///
    /// # Errors
    /// Where the form does not fit the capture. That it could not be remembered is logged, not an error.
    pub fn open_capture(path: &Path, form: &ChirpForm) -> Result<Self, DatasetError> {
        let forms = Forms::of_user();
        let file = forms.as_ref().map_or_else(|| PathBuf::from(NAME), |forms| forms.file.clone());
        let manifest = form.manifest(&file)?;
        let options = OpenOptions { manifest: Some(&manifest), allow_outside: false };
        let opened = Self::open_with(path, options, &Progress::new())?;
        if let Some(Err(error)) = forms.map(|forms| forms.remember(path, form)) {
            tracing::warn!("what was said of the capture is not remembered: {error}");
        }
        Ok(opened)
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn the_usual_form_is_sound_and_is_read_back() {
        let mut form = ChirpForm::usual().unwrap();
        assert!(form.told().unwrap().contains("256 samples"), "{:?}", form.told());
        let said = form.manifest(Path::new("form")).unwrap();
        assert_eq!(said.capture, Some(form.capture.clone()));
        let home = tempfile::tempdir().unwrap();
        let (forms, capture) = (Forms { file: home.path().join("deep").join(NAME) }, Path::new("/data/adc_data.bin"));
        assert_eq!(forms.recall(capture), None);
        form.capture.iq = Some("q_first".into());
        forms.remember(capture, &form).unwrap();
        let kept = forms.recall(capture).unwrap();
        assert_eq!(kept.capture.unwrap().iq.as_deref(), Some("q_first"));
        form.capture.chirp.as_mut().unwrap().loops = 0;
        assert!(form.told().unwrap_err().contains("loops"));
        assert_eq!(form.warnings(), Vec::<String>::new());
    }
}
