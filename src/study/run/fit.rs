//! One frame under one or several variants: load once, start once, fit, measure.
//!
//! Variants that differ only in what no start depends on share their start ([`crate::start::start_key`]); those that differ only in the
//! number of iterations share the fit itself where k steps of a longer run are the shorter run ([`fit_key`]).

use super::row::RunNumbers;
use crate::body::Pppr;
use crate::config::{FitConfig, InitConfig, Parameterization};
use crate::dataset::{Dataset, Frame};
use crate::diagnose::{Reprojection, joint_errors, map_box_coverage, reprojection};
use crate::geometry::Vec3;
use crate::mhp::{
    ErasedCells, FitState, Fitter, GivenStart, Precision, Problem, StopReason, perturb, predict, without,
};
use crate::start::{find_start_along, problem_of};
use crate::study::row::annotated;
use crate::task::milliseconds;
use std::sync::Arc;
use std::time::Instant;

/// A configuration without its number of iterations: variants with the same key are one fit. The steps in a window of frames
/// shorten towards the end of a run, and so a run's length stays in the key there.
pub(super) fn fit_key(config: &FitConfig) -> FitConfig {
    match config.parameterization {
        Parameterization::Motion => *config,
        _ => FitConfig { iterations: FitConfig::default().iterations, ..*config },
    }
}

/// A frame, loaded.
pub(super) struct LoadedFrame<'a> {
    dataset: &'a Dataset,
    frame: Frame,
    problem: Arc<Problem>,
    /// What fits see of it: without the erased cells.
    seen: Arc<Problem>,
}

/// A start, and how long it took to find.
#[derive(Debug, Clone)]
pub(super) struct TimedStart {
    /// Where the fit begins.
    pub(super) params: Pppr,
    /// What the frame alone says, without the switches that refine a start.
    pub(super) unrefined: Pppr,
    /// Whether its joints were given, and not found in the maps.
    pub(super) given: bool,
    pub(super) init_ms: Option<f64>,
}

/// One fit at one number of iterations.
pub(super) struct Stop {
    pub(super) numbers: RunNumbers,
    pub(super) fit_ms: f64,
    pub(super) params: Pppr,
}

impl<'a> LoadedFrame<'a> {
    /// Reads frame `index`. No fit sees the cells that are `erased`; a start that is sought does.
    ///
    /// # Errors
    /// In one line that names the file.
    pub(super) fn read(dataset: &'a Dataset, index: usize, erased: &[ErasedCells]) -> Result<Self, String> {
        let told = |error: &dyn std::fmt::Display| format!("{}: {error}", dataset.frame_name(index));
        let frame = dataset.load(index).map_err(|error| portable(dataset, &error.to_string()))?;
        let problem = Arc::new(problem_of(dataset, &frame).map_err(|error| told(&error))?);
        let seen = without(&problem, erased).map_err(|error| told(&error))?;
        Ok(Self { dataset, frame, problem, seen })
    }

    /// A start from the frame's own peaks.
    ///
    /// # Errors
    /// Where nobody is seen.
    pub(super) fn cold(&self, config: &FitConfig) -> Result<TimedStart, String> {
        let began = Instant::now();
        let found = find_start_along(self.dataset, self.frame.index, &self.problem, config)
            .map_err(|error| self.told(&error))?
            .initialisation;
        Ok(TimedStart {
            params: found.params,
            unrefined: found.unrefined,
            given: false,
            init_ms: Some(milliseconds(began)),
        })
    }

    /// A start at the annotated joints: as many persons as are annotated, who look as those of a cold start and move as the
    /// truth says, or as a cold start says where it tells positions alone; perturbed where the settings ask for it.
    ///
    /// # Errors
    /// Where the frame has no joints in 3-D, or one of them is not finite.
    pub(super) fn truth_start(&self, config: &FitConfig) -> Result<TimedStart, String> {
        let truth = self.frame.truth.as_ref().filter(|truth| truth.persons > 0);
        let truth = truth.ok_or_else(|| self.told(&"no joints in 3-D are annotated, which this study starts from"))?;
        if !truth.joints.iter().flatten().all(|x| x.is_finite()) {
            return Err(self.told(&"an annotated joint is not finite"));
        }
        // One search serves the truth and all that is off it.
        let init = InitConfig { position_noise_m: 0.0, ..config.init };
        let mut params = self.cold(&FitConfig { people: truth.persons, init, ..*config })?.params;
        let [positions, velocities] = params.motion_mut();
        if positions.len() != truth.joints.len() {
            return Err(self.told(&format!("{} joints are annotated, {} fitted", truth.joints.len(), positions.len())));
        }
        positions.copy_from_slice(&truth.joints);
        if let Some(known) = &truth.velocities {
            velocities.copy_from_slice(known);
        }
        perturb(&self.problem, &config.init, &mut params);
        Ok(TimedStart { unrefined: params.clone(), params, given: true, init_ms: None })
    }

    /// A start from what the frame before ended with, moved as its people moved and perturbed as a cold one is.
    pub(super) fn warm(&self, config: &FitConfig, before: &Pppr) -> TimedStart {
        let params = predict(&self.problem, config, before);
        TimedStart { unrefined: params.clone(), params, given: false, init_ms: None }
    }

    /// Fits from `start` and looks at it after each of `stops` steps, ascending. What fails from some step on fails there
    /// for every later stop.
    pub(super) fn fit(
        &self,
        config: &FitConfig,
        precision: Precision,
        start: &TimedStart,
        stops: &[usize],
    ) -> Vec<Result<Stop, String>> {
        let mut fitter = Err(String::new());
        self.fit_watched(config, precision, start, stops, &mut fitter, |_| true)
    }

    /// The same, watched from step to step: `go_on` sees the fit before each and says whether it is taken; no answer is given
    /// for a stop that was not reached. The fit stays in `fitter`.
    pub(super) fn fit_watched(
        &self,
        config: &FitConfig,
        precision: Precision,
        start: &TimedStart,
        stops: &[usize],
        fitter: &mut Result<Fitter, String>,
        mut go_on: impl FnMut(&Fitter) -> bool,
    ) -> Vec<Result<Stop, String>> {
        let began = Instant::now();
        let params = start.params.clone();
        let state = if start.given { FitState::given(GivenStart::whole(params)) } else { FitState::at_start(params) };
        let begun = Fitter::starting_at(Arc::clone(&self.seen), *config, precision, state);
        *fitter = begun.map_err(|error| self.told(&error));
        let mut ended = false;
        let mut answers = Vec::with_capacity(stops.len());
        for &stop in stops {
            if let Ok(running) = fitter.as_mut()
                && !ended
            {
                match running.run_unseen(stop, |fitter| !go_on(fitter)) {
                    Ok(StopReason::Breakpoint) => return answers,
                    Ok(reason) => ended = reason == StopReason::Converged,
                    Err(why) => *fitter = Err(self.told(&why)),
                }
            }
            let fit_ms = milliseconds(began);
            answers.push(fitter.as_ref().map_err(Clone::clone).map(|fitter| Stop {
                numbers: self.numbers(fitter, start, ended),
                fit_ms,
                params: fitter.params().clone(),
            }));
        }
        answers
    }

    fn numbers(&self, fitter: &Fitter, start: &TimedStart, ended: bool) -> RunNumbers {
        let (report, params) = (fitter.report(), fitter.params());
        let reason = if ended { StopReason::Converged } else { StopReason::Iterations };
        let now = self.measured(fitter.config(), params);
        let before = self.measured(fitter.config(), &start.unrefined);
        RunNumbers {
            iterations: report.iteration,
            converged: report.converged,
            reason: reason.word().to_owned(),
            held: fitter.is_held(),
            loss: report.loss,
            terms: report.terms.map(Some),
            iou: report.iou.into_vec(),
            init_majpe_mm: before.majpe_mm,
            init_pa_majpe_mm: before.pa_majpe_mm,
            ..now
        }
    }

    /// What the labels say of `params`.
    fn measured(&self, config: &FitConfig, params: &Pppr) -> RunNumbers {
        let (frame, info) = (&self.frame, self.dataset.info());
        let joints = params.positions();
        let a_person = info.skeleton.joints.len();
        let errors = frame.truth.as_ref().and_then(|truth| joint_errors(joints, &truth.joints, a_person));
        let image = self.reprojection(joints, a_person);
        RunNumbers {
            majpe_mm: errors.map(|errors| errors.majpe_mm),
            pa_majpe_mm: errors.map(|errors| errors.pa_majpe_mm),
            ospa_mm: errors.map(|errors| errors.ospa_mm),
            persons: params.shape().persons,
            annotated: annotated(frame),
            reprojection_px: image.reprojection_px,
            box_coverage: image.box_coverage,
            map_box_coverage: self.map_box_coverage(config, joints, a_person),
            ..RunNumbers::default()
        }
    }

    /// Only where the data set publishes a camera; its key points count where the skeleton is theirs.
    fn reprojection(&self, joints: &[Vec3], a_person: usize) -> Reprojection {
        let info = self.dataset.info();
        let (Some(image), Some(camera)) = (&self.frame.image, info.layout.camera()) else {
            return Reprojection::default();
        };
        let preset = crate::body::Skeleton::preset(&image.keypoint_skeleton);
        let same = preset.is_some_and(|preset| preset.joints == info.skeleton.joints);
        let keypoints = if same { image.keypoints.as_slice() } else { &[] };
        reprojection(&camera, joints, a_person, keypoints, &image.boxes)
    }

    fn map_box_coverage(&self, config: &FitConfig, joints: &[Vec3], a_person: usize) -> Option<f64> {
        let views = self.problem.views_under(config).iter().zip(&self.frame.map_boxes);
        let shares: Vec<f64> =
            views.filter_map(|(view, boxes)| map_box_coverage(view, joints, a_person, boxes)).collect();
        (!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64)
    }

    /// An error with the frame's name: where the data set lies is no part of a row.
    fn told(&self, error: &dyn std::fmt::Display) -> String {
        format!("{}: {error}", self.frame.name)
    }
}

/// An error text without the folder of the data set, which may lie elsewhere on another machine.
pub(super) fn portable(dataset: &Dataset, text: &str) -> String {
    text.replace(&format!("{}{}", dataset.info().root.display(), std::path::MAIN_SEPARATOR), "")
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::body::{Group, PpprShape, Skeleton};
    use crate::config::{Background, FIELDS, InitConfig, StartPlace};
    use crate::geometry::Pose;
    use crate::mhp::simulate;
    use crate::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View};
    use crate::start::{find_start, start_key};

    fn view(array: &str, depth: AxisKind, across: AxisKind, [first, last]: [f64; 2]) -> View {
        let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        View {
            array: array.into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread {
                range_m: 0.06,
                azimuth_rad: 0.03,
                elevation_rad: 0.03,
                doppler_mps: 0.1,
                ..PointSpread::default()
            },
            pose: Pose::default(),
            axes: vec![axis(depth, 48, 6.0, 0.0), axis(across, 32, first, last)],
            region: None,
        }
    }

    /// A standing column of joints in weak speckle.
    fn problem() -> Problem {
        let views = vec![
            view("hori", AxisKind::DepthH, AxisKind::Y, [2.0, -2.0]),
            view("vert", AxisKind::DepthV, AxisKind::Z, [-2.0, 2.0]),
        ];
        let (radar, skeleton) = (RadarConfig::default(), Skeleton::preset("coco17").unwrap());
        let doppler_features = radar.doppler_features;
        let mut body = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features });
        for joint in 0..17 {
            body.set_vec3(Group::Position, joint, [3.0, 0.02 * (joint % 5) as f64, 0.6 - 0.1 * joint as f64]);
            body.set_vec3(Group::LogScale, joint, [0.08_f64.ln(); 3]);
            body.joint_mut(Group::Rotation, joint)[0] = 1.0;
        }
        let blank = vec![1.0; 48 * 32];
        let empty = Problem::new(radar.clone(), skeleton.clone(), views.clone(), &[&blank, &blank]).unwrap();
        let mut maps = simulate(&empty, &FitConfig::default(), Precision::F64, &body);
        for map in &mut maps {
            let top = map.iter().copied().fold(0.0, f64::max);
            for (k, cell) in map.iter_mut().enumerate() {
                *cell += 1e-2 * top * (0.5 + ((k as f64 * 12.9898).sin() * 43_758.545_3).fract().abs());
            }
        }
        let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        Problem::new(radar, skeleton, views, &maps).unwrap()
    }

    /// Every setting that is left out of the key is one that the start does not depend on.
    #[test]
    fn variants_with_one_key_have_one_start() {
        let (problem, base) = (Arc::new(problem()), FitConfig::default());
        let start = |config: &FitConfig| find_start(&problem, config).unwrap().initialisation.params;
        let same = start(&base);
        for field in FIELDS.iter().filter(|field| !field.read_by.by_cold_start()) {
            let mut variant = base;
            field.set(&mut variant, field.another(&base, 1));
            assert_eq!(start_key(&variant), start_key(&base), "{}", field.key);
            assert_eq!(start(&variant), same, "{}", field.key);
        }
        let others = [
            FitConfig { tau_pct: 40.0, ..base },
            FitConfig { surface_offset_m: 0.1, ..base },
            FitConfig { w_time: 3.0, ..base },
            FitConfig { place: StartPlace::Cluster, ..base },
            FitConfig { init: InitConfig { background: Background::Map, ..base.init }, ..base },
        ];
        for other in others {
            assert_ne!(start_key(&other), start_key(&base));
        }
        let several = |w_em, learning_rate| FitConfig { starts: 3, w_em, learning_rate, ..base };
        assert_eq!(start_key(&several(0.1, 1e-3)), start_key(&several(1.0, 0.1)));
        assert_eq!(start(&several(0.1, 1e-3)), start(&several(1.0, 0.1)), "L_EM decides between postures, no fit");
    }
}
