//! Restart cloud: a frame fitted from many starts, and its ends grouped into basins. Is the frame ambiguous, or was the start
//! unlucky?
//!
//! All fits have the EM region of the fit on screen, so that their losses can be compared. The first start is that fit's own,
//! as it was found; the others are spread around it ([`RestartSettings`]). Two ends are as far apart as their joints are on the
//! mean; ends are joined by average linkage (kodama) as long as that is less than [`RestartSettings::apart_mm`]. Basins are in
//! the order of the lowest loss in each, so that the first is the best.

mod basins;
mod starts;

pub use basins::{Basin, Telling, heading};
pub use starts::{StartFeature, StartOffset};

use super::Halt;
use super::cores::{Hand, IdleCores, each};
use super::state::ExploredState;
use super::task::Showing;
use crate::body::Pppr;
use crate::diagnose::joint_errors;
use crate::geometry::Vec3;
use crate::mhp::{FitState, Fitter, StopReason, Terms};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What a person chose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RestartSettings {
    /// How many starts.
    pub starts: usize,
    /// Standard deviation of their place on the floor, m; in height a quarter of it.
    pub position_m: f64,
    /// They are turned by as much to either side at most, degrees.
    pub yaw_deg: f64,
    /// Standard deviation of the turn of each limb, degrees.
    pub posture_deg: f64,
    /// Ends farther apart are of two basins, mm.
    pub apart_mm: f64,
    /// Of the random numbers.
    pub seed: u64,
}

impl Default for RestartSettings {
    fn default() -> Self {
        Self { starts: 200, position_m: 0.15, yaw_deg: 180.0, posture_deg: 5.0, apart_mm: 200.0, seed: 1 }
    }
}

impl RestartSettings {
    /// The ranges that are accepted: starts, position, yaw, posture, distance.
    pub const RANGES: [(f64, f64); 5] = [(2.0, 2000.0), (0.0, 2.0), (0.0, 180.0), (0.0, 60.0), (5.0, 1000.0)];

    /// With numbers in their ranges, whatever a file says.
    #[must_use]
    pub fn in_range(self) -> Self {
        let [starts, position, yaw, posture, apart] = Self::RANGES;
        let held = |x: f64, (lo, hi): (f64, f64)| if x.is_finite() { x.clamp(lo, hi) } else { lo };
        Self {
            starts: held(self.starts as f64, starts) as usize,
            position_m: held(self.position_m, position),
            yaw_deg: held(self.yaw_deg, yaw),
            posture_deg: held(self.posture_deg, posture),
            apart_mm: held(self.apart_mm, apart),
            seed: self.seed,
        }
    }
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct RestartRequest {
    /// The fit: its parameters are its start.
    pub state: ExploredState,
    /// How the starts are spread.
    pub settings: RestartSettings,
    /// The joints of the truth, where the frame has it, m.
    pub truth: Option<Arc<[Vec3]>>,
}

impl RestartRequest {
    /// Whether another one asks for the same fits, grouped in the same way.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.settings == other.settings && self.state.is_same(&other.state)
    }
}

/// One fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Restart {
    /// How its start differs from the first one.
    pub offset: StartOffset,
    /// Its start.
    pub start: Arc<Pppr>,
    /// Its end.
    pub end: Arc<Pppr>,
    /// L at the end.
    pub loss: f64,
    /// Its unweighted terms.
    pub terms: Terms,
    /// Mean forward-consistency IoU.
    pub iou: Option<f64>,
    /// MAJPE, mm, where there is truth.
    pub majpe_mm: Option<f64>,
}

/// The fits that are done, and their basins.
#[derive(Debug, Clone, PartialEq)]
pub struct RestartCloud {
    /// Every start by its number; `None` where it is not fitted yet, or the fit diverged.
    pub restarts: Vec<Option<Arc<Restart>>>,
    /// Fits that are done, those that diverged included.
    pub done: usize,
    /// The basins, the best first.
    pub basins: Vec<Basin>,
    /// How the starts are spread.
    pub settings: RestartSettings,
    /// Settings of the fits.
    pub config: crate::config::FitConfig,
    /// Joints a person.
    pub joints: usize,
}

impl RestartCloud {
    /// Share of the fits that end in the best basin; `None` before there is one.
    pub fn best_share(&self) -> Option<f64> {
        self.basins.first().map(|basin| basin.share)
    }

    /// Whether all fits are done.
    pub fn is_complete(&self) -> bool {
        self.done == self.restarts.len()
    }

    /// Fits that did not come to an end.
    pub fn diverged(&self) -> usize {
        self.done - self.restarts.iter().flatten().count()
    }

    /// The basin that a start ends in.
    pub fn basin_of(&self, restart: usize) -> Option<usize> {
        self.basins.iter().position(|basin| basin.members.contains(&restart))
    }

    /// What it says: is the frame ambiguous, or was the start unlucky?
    pub fn verdict(&self) -> String {
        let Some(best) = self.basins.first() else { return "no fit came to an end".to_owned() };
        let (all, pct) = (self.done, 100.0 * best.share);
        let own = self.basin_of(0);
        let said = match (own, best.share) {
            (Some(0), share) if share >= 0.9 => "one basin: neither ambiguous nor unlucky",
            (Some(0), _) => "the fit's own start ends in the best basin, but others do not",
            (Some(_), share) if share >= 0.5 => "the start was unlucky: most others end lower",
            (Some(_), _) => "ambiguous, and the fit's own start misses the best basin",
            (None, _) => "the fit's own start came to no end",
        };
        let plural = if self.basins.len() == 1 { "" } else { "s" };
        format!("{pct:.0} % of {all} starts end in the best of {} basin{plural}: {said}", self.basins.len())
    }
}

/// Fits from all starts; shows the cloud as it fills.
///
/// # Errors
/// Where no fit can be set up, or it was cancelled.
pub(super) fn explore(
    request: &RestartRequest,
    cores: &IdleCores,
    show: &Showing<'_, RestartCloud>,
) -> Result<RestartCloud, Halt> {
    let RestartRequest { state, truth, .. } = request;
    let (seen, settings) = (state.seen()?, request.settings.in_range());
    let joints = state.params.shape().joints.max(1);
    // What cannot be fitted is told before threads begin.
    state.objective(&seen)?;
    let mut cloud = RestartCloud {
        restarts: vec![None; settings.starts],
        done: 0,
        basins: Vec::new(),
        settings,
        config: state.config,
        joints,
    };
    let fitter = || {
        let fitter = Fitter::new(Arc::clone(&seen), state.config, state.precision, state.initial.clone());
        fitter.map_err(|error| Halt::Failed(error.to_string()))
    };
    let fit = |fitter: &mut Result<Fitter, Halt>, number: usize, hand: &Hand<'_>| -> Result<Option<Restart>, Halt> {
        let fitter = fitter.as_mut().map_err(|halt| halt.clone())?;
        let (offset, start) = starts::start(&state.params, &seen.skeleton, &settings, number);
        if fitter.restore(Arc::new(FitState::at_start(start.clone()))).is_err() {
            return Ok(None);
        }
        match fitter.run_unseen(state.config.iterations, |_| !hand.go_on()) {
            Ok(StopReason::Breakpoint) => return Err(Halt::Cancelled),
            Ok(_) => {}
            Err(_) => return Ok(None),
        }
        let (report, end) = (fitter.report(), fitter.params().clone());
        let known: Vec<f64> = report.iou.iter().flatten().copied().collect();
        let errors = truth.as_ref().and_then(|truth| joint_errors(end.positions(), truth, joints));
        Ok(Some(Restart {
            offset,
            start: Arc::new(start),
            loss: report.loss,
            terms: report.terms,
            iou: (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64),
            majpe_mm: errors.map(|errors| errors.majpe_mm),
            end: Arc::new(end),
        }))
    };
    show.begin("fitting", settings.starts);
    each((cores, show.progress()), settings.starts, fitter, fit, |number, restart| {
        cloud.restarts[number] = restart.map(Arc::new);
        cloud.done += 1;
        show.advance(1);
        show.maybe(false, || {
            let mut cloud = cloud.clone();
            cloud.basins = basins::group(&cloud.restarts, cloud.done, &seen.skeleton, &settings);
            cloud
        });
    })?;
    cloud.basins = basins::group(&cloud.restarts, cloud.done, &seen.skeleton, &settings);
    Ok(cloud)
}
