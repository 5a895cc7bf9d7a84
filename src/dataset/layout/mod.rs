//! The layouts of data sets. A layout is one file (or folder) here that implements [`Layout`], and one line in [`LAYOUTS`]:
//! nothing else in the program knows it by name.
//!
//! A layout says what it is called ([`Layout::word`]), what its data set publishes ([`Layout::preset_text`]), how a path is told
//! to be of it ([`Layout::signs`], [`Layout::claims`]), and opens it: by names of files, which become a [`FrameSource`]. That
//! gives names and sequences, says which files a frame is made of (one, one a view, or one for many frames), and reads or computes
//! the frame when it is asked for. [`Layout::writer`] writes new frames in the same files. What layouts have in common lies
//! beside them: `index.rs` (folders of frames, lists of files), `arrays.rs` (maps and truth), `write.rs`.

mod arrays;
mod bare;
mod dca;
#[cfg(test)]
mod dummy;
mod frames;
mod generic;
mod hiber;
mod hupr;
mod index;
mod mmvr;
mod pattern;
mod rt_pose;
mod write;
mod xrf55;

pub use bare::{BareCatalog, BareChoice, Remembered};
pub use dca::ChirpForm;
pub use frames::{FrameSource, MapArray, Stored};
pub use write::{FrameWriter, MANTISSA_BITS, NewFrame, NewPlace};

use super::DatasetError;
use super::axes_text::axes_badge;
use super::manifest::Manifest;
use super::set::{DatasetInfo, MANIFEST_NAME};
use crate::body::Skeleton;
use crate::radar::{PinholeCamera, RadarConfig};
use crate::task::Progress;
use std::fmt::{self, Debug, Display};
use std::path::Path;

/// Every layout, in the order in which an unknown path is compared with them; the bare file, which takes any, comes last.
pub static LAYOUTS: &[&dyn Layout] = &[
    &generic::Generic,
    &mmvr::Mmvr,
    &hiber::Hiber,
    &hupr::Hupr,
    &xrf55::Xrf55,
    &rt_pose::RtPose,
    &dca::Dca,
    #[cfg(test)]
    &dummy::Dummy,
    &bare::Bare,
];

/// How a data set lies on disk.
pub trait Layout: Debug + Sync {
    /// The word in manifests, in `info`, in fingerprints and in run folders: it stays as it is for good.
    fn word(&self) -> &'static str;

    /// A manifest of the data set as it is published, and the path that messages give for it; `None` where every data set of
    /// this layout describes itself, in a manifest or by choice.
    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        None
    }

    /// Whether a manifest may name it.
    fn in_manifests(&self) -> bool {
        true
    }

    /// What tells a folder without a manifest, in words; `None` where only a manifest does.
    fn signs(&self) -> Option<&'static str> {
        None
    }

    /// Whether a file is of this layout by its name, without a manifest that says so.
    fn claims(&self, _file: &Path) -> bool {
        false
    }

    /// Opens a folder: finds the files of its frames, reads none. Stops soon after `progress` is cancelled.
    ///
    /// # Errors
    /// [`DatasetError::NoFrames`] where the folder is not of this layout, and what else can be wrong with it.
    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError>;

    /// Opens a file: the data set that it is, or the folder that it is a frame of. `manifest` is what describes it, where
    /// somebody said so.
    ///
    /// # Errors
    /// Where the layout has no such files, and what else can be wrong with it.
    fn open_file(
        &self,
        file: &Path,
        manifest: Option<&Manifest>,
        _progress: &Progress,
    ) -> Result<Opened, DatasetError> {
        Err(no_single_file(self.word(), file, manifest))
    }

    /// Writes new frames in this layout's files, where it can.
    fn writer(&self) -> Option<&dyn FrameWriter> {
        None
    }

    /// The camera whose pixels its image labels are, where its calibration is published.
    fn camera(&self) -> Option<PinholeCamera> {
        None
    }
}

impl dyn Layout {
    /// The layout of that word.
    pub fn named(word: &str) -> Option<&'static Self> {
        LAYOUTS.iter().copied().find(|layout| layout.word() == word)
    }

    /// What is known of every data set of this layout before a manifest says otherwise.
    ///
    /// # Errors
    /// Never for the files that the program was built with; a test holds it.
    pub fn preset(&'static self) -> Result<Manifest, DatasetError> {
        let Some((text, path)) = self.preset_text() else { return Ok(Manifest::unsaid(self)) };
        Manifest::parse(text, Path::new(path))
    }
}

impl PartialEq for dyn Layout {
    fn eq(&self, other: &Self) -> bool {
        self.word() == other.word()
    }
}

impl Display for dyn Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A folder that is to be opened.
#[derive(Debug, Clone, Copy)]
pub struct DataFolder<'a> {
    /// The folder.
    pub root: &'a Path,
    /// What describes it: its own manifest, another that was given, or the preset.
    pub manifest: &'a Manifest,
    /// Whether a manifest may name frames outside its own folder.
    pub allow_outside: bool,
}

impl DataFolder<'_> {
    /// What the manifest says, filled up from its layout's `preset`; what neither says is assumed, and told.
    fn info(&self, preset: &Manifest) -> DatasetInfo {
        let manifest = self.manifest;
        let said = if manifest.views.is_empty() { preset } else { manifest };
        let (views, calibrations) = (&said.views, said.calibrations.clone());
        let mut assumptions = Vec::new();
        let radar = manifest.radar.clone().or_else(|| preset.radar.clone()).unwrap_or_else(|| {
            assumptions.push(
                "radar: chirp and array are not published; a 77 GHz radar with 2.5 GHz of bandwidth is assumed".into(),
            );
            RadarConfig::default()
        });
        let skeleton = manifest.skeleton.clone().or_else(|| preset.skeleton.clone()).unwrap_or_else(default_skeleton);
        DatasetInfo {
            name: manifest.name.clone().or_else(|| preset.name.clone()).unwrap_or_else(|| folder_name(self.root)),
            layout: manifest.layout,
            root: self.root.to_owned(),
            frame_rate_hz: manifest.frame_rate_hz.or(preset.frame_rate_hz),
            skeleton,
            radar,
            axes_badge: axes_badge(views),
            views: views.clone().into(),
            calibrations,
            static_removed: false,
            assumptions,
            origins: manifest.origins.clone(),
            notes: Vec::new(),
        }
    }

    /// No frames: `expected` would have been some.
    fn without_frames(&self, expected: String) -> DatasetError {
        DatasetError::NoFrames { expected, path: self.root.to_owned() }
    }
}

/// What a layout made of a path.
#[derive(Debug)]
pub struct Opened {
    /// What is true of every frame.
    pub info: DatasetInfo,
    /// The frames; at least one.
    pub frames: Box<dyn FrameSource>,
    /// The frame that the path named, where it named one.
    pub named: Option<usize>,
}

/// Opens a folder without a manifest as the first layout that finds frames in it.
///
/// # Errors
/// Where none does: what each would have taken for a frame.
pub(super) fn open_unknown(root: &Path, progress: &Progress) -> Result<Opened, DatasetError> {
    let mut wanted: Option<String> = None;
    for &layout in LAYOUTS {
        let Some(signs) = layout.signs() else { continue };
        let manifest = layout.preset()?;
        match layout.open(&DataFolder { root, manifest: &manifest, allow_outside: false }, progress) {
            // The first says what it left out, and that there is no manifest.
            Err(DatasetError::NoFrames { expected, .. }) => {
                wanted = Some(wanted.map_or(expected, |wanted| format!("{wanted}, or {signs}")));
            }
            answer => return answer,
        }
    }
    let expected = wanted.unwrap_or_else(|| MANIFEST_NAME.to_owned());
    Err(DatasetError::NoFrames { expected, path: root.to_owned() })
}

/// The manifest beside a file where it is of this layout, else the layout's preset.
fn manifest_beside(file: &Path, layout: &'static dyn Layout) -> Result<Manifest, DatasetError> {
    let beside = Manifest::in_folder(super::set::parent(file))?.filter(|manifest| *manifest.layout == *layout);
    beside.map_or_else(|| layout.preset(), Ok)
}

fn no_single_file(word: &str, file: &Path, manifest: Option<&Manifest>) -> DatasetError {
    let message = format!("layout \"{word}\" does not describe a single file; expected \"{}\"", generic::WORD);
    let path = manifest.map_or(file, |manifest| &manifest.path).to_owned();
    DatasetError::Manifest { message, line: None, path }
}

/// The folder's own name, however it was typed.
fn folder_name(root: &Path) -> String {
    let whole = std::path::absolute(root).unwrap_or_else(|_| root.to_owned());
    whole.file_name().map_or_else(|| "data set".into(), |name| name.to_string_lossy().into_owned())
}

/// The joints of a fit where nobody says others.
fn default_skeleton() -> Skeleton {
    Skeleton::preset("coco17").unwrap_or(Skeleton {
        joints: Vec::new(),
        bones: Vec::new(),
        bone_lengths_m: Vec::new(),
        angles: Vec::new(),
    })
}
