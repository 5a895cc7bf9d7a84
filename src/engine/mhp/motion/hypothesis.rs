//! What a search ends at: bodies with their losses, and what is said of them.

use super::WALKING_MPS;
use super::decode::lowest;
use crate::body::{Group, Pppr};
use crate::geometry::{Vec3, mean, norm, sub};
use crate::mhp::pose_network::Expected;
use std::f64::consts::{PI, TAU};

/// A heading whose loss is larger by a smaller share than this is as good.
const AMBIGUOUS: f64 = 0.1;
/// Headings farther apart than this are different ones.
const ANOTHER_HEADING: f64 = PI / 3.0;

/// A body that a search ended at, in the frame that is fitted.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::mhp) struct Hypothesis {
    /// L of the window, by the search's weights, with this body in it, but for the network's share.
    pub(in crate::mhp) loss: f64,
    /// That share, w_net · L_net.
    pub(in crate::mhp) network: f64,
    /// How little it explains the maps ([`super::unlikeness`]), and how far it is from the start.
    pub(in crate::mhp) unlikeness: f64,
    /// Where it looks, rad.
    pub(in crate::mhp) yaw: f64,
    /// How unusual it is to look there: of who walks 0 ahead, 1 back; who lies is as unusual, 1.
    pub(in crate::mhp) away: f64,
    /// Of who stands 0 at the radar, 1 the other way: unusual of who does not turn about.
    pub(in crate::mhp) averted: f64,
    /// How fast it turns about itself, rad/s.
    pub(in crate::mhp) spin: f64,
    /// Its joints, world frame, m.
    pub(in crate::mhp) joints: Vec<Vec3>,
    /// Their velocities, m/s.
    pub(in crate::mhp) velocities: Vec<Vec3>,
    /// How opaque they are: what static echoes leave.
    pub(in crate::mhp) beta: Vec<f64>,
    /// q.
    pub(in crate::mhp) still: f64,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::mhp) struct Searched {
    /// The start's own loss.
    pub(in crate::mhp) begun: f64,
    /// What the search ended at, and what a network expects as it says it, a list a person, the lowest loss first; none is empty.
    pub(in crate::mhp) persons: Vec<Vec<Hypothesis>>,
    /// The bodies that a network expects each person to be, as it says them; of nobody where it is not asked.
    pub(in crate::mhp) expected: Vec<Vec<Hypothesis>>,
    /// All that it says of them.
    pub(in crate::mhp) network: Vec<Option<Expected>>,
    /// How each person is to move, m, where the pose there is not believed.
    pub(in crate::mhp) moved: Vec<Vec3>,
}

impl Hypothesis {
    /// Makes a person of `params` this body.
    pub(in crate::mhp) fn place(&self, person: usize, params: &mut Pppr) {
        let joints = params.shape().joints;
        let own = person * joints..(person + 1) * joints;
        let [positions, velocities] = params.motion_mut();
        positions[own.clone()].copy_from_slice(&self.joints);
        velocities[own.clone()].copy_from_slice(&self.velocities);
        params.group_mut(Group::Beta)[own].copy_from_slice(&self.beta);
    }

    /// By how much it is turned against another, rad, at most π.
    pub(super) fn turned(&self, other: &Self) -> f64 {
        let turn = (self.yaw - other.yaw).rem_euclid(TAU);
        turn.min(TAU - turn)
    }
}

impl Searched {
    /// In words, where `costs` of the last person's hypotheses decided.
    pub(in crate::mhp) fn note(&self, costs: &[f64]) -> String {
        let Some(last) = self.persons.last() else { return String::new() };
        let Some(best) = lowest(costs).and_then(|k| last.get(k).map(|found| (k, found))) else { return String::new() };
        let (k, found) = best;
        let others = last.iter().zip(costs).filter(|(other, _)| other.turned(found) > ANOTHER_HEADING);
        let other = match others.min_by(|a, b| a.1.total_cmp(b.1)) {
            Some((other, cost)) => {
                let behind = cost / costs[k] - 1.0;
                let doubt = if behind < AMBIGUOUS { "; heading ambiguous: " } else { "; " };
                format!("{doubt}turned by {:.0}° it is {:.1} % worse", other.turned(found).to_degrees(), 100.0 * behind)
            }
            None => String::new(),
        };
        format!("motion: loss {:.3} → {:.3}{other}", self.begun, found.loss)
    }
}

/// How unusual it is to look along `yaw` with these velocities, m/s, before a radar that lies in this direction: of who walks, and of
/// who stands.
pub(super) fn away(yaw: f64, velocities: &[Vec3], to_radar: Vec3) -> [f64; 2] {
    let opposed = |[x, y, _]: Vec3| 0.5 - 0.5 * (yaw - y.atan2(x)).cos();
    let goes = mean(velocities);
    if norm(goes) >= WALKING_MPS { [opposed(goes), 0.0] } else { [0.0, opposed(to_radar)] }
}

/// How fast joints turn about the vertical axis through their middle, rad/s.
pub(super) fn spin(joints: &[Vec3], velocities: &[Vec3]) -> f64 {
    let (middle, goes) = (mean(joints), mean(velocities));
    let (mut momentum, mut inertia) = (0.0, 0.0);
    for (joint, velocity) in joints.iter().zip(velocities) {
        let (at, v) = (sub(*joint, middle), sub(*velocity, goes));
        momentum += at[0] * v[1] - at[1] * v[0];
        inertia += at[0] * at[0] + at[1] * at[1];
    }
    momentum / inertia.max(1e-9)
}

/// The lowest loss of the search first, the network's share with it.
pub(super) fn sort_by_loss(found: &mut [Hypothesis]) {
    found.sort_by(|a, b| (a.loss + a.network).total_cmp(&(b.loss + b.network)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_stands_looks_at_the_radar_and_who_walks_ahead() {
        let to_radar = [-3.0, 0.0, 0.2];
        let of = |yaw: f64, goes: Vec3| away(yaw, &[goes; 4], to_radar);
        let near = |found: [f64; 2], expected: [f64; 2]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}, {expected:?}");
        };
        let (still, left) = ([0.1, 0.0, 0.0], [0.0, 1.0, 0.0]);
        near(of(PI, still), [0.0, 0.0]);
        near(of(0.0, still), [0.0, 1.0]);
        near(of(0.5 * PI, left), [0.0, 0.0]);
        near(of(-0.5 * PI, left), [1.0, 0.0]);
    }

    #[test]
    fn a_body_that_turns_about_itself_while_it_goes_is_seen_to() {
        let joints = [[3.0, 0.2, 0.0], [3.0, -0.2, 0.0], [3.2, 0.0, 0.5], [2.8, 0.0, 0.5]];
        for rate in [-1.5, 0.0, 0.3] {
            let velocities = joints.map(|[x, y, _]| [0.4 - rate * y, 0.1 + rate * (x - 3.0), 0.2]);
            assert!((spin(&joints, &velocities) - rate).abs() < 1e-12);
        }
        assert_eq!(spin(&[[1.0, 2.0, 0.0]], &[[3.0, 0.0, 0.0]]), 0.0, "a point turns about nothing");
    }
}
