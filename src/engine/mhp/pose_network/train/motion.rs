//! Who moves before the radar in a lesson: recorded people, put anywhere before it, and the actors of the synthetic source.

use crate::body::MotionClip;
use crate::geometry::Vec3;
use rand::{Rng, rngs::StdRng};
use std::f64::consts::PI;

use super::super::layers::JOINTS;
use super::super::{MIRRORED, TRUNK};

/// Samples of a second.
pub(super) const HZ: f64 = 20.0;
/// Samples of the stretch that a lesson sees.
pub const POSE_STRETCH: usize = 40;
/// Samples on each side of the middle of a window.
pub(super) const MARGIN: usize = 4;
/// How often each kind of recorded motion is drawn, others [`ELSE`].
const GROUPS: [(&str, f64); 11] = [
    ("walk", 3.0),
    ("stand idle", 1.5),
    ("sit to stand", 1.5),
    ("squat/lunge", 1.0),
    ("arm raise/reach", 2.0),
    ("step/leg raise", 1.0),
    ("gesture/wash/bend", 1.0),
    ("dance", 1.5),
    ("punch/kick", 0.7),
    ("jump/hop", 0.4),
    ("get up from floor", 0.6),
];
const ELSE: f64 = 0.3;
/// Where people are: m from the radar, rad off boresight, and how high it stands, m.
const DISTANCE_M: [f64; 2] = [1.5, 4.8];
const AZIMUTH_RAD: f64 = 0.8;
const HEIGHT_M: [f64; 2] = [0.8, 1.2];
/// By how much recorded bodies are made smaller or larger.
const SIZES: [f64; 2] = [0.9, 1.12];
/// Joints of a stretch, radar's frame, m.
pub(super) type Stretch = Vec<[Vec3; JOINTS]>;

/// What a lesson is about.
pub(super) struct Scene {
    pub(super) stretch: Stretch,
    /// The sample in the middle of its window.
    pub(super) middle: usize,
    /// Of the radar above the floor, m.
    pub(super) height_m: f64,
}

/// Motion to draw from.
#[derive(Debug)]
pub struct Actors {
    recorded: Vec<(Stretch, String)>,
    /// Chances of the recordings, summed up.
    chances: Vec<f64>,
    acted: Vec<Stretch>,
}

impl Actors {
    /// Recorded people, and acted stretches, each [`POSE_STRETCH`] poses of COCO's joints every 0.05 s before a radar that stands 1 m above
    /// the floor, m; `None` where no clip is long enough for a window, or a stretch has another length.
    pub fn new(clips: &[MotionClip], acted: Vec<Vec<[Vec3; JOINTS]>>) -> Option<Self> {
        let long = clips.iter().filter(|clip| clip.poses.len() > 2 * MARGIN + 8);
        let recorded: Vec<(Stretch, String)> = long
            .map(|clip| {
                let pose = |pose: &[Vec3; 20]| std::array::from_fn(|joint| pose[joint]);
                (clip.poses.iter().map(pose).collect(), clip.group.clone())
            })
            .collect();
        let samples = |group: &str| {
            recorded.iter().filter(|(_, of)| of == group).map(|(poses, _)| poses.len()).sum::<usize>().max(1) as f64
        };
        let weight = |group: &str| GROUPS.iter().find(|(name, _)| *name == group).map_or(ELSE, |(_, weight)| *weight);
        let mut sum = 0.0;
        let chances = recorded
            .iter()
            .map(|(poses, group)| {
                sum += poses.len() as f64 / samples(group) * weight(group);
                sum
            })
            .collect();
        let whole = acted.iter().all(|stretch| stretch.len() == POSE_STRETCH);
        (whole && !recorded.is_empty()).then_some(Self { recorded, chances, acted })
    }

    /// One, of the actors with this chance.
    pub(super) fn draw(&self, acted: f64, rng: &mut StdRng) -> Scene {
        let mut scene =
            if !self.acted.is_empty() && rng.random_bool(acted) { self.act(rng) } else { self.recorded(rng) };
        if rng.random_bool(0.5) {
            scene.stretch.iter_mut().for_each(mirror);
        }
        // Anybody looks anywhere: how likely that is, is not what maps say.
        let [x, y, _] = trunk(&scene.stretch[scene.middle]);
        shift(&mut scene.stretch, [-x, -y, 0.0]);
        turn(&mut scene.stretch, rng.random_range(-PI..PI));
        shift(&mut scene.stretch, [x, y, 0.0]);
        scene
    }

    fn act(&self, rng: &mut StdRng) -> Scene {
        let mut stretch = self.acted[rng.random_range(0..self.acted.len())].clone();
        let middle = rng.random_range(MARGIN..POSE_STRETCH - MARGIN);
        if rng.random_bool(0.5) {
            let at = trunk(&stretch[POSE_STRETCH / 2]);
            let (azimuth, distance) = place(rng);
            turn(&mut stretch, azimuth - at[1].atan2(at[0]));
            let farther = distance - at[0].hypot(at[1]);
            shift(&mut stretch, [farther * azimuth.cos(), farther * azimuth.sin(), 0.0]);
        }
        Scene { stretch, middle, height_m: 1.0 }
    }

    fn recorded(&self, rng: &mut StdRng) -> Scene {
        let last = self.chances.last().copied().unwrap_or(1.0);
        let drawn = rng.random_range(0.0..last);
        let (poses, _) = &self.recorded[self.chances.partition_point(|&chance| chance <= drawn)];
        let middle = POSE_STRETCH / 2;
        let at = rng.random_range(MARGIN..poses.len() - MARGIN);
        let sample = |k: usize| poses[(at + k).saturating_sub(middle).min(poses.len() - 1)];
        let mut stretch: Stretch = (0..POSE_STRETCH).map(sample).collect();
        let size = rng.random_range(SIZES[0]..SIZES[1]);
        stretch.as_flattened_mut().iter_mut().for_each(|p| *p = p.map(|x| size * x));
        let (azimuth, distance) = place(rng);
        let height_m = rng.random_range(HEIGHT_M[0]..HEIGHT_M[1]);
        let at = trunk(&stretch[middle]);
        shift(&mut stretch, [-at[0], -at[1], -height_m]);
        shift(&mut stretch, [distance * azimuth.cos(), distance * azimuth.sin(), 0.0]);
        Scene { stretch, middle, height_m }
    }
}

/// Azimuth, rad, and distance, m.
fn place(rng: &mut StdRng) -> (f64, f64) {
    (rng.random_range(-AZIMUTH_RAD..AZIMUTH_RAD), rng.random_range(DISTANCE_M[0]..DISTANCE_M[1]))
}

/// The middle of shoulders and hips.
pub(super) fn trunk(pose: &[Vec3; JOINTS]) -> Vec3 {
    crate::geometry::mean(&TRUNK.map(|joint| pose[joint]))
}

/// About the radar's vertical axis.
fn turn(stretch: &mut Stretch, by: f64) {
    let (sin, cos) = by.sin_cos();
    stretch.as_flattened_mut().iter_mut().for_each(|p| *p = [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1], p[2]]);
}

pub(super) fn shift(stretch: &mut [[Vec3; JOINTS]], by: Vec3) {
    stretch.as_flattened_mut().iter_mut().for_each(|p| *p = crate::geometry::add(*p, by));
}

/// Left and right exchanged.
fn mirror(pose: &mut [Vec3; JOINTS]) {
    *pose = MIRRORED.map(|joint| [pose[joint][0], -pose[joint][1], pose[joint][2]]);
}
