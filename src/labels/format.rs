//! The journal's format, version 1: UTF-8 text, one JSON object a line, each line ended by a newline (`\n`).
//!
//! **Where.** One file an annotator, `<slug>.labels.jsonl`, in `mhp-labels/` inside the data set's folder, or in
//! `<file>.mhp-labels/` beside a bare file, or where neither can be written in
//! `<user data folder>/labels/<fingerprint of the data set>/`. The slug is the annotator's name where that is made of
//! `a-z 0-9 _ -` only; any other name becomes such a word, a dot and twelve hexadecimal digits of its SHA-256, so that two
//! names never share a file.
//!
//! **Header**, the first line of a file:
//!
//! ```json
//! {"format":"mhp-labels","version":1,"annotator":"Anna","dataset":"9f0c…","created":"2026-03-01T09:30:00.000Z","program":"0.1.0"}
//! ```
//!
//! **Record**, every other line: what one frame's label is after one act.
//!
//! ```json
//! {"dataset":"9f0c…","frame":{"path":"d1s1/000/00383","index":383},
//!  "label":{"tags":["F1","F3"],"note":"two people at the wall","person":0,
//!           "region":{"view":"hm_hori","lo":[10,30],"hi":[20,42]},"verdict":"annotation-error"},
//!  "annotator":"Anna","time":"2026-03-01T09:31:12.345Z","act":"tag F3","program":"0.1.0",
//!  "judged":{"fit":"…","config":"…","iteration":40,"machine":{"F1":0.82},"machine_shown":true}}
//! ```
//!
//! | field | meaning |
//! |---|---|
//! | `dataset` | fingerprint of the data set: 16 hexadecimal digits; it changes where a data set grows |
//! | `frame.path` | the frame's name in its data set, which identifies it |
//! | `frame.index` | its index, from 0, when it was labelled; a hint |
//! | `label.tags` | some of `F1 F2 F3 F4 clean unsure`; empty where nothing is said any more |
//! | `label.note` | free text; left out where empty |
//! | `label.person` | the person meant, from 0; left out where none |
//! | `label.region` | the cells meant: a view's array, first and last bin of each axis, both inside; left out where none |
//! | `label.verdict` | whose count is wrong: `annotation-error`, `detection-error`, `both-incorrect`, or `true-negative` (both are right, the mismatch passes); left out where none |
//! | `annotator` | who, as typed |
//! | `time` | when: RFC 3339, UTC, milliseconds |
//! | `after` | the order of the record that this one replaces, milliseconds since 1970; left out where `time` is later than that |
//! | `act` | the act in words, for people |
//! | `program` | version of the program that wrote the line |
//! | `judged` | the fit on screen: hash of its parameters and of its configuration, iteration, cells that it did not see (`erased`, regions as in `label.region`), the machine's own scores in 0..1 and whether they were shown; each left out where unknown |
//!
//! **Whose file speaks for whom.** `<slug of X>.labels.jsonl` speaks for X, in the data set's folder and in the user's.
//! Records by X in any other file (a copy, files that were joined, another annotator's file) are read, told as such, and
//! count only for frames of which X's own files have no record: nobody's label is changed by a file that is not theirs.
//!
//! **Reading.** A record's order is its `time`, or one millisecond after `after` where that is later; in a file it is never
//! less than that of an earlier record of the same frame and annotator. The label of a frame is that of its record of the
//! greatest order in the annotator's own files, and only where these have none, in the others; hence of the last line where
//! there is one file. A writer gives an act an `after` wherever a record of that frame in another file would not be
//! earlier than it, so that what was acknowledged is what is read, whatever the clocks said; `time` stays that of the
//! writer's clock. Times more than five minutes ahead of the reader's clock are told.
//! Fields that a reader does not know are left alone. A line that is no JSON object of either kind is skipped with a
//! warning; so are a last line without its newline, unless it is whole, and NUL bytes, which a crash leaves on some file
//! systems. A header may come again (files joined end to end are a journal). A file with a header of a newer version is
//! neither read nor written. What is no regular file (a pipe, a device) is not opened. New values of `tags` or `verdict`
//! make a new version.
//!
//! **Writing.** Lines are appended and never changed. A writer holds the exclusive lock of the file (`flock`, on Windows
//! `LockFileEx`) while it reads what others appended, applies its change to that, and appends all records of an act in one
//! write; where the last byte is no newline, it writes one first. An act counts when the bytes are on disk.

use super::{LabelError, Record};
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::Path;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;
use time::macros::format_description;

/// What the header calls the format.
const FORMAT: &str = "mhp-labels";
/// The version that is written, and the newest that is read.
pub(super) const VERSION: u64 = 1;
/// The version of the program that records carry.
pub(super) const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// The first line of a journal. Of a newer version no more is known than `format` and `version`.
#[derive(Debug, Serialize, Deserialize)]
struct Header {
    format: String,
    version: u64,
    #[serde(default)]
    annotator: String,
    #[serde(default)]
    dataset: String,
    #[serde(default)]
    created: String,
    #[serde(default)]
    program: String,
}

/// What a line is.
#[derive(Debug)]
pub(super) enum JournalLine {
    /// Nothing, as between a record that lost its newline and the next.
    Blank,
    /// A header of a version that is understood.
    Header,
    /// A record.
    Record(Box<Record>),
    /// Anything else.
    Damaged,
}

/// Reads one line, with or without its newline.
///
/// # Errors
/// For a header of a newer version.
pub(super) fn parse(line: &[u8], path: &Path) -> Result<JournalLine, LabelError> {
    let text = bare(line);
    if text.is_empty() {
        return Ok(if line.contains(&0) { JournalLine::Damaged } else { JournalLine::Blank });
    }
    if let Ok(record) = serde_json::from_slice(text) {
        return Ok(JournalLine::Record(Box::new(record)));
    }
    match serde_json::from_slice::<Header>(text) {
        Ok(header) if header.format == FORMAT && header.version > VERSION => {
            Err(LabelError::Newer { version: header.version, known: VERSION, path: path.to_owned() })
        }
        Ok(header) if header.format == FORMAT && header.version > 0 => Ok(JournalLine::Header),
        _ => Ok(JournalLine::Damaged),
    }
}

/// True for what is left of a header that a crash cut off.
pub(super) fn is_torn_header(line: &[u8]) -> bool {
    let begin = format!("{{\"format\":\"{FORMAT}\"");
    let text = bare(line);
    text.iter().zip(begin.as_bytes()).all(|(a, b)| a == b)
}

/// A line without spaces and NUL bytes at its ends.
fn bare(mut line: &[u8]) -> &[u8] {
    let empty = |byte: &u8| *byte == 0 || byte.is_ascii_whitespace();
    while let [first, rest @ ..] = line
        && empty(first)
    {
        line = rest;
    }
    while let [rest @ .., last] = line
        && empty(last)
    {
        line = rest;
    }
    line
}

/// Appends a header to `out`.
///
/// # Errors
/// Where it cannot be written as JSON.
pub(super) fn write_header(out: &mut Vec<u8>, annotator: &str, dataset: &str) -> std::io::Result<()> {
    let header = Header {
        format: FORMAT.into(),
        version: VERSION,
        annotator: annotator.into(),
        dataset: dataset.into(),
        created: time_text(now_ms()),
        program: PROGRAM.into(),
    };
    serde_json::to_writer(&mut *out, &header)?;
    out.write_all(b"\n")
}

/// Appends a record to `out`.
///
/// # Errors
/// Where it cannot be written as JSON.
pub(super) fn write_record(out: &mut Vec<u8>, record: &Record) -> std::io::Result<()> {
    serde_json::to_writer(&mut *out, record)?;
    out.write_all(b"\n")
}

/// Milliseconds since 1970.
pub(super) fn now_ms() -> i64 {
    (OffsetDateTime::now_utc().unix_timestamp_nanos() / 1_000_000) as i64
}

/// RFC 3339 in UTC with milliseconds; empty for years that have more than four digits.
pub(super) fn time_text(ms: i64) -> String {
    let format = format_description!("[year]-[month]-[day]T[hour]:[minute]:[second].[subsecond digits:3]Z");
    let time = OffsetDateTime::from_unix_timestamp_nanos(i128::from(ms) * 1_000_000);
    time.ok().and_then(|time| time.format(format).ok()).unwrap_or_default()
}

/// What a clock may be ahead of this one without a word, ms.
const AHEAD_MS: i64 = 5 * 60 * 1000;

/// True for a time that has not come yet, by more than clocks differ.
pub(super) fn is_ahead(time_ms: i64, now_ms: i64) -> bool {
    time_ms > now_ms.saturating_add(AHEAD_MS)
}

/// The order of a record among those of its frame and annotator, as the head of this file tells; ms since 1970.
pub(super) fn order_ms(record: &Record) -> i64 {
    time_ms(&record.time).max(record.after.map_or(i64::MIN, |after| after.saturating_add(1)))
}

/// Milliseconds since 1970 of an RFC 3339 time; what is none is before all that are.
pub(super) fn time_ms(text: &str) -> i64 {
    OffsetDateTime::parse(text, &Rfc3339).map_or(i64::MIN, |time| (time.unix_timestamp_nanos() / 1_000_000) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_read_back_what_they_write() {
        assert_eq!(time_text(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(time_text(1_772_357_472_345), "2026-03-01T09:31:12.345Z");
        assert_eq!(time_ms("2026-03-01T09:31:12.345Z"), 1_772_357_472_345);
        assert_eq!(time_ms("2026-03-01T11:31:12.345+02:00"), 1_772_357_472_345);
        assert_eq!(time_ms("yesterday"), i64::MIN);
    }

    #[test]
    fn every_cut_of_a_header_is_known_as_one() {
        let mut header = Vec::new();
        write_header(&mut header, "Anna", "9f").unwrap_or_default();
        for keep in 0..=header.len() {
            assert!(is_torn_header(&header[..keep]), "{keep} bytes");
        }
        for other in ["{\"a\":1}", "frame,tags", "[", "{\"format\":\"other\"}"] {
            assert!(!is_torn_header(other.as_bytes()), "{other}");
        }
    }
}
