//! `dataset.toml`: what a generic data set says of itself; SPEC section 6.
//!
//! Unknown keys are errors with their line, because a typo in `bandwidth_hz` would otherwise silently become a default.

use super::DatasetError;
use super::adc::AdcText;
use super::calibration::{FftText, RadarPreset, ViewCalibration, fft_fault};
use super::layout::{LAYOUTS, Layout};
use super::npz::MAX_ELEMENTS;
use super::origin::OriginRule;
use super::set::MANIFEST_NAME;
use crate::body::Skeleton;
use crate::geometry::{IDENTITY, Mat3, Pose, Vec3, dot};
use crate::input::{MOST_TEXT, read_text};
use crate::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View, ViewFft};
use serde::de::{self, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};
use std::f64::consts::TAU;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Cells of all maps of a frame that are accepted: a fit holds some ten numbers for each.
const MAX_CELLS: usize = MAX_ELEMENTS;
/// Bytes of an array's key that are accepted.
const MAX_KEY: usize = 200;
/// Views of a frame that are accepted.
const MAX_VIEWS: usize = 16;

/// A checked manifest. What is `None` takes the layout's preset, or a stated assumption.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// Where it was read from; the preset's name where it is built in.
    pub path: PathBuf,
    /// Name of the data set.
    pub name: Option<String>,
    /// How the frames lie on disk.
    pub layout: &'static dyn Layout,
    /// Files of the frames relative to the folder, with `*` in any part; sorted by name, one frame a file.
    pub frames: Option<String>,
    /// The line of `frames`, counted from 1, for messages.
    pub(super) frames_line: Option<usize>,
    /// Frames a second.
    pub frame_rate_hz: Option<f64>,
    /// The skeleton of the joints.
    pub skeleton: Option<Skeleton>,
    /// Chirp and array.
    pub radar: Option<RadarConfig>,
    /// The views; empty where the layout's own are meant.
    pub views: Vec<View>,
    /// Where the widths of each come from.
    pub calibrations: Vec<ViewCalibration>,
    /// What is said of a raw capture.
    pub capture: Option<AdcText>,
    /// Where frames come from; the first that says something of one holds.
    pub origins: Vec<OriginRule>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestText {
    name: Option<String>,
    #[serde(deserialize_with = "layout_named")]
    layout: &'static dyn Layout,
    frames: Option<Spanned<String>>,
    frame_rate_hz: Option<Spanned<f64>>,
    skeleton: Option<Spanned<SkeletonText>>,
    radar: Option<Spanned<RadarText>>,
    #[serde(default)]
    view: Vec<Spanned<ViewText>>,
    capture: Option<AdcText>,
    #[serde(default)]
    origin: Vec<OriginRule>,
}

/// A view as written; also the form in which chosen axes are remembered.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ViewText {
    array: String,
    #[serde(default)]
    quantity: Quantity,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    psf: Option<PointSpread>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fft: Option<Spanned<FftText>>,
    #[serde(default = "identity")]
    rotation: Mat3,
    #[serde(default)]
    translation: Vec3,
    axes: Vec<Spanned<Axis>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    region: Option<Vec<[usize; 2]>>,
}

fn layout_named<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static dyn Layout, D::Error> {
    let word = String::deserialize(deserializer)?;
    <dyn Layout>::named(&word).filter(|layout| layout.in_manifests()).ok_or_else(|| {
        let known = LAYOUTS.iter().filter(|layout| layout.in_manifests()).map(|layout| format!("`{layout}`"));
        de::Error::custom(format!("unknown variant `{word}`, expected one of {}", known.collect::<Vec<_>>().join(", ")))
    })
}

fn identity() -> Mat3 {
    IDENTITY
}

impl ViewText {
    pub(super) fn into_view(self) -> View {
        let pose = Pose { rotation: self.rotation, translation: self.translation };
        let axes = self.axes.into_iter().map(Spanned::into_inner).collect();
        let psf = self.psf.unwrap_or_default();
        View { array: self.array, quantity: self.quantity, psf, pose, axes, region: self.region }
    }

    pub(super) fn of(view: &View) -> Self {
        let View { array, quantity, psf, pose, axes, region } = view.clone();
        let axes = axes.into_iter().map(|axis| Spanned::new(0..0, axis)).collect();
        let psf = Some(psf);
        Self { array, quantity, psf, fft: None, rotation: pose.rotation, translation: pose.translation, axes, region }
    }
}

/// A radar's name, or a table.
enum RadarText {
    Named(String),
    Said(RadarConfig),
}

impl<'de> Deserialize<'de> for RadarText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = RadarText;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "the name of a radar or a table")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<RadarText, E> {
                Ok(RadarText::Named(name.to_owned()))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RadarText, A::Error> {
                RadarConfig::deserialize(MapAccessDeserializer::new(map)).map(RadarText::Said)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A preset's name, or a table.
struct SkeletonText(Skeleton);

impl<'de> Deserialize<'de> for SkeletonText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Skeleton;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "one of {} or a table", Skeleton::PRESETS.join(", "))
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Skeleton, E> {
                let known = Skeleton::PRESETS.join(", ");
                Skeleton::preset(name).ok_or_else(|| {
                    E::custom(format!("unknown skeleton \"{name}\"; expected one of {known}, or a table"))
                })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Skeleton, A::Error> {
                Skeleton::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(Either).map(Self)
    }
}

impl Manifest {
    /// Reads and checks a manifest.
    ///
    /// # Errors
    /// Where it cannot be read; or naming the line and the key where it is not TOML, has an unknown or missing key, or a
    /// value that makes no sense.
    pub fn from_file(path: &Path) -> Result<Self, DatasetError> {
        let text = read_text(path, "a manifest (TOML)", MOST_TEXT).map_err(|reason| match reason.kind() {
            std::io::ErrorKind::NotFound => DatasetError::NotFound { path: path.to_owned() },
            _ => DatasetError::Read { reason, path: path.to_owned() },
        })?;
        Self::parse(&text, path)
    }

    /// Checks the text of a manifest; `path` is for messages.
    ///
    /// # Errors
    /// As [`Self::from_file`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, DatasetError> {
        let fault = |message: String, span: Option<Range<usize>>| DatasetError::Manifest {
            message,
            line: span.map(|span| line_of(text, span.start)),
            path: path.to_owned(),
        };
        let parsed: ManifestText =
            toml::from_str(text).map_err(|error| fault(in_our_words(error.message()), error.span()))?;
        let check =
            |fault_in: Option<String>, span: Range<usize>| fault_in.map_or(Ok(()), |m| Err(fault(m, Some(span))));
        if let Some(rate) = &parsed.frame_rate_hz {
            check(outside("frame_rate_hz", *rate.get_ref(), 1e-6, 1e6), rate.span())?;
        }
        let mut preset = None;
        let radar = match &parsed.radar {
            None => None,
            Some(said) => Some(match said.get_ref() {
                RadarText::Said(radar) => {
                    check(radar_fault(radar).map(|m| format!("[radar]: {m}")), said.span())?;
                    radar.clone()
                }
                RadarText::Named(name) => {
                    let named = RadarPreset::named(name).map_err(|error| match error {
                        DatasetError::Manifest { message, line: None, path } if *path == **name => {
                            fault(format!("`radar`: {message}"), Some(said.span()))
                        }
                        other => other,
                    })?;
                    preset.insert(named).radar.clone()
                }
            }),
        };
        if let Some(skeleton) = &parsed.skeleton {
            check(skeleton.get_ref().0.fault().map(|m| format!("[skeleton]: {m}")), skeleton.span())?;
        }
        if let Some(frames) = parsed.frames.as_ref().filter(|frames| frames.get_ref().trim().is_empty()) {
            check(Some("`frames` is empty; expected a pattern such as \"frames/*.npz\"".into()), frames.span())?;
        }
        if let Some(one_more) = parsed.view.get(MAX_VIEWS) {
            check(Some(format!("more than {MAX_VIEWS} views; expected at most so many")), one_more.span())?;
        }
        let (mut views, mut calibrations): (Vec<View>, Vec<ViewCalibration>) = (Vec::new(), Vec::new());
        for spanned in parsed.view {
            let span = spanned.span();
            let mut text = spanned.into_inner();
            let lines: Vec<Range<usize>> = text.axes.iter().map(Spanned::span).collect();
            let (said, fft) = (text.psf.is_some(), text.fft.take());
            let mut view = text.into_view();
            let twice = views.iter().any(|other| other.array == view.array);
            let twice = twice.then(|| format!("view `{}` is described twice", view.array));
            check(twice, span.clone())?;
            if let Some(ViewFault { message, axis }) = view_fault(&view) {
                let at = axis.and_then(|axis| lines.get(axis).cloned()).unwrap_or(span);
                return Err(fault(message, Some(at)));
            }
            let preset = preset.as_ref();
            let fft_said = fft;
            let (fft, at, padding) = match (&fft_said, preset) {
                (Some(text), _) => {
                    let known = || parsed.layout.preset().ok().and_then(|preset| preset.radar);
                    let chirp = radar.clone().or_else(known).ok_or_else(|| {
                        let message = format!("view `{}`: [view.fft] needs a chirp; expected [radar]", view.array);
                        fault(message, Some(text.span()))
                    })?;
                    let wrong = |m: String| fault(format!("view `{}`: [view.fft]: {m}", view.array), Some(text.span()));
                    let (fft, padding) = text.get_ref().resolve(&chirp).map_err(wrong)?;
                    (Some(fft), text.span(), padding)
                }
                (None, Some(preset)) => {
                    (preset.view_fft().map_err(|m| fault(m, Some(span.clone())))?, span.clone(), [None; 3])
                }
                (None, None) => (None, span.clone(), [None; 3]),
            };
            let fft = fft.map(|fft| fft.for_axes(view.axes.iter().map(|axis| axis.kind)));
            let refined = preset.and_then(|preset| preset.psf).filter(|_| fft_said.is_none());
            let derived = !said && refined.is_none();
            match &fft {
                // What a preset's radar does not resolve, widths that are stated may.
                Some(fft) if derived || padding != [None; 3] => {
                    let wrong = fft_fault(&view, fft, padding).map(|m| format!("view `{}`: {m}", view.array));
                    check(wrong, at)?;
                }
                None if !said && refined.is_none() => {
                    let message =
                        format!("view `{}`: missing key `psf`, or [view.fft] from which it follows", view.array);
                    return Err(fault(message, Some(span)));
                }
                _ => {}
            }
            if let Some(fft) = fft.as_ref().filter(|_| derived) {
                view.psf = fft.point_spread();
            } else if let Some(psf) = refined.filter(|_| !said) {
                let [horizontal, vertical] = ViewFft::angles(view.axes.iter().map(|axis| axis.kind));
                let only = |on: bool, width: f64| if on { width } else { 0.0 };
                let (azimuth_rad, elevation_rad) =
                    (only(horizontal, psf.azimuth_rad), only(vertical, psf.elevation_rad));
                view.psf = PointSpread { azimuth_rad, elevation_rad, ..psf };
            }
            if let Some(fft) = &fft {
                view.psf.lobes = fft.setup.lobes();
            }
            if let Some(message) = psf_fault(&view) {
                return Err(fault(format!("view `{}`: {message}", view.array), Some(span)));
            }
            views.push(view);
            calibrations.push(ViewCalibration { fft, derived });
            check(cells_fault(&views), span)?;
        }
        let frames_line = parsed.frames.as_ref().map(|frames| line_of(text, frames.span().start));
        let alone = parsed.layout.preset_text().is_none();
        let missing = |key: &str| fault(format!("missing key `{key}`; layout \"{}\" needs it", parsed.layout), None);
        if alone && views.is_empty() {
            return Err(missing("[[view]]"));
        }
        if alone && parsed.skeleton.is_none() {
            return Err(missing("skeleton"));
        }
        Ok(Self {
            path: path.to_owned(),
            name: parsed.name,
            layout: parsed.layout,
            frames: parsed.frames.map(Spanned::into_inner),
            frames_line,
            frame_rate_hz: parsed.frame_rate_hz.map(Spanned::into_inner),
            skeleton: parsed.skeleton.map(|skeleton| skeleton.into_inner().0),
            radar,
            views,
            calibrations,
            capture: parsed.capture,
            origins: parsed.origin,
        })
    }

    /// The manifest in a folder, where there is one.
    ///
    /// # Errors
    /// As [`Self::from_file`].
    pub fn in_folder(folder: &Path) -> Result<Option<Self>, DatasetError> {
        let path = folder.join(MANIFEST_NAME);
        let there = path.try_exists().map_err(|reason| DatasetError::Read { reason, path: path.clone() })?;
        if there { Self::from_file(&path).map(Some) } else { Ok(None) }
    }

    /// One that says nothing but the layout.
    pub(super) fn unsaid(layout: &'static dyn Layout) -> Self {
        Self {
            path: PathBuf::new(),
            name: None,
            layout,
            frames: None,
            frames_line: None,
            frame_rate_hz: None,
            skeleton: None,
            radar: None,
            views: Vec::new(),
            calibrations: Vec::new(),
            capture: None,
            origins: Vec::new(),
        }
    }
}

/// The line, counted from 1, of a byte offset.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

/// `unknown field` is the parser's word; a manifest has keys.
pub(super) fn in_our_words(message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    match message.strip_prefix("unknown field ") {
        Some(rest) => format!("unknown key {}", rest.replacen(", expected", "; expected", 1)),
        None => message.replacen("missing field", "missing key", 1),
    }
}

/// What is wrong with a number that should lie between two others.
fn outside(key: &str, value: f64, least: f64, most: f64) -> Option<String> {
    if value.is_finite() && value > 0.0 {
        let inside = (least..=most).contains(&value);
        return (!inside).then(|| format!("`{key}` is {value:e}; expected {least:e} to {most:e}"));
    }
    Some(format!("`{key}` is {value}; expected a number above 0"))
}

/// The bounds are wider than any radar that exists, and narrow enough for their products to stay finite.
pub(super) fn radar_fault(radar: &RadarConfig) -> Option<String> {
    let numbers = [
        ("start_hz", radar.start_hz, 1e6, 1e13),
        ("bandwidth_hz", radar.bandwidth_hz, 1.0, 1e13),
        ("chirp_s", radar.chirp_s, 1e-12, 1e3),
        ("frame_s", radar.frame_s, 1e-12, 1e3),
        ("r_max_m", radar.r_max_m, 1e-3, 1e5),
        ("l_az_m", radar.l_az_m, 1e-9, 1e3),
        ("l_el_m", radar.l_el_m, 1e-9, 1e3),
    ];
    let few = radar.doppler_features == 0 || radar.doppler_features > 4096;
    let features = || few.then(|| format!("`doppler_features` is {}; expected 1 to 4096", radar.doppler_features));
    let known = radar.height_m.map(|height_m| ("height_m", height_m, 1e-6, 1e3));
    let mut numbers = numbers.into_iter().chain(known);
    numbers.find_map(|(key, value, least, most)| outside(key, value, least, most)).or_else(features)
}

/// What is wrong with a view.
#[derive(Debug)]
pub(super) struct ViewFault {
    /// In words, naming view and key.
    pub(super) message: String,
    /// The axis that it is about.
    axis: Option<usize>,
}

/// What is wrong with a view, in words; `None` if nothing is.
pub(super) fn view_fault(view: &View) -> Option<ViewFault> {
    let fault =
        |axis: Option<usize>, message: String| ViewFault { message: format!("view `{}`: {message}", view.array), axis };
    if view.array.is_empty() {
        let message = "a view's `array` is empty; expected the key of an array".into();
        return Some(ViewFault { message, axis: None });
    }
    if view.array.len() > MAX_KEY || view.array.contains(char::is_control) {
        let shown: String = view.array.chars().take(20).flat_map(char::escape_debug).collect();
        let message = format!(
            "`array` is \"{shown}…\"; expected the key of an array, {MAX_KEY} bytes at most, without control characters"
        );
        return Some(ViewFault { message, axis: None });
    }
    if !(2..=3).contains(&view.axes.len()) {
        return Some(fault(None, format!("{} axes; expected 2 or 3", view.axes.len())));
    }
    let named =
        |(k, axis): (usize, &Axis)| axis_fault(axis).map(|m| (k, format!("axis {k} ({}): {m}", axis.kind.name())));
    if let Some((k, message)) = view.axes.iter().enumerate().find_map(named) {
        return Some(fault(Some(k), message));
    }
    let message = psf_fault(view).or_else(|| pose_fault(view)).or_else(|| region_fault(view))?;
    Some(fault(None, message))
}

/// More cells than a fit can hold, in all views together.
pub(super) fn cells_fault(views: &[View]) -> Option<String> {
    let of_view = |view: &View| view.axes.iter().fold(1_usize, |cells, axis| cells.saturating_mul(axis.bins));
    let cells = views.iter().fold(0_usize, |cells, view| cells.saturating_add(of_view(view)));
    let last = views.last().map_or("", |view| view.array.as_str());
    (cells > MAX_CELLS).then(|| {
        format!("view `{last}`: `bins` make {cells} cells in all views up to this one; expected at most {MAX_CELLS}")
    })
}

fn psf_fault(view: &View) -> Option<String> {
    widths_fault(&view.psf).map(|message| format!("psf {message}"))
}

/// No map adds more to a range, m.
const MOST_OFFSET_M: f64 = 20.0;

/// What is wrong with widths, naming the key.
pub(super) fn widths_fault(psf: &PointSpread) -> Option<String> {
    let PointSpread { range_m, azimuth_rad, elevation_rad, doppler_mps, .. } = *psf;
    let widths = [
        ("range_m", range_m, 100.0),
        ("azimuth_rad", azimuth_rad, TAU),
        ("elevation_rad", elevation_rad, TAU),
        ("doppler_mps", doppler_mps, MAX_SPEED_MPS),
    ];
    let bad = widths.into_iter().find(|(_, value, most)| !(0.0..=*most).contains(value));
    let offset_m = psf.range_offset_m;
    let far = || format!("`range_offset_m` is {offset_m}; expected −{MOST_OFFSET_M} to {MOST_OFFSET_M}");
    bad.map(|(key, value, most)| format!("`{key}` is {value}; expected 0 to {most:.4}"))
        .or_else(|| (!(-MOST_OFFSET_M..=MOST_OFFSET_M).contains(&offset_m)).then(far))
}

/// A rotation keeps lengths and angles; a mirror does too, and is let pass.
fn pose_fault(view: &View) -> Option<String> {
    let Pose { rotation, translation } = view.pose;
    if !rotation.iter().flatten().chain(&translation).all(|x| x.is_finite()) {
        return Some("`rotation` and `translation` must be finite numbers".into());
    }
    if translation.iter().any(|x| x.abs() > MAX_EXTENT_M) {
        return Some(format!("`translation` is {translation:?} m; expected at most {MAX_EXTENT_M} each way"));
    }
    let skew = |a: usize, b: usize| (dot(rotation[a], rotation[b]) - f64::from(u8::from(a == b))).abs() > 1e-3;
    let bad = (0..3).any(|a| (a..3).any(|b| skew(a, b)));
    bad.then(|| "`rotation` is no rotation; expected three rows of length 1 at right angles".into())
}

/// Farther than a radar for people, cars or ships' berths sees, m.
const MAX_EXTENT_M: f64 = 1000.0;
/// Faster than anything that such a radar sees, m/s.
const MAX_SPEED_MPS: f64 = 1000.0;
/// The finest step that is accepted, in the axis' unit; and as a share of its farthest coordinate.
const LEAST_STEP: f64 = 1e-6;

fn axis_fault(axis: &Axis) -> Option<String> {
    let Axis { bins, lo, hi, .. } = *axis;
    let angular = axis.kind.is_angular();
    let far = lo.abs().max(hi.abs());
    let (most, unit) = if axis.kind == AxisKind::Doppler { (MAX_SPEED_MPS, "m/s") } else { (MAX_EXTENT_M, "m") };
    let step = axis.step().abs();
    let least = LEAST_STEP * far.max(1.0);
    if bins == 0 {
        Some("`bins` is 0; expected 1 or more".into())
    } else if !(lo.is_finite() && hi.is_finite()) {
        Some(format!("`lo` {lo} and `hi` {hi} must be finite"))
    } else if lo == hi {
        Some(format!("`lo` and `hi` are both {lo}; expected different numbers"))
    } else if axis.spacing == Spacing::Sine && !angular {
        Some("spacing \"sine\" is for azimuth, elevation and cone".into())
    } else if axis.spacing == Spacing::Sine && far > 2.0 {
        Some(format!("`lo` {lo} and `hi` {hi} are sines on a sine axis; expected about −1 to 1"))
    } else if angular && axis.spacing == Spacing::Linear && far > TAU {
        Some(format!("`lo` {lo} and `hi` {hi} are radians; they look like degrees"))
    } else if !angular && far > most {
        Some(format!("`lo` {lo:e} and `hi` {hi:e} are in {unit}; expected −{most} to {most}, as far as a radar sees"))
    } else if step < least {
        Some(format!(
            "`lo` {lo:e} and `hi` {hi:e} make {bins} bins {step:.1e} apart; expected a step of {least:.1e} or more"
        ))
    } else {
        None
    }
}

fn region_fault(view: &View) -> Option<String> {
    let region = view.region.as_ref()?;
    if region.len() != view.axes.len() {
        return Some(format!(
            "`region` has {} intervals; expected one for each of {} axes",
            region.len(),
            view.axes.len()
        ));
    }
    let bad = region.iter().zip(&view.axes).find(|(r, axis)| r[0] >= r[1] || r[1] > axis.bins);
    bad.map(|(r, axis)| format!("`region` {r:?} on {} bins; expected 0 ≤ lo < hi ≤ {}", axis.bins, axis.bins))
}
