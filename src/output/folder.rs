//! A tree of results in one folder.

use super::error::OutputError;
use super::inputs::Inputs;
use super::names::folded;
use super::resolve::{Identity, folder_of, resolved};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Gives every result its place, and sees to it that none leaves the folder or takes another's.
#[derive(Debug)]
pub struct FolderGuard {
    root: PathBuf,
    /// Folders that exist and were found to lie inside.
    inside: HashSet<PathBuf>,
    /// Places by their name where case does not count.
    given: HashMap<String, PathBuf>,
}

impl FolderGuard {
    /// Of a folder that may not be there yet.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_owned(), inside: HashSet::new(), given: HashMap::new() }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// The place of a result, its folder made. `relative` is made of names alone.
    ///
    /// # Errors
    /// Where a link leads out of the folder, the place is an input's or has been given to another result on a file system for
    /// which case does not count, or the folder cannot be made.
    pub fn place(&mut self, relative: &Path, inputs: &Inputs<'_>) -> Result<PathBuf, OutputError> {
        let place = self.root.join(relative);
        let home = folder_of(&place).to_owned();
        if !self.inside.contains(&home) {
            std::fs::create_dir_all(&home).map_err(OutputError::writing(&home))?;
            let target = resolved(&home).map_err(OutputError::writing(&home))?;
            if !target.starts_with(resolved(&self.root).map_err(OutputError::writing(&self.root))?) {
                return Err(OutputError::Elsewhere { target, path: home });
            }
            inputs.check_shelf(&home)?;
            self.inside.insert(home);
        }
        inputs.check_replaced(&place)?;
        let other = self.given.entry(folded(&relative.to_string_lossy())).or_insert_with(|| place.clone());
        let same = || Identity::of(other).is_some_and(|other| Identity::of(&place) == Some(other));
        if *other != place && same() {
            return Err(OutputError::Taken { other: other.clone(), path: place });
        }
        Ok(place)
    }
}
