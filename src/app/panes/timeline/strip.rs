//! The strip over all frames: one column a pixel, each the sum of the frames that fall on it.
//!
//! The sums are made again only when what they show changed, so that 100,000 frames cost as much as a hundred.

use crate::app::theme::Tokens;
use crate::app::widgets::iou_color;
use crate::labels::{Tag, Tags};
use crate::session::{LabelMode, Session, StrataStatus, Strip};
use crate::study::complexity::Stratum;
use egui::{Align2, Color32, Rect, Ui, pos2, vec2};

/// What falls on one column.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    frames: u32,
    matching: u32,
    strata: [u32; 3],
    iou: (f64, u32),
    tags: Tags,
}

/// What the sums were made from: frames, columns, and the revisions of list, labels, mode, strata and fits.
type Key = (usize, usize, u64, u64, LabelMode, bool, u64);

/// The sums and what they were made from.
#[derive(Default)]
pub(super) struct Strips {
    key: Option<Key>,
    sums: Vec<Sum>,
}

impl Strips {
    pub(super) fn paint(&mut self, ui: &Ui, session: &Session, rect: Rect, tokens: &Tokens) {
        let frames = session.data.len();
        // A frame that is wider than a pixel has a column of its own.
        let columns = frames.min(rect.width().floor().max(1.0) as usize);
        self.update(session, frames, columns);
        let width = rect.width() / columns.max(1) as f32;
        let gap = if width > 4.0 { 1.0 } else { 0.0 };
        let filtered = !session.queue.rule.is_empty();
        for (i, sum) in self.sums.iter().enumerate() {
            let x = rect.left() + i as f32 * width;
            let column = Rect::from_min_max(pos2(x, rect.top() + 2.0), pos2(x + width - gap, rect.bottom() - 2.0));
            let faded = if filtered && sum.matching == 0 { 0.25 } else { 1.0 };
            match session.view.strip {
                Strip::Stratum => strata(ui, column, sum, faded, tokens),
                Strip::Iou => iou(ui, column, sum, faded, tokens),
                Strip::Tags => tags(ui, column, sum, faded, tokens),
            }
        }
    }

    fn update(&mut self, session: &Session, frames: usize, columns: usize) {
        let key = (
            frames,
            columns,
            session.queue.revision,
            session.labels.revision,
            session.view.label_mode,
            session.strata.status == StrataStatus::Ready,
            session.summaries_revision(),
        );
        if self.key == Some(key) {
            return;
        }
        self.key = Some(key);
        self.sums.clear();
        self.sums.resize(columns, Sum::default());
        let column = |frame: usize| (frame * columns / frames.max(1)).min(columns.saturating_sub(1));
        for frame in 0..frames {
            let Some(sum) = self.sums.get_mut(column(frame)) else { continue };
            sum.frames += 1;
            if let Some(stratum) = session.strata.of(frame).and_then(|complexity| complexity.stratum) {
                sum.strata[stratum as usize] += 1;
            }
        }
        for &frame in session.queue.matching() {
            if let Some(sum) = self.sums.get_mut(column(frame as usize)) {
                sum.matching += 1;
            }
        }
        for (&frame, summary) in &session.summaries {
            if let (Some(sum), Some(iou)) = (self.sums.get_mut(column(frame)), summary.iou) {
                sum.iou = (sum.iou.0 + iou, sum.iou.1 + 1);
            }
        }
        for (frame, tags) in session.labels.seen(session.view.label_mode).flat_map(|(_, records)| records.said_tags()) {
            if let Some(sum) = self.sums.get_mut(column(frame)) {
                sum.tags = sum.tags.union(tags);
            }
        }
    }
}

/// Height and colour say how hard: a third, two thirds, all of the height; where a column has several frames, each stratum
/// has its share of the height, the hardest below.
fn strata(ui: &Ui, column: Rect, sum: &Sum, faded: f32, tokens: &Tokens) {
    let graded: u32 = sum.strata.iter().sum();
    let all = [Stratum::Easy, Stratum::Medium, Stratum::Hard];
    if sum.frames == 1 {
        let Some(stratum) = all.into_iter().find(|&stratum| sum.strata[stratum as usize] > 0) else { return };
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
        let height = column.height() * sum.strata[stratum as usize] as f32 / graded.max(1) as f32;
        let part = Rect::from_min_max(pos2(column.left(), bottom - height), pos2(column.right(), bottom));
        ui.painter().rect_filled(part, 0.0, tokens.stratum(stratum).gamma_multiply(0.75 * faded));
        bottom -= height;
    }
}

/// Mean IoU: height and colour say the same.
fn iou(ui: &Ui, column: Rect, sum: &Sum, faded: f32, tokens: &Tokens) {
    if sum.iou.1 > 0 {
        let mean = sum.iou.0 / f64::from(sum.iou.1);
        bar(ui, column, (mean as f32).clamp(0.08, 1.0), iou_color(tokens, mean).gamma_multiply(faded));
    }
}

/// One row a tag, in the order of the digits from the top.
fn tags(ui: &Ui, column: Rect, sum: &Sum, faded: f32, tokens: &Tokens) {
    let height = column.height() / Tag::ALL.len() as f32;
    for (i, tag) in Tag::ALL.into_iter().enumerate().filter(|(_, tag)| sum.tags.contains(*tag)) {
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
