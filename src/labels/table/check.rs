//! What a row must say, whatever form it came in.

use crate::labels::{CellRegion, Record, Tag};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// What is wrong with a record: the column as a CSV names it, and in words what is there and what was expected.
pub(super) type Wrong = (String, String);

/// Checks what types alone do not.
pub(super) fn check(record: &Record) -> Result<(), Wrong> {
    if record.frame.path.is_empty() {
        return Err(("frame".into(), "is empty; expected a frame's name such as `d1s1/000/00383`".into()));
    }
    time(&record.time).map_err(|why| ("time".into(), why))?;
    record.label.region.as_ref().map_or(Ok(()), region).map_err(|why| ("region".into(), why))?;
    for (&tag, &score) in &record.judged.machine {
        let wrong = |why: String| (super::machine_column(tag), why);
        if !Tag::MODES.contains(&tag) {
            return Err(wrong(format!("is {score}; expected scores of F1, F2, F3 and F4 only")));
        }
        // NaN is in no range.
        if !(0.0..=1.0).contains(&score) {
            return Err(wrong(format!("is {score}; expected a score from 0 to 1")));
        }
    }
    Ok(())
}

fn time(text: &str) -> Result<(), String> {
    if text.is_empty() || OffsetDateTime::parse(text, &Rfc3339).is_ok() {
        return Ok(());
    }
    Err(format!("`{}`; expected a time such as 2025-03-01T12:30:00.000Z", super::shortened(text)))
}

/// A region is what its own words are read as.
fn region(region: &CellRegion) -> Result<(), String> {
    let (first, last) = (region.lo.len(), region.hi.len());
    if first != last {
        return Err(format!("has {first} first and {last} last bins; expected one of each for each axis"));
    }
    region.to_string().parse::<CellRegion>().map(|_| ()).map_err(|why| why.escape_debug().to_string())
}
