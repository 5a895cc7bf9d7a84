//! What bodies stand on, where the radar's height above the floor is known.
//!
//! Maps tell the height of a body by a decimetre, and worse the darker its head or its feet are; the floor tells it to centimetres.
//! With z_fj the height of joint j of the tilted pose X_f(c) (`space.rs`) and ρ_j how thick the body is below it, both in sizes,
//!
//! ```text
//! m(c) = −1/κ ln(mean over the window's frames f of Σ_j e^(−κ (z_fj − ρ_j)))     how far down it reaches; κ = 100 a size
//! t_z  = z_floor − e^s m(c) + h
//! ```
//!
//! and h is the coordinate of the fit: a pose that bends its knees comes down with it. Bodies stand or lie on the floor, but they
//! jump, too, and sit on tables, so that L_prior has 2 δ² (√(1 + (h/(δ σ_h))²) − 1), δ = 2: a square of deviations near the floor, and a
//! slope beyond (pseudo-Huber).

use super::space::{BODY, LN_SIZE, MOST_COMPONENTS, TILT};
use super::tilt::{self, Tilt};
use crate::body::{Skeleton, is_named};
use crate::dense::add_rows;
use crate::geometry::{Vec3, cross, dot};
use smallvec::SmallVec;

/// κ, 1/sizes.
const SHARPNESS: f64 = 100.0;
/// σ_h, m, and δ.
const SPREAD_M: f64 = 0.05;
const BEND: f64 = 2.0;
/// ρ of what may touch the floor, sizes: half the thickness of a body there, and the height of an ankle above the sole.
const THICKNESS: [(&[&str], f64); 7] = [
    (&["ankle"], 0.060),
    (&["heel", "foot", "toe"], 0.020),
    (&["knee"], 0.050),
    (&["hip", "pelvis", "root"], 0.095),
    (&["shoulder"], 0.070),
    (&["elbow", "wrist", "hand"], 0.030),
    (&["ear", "head"], 0.075),
];
/// e to less than minus this is nothing beside 1.
const FARTHEST: f64 = 45.0;
/// A joint with a smaller share has no say in where a body touches the floor.
const NEGLIGIBLE: f64 = 1e-9;

/// The floor, and the joints that may touch it.
#[derive(Debug, Clone)]
pub(super) struct Ground {
    z_m: f64,
    /// Joints, and ρ of each.
    supports: Vec<(usize, f64)>,
    /// Of each frame where these joints are above the point between the feet, in the mean and in what each component adds:
    /// (1 + components, 3, supports), C order, sizes.
    places: Vec<Vec<f64>>,
    /// How far the hips of the mean are above that point, sizes.
    hips: f64,
}

/// How a body stands on the floor.
#[derive(Debug, Clone)]
pub(super) struct Contact {
    /// t_z − h, m.
    pub(super) z_m: f64,
    /// Its derivatives by s, by w and ẇ, and by c.
    by_size: f64,
    by_tilt: [f64; tilt::NUMBERS],
    by_pose: SmallVec<[f64; MOST_COMPONENTS]>,
}

/// How unlikely a height above the floor is, m, and its derivative.
pub(super) fn unlikeliness(height_m: f64) -> (f64, f64) {
    let off = height_m / (BEND * SPREAD_M);
    let root = (1.0 + off * off).sqrt();
    (2.0 * BEND * BEND * (root - 1.0), 2.0 * BEND * off / (SPREAD_M * root))
}

impl Ground {
    /// The floor at world z = `z_m`; `poses` are a row a frame of a mean and components, a point a joint of `skeleton` each, in sizes, the
    /// hips of the mean `hips` above the point between the feet. `None` where no joint has a name that says what a body stands on.
    pub(super) fn new(skeleton: &Skeleton, z_m: f64, (poses, hips): (&[Vec<Vec3>], f64)) -> Option<Self> {
        let joints = skeleton.joints.len();
        let below = |joint: usize| THICKNESS.iter().find(|(words, _)| is_named(skeleton, joint, words));
        let supports: Vec<(usize, f64)> = (0..joints).filter_map(|joint| Some((joint, below(joint)?.1))).collect();
        let places = |row: &Vec<Vec3>| -> Vec<f64> {
            let axes = |of: &[Vec3]| -> Vec<f64> {
                (0..3).flat_map(|axis| supports.iter().map(move |&(joint, _)| of[joint][axis])).collect()
            };
            let mut places: Vec<f64> = row.chunks_exact(joints).flat_map(axes).collect();
            places[2 * supports.len()..3 * supports.len()].iter_mut().for_each(|z| *z += hips);
            places
        };
        let places = if supports.is_empty() { return None } else { poses.iter().map(places).collect() };
        Some(Self { z_m, supports, places, hips })
    }

    /// How a person with these coordinates stands, tilted like this in each frame; who is upright in all has no slope by its tilt.
    pub(super) fn contact(&self, coordinates: &[f64], tilts: &[Tilt], upright: bool) -> Contact {
        let supports = self.supports.len();
        let one = 3 * supports;
        let components = self.places.first().map_or(0, |rows| rows.len() / one - 1);
        let (c, residual) = coordinates[BODY..].split_at(components);
        // Of who is upright heights alone decide.
        let first = if upright { 2 * supports } else { 0 };
        // Of nine frames of a dozen joints nothing is allocated.
        let mut found: SmallVec<[f64; 512]> = SmallVec::with_capacity(self.places.len() * one);
        self.places.iter().for_each(|rows| found.extend_from_slice(&rows[..one]));
        for (rows, at) in self.places.iter().zip(found.chunks_exact_mut(one)) {
            add_rows(at, &rows[one..], c, first);
        }
        if !residual.is_empty() {
            for at in found.chunks_exact_mut(one) {
                for (k, (joint, _)) in self.supports.iter().enumerate() {
                    (0..3).for_each(|axis| at[axis * supports + k] += residual[3 * joint + axis]);
                }
            }
        }
        let mut heights: SmallVec<[f64; 128]> = SmallVec::with_capacity(tilts.len() * supports);
        for (at, tilt) in found.chunks_exact(one).zip(tilts) {
            let up = tilt.upwards();
            for (k, (_, below)) in self.supports.iter().enumerate() {
                let at = [at[k], at[supports + k], at[2 * supports + k]];
                heights.push(if upright { at[2] } else { dot(up, at) } - self.hips - below);
            }
        }
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let total: f64 = heights.iter().map(|height| weight(height - lowest)).sum();
        let size_m = coordinates[LN_SIZE].exp();
        let reach_m = size_m * (lowest - (total / tilts.len().max(1) as f64).ln() / SHARPNESS);
        let mut by_pose = SmallVec::from_elem(0.0, c.len());
        let mut by_tilt = [0.0; tilt::NUMBERS];
        for (place, height) in heights.iter().enumerate() {
            let share = weight(height - lowest) / total;
            if share > NEGLIGIBLE {
                let (frame, k) = (place / supports, place % supports);
                let (rows, tilt) = (&self.places[frame], &tilts[frame]);
                let of = |at: &[f64]| [at[k], at[supports + k], at[2 * supports + k]];
                let up = tilt.upwards();
                for (by, row) in by_pose.iter_mut().zip(rows[one..].chunks_exact(one)) {
                    *by -= size_m * share * dot(up, of(row));
                }
                if !upright {
                    let at = of(&found[frame * one..]);
                    tilt.pull_back(cross(tilt.forwards(at), [0.0, 0.0, -size_m * share]), &mut by_tilt);
                }
            }
        }
        Contact { z_m: self.z_m - reach_m, by_size: -reach_m, by_tilt, by_pose }
    }
}

/// How much what is so far above the lowest, sizes, counts beside it; that of most is nothing.
fn weight(above: f64) -> f64 {
    let fall = SHARPNESS * above;
    if fall < FARTHEST { (-fall).exp() } else { 0.0 }
}

impl Contact {
    /// Adds to `bars` what ∂L/∂t_z implies for size, tilt and pose.
    pub(super) fn pull_back(&self, z_bar: f64, bars: &mut [f64]) {
        bars[LN_SIZE] += z_bar * self.by_size;
        bars[TILT..BODY].iter_mut().zip(&self.by_tilt).for_each(|(bar, by)| *bar += z_bar * by);
        bars[BODY..].iter_mut().zip(&self.by_pose).for_each(|(bar, by)| *bar += z_bar * by);
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests fail by panicking")]
mod tests {
    use super::*;

    /// Two frames of a body that stands on one ankle and then on the other, and a component that lifts the first in the first frame.
    fn ground() -> Ground {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let joints = skeleton.joints.len();
        let row = |low: usize, lifted: f64| -> Vec<Vec3> {
            let mut row = vec![[0.0, 0.0, 0.5]; joints];
            row[low][2] = -0.9;
            row.extend(vec![[0.0; 3]; joints]);
            row[joints + low][2] = lifted;
            row
        };
        Ground::new(&skeleton, -1.2, (&[row(15, 0.1), row(16, 0.0)], 0.9)).unwrap()
    }

    fn upright_tilts() -> [Tilt; 2] {
        [0.0, 0.1].map(|t_s| Tilt::of(&[0.0; tilt::NUMBERS], t_s))
    }

    fn at(ln_size: f64, c: f64) -> Vec<f64> {
        let mut coordinates = vec![0.0; BODY + 1];
        (coordinates[LN_SIZE], coordinates[BODY]) = (ln_size, c);
        coordinates
    }

    #[test]
    fn a_body_stands_with_its_sole_on_the_floor() {
        let ground = ground();
        let of = |ln_size, c| ground.contact(&at(ln_size, c), &upright_tilts(), true).z_m;
        assert!((of(0.0, 0.0) - (-1.2 + 0.96)).abs() < 1e-9, "{}", of(0.0, 0.0));
        assert!((of(0.1, 0.0) - (-1.2 + 0.96 * 0.1_f64.exp())).abs() < 1e-9);
        // With the first foot up by 0.2 it stands on the second alone, half of the frames.
        assert!((of(0.0, 2.0) - (-1.2 + 0.96)).abs() < 0.01, "{}", of(0.0, 2.0));
        // One that goes down takes the body up.
        assert!((of(0.0, -2.0) - (-1.2 + 1.16)).abs() < 0.01, "{}", of(0.0, -2.0));
        let mut unnamed = Skeleton::preset("coco17").unwrap();
        unnamed.joints.iter_mut().for_each(|name| *name = "nose".into());
        assert!(Ground::new(&unnamed, 0.0, (&[], 0.9)).is_none());
    }

    #[test]
    fn its_derivatives_agree_with_central_differences() {
        let ground = ground();
        for (ln_size, c) in [(0.0, 0.0), (0.1, 0.05), (-0.1, -0.08), (0.05, 1.0)] {
            let of = |ln_size, c| ground.contact(&at(ln_size, c), &upright_tilts(), true);
            let mut bars = at(0.0, 0.0);
            of(ln_size, c).pull_back(2.0, &mut bars);
            let h = 1e-6;
            let by_size = (of(ln_size + h, c).z_m - of(ln_size - h, c).z_m) / h;
            let by_pose = (of(ln_size, c + h).z_m - of(ln_size, c - h).z_m) / h;
            assert!((bars[LN_SIZE] - by_size).abs() < 1e-6, "{by_size}");
            assert!((bars[BODY] - by_pose).abs() < 1e-6, "{by_pose}");
        }
        // Nothing is left out of who stands upright.
        for (ln_size, c) in [(0.1, 0.05), (0.05, 1.0)] {
            let [short, long] = [true, false].map(|upright| ground.contact(&at(ln_size, c), &upright_tilts(), upright));
            assert!((short.z_m - long.z_m).abs() < 1e-12 && (short.by_pose[0] - long.by_pose[0]).abs() < 1e-12);
        }
        for height_m in [0.0, 0.03, -0.2] {
            let slope = (unlikeliness(height_m + 1e-6).0 - unlikeliness(height_m - 1e-6).0) / 2e-6;
            assert!((unlikeliness(height_m).1 - slope).abs() < 1e-4);
        }
        assert!((unlikeliness(0.02).0 - 0.16).abs() < 0.01 && unlikeliness(0.5).0 < 40.0, "a square, then a slope");
    }
}
