//! How good a fit is: joint errors with and without alignment. (The IoU of masks belongs to the objective.)
//!
//! The alignment is Horn's: the rotation between two centred point sets is the eigenvector of the largest eigenvalue of
//! a symmetric 4×4 matrix, found by Jacobi rotations. It cannot reflect, so a mirrored skeleton stays wrong.

use super::assign::assign;
use crate::geometry::{Mat3, Vec3, add, dot, mat_vec, mean, mean_distance, norm, rotation_from_quaternion, scale, sub};

const MM_PER_M: f64 = 1000.0;
/// What a person who is missed or invented costs, and the most that one who is found does, mm.
pub const OSPA_CUTOFF_MM: f64 = 500.0;

/// Errors of an estimate against truth, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointErrors {
    /// Mean over joints of the distance to truth.
    pub majpe_mm: f64,
    /// The same after the best rotation, translation and scale of each person.
    pub pa_majpe_mm: f64,
    /// Optimal sub-pattern assignment (Schuhmacher, Vo, Vo, 2008) of order 1: the mean over the larger number of persons of what
    /// each costs, its MAJPE up to [`OSPA_CUTOFF_MM`] where it is paired and [`OSPA_CUTOFF_MM`] where it is missed or invented.
    pub ospa_mm: f64,
}

/// Mean distance of corresponding joints (m), in mm; `None` where the lists are empty or differ in length.
pub fn majpe_mm(estimate: &[Vec3], truth: &[Vec3]) -> Option<f64> {
    if estimate.is_empty() || estimate.len() != truth.len() {
        return None;
    }
    Some(MM_PER_M * mean_distance(estimate, truth))
}

/// [`majpe_mm`] after the similarity transform of `estimate` that fits `truth` best in least squares.
pub fn pa_majpe_mm(estimate: &[Vec3], truth: &[Vec3]) -> Option<f64> {
    majpe_mm(&aligned(estimate, truth)?, truth)
}

/// Errors of several persons of `joints` joints each (flat lists, person by person). Persons carry no identity: they are
/// paired so that the sum of their distances is smallest, and where the counts differ the smaller number of persons counts in
/// MAJPE and PA-MAJPE; those who are missed or invented count in OSPA, whose pairs are those of the smallest sum up to its cutoff.
/// `None` where either list is empty or no whole number of persons.
pub fn joint_errors(estimate: &[Vec3], truth: &[Vec3], joints: usize) -> Option<JointErrors> {
    if joints == 0 || !estimate.len().is_multiple_of(joints) || !truth.len().is_multiple_of(joints) {
        return None;
    }
    let estimated: Vec<&[Vec3]> = estimate.chunks_exact(joints).collect();
    let true_persons: Vec<&[Vec3]> = truth.chunks_exact(joints).collect();
    let pairs = person_pairs(estimate, truth, joints);
    let count = pairs.len() as f64;
    let ospa_mm = ospa_mm(&estimated, &true_persons);
    let mut errors = JointErrors { majpe_mm: 0.0, pa_majpe_mm: 0.0, ospa_mm };
    for &(a, b) in &pairs {
        errors.majpe_mm += majpe_mm(estimated[a], true_persons[b])? / count;
        errors.pa_majpe_mm += pa_majpe_mm(estimated[a], true_persons[b])? / count;
    }
    (!pairs.is_empty()).then_some(errors)
}

/// Who is who among persons of `joints` joints each (flat lists, person by person): pairs (estimated, true) whose distances have the
/// smallest sum, ascending by the first; of the longer list some stay without a partner.
pub fn person_pairs(estimate: &[Vec3], truth: &[Vec3], joints: usize) -> Vec<(usize, usize)> {
    let persons = |of: &[Vec3]| of.len() / joints.max(1);
    assign(persons(estimate), persons(truth), |a, b| {
        let [estimated, annotated] = [(estimate, a), (truth, b)].map(|(of, k)| &of[k * joints..(k + 1) * joints]);
        majpe_mm(estimated, annotated).unwrap_or(f64::INFINITY)
    })
}

fn ospa_mm(estimated: &[&[Vec3]], true_persons: &[&[Vec3]]) -> f64 {
    let cost = |a: usize, b: usize| {
        majpe_mm(estimated[a], true_persons[b]).map_or(OSPA_CUTOFF_MM, |mm| mm.min(OSPA_CUTOFF_MM))
    };
    let (most, least) = (estimated.len().max(true_persons.len()), estimated.len().min(true_persons.len()));
    let paired: f64 = assign(estimated.len(), true_persons.len(), cost).into_iter().map(|(a, b)| cost(a, b)).sum();
    (paired + (most - least) as f64 * OSPA_CUTOFF_MM) / most.max(1) as f64
}

/// Mean distance of each joint over the pairs of persons that [`joint_errors`] makes, mm, in the order of the joints; none where it
/// has no answer.
pub fn paired_joint_distances_mm(estimate: &[Vec3], truth: &[Vec3], joints: usize) -> Vec<f64> {
    if joint_errors(estimate, truth, joints).is_none() {
        return Vec::new();
    }
    let estimated: Vec<&[Vec3]> = estimate.chunks_exact(joints).collect();
    let true_persons: Vec<&[Vec3]> = truth.chunks_exact(joints).collect();
    let pairs = person_pairs(estimate, truth, joints);
    let distance = |joint: usize, &(a, b): &(usize, usize)| norm(sub(estimated[a][joint], true_persons[b][joint]));
    let mean_of = |joint: usize| pairs.iter().map(|pair| distance(joint, pair)).sum::<f64>() / pairs.len() as f64;
    (0..joints).map(|joint| MM_PER_M * mean_of(joint)).collect()
}

/// `estimate` after the similarity transform (no reflection) that brings it closest to `truth`.
fn aligned(estimate: &[Vec3], truth: &[Vec3]) -> Option<Vec<Vec3>> {
    let onto = Similarity::between(estimate, truth)?;
    Some(estimate.iter().map(|&p| onto.of(p)).collect())
}

/// A similarity transform: a turn, a scale and a shift; it cannot reflect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    from: Vec3,
    to: Vec3,
    rotation: Mat3,
    factor: f64,
}

impl Similarity {
    /// The one that brings `from` closest to `to` in least squares; `None` where the lists are empty or differ in length.
    pub fn between(from: &[Vec3], to: &[Vec3]) -> Option<Self> {
        if from.is_empty() || from.len() != to.len() {
            return None;
        }
        let (from_middle, to_middle) = (mean(from), mean(to));
        let centred: Vec<Vec3> = from.iter().map(|&p| sub(p, from_middle)).collect();
        let target: Vec<Vec3> = to.iter().map(|&p| sub(p, to_middle)).collect();
        let rotation = rotation_from_quaternion(horn_quaternion(&centred, &target));
        let size: f64 = centred.iter().map(|&p| dot(p, p)).sum();
        let along: f64 = centred.iter().zip(&target).map(|(&a, &b)| dot(mat_vec(&rotation, a), b)).sum();
        let factor = if size > 0.0 { along / size } else { 0.0 };
        Some(Self { from: from_middle, to: to_middle, rotation, factor })
    }

    /// Where it takes a point.
    pub fn of(&self, p: Vec3) -> Vec3 {
        add(scale(mat_vec(&self.rotation, sub(p, self.from)), self.factor), self.to)
    }
}

/// The quaternion (w, x, y, z) of the rotation that turns `from` onto `to`, both centred.
fn horn_quaternion(from: &[Vec3], to: &[Vec3]) -> [f64; 4] {
    let s: [[f64; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|k| from.iter().zip(to).map(|(a, b)| a[i] * b[k]).sum()));
    let n = [
        [s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
        [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
        [s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
        [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]],
    ];
    largest_eigenvector(n)
}

/// Cyclic Jacobi rotations on a symmetric 4×4 matrix; a handful of sweeps reach machine precision.
fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut vectors: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k))));
    // What is smaller moves no digit of what it would be turned into.
    let negligible = 1e-18 * a.iter().flatten().map(|x| x.abs()).sum::<f64>();
    for _sweep in 0..30 {
        for p in 0..4 {
            for q in p + 1..4 {
                if a[p][q].abs() > negligible {
                    rotate(&mut a, &mut vectors, p, q);
                }
            }
        }
    }
    let best = (0..4).max_by(|&i, &k| a[i][i].total_cmp(&a[k][k])).unwrap_or(0);
    std::array::from_fn(|i| vectors[i][best])
}

fn rotate(a: &mut [[f64; 4]; 4], vectors: &mut [[f64; 4]; 4], p: usize, q: usize) {
    let theta = 0.5 * (2.0 * a[p][q]).atan2(a[q][q] - a[p][p]);
    let (s, c) = theta.sin_cos();
    for row in a.iter_mut().chain(vectors.iter_mut()) {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for k in 0..4 {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where a metric is undefined")]
    use super::*;

    const BODY: [Vec3; 5] = [[0.0, 0.0, 1.7], [0.1, 0.2, 1.4], [0.0, -0.2, 1.4], [0.05, 0.1, 0.0], [-0.3, -0.15, 0.1]];

    #[test]
    fn majpe_is_the_mean_distance() {
        let moved: Vec<Vec3> = BODY.iter().map(|&p| add(p, [0.03, 0.0, -0.04])).collect();
        assert!((majpe_mm(&moved, &BODY).unwrap() - 50.0).abs() < 1e-9);
        assert_eq!(majpe_mm(&[], &[]), None);
        assert_eq!(majpe_mm(&BODY, &BODY[1..]), None);
    }

    #[test]
    fn a_similarity_transform_costs_nothing_after_alignment() {
        for q in [[1.0, 0.0, 0.0, 0.0], [0.3, -0.5, 0.8, 0.1], [0.0, 0.0, 0.0, 1.0]] {
            let rotation = rotation_from_quaternion(q);
            let moved: Vec<Vec3> =
                BODY.iter().map(|&p| add(scale(mat_vec(&rotation, p), 1.3), [2.0, -1.0, 0.5])).collect();
            assert!(majpe_mm(&moved, &BODY).unwrap() > 500.0);
            assert!(pa_majpe_mm(&moved, &BODY).unwrap() < 1e-9, "{q:?}");
        }
    }

    #[test]
    fn a_mirrored_body_stays_wrong() {
        let mirrored = BODY.map(|[x, y, z]| [x, -y, z]);
        assert!(pa_majpe_mm(&mirrored, &BODY).unwrap() > 20.0);
    }

    #[test]
    fn alignment_is_least_squares() {
        let mut bent = BODY;
        bent[0][0] += 0.2;
        bent[4][2] -= 0.1;
        let best = aligned(&bent, &BODY).unwrap();
        let cost = |points: &[Vec3]| points.iter().zip(&BODY).map(|(&a, &b)| dot(sub(a, b), sub(a, b))).sum::<f64>();
        for axis in 0..3 {
            for amount in [-1e-3, 1e-3] {
                let mut q = [1.0, 0.0, 0.0, 0.0];
                q[axis + 1] = amount;
                let turn = rotation_from_quaternion(q);
                let middle = mean(&BODY);
                let turned: Vec<Vec3> = best.iter().map(|&p| add(mat_vec(&turn, sub(p, middle)), middle)).collect();
                assert!(cost(&turned) > cost(&best));
                let grown: Vec<Vec3> = best.iter().map(|&p| add(scale(sub(p, middle), 1.0 + amount), middle)).collect();
                assert!(cost(&grown) > cost(&best));
            }
        }
    }

    #[test]
    fn persons_are_paired_by_distance() {
        let far: Vec<Vec3> = BODY.iter().map(|&p| add(p, [0.0, 3.0, 0.0])).collect();
        let truth = [BODY.to_vec(), far.clone()].concat();
        let swapped = [far, BODY.to_vec()].concat();
        assert!(joint_errors(&swapped, &truth, 5).unwrap().majpe_mm < 1e-9);
        assert!(joint_errors(&BODY, &truth, 5).unwrap().pa_majpe_mm < 1e-9);
        assert_eq!(joint_errors(&BODY, &truth, 4), None);
    }

    #[test]
    fn whoever_is_missed_or_invented_costs_the_cutoff() {
        let shifted = |x: f64| BODY.iter().map(move |&p| add(p, [x, 0.0, 0.0]));
        let truth: Vec<Vec3> = shifted(0.0).chain(shifted(2.0)).collect();
        let ospa = |estimate: Vec<Vec3>| joint_errors(&estimate, &truth, 5).unwrap().ospa_mm;
        assert!((ospa(shifted(0.1).chain(shifted(2.0)).collect()) - 50.0).abs() < 1e-9, "two found");
        assert!((ospa(shifted(0.1).collect()) - 300.0).abs() < 1e-9, "one of two missed");
        let invented = shifted(0.0).chain(shifted(2.0)).chain(shifted(4.0)).collect();
        assert!((ospa(invented) - 500.0 / 3.0).abs() < 1e-9, "a third invented");
        assert!((ospa(shifted(0.0).chain(shifted(9.0)).collect()) - 250.0).abs() < 1e-9, "who is far off is no find");
    }

    #[test]
    fn eight_swapped_persons_find_their_own() {
        let at = |k: usize| BODY.iter().map(move |&p| add(p, [0.4 * k as f64, (k % 3) as f64, 0.0]));
        let truth: Vec<Vec3> = (0..8).flat_map(at).collect();
        let estimate: Vec<Vec3> = [3, 7, 0, 5, 1, 6, 2, 4].into_iter().flat_map(at).collect();
        assert!(joint_errors(&estimate, &truth, 5).unwrap().majpe_mm < 1e-9);
    }

    #[test]
    fn the_whole_is_paired_best_and_not_the_closest_two_first() {
        // On a line: truth at 0 and 1.0, estimates at 0.6 and 2.0. Closest first pairs 0.6 with 1.0 and leaves 2.0 m.
        let at = |x: f64| BODY.iter().map(move |&p| add(p, [x, 0.0, 0.0]));
        let truth: Vec<Vec3> = at(0.0).chain(at(1.0)).collect();
        let estimate: Vec<Vec3> = at(0.6).chain(at(2.0)).collect();
        assert!((joint_errors(&estimate, &truth, 5).unwrap().majpe_mm - 800.0).abs() < 1e-6);
    }
}
