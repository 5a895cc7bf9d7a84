//! What being watched costs a fit: the same iterations alone, and in the worker thread with somebody who takes rows and
//! pictures sixty times a second, as the window does. Painting is not in it.
//!
//! `cargo bench --no-default-features --bench worker`. Both in turn; the median of the rounds.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a measurement stops where its material cannot be made")]

use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::mhp::{Fitter, Precision};
use mhp_inspector::start::{find_start, problem_of};
use mhp_inspector::task::Progress;
use mhp_inspector::worker::{Prepare, Start, Worker, WorkerCommand, WorkerEvent, WorkerMessage};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

const ITERATIONS: usize = 10_000;
const ROUNDS: usize = 7;
/// Between two looks of the window.
const PASS: Duration = Duration::from_micros(16_667);

/// Milliseconds of the iterations alone.
fn alone(dataset: &Dataset, precision: Precision, iterations: usize) -> f64 {
    let config = FitConfig::default();
    let problem = Arc::new(problem_of(dataset, &dataset.load(0).unwrap()).unwrap());
    let initial = find_start(&problem, &config).unwrap().initialisation.params;
    let mut fitter = Fitter::new(problem, config, precision, initial).unwrap();
    let began = Instant::now();
    for _ in 0..iterations {
        fitter.step().unwrap();
    }
    began.elapsed().as_secs_f64() * 1e3
}

/// Milliseconds of the same in the worker, pictures taken, and the longest look, ms; frees what it took.
fn watched(dataset: &Arc<Dataset>, precision: Precision, iterations: usize) -> (f64, usize, f64) {
    let worker = Worker::spawn(|| {}).unwrap();
    let frame = Arc::new(dataset.load(0).unwrap());
    let (dataset, start) = (Arc::clone(dataset), Start::Initialise);
    worker.send(WorkerCommand::Prepare(Box::new(Prepare {
        job: 1,
        branch: 0,
        dataset,
        frame,
        config: FitConfig::default(),
        precision,
        start,
        erased: Arc::default(),
        around: None,
    })));
    worker.send(WorkerCommand::RunTo { target: iterations, run: 1 });
    let (mut pictures, mut longest) = (0, 0.0_f64);
    loop {
        let began = Instant::now();
        let mut kept = Vec::new();
        while let Some(message) = worker.poll() {
            match message {
                WorkerMessage::Event(_, WorkerEvent::Finished { run_ms, .. }) => return (run_ms, pictures, longest),
                WorkerMessage::Event(_, WorkerEvent::Failed(why) | WorkerEvent::Lost(why)) => panic!("{why}"),
                other => kept.push(other),
            }
        }
        while worker.take_snapshot().is_some() {
            pictures += 1;
        }
        longest = longest.max(began.elapsed().as_secs_f64() * 1e3);
        std::thread::sleep(PASS);
    }
}

fn main() {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk");
    let dataset = Arc::new(Dataset::open(&samples, &Progress::new()).unwrap());
    for (precision, iterations) in [(Precision::F32, ITERATIONS), (Precision::F64, ITERATIONS / 50)] {
        let mut rounds: Vec<(f64, f64, usize, f64)> = (0..ROUNDS)
            .map(|_| {
                let alone_ms = alone(&dataset, precision, iterations);
                let (watched_ms, pictures, longest) = watched(&dataset, precision, iterations);
                (watched_ms / alone_ms, alone_ms, pictures, longest)
            })
            .collect();
        rounds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (ratio, alone_ms, pictures, longest) = rounds[ROUNDS / 2];
        println!(
            "{precision:?}: {iterations} iterations alone {alone_ms:.0} ms, watched {ratio:.3} times as long ({:.3} to {:.3}), \
             {pictures} pictures, longest look {longest:.2} ms",
            rounds[0].0,
            rounds[ROUNDS - 1].0
        );
    }
}
