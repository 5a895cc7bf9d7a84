//! What a capture was recorded with, and what is to be made of it: from the configuration beside it and from `[capture]`.

use super::{ViewWish, files_in, said};
use crate::dataset::DatasetError;
use crate::dataset::adc::{AdcSettings, AdcText, IqOrder, WordOrder, parse_cfg, parse_studio};
use crate::dataset::calibration::per_axis;
use crate::dataset::layout::DataFolder;
use crate::dataset::set::parent;
use crate::input::{MOST_TEXT, read_text};
use crate::radar::{Board, Chain, Window};
use std::path::{Path, PathBuf};

/// Bins of the sine of the angle; twice the elements where those are more.
const SINES: usize = 64;
/// Ranges beyond this are dropped where nothing is said, m.
const MAX_RANGE_M: f64 = 10.0;
/// Bytes of a frame that are accepted.
const MOST_FRAME: u64 = 64 << 20;

/// The configuration of a capture: what the manifest names, else the only one beside it.
pub(super) fn config_beside(capture: &Path, place: &DataFolder<'_>) -> Result<Option<PathBuf>, DatasetError> {
    if let Some(name) = said(place).config {
        return Ok(Some(place.root.join(name)));
    }
    config_in(parent(capture), capture)
}

/// The only configuration in a folder; `capture` is for messages.
///
/// # Errors
/// Where the folder cannot be read, or has two.
pub(in crate::dataset::layout) fn config_in(folder: &Path, capture: &Path) -> Result<Option<PathBuf>, DatasetError> {
    let configs = files_in(folder)?;
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
pub(super) fn settings_of(capture: &Path, place: &DataFolder<'_>) -> Result<(AdcSettings, PathBuf), DatasetError> {
    let text = said(place);
    let (mut settings, from) = if let Some(chirp) = &text.chirp {
        let settings = AdcSettings { chirp: chirp.settings(), words: WordOrder::default() };
        (settings, place.manifest.path.clone())
    } else {
        let Some(path) = config_beside(capture, place)? else {
            return Err(DatasetError::NeedsChirp { path: capture.to_owned() });
        };
        (settings_in(&path)?, path)
    };
    let from = checked(&text, &mut settings, place, from)?;
    Ok((settings, from))
}

/// What the file of a configuration says, with what the manifest says over it.
///
/// # Errors
/// Where it cannot be read or makes no sense.
pub(in crate::dataset::layout) fn settings_from(
    config: &Path,
    place: &DataFolder<'_>,
) -> Result<AdcSettings, DatasetError> {
    let mut settings = settings_in(config)?;
    checked(&said(place), &mut settings, place, config.to_owned())?;
    Ok(settings)
}

fn settings_in(config: &Path) -> Result<AdcSettings, DatasetError> {
    let content = read_text(config, "a radar's configuration", MOST_TEXT)
        .map_err(|reason| DatasetError::Read { reason, path: config.to_owned() })?;
    let is_json = config.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    if is_json { parse_studio(&content, config) } else { parse_cfg(&content, config) }
}

/// The settings with what the manifest says of words; `from` is where they are from.
fn checked(
    text: &AdcText,
    settings: &mut AdcSettings,
    place: &DataFolder<'_>,
    from: PathBuf,
) -> Result<PathBuf, DatasetError> {
    let fault = |message: String| DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() };
    if let Some(message) = settings.chirp.fault() {
        return Err(fault(format!("[capture.chirp]: {message}")));
    }
    say_words(text, &mut settings.words).map_err(fault)?;
    if settings.frame_bytes() > MOST_FRAME {
        let message =
            format!("its chirps make {} bytes a frame; expected at most {MOST_FRAME}", settings.frame_bytes());
        return Err(DatasetError::Manifest { message, line: None, path: from });
    }
    Ok(from)
}

/// What the manifest says of words, over what the configuration says.
fn say_words(text: &AdcText, words: &mut WordOrder) -> Result<(), String> {
    words.complex = text.complex.unwrap_or(words.complex);
    words.offset_binary = text.offset_binary.unwrap_or(words.offset_binary);
    words.lanes = text.lanes.unwrap_or(words.lanes);
    words.bits = text.bits.unwrap_or(words.bits);
    if ![2, 4].contains(&words.lanes) {
        return Err(format!("[capture]: `lanes` is {}; expected 2 or 4", words.lanes));
    }
    if ![12, 14, 16].contains(&words.bits) {
        return Err(format!("[capture]: `bits` is {}; expected 12, 14 or 16", words.bits));
    }
    words.iq = match text.iq.as_deref() {
        None => words.iq,
        Some("i_first") => Some(IqOrder::IFirst),
        Some("q_first") => Some(IqOrder::QFirst),
        Some(other) => return Err(format!("[capture]: `iq` is \"{other}\"; expected \"i_first\" or \"q_first\"")),
    };
    Ok(())
}

/// What is done with the samples.
pub(in crate::dataset::layout) struct Processing {
    pub(super) board: Board,
    /// Whether the board stands on its side: its line of elements measures height.
    pub(super) upright: bool,
    pub(super) chain: Chain,
    /// Length of the angle FFT in multiples of its elements, where it is said.
    pub(super) angle_padding: Option<usize>,
    pub(super) views: Vec<ViewWish>,
}

impl Processing {
    /// Length of the FFT over a line of so many elements.
    pub(super) fn angle_fft(&self, elements: usize) -> usize {
        self.angle_padding.map_or(SINES.max(2 * elements.next_power_of_two()), |times| times * elements)
    }
}

pub(in crate::dataset::layout) fn processing_of(
    settings: &AdcSettings,
    place: &DataFolder<'_>,
    chips: usize,
) -> Result<Processing, DatasetError> {
    let text = said(place);
    let fault = |message: String| DatasetError::Manifest {
        message: format!("[capture]: {message}"),
        line: None,
        path: place.manifest.path.clone(),
    };
    let usual = if chips > 1 { Board::Cascade } else { Board::default() };
    let board = text.board.as_deref().map_or(Some(usual), Board::named);
    let board = board.ok_or_else(|| fault("`board` is unknown; expected \"isk\", \"line\" or \"cascade\"".into()))?;
    let upright = match text.mount.as_deref() {
        None | Some("flat") => false,
        Some("upright") => true,
        Some(other) => return Err(fault(format!("`mount` is \"{other}\"; expected \"flat\" or \"upright\""))),
    };
    let window = |value: &toml::Value| value.as_str().and_then(Window::named);
    let hann = toml::Value::String("hann".into());
    let said_window = text.window.as_ref().unwrap_or(&hann);
    let [range, doppler, angle] =
        per_axis("window", said_window, Window::Hann, (window, Window::NAMES)).map_err(fault)?;
    // One name is for samples and chirps: elements are few, and a taper over them costs resolution.
    let angle = if said_window.get("angle").is_some() { angle } else { Window::Rectangular };
    let times = |value: &toml::Value| {
        value.as_integer().and_then(|n| usize::try_from(n).ok()).filter(|n| (1..=4).contains(n)).map(Some)
    };
    let expected = (times, "a whole number, 1 to 4");
    let padding = text.padding.as_ref().map_or(Ok([None; 3]), |value| per_axis("padding", value, None, expected));
    let padding = padding.map_err(fault)?;
    // One number is for samples and chirps too.
    let angle_padding = padding[2].filter(|_| text.padding.as_ref().is_some_and(toml::Value::is_table));
    let max_range_m = text.max_range_m.unwrap_or(MAX_RANGE_M);
    if !(max_range_m > 0.0 && max_range_m <= 1e4) {
        return Err(fault(format!("`max_range_m` is {max_range_m}; expected a number above 0, up to 1e4")));
    }
    let views = match &text.views {
        None if upright => vec![ViewWish::RangeElevation, ViewWish::RangeDoppler],
        None => vec![ViewWish::RangeAzimuth, ViewWish::RangeDoppler],
        Some(names) if names.is_empty() => return Err(fault("`views` is empty; expected at least one".into())),
        Some(names) => names
            .iter()
            .map(|name| {
                ViewWish::named(name).ok_or_else(|| {
                    fault(format!("`views` has \"{name}\"; expected one or more of {}", ViewWish::NAMES))
                })
            })
            .collect::<Result<Vec<_>, _>>()?,
    };
    let chirp = &settings.chirp;
    // Of real samples the upper half of the spectrum is the lower one's mirror image.
    let most = chirp.range_max_m() * if settings.words.complex { 1.0 } else { 0.5 };
    let chain = Chain {
        range_window: range,
        range_fft: padding[0].unwrap_or(1) * chirp.samples,
        doppler_window: doppler,
        doppler_fft: padding[1].unwrap_or(1) * chirp.loops,
        angle_window: angle,
        // Of how many elements the line is made, the board tells.
        angle_fft: 0,
        still_share: if text.remove_static.unwrap_or(true) && chirp.loops > 1 { 0.0 } else { 1.0 },
        max_range_m: max_range_m.min(most),
    };
    Ok(Processing { board, upright, chain, angle_padding, views })
}
