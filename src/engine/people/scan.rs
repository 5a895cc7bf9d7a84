//! One frame's detections in all its views, and what is kept of it for the frames after.

use super::cfar::{CfarOptions, Detection, Planes, Tables};
use super::change::{amplitudes_of, unit_of};
use super::counter::{Counted, NOBODY};
use super::error::PeopleError;
use super::network::CLASSES;
use super::sight::{Role, Sight, baseline_m};
use crate::geometry::{Vec3, flat_distance, norm, sub};
use crate::radar::{View, unravel};

/// Echoes of two views are one body's where their ranges differ by no more, m.
const SAME_RANGE_M: f64 = 0.12;
/// Of a view that tells heights too, echoes at one range, within this, m, but farther from each other than parts of a body, m, are an
/// echo and its sidelobes where they are weaker by more than this, ln of amplitudes, or at the same cone angle, within this in the
/// sine: arrays with few rows have them in every direction, 4 to 8 dB down.
const GHOST_RANGE_M: f64 = 0.2;
const GHOST_APART_M: f64 = 1.0;
const GHOST_LN: f32 = 0.5;
const GHOST_SINE: f64 = 0.08;
/// No radar sees people farther away, m: what axes put there is no place, and its squares leave the range of numbers.
const FARTHEST_M: f64 = 1e4;
/// Frames before the present one that are looked at, two seconds of most radars: people stay as many, while one who hides
/// another, and a body on its way down that looks like two, hardly do for so long.
pub const HISTORY: usize = 19;
/// Of these, so many show what changed and what persists.
pub const COMPARED: usize = 3;

/// A detection in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// World position, m; the height is 0 where no view tells it.
    pub position: Vec3,
    /// Lowest and highest echo of the other view at the same range, m, where there is one.
    pub heights_m: Option<[f64; 2]>,
    /// ln of the amplitude over the mean of the reference cells.
    pub contrast: f32,
    /// ln of the amplitude of the map itself.
    pub level: f32,
    /// Distance from the view's origin, m.
    pub range_m: f64,
    /// Frames since it was seen: 0 is the present one.
    pub age: u8,
}

/// One frame as the counter keeps it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Detections in metres, strongest excess first.
    pub points: Vec<Point>,
    /// Whether they are of what changed, not of the map itself: false where there was no other frame to compare with.
    pub moving: bool,
    /// The clusters of its points and of those of the frames before, and how many people each is.
    pub(super) clusters: Vec<Counted>,
    /// Points that belong to no cluster.
    pub(super) loose: Vec<Point>,
    /// What the clusters say together of the number of people.
    pub(super) said: [f64; CLASSES],
    /// The amplitudes of every view that tells places, in units of 2^`unit`: those of the frame before, if there is one.
    amplitudes: Vec<Vec<f32>>,
    unit: i32,
}

/// What turns maps into detections; made once for the views of a data set.
#[derive(Debug, Clone)]
pub(super) struct Scanner {
    sights: Vec<(usize, Sight, Planes)>,
    views: Vec<View>,
    options: CfarOptions,
}

impl Scan {
    /// Lets go of the maps, which only the [`COMPARED`] frames after it ask for.
    pub fn forget_maps(&mut self) {
        self.amplitudes = Vec::new();
    }
}

impl Scanner {
    /// # Errors
    /// Where no view tells a place.
    pub(super) fn new(views: &[View], options: CfarOptions) -> Result<Self, PeopleError> {
        let sight = |(k, view): (usize, &View)| {
            Sight::new(view).map(|sight| {
                let planes = Planes::new(&sight, &options);
                (k, sight, planes)
            })
        };
        let sights: Vec<_> = views.iter().enumerate().filter_map(sight).collect();
        if sights.is_empty() {
            return Err(PeopleError::NoPlace);
        }
        Ok(Self { sights, views: views.to_vec(), options })
    }

    /// The detections of a frame, not yet clustered; `maps` one a view, missing cells filled; `before` the frames before, the last first.
    pub(super) fn scan(&self, maps: &[&[f64]], before: &[&Scan]) -> Result<Scan, PeopleError> {
        if maps.len() != self.views.len() {
            return Err(PeopleError::WrongMaps { got: maps.len(), expected: self.views.len() });
        }
        let mut tables = Tables::default();
        let of_sights = || self.sights.iter().filter_map(|(k, sight, _)| Some((*maps.get(*k)?, sight.view.quantity)));
        let unit = before.first().map_or_else(|| unit_of(of_sights()), |scan| scan.unit);
        let (mut amplitudes, mut detections) = (Vec::new(), Vec::new());
        for (s, (k, sight, planes)) in self.sights.iter().enumerate() {
            let map = maps.get(*k).copied().unwrap_or_default();
            let array = || sight.view.array.clone();
            if map.len() != sight.view.cells() {
                return Err(PeopleError::WrongCells { array: array(), got: map.len(), expected: sight.view.cells() });
            }
            if !map.iter().any(|x| x.is_finite()) {
                return Err(PeopleError::NoNumbers { array: array() });
            }
            let now = amplitudes_of(map, sight.view.quantity, unit);
            let earlier: Vec<&[f32]> =
                before.iter().take(COMPARED).filter_map(|scan| scan.amplitudes.get(s)).map(Vec::as_slice).collect();
            detections.push(planes.detect(&now, &earlier, &self.options, &mut tables));
            amplitudes.push(now);
        }
        let points = thinned(self.points(&detections), &self.options);
        let (clusters, loose) = (Vec::new(), Vec::new());
        Ok(Scan { points, moving: !before.is_empty(), clusters, loose, said: NOBODY, amplitudes, unit })
    }

    /// Places of the detections of views that tell where, with heights from those that tell how high. Without a view
    /// that tells where, heights and distances are all there is: straight ahead is assumed.
    fn points(&self, detections: &[Vec<Detection>]) -> Vec<Point> {
        let told = |role: Role| self.sights.iter().any(|(_, sight, _)| sight.role == role);
        let only_heights = !told(Role::Plan) && !told(Role::Whole);
        let heights = self.heights(detections);
        let mut points: Vec<Point> = Vec::new();
        for (s, ((_, sight, _), found)) in self.sights.iter().zip(detections).enumerate() {
            if sight.role == Role::Height && !only_heights {
                continue;
            }
            let of_sight = points.len();
            for detection in found {
                let reading = sight.reading(&unravel(detection.cell, &sight.view.shape()));
                let seen = if sight.role == Role::Plan { self.seen(s, reading.range_m, &heights) } else { None };
                let position = sight.place(&reading, seen.map(|(middle, _)| middle));
                if !position.iter().chain([&reading.range_m]).all(|x| x.abs() <= FARTHEST_M) {
                    continue;
                }
                points.push(Point {
                    position,
                    heights_m: seen.map(|(_, extent)| extent),
                    contrast: detection.contrast,
                    level: detection.level,
                    range_m: reading.range_m,
                    age: 0,
                });
            }
            if sight.role == Role::Whole {
                let kept = without_ghosts(&points.split_off(of_sight), sight);
                points.extend(kept);
            }
        }
        points
    }

    /// Of each view that tells heights: range, height, and excess of each detection.
    fn heights(&self, detections: &[Vec<Detection>]) -> Vec<(usize, Vec<[f64; 3]>)> {
        let of_height = self.sights.iter().zip(detections).enumerate();
        let of_height = of_height.filter(|(_, ((_, sight, _), _))| sight.role == Role::Height);
        of_height
            .map(|(s, ((_, sight, _), found))| {
                let reading = |d: &Detection| {
                    let reading = sight.reading(&unravel(d.cell, &sight.view.shape()));
                    [reading.range_m, sight.place(&reading, None)[2], f64::from(d.contrast)]
                };
                (s, found.iter().map(reading).filter(|told| told.iter().all(|x| x.abs() <= FARTHEST_M)).collect())
            })
            .collect()
    }

    /// Middle and extent of what other views see at a range.
    fn seen(&self, from: usize, range_m: f64, heights: &[(usize, Vec<[f64; 3]>)]) -> Option<(f64, [f64; 2])> {
        let (mut sum, mut weights, mut extent) = (0.0, 0.0, [f64::INFINITY, f64::NEG_INFINITY]);
        for (s, told) in heights {
            let (Some((_, here, _)), Some((_, there, _))) = (self.sights.get(from), self.sights.get(*s)) else {
                continue;
            };
            let tolerance = SAME_RANGE_M + baseline_m(here, there);
            for [range, z, weight] in told.iter().filter(|told| (told[0] - range_m).abs() <= tolerance) {
                let _ = range;
                sum += weight * z;
                weights += weight;
                extent = [extent[0].min(*z), extent[1].max(*z)];
            }
        }
        (weights > 0.0).then(|| (sum / weights, extent))
    }
}

/// The points of a view that tells heights without the sidelobes of stronger ones.
fn without_ghosts(points: &[Point], sight: &Sight) -> Vec<Point> {
    let sine = |point: &Point| sight.view.pose.view_from_world(point.position)[1] / point.range_m.max(1e-3);
    let mut strongest: Vec<&Point> = points.iter().collect();
    strongest.sort_by(|a, b| b.level.total_cmp(&a.level));
    let mut kept: Vec<Point> = Vec::new();
    for point in strongest {
        let ghost = |other: &Point| {
            (other.range_m - point.range_m).abs() <= GHOST_RANGE_M
                && norm(sub(other.position, point.position)) > GHOST_APART_M
                && (other.level - point.level > GHOST_LN || (sine(other) - sine(point)).abs() <= GHOST_SINE)
        };
        if !kept.iter().any(ghost) {
            kept.push(*point);
        }
    }
    kept
}

/// Leaves out what a stronger echo explains: others within its body, and its sidelobes at the same range. Strong is told by
/// the map, not by what changed: an arm that waves changes more than the body that it belongs to.
fn thinned(mut points: Vec<Point>, options: &CfarOptions) -> Vec<Point> {
    points.sort_by(|a, b| b.level.total_cmp(&a.level));
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    for point in points {
        let explained = |other: &Point| {
            let same_range = (other.range_m - point.range_m).abs() <= options.sidelobe_m;
            let weaker = other.level - point.level;
            (weaker > options.limb_ln && flat_distance(other.position, point.position) < options.limb_m)
                || (weaker > options.sidelobe_ln && same_range)
        };
        if !kept.iter().any(explained) {
            kept.push(point);
        }
    }
    kept
}
