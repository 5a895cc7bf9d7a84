//! Records as CSV.

use super::{COLUMNS, machine_column};
use crate::labels::{Record, Tag};
use std::io::Write;

/// Header and rows.
pub(super) fn write(out: &mut dyn Write, records: &[&Record]) -> std::io::Result<()> {
    // Lines end as RFC 4180 asks.
    let mut writer = csv::WriterBuilder::new().terminator(csv::Terminator::CRLF).from_writer(out);
    writer.write_record(COLUMNS).map_err(std::io::Error::other)?;
    for record in records {
        writer.write_record(COLUMNS.iter().map(|column| cell(record, column))).map_err(std::io::Error::other)?;
    }
    writer.flush()
}

fn cell(record: &Record, column: &str) -> String {
    let (label, judged) = (&record.label, &record.judged);
    let yes = |yes: bool| if yes { "1" } else { "0" }.to_owned();
    match column {
        "frame" => record.frame.path.clone(),
        "index" => record.frame.index.to_string(),
        "annotator" => record.annotator.clone(),
        "time" => record.time.clone(),
        "verdict" => optional(label.verdict),
        "person" => optional(label.person),
        "region" => optional(label.region.as_ref()),
        "note" => label.note.clone(),
        "judged_fit" => judged.fit.clone().unwrap_or_default(),
        "judged_config" => judged.config.clone().unwrap_or_default(),
        "judged_iteration" => optional(judged.iteration),
        "machine_shown" => yes(judged.machine_shown),
        "act" => record.act.clone(),
        "dataset" => record.dataset.clone(),
        "program" => record.program.clone(),
        _ => column.parse().map_or_else(|_| machine(record, column), |tag| yes(label.tags.contains(tag))),
    }
}

fn machine(record: &Record, column: &str) -> String {
    let mode = Tag::MODES.into_iter().find(|&mode| machine_column(mode) == column);
    optional(mode.and_then(|mode| record.judged.machine.get(&mode)))
}

/// Empty where unknown.
fn optional(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}
