//! XRF55's stacks: `mmWave/01_<sequence>_<clip>.npy`, (17, 256, 128), and the truth of each map beside them.

use super::npz_frames::{COCO_JOINTS, StoredTruth};
use super::plan::{stack_path, stack_truth_path};
use crate::dataset::XRF55_STEPS;
use crate::dataset::npz::{ArrayView, write_deflated, write_npy};
use crate::simulate::Sequence;
use half::f16;
use rayon::prelude::*;
use std::path::Path;

/// Half floats end at 65504; amplitudes are divided by this for them.
const HALF_SCALE: f32 = 256.0;

pub(super) fn write(
    out: &Path,
    sequence: &Sequence,
    frames: usize,
    narrow: bool,
    done: &(impl Fn() + Sync),
) -> anyhow::Result<()> {
    for clip in 0..frames / XRF55_STEPS {
        let path = stack_path((out, sequence.index(), clip));
        let steps: Vec<usize> = (0..XRF55_STEPS).collect();
        let maps = steps
            .par_iter()
            .map(|&step| {
                let frame = sequence.frame(clip * XRF55_STEPS + step);
                write_deflated(&stack_truth_path(&path, step), &StoredTruth::of(&frame, COCO_JOINTS).arrays())?;
                done();
                Ok(frame.maps.into_iter().next().unwrap_or_default())
            })
            .collect::<anyhow::Result<Vec<Vec<f32>>>>()?;
        let shape = [XRF55_STEPS, 256, 128];
        let cells = maps.concat();
        if narrow {
            let halved: Vec<f16> = cells.iter().map(|&x| f16::from_f32(x / HALF_SCALE)).collect();
            write_npy(&path, &ArrayView::f16(&shape, &halved))?;
        } else {
            write_npy(&path, &ArrayView::f32(&shape, &cells))?;
        }
    }
    Ok(())
}
