//! `Dataset`: what was opened, and its frames one at a time.

use super::bare::{BareCatalog, BareChoice, Remembered, assumptions, frames_of};
use super::cache::Cache;
use super::files::{RADAR_SUFFIX, Segment, leads_out, matching, radar_stem, segments};
use super::manifest::{Layout, Manifest};
use super::source::{MAX_NAME_BYTES, Names, Source};
use super::words::axes_badge;
use super::{DatasetError, Frame, Heatmap, generic, hupr, mmvr, xrf55};
use crate::body::Skeleton;
use crate::digest;
use crate::radar::{RadarConfig, ViewSet};
use crate::task::Progress;
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

/// The name of a manifest inside a data set's folder.
pub const MANIFEST_NAME: &str = "dataset.toml";
/// Maps of frames around others that are kept, bytes.
const RECENT_BYTES: usize = 64 << 20;

/// What is true of every frame of a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct DatasetInfo {
    /// Name shown to a person.
    pub name: String,
    /// How it lies on disk.
    pub layout: Layout,
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
    /// The convention of the axes in words.
    pub axes_badge: String,
    /// What was assumed because the data set does not publish it.
    pub assumptions: Vec<String>,
    /// What was found on opening that somebody should know: folders that could not be read.
    pub notes: Vec<String>,
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
    pub(super) info: DatasetInfo,
    pub(super) source: Source,
    start: usize,
    names: Names,
    fingerprint: OnceLock<String>,
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
        if let Some(manifest) = options.manifest {
            return Self::open_as(path, manifest, options, progress);
        }
        if is_folder(path)? {
            return match manifest_in(path)? {
                Some(manifest) => Self::open_folder(path, &manifest, options, progress),
                None => Self::open_known(path, progress),
            };
        }
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
            return Self::open_folder(parent(path), &Manifest::from_file(path)?, options, progress);
        }
        if let Some(stem) = stem_of(path) {
            let beside = manifest_in(parent(path))?.filter(|manifest| manifest.layout == Layout::Mmvr);
            let manifest = beside.map_or_else(Manifest::mmvr, Ok)?;
            return Self::open_mmvr(parent(path), false, Some(&stem), &manifest, progress);
        }
        let catalog = BareCatalog::read(path)?;
        match Remembered::of_user().and_then(|remembered| remembered.recall(&catalog)) {
            Some(choice) => Self::from_choice(&catalog, &choice),
            None => Err(DatasetError::NeedsAxes(catalog)),
        }
    }

    /// Opens `path` as `manifest` says.
    fn open_as(
        path: &Path,
        manifest: &Manifest,
        options: OpenOptions<'_>,
        progress: &Progress,
    ) -> Result<Self, DatasetError> {
        if is_folder(path)? {
            return Self::open_folder(path, manifest, options, progress);
        }
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
            return Self::open_folder(parent(path), manifest, options, progress);
        }
        match (manifest.layout, stem_of(path)) {
            (Layout::Mmvr, Some(stem)) => Self::open_mmvr(parent(path), false, Some(&stem), manifest, progress),
            (Layout::Npz, _) => Self::from_manifest(path, manifest),
            (layout, _) => {
                let message = format!("layout \"{layout}\" does not describe a single file; expected \"npz\"");
                Err(DatasetError::Manifest { message, line: None, path: manifest.path.clone() })
            }
        }
    }

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
        let opened = Self::from_choice(&catalog, choice)?;
        if let Some(Err(error)) = remembered.map(|remembered| remembered.remember(&catalog, choice)) {
            tracing::warn!("the choice of axes is not remembered: {error}");
        }
        Ok(opened)
    }

    fn open_folder(
        root: &Path,
        manifest: &Manifest,
        options: OpenOptions<'_>,
        progress: &Progress,
    ) -> Result<Self, DatasetError> {
        match manifest.layout {
            Layout::Npz => Self::open_files(root, manifest, options, progress),
            Layout::Mmvr => Self::open_mmvr(root, true, None, manifest, progress),
            Layout::Hupr => Self::open_hupr(root, manifest, progress),
            Layout::Xrf55 => Self::open_xrf55(root, manifest, progress),
            Layout::Bare => Err(DatasetError::Manifest {
                message: "layout \"bare\" is for single files; expected npz, mmvr, hupr or xrf55".into(),
                line: None,
                path: manifest.path.clone(),
            }),
        }
    }

    /// A folder without a manifest: MMVR's, HuPR's or XRF55's, whichever files are found first.
    fn open_known(root: &Path, progress: &Progress) -> Result<Self, DatasetError> {
        let mmvr = Self::open_mmvr(root, true, None, &Manifest::mmvr()?, progress);
        let Err(DatasetError::NoFrames { expected, .. }) = mmvr else { return mmvr };
        let hupr = Self::open_hupr(root, &Manifest::hupr()?, progress);
        if !matches!(hupr, Err(DatasetError::NoFrames { .. })) {
            return hupr;
        }
        let xrf55 = Self::open_xrf55(root, &Manifest::xrf55()?, progress);
        if !matches!(xrf55, Err(DatasetError::NoFrames { .. })) {
            return xrf55;
        }
        let expected = format!("{expected}, or HuPR's hori/ and vert/, or XRF55's XX_YY_ZZ.npy");
        Err(DatasetError::NoFrames { expected, path: root.to_owned() })
    }

    fn open_hupr(root: &Path, manifest: &Manifest, progress: &Progress) -> Result<Self, DatasetError> {
        progress.begin("listing folders", 0);
        let (segments, notes) = hupr::sequences(root, progress)?;
        if segments.is_empty() {
            let expected = "HuPR's single_<k>/hori/NNNNNNNNN.npy and vert/ in it or in a folder below".into();
            return Err(DatasetError::NoFrames { expected, path: root.to_owned() });
        }
        let (starts, frames) = counted(&segments);
        let preset = Manifest::hupr()?;
        let mut info = info_of(root, manifest, &preset, "HuPR".into());
        info.notes = notes;
        info.assumptions.extend(hupr::assumptions());
        let labels = hupr::Annotations::beside(root, &segments);
        Self::of(info, Source::Hupr { segments, starts, frames, labels }, 0)
    }

    fn open_xrf55(root: &Path, manifest: &Manifest, progress: &Progress) -> Result<Self, DatasetError> {
        progress.begin("listing files", 0);
        let (files, notes) = xrf55::stacks(root, progress)?;
        if files.is_empty() {
            let expected = "XRF55's XX_YY_ZZ.npy in it or in a folder below".into();
            return Err(DatasetError::NoFrames { expected, path: root.to_owned() });
        }
        let preset = Manifest::xrf55()?;
        let mut info = info_of(root, manifest, &preset, "XRF55".into());
        info.notes = notes;
        if *info.views == *preset.views {
            info.assumptions.extend(xrf55::assumptions());
        }
        let steps = if info.views.iter().all(|view| view.axes.len() == 2) { xrf55::STEPS } else { 1 };
        Self::of(info, Source::Stacks { files, steps }, 0)
    }

    fn open_files(
        root: &Path,
        manifest: &Manifest,
        options: OpenOptions<'_>,
        progress: &Progress,
    ) -> Result<Self, DatasetError> {
        let Some(pattern) = &manifest.frames else {
            let message = "missing key `frames`; layout \"npz\" needs it, for example \"frames/*.npz\"".into();
            return Err(DatasetError::Manifest { message, line: None, path: manifest.path.clone() });
        };
        if leads_out(pattern) && !options.allow_outside {
            let (frames, line, path) = (pattern.clone(), manifest.frames_line, manifest.path.clone());
            return Err(DatasetError::Outside { frames, line, path });
        }
        let files = matching(root, pattern, progress)?;
        if files.is_empty() {
            let expected = format!("files that match `frames = \"{pattern}\"` of {}", manifest.path.display());
            return Err(DatasetError::NoFrames { expected, path: root.to_owned() });
        }
        Self::of(info_of(root, manifest, manifest, folder_name(root)), Source::Files(files), 0)
    }

    fn open_mmvr(
        root: &Path,
        deep: bool,
        stem: Option<&str>,
        manifest: &Manifest,
        progress: &Progress,
    ) -> Result<Self, DatasetError> {
        let (segments, notes) = segments(root, deep, progress)?;
        if segments.is_empty() {
            let expected = format!("{MANIFEST_NAME}, or MMVR's NNNNN{RADAR_SUFFIX} in it or in a folder below");
            let expected = notes.iter().fold(expected, |text, note| format!("{text}; {note}"));
            return Err(DatasetError::NoFrames { expected, path: root.to_owned() });
        }
        let (starts, frames) = counted(&segments);
        let start = stem.and_then(|stem| {
            let segment = segments.first()?;
            (0..segment.len()).find(|&i| segment.stem(i) == stem)
        });
        let preset = Manifest::mmvr()?;
        let mut info = info_of(root, manifest, &preset, "MMVR".into());
        info.notes = notes;
        if info.frame_rate_hz == preset.frame_rate_hz {
            info.assumptions.push("frame rate: 900 frames a minute-long segment, hence 15 a second".into());
        }
        if *info.views == *preset.views {
            info.assumptions
                .push("point spread: 0.06 m and 0.03 rad are assumed; MMVR does not publish its own".into());
            info.assumptions.push("quantity: amplitudes are assumed, from the spread of the values".into());
        }
        Self::of(info, Source::Mmvr { segments, starts, frames }, start.unwrap_or(0))
    }

    fn from_choice(catalog: &BareCatalog, choice: &BareChoice) -> Result<Self, DatasetError> {
        let frames = choice.frames_in(catalog)?;
        let skeleton = Skeleton::preset(&choice.skeleton).unwrap_or_else(default_skeleton);
        let info = DatasetInfo {
            name: file_stem(&catalog.path),
            layout: Layout::Bare,
            root: catalog.path.clone(),
            frame_rate_hz: choice.frame_rate_hz,
            skeleton,
            radar: RadarConfig::default(),
            axes_badge: axes_badge(&choice.views),
            assumptions: assumptions(&choice.views),
            views: choice.views.clone().into(),
            notes: Vec::new(),
        };
        Self::of(info, Source::bare(frames, choice.first_axis_is_frame), 0)
    }

    fn from_manifest(path: &Path, manifest: &Manifest) -> Result<Self, DatasetError> {
        let catalog = BareCatalog::read(path)?;
        let axes = |array: &str| catalog.arrays.iter().find(|entry| entry.key == array).map(|entry| entry.shape.len());
        let stacked = manifest.views.iter().all(|view| axes(&view.array) == Some(view.axes.len() + 1));
        let frames = frames_of(&manifest.views, stacked, &catalog)?;
        let mut info = info_of(path, manifest, manifest, file_stem(path));
        info.layout = Layout::Bare;
        Self::of(info, Source::bare(frames, stacked), 0)
    }

    fn of(info: DatasetInfo, source: Source, start: usize) -> Result<Self, DatasetError> {
        let names = source.names(&info.name).ok_or_else(|| DatasetError::TooMany {
            what: "bytes in the names of all frames",
            most: MAX_NAME_BYTES,
            path: info.root.clone(),
        })?;
        let (fingerprint, recent) = (OnceLock::new(), Mutex::new(Cache::new(RECENT_BYTES)));
        Ok(Self { info, source, start, names, fingerprint, recent })
    }

    /// What is true of every frame.
    pub fn info(&self) -> &DatasetInfo {
        &self.info
    }

    /// Frames.
    pub fn len(&self) -> usize {
        match &self.source {
            Source::Mmvr { frames, .. } | Source::Hupr { frames, .. } | Source::Bare { frames, .. } => *frames,
            Source::Stacks { files, steps } => files.len() * steps,
            Source::Files(files) => files.len(),
        }
    }

    /// True without frames; an open data set has at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The frame to show first: that of the `*_radar.npz` that was opened, else 0.
    pub fn start_index(&self) -> usize {
        self.start
    }

    /// Sequences: consecutive frames with the same [`Self::sequence`].
    pub fn sequences(&self) -> usize {
        match &self.source {
            Source::Mmvr { segments, .. } | Source::Hupr { segments, .. } => segments.len(),
            // Clips of seventeen maps; files that are a frame each follow one another in their folder.
            Source::Stacks { files, steps } if *steps > 1 => files.len(),
            Source::Files(files) | Source::Stacks { files, .. } => {
                let mut folders: Vec<_> = files.iter().map(|file| file.parent()).collect();
                folders.dedup();
                folders.len()
            }
            Source::Bare { .. } => 1,
        }
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
        let found = match &self.source {
            Source::Mmvr { .. } | Source::Hupr { .. } => self.segment(i).map(|(segment, _)| segment.sequence.as_str()),
            Source::Stacks { steps, .. } if *steps > 1 => self.frame_name(i).rsplit_once('/').map(|(clip, _)| clip),
            Source::Files(files) | Source::Stacks { files, .. } => {
                files.get(i).and_then(|file| file.parent()?.to_str()).filter(|name| !name.is_empty())
            }
            Source::Bare { .. } => None,
        };
        found.unwrap_or(&self.info.name)
    }

    /// The file that frame `i` is read from; the root past the end.
    pub fn frame_path(&self, i: usize) -> PathBuf {
        let found = match &self.source {
            Source::Mmvr { .. } => {
                self.segment(i).map(|(segment, k)| segment.path.join(format!("{}{RADAR_SUFFIX}", segment.stem(k))))
            }
            Source::Hupr { .. } => {
                let array = self.info.views.first().map_or("hori", |view| &view.array);
                self.segment(i).map(|(segment, k)| segment.path.join(array).join(format!("{}.npy", segment.stem(k))))
            }
            Source::Stacks { files, steps } => files.get(i / steps).map(|file| self.info.root.join(file)),
            Source::Files(files) => files.get(i).map(|file| self.info.root.join(file)),
            Source::Bare { .. } => None,
        };
        found.unwrap_or_else(|| self.info.root.clone())
    }

    /// Reads frame `i` from disk.
    ///
    /// # Errors
    /// One error that names file, key and expectation. Missing companions of an MMVR frame are notes, not errors.
    pub fn load(&self, i: usize) -> Result<Frame, DatasetError> {
        if i >= self.len() {
            return Err(DatasetError::NoSuchFrame { index: i, count: self.len(), path: self.info.root.clone() });
        }
        let (name, path) = (self.frame_name(i).to_owned(), self.frame_path(i));
        let past = || DatasetError::NoSuchFrame { index: i, count: self.len(), path: self.info.root.clone() };
        match &self.source {
            Source::Stacks { steps, .. } => xrf55::load(i, name, &path, i % steps, &self.info),
            Source::Hupr { labels, .. } => {
                let (segment, k) = self.segment(i).ok_or_else(past)?;
                hupr::load(i, &segment.path, &segment.sequence, segment.stem(k), labels, &self.info)
            }
            Source::Files(_) => generic::load(i, name, &path, &self.info),
            Source::Bare { stacked, sums, .. } => {
                if *stacked {
                    sums.of(&path, &self.info)?;
                }
                generic::load_bare(i, name, &path, *stacked, &self.info)
            }
            Source::Mmvr { .. } => {
                let (segment, k) = self.segment(i).ok_or_else(past)?;
                mmvr::load(i, &segment.path, &segment.sequence, segment.stem(k), &self.info)
            }
        }
    }

    /// The segment of frame `i` and the frame's index in it.
    pub(super) fn segment(&self, i: usize) -> Option<(&Segment, usize)> {
        let (Source::Mmvr { segments, starts, frames } | Source::Hupr { segments, starts, frames, .. }) = &self.source
        else {
            return None;
        };
        let at = starts.partition_point(|&start| start <= i).checked_sub(1).filter(|_| i < *frames)?;
        Some((segments.get(at)?, i - starts.get(at)?))
    }
}

/// The index of the first frame of each segment, and the frames in all.
fn counted(segments: &[Segment]) -> (Vec<usize>, usize) {
    let starts = segments.iter().scan(0, |at, segment| Some(std::mem::replace(at, *at + segment.len()))).collect();
    (starts, segments.iter().map(Segment::len).sum())
}

/// What a manifest says, filled up from its layout's preset; what neither says is assumed, and told.
fn info_of(root: &Path, manifest: &Manifest, preset: &Manifest, name: String) -> DatasetInfo {
    let views = if manifest.views.is_empty() { &preset.views } else { &manifest.views };
    let mut assumptions = Vec::new();
    let radar = manifest.radar.clone().or_else(|| preset.radar.clone()).unwrap_or_else(|| {
        assumptions.push(
            "radar: chirp and array are not published; a 77 GHz radar with 2.5 GHz of bandwidth is assumed".into(),
        );
        RadarConfig::default()
    });
    let skeleton = manifest.skeleton.clone().or_else(|| preset.skeleton.clone()).unwrap_or_else(default_skeleton);
    DatasetInfo {
        name: manifest.name.clone().unwrap_or(name),
        layout: manifest.layout,
        root: root.to_owned(),
        frame_rate_hz: manifest.frame_rate_hz.or(preset.frame_rate_hz),
        skeleton,
        radar,
        axes_badge: axes_badge(views),
        views: views.clone().into(),
        assumptions,
        notes: Vec::new(),
    }
}

fn default_skeleton() -> Skeleton {
    Skeleton::preset("coco17").unwrap_or(Skeleton {
        joints: Vec::new(),
        bones: Vec::new(),
        bone_lengths_m: Vec::new(),
        angles: Vec::new(),
    })
}

fn is_folder(path: &Path) -> Result<bool, DatasetError> {
    std::fs::metadata(path).map(|meta| meta.is_dir()).map_err(|reason| match reason.kind() {
        std::io::ErrorKind::NotFound => DatasetError::NotFound { path: path.to_owned() },
        _ => DatasetError::Read { reason, path: path.to_owned() },
    })
}

/// The manifest in a folder, where there is one.
fn manifest_in(folder: &Path) -> Result<Option<Manifest>, DatasetError> {
    let path = folder.join(MANIFEST_NAME);
    let there = path.try_exists().map_err(|reason| DatasetError::Read { reason, path: path.clone() })?;
    if there { Manifest::from_file(&path).map(Some) } else { Ok(None) }
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn folder_name(root: &Path) -> String {
    let whole = std::path::absolute(root).unwrap_or_else(|_| root.to_owned());
    whole.file_name().map_or_else(|| "data set".into(), |name| name.to_string_lossy().into_owned())
}

fn file_stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "file".into(), |stem| stem.to_string_lossy().into_owned())
}

/// `00383` of `.../00383_radar.npz`.
fn stem_of(path: &Path) -> Option<String> {
    radar_stem(path.file_name()?.to_str()?).map(str::to_owned)
}
