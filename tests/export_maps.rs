//! `export`: simulated maps come back in the input's own files, so that what read those reads these.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

#[path = "common/blob.rs"]
#[expect(dead_code, reason = "other tests use a whole data set of it")]
mod blob;

use half::f16;
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::npz::{NpzArchive, read_array};
use mhp_inspector::dataset::{Dataset, Progress, read_pppr};
use mhp_inspector::mhp::{Precision, Problem, simulate};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// How a map lies in a file.
#[derive(Clone, Copy, PartialEq)]
struct Form {
    descr: &'static str,
    fortran: bool,
}

const ROWS: usize = 48;
const COLUMNS: usize = 32;

/// An npy file as numpy writes it; `map` in C order.
fn npy(form: Form, shape: &str, map: &[f64]) -> Vec<u8> {
    let order = if form.fortran { "True" } else { "False" };
    let mut text = format!("{{'descr': '{}', 'fortran_order': {order}, 'shape': {shape}, }}", form.descr);
    text.extend(std::iter::repeat_n(' ', 63 - (10 + text.len()) % 64));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.bytes());
    let at = |k: usize| if form.fortran { map[(k % ROWS) * COLUMNS + k / ROWS] } else { map[k] };
    for k in 0..map.len() {
        match form.descr {
            "<f4" => bytes.extend((at(k) as f32).to_le_bytes()),
            ">f8" => bytes.extend(at(k).to_be_bytes()),
            "<f2" => bytes.extend(f16::from_f64(at(k)).to_le_bytes()),
            "<i2" => bytes.extend((at(k).round() as i16).to_le_bytes()),
            other => unreachable!("{other}"),
        }
    }
    bytes
}

fn zipped(path: &Path, members: &[(&str, Vec<u8>)], method: zip::CompressionMethod) {
    let mut archive = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, bytes) in members {
        let options = zip::write::FileOptions::default().compression_method(method);
        archive.start_file(*name, options).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap();
}

/// The bytes of a member, and how it is compressed.
fn member(path: &Path, name: &str) -> (Vec<u8>, zip::CompressionMethod) {
    let mut archive = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut entry = archive.by_name(name).unwrap();
    let mut bytes = Vec::new();
    entry.read_to_end(&mut bytes).unwrap();
    (bytes, entry.compression())
}

fn header(npy: &[u8]) -> &[u8] {
    &npy[..10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]))]
}

fn export(path: &Path, out: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    command.arg("export").arg(path).arg("--out").arg(out).args(words).env("MHP_INSPECTOR_HOME", out.join("home"));
    command.output().unwrap()
}

fn exported(path: &Path, out: &Path, words: &[&str]) {
    let output = export(path, out, words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The two maps of frame `index` of the blob data set, times `unit`.
fn maps(index: usize, unit: f64) -> [Vec<f64>; 2] {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.npz");
    blob::write_frame(&file, index, &|_, _| 0.0);
    ["hori", "vert"].map(|key| read_array(&file, key).unwrap().data.iter().map(|x| x * unit).collect())
}

/// A data set of one frame whose maps lie in these forms, beside an array that is no map.
fn one_frame(forms: [Form; 2], unit: f64, method: zip::CompressionMethod) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("frames")).unwrap();
    std::fs::write(folder.path().join("dataset.toml"), blob::MANIFEST).unwrap();
    let [hori, vert] = maps(0, unit);
    let file = folder.path().join("frames/000.npz");
    let members = [
        ("hori.npy", npy(forms[0], "(48, 32)", &hori)),
        ("extra.npy", npy(Form { descr: "<f4", fortran: false }, "(3,)", &[1.0, 2.0, 3.0])),
        ("vert.npy", npy(forms[1], "(48, 32)", &vert)),
    ];
    zipped(&file, &members, method);
    (folder, file)
}

/// What the forward model gives at the exported parameters.
fn simulated(folder: &Path, params: &Path) -> Vec<Vec<f64>> {
    let dataset = Dataset::open(folder, &Progress::new()).unwrap();
    let (info, frame) = (dataset.info(), dataset.load(0).unwrap());
    let maps: Vec<&[f64]> = frame.maps.iter().map(|map| map.data.as_slice()).collect();
    let problem = Problem::new(info.radar.clone(), info.skeleton.clone(), info.views.clone(), &maps).unwrap();
    simulate(&problem, &FitConfig::default(), Precision::default(), &read_pppr(params, None).unwrap())
}

const PLAIN: Form = Form { descr: "<f4", fortran: false };

#[test]
fn dtype_byte_order_memory_order_and_other_arrays_stay() {
    use zip::CompressionMethod::{Deflated, Stored};
    let turned = Form { descr: ">f8", fortran: true };
    let small = Form { descr: "<f2", fortran: false };
    let whole = Form { descr: "<i2", fortran: true };
    for (forms, method) in [([PLAIN, turned], Stored), ([small, whole], Deflated)] {
        let (folder, file) = one_frame(forms, 3000.0, method);
        let out = tempfile::tempdir().unwrap();
        exported(folder.path(), out.path(), &["--iterations", "2", "--scale", "none"]);
        let copy = out.path().join("heatmap/frames/000.npz");
        assert_eq!(member(&file, "extra.npy"), member(&copy, "extra.npy"));
        let wanted = simulated(folder.path(), &out.path().join("pppr/frames_000.npz"));
        for ((key, form), map) in ["hori", "vert"].into_iter().zip(forms).zip(&wanted) {
            let ((before, packed), (after, packed_after)) =
                (member(&file, &format!("{key}.npy")), member(&copy, &format!("{key}.npy")));
            assert_eq!((header(&before), packed), (header(&after), packed_after), "{key}");
            assert_eq!(before.len(), after.len());
            assert!(after == npy(form, "(48, 32)", map), "{key}: every cell in its place and byte order");
        }
        // What read the input reads this.
        let dataset = Dataset::open(&out.path().join("heatmap"), &Progress::new()).unwrap();
        assert_eq!(dataset.info().views, Dataset::open(folder.path(), &Progress::new()).unwrap().info().views);
        assert_eq!(dataset.load(0).unwrap().maps[0].shape, [ROWS, COLUMNS]);
    }
}

#[test]
fn a_matched_map_is_in_the_inputs_scale_and_lies_where_the_person_is() {
    let (folder, file) = one_frame([PLAIN, PLAIN], 3e6, zip::CompressionMethod::Stored);
    let out = tempfile::tempdir().unwrap();
    exported(folder.path(), out.path(), &["--iterations", "20"]);
    let copy = out.path().join("heatmap/frames/000.npz");
    for key in ["hori", "vert"] {
        let (input, output) = (read_array(&file, key).unwrap().data, read_array(&copy, key).unwrap().data);
        let brightest = |map: &[f64]| (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
        let least = |map: &[f64]| map.iter().copied().fold(f64::INFINITY, f64::min);
        let top = |map: &[f64]| {
            let mut sorted = map.to_vec();
            sorted.sort_by(f64::total_cmp);
            sorted[sorted.len() - 60..].iter().sum::<f64>() / 60.0
        };
        assert!((0.3..3.0).contains(&(top(&output) / top(&input))), "{key}: {} {}", top(&output), top(&input));
        assert_eq!(least(&output), least(&input), "{key}: the floor is the input's");
        let (a, b) = (brightest(&input), brightest(&output));
        assert!((a / COLUMNS).abs_diff(b / COLUMNS) <= 6, "{key}: rows {} and {}", a / COLUMNS, b / COLUMNS);
    }
}

#[test]
fn fitted_parameters_are_taken_as_they_are() {
    let (folder, _) = one_frame([PLAIN, PLAIN], 1.0, zip::CompressionMethod::Stored);
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    exported(folder.path(), first.path(), &["--iterations", "3"]);
    let params = first.path().join("pppr");
    exported(folder.path(), second.path(), &["--params", params.to_str().unwrap()]);
    for file in ["pppr/frames_000.npz", "heatmap/frames/000.npz"] {
        assert!(
            std::fs::read(first.path().join(file)).unwrap() == std::fs::read(second.path().join(file)).unwrap(),
            "{file}"
        );
    }
    let nothing = export(folder.path(), second.path(), &["--params", "/nonexistent"]);
    assert_eq!(nothing.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&nothing.stderr).contains("/nonexistent/frames_000.npz"));
}

#[test]
fn mmvr_keeps_its_tree_and_its_labels() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("heatmap");
    let home = root.join("d1s1/000");
    std::fs::create_dir_all(&home).unwrap();
    let manifest = blob::MANIFEST
        .replace("layout = \"npz\"\nframes = \"frames/*.npz\"", "layout = \"mmvr\"")
        .replace("\"hori\"", "\"hm_hori\"")
        .replace("\"vert\"", "\"hm_vert\"");
    std::fs::write(root.join("dataset.toml"), manifest).unwrap();
    let [hori, vert] = maps(0, 1e8);
    let members = [("hm_hori.npy", npy(PLAIN, "(48, 32)", &hori)), ("hm_vert.npy", npy(PLAIN, "(48, 32)", &vert))];
    zipped(&home.join("00007_radar.npz"), &members, zip::CompressionMethod::Deflated);
    std::fs::write(home.join("00007_pose.npz"), b"labels").unwrap();
    std::fs::write(home.join("00008_pose.npz"), b"of another frame").unwrap();
    let out = tempfile::tempdir().unwrap();
    exported(&root, out.path(), &["--iterations", "2", "--what", "heatmap"]);
    let copy = out.path().join("heatmap/d1s1/000");
    assert_eq!(std::fs::read(copy.join("00007_pose.npz")).unwrap(), b"labels");
    assert!(!copy.join("00008_pose.npz").exists() && !out.path().join("pppr").exists());
    let entries = NpzArchive::open(&copy.join("00007_radar.npz")).unwrap().entries().unwrap();
    let told: Vec<_> = entries.iter().map(|e| (e.key.as_str(), e.dtype.as_str(), e.shape.as_slice())).collect();
    assert_eq!(told, [("hm_hori", "<f4", &[48, 32][..]), ("hm_vert", "<f4", &[48, 32][..])]);
    let into_itself = export(&root, folder.path(), &["--iterations", "1"]);
    assert_eq!(into_itself.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&into_itself.stderr).contains("is the data set itself"));
}

#[test]
fn a_stacked_file_holds_the_chosen_frames() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = blob::MANIFEST.split("[[view]]\narray = \"vert\"").next().unwrap().replace("\"hori\"", "\"array\"");
    let file = folder.path().join("axes.toml");
    std::fs::write(&file, manifest).unwrap();
    let stack: Vec<f64> = (0..3).flat_map(|index| maps(index, 1e3)[0].clone()).collect();
    let stacked = folder.path().join("maps.npy");
    std::fs::write(&stacked, npy(Form { descr: ">f8", fortran: false }, "(3, 48, 32)", &stack)).unwrap();
    let out = tempfile::tempdir().unwrap();
    let words = ["--iterations", "2", "--frames", "1..3", "--manifest", file.to_str().unwrap()];
    exported(&stacked, out.path(), &words);
    let copy = read_array(&out.path().join("heatmap/maps.npy"), "array").unwrap();
    assert_eq!((copy.shape, copy.dtype.as_str()), (vec![2, 48, 32], ">f8"));
    assert!(out.path().join("heatmap/dataset.toml").is_file(), "the manifest that says what it is");
    assert!(copy.data[..1536].iter().zip(&copy.data[1536..]).any(|(a, b)| a != b), "the frames differ");
}
