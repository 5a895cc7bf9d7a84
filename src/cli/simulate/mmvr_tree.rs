//! MMVR's own folders: `d1s1/000/00000_{radar,bbox,pose,meta}.npz`, and `_truth` beside them. No masks.

use super::image::MMVR;
use super::npz_frames::{COCO_JOINTS, StoredTruth, rounded};
use super::plan::{FramePlace, mmvr_path};
use crate::dataset::npz::{ArrayView, write_deflated};
use crate::geometry::Vec3;
use crate::radar::View;
use crate::simulate::SimulatedFrame;

/// Skin beyond the joints, m.
const MARGIN_M: f64 = 0.10;

pub(super) fn write(place: FramePlace<'_>, views: &[View], frame: &SimulatedFrame) -> anyhow::Result<()> {
    let maps: Vec<Vec<f32>> = frame.maps.iter().map(|map| map.iter().map(|&x| rounded(x)).collect()).collect();
    let radar: Vec<(&str, ArrayView<'_>)> =
        views.iter().zip(&maps).map(|(view, map)| (&*view.array, ArrayView::f32(&view.shape(), map))).collect();
    write_deflated(&mmvr_path(place, "radar"), &radar)?;

    let people = frame.joints.len();
    let narrow = |numbers: Vec<f64>| -> Vec<f32> { numbers.into_iter().map(|x| x as f32).collect() };
    let image = narrow(
        frame
            .joints
            .iter()
            .flat_map(|joints| {
                let [x0, y0, x1, y1] = MMVR.bounds(joints);
                [x0, y0, x1, y1, 1.0]
            })
            .collect(),
    );
    let on_maps: Vec<Vec<f32>> = views
        .iter()
        .map(|view| narrow(frame.joints.iter().flat_map(|joints| map_box(view, joints)).collect()))
        .collect();
    let mut boxes = vec![("bbox_i", ArrayView::f32(&[people, 5], &image))];
    for (key, numbers) in ["bbox_hori", "bbox_vert"].into_iter().zip(&on_maps) {
        boxes.push((key, ArrayView::f32(&[people, 4], numbers)));
    }
    write_deflated(&mmvr_path(place, "bbox"), &boxes)?;

    let points = narrow(
        frame
            .joints
            .iter()
            .flatten()
            .flat_map(|&joint| {
                let [x, y] = MMVR.pixel(joint);
                [x, y, 1.0]
            })
            .collect(),
    );
    write_deflated(&mmvr_path(place, "pose"), &[("kp", ArrayView::f32(&[people, 17, 3], &points))])?;
    let id = format!("{:05}", place.2);
    write_deflated(&mmvr_path(place, "meta"), &[("global_frame_id", ArrayView::text(&id))])?;
    write_deflated(&mmvr_path(place, "truth"), &StoredTruth::of(frame, COCO_JOINTS).arrays())?;
    Ok(())
}

/// The box about a body on a view's map: column 0, row 0, column 1, row 1.
fn map_box(view: &View, joints: &[Vec3]) -> [f64; 4] {
    let bins: Vec<Vec<f64>> = joints.iter().map(|&joint| view.bins_of(joint)).collect();
    let span = |axis: usize| {
        let (margin, last) = view.axes.get(axis).map_or((0.0, 0.0), |a| (MARGIN_M / a.step().abs(), a.bins as f64));
        let values = bins.iter().filter_map(|bins| bins.get(axis).copied());
        let low = values.clone().fold(f64::INFINITY, f64::min) - margin;
        let high = values.fold(f64::NEG_INFINITY, f64::max) + margin;
        [low.clamp(0.0, last), high.clamp(0.0, last)]
    };
    let ([row0, row1], [column0, column1]) = (span(0), span(1));
    [column0, row0, column1, row1]
}
