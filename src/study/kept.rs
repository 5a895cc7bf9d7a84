//! Fits of many frames that are kept beside the labels of a data set, so that a window finds them again.
//!
//! `fits-<id>.jsonl`: the first line says of what ([`FitsOf`]: data, settings, scalar, program), then a line a frame, a
//! [`BatchRow`], appended as soon as it is known: a batch that is cancelled or killed goes on where it was. A frame that
//! comes twice counts as the last line says; a torn line is dropped and its frame is done again.

use super::{BatchRow, FileError};
use crate::config::FitConfig;
use crate::digest;
use crate::input::read_bytes;
use crate::mhp::Precision;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
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

/// Every file of kept fits of a data set in `folders`, the newest last; what cannot be read is left out, with the reason.
pub fn kept_fits(folders: &[PathBuf], dataset: &str) -> (Vec<KeptFits>, Vec<String>) {
    let (mut found, mut wrong) = (Vec::new(), Vec::new());
    let listed = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    for entry in listed {
        let name = entry.file_name();
        if !name.to_str().is_some_and(|name| name.starts_with(BEGINS) && name.ends_with(ENDS)) {
            continue;
        }
        match read(&entry.path()) {
            Ok(kept) if kept.of.dataset == dataset => found.push(kept),
            Ok(_) => {}
            Err(error) => wrong.push(error.to_string()),
        }
    }
    found.sort_by_key(|kept| kept.at);
    (found, wrong)
}

/// A file of kept fits.
fn read(path: &Path) -> Result<KeptFits, FileError> {
    let bytes = read_bytes(path, "fits of a data set", MOST_BYTES).map_err(FileError::reading(path))?;
    let at = path.metadata().and_then(|file| file.modified()).unwrap_or(std::time::UNIX_EPOCH);
    let mut lines = bytes.split(|&byte| byte == b'\n').filter(|line| !line.is_empty());
    let head = lines.next().and_then(|line| serde_json::from_slice::<FitsOf>(line).ok());
    let Some(of) = head else {
        let message = "line 1 does not say of which data set and settings; expected {\"dataset\": …}".to_owned();
        return Err(FileError::Damaged { message, path: path.to_owned() });
    };
    let rows = lines.filter_map(|line| serde_json::from_slice::<BatchRow>(line).ok());
    Ok(KeptFits { of, rows: rows.map(|row| (row.index, row)).collect(), at })
}

/// A file of kept fits that grows.
#[derive(Debug)]
pub struct FitsFile {
    file: File,
    path: PathBuf,
}

impl FitsFile {
    /// Opens the file of these fits in `folder`, or begins it, and gives what is in it.
    ///
    /// # Errors
    /// Where it cannot be read or written.
    pub fn open(folder: &Path, of: &FitsOf) -> Result<(Self, BTreeMap<usize, BatchRow>), FileError> {
        let path = folder.join(of.file_name());
        std::fs::create_dir_all(folder).map_err(FileError::writing(folder))?;
        // One that is damaged or another's by its name alone gives way.
        let known = path.exists().then(|| read(&path)).and_then(Result::ok).filter(|kept| kept.of == *of);
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
        Ok((Self { file, path }, known.map_or_else(BTreeMap::new, |kept| kept.rows)))
    }

    /// Appends a row in one piece.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn add(&mut self, row: &BatchRow) -> Result<(), FileError> {
        let written = line(row).and_then(|line| self.file.write_all(line.as_bytes()));
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
        BatchRow { index, frame: format!("f{index}"), fit: Err(why.into()) }
    }

    #[test]
    fn rows_come_back_by_data_settings_and_program() {
        let folder = tempfile::tempdir().unwrap();
        let of = FitsOf::new("abc", FitConfig::default(), Precision::F32);
        let (mut file, known) = FitsFile::open(folder.path(), &of).unwrap();
        assert!(known.is_empty());
        file.add(&row(3, "first")).unwrap();
        file.add(&row(1, "dark")).unwrap();
        file.add(&row(3, "then")).unwrap();
        drop(file);
        // Killed in the middle of a line.
        let path = folder.path().join(of.file_name());
        OpenOptions::new().append(true).open(&path).unwrap().write_all(b"{\"index\": 4, \"fr").unwrap();
        let (mut file, known) = FitsFile::open(folder.path(), &of).unwrap();
        assert_eq!(known.values().cloned().collect::<Vec<_>>(), [row(1, "dark"), row(3, "then")]);
        file.add(&row(4, "again")).unwrap();
        drop(file);

        let other = FitsOf { config: FitConfig { w_em: 2.0, ..FitConfig::default() }, ..of.clone() };
        assert!(FitsFile::open(folder.path(), &other).unwrap().1.is_empty(), "other settings");
        let later = FitsOf { program: "9".into(), ..of.clone() };
        assert_ne!(later.file_name(), of.file_name());
        std::fs::write(folder.path().join("fits-broken.jsonl"), "no head\n").unwrap();
        let (found, wrong) = kept_fits(&[folder.path().into(), folder.path().join("none")], "abc");
        let counts: Vec<usize> = found.iter().map(|kept| kept.rows.len()).collect();
        assert!(counts == [3, 0] || counts == [0, 3], "{counts:?}");
        assert!(wrong.len() == 1 && wrong[0].contains("line 1"), "{wrong:?}");
        assert_eq!(kept_fits(&[folder.path().into()], "another").0, []);
    }
}
