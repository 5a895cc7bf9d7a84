//! One body before three radars: the same person, motion and room, as maps of MMVR-, HuPR- and XRF55-like radars, fitted with the
//! same settings. All that differs from radar to radar is its calibration: chirp, axes and the widths that follow from its FFTs.

use crate::body::Skeleton;
use crate::config::{FitConfig, Preset};
use crate::diagnose::joint_errors;
use crate::geometry::Vec3;
use crate::mhp::{FitError, Fitter, Precision, Problem};
use crate::simulate::{Action, Options, Recording, ScenePreset, Sequence, SimulateError, SimulatedLayout};
use crate::start::find_start;
use rayon::prelude::*;
use std::fmt::Write as _;
use std::sync::Arc;

/// The radars, by the layout whose maps they make, and their names in the table.
pub const RADARS: [(SimulatedLayout, &str); 3] = [
    (SimulatedLayout::Mmvr, "MMVR-like: two Cartesian maps, 77 GHz"),
    (SimulatedLayout::Hupr, "HuPR-like: two cubes with Doppler, IWR1843"),
    (SimulatedLayout::Xrf55, "XRF55-like: range × angle and × Doppler, IWR6843"),
];
/// Frames of a sequence.
const LENGTH: usize = 20;
/// Frames to each side of a fitted one that a fit may look at.
const REACH: usize = 4;

/// What is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct ThreeRadars {
    /// Sequences: a person, a room and a motion each.
    pub sequences: usize,
    /// Frames that are fitted of each, spread over its length.
    pub frames: usize,
    /// Seed of people, rooms and motions.
    pub seed: u64,
    /// Settings of every fit.
    pub config: FitConfig,
}

impl Default for ThreeRadars {
    fn default() -> Self {
        Self { sequences: 6, frames: 2, seed: 2121, config: FitConfig { people: 1, ..Preset::Recommended.config() } }
    }
}

/// One radar's row.
#[derive(Debug, Clone, PartialEq)]
pub struct RadarRow {
    /// Whose maps.
    pub layout: SimulatedLayout,
    /// Frames that could be fitted.
    pub frames: usize,
    /// Mean joint error of the starts, mm.
    pub start_mm: f64,
    /// Mean joint error of the fits, mm.
    pub majpe_mm: f64,
    /// The same after alignment, mm.
    pub pa_majpe_mm: f64,
    /// Forward-consistency IoU, mean over views.
    pub iou: f64,
}

/// The figures of one fit.
type Figures = [f64; 4];

impl ThreeRadars {
    fn options(&self) -> Options {
        Options {
            // HuPR's cubes end nearest: what they hold, the others hold too.
            layout: SimulatedLayout::Hupr,
            presets: vec![ScenePreset::Easy],
            frames: LENGTH * self.sequences,
            sequence_length: LENGTH,
            people: Some(1..=1),
            actions: vec![Action::Walk],
            seed: self.seed,
            ..Options::default()
        }
    }

    /// Simulates and fits; a row a radar. `done` hears of every fit.
    ///
    /// # Errors
    /// Where the numbers of sequences or frames make no sense.
    pub fn run(&self, done: impl Fn() + Sync) -> Result<Vec<RadarRow>, SimulateError> {
        let of_radar = |&(layout, _): &(SimulatedLayout, &str)| {
            let recording = Recording::seen_by(&self.options(), layout)?;
            let jobs: Vec<(usize, usize)> =
                (0..self.sequences).flat_map(|sequence| self.numbers().map(move |number| (sequence, number))).collect();
            let figures: Vec<Figures> = jobs
                .par_iter()
                .filter_map(|&(sequence, number)| {
                    let found = self.fit(&recording, &recording.sequence(sequence), number);
                    done();
                    found.inspect_err(|error| tracing::warn!("sequence {sequence}, frame {number}: {error}")).ok()?
                })
                .collect();
            let mean = |k: usize| figures.iter().map(|of| of[k]).sum::<f64>() / figures.len().max(1) as f64;
            let [start_mm, majpe_mm, pa_majpe_mm, iou] = std::array::from_fn(mean);
            Ok(RadarRow { layout, frames: figures.len(), start_mm, majpe_mm, pa_majpe_mm, iou })
        };
        RADARS.iter().map(of_radar).collect()
    }

    /// Fits of one radar.
    pub fn fits(&self) -> usize {
        self.sequences * self.frames
    }

    /// Numbers of the fitted frames in a sequence: inside it, so that there are frames around.
    fn numbers(&self) -> impl Iterator<Item = usize> + use<> {
        let frames = self.frames.max(1);
        (0..frames).map(move |k| REACH + k * (LENGTH - 2 * REACH) / frames)
    }

    /// `None` where there is no truth to compare with.
    fn fit(&self, recording: &Recording, sequence: &Sequence, number: usize) -> Result<Option<Figures>, FitError> {
        let Some(skeleton) = Skeleton::preset("coco17") else { return Ok(None) };
        let joints = skeleton.joints.len();
        let wide = |maps: Vec<Vec<f32>>| -> Vec<Vec<f64>> {
            maps.into_iter().map(|map| map.into_iter().map(f64::from).collect()).collect()
        };
        let now = sequence.frame(number);
        let truth: Vec<Vec3> = now.joints.concat();
        let maps = wide(now.maps);
        let of: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        let mut problem = Problem::new(recording.radar(), skeleton, recording.views(), &of)?;
        for other in number.saturating_sub(REACH)..(number + REACH + 1).min(LENGTH) {
            if other != number {
                let maps = wide(sequence.frame(other).maps);
                let of: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
                problem.add_neighbour((other as f64 - number as f64) / recording.frame_rate_hz(), &of)?;
            }
        }
        let problem = Arc::new(problem);
        let initial = find_start(&problem, &self.config)?.initialisation.params;
        let start = joint_errors(initial.positions(), &truth, joints);
        let mut fitter = Fitter::new(problem, self.config, Precision::F32, initial)?;
        fitter.run_unseen(self.config.iterations, |_| false)?;
        let end = joint_errors(fitter.params().positions(), &truth, joints);
        let ious: Vec<f64> = fitter.report().iou.iter().flatten().copied().collect();
        let iou = ious.iter().sum::<f64>() / ious.len().max(1) as f64;
        Ok(start.zip(end).map(|(start, end)| [start.majpe_mm, end.majpe_mm, end.pa_majpe_mm, iou]))
    }

    /// The rows as a section of Markdown.
    pub fn markdown(&self, rows: &[RadarRow]) -> String {
        let mut text = format!(
            "## One body, three radars\n\n{} walking people, the same before every radar; {} frames fitted of each with \
             the same settings. All that differs is the calibration: chirp, axes, and widths that follow from the FFTs.\n\n\
             | radar | frames | start MAJPE, mm | MAJPE, mm | PA-MAJPE, mm | IoU |\n|---|---:|---:|---:|---:|---:|\n",
            self.sequences, self.frames
        );
        for row in rows {
            let name = RADARS.iter().find(|(layout, _)| *layout == row.layout).map_or("", |(_, name)| name);
            // Writing to a text does not fail.
            let _ = writeln!(
                text,
                "| {name} | {} | {:.0} | {:.0} | {:.0} | {:.2} |",
                row.frames, row.start_mm, row.majpe_mm, row.pa_majpe_mm, row.iou
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// Whatever radar looks: the same joints at the same times.
    #[test]
    fn the_body_is_the_same_before_every_radar() {
        let of = ThreeRadars { sequences: 1, frames: 1, ..ThreeRadars::default() };
        let seen: Vec<_> = RADARS
            .iter()
            .map(|&(layout, _)| Recording::seen_by(&of.options(), layout).unwrap().sequence(0).frame(7))
            .collect();
        assert!(seen.iter().all(|frame| frame.joints == seen[0].joints && frame.timestamp_s == seen[0].timestamp_s));
        let cells: Vec<usize> = seen.iter().map(|frame| frame.maps[0].len()).collect();
        assert_eq!(cells, [256 * 128, 16 * 64 * 64, 128 * 64]);
    }
}
