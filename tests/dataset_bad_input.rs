//! Every bad input gives one clear error that names the file, the key and what was expected.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::dataset::{Dataset, DatasetError, Manifest, Progress};
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
        ("range_m = 0.05", "range_m = -0.05", "psf `range_m` is -0.05; expected 0 or more"),
        ("bins = 4", "bins = 4000000000", "its bins make more than"),
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
    named(case.arrays(&[("hm", ArrayView::text("x"))]), "array `hm` has dtype <U1; expected real numbers");
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
    // A folder in the file's place is refused by the same path, for every user.
    let place = folder.path().join("00001_radar.npz");
    std::fs::create_dir(&place).unwrap();
    let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
    let text = dataset.load(1).unwrap_err().to_string();
    assert!(text.contains("00001_radar.npz: cannot be read: it is a folder"), "{text}");
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
    let text = Dataset::open_with_manifest(&path, &manifest, &Progress::new()).unwrap_err().to_string();
    assert!(text.contains("no map `hm`; the file holds `unheard_of`"), "{text}");
}
