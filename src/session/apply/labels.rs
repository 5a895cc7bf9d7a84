//! Acts of labelling: what a key or a field asks for becomes a commit; what the journal acknowledges becomes visible.

use crate::labels::{CellRegion, Change, Judged, LabelPlace, Record, Tag, Verdict};
use crate::mhp::ErasedCells;
use crate::session::acts::{ActKind, Asked};
use crate::session::effect::{Commit, Effect, Trash};
use crate::session::labels::{LabelMode, LabelStatus, LabelTable};
use crate::session::report::{OpenedLabels, Written};
use crate::session::state::{FitHashes, LogLevel, Session};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Acts on more frames are told of, and how to take them back: nobody has all of them in sight.
const IN_SIGHT: usize = 20;
/// Acts on so many frames are looked at before they are sent, to tell whether they would change anything; of larger ones
/// the journal's thread tells.
const LOOKED_AT: usize = 64;
/// So many records take long enough to free that another thread does it.
const MANY: usize = 1000;

impl Session {
    /// The frames that the next act is for, in the order of the data set: the selected ones, else the one on screen.
    pub fn label_targets(&self) -> Arc<[u32]> {
        if !self.labels.selection.is_empty() {
            return Arc::clone(&self.labels.targets);
        }
        if self.data.is_empty() { Arc::new([]) } else { Arc::new([self.data.frame_index as u32]) }
    }

    pub(super) fn select_frames(&mut self, mut frames: BTreeSet<usize>) -> Vec<Effect> {
        frames.split_off(&self.data.len());
        let (before, now) = (self.labels.selection.len(), frames.len());
        self.labels.select(frames);
        // Who adds one frame after the other sees each.
        if now > IN_SIGHT && now > before + 1 {
            self.hint(format!("{now} frames are selected: a tag goes to all of them; Esc clears the selection"));
        }
        Vec::new()
    }

    pub(super) fn toggle_tag(&mut self, tag: Tag) -> Vec<Effect> {
        let frames = self.label_targets();
        let all_have = self.labels.all_will_have(&frames, tag);
        let (verb, change) = if all_have { ("untag", Change::removing(tag)) } else { ("tag", Change::adding(tag)) };
        self.commit(&format!("{verb} {tag}"), frames, change)
    }

    pub(super) fn set_note(&mut self, frames: Arc<[u32]>, note: String) -> Vec<Effect> {
        self.commit("note", frames, Change { note: Some(note), ..Change::default() })
    }

    pub(super) fn set_person(&mut self, person: Option<u32>) -> Vec<Effect> {
        let frames = self.label_targets();
        self.commit("person", frames, Change { person: Some(person), ..Change::default() })
    }

    /// A region is of one frame's map, whatever is selected.
    pub(super) fn set_region(&mut self, frame: usize, region: Option<CellRegion>) -> Vec<Effect> {
        let name = if region.is_some() { "mark cells" } else { "unmark cells" };
        let frames = Arc::new([frame as u32]);
        self.commit(name, frames, Change { region: Some(region), ..Change::default() })
    }

    pub(super) fn set_verdict(&mut self, verdict: Option<Verdict>) -> Vec<Effect> {
        let frames = self.label_targets();
        let name = verdict.map_or_else(|| "no verdict".into(), |verdict| format!("verdict {verdict}"));
        self.commit(&name, frames, Change { verdict: Some(verdict), ..Change::default() })
    }

    pub(super) fn clear_label(&mut self) -> Vec<Effect> {
        let frames = self.label_targets();
        self.commit("clear label", frames, Change::clearing())
    }

    fn commit(&mut self, act: &str, frames: Arc<[u32]>, change: Change) -> Vec<Effect> {
        let act = with_count(act, frames.len());
        self.ask_journal(ActKind::Do, act, Asked::Same(frames, change))
    }

    /// Asks the journal for an act, unless it would change nothing.
    fn ask_journal(&mut self, kind: ActKind, act: String, asked: Asked) -> Vec<Effect> {
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
        if !self.would_change(&asked) {
            return Vec::new();
        }
        self.labels.next_act += 1;
        let id = self.labels.next_act;
        let judged = self.judged_of(&asked);
        self.labels.pending.push((id, asked.clone()));
        vec![Effect::CommitLabels(Commit { id, kind, act, dataset, asked, judged })]
    }

    fn would_change(&self, asked: &Asked) -> bool {
        asked.len() > LOOKED_AT
            || asked.each().any(|(frame, change)| {
                let label = self.labels.expected(frame);
                change.applied(&label) != label
            })
    }

    /// The fits that an act judges: the one on screen, and those of frames that were fitted before.
    fn judged_of(&self, asked: &Asked) -> BTreeMap<usize, Judged> {
        let fitted = self.summaries.iter().filter(|(_, summary)| summary.hashes.is_some()).map(|(&frame, _)| frame);
        let known = fitted.chain([self.fit.frame]).filter(|&frame| asked.of(frame).is_some());
        known.map(|frame| (frame, self.judged(frame))).collect()
    }

    /// The fit that is judged when `frame` is labelled now: the one on screen, or the one that was left there.
    fn judged(&self, frame: usize) -> Judged {
        let fit = |hashes: &FitHashes| Judged {
            fit: Some(hashes.fit.clone()),
            config: Some(hashes.config.clone()),
            iteration: Some(hashes.iteration),
            ..Judged::default()
        };
        // While another frame is being read, the fit on screen is still that of the frame before.
        let Some(shown) = self.shown_hashes().filter(|_| self.fit.frame == frame) else {
            let left = self.summaries.get(&frame).and_then(|summary| summary.hashes.as_deref());
            return left.map(fit).unwrap_or_default();
        };
        // Scores of an older fit say nothing of the one that is judged.
        let machine = self.evidence_of(frame).filter(|_| !self.evidence_is_stale()).into_iter().flatten();
        let machine: BTreeMap<Tag, f64> =
            machine.filter_map(|evidence| Some((evidence.mode, evidence.score?))).collect();
        let machine_shown = !machine.is_empty() && !self.evidence_hidden_of(frame);
        let views = self.data.dataset.as_ref().map(|dataset| &dataset.info().views[..]).unwrap_or_default();
        let region = |cells: &ErasedCells| {
            let ends = |end: fn(&[usize; 2]) -> usize| cells.bins.iter().map(end).collect();
            let view = views.get(cells.view)?.array.clone();
            Some(CellRegion { view, lo: ends(|b| b[0]), hi: ends(|b| b[1].saturating_sub(1)) })
        };
        let erased = self.fit.erased().iter().filter_map(region).collect();
        Judged { machine, erased, machine_shown, ..fit(shown) }
    }

    /// True while the evidence of the frame on screen is hidden: in blind mode, until the annotator has tagged it. A verdict
    /// on the count is no judgement of the fit.
    pub fn evidence_hidden(&self) -> bool {
        self.evidence_hidden_of(self.data.frame_index)
    }

    fn evidence_hidden_of(&self, frame: usize) -> bool {
        self.view.label_mode == LabelMode::Agreement && self.view.blind && self.labels.tags(frame).is_empty()
    }

    pub(super) fn undo_label(&mut self) -> Vec<Effect> {
        if self.labels.undo_name().is_none() {
            return Vec::new();
        }
        let Some(act) = self.labels.undo.last().cloned() else { return Vec::new() };
        self.again(ActKind::Undo, &act.name, Asked::Back(act.changes))
    }

    pub(super) fn redo_label(&mut self) -> Vec<Effect> {
        if self.labels.redo_name().is_none() {
            return Vec::new();
        }
        let Some(act) = self.labels.redo.last().cloned() else { return Vec::new() };
        self.again(ActKind::Redo, &act.name, Asked::Again(act.changes))
    }

    fn again(&mut self, kind: ActKind, name: &str, asked: Asked) -> Vec<Effect> {
        let verb = if kind == ActKind::Undo { "undo" } else { "redo" };
        let effects = self.ask_journal(kind, format!("{verb}: {name}"), asked);
        if effects.is_empty() {
            self.labels.forget(kind);
            self.gone(name);
        }
        effects
    }

    fn gone(&mut self, name: &str) {
        self.hint(format!("“{name}” is gone already: another window changed the same labels"));
    }

    /// The journals were read, or could not be.
    pub(super) fn labels_opened(&mut self, id: u64, result: Result<Box<OpenedLabels>, String>) -> Vec<Effect> {
        if id != self.labels.opening {
            return Vec::new();
        }
        match result {
            Ok(opened) => {
                self.labels.status = LabelStatus::Ready;
                self.labels_warned(opened.warnings);
                self.labels_placed(opened.place);
                self.labels.last_edited = opened.last_edited;
                *self.labels.table.change() = opened.table;
            }
            Err(why) => {
                self.note(LogLevel::Error, format!("labels cannot be kept: {why}"));
                self.labels.status = LabelStatus::Failed(why);
            }
        }
        Vec::new()
    }

    pub(super) fn labels_warned(&mut self, warnings: Vec<String>) -> Vec<Effect> {
        for warning in warnings {
            self.note(LogLevel::Warning, warning);
        }
        Vec::new()
    }

    pub(super) fn labels_placed(&mut self, place: LabelPlace) -> Vec<Effect> {
        // Perhaps that of a data set that was closed meanwhile.
        if self.labels.status != LabelStatus::Ready {
            return Vec::new();
        }
        if let Some(reason) = &place.reason {
            let text = format!("labels are kept in {}: {reason}", place.folder.display());
            self.note(LogLevel::Warning, text);
        }
        self.labels.place = Some(place);
        Vec::new()
    }

    /// The journal acknowledged an act, or could not write it.
    pub(super) fn labels_written(&mut self, written: Written) -> Vec<Effect> {
        let Written { id, kind, act, result } = written;
        // An act for a journal that was closed meanwhile is on disk, but no longer of what is on screen.
        let Some(at) = self.labels.pending.iter().position(|(pending, _)| *pending == id) else { return Vec::new() };
        let asked = self.labels.pending.remove(at);
        match result {
            Ok(done) => {
                if done.changes.is_empty() && kind != ActKind::Do {
                    self.gone(&act);
                }
                if !done.changes.is_empty() && kind != ActKind::Do {
                    let first = done.records.first().map_or_else(String::new, |record| record.frame.path.clone());
                    let on = if done.changes.len() == 1 { format!(" ({first})") } else { String::new() };
                    self.hint(format!("{act}{on}"));
                }
                if kind == ActKind::Do && !done.changes.is_empty() {
                    self.acts_done += 1;
                    self.settings.redo.clear();
                    if done.changes.len() > IN_SIGHT {
                        self.hint_of_act(act.clone());
                    }
                }
                let replaced = self.labels.written(kind, (self.acts_done, act), done);
                free(replaced.len(), (asked, replaced))
            }
            Err(why) => {
                self.note(LogLevel::Error, format!("“{act}” was not written and is not done: {why}"));
                Vec::new()
            }
        }
    }

    /// Another window or another annotator wrote.
    pub(super) fn labels_refreshed(&mut self, table: LabelTable) -> Vec<Effect> {
        if self.labels.status != LabelStatus::Ready {
            return Vec::new();
        }
        let old = std::mem::replace(self.labels.table.change(), table);
        free(old.values().map(super::super::Records::count).sum(), old)
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
        let old = self.labels.close();
        self.labels.status = LabelStatus::Opening;
        self.labels.next_act += 1;
        let id = self.labels.next_act;
        self.labels.opening = id;
        let mut effects = vec![Effect::OpenLabels { id, dataset, annotator: self.labels.annotator.clone() }];
        effects.extend(free(old.table().values().map(super::super::Records::count).sum(), old));
        effects
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

/// Has something freed elsewhere where it is large.
fn free(records: usize, what: impl Send + 'static) -> Vec<Effect> {
    if records > MANY { vec![Effect::Free(Trash::new(what))] } else { Vec::new() }
}

fn with_count(act: &str, frames: usize) -> String {
    if frames > 1 { format!("{act} on {frames} frames") } else { act.to_owned() }
}
