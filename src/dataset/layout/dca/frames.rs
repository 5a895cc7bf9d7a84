//! The frames of a capture: samples, spectra and maps, made when they are asked for.

use super::maker::Maker;
use crate::dataset::adc::{AdcSettings, ChainStages, IqOrder, SampleSource};
use crate::dataset::layout::FrameSource;
use crate::dataset::set::DatasetInfo;
use crate::dataset::{DatasetError, Frame, Heatmap, MapArray};
use crate::radar::AdcCube;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// How much more energy a room's side of the range spectrum must have, for the order of I and Q to be told by it.
const CLEAR: f64 = 1.2;

/// The frames of a capture.
#[derive(Debug)]
pub(super) struct Frames {
    name: String,
    source: SampleSource,
    maker: Maker,
    iq: IqOrder,
    /// How that is known.
    iq_how: String,
    count: usize,
}

/// What comes first of a sample of a source, and how that is known: said, told by the first frame, or assumed.
///
/// # Errors
/// Where the first frame cannot be read.
pub(in crate::dataset::layout) fn tell_iq(
    source: &SampleSource,
    settings: &AdcSettings,
) -> Result<(IqOrder, String), DatasetError> {
    let words = settings.words;
    if !source.has_words() {
        return Ok((IqOrder::IFirst, "complex numbers".into()));
    }
    if !words.complex {
        return Ok((IqOrder::IFirst, "samples are real".into()));
    }
    if let Some(iq) = words.iq {
        return Ok((iq, format!("{}, as the manifest says", iq.words())));
    }
    let ratio = source.samples(0, settings, IqOrder::IFirst)?.upper_to_lower();
    let iq = if ratio > CLEAR { IqOrder::QFirst } else { IqOrder::IFirst };
    let clear = ratio.max(1.0 / ratio.max(f64::MIN_POSITIVE));
    let how = if clear >= CLEAR {
        format!(
            "{}: with it the near half of the range spectrum has {clear:.1} times the energy of the far one",
            iq.words()
        )
    } else {
        format!(
            "{}, taken without much reason: both halves of the range spectrum have about as much energy",
            iq.words()
        )
    };
    Ok((iq, how))
}

impl Frames {
    /// Those of a source; reads the first frame where nothing says what comes first of a sample.
    pub(super) fn new(name: String, source: SampleSource, maker: Maker, count: usize) -> Result<Self, DatasetError> {
        let (iq, iq_how) = tell_iq(&source, maker.settings())?;
        match maker.wanting() {
            Some(message) => Err(DatasetError::Frame { message, path: source.path().to_owned() }),
            None => Ok(Self { name, source, maker, iq, iq_how, count }),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn maker(&self) -> &Maker {
        &self.maker
    }

    /// What was assumed, in words.
    pub(super) fn assumptions(&self, config: &Path) -> Vec<String> {
        let name = config.file_name().unwrap_or_default().to_string_lossy();
        self.maker.assumptions(&name, &self.iq_how)
    }

    /// What the chirps imply, and what is missing of the signal.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = self.maker.chirp().warnings();
        notes.extend(self.source.notes());
        notes
    }

    /// An error about the capture as a whole.
    pub(super) fn fault(&self, message: String) -> DatasetError {
        DatasetError::Frame { message, path: self.source.path().to_owned() }
    }

    fn samples(&self, frame: usize) -> Result<AdcCube, DatasetError> {
        self.source.samples(frame as u64, self.maker.settings(), self.iq)
    }
}

impl FrameSource for Frames {
    fn count(&self) -> usize {
        self.count
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        write!(out, "{}/{i:06}", self.name)
    }

    fn sequences(&self) -> usize {
        1
    }

    fn sequence<'a>(&'a self, _i: usize, name: &'a str) -> Option<&'a str> {
        name.rsplit_once('/').map(|(capture, _)| capture)
    }

    fn files(&self, _i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        self.source.files()
    }

    /// No array of the file is a map.
    fn arrays(&self, _place: usize, _info: &DatasetInfo) -> Vec<MapArray> {
        Vec::new()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| Ok(self.maker.maps(&self.samples(i)?, &info.views))).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        Ok(Frame {
            timestamp_s: Some(i as f64 * self.maker.chirp().period_s),
            maps: self.maker.maps(&self.samples(i)?, &info.views),
            map_boxes: vec![Vec::new(); info.views.len()],
            ..Frame::default()
        })
    }

    fn has_samples(&self) -> bool {
        true
    }

    fn stages(&self, i: usize, _info: &DatasetInfo) -> Result<Option<ChainStages>, DatasetError> {
        Ok(Some(self.maker.stages(&self.samples(i)?)))
    }
}
