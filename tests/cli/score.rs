//! `mhp-inspector score`, run as a program: its answers on the committed cases, and what it says to bad input.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use crate::reading::{case_folders, read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn committed(name: &str) -> PathBuf {
    case_folders().into_iter().find(|folder| folder.ends_with(name)).unwrap()
}

fn score(folder: &Path, params: &Path, extra: &[&str], out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mhp-inspector"))
        .args(["score", "--frame", "0", "--dataset"])
        .arg(folder)
        .arg("--params")
        .arg(params)
        .arg("--out")
        .arg(out)
        .args(extra)
        .output()
        .unwrap()
}

/// Largest |got − want| of every array that `expected.npz` holds, relative to the array's largest entry.
fn worst(folder: &Path, out: &Path, keys: &[&str]) -> f64 {
    let worst_of = |key: &&str| {
        let (got, want) = (read(out, key), read(&folder.join("expected.npz"), key));
        assert_eq!(got.len(), want.len(), "{key}");
        let largest = want.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        got.iter().zip(&want).map(|(g, w)| (g - w).abs()).fold(0.0, f64::max) / largest
    };
    keys.iter().map(worst_of).fold(0.0, f64::max)
}

const GRADIENTS: [&str; 12] = [
    "grad_position",
    "grad_log_scale",
    "grad_rotation",
    "grad_velocity",
    "grad_beta",
    "grad_omega",
    "grad_em_position",
    "grad_em_log_scale",
    "grad_em_rotation",
    "grad_em_velocity",
    "grad_em_beta",
    "grad_em_omega",
];
const SCALARS: [&str; 7] = ["loss", "em", "bone", "rigid", "joint", "sep", "coll"];

#[test]
fn writes_what_the_reference_holds() {
    let folder = committed("range-doppler");
    let (temp, params) = (tempfile::tempdir().unwrap(), folder.join("params.npz"));
    let config = folder.join("fit.toml");
    for (precision, limit) in [("f64", 1e-8), ("f32", 2e-3)] {
        let out = temp.path().join(format!("{precision}.npz"));
        let extra = ["--config", config.to_str().unwrap(), "--precision", precision];
        let done = score(&folder, &params, &extra, &out);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        assert!(worst(&folder, &out, &GRADIENTS) < limit, "{precision} gradients");
        assert!(worst(&folder, &out, &["sim_rd", "sim_ra"]) < limit * 0.1, "{precision} maps");
        assert!(worst(&folder, &out, &SCALARS) < limit * 0.1, "{precision} losses");

        let json: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
        for key in SCALARS.into_iter().chain(["time", "prior", "net", "given", "iou_rd", "iou_ra"]) {
            let (printed, written) = (json[key].as_f64().unwrap(), read(&out, key)[0]);
            assert!((printed - written).abs() <= 1e-15 * written.abs(), "{key}: {printed}, {written}");
        }
        assert_eq!(json.as_object().unwrap().len(), 13);
    }
}

#[test]
fn bad_input_is_one_message_and_exit_code_2() {
    let (folder, other) = (committed("range-doppler"), committed("polar-two-views"));
    let temp = tempfile::tempdir().unwrap();
    let (out, good) = (temp.path().join("out.npz"), folder.join("params.npz"));
    let typo = temp.path().join("fit.toml");
    std::fs::write(&typo, "w_em = 0.5\nw_kin = 0.5\n").unwrap();
    let typo = typo.to_str().unwrap();
    let cases: [(&Path, &Path, &[&str], &[&str]); 5] = [
        (&folder, &other.join("params.npz"), &[], &["doppler_features", "24", "params.npz"]),
        (&folder, &folder.join("absent.npz"), &[], &["absent.npz"]),
        (&folder, &folder.join("fit.toml"), &[], &["fit.toml"]),
        (&folder, &good, &["--config", typo], &["w_kin", "fit.toml:2:"]),
        (&folder.join("absent"), &good, &[], &["absent"]),
    ];
    for (dataset, params, extra, words) in cases {
        let done = score(dataset, params, extra, &out);
        let text = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{text}");
        assert!(done.stdout.is_empty() && !out.exists(), "nothing but the message");
        assert_eq!(text.matches("error:").count(), 1, "{text}");
        for word in words {
            assert!(text.contains(word), "no {word:?} in: {text}");
        }
    }
}
