//! The camera beside a radar, in whose pixels some data sets are labelled.

use crate::geometry::Vec3;

/// A pinhole camera at the radar that looks along x; u to the right, v down, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PinholeCamera {
    /// Focal lengths (u, v), px.
    pub focal_px: [f64; 2],
    /// Principal point (u, v), px.
    pub centre_px: [f64; 2],
}

impl PinholeCamera {
    /// A world point (m; x forward, y left, z up) in the image, px; `None` at or behind the camera.
    pub fn project(&self, [x, y, z]: Vec3) -> Option<[f64; 2]> {
        let seen = x > 0.05 && y.is_finite() && z.is_finite();
        let [fu, fv] = self.focal_px;
        seen.then(|| [self.centre_px[0] - fu * y / x, self.centre_px[1] - fv * z / x])
    }
}
