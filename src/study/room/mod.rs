//! Where a radar stands in the room whose frame a data set's joints are in: found from the joints and the maps.
//!
//! 1. Of every frame with one person, where there are enough of those in which somebody walks, the middle of the echo in the radar's
//!    frame ([`echo`]) and the middle of the joints in the room's.
//! 2. The rigid transform on which most frames agree: triples of frames drawn at random, then the frames that agree, weighted
//!    (Tukey), until nothing changes ([`rigid`]). It needs somebody who walked about: points on a line would leave a turn open.
//! 3. The transform with which the joints' bodies explain the maps of these frames best ([`refine`]): echoes come from the skin before
//!    the joints, which the middles do not know.
//!
//! Whoever stands on their head then stands in maps whose left and right are swapped, and it is said.

mod echo;
mod refine;
mod rigid;

use crate::dataset::{Dataset, RoomTransform};
use crate::geometry::{Pose, Vec3, mean, norm, sub};
use crate::mhp::FitError;
use crate::task::Progress;
use echo::EchoFinder;
use rayon::prelude::*;
use rigid::{Pair, consensus};
use std::ops::Range;

/// Frames that agree at least.
const FEWEST: usize = 12;
/// Middles of echoes and joints farther apart do not agree, m.
pub(crate) const AGREE_M: f64 = 0.35;

/// Why no transform is found.
#[derive(Debug, thiserror::Error)]
pub enum RoomError {
    /// The joints are in the radar's frame, or there are none.
    #[error("{name}: its joints are not in a room's frame; expected a data set such as HIBER, with 3DPOSE")]
    NoRoom {
        /// The data set.
        name: String,
    },
    /// No frame of that environment.
    #[error("no frames of environment \"{environment}\"; expected one of {known}")]
    NoEnvironment {
        /// As asked for.
        environment: String,
        /// Those that there are.
        known: String,
    },
    /// Too few frames can be used.
    #[error(
        "environment {environment}: {usable} of {looked} frames show one person with joints and an echo in every map; expected at least \
         {FEWEST}"
    )]
    TooFew {
        /// The environment.
        environment: String,
        /// Frames that can be used.
        usable: usize,
        /// Frames that were looked at.
        looked: usize,
    },
    /// Nothing agrees.
    #[error(
        "environment {environment}: no rigid transform brings the joints of more than {agree} of {usable} frames to their echoes; expected \
         people who walk about, and joints of these maps"
    )]
    NoAgreement {
        /// The environment.
        environment: String,
        /// Frames that agree at most.
        agree: usize,
        /// Frames that can be used.
        usable: usize,
    },
    /// A frame is no problem for a fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Somebody pressed cancel.
    #[error("cancelled")]
    Cancelled,
}

impl From<crate::task::Cancelled> for RoomError {
    fn from(_: crate::task::Cancelled) -> Self {
        Self::Cancelled
    }
}

/// What was found of an environment.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomEstimate {
    /// The transform, with its residual and the frames that agree.
    pub transform: RoomTransform,
    /// Frames that could be used.
    pub usable: usize,
    /// How well the bodies explain the maps: the mean soft IoU of the bright cells, 0 to 1.
    pub overlap: f64,
    /// By how much the refinement moved and turned the transform of the middles, m and rad.
    pub refined_by: [f64; 2],
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// The environments of a data set with the frames of each, in the order of their names.
///
/// # Errors
/// Where its joints are not in a room's frame.
pub fn environments(dataset: &Dataset) -> Result<Vec<(String, Vec<usize>)>, RoomError> {
    let rooms = dataset.room_joints().ok_or_else(|| RoomError::NoRoom { name: dataset.info().name.clone() })?;
    let mut all: std::collections::BTreeMap<String, Vec<usize>> = std::collections::BTreeMap::new();
    for i in 0..dataset.len() {
        if let Some(environment) = rooms.environment(i) {
            all.entry(environment.to_owned()).or_default().push(i);
        }
    }
    Ok(all.into_iter().collect())
}

/// Finds where the radar of an environment is, from at most `most` of its frames, evenly taken.
///
/// # Errors
/// As told; never for a frame that cannot be read, which is left out.
pub fn estimate_room(
    dataset: &Dataset,
    environment: &str,
    most: usize,
    progress: &Progress,
) -> Result<RoomEstimate, RoomError> {
    let all = environments(dataset)?;
    let Some((_, frames)) = all.iter().find(|(name, _)| name == environment) else {
        let known = all.into_iter().map(|(name, _)| name).collect::<Vec<_>>().join(", ");
        return Err(RoomError::NoEnvironment { environment: environment.to_owned(), known });
    };
    let chosen = walking_frames(dataset, frames, most.max(1));
    progress.begin("looking at frames", chosen.len() as u64);
    let finder = EchoFinder::new(&dataset.info().views);
    let seen: Vec<Option<Seen>> = chosen
        .par_iter()
        .map(|&index| {
            progress.check()?;
            let seen = look(dataset, &finder, index);
            progress.advance(1);
            Ok(seen)
        })
        .collect::<Result<_, RoomError>>()?;
    let seen: Vec<Seen> = seen.into_iter().flatten().collect();
    let (usable, looked) = (seen.len(), chosen.len());
    if usable < FEWEST {
        return Err(RoomError::TooFew { environment: environment.to_owned(), usable, looked });
    }
    let pairs: Vec<Pair> = seen.iter().map(|seen| Pair { room: mean(&seen.joints), radar: seen.echo }).collect();
    let coarse = consensus(&pairs, AGREE_M);
    let agreeing: Vec<usize> = coarse.as_ref().map(|found| found.agreeing.clone()).unwrap_or_default();
    let Some(coarse) = coarse.filter(|_| agreeing.len() >= FEWEST.max(usable / 4)) else {
        let (environment, agree) = (environment.to_owned(), agreeing.len());
        return Err(RoomError::NoAgreement { environment, agree, usable });
    };
    let used: Vec<&Seen> = agreeing.iter().filter_map(|&k| seen.get(k)).collect();
    let fine = refine::refine(dataset, &used, coarse.pose, progress)?;
    let apart: Vec<f64> =
        pairs.iter().map(|pair| norm(sub(fine.pose.view_from_world(pair.room), pair.radar))).collect();
    let agree: Vec<f64> = apart.into_iter().filter(|apart| *apart <= AGREE_M).collect();
    let square = agree.iter().map(|x| x * x).sum::<f64>() / agree.len().max(1) as f64;
    let transform = RoomTransform {
        environment: environment.to_owned(),
        radar_from_room: fine.pose,
        residual_m: Some(square.sqrt()),
        frames: Some([agree.len(), looked]),
    };
    let middle = mean(&used.iter().map(|seen| mean(&seen.joints)).collect::<Vec<_>>());
    let moved = norm(sub(fine.pose.view_from_world(middle), coarse.pose.view_from_world(middle)));
    Ok(RoomEstimate {
        usable,
        overlap: fine.overlap,
        refined_by: [moved, rigid::angle_between(&fine.pose, &coarse.pose)],
        warnings: warnings(dataset, &used, &fine.pose),
        transform,
    })
}

/// A frame that can be used.
pub(crate) struct Seen {
    pub(crate) index: usize,
    /// The person's joints, room frame, m.
    pub(crate) joints: Vec<Vec3>,
    /// Their velocities, room frame, m/s; none where the frames around do not tell them.
    pub(crate) velocities: Option<Vec<Vec3>>,
    /// The middle of the echo, radar frame, m.
    pub(crate) echo: Vec3,
}

fn look(dataset: &Dataset, finder: &EchoFinder, index: usize) -> Option<Seen> {
    let persons =
        dataset.room_joints()?.joints(index).inspect_err(|error| tracing::debug!("not used: {error}")).ok()?;
    let [joints] = <[Vec<Vec3>; 1]>::try_from(persons).ok()?;
    let velocities = velocities(dataset, index, &joints);
    let maps = dataset.maps(index..index + 1).next()?;
    let maps = maps.inspect_err(|error| tracing::debug!("not used: {error}")).ok()?;
    let echo = finder.find(&maps)?;
    Some(Seen { index, joints, velocities, echo })
}

/// Frames whose joints are looked at for each that is used.
const LOOK_AT: usize = 5;
/// Who moves as fast as this walks, m/s.
const WALKS_MPS: f64 = 0.3;
/// Faster than this no joint is: who is in the frames around is somebody else, m/s.
const FASTEST_MPS: f64 = 8.0;

/// Half the way from the frame before to the frame after, or all of that to the only one of them.
fn velocities(dataset: &Dataset, index: usize, joints: &[Vec3]) -> Option<Vec<Vec3>> {
    let rate_hz = dataset.info().frame_rate_hz?;
    let rooms = dataset.room_joints()?;
    let of = |other: usize| {
        let same = other < dataset.len() && dataset.sequence(other) == dataset.sequence(index);
        let persons = if same { rooms.joints(other).ok()? } else { return None };
        let [there] = <[Vec<Vec3>; 1]>::try_from(persons).ok()?;
        let near = joints.iter().zip(&there).all(|(a, b)| norm(sub(*a, *b)) * rate_hz < FASTEST_MPS);
        (near && there.len() == joints.len()).then_some(there)
    };
    let (before, after) = (index.checked_sub(1).and_then(of), of(index + 1));
    let (from, to, frames) = match (&before, &after) {
        (Some(before), Some(after)) => (&before[..], &after[..], 2.0),
        (Some(before), None) => (&before[..], joints, 1.0),
        (None, Some(after)) => (joints, &after[..], 1.0),
        (None, None) => return None,
    };
    Some(from.iter().zip(to).map(|(a, b)| sub(*b, *a).map(|x| x * rate_hz / frames)).collect())
}

/// At most `most` of them, evenly; where there are as many, of those in which somebody walks: what stands still has often been taken
/// from the maps, and tells the place of one spot alone.
fn walking_frames(dataset: &Dataset, frames: &[usize], most: usize) -> Vec<usize> {
    let walks = |index: usize| {
        let [joints] = <[Vec<Vec3>; 1]>::try_from(dataset.room_joints()?.joints(index).ok()?).ok()?;
        let velocities = velocities(dataset, index, &joints)?;
        (norm(mean(&velocities)) >= WALKS_MPS).then_some(index)
    };
    let looked = evenly(frames, LOOK_AT * most);
    let walking: Vec<usize> = looked.par_iter().filter_map(|&index| walks(index)).collect();
    evenly(if walking.len() >= most { &walking } else { frames }, most)
}

/// At most `most` of them, evenly.
fn evenly(frames: &[usize], most: usize) -> Vec<usize> {
    let count = frames.len().min(most);
    let at = |k: usize| frames.get(k * frames.len() / count.max(1)).copied();
    Range { start: 0, end: count }.filter_map(at).collect()
}

fn warnings(dataset: &Dataset, used: &[&Seen], pose: &Pose) -> Vec<String> {
    let skeleton = &dataset.info().skeleton;
    let height = |words: &[&str]| {
        let joints: Vec<usize> =
            (0..skeleton.joints.len()).filter(|&joint| crate::body::is_named(skeleton, joint, words)).collect();
        let points = used.iter().flat_map(|seen| joints.iter().filter_map(|&joint| seen.joints.get(joint)));
        let points: Vec<Vec3> = points.map(|&joint| pose.view_from_world(joint)).collect();
        mean(&points)[2]
    };
    let on_their_heads = height(&["nose", "head", "neck"]) < height(&["ankle"]);
    let told = "people stand on their heads in the radar's frame: the maps' left and right are swapped, or up and down";
    on_their_heads.then(|| told.to_owned()).into_iter().collect()
}
