//! What the panes of explorations share: when one begins by itself, how far it is, pictures over two axes.

pub(super) mod plane;

use super::Shared;
use crate::app::theme::Tokens;
use crate::app::widgets::Named as _;
use crate::body::Pppr;
use crate::explore::ExplorationKind;
use crate::session::{AdoptedFit, Command, Session, WorkStatus};
use egui::{RichText, Role, Ui};
use std::sync::Arc;
use std::time::Duration;

/// An exploration that takes longer is not begun unasked, ms.
const UNASKED_MS: f64 = 4000.0;

/// Width of a bar of progress, points, and of it with what stands beside it.
const BAR_WIDTH: f32 = 140.0;
const PROGRESS_WIDTH: f32 = 260.0;

/// Asks for an exploration that a pane shows, once it is of something else than what is on screen: unasked where it takes
/// `cost_ms` on one core and that is little; else a button asks for it. Shows how far it is.
pub(super) fn keep_up(ui: &mut Ui, shared: &mut Shared<'_>, kind: ExplorationKind, cost_ms: Option<f64>) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    let current = session.is_explored(kind);
    let running = session.explore.is_running(kind);
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    let took = cost_ms.map(|ms| ms / cores);
    let at_rest = session.fit.is_ready() && !session.is_dragging() && session.fit.replay.is_none();
    let quick = took.is_some_and(|ms| ms < UNASKED_MS);
    let failed = session.explore.state(kind).and_then(|state| state.fault.as_deref());
    if !current && at_rest && quick {
        shared.send(Command::Explore(kind));
    }
    // The bar is not squeezed into what is left of a line of the toolbar.
    if running && ui.available_size_before_wrap().x < PROGRESS_WIDTH {
        ui.end_row();
    }
    ui.horizontal(|ui| {
        if running {
            progress(ui, shared, kind, &tokens);
        } else if !current && !quick {
            let text = took.map_or_else(String::new, |ms| format!(" (about {})", in_words(ms)));
            let button = ui.add_enabled(at_rest, egui::Button::new(format!("Fill{text}")));
            let button = button.named(Role::Button, &format!("Fill the {}", kind.title()));
            if button.on_hover_text("On idle cores, coarse to fine.").clicked() {
                shared.send(Command::Explore(kind));
            }
        }
        if let Some(why) = failed.filter(|_| !running) {
            ui.label(RichText::new(why).small().color(tokens.bad));
        }
    });
}

fn progress(ui: &mut Ui, shared: &mut Shared<'_>, kind: ExplorationKind, tokens: &Tokens) {
    let session = shared.session;
    let Some(state) = session.explore.state(kind) else { return };
    let WorkStatus::Running { done, total, .. } = state.work.status else { return };
    if session.needs_cores() {
        ui.label(RichText::new("waits for the run").small().color(tokens.dim));
    }
    let share = if total > 0 { done as f32 / total as f32 } else { 0.0 };
    let text = if total > 0 { format!("{done} of {total}") } else { "beginning…".to_owned() };
    let bar = egui::ProgressBar::new(share).desired_height(14.0).desired_width(BAR_WIDTH);
    ui.add(bar.text(RichText::new(text).small()));
    let stop = ui.small_button("✕").on_hover_text("Stop; what was found stays.");
    if stop.named(Role::Button, &format!("Stop the {}", kind.title())).clicked() {
        shared.send(Command::StopExploring(kind));
    }
    // It grows without anything else.
    ui.ctx().request_repaint_after(Duration::from_millis(100));
}

/// A time, to be read at a glance.
fn in_words(ms: f64) -> String {
    match ms / 1000.0 {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// How a number with a sign is written.
pub(super) fn signed(text: impl AsRef<str>) -> String {
    text.as_ref().replace('-', "−")
}

/// Whether a pane of an exploration has something to explore.
pub(super) fn needs_fit(session: &Session) -> bool {
    session.data.frame.is_none() || session.fit.problem.is_none()
}

/// A branch that begins with a body, its EM region around that of `around`; `words` say where it is from.
pub(super) fn begin_branch(shared: &mut Shared<'_>, start: Arc<Pppr>, around: Option<Arc<Pppr>>, words: String) {
    let session = shared.session;
    let fit = AdoptedFit { start, around, erased: session.fit.erased(), config: session.config, words };
    shared.send(Command::DragFit(Box::new(fit)));
    shared.send(Command::EndDrag);
}
