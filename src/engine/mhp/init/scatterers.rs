//! What the Gaussians of a start look like: equal and round as in the paper, or by body part.
//!
//! Joints alone leave the trunk and the limbs empty, and with equal round Gaussians a body slides along its own axis: a
//! chain of equal blobs looks the same a blob farther on. By body part each Gaussian lies along the bones that meet at its
//! joint, wide where the body is, and as bright as that part's share of the skin.

use crate::body::{Group, Pppr, Scatterer, Skeleton, scatterer};
use crate::config::Scatterers;
use crate::geometry::{Vec3, cross, dot, norm, scale, sub};

/// Standard deviation of an equal Gaussian, m.
const EQUAL_SCALE_M: f64 = 0.08;

/// What each joint of a skeleton looks like; `None`: an equal, round Gaussian. The joints' names are read once.
pub(super) struct ScattererModel(Vec<Option<Scatterer>>);

impl ScattererModel {
    pub(super) fn new(skeleton: &Skeleton, kind: Scatterers) -> Self {
        let of_joint = |name: &String| match kind {
            Scatterers::Equal => None,
            Scatterers::BodyParts => scatterer(name),
        };
        Self(skeleton.joints.iter().map(of_joint).collect())
    }

    /// Gives the joints of all persons their scales, orientations and opacities; positions must be there.
    pub(super) fn apply(&self, params: &mut Pppr, skeleton: &Skeleton) {
        for joint in 0..params.shape().total_joints() {
            params.set_vec3(Group::LogScale, joint, [EQUAL_SCALE_M.ln(); 3]);
            params.joint_mut(Group::Rotation, joint).copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
            params.joint_mut(Group::Beta, joint).fill(0.0);
            if let Some(Some(part)) = self.0.get(joint % self.0.len().max(1)) {
                by_part(params, skeleton, joint, part);
            }
        }
    }
}

fn by_part(params: &mut Pppr, skeleton: &Skeleton, joint: usize, part: &Scatterer) {
    let joints = skeleton.joints.len().max(1);
    let (first, own) = (joint - joint % joints, joint % joints);
    let bones = skeleton.bones.iter().filter(|bone| bone.contains(&own));
    let along = bones.map(|&[m, n]| sub(params.position(first + m), params.position(first + n)));
    let along = principal(along);
    params.set_vec3(Group::LogScale, joint, [part.along_m.ln(), part.across_m.ln(), part.across_m.ln()]);
    params.joint_mut(Group::Rotation, joint).copy_from_slice(&rotation_from_x(along));
    params.joint_mut(Group::Beta, joint).fill((part.alpha / (1.0 - part.alpha)).ln());
}

/// The direction along which `bones` extend most; up where there is none.
fn principal(bones: impl Iterator<Item = Vec3>) -> Vec3 {
    let mut scatter = [[0.0; 3]; 3];
    for e in bones {
        for (i, row) in scatter.iter_mut().enumerate() {
            for (k, x) in row.iter_mut().enumerate() {
                *x += e[i] * e[k];
            }
        }
    }
    // Power iteration; bodies stand rather than lie, which picks a side where two directions are alike.
    let mut v = [0.1, 0.2, 1.0];
    for _ in 0..50 {
        let w = scatter.map(|row| dot(row, v));
        let length = norm(w);
        if length <= 0.0 {
            return [0.0, 0.0, 1.0];
        }
        v = scale(w, 1.0 / length);
    }
    v
}

/// The shortest turn that takes x to the unit vector `to`.
fn rotation_from_x(to: Vec3) -> [f64; 4] {
    let axis = cross([1.0, 0.0, 0.0], to);
    let q = [1.0 + to[0], axis[0], axis[1], axis[2]];
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 1e-6 { [0.0, 0.0, 0.0, 1.0] } else { q.map(|x| x / length) }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::body::PpprShape;
    use crate::geometry::{mat_vec, rotation_from_quaternion};

    #[test]
    fn a_turn_takes_x_to_the_bone() {
        for to in [[0.0, 0.0, 1.0], [0.6, -0.8, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]] {
            let turned = mat_vec(&rotation_from_quaternion(rotation_from_x(to)), [1.0, 0.0, 0.0]);
            assert!(norm(sub(turned, to)) < 1e-9, "{to:?} {turned:?}");
        }
    }

    #[test]
    fn a_shank_lies_along_its_bones() {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features: 1 });
        let (hip, knee, ankle) = (11, 13, 15);
        params.set_vec3(Group::Position, hip, [0.3, 0.0, 0.9]);
        params.set_vec3(Group::Position, knee, [0.0, 0.0, 0.5]);
        params.set_vec3(Group::Position, ankle, [-0.3, 0.0, 0.1]);
        ScattererModel::new(&skeleton, Scatterers::BodyParts).apply(&mut params, &skeleton);
        let along = mat_vec(&rotation_from_quaternion(params.rotation(knee)), [1.0, 0.0, 0.0]);
        assert!((along[0].abs() - 0.6).abs() < 1e-6 && (along[2].abs() - 0.8).abs() < 1e-6, "{along:?}");
        assert!(params.scale(knee)[0] > 2.0 * params.scale(knee)[1]);
        assert!(params.opacity(5) > 2.0 * params.opacity(9), "a shoulder outshines a wrist");
    }
}
