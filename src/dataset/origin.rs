//! Where a frame comes from: the scene, who is in it, which recording it is of, what is done.

use serde::{Deserialize, Serialize};
use std::fmt;
use wildmatch::WildMatch;

/// What is known of where a frame comes from; by the layout's names, and before them by the manifest's `[[origin]]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// The room, or its arrangement.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Who is in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subject: Option<String>,
    /// The recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    /// What is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<String>,
}

/// A part of an origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OriginPart {
    /// The room, or its arrangement.
    Scene,
    /// Who is in it.
    Subject,
    /// The recording.
    Session,
    /// What is done.
    Action,
}

impl OriginPart {
    /// All of them, in the order of [`Origin::PARTS`].
    pub const ALL: [Self; 4] = [Self::Scene, Self::Subject, Self::Session, Self::Action];

    /// As columns and filters have it.
    pub fn key(self) -> &'static str {
        Origin::PARTS[self as usize]
    }
}

impl Origin {
    /// What is known of a part.
    pub fn part(&self, part: OriginPart) -> Option<&str> {
        self.parts()[part as usize]
    }

    /// The names of [`Self::parts`], as columns of tables have them.
    pub const PARTS: [&'static str; 4] = ["scene", "subject", "session", "action"];

    /// Scene, subject, session, action.
    pub fn parts(&self) -> [Option<&str>; 4] {
        [&self.scene, &self.subject, &self.session, &self.action].map(Option::as_deref)
    }

    /// Whether nothing is known.
    pub fn is_unknown(&self) -> bool {
        *self == Self::default()
    }

    /// What is known here, and of the rest what `other` knows.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            scene: self.scene.or(other.scene),
            subject: self.subject.or(other.subject),
            session: self.session.or(other.session),
            action: self.action.or(other.action),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = Self::PARTS.iter().zip(self.parts()).filter_map(|(name, part)| Some(format!("{name} {}", part?)));
        f.write_str(&known.collect::<Vec<_>>().join(", "))
    }
}

/// A manifest's `[[origin]]`: what holds for the frames whose names, or whose sequences, are like a pattern.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OriginRule {
    /// Names of frames or sequences, with `*` and `?`.
    #[serde(default)]
    frames: Like,
    /// The scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scene: Option<String>,
    /// Who is in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    subject: Option<String>,
    /// The recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    session: Option<String>,
    /// What is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    action: Option<String>,
}

/// A pattern, ready to be compared: every frame of a list is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
struct Like(WildMatch);

impl Default for Like {
    fn default() -> Self {
        Self(WildMatch::new("*"))
    }
}

impl From<String> for Like {
    fn from(pattern: String) -> Self {
        Self(WildMatch::new(&pattern))
    }
}

impl From<Like> for String {
    fn from(like: Like) -> Self {
        like.0.to_string()
    }
}

impl OriginRule {
    /// What it says of a frame.
    pub(super) fn of(&self, sequence: &str, name: &str) -> Origin {
        if !self.frames.0.matches(name) && !self.frames.0.matches(sequence) {
            return Origin::default();
        }
        let Self { scene, subject, session, action, .. } = self.clone();
        Origin { scene, subject, session, action }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_rule_that_says_something_holds() {
        let rule = |frames: &str, scene: Option<&str>, subject: Option<&str>| OriginRule {
            frames: frames.to_owned().into(),
            scene: scene.map(Into::into),
            subject: subject.map(Into::into),
            session: None,
            action: None,
        };
        let rules = [rule("lab/*", Some("lab"), None), rule("*", Some("hall"), Some("anna"))];
        let of = |sequence: &str, name: &str| {
            rules.iter().fold(Origin::default(), |known, rule| known.or(rule.of(sequence, name))).to_string()
        };
        assert_eq!(of("lab/3", "lab/3/00001"), "scene lab, subject anna");
        assert_eq!(of("x", "x/00001"), "scene hall, subject anna");
        assert!(Origin::default().is_unknown());
    }
}
