//! The frames of a capture: samples, spectra and maps, made when they are asked for.

use super::ViewWish;
use super::settings::Processing;
use crate::dataset::adc::{AdcSettings, ChainStages, IqOrder, SampleSource};
use crate::dataset::layout::FrameSource;
use crate::dataset::manifest::cells_fault;
use crate::dataset::set::DatasetInfo;
use crate::dataset::{DatasetError, Frame, Heatmap, MapArray, ViewCalibration};
use crate::geometry::{Mat3, Pose};
use crate::radar::{
    AdcCube, Axis, AxisKind, Board, Chain, ChirpSettings, FftSetup, Fmcw, PolarMap, Quantity, RadarConfig,
    RangeDoppler, Spacing, View, ViewFft, ViewSet,
};
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// How much more energy a room's side of the range spectrum must have, for the order of I and Q to be told by it.
const CLEAR: f64 = 1.2;
/// Cells of a Cartesian map along an axis, at most.
const MOST_ROWS: usize = 256;
/// From the middle of a Cartesian map's far edge to its corner, by its depth.
const CORNER: f64 = 1.12;
/// About x by a quarter: y becomes z.
const QUARTER: Mat3 = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];

/// The frames of a capture.
#[derive(Debug)]
pub(super) struct Frames {
    name: String,
    source: SampleSource,
    settings: AdcSettings,
    board: Board,
    upright: bool,
    chain: Chain,
    fmcw: Fmcw,
    /// Channels of the line along y, or along z on an upright board, and those of the lines across it.
    line: Vec<usize>,
    across: Vec<Vec<usize>>,
    views: Vec<ViewWish>,
    iq: IqOrder,
    /// How that is known.
    iq_how: String,
    count: usize,
}

impl Frames {
    /// Those of a source; reads the first frame where nothing says what comes first of a sample.
    pub(super) fn new(
        name: String,
        source: SampleSource,
        settings: AdcSettings,
        processing: &Processing,
        count: usize,
    ) -> Result<Self, DatasetError> {
        let Processing { board, upright, ref chain, ref views, .. } = *processing;
        let mut fmcw = settings.chirp.fmcw(board, chain.max_range_m);
        let spacing_m = fmcw.radar.l_az_m;
        let line = fmcw.array.lines(1, spacing_m).into_iter().next().unwrap_or_default();
        let across = fmcw.array.lines(2, spacing_m);
        if upright {
            fmcw.array = fmcw.array.turned(&QUARTER);
        }
        let corner = if views.contains(&ViewWish::Cartesian) { CORNER } else { 1.0 };
        let most = settings.chirp.range_max_m() * if settings.words.complex { 1.0 } else { 0.5 };
        let chain = Chain {
            angle_fft: processing.angle_fft(line.len()),
            max_range_m: (corner * chain.max_range_m).min(most),
            ..*chain
        };
        let views = views.clone();
        let (iq, iq_how) = (IqOrder::IFirst, String::new());
        let frames =
            Self { name, source, settings, board, upright, chain, fmcw, line, across, views, iq, iq_how, count };
        let (iq, iq_how) = frames.tell_iq()?;
        let frames = Self { iq, iq_how, ..frames };
        match frames.wanting() {
            Some(message) => Err(DatasetError::Frame { message, path: frames.source.path().to_owned() }),
            None => Ok(frames),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn radar(&self) -> &RadarConfig {
        &self.fmcw.radar
    }

    pub(super) fn chirp(&self) -> &ChirpSettings {
        &self.settings.chirp
    }

    /// Channels of lines along y, or along z.
    fn lines_along(&self, up: bool) -> Vec<&[usize]> {
        if up == self.upright { vec![&self.line] } else { self.across.iter().map(Vec::as_slice).collect() }
    }

    /// Elements of them.
    fn elements(&self, up: bool) -> usize {
        self.lines_along(up).first().map_or(0, |line| line.len())
    }

    /// The maps that can be made: what was wished for, but those that are there where nothing was said.
    fn wishes(&self) -> impl Iterator<Item = ViewWish> + '_ {
        self.views.iter().copied().filter(|wish| match wish {
            ViewWish::RangeAzimuth => self.elements(false) > 1,
            ViewWish::RangeElevation => self.elements(true) > 1,
            ViewWish::RangeDoppler => self.settings.chirp.loops > 1,
            ViewWish::Cartesian | ViewWish::Cube => self.line.len() > 1,
        })
    }

    /// What is missing for the maps.
    fn wanting(&self) -> Option<String> {
        (self.wishes().count() == 0).then(|| {
            let names: Vec<&str> = self.views.iter().map(|wish| wish.name()).collect();
            format!(
                "{} antennas in a line and {} chirps: there is no map of {} to make of it",
                self.line.len(),
                self.settings.chirp.loops,
                names.join(", ")
            )
        })
    }

    /// What comes first of a sample, and how that is known: said, told by the first frame, or assumed.
    fn tell_iq(&self) -> Result<(IqOrder, String), DatasetError> {
        let words = self.settings.words;
        if !self.source.has_words() {
            return Ok((IqOrder::IFirst, "complex numbers".into()));
        }
        if !words.complex {
            return Ok((IqOrder::IFirst, "samples are real".into()));
        }
        if let Some(iq) = words.iq {
            return Ok((iq, format!("{}, as the manifest says", iq.words())));
        }
        let ratio = self.source.samples(0, &self.settings, IqOrder::IFirst)?.upper_to_lower();
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

    /// What was assumed, in words.
    pub(super) fn assumptions(&self, config: &Path) -> Vec<String> {
        let name = config.file_name().unwrap_or_default().to_string_lossy();
        let still = if self.chain.still_share == 0.0 { "taken away (remove_static)" } else { "kept" };
        let along = if self.upright { "z: the board stands upright; which end is up" } else { "y; which side is left" };
        vec![
            format!("chirp, from {name}: {}", self.settings.chirp.words()),
            format!("samples: {}", self.iq_how),
            format!("what stands still: {still}, the mean over the chirps of a frame"),
            format!(
                "antennas: those of board \"{}\", {} of them a line along {along} is assumed",
                self.board.name(),
                self.line.len()
            ),
        ]
    }

    /// What the chirps imply, and what is missing of the signal.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = self.settings.chirp.warnings();
        notes.extend(self.source.notes());
        notes
    }

    fn samples(&self, frame: usize) -> Result<AdcCube, DatasetError> {
        self.source.samples(frame as u64, &self.settings, self.iq)
    }

    /// Range × sine of the lines along y, or along z: powers summed over them.
    fn polar(&self, spectra: &RangeDoppler, up: bool) -> PolarMap {
        let spacing_m = self.fmcw.radar.l_az_m;
        let of = |line: &&[usize]| self.chain.polar_of(&self.fmcw, spacing_m, &spectra.of_channels(line));
        let mut maps = self.lines_along(up).iter().map(of).collect::<Vec<_>>().into_iter();
        let Some(mut sum) = maps.next() else { return self.chain.polar_of(&self.fmcw, spacing_m, spectra) };
        for map in maps {
            sum.data.iter_mut().zip(map.data).for_each(|(a, b)| *a = a.hypot(b));
        }
        sum
    }

    /// Range × sine × Doppler of the line.
    fn cube(&self, spectra: &RangeDoppler) -> Vec<f64> {
        let cube = self.chain.cube_of(&self.fmcw, self.fmcw.radar.l_az_m, &spectra.of_channels(&self.line));
        let mut data = Vec::with_capacity(cube.data.len());
        for range in 0..cube.ranges {
            for sine in 0..cube.sines {
                let at = |doppler: usize| cube.data[(range * cube.dopplers + doppler) * cube.sines + sine].norm();
                data.extend((0..cube.dopplers).map(at));
            }
        }
        data
    }

    /// The maps of a frame in the order of the views, which are `views`.
    fn maps_of(&self, frame: usize, views: &[View]) -> Result<Vec<Heatmap>, DatasetError> {
        let spectra = self.chain.range_doppler(&self.fmcw, &self.samples(frame)?);
        let map = |(wish, view): (ViewWish, &View)| {
            let data = match wish {
                ViewWish::RangeAzimuth => self.polar(&spectra, false).data,
                ViewWish::RangeElevation => self.polar(&spectra, true).data,
                ViewWish::RangeDoppler => spectra.amplitudes(),
                ViewWish::Cartesian => match &view.axes[..] {
                    [depth, lateral] => self.polar(&spectra, self.upright).cartesian(depth, lateral),
                    _ => Vec::new(),
                },
                ViewWish::Cube => self.cube(&spectra),
            };
            Heatmap { shape: view.shape(), data, dtype: "<i2".into() }
        };
        Ok(self.wishes().zip(views).map(map).collect())
    }

    /// The views, with axes and point-spread widths as the chain makes them.
    pub(super) fn views(&self) -> Result<(ViewSet, Vec<ViewCalibration>), DatasetError> {
        let (chain, chirp, radar) = (&self.chain, &self.settings.chirp, &self.fmcw.radar);
        let elements = |up: bool| Some((self.elements(up), chain.angle_window)).filter(|set| set.0 > 1);
        let setup = FftSetup {
            range: (chirp.samples, chain.range_window),
            doppler: (chirp.loops, chain.doppler_window),
            azimuth: elements(false),
            elevation: elements(true),
        };
        let fft = ViewFft { setup, radar: radar.clone() };
        let linear = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        let centred = |kind, bins: usize, step: f64, spacing| {
            let lo = -((bins / 2) as f64) * step;
            Axis { kind, bins, lo, hi: lo + bins as f64 * step, spacing }
        };
        let range_step = self.fmcw.unambiguous_range_m() / chain.range_fft as f64;
        let ranges = chain.ranges(&self.fmcw);
        let range = || linear(AxisKind::Range, ranges, 0.0, ranges as f64 * range_step);
        let sine = |up: bool| {
            let bins = chain.angle_fft.max(self.elements(up));
            let kind = if up { AxisKind::Elevation } else { AxisKind::Cone };
            centred(kind, bins, radar.wavelength_m() / (radar.l_az_m * bins as f64), Spacing::Sine)
        };
        let dopplers = chain.doppler_fft.max(chirp.loops);
        let doppler = || {
            let step = chirp.speed_step_mps() * chirp.loops as f64 / dopplers as f64;
            centred(AxisKind::Doppler, dopplers, step, Spacing::Linear)
        };
        let of = |wish: ViewWish| {
            let axes = match wish {
                ViewWish::RangeAzimuth => vec![range(), sine(false)],
                ViewWish::RangeElevation => vec![range(), sine(true)],
                ViewWish::RangeDoppler => vec![range(), doppler()],
                ViewWish::Cartesian => self.cartesian_axes(range_step),
                ViewWish::Cube => vec![range(), sine(self.upright), doppler()],
            };
            let fft = fft.for_axes(axes.iter().map(|axis| axis.kind));
            let view = View {
                array: wish.name().into(),
                quantity: Quantity::Amplitude,
                psf: fft.point_spread(),
                pose: Pose::default(),
                axes,
                region: None,
            };
            (view, ViewCalibration::derived(fft))
        };
        let (views, calibrations): (Vec<View>, Vec<ViewCalibration>) = self.wishes().map(of).unzip();
        match cells_fault(&views) {
            Some(message) => Err(DatasetError::Frame { message, path: self.source.path().to_owned() }),
            None => Ok((views.into(), calibrations)),
        }
    }

    /// As deep as the ranges go, and as wide: square cells of a range bin, row 0 near, left (or down) first.
    fn cartesian_axes(&self, range_step: f64) -> Vec<Axis> {
        let depth_m = self.chain.max_range_m / CORNER;
        let rows = ((depth_m / range_step) as usize).clamp(2, MOST_ROWS);
        let half = 0.5 * depth_m / rows as f64;
        let axis = |kind, from: f64, to: f64| {
            let half = half.copysign(to - from);
            Axis { kind, bins: rows, lo: from + half, hi: to + half, spacing: Spacing::Linear }
        };
        let side = 0.5 * depth_m;
        if self.upright {
            vec![axis(AxisKind::DepthV, 0.0, depth_m), axis(AxisKind::Z, -side, side)]
        } else {
            vec![axis(AxisKind::DepthH, 0.0, depth_m), axis(AxisKind::Y, side, -side)]
        }
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
        frames.map(|i| self.maps_of(i, &info.views)).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        Ok(Frame {
            timestamp_s: Some(i as f64 * self.settings.chirp.period_s),
            maps: self.maps_of(i, &info.views)?,
            map_boxes: vec![Vec::new(); info.views.len()],
            ..Frame::default()
        })
    }

    fn has_samples(&self) -> bool {
        true
    }

    fn stages(&self, i: usize) -> Result<Option<ChainStages>, DatasetError> {
        let samples = self.samples(i)?;
        Ok(Some(ChainStages::of(&samples, &self.settings, (&self.fmcw, &self.chain), &self.line)))
    }
}
