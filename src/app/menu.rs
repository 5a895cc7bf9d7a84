//! The bar at the top: menus from the command table, and the status of data set, frame and fit.

use super::commands::{Menu, all, shortcut_text};
use super::panes::Shared;
use super::theme::{self, Tokens};
use crate::session::{Command, Compare, FitStatus, LabelMode, Session};
use egui::{RichText, Ui};

pub(super) fn bar(ui: &mut Ui, shared: &mut Shared<'_>) {
    let tokens = Tokens::of(ui);
    let frame = egui::Frame::new().fill(tokens.panel).inner_margin(egui::Margin::symmetric(6, 2));
    egui::Panel::top("menu").exact_size(28.0).frame(frame).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            egui::MenuBar::new().ui(ui, |ui| {
                for menu in Menu::ALL {
                    ui.menu_button(menu.title(), |ui| {
                        // As high as its items, and no higher than the window.
                        let height = ui.ctx().content_rect().height() - 48.0;
                        let area = egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height);
                        area.show(ui, |ui| items(ui, shared, menu));
                    });
                }
                status(ui, shared, &tokens);
            });
        });
    });
}

/// Commands before which a menu has a line.
const BEGIN_A_GROUP: [&str; 16] = [
    "Quit",
    "Save session",
    "Export labels as CSV…",
    "Save picture…",
    "Fit listed frames",
    "Sweep settings…",
    "Move body",
    "Replay",
    "Reset fit",
    "Person or whole",
    "View from the radar",
    "Clear selection",
    "Light or dark",
    "Full screen",
    "Show Maps",
    "First frame",
];

fn items(ui: &mut Ui, shared: &mut Shared<'_>, menu: Menu) {
    ui.set_min_width(230.0);
    let (last, items): (Vec<_>, Vec<_>) =
        all().filter(|command| command.menu() == menu).partition(|command| command.label() == "Quit");
    for command in items.into_iter().chain(last) {
        let label = command.label();
        if label == "Quit" {
            recent(ui, shared);
        }
        if BEGIN_A_GROUP.contains(&&*label) {
            ui.separator();
        }
        let enabled = command.enabled(shared.session);
        let mut button = egui::Button::new(command.text(shared.session).into_owned());
        if let Some(&keys) = command.keys().first() {
            button = button.shortcut_text(shortcut_text(keys));
        }
        let response = ui.add_enabled(enabled, button.selected(is_on(&command.label(), shared.session)));
        if response.on_hover_text(command.tip()).clicked() {
            shared.acts.push(command.action(shared.session));
            ui.close();
        }
    }
}

/// Whether what a command switches is on.
fn is_on(label: &str, session: &Session) -> bool {
    let view = &session.view;
    match label {
        "Warm start" => session.warm_start,
        "Start along the sequence" => session.along,
        "Play frames" => session.data.playing,
        "Live fit" => session.is_live(),
        "Difference H_sim − H_ori" => view.compare == Compare::Difference,
        "Wipe H_ori | H_sim" => view.compare == Compare::Wipe,
        "Bird's-eye" => view.cube.birds_eye,
        "Polar" => view.cube.polar,
        "Cells round the cursor" => view.neighbours,
        "Logarithmic losses" => view.log_loss,
        "Logarithmic iterations" => view.log_iterations,
        "Move body" => view.move_body,
        "Figure captions" => view.figure,
        "Explore" => view.label_mode == LabelMode::Explore,
        "Label for agreement" => view.label_mode == LabelMode::Agreement,
        "Review counts" => view.label_mode == LabelMode::CountReview,
        _ => false,
    }
}

fn recent(ui: &mut Ui, shared: &mut Shared<'_>) {
    let paths = shared.session.data.recent.clone();
    ui.menu_button("Open recent", |ui| {
        if paths.is_empty() {
            ui.label("Nothing was opened yet.");
        }
        for path in &paths {
            if ui.button(path.display().to_string()).clicked() {
                shared.send(Command::Open(path.clone()));
                ui.close();
            }
        }
        if !paths.is_empty() {
            ui.separator();
            if ui.button("Clear list").clicked() {
                shared.send(Command::ClearRecent);
                ui.close();
            }
        }
    });
}

/// Right side of the bar: data set, axes convention, speed.
fn status(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        let session = shared.session;
        if let Some(opening) = &session.data.opening {
            if ui.small_button("Cancel").on_hover_text("Stop opening; what is on screen stays.").clicked() {
                shared.send(Command::CancelOpen);
            }
            let share = if opening.total > 0 { opening.done as f32 / opening.total as f32 } else { 0.0 };
            let text = if opening.total > 0 {
                format!("{} {}/{}", opening.stage, opening.done, opening.total)
            } else {
                format!("{} {}", opening.stage, opening.done)
            };
            ui.add(
                egui::ProgressBar::new(share)
                    .desired_width(180.0)
                    .desired_height(14.0)
                    .text(RichText::new(text).small()),
            );
            return;
        }
        let fit = &session.fit;
        let speed = fit.shown.as_ref().filter(|_| fit.is_running()).map_or(0.0, |s| s.iterations_per_s);
        let timing = match (fit.run_ms, fit.status == FitStatus::Running) {
            (_, true) if speed > 0.0 => format!("{speed:.0} it/s"),
            (Some(ms), false) => format!("init {:.1} ms · run {ms:.0} ms", fit.init_ms),
            _ if fit.problem.is_some() => format!("init {:.1} ms", fit.init_ms),
            _ => String::new(),
        };
        ui.label(RichText::new(timing).font(theme::mono(theme::CAPTION)).color(tokens.dim))
            .on_hover_text("Time of the initialisation and of the last run, or iterations a second.");
        if let Some(dataset) = &session.data.dataset {
            let info = dataset.info();
            let frame = session.data.frame.as_ref().map_or_else(String::new, |f| format!(" · {}", f.name));
            let name = format!("{}{frame}", info.name);
            let width = ui.painter().layout_no_wrap(name.clone(), theme::strong(12.0), tokens.text).size().x;
            let tip = format!("Axes convention of this data set: {}\n{}", info.axes_badge, info.assumptions.join("\n"));
            // The badge gives way first: the name must be readable beside the menus.
            let room = ui.available_width() - width - 24.0;
            if room > 60.0 {
                let badge = RichText::new(&info.axes_badge).small().color(tokens.dim);
                ui.scope(|ui| {
                    ui.set_max_width(room);
                    ui.add(egui::Label::new(badge).truncate()).on_hover_text(&tip);
                });
            }
            ui.add(egui::Label::new(RichText::new(name).font(theme::strong(12.0))).truncate())
                .on_hover_text(format!("{}\n{tip}", info.root.display()));
        }
    });
}
