//! The shards of one whole, found among folders.

use super::{Shard, ShardError};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// In words, what differs: its name, here, there.
pub(in crate::study) type Difference = (String, String, String);

/// What a folder says of the part that it holds.
pub(in crate::study) trait Part: Sized {
    /// What can go wrong with it.
    type Error: From<ShardError>;
    /// The file that says it.
    const FILE: &'static str;

    /// Reads it.
    ///
    /// # Errors
    /// Where it cannot be read or is not one.
    fn read(folder: &Path) -> Result<Self, Self::Error>;

    /// Whether all rows of the part are there.
    fn is_finished(folder: &Path) -> bool;

    /// Which part it is; `None` for the whole.
    fn shard(&self) -> Option<Shard>;

    /// What the whole says.
    fn whole(&self) -> Self;

    /// The first thing in which another whole differs.
    fn difference(&self, other: &Self) -> Option<Difference>;
}

/// The whole, and its parts in order with their folders.
type Gathered<P> = (P, Vec<(PathBuf, P)>);

/// The whole, and its parts in order, from folders in any order. Folders without a finished shard are told where one is missing,
/// and else left alone.
///
/// # Errors
/// Where a folder is no shard of the same whole as the first, one comes twice, or one is missing.
pub(in crate::study) fn gather<P: Part>(folders: &[impl AsRef<Path>]) -> Result<Gathered<P>, P::Error> {
    let mut whole: Option<(P, usize)> = None;
    let mut parts: BTreeMap<usize, (PathBuf, P)> = BTreeMap::new();
    let mut unfinished = Vec::new();
    for folder in folders.iter().map(AsRef::as_ref) {
        let wrong = |message: String| ShardError::Merge { message, path: folder.to_owned() };
        if !folder.join(P::FILE).is_file() {
            unfinished.push(format!("{} holds no shard", folder.display()));
            continue;
        }
        let part = P::read(folder)?;
        let shard = part.shard().ok_or_else(|| wrong("is no shard: it was run without --shard".into()))?;
        match &whole {
            None => whole = Some((part.whole(), shard.count)),
            Some((first, count)) => {
                if let Some((what, here, there)) = part.whole().difference(first) {
                    return Err(wrong(format!("has another {what} than the first: {here}, not {there}")).into());
                }
                if shard.count != *count {
                    return Err(wrong(format!("is one of {} shards, the first one of {count}", shard.count)).into());
                }
            }
        }
        if !P::is_finished(folder) {
            unfinished.push(format!("{} is not finished", folder.display()));
        } else if parts.insert(shard.index, (folder.to_owned(), part)).is_some() {
            return Err(wrong(format!("shard {shard} comes twice")).into());
        }
    }
    let Some((whole, count)) = whole else { return Err(ShardError::Nothing { folders: unfinished }.into()) };
    let missing: Vec<Shard> =
        (1..=count).filter(|index| !parts.contains_key(index)).map(|index| Shard { index, count }).collect();
    if !missing.is_empty() {
        return Err(ShardError::Missing { missing, unfinished }.into());
    }
    for folder in unfinished {
        tracing::warn!("{folder}, and is left out: all {count} shards are in the others");
    }
    Ok((whole, parts.into_values().collect()))
}
