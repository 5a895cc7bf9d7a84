//! `WALK/{HORIZONTAL,VERTICAL}_HEATMAPS/EE_GG/FFFF.npy`, the labels of each group, and `rooms-stated.toml`, where the radars of each
//! environment are. No silhouettes: they would be 2 MB a frame. Ten sequences make an environment; the joints are in the room's
//! frame, whose y points up as HIBER's does.

use super::labels::GroupLabels;
use super::tree::HEATMAPS;
use super::{FOLDERS, Hiber};
use crate::dataset::DatasetError;
use crate::dataset::layout::write::{FrameWriter, NewFrame, NewPlace, SKIN_M, map_box, pixel};
use crate::dataset::npz::{ArrayView, write_npy};
use crate::dataset::room::{RoomTransform, write_stated_rooms};
use crate::geometry::{Pose, Vec3, add, mat_mul, rotation_from_quaternion, scale};
use crate::radar::{PinholeCamera, View};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Sequences of an environment.
const GROUPS: usize = 10;
/// A camera of 62°, as those of the data set have.
const CAMERA: PinholeCamera = PinholeCamera { focal_px: [1365.0, 1365.0], centre_px: [820.0, 624.0] };
/// The name of the file that says where the radars are.
const STATED: &str = "rooms-stated.toml";

/// The labels of a frame.
#[derive(Debug, Serialize, Deserialize)]
struct Labels {
    joints: Vec<Vec<Vec3>>,
    pixels: Vec<Vec<[f64; 2]>>,
    /// On each map, column 0, row 0, column 1, row 1.
    boxes: [Vec<[f64; 4]>; 2],
}

impl FrameWriter for Hiber {
    fn files(&self, at: &NewPlace<'_>) -> Vec<PathBuf> {
        let maps = HEATMAPS.map(|part| path(at, part));
        maps.into_iter().chain(labels_of(at.root, at.sequence).files()).collect()
    }

    /// Answers the frame's labels.
    fn write(
        &self,
        at: &NewPlace<'_>,
        views: &[View],
        frames: &[NewFrame<'_>],
        narrow: bool,
    ) -> Result<Option<String>, DatasetError> {
        let Some(frame) = frames.first() else { return Ok(None) };
        for ((view, cube), part) in views.iter().zip(frame.cubes).zip(HEATMAPS) {
            let numbers: Vec<f64> = cube.iter().map(|x| x.re).collect();
            let shape = [vec![numbers.len() / view.cells().max(1)], view.shape()].concat();
            if narrow {
                let halved: Vec<f32> = numbers.iter().map(|&x| x as f32).collect();
                write_npy(&path(at, part), &ArrayView::f32(&shape, &halved))?;
            } else {
                write_npy(&path(at, part), &ArrayView::f64(&shape, &numbers))?;
            }
        }
        let radar: Vec<Vec<Vec3>> = frame.joints.iter().map(|joints| fourteen(joints)).collect();
        let room = room_of(environment(at.sequence)).radar_from_room;
        let boxes = |k: usize| {
            let of = |joints: &Vec<Vec3>| views.get(k).map_or([0.0; 4], |view| map_box(view, joints, SKIN_M));
            frame.joints.iter().map(of).collect()
        };
        let labels = Labels {
            joints: radar
                .iter()
                .map(|joints| joints.iter().map(|&joint| room.world_from_view(joint)).collect())
                .collect(),
            pixels: radar.iter().map(|joints| joints.iter().map(|&joint| pixel(&CAMERA, joint)).collect()).collect(),
            boxes: [boxes(0), boxes(1)],
        };
        let failed = |error: serde_json::Error| DatasetError::Write { reason: error.into(), path: at.root.to_owned() };
        serde_json::to_string(&labels).map(Some).map_err(failed)
    }

    /// The labels of each group, and where the radars are.
    fn finish(&self, root: &Path, kept: &[Vec<String>]) -> Result<(), DatasetError> {
        for (sequence, frames) in kept.iter().enumerate() {
            let failed = |error: serde_json::Error| DatasetError::Write { reason: error.into(), path: root.to_owned() };
            let labels: Vec<Labels> =
                frames.iter().map(|text| serde_json::from_str(text)).collect::<Result<_, _>>().map_err(failed)?;
            write_labels(&labels_of(root, sequence), &labels)?;
        }
        let environments = kept.len().div_ceil(GROUPS);
        let rooms: Vec<RoomTransform> = (1..=environments).map(room_of).collect();
        write_stated_rooms(&root.join(STATED), &rooms)
    }

    fn has_own_joints(&self) -> bool {
        true
    }
}

fn write_labels(group: &GroupLabels, labels: &[Labels]) -> Result<(), DatasetError> {
    let persons = labels.first().map_or(0, |labels| labels.joints.len());
    let [joints_file, pixels_file, horizontal, vertical] = group.files();
    let joints: Vec<f64> = labels.iter().flat_map(|labels| labels.joints.iter().flatten().flatten().copied()).collect();
    write_npy(&joints_file, &ArrayView::f64(&[labels.len(), persons, 14, 3], &joints))?;
    let pixels: Vec<f64> = labels.iter().flat_map(|labels| labels.pixels.iter().flatten().flatten().copied()).collect();
    write_npy(&pixels_file, &ArrayView::f64(&[labels.len(), persons, 14, 2], &pixels))?;
    for (k, file) in [horizontal, vertical].into_iter().enumerate() {
        let boxes: Vec<f64> = labels.iter().flat_map(|labels| labels.boxes[k].iter().flatten().copied()).collect();
        write_npy(&file, &ArrayView::f64(&[labels.len(), persons, 4], &boxes))?;
    }
    Ok(())
}

fn environment(sequence: usize) -> usize {
    sequence / GROUPS + 1
}

/// `01_05`.
fn group(sequence: usize) -> String {
    format!("{:02}_{:02}", environment(sequence), sequence % GROUPS + 1)
}

fn labels_of(root: &Path, sequence: usize) -> GroupLabels {
    GroupLabels::new(&root.join("WALK"), &group(sequence))
}

fn path(at: &NewPlace<'_>, part: &str) -> PathBuf {
    debug_assert!(FOLDERS.contains(&part));
    at.root.join("WALK").join(part).join(group(at.sequence)).join(format!("{:04}.npy", at.number))
}

/// Where the radar of an environment is: a few metres from the origin of the room, which lies on the floor where people are, turned
/// any way about the vertical and tilted by up to three degrees; the same for the same number.
fn room_of(environment: usize) -> RoomTransform {
    // splitmix64 of the number.
    let drawn = |k: u64| {
        let mut x = (environment as u64 * 16 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let about = |axis: Vec3, angle: f64| {
        let [x, y, z] = scale(axis, (0.5 * angle).sin());
        rotation_from_quaternion([(0.5 * angle).cos(), x, y, z])
    };
    // The room's y up becomes the radar's z up.
    let upright = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let turned = about([0.0, 0.0, 1.0], std::f64::consts::TAU * drawn(0));
    let tilted =
        mat_mul(&about([0.0, 1.0, 0.0], 0.1 * (drawn(1) - 0.5)), &about([1.0, 0.0, 0.0], 0.1 * (drawn(2) - 0.5)));
    let translation = [1.5 + 1.5 * drawn(3), 1.5 * drawn(4) - 0.75, 0.3 * drawn(5) - 1.15];
    RoomTransform {
        environment: format!("{environment:02}"),
        radar_from_room: Pose { rotation: mat_mul(&tilted, &mat_mul(&turned, &upright)), translation },
        residual_m: None,
        frames: None,
    }
}

/// COCO's seventeen joints as HIBER's fourteen.
fn fourteen(coco: &[Vec3]) -> Vec<Vec3> {
    let at = |joint: usize| coco.get(joint).copied().unwrap_or_default();
    let neck = scale(add(at(5), at(6)), 0.5);
    let limbs = [6, 8, 10, 5, 7, 9, 12, 14, 16, 11, 13, 15].map(at);
    [vec![at(0), neck], limbs.to_vec()].concat()
}
