//! All that was said, not only what stands: every record of journals and tables, in the order of the acts.

use super::stamp::Stamp;
use super::store::journals_in;
use super::table::{TableError, first_sign, read_bytes, table_of};
use super::tail::Tail;
use super::{LabelError, LabelPlace, Record, format};
use std::fs::File;
use std::path::Path;

/// Reads labels from a journal, or from a table of either kind; which of them is told by the first sign, `{` for a
/// journal. An empty file has no records. Damaged lines of a journal, and columns that are passed over, are logged.
///
/// # Errors
/// Where it can be read as neither.
pub fn read_labels(path: &Path) -> Result<Vec<Record>, TableError> {
    let bytes = read_bytes(path)?;
    if first_sign(&bytes) == Some(b'{') {
        return Ok(read_acts(path)?);
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
    let file = File::open(path).map_err(|reason| LabelError::Read { reason, path: path.to_owned() })?;
    let (mut tail, mut records) = (Tail::new(path.to_owned()), Vec::new());
    tail.look_in(&file, |_, record| records.push(*record))?;
    tail.warnings().for_each(|warning| tracing::warn!("{warning}"));
    Ok(records)
}

/// Every record of all journals of a place. In a file the order of lines holds, between files the time. A journal that
/// cannot be read is logged, as by [`LabelStore`](super::LabelStore): it must not hide the others.
///
/// # Errors
/// Where the folder is there and cannot be listed.
pub fn place_acts(place: &LabelPlace) -> Result<Vec<Record>, LabelError> {
    let mut acts: Vec<(Stamp, Record)> = Vec::new();
    let mut file = 0;
    for (folder, path) in place.folders().enumerate() {
        let journals = match journals_in(path) {
            Err(reason) if folder == 0 => return Err(LabelError::Read { reason, path: path.to_owned() }),
            journals => journals.unwrap_or_default(),
        };
        for journal in journals {
            let records = read_acts(&journal).unwrap_or_else(|error| {
                tracing::warn!("{error}");
                Vec::new()
            });
            acts.extend(stamped(records, folder, file));
            file += 1;
        }
    }
    acts.sort_by_key(|(stamp, _)| (stamp.time_ms, std::cmp::Reverse((stamp.folder, stamp.file))));
    Ok(acts.into_iter().map(|(_, record)| record).collect())
}

/// The records of one file, none earlier than those before it: a clock that was set back does not reorder them.
fn stamped(records: Vec<Record>, folder: usize, file: usize) -> impl Iterator<Item = (Stamp, Record)> {
    records.into_iter().scan(i64::MIN, move |time_ms, record| {
        *time_ms = (*time_ms).max(format::time_ms(&record.time));
        Some((Stamp { time_ms: *time_ms, folder, file }, record))
    })
}
