//! Counts by stratum, by scene or by day: tags of one annotator or all, and what the fits in the list come to.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::CTRL;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _, iou_color};
use crate::labels::Tag;
use crate::session::{FrameSummary, LabelMode, Records, Session};
use egui::{Key, RichText, Role, Sense, Ui, vec2};
use std::collections::BTreeMap;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Statistics",
    title: "Statistics",
    icon: &[Mark::Bar([2.0, 8.5, 5.0, 14.0]), Mark::Bar([6.5, 2.5, 9.5, 14.0]), Mark::Bar([11.0, 6.0, 14.0, 14.0])],
    help: "how often each tag was given, and what the fits come to",
    dock: Dock::Centre,
    keys: &[(CTRL, Key::Num4)],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| controls(ui, shared.session, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// What the rows are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Group {
    #[default]
    Stratum,
    Scene,
    Day,
}

/// How the counts are grouped, whose they are, and what they were made from.
#[derive(Default)]
struct State {
    group: Group,
    /// `None` for everybody.
    annotator: Option<String>,
    rows: Option<(MadeFrom, Vec<Row>)>,
    /// The fits that the rows were made from, and when, s.
    fits: (u64, f64),
}

impl PaneState for State {}

/// While a batch runs its sums are made again so often, s.
const FITS_EVERY_S: f64 = 1.0;

type MadeFrom = (u64, Group, Option<String>, bool, LabelMode);

struct Row {
    name: String,
    /// Frames of the group, where that is known.
    frames: Option<usize>,
    /// Frames, sorted, each once: two annotators may have labelled the same one.
    labelled: Vec<usize>,
    tags: [usize; Tag::ALL.len()],
    fits: FitSums,
}

/// What the fits of a group come to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct FitSums {
    fitted: usize,
    /// Sum, and of how many.
    iou: (f64, usize),
    majpe_mm: (f64, usize),
}

impl FitSums {
    fn take(&mut self, summary: &FrameSummary) {
        let add = |sum: &mut (f64, usize), value: Option<f64>| {
            if let Some(value) = value {
                *sum = (sum.0 + value, sum.1 + 1);
            }
        };
        self.fitted += usize::from(summary.loss.is_some());
        add(&mut self.iou, summary.iou);
        add(&mut self.majpe_mm, summary.majpe_mm);
    }

    fn join(&mut self, other: &Self) {
        let sum = |a: (f64, usize), b: (f64, usize)| (a.0 + b.0, a.1 + b.1);
        self.fitted += other.fitted;
        (self.iou, self.majpe_mm) = (sum(self.iou, other.iou), sum(self.majpe_mm, other.majpe_mm));
    }
}

impl Row {
    fn new(name: &str, frames: Option<usize>) -> Self {
        let (labelled, tags) = (Vec::new(), [0; Tag::ALL.len()]);
        Self { name: name.to_owned(), frames, labelled, tags, fits: FitSums::default() }
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Tag frames with the keys 1 to 5 and 0, or fit them with Ctrl+Enter. Here you then see how often each tag was \
               given and what the fits come to, by stratum and by scene.";
    let none = session.labels.table().values().all(Records::is_empty) && session.summaries.is_empty();
    none.then(|| Blank::new("No labels and no fits yet", how))
}

fn show(ui: &mut Ui, shared: &Shared<'_>, state: &mut State) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    let graded = session.strata.result().is_some();
    let key = (session.labels.revision(), state.group, state.annotator.clone(), graded, session.view.label_mode);
    let (fits, now) = (session.summaries.revision(), ui.input(|i| i.time));
    let wait = if session.batch.is_running() { state.fits.1 + FITS_EVERY_S - now } else { 0.0 };
    let stale = state.fits.0 != fits;
    if stale && wait > 0.0 {
        ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(wait));
    }
    if state.rows.as_ref().is_none_or(|(known, _)| *known != key) || (stale && wait <= 0.0) {
        state.fits = (fits, now);
        state.rows = Some((key, rows(session, state.group, state.annotator.as_deref())));
    }
    let Some((_, rows)) = &state.rows else { return };
    egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| table(ui, rows, &tokens));
}

fn controls(ui: &mut Ui, session: &Session, state: &mut State) {
    ui.horizontal(|ui| {
        for (group, word) in [(Group::Stratum, "By stratum"), (Group::Scene, "By scene"), (Group::Day, "Over time")] {
            ui.selectable_value(&mut state.group, group, RichText::new(word).small());
        }
        let text = state.annotator.clone().unwrap_or_else(|| "everybody".into());
        let menu = egui::ComboBox::from_id_salt("whose").width(100.0).selected_text(text).show_ui(ui, |ui| {
            ui.selectable_value(&mut state.annotator, None, "everybody");
            for (name, _) in session.labels.seen(session.view.label_mode) {
                ui.selectable_value(&mut state.annotator, Some(name.to_owned()), name);
            }
        });
        menu.response.named(Role::ComboBox, "Whose labels").on_hover_text("Whose labels are counted.");
    });
}

fn rows(session: &Session, group: Group, annotator: Option<&str>) -> Vec<Row> {
    // By names that are borrowed: 100,000 records make a handful of groups.
    let mut groups: BTreeMap<(usize, &str), Row> = BTreeMap::new();
    let seen = session.labels.seen(session.view.label_mode);
    let tables = seen.filter(|(name, _)| annotator.is_none_or(|wanted| wanted == *name));
    for (frame, tags, records) in tables.flat_map(|(_, r)| r.said_tags().map(move |(frame, tags)| (frame, tags, r))) {
        let (place, name) = name_of(session, group, frame, records);
        let row = groups.entry((place, name)).or_insert_with(|| Row::new(name, frames_of(session, group, name)));
        row.labelled.push(frame);
        for (count, tag) in row.tags.iter_mut().zip(Tag::ALL) {
            *count += usize::from(tags.contains(tag));
        }
    }
    let mut all = Row::new("all", Some(session.data.len()));
    for ((place, name), fits) in fits_of(session, group) {
        all.fits.join(&fits);
        if group != Group::Day {
            let row = groups.entry((place, name)).or_insert_with(|| Row::new(name, frames_of(session, group, name)));
            row.fits.join(&fits);
        }
    }
    let mut rows: Vec<Row> = groups.into_values().collect();
    for row in &rows {
        all.labelled.extend(&row.labelled);
        for (sum, count) in all.tags.iter_mut().zip(row.tags) {
            *sum += count;
        }
    }
    rows.push(all);
    for row in &mut rows {
        row.labelled.sort_unstable();
        row.labelled.dedup();
    }
    rows
}

/// What the fits come to, by stretches of frames of one group: frames that follow each other are mostly of one.
fn fits_of(session: &Session, group: Group) -> Vec<((usize, &str), FitSums)> {
    let mut found: Vec<((usize, &str), FitSums)> = Vec::new();
    for (&frame, summary) in session.summaries.iter() {
        let of = place_of(session, group, frame);
        match found.last_mut() {
            Some((last, sums)) if *last == of => sums.take(summary),
            _ => {
                let mut sums = FitSums::default();
                sums.take(summary);
                found.push((of, sums));
            }
        }
    }
    found
}

/// The place in the table and the name of the group that a label is in.
fn name_of<'a>(session: &'a Session, group: Group, frame: usize, records: &'a Records) -> (usize, &'a str) {
    if group == Group::Day {
        return (0, records.get(frame).and_then(|record| record.time.get(..10)).unwrap_or("unknown"));
    }
    place_of(session, group, frame)
}

/// The place in the table and the name of the group that a frame is in; none by day, for fits have no date.
fn place_of(session: &Session, group: Group, frame: usize) -> (usize, &str) {
    match group {
        Group::Stratum => match session.strata.of(frame).and_then(|complexity| complexity.stratum) {
            Some(stratum) => (stratum as usize, stratum.word()),
            None => (9, "not graded"),
        },
        Group::Scene => (0, session.data.dataset.as_ref().map_or("", |dataset| dataset.sequence(frame))),
        Group::Day => (0, ""),
    }
}

fn frames_of(session: &Session, group: Group, name: &str) -> Option<usize> {
    use crate::study::complexity::Stratum;
    session.strata.result()?;
    let stratum = Stratum::ALL.into_iter().find(|stratum| group == Group::Stratum && stratum.word() == name)?;
    Some(session.strata.count(stratum))
}

fn table(ui: &mut Ui, rows: &[Row], tokens: &Tokens) {
    let most = rows.iter().rev().skip(1).flat_map(|row| row.tags).max().unwrap_or(1).max(1);
    let with_fits = rows.iter().any(|row| row.fits.fitted > 0);
    let columns = if with_fits { FIT_COLUMNS.len() } else { 0 };
    egui::Grid::new("statistics").num_columns(2 + Tag::ALL.len() + columns).spacing([12.0, 4.0]).show(ui, |ui| {
        ui.label("");
        ui.label(RichText::new("labelled").small().color(tokens.dim));
        for tag in Tag::ALL {
            ui.label(RichText::new(tag.code()).small().color(tokens.tag(tag))).on_hover_text(tag.words());
        }
        for (title, tip) in &FIT_COLUMNS[..columns] {
            ui.label(RichText::new(*title).small().color(tokens.dim)).on_hover_text(*tip);
        }
        ui.end_row();
        for row in rows {
            let total = row.name == "all";
            let name = RichText::new(&row.name);
            ui.label(if total { name.font(theme::strong(12.0)) } else { name });
            let of = row.frames.map_or_else(String::new, |frames| format!(" of {frames}"));
            ui.label(RichText::new(format!("{}{of}", row.labelled.len())).font(theme::mono(theme::CAPTION)));
            for (tag, count) in Tag::ALL.into_iter().zip(row.tags) {
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = 4.0;
                    let text = RichText::new(format!("{count:>3}")).font(theme::mono(theme::CAPTION));
                    ui.label(if count == 0 { text.color(tokens.dim) } else { text });
                    if !total {
                        let (rect, _) = ui.allocate_exact_size(vec2(24.0, 8.0), Sense::hover());
                        let share = count as f32 / most as f32;
                        let bar = egui::Rect::from_min_size(rect.min, vec2(rect.width() * share, rect.height()));
                        ui.painter().rect_filled(bar, 1.0, tokens.tag(tag));
                    }
                });
            }
            if with_fits {
                fitted(ui, row, tokens);
            }
            ui.end_row();
        }
    });
}

/// Titles of what is said of fits, and what they mean.
const FIT_COLUMNS: [(&str, &str); 3] = [
    ("fitted", "Frames with a fit in the list: of this session, of a batch, or of a table of results."),
    ("IoU", "Mean forward-consistency IoU of these fits."),
    ("MAJPE, mm", "Mean absolute joint position error of these fits, where the data set has joints in metres."),
];

fn fitted(ui: &mut Ui, row: &Row, tokens: &Tokens) {
    let mean = |(sum, count): (f64, usize)| (count > 0).then(|| sum / count as f64);
    let FitSums { fitted, iou, majpe_mm } = row.fits;
    let (iou, mm) = (mean(iou), mean(majpe_mm));
    let number = |text: String, color| RichText::new(text).font(theme::mono(theme::CAPTION)).color(color);
    ui.label(number(fitted.to_string(), if fitted == 0 { tokens.dim } else { tokens.text }));
    ui.label(iou.map_or_else(|| number("–".into(), tokens.dim), |x| number(format!("{x:.3}"), iou_color(tokens, x))));
    ui.label(mm.map_or_else(|| number("–".into(), tokens.dim), |x| number(format!("{x:.0}"), tokens.text)));
}
