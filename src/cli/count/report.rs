//! What `count` prints and writes.

use crate::escape::{one_line, to_cell};
use crate::output::{Sink, replace_file};
use crate::people::{CLASSES, Confusion};
use crate::study::count::{FrameCount, People, confusion};
use anyhow::Context as _;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// A line a frame, then how often the count is the annotated one.
pub(super) fn table(rows: &[FrameCount]) -> String {
    let name = |row: &FrameCount| one_line(&row.frame).into_owned();
    let width = rows.iter().map(|row| name(row).chars().count()).max().unwrap_or(0).max("frame".len());
    let mut text = format!("{:<width$}  people      p  annotated  places (x y z, m)\n", "frame");
    for row in rows {
        let annotated = row.annotated.map_or_else(|| "-".into(), |n| n.to_string());
        let (people, p) = match &row.count {
            Ok(count) => (told(count), format!("{:.3}", count.probability())),
            Err(_) => ("-".into(), "-".into()),
        };
        let places: Vec<String> = row.places().iter().map(|[x, y, z]| format!("{x:.2} {y:.2} {z:.2}")).collect();
        let line = format!("{:<width$}  {people:>6}  {p:>5}  {annotated:>9}  {}", name(row), places.join("; "));
        let _ = writeln!(text, "{}", line.trim_end());
    }
    if rows.iter().any(|row| row.count.as_ref().is_ok_and(|count| count.uncertain)) {
        text +=
            "\n? counted from one frame alone, and uncertain: without frames around it furniture looks like people\n";
    }
    summary(&confusion(rows), &mut text);
    text
}

/// The number, with a question mark where it may well be wrong.
fn told(count: &People) -> String {
    shown(count.people) + if count.uncertain { "?" } else { "" }
}

fn summary(confusion: &Confusion, text: &mut String) {
    let Some(overall) = confusion.overall() else { return };
    let _ = writeln!(text, "\nannotated   frames   right");
    for people in (0..CLASSES).filter(|&people| confusion.of(people) > 0) {
        let right = confusion.accuracy(people).unwrap_or(0.0);
        let _ = writeln!(text, "{:>9}  {:>7}  {:>5.1} %", shown(people), confusion.of(people), 100.0 * right);
    }
    let _ = writeln!(
        text,
        "{:>9}  {:>7}  {:>5.1} %",
        "all",
        (0..CLASSES).map(|n| confusion.of(n)).sum::<usize>(),
        100.0 * overall
    );
    if let Some(weighted) = confusion.weighted() {
        let _ = writeln!(text, "weighted 91/8/1 % over one, two and three people: {:.2} %", 100.0 * weighted);
    }
}

/// The class of four and more is shown as that.
fn shown(people: usize) -> String {
    if people + 1 == CLASSES { format!("{people}+") } else { people.to_string() }
}

#[derive(Serialize)]
struct Row {
    frame: String,
    people: Option<usize>,
    probability: Option<f64>,
    probabilities: Option<[f64; CLASSES]>,
    /// Counted from this frame alone, and not clear.
    uncertain: Option<bool>,
    annotated: Option<usize>,
    persons: Vec<Person>,
    error: Option<String>,
}

#[derive(Serialize)]
struct Person {
    identity: usize,
    place_m: [f64; 3],
}

#[derive(Serialize)]
struct Document {
    data_set: String,
    frames: Vec<Row>,
    /// `confusion[annotated][people]`, frames; null where nothing is annotated.
    confusion: Option<[[usize; CLASSES]; CLASSES]>,
    weighted_accuracy: Option<f64>,
}

/// One JSON document.
pub(super) fn json(data_set: &str, rows: &[FrameCount]) -> anyhow::Result<String> {
    let confusion = confusion(rows);
    let document = Document {
        data_set: data_set.to_owned(),
        frames: rows.iter().map(of).collect(),
        confusion: confusion.overall().map(|_| confusion.frames),
        weighted_accuracy: confusion.weighted(),
    };
    Ok(serde_json::to_string_pretty(&document)? + "\n")
}

fn of(row: &FrameCount) -> Row {
    let count = row.count.as_ref().ok();
    Row {
        frame: row.frame.clone(),
        people: count.map(|count| count.people),
        probability: count.map(People::probability),
        probabilities: count.map(|count| count.probabilities),
        uncertain: count.map(|count| count.uncertain),
        annotated: row.annotated,
        persons: row
            .identities
            .iter()
            .zip(row.places())
            .map(|(&identity, &place_m)| Person { identity, place_m })
            .collect(),
        error: row.count.as_ref().err().cloned(),
    }
}

/// A row a frame.
///
/// # Errors
/// Where the file cannot be written.
pub(super) fn write_csv(file: &Path, rows: &[FrameCount]) -> anyhow::Result<()> {
    let written = replace_file(file, |out| table_csv(out, rows).map_err(std::io::Error::other));
    written.with_context(|| format!("{}: cannot be written", file.display()))
}

fn table_csv(out: &mut dyn Sink, rows: &[FrameCount]) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record([
        "frame",
        "people",
        "probability",
        "p0",
        "p1",
        "p2",
        "p3",
        "p4",
        "annotated",
        "persons",
        "uncertain",
    ])?;
    for row in rows.iter().map(of) {
        let number = |n: Option<usize>| n.map_or_else(String::new, |n| n.to_string());
        let mut record = vec![
            to_cell(&row.frame).into_owned(),
            number(row.people),
            row.probability.map_or_else(String::new, |p| p.to_string()),
        ];
        let each = |k: usize| row.probabilities.map_or_else(String::new, |p| p[k].to_string());
        record.extend((0..CLASSES).map(each));
        record.push(number(row.annotated));
        let person = |p: &Person| format!("{}:{:.3}:{:.3}:{:.3}", p.identity, p.place_m[0], p.place_m[1], p.place_m[2]);
        record.push(row.persons.iter().map(person).collect::<Vec<String>>().join(" "));
        record.push(row.uncertain.map_or_else(String::new, |uncertain| uncertain.to_string()));
        csv.write_record(record)?;
    }
    Ok(csv.flush()?)
}
