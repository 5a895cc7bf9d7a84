//! `dataset.toml` of a simulated data set, SPEC section 6, with how it was made as a comment.

use super::Style;
use crate::body::Skeleton;
use crate::dataset::FftText;
use crate::dataset::layout::{FrameWriter, MANTISSA_BITS};
use crate::radar::{Axis, Quantity, RadarConfig, View, ViewFft};
use crate::simulate::Recording;
use serde::Serialize;
use std::fmt::Write as _;

/// What the manifest of a simulated data set begins with.
pub(super) const FIRST_WORDS: &str = "# Simulated people before a simulated radar";

#[derive(Serialize)]
struct Manifest {
    name: String,
    layout: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<&'static str>,
    frame_rate_hz: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    skeleton: Option<Skeleton>,
    radar: RadarConfig,
    view: Vec<ManifestView>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    origin: Vec<Scene>,
}

/// The scene of all frames.
#[derive(Serialize)]
struct Scene {
    scene: String,
}

#[derive(Serialize)]
struct ManifestView {
    array: String,
    quantity: Quantity,
    fft: FftText,
    axes: Vec<Axis>,
}

/// The name of a recording: its presets.
fn name(recording: &Recording) -> String {
    let options = recording.options();
    let presets: Vec<&str> = options.presets.iter().map(|preset| preset.word()).collect();
    format!("simulated {} {}", options.layout.word(), presets.join(" "))
}

/// The whole file.
pub(super) fn text(recording: &Recording, writer: &dyn FrameWriter, style: Style<'_>) -> anyhow::Result<String> {
    let (device, radar) = (recording.device(), recording.radar());
    // Widths follow from the FFTs.
    let view = |(view, fft): (&View, ViewFft)| ManifestView {
        array: view.array.clone(),
        quantity: view.quantity,
        fft: FftText::beside(&fft.for_axes(view.axes.iter().map(|axis| axis.kind)), &radar, &view.axes),
        axes: view.axes.clone(),
    };
    let manifest = Manifest {
        name: style.name.map_or_else(|| name(recording), str::to_owned),
        layout: recording.options().layout.files(),
        frames: writer.pattern(recording.sequences()),
        frame_rate_hz: recording.frame_rate_hz(),
        // Bones of a person of 1.70 m: the people of a recording differ in height.
        skeleton: (!writer.has_own_joints()).then(|| crate::body::Build::default().skeleton()),
        view: device.views.iter().zip(device.ffts()).map(view).collect(),
        radar: radar.clone(),
        origin: recording.options().room_seed.map(|seed| Scene { scene: format!("room {seed}") }).into_iter().collect(),
    };
    Ok(format!("{}\n{}", comment(recording, style.command), toml::to_string(&manifest)?))
}

/// How the data set was made, as comment lines.
pub(super) fn comment(recording: &Recording, command: &str) -> String {
    let options = recording.options();
    let device = recording.device();
    let mut text = format!(
        "{FIRST_WORDS}: made by `{command}`\n# {} frames a sequence, {} in all; truth: joints \
         and velocities at the middle of each frame, m and m/s.\n",
        options.sequence_length,
        recording.len()
    );
    for radar in &device.radars {
        let fmcw = &radar.fmcw;
        // Writing to a text does not fail.
        let _ = writeln!(
            text,
            "# {}: {} transmitters in turn, {} receivers, {} loops of {} complex {}-bit samples a chirp.",
            radar.name,
            fmcw.array.tx.len(),
            fmcw.array.rx.len(),
            fmcw.loops,
            fmcw.samples,
            options.bits
        );
    }
    let _ = writeln!(text, "# Amplitudes in npz files are float32 rounded to {MANTISSA_BITS} bits of mantissa.");
    text
}
