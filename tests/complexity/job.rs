//! Beside the window: the answer, progress, cancel; a large tree.

use super::sets::{Set, open};
use super::tree::tree;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::study::StudyError;
use mhp_inspector::study::complexity::{Complexity, ComplexityJob, ComplexityOptions, compute};
use mhp_inspector::task::Progress;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Far longer than anything here takes; a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_mins(1);

fn start(dataset: &Arc<Dataset>, cache: Option<&Path>) -> (ComplexityJob, Receiver<()>) {
    let (sender, woken) = channel();
    let wake = move || {
        let _ = sender.send(());
    };
    let (dataset, cache) = (Arc::clone(dataset), cache.map(Path::to_owned));
    (ComplexityJob::start(dataset, ComplexityOptions::default(), cache, wake), woken)
}

fn wait(job: &mut ComplexityJob, woken: &Receiver<()>) -> Result<Complexity, StudyError> {
    woken.recv_timeout(PATIENCE).unwrap();
    let answer = job.poll().unwrap();
    assert!(job.poll().is_none(), "the answer is given once");
    answer
}

#[test]
fn a_job_answers_once_with_progress_told() {
    let folder = Set::mixed(&[20, 7], 2).folder();
    let dataset = Arc::new(open(folder.path()));
    let (mut job, woken) = start(&dataset, None);
    let answer = wait(&mut job, &woken).unwrap();
    assert_eq!(answer, compute(&dataset, &ComplexityOptions::default(), None, &Progress::new()).unwrap());
    let state = job.progress().state();
    assert_eq!((state.stage.as_str(), state.done, state.total), ("measuring maps", 27, 27));
}

#[test]
fn a_cancelled_job_says_so_and_a_dropped_one_stops() {
    let folder = Set::mixed(&[2], 2).folder();
    let dataset = Arc::new(open(folder.path()));
    let progress = Progress::new();
    progress.cancel();
    let home = tempfile::tempdir().unwrap();
    for cache in [None, Some(home.path())] {
        let answer = compute(&dataset, &ComplexityOptions::default(), cache, &progress);
        assert!(matches!(answer, Err(StudyError::Cancelled)));
    }
    let (job, _woken) = start(&dataset, None);
    let told = job.progress().clone();
    drop(job);
    assert!(told.is_cancelled());
}

/// `cargo test --release --test complexity -- --ignored --nocapture` measures; MHP_TREE_OUT keeps the tree.
#[test]
#[ignore = "writes 100,000 files"]
fn a_large_tree() {
    let (temporary, home) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let root = std::env::var_os("MHP_TREE_OUT").map_or_else(|| temporary.path().to_owned(), Into::into);
    tree(&root, 100_000, 112);
    let begun = Instant::now();
    let dataset = Arc::new(open(&root));
    println!("opened {} frames in {:.2} s", dataset.len(), begun.elapsed().as_secs_f64());
    for run in ["cold", "warm"] {
        let begun = Instant::now();
        let (mut job, woken) = start(&dataset, Some(home.path()));
        let complexity = loop {
            if woken.recv_timeout(PATIENCE).is_ok() {
                break job.poll().unwrap().unwrap();
            }
        };
        let seconds = begun.elapsed().as_secs_f64();
        println!("{run}: {seconds:.2} s, {:.0} frames/s, {:?}", 1e5 / seconds, complexity.counts);
        assert_eq!(complexity.scanned, if run == "cold" { 100_000 } else { 0 });
    }
}
