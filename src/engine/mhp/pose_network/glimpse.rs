//! What the network looks at: the maps of half a second about a place, as levels over range and angle.

use crate::config::FitConfig;
use crate::geometry::{Vec3, flat_distance};
use crate::mhp::Problem;
use crate::radar::{Resolves, View};

/// Times of the maps, s after the frame that is fitted.
pub(super) const TIMES_S: [f64; 5] = [-0.2, -0.1, 0.0, 0.1, 0.2];
/// Maps of a view: those of [`TIMES_S`], and what stands there while the frames around last.
pub(super) const CHANNELS: usize = TIMES_S.len() + 1;
/// Cells along the range, to the side, and up.
pub(super) const RANGES: usize = 40;
pub(super) const ACROSS: usize = 28;
pub(super) const UP: usize = 40;
/// How far they reach from the place, and from the radar's height, m.
const RANGE_M: [f64; 2] = [-0.9, 0.9];
const ACROSS_M: [f64; 2] = [-0.85, 0.85];
const UP_M: [f64; 2] = [-1.3, 1.15];
/// Of a cell's powers over time: what stands there also while the person is elsewhere; of fewer frames nothing is known.
const STANDING: f64 = 0.17;
const FEWEST: usize = 4;
/// Levels are told from so far below the brightest, and as (level + MIDDLE)/SPREAD, dB.
const FLOOR_DB: f32 = -45.0;
const MIDDLE_DB: f32 = 20.0;
const SPREAD_DB: f32 = 12.0;
/// Where the radar stands above the floor where nobody says it, m.
const USUAL_HEIGHT_M: f64 = 1.0;
/// What is seen of a place, as numbers of the size of 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Seen {
    /// ([`CHANNELS`], [`RANGES`], [`ACROSS`]), C order.
    pub(super) horizontal: Vec<f32>,
    /// ([`CHANNELS`], [`RANGES`], [`UP`]), C order.
    pub(super) vertical: Vec<f32>,
    /// What [`about`] says.
    pub(super) about: [f32; 3],
}

impl Seen {
    /// With left and right exchanged.
    pub(super) fn mirrored(&self) -> Self {
        let mut other = self.clone();
        other.horizontal.chunks_exact_mut(ACROSS).for_each(<[f32]>::reverse);
        other.about[1] = -other.about[1];
        other
    }
}

/// The maps about a place.
#[derive(Debug, Clone)]
pub(super) struct Glimpse {
    pub(super) seen: Seen,
    /// World frame, m.
    pub(super) place: Vec3,
    /// Where the radar looks from, and the direction from there to the place on the floor plan: what is seen is told in them.
    origin: Vec3,
    sight: [f64; 2],
}

/// What is looked at of a view. One that resolves both angles shows both, each summed over what the other one resolves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Plane {
    Horizontal,
    Vertical,
}

/// Distance (m/3 − 1), sine of the azimuth, and height of the radar above the floor (m − 1).
pub(super) fn about(distance_m: f64, sine: f64, height_m: f64) -> [f32; 3] {
    [(distance_m / 3.0 - 1.0) as f32, sine as f32, (height_m - USUAL_HEIGHT_M) as f32]
}

/// A plane that no view shows.
pub(super) fn nothing(cells: usize) -> Vec<f32> {
    vec![normalised(FLOOR_DB); CHANNELS * RANGES * cells]
}

fn at([lo, hi]: [f64; 2], k: usize, of: usize) -> f64 {
    lo + (hi - lo) * k as f64 / (of - 1) as f64
}

/// How far from the place a row is, m.
pub(super) fn range_m(row: usize) -> f64 {
    at(RANGE_M, row, RANGES)
}

/// How far to its left a column is, m, as far away as it is.
pub(super) fn across_m(column: usize) -> f64 {
    at(ACROSS_M, column, ACROSS)
}

/// How far above the radar a column is, m, as far away as the place is.
pub(super) fn up_m(column: usize) -> f64 {
    at(UP_M, column, UP)
}

/// A plane as the network sees it, of powers of the window's maps, and over `all` times; each C order.
pub(super) fn told(window: &[&[f32]], all: &[&[f32]]) -> Vec<f32> {
    let cells = window.first().map_or(0, |map| map.len());
    let mut seen = window.concat();
    let brightest = level_db(seen.iter().copied().fold(0.0, f32::max));
    if all.len() >= FEWEST {
        let rank = ((all.len() - 1) as f64 * STANDING).round() as usize;
        let mut over_time = vec![0.0; all.len()];
        for cell in 0..cells {
            over_time.iter_mut().zip(all).for_each(|(power, map)| *power = map[cell]);
            seen.push(*over_time.select_nth_unstable_by(rank, f32::total_cmp).1);
        }
    }
    for x in &mut seen {
        *x = normalised((level_db(*x) - brightest).max(FLOOR_DB));
    }
    seen.resize((window.len() + 1) * cells, normalised(FLOOR_DB));
    seen
}

fn normalised(level_db: f32) -> f32 {
    (level_db + MIDDLE_DB) / SPREAD_DB
}

fn level_db(power: f32) -> f32 {
    10.0 * (power + f32::MIN_POSITIVE).log10()
}

impl Glimpse {
    /// At the maps of `problem` about `place` (world frame, m); `None` where no view has both a range and an angle.
    pub(super) fn at(problem: &Problem, config: &FitConfig, place: Vec3) -> Option<Self> {
        let of = |plane: Plane| {
            let shown = (0..problem.views.len()).filter(|&k| plane.axes(&problem.views[k]).is_some());
            shown.min_by_key(|&k| problem.views[k].axes.len())
        };
        let found = [of(Plane::Horizontal), of(Plane::Vertical)];
        let first = found.iter().flatten().next().map(|&k| &problem.views[k])?;
        let seen = first.pose.view_from_world(place);
        let azimuth = seen[1].atan2(seen[0]);
        let origin = crate::mhp::skin::radar_place(&problem.views);
        let distance = flat_distance(origin, place).max(0.3);
        let sight = [(place[0] - origin[0]) / distance, (place[1] - origin[1]) / distance];
        let map = |which: Option<usize>, plane: Plane| match which {
            Some(view) => levels(problem, config, view, (plane, place)),
            None => nothing(plane.cells()),
        };
        let seen = Seen {
            horizontal: map(found[0], Plane::Horizontal),
            vertical: map(found[1], Plane::Vertical),
            about: about(distance, azimuth.sin(), problem.radar.height_m.unwrap_or(USUAL_HEIGHT_M)),
        };
        Some(Self { seen, place, origin, sight })
    }

    /// Where something is that is told along the sight, to its left, and up from the radar, from the place, m: world frame, m.
    pub(super) fn world(&self, [along, left, up]: Vec3) -> Vec3 {
        let ([cos, sin], [x, y, _]) = (self.sight, self.place);
        [x + cos * along - sin * left, y + sin * along + cos * left, self.origin[2] + up]
    }
}

impl Plane {
    fn cells(self) -> usize {
        match self {
            Self::Horizontal => ACROSS,
            Self::Vertical => UP,
        }
    }

    /// The range's axis of a view, and the angle's; `None` where it shows another plane.
    fn axes(self, view: &View) -> Option<[usize; 2]> {
        let of = |what: Resolves| view.axes.iter().position(|axis| Resolves::of(axis.kind) == what);
        let angle = match self {
            Self::Horizontal => Resolves::Azimuth,
            Self::Vertical => Resolves::Elevation,
        };
        Some([of(Resolves::Range)?, of(angle)?])
    }

    /// The points of its cells before a view, C order, world frame, m.
    fn points(self, view: &View, place: Vec3) -> Vec<Vec3> {
        let seen = view.pose.view_from_world(place);
        let distance = seen[0].hypot(seen[1]).max(0.3);
        let (sin, cos) = (seen[1] / distance, seen[0] / distance);
        let mut points = Vec::with_capacity(RANGES * self.cells());
        for i in 0..RANGES {
            let range = (distance + range_m(i)).max(0.05);
            for j in 0..self.cells() {
                let p = match self {
                    Self::Horizontal => {
                        let sine = (sin + across_m(j) / distance).clamp(-0.99, 0.99);
                        [range * (1.0 - sine * sine).sqrt(), range * sine, 0.0]
                    }
                    Self::Vertical => {
                        let sine = (up_m(j) / distance).clamp(-0.99, 0.99);
                        let flat = range * (1.0 - sine * sine).sqrt();
                        [flat * cos, flat * sin, range * sine]
                    }
                };
                points.push(view.pose.world_from_view(p));
            }
        }
        points
    }
}

/// The levels of a view's maps about a place, ([`CHANNELS`], [`RANGES`], cells), C order.
fn levels(problem: &Problem, config: &FitConfig, of: usize, (plane, place): (Plane, Vec3)) -> Vec<f32> {
    let view = &problem.views[of];
    let Some(axes) = plane.axes(view) else { return nothing(plane.cells()) };
    let taps = Taps::new(view, axes, &plane.points(view, place));
    let neighbours = problem.neighbours_in(config.frames_around);
    let mut all: Vec<(f64, Vec<f32>)> = Vec::with_capacity(neighbours.len() + 1);
    all.push((0.0, taps.powers(view, problem.map(of))));
    all.extend(neighbours.iter().map(|frame| (frame.offset_s, taps.powers(view, frame.map(of)))));
    let nearest = |t_s: f64| all.iter().min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs()));
    let window: Vec<&[f32]> =
        TIMES_S.iter().filter_map(|&t_s| nearest(t_s)).map(|(_, powers)| powers.as_slice()).collect();
    told(&window, &all.iter().map(|(_, powers)| powers.as_slice()).collect::<Vec<_>>())
}

/// The cells of a map that each point is read from, and their weights.
struct Taps {
    cells: Vec<[(usize, f32); 4]>,
    /// The cells that are summed, after each of those: along the other axes.
    along: Vec<usize>,
}

impl Taps {
    /// At points before a view, told apart along these two axes.
    fn new(view: &View, axes: [usize; 2], points: &[Vec3]) -> Self {
        let shape = view.shape();
        let stride = |axis: usize| shape[axis + 1..].iter().product::<usize>();
        let of_point = |p: &Vec3| {
            let bins = view.bins_of(*p);
            let mut taps = [(0, 1.0_f32); 4];
            for (nth, axis) in axes.into_iter().enumerate() {
                let last = shape[axis] - 1;
                let bin = bins[axis].clamp(0.0, last as f64);
                let low = bin as usize;
                let share = (bin - low as f64) as f32;
                for (k, tap) in taps.iter_mut().enumerate() {
                    let upper = k >> nth & 1 == 1;
                    tap.0 += (low + usize::from(upper)).min(last) * stride(axis);
                    tap.1 *= if upper { share } else { 1.0 - share };
                }
            }
            taps
        };
        let mut along = vec![0];
        for axis in (0..shape.len()).filter(|axis| !axes.contains(axis)) {
            along = along.iter().flat_map(|at| (0..shape[axis]).map(move |bin| at + bin * stride(axis))).collect();
        }
        Self { cells: points.iter().map(of_point).collect(), along }
    }

    /// The power at each point.
    fn powers(&self, view: &View, map: &[f64]) -> Vec<f32> {
        let power = |cell: usize| -> f64 {
            let of = |at: usize| map.get(cell + at).copied().filter(|h| h.is_finite()).unwrap_or(0.0);
            self.along.iter().map(|&at| view.quantity.power(of(at))).sum()
        };
        let of_point = |taps: &[(usize, f32); 4]| {
            let sum: f64 = taps.iter().filter(|tap| tap.1 > 0.0).map(|&(cell, w)| f64::from(w) * power(cell)).sum();
            sum as f32
        };
        self.cells.iter().map(of_point).collect()
    }
}
