//! What sets the limits of a colour bar besides its handles: typed numbers, the way back to automatic ones, and the lock.

use super::Named as _;
use super::colorbar::{BarRow, ColorBar};
use crate::app::theme::{self, Tokens};
use egui::{Align2, FontId, Id, Popup, PopupCloseBehavior, Rect, RichText, Sense, Stroke, Ui, pos2, vec2};

/// Height of the buttons under a bar.
pub(super) const BUTTONS: f32 = 16.0;

/// What was done to the limits of a row of maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LimitsEdit {
    /// Set to these.
    Set((f64, f64)),
    /// Found again.
    Automatic,
    /// They stay over frames, or no longer.
    Lock(bool),
}

/// What is typed and not yet taken.
#[derive(Debug, Clone, Default)]
struct Draft {
    /// Lower first.
    texts: [String; 2],
    error: Option<String>,
}

/// The numbers of the limits, lower first, which open a form; and the buttons under the bar.
pub(super) fn edit(
    ui: &mut Ui,
    bar: &ColorBar<'_>,
    row: &BarRow<'_>,
    texts: [String; 2],
    rects: [Rect; 2],
) -> Option<LimitsEdit> {
    let tokens = Tokens::of(ui);
    let id = ui.scope_id().with(("limits", &row.name));
    let mut edit = if bar.has_buttons() { buttons(ui, bar.rect, row, id, &tokens) } else { None };
    let mut open = false;
    for (upper, (text, rect)) in [false, true].into_iter().zip(texts.into_iter().zip(rects)) {
        let response = ui.interact(rect, id.with(upper), Sense::click());
        let response = response.named(egui::Role::Button, &format!("{} limit of {}", side(upper), row.array));
        let color = if response.hovered() { tokens.accent } else { tokens.text };
        let at = pos2(rect.min.x + 3.0, rect.center().y);
        ui.painter().text(at, Align2::LEFT_CENTER, text, theme::mono(10.0), color);
        let response =
            response.on_hover_cursor(egui::CursorIcon::PointingHand).on_hover_text("Click to type the colour limits.");
        let first = response.clicked();
        let popup = Popup::menu(&response).close_behavior(PopupCloseBehavior::CloseOnClickOutside);
        if let Some(shown) = popup.show(|ui| form(ui, (bar, row), id, first.then_some(upper), &tokens)) {
            open = true;
            edit = shown.inner.or(edit);
        }
    }
    if !open {
        ui.data_mut(|data| data.remove_temp::<Draft>(id));
    }
    edit
}

/// Both numbers, what is wrong with them, automatic, lock.
fn form(
    ui: &mut Ui,
    (bar, row): (&ColorBar<'_>, &BarRow<'_>),
    id: Id,
    focus: Option<bool>,
    tokens: &Tokens,
) -> Option<LimitsEdit> {
    let span = bar.histogram.span.1 - bar.histogram.span.0;
    let digits = (2.0 - span.log10().floor()).clamp(0.0, 6.0) as usize;
    let texts = [bar.limits.0, bar.limits.1].map(|value| format!("{value:.digits$}").replace('-', "−"));
    let fresh = Draft { texts, error: None };
    let mut draft = ui.data_mut(|data| data.get_temp::<Draft>(id)).unwrap_or_else(|| fresh.clone());
    let mut edit = None;
    ui.set_width(210.0);
    ui.label(RichText::new(format!("Colour limits of {}, {}", row.array, bar.unit)).small().color(tokens.dim));
    for upper in [true, false] {
        ui.horizontal(|ui| {
            ui.add_sized([44.0, 20.0], egui::Label::new(side(upper)));
            let text = &mut draft.texts[usize::from(upper)];
            let field = egui::TextEdit::singleline(text).font(theme::mono(12.0)).desired_width(90.0);
            let field = field.align(egui::Align2::LEFT_CENTER);
            let name = format!("{} limit of {} value", side(upper), row.array);
            let response = ui.add(field);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, &name));
            if focus == Some(upper) {
                response.request_focus();
            }
            if response.changed() {
                draft.error = None;
            }
            if response.lost_focus() && draft.texts != fresh.texts {
                match parse(&draft.texts) {
                    Ok(limits) => edit = Some(LimitsEdit::Set(limits)),
                    Err(why) => draft.error = Some(why),
                }
            }
        });
    }
    if let Some(error) = &draft.error {
        ui.label(RichText::new(error).color(tokens.bad));
    }
    ui.horizontal(|ui| {
        let tip = "Find the limits by percentiles again.";
        let automatic = ui.add_enabled(row.by_hand, egui::Button::new("Automatic"));
        if automatic.on_hover_text(tip).on_disabled_hover_text("The limits are automatic.").clicked() {
            edit = Some(LimitsEdit::Automatic);
        }
        let mut locked = row.locked;
        if ui.checkbox(&mut locked, "Lock over frames").on_hover_text(LOCK).changed() {
            edit = Some(LimitsEdit::Lock(locked));
        }
    });
    // What is taken shows in the numbers: they begin anew from it.
    if edit.is_some() {
        ui.data_mut(|data| data.remove_temp::<Draft>(id));
    } else {
        ui.data_mut(|data| data.insert_temp(id, draft));
    }
    edit
}

const LOCK: &str = "The limits stay when another frame is shown; without the lock each frame finds its own. Limits set by hand are locked.";

fn side(upper: bool) -> &'static str {
    if upper { "Upper" } else { "Lower" }
}

/// Two limits, lower first, as typed.
fn parse(texts: &[String; 2]) -> Result<(f64, f64), String> {
    let number = |text: &String| {
        let plain = text.trim().replace('−', "-").replace(',', ".");
        plain.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| {
            let what = if plain.is_empty() { "Nothing".to_owned() } else { format!("“{}”", text.trim()) };
            format!("{what} is not a number.")
        })
    };
    let (lo, hi) = (number(&texts[0])?, number(&texts[1])?);
    if lo < hi { Ok((lo, hi)) } else { Err("The lower limit must be below the upper one.".into()) }
}

/// `auto`, and a padlock.
fn buttons(ui: &mut Ui, bar: Rect, row: &BarRow<'_>, id: Id, tokens: &Tokens) -> Option<LimitsEdit> {
    let line = Rect::from_min_max(pos2(bar.min.x + 4.0, bar.max.y - BUTTONS), bar.max);
    let (auto, lock) =
        (line.with_max_x(line.min.x + 32.0), line.with_min_x(line.min.x + 40.0).with_max_x(line.min.x + 58.0));
    let mut edit = None;
    let response = ui.interact(auto, id.with("auto"), Sense::click());
    response.widget_info(|| {
        let name = format!("Automatic limits of {}", row.array);
        egui::WidgetInfo::selected(egui::Role::Button, true, !row.by_hand, name)
    });
    let color = ground(ui, auto, !row.by_hand, response.hovered(), tokens);
    ui.painter().text(auto.center(), Align2::CENTER_CENTER, "auto", FontId::proportional(10.0), color);
    let tip = "Limits by percentiles, which the menu Show sets; off where they were set by hand.";
    if response.on_hover_text(tip).clicked() && row.by_hand {
        edit = Some(LimitsEdit::Automatic);
    }
    let response = ui.interact(lock, id.with("lock"), Sense::click());
    response.widget_info(|| {
        let name = format!("Lock the limits of {} over frames", row.array);
        egui::WidgetInfo::selected(egui::Role::Button, true, row.locked, name)
    });
    let color = ground(ui, lock, row.locked, response.hovered(), tokens);
    padlock(ui, lock.center(), row.locked, color);
    if response.on_hover_text(LOCK).clicked() {
        edit = Some(LimitsEdit::Lock(!row.locked));
    }
    edit
}

/// The ground of a small switch; answers the colour of what is on it.
fn ground(ui: &Ui, rect: Rect, on: bool, hovered: bool, tokens: &Tokens) -> egui::Color32 {
    if on {
        ui.painter().rect_filled(rect, 3.0, tokens.accent.gamma_multiply(0.3));
    } else if hovered {
        ui.painter().rect_filled(rect, 3.0, tokens.raised);
    }
    if on || hovered { tokens.text } else { tokens.dim }
}

/// A padlock: no font of the window has one.
fn padlock(ui: &Ui, center: egui::Pos2, closed: bool, color: egui::Color32) {
    let body = Rect::from_center_size(center + vec2(0.0, 2.0), vec2(8.0, 6.0));
    ui.painter().rect_filled(body, 1.0, color);
    let shift = if closed { 0.0 } else { 3.0 };
    let (left, right, top) = (center.x - 2.5 + shift, center.x + 2.5 + shift, center.y - 4.5);
    let bow = vec![
        pos2(left, body.min.y),
        pos2(left, top + 1.5),
        pos2(left + 1.5, top),
        pos2(right - 1.5, top),
        pos2(right, top + 1.5),
        pos2(right, body.min.y - shift * 0.5),
    ];
    ui.painter().add(egui::Shape::line(bow, Stroke::new(1.3, color)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_limits_are_two_numbers_in_order() {
        let of = |lo: &str, hi: &str| parse(&[lo.to_owned(), hi.to_owned()]);
        assert_eq!(of(" −42,5 ", "-3"), Ok((-42.5, -3.0)));
        assert_eq!(of("abc", "0"), Err("“abc” is not a number.".into()));
        assert_eq!(of("1", ""), Err("Nothing is not a number.".into()));
        assert_eq!(of("0", "inf"), Err("“inf” is not a number.".into()));
        assert_eq!(of("0", "0"), Err("The lower limit must be below the upper one.".into()));
    }
}
