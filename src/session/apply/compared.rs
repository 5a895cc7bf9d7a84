//! Results are kept as A or B, to be compared in the list.

use crate::config::from_preset;
use crate::session::compared::{ResultSet, ResultSide};
use crate::session::effect::{Effect, Trash};
use crate::session::state::{LogLevel, Session};

impl Session {
    /// Keeps what the list says now of the fits.
    pub(super) fn keep_results(&mut self, side: ResultSide) -> Vec<Effect> {
        let name = self.results_name();
        let set = ResultSet::of(name, self.data.len(), &self.summaries);
        if set.is_empty() {
            self.note(LogLevel::Warning, "no frame of the list has a fit: there is nothing to keep".into());
            return Vec::new();
        }
        self.hint(format!("{}: {} frames, {}", side.letter(), set.len(), set.name));
        self.results.set(side, Some(set));
        Vec::new()
    }

    pub(super) fn forget_results(&mut self, side: ResultSide) -> Vec<Effect> {
        self.results.set(side, None);
        Vec::new()
    }

    /// What the results in the list are of, in words.
    pub fn results_name(&self) -> String {
        if let Some(of) = &self.batch.shown {
            return from_preset(&of.config);
        }
        self.results_from.clone().unwrap_or_else(|| "fits of this session".into())
    }

    /// Takes both out, as of a data set that was just opened.
    pub(super) fn clear_results(&mut self) -> Vec<Effect> {
        if !self.results.any() {
            return Vec::new();
        }
        let old = self.results.saved();
        for side in ResultSide::ALL {
            self.results.set(side, None);
        }
        vec![Effect::Free(Trash::new(old))]
    }
}
