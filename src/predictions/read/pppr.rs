//! PPPR files of an earlier run: one npz a frame, in the units and axes of the program, on the skeleton of the data set.

use crate::dataset::read_pppr;
use crate::predictions::error::PredictionError;
use crate::predictions::raw::{FileFrame, FrameKey, RawPredictions};
use std::path::{Path, PathBuf};

/// The folder of parameters inside one of results.
const PARAMS: &str = "pppr";
/// Files of a folder at most.
const MOST_FILES: usize = 2_000_000;

/// The joints of a PPPR file have no names in it: they are those of the data set.
pub(crate) const OWN_SKELETON: &str = "pppr";

pub(super) fn read_file(path: &Path) -> Result<RawPredictions, PredictionError> {
    of_files(&[path.to_owned()], path)
}

/// A folder of PPPR files, or the folder of results that it is in.
pub(super) fn read_folder(folder: &Path) -> Result<RawPredictions, PredictionError> {
    let inner = folder.join(PARAMS);
    let folder = if inner.is_dir() { inner } else { folder.to_owned() };
    let failed = |reason| PredictionError::Read { reason, path: folder.clone() };
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|ending| ending == "npz") {
            files.push(path);
        }
        if files.len() > MOST_FILES {
            return Err(PredictionError::format(&folder, format!("more than {MOST_FILES} files")));
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(PredictionError::format(&folder, "no npz in it; expected PPPR files, as `fit --out` writes them"));
    }
    of_files(&files, &folder)
}

fn of_files(files: &[PathBuf], whole: &Path) -> Result<RawPredictions, PredictionError> {
    let mut raw = RawPredictions {
        unit: Some("m".into()),
        axes: Some("radar".into()),
        form: OWN_SKELETON.into(),
        ..RawPredictions::default()
    };
    for file in files {
        let params = read_pppr(file, None)?;
        let shape = params.shape();
        if raw.joint_count != 0 && raw.joint_count != shape.joints {
            let message = format!("{} joints a person; the files before it have {}", shape.joints, raw.joint_count);
            return Err(PredictionError::Skeleton { message, path: file.clone() });
        }
        raw.joint_count = shape.joints;
        let Some(stem) = file.file_stem() else { continue };
        let persons = (0..shape.persons).map(|person| params.person(person).to_vec()).collect();
        raw.frames.push(FileFrame { key: FrameKey::Name(stem.to_string_lossy().into_owned()), persons });
    }
    if raw.frames.is_empty() {
        return Err(PredictionError::format(whole, "no frame in it"));
    }
    Ok(raw)
}
