//! Where the labels of a data set lie: beside the data, so that they travel with it and every annotator finds them; in
//! the user's data folder where nothing can be written there.
//!
//! Whether something can be written is tried, not asked: permission bits say nothing to the superuser, and nothing of a
//! read-only mount or a full disk. Hence nothing is tried before something is to be written: who only reads takes
//! [`LabelPlace::to_read`], which touches nothing. The place that is not written to is read all the same, so that labels
//! made while a disk was read-only are not hidden once it no longer is, nor the other way round.

use super::LabelError;
use crate::folders;
use sha2::{Digest as _, Sha256};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// The ending of a journal.
pub(super) const ENDING: &str = ".labels.jsonl";
/// Names that Windows keeps for devices, whatever follows the dot.
const DEVICES: [&str; 22] = [
    "con", "prn", "aux", "nul", "com1", "com2", "com3", "com4", "com5", "com6", "com7", "com8", "com9", "lpt1", "lpt2",
    "lpt3", "lpt4", "lpt5", "lpt6", "lpt7", "lpt8", "lpt9",
];

/// The folder that the labels of a data set are written to, and those that they are read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelPlace {
    /// Written and read.
    pub folder: PathBuf,
    /// Only read: the place that would have been taken otherwise.
    pub also: Vec<PathBuf>,
    /// True where `folder` lies with the data.
    pub beside_data: bool,
    /// Why not, in words for the screen, where it does not.
    pub reason: Option<String>,
}

impl LabelPlace {
    /// Where the labels of the data set at `root`, a folder or a bare file, are read; nothing is tried, nothing is touched.
    /// What is written goes to [`Self::of`], which reads the same folders.
    pub fn to_read(root: &Path, fingerprint: &str) -> Self {
        let user = folders::user_data().map(|folder| folder.join("labels").join(fingerprint));
        let beside = beside(root);
        let unlisted = std::fs::read_dir(&beside).is_err_and(|reason| reason.kind() != ErrorKind::NotFound);
        match user {
            // Something else in the place of the folder, or one that is closed: that is why labels would lie elsewhere.
            Some(user) if unlisted => Self { folder: user, also: vec![beside], beside_data: false, reason: None },
            user => Self { folder: beside, also: user.into_iter().collect(), beside_data: true, reason: None },
        }
    }

    /// The place for the data set at `root`, a folder or a bare file, with this fingerprint. Tries whether it can be
    /// written, and leaves nothing behind but a new time of the folder: for whoever is about to write.
    ///
    /// # Errors
    /// Where neither beside the data nor in the user's data folder anything can be written.
    pub fn of(root: &Path, fingerprint: &str) -> Result<Self, LabelError> {
        Self::of_or(root, fingerprint, folders::user_data().as_deref())
    }

    /// As [`Self::of`], with the user's data folder given.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn of_or(root: &Path, fingerprint: &str, user_data: Option<&Path>) -> Result<Self, LabelError> {
        let beside = beside(root);
        let user = user_data.map(|folder| folder.join("labels").join(fingerprint));
        let Err(reason) = probe(&beside) else {
            return Ok(Self { folder: beside, also: user.into_iter().collect(), beside_data: true, reason: None });
        };
        let reason = format!("{} cannot be written: {reason}", beside.display());
        let no_place = |other: String| LabelError::NoPlace { beside: reason.clone(), other, path: root.to_owned() };
        let user = user.ok_or_else(|| no_place("there is no folder for the user's data".into()))?;
        let parent = user.parent().unwrap_or(&user);
        std::fs::create_dir_all(parent)
            .and_then(|()| probe(&user))
            .map_err(|why| no_place(format!("{} cannot be written: {why}", user.display())))?;
        Ok(Self { folder: user, also: vec![beside], beside_data: false, reason: Some(reason) })
    }

    /// This folder, whatever lies where.
    pub fn in_folder(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), also: Vec::new(), beside_data: true, reason: None }
    }

    /// The folders to read, the one that is written first.
    pub(super) fn folders(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.folder).chain(&self.also).map(PathBuf::as_path)
    }
}

/// `<root>/mhp-labels` of a folder, `<file>.mhp-labels` of a file.
fn beside(root: &Path) -> PathBuf {
    if !root.is_file() {
        return root.join("mhp-labels");
    }
    let mut name = root.file_name().unwrap_or_default().to_owned();
    name.push(".mhp-labels");
    root.with_file_name(name)
}

/// Writes a file in `folder` and removes it. Where `folder` does not exist, a sibling with a name of its own stands for
/// it: making and removing `folder` itself would pull it away from under another process.
fn probe(folder: &Path) -> std::io::Result<()> {
    static PROBES: AtomicU64 = AtomicU64::new(0);
    let (process, count) = (std::process::id(), PROBES.fetch_add(1, Ordering::Relaxed));
    let mark = format!("probe-{process}-{count}-{:x}", super::format::now_ms());
    if folder.symlink_metadata().is_ok() {
        return probe_file(&folder.join(format!(".{mark}")));
    }
    let stand_in = folder.with_file_name(format!(".mhp-labels-{mark}"));
    std::fs::create_dir(&stand_in)?;
    let done = probe_file(&stand_in.join("probe"));
    std::fs::remove_dir_all(&stand_in)?;
    done
}

fn probe_file(path: &Path) -> std::io::Result<()> {
    let written = std::fs::OpenOptions::new().create(true).append(true).open(path)?.write_all(b"probe\n");
    std::fs::remove_file(path)?;
    written
}

/// The name of an annotator's journal. Two names never share one, also where the file system takes upper and lower case
/// for the same.
pub(super) fn file_name(annotator: &str) -> String {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
    if annotator.len() <= 40 && annotator.chars().all(plain) && !DEVICES.contains(&annotator) {
        return format!("{annotator}{ENDING}");
    }
    let lower = annotator.to_lowercase();
    let word: String = lower.chars().take(24).map(|c| if plain(c) { c } else { '-' }).collect();
    let word = word.trim_matches('-');
    let word = if word.is_empty() || DEVICES.contains(&word) { "annotator" } else { word };
    let hash = Sha256::digest(annotator).iter().take(6).fold(0, |hash: u64, &byte| hash << 8 | u64::from(byte));
    format!("{word}.{hash:012x}{ENDING}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn plain_names_are_kept_and_others_get_a_hash() {
        assert_eq!(file_name("anna"), "anna.labels.jsonl");
        assert!(file_name("Anna").starts_with("anna.") && file_name("Anna") != file_name("anna"));
        assert!(file_name("Jörg M.").starts_with("j-rg-m."));
        assert!(file_name("../../etc/passwd").starts_with("etc-passwd."), "{}", file_name("../../etc/passwd"));
        assert!(file_name("李").starts_with("annotator.") && file_name("con").starts_with("annotator."));
        assert!(file_name(&"x".repeat(5000)).len() < 60);
    }

    #[test]
    fn names_that_look_alike_do_not_share_a_file() {
        let names =
            ["a", "A", "a b", "a-b", "a_b", "a.b", "a/b", "a\\b", "a\nb", "ä", "a\u{308}", "á", "con", "CON", "-"];
        let files: BTreeSet<String> = names.iter().map(|name| file_name(name).to_lowercase()).collect();
        assert_eq!(files.len(), names.len(), "{files:?}");
    }
}
