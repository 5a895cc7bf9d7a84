//! Sequences that differ in how hard they are: with clutter, and with an echo that never moves.
#![expect(clippy::unwrap_used, reason = "a test stops where its material cannot be made")]

use super::blob;
use std::path::Path;

/// A sequence of frames in a folder of its own.
pub(crate) struct Scene {
    pub(crate) folder: &'static str,
    pub(crate) frames: usize,
    /// Echoes besides the person's, elsewhere in every frame.
    pub(crate) clutter: usize,
    /// A strong echo beside the person that never moves.
    pub(crate) reflector: bool,
}

/// Writes sequences and their manifest to `folder`; frames are called `frames/<scene>/<number>`.
pub(crate) fn write_scenes(folder: &Path, scenes: &[Scene]) {
    let manifest = blob::MANIFEST.replace("frames/*.npz", "frames/*/*.npz").replace("\"blob\"", "\"scenes\"");
    std::fs::write(folder.join("dataset.toml"), manifest).unwrap();
    for scene in scenes {
        let home = folder.join("frames").join(scene.folder);
        std::fs::create_dir_all(&home).unwrap();
        for index in 0..scene.frames {
            blob::write_frame(&home.join(format!("{index:03}.npz")), index, &|depth, at| scene.echo(index, depth, at));
        }
    }
}

impl Scene {
    fn echo(&self, index: usize, depth: f64, at: f64) -> f64 {
        let still = if self.reflector { spot(depth - 3.1, at - 0.35, 0.25, 12.0) } else { 0.0 };
        let places = (0..self.clutter).map(|k| (7 * k + 3 * index) as f64);
        let moving = places.map(|k| spot(depth - 0.5 - k * 0.37 % 5.0, at + 1.8 - k * 0.71 % 3.6, 0.1, 2.0));
        still + moving.sum::<f64>()
    }
}

/// A round echo `x`, `y` metres away.
fn spot(x: f64, y: f64, sigma: f64, strength: f64) -> f64 {
    strength * (-(x * x + y * y) / (2.0 * sigma * sigma)).exp()
}
