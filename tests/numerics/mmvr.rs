//! The real MMVR frame: start from the maps alone, fit, and end where the issue asks.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use crate::common;
use mhp_inspector::body::{Group, Pppr};
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::{Dataset, Frame};
use mhp_inspector::mhp::{Fitter, Initialisation, Precision, Problem, StepReport, initialise};
use mhp_inspector::start::problem_alone;
use mhp_inspector::task::Progress;
use std::sync::Arc;

fn frame() -> Option<(Arc<Problem>, Frame)> {
    let path = common::shared()?.join("data/mmvr/00383_radar.npz");
    let dataset = Dataset::open(&path, &Progress::new()).unwrap();
    let frame = dataset.load(dataset.start_index()).unwrap();
    let problem = Arc::new(problem_alone(&dataset, &frame).unwrap());
    Some((problem, frame))
}

/// (row, column) of a joint on each of MMVR's two maps; the axes are as the notes on data sets measured them.
fn cells(p: [f64; 3]) -> [[f64; 2]; 2] {
    let row = |depth: f64| (8.0 - depth) / (8.0 / 256.0) - 0.5;
    let column = |across: f64, lo: f64| (across - lo) / (5.0 / 128.0) - 0.5;
    [[row(p[0].hypot(p[2])), column(-p[1], -1.0)], [row(p[0].hypot(p[1])), column(p[2], -2.0)]]
}

fn run(problem: &Arc<Problem>, config: &FitConfig, start: &Pppr) -> StepReport {
    let mut fitter = Fitter::new(Arc::clone(problem), *config, Precision::F64, start.clone()).unwrap();
    for _ in 0..config.iterations {
        fitter.step().unwrap();
    }
    assert!(fitter.params().is_finite());
    fitter.report()
}

#[test]
fn starts_within_the_labelled_boxes_and_reaches_the_asked_iou() {
    let Some((problem, frame)) = frame() else { return };
    let config = FitConfig::default();
    let clock = std::time::Instant::now();
    let Initialisation { params, notes, .. } = initialise(&problem, &config).unwrap();
    println!("init {:.0} ms: {notes:?}", clock.elapsed().as_secs_f64() * 1e3);
    let joints: Vec<[[f64; 2]; 2]> =
        params.group(Group::Position).chunks_exact(3).map(|p| cells([p[0], p[1], p[2]])).collect();
    println!("start {:.2?}", params.position(0));
    for (view, boxes) in frame.map_boxes.iter().enumerate() {
        for axis in 0..2 {
            for joint in &joints {
                let (at, lo, hi) = (joint[view][axis], boxes[0][axis], boxes[0][axis + 2]);
                assert!((lo..=hi).contains(&at), "view {view}, axis {axis}: {at:.1} outside {lo}..{hi}");
            }
        }
    }

    let report = run(&problem, &config, &params);
    let [hori, vert] = [report.iou[0].unwrap(), report.iou[1].unwrap()];
    println!("defaults: IoU {hori:.3} {vert:.3}, loss {:.4}", report.loss);
    assert!(f64::midpoint(hori, vert) >= 0.52 && report.converged, "{report:?}");

    let report = run(&problem, &FitConfig { learning_rate: 3e-3, ..config }, &params);
    let [hori, vert] = [report.iou[0].unwrap(), report.iou[1].unwrap()];
    println!("rate 3e-3: IoU {hori:.3} {vert:.3}, loss {:.4}", report.loss);
    assert!(hori >= 0.60 && vert >= 0.55 && report.converged, "{report:?}");
}
