//! `mhp-inspector sample`: writes the bundled sample data set anew.
//!
//! The maps come from physics that the fit's forward model knows nothing of: scatterers on a walking body and in a room, FMCW
//! beat signals sampled by a 12-bit converter, windows and FFTs. The same seed gives the same bytes.

mod scene;

pub use scene::{CHAIN, FRAME_RATE_HZ, Plane, SampleFrame, Scene, radar};

use crate::body::Skeleton;
use crate::dataset::npz::{ArrayView, NpzError, write_deflated};
use crate::geometry::Vec3;
use crate::radar::{Axis, PointSpread, Quantity, RadarConfig};
use anyhow::{Context, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Bits of the mantissa that the stored floats keep; the rest is zero and deflates away. Half a step is 1e−4 of a value.
const MANTISSA_BITS: u32 = 12;

/// Write the bundled sample data set: a person who walks and turns before two FMCW arrays, with 3-D truth.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder to write `dataset.toml` and `frames/` into; it is made if it does not exist.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Frames, at 10 a second.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub frames: u32,
    /// Seed of skin, room and noise; the same seed gives the same bytes.
    #[arg(long, default_value_t = 7)]
    pub seed: u64,
}

/// Writes the data set.
///
/// # Errors
/// Where the folder cannot be written, or holds frames that would not be overwritten.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} frames, {eta} left")?;
    let bar = ProgressBar::new(u64::from(args.frames)).with_style(style);
    write_data_set(&args.out, args.frames as usize, args.seed, |done| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    eprintln!("{} frames in {}", args.frames, args.out.display());
    Ok(ExitCode::SUCCESS)
}

/// Writes `frames` frames and the manifest into `out`; `progress` hears how many are done.
///
/// # Errors
/// Where the folder cannot be written, or holds frames that would not be overwritten.
pub fn write_data_set(out: &Path, frames: usize, seed: u64, mut progress: impl FnMut(usize)) -> anyhow::Result<()> {
    let folder = out.join("frames");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    refuse_leftovers(&folder, frames)?;
    let scene = Scene::new(seed);
    for index in 0..frames {
        let path = folder.join(frame_name(index));
        write_frame(&path, &scene.frame(index))?;
        progress(index + 1);
    }
    let path = out.join("dataset.toml");
    std::fs::write(&path, manifest(&scene, frames, seed)?).with_context(|| format!("cannot write {}", path.display()))
}

fn frame_name(index: usize) -> String {
    format!("{index:06}.npz")
}

fn refuse_leftovers(folder: &Path, frames: usize) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))? {
        let path = entry?.path();
        let ours = (0..frames).any(|index| path.ends_with(frame_name(index)));
        ensure!(
            ours || path.extension().is_none_or(|ending| ending != "npz"),
            "{} would become a frame of the new data set; remove it first or choose another folder",
            path.display()
        );
    }
    Ok(())
}

fn write_frame(path: &Path, frame: &SampleFrame) -> Result<(), NpzError> {
    let maps: Vec<Vec<f32>> = frame.maps.iter().map(|map| map.iter().map(|&x| rounded(x as f32)).collect()).collect();
    let flat = |vectors: &[Vec3]| -> Vec<f32> { vectors.iter().flatten().map(|&x| x as f32).collect() };
    let (joints, velocities) = (flat(&frame.joints), flat(&frame.velocities));
    let per_joint = [1, frame.joints.len(), 3];
    let mut arrays: Vec<(&str, ArrayView<'_>)> = Vec::new();
    for (plane, map) in Plane::ALL.iter().zip(&maps) {
        arrays.push((plane.array(), ArrayView::f32(&plane.axes().map(|axis| axis.bins), map)));
    }
    arrays.push(("joints", ArrayView::f32(&per_joint, &joints)));
    arrays.push(("velocities", ArrayView::f32(&per_joint, &velocities)));
    arrays.push(("person_count", ArrayView::i64(&[], &[1])));
    let timestamp_s = [frame.timestamp_s];
    arrays.push(("timestamp_s", ArrayView::f64(&[], &timestamp_s)));
    write_deflated(path, &arrays)
}

/// `x` with [`MANTISSA_BITS`] bits of mantissa, to nearest.
fn rounded(x: f32) -> f32 {
    let dropped = f32::MANTISSA_DIGITS - 1 - MANTISSA_BITS;
    let bits = x.to_bits() + (1 << (dropped - 1));
    f32::from_bits(bits & !((1 << dropped) - 1))
}

#[derive(Serialize)]
struct Manifest {
    name: String,
    layout: &'static str,
    frames: &'static str,
    frame_rate_hz: f64,
    skeleton: Skeleton,
    radar: RadarConfig,
    view: Vec<ManifestView>,
}

#[derive(Serialize)]
struct ManifestView {
    array: &'static str,
    quantity: Quantity,
    psf: PointSpread,
    axes: [Axis; 2],
}

/// `dataset.toml`, SPEC section 6, with how it was made as a comment.
fn manifest(scene: &Scene, frames: usize, seed: u64) -> anyhow::Result<String> {
    let view = |plane: Plane| ManifestView {
        array: plane.array(),
        quantity: Quantity::Amplitude,
        psf: plane.point_spread(),
        axes: plane.axes(),
    };
    let manifest = Manifest {
        name: "walk".into(),
        layout: "npz",
        frames: "frames/*.npz",
        frame_rate_hz: FRAME_RATE_HZ,
        skeleton: scene.walker.skeleton(),
        radar: radar(),
        view: Plane::ALL.map(view).into(),
    };
    let fmcw = Plane::Horizontal.fmcw();
    Ok(format!(
        "# A person of {:.2} m walks towards two FMCW arrays 1 m above the floor, turns, and walks away.
# Made by `mhp-inspector sample --frames {frames} --seed {seed}`, from scatterers to ADC samples to FFTs:
# {} chirps of {} complex 12-bit samples a frame, {} elements {} mm apart (all sampled at once), one array along y, one along z.
# Hann over samples and chirps, Dolph-Chebyshev (30 dB) over elements; the echo of all that stands still is attenuated to
# {} in amplitude, then power is summed over Doppler, and the polar map is resampled to Cartesian cells.
# Amplitudes are float32 rounded to {MANTISSA_BITS} bits of mantissa. Truth: joints and velocities at the middle of the frame.

{}",
        scene.walker.height_m,
        fmcw.chirps,
        fmcw.samples,
        fmcw.array.elements,
        fmcw.array.spacing_m * 1e3,
        CHAIN.still_share,
        toml::to_string(&manifest)?
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_twelve_bits_and_the_nearest_value() {
        for x in [1.0f32, 1.000_2, 3.371_592_7, 12_345.678, 7.7e8] {
            let r = rounded(x);
            assert_eq!(r.to_bits() & 0x7FF, 0);
            assert!((r - x).abs() <= x * 2f32.powi(-13), "{x} {r}");
        }
    }

    #[test]
    fn leftover_frames_are_refused() {
        let folder = std::env::temp_dir().join(format!("mhp-sample-leftover-{}", std::process::id()));
        std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(folder.join("000005.npz"), b"old")).ok();
        assert!(refuse_leftovers(&folder, 6).is_ok());
        let told = refuse_leftovers(&folder, 5).map_err(|error| error.to_string());
        assert!(told.is_err_and(|text| text.contains("000005.npz")));
        std::fs::remove_dir_all(&folder).ok();
    }
}
