//! Fits of many frames that are kept beside the labels of a data set, so that a window finds them again.
//!
//! `fits-<id>.jsonl`: the first line says of what ([`FitsOf`]: data set, settings, scalar, program), then a line a frame, a
//! [`BatchRow`] with a stamp of the files that its fit read ([`FrameStamps`]), appended as soon as it is known: a batch that is
//! cancelled or killed goes on where it was. A frame that comes twice counts as the last line says; a torn line is dropped, one
//! whose files have changed since counts for nothing, and their frames are done again.

use super::complexity::stamps;
use super::{BatchRow, FileError};
use crate::config::FitConfig;
use crate::dataset::Dataset;
use crate::digest;
use crate::input::read_bytes;
use crate::mhp::Precision;
use crate::start::LEAD_IN;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::collections::{BTreeMap, HashMap};
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Bytes of one file that are read: some 400 a frame.
const MOST_BYTES: u64 = 1 << 30;
const BEGINS: &str = "fits-";
const ENDS: &str = ".jsonl";

/// What fits are of: they are the same again only where all of it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitsOf {
    /// Fingerprint of the data set.
    pub dataset: String,
    /// Settings.
    pub config: FitConfig,
    /// Scalar of the per-cell kernel.
    pub precision: Precision,
    /// Version of the program that fitted.
    pub program: String,
}

impl FitsOf {
    /// By this program.
    pub fn new(dataset: &str, config: FitConfig, precision: Precision) -> Self {
        Self { dataset: dataset.to_owned(), config, precision, program: env!("CARGO_PKG_VERSION").to_owned() }
    }

    /// The name of their file.
    fn file_name(&self) -> String {
        let text = format!("{}\n{:?}\n{}\n{}", self.dataset, self.precision, self.program, self.config.to_toml());
        format!("{BEGINS}{}{ENDS}", digest::short(Sha256::new_with_prefix(text)))
    }
}

/// Fits that were found.
#[derive(Debug, Clone, PartialEq)]
pub struct KeptFits {
    /// Of what.
    pub of: FitsOf,
    /// A row a frame, by index.
    pub rows: BTreeMap<usize, BatchRow>,
    /// When the last of them came.
    pub at: std::time::SystemTime,
}

/// Frames before and after one that its fit may read: to count people, and to start and fit in a window.
const READ_AROUND: [usize; 2] = [LEAD_IN, LEAD_IN];

/// What the files that the fit of a frame reads are: their paths, sizes and times. Nothing is opened for it.
#[derive(Debug)]
pub struct FrameStamps<'a> {
    dataset: &'a Dataset,
    known: HashMap<usize, Option<stamps::Key>>,
}

impl<'a> FrameStamps<'a> {
    /// Of the frames of a data set.
    pub fn new(dataset: &'a Dataset) -> Self {
        Self { dataset, known: HashMap::new() }
    }

    /// The stamp of a frame; `None` where a file cannot even be asked for its size.
    pub fn of(&mut self, index: usize) -> Option<String> {
        let (dataset, sequence) = (self.dataset, self.dataset.sequence(index));
        let around = index.saturating_sub(READ_AROUND[0])..(index + READ_AROUND[1] + 1).min(dataset.len());
        let around = around.filter(|&other| dataset.sequence(other) == sequence);
        let stamps: Vec<_> =
            around.map(|other| *self.known.entry(other).or_insert_with(|| stamps::stamp(dataset, other))).collect();
        stamps::joined(&stamps).map(stamps::Key::text)
    }
}

/// A line of a file of kept fits.
#[derive(Serialize, Deserialize)]
struct Line<Row> {
    /// Of the files that the fit read.
    stamp: Option<String>,
    #[serde(flatten)]
    row: Row,
}

/// Every file of kept fits of the data set with fingerprint `dataset` in `folders`, the newest last, with the rows whose stamps
/// are those that `stamp_of` gives for their frames; what cannot be read, or is of files that changed, is left out, with the reason.
pub fn kept_fits(
    folders: &[PathBuf],
    dataset: &str,
    mut stamp_of: impl FnMut(usize) -> Option<String>,
) -> (Vec<KeptFits>, Vec<String>) {
    let (mut found, mut wrong) = (Vec::new(), Vec::new());
    let listed = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    for entry in listed {
        let name = entry.file_name();
        if !name.to_str().is_some_and(|name| name.starts_with(BEGINS) && name.ends_with(ENDS)) {
            continue;
        }
        match read(&entry.path(), |of| of.dataset == dataset, &mut stamp_of) {
            Ok(Some((kept, changed))) => {
                if changed > 0 {
                    let name = name.to_string_lossy();
                    wrong.push(format!("{name}: {changed} fits are stale: files that they read have changed since"));
                }
                found.push(kept);
            }
            Ok(None) => {}
            Err(error) => wrong.push(error.to_string()),
        }
    }
    found.sort_by_key(|kept| kept.at);
    (found, wrong)
}

/// A file of kept fits where they are `wanted`, and how many rows were left out because their files changed.
fn read(
    path: &Path,
    wanted: impl Fn(&FitsOf) -> bool,
    stamp_of: &mut impl FnMut(usize) -> Option<String>,
) -> Result<Option<(KeptFits, usize)>, FileError> {
    let bytes = read_bytes(path, "fits of a data set", MOST_BYTES).map_err(FileError::reading(path))?;
    let at = path.metadata().and_then(|file| file.modified()).unwrap_or(std::time::UNIX_EPOCH);
    let mut lines = bytes.split(|&byte| byte == b'\n').filter(|line| !line.is_empty());
    let head = lines.next().and_then(|line| serde_json::from_slice::<FitsOf>(line).ok());
    let Some(of) = head else {
        let message = "line 1 does not say of which data set and settings; expected {\"dataset\": …}".to_owned();
        return Err(FileError::Damaged { message, path: path.to_owned() });
    };
    if !wanted(&of) {
        return Ok(None);
    }
    let all = lines.filter_map(|line| serde_json::from_slice::<Line<BatchRow>>(line).ok());
    let mut rows: BTreeMap<usize, Line<BatchRow>> = all.map(|line| (line.row.index, line)).collect();
    let before = rows.len();
    rows.retain(|&index, line| line.stamp.is_some() && line.stamp == stamp_of(index));
    let changed = before - rows.len();
    Ok(Some((KeptFits { of, rows: rows.into_iter().map(|(index, line)| (index, line.row)).collect(), at }, changed)))
}

/// A file of kept fits that grows.
#[derive(Debug)]
pub struct FitsFile {
    file: File,
    path: PathBuf,
}

impl FitsFile {
    /// Opens the file of these fits in `folder`, or begins it, and gives what is in it with the stamps of `stamp_of`.
    ///
    /// # Errors
    /// Where it cannot be read or written.
    pub fn open(
        folder: &Path,
        of: &FitsOf,
        mut stamp_of: impl FnMut(usize) -> Option<String>,
    ) -> Result<(Self, BTreeMap<usize, BatchRow>), FileError> {
        let path = folder.join(of.file_name());
        std::fs::create_dir_all(folder).map_err(FileError::writing(folder))?;
        // One that is damaged or another's by its name alone gives way.
        let known =
            path.exists().then(|| read(&path, |found| found == of, &mut stamp_of)).and_then(Result::ok).flatten();
        let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(FileError::writing(&path))?;
        let begun = known.is_some();
        let written = (|| {
            if !begun {
                file.set_len(0)?;
                return file.write_all(line(of)?.as_bytes());
            }
            // Whatever a killed program left of a line ends here.
            file.write_all(b"\n")
        })();
        written.map_err(FileError::writing(&path))?;
        Ok((Self { file, path }, known.map_or_else(BTreeMap::new, |(kept, _)| kept.rows)))
    }

    /// Appends a row in one piece, with the stamp of what it was made of.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn add(&mut self, row: &BatchRow, stamp: Option<String>) -> Result<(), FileError> {
        let written = line(&Line { stamp, row }).and_then(|line| self.file.write_all(line.as_bytes()));
        written.map_err(FileError::writing(&self.path))
    }
}

fn line(what: &impl Serialize) -> std::io::Result<String> {
    Ok(serde_json::to_string(what)? + "\n")
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    fn row(index: usize, why: &str) -> BatchRow {
        BatchRow { index, frame: format!("f{index}"), fit: Err(why.into()), joints: None }
    }

    #[test]
    fn rows_come_back_by_data_settings_and_program() {
        let folder = tempfile::tempdir().unwrap();
        let stamp = |index: usize| Some(format!("{index}"));
        let of = FitsOf::new("abc", FitConfig::default(), Precision::F32);
        let (mut file, known) = FitsFile::open(folder.path(), &of, stamp).unwrap();
        assert!(known.is_empty());
        file.add(&row(3, "first"), stamp(3)).unwrap();
        file.add(&row(1, "dark"), stamp(1)).unwrap();
        file.add(&row(3, "then"), stamp(3)).unwrap();
        drop(file);
        // Killed in the middle of a line.
        let path = folder.path().join(of.file_name());
        OpenOptions::new().append(true).open(&path).unwrap().write_all(b"{\"index\": 4, \"fr").unwrap();
        let (mut file, known) = FitsFile::open(folder.path(), &of, stamp).unwrap();
        assert_eq!(known.values().cloned().collect::<Vec<_>>(), [row(1, "dark"), row(3, "then")]);
        file.add(&row(4, "again"), stamp(4)).unwrap();
        drop(file);

        let other = FitsOf { config: FitConfig { w_em: 2.0, ..FitConfig::default() }, ..of.clone() };
        assert!(FitsFile::open(folder.path(), &other, stamp).unwrap().1.is_empty(), "other settings");
        let later = FitsOf { program: "9".into(), ..of.clone() };
        assert_ne!(later.file_name(), of.file_name());
        std::fs::write(folder.path().join("fits-broken.jsonl"), "no head\n").unwrap();
        let (found, wrong) = kept_fits(&[folder.path().into(), folder.path().join("none")], "abc", stamp);
        let counts: Vec<usize> = found.iter().map(|kept| kept.rows.len()).collect();
        assert!(counts == [3, 0] || counts == [0, 3], "{counts:?}");
        assert!(wrong.len() == 1 && wrong[0].contains("line 1"), "{wrong:?}");
        assert_eq!(kept_fits(&[folder.path().into()], "another", stamp).0, []);
    }
    #[test]
    fn what_was_made_of_other_files_is_stale() {
        let folder = tempfile::tempdir().unwrap();
        let of = FitsOf::new("abc", FitConfig::default(), Precision::F32);
        let then = |_: usize| Some("then".to_owned());
        let mut file = FitsFile::open(folder.path(), &of, then).unwrap().0;
        file.add(&row(0, "a"), then(0)).unwrap();
        file.add(&row(1, "b"), then(1)).unwrap();
        file.add(&row(2, "never stamped"), None).unwrap();
        drop(file);
        let now = |index: usize| (index != 2).then(|| if index == 1 { "now".to_owned() } else { "then".to_owned() });
        let (found, told) = kept_fits(&[folder.path().into()], "abc", now);
        assert_eq!(found[0].rows.keys().copied().collect::<Vec<_>>(), [0]);
        assert!(told.len() == 1 && told[0].contains("2 fits are stale"), "{told:?}");
        assert_eq!(FitsFile::open(folder.path(), &of, now).unwrap().1.len(), 1, "the others are done again");
    }
}
