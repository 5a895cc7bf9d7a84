//! How far a body is tilted as a whole: who falls, and who lies.
//!
//! Recorded motion stands, walks and sits; nobody in it lies, and a linear space of poses reaches no farther. A person therefore has a
//! rotation before its heading, about a horizontal axis through the point between its feet,
//!
//! ```text
//! w_f = w + ẇ t_f                      (rad; x forwards, y to the left, w_z = 0)
//! u_f = exp([w_f]×) (X_f(c) + η e_z)   sizes; η how high the hips of the mean pose are above its lowest joint
//! ```
//!
//! and L_prior has ln(1 + ‖w‖²/σ²) + ln(1 + ‖ẇ‖²/σ̇²) for it (Cauchy): hardly anybody leans, and who does may lie. Its velocities take
//! ω = J(w_f) ẇ, with J the left Jacobian of SO(3). Who is upright, with w = ẇ = 0, stays so: how people lean while they stand or walk
//! the space of poses knows better. A search begins with persons of both kinds (`search.rs`).

use super::space::{TILT, YAW};
use crate::geometry::{Mat3, Vec3, add, cross, dot, mat_mul, mat_t_vec, mat_vec, mean, norm, scale, sub};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// σ, rad, and σ̇, rad/s.
const SPREAD: f64 = 0.05;
const SPREAD_PER_S: f64 = 0.15;
/// Below this angle, rad, series stand for what would lose its digits.
const SMALL: f64 = 0.03;

/// Who lies: directions of the head, how far tilted, rad, and how far the hips may be from where they are looked for along the body, m.
const DIRECTIONS: usize = 8;
const LYING_RAD: f64 = 1.45;
const ALONG_M: [f64; 3] = [-0.4, 0.0, 0.4];
/// Who falls: how far tilted, rad, from which speed of the hips on, m/s, and how fast for that, rad/s by m/s, at most.
const FALLING_RAD: [f64; 3] = [0.35, 0.7, 1.05];
const FALLING_MPS: f64 = 0.35;
const PER_MPS: f64 = 1.2;
const FASTEST: f64 = 2.0;

/// Rounds in which a rotation is found, and the share of a round's step that is taken.
const ROUNDS: usize = 60;
const PACE: f64 = 1.6;

/// The numbers of a person's tilt: w (x, y) and ẇ (x, y).
pub(super) const NUMBERS: usize = 4;

/// A tilt at one time.
#[derive(Debug, Clone)]
pub(super) struct Tilt {
    /// s after the window's middle.
    t_s: f64,
    w: Vec3,
    rate: Vec3,
    /// exp([w]×)
    rotation: Mat3,
    /// J(w)
    jacobian: Mat3,
    /// ω, rad/s.
    spin: Vec3,
    /// What `jacobian` is made of, and how that changes with ‖w‖, by ‖w‖.
    series: Series,
}

/// (1 − cos θ)/θ² and (θ − sin θ)/θ³, and their derivatives by θ, divided by θ.
#[derive(Debug, Clone, Copy)]
struct Series {
    once: f64,
    twice: f64,
    once_by: f64,
    twice_by: f64,
}

impl Series {
    fn at(angle: f64) -> Self {
        let square = angle * angle;
        if angle < SMALL {
            return Self {
                once: 0.5 - square / 24.0 + square * square / 720.0,
                twice: 1.0 / 6.0 - square / 120.0 + square * square / 5040.0,
                once_by: -1.0 / 12.0 + square / 180.0 - square * square / 6720.0,
                twice_by: -1.0 / 60.0 + square / 1260.0 - square * square / 60_480.0,
            };
        }
        let (sine, cosine) = angle.sin_cos();
        let (less, rest) = (1.0 - cosine, angle - sine);
        Self {
            once: less / square,
            twice: rest / (square * angle),
            once_by: (angle * sine - 2.0 * less) / (square * square),
            twice_by: (angle * less - 3.0 * rest) / (square * square * angle),
        }
    }
}

impl Tilt {
    /// Of a person's [`NUMBERS`], at this time.
    pub(super) fn of(numbers: &[f64], t_s: f64) -> Self {
        let (w, rate) =
            ([numbers[0] + numbers[2] * t_s, numbers[1] + numbers[3] * t_s, 0.0], [numbers[2], numbers[3], 0.0]);
        let [a, b, _] = w;
        let square = a * a + b * b;
        let series = Series::at(square.sqrt());
        let Series { once, twice, .. } = series;
        // I + p [w]× + r [w]×², of a w that is horizontal.
        let mix = |p: f64, r: f64| {
            [
                [1.0 - r * b * b, r * a * b, p * b],
                [r * a * b, 1.0 - r * a * a, -p * a],
                [-p * b, p * a, 1.0 - r * square],
            ]
        };
        let jacobian = mix(once, twice);
        // sin θ/θ = 1 − θ² (θ − sin θ)/θ³
        Self {
            t_s,
            w,
            rate,
            rotation: mix(1.0 - square * twice, once),
            spin: mat_vec(&jacobian, rate),
            jacobian,
            series,
        }
    }

    /// How high a point is once it is turned: this times the point (the last row of the rotation).
    pub(super) fn upwards(&self) -> Vec3 {
        self.rotation[2]
    }

    /// A point of the body (X + η e_z), turned.
    pub(super) fn forwards(&self, p: Vec3) -> Vec3 {
        mat_vec(&self.rotation, p)
    }

    /// The adjoint of a point, as that of the point before it was turned.
    pub(super) fn backwards(&self, bar: Vec3) -> Vec3 {
        mat_t_vec(&self.rotation, bar)
    }

    /// The velocity of a turned point whose own velocity, turned, is `own`.
    pub(super) fn swept(&self, turned: Vec3, own: Vec3) -> Vec3 {
        add(own, cross(self.spin, turned))
    }

    /// The adjoint of a turned point which that of its velocity implies by being swept.
    pub(super) fn swept_back(&self, bar: Vec3) -> Vec3 {
        cross(bar, self.spin)
    }

    /// Adds to the bars of the [`NUMBERS`] what turning implies; `torque` is Σ u × ū over turned points u and their adjoints ū (own
    /// velocities, turned, and their adjoints among them).
    pub(super) fn pull_back(&self, torque: Vec3, bars: &mut [f64]) {
        let bar = mat_t_vec(&self.jacobian, torque);
        for k in 0..2 {
            bars[k] += bar[k];
            bars[2 + k] += self.t_s * bar[k];
        }
    }

    /// Adds what an adjoint g of ω implies: Σ u × v̄ over turned points and the adjoints of their velocities.
    pub(super) fn pull_back_spin(&self, g: Vec3, bars: &mut [f64]) {
        let (w, rate) = (self.w, self.rate);
        let Series { once, twice, once_by, twice_by } = self.series;
        let turned = cross(rate, g);
        let (along, onto, by_rate) = (dot(w, turned), dot(g, w), dot(g, rate));
        let across = dot(w, rate);
        let bent = onto * across - by_rate * dot(w, w);
        let by_w: [f64; 2] = std::array::from_fn(|k| {
            once_by * w[k] * along
                + once * turned[k]
                + twice_by * w[k] * bent
                + twice * (g[k] * across + rate[k] * onto - 2.0 * w[k] * by_rate)
        });
        let by_spin = mat_t_vec(&self.jacobian, g);
        for k in 0..2 {
            bars[k] += by_w[k];
            bars[2 + k] += self.t_s * by_w[k] + by_spin[k];
        }
    }
}

/// How unlikely a person's [`NUMBERS`] are; adds `gain` times the gradient.
pub(super) fn unlikeliness(numbers: &[f64], gain: f64, bars: &mut [f64]) -> f64 {
    let each = numbers.chunks_exact(2).zip(bars.chunks_exact_mut(2)).zip([SPREAD, SPREAD_PER_S]);
    each.map(|((of, bars), spread)| {
        let square = spread * spread + of[0] * of[0] + of[1] * of[1];
        let slope = 2.0 * gain / square;
        bars.iter_mut().zip(of).for_each(|(bar, x)| *bar += slope * x);
        (square / (spread * spread)).ln()
    })
    .sum()
}

/// exp([v]×), for any v.
fn exponential(v: Vec3) -> Mat3 {
    let [a, b, c] = v;
    let angle = norm(v);
    let Series { once, twice, .. } = Series::at(angle);
    let k = [[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]];
    let square = mat_mul(&k, &k);
    let sine = 1.0 - angle * angle * twice;
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)) + sine * k[i][j] + once * square[i][j]))
}

/// w of the rotation that makes `from` most like `to`, both about their means, before the heading that is left over.
pub(super) fn between(from: &[Vec3], to: &[Vec3]) -> [f64; 2] {
    let (a, b) = (mean(from), mean(to));
    let mut rotation = exponential([0.0; 3]);
    for _ in 0..ROUNDS {
        // The torque that pulls one onto the other, over more inertia than it meets.
        let (mut torque, mut inertia) = ([0.0; 3], f64::MIN_POSITIVE);
        for (p, q) in from.iter().zip(to) {
            let (p, q) = (mat_vec(&rotation, sub(*p, a)), sub(*q, b));
            torque = add(torque, cross(p, q));
            inertia += norm(p) * norm(q);
        }
        rotation = mat_mul(&exponential(scale(torque, PACE / inertia)), &rotation);
    }
    // R = R_z exp([w]×), so that e_z R is e_z exp([w]×).
    let [x, y, z] = rotation[2];
    let flat = x.hypot(y);
    let angle = flat.atan2(z);
    if flat > 1e-9 { [y * angle / flat, -x * angle / flat] } else { [0.0; 2] }
}

/// ω of a body at `joints` that moves with `velocities`, as nearly as it moves as one, rad/s.
pub(super) fn spin_of(joints: &[Vec3], velocities: &[Vec3]) -> Vec3 {
    let (a, b) = (mean(joints), mean(velocities));
    let (mut momentum, mut inertia) = ([0.0; 3], [[0.0; 3]; 3]);
    for (p, v) in joints.iter().zip(velocities) {
        let (p, v) = (sub(*p, a), sub(*v, b));
        momentum = add(momentum, cross(p, v));
        for i in 0..3 {
            inertia[i][i] += dot(p, p);
            for j in 0..3 {
                inertia[i][j] -= p[i] * p[j];
            }
        }
    }
    let [x, y, z] = inertia;
    let det = dot(x, cross(y, z));
    // Joints on a line spin about it as they like.
    if det < 1e-6 * (x[0] * y[1] * z[2]).max(f64::MIN_POSITIVE) {
        return [0.0; 3];
    }
    // The rows of the inverse of a symmetric matrix are the products of the others' rows.
    [cross(y, z), cross(z, x), cross(x, y)].map(|row| dot(row, momentum) / det)
}

/// Where the points of a body that moves as one are `dt_s` later.
pub(in crate::mhp) fn later(joints: &[Vec3], velocities: &[Vec3], dt_s: f64) -> Vec<Vec3> {
    let turn = exponential(scale(spin_of(joints, velocities), dt_s));
    let (from, way) = (mean(joints), scale(mean(velocities), dt_s));
    joints.iter().map(|&p| add(add(from, way), mat_vec(&turn, sub(p, from)))).collect()
}

/// A body that falls or lies, to begin with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fallen {
    /// Where the head is to, from the feet, on the floor, rad.
    head_rad: f64,
    /// ‖w‖, rad, and ‖ẇ‖, rad/s.
    tilt_rad: f64,
    rate: f64,
    /// About its own axis, rad; 0 on the front.
    side_rad: f64,
    /// How much nearer to the head than where they are looked for the hips are, m.
    pub(super) along_m: f64,
}

/// Bodies of a person who goes this way, m/s: lying any way round, and falling the way that it goes.
pub(super) fn fallen(way: Vec3) -> impl Iterator<Item = Fallen> {
    let lying = (0..DIRECTIONS).flat_map(|k| {
        let head_rad = TAU * k as f64 / DIRECTIONS as f64;
        ALONG_M.map(|along_m| Fallen { head_rad, tilt_rad: LYING_RAD, rate: 0.0, side_rad: 0.0, along_m })
    });
    let speed = way[0].hypot(way[1]);
    let (head_rad, rate) = (way[1].atan2(way[0]), (PER_MPS * speed).min(FASTEST));
    let falling = FALLING_RAD.into_iter().flat_map(move |tilt_rad| {
        [0.0, FRAC_PI_2, PI, PI + FRAC_PI_2].map(|side_rad| Fallen { head_rad, tilt_rad, rate, side_rad, along_m: 0.0 })
    });
    lying.chain(falling.filter(move |_| speed > FALLING_MPS))
}

impl Fallen {
    /// Gives a person of these coordinates the heading and the tilt.
    pub(super) fn place(&self, coordinates: &mut [f64]) {
        coordinates[YAW] = self.head_rad;
        coordinates[TILT..TILT + NUMBERS].copy_from_slice(&[0.0, self.tilt_rad, 0.0, self.rate]);
        roll(coordinates, self.side_rad);
    }

    /// Where the head is to.
    pub(super) fn towards(&self) -> Vec3 {
        [self.head_rad.cos(), self.head_rad.sin(), 0.0]
    }
}

/// Turns a person of these coordinates about its own axis: exp([w]×) R_z(α) = R_z(α) exp([R_z(−α) w]×).
pub(super) fn roll(coordinates: &mut [f64], angle_rad: f64) {
    coordinates[YAW] += angle_rad;
    let (sine, cosine) = angle_rad.sin_cos();
    for at in [TILT, TILT + 2] {
        let [x, y] = [coordinates[at], coordinates[at + 1]];
        (coordinates[at], coordinates[at + 1]) = (cosine * x + sine * y, cosine * y - sine * x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body of a few joints that is as long in each direction as another.
    const BODY: [Vec3; 5] = [[0.0, 0.1, 1.6], [0.1, 0.3, 1.3], [0.0, -0.3, 1.3], [0.1, 0.1, 0.0], [-0.1, -0.15, 0.1]];

    #[test]
    fn it_is_a_rotation_and_its_spin_is_that_of_its_points() {
        for numbers in [[0.0, 0.0, 0.3, -0.2], [0.01, 0.02, 1.0, 2.0], [0.4, -1.3, -0.7, 1.1], [2.0, 1.0, 0.0, 0.5]] {
            let at = |t_s: f64| Tilt::of(&numbers, t_s);
            let tilt = at(0.1);
            for p in BODY {
                let turned = tilt.forwards(p);
                assert!((norm(turned) - norm(p)).abs() < 1e-12);
                assert!(norm(sub(tilt.backwards(turned), p)) < 1e-12);
                assert!((dot(tilt.upwards(), p) - turned[2]).abs() < 1e-12);
                let slope = scale(sub(at(0.1 + 1e-6).forwards(p), at(0.1 - 1e-6).forwards(p)), 0.5e6);
                assert!(norm(sub(tilt.swept(turned, [0.0; 3]), slope)) < 1e-8, "{numbers:?}: {slope:?}");
            }
        }
    }

    #[test]
    fn the_adjoints_agree_with_central_differences() {
        let (bar, spin_bar) = ([0.4, -0.3, 0.8], [-0.2, 0.9, 0.5]);
        for numbers in
            [[0.001, -0.002, 0.3, -0.2], [0.02, 0.03, 1.0, 2.0], [0.4, -1.3, -0.7, 1.1], [2.0, 1.0, 0.0, 0.5]]
        {
            let value = |numbers: &[f64]| {
                let tilt = Tilt::of(numbers, 0.15);
                dot(bar, tilt.forwards(BODY[1]))
                    + dot(spin_bar, tilt.spin)
                    + unlikeliness(numbers, 0.0, &mut [0.0; NUMBERS])
            };
            let tilt = Tilt::of(&numbers, 0.15);
            let mut bars = [0.0; NUMBERS];
            tilt.pull_back(cross(tilt.forwards(BODY[1]), bar), &mut bars);
            tilt.pull_back_spin(spin_bar, &mut bars);
            unlikeliness(&numbers, 1.0, &mut bars);
            for (k, got) in bars.iter().enumerate() {
                let at = |offset: f64| {
                    let mut moved = numbers;
                    moved[k] += offset;
                    value(&moved)
                };
                let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
                assert!((got - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{numbers:?}, {k}: {got}, {slope}");
            }
        }
    }

    #[test]
    fn a_tilt_is_found_again_under_any_heading() {
        for (w, yaw) in [([0.0, 1.4], 0.3_f64), ([1.2, -0.9], 2.5), ([-1.5, 0.2], -1.9), ([0.0, 0.0], 1.0)] {
            let tilt = Tilt::of(&[w[0], w[1], 0.0, 0.0], 0.0);
            let (sine, cosine) = yaw.sin_cos();
            let there: Vec<Vec3> = BODY
                .iter()
                .map(|&p| tilt.forwards(p))
                .map(|[x, y, z]| [3.0 + cosine * x - sine * y, sine * x + cosine * y, z - 1.0])
                .collect();
            let found = between(&BODY, &there);
            assert!((found[0] - w[0]).hypot(found[1] - w[1]) < 0.02, "{w:?}: {found:?}");
            let spun: Vec<Vec3> = there.iter().map(|&p| add([0.1, 0.2, 0.0], cross([0.7, -0.4, 0.3], p))).collect();
            assert!(norm(sub(spin_of(&there, &spun), [0.7, -0.4, 0.3])) < 1e-9);
        }
    }
}
