//! Reference cases on disk: read here with no help from the program's own loaders.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test stops where its material is missing")]

use super::common::shared;
use std::fs::File;
use std::path::{Path, PathBuf};

/// The committed reference cases, and the shared ones where there are any.
pub(crate) fn case_folders() -> Vec<PathBuf> {
    let committed = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference"));
    let mut folders: Vec<PathBuf> = std::iter::once(committed)
        .chain(shared().map(|shared| shared.join("reference")))
        .flat_map(|parent| std::fs::read_dir(parent).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("dataset.toml").is_file())
        .collect();
    folders.sort();
    assert!(folders.len() >= 8, "the committed cases are eight: {folders:?}");
    folders
}

/// One array of an npz of C-ordered `<f4` or `<f8` arrays.
pub(crate) fn read(path: &Path, key: &str) -> Vec<f64> {
    let mut archive = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
    let entry = archive.by_name(&npyz::npz::file_name_from_array_name(key));
    let npy = npyz::NpyFile::new(entry.unwrap_or_else(|error| panic!("{}: {key}: {error}", path.display()))).unwrap();
    assert_eq!(npy.header().order(), npyz::Order::C);
    if npy.dtype().descr().contains("f4") {
        npy.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect()
    } else {
        npy.into_vec::<f64>().unwrap()
    }
}
