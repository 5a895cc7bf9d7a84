//! The 3-D scene drawn by our own wgpu pipelines into an offscreen texture, its CPU twin, and colour maps; knows no
//! window and no session.
//!
//! A [`Scene`] is plain data (Gaussians and thick lines), a [`Camera`] looks at it. Both renderers share one projection
//! to the screen and one back-to-front order (a few hundred primitives a frame, so this is done on the CPU);
//! [`SceneRenderer`] then shades the pixels in WGSL, [`cpu::render`] in Rust. The twin is what proves the shaders, and
//! what draws where there is no adapter. One drawable is one file here with one shader beside it: `gaussians`,
//! `ellipsoids`, `lines`.
//!
//! All blending is done on sRGB-encoded values with premultiplied alpha, as egui blends: the colour target never has
//! an sRGB format. Antialiasing is analytic (distance to an edge in pixels), so no multisampling is needed and a
//! software rasteriser stays quick.

mod camera;
mod colormap;
pub mod cpu;
mod ellipsoids;
mod gaussians;
mod lines;
mod offscreen;
mod order;
mod pick;
mod pipeline;
mod projection;
mod renderer;
mod scene;
pub mod shapes;

pub use camera::{Camera, Projected, Ray};
pub use colormap::{Colormap, NAN_COLOR};
pub use offscreen::{HeadlessRenderer, RenderError, render_to_image};
pub use pick::pick;
pub use renderer::{MAX_SIDE_PX, SceneRenderer, clamped_size};
pub use scene::{LineInstance, NOT_PICKABLE, Scene, SceneMode, SplatInstance, Undrawable};

/// The one wgpu of the program; every other room takes it from here.
pub use eframe::wgpu;

pub use glam::{Vec2, Vec3};
