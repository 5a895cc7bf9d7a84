//! The frame list: filter, order, and what "next" means.

use crate::session::compared::ResultSide;
use crate::session::effect::Effect;
use crate::session::queue::{FrameRow, ListedFrom, Reads, SavedView, Sort};
use crate::session::sources::Source;
use crate::session::state::{FrameSummary, LogLevel, Session};

impl Session {
    pub(super) fn set_filter(&mut self, text: String) -> Vec<Effect> {
        self.queue.set_text(text);
        Vec::new()
    }

    pub(super) fn set_sort(&mut self, sort: Sort) -> Vec<Effect> {
        self.view.sort = sort;
        Vec::new()
    }

    pub(super) fn save_view(&mut self, name: &str) -> Vec<Effect> {
        let name = name.trim();
        if name.is_empty() || self.queue.error.is_some() {
            self.note(LogLevel::Error, "a saved view needs a name and a filter without error".into());
            return Vec::new();
        }
        let view = SavedView { name: name.into(), filter: self.queue.text.clone(), sort: self.view.sort };
        self.view.saved_views.retain(|known| known.name != name);
        self.view.saved_views.push(view);
        self.view.saved_views.sort_by(|a, b| a.name.cmp(&b.name));
        Vec::new()
    }

    pub(super) fn use_view(&mut self, name: &str) -> Vec<Effect> {
        let Some(view) = self.view.saved_views.iter().find(|view| view.name == name).cloned() else {
            return Vec::new();
        };
        self.set_filter(view.filter);
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
        } else if !self.queue.filter.is_empty() {
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
        if self.queue.filter.is_empty() {
            return format!("all {all} {}", plural(all));
        }
        format!("{rows} of {all} {} match “{}”", plural(all), self.queue.text.trim())
    }

    /// Fills the list again where something it depends on changed. While a fit runs, the order stays as it is: nothing
    /// jumps under the pointer.
    pub(super) fn refresh_queue(&mut self) {
        let from = self.listed_from();
        if self.listed == Some(from) || self.fit.is_running() {
            return;
        }
        self.listed = Some(from);
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
            self.row_of(frame, reads, summary)
        });
        self.queue = queue;
        if let Some(at) = self.queue.position(self.data.frame_index) {
            self.queue.last_position = at;
        }
    }

    /// What the list would be filled from now.
    fn listed_from(&self) -> ListedFrom {
        let reads = self.queue.reads(self.view.sort);
        ListedFrom {
            frames: self.data.len(),
            filter: self.queue.filter.revision(),
            strata: self.strata.revision(),
            fits: reads.fit.then(|| self.summaries.revision()),
            labels: reads.labels().then(|| self.labels.revision()),
            basins: reads.basins.then(|| self.best_basins.revision()),
            results: reads.results.then(|| (self.results.revision(), self.view.compared)),
            sources: reads.sources.then(|| (self.sources.revision(), reads.to_fits.then(|| self.summaries.revision()))),
            sort: self.view.sort,
            label_mode: self.view.label_mode,
        }
    }

    /// Everything that the list knows of a frame.
    pub fn frame_row(&self, index: usize) -> FrameRow<'_> {
        self.row_of(index, Reads::ALL, self.summaries.get(&index))
    }

    /// What the list knows of a frame, as far as it is asked for.
    fn row_of<'a>(&'a self, index: usize, reads: Reads, summary: Option<&'a FrameSummary>) -> FrameRow<'a> {
        let mut row = FrameRow { index, ..FrameRow::default() };
        let Some(dataset) = &self.data.dataset else { return row };
        let mode = self.view.label_mode;
        if reads.name {
            row.name = dataset.frame_name(index);
        }
        if reads.sequence {
            row.sequence = dataset.sequence(index);
        }
        if reads.origin {
            row.origin = dataset.origin(index);
        }
        if reads.strata {
            self.add_strata(&mut row);
        }
        if reads.fit
            && let Some(summary) = summary
        {
            row.iou = summary.iou;
            row.loss = summary.loss;
            row.terms = Some(&summary.terms);
            row.iterations = summary.iterations;
            row.converged = summary.converged;
            row.reason = summary.reason.as_deref();
            row.mismatch = summary.people.zip(summary.annotated).map(|(people, annotated)| people != annotated);
            row.majpe_mm = summary.majpe_mm;
        }
        if reads.basins {
            row.best_basin = self.best_basins.get(&index).copied();
        }
        if reads.results {
            row.results = ResultSide::ALL.map(|side| self.results.value(side, index, self.view.compared));
        }
        if reads.sources {
            let joints = dataset.info().skeleton.joints.len();
            let fit = (reads.to_fits && !self.sources.is_empty()).then(|| self.fit_joints(index)).flatten();
            let of = |source: &'a Source| (source.name(), source.numbers(index, fit.as_deref(), joints));
            row.sources = self.sources.list().iter().map(of).collect();
        }
        if reads.tags {
            row.tags = self.labels.visible_tags(index, mode);
            row.own_tags = self.labels.tags(index);
        }
        if reads.said
            && let Some(record) = self.labels.mine(index)
        {
            row.note = &record.label.note;
            row.verdict = record.label.verdict;
        }
        if reads.annotators {
            row.annotators = self.labels.visible_annotators(index, mode);
        }
        row
    }

    fn add_strata(&self, row: &mut FrameRow<'_>) {
        row.readable = self.strata.is_readable(row.index);
        if let Some(complexity) = self.strata.of(row.index) {
            row.stratum = complexity.stratum;
            row.hardness = complexity.hardness;
            row.peak_density = complexity.statistics.peak_density;
            row.static_dominance = complexity.statistics.static_dominance;
            row.human_saliency = complexity.statistics.human_saliency;
        }
    }
}
