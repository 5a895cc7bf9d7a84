//! `info`: what a data set is and what its first frame holds, as text for people or JSON for programs.

use super::common::{open, print, print_json};
use crate::dataset::{Dataset, DatasetInfo, FftText, Frame, Heatmap, ViewCalibration, view_words};
use crate::escape::one_line;
use crate::labels::{LabelPlace, LabelStore};
use crate::radar::{PointSpread, View};
use anyhow::Context as _;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Shown under the options of `info --help`.
pub(super) const HELP: &str = "\
Exit codes: 0 told; 2 bad input.

Examples:
  mhp-inspector info data/mmvr
      Layout, axes in words, what had to be assumed, and the values of the first frame.
  mhp-inspector info maps.npz --manifest dataset.toml --json
      A file of maps whose axes the manifest names, for a program to read.";

/// What is in a data set: layout, frames, views and axes, ranges of values, skeleton, people, labels.
#[derive(Debug, clap::Args)]
pub struct InfoArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    path: PathBuf,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    /// The frame whose values are told, counted from 0. Default: the one that PATH names, else the first.
    #[arg(long, value_name = "I")]
    frame: Option<usize>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Values of one map.
struct Values {
    finite: usize,
    cells: usize,
    nan: usize,
    min: f64,
    max: f64,
}

impl Values {
    fn of(map: &Heatmap) -> Self {
        let finite = map.data.iter().copied().filter(|x| x.is_finite());
        Self {
            finite: finite.clone().count(),
            cells: map.data.len(),
            nan: map.data.iter().filter(|x| x.is_nan()).count(),
            min: finite.clone().fold(f64::INFINITY, f64::min),
            max: finite.fold(f64::NEG_INFINITY, f64::max),
        }
    }

    fn nan_share(&self) -> f64 {
        self.nan as f64 / self.cells.max(1) as f64
    }

    fn range(&self) -> Option<(f64, f64)> {
        (self.finite > 0).then_some((self.min, self.max))
    }
}

/// Opens the data set, loads one frame, prints.
///
/// # Errors
/// Where the data set cannot be opened or that frame not be loaded.
pub(super) fn run(args: &InfoArgs) -> anyhow::Result<ExitCode> {
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frame = dataset.load(args.frame.unwrap_or(dataset.start_index()))?;
    let notes = label_notes(&dataset);
    if args.json {
        print_json(
            &(serde_json::to_string_pretty(&as_json(&dataset, &frame, &notes)).context("writing JSON")? + "\n"),
        )?;
    } else {
        print(&as_text(&dataset, &frame, &notes))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What is to be told of the journals of labels; they are read, and nothing is touched.
fn label_notes(dataset: &Dataset) -> Vec<String> {
    let place = LabelPlace::to_read(&dataset.info().root, dataset.fingerprint());
    LabelStore::read(&place).map_or_else(|error| vec![error.to_string()], |store| store.warnings().to_vec())
}

fn as_json(dataset: &Dataset, frame: &Frame, label_notes: &[String]) -> Value {
    let info = dataset.info();
    let views = info.views.iter().zip(&frame.maps).enumerate();
    let views: Vec<Value> = views.map(|(k, (view, map))| view_json(view, map, &info.calibration(k))).collect();
    let skeleton = &info.skeleton;
    json!({
        "name": info.name,
        "layout": info.layout.word(),
        "root": info.root.display().to_string(),
        "frames": dataset.len(),
        "sequences": dataset.sequences(),
        "scenes": scenes(dataset),
        "frame_rate_hz": info.frame_rate_hz,
        "axes": info.axes_badge,
        "views": views,
        "skeleton": {
            "name": skeleton.preset_name(),
            "joints": skeleton.joints,
            "bones": skeleton.bones,
            "bone_lengths_m": skeleton.bone_lengths_m,
            "angles": skeleton.angles,
        },
        "radar": info.radar,
        "frame": {
            "index": frame.index,
            "name": frame.name,
            "origin": dataset.origin(frame.index),
            "global_id": frame.global_id,
            "timestamp_s": frame.timestamp_s,
            "people": frame.person_count,
            "truth": frame.truth.is_some(),
            "velocities": frame.truth.as_ref().is_some_and(|truth| truth.velocities.is_some()),
            "labels": labels(info, frame),
            "notes": frame.notes,
        },
        "assumptions": info.assumptions,
        "notes": info.notes,
        "label_notes": label_notes,
    })
}

/// Frames of each scene.
fn scenes(dataset: &Dataset) -> BTreeMap<String, usize> {
    let mut scenes = BTreeMap::new();
    for scene in (0..dataset.len()).filter_map(|frame| dataset.origin(frame).scene) {
        *scenes.entry(scene).or_default() += 1;
    }
    scenes
}

fn view_json(view: &View, map: &Heatmap, calibration: &ViewCalibration) -> Value {
    let values = Values::of(map);
    json!({
        "array": view.array,
        "shape": map.shape,
        "dtype": map.dtype,
        "quantity": view.quantity,
        "axes": view.axes,
        "axes_in_words": view_words(view),
        "psf": view.psf,
        "psf_source": if calibration.derived { "derived" } else { "stated" },
        "fft": calibration.fft.as_ref().map(FftText::of),
        "rotation": view.pose.rotation,
        "translation": view.pose.translation,
        "region": view.region,
        "min": values.range().map(|range| range.0),
        "max": values.range().map(|range| range.1),
        "nan_cells": values.nan,
        "nan_share": values.nan_share(),
    })
}

/// The kinds of labels that a frame has, in words.
fn labels(info: &DatasetInfo, frame: &Frame) -> Vec<String> {
    let mut labels = Vec::new();
    for (view, boxes) in info.views.iter().zip(&frame.map_boxes) {
        if !boxes.is_empty() {
            labels.push(format!("{} on {}", counted(boxes.len(), "box", "boxes"), view.array));
        }
    }
    if let Some(image) = &frame.image {
        let kinds = [
            (image.boxes.len(), "image box", "image boxes"),
            (image.keypoints.len(), "person with key points, px", "people with key points, px"),
            (image.masks.len(), "image mask", "image masks"),
        ];
        labels.extend(kinds.iter().filter(|kind| kind.0 > 0).map(|&(n, one, many)| counted(n, one, many)));
    }
    labels
}

/// The point-spread widths that are not 0.
fn width_words(psf: &PointSpread) -> String {
    let widths = [
        ("range", 100.0 * psf.range_m, "cm"),
        ("azimuth", psf.azimuth_rad.to_degrees(), "°"),
        ("elevation", psf.elevation_rad.to_degrees(), "°"),
        ("speed", psf.doppler_mps, "m/s"),
    ];
    let shown = widths.iter().filter(|(_, width, _)| *width > 0.0);
    let words: Vec<String> = shown.map(|(name, width, unit)| format!("{name} {width:.3} {unit}")).collect();
    if words.is_empty() { "none".into() } else { words.join(", ") }
}

fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

fn as_text(dataset: &Dataset, frame: &Frame, label_notes: &[String]) -> String {
    let info = dataset.info();
    let mut out = String::new();
    let mut line = |key: &str, value: &str| {
        let _ = writeln!(out, "{key:<12}{}", one_line(value));
    };
    line("data set", &info.name);
    line("path", &info.root.display().to_string());
    line("layout", info.layout.word());
    let sequences = counted(dataset.sequences(), "sequence", "sequences");
    let rate = info.frame_rate_hz.map(|rate| format!(", {rate} a second")).unwrap_or_default();
    line("frames", &format!("{} in {sequences}{rate}", dataset.len()));
    let scenes = scenes(dataset);
    if !scenes.is_empty() {
        let told: Vec<String> =
            scenes.iter().map(|(scene, frames)| format!("{} ({frames})", one_line(scene))).collect();
        line("scenes", &told.join(", "));
    }
    let origin = dataset.origin(frame.index);
    if !origin.is_unknown() {
        line("this frame", &one_line(&origin.to_string()));
    }
    line("axes", &info.axes_badge);
    let skeleton = info.skeleton.preset_name().unwrap_or("its own");
    let (joints, bones) = (info.skeleton.joints.len(), info.skeleton.bones.len());
    line("skeleton", &format!("{skeleton}, {joints} joints, {bones} bones"));
    let radar = &info.radar;
    let (start, band) = (radar.start_hz / 1e9, radar.bandwidth_hz / 1e9);
    line("radar", &format!("{start} GHz + {band} GHz, {} Doppler features", radar.doppler_features));
    for text in &info.assumptions {
        line("assumed", text);
    }
    for text in &info.notes {
        line("note", text);
    }
    for text in label_notes {
        line("labels note", text);
    }
    line("", "");
    line("frame", &format!("{} ({})", frame.index, frame.name));
    if let Some(id) = &frame.global_id {
        line("global id", id);
    }
    if let Some(time) = frame.timestamp_s {
        line("time", &format!("{time:.3} s"));
    }
    line("people", &frame.person_count.map_or_else(|| "unknown".into(), |n| n.to_string()));
    let truth = match &frame.truth {
        Some(truth) if truth.velocities.is_some() => "joints in metres, with velocities",
        Some(_) => "joints in metres",
        None => "none in metres",
    };
    line("truth", truth);
    let labels = labels(info, frame);
    line("labels", &if labels.is_empty() { "none".into() } else { labels.join(", ") });
    for text in &frame.notes {
        line("note", text);
    }
    for (k, (view, map)) in info.views.iter().zip(&frame.maps).enumerate() {
        let values = Values::of(map);
        let shape = map.shape.iter().map(usize::to_string).collect::<Vec<_>>().join("×");
        line("", "");
        line(
            "view",
            &format!("{}, {shape} {}, {}", view.array, map.dtype, format!("{:?}", view.quantity).to_lowercase()),
        );
        for (k, axis) in view.axes.iter().enumerate() {
            let (plural, singular) = crate::dataset::axis_position(k, view.axes.len());
            let words = crate::dataset::axis_words(axis, &singular);
            line(&format!("  {plural}"), &format!("{words}; {} bins of {:.4}", axis.bins, axis.step().abs()));
        }
        line("  widths", &format!("{}, {}", width_words(&view.psf), info.calibration(k).words()));
        let range = values.range().map_or_else(|| "no finite cell".into(), |(lo, hi)| format!("{lo:.4e} to {hi:.4e}"));
        line("  values", &range);
        let other = values.cells - values.finite - values.nan;
        let infinite = if other > 0 { format!(", {other} infinite") } else { String::new() };
        line(
            "  NaN",
            &format!("{} of {} cells ({:.3} %){infinite}", values.nan, values.cells, 100.0 * values.nan_share()),
        );
    }
    out.lines().map(str::trim_end).fold(String::new(), |text, line| text + line + "\n")
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::task::Progress;

    #[test]
    fn a_layout_of_the_registry_is_told_by_its_word() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("000.dummy"), b"abcdef").unwrap();
        let dataset = Dataset::open(folder.path(), &Progress::new()).unwrap();
        let frame = dataset.load(0).unwrap();
        let text = as_text(&dataset, &frame, &[]);
        assert!(text.contains("data set    Dummy\n") && text.contains("layout      dummy\n"), "{text}");
        assert!(text.contains("view        bytes, 2×3 |u1, amplitude\n"), "{text}");
        assert_eq!(as_json(&dataset, &frame, &[])["layout"], "dummy");
    }
}
