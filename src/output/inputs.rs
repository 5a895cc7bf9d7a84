//! What a command reads, and hence must not write.
//!
//! Two rules. Results do not go into the folders of the data set, where a later reading would take them for data: a flag permits
//! it, because a person may want just that. And no file that is read is ever replaced, whatever its name here: that nothing
//! permits. The first rule asks for a few folders. For the second every file of the data set would have to be looked at, so it
//! is done only once a place is taken already, and then once for all places.

use super::error::OutputError;
use super::resolve::{Identity, folder_of, resolved};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// The flag that permits results in the data set's own folder.
pub const INTO_DATA_FLAG: &str = "--into-data";

static INTO_DATA: AtomicBool = AtomicBool::new(false);

/// What [`INTO_DATA_FLAG`] says, for the whole program: results may lie in the data set's own folder. Inputs stay untouched.
pub fn allow_into_data(allowed: bool) {
    INTO_DATA.store(allowed, Ordering::Relaxed);
}

/// What [`allow_into_data`] said.
pub fn into_data_allowed() -> bool {
    INTO_DATA.load(Ordering::Relaxed)
}

/// Calls its argument with every file of a data set.
type Visit<'a> = Box<dyn Fn(&mut dyn FnMut(&Path)) + Send + Sync + 'a>;

/// The folders and files that are read.
pub struct Inputs<'a> {
    /// Resolved folders of the data set.
    folders: Vec<PathBuf>,
    /// Files and folders named by flags.
    named: Vec<PathBuf>,
    data: Visit<'a>,
    known: OnceLock<HashSet<Identity>>,
}

impl std::fmt::Debug for Inputs<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Inputs").field("folders", &self.folders).field("named", &self.named).finish_non_exhaustive()
    }
}

impl Default for Inputs<'_> {
    fn default() -> Self {
        Self::new([], |_| {})
    }
}

impl<'a> Inputs<'a> {
    /// A data set: its folders, and a function that tells all its files; those that are missing do no harm.
    pub fn new(
        folders: impl IntoIterator<Item = PathBuf>,
        files: impl Fn(&mut dyn FnMut(&Path)) + Send + Sync + 'a,
    ) -> Self {
        let mut inputs = Self { folders: Vec::new(), named: Vec::new(), data: Box::new(files), known: OnceLock::new() };
        folders.into_iter().for_each(|folder| inputs.protect(&folder));
        inputs
    }

    /// Also this folder of the data set; what is not there is no folder of it.
    #[must_use]
    pub fn with_folder(mut self, folder: &Path) -> Self {
        if folder.is_dir() {
            self.protect(folder);
        }
        self
    }

    /// Also these files or folders, as flags named them.
    #[must_use]
    pub fn with_named<'p>(mut self, paths: impl IntoIterator<Item = Option<&'p Path>>) -> Self {
        self.named.extend(paths.into_iter().flatten().map(Path::to_owned));
        self
    }

    fn protect(&mut self, folder: &Path) {
        let folder = resolved(folder).unwrap_or_else(|_| folder.to_owned());
        if !self.folders.iter().any(|known| folder.starts_with(known)) {
            self.folders.push(folder);
        }
    }

    /// Refuses a folder for results that lies in the data set, or leads there.
    ///
    /// # Errors
    /// As told, with the flag that permits it.
    pub fn check_folder(&self, folder: &Path) -> Result<(), OutputError> {
        let real = resolved(folder).map_err(OutputError::writing(folder))?;
        let inside = self.folders.iter().find(|data| real.starts_with(data));
        match inside.filter(|_| !into_data_allowed()) {
            Some(data) => Err(OutputError::IntoData { data: data.clone(), path: folder.to_owned() }),
            None => Ok(()),
        }
    }

    /// Refuses a folder that results of many names go into where it is, or directly holds, something that a flag named.
    ///
    /// # Errors
    /// As told.
    pub(super) fn check_shelf(&self, folder: &Path) -> Result<(), OutputError> {
        let Ok(real) = folder.canonicalize() else { return Ok(()) };
        let held = self.named.iter().find(|input| {
            let Ok(input) = input.canonicalize() else { return false };
            input == real || input.is_file() && input.parent() == Some(&real)
        });
        let holds = |input: &PathBuf| OutputError::HoldsInput { input: input.clone(), path: folder.to_owned() };
        held.map_or(Ok(()), |input| Err(holds(input)))
    }

    /// Refuses a file for results that is an input, lies in the data set, or cannot be one.
    ///
    /// # Errors
    /// As told; also where its folder is not there.
    pub fn check_file(&self, file: &Path) -> Result<(), OutputError> {
        let (folder, wrong) = (folder_of(file), |why: String| std::io::Error::other(why));
        if !folder.is_dir() {
            return Err(OutputError::writing(file)(wrong(format!("no folder {}", folder.display()))));
        }
        self.check_folder(folder).map_err(|error| match error {
            OutputError::IntoData { data, .. } => OutputError::IntoData { data, path: file.to_owned() },
            other => other,
        })?;
        self.check_replaced(file)
    }

    /// Refuses a file that is an input, under whatever name, or a folder; most are not there yet, which asks for nothing more.
    ///
    /// # Errors
    /// As told.
    pub fn check_replaced(&self, file: &Path) -> Result<(), OutputError> {
        if std::fs::symlink_metadata(file).is_err() {
            return Ok(());
        }
        if file.is_dir() {
            return Err(OutputError::writing(file)(std::io::Error::other("it is a folder")));
        }
        let taken = Identity::of(file).is_some_and(|identity| self.known().contains(&identity));
        if taken { Err(OutputError::Input { path: file.to_owned() }) } else { Ok(()) }
    }

    fn known(&self) -> &HashSet<Identity> {
        self.known.get_or_init(|| {
            let mut known: HashSet<Identity> = self.named.iter().filter_map(|path| Identity::of(path)).collect();
            (self.data)(&mut |file: &Path| known.extend(Identity::of(file)));
            known
        })
    }
}
