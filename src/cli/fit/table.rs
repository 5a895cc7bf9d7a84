//! The table for people: the first rows, and the means of all.

use crate::escape::one_line;
use crate::study::{BatchRow, Means, columns};

/// Rows that are shown; the rest is in the means and in summary.csv.
const SHOWN: usize = 20;
/// What stands where nothing is known.
const UNKNOWN: &str = "-";

/// Collects what is shown.
pub(super) struct Table {
    arrays: Vec<String>,
    rows: Vec<BatchRow>,
}

impl Table {
    pub(super) fn new(arrays: Vec<String>) -> Self {
        Self { arrays, rows: Vec::new() }
    }

    pub(super) fn add(&mut self, row: BatchRow) {
        if self.rows.len() < SHOWN {
            self.rows.push(row);
        }
    }

    /// Head, rows, how many more there are, means.
    pub(super) fn text(&self, means: &Means) -> String {
        let (views, places) = (self.arrays.len(), self.places());
        let mut lines = vec![self.head()];
        lines.extend(self.rows.iter().map(|row| {
            let fit = row.fit.as_ref().ok();
            let converged = fit.map(|fit| if fit.report.converged { "yes" } else { "no" });
            let first = [
                fit.map(|fit| fit.report.iteration.to_string()),
                converged.map(Into::into),
                fit.map(|fit| fit.people.to_string()),
                fit.and_then(|fit| fit.annotated).map(|n| n.to_string()),
            ];
            line(&row.frame, first, &row.values(views), &places, row.reason())
        }));
        let share = means.converged_share().map(|share| format!("{:.0} %", 100.0 * share));
        let first = [means.iterations().map(|n| format!("{n:.0}")), share, None, None];
        let mean = line("mean", first, &means.values(), &places, told(means));
        lines.push(mean);
        let more = means.frames - self.rows.len();
        aligned(&lines, (more > 0).then(|| format!("... and {more} more frames")))
    }

    /// The columns of numbers that people read, with their digits.
    fn shown(&self) -> Vec<(String, usize)> {
        let first = [("loss", 4), ("em", 4)].map(|(name, digits)| (name.to_owned(), digits));
        let ious = self.arrays.iter().map(|array| (format!("iou_{array}"), 3));
        let last = [("majpe_mm", 1), ("pa_majpe_mm", 1), ("init_ms", 0), ("fit_ms", 0)];
        first.into_iter().chain(ious).chain(last.map(|(name, digits)| (name.to_owned(), digits))).collect()
    }

    fn head(&self) -> Vec<String> {
        let first = ["frame", "iterations", "converged", "people", "annotated"].map(String::from);
        let shown = self.shown().into_iter().map(|(name, _)| name);
        first.into_iter().chain(shown).chain(["reason".to_owned()]).collect()
    }

    /// Where these columns are among the values of a row.
    fn places(&self) -> Vec<(usize, usize)> {
        let columns = columns(&self.arrays);
        let before = columns.iter().position(|column| column == "loss").unwrap_or(0);
        let place = |name: &str| columns.iter().position(|column| column == name).map(|at| at - before);
        self.shown().iter().filter_map(|(name, digits)| Some((place(name)?, *digits))).collect()
    }
}

/// What the means are over.
fn told(means: &Means) -> String {
    let fitted = format!("{} of {} frames fitted", means.fitted(), means.frames);
    match means.count_mismatched {
        0 => fitted,
        left_out => format!(
            "{fitted}; errors over {}, {left_out} left out: another number of people is annotated",
            means.errors_over()
        ),
    }
}

/// One line's cells. `first` are iterations, convergence and people, fitted and annotated; `values` are those of the
/// columns of a batch, of which it has `shown`: where, and with how many digits.
fn line(
    frame: &str,
    first: [Option<String>; 4],
    values: &[Option<f64>],
    shown: &[(usize, usize)],
    reason: String,
) -> Vec<String> {
    let text = |x: Option<String>| x.unwrap_or_else(|| UNKNOWN.into());
    let number = |&(place, digits): &(usize, usize)| {
        text(values.get(place).copied().flatten().map(|value| format!("{value:.digits$}")))
    };
    let mut cells = vec![frame.to_owned()];
    cells.extend(first.map(text));
    cells.extend(shown.iter().map(number));
    cells.push(reason);
    cells
}

/// Columns two spaces apart; the first and the last to the left, numbers to the right. `before_last` is a line by itself.
fn aligned(lines: &[Vec<String>], before_last: Option<String>) -> String {
    // Names and reasons come from data; a row is a line.
    let one_line = |line: &Vec<String>| line.iter().map(|cell| one_line(cell).into_owned()).collect();
    let lines: Vec<Vec<String>> = lines.iter().map(one_line).collect();
    let count = lines.first().map_or(0, Vec::len);
    let width = |k: usize| lines.iter().filter_map(|line| line.get(k)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..count).map(|k| width(k).unwrap_or(0)).collect();
    let mut texts: Vec<String> = lines
        .iter()
        .map(|line| {
            let cells = line.iter().zip(&widths).enumerate().map(|(k, (cell, &width))| match k {
                0 => format!("{cell:<width$}"),
                _ if k + 1 == count => cell.clone(),
                _ => format!("{cell:>width$}"),
            });
            cells.collect::<Vec<_>>().join("  ")
        })
        .collect();
    if let Some(text) = before_last {
        texts.insert(texts.len().saturating_sub(1), text);
    }
    texts.join("\n") + "\n"
}
