//! Raw captures: `adc_data.bin` or a `.pcap` of a DCA1000, the four files of a cascade, or a cube of samples (`.npy`), with the
//! configuration that was recorded beside them (`.mmwave.json` or `.cfg`), or a manifest that says it (`[capture]`).
//!
//! A frame is made when it is asked for: bytes, samples, range and Doppler FFTs, and the maps that are wished for:
//!
//! | `views` | axes | made of |
//! |---|---|---|
//! | `range_azimuth` | range, sine of the cone angle | the line of virtual elements along y, powers summed over Doppler |
//! | `range_elevation` | range, sine of the elevation | the lines along z, powers summed over them and over Doppler |
//! | `range_doppler` | range, radial speed | all antennas, powers summed |
//! | `cartesian` | depth and y (upright: z), m | the first or second of these, cell by cell |
//! | `cube` | range, sine, radial speed | the line, amplitudes |
//! | `cartesian_cube` | z, y, x, m | all rows of antennas, where they lie above each other; powers summed over Doppler |
//!
//! Their point-spread widths follow from the chain.

mod form;
mod frames;
mod maker;
mod settings;

pub use form::ChirpForm;
pub(super) use frames::tell_iq;
pub(super) use maker::Maker;
pub(super) use settings::{config_in, processing_of, settings_from};

use super::pattern::leads_out;
use super::{DataFolder, Layout, Opened, manifest_beside};
use crate::dataset::DatasetError;
use crate::dataset::adc::{AdcText, SampleSource, cascade_of, chip_of, is_npy};
use crate::dataset::axes_text::axes_badge;
use crate::dataset::manifest::Manifest;
use crate::dataset::set::parent;
use crate::task::Progress;
use form::Forms;
use frames::Frames;
use settings::{config_beside, settings_of};
use std::path::{Path, PathBuf};

/// The layout.
#[derive(Debug)]
pub(super) struct Dca;

/// A map that is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ViewWish {
    RangeAzimuth,
    RangeElevation,
    RangeDoppler,
    Cartesian,
    Cube,
    CartesianCube,
}

impl ViewWish {
    const NAMES: &str =
        "\"range_azimuth\", \"range_elevation\", \"range_doppler\", \"cartesian\", \"cube\", \"cartesian_cube\"";
    const ALL: [Self; 6] = [
        Self::RangeAzimuth,
        Self::RangeElevation,
        Self::RangeDoppler,
        Self::Cartesian,
        Self::Cube,
        Self::CartesianCube,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::RangeAzimuth => "range_azimuth",
            Self::RangeElevation => "range_elevation",
            Self::RangeDoppler => "range_doppler",
            Self::Cartesian => "cartesian",
            Self::Cube => "cube",
            Self::CartesianCube => "cartesian_cube",
        }
    }

    fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|wish| wish.name() == name)
    }
}

impl Layout for Dca {
    fn word(&self) -> &'static str {
        "capture"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((include_str!("../../../../assets/capture.toml"), "assets/capture.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("a capture (.bin or .pcap) with its .cfg or .mmwave.json")
    }

    /// A cube of numbers is a capture where the manifest beside it says so.
    fn claims(&self, file: &Path) -> bool {
        let said =
            || Manifest::in_folder(parent(file)).ok().flatten().is_some_and(|found| found.layout.word() == "capture");
        is_capture(file) || is_npy(file) && said()
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
            None => files_in(place.root)?.into_iter().filter(|path| is_capture(path) && is_first(path)).collect(),
        };
        match &captures[..] {
            [one]
                if said(place).chirp.is_some()
                    || config_beside(one, place)?.is_some()
                    || remembered(one, place)?.is_some() =>
            {
                open_capture(one, place)
            }
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

/// Whether a file stands for its capture: of a cascade's, only the master's samples do.
fn is_first(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    chip_of(file).map_or_else(|| !name.ends_with("_idx.bin"), |(chip, _)| chip == 0)
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

/// What a person said of a capture of which no file says anything.
fn remembered(capture: &Path, place: &DataFolder<'_>) -> Result<Option<Manifest>, DatasetError> {
    if said(place).chirp.is_some() || config_beside(capture, place)?.is_some() {
        return Ok(None);
    }
    Ok(Forms::of_user().and_then(|forms| forms.recall(capture)))
}

fn open_capture(capture: &Path, place: &DataFolder<'_>) -> Result<Opened, DatasetError> {
    if let Some(manifest) = remembered(capture, place)? {
        return open_told(capture, &DataFolder { manifest: &manifest, ..*place });
    }
    open_told(capture, place)
}

fn open_told(capture: &Path, place: &DataFolder<'_>) -> Result<Opened, DatasetError> {
    let (settings, config) = settings_of(capture, place)?;
    let files = cascade_of(capture)?.unwrap_or_else(|| vec![capture.to_owned()]);
    if settings.chirp.rx % files.len() != 0 {
        let message = format!("{} receivers; expected as many of each of {} chips", settings.chirp.rx, files.len());
        return Err(DatasetError::Manifest { message, line: None, path: config });
    }
    let processing = processing_of(&settings, place, files.len())?;
    let source = SampleSource::open(&files, &settings)?;
    let (count, rest) = source.frames(&settings);
    if count == 0 {
        let message = format!(
            "{rest} bytes of samples; expected at least {}, a frame of {}",
            settings.frame_bytes() / files.len() as u64,
            config.display()
        );
        return Err(DatasetError::Frame { message, path: capture.to_owned() });
    }
    if !place.manifest.views.is_empty() {
        let message = "[[view]]: the views of a capture follow from its chirps; expected none".to_owned();
        return Err(DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() });
    }
    let name = capture.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    let frames = Frames::new(name, source, Maker::new(settings, &processing), count)?;
    let mut info = place.info(&place.manifest.layout.preset()?);
    info.radar = frames.maker().radar().clone();
    (info.views, info.calibrations) = frames.maker().views().map_err(|message| frames.fault(message))?;
    info.axes_badge = axes_badge(&info.views);
    info.frame_rate_hz = info.frame_rate_hz.or(Some(1.0 / frames.maker().chirp().period_s));
    if place.manifest.name.is_none() {
        frames.name().clone_into(&mut info.name);
    }
    info.assumptions = frames.assumptions(&config);
    info.notes = frames.notes();
    if rest > 0 {
        info.notes.push(format!("{rest} bytes at the end are no whole frame; they are left out"));
    }
    Ok(Opened { info, frames: Box::new(frames), named: None })
}
