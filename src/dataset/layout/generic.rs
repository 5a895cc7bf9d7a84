//! One npz a frame, described by a manifest that names the files; SPEC section 6.

use super::arrays::{read_map, read_truth, scalar};
use super::index::{folder_of, folders_of};
use super::pattern::{leads_out, matching};
use super::write::{COCO_JOINTS, NewFrame, NewPlace, TruthArrays, named, rounded_maps};
use super::{DataFolder, FrameSource, FrameWriter, Layout, Opened, bare, no_single_file};
use crate::dataset::manifest::Manifest;
use crate::dataset::npz::{NpzArchive, NpzError, write_deflated};
use crate::dataset::set::DatasetInfo;
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::View;
use crate::task::Progress;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The word in manifests.
pub(super) const WORD: &str = "npz";

/// The layout.
#[derive(Debug)]
pub(super) struct Generic;

impl Layout for Generic {
    fn word(&self) -> &'static str {
        WORD
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        let (root, manifest) = (place.root, place.manifest);
        let Some(pattern) = &manifest.frames else {
            let message = format!("missing key `frames`; layout \"{WORD}\" needs it, for example \"frames/*.npz\"");
            return Err(DatasetError::Manifest { message, line: None, path: manifest.path.clone() });
        };
        if leads_out(pattern) && !place.allow_outside {
            let (frames, line, path) = (pattern.clone(), manifest.frames_line, manifest.path.clone());
            return Err(DatasetError::Outside { frames, line, path });
        }
        let files = matching(root, pattern, progress)?;
        if files.is_empty() {
            let expected = format!("files that match `frames = \"{pattern}\"` of {}", manifest.path.display());
            return Err(place.without_frames(expected));
        }
        let info = place.info(&manifest.layout.preset()?);
        Ok(Opened { info, frames: Box::new(Frames(files)), named: None })
    }

    fn writer(&self) -> Option<&dyn FrameWriter> {
        Some(self)
    }

    /// A bare file whose axes the manifest tells.
    fn open_file(&self, file: &Path, manifest: Option<&Manifest>, _: &Progress) -> Result<Opened, DatasetError> {
        let manifest = manifest.ok_or_else(|| no_single_file(WORD, file, manifest))?;
        bare::open_described(file, manifest)
    }
}

impl FrameWriter for Generic {
    /// `frames/s000/000000.npz`, or `frames/000000.npz` where there is one sequence only.
    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf> {
        let folder = at.root.join("frames");
        let folder = if at.sequences == 1 { folder } else { folder.join(format!("s{:03}", at.sequence)) };
        vec![folder.join(format!("{:06}.npz", at.number))]
    }

    fn write(
        &self,
        at: &NewPlace<'_>,
        views: &[View],
        frames: &[NewFrame<'_>],
        _narrow: bool,
    ) -> Result<Option<String>, DatasetError> {
        for (path, frame) in self.files(at).iter().zip(frames) {
            let (maps, truth) = (rounded_maps(frame), TruthArrays::of(frame, COCO_JOINTS));
            let arrays: Vec<_> = named(views, &maps).into_iter().chain(truth.arrays()).collect();
            write_deflated(path, &arrays)?;
        }
        Ok(None)
    }

    fn pattern(&self, sequences: usize) -> Option<&'static str> {
        Some(if sequences == 1 { "frames/*.npz" } else { "frames/*/*.npz" })
    }
}

/// Files relative to the root.
#[derive(Debug)]
struct Frames(Vec<PathBuf>);

impl Frames {
    /// The file of frame `i`; the data set's folder past the end.
    fn path(&self, i: usize, info: &DatasetInfo) -> PathBuf {
        self.0.get(i).map_or_else(|| info.root.clone(), |file| info.root.join(file))
    }
}

impl FrameSource for Frames {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        self.0.get(i).map_or(Ok(()), |file| out.write_str(&file.with_extension("").to_string_lossy()))
    }

    fn sequences(&self) -> usize {
        folders_of(&self.0)
    }

    fn sequence<'a>(&'a self, i: usize, _name: &'a str) -> Option<&'a str> {
        self.0.get(i).and_then(|file| folder_of(file))
    }

    fn files(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf> {
        vec![self.path(i, info)]
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        frames.map(|i| Ok(read_maps(&mut NpzArchive::open(&self.path(i, info))?, info)?)).collect()
    }

    /// Maps, with joints, velocities, person count and time where the file has them.
    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let mut file = NpzArchive::open(&self.path(i, info))?;
        let mut notes = Vec::new();
        let maps = read_maps(&mut file, info)?;
        let truth = read_truth(&mut file, info.skeleton.joints.len())?;
        let person_count = match scalar(&mut file, "person_count")? {
            Some(count) if count >= 0.0 && count.fract() == 0.0 => Some(count as usize),
            Some(count) => {
                notes.push(format!("person_count is {count}; expected a whole number, it is ignored"));
                None
            }
            None => None,
        };
        if let (Some(count), Some(truth)) = (person_count, &truth)
            && count != truth.persons
        {
            notes.push(format!("person_count is {count}, joints has {} persons", truth.persons));
        }
        let timestamp_s = scalar(&mut file, "timestamp_s")?;
        Ok(Frame {
            timestamp_s: timestamp_s.or_else(|| info.frame_rate_hz.map(|rate| i as f64 / rate)),
            maps,
            map_boxes: vec![Vec::new(); info.views.len()],
            person_count: person_count.or_else(|| truth.as_ref().map(|truth| truth.persons)),
            truth,
            notes,
            ..Frame::default()
        })
    }
}

fn read_maps(file: &mut NpzArchive, info: &DatasetInfo) -> Result<Vec<Heatmap>, NpzError> {
    info.views.iter().map(|view| read_map(file, view)).collect()
}
