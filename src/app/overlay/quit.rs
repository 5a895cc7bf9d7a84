//! The question before leaving while something is under way.

use super::{Overlay, Sheet, modal};
use crate::app::commands::{AppAct, UiAction};
use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use egui::{RichText, Ui};

impl Overlay {
    /// Asks what becomes of what is under way.
    pub(in crate::app) fn ask_quit(&mut self) {
        if self.sheet != Sheet::Quit {
            self.toggle(Sheet::Quit);
        }
    }

    pub(super) fn quit(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let tokens = Tokens::of(ui);
        let under_way = shared.session.under_way();
        let mut stay = false;
        let response = modal(ui, "quit").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 440.0));
            ui.label(RichText::new("Quit now?").font(theme::strong(16.0)));
            ui.add_space(6.0);
            for said in &under_way {
                ui.label(said);
            }
            if under_way.is_empty() {
                ui.label("What was under way has ended meanwhile.");
            }
            ui.label(RichText::new("Labels and the fits of batches are on disk.").color(tokens.dim));
            ui.add_space(10.0);
            ui.horizontal(|ui| {
                let stays = ui.button("Stay");
                // Enter and Space do what cuts nothing off.
                if std::mem::take(&mut self.fresh) {
                    stays.request_focus();
                }
                stay = stays.clicked();
                let quit = if under_way.is_empty() { "Quit now" } else { "Stop and quit" };
                if ui.button(quit).clicked() {
                    shared.acts.push(UiAction::App(AppAct::StopAndQuit));
                    stay = true;
                }
            });
        });
        stay || response.should_close()
    }
}
