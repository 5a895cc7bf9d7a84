//! `dataset.toml`: what a generic data set says of itself; SPEC section 6.
//!
//! Unknown keys are errors with their line, because a typo in `bandwidth_hz` would otherwise silently become a default.

use super::DatasetError;
use crate::body::Skeleton;
use crate::geometry::{IDENTITY, Mat3, Pose, Vec3};
use crate::radar::{Axis, PointSpread, Quantity, RadarConfig, Spacing, View};
use serde::de::{self, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};
use std::f64::consts::TAU;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Cells of one map that are accepted: 2²⁸.
const MAX_CELLS: usize = 1 << 28;

/// How a data set lies on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// One npz a frame, described by a manifest.
    Npz,
    /// The MMVR tree.
    Mmvr,
    /// A single `.npy` or `.npz` whose axes a person named.
    #[serde(skip_deserializing)]
    Bare,
    /// HuPR: folders of complex cubes.
    Hupr,
    /// XRF55: stacks of maps.
    Xrf55,
}

impl Layout {
    /// The word in manifests and in `info`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Npz => "npz",
            Self::Mmvr => "mmvr",
            Self::Bare => "bare",
            Self::Hupr => "hupr",
            Self::Xrf55 => "xrf55",
        }
    }
}

impl std::fmt::Display for Layout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}

/// A checked manifest. What is `None` takes the layout's preset, or a stated assumption.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// Where it was read from; the preset's name where it is built in.
    pub path: PathBuf,
    /// Name of the data set.
    pub name: Option<String>,
    /// How the frames lie on disk.
    pub layout: Layout,
    /// Files of the frames relative to the folder, with `*` in any part; sorted by name, one frame a file.
    pub frames: Option<String>,
    /// Frames a second.
    pub frame_rate_hz: Option<f64>,
    /// The skeleton of the joints.
    pub skeleton: Option<Skeleton>,
    /// Chirp and array.
    pub radar: Option<RadarConfig>,
    /// The views; empty where the layout's own are meant.
    pub views: Vec<View>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestText {
    name: Option<String>,
    layout: Layout,
    frames: Option<Spanned<String>>,
    frame_rate_hz: Option<Spanned<f64>>,
    skeleton: Option<Spanned<SkeletonText>>,
    radar: Option<Spanned<RadarConfig>>,
    #[serde(default)]
    view: Vec<Spanned<ViewText>>,
}

/// A view as written; also the form in which chosen axes are remembered.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ViewText {
    array: String,
    #[serde(default)]
    quantity: Quantity,
    psf: PointSpread,
    #[serde(default = "identity")]
    rotation: Mat3,
    #[serde(default)]
    translation: Vec3,
    axes: Vec<Axis>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    region: Option<Vec<[usize; 2]>>,
}

fn identity() -> Mat3 {
    IDENTITY
}

impl ViewText {
    pub(super) fn into_view(self) -> View {
        let pose = Pose { rotation: self.rotation, translation: self.translation };
        View { array: self.array, quantity: self.quantity, psf: self.psf, pose, axes: self.axes, region: self.region }
    }

    pub(super) fn of(view: &View) -> Self {
        let View { array, quantity, psf, pose, axes, region } = view.clone();
        Self { array, quantity, psf, rotation: pose.rotation, translation: pose.translation, axes, region }
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
        let text = std::fs::read_to_string(path).map_err(|reason| match reason.kind() {
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
            check(positive("frame_rate_hz", *rate.get_ref()), rate.span())?;
        }
        if let Some(radar) = &parsed.radar {
            check(radar_fault(radar.get_ref()).map(|m| format!("[radar]: {m}")), radar.span())?;
        }
        if let Some(skeleton) = &parsed.skeleton {
            check(skeleton.get_ref().0.fault().map(|m| format!("[skeleton]: {m}")), skeleton.span())?;
        }
        if let Some(frames) = parsed.frames.as_ref().filter(|frames| frames.get_ref().trim().is_empty()) {
            check(Some("`frames` is empty; expected a pattern such as \"frames/*.npz\"".into()), frames.span())?;
        }
        let mut views: Vec<View> = Vec::new();
        for spanned in parsed.view {
            let span = spanned.span();
            let view = spanned.into_inner().into_view();
            let twice = views.iter().any(|other| other.array == view.array);
            let twice = twice.then(|| format!("view `{}` is described twice", view.array));
            check(twice.or_else(|| view_fault(&view)), span)?;
            views.push(view);
        }
        let missing = |key: &str| fault(format!("missing key `{key}`; layout \"npz\" needs it"), None);
        if parsed.layout == Layout::Npz && views.is_empty() {
            return Err(missing("[[view]]"));
        }
        if parsed.layout == Layout::Npz && parsed.skeleton.is_none() {
            return Err(missing("skeleton"));
        }
        Ok(Self {
            path: path.to_owned(),
            name: parsed.name,
            layout: parsed.layout,
            frames: parsed.frames.map(Spanned::into_inner),
            frame_rate_hz: parsed.frame_rate_hz.map(Spanned::into_inner),
            skeleton: parsed.skeleton.map(|skeleton| skeleton.into_inner().0),
            radar: parsed.radar.map(Spanned::into_inner),
            views,
        })
    }

    /// The built-in description of HuPR, from `assets/hupr.toml`.
    ///
    /// # Errors
    /// As [`Self::mmvr`].
    pub fn hupr() -> Result<Self, DatasetError> {
        Self::parse(include_str!("../../assets/hupr.toml"), Path::new("assets/hupr.toml"))
    }

    /// The built-in description of XRF55, from `assets/xrf55.toml`.
    ///
    /// # Errors
    /// As [`Self::mmvr`].
    pub fn xrf55() -> Result<Self, DatasetError> {
        Self::parse(include_str!("../../assets/xrf55.toml"), Path::new("assets/xrf55.toml"))
    }

    /// The built-in description of MMVR, from `assets/mmvr.toml`.
    ///
    /// # Errors
    /// Never for the file that the program was built with; a test holds it.
    pub fn mmvr() -> Result<Self, DatasetError> {
        Self::parse(include_str!("../../assets/mmvr.toml"), Path::new("assets/mmvr.toml"))
    }
}

/// The line, counted from 1, of a byte offset.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

/// `unknown field` is the parser's word; a manifest has keys.
fn in_our_words(message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    match message.strip_prefix("unknown field ") {
        Some(rest) => format!("unknown key {}", rest.replacen(", expected", "; expected", 1)),
        None => message.replacen("missing field", "missing key", 1),
    }
}

fn positive(key: &str, value: f64) -> Option<String> {
    (!(value.is_finite() && value > 0.0)).then(|| format!("`{key}` is {value}; expected a number above 0"))
}

fn radar_fault(radar: &RadarConfig) -> Option<String> {
    let numbers = [
        ("start_hz", radar.start_hz),
        ("bandwidth_hz", radar.bandwidth_hz),
        ("chirp_s", radar.chirp_s),
        ("frame_s", radar.frame_s),
        ("r_max_m", radar.r_max_m),
        ("l_az_m", radar.l_az_m),
        ("l_el_m", radar.l_el_m),
    ];
    let few = radar.doppler_features == 0 || radar.doppler_features > 4096;
    let features = || few.then(|| format!("`doppler_features` is {}; expected 1 to 4096", radar.doppler_features));
    let known = radar.height_m.map(|height_m| ("height_m", height_m));
    numbers.into_iter().chain(known).find_map(|(key, value)| positive(key, value)).or_else(features)
}

/// What is wrong with a view, in words; `None` if nothing is.
pub(super) fn view_fault(view: &View) -> Option<String> {
    let name = |message: String| format!("view `{}`: {message}", view.array);
    if view.array.is_empty() {
        return Some("a view's `array` is empty; expected the key of an array".into());
    }
    if !(2..=3).contains(&view.axes.len()) {
        return Some(name(format!("{} axes; expected 2 or 3", view.axes.len())));
    }
    let axes = view.axes.iter().enumerate();
    if let Some(fault) =
        axes.clone().find_map(|(k, axis)| axis_fault(axis).map(|m| format!("axis {k} ({}): {m}", axis.kind.name())))
    {
        return Some(name(fault));
    }
    if view
        .axes
        .iter()
        .try_fold(1_usize, |cells, axis| cells.checked_mul(axis.bins))
        .is_none_or(|cells| cells > MAX_CELLS)
    {
        return Some(name(format!("its bins make more than {MAX_CELLS} cells")));
    }
    let psf = view.psf;
    let widths = [
        ("range_m", psf.range_m),
        ("azimuth_rad", psf.azimuth_rad),
        ("elevation_rad", psf.elevation_rad),
        ("doppler_mps", psf.doppler_mps),
    ];
    if let Some((key, value)) = widths.into_iter().find(|(_, value)| !(value.is_finite() && *value >= 0.0)) {
        return Some(name(format!("psf `{key}` is {value}; expected 0 or more")));
    }
    if !view.pose.rotation.iter().flatten().chain(&view.pose.translation).all(|x| x.is_finite()) {
        return Some(name("`rotation` and `translation` must be finite numbers".into()));
    }
    region_fault(view).map(name)
}

fn axis_fault(axis: &Axis) -> Option<String> {
    let Axis { bins, lo, hi, .. } = *axis;
    let angular = axis.kind.is_angular();
    let steep = lo.abs().max(hi.abs());
    if bins == 0 {
        Some("`bins` is 0; expected 1 or more".into())
    } else if !(lo.is_finite() && hi.is_finite()) {
        Some(format!("`lo` {lo} and `hi` {hi} must be finite"))
    } else if lo == hi {
        Some(format!("`lo` and `hi` are both {lo}; expected different numbers"))
    } else if axis.spacing == Spacing::Sine && !angular {
        Some("spacing \"sine\" is for azimuth, elevation and cone".into())
    } else if axis.spacing == Spacing::Sine && steep > 2.0 {
        Some(format!("`lo` {lo} and `hi` {hi} are sines on a sine axis; expected about −1 to 1"))
    } else if angular && axis.spacing == Spacing::Linear && steep > TAU {
        Some(format!("`lo` {lo} and `hi` {hi} are radians; they look like degrees"))
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
