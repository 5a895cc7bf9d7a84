//! Limbs as simulated people have taught, on the bundled samples: none of them was learned from.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use mhp_inspector::body::Pppr;
use mhp_inspector::config::{FitConfig, Limbs, Parameterization, Preset};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::diagnose::{majpe_mm, pa_majpe_mm};
use mhp_inspector::geometry::{Vec3, norm, sub};
use mhp_inspector::mhp::Problem;
use mhp_inspector::start::{find_start, problem_of};
use mhp_inspector::task::Progress;
use std::path::Path;
use std::sync::Arc;

fn sample(name: &str) -> Dataset {
    Dataset::open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("samples").join(name), &Progress::new()).unwrap()
}

fn joints(params: &Pppr) -> Vec<Vec3> {
    (0..params.shape().total_joints()).map(|joint| params.position(joint)).collect()
}

/// The start with the limbs of the posture, and with those that are learned.
fn starts(problem: &Arc<Problem>) -> [Vec<Vec3>; 2] {
    [Limbs::Posture, Limbs::Learned].map(|limbs| {
        let config = FitConfig {
            limbs,
            people: 1,
            parameterization: Parameterization::Bones,
            starts: 9,
            w_time: 8.0,
            ..Preset::Recommended.config()
        };
        joints(&find_start(problem, &config).unwrap().initialisation.params)
    })
}

#[test]
fn what_is_learned_brings_the_start_nearer_to_the_truth_and_keeps_the_bones() {
    for (name, every) in [("walk", 4), ("f1", 2), ("f4", 2), ("generic", 1), ("hupr", 1)] {
        let dataset = sample(name);
        let mut sums = [[0.0; 2]; 2];
        for index in (0..dataset.len()).step_by(every) {
            let frame = dataset.load(index).unwrap();
            let problem = Arc::new(problem_of(&dataset, &frame).unwrap());
            let truth = &frame.truth.as_ref().unwrap().joints;
            let both = starts(&problem);
            for (sums, start) in sums.iter_mut().zip(&both) {
                sums[0] += majpe_mm(start, truth).unwrap();
                sums[1] += pa_majpe_mm(start, truth).unwrap();
            }
            let skeleton = &problem.skeleton;
            for (&[m, n], want) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
                let length = norm(sub(both[1][m], both[1][n]));
                assert!((length - want).abs() < 0.03, "{name} {index}: bone {m}-{n} is {length:.3} m, not {want:.3}");
            }
            assert_ne!(both[0], both[1], "{name} {index}");
        }
        let frames = dataset.len().div_ceil(every) as f64;
        let [posture, learned] = sums.map(|sums| sums.map(|sum| sum / frames));
        println!("{name}: {frames} frames, MAJPE and PA-MAJPE {posture:.0?} -> {learned:.0?} mm");
        // The others have one frame or two: enough to see that all goes well, not that it is worth it.
        assert!(name != "walk" || learned[0] < 0.9 * posture[0] && learned[1] < posture[1]);
    }
}

/// Somebody near is lit where the limbs are looked for.
#[test]
fn two_people_side_by_side_keep_their_postures() {
    let dataset = sample("f3");
    let frame = dataset.load(0).unwrap();
    let problem = Arc::new(problem_of(&dataset, &frame).unwrap());
    let [posture, learned] = [Limbs::Posture, Limbs::Learned].map(|limbs| {
        // A search in a space of motion would move the limbs.
        let parameterization = Parameterization::Bones;
        let config = FitConfig { limbs, people: 2, parameterization, ..Preset::Recommended.config() };
        find_start(&problem, &config).unwrap().initialisation
    });
    assert_eq!(posture.params, learned.params);
    assert!(learned.notes.iter().any(|note| note.contains("nothing learned applies here")), "{:?}", learned.notes);
}

#[test]
fn where_no_view_tells_heights_the_posture_stays() {
    let dataset = sample("xrf55");
    let frame = dataset.load(0).unwrap();
    let [posture, learned] = starts(&Arc::new(problem_of(&dataset, &frame).unwrap()));
    assert_eq!(posture, learned);
}
