//! Tags, sets of tags, verdicts: what can be said of a frame with one key.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What a person may say of a frame's fit; several at once. F1 to F4 are the paper's failure modes (section 5.4.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Tag {
    /// Static reflector dominance: stationary structures dominate the mask.
    F1,
    /// Near-field distortion: the person is too near for the far-field model.
    F2,
    /// Close multi-person superposition: the echoes of several people overlap.
    F3,
    /// Low-motion ambiguity: hardly any Doppler tells the person from the room.
    F4,
    /// No failure.
    #[serde(rename = "clean")]
    Clean,
    /// The annotator cannot tell.
    #[serde(rename = "unsure")]
    Unsure,
}

impl Tag {
    /// Every tag, in the order of the digits 1 2 3 4 0 5.
    pub const ALL: [Self; 6] = [Self::F1, Self::F2, Self::F3, Self::F4, Self::Clean, Self::Unsure];
    /// The failure modes.
    pub const MODES: [Self; 4] = [Self::F1, Self::F2, Self::F3, Self::F4];

    /// As written in journals, tables and filters: `F1` … `F4`, `clean`, `unsure`.
    pub fn code(self) -> &'static str {
        match self {
            Self::F1 => "F1",
            Self::F2 => "F2",
            Self::F3 => "F3",
            Self::F4 => "F4",
            Self::Clean => "clean",
            Self::Unsure => "unsure",
        }
    }

    /// What it means, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::F1 => "static reflector dominance",
            Self::F2 => "near-field distortion",
            Self::F3 => "close multi-person superposition",
            Self::F4 => "low-motion ambiguity",
            Self::Clean => "no failure",
            Self::Unsure => "cannot tell",
        }
    }

    /// The key that toggles it.
    pub fn digit(self) -> char {
        match self {
            Self::F1 => '1',
            Self::F2 => '2',
            Self::F3 => '3',
            Self::F4 => '4',
            Self::Clean => '0',
            Self::Unsure => '5',
        }
    }
}

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.code())
    }
}

impl FromStr for Tag {
    type Err = String;

    /// Upper and lower case are the same.
    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|tag| tag.code().eq_ignore_ascii_case(text.trim()));
        found.ok_or_else(|| format!("`{text}` is no tag; expected F1, F2, F3, F4, clean or unsure"))
    }
}

/// A set of tags, written as a list of codes in the order of [`Tag::ALL`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(from = "Vec<Tag>", into = "Vec<Tag>")]
pub struct Tags(u8);

impl Tags {
    /// No tag.
    pub const NONE: Self = Self(0);

    /// True where `tag` is in the set.
    pub fn contains(self, tag: Tag) -> bool {
        self.0 & (1 << tag as u8) != 0
    }

    /// The set with `tag`.
    pub fn with(self, tag: Tag) -> Self {
        Self(self.0 | 1 << tag as u8)
    }

    /// The set without `tag`.
    pub fn without(self, tag: Tag) -> Self {
        Self(self.0 & !(1 << tag as u8))
    }

    /// Tags in either set.
    pub fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Tags in this set and not in the other.
    pub fn minus(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// True for the empty set.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The tags, in the order of [`Tag::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Tag> {
        Tag::ALL.into_iter().filter(move |&tag| self.contains(tag))
    }
}

impl FromIterator<Tag> for Tags {
    fn from_iter<I: IntoIterator<Item = Tag>>(tags: I) -> Self {
        tags.into_iter().fold(Self::NONE, Self::with)
    }
}

impl From<Vec<Tag>> for Tags {
    fn from(tags: Vec<Tag>) -> Self {
        tags.into_iter().collect()
    }
}

impl From<Tags> for Vec<Tag> {
    fn from(tags: Tags) -> Self {
        tags.iter().collect()
    }
}

impl fmt::Display for Tags {
    /// `F1 F3`; empty for no tag.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, tag) in self.iter().enumerate() {
            let space = if i > 0 { " " } else { "" };
            write!(f, "{space}{tag}")?;
        }
        Ok(())
    }
}

impl FromStr for Tags {
    type Err = String;

    /// Codes separated by spaces, commas or semicolons.
    fn from_str(text: &str) -> Result<Self, String> {
        text.split([' ', ',', ';']).filter(|part| !part.is_empty()).map(str::parse).collect()
    }
}

/// The paper's second review protocol: whose error it is that a frame is annotated with another number of people than is
/// counted (appendix A.3, count-matched evaluation).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The annotation is wrong: another number of people, or joints given to the wrong one.
    AnnotationError,
    /// The number of people that was counted is wrong.
    DetectionError,
    /// Both are wrong.
    BothIncorrect,
    /// Neither is: both systems are right, and the mismatch is a variation of the tracking that passes.
    TrueNegative,
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Self; 4] = [Self::AnnotationError, Self::DetectionError, Self::BothIncorrect, Self::TrueNegative];

    /// As written in journals and tables.
    pub fn code(self) -> &'static str {
        match self {
            Self::AnnotationError => "annotation-error",
            Self::DetectionError => "detection-error",
            Self::BothIncorrect => "both-incorrect",
            Self::TrueNegative => "true-negative",
        }
    }

    /// What it means, in a sentence.
    pub const fn words(self) -> &'static str {
        match self {
            Self::AnnotationError => {
                "The annotation is wrong: another number of people, or joints given to the wrong person."
            }
            Self::DetectionError => {
                "The detection is wrong: the program counted another number of people than are there."
            }
            Self::BothIncorrect => "Both are wrong, the annotation and the detection.",
            Self::TrueNegative => "Both are right: the numbers differ only by a variation of the tracking that passes.",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.code())
    }
}

impl FromStr for Verdict {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|verdict| verdict.code().eq_ignore_ascii_case(text.trim()));
        let expected = "annotation-error, detection-error, both-incorrect or true-negative";
        found.ok_or_else(|| format!("`{text}` is no verdict; expected {expected}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_and_verdicts_read_back_what_they_write() {
        for tag in Tag::ALL {
            assert_eq!(tag.code().parse(), Ok(tag));
        }
        for verdict in Verdict::ALL {
            assert_eq!(verdict.code().parse(), Ok(verdict));
        }
        let tags: Tags = Tag::ALL.into_iter().collect();
        assert_eq!(tags.to_string().parse(), Ok(tags));
        assert_eq!("f1;F3".parse::<Tags>().map(|tags| tags.to_string()), Ok("F1 F3".into()));
        assert!("F9".parse::<Tags>().is_err_and(|why| why.contains("expected F1")));
    }
}
