//! What image labels say of joints in metres: joints projected into a camera, and into the boxes drawn on radar maps.
//!
//! Both are pixels or shares and never a joint error: a camera's calibration is part of them. MMVR's published extrinsics
//! are contradictory (their matrices reflect, and no code shows in which direction they apply); a camera at the radar's
//! place that looks along its boresight puts the one labelled frame at hand closest to its labels, some 8 px off. So these
//! numbers compare fits with each other, to about 0.2 m at the person.

use super::assign::assign;
use crate::geometry::Vec3;
use crate::radar::{PinholeCamera, View};

/// How joints lie on image labels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reprojection {
    /// Mean distance of projected joints from their key points, px, over key points with a score above 0; persons paired
    /// so that the sum is smallest. Pixels of an image, never a joint error in mm.
    pub reprojection_px: Option<f64>,
    /// Share of projected joints inside the box of their person, 0..1; persons paired so that it is largest.
    pub box_coverage: Option<f64>,
}

/// Compares joints (flat, person by person, m) with image labels: `keypoints` (u px, v px, score) a person in the order of
/// the same joints, and `boxes` (u0, v0, u1, v1 px, score).
pub fn reprojection(
    camera: &PinholeCamera,
    joints: &[Vec3],
    joints_a_person: usize,
    keypoints: &[Vec<[f64; 3]>],
    boxes: &[[f64; 5]],
) -> Reprojection {
    if joints_a_person == 0 {
        return Reprojection::default();
    }
    let persons: Vec<Vec<Option<[f64; 2]>>> = joints
        .chunks_exact(joints_a_person)
        .map(|person| person.iter().map(|&p| camera.project(p)).collect())
        .collect();
    let distance = |a: usize, b: usize| keypoint_distance_px(&persons[a], &keypoints[b]);
    let pairs = assign(persons.len(), keypoints.len(), |a, b| distance(a, b).unwrap_or(f64::INFINITY));
    let inside = |a: usize, b: usize| share_inside(&persons[a], &boxes[b]);
    let boxed = assign(persons.len(), boxes.len(), |a, b| 1.0 - inside(a, b));
    Reprojection {
        reprojection_px: mean(pairs.into_iter().filter_map(|(a, b)| distance(a, b))),
        box_coverage: mean(boxed.into_iter().map(|(a, b)| inside(a, b))),
    }
}

/// Share of joints whose bin lies inside their person's labelled box on the map of `view`, 0..1; needs no camera. `boxes` are in
/// bins (axis-0 lo, axis-1 lo, axis-0 hi, axis-1 hi). `None` without persons or boxes, or on a map of other than two axes.
pub fn map_box_coverage(view: &View, joints: &[Vec3], joints_a_person: usize, boxes: &[[f64; 4]]) -> Option<f64> {
    if joints_a_person == 0 || view.axes.len() != 2 {
        return None;
    }
    let persons: Vec<Vec<Option<[f64; 2]>>> = joints
        .chunks_exact(joints_a_person)
        .map(|person| person.iter().map(|&p| <[f64; 2]>::try_from(view.bins_of(p)).ok()).collect())
        .collect();
    let inside = |a: usize, b: usize| {
        let [row0, column0, row1, column1] = boxes[b];
        share_inside(&persons[a], &[row0, column0, row1, column1, 1.0])
    };
    let pairs = assign(persons.len(), boxes.len(), |a, b| 1.0 - inside(a, b));
    mean(pairs.into_iter().map(|(a, b)| inside(a, b)))
}

fn keypoint_distance_px(person: &[Option<[f64; 2]>], keypoints: &[[f64; 3]]) -> Option<f64> {
    if person.len() != keypoints.len() {
        return None;
    }
    let seen = person.iter().zip(keypoints).filter(|(_, point)| point[2] > 0.0);
    mean(seen.filter_map(|(joint, point)| joint.map(|[u, v]| (u - point[0]).hypot(v - point[1]))))
}

fn share_inside(person: &[Option<[f64; 2]>], [u0, v0, u1, v1, _]: &[f64; 5]) -> f64 {
    let within = |x: f64, a: f64, b: f64| x >= a.min(b) && x <= a.max(b);
    let inside = person.iter().flatten().filter(|[u, v]| within(*u, *u0, *u1) && within(*v, *v0, *v1)).count();
    inside as f64 / person.len().max(1) as f64
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where a metric is undefined")]
    use super::*;

    /// MMVR's.
    const CAMERA: PinholeCamera = PinholeCamera { focal_px: [379.476, 379.476], centre_px: [322.457, 241.627] };

    fn person(left_m: f64) -> Vec<Vec3> {
        vec![[3.0, left_m, 0.5], [3.0, left_m + 0.2, 0.0], [3.0, left_m - 0.2, -0.5]]
    }

    fn seen(person: &[Vec3]) -> Vec<[f64; 3]> {
        person.iter().map(|&p| CAMERA.project(p).unwrap()).map(|[u, v]| [u, v, 1.0]).collect()
    }

    #[test]
    fn left_is_left_and_up_is_up_in_the_image() {
        let [u, v] = CAMERA.project([2.0, 0.5, 0.5]).unwrap();
        assert!((u - (322.457 - 379.476 * 0.25)).abs() < 1e-9 && (v - (241.627 - 379.476 * 0.25)).abs() < 1e-9);
        assert_eq!(CAMERA.project([-1.0, 0.0, 0.0]), None);
        assert_eq!(CAMERA.project([f64::NAN, 0.0, 0.0]), None);
    }

    #[test]
    fn swapped_persons_find_their_labels_and_unseen_key_points_do_not_count() {
        let (a, b) = (person(-0.6), person(0.6));
        let joints = [a.clone(), b.clone()].concat();
        let mut labels = vec![seen(&b), seen(&a)];
        labels[0][1] = [0.0, 0.0, 0.0];
        let exact = reprojection(&CAMERA, &joints, 3, &labels, &[]);
        assert!(exact.reprojection_px.unwrap() < 1e-9);
        assert_eq!(exact.box_coverage, None);
        labels[1].iter_mut().for_each(|point| point[0] += 10.0);
        let off = reprojection(&CAMERA, &joints, 3, &labels, &[]);
        assert!((off.reprojection_px.unwrap() - 5.0).abs() < 1e-9, "one person of two is off by 10 px");
    }

    #[test]
    fn coverage_is_the_share_inside_the_own_box() {
        let joints = [person(-0.6), person(0.6)].concat();
        let whole = |points: &[[f64; 3]]| {
            let lo = |k: usize| points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min) - 1.0;
            let hi = |k: usize| points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + 1.0;
            [lo(0), lo(1), hi(0), hi(1), 0.9]
        };
        let mut boxes = [whole(&seen(&person(0.6))), whole(&seen(&person(-0.6)))];
        assert_eq!(reprojection(&CAMERA, &joints, 3, &[], &boxes).box_coverage, Some(1.0));
        boxes[0][1] = CAMERA.project(person(0.6)[1]).unwrap()[1] - 1.0;
        let partly = reprojection(&CAMERA, &joints, 3, &[], &boxes).box_coverage.unwrap();
        assert!((partly - 5.0 / 6.0).abs() < 1e-12);
        assert_eq!(reprojection(&CAMERA, &[], 3, &[], &boxes), Reprojection::default());
    }
}
