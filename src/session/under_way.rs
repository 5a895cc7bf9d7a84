//! What would be cut off by leaving now.

use super::state::Session;
use super::work::WorkStatus;

impl Session {
    /// Whether fits are under way that nothing must slow down: a run as fast as it goes, a batch, a study.
    pub fn needs_cores(&self) -> bool {
        let run = self.fit.is_running() && (self.pace.is_none() || self.fit.run.0 == self.fit.refit_run);
        run || self.batch.work.takes_cores() || self.study.work.takes_cores()
    }

    /// What is under way that leaving would cut off, a sentence each that says what of it is kept; empty where nothing is
    /// lost by leaving.
    pub fn under_way(&self) -> Vec<String> {
        let mut said = Vec::new();
        if self.fit.is_running() {
            let name = self.data.frame.as_ref().map_or("the frame", |frame| frame.name.as_str());
            let at = self.fit.head();
            said.push(format!("The fit of {name} runs, iteration {at}. It is kept only in a saved session."));
        }
        if let WorkStatus::Running { done, total, .. } = self.batch.work.status {
            said.push(format!("{done} of {total} listed frames are fitted. Those are kept; the others are not begun."));
        }
        if let WorkStatus::Running { done, total, .. } = self.study.work.status {
            said.push(format!(
                "{done} of {total} fits of a study are done. Those are kept; the same study goes on from there."
            ));
        }
        match self.writing {
            0 => {}
            1 => said.push("A file is being written. Cut off, it is not there at all.".into()),
            n => said.push(format!("{n} files are being written. Cut off, they are not there at all.")),
        }
        said
    }
}
