//! The log: what was opened, assumed, repaired, refused.

use super::{Blank, Dock, Pane, PaneStates, Shared};
use crate::app::commands::CTRL;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Mark;
use crate::session::{Command, LogLevel, Session};
use egui::Key;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Log",
    title: "Log",
    icon: &[
        Mark::Box([2.5, 1.5, 13.5, 14.5]),
        Mark::Line(&[[5.0, 5.0], [11.0, 5.0]]),
        Mark::Line(&[[5.0, 8.0], [11.0, 8.0]]),
        Mark::Line(&[[5.0, 11.0], [9.0, 11.0]]),
    ],
    help: "what was opened, assumed, repaired and refused",
    dock: Dock::Bottom,
    keys: &[(CTRL, Key::Num5)],
    margin: 8,
    state: PaneStates::prepare::<()>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, _| show(ui, shared),
};

fn blank(session: &Session) -> Option<Blank> {
    let how = "Opened data sets, assumptions, warnings and errors appear here.";
    session.log.is_empty().then(|| Blank::new("Nothing to tell", how))
}

fn toolbar(ui: &mut egui::Ui, shared: &mut Shared<'_>) {
    let tokens = Tokens::of(ui);
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new(format!("{} lines", shared.session.log.len())).small().color(tokens.dim));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.small_button("Clear log").on_hover_text("Empty the log.").clicked() {
                shared.send(Command::ClearLog);
            }
            if ui.small_button("Copy log").on_hover_text("Copy every line to the clipboard.").clicked() {
                let all: Vec<String> = shared.session.log.iter().map(|line| line.text.clone()).collect();
                ui.ctx().copy_text(all.join("\n"));
            }
        });
    });
}

fn show(ui: &mut egui::Ui, shared: &Shared<'_>) {
    let tokens = Tokens::of(ui);
    egui::ScrollArea::vertical().auto_shrink(false).stick_to_bottom(true).show(ui, |ui| {
        for line in &shared.session.log {
            let (mark, color) = match line.level {
                LogLevel::Info => ("·", tokens.dim),
                LogLevel::Warning => ("▲", tokens.warn),
                LogLevel::Error => ("■", tokens.bad),
            };
            ui.horizontal_top(|ui| {
                let clock = egui::RichText::new(clock(line.at)).font(theme::mono(theme::CAPTION)).color(tokens.dim);
                ui.label(clock);
                ui.label(egui::RichText::new(mark).color(color));
                ui.add(egui::Label::new(egui::RichText::new(&line.text).small()).wrap());
            });
        }
    });
}

/// Time of day in UTC, hh:mm:ss.
fn clock(at: std::time::SystemTime) -> String {
    let seconds = at.duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs() % 86_400);
    format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}
