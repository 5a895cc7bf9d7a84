//! The table for people: the first rows, and the means of all.

use crate::escape::one_line;
use crate::study::{BatchRow, Means};

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
        let views = self.arrays.len();
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
            line(&row.frame, first, &row.values(views), views, row.reason())
        }));
        let share = means.converged_share().map(|share| format!("{:.0} %", 100.0 * share));
        let first = [means.iterations().map(|n| format!("{n:.0}")), share, None, None];
        let mean = line("mean", first, &means.values(), views, told(means));
        lines.push(mean);
        let more = means.frames - self.rows.len();
        aligned(&lines, (more > 0).then(|| format!("... and {more} more frames")))
    }

    fn head(&self) -> Vec<String> {
        let ious = self.arrays.iter().map(|array| format!("iou_{array}"));
        let first = ["frame", "iterations", "converged", "people", "annotated", "loss", "em"].map(String::from);
        let last = ["majpe_mm", "pa_majpe_mm", "init_ms", "fit_ms", "reason"].map(String::from);
        first.into_iter().chain(ious).chain(last).collect()
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

/// One line's cells. `first` are iterations, convergence and people, fitted and annotated; `values` are loss, six terms, the IoUs, two errors and two times.
fn line(frame: &str, first: [Option<String>; 4], values: &[Option<f64>], views: usize, reason: String) -> Vec<String> {
    let text = |x: Option<String>| x.unwrap_or_else(|| UNKNOWN.into());
    let number =
        |k: usize, digits: usize| text(values.get(k).copied().flatten().map(|value| format!("{value:.digits$}")));
    let mut cells = vec![frame.to_owned()];
    cells.extend(first.map(text));
    cells.extend([number(0, 4), number(1, 4)]);
    cells.extend((7..7 + views).map(|k| number(k, 3)));
    cells.extend([(7, 1), (8, 1), (9, 0), (10, 0)].map(|(k, digits)| number(views + k, digits)));
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
