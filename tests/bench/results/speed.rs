//! What an iteration, a start and a frame cost, beside the peer where it can run.

use super::bed::{Bed, row, table};
use serde_json::Value;
use std::process::Command;

const ROUNDS: usize = 3;
const OURS: [&str; 2] = ["us_per_iteration_min", "us_per_iteration_median"];

/// Least and median, µs.
#[derive(Clone, Copy)]
struct Times {
    least: f64,
    median: f64,
}

impl Times {
    const NONE: Self = Self { least: f64::INFINITY, median: f64::INFINITY };

    fn best(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), median: self.median.min(other.median) }
    }

    fn cell(self) -> String {
        if self.least.is_finite() { format!("{:.1} / {:.1}", self.least, self.median) } else { "–".to_owned() }
    }
}

fn ours(bed: &Bed, region: &str, precision: &str) -> Value {
    let case = Bed::own("tests/reference/mmvr-size");
    let iterations = if precision == "f64" { "60" } else { "1000" };
    let words = ["bench", "--dataset", case.to_str().unwrap(), "--region", region, "--precision", precision];
    let text = bed.program(&[words.as_slice(), &["--iterations", iterations, "--json"]].concat());
    serde_json::from_str(&text).unwrap()
}

fn times(figures: &Value, [least, median]: [&str; 2]) -> Times {
    let number = |key: &str| figures[key].as_f64().unwrap();
    Times { least: number(least), median: number(median) }
}

/// The peer, if a Python with jax is named and the peer is there.
fn peer(region: &str) -> Option<Times> {
    let python = std::env::var("MHP_PEER").ok()?;
    let script = Bed::shared("reference/baseline_jax.py")?;
    let output = Command::new(python)
        .arg(script)
        .arg(Bed::own("tests/reference/mmvr-size"))
        .args([region, "200"])
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let figures: Value = text.lines().rev().find_map(|line| serde_json::from_str(line).ok())?;
    Some(times(&figures, ["us_min", "us_median"]))
}

pub(crate) fn section(bed: &Bed) -> String {
    let mut rows = vec![row(&["µs, least / median", "f32", "f64, the oracle", "peer", "peer over f32"])];
    let mut whole = Value::Null;
    for (name, region) in [("in the region", "region"), ("on whole maps", "full")] {
        let (mut single, mut double, mut other) = (Times::NONE, Times::NONE, Times::NONE);
        for round in 0..ROUNDS {
            let figures = ours(bed, region, "f32");
            single = single.best(times(&figures, OURS));
            if region == "region" {
                whole = figures;
            }
            // The oracle is seventy times as slow: once.
            if round == 0 {
                double = times(&ours(bed, region, "f64"), OURS);
            }
            other = other.best(peer(region).unwrap_or(Times::NONE));
        }
        let ratio = Times { least: other.least / single.least, median: other.median / single.median };
        rows.push(vec![name.to_owned(), single.cell(), double.cell(), other.cell(), ratio.cell()]);
    }
    let sample = Bed::own("samples/walk");
    let of_sample = |more: &[&str]| -> Value {
        let words = ["bench", "--dataset", sample.to_str().unwrap(), "--json", "--threads"];
        serde_json::from_str(&bed.program(&[&words[..], more].concat())).unwrap()
    };
    let rates = ["1", "2"].map(|threads| of_sample(&[threads])["frames_per_s"].as_f64().unwrap());
    let window = of_sample(&["1", "--preset", "recommended"]);
    let said = if std::env::var("MHP_PEER").is_ok() { "" } else { " The peer was not there (`MHP_PEER`)." };
    format!(
        "An iteration is the objective of both views, its gradient and one Adam step: case `mmvr-size`, two views of 256 × 128 cells, 17 \
         joints, 2 × 5,120 cells in the EM region; one thread (`mhp-inspector bench --dataset tests/reference/mmvr-size`). The peer is \
         the same mathematics compiled by XLA for all cores (`baseline_jax.py` of the shared references); ours and the peer's in turn, \
         {ROUNDS} rounds, the least of all.{said}\n\n{}\nA start takes {:.2} ms, both simulated maps {:.2} ms, a whole frame (start and \
         80 iterations) {:.2} ms, each on a problem of which nothing was worked out before; an iteration in f32 allocates {} bytes; \
         instructions: {}. Of `samples/walk` one thread fits {:.0} frames a second, two {:.0}. With \
         `--preset recommended` a window of five frames of it with all its starts takes {:.1} ms, and with its iterations \
         {:.1} ms, on one thread.",
        table(&rows),
        whole["init_ms"].as_f64().unwrap_or(f64::NAN),
        whole["simulate_ms"].as_f64().unwrap_or(f64::NAN),
        whole["frame_ms"].as_f64().unwrap_or(f64::NAN),
        whole["bytes_per_iteration"],
        whole["simd"].as_str().unwrap_or("unknown"),
        rates[0],
        rates[1],
        window["init_ms"].as_f64().unwrap_or(f64::NAN),
        window["frame_ms"].as_f64().unwrap_or(f64::NAN),
    )
}

pub(crate) fn growth(_: &Bed) -> String {
    Bed::bench("growth")
}

pub(crate) fn watched(_: &Bed) -> String {
    Bed::bench("worker")
}

pub(crate) fn live(_: &Bed) -> String {
    Bed::with_window("cargo bench --locked --bench live", &[])
}

/// With `baseline` in the window, and with `recommended` on the command line, fit and search included.
pub(crate) fn explorations(bed: &Bed) -> String {
    let figures = Bed::with_window("cargo test --locked --release --test window figures -- --ignored --nocapture", &[]);
    let mut data = vec![("`samples/walk`, frame 3", Bed::own("samples/walk"), "3")];
    data.extend(Bed::shared("data/mmvr").map(|path| ("a real MMVR frame", path, "0")));
    let mut rows = vec![row(&["`explore … --preset recommended`, s", "tuning", "ambiguity", "restarts"])];
    for (name, path, frame) in data {
        let path = path.to_str().unwrap();
        let grid = ["--grid", "w_em=0.05..5:24log", "--grid", "tau_pct=2..40:24log"];
        let tuning = ["explore", "tuning", path, "--frames", frame, "--preset", "recommended"];
        let of = |kind: &'static str| vec!["explore", kind, path, "--frame", frame, "--preset", "recommended"];
        let commands = [tuning.into_iter().chain(grid).collect(), of("ambiguity"), of("restarts")];
        let seconds = commands.map(|words| {
            let began = std::time::Instant::now();
            bed.program(&words);
            format!("{:.1}", began.elapsed().as_secs_f64())
        });
        rows.push(std::iter::once(name.to_owned()).chain(seconds).collect());
    }
    format!(
        "{figures}\n\nA tuning map has 24 × 24 fits, an ambiguity map twice 128 × 128 evaluations, a restart cloud 200 fits. With \
         `recommended`, the start and, along a sequence, those around it included:\n\n{}",
        table(&rows)
    )
}

pub(crate) fn large(_: &Bed) -> String {
    let size = [("MHP_LARGE_FRAMES", "355500"), ("MHP_LARGE_BATCH_ONLY", "1")];
    Bed::with_window("cargo test --locked --release --test window large -- --ignored --nocapture", &size)
}

pub(crate) fn fuzz(_: &Bed) -> String {
    Bed::with_window("cargo test --locked --release --no-default-features --test fuzz -- --ignored --nocapture", &[])
}
