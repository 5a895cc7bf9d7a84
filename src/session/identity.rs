//! Who is who on screen: the persons of a fit keep their identity, and so their colour, from frame to frame.

use super::Session;
use crate::body::Pppr;
use crate::geometry::{Vec3, mean};
use crate::people::Tracker;

/// Frames apart at which persons are still followed; farther away everybody is counted anew.
const NEAR_FRAMES: usize = 15;
/// Seconds a frame where the data set does not say.
const FRAME_S: f64 = 0.1;

/// Follows the persons of the frames that are looked at.
#[derive(Debug, Default)]
pub(super) struct Identities {
    tracker: Tracker,
    /// The sequence and the frame of the last step.
    last: Option<(String, usize)>,
}

impl Session {
    /// Gives the persons of the fit on screen their identities, once a fit: those of the frame looked at before where it is
    /// near in the same sequence, new ones otherwise.
    pub(super) fn identify(&mut self) {
        let Some(places) = self.fit.initial.as_ref().map(middles) else { return };
        if self.fit.identities.len() == places.len() {
            return;
        }
        let (frame, dataset) = (self.fit.frame, self.data.dataset.as_ref());
        let sequence = dataset.map_or_else(String::new, |dataset| dataset.sequence(frame).to_owned());
        let frame_s =
            dataset.and_then(|d| d.info().frame_rate_hz).filter(|rate| *rate > 0.0).map_or(FRAME_S, f64::recip);
        let last =
            self.identities.last.as_ref().filter(|(name, at)| *name == sequence && at.abs_diff(frame) <= NEAR_FRAMES);
        let frames = last.map(|(_, at)| at.abs_diff(frame));
        if frames.is_none() {
            self.identities.tracker = Tracker::default();
        }
        self.fit.identities = self.identities.tracker.step(&places, frames.unwrap_or(0) as f64 * frame_s);
        self.identities.last = Some((sequence, frame));
    }

    /// The identity of a person of the fit on screen, 0 and up; its own number where nothing is known.
    pub fn identity(&self, person: usize) -> usize {
        self.fit.identities.get(person).copied().unwrap_or(person)
    }
}

/// The middle of each person's joints, m.
fn middles(params: &Pppr) -> Vec<Vec3> {
    (0..params.shape().persons).map(|person| mean(params.person(person))).collect()
}
