//! A prediction as the start of a fit: "refine this by the radar". Joints that the source does not have are those of a standing body,
//! turned and moved onto the ones that it has.

use super::source::{PredictedFrame, Predictions};
use crate::config::FitConfig;
use crate::dataset::Dataset;
use crate::diagnose::Similarity;
use crate::geometry::{Vec3, mean, norm, scale, sub};
use crate::mhp::{GivenStart, Problem, standing_joints, start_at};

/// Frames a second where a data set does not say.
const USUAL_RATE_HZ: f64 = 10.0;
/// Farther from one frame to the next is somebody else, m.
const MOST_APART_M: f64 = 0.6;

/// All joints of every person of a frame, person by person, m, world frame.
pub fn complete_bodies(source: &Predictions, frame: &PredictedFrame, problem: &Problem) -> Vec<Vec3> {
    let joints = problem.skeleton.joints.len();
    let known = &source.map.known;
    if known.len() == joints {
        return frame.joints.clone();
    }
    let standing = standing_joints(&problem.skeleton);
    let picked: Vec<Vec3> = known.iter().map(|&joint| standing[joint]).collect();
    let mut bodies = Vec::with_capacity(frame.persons * joints);
    for person in frame.joints.chunks_exact(known.len().max(1)) {
        let onto = Similarity::between(&picked, person);
        let mut body: Vec<Vec3> = standing.iter().map(|&p| onto.map_or(p, |onto| onto.of(p))).collect();
        for (&joint, &p) in known.iter().zip(person) {
            body[joint] = p;
        }
        bodies.extend(body);
    }
    bodies
}

/// The person of another frame who is this one; this one itself where nobody is near.
fn nearest<'a>(person: &'a [Vec3], others: &'a [Vec3]) -> &'a [Vec3] {
    let apart = |other: &&[Vec3]| norm(sub(mean(other), mean(person)));
    let near = others.chunks_exact(person.len().max(1)).min_by(|a, b| apart(a).total_cmp(&apart(b)));
    near.filter(|other| apart(other) < MOST_APART_M).unwrap_or(person)
}

/// What a fit of frame `index` begins at: the predicted joints with the Gaussians of a start; velocities by the frames
/// of the source before and after, where they show as many people. `None` where the source shows nobody there.
pub fn start_of(
    source: &Predictions,
    dataset: &Dataset,
    index: usize,
    problem: &Problem,
    config: &FitConfig,
) -> Option<GivenStart> {
    let frame = source.frame(index).filter(|frame| frame.persons > 0)?;
    let joints = complete_bodies(source, frame, problem);
    let rate_hz = dataset.info().frame_rate_hz.filter(|rate| *rate > 0.0).unwrap_or(USUAL_RATE_HZ);
    let beside = |other: Option<usize>| {
        let other =
            other.filter(|&other| other < dataset.len() && dataset.sequence(other) == dataset.sequence(index))?;
        let frame = source.frame(other).filter(|beside| beside.persons == frame.persons)?;
        Some((other, complete_bodies(source, frame, problem)))
    };
    let (before, after) = (beside(index.checked_sub(1)), beside(Some(index + 1)));
    let own = || (index, joints.clone());
    let (from, to) = (before.unwrap_or_else(own), after.unwrap_or_else(own));
    let span_s = (to.0 - from.0) as f64 / rate_hz;
    let of_person = problem.skeleton.joints.len().max(1);
    let mut velocities = Vec::with_capacity(joints.len());
    for person in joints.chunks_exact(of_person) {
        let (a, b) = (nearest(person, &from.1), nearest(person, &to.1));
        let moved = |(a, b): (&Vec3, &Vec3)| if span_s > 0.0 { scale(sub(*b, *a), 1.0 / span_s) } else { [0.0; 3] };
        velocities.extend(a.iter().zip(b).map(moved));
    }
    let params = start_at(problem, config, &joints, &velocities);
    let is_known = |joint: usize| source.map.known.contains(&(joint % of_person));
    let given = params.positions().iter().enumerate().map(|(joint, &at)| is_known(joint).then_some(at)).collect();
    Some(GivenStart { params, given })
}
