//! One annotator's labels by frame.
//!
//! A slot a frame and, beside it, the bytes that lists and strips ask for a hundred thousand times a pass: whether
//! anything is said, the tags, and whether the machine's scores are known. The records themselves are shared with the thread that keeps the journals.

use crate::labels::{Label, Record, Tags};
use std::sync::Arc;

/// What is asked of every frame.
#[derive(Debug, Clone, Copy, Default)]
struct Mark {
    said: bool,
    tags: Tags,
    scored: bool,
}

/// The newest record of each frame by one annotator.
#[derive(Debug, Clone, Default)]
pub struct Records {
    slots: Vec<Option<Arc<Record>>>,
    marks: Vec<Mark>,
    said: usize,
}

impl Records {
    /// The record of a frame; its label may be empty, where everything was taken back.
    pub fn get(&self, frame: usize) -> Option<&Record> {
        self.slots.get(frame)?.as_deref()
    }

    /// The tags of a frame; `None` where nothing is said of it.
    pub fn tags(&self, frame: usize) -> Option<Tags> {
        self.marks.get(frame).filter(|mark| mark.said).map(|mark| mark.tags)
    }

    /// Frames of which something is said.
    pub fn count(&self) -> usize {
        self.said
    }

    /// True where nothing is said of any frame.
    pub fn is_empty(&self) -> bool {
        self.said == 0
    }

    /// Frame and record of each frame of which something is said, in the order of the data set.
    pub fn said(&self) -> impl Iterator<Item = (usize, &Arc<Record>)> {
        let slots = self.slots.iter().zip(&self.marks).enumerate();
        slots.filter(|(_, (_, mark))| mark.said).filter_map(|(frame, (slot, _))| Some((frame, slot.as_ref()?)))
    }

    /// Frame and tags of each frame of which something is said, in the order of the data set.
    pub fn said_tags(&self) -> impl Iterator<Item = (usize, Tags)> {
        self.marks.iter().enumerate().filter(|(_, mark)| mark.said).map(|(frame, mark)| (frame, mark.tags))
    }

    /// Frame and tags of each frame that is judged, hence tagged, in the order of the data set.
    pub fn judged(&self) -> impl Iterator<Item = (usize, Tags)> {
        self.said_tags().filter(|(_, tags)| !tags.is_empty())
    }

    /// True where the machine's own scores were recorded with the label.
    pub fn is_scored(&self, frame: usize) -> bool {
        self.marks.get(frame).is_some_and(|mark| mark.scored)
    }

    /// Takes in a record whose label is `label`, with or without scores; gives the one that it replaces. The record is not
    /// looked at: of a hundred thousand, that alone would take a pass.
    pub(super) fn insert(
        &mut self,
        frame: usize,
        record: Arc<Record>,
        label: &Label,
        scored: bool,
    ) -> Option<Arc<Record>> {
        if self.slots.len() <= frame {
            self.slots.resize(frame + 1, None);
            self.marks.resize(frame + 1, Mark::default());
        }
        let (slot, mark) = (self.slots.get_mut(frame)?, self.marks.get_mut(frame)?);
        let now = Mark { said: !label.is_empty(), tags: label.tags, scored };
        self.said = self.said - usize::from(mark.said) + usize::from(now.said);
        *mark = now;
        slot.replace(record)
    }
}

impl FromIterator<(usize, Arc<Record>)> for Records {
    /// Where a frame comes twice, the last counts.
    fn from_iter<I: IntoIterator<Item = (usize, Arc<Record>)>>(records: I) -> Self {
        let mut all = Self::default();
        for (frame, record) in records {
            let (label, scored) = (record.label.clone(), !record.judged.machine.is_empty());
            all.insert(frame, record, &label, scored);
        }
        all
    }
}
