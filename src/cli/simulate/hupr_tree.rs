//! HuPR's folders: `single_<k>/{hori,vert}/NNNNNNNNN.npy`, `hrnet_annot_train.json`, and `truth/` beside the cubes, its joints in
//! HuPR's order of fourteen.

use super::image::HUPR;
use super::npz_frames::StoredTruth;
use super::plan::{FramePlace, hupr_path};
use crate::dataset::npz::{ArrayView, write_deflated, write_npy};
use crate::geometry::{Vec3, add, scale, sub};
use crate::output::replace_file;
use crate::simulate::{Device, HUPR_SHAPE, RawFrame, SimulatedFrame, hupr_cube};
use anyhow::Context as _;
use num_complex::Complex32;
use serde::Serialize;
use std::path::Path;

/// One frame of the annotations.
#[derive(Debug, Serialize)]
pub(super) struct Block {
    image: String,
    joints: Vec<[f32; 2]>,
    bbox: [f32; 4],
}

/// The annotations of a sequence.
pub(super) type Annotations = Vec<Block>;

/// From the nose's height to the crown: HuPR's head is the top of the head, COCO has the ears.
const CROWN: f64 = 1.6;

pub(super) fn write(
    place: FramePlace<'_>,
    device: &Device,
    raw: &RawFrame,
    frame: &SimulatedFrame,
    narrow: bool,
) -> anyhow::Result<Option<Block>> {
    for (radar, adc) in device.radars.iter().zip(&raw.cubes) {
        let cube = hupr_cube(adc);
        let path = hupr_path(place, radar.name, "npy");
        if narrow {
            let halved: Vec<Complex32> = cube.iter().map(|x| Complex32::new(x.re as f32, x.im as f32)).collect();
            write_npy(&path, &ArrayView::complex64(&HUPR_SHAPE, &halved))?;
        } else {
            write_npy(&path, &ArrayView::complex128(&HUPR_SHAPE, &cube))?;
        }
    }
    let reduced = |persons: &[Vec<Vec3>]| persons.iter().map(|joints| fourteen(joints)).collect();
    let truth =
        SimulatedFrame { joints: reduced(&frame.joints), velocities: reduced(&frame.velocities), ..frame.clone() };
    write_deflated(&hupr_path(place, "truth", "npz"), &StoredTruth::of(&truth, 14).arrays())?;
    // One person a frame: HuPR has no more.
    Ok(truth.joints.first().map(|joints| Block {
        image: format!("{:09}.jpg", place.2),
        joints: joints.iter().map(|&joint| HUPR.pixel(joint).map(|x| x as f32)).collect(),
        bbox: HUPR.bounds(joints).map(|x| x as f32),
    }))
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

/// The annotations of all sequences, in the order of their folders.
pub(super) fn write_annotations(out: &Path, sequences: &[Annotations]) -> anyhow::Result<()> {
    let path = out.join("hrnet_annot_train.json");
    let text = serde_json::to_string(sequences)?;
    let written = replace_file(&path, |out| out.write_all(text.as_bytes()));
    written.with_context(|| format!("{}: cannot be written", path.display()))
}
