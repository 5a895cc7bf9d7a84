//! Where a network expects the joints of a person, from the maps of half a second at once: amortised inference.
//!
//! A fit asks which body explains the maps, and several do. A network that has seen many bodies before many radars tells which of them
//! it usually was. It looks at levels over range and angle about a place ([`glimpse`]), each view's at five times and what stands
//! there, and says of four bodies how likely each is, and of each joint where it is and how far off that may be ([`layers`]):
//!
//! ```text
//! p(x) = Σ over bodies k of π_k (Π over joints j of e^(−|x_j − μ_kj|/b_kj)/b_kj³)^0.3
//! L_net = −ln(p(x)/p(μ))/(0.3 J)
//! ```
//!
//! with |·| rounded off where it is smaller than b, and p(μ) what the bodies themselves have. The power is what joints know of each
//! other. It is asked of what is seen and of that in a mirror (`Seen::mirrored`), and what it says there is turned back: an ensemble of
//! two by one set of weights, whose errors are not the same. Of several people it is asked of each, and bodies whose trunks are
//! nearer to another one are left out. It was taught (`train-pose-network`) with recorded people and the actors
//! of the synthetic source, turned every way, before radars whose widths, sidelobes, noise, clutter and ghosts are drawn anew for each
//! lesson: neither simulator that it is judged by is among them. It says nothing of which way people usually look: that is the prior's
//! and the path's affair.

mod glimpse;
mod layers;
#[cfg(test)]
mod tests;
#[cfg(feature = "train")]
mod train;

#[cfg(feature = "train")]
pub use train::{Actors, POSE_STRETCH, PoseTrainOptions, pose_network_reach, train_pose_network};

use super::Problem;
use crate::body::{COCO_JOINTS, Group, Pppr};
use crate::config::FitConfig;
use crate::geometry::{Vec3, add_scaled, flat_distance, mean, norm, sub};
use glimpse::{Glimpse, Seen};
use layers::{BODIES, JOINTS, Layers, OUT};
use smallvec::SmallVec;
use std::iter::zip;
use std::sync::OnceLock;

/// Shoulders and hips: what it looks about.
const TRUNK: [usize; 4] = [5, 6, 11, 12];
/// What the joints of a body say counts as much as that of so many that know nothing of each other, of one.
const APART: f64 = 0.3;
/// How often it looks, each time about where it expected the trunk before, if that is farther away than this, m.
const LOOKS: usize = 2;
const NEAR_M: f64 = 0.05;
/// A body that is less likely is no start, and there are so many starts at most.
const LEAST: f64 = 0.05;
const MOST: usize = 4;
/// How often a look is asked of: as it is, and in a mirror.
const SIDES: usize = 2;
/// Joint of the other side.
const MIRRORED: [usize; JOINTS] = [0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 16, 15];

/// The network: weights that `train-pose-network` makes (Bishop 1994 names what it is).
#[derive(Debug, Clone)]
pub struct MixtureDensityNetwork(Layers);

/// Where the joints of a person are expected.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expected {
    bodies: SmallVec<[ExpectedBody; SIDES * BODIES]>,
    /// −ln of what the bodies themselves have.
    best: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct ExpectedBody {
    /// ln π.
    ln_chance: f64,
    /// μ, world frame, m, and b, m, of each joint of the skeleton that the network knows.
    joints: Vec<Option<(Vec3, f64)>>,
    /// Σ 3 ln b over them.
    narrowness: f64,
}

/// ln of how likely each body is, and of each joint where it is and how far off, m.
type Bodies = SmallVec<[(f64, [(Vec3, f64); JOINTS]); SIDES * BODIES]>;

impl MixtureDensityNetwork {
    /// The network that comes with the program; `None` where it is damaged.
    fn committed() -> Option<&'static Self> {
        static READ: OnceLock<Option<MixtureDensityNetwork>> = OnceLock::new();
        let read = || MixtureDensityNetwork::from_bytes(include_bytes!("../../../../assets/pose-network.safetensors"));
        let told = |error: &String| tracing::error!("assets/pose-network.safetensors: {error}");
        READ.get_or_init(|| read().inspect_err(told).ok()).as_ref()
    }

    /// Reads a network.
    ///
    /// # Errors
    /// Names the tensor that is missing, or has another type or size.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        Layers::from_tensors(bytes).map(Self)
    }

    /// As a safetensors file, with what is told of it.
    ///
    /// # Errors
    /// Where it cannot be written, in words.
    #[cfg(feature = "train")]
    pub fn to_bytes(&self, told: std::collections::HashMap<String, String>) -> Result<Vec<u8>, String> {
        self.0.to_tensors(told)
    }

    /// What it says of what is seen: ln of the chance of each body, and μ (along the sight, to its left, and up from the radar, from the
    /// place, m) and b of its joints.
    fn said(&self, seen: &Seen) -> Bodies {
        let said: Vec<f64> = self.0.run(seen).into_iter().map(f64::from).collect();
        let (chances, joints) = said.split_at(BODIES);
        let whole = ln_sum_exp(chances.iter().copied());
        let joint = |of: &[f64]| ([of[0], of[1], of[2]], of[3].exp());
        let body = |of: &[f64]| std::array::from_fn(|k| joint(&of[k * OUT..(k + 1) * OUT]));
        zip(chances, joints.chunks_exact(JOINTS * OUT)).map(|(chance, of)| (chance - whole, body(of))).collect()
    }

    /// What it says of that in a mirror, turned back.
    fn said_mirrored(&self, seen: &Seen) -> Bodies {
        let turned_back = |(ln_chance, joints): (f64, [(Vec3, f64); JOINTS])| {
            let joint = |joint: usize| {
                let ([along, left, up], b) = joints[joint];
                ([along, -left, up], b)
            };
            (ln_chance, MIRRORED.map(joint))
        };
        self.said(&seen.mirrored()).into_iter().map(turned_back).collect()
    }
}

/// ln Σ eˣ
fn ln_sum_exp(of: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = of.clone().fold(f64::NEG_INFINITY, f64::max);
    most + of.map(|x| (x - most).exp()).sum::<f64>().ln()
}

/// Whether a trunk is as near the place of this person as that of any other, over the floor.
fn belongs(trunk: Vec3, places: &[Vec3], person: usize) -> bool {
    let off = |place: &Vec3| flat_distance(*place, trunk);
    places.get(person).is_some_and(|own| places.iter().all(|other| off(own) <= off(other)))
}

impl Expected {
    /// The person about one of `places`, world frame, m, where several may be; `None` where no view has a range and an angle, no joint is
    /// known, or whoever is expected is most likely another of them: it knows one from those beside by nothing but where they are.
    pub(super) fn about(problem: &Problem, config: &FitConfig, places: &[Vec3], person: usize) -> Option<Self> {
        let network = MixtureDensityNetwork::committed()?;
        let known: Vec<Option<usize>> =
            problem.skeleton.joints.iter().map(|name| COCO_JOINTS.iter().position(|known| known == name)).collect();
        if known.iter().flatten().count() == 0 {
            return None;
        }
        let place = *places.get(person)?;
        let trunk = |glimpse: &Glimpse, joints: &[(Vec3, f64); JOINTS]| {
            glimpse.world(mean(&TRUNK.map(|joint| joints[joint].0)))
        };
        let own = |trunk: Vec3| belongs(trunk, places, person);
        let mut glimpse = Glimpse::at(problem, config, place)?;
        let mut said = network.said(&glimpse.seen);
        for _ in 1..LOOKS {
            let trunks = said.iter().map(|(ln_chance, joints)| (ln_chance, trunk(&glimpse, joints)));
            let likeliest = trunks.filter(|(_, trunk)| own(*trunk)).max_by(|a, b| a.0.total_cmp(b.0));
            let Some(there) = likeliest.map(|(_, [x, y, _])| [x, y, place[2]]) else { break };
            if flat_distance(there, glimpse.place) <= NEAR_M {
                break;
            }
            glimpse = Glimpse::at(problem, config, there)?;
            said = network.said(&glimpse.seen);
        }
        said.extend(network.said_mirrored(&glimpse.seen));
        said.retain(|(_, joints)| own(trunk(&glimpse, joints)));
        let whole = ln_sum_exp(said.iter().map(|(ln_chance, _)| *ln_chance));
        if whole - (SIDES as f64).ln() < LEAST.ln() {
            return None;
        }
        let body = |(ln_chance, joints): &(f64, [(Vec3, f64); JOINTS])| {
            let joint = |k: usize| (glimpse.world(joints[k].0), joints[k].1);
            let joints = known.iter().map(|known| known.map(joint)).collect();
            ExpectedBody::new(ln_chance - whole, joints)
        };
        let bodies: SmallVec<_> = said.iter().map(body).collect();
        let best = -ln_sum_exp(bodies.iter().map(|body: &ExpectedBody| body.ln_chance - APART * body.narrowness));
        best.is_finite().then_some(Self { bodies, best })
    }

    /// The joints of the likeliest bodies that are not unlikely, put where those of a person are, each with ln of its chance.
    pub(super) fn starts(&self, person: usize, params: &Pppr) -> impl Iterator<Item = (f64, Pppr)> {
        let joints = params.shape().joints;
        let mut likely: SmallVec<[&ExpectedBody; SIDES * BODIES]> =
            self.bodies.iter().filter(|body| body.ln_chance > LEAST.ln()).collect();
        likely.sort_by(|a, b| b.ln_chance.total_cmp(&a.ln_chance));
        likely.into_iter().take(MOST).map(move |body| {
            let mut start = params.clone();
            for (k, expected) in body.joints.iter().enumerate() {
                if let Some((at, _)) = expected {
                    start.set_vec3(Group::Position, person * joints + k, *at);
                }
            }
            (body.ln_chance, start)
        })
    }

    /// L_net of a person's joints; `gain` times its gradient is added to `bars`.
    pub(super) fn misfit(&self, joints: &[Vec3], gain: f64, bars: &mut [Vec3]) -> f64 {
        let likely: SmallVec<[f64; SIDES * BODIES]> = self.bodies.iter().map(|body| body.likely(joints)).collect();
        let all = ln_sum_exp(likely.iter().copied());
        let known = self.bodies.first().map_or(1.0, |body| body.joints.iter().flatten().count() as f64);
        for (body, likely) in zip(&self.bodies, likely) {
            let share = gain * (likely - all).exp() / known;
            for ((at, bar), expected) in zip(zip(joints, &mut *bars), &body.joints) {
                let Some((mean, b)) = expected else { continue };
                let way = sub(*at, *mean);
                add_scaled(bar, way, share / (b * b * rounded(norm(way) / b)));
            }
        }
        (-all - self.best) / (APART * known)
    }
}

/// √(1 + u²)
fn rounded(u: f64) -> f64 {
    (1.0 + u * u).sqrt()
}

impl ExpectedBody {
    fn new(ln_chance: f64, joints: Vec<Option<(Vec3, f64)>>) -> Self {
        let narrowness = joints.iter().flatten().map(|(_, b)| 3.0 * b.ln()).sum();
        Self { ln_chance, joints, narrowness }
    }

    /// ln of π times how likely joints are.
    fn likely(&self, joints: &[Vec3]) -> f64 {
        let of = |(at, expected): (&Vec3, &Option<(Vec3, f64)>)| {
            expected.map_or(0.0, |(mean, b)| rounded(norm(sub(*at, mean)) / b) - 1.0)
        };
        self.ln_chance - APART * (self.narrowness + zip(joints, &self.joints).map(of).sum::<f64>())
    }
}
