//! A variant: one configuration that a study compares with others.

use crate::config::FitConfig;
use serde::{Deserialize, Serialize};

/// Where a frame starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StartFrom {
    /// Its own peaks.
    #[default]
    Cold,
    /// The result of the frame before, where both are of one sequence.
    Warm,
    /// The annotated joints.
    Truth,
}

/// What is done with a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// It is fitted.
    #[default]
    Fit,
    /// Its people are counted: detections, clusters, classifier.
    Counter,
    /// Its people are counted by a classifier of the map's statistics alone.
    Alone,
    /// Its people are counted by a convolutional network on the maps themselves.
    Maps,
}

impl Method {
    /// For serde: a fit is not written.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
    fn is_fit(&self) -> bool {
        *self == Self::Fit
    }
}

/// Figures of the paper beside a row of ours. The paper's errors are of a downstream network, not of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PaperRow {
    /// MAJPE, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub majpe_mm: Option<f64>,
    /// PA-MAJPE, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pa_majpe_mm: Option<f64>,
    /// Forward-consistency IoU, 0..1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iou: Option<f64>,
    /// Convergence rate, 0..1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged_share: Option<f64>,
    /// Weighted accuracy of the count, 0..1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count_accuracy: Option<f64>,
}

impl PaperRow {
    /// MAJPE and PA-MAJPE, mm.
    pub(super) fn errors(majpe_mm: f64, pa_majpe_mm: f64) -> Self {
        Self { majpe_mm: Some(majpe_mm), pa_majpe_mm: Some(pa_majpe_mm), ..Self::default() }
    }

    /// The same of a pair.
    pub(super) fn of_pair([majpe_mm, pa_majpe_mm]: [f64; 2]) -> Self {
        Self::errors(majpe_mm, pa_majpe_mm)
    }
}

/// One configuration of a study; written to `run.toml` as it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variant {
    /// One cell for each of the study's label columns.
    pub labels: Vec<String>,
    /// Where its frames start.
    #[serde(default)]
    pub start: StartFrom,
    /// What is done with them.
    #[serde(default, skip_serializing_if = "Method::is_fit")]
    pub method: Method,
    /// The paper's figures for the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paper: Option<PaperRow>,
    /// Why it cannot differ from the row that it is compared with, where that follows from the settings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Every setting of its fits.
    pub config: FitConfig,
}

impl Variant {
    /// From its frames' own peaks.
    pub(super) fn cold(labels: impl IntoIterator<Item = impl Into<String>>, config: &FitConfig) -> Self {
        let labels = labels.into_iter().map(Into::into).collect();
        Self { labels, start: StartFrom::Cold, method: Method::Fit, paper: None, note: None, config: *config }
    }

    /// Counts instead of fitting.
    pub(super) fn counting(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// The same from the frames before.
    pub(super) fn warm(self) -> Self {
        Self { start: StartFrom::Warm, ..self }
    }

    /// The same from the annotated joints.
    pub(super) fn started_at_truth(self) -> Self {
        Self { start: StartFrom::Truth, ..self }
    }

    /// With the paper's figures, where it has any.
    pub(super) fn beside(self, paper: Option<PaperRow>) -> Self {
        Self { paper, ..self }
    }

    /// Its labels in one line.
    pub fn name(&self) -> String {
        self.labels.join(", ")
    }
}
