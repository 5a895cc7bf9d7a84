//! From the world to the screen: what every drawable needs to know about the camera and the picture's size.
//!
//! View coordinates are (x right, y up, depth into the screen), metres. Screen coordinates are pixels from the upper
//! left corner, y down, pixel centres at half integers.

use super::camera::{Basis, Camera, FAR_M, NEAR_M};
use super::scene::{Scene, SplatInstance};
use glam::{Vec2, Vec3};

/// A symmetric 3×3 matrix: xx, xy, xz, yy, yz, zz.
pub(super) type Symmetric = [f32; 6];

/// The uniform buffer of all shaders; the same layout as `Globals` in `globals.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Globals {
    /// Size of the picture, pixels.
    pub(super) viewport: [f32; 2],
    /// Focal length, pixels.
    pub(super) focal: f32,
    /// How many standard deviations are drawn.
    pub(super) sigma: f32,
    /// Relative opacity of the contour at `sigma`.
    pub(super) contour: f32,
    /// Depth buffer value = `depth_offset` − `depth_scale`/depth.
    pub(super) depth_offset: f32,
    /// See `depth_offset`, m.
    pub(super) depth_scale: f32,
    /// Uniform buffers are multiples of 16 bytes.
    pub(super) padding: f32,
}

impl Globals {
    /// The depth buffer's value at a depth, m: 0 at the near plane, 1 at the far plane.
    pub(super) fn buffer_depth(&self, depth: f32) -> f32 {
        self.depth_offset - self.depth_scale / depth
    }
}

/// A camera that looks into a picture of a known size.
pub(super) struct Projection {
    basis: Basis,
    eye: Vec3,
    pub(super) viewport: Vec2,
    pub(super) globals: Globals,
    /// See [`Scene::largest`].
    largest: f32,
}

/// What is left of the opacity of a Gaussian that fills everything.
const FAINTEST: f32 = 0.04;

impl Projection {
    pub(super) fn new(camera: &Camera, size: [u32; 2], scene: &Scene) -> Self {
        let viewport = Vec2::new(size[0] as f32, size[1] as f32);
        let globals = Globals {
            viewport: viewport.to_array(),
            focal: camera.focal_px(viewport),
            sigma: scene.effective_sigma(),
            contour: scene.contour.clamp(0.0, 1.0),
            depth_offset: FAR_M / (FAR_M - NEAR_M),
            depth_scale: FAR_M * NEAR_M / (FAR_M - NEAR_M),
            padding: 0.0,
        };
        Self { basis: camera.basis(), eye: camera.eye(), viewport, globals, largest: scene.largest }
    }

    /// View coordinates of a world point, m.
    pub(super) fn view_point(&self, world: [f32; 3]) -> Vec3 {
        let p = Vec3::from_array(world) - self.eye;
        Vec3::new(self.basis.right.dot(p), self.basis.up.dot(p), self.basis.forward.dot(p))
    }

    /// Pixel of a point in view coordinates; its depth must be positive.
    pub(super) fn pixel(&self, view: Vec3) -> Vec2 {
        self.viewport / 2.0 + Vec2::new(view.x, -view.y) * (self.globals.focal / view.z)
    }

    /// A covariance of the world frame in view coordinates, m²: the entries are aᵀ Σ b over pairs of basis vectors.
    pub(super) fn view_covariance(&self, world: Symmetric) -> Symmetric {
        let Basis { right, up, forward } = self.basis;
        let (sr, su, sf) = (apply(&world, right), apply(&world, up), apply(&world, forward));
        [right.dot(sr), right.dot(su), right.dot(sf), up.dot(su), up.dot(sf), forward.dot(sf)]
    }

    /// What is left of the opacity of a Gaussian: 1 up to [`Scene::largest`], less the more of the picture it takes.
    pub(super) fn fade(&self, splat: &SplatInstance) -> f32 {
        let [xx, xy, _, yy, ..] = self.view_covariance(splat.covariance);
        let largest = f32::midpoint(xx, yy) + ((xx - yy) / 2.0).hypot(xy);
        let reach = self.globals.sigma * largest.sqrt();
        let depth = self.view_point(splat.center).z.max(NEAR_M);
        let share = 2.0 * reach * self.globals.focal / (depth * self.viewport.min_element().max(1.0));
        if share <= self.largest { 1.0 } else { (self.largest / share).powi(2).max(FAINTEST) }
    }

    /// Whether a box of half size `half` px around `center` px touches the picture.
    pub(super) fn on_screen(&self, center: Vec2, half: Vec2) -> bool {
        (center + half).cmpge(Vec2::ZERO).all() && (center - half).cmple(self.viewport).all()
    }
}

/// S v
pub(super) fn apply(s: &Symmetric, v: Vec3) -> Vec3 {
    let [xx, xy, xz, yy, yz, zz] = *s;
    Vec3::new(xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z)
}

/// S⁻¹, in f64 inside; `None` where S is not positive definite.
pub(super) fn invert(s: &Symmetric) -> Option<Symmetric> {
    let [xx, xy, xz, yy, yz, zz] = s.map(f64::from);
    let (c_xx, c_xy, c_xz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    let determinant = xx * c_xx + xy * c_xy + xz * c_xz;
    let (c_yy, c_yz, c_zz) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
    let positive = xx > 0.0 && c_zz > 0.0 && determinant > 0.0;
    positive.then(|| [c_xx, c_xy, c_xz, c_yy, c_yz, c_zz].map(|c| (c / determinant) as f32))
}
