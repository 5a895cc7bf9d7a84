//! Pinned fits in a table: the baseline, and how far each other one and the fit on screen is from it.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::CTRL;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::config::{FitConfig, difference, from_preset};
use crate::session::{Command, Pin, Session, numbers};
use egui::{Color32, Key, RichText, Role, Ui};

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Compare",
    title: "Compare",
    icon: &[Mark::Box([1.5, 1.5, 10.0, 10.0]), Mark::Box([6.0, 6.0, 14.5, 14.5])],
    help: "pinned fits, and how far the others are from the baseline",
    dock: Dock::Bottom,
    keys: &[(CTRL, Key::Num2)],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// What the pane remembers: a name while it is typed.
#[derive(Default)]
struct State {
    renaming: Option<(u32, String)>,
}

impl PaneState for State {}

/// Columns of numbers: title, digits, unit, and whether less is better.
const NUMBERS: [(&str, usize, &str, bool); 3] = [("L", 4, "", true), ("IoU", 3, "", false), ("MAJPE", 1, "mm", true)];

fn blank(session: &Session) -> Option<Blank> {
    let how = "Press P to pin the fit on screen. Then change a setting, run again, and see here, in the curves, on the \
               maps (key B) and in 3-D how far the new fit is from the pinned one.";
    session.pins.list().is_empty().then(|| Blank::new("No pinned fit", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>) {
    ui.horizontal(|ui| {
        if ui.small_button("Pin this fit").on_hover_text("Key: P").clicked() {
            shared.invoke("Pin this fit");
        }
        let text = "● baseline; differences are to it";
        ui.label(RichText::new(text).small().color(Tokens::of(ui).dim));
    });
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let tokens = Tokens::of(ui);
    let base = shared.session.pins.baseline().map(|pin| (pin.id, pin.numbers(), pin.config));
    egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        egui::Grid::new("pins").num_columns(9).spacing([10.0, 4.0]).striped(false).show(ui, |ui| {
            for title in ["", "Name", "Frame", "It."] {
                ui.label(RichText::new(title).small().color(tokens.dim));
            }
            for (title, _, unit, _) in NUMBERS {
                let text = if unit.is_empty() { title.to_owned() } else { format!("{title} / {unit}") };
                ui.label(RichText::new(text).small().color(tokens.dim));
            }
            ui.label(RichText::new("Settings, as far as they differ").small().color(tokens.dim));
            ui.end_row();
            current(ui, shared, base.as_ref().map(|(_, numbers, config)| (numbers, config)), &tokens);
            for pin in shared.session.pins.list() {
                row(ui, shared, state, pin, base.as_ref(), &tokens);
            }
        });
    });
}

/// The fit on screen.
fn current(ui: &mut Ui, shared: &Shared<'_>, base: Option<(&[Option<f64>; 3], &FitConfig)>, tokens: &Tokens) {
    let session = shared.session;
    let Some(row) = session.fit.shown_row() else { return };
    ui.label("");
    ui.label(RichText::new("on screen").font(theme::strong(12.0)));
    ui.label(RichText::new(session.data.frame.as_ref().map_or("", |frame| short(&frame.name))).small());
    ui.label(RichText::new(row.report.iteration.to_string()).font(theme::mono(theme::CAPTION)));
    cells(ui, numbers(&row.report, row.majpe_mm), base.map(|(numbers, _)| numbers), tokens);
    let config = session.fit.shown.as_ref().map_or(session.config, |shown| shown.config);
    settings(ui, base.map(|(_, config)| config), &config, tokens);
    ui.end_row();
}

fn row(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    state: &mut State,
    pin: &Pin,
    base: Option<&(u32, [Option<f64>; 3], FitConfig)>,
    tokens: &Tokens,
) {
    let is_base = base.is_some_and(|(id, ..)| *id == pin.id);
    let radio = ui.radio(is_base, "").named(Role::RadioButton, &format!("Baseline {}", pin.name));
    if radio.on_hover_text("Compare with this one; again to compare with none.").clicked() {
        shared.send(Command::SetBaseline((!is_base).then_some(pin.id)));
    }
    name(ui, shared, state, pin);
    let go = ui.link(RichText::new(short(&pin.frame_name)).small());
    if go.on_hover_text(format!("{}\nClick to show this frame.", pin.frame_name)).clicked() {
        shared.send(Command::GotoFrame(pin.frame));
    }
    ui.label(RichText::new(pin.iteration().to_string()).font(theme::mono(theme::CAPTION)));
    cells(ui, pin.numbers(), base.filter(|_| !is_base).map(|(_, numbers, _)| numbers), tokens);
    settings(ui, base.filter(|_| !is_base).map(|(.., config)| config), &pin.config, tokens);
    if ui.small_button("✕").named(Role::Button, &format!("Remove pin {}", pin.name)).clicked() {
        shared.send(Command::RemovePin(pin.id));
    }
    ui.end_row();
}

/// The name can be typed over.
fn name(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, pin: &Pin) {
    let mut text = match &state.renaming {
        Some((id, typed)) if *id == pin.id => typed.clone(),
        _ => pin.name.clone(),
    };
    let field = egui::TextEdit::singleline(&mut text).desired_width(64.0);
    let response = ui.add(field).named(Role::TextInput, &format!("Name of pin {}", pin.name));
    if response.lost_focus() {
        state.renaming = None;
        if text != pin.name {
            shared.send(Command::RenamePin(pin.id, text));
        }
    } else if response.has_focus() {
        state.renaming = Some((pin.id, text));
    }
}

/// Numbers with their difference to the baseline; better is green, worse is red, and the sign says it too.
fn cells(ui: &mut Ui, values: [Option<f64>; 3], base: Option<&[Option<f64>; 3]>, tokens: &Tokens) {
    for (k, (_, digits, _, less_is_better)) in NUMBERS.into_iter().enumerate() {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let text = values[k].map_or_else(|| "–".into(), |x| format!("{x:.digits$}"));
            ui.label(RichText::new(text).font(theme::mono(theme::CAPTION)));
            if let (Some(x), Some(b)) = (values[k], base.and_then(|base| base[k])) {
                let delta = x - b;
                let color: Color32 = if delta.abs() < 0.5 * 10f64.powi(-(digits as i32)) {
                    tokens.dim
                } else if (delta < 0.0) == less_is_better {
                    tokens.ok
                } else {
                    tokens.bad
                };
                let text = format!("{delta:+.digits$}").replace('-', "−");
                ui.label(RichText::new(text).font(theme::mono(10.0)).color(color));
            }
        });
    }
}

fn settings(ui: &mut Ui, base: Option<&FitConfig>, config: &FitConfig, tokens: &Tokens) {
    let text = match base.map(|base| difference(base, config)) {
        Some(text) if text.is_empty() => "the same".into(),
        Some(text) => text,
        None => from_preset(config),
    };
    ui.label(RichText::new(text).small().color(tokens.dim));
}

/// The last part of a frame's name.
fn short(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}
