//! Raw captures: `single_<k>/{hori,vert}/adc_data.bin`, two lanes, I first, 64 loops of 3 transmitters in turn, 4 receivers, 256
//! samples, 786,432 bytes a frame. Both become maps by HuPR's own processing (`radar::hupr_cube`), no cube is kept.

use super::annotations::{Annotations, splits_of};
use super::{DataFolder, DatasetInfo, Folders, Opened, RADARS, Segment, assumptions, truth_path};
use crate::dataset::adc::{AdcSettings, ChainStages, IqOrder, Payload, WordOrder, decode};
use crate::dataset::layout::arrays::truth_beside;
use crate::dataset::layout::{FrameSource, MapArray};
use crate::dataset::natural::natural;
use crate::dataset::walk::Walk;
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::{
    AdcCube, Board, Chain, ChirpSettings, FftSetup, HUPR_SHAPE, Spacing, View, Window, hupr_amplitudes, hupr_cube,
};
use crate::task::Progress;
use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The name of a capture.
const CAPTURE: &str = "adc_data.bin";
/// Folders inside each other that are looked into: those of the two radars included.
const MAX_DEPTH: usize = 8;
/// Frames of a capture that are accepted: HuPR's have 600.
const MOST_FRAMES: u64 = 1_000_000;

/// What HuPR's chirp is taken to be: 77 GHz, 60.012 MHz/µs, 4.4 Msps, 7 µs idle, 65 µs ramp.
fn inferred() -> ChirpSettings {
    ChirpSettings {
        start_hz: 77e9,
        slope_hz_per_s: 60.012e12,
        idle_s: 7e-6,
        adc_start_s: 0.0,
        ramp_s: 65e-6,
        samples: 256,
        sample_rate_hz: 4.4e6,
        loops: 64,
        tx: vec![0, 1, 2],
        rx: 4,
        period_s: 0.1,
    }
}

/// The chirp that a manifest says, with HuPR's sizes, without which its processing has no meaning.
fn said(place: &DataFolder<'_>) -> Result<Option<ChirpSettings>, DatasetError> {
    let Some(text) = place.manifest.capture.as_ref().and_then(|capture| capture.chirp.as_ref()) else {
        return Ok(None);
    };
    let (chirp, usual) = (text.settings(), inferred());
    let fault = |message: String| DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() };
    if let Some(message) = chirp.fault() {
        return Err(fault(format!("[capture.chirp]: {message}")));
    }
    let sizes = |of: &ChirpSettings| (of.samples, of.loops, of.tx.len(), of.rx);
    if sizes(&chirp) != sizes(&usual) || chirp.tx != usual.tx {
        let message =
            "[capture.chirp]: HuPR's processing is of 256 samples, 64 loops, transmitters 0, 1, 2 and 4 receivers";
        return Err(fault(message.into()));
    }
    Ok(Some(chirp))
}

/// Chirp, axes and widths as `[capture.chirp]` of a manifest says them, where it does and has no views of its own.
///
/// # Errors
/// Where that chirp cannot be HuPR's.
pub(super) fn with_chirp(place: &DataFolder<'_>, info: &mut DatasetInfo) -> Result<(), DatasetError> {
    let Some(chirp) = said(place)? else { return Ok(()) };
    if !place.manifest.views.is_empty() {
        return Ok(());
    }
    let radar = chirp.radar(info.radar.r_max_m);
    let (range_m, speed_mps) = (chirp.range_step_m(), chirp.speed_step_mps());
    let of_view = |view: &View| {
        let mut view = view.clone();
        let line = Some((8, Window::Rectangular));
        let along = |name: &str| line.filter(|_| view.array == name);
        let (azimuth, elevation) = (along(RADARS[0]), along(RADARS[1]));
        let setup =
            FftSetup { range: (256, Window::Rectangular), doppler: (64, Window::Rectangular), azimuth, elevation };
        view.psf = setup.point_spread(&radar);
        for axis in view.axes.iter_mut().filter(|axis| axis.spacing == Spacing::Linear) {
            let half = HUPR_SHAPE[0] as f64 / 2.0;
            let (lo, hi) = if axis.kind.is_depth() {
                (94.0 * range_m, 30.0 * range_m)
            } else {
                (-half * speed_mps, half * speed_mps)
            };
            (axis.lo, axis.hi) = (lo, hi);
        }
        view
    };
    info.views = info.views.iter().map(of_view).collect::<Vec<View>>().into();
    info.axes_badge = crate::dataset::axes_badge(&info.views);
    info.radar = radar;
    info.assumptions.push(format!("chirp, as the manifest says: {}", chirp.words()));
    Ok(())
}

/// The name itself where it is that of a capture.
fn capture_name(name: &str) -> Option<&str> {
    (name == CAPTURE).then_some(name)
}

/// Opens captures at or below a folder.
///
/// # Errors
/// Where there are none, or they cannot be looked at.
pub(super) fn open(place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
    let (folders, notes) = Walk { depth: MAX_DEPTH, stem: capture_name, skip: |_| false, progress }.of(place.root)?;
    let mut found: BTreeMap<PathBuf, [bool; 2]> = BTreeMap::new();
    for folder in folders {
        let Some(radar) = RADARS.iter().position(|radar| folder.below.ends_with(radar)) else { continue };
        let sequence = folder.below.parent().unwrap_or(Path::new(""));
        found.entry(place.root.join(sequence)).or_default()[radar] = true;
    }
    if found.is_empty() {
        let expected = "HuPR's single_<k>/hori/NNNNNNNNN.npy and vert/, or single_<k>/{hori,vert}/adc_data.bin, in it or in a folder \
                        below";
        return Err(place.without_frames(expected.into()));
    }
    let settings = AdcSettings { chirp: said(place)?.unwrap_or_else(inferred), words: WordOrder::default() };
    let mut segments = Vec::new();
    for (folder, radars) in found {
        if let Some((_, missing)) = radars.iter().zip(RADARS).find(|(there, _)| !**there) {
            let message = "no such file; a sequence of HuPR has two captures, and the other one is there".to_owned();
            return Err(DatasetError::Frame { message, path: folder.join(missing).join(CAPTURE) });
        }
        let lens = RADARS.map(|radar| Payload::open(&folder.join(radar).join(CAPTURE)).map(|payload| payload.len()));
        let [hori, vert] = lens;
        let frames = (hori?.min(vert?) / settings.frame_bytes()).min(MOST_FRAMES);
        let name = std::path::absolute(&folder).unwrap_or_else(|_| folder.clone());
        let name = name.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        segments.push(Segment::new(folder, name, (0..frames).map(|frame| format!("{frame:09}")).collect()));
    }
    segments.sort_by(|a: &Segment, b: &Segment| natural(&a.path.to_string_lossy(), &b.path.to_string_lossy()));
    let mut info = place.info(&place.manifest.layout.preset()?);
    with_chirp(place, &mut info)?;
    info.notes = notes;
    info.notes.push(splits_of(&segments));
    info.assumptions.extend(assumptions());
    info.assumptions.push(
        "samples: raw captures, I first, processed as HuPR's script does it: the mean over the chirps taken away, no windows, no \
         Doppler compensation"
            .into(),
    );
    let labels = Annotations::beside(place.root, &segments);
    let folders = Folders::new(segments);
    if folders.count() == 0 {
        let message = format!("no whole frame of {} bytes in its captures", settings.frame_bytes());
        return Err(DatasetError::Frame { message, path: place.root.to_owned() });
    }
    Ok(Opened { info, frames: Box::new(RawFrames { folders, labels, settings }), named: None })
}

/// The frames of captures.
#[derive(Debug)]
struct RawFrames {
    folders: Folders,
    labels: Annotations,
    settings: AdcSettings,
}

impl RawFrames {
    /// The samples of a frame of the radar whose map `view` is.
    fn samples(&self, i: usize, radar: &str, info: &DatasetInfo) -> Result<AdcCube, DatasetError> {
        let (segment, stem) = self.folders.at(i, info)?;
        let (number, bytes) = (stem.parse().unwrap_or(u64::MAX), self.settings.frame_bytes());
        let payload = Payload::open(&segment.path.join(radar).join(CAPTURE))?;
        let samples = payload.read(number.saturating_mul(bytes), bytes as usize)?;
        Ok(decode(&samples, &self.settings, IqOrder::IFirst))
    }

    fn maps_of(&self, i: usize, info: &DatasetInfo) -> Result<Vec<Heatmap>, DatasetError> {
        let (segment, _) = self.folders.at(i, info)?;
        let read = |view: &View| {
            let cube = hupr_cube(&self.samples(i, &view.array, info)?);
            let map = Heatmap { shape: view.shape(), data: hupr_amplitudes(&cube), dtype: "<i2".into() };
            if map.data.len() != view.cells() {
                let message = format!("view `{}`: its axes are not those of HuPR's cubes, 16 × 64 × 64", view.array);
                let path = segment.path.join(&view.array).join(CAPTURE);
                return Err(DatasetError::Frame { message, path });
            }
            Ok(map)
        };
        info.views.iter().map(read).collect()
    }
}

impl FrameSource for RawFrames {
    fn count(&self) -> usize {
        self.folders.count()
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        self.folders.name(i, out)
    }

    fn sequences(&self) -> usize {
        self.folders.segments().len()
    }

    fn sequence<'a>(&'a self, i: usize, _name: &'a str) -> Option<&'a str> {
        self.folders.sequence(i)
    }

    fn files(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        let Some((segment, _)) = self.folders.find(i) else { return Vec::new() };
        info.views.iter().map(|view| segment.path.join(&view.array).join(CAPTURE)).collect()
    }

    /// No array of a capture is a map.
    fn arrays(&self, _place: usize, _info: &DatasetInfo) -> Vec<MapArray> {
        Vec::new()
    }

    fn companions(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        self.folders.find(i).map(|(segment, stem)| truth_path(segment, stem)).into_iter().collect()
    }

    fn label_files(&self) -> Vec<PathBuf> {
        self.labels.paths().map(Path::to_owned).collect()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| self.maps_of(i, info)).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let (segment, stem) = self.folders.at(i, info)?;
        let maps = self.maps_of(i, info)?;
        let mut notes = Vec::new();
        let image = self.labels.of(&segment.sequence, stem, &mut notes);
        let known = truth_beside(&truth_path(segment, stem), info.skeleton.joints.len(), &mut notes);
        let labelled = image.as_ref().map(|image| image.keypoints.len().max(image.boxes.len()));
        Ok(Frame {
            global_id: self.labels.who(&segment.sequence),
            timestamp_s: stem.parse::<u32>().ok().map(|number| f64::from(number) * self.settings.chirp.period_s),
            maps,
            map_boxes: vec![Vec::new(); info.views.len()],
            person_count: known.person_count.or(labelled),
            truth: known.truth,
            image,
            notes,
            ..Frame::default()
        })
    }

    fn has_samples(&self) -> bool {
        true
    }

    /// Those of the horizontal radar, without windows as HuPR has it, all that stands still kept.
    fn stages(&self, i: usize, info: &DatasetInfo) -> Result<Option<ChainStages>, DatasetError> {
        let samples = self.samples(i, RADARS[0], info)?;
        let chirp = &self.settings.chirp;
        let fmcw = chirp.fmcw(Board::Isk, info.radar.r_max_m);
        let chain = Chain {
            range_window: Window::Rectangular,
            range_fft: chirp.samples,
            doppler_window: Window::Rectangular,
            doppler_fft: chirp.loops,
            angle_window: Window::Rectangular,
            angle_fft: HUPR_SHAPE[2],
            still_share: 1.0,
            max_range_m: info.radar.r_max_m.min(chirp.range_max_m()),
        };
        let line = fmcw.array.lines(1, fmcw.radar.l_az_m).into_iter().next().unwrap_or_default();
        Ok(Some(ChainStages::of(&samples, &self.settings, (&fmcw, &chain), &line)))
    }
}
