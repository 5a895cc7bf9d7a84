//! Every bad input gives one clear error that names the file, the key and what was expected.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::dataset::{Dataset, DatasetError, Manifest, OpenOptions};
use mhp_inspector::task::Progress;
use std::path::Path;

const MANIFEST: &str = r#"name = "case"
layout = "npz"
frames = "frames/*.npz"
frame_rate_hz = 10.0
skeleton = "coco17"

[radar]
start_hz = 77e9
bandwidth_hz = 2.5e9
chirp_s = 60e-6
frame_s = 0.0128
r_max_m = 12.0
l_az_m = 0.0019
l_el_m = 0.0019

[[view]]
array = "hm"
psf = { range_m = 0.05, azimuth_rad = 0.05, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [
  { kind = "range", bins = 4, lo = 0.0, hi = 12.0 },
  { kind = "azimuth", bins = 3, lo = 0.96, hi = -1.04, spacing = "sine" },
]
"#;

fn parse(text: &str) -> Result<Manifest, DatasetError> {
    Manifest::parse(text, Path::new("some/dataset.toml"))
}

fn refusal(from: &str, to: &str) -> String {
    assert!(MANIFEST.contains(from), "{from}");
    match parse(&MANIFEST.replacen(from, to, 1)) {
        Ok(_) => panic!("accepted: {to}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_typo_in_a_manifest_names_file_line_and_key() {
    assert!(parse(MANIFEST).is_ok());
    let text = refusal("bandwidth_hz", "bandwith_hz");
    let wanted = "some/dataset.toml:9: unknown key `bandwith_hz`; expected one of `start_hz`, `bandwidth_hz`";
    assert!(text.starts_with(wanted), "{text}");
    let text = refusal("name =", "nam =");
    assert!(text.starts_with("some/dataset.toml:1: unknown key `nam`; expected one of `name`, `layout`"), "{text}");
    assert!(refusal("range_m =", "range =").starts_with("some/dataset.toml:18: unknown key `range`; expected one of"));
    assert!(refusal("bins = 3", "bin = 3").starts_with("some/dataset.toml:21: unknown key `bin`; expected one of"));
    assert!(refusal("\"sine\"", "\"sin\"").starts_with("some/dataset.toml:21: unknown variant `sin`, expected"));
    assert!(refusal("\"range\"", "\"rnage\"").contains(":20: unknown variant `rnage`, expected one of"));
    assert!(
        refusal("\"coco17\"", "\"coco18\"")
            .starts_with("some/dataset.toml:5: unknown skeleton \"coco18\"; expected one of coco17")
    );
    let table = "{ joints = [\"a\"], bones = [], bone_length_m = [], angles = [] }";
    assert!(
        refusal("\"coco17\"", table).starts_with("some/dataset.toml:5: unknown key `bone_length_m`; expected one of")
    );
    assert!(refusal("chirp_s = 60e-6\n", "").contains("missing key `chirp_s`"));
    assert!(refusal("layout = \"npz\"\n", "").contains("missing key `layout`"));
    assert!(refusal("skeleton = \"coco17\"\n", "").contains("missing key `skeleton`"));
    assert!(refusal("\"npz\"", "\"hdf5\"").starts_with("some/dataset.toml:2: unknown variant `hdf5`"));
    assert!(refusal("\"npz\"", "\"npz").starts_with("some/dataset.toml:2: "));
    assert!(refusal("bins = 4", "bins = -4").contains(":20: "));
    assert!(refusal("bins = 4", "bins = \"4\"").contains(":20: "));
}

#[test]
fn values_that_make_no_sense_name_view_axis_and_expectation() {
    let cases = [
        ("bins = 4", "bins = 0", "view `hm`: axis 0 (range): `bins` is 0; expected 1 or more"),
        ("hi = 12.0", "hi = 0.0", "`lo` and `hi` are both 0"),
        ("hi = 12.0", "hi = nan", "must be finite"),
        ("hi = 12.0", "hi = inf", "must be finite"),
        ("lo = 0.96, hi = -1.04, spacing = \"sine\"", "lo = -60, hi = 60", "they look like degrees"),
        ("lo = 0.96", "lo = 60.0", "are sines on a sine axis"),
        ("hi = 12.0 }", "hi = 12.0, spacing = \"sine\" }", "spacing \"sine\" is for azimuth, elevation and cone"),
        ("range_m = 0.05", "range_m = -0.05", "psf `range_m` is -0.05; expected 0 to 100"),
        ("bins = 4", "bins = 100000000", "make 100000000 bins 1.2e-7 apart; expected a step of 1.2e-5 or more"),
        ("  { kind = \"range\", bins = 4, lo = 0.0, hi = 12.0 },\n", "", "1 axes; expected 2 or 3"),
        ("axes = [", "region = [[0, 4]]\naxes = [", "`region` has 1 intervals; expected one for each of 2 axes"),
        ("axes = [", "region = [[0, 4], [1, 9]]\naxes = [", "expected 0 ≤ lo < hi ≤ 3"),
        ("axes = [", "region = [[2, 2], [0, 3]]\naxes = [", "`region` [2, 2] on 4 bins"),
        ("axes = [", "translation = [0, 0, inf]\naxes = [", "must be finite numbers"),
        ("axes = [", "rotation = [[1, 0], [0, 1]]\naxes = [", ":19: "),
        ("bandwidth_hz = 2.5e9", "bandwidth_hz = 0", "[radar]: `bandwidth_hz` is 0; expected a number above 0"),
        ("l_el_m = 0.0019", "l_el_m = 0.0019\ndoppler_features = 0", "`doppler_features` is 0"),
        ("frame_rate_hz = 10.0", "frame_rate_hz = -1", "some/dataset.toml:4: `frame_rate_hz` is -1"),
        ("array = \"hm\"", "array = \"\"", "`array` is empty"),
        (
            "\"coco17\"",
            "{ joints = [\"a\", \"b\"], bones = [[0, 2]], bone_lengths_m = [1], angles = [] }",
            "bone [0, 2]",
        ),
        (
            "\"coco17\"",
            "{ joints = [\"a\", \"b\"], bones = [[0, 1]], bone_lengths_m = [], angles = [] }",
            "one length a bone",
        ),
        ("\"coco17\"", "{ joints = [\"a\", \"b\"], bones = [[0, 1]], bone_lengths_m = [0], angles = [] }", "above 0"),
        ("\"coco17\"", "{ joints = [\"a\", \"a\"], bones = [], bone_lengths_m = [], angles = [] }", "listed twice"),
        (
            "\"coco17\"",
            "{ joints = [\"a\", \"b\"], bones = [], bone_lengths_m = [], angles = [[0, 1, 5]] }",
            "angle [0, 1, 5]",
        ),
        ("frames/*.npz", "", "`frames` is empty"),
        (
            "lo = 0.0, hi = 12.0",
            "lo = 1e308, hi = 12.0",
            ":20: view `hm`: axis 0 (range): `lo` 1e308 and `hi` 1.2e1 are in m",
        ),
        (
            "hi = 12.0",
            "hi = 1e308",
            ":20: view `hm`: axis 0 (range): `lo` 0e0 and `hi` 1e308 are in m; expected −1000 to 1000",
        ),
        ("hi = 12.0", "hi = 1e9", "as far as a radar sees"),
        ("hi = 12.0", "hi = 1e-308", "bins 2.5e-309 apart; expected a step of 1.0e-6 or more"),
        ("lo = 0.0, hi = 12.0", "lo = 500.0, hi = 500.0001", "expected a step of 5.0e-4 or more"),
        ("hi = -1.04", "hi = 0.9600000001", ":21: view `hm`: axis 1 (azimuth): `lo` 9.6e-1"),
        ("range_m = 0.05", "range_m = 1e308", "psf `range_m` is 1"),
        ("azimuth_rad = 0.05", "azimuth_rad = 1e9", "psf `azimuth_rad` is 1000000000; expected 0 to 6.2832"),
        ("axes = [", "translation = [0, 1e9, 0]\naxes = [", "m; expected at most 1000 each way"),
        ("axes = [", "rotation = [[1, 0, 0], [0, 2, 0], [0, 0, 1]]\naxes = [", "`rotation` is no rotation"),
        ("start_hz = 77e9", "start_hz = 1e300", "[radar]: `start_hz` is 1e300; expected 1e6 to 1e13"),
        ("chirp_s = 60e-6", "chirp_s = 1e-300", "[radar]: `chirp_s` is 1e-300; expected 1e-12 to 1e3"),
        ("r_max_m = 12.0", "r_max_m = 1e308", "[radar]: `r_max_m` is 1e308"),
        ("frame_rate_hz = 10.0", "frame_rate_hz = 1e300", "some/dataset.toml:4: `frame_rate_hz` is 1e300"),
    ];
    for (from, to, wanted) in cases {
        let text = refusal(from, to);
        assert!(text.contains(wanted) && text.starts_with("some/dataset.toml:"), "{to}: {text}");
    }
    let view = &MANIFEST[MANIFEST.find("[[view]]").unwrap()..];
    let twice = parse(&format!("{MANIFEST}\n{view}")).unwrap_err().to_string();
    assert!(twice.contains("view `hm` is described twice"), "{twice}");
    assert!(twice.starts_with("some/dataset.toml:24: "), "the second one's line: {twice}");
}

#[test]
fn sizes_are_bounded_before_anything_is_allocated() {
    let views: String =
        (0..17).map(|k| MANIFEST[MANIFEST.find("[[view]]").unwrap()..].replace("hm", &format!("v{k}"))).collect();
    let head = &MANIFEST[..MANIFEST.find("[[view]]").unwrap()];
    let text = parse(&format!("{head}{views}")).unwrap_err().to_string();
    assert!(text.contains("more than 16 views"), "{text}");
    let two = "[[view]]\narray = \"b\"\npsf = { range_m = 0.1, azimuth_rad = 0, elevation_rad = 0, doppler_mps = 0 }\naxes = [ \
               { kind = \"x\", bins = 4000, lo = 0, hi = 8 }, { kind = \"y\", bins = 4200, lo = -4, hi = 4 } ]\n";
    let text = parse(&format!("{MANIFEST}{two}")).unwrap_err().to_string();
    assert!(text.starts_with("some/dataset.toml:23: view `b`: `bins` make 16800012 cells in all views"), "{text}");
    let joints = (0..300).map(|k| format!("\"j{k}\"")).collect::<Vec<_>>().join(", ");
    let table = format!("{{ joints = [{joints}], bones = [], bone_lengths_m = [], angles = [] }}");
    assert!(refusal("\"coco17\"", &table).contains("`joints` has 300 entries; expected at most 256"));
    let long = format!("{{ joints = [\"{}\"], bones = [], bone_lengths_m = [], angles = [] }}", "é".repeat(99));
    assert!(refusal("\"coco17\"", &long).contains("has a name of 198 bytes; expected at most 100"));
}

#[test]
fn a_manifest_names_no_frames_outside_its_folder_unless_allowed() {
    let case = Case::new();
    assert_eq!(case.arrays(&[("hm", ArrayView::f64(&[4, 3], &[1.0; 12]))]), "no error");
    let inner = case.folder.path().join("set");
    std::fs::create_dir(&inner).unwrap();
    let whole = case.folder.path().join("frames/*.npz").display().to_string();
    for frames in ["../frames/*.npz", "x/../../frames/*.npz", "./../frames/000000.npz", whole.as_str()] {
        std::fs::create_dir_all(inner.join("x")).unwrap();
        std::fs::write(inner.join("dataset.toml"), MANIFEST.replace("frames/*.npz", frames)).unwrap();
        let refused = Dataset::open(&inner, &Progress::new()).unwrap_err().to_string();
        let wanted = format!(
            "dataset.toml:3: `frames = \"{frames}\"` leads out of the data set's folder; expected files inside it (--allow-outside"
        );
        assert!(refused.contains(&wanted), "{refused}");
        let options = OpenOptions { allow_outside: true, ..OpenOptions::default() };
        let allowed = Dataset::open_with(&inner, options, &Progress::new()).unwrap();
        assert_eq!(allowed.load(0).unwrap().maps[0].data, [1.0; 12]);
    }
    std::fs::write(inner.join("dataset.toml"), MANIFEST.replace("frames/*.npz", "./x/..a*.npz")).unwrap();
    let inside = Dataset::open(&inner, &Progress::new()).unwrap_err().to_string();
    assert!(inside.contains("no frames in it"), "two dots in a name are a name: {inside}");
}

/// A named pipe, by the system's own command.
#[cfg(unix)]
fn pipe(path: &Path) {
    assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// Nobody writes into these pipes: whoever opens one waits for ever.
#[cfg(unix)]
#[test]
fn a_named_pipe_is_refused_and_never_waited_for() {
    let home = tempfile::tempdir().unwrap();
    let [bare, manifest] = ["maps.npz", "other.toml"].map(|name| home.path().join(name));
    pipe(&bare);
    pipe(&manifest);
    let refused = |path: &Path| Dataset::open(path, &Progress::new()).unwrap_err().to_string();
    assert!(refused(&bare).ends_with("maps.npz: cannot be read: it is a named pipe; expected an npz or npy file"));
    assert!(refused(&manifest).ends_with("it is a named pipe; expected a manifest (TOML)"), "{}", refused(&manifest));
    let folder = home.path().join("set");
    std::fs::create_dir(&folder).unwrap();
    pipe(&folder.join("dataset.toml"));
    assert!(refused(&folder).ends_with("dataset.toml: cannot be read: it is a named pipe; expected a manifest (TOML)"));
    // Among frames it is left out, and told.
    let tree = home.path().join("d1s1");
    std::fs::create_dir(&tree).unwrap();
    pipe(&tree.join("00001_radar.npz"));
    assert!(refused(&tree).contains("00001_radar.npz: it is no regular file"), "{}", refused(&tree));
    pipe(&tree.join("00002_bbox.npz"));
    write(&tree.join("00002_radar.npz"), &[("x", ArrayView::f64(&[1], &[0.0]))]).unwrap();
    let open = Dataset::open(&tree, &Progress::new()).unwrap();
    assert_eq!((open.len(), open.info().notes.len()), (1, 1), "{:?}", open.info().notes);
    let case = Case::new();
    assert_eq!(case.arrays(&[("hm", ArrayView::f64(&[4, 3], &[1.0; 12]))]), "no error");
    pipe(&case.folder.path().join("frames/000001.npz"));
    assert_eq!(case.dataset().len(), 1);
    // A link to one is no better.
    std::os::unix::fs::symlink(&bare, case.folder.path().join("frames/000002.npz")).unwrap();
    assert_eq!(case.dataset().len(), 1);
    std::fs::write(case.folder.path().join("dataset.toml"), MANIFEST.replace("*.npz", "000001.npz")).unwrap();
    let text = case.dataset().load(0).unwrap_err().to_string();
    assert!(text.ends_with("it is a named pipe; expected an npz or npy file"), "{text}");
}

#[cfg(unix)]
#[test]
fn links_are_followed_once_and_a_tree_that_links_to_itself_has_each_frame_once() {
    use std::os::unix::fs::symlink;
    let home = tempfile::tempdir().unwrap();
    let tree = home.path().join("tree");
    for folder in ["d1s1/000", "d1s1/001", "d2s1/000"] {
        std::fs::create_dir_all(tree.join(folder)).unwrap();
        write(&tree.join(folder).join("00000_radar.npz"), &[("x", ArrayView::f64(&[1], &[0.0]))]).unwrap();
    }
    let names = |dataset: &Dataset| (0..dataset.len()).map(|i| dataset.frame_name(i).to_owned()).collect::<Vec<_>>();
    let plain = Dataset::open(&tree, &Progress::new()).unwrap();
    assert_eq!((plain.len(), plain.info().notes.len()), (3, 0));
    symlink(&tree, tree.join("d1s1/loop")).unwrap();
    symlink(tree.join("d1s1"), tree.join("d2s1/again")).unwrap();
    symlink("..", tree.join("d2s1/up")).unwrap();
    symlink(tree.join("d2s1/000"), tree.join("another")).unwrap();
    let linked = Dataset::open(&tree, &Progress::new()).unwrap();
    assert_eq!(names(&linked), names(&plain));
    assert!(
        linked.info().notes[0].starts_with("4 links lead to folders that were already listed: "),
        "{:?}",
        linked.info().notes
    );
    // A link to what lies elsewhere is followed, and twice is once.
    let elsewhere = home.path().join("d3s1");
    std::fs::create_dir(&elsewhere).unwrap();
    write(&elsewhere.join("00007_radar.npz"), &[("x", ArrayView::f64(&[1], &[0.0]))]).unwrap();
    symlink(&elsewhere, tree.join("d3s1")).unwrap();
    symlink(&elsewhere, tree.join("e")).unwrap();
    symlink(&elsewhere, elsewhere.join("self")).unwrap();
    let linked = Dataset::open(&tree, &Progress::new()).unwrap();
    assert_eq!(linked.len(), 4);
    assert_eq!(linked.frame_name(3), "d3s1/00007");
    // What is behind a link and above the tree does not come in again through it.
    symlink(home.path(), tree.join("d2s1/above")).unwrap();
    assert_eq!(Dataset::open(&tree, &Progress::new()).unwrap().len(), 4);
}

#[test]
fn damage_in_a_stacked_file_is_told_for_every_frame_of_it() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("stack.npz");
    let manifest = parse(MANIFEST).unwrap();
    let cells: Vec<f64> = (0..5 * 12).map(f64::from).collect();
    write(&path, &[("hm", ArrayView::f64(&[5, 4, 3], &cells))]).unwrap();
    let options = OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() };
    let open = || Dataset::open_with(&path, options, &Progress::new()).unwrap();
    assert_eq!(open().load(1).unwrap().maps[0].data, cells[12..24]);
    let mut bytes = std::fs::read(&path).unwrap();
    let last: Vec<u8> = cells.last().unwrap().to_le_bytes().to_vec();
    let at = bytes.windows(8).rposition(|window| window == last).unwrap();
    bytes[at] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let dataset = open();
    for frame in [0, 1, 4, 0] {
        let text = dataset.load(frame).unwrap_err().to_string();
        assert!(text.ends_with("stack.npz: array `hm` is damaged: Invalid checksum"), "{text}");
        assert!(dataset.recent_maps(frame).is_err() && dataset.maps(frame..frame + 1).all(|maps| maps.is_err()));
    }
}

/// A data set of one frame whose bytes are given.
struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("frames")).unwrap();
        std::fs::write(folder.path().join("dataset.toml"), MANIFEST).unwrap();
        Self { folder }
    }

    fn frame(&self) -> std::path::PathBuf {
        self.folder.path().join("frames/000000.npz")
    }

    fn dataset(&self) -> Dataset {
        Dataset::open(self.folder.path(), &Progress::new()).unwrap()
    }

    fn arrays(&self, arrays: &[(&str, ArrayView<'_>)]) -> String {
        write(&self.frame(), arrays).unwrap();
        self.error()
    }

    fn bytes(&self, bytes: &[u8]) -> String {
        std::fs::write(self.frame(), bytes).unwrap();
        self.error()
    }

    /// The one message of opening and loading.
    fn error(&self) -> String {
        let loaded = Dataset::open(self.folder.path(), &Progress::new()).and_then(|dataset| dataset.load(0));
        match loaded {
            Ok(_) => "no error".into(),
            Err(error) => {
                assert!(std::error::Error::source(&error).is_none(), "{{:#}} would say it twice");
                error.to_string()
            }
        }
    }
}

#[test]
fn a_frame_that_is_not_what_it_should_be_names_file_key_and_expectation() {
    let case = Case::new();
    let map = [1.0; 12];
    let good = [("hm", ArrayView::f64(&[4, 3], &map))];
    assert_eq!(case.arrays(&good), "no error");
    let named = |text: String, wanted: &str| {
        assert!(text.contains("000000.npz: ") && text.contains(wanted), "{wanted}: {text}");
    };
    let whole = std::fs::read(case.frame()).unwrap();
    named(case.bytes(&whole[..whole.len() / 2]), "truncated or damaged npz archive");
    named(case.bytes(b""), "is empty (0 bytes); expected an npz or npy file");
    named(case.bytes(b"joint,x,y\nnose,1,2\n"), "is neither npz nor npy; it begins with \"joint,x,y\\nnose,1,2\\n\"");
    named(
        case.arrays(&[("hm", ArrayView::f64(&[3, 4], &map))]),
        "array `hm` has shape (3, 4); expected (4, 3), the bins",
    );
    named(case.arrays(&[("heatmap", good[0].1.clone())]), "no array `hm`; the file holds heatmap");
    named(case.arrays(&[]), "no array `hm`; the file holds no arrays");
    named(case.arrays(&[("hm", ArrayView::text("x"))]), "array `hm` has shape (); expected (4, 3)");
    let complex = [num_complex::Complex::new(1.0, 0.0); 12];
    named(
        case.arrays(&[("hm", ArrayView::complex128(&[4, 3], &complex))]),
        "array `hm` has dtype <c16; expected real numbers",
    );
    let with = |key, array| [("hm", ArrayView::f64(&[4, 3], &map)), (key, array)];
    named(
        case.arrays(&with("joints", ArrayView::f64(&[4, 3], &map))),
        "array `joints` has shape (4, 3); expected (persons, 17, 3)",
    );
    let persons = [0.0; 51 * 2];
    let two = ArrayView::f64(&[2, 17, 3], &persons);
    let mut three = with("joints", ArrayView::f64(&[1, 17, 3], &persons[..51])).to_vec();
    three.push(("velocities", two));
    named(case.arrays(&three), "array `velocities` has shape (2, 17, 3); expected (1, 17, 3)");
    named(
        case.arrays(&with("timestamp_s", ArrayView::f64(&[12], &map))),
        "array `timestamp_s` has shape (12,); expected one number",
    );
    let numpy = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/numpy.npz")).unwrap();
    named(case.bytes(&numpy), "no array `hm`; the file holds");
    assert_eq!(case.arrays(&with("person_count", ArrayView::f64(&[], &[1.5]))), "no error");
}

#[test]
fn a_file_deleted_while_open_is_an_error_of_that_frame_only() {
    let case = Case::new();
    let map = [1.0; 12];
    for name in ["000000", "000001"] {
        write(&case.folder.path().join(format!("frames/{name}.npz")), &[("hm", ArrayView::f64(&[4, 3], &map))])
            .unwrap();
    }
    let dataset = Dataset::open(case.folder.path(), &Progress::new()).unwrap();
    std::fs::remove_file(case.frame()).unwrap();
    let text = dataset.load(0).unwrap_err().to_string();
    assert!(text.contains("frames/000000.npz: cannot be read: No such file"), "{text}");
    assert!(dataset.load(1).is_ok());
}

#[test]
fn folders_without_frames_and_paths_that_are_not_there_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let open = |path: &Path| Dataset::open(path, &Progress::new()).unwrap_err().to_string();
    let empty = open(folder.path());
    assert!(empty.contains("no frames in it; expected dataset.toml, or MMVR's NNNNN_radar.npz"), "{empty}");
    assert!(open(&folder.path().join("nothing")).ends_with("nothing: no such file or folder"));
    std::fs::write(folder.path().join("dataset.toml"), MANIFEST).unwrap();
    std::fs::create_dir(folder.path().join("frames")).unwrap();
    assert!(open(folder.path()).contains("no frames in it; expected files that match `frames = \"frames/*.npz\"`"));
    std::fs::write(folder.path().join("dataset.toml"), MANIFEST.replace("frames = \"frames/*.npz\"\n", "")).unwrap();
    assert!(open(folder.path()).contains("missing key `frames`"));
    for layout in ["hupr", "xrf55"] {
        std::fs::write(folder.path().join("dataset.toml"), MANIFEST.replace("\"npz\"", &format!("\"{layout}\"")))
            .unwrap();
        let told = open(folder.path());
        let wanted = if layout == "hupr" { "HuPR's single_<k>/hori/" } else { "XRF55's XX_YY_ZZ.npy" };
        assert!(told.contains("no frames in it") && told.contains(wanted), "{told}");
    }
}

#[cfg(unix)]
#[test]
fn what_cannot_be_opened_says_why() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("00000_radar.npz");
    std::fs::write(&secret, b"PK").unwrap();
    std::fs::set_permissions(&secret, std::fs::Permissions::from_mode(0o000)).unwrap();
    if std::fs::File::open(&secret).is_ok() {
        println!("skipped in part: this user reads files without permission (root)");
    } else {
        let dataset = Dataset::open(&secret, &Progress::new()).unwrap();
        let text = dataset.load(0).unwrap_err().to_string();
        assert!(text.contains("00000_radar.npz: cannot be read: Permission denied"), "{text}");
    }
    // A folder in the file's place is left out and told, for every user.
    let place = folder.path().join("00001_radar.npz");
    std::fs::create_dir(&place).unwrap();
    let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
    assert_eq!(dataset.len(), 1);
    let wanted = format!("skipped: {}: it is no regular file", place.display());
    assert_eq!(dataset.info().notes, [wanted]);
}

#[test]
fn the_grouped_variant_of_mmvr_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("00000_radar.npz");
    let map = vec![1.0_f32; 4 * 256 * 128];
    let grouped = ArrayView::f32(&[4, 256, 128], &map);
    write(&path, &[("hm_hori", grouped.clone()), ("hm_vert", grouped)]).unwrap();
    let text = Dataset::open(&path, &Progress::new()).unwrap().load(0).unwrap_err().to_string();
    assert!(text.contains("`hm_hori` has shape (4, 256, 128)") && text.contains("grouped variant"), "{text}");
}

#[test]
fn bare_files_without_maps_or_axes_say_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    write(&path, &[("x", ArrayView::f64(&[3], &[0.0; 3])), ("id", ArrayView::text("7"))]).unwrap();
    let text = Dataset::open(&path, &Progress::new()).unwrap_err().to_string();
    assert!(text.contains("no array in it can be a map") && text.contains("`id` () <U1, `x` (3,) <f8"), "{text}");
    write(&path, &[("unheard_of", ArrayView::f64(&[1, 3], &[0.0; 3]))]).unwrap();
    let error = Dataset::open(&path, &Progress::new()).unwrap_err();
    assert!(matches!(&error, DatasetError::NeedsAxes(catalog) if catalog.arrays[0].shape == [1, 3]));
    let text = error.to_string();
    assert!(
        text.contains("the axes of `unheard_of` (1, 3) <f8 are not known") && text.contains("--manifest FILE"),
        "{text}"
    );
    let manifest = parse(MANIFEST).unwrap();
    let text = Dataset::open_with(
        &path,
        OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() },
        &Progress::new(),
    )
    .unwrap_err()
    .to_string();
    assert!(text.contains("no map `hm`; the file holds `unheard_of`"), "{text}");
}
