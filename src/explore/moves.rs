//! Ways in which a body is moved as a whole or a limb of it is turned.

use crate::body::{Group, Pppr, Skeleton};
use crate::geometry::{Vec3, add, cross, dot, mean, norm, scale, sub, turned_about, unit_quaternion};
use crate::mhp::Limb;

/// Where a person turns: the pelvis, else the middle of the hips, else of all joints; m, world frame.
pub fn root_of(person: &[Vec3], skeleton: &Skeleton) -> Vec3 {
    let named = |fits: fn(&str) -> bool| -> Vec<Vec3> {
        let joints = person.iter().zip(&skeleton.joints);
        joints.filter(|(_, name)| fits(name)).map(|(p, _)| *p).collect()
    };
    let known = [named(|name| matches!(name, "pelvis" | "root")), named(|name| name.ends_with("hip"))];
    mean(known.iter().find(|joints| !joints.is_empty()).map_or(person, Vec::as_slice))
}

/// Turns a person by `yaw`, rad, to the left about the vertical axis through its root, with its velocities and Gaussians, and
/// moves it by `by`, m.
pub fn move_person(params: &mut Pppr, skeleton: &Skeleton, person: usize, by: Vec3, yaw: f64) {
    let joints = params.shape().joints.max(1);
    let (root, half) = (root_of(params.person(person), skeleton), 0.5 * yaw);
    let (s, c) = half.sin_cos();
    for joint in person * joints..(person + 1) * joints {
        let turned = turned_about(root, yaw, params.position(joint));
        params.set_vec3(Group::Position, joint, add(turned, by));
        if yaw == 0.0 {
            continue;
        }
        let velocity = turned_about([0.0; 3], yaw, params.velocity(joint));
        params.set_vec3(Group::Velocity, joint, velocity);
        let (length, [w, x, y, z]) = unit_quaternion(params.rotation(joint));
        let turned = [c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w];
        let length = if length > 0.0 { length } else { 1.0 };
        params.joint_mut(Group::Rotation, joint).copy_from_slice(&turned.map(|x| x * length));
    }
}

/// The limb of a joint (flat index) with the first flat index of its person; `None` where it is of the trunk.
pub(super) fn limb_of(params: &Pppr, skeleton: &Skeleton, joint: usize) -> Option<(Limb, usize)> {
    let joints = params.shape().joints.max(1);
    Some((Limb::of(skeleton, joint % joints)?, joint / joints * joints))
}

/// Turns a limb by `angle`, rad, about an axis of length 1 through its inner end. Its Gaussians move along as they are.
pub(super) fn turn_limb(params: &mut Pppr, (limb, first): &(Limb, usize), axis: Vec3, angle: f64) {
    let pivot = params.position(first + limb.inner);
    for joint in limb.carried.iter().map(|joint| first + joint) {
        let arm = sub(params.position(joint), pivot);
        params.set_vec3(Group::Position, joint, add(pivot, turned(arm, axis, angle)));
    }
}

/// `v`, turned about an axis of length 1: Rodrigues' formula.
fn turned(v: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    let (s, c) = angle.sin_cos();
    let along = scale(axis, dot(axis, v) * (1.0 - c));
    add(add(scale(v, c), scale(cross(axis, v), s)), along)
}

/// The horizontal axis across a bone: about it the bone is lifted. That to the left for an upright one.
pub(super) fn across(bone: Vec3) -> Vec3 {
    let axis = cross(bone, [0.0, 0.0, 1.0]);
    let length = norm(axis);
    if length < 1e-6 { [0.0, 1.0, 0.0] } else { scale(axis, 1.0 / length) }
}

/// The signed angle, rad, by which `from` turns into `to` about an axis of length 1.
pub(super) fn angle_about(axis: Vec3, from: Vec3, to: Vec3) -> f64 {
    let flat = |v: Vec3| sub(v, scale(axis, dot(axis, v)));
    let (a, b) = (flat(from), flat(to));
    dot(axis, cross(a, b)).atan2(dot(a, b))
}

/// The turn about the vertical axis that brings `from` nearest to `to`, rad, to the left; both of as many joints.
pub fn yaw_between(from: &[Vec3], to: &[Vec3]) -> f64 {
    let (a, b) = (mean(from), mean(to));
    let (mut s, mut c) = (0.0, 0.0);
    for (p, q) in from.iter().zip(to) {
        let (p, q) = (sub(*p, a), sub(*q, b));
        s += p[0] * q[1] - p[1] * q[0];
        c += p[0] * q[0] + p[1] * q[1];
    }
    s.atan2(c)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::body::PpprShape;

    fn body() -> (Skeleton, Pppr) {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features: 1 });
        for joint in 0..17 {
            let place = [3.0 + 0.03 * joint as f64, 0.2 - 0.05 * (joint % 4) as f64, 1.7 - 0.1 * joint as f64];
            params.set_vec3(Group::Position, joint, place);
            params.joint_mut(Group::Rotation, joint)[0] = 1.0;
        }
        (skeleton, params)
    }

    #[test]
    fn the_turn_between_two_poses_is_found() {
        let (skeleton, base) = body();
        for yaw in [-2.5, -0.3, 0.0, 1.0, 3.0] {
            let mut moved = base.clone();
            move_person(&mut moved, &skeleton, 0, [0.4, -0.2, 0.1], yaw);
            assert!((yaw_between(base.positions(), moved.positions()) - yaw).abs() < 1e-9, "{yaw}");
        }
    }

    #[test]
    fn a_limb_turns_about_its_inner_end_and_keeps_its_lengths() {
        let (skeleton, base) = body();
        let wrist = skeleton.joint("left_wrist").unwrap();
        let limb = limb_of(&base, &skeleton, wrist).unwrap();
        let ends = |params: &Pppr| sub(params.position(limb.0.outer), params.position(limb.0.inner));
        for (axis, angle) in [([0.0, 0.0, 1.0], 0.8), (across(ends(&base)), -0.5)] {
            let mut turned = base.clone();
            turn_limb(&mut turned, &limb, axis, angle);
            assert!((norm(ends(&turned)) - norm(ends(&base))).abs() < 1e-12);
            assert!((angle_about(axis, ends(&base), ends(&turned)) - angle).abs() < 1e-9);
            let moved = (0..17).filter(|&joint| turned.position(joint) != base.position(joint));
            assert!(moved.clone().count() > 0 && moved.into_iter().all(|joint| limb.0.carried.contains(&joint)));
        }
    }
}
