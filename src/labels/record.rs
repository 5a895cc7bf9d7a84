//! Labels, changes of labels, and the record of an act.

use super::{Tag, Tags, Verdict};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// A box of cells of one view.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct CellRegion {
    /// The view's array.
    pub view: String,
    /// First bin of each axis, inside.
    pub lo: Vec<usize>,
    /// Last bin of each axis, inside.
    pub hi: Vec<usize>,
}

impl fmt::Display for CellRegion {
    /// `hm_hori[10..=20, 30..=42]`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes: Vec<String> = self.lo.iter().zip(&self.hi).map(|(lo, hi)| format!("{lo}..={hi}")).collect();
        write!(f, "{}[{}]", self.view, axes.join(", "))
    }
}

impl FromStr for CellRegion {
    type Err = String;

    /// As it is written: `hm_hori[10..=20, 30..=42]`, first and last bin of each axis.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no region; expected a view and the bins of its axes: hm_hori[10..=20, 30..=42]");
        let (view, axes) =
            text.trim_end().strip_suffix(']').and_then(|text| text.rsplit_once('[')).ok_or_else(wrong)?;
        let mut region = Self { view: view.to_owned(), lo: Vec::new(), hi: Vec::new() };
        for axis in axes.split(',').filter(|_| !axes.trim().is_empty()) {
            let (lo, hi) = axis.split_once("..=").ok_or_else(wrong)?;
            let bins = lo.trim().parse().and_then(|lo: usize| Ok((lo, hi.trim().parse::<usize>()?)));
            let (lo, hi) = bins.ok().filter(|(lo, hi)| lo <= hi).ok_or_else(wrong)?;
            region.lo.push(lo);
            region.hi.push(hi);
        }
        Ok(region)
    }
}

/// All that one annotator says of one frame.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Label {
    /// Failure modes, clean, unsure.
    pub tags: Tags,
    /// Free text.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// The person that is meant, counted from 0, where one is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub person: Option<u32>,
    /// The cells that are meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<CellRegion>,
    /// The verdict on a count mismatch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
}

impl Label {
    /// True where nothing is said.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// A change of a label: only what is named is touched.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Change {
    /// Tags to add.
    pub add: Tags,
    /// Tags to remove.
    pub remove: Tags,
    /// A new note.
    pub note: Option<String>,
    /// Another person, or none.
    pub person: Option<Option<u32>>,
    /// Another region, or none.
    pub region: Option<Option<CellRegion>>,
    /// Another verdict, or none.
    pub verdict: Option<Option<Verdict>>,
}

impl Change {
    /// Adds a tag. `clean` excludes the failure modes, and they exclude it.
    pub fn adding(tag: Tag) -> Self {
        let remove = match tag {
            Tag::Clean => Tag::MODES.into_iter().collect(),
            Tag::Unsure => Tags::NONE,
            _ => Tags::NONE.with(Tag::Clean),
        };
        Self { add: Tags::NONE.with(tag), remove, ..Self::default() }
    }

    /// Removes a tag.
    pub fn removing(tag: Tag) -> Self {
        Self { remove: Tags::NONE.with(tag), ..Self::default() }
    }

    /// Takes everything back that was said.
    pub fn clearing() -> Self {
        Self {
            remove: Tag::ALL.into_iter().collect(),
            note: Some(String::new()),
            person: Some(None),
            region: Some(None),
            verdict: Some(None),
            ..Self::default()
        }
    }

    /// What leads from one label to another: the inverse of an act is the change from its `after` to its `before`.
    pub fn between(from: &Label, to: &Label) -> Self {
        Self {
            add: to.tags.minus(from.tags),
            remove: from.tags.minus(to.tags),
            note: (from.note != to.note).then(|| to.note.clone()),
            person: (from.person != to.person).then_some(to.person),
            region: (from.region != to.region).then(|| to.region.clone()),
            verdict: (from.verdict != to.verdict).then_some(to.verdict),
        }
    }

    /// The label after this change.
    pub fn applied(&self, label: &Label) -> Label {
        Label {
            tags: label.tags.minus(self.remove).union(self.add),
            note: self.note.clone().unwrap_or_else(|| label.note.clone()),
            person: self.person.unwrap_or(label.person),
            region: self.region.clone().unwrap_or_else(|| label.region.clone()),
            verdict: self.verdict.unwrap_or(label.verdict),
        }
    }
}

/// Which frame is meant.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FrameId {
    /// The frame's name in its data set, for example `d1s1/000/00383`; this is what identifies it.
    pub path: String,
    /// Its index when it was labelled; a hint, for a data set may have grown since.
    #[serde(default)]
    pub index: usize,
}

/// The fit that a person saw when they judged.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Judged {
    /// Hash of the parameters on screen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<String>,
    /// Hash of the settings that they were fitted with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub config: Option<String>,
    /// The iteration on screen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iteration: Option<usize>,
    /// The program's own evidence scores at that moment, 0..1 by failure mode, whether they were shown or not.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub machine: BTreeMap<Tag, f64>,
    /// Cells that the fit did not see, the boxes around them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub erased: Vec<CellRegion>,
    /// True where those scores were on screen.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub machine_shown: bool,
}

/// One line of a journal: what a frame's label is after an act. A line that another program wrote may lack what only
/// tells of its origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Fingerprint of the data set.
    #[serde(default)]
    pub dataset: String,
    /// The frame.
    pub frame: FrameId,
    /// Its label after the act.
    pub label: Label,
    /// Who.
    pub annotator: String,
    /// When, RFC 3339 in UTC with milliseconds.
    pub time: String,
    /// The order, in milliseconds since 1970, of the record that this one replaces, where `time` alone is not later: the
    /// other was written by a clock that is ahead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<i64>,
    /// The act in words: `tag F2 on 12 frames`, `undo: tag F2`.
    #[serde(default)]
    pub act: String,
    /// Version of the program.
    #[serde(default)]
    pub program: String,
    /// What was judged.
    #[serde(default)]
    pub judged: Judged,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_between_two_labels_leads_from_one_to_the_other() {
        let from = Label { tags: Tags::NONE.with(Tag::F1), note: "old".into(), person: Some(1), ..Label::default() };
        let region = CellRegion { view: "hm".into(), lo: vec![1, 2], hi: vec![3, 4] };
        let to = Label {
            tags: Tags::NONE.with(Tag::F3).with(Tag::Unsure),
            verdict: Some(Verdict::BothIncorrect),
            region: Some(region),
            ..Label::default()
        };
        assert_eq!(Change::between(&from, &to).applied(&from), to);
        assert_eq!(Change::between(&to, &from).applied(&to), from);
        assert_eq!(Change::between(&to, &to), Change::default());
    }

    #[test]
    fn clean_and_the_failure_modes_exclude_each_other() {
        let label = Change::adding(Tag::F2).applied(&Change::adding(Tag::F1).applied(&Label::default()));
        assert_eq!(label.tags.to_string(), "F1 F2");
        let clean = Change::adding(Tag::Clean).applied(&label);
        assert_eq!(clean.tags.to_string(), "clean");
        assert_eq!(Change::adding(Tag::F4).applied(&clean).tags.to_string(), "F4");
        assert_eq!(Change::adding(Tag::Unsure).applied(&label).tags.to_string(), "F1 F2 unsure");
    }

    #[test]
    fn regions_read_back_what_they_write() {
        let region =
            |view: &str, lo: &[usize], hi: &[usize]| CellRegion { view: view.into(), lo: lo.into(), hi: hi.into() };
        for region in [region("hm_hori", &[10, 30], &[20, 42]), region("a[0], b", &[0], &[0]), region("", &[], &[])] {
            assert_eq!(region.to_string().parse(), Ok(region));
        }
        assert_eq!("v[1..=2,3..=4] ".parse(), Ok(region("v", &[1, 3], &[2, 4])));
        for wrong in
            ["", "v", "v[1..2]", "v[2..=1]", "v[1..=2", "v[1..=2,]", "v[-1..=2]", "v[1..=99999999999999999999]"]
        {
            assert!(wrong.parse::<CellRegion>().is_err_and(|why| why.contains("hm_hori[10..=20, 30..=42]")), "{wrong}");
        }
    }
}
