//! The frame list: filter, order, and what "next" means.

use crate::session::command::Effect;
use crate::session::queue::{Facts, Reads, SavedView, Sort};
use crate::session::state::{FrameSummary, LogLevel, Session};

impl Session {
    pub(super) fn set_filter(&mut self, text: String) -> Vec<Effect> {
        self.queue.set_text(text);
        self.stale = true;
        Vec::new()
    }

    pub(super) fn set_sort(&mut self, sort: Sort) -> Vec<Effect> {
        if self.view.sort != sort {
            self.view.sort = sort;
            self.stale = true;
        }
        Vec::new()
    }

    pub(super) fn save_view(&mut self, name: &str) -> Vec<Effect> {
        let name = name.trim();
        if name.is_empty() || self.queue.error.is_some() {
            self.note(LogLevel::Error, "a saved view needs a name and a filter without error".into());
            return Vec::new();
        }
        let view = SavedView { name: name.into(), rule: self.queue.text.clone(), sort: self.view.sort };
        self.view.saved_views.retain(|known| known.name != name);
        self.view.saved_views.push(view);
        self.view.saved_views.sort_by(|a, b| a.name.cmp(&b.name));
        Vec::new()
    }

    pub(super) fn use_view(&mut self, name: &str) -> Vec<Effect> {
        let Some(view) = self.view.saved_views.iter().find(|view| view.name == name).cloned() else {
            return Vec::new();
        };
        self.set_filter(view.rule);
        self.set_sort(view.sort)
    }

    /// Along the queue: the next row, in the order of the list.
    pub(super) fn step_queue(&mut self, by: isize) -> Vec<Effect> {
        if let Some(frame) = self.queue.step(self.data.frame_index, by) {
            return self.goto_frame(frame);
        }
        let end = if by > 0 { "end" } else { "beginning" };
        self.hint(format!("this is the {end} of the queue: {}", self.queue_words()));
        Vec::new()
    }

    /// Along time: the next frame that matches, in the order of the data set.
    pub(super) fn step_frames(&mut self, by: isize) -> Vec<Effect> {
        if let Some(frame) = self.queue.step_in_time(self.data.frame_index, by) {
            return self.goto_frame(frame);
        }
        if self.data.playing {
            self.data.playing = false;
        } else if !self.queue.rule.is_empty() {
            self.hint(format!("no frame further that way: {}", self.queue_words()));
        }
        Vec::new()
    }

    pub(super) fn next_untagged(&mut self) -> Vec<Effect> {
        if let Some(frame) = self.queue.next_where(self.data.frame_index, |frame| !self.labels.is_judged(frame)) {
            return self.goto_frame(frame);
        }
        self.hint(format!("no other frame is untagged: {}", self.queue_words()));
        Vec::new()
    }

    pub(super) fn goto_last_edited(&mut self) -> Vec<Effect> {
        match self.labels.last_edited {
            Some(frame) => self.goto_frame(frame),
            None => Vec::new(),
        }
    }

    /// What the queue is, in words: `41 of 32,000 frames (stratum:hard)`.
    pub fn queue_words(&self) -> String {
        let (rows, all) = (self.queue.rows().len(), self.data.len());
        let plural = |n: usize| if n == 1 { "frame" } else { "frames" };
        if self.queue.rule.is_empty() {
            return format!("all {all} {}", plural(all));
        }
        format!("{rows} of {all} {} match “{}”", plural(all), self.queue.text.trim())
    }

    /// Fills the list again where something it depends on changed. While a fit runs, the order stays as it is: nothing
    /// jumps under the pointer.
    pub(super) fn refresh_queue(&mut self) {
        if !self.stale || self.fit.is_running() {
            return;
        }
        self.stale = false;
        if let Some(at) = self.queue.position(self.data.frame_index) {
            self.queue.last_position = at;
        }
        let mut queue = std::mem::take(&mut self.queue);
        let reads = queue.reads(self.view.sort);
        // Frames come in order, and so do the summaries: one walk along both, instead of a search for each.
        let mut summaries = self.summaries.iter().peekable();
        queue.fill(self.data.len(), self.view.sort, |frame| {
            while reads.fit && summaries.next_if(|(at, _)| **at < frame).is_some() {}
            let summary = summaries.peek().filter(|(at, _)| **at == frame).map(|(_, summary)| *summary);
            self.facts_of(frame, reads, summary)
        });
        self.queue = queue;
        if let Some(at) = self.queue.position(self.data.frame_index) {
            self.queue.last_position = at;
        }
    }

    /// Which facts the list depends on.
    pub(super) fn list_reads(&self) -> Reads {
        self.queue.reads(self.view.sort)
    }

    /// Everything that the list knows of a frame.
    pub fn facts(&self, index: usize) -> Facts<'_> {
        self.facts_of(index, Reads::ALL, self.summaries.get(&index))
    }

    /// What the list knows of a frame, as far as it is asked for.
    fn facts_of<'a>(&'a self, index: usize, reads: Reads, summary: Option<&'a FrameSummary>) -> Facts<'a> {
        let mut facts = Facts { index, ..Facts::default() };
        let Some(dataset) = &self.data.dataset else { return facts };
        let mode = self.view.label_mode;
        if reads.name {
            facts.name = dataset.frame_name(index);
        }
        if reads.scene {
            facts.scene = dataset.sequence(index);
        }
        if reads.strata {
            self.add_strata(&mut facts);
        }
        if reads.fit
            && let Some(summary) = summary
        {
            facts.iou = summary.iou;
            facts.loss = summary.loss;
            facts.terms = Some(&summary.terms);
            facts.iterations = summary.iterations;
            facts.converged = summary.converged;
            facts.reason = summary.reason.as_deref();
            facts.majpe_mm = summary.majpe_mm;
        }
        if reads.tags {
            facts.tags = self.labels.visible_tags(index, mode);
            facts.own_tags = self.labels.tags(index);
        }
        if reads.said
            && let Some(record) = self.labels.mine(index)
        {
            facts.note = &record.label.note;
            facts.verdict = record.label.verdict;
        }
        if reads.annotators {
            facts.annotators = self.labels.visible_annotators(index, mode);
        }
        facts
    }

    fn add_strata(&self, facts: &mut Facts<'_>) {
        facts.readable = self.strata.is_readable(facts.index);
        if let Some(complexity) = self.strata.of(facts.index) {
            facts.stratum = complexity.stratum;
            facts.hardness = complexity.hardness;
            facts.peak_density = complexity.statistics.peak_density;
            facts.static_dominance = complexity.statistics.static_dominance;
            facts.human_saliency = complexity.statistics.human_saliency;
        }
    }
}
