//! Several people: how many end as one body each, and how often their number is counted right.

use super::bed::{Bed, row, table};
use super::studies::tables_of;
use mhp_inspector::body::Pppr;
use mhp_inspector::dataset::{Dataset, read_pppr};
use mhp_inspector::geometry::Vec3;
use mhp_inspector::task::Progress;
use std::path::Path;

/// A body belongs to somebody when its middle is no farther from theirs over the floor, m.
const BELONGS_M: f64 = 0.5;
/// Two bodies nearer to each other are in one place, m.
const APART_M: f64 = 0.3;

fn middle(joints: &[Vec3]) -> [f64; 2] {
    let mean = |axis: usize| joints.iter().map(|joint| joint[axis]).sum::<f64>() / joints.len() as f64;
    [mean(0), mean(1)]
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Whether every person of `truth` has a body of their own, whoever is taken in which order.
fn one_each(bodies: &[[f64; 2]], truth: &[[f64; 2]]) -> bool {
    let Some((person, others)) = truth.split_first() else { return bodies.is_empty() };
    bodies.iter().enumerate().any(|(k, body)| {
        let rest: Vec<[f64; 2]> =
            bodies.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, body)| *body).collect();
        distance(*body, *person) <= BELONGS_M && one_each(&rest, others)
    })
}

/// Shares of frames: one body each and apart; two bodies in one place.
fn shares(data: &Path, results: &Path) -> [f64; 2] {
    let dataset = Dataset::open(data, &Progress::default()).unwrap();
    let (mut good, mut together) = (0, 0);
    for index in 0..dataset.len() {
        let truth = dataset.load(index).unwrap().truth.unwrap();
        let persons =
            |joints: &[Vec3], count: usize| joints.chunks(joints.len() / count).map(middle).collect::<Vec<_>>();
        let file = format!("{}.npz", dataset.frame_name(index).replace('/', "_"));
        let fitted: Pppr = read_pppr(&results.join("pppr").join(file), None).unwrap();
        let bodies = persons(fitted.positions(), fitted.shape().persons);
        let pairs = (0..bodies.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let nearest = pairs.map(|(a, b)| distance(bodies[a], bodies[b])).fold(f64::INFINITY, f64::min);
        together += usize::from(nearest < APART_M);
        good += usize::from(nearest >= APART_M && one_each(&bodies, &persons(&truth.joints, truth.persons)));
    }
    [good, together].map(|frames| 100.0 * frames as f64 / dataset.len() as f64)
}

pub(crate) fn several(bed: &Bed) -> String {
    let sets = [
        ("two", 2, "--preset easy,medium,hard --frames 360 --people 2 --seed 77702"),
        ("three", 3, "--preset easy,medium,hard --frames 360 --people 3 --seed 77703"),
        ("close", 2, "--preset f3 --frames 360 --people 2 --seed 77802"),
    ];
    let mut rows = vec![row(&["data", "preset", "one body each", "two bodies in one place"])];
    for (name, people, options) in sets {
        let data = bed.simulated(name, options);
        for preset in ["baseline", "recommended"] {
            let results = format!("{name}-{preset}");
            let count = people.to_string();
            bed.program(&["fit", name, "--preset", preset, "--people", &count, "--out", &results]);
            let [good, together] = shares(&data, &bed.path(&results));
            let cells = [
                format!("`simulate {options}`"),
                format!("`{preset}`"),
                format!("{good:.1} %"),
                format!("{together:.1} %"),
            ];
            rows.push(cells.to_vec());
        }
    }
    format!(
        "`fit DATA --preset PRESET --people N`: every person has a body of their own, its middle within {BELONGS_M} m over the floor, and \
         no two bodies are nearer than {APART_M} m; and the share of frames where two are.\n\n{}",
        table(&rows)
    )
}

pub(crate) fn counting(bed: &Bed) -> String {
    let options = "--preset easy,medium,hard --frames 500 --people 0..=4 --seed 9051";
    let data = bed.simulated("counted", options);
    let run = bed.study("counting", &data, "counting", &[]);
    format!(
        "`simulate {options}`, then `study counting`: no seed that the counter was trained on.\n\n{}",
        tables_of(&run)
    )
}
