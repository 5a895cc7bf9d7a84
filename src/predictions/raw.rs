//! What a file of predictions says, before anybody knows which unit, axes and joints it has.

use crate::geometry::Vec3;
use std::fmt;

/// How a file calls a frame.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FrameKey {
    /// By a name or a path.
    Name(String),
    /// By its number in the data set, counted from 0.
    Index(usize),
}

impl FrameKey {
    /// A cell that may be either: a whole number is also kept as a name, for a frame may be called `00383`.
    pub(super) fn of(text: &str) -> Self {
        Self::Name(text.trim().to_owned())
    }
}

impl fmt::Display for FrameKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Index(index) => write!(f, "{index}"),
        }
    }
}

/// The people of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FileFrame {
    /// The frame.
    pub key: FrameKey,
    /// Joints of each person, in the file's unit and axes; not finite where the file has no number.
    pub persons: Vec<Vec<Vec3>>,
}

/// What a file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RawPredictions {
    /// The frames in the order of the file.
    pub frames: Vec<FileFrame>,
    /// Names of the joints; empty where the file has none.
    pub joints: Vec<String>,
    /// Joints of every person.
    pub joint_count: usize,
    /// The unit, where the file states it.
    pub unit: Option<String>,
    /// The axes, where the file states them.
    pub axes: Option<String>,
    /// What files alike are known by: format, keys and number of joints.
    pub form: String,
    /// Frames are those of the data set in its order, and must be as many.
    pub whole: bool,
}

impl RawPredictions {
    /// Collects persons row by row: those of one frame follow each other or not.
    pub(super) fn push(&mut self, key: FrameKey, person: Vec<Vec3>) {
        // Most files name a frame's persons one after the other.
        let known = match self.frames.last() {
            Some(last) if last.key == key => Some(self.frames.len() - 1),
            _ => None,
        };
        match known {
            Some(at) => self.frames[at].persons.push(person),
            None => self.frames.push(FileFrame { key, persons: vec![person] }),
        }
    }

    /// Brings the persons of one frame together, wherever in the file they are.
    pub(super) fn gather(&mut self) {
        let mut places: std::collections::HashMap<FrameKey, usize> = std::collections::HashMap::new();
        let mut frames: Vec<FileFrame> = Vec::with_capacity(self.frames.len());
        for frame in self.frames.drain(..) {
            if let Some(&at) = places.get(&frame.key) {
                frames[at].persons.extend(frame.persons);
            } else {
                places.insert(frame.key.clone(), frames.len());
                frames.push(frame);
            }
        }
        self.frames = frames;
    }
}
