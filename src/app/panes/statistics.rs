//! Counts of labels: tags by stratum, by scene or by day, for one annotator or all.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::CTRL;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::labels::Tag;
use crate::session::{LabelMode, Records, Session};
use egui::{Key, RichText, Role, Sense, Ui, vec2};
use std::collections::BTreeMap;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Statistics",
    title: "Statistics",
    help: "how often each tag was given",
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
}

impl PaneState for State {}

type MadeFrom = (u64, Group, Option<String>, bool, LabelMode);

struct Row {
    name: String,
    /// Frames of the group, where that is known.
    frames: Option<usize>,
    /// Frames, sorted, each once: two annotators may have labelled the same one.
    labelled: Vec<usize>,
    tags: [usize; Tag::ALL.len()],
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Tag frames with the keys 1 to 5 and 0. Here you then see how often each tag was given, by stratum, by \
               scene and by day.";
    session.labels.table().values().all(Records::is_empty).then(|| Blank::new("No labels yet", how))
}

fn show(ui: &mut Ui, shared: &Shared<'_>, state: &mut State) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    let graded = session.strata.result().is_some();
    let key = (session.labels.revision(), state.group, state.annotator.clone(), graded, session.view.label_mode);
    if state.rows.as_ref().is_none_or(|(known, _)| *known != key) {
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
        let row = groups.entry((place, name)).or_insert_with(|| Row {
            frames: frames_of(session, group, name),
            name: name.to_owned(),
            labelled: Vec::new(),
            tags: [0; Tag::ALL.len()],
        });
        row.labelled.push(frame);
        for (count, tag) in row.tags.iter_mut().zip(Tag::ALL) {
            *count += usize::from(tags.contains(tag));
        }
    }
    let mut rows: Vec<Row> = groups.into_values().collect();
    let mut all =
        Row { name: "all".into(), frames: Some(session.data.len()), labelled: Vec::new(), tags: [0; Tag::ALL.len()] };
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

/// The group's place in the table, and its name.
fn name_of<'a>(session: &'a Session, group: Group, frame: usize, records: &'a Records) -> (usize, &'a str) {
    match group {
        Group::Stratum => match session.strata.of(frame).and_then(|complexity| complexity.stratum) {
            Some(stratum) => (stratum as usize, stratum.word()),
            None => (9, "not graded"),
        },
        Group::Scene => (0, session.data.dataset.as_ref().map_or("", |dataset| dataset.sequence(frame))),
        Group::Day => (0, records.get(frame).and_then(|record| record.time.get(..10)).unwrap_or("unknown")),
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
    egui::Grid::new("statistics").num_columns(2 + Tag::ALL.len()).spacing([12.0, 4.0]).show(ui, |ui| {
        ui.label("");
        ui.label(RichText::new("labelled").small().color(tokens.dim));
        for tag in Tag::ALL {
            ui.label(RichText::new(tag.code()).small().color(tokens.tag(tag))).on_hover_text(tag.words());
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
            ui.end_row();
        }
    });
}
