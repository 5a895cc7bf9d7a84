//! Files of maps that say nothing of their axes: what is in them, a first guess, and the memory of what a person chose.

use crate::body::Skeleton;
use crate::dataset::DatasetError;
use crate::dataset::axes_text::axes_badge;
use crate::dataset::manifest::{ViewText, cells_fault, view_fault};
use crate::dataset::npz::{Entry, NpzArchive, shape_text};
use crate::geometry::Pose;
use crate::input::{MOST_TEXT, read_text};
use crate::output::replace_file;
use crate::radar::{Axis, AxisKind, PointSpread, Quantity, Spacing, View};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The arrays of a bare file that could be maps: real numbers, 2 or 3 axes, or one more if the first counts frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BareCatalog {
    /// The file.
    pub path: PathBuf,
    /// Candidates, sorted by key.
    pub arrays: Vec<Entry>,
}

impl std::fmt::Display for BareCatalog {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let path = self.path.display();
        write!(f, "{path}: the axes of {} are not known; ", listed(&self.arrays))?;
        write!(f, "describe them in a manifest ([[view]] as in dataset.toml) and give it with --manifest FILE, ")?;
        write!(f, "or open the file in the window once: it asks, and remembers")
    }
}

fn listed(entries: &[Entry]) -> String {
    let one = |e: &Entry| format!("`{}` {} {}", e.key, shape_text(&e.shape), e.dtype);
    entries.iter().map(one).collect::<Vec<_>>().join(", ")
}

impl BareCatalog {
    /// Lists the candidates of a file, reading headers only.
    ///
    /// # Errors
    /// Where the file cannot be read or has no candidate.
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        let all = NpzArchive::open(path)?.entries()?;
        let pose = |e: &Entry| matches!(e.key.as_str(), "joints" | "velocities") && e.shape.last() == Some(&3);
        let fits = |e: &&Entry| e.is_real && (2..=4).contains(&e.shape.len()) && !e.shape.contains(&0) && !pose(e);
        let arrays: Vec<Entry> = all.iter().filter(fits).cloned().collect();
        if arrays.is_empty() {
            let present = if all.is_empty() { "no arrays".into() } else { listed(&all) };
            return Err(DatasetError::NoMaps { present, path: path.to_owned() });
        }
        Ok(Self { path: path.to_owned(), arrays })
    }

    /// What choices are remembered by: the arrays' names and shapes.
    fn key(&self) -> String {
        self.arrays.iter().map(|e| format!("{}{}", e.key, shape_text(&e.shape))).collect::<Vec<_>>().join(" ")
    }
}

/// What a person says of a bare file.
#[derive(Debug, Clone, PartialEq)]
pub struct BareChoice {
    /// The views; `array` is a key of the catalog.
    pub views: Vec<View>,
    /// The arrays are (frames, …) and a view describes the rest.
    pub first_axis_is_frame: bool,
    /// Name of the skeleton to fit, one of [`Skeleton::PRESETS`].
    pub skeleton: String,
    /// Frames a second, where known.
    pub frame_rate_hz: Option<f64>,
}

#[derive(Serialize, Deserialize)]
struct ChoiceText {
    first_axis_is_frame: bool,
    skeleton: String,
    frame_rate_hz: Option<f64>,
    view: Vec<ViewText>,
}

impl BareChoice {
    /// A start to be edited: every candidate with the fewest axes, rows as depth (row 0 far), columns across, or up where
    /// the array's name has `vert` in it. Arrays of three axes are taken for frames of maps. 256×128 are MMVR's bounds.
    pub fn guess(catalog: &BareCatalog) -> Self {
        let axes = catalog.arrays.iter().map(|e| e.shape.len()).min().unwrap_or(2);
        let views = catalog.arrays.iter().filter(|e| e.shape.len() == axes).map(|e| guess_view(e, axes > 2)).collect();
        Self { views, first_axis_is_frame: axes > 2, skeleton: "coco17".into(), frame_rate_hz: None }
    }

    /// Checks the choice against the file's arrays and gives the number of frames.
    ///
    /// # Errors
    /// Names the view whose array is missing, whose shape does not match, or whose axes make no sense.
    pub fn frames_in(&self, catalog: &BareCatalog) -> Result<usize, DatasetError> {
        let bad = |message: String| DatasetError::BadChoice { message, path: catalog.path.clone() };
        if Skeleton::preset(&self.skeleton).is_none() {
            let known = Skeleton::PRESETS.join(", ");
            return Err(bad(format!("skeleton \"{}\"; expected one of {known}", self.skeleton)));
        }
        frames_of(&self.views, self.first_axis_is_frame, catalog)
    }
}

/// Checks views against arrays; the number of frames is 1, or the length of the arrays' first axis.
pub(super) fn frames_of(views: &[View], stacked: bool, catalog: &BareCatalog) -> Result<usize, DatasetError> {
    let bad = |message: String| DatasetError::BadChoice { message, path: catalog.path.clone() };
    if let Some(fault) = cells_fault(views) {
        return Err(bad(fault));
    }
    let mut frames = None;
    for view in views {
        if let Some(fault) = view_fault(view) {
            return Err(bad(fault.message));
        }
        let Some(entry) = catalog.arrays.iter().find(|e| e.key == view.array) else {
            return Err(bad(format!("no map `{}`; the file holds {}", view.array, listed(&catalog.arrays))));
        };
        let (count, shape) = match entry.shape.split_first() {
            Some((&first, rest)) if stacked => (first, rest),
            _ => (1, entry.shape.as_slice()),
        };
        let (got, expected) = (shape_text(&entry.shape), shape_text(&view.shape()));
        if shape != view.shape() {
            let stacked = if stacked { "(frames, …) of " } else { "" };
            return Err(bad(format!(
                "array `{}` has shape {got}; its axes' bins make {stacked}{expected}",
                view.array
            )));
        }
        if frames.is_some_and(|frames| frames != count) {
            return Err(bad(format!("array `{}` has {count} frames, the views before it another number", view.array)));
        }
        frames = Some(count);
    }
    frames.ok_or_else(|| bad("no view; expected at least one".into()))
}

fn guess_view(entry: &Entry, stacked: bool) -> View {
    let shape = if stacked { entry.shape.get(1..).unwrap_or_default() } else { &entry.shape };
    let size = |k: usize| shape.get(k).copied().unwrap_or(1);
    let vertical = entry.key.to_lowercase().contains("vert");
    let mut psf = PointSpread {
        range_m: 0.06,
        azimuth_rad: 0.03,
        elevation_rad: 0.0,
        doppler_mps: 0.1,
        ..PointSpread::default()
    };
    let axes = match shape.len() {
        3 => {
            (psf.range_m, psf.azimuth_rad, psf.elevation_rad) = (0.1, 0.08, 0.12);
            let sine = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Sine };
            let range = edges(AxisKind::Range, size(0), 0.0, 8.0);
            vec![range, sine(AxisKind::Azimuth, size(1), -1.0, 1.0), sine(AxisKind::Elevation, size(2), -1.0, 1.0)]
        }
        _ if vertical => {
            (psf.azimuth_rad, psf.elevation_rad) = (0.0, 0.03);
            vec![edges(AxisKind::DepthV, size(0), 8.0, 0.0), edges(AxisKind::Z, size(1), -2.0, 3.0)]
        }
        _ => vec![edges(AxisKind::DepthH, size(0), 8.0, 0.0), edges(AxisKind::Y, size(1), 1.0, -4.0)],
    };
    View { array: entry.key.clone(), quantity: Quantity::Amplitude, psf, pose: Pose::default(), axes, region: None }
}

/// An axis whose outer edges are `first` and `last`, the bin centres half a step inside.
fn edges(kind: AxisKind, bins: usize, first: f64, last: f64) -> Axis {
    let half = 0.5 * (last - first) / bins.max(1) as f64;
    Axis { kind, bins, lo: first + half, hi: last + half, spacing: Spacing::Linear }
}

/// The choices of earlier sessions: one TOML file in the user's data folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remembered {
    file: PathBuf,
}

impl Remembered {
    /// The user's own: `$MHP_INSPECTOR_HOME`, else the platform's data folder. `None` where there is no home.
    pub fn of_user() -> Option<Self> {
        crate::folders::user_data().map(|home| Self::in_folder(&home))
    }

    /// Those kept in `folder`.
    pub fn in_folder(folder: &Path) -> Self {
        Self { file: folder.join("axes.toml") }
    }

    fn all(&self) -> BTreeMap<String, ChoiceText> {
        let text = read_text(&self.file, "remembered axes", MOST_TEXT).unwrap_or_default();
        toml::from_str(&text).unwrap_or_else(|error| {
            tracing::warn!("{}: remembered axes are unreadable and ignored: {}", self.file.display(), error.message());
            BTreeMap::new()
        })
    }

    /// What was chosen for a file with these arrays, if it still fits.
    pub fn recall(&self, catalog: &BareCatalog) -> Option<BareChoice> {
        let text = self.all().remove(&catalog.key())?;
        let choice = BareChoice {
            views: text.view.into_iter().map(ViewText::into_view).collect(),
            first_axis_is_frame: text.first_axis_is_frame,
            skeleton: text.skeleton,
            frame_rate_hz: text.frame_rate_hz,
        };
        choice.frames_in(catalog).is_ok().then_some(choice)
    }

    /// Keeps a choice for files with these arrays.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn remember(&self, catalog: &BareCatalog, choice: &BareChoice) -> Result<(), DatasetError> {
        let failed = |reason| DatasetError::Write { reason, path: self.file.clone() };
        let mut all = self.all();
        let text = ChoiceText {
            first_axis_is_frame: choice.first_axis_is_frame,
            skeleton: choice.skeleton.clone(),
            frame_rate_hz: choice.frame_rate_hz,
            view: choice.views.iter().map(ViewText::of).collect(),
        };
        all.insert(catalog.key(), text);
        let text = toml::to_string(&all).map_err(|error| failed(std::io::Error::other(error)))?;
        if let Some(folder) = self.file.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        replace_file(&self.file, |out| out.write_all(text.as_bytes())).map_err(failed)
    }
}

/// What was assumed about a bare file, in words.
pub(super) fn assumptions(views: &[View]) -> Vec<String> {
    vec![
        "radar: chirp and array are not in the file; a 77 GHz radar with 2.5 GHz of bandwidth is assumed".into(),
        format!("axes: as chosen by the user: {}", axes_badge(views)),
    ]
}
