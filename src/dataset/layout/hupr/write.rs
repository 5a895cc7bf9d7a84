//! `single_<k>/{hori,vert}/NNNNNNNNN.npy`, `hrnet_annot_train.json`, and `truth/` beside the cubes, its joints in HuPR's order of
//! fourteen.

use super::annotations::IMAGE_SIZE;
use super::{Hupr, LEVELS, RADARS};
use crate::dataset::DatasetError;
use crate::dataset::layout::write::{FrameWriter, NewFrame, NewPlace, TruthArrays, image_box, pixel};
use crate::dataset::npz::{ArrayView, NpzError, write_deflated, write_npy};
use crate::geometry::{Vec3, add, scale, sub};
use crate::output::replace_file;
use crate::radar::{PinholeCamera, View};
use num_complex::Complex32;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// HuPR's calibration is not published: 60° are taken.
const CAMERA: PinholeCamera = PinholeCamera { focal_px: [221.7, 221.7], centre_px: [128.0, 128.0] };
/// From the nose's height to the crown: HuPR's head is the top of the head, COCO has the ears.
const CROWN: f64 = 1.6;
/// The joints of HuPR's skeleton.
const JOINTS: usize = 14;

/// One frame of the annotations.
#[derive(Debug, Serialize)]
struct Block {
    image: String,
    joints: Vec<[f32; 2]>,
    bbox: [f32; 4],
}

impl FrameWriter for Hupr {
    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf> {
        let cubes = RADARS.map(|radar| path(at, radar, "npy"));
        cubes.into_iter().chain([path(at, "truth", "npz")]).collect()
    }

    /// Answers the frame's block of the annotations.
    fn write(
        &self,
        at: &NewPlace<'_>,
        views: &[View],
        frames: &[NewFrame<'_>],
        narrow: bool,
    ) -> Result<Option<String>, DatasetError> {
        let Some(frame) = frames.first() else { return Ok(None) };
        for (view, cube) in views.iter().zip(frame.cubes) {
            write_cube(&path(at, &view.array, "npy"), &[view.shape(), vec![LEVELS]].concat(), cube, narrow)?;
        }
        let reduced = |persons: &[Vec<Vec3>]| persons.iter().map(|joints| fourteen(joints)).collect::<Vec<_>>();
        let (joints, velocities) = (reduced(frame.joints), reduced(frame.velocities));
        let truth = NewFrame { joints: &joints, velocities: &velocities, ..*frame };
        write_deflated(&path(at, "truth", "npz"), &TruthArrays::of(&truth, JOINTS).arrays())?;
        // One person a frame: HuPR has no more.
        let Some(joints) = joints.first() else { return Ok(None) };
        let block = Block {
            image: format!("{:09}.jpg", at.number),
            joints: joints.iter().map(|&joint| pixel(&CAMERA, joint).map(|x| x as f32)).collect(),
            bbox: image_box(&CAMERA, IMAGE_SIZE, joints).map(|x| x as f32),
        };
        let reason = |error: serde_json::Error| DatasetError::Write { reason: error.into(), path: labels(at.root) };
        serde_json::to_string(&block).map(Some).map_err(reason)
    }

    /// The annotations of all sequences, in the order of their folders.
    fn finish(&self, root: &Path, kept: &[Vec<String>]) -> Result<(), DatasetError> {
        let sequences: Vec<String> = kept.iter().map(|blocks| format!("[{}]", blocks.join(","))).collect();
        let (text, path) = (format!("[{}]", sequences.join(",")), labels(root));
        let written = replace_file(&path, |out| out.write_all(text.as_bytes()));
        written.map_err(|reason| DatasetError::Write { reason, path: path.clone() })
    }

    fn has_own_joints(&self) -> bool {
        true
    }
}

/// `single_1/<part>/000000000.<ending>`; sequences count from 1.
fn path(at: &NewPlace<'_>, part: &str, ending: &str) -> PathBuf {
    at.root.join(format!("single_{}", at.sequence + 1)).join(part).join(format!("{:09}.{ending}", at.number))
}

fn labels(root: &Path) -> PathBuf {
    root.join("hrnet_annot_train.json")
}

fn write_cube(path: &Path, shape: &[usize], cube: &[num_complex::Complex64], narrow: bool) -> Result<(), NpzError> {
    if !narrow {
        return write_npy(path, &ArrayView::complex128(shape, cube));
    }
    let halved: Vec<Complex32> = cube.iter().map(|x| Complex32::new(x.re as f32, x.im as f32)).collect();
    write_npy(path, &ArrayView::complex64(shape, &halved))
}

/// COCO's seventeen joints, or their velocities, as HuPR's fourteen.
fn fourteen(coco: &[Vec3]) -> Vec<Vec3> {
    let at = |joint: usize| coco.get(joint).copied().unwrap_or_default();
    let middle = |a: usize, b: usize| scale(add(at(a), at(b)), 0.5);
    let neck = middle(5, 6);
    let head = add(neck, scale(sub(middle(3, 4), neck), CROWN));
    let limbs = |joints: &[usize]| joints.iter().map(|&joint| at(joint)).collect::<Vec<_>>();
    [limbs(&[12, 14, 16, 11, 13, 15]), vec![neck, head], limbs(&[5, 7, 9, 6, 8, 10])].concat()
}
