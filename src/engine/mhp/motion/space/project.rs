//! The coordinates whose joints and velocities come nearest to given ones.

use super::{BODY, HEIGHT, LN_SIZE, MOST_COMPONENTS, PoseSpace, STILL, Stance, TILT, Turn, YAW};
use crate::body::Parts;
use crate::geometry::{Vec3, dot, mean, norm, scale, sub};
use crate::mhp::motion::static_echo;
use crate::mhp::motion::tilt::{self, Tilt};
use smallvec::SmallVec;

/// How far joints and what they travel in a while ([`PoseSpace::while_s`]) may be from the prior's, sizes: those of a start are no
/// measurements.
const MISFIT: f64 = 0.05;
/// That while: this share of the time to the window's farther end, at least and at most so long, s.
const OF_FARTHEST: f64 = 0.5;
const WHILE_S: [f64; 2] = [0.05, 0.1];
/// By how much the velocity of a body as a whole may change until another frame of the window, m/s.
const PACE_MPS: f64 = 0.2;
/// A body that has to be turned by less than this from the prior's mean is bent, not tilted, rad.
const BENT: f64 = 0.2;
/// Rounds in which place and pose are found from joints.
const ROUNDS: usize = 6;
/// No pose of people is farther from those that c can say, the root of the mean square over joints, sizes: it is 0.019 in the median of
/// two simulators' people and 0.043 of those who fall. Measured.
const MOST_RESIDUAL: f64 = 0.045;
/// What of the mean square of errors of joints no c can say: 0.37 of 3 cm an axis, 0.34 of 6 cm. Measured.
const UNSAID: f64 = 0.35;
/// Parts of the body between which bones are as long left as right: the ends of the left one.
const PAIRED: [[usize; 2]; 5] = [[1, 3], [3, 5], [1, 7], [7, 9], [9, 11]];

impl PoseSpace {
    /// The coordinates whose joints and velocities at time `frame` are nearest to these, in a space that has its mean at 0.
    pub(in crate::mhp::motion) fn project(&self, frame: usize, joints: &[Vec3], velocities: &[Vec3]) -> Vec<f64> {
        let upright = self.nearest(frame, joints, velocities, false);
        let w = tilt::between(&self.poses[frame][..self.joints], joints);
        let best = if w[0].hypot(w[1]) < BENT {
            upright
        } else {
            let tilted = self.nearest(frame, joints, velocities, true);
            if tilted.1 < upright.1 { tilted } else { upright }
        };
        let mut coordinates = best.0;
        if self.residual > 0 {
            self.keep(frame, joints, &mut coordinates);
        }
        coordinates
    }

    /// Fills in r: what is left of the way to `joints`, but for what is there by errors of who placed them. Of a residual whose mean
    /// square is v, errors that leave n in it leave 1 − n/v of it to believe (Wiener); they tell themselves by bones that are not as
    /// long left as right.
    fn keep(&self, frame: usize, joints: &[Vec3], coordinates: &mut [f64]) {
        let mut pose = vec![[0.0; 3]; self.joints];
        let stance = self.stance(coordinates);
        self.pose(coordinates, &stance, frame, &mut pose);
        let turn = Turn::of(coordinates);
        let left = pose.iter().zip(joints).map(|(p, q)| stance.tilts[frame].backwards(turn.inverse(sub(*q, *p))));
        let left: Vec<Vec3> = left.collect();
        let square = left.iter().map(|r| dot(*r, *r)).sum::<f64>() / self.joints as f64;
        let errors = UNSAID * self.uneven(joints) / (turn.size * turn.size);
        let share = (1.0 - errors / square).max(0.0) * (MOST_RESIDUAL * MOST_RESIDUAL / square).min(1.0);
        self.residual_mut(coordinates).iter_mut().zip(left.as_flattened()).for_each(|(r, left)| *r = share * left);
        // The body stands where it stood, if on other feet.
        let [before_m, after_m] = [&stance, &self.stance(coordinates)].map(Stance::ground_m);
        coordinates[HEIGHT] += before_m - after_m;
    }

    /// The mean square of errors of joints whose bones differ by as much between left and right as those of `joints`, m²; 0 where
    /// parts of the body have no joint. With errors of variance σ² an axis a bone's length has one of 2 σ².
    fn uneven(&self, joints: &[Vec3]) -> f64 {
        let Some(parts) = &self.parts else { return 0.0 };
        let places = parts.places(joints);
        let length = |[a, b]: [usize; 2]| norm(sub(places[a], places[b]));
        let squares = PAIRED.map(|bone| (length(bone) - length(bone.map(Parts::mirrored))).powi(2));
        3.0 * squares.iter().sum::<f64>() / (4.0 * PAIRED.len() as f64)
    }

    /// The same of a body that is upright or tilted, and how far they are from it: squares over all joints, sizes.
    fn nearest(&self, frame: usize, joints: &[Vec3], velocities: &[Vec3], tilted: bool) -> (Vec<f64>, f64) {
        let mut coordinates = vec![0.0; self.coordinates()];
        coordinates[LN_SIZE] = self.ln_size[0];
        coordinates[STILL] = static_echo::USUAL;
        coordinates[YAW] = yaw_of(joints, &self.poses[frame][..self.joints]);
        // Tilt, place and size, and pose in turn: a few rounds settle.
        let equations = self.equations[frame].get_or_init(|| self.equations(frame));
        for _ in 0..ROUNDS {
            if tilted {
                self.tilt(frame, (joints, velocities), &mut coordinates);
            }
            self.align(frame, joints, &mut coordinates);
            self.solve(equations, (joints, velocities), &mut coordinates);
        }
        self.align(frame, joints, &mut coordinates);
        let mut pose = vec![[0.0; 3]; self.joints];
        let mut stance = self.stance(&coordinates);
        let ground_m = stance.ground_m();
        stance.contact = None;
        self.pose(&coordinates, &stance, frame, &mut pose);
        let off: f64 = pose.iter().zip(joints).map(|(p, q)| norm(sub(*p, *q)).powi(2)).sum();
        let size_m = coordinates[LN_SIZE].exp();
        let unlikely: f64 = self.coefficients(&coordinates).iter().map(|c| c * c).sum::<f64>()
            + tilt::unlikeliness(&coordinates[TILT..BODY], 0.0, &mut [0.0; tilt::NUMBERS]);
        coordinates[HEIGHT] -= ground_m;
        (coordinates, off / (size_m * size_m) + MISFIT * MISFIT * unlikely)
    }

    /// w and ẇ that bring the pose of c nearest to `joints` and what they do.
    fn tilt(&self, frame: usize, (joints, velocities): (&[Vec3], &[Vec3]), coordinates: &mut [f64]) {
        let mut pose = vec![[0.0; 3]; self.joints];
        self.mixed(&self.poses[frame], self.coefficients(coordinates), &mut pose);
        let w = tilt::between(&pose, joints);
        let tilt = Tilt::of(&[w[0], w[1], 0.0, 0.0], 0.0);
        let turned: Vec<Vec3> = pose.iter().map(|&p| tilt.forwards(p)).collect();
        coordinates[YAW] = yaw_of(joints, &turned);
        let turn = Turn::of(coordinates);
        let [there, moving] = [joints, velocities].map(|of| of.iter().map(|&p| turn.inverse(p)).collect::<Vec<_>>());
        let (rate, t_s) = (tilt::spin_of(&there, &moving), self.times_s[frame]);
        coordinates[TILT..BODY].copy_from_slice(&[w[0] - t_s * rate[0], w[1] - t_s * rate[1], rate[0], rate[1]]);
    }

    /// t, y and s that bring the pose of c and the tilt onto `joints`.
    fn align(&self, frame: usize, joints: &[Vec3], coordinates: &mut [f64]) {
        let mut pose = vec![[0.0; 3]; self.joints];
        let tilt = Tilt::of(&coordinates[TILT..BODY], self.times_s[frame]);
        self.tilted(frame, coordinates, &tilt, &mut pose);
        let (a, b) = (mean(&pose), mean(joints));
        let (mut cosine, mut sine, mut square, mut height) = (0.0, 0.0, 0.0, 0.0);
        for (p, q) in pose.iter().zip(joints) {
            let (p, q) = (sub(*p, a), sub(*q, b));
            cosine += p[0] * q[0] + p[1] * q[1];
            sine += p[0] * q[1] - p[1] * q[0];
            height += p[2] * q[2];
            square += p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
        }
        coordinates[YAW] = sine.atan2(cosine);
        let [usual, deviation] = self.ln_size;
        let size = ((cosine.hypot(sine) + height) / square.max(1e-9)).max(1e-3).ln();
        coordinates[LN_SIZE] = size.clamp(usual - 3.0 * deviation, usual + 3.0 * deviation);
        let middle = Turn::of(coordinates).forwards([a[0], a[1], a[2] - self.hips]);
        coordinates[..3].copy_from_slice(&sub(b, middle));
    }

    /// c by least squares with the prior, for the t, y and s that are there.
    fn solve(&self, equations: &Equations, (joints, velocities): (&[Vec3], &[Vec3]), coordinates: &mut [f64]) {
        let (n, frame) = (self.components, equations.frame);
        let turn = Turn::of(coordinates);
        let place = [coordinates[0], coordinates[1], coordinates[2]];
        let tilt = Tilt::of(&coordinates[TILT..BODY], self.times_s[frame]);
        let turned: Vec<Vec3> = joints.iter().map(|&p| self.before_turn(&turn, place, p)).collect();
        let own = |&u: &Vec3| {
            let [x, y, z] = tilt.backwards(u);
            [x, y, z - self.hips]
        };
        let poses = turned.iter().map(own).collect::<Vec<_>>();
        let swept = velocities.iter().zip(&turned).map(|(&v, &u)| sub(turn.inverse(v), tilt.swept(u, [0.0; 3])));
        let changes = swept.map(|v| tilt.backwards(v)).collect::<Vec<_>>();
        let goes = mean(&changes);
        let c = &mut coordinates[..BODY + n];
        c[BODY..].fill(0.0);
        for (row, wanted, weight) in
            [(&self.poses[frame], poses, 1.0), (&self.changes[frame], changes, self.while_s(frame))]
        {
            let rest = wanted.iter().zip(row).map(|(wanted, mean)| scale(sub(*wanted, *mean), weight * weight));
            self.mixed_back(row, &rest.collect::<Vec<_>>(), c);
        }
        for WalksOn { later, mean, by } in &equations.others {
            let rest: Vec3 = std::array::from_fn(|axis| later * goes[axis] - mean[axis]);
            c[BODY..].iter_mut().zip(by).for_each(|(right, by)| *right += dot(*by, rest));
        }
        substitute(&equations.factor, &mut c[BODY..]);
    }

    /// What [`Self::solve`] needs of time `frame`, whatever joints are asked for.
    fn equations(&self, frame: usize) -> Equations {
        let n = self.components;
        let others: Vec<WalksOn> =
            (0..self.poses.len()).filter(|&other| other != frame).map(|other| self.walks_on(frame, other)).collect();
        let mut normal = vec![0.0; n * n];
        let mut add = |of: &dyn Fn(usize) -> f64| {
            let each: SmallVec<[f64; MOST_COMPONENTS]> = (0..n).map(of).collect();
            for (k, row) in normal.chunks_exact_mut(n.max(1)).enumerate() {
                row[..=k].iter_mut().zip(&each).for_each(|(sum, by_l)| *sum += each[k] * by_l);
            }
        };
        for (row, weight) in [(&self.poses[frame], 1.0), (&self.changes[frame], self.while_s(frame))] {
            for joint in 0..self.joints {
                for axis in 0..3 {
                    add(&|k| weight * row[(k + 1) * self.joints + joint][axis]);
                }
            }
        }
        for other in &others {
            for axis in 0..3 {
                add(&|k| other.by[k][axis]);
            }
        }
        for k in 0..n {
            normal[k * n + k] += MISFIT * MISFIT;
        }
        factorise(&mut normal, n);
        Equations { frame, factor: normal, others }
    }

    /// The time over which velocities at time `frame` count, s. A frame at the end of a window has nothing but them to tell the other end
    /// by, 0.4 s away: counted over a short time they shrink towards somebody who stands.
    fn while_s(&self, frame: usize) -> f64 {
        let away_s = self.times_s.iter().map(|t_s| (t_s - self.times_s[frame]).abs());
        (OF_FARTHEST * away_s.fold(0.0, f64::max)).clamp(WHILE_S[0], WHILE_S[1])
    }

    /// What ties the middle of a body at time `other` to where it goes at time `frame`: joints and velocities of one frame leave where
    /// a walker is 0.4 s later to the prior, whose mean stands.
    fn walks_on(&self, frame: usize, other: usize) -> WalksOn {
        let middle = |row: &[Vec3], k: usize| mean(&row[k * self.joints..(k + 1) * self.joints]);
        let later_s = self.times_s[other] - self.times_s[frame];
        let gain = MISFIT / (PACE_MPS * later_s.abs());
        let moved = |k: usize| scale(sub(middle(&self.poses[other], k), middle(&self.poses[frame], k)), gain);
        WalksOn { later: gain * later_s, mean: moved(0), by: (1..=self.components).map(moved).collect() }
    }
}

/// The least squares for c at a frame: all but the right-hand side.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    frame: usize,
    /// L of the normal equations L Lᵀ, C order.
    factor: Vec<f64>,
    others: Vec<WalksOn>,
}

/// Equations for the middle of a body at another time, weighted.
#[derive(Debug, Clone)]
struct WalksOn {
    /// How much later that is, s, weighted as all here.
    later: f64,
    /// How far the middle is then in the mean, and in each component, sizes.
    mean: Vec3,
    by: Vec<Vec3>,
}

/// The yaw that turns `from` onto `joints`, by their horizontal extent.
fn yaw_of(joints: &[Vec3], from: &[Vec3]) -> f64 {
    let (a, b) = (mean(from), mean(joints));
    let (mut cosine, mut sine) = (0.0, 0.0);
    for (p, q) in from.iter().zip(joints) {
        let (p, q) = ([p[0] - a[0], p[1] - a[1]], [q[0] - b[0], q[1] - b[1]]);
        cosine += p[0] * q[0] + p[1] * q[1];
        sine += p[0] * q[1] - p[1] * q[0];
    }
    sine.atan2(cosine)
}

/// L of a symmetric positive definite matrix L Lᵀ of n rows, C order, over its lower half.
fn factorise(a: &mut [f64], n: usize) {
    for k in 0..n {
        let (above, rest) = a.split_at_mut(k * n);
        let row = &mut rest[..n];
        for l in 0..k {
            let other = &above[l * n..=l * n + l];
            let sum: f64 = row.iter().zip(&other[..l]).map(|(a, b)| a * b).sum();
            row[l] = (row[l] - sum) / other[l];
        }
        let sum: f64 = row[..k].iter().map(|a| a * a).sum();
        row[k] = (row[k] - sum).max(f64::MIN_POSITIVE).sqrt();
    }
}

/// Solves L Lᵀ x = b, over b.
fn substitute(a: &[f64], b: &mut [f64]) {
    let n = b.len();
    for k in 0..n {
        let sum: f64 = (0..k).map(|m| a[k * n + m] * b[m]).sum();
        b[k] = (b[k] - sum) / a[k * n + k];
    }
    for k in (0..n).rev() {
        b[k] /= a[k * n + k];
        let x = b[k];
        b[..k].iter_mut().zip(&a[k * n..k * n + k]).for_each(|(b, a)| *b -= a * x);
    }
}
