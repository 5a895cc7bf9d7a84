//! The space of poses that a prior of motion spans, on a skeleton, at the times of a window's frames.
//!
//! ```text
//! X_f(c) = μ_f + Σ_k c_k B_fk + r        (joints, 3), sizes; c in standard deviations
//! u_f    = exp([w + ẇ t_f]×) (X_f(c) + η e_z)
//! p_f    = e^s R_z(y) (u_f − η e_z) + t    world frame, m
//! ```
//!
//! Coordinates of a person are t (3, m), y (rad), s (ln m), q (how bright what stands still is, `static_echo.rs`), the tilt w and ẇ (2
//! each, `tilt.rs`), c, and of a fit r (3 a joint, sizes). Where the floor is known the third is how high the lowest part of the body
//! is above it instead of t_z (`ground.rs`). r is the residual: what of the pose that a fit begins at no c can say, some 2 cm a joint
//! of people that the prior has not seen. It stays as it is: who puts a body by hand finds it where he put it, and a loss at a
//! start is the loss of that start. A search has none.

mod project;

use super::ground::{self, Contact, Ground};
use super::proportions::Proportions;
use super::static_echo;
use super::tilt::{self, Fallen, Tilt};
use crate::body::{Mixture, MotionPrior, Parts, Skeleton};
use crate::dense::{add_products, add_rows};
use crate::geometry::{Vec3, add, cross, scale, sub};
use project::Equations;
use smallvec::SmallVec;
use std::sync::OnceLock;

/// Components of the prior that a pose has at most.
pub(super) const MOST_COMPONENTS: usize = 64;

/// How finely poses are told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Detail {
    /// In a search: with more components it ends in other poses more often, with fewer poses are no people's.
    Search,
    /// In the fit of what a search found.
    Fit,
}

impl Detail {
    /// Components of the prior that are used, at most.
    fn components(self) -> usize {
        match self {
            Self::Search => 28,
            Self::Fit => MOST_COMPONENTS,
        }
    }
}

/// What a coordinate's square counts in L_prior, however many there are.
const SHARE: f64 = 1.0 / 30.0;
/// Half the time over which a velocity is taken, s.
const HALF_STEP_S: f64 = 0.05;
/// t, y, s, q, w and ẇ: what a person has beside c.
pub(super) const BODY: usize = TILT + tilt::NUMBERS;
/// Where t_z, or the height above the floor, y, s, q, and w and ẇ stand.
pub(super) const HEIGHT: usize = 2;
pub(super) const YAW: usize = 3;
pub(super) const LN_SIZE: usize = 4;
pub(super) const STILL: usize = 5;
pub(super) const TILT: usize = 6;
/// How high the hips of a body that lies are, sizes.
const LIES: f64 = 0.1;

/// Poses of a skeleton at some times.
#[derive(Debug, Clone)]
pub(super) struct PoseSpace {
    pub(super) joints: usize,
    components: usize,
    /// Numbers of r.
    residual: usize,
    /// Parts of the body, by which r is believed; of a search none.
    parts: Option<Parts>,
    /// When the frames are, s after the window's middle.
    times_s: Vec<f64>,
    /// η
    hips: f64,
    /// A row a time: the mean and then the components, (1 + components, joints), sizes.
    poses: Vec<Vec<Vec3>>,
    /// What these change in a second at each time.
    changes: Vec<Vec<Vec3>>,
    /// What the nearest c at each time are found by, once it was asked for.
    equations: Vec<OnceLock<Equations>>,
    /// How likely c is.
    mixture: &'static Mixture,
    /// Mean and standard deviation of s.
    ln_size: [f64; 2],
    /// Of each component: 1 where it is the same of left and right, −1 where it is opposite. The mirror image of a pose has c
    /// times this.
    signs: Vec<f64>,
    /// How long bones are.
    pub(super) proportions: Proportions,
    /// What bodies stand on, where that is known.
    pub(super) ground: Option<Ground>,
    /// From where a search may begin: c, and how high the hips are, sizes.
    pub(super) starts: Vec<(Vec<f64>, f64)>,
}

/// The joints of the prior that a joint of this name lies between, with their shares.
fn sources(name: &str) -> Vec<(&'static str, f64)> {
    let words: Vec<&str> = name.split(['_', ' ', '-']).collect();
    let is = |of: &[&str]| words.iter().any(|word| of.contains(word));
    let sided = |left: &'static str, right: &'static str| match (is(&["left", "l"]), is(&["right", "r"])) {
        (true, false) => vec![(left, 1.0)],
        (false, true) => vec![(right, 1.0)],
        _ => vec![(left, 0.5), (right, 0.5)],
    };
    match () {
        () if is(&["nose", "jaw"]) => vec![("nose", 1.0)],
        () if is(&["eye"]) => sided("left_eye", "right_eye"),
        () if is(&["ear"]) => sided("left_ear", "right_ear"),
        () if is(&["shoulder", "clavicle", "collar"]) => sided("left_shoulder", "right_shoulder"),
        () if is(&["elbow"]) => sided("left_elbow", "right_elbow"),
        () if is(&["wrist", "hand", "finger", "thumb"]) => sided("left_wrist", "right_wrist"),
        () if is(&["hip"]) => sided("left_hip", "right_hip"),
        () if is(&["knee"]) => sided("left_knee", "right_knee"),
        () if is(&["ankle", "heel", "foot", "toe"]) => sided("left_ankle", "right_ankle"),
        () if is(&["pelvis", "root"]) => vec![("pelvis", 1.0)],
        () if is(&["neck", "thorax"]) => vec![("neck", 1.0)],
        () if is(&["spine", "torso", "belly", "chest"]) => vec![("pelvis", 0.5), ("neck", 0.5)],
        // The bones that skeletons of data sets have between neck and head reach to its top.
        () if is(&["head", "top"]) => vec![("head_top", 1.0)],
        () => Vec::new(),
    }
}

impl PoseSpace {
    /// Of `prior` on `skeleton` at `times_s` after a window's middle; `None` where a joint has a name that the prior knows
    /// nothing of.
    pub(super) fn new(
        prior: &'static MotionPrior,
        skeleton: &Skeleton,
        times_s: &[f64],
        floor_z_m: Option<f64>,
        detail: Detail,
    ) -> Option<Self> {
        let shares: Option<Vec<Vec<(usize, f64)>>> = skeleton
            .joints
            .iter()
            .map(|name| {
                let found = sources(&name.to_lowercase());
                let of =
                    found.iter().map(|(name, share)| Some((prior.joint(name)?, *share))).collect::<Option<Vec<_>>>();
                of.filter(|of| !of.is_empty())
            })
            .collect();
        let shares = shares?;
        let components = prior.components().len().min(detail.components());
        let rows = || std::iter::once(prior.mean()).chain(prior.components()[..components].iter().map(Vec::as_slice));
        let at = |t_s: f64| -> Vec<Vec3> {
            let (lower, share) = between(prior.times_s(), t_s);
            let numbers = 3 * prior.joints().len();
            let joint = |row: &[f64], of: &[(usize, f64)]| -> Vec3 {
                std::array::from_fn(|k| {
                    let number = |time: usize, joint: usize| row[time * numbers + 3 * joint + k];
                    let upper = (lower + 1).min(prior.times_s().len() - 1);
                    of.iter().map(|&(j, w)| w * (number(lower, j) * (1.0 - share) + number(upper, j) * share)).sum()
                })
            };
            rows().flat_map(|row| shares.iter().map(move |of| joint(row, of)).collect::<Vec<_>>()).collect()
        };
        let ends = (prior.times_s().first().copied()?, prior.times_s().last().copied()?);
        let change = |&t_s: &f64| -> Vec<Vec3> {
            let (from, to) = ((t_s - HALF_STEP_S).max(ends.0), (t_s + HALF_STEP_S).min(ends.1));
            let slope = 1.0 / (to - from).max(1e-9);
            at(to).into_iter().zip(at(from)).map(|(b, a)| [0, 1, 2].map(|k| (b[k] - a[k]) * slope)).collect()
        };
        let starts = prior.starts().iter().map(|start| (start.coefficients[..components].to_vec(), start.hip_height));
        let lowest = at(0.0)[..skeleton.joints.len()].iter().map(|p| p[HEIGHT]).fold(f64::INFINITY, f64::min);
        let poses: Vec<Vec<Vec3>> = times_s.iter().map(|&t_s| at(t_s)).collect();
        let ground = floor_z_m.and_then(|floor_z_m| Ground::new(skeleton, floor_z_m, (&poses, -lowest)));
        Some(Self {
            joints: skeleton.joints.len(),
            components,
            residual: if detail == Detail::Fit { 3 * skeleton.joints.len() } else { 0 },
            parts: (detail == Detail::Fit).then(|| Parts::of(skeleton)).flatten(),
            times_s: times_s.to_vec(),
            hips: -lowest,
            poses,
            changes: times_s.iter().map(change).collect(),
            equations: vec![OnceLock::new(); times_s.len()],
            mixture: prior.mixture(),
            ln_size: prior.ln_size(),
            signs: prior.mirror_signs()[..components].to_vec(),
            proportions: Proportions::of(skeleton, &at(0.0)[..skeleton.joints.len()], detail),
            ground,
            starts: starts.collect(),
        })
    }

    /// The same body with left and right exchanged; how it is tilted stays.
    pub(super) fn mirror(&self, coordinates: &mut [f64]) {
        coordinates[BODY..].iter_mut().zip(&self.signs).for_each(|(c, sign)| *c *= sign);
    }

    /// Coordinates of a person.
    pub(super) fn coordinates(&self) -> usize {
        BODY + self.components + self.residual
    }

    /// c of a person with these coordinates.
    fn coefficients<'a>(&self, coordinates: &'a [f64]) -> &'a [f64] {
        &coordinates[BODY..BODY + self.components]
    }

    /// r of a person with these coordinates; nothing in a search.
    fn residual<'a>(&self, coordinates: &'a [f64]) -> &'a [f64] {
        &coordinates[BODY + self.components..]
    }

    /// The same, to be filled in.
    pub(super) fn residual_mut<'a>(&self, coordinates: &'a mut [f64]) -> &'a mut [f64] {
        &mut coordinates[BODY + self.components..]
    }

    /// Σ_k of a row's mean and components times 1 and c.
    fn mixed(&self, row: &[Vec3], c: &[f64], out: &mut [Vec3]) {
        let (mean, components) = row.split_at(self.joints);
        out.copy_from_slice(mean);
        add_rows(out.as_flattened_mut(), components.as_flattened(), c, 0);
    }

    /// Gives a person of these coordinates this body, in the pose that people have most often, with its hips (world frame, m) as far
    /// along it as that says; on the floor where the radar's height above that is known, m.
    pub(super) fn lay(&self, coordinates: &mut [f64], fallen: &Fallen, hips: Vec3, radar_height_m: Option<f64>) {
        fallen.place(coordinates);
        coordinates[BODY..].fill(0.0);
        if let Some((c, _)) = self.starts.first() {
            coordinates[BODY..BODY + c.len()].copy_from_slice(c);
        }
        let turn = Turn::of(coordinates);
        let [x, y, z] = Tilt::of(&coordinates[TILT..BODY], 0.0).forwards([0.0, 0.0, self.hips]);
        let beside = turn.forwards([x, y, z - self.hips]);
        let lies = z + LIES * x.hypot(y) / self.hips;
        let lies_m = radar_height_m.map_or(hips[2], |height_m| lies * turn.size - height_m);
        let [x, y, _] = sub(add(hips, scale(fallen.towards(), fallen.along_m)), beside);
        let height = if self.ground.is_some() { 0.0 } else { lies_m - beside[2] };
        coordinates[..YAW].copy_from_slice(&[x, y, height]);
    }

    /// How a person with these coordinates is tilted in each frame, and stands on the floor where that is known.
    pub(super) fn stance(&self, coordinates: &[f64]) -> Stance {
        let tilts: SmallVec<[Tilt; FRAMES]> =
            self.times_s.iter().map(|&t_s| Tilt::of(&coordinates[TILT..BODY], t_s)).collect();
        let upright = coordinates[TILT..BODY].iter().all(|&x| x == 0.0);
        let contact = self.ground.as_ref().map(|ground| ground.contact(coordinates, &tilts, upright));
        Stance { tilts, upright, contact }
    }

    /// t of a person with these coordinates, world frame, m.
    fn place(coordinates: &[f64], stance: &Stance) -> Vec3 {
        [coordinates[0], coordinates[1], coordinates[HEIGHT] + stance.ground_m()]
    }

    /// u of a frame: X as it is tilted.
    fn tilted(&self, frame: usize, coordinates: &[f64], tilt: &Tilt, out: &mut [Vec3]) {
        self.mixed(&self.poses[frame], self.coefficients(coordinates), out);
        out.as_flattened_mut().iter_mut().zip(self.residual(coordinates)).for_each(|(out, r)| *out += r);
        for p in out {
            *p = tilt.forwards([p[0], p[1], p[2] + self.hips]);
        }
    }

    /// The joints of a person with these coordinates, and this stance, at time `frame`, world frame, m.
    pub(super) fn pose(&self, coordinates: &[f64], stance: &Stance, frame: usize, out: &mut [Vec3]) {
        self.tilted(frame, coordinates, &stance.tilts[frame], out);
        let (turn, place) = (Turn::of(coordinates), Self::place(coordinates, stance));
        for p in out {
            *p = add(turn.forwards([p[0], p[1], p[2] - self.hips]), place);
        }
    }

    /// Their velocities, m/s, where they are at `pose`.
    pub(super) fn velocity(
        &self,
        coordinates: &[f64],
        stance: &Stance,
        (frame, pose): (usize, &[Vec3]),
        out: &mut [Vec3],
    ) {
        let tilt = &stance.tilts[frame];
        self.mixed(&self.changes[frame], self.coefficients(coordinates), out);
        let (turn, place) = (Turn::of(coordinates), Self::place(coordinates, stance));
        for (v, p) in out.iter_mut().zip(pose) {
            *v = turn.forwards(tilt.swept(self.before_turn(&turn, place, *p), tilt.forwards(*v)));
        }
    }

    /// u of a joint at `p`.
    fn before_turn(&self, turn: &Turn, place: Vec3, p: Vec3) -> Vec3 {
        let [x, y, z] = turn.inverse(sub(p, place));
        [x, y, z + self.hips]
    }

    /// Adds to `bars` (a coordinate each) what the adjoints of a frame's joints and velocities imply; r, which stays, has none.
    pub(super) fn pull_back(
        &self,
        coordinates: &[f64],
        stance: &Stance,
        frame: usize,
        ((pose, pose_bar), moving): (Barred, Option<Barred>),
        bars: &mut [f64],
    ) {
        let turn = Turn::of(coordinates);
        let tilt = &stance.tilts[frame];
        let [mut x, mut y, mut z, mut yaw, mut ln_size] = [0.0; 5];
        let place = Self::place(coordinates, stance);
        let (mut torque, mut swing) = ([0.0; 3], [0.0; 3]);
        let (mut own, mut own_change) = ([[0.0; 3]; MOST_JOINTS], [[0.0; 3]; MOST_JOINTS]);
        for (joint, ((p, bar), own)) in pose.iter().zip(pose_bar).zip(&mut own).enumerate() {
            let beside = sub(*p, place);
            let turned = self.before_turn(&turn, place, *p);
            x += bar[0];
            y += bar[1];
            z += bar[2];
            yaw += beside[0] * bar[1] - beside[1] * bar[0];
            ln_size += beside[0] * bar[0] + beside[1] * bar[1] + beside[2] * bar[2];
            let mut at_bar = turn.backwards(*bar);
            if let Some((velocities, velocity_bar)) = moving {
                let (v, bar) = (velocities[joint], velocity_bar[joint]);
                yaw += v[0] * bar[1] - v[1] * bar[0];
                ln_size += v[0] * bar[0] + v[1] * bar[1] + v[2] * bar[2];
                let bar = turn.backwards(bar);
                let own_v = sub(turn.inverse(v), tilt.swept(turned, [0.0; 3]));
                at_bar = add(at_bar, tilt.swept_back(bar));
                swing = add(swing, cross(turned, bar));
                torque = add(torque, cross(own_v, bar));
                own_change[joint] = tilt.backwards(bar);
            }
            torque = add(torque, cross(turned, at_bar));
            *own = tilt.backwards(at_bar);
        }
        for (bar, sum) in bars.iter_mut().zip([x, y, z, yaw, ln_size]) {
            *bar += sum;
        }
        tilt.pull_back(torque, &mut bars[TILT..BODY]);
        self.mixed_back(&self.poses[frame], &own, bars);
        if moving.is_some() {
            tilt.pull_back_spin(swing, &mut bars[TILT..BODY]);
            self.mixed_back(&self.changes[frame], &own_change, bars);
        }
        if let Some(contact) = &stance.contact {
            contact.pull_back(z, bars);
        }
        if stance.upright {
            bars[TILT..BODY].fill(0.0);
        }
    }

    /// Adds to the bars of c what the adjoints of [`Self::mixed`] imply.
    fn mixed_back(&self, row: &[Vec3], own: &[Vec3], bars: &mut [f64]) {
        add_products(&mut bars[BODY..], row[self.joints..].as_flattened(), own[..self.joints].as_flattened());
    }

    /// How unlikely the coordinates are: [`SHARE`] of how unlikely the mixture has c, of the squares of what it is not of, of s and q, in
    /// standard deviations, and of what the tilt costs, and how far from the floor they are; adds `gain` times its gradient.
    pub(super) fn unlikeliness(&self, coordinates: &[f64], gain: f64, bars: &mut [f64]) -> f64 {
        let [mean, deviation] = self.ln_size;
        let size = (coordinates[LN_SIZE] - mean) / deviation;
        bars[LN_SIZE] += 2.0 * gain * SHARE * size / deviation;
        let (still, by_still) = static_echo::unlikeliness(coordinates[STILL]);
        bars[STILL] += gain * SHARE * by_still;
        let tilted = tilt::unlikeliness(&coordinates[TILT..BODY], gain * SHARE, &mut bars[TILT..BODY]);
        let mut sum = size * size + still + tilted;
        let c = self.coefficients(coordinates);
        sum += self.mixture.unlikeliness(c, gain * SHARE, &mut bars[BODY..BODY + c.len()]);
        let rest = self.mixture.coefficients();
        for (c, bar) in c.iter().zip(&mut bars[BODY..]).skip(rest) {
            sum += c * c;
            *bar += 2.0 * gain * SHARE * c;
        }
        let (off, by_height) = self.ground.as_ref().map_or((0.0, 0.0), |_| ground::unlikeliness(coordinates[HEIGHT]));
        bars[HEIGHT] += gain * by_height;
        SHARE * sum + off
    }
}

/// Frames of a window of which nothing has to be allocated.
const FRAMES: usize = 9;

/// Points or velocities, and their adjoints.
type Barred<'a> = (&'a [Vec3], &'a [Vec3]);

/// How a person is in the frames of a window.
#[derive(Debug, Clone)]
pub(super) struct Stance {
    tilts: SmallVec<[Tilt; FRAMES]>,
    upright: bool,
    contact: Option<Contact>,
}

impl Stance {
    /// t_z of a body that is on the floor, m; 0 where that is not known.
    fn ground_m(&self) -> f64 {
        self.contact.as_ref().map_or(0.0, |contact| contact.z_m)
    }
}

/// Joints of a skeleton at most: those of larger ones are not moved by a prior.
pub(super) const MOST_JOINTS: usize = 64;

/// e^s R_z(y)
struct Turn {
    cosine: f64,
    sine: f64,
    size: f64,
}

impl Turn {
    fn of(coordinates: &[f64]) -> Self {
        let (sine, cosine) = coordinates[YAW].sin_cos();
        let size = coordinates[LN_SIZE].exp();
        Self { cosine: cosine * size, sine: sine * size, size }
    }

    fn forwards(&self, [x, y, z]: Vec3) -> Vec3 {
        [self.cosine * x - self.sine * y, self.sine * x + self.cosine * y, self.size * z]
    }

    /// What [`Self::forwards`] makes this of.
    fn inverse(&self, p: Vec3) -> Vec3 {
        self.backwards(p).map(|x| x / (self.size * self.size))
    }

    /// The transpose.
    fn backwards(&self, [x, y, z]: Vec3) -> Vec3 {
        [self.cosine * x + self.sine * y, self.cosine * y - self.sine * x, self.size * z]
    }
}

/// The sample at or before a time, and the share of the next.
fn between(times: &[f64], t: f64) -> (usize, f64) {
    let upper = times.partition_point(|&sample| sample <= t);
    let Some(lower) = upper.checked_sub(1) else { return (0, 0.0) };
    match times.get(upper) {
        Some(next) => (lower, (t - times[lower]) / (next - times[lower])),
        None => (lower, 0.0),
    }
}
