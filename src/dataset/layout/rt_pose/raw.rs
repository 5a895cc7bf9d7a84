//! Raw captures: `<sequence>/radar/bin/{master,slave1,slave2,slave3}_0000_data.bin` of a cascade with the `.mmwave.json` of mmWave
//! Studio beside them or in a folder above. A frame becomes a cube on the published grid (or that of a manifest's view) when it is
//! asked for, so that joints, views and fits are those of the published cubes.
//!
//! How the published cubes were made of the samples is not published: here range and Doppler are tapered by Hann windows, the mean
//! over the chirps is taken away, both angles have no taper, powers are summed over Doppler; `[capture]` of a manifest says otherwise.

use super::labels::{Labels, calibration};
use crate::dataset::adc::{ChainStages, IqOrder, SampleSource, cascade_of, chip_of};
use crate::dataset::layout::dca::{Maker, config_in, processing_of, settings_from, tell_iq};
use crate::dataset::layout::{DataFolder, FrameSource, MapArray, Opened};
use crate::dataset::natural::natural;
use crate::dataset::set::{DatasetInfo, parent};
use crate::dataset::walk::Walk;
use crate::dataset::{DatasetError, Frame, Heatmap, ViewCalibration};
use crate::radar::{AdcCube, View};
use crate::task::Progress;
use std::borrow::Cow;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Folders inside each other that are looked into, `radar/bin` included.
const MAX_DEPTH: usize = 6;
/// From the files of a sequence up to the folder of its configuration.
const HEIGHT: usize = 4;
/// Folders that are no names of sequences.
const PARTS: [&str; 3] = ["bin", "radar", "raw"];
/// Frames of a sequence that are accepted.
const MOST_FRAMES: u64 = 10_000_000;

/// A piece of a capture: four files that were written together.
#[derive(Debug)]
struct Piece {
    /// That of the first chip.
    master: PathBuf,
    /// The name of its sequence.
    sequence: String,
    /// The number of its first frame in the sequence, and in the data set.
    number: usize,
    start: usize,
    frames: usize,
}

/// The name itself where it is that of the first chip's samples.
fn master_name(name: &str) -> Option<&str> {
    chip_of(Path::new(name)).is_some_and(|(chip, _)| chip == 0).then_some(name)
}

/// Opens captures at or below a folder.
///
/// # Errors
/// Where there are none, or one has no configuration or lacks a chip's file.
pub(super) fn open(place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
    let skip = |name: &str| super::CUBES.contains(&name) || super::super::hiber::FOLDERS.contains(&name);
    let (folders, notes) = Walk { depth: MAX_DEPTH, stem: master_name, skip, progress }.of(place.root)?;
    // A capture alone is one, whatever its folder is called: it is RT-Pose's where its folders are, or where somebody says so.
    let is_said = place.manifest.path != Path::new(super::PRESET_PATH);
    let mut masters: Vec<PathBuf> = folders
        .into_iter()
        .flat_map(|folder| {
            let below = place.root.join(&folder.below);
            folder.stems.into_iter().map(move |name| below.join(name))
        })
        .filter(|master| is_said || is_of_rt_pose(master))
        .collect();
    masters.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
    let Some(first) = masters.first() else {
        let expected = "RT-Pose's <sequence>/npy/F.npy or DZYX_npy_f16/F.npy, or <sequence>/radar/bin/master_0000_data.bin, in it or \
                        in a folder below";
        return Err(place.without_frames(expected.into()));
    };
    let config = config_of(first)?;
    let settings = settings_from(&config, place)?;
    let files = cascade_of(first)?.unwrap_or_else(|| vec![first.clone()]);
    if settings.chirp.rx % files.len() != 0 {
        let message = format!("{} receivers; expected as many of each of {} chips", settings.chirp.rx, files.len());
        return Err(DatasetError::Manifest { message, line: None, path: config });
    }
    let preset = place.manifest.layout.preset()?;
    let mut info = place.info(&preset);
    let [view] = &info.views[..] else {
        let message = "raw captures make one cube; expected one [[view]] of z, y and x".to_owned();
        return Err(DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() });
    };
    let view = view.clone();
    let processing = processing_of(&settings, place, files.len())?;
    let maker = Maker::new(settings, &processing).with_cube(&view.axes);
    if let Some(message) = maker.wanting() {
        return Err(DatasetError::Frame { message, path: first.clone() });
    }
    let (iq, how) = tell_iq(&SampleSource::open(&files, maker.settings())?, maker.settings())?;
    let mut pieces: Vec<Piece> = Vec::new();
    for master in masters {
        progress.check()?;
        let files = cascade_of(&master)?.unwrap_or_else(|| vec![master.clone()]);
        let source = SampleSource::open(&files, maker.settings())?;
        let frames = source.frames(maker.settings()).0.min(MOST_FRAMES) as usize;
        let sequence = sequence_of(&master);
        let before = pieces.last();
        let number =
            before.filter(|before| before.sequence == sequence).map_or(0, |before| before.number + before.frames);
        let start = before.map_or(0, |before| before.start + before.frames);
        pieces.push(Piece { master, sequence, number, start, frames });
    }
    let count = pieces.last().map_or(0, |last| last.start + last.frames);
    if count == 0 {
        let message = format!("no whole frame of {} bytes in its captures", maker.settings().frame_bytes());
        return Err(DatasetError::Frame { message, path: place.root.to_owned() });
    }
    // Chirp and widths are known here.
    info.radar = maker.radar().clone();
    info.radar.height_m = place.manifest.radar.as_ref().and_then(|radar| radar.height_m);
    let (made, calibrations) =
        maker.views().map_err(|message| DatasetError::Frame { message, path: place.root.to_owned() })?;
    if let (Some(made), true) = (made.first(), view.psf == preset.views.first().map_or(view.psf, |of| of.psf)) {
        info.views = vec![View { psf: made.psf, ..view }].into();
        info.calibrations = calibrations;
    } else {
        info.calibrations =
            vec![ViewCalibration { derived: false, ..calibrations.into_iter().next().unwrap_or_default() }];
    }
    info.frame_rate_hz = Some(1.0 / maker.chirp().period_s);
    let labels = Labels::near(parent(&pieces.first().map_or_else(PathBuf::new, |piece| piece.master.clone())));
    info.notes = notes;
    info.notes.extend(pieces.first().and_then(|piece| calibration(parent(&piece.master))));
    info.notes.extend(maker.chirp().warnings());
    let name = config.file_name().unwrap_or_default().to_string_lossy();
    info.assumptions.extend(maker.assumptions(&name, &how));
    info.assumptions.push(
        "cubes: made of raw captures by this program's chain; how the published ones were made is not published, and frame n of a \
         capture is taken for radar frame n of the labels"
            .into(),
    );
    Ok(Opened { info, frames: Box::new(RawFrames { pieces, count, maker, iq, labels }), named: None })
}

/// Whether a capture lies where RT-Pose's do.
fn is_of_rt_pose(master: &Path) -> bool {
    let whole = std::path::absolute(master).unwrap_or_else(|_| master.to_owned());
    let mut names = whole.ancestors().skip(1).filter_map(|folder| folder.file_name());
    names.next().is_some_and(|name| name == "bin") && names.next().is_some_and(|name| name == "radar")
}

/// The name of the sequence that a capture is of: the first folder above it that is not a part.
fn sequence_of(master: &Path) -> String {
    let whole = std::path::absolute(master).unwrap_or_else(|_| master.to_owned());
    let names = whole.ancestors().skip(1).filter_map(|folder| folder.file_name().map(|name| name.to_string_lossy()));
    names.into_iter().find(|name| !PARTS.contains(&&**name)).map_or_else(String::new, Cow::into_owned)
}

/// The configuration of a capture: beside it, or in a folder above.
fn config_of(master: &Path) -> Result<PathBuf, DatasetError> {
    let whole = std::path::absolute(master).unwrap_or_else(|_| master.to_owned());
    for folder in whole.ancestors().skip(1).take(HEIGHT) {
        if let Some(found) = config_in(folder, master)? {
            return Ok(found);
        }
    }
    let message =
        "no .mmwave.json beside it or in the folders above; expected the configuration of its cascade".to_owned();
    Err(DatasetError::Frame { message, path: master.to_owned() })
}

/// The frames of captures.
#[derive(Debug)]
struct RawFrames {
    pieces: Vec<Piece>,
    count: usize,
    maker: Maker,
    iq: IqOrder,
    labels: Labels,
}

impl RawFrames {
    /// The piece of frame `i`, and the frame's number in it.
    fn find(&self, i: usize) -> Option<(&Piece, usize)> {
        let at = self.pieces.partition_point(|piece| piece.start <= i).checked_sub(1).filter(|_| i < self.count)?;
        let piece = self.pieces.get(at)?;
        Some((piece, i - piece.start))
    }

    fn samples(&self, i: usize, info: &DatasetInfo) -> Result<AdcCube, DatasetError> {
        let Some((piece, number)) = self.find(i) else {
            return Err(DatasetError::NoSuchFrame { index: i, count: self.count, path: info.root.clone() });
        };
        let files = cascade_of(&piece.master)?.unwrap_or_else(|| vec![piece.master.clone()]);
        SampleSource::open(&files, self.maker.settings())?.samples(number as u64, self.maker.settings(), self.iq)
    }
}

impl FrameSource for RawFrames {
    fn count(&self) -> usize {
        self.count
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        let Some((piece, number)) = self.find(i) else { return Ok(()) };
        write!(out, "{}/{:06}", piece.sequence, piece.number + number)
    }

    fn sequences(&self) -> usize {
        let mut names: Vec<&str> = self.pieces.iter().map(|piece| piece.sequence.as_str()).collect();
        names.dedup();
        names.len()
    }

    fn sequence<'a>(&'a self, i: usize, _name: &'a str) -> Option<&'a str> {
        self.find(i).map(|(piece, _)| piece.sequence.as_str())
    }

    fn files(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        let Some((piece, _)) = self.find(i) else { return Vec::new() };
        cascade_of(&piece.master).ok().flatten().unwrap_or_else(|| vec![piece.master.clone()])
    }

    /// No array of a capture is a map.
    fn arrays(&self, _place: usize, _info: &DatasetInfo) -> Vec<MapArray> {
        Vec::new()
    }

    fn label_files(&self) -> Vec<PathBuf> {
        self.labels.paths()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| Ok(self.maker.maps(&self.samples(i, info)?, &info.views))).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let maps = self.maker.maps(&self.samples(i, info)?, &info.views);
        let mut notes = Vec::new();
        let found = self.find(i).map(|(piece, number)| (&piece.sequence, piece.number + number));
        let truth = found.and_then(|(sequence, number)| {
            self.labels.of(sequence, &number.to_string(), info.skeleton.joints.len(), &mut notes)
        });
        Ok(Frame {
            timestamp_s: found.map(|(_, number)| number as f64 * self.maker.chirp().period_s),
            map_boxes: vec![Vec::new(); info.views.len()],
            person_count: truth.as_ref().map(|truth| truth.persons),
            maps,
            truth,
            notes,
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
