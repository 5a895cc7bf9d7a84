//! What is drawn: Gaussians and lines as plain data, in world metres (x forward, y left, z up; SPEC section 1).

/// The id of an instance that [`super::pick`] ignores.
pub const NOT_PICKABLE: u32 = u32::MAX;

/// One 3-D Gaussian.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SplatInstance {
    /// Mean, world frame, m.
    pub center: [f32; 3],
    /// Covariance xx, xy, xz, yy, yz, zz, world frame, m². One that is not finite or not positive definite is skipped
    /// and counted.
    pub covariance: [f32; 6],
    /// Straight (not premultiplied) sRGB colour and opacity at the mean, 0..=1.
    pub color: [f32; 4],
    /// What [`super::pick`] answers; [`NOT_PICKABLE`] is never answered.
    pub id: u32,
}

/// One straight line of constant width on the screen; round caps where it is wider than 1.5 px, else flat ends.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct LineInstance {
    /// One end, world frame, m.
    pub a: [f32; 3],
    /// The other end, world frame, m.
    pub b: [f32; 3],
    /// Straight sRGB colour and opacity, 0..=1.
    pub color: [f32; 4],
    /// Width in physical pixels; below 1 the line fades instead of getting thinner.
    pub width_px: f32,
}

/// How the Gaussians are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SceneMode {
    /// As translucent Gaussians, depth-sorted and blended (EWA splatting).
    #[default]
    Splat,
    /// As opaque lit surfaces at `sigma` standard deviations.
    Ellipsoid,
}

/// Everything in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The Gaussians.
    pub splats: Vec<SplatInstance>,
    /// Lines hidden by what is in front of them.
    pub lines: Vec<LineInstance>,
    /// Lines on top of everything, in this order.
    pub overlay: Vec<LineInstance>,
    /// Straight sRGB colour and opacity behind everything.
    pub background: [f32; 4],
    /// How many standard deviations of a Gaussian are drawn (and hit by [`super::pick`]); clamped to 0.25..=6.
    pub sigma: f32,
    /// Opacity, relative to the splat's own, of the contour drawn at `sigma` in [`SceneMode::Splat`]; 0 draws none.
    pub contour: f32,
    /// Translucent or opaque.
    pub mode: SceneMode,
    /// Share of the picture's shorter side that a Gaussian may take; a larger one fades, in both modes, and only its
    /// middle is hit by [`super::pick`]: it would hide everything else.
    pub largest: f32,
}

/// How many instances cannot be drawn, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Undrawable {
    /// A number that is not finite, or a line without width.
    pub not_finite: usize,
    /// A finite covariance that is not positive definite.
    pub not_definite: usize,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            splats: Vec::new(),
            lines: Vec::new(),
            overlay: Vec::new(),
            background: [0.0, 0.0, 0.0, 1.0],
            sigma: 2.0,
            contour: 0.0,
            mode: SceneMode::Splat,
            largest: f32::INFINITY,
        }
    }
}

impl Scene {
    /// `sigma`, clamped to 0.25..=6; 2 where it is not a number.
    pub fn effective_sigma(&self) -> f32 {
        if self.sigma.is_nan() { 2.0 } else { self.sigma.clamp(0.25, 6.0) }
    }

    /// How many instances cannot be drawn: not finite, or a covariance that is not positive definite.
    pub fn invalid_instances(&self) -> usize {
        let Undrawable { not_finite, not_definite } = self.undrawable();
        not_finite + not_definite
    }

    /// The same by the reason.
    pub fn undrawable(&self) -> Undrawable {
        let finite = |splat: &&SplatInstance| splat.is_finite();
        let lines = self.lines.iter().chain(&self.overlay).filter(|line| !line.is_valid()).count();
        let not_definite = self.splats.iter().filter(finite).filter(|splat| !splat.is_valid()).count();
        let not_finite = self.splats.iter().filter(|splat| !finite(splat)).count() + lines;
        Undrawable { not_finite, not_definite }
    }
}

impl SplatInstance {
    /// Whether all its numbers are finite.
    fn is_finite(&self) -> bool {
        self.center.iter().chain(&self.covariance).chain(&self.color).all(|x| x.is_finite())
    }

    /// Whether it can be drawn: finite, and its covariance positive definite (Sylvester's criterion in f64).
    pub fn is_valid(&self) -> bool {
        let [xx, xy, xz, yy, yz, zz] = self.covariance.map(f64::from);
        let minor = xx * yy - xy * xy;
        let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
        self.is_finite() && xx > 0.0 && minor > 0.0 && determinant > 0.0
    }
}

impl LineInstance {
    /// Whether it can be drawn: finite and of positive width.
    pub fn is_valid(&self) -> bool {
        let finite = self.a.iter().chain(&self.b).chain(&self.color).all(|x| x.is_finite());
        finite && self.width_px.is_finite() && self.width_px > 0.0
    }
}
