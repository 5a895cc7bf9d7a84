//! `Dataset`: what was opened, and its frames one at a time.

use super::adc::ChainStages;
use super::cache::Cache;
use super::layout::{DataFolder, FrameSource, LAYOUTS, Layout, Opened, open_unknown};
use super::manifest::Manifest;
use super::names::Names;
use super::origin::{Origin, OriginPart, OriginRule};
use super::room::RoomJoints;
use super::{DatasetError, Frame, Heatmap, ViewCalibration};
use crate::body::Skeleton;
use crate::digest;
use crate::radar::{RadarConfig, ViewFft, ViewSet};
use crate::task::Progress;
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};

/// The name of a manifest inside a data set's folder.
pub const MANIFEST_NAME: &str = "dataset.toml";
/// Maps of frames around others that are kept, bytes.
const RECENT_BYTES: usize = 64 << 20;
/// Frames that are asked where they come from, to learn which parts of it are known at all.
const ASKED_ORIGINS: usize = 64;

/// Data sets that were opened.
static OPENED: AtomicU64 = AtomicU64::new(0);

/// What is true of every frame of a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct DatasetInfo {
    /// Name shown to a person.
    pub name: String,
    /// How it lies on disk.
    pub layout: &'static dyn Layout,
    /// The folder, or the bare file.
    pub root: PathBuf,
    /// Frames a second, where known.
    pub frame_rate_hz: Option<f64>,
    /// The joints that a fit has.
    pub skeleton: Skeleton,
    /// Chirp and array.
    pub radar: RadarConfig,
    /// The maps of a frame, in the order of [`Frame::maps`].
    pub views: ViewSet,
    /// Where the widths of each view come from; views that are not listed state theirs.
    pub calibrations: Vec<ViewCalibration>,
    /// Whether the data set itself took away what stands still, by a difference of frames: static dominance cannot be measured then.
    pub static_removed: bool,
    /// The convention of the axes in words.
    pub axes_badge: String,
    /// What was assumed because the data set does not publish it.
    pub assumptions: Vec<String>,
    /// Where frames come from, as the manifest says.
    pub origins: Vec<OriginRule>,
    /// What was found on opening that somebody should know: folders that could not be read.
    pub notes: Vec<String>,
}

impl DatasetInfo {
    /// Where the widths of a view come from.
    pub fn calibration(&self, view: usize) -> ViewCalibration {
        self.calibrations.get(view).cloned().unwrap_or_default()
    }

    /// The FFT configuration of each view, where it is known.
    pub fn ffts(&self) -> Vec<Option<ViewFft>> {
        (0..self.views.len()).map(|view| self.calibration(view).fft).collect()
    }
}

/// How a data set is opened.
#[derive(Debug, Clone, Copy, Default)]
pub struct OpenOptions<'a> {
    /// What says what the path is, whatever lies beside it: overrides a preset, or describes a bare file.
    pub manifest: Option<&'a Manifest>,
    /// Whether a manifest may name frames outside its own folder.
    pub allow_outside: bool,
}

/// An open data set: an index of names. Frames are read by [`Self::load`], from any thread.
#[derive(Debug)]
pub struct Dataset {
    id: u64,
    pub(super) info: DatasetInfo,
    pub(super) frames: Box<dyn FrameSource>,
    named: Option<usize>,
    names: Names,
    fingerprint: OnceLock<String>,
    origin_parts: OnceLock<[bool; OriginPart::ALL.len()]>,
    /// Maps that were asked for last beside others.
    pub(super) recent: Mutex<Cache<Vec<Heatmap>>>,
}

impl Dataset {
    /// Opens an MMVR tree or any folder inside one, a `*_radar.npz` (its folder, starting at it), HuPR's or XRF55's folders, a
    /// folder with a `dataset.toml`, a manifest itself, or an `.npy`/`.npz` of maps whose axes were chosen before.
    ///
    /// # Errors
    /// One error that names file, key and expectation; [`DatasetError::NeedsAxes`] for a bare file seen the first time.
    pub fn open(path: &Path, progress: &Progress) -> Result<Self, DatasetError> {
        Self::open_with(path, OpenOptions::default(), progress)
    }

    /// As [`Self::open`], with options.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_with(path: &Path, options: OpenOptions<'_>, progress: &Progress) -> Result<Self, DatasetError> {
        progress.begin("opening", 0);
        let opened = match options.manifest {
            Some(manifest) => open_as(path, manifest, options, progress),
            None if is_folder(path)? => match Manifest::in_folder(path)? {
                Some(manifest) => open_folder(path, &manifest, options, progress),
                None => open_unknown(path, progress),
            },
            None if is_manifest(path) => open_folder(parent(path), &Manifest::from_file(path)?, options, progress),
            None => {
                let layout = LAYOUTS.iter().find(|layout| layout.claims(path));
                let nothing = || DatasetError::NotFound { path: path.to_owned() };
                layout.ok_or_else(nothing)?.open_file(path, None, progress)
            }
        };
        Self::of(opened?)
    }

    /// Names the frames of what was opened.
    pub(super) fn of(Opened { info, frames, named }: Opened) -> Result<Self, DatasetError> {
        let names = Names::of(&*frames, &info).ok_or_else(|| DatasetError::too_long_names(&info.root))?;
        let (fingerprint, origin_parts) = (OnceLock::new(), OnceLock::new());
        let recent = Mutex::new(Cache::new(RECENT_BYTES));
        let id = OPENED.fetch_add(1, Ordering::Relaxed);
        Ok(Self { id, info, frames, named, names, fingerprint, origin_parts, recent })
    }

    /// A number that no other data set opened by this process has: what was worked out of one is not taken for another's.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// What is true of every frame.
    pub fn info(&self) -> &DatasetInfo {
        &self.info
    }

    /// Frames.
    pub fn len(&self) -> usize {
        self.frames.count()
    }

    /// True without frames; an open data set has at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The frame that the opened path names: that of a file which is one of many in its folder.
    pub fn named_frame(&self) -> Option<usize> {
        self.named
    }

    /// The frame to show first: [`Self::named_frame`], else 0.
    pub fn start_index(&self) -> usize {
        self.named.unwrap_or(0)
    }

    /// Sequences: consecutive frames with the same [`Self::sequence`].
    pub fn sequences(&self) -> usize {
        self.frames.sequences()
    }

    /// The joints in a room's frame, where the data set has them and not in the radar's.
    pub fn room_joints(&self) -> Option<&dyn RoomJoints> {
        self.frames.room_joints()
    }

    /// Tells this data set from others wherever it lies: 16 hexadecimal digits of the SHA-256 of its layout, its views'
    /// arrays and shapes, and the names of its frames. Names every frame the first time, hence not for the window's thread.
    pub fn fingerprint(&self) -> &str {
        self.fingerprint.get_or_init(|| {
            let mut hash = Sha256::new();
            hash.update(format!("{}\n", self.info.layout));
            for view in &self.info.views {
                let bins: Vec<usize> = view.axes.iter().map(|axis| axis.bins).collect();
                hash.update(format!("{} {bins:?}\n", view.array));
            }
            for frame in 0..self.len() {
                hash.update(self.frame_name(frame));
                hash.update("\n");
            }
            digest::short(hash)
        })
    }

    /// What identifies frame `i` for a person; empty past the end.
    pub fn frame_name(&self, i: usize) -> &str {
        self.names.get(i)
    }

    /// What frame `i` follows the one before in: MMVR's session and segment, a folder, or the data set.
    pub fn sequence(&self, i: usize) -> &str {
        self.frames.sequence(i, self.frame_name(i)).unwrap_or(&self.info.name)
    }

    /// Where frame `i` comes from, as far as the manifest or the layout's names say.
    pub fn origin(&self, i: usize) -> Origin {
        let (sequence, name) = (self.sequence(i), self.frame_name(i));
        let said = self.info.origins.iter().fold(Origin::default(), |known, rule| known.or(rule.of(sequence, name)));
        said.or(self.frames.origin(i))
    }

    /// Whether such a part is known of some of the frames: a few throughout them are asked.
    pub fn tells(&self, part: OriginPart) -> bool {
        let known = self.origin_parts.get_or_init(|| {
            let step = self.len().div_ceil(ASKED_ORIGINS).max(1);
            let asked: Vec<Origin> = (0..self.len()).step_by(step).map(|i| self.origin(i)).collect();
            OriginPart::ALL.map(|part| asked.iter().any(|origin| origin.part(part).is_some()))
        });
        known[part as usize]
    }

    /// The file that frame `i` is read from, the main one where there are several; the root past the end.
    pub fn frame_path(&self, i: usize) -> PathBuf {
        self.map_paths(i).into_iter().next().unwrap_or_else(|| self.info.root.clone())
    }

    /// Reads frame `i` from disk.
    ///
    /// # Errors
    /// One error that names file, key and expectation. Missing companions of a frame are notes, not errors.
    pub fn load(&self, i: usize) -> Result<Frame, DatasetError> {
        if i >= self.len() {
            return Err(DatasetError::NoSuchFrame { index: i, count: self.len(), path: self.info.root.clone() });
        }
        let frame = self.frames.load(i, &self.info)?;
        Ok(Frame { index: i, name: self.frame_name(i).to_owned(), ..frame })
    }
}

impl Dataset {
    /// Whether its frames are made of the samples of a converter: [`Self::stages`] has something to show.
    pub fn has_samples(&self) -> bool {
        self.frames.has_samples()
    }

    /// The stages of frame `i` from the converter's samples on; `None` where the data set holds maps only.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn stages(&self, i: usize) -> Result<Option<ChainStages>, DatasetError> {
        if i >= self.len() {
            return Err(DatasetError::NoSuchFrame { index: i, count: self.len(), path: self.info.root.clone() });
        }
        self.frames.stages(i, &self.info)
    }
}

/// Opens `path` as `manifest` says, whatever lies beside it.
fn open_as(
    path: &Path,
    manifest: &Manifest,
    options: OpenOptions<'_>,
    progress: &Progress,
) -> Result<Opened, DatasetError> {
    if is_folder(path)? {
        open_folder(path, manifest, options, progress)
    } else if is_manifest(path) {
        open_folder(parent(path), manifest, options, progress)
    } else {
        manifest.layout.open_file(path, Some(manifest), progress)
    }
}

fn open_folder(
    root: &Path,
    manifest: &Manifest,
    options: OpenOptions<'_>,
    progress: &Progress,
) -> Result<Opened, DatasetError> {
    manifest.layout.open(&DataFolder { root, manifest, allow_outside: options.allow_outside }, progress)
}

fn is_folder(path: &Path) -> Result<bool, DatasetError> {
    std::fs::metadata(path).map(|meta| meta.is_dir()).map_err(|reason| match reason.kind() {
        std::io::ErrorKind::NotFound => DatasetError::NotFound { path: path.to_owned() },
        _ => DatasetError::Read { reason, path: path.to_owned() },
    })
}

fn is_manifest(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// The folder that a file lies in.
pub(super) fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
