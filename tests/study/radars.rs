//! A pose before other radars: the maps of another's, and one body fitted from three.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::config::{FitConfig, Preset, RangeOffset};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::dataset::npz::NpzArchive;
use mhp_inspector::study::radars::{RADARS, ThreeRadars};
use mhp_inspector::study::{BatchOptions, FitNumbers, fit_frame};
use mhp_inspector::task::Progress;
use std::path::Path;
use std::process::Command;

fn program(args: &[&str]) -> (bool, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_mhp-inspector")).args(args).output().unwrap();
    let text = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    (done.status.success(), text)
}

#[test]
fn a_fitted_pose_is_simulated_for_another_radar() {
    let home = tempfile::tempdir().unwrap();
    let (fits, out) = (home.path().join("fits"), home.path().join("hupr.npz"));
    let [fits, out] = [fits, out].map(|path| path.to_str().unwrap().to_owned());
    let (fine, told) =
        program(&["fit", "samples/walk", "--frames", "3", "--preset", "baseline", "--iterations", "5", "--out", &fits]);
    assert!(fine, "{told}");
    let params = walked(Path::new(&fits));
    let params = params.to_str().unwrap();
    let (fine, told) = program(&["transfer", "map", "--params", params, "--radar", "hupr", "--signal", "--out", &out]);
    assert!(fine && told.contains("sim_hori, sim_vert, signal_hori, signal_vert"), "{told}");
    let mut arrays = NpzArchive::open(Path::new(&out)).unwrap();
    let mut map = |key: &str| arrays.read(key).unwrap();
    let (closed, signal) = (map("sim_hori"), map("signal_hori"));
    assert_eq!((closed.shape.as_slice(), signal.shape.as_slice()), (&[16, 64, 64][..], &[16, 64, 64][..]));
    // Both put the person at one place: a window's sidelobes are what the closed form lacks.
    let top = |data: &[f64]| {
        let at = (0..data.len()).max_by(|&a, &b| data[a].total_cmp(&data[b])).unwrap();
        [at / 4096, at / 64 % 64, at % 64].map(|bin| bin as i64)
    };
    let (a, b) = (top(&closed.data), top(&signal.data));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 4), "{a:?} {b:?}");
    // The radar of another data set; widths that are stated have no signals.
    let (fine, told) = program(&["transfer", "map", "--params", params, "--like", "samples/xrf55", "--out", &out]);
    assert!(fine && told.contains("sim_range_cone"), "{told}");
    for (args, wanted) in [
        (vec!["--radar", "mmvr", "--signal"], "its FFT configuration is not known"),
        (vec!["--radar", "lidar"], "no published views; expected one of mmvr, hiber, hupr, xrf55, rt_pose"),
        (vec!["--radar", "hupr", "--skeleton", "hupr14"], "parameters have joints = 17; expected 14"),
    ] {
        let (fine, told) = program(&[&["transfer", "map", "--params", params, "--out", &out][..], &args[..]].concat());
        assert!(!fine && told.contains(wanted), "{told}");
    }
}

/// The only npz in a folder of fits.
fn walked(folder: &Path) -> std::path::PathBuf {
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|ending| ending == "npz") {
                return path;
            }
        }
    }
    unreachable!("a fit writes its parameters")
}

/// By calibration alone: no setting differs, and a body is found from each of the three.
#[test]
fn one_body_is_fitted_from_three_radars() {
    let study = ThreeRadars { sequences: 1, frames: 1, ..ThreeRadars::default() };
    let rows = study.run(|| {}).unwrap();
    let text = study.markdown(&rows);
    println!("{text}");
    assert_eq!(rows.len(), RADARS.len());
    for row in &rows {
        // It stands where it is, within a stride; heights are not seen by a radar of one line.
        assert!(row.frames == 1 && row.majpe_mm < 700.0 && row.pa_majpe_mm < 200.0 && row.iou > 0.2, "{row:?}");
        assert!(text.contains(&format!("| {:.0} | {:.0} |", row.start_mm, row.majpe_mm)), "{text}");
    }
}

/// Two radars in one place whose ranges begin elsewhere: what the maps tell of it is taken into account, and the pose is as good as
/// before radars that agree. Which of the two is right nobody can tell: the body stands between.
#[test]
fn a_fit_bears_radars_whose_ranges_differ() {
    const APART_M: f64 = 0.2;
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk");
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("frames")).unwrap();
    for frame in 0..6 {
        let name = format!("frames/{frame:06}.npz");
        std::fs::copy(sample.join(&name), folder.path().join(&name)).unwrap();
    }
    let text = std::fs::read_to_string(sample.join("dataset.toml")).unwrap();
    let (hori, vert) = text.split_at(text.find("array = \"hm_vert\"").unwrap());
    let farther =
        |of: &str, key: &str, metres: f64| of.replacen(key, &format!("{} = {}", &key[..2], metres + APART_M), 1);
    let shifted = farther(&farther(vert, "lo = 7.984375", 7.984_375), "hi = -0.015625", -0.015_625);
    let fit = |text: &str, range_offset: RangeOffset| {
        std::fs::write(folder.path().join("dataset.toml"), text).unwrap();
        let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
        let config = FitConfig { range_offset, ..Preset::Recommended.config() };
        let options = BatchOptions { config, ..BatchOptions::default() };
        fit_frame(&dataset, 3, &options, None).unwrap().numbers
    };
    let agreed = fit(&text, RangeOffset::Measured);
    assert_eq!(fit(&text, RangeOffset::Stated).report.loss, agreed.report.loss, "there is no offset to be found");
    let apart = format!("{hori}{shifted}");
    let [ignored, measured] = [RangeOffset::Stated, RangeOffset::Measured].map(|offset| fit(&apart, offset));
    let em = |of: &FitNumbers| of.report.terms.get("em").unwrap();
    println!("L_EM {:.4} agreed, {:.4} ignored, {:.4} measured", em(&agreed), em(&ignored), em(&measured));
    assert!(em(&measured) < 1.2 * em(&agreed) && em(&ignored) > 1.8 * em(&agreed));
    assert!(measured.pa_majpe_mm.unwrap() < agreed.pa_majpe_mm.unwrap() + 10.0);
    // A manifest that states it needs no measuring, and knows which radar is right.
    let (head, tail) = apart.split_at(apart.rfind("[view.psf]").unwrap());
    let stated =
        format!("{head}{}", tail.replacen("[view.psf]", &format!("[view.psf]\nrange_offset_m = {APART_M}"), 1));
    let told = fit(&stated, RangeOffset::Stated);
    assert!((told.majpe_mm.unwrap() - agreed.majpe_mm.unwrap()).abs() < 15.0, "{told:?}");
    let far = stated.replacen(&format!("range_offset_m = {APART_M}"), "range_offset_m = 200.0", 1);
    std::fs::write(folder.path().join("dataset.toml"), far).unwrap();
    let why = Dataset::open(folder.path(), &Progress::new()).unwrap_err().to_string();
    assert!(why.contains("`range_offset_m` is 200; expected −20 to 20"), "{why}");
}
