//! One row of a run: one frame under one variant.

use super::spec::RunSpec;
use crate::dataset::Origin;
use crate::escape::to_cell;
use crate::mhp::{TermId, Terms};
use crate::study::complexity::Stratum;
use serde::{Deserialize, Serialize};

/// The numbers of a fit that worked. What is unknown is `None`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunNumbers {
    /// Adam steps taken.
    pub iterations: usize,
    /// The convergence criterion at the end.
    pub converged: bool,
    /// Why the run ended: `iterations` or `converged`; `counted` where nothing was fitted.
    pub reason: String,
    /// L.
    pub loss: f64,
    /// Unweighted terms; `None` where nothing was fitted, and for one that the program that wrote the row did not know.
    pub terms: Terms<Option<f64>>,
    /// Forward-consistency IoU of each view.
    pub iou: Vec<Option<f64>>,
    /// Against truth, mm; persons paired best.
    pub majpe_mm: Option<f64>,
    /// After similarity alignment of each person, mm.
    pub pa_majpe_mm: Option<f64>,
    /// OSPA, mm: MAJPE in which persons who are missed or invented count.
    #[serde(default)]
    pub ospa_mm: Option<f64>,
    /// The same two of the start.
    pub init_majpe_mm: Option<f64>,
    /// The same of the start, after alignment.
    pub init_pa_majpe_mm: Option<f64>,
    /// Whether a fit in a window left the persons where they start ([`crate::mhp::Fitter::is_held`]).
    #[serde(default)]
    pub held: bool,
    /// Persons fitted.
    pub persons: usize,
    /// Persons annotated.
    pub annotated: Option<usize>,
    /// Joints against key points of an image, px.
    pub reprojection_px: Option<f64>,
    /// Share of projected joints inside the image's boxes.
    pub box_coverage: Option<f64>,
    /// Share of joints inside the boxes on the radar maps, mean over views.
    pub map_box_coverage: Option<f64>,
}

impl RunNumbers {
    /// Mean IoU over the views where it is known.
    pub fn mean_iou(&self) -> Option<f64> {
        let known: Vec<f64> = self.iou.iter().flatten().copied().collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    }

    /// Whether as many persons were fitted as are annotated; true where nobody says.
    pub fn count_matched(&self) -> bool {
        self.annotated.is_none_or(|annotated| annotated == self.persons)
    }

    /// Whether the fit is nearer to truth than its start.
    pub fn improved(&self) -> Option<bool> {
        Some(self.majpe_mm? < self.init_majpe_mm?)
    }
}

/// One frame under one variant; a line of the journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRow {
    /// Index of the variant.
    pub variant: usize,
    /// Index of the frame in the data set.
    pub frame: usize,
    /// The frame's name.
    pub name: String,
    /// The sequence it is of.
    pub sequence: String,
    /// Where it comes from, as far as that is known.
    #[serde(default, skip_serializing_if = "Origin::is_unknown")]
    pub origin: Origin,
    /// Its stratum, where the study asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "stratum_word")]
    pub stratum: Option<Stratum>,
    /// Fitted on the way to a frame that is studied, and not counted itself: only where a warm start needs it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub passing: bool,
    /// The numbers, or why there are none: one line.
    pub fit: Result<RunNumbers, String>,
    /// Time to find the start, ms; `None` where it was the frame before. Never part of a table that must be reproducible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub init_ms: Option<f64>,
    /// Time of the Adam steps, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit_ms: Option<f64>,
}

mod stratum_word {
    use super::Stratum;
    use serde::{Deserialize as _, Deserializer, Serializer, de::Error as _};

    #[expect(
        clippy::ref_option,
        clippy::trivially_copy_pass_by_ref,
        reason = "serde's `with` passes a reference to the field"
    )]
    pub(super) fn serialize<S: Serializer>(stratum: &Option<Stratum>, out: S) -> Result<S::Ok, S::Error> {
        match stratum {
            Some(stratum) => out.serialize_str(stratum.word()),
            None => out.serialize_none(),
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Stratum>, D::Error> {
        let word = Option::<String>::deserialize(from)?;
        word.map(|word| word.parse().map_err(D::Error::custom)).transpose()
    }
}

/// What a cell holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    Text(Option<String>),
    Whole(Option<i64>),
    Number(Option<f64>),
    Flag(Option<bool>),
}

impl Cell {
    /// In a CSV; numbers read back exactly, what is unknown is empty.
    pub(super) fn text(&self) -> String {
        match self {
            Self::Text(text) => to_cell(text.as_deref().unwrap_or_default()).into_owned(),
            Self::Whole(n) => n.map(|n| n.to_string()).unwrap_or_default(),
            Self::Number(x) => x.map(|x| x.to_string()).unwrap_or_default(),
            Self::Flag(flag) => flag.map(|flag| flag.to_string()).unwrap_or_default(),
        }
    }
}

/// The columns of `rows.csv` and `rows.parquet`, in order, and the cells of a row. Labels of the variant come first.
pub(super) fn cells(spec: &RunSpec, row: &RunRow) -> Vec<(String, Cell)> {
    let fit = row.fit.as_ref().ok();
    let text = |text: &str| Cell::Text(Some(text.to_owned()));
    let count = |n: Option<usize>| Cell::Whole(n.map(|n| n as i64));
    let number =
        |get: &dyn Fn(&super::RunNumbers) -> Option<f64>| Cell::Number(fit.and_then(get).filter(|x| x.is_finite()));
    let labels = spec.variants.get(row.variant).map(|variant| variant.labels.as_slice()).unwrap_or_default();
    let mut cells: Vec<(String, Cell)> =
        spec.columns.iter().zip(labels).map(|(column, label)| (column.clone(), text(label))).collect();
    let mut add = |name: &str, cell| cells.push((name.to_owned(), cell));
    add("variant", count(Some(row.variant)));
    add("index", count(Some(row.frame)));
    add("frame", text(&row.name));
    add("sequence", text(&row.sequence));
    for (name, part) in Origin::PARTS.iter().zip(row.origin.parts()) {
        add(name, Cell::Text(part.map(ToOwned::to_owned)));
    }
    add("stratum", Cell::Text(row.stratum.map(|stratum| stratum.word().to_owned())));
    let reason = row.fit.as_ref().map_or_else(|why| format!("error: {why}"), |fit| fit.reason.clone());
    if spec.study == super::StudyKind::Counting {
        add("reason", Cell::Text(Some(reason)));
        add("persons", count(fit.map(|fit| fit.persons)));
        add("persons_annotated", count(fit.and_then(|fit| fit.annotated)));
        add("count_matched", Cell::Flag(fit.map(RunNumbers::count_matched)));
        return cells;
    }
    add("fitted_iterations", count(fit.map(|fit| fit.iterations)));
    add("converged", Cell::Flag(fit.map(|fit| fit.converged)));
    add("reason", Cell::Text(Some(reason)));
    add("held", Cell::Flag(fit.map(|fit| fit.held)));
    add("loss", number(&|fit| Some(fit.loss)));
    for term in TermId::all() {
        add(term.key, number(&|fit| fit.terms[term]));
    }
    add("iou", number(&RunNumbers::mean_iou));
    for (view, array) in spec.data.arrays.iter().enumerate() {
        add(&format!("iou_{array}"), number(&|fit| fit.iou.get(view).copied().flatten()));
    }
    add("majpe_mm", number(&|fit| fit.majpe_mm));
    add("pa_majpe_mm", number(&|fit| fit.pa_majpe_mm));
    add("ospa_mm", number(&|fit| fit.ospa_mm));
    add("init_majpe_mm", number(&|fit| fit.init_majpe_mm));
    add("init_pa_majpe_mm", number(&|fit| fit.init_pa_majpe_mm));
    add("persons", count(fit.map(|fit| fit.persons)));
    add("persons_annotated", count(fit.and_then(|fit| fit.annotated)));
    add("count_matched", Cell::Flag(fit.map(RunNumbers::count_matched)));
    add("reprojection_px", number(&|fit| fit.reprojection_px));
    add("box_coverage", number(&|fit| fit.box_coverage));
    add("map_box_coverage", number(&|fit| fit.map_box_coverage));
    cells
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

    use super::*;

    fn spec() -> RunSpec {
        let text = "id = ''\nstudy = 'sweep'\nversion = ''\nprecision = 'f32'\nbase = ''\nseed = 1\ncolumns = []\n\
            [data]\nname = ''\nroot = ''\nfingerprint = ''\ncontent = ''\narrays = ['hm']\nfirst = 0\nend = 1\n\
            frames = 1\nsubset = 'all'\n[[variant]]\nlabels = []\n[variant.config]\n";
        toml::from_str(text).unwrap()
    }

    fn cell(row: &RunRow, name: &str) -> Cell {
        let found = cells(&spec(), row).into_iter().find(|(column, _)| column == name);
        found.map(|(_, cell)| cell).unwrap()
    }

    fn row(fit: RunNumbers) -> RunRow {
        RunRow {
            variant: 0,
            frame: 0,
            name: "a/0".into(),
            sequence: "a".into(),
            origin: Origin::default(),
            stratum: None,
            passing: false,
            fit: Ok(fit),
            init_ms: None,
            fit_ms: None,
        }
    }

    #[cfg(feature = "dummies")]
    #[test]
    fn the_dummy_term_has_a_column() {
        let terms = Terms::from_fn(|term| (term.key == "dummy").then_some(0.7));
        assert_eq!(cell(&row(RunNumbers { terms, ..RunNumbers::default() }), "dummy"), Cell::Number(Some(0.7)));
    }

    /// A journal from before L_time was told has six terms by their places; the seventh is not known.
    #[test]
    fn a_row_of_an_older_journal_is_read() {
        let now = row(RunNumbers { terms: Terms::from_fn(|_| Some(0.5)), ..RunNumbers::default() });
        let line = serde_json::to_string(&now).unwrap();
        assert_eq!(serde_json::from_str::<RunRow>(&line).unwrap(), now);
        let (before, after) = line.split_once("\"terms\":{").unwrap();
        let (_, after) = after.split_once('}').unwrap();
        let older = format!("{before}\"terms\":[0.5,1,2,3,4,5]{after}");
        let older: RunRow = serde_json::from_str(&older).unwrap();
        assert_eq!(
            ["em", "coll", "time"].map(|key| cell(&older, key)),
            [Cell::Number(Some(0.5)), Cell::Number(Some(5.0)), Cell::Number(None)]
        );
    }
}
