//! Which rows of a table an import writes: it adds what is new, and never takes away what somebody said later.

use super::format::{is_ahead, now_ms, time_ms};
use super::{LabelRow, Record};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// What an import would do.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImportPlan<'r> {
    /// Rows to write: of frames without a record, newer than the record, or all that differ.
    pub write: Vec<&'r LabelRow>,
    /// Rows that say what the label says already.
    pub same: usize,
    /// Rows that differ and are not newer than the record, which may have taken a label back: it is kept.
    pub kept: usize,
}

/// Compares `rows` with the newest record that `current` finds for a row's annotator and frame. `replace` writes also
/// rows that are not newer. A row without a time is not newer than anything; one that says nothing of a frame of which
/// nothing is known is no news.
pub fn plan_import<'r, 'c>(
    rows: &'r [LabelRow],
    replace: bool,
    current: impl Fn(&Record) -> Option<&'c Record>,
) -> ImportPlan<'r> {
    let mut plan = ImportPlan::default();
    for row in rows {
        let known = current(&row.record);
        let said = known.map(|known| known.label.clone()).unwrap_or_default();
        if said == row.record.label {
            plan.same += 1;
        } else if replace || known.is_none_or(|known| newer(&row.record, known)) {
            plan.write.push(row);
        } else {
            plan.kept += 1;
        }
    }
    plan
}

fn newer(row: &Record, known: &Record) -> bool {
    let time = |record: &Record| OffsetDateTime::parse(&record.time, &Rfc3339).ok();
    time(row).zip(time(known)).is_some_and(|(row, known)| row > known)
}

/// True where a record's time has not come yet, by more than clocks differ.
pub fn is_dated_ahead(record: &Record) -> bool {
    is_ahead(time_ms(&record.time), now_ms())
}
