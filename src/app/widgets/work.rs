//! How far long work is, with buttons to let it wait and to stop it.

use super::Named as _;
use crate::session::{Work, WorkStatus};
use egui::{RichText, Role, Ui};
use std::time::Duration;

/// What a person asks of work that is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::app) enum WorkAsked {
    /// Wait, or go on.
    Pause,
    /// Stop.
    Cancel,
}

/// A line with a bar, what is left, and two buttons; nothing where no work is under way. `what` is its name in the labels of
/// the buttons.
pub(in crate::app) fn work(ui: &mut Ui, work: &Work, what: &str) -> Option<WorkAsked> {
    let WorkStatus::Running { done, total, paused } = work.status else { return None };
    let left = work.eta().map_or_else(String::new, |left| format!(" · {} left", in_words(left)));
    let mut asked = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let text = match (paused, total) {
            (true, _) => format!("paused at {done} of {total}"),
            (false, 0) => "beginning…".to_owned(),
            (false, _) => format!("{done} of {total}{left}"),
        };
        let share = if total > 0 { done as f32 / total as f32 } else { 0.0 };
        let bar = egui::ProgressBar::new(share).desired_height(14.0).text(RichText::new(text).small());
        ui.add(bar.desired_width((ui.available_width() - if paused { 76.0 } else { 50.0 }).clamp(60.0, 420.0)));
        // A word, for ▶ plays frames.
        let (sign, name) =
            if paused { ("Go on", format!("Go on with {what}")) } else { ("‖", format!("Pause {what}")) };
        if ui.small_button(sign).on_hover_text(&name).named(Role::Button, &name).clicked() {
            asked = Some(WorkAsked::Pause);
        }
        let cancel = ui.small_button("✕").on_hover_text("Stop; what was fitted is kept.");
        if cancel.named(Role::Button, &format!("Cancel {what}")).clicked() {
            asked = Some(WorkAsked::Cancel);
        }
    });
    // What is left changes without anything else.
    ui.ctx().request_repaint_after(Duration::from_secs(1));
    asked
}

/// A time, to be read at a glance.
fn in_words(time: Duration) -> String {
    match time.as_secs() {
        s @ 0..=99 => format!("{} s", s.max(1)),
        s @ 100..=5999 => format!("{} min", (s + 30) / 60),
        s => format!("{:.1} h", s as f64 / 3600.0),
    }
}
