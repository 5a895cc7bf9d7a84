//! What a network reads of a person in a frame, as a list of numbers.

use super::card::{Architecture, Features};
use crate::body::{Group, Pppr};
use crate::config::Preset;
use crate::dataset::Heatmap;
use crate::geometry::{Vec3, dot, mean, norm, scale, sub};
use crate::mhp::{Precision, Problem, simulate};
use crate::radar::coarse;

/// Cells a side that a map is brought to.
const SIDE: usize = 32;
/// Amplitudes are divided by this percentile of their map.
const BRIGHT: f64 = 0.99;

/// Numbers of one joint: the six groups, opacity, radial velocity.
pub(super) fn joint_width(doppler_features: usize) -> usize {
    16 + doppler_features
}

/// How many numbers a network of this kind reads.
pub fn input_width(
    features: Features,
    architecture: Architecture,
    joints: usize,
    doppler_features: usize,
    maps: usize,
) -> usize {
    let frames = 2 * architecture.reach() + 1;
    let of_frame = match (features, architecture) {
        (Features::Pppr, Architecture::Mlp) => joint_width(doppler_features),
        (Features::Pppr, _) => 3 + joints * joint_width(doppler_features),
        (Features::FitJoints, Architecture::Mlp) => joints * 3,
        (Features::FitJoints, _) => 3 + joints * 3,
        (Features::Heatmap | Features::PpprHeatmap, _) => maps * SIDE * SIDE,
    };
    frames * of_frame
}

/// What is read of person `person` of one frame. `maps` are the measured ones; `problem` simulates those of the parameters.
pub fn person_input(
    features: Features,
    architecture: Architecture,
    params: Option<(&Pppr, usize)>,
    maps: &[Heatmap],
    problem: Option<&Problem>,
) -> Option<Vec<f32>> {
    match features {
        Features::Heatmap => Some(maps.iter().flat_map(|map| reduced(&map.shape, &map.data)).collect()),
        Features::PpprHeatmap => {
            let (params, _) = params?;
            let simulated = simulate(problem?, &Preset::default().config(), Precision::F32, params);
            let views = &problem?.views;
            Some(views.iter().zip(&simulated).flat_map(|(view, map)| reduced(&view.shape(), map)).collect())
        }
        Features::FitJoints => {
            let (params, person) = params?;
            let joints = params.person(person);
            Some(if architecture == Architecture::Mlp {
                joints.iter().flatten().map(|&x| x as f32).collect()
            } else {
                let middle = mean(joints);
                middle.iter().copied().chain(joints.iter().flat_map(|&p| sub(p, middle))).map(|x| x as f32).collect()
            })
        }
        Features::Pppr => {
            let (params, person) = params?;
            Some(if architecture == Architecture::Mlp { pooled(params, person) } else { each_joint(params, person) })
        }
    }
}

/// The numbers of a joint, its position about `middle`.
pub(super) fn joint_numbers(params: &Pppr, joint: usize, middle: Vec3, out: &mut Vec<f64>) {
    let p = params.position(joint);
    out.extend(sub(p, middle));
    for group in &Group::ALL[1..] {
        out.extend_from_slice(params.joint(*group, joint));
    }
    let along = scale(p, 1.0 / norm(p).max(1e-6));
    out.extend([params.opacity(joint), dot(params.velocity(joint), along)]);
}

/// The paper's: the mean over the joints.
fn pooled(params: &Pppr, person: usize) -> Vec<f32> {
    let joints = params.shape().joints;
    let width = joint_width(params.shape().doppler_features);
    let mut sum = vec![0.0; width];
    let mut numbers = Vec::with_capacity(width);
    for k in person * joints..(person + 1) * joints {
        numbers.clear();
        joint_numbers(params, k, [0.0; 3], &mut numbers);
        sum.iter_mut().zip(&numbers).for_each(|(sum, x)| *sum += x / joints as f64);
    }
    sum.into_iter().map(|x| x as f32).collect()
}

/// The body's middle, and the numbers of every joint about it.
fn each_joint(params: &Pppr, person: usize) -> Vec<f32> {
    let joints = params.shape().joints;
    let middle = mean(params.person(person));
    let mut numbers: Vec<f64> = middle.to_vec();
    for k in person * joints..(person + 1) * joints {
        joint_numbers(params, k, middle, &mut numbers);
    }
    numbers.into_iter().map(|x| x as f32).collect()
}

/// A map as 32 × 32 means of its amplitudes, roots of them about the brightest; axes before the last two are averaged over.
fn reduced(shape: &[usize], cells: &[f64]) -> Vec<f32> {
    let means = coarse(shape, cells, [SIDE; 2]);
    let mut sorted = means.clone();
    sorted.sort_by(f64::total_cmp);
    let bright = sorted[((SIDE * SIDE - 1) as f64 * BRIGHT) as usize].max(1e-12);
    means.into_iter().map(|x| (x / bright).min(2.0).sqrt() as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::PpprShape;

    #[test]
    fn the_papers_forty_eight_are_the_mean_over_the_joints() {
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 2, doppler_features: 32 });
        params.set_vec3(Group::Position, 0, [2.0, 0.0, 0.0]);
        params.set_vec3(Group::Position, 1, [4.0, 0.0, 1.0]);
        params.set_vec3(Group::Velocity, 0, [1.0, 0.0, 0.0]);
        let read = person_input(Features::Pppr, Architecture::Mlp, Some((&params, 0)), &[], None).unwrap_or_default();
        assert_eq!((read.len(), input_width(Features::Pppr, Architecture::Mlp, 2, 32, 2)), (48, 48));
        assert_eq!(read[..3], [3.0, 0.0, 0.5]);
        // Velocity, opacity of beta 0, radial velocity of the first joint alone.
        assert_eq!((read[10], read[46], read[47]), (0.5, 0.5, 0.5));
    }

    #[test]
    fn every_joint_is_read_about_the_middle() {
        let mut params = Pppr::zeros(PpprShape { persons: 2, joints: 2, doppler_features: 4 });
        for (k, x) in [1.0, 1.0, 2.0, 4.0].into_iter().enumerate() {
            params.set_vec3(Group::Position, k, [x, 0.0, 0.0]);
        }
        let read = person_input(Features::FitJoints, Architecture::MlpJoints, Some((&params, 1)), &[], None);
        assert_eq!(read, Some(vec![3.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
        let read = person_input(Features::Pppr, Architecture::MlpJoints, Some((&params, 1)), &[], None);
        assert_eq!(read.map(|read| read.len()), Some(input_width(Features::Pppr, Architecture::MlpJoints, 2, 4, 0)));
    }

    #[test]
    fn maps_of_any_size_are_as_many_numbers() {
        for shape in [vec![8, 8], vec![256, 128], vec![64, 64, 3]] {
            let cells: usize = shape.iter().product();
            let read = reduced(&shape, &vec![1.0; cells]);
            assert_eq!(read.len(), SIDE * SIDE);
            assert!(read.iter().all(|x| *x == 0.0 || (*x - 1.0).abs() < 1e-6));
        }
        assert!(reduced(&[4, 4], &[f64::NAN; 16]).iter().all(|x| *x == 0.0));
    }
}
