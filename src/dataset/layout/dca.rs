//! Raw captures of a DCA1000: `adc_data.bin` or a `.pcap`, with the configuration that was recorded beside it (`.mmwave.json` or
//! `.cfg`), or a manifest that says it (`[capture]`).
//!
//! A frame is made when it is asked for: bytes, samples, range and Doppler FFTs, and two maps, `range_azimuth` (the line of
//! virtual elements along y, powers summed over Doppler) and `range_doppler` (powers summed over the antennas). Their point-spread
//! widths follow from the chain.

use super::pattern::leads_out;
use super::{DataFolder, FrameSource, Layout, Opened, manifest_beside};
use crate::dataset::adc::{AdcSettings, AdcText, IqOrder, Payload, WordOrder, decode, parse_cfg, parse_studio};
use crate::dataset::axes_text::axes_badge;
use crate::dataset::manifest::Manifest;
use crate::dataset::set::{DatasetInfo, parent};
use crate::dataset::{DatasetError, Frame, Heatmap, MapArray};
use crate::input::{MOST_TEXT, read_text};
use crate::radar::{Axis, AxisKind, Board, Chain, FftSetup, Fmcw, PointSpread, Spacing, View, Window};
use crate::task::Progress;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bins of the sine of the angle.
const SINES: usize = 64;
/// Ranges beyond this are dropped where nothing is said, m.
const MAX_RANGE_M: f64 = 10.0;
/// Bytes of a frame that are accepted.
const MOST_FRAME: u64 = 64 << 20;
/// How much more energy a room's side of the range spectrum must have, for the order of I and Q to be told by it.
const CLEAR: f64 = 1.2;

/// The layout.
#[derive(Debug)]
pub(super) struct Dca;

impl Layout for Dca {
    fn word(&self) -> &'static str {
        "capture"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((include_str!("../../../assets/capture.toml"), "assets/capture.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("a capture (.bin or .pcap) with its .cfg or .mmwave.json")
    }

    fn claims(&self, file: &Path) -> bool {
        is_capture(file)
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        progress.begin("listing files", 0);
        let without = || place.without_frames("a capture (.bin or .pcap) with its .cfg or .mmwave.json".into());
        if let Some(outside) = names_of(place).find(|name| leads_out(name) && !place.allow_outside) {
            let (line, path) = (place.manifest.frames_line, place.manifest.path.clone());
            return Err(DatasetError::Outside { frames: outside.to_owned(), line, path });
        }
        let named = place.manifest.frames.as_ref().map(|name| place.root.join(name));
        let captures: Vec<PathBuf> = match named {
            Some(path) => vec![path],
            None => files_in(place.root)?.into_iter().filter(|path| is_capture(path)).collect(),
        };
        match &captures[..] {
            [one] if said(place).chirp.is_some() || config_beside(one, place)?.is_some() => open_capture(one, place),
            [] | [_] => Err(without()),
            several => {
                let names = several.iter().map(|path| path.file_name().unwrap_or_default().to_string_lossy());
                let names = names.collect::<Vec<_>>().join(", ");
                let message = format!("{} captures in it ({names}); open one of them", several.len());
                Err(DatasetError::Frame { message, path: place.root.to_owned() })
            }
        }
    }

    fn open_file(&self, file: &Path, manifest: Option<&Manifest>, _: &Progress) -> Result<Opened, DatasetError> {
        let found = manifest.cloned().map_or_else(|| manifest_beside(file, &Self), Ok)?;
        open_capture(file, &DataFolder { root: parent(file), manifest: &found, allow_outside: false })
    }
}

fn is_capture(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("bin") || ending.eq_ignore_ascii_case("pcap"))
}

/// The files that a manifest names.
fn names_of<'a>(place: &DataFolder<'a>) -> impl Iterator<Item = &'a str> {
    let config = place.manifest.capture.as_ref().and_then(|capture| capture.config.as_deref());
    place.manifest.frames.as_deref().into_iter().chain(config)
}

/// The files of a folder, in the order of their names.
fn files_in(root: &Path) -> Result<Vec<PathBuf>, DatasetError> {
    let unreadable = |reason| DatasetError::Read { reason, path: root.to_owned() };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(root).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn said(place: &DataFolder<'_>) -> AdcText {
    place.manifest.capture.clone().unwrap_or_default()
}

/// The configuration of a capture: what the manifest names, else the only one beside it.
fn config_beside(capture: &Path, place: &DataFolder<'_>) -> Result<Option<PathBuf>, DatasetError> {
    if let Some(name) = said(place).config {
        return Ok(Some(place.root.join(name)));
    }
    let configs = files_in(parent(capture))?;
    let ends = |path: &Path, ending: &str| path.to_string_lossy().to_lowercase().ends_with(ending);
    for ending in [".mmwave.json", ".cfg"] {
        let found: Vec<&PathBuf> = configs.iter().filter(|path| ends(path, ending)).collect();
        match found[..] {
            [] => {}
            [one] => return Ok(Some(one.clone())),
            [first, second, ..] => {
                let message = format!(
                    "two configurations beside it, {} and {}; say in a dataset.toml which is its own: layout = \"capture\", [capture] \
                     config = \"…\"",
                    first.file_name().unwrap_or_default().to_string_lossy(),
                    second.file_name().unwrap_or_default().to_string_lossy()
                );
                return Err(DatasetError::Frame { message, path: capture.to_owned() });
            }
        }
    }
    Ok(None)
}

/// What a capture was recorded with, from a file or the manifest, and which it was.
fn settings_of(capture: &Path, place: &DataFolder<'_>) -> Result<(AdcSettings, PathBuf), DatasetError> {
    let text = said(place);
    let (mut settings, from) = if let Some(chirp) = &text.chirp {
        let settings = AdcSettings { chirp: chirp.settings(), words: WordOrder::default() };
        (settings, place.manifest.path.clone())
    } else {
        let Some(path) = config_beside(capture, place)? else {
            let message = "nothing beside it says what it is; expected its .cfg or .mmwave.json, or a dataset.toml with layout = \
                           \"capture\" and [capture.chirp]";
            return Err(DatasetError::Frame { message: message.into(), path: capture.to_owned() });
        };
        let content = read_text(&path, "a radar's configuration", MOST_TEXT)
            .map_err(|reason| DatasetError::Read { reason, path: path.clone() })?;
        let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        (if is_json { parse_studio(&content, &path) } else { parse_cfg(&content, &path) }?, path)
    };
    let fault = |message: String| DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() };
    if let Some(message) = settings.chirp.fault() {
        return Err(fault(format!("[capture.chirp]: {message}")));
    }
    let words = &mut settings.words;
    words.complex = text.complex.unwrap_or(words.complex);
    words.offset_binary = text.offset_binary.unwrap_or(words.offset_binary);
    words.lanes = text.lanes.unwrap_or(words.lanes);
    words.bits = text.bits.unwrap_or(words.bits);
    if ![2, 4].contains(&words.lanes) {
        return Err(fault(format!("[capture]: `lanes` is {}; expected 2 or 4", words.lanes)));
    }
    if ![12, 14, 16].contains(&words.bits) {
        return Err(fault(format!("[capture]: `bits` is {}; expected 12, 14 or 16", words.bits)));
    }
    words.iq = match text.iq.as_deref() {
        None => words.iq,
        Some("i_first") => Some(IqOrder::IFirst),
        Some("q_first") => Some(IqOrder::QFirst),
        Some(other) => {
            return Err(fault(format!("[capture]: `iq` is \"{other}\"; expected \"i_first\" or \"q_first\"")));
        }
    };
    if settings.frame_bytes() > MOST_FRAME {
        let message =
            format!("its chirps make {} bytes a frame; expected at most {MOST_FRAME}", settings.frame_bytes());
        return Err(DatasetError::Manifest { message, line: None, path: from });
    }
    Ok((settings, from))
}

/// What is done with the samples.
struct Processing {
    board: Board,
    chain: Chain,
}

fn processing_of(settings: &AdcSettings, place: &DataFolder<'_>) -> Result<Processing, DatasetError> {
    let text = said(place);
    let fault = |message: String| DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() };
    let board = text.board.as_deref().map_or(Some(Board::default()), Board::named);
    let board = board.ok_or_else(|| fault("[capture]: `board` is unknown; expected \"isk\" or \"line\"".into()))?;
    let window = match text.window.as_deref() {
        None | Some("hann") => Window::Hann,
        Some("rectangular") => Window::Rectangular,
        Some("hamming") => Window::Hamming,
        Some("blackman") => Window::Blackman,
        Some(other) => {
            return Err(fault(format!(
                "[capture]: `window` is \"{other}\"; expected \"rectangular\", \"hann\", \"hamming\" or \"blackman\""
            )));
        }
    };
    let padding = text.padding.unwrap_or(1);
    if !(1..=4).contains(&padding) {
        return Err(fault(format!("[capture]: `padding` is {padding}; expected 1 to 4")));
    }
    let max_range_m = text.max_range_m.unwrap_or(MAX_RANGE_M);
    if !(max_range_m > 0.0 && max_range_m <= 1e4) {
        return Err(fault(format!("[capture]: `max_range_m` is {max_range_m}; expected a number above 0, up to 1e4")));
    }
    let chirp = &settings.chirp;
    // Of real samples the upper half of the spectrum is the lower one's mirror image.
    let most = chirp.range_max_m() * if settings.words.complex { 1.0 } else { 0.5 };
    let chain = Chain {
        range_window: window,
        range_fft: padding * chirp.samples,
        doppler_window: window,
        doppler_fft: padding * chirp.loops,
        angle_window: Window::Rectangular,
        angle_fft: SINES,
        still_share: if text.remove_static.unwrap_or(true) && chirp.loops > 1 { 0.0 } else { 1.0 },
        max_range_m: max_range_m.min(most),
    };
    Ok(Processing { board, chain })
}

fn open_capture(capture: &Path, place: &DataFolder<'_>) -> Result<Opened, DatasetError> {
    let (settings, config) = settings_of(capture, place)?;
    let Processing { board, chain } = processing_of(&settings, place)?;
    let payload = Payload::open(capture)?;
    let frame_bytes = settings.frame_bytes();
    let count = usize::try_from(payload.len() / frame_bytes).unwrap_or(usize::MAX);
    if count == 0 {
        let message = format!(
            "{} bytes of samples; expected at least {frame_bytes}, a frame of {}",
            payload.len(),
            config.display()
        );
        return Err(DatasetError::Frame { message, path: capture.to_owned() });
    }
    if !place.manifest.views.is_empty() {
        let message = "[[view]]: the views of a capture follow from its chirps; expected none".to_owned();
        return Err(DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() });
    }
    let fmcw = settings.chirp.fmcw(board, chain.max_range_m);
    let mut frames = Frames {
        name: capture.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        line: fmcw.array.line_along_y(fmcw.radar.l_az_m),
        payload,
        settings,
        chain,
        fmcw,
        iq: IqOrder::IFirst,
        count,
    };
    let mut info = place.info(&place.manifest.layout.preset()?);
    let (iq, how) = frames.tell_iq()?;
    frames.iq = iq;
    info.radar = frames.fmcw.radar.clone();
    info.views = frames.views()?.into();
    info.axes_badge = axes_badge(&info.views);
    info.frame_rate_hz = info.frame_rate_hz.or(Some(1.0 / frames.settings.chirp.period_s));
    if place.manifest.name.is_none() {
        info.name.clone_from(&frames.name);
    }
    info.assumptions = frames.assumptions(&config, &how, board);
    info.notes = frames.settings.chirp.warnings();
    info.notes.extend(frames.lost(frame_bytes));
    Ok(Opened { info, frames: Box::new(frames), named: None })
}

/// The frames of a capture.
#[derive(Debug)]
struct Frames {
    name: String,
    payload: Payload,
    settings: AdcSettings,
    chain: Chain,
    fmcw: Fmcw,
    /// Channels of the line along y.
    line: Vec<usize>,
    iq: IqOrder,
    count: usize,
}

impl Frames {
    /// What comes first of a sample, and how that is known: said, told by the first frame, or assumed.
    fn tell_iq(&self) -> Result<(IqOrder, String), DatasetError> {
        let words = self.settings.words;
        if !words.complex {
            return Ok((IqOrder::IFirst, "samples are real".into()));
        }
        if let Some(iq) = words.iq {
            return Ok((iq, format!("{}, as the manifest says", iq.words())));
        }
        let bytes = self.payload.read(0, self.settings.frame_bytes() as usize)?;
        let ratio = decode(&bytes, &self.settings, IqOrder::IFirst).upper_to_lower();
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
    fn assumptions(&self, config: &Path, iq: &str, board: Board) -> Vec<String> {
        let name = config.file_name().unwrap_or_default().to_string_lossy();
        let still = if self.chain.still_share == 0.0 { "taken away (remove_static)" } else { "kept" };
        vec![
            format!("chirp, from {name}: {}", self.settings.chirp.words()),
            format!("samples: {iq}"),
            format!("what stands still: {still}, the mean over the chirps of a frame"),
            format!(
                "antennas: those of board \"{}\", {} of them a line along y; which side is left is assumed",
                board.name(),
                self.line.len()
            ),
        ]
    }

    /// What is missing of the signal.
    fn lost(&self, frame_bytes: u64) -> Vec<String> {
        let (gaps, rest) = (self.payload.gaps(), self.payload.len() % frame_bytes);
        let of_gaps = (gaps.count > 0).then(|| {
            let s = if gaps.count == 1 { "" } else { "s" };
            format!("{} bytes in {} gap{s} were lost on the way; they are 0", gaps.bytes, gaps.count)
        });
        let of_rest = (rest > 0).then(|| format!("{rest} bytes at the end are no whole frame; they are left out"));
        of_gaps.into_iter().chain(of_rest).collect()
    }

    /// The samples of a frame.
    fn samples(&self, frame: usize) -> Result<crate::radar::AdcCube, DatasetError> {
        let len = self.settings.frame_bytes();
        let bytes = self.payload.read(frame as u64 * len, len as usize)?;
        Ok(decode(&bytes, &self.settings, self.iq))
    }

    /// The maps of a frame in the order of the views.
    fn maps_of(&self, frame: usize) -> Result<Vec<Heatmap>, DatasetError> {
        let spectra = self.chain.range_doppler(&self.fmcw, &self.samples(frame)?);
        let of = |shape: Vec<usize>, data: Vec<f64>| Heatmap { shape, data, dtype: "<i2".into() };
        let mut maps = Vec::new();
        if self.line.len() > 1 {
            let line = spectra.of_channels(&self.line);
            let polar = self.chain.polar_of(&self.fmcw, self.fmcw.radar.l_az_m, &line);
            maps.push(of(vec![polar.ranges, polar.sines], polar.data));
        }
        if spectra.dopplers > 1 {
            maps.push(of(vec![spectra.ranges, spectra.dopplers], spectra.amplitudes()));
        }
        Ok(maps)
    }

    /// The views, with axes and point-spread widths as the chain makes them.
    fn views(&self) -> Result<Vec<View>, DatasetError> {
        let (chain, chirp) = (&self.chain, &self.settings.chirp);
        let setup = FftSetup {
            range: (chirp.samples, chain.range_window),
            doppler: (chirp.loops, chain.doppler_window),
            azimuth: (self.line.len() > 1).then_some((self.line.len(), chain.angle_window)),
            elevation: None,
        };
        let psf = setup.point_spread(&self.fmcw.radar);
        // The first frame tells the shapes: what the chain makes is not worked out twice.
        let shapes: Vec<Vec<usize>> = self.maps_of(0)?.into_iter().map(|map| map.shape).collect();
        let range_step = self.fmcw.unambiguous_range_m() / chain.range_fft as f64;
        let range = |bins: usize| Axis {
            kind: AxisKind::Range,
            bins,
            lo: 0.0,
            hi: bins as f64 * range_step,
            spacing: Spacing::Linear,
        };
        let centred = |kind: AxisKind, bins: usize, step: f64, spacing: Spacing| {
            let lo = -((bins / 2) as f64) * step;
            Axis { kind, bins, lo, hi: lo + bins as f64 * step, spacing }
        };
        let view = |array: &str, psf: PointSpread, axes: Vec<Axis>| View {
            array: array.into(),
            quantity: crate::radar::Quantity::Amplitude,
            psf,
            pose: crate::geometry::Pose::default(),
            axes,
            region: None,
        };
        let mut views = Vec::new();
        let mut shapes = shapes.into_iter();
        if self.line.len() > 1
            && let Some([ranges, sines]) = shapes.next().as_deref()
        {
            let sine = centred(AxisKind::Cone, *sines, 2.0 / *sines as f64, Spacing::Sine);
            views.push(view("range_azimuth", psf, vec![range(*ranges), sine]));
        }
        if let Some([ranges, dopplers]) = shapes.next().as_deref() {
            let step = chirp.speed_step_mps() * chirp.loops as f64 / *dopplers as f64;
            let speed = centred(AxisKind::Doppler, *dopplers, step, Spacing::Linear);
            views.push(view("range_doppler", psf, vec![range(*ranges), speed]));
        }
        if views.is_empty() {
            let message = "one antenna and one chirp: there is no map to make of it".to_owned();
            return Err(DatasetError::Frame { message, path: self.payload.path().to_owned() });
        }
        Ok(views)
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
        vec![self.payload.path().to_owned()]
    }

    /// No array of the file is a map.
    fn arrays(&self, _place: usize, _info: &DatasetInfo) -> Vec<MapArray> {
        Vec::new()
    }

    fn maps(&self, frames: Range<usize>, _info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| self.maps_of(i)).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        Ok(Frame {
            timestamp_s: Some(i as f64 * self.settings.chirp.period_s),
            maps: self.maps_of(i)?,
            map_boxes: vec![Vec::new(); info.views.len()],
            ..Frame::default()
        })
    }
}
