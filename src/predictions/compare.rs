//! How far a source is from the truth, from the fit, or from another source: over the joints that both have, people paired best.

use super::source::{PredictedFrame, Predictions};
use crate::diagnose::{JointErrors, joint_errors, paired_joint_distances_mm};
use crate::geometry::Vec3;

/// What one frame of a source says against another set of joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// MAJPE, PA-MAJPE and OSPA, mm.
    pub errors: JointErrors,
    /// Persons of the source, and of what it is compared with.
    pub persons: [usize; 2],
    /// Mean distance of each joint over the pairs of people, mm, by joint of the data set's skeleton; joints that are not known are not
    /// listed.
    pub joints_mm: Vec<(usize, f64)>,
}

/// A source's frame against joints of all the data set's skeleton: truth or a fit. `None` where one of them shows nobody.
pub fn compare_with_truth(
    source: &Predictions,
    frame: &PredictedFrame,
    truth: &[Vec3],
    joints: usize,
) -> Option<Comparison> {
    if joints == 0 || !truth.len().is_multiple_of(joints) {
        return None;
    }
    let known = &source.map.known;
    let picked: Vec<Vec3> =
        truth.chunks_exact(joints).flat_map(|person| known.iter().map(|&joint| person[joint])).collect();
    of_lists(&frame.joints, &picked, known)
}

/// Two sources on one frame, over the joints that both know.
pub fn compare(a: (&Predictions, &PredictedFrame), b: (&Predictions, &PredictedFrame)) -> Option<Comparison> {
    let shared: Vec<usize> = a.0.map.known.iter().copied().filter(|joint| b.0.map.known.contains(joint)).collect();
    let pick = |(source, frame): (&Predictions, &PredictedFrame)| -> Vec<Vec3> {
        let own = source.map.known.len();
        let places: Vec<usize> =
            shared.iter().filter_map(|joint| source.map.known.iter().position(|k| k == joint)).collect();
        frame
            .joints
            .chunks_exact(own.max(1))
            .flat_map(|person| places.iter().map(|&at| person[at]).collect::<Vec<_>>())
            .collect()
    };
    of_lists(&pick(a), &pick(b), &shared)
}

fn of_lists(estimate: &[Vec3], truth: &[Vec3], known: &[usize]) -> Option<Comparison> {
    let errors = joint_errors(estimate, truth, known.len())?;
    let distances = paired_joint_distances_mm(estimate, truth, known.len());
    let persons = [estimate.len() / known.len(), truth.len() / known.len()];
    Some(Comparison { errors, persons, joints_mm: known.iter().copied().zip(distances).collect() })
}

/// Means over frames.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SourceMeans {
    /// Frames that count.
    pub frames: usize,
    /// Frames with as many persons as the truth.
    pub count_matched: usize,
    majpe_mm: f64,
    pa_majpe_mm: f64,
    ospa_mm: f64,
    joints: std::collections::BTreeMap<usize, (f64, usize)>,
}

impl SourceMeans {
    /// Takes a frame in.
    pub fn add(&mut self, of: &Comparison) {
        self.frames += 1;
        self.count_matched += usize::from(of.persons[0] == of.persons[1]);
        self.majpe_mm += of.errors.majpe_mm;
        self.pa_majpe_mm += of.errors.pa_majpe_mm;
        self.ospa_mm += of.errors.ospa_mm;
        for &(joint, mm) in &of.joints_mm {
            let sum = self.joints.entry(joint).or_default();
            *sum = (sum.0 + mm, sum.1 + 1);
        }
    }

    /// Means of the errors, mm; `None` without frames.
    pub fn errors(&self) -> Option<JointErrors> {
        let n = self.frames as f64;
        let errors =
            JointErrors { majpe_mm: self.majpe_mm / n, pa_majpe_mm: self.pa_majpe_mm / n, ospa_mm: self.ospa_mm / n };
        (self.frames > 0).then_some(errors)
    }

    /// Mean error of a joint of the data set's skeleton, mm.
    pub fn joint_mm(&self, joint: usize) -> Option<f64> {
        self.joints.get(&joint).map(|(sum, n)| sum / *n as f64)
    }
}
