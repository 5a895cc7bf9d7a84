//! `compute` against the other implementation and the committed answers of numpy, to 1e-12.

use super::naive::{self, Row};
use super::sets::{SHAPES, Set, cells, file, open};
use mhp_inspector::dataset::npz::{ArrayView, write_npy};
use mhp_inspector::dataset::{Dataset, Manifest, OpenOptions};
use mhp_inspector::study::StudyError;
use mhp_inspector::study::complexity::{Complexity, ComplexityOptions, Stratum, compute};
use mhp_inspector::task::Progress;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn computed(dataset: &Dataset, options: &ComplexityOptions) -> Complexity {
    compute(dataset, options, None, &Progress::new()).unwrap()
}

fn close(a: Option<f64>, b: Option<f64>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= 1e-12,
        (a, b) => a == b,
    }
}

fn assert_same(complexity: &Complexity, wanted: &[Option<Row>], what: &str) {
    assert_eq!(complexity.frames.len(), wanted.len(), "{what}");
    for (i, (got, want)) in complexity.frames.iter().zip(wanted).enumerate() {
        let got: Option<Row> = got.map(|frame| {
            let s = frame.statistics;
            let statistics = [s.peak_density, s.static_dominance, s.human_saliency];
            (statistics, frame.hardness, frame.stratum.map(Stratum::word))
        });
        let same = match (&got, want) {
            (Some(got), Some(want)) => {
                got.0.iter().zip(want.0).all(|(a, b)| close(*a, b)) && close(got.1, want.1) && got.2 == want.2
            }
            (got, want) => got.is_none() && want.is_none(),
        };
        assert!(same, "{what}: frame {i}: {got:?}, expected {want:?}");
    }
    let counts = complexity.counts;
    assert_eq!(counts.easy + counts.medium + counts.hard + counts.unranked + counts.failed, wanted.len());
    assert_eq!(counts.failed, complexity.failures.len());
}

fn assert_naive(set: &Set, options: &ComplexityOptions, what: &str) -> Complexity {
    let folder = set.folder();
    let complexity = computed(&open(folder.path()), options);
    assert_same(&complexity, &naive::complexity(&set.frames(), &SHAPES[..set.views], options), what);
    complexity
}

#[test]
fn generated_sets_of_every_shape_agree() {
    let default = ComplexityOptions::default();
    for lengths in [&[1][..], &[2], &[4], &[5], &[6], &[1, 1, 1], &[3, 7, 4], &[12, 1, 9], &[30]] {
        for views in [1, 2] {
            assert_naive(&Set::mixed(lengths, views), &default, &format!("{lengths:?}, {views} views"));
        }
    }
    let set = Set::mixed(&[9, 14], 2);
    for (kappa_pct, window, tau_pct) in [(20.0, 1, 30.0), (99.9, 2, 0.1), (0.1, 3, 99.9), (50.0, 14, 50.0)] {
        let options = ComplexityOptions { kappa_pct, window, tau_pct };
        assert_naive(&set, &options, &format!("{options:?}"));
    }
}

#[test]
fn a_sequence_shorter_than_the_window_has_no_static_dominance() {
    let complexity = assert_naive(&Set::mixed(&[4, 6], 2), &ComplexityOptions::default(), "4 and 6");
    let defined = |i: usize| complexity.frame(i).unwrap().statistics.static_dominance.is_some();
    assert_eq!((0..10).filter(|&i| defined(i)).collect::<Vec<_>>(), [8, 9]);
    assert!(complexity.frames.iter().all(|frame| frame.unwrap().hardness.is_some()));
}

#[test]
fn one_frame_alone_has_no_rank() {
    let complexity = assert_naive(&Set::mixed(&[1], 2), &ComplexityOptions::default(), "one");
    let frame = complexity.frame(0).unwrap();
    assert_eq!((frame.hardness, frame.stratum, complexity.counts.unranked), (None, None, 1));
    assert!(frame.statistics.peak_density.is_some());
}

#[test]
fn constant_and_empty_maps_are_undefined_where_they_should_be() {
    let mut set = Set::mixed(&[12], 2);
    set.sequences[0][3] = [vec![2.5; cells(0)], vec![2.5; cells(1)]];
    set.sequences[0][6] = [vec![0.0; cells(0)], vec![0.0; cells(1)]];
    set.sequences[0][9][0] = vec![0.0; cells(0)];
    let complexity = assert_naive(&set, &ComplexityOptions::default(), "constant maps");
    let statistics = |i: usize| complexity.frame(i).unwrap().statistics;
    assert_eq!((statistics(3).peak_density, statistics(3).human_saliency), (Some(0.0), Some(0.0)));
    assert_eq!((statistics(6).static_dominance, statistics(6).human_saliency), (None, None), "no bin, no sum");
    assert!(statistics(9).human_saliency.is_some(), "the other view has one");
    assert_eq!(statistics(7).static_dominance, Some(0.0), "nothing was strong in frame 6");
    let every = Set { sequences: vec![vec![[vec![0.0; cells(0)], vec![0.0; cells(1)]]; 7]], views: 2 };
    let complexity = assert_naive(&every, &ComplexityOptions::default(), "nothing but zeros");
    assert_eq!((complexity.counts.easy, complexity.frame(0).unwrap().hardness), (7, Some(0.5)), "all tie");
}

#[test]
fn a_damaged_file_and_a_map_of_nan_are_told_and_the_others_go_on() {
    let mut set = Set::mixed(&[14, 5], 2);
    set.sequences[0][11][1] = vec![f64::NAN; cells(1)];
    let folder = set.folder();
    std::fs::write(file(folder.path(), 0, 4), b"PK damaged").unwrap();
    let dataset = open(folder.path());
    let complexity = computed(&dataset, &ComplexityOptions::default());
    let mut frames = set.frames();
    (frames[4], frames[11]) = (None, None);
    assert_same(&complexity, &naive::complexity(&frames, &SHAPES, &ComplexityOptions::default()), "damaged");
    assert_eq!(complexity.failures.iter().map(|f| f.0).collect::<Vec<_>>(), [4, 11]);
    assert!(complexity.failure(4).unwrap().contains("004.npz: truncated or damaged"), "{:?}", complexity.failures);
    assert!(complexity.failure(11).unwrap().contains("011.npz: array `cube` has no finite cell"));
    assert_eq!((complexity.failure(5), complexity.frame(4), complexity.frame(99)), (None, None, None));
    let statics = |i: usize| complexity.frame(i).is_some_and(|f| f.statistics.static_dominance.is_some());
    assert_eq!((0..19).filter(|&i| statics(i)).collect::<Vec<_>>(), [9, 10, 18]);
}

#[test]
fn a_stacked_file_is_one_sequence() {
    let set = Set::mixed(&[23], 1);
    let folder = tempfile::tempdir().unwrap();
    let written = set.folder();
    let manifest = Manifest::from_file(&written.path().join("dataset.toml")).unwrap();
    let stack: Vec<f64> = set.sequences[0].iter().flat_map(|maps| maps[0].iter().copied()).collect();
    let path = folder.path().join("stack.npy");
    write_npy(&path, &ArrayView::f64(&[23, 9, 8], &stack)).unwrap();
    let text = std::fs::read_to_string(&manifest.path).unwrap().replace("\"plane\"", "\"array\"");
    let manifest = Manifest::parse(&text, Path::new("stack.toml")).unwrap();
    let dataset = Dataset::open_with(
        &path,
        OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() },
        &Progress::new(),
    )
    .unwrap();
    let complexity = computed(&dataset, &ComplexityOptions::default());
    let wanted = naive::complexity(&set.frames(), &SHAPES[..1], &ComplexityOptions::default());
    assert_same(&complexity, &wanted, "stacked");
}

/// What of a stacked file cannot be used fails frame by frame, although many are read at once.
#[test]
fn frames_of_a_stacked_file_fail_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(Set::mixed(&[1], 1).folder().path().join("dataset.toml")).unwrap();
    let manifest = Manifest::parse(&text.replace("\"plane\"", "\"array\""), Path::new("stack.toml")).unwrap();
    let path = folder.path().join("stack.npy");
    let mut stack: Vec<f64> = (0..7 * 72).map(|i| f64::from(i * i % 101)).collect();
    stack[3 * 72..4 * 72].fill(f64::NAN);
    write_npy(&path, &ArrayView::f64(&[7, 9, 8], &stack)).unwrap();
    let dataset = Dataset::open_with(
        &path,
        OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() },
        &Progress::new(),
    )
    .unwrap();
    let complexity = computed(&dataset, &ComplexityOptions::default());
    assert_eq!(complexity.failures.iter().map(|f| f.0).collect::<Vec<_>>(), [3]);
    assert!(complexity.failures[0].1.contains("stack.npy: array `array` has no finite cell"));
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 8]).unwrap();
    let complexity = computed(&dataset, &ComplexityOptions::default());
    assert_eq!((complexity.counts.failed, complexity.frames.len()), (7, 7));
    assert!(complexity.failures.iter().all(|f| f.1.contains("stack.npy: array `array`")), "{:?}", complexity.failures);
}

fn reference(name: &str) -> Vec<Option<Row>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/reference/complexity").join(name);
    let rows: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let row = |row: &Value| {
        let number = |key: &str| row[key].as_f64();
        let stratum = ["easy", "medium", "hard"].into_iter().find(|word| row["stratum"] == *word);
        let statistics = ["peak_density", "static_dominance", "human_saliency"].map(number);
        Some((statistics, number("hardness"), stratum))
    };
    rows.iter().map(row).collect()
}

/// `walk.json` is numpy 2.4 on the bundled sample: `np.percentile`, comparisons with all shifts of a map padded by −∞,
/// `np.sum`, average ranks from `np.unique`, `np.percentile(hardness, [100/3, 200/3])`.
#[test]
fn the_bundled_sample_agrees_with_numpy() {
    let dataset = open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk"));
    assert_same(&computed(&dataset, &ComplexityOptions::default()), &reference("walk.json"), "walk");
}

/// `mixed.json` is the same program on `Set::mixed(&[7, 3, 11], 2)`, and `mixed-20-3-40.json` with κ = 20, T = 3, τ = 40.
#[test]
fn a_set_with_ties_and_holes_agrees_with_numpy() {
    let folder = Set::mixed(&[7, 3, 11], 2).folder();
    let dataset = open(folder.path());
    assert_same(&computed(&dataset, &ComplexityOptions::default()), &reference("mixed.json"), "mixed");
    let options = ComplexityOptions { kappa_pct: 20.0, window: 3, tau_pct: 40.0 };
    assert_same(&computed(&dataset, &options), &reference("mixed-20-3-40.json"), "mixed, 20, 3, 40");
}

#[test]
fn options_out_of_range_are_refused() {
    let folder = Set::mixed(&[2], 1).folder();
    let options = ComplexityOptions { window: 0, ..ComplexityOptions::default() };
    let refused = compute(&open(folder.path()), &options, None, &Progress::new());
    assert!(matches!(refused, Err(StudyError::Setting { key: "window", .. })));
}
