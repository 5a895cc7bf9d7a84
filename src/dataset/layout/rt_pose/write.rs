//! `sequence_0001/npy/000000.npy`, cubes (z, y, x), with `Train.json`, `file_meta.txt` and `calib/calib.json`.

use super::RtPose;
use super::labels::{FILES, META};
use crate::dataset::DatasetError;
use crate::dataset::layout::write::{FrameWriter, NewFrame, NewPlace};
use crate::dataset::npz::{ArrayView, write_npy};
use crate::geometry::{Vec3, add, scale, sub};
use crate::output::replace_file;
use crate::radar::View;
use half::f16;
use std::path::{Path, PathBuf};

/// Half floats end at 65504; amplitudes are divided by this for them.
const HALF_SCALE: f32 = 256.0;
/// From the ears' middle to the crown, in lengths from the neck to it.
const CROWN: f64 = 1.6;

impl FrameWriter for RtPose {
    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf> {
        vec![path(at)]
    }

    /// Answers the frame's joints.
    fn write(
        &self,
        at: &NewPlace<'_>,
        views: &[View],
        frames: &[NewFrame<'_>],
        narrow: bool,
    ) -> Result<Option<String>, DatasetError> {
        let Some(frame) = frames.first() else { return Ok(None) };
        if let (Some(view), Some(map)) = (views.first(), frame.maps.first()) {
            if narrow {
                let halved: Vec<f16> = map.iter().map(|&x| f16::from_f32(x / HALF_SCALE)).collect();
                write_npy(&path(at), &ArrayView::f16(&view.shape(), &halved))?;
            } else {
                write_npy(&path(at), &ArrayView::f32(&view.shape(), map))?;
            }
        }
        let person = |joints: &Vec<Vec3>| {
            let pose = fifteen(joints).into_iter().map(|joint| joint.map(|x| x as f32)).collect::<Vec<_>>();
            serde_json::json!({ "Radar_frameID": format!("{:06}", at.number), "pose": pose })
        };
        let persons: Vec<serde_json::Value> = frame.joints.iter().map(person).collect();
        let text = serde_json::to_string(&persons);
        text.map(Some).map_err(|error| DatasetError::Write { reason: error.into(), path: at.root.to_owned() })
    }

    fn finish(&self, root: &Path, kept: &[Vec<String>]) -> Result<(), DatasetError> {
        let sequence = |(k, frames): (usize, &Vec<String>)| {
            let frames = frames.iter().enumerate().map(|(number, persons)| format!("\"{number:06}\":{persons}"));
            format!("\"{}\":{{{}}}", k + 1, frames.collect::<Vec<_>>().join(","))
        };
        let labels = kept.iter().enumerate().map(sequence).collect::<Vec<_>>().join(",\n");
        let names: Vec<String> = (0..kept.len()).map(|k| format!("{},{}", k + 1, name(k))).collect();
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let camera = [600.0, 0.0, 320.0, 0.0, 0.0, 600.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let calibration = serde_json::json!({
            "radar": { "extrinsic": identity },
            "left_cam": { "extrinsic": identity, "intrinsic": camera },
        });
        let folder = root.join("calib");
        std::fs::create_dir_all(&folder).map_err(|reason| DatasetError::Write { reason, path: folder.clone() })?;
        let files = [
            (root.join(FILES[0]), format!("{{{labels}}}")),
            (root.join(META), names.join("\n") + "\n"),
            (folder.join("calib.json"), calibration.to_string()),
        ];
        files.into_iter().try_for_each(|(path, text)| {
            let written = replace_file(&path, |out| out.write_all(text.as_bytes()));
            written.map_err(|reason| DatasetError::Write { reason, path })
        })
    }

    fn has_own_joints(&self) -> bool {
        true
    }
}

fn name(sequence: usize) -> String {
    format!("sequence_{:04}", sequence + 1)
}

fn path(at: &NewPlace<'_>) -> PathBuf {
    at.root.join(name(at.sequence)).join("npy").join(format!("{:06}.npy", at.number))
}

/// COCO's seventeen joints as RT-Pose's fifteen.
fn fifteen(coco: &[Vec3]) -> Vec<Vec3> {
    let at = |joint: usize| coco.get(joint).copied().unwrap_or_default();
    let middle = |a: usize, b: usize| scale(add(at(a), at(b)), 0.5);
    let thorax = middle(5, 6);
    let head = add(thorax, scale(sub(middle(3, 4), thorax), CROWN));
    let legs = [12, 14, 16, 11, 13, 15].map(at);
    let arms = [5, 7, 9, 6, 8, 10].map(at);
    [vec![middle(11, 12)], legs.to_vec(), vec![thorax, head], arms.to_vec()].concat()
}
