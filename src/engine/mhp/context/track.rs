//! Where a person goes: its place in the frames around, a line through them, and from the line velocity and heading.
//!
//! Left and right, front and back can hardly be told in one frame, but people walk forwards. Each neighbour's map is
//! searched around the place of the frame before it on the way out, so that the track does not jump to somebody else.

use super::middle::centre;
use super::saliency::SaliencyMap;
use super::temporal::TemporalContext;
use crate::geometry::{Vec3, add_scaled, scale, sub};
use crate::mhp::percentile;
use crate::radar::View;

/// Slower than this, a person stands and the track's direction is its errors', m/s.
const WALKING_MPS: f64 = 0.5;
/// Who walks goes this share of its speed in the first and in the last half of the frames; who begins to fall does not.
const STEADY_SHARE: f64 = 0.38;
/// A head that comes down faster than this falls or sits down, m/s.
const FALLING_MPS: f64 = -0.35;
/// Frames this far away count e^-½ of the frame itself for its place, s: nobody goes straight for long.
const WINDOW_S: f64 = 0.15;
/// Farther from the place that the frame before leads to, the track is somebody else, m, and share of the way to the nearest
/// other person.
const LEASH_M: f64 = 0.35;
const LEASH_SHARE: f64 = 0.3;

/// A person in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mhp) struct Sighting {
    /// Seconds after the frame that is fitted.
    pub t_s: f64,
    /// Middle of the body, m.
    pub at: Vec3,
    /// Lowest and highest lit height, m.
    pub lit_m: Option<[f64; 2]>,
}

/// A person through the frames around, and a line through its places.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::mhp) struct Track {
    /// Place at the time of the frame, m.
    pub at: Vec3,
    /// m/s; heights do not move.
    pub velocity: Vec3,
    /// The direction of walking on the floor; `None` where the person stands, or falls: who falls need not look where.
    pub heading: Option<[f64; 2]>,
    /// In every frame, the one in the middle included.
    pub sightings: Vec<Sighting>,
}

impl Track {
    fn through(sightings: Vec<Sighting>) -> Self {
        let places = sightings.iter().map(|seen| (seen.t_s, seen.at));
        let (_, [vx, vy, _]) = line(places.clone(), f64::INFINITY);
        let (at, _) = line(places, WINDOW_S);
        // Heights are read too coarsely to follow them.
        let height_m = sightings.iter().map(|seen| seen.at[2]).sum::<f64>() / sightings.len() as f64;
        let speed = vx.hypot(vy);
        let along = [vx / speed, vy / speed];
        let walks = speed > WALKING_MPS && is_steady(&sightings, along, speed) && rises_mps(&sightings) > FALLING_MPS;
        let (at, velocity) = ([at[0], at[1], height_m], [vx, vy, 0.0]);
        Self { at, velocity, heading: walks.then_some(along), sightings }
    }
}

/// Whether both halves of the track go `along`.
fn is_steady(sightings: &[Sighting], along: [f64; 2], speed: f64) -> bool {
    let mut ordered: Vec<(f64, Vec3)> = sightings.iter().map(|seen| (seen.t_s, seen.at)).collect();
    ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = ordered.len().div_ceil(2);
    [&ordered[..half], &ordered[ordered.len() - half..]].into_iter().all(|half| {
        let (_, velocity) = line(half.iter().copied(), f64::INFINITY);
        velocity[0] * along[0] + velocity[1] * along[1] > STEADY_SHARE * speed
    })
}

/// How fast the top of what is lit rises, m/s: the median of the slopes between any two frames that show it (Theil and
/// Sen), for a hand or a ghost above the head now and then is no rise.
fn rises_mps(sightings: &[Sighting]) -> f64 {
    let tops: Vec<(f64, f64)> =
        sightings.iter().filter_map(|seen| seen.lit_m.map(|[_, top]| (seen.t_s, top))).collect();
    let pairs = tops.iter().enumerate().flat_map(|(k, a)| tops[k + 1..].iter().map(move |b| (a, b)));
    let slopes: Vec<f64> = pairs.map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)).filter(|slope| slope.is_finite()).collect();
    if slopes.is_empty() { 0.0 } else { percentile(&slopes, 50.0) }
}

/// Follows the person who was found at `here`, `apart_m` from the nearest other, through the frames around; `None` where
/// there are none.
pub(in crate::mhp) fn track(context: &TemporalContext, here: Sighting, apart_m: f64) -> Option<Track> {
    let mut sightings = vec![here];
    for forwards in [true, false] {
        let side = context.around().filter(|(t_s, _)| (*t_s > 0.0) == forwards && *t_s != 0.0);
        let mut ordered: Vec<_> = side.collect();
        ordered.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let (mut last, mut velocity) = (here, [0.0; 3]);
        for (t_s, maps) in ordered {
            let step_s = t_s - last.t_s;
            let mut expected = last.at;
            add_scaled(&mut expected, velocity, step_s);
            let Some(found) = follow(context.views(), maps(), t_s, expected, apart_m) else { break };
            velocity = scale(sub(found.at, last.at), 1.0 / step_s);
            last = found;
            sightings.push(found);
        }
    }
    (sightings.len() > 1).then(|| Track::through(sightings))
}

/// The middle of what is lit near `expected`; `None` where that is somebody else.
fn follow(views: &[View], maps: &[SaliencyMap], t_s: f64, expected: Vec3, apart_m: f64) -> Option<Sighting> {
    let (at, expectation) = centre(views, maps, expected, apart_m);
    let off = sub(at, expected);
    (off[0].hypot(off[1]) < LEASH_M.min(LEASH_SHARE * apart_m)).then_some(Sighting { t_s, at, lit_m: expectation.lit })
}

/// Weighted least squares through (time, s; point, m): the point at time 0 and the velocity, m/s. A point at time t weighs
/// e^(−½ (t / `window_s`)²).
fn line(points: impl Iterator<Item = (f64, Vec3)> + Clone, window_s: f64) -> (Vec3, Vec3) {
    let weight = |t: f64| (-0.5 * (t / window_s).powi(2)).exp();
    let total = points.clone().map(|(t, _)| weight(t)).sum::<f64>().max(f64::MIN_POSITIVE);
    let (mut mean, mut time) = ([0.0; 3], 0.0);
    for (t, point) in points.clone() {
        add_scaled(&mut mean, point, weight(t) / total);
        time += t * weight(t) / total;
    }
    let (mut slope, mut spread) = ([0.0; 3], 0.0);
    for (t, point) in points {
        add_scaled(&mut slope, sub(point, mean), (t - time) * weight(t));
        spread += (t - time).powi(2) * weight(t);
    }
    let velocity = if spread > 0.0 { scale(slope, 1.0 / spread) } else { [0.0; 3] };
    add_scaled(&mut mean, velocity, -time);
    (mean, velocity)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn a_line_gives_place_and_velocity_at_the_frame() {
        let seen = |t_s: f64, at: Vec3| Sighting { t_s, at, lit_m: None };
        let track =
            Track::through([0.0, 0.1, 0.2, -0.1].map(|t| seen(t, [3.0 - 1.2 * t, 0.5 + 0.4 * t, 0.1])).to_vec());
        assert!((track.at[0] - 3.0).abs() < 1e-12 && (track.at[1] - 0.5).abs() < 1e-12);
        assert!((track.velocity[0] + 1.2).abs() < 1e-12 && (track.velocity[1] - 0.4).abs() < 1e-12);
        let heading = track.heading.unwrap();
        assert!((heading[0] + 1.2 / 1.2f64.hypot(0.4)).abs() < 1e-12);
        assert_eq!(Track::through(vec![seen(0.0, [1.0; 3]), seen(0.1, [1.01, 1.0, 1.0])]).heading, None);
    }

    #[test]
    fn who_begins_to_move_has_no_heading_yet() {
        let seen = |t_s: f64, x: f64| Sighting { t_s, at: [x, 0.0, 0.0], lit_m: None };
        let track = Track::through(vec![
            seen(0.0, 3.0),
            seen(0.1, 3.1),
            seen(0.2, 3.3),
            seen(0.3, 3.5),
            seen(-0.1, 3.0),
            seen(-0.2, 3.01),
            seen(-0.3, 3.0),
        ]);
        assert!(track.velocity[0] > WALKING_MPS && track.heading.is_none());
        assert!((track.at[0] - 3.05).abs() < 0.04, "and is where the frames next to this one say: {}", track.at[0]);
    }

    #[test]
    fn who_falls_has_no_heading() {
        let seen = |t_s: f64, top: f64| Sighting { t_s, at: [3.0 + 1.2 * t_s, 0.0, 0.0], lit_m: Some([-1.0, top]) };
        let walks = Track::through(vec![seen(0.0, 0.8), seen(0.1, 0.84), seen(-0.1, 0.78)]);
        assert!(walks.heading.is_some_and(|heading| (heading[0] - 1.0).abs() < 1e-12));
        let falls = Track::through(vec![seen(0.0, 0.6), seen(0.1, 0.4), seen(-0.1, 0.8)]);
        assert!((rises_mps(&falls.sightings) + 2.0).abs() < 1e-9 && falls.heading.is_none());
    }
}
