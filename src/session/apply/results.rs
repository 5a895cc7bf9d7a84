//! Results of a batch that was fitted elsewhere come into the frame list.

use crate::session::effect::{Effect, Trash};
use crate::session::results::FoundResults;
use crate::session::state::{LogLevel, Session};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Session {
    pub(super) fn load_results(&mut self, path: PathBuf) -> Vec<Effect> {
        let Some(dataset) = self.data.dataset.clone() else {
            if self.data.opening.is_some() {
                self.waiting_results = Some(path);
            } else {
                let text = format!("{}: open the data set first that these results are of", path.display());
                self.note(LogLevel::Error, text);
            }
            return Vec::new();
        };
        vec![Effect::ReadResults(path, dataset)]
    }

    /// Results that were asked for while their data set was being opened.
    pub(super) fn load_waiting_results(&mut self) -> Vec<Effect> {
        self.waiting_results.take().map_or_else(Vec::new, |path| self.load_results(path))
    }

    /// A table of results was read, or could not be. A frame that was fitted in this session keeps what its fit says.
    pub(super) fn results_read(&mut self, path: &Path, result: Result<Box<FoundResults>, String>) -> Vec<Effect> {
        let found = match result {
            Ok(found) => *found,
            Err(why) => {
                self.note(LogLevel::Error, why);
                return Vec::new();
            }
        };
        if self.data.dataset.as_ref().is_none_or(|dataset| !Arc::ptr_eq(dataset, &found.dataset)) {
            return Vec::new();
        }
        let FoundResults { mut summaries, unknown, first_unknown, .. } = found;
        let matched = summaries.len();
        let mut kept = 0;
        let own = self.summaries.iter().filter(|(_, summary)| summary.hashes.is_some());
        for (&frame, summary) in own {
            kept += usize::from(summaries.insert(frame, summary.clone()).is_some());
        }
        self.batch.forget();
        let of_row = self.study.shown_row(path);
        self.results_from = of_row.or_else(|| Some(path.file_name()?.to_string_lossy().into_owned()));
        let old = std::mem::replace(self.summaries.change(), summaries);
        self.tell_results(&path.display().to_string(), [matched, kept, unknown], first_unknown.as_deref());
        if old.len() > kept { vec![Effect::Free(Trash::new(old))] } else { Vec::new() }
    }

    fn tell_results(&mut self, path: &str, [matched, kept, unknown]: [usize; 3], first_unknown: Option<&str>) {
        let of = self.data.len();
        let mut text = format!("{path}: results of {matched} of {of} frames");
        if kept > 0 {
            let _ = write!(text, "; {kept} of them were fitted here and keep their own");
        }
        if let Some(first) = first_unknown {
            let _ = write!(text, "; {unknown} rows are of frames that are not in this data set, for example {first}");
        }
        if matched == 0 { self.note(LogLevel::Error, text) } else { self.hint(text) }
    }
}
