//! Leaving: at once where nothing is cut off by it, else after a question.

use super::InspectorApp;
use egui::{Context, ViewportCommand};

impl InspectorApp {
    /// Closes the window, or asks where something is under way.
    pub(super) fn quit(&mut self, ctx: &Context) {
        if self.runtime.session().under_way().is_empty() {
            self.stop_and_quit(ctx);
        } else {
            self.overlay.ask_quit();
        }
    }

    /// Closes the window, whatever is under way.
    pub(super) fn stop_and_quit(&mut self, ctx: &Context) {
        self.leaving = true;
        ctx.send_viewport_cmd(ViewportCommand::Close);
    }

    /// The desktop asks the window to close: it stays until somebody has said what becomes of what is under way.
    pub(super) fn take_close(&mut self, ctx: &Context) {
        let asked = ctx.input(|i| i.viewport().close_requested());
        if asked && !self.leaving && !self.runtime.session().under_way().is_empty() {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            self.overlay.ask_quit();
        }
    }
}
