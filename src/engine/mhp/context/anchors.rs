//! Where the frames around say that each person is: what the temporal term pulls towards.

use super::middle::{apart_m, near};
use super::temporal::TemporalContext;
use super::track::{Sighting, track};
use crate::body::{Pppr, Skeleton};
use crate::config::{FitConfig, Height};
use crate::geometry::{Vec3, mean};
use crate::mhp::region::centres;
use crate::mhp::template::Template;
use crate::radar::RadarConfig;

/// Where a line through each person's places in this frame and those around says that the mean of its joints is, world
/// frame, m; a person whom no frame around shows stays where it is.
pub(in crate::mhp) fn anchors(
    context: &TemporalContext,
    (radar, skeleton): (&RadarConfig, &Skeleton),
    config: &FitConfig,
    params: &Pppr,
) -> Vec<Vec3> {
    let template = Template::new(skeleton);
    let middles = centres(params);
    let of_person = |person: usize| {
        let own = params.person(person);
        let middle = mean(own);
        let (lit, expected) = near(context.views(), &context.now, &middles, person);
        let here = Sighting { t_s: 0.0, at: lit, lit_m: expected.lit };
        let Some(track) = track(context, here, apart_m(&middles, person)) else { return middle };
        let at = if template.is_bent(own) { track.at } else { behind_skin(config, track.at) };
        // Where the floor is known, the start stands as high as it should.
        let floor = radar.height_m.filter(|_| config.height == Height::Floor);
        [at[0], at[1], floor.map_or(at[2] + template.mean_over_middle_m(), |_| middle[2])]
    };
    (0..middles.len()).map(of_person).collect()
}

/// Where the middle of a body is whose lit middle is `at`: the echoes come from the skin before it. Not so where somebody
/// sits, whose legs are lit before the trunk.
pub(in crate::mhp) fn behind_skin(config: &FitConfig, at: Vec3) -> Vec3 {
    let behind = 1.0 + config.surface_offset_m / at[0].hypot(at[1]).max(0.5);
    [at[0] * behind, at[1] * behind, at[2]]
}
