//! Ridge regression of the limbs over people with truth.

use super::{ACROSS, AWAY, BodyFrame, INPUTS, LimbMap, PARTS, Parts, Reading, UP, inputs};
use crate::body::Pppr;
use crate::geometry::{Vec3, add, norm, sub};
use crate::mhp::Problem;
use nalgebra::{Cholesky, DMatrix};

/// A start whose middle is farther than this from the person's, m, stands elsewhere: it says nothing of limbs.
const ELSEWHERE_M: f64 = 0.4;

/// What one frame teaches.
#[derive(Debug, Clone, PartialEq)]
pub struct LimbLesson {
    inputs: Vec<f32>,
    /// How far each part is from where the start has it: away, to the left, up, m.
    ways: [Vec3; PARTS],
}

impl LimbLesson {
    /// Of a frame with one person whose joints are `truth` (world frame, m) and whose start is `start`; `None` where the
    /// views or the skeleton say nothing of the limbs, or the start stands elsewhere.
    pub fn of(problem: &Problem, start: &Pppr, truth: &[Vec3]) -> Option<Self> {
        let parts = Parts::of(&problem.skeleton)?;
        let joints: Vec<Vec3> = (0..start.shape().joints).map(|joint| start.position(joint)).collect();
        if truth.len() != joints.len() {
            return None;
        }
        let before = parts.places(&joints);
        let frame = BodyFrame::around(&before, &joints);
        let (before, after) = (before.map(|p| frame.local(p)), parts.places(truth).map(|p| frame.local(p)));
        let ways: [Vec3; PARTS] = std::array::from_fn(|part| sub(after[part], before[part]));
        let whole = ways.iter().fold([0.0; 3], |sum, &way| add(sum, way));
        if norm(whole) > ELSEWHERE_M * PARTS as f64 {
            return None;
        }
        Some(Self { inputs: inputs(problem, Reading::default(), &frame, &parts, &joints)?, ways })
    }

    /// The same scene left and right exchanged: a radar does not care, and what is learned must not either.
    fn mirrored(&self) -> Self {
        let mut inputs = self.inputs.clone();
        for row in inputs[..AWAY * ACROSS].chunks_exact_mut(ACROSS) {
            row.reverse();
        }
        let first = AWAY * ACROSS + AWAY * UP + 1;
        for part in 0..PARTS {
            let from = first + 3 * Parts::mirrored(part);
            let [away, left, up] = [0, 1, 2].map(|k| self.inputs[from + k]);
            inputs[first + 3 * part..first + 3 * part + 3].copy_from_slice(&[away, -left, up]);
        }
        let ways = std::array::from_fn(|part| {
            let [away, left, up] = self.ways[Parts::mirrored(part)];
            [away, -left, up]
        });
        Self { inputs, ways }
    }

    /// Mean distance of the parts from where they are, m: as the start has them, and as `map` moves them.
    pub fn errors_m(&self, map: &LimbMap) -> [f64; 2] {
        let said = map.apply(&self.inputs);
        let mean = |of: &dyn Fn(usize) -> f64| (0..PARTS).map(of).sum::<f64>() / PARTS as f64;
        [mean(&|part| norm(self.ways[part])), mean(&|part| norm(sub(self.ways[part], said[part])))]
    }
}

/// Learns from `lessons` and their mirror images: the least squares of the ways, and of the weights of the standardised
/// inputs, of which each counts as much as `ridge` (above 0) of the lessons. `None` without lessons.
pub fn learn(lessons: &[LimbLesson], ridge: f64) -> Option<LimbMap> {
    if lessons.is_empty() {
        return None;
    }
    let lessons: Vec<LimbLesson> = lessons.iter().flat_map(|lesson| [lesson.clone(), lesson.mirrored()]).collect();
    let rows = lessons.len();
    let x = DMatrix::from_fn(rows, INPUTS, |i, k| f64::from(lessons[i].inputs[k]));
    let y = DMatrix::from_fn(rows, 3 * PARTS, |i, k| lessons[i].ways[k / 3][k % 3]);
    let (mean, bias) = (x.row_mean(), y.row_mean());
    let scale = x.row_variance().map(|variance| if variance > 1e-12 { variance.sqrt() } else { 1.0 });
    let x = DMatrix::from_fn(rows, INPUTS, |i, k| (x[(i, k)] - mean[k]) / scale[k]);
    let mut normal = x.transpose() * &x;
    for k in 0..INPUTS {
        normal[(k, k)] += ridge * rows as f64;
    }
    let weight = Cholesky::new(normal)?.solve(&(x.transpose() * &y));
    Some(LimbMap {
        header: Vec::new(),
        mean: mean.iter().map(|&x| x as f32).collect(),
        scale: scale.iter().map(|&x| x as f32).collect(),
        weight: weight.column_iter().map(|column| column.iter().map(|&x| x as f32).collect()).collect(),
        bias: bias.iter().map(|&x| x as f32).collect(),
    })
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// Inputs of many sizes, none of which follows from the others.
    fn lesson(seed: usize) -> LimbLesson {
        let noise = |k: usize| ((seed * 7919 + k * 104_729 + seed * k * 31) % 1009) as f32 / 1009.0;
        let inputs: Vec<f32> = (0..INPUTS).map(noise).collect();
        // The head goes where the distance says, and both hands outwards.
        let distance = f64::from(inputs[AWAY * ACROSS + AWAY * UP]);
        let mut ways = [[0.0; 3]; PARTS];
        ways[0] = [0.2 * distance, 0.0, 0.1];
        (ways[5], ways[6]) = ([0.0, -0.3 * distance, 0.0], [0.0, 0.3 * distance, 0.0]);
        LimbLesson { inputs, ways }
    }

    #[test]
    fn a_mirror_image_is_another_and_its_mirror_image_the_same() {
        let lesson = lesson(3);
        let mirrored = lesson.mirrored();
        assert!(mirrored.inputs != lesson.inputs && mirrored.mirrored() == lesson);
        assert_eq!(mirrored.inputs[0], lesson.inputs[ACROSS - 1], "the floor plan's left is its right");
        assert_eq!(mirrored.inputs[AWAY * ACROSS], lesson.inputs[AWAY * ACROSS], "the upright lattice has no sides");
        assert_eq!(mirrored.ways[5], lesson.ways[5], "outwards stays outwards");
    }

    #[test]
    fn what_is_linear_is_found() {
        let lessons: Vec<LimbLesson> = (0..1200).map(lesson).collect();
        let map = learn(&lessons, 1e-6).unwrap();
        for lesson in (2000..2040).map(lesson) {
            let [before, after] = lesson.errors_m(&map);
            assert!(after < 1e-3 * (before + 1.0), "{before} m before, {after} m after");
        }
        assert!(learn(&[], 0.35).is_none());
    }
}
