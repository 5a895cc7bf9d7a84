//! One card a failure mode: a score, a sentence with the decisive number, and findings that lead to where they are seen.

use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::diagnose::{Evidence, Finding, FindingPlace};
use crate::labels::{CellRegion, Tag};
use crate::session::{Command, FitStatus};
use egui::{RichText, Role, Sense, Ui, vec2};

pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let session = shared.session;
    ui.horizontal(|ui| {
        ui.label(RichText::new("Evidence").font(theme::strong(12.0))).on_hover_text(
            "The probability of each failure mode, learned from simulated frames: 0.5 is even odds where about one frame \
             in eight has the mode. The last finding of a card says how well it is told. Evidence, not a verdict: the tag is \
             yours.",
        );
        if session.fit.is_running() || session.evidence_is_stale() {
            let text = if session.fit.is_running() { "of the last pause" } else { "gathering…" };
            ui.label(RichText::new(text).small().color(tokens.dim));
        }
    });
    if session.evidence_hidden() {
        let text = "Hidden until you have tagged this frame (blind mode).";
        ui.label(RichText::new(text).small().color(tokens.dim));
        return;
    }
    if let Some(cards) = session.evidence_of(session.data.frame_index) {
        for card in cards {
            one(ui, shared, card, tokens);
        }
        if let Some(share) = session.best_basins.get(&session.data.frame_index) {
            let text = format!("Restarts: {:.0} % of the starts end in the best basin", 100.0 * share);
            let tip = "As the restart cloud found it: near 100 % every start finds the same. A small share is a frame that is \
                       ambiguous, or a fit that does not find out of its start.";
            ui.label(RichText::new(text).small()).on_hover_text(tip);
        }
        return;
    }
    let text = match &session.fit.status {
        FitStatus::Failed(why) => why.as_str(),
        _ => "Gathered as soon as the frame has a fit that rests.",
    };
    ui.label(RichText::new(text).small().color(tokens.dim));
}

fn one(ui: &mut Ui, shared: &mut Shared<'_>, card: &Evidence, tokens: &Tokens) {
    let frame = egui::Frame::new()
        .fill(tokens.raised)
        .stroke(egui::Stroke::new(1.0, tokens.stroke))
        .corner_radius(4)
        .inner_margin(egui::Margin::symmetric(8, 6));
    let response = frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.spacing_mut().item_spacing.y = 3.0;
        let words = || egui::Label::new(RichText::new(card.mode.words()).small());
        let long = {
            let font = egui::TextStyle::Small.resolve(ui.style());
            ui.painter().layout_no_wrap(card.mode.words().to_owned(), font, tokens.text).size().x
        };
        let beside = ui.horizontal(|ui| {
            ui.label(RichText::new(card.mode.code()).font(theme::strong(12.0)).color(tokens.tag(card.mode)));
            // The score has its place first; the words have a line of their own where they do not fit beside it.
            let score = |ui: &mut Ui| {
                number(ui, card);
                let room = ui.available_width() - long - 2.0 * ui.spacing().item_spacing.x;
                bar(ui, card, if room < SHORTEST { BAR } else { room.min(BAR) }, tokens);
                if room >= SHORTEST {
                    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| ui.add(words()));
                }
                room >= SHORTEST
            };
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), score).inner
        });
        if !beside.inner {
            ui.add(words().wrap());
        }
        ui.add(egui::Label::new(RichText::new(&card.summary).small()).wrap());
        if !card.findings.is_empty() {
            details(ui, shared, card, tokens);
        }
    });
    let name = format!("{} card", card.mode);
    let score = card.score.map_or_else(|| "not judged".into(), |score| format!("score {score:.2}"));
    response.response.widget_info(|| {
        let mut info = egui::WidgetInfo::labeled(Role::Group, true, &name);
        info.current_text_value = Some(format!("{score}. {}", card.summary));
        info
    });
}

/// The findings, folded away until somebody wants them; which cards are open is kept with the view.
fn details(ui: &mut Ui, shared: &mut Shared<'_>, card: &Evidence, tokens: &Tokens) {
    let open = shared.session.view.open_cards.contains(&card.mode);
    let count = card.findings.len();
    let text = format!("{} {count} finding{}", if open { "▾" } else { "▸" }, if count == 1 { "" } else { "s" });
    let link = egui::Button::new(RichText::new(text).small().color(tokens.accent)).frame(false).selected(false);
    let response = ui.add(link);
    let name = format!("Findings of {}", card.mode);
    response.widget_info(|| egui::WidgetInfo::selected(Role::Button, true, open, &name));
    if response.on_hover_text("The numbers behind the score, and where each is seen.").clicked() {
        shared.set_view(|view| {
            if open {
                view.open_cards.retain(|mode| *mode != card.mode);
            } else {
                view.open_cards.push(card.mode);
            }
        });
    }
    if open {
        for finding in &card.findings {
            line(ui, shared, card, finding, tokens);
        }
    }
}

/// The length of a bar, and of the shortest one, points.
const BAR: f32 = 56.0;
const SHORTEST: f32 = 18.0;

/// The score.
fn number(ui: &mut Ui, card: &Evidence) {
    let text = card.score.map_or_else(|| "–".into(), |score| format!("{score:.2}"));
    ui.label(RichText::new(text).font(theme::mono(12.0)));
}

/// The score as a bar.
fn bar(ui: &mut Ui, card: &Evidence, length: f32, tokens: &Tokens) {
    let (rect, _) = ui.allocate_exact_size(vec2(length, 6.0), Sense::hover());
    ui.painter().rect_filled(rect, 2.0, tokens.stroke);
    if let Some(score) = card.score {
        let filled = egui::Rect::from_min_size(rect.min, vec2(rect.width() * score as f32, rect.height()));
        ui.painter().rect_filled(filled, 2.0, tokens.tag(card.mode));
    }
}

fn line(ui: &mut Ui, shared: &mut Shared<'_>, card: &Evidence, finding: &Finding, tokens: &Tokens) {
    let text = RichText::new(format!("· {}", finding.text)).small().color(tokens.dim);
    let Some(place) = &finding.place else {
        ui.add(egui::Label::new(text).wrap());
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.add(egui::Label::new(text).wrap());
        let (word, tip) = match place {
            FindingPlace::Cells { .. } => ("show", "Zoom the maps to these cells."),
            FindingPlace::Joint(_) => ("select", "Select the joint."),
            FindingPlace::Frame(_) => ("go", "Show that frame."),
        };
        let link = ui.link(RichText::new(word).small());
        let name = format!("{word} where {} is seen: {}", card.mode, finding.text);
        if link.named(Role::Link, &name).on_hover_text(tip).clicked() {
            shared.show_place(place.clone());
        }
        // What a reflector did to the fit is seen without it.
        if let (Tag::F1, FindingPlace::Cells { view, lo, hi }) = (card.mode, place)
            && shared.session.fit.is_ready()
        {
            let link = ui.link(RichText::new("erase").small());
            let name = format!("erase where {} is seen: {}", card.mode, finding.text);
            let tip = "Fit without these cells, on a branch of its own; Ctrl+Z takes it back.";
            let array =
                shared.session.data.dataset.as_ref().and_then(|d| Some(d.info().views.get(*view)?.array.clone()));
            if let (true, Some(array)) = (link.named(Role::Link, &name).on_hover_text(tip).clicked(), array) {
                shared.send(Command::DragErase(CellRegion { view: array, lo: lo.clone(), hi: hi.clone() }));
                shared.send(Command::EndDrag);
            }
        }
    });
}
