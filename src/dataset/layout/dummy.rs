//! A layout that no data set has: what one file here and one line in [`super::LAYOUTS`] are enough for. A frame is a file
//! `NNN.dummy`, whose bytes become a map when it is asked for.

use super::index::{Folders, Segment};
use super::{
    DataFolder, FrameSource, FrameWriter, Layout, NewFrame, NewPlace, Opened, manifest_beside, no_single_file,
};
use crate::dataset::manifest::Manifest;
use crate::dataset::set::{DatasetInfo, parent};
use crate::dataset::walk::Walk;
use crate::dataset::{DatasetError, Frame, Heatmap};
use crate::radar::{PinholeCamera, View};
use crate::task::Progress;
use std::fmt::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

const PRESET: &str = r#"
name = "Dummy"
layout = "dummy"
frame_rate_hz = 4.0
skeleton = "coco17"
[[view]]
array = "bytes"
psf = { range_m = 0.1, azimuth_rad = 0.1, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [{ kind = "range", bins = 2, lo = 1.0, hi = 2.0 }, { kind = "azimuth", bins = 3, lo = -0.5, hi = 0.5 }]
"#;

#[derive(Debug)]
pub(super) struct Dummy;

impl Layout for Dummy {
    fn word(&self) -> &'static str {
        "dummy"
    }

    fn preset_text(&self) -> Option<(&'static str, &'static str)> {
        Some((PRESET, "dummy.toml"))
    }

    fn signs(&self) -> Option<&'static str> {
        Some("a dummy's NNN.dummy")
    }

    fn claims(&self, file: &Path) -> bool {
        stem_of(file).is_some()
    }

    fn open(&self, place: &DataFolder<'_>, progress: &Progress) -> Result<Opened, DatasetError> {
        open(place, None, progress)
    }

    fn open_file(&self, file: &Path, manifest: Option<&Manifest>, progress: &Progress) -> Result<Opened, DatasetError> {
        let stem = stem_of(file).ok_or_else(|| no_single_file(self.word(), file, manifest))?;
        let manifest = manifest.map_or_else(|| manifest_beside(file, &Self), |manifest| Ok(manifest.clone()))?;
        open(&DataFolder { root: parent(file), manifest: &manifest, allow_outside: false }, Some(stem), progress)
    }

    fn writer(&self) -> Option<&dyn FrameWriter> {
        Some(self)
    }

    fn camera(&self) -> Option<PinholeCamera> {
        Some(PinholeCamera { focal_px: [1.0; 2], centre_px: [0.0; 2] })
    }
}

fn open(place: &DataFolder<'_>, named: Option<&str>, progress: &Progress) -> Result<Opened, DatasetError> {
    let walk = Walk { depth: 2, stem: |name| name.strip_suffix(".dummy"), skip: |_| false, progress };
    let (folders, notes) = walk.of(place.root)?;
    let segment = |folder: crate::dataset::walk::Folder| {
        let path = place.root.join(&folder.below);
        Segment::new(path, folder.below.to_string_lossy().into_owned(), folder.stems)
    };
    let frames = Folders::new(folders.into_iter().map(segment).collect());
    if frames.count() == 0 {
        return Err(place.without_frames("NNN.dummy".into()));
    }
    let named = named.and_then(|named| (0..frames.count()).find(|&i| frames.find(i).is_some_and(|f| f.1 == named)));
    let info = DatasetInfo { notes, ..place.info(&place.manifest.layout.preset()?) };
    Ok(Opened { info, frames: Box::new(Frames(frames)), named })
}

impl FrameWriter for Dummy {
    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf> {
        vec![at.root.join(format!("take_{}", at.sequence)).join(format!("{}.dummy", at.number))]
    }

    fn write(
        &self,
        at: &NewPlace<'_>,
        _views: &[View],
        frames: &[NewFrame<'_>],
        _narrow: bool,
    ) -> Result<Option<String>, DatasetError> {
        for (path, frame) in self.files(at).iter().zip(frames) {
            let bytes: Vec<u8> = frame.maps.iter().flatten().map(|&cell| cell as u8).collect();
            std::fs::write(path, bytes).map_err(|reason| DatasetError::Write { reason, path: path.clone() })?;
        }
        Ok(None)
    }
}

fn stem_of(file: &Path) -> Option<&str> {
    file.file_name()?.to_str()?.strip_suffix(".dummy")
}

#[derive(Debug)]
struct Frames(Folders);

impl FrameSource for Frames {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn name(&self, i: usize, _info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result {
        self.0.name(i, out)
    }

    fn sequences(&self) -> usize {
        self.0.segments().len()
    }

    fn sequence<'a>(&'a self, i: usize, _name: &'a str) -> Option<&'a str> {
        self.0.sequence(i)
    }

    fn files(&self, i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        self.0.find(i).map(|(segment, stem)| segment.path.join(format!("{stem}.dummy"))).into_iter().collect()
    }

    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError> {
        let computed = |i| {
            let path = self.files(i, info).remove(0);
            let bytes = std::fs::read(&path).map_err(|reason| DatasetError::Read { reason, path: path.clone() })?;
            let data = bytes.into_iter().map(f64::from).collect();
            Ok(vec![Heatmap { shape: vec![2, 3], data, dtype: "|u1".into() }])
        };
        frames.map(computed).collect()
    }

    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError> {
        let maps = self.maps(i..i + 1, info)?.remove(0);
        Ok(Frame { maps, map_boxes: vec![Vec::new()], person_count: Some(1), ..Frame::default() })
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use crate::dataset::layout::{NewFrame, NewPlace};
    use crate::dataset::{Dataset, DatasetError, LAYOUTS, Layout, Manifest};
    use crate::task::Progress;
    use std::path::Path;

    fn open(path: &Path) -> Result<Dataset, DatasetError> {
        Dataset::open(path, &Progress::new())
    }

    /// Three frames in two sequences, as the registry's own writer puts them.
    fn written() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let writer = <dyn Layout>::named("dummy").unwrap().writer().unwrap();
        for (sequence, number, cell) in [(2, 1, 97.0), (10, 7, 99.0), (10, 8, 100.0)] {
            let at = NewPlace { root: folder.path(), sequence, sequences: 11, number };
            for file in writer.files(&at) {
                std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            }
            let maps = [vec![cell; 6]];
            let frame =
                NewFrame { maps: &maps, cubes: &[], joints: &[], velocities: &[], timestamp_s: 0.0, scenario: "" };
            writer.write(&at, &[], &[frame], false).unwrap();
        }
        folder
    }

    #[test]
    fn one_file_and_one_line_are_a_layout() {
        let folder = written();
        let dataset = open(folder.path()).unwrap();
        let info = dataset.info();
        assert_eq!((info.layout.word(), info.name.as_str(), info.frame_rate_hz), ("dummy", "Dummy", Some(4.0)));
        assert_eq!((dataset.len(), dataset.sequences(), dataset.start_index(), dataset.named_frame()), (3, 2, 0, None));
        assert_eq!((dataset.frame_name(1), dataset.sequence(2)), ("take_10/7", "take_10"));
        assert_eq!(dataset.frame_path(1), folder.path().join("take_10/7.dummy"));
        let frame = dataset.load(2).unwrap();
        assert_eq!((frame.index, frame.name.as_str(), frame.person_count), (2, "take_10/8", Some(1)));
        assert_eq!((frame.maps[0].shape.as_slice(), frame.maps[0].data[5]), ([2, 3].as_slice(), 100.0));
        assert_eq!(*dataset.recent_maps(2).unwrap(), frame.maps);
        assert_eq!(dataset.maps(0..3).map(|maps| maps.unwrap()[0].data[0]).collect::<Vec<_>>(), [97.0, 99.0, 100.0]);
        assert!(matches!(dataset.load(3), Err(DatasetError::NoSuchFrame { index: 3, count: 3, .. })));
        assert_eq!(dataset.map_arrays(0)[0].key, "bytes");
        assert!(dataset.inputs().check_replaced(&folder.path().join("take_2/1.dummy")).is_err());
        assert!(info.layout.camera().is_some());
        let one = open(&folder.path().join("take_10/8.dummy")).unwrap();
        assert_eq!((one.len(), one.named_frame(), one.info().layout.word()), (2, Some(1), "dummy"));
        let manifest = "layout = \"dummy\"\nname = \"ours\"";
        std::fs::write(folder.path().join("dataset.toml"), manifest).unwrap();
        assert_eq!(open(folder.path()).unwrap().info().name, "ours");
        assert_ne!(open(folder.path()).unwrap().fingerprint(), "");
    }

    #[test]
    fn every_layout_is_told_where_layouts_are_listed() {
        let folder = tempfile::tempdir().unwrap();
        let nothing = open(folder.path()).unwrap_err().to_string();
        let unknown = Manifest::parse("layout = \"x\"", Path::new("m.toml")).unwrap_err().to_string();
        for layout in LAYOUTS {
            assert_eq!(<dyn Layout>::named(layout.word()).map(Layout::word), Some(layout.word()), "words differ");
            assert!(layout.signs().is_none_or(|signs| nothing.contains(signs)), "{layout}: {nothing}");
            assert_eq!(unknown.contains(&format!("`{layout}`")), layout.in_manifests(), "{unknown}");
            let preset = layout.preset().unwrap();
            assert_eq!(preset.layout.word(), layout.word());
            // Those of a raw capture follow from its chirp.
            assert!(preset.views.is_empty() || layout.preset_text().is_some(), "{layout}");
        }
        assert_eq!(
            unknown,
            "m.toml:1: unknown variant `x`, expected one of `npz`, `mmvr`, `hiber`, `hupr`, `xrf55`, `rt_pose`, `capture`, `dummy`"
        );
    }

    #[test]
    fn opening_stops_when_it_is_cancelled() {
        let (folder, progress) = (written(), Progress::new());
        progress.cancel();
        assert!(matches!(Dataset::open(folder.path(), &progress), Err(DatasetError::Cancelled)));
    }
}
