//! What single precision allocates: nothing in an iteration once its buffers have grown, and on a grid of any shape bytes that
//! its cells are worth.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use cap::Cap;
use std::alloc::System;

#[path = "common/cases.rs"]
mod cases;
mod common;
#[path = "common/reading.rs"]
mod reading;

use cases::Case;
use mhp_inspector::config::{EmRegion, FitConfig, Parameterization};
use mhp_inspector::mhp::{Fitter, Precision, Problem, simulate};
use mhp_inspector::radar::{Axis, AxisKind, Spacing};
use reading::case_folders;
use std::sync::Arc;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// One test, for the counter is the whole process's.
#[test]
fn what_single_precision_allocates() {
    steady_iterations_allocate_nothing();
    a_grid_of_any_shape_takes_what_its_cells_are_worth();
}

/// Iterations in which buffers grow: a body that goes on moving still meets more of a tile than before.
const WARM_UP: usize = 60;

fn steady_iterations_allocate_nothing() {
    for folder in case_folders() {
        for parameterization in [Parameterization::default(), Parameterization::Bones, Parameterization::Motion] {
            let Case { problem, mut config, params } = Case::open(&folder);
            config.parameterization = parameterization;
            let mut fitter = Fitter::new(Arc::new(problem), config, Precision::F32, params).unwrap();
            for _ in 0..WARM_UP {
                fitter.step().unwrap();
            }
            let before = ALLOCATOR.total_allocated();
            for _ in 0..50 {
                fitter.step().unwrap();
            }
            let bytes = ALLOCATOR.total_allocated() - before;
            assert_eq!(bytes, 0, "{}: {parameterization:?}", folder.display());
        }
    }
}

/// A view of so many cells a spatial axis, around the person of a case.
fn grid(case: &Case, kinds: &[AxisKind], bins: &[usize]) -> Problem {
    let (radar, skeleton) = (case.problem.radar.clone(), case.problem.skeleton.clone());
    let ends = |kind: AxisKind| if kind == AxisKind::Range { [0.0, 8.0] } else { [-1.0, 1.0] };
    let axis = |(&kind, &bins): (&AxisKind, &usize)| {
        let [lo, hi] = ends(kind);
        Axis { kind, bins, lo, hi, spacing: Spacing::Linear }
    };
    let mut view = case.problem.views[0].clone();
    (view.axes, view.region) = (kinds.iter().zip(bins).map(axis).collect(), None);
    let map: Vec<f64> = (0..view.cells()).map(|cell| 1.0 + (cell * 7 % 13) as f64).collect();
    Problem::new(radar, skeleton, vec![view], &[&map]).unwrap()
}

/// Blocks of tiles are made for maps that are wide both ways: on 100000 × 1 cells they took gigabytes, and as much time.
fn a_grid_of_any_shape_takes_what_its_cells_are_worth() {
    let case = Case::open(&case_folders().into_iter().find(|folder| folder.ends_with("polar-two-views")).unwrap());
    let polar = [AxisKind::Range, AxisKind::Azimuth, AxisKind::Elevation];
    let grids: [&[usize]; 8] = [
        &[100_000, 1],
        &[1, 100_000],
        &[50_000, 3],
        &[1, 1],
        &[3, 2],
        &[1, 1, 50_000],
        &[50_000, 1, 1],
        &[300, 1, 300],
    ];
    for bins in grids {
        let problem = Arc::new(grid(&case, &polar[..bins.len()], bins));
        let cells: usize = bins.iter().product();
        let config = FitConfig { em_region: EmRegion::Full, ..case.config };
        let mut took = [Precision::F64, Precision::F32].map(|precision| {
            let before = ALLOCATOR.total_allocated();
            let maps = simulate(&problem, &config, precision, &case.params);
            let mut fitter = Fitter::new(Arc::clone(&problem), config, precision, case.params.clone()).unwrap();
            let report = fitter.step().unwrap();
            (ALLOCATOR.total_allocated() - before, maps, report.loss)
        });
        let [(f64_bytes, f64_maps, f64_loss), (f32_bytes, f32_maps, f32_loss)] = &mut took;
        println!("{bins:?}: {f64_bytes} bytes in f64, {f32_bytes} in f32");
        assert!(*f32_bytes < 1500 * cells + (4 << 20), "{bins:?}: {f32_bytes} bytes for {cells} cells");
        assert!((*f64_loss - *f32_loss).abs() < 1e-4, "{bins:?}: {f64_loss} {f32_loss}");
        let largest = f64_maps[0].iter().copied().fold(0.0, f64::max);
        for (cell, (a, b)) in f64_maps[0].iter().zip(&f32_maps[0]).enumerate() {
            assert!((a - b).abs() <= 1e-4 * largest, "{bins:?}: cell {cell}: {a} {b}");
        }
    }
}
