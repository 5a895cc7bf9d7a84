//! How the point-spread widths of a view came about: stated, or computed from the FFT configuration that a manifest gives in
//! `[view.fft]`; and radars by name, `radar = "iwr1843"`.
//!
//! ```toml
//! [view.fft]
//! samples = 256                              # ADC samples a chirp
//! chirps = 64                                # a transmitter and frame; without it, the view resolves no speed
//! window = "hann"                            # or { range = "hann", doppler = "hann", angle = "rectangular" }
//! padding = 2                                # FFT length by samples, 1 to 16; or { range = …, doppler = …, angle = … }
//! array = { azimuth = 8, elevation = 4 }     # virtual elements along y and z, and azimuth_m, elevation_m their spacing, m
//! chirp = { bandwidth_hz = 2.5e9 }           # also start_hz, chirp_s, frame_s: where they differ from [radar]
//! ```
//!
//! Widths do not depend on the padding, which interpolates a lobe; where it is said, the view's axes are checked against it. Where
//! `psf` is said too, those widths are taken (refined on data), and the configuration serves the signal-level path.

use crate::dataset::DatasetError;
use crate::folders;
use crate::input::{MOST_TEXT, read_text};
use crate::output::replace_file;
use crate::radar::{Axis, AxisKind, FftSetup, PointSpread, RadarConfig, Spacing, View, ViewFft, Window};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Samples, chirps and elements that are accepted.
const MOST_COUNT: usize = 1 << 16;
/// Samples, chirps and elements that are accepted with a Chebyshev window.
const MOST_CHEBYSHEV: usize = 2048;
/// Lengths of an FFT in multiples of its samples that are accepted.
const MOST_PADDING: usize = 16;

/// Where a view's widths come from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ViewCalibration {
    /// The FFT configuration, where it is known.
    pub fft: Option<ViewFft>,
    /// Whether the widths were computed from it.
    pub derived: bool,
}

impl ViewCalibration {
    /// Widths from an FFT configuration.
    pub fn derived(fft: ViewFft) -> Self {
        Self { fft: Some(fft), derived: true }
    }

    /// In words, for `info` and tooltips.
    pub fn words(&self) -> String {
        match (&self.fft, self.derived) {
            (Some(fft), true) => format!("derived from the FFTs: {}", fft.words()),
            (Some(fft), false) => format!("stated; the FFTs are {}", fft.words()),
            (None, _) => "stated".into(),
        }
    }
}

/// `[view.fft]` as written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FftText {
    /// ADC samples a chirp.
    pub samples: usize,
    /// Chirps a transmitter and frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chirps: Option<usize>,
    /// A window's name, or one a kind of axis.
    pub window: toml::Value,
    /// FFT lengths in multiples of their samples: one number, or one a kind of axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub padding: Option<toml::Value>,
    /// Virtual elements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub array: Option<ArrayText>,
    /// Where the chirp differs from `[radar]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chirp: Option<SweepText>,
}

/// The virtual array of `[view.fft]`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArrayText {
    /// Elements along y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub azimuth: Option<usize>,
    /// Elements along z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elevation: Option<usize>,
    /// Their spacing, m, where it is not `l_az_m` of `[radar]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub azimuth_m: Option<f64>,
    /// Their spacing, m, where it is not `l_el_m` of `[radar]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elevation_m: Option<f64>,
}

/// The chirp of `[view.fft]`: keys of `[radar]`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepText {
    /// Start frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_hz: Option<f64>,
    /// Swept and sampled bandwidth, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bandwidth_hz: Option<f64>,
    /// Its duration, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chirp_s: Option<f64>,
    /// From the first chirp of a frame to its last, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_s: Option<f64>,
}

/// One of range, Doppler and angle.
const AXES: [&str; 3] = ["range", "doppler", "angle"];

/// A value for all three, or a table with one each; what the table does not say is `unsaid`.
pub(super) fn per_axis<T: Copy>(
    key: &str,
    value: &toml::Value,
    unsaid: T,
    (read, expected): (impl Fn(&toml::Value) -> Option<T>, &str),
) -> Result<[T; 3], String> {
    let one = |value: &toml::Value| read(value).ok_or_else(|| format!("`{key}` is {value}; expected {expected}"));
    let toml::Value::Table(table) = value else { return one(value).map(|all| [all; 3]) };
    if let Some(other) = table.keys().find(|name| !AXES.contains(&name.as_str())) {
        return Err(format!("unknown key `{other}` in `{key}`; expected `range`, `doppler` or `angle`"));
    }
    let mut all = [unsaid; 3];
    for (name, of) in AXES.iter().zip(&mut all) {
        if let Some(value) = table.get(*name) {
            *of = one(value)?;
        }
    }
    Ok(all)
}

impl FftText {
    /// The configuration with what `radar` says of chirp and spacings, and its padding, where that is said.
    ///
    /// # Errors
    /// Naming the key and what was expected there.
    pub fn resolve(&self, radar: &RadarConfig) -> Result<(ViewFft, [Option<usize>; 3]), String> {
        let window = |value: &toml::Value| value.as_str().and_then(Window::named);
        let [range, doppler, angle] = per_axis("window", &self.window, Window::Rectangular, (window, Window::NAMES))?;
        let times = |value: &toml::Value| {
            let whole = value.as_integer().and_then(|n| usize::try_from(n).ok());
            whole.filter(|n| (1..=MOST_PADDING).contains(n)).map(Some)
        };
        let padding = self.padding.as_ref().map_or(Ok([None; 3]), |value| {
            per_axis("padding", value, None, (times, &format!("a whole number, 1 to {MOST_PADDING}")))
        })?;
        let array = self.array.clone().unwrap_or_default();
        let counts = [
            ("samples", Some(self.samples), 2),
            ("chirps", self.chirps, 1),
            ("array.azimuth", array.azimuth, 2),
            ("array.elevation", array.elevation, 2),
        ];
        for (key, count, least) in counts {
            if let Some(count) = count.filter(|count| !(least..=MOST_COUNT).contains(count)) {
                return Err(format!("`{key}` is {count}; expected {least} to {MOST_COUNT}"));
            }
        }
        // Its weights are a transform of their own, each a sum over all.
        let slow = [
            ("samples", Some(self.samples), range),
            ("chirps", self.chirps, doppler),
            ("array.azimuth", array.azimuth, angle),
            ("array.elevation", array.elevation, angle),
        ];
        for (key, count, window) in slow {
            if let Some(count) = count.filter(|&n| matches!(window, Window::Chebyshev { .. }) && n > MOST_CHEBYSHEV) {
                return Err(format!(
                    "`{key}` is {count} with a window {}; expected {MOST_CHEBYSHEV} at most",
                    window.name()
                ));
            }
        }
        let sweep = self.chirp.clone().unwrap_or_default();
        let said = [
            ("array.azimuth_m", array.azimuth_m, 1e-9, 1e3),
            ("array.elevation_m", array.elevation_m, 1e-9, 1e3),
            ("chirp.start_hz", sweep.start_hz, 1e6, 1e13),
            ("chirp.bandwidth_hz", sweep.bandwidth_hz, 1.0, 1e13),
            ("chirp.chirp_s", sweep.chirp_s, 1e-12, 1e3),
            ("chirp.frame_s", sweep.frame_s, 1e-12, 1e3),
        ];
        for (key, value, least, most) in said {
            if let Some(value) = value.filter(|value| !(least..=most).contains(value)) {
                return Err(format!("`{key}` is {value:e}; expected {least:e} to {most:e}"));
            }
        }
        let radar = RadarConfig {
            start_hz: sweep.start_hz.unwrap_or(radar.start_hz),
            bandwidth_hz: sweep.bandwidth_hz.unwrap_or(radar.bandwidth_hz),
            chirp_s: sweep.chirp_s.unwrap_or(radar.chirp_s),
            frame_s: sweep.frame_s.unwrap_or(radar.frame_s),
            l_az_m: array.azimuth_m.unwrap_or(radar.l_az_m),
            l_el_m: array.elevation_m.unwrap_or(radar.l_el_m),
            ..radar.clone()
        };
        let setup = FftSetup {
            range: (self.samples, range),
            doppler: (self.chirps.unwrap_or(1), doppler),
            azimuth: array.azimuth.map(|count| (count, angle)),
            elevation: array.elevation.map(|count| (count, angle)),
        };
        Ok((ViewFft { setup, radar }, padding))
    }

    /// As text beside a `[radar]`, with what differs from it, and with its padding where the axes say it.
    pub fn beside(fft: &ViewFft, radar: &RadarConfig, axes: &[Axis]) -> Self {
        let own = &fft.radar;
        let differs = |x: f64, of: f64| (x != of).then_some(x);
        let sweep = SweepText {
            start_hz: differs(own.start_hz, radar.start_hz),
            bandwidth_hz: differs(own.bandwidth_hz, radar.bandwidth_hz),
            chirp_s: differs(own.chirp_s, radar.chirp_s),
            frame_s: differs(own.frame_s, radar.frame_s),
        };
        let mut text = Self::of(fft);
        if let Some(array) = &mut text.array {
            array.azimuth_m = array.azimuth.and_then(|_| differs(own.l_az_m, radar.l_az_m));
            array.elevation_m = array.elevation.and_then(|_| differs(own.l_el_m, radar.l_el_m));
        }
        text.chirp = (sweep != SweepText::default()).then_some(sweep);
        let mut padding = toml::Table::new();
        for axis in axes {
            let (name, angle) = match axis.kind {
                AxisKind::Range => (AXES[0], false),
                AxisKind::Doppler => (AXES[1], false),
                kind if kind.is_angular() => (AXES[2], true),
                _ => continue,
            };
            let on_grid = !angle || axis.spacing == Spacing::Sine;
            if let Some(resolved) = fft.resolved(axis.kind).filter(|_| on_grid) {
                let times = (resolved.natural / axis.step().abs()).round();
                let exact = (axis.step().abs() * times / resolved.natural - 1.0).abs() < 1e-3;
                if exact && (1.0..=MOST_PADDING as f64).contains(&times) {
                    padding.insert(name.to_owned(), toml::Value::Integer(times as i64));
                }
            }
        }
        text.padding = (!padding.is_empty()).then_some(toml::Value::Table(padding));
        text
    }

    /// As text, of a configuration whose chirp and spacings are those of a `[radar]`.
    pub fn of(fft: &ViewFft) -> Self {
        let FftSetup { range, doppler, azimuth, elevation } = fft.setup;
        let angle = azimuth.or(elevation).map_or(Window::Rectangular, |(_, window)| window);
        let names = [range.1, doppler.1, angle].map(Window::name);
        let window = if names.iter().all(|name| *name == names[0]) {
            toml::Value::String(names[0].clone())
        } else {
            let table = AXES.iter().zip(names).map(|(axis, name)| ((*axis).to_owned(), toml::Value::String(name)));
            toml::Value::Table(table.collect())
        };
        let [azimuth, elevation] = [azimuth, elevation].map(|set| set.map(|(count, _)| count));
        let array = ArrayText { azimuth, elevation, ..ArrayText::default() };
        Self {
            samples: range.0,
            chirps: (doppler.0 > 1).then_some(doppler.0),
            window,
            padding: None,
            array: (array != ArrayText::default()).then_some(array),
            chirp: None,
        }
    }
}

/// What is wrong between a view's axes and its FFT configuration, with its padding where that is said; `None` if nothing is.
pub(super) fn fft_fault(view: &View, fft: &ViewFft, padding: [Option<usize>; 3]) -> Option<String> {
    let needs = |kind: AxisKind| match kind {
        AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y => "`array.azimuth`",
        AxisKind::Elevation | AxisKind::Z => "`array.elevation`",
        AxisKind::Doppler => "`chirps` above 1",
        _ => "`samples`",
    };
    for (k, axis) in view.axes.iter().enumerate() {
        let Some(resolved) = fft.resolved(axis.kind) else {
            return Some(format!("[view.fft]: axis {k} ({}) needs {}", axis.kind.name(), needs(axis.kind)));
        };
        let (name, said) = match axis.kind {
            AxisKind::Range => (AXES[0], padding[0]),
            AxisKind::Doppler => (AXES[1], padding[1]),
            kind if kind.is_angular() && axis.spacing == Spacing::Sine => (AXES[2], padding[2]),
            _ => continue,
        };
        if let Some(times) = said {
            let (step, expected) = (axis.step().abs(), resolved.natural / times as f64);
            // What rounding to whole bins or to printed digits leaves.
            if (step / expected - 1.0).abs() > 0.02 {
                return Some(format!(
                    "[view.fft]: `padding` {times} of {name} with {} points makes bins of {expected:.6}; axis {k} ({}) has bins of \
                     {step:.6}",
                    resolved.count,
                    axis.kind.name()
                ));
            }
        }
    }
    None
}

/// A radar by name: chirp, array and FFT configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RadarPreset {
    /// In a few words.
    #[serde(default)]
    pub about: String,
    /// Chirp and array.
    pub radar: RadarConfig,
    /// Samples, chirps, elements and windows, where they are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fft: Option<FftText>,
    /// Widths that were refined on data; they are taken instead of those that follow from `fft`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psf: Option<PointSpread>,
}

/// The radars that the program brings with it: their names and files.
static BUNDLED: [(&str, &str); 4] = [
    ("awr2243", include_str!("../../assets/radars/awr2243.toml")),
    ("iwr1843", include_str!("../../assets/radars/iwr1843.toml")),
    ("iwr6843", include_str!("../../assets/radars/iwr6843.toml")),
    ("generic", include_str!("../../assets/radars/generic.toml")),
];

/// The folder of radars that the user saved; `None` where there is no home.
pub fn user_radars() -> Option<PathBuf> {
    folders::user_data().map(|home| home.join("radars"))
}

/// Whether a name can be one of a radar: it is a file's too.
fn is_name(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    (1..=64).contains(&name.len()) && name.chars().all(plain)
}

impl RadarPreset {
    /// The radar of that name: the program's own, else the user's.
    ///
    /// # Errors
    /// Where there is none, naming those that exist; where its file cannot be read or makes no sense.
    pub fn named(name: &str) -> Result<Self, DatasetError> {
        let bundled = BUNDLED.iter().find(|(known, _)| *known == name);
        if let Some((_, text)) = bundled {
            return Self::parse(text, &PathBuf::from(format!("assets/radars/{name}.toml")));
        }
        let path = user_radars().filter(|_| is_name(name)).map(|folder| folder.join(format!("{name}.toml")));
        let Some(path) = path.filter(|path| path.is_file()) else {
            let message =
                format!("unknown radar \"{name}\"; expected {}, or a [radar] table", Self::names().join(", "));
            return Err(DatasetError::Manifest { message, line: None, path: PathBuf::from(name) });
        };
        let text = read_text(&path, "a radar (TOML)", MOST_TEXT)
            .map_err(|reason| DatasetError::Read { reason, path: path.clone() })?;
        Self::parse(&text, &path)
    }

    /// Checks the text of a radar's file; `path` is for messages.
    ///
    /// # Errors
    /// Naming the key and what was expected there.
    pub fn parse(text: &str, path: &Path) -> Result<Self, DatasetError> {
        let fault = |message: String, line| DatasetError::Manifest { message, line, path: path.to_owned() };
        let line = |at: usize| 1 + text.bytes().take(at).filter(|&byte| byte == b'\n').count();
        let preset: Self = toml::from_str(text)
            .map_err(|e| fault(super::manifest::in_our_words(e.message()), e.span().map(|span| line(span.start))))?;
        if let Some(message) = super::manifest::radar_fault(&preset.radar) {
            return Err(fault(format!("[radar]: {message}"), None));
        }
        preset.view_fft().map_err(|message| fault(format!("[fft]: {message}"), None))?;
        if preset.fft.is_none() && preset.psf.is_none() {
            return Err(fault("neither [fft] nor [psf]; expected one of them".into(), None));
        }
        if let Some(message) = preset.psf.as_ref().and_then(super::manifest::widths_fault) {
            return Err(fault(format!("[psf]: {message}"), None));
        }
        Ok(preset)
    }

    /// The names of all radars, the user's last.
    pub fn names() -> Vec<String> {
        let mut names: Vec<String> = BUNDLED.iter().map(|(name, _)| (*name).to_owned()).collect();
        let files = user_radars().and_then(|folder| std::fs::read_dir(folder).ok());
        let mut own: Vec<String> = files
            .into_iter()
            .flatten()
            .flatten()
            .filter_map(|entry| entry.file_name().to_str()?.strip_suffix(".toml").map(str::to_owned))
            .filter(|name| is_name(name) && !names.contains(name))
            .collect();
        own.sort();
        names.append(&mut own);
        names
    }

    /// Keeps it among the user's radars, over one of that name.
    ///
    /// # Errors
    /// Where the name is the program's own or none for a file, or the file cannot be written.
    pub fn save(&self, name: &str) -> Result<PathBuf, DatasetError> {
        let refuse = |message: String| DatasetError::Manifest { message, line: None, path: PathBuf::from(name) };
        if !is_name(name) {
            return Err(refuse(format!("\"{name}\" is no radar's name; expected up to 64 of a–z, 0–9, - and _")));
        }
        if BUNDLED.iter().any(|(known, _)| *known == name) {
            return Err(refuse(format!("\"{name}\" is a radar of the program; expected another name")));
        }
        let folder = user_radars().ok_or_else(|| refuse("there is no folder for the user's radars".into()))?;
        let path = folder.join(format!("{name}.toml"));
        let failed = |reason| DatasetError::Write { reason, path: path.clone() };
        std::fs::create_dir_all(&folder).map_err(failed)?;
        let text = self.to_toml();
        replace_file(&path, |out| out.write_all(text.as_bytes())).map_err(failed)?;
        Ok(path)
    }

    /// As its file.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }

    /// Its FFT configuration, where it has one.
    ///
    /// # Errors
    /// Never for one that was read by [`Self::parse`].
    pub fn view_fft(&self) -> Result<Option<ViewFft>, String> {
        self.fft.as_ref().map(|fft| fft.resolve(&self.radar).map(|(fft, _)| fft)).transpose()
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn the_radars_of_the_program_are_sound_and_say_their_widths() {
        for (name, _) in BUNDLED {
            let preset = RadarPreset::named(name).unwrap();
            let psf = preset.view_fft().unwrap().unwrap().point_spread();
            assert!(!preset.about.is_empty() && psf.range_m > 0.01 && psf.range_m < 0.2, "{name}: {psf:?}");
            assert!(psf.azimuth_rad > 0.01 && psf.azimuth_rad < 0.3, "{name}: {psf:?}");
            let again = RadarPreset::parse(&preset.to_toml(), Path::new("again")).unwrap();
            assert_eq!(again, preset);
        }
    }

    #[test]
    fn a_configuration_is_written_as_it_is_read() {
        let preset = RadarPreset::named("iwr6843").unwrap();
        let fft = preset.view_fft().unwrap().unwrap();
        assert_eq!(FftText::of(&fft).resolve(&preset.radar).unwrap().0, fft);
        assert_eq!(fft.words(), "256 samples hann, 64 chirps hann, 12 elements along y chebyshev-30");
    }
}
