//! Counts of labels: by annotator, by group of frames (scene, stratum, day), over time, and how long one takes.

use super::{Record, Tag, Verdict};
use std::collections::{BTreeMap, BTreeSet};
use time::format_description::well_known::Rfc3339;
use time::{OffsetDateTime, UtcOffset};

/// A longer gap between two acts is a pause, not the time that a frame took, s.
pub const PAUSE_S: f64 = 600.0;

/// What is said of some frames.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LabelCounts {
    /// Frames of which something is said.
    pub frames: usize,
    /// Frames with each tag, in the order of [`Tag::ALL`].
    pub tags: [usize; Tag::ALL.len()],
    /// Frames with each verdict, in the order of [`Verdict::ALL`].
    pub verdicts: [usize; Verdict::ALL.len()],
    /// Frames with a note.
    pub notes: usize,
}

impl LabelCounts {
    fn add(&mut self, record: &Record) {
        let label = &record.label;
        self.frames += 1;
        self.notes += usize::from(!label.note.is_empty());
        for (count, tag) in self.tags.iter_mut().zip(Tag::ALL) {
            *count += usize::from(label.tags.contains(tag));
        }
        for (count, verdict) in self.verdicts.iter_mut().zip(Verdict::ALL) {
            *count += usize::from(label.verdict == Some(verdict));
        }
    }

    /// Frames with `tag`.
    pub fn tag(&self, tag: Tag) -> usize {
        Tag::ALL.into_iter().zip(self.tags).find(|(known, _)| *known == tag).map_or(0, |(_, count)| count)
    }
}

/// When one annotator worked, and how fast.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pace {
    /// Acts; one on many frames is one.
    pub acts: usize,
    /// The first and the last act, RFC 3339 as recorded.
    pub span: Option<(String, String)>,
    /// Acts on each day in UTC, `2025-03-01`.
    pub days: BTreeMap<String, usize>,
    /// Acts in each hour in UTC, `2025-03-01T14`.
    pub hours: BTreeMap<String, usize>,
    /// Median time from one act to the next, s, pauses of more than [`PAUSE_S`] left out: the time to label.
    pub median_s: Option<f64>,
}

/// The counts of one annotator.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnnotatorStatistics {
    /// All frames.
    pub all: LabelCounts,
    /// The frames of each group; a frame without one is in none.
    pub groups: BTreeMap<String, LabelCounts>,
    /// Over time.
    pub pace: Pace,
}

/// Counts by annotator. `records` is every act in order, of any number of annotators; a frame's newest record is what is
/// said of it, and nothing where that is empty. `group` names the group of a frame, by that record.
pub fn statistics<'a>(
    records: impl IntoIterator<Item = &'a Record>,
    group: &dyn Fn(&Record) -> Option<String>,
) -> BTreeMap<String, AnnotatorStatistics> {
    let mut annotators: BTreeMap<&str, Vec<&Record>> = BTreeMap::new();
    for record in records {
        annotators.entry(&record.annotator).or_default().push(record);
    }
    annotators.into_iter().map(|(name, records)| (name.to_owned(), of_one(&records, group))).collect()
}

fn of_one(records: &[&Record], group: &dyn Fn(&Record) -> Option<String>) -> AnnotatorStatistics {
    let newest: BTreeMap<&str, &Record> = records.iter().map(|&record| (record.frame.path.as_str(), record)).collect();
    let mut found = AnnotatorStatistics { pace: pace(records), ..AnnotatorStatistics::default() };
    for record in newest.into_values().filter(|record| !record.label.is_empty()) {
        found.all.add(record);
        if let Some(group) = group(record) {
            found.groups.entry(group).or_default().add(record);
        }
    }
    found
}

/// The day of a record in UTC, `2025-03-01`; `None` where its time cannot be read.
pub fn day(record: &Record) -> Option<String> {
    let time = OffsetDateTime::parse(&record.time, &Rfc3339).ok()?;
    Some(time.to_offset(UtcOffset::UTC).date().to_string())
}

/// Over the acts: records with the same time and words are one. A time that cannot be read is an act without one.
fn pace(records: &[&Record]) -> Pace {
    let acts: BTreeSet<(&str, &str)> =
        records.iter().map(|record| (record.time.as_str(), record.act.as_str())).collect();
    let mut pace = Pace { acts: acts.len(), ..Pace::default() };
    let mut times: Vec<(OffsetDateTime, &str)> = Vec::new();
    for (text, _) in acts {
        let Ok(time) = OffsetDateTime::parse(text, &Rfc3339) else { continue };
        let utc = time.to_offset(UtcOffset::UTC);
        let day = utc.date().to_string();
        *pace.hours.entry(format!("{day}T{:02}", utc.hour())).or_default() += 1;
        *pace.days.entry(day).or_default() += 1;
        times.push((time, text));
    }
    times.sort_unstable();
    pace.span = times.first().zip(times.last()).map(|(first, last)| (first.1.to_owned(), last.1.to_owned()));
    let gaps = times.windows(2).filter_map(|pair| match pair {
        [a, b] => Some((b.0 - a.0).as_seconds_f64()),
        _ => None,
    });
    pace.median_s = median(gaps.filter(|&gap| gap <= PAUSE_S).collect());
    pace
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let (low, high) = (values.get(values.len().checked_sub(1)? / 2)?, values.get(values.len() / 2)?);
    Some(f64::midpoint(*low, *high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{Change, FrameId, Judged, Label};

    fn record(annotator: &str, frame: &str, tags: &str, time: &str) -> Record {
        let tags = tags.parse().unwrap_or_default();
        Record {
            dataset: String::new(),
            frame: FrameId { path: frame.into(), index: 0 },
            label: Change { add: tags, ..Change::default() }.applied(&Label::default()),
            annotator: annotator.into(),
            time: format!("2025-03-01T{time}Z"),
            after: None,
            act: "tag".into(),
            program: String::new(),
            judged: Judged::default(),
        }
    }

    #[test]
    fn the_newest_record_of_a_frame_counts_and_an_empty_one_does_not() {
        let records = [
            record("ann", "a/1", "F1", "10:00:00"),
            record("ann", "a/2", "F1 F2", "10:00:04"),
            record("ann", "b/3", "clean", "10:00:14"),
            record("ann", "a/1", "", "10:00:16"),
            record("bo", "a/1", "F4", "23:59:59.5"),
        ];
        let scene = |record: &Record| record.frame.path.split_once('/').map(|(scene, _)| scene.to_owned());
        let found = statistics(&records, &scene);
        assert_eq!(found.keys().collect::<Vec<_>>(), ["ann", "bo"]);
        let ann = &found["ann"];
        assert_eq!((ann.all.frames, ann.all.tags), (2, [1, 1, 0, 0, 1, 0]));
        assert_eq!((ann.groups["a"].tag(Tag::F1), ann.groups["b"].tag(Tag::Clean)), (1, 1));
        assert_eq!((ann.pace.acts, ann.pace.median_s), (4, Some(4.0)), "of 4, 10 and 2 s");
        assert_eq!(found["bo"].pace.hours, BTreeMap::from([("2025-03-01T23".into(), 1)]));
        assert_eq!(found["bo"].pace.median_s, None);
    }

    #[test]
    fn an_act_on_many_frames_is_one_and_a_pause_is_not_work() {
        let bulk = (0..5).map(|k| record("ann", &format!("a/{k}"), "F1", "10:00:00"));
        let later = [record("ann", "a/7", "F1", "10:00:03"), record("ann", "a/8", "F1", "18:00:00")];
        let records: Vec<Record> = bulk.chain(later).collect();
        let pace = &statistics(&records, &|_| None)["ann"].pace;
        assert_eq!((pace.acts, pace.median_s), (3, Some(3.0)));
        assert_eq!(pace.days, BTreeMap::from([("2025-03-01".into(), 3)]));
        let span = ("2025-03-01T10:00:00Z".to_owned(), "2025-03-01T18:00:00Z".to_owned());
        assert_eq!(pace.span, Some(span));
    }
}
