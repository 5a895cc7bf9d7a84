//! What the frame list knows of one frame, gathered for filtering and sorting.

use crate::dataset::Origin;
use crate::labels::{Tags, Verdict};
use crate::mhp::{TermId, Terms};
use crate::session::sources::{SourceNumber, SourceNumbers};
use crate::study::complexity::Stratum;

/// One frame's row.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRow<'a> {
    /// Index in the data set.
    pub index: usize,
    /// Name.
    pub name: &'a str,
    /// The sequence that it belongs to.
    pub sequence: &'a str,
    /// Scene, subject, session and action, as far as they are known.
    pub origin: Origin,
    /// False where its file could not be read.
    pub readable: bool,
    /// Easy, medium or hard.
    pub stratum: Option<Stratum>,
    /// Mean of the rank-normalised statistics, 0..1.
    pub hardness: Option<f64>,
    /// ρ_peak.
    pub peak_density: Option<f64>,
    /// s_static.
    pub static_dominance: Option<f64>,
    /// r_human.
    pub human_saliency: Option<f64>,
    /// Mean forward-consistency IoU.
    pub iou: Option<f64>,
    /// L.
    pub loss: Option<f64>,
    /// Its unweighted terms.
    pub terms: Option<&'a Terms<Option<f64>>>,
    /// Iterations done.
    pub iterations: Option<usize>,
    /// The convergence criterion.
    pub converged: Option<bool>,
    /// Why the run ended.
    pub reason: Option<&'a str>,
    /// Whether another number of people was counted than is annotated, where both are known.
    pub mismatch: Option<bool>,
    /// MAJPE, mm.
    pub majpe_mm: Option<f64>,
    /// Share of its starts whose fits end in the best basin, where that was tried.
    pub best_basin: Option<f64>,
    /// What result sets A and B say, by the number that they are compared by.
    pub results: [Option<f64>; 2],
    /// What each source of predictions says, by its name.
    pub sources: Vec<(&'a str, SourceNumbers)>,
    /// Tags that may be seen, by whomever.
    pub tags: Tags,
    /// Those that the annotator gave.
    pub own_tags: Tags,
    /// The annotator's note.
    pub note: &'a str,
    /// The annotator's verdict.
    pub verdict: Option<Verdict>,
    /// Who labelled it, as far as that may be seen.
    pub annotators: Vec<&'a str>,
}

impl Default for FrameRow<'_> {
    fn default() -> Self {
        Self {
            index: 0,
            name: "",
            sequence: "",
            origin: Origin::default(),
            readable: true,
            stratum: None,
            hardness: None,
            peak_density: None,
            static_dominance: None,
            human_saliency: None,
            iou: None,
            loss: None,
            terms: None,
            iterations: None,
            converged: None,
            reason: None,
            mismatch: None,
            majpe_mm: None,
            best_basin: None,
            results: [None; 2],
            sources: Vec::new(),
            tags: Tags::NONE,
            own_tags: Tags::NONE,
            note: "",
            verdict: None,
            annotators: Vec::new(),
        }
    }
}

/// What of a row is asked for. Of 100,000 frames, gathering those that nobody reads costs more than a pass may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reads {
    /// The name.
    pub name: bool,
    /// The sequence.
    pub sequence: bool,
    /// Where it comes from.
    pub origin: bool,
    /// Stratum, hardness and its parts, readable.
    pub strata: bool,
    /// What is known of the fit.
    pub fit: bool,
    /// Shares in the best basin.
    pub basins: bool,
    /// Result sets A and B.
    pub results: bool,
    /// What sources of predictions say against the truth.
    pub sources: bool,
    /// How far they are from the fits.
    pub to_fits: bool,
    /// Tags.
    pub tags: bool,
    /// The annotator's note and verdict.
    pub said: bool,
    /// Who labelled it.
    pub annotators: bool,
}

impl Reads {
    /// Everything.
    pub const ALL: Self = Self {
        name: true,
        sequence: true,
        origin: true,
        strata: true,
        fit: true,
        basins: true,
        results: true,
        sources: true,
        to_fits: true,
        tags: true,
        said: true,
        annotators: true,
    };

    /// What either asks for.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            name: self.name || other.name,
            sequence: self.sequence || other.sequence,
            origin: self.origin || other.origin,
            strata: self.strata || other.strata,
            fit: self.fit || other.fit,
            basins: self.basins || other.basins,
            results: self.results || other.results,
            sources: self.sources || other.sources,
            to_fits: self.to_fits || other.to_fits,
            tags: self.tags || other.tags,
            said: self.said || other.said,
            annotators: self.annotators || other.annotators,
        }
    }

    /// True where labels are asked for.
    pub fn labels(self) -> bool {
        self.tags || self.said || self.annotators
    }
}

/// A number of a frame that can be compared and sorted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameNumber {
    /// Index in the data set.
    Index,
    /// Hardness.
    Hardness,
    /// ρ_peak.
    PeakDensity,
    /// s_static.
    StaticDominance,
    /// r_human.
    HumanSaliency,
    /// Mean IoU.
    Iou,
    /// L.
    Loss,
    /// Iterations.
    Iterations,
    /// MAJPE, mm.
    Majpe,
    /// Share of starts in the best basin.
    BestBasin,
    /// What result set A says.
    ResultA,
    /// What result set B says.
    ResultB,
    /// B − A.
    Difference,
    /// The largest distance between a source of predictions and the fit, mm.
    Disagreement,
    /// An unweighted term of the loss.
    Term(TermId),
}

impl FrameNumber {
    /// Every number.
    pub fn all() -> impl Iterator<Item = Self> {
        let own = [
            Self::Index,
            Self::Hardness,
            Self::PeakDensity,
            Self::StaticDominance,
            Self::HumanSaliency,
            Self::Iou,
            Self::Loss,
            Self::Iterations,
            Self::Majpe,
            Self::BestBasin,
            Self::ResultA,
            Self::ResultB,
            Self::Difference,
            Self::Disagreement,
        ];
        own.into_iter().chain(TermId::all().map(Self::Term))
    }

    /// As written in a filter.
    pub fn key(self) -> &'static str {
        match self {
            Self::Index => "index",
            Self::Hardness => "hardness",
            Self::PeakDensity => "peaks",
            Self::StaticDominance => "static",
            Self::HumanSaliency => "saliency",
            Self::Iou => "iou",
            Self::Loss => "loss",
            Self::Iterations => "iterations",
            Self::Majpe => "majpe",
            Self::BestBasin => "basin",
            Self::ResultA => "a",
            Self::ResultB => "b",
            Self::Difference => "diff",
            Self::Disagreement => "disagree",
            Self::Term(term) => term.key,
        }
    }

    /// The number called `key`.
    pub fn of(key: &str) -> Option<Self> {
        Self::all().find(|number| number.key() == key)
    }

    /// What it is read from.
    pub(super) fn reads(self) -> Reads {
        let none = Reads::default();
        match self {
            Self::Index => none,
            Self::Hardness | Self::PeakDensity | Self::StaticDominance | Self::HumanSaliency => {
                Reads { strata: true, ..none }
            }
            Self::BestBasin => Reads { basins: true, ..none },
            Self::ResultA | Self::ResultB | Self::Difference => Reads { results: true, ..none },
            Self::Disagreement => SourceNumber::ToFit.reads(),
            Self::Iou | Self::Loss | Self::Iterations | Self::Majpe | Self::Term(_) => Reads { fit: true, ..none },
        }
    }
}

impl SourceNumber {
    /// What it is read from.
    pub(super) fn reads(self) -> Reads {
        let none = Reads::default();
        match self {
            Self::Error | Self::AlignedError => Reads { sources: true, ..none },
            Self::ToFit => Reads { sources: true, to_fits: true, ..none },
        }
    }
}

impl FrameRow<'_> {
    /// The largest distance between a source of predictions and the fit, mm.
    pub fn disagreement_mm(&self) -> Option<f64> {
        self.sources.iter().filter_map(|(_, numbers)| numbers.to_fit_mm).max_by(f64::total_cmp)
    }

    /// A number of the source called `name`.
    pub fn of_source(&self, name: &str, number: SourceNumber) -> Option<f64> {
        self.sources.iter().find(|(known, _)| *known == name).and_then(|(_, numbers)| numbers.get(number))
    }

    /// A number of this frame.
    pub fn number(&self, number: FrameNumber) -> Option<f64> {
        match number {
            FrameNumber::Index => Some(self.index as f64),
            FrameNumber::Hardness => self.hardness,
            FrameNumber::PeakDensity => self.peak_density,
            FrameNumber::StaticDominance => self.static_dominance,
            FrameNumber::HumanSaliency => self.human_saliency,
            FrameNumber::Iou => self.iou,
            FrameNumber::Loss => self.loss,
            FrameNumber::Iterations => self.iterations.map(|n| n as f64),
            FrameNumber::Majpe => self.majpe_mm,
            FrameNumber::BestBasin => self.best_basin,
            FrameNumber::ResultA => self.results[0],
            FrameNumber::ResultB => self.results[1],
            FrameNumber::Difference => self.results[1].zip(self.results[0]).map(|(b, a)| b - a),
            FrameNumber::Disagreement => self.disagreement_mm(),
            FrameNumber::Term(term) => self.terms.and_then(|terms| terms[term]),
        }
    }
}
