//! What a network reads of a person in a frame, as a list of numbers.

use super::card::{Architecture, Features};
use crate::body::{Group, Pppr};
use crate::config::{BodyModel, FitConfig, Parameterization, Preset};
use crate::dataset::Heatmap;
use crate::geometry::{Vec3, dot, mean, norm, scale, sub};
use crate::mhp::{Objective, Precision, Problem, Region, simulate};
use crate::radar::coarse;
use std::sync::Arc;

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

/// What is read of person `person` of one frame. `maps` are the measured ones; `problem` simulates those of the parameters. Of several
/// people each is read by themselves: of the simulated maps what their own parameters make, of the measured ones what lies within
/// 1.25 m about them.
pub fn person_input(
    features: Features,
    architecture: Architecture,
    params: Option<(&Pppr, usize)>,
    maps: &[Heatmap],
    problem: Option<&Arc<Problem>>,
) -> Option<Vec<f32>> {
    match features {
        Features::Heatmap => match params.filter(|(params, _)| params.shape().persons > 1) {
            None => Some(maps.iter().flat_map(|map| reduced(&map.shape, &map.data)).collect()),
            Some((params, person)) => about(problem?, &params.only(person), maps),
        },
        Features::PpprHeatmap => {
            let (params, person) = params?;
            let simulated = simulate(problem?, &Preset::default().config(), Precision::F32, &params.only(person));
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

/// The measured maps in the EM region about somebody, and nothing beside it.
fn about(problem: &Arc<Problem>, one: &Pppr, maps: &[Heatmap]) -> Option<Vec<f32>> {
    let config =
        FitConfig { body: BodyModel::Joints, parameterization: Parameterization::Joints, ..Preset::Baseline.config() };
    let objective = Objective::new(Arc::clone(problem), config, Precision::F32, one).ok()?;
    let of_view = |(map, region): (&Heatmap, &Region)| {
        let mut cut = vec![0.0; map.data.len()];
        for cell in region.indices(&map.shape) {
            cut[cell] = map.data[cell];
        }
        reduced(&map.shape, &cut)
    };
    Some(maps.iter().zip(objective.regions()).flat_map(of_view).collect())
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
    #![expect(clippy::unwrap_used, reason = "a test stops where the sample is missing")]
    use super::*;
    use crate::body::PpprShape;
    use crate::dataset::{Dataset, bundled_sample};
    use crate::start::problem_alone;
    use crate::task::Progress;

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

    /// Each of two people is read as if the other were not there: the simulated maps of their own parameters, the measured ones about
    /// them.
    #[test]
    fn of_two_people_each_is_read_by_themselves() {
        let dataset = Dataset::open(&bundled_sample().unwrap(), &Progress::new()).unwrap();
        let frame = dataset.load(3).unwrap();
        let problem = Arc::new(problem_alone(&dataset, &frame).unwrap());
        let truth = frame.truth.as_ref().unwrap().joints.clone();
        let joints = truth.len();
        let shape = PpprShape { persons: 2, joints, doppler_features: problem.radar.doppler_features };
        let mut two = Pppr::zeros(shape);
        for (k, p) in truth.iter().chain(&truth).enumerate() {
            let aside = if k < joints { 0.0 } else { 3.0 };
            two.set_vec3(Group::Position, k, [p[0] + aside, p[1], p[2]]);
            two.set_vec3(Group::LogScale, k, [-2.5; 3]);
            two.joint_mut(Group::Rotation, k)[0] = 1.0;
        }
        let read = |features, of: &Pppr, person| {
            person_input(features, Architecture::Mlp, Some((of, person)), &frame.maps, Some(&problem)).unwrap()
        };
        for person in 0..2 {
            let alone = two.only(person);
            assert_eq!(read(Features::PpprHeatmap, &two, person), read(Features::PpprHeatmap, &alone, 0));
            assert_eq!(read(Features::Pppr, &two, person), read(Features::Pppr, &alone, 0));
        }
        // The echo is the first one's: about the second there is less of it, and what lies about neither is 0.
        let [first, second] = [0, 1].map(|person| read(Features::Heatmap, &two, person));
        let whole = read(Features::Heatmap, &two.only(0), 0);
        assert_eq!(first.len(), whole.len());
        assert_ne!(first, second);
        let dark = |of: &[f32]| of.iter().filter(|x| **x == 0.0).count();
        assert!(dark(&first) > dark(&whole) + 200, "{} {}", dark(&first), dark(&whole));
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
