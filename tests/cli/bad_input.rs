//! Bad input given to the real program: one clear message, exit code 2, no panic, whichever subcommand reads it.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests fail by panicking")]

use mhp_inspector::body::{Pppr, PpprShape};
use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::dataset::{Dataset, write_pppr};
use mhp_inspector::task::Progress;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

const MANIFEST: &str = r#"name = "case"
layout = "npz"
frames = "frames/*.npz"
skeleton = "coco17"

[radar]
start_hz = 77e9
bandwidth_hz = 2.5e9
chirp_s = 60e-6
frame_s = 0.0128
r_max_m = 12.0
l_az_m = 0.0019
l_el_m = 0.0019
doppler_features = 4

[[view]]
array = "hm"
psf = { range_m = 0.05, azimuth_rad = 0.05, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [ { kind = "range", bins = 16, lo = 0.5, hi = 6.0 }, { kind = "azimuth", bins = 8, lo = 0.96, hi = -1.04 } ]
"#;

/// A data set of one frame, parameters that fit it, and a place for the answers.
struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let case = Self { folder };
        std::fs::create_dir_all(case.path("data/frames")).unwrap();
        std::fs::write(case.path("data/dataset.toml"), MANIFEST).unwrap();
        let params = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features: 4 });
        write_pppr(&case.path("params.npz"), &params).unwrap();
        case.arrays(&[("hm", ArrayView::f64(&[16, 8], &ramp()))]);
        case
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn frame(&self) -> PathBuf {
        self.path("data/frames/000.npz")
    }

    fn arrays(&self, arrays: &[(&str, ArrayView<'_>)]) {
        write(&self.frame(), arrays).unwrap();
    }

    /// An npz with one array of this header and data, whatever they say.
    fn raw_array(&self, key: &str, header: &str, data: &[u8]) {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        let mut archive = zip::ZipWriter::new(std::fs::File::create(self.frame()).unwrap());
        archive.start_file(format!("{key}.npy"), zip::write::FileOptions::default()).unwrap();
        archive.write_all(&bytes).unwrap();
        archive.finish().unwrap();
    }

    /// Runs `fit`, `info` and `score` on `path` and gives what each says; each must end with code 2 and one line.
    fn refusals(&self, path: &Path) -> Vec<String> {
        let fit = self.refusal(Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).arg("fit").arg(path));
        let info = self.refusal(Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).arg("info").arg(path));
        vec![fit, info, self.score(path)]
    }

    fn score(&self, path: &Path) -> String {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.args(["score", "--frame", "0"]).arg("--dataset").arg(path);
        command.arg("--params").arg(self.path("params.npz")).arg("--out").arg(self.path("answer.npz"));
        self.refusal(&mut command)
    }

    fn refusal(&self, command: &mut Command) -> String {
        let began = Instant::now();
        let output = command.env("MHP_INSPECTOR_HOME", self.folder.path()).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        let code = output.status.code().expect("ended by itself, not by a signal from outside");
        assert_eq!(code, 2, "{command:?}: {stderr}");
        assert!(began.elapsed() < Duration::from_secs(20), "{command:?} took {:?}", began.elapsed());
        assert_eq!(stderr.lines().count(), 1, "one message: {stderr}");
        assert!(output.stdout.is_empty(), "nothing but the message");
        let message = stderr.strip_prefix("error: ").expect("begins with `error: `");
        assert!(!message.contains("panicked") && !message.contains("internal error"), "{message}");
        message.trim_end().to_owned()
    }

    /// All three subcommands name the frame's file and say `wanted`.
    fn frame_is_refused(&self, wanted: &[&str]) {
        let file = self.frame().display().to_string();
        for message in self.refusals(&self.path("data")) {
            assert!(message.starts_with(&file), "names the file: {message}");
            for words in wanted {
                assert!(message.contains(words), "{words}: {message}");
            }
        }
    }
}

fn ramp() -> Vec<f64> {
    (0..128).map(|k| 1.0 + f64::from(k % 37)).collect()
}

#[test]
fn a_truncated_npz() {
    let case = Case::new();
    let whole = std::fs::read(case.frame()).unwrap();
    for keep in [whole.len() / 2, whole.len() - 10, 40, 5] {
        std::fs::write(case.frame(), &whole[..keep]).unwrap();
        case.frame_is_refused(&["truncated or damaged npz archive"]);
    }
}

#[test]
fn a_flipped_byte() {
    let case = Case::new();
    let mut bytes = std::fs::read(case.frame()).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    std::fs::write(case.frame(), &bytes).unwrap();
    case.frame_is_refused(&["array `hm` is damaged", "checksum"]);
}

#[test]
fn a_pickled_object_array() {
    let case = Case::new();
    case.raw_array("hm", "{'descr': '|O', 'fortran_order': False, 'shape': (16, 8), }\n", b"\x80\x04cos\nsystem\n.");
    case.frame_is_refused(&["array `hm` holds pickled Python objects, which are never loaded; expected numbers"]);
}

#[test]
fn a_wrong_shape() {
    let case = Case::new();
    case.arrays(&[("hm", ArrayView::f64(&[8, 16], &ramp()))]);
    case.frame_is_refused(&["array `hm` has shape (8, 16); expected (16, 8)"]);
}

#[test]
fn a_wrong_key() {
    let case = Case::new();
    case.arrays(&[("heatmap", ArrayView::f64(&[16, 8], &ramp()))]);
    case.frame_is_refused(&["no array `hm`; the file holds heatmap"]);
}

#[test]
fn a_map_without_a_number() {
    let case = Case::new();
    case.arrays(&[("hm", ArrayView::f64(&[16, 8], &[f64::NAN; 128]))]);
    let fit = case.refusal(Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).arg("fit").arg(case.path("data")));
    for message in [fit, case.score(&case.path("data"))] {
        let file = case.frame().display().to_string();
        assert!(message.starts_with(&file), "{message}");
        assert!(message.contains("array `hm` has no finite cell; expected at least one number"), "{message}");
    }
}

#[test]
fn a_file_of_zero_length() {
    let case = Case::new();
    std::fs::write(case.frame(), b"").unwrap();
    case.frame_is_refused(&["is empty (0 bytes); expected an npz or npy file"]);
    let bare = case.path("bare.npz");
    std::fs::write(&bare, b"").unwrap();
    for message in case.refusals(&bare) {
        assert_eq!(message, format!("{}: is empty (0 bytes); expected an npz or npy file", bare.display()));
    }
}

#[test]
fn text_with_the_name_of_an_npz() {
    let case = Case::new();
    std::fs::write(case.frame(), b"range,azimuth\n1,2\n").unwrap();
    case.frame_is_refused(&["is neither npz nor npy; it begins with \"range,azimuth"]);
}

#[test]
fn a_folder_with_nothing() {
    let case = Case::new();
    let empty = case.path("empty");
    std::fs::create_dir(&empty).unwrap();
    for message in case.refusals(&empty) {
        let wanted = format!("{}: no frames in it; expected dataset.toml, or MMVR's NNNNN_radar.npz", empty.display());
        assert!(message.starts_with(&wanted), "{message}");
    }
    std::fs::remove_file(case.frame()).unwrap();
    for message in case.refusals(&case.path("data")) {
        assert!(
            message.contains("no frames in it; expected files that match `frames = \"frames/*.npz\"`"),
            "{message}"
        );
    }
    for message in case.refusals(&case.path("nowhere")) {
        assert_eq!(message, format!("{}: no such file or folder", case.path("nowhere").display()));
    }
}

#[test]
fn a_manifest_with_a_typo_names_key_and_line() {
    let case = Case::new();
    let manifest = case.path("data/dataset.toml");
    std::fs::write(&manifest, MANIFEST.replace("bandwidth_hz", "bandwith_hz")).unwrap();
    for message in case.refusals(&case.path("data")) {
        let wanted = format!("{}:8: unknown key `bandwith_hz`; expected one of `start_hz`", manifest.display());
        assert!(message.starts_with(&wanted), "{message}");
    }
}

#[test]
fn a_configuration_with_a_typo_or_a_wrong_value_names_key_and_line() {
    let case = Case::new();
    let file = case.path("fit.toml");
    let refusal = |text: &str| {
        std::fs::write(&file, text).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        let message = case.refusal(command.arg("fit").arg(case.path("data")).arg("--config").arg(&file));
        message.strip_prefix(&file.display().to_string()).expect("names the file").to_owned()
    };
    let message = refusal("w_em = 0.5\nlearning_rat = 3e-3\n");
    assert!(message.starts_with(":2: unknown key `learning_rat`; expected one of `w_em`"), "{message}");
    assert_eq!(refusal("\n\ntau_pct = 0\n"), ":3: tau_pct is 0; expected a number in 0.1 ..= 100");
    assert_eq!(refusal("w_em = \"much\"\n"), ":1: w_em is \"much\"; expected a number in 0 ..= 1000");
    std::fs::remove_file(&file).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    let message = case.refusal(command.arg("fit").arg(case.path("data")).arg("--config").arg(&file));
    assert!(message.starts_with(&file.display().to_string()) && message.contains("cannot be read"), "{message}");
}

#[test]
fn a_huge_declared_shape_is_refused_before_allocating() {
    let case = Case::new();
    let header = |shape: &str| format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape}), }}\n");
    let began = Instant::now();
    case.raw_array("hm", &header("1000000, 100000"), &[0; 64]);
    case.frame_is_refused(&["array `hm` has shape (1000000, 100000); expected (16, 8), the bins of its axes"]);
    case.raw_array("hm", &header("4294967296, 4294967296, 4294967296"), &[0; 64]);
    case.frame_is_refused(&["array `hm`", "too large; refused before allocating"]);
    println!("six refusals in {:?}", began.elapsed());
}

#[test]
fn parameters_that_do_not_fit() {
    let case = Case::new();
    let params = case.path("params.npz");
    write_pppr(&params, &Pppr::zeros(PpprShape { persons: 1, joints: 14, doppler_features: 4 })).unwrap();
    let message = case.score(&case.path("data"));
    assert_eq!(message, format!("{}: parameters have joints = 14; expected 17", params.display()));
    std::fs::write(&params, "no").unwrap();
    assert!(case.score(&case.path("data")).starts_with(&params.display().to_string()));
}

#[test]
fn frames_that_are_not_there() {
    let case = Case::new();
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    let message = case.refusal(command.arg("fit").arg(case.path("data")).args(["--frames", "0..3"]));
    assert!(message.contains("--frames: frames 0..3 were asked for; the data set has 1, counted from 0"), "{message}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    let message = case.refusal(command.arg("info").arg(case.path("data")).args(["--frame", "7"]));
    assert!(message.contains("no frame 7; the data set has 1, counted from 0"), "{message}");
}

/// The superuser may read everything, so the program is then run as somebody else.
#[cfg(unix)]
#[test]
fn permission_denied() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
    use std::os::unix::process::CommandExt as _;
    const NOBODY: u32 = 65_534;
    let case = Case::new();
    let set = |path: &Path, mode: u32| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    let superuser = std::fs::metadata(case.folder.path()).unwrap().uid() == 0;
    set(case.folder.path(), 0o755);
    let fit = |path: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.arg("fit").arg(path);
        if superuser {
            command.uid(NOBODY).gid(NOBODY);
        }
        command
    };
    if let Err(error) = fit(&case.path("data")).arg("--help").output() {
        println!("skipped: the program cannot be started as another user than root: {error}");
        return;
    }
    set(&case.frame(), 0o000);
    let message = case.refusal(&mut fit(&case.path("data")));
    assert_eq!(message, format!("{}: cannot be read: Permission denied (os error 13)", case.frame().display()));
    set(&case.frame(), 0o644);
    set(&case.path("data"), 0o000);
    let message = case.refusal(&mut fit(&case.path("data")));
    assert!(message.starts_with(&format!("{}", case.path("data").display())), "{message}");
    assert!(message.contains("Permission denied"), "{message}");
    set(&case.path("data"), 0o755);
    let answers = case.path("answers");
    std::fs::create_dir(&answers).unwrap();
    set(&answers, 0o555);
    let message = case.refusal(fit(&case.path("data")).arg("--out").arg(answers.join("deep")));
    assert!(message.starts_with(&answers.display().to_string()) && message.contains("Permission denied"), "{message}");
}

#[test]
fn a_folder_in_the_place_of_a_file() {
    let case = Case::new();
    let params = case.path("params.npz");
    std::fs::remove_file(&params).unwrap();
    std::fs::create_dir(&params).unwrap();
    let wanted = format!("{}: cannot be read: it is a folder; expected an npz or npy file", params.display());
    assert_eq!(case.score(&case.path("data")), wanted);
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    let message = case.refusal(command.arg("fit").arg(case.path("data")).arg("--config").arg(case.path("data")));
    assert!(message.starts_with(&format!("{}: cannot be read: ", case.path("data").display())), "{message}");
}

#[test]
fn a_file_deleted_while_open() {
    let case = Case::new();
    let dataset = Dataset::open(&case.path("data"), &Progress::new()).unwrap();
    assert!(dataset.load(0).is_ok());
    std::fs::remove_file(case.frame()).unwrap();
    let message = dataset.load(0).unwrap_err().to_string();
    let wanted = format!("{}: cannot be read: No such file or directory", case.frame().display());
    assert!(message.starts_with(&wanted), "{message}");
}
