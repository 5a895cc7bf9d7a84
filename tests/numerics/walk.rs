//! The start pose on the bundled walk, whose truth is known and whose maps come from a synthesiser, not from the
//! forward model.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use mhp_inspector::body::Group;
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::diagnose::joint_errors;
use mhp_inspector::geometry::{Vec3, add, scale, sub};
use mhp_inspector::mhp::initialise;
use mhp_inspector::start::problem_alone;
use mhp_inspector::task::Progress;
use std::path::Path;
use std::sync::Arc;

fn centroid(joints: &[Vec3]) -> Vec3 {
    scale(joints.iter().fold([0.0; 3], |sum, &p| add(sum, p)), 1.0 / joints.len() as f64)
}

#[test]
fn starts_near_the_walker() {
    let dataset = Dataset::open(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/samples/walk")), &Progress::new());
    let dataset = dataset.unwrap();
    let info = dataset.info();
    let (mut across, mut up, mut majpe) = (0.0, 0.0, 0.0);
    for index in 0..dataset.len() {
        let frame = dataset.load(index).unwrap();
        let problem = Arc::new(problem_alone(&dataset, &frame).unwrap());
        let start = initialise(&problem, &FitConfig::default()).unwrap();
        let found: Vec<Vec3> =
            start.params.group(Group::Position).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        let truth = frame.truth.unwrap().joints;
        let miss = sub(centroid(&found), centroid(&truth));
        let errors = joint_errors(&found, &truth, info.skeleton.joints.len()).unwrap();
        println!("frame {index}: {miss:.2?} m, MAJPE {:.0} mm; {:?}", errors.majpe_mm, start.notes);
        let count = dataset.len() as f64;
        across += miss[0].hypot(miss[1]) / count;
        up += miss[2].abs() / count;
        majpe += errors.majpe_mm / count;
    }
    println!("mean: {across:.3} m across, {up:.3} m up, MAJPE {majpe:.0} mm");
    assert!(across < 0.25 && up < 0.25, "{across:.3} m across, {up:.3} m up");
}
