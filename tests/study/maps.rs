//! `export`: simulated maps come back in the input's own files, so that what read those reads these.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use half::f16;
use mhp_inspector::config::Preset;
use mhp_inspector::dataset::npz::{NpzArchive, read_array};
use mhp_inspector::dataset::{Dataset, read_pppr};
use mhp_inspector::mhp::{Precision, simulate};
use mhp_inspector::representation::{HeatmapScale, pppr_heatmap};
use mhp_inspector::start::{problem_alone, problem_of};
use mhp_inspector::task::Progress;
use std::collections::BTreeMap;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

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
    let problem = problem_alone(&dataset, &dataset.load(0).unwrap()).unwrap();
    simulate(&problem, &Preset::default().config(), Precision::default(), &read_pppr(params, None).unwrap())
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

/// Every file below a folder with its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.clone(), std::fs::read(&path).unwrap());
        }
    }
    found
}

/// The complex numbers of a cube of complex64.
fn cube(file: &Path) -> Vec<[f32; 2]> {
    let bytes = NpzArchive::open(file).unwrap().bytes("array").unwrap();
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    bytes.chunks_exact(8).map(|pair| [number(&pair[..4]), number(&pair[4..])]).collect()
}

#[test]
fn every_sample_is_exported_and_reads_back_as_a_data_set() {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    let folders = std::fs::read_dir(samples).unwrap().map(|entry| entry.unwrap().path());
    let mut folders: Vec<PathBuf> = folders.filter(|path| path.join("dataset.toml").is_file()).collect();
    folders.sort();
    assert_eq!(folders.len(), 10);
    for folder in folders {
        let out = tempfile::tempdir().unwrap();
        let words = ["--preset", "baseline", "--iterations", "1", "--what", "pppr,heatmap,pc", "--format", "npz"];
        exported(&folder, out.path(), &words);
        let [before, after] =
            [folder.clone(), out.path().join("heatmap")].map(|path| Dataset::open(&path, &Progress::new()).unwrap());
        assert_eq!(
            (before.len(), before.info().layout.word()),
            (after.len(), after.info().layout.word()),
            "{}",
            folder.display()
        );
        assert_eq!(before.info().views, after.info().views);
        let names = before.file_names();
        for index in 0..before.len() {
            let name = before.frame_name(index);
            assert_eq!(name, after.frame_name(index));
            let (old, new) = (before.load(index).unwrap(), after.load(index).unwrap());
            assert_eq!(
                (&old.truth, &old.image, old.person_count),
                (&new.truth, &new.image, new.person_count),
                "{name}"
            );
            assert_eq!((&old.notes, &old.map_boxes), (&new.notes, &new.map_boxes), "{name}");
            let file = |kind: &str| out.path().join(kind).join(format!("{}.npz", names.of(index, name)));
            let params = read_pppr(&file("pppr"), None).unwrap();
            assert!(file("pc").is_file());
            let problem = Arc::new(problem_of(&before, &old).unwrap());
            let config = Preset::Baseline.config();
            let wanted = pppr_heatmap(&problem, &config, Precision::F32, &params, HeatmapScale::Match).unwrap();
            for (map, wanted) in new.maps.iter().zip(&wanted) {
                let most = wanted.iter().copied().fold(0.0, f64::max);
                let tolerance = if map.dtype == "<f2" { 1e-3 } else { 1e-6 } * most;
                let worst = map.data.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(most > 0.0 && worst <= tolerance, "{name} {}: {worst} of {most}", map.dtype);
            }
        }
        if before.info().layout.word() == "hupr" {
            let inside = "single_1/hori/000000000.npy";
            let (old, new) = (cube(&folder.join(inside)), cube(&out.path().join("heatmap").join(inside)));
            assert_eq!(old.len(), new.len());
            for (row, (old, new)) in old.iter().zip(&new).enumerate().filter(|(k, _)| k % 8 == 3) {
                let ([a, b], [x, y]) = (old.map(f64::from), new.map(f64::from));
                if a.hypot(b) < 1e-30 || x.hypot(y) < 1e-30 {
                    continue; // Too small for single precision to have a phase.
                }
                let turned = (a * y - b * x).abs() / (a.hypot(b) * x.hypot(y));
                assert!(turned < 1e-4 && a * x + b * y > 0.0, "{row}: the phase is the input's");
            }
            let loudest = |row: &[[f32; 2]]| row.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f32::max);
            for row in new.chunks_exact(8) {
                assert!(loudest(row) <= row[3][0].hypot(row[3][1]) * 1.001, "no bin beyond the map's");
            }
        }
    }
}

#[test]
fn a_manifest_that_leaves_its_folder_makes_nothing_written_there() {
    let folder = tempfile::tempdir().unwrap();
    let (mine, theirs) = (folder.path().join("mine"), folder.path().join("theirs"));
    for at in [&mine, &theirs] {
        std::fs::create_dir_all(at).unwrap();
    }
    for index in 0..2 {
        blob::write_frame(&mine.join(format!("{index:03}.npz")), index, &|_, _| 0.0);
    }
    let absolute = format!("{}/*.npz", mine.display());
    for pattern in ["../mine/*.npz", "../theirs/../mine/*.npz", absolute.as_str()] {
        let manifest = blob::MANIFEST.replace("frames/*.npz", pattern);
        std::fs::write(theirs.join("dataset.toml"), manifest).unwrap();
        let before = (files(&mine), files(&theirs));
        for out in [&theirs, &mine, &mine.join("deep/er")] {
            let refused = export(&theirs, out, &["--iterations", "1", "--what", "heatmap", "--allow-outside"]);
            let told = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert_eq!(refused.status.code(), Some(2), "{pattern}: {told}");
            assert!(told.contains("lies in the data set") && told.contains("--into-data"), "{told}");
        }
        assert!((files(&mine), files(&theirs)) == before, "{pattern}: nothing was touched");
        let refused = export(&theirs, &folder.path().join("out"), &["--iterations", "1"]);
        let told = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{pattern}: {told}");
        assert!(told.contains("leads out of the data set's folder") && told.contains("--allow-outside"), "{told}");
        // Beside the two, where `../mine` from the heatmaps' folder would be a place of its own.
        let out = folder.path().join("out");
        std::fs::create_dir_all(out.join("mine")).unwrap();
        exported(&theirs, &out, &["--iterations", "1", "--what", "heatmap,pppr", "--allow-outside"]);
        assert!((files(&mine), files(&theirs)) == before, "{pattern}: nothing was touched");
        assert_eq!(files(&out.join("mine")).len(), 0);
        let copy = Dataset::open(&out.join("heatmap"), &Progress::new()).unwrap();
        assert_eq!(copy.len(), 2);
        assert!(copy.load(0).unwrap().maps[0].data != copy.load(1).unwrap().maps[0].data);
        std::fs::remove_dir_all(out).unwrap();
    }
}

#[test]
fn an_export_that_lacks_a_frame_has_no_manifest() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("frames")).unwrap();
    std::fs::write(folder.path().join("dataset.toml"), blob::MANIFEST).unwrap();
    let frame = |index: usize| folder.path().join(format!("frames/{index:03}.npz"));
    for index in 0..2 {
        blob::write_frame(&frame(index), index, &|_, _| 0.0);
    }
    let out = tempfile::tempdir().unwrap();
    let manifest = out.path().join("heatmap/dataset.toml");
    exported(folder.path(), out.path(), &["--iterations", "1", "--what", "heatmap"]);
    assert!(manifest.is_file());
    std::fs::write(frame(1), "no archive").unwrap();
    let output = export(folder.path(), out.path(), &["--iterations", "1", "--what", "heatmap"]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("heatmap is not complete: it has 1 of 2 frames and gets no dataset.toml"), "{told}");
    assert!(!manifest.exists(), "not even that of the export before");
}

#[test]
fn what_cannot_be_exported_is_refused_before_anything_is_made() {
    let stacks = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/xrf55-stack");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let refused = |words: &[&str], path: &Path, expected: &str| {
        let output = export(path, &out, words);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(expected), "{told}");
        assert!(!out.exists(), "{expected}: nothing was made");
    };
    refused(&["--frames", "0..5"], &stacks, "its files hold 17 frames each");
    let params = stacks.join("mmWave");
    refused(&["--params", params.to_str().unwrap()], &folder.path().join("none"), "none: no such file or folder");
}

#[test]
fn params_are_not_replaced_by_what_is_made_of_them() {
    let (folder, _) = one_frame([PLAIN, PLAIN], 1.0, zip::CompressionMethod::Stored);
    let out = tempfile::tempdir().unwrap();
    exported(folder.path(), out.path(), &["--iterations", "1", "--what", "pppr"]);
    let params = out.path().join("pppr");
    let before = files(&params);
    let again = export(folder.path(), out.path(), &["--params", params.to_str().unwrap()]);
    let told = String::from_utf8_lossy(&again.stderr).into_owned();
    assert_eq!(again.status.code(), Some(2), "{told}");
    assert!(told.contains("which is never replaced"), "{told}");
    assert!(files(&params) == before);
}

#[cfg(unix)]
#[test]
fn a_folder_of_results_that_is_a_link_elsewhere_is_refused() {
    let (folder, file) = one_frame([PLAIN, PLAIN], 1.0, zip::CompressionMethod::Stored);
    let (out, elsewhere) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let before = std::fs::read(&file).unwrap();
    for target in [folder.path(), elsewhere.path()] {
        let link = out.path().join("heatmap");
        std::os::unix::fs::symlink(target, &link).unwrap();
        let output = export(folder.path(), out.path(), &["--iterations", "1", "--what", "heatmap", "--into-data"]);
        assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::remove_file(link).unwrap();
    }
    // A link further down leads out too.
    std::fs::create_dir_all(out.path().join("heatmap")).unwrap();
    std::os::unix::fs::symlink(folder.path().join("frames"), out.path().join("heatmap/frames")).unwrap();
    let output = export(folder.path(), out.path(), &["--iterations", "1", "--what", "heatmap"]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("outside the folder of results"), "{told}");
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(std::fs::read(&file).unwrap() == before);
    assert_eq!(files(elsewhere.path()).len(), 0);
}

#[cfg(unix)]
#[test]
fn a_disk_that_is_full_is_one_message_and_leaves_no_half_file() {
    let (folder, _) = one_frame([PLAIN, PLAIN], 1.0, zip::CompressionMethod::Stored);
    let out = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_mhp-inspector");
    // Files of 2 KiB at most: neither parameters nor maps fit.
    let mut command = Command::new("bash");
    command.args(["-c", "ulimit -f 2; exec \"$@\"", "bash", program, "export"]).arg(folder.path());
    let output = command.args(["--iterations", "1", "--out"]).arg(out.path()).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "ended by itself: {told}");
    assert!(told.contains("File too large") && told.lines().count() == 1, "{told}");
    assert_eq!(files(out.path()).into_keys().collect::<Vec<_>>(), Vec::<PathBuf>::new());
}
