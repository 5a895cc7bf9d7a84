//! How long bones are for the size of a body.
//!
//! A space of poses that is linear does not keep bones as long as they are: between two poses a limb is shorter than in either,
//! and where maps say little of a limb its bones shrink. L_prior therefore has a part for the bones between shoulders, elbows,
//! wrists, hips, knees and ankles,
//!
//! ```text
//! mean over frames and bones of ((l/(e^s λ) − 1)/σ_b)²,  σ_b = 0.12 in a search and 0.05 in a fit,  λ = ℓ/size of the skeleton's reference lengths
//! ```
//!
//! across the trunk no farther from those of real people than tables of segments may be ([`TRUNK`]), the size of a body being that
//! of the prior (`body::MotionPrior`): of its height, 0.635. Of a skeleton it is the height at which
//! the long bones that it has are as long together as Winter's. It asks nothing of s: a larger body has longer bones.

use super::LN_SIZE;
use super::space::Detail;
use crate::body::{Skeleton, is_named};
use crate::geometry::{Vec3, add_scaled, norm, sub};

/// How far a bone is from its length, share of it, standard deviation: a search passes between poses, and few components shorten
/// bones between them.
fn spread(detail: Detail) -> f64 {
    match detail {
        Detail::Search => 0.12,
        Detail::Fit => 0.05,
    }
}

/// Sizes of a height.
const SIZES: f64 = 0.635;
/// The ends of long bones and their length, heights; Winter, *Biomechanics and Motor Control of Human Movement*.
const LONG: [([&str; 2], f64); 4] =
    [(["shoulder", "elbow"], 0.186), (["elbow", "wrist"], 0.146), (["hip", "knee"], 0.245), (["knee", "ankle"], 0.246)];
/// How many times longer or shorter than what real people have taught a bone across the trunk may be said to be: tables of segments
/// have hips and shoulders as wide as the body is there, which is far more than from joint to joint.
const TRUNK: f64 = 1.15;
/// Joints between which bones are rigid.
const RIGID: [&str; 6] = ["shoulder", "elbow", "wrist", "hip", "knee", "ankle"];

/// The bones of a skeleton that are rigid, as long as bodies of size 1 have them.
#[derive(Debug, Clone)]
pub(super) struct Proportions {
    bones: Vec<([usize; 2], f64)>,
    /// σ_b
    spread: f64,
}

impl Proportions {
    /// Of the skeleton's reference lengths, across the trunk no farther than [`TRUNK`] from those of `mean`, its joints in the prior's
    /// mean pose, sizes; no bones where it has no long one.
    pub(super) fn of(skeleton: &Skeleton, mean: &[Vec3], detail: Detail) -> Self {
        let is = |joint: usize, name: &str| is_named(skeleton, joint, &[name]);
        let joins = |[a, b]: [usize; 2], [from, to]: [&str; 2]| is(a, from) && is(b, to) || is(b, from) && is(a, to);
        let all = || skeleton.bones.iter().copied().zip(skeleton.bone_lengths_m.iter().copied());
        let (found, expected) = all()
            .filter_map(|(bone, length_m)| Some((length_m, LONG.iter().find(|(ends, _)| joins(bone, *ends))?.1)))
            .fold((0.0, 0.0), |(found, expected), (length_m, heights)| (found + length_m, expected + heights));
        let size_m = SIZES * found / expected;
        if !size_m.is_finite() || size_m <= 0.0 {
            return Self { bones: Vec::new(), spread: spread(detail) };
        }
        let rigid = |joint: usize| RIGID.iter().any(|name| is(joint, name));
        let bones =
            all().filter(|&([a, b], length_m)| rigid(a) && rigid(b) && length_m > 0.0).map(|(bone, length_m)| {
                let limb = LONG.iter().any(|(ends, _)| joins(bone, *ends));
                let taught = norm(sub(mean[bone[0]], mean[bone[1]]));
                let sizes = length_m / size_m;
                (bone, if limb { sizes } else { sizes.clamp(taught / TRUNK, taught * TRUNK) })
            });
        Self { bones: bones.collect(), spread: spread(detail) }
    }

    /// How far the bones of `pose` (m) are from those of a body with these coordinates, mean square in standard deviations; adds
    /// `gain` times its gradient to the adjoints of the pose and of the coordinates.
    pub(super) fn misfit(
        &self,
        coordinates: &[f64],
        pose: &[Vec3],
        gain: f64,
        (pose_bar, bars): (&mut [Vec3], &mut [f64]),
    ) -> f64 {
        let size_m = coordinates[LN_SIZE].exp();
        let share = 1.0 / (self.bones.len().max(1) as f64 * self.spread * self.spread);
        let mut sum = 0.0;
        for &([a, b], sizes) in &self.bones {
            let along = sub(pose[a], pose[b]);
            let (length_m, wanted_m) = (norm(along).max(1e-9), size_m * sizes);
            let off = length_m / wanted_m - 1.0;
            sum += share * off * off;
            let slope = 2.0 * gain * share * off / wanted_m;
            add_scaled(&mut pose_bar[a], along, slope / length_m);
            add_scaled(&mut pose_bar[b], along, -slope / length_m);
            bars[LN_SIZE] -= slope * length_m;
        }
        sum
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests fail by panicking")]
mod tests {
    use super::super::space::PoseSpace;
    use super::*;
    use crate::body::MotionPrior;

    fn of(skeleton: &Skeleton) -> Proportions {
        let prior = MotionPrior::committed().unwrap();
        PoseSpace::new(prior, skeleton, &[0.0], None, Detail::Search).unwrap().proportions
    }

    /// Winter's hips are 0.191 of a height wide, people's 0.11 from joint to joint.
    #[test]
    fn no_trunk_is_wider_than_people_are() {
        for name in ["coco17", "h36m17", "hupr14", "hiber14", "rt_pose15"] {
            let skeleton = Skeleton::preset(name).unwrap();
            let proportions = of(&skeleton);
            let across = |part: &str| {
                let both = |bone: &[usize; 2]| bone.iter().all(|&joint| is_named(&skeleton, joint, &[part]));
                proportions.bones.iter().find(|(bone, _)| both(bone)).map(|(_, sizes)| SIZES * sizes)
            };
            let within =
                |heights: Option<f64>, range: std::ops::Range<f64>| heights.is_none_or(|of| range.contains(&of));
            assert!(within(across("hip"), 0.10..0.14), "{name}: {:?}", across("hip"));
            assert!(within(across("shoulder"), 0.17..0.24), "{name}: {:?}", across("shoulder"));
        }
        assert!(of(&Skeleton::preset("hiber14").unwrap()).bones.len() > 8, "hips are compared");
    }

    #[test]
    fn every_named_skeleton_has_limbs_of_its_size() {
        for name in ["coco17", "h36m17", "hupr14"] {
            let skeleton = Skeleton::preset(name).unwrap();
            let proportions = of(&skeleton);
            assert!(proportions.bones.len() >= 8, "{name}: {}", proportions.bones.len());
            let thigh = proportions.bones.iter().find(|(bone, _)| {
                bone.iter().any(|&j| is_named(&skeleton, j, &["hip"]))
                    && bone.iter().any(|&j| is_named(&skeleton, j, &["knee"]))
            });
            let sizes = thigh.map_or(0.0, |(_, sizes)| *sizes);
            assert!((sizes - 0.245 / SIZES).abs() < 0.01, "{name}: {sizes}");
        }
    }

    #[test]
    fn a_body_of_any_size_with_its_bones_fits_and_one_with_short_limbs_does_not() {
        let skeleton = Skeleton::preset("coco17").unwrap();
        let proportions = of(&skeleton);
        // A star in which every bone stands alone has any length that is wanted.
        let misfit = |scale: f64, ln_size: f64| {
            let (bone, sizes) = proportions.bones[0];
            let one = Proportions { bones: vec![(bone, sizes)], spread: proportions.spread };
            let mut pose = vec![[0.0; 3]; skeleton.joints.len()];
            pose[bone[0]] = [0.0, scale * sizes, 0.0];
            one.misfit(&[0.0, 0.0, 0.0, 0.0, ln_size], &pose, 0.0, (&mut pose.clone(), &mut [0.0; 5]))
        };
        assert!(misfit(1.0, 0.0) < 1e-12);
        assert!(misfit(1.2, 1.2_f64.ln()) < 1e-12);
        assert!((misfit(0.76, 0.0) - 4.0).abs() < 1e-9, "two standard deviations");
    }
}
