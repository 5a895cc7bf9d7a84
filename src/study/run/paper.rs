//! The paper's figures beside ours, by the data set that they are of.
//!
//! They are those of RETR: errors of a network that reads PPPR, not of the fit. They are shown so that trends can be compared,
//! never to be reached, and only beside rows of the data set that they are of: a column for MMVR says nothing of other maps.

use super::kind::StudyKind;
use super::variant::PaperRow;
use crate::study::complexity::Stratum;

/// A data set of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PaperSet {
    Mmvr,
    Hupr,
    Xrf55,
}

impl PaperSet {
    pub(super) const ALL: [Self; 3] = [Self::Mmvr, Self::Hupr, Self::Xrf55];

    /// The layout that it is published in, as [`crate::dataset::Layout::word`] says it.
    fn layout(self) -> &'static str {
        match self {
            Self::Mmvr => "mmvr",
            Self::Hupr => "hupr",
            Self::Xrf55 => "xrf55",
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Mmvr => "MMVR",
            Self::Hupr => "HuPR",
            Self::Xrf55 => "XRF55",
        }
    }

    /// Those that a study has figures of.
    fn of_study(study: StudyKind) -> &'static [Self] {
        match study {
            StudyKind::Complexity | StudyKind::Robustness | StudyKind::Operators | StudyKind::Counting => {
                &Self::ALL[..1]
            }
            StudyKind::Threshold | StudyKind::Weights | StudyKind::Init => &Self::ALL,
            StudyKind::Budget | StudyKind::Switches | StudyKind::Truth | StudyKind::Sweep => &[],
        }
    }

    /// The one whose figures stand beside a study of data with this layout (as [`crate::dataset::Layout::word`] says it).
    pub(super) fn beside(study: StudyKind, layout: &str) -> Option<Self> {
        Self::of_study(study).iter().copied().find(|set| set.layout() == layout)
    }
}

/// What the paper's figures beside a study of data with this layout are; `None` where there are none.
pub(super) fn told(study: StudyKind, layout: &str) -> Option<String> {
    let name = PaperSet::beside(study, layout)?.name();
    Some(match study {
        StudyKind::Complexity => {
            format!("RETR with PPPR on {name} scenes 2 to 5; IoU and convergence are of the optimisation itself")
        }
        StudyKind::Robustness => format!("RETR on the hard subset of {name}, 80 iterations"),
        StudyKind::Operators | StudyKind::Threshold | StudyKind::Weights => format!("RETR on single-person {name}"),
        StudyKind::Counting => format!("cleaned {name}; 850 and 1200 frames a second"),
        _ => format!("RETR on {name}"),
    })
}

/// Why no figure of the paper is shown, where the paper has such a table.
pub(super) fn missing(study: StudyKind, layout: &str) -> Option<String> {
    let sets: Vec<&str> = PaperSet::of_study(study).iter().map(|set| set.name()).collect();
    if sets.is_empty() || PaperSet::beside(study, layout).is_some() {
        return None;
    }
    let known = if layout.is_empty() { "unknown" } else { layout };
    Some(format!(
        "The paper's figures for this study are of {} and not shown: the layout here is {known}.",
        sets.join(", ")
    ))
}

/// For a stratum of MMVR; `None` stands for the mean of all.
pub(super) fn stratum(stratum: Option<Stratum>) -> PaperRow {
    let (majpe, iou, converged) = match stratum {
        Some(Stratum::Easy) => (69.0, 0.72, 0.964),
        Some(Stratum::Medium) => (72.2, 0.71, 0.960),
        Some(Stratum::Hard) => (81.5, 0.69, 0.948),
        None => (73.9, 0.71, 0.957),
    };
    PaperRow { majpe_mm: Some(majpe), iou: Some(iou), converged_share: Some(converged), ..PaperRow::default() }
}

/// What the paper says of a data set's mismatched frames (table 18) and of what its protocol keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperVerification {
    /// The data set.
    pub name: &'static str,
    /// Frames of 100 with each verdict, in the order of [`crate::labels::Verdict::ALL`].
    pub verdicts: [u32; 4],
    /// Share of the frames with several people that are kept, %.
    pub retention_pct: f64,
}

impl PaperVerification {
    /// That of data with this layout.
    pub fn beside(layout: &str) -> Option<Self> {
        let set = PaperSet::ALL.into_iter().find(|set| set.layout() == layout)?;
        let (verdicts, retention_pct) = match set {
            PaperSet::Mmvr => ([11, 3, 3, 83], 93.2),
            PaperSet::Xrf55 => ([7, 1, 1, 91], 94.8),
            PaperSet::Hupr => return None,
        };
        Some(Self { name: set.name(), verdicts, retention_pct })
    }
}

/// MAJPE and PA-MAJPE at thresholds of 5, 10, 30, 70 and 100 %, mm.
pub(super) fn threshold(set: PaperSet) -> [[f64; 2]; 5] {
    match set {
        PaperSet::Mmvr => [[76.82, 70.45], [71.08, 65.17], [80.08, 74.86], [80.09, 74.90], [80.51, 75.47]],
        PaperSet::Hupr => [[75.01, 71.43], [73.74, 67.70], [87.13, 81.61], [88.03, 81.95], [88.17, 82.05]],
        PaperSet::Xrf55 => [[75.96, 72.65], [72.00, 68.71], [77.14, 73.40], [77.11, 73.67], [77.89, 75.03]],
    }
}

/// The same at w_EM / w_kine of 0.3 / 0.7, 0.5 / 0.5, 0.7 / 0.3, 0 / 1 and 1 / 0.
pub(super) fn weights(set: PaperSet) -> [[f64; 2]; 5] {
    match set {
        PaperSet::Mmvr => [[71.08, 65.17], [64.71, 58.91], [75.08, 72.33], [80.51, 75.47], [78.73, 74.11]],
        PaperSet::Hupr => [[73.74, 67.70], [74.84, 70.03], [75.31, 72.47], [90.30, 84.17], [80.88, 75.93]],
        PaperSet::Xrf55 => [[72.00, 68.71], [74.64, 70.50], [77.09, 74.63], [78.09, 75.72], [78.09, 75.72]],
    }
}

/// MAJPE with both modules of the start, without P, and without V, mm.
pub(super) fn init(set: PaperSet) -> [f64; 3] {
    match set {
        PaperSet::Mmvr => [69.30, 89.74, 71.92],
        PaperSet::Hupr => [75.90, 84.05, 78.11],
        PaperSet::Xrf55 => [77.51, 89.43, 80.45],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_stand_beside_the_data_set_that_they_are_of() {
        assert_eq!(PaperSet::beside(StudyKind::Operators, "mmvr"), Some(PaperSet::Mmvr));
        assert_eq!(PaperSet::beside(StudyKind::Operators, "hupr"), None);
        assert_eq!(PaperSet::beside(StudyKind::Threshold, "hupr"), Some(PaperSet::Hupr));
        assert_eq!(PaperSet::beside(StudyKind::Init, "xrf55"), Some(PaperSet::Xrf55));
        for study in StudyKind::ALL {
            assert_eq!((PaperSet::beside(study, "npz"), told(study, "bare")), (None, None));
            for layout in ["npz", "bare", "mmvr", "hupr", "xrf55", ""] {
                let (shown, why) = (told(study, layout), missing(study, layout));
                let has_table = !PaperSet::of_study(study).is_empty();
                assert_eq!(shown.is_some() || why.is_some(), has_table, "{study} {layout}");
                assert!(shown.is_none() || why.is_none(), "{study} {layout}: either, not both");
            }
        }
        let why = missing(StudyKind::Init, "npz").unwrap_or_default();
        assert_eq!(
            why,
            "The paper's figures for this study are of MMVR, HuPR, XRF55 and not shown: the layout here is npz."
        );
    }
}
