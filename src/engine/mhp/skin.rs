//! The skin that faces the radar: points on trunk, limbs, head and feet, from the Gaussians of the joints and back.
//!
//! PPPR stays the representation, a Gaussian a joint. But a radar sees no joints: its echo comes from the side of the body that
//! faces it, in the middle of limbs as much as at their ends. With `body = "skin"` the forward model's Gaussians are
//!
//! ```text
//! limb    p = J_a (1 − u) + J_b u on the bone, e along it, k the line of sight to p, n = k − (k·e) e, s = √(n² + 10⁻⁴):
//!         point p − 0.8 r n/s, area 2 r l/N (s² + 0.02)          the cylinder's side that is seen, shadowed where seen end-on
//! trunk   p between shoulders and hips, f its normal, c = k·f:
//!         point p − 0.1 m tanh(c/0.15) f, area ∝ c² + 0.03       front or back, whichever is seen
//! head    point 0.08 m before its middle
//! foot    point 0.07 m before the ankle, along f
//! ```
//!
//! each round, its amplitude the root of its area; `surface_offset_m` moves no point, for it lies on the skin. The joints' own opacities and scales, by those that their part of the body has
//! at the start (`body::scatterer`), make the points between them brighter and larger, at most four times (and dimmer as far as they are); their rotations say
//! nothing. Velocities and Doppler features are those between the joints. The line of sight is that of the radar, the mean of the
//! views' places.

mod look;

use super::Precision;
use super::batch::each_joint;
use crate::body::{Group, HEAD, PARTS, Parts, Pppr, PpprShape, Skeleton, scatterer};
use crate::geometry::{Vec3, add, add_scaled, cross, dot, norm, scale, sub};
use look::{Brighten, TakeIn};
use smallvec::SmallVec;

/// Limbs by their parts: upper arms, forearms, thighs, shanks, left and right; radius and length, m.
const LIMBS: [([usize; 2], f64, f64); 8] = [
    ([1, 3], 0.050, 0.29),
    ([3, 5], 0.040, 0.25),
    ([2, 4], 0.050, 0.29),
    ([4, 6], 0.040, 0.25),
    ([7, 9], 0.075, 0.42),
    ([9, 11], 0.055, 0.42),
    ([8, 10], 0.075, 0.42),
    ([10, 12], 0.055, 0.42),
];
/// Ankles, and how far before them the middle of a foot is, m: what tells a front from a back.
const FEET: [usize; 2] = [11, 12];
const FOOT_AHEAD_M: f64 = 0.07;
/// How many points stand for a body.
#[derive(Debug, Clone, Copy)]
struct Grain {
    /// Of a limb, and of the trunk from shoulders to hips and from left to right.
    on_limb: usize,
    down: &'static [f64],
    across: &'static [f64],
    /// Standard deviation of those of the trunk, m.
    trunk_scale_m: f64,
}

const FINE: Grain =
    Grain { on_limb: 3, down: &[0.125, 0.375, 0.625, 0.875], across: &[0.15, 0.5, 0.85], trunk_scale_m: 0.03 };
const COARSE: Grain = Grain { on_limb: 1, down: &[0.25, 0.75], across: &[0.2, 0.8], trunk_scale_m: 0.052 };
/// Left and right shoulder and hip.
const CORNERS: [usize; 4] = [1, 2, 7, 8];
/// How far out a limb's skin lies, of its radius; the trunk's and the head's, m.
const OUT: f64 = 0.8;
const TRUNK_OUT_M: f64 = 0.10;
const HEAD_OUT_M: f64 = 0.08;
/// The cosine at which the trunk is seen from the side.
const TRUNK_EDGE: f64 = 0.15;
/// What is seen of a limb end-on and of the trunk from the side, of its area.
const LIMB_END: f64 = 0.02;
const TRUNK_SIDE: f64 = 0.03;
/// Standard deviations, m, areas, m², and a limb's standard deviation by the length of its share.
const TRUNK_AREA_M2: f64 = 0.35 * 0.5;
const HEAD_SCALE_M: f64 = 0.036;
const HEAD_AREA_M2: f64 = 0.035;
const FOOT_SCALE_M: f64 = 0.04;
const FOOT_AREA_M2: f64 = 0.012;
const LIMB_SCALE: f64 = 0.3;
/// ln of how much brighter and larger than at the start a point may be, and how much smaller; it may be as dim as the removal of
/// static echoes leaves it.
const MOST_LN: f64 = 1.386_294_361_119_890_6;
const LEAST_LN_ALPHA: f64 = -5.0;
/// No point is more opaque.
const MOST_ALPHA: f64 = 0.999;
/// α and standard deviation, m, of a joint of which nothing is known.
const PLAIN: [f64; 2] = [0.5, 0.08];

/// What a point is made of: parts with their shares.
type Shares = SmallVec<[(usize, f64); 4]>;

/// Where a point lies on its part, and what of it the radar sees.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// The limb with these ends and this radius.
    Limb {
        ends: [usize; 2],
        radius_m: f64,
    },
    Trunk,
    Head,
    Foot,
}

#[derive(Debug, Clone)]
struct Point {
    kind: Kind,
    shares: Shares,
    /// The same of the skeleton's joints.
    joints: Shares,
    /// ln of its standard deviation, m.
    ln_scale: f64,
    /// Its amplitude but for what is seen of it.
    amplitude: f64,
}

/// ln of how much brighter and larger a joint or point is than at the start, how opaque it is, and ω̄.
#[derive(Debug, Clone, Copy, Default)]
struct Look {
    ln_alpha: f64,
    ln_scale: f64,
    opacity: f64,
    omega_mean: f64,
}

/// A point as the radar sees it.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// On the bone, from the radar, m.
    place: Vec3,
    /// Where the skin is, as the former.
    at: Vec3,
    /// The share of its area that is seen, and how that comes about.
    share: f64,
    facing: Facing,
}

/// What of a point's side decides where it is seen.
#[derive(Debug, Clone, Copy)]
enum Facing {
    /// The side of the limb with these ends and this radius.
    Limb {
        ends: [usize; 2],
        radius_m: f64,
        side: Side,
    },
    /// The line of sight, its cosine with the trunk's normal, and how far out along that.
    Trunk {
        sight: (Vec3, f64),
        cosine: f64,
        out: f64,
    },
    /// The line of sight.
    Head((Vec3, f64)),
    Foot,
}

/// The skin of a skeleton, and its Gaussians in the last evaluation.
#[derive(Debug, Clone)]
pub(super) struct Skin {
    parts: Parts,
    body: Vec<Point>,
    /// ln α and the mean ln scale of each joint at the start.
    plain: Vec<[f64; 2]>,
    /// What each joint of the last evaluation adds to its points.
    looks: Vec<Look>,
    /// The points of the last evaluation.
    seen: Vec<(Seen, Look)>,
    /// Where the radar is, world frame, m.
    radar: Vec3,
    /// The Gaussians, those of a person after the other, as the forward model takes them.
    pub(super) points: Pppr,
    /// The gradient with respect to them, to be filled in.
    pub(super) gradient: Pppr,
}

/// A vector and its length with a floor under it.
fn unit(v: Vec3, floor_sq: f64) -> (Vec3, f64) {
    let length = (dot(v, v) + floor_sq).sqrt();
    (scale(v, 1.0 / length), length)
}

/// ∂L/∂v of that unit vector's adjoint.
fn unit_back(v: Vec3, length: f64, bar: Vec3) -> Vec3 {
    let mut back = scale(bar, 1.0 / length);
    add_scaled(&mut back, v, -dot(v, bar) / (length * length * length));
    back
}

/// The trunk's normal, forward, and what its derivative needs.
struct Normal {
    across: Vec3,
    left: (Vec3, f64),
    up: Vec3,
    forward: Vec3,
    front: (Vec3, f64),
}

impl Normal {
    fn of(places: &[Vec3; PARTS]) -> Self {
        let [ls, rs, lh, rh] = CORNERS.map(|part| places[part]);
        let across = sub(ls, rs);
        let left = unit(across, 1e-6);
        let up = sub(add(ls, rs), add(lh, rh));
        let forward = cross(left.0, up);
        Self { across, left, up, forward, front: unit(forward, 1e-6) }
    }

    fn pull_back(&self, bar: Vec3, places_bar: &mut [Vec3; PARTS]) {
        let forward_bar = unit_back(self.forward, self.front.1, bar);
        let left_bar = cross(self.up, forward_bar);
        let up_bar = cross(forward_bar, self.left.0);
        let across_bar = unit_back(self.across, self.left.1, left_bar);
        for (part, sign) in CORNERS.into_iter().zip([[1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [0.0, -1.0]]) {
            add_scaled(&mut places_bar[part], across_bar, sign[0]);
            add_scaled(&mut places_bar[part], up_bar, sign[1]);
        }
    }
}

/// A limb's side as it is seen from the radar.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// The direction along the limb and its length.
    along: Vec3,
    axis: (Vec3, f64),
    /// The line of sight and how far away the point is.
    sight: (Vec3, f64),
    /// Its part across the limb, and the sine between them.
    outwards: Vec3,
    sine: f64,
}

impl Side {
    fn of(place: Vec3, along: Vec3) -> Self {
        let (axis, sight) = (unit(along, 1e-6), unit(place, 1e-12));
        let mut outwards = sight.0;
        add_scaled(&mut outwards, axis.0, -dot(sight.0, axis.0));
        Self { along, axis, sight, outwards, sine: (dot(outwards, outwards) + 1e-4).sqrt() }
    }
}

impl Skin {
    /// Of a skeleton seen by `radar` (world frame, m); `features` Doppler features a point. `None` where a part of the body has
    /// no joint.
    pub(super) fn new(skeleton: &Skeleton, radar: Vec3, features: usize) -> Option<Self> {
        Self::of_grain(skeleton, radar, features, FINE)
    }

    /// The same of few points: as many as tell one start from another.
    pub(super) fn coarse(&self, skeleton: &Skeleton) -> Option<Self> {
        Self::of_grain(skeleton, self.radar, self.points.shape().doppler_features, COARSE)
    }

    fn of_grain(skeleton: &Skeleton, radar: Vec3, features: usize, grain: Grain) -> Option<Self> {
        let parts = Parts::of(skeleton)?;
        let Grain { on_limb, down, across, trunk_scale_m } = grain;
        let mut body = Vec::new();
        for (ends, radius_m, length_m) in LIMBS {
            let share_m = length_m / on_limb as f64;
            for k in 0..on_limb {
                let u = (k as f64 + 0.5) / on_limb as f64;
                body.push(Point {
                    kind: Kind::Limb { ends, radius_m },
                    shares: [(ends[0], 1.0 - u), (ends[1], u)].into_iter().collect(),
                    joints: Shares::new(),
                    ln_scale: (LIMB_SCALE * share_m).ln(),
                    amplitude: (2.0 * radius_m * share_m).sqrt(),
                });
            }
        }
        let on_trunk = (down.len() * across.len()) as f64;
        for &down in down {
            for &across in across {
                let shares =
                    [(1.0 - across) * (1.0 - down), across * (1.0 - down), (1.0 - across) * down, across * down];
                body.push(Point {
                    kind: Kind::Trunk,
                    shares: CORNERS.into_iter().zip(shares).collect(),
                    joints: Shares::new(),
                    ln_scale: trunk_scale_m.ln(),
                    amplitude: (TRUNK_AREA_M2 / on_trunk * 2.0).sqrt(),
                });
            }
        }
        body.push(Point {
            kind: Kind::Head,
            shares: [(HEAD, 1.0)].into_iter().collect(),
            joints: Shares::new(),
            ln_scale: HEAD_SCALE_M.ln(),
            amplitude: HEAD_AREA_M2.sqrt(),
        });
        for ankle in FEET {
            body.push(Point {
                kind: Kind::Foot,
                shares: [(ankle, 1.0)].into_iter().collect(),
                joints: Shares::new(),
                ln_scale: FOOT_SCALE_M.ln(),
                amplitude: FOOT_AREA_M2.sqrt(),
            });
        }
        for point in &mut body {
            let of_part = |&(part, share): &(usize, f64)| {
                let joints = parts.joints_of(part);
                joints.iter().map(move |&joint| (joint, share / joints.len() as f64))
            };
            point.joints = point.shares.iter().flat_map(of_part).collect();
        }
        let plain = skeleton.joints.iter().map(|name| match scatterer(name) {
            Some(part) => [part.alpha.ln(), (part.along_m.ln() + 2.0 * part.across_m.ln()) / 3.0],
            None => PLAIN.map(f64::ln),
        });
        let empty = Pppr::zeros(PpprShape { persons: 0, joints: body.len(), doppler_features: features });
        Some(Self {
            parts,
            body,
            plain: plain.collect(),
            looks: Vec::new(),
            seen: Vec::new(),
            radar,
            points: empty.clone(),
            gradient: empty,
        })
    }

    /// The skeleton's joints that each point of a person belongs to, with its shares.
    pub(super) fn owners(&self) -> impl Iterator<Item = &[(usize, f64)]> {
        self.body.iter().map(|point| point.joints.as_slice())
    }

    /// Fills in the points of all persons of `params`.
    pub(super) fn fill(&mut self, params: &Pppr, precision: Precision) {
        let shape = params.shape();
        let features = self.points.shape().doppler_features;
        let points = self.body.len();
        self.points.reset(PpprShape { persons: shape.persons, joints: points, doppler_features: features });
        self.look(params, precision);
        self.seen.clear();
        for person in 0..shape.persons {
            let places = self.places(params.person(person));
            let normal = Normal::of(&places);
            let first = person * shape.joints;
            for (k, of) in self.body.iter().enumerate() {
                let joint = person * points + k;
                let mut place = [0.0; 3];
                of.shares.iter().for_each(|&(part, share)| add_scaled(&mut place, places[part], share));
                let seen = of.seen(place, &places, &normal);
                // Its amplitude at the start, until all are as bright as they look.
                let mut look = Look { opacity: of.amplitude * seen.share.sqrt(), ..Look::default() };
                let mut velocity = [0.0; 3];
                for &(own, share) in &of.joints {
                    let of_joint = &self.looks[first + own];
                    look.ln_alpha += share * of_joint.ln_alpha;
                    look.ln_scale += share * of_joint.ln_scale;
                    look.omega_mean += share * of_joint.omega_mean;
                    add_scaled(&mut velocity, params.velocity(first + own), share);
                }
                let ln_scale = of.ln_scale + look.ln_scale.clamp(-MOST_LN, MOST_LN);
                self.points.set_vec3(Group::Position, joint, add(seen.at, self.radar));
                self.points.set_vec3(Group::LogScale, joint, [ln_scale; 3]);
                self.points.joint_mut(Group::Rotation, joint)[0] = 1.0;
                self.points.set_vec3(Group::Velocity, joint, velocity);
                let omega = self.points.joint_mut(Group::Omega, joint);
                if features == shape.doppler_features {
                    for &(own, share) in &of.joints {
                        let from = params.joint(Group::Omega, first + own);
                        omega.iter_mut().zip(from).for_each(|(to, from)| *to += share * from);
                    }
                } else {
                    omega.fill(look.omega_mean);
                }
                self.seen.push((seen, look));
            }
        }
        let beta = self.points.group_mut(Group::Beta);
        each_joint(precision, self.seen.len(), &mut Brighten { seen: &mut self.seen, beta });
        self.gradient.reset(self.points.shape());
    }

    /// Adds to `gradient` (of the joints) what the gradient of the points implies.
    pub(super) fn pull_back(&self, params: &Pppr, gradient: &mut Pppr) {
        let shape = params.shape();
        let features = self.points.shape().doppler_features;
        for person in 0..shape.persons {
            let places = self.places(params.person(person));
            let normal = Normal::of(&places);
            let first = person * shape.joints;
            let (mut bars, mut normal_bar) = ([[0.0; 3]; PARTS], [0.0; 3]);
            // Of ω̄ of each joint, where points have no more than that.
            let mut mean_bars: SmallVec<[f64; 32]> = SmallVec::from_elem(0.0, shape.joints);
            for (k, of) in self.body.iter().enumerate() {
                let joint = person * self.body.len() + k;
                let (seen, Look { ln_alpha, ln_scale, opacity, .. }) = self.seen[joint];
                // By ln α of the point; where it is as bright as can be it has no slope.
                let by_ln = if opacity < MOST_ALPHA {
                    self.gradient.joint(Group::Beta, joint)[0] / (1.0 - opacity)
                } else {
                    0.0
                };
                let bar = self.gradient.vec3(Group::Position, joint);
                let place_bar = seen.pull_back(&normal, (bar, by_ln), &mut bars, &mut normal_bar);
                of.shares.iter().for_each(|&(part, share)| add_scaled(&mut bars[part], place_bar, share));
                let pass = |x: f64, least: f64, bar: f64| if x > least && x < MOST_LN { bar } else { 0.0 };
                let scale_bar = self.gradient.vec3(Group::LogScale, joint).iter().sum();
                let (alpha_bar, scale_bar) =
                    (pass(ln_alpha, LEAST_LN_ALPHA, by_ln), pass(ln_scale, -MOST_LN, scale_bar));
                let velocity_bar = self.gradient.vec3(Group::Velocity, joint);
                let omega_bar = self.gradient.joint(Group::Omega, joint);
                let mean_bar = omega_bar.iter().sum::<f64>();
                for &(own, share) in &of.joints {
                    mean_bars[own] += share * mean_bar;
                    let own = first + own;
                    gradient.joint_mut(Group::Beta, own)[0] += share * alpha_bar * (1.0 - self.looks[own].opacity);
                    gradient.joint_mut(Group::LogScale, own).iter_mut().for_each(|x| *x += share * scale_bar / 3.0);
                    let velocity = gradient.joint_mut(Group::Velocity, own);
                    velocity.iter_mut().zip(velocity_bar).for_each(|(x, bar)| *x += share * bar);
                    if features == shape.doppler_features {
                        let omega = gradient.joint_mut(Group::Omega, own);
                        omega.iter_mut().zip(omega_bar).for_each(|(x, bar)| *x += share * bar);
                    }
                }
            }
            if features != shape.doppler_features {
                for (own, mean) in mean_bars.iter().enumerate() {
                    let omega = gradient.joint_mut(Group::Omega, first + own);
                    let each = mean / omega.len().max(1) as f64;
                    for x in omega {
                        *x += each;
                    }
                }
            }
            normal.pull_back(normal_bar, &mut bars);
            for (part, bar) in bars.into_iter().enumerate() {
                let joints = self.parts.joints_of(part);
                for &own in joints {
                    let position = gradient.joint_mut(Group::Position, first + own);
                    position.iter_mut().zip(bar).for_each(|(x, bar)| *x += bar / joints.len() as f64);
                }
            }
        }
    }

    /// The parts of a person's body as the radar sees them.
    fn places(&self, joints: &[Vec3]) -> [Vec3; PARTS] {
        self.parts.places(joints).map(|place| sub(place, self.radar))
    }

    /// Takes in how the joints look.
    fn look(&mut self, params: &Pppr, precision: Precision) {
        let joints = params.shape().total_joints();
        self.looks.clear();
        self.looks.resize(joints, Look::default());
        each_joint(precision, joints, &mut TakeIn { params, plain: &self.plain, looks: &mut self.looks });
    }
}

impl Point {
    /// How it is seen at this place on the bone.
    fn seen(&self, place: Vec3, places: &[Vec3; PARTS], normal: &Normal) -> Seen {
        let mut at = place;
        let (share, facing) = match self.kind {
            Kind::Limb { ends, radius_m } => {
                let side = Side::of(place, sub(places[ends[1]], places[ends[0]]));
                add_scaled(&mut at, side.outwards, -(OUT) * radius_m / side.sine);
                (side.sine * side.sine + LIMB_END, Facing::Limb { ends, radius_m, side })
            }
            Kind::Trunk => {
                let sight = unit(place, 1e-12);
                let cosine = dot(sight.0, normal.front.0);
                let out = (cosine / TRUNK_EDGE).tanh();
                add_scaled(&mut at, normal.front.0, -(TRUNK_OUT_M) * out);
                (cosine * cosine + TRUNK_SIDE, Facing::Trunk { sight, cosine, out })
            }
            Kind::Head => {
                let sight = unit(place, 1e-12);
                add_scaled(&mut at, sight.0, -(HEAD_OUT_M));
                (1.0, Facing::Head(sight))
            }
            Kind::Foot => {
                add_scaled(&mut at, normal.front.0, FOOT_AHEAD_M);
                (1.0, Facing::Foot)
            }
        };
        Seen { place, at, share, facing }
    }
}

impl Seen {
    /// ∂L/∂(its place on the bone) of the adjoints of where it is seen and of its ln α; what limbs' directions and the trunk's
    /// normal want is added to `bars` and `normal_bar`.
    fn pull_back(
        &self,
        normal: &Normal,
        (bar, by_ln): (Vec3, f64),
        bars: &mut [Vec3; PARTS],
        normal_bar: &mut Vec3,
    ) -> Vec3 {
        let mut place_bar = bar;
        let sight_bar = |sight: (Vec3, f64), bar: Vec3, place_bar: &mut Vec3| {
            add_scaled(place_bar, unit_back(self.place, sight.1, bar), 1.0);
        };
        match self.facing {
            Facing::Limb { ends, radius_m, side } => {
                let (n, s) = (side.outwards, side.sine);
                let pushed = scale(bar, -(OUT) * radius_m);
                let mut n_bar = unit_back(n, s, pushed);
                add_scaled(&mut n_bar, n, by_ln / self.share);
                let (e, k) = (side.axis.0, side.sight.0);
                let along = dot(e, n_bar);
                let mut k_bar = n_bar;
                add_scaled(&mut k_bar, e, -along);
                let mut e_bar = scale(n_bar, -dot(k, e));
                add_scaled(&mut e_bar, k, -along);
                sight_bar(side.sight, k_bar, &mut place_bar);
                let along_bar = unit_back(side.along, side.axis.1, e_bar);
                add_scaled(&mut bars[ends[1]], along_bar, 1.0);
                add_scaled(&mut bars[ends[0]], along_bar, -1.0);
            }
            Facing::Trunk { sight, cosine, out } => {
                let front = normal.front.0;
                add_scaled(normal_bar, bar, -(TRUNK_OUT_M) * out);
                let cosine_bar =
                    -(TRUNK_OUT_M) * dot(front, bar) * (1.0 - out * out) / TRUNK_EDGE + by_ln * cosine / self.share;
                add_scaled(normal_bar, sight.0, cosine_bar);
                sight_bar(sight, scale(front, cosine_bar), &mut place_bar);
            }
            Facing::Head(sight) => sight_bar(sight, scale(bar, -(HEAD_OUT_M)), &mut place_bar),
            Facing::Foot => add_scaled(normal_bar, bar, FOOT_AHEAD_M),
        }
        place_bar
    }
}

/// Where the radar is: the mean of the places of its views, world frame, m.
pub(super) fn radar_place(views: &[crate::radar::View]) -> Vec3 {
    let mut place = [0.0; 3];
    for view in views {
        add_scaled(&mut place, view.pose.world_from_view([0.0; 3]), 1.0 / views.len().max(1) as f64);
    }
    if norm(place).is_finite() { place } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{Rng as _, SeedableRng as _};

    fn scene(grain: Grain) -> (Skin, Pppr, Pppr) {
        let rng = &mut StdRng::seed_from_u64(4);
        let skeleton = Skeleton::preset("coco17").unwrap_or_else(|| unreachable!("it is one of them"));
        let mut skin =
            Skin::of_grain(&skeleton, [0.1, -0.2, 0.3], 3, grain).unwrap_or_else(|| unreachable!("COCO has all parts"));
        let mut params = Pppr::zeros(PpprShape { persons: 2, joints: 17, doppler_features: 3 });
        let standing = crate::mhp::template::Template::new(&skeleton).facing([3.0, 0.4, 0.1], [-0.8, 0.6]);
        for joint in 0..34 {
            let p = standing[joint % 17].map(|x| x + rng.random_range(-0.1..0.1));
            params.set_vec3(Group::Position, joint, p);
            params.set_vec3(Group::Velocity, joint, [0; 3].map(|_| rng.random_range(-1.0..1.0)));
            params.set_vec3(Group::LogScale, joint, [0; 3].map(|_| rng.random_range(-2.8..-2.0)));
            params.joint_mut(Group::Rotation, joint)[0] = 1.0;
            params.joint_mut(Group::Beta, joint)[0] = rng.random_range(-1.0..0.2);
            params.joint_mut(Group::Omega, joint).iter_mut().for_each(|x| *x = rng.random_range(-1.0..1.0));
        }
        skin.fill(&params, Precision::F64);
        let mut wanted = Pppr::zeros(skin.points.shape());
        for group in Group::ALL {
            wanted.group_mut(group).iter_mut().for_each(|x| *x = rng.random_range(-1.0..1.0));
        }
        // Points do not turn.
        wanted.group_mut(Group::Rotation).fill(0.0);
        (skin, params, wanted)
    }

    #[test]
    fn the_way_back_agrees_with_central_differences() {
        [FINE, COARSE].into_iter().for_each(differences);
    }

    fn differences(grain: Grain) {
        let (mut skin, params, wanted) = scene(grain);
        let mut loss = |params: &Pppr| -> f64 {
            skin.fill(params, Precision::F64);
            Group::ALL
                .map(|group| skin.points.group(group).iter().zip(wanted.group(group)).map(|(a, b)| a * b).sum::<f64>())
                .iter()
                .sum()
        };
        let mut gradient = Pppr::zeros(params.shape());
        let mut quotients = Vec::new();
        for group in Group::ALL {
            for i in 0..params.group(group).len() {
                let mut at = |offset: f64| {
                    let mut moved = params.clone();
                    moved.group_mut(group)[i] += offset;
                    loss(&moved)
                };
                let h = 1e-4;
                quotients.push((group, i, (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h)));
            }
        }
        skin.fill(&params, Precision::F64);
        skin.gradient = wanted.clone();
        skin.pull_back(&params, &mut gradient);
        for (group, i, quotient) in quotients {
            let got = gradient.group(group)[i];
            assert!((got - quotient).abs() < 1e-6 * (1.0 + quotient.abs()), "{} [{i}]: {got}, {quotient}", group.key());
        }
    }

    #[test]
    fn points_face_the_radar_and_a_body_has_the_same_area_of_few_and_of_many() {
        let areas = [FINE, COARSE].map(|grain| {
            let (skin, params, _) = scene(grain);
            let towards = |p: Vec3| norm(sub(p, skin.radar));
            let trunk: Vec<usize> = (0..skin.body.len()).filter(|&k| skin.body[k].kind == Kind::Trunk).collect();
            let middle = crate::geometry::mean(&[5, 6, 11, 12].map(|joint| params.position(joint)));
            let chest = crate::geometry::mean(&trunk.iter().map(|&k| skin.points.position(k)).collect::<Vec<_>>());
            assert!(towards(chest) < towards(middle) - 0.02, "{chest:?} {middle:?}");
            assert_eq!(skin.points.shape().total_joints(), 2 * skin.body.len());
            skin.body.iter().map(|point| point.amplitude * point.amplitude).sum::<f64>()
        });
        assert!((areas[0] - areas[1]).abs() < 1e-9, "{areas:?}");
    }
}
