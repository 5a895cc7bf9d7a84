//! The columns of the frame list: title, width, what they sort by, and how a cell is drawn.

use crate::app::theme::{self, Tokens};
use crate::app::widgets::iou_color;
use crate::dataset::OriginPart;
use crate::labels::Verdict;
use crate::mhp::TermId;
use crate::session::{
    ComparedNumber, FrameNumber, FrameRow, MOST_SOURCES, ResultSide, Session, SortKey, SourceNumber, ViewState,
};
use egui::{Align2, Color32, FontId, Painter, Rect, pos2};
use std::borrow::Cow;
use std::sync::LazyLock;

/// One column.
pub(super) struct Column {
    /// Its name in the settings.
    pub(super) key: &'static str,
    /// Over the column.
    pub(super) title: &'static str,
    /// In full, for the menu of columns and for screen readers.
    pub(super) name: &'static str,
    /// What it means.
    pub(super) tip: &'static str,
    /// What a click on the title sorts by.
    pub(super) sort: SortKey,
    /// Points.
    pub(super) width: f32,
    /// Numbers are right-aligned.
    pub(super) right: bool,
}

/// Every column, from left to right: at the end one for each term of the loss.
pub(super) fn columns() -> impl Iterator<Item = &'static Column> {
    static OF_SOURCES: LazyLock<Vec<Column>> =
        LazyLock::new(|| (0..MOST_SOURCES as u8).flat_map(Column::of_source).collect());
    static OF_TERMS: LazyLock<Vec<Column>> = LazyLock::new(|| TermId::all().map(Column::of).collect());
    static OF_ORIGINS: LazyLock<Vec<Column>> = LazyLock::new(|| OriginPart::ALL.map(Column::of_origin).into());
    COLUMNS.iter().chain(OF_ORIGINS.iter()).chain(OF_SOURCES.iter()).chain(OF_TERMS.iter())
}

impl Column {
    fn of(term: TermId) -> Self {
        Self {
            key: term.key,
            title: term.label,
            name: term.label,
            tip: term.tooltip().leak(),
            sort: SortKey::Term(term),
            width: 50.0,
            right: true,
        }
    }

    fn of_origin(part: OriginPart) -> Self {
        let (title, width, tip) = match part {
            OriginPart::Scene => ("Scene", 56.0, "The room, or its arrangement; a filter asks for scene:lab."),
            OriginPart::Subject => ("Subject", 52.0, "Who is in it; a filter asks for subject:07."),
            OriginPart::Session => ("Session", 52.0, "The recording; a filter asks for session:2."),
            OriginPart::Action => ("Action", 72.0, "What is done; a filter asks for action:walk."),
        };
        Self { key: part.key(), title, name: title, tip, sort: SortKey::Origin(part), width, right: false }
    }

    /// The errors of a source of predictions, and its distance from the fit.
    fn of_source(slot: u8) -> [Self; 3] {
        let of = |number, key: &str, name: &str, tip| {
            let number_of = slot + 1;
            Self {
                key: format!("pred{number_of}{key}").leak(),
                title: if number == SourceNumber::ToFit { "Δ fit" } else { "mm" },
                name: format!("{name} of source {number_of}").leak(),
                tip,
                sort: SortKey::Source(slot, number),
                width: 48.0,
                right: true,
            }
        };
        [
            of(
                SourceNumber::Error,
                "",
                "MAJPE",
                "MAJPE of the source of predictions against the truth, mm, over the joints in common.",
            ),
            of(
                SourceNumber::AlignedError,
                "_pa",
                "PA-MAJPE",
                "PA-MAJPE of the source of predictions, mm: after rotation, translation and scale of each person.",
            ),
            of(
                SourceNumber::ToFit,
                "_fit",
                "Distance from the fit",
                "Mean distance of the source's joints from the fit's, mm: where network and fit disagree.",
            ),
        ]
    }

    /// Over the column: of a source of predictions its name.
    pub(super) fn title_in(&self, session: &Session) -> Cow<'static, str> {
        match self.sort {
            SortKey::Source(slot, number) => {
                session.sources.get(slot.into()).map_or(Cow::Borrowed(self.title), |source| {
                    Cow::Owned(match number {
                        SourceNumber::ToFit => format!("Δ {}", source.name()),
                        SourceNumber::AlignedError => format!("PA {}", source.name()),
                        SourceNumber::Error => source.name().to_owned(),
                    })
                })
            }
            _ => Cow::Borrowed(self.title),
        }
    }

    /// In full: of a source of predictions with its name.
    pub(super) fn name_in(&self, session: &Session) -> Cow<'static, str> {
        match self.sort {
            SortKey::Source(slot, number) => {
                session.sources.get(slot.into()).map_or(Cow::Borrowed(self.name), |source| {
                    let what = match number {
                        SourceNumber::ToFit => "distance from the fit",
                        SourceNumber::AlignedError => "PA-MAJPE",
                        SourceNumber::Error => "MAJPE",
                    };
                    Cow::Owned(format!("{}, {what}", source.name()))
                })
            }
            _ => Cow::Borrowed(self.name),
        }
    }

    /// Whether it is in the list: what is one of many where it is asked for, the others unless they are not wanted.
    pub(super) fn is_shown(&self, view: &ViewState) -> bool {
        let named = |keys: &[String]| keys.iter().any(|key| key == self.key);
        if self.is_on_request() { named(&view.shown_terms) } else { !named(&view.hidden_columns) }
    }

    /// Whether there is something to say in it: the two result sets only where they are kept, basins where they were sought.
    pub(super) fn has_any(&self, session: &Session) -> bool {
        let kept = |side| session.results.get(side).is_some();
        match self.sort {
            SortKey::BestBasin => !session.best_basins.is_empty(),
            SortKey::ResultA => kept(ResultSide::A),
            SortKey::ResultB => kept(ResultSide::B),
            SortKey::Source(slot, number) => session.sources.get(slot.into()).is_some_and(|source| match number {
                SourceNumber::ToFit => true,
                _ => source.errors.as_ref().is_some_and(|errors| !errors.frames.is_empty()),
            }),
            SortKey::Origin(part) => session.data.dataset.as_ref().is_some_and(|dataset| dataset.tells(part)),
            SortKey::Disagreement => session.sources.list().len() > 1,
            SortKey::Difference => kept(ResultSide::A) && kept(ResultSide::B),
            _ => true,
        }
    }

    /// Takes it into the list, or out of it.
    pub(super) fn show(&self, view: &mut ViewState, on: bool) {
        let on_request = self.is_on_request();
        let keys = if on_request { &mut view.shown_terms } else { &mut view.hidden_columns };
        keys.retain(|key| key != self.key);
        if on == on_request {
            keys.push(self.key.to_owned());
        }
    }

    /// Terms of the loss, the aligned errors of sources, and where frames come from.
    fn is_on_request(&self) -> bool {
        matches!(self.sort, SortKey::Term(_) | SortKey::Origin(_) | SortKey::Source(_, SourceNumber::AlignedError))
    }
}

const COLUMNS: &[Column] = &[
    Column {
        key: "index",
        title: "#",
        name: "Index",
        tip: "Index in the data set, from 0.",
        sort: SortKey::Index,
        width: 36.0,
        right: true,
    },
    Column {
        key: "frame",
        title: "Frame",
        name: "Frame",
        tip: "The frame's name; the whole of it is in the tooltip of a row.",
        sort: SortKey::Index,
        width: 48.0,
        right: false,
    },
    Column {
        key: "stratum",
        title: "S",
        name: "Stratum",
        tip: "Easy, medium or hard: thirds of the data set by hardness.",
        sort: SortKey::Stratum,
        width: 12.0,
        right: false,
    },
    Column {
        key: "hardness",
        title: "Hard",
        name: "Hardness",
        tip: "Mean of the rank-normalised ρ_peak, s_static and 1 − r_human, 0 to 1.",
        sort: SortKey::Hardness,
        width: 30.0,
        right: true,
    },
    Column {
        key: "peaks",
        title: "ρ_peak",
        name: "Peak density",
        tip: "ρ_peak: local maxima above the 95th percentile, divided by the number of cells; in thousandths.",
        sort: SortKey::PeakDensity,
        width: 44.0,
        right: true,
    },
    Column {
        key: "static",
        title: "s_static",
        name: "Static dominance",
        tip: "s_static: share of the strongest 5 % of cells that were so in each of the last 5 frames of the sequence; \
              undefined (–) for the first 4.",
        sort: SortKey::StaticDominance,
        width: 48.0,
        right: true,
    },
    Column {
        key: "saliency",
        title: "r_human",
        name: "Human saliency",
        tip: "r_human: share of the map's sum that lies in its strongest 10 % of cells.",
        sort: SortKey::HumanSaliency,
        width: 50.0,
        right: true,
    },
    Column {
        key: "iou",
        title: "IoU",
        name: "IoU",
        tip: "Mean forward-consistency IoU of the frame's newest fit.",
        sort: SortKey::Iou,
        width: 27.0,
        right: true,
    },
    Column {
        key: "converged",
        title: "C",
        name: "Criterion",
        tip: "The paper's convergence criterion: ✓ it holds, ✕ it does not. It says nothing of how well the echo is explained: that is the IoU.",
        sort: SortKey::Converged,
        width: 14.0,
        right: false,
    },
    Column {
        key: "reason",
        title: "Ended",
        name: "Reason",
        tip: "Why the last run of the fit ended.",
        sort: SortKey::Converged,
        width: 96.0,
        right: false,
    },
    Column {
        key: "tags",
        title: "Tags",
        name: "Tags",
        tip: "Tags that have been given, those of others faint; in agreement mode only your own.",
        sort: SortKey::Tags,
        width: 34.0,
        right: false,
    },
    Column {
        key: "majpe",
        title: "mm",
        name: "MAJPE",
        tip: "MAJPE in mm, where the data set has joints in metres.",
        sort: SortKey::Majpe,
        width: 24.0,
        right: true,
    },
    Column {
        key: "basin",
        title: "Basin",
        name: "Best basin",
        tip: "Share of starts whose fits end in the best basin, where a restart cloud was made of the frame: 100 % is a frame \
              that every start finds alike.",
        sort: SortKey::BestBasin,
        width: 36.0,
        right: true,
    },
    Column {
        key: "a",
        title: "A",
        name: "Results A",
        tip: "What the results kept as A say; the menu “A | B” says which number.",
        sort: SortKey::ResultA,
        width: 34.0,
        right: true,
    },
    Column {
        key: "b",
        title: "B",
        name: "Results B",
        tip: "What the results kept as B say.",
        sort: SortKey::ResultB,
        width: 34.0,
        right: true,
    },
    Column {
        key: "difference",
        title: "B − A",
        name: "Difference of results",
        tip: "B − A, green where B is the better fit.",
        sort: SortKey::Difference,
        width: 38.0,
        right: true,
    },
    Column {
        key: "disagree",
        title: "Disagree",
        name: "Disagreement",
        tip: "The largest distance between a source of predictions and the fit, mm; a filter asks for disagree>100.",
        sort: SortKey::Disagreement,
        width: 52.0,
        right: true,
    },
    Column {
        key: "by",
        title: "By",
        name: "Annotator",
        tip: "Who labelled the frame.",
        sort: SortKey::Annotator,
        width: 64.0,
        right: false,
    },
];

/// A number with `digits`, or a dash where it is not known.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".into(), |x| format!("{x:.digits$}"))
}

/// Text and colour of a cell.
fn text(column: &Column, row: &FrameRow<'_>, compared: ComparedNumber, tokens: &Tokens) -> (String, Color32) {
    let dim = |text: String| (text, tokens.dim);
    let fitted = row.iterations.is_some();
    if let SortKey::Term(term) = column.sort {
        let value = row.number(FrameNumber::Term(term));
        return (value.map_or_else(String::new, |x| format!("{x:.4}")), tokens.text);
    }
    if let SortKey::Source(slot, number) = column.sort {
        let value = row.sources.get(usize::from(slot)).and_then(|(_, numbers)| numbers.get(number));
        return (value.map_or_else(String::new, |mm| format!("{mm:.0}")), tokens.text);
    }
    if let SortKey::Origin(part) = column.sort {
        return dim(row.origin.part(part).unwrap_or_default().to_owned());
    }
    match column.key {
        "disagree" => (row.disagreement_mm().map_or_else(String::new, |mm| format!("{mm:.0}")), tokens.text),
        "index" => dim(row.index.to_string()),
        "frame" => {
            let short = row.name.rsplit('/').next().unwrap_or(row.name);
            (short.to_owned(), if row.readable { tokens.text } else { tokens.bad })
        }
        "hardness" => (number(row.hardness, 2), tokens.text),
        "peaks" => dim(number(row.peak_density.map(|x| x * 1000.0), 2)),
        "static" => dim(number(row.static_dominance, 2)),
        "saliency" => dim(number(row.human_saliency, 2)),
        "iou" => match row.iou {
            Some(iou) => (format!("{iou:.2}"), iou_color(tokens, iou)),
            None => dim(if fitted { "–".into() } else { String::new() }),
        },
        "converged" => match row.converged {
            Some(true) => dim("✓".into()),
            Some(false) => ("✕".into(), tokens.warn),
            None => dim(String::new()),
        },
        "reason" => dim(row.reason.unwrap_or_default().to_owned()),
        "majpe" => (row.majpe_mm.map_or_else(String::new, |mm| format!("{mm:.0}")), tokens.text),
        "basin" => (row.best_basin.map_or_else(String::new, |share| format!("{:.0} %", 100.0 * share)), tokens.text),
        "a" => (row.results[0].map_or_else(String::new, |x| compared.text(x)), tokens.text),
        "b" => (row.results[1].map_or_else(String::new, |x| compared.text(x)), tokens.text),
        "difference" => match row.number(FrameNumber::Difference) {
            Some(x) => {
                let better = (x > 0.0) == compared.larger_is_better() && x != 0.0;
                let color = if x == 0.0 {
                    tokens.dim
                } else if better {
                    tokens.ok
                } else {
                    tokens.bad
                };
                (format!("{}{}", if x > 0.0 { "+" } else { "" }, compared.text(x)), color)
            }
            None => dim(String::new()),
        },
        "by" => dim(row.annotators.join(", ")),
        _ => dim(String::new()),
    }
}

/// Draws a cell into `rect`.
pub(super) fn cell(
    painter: &Painter,
    rect: Rect,
    column: &Column,
    row: &FrameRow<'_>,
    compared: ComparedNumber,
    tokens: &Tokens,
) {
    let painter = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    let y = rect.center().y;
    match column.key {
        "stratum" => {
            let Some(stratum) = row.stratum else { return };
            let font = theme::strong(theme::CAPTION);
            let letter = stratum.letter();
            painter.text(pos2(rect.center().x, y), Align2::CENTER_CENTER, letter, font, tokens.stratum(stratum));
        }
        "tags" => {
            let mut x = rect.left();
            let font = || FontId::proportional(theme::CAPTION);
            if let Some(verdict) = row.verdict {
                let short = match verdict {
                    Verdict::AnnotationError => "annot. err",
                    Verdict::DetectionError => "detect. err",
                    Verdict::BothIncorrect => "both err",
                    Verdict::TrueNegative => "true neg.",
                };
                x = painter.text(pos2(x, y), Align2::LEFT_CENTER, short, font(), tokens.text).right() + 4.0;
            }
            for tag in row.tags.iter() {
                let fade = if row.own_tags.contains(tag) { 1.0 } else { 0.45 };
                let color = tokens.tag(tag).gamma_multiply(fade);
                x = painter.text(pos2(x, y), Align2::LEFT_CENTER, tag.code(), font(), color).right() + 4.0;
            }
        }
        _ => {
            let (text, color) = text(column, row, compared, tokens);
            let font = if column.right { theme::mono(theme::CAPTION) } else { FontId::proportional(12.0) };
            let (at, align) = if column.right {
                (pos2(rect.right(), y), Align2::RIGHT_CENTER)
            } else {
                (pos2(rect.left(), y), Align2::LEFT_CENTER)
            };
            let galley = painter.layout_no_wrap(text.clone(), font.clone(), color);
            if column.key == "frame" && galley.size().x > rect.width() {
                tail(&painter, rect, &text, &font, color);
            } else {
                painter.galley(align.anchor_size(at, galley.size()).min, galley, color);
            }
        }
    }
}

/// As much of the end of a name as has room: frames of a sequence begin alike.
fn tail(painter: &Painter, rect: Rect, text: &str, font: &FontId, color: Color32) {
    let mut rest = text.chars();
    let mut galley = painter.layout_no_wrap(String::new(), font.clone(), color);
    while rest.next().is_some() {
        galley = painter.layout_no_wrap(format!("…{}", rest.as_str()), font.clone(), color);
        if galley.size().x <= rect.width() {
            break;
        }
    }
    painter.galley(Align2::LEFT_CENTER.anchor_size(rect.left_center(), galley.size()).min, galley, color);
}

/// What a screen reader says of a row besides its name.
pub(super) fn spoken(row: &FrameRow<'_>) -> String {
    let mut parts = Vec::new();
    parts.extend(row.stratum.map(|stratum| stratum.word().to_owned()));
    parts.extend(row.iou.map(|iou| format!("IoU {iou:.2}")));
    parts.extend(row.converged.map(|yes| if yes { "criterion holds" } else { "criterion open" }.to_owned()));
    for (name, numbers) in &row.sources {
        parts.extend(numbers.majpe_mm.map(|mm| format!("{name} {mm:.0} mm")));
        parts.extend(numbers.to_fit_mm.map(|mm| format!("{name} {mm:.0} mm from the fit")));
    }
    if !row.tags.is_empty() {
        parts.push(format!("tagged {}", row.tags));
    }
    parts.extend(row.verdict.map(|verdict| format!("verdict {verdict}")));
    parts.join(", ")
}

#[cfg(all(test, feature = "dummies"))]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

    use super::*;
    use crate::mhp::Terms;

    #[test]
    fn the_dummy_term_has_a_column_for_who_asks() {
        let column = columns().find(|column| column.key == "dummy").unwrap();
        let mut view = ViewState::default();
        assert!(!column.is_shown(&view));
        column.show(&mut view, true);
        assert!(column.is_shown(&view));
        let terms = Terms::from_fn(|term| (term.key == "dummy").then_some(0.7));
        let row = FrameRow { terms: Some(&terms), ..FrameRow::default() };
        assert_eq!(text(column, &row, ComparedNumber::Iou, &crate::app::theme::DARK).0, "0.7000");
        column.show(&mut view, false);
        assert_eq!(view, ViewState::default());
    }
}
