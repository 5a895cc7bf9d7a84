//! What runs beside the window: the cache and its budget, the loader, opening with progress and cancel.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::dataset::{Dataset, DatasetError, Frame, FrameCache, Heatmap, Loader, OpenJob};
use mhp_inspector::task::Progress;
use proptest::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Far longer than anything here takes; a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(20);

fn frame(index: usize, cells: usize) -> Arc<Frame> {
    Arc::new(Frame {
        index,
        name: String::new(),
        global_id: None,
        timestamp_s: None,
        maps: vec![Heatmap { shape: vec![cells], data: vec![0.0; cells], dtype: "<f8".into() }],
        map_boxes: Vec::new(),
        person_count: None,
        truth: None,
        image: None,
        notes: Vec::new(),
    })
}

/// MMVR frames 0 to `count` whose maps hold their number.
fn tree(count: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for i in 0..count {
        let map = vec![i as f32; 256 * 128];
        let maps = [("hm_hori", ArrayView::f32(&[256, 128], &map)), ("hm_vert", ArrayView::f32(&[256, 128], &map))];
        write(&folder.path().join(format!("{i:05}_radar.npz")), &maps).unwrap();
    }
    folder
}

fn loader(folder: &std::path::Path, cache: FrameCache) -> (Loader, Receiver<()>) {
    let dataset = Arc::new(Dataset::open(folder, &Progress::new()).unwrap());
    let (sender, woken) = channel();
    let wake = move || {
        let _ = sender.send(());
    };
    (Loader::with_cache(dataset, cache, wake), woken)
}

/// Waits for the answer to the latest request.
fn answer(loader: &Loader, woken: &Receiver<()>) -> (usize, Result<Arc<Frame>, DatasetError>) {
    loop {
        if let Some(answer) = loader.poll() {
            return answer;
        }
        woken.recv_timeout(PATIENCE).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The cache does what a plain list of (index, bytes), oldest first, does; and never holds more than its budget.
    #[test]
    fn the_cache_is_least_recently_used_within_its_budget(
        budget in 0_usize..120_000,
        steps in prop::collection::vec((0_usize..12, 0_usize..5000, any::<bool>()), 0..80),
    ) {
        let mut cache = FrameCache::new(budget);
        let mut model: VecDeque<(usize, usize)> = VecDeque::new();
        for (index, cells, reads) in steps {
            let held = model.iter().position(|entry| entry.0 == index);
            if reads {
                prop_assert_eq!(cache.get(index).map(|frame| frame.index), held.map(|_| index));
                if let Some(entry) = held.and_then(|at| model.remove(at)) {
                    model.push_back(entry);
                }
            } else {
                let frame = frame(index, cells);
                let bytes = frame.bytes();
                prop_assert!(bytes >= cells * 8);
                let bytes = frame.bytes();
                cache.insert(index, frame, bytes);
                held.map(|at| model.remove(at));
                if bytes <= budget {
                    while model.iter().map(|entry| entry.1).sum::<usize>() + bytes > budget {
                        model.pop_front();
                    }
                    model.push_back((index, bytes));
                }
            }
            prop_assert!(cache.bytes() <= budget);
            prop_assert_eq!(cache.bytes(), model.iter().map(|entry| entry.1).sum::<usize>());
            prop_assert_eq!(cache.len(), model.len());
            prop_assert!(model.iter().all(|entry| cache.contains(entry.0)));
        }
    }
}

#[test]
fn the_loader_answers_the_latest_request_and_then_from_memory() {
    let folder = tree(12);
    let (loader, woken) = loader(folder.path(), FrameCache::default());
    for i in 0..=7 {
        loader.request(i);
    }
    let (index, loaded) = answer(&loader, &woken);
    assert_eq!((index, loaded.unwrap().maps[0].data[0]), (7, 7.0), "earlier requests are dropped");
    assert!(loader.poll().is_none() && !loader.is_loading(), "each answer is given once");
    loader.request(7);
    let (index, loaded) = loader.poll().unwrap_or_else(|| panic!("a frame in memory is answered at once"));
    assert_eq!((index, loaded.unwrap().index), (7, 7));
}

#[test]
fn the_loader_reads_ahead_and_tells_errors_only_when_asked() {
    let folder = tree(4);
    std::fs::write(folder.path().join("00001_radar.npz"), b"text").unwrap();
    let (loader, woken) = loader(folder.path(), FrameCache::default());
    loader.request(0);
    assert!(answer(&loader, &woken).1.is_ok());
    let begun = std::time::Instant::now();
    while loader.cached().1 < 3 {
        assert!(begun.elapsed() < PATIENCE, "frames 2 and 3 are read ahead, 1 cannot be");
        std::thread::yield_now();
    }
    assert!(loader.poll().is_none(), "what was read ahead is no answer");
    loader.request(2);
    assert_eq!(loader.poll().unwrap().1.unwrap().maps[1].data[5], 2.0);
    loader.request(1);
    let (index, loaded) = answer(&loader, &woken);
    assert_eq!(index, 1);
    assert!(loaded.unwrap_err().to_string().contains("00001_radar.npz: is neither npz nor npy"));
    loader.request(9);
    assert!(matches!(answer(&loader, &woken), (9, Err(DatasetError::NoSuchFrame { count: 4, .. }))));
}

#[test]
fn the_loader_stays_within_a_small_budget_and_ends_when_dropped() {
    let folder = tree(6);
    let one = {
        let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
        dataset.load(0).unwrap().bytes()
    };
    for budget in [0, one / 2, one, 2 * one + 1] {
        let (loader, woken) = loader(folder.path(), FrameCache::new(budget));
        for i in [0, 5, 3, 0, 1] {
            loader.request(i);
            assert_eq!(answer(&loader, &woken).1.unwrap().index, i, "a frame that is not kept is still handed out");
            assert!(loader.cached().0 <= budget);
        }
        loader.request(2);
        drop(loader);
        // The thread owned the other sender; it is gone, so nobody can wake any more.
        while woken.recv_timeout(PATIENCE).is_ok() {}
        assert!(matches!(woken.try_recv(), Err(std::sync::mpsc::TryRecvError::Disconnected)));
    }
}

fn wait(job: &mut OpenJob, woken: &Receiver<()>) -> Result<Dataset, DatasetError> {
    woken.recv_timeout(PATIENCE).unwrap();
    job.poll().unwrap()
}

fn start(path: &std::path::Path, manifest: Option<std::path::PathBuf>) -> (OpenJob, Receiver<()>) {
    let (sender, woken) = channel();
    let wake = move || {
        let _ = sender.send(());
    };
    (OpenJob::start(path.to_owned(), manifest, false, wake), woken)
}

#[test]
fn opening_answers_once_with_progress_told() {
    let folder = tree(2);
    let (mut job, woken) = start(folder.path(), None);
    assert_eq!(wait(&mut job, &woken).unwrap().len(), 2);
    assert!(job.poll().is_none());
    let state = job.progress().state();
    assert_eq!((state.stage.as_str(), state.done, state.total), ("listing folders", 1, 1));
    let (mut job, woken) = start(&folder.path().join("none"), None);
    assert!(matches!(wait(&mut job, &woken), Err(DatasetError::NotFound { .. })));
    let (mut job, woken) = start(folder.path(), Some(folder.path().join("none.toml")));
    assert!(matches!(wait(&mut job, &woken), Err(DatasetError::NotFound { path }) if path.ends_with("none.toml")));
}

#[test]
fn opening_can_be_cancelled() {
    let folder = tree(1);
    let progress = Progress::new();
    progress.clone().cancel();
    assert!(progress.is_cancelled());
    assert!(matches!(Dataset::open(folder.path(), &progress), Err(DatasetError::Cancelled)));
    let (job, _woken) = start(folder.path(), None);
    let told = job.progress().clone();
    drop(job);
    assert!(told.is_cancelled(), "a job that nobody holds stops");
}
