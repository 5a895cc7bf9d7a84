//! Rigid transforms between points: Horn's closed form, and the transform on which most pairs agree.

use crate::geometry::{
    Pose, Vec3, add, cross, mat_mul, mat_vec, norm, rotation_from_quaternion, scale, sub, transpose,
};

/// Triples that are tried.
const TRIES: usize = 2000;
/// Twice the area of a triple of points that tells a turn, m².
const SMALLEST_M2: f64 = 0.15;
/// Rounds of weighting at most.
const ROUNDS: usize = 30;
/// Sweeps of Jacobi's method: a matrix of four converges in a few.
const SWEEPS: usize = 30;

/// The same place in the room's frame and in the radar's, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    pub(super) room: Vec3,
    pub(super) radar: Vec3,
}

impl Pair {
    fn apart_m(&self, pose: &Pose) -> f64 {
        norm(sub(pose.view_from_world(self.room), self.radar))
    }
}

/// A transform and the pairs that agree with it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Consensus {
    pub(super) pose: Pose,
    /// Their places among the pairs.
    pub(super) agreeing: Vec<usize>,
}

/// The transform with which most pairs are at most `agree_m` apart; `None` where no triple of pairs tells a turn.
pub(super) fn consensus(pairs: &[Pair], agree_m: f64) -> Option<Consensus> {
    let agreeing = |pose: &Pose, most: f64| -> Vec<usize> {
        (0..pairs.len()).filter(|&k| pairs.get(k).is_some_and(|pair| pair.apart_m(pose) <= most)).collect()
    };
    // Of as many the nearer: what is left over counts for a part.
    let score = |pose: &Pose| {
        let share = |pair: &Pair| (1.0 - (pair.apart_m(pose) / agree_m).powi(2)).max(0.0);
        pairs.iter().map(share).sum::<f64>()
    };
    let mut draw = Draw(0x5EED);
    let mut best: Option<(f64, Pose)> = None;
    for _ in 0..TRIES {
        let triple = [0; 3].map(|_| pairs.get(draw.below(pairs.len())).copied());
        let [Some(a), Some(b), Some(c)] = triple else { return None };
        if norm(cross(sub(b.room, a.room), sub(c.room, a.room))) < SMALLEST_M2 {
            continue;
        }
        let Some(pose) = fitted([a, b, c].into_iter().map(|pair| (pair, 1.0))) else { continue };
        let score = score(&pose);
        if best.is_none_or(|(known, _)| score > known) {
            best = Some((score, pose));
        }
    }
    let (_, mut pose) = best?;
    for _ in 0..ROUNDS {
        // Tukey's weight.
        let weight = |pair: &Pair| (1.0 - (pair.apart_m(&pose) / agree_m).powi(2)).max(0.0).powi(2);
        let weighted: Vec<(Pair, f64)> = pairs.iter().map(|pair| (*pair, weight(pair))).collect();
        let Some(next) = fitted(weighted.into_iter()) else { break };
        let moved =
            pairs.iter().map(|pair| norm(sub(next.view_from_world(pair.room), pose.view_from_world(pair.room))));
        let settled = moved.fold(0.0, f64::max) < 1e-5;
        pose = next;
        if settled {
            break;
        }
    }
    Some(Consensus { agreeing: agreeing(&pose, agree_m), pose })
}

/// The rigid transform with the least weighted squares (Horn 1987); `None` without weight.
pub(super) fn fitted(pairs: impl Iterator<Item = (Pair, f64)> + Clone) -> Option<Pose> {
    let total: f64 = pairs.clone().map(|(_, weight)| weight).sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let middle = |of: fn(&Pair) -> Vec3| {
        let sum = pairs.clone().fold([0.0; 3], |sum, (pair, weight)| add(sum, scale(of(&pair), weight)));
        scale(sum, 1.0 / total)
    };
    let (from, to) = (middle(|pair| pair.room), middle(|pair| pair.radar));
    let mut s = [[0.0; 3]; 3];
    for (pair, weight) in pairs {
        let (a, b) = (sub(pair.room, from), sub(pair.radar, to));
        for (row, a) in s.iter_mut().zip(a) {
            for (cell, b) in row.iter_mut().zip(b) {
                *cell += weight * a * b;
            }
        }
    }
    let n = [
        [s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
        [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
        [s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
        [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]],
    ];
    let rotation = rotation_from_quaternion(largest_eigenvector(n));
    Some(Pose { rotation, translation: sub(to, mat_vec(&rotation, from)) })
}

/// The eigenvector of the largest eigenvalue of a symmetric matrix, by Jacobi's rotations.
fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut v = [[0.0; 4]; 4];
    (0..4).for_each(|k| v[k][k] = 1.0);
    for _ in 0..SWEEPS {
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q].abs() < 1e-300 {
                    continue;
                }
                let theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                for k in 0..4 {
                    (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                }
                for row in &mut v {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    let largest = (0..4).max_by(|&i, &j| a[i][i].total_cmp(&a[j][j])).unwrap_or(0);
    v.map(|row| row[largest])
}

/// The angle by which one transform turns more than the other, rad.
pub(super) fn angle_between(a: &Pose, b: &Pose) -> f64 {
    let turn = mat_mul(&a.rotation, &transpose(&b.rotation));
    (0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0)).clamp(-1.0, 1.0).acos()
}

/// Numbers that look drawn and are the same every time (`splitmix64`).
struct Draw(u64);

impl Draw {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ (x >> 31)) % n.max(1) as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    fn known() -> Pose {
        let rotation = rotation_from_quaternion([0.3, -0.7, 0.5, 0.2]);
        Pose { rotation, translation: [1.0, -2.0, 0.5] }
    }

    /// Somebody who walks about on the floor: all points nearly in a plane.
    fn walk(count: usize) -> Vec<Pair> {
        (0..count)
            .map(|k| {
                let t = k as f64 * 0.37;
                let room = [2.0 * t.cos(), 1.2 + 0.02 * (3.0 * t).sin(), 1.5 * (1.3 * t).sin()];
                Pair { room, radar: known().view_from_world(room) }
            })
            .collect()
    }

    #[test]
    fn exact_pairs_give_the_transform_back() {
        let pose = fitted(walk(40).into_iter().map(|pair| (pair, 1.0))).unwrap();
        assert!(angle_between(&pose, &known()) < 1e-7);
        assert!(norm(sub(pose.translation, known().translation)) < 1e-9);
    }

    #[test]
    fn a_third_of_the_pairs_may_be_anything() {
        let mut pairs = walk(90);
        for (k, pair) in pairs.iter_mut().enumerate() {
            let noise = |n: usize| ((k * 7 + n * 13) % 11) as f64 / 11.0 - 0.45;
            pair.radar = add(pair.radar, [0.1 * noise(0), 0.1 * noise(1), 0.1 * noise(2)]);
            if k % 3 == 0 {
                pair.radar = [4.0 * noise(3), 4.0 * noise(4), 2.0 + noise(5)];
            }
        }
        let found = consensus(&pairs, 0.3).unwrap();
        assert!(found.agreeing.len() >= 60, "{}", found.agreeing.len());
        assert!(angle_between(&found.pose, &known()) < 0.03, "{}", angle_between(&found.pose, &known()));
        let off = norm(sub(found.pose.view_from_world([0.0, 1.2, 0.0]), known().view_from_world([0.0, 1.2, 0.0])));
        assert!(off < 0.03, "{off}");
    }

    #[test]
    fn points_on_a_line_tell_nothing() {
        let pairs: Vec<Pair> =
            (0..30).map(|k| [0.1 * f64::from(k), 1.0, 0.0]).map(|at| Pair { room: at, radar: at }).collect();
        assert_eq!(consensus(&pairs, 0.3), None);
        assert_eq!(consensus(&[], 0.3), None);
    }
}
