//! Acts of labelling: what a key or a field asks for becomes a commit; what the journal acknowledges becomes visible.

use crate::labels::{CellRegion, Change, FrameId, Judged, Label, LabelPlace, Record, Tag, Verdict};
use crate::session::command::{Commit, Effect, Written};
use crate::session::labels::{ActKind, LabelMode, LabelStatus, LabelTable};
use crate::session::queue::SortKey;
use crate::session::state::{LogLevel, Session};

impl Session {
    /// The frames that the next act is for: the selected ones, else the one on screen.
    pub fn label_targets(&self) -> Vec<usize> {
        if !self.labels.selection.is_empty() {
            return self.labels.selection.iter().copied().collect();
        }
        if self.data.is_empty() { Vec::new() } else { vec![self.data.frame_index] }
    }

    pub(super) fn toggle_tag(&mut self, tag: Tag) -> Vec<Effect> {
        let frames = self.label_targets();
        let all_have = frames.iter().all(|&frame| self.labels.expected(frame).tags.contains(tag));
        let (verb, change) = if all_have { ("untag", Change::removing(tag)) } else { ("tag", Change::adding(tag)) };
        self.commit(&format!("{verb} {tag}"), &frames, &change)
    }

    pub(super) fn set_note(&mut self, frames: &[usize], note: String) -> Vec<Effect> {
        self.commit("note", frames, &Change { note: Some(note), ..Change::default() })
    }

    pub(super) fn set_person(&mut self, person: Option<u32>) -> Vec<Effect> {
        let frames = self.label_targets();
        self.commit("person", &frames, &Change { person: Some(person), ..Change::default() })
    }

    /// A region is of one map: it goes to the frame on screen, whatever is selected.
    pub(super) fn set_region(&mut self, region: Option<CellRegion>) -> Vec<Effect> {
        let name = if region.is_some() { "mark cells" } else { "unmark cells" };
        self.commit(name, &[self.data.frame_index], &Change { region: Some(region), ..Change::default() })
    }

    pub(super) fn set_verdict(&mut self, verdict: Option<Verdict>) -> Vec<Effect> {
        let frames = self.label_targets();
        let name = verdict.map_or_else(|| "no verdict".into(), |verdict| format!("verdict {verdict}"));
        self.commit(&name, &frames, &Change { verdict: Some(verdict), ..Change::default() })
    }

    pub(super) fn clear_label(&mut self) -> Vec<Effect> {
        let frames = self.label_targets();
        let changes: Vec<(usize, Change)> = frames
            .iter()
            .map(|&frame| (frame, Change::between(&self.labels.expected(frame), &Label::default())))
            .collect();
        self.commit_each(ActKind::Do, with_count("clear label", frames.len()), changes)
    }

    fn commit(&mut self, act: &str, frames: &[usize], change: &Change) -> Vec<Effect> {
        let changes = frames.iter().map(|&frame| (frame, change.clone())).collect();
        self.commit_each(ActKind::Do, with_count(act, frames.len()), changes)
    }

    /// Asks the journal for an act. Frames whose label would not change are left out.
    fn commit_each(&mut self, kind: ActKind, act: String, changes: Vec<(usize, Change)>) -> Vec<Effect> {
        match &self.labels.status {
            LabelStatus::Ready => {}
            LabelStatus::Failed(why) => {
                let text = format!("nothing was tagged: {why}");
                self.note(LogLevel::Error, text);
                return Vec::new();
            }
            LabelStatus::Opening | LabelStatus::Closed => {
                self.note(LogLevel::Warning, "nothing was tagged: the journal is not open yet".into());
                return Vec::new();
            }
        }
        let Some(dataset) = self.data.dataset.clone() else { return Vec::new() };
        let wanted: Vec<(FrameId, Change)> = changes
            .into_iter()
            .filter(|(frame, change)| {
                let label = self.labels.expected(*frame);
                change.applied(&label) != label
            })
            .map(|(index, change)| (FrameId { path: dataset.frame_name(index).to_owned(), index }, change))
            .collect();
        if wanted.is_empty() {
            return Vec::new();
        }
        self.labels.next_act += 1;
        let id = self.labels.next_act;
        let changes = wanted.iter().map(|(frame, change)| (frame.clone(), change.clone(), self.judged(frame.index)));
        let commit = Commit { id, kind, act, changes: changes.collect() };
        self.labels.pending.push((id, wanted));
        vec![Effect::CommitLabels(commit)]
    }

    /// The fit that is judged when `frame` is labelled now: the one on screen, or the one that was left there.
    fn judged(&self, frame: usize) -> Judged {
        // While another frame is being read, the fit on screen is still that of the frame before.
        let shown = self.shown_hashes().filter(|_| self.fit.frame == frame);
        let Some(hashes) = shown else {
            let summary = self.summaries.get(&frame).and_then(|summary| summary.hashes.clone());
            return summary.map_or_else(Judged::default, |hashes| Judged {
                fit: Some(hashes.fit),
                config: Some(hashes.config),
                iteration: Some(hashes.iteration),
                ..Judged::default()
            });
        };
        // Scores of an older fit say nothing of the one that is judged.
        let machine = self.evidence_of(frame).filter(|_| !self.evidence_is_stale()).into_iter().flatten();
        Judged {
            fit: Some(hashes.fit),
            config: Some(hashes.config),
            iteration: Some(hashes.iteration),
            machine: machine.filter_map(|evidence| Some((evidence.mode, evidence.score?))).collect(),
            machine_shown: !self.evidence_hidden_of(frame),
        }
    }

    /// True while the evidence of the frame on screen is hidden: in blind mode, until the annotator has judged it.
    pub fn evidence_hidden(&self) -> bool {
        self.evidence_hidden_of(self.data.frame_index)
    }

    fn evidence_hidden_of(&self, frame: usize) -> bool {
        self.view.label_mode == LabelMode::Agreement && self.view.blind && !self.labels.is_judged(frame)
    }

    pub(super) fn undo(&mut self) -> Vec<Effect> {
        if self.labels.undo_name().is_none() {
            return Vec::new();
        }
        let Some(act) = self.labels.undo.last().cloned() else { return Vec::new() };
        let changes =
            act.changes.iter().map(|(id, before, after)| (id.index, Change::between(after, before))).collect();
        self.again(ActKind::Undo, &act.name, changes)
    }

    pub(super) fn redo(&mut self) -> Vec<Effect> {
        if self.labels.redo_name().is_none() {
            return Vec::new();
        }
        let Some(act) = self.labels.redo.last().cloned() else { return Vec::new() };
        let changes =
            act.changes.iter().map(|(id, before, after)| (id.index, Change::between(before, after))).collect();
        self.again(ActKind::Redo, &act.name, changes)
    }

    fn again(&mut self, kind: ActKind, name: &str, changes: Vec<(usize, Change)>) -> Vec<Effect> {
        let effects = self.commit_each(kind, name.to_owned(), changes);
        if effects.is_empty() {
            self.labels.forget(kind);
            self.hint(format!("“{name}” is gone already: another window changed the same labels"));
        }
        effects
    }

    /// The journals were read, or could not be.
    pub(super) fn labels_opened(
        &mut self,
        id: u64,
        result: Result<(LabelPlace, LabelTable, Vec<String>), String>,
    ) -> Vec<Effect> {
        if id != self.labels.opening {
            return Vec::new();
        }
        match result {
            Ok((place, table, warnings)) => {
                for warning in warnings {
                    self.note(LogLevel::Warning, warning);
                }
                if let Some(reason) = &place.reason {
                    let text = format!("labels are kept in {}: {reason}", place.folder.display());
                    self.note(LogLevel::Warning, text);
                }
                let mine = table.get(&self.labels.annotator);
                self.labels.last_edited = mine
                    .and_then(|records| records.iter().max_by(|a, b| a.1.time.cmp(&b.1.time)).map(|(&frame, _)| frame));
                self.labels.place = Some(place);
                self.labels.table = table;
                self.labels.status = LabelStatus::Ready;
            }
            Err(why) => {
                self.note(LogLevel::Error, format!("labels cannot be kept: {why}"));
                self.labels.status = LabelStatus::Failed(why);
            }
        }
        self.labels.revision += 1;
        self.stale = true;
        Vec::new()
    }

    /// The journal acknowledged an act, or could not write it.
    pub(super) fn labels_written(&mut self, written: Written) -> Vec<Effect> {
        let Written { id, kind, act, result } = written;
        // An act for a journal that was closed meanwhile is on disk, but no longer of what is on screen.
        let Some(at) = self.labels.pending.iter().position(|(pending, _)| *pending == id) else { return Vec::new() };
        self.labels.pending.remove(at);
        match result {
            Ok(outcomes) => {
                self.labels.written(kind, act, outcomes);
                self.labels_changed();
            }
            Err(why) => {
                self.note(LogLevel::Error, format!("“{act}” was not written and is not done: {why}"));
            }
        }
        Vec::new()
    }

    /// Another window or another annotator wrote.
    pub(super) fn labels_refreshed(&mut self, table: LabelTable) -> Vec<Effect> {
        if self.labels.status == LabelStatus::Ready {
            self.labels.table = table;
            self.labels.revision += 1;
            self.labels_changed();
        }
        Vec::new()
    }

    /// Fills the list again where its filter or its order depends on labels.
    fn labels_changed(&mut self) {
        let ordered = matches!(self.view.sort.key, SortKey::Tags | SortKey::Annotator);
        self.stale |= ordered || self.queue.rule.reads_labels();
    }

    pub(super) fn set_annotator(&mut self, name: &str) -> Vec<Effect> {
        let name = name.trim();
        if name.is_empty() {
            self.note(LogLevel::Error, "an annotator needs a name; nothing was changed".into());
            return Vec::new();
        }
        if name == self.labels.annotator {
            return Vec::new();
        }
        name.clone_into(&mut self.labels.annotator);
        self.open_labels()
    }

    /// Reads the journals of the open data set for the annotator.
    pub(super) fn open_labels(&mut self) -> Vec<Effect> {
        let Some(dataset) = self.data.dataset.clone() else { return Vec::new() };
        self.labels.close();
        self.labels.status = LabelStatus::Opening;
        self.labels.next_act += 1;
        let id = self.labels.next_act;
        self.labels.opening = id;
        vec![Effect::OpenLabels { id, dataset, annotator: self.labels.annotator.clone() }]
    }

    /// What a record says of the fit on screen: `None` where it was judged on the very same, or on none.
    pub fn judged_elsewhere(&self, record: &Record) -> Option<String> {
        let judged = record.judged.fit.as_ref()?;
        let shown = self.shown_hashes();
        if shown.as_ref().is_some_and(|hashes| hashes.fit == *judged) {
            return None;
        }
        let at = record.judged.iteration.map_or_else(String::new, |k| format!(" (iteration {k}"));
        let settings = match (&record.judged.config, &shown) {
            (Some(config), Some(shown)) if *config != shown.config => ", other settings",
            _ => "",
        };
        let close = if at.is_empty() { "" } else { ")" };
        Some(format!("judged on another fit{at}{settings}{close}"))
    }
}

fn with_count(act: &str, frames: usize) -> String {
    if frames > 1 { format!("{act} on {frames} frames") } else { act.to_owned() }
}
