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
use crate::geometry::{Vec3, add_scaled, cross, dot};
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
/// A joint with a smaller share has no say in where a body touches the floor.
const NEGLIGIBLE: f64 = 1e-9;

/// The floor, and the joints that may touch it.
#[derive(Debug, Clone)]
pub(super) struct Ground {
    z_m: f64,
    /// Joints, and ρ of each.
    supports: Vec<(usize, f64)>,
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
    /// The floor at world z = `z_m`; `None` where no joint has a name that says what a body stands on.
    pub(super) fn new(skeleton: &Skeleton, z_m: f64) -> Option<Self> {
        let below = |joint: usize| THICKNESS.iter().find(|(words, _)| is_named(skeleton, joint, words));
        let supports: Vec<(usize, f64)> =
            (0..skeleton.joints.len()).filter_map(|joint| Some((joint, below(joint)?.1))).collect();
        (!supports.is_empty()).then_some(Self { z_m, supports })
    }

    /// How a person with these coordinates stands; `poses` are a row a frame of a mean and components of `joints` joints each, in sizes,
    /// and how the frame is tilted about what is `hips` below.
    pub(super) fn contact(
        &self,
        coordinates: &[f64],
        (poses, tilts): (&[Vec<Vec3>], &[Tilt]),
        joints: usize,
        hips: f64,
    ) -> Contact {
        let components = poses.first().map_or(0, |row| row.len() / joints - 1);
        let (c, residual) = coordinates[BODY..].split_at(components);
        let reaches = |row: &[Vec3], tilt: &Tilt, &(joint, below): &(usize, f64)| -> (Vec3, f64) {
            let mut at = row[joint];
            at[2] += hips;
            residual.iter().skip(3 * joint).zip(&mut at).for_each(|(r, at)| *at += r);
            c.iter().enumerate().for_each(|(k, &c)| add_scaled(&mut at, row[(k + 1) * joints + joint], c));
            (at, dot(tilt.upwards(), at) - hips - below)
        };
        let all =
            || poses.iter().zip(tilts).flat_map(|(row, tilt)| self.supports.iter().map(move |of| (row, tilt, of)));
        let found: SmallVec<[(Vec3, f64); 96]> = all().map(|(row, tilt, of)| reaches(row, tilt, of)).collect();
        let lowest = found.iter().map(|(_, height)| *height).fold(f64::INFINITY, f64::min);
        let weight = |height: f64| (-SHARPNESS * (height - lowest)).exp();
        let total: f64 = found.iter().map(|(_, height)| weight(*height)).sum();
        let size_m = coordinates[LN_SIZE].exp();
        let reach_m = size_m * (lowest - (total / poses.len().max(1) as f64).ln() / SHARPNESS);
        let mut by_pose = SmallVec::from_elem(0.0, c.len());
        let mut by_tilt = [0.0; tilt::NUMBERS];
        for ((row, tilt, (joint, _)), (at, height)) in all().zip(&found) {
            let share = weight(*height) / total;
            if share > NEGLIGIBLE {
                let up = tilt.upwards();
                for (k, by) in by_pose.iter_mut().enumerate() {
                    *by -= size_m * share * dot(up, row[(k + 1) * joints + joint]);
                }
                tilt.pull_back(cross(tilt.forwards(*at), [0.0, 0.0, -size_m * share]), &mut by_tilt);
            }
        }
        Contact { z_m: self.z_m - reach_m, by_size: -reach_m, by_tilt, by_pose }
    }
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
    fn ground() -> (Ground, Vec<Vec<Vec3>>, usize) {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let joints = skeleton.joints.len();
        let row = |low: usize, lifted: f64| -> Vec<Vec3> {
            let mut row = vec![[0.0, 0.0, 0.5]; joints];
            row[low][2] = -0.9;
            row.extend(vec![[0.0; 3]; joints]);
            row[joints + low][2] = lifted;
            row
        };
        (Ground::new(&skeleton, -1.2).unwrap(), vec![row(15, 0.1), row(16, 0.0)], joints)
    }

    fn upright() -> [Tilt; 2] {
        [0.0, 0.1].map(|t_s| Tilt::of(&[0.0; tilt::NUMBERS], t_s))
    }

    fn at(ln_size: f64, c: f64) -> Vec<f64> {
        let mut coordinates = vec![0.0; BODY + 1];
        (coordinates[LN_SIZE], coordinates[BODY]) = (ln_size, c);
        coordinates
    }

    #[test]
    fn a_body_stands_with_its_sole_on_the_floor() {
        let (ground, poses, joints) = ground();
        let of = |ln_size, c| ground.contact(&at(ln_size, c), (&poses, &upright()), joints, 0.9).z_m;
        assert!((of(0.0, 0.0) - (-1.2 + 0.96)).abs() < 1e-9, "{}", of(0.0, 0.0));
        assert!((of(0.1, 0.0) - (-1.2 + 0.96 * 0.1_f64.exp())).abs() < 1e-9);
        // With the first foot up by 0.2 it stands on the second alone, half of the frames.
        assert!((of(0.0, 2.0) - (-1.2 + 0.96)).abs() < 0.01, "{}", of(0.0, 2.0));
        // One that goes down takes the body up.
        assert!((of(0.0, -2.0) - (-1.2 + 1.16)).abs() < 0.01, "{}", of(0.0, -2.0));
        let mut unnamed = Skeleton::preset("coco17").unwrap();
        unnamed.joints.iter_mut().for_each(|name| *name = "nose".into());
        assert!(Ground::new(&unnamed, 0.0).is_none());
    }

    #[test]
    fn its_derivatives_agree_with_central_differences() {
        let (ground, poses, joints) = ground();
        for (ln_size, c) in [(0.0, 0.0), (0.1, 0.05), (-0.1, -0.08), (0.05, 1.0)] {
            let of = |ln_size, c| ground.contact(&at(ln_size, c), (&poses, &upright()), joints, 0.9);
            let mut bars = at(0.0, 0.0);
            of(ln_size, c).pull_back(2.0, &mut bars);
            let h = 1e-6;
            let by_size = (of(ln_size + h, c).z_m - of(ln_size - h, c).z_m) / h;
            let by_pose = (of(ln_size, c + h).z_m - of(ln_size, c - h).z_m) / h;
            assert!((bars[LN_SIZE] - by_size).abs() < 1e-6, "{by_size}");
            assert!((bars[BODY] - by_pose).abs() < 1e-6, "{by_pose}");
        }
        for height_m in [0.0, 0.03, -0.2] {
            let slope = (unlikeliness(height_m + 1e-6).0 - unlikeliness(height_m - 1e-6).0) / 2e-6;
            assert!((unlikeliness(height_m).1 - slope).abs() < 1e-4);
        }
        assert!((unlikeliness(0.02).0 - 0.16).abs() < 0.01 && unlikeliness(0.5).0 < 40.0, "a square, then a slope");
    }
}
