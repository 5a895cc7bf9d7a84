//! A pose before other radars: the maps of another's, and one body fitted from three.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::dataset::npz::NpzArchive;
use mhp_inspector::study::radars::{RADARS, ThreeRadars};
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
