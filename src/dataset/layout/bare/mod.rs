//! A single `.npy` or `.npz` of maps that says nothing of its axes: a person or a manifest does ([`choice`]).
//!
//! Its arrays are one frame, or have frames along their first axis.

mod choice;

pub use choice::{BareCatalog, BareChoice, Remembered};

use super::arrays::read_map;
use super::{DataFolder, FrameSource, Layout, Opened, default_skeleton};
use crate::body::Skeleton;
use crate::dataset::axes_text::axes_badge;
use crate::dataset::manifest::Manifest;
use crate::dataset::names::MAX_NAME_BYTES;
use crate::dataset::npz::{Array, NpzArchive, NpzError, shape_text};
use crate::dataset::set::{Dataset, DatasetInfo};
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::{RadarConfig, View};
use crate::task::Progress;
use choice::{assumptions, frames_of};
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Maps of a stacked file that are read in one pass, bytes: every pass reads the file from its start.
const STACKED_BYTES: usize = 64 << 20;

/// The layout.
#[derive(Debug)]
pub(super) struct Bare;

impl Layout for Bare {
    fn word(&self) -> &'static str {
        "bare"
    }

    fn in_manifests(&self) -> bool {
        false
    }

    /// What no other layout knows is asked for.
    fn claims(&self, _file: &Path) -> bool {
        true
    }

    fn open(&self, place: &DataFolder<'_>, _progress: &Progress) -> Result<Opened, DatasetError> {
        let message = format!("layout \"{}\" is for single files", self.word());
        Err(DatasetError::Manifest { message, line: None, path: place.manifest.path.clone() })
    }

    fn open_file(&self, file: &Path, _manifest: Option<&Manifest>, _: &Progress) -> Result<Opened, DatasetError> {
        let catalog = BareCatalog::read(file)?;
        match Remembered::of_user().and_then(|remembered| remembered.recall(&catalog)) {
            Some(choice) => open_chosen(&catalog, &choice),
            None => Err(DatasetError::NeedsAxes(catalog)),
        }
    }
}

impl Dataset {
    /// Opens a bare file with chosen axes, and remembers the choice for files with the same arrays.
    ///
    /// # Errors
    /// Where the choice does not fit the file. That it could not be remembered is logged, not an error.
    pub fn open_bare(path: &Path, choice: &BareChoice) -> Result<Self, DatasetError> {
        Self::open_bare_remembering(path, choice, Remembered::of_user().as_ref())
    }

    /// As [`Self::open_bare`], with the memory given.
    ///
    /// # Errors
    /// As [`Self::open_bare`].
    pub fn open_bare_remembering(
        path: &Path,
        choice: &BareChoice,
        remembered: Option<&Remembered>,
    ) -> Result<Self, DatasetError> {
        let catalog = BareCatalog::read(path)?;
        let opened = Self::of(open_chosen(&catalog, choice)?)?;
        if let Some(Err(error)) = remembered.map(|remembered| remembered.remember(&catalog, choice)) {
            tracing::warn!("the choice of axes is not remembered: {error}");
        }
        Ok(opened)
    }
}

/// Opens a file whose axes a person named.
fn open_chosen(catalog: &BareCatalog, choice: &BareChoice) -> Result<Opened, DatasetError> {
    let count = choice.frames_in(catalog)?;
    let info = DatasetInfo {
        name: file_stem(&catalog.path),
        layout: &Bare,
        root: catalog.path.clone(),
        frame_rate_hz: choice.frame_rate_hz,
        skeleton: Skeleton::preset(&choice.skeleton).unwrap_or_else(default_skeleton),
        radar: RadarConfig::default(),
        static_removed: false,
        axes_badge: axes_badge(&choice.views),
        assumptions: assumptions(&choice.views),
        views: choice.views.clone().into(),
        calibrations: Vec::new(),
        origins: Vec::new(),
        notes: Vec::new(),
    };
    opened(info, count, choice.first_axis_is_frame)
}

/// Opens a file whose axes a manifest tells; it is asked for where there is none.
pub(super) fn open_described(path: &Path, manifest: &Manifest) -> Result<Opened, DatasetError> {
    let catalog = BareCatalog::read(path)?;
    let axes = |array: &str| catalog.arrays.iter().find(|entry| entry.key == array).map(|entry| entry.shape.len());
    let stacked = manifest.views.iter().all(|view| axes(&view.array) == Some(view.axes.len() + 1));
    let count = frames_of(&manifest.views, stacked, &catalog)?;
    let mut info = DataFolder { root: path, manifest, allow_outside: false }.info(manifest);
    info.name = manifest.name.clone().unwrap_or_else(|| file_stem(path));
    info.layout = &Bare;
    opened(info, count, stacked)
}

fn opened(info: DatasetInfo, count: usize, stacked: bool) -> Result<Opened, DatasetError> {
    // The only number of frames that a few bytes can claim.
    let bytes = count.checked_mul(info.name.len() + "/000000".len() + size_of::<u32>());
    if bytes.is_none_or(|bytes| bytes > MAX_NAME_BYTES) {
        return Err(DatasetError::too_long_names(&info.root));
    }
    let frames = Box::new(Frames { count, stacked, sums: Sums::default() });
    Ok(Opened { info, frames, named: None })
}

fn file_stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "file".into(), |stem| stem.to_string_lossy().into_owned())
}

/// One file; `stacked` where the arrays' first axis counts frames.
#[derive(Debug)]
struct Frames {
    count: usize,
    stacked: bool,
    sums: Sums,
}

impl FrameSource for Frames {
    fn count(&self) -> usize {
        self.count
    }

    fn name(&self, i: usize, info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        out.write_str(&info.name)?;
        if self.stacked { write!(out, "/{i:06}") } else { Ok(()) }
    }

    fn sequences(&self) -> usize {
        1
    }

    fn sequence<'a>(&'a self, _i: usize, _name: &'a str) -> Option<&'a str> {
        None
    }

    fn files(&self, _i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        vec![info.root.clone()]
    }

    fn maps_at_once(&self, info: &DatasetInfo) -> usize {
        if !self.stacked {
            return 1;
        }
        let cells: usize = info.views.iter().map(View::cells).sum();
        (STACKED_BYTES / (cells * size_of::<f64>()).max(1)).max(1)
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        if self.stacked {
            self.sums.of(&info.root, info)?;
            return Ok(stacked_maps(&frames, &info.root, info)?);
        }
        let mut file = NpzArchive::open(&info.root)?;
        let maps = info.views.iter().map(|view| read_map(&mut file, view)).collect::<Result<_, NpzError>>()?;
        Ok(vec![maps])
    }

    /// The arrays themselves, or slab `i` of each.
    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        if self.stacked {
            self.sums.of(&info.root, info)?;
        }
        let mut file = NpzArchive::open(&info.root)?;
        let maps = info.views.iter().map(|view| {
            if !self.stacked {
                return read_map(&mut file, view);
            }
            require_stack(&mut file, view)?;
            let Array { shape, data, dtype } = file.read_slab(&view.array, i)?;
            Ok(Heatmap { shape, data, dtype })
        });
        Ok(Frame {
            timestamp_s: info.frame_rate_hz.map(|rate| i as f64 / rate),
            maps: maps.collect::<Result<Vec<_>, NpzError>>()?,
            map_boxes: vec![Vec::new(); info.views.len()],
            ..Frame::default()
        })
    }
}

/// The maps of consecutive frames of a stacked file, read in one pass.
fn stacked_maps(frames: &Range<usize>, path: &Path, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, NpzError> {
    let mut file = NpzArchive::open(path)?;
    let mut maps: Vec<Vec<Heatmap>> = frames.clone().map(|_| Vec::with_capacity(info.views.len())).collect();
    for view in &info.views {
        let shape = view.shape();
        require_stack(&mut file, view)?;
        let slabs = file.read_slabs(&view.array, frames.clone())?;
        for (maps, cells) in maps.iter_mut().zip(slabs.data.chunks_exact(view.cells().max(1))) {
            maps.push(Heatmap { shape: shape.clone(), data: cells.to_vec(), dtype: slabs.dtype.clone() });
        }
    }
    Ok(maps)
}

/// Refuses an array that is not frames of a view's maps, one after the other.
fn require_stack(file: &mut NpzArchive, view: &View) -> Result<(), NpzError> {
    let shape = view.shape();
    file.require(&view.array, |got| match got.split_first() {
        Some((_, rest)) if rest == shape => Ok(()),
        _ => Err(format!("(frames, …) of {}, the bins of its axes", shape_text(&shape))),
    })
}

/// The checksums of a stacked file. Its frames are read one by one, which no checksum covers; so the whole file is read once,
/// by whoever asks for the first frame, and what is wrong with it is told with every frame.
#[derive(Debug, Default)]
struct Sums(Mutex<Option<Verdict>>);

/// The array that is damaged and how, if one is.
type Verdict = Option<(String, String)>;

impl Sums {
    /// Compares them where that was not done before. One thread does, the others wait for it.
    ///
    /// # Errors
    /// Where an array is damaged, or the file cannot be read.
    fn of(&self, path: &Path, info: &DatasetInfo) -> Result<(), NpzError> {
        let mut verdict = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if verdict.is_none() {
            let mut file = NpzArchive::open(path)?;
            *verdict = Some(match info.views.iter().try_for_each(|view| file.verify(&view.array)) {
                Ok(()) => None,
                Err(NpzError::Corrupt { key, message, .. }) => Some((key, message)),
                Err(error) => return Err(error),
            });
        }
        let damaged = verdict.clone().flatten();
        damaged.map_or(Ok(()), |(key, message)| Err(NpzError::Corrupt { key, message, path: path.to_owned() }))
    }
}
