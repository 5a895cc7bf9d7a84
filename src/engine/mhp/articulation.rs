//! The body as a root that moves and turns, and bones that turn about their inner joint.
//!
//! Which bones turn follows from the skeleton's graph: a bone whose removal cuts the body in two is a hinge; joints that
//! hang together in loops (COCO's trunk and face) are one rigid part. The largest rigid part is the root. The state stays
//! [`Pppr`]: gradients of positions and orientations are pulled back to the coordinates below, and a step turns the
//! joints themselves, so that lengths are kept exactly and nothing has to be converted on the way in or out.
//!
//! Coordinates of a person: root translation (3, m), root turn about its middle (3, rad), then one turn a hinge (3, rad).

use crate::body::{Group, Pppr, Skeleton};
use crate::geometry::{Vec3, add, add_scaled, cross, mat_vec, norm, rotation_from_quaternion, scale, sub};

/// A bone that turns about its inner joint and carries what hangs on it.
#[derive(Debug, Clone, PartialEq)]
struct Hinge {
    inner: usize,
    outer: usize,
    /// The joints that it carries, the bone's outer end among them.
    carried: Vec<usize>,
}

/// What turns with a joint about the bone that it hangs on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limb {
    /// The bone's end that stays.
    pub inner: usize,
    /// The bone's end that moves.
    pub outer: usize,
    /// The joints that move with it, itself among them, ascending.
    pub carried: Vec<usize>,
}

impl Limb {
    /// The smallest limb that a joint is of; `None` where it is of the root, which moves as a whole.
    pub fn of(skeleton: &Skeleton, joint: usize) -> Option<Self> {
        // Outermost first, so the first is the smallest.
        let hinge = Articulation::new(skeleton).hinges.into_iter().find(|hinge| hinge.carried.contains(&joint))?;
        Some(Self { inner: hinge.inner, outer: hinge.outer, carried: hinge.carried })
    }
}

/// A skeleton's hinges, outermost first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Articulation {
    joints: usize,
    root: Vec<usize>,
    hinges: Vec<Hinge>,
}

/// Translation and turn of the root.
const ROOT: usize = 6;

/// Whether a person's coordinate is a turn, rad, and not a translation, m.
pub(super) fn is_turn(coordinate: usize) -> bool {
    coordinate >= 3
}

impl Articulation {
    pub(super) fn new(skeleton: &Skeleton) -> Self {
        let joints = skeleton.joints.len();
        let is_hinge = |bone: usize| {
            let [m, n] = skeleton.bones[bone];
            !reached(skeleton, m, |other| other != bone).contains(&n)
        };
        let hinged: Vec<bool> = (0..skeleton.bones.len()).map(is_hinge).collect();
        let part = |joint: usize| reached(skeleton, joint, |bone| !hinged[bone]);
        // Of equally large parts the most central one: its farthest joint is nearest.
        let root = (0..joints).map(part).min_by_key(|part| {
            let centre = part.first().copied().unwrap_or(0);
            (std::cmp::Reverse(part.len()), eccentricity(skeleton, centre), centre)
        });
        let root = root.unwrap_or_default();
        let start = root.first().copied().unwrap_or(0);
        let mut hinges: Vec<Hinge> = (0..skeleton.bones.len())
            .filter(|&bone| hinged[bone])
            .filter_map(|bone| {
                let [m, n] = skeleton.bones[bone];
                let inside = reached(skeleton, start, |other| other != bone);
                let (inner, outer) = if inside.contains(&m) { (m, n) } else { (n, m) };
                // A bone of a part that hangs nowhere on the root stays where it is.
                inside.contains(&inner).then(|| Hinge {
                    inner,
                    outer,
                    carried: reached(skeleton, outer, |other| other != bone),
                })
            })
            .collect();
        hinges.sort_by_key(|hinge| (hinge.carried.len(), hinge.inner));
        Self { joints, root, hinges }
    }

    /// Numbers that one person has.
    pub(super) fn coordinates(&self) -> usize {
        ROOT + 3 * self.hinges.len()
    }

    /// Writes the gradient by coordinate, (persons · coordinates), of one by position and orientation.
    pub(super) fn pull_back(&self, params: &Pppr, gradient: &Pppr, pulled: &mut Vec<f64>) {
        pulled.clear();
        for first in self.persons(params) {
            let mut push = |v: Vec3| pulled.extend(v);
            let all = 0..self.joints;
            push(all.clone().fold([0.0; 3], |sum, j| add(sum, gradient.vec3(Group::Position, first + j))));
            push(torque(params, gradient, self.middle(params, first), all.map(|j| first + j)));
            for hinge in &self.hinges {
                let carried = hinge.carried.iter().map(|j| first + j);
                push(torque(params, gradient, params.position(first + hinge.inner), carried));
            }
        }
    }

    /// Moves and turns `params` by `step`, (persons · coordinates).
    pub(super) fn advance(&self, params: &mut Pppr, step: &[f64]) {
        for (first, step) in self.persons(params).zip(step.chunks_exact(self.coordinates())) {
            let (root, turns) = step.split_at(ROOT);
            for (hinge, turn) in self.hinges.iter().zip(turns.chunks_exact(3)) {
                let pivot = params.position(first + hinge.inner);
                rotate(params, pivot, [turn[0], turn[1], turn[2]], hinge.carried.iter().map(|j| first + j));
            }
            let middle = self.middle(params, first);
            rotate(params, middle, [root[3], root[4], root[5]], first..first + self.joints);
            for joint in first..first + self.joints {
                let moved = add(params.position(joint), [root[0], root[1], root[2]]);
                params.set_vec3(Group::Position, joint, moved);
            }
        }
    }

    /// Index of each person's first joint.
    fn persons(&self, params: &Pppr) -> impl Iterator<Item = usize> + use<> {
        let joints = self.joints;
        (0..params.shape().persons).map(move |person| person * joints)
    }

    fn middle(&self, params: &Pppr, first: usize) -> Vec3 {
        let sum = self.root.iter().fold([0.0; 3], |sum, j| add(sum, params.position(first + j)));
        scale(sum, 1.0 / self.root.len().max(1) as f64)
    }
}

/// Joints that hang together with `from` over the bones that `passes` lets through, ascending.
fn reached(skeleton: &Skeleton, from: usize, passes: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut seen = vec![false; skeleton.joints.len()];
    let mut open = vec![from];
    while let Some(joint) = open.pop() {
        let Some(here) = seen.get_mut(joint) else { continue };
        if std::mem::replace(here, true) {
            continue;
        }
        let bones = skeleton.bones.iter().enumerate().filter(|(bone, ends)| ends.contains(&joint) && passes(*bone));
        open.extend(bones.map(|(_, [m, n])| if *m == joint { *n } else { *m }));
    }
    (0..seen.len()).filter(|&joint| seen[joint]).collect()
}

/// Bones to the farthest joint.
fn eccentricity(skeleton: &Skeleton, from: usize) -> usize {
    let mut distance = vec![usize::MAX; skeleton.joints.len()];
    let mut open = std::collections::VecDeque::from([(from, 0)]);
    while let Some((joint, steps)) = open.pop_front() {
        let Some(known) = distance.get_mut(joint).filter(|known| **known == usize::MAX) else { continue };
        *known = steps;
        let bones = skeleton.bones.iter().filter(|ends| ends.contains(&joint));
        open.extend(bones.map(|[m, n]| (if *m == joint { *n } else { *m }, steps + 1)));
    }
    distance.into_iter().filter(|&steps| steps != usize::MAX).max().unwrap_or(0)
}

/// ∂L by a turn of `joints` about `pivot`: of their places, and of their Gaussians' orientations.
fn torque(params: &Pppr, gradient: &Pppr, pivot: Vec3, joints: impl Iterator<Item = usize>) -> Vec3 {
    let mut sum = [0.0; 3];
    for joint in joints {
        add_scaled(&mut sum, cross(sub(params.position(joint), pivot), gradient.vec3(Group::Position, joint)), 1.0);
        let (q, g) = (params.rotation(joint), gradient.joint(Group::Rotation, joint));
        for (axis, sum) in sum.iter_mut().enumerate() {
            let mut turn = [0.0; 4];
            turn[axis + 1] = 0.5;
            *sum += product(turn, q).iter().zip(g).map(|(a, b)| a * b).sum::<f64>();
        }
    }
    sum
}

fn rotate(params: &mut Pppr, pivot: Vec3, turn: Vec3, joints: impl Iterator<Item = usize>) {
    let angle = norm(turn);
    if angle == 0.0 {
        return;
    }
    let [x, y, z] = scale(turn, (0.5 * angle).sin() / angle);
    let q = [(0.5 * angle).cos(), x, y, z];
    let matrix = rotation_from_quaternion(q);
    for joint in joints {
        let arm = sub(params.position(joint), pivot);
        params.set_vec3(Group::Position, joint, add(pivot, mat_vec(&matrix, arm)));
        let turned = product(q, params.rotation(joint));
        params.joint_mut(Group::Rotation, joint).copy_from_slice(&turned);
    }
}

/// Hamilton product, (w, x, y, z).
fn product([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 4] {
    [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::body::PpprShape;

    fn scene(skeleton: &Skeleton, persons: usize) -> Pppr {
        let joints = skeleton.joints.len();
        let mut params = Pppr::zeros(PpprShape { persons, joints, doppler_features: 2 });
        for group in [Group::Position, Group::Rotation] {
            for (k, x) in params.group_mut(group).iter_mut().enumerate() {
                *x = (k as f64 * 1.7).sin();
            }
        }
        params
    }

    #[test]
    fn limbs_are_hinges_and_loops_are_rigid() {
        let coco = Articulation::new(&Skeleton::preset("coco17").unwrap());
        assert_eq!(coco.hinges.len(), 8);
        assert_eq!(coco.root, [0, 1, 2, 3, 4, 5, 6, 11, 12]);
        // The forearm is turned before the upper arm that carries it.
        let elbow = coco.hinges.iter().position(|h| h.inner == 7).unwrap();
        let shoulder = coco.hinges.iter().position(|h| h.inner == 5).unwrap();
        assert!(elbow < shoulder && coco.hinges[elbow].carried == [9] && coco.hinges[shoulder].carried == [7, 9]);
        let tree = Articulation::new(&Skeleton::preset("h36m17").unwrap());
        assert_eq!((tree.hinges.len(), tree.root.len()), (16, 1));
    }

    #[test]
    fn a_step_keeps_every_length() {
        for name in ["coco17", "h36m17", "hupr14"] {
            let skeleton = Skeleton::preset(name).unwrap();
            let body = Articulation::new(&skeleton);
            let before = scene(&skeleton, 2);
            let mut after = before.clone();
            let step: Vec<f64> = (0..2 * body.coordinates()).map(|k| (k as f64).cos()).collect();
            body.advance(&mut after, &step);
            for person in [0, skeleton.joints.len()] {
                for &[m, n] in &skeleton.bones {
                    let length = |p: &Pppr| norm(sub(p.position(person + m), p.position(person + n)));
                    assert!((length(&before) - length(&after)).abs() < 1e-12, "{name}");
                }
            }
            assert_ne!(before.position(0), after.position(0));
        }
    }

    /// d/dε of any linear function of positions and orientations along a step is its gradient, pulled back.
    #[test]
    fn the_pulled_back_gradient_is_the_slope_of_a_step() {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let body = Articulation::new(&skeleton);
        let params = scene(&skeleton, 2);
        let mut gradient = Pppr::zeros(params.shape());
        for group in [Group::Position, Group::Rotation] {
            for (k, g) in gradient.group_mut(group).iter_mut().enumerate() {
                *g = (k as f64 * 0.37).cos();
            }
        }
        let value = |p: &Pppr| -> f64 {
            [Group::Position, Group::Rotation]
                .iter()
                .map(|&group| p.group(group).iter().zip(gradient.group(group)).map(|(x, g)| x * g).sum::<f64>())
                .sum()
        };
        let mut pulled = Vec::new();
        body.pull_back(&params, &gradient, &mut pulled);
        for k in 0..pulled.len() {
            let slope = [1e-6, -1e-6].map(|h| {
                let (mut moved, mut step) = (params.clone(), vec![0.0; pulled.len()]);
                step[k] = h;
                body.advance(&mut moved, &step);
                value(&moved)
            });
            assert!(((slope[0] - slope[1]) / 2e-6 - pulled[k]).abs() < 1e-6, "coordinate {k}");
        }
    }
}
