//! PPPR: the parameters of every joint, and their gradients, which have the same shape.

use crate::geometry::Vec3;
use serde::{Deserialize, Serialize};

/// A group of parameters: the unit of learning rates, gradients and npz keys; SPEC section 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Group {
    /// p, m, 3 a joint.
    Position,
    /// ln s, s in m, 3 a joint.
    LogScale,
    /// q = (w, x, y, z), normalised when used, 4 a joint.
    Rotation,
    /// v, m/s, 3 a joint.
    Velocity,
    /// β, opacity α = σ(β), 1 a joint.
    Beta,
    /// ω, Doppler features, rad·s/m², N_d a joint.
    Omega,
}

impl Group {
    /// Every group in the order of SPEC section 2.
    pub const ALL: [Self; 6] =
        [Self::Position, Self::LogScale, Self::Rotation, Self::Velocity, Self::Beta, Self::Omega];

    /// The key in PPPR npz files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::LogScale => "log_scale",
            Self::Rotation => "rotation",
            Self::Velocity => "velocity",
            Self::Beta => "beta",
            Self::Omega => "omega",
        }
    }
}

/// Sizes of a [`Pppr`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PpprShape {
    /// Persons.
    pub persons: usize,
    /// Joints a person.
    pub joints: usize,
    /// Doppler features N_d a joint.
    pub doppler_features: usize,
}

impl PpprShape {
    /// Numbers that one joint has in `group`.
    pub fn width(self, group: Group) -> usize {
        match group {
            Group::Position | Group::LogScale | Group::Velocity => 3,
            Group::Rotation => 4,
            Group::Beta => 1,
            Group::Omega => self.doppler_features,
        }
    }

    /// Where a group's numbers lie among those of all.
    fn range(self, group: Group) -> std::ops::Range<usize> {
        // In the order of the groups, each as wide as said above.
        let before = match group {
            Group::Position => 0,
            Group::LogScale => 3,
            Group::Rotation => 6,
            Group::Velocity => 10,
            Group::Beta => 13,
            Group::Omega => 14,
        };
        let joints = self.total_joints();
        before * joints..(before + self.width(group)) * joints
    }

    /// Joints of all persons together.
    pub fn total_joints(self) -> usize {
        self.persons * self.joints
    }

    /// Numbers in all groups together.
    pub fn total(self) -> usize {
        Group::ALL.iter().map(|&g| self.width(g)).sum::<usize>() * self.total_joints()
    }

    /// The array shape of a group in an npz: (persons, joints) or (persons, joints, width).
    pub fn array_shape(self, group: Group) -> Vec<usize> {
        match group {
            Group::Beta => vec![self.persons, self.joints],
            _ => vec![self.persons, self.joints, self.width(group)],
        }
    }
}

/// The parameters of all joints of all persons (or their gradients, or Adam's moments): one flat array a group,
/// ordered (person, joint, component); SPEC section 2.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked", into = "Unchecked")]
pub struct Pppr {
    shape: PpprShape,
    /// Group after group: one piece of memory, for a fit keeps every iteration's.
    numbers: Vec<f64>,
}

/// What a file says, before its sizes are compared.
#[derive(Serialize, Deserialize)]
struct Unchecked {
    shape: PpprShape,
    groups: [Vec<f64>; 6],
}

impl TryFrom<Unchecked> for Pppr {
    type Error = String;

    fn try_from(Unchecked { shape, groups }: Unchecked) -> Result<Self, String> {
        for (group, numbers) in Group::ALL.into_iter().zip(&groups) {
            let joints = shape.persons.saturating_mul(shape.joints);
            let expected = joints.saturating_mul(shape.width(group));
            if numbers.len() != expected {
                let (key, found) = (group.key(), numbers.len());
                return Err(format!("`{key}` has {found} numbers; expected {expected}"));
            }
        }
        Ok(Self { shape, numbers: groups.concat() })
    }
}

impl From<Pppr> for Unchecked {
    fn from(of: Pppr) -> Self {
        Self { shape: of.shape, groups: Group::ALL.map(|group| of.group(group).to_vec()) }
    }
}

impl Pppr {
    /// All zeros (the zero quaternion included): a gradient to be accumulated.
    pub fn zeros(shape: PpprShape) -> Self {
        Self { shape, numbers: vec![0.0; shape.total()] }
    }

    /// All zeros again, in the memory that is there.
    pub fn reset(&mut self, shape: PpprShape) {
        self.shape = shape;
        self.numbers.clear();
        self.numbers.resize(shape.total(), 0.0);
    }

    /// Has these sizes, and numbers that are to be written over.
    pub(crate) fn resize(&mut self, shape: PpprShape) {
        self.shape = shape;
        self.numbers.resize(shape.total(), 0.0);
    }

    /// Becomes a · x + b · y of two that have the same sizes.
    pub fn set_mix(&mut self, (a, x): (f64, &Self), (b, y): (f64, &Self)) {
        self.resize(x.shape);
        for ((sum, x), y) in self.numbers.iter_mut().zip(&x.numbers).zip(&y.numbers) {
            *sum = a * x + b * y;
        }
    }

    /// Adds `share` · `other`, which has the same sizes.
    pub fn add_scaled(&mut self, share: f64, other: &Self) {
        for (sum, x) in self.numbers.iter_mut().zip(&other.numbers) {
            *sum += share * x;
        }
    }

    /// The sizes.
    pub fn shape(&self) -> PpprShape {
        self.shape
    }

    /// The flat array of a group, (persons · joints · width).
    pub fn group(&self, group: Group) -> &[f64] {
        &self.numbers[self.shape.range(group)]
    }

    /// The flat array of a group, to be written.
    pub fn group_mut(&mut self, group: Group) -> &mut [f64] {
        let range = self.shape.range(group);
        &mut self.numbers[range]
    }

    /// The numbers of the groups `from` to `to`, which are beside each other.
    pub(crate) fn groups(&self, from: Group, to: Group) -> &[f64] {
        &self.numbers[self.shape.range(from).start..self.shape.range(to).end]
    }

    /// The same, to be written.
    pub(crate) fn groups_mut(&mut self, from: Group, to: Group) -> &mut [f64] {
        let range = self.shape.range(from).start..self.shape.range(to).end;
        &mut self.numbers[range]
    }

    /// The numbers of flat joint `joint` (person · joints + joint) in `group`.
    pub fn joint(&self, group: Group, joint: usize) -> &[f64] {
        let width = self.shape.width(group);
        &self.group(group)[joint * width..(joint + 1) * width]
    }

    /// The numbers of flat joint `joint` in `group`, to be written.
    pub fn joint_mut(&mut self, group: Group, joint: usize) -> &mut [f64] {
        let width = self.shape.width(group);
        &mut self.group_mut(group)[joint * width..(joint + 1) * width]
    }

    /// A 3-vector group at flat joint `joint`.
    pub fn vec3(&self, group: Group, joint: usize) -> Vec3 {
        let v = self.joint(group, joint);
        [v[0], v[1], v[2]]
    }

    /// Writes a 3-vector group at flat joint `joint`.
    pub fn set_vec3(&mut self, group: Group, joint: usize, value: Vec3) {
        self.joint_mut(group, joint).copy_from_slice(&value);
    }

    /// Positions p of all flat joints, m, world frame.
    pub fn positions(&self) -> &[Vec3] {
        self.group(Group::Position).as_chunks().0
    }

    /// Velocities v of all flat joints, m/s, world frame.
    pub fn velocities(&self) -> &[Vec3] {
        self.group(Group::Velocity).as_chunks().0
    }

    /// Positions and velocities of all flat joints, to be written.
    pub fn motion_mut(&mut self) -> [&mut [Vec3]; 2] {
        let [positions, velocities] = [Group::Position, Group::Velocity].map(|group| self.shape.range(group));
        let (before, after) = self.numbers.split_at_mut(velocities.start);
        [before[positions].as_chunks_mut().0, after[..velocities.len()].as_chunks_mut().0]
    }

    /// Positions p of a person's joints, m, world frame; none of somebody who is not there.
    pub fn person(&self, person: usize) -> &[Vec3] {
        let joints = self.shape().joints;
        self.positions().get(person * joints..(person + 1) * joints).unwrap_or_default()
    }

    /// One person as if nobody else were there.
    pub fn only(&self, person: usize) -> Self {
        let joints = self.shape.joints;
        let mut one = Self::zeros(PpprShape { persons: 1, ..self.shape });
        for group in Group::ALL {
            for joint in 0..joints {
                one.joint_mut(group, joint).copy_from_slice(self.joint(group, person * joints + joint));
            }
        }
        one
    }

    /// Position p of flat joint `joint`, m, world frame.
    pub fn position(&self, joint: usize) -> Vec3 {
        self.vec3(Group::Position, joint)
    }

    /// Velocity v of flat joint `joint`, m/s, world frame.
    pub fn velocity(&self, joint: usize) -> Vec3 {
        self.vec3(Group::Velocity, joint)
    }

    /// Scale s = exp(log_scale) of flat joint `joint`, m.
    pub fn scale(&self, joint: usize) -> Vec3 {
        self.vec3(Group::LogScale, joint).map(f64::exp)
    }

    /// Rotation quaternion (w, x, y, z) of flat joint `joint`, as stored (not normalised).
    pub fn rotation(&self, joint: usize) -> [f64; 4] {
        let q = self.joint(Group::Rotation, joint);
        [q[0], q[1], q[2], q[3]]
    }

    /// Opacity α = σ(β) of flat joint `joint`.
    pub fn opacity(&self, joint: usize) -> f64 {
        1.0 / (1.0 + (-self.joint(Group::Beta, joint)[0]).exp())
    }

    /// The persons of these numbers, in this order.
    pub fn with_persons(&self, order: &[usize]) -> Self {
        let shape = PpprShape { persons: order.len(), ..self.shape };
        let mut picked = Self::zeros(shape);
        for group in Group::ALL {
            let width = shape.width(group) * shape.joints;
            let from: Vec<&[f64]> = self.group(group).chunks_exact(width.max(1)).collect();
            for (to, &person) in picked.group_mut(group).chunks_exact_mut(width.max(1)).zip(order) {
                to.copy_from_slice(from[person]);
            }
        }
        picked
    }

    /// True where every number of every group is finite.
    pub fn is_finite(&self) -> bool {
        // Zero times what is not finite is no number; without a way out of the loop it is many at a time.
        let (eights, rest) = self.numbers.as_chunks::<8>();
        let mut zeros = [0.0; 8];
        for eight in eights {
            for (zero, x) in zeros.iter_mut().zip(eight) {
                *zero += x * 0.0;
            }
        }
        zeros.iter().all(|&zero| zero == 0.0) && rest.iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn persons_are_picked_in_the_order_that_is_asked() {
        let shape = PpprShape { persons: 3, joints: 2, doppler_features: 2 };
        let mut all = Pppr::zeros(shape);
        for group in Group::ALL {
            let numbers = all.group_mut(group);
            let a_person = numbers.len() / 3;
            numbers
                .iter_mut()
                .enumerate()
                .for_each(|(k, x)| *x = (k / a_person) as f64 * 100.0 + (k % a_person) as f64);
        }
        assert_eq!(all.with_persons(&[0, 1, 2]), all);
        let picked = all.with_persons(&[2, 0]);
        assert_eq!(picked.shape(), PpprShape { persons: 2, ..shape });
        for group in Group::ALL {
            let (from, to) = (all.group(group), picked.group(group));
            let a_person = from.len() / 3;
            assert_eq!([&to[..a_person], &to[a_person..]], [&from[2 * a_person..], &from[..a_person]], "{group:?}");
        }
    }
}
