//! Strata of the data set and evidence on the fit on screen, both computed elsewhere.

use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::diagnose::Evidence;
use crate::digest;
use crate::session::effect::Effect;
use crate::session::evidence::EvidenceRequest;
use crate::session::fit::FitStatus;
use crate::session::state::{FitHashes, LogLevel, Session};
use crate::session::strata::{AT_ONCE, StrataStatus};
use crate::study::complexity::{Complexity, Stratum};
use sha2::{Digest as _, Sha256};
use std::sync::Arc;

impl Session {
    /// Grades a data set that was opened: small ones at once, large ones from what an earlier run left.
    pub(super) fn begin_strata(&mut self) -> Vec<Effect> {
        self.strata.clear();
        self.grade(self.data.len() > AT_ONCE)
    }

    pub(super) fn compute_strata(&mut self) -> Vec<Effect> {
        if matches!(self.strata.status, StrataStatus::Running { .. }) {
            return Vec::new();
        }
        self.grade(false)
    }

    fn grade(&mut self, only_kept: bool) -> Vec<Effect> {
        let Some(dataset) = self.data.dataset.clone() else { return Vec::new() };
        self.strata.status = StrataStatus::Running { done: 0, total: 0 };
        vec![Effect::ComputeStrata { dataset, only_kept }]
    }

    pub(super) fn strata_done(&mut self, result: Result<Option<Arc<Complexity>>, String>) -> Vec<Effect> {
        match result {
            Ok(Some(complexity)) => {
                if complexity.frames.len() != self.data.len() {
                    return Vec::new();
                }
                let failures = complexity.failures.len();
                self.strata.set(complexity);
                let [easy, medium, hard] =
                    [Stratum::Easy, Stratum::Medium, Stratum::Hard].map(|stratum| self.strata.count(stratum));
                self.note(LogLevel::Info, format!("strata: {easy} easy, {medium} medium, {hard} hard"));
                if failures > 0 {
                    self.note(LogLevel::Warning, format!("{failures} frames cannot be read; filter with readable:no"));
                }
            }
            Ok(None) => self.strata.status = StrataStatus::Absent,
            Err(why) => {
                self.note(LogLevel::Error, format!("the strata could not be computed: {why}"));
                self.strata.status = StrataStatus::Failed(why);
            }
        }
        Vec::new()
    }

    /// The hashes of the fit that is on screen.
    pub fn shown_hashes(&self) -> Option<&FitHashes> {
        self.fit.shown_hashes.as_ref()
    }

    /// Asks for the evidence of the fit on screen, once it has come to rest.
    pub(super) fn ask_evidence(&mut self) -> Vec<Effect> {
        if self.fit.status != FitStatus::Paused || self.is_dragging() || self.fit.replay.is_some() {
            return Vec::new();
        }
        let (Some(dataset), Some(frame), Some(problem), Some(snapshot), Some(fit)) =
            (&self.data.dataset, &self.data.frame, &self.fit.problem, &self.fit.shown, &self.fit.shown_hashes)
        else {
            return Vec::new();
        };
        if self.evidence.asked.as_ref().is_some_and(|(index, asked)| *index == frame.index && asked == fit) {
            return Vec::new();
        }
        let request = EvidenceRequest {
            dataset: Arc::clone(dataset),
            frame: Arc::clone(frame),
            problem: Arc::clone(problem),
            snapshot: Arc::clone(snapshot),
            fit: fit.clone(),
        };
        if self.evidence.frame != frame.index {
            self.evidence.found = None;
        }
        self.evidence.frame = frame.index;
        self.evidence.asked = Some((frame.index, fit.clone()));
        vec![Effect::Evidence(Box::new(request))]
    }

    pub(super) fn evidence_found(
        &mut self,
        frame: usize,
        fit: FitHashes,
        result: Result<Vec<Evidence>, String>,
    ) -> Vec<Effect> {
        if self.evidence.asked.as_ref().is_some_and(|asked| (asked.0, &asked.1) == (frame, &fit)) {
            if let Err(why) = &result {
                self.note(LogLevel::Warning, format!("no evidence for this frame: {why}"));
            }
            self.evidence.found = Some((fit, result));
        }
        Vec::new()
    }

    /// The newest evidence on a frame, F1 to F4 in order.
    pub fn evidence_of(&self, frame: usize) -> Option<&[Evidence]> {
        let (_, found) = self.evidence.found.as_ref().filter(|_| self.evidence.frame == frame)?;
        found.as_deref().ok()
    }

    /// True while the evidence on screen is older than the fit on screen.
    pub fn evidence_is_stale(&self) -> bool {
        let found = self.evidence.found.as_ref().filter(|_| self.evidence.frame == self.fit.frame);
        self.shown_hashes().is_none_or(|shown| found.is_none_or(|(of, _)| of != shown))
    }
}

/// Hashes of parameters (little-endian doubles) and settings (their TOML): the first 16 hexadecimal digits of SHA-256.
pub(super) fn hashes(params: &Pppr, config: &FitConfig, iteration: usize) -> FitHashes {
    let mut fit = Sha256::new();
    for x in Group::ALL.iter().flat_map(|&group| params.group(group)) {
        fit.update(x.to_le_bytes());
    }
    let settings = Sha256::new_with_prefix(config.to_toml());
    FitHashes { fit: digest::short(fit), config: digest::short(settings), iteration }
}
