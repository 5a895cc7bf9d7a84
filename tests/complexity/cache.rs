//! The cache: what it saves, what makes it stale, what damages it.

use super::sets::{Set, file, open, write_frame};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::study::complexity::{Complexity, ComplexityOptions, Statistics, cached_share, compute};
use mhp_inspector::task::Progress;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// A data set and a cache folder of its own.
struct Kept {
    data: tempfile::TempDir,
    home: tempfile::TempDir,
    options: ComplexityOptions,
}

impl Kept {
    fn new(set: &Set) -> Self {
        let home = tempfile::tempdir().unwrap();
        Self { data: set.folder(), home, options: ComplexityOptions::default() }
    }

    fn root(&self) -> &Path {
        self.data.path()
    }

    fn cache(&self) -> PathBuf {
        self.home.path().join("complexity")
    }

    fn compute(&self) -> Complexity {
        let complexity = compute(&open(self.root()), &self.options, Some(&self.cache()), &Progress::new()).unwrap();
        let fresh = compute(&open(self.root()), &self.options, None, &Progress::new()).unwrap();
        assert_eq!(complexity.frames, fresh.frames, "what is kept is what would be measured");
        assert_eq!(complexity.failures, fresh.failures);
        complexity
    }

    fn share(&self) -> f64 {
        cached_share(&open(self.root()), &self.options, Some(&self.cache()))
    }

    fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<_> = std::fs::read_dir(self.cache()).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    }

    /// Another content under the same name, and a time that certainly differs.
    fn replace(&self, sequence: usize, frame: usize, seed: usize) {
        let other = Set::mixed(&[seed + 1], 2).sequences[0][seed].clone();
        let path = file(self.root(), sequence, frame);
        write_frame(&path, &other);
        touch(&path, SystemTime::now() + Duration::from_secs(seed as u64));
    }
}

fn touch(path: &Path, time: SystemTime) {
    std::fs::File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
}

#[test]
fn a_second_run_reads_no_frame() {
    let kept = Kept::new(&Set::mixed(&[9, 3, 8], 2));
    assert_eq!(kept.share(), 0.0);
    let first = kept.compute();
    assert_eq!((first.scanned, kept.share()), (20, 1.0));
    let second = kept.compute();
    assert_eq!((second.scanned, &second.frames), (0, &first.frames));

    // Nothing is read even where it would be seen: other bytes of the same length and time.
    let path = file(kept.root(), 0, 3);
    let (time, bytes) = (std::fs::metadata(&path).unwrap().modified().unwrap(), std::fs::read(&path).unwrap());
    std::fs::write(&path, vec![b'x'; bytes.len()]).unwrap();
    touch(&path, time);
    let dataset = open(kept.root());
    let third = compute(&dataset, &kept.options, Some(&kept.cache()), &Progress::new()).unwrap();
    assert_eq!((third.scanned, third.frames), (0, first.frames));
}

#[test]
fn other_options_and_other_views_are_other_files() {
    let mut kept = Kept::new(&Set::mixed(&[8], 2));
    kept.compute();
    kept.options.tau_pct = 30.0;
    assert_eq!((kept.share(), kept.compute().scanned), (0.0, 8));
    Set::mixed(&[8], 1).write(kept.root());
    assert_eq!((kept.share(), kept.compute().scanned), (0.0, 8));
    assert_eq!(kept.files().len(), 3);
}

#[test]
fn a_changed_file_gives_itself_and_the_window_after_it_anew() {
    let kept = Kept::new(&Set::mixed(&[12, 6], 2));
    kept.compute();
    kept.replace(0, 2, 30);
    assert_eq!(kept.compute().scanned, 5);
    kept.replace(0, 10, 31);
    assert_eq!(kept.compute().scanned, 2, "10 and 11: the sequence ends there");
    kept.replace(1, 0, 32);
    kept.replace(1, 1, 33);
    assert_eq!(kept.compute().scanned, 6, "two windows that overlap");
    let path = file(kept.root(), 0, 0);
    touch(&path, SystemTime::UNIX_EPOCH + Duration::from_nanos(1));
    assert_eq!(kept.compute().scanned, 5, "a time before all others is a change too");
    assert_eq!(kept.compute().scanned, 0);
}

/// A frame of HuPR is two files: the second counts too.
#[test]
fn every_file_of_a_frame_makes_it_stale() {
    let (data, home) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/hupr");
    for inside in ["dataset.toml", "single_1/hori/000000000.npy", "single_1/vert/000000000.npy"] {
        let to = data.path().join(inside);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(sample.join(inside), to).unwrap();
    }
    let scanned = || {
        let options = ComplexityOptions::default();
        compute(&open(data.path()), &options, Some(home.path()), &Progress::new()).unwrap().scanned
    };
    assert_eq!([scanned(), scanned()], [1, 0]);
    touch(&data.path().join("single_1/vert/000000000.npy"), SystemTime::now() + Duration::from_secs(5));
    assert_eq!([scanned(), scanned()], [1, 0]);
}

#[test]
fn a_removed_or_added_file_changes_the_windows_after_it_only() {
    let kept = Kept::new(&Set::mixed(&[12, 6], 2));
    kept.compute();
    let (path, aside) = (file(kept.root(), 0, 4), kept.home.path().join("aside"));
    std::fs::rename(&path, &aside).unwrap();
    assert_eq!(kept.compute().scanned, 4, "frames 5 to 8, whose index is now another");
    std::fs::rename(&aside, &path).unwrap();
    assert_eq!(kept.compute().scanned, 5, "what was dropped from the file is measured again");
    assert_eq!(kept.share(), 1.0);
}

#[test]
fn a_frame_that_cannot_be_read_is_kept_with_its_reason() {
    let kept = Kept::new(&Set::mixed(&[12], 2));
    let path = file(kept.root(), 0, 5);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, "no npz \u{2205} \"quoted\"\n").unwrap();
    let first = kept.compute();
    let second = kept.compute();
    assert_eq!((second.scanned, second.failures.len()), (0, 1));
    assert_eq!(second.failures, first.failures);
    std::fs::write(&path, bytes).unwrap();
    let third = kept.compute();
    assert_eq!((third.scanned, third.failures.len()), (5, 0));
}

/// A link to nothing: the operating system's refusal says nothing about the file's content.
#[cfg(unix)]
#[test]
fn a_failure_that_may_pass_is_not_kept() {
    let kept = Kept::new(&Set::mixed(&[12], 2));
    let path = file(kept.root(), 0, 3);
    std::fs::remove_file(&path).unwrap();
    std::os::unix::fs::symlink("nowhere", &path).unwrap();
    assert_eq!(kept.compute().failures.len(), 1);
    assert_eq!(kept.compute().scanned, 5, "the frame and those that needed it");
}

#[test]
fn a_damaged_cache_is_ignored_and_replaced() {
    let kept = Kept::new(&Set::mixed(&[9], 2));
    kept.compute();
    let path = kept.files().remove(0);
    let whole = std::fs::read(&path).unwrap();
    let flipped = |at: usize| {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x40;
        bytes
    };
    let number = kept_number(&kept).to_le_bytes();
    let middle = whole.windows(8).position(|bytes| bytes == number).unwrap();
    for bytes in [vec![], b"text".to_vec(), whole[..whole.len() / 2].to_vec(), flipped(middle)] {
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(kept.compute().scanned, 9);
        assert_eq!(kept.compute().scanned, 0);
    }
    assert_eq!(kept.files(), [path], "no temporary file stays");
}

/// A number that is in the cache file.
fn kept_number(kept: &Kept) -> f64 {
    let statistics: Statistics = kept.compute().frame(5).unwrap().statistics;
    statistics.human_saliency.unwrap()
}

#[test]
fn a_cache_that_cannot_be_written_is_no_error() {
    let kept = Kept::new(&Set::mixed(&[6], 2));
    std::fs::write(kept.cache(), "a file where the folder should be").unwrap();
    assert_eq!(kept.compute().scanned, 6);
    assert_eq!(kept.compute().scanned, 6);
    assert_eq!(kept.share(), 0.0);
}

#[test]
fn two_at_once_leave_one_whole_file() {
    let kept = Kept::new(&Set::mixed(&[40], 2));
    let dataset: Dataset = open(kept.root());
    let run = || {
        for _ in 0..8 {
            let _ = std::fs::remove_file(kept.files().first().map_or_else(PathBuf::new, Clone::clone));
            compute(&dataset, &kept.options, Some(&kept.cache()), &Progress::new()).unwrap();
        }
    };
    kept.compute();
    std::thread::scope(|scope| {
        scope.spawn(run);
        scope.spawn(run);
    });
    compute(&dataset, &kept.options, Some(&kept.cache()), &Progress::new()).unwrap();
    assert_eq!((kept.files().len(), kept.share(), kept.compute().scanned), (1, 1.0, 0));
}
