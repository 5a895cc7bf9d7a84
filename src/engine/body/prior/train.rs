//! Learns the prior from recorded motion: principal components of windows of poses, and clusters of them.

use super::clusters::clusters;
use super::learn_mixture::learn_mixture;
use super::{MixtureComponent, MotionPrior, MotionStart};
use crate::body::skeletons::COCO_JOINTS;
use crate::geometry::{Vec3, add, norm, scale, sub};
use nalgebra::{DMatrix, SymmetricEigen};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The joints of a recording: COCO's, then the middle of the hips, the base of the neck, the top of the head.
pub const MOTION_JOINTS: [&str; JOINTS] = {
    let mut names = ["pelvis"; JOINTS];
    let mut joint = 0;
    while joint < COCO_JOINTS.len() {
        names[joint] = COCO_JOINTS[joint];
        joint += 1;
    }
    (names[18], names[19]) = ("neck", "head_top");
    names
};
/// So many components carry the figures of [`MotionCoverage`].
pub const MOTION_COUNTS: [usize; 6] = [8, 12, 16, 20, 28, 64];

const JOINTS: usize = 20;
/// The joint on the other side of the body.
const TWINS: [usize; JOINTS] = [0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 16, 15, 17, 18, 19];
const LEFT_SHOULDER: usize = 5;
const RIGHT_SHOULDER: usize = 6;
const LEFT_HIP: usize = 11;
const RIGHT_HIP: usize = 12;
/// Bones of the limbs: their lengths and twice the trunk's make the size.
const LIMBS: [[usize; 2]; 8] = [[5, 7], [7, 9], [6, 8], [8, 10], [11, 13], [13, 15], [12, 14], [14, 16]];
/// The sum of the limbs and two trunks in sizes: the size is then about a metre.
const SUM_IN_SIZES: f64 = 3.5;
/// The size of a person of 1.75 m, m: who stands or walks in the recordings is 1.612 sizes tall.
const SIZE_OF_TALL_M: f64 = 1.75 / 1.612;

/// Poses of a window, and the time from one to the next, s.
const POSES: usize = 9;
const STEP_S: f64 = 0.05;
/// Components that are kept, at most.
const COMPONENTS: usize = 64;
/// Clusters, at most, and the components in which they are sought.
const STARTS: usize = 24;
const CLUSTERED: usize = 12;
/// A group of motions counts as much as so many windows: what there is much of is thinned out, evenly over its recordings…
const GROUP_WINDOWS: usize = 1500;
/// …and what there is little of counts at most so many times.
const REPEATS: f64 = 2.0;
/// A component with a smaller standard deviation says nothing, sizes.
const STILL: f64 = 1e-6;
/// Windows that are summed at a time.
const BLOCK: usize = 512;

/// A recording of one person's motion.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionClip {
    /// What kind of motion it is: kinds weigh the same.
    pub group: String,
    /// Whose.
    pub subject: String,
    /// False where the body was brought to another size than the person's.
    pub own_size: bool,
    /// [`MOTION_JOINTS`] every 0.05 s: x and y on the floor, z up from it, m.
    pub poses: Vec<[Vec3; JOINTS]>,
}

/// How near a prior comes to recorded windows.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionCoverage {
    /// The kind of motion; empty for all of them.
    pub group: String,
    /// Windows that were looked at.
    pub windows: usize,
    /// How far a joint is from where the first [`MOTION_COUNTS`] components put it, mean over joints and windows, for a person
    /// of 1.75 m, m.
    pub residual_m: [f64; 6],
    /// Mean over these components of the squared coefficients, in standard deviations: 1 for windows like those learned from.
    pub mahalanobis: [f64; 6],
    /// By how much likelier the mixture has a window than independent normal coefficients have it, mean of ln.
    pub gain: f64,
}

/// Poses as the person sees them.
#[derive(Debug, Clone, PartialEq)]
struct Window {
    /// (poses, joints, 3), in sizes.
    values: Vec<f64>,
    size_m: f64,
    /// Of the middle of the hips at the middle sample, sizes.
    hip_height: f64,
}

impl Window {
    /// `None` where hips and shoulders do not say where the person faces.
    fn of(poses: &[[Vec3; JOINTS]]) -> Option<Self> {
        let middle = poses.get(poses.len() / 2)?;
        let hips = scale(add(middle[LEFT_HIP], middle[RIGHT_HIP]), 0.5);
        let left = add(sub(middle[LEFT_SHOULDER], middle[RIGHT_SHOULDER]), sub(middle[LEFT_HIP], middle[RIGHT_HIP]));
        let across = left[0].hypot(left[1]);
        let size_m = poses.iter().map(size_m).sum::<f64>() / poses.len() as f64;
        // Forward is to the right of left.
        let [x, y] = [left[1] / across, -left[0] / across];
        let seen = |&joint: &Vec3| {
            let [dx, dy, dz] = sub(joint, hips);
            scale([x * dx + y * dy, x * dy - y * dx, dz], 1.0 / size_m)
        };
        let values: Vec<f64> = poses.iter().flatten().flat_map(seen).collect();
        let hip_height = hips[2] / size_m;
        (across > 1e-6 && values.iter().all(|value| value.is_finite())).then_some(Self { values, size_m, hip_height })
    }

    /// The same motion left and right exchanged.
    fn mirrored(&self) -> Self {
        let pose = |pose: &[f64]| -> Vec<f64> {
            TWINS.iter().flat_map(|&twin| [pose[3 * twin], -pose[3 * twin + 1], pose[3 * twin + 2]]).collect()
        };
        Self { values: self.values.chunks_exact(3 * JOINTS).flat_map(pose).collect(), ..*self }
    }
}

/// The size of a body in a pose, m.
fn size_m(pose: &[Vec3; JOINTS]) -> f64 {
    let limbs: f64 = LIMBS.iter().map(|&[from, to]| norm(sub(pose[from], pose[to]))).sum();
    let shoulders = add(pose[LEFT_SHOULDER], pose[RIGHT_SHOULDER]);
    let trunk = 0.5 * norm(sub(shoulders, add(pose[LEFT_HIP], pose[RIGHT_HIP])));
    (limbs + 2.0 * trunk) / SUM_IN_SIZES
}

/// Where windows begin, by the kind of motion: clip and pose.
fn beginnings(clips: &[MotionClip]) -> BTreeMap<&str, Vec<(usize, usize)>> {
    let mut found: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
    for (index, clip) in clips.iter().enumerate() {
        let begins = (0..(clip.poses.len() + 1).saturating_sub(POSES)).map(|pose| (index, pose));
        found.entry(&clip.group).or_default().extend(begins);
    }
    found
}

fn window(clips: &[MotionClip], (clip, pose): (usize, usize)) -> Option<Window> {
    Window::of(clips[clip].poses.get(pose..pose + POSES)?)
}

/// Learns from clips and their mirror images; `None` where no window tells anything.
pub fn learn_motion(clips: &[MotionClip]) -> Option<MotionPrior> {
    let (mut windows, mut weights) = (Vec::new(), Vec::new());
    for begins in beginnings(clips).values() {
        let taken = begins.len().min(GROUP_WINDOWS);
        let even = (0..taken).filter_map(|k| window(clips, begins[k * begins.len() / taken]));
        windows.extend(even.flat_map(|window| [window.mirrored(), window]));
        weights.resize(windows.len(), (GROUP_WINDOWS as f64 / taken.max(1) as f64).min(REPEATS));
    }
    let total: f64 = weights.iter().sum();
    for weight in &mut weights {
        *weight /= total;
    }

    let numbers = 3 * POSES * JOINTS;
    let mut mean = vec![0.0; numbers];
    for (window, weight) in windows.iter().zip(&weights) {
        mean.iter_mut().zip(&window.values).for_each(|(mean, value)| *mean += weight * value);
    }
    for window in &mut windows {
        window.values.iter_mut().zip(&mean).for_each(|(value, mean)| *value -= mean);
    }
    let (explained, components) = principal(&windows, &weights);
    if components.is_empty() {
        return None;
    }
    let coefficients: Vec<Vec<f64>> = windows.iter().map(|window| coefficients(&components, &window.values)).collect();
    let members = clusters(&coefficients, &weights, CLUSTERED, STARTS);
    let mut prior = MotionPrior {
        header: vec![explained],
        times_s: (0..POSES).map(|k| rounded(STEP_S * (k as f64 - 0.5 * (POSES - 1) as f64))).collect(),
        joints: MOTION_JOINTS.map(str::to_owned).to_vec(),
        ln_size: ln_size(clips)?,
        mean,
        components,
        starts: starts(&windows, &weights, &coefficients, &members),
        mixture: Vec::new(),
        likelihood: OnceLock::new(),
        signs: OnceLock::new(),
    };
    prior.mixture = learn_mixture(&coefficients, &weights, prior.mirror_signs());
    let of_starts = prior
        .starts
        .iter_mut()
        .flat_map(|start| [&mut start.share, &mut start.hip_height].into_iter().chain(&mut start.coefficients));
    let of_mixture = prior.mixture.iter_mut().flat_map(|component| {
        let MixtureComponent { weight, mean, whitening } = component;
        std::iter::once(weight).chain(mean).chain(whitening)
    });
    let numbers = prior.mean.iter_mut().chain(prior.components.iter_mut().flatten()).chain(&mut prior.ln_size);
    numbers.chain(of_starts).chain(of_mixture).for_each(|number| *number = rounded(*number));
    // What was asked of numbers that were not rounded yet is forgotten.
    Some(MotionPrior { signs: OnceLock::new(), ..prior })
}

/// To 0.01 mm of a metre, and never −0.
fn rounded(number: f64) -> f64 {
    (1e5 * number).round() / 1e5 + 0.0
}

/// What share of the variance the components explain, in words, and the components of windows about their mean.
fn principal(windows: &[Window], weights: &[f64]) -> (String, Vec<Vec<f64>>) {
    let numbers = 3 * POSES * JOINTS;
    let mut covariance = DMatrix::<f64>::zeros(numbers, numbers);
    for (windows, weights) in windows.chunks(BLOCK).zip(weights.chunks(BLOCK)) {
        let block = DMatrix::from_fn(numbers, windows.len(), |i, k| weights[k].sqrt() * windows[k].values[i]);
        covariance.gemm(1.0, &block, &block.transpose(), 1.0);
    }
    let eigen = SymmetricEigen::new(covariance);
    let mut order: Vec<usize> = (0..numbers).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let sum = |count: usize| order[..count].iter().map(|&k| eigen.eigenvalues[k]).sum::<f64>();
    let shares = MOTION_COUNTS.map(|count| format!("{:.1} % by {count}", 100.0 * sum(count) / sum(numbers)));
    let component = |k: usize| {
        let deviation = eigen.eigenvalues[k].max(0.0).sqrt();
        let vector = eigen.eigenvectors.column(k);
        // Of a vector and its opposite, the one whose first large number is positive.
        let large = vector.iter().find(|x| x.abs() > 0.99 * vector.amax()).copied().unwrap_or(1.0);
        (deviation > STILL).then(|| vector.iter().map(|x| x * deviation * large.signum()).collect())
    };
    let components = order.iter().take(COMPONENTS).map_while(|&k| component(k)).collect();
    (format!("variance explained: {}", shares.join(", ")), components)
}

/// Of a window about the mean, in standard deviations.
fn coefficients(components: &[Vec<f64>], about_mean: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    components.iter().map(|component| dot(component, about_mean) / dot(component, component)).collect()
}

/// The middles of clusters, the most frequent first.
fn starts(windows: &[Window], weights: &[f64], coefficients: &[Vec<f64>], members: &[usize]) -> Vec<MotionStart> {
    let mut sums: BTreeMap<usize, MotionStart> = BTreeMap::new();
    for (((window, weight), coefficients), &cluster) in windows.iter().zip(weights).zip(coefficients).zip(members) {
        let none = || MotionStart { share: 0.0, hip_height: 0.0, coefficients: vec![0.0; coefficients.len()] };
        let sum = sums.entry(cluster).or_insert_with(none);
        sum.share += weight;
        sum.hip_height += weight * window.hip_height;
        sum.coefficients.iter_mut().zip(coefficients).for_each(|(sum, c)| *sum += weight * c);
    }
    let mut starts: Vec<MotionStart> = sums.into_values().collect();
    for start in &mut starts {
        start.hip_height /= start.share;
        start.coefficients.iter_mut().for_each(|c| *c /= start.share);
    }
    starts.sort_by(|a, b| b.share.total_cmp(&a.share));
    starts
}

/// Mean and standard deviation over subjects of the mean ln of the size: of those with a size of their own, where there are two.
fn ln_size(clips: &[MotionClip]) -> Option<[f64; 2]> {
    let over = |own_alone: bool| {
        let mut of_subjects: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for clip in clips.iter().filter(|clip| clip.own_size || !own_alone) {
            let sizes = clip.poses.iter().map(|pose| size_m(pose).ln()).filter(|ln| ln.is_finite());
            of_subjects.entry(&clip.subject).or_default().extend(sizes);
        }
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        let means: Vec<f64> = of_subjects.values().filter(|sizes| !sizes.is_empty()).map(|sizes| mean(sizes)).collect();
        let middle = mean(&means);
        let squares: f64 = means.iter().map(|ln| (ln - middle) * (ln - middle)).sum();
        // People differ, even where those recorded do not.
        (means.len() > 1).then(|| [middle, (squares / (means.len() - 1) as f64).sqrt().max(0.01)])
    };
    over(true).or_else(|| over(false))
}

/// How near the prior comes to every window of clips of [`MOTION_JOINTS`]: of all of them, and of each kind of motion.
pub fn motion_coverage(prior: &MotionPrior, clips: &[MotionClip]) -> Vec<MotionCoverage> {
    let none = |group: &str| MotionCoverage {
        group: group.to_owned(),
        windows: 0,
        residual_m: [0.0; 6],
        mahalanobis: [0.0; 6],
        gain: 0.0,
    };
    let mut all = vec![none("")];
    for (group, begins) in beginnings(clips) {
        let mut sum = none(group);
        for window in begins.into_iter().filter_map(|at| window(clips, at)) {
            sum.windows += 1;
            let mut rest: Vec<f64> = window.values.iter().zip(&prior.mean).map(|(value, mean)| value - mean).collect();
            let coefficients = coefficients(&prior.components, &rest);
            sum.gain += prior.mixture().gain(&coefficients);
            let mut squares = 0.0;
            for (done, (component, c)) in prior.components.iter().zip(&coefficients).enumerate() {
                rest.iter_mut().zip(component).for_each(|(rest, component)| *rest -= c * component);
                squares += c * c;
                if let Some(k) = MOTION_COUNTS.iter().position(|&count| count == done + 1) {
                    let far: f64 = rest.chunks_exact(3).map(|way| norm([way[0], way[1], way[2]])).sum();
                    sum.residual_m[k] += SIZE_OF_TALL_M * far / (POSES * JOINTS) as f64;
                    sum.mahalanobis[k] += squares / (done + 1) as f64;
                }
            }
        }
        all[0].windows += sum.windows;
        all[0].gain += sum.gain;
        for k in 0..MOTION_COUNTS.len() {
            all[0].residual_m[k] += sum.residual_m[k];
            all[0].mahalanobis[k] += sum.mahalanobis[k];
        }
        all.push(sum);
    }
    for coverage in &mut all {
        let count = coverage.windows.max(1) as f64;
        coverage
            .residual_m
            .iter_mut()
            .chain(&mut coverage.mahalanobis)
            .chain([&mut coverage.gain])
            .for_each(|sum| *sum /= count);
    }
    all
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A person who faces +x and stands 2 m along x, with the top of the head and the neck moved from where they should be.
    fn pose(head_forward: f64, neck_left: f64) -> [Vec3; JOINTS] {
        let side = |y: f64, z: f64| [[2.0, y, z], [2.0, -y, z]];
        let pairs = [side(0.03, 1.6), side(0.07, 1.6), side(0.2, 1.4), side(0.25, 1.1), side(0.25, 0.85)];
        let legs = [side(0.1, 0.9), side(0.1, 0.48), side(0.1, 0.06)];
        let middle = [[2.0, 0.0, 0.9], [2.0, neck_left, 1.45], [2.0 + head_forward, 0.0, 1.75]];
        let joints = std::iter::once([2.1, 0.0, 1.58]).chain(pairs.into_iter().chain(legs).flatten()).chain(middle);
        let mut pose = [[0.0; 3]; JOINTS];
        pose.iter_mut().zip(joints).for_each(|(place, joint)| *place = joint);
        pose
    }

    fn clip(subject: usize, poses: Vec<[Vec3; JOINTS]>) -> MotionClip {
        MotionClip { group: format!("{}", subject % 2), subject: format!("{subject}"), own_size: true, poses }
    }

    /// People whose heads go forward, and half as far their necks to a side, each as it likes.
    fn clips() -> Vec<MotionClip> {
        let wave = |k: usize, step: f64| (step * k as f64).fract() - 0.5;
        let of = |k: usize| clip(k, vec![pose(0.2 * wave(k, 0.618_034), 0.1 * wave(k, 0.414_214)); POSES]);
        (0..200).map(of).collect()
    }

    #[test]
    fn the_joints_have_their_names_and_twins() {
        assert_eq!([MOTION_JOINTS[0], MOTION_JOINTS[16], MOTION_JOINTS[17]], ["nose", "right_ankle", "pelvis"]);
        assert_eq!(MOTION_JOINTS[18..], ["neck", "head_top"]);
        for (joint, &twin) in TWINS.iter().enumerate() {
            assert_eq!(MOTION_JOINTS[joint].replace("left_", "right_"), MOTION_JOINTS[twin].replace("left_", "right_"));
            let sided = ["left_", "right_"].iter().any(|side| MOTION_JOINTS[joint].starts_with(side));
            assert_eq!(joint != twin, sided, "{joint}");
        }
    }

    #[test]
    fn a_window_is_the_same_wherever_the_person_stands_and_faces() {
        let plain = Window::of(&[pose(0.1, 0.05); POSES]).unwrap();
        let turned =
            pose(0.1, 0.05).map(|[x, y, z]| [1.3 * (0.6 * x - 0.8 * y) + 3.0, 1.3 * (0.8 * x + 0.6 * y), 1.3 * z]);
        let other = Window::of(&[turned; POSES]).unwrap();
        let apart =
            |a: &Window, b: &Window| a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart(&plain, &other) < 1e-9);
        assert!((other.size_m / plain.size_m - 1.3).abs() < 1e-9 && (other.hip_height - plain.hip_height).abs() < 1e-9);
        assert!(apart(&plain.mirrored().mirrored(), &plain) < 1e-12 && apart(&plain.mirrored(), &plain) > 0.05);
        assert!(plain.values[0] > 0.0, "the nose is before the hips");
        assert!(plain.values[3 * LEFT_HIP + 1] > 0.0, "left is left");
        assert!(Window::of(&[[[0.0; 3]; JOINTS]; POSES]).is_none());
    }

    #[test]
    fn components_are_found_and_cover_what_they_were_learned_from() {
        let prior = learn_motion(&clips()).unwrap();
        assert_eq!(prior.components.len(), 2, "two things move");
        assert_eq!(MotionPrior::from_json(&prior.to_json().unwrap()).unwrap(), prior);
        // A uniform width of 0.2 m has the deviation 0.2 / √12; the head goes forward, the neck to a side.
        let size = size_m(&pose(0.0, 0.0));
        for (component, joint, axis, width) in [(0, 19, 0, 0.2), (1, 18, 1, 0.1)] {
            let expected = width / 12.0_f64.sqrt() / size;
            let large: Vec<usize> = (0..540).filter(|&i| prior.components[component][i].abs() > 1e-4).collect();
            let moved: Vec<usize> = (0..POSES).map(|time| 3 * (JOINTS * time + joint) + axis).collect();
            assert_eq!(large, moved);
            let found = prior.components[component][moved[0]];
            assert!((found / expected - 1.0).abs() < 0.05, "{found} for {expected}");
        }
        assert!((prior.ln_size[0] - size.ln()).abs() < 1e-4);
        assert!((prior.starts.iter().map(|start| start.share).sum::<f64>() - 1.0).abs() < 1e-3);
        assert!(prior.starts.iter().all(|start| (start.hip_height * size - 0.9).abs() < 1e-3));
        assert!(prior.starts.len() > 4 && prior.starts.is_sorted_by(|a, b| a.share >= b.share));
        assert_eq!(learn_motion(&clips()), Some(prior), "the same every time");
    }

    #[test]
    fn coverage_tells_what_is_unlike_what_was_learned() {
        let mut prior = learn_motion(&clips()).unwrap();
        // As many components as the first figures are about, the added ones without effect on the head.
        while prior.components.len() < MOTION_COUNTS[0] {
            let mut other = vec![0.0; 540];
            other[3 * prior.components.len()] = 1e-3;
            prior.components.push(other);
        }
        let far = MotionClip { group: "far".into(), ..clip(1, vec![pose(0.5, 0.0); POSES + 2]) };
        let told = motion_coverage(&prior, &[clips(), vec![far]].concat());
        let of = |group: &str| told.iter().find(|coverage| coverage.group == group).unwrap();
        assert_eq!([of("").windows, of("0").windows, of("far").windows], [203, 100, 3]);
        assert!(of("0").residual_m[0] < 1e-3 && of("far").mahalanobis[0] > 5.0 * of("0").mahalanobis[0]);
    }

    #[test]
    fn nothing_teaches_nothing() {
        assert!(learn_motion(&[]).is_none());
        assert!(learn_motion(&[clip(0, vec![pose(0.0, 0.0); POSES - 1])]).is_none());
    }
}
