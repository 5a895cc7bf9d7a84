//! The whole answer: what is on disk, what has to be read, and the ranking.

use super::super::StudyError;
use super::cache::{CacheFile, CachedStatistics};
use super::plan::{Sequences, chunk_length, chunks};
use super::scan::{Scanned, scan};
use super::stamps::{Key, keys};
use super::{Complexity, ComplexityOptions, MeasuredFrame, Statistics, rank};
use crate::dataset::Dataset;
use crate::task::Progress;
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

/// What was measured is on disk after this time at the latest, so that a scan of hours that is killed goes on there.
const CHECKPOINT: Duration = Duration::from_secs(20);

/// The complexity of every frame of a data set. `cache` is the folder of kept statistics ([`super::cache_folder`]); with
/// it only frames are read whose files, or those of the T − 1 frames before them, have another size or time than when they
/// were measured. Progress counts frames. On cancel what was measured is kept.
///
/// # Errors
/// Where an option is out of range, there is no thread, or on cancel. A frame that cannot be read is none: it is listed in
/// [`Complexity::failures`].
pub fn compute(
    dataset: &Dataset,
    options: &ComplexityOptions,
    cache: Option<&Path>,
    progress: &Progress,
) -> Result<Complexity, StudyError> {
    compute_telling(dataset, options, cache, progress, |_| {})
}

/// As [`compute`], of `frames` alone and without ranks: those before them are read for what stays.
///
/// # Errors
/// As [`compute`].
pub fn measure(
    dataset: &Dataset,
    frames: Range<usize>,
    options: &ComplexityOptions,
    cache: Option<&Path>,
    progress: &Progress,
) -> Result<Vec<MeasuredFrame>, StudyError> {
    let (kept, _) = measure_telling(dataset, frames.clone(), options, cache, progress, |_| {})?;
    let named = |(index, measured)| MeasuredFrame { index, frame: dataset.frame_name(index).to_owned(), measured };
    Ok(frames.zip(kept).map(named).collect())
}

/// Ranks the frames of a data set, all of them and in its order: statistics, or why there are none.
pub fn ranked(options: ComplexityOptions, frames: impl IntoIterator<Item = Result<Statistics, String>>) -> Complexity {
    let (mut statistics, mut failures) = (Vec::new(), Vec::new());
    for (i, measured) in frames.into_iter().enumerate() {
        statistics.push(measured.as_ref().ok().copied());
        failures.extend(measured.err().map(|why| (i, why)));
    }
    Complexity { failures, ..rank(options, &statistics) }
}

/// As [`compute`]; `told` is called with every frame that was read.
fn compute_telling(
    dataset: &Dataset,
    options: &ComplexityOptions,
    cache: Option<&Path>,
    progress: &Progress,
    told: impl FnMut(usize),
) -> Result<Complexity, StudyError> {
    let (kept, scanned) = measure_telling(dataset, 0..dataset.len(), options, cache, progress, told)?;
    Ok(Complexity { scanned, ..ranked(*options, kept) })
}

/// What is known of each of `frames`, and how many of them were read for it.
fn measure_telling(
    dataset: &Dataset,
    wanted: Range<usize>,
    options: &ComplexityOptions,
    cache: Option<&Path>,
    progress: &Progress,
    mut told: impl FnMut(usize),
) -> Result<(Vec<CachedStatistics>, usize), StudyError> {
    let options = options.validated()?;
    let sequences = Sequences::of(dataset);
    let mut found = match cache {
        Some(folder) => {
            let keys = keys(dataset, &sequences, options.window, progress)?;
            Found::cached(CacheFile::new(folder, dataset, &options), keys)
        }
        None => Found::nothing(dataset.len()),
    };
    let unknown = found.unknown(&wanted);
    progress.begin("measuring maps", wanted.len() as u64);
    progress.advance((wanted.len() - unknown) as u64);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let length = chunk_length(unknown, threads, options.window, dataset.maps_at_once());
    let chunks = chunks(&sequences, options.window, length, |i| !wanted.contains(&i) || found.is_known(i));
    scan(dataset, &options, &chunks, threads, progress, |i, scanned| {
        found.add(i, scanned);
        progress.advance(1);
        told(i);
    })?;
    found.keep();
    if found.unknown(&wanted) > 0 {
        return Err(StudyError::Cancelled);
    }
    let kept = found.frames.drain(wanted).flatten().map(|scanned| scanned.kept).collect();
    Ok((kept, unknown))
}

/// What is known so far of each frame, and where it is kept.
struct Found {
    frames: Vec<Option<Scanned>>,
    file: Option<(CacheFile, Vec<Option<Key>>)>,
    /// Something was measured that is not in the file.
    changed: bool,
    kept_at: Instant,
}

impl Found {
    fn nothing(frames: usize) -> Self {
        let frames = std::iter::repeat_with(|| None).take(frames).collect();
        Self { frames, file: None, changed: false, kept_at: Instant::now() }
    }

    fn cached(file: CacheFile, keys: Vec<Option<Key>>) -> Self {
        let kept = file.read();
        let known = |key: &Option<Key>| Some(Scanned { kept: kept.get(key.as_ref()?)?.clone(), lasting: true });
        let frames: Vec<_> = keys.iter().map(known).collect();
        let changed = frames.iter().flatten().count() != kept.len();
        Self { frames, file: Some((file, keys)), changed, kept_at: Instant::now() }
    }

    fn is_known(&self, i: usize) -> bool {
        matches!(self.frames.get(i), Some(Some(_)))
    }

    fn unknown(&self, wanted: &Range<usize>) -> usize {
        wanted.clone().filter(|&i| !self.is_known(i)).count()
    }

    fn add(&mut self, i: usize, scanned: Scanned) {
        if let Some(frame) = self.frames.get_mut(i) {
            *frame = Some(scanned);
            self.changed = true;
        }
        if self.kept_at.elapsed() > CHECKPOINT {
            self.keep();
        }
    }

    /// Writes the file where it would say something new. Where nothing is known any more (the disk is gone) the old one
    /// stays.
    fn keep(&mut self) {
        let Some((file, keys)) = self.file.as_ref().filter(|_| self.changed) else { return };
        let lasting = |frame: &Option<Scanned>| frame.as_ref().is_some_and(|scanned| scanned.lasting);
        if self.frames.iter().any(lasting) {
            let rows = self.frames.iter().zip(keys).filter(|(frame, _)| lasting(frame));
            file.write(rows.filter_map(|(frame, key)| Some(((*key)?, &frame.as_ref()?.kept))));
        }
        self.changed = false;
        self.kept_at = Instant::now();
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests fail by panicking")]
mod tests {
    use super::super::cached_share;
    use super::*;
    use crate::dataset::npz::{ArrayView, write};

    const FRAMES: usize = 400;
    const MANIFEST: &str = "layout = \"npz\"\nframes = \"*.npz\"\nskeleton = \"coco17\"\n[[view]]\narray = \"hm\"\n\
        psf = { range_m = 0.1, azimuth_rad = 0.1, elevation_rad = 0.0, doppler_mps = 0.1 }\n\
        axes = [ { kind = \"depth_h\", bins = 4, lo = 4.0, hi = 0.0 }, { kind = \"y\", bins = 5, lo = 2.0, hi = -2.0 } ]";

    #[test]
    fn a_cancelled_scan_goes_on_where_it_stopped() {
        let (folder, home) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        std::fs::write(folder.path().join("dataset.toml"), MANIFEST).unwrap();
        for k in 0..FRAMES {
            let map: Vec<f64> = (0..20).map(|cell| ((cell * 7 + k * 13) % 31) as f64).collect();
            let file = folder.path().join(format!("{k:04}.npz"));
            write(&file, &[("hm", ArrayView::f64(&[4, 5], &map))]).unwrap();
        }
        let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
        let (options, cache) = (ComplexityOptions::default(), Some(home.path()));
        let (progress, mut seen) = (Progress::new(), 0);
        let cancelled = compute_telling(&dataset, &options, cache, &progress, |_| {
            seen += 1;
            if seen == 100 {
                progress.cancel();
            }
        });
        assert!(matches!(cancelled, Err(StudyError::Cancelled)), "few results wait, so that the threads stop soon");
        assert!((100..FRAMES).contains(&seen), "{seen}");
        let kept = cached_share(&dataset, &options, cache) * FRAMES as f64;
        assert_eq!(kept.round() as usize, seen, "all that was measured is kept");
        let mut read = 0;
        let resumed = compute_telling(&dataset, &options, cache, &Progress::new(), |_| read += 1).unwrap();
        assert_eq!((resumed.scanned, read), (FRAMES - seen, FRAMES - seen));
        assert_eq!(resumed.frames, compute(&dataset, &options, None, &Progress::new()).unwrap().frames);
    }
}
