//! Where somebody was seen last, or is seen next: who lies still after a fall, or stops, fades from maps without static echoes, and is
//! still there.

use super::{Hypotheses, Hypothesis, motion, stages};

/// A frame farther away in time says nothing of where somebody is, s.
const REACH_S: f64 = 1.25;
/// Whoever is not seen any more comes to rest in about this time, s.
const REST_S: f64 = 0.15;
/// Joints are in the middle of limbs: this far above the floor at least, m.
const ABOVE_FLOOR_M: f64 = 0.05;

impl Hypotheses {
    /// The body that the one person has in the nearest of the frames `around` whose maps it explains, as those beyond it do, come to
    /// rest since, on a floor so far below the radar, m; `None` where there is none, and of several.
    pub(super) fn last_seen(&self, radar_height_m: Option<f64>, around: &[(f64, &Self)]) -> Option<Hypothesis> {
        self.one()?;
        let mut near: Vec<(f64, &Self)> = around.iter().filter(|(t_s, _)| t_s.abs() <= REACH_S).copied().collect();
        near.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        near.into_iter().find_map(|(t_s, frame)| {
            let is_beyond = |other: f64| other * t_s > 0.0 && other.abs() > t_s.abs();
            let beyond: Vec<(f64, &Self)> = around
                .iter()
                .filter(|(other, _)| is_beyond(*other))
                .map(|(other, frame)| (other - t_s, *frame))
                .collect();
            Some(frame.explaining(&beyond)?.at_rest(-t_s, radar_height_m))
        })
    }

    /// The body of the one person on the cheapest path through the frames `around`; `None` where it, or those of all these frames, do not
    /// explain the maps, and where none of these frames shows him.
    fn explaining(&self, around: &[(f64, &Self)]) -> Option<&Hypothesis> {
        let own = self.one()?;
        let decoded = motion::decode(own, &stages(around, |found| &found.persons));
        let body = own.get(motion::lowest(&decoded.costs)?)?;
        let unlikeness = body.unlikeness.max(decoded.unlikeness);
        let is_ghost = decoded.followed == 0 && !around.is_empty();
        (!is_ghost && !motion::is_unlike(unlikeness, 1)).then_some(body)
    }

    /// What the one person may be; `None` of several, and where none was searched for.
    fn one(&self) -> Option<&[Hypothesis]> {
        match self.searched.as_ref()?.as_ref().ok()?.persons.as_slice() {
            [one] => Some(one),
            _ => None,
        }
    }
}

impl Hypothesis {
    /// This body so much later, s, or earlier: it moves on as a whole, slower and slower, and not through the floor, so far below the
    /// radar, m.
    fn at_rest(&self, later_s: f64, radar_height_m: Option<f64>) -> Self {
        let moving_s = later_s.signum() * REST_S * (1.0 - (-later_s.abs() / REST_S).exp());
        let mut joints = motion::later(&self.joints, &self.velocities, moving_s);
        let lowest_m = joints.iter().map(|joint| joint[2]).fold(f64::INFINITY, f64::min);
        let sunk_m = radar_height_m.map_or(0.0, |height_m| (ABOVE_FLOOR_M - height_m - lowest_m).max(0.0));
        for joint in &mut joints {
            joint[2] += sunk_m;
        }
        Self { joints, velocities: vec![[0.0; 3]; self.velocities.len()], ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{body, frame_of};
    use super::*;

    #[test]
    fn who_is_not_seen_any_more_lies_where_the_last_frame_that_shows_him_has_him() {
        let seen = |x: f64| frame_of(Hypothesis { unlikeness: 0.2, ..body(x, 0.0, 0.1) });
        let (lost, ghost) =
            (frame_of(body(5.0, 0.0, 1.0)), frame_of(Hypothesis { unlikeness: 0.2, ..body(5.0, 0.0, 0.1) }));
        let (before, earlier) = (seen(3.0), seen(3.2));
        let at = |around: &[(f64, &Hypotheses)]| lost.last_seen(None, around).map(|body| body.joints[0][0]);
        assert_eq!(at(&[(-0.3, &earlier), (-0.2, &before), (-0.1, &lost)]), Some(3.0));
        // What one frame alone shows, and the others beyond it do not, is a ghost.
        assert_eq!(at(&[(-0.2, &lost), (-0.15, &lost), (-0.1, &ghost)]), None);
        let far = frame_of(body(9.0, 0.0, 1.0));
        assert_eq!(at(&[(-0.3, &far), (-0.2, &before), (-0.1, &lost)]), None, "those beyond it are of somebody else");
        assert_eq!(at(&[(-2.0, &before)]), None, "long ago");
    }

    #[test]
    fn a_body_comes_to_rest_on_the_floor() {
        let falling = Hypothesis { velocities: vec![[0.0, 0.0, -2.0]; 2], ..body(3.0, 0.0, 0.1) };
        let rests = |later_s: f64, radar_height_m: f64| falling.at_rest(later_s, Some(radar_height_m)).joints[0][2];
        assert!((rests(10.0, 2.0) + 0.3).abs() < 1e-9 && rests(0.1, 2.0) > rests(0.2, 2.0));
        assert!((rests(10.0, 0.25) + 0.2).abs() < 1e-9, "above the floor");
        assert_eq!(falling.at_rest(1.0, None).velocities, vec![[0.0; 3]; 2]);
    }
}
