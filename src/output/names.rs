//! The file of each frame: one flat, portable name a frame, for all frames of a data set at once.
//!
//! A frame's name (`d1s1/000/00383`) becomes a file's (`d1s1_000_00383`) with `_` for `/`. Where that name is no file's on some
//! system, or another frame has the same one (also where case does not count), the first digits of the SHA-256 of the whole name
//! follow. Both depend on the names of the data set alone, so that what one command writes another finds.

use crate::digest;
use sha2::{Digest as _, Sha256};
use std::borrow::Cow;
use std::collections::HashMap;

/// Bytes of a name without its ending.
const MOST_BYTES: usize = 150;
/// Names that are devices on Windows, whatever their ending.
const DEVICES: [&str; 6] = ["con", "prn", "aux", "nul", "conin$", "conout$"];

/// Names of files by index of the frame.
#[derive(Debug, Clone, Default)]
pub struct FileNames {
    /// Those that are not simply flat.
    special: HashMap<usize, Special>,
}

impl FileNames {
    /// Of all frames of a data set, in its order; `name` gives the name of each.
    pub fn new<'a>(count: usize, name: impl Fn(usize) -> &'a str) -> Self {
        let mut special: HashMap<usize, Special> = HashMap::new();
        let mut taken: HashMap<String, Vec<usize>> = HashMap::with_capacity(count);
        for index in 0..count {
            let flat = flat(name(index));
            let own = if is_portable(&flat) {
                folded(&flat)
            } else {
                folded(&special.entry(index).or_insert_with(|| Special::new(name(index), index, 1)).name)
            };
            taken.entry(own).or_default().push(index);
        }
        let shared = |(own, frames): (&String, &Vec<usize>)| (frames.len() > 1).then(|| own.clone());
        let mut shared: Vec<String> = taken.iter().filter_map(shared).collect();
        // Sorted, because a map has no order and the names must not depend on one.
        shared.sort();
        // A name with a digest may be that of another frame, made to look so: both go on to the next digest.
        while let Some(own) = shared.pop() {
            for index in taken.remove(&own).unwrap_or_default() {
                let level = special.get(&index).map_or(0, |special| special.level);
                let next = Special::new(name(index), index, level + 1);
                let own = folded(&next.name);
                let others = taken.entry(own.clone()).or_default();
                others.push(index);
                if others.len() == 2 {
                    shared.push(own);
                }
                special.insert(index, next);
            }
        }
        Self { special }
    }

    /// The name of the file of frame `index`, which is called `name`; without an ending.
    pub fn of<'a>(&'a self, index: usize, name: &'a str) -> Cow<'a, str> {
        self.special.get(&index).map_or_else(|| flat(name), |special| Cow::Borrowed(special.name.as_str()))
    }
}

/// A name with a digest.
#[derive(Debug, Clone)]
struct Special {
    name: String,
    /// Which digest: of the frame's name; another of it; and, for frames of one and the same name, with the index.
    level: u32,
}

impl Special {
    fn new(name: &str, index: usize, level: u32) -> Self {
        let text = match level {
            1 => name.to_owned(),
            2 => format!("{name}\u{0}"),
            _ => format!("{name}\u{0}{index}\u{0}{level}"),
        };
        Self { name: hashed(name, &digest::short(Sha256::new_with_prefix(text))), level }
    }
}

/// A name that is a file's on every system, for a file that stands alone.
#[cfg(feature = "viewer")]
pub(crate) fn portable(name: &str) -> Cow<'_, str> {
    let flat = flat(name);
    if is_portable(&flat) { flat } else { Cow::Owned(Special::new(name, 0, 1).name) }
}

fn flat(name: &str) -> Cow<'_, str> {
    if name.contains(['/', '\\']) { Cow::Owned(name.replace(['/', '\\'], "_")) } else { Cow::Borrowed(name) }
}

/// What can be a file's name of a name that cannot, and the digest that makes it the frame's alone; at most [`MOST_BYTES`].
fn hashed(name: &str, digest: &str) -> String {
    let plain = |c: char| if is_plain(c) && !is_combining(c) { c } else { '_' };
    let plain: String = name.chars().map(plain).collect::<String>().replace("..", "__");
    let plain = plain.trim_matches(['.', ' ']);
    let room = MOST_BYTES - 2 - digest.len();
    let end = (0..=room.min(plain.len())).rev().find(|&end| plain.is_char_boundary(end)).unwrap_or(0);
    let stem = plain.get(..end).unwrap_or_default().trim_end_matches(['.', ' ']);
    // The digest behind a device's name does not help where a dot follows it: `con.x-0123` is the device still.
    let guard = if is_device(stem) { "_" } else { "" };
    format!("{guard}{stem}-{digest}")
}

/// True where every system takes it for the name of one file in the folder.
fn is_portable(flat: &str) -> bool {
    let edges = flat.starts_with(['.', ' ']) || flat.ends_with(['.', ' ']);
    let composed = !flat.chars().any(is_combining);
    !flat.is_empty() && !edges && flat.len() <= MOST_BYTES && flat.chars().all(is_plain) && composed && !is_device(flat)
}

/// No control or direction character, and none that some system keeps for itself.
fn is_plain(c: char) -> bool {
    let unseen = matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}');
    !(c.is_control() || unseen || "<>:\"|?*/\\".contains(c))
}

/// Parts of characters that some systems join to one character, so that two names become one.
fn is_combining(c: char) -> bool {
    matches!(c, '\u{300}'..='\u{36f}' | '\u{1100}'..='\u{11ff}' | '\u{3099}' | '\u{309a}')
}

fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().trim_end().to_lowercase();
    let numbered = ["com", "lpt"].iter().find_map(|port| stem.strip_prefix(port));
    let port = numbered.is_some_and(|rest| matches!(rest, "\u{b9}" | "\u{b2}" | "\u{b3}") || is_digit(rest));
    port || DEVICES.contains(&stem.as_str())
}

fn is_digit(text: &str) -> bool {
    text.len() == 1 && text.bytes().all(|b| b.is_ascii_digit())
}

/// As a system compares names for which case does not count.
pub(super) fn folded(name: &str) -> String {
    if name.is_ascii() {
        return name.to_ascii_lowercase();
    }
    name.chars().flat_map(char::to_uppercase).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn names(frames: &[&str]) -> Vec<String> {
        let names = FileNames::new(frames.len(), |i| frames[i]);
        frames.iter().enumerate().map(|(i, name)| names.of(i, name).into_owned()).collect()
    }

    #[test]
    fn harmless_names_stay_what_they_are() {
        assert_eq!(names(&["d1s1/000/00383", "walk/a b.c"]), ["d1s1_000_00383", "walk_a b.c"]);
    }

    #[test]
    fn names_that_would_share_a_file_have_one_each_in_any_order() {
        let frames = ["x/a_b", "x_a/b", "x/A_b", "x/c"];
        let made = names(&frames);
        assert_eq!(made[3], "x_c");
        for (name, frame) in made.iter().zip(frames).take(3) {
            assert!(name.to_lowercase().starts_with("x_a_b-"), "{name}");
            assert!(name.ends_with(&digest::short(Sha256::new_with_prefix(frame))), "{name}");
        }
        let turned = names(&["x/c", "x/A_b", "x_a/b", "x/a_b"]);
        assert_eq!(turned.iter().rev().collect::<Vec<_>>(), made.iter().collect::<Vec<_>>());
    }

    #[test]
    fn a_name_made_to_look_like_a_hashed_one_is_hashed_too() {
        let trap = names(&["x/a", "x_a"])[0].clone();
        let made = names(&["x/a", "x_a", &trap]);
        assert_eq!(made.iter().collect::<BTreeSet<_>>().len(), 3, "{made:?}");
        let twins = names(&["a/b", "a/b"]);
        assert_ne!(twins[0], twins[1]);
    }

    #[test]
    fn no_name_leads_out_of_its_folder_or_to_a_device() {
        let long = "ä".repeat(2500);
        let hostile = ["..", ".", "", "/", "../../etc/passwd", "/etc/passwd", "C:\\x", "a\u{0}b", "two\nlines", "NUL"];
        let more = ["con.x.y", "Lpt1", "end.", "end ", ".hidden", "a:b", "ab\u{202e}c", "e\u{301}", &long];
        for name in names(&[&hostile[..], &more[..]].concat()) {
            assert!(is_portable(&name), "{name:?}");
            assert!(name.len() <= MOST_BYTES && !name.contains(".."), "{name:?}");
        }
    }

    #[test]
    fn a_whole_mmvr_keeps_its_names() {
        let frames: Vec<String> =
            (0..355_500).map(|k| format!("d{}s1/{:03}/{:05}", k / 90_000, k / 900, k % 900)).collect();
        let names = FileNames::new(frames.len(), |i| &frames[i]);
        assert!(names.special.is_empty());
    }

    proptest! {
        #[test]
        fn whatever_frames_are_called_each_has_a_file_of_its_own(frames in prop::collection::vec("[aAbß_/.\\\\ :\u{301}\n]{0,6}", 0..40)) {
            let frames: Vec<&str> = frames.iter().map(String::as_str).collect();
            let made = names(&frames);
            let different: BTreeSet<String> = made.iter().map(|name| folded(name)).collect();
            prop_assert_eq!(different.len(), frames.len(), "{:?}", made);
            prop_assert!(made.iter().all(|name| is_portable(name)), "{:?}", made);
        }
    }
}
