//! The camera beside the radar: joints as pixels, for layouts whose labels are those of images. It looks along x from the radar's place,
//! without distortion.

use crate::geometry::Vec3;

/// A pinhole camera.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImageCamera {
    /// px.
    pub(super) focal: f64,
    /// Image centre (x, y), px.
    pub(super) centre: [f64; 2],
    /// Width and height, px.
    pub(super) size: [f64; 2],
}

/// MMVR's, from its published calibration.
pub(super) const MMVR: ImageCamera = ImageCamera { focal: 379.476, centre: [322.457, 241.627], size: [640.0, 480.0] };
/// HuPR's images are 256 px square; its calibration is not published, 60° are taken.
pub(super) const HUPR: ImageCamera = ImageCamera { focal: 221.7, centre: [128.0, 128.0], size: [256.0, 256.0] };
/// Skin beyond the joints, m.
const MARGIN_M: f64 = 0.10;

impl ImageCamera {
    /// A point of the world as (x to the right, y down), px.
    pub(super) fn pixel(&self, p: Vec3) -> [f64; 2] {
        let depth = p[0].max(0.05);
        [self.centre[0] - self.focal * p[1] / depth, self.centre[1] - self.focal * p[2] / depth]
    }

    /// The box about a body, clipped to the image: x0, y0, x1, y1 px.
    pub(super) fn bounds(&self, joints: &[Vec3]) -> [f64; 4] {
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for &joint in joints {
            let margin = self.focal * MARGIN_M / joint[0].max(0.05);
            let [x, y] = self.pixel(joint);
            bounds = [
                bounds[0].min(x - margin),
                bounds[1].min(y - margin),
                bounds[2].max(x + margin),
                bounds[3].max(y + margin),
            ];
        }
        let [width, height] = self.size;
        [
            bounds[0].clamp(0.0, width),
            bounds[1].clamp(0.0, height),
            bounds[2].clamp(0.0, width),
            bounds[3].clamp(0.0, height),
        ]
    }
}
