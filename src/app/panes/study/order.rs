//! What is studied next: which study, of which settings, on the listed frames.

use crate::app::panes::Shared;
use crate::app::theme::Tokens;
use crate::app::widgets::{Named as _, WorkAsked, work};
use crate::config::{FIELDS, Field, FieldGroup, FieldKind, FitConfig, Number, Value};
use crate::session::{Command, Session, StudyOrder};
use crate::study::run::{GridAxis, RunError, StudyKind, points};
use egui::{RichText, Role, Ui};

/// Values that an axis of a sweep begins with, where its setting is a number.
const STEPS: usize = 5;
/// Of more fits than this it is said how long they may take before they begin.
const MANY: usize = 20_000;

/// What is being put together.
#[derive(Debug, Clone)]
pub(super) struct Order {
    study: StudyKind,
    axes: [Axis; 2],
    /// Whether the form is unfolded where a study is on screen.
    open: bool,
    /// The keyboard is to go to the values of the first setting.
    typing: bool,
    /// It was asked for by a command.
    asked: bool,
}

/// An axis of a sweep while it is being typed.
#[derive(Debug, Clone, Default)]
struct Axis {
    /// `None`: a sweep has one axis less.
    field: Option<&'static Field>,
    values: String,
}

impl Order {
    /// A sweep of the two settings that are tuned most, around what they are set to.
    pub(super) fn around(config: &FitConfig) -> Self {
        let axis = |key: &str| {
            let field = Field::of_key(key);
            Axis { field, values: field.map(|field| offered(field, config)).unwrap_or_default() }
        };
        Self {
            study: StudyKind::Sweep,
            axes: [axis("w_em"), axis("tau_pct")],
            open: false,
            typing: false,
            asked: false,
        }
    }

    /// Unfolds the form of a sweep and gives it the keyboard.
    pub(super) fn type_sweep(&mut self) {
        (self.study, self.open, self.typing) = (StudyKind::Sweep, true, true);
    }

    /// Begins the study as soon as it is known whether it can be.
    pub(super) fn ask(&mut self) {
        (self.open, self.asked) = (true, true);
    }

    /// The axes, or what is wrong with them.
    fn grid(&self) -> Result<Vec<GridAxis>, String> {
        if self.study != StudyKind::Sweep {
            return Ok(Vec::new());
        }
        let typed = self.axes.iter().filter_map(|axis| Some((axis.field?, &axis.values)));
        typed
            .map(|(field, values)| {
                let axis = format!("{}={}", field.key, values).parse::<GridAxis>();
                axis.map_err(|why| format!("{}: {why}", field.name))
            })
            .collect()
    }
}

/// The form, and how far a study is that was begun here.
pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, order: &mut Option<Order>) {
    let config = shared.session.config;
    let order = order.get_or_insert_with(|| Order::around(&config));
    let tokens = Tokens::of(ui);
    let mut begin = std::mem::take(&mut order.asked);
    let study = &shared.session.study;
    match work(ui, &study.work, "the study") {
        Some(WorkAsked::Pause) => shared.send(Command::PauseStudy),
        Some(WorkAsked::Cancel) => shared.send(Command::CancelStudy),
        None => {}
    }
    if shared.session.data.dataset.is_none() || shared.session.study.work.is_running() {
        return;
    }
    let shown = shared.session.study.run.is_some();
    if shown {
        let arrow = if order.open { "▾" } else { "▸" };
        let button = ui.small_button(format!("{arrow} New study"));
        let button = button.named(Role::Button, "New study");
        if button.on_hover_text("Study the listed frames with the settings in force.").clicked() {
            order.open = !order.open;
        }
        if !order.open {
            return;
        }
    }
    ui.horizontal_wrapped(|ui| {
        kind(ui, order);
        if order.study == StudyKind::Sweep {
            for k in 0..order.axes.len() {
                let edit = axis(ui, &mut order.axes[k], k, &config);
                if let Some(edit) = edit {
                    if std::mem::take(&mut order.typing) {
                        edit.request_focus();
                    }
                    begin |= edit.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
                }
            }
        }
    });
    match asked(shared.session, order) {
        Ok((grid, variants, frames)) => ui.horizontal_wrapped(|ui| {
            let run = ui.add_enabled(frames > 0, egui::Button::new("Run study"));
            let tip = "On all cores, from the settings in force. It is kept: the same study goes on where it was stopped, and \
                       one that is done is there at once.";
            if run.on_hover_text(tip).clicked() || begin && frames > 0 {
                order.open = false;
                shared.send(Command::RunStudy(StudyOrder { study: order.study, grid }));
            }
            let fits = variants * frames;
            let of = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
            let text = format!("{} × {} = {}", of(variants, "variant"), of(frames, "frame"), of(fits, "fit"));
            let color = if fits > MANY { tokens.warn } else { tokens.dim };
            ui.label(RichText::new(text).small().color(color)).on_hover_text(
                "Of the frames that are selected in the list, else of all that match its filter: filter, or select, to \
                 study fewer.",
            );
        }),
        Err(why) => ui.horizontal_wrapped(|ui| {
            ui.add_enabled(false, egui::Button::new("Run study"));
            ui.label(RichText::new(why).small().color(tokens.bad));
        }),
    };
    ui.add_space(4.0);
}

/// The grid, how many variants there are, and on how many frames; or what is wrong.
fn asked(session: &Session, order: &Order) -> Result<(Vec<GridAxis>, usize, usize), String> {
    let grid = order.grid()?;
    let frames = match session.labels.selection.len() {
        0 => session.queue.rows().len(),
        selected => selected,
    };
    let layout = session.data.dataset.as_ref().map_or("", |dataset| dataset.info().layout.word());
    let variants = points(order.study, &session.config, &grid, layout).map_err(|error| match error {
        RunError::Grid { message, .. } => message,
        other => other.to_string(),
    })?;
    Ok((grid, variants, frames))
}

fn kind(ui: &mut Ui, order: &mut Order) {
    let menu = egui::ComboBox::from_id_salt("study").width(120.0).selected_text(order.study.word());
    let response = menu.show_ui(ui, |ui| {
        for kind in StudyKind::ALL.into_iter().rev() {
            ui.selectable_value(&mut order.study, kind, kind.word()).on_hover_text(kind.title());
        }
    });
    response.response.named(Role::ComboBox, "Which study").on_hover_text(order.study.title());
    if order.study != StudyKind::Sweep {
        ui.label(RichText::new(order.study.title()).small());
    }
}

/// A setting and its values; answers the field of these.
fn axis(ui: &mut Ui, axis: &mut Axis, number: usize, config: &FitConfig) -> Option<egui::Response> {
    let title = axis.field.map_or("no second setting", |field| field.key);
    let menu = egui::ComboBox::from_id_salt(("axis", number)).width(110.0).selected_text(title).height(420.0);
    let response = menu.show_ui(ui, |ui| {
        if number > 0 && ui.selectable_label(axis.field.is_none(), "no second setting").clicked() {
            *axis = Axis::default();
        }
        for group in FieldGroup::ALL {
            ui.label(RichText::new(group.title()).small().weak());
            for field in FIELDS.iter().filter(|field| field.group == group) {
                let chosen = axis.field.is_some_and(|chosen| chosen.key == field.key);
                if ui.selectable_label(chosen, field.key).on_hover_text(field.tip()).clicked() {
                    *axis = Axis { field: Some(field), values: offered(field, config) };
                }
            }
        }
    });
    response.response.named(Role::ComboBox, &format!("Setting {}", number + 1));
    let field = axis.field?;
    let edit = egui::TextEdit::singleline(&mut axis.values).desired_width(130.0);
    let tip = format!("Values with commas between: {}. Enter runs the study.", field.expected());
    Some(ui.add(edit).named(Role::TextInput, &format!("Values of setting {}", number + 1)).on_hover_text(tip))
}

/// Values around what a setting is set to, over what the screen offers where that is nothing; every answer of a choice.
fn offered(field: &'static Field, config: &FitConfig) -> String {
    let number = |number: &Number, value: f64| {
        let ((lo, hi), whole) = (number.offered, number.whole);
        let share = |k: usize| k as f64 / (STEPS - 1) as f64;
        let at = |k: usize| if value > 0.0 { value * 2f64.powi(k as i32 - 2) } else { lo + (hi - lo) * share(k) };
        let near = |x: f64| if whole { x.round() } else { two_digits(x) };
        let mut values: Vec<f64> = (0..STEPS).map(|k| near(at(k)).clamp(number.range.0, number.range.1)).collect();
        values.dedup();
        values.into_iter().map(|x| field.text(Value::Number(x))).collect::<Vec<_>>()
    };
    let values = match (&field.kind, field.get(config)) {
        (FieldKind::Number(of), Value::Number(value)) => number(of, value),
        (FieldKind::Number(of), _) => number(of, of.unset.map_or(0.0, |unset| unset.first)),
        (FieldKind::Switch, _) => vec!["false".to_owned(), "true".to_owned()],
        (FieldKind::Choice(answers), _) => answers.iter().map(|answer| answer.word.to_owned()).collect(),
    };
    values.join(",")
}

/// The nearest number of two digits that count.
fn two_digits(x: f64) -> f64 {
    if x == 0.0 {
        return x;
    }
    let unit = 10f64.powi(1 - x.abs().log10().floor() as i32);
    (x * unit).round() / unit
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::config::Preset;

    #[test]
    fn what_is_offered_for_a_setting_can_be_swept() {
        for preset in Preset::ALL {
            for field in FIELDS {
                let values = offered(field, &preset.config());
                let axis: GridAxis = format!("{}={values}", field.key).parse().unwrap();
                let count = points(StudyKind::Sweep, &preset.config(), &[axis], "").unwrap();
                assert!(count > 1, "{}: {values}", field.key);
            }
        }
        let of = |key| offered(Field::of_key(key).unwrap(), &Preset::Baseline.config());
        assert_eq!((of("tau_pct").as_str(), of("iterations").as_str()), ("2.5,5,10,20,40", "25,50,100,200,400"));
    }
}
