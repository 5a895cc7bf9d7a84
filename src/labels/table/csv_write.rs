//! Records as CSV.

use super::{COLUMNS, machine_column};
use crate::escape::to_cell;
use crate::labels::{Judged, Record, Tag};
use std::borrow::Cow;
use std::io::Write;

/// Header and rows.
pub(super) fn write(out: &mut dyn Write, records: &[&Record]) -> std::io::Result<()> {
    // Lines end as RFC 4180 asks.
    let mut writer = csv::WriterBuilder::new().terminator(csv::Terminator::CRLF).from_writer(out);
    writer.write_record(COLUMNS).map_err(std::io::Error::other)?;
    for record in records {
        writer
            .write_record(COLUMNS.iter().map(|column| cell(record, column).into_owned()))
            .map_err(std::io::Error::other)?;
    }
    writer.flush()
}

/// A cell of the row; of text, as [`to_cell`] keeps it from being computed.
fn cell<'r>(record: &'r Record, column: &str) -> Cow<'r, str> {
    let (label, judged) = (&record.label, &record.judged);
    let yes = |yes: bool| Cow::Borrowed(if yes { "1" } else { "0" });
    match column {
        "frame" => to_cell(&record.frame.path),
        "index" => record.frame.index.to_string().into(),
        "annotator" => to_cell(&record.annotator),
        "time" => to_cell(&record.time),
        "verdict" => optional(label.verdict).into(),
        "person" => optional(label.person).into(),
        "region" => to_cell(&optional(label.region.as_ref())).into_owned().into(),
        "note" => to_cell(&label.note),
        "judged_fit" => to_cell(judged.fit.as_deref().unwrap_or_default()),
        "judged_config" => to_cell(judged.config.as_deref().unwrap_or_default()),
        "judged_iteration" => optional(judged.iteration).into(),
        "judged_erased" => to_cell(&erased(judged)).into_owned().into(),
        "machine_shown" => yes(judged.machine_shown),
        "act" => to_cell(&record.act),
        "dataset" => to_cell(&record.dataset),
        "program" => to_cell(&record.program),
        _ => column.parse().map_or_else(|_| machine(record, column).into(), |tag| yes(label.tags.contains(tag))),
    }
}

fn machine(record: &Record, column: &str) -> String {
    let mode = Tag::MODES.into_iter().find(|&mode| machine_column(mode) == column);
    optional(mode.and_then(|mode| record.judged.machine.get(&mode)))
}

/// The regions that the fit did not see, as JSON; empty where there is none.
fn erased(judged: &Judged) -> String {
    let known = (!judged.erased.is_empty()).then(|| serde_json::to_string(&judged.erased).ok()).flatten();
    known.unwrap_or_default()
}

/// Empty where unknown.
fn optional(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}
