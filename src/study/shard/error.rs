//! What can go wrong with shards as such.

use super::super::FileError;
use super::Shard;
use crate::output::OutputError;
use std::path::PathBuf;

/// Shards that are named one by one where many are missing.
const NAMED: usize = 12;

/// Why a shard cannot begin or end, or shards do not make a whole.
#[derive(Debug, thiserror::Error)]
pub enum ShardError {
    /// A file of its own.
    #[error(transparent)]
    File(#[from] FileError),
    /// The folder must not be written, or another process writes it.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The folder holds another shard.
    #[error("{path}: holds a shard with another {what}: {there}, not {here}; give another --out, or remove the folder", path = path.display())]
    OtherShard {
        /// What differs.
        what: String,
        /// What the folder says.
        there: String,
        /// What was asked for.
        here: String,
        /// The folder.
        path: PathBuf,
    },
    /// A shard that does not belong to the others.
    #[error("{path}: {message}", path = path.display())]
    Merge {
        /// What does not fit.
        message: String,
        /// The folder.
        path: PathBuf,
    },
    /// Not all shards of the whole are there.
    #[error("{}", told(missing, unfinished))]
    Missing {
        /// Those that are not, ascending.
        missing: Vec<Shard>,
        /// Folders that were given and hold no finished shard, and what they hold.
        unfinished: Vec<String>,
    },
    /// None of the folders holds a shard.
    #[error("nothing to merge: {}; expected folders that a command with --shard wrote", folders.join(", "))]
    Nothing {
        /// The folders, and what they hold.
        folders: Vec<String>,
    },
}

/// Which are missing, what was found instead, and what to do.
fn told(missing: &[Shard], unfinished: &[String]) -> String {
    let names = |word: &str| {
        let more = missing.len().saturating_sub(NAMED);
        let named: Vec<String> = missing.iter().take(NAMED).map(|shard| format!("{word}{shard}")).collect();
        named.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
    };
    let found = if unfinished.is_empty() { String::new() } else { format!(" ({})", unfinished.join(", ")) };
    match missing {
        [shard] => format!(
            "shard {shard} is missing{found}; do it again by itself, by the same command with --shard {shard}, then merge again"
        ),
        _ => format!(
            "shards {} are missing{found}; do each again by itself, by the same command with {}, then merge again",
            names(""),
            names("--shard ")
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named_with_what_to_do() {
        let shard = |index| Shard { index, count: 40 };
        let unfinished = vec!["runs/3 is not finished".to_owned()];
        let one = ShardError::Missing { missing: vec![shard(3)], unfinished }.to_string();
        assert!(
            one.starts_with("shard 3/40 is missing (runs/3 is not finished);") && one.contains("--shard 3/40,"),
            "{one}"
        );
        let many = ShardError::Missing { missing: (1..=40).map(shard).collect(), unfinished: Vec::new() }.to_string();
        assert!(many.starts_with("shards 1/40, 2/40, ") && many.contains("--shard 12/40 and 28 more"), "{many}");
    }
}
