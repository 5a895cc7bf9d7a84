//! The quantities that can be plotted, by row of the table.

use crate::study::run::{PaperRow, Run, Spread, TableRow};

/// A quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum PlottedQuantity {
    #[default]
    Majpe,
    PaMajpe,
    Iou,
    Converged,
    Improved,
    Loss,
    Reprojection,
    Counting,
    Time,
}

/// One row's value, and its standard error where it is a mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Value {
    pub(super) mean: f64,
    pub(super) error: f64,
    /// The paper's figure.
    pub(super) paper: Option<f64>,
}

/// A value a row; `None` where unknown.
pub(super) type Values = Vec<Option<Value>>;

impl PlottedQuantity {
    const ALL: [Self; 9] = [
        Self::Majpe,
        Self::PaMajpe,
        Self::Iou,
        Self::Converged,
        Self::Improved,
        Self::Reprojection,
        Self::Loss,
        Self::Counting,
        Self::Time,
    ];

    /// On buttons.
    pub(super) fn short(self) -> &'static str {
        match self {
            Self::Majpe => "MAJPE",
            Self::PaMajpe => "PA-MAJPE",
            Self::Iou => "IoU",
            Self::Converged => "Converged",
            Self::Improved => "Better than start",
            Self::Loss => "Loss",
            Self::Reprojection => "Reprojection",
            Self::Counting => "Count right",
            Self::Time => "Time",
        }
    }

    /// Unit, or "".
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Majpe | Self::PaMajpe => "mm",
            Self::Converged | Self::Improved | Self::Counting => "%",
            Self::Reprojection => "px",
            Self::Time => "ms",
            Self::Iou | Self::Loss => "",
        }
    }

    /// Name and unit.
    pub(super) fn title(self) -> String {
        if self.unit().is_empty() { self.short().to_owned() } else { format!("{}, {}", self.short(), self.unit()) }
    }

    pub(super) fn help(self) -> &'static str {
        match self {
            Self::Majpe => "Mean joint position error against truth, mm; persons paired best. Smaller is better.",
            Self::PaMajpe => "The same after rotation, translation and scale of each person, mm. Smaller is better.",
            Self::Iou => "Forward-consistency IoU of the masks of H_sim and H_ori, mean over views. Larger is better.",
            Self::Converged => "Share of frames that met the convergence criterion, %.",
            Self::Improved => "Share of frames whose MAJPE is smaller after the fit than at its start, %.",
            Self::Loss => "The loss L at the end; not comparable between weights.",
            Self::Reprojection => {
                "Joints projected into the camera against key points, px; the calibration is uncertain."
            }
            Self::Counting => {
                "Share of frames whose number of people is the annotated one, weighted by 91, 8 and 1 % where known, %."
            }
            Self::Time => "Time of the Adam steps of a frame, ms, on the machine and under the load of that run.",
        }
    }

    /// As a number in a table.
    pub(super) fn text(self, value: f64) -> String {
        match self {
            Self::Iou | Self::Loss => format!("{value:.3}"),
            _ => format!("{value:.1}"),
        }
    }

    fn of(self, row: &TableRow) -> Option<(f64, f64)> {
        let spread = |spread: Option<Spread>| spread.map(|spread| (spread.mean, spread.error()));
        let share = |share: Option<f64>| share.map(|share| (100.0 * share, 0.0));
        match self {
            Self::Majpe => spread(row.majpe_mm),
            Self::PaMajpe => spread(row.pa_majpe_mm),
            Self::Iou => spread(row.iou),
            Self::Converged => share(row.converged_share),
            Self::Improved => share(row.share_improved),
            Self::Loss => spread(row.loss),
            Self::Reprojection => spread(row.reprojection_px),
            Self::Counting => share(row.counts.and_then(|counts| counts.weighted.or(counts.overall))),
            Self::Time => None,
        }
    }

    fn of_paper(self, paper: PaperRow) -> Option<f64> {
        match self {
            Self::Majpe => paper.majpe_mm,
            Self::PaMajpe => paper.pa_majpe_mm,
            Self::Iou => paper.iou,
            Self::Converged => paper.converged_share.map(|share| 100.0 * share),
            Self::Counting => paper.count_accuracy.map(|share| 100.0 * share),
            _ => None,
        }
    }
}

/// Every quantity that some row of the run knows, with its values.
pub(super) fn of_run(run: &Run) -> Vec<(PlottedQuantity, Values)> {
    let all = PlottedQuantity::ALL.map(|measure| {
        let values = run.table.iter().map(|row| {
            let known = if measure == PlottedQuantity::Time { time(run, row) } else { measure.of(row) };
            let paper = row.paper.and_then(|paper| measure.of_paper(paper));
            known.map(|(mean, error)| Value { mean, error, paper })
        });
        (measure, values.collect::<Values>())
    });
    all.into_iter().filter(|(_, values)| values.iter().any(Option::is_some)).collect()
}

/// Mean time of a fit and its standard error, ms.
fn time(run: &Run, row: &TableRow) -> Option<(f64, f64)> {
    let times: Vec<f64> = run.rows_of(row).filter_map(|row| row.fit_ms).collect();
    let n = times.len() as f64;
    if times.is_empty() {
        return None;
    }
    let mean = times.iter().sum::<f64>() / n;
    let squares: f64 = times.iter().map(|x| (x - mean) * (x - mean)).sum();
    Some((mean, if times.len() > 1 { (squares / (n - 1.0) / n).sqrt() } else { 0.0 }))
}

/// The different labels of a column: numbers ascending, words as they come.
pub(super) fn levels(run: &Run, column: usize) -> Vec<String> {
    let mut levels: Vec<String> = Vec::new();
    for label in run.table.iter().filter_map(|row| row.labels.get(column)) {
        if !levels.contains(label) {
            levels.push(label.clone());
        }
    }
    if levels.iter().all(|level| super::number(level).is_some()) {
        levels.sort_by(|a, b| super::number(a).unwrap_or(0.0).total_cmp(&super::number(b).unwrap_or(0.0)));
    }
    levels
}

/// Smallest and largest mean; a little apart where they are one.
pub(super) fn limits(values: &Values) -> (f64, f64) {
    let means = || values.iter().flatten().map(|value| value.mean);
    let (lo, hi) = (means().fold(f64::INFINITY, f64::min), means().fold(f64::NEG_INFINITY, f64::max));
    if hi > lo { (lo, hi) } else { (lo - 0.5, lo + 0.5) }
}
