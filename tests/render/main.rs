//! The 3-D scene: what is drawn, that the GPU draws what its CPU twin draws, picking, and the camera.
//!
//! With `MHP_RENDER_OUT=DIR` the demo scenes are written there as PNG.

#![cfg(feature = "viewer")]
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod camera;
mod demo;
mod picking;
mod pixels;
mod twin;

use mhp_inspector::render::HeadlessRenderer;

/// A renderer, or `None` with the reason printed where this machine has no adapter.
fn gpu() -> Option<HeadlessRenderer> {
    HeadlessRenderer::new().inspect_err(|error| eprintln!("skipped: {error}")).ok()
}
