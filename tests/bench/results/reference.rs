//! How far the program is from the reference cases, through `score`.

use super::bed::{Bed, row, table};
use mhp_inspector::dataset::npz::{NpzArchive, read_array};
use std::path::Path;

/// Largest |got − want| over a map's maximum, and over a gradient group's largest entry.
struct Off {
    maps: f64,
    gradients: f64,
    losses: f64,
}

fn off(bed: &Bed, case: &Path, precision: &str) -> Off {
    let name = format!("{}-{precision}.npz", case.file_name().unwrap().to_str().unwrap());
    let at = |file: &str| case.join(file).to_str().unwrap().to_owned();
    let (folder, params, config) = (case.to_str().unwrap(), at("params.npz"), at("fit.toml"));
    bed.program(&[
        "score",
        "--dataset",
        folder,
        "--frame",
        "0",
        "--params",
        &params,
        "--config",
        &config,
        "--precision",
        precision,
        "--out",
        &name,
    ]);
    let (want, got) = (case.join("expected.npz"), bed.path(&name));
    let mut off = Off { maps: 0.0, gradients: 0.0, losses: 0.0 };
    for key in NpzArchive::open(&want).unwrap().keys() {
        let (expected, found) = (read_array(&want, key).unwrap().data, read_array(&got, key).unwrap().data);
        let largest = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let worst = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let share = if worst == 0.0 { 0.0 } else { worst / largest };
        // Entries that are nothing but rounding are compared absolutely, as the README of the cases says.
        let (asked, nothing) = if precision == "f32" { (2e-3, 1e-6) } else { (1e-8, 1e-12) };
        let share = if worst <= nothing && share > asked { 0.0 } else { share };
        match key.as_str() {
            key if key.starts_with("sim_") => off.maps = off.maps.max(share),
            key if key.starts_with("grad_") => off.gradients = off.gradients.max(share),
            key if key.starts_with("iou_") => {}
            _ => off.losses = off.losses.max(share),
        }
    }
    off
}

pub(crate) fn section(bed: &Bed) -> String {
    let mut cases: Vec<_> =
        std::fs::read_dir(Bed::own("tests/reference")).unwrap().map(|entry| entry.unwrap().path()).collect();
    cases.retain(|case| case.join("expected.npz").is_file());
    cases.sort();
    let mut rows =
        vec![row(&["case", "maps f64", "losses f64", "gradients f64", "maps f32", "losses f32", "gradients f32"])];
    for case in &cases {
        let name = case.file_name().unwrap().to_string_lossy().into_owned();
        let figures = ["f64", "f32"].map(|precision| off(bed, case, precision));
        let cells = figures.iter().flat_map(|off| [off.maps, off.losses, off.gradients]).map(|x| format!("{x:.1e}"));
        rows.push(std::iter::once(name).chain(cells).collect());
    }
    format!(
        "Largest difference from what an independent program computed in f64, as a share of the map's maximum, of the loss and of the \
         largest entry of a gradient's group (`mhp-inspector score`; what is off by no more than 1e-12, in f32 1e-6, counts as none where the \
         whole group is about as small). Asked: f64 1e-9, 1e-9, 1e-8; f32 2e-4, 1e-4, 2e-3. `cargo test` holds it.\n\n{}",
        table(&rows)
    )
}
