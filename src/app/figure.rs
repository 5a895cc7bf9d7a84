//! Captions for figures: what a picture shows, printed small under it, so that it can still be told apart in a year.

use super::theme::{self, Tokens};
use crate::config::FitConfig;
use crate::mhp::Weight;
use crate::session::Session;
use egui::{FontId, Rect, Role, Ui, WidgetInfo, pos2};

/// The caption of a picture that shows `what`, where captions are printed.
pub(super) fn of(session: &Session, what: &str) -> Option<String> {
    session.view.figure.then(|| format!("{what} · {}", caption(session)))
}

/// What every picture of a fit has in common: frame, iteration, τ, weights, seed, version.
fn caption(session: &Session) -> String {
    let Some(frame) = &session.data.frame else { return String::new() };
    let config = session.fit.shown.as_ref().map_or(session.config, |shown| shown.config);
    // The fit draws no random number: it has no seed to print.
    format!(
        "{} · iteration {} · τ_pct {} % · {} · seed none (deterministic) · mhp-inspector {}",
        frame.name,
        session.fit.shown.as_ref().map_or(0, |shown| shown.iteration),
        config.tau_pct,
        weights(&config),
        env!("CARGO_PKG_VERSION")
    )
}

/// The weights that are not left at a default of 0: `w_EM 0.5 · w_kine 0.5`.
fn weights(config: &FitConfig) -> String {
    let told = Weight::ALL.iter().filter(|weight| [config, &FitConfig::default()].iter().any(|c| weight.of(c) != 0.0));
    told.map(|weight| format!("{} {}", weight.label(), weight.of(config))).collect::<Vec<_>>().join(" · ")
}

/// What a screen reader says of a picture: its name, and its caption where one is printed.
pub(super) fn spoken(name: &str, caption: Option<&str>) -> WidgetInfo {
    let mut info = WidgetInfo::labeled(Role::Canvas, true, name);
    info.current_text_value = caption.map(str::to_owned);
    info
}

/// Prints a caption, where there is one, at the lower end of `rect`, in as many lines as it needs, and answers what is left
/// above it.
pub(super) fn print(ui: &Ui, rect: Rect, caption: Option<&str>) -> Rect {
    let Some(text) = caption else { return rect };
    let tokens = Tokens::of(ui);
    let font = FontId::proportional(theme::CAPTION - 2.0);
    let galley = ui.painter().layout(text.to_owned(), font, tokens.dim, (rect.width() - 16.0).max(40.0));
    let top = rect.max.y - galley.size().y - 4.0;
    ui.painter().galley(pos2(rect.min.x + 8.0, top), galley, tokens.dim);
    rect.with_max_y(top - 2.0)
}
