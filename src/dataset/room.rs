//! Where a radar stands in a room whose frame the joints of a data set are in, and the memory of it.
//!
//! HIBER gives its joints in the frame of its cameras, and publishes for none of its ten places of the radars how the two frames
//! lie. What `calibrate-room` finds is kept in `rooms.toml`: in the program's own folder, with the data set's path; or in the data
//! set itself where that is permitted, which then comes first. The file may be edited.

use super::DatasetError;
use crate::geometry::{Pose, Vec3, dot};
use crate::input::{MOST_TEXT, read_text};
use crate::output::{replace_file, resolved};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The name of the file.
pub const ROOMS_NAME: &str = "rooms.toml";
/// Farther than any room is large, m.
const FARTHEST_M: f64 = 1000.0;

/// Joints in the frame of a room, of a data set whose radar stands in several places of it.
pub trait RoomJoints: std::fmt::Debug + Send + Sync {
    /// The folder that the data set is, whichever part of it was opened: places are remembered by it.
    fn tree(&self) -> &Path;

    /// The place of the radar in frame `i`, for example `03`; `None` past the end.
    fn environment(&self, i: usize) -> Option<&str>;

    /// The joints of each person of frame `i` in the room's frame, m; none where they are not known.
    ///
    /// # Errors
    /// Where the file of the joints is there and cannot be read.
    fn joints(&self, i: usize) -> Result<Vec<Vec<Vec3>>, DatasetError>;

    /// How the maps were made, where the radar frame before was subtracted.
    fn frame_difference(&self) -> Option<FrameDifference>;
}

/// Maps of radar frames less the one before, of transmitters that send in turn (TDM-MIMO): what stands still is not in them.
/// Of HIBER both times are published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameDifference {
    /// From the radar frame that is subtracted to the one it is subtracted from, s.
    pub interval_s: f64,
    /// From one transmitter's chirp to the next one's, whose antenna is four half waves farther along the array, s.
    pub chirp_s: f64,
}

/// Where the radar of an environment is.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomTransform {
    /// The environment, for example `03`.
    pub environment: String,
    /// `p_radar = rotation · p_room + translation`, m.
    pub radar_from_room: Pose,
    /// How far the joints' middles are from the echoes', m, root of the mean square over the frames that agree; where it was found
    /// and not typed.
    pub residual_m: Option<f64>,
    /// Frames that agree, and frames that were looked at.
    pub frames: Option<[usize; 2]>,
}

/// The transforms of a data set.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RoomTransforms {
    known: Vec<RoomTransform>,
    /// What was wrong with a file of them.
    pub notes: Vec<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileText {
    #[serde(default)]
    room: Vec<RoomText>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RoomText {
    #[serde(skip_serializing_if = "Option::is_none")]
    tree: Option<PathBuf>,
    environment: String,
    rotation: [[f64; 3]; 3],
    translation_m: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    residual_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<[usize; 2]>,
}

impl RoomText {
    fn of(room: &RoomTransform, tree: Option<&Path>) -> Self {
        Self {
            tree: tree.map(Path::to_owned),
            environment: room.environment.clone(),
            rotation: room.radar_from_room.rotation,
            translation_m: room.radar_from_room.translation,
            residual_m: room.residual_m,
            frames: room.frames,
        }
    }

    /// In words, what is wrong with the numbers.
    fn fault(&self) -> Option<String> {
        let r = &self.rotation;
        let skew = |a: usize, b: usize| (dot(r[a], r[b]) - f64::from(u8::from(a == b))).abs();
        let straight = (0..3).all(|a| (a..3).all(|b| skew(a, b) < 1e-3));
        let numbers = || self.translation_m.iter().all(|x| x.abs() <= FARTHEST_M);
        (!(straight && numbers())).then(|| {
            format!(
                "environment \"{}\": expected a `rotation` of three rows of length 1 at right angles and a `translation_m` of at \
                 most {FARTHEST_M} m",
                self.environment
            )
        })
    }

    fn into_room(self) -> RoomTransform {
        RoomTransform {
            environment: self.environment,
            radar_from_room: Pose { rotation: self.rotation, translation: self.translation_m },
            residual_m: self.residual_m,
            frames: self.frames,
        }
    }
}

impl RoomTransforms {
    /// Those of the data set at `tree`: its own file's, then the user's. A file that cannot be read becomes a note.
    pub fn of(tree: &Path, home: Option<&Path>) -> Self {
        let mut all = Self::default();
        let places = [(tree.join(ROOMS_NAME), None)]
            .into_iter()
            .chain(home.map(|home| (home.join(ROOMS_NAME), Some(identity(tree)))));
        for (path, tree) in places {
            match read(&path) {
                Ok(rooms) => rooms.into_iter().filter(|room| room.tree == tree).for_each(|room| all.add(room)),
                Err(error) => all.notes.push(format!("no room transforms of it are taken: {error}")),
            }
        }
        all
    }

    fn add(&mut self, room: RoomText) {
        if self.of_environment(&room.environment).is_none() {
            self.known.push(room.into_room());
        }
    }

    /// That of an environment.
    pub fn of_environment(&self, environment: &str) -> Option<&RoomTransform> {
        self.known.iter().find(|room| room.environment == environment)
    }
}

/// Keeps a transform for the data set at `tree` in `file`, which says of which data set it is unless it lies in that.
///
/// # Errors
/// Where the file is there and is something else, or cannot be written.
pub fn remember_room(tree: &Path, file: &Path, room: &RoomTransform) -> Result<(), DatasetError> {
    let own = file.parent().is_some_and(|folder| identity(folder) == identity(tree));
    let tree = (!own).then(|| identity(tree));
    let mut rooms = read(file)?;
    rooms.retain(|known| known.tree != tree || known.environment != room.environment);
    rooms.push(RoomText::of(room, tree.as_deref()));
    write_rooms(file, rooms)
}

/// Writes transforms alone into `file`.
///
/// # Errors
/// Where it cannot be written.
pub fn write_stated_rooms(file: &Path, rooms: &[RoomTransform]) -> Result<(), DatasetError> {
    write_rooms(file, rooms.iter().map(|room| RoomText::of(room, None)).collect())
}

fn write_rooms(file: &Path, rooms: Vec<RoomText>) -> Result<(), DatasetError> {
    let failed = |reason| DatasetError::Write { reason, path: file.to_owned() };
    let text = toml::to_string(&FileText { room: rooms }).map_err(|error| failed(std::io::Error::other(error)))?;
    let text = format!("# p_radar = rotation * p_room + translation_m; metres, radar: x ahead, y left, z up\n{text}");
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    replace_file(file, |out| out.write_all(text.as_bytes())).map_err(failed)
}

/// The path by which a data set is remembered.
fn identity(tree: &Path) -> PathBuf {
    resolved(tree).unwrap_or_else(|_| tree.to_owned())
}

/// The transforms of a file; none where there is no file.
fn read(path: &Path) -> Result<Vec<RoomText>, DatasetError> {
    let text = match read_text(path, "room transforms (TOML)", MOST_TEXT) {
        Ok(text) => text,
        Err(reason) if reason.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(reason) => return Err(DatasetError::Read { reason, path: path.to_owned() }),
    };
    let fault = |message: String, line| DatasetError::Manifest { message, line, path: path.to_owned() };
    let parsed: FileText = toml::from_str(&text).map_err(|error| {
        let line = error.span().map(|span| 1 + text.bytes().take(span.start).filter(|&byte| byte == b'\n').count());
        fault(error.message().trim_end().replace('\n', "; "), line)
    })?;
    match parsed.room.iter().find_map(RoomText::fault) {
        Some(message) => Err(fault(message, None)),
        None => Ok(parsed.room),
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    #[test]
    fn transforms_are_kept_by_data_set_and_environment_and_the_data_sets_own_come_first() {
        let home = tempfile::tempdir().unwrap();
        let (tree, user) = (home.path().join("tree"), home.path().join("user"));
        std::fs::create_dir(&tree).unwrap();
        let room = |environment: &str, x: f64| RoomTransform {
            environment: environment.into(),
            radar_from_room: Pose { translation: [x, 0.0, 0.0], ..Pose::default() },
            residual_m: Some(0.04),
            frames: Some([180, 200]),
        };
        let file = user.join(ROOMS_NAME);
        for kept in [room("01", 1.0), room("02", 2.0), room("01", 3.0)] {
            remember_room(&tree, &file, &kept).unwrap();
        }
        remember_room(home.path(), &file, &room("01", 9.0)).unwrap();
        let all = || RoomTransforms::of(&tree, Some(&user));
        assert_eq!(all().of_environment("01"), Some(&room("01", 3.0)));
        assert_eq!(all().of_environment("02"), Some(&room("02", 2.0)));
        assert_eq!(all().of_environment("03"), None);
        remember_room(&tree, &tree.join(ROOMS_NAME), &room("02", 5.0)).unwrap();
        assert_eq!(all().of_environment("02"), Some(&room("02", 5.0)));
        for (text, wanted) in [
            ("room = 3", "rooms.toml:1: invalid type"),
            (
                "[[room]]\nenvironment = \"01\"\nrotation = [[1,0,0],[0,1,0],[0,1,0]]\ntranslation_m = [0,0,0]",
                "right angles",
            ),
            ("[[room]]\nenvironment = \"01\"\nplace = 1", "place"),
        ] {
            std::fs::write(tree.join(ROOMS_NAME), text).unwrap();
            let read = all();
            assert!(read.notes.len() == 1 && read.notes[0].contains(wanted), "{:?}", read.notes);
            assert_eq!(read.of_environment("01"), Some(&room("01", 3.0)), "the user's file is read all the same");
            assert!(remember_room(&tree, &tree.join(ROOMS_NAME), &room("01", 1.0)).is_err(), "it is not replaced");
        }
    }
}
