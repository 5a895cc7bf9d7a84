//! A standing, neutral body on any skeleton, from the skeleton's own joint names and bone lengths.
//!
//! Names give a first place (proportions after Winter, 1.70 m tall); a joint with an unknown name takes the mean of its
//! neighbours. Then the bones are brought to their reference lengths by letting all of them pull at once, which keeps
//! left and right alike.

use crate::body::{Side, Skeleton};
use crate::geometry::{Vec3, add, add_scaled, norm, scale, sub};

/// Height of the body that the table describes, m.
const TABLE_HEIGHT_M: f64 = 1.70;
const RELAXATIONS: usize = 400;
/// Who does not reach this share of a standing body's height sits, crouches or lies.
const UPRIGHT_SHARE: f64 = 0.93;

/// The body: x forward, y to its left, z up from the floor, m.
#[derive(Debug)]
pub(super) struct Template {
    /// One position a joint.
    pub joints: Vec<Vec3>,
    /// How far the top of the head lies above the highest joint when standing, m.
    pub crown_m: f64,
}

impl Template {
    pub(super) fn new(skeleton: &Skeleton) -> Self {
        let mut joints = named_joints(skeleton);
        let size = size_ratio(skeleton, &joints);
        for joint in &mut joints {
            *joint = scale(*joint, size);
        }
        let floor = lowest(&joints);
        relax(skeleton, &mut joints);
        let sunk = floor - lowest(&joints);
        for joint in &mut joints {
            joint[2] += sunk;
        }
        let crown_m = (TABLE_HEIGHT_M * size - highest(&joints)).max(0.0);
        Self { joints, crown_m }
    }

    /// Height of the top of the head above the soles, m.
    pub(super) fn top_m(&self) -> f64 {
        highest(&self.joints) + self.crown_m
    }

    /// Whether `joints`, those of somebody of this size, do not reach as high as those who stand do.
    pub(super) fn is_bent(&self, joints: &[Vec3]) -> bool {
        highest(joints) - lowest(joints) < UPRIGHT_SHARE * (highest(&self.joints) - lowest(&self.joints))
    }

    /// Height of the body's middle above its soles: half way to the top of the head, m.
    pub(super) fn middle_m(&self) -> f64 {
        0.5 * self.top_m()
    }

    /// How far the mean of the joints lies above the body's middle, m.
    pub(super) fn mean_over_middle_m(&self) -> f64 {
        let mean = self.joints.iter().map(|j| j[2]).sum::<f64>() / self.joints.len().max(1) as f64;
        mean - self.middle_m()
    }

    /// Where the middle of this body is above the floor when the mean of its joints is where it would be if the body were
    /// `stature_m` tall, m: bones have their own lengths, whoever stands there.
    pub(super) fn middle_as_tall_as_m(&self, stature_m: f64) -> f64 {
        let mean = self.middle_m() + self.mean_over_middle_m();
        mean * stature_m / self.top_m() - self.mean_over_middle_m()
    }

    /// The joints of a person who stands at `at` (the body's middle, half way from soles to crown, m, world) and looks along
    /// `forward`, a unit vector on the floor.
    pub(super) fn facing(&self, at: Vec3, forward: [f64; 2]) -> Vec<Vec3> {
        let middle = self.middle_m();
        let place = |j: &Vec3| {
            [
                at[0] + forward[0] * j[0] - forward[1] * j[1],
                at[1] + forward[1] * j[0] + forward[0] * j[1],
                at[2] + j[2] - middle,
            ]
        };
        self.joints.iter().map(place).collect()
    }
}

fn lowest(joints: &[Vec3]) -> f64 {
    joints.iter().map(|j| j[2]).fold(f64::INFINITY, f64::min)
}

fn highest(joints: &[Vec3]) -> f64 {
    joints.iter().map(|j| j[2]).fold(f64::NEG_INFINITY, f64::max)
}

/// Forward, sideways (to the joint's own side) and height of a body part, m, for a body of [`TABLE_HEIGHT_M`].
fn part(word: &str) -> Option<Vec3> {
    Some(match word {
        "nose" => [0.10, 0.0, 1.58],
        "eye" => [0.08, 0.03, 1.62],
        "ear" => [0.0, 0.075, 1.60],
        "head" => [0.02, 0.0, 1.62],
        "top" => [0.0, 0.0, TABLE_HEIGHT_M],
        "jaw" => [0.05, 0.0, 1.52],
        "neck" => [0.0, 0.0, 1.46],
        "collar" | "clavicle" => [0.0, 0.08, 1.42],
        "thorax" | "chest" => [0.0, 0.0, 1.38],
        "shoulder" => [0.0, 0.18, 1.39],
        "elbow" => [-0.03, 0.20, 1.10],
        "wrist" => [0.04, 0.20, 0.86],
        "hand" => [0.06, 0.20, 0.78],
        "spine" | "torso" | "belly" => [0.0, 0.0, 1.16],
        "pelvis" | "root" => [0.0, 0.0, 0.93],
        "hip" => [0.0, 0.11, 0.91],
        "knee" => [0.045, 0.11, 0.49],
        "ankle" => [0.0, 0.11, 0.07],
        "heel" => [-0.05, 0.11, 0.02],
        "foot" | "toe" => [0.15, 0.12, 0.02],
        _ => return None,
    })
}

fn named_joints(skeleton: &Skeleton) -> Vec<Vec3> {
    let mut places: Vec<Option<Vec3>> = (0..skeleton.joints.len()).map(|joint| named_joint(skeleton, joint)).collect();
    // Unknown names grow inward from the joints that are known.
    while let Some((joint, place)) = (0..places.len())
        .filter(|&joint| places[joint].is_none())
        .find_map(|joint| neighbour_mean(skeleton, &places, joint).map(|place| (joint, place)))
    {
        places[joint] = Some(place);
    }
    places.into_iter().map(|place| place.unwrap_or([0.0, 0.0, 1.0])).collect()
}

fn named_joint(skeleton: &Skeleton, joint: usize) -> Option<Vec3> {
    let name = skeleton.joints.get(joint)?.to_lowercase();
    let side = skeleton.side(joint);
    let mut words = name.split(['_', ' ', '-']).rev();
    // A hip without a side is the middle of the two (Human3.6M).
    let [x, y, z] = if side == Side::Middle && name == "hip" { part("pelvis")? } else { words.find_map(part)? };
    Some(match side {
        Side::Left => [x, y, z],
        Side::Right => [x, -y, z],
        Side::Middle => [x, 0.0, z],
    })
}

fn neighbour_mean(skeleton: &Skeleton, places: &[Option<Vec3>], joint: usize) -> Option<Vec3> {
    let neighbours = skeleton.bones.iter().filter_map(|&[m, n]| match joint {
        _ if joint == m => places[n],
        _ if joint == n => places[m],
        _ => None,
    });
    let (count, sum) = neighbours.fold((0, [0.0; 3]), |(count, sum), place| (count + 1, add(sum, place)));
    (count > 0).then(|| scale(sum, 1.0 / f64::from(count)))
}

/// Mean ratio of the reference lengths to those of the table.
fn size_ratio(skeleton: &Skeleton, joints: &[Vec3]) -> f64 {
    let table: f64 = skeleton.bones.iter().map(|&[m, n]| norm(sub(joints[m], joints[n]))).sum();
    let reference: f64 = skeleton.bone_lengths_m.iter().sum();
    if table > 0.0 && reference > 0.0 { reference / table } else { 1.0 }
}

/// All bones pull at once towards their lengths; a joint takes the mean of what its bones want.
pub(super) fn relax(skeleton: &Skeleton, joints: &mut [Vec3]) {
    let mut degree = vec![0.0_f64; joints.len()];
    for &[m, n] in &skeleton.bones {
        degree[m] += 1.0;
        degree[n] += 1.0;
    }
    for _ in 0..RELAXATIONS {
        let mut moves = vec![[0.0; 3]; joints.len()];
        for (&[m, n], &reference) in skeleton.bones.iter().zip(&skeleton.bone_lengths_m) {
            let e = sub(joints[m], joints[n]);
            let length = norm(e);
            if length > 0.0 {
                let half = 0.5 * (reference - length) / length;
                add_scaled(&mut moves[m], e, half);
                add_scaled(&mut moves[n], e, -half);
            }
        }
        for (joint, (step, degree)) in joints.iter_mut().zip(moves.iter().zip(&degree)) {
            add_scaled(joint, *step, 1.0 / degree.max(1.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skeleton(names: &[&str], bones: &[[usize; 2]], lengths: &[f64]) -> Skeleton {
        Skeleton {
            joints: names.iter().map(|&n| n.to_owned()).collect(),
            bones: bones.to_vec(),
            bone_lengths_m: lengths.to_vec(),
            angles: vec![],
        }
    }

    #[test]
    fn bones_have_their_lengths_and_sides_are_alike() {
        let legs = skeleton(
            &["pelvis", "left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle"],
            &[[0, 1], [1, 2], [2, 3], [0, 4], [4, 5], [5, 6]],
            &[0.13, 0.47, 0.40, 0.13, 0.47, 0.40],
        );
        let body = Template::new(&legs);
        for (&[m, n], want) in legs.bones.iter().zip(&legs.bone_lengths_m) {
            assert!((norm(sub(body.joints[m], body.joints[n])) - want).abs() < 1e-3);
        }
        for joint in 1..4 {
            let ([x, y, z], [rx, ry, rz]) = (body.joints[joint], body.joints[joint + 3]);
            assert!((x - rx).abs() < 1e-12 && (y + ry).abs() < 1e-12 && (z - rz).abs() < 1e-12);
            assert!(y > 0.0, "left is left");
        }
        assert!(body.joints[1][2] > body.joints[2][2] && body.joints[2][2] > body.joints[3][2]);
    }

    #[test]
    fn unknown_names_sit_between_their_neighbours() {
        let chain = skeleton(&["neck", "gizmo", "pelvis"], &[[0, 1], [1, 2]], &[0.265, 0.265]);
        let body = Template::new(&chain);
        assert!((body.joints[1][2] - f64::midpoint(body.joints[0][2], body.joints[2][2])).abs() < 1e-6);
    }

    #[test]
    fn faces_the_radar() {
        let face = skeleton(&["nose", "left_shoulder", "right_shoulder"], &[[0, 1], [0, 2]], &[0.25, 0.25]);
        let joints = Template::new(&face).facing([3.0, 1.0, 0.0], [-3.0 / 10f64.sqrt(), -1.0 / 10f64.sqrt()]);
        assert!(joints[0][0].hypot(joints[0][1]) < joints[1][0].hypot(joints[1][1]), "the nose is nearest");
        // Looking back along −x, the person's left is the radar's right: smaller azimuth.
        assert!(joints[1][1].atan2(joints[1][0]) < joints[2][1].atan2(joints[2][0]));
    }
}
