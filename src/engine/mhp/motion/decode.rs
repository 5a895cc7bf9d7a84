//! Which of the bodies that a search ended at a person is: the one on the cheapest path through those of the frames around.
//!
//! Maps of a few tenths of a second tell front from back, or one leg from the other, by little, and now and then wrongly. But
//! nobody turns about between two frames, who stands before a radar looks at it more often than not, and who walks goes where he
//! looks. A path takes one hypothesis of every frame and costs
//!
//! ```text
//! Σ over frames of (L/L_min + w_net L_net/0.008 + 0.25 away + 0.5 averted)
//!     + Σ over steps of min(apart/0.5 m, 3) + 0.5 max(turned/rad − 0.6, 0)
//! ```
//!
//! with L the loss but for what a network says, which counts as much where nothing explains the maps well, L_min the lowest of a
//! frame, `away` from 0 (who walks ahead) to 1 (who walks backwards), `averted` from 0 (who stands and looks at the radar) to 1 (who
//! looks the other way; less of who turns about in these frames, as bodies do or headings go), `turned` the angle between two
//! headings, and `apart` the mean distance between the joints of two hypotheses, each moved as its velocities say to the middle of the
//! time between them. The cheapest paths come from dynamic programming (Viterbi 1967) from both ends to the frame that is fitted. Before
//! that the bodies on such a path are carried on into the frames beside ([`carried`], `search::carry_on`): what one search missed
//! another found. What a network expects is among the bodies of each frame, as it says it: where none explains the maps, a search
//! ends anywhere, and a path that had to go through there would turn about.
//!
//! Where no body explains the maps of such a path, those that a network expects are decoded likewise, with losses that say how
//! unlikely it calls them.

use super::hypothesis::Hypothesis;
use crate::geometry::{Vec3, flat_distance, mean, norm};
use std::f64::consts::PI;
use std::iter::zip;

/// What a step costs a metre between the joints, and at most.
const PER_M: f64 = 2.0;
const MOST: f64 = 3.0;
/// What looking the other way costs of a frame's lowest loss: of who walks, or falls, and of who stands.
const AWAY: f64 = 0.25;
const AVERTED: f64 = 0.5;
/// Half the loss of a frame whose maps a body explains: there L_net counts twice as much as in the fit, for it knows better than levels
/// do which way somebody looks.
const CLEAR_LOSS: f64 = 0.008;
/// Who turns as fast as this about himself, on average over the frames, looks anywhere, rad/s.
const TURNING_RADPS: f64 = 0.2;
/// Headings of so many frames that follow each other have correlated errors: their windows share frames.
const CORRELATED: f64 = 5.0;
/// Standard errors between the slope of headings and its lower confidence bound.
const STANDARD_ERRORS: f64 = 2.0;
/// What turning costs a radian of a step, beyond so much, rad.
const PER_RAD: f64 = 0.5;
const TURNED_RAD: f64 = 0.6;
/// Nobody is farther from where the frame before has them, m, and for every second between the two, m/s.
const LEASH_M: f64 = 0.4;
const LEASH_MPS: f64 = 2.0;

/// A frame this far away in time says e^(−½) of what this one says of how well bodies explain its maps, s: who stood there hidden
/// among reflectors may have begun to walk, or to fall.
const LIKE_S: f64 = 0.5;

/// Frames on each side whose bodies are carried on into a frame, the next one first. Two of them see what a mistake of the next one
/// hides.
const CARRIED: [usize; 2] = [1, 3];

/// A stage of the trellis: what the persons of a frame may be, and when that is, s after the frame that is fitted.
#[derive(Debug, Clone, Copy)]
pub(in crate::mhp) struct Stage<'a> {
    pub(in crate::mhp) t_s: f64,
    /// A list a person.
    pub(in crate::mhp) persons: &'a [Vec<Hypothesis>],
}

/// One person of a frame.
#[derive(Clone, Copy)]
struct Link<'a> {
    t_s: f64,
    of: &'a [Hypothesis],
}

/// What a sequence says of a person in one of its frames.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::mhp) struct Decoded {
    /// What each hypothesis costs more than the best, in lowest losses of the frame, and one: where nothing is known of the frames
    /// around, its loss by the lowest.
    pub(in crate::mhp) costs: Vec<f64>,
    /// How little bodies explain the maps, on average over the frames in which the person is followed, the nearest the most.
    pub(in crate::mhp) unlikeness: f64,
    /// The frames around in which the person is followed.
    pub(in crate::mhp) followed: usize,
}

/// Decodes one person of a frame by what is seen in those around it, in any order.
pub(in crate::mhp) fn decode(own: &[Hypothesis], around: &[Stage]) -> Decoded {
    Trellis::new(own, around).decoded()
}

/// The bodies that a person of a frame is carried on from: those of the frames [`CARRIED`] on each side that the cheapest path goes
/// through, each with its time, s after this one.
pub(in crate::mhp) fn carried<'a>(own: &'a [Hypothesis], around: &[Stage<'a>]) -> Vec<(f64, &'a Hypothesis)> {
    let trellis = Trellis::new(own, around);
    let Some(best) = lowest(&trellis.decoded().costs) else { return Vec::new() };
    let side = |links: &[Link<'a>]| {
        let mut at = (0.0, &own[best]);
        let mut path = Vec::with_capacity(links.len());
        for (k, to) in links.iter().enumerate() {
            let beyond =
                zip(trellis.shares(to.of), trellis.message(*to, &links[k + 1..])).map(|(share, beyond)| share + beyond);
            let costs: Vec<f64> =
                zip(to.of, beyond).map(|(body, beyond)| beyond + step(at.1, body, to.t_s - at.0)).collect();
            let Some(next) = lowest(&costs) else { break };
            at = (to.t_s, &to.of[next]);
            path.push(at);
        }
        CARRIED.iter().filter_map(|k| path.get(k - 1).copied()).collect::<Vec<_>>()
    };
    trellis.sides.iter().flat_map(|links| side(links)).collect()
}

/// One person of a frame, and in the frames before and after as far as it can be followed.
struct Trellis<'a> {
    own: Link<'a>,
    sides: [Vec<Link<'a>>; 2],
    /// What looking away from the radar counts of a person who stands: 1, and less of one who turns about.
    stands: f64,
}

impl<'a> Trellis<'a> {
    fn new(own: &'a [Hypothesis], around: &[Stage<'a>]) -> Self {
        let own = Link { t_s: 0.0, of: own };
        let sides = [-1.0, 1.0].map(|sign: f64| {
            let mut side: Vec<&Stage> = around.iter().filter(|stage| stage.t_s * sign > 0.0).collect();
            side.sort_by(|a, b| a.t_s.abs().total_cmp(&b.t_s.abs()));
            followed(own, &side)
        });
        let mut trellis = Self { own, sides, stands: 1.0 };
        let turns = trellis.turning_radps() / TURNING_RADPS;
        trellis.stands = (-turns * turns).exp();
        trellis
    }

    /// How fast the person turns about himself, rad/s: as the likeliest bodies do on average, or as their headings, a back like a
    /// front, surely go along the frames, whichever is more.
    fn turning_radps(&self) -> f64 {
        let mut best: Vec<(f64, &Hypothesis)> = self.best().collect();
        best.sort_by(|a, b| a.0.total_cmp(&b.0));
        let spin = best.iter().map(|(_, body)| body.spin).sum::<f64>() / best.len().max(1) as f64;
        let mut heading = best.first().map_or(0.0, |(_, first)| first.yaw);
        let headings = best.iter().map(|(t_s, body)| {
            let turned = body.yaw - heading;
            heading += turned - PI * (turned / PI).round();
            [*t_s, heading]
        });
        spin.abs().max(slope_lower_bound(&headings.collect::<Vec<_>>()))
    }

    /// The body with the lowest loss of every frame, with its time.
    fn best(&self) -> impl Iterator<Item = (f64, &'a Hypothesis)> + '_ {
        let links = std::iter::once(&self.own).chain(self.sides.iter().flatten());
        links.filter_map(|link| Some((link.t_s, link.of.first()?)))
    }

    fn decoded(&self) -> Decoded {
        let [past, future] = self.sides.each_ref().map(|side| self.message(self.own, side));
        let whole: Vec<f64> = zip(self.shares(self.own.of), zip(past, future))
            .map(|(share, (past, future))| share + past + future)
            .collect();
        let lowest = whole.iter().copied().fold(f64::INFINITY, f64::min);
        let (mut unlike, mut weights) = (0.0, 0.0);
        for (t_s, best) in self.best() {
            let weight = (-0.5 * (t_s / LIKE_S).powi(2)).exp();
            unlike += weight * best.unlikeness;
            weights += weight;
        }
        Decoded {
            costs: whole.iter().map(|cost| cost - lowest + 1.0).collect(),
            unlikeness: unlike / weights.max(f64::MIN_POSITIVE),
            followed: self.sides.iter().map(Vec::len).sum(),
        }
    }

    /// The cost of the cheapest path from each hypothesis of `own` to the end of `links`, its own share left out.
    fn message(&self, own: Link, links: &[Link]) -> Vec<f64> {
        let Some(last) = links.last() else { return vec![0.0; own.of.len()] };
        let mut beyond = vec![0.0; last.of.len()];
        for k in (0..links.len()).rev() {
            let (to, from) = (links[k], if k == 0 { own } else { links[k - 1] });
            let there: Vec<f64> = zip(self.shares(to.of), &beyond).map(|(share, beyond)| share + beyond).collect();
            let cheapest = |a: &Hypothesis| {
                let each = zip(to.of, &there).map(|(b, there)| there + step(a, b, to.t_s - from.t_s));
                each.fold(f64::INFINITY, f64::min)
            };
            beyond = from.of.iter().map(cheapest).collect();
        }
        beyond
    }

    /// The losses by the lowest of them, and what looking away costs.
    fn shares<'b>(&self, of: &'b [Hypothesis]) -> impl Iterator<Item = f64> + use<'b> {
        let lowest = of.iter().map(|hypothesis| hypothesis.loss).fold(f64::INFINITY, f64::min);
        let averted = AVERTED * self.stands;
        of.iter().map(move |hypothesis| {
            let away = AWAY * hypothesis.away + averted * hypothesis.averted;
            hypothesis.loss / lowest.max(f64::MIN_POSITIVE) + away + hypothesis.network / CLEAR_LOSS
        })
    }
}

/// The lower confidence bound of the magnitude of the least-squares slope through points (x, y), at least 0: the slope less [`STANDARD_ERRORS`].
fn slope_lower_bound(points: &[[f64; 2]]) -> f64 {
    let count = points.len() as f64;
    let [x, y] = [0, 1].map(|k| points.iter().map(|point| point[k]).sum::<f64>() / count.max(1.0));
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for point in points {
        let (x, y) = (point[0] - x, point[1] - y);
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    if count <= CORRELATED || xx <= 0.0 {
        return 0.0;
    }
    let slope = xy / xx;
    let error = (CORRELATED * (yy - slope * xy).max(0.0) / ((count - 2.0) * xx)).sqrt();
    (slope.abs() - STANDARD_ERRORS * error).max(0.0)
}

/// The person of `own` in the frames on one side, the nearest first.
fn followed<'a>(own: Link, side: &[&Stage<'a>]) -> Vec<Link<'a>> {
    let (mut at, mut from_s) = (place(own.of), own.t_s);
    let mut links = Vec::with_capacity(side.len());
    for stage in side.iter().filter(|stage| !stage.persons.is_empty()) {
        let far = |of: &[Hypothesis]| place(of).zip(at).map_or(f64::INFINITY, |(p, q)| flat_distance(p, q));
        let nearest = stage.persons.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        let leash_m = LEASH_M + LEASH_MPS * (stage.t_s - from_s).abs();
        let Some(of) = nearest.filter(|of| far(of) < leash_m) else { break };
        (at, from_s) = (place(of), stage.t_s);
        links.push(Link { t_s: stage.t_s, of });
    }
    links
}

/// Where the likeliest of some hypotheses is.
fn place(of: &[Hypothesis]) -> Option<Vec3> {
    of.first().map(|best| mean(&best.joints))
}

/// What it costs to be `a` and, `dt_s` later, `b`.
fn step(a: &Hypothesis, b: &Hypothesis, dt_s: f64) -> f64 {
    let moved = |(p, v): (&Vec3, &Vec3), dt_s: f64| [0, 1, 2].map(|k| p[k] + dt_s * v[k]);
    let [here, there] = [(a, 0.5 * dt_s), (b, -0.5 * dt_s)]
        .map(|(of, dt_s)| zip(&of.joints, &of.velocities).map(move |joint| moved(joint, dt_s)));
    let apart_m: f64 = zip(here, there).map(|(p, q)| norm([0, 1, 2].map(|k| p[k] - q[k]))).sum();
    let turned = (a.turned(b) - TURNED_RAD).max(0.0);
    (PER_M * apart_m / a.joints.len().max(1) as f64).min(MOST) + PER_RAD * turned
}

/// The place of the smallest number.
pub(in crate::mhp) fn lowest(costs: &[f64]) -> Option<usize> {
    (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Somebody at `x` who looks along `yaw`: one shoulder to each side.
    fn body(x: f64, yaw: f64, loss: f64) -> Hypothesis {
        let joints = [1.0, -1.0].map(|side| [x - 0.2 * side * yaw.sin(), 0.2 * side * yaw.cos(), 0.0]).to_vec();
        Hypothesis {
            loss,
            unlikeness: loss,
            network: 0.0,
            yaw,
            away: 0.0,
            averted: 0.0,
            spin: 0.0,
            velocities: vec![[1.0, 0.0, 0.0]; 2],
            beta: vec![0.0; 2],
            still: 0.0,
            joints,
        }
    }

    #[test]
    fn a_frame_alone_has_its_losses() {
        let own = [body(3.0, 0.0, 0.2), body(3.0, 3.0, 0.25)];
        let found = decode(&own, &[]);
        assert_eq!((found.costs, found.unlikeness), (vec![1.0, 1.25], 0.2));
    }

    #[test]
    fn the_frames_around_decide_against_one_frame_and_not_against_their_own() {
        let back = std::f64::consts::PI;
        // This frame takes the back for better by a tenth; those around the front, by three tenths each.
        let own = [body(3.0, back, 0.2), body(3.0, 0.0, 0.22)];
        let others: Vec<(f64, Vec<Vec<Hypothesis>>)> = [-2.0, -1.0, 1.0, 2.0]
            .map(|k: f64| {
                let x = 3.0 + 0.1 * k;
                let elsewhere = vec![body(x + 3.0, back, 0.1)];
                (0.1 * k, vec![elsewhere, vec![body(x, 0.0, 0.2), body(x, back, 0.26)]])
            })
            .to_vec();
        let around: Vec<Stage> = others.iter().map(|(t_s, persons)| Stage { t_s: *t_s, persons }).collect();
        let decoded = decode(&own, &around);
        let found = &decoded.costs;
        assert!((decoded.unlikeness - 0.2).abs() < 1e-12);
        assert_eq!(lowest(found), Some(1), "{found:?}");
        // Two steps to the front of both neighbours cost more than the tenth: as far as the joints are apart, 0.8 each.
        assert!((found[0] - 1.0 - (4.0 * 0.3_f64).min(1.6) + 0.1).abs() < 1e-9, "{found:?}");
        // Somebody else, farther than the leash, says nothing.
        let far: Vec<Stage> = around.iter().map(|stage| Stage { persons: &stage.persons[..1], ..*stage }).collect();
        assert_eq!(decode(&own, &far), decode(&own, &[]));
    }

    #[test]
    fn bodies_are_carried_on_from_the_path() {
        let own = [body(3.0, 0.0, 0.2)];
        let frame = |x: f64| vec![vec![body(x, 3.0, 0.19), body(x, 0.0, 0.2)]];
        let others = [frame(2.6), frame(2.7), frame(2.9), frame(3.1)];
        let around: Vec<Stage> =
            zip([-0.4, -0.3, -0.1, 0.1], &others).map(|(t_s, persons)| Stage { t_s, persons }).collect();
        let found = carried(&own, &around);
        // The first and the third before it, and the first after it; of each the body that looks the same way.
        assert_eq!(found.iter().map(|(t_s, _)| *t_s).collect::<Vec<_>>(), [-0.1, -0.4, 0.1]);
        assert!(found.iter().all(|(_, body)| body.yaw == 0.0), "{found:?}");
        assert!(carried(&own, &[]).is_empty());
    }

    #[test]
    fn who_stands_looks_at_the_radar_where_the_loss_does_not_say_otherwise() {
        let with = |back: f64, spin: f64| {
            let away = Hypothesis { averted: 1.0, spin, ..body(3.0, 0.0, back) };
            let here = Hypothesis { spin, ..body(3.0, std::f64::consts::PI, 0.2) };
            lowest(&decode(&[away, here], &[]).costs)
        };
        assert_eq!((with(0.17, 0.0), with(0.12, 0.0)), (Some(1), Some(0)));
        // Who turns about looks anywhere, whichever way he turns.
        assert_eq!([1.0, -1.0].map(|spin| with(0.17, spin)), [Some(0), Some(0)]);
    }

    #[test]
    fn headings_that_go_along_the_frames_are_a_turn_and_those_that_scatter_are_none() {
        // The back is lower by a tenth; nobody spins by himself.
        let lowest_with = |heading: fn(f64) -> f64| {
            let frame = |k: f64| {
                let away = Hypothesis { averted: 1.0, ..body(3.0, heading(k), 0.18) };
                vec![vec![away, body(3.0, heading(k) + PI, 0.2)]]
            };
            let others: Vec<_> = (1..6).flat_map(|k| [-0.1, 0.1].map(|t_s| f64::from(k) * t_s)).collect();
            let persons: Vec<_> = others.iter().map(|t_s| frame(10.0 * t_s)).collect();
            let around: Vec<Stage> =
                zip(&others, &persons).map(|(t_s, persons)| Stage { t_s: *t_s, persons }).collect();
            lowest(&decode(&frame(0.0)[0], &around).costs)
        };
        assert_eq!(lowest_with(|k| 0.06 * k), Some(0), "a turn");
        assert_eq!(lowest_with(|k| 0.06 * k + if k < 0.0 { PI } else { 0.0 }), Some(0), "half a back, half a front");
        assert_eq!(lowest_with(|_| 0.0), Some(1), "somebody stands");
        assert_eq!(lowest_with(|k| 0.3 * (1.7 * k).sin()), Some(1), "headings scatter");
    }

    #[test]
    fn a_slope_is_sure_of_many_points_on_a_line() {
        let points = |count: usize, off: f64| -> Vec<[f64; 2]> {
            (0..count).map(|k| [k as f64, 3.0 - 0.5 * k as f64 + if k % 2 == 0 { off } else { -off }]).collect()
        };
        assert!((slope_lower_bound(&points(9, 0.0)) - 0.5).abs() < 1e-9);
        let unsure = slope_lower_bound(&points(20, 0.5));
        assert!(unsure > 0.2 && unsure < 0.5, "{unsure}");
        assert_eq!(
            [slope_lower_bound(&points(9, 3.0)), slope_lower_bound(&points(4, 0.0)), slope_lower_bound(&[])],
            [0.0; 3]
        );
    }

    #[test]
    fn a_network_decides_where_nothing_explains_the_maps_well() {
        // Of two bodies a tenth apart the network expects the one that explains less.
        let with = |loss: f64| {
            let unexpected = Hypothesis { network: 3.2e-3, ..body(3.0, 0.0, loss) };
            let found = decode(&[unexpected, body(3.2, 0.0, 1.1 * loss)], &[]).costs;
            (found[1] - found[0], lowest(&found))
        };
        let (poorly, well) = (with(0.2), with(0.01));
        assert!((poorly.0 + 0.3).abs() < 1e-9 && poorly.1 == Some(1), "{poorly:?}");
        // It says so by as much whatever the loss.
        assert!((well.0 - poorly.0).abs() < 1e-9, "{well:?}");
    }

    #[test]
    fn nobody_turns_about_between_two_frames() {
        let back = std::f64::consts::PI;
        let own = [body(3.0, back, 0.2), body(3.0, 0.0, 0.24)];
        let others = vec![vec![body(3.1, 0.0, 0.2), body(3.1, back, 0.3)]];
        let around = [Stage { t_s: 0.1, persons: &others }];
        let found = decode(&own, &around).costs;
        assert_eq!(lowest(&found), Some(1));
        // To stay a back costs 0.5 there, and a front 0.2 here.
        assert!((found[0] - 1.3).abs() < 1e-9, "{found:?}");
        // The joints of a back are 0.4 m from those of a front.
        let turn = step(&body(0.0, back, 1.0), &body(0.1, 0.0, 1.0), 0.1);
        assert!((turn - 0.8 - PER_RAD * (back - TURNED_RAD)).abs() < 1e-9, "{turn}");
    }
}
