//! All that was said, not only what stands: every record of journals and tables, in the order of the acts.

use super::file::open_to_read;
use super::stamp::{Stamp, in_lines_order};
use super::table::{TableError, first_sign, read_bytes, table_of};
use super::tail::Tail;
use super::{LabelError, LabelPlace, LabelStore, Record};
use std::path::Path;

/// Reads labels from a journal, or from a table of either kind; which of them is told by the first sign, `{` for a
/// journal. An empty file has no records. Damaged lines of a journal, and columns that are passed over, are logged.
///
/// # Errors
/// Where it can be read as neither.
pub fn read_labels(path: &Path) -> Result<Vec<Record>, TableError> {
    let bytes = read_bytes(path)?;
    if first_sign(&bytes) == Some(b'{') {
        // From memory: what is read once, as a pipe, is not there a second time.
        let (mut tail, mut records) = (Tail::new(path.to_owned()), Vec::new());
        tail.read(&bytes, |_, record| records.push(*record))?;
        tail.warnings().for_each(|warning| tracing::warn!("{warning}"));
        return Ok(records);
    }
    let table = table_of(&bytes, path)?;
    for note in &table.notes {
        tracing::warn!("{}: {note}", path.display());
    }
    Ok(table.rows.into_iter().map(|row| row.record).collect())
}

/// Every record of one journal, in the order of the file.
///
/// # Errors
/// Where the file cannot be read, is of a newer version or is no journal.
pub fn read_acts(path: &Path) -> Result<Vec<Record>, LabelError> {
    let file = open_to_read(path)?;
    let (mut tail, mut records) = (Tail::new(path.to_owned()), Vec::new());
    tail.look_in(&file, |_, record| records.push(*record))?;
    tail.warnings().for_each(|warning| tracing::warn!("{warning}"));
    Ok(records)
}

/// Every record of all journals of a place, and what is to be told of them ([`LabelStore::warnings`]). The last record of a
/// frame and annotator is the one that a [`LabelStore`] shows: those of files that do not speak for their annotator come
/// first, then the order decides, in a file that of the lines.
///
/// # Errors
/// Where the folder is there and cannot be listed.
pub fn place_acts(place: &LabelPlace) -> Result<(Vec<Record>, Vec<String>), LabelError> {
    let mut acts: Vec<(Stamp, Record)> = Vec::new();
    let store = LabelStore::read_with(place, &mut acts)?;
    in_lines_order(&mut acts);
    acts.sort_by_key(|(stamp, _)| stamp.rank());
    Ok((acts.into_iter().map(|(_, record)| record).collect(), store.warnings().to_vec()))
}
