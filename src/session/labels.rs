//! What is known of labels: everybody's as far as the journals tell, and this annotator's acts to be undone.
//!
//! A tag is shown only once its journal has acknowledged it. Acts under way are kept aside, so that a second press of the
//! same key toggles back and does not ask twice for the same.

use super::acts::{ActKind, Asked, Changes, Done, LabelAct};
use super::records::Records;
use super::tracked::Tracked;
use crate::labels::{Label, LabelPlace, Record, Tag, Tags};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Acts that can be undone.
const UNDO_DEPTH: usize = 500;
/// Bytes that they may take; the newest is kept whatever it takes. A tag on 100,000 frames takes 0.8 MB.
const UNDO_BYTES: usize = 64 << 20;

/// What labelling is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LabelMode {
    /// To understand: everything is shown.
    #[default]
    Explore,
    /// To measure agreement: other people's labels, and in blind mode the machine's scores, are hidden until one's own is
    /// given.
    Agreement,
    /// The paper's second review protocol: verdicts on count mismatches.
    CountReview,
}

impl LabelMode {
    /// Every mode.
    pub const ALL: [Self; 3] = [Self::Explore, Self::Agreement, Self::CountReview];

    /// Its name on screen.
    pub fn title(self) -> &'static str {
        match self {
            Self::Explore => "Explore",
            Self::Agreement => "For agreement",
            Self::CountReview => "Count review",
        }
    }

    /// What it does, in one sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::Explore => "Everything is shown: the machine's evidence and other people's labels.",
            Self::Agreement => {
                "Other people's labels are hidden, and the machine's evidence until you have tagged the frame, so that \
                 agreement measures independent judgements."
            }
            Self::CountReview => {
                "For frames that are annotated with another number of people than is counted: say whether the annotation, \
                 the detection, both or neither is wrong."
            }
        }
    }
}

/// Whether labels can be written.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum LabelStatus {
    /// No data set.
    #[default]
    Closed,
    /// The journals are being read.
    Opening,
    /// Acts are written.
    Ready,
    /// They are not; the text says why.
    Failed(String),
}

/// Everybody's labels: annotator, then frame.
pub type LabelTable = BTreeMap<String, Records>;

/// The labels of the open data set.
#[derive(Debug, Default)]
pub struct Labels {
    /// Who tags.
    pub annotator: String,
    /// Where the journals are.
    pub place: Option<LabelPlace>,
    /// Whether acts can be written.
    pub status: LabelStatus,
    /// Acts under way.
    pub(super) pending: Vec<(u64, Asked)>,
    pub(super) next_act: u64,
    /// Number of the reading of the journals that is waited for.
    pub(super) opening: u64,
    pub(super) table: Tracked<LabelTable>,
    pub(super) undo: Vec<LabelAct>,
    pub(super) redo: Vec<LabelAct>,
    /// The frame that this annotator labelled last.
    pub last_edited: Option<usize>,
    /// Frames that the next act is for, instead of the one on screen.
    pub selection: BTreeSet<usize>,
    /// The same in a row, to be shared with acts.
    pub(super) targets: Arc<[u32]>,
}

impl Labels {
    /// Another number after every change of the table.
    pub fn revision(&self) -> u64 {
        self.table.revision()
    }

    /// Everybody's labels.
    pub fn table(&self) -> &LabelTable {
        &self.table
    }

    /// This annotator's labels.
    pub fn own(&self) -> Option<&Records> {
        self.table.get(&self.annotator)
    }

    /// This annotator's record of a frame.
    pub fn mine(&self, frame: usize) -> Option<&Record> {
        let own = self.own()?;
        own.tags(frame).and_then(|_| own.get(frame))
    }

    /// This annotator's label of a frame.
    pub fn label(&self, frame: usize) -> Label {
        self.mine(frame).map_or_else(Label::default, |record| record.label.clone())
    }

    /// This annotator's tags of a frame.
    pub fn tags(&self, frame: usize) -> Tags {
        self.own().and_then(|own| own.tags(frame)).unwrap_or_default()
    }

    /// Tags that this annotator gave to every one of `frames`; none of no frame.
    pub fn common_tags(&self, frames: &[u32]) -> Tags {
        let Some(own) = self.own().filter(|_| !frames.is_empty()) else { return Tags::NONE };
        let all: Tags = Tag::ALL.into_iter().collect();
        frames.iter().fold(all, |common, &frame| common.minus(all.minus(own.tags(frame as usize).unwrap_or_default())))
    }

    /// True where this annotator tagged a frame or gave a verdict on its count: there is nothing left to be asked of it.
    pub fn is_judged(&self, frame: usize) -> bool {
        !self.tags(frame).is_empty() || self.mine(frame).is_some_and(|record| record.label.verdict.is_some())
    }

    /// The label as it will be once the acts under way are written.
    pub(super) fn expected(&self, frame: usize) -> Label {
        let changes = self.pending.iter().filter_map(|(_, asked)| asked.of(frame));
        changes.fold(self.label(frame), |label, change| change.applied(&label))
    }

    /// True where each of `frames`, in the order of the data set, will have `tag` once the acts under way are written.
    pub(super) fn all_will_have(&self, frames: &[u32], tag: Tag) -> bool {
        let mut tags: Vec<Tags> = frames.iter().map(|&frame| self.tags(frame as usize)).collect();
        for (_, asked) in &self.pending {
            asked.change_tags(frames, &mut tags);
        }
        tags.iter().all(|tags| tags.contains(tag))
    }

    /// Records of a frame by others, in the order of their names.
    pub fn others(&self, frame: usize) -> impl Iterator<Item = &Record> {
        let others = self.table.iter().filter(|(name, _)| **name != self.annotator);
        others.filter_map(move |(_, records)| records.tags(frame).and_then(|_| records.get(frame)))
    }

    /// Those whose labels may be seen, in the order of their names; only oneself in a mode that hides the others'.
    pub fn seen(&self, mode: LabelMode) -> impl Iterator<Item = (&str, &Records)> {
        let seen = move |name: &str| mode != LabelMode::Agreement || name == self.annotator;
        self.table.iter().filter(move |(name, _)| seen(name)).map(|(name, records)| (name.as_str(), records))
    }

    /// Everybody's tags of a frame, as far as they may be seen.
    pub fn visible_tags(&self, frame: usize, mode: LabelMode) -> Tags {
        self.seen(mode).filter_map(|(_, records)| records.tags(frame)).fold(Tags::NONE, Tags::union)
    }

    /// Who labelled a frame, as far as that may be seen.
    pub fn visible_annotators(&self, frame: usize, mode: LabelMode) -> Vec<&str> {
        self.seen(mode).filter(|(_, records)| records.tags(frame).is_some()).map(|(name, _)| name).collect()
    }

    /// Number of frames that this annotator labelled.
    pub fn count(&self) -> usize {
        self.own().map_or(0, Records::count)
    }

    /// Selects these frames.
    pub(super) fn select(&mut self, frames: BTreeSet<usize>) {
        self.targets = frames.iter().map(|&frame| frame as u32).collect();
        self.selection = frames;
    }

    /// The act that would be undone, in words.
    pub fn undo_name(&self) -> Option<&str> {
        self.undo.last().filter(|_| self.pending.is_empty()).map(|act| act.name.as_str())
    }

    /// The act that would be done again, in words.
    pub fn redo_name(&self) -> Option<&str> {
        self.redo.last().filter(|_| self.pending.is_empty()).map(|act| act.name.as_str())
    }

    /// Drops the act that an undo or a redo was for.
    pub(super) fn forget(&mut self, kind: ActKind) {
        match kind {
            ActKind::Do => {}
            ActKind::Undo => drop(self.undo.pop()),
            ActKind::Redo => drop(self.redo.pop()),
        }
    }

    /// Forgets the journals; the annotator stays. Gives what was known, for whoever has time to free it.
    pub(super) fn close(&mut self) -> Self {
        let kept = Self {
            annotator: self.annotator.clone(),
            table: self.table.emptied(),
            next_act: self.next_act,
            ..Self::default()
        };
        std::mem::replace(self, kept)
    }

    /// Takes in what a commit wrote; gives the records that were replaced.
    pub(super) fn written(&mut self, kind: ActKind, (at, name): (u64, String), done: Done) -> Vec<Arc<Record>> {
        let Done { changes, records, scored } = done;
        let mine = self.table.change().entry(self.annotator.clone()).or_default();
        let mut replaced = Vec::new();
        for ((frame, _, after), record) in changes.iter().zip(records) {
            self.last_edited = Some(frame);
            replaced.extend(mine.insert(frame, record, after, scored.contains(&frame)));
        }
        if changes.is_empty() {
            self.forget(kind);
        } else {
            self.remember(kind, (at, name), changes);
        }
        replaced
    }

    fn remember(&mut self, kind: ActKind, (at, name): (u64, String), changes: Changes) {
        match kind {
            ActKind::Do => {
                self.redo.clear();
                self.undo.push(LabelAct { at, name, changes: Arc::new(changes) });
                let bytes = |acts: &[LabelAct]| acts.iter().map(|act| act.changes.bytes()).sum::<usize>();
                while self.undo.len() > UNDO_DEPTH || (self.undo.len() > 1 && bytes(&self.undo) > UNDO_BYTES) {
                    self.undo.remove(0);
                }
            }
            // The stacks change only now: an act that could not be written is still there to be taken back.
            ActKind::Undo => {
                let (at, name) = self.undo.pop().map_or((at, name), |act| (act.at, act.name));
                self.redo.push(LabelAct { at, name, changes: Arc::new(changes.reversed()) });
            }
            ActKind::Redo => {
                let (at, name) = self.redo.pop().map_or((at, name), |act| (act.at, act.name));
                self.undo.push(LabelAct { at, name, changes: Arc::new(changes) });
            }
        }
    }
}
