//! Radars whose data sets have joints in three dimensions: where HIBER's stand in its room, and how near fits come.

use super::bed::{Bed, row, table};
use super::fits::{Errors, HEAD, errors, otherwise};
use mhp_inspector::dataset::{ROOMS_NAME, RoomTransforms};
use mhp_inspector::geometry::{Pose, mat_mul, norm, sub, transpose};
use std::path::{Path, PathBuf};

/// Seeds of rooms, on which one way of comparing was chosen before another; on those of fits nothing was.
const ROOMS: [u64; 15] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 41, 42, 43, 44, 45];
const FITS: [u64; 3] = [2, 3, 4];

fn hiber(bed: &Bed, seed: u64) -> PathBuf {
    bed.simulated(&format!("hiber{seed}"), &format!("--layout hiber --frames 200 --seed {seed}"))
}

fn known(path: &Path) -> Pose {
    RoomTransforms::of(path, None).of_environment("01").unwrap().radar_from_room
}

/// Degrees, and centimetres of the translation and of the radar's place.
fn off(found: &Pose, known: &Pose) -> [f64; 3] {
    let turn = mat_mul(&found.rotation, &transpose(&known.rotation));
    let angle = (0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0)).clamp(-1.0, 1.0).acos().to_degrees();
    let place = norm(sub(found.world_from_view([0.0; 3]), known.world_from_view([0.0; 3])));
    [angle, 100.0 * norm(sub(found.translation, known.translation)), 100.0 * place]
}

pub(crate) fn section(bed: &Bed) -> String {
    let offs: Vec<[f64; 3]> = ROOMS
        .iter()
        .map(|&seed| {
            let data = hiber(bed, seed);
            let told = bed.program(&["calibrate-room", data.to_str().unwrap(), "--dry-run", "--json"]);
            let told: serde_json::Value = serde_json::from_str(&told).unwrap();
            let numbers = |value: &serde_json::Value| {
                std::array::from_fn(|k| value.get(k).and_then(serde_json::Value::as_f64).unwrap())
            };
            let rotation = std::array::from_fn(|k| numbers(&told[0]["rotation"][k]));
            std::fs::copy(data.join("rooms-stated.toml"), data.join(ROOMS_NAME)).unwrap();
            off(&Pose { rotation, translation: numbers(&told[0]["translation_m"]) }, &known(&data))
        })
        .collect();
    let column = |k: usize| {
        let all: Vec<f64> = offs.iter().map(|off| off[k]).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let most = all.iter().copied().fold(0.0, f64::max);
        format!("{mean:.2} on average, {most:.2} at most")
    };
    let kept = otherwise(bed, "kept.toml", ["sidelobes = \"removed\"", "sidelobes = \"kept\""]);
    let mut rows = vec![row(&HEAD)];
    let sets = [
        ("`simulate --layout hiber --frames 200`, seeds 2, 3, 4", FITS.map(|seed| hiber(bed, seed)).to_vec()),
        (
            "`simulate --layout rt-pose --frames 60 --seed 4`",
            vec![bed.simulated("rt", "--layout rt-pose --frames 60 --seed 4")],
        ),
    ];
    for (name, sets) in &sets {
        for preset in ["baseline", "recommended"] {
            rows.push(errors(bed, sets, preset).cells(name, preset));
        }
        let mut with = Errors::default();
        for (k, set) in sets.iter().enumerate() {
            let run =
                bed.study("complexity", set, &format!("kept{k}-{}", rows.len()), &["--config", kept.to_str().unwrap()]);
            with.add(&run.join("rows.csv"));
        }
        rows.push(with.cells(name, "recommended, sidelobes = \"kept\""));
    }
    format!(
        "`calibrate-room` on {} simulated rooms (`simulate DIR --layout hiber --frames 200 --seed S`, people who walk): turned too far by {} \
         degrees; the translation {} cm off, the radar's place in the room {} cm.\n\n`study complexity DATA`, rooms as stated:\n\n{}",
        ROOMS.len(),
        column(0),
        column(1),
        column(2),
        table(&rows)
    )
}
