//! Ambiguity map: L_EM of this body over the floor plan, and over its heading and height. Where else could the fit have gone?
//!
//! The body keeps its posture; its place on the floor, or its yaw and its height, are those of the sample. Two EM regions can be
//! chosen. That **of the fit** is the one that the fit sees: beyond it nothing counts, and a map reaches as far. One **around
//! the body** goes along, as if the fit had begun there: a map then covers the room, and minima are places where a start would
//! have stayed. Such regions stand every fourth sample; what they hold of H_ori and the threshold in it differ from place to place,
//! which is what a start there would have met.

use super::Halt;
use super::cores::{IdleCores, each};
use super::moves::{move_person, root_of};
use super::plane::{Minimum, Row, SampleAxis, minima, rows};
use super::state::ExploredState;
use super::task::Showing;
use crate::body::Pppr;
use crate::config::{EmRegion, FitConfig};
use crate::geometry::mean;
use crate::mhp::{EmAround, EmScratch, FrameEmLoss};
use crate::radar::{AxisKind, View};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Samples along each axis.
pub const AMBIGUITY_CELLS: usize = 128;
/// A region that goes along stands for so many samples along each axis.
const REGION_EVERY: usize = 4;
/// Samples of one piece of work.
const PIECE: usize = 64;
/// How far the height reaches up and down, m.
const HEIGHT_M: f64 = 0.6;
/// The floor plan begins this far before the radar and ends no farther than that, m.
const NEAREST_M: f64 = 0.4;
const FARTHEST_M: f64 = 12.0;

/// The EM region of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RegionOf {
    /// That of the fit.
    Fit,
    /// One around the body, wherever it is put.
    #[default]
    Body,
}

/// What a person chose.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct AmbiguitySettings {
    /// The region of the floor plan.
    pub region: RegionOf,
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct AmbiguityRequest {
    /// The fit.
    pub state: ExploredState,
    /// The person that is moved; others stay.
    pub person: usize,
    /// The region of the floor plan.
    pub region: RegionOf,
}

impl AmbiguityRequest {
    /// Whether another one asks for the same.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        (self.person, self.region) == (other.person, other.region) && self.state.is_same(&other.state)
    }
}

/// L_EM over two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct EmPlane {
    /// Across and up.
    pub axes: [SampleAxis; 2],
    /// A value a sample, the first axis fastest.
    pub values: Vec<Option<f64>>,
    /// Where the body is, in the axes' units.
    pub here: [f64; 2],
    /// L_EM there.
    pub here_value: f64,
    /// Every so many samples along each axis are done.
    pub stride: usize,
    /// The minima, the lowest first; none before the plane is whole.
    pub minima: Vec<Minimum>,
}

impl EmPlane {
    /// Every so many samples are done now; of the whole plane the minima are looked for.
    fn reach(&mut self, stride: usize) {
        self.stride = stride;
        if stride == 1 {
            let axes = self.axes.each_ref();
            self.minima = minima(&self.values, axes.map(|axis| axis.cells), axes.map(|axis| axis.closed));
        }
    }

    /// The value of a sample.
    pub fn value(&self, [i, j]: [usize; 2]) -> Option<f64> {
        self.values.get(j * self.axes[0].cells + i).copied().flatten()
    }

    /// The axes' values at a sample.
    pub fn at(&self, cell: [usize; 2]) -> [f64; 2] {
        [self.axes[0].at(cell[0] as f64), self.axes[1].at(cell[1] as f64)]
    }
}

/// The two maps, as far as they are done.
#[derive(Debug, Clone, PartialEq)]
pub struct AmbiguityMap {
    /// The person that is moved.
    pub person: usize,
    /// y across (left is left), x up: places of the body's root on the floor, m.
    pub floor: EmPlane,
    /// Yaw from where it looks across, degrees, and height from where it is up, m.
    pub turn: EmPlane,
    /// The region of the floor plan.
    pub region: RegionOf,
    /// The state that was moved.
    pub origin: Arc<Pppr>,
}

impl AmbiguityMap {
    /// The parameters with the body's root at (y, x) on the floor, m.
    pub fn on_floor(&self, skeleton: &crate::body::Skeleton, [y, x]: [f64; 2]) -> Pppr {
        let mut params = (*self.origin).clone();
        let root = root_of(params.person(self.person), skeleton);
        move_person(&mut params, skeleton, self.person, [x - root[0], y - root[1], 0.0], 0.0);
        params
    }

    /// The parameters with the body turned by so many degrees and higher by so many m.
    pub fn turned(&self, skeleton: &crate::body::Skeleton, [yaw_deg, up_m]: [f64; 2]) -> Pppr {
        let mut params = (*self.origin).clone();
        move_person(&mut params, skeleton, self.person, [0.0, 0.0, up_m], yaw_deg.to_radians());
        params
    }
}

/// How far the floor reaches that the views see: y from right to left and x, m.
fn floor_extent(views: &[View]) -> [[f64; 2]; 2] {
    let ends = |kinds: &[AxisKind]| {
        let axes = views.iter().flat_map(|view| &view.axes).filter(|axis| kinds.contains(&axis.kind));
        let values = axes.flat_map(|axis| [axis.value_at(0.0), axis.value_at(axis.bins as f64 - 1.0)]);
        values.fold(None, |span: Option<[f64; 2]>, x| Some(span.map_or([x, x], |[lo, hi]| [lo.min(x), hi.max(x)])))
    };
    let far = ends(&[AxisKind::DepthH, AxisKind::DepthV, AxisKind::Range, AxisKind::X]);
    let [near, far] = far.map_or([NEAREST_M, 8.0], |[lo, hi]| [lo.max(NEAREST_M), hi.clamp(1.0, FARTHEST_M)]);
    // As far to the sides as a field of view of 45 degrees where no axis says.
    let [right, left] = ends(&[AxisKind::Y]).unwrap_or([-0.7 * far, 0.7 * far]);
    [[right, left], [near, far]]
}

/// A plane whose samples are all unknown.
fn plane(axes: [SampleAxis; 2], here: [f64; 2], here_value: f64) -> EmPlane {
    let cells = axes[0].cells * axes[1].cells;
    EmPlane { axes, values: vec![None; cells], here, here_value, stride: usize::MAX, minima: Vec::new() }
}

fn axis(name: &str, unit: &'static str, [from, to]: [f64; 2]) -> SampleAxis {
    SampleAxis { name: name.to_owned(), unit, from, to, cells: AMBIGUITY_CELLS, closed: false }
}

/// The regions that go along, by their place in the lattice; each is laid out once, by who comes first.
struct Regions<'a> {
    frame: &'a FrameEmLoss<'a>,
    known: Mutex<BTreeMap<[usize; 2], Option<Arc<EmAround<'a>>>>>,
}

impl<'a> Regions<'a> {
    /// Of a sample; `None` where no region can be laid there.
    fn of(&self, [i, j]: [usize; 2], body: impl Fn([usize; 2]) -> Pppr) -> Option<Arc<EmAround<'a>>> {
        let block = [i / REGION_EVERY, j / REGION_EVERY];
        if let Some(known) = self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&block) {
            return known.clone();
        }
        let middle = block.map(|k| (k * REGION_EVERY + REGION_EVERY / 2).min(AMBIGUITY_CELLS - 1));
        let made = self.frame.around(&body(middle)).ok().map(Arc::new);
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(block, made.clone());
        made
    }
}

/// Evaluates both maps, coarse to fine.
///
/// # Errors
/// Where the loss cannot be evaluated, or it was cancelled.
pub(super) fn explore(
    request: &AmbiguityRequest,
    cores: &IdleCores,
    show: &Showing<'_, AmbiguityMap>,
) -> Result<AmbiguityMap, Halt> {
    let AmbiguityRequest { state, person, region } = request;
    let (seen, person) = (state.seen()?, *person);
    if person >= state.params.shape().persons {
        return Err(Halt::Failed(format!("there is no person {}", person + 1)));
    }
    // Only L_EM counts: what other terms would look up is left out.
    let config = FitConfig { w_time: 0.0, ..state.config };
    let frame = FrameEmLoss::new(&seen, config, state.precision, &state.params);
    let of_fit = Arc::new(frame.around(&state.initial).map_err(|error| Halt::Failed(error.to_string()))?);
    let goes_along = *region == RegionOf::Body && config.em_region != EmRegion::Full;
    let here_value = of_fit.loss(&state.params, &mut EmScratch::default());
    let root = root_of(state.params.person(person), &seen.skeleton);
    let [sides, depths] = match (region, config.em_region) {
        (RegionOf::Fit, EmRegion::HalfWidth(half)) => {
            let joints = state.initial.shape().joints.max(1);
            let middle =
                mean(state.initial.positions().get(person * joints..(person + 1) * joints).unwrap_or_default());
            [[middle[1] - half, middle[1] + half], [(middle[0] - half).max(NEAREST_M), middle[0] + half]]
        }
        _ => floor_extent(&seen.views),
    };
    // Left as seen from the radar is left: y falls from left to right.
    let floor_axes = [axis("y", "m", [sides[1], sides[0]]), axis("x", "m", depths)];
    let step = 360.0 / AMBIGUITY_CELLS as f64;
    let mut turn_axes = [axis("turned", "°", [-180.0, 180.0 - step]), axis("higher", "m", [-HEIGHT_M, HEIGHT_M])];
    turn_axes[0].closed = true;
    let mut map = AmbiguityMap {
        person,
        floor: plane(floor_axes, [root[1], root[0]], here_value),
        turn: plane(turn_axes, [0.0, 0.0], here_value),
        region: *region,
        origin: Arc::new(state.params.clone()),
    };
    let regions = Regions { frame: &frame, known: Mutex::default() };
    let (floor, turn) = (map.floor.clone(), map.turn.clone());
    let place = AmbiguityMap { floor: floor.clone(), turn: turn.clone(), ..map.clone() };
    let levels: Vec<Row> = rows([AMBIGUITY_CELLS; 2], PIECE);
    // Level by level of both, so that both are there soon.
    let pieces: Vec<(bool, &Row)> = levels
        .chunk_by(|a, b| a.0 == b.0)
        .flat_map(|level| level.iter().map(|row| (true, row)).chain(level.iter().map(|row| (false, row))))
        .collect();
    show.begin("evaluating", 2 * AMBIGUITY_CELLS * AMBIGUITY_CELLS);
    let evaluate = |(scratch, params): &mut (EmScratch, Pppr), k: usize| -> Result<Vec<Option<f64>>, Halt> {
        let (on_floor, (_, j, columns)) = pieces[k];
        let values = columns.iter().map(|&i| {
            let plane = if on_floor { &floor } else { &turn };
            let at = plane.at([i, *j]);
            params.clone_from(&state.params);
            if on_floor {
                move_person(params, &seen.skeleton, person, [at[1] - root[0], at[0] - root[1], 0.0], 0.0);
            } else {
                move_person(params, &seen.skeleton, person, [0.0, 0.0, at[1]], at[0].to_radians());
            }
            let of = if on_floor && goes_along {
                regions.of([i, *j], |cell| place.on_floor(&seen.skeleton, floor.at(cell)))?
            } else {
                Arc::clone(&of_fit)
            };
            Some(of.loss(params, scratch)).filter(|value| value.is_finite())
        });
        Ok(values.collect())
    };
    let mut left = super::coarse::left_by_stride(&pieces, |(_, (stride, ..))| *stride);
    each(
        (cores, show.progress()),
        pieces.len(),
        || (EmScratch::default(), state.params.clone()),
        |room, k, _| evaluate(room, k),
        |k, values| {
            let (on_floor, (stride, j, columns)) = pieces[k];
            show.advance(values.len());
            let plane = if on_floor { &mut map.floor } else { &mut map.turn };
            for (&i, value) in columns.iter().zip(values) {
                plane.values[j * AMBIGUITY_CELLS + i] = value;
            }
            let ended = super::coarse::ended(&mut left, *stride);
            if let Some(stride) = ended {
                map.floor.reach(stride);
                map.turn.reach(stride);
            }
            show.maybe(ended.is_some(), || map.clone());
        },
    )?;
    Ok(map)
}
