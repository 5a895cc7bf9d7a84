//! Acts of labelling: what is asked of the journal, and what an act that can be undone has changed.
//!
//! An act on every frame of a large data set says the same thing a hundred thousand times. Each pair of labels is kept
//! once, so that a frame costs eight bytes and the window's thread never touches a label of them.

use crate::labels::{Change, Label, Record, Tags};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

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

/// Labels before and after, by frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Changes {
    /// Each pair of labels once.
    pairs: Vec<(Label, Label)>,
    /// Frame and pair, in the order of frames.
    frames: Vec<(u32, u32)>,
}

impl Changes {
    /// Gathers frame, label before and label after; a frame comes once.
    pub fn of(changes: impl IntoIterator<Item = (usize, Label, Label)>) -> Self {
        let (mut known, mut gathered) = (HashMap::new(), Self::default());
        for (frame, before, after) in changes {
            let pair = *known.entry((before, after)).or_insert_with_key(|pair| {
                gathered.pairs.push(pair.clone());
                gathered.pairs.len() as u32 - 1
            });
            gathered.frames.push((frame as u32, pair));
        }
        gathered.frames.sort_unstable();
        gathered
    }

    /// Frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// True where nothing changed.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Frame, label before, label after, in the order of frames.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &Label, &Label)> {
        self.frames.iter().filter_map(|&(frame, pair)| {
            let (before, after) = self.pairs.get(pair as usize)?;
            Some((frame as usize, before, after))
        })
    }

    fn of_frame(&self, frame: usize) -> Option<&(Label, Label)> {
        let at = self.frames.binary_search_by_key(&frame, |&(frame, _)| frame as usize).ok()?;
        self.pairs.get(self.frames.get(at)?.1 as usize)
    }

    /// The way back.
    pub(super) fn reversed(mut self) -> Self {
        for (before, after) in &mut self.pairs {
            std::mem::swap(before, after);
        }
        self
    }

    /// Bytes that it takes, about.
    pub(super) fn bytes(&self) -> usize {
        let texts: usize = self.pairs.iter().map(|(before, after)| before.note.len() + after.note.len()).sum();
        self.frames.len() * size_of::<(u32, u32)>() + self.pairs.len() * size_of::<(Label, Label)>() + texts
    }
}

/// An act that can be undone.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelAct {
    /// Its place among all acts of the session.
    pub at: u64,
    /// In words: `tag F2 on 12 frames`.
    pub name: String,
    /// What it changed.
    pub changes: Arc<Changes>,
}

/// What is asked of which frames.
#[derive(Debug, Clone, PartialEq)]
pub enum Asked {
    /// The same of all of them, in the order of the data set.
    Same(Arc<[u32]>, Change),
    /// To be again as before these changes.
    Back(Arc<Changes>),
    /// To be as after these changes.
    Again(Arc<Changes>),
}

impl Asked {
    /// Frames.
    pub fn len(&self) -> usize {
        match self {
            Self::Same(frames, _) => frames.len(),
            Self::Back(changes) | Self::Again(changes) => changes.len(),
        }
    }

    /// True where nothing is asked.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The change of each frame, in the order of frames.
    pub fn each(&self) -> Box<dyn Iterator<Item = (usize, Change)> + '_> {
        match self {
            Self::Same(frames, change) => Box::new(frames.iter().map(|&frame| (frame as usize, change.clone()))),
            Self::Back(changes) => Box::new(changes.iter().map(|(k, from, to)| (k, Change::between(to, from)))),
            Self::Again(changes) => Box::new(changes.iter().map(|(k, from, to)| (k, Change::between(from, to)))),
        }
    }

    /// The change of one frame.
    pub fn of(&self, frame: usize) -> Option<Change> {
        match self {
            Self::Same(frames, change) => {
                frames.binary_search_by_key(&frame, |&frame| frame as usize).ok().map(|_| change.clone())
            }
            Self::Back(changes) => changes.of_frame(frame).map(|(from, to)| Change::between(to, from)),
            Self::Again(changes) => changes.of_frame(frame).map(|(from, to)| Change::between(from, to)),
        }
    }

    /// What it does to the tags of `frames`, which are in the order of the data set.
    pub(super) fn change_tags(&self, frames: &[u32], tags: &mut [Tags]) {
        let mut asked: Box<dyn Iterator<Item = (usize, Tags, Tags)>> = match self {
            Self::Same(frames, change) => {
                Box::new(frames.iter().map(|&frame| (frame as usize, change.remove, change.add)))
            }
            Self::Back(changes) => Box::new(changes.iter().map(|(k, from, to)| difference(k, to.tags, from.tags))),
            Self::Again(changes) => Box::new(changes.iter().map(|(k, from, to)| difference(k, from.tags, to.tags))),
        };
        let mut next = asked.next();
        for (&frame, tags) in frames.iter().zip(tags) {
            while next.is_some_and(|(at, ..)| at < frame as usize) {
                next = asked.next();
            }
            if let Some((_, remove, add)) = next.filter(|(at, ..)| *at == frame as usize) {
                *tags = tags.minus(remove).union(add);
            }
        }
    }
}

fn difference(frame: usize, from: Tags, to: Tags) -> (usize, Tags, Tags) {
    (frame, from.minus(to), to.minus(from))
}

/// What the journal did.
#[derive(Debug, Default)]
pub struct Done {
    /// Labels before and after; frames whose label was so already are not in it.
    pub changes: Changes,
    /// The records, one a frame of `changes`, in the same order.
    pub records: Vec<Arc<Record>>,
    /// The frames whose records have the machine's scores.
    pub scored: BTreeSet<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::Tag;

    fn tagged(tags: &[Tag]) -> Label {
        Label { tags: tags.iter().copied().collect(), ..Label::default() }
    }

    #[test]
    fn each_pair_of_labels_is_kept_once_and_comes_back() {
        let (none, f1, f2) = (Label::default(), tagged(&[Tag::F1]), tagged(&[Tag::F1, Tag::F2]));
        let all = (0..100).map(|k| (99 - k, none.clone(), if k == 3 { f2.clone() } else { f1.clone() }));
        let changes = Changes::of(all);
        assert_eq!((changes.len(), changes.pairs.len()), (100, 2));
        assert!(changes.iter().map(|(frame, ..)| frame).eq(0..100), "in the order of frames");
        assert_eq!(changes.of_frame(96), Some(&(none.clone(), f2.clone())));
        let back = Asked::Back(Arc::new(changes.clone()));
        assert_eq!(back.of(96).map(|change| change.applied(&f2)), Some(none.clone()));
        assert_eq!(back.of(100), None);
        assert_eq!(changes.reversed().of_frame(5), Some(&(f1, none)));
    }

    #[test]
    fn what_is_asked_changes_the_tags_of_those_frames_only() {
        let asked = Asked::Same([2, 4, 9].into(), Change::adding(Tag::Clean));
        let f1 = tagged(&[Tag::F1]).tags;
        let mut tags = [f1; 4];
        asked.change_tags(&[1, 4, 8, 9], &mut tags);
        let clean = tagged(&[Tag::Clean]).tags;
        assert_eq!(tags, [f1, clean, f1, clean]);
        assert!(asked.each().map(|(frame, _)| frame).eq([2, 4, 9]));
    }
}
