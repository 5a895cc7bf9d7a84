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

/// What every picture of a fit has in common: frame, branch, iteration, τ, weights, what was erased, whose predictions are beside it,
/// seed, version.
fn caption(session: &Session) -> String {
    let Some(frame) = &session.data.frame else { return String::new() };
    let shown = session.fit.shown.as_ref();
    let config = shown.map_or(session.config, |shown| shown.config);
    let mut parts = vec![frame.name.clone()];
    if let Some(branch) = session.fit.branch().filter(|branch| branch.id > 0) {
        let edit = branch.edit.as_deref().filter(|edit| !edit.is_empty());
        parts
            .push(edit.map_or_else(|| format!("branch {}", branch.id), |edit| format!("branch {}: {edit}", branch.id)));
    }
    parts.push(format!("iteration {}", shown.map_or(0, |shown| shown.iteration)));
    parts.push(format!("τ_pct {} %", config.tau_pct));
    parts.push(weights(&config));
    let erased: usize = session.fit.erased().iter().map(crate::mhp::ErasedCells::count).sum();
    if erased > 0 {
        parts.push(format!("without {erased} erased cells"));
    }
    let sources = session.sources.list().iter().filter(|source| source.shown);
    let sources: Vec<&str> = sources.map(crate::session::Source::name).collect();
    if !sources.is_empty() {
        parts.push(format!("beside {}", sources.join(", ")));
    }
    // The fit draws no random number: it has no seed to print.
    parts.push("seed none (deterministic)".into());
    parts.push(format!("mhp-inspector {}", env!("CARGO_PKG_VERSION")));
    parts.join(" · ")
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
