//! How far two annotators agree, tag by tag, on the frames that both judged; and one annotator with the machine.
//!
//! A frame is judged where its label has a tag. What says nothing of the fit is no judgement of it: a remark alone (note,
//! person, region), a verdict on the count alone; nor is a label that was taken back. A frame of which the first and only
//! word is nothing at all, such as a table's row of zeros, is judged to have none of the tags. Only frames judged by both
//! count: each is one decision for every tag.

use super::{Record, Tag, TagAgreement, Tags};
use serde::Serialize;
use std::collections::BTreeMap;

/// The machine says yes from this evidence score on, where nobody asks for another threshold.
pub const MACHINE_THRESHOLD: f64 = 0.5;

/// One frame and tag that two annotators see differently.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Dispute {
    /// The frame's name.
    pub frame: String,
    /// The tag.
    pub tag: Tag,
    /// True where the first gave it.
    pub a: bool,
    /// True where the second did.
    pub b: bool,
}

/// The agreement of two annotators.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    /// Frames judged by both.
    pub frames: usize,
    /// Frames judged by the first alone; they count nowhere else.
    pub only_in_a: usize,
    /// Frames judged by the second alone.
    pub only_in_b: usize,
    /// Each tag, in the order of [`Tag::ALL`].
    pub tags: Vec<(Tag, TagAgreement)>,
    /// All decisions of all those tags in one 2×2 table.
    pub pooled: TagAgreement,
    /// Every decision that differs, by frame, then tag.
    pub disputes: Vec<Dispute>,
}

/// The agreement of one annotator with the program's own scores.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineAgreement {
    /// A is the person, B the machine; the tags are [`Tag::MODES`]. A frame counts for a mode where its score is known.
    pub agreement: Agreement,
    /// Frames that count and were judged with the scores on screen: those judgements are not blind.
    pub shown: usize,
    /// Frames that were judged without any score.
    pub unscored: usize,
}

/// Compares two annotators by the records of the frames that each [`judged`]. Where a frame comes twice, the last counts.
pub fn agreement<'a>(a: impl IntoIterator<Item = &'a Record>, b: impl IntoIterator<Item = &'a Record>) -> Agreement {
    let (a, b) = (tags_by_frame(a), tags_by_frame(b));
    let common: Vec<(&str, Tags, Tags)> =
        a.iter().filter_map(|(&frame, &tags)| Some((frame, tags, *b.get(frame)?))).collect();
    let decide = |tag| common.iter().map(move |&(frame, a, b)| (frame, a.contains(tag), b.contains(tag)));
    let (tags, pooled, disputes) = tables(&Tag::ALL, decide);
    let frames = common.len();
    Agreement { frames, only_in_a: a.len() - frames, only_in_b: b.len() - frames, tags, pooled, disputes }
}

/// Compares the failure modes that a person saw with the scores recorded at that moment; the machine says yes from
/// `threshold` on. `judged` are the records of the frames that one annotator [`judged()`].
pub fn against_machine<'a>(judged: impl IntoIterator<Item = &'a Record>, threshold: f64) -> MachineAgreement {
    let judged: Vec<&Record> = judged.into_iter().collect();
    let score = |record: &Record, tag| record.judged.machine.get(&tag).copied().filter(|score| score.is_finite());
    let scored = |record: &&Record| Tag::MODES.into_iter().any(|tag| score(record, tag).is_some());
    let counted: Vec<&Record> = judged.iter().copied().filter(scored).collect();
    let decide = |tag| {
        let both = move |record: &&'a Record| {
            let machine = score(record, tag)? >= threshold;
            Some((record.frame.path.as_str(), record.label.tags.contains(tag), machine))
        };
        counted.iter().filter_map(both)
    };
    let (tags, pooled, disputes) = tables(&Tag::MODES, decide);
    let unscored = judged.len() - counted.len();
    let shown = counted.iter().filter(|record| record.judged.machine_shown).count();
    let agreement = Agreement { frames: counted.len(), only_in_a: unscored, only_in_b: 0, tags, pooled, disputes };
    MachineAgreement { agreement, shown, unscored }
}

/// Each tag of [`Tag::ALL`] and all of them pooled, over frames that both judged: what the first gave, what the second.
pub fn compare_tags(both: &[(Tags, Tags)]) -> (Vec<(Tag, TagAgreement)>, TagAgreement) {
    let decide = |tag| both.iter().map(move |&(a, b)| (a.contains(tag), b.contains(tag)));
    with_sum(Tag::ALL.iter().map(|&tag| (tag, TagAgreement::of(decide(tag)))).collect())
}

fn with_sum(each: Vec<(Tag, TagAgreement)>) -> (Vec<(Tag, TagAgreement)>, TagAgreement) {
    let sum = each.iter().fold([0; 4], |[both, only_a, only_b, neither], (_, tag)| {
        [both + tag.both, only_a + tag.only_a, only_b + tag.only_b, neither + tag.neither]
    });
    (each, TagAgreement::of_counts(sum))
}

type Tables = (Vec<(Tag, TagAgreement)>, TagAgreement, Vec<Dispute>);

/// One table a tag, their sum, and what differs; `decide` gives frame and both answers.
fn tables<'a, I: Iterator<Item = (&'a str, bool, bool)>>(tags: &[Tag], decide: impl Fn(Tag) -> I) -> Tables {
    let each = tags.iter().map(|&tag| (tag, TagAgreement::of(decide(tag).map(|(_, a, b)| (a, b))))).collect();
    let (each, pooled) = with_sum(each);
    let mut disputes: Vec<Dispute> = Vec::new();
    for &tag in tags {
        let differing = decide(tag).filter(|(_, a, b)| a != b);
        disputes.extend(differing.map(|(frame, a, b)| Dispute { frame: frame.to_owned(), tag, a, b }));
    }
    disputes.sort();
    (each, pooled, disputes)
}

fn tags_by_frame<'a>(records: impl IntoIterator<Item = &'a Record>) -> BTreeMap<&'a str, Tags> {
    records.into_iter().map(|record| (record.frame.path.as_str(), record.label.tags)).collect()
}

/// Those of one annotator's newest records, one a frame, that are judgements. An empty label is one taken back.
pub fn judged<'a>(newest: impl IntoIterator<Item = &'a Record>) -> impl Iterator<Item = &'a Record> {
    newest.into_iter().filter(|record| !record.label.tags.is_empty())
}

/// The records of the frames that one annotator judged, by name; `acts` is all they said, in order. Here an empty label
/// is a judgement where nothing else was ever said of the frame.
pub fn judged_in_acts<'a>(acts: impl IntoIterator<Item = &'a Record>) -> impl Iterator<Item = &'a Record> {
    standing(acts).filter(|record| record.label.is_empty() || judged([*record]).next().is_some())
}

/// The newest record of each frame, by name, without those that were taken back: that said something before and say
/// nothing now. `acts` is all that one annotator said, in order.
pub fn standing<'a>(acts: impl IntoIterator<Item = &'a Record>) -> impl Iterator<Item = &'a Record> {
    let mut frames: BTreeMap<&str, (bool, &Record)> = BTreeMap::new();
    for record in acts {
        let spoke = frames.get(record.frame.path.as_str()).is_some_and(|(spoke, _)| *spoke);
        frames.insert(&record.frame.path, (spoke || !record.label.is_empty(), record));
    }
    frames.into_values().filter(|(spoke, record)| !spoke || !record.label.is_empty()).map(|(_, record)| record)
}
