//! The frame list: filter, order, and what "next" means.

use crate::session::command::Effect;
use crate::session::queue::{Facts, SavedView, Sort};
use crate::session::state::{LogLevel, Session};

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
        queue.fill(self.data.len(), self.view.sort, |frame| self.facts(frame));
        self.queue = queue;
        if let Some(at) = self.queue.position(self.data.frame_index) {
            self.queue.last_position = at;
        }
    }

    /// Everything that the list knows of a frame.
    pub fn facts(&self, index: usize) -> Facts<'_> {
        let Some(dataset) = &self.data.dataset else { return Facts::default() };
        let complexity = self.strata.of(index);
        let summary = self.summaries.get(&index);
        let visible = self.labels.visible(index, self.view.label_mode);
        let mine = self.labels.mine(index);
        Facts {
            index,
            name: dataset.frame_name(index),
            scene: dataset.sequence(index),
            readable: self.strata.is_readable(index),
            stratum: complexity.and_then(|c| c.stratum),
            hardness: complexity.and_then(|c| c.hardness),
            peak_density: complexity.and_then(|c| c.statistics.peak_density),
            static_dominance: complexity.and_then(|c| c.statistics.static_dominance),
            human_saliency: complexity.and_then(|c| c.statistics.human_saliency),
            iou: summary.and_then(|s| s.iou),
            loss: summary.map(|s| s.loss),
            iterations: summary.map(|s| s.iterations),
            converged: summary.map(|s| s.converged),
            reason: summary.and_then(|s| s.reason.as_deref()),
            majpe_mm: summary.and_then(|s| s.majpe_mm),
            tags: visible.tags,
            own_tags: mine.map(|record| record.label.tags).unwrap_or_default(),
            note: mine.map_or("", |record| record.label.note.as_str()),
            verdict: mine.and_then(|record| record.label.verdict),
            annotators: visible.annotators,
        }
    }
}
