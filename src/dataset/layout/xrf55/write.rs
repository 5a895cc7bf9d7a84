//! `mmWave/01_<sequence>_<clip>.npy`, (17, range, azimuth), and the truth of each map beside them.

use super::{STEPS, Xrf55, truth_path};
use crate::dataset::DatasetError;
use crate::dataset::layout::write::{COCO_JOINTS, FrameWriter, NewFrame, NewPlace, TruthArrays};
use crate::dataset::npz::{ArrayView, write_deflated, write_npy};
use crate::radar::View;
use half::f16;
use rayon::prelude::*;
use std::path::PathBuf;

/// Half floats end at 65504; amplitudes are divided by this for them.
const HALF_SCALE: f32 = 256.0;

impl FrameWriter for Xrf55 {
    fn frames_a_file(&self) -> usize {
        STEPS
    }

    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf> {
        let path = path(at);
        vec![truth_path(&path, at.number % STEPS), path]
    }

    fn write(
        &self,
        at: &NewPlace<'_>,
        views: &[View],
        frames: &[NewFrame<'_>],
        narrow: bool,
    ) -> Result<Option<String>, DatasetError> {
        let path = path(at);
        frames.par_iter().enumerate().try_for_each(|(step, frame)| {
            write_deflated(&truth_path(&path, step), &TruthArrays::of(frame, COCO_JOINTS).arrays())
        })?;
        let shape = [vec![frames.len()], views.first().map(View::shape).unwrap_or_default()].concat();
        let cells: Vec<f32> = frames.iter().filter_map(|frame| frame.maps.first()).flatten().copied().collect();
        if narrow {
            let halved: Vec<f16> = cells.iter().map(|&x| f16::from_f32(x / HALF_SCALE)).collect();
            write_npy(&path, &ArrayView::f16(&shape, &halved))?;
        } else {
            write_npy(&path, &ArrayView::f32(&shape, &cells))?;
        }
        Ok(None)
    }
}

/// `mmWave/01_01_01.npy`: volunteer, action, repetition; twenty repetitions an action.
fn path(at: &NewPlace<'_>) -> PathBuf {
    at.root.join("mmWave").join(format!("01_{:02}_{:02}.npy", at.sequence + 1, at.number / STEPS + 1))
}
