//! Curves as CSV (RFC 4180 by the csv crate, numbers that read back exactly): one row an iteration.

use crate::escape::to_cell;
use crate::mhp::StepReport;
use crate::output::replace_file;
use crate::study::StudyError;
use crate::study::summary::{loss_values, losses};
use std::path::Path;

/// One iteration of one branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveRow<'a> {
    /// The branch; 0 for a fit that never went back.
    pub branch: u32,
    /// Loss, terms, IoU, convergence.
    pub report: &'a StepReport,
    /// Mean joint error against truth, mm, where there is truth.
    pub majpe_mm: Option<f64>,
    /// What was changed by hand from here on, in words.
    pub flag: Option<&'a str>,
}

/// `iteration branch loss`, each of [`crate::mhp::TERMS`], `iou_<array>… majpe_mm converged flag`.
pub fn curve_columns(arrays: &[String]) -> Vec<String> {
    let first = ["iteration", "branch"].into_iter().chain(losses()).map(str::to_owned);
    let ious = arrays.iter().map(|array| format!("iou_{array}"));
    let last = ["majpe_mm", "converged", "flag"].map(str::to_owned);
    first.chain(ious).chain(last).collect()
}

/// The table as text, with [`curve_columns`] as its head; an IoU for each of `arrays`. What is unknown or not finite is empty.
///
/// # Errors
/// Where the table cannot be made in memory.
pub fn curves_csv<'a>(arrays: &[String], rows: impl IntoIterator<Item = CurveRow<'a>>) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(curve_columns(arrays))?;
    for row in rows {
        writer.write_record(cells(arrays.len(), &row))?;
    }
    writer.into_inner().map_err(|error| std::io::Error::other(error.to_string()))
}

fn cells(views: usize, row: &CurveRow<'_>) -> Vec<String> {
    let report = row.report;
    let losses = loss_values(report).map(Some);
    let ious = (0..views).map(|view| report.iou.get(view).copied().flatten());
    let number = |x: Option<f64>| x.filter(|x| x.is_finite()).map(|x| x.to_string()).unwrap_or_default();
    let first = [report.iteration.to_string(), row.branch.to_string()];
    let last = [number(row.majpe_mm), report.converged.to_string(), to_cell(row.flag.unwrap_or_default()).into_owned()];
    first.into_iter().chain(losses.chain(ious).map(number)).chain(last).collect()
}

/// Writes [`curves_csv`], atomically.
///
/// # Errors
/// Where the file cannot be written; an existing one is then untouched.
pub fn write_curves<'a>(
    path: &Path,
    arrays: &[String],
    rows: impl IntoIterator<Item = CurveRow<'a>>,
) -> Result<(), StudyError> {
    let written = curves_csv(arrays, rows).and_then(|table| replace_file(path, |out| out.write_all(&table)));
    written.map_err(|reason| StudyError::Write { reason, path: path.to_owned() })
}

#[cfg(all(test, feature = "dummies"))]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

    use super::*;
    use crate::mhp::Terms;

    #[test]
    fn the_dummy_term_has_a_column() {
        let terms = Terms::from_fn(|term| if term.key == "dummy" { 0.7 } else { 0.1 });
        let report = StepReport { iteration: 0, loss: 1.0, terms, iou: vec![None].into(), converged: false };
        let row = CurveRow { branch: 0, report: &report, majpe_mm: None, flag: None };
        let place = curve_columns(&["hm".to_owned()]).iter().position(|column| column == "dummy").unwrap();
        assert_eq!(cells(1, &row)[place], "0.7");
    }
}
