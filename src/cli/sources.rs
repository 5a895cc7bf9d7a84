//! `--pred`, `--init` and what says how such a file is to be read.

use crate::body::Skeleton;
use crate::dataset::Dataset;
use crate::predictions::{Axes, Colour, PredictionError, Predictions, Reading, RememberedReadings, Unit};
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use std::str::FromStr;

/// A file of predictions as typed: `NAME=FILE`, `NAME#RRGGBB=FILE` with the colour that it is drawn in, or `FILE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SourceFile {
    pub(super) name: Option<String>,
    pub(super) colour: Option<Colour>,
    pub(super) path: PathBuf,
}

impl SourceFile {
    /// What is told of it here.
    pub(super) fn reading(&self) -> Reading {
        Reading { name: self.name.clone(), colour: self.colour, ..Reading::default() }
    }
}

impl FromStr for SourceFile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let word = |name: &str| !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
        // A path may hold `=` too: it is one where it is there, or where no word stands before.
        let named = |(name, path): (&str, &str)| {
            let (name, colour) = name.split_once('#').map_or((name, None), |(name, of)| (name, Some(format!("#{of}"))));
            (word(name) && !std::path::Path::new(text).exists()).then(|| (name.to_lowercase(), colour, path.to_owned()))
        };
        match text.split_once('=').and_then(named) {
            Some((_, _, path)) if path.is_empty() => Err("a name without a file; expected NAME=FILE or FILE".into()),
            Some((name, colour, path)) => {
                let colour = colour.map(|of| of.parse::<Colour>()).transpose()?;
                Ok(Self { name: Some(name), colour, path: path.into() })
            }
            None => Ok(Self { name: None, colour: None, path: text.into() }),
        }
    }
}

/// How files of predictions are to be read, where they do not say it themselves.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct ReadingArgs {
    /// Unit of predicted joints: m, cm, mm. Told once, it is remembered for files of this form.
    #[arg(long, value_name = "UNIT", value_parser = str::parse::<Unit>)]
    unit: Option<Unit>,
    /// Axes of predicted joints: radar (x forward, y left, z up), camera (x right, y down, z forward), right-forward-up, or which
    /// signed axes of the file are forward, left and up, as z,-x,-y. Remembered.
    #[arg(long, value_name = "AXES", allow_hyphen_values = true, value_parser = str::parse::<Axes>)]
    axes: Option<Axes>,
    /// Skeleton whose joints the predicted ones are, in its order. Remembered.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Skeleton::PRESETS))]
    skeleton: Option<String>,
    /// Array of an npz, or key of a JSON, that holds the joints. Remembered.
    #[arg(long, value_name = "KEY")]
    array: Option<String>,
    /// Forget nothing and remember nothing: neither read nor write what was told before.
    #[arg(long)]
    no_memory: bool,
}

impl ReadingArgs {
    /// Reads a file of predictions onto a data set.
    ///
    /// # Errors
    /// As [`Predictions::open`].
    pub(super) fn open(&self, source: &SourceFile, dataset: &Dataset) -> Result<Predictions, PredictionError> {
        let told = Reading {
            skeleton: self.skeleton.clone(),
            unit: self.unit,
            axes: self.axes,
            array: self.array.clone(),
            ..source.reading()
        };
        let memory = RememberedReadings::of_user().filter(|_| !self.no_memory);
        Predictions::open(&source.path, dataset, &told, memory.as_ref())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_typed_with_name_and_colour() {
        let typed = |text: &str| text.parse::<SourceFile>();
        let path = PathBuf::from("a=b.npz");
        assert_eq!(typed("Net=a=b.npz"), Ok(SourceFile { name: Some("net".into()), colour: None, path: path.clone() }));
        let colour = Some(Colour([0x10, 0xA3, 0x7F]));
        assert_eq!(typed("net#10a37f=a=b.npz"), Ok(SourceFile { name: Some("net".into()), colour, path }));
        let plain = |text: &str| Ok(SourceFile { name: None, colour: None, path: text.into() });
        assert_eq!(typed("runs/n#1.npz"), plain("runs/n#1.npz"));
        assert_eq!(typed("runs/n=1.npz"), plain("runs/n=1.npz"));
        assert!(typed("net#12=a.npz").is_err_and(|why| why.contains("expected #RRGGBB")));
        assert!(typed("net=").is_err_and(|why| why.contains("without a file")));
    }
}
