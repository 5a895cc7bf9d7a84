//! `d1s1/000/00000_{radar,bbox,pose,meta}.npz`, and `_truth` beside them. No masks.

use super::{CAMERA, IMAGE_SIZE, Mmvr};
use crate::dataset::DatasetError;
use crate::dataset::layout::write::{
    COCO_JOINTS, FrameWriter, NewFrame, NewPlace, SKIN_M, TruthArrays, image_box, map_box, named, pixel, rounded_maps,
};
use crate::dataset::npz::{ArrayView, NpzError, write_deflated};
use crate::geometry::Vec3;
use crate::radar::View;
use std::path::PathBuf;

impl FrameWriter for Mmvr {
    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf> {
        ["radar", "bbox", "pose", "meta", "truth"].map(|kind| path(at, kind)).to_vec()
    }

    fn write(
        &self,
        at: &NewPlace<'_>,
        views: &[View],
        frames: &[NewFrame<'_>],
        _narrow: bool,
    ) -> Result<Option<String>, DatasetError> {
        frames.iter().try_for_each(|frame| write_frame(at, views, frame))?;
        Ok(None)
    }
}

fn path(at: &NewPlace<'_>, kind: &str) -> PathBuf {
    at.root.join("d1s1").join(format!("{:03}", at.sequence)).join(format!("{:05}_{kind}.npz", at.number))
}

fn write_frame(at: &NewPlace<'_>, views: &[View], frame: &NewFrame<'_>) -> Result<(), NpzError> {
    write_deflated(&path(at, "radar"), &named(views, &rounded_maps(frame)))?;

    let people = frame.joints.len();
    let narrow = |numbers: Vec<f64>| -> Vec<f32> { numbers.into_iter().map(|x| x as f32).collect() };
    let with_score = |joints: &Vec<Vec3>| {
        let [x0, y0, x1, y1] = image_box(&CAMERA, IMAGE_SIZE, joints);
        [x0, y0, x1, y1, 1.0]
    };
    let image = narrow(frame.joints.iter().flat_map(with_score).collect());
    let on_maps: Vec<Vec<f32>> = views
        .iter()
        .map(|view| narrow(frame.joints.iter().flat_map(|joints| map_box(view, joints, SKIN_M)).collect()))
        .collect();
    let mut boxes = vec![("bbox_i", ArrayView::f32(&[people, 5], &image))];
    for (key, numbers) in ["bbox_hori", "bbox_vert"].into_iter().zip(&on_maps) {
        boxes.push((key, ArrayView::f32(&[people, 4], numbers)));
    }
    write_deflated(&path(at, "bbox"), &boxes)?;

    let point = |&joint: &Vec3| {
        let [x, y] = pixel(&CAMERA, joint);
        [x, y, 1.0]
    };
    let points = narrow(frame.joints.iter().flatten().flat_map(point).collect());
    write_deflated(&path(at, "pose"), &[("kp", ArrayView::f32(&[people, COCO_JOINTS, 3], &points))])?;
    let id = format!("{:05}", at.number);
    write_deflated(&path(at, "meta"), &[("global_frame_id", ArrayView::text(&id))])?;
    write_deflated(&path(at, "truth"), &TruthArrays::of(frame, COCO_JOINTS).arrays())
}
