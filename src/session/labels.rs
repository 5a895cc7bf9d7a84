//! What is known of labels: everybody's as far as the journals tell, and this annotator's acts to be undone.
//!
//! A tag is shown only once its journal has acknowledged it. Acts under way are kept aside, so that a second press of the
//! same key toggles back and does not ask twice for the same.

use crate::labels::{Change, FrameId, Label, LabelPlace, Record, Tags};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Acts that can be undone.
const UNDO_DEPTH: usize = 500;

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
                "For frames whose number of people is disputed: say whether the annotation, the detection, both or \
                 neither is wrong."
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

/// Why a commit was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActKind {
    /// By a person.
    Do,
    /// Takes the last act back.
    Undo,
    /// Does it again.
    Redo,
}

/// An act that can be undone.
#[derive(Debug, Clone, PartialEq)]
pub struct Act {
    /// In words: `tag F2 on 12 frames`.
    pub name: String,
    /// What it changed: frame, label before, label after.
    pub changes: Vec<(FrameId, Label, Label)>,
}

/// What may be seen of a frame's labels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Visible<'a> {
    /// Everybody's tags.
    pub tags: Tags,
    /// Who labelled it.
    pub annotators: Vec<&'a str>,
}

/// Everybody's labels: annotator, then frame.
pub type LabelTable = BTreeMap<String, HashMap<usize, Record>>;

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
    pub(super) pending: Vec<(u64, Vec<(FrameId, Change)>)>,
    pub(super) next_act: u64,
    /// Number of the reading of the journals that is waited for.
    pub(super) opening: u64,
    pub(super) table: LabelTable,
    pub(super) undo: Vec<Act>,
    pub(super) redo: Vec<Act>,
    /// The frame that this annotator labelled last.
    pub last_edited: Option<usize>,
    /// Frames that the next act is for, instead of the one on screen.
    pub selection: BTreeSet<usize>,
    /// Counts up with every change of the table.
    pub revision: u64,
}

impl Labels {
    /// Everybody's labels.
    pub fn table(&self) -> &LabelTable {
        &self.table
    }

    /// This annotator's record of a frame.
    pub fn mine(&self, frame: usize) -> Option<&Record> {
        self.table.get(&self.annotator)?.get(&frame).filter(|record| !record.label.is_empty())
    }

    /// This annotator's label of a frame.
    pub fn label(&self, frame: usize) -> Label {
        self.mine(frame).map_or_else(Label::default, |record| record.label.clone())
    }

    /// True where this annotator said something of a frame's fit or count.
    pub fn is_judged(&self, frame: usize) -> bool {
        self.mine(frame).is_some_and(|r| !r.label.tags.is_empty() || r.label.verdict.is_some())
    }

    /// The label as it will be once the acts under way are written.
    pub(super) fn expected(&self, frame: usize) -> Label {
        let changes = self.pending.iter().flat_map(|(_, changes)| changes);
        changes.filter(|(id, _)| id.index == frame).fold(self.label(frame), |label, (_, change)| change.applied(&label))
    }

    /// Records of a frame by others, in the order of their names.
    pub fn others(&self, frame: usize) -> impl Iterator<Item = &Record> {
        let others = self.table.iter().filter(|(name, _)| **name != self.annotator);
        others.filter_map(move |(_, records)| records.get(&frame)).filter(|record| !record.label.is_empty())
    }

    /// Tags of a frame and who gave them; only one's own in a mode that hides the others'.
    pub fn visible(&self, frame: usize, mode: LabelMode) -> Visible<'_> {
        let hide = mode == LabelMode::Agreement;
        let mut visible = Visible::default();
        for (name, records) in &self.table {
            if hide && *name != self.annotator {
                continue;
            }
            if let Some(record) = records.get(&frame).filter(|record| !record.label.is_empty()) {
                visible.tags = visible.tags.union(record.label.tags);
                visible.annotators.push(name.as_str());
            }
        }
        visible
    }

    /// Number of frames that this annotator labelled.
    pub fn count(&self) -> usize {
        self.table.get(&self.annotator).map_or(0, |r| r.values().filter(|r| !r.label.is_empty()).count())
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

    /// Forgets the journals; the annotator stays.
    pub(super) fn close(&mut self) {
        let (annotator, revision, next_act) = (std::mem::take(&mut self.annotator), self.revision + 1, self.next_act);
        *self = Self { annotator, next_act, revision, ..Self::default() };
    }

    /// Takes in what a commit wrote.
    pub(super) fn written(&mut self, kind: ActKind, name: String, outcomes: Vec<(FrameId, Label, Record)>) {
        let mut changes = Vec::with_capacity(outcomes.len());
        let mine = self.table.entry(self.annotator.clone()).or_default();
        for (frame, before, record) in outcomes {
            changes.push((frame.clone(), before, record.label.clone()));
            self.last_edited = Some(frame.index);
            mine.insert(frame.index, record);
        }
        self.revision += 1;
        if changes.is_empty() {
            return self.forget(kind);
        }
        match kind {
            ActKind::Do => {
                self.redo.clear();
                self.undo.push(Act { name, changes });
                if self.undo.len() > UNDO_DEPTH {
                    self.undo.remove(0);
                }
            }
            // The stacks change only now: an act that could not be written is still there to be taken back.
            ActKind::Undo => {
                self.undo.pop();
                self.redo.push(Act { name, changes: reversed(changes) });
            }
            ActKind::Redo => {
                self.redo.pop();
                self.undo.push(Act { name, changes });
            }
        }
    }
}

/// What was done, of what an undo wrote.
fn reversed(changes: Vec<(FrameId, Label, Label)>) -> Vec<(FrameId, Label, Label)> {
    changes.into_iter().map(|(frame, before, after)| (frame, after, before)).collect()
}
