//! What a script or a command line asks for, as a change of a label; and the frames that it names.

use crate::dataset::Dataset;
use crate::labels::{Change, FrameId, Tag, Tags, Verdict};
use serde::{Deserialize, Deserializer};
use std::collections::HashMap;

/// One act on one frame, as a line of `labels tag --from-stdin` says it.
#[expect(clippy::option_option, reason = "left out, taken back and given are three things to ask for")]
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Request {
    /// The frame's name, or its index.
    #[serde(deserialize_with = "name_or_index")]
    pub(super) frame: Option<String>,
    pub(super) add: Vec<Tag>,
    pub(super) remove: Vec<Tag>,
    pub(super) note: Option<String>,
    #[serde(deserialize_with = "or_null")]
    pub(super) person: Option<Option<u32>>,
    #[serde(deserialize_with = "or_null")]
    pub(super) verdict: Option<Option<Verdict>>,
}

impl Request {
    /// The change; what is added takes away what it excludes.
    ///
    /// # Errors
    /// In words, where the request contradicts itself.
    pub(super) fn change(&self) -> Result<Change, String> {
        let add: Tags = self.add.iter().copied().collect();
        let asked: Tags = self.remove.iter().copied().collect();
        let excluded = add.iter().fold(Tags::NONE, |tags, tag| tags.union(Change::adding(tag).remove));
        if let Some(tag) = add.iter().find(|tag| asked.contains(*tag)) {
            return Err(format!("{tag} is to be added and removed"));
        }
        if let Some(tag) = add.iter().find(|tag| excluded.contains(*tag)) {
            return Err(format!("{tag} and another tag to be added exclude each other: {add}"));
        }
        let (note, person, verdict) = (self.note.clone(), self.person, self.verdict);
        Ok(Change { add, remove: asked.union(excluded), note, person, verdict, region: None })
    }
}

/// A string, or a number as one.
fn name_or_index<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a frame's name or index")]
    enum Either {
        Name(String),
        Index(u64),
    }
    Ok(Some(match Either::deserialize(deserializer)? {
        Either::Name(name) => name,
        Either::Index(index) => index.to_string(),
    }))
}

/// A field that is there, perhaps `null`.
#[expect(clippy::option_option, reason = "left out, taken back and given are three things to ask for")]
fn or_null<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<Option<T>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}

/// The frames of a data set by name.
pub(super) struct Frames<'a> {
    dataset: &'a Dataset,
    by_name: HashMap<String, usize>,
}

impl<'a> Frames<'a> {
    /// Names every frame.
    pub(super) fn new(dataset: &'a Dataset) -> Self {
        let mut by_name = HashMap::with_capacity(dataset.len());
        for index in 0..dataset.len() {
            by_name.entry(dataset.frame_name(index).to_owned()).or_insert(index);
        }
        Self { dataset, by_name }
    }

    /// Frames.
    pub(super) fn len(&self) -> usize {
        self.dataset.len()
    }

    /// The frame with this index.
    pub(super) fn at(&self, index: usize) -> FrameId {
        FrameId { path: self.dataset.frame_name(index).to_owned(), index }
    }

    /// The frame with this name.
    pub(super) fn named(&self, name: &str) -> Option<FrameId> {
        self.by_name.get(name).map(|&index| self.at(index))
    }

    /// The frame with this name; where there is none, with this index.
    ///
    /// # Errors
    /// In words, where there is neither.
    pub(super) fn find(&self, name: &str) -> Result<FrameId, String> {
        let by_index = || name.parse().ok().filter(|&index: &usize| index < self.len());
        let index = self.by_name.get(name).copied().or_else(by_index);
        let (last, root) = (self.len().saturating_sub(1), self.dataset.info().root.display());
        let wrong = || format!("no frame `{name}` in {root}; expected a frame's name or an index in 0..={last}");
        index.map(|index| self.at(index)).ok_or_else(wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(line: &str) -> Result<Change, String> {
        serde_json::from_str::<Request>(line).map_err(|why| why.to_string())?.change()
    }

    #[test]
    fn what_is_left_out_is_not_touched_and_null_takes_back() {
        assert_eq!(change(r#"{"frame":"a"}"#), Ok(Change::default()));
        let taken_back = change(r#"{"frame":3,"person":null,"verdict":null,"note":""}"#);
        let wanted = Change { person: Some(None), verdict: Some(None), note: Some(String::new()), ..Change::default() };
        assert_eq!(taken_back, Ok(wanted));
        assert_eq!(change(r#"{"frame":"a","add":["F2"]}"#), Ok(Change::adding(Tag::F2)));
    }

    #[test]
    fn contradictions_and_typos_are_refused() {
        assert!(change(r#"{"add":["F1"],"remove":["F1"]}"#).is_err_and(|why| why.contains("added and removed")));
        assert!(change(r#"{"add":["F1","clean"]}"#).is_err_and(|why| why.contains("exclude each other")));
        assert!(change(r#"{"ad":["F1"]}"#).is_err_and(|why| why.contains("unknown field `ad`")));
        assert!(change(r#"{"frame":1.5}"#).is_err_and(|why| why.contains("a frame's name or index")));
        assert!(change(r#"{"add":["F9"]}"#).is_err_and(|why| why.contains("F9")));
    }
}
