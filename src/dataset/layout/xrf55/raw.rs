//! The raw variant: `XX_YY_ZZ.npy` of complex numbers, (frames, transmitters, 256 samples, 4 receivers, chirps), captures that were
//! cut into clips. A frame's maps are made by the chain when it is asked for; a clip is a sequence, of 20 frames a second.
//!
//! The chirp is that of the published capture script. It turns all three transmitters on in one chirp (so it seems), which leaves the
//! line of four receivers; files with three transmitters, one after the other, have eight in a line.

use super::{clip_words, told};
use crate::dataset::adc::{AdcSettings, ChainStages, ChirpText, CubeOrder, IqOrder, SampleSource, WordOrder};
use crate::dataset::axes_text::axes_badge;
use crate::dataset::layout::dca::{Maker, processing_of};
use crate::dataset::layout::{DataFolder, FrameSource, MapArray, Opened};
use crate::dataset::npz::NpyCube;
use crate::dataset::set::DatasetInfo;
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::{AdcCube, ChirpSettings};
use crate::task::Progress;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Axes of a file of samples.
const AXES: usize = 5;
/// Bytes of a frame that are accepted.
const MOST_FRAME: u64 = 64 << 20;
/// Frames of all clips that are accepted: 39 volunteers' are four million.
const MOST_FRAMES: usize = 16_000_000;

/// The chirp of XRF55's capture script, with the sizes of a file.
fn scripted([tx, samples, rx, loops]: [usize; 4]) -> ChirpSettings {
    ChirpSettings {
        start_hz: 60e9,
        slope_hz_per_s: 27.013e12,
        idle_s: 7e-6,
        adc_start_s: 5e-6,
        ramp_s: 140e-6,
        samples,
        sample_rate_hz: 3e6,
        loops,
        tx: (0..tx).collect(),
        rx,
        period_s: 0.05,
    }
}

/// Whether a file holds samples, by its header.
pub(super) fn is_raw(path: &Path) -> bool {
    NpyCube::open(path).is_ok_and(|cube| cube.shape().len() == AXES && cube.is_complex())
}

/// Opens the clips `files`, relative to the folder, the first of which is raw. Files of other sizes are left out, and said.
///
/// # Errors
/// Where the sizes of the first make no sense, or the manifest's chirp does not fit them; on cancel.
pub(super) fn open(
    place: &DataFolder<'_>,
    files: &[PathBuf],
    mut notes: Vec<String>,
    progress: &Progress,
) -> Result<Opened, DatasetError> {
    let Some(first) = files.first().map(|file| place.root.join(file)) else {
        return Err(place.without_frames("XRF55's XX_YY_ZZ.npy".into()));
    };
    let cube = NpyCube::open(&first)?;
    let &[_, tx, samples, rx, loops] = cube.shape() else {
        let message = format!("an array {:?}; expected five axes of samples", cube.shape());
        return Err(DatasetError::Frame { message, path: first });
    };
    let sizes = [tx, samples, rx, loops];
    let said = place.manifest.capture.as_ref().and_then(|capture| capture.chirp.as_ref());
    let chirp = said.map_or_else(|| scripted(sizes), ChirpText::settings);
    let settings = AdcSettings { chirp, words: WordOrder { iq: Some(IqOrder::IFirst), ..WordOrder::default() } };
    let fault = |message: String| DatasetError::Frame { message, path: first.clone() };
    if let Some(message) = settings.chirp.fault() {
        return Err(fault(format!("its axes (frames, transmitters, samples, receivers, chirps): {message}")));
    }
    if settings.frame_bytes() > MOST_FRAME {
        return Err(fault(format!(
            "its axes make {} bytes a frame; expected at most {MOST_FRAME}",
            settings.frame_bytes()
        )));
    }
    let of_chirp = [settings.chirp.tx.len(), settings.chirp.samples, settings.chirp.rx, settings.chirp.loops];
    if of_chirp != sizes {
        return Err(fault(format!(
            "its axes are {sizes:?} after the frames; expected {of_chirp:?}, as the manifest's chirp says"
        )));
    }
    let processing = processing_of(&settings, place, 1)?;
    let maker = Maker::new(settings, &processing);
    let mut clips: Vec<(PathBuf, usize)> = Vec::new();
    let mut other = 0;
    for file in files {
        progress.check()?;
        match NpyCube::open(&place.root.join(file)) {
            Ok(cube) if cube.is_complex() && cube.shape().get(1..) == Some(&sizes[..]) => {
                clips.push((file.clone(), cube.shape().first().copied().unwrap_or(0)));
            }
            _ => other += 1,
        }
    }
    if other > 0 {
        notes.push(format!("{other} clips are left out: they are not samples of the sizes of the first"));
    }
    let starts: Vec<usize> =
        clips.iter().scan(0_usize, |at, (_, frames)| Some(std::mem::replace(at, at.saturating_add(*frames)))).collect();
    let count = clips.iter().fold(0_usize, |sum, (_, frames)| sum.saturating_add(*frames));
    if count == 0 || count > MOST_FRAMES {
        return Err(fault(format!("{count} frames in its clips; expected 1 to {MOST_FRAMES}")));
    }
    if let Some(message) = maker.wanting() {
        return Err(fault(message));
    }
    if !place.manifest.views.is_empty() && place.manifest.views != place.manifest.layout.preset()?.views {
        let message = "[[view]]: the views of raw clips follow from their chirps; expected none".to_owned();
        return Err(DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() });
    }
    let mut info = place.info(&place.manifest.layout.preset()?);
    info.radar = maker.radar().clone();
    (info.views, info.calibrations) = maker.views().map_err(fault)?;
    info.axes_badge = axes_badge(&info.views);
    info.frame_rate_hz = Some(1.0 / maker.chirp().period_s);
    info.notes = notes;
    info.notes.push(told(files));
    info.notes.extend(maker.chirp().warnings());
    let from = if said.is_some() { "[capture.chirp]" } else { "XRF55's capture script" };
    info.assumptions = maker.assumptions(from, "complex numbers, (frames, transmitters, samples, receivers, chirps)");
    info.assumptions.push("joints: XRF55 publishes none, and none are made up".into());
    Ok(Opened { info, frames: Box::new(Clips { files: clips, starts, count, maker }), named: None })
}

/// The frames of raw clips.
#[derive(Debug)]
struct Clips {
    /// Files relative to the root, and their frames.
    files: Vec<(PathBuf, usize)>,
    /// The index of the first frame of each.
    starts: Vec<usize>,
    count: usize,
    maker: Maker,
}

impl Clips {
    /// The clip of frame `i` and the frame's number in it.
    fn find(&self, i: usize) -> Option<(&Path, usize)> {
        let at = self.starts.partition_point(|&start| start <= i).checked_sub(1).filter(|_| i < self.count)?;
        Some((&self.files.get(at)?.0, i - self.starts.get(at)?))
    }

    fn samples(&self, i: usize, info: &DatasetInfo) -> Result<AdcCube, DatasetError> {
        let Some((file, number)) = self.find(i) else {
            return Err(DatasetError::NoSuchFrame { index: i, count: self.count, path: info.root.clone() });
        };
        let cube = NpyCube::open(&info.root.join(file))?;
        let source = SampleSource::Numbers { cube, wrapped: false, order: CubeOrder::Transmitters };
        source.samples(number as u64, self.maker.settings(), IqOrder::IFirst)
    }
}

impl FrameSource for Clips {
    fn count(&self) -> usize {
        self.count
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        let Some((file, number)) = self.find(i) else { return Ok(()) };
        write!(out, "{}/{number:03}", file.with_extension("").to_string_lossy())
    }

    fn sequences(&self) -> usize {
        self.files.len()
    }

    fn sequence<'a>(&'a self, _i: usize, name: &'a str) -> Option<&'a str> {
        name.rsplit_once('/').map(|(clip, _)| clip)
    }

    fn files(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        self.find(i).map(|(file, _)| info.root.join(file)).into_iter().collect()
    }

    /// No array of samples is a map.
    fn arrays(&self, _place: usize, _info: &DatasetInfo) -> Vec<MapArray> {
        Vec::new()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| Ok(self.maker.maps(&self.samples(i, info)?, &info.views))).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let found = self.find(i);
        Ok(Frame {
            global_id: found.and_then(|(file, _)| clip_words(file)),
            timestamp_s: found.map(|(_, number)| number as f64 * self.maker.chirp().period_s),
            maps: self.maker.maps(&self.samples(i, info)?, &info.views),
            map_boxes: vec![Vec::new(); info.views.len()],
            ..Frame::default()
        })
    }

    fn has_samples(&self) -> bool {
        true
    }

    fn stages(&self, i: usize, info: &DatasetInfo) -> Result<Option<ChainStages>, DatasetError> {
        Ok(Some(self.maker.stages(&self.samples(i, info)?)))
    }
}
