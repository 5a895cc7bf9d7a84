//! `mhp-inspector info`: what it prints, its JSON, its exit codes.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::dataset::{BareCatalog, BareChoice, Remembered};
use mhp_inspector::folders::HOME_VARIABLE;
use std::path::Path;
use std::process::Command;

/// Exit code, standard output, standard error.
fn info(path: &Path, more: &[&str], home: &Path) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
    let done = command.arg("info").arg(path).args(more).env(HOME_VARIABLE, home).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (done.status.code().unwrap(), text(&done.stdout), text(&done.stderr))
}

fn mmvr_frame(folder: &Path) {
    let mut map = vec![1.0_f32; 256 * 128];
    map[..328].fill(f32::NAN);
    map[400] = 8.0;
    let maps = [("hm_hori", ArrayView::f32(&[256, 128], &map)), ("hm_vert", ArrayView::f32(&[256, 128], &map[..]))];
    write(&folder.join("00030_radar.npz"), &maps).unwrap();
    write(
        &folder.join("00030_bbox.npz"),
        &[
            ("bbox_i", ArrayView::f64(&[1, 5], &[0.0; 5])),
            ("bbox_hori", ArrayView::f64(&[1, 4], &[0.0; 4])),
            ("bbox_vert", ArrayView::f64(&[1, 4], &[0.0; 4])),
        ],
    )
    .unwrap();
}

#[test]
fn text_tells_axes_values_labels_and_assumptions() {
    let folder = tempfile::tempdir().unwrap();
    mmvr_frame(folder.path());
    let (code, out, err) = info(folder.path(), &[], folder.path());
    assert_eq!((code, err.as_str()), (0, ""));
    for wanted in [
        "layout      mmvr\n",
        "frames      1 in 1 sequence, 15 a second\n",
        "axes        Cartesian · rows: depth 8→0 m, row 0 far · columns: y 1→−4 m from left to right (hm_hori), z −2…3 m up (hm_vert)\n",
        "skeleton    coco17, 17 joints, 19 bones\n",
        "assumed     radar: ",
        "time        2.000 s\n",
        "people      1\n",
        "truth       none in metres\n",
        "labels      1 box on hm_hori, 1 box on hm_vert, 1 image box\n",
        "note        00030_mask.npz is missing: no masks\n",
        "view        hm_vert, 256×128 <f4, amplitude\n",
        "  values    1.0000e0 to 8.0000e0\n",
        "  NaN       328 of 32768 cells (1.001 %)\n",
    ] {
        assert!(out.contains(wanted), "{wanted}\n{out}");
    }
}

#[test]
fn json_has_stable_keys_and_exact_values() {
    let folder = tempfile::tempdir().unwrap();
    mmvr_frame(folder.path());
    let (code, out, _) = info(&folder.path().join("00030_radar.npz"), &["--json"], folder.path());
    assert_eq!(code, 0);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    let keys: Vec<&str> = json.as_object().unwrap().keys().map(String::as_str).collect();
    let wanted = "assumptions axes frame frame_rate_hz frames label_notes layout name notes radar root scenes sequences \
                  skeleton views";
    let mut sorted = keys.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, wanted.split(' ').collect::<Vec<_>>());
    let view = &json["views"][0];
    assert_eq!((view["array"].as_str(), view["dtype"].as_str()), (Some("hm_hori"), Some("<f4")));
    assert_eq!(
        (view["nan_cells"].as_u64(), view["max"].as_f64(), view["min"].as_f64()),
        (Some(328), Some(8.0), Some(1.0))
    );
    assert_eq!(view["nan_share"].as_f64(), Some(328.0 / 32768.0));
    assert_eq!(view["axes"][0]["kind"].as_str(), Some("depth_h"));
    assert_eq!((json["frame"]["people"].as_u64(), json["frame"]["truth"].as_bool()), (Some(1), Some(false)));
    assert_eq!(json["skeleton"]["name"].as_str(), Some("coco17"));
}

#[test]
fn bad_input_exits_with_two_and_one_message() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) = info(&folder.path().join("nothing"), &[], folder.path());
    assert_eq!((code, out.as_str(), err.lines().count()), (2, "", 1));
    assert!(err.contains("nothing: no such file or folder"), "{err}");
    mmvr_frame(folder.path());
    let (code, _, err) = info(folder.path(), &["--frame", "1"], folder.path());
    assert_eq!((code, err.contains("no frame 1; the data set has 1, counted from 0")), (2, true), "{err}");
    std::fs::write(folder.path().join("00030_radar.npz"), b"text").unwrap();
    let (code, _, err) = info(folder.path(), &["--json"], folder.path());
    assert_eq!((code, err.contains("00030_radar.npz: is neither npz nor npy")), (2, true), "{err}");
}

#[test]
fn a_bare_file_needs_axes_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bare.npz");
    let map = [f64::NAN; 12];
    write(&path, &[("map", ArrayView::f64(&[4, 3], &map))]).unwrap();
    let (code, _, err) = info(&path, &[], folder.path());
    assert_eq!((code, err.contains("the axes of `map` (4, 3) <f8 are not known")), (2, true), "{err}");
    let catalog = BareCatalog::read(&path).unwrap();
    Remembered::in_folder(folder.path()).remember(&catalog, &BareChoice::guess(&catalog)).unwrap();
    let (code, out, err) = info(&path, &[], folder.path());
    assert_eq!((code, out.contains("layout      bare\n")), (0, true), "{out}{err}");
    assert!(out.contains("  values    no finite cell\n") && out.contains("12 of 12 cells (100.000 %)"), "{out}");

    let manifest = folder.path().join("axes.toml.txt");
    let text = "layout = \"npz\"\nskeleton = \"h36m17\"\n[[view]]\narray = \"map\"\n\
        psf = { range_m = 0.1, azimuth_rad = 0.1, elevation_rad = 0, doppler_mps = 0 }\n\
        axes = [{ kind = \"range\", bins = 4, lo = 0, hi = 4 }, { kind = \"azimuth\", bins = 3, lo = -1, hi = 1 }]\n";
    std::fs::write(&manifest, text).unwrap();
    let (code, out, _) = info(&path, &["--manifest", manifest.to_str().unwrap()], folder.path());
    assert_eq!((code, out.contains("skeleton    h36m17, 17 joints, 16 bones\n")), (0, true), "{out}");
    assert!(out.contains("axes        polar · rows: range −0.5→3.5 m, row 0 near · columns: azimuth "), "{out}");
    std::fs::write(&manifest, text.replace("psf", "pfs")).unwrap();
    let (code, _, err) = info(&path, &["--manifest", manifest.to_str().unwrap()], folder.path());
    assert_eq!((code, err.contains("axes.toml.txt:5: unknown key `pfs`; expected one of")), (2, true), "{err}");
}

/// A folder may have any bytes as its name; JSON has text.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_whose_name_is_no_text_is_told() {
    use std::os::unix::ffi::OsStrExt as _;
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join(std::ffi::OsStr::from_bytes(b"data \xff"));
    std::fs::create_dir(&data).unwrap();
    mmvr_frame(&data);
    for more in [&[][..], &["--json"]] {
        let (code, out, err) = info(&data, more, folder.path());
        assert_eq!((code, err.as_str()), (0, ""), "{more:?}");
        assert!(out.contains("data \u{fffd}"), "{out}");
    }
}
