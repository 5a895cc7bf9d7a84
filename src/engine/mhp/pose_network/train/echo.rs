//! What a radar sees of a lesson's scene: echoes of points of skin, coherent, spread by range and angle.
//!
//! It is drawn anew for each lesson what a radar is like: widths, sidelobes, noise, how much of what stands still is left, ghosts by
//! way of walls and floor, furniture and walls, another person. The network is to learn what these have in common. Parts of bodies
//! hide what is behind them, their own far side as well as walls.

use super::super::glimpse::{ACROSS, RANGES, UP, across_m, range_m, up_m};
use super::super::layers::JOINTS;
use super::motion::{Stretch, trunk};
use crate::body::Capsule;
use crate::geometry::{Vec3, add, add_scaled, cross, dot, mean, norm, scale, sub};
use rand::{Rng, rngs::StdRng};
use rand_distr::{Distribution as _, StandardNormal};
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

/// m
const WAVELENGTH_M: f64 = 0.0039;
/// Echoes are summed apart by radial velocity, in bins as wide as this, m/s, of so many; the next again.
const DOPPLER_MPS: f64 = 0.25;
const DOPPLERS: usize = 3;
/// Points of skin of the person, and of somebody beside.
const POINTS: usize = 150;
const POINTS_BESIDE: usize = 100;
/// Limbs: joints at the ends, radius, m, how far they reach beyond the second joint, m (hands), and share of the points.
const LIMBS: [([usize; 2], f64, f64, f64); 8] = [
    ([5, 7], 0.045, 0.0, 0.06),
    ([7, 9], 0.038, 0.12, 0.06),
    ([6, 8], 0.045, 0.0, 0.06),
    ([8, 10], 0.038, 0.12, 0.06),
    ([11, 13], 0.075, 0.0, 0.10),
    ([13, 15], 0.05, 0.0, 0.08),
    ([12, 14], 0.075, 0.0, 0.10),
    ([14, 16], 0.05, 0.0, 0.08),
];
/// Trunk and head: radii to the side and to the front, m, share of the points and gain.
const TRUNK: ([f64; 2], f64, f64) = ([0.17, 0.115], 0.34, 1.25);
const HEAD: ([f64; 2], f64, f64) = ([0.075, 0.09], 0.08, 0.9);
/// Feet: knees and ankles, half their width and height, m, how far heel and toe are before the ankle, and the sole below it, m, share of
/// the points of one, and gain, by the shoe.
const FEET: [[usize; 2]; 2] = [[13, 15], [14, 16]];
const FOOT: ([f64; 2], f64, [f64; 2]) = ([0.042, 0.035], 0.03, [0.5, 1.7]);
const HEEL_TOE_M: [f64; 2] = [-0.05, 0.17];
const SOLE_M: f64 = 0.035;
const PARTS: usize = LIMBS.len() + 2 + FEET.len();
/// Pieces of furniture at most, reflectors of one, and of walls.
const PIECES: usize = 5;
const OF_PIECE: usize = 6;
const OF_WALLS: usize = 60;
/// Columns of both planes.
const COLUMNS: usize = ACROSS + UP;
/// How far the kernel of the angle is tabled, in widths, and its steps a width.
const REACH: f64 = 40.0;
const STEPS: f64 = 16.0;
/// Beyond so many widths nothing is left along the range.
const RANGE_REACH: f64 = 4.0;

/// Powers about a place in a frame: ([`RANGES`], [`COLUMNS`]), C order.
pub(super) type Frame = Vec<f32>;

/// A radar and its surroundings.
pub(super) struct Radar {
    range_m: f64,
    angle_rad: f64,
    /// The angle's kernel, by distance in widths.
    kernel: Vec<f32>,
    /// What is left of what stands still, amplitude, and how long a frame lasts, s.
    still: f64,
    frame_s: f64,
    doppler_phase: f64,
    /// Amplitude by way of a wall, its lateral place, m, and by way of the floor.
    wall: f64,
    wall_m: f64,
    floor: f64,
    height_m: f64,
    /// Distance at which echoes have the amplitude 1, m.
    unit_m: f64,
    /// Reflectors: place, m, and amplitude.
    standing: Vec<(Vec3, f64)>,
}

/// Something that echoes.
#[derive(Clone, Copy)]
pub(super) struct Echo {
    range: f64,
    sines: [f64; 2],
    amplitude: f64,
    doppler: usize,
}

/// Share of the amplitude from `at` that what hides it lets through.
fn passes(hiding: &[Capsule], at: Vec3) -> f64 {
    hiding.iter().map(|capsule| capsule.lets_through(at)).product()
}

fn exponential(rng: &mut StdRng) -> f64 {
    -(rng.random_range(1e-9..1.0_f64)).ln()
}

impl Radar {
    /// One before a person about `place`, m, on a floor so far below it, m.
    pub(super) fn draw(place: [f64; 2], height_m: f64, rng: &mut StdRng) -> Self {
        let [x, y] = place;
        let distance = x.hypot(y);
        let still = if rng.random_bool(0.12) { 1.0 } else { rng.random_range(0.0..0.4) };
        let ghost = |rng: &mut StdRng| if rng.random_bool(0.5) { 0.0 } else { rng.random_range(0.03..0.25) };
        let (wall, floor) = (ghost(rng), ghost(rng));
        let side = |rng: &mut StdRng| if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let wall_m = y + side(rng) * rng.random_range(0.6..3.0);
        let mut standing = Vec::new();
        for _ in 0..rng.random_range(0..PIECES) {
            let at = [
                x + rng.random_range(-1.5..1.5),
                y + rng.random_range(-1.5..1.5),
                rng.random_range(0.3..1.3) - height_m,
            ];
            let loud = rng.random_range(0.3..3.0);
            for _ in 0..OF_PIECE {
                let off = [0; 3].map(|_| rng.random_range(-0.25..0.25));
                standing.push((add(at, off), loud * exponential(rng).sqrt()));
            }
        }
        if rng.random_bool(0.6) {
            let y = y + side(rng) * rng.random_range(1.2..3.0);
            let loud = 10.0_f64.powf(rng.random_range(-1.0..0.7));
            let nearest = if rng.random_bool(0.5) { distance + rng.random_range(-0.9..0.9) } else { 0.0 };
            for _ in 0..OF_WALLS {
                let range = (distance + rng.random_range(-0.9..0.9)).max(nearest);
                let z = rng.random_range(-height_m..1.6);
                let y = y.clamp(-0.95 * range, 0.95 * range);
                let x = (range * range - y * y - z * z).max(0.01).sqrt();
                standing.push(([x, y, z], loud * exponential(rng).sqrt()));
            }
        }
        let sidelobe = rng.random_range(0.0..0.045_f32);
        let kernel = tables().iter().map(|[lobe, beside]| lobe + sidelobe * beside).collect();
        Self {
            range_m: rng.random_range(0.03..0.055),
            angle_rad: rng.random_range(0.04..0.065),
            kernel,
            still,
            frame_s: rng.random_range(0.004..0.012),
            doppler_phase: rng.random_range(0.0..1.0),
            wall,
            wall_m,
            floor,
            height_m,
            unit_m: distance,
            standing,
        }
    }

    /// What it sees of the reflectors behind somebody.
    pub(super) fn standing(&self, hiding: &[Capsule]) -> Vec<Echo> {
        let of = |&(at, amplitude): &(Vec3, f64)| {
            let range = norm(at).max(0.1);
            let amplitude = self.still * amplitude * passes(hiding, at);
            Echo { range, sines: [at[1] / range, at[2] / range], amplitude, doppler: 0 }
        };
        self.standing.iter().map(of).collect()
    }

    /// Adds the power of echoes, summed coherently, about a place (distance, m, and sine of the azimuth).
    pub(super) fn add(&self, echoes: &[Echo], (distance, sine): (f64, f64), to: &mut Frame) {
        let mut fields = vec![[0.0_f32; 2]; DOPPLERS * RANGES * COLUMNS];
        let mut row = [0.0_f32; COLUMNS];
        for echo in echoes {
            if echo.amplitude == 0.0 {
                continue;
            }
            let (phase_sin, phase_cos) = (2.0 * TAU * echo.range / WAVELENGTH_M).sin_cos();
            let [re, im] = [echo.amplitude * phase_cos, echo.amplitude * phase_sin].map(|x| x as f32);
            for (j, kernel) in row.iter_mut().enumerate() {
                let (grid, seen) = match j.checked_sub(ACROSS) {
                    None => (sine + across_m(j) / distance, echo.sines[0]),
                    Some(j) => (up_m(j) / distance, echo.sines[1]),
                };
                let at = (((grid - seen) / self.angle_rad).abs() * STEPS).min(REACH * STEPS - 1.0) as usize;
                *kernel = self.kernel[at];
            }
            let fields = &mut fields[echo.doppler * RANGES * COLUMNS..(echo.doppler + 1) * RANGES * COLUMNS];
            for (i, fields) in fields.chunks_exact_mut(COLUMNS).enumerate() {
                let off = (distance + range_m(i) - echo.range) / self.range_m;
                if off.abs() > RANGE_REACH {
                    continue;
                }
                let lobe = (-0.5 * off * off).exp() as f32;
                let (re, im) = (re * lobe, im * lobe);
                for (field, kernel) in fields.iter_mut().zip(&row) {
                    field[0] += re * kernel;
                    field[1] += im * kernel;
                }
            }
        }
        for of_doppler in fields.chunks_exact(RANGES * COLUMNS) {
            to.iter_mut().zip(of_doppler).for_each(|(power, [re, im])| *power += re * re + im * im);
        }
    }
}

/// The main lobe and what lies beside it, by distance in widths.
fn tables() -> &'static [[f32; 2]] {
    static TABLES: OnceLock<Vec<[f32; 2]>> = OnceLock::new();
    TABLES.get_or_init(|| {
        let of = |k: usize| {
            let off = (k as f64 + 0.5) / STEPS;
            let lobe = (-0.5 * off * off).exp();
            [lobe as f32, ((1.9 * off).cos() * (1.0 - lobe)) as f32]
        };
        (0..(REACH * STEPS) as usize).map(of).collect()
    })
}

/// Points of a body's skin.
pub(super) struct Skin {
    points: Vec<Point>,
    girth: f64,
    /// Power of the cosine of the incidence.
    cosine: f64,
}

struct Point {
    part: usize,
    along: f64,
    around: (f64, f64),
    amplitude: f64,
}

impl Skin {
    pub(super) fn draw(beside: bool, rng: &mut StdRng) -> Self {
        let gains: [f64; PARTS] = std::array::from_fn(|_| {
            let drawn: f64 = StandardNormal.sample(rng);
            1.0 + (0.15 * drawn).clamp(-0.4, 0.4)
        });
        let shares: Vec<f64> =
            LIMBS.iter().map(|limb| limb.3).chain([TRUNK.1, HEAD.1]).chain(FEET.map(|_| FOOT.1)).collect();
        let shod = rng.random_range(FOOT.2[0]..FOOT.2[1]);
        let sum: f64 = shares.iter().sum();
        let point = |rng: &mut StdRng| {
            let mut drawn = rng.random_range(0.0..sum);
            let part = shares.iter().position(|share| {
                drawn -= share;
                drawn < 0.0
            });
            let part = part.unwrap_or(PARTS - 1);
            let gain = match part.checked_sub(LIMBS.len()) {
                None => 1.0,
                Some(0) => TRUNK.2,
                Some(1) => HEAD.2,
                Some(_) => shod,
            };
            let around = rng.random_range(0.0..TAU).sin_cos();
            let amplitude = gains[part] * gain * exponential(rng).sqrt();
            Point { part, along: rng.random_range(0.0..1.0), around, amplitude }
        };
        let points = (0..if beside { POINTS_BESIDE } else { POINTS }).map(|_| point(rng)).collect();
        Self { points, girth: rng.random_range(0.85..1.25), cosine: rng.random_range(0.5..1.5) }
    }

    /// What hides what is behind a pose.
    pub(super) fn hiding(&self, pose: &[Vec3; JOINTS]) -> impl Iterator<Item = Capsule> {
        let girth = self.girth;
        parts(pose, &[[0.0; 3]; JOINTS])
            .into_iter()
            .map(move |part| Capsule { ends: part.ends, radius_m: girth * f64::midpoint(part.radii[0], part.radii[1]) })
    }

    /// Echoes of the skin of a pose with these velocities, m/s, as far as nothing hides them.
    pub(super) fn echoes(
        &self,
        radar: &Radar,
        (pose, velocity): (&[Vec3; JOINTS], &[Vec3; JOINTS]),
        hiding: &[Capsule],
    ) -> Vec<Echo> {
        let parts = parts(pose, velocity);
        let mut echoes = Vec::with_capacity(2 * self.points.len());
        for (k, point) in self.points.iter().enumerate() {
            let part = &parts[point.part];
            let radii = part.radii.map(|radius| radius * self.girth);
            let mix = |[a, b]: [Vec3; 2]| add(scale(a, 1.0 - point.along), scale(b, point.along));
            let (sin, cos) = point.around;
            let (mut at, mut normal) = (mix(part.ends), scale(part.across[0], cos / radii[0]));
            add_scaled(&mut at, part.across[0], cos * radii[0]);
            add_scaled(&mut at, part.across[1], sin * radii[1]);
            add_scaled(&mut normal, part.across[1], sin / radii[1]);
            let range = norm(at).max(0.2);
            let sight = scale(at, 1.0 / range);
            let faces = -dot(normal, sight) / norm(normal);
            if faces <= 0.0 {
                continue;
            }
            let radial = dot(mix(part.moves), sight);
            let turns = 2.0 * radial * radar.frame_s / WAVELENGTH_M;
            let kept = if turns.abs() < 1e-6 { 1.0 } else { ((PI * turns).sin() / (PI * turns)).powi(2) };
            let heard = (1.0 - kept + radar.still * radar.still * kept).sqrt();
            let near = (radar.unit_m / range).powi(2);
            let seen = faces.powf(self.cosine) * passes(hiding, at);
            let amplitude = point.amplitude * seen * heard * near;
            let bin = (radial / DOPPLER_MPS + radar.doppler_phase).floor() as i64;
            let doppler = bin.rem_euclid(DOPPLERS as i64) as usize;
            echoes.push(Echo { range, sines: [at[1] / range, at[2] / range], amplitude, doppler });
            if k % 3 != 0 {
                continue;
            }
            // A ghost has a third of the points, which are louder.
            let by_wall = (radar.wall, [at[0], 2.0 * radar.wall_m - at[1], at[2]]);
            let by_floor = (radar.floor, [at[0], at[1], -2.0 * radar.height_m - at[2]]);
            for (share, image) in [by_wall, by_floor] {
                let far = norm(image);
                let [y, z] = [image[1] / far, image[2] / far];
                let amplitude = 1.7 * share * amplitude;
                echoes.push(Echo { range: 0.5 * (range + far), sines: [y, z], amplitude, doppler });
            }
        }
        echoes
    }
}

/// A part of a body.
struct Part {
    ends: [Vec3; 2],
    moves: [Vec3; 2],
    /// To its side and to its front.
    across: [Vec3; 2],
    radii: [f64; 2],
}

fn unit(a: Vec3) -> Vec3 {
    scale(a, 1.0 / norm(a).max(1e-6))
}

fn parts(pose: &[Vec3; JOINTS], velocity: &[Vec3; JOINTS]) -> [Part; PARTS] {
    let left = unit(sub(add(pose[5], pose[11]), add(pose[6], pose[12])));
    let part = |ends: [Vec3; 2], moves: [Vec3; 2], radii: [f64; 2]| {
        let along = unit(sub(ends[1], ends[0]));
        let mut side = left;
        add_scaled(&mut side, along, -dot(left, along));
        let side = unit(side);
        Part { ends, moves, across: [side, cross(along, side)], radii }
    };
    let middle = |of: &[Vec3; JOINTS], a: usize, b: usize| mean(&[of[a], of[b]]);
    std::array::from_fn(|k| match k.checked_sub(LIMBS.len()) {
        None => {
            let ([a, b], radius, beyond_m, _) = LIMBS[k];
            let mut end = pose[b];
            add_scaled(&mut end, unit(sub(pose[b], pose[a])), beyond_m);
            part([pose[a], end], [velocity[a], velocity[b]], [radius; 2])
        }
        Some(0) => {
            let of = |of: &[Vec3; JOINTS]| [middle(of, 11, 12), middle(of, 5, 6)];
            part(of(pose), of(velocity), TRUNK.0)
        }
        Some(1) => {
            let [head, neck] = [middle(pose, 3, 4), middle(pose, 5, 6)];
            let up = unit(sub(head, neck));
            let (mut low, mut top) = (head, head);
            add_scaled(&mut low, up, -0.1);
            add_scaled(&mut top, up, 0.13);
            part([low, top], [middle(velocity, 3, 4); 2], HEAD.0)
        }
        Some(foot) => {
            let [knee, ankle] = FEET[foot - 2];
            let down = unit(sub(pose[ankle], pose[knee]));
            let ahead = unit(cross(down, sub(pose[11], pose[12])));
            let end = |ahead_m: f64| add(pose[ankle], add(scale(ahead, ahead_m), scale(down, SOLE_M)));
            part(HEEL_TOE_M.map(end), [velocity[ankle]; 2], FOOT.0)
        }
    })
}

/// Somebody else so that their trunk, at this sample, is beside `place`.
pub(super) fn beside(stretch: &Stretch, middle: usize, place: [f64; 2], rng: &mut StdRng) -> Vec3 {
    let at = trunk(&stretch[middle]);
    let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
    let apart = rng.random_range(0.45..1.3);
    [place[0] + apart * cos - at[0], place[1] + apart * sin - at[1], 0.0]
}

#[cfg(test)]
mod tests {
    use super::super::super::MIRRORED;
    use super::*;
    use rand::SeedableRng as _;

    /// Somebody who stands at (3, 0) and looks back at the radar, left and right as they are there.
    fn facing() -> [Vec3; JOINTS] {
        let mut pose = [[3.0, 0.0, 0.6]; JOINTS];
        let halves =
            [(5, 0.19, 0.4), (7, 0.25, 0.12), (9, 0.25, -0.1), (11, 0.1, -0.08), (13, 0.1, -0.5), (15, 0.1, -0.9)];
        for (joint, aside, up) in halves {
            pose[joint] = [3.0, -aside, up];
            pose[MIRRORED[joint]] = [3.0, aside, up];
        }
        (pose[3], pose[4]) = ([3.0, -0.07, 0.62], [3.0, 0.07, 0.62]);
        pose
    }

    #[test]
    fn toes_point_where_somebody_looks_and_hands_go_on_from_forearms() {
        let parts = parts(&facing(), &[[0.0; 3]; JOINTS]);
        for foot in &parts[LIMBS.len() + 2..] {
            let [heel, toe] = foot.ends;
            assert!((heel[0] - 3.05).abs() < 1e-9 && (toe[0] - 2.83).abs() < 1e-9, "{heel:?} {toe:?}");
            assert!((toe[2] + 0.9 + SOLE_M).abs() < 1e-9);
        }
        assert!((parts[1].ends[1][2] + 0.1 + 0.12).abs() < 1e-9, "{:?}", parts[1].ends);
    }

    #[test]
    fn a_body_hides_the_wall_behind_it_and_nothing_beside_it() {
        let rng = &mut StdRng::seed_from_u64(3);
        let pose = facing();
        let hiding: Vec<Capsule> = Skin::draw(false, rng).hiding(&pose).collect();
        assert_eq!(hiding.len(), PARTS);
        let mut radar = Radar::draw([3.0, 0.0], 1.0, rng);
        radar.still = 1.0;
        radar.standing = vec![([4.0, 0.0, 0.2], 1.0), ([4.0, 1.0, 0.2], 1.0), ([2.0, 0.0, 0.2], 1.0)];
        let [behind, beside, before] = [0, 1, 2].map(|k| radar.standing(&hiding)[k].amplitude);
        assert!(behind < 0.2 && beside == 1.0 && before == 1.0, "{behind} {beside} {before}");
    }
}
