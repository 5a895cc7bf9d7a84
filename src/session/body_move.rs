//! The body moved by hand: a joint with what hangs on it, or a whole person.

use crate::body::{Group, Pppr, Skeleton};
use crate::geometry::{Vec3, add, mean, norm, scale, sub, turned_about, unit_quaternion};
use crate::mhp::Limb;

/// Less than this is no movement: m, and rad.
const STILL_M: f64 = 5e-4;
const STILL_RAD: f64 = 1e-3;

/// A movement of the body from where it was when the finger went down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BodyMove {
    /// A joint (flat index) is put somewhere.
    Joint {
        /// Flat index.
        joint: usize,
        /// Where to, m, world frame.
        to: Vec3,
        /// The joint stays at its distance from the joint that it hangs on, and what hangs on it moves with it; a joint of
        /// the trunk takes the whole person along. Otherwise it moves alone.
        keep_bones: bool,
    },
    /// A whole person is moved and turned about the vertical axis through its root.
    Person {
        /// Which.
        person: usize,
        /// How far, m, world frame.
        by: Vec3,
        /// Turn to the left, rad.
        yaw: f64,
    },
}

/// The body under a finger.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Moving {
    /// It could not be moved, and that was said.
    Refused,
    /// It follows.
    Held(Box<Held>),
}

/// What is in the hand.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Held {
    /// As it was when the finger went down.
    pub(super) base: Pppr,
    /// The branch and iteration that it was.
    pub(super) from: (u32, usize),
    /// An earlier iteration was looked at.
    pub(super) earlier: bool,
    /// The branch of its own.
    pub(super) branch: u32,
    /// How far it is moved.
    pub(super) moved: BodyMove,
}

impl BodyMove {
    /// The parameters after it; `None` where there is no such joint or person.
    pub fn of(&self, base: &Pppr, skeleton: &Skeleton) -> Option<Pppr> {
        let (shape, mut params) = (base.shape(), base.clone());
        let joints = shape.joints.max(1);
        match *self {
            Self::Joint { joint, to, keep_bones } => {
                let first = joint / joints * joints;
                let by = (joint < shape.total_joints()).then(|| sub(to, base.position(joint)))?;
                let (carried, by) = match Limb::of(skeleton, joint - first) {
                    _ if !keep_bones => (vec![joint - first], by),
                    None => ((0..joints).collect(), by),
                    Some(limb) => {
                        let [inner, outer] = [limb.inner, limb.outer].map(|end| base.position(first + end));
                        (limb.carried, sub(on_sphere(inner, norm(sub(outer, inner)), add(outer, by), outer), outer))
                    }
                };
                for joint in carried {
                    params.set_vec3(Group::Position, first + joint, add(base.position(first + joint), by));
                }
            }
            Self::Person { person, by, yaw } => {
                if person >= shape.persons {
                    return None;
                }
                let (root, half) = (root_of(base.person(person), skeleton), 0.5 * yaw);
                for joint in person * joints..(person + 1) * joints {
                    let turned = turned_about(root, yaw, base.position(joint));
                    params.set_vec3(Group::Position, joint, add(turned, by));
                    params.set_vec3(Group::Velocity, joint, turned_about([0.0; 3], yaw, base.velocity(joint)));
                    let (length, q) = unit_quaternion(base.rotation(joint));
                    let turned = turned_by(half, q).map(|x| x * if length > 0.0 { length } else { 1.0 });
                    params.joint_mut(Group::Rotation, joint).copy_from_slice(&turned);
                }
            }
        }
        Some(params)
    }

    /// What it does, in words; `None` where it moves nothing.
    pub(super) fn words(&self, base: &Pppr, skeleton: &Skeleton) -> Option<String> {
        let joints = base.shape().joints.max(1);
        let several = base.shape().persons > 1;
        match *self {
            Self::Joint { joint, .. } => {
                let after = self.of(base, skeleton)?;
                let distance = norm(sub(after.position(joint), base.position(joint)));
                let of = if several { format!("person {} ", joint / joints + 1) } else { String::new() };
                let name = skeleton.shown_name(joint % joints);
                (distance >= STILL_M).then(|| format!("{of}{name} moved {distance:.2} m"))
            }
            Self::Person { person, by, yaw } => {
                let who = if several { format!("person {}", person + 1) } else { "body".into() };
                let moved = (norm(by) >= STILL_M).then(|| format!("moved {:.2} m", norm(by)));
                let turned = (yaw.abs() >= STILL_RAD).then(|| format!("turned {:.0}°", yaw.to_degrees()));
                let parts: Vec<String> = moved.into_iter().chain(turned).collect();
                (!parts.is_empty()).then(|| format!("{who} {}", parts.join(" and ")))
            }
        }
    }
}

/// Where a person turns: the pelvis, else the middle of the hips, else of all joints; m, world frame.
pub fn root_of(person: &[Vec3], skeleton: &Skeleton) -> Vec3 {
    let named = |fits: fn(&str) -> bool| -> Vec<Vec3> {
        let joints = person.iter().zip(&skeleton.joints);
        joints.filter(|(_, name)| fits(name)).map(|(p, _)| *p).collect()
    };
    let known = [named(|name| matches!(name, "pelvis" | "root")), named(|name| name.ends_with("hip"))];
    mean(known.iter().find(|joints| !joints.is_empty()).map_or(person, Vec::as_slice))
}

/// The point of a sphere nearest to `p`; `otherwise` in its middle, where all are as near.
fn on_sphere(centre: Vec3, radius: f64, p: Vec3, otherwise: Vec3) -> Vec3 {
    let away = sub(p, centre);
    let distance = norm(away);
    if distance < 1e-9 { otherwise } else { add(centre, scale(away, radius / distance)) }
}

/// The quaternion `q`, turned by twice `half` rad about the vertical axis.
fn turned_by(half: f64, [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    let (s, c) = half.sin_cos();
    [c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w]
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::body::PpprShape;
    use crate::geometry::{mat_mul, mat_vec, rotation_from_quaternion};

    /// A chain: hip, knee, ankle; and a head above the hip.
    fn leg() -> (Skeleton, Pppr) {
        let joints = ["pelvis", "left_knee", "left_ankle", "head"].map(str::to_owned).to_vec();
        let bones = vec![[0, 1], [1, 2], [0, 3]];
        let skeleton = Skeleton { joints, bones, bone_lengths_m: vec![0.4, 0.4, 0.8], angles: Vec::new() };
        let mut params = Pppr::zeros(PpprShape { persons: 2, joints: 4, doppler_features: 1 });
        let places = [[0.0, 0.0, 0.8], [0.0, 0.0, 0.4], [0.0, 0.0, 0.0], [0.0, 0.0, 1.6]];
        for joint in 0..8 {
            params.set_vec3(Group::Position, joint, add(places[joint % 4], [3.0, joint as f64 / 4.0, 0.0]));
            params.set_vec3(Group::Velocity, joint, [1.0, 0.0, 0.5]);
            params.joint_mut(Group::Rotation, joint).copy_from_slice(&[0.9, 0.1, -0.3, 0.2]);
        }
        (skeleton, params)
    }

    #[test]
    fn a_joint_keeps_its_bone_and_takes_along_what_hangs_on_it() {
        let (skeleton, base) = leg();
        let (knee, ankle) = (5, 6);
        let to = add(base.position(knee), [0.5, 0.1, 0.2]);
        let after = BodyMove::Joint { joint: knee, to, keep_bones: true }.of(&base, &skeleton).unwrap();
        let bone = |params: &Pppr, a, b| norm(sub(params.position(a), params.position(b)));
        for (a, b) in [(4, 5), (5, 6), (4, 7)] {
            assert!((bone(&after, a, b) - bone(&base, a, b)).abs() < 1e-12, "{a} {b}");
        }
        let moved = |joint| sub(after.position(joint), base.position(joint));
        assert!(norm(sub(moved(knee), moved(ankle))) < 1e-12 && norm(moved(knee)) > 0.3);
        // Straight towards where it was dragged to, as seen from the hip.
        let [is, asked] = [after.position(knee), to].map(|p| sub(p, base.position(4)));
        assert!(norm(sub(scale(is, 1.0 / norm(is)), scale(asked, 1.0 / norm(asked)))) < 1e-12);
        for still in [0, 1, 2, 3, 4, 7] {
            assert_eq!(after.position(still), base.position(still), "{still}");
        }
        let alone = BodyMove::Joint { joint: knee, to, keep_bones: false }.of(&base, &skeleton).unwrap();
        assert_eq!(
            (alone.position(knee), alone.position(ankle)),
            (add(base.position(knee), sub(to, base.position(knee))), base.position(ankle))
        );
        assert_eq!(BodyMove::Joint { joint: 8, to, keep_bones: true }.of(&base, &skeleton), None);
    }

    #[test]
    fn a_person_turns_about_its_root_with_all_that_has_a_direction() {
        let (skeleton, base) = leg();
        let turn = BodyMove::Person { person: 1, by: [0.1, 0.2, 0.3], yaw: 0.7 };
        let after = turn.of(&base, &skeleton).unwrap();
        let turned = rotation_from_quaternion([0.35_f64.cos(), 0.0, 0.0, 0.35_f64.sin()]);
        let root = base.position(4);
        for joint in 4..8 {
            let expected = add(add(root, mat_vec(&turned, sub(base.position(joint), root))), [0.1, 0.2, 0.3]);
            assert!(norm(sub(after.position(joint), expected)) < 1e-12);
            assert!(norm(sub(after.velocity(joint), mat_vec(&turned, base.velocity(joint)))) < 1e-12);
            let [is, was] = [&after, &base].map(|params| rotation_from_quaternion(params.rotation(joint)));
            let expected = mat_mul(&turned, &was);
            assert!((0..3).all(|row| norm(sub(is[row], expected[row])) < 1e-12), "the Gaussian turns along");
        }
        assert!((0..4).all(|joint| after.position(joint) == base.position(joint)), "the other one stays");
        assert_eq!(turn.words(&base, &skeleton).unwrap(), "person 2 moved 0.37 m and turned 40°");
        assert_eq!(BodyMove::Person { person: 1, by: [0.0; 3], yaw: 0.0 }.words(&base, &skeleton), None);
        assert_eq!(BodyMove::Person { person: 2, by: [0.0; 3], yaw: 0.0 }.of(&base, &skeleton), None);
    }
}
