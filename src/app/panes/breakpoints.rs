//! Breakpoints: where runs stop, each with a switch, how often it was hit, and where last.

use super::{Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::theme::Tokens;
use crate::app::widgets::{Mark, Named as _};
use crate::condition::syntax;
use crate::session::{Command, StopPoint};
use egui::{Key, RichText, Role, Ui};

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Breakpoints",
    title: "Breakpoints",
    icon: &[
        Mark::Line(&[
            [5.2, 1.5],
            [10.8, 1.5],
            [14.5, 5.2],
            [14.5, 10.8],
            [10.8, 14.5],
            [5.2, 14.5],
            [1.5, 10.8],
            [1.5, 5.2],
            [5.2, 1.5],
        ]),
        Mark::Line(&[[6.0, 5.0], [6.0, 11.0]]),
        Mark::Line(&[[10.0, 5.0], [10.0, 11.0]]),
    ],
    help: "conditions at which runs stop, and how often each did",
    dock: Dock::Bottom,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank: |_| None,
    toolbar: Some(|ui, shared, states| toolbar(ui, shared, states.of())),
    ui: |ui, shared, _| show(ui, shared),
};

/// What is being typed.
#[derive(Default)]
struct State {
    text: String,
}

impl PaneState for State {}

/// Conditions that are often asked for.
const OFTEN: [(&str, &str); 4] = [
    ("iou<0.4 iteration>10", "The masks part."),
    ("step_mm>20", "A joint jumps."),
    ("l_bone rises 5", "The bones give way, five iterations in a row."),
    ("em·kine<-0.9", "The maps and the body want opposite things."),
];

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let tokens = Tokens::of(ui);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let field = egui::TextEdit::singleline(&mut state.text).hint_text("Stop where… iou<0.4").desired_width(220.0);
        let field = ui.add(field).named(Role::TextInput, "Stop where").on_hover_text(syntax());
        let entered = field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        let typed = !state.text.trim().is_empty();
        let wrong = typed.then(|| shared.session.breakpoint_of(&state.text).err()).flatten();
        let add = ui.add_enabled(typed && wrong.is_none(), egui::Button::new("Add"));
        let add = add.named(Role::Button, "Add breakpoint").on_hover_text("Runs stop there from now on.");
        if (add.clicked() || entered) && typed && wrong.is_none() {
            shared.send(Command::AddBreakpoint(std::mem::take(&mut state.text)));
        }
        match &wrong {
            Some(why) => {
                ui.add(egui::Label::new(RichText::new(why).small().color(tokens.bad)).truncate()).on_hover_text(why);
            }
            None if !typed => {
                for (condition, tip) in OFTEN {
                    let known = shared.session.breakpoints.list().iter().any(|point| point.text == condition);
                    let button = egui::Button::new(RichText::new(condition).small()).small();
                    let button = ui.add_enabled(!known, button).named(Role::Button, &format!("Break at {condition}"));
                    if button.on_hover_text(tip).clicked() {
                        shared.send(Command::AddBreakpoint(condition.into()));
                    }
                }
            }
            None => {}
        }
    });
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>) {
    let tokens = Tokens::of(ui);
    let list = shared.session.breakpoints.list().to_vec();
    if list.is_empty() {
        let text = "No breakpoint. Runs go to their end; a condition typed above stops them where it begins to hold, and again \
                    after it did not hold in between.";
        ui.add(egui::Label::new(RichText::new(text).small().color(tokens.dim)).wrap());
        return;
    }
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        for point in &list {
            row(ui, shared, point, &tokens);
        }
    });
}

fn row(ui: &mut Ui, shared: &mut Shared<'_>, point: &StopPoint, tokens: &Tokens) {
    let StopPoint { id, text, enabled, hits, last } = point;
    ui.horizontal(|ui| {
        let mut on = *enabled;
        let switch = ui.checkbox(&mut on, "");
        switch.widget_info(|| egui::WidgetInfo::selected(Role::CheckBox, true, *enabled, format!("Stop where {text}")));
        if switch.on_hover_text("Whether runs stop there.").changed() {
            shared.send(Command::EnableBreakpoint(*id, on));
        }
        let remove = ui.add(egui::Button::new("✕").small().frame(false));
        let remove = remove.named(Role::Button, &format!("Remove {text}"));
        if remove.on_hover_text("Forget this breakpoint.").clicked() {
            shared.send(Command::RemoveBreakpoint(*id));
        }
        let color = if *enabled { tokens.text } else { tokens.dim };
        ui.label(RichText::new(text).color(color));
        let hit = match hits {
            0 => "not hit".to_owned(),
            1 => "hit once".to_owned(),
            n => format!("hit {n} times"),
        };
        ui.label(RichText::new(hit).small().color(if *hits > 0 { tokens.warn } else { tokens.dim }));
        if let Some((frame, iteration)) = *last {
            let here = frame == shared.session.data.frame_index;
            let words = if here {
                format!("at iteration {iteration}")
            } else {
                format!("in frame {frame} at iteration {iteration}")
            };
            let link = ui.link(RichText::new(&words).small());
            if link.named(Role::Link, &format!("{text}: {words}")).on_hover_text("Show it.").clicked() {
                let goto = if here { Command::GotoIteration(iteration) } else { Command::GotoFrame(frame) };
                shared.send(goto);
            }
        }
    });
}
