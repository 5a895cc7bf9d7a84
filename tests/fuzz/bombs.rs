//! Small files that claim to be large: refused by their headers, whatever they inflate to.

use crate::harness::alone;
use crate::material::{self, npy};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::task::Progress;
use std::io::{Cursor, Write as _};
use std::path::Path;

/// Bytes that one refusal may take. An allocation beyond it ends the process.
const ROOM: usize = 48 << 20;

/// Opens and loads in little memory, and gives the errors and notes.
fn told(folder: &Path) -> String {
    let limit = crate::ALLOCATOR.limit();
    crate::ALLOCATOR.set_limit(crate::ALLOCATOR.allocated() + ROOM).unwrap();
    let loaded = Dataset::open(folder, &Progress::new()).and_then(|dataset| dataset.load(0));
    crate::ALLOCATOR.set_limit(limit).unwrap();
    loaded.map_or_else(|error| error.to_string(), |frame| frame.notes.join("\n"))
}

/// An archive of one array of so many zero bytes, which deflate to nothing.
fn zeros(key: &str, descr: &str, shape: &str, bytes: usize) -> Vec<u8> {
    let options = zip::write::FileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    archive.start_file(format!("{key}.npy"), options).unwrap();
    archive.write_all(&npy(descr, shape, false, &[])).unwrap();
    let piece = vec![0; 1 << 20];
    for _ in 0..bytes >> 20 {
        archive.write_all(&piece).unwrap();
    }
    let file = archive.finish().unwrap().into_inner();
    assert!(file.len() < 1 << 20, "a small file");
    file
}

#[test]
fn labels_of_mmvr_that_inflate_to_gigabytes_are_refused_by_their_headers() {
    let _alone = alone();
    let cases: [(usize, &str, &str, &str, &str); 5] = [
        (
            2,
            "global_frame_id",
            "<i8",
            "(33554432,)",
            "array `global_frame_id` declares shape (33554432,), 268435456 bytes; at most 512 elements",
        ),
        (2, "global_frame_id", "<U67108864", "()", "array `global_frame_id` declares shape (), 268435456 bytes"),
        (3, "bbox_i", "<f4", "(13421772, 5)", "array `bbox_i` has shape (13421772, 5); expected at most 256 persons"),
        (4, "kp", "<f4", "(1315860, 17, 3)", "array `kp` has shape (1315860, 17, 3); expected at most 256 persons"),
        (
            6,
            "joints",
            "<f4",
            "(1315860, 17, 3)",
            "array `joints` has shape (1315860, 17, 3); expected at most 256 persons",
        ),
    ];
    for (file, key, descr, shape, wanted) in cases {
        let home = tempfile::tempdir().unwrap();
        let mut files: Vec<(String, Vec<u8>)> =
            material::mmvr().into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect();
        files[file].1 = zeros(key, descr, shape, 1 << 28);
        material::lay_out(home.path(), &files);
        drop(files);
        let told = told(home.path());
        assert!(told.contains(wanted), "{told}");
    }
}

#[test]
fn maps_that_are_not_the_declared_ones_are_refused_by_their_headers() {
    let _alone = alone();
    let home = tempfile::tempdir().unwrap();
    let frame = zeros("hori", "<f4", "(8192, 8192)", 1 << 28);
    let manifest = material::MANIFEST.as_bytes().to_vec();
    let files = [("dataset.toml".to_owned(), manifest), ("frames/0.npz".to_owned(), frame)];
    material::lay_out(home.path(), &files);
    let said = told(home.path());
    assert!(said.ends_with("array `hori` has shape (8192, 8192); expected (12, 8), the bins of its axes"), "{said}");
    let large = material::MANIFEST.replacen("bins = 12", "bins = 8192", 1).replacen("bins = 8,", "bins = 8192,", 1);
    std::fs::write(home.path().join("dataset.toml"), large).unwrap();
    let said = told(home.path());
    assert!(
        said.contains("view `hori`: `bins` make 67108864 cells in all views up to this one; expected at most 16777216"),
        "{said}"
    );
}
