//! Captions for figures: what a picture shows, printed small under it, so that it can still be told apart in a year.

use super::theme;
use crate::session::Session;
use egui::{Align2, Color32, FontId, Painter, Rect, Role, WidgetInfo, vec2};

/// What every picture of a fit has in common: frame, iteration, τ, weights, seed, version.
pub(super) fn caption(session: &Session) -> String {
    let Some(frame) = &session.data.frame else { return String::new() };
    let config = session.fit.shown.as_ref().map_or(session.config, |shown| shown.config);
    // The fit draws no random number: it has no seed to print.
    format!(
        "{} · iteration {} · τ_pct {} % · w_EM {} · w_kine {} · seed none (deterministic) · mhp-inspector {}",
        frame.name,
        session.fit.shown.as_ref().map_or(0, |shown| shown.iteration),
        config.tau_pct,
        config.w_em,
        config.w_kine,
        env!("CARGO_PKG_VERSION")
    )
}

/// What a screen reader says of a picture: its name, and its caption where one is printed.
pub(super) fn spoken(name: &str, caption: Option<&str>) -> WidgetInfo {
    let mut info = WidgetInfo::labeled(Role::Canvas, true, name);
    info.current_text_value = caption.map(str::to_owned);
    info
}

/// Prints a caption along the lower edge of a picture, on a ground of its own, in as many lines as it needs.
pub(super) fn print(painter: &Painter, rect: Rect, text: &str) {
    let font = FontId::proportional(theme::CAPTION - 2.0);
    let galley = painter.layout(text.to_owned(), font, Color32::WHITE, (rect.width() - 8.0).max(40.0));
    let size = galley.size() + vec2(8.0, 4.0);
    let ground = Align2::LEFT_BOTTOM.align_size_within_rect(size, rect);
    painter.rect_filled(ground, 0.0, Color32::from_black_alpha(170));
    painter.galley(ground.min + vec2(4.0, 2.0), galley, Color32::WHITE);
}
