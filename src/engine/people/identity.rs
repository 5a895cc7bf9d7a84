//! Who is who: one-to-one assignment of people (Hungarian method), and tracks that carry an identity from frame to frame.

use crate::geometry::{Vec3, add, flat_distance, scale, sub};
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Costs are rounded to this share of their unit: the assignment works on integers.
const STEPS: f64 = 1e6;
/// Costs above this count as this.
const LARGEST: f64 = 1e6;
/// Cost of a pair that must not be: more than any number of pairs that may be.
const FORBIDDEN: i64 = 1 << 50;

/// The one-to-one assignment of rows to columns with the least sum of costs, and among those with the most pairs. `cost`
/// may have any shape; a cost that is not finite forbids the pair. Answers the column of each row, `None` where it has
/// none. Rows shorter than the longest are taken as forbidden past their end.
pub fn match_people(cost: &[Vec<f64>]) -> Vec<Option<usize>> {
    let (rows, columns) = (cost.len(), cost.iter().map(Vec::len).max().unwrap_or(0));
    if rows == 0 || columns == 0 {
        return vec![None; rows];
    }
    let weight = |row: usize, column: usize| {
        let cost = cost.get(row).and_then(|row| row.get(column)).copied().filter(|cost| cost.is_finite());
        cost.map_or(FORBIDDEN, |cost| (cost.clamp(-LARGEST, LARGEST) * STEPS).round() as i64)
    };
    // The method wants no more rows than columns.
    let turned = rows > columns;
    let (height, width) = if turned { (columns, rows) } else { (rows, columns) };
    let of = |(i, j): (usize, usize)| if turned { weight(j, i) } else { weight(i, j) };
    let (_, chosen) = kuhn_munkres_min(&Matrix::from_fn(height, width, of));
    let mut answer = vec![None; rows];
    for (i, j) in chosen.into_iter().enumerate() {
        let (row, column) = if turned { (j, i) } else { (i, j) };
        if weight(row, column) < FORBIDDEN
            && let Some(slot) = answer.get_mut(row)
        {
            *slot = Some(column);
        }
    }
    answer
}

/// When a track lives, what it may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerOptions {
    /// How far from where it was expected a person may be, m, for each second since it was seen last, and at least
    /// [`Self::near_m`].
    pub reach_mps: f64,
    /// Distance that is always allowed, m: half a body, and the error of a place.
    pub near_m: f64,
    /// Share of the newest velocity in the running one.
    pub follow: f64,
    /// Fastest velocity that is carried on, m/s.
    pub fastest_mps: f64,
    /// A track that was not seen for longer dies, s.
    pub lost_s: f64,
}

impl Default for TrackerOptions {
    fn default() -> Self {
        Self { reach_mps: 2.5, near_m: 0.5, follow: 0.4, fastest_mps: 2.0, lost_s: 1.0 }
    }
}

/// A person who is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Never used again within a tracker.
    pub identity: usize,
    /// Where it was seen last, world frame, m.
    pub place: Vec3,
    /// On the floor, m/s.
    pub velocity: Vec3,
    /// Since it was seen, s.
    pub unseen_s: f64,
}

/// Carries identities from frame to frame: predicts by constant velocity, assigns by [`match_people`], gives birth to what
/// is new and forgets who was away too long.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tracker {
    options: TrackerOptions,
    tracks: Vec<Track>,
    born: usize,
}

impl Tracker {
    /// Nobody yet.
    pub fn new(options: TrackerOptions) -> Self {
        Self { options, ..Self::default() }
    }

    /// Those who are followed, in the order of their identities.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// The people of the next frame, `dt_s` after the one before: the identity of each place.
    pub fn step(&mut self, places: &[Vec3], dt_s: f64) -> Vec<usize> {
        let dt_s = if dt_s.is_finite() { dt_s.max(0.0) } else { 0.0 };
        self.tracks.iter_mut().for_each(|track| track.unseen_s += dt_s);
        self.tracks.retain(|track| track.unseen_s <= self.options.lost_s.max(dt_s));
        let options = self.options;
        let cost: Vec<Vec<f64>> =
            places.iter().map(|place| self.tracks.iter().map(|track| track.cost(*place, &options)).collect()).collect();
        let matched = match_people(&cost);
        let mut identities = Vec::with_capacity(places.len());
        for (k, place) in places.iter().enumerate() {
            let found = matched.get(k).copied().flatten().and_then(|column| self.tracks.get_mut(column));
            identities.push(match found {
                Some(track) => {
                    track.follow(*place, &options);
                    track.identity
                }
                None => self.give_birth(*place),
            });
        }
        identities
    }

    fn give_birth(&mut self, place: Vec3) -> usize {
        let identity = self.born;
        self.born += 1;
        self.tracks.push(Track { identity, place, velocity: [0.0; 3], unseen_s: 0.0 });
        identity
    }
}

impl Track {
    /// Where it is expected now, m.
    pub fn expected(&self) -> Vec3 {
        add(self.place, scale(self.velocity, self.unseen_s))
    }

    fn cost(&self, place: Vec3, options: &TrackerOptions) -> f64 {
        let off = flat_distance(self.expected(), place);
        let reach = options.near_m.max(options.reach_mps * self.unseen_s);
        if off <= reach { off } else { f64::INFINITY }
    }

    fn follow(&mut self, place: Vec3, options: &TrackerOptions) {
        if self.unseen_s > 0.0 {
            let [x, y, _] = scale(sub(place, self.place), 1.0 / self.unseen_s);
            let mixed = |old: f64, new: f64| (1.0 - options.follow) * old + options.follow * new;
            let velocity = [mixed(self.velocity[0], x), mixed(self.velocity[1], y), 0.0];
            let speed = velocity[0].hypot(velocity[1]);
            self.velocity =
                scale(velocity, if speed > options.fastest_mps { options.fastest_mps / speed } else { 1.0 });
        }
        (self.place, self.unseen_s) = (place, 0.0);
    }
}
