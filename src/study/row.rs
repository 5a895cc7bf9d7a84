//! What is known of one fitted frame, and the means over many.

use super::summary::{ERRORS, FIRST, LOSSES, NUMBERS, loss_values};
use crate::body::Pppr;
use crate::dataset::Frame;
use crate::escape::to_cell;
use crate::mhp::{StepReport, StopReason};
use crate::study::shard::{FrameCommand, ShardRow};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::sync::Arc;

/// The numbers of a fit that worked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitNumbers {
    /// Iteration, loss, terms, IoU of each view and convergence at the end.
    pub report: StepReport,
    /// Why the run ended.
    pub reason: StopReason,
    /// Which breakpoint stopped it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub breakpoint: Option<String>,
    /// Persons fitted.
    pub people: usize,
    /// Persons annotated, where the data set says.
    pub annotated: Option<usize>,
    /// Mean joint error against the data set's own joints, mm; of the smaller number of persons, paired best.
    pub majpe_mm: Option<f64>,
    /// The same after alignment of each person.
    pub pa_majpe_mm: Option<f64>,
    /// Time to find the start pose, ms; `None` where it was the result of the frame before.
    pub init_ms: Option<f64>,
    /// Time of all Adam steps, ms.
    pub fit_ms: f64,
}

impl FitNumbers {
    /// Whether as many persons were fitted as are annotated; true where nobody says.
    pub fn count_matched(&self) -> bool {
        self.annotated.is_none_or(|annotated| annotated == self.people)
    }
}

/// How many people a frame shows, as its data set says.
pub(super) fn annotated(frame: &Frame) -> Option<usize> {
    frame.person_count.or_else(|| frame.truth.as_ref().map(|truth| truth.persons))
}

/// A fit that worked: its numbers and the parameters it ended with.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameFit {
    /// The numbers of its row.
    pub numbers: FitNumbers,
    /// Where it began; the EM region lies around it.
    pub initial: Pppr,
    /// Where the fit ended; SPEC section 2.
    pub params: Pppr,
}

/// One row of a batch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatchRow {
    /// Index in the data set.
    pub index: usize,
    /// The frame's name.
    pub frame: String,
    /// The fit, or why there is none: one line that names the file.
    pub fit: Result<FitNumbers, String>,
    /// Joints of all persons where the fit ended, m; not written, for tables have no use for them.
    #[serde(skip)]
    pub joints: Option<Arc<[[f32; 3]]>>,
}

impl ShardRow for BatchRow {
    const COMMAND: FrameCommand = FrameCommand::Fit;

    fn index(&self) -> usize {
        self.index
    }

    fn failure(&self) -> Option<&str> {
        self.fit.as_ref().err().map(String::as_str)
    }
}

impl BatchRow {
    /// The numbers, in the order of the columns between `annotated` and the end: loss, its terms, the IoU of `views`
    /// views, two joint errors, two times. `None` where unknown.
    pub fn values(&self, views: usize) -> Vec<Option<f64>> {
        let Ok(fit) = &self.fit else { return vec![None; views + NUMBERS] };
        let losses = loss_values(&fit.report).map(Some);
        let ious = (0..views).map(|view| fit.report.iou.get(view).copied().flatten());
        let rest = [fit.majpe_mm, fit.pa_majpe_mm, fit.init_ms, Some(fit.fit_ms)];
        losses.chain(ious).chain(rest).map(|x| x.filter(|x| x.is_finite())).collect()
    }

    /// Why the run ended: `iterations`, `converged`, `breakpoint: …`, or `error: …`.
    pub fn reason(&self) -> String {
        match &self.fit {
            Ok(FitNumbers { breakpoint: Some(breakpoint), .. }) => format!("breakpoint: {breakpoint}"),
            Ok(fit) => fit.reason.word().to_owned(),
            Err(why) => format!("error: {why}"),
        }
    }

    /// One cell a column of [`super::columns`]; empty where unknown.
    pub fn cells(&self, views: usize) -> Vec<String> {
        let fit = self.fit.as_ref().ok();
        let text = |x: Option<String>| x.unwrap_or_default();
        let first = [
            to_cell(&self.frame).into_owned(),
            text(fit.map(|fit| fit.report.iteration.to_string())),
            text(fit.map(|fit| fit.report.converged.to_string())),
            to_cell(&self.reason()).into_owned(),
            text(fit.map(|fit| fit.people.to_string())),
            text(fit.and_then(|fit| fit.annotated).map(|n| n.to_string())),
        ];
        first.into_iter().chain(self.values(views).into_iter().map(|x| text(x.map(|x| x.to_string())))).collect()
    }

    /// The row as a JSON object with the keys of [`super::columns`]; null where unknown.
    pub fn json(&self, columns: &[String]) -> Value {
        let views = columns.len().saturating_sub(super::columns(&[]).len());
        let fit = self.fit.as_ref().ok();
        let first = [
            Value::from(self.frame.clone()),
            Value::from(fit.map(|fit| fit.report.iteration)),
            Value::from(fit.map(|fit| fit.report.converged)),
            Value::from(self.reason()),
            Value::from(fit.map(|fit| fit.people)),
            Value::from(fit.and_then(|fit| fit.annotated)),
        ];
        let values = first.into_iter().chain(self.values(views).into_iter().map(Value::from));
        Value::Object(columns.iter().cloned().zip(values).collect())
    }
}

/// Running means over the frames that could be fitted; each value over the frames where it is known, and joint errors over those
/// alone where as many persons were fitted as are annotated: of three people, the error of the one that was fitted says
/// nothing of the other two.
#[derive(Debug, Clone, PartialEq)]
pub struct Means {
    /// Frames seen, failed ones included.
    pub frames: usize,
    /// Frames without a fit.
    pub failed: usize,
    /// Frames left out of the joint errors: another number of persons was fitted than is annotated.
    pub count_mismatched: usize,
    converged: usize,
    iterations: usize,
    sums: Vec<(f64, usize)>,
}

impl Means {
    /// No frame yet, of a data set with `views` views.
    pub fn new(views: usize) -> Self {
        let sums = vec![(0.0, 0); views + NUMBERS];
        Self { frames: 0, failed: 0, count_mismatched: 0, converged: 0, iterations: 0, sums }
    }

    /// Counts a row.
    pub fn add(&mut self, row: &BatchRow) {
        self.frames += 1;
        match &row.fit {
            Ok(fit) => {
                self.converged += usize::from(fit.report.converged);
                self.iterations += fit.report.iteration;
            }
            Err(_) => self.failed += 1,
        }
        let views = self.sums.len() - NUMBERS;
        let mut values = row.values(views);
        if row.fit.as_ref().is_ok_and(|fit| !fit.count_matched()) {
            self.count_mismatched += 1;
            values.iter_mut().skip(LOSSES + views).take(ERRORS).for_each(|error| *error = None);
        }
        for ((sum, count), value) in self.sums.iter_mut().zip(values) {
            if let Some(value) = value {
                *sum += value;
                *count += 1;
            }
        }
    }

    /// Frames over which the mean joint error is.
    pub fn errors_over(&self) -> usize {
        self.sums.iter().rev().nth(NUMBERS - LOSSES - 1).map_or(0, |&(_, count)| count)
    }

    /// Frames with a fit.
    pub fn fitted(&self) -> usize {
        self.frames - self.failed
    }

    /// Share of the fitted frames that met the convergence criterion.
    pub fn converged_share(&self) -> Option<f64> {
        self.over_fitted(self.converged)
    }

    /// Mean number of iterations.
    pub fn iterations(&self) -> Option<f64> {
        self.over_fitted(self.iterations)
    }

    fn over_fitted(&self, count: usize) -> Option<f64> {
        (self.fitted() > 0).then(|| count as f64 / self.fitted() as f64)
    }

    /// The means in the order of [`BatchRow::values`].
    pub fn values(&self) -> Vec<Option<f64>> {
        self.sums.iter().map(|&(sum, count)| (count > 0).then(|| sum / count as f64)).collect()
    }

    /// `frames`, `failed`, `errors_over` (frames that the joint errors are the mean of), `count_mismatched` (frames left out of
    /// them), `converged_share`, `iterations` and the mean of every number column; null where unknown.
    pub fn json(&self, columns: &[String]) -> Value {
        let mut object = Map::new();
        object.insert("frames".into(), self.frames.into());
        object.insert("failed".into(), self.failed.into());
        object.insert("errors_over".into(), self.errors_over().into());
        object.insert("count_mismatched".into(), self.count_mismatched.into());
        object.insert("converged_share".into(), self.converged_share().into());
        object.insert("iterations".into(), self.iterations().into());
        let numbers = columns.iter().skip(FIRST.len()).cloned();
        object.extend(numbers.zip(self.values().into_iter().map(Value::from)));
        Value::Object(object)
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

    use super::*;
    use crate::mhp::Terms;

    fn row(loss: f64, iou: Option<f64>, converged: bool) -> BatchRow {
        let terms = Terms::from_fn(|term| if term.key == "dummy" { 0.7 } else { 0.1 });
        let report = StepReport { iteration: 10, loss, terms, iou: vec![iou].into(), converged };
        let fit = FitNumbers {
            report,
            reason: StopReason::Iterations,
            breakpoint: None,
            people: 1,
            annotated: None,
            majpe_mm: None,
            pa_majpe_mm: None,
            init_ms: Some(2.0),
            fit_ms: 5.0,
        };
        BatchRow { index: 0, frame: "a/0".into(), fit: Ok(fit), joints: None }
    }

    #[test]
    fn means_are_over_the_frames_where_a_value_is_known() {
        let mut means = Means::new(1);
        for row in [row(1.0, Some(0.4), true), row(3.0, None, false)] {
            means.add(&row);
        }
        means.add(&BatchRow { index: 2, frame: "a/2".into(), fit: Err("x.npz: no".into()), joints: None });
        let json = means.json(&super::super::columns(&["hm".to_owned()]));
        assert_eq!((means.frames, means.failed, means.converged_share()), (3, 1, Some(0.5)));
        assert_eq!(json["loss"], 2.0);
        assert_eq!(json["iou_hm"], 0.4);
        assert_eq!(json["fit_ms"], 5.0);
        assert!(json["majpe_mm"].is_null());
        assert_eq!(json["iterations"], 10.0);
    }

    /// Frames whose number of persons is not the annotated one are counted, and no part of the mean error.
    #[test]
    fn joint_errors_are_means_over_the_frames_whose_people_are_the_annotated_ones() {
        let counted = |majpe_mm: f64, annotated: Option<usize>| {
            let mut row = row(majpe_mm / 100.0, Some(0.5), true);
            let fit = row.fit.as_mut().unwrap();
            (fit.majpe_mm, fit.pa_majpe_mm, fit.annotated) = (Some(majpe_mm), Some(majpe_mm / 2.0), annotated);
            row
        };
        let mut means = Means::new(1);
        for row in [counted(100.0, Some(1)), counted(900.0, Some(2)), counted(200.0, None), row(3.0, None, true)] {
            means.add(&row);
        }
        assert_eq!((means.errors_over(), means.count_mismatched), (2, 1));
        let json = means.json(&super::super::columns(&["hm".to_owned()]));
        assert_eq!((&json["majpe_mm"], &json["pa_majpe_mm"]), (&150.0.into(), &75.0.into()));
        assert_eq!((&json["errors_over"], &json["count_mismatched"]), (&2.into(), &1.into()));
        assert_eq!(json["loss"], (1.0 + 9.0 + 2.0 + 3.0) / 4.0, "the loss knows no annotation");
    }

    #[test]
    fn unknown_cells_are_empty_and_numbers_read_back_exactly() {
        let columns = super::super::columns(&["hm".to_owned()]);
        let cells = row(0.1 + 0.2, None, true).cells(1);
        assert_eq!(cells.len(), columns.len());
        assert_eq!(cells[..6], ["a/0", "10", "true", "iterations", "1", ""]);
        assert_eq!(cells[6].parse(), Ok(0.1 + 0.2));
        let cell = |name: &str| cells[columns.iter().position(|column| column == name).unwrap()].as_str();
        assert_eq!(cell("iou_hm"), "", "an undefined IoU");
        assert_eq!(["majpe_mm", "pa_majpe_mm", "init_ms", "fit_ms"].map(cell), ["", "", "2", "5"]);
        let failed = BatchRow { index: 0, frame: "b".into(), fit: Err("why".into()), joints: None };
        assert_eq!(failed.cells(1)[1..7], ["", "", "error: why", "", "", ""]);
        assert_eq!(failed.json(&columns)["loss"], Value::Null);
    }
    /// Head, row and mean of the term that only unit tests have.
    #[cfg(feature = "dummies")]
    #[test]
    fn the_dummy_term_has_a_column() {
        let columns = super::super::columns(&["hm".to_owned()]);
        let place = columns.iter().position(|column| column == "dummy").unwrap();
        assert_eq!(row(1.0, None, true).cells(1)[place], "0.7");
        let mut means = Means::new(1);
        means.add(&row(1.0, None, true));
        assert_eq!(means.json(&columns)["dummy"], 0.7);
    }
}
