//! Predictions of others beside truth and fit: a row a source, on this frame and over all, and each joint's error. The colour before a
//! name is the one it is drawn in, to be changed by a click.

use super::{Blank, Dock, Pane, PaneStates, Shared};
use crate::app::commands::{AppAct, CommandRow, Menu, UiAction};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::geometry::Vec3;
use crate::predictions::{Colour, Comparison, SourceRow};
use crate::session::{Command, Session, Sort, SortKey, Source, frame_rows};
use egui::{Color32, RichText, Role, Ui, vec2};

/// The pane.
pub(in crate::app) static PANE: Pane = Pane {
    key: "Predictions",
    title: "Predictions",
    icon: &[
        Mark::Line(&[[3.5, 2.5], [3.5, 8.0], [1.5, 14.0]]),
        Mark::Line(&[[3.5, 8.0], [6.0, 14.0]]),
        Mark::Line(&[[11.5, 2.5], [11.5, 8.0], [9.5, 14.0]]),
        Mark::Line(&[[11.5, 8.0], [14.5, 14.0]]),
    ],
    help: "joints of networks and earlier runs beside truth and fit",
    dock: Dock::BottomHigh,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<()>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, _| show(ui, shared),
};

/// Asks for a file of predictions.
pub(in crate::app) const OPEN: CommandRow = CommandRow {
    label: "Open predictions…",
    title: None,
    tooltip: "Show joints that a network or an earlier run predicts beside fit and truth: npz, npy, CSV, JSON, Parquet, or the \
              folder of `fit --out`.",
    menu: Menu::File,
    keys: &[],
    enabled: |s| s.data.dataset.is_some(),
    act: |_| UiAction::App(AppAct::OpenPredictions),
};

/// Begins the fit at a prediction.
pub(in crate::app) const START: CommandRow = CommandRow {
    label: "Fit from prediction",
    title: Some(|s| {
        let first = s.sources.list().first().map_or("prediction", |source| source.name());
        format!("Fit from {first}")
    }),
    tooltip: "Begin the fit of this frame at what the first source predicts: refine it by the radar.",
    menu: Menu::Fit,
    keys: &[],
    enabled: |s| s.fit.problem.is_some() && !s.sources.is_empty(),
    act: |_| UiAction::Session(Command::StartFromPredictions(0)),
};

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a file of joints (File > Open predictions…, or drop it here): a network's output or an earlier run's PPPR. It is \
               drawn beside fit and truth, and its errors come into the frame list.";
    session.sources.is_empty().then(|| Blank::new("No predictions", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>) {
    ui.horizontal(|ui| {
        if ui.button(RichText::new("Open…").small()).named(Role::Button, "Open predictions").clicked() {
            shared.app(AppAct::OpenPredictions);
        }
        let by = Sort { key: SortKey::Disagreement, descending: true };
        let on = shared.session.view.sort == by;
        let tip = "List the frames where a source is farthest from the fit first.";
        if ui.selectable_label(on, RichText::new("Sort frames by disagreement").small()).on_hover_text(tip).clicked() {
            shared.send(Command::SetSort(if on { Sort::default() } else { by }));
        }
    });
}

/// The columns after the names: title and what it means.
const COLUMNS: [(&str, &str); 8] = [
    ("people", "People that the source predicts in this frame."),
    ("MAJPE", "Mean distance of its joints from the truth in this frame, people paired best, mm."),
    ("PA-MAJPE", "The same after the best rotation, translation and scale of each person, mm."),
    ("Δ fit", "Mean distance of its joints from those of the fit in this frame, mm."),
    ("frames", "Frames of the data set that it has."),
    ("mean", "MAJPE over these frames, mm."),
    ("mean PA", "PA-MAJPE over these frames, mm."),
    ("joints", "Joints that it has in common with the data set; errors are of these."),
];

fn show(ui: &mut Ui, shared: &mut Shared<'_>) {
    let session = shared.session;
    let (Some(dataset), index) = (&session.data.dataset, session.data.frame_index) else { return };
    let skeleton = &dataset.info().skeleton;
    let joints = skeleton.joints.len();
    let truth = session.data.frame.as_ref().and_then(|frame| frame.truth.as_ref()).map(|truth| truth.joints.as_slice());
    let shown: &[Vec3] = session.shown_positions();
    let fit = (!shown.is_empty()).then_some(shown);
    let rows = frame_rows(&session.sources, index, truth, fit, joints);
    let tokens = Tokens::of(ui);
    egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        table(ui, shared, &rows, &tokens);
        ui.add_space(8.0);
        each_joint(ui, shared.session, &rows, &tokens);
    });
}

fn number(text: String, color: Color32) -> RichText {
    RichText::new(text).font(theme::mono(theme::CAPTION)).color(color)
}

fn right(ui: &mut Ui, text: RichText) {
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| ui.label(text));
}

fn table(ui: &mut Ui, shared: &mut Shared<'_>, rows: &[SourceRow], tokens: &Tokens) {
    let mm = |of: Option<f64>| {
        of.map_or_else(|| number("–".into(), tokens.dim), |mm| number(format!("{mm:.0}"), tokens.text))
    };
    egui::Grid::new("sources").num_columns(COLUMNS.len() + 3).spacing([14.0, 4.0]).show(ui, |ui| {
        ui.label("");
        for (title, tip) in COLUMNS {
            right_titled(ui, title, tip, tokens);
        }
        ui.end_row();
        let session = shared.session;
        for (slot, (source, row)) in session.sources.list().iter().zip(rows).enumerate() {
            let name = source.name();
            ui.horizontal(|ui| {
                swatch(ui, shared, slot, source, tokens);
                let mut on = source.shown;
                let told = format!("{}\n{}", source.predictions.path.display(), source.predictions.notes.join("\n"));
                let tick = ui.checkbox(&mut on, name).on_hover_text(told.trim_end());
                if tick.changed() {
                    shared.send(Command::ShowPredictions(slot, on));
                }
            });
            let errors = |of: &Option<Comparison>| of.as_ref().map(|of| of.errors);
            right(
                ui,
                row.persons.map_or_else(|| number("–".into(), tokens.dim), |n| number(n.to_string(), tokens.text)),
            );
            right(ui, mm(errors(&row.truth).map(|e| e.majpe_mm)));
            right(ui, mm(errors(&row.truth).map(|e| e.pa_majpe_mm)));
            right(ui, mm(errors(&row.fit).map(|e| e.majpe_mm)));
            right(ui, number(source.predictions.len().to_string(), tokens.text));
            let mean = source.errors.as_ref().and_then(|errors| errors.summary.truth.errors());
            right(ui, mm(mean.map(|e| e.majpe_mm)));
            right(ui, mm(mean.map(|e| e.pa_majpe_mm)));
            right(ui, number(source.predictions.map.known.len().to_string(), tokens.text));
            let begin = ui.small_button("Fit from it").named(Role::Button, &format!("Fit from {name}"));
            if begin.on_hover_text("Begin the fit of this frame here: refine it by the radar.").clicked() {
                shared.send(Command::StartFromPredictions(slot));
            }
            let remove = ui.small_button("✕").named(Role::Button, &format!("Remove {name}"));
            if remove.on_hover_text("Take it out of the window; the file stays.").clicked() {
                shared.send(Command::RemovePredictions(slot));
            }
            ui.end_row();
        }
    });
}

fn right_titled(ui: &mut Ui, title: &str, tip: &str, tokens: &Tokens) {
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        ui.label(RichText::new(title).small().color(tokens.dim)).on_hover_text(tip);
    });
}

/// The colour of a source: a click asks for another, a right click takes that of the theme.
fn swatch(ui: &mut Ui, shared: &mut Shared<'_>, slot: usize, source: &Source, tokens: &Tokens) {
    let [mut r, mut g, mut b, _] = tokens.of_source(source).to_array();
    let mut color = [r, g, b];
    ui.spacing_mut().interact_size = vec2(14.0, 12.0);
    let button = ui.color_edit_button_srgb(&mut color).named(Role::ColorWell, &format!("Colour of {}", source.name()));
    let button = button.on_hover_text("Click for another colour; right click for the theme's own.");
    if button.secondary_clicked() {
        shared.send(Command::ColourPredictions(slot, None));
    } else if button.changed() {
        [r, g, b] = color;
        shared.send(Command::ColourPredictions(slot, Some(Colour([r, g, b]))));
    }
}

/// The errors of each joint in this frame, a row a source.
fn each_joint(ui: &mut Ui, session: &Session, rows: &[SourceRow], tokens: &Tokens) {
    let Some(dataset) = &session.data.dataset else { return };
    let skeleton = &dataset.info().skeleton;
    if rows.iter().all(|row| row.truth.is_none() && row.fit.is_none()) {
        return;
    }
    let against = if rows.iter().any(|row| row.truth.is_some()) { "from the truth" } else { "from the fit" };
    ui.label(RichText::new(format!("Distance {against} of each joint in this frame, mm")).small().color(tokens.dim));
    egui::Grid::new("source joints").spacing([10.0, 2.0]).show(ui, |ui| {
        ui.label("");
        for joint in 0..skeleton.joints.len() {
            let whole = skeleton.shown_name(joint);
            let text = number(short(&whole), tokens.dim);
            ui.label(text).on_hover_text(whole);
        }
        ui.end_row();
        for (source, row) in session.sources.list().iter().zip(rows) {
            ui.label(RichText::new(source.name()).small().color(tokens.of_source(source)));
            let of = row.truth.as_ref().or(row.fit.as_ref());
            for joint in 0..skeleton.joints.len() {
                let known = of.and_then(|of| of.joints_mm.iter().find(|(k, _)| *k == joint)).map(|(_, mm)| *mm);
                right(
                    ui,
                    known.map_or_else(|| number("–".into(), tokens.dim), |mm| number(format!("{mm:.0}"), tokens.text)),
                );
            }
            ui.end_row();
        }
    });
}

/// `left wrist` as `l wri`: sixteen columns have to fit.
fn short(name: &str) -> String {
    let part = |word: &str| word.chars().take(3).collect::<String>();
    match name.split_once(' ') {
        Some((side, rest)) => format!("{} {}", side.chars().take(1).collect::<String>(), part(rest)),
        None => part(name),
    }
}
