//! Notifications: errors and warnings, and what was done; one of a large act offers to take it back.

use super::Shared;
use crate::app::theme::Tokens;
use crate::app::widgets::Named as _;
use crate::session::{Command, LogLevel, Notice, Session};
use egui::{Align2, RichText, Role, Ui, vec2};

/// Seconds that a notification of something wrong stays.
const WRONG_S: f64 = 8.0;
/// Seconds that one of something done stays.
const DONE_S: f64 = 4.0;
/// Seconds that one stays that offers to take something back.
const OFFER_S: f64 = 20.0;
/// The oldest of more give way.
const MOST: usize = 4;

/// What is told, and until when.
#[derive(Default)]
pub(super) struct Notices(Vec<(f64, Notice)>);

impl Notices {
    pub(super) fn tell(&mut self, notice: Notice, now: f64) {
        let stays = match (notice.act, notice.level) {
            (Some(_), _) => OFFER_S,
            (None, LogLevel::Info) => DONE_S,
            (None, _) => WRONG_S,
        };
        self.0.push((now + stays, notice));
        let surplus = self.0.len().saturating_sub(MOST);
        self.0.drain(..surplus);
    }

    pub(super) fn show(&mut self, ui: &Ui, shared: &mut Shared<'_>) {
        let now = ui.input(|i| i.time);
        // What was taken back, or followed by another act, is not offered any more.
        self.0.retain(|(until, notice)| {
            *until > now && notice.act.is_none_or(|act| shared.session.undo_act() == Some(act))
        });
        let mut closed = None;
        for (i, (until, notice)) in self.0.iter().enumerate() {
            let offset = vec2(-12.0, -74.0 - 64.0 * i as f32);
            let area = egui::Area::new(egui::Id::unique(("notice", i)));
            let area = area.anchor(Align2::RIGHT_BOTTOM, offset).order(egui::Order::Foreground);
            match area.show(ui.ctx(), |ui| one(ui, notice, shared.session)).inner {
                Answer::None => {}
                Answer::Close => closed = Some(i),
                Answer::Undo => {
                    shared.send(Command::Undo);
                    closed = Some(i);
                }
            }
            ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64((until - now).max(0.05)));
        }
        if let Some(i) = closed {
            self.0.remove(i);
        }
    }
}

enum Answer {
    None,
    Close,
    Undo,
}

fn one(ui: &mut Ui, notice: &Notice, session: &Session) -> Answer {
    let tokens = Tokens::of(ui);
    let (sign, color) = match notice.level {
        LogLevel::Error => ("■", tokens.bad),
        LogLevel::Warning => ("▲", tokens.warn),
        LogLevel::Info => ("●", tokens.accent),
    };
    let mut answer = Answer::None;
    egui::Frame::popup(ui.style()).stroke(egui::Stroke::new(1.0, color)).show(ui, |ui| {
        ui.set_max_width(420.0);
        ui.horizontal(|ui| {
            ui.label(RichText::new(sign).color(color));
            ui.add(egui::Label::new(RichText::new(&notice.text).small()).wrap());
            if notice.act.is_some() {
                let undo = ui.add_enabled(session.undo_name().is_some(), egui::Button::new("Undo"));
                let name = format!("Undo {}", notice.text);
                if undo.named(Role::Button, &name).on_hover_text("Take all of it back.\nKey: Ctrl+Z").clicked() {
                    answer = Answer::Undo;
                }
            }
            if ui.small_button("✕").named(Role::Button, "Dismiss notification").clicked() {
                answer = Answer::Close;
            }
        });
    });
    answer
}
