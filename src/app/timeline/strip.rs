//! The strip over all frames: one column a pixel, each the sum of the frames that fall on it.
//!
//! The sums are made again only when what they are made from changed, so that 100,000 frames cost as much as a hundred.

use crate::app::theme::Tokens;
use crate::app::widgets::iou_color;
use crate::labels::{Tag, Tags};
use crate::session::{LabelMode, Session, StrataStatus, TimelineStrip};
use crate::study::complexity::Stratum;
use egui::{Align2, Color32, Rect, Ui, pos2, vec2};

/// The distance between predictions and fits that the height of the strip stands for, mm.
const WHOLE_MM: f64 = 300.0;

/// Frames and columns.
type Size = (usize, usize);

/// What falls on each column, and what it was made from.
struct Lane<K, T> {
    key: Option<K>,
    sums: Vec<T>,
}

impl<K, T> Default for Lane<K, T> {
    fn default() -> Self {
        Self { key: None, sums: Vec::new() }
    }
}

impl<K: PartialEq, T: Clone + Default> Lane<K, T> {
    /// Makes the sums again where the key changed; `add` is given a column's sum for each of `values`.
    fn update<V>(
        &mut self,
        (frames, columns): Size,
        key: K,
        values: impl IntoIterator<Item = (usize, V)>,
        add: impl Fn(&mut T, V),
    ) {
        if self.key.as_ref() == Some(&key) {
            return;
        }
        self.key = Some(key);
        self.sums.clear();
        self.sums.resize(columns, T::default());
        for (frame, value) in values {
            let column = (frame * columns / frames.max(1)).min(columns.saturating_sub(1));
            if let Some(sum) = self.sums.get_mut(column) {
                add(sum, value);
            }
        }
    }

    fn at(&self, column: usize) -> T {
        self.sums.get(column).cloned().unwrap_or_default()
    }
}

/// Sums of what can be shown; each is made again only when its own source changed.
#[derive(Default)]
pub(super) struct Strips {
    /// Frames that match the filter.
    matching: Lane<(Size, u64), u32>,
    /// Frames of each stratum, and of none.
    strata: Lane<(Size, bool), [u32; 4]>,
    /// Sum of IoU, and of how many.
    iou: Lane<(Size, u64), (f64, u32)>,
    /// Every tag that is seen.
    tags: Lane<(Size, u64, LabelMode), Tags>,
    /// Sum of distances between predictions and fits, or truth, mm, and of how many.
    apart: Lane<(Size, [u64; 2]), (f64, u32)>,
    off: Lane<(Size, u64), (f64, u32)>,
}

impl Strips {
    pub(super) fn paint(&mut self, ui: &Ui, session: &Session, rect: Rect, tokens: &Tokens) {
        let frames = session.data.len();
        // A frame that is wider than a pixel has a column of its own.
        let columns = frames.min(rect.width().floor().max(1.0) as usize);
        self.update(session, (frames, columns));
        let width = rect.width() / columns.max(1) as f32;
        let gap = if width > 4.0 { 1.0 } else { 0.0 };
        let filtered = !session.queue.filter.is_empty();
        for i in 0..columns {
            let x = rect.left() + i as f32 * width;
            let column = Rect::from_min_max(pos2(x, rect.top() + 2.0), pos2(x + width - gap, rect.bottom() - 2.0));
            let faded = if filtered && self.matching.at(i) == 0 { 0.25 } else { 1.0 };
            match session.view.strip {
                TimelineStrip::Stratum => strata(ui, column, self.strata.at(i), faded, tokens),
                TimelineStrip::Iou => iou(ui, column, self.iou.at(i), faded, tokens),
                TimelineStrip::Disagreement => apart(ui, column, self.apart.at(i), faded, tokens),
                TimelineStrip::PredictionError => apart(ui, column, self.off.at(i), faded, tokens),
                TimelineStrip::Tags => tags(ui, column, self.tags.at(i), faded, tokens),
            }
        }
    }

    /// Brings what is shown up to date, and what tells the frames that match.
    fn update(&mut self, session: &Session, size: Size) {
        let matching = session.queue.matching().iter().map(|&frame| (frame as usize, ()));
        self.matching.update(size, (size, session.queue.revision), matching, |sum, ()| *sum += 1);
        match session.view.strip {
            TimelineStrip::Stratum => {
                let of = |frame| session.strata.of(frame).and_then(|complexity| complexity.stratum);
                let strata = (0..size.0).map(|frame| (frame, of(frame).map_or(3, |stratum| stratum as usize)));
                let key = (size, session.strata.status == StrataStatus::Ready);
                self.strata.update(size, key, strata, |sum, stratum| sum[stratum] += 1);
            }
            TimelineStrip::Iou => {
                let known = session.summaries.iter().filter_map(|(&frame, summary)| Some((frame, summary.iou?)));
                let key = (size, session.summaries.revision());
                self.iou.update(size, key, known, |sum, iou| *sum = (sum.0 + iou, sum.1 + 1));
            }
            TimelineStrip::Disagreement => {
                let known =
                    session.summaries.keys().filter_map(|&frame| Some((frame, session.disagreement_mm(frame)?)));
                let key = (size, [session.sources.revision(), session.summaries.revision()]);
                self.apart.update(size, key, known, |sum, mm| *sum = (sum.0 + mm, sum.1 + 1));
            }
            TimelineStrip::PredictionError => {
                // Made only where something changed.
                let known = std::iter::once(()).flat_map(|()| session.prediction_errors_mm());
                let key = (size, session.sources.revision());
                self.off.update(size, key, known, |sum, mm| *sum = (sum.0 + mm, sum.1 + 1));
            }
            TimelineStrip::Tags => {
                let mode = session.view.label_mode;
                let seen = session.labels.seen(mode).flat_map(|(_, records)| records.said_tags());
                self.tags
                    .update(size, (size, session.labels.revision(), mode), seen, |sum, tags| *sum = sum.union(tags));
            }
        }
    }
}

/// Height and colour say how hard: a third, two thirds, all of the height; where a column has several frames, each stratum
/// has its share of the height, the hardest below.
fn strata(ui: &Ui, column: Rect, [easy, medium, hard, none]: [u32; 4], faded: f32, tokens: &Tokens) {
    let counts = [easy, medium, hard];
    let graded: u32 = counts.iter().sum();
    let all = [Stratum::Easy, Stratum::Medium, Stratum::Hard];
    if graded + none == 1 {
        let Some(stratum) = all.into_iter().find(|&stratum| counts[stratum as usize] > 0) else { return };
        let color = tokens.stratum(stratum).gamma_multiply(0.6 * faded);
        bar(ui, column, (stratum as usize + 1) as f32 / 3.0, color);
        if column.width() >= 14.0 {
            let font = egui::FontId::proportional(10.0);
            ui.painter().text(column.center_top(), Align2::CENTER_TOP, stratum.letter(), font, tokens.text);
        }
        return;
    }
    let mut bottom = column.bottom();
    for stratum in all.into_iter().rev() {
        let height = column.height() * counts[stratum as usize] as f32 / graded.max(1) as f32;
        let part = Rect::from_min_max(pos2(column.left(), bottom - height), pos2(column.right(), bottom));
        ui.painter().rect_filled(part, 0.0, tokens.stratum(stratum).gamma_multiply(0.75 * faded));
        bottom -= height;
    }
}

/// Mean IoU: height and colour say the same.
fn iou(ui: &Ui, column: Rect, (sum, count): (f64, u32), faded: f32, tokens: &Tokens) {
    if count > 0 {
        let mean = sum / f64::from(count);
        bar(ui, column, (mean as f32).clamp(0.08, 1.0), iou_color(tokens, mean).gamma_multiply(faded));
    }
}

/// Mean distance between predictions and fits or truth: height and colour say the same.
fn apart(ui: &Ui, column: Rect, (sum, count): (f64, u32), faded: f32, tokens: &Tokens) {
    if count > 0 {
        let share = (sum / f64::from(count) / WHOLE_MM).clamp(0.0, 1.0);
        bar(ui, column, (share as f32).max(0.06), iou_color(tokens, 1.0 - share).gamma_multiply(faded));
    }
}

/// One row a tag, in the order of the digits from the top.
fn tags(ui: &Ui, column: Rect, given: Tags, faded: f32, tokens: &Tokens) {
    let height = column.height() / Tag::ALL.len() as f32;
    for (i, tag) in Tag::ALL.into_iter().enumerate().filter(|(_, tag)| given.contains(*tag)) {
        let top = column.top() + i as f32 * height;
        let mark = Rect::from_min_size(pos2(column.left(), top), vec2(column.width().max(2.0), height - 0.5));
        ui.painter().rect_filled(mark, 0.0, tokens.tag(tag).gamma_multiply(faded));
    }
}

fn bar(ui: &Ui, column: Rect, share: f32, color: Color32) {
    let top = column.bottom() - share * column.height();
    let rect =
        Rect::from_min_max(pos2(column.left(), top), pos2(column.right().max(column.left() + 1.0), column.bottom()));
    ui.painter().rect_filled(rect, 0.0, color);
}
