//! Another radar before the same pose: its H_sim and what it would know, beside today's.

use super::echo_radar::fft_of;
use super::observe::{Noise, Observability, noisy_problem, observability};
use super::{ExploredState, Halt, IdleCores};
use crate::dataset::{DatasetInfo, FftText, RadarPreset};
use crate::geometry::{Mat3, Pose, Vec3, mat_mul, mat_vec};
use crate::mhp::{Precision, Problem, simulate};
use crate::radar::{FftSetup, RadarConfig, View, ViewFft, Window};
use crate::task::Progress;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What is changed of the radar of a view; what is `None` stays.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct RadarChange {
    /// Swept bandwidth, Hz.
    pub bandwidth_hz: Option<f64>,
    /// Virtual elements of the line that resolves the angle.
    pub elements: Option<usize>,
    /// Window over samples and elements.
    #[serde(with = "window_name")]
    pub window: Option<Window>,
    /// How much higher it stands, m.
    pub raised_m: f64,
    /// How far it looks down, degrees.
    pub tilt_deg: f64,
    /// Noise below the largest cell, dB; `None`: as measured.
    pub snr_db: Option<f64>,
}

/// A window by its name, as manifests have it.
mod window_name {
    use super::Window;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    #[expect(clippy::ref_option, reason = "what serde hands over")]
    pub(super) fn serialize<S: Serializer>(window: &Option<Window>, serializer: S) -> Result<S::Ok, S::Error> {
        window.map(Window::name).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Window>, D::Error> {
        let named = |name: String| {
            Window::named(&name)
                .ok_or_else(|| D::Error::custom(format!("no window {name}; expected {}", Window::NAMES)))
        };
        Option::<String>::deserialize(deserializer)?.map(named).transpose()
    }
}

/// What one radar sees of a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The views.
    pub views: Vec<View>,
    /// H_sim of each.
    pub maps: Vec<Vec<f64>>,
    /// What it would know.
    pub known: Observability,
}

/// Today's radar and another.
#[derive(Debug, Clone, PartialEq)]
pub struct WhatIf {
    /// As it is.
    pub today: Seen,
    /// As it would be.
    pub other: Seen,
}

impl RadarChange {
    /// Whether nothing is changed.
    pub fn is_nothing(&self) -> bool {
        *self == Self::default()
    }

    /// Whether such a radar can be.
    ///
    /// # Errors
    /// In words, what is out of range and what was expected.
    pub fn check(&self) -> Result<(), String> {
        let within = |name: &str, value: f64, [lo, hi]: [f64; 2]| {
            if (lo..=hi).contains(&value) { Ok(()) } else { Err(format!("{name} {value}: expected {lo} to {hi}")) }
        };
        within("bandwidth", self.bandwidth_hz.unwrap_or(1e9), [1e7, 2e10])?;
        within("elements", self.elements.unwrap_or(8) as f64, [2.0, 1024.0])?;
        within("raise", self.raised_m, [-5.0, 5.0])?;
        within("tilt", self.tilt_deg, [-90.0, 90.0])?;
        within("snr", self.snr_db.unwrap_or(40.0), [-20.0, 120.0])
    }

    /// The FFT configuration of a view with this change.
    pub fn fft(&self, view: &View, known: Option<&ViewFft>, radar: &RadarConfig) -> ViewFft {
        let (mut fft, _) = fft_of(view, known, radar);
        if let Some(bandwidth_hz) = self.bandwidth_hz {
            fft.radar.bandwidth_hz = bandwidth_hz;
        }
        let line = |set: Option<(usize, Window)>| {
            set.map(|(count, window)| (self.elements.unwrap_or(count), self.window.unwrap_or(window)))
        };
        let FftSetup { range, doppler, azimuth, elevation } = fft.setup;
        fft.setup = FftSetup {
            range: (range.0, self.window.unwrap_or(range.1)),
            doppler,
            azimuth: line(azimuth),
            elevation: line(elevation),
        };
        fft
    }

    /// The view as that radar would have it: its widths scaled as those of the FFTs change, its place moved.
    pub fn view(&self, view: &View, known: Option<&ViewFft>, radar: &RadarConfig) -> View {
        let (before, after) = (Self::default().fft(view, known, radar), self.fft(view, known, radar));
        let [old, new] = [before.point_spread(), after.point_spread()];
        let ratio = |old: f64, new: f64| if old > 0.0 { new / old } else { 1.0 };
        let mut psf = view.psf;
        psf.range_m *= ratio(old.range_m, new.range_m);
        psf.azimuth_rad *= ratio(old.azimuth_rad, new.azimuth_rad);
        psf.elevation_rad *= ratio(old.elevation_rad, new.elevation_rad);
        View { psf, pose: self.pose(&view.pose), ..view.clone() }
    }

    /// Raised and tilted about its own y axis.
    fn pose(&self, pose: &Pose) -> Pose {
        let (s, c) = self.tilt_deg.to_radians().sin_cos();
        // Looking down brings what lies below boresight onto it.
        let tilt: Mat3 = [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]];
        let down: Vec3 = mat_vec(&pose.rotation, [0.0, 0.0, -self.raised_m]);
        let moved = std::array::from_fn(|k| pose.translation[k] + down[k]);
        Pose { rotation: mat_mul(&tilt, &pose.rotation), translation: mat_vec(&tilt, moved) }
    }

    fn noise(&self) -> Noise {
        self.snr_db.map_or(Noise::Measured, Noise::SnrDb)
    }
}

/// The noise floor of measured maps, dB below their largest cell: what today's radar has where nothing else is asked.
const USUAL_SNR_DB: f64 = 40.0;

/// What today's radar and another see of the pose of a state, and what each would know of it. Both are asked of their own H_sim, with
/// the noise that is asked for on it and without the cells that are erased, so that nothing but the radar differs.
///
/// # Errors
/// As [`Problem::new`], or where it was cancelled.
pub fn what_if(
    info: &DatasetInfo,
    state: &ExploredState,
    changes: &[RadarChange],
    (cores, progress): (&IdleCores, &Progress),
) -> Result<WhatIf, Halt> {
    let (ffts, problem) = (info.ffts(), &state.problem);
    let seen = |changes: &[RadarChange]| -> Result<Seen, Halt> {
        let change = |k: usize| changes.get(k).copied().unwrap_or_default();
        let views: Vec<View> = problem
            .views
            .iter()
            .enumerate()
            .map(|(k, view)| change(k).view(view, ffts.get(k).and_then(Option::as_ref), &info.radar))
            .collect();
        let empty: Vec<Vec<f64>> = views.iter().map(|view| vec![1.0; view.cells()]).collect();
        let of = |maps: &[Vec<f64>]| {
            let slices: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
            let new = Problem::new(problem.radar.clone(), problem.skeleton.clone(), views.clone(), &slices);
            Ok::<Problem, Halt>(new.map_err(Halt::failed)?.calibrated_as(problem))
        };
        let clean = simulate(&of(&empty)?, &state.config, Precision::F32, &state.params);
        // One number for all views: the least that is asked.
        let snr = (0..views.len()).map(|k| match change(k).noise() {
            Noise::SnrDb(snr) => snr,
            Noise::Measured => USUAL_SNR_DB,
        });
        let snr = snr.fold(f64::INFINITY, f64::min);
        let sigmas: Vec<f64> = clean
            .iter()
            .map(|map| map.iter().copied().fold(0.0, f64::max) * 10f64.powf(-snr / 20.0) / 2f64.sqrt())
            .collect();
        let noisy = Arc::new(noisy_problem(&of(&clean)?, &sigmas, 0x51EE).map_err(Halt::failed)?);
        let maps = (0..views.len()).map(|k| noisy.map(k).to_vec()).collect();
        let state = ExploredState { problem: noisy, ..state.clone() };
        let known = observability(&state, Noise::SnrDb(snr), (cores, progress))?;
        Ok(Seen { views, maps, known })
    };
    let today = seen(&[])?;
    let other = if changes.iter().all(RadarChange::is_nothing) { today.clone() } else { seen(changes)? };
    Ok(WhatIf { today, other })
}

/// The radar of a data set with these changes, as a preset that manifests can name: the chirp of the first view, the line of each.
pub fn preset_of(info: &DatasetInfo, changes: &[RadarChange]) -> RadarPreset {
    let ffts = info.ffts();
    let of = |(k, view): (usize, &View)| {
        changes.get(k).copied().unwrap_or_default().fft(view, ffts.get(k).and_then(Option::as_ref), &info.radar)
    };
    let mut all = info.views.iter().enumerate().map(of);
    let first = all.next();
    let fft = first.map(|first| {
        all.fold(first, |mut sum, fft| {
            sum.setup.azimuth = sum.setup.azimuth.or(fft.setup.azimuth);
            sum.setup.elevation = sum.setup.elevation.or(fft.setup.elevation);
            sum
        })
    });
    let radar = fft.as_ref().map_or_else(|| info.radar.clone(), |fft| fft.radar.clone());
    RadarPreset { about: format!("what-if of {}", info.name), radar, fft: fft.as_ref().map(FftText::of), psf: None }
}
