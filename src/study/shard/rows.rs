//! `rows.jsonl`: a line that names the shard, then a line a frame. Numbers read back as they were, bit by bit.

use super::super::FileError;
use super::folder::ROWS_FILE;
use super::gather::gather;
use super::{FrameCommand, ShardError, ShardSpec};
use crate::input::read_bytes;
use crate::output::replace_file;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Bytes of one shard's rows that are read: some 5000 a frame of `evidence`, fewer of the others.
const MOST_BYTES: u64 = 4 << 30;

/// What a command computes of one frame, without a look at the other frames' rows.
pub trait ShardRow: Serialize + DeserializeOwned {
    /// Whose rows they are.
    const COMMAND: FrameCommand;

    /// The frame's index in the data set.
    fn index(&self) -> usize;

    /// Why there is nothing but this, where that is so.
    fn failure(&self) -> Option<&str>;
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    shard: String,
}

/// Replaces `file` by these rows.
///
/// # Errors
/// Where it cannot be written.
pub(super) fn write_rows(file: &Path, spec: &ShardSpec, rows: &[impl ShardRow]) -> Result<(), ShardError> {
    let written = replace_file(file, |out| {
        writeln!(out, "{}", serde_json::to_string(&Head { shard: spec.id.clone() })?)?;
        rows.iter().try_for_each(|row| writeln!(out, "{}", serde_json::to_string(row)?))
    });
    Ok(written.map_err(FileError::writing(file))?)
}

/// The rows of a finished shard.
fn read_rows<R: ShardRow>(folder: &Path, spec: &ShardSpec) -> Result<Vec<R>, ShardError> {
    let path = folder.join(ROWS_FILE);
    let bytes = read_bytes(&path, "the rows of a shard", MOST_BYTES).map_err(FileError::reading(&path))?;
    let wrong = |line: usize, why: String| FileError::Damaged {
        message: format!("line {line}: {why}; do the shard again"),
        path: path.clone(),
    };
    let mut lines = bytes.split(|&byte| byte == b'\n').filter(|line| !line.is_empty()).zip(1..);
    let head = lines.next().and_then(|(line, _)| serde_json::from_slice::<Head>(line).ok());
    match head {
        Some(head) if head.shard == spec.id => {}
        Some(head) => return Err(wrong(1, format!("names shard {}, expected {}", head.shard, spec.id)).into()),
        None => return Err(wrong(1, "does not name a shard".into()).into()),
    }
    let row = |(line, number)| serde_json::from_slice::<R>(line).map_err(|error| wrong(number, error.to_string()));
    Ok(lines.map(row).collect::<Result<_, _>>()?)
}

/// All rows of a command, put together of its shards.
#[derive(Debug)]
pub struct Whole<R> {
    /// What they are of.
    pub spec: ShardSpec,
    /// The shards' folders, in order.
    pub folders: Vec<PathBuf>,
    /// A row a frame of the whole's range, in order.
    pub rows: Vec<R>,
}

impl<R: ShardRow> Whole<R> {
    /// Reads the shards that lie in `folders`, in any order.
    ///
    /// # Errors
    /// Where they are not of one whole or of another command, one is missing or comes twice, or a file is damaged.
    pub fn read(folders: &[impl AsRef<Path>]) -> Result<Self, ShardError> {
        let (spec, parts) = gather::<ShardSpec>(folders)?;
        let mut rows = Vec::with_capacity(spec.data.frames);
        for (folder, part) in &parts {
            let wrong = |message: String| FileError::Damaged { message, path: folder.clone() };
            if part.command != R::COMMAND {
                return Err(
                    wrong(format!("is a shard of {}, not of {}", part.command.word(), R::COMMAND.word())).into()
                );
            }
            rows.extend(read_rows::<R>(folder, part)?);
        }
        let folders: Vec<PathBuf> = parts.into_iter().map(|(folder, _)| folder).collect();
        if !rows.iter().map(R::index).eq(spec.data.first..spec.data.end) {
            let message =
                format!("the rows of all shards are not those of frames {}..{}", spec.data.first, spec.data.end);
            return Err(FileError::Damaged { message, path: folders.first().cloned().unwrap_or_default() }.into());
        }
        Ok(Self { spec, folders, rows })
    }
}
