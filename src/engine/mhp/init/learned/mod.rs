//! Limbs of a start from what is lit around the person, as simulated people have taught.
//!
//! A posture is one of few; where the arms of this person are, how far it leans and how much of it the radar sees before
//! its middle, the maps tell. They are looked at on two lattices around the start, a floor plan and an upright one along
//! the line from the radar, as means over the frames around. A linear map takes what is lit there, and where the start has
//! the parts of its body, to how far from there each part is: ridge regression over simulated people with truth
//! (`train-limbs`), committed in `assets/limbs.json`. Parts are named, so that the same map serves every skeleton; the
//! bones are brought back to their lengths.
//!
//! Learned are 265 numbers in, 13 parts of the body out, from 13,762 starts in simulated frames, MMVR-like, HuPR-like and polar,
//! with and without frames around. It is left out where no view tells heights, and for people with somebody else within 1.8 m. It
//! has seen no real person: on the one real MMVR frame at hand, which has labels in the image only, reprojection falls from 68
//! to 59 px and 85 % of the joints, for 76 %, lie in the boxes on the maps, while the vertical IoU falls from 0.45 to 0.36; poses of
//! another simulator become worse (PA-MAJPE by 9 to 40 mm). It is a prior from simulation; `limbs = "posture"` switches it off.

#[cfg(feature = "train")]
mod train;

#[cfg(feature = "train")]
pub use train::{LimbLesson, learn};

use crate::body::{PARTS, Parts};
use crate::geometry::{Vec3, add, norm, scale, sub};
use crate::mhp::Problem;
use crate::mhp::context::{Reading, SaliencyMap};
use crate::mhp::template::relax;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use std::sync::OnceLock;

/// Points of a lattice along the line from the radar, across it, and upwards.
const AWAY: usize = 9;
const ACROSS: usize = 9;
const UP: usize = 16;
/// From point to point, m.
const STEP_M: f64 = 0.15;
/// The lowest points lie this far below the lowest joint, m.
const BELOW_M: f64 = 0.2;
/// A point stands for what is lit on this many times as many lines through its cell.
const FINE: usize = 3;
/// Where a view tells both, the brightest counts: at these heights above the lowest joint for the floor plan, and so far
/// across for the upright lattice, m.
const HEIGHTS_M: [f64; 3] = [0.3, 0.8, 1.3];
const SIDES_M: [f64; 3] = [0.0, -0.25, 0.25];
/// The height that is looked at where a view does not tell heights, m.
const MIDDLE_M: f64 = 0.85;
/// How far below the brightest point of a lattice something still counts, ln.
const LIT_LN: f64 = 5.0;
/// What the linear map is given: both lattices, the distance from the radar, and the parts.
const INPUTS: usize = AWAY * ACROSS + AWAY * UP + 1 + 3 * PARTS;
/// Nothing is moved farther than this, m: what is unlike all that was learned from must not tear a body apart.
const FARTHEST_M: f64 = 0.5;

/// How far each part of a body is from where a start has it, as a linear map of what is lit around it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimbMap {
    /// How it came about: the command, the seeds and what was measured.
    pub header: Vec<String>,
    /// Subtracted from the inputs, (265): what is lit on the floor plan (9, 9) and on the upright lattice (9, 16), ln over
    /// the background; the distance from the radar, m; the parts' places (13, 3), m.
    pub mean: Vec<f32>,
    /// Then divided by, (265).
    pub scale: Vec<f32>,
    /// (39, 265), rows: away from the radar, to the left as it sees it, up, of each of 13 parts, m; columns: inputs.
    pub weight: Vec<Vec<f32>>,
    /// (39), m.
    pub bias: Vec<f32>,
}

impl LimbMap {
    /// The map that comes with the program; `None` where it is damaged.
    fn bundled() -> Option<&'static Self> {
        static READ: OnceLock<Option<LimbMap>> = OnceLock::new();
        let read = || Self::from_json(include_str!("../../../../../assets/limbs.json"));
        READ.get_or_init(|| read().inspect_err(|error| tracing::error!("assets/limbs.json: {error}")).ok()).as_ref()
    }

    fn from_json(text: &str) -> Result<Self, String> {
        let map: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let shaped = map.mean.len() == INPUTS
            && map.scale.len() == INPUTS
            && map.bias.len() == 3 * PARTS
            && map.weight.len() == 3 * PARTS
            && map.weight.iter().all(|row| row.len() == INPUTS);
        let numbers = map.weight.iter().flatten().chain(&map.bias).chain(&map.mean).chain(&map.scale);
        if shaped && numbers.clone().all(|x| x.is_finite()) && !map.scale.contains(&0.0) {
            Ok(map)
        } else {
            Err(format!("expected {} rows of {INPUTS} finite weights, and scales that are not 0", 3 * PARTS))
        }
    }

    /// How far each part is from where the start has it: away, to the left, up, m.
    fn apply(&self, inputs: &[f32]) -> [Vec3; PARTS] {
        let x: Vec<f32> = inputs.iter().zip(&self.mean).zip(&self.scale).map(|((x, m), s)| (x - m) / s).collect();
        let row = |k: usize| self.bias[k] + self.weight[k].iter().zip(&x).map(|(w, x)| w * x).sum::<f32>();
        std::array::from_fn(|part| [0, 1, 2].map(|k| f64::from(row(3 * part + k))))
    }
}

/// The joints (world frame, m) of a start moved to where what is lit around them says; `None` where the views do not tell
/// both sides and heights, or the skeleton lacks a part that was learned.
pub(super) fn moved(problem: &Problem, reading: Reading, joints: &[Vec3]) -> Option<Vec<Vec3>> {
    let map = LimbMap::bundled()?;
    let parts = Parts::of(&problem.skeleton)?;
    let frame = BodyFrame::around(&parts.places(joints), joints);
    let by_part = map.apply(&inputs(problem, reading, &frame, &parts, joints)?);
    let by_part = by_part.map(|way| scale(way, (FARTHEST_M / norm(way).max(f64::MIN_POSITIVE)).min(1.0)));
    let ways = parts.of_joints(&by_part);
    let mut moved: Vec<Vec3> = joints.iter().zip(ways).map(|(&joint, way)| add(joint, frame.turned(way))).collect();
    relax(&problem.skeleton, &mut moved);
    Some(moved)
}

/// Away from the radar, to the left as it sees it, and up, around a person.
#[derive(Debug, Clone, Copy)]
struct BodyFrame {
    /// The middle of the parts, on the height of the lowest joint.
    at: Vec3,
    /// Unit vector on the floor.
    away: [f64; 2],
}

impl BodyFrame {
    fn around(parts: &[Vec3; PARTS], joints: &[Vec3]) -> Self {
        let sum = parts.iter().fold([0.0; 3], |sum, &part| add(sum, part));
        let [x, y, _] = scale(sum, 1.0 / PARTS as f64);
        let lowest = joints.iter().map(|joint| joint[2]).fold(f64::INFINITY, f64::min);
        let distance = x.hypot(y);
        let away = if distance > 0.0 { [x / distance, y / distance] } else { [1.0, 0.0] };
        Self { at: [x, y, lowest], away }
    }

    /// A way in this frame as one in the world.
    fn turned(&self, [away, left, up]: Vec3) -> Vec3 {
        let [x, y] = self.away;
        [away * x - left * y, away * y + left * x, up]
    }

    fn world(&self, p: Vec3) -> Vec3 {
        add(self.at, self.turned(p))
    }

    fn local(&self, p_world: Vec3) -> Vec3 {
        let ([x, y], [dx, dy, up]) = (self.away, sub(p_world, self.at));
        [x * dx + y * dy, x * dy - y * dx, up]
    }
}

/// What the linear map is given; `None` where no view tells sides, or none heights.
fn inputs(problem: &Problem, reading: Reading, frame: &BodyFrame, parts: &Parts, joints: &[Vec3]) -> Option<Vec<f32>> {
    let context = problem.context(reading);
    let (now, around): (_, Vec<&[SaliencyMap]>) = (&context.now, context.around().map(|(_, maps)| maps()).collect());
    let times = || std::iter::once(now.as_slice()).chain(around.iter().copied());
    let middle = frame.world([0.0, 0.0, MIDDLE_M]);
    let left = frame.turned([0.0, 1.0, 0.0]);
    let tells = |k: usize, direction: Vec3| now[k].resolves(middle, direction);
    let (mut inputs, up) = (Vec::with_capacity(INPUTS), [0.0, 0.0, 1.0]);
    for (lattice, direction) in [(Lattice::Floor, left), (Lattice::Upright, up)] {
        let telling: Vec<usize> = (0..now.len()).filter(|&k| tells(k, direction)).collect();
        if telling.is_empty() {
            return None;
        }
        let mut sums = vec![0.0; lattice.points().len()];
        for &k in &telling {
            let whole = tells(k, left) && tells(k, up);
            let spots: Vec<Spot> =
                lattice.points().into_iter().map(|p| lattice.spot(&now[k], frame, p, whole)).collect();
            for views in times() {
                for (sum, spot) in sums.iter_mut().zip(&spots) {
                    *sum += spot.iter().map(|cells| views[k].brightest(cells)).sum::<f64>();
                }
            }
        }
        let count = (telling.len() * (1 + around.len()) * FINE * FINE) as f64;
        let lit: Vec<f64> = sums.into_iter().map(|sum| sum / count).collect();
        // Radars differ in how far a body rises above what is around it.
        let floor = lit.iter().copied().fold(0.0, f64::max) - LIT_LN;
        inputs.extend(lit.into_iter().map(|lit| (lit - floor).max(0.0) as f32));
    }
    inputs.push(frame.at[0].hypot(frame.at[1]) as f32);
    inputs.extend(parts.places(joints).into_iter().flat_map(|p| frame.local(p)).map(|x| x as f32));
    Some(inputs)
}

/// Cells that stand for a point of a lattice: one of a group counts, the brightest, and of the groups the mean.
type Spot = SmallVec<[SmallVec<[usize; 3]>; FINE * FINE]>;

/// Where a map is looked at around a person.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lattice {
    /// Away and across.
    Floor,
    /// Away and up.
    Upright,
}

impl Lattice {
    /// Away and across, or away and up from the lowest joint, m.
    fn points(self) -> Vec<[f64; 2]> {
        let around = |k: usize, count: usize| STEP_M * (k as f64 - 0.5 * (count - 1) as f64);
        let (count, second): (usize, &dyn Fn(usize) -> f64) = match self {
            Self::Floor => (ACROSS, &|k| around(k, ACROSS)),
            Self::Upright => (UP, &|k| STEP_M * k as f64 - BELOW_M),
        };
        (0..AWAY).flat_map(|i| (0..count).map(move |k| [around(i, AWAY), second(k)])).collect()
    }

    /// The cells of a view around a point of the lattice; `whole` where the view tells sides and heights.
    fn spot(self, view: &SaliencyMap, frame: &BodyFrame, [away, second]: [f64; 2], whole: bool) -> Spot {
        let beside = |k: usize| STEP_M / FINE as f64 * (k as f64 - 0.5 * (FINE - 1) as f64);
        let third: &[f64] = match (self, whole) {
            (Self::Floor, true) => &HEIGHTS_M,
            (Self::Floor, false) => &[MIDDLE_M],
            (Self::Upright, true) => &SIDES_M,
            (Self::Upright, false) => &SIDES_M[..1],
        };
        let group = |i: usize| {
            let (away, second) = (away + beside(i / FINE), second + beside(i % FINE));
            let point = |&third: &f64| match self {
                Self::Floor => [away, second, third],
                Self::Upright => [away, third, second],
            };
            third.iter().filter_map(|third| view.cell(frame.world(point(third)))).collect()
        };
        (0..FINE * FINE).map(group).collect()
    }
}

#[cfg(test)]
mod tests;
