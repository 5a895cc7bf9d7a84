//! Starts around one: elsewhere on the floor, turned, in another posture. Each draws its own numbers from the seed and its own
//! number, so that it depends on no other.

use super::RestartSettings;
use crate::body::{Pppr, Skeleton};
use crate::explore::moves::{limb_of, move_person, turn_limb};
use crate::geometry::{Vec3, norm, scale};
use crate::mhp::Limb;
use rand::{Rng, SeedableRng, rngs::StdRng};
use rand_distr::StandardNormal;
use serde::Serialize;

/// The height is spread by this share of the place on the floor.
const HEIGHT_SHARE: f64 = 0.25;

/// How a start differs from the first; of several persons, that of the first one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct StartOffset {
    /// Moved by, m.
    pub by: Vec3,
    /// Turned to the left by, degrees.
    pub yaw_deg: f64,
    /// Root mean square of the limbs' turns, degrees.
    pub posture_deg: f64,
}

/// A number of a start by which basins may be told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StartFeature {
    /// Moved away from the radar, m.
    X,
    /// Moved to the left, m.
    Y,
    /// Moved up, m.
    Z,
    /// Turned to the left, degrees.
    Yaw,
    /// Turned, to whichever side, degrees.
    Turned,
    /// Limbs turned, degrees.
    Posture,
}

impl StartFeature {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Yaw, Self::Turned, Self::Posture];

    /// Of a start.
    pub fn of(self, offset: &StartOffset) -> f64 {
        match self {
            Self::X => offset.by[0],
            Self::Y => offset.by[1],
            Self::Z => offset.by[2],
            Self::Yaw => offset.yaw_deg,
            Self::Turned => offset.yaw_deg.abs(),
            Self::Posture => offset.posture_deg,
        }
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::X => "x of the start",
            Self::Y => "y of the start",
            Self::Z => "z of the start",
            Self::Yaw => "start turned left by",
            Self::Turned => "start turned by",
            Self::Posture => "limbs turned by",
        }
    }

    /// A value with its unit.
    pub fn text(self, value: f64) -> String {
        match self {
            Self::X | Self::Y | Self::Z => format!("{value:+.2} m"),
            Self::Yaw => format!("{value:+.0}°"),
            Self::Turned | Self::Posture => format!("{value:.0}°"),
        }
        .replace('-', "−")
    }
}

/// The start of this number; 0 is `base` itself.
pub(super) fn start(
    base: &Pppr,
    skeleton: &Skeleton,
    settings: &RestartSettings,
    number: usize,
) -> (StartOffset, Pppr) {
    let mut params = base.clone();
    if number == 0 {
        return (StartOffset::default(), params);
    }
    let mut rng = StdRng::seed_from_u64(settings.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(number as u64));
    let mut first = None;
    for person in 0..base.shape().persons {
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let floor = settings.position_m;
        let by = [normal() * floor, normal() * floor, normal() * floor * HEIGHT_SHARE];
        let yaw_deg = if settings.yaw_deg > 0.0 { rng.random_range(-settings.yaw_deg..=settings.yaw_deg) } else { 0.0 };
        let posture_deg = bend(&mut params, skeleton, person, settings.posture_deg, &mut rng);
        move_person(&mut params, skeleton, person, by, yaw_deg.to_radians());
        first.get_or_insert(StartOffset { by, yaw_deg, posture_deg });
    }
    (first.unwrap_or_default(), params)
}

/// Turns each limb of a person about a direction of its own; answers the root mean square of the turns.
fn bend(params: &mut Pppr, skeleton: &Skeleton, person: usize, sigma_deg: f64, rng: &mut StdRng) -> f64 {
    let joints = skeleton.joints.len();
    let mut limbs: Vec<(Limb, usize)> = Vec::new();
    for joint in 0..joints {
        if let Some(limb) = limb_of(params, skeleton, person * joints + joint).filter(|limb| !limbs.contains(limb)) {
            limbs.push(limb);
        }
    }
    // From the trunk outwards: an arm is lifted before its elbow bends.
    limbs.sort_by_key(|(limb, _)| (std::cmp::Reverse(limb.carried.len()), limb.outer));
    let mut squares = 0.0;
    for limb in &limbs {
        let angle = rng.sample::<f64, _>(StandardNormal) * sigma_deg;
        let axis = direction(rng);
        turn_limb(params, limb, axis, angle.to_radians());
        squares += angle * angle;
    }
    (squares / limbs.len().max(1) as f64).sqrt()
}

/// Evenly distributed over the sphere.
fn direction(rng: &mut StdRng) -> Vec3 {
    loop {
        let v: Vec3 = std::array::from_fn(|_| rng.sample(StandardNormal));
        let length = norm(v);
        if length > 1e-9 {
            return scale(v, 1.0 / length);
        }
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::body::{Group, PpprShape};
    use crate::geometry::sub;

    fn base() -> (Skeleton, Pppr) {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let mut params = Pppr::zeros(PpprShape { persons: 2, joints: 17, doppler_features: 1 });
        for joint in 0..34 {
            let place = [3.0 + 0.02 * joint as f64, 0.3 - 0.05 * (joint % 4) as f64, 1.7 - 0.1 * (joint % 17) as f64];
            params.set_vec3(Group::Position, joint, place);
            params.joint_mut(Group::Rotation, joint)[0] = 1.0;
        }
        (skeleton, params)
    }

    #[test]
    fn a_start_depends_on_seed_and_number_alone_and_keeps_its_bones() {
        let (skeleton, base) = base();
        let settings = RestartSettings::default();
        assert_eq!(start(&base, &skeleton, &settings, 0).1, base);
        let (offset, third) = start(&base, &skeleton, &settings, 3);
        assert_eq!(start(&base, &skeleton, &settings, 3), (offset, third.clone()));
        assert_ne!(start(&base, &skeleton, &RestartSettings { seed: 2, ..settings }, 3).1, third);
        let hinged = |bone: &&[usize; 2]| {
            [bone[0], bone[1]].iter().any(|&joint| Limb::of(&skeleton, joint).is_some_and(|limb| limb.outer == joint))
        };
        for person in 0..2 {
            for bone in skeleton.bones.iter().filter(hinged) {
                let length = |params: &Pppr| norm(sub(params.person(person)[bone[0]], params.person(person)[bone[1]]));
                assert!((length(&third) - length(&base)).abs() < 1e-9, "{bone:?}");
            }
        }
    }

    #[test]
    fn starts_are_spread_as_asked() {
        let (skeleton, base) = base();
        let settings =
            RestartSettings { position_m: 0.3, yaw_deg: 90.0, posture_deg: 12.0, ..RestartSettings::default() };
        let offsets: Vec<StartOffset> = (1..=400).map(|k| start(&base, &skeleton, &settings, k).0).collect();
        let rms =
            |of: &dyn Fn(&StartOffset) -> f64| (offsets.iter().map(|o| of(o).powi(2)).sum::<f64>() / 400.0).sqrt();
        assert!((rms(&|o| o.by[0]) - 0.3).abs() < 0.03 && (rms(&|o| o.by[2]) - 0.075).abs() < 0.01);
        assert!(
            offsets.iter().all(|o| o.yaw_deg.abs() <= 90.0) && (rms(&|o| o.yaw_deg) - 90.0 / 3f64.sqrt()).abs() < 4.0
        );
        assert!((rms(&|o| o.posture_deg) - 12.0).abs() < 1.0);
    }
}
