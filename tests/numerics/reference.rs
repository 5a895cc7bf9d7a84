//! Every folder of reference cases, at the tolerances that its README states, in both precisions.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use crate::cases::Case;
use crate::reading::{case_folders, read};
use mhp_inspector::body::{Group, Pppr};
use mhp_inspector::mhp::{Evaluation, Objective, Precision, masks, simulate};
use std::path::Path;
use std::sync::Arc;

/// |got − want| at most; from the README of the cases.
struct Tolerance {
    /// Of the map's maximum.
    map: f64,
    /// Relative, or absolute.
    loss: (f64, f64),
    /// IoU: absolute, or this many cells of the union.
    iou_cells: f64,
    /// Of the group's largest entry, or absolute.
    gradient: (f64, f64),
}

const F64: Tolerance = Tolerance { map: 1e-9, loss: (1e-9, 1e-12), iou_cells: 0.0, gradient: (1e-8, 1e-12) };
const F32: Tolerance = Tolerance { map: 2e-4, loss: (1e-4, 1e-6), iou_cells: 2.0, gradient: (2e-3, 1e-6) };

fn close(what: &str, got: &[f64], want: &[f64], relative_to_largest: f64, absolute: f64) {
    assert_eq!(got.len(), want.len(), "{what}: number of entries");
    let largest = want.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let worst = got.iter().zip(want).map(|(g, w)| (g - w).abs()).fold(0.0, f64::max);
    assert!(got.iter().all(|x| x.is_finite()), "{what}: not finite");
    let limit = (relative_to_largest * largest).max(absolute);
    assert!(worst <= limit, "{what}: off by {worst:.3e}, at most {limit:.3e} of {largest:.3e}");
}

fn check_case(folder: &Path, precision: Precision, tolerance: &Tolerance) {
    let name = folder.file_name().unwrap().to_string_lossy().into_owned();
    let case = Case::open(folder);
    let want = |key: &str| read(&folder.join("expected.npz"), key);
    let problem = Arc::new(case.problem);

    let maps = simulate(&problem, &case.config, precision, &case.params);
    let mut objective = Objective::new(Arc::clone(&problem), case.config, precision, &case.params).unwrap();
    let evaluation = objective.evaluate(&case.params);
    for (view, map) in maps.iter().enumerate() {
        let array = &problem.views[view].array;
        close(&format!("{name}: sim_{array}"), map, &want(&format!("sim_{array}")), tolerance.map, 0.0);
        check_iou(&name, &objective, view, map, &evaluation, want(&format!("iou_{array}"))[0], tolerance);
    }
    // The cases know no frames around, and their weights of L_time, L_prior, L_net and L_given are 0.
    let terms = evaluation
        .terms
        .iter()
        .filter(|(term, _)| !["time", "prior", "net", "given"].contains(&term.key))
        .map(|(term, value)| (term.key, value));
    for (key, got) in terms.chain([("loss", evaluation.loss)]) {
        close(&format!("{name}: {key}"), &[got], &want(key), tolerance.loss.0, tolerance.loss.1);
    }
    let gradients: [(&str, &Pppr); 2] = [("grad", &evaluation.gradient), ("grad_em", evaluation.em_gradient())];
    for (prefix, gradient) in gradients {
        for group in Group::ALL {
            let key = format!("{prefix}_{}", group.key());
            let (relative, absolute) = tolerance.gradient;
            close(&format!("{name}: {key}"), gradient.group(group), &want(&key), relative, absolute);
        }
    }
}

fn check_iou(
    name: &str,
    objective: &Objective,
    view: usize,
    map: &[f64],
    evaluation: &Evaluation,
    want: f64,
    tolerance: &Tolerance,
) {
    let masks = masks(objective, view, map);
    let union = masks.ori.iter().zip(&masks.sim).filter(|(a, b)| **a || **b).count().max(1);
    let limit = (tolerance.iou_cells / union as f64).max(1e-9);
    for got in [evaluation.iou[view], masks.iou()] {
        assert!((got.unwrap() - want).abs() <= limit, "{name}: IoU of view {view}: {got:?}, expected {want}");
    }
}

#[test]
fn f64_agrees_with_every_case() {
    for folder in case_folders() {
        check_case(&folder, Precision::F64, &F64);
    }
}

#[test]
fn f32_agrees_with_every_case() {
    for folder in case_folders() {
        check_case(&folder, Precision::F32, &F32);
    }
}
