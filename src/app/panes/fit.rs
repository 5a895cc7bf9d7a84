//! The fit: transport, the shown iteration's numbers, and every setting.

use super::{Dock, Pane, PaneState, PaneStates, Shared, ribbon};
use crate::app::commands::CTRL;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _, chip, icon_button, iou_color, rows, settings, value_row};
use crate::config::{Convergence, EmLoss, FIELDS, Field, FieldGroup, FitConfig, Preset, difference};
use crate::mhp::{MOST_BEGUN, MOST_UNLIKE, Precision, Scope, StopReason, TERMS, TermId, Terms, formula};
use crate::session::{Command, FitStatus, IterationRow, Live, LiveFrom, RunSpeed, Session};
use egui::{Key, RichText, Ui};

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Fit",
    title: "Fit",
    icon: &[
        Mark::Line(&[[1.0, 3.5], [15.0, 3.5]]),
        Mark::Line(&[[1.0, 8.0], [15.0, 8.0]]),
        Mark::Line(&[[1.0, 12.5], [15.0, 12.5]]),
        Mark::Dot([5.0, 3.5], 2.0),
        Mark::Dot([11.0, 8.0], 2.0),
        Mark::Dot([6.5, 12.5], 2.0),
    ],
    help: "the run, the numbers of the iteration that is shown, and every setting",
    dock: Dock::RightTop,
    keys: &[(CTRL, Key::Num6)],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank: |_| None,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// What the pane remembers.
#[derive(Default)]
struct State {
    /// What is looked for among the settings.
    search: String,
    /// The agreement at every τ.
    ribbon: ribbon::Ribbon,
}

impl PaneState for State {
    fn is_working(&self) -> bool {
        self.ribbon.is_working()
    }
}

/// The setting beside the presets.
const PEOPLE: &str = "people";

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>) {
    let old = shared.session.config;
    let mut config = old;
    presets(ui, &mut config);
    let people: Vec<&Field> = FIELDS.iter().filter(|field| field.key == PEOPLE).collect();
    // As wide as the rows below it, which scroll.
    ui.scope(|ui| {
        ui.set_max_width(ui.available_width() - ui.spacing().scroll.allocated_width());
        rows(ui, &people, &mut config);
    });
    transport(ui, shared);
    watching(ui, shared);
    // In scopes of their own: what appears in them must not shift the identity of a number that is being typed below.
    ui.scope(|ui| status(ui, shared));
    ui.separator();
    change(ui, shared, &old, &config);
}

/// Asks for the settings that were set: still under a finger, or an act of their own.
fn change(ui: &Ui, shared: &mut Shared<'_>, old: &FitConfig, config: &FitConfig) {
    if config != old {
        let held = ui.input(|i| i.pointer.any_down());
        let command = if held { Command::DragConfig } else { Command::SetConfig };
        shared.send(command(Box::new(*config)));
    }
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    // What is above is as wide as if it scrolled too: numbers stand in one column.
    let area =
        egui::ScrollArea::vertical().scroll_bar_visibility(egui::scroll_area::ScrollBarVisibility::AlwaysVisible);
    area.auto_shrink(false).show(ui, |ui| {
        let old = shared.session.config;
        let mut config = old;
        settings(ui, FieldGroup::Weights, &mut config);
        if shared.session.fit.shown.is_some() {
            ui.push_id("ribbon", |ui| ribbon::show(ui, shared, &mut state.ribbon, &mut config));
        }
        ui.separator();
        ui.scope(|ui| numbers(ui, shared));
        ui.separator();
        sections(ui, shared, state, &mut config);
        change(ui, shared, &old, &config);
    });
}

fn transport(ui: &mut Ui, shared: &mut Shared<'_>) {
    let fit = &shared.session.fit;
    let (ready, running, shown) = (fit.is_ready(), fit.is_running(), fit.shown_iteration());
    let head = fit.head();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let (sign, name) = if running { ("‖", "Pause fit") } else { ("∂", "Run fit") };
        let text = RichText::new(if running { format!("{sign} Pause") } else { format!("{sign} Run") });
        let response = ui.add_enabled(ready, egui::Button::new(text).min_size(egui::vec2(60.0, 24.0)));
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, ready, name));
        if response.on_hover_text("Run the asked number of iterations, or pause.\nKey: Enter").clicked() {
            shared.invoke("Run or pause");
        }
        if icon_button(ui, "−1", "Step back", "Show the iteration before.\nKey: ,", ready && shown > 0, false).clicked() {
            shared.invoke("One step back");
        }
        if icon_button(ui, "+1", "Step forward", "One iteration forward.\nKey: .", ready && !(running && shown == head), false).clicked() {
            shared.invoke("One step");
        }
        if icon_button(ui, "+10", "Ten steps forward", "Ten iterations forward.\nKey: Shift+.", ready && !(running && shown == head), false).clicked() {
            shared.invoke("Ten steps");
        }
        if icon_button(ui, "↺", "Reset fit", "Find a new start pose with the current settings and forget every iteration of this frame.\nKey: Ctrl+R", shared.session.data.frame.is_some(), false).clicked() {
            shared.invoke("Reset fit");
        }
        if icon_button(ui, "✕", "Discard run", "Remove this branch and go back to where it began; on the first branch, back to the start pose.\nKey: Ctrl+Backspace", ready && head > 0, false).clicked() {
            shared.invoke("Discard run");
        }
    });
}

/// How a fit is watched: whether it follows a finger, how fast it runs, and once more.
fn watching(ui: &mut Ui, shared: &mut Shared<'_>) {
    let view = &shared.session.view;
    let (live, mut from, mut speed) = (shared.session.is_live(), view.live_from, view.speed);
    let took = shared.session.fit_ms().map_or_else(String::new, |ms| format!(" A fit takes about {ms:.0} ms here."));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.spacing_mut().button_padding.x = 6.0;
        let tip = format!(
            "While a setting is dragged the fit is done anew with it, on one branch that is an act when the finger is lifted.{took} Off: settings count from the next step on. On by itself where a fit takes less than {:.0} ms.\nKey: Shift+L",
            Live::QUICK_MS
        );
        let switch = ui.selectable_label(live, "Live").named(egui::Role::Button, "Live fit");
        if switch.on_hover_text(tip).clicked() {
            shared.invoke("Live fit");
        }
        let name = |from: LiveFrom| if from == LiveFrom::Start { "start" } else { "here" };
        let tip = "Where a live fit begins: at the start pose, or at the iteration on screen when the finger goes down.";
        let choice = egui::ComboBox::from_id_salt("live from").width(38.0).selected_text(name(from)).show_ui(ui, |ui| {
            for one in [LiveFrom::Start, LiveFrom::Shown] {
                ui.selectable_value(&mut from, one, name(one));
            }
        });
        choice.response.named(egui::Role::ComboBox, "Live fit from").on_hover_text(tip);
        let tip = "Iterations a second of a run or a replay.";
        let choice = egui::ComboBox::from_id_salt("speed").width(44.0).selected_text(speed.title()).show_ui(ui, |ui| {
            for one in RunSpeed::ALL {
                ui.selectable_value(&mut speed, one, one.title());
            }
        });
        choice.response.named(egui::Role::ComboBox, "Speed of a run").on_hover_text(tip);
        let (playing, ready) = (shared.session.fit.replay.is_some(), shared.session.fit.is_ready());
        let can = ready && !shared.session.fit.is_running() && shared.session.fit.branch().is_some_and(|b| b.rows.len() > 1);
        let text = if playing { "Stop replay" } else { "Replay" };
        let button = ui.add_enabled(can, egui::Button::new(text));
        if button.on_hover_text("Show the iterations of this branch one after the other, at that speed.\nKey: Shift+Enter").clicked() {
            shared.invoke("Replay");
        }
    });
    if (from, speed) != (shared.session.view.live_from, shared.session.view.speed) {
        shared.set_view(|view| (view.live_from, view.speed) = (from, speed));
    }
}

fn status(ui: &mut Ui, shared: &mut Shared<'_>) {
    let tokens = Tokens::of(ui);
    let fit = &shared.session.fit;
    let (word, color) = match &fit.status {
        FitStatus::Idle => ("no frame", tokens.dim),
        FitStatus::Preparing => ("preparing…", tokens.dim),
        FitStatus::Paused if fit.cursor.is_some() => ("looking back", tokens.warn),
        FitStatus::Paused => ("paused", tokens.dim),
        FitStatus::Running => ("running", tokens.accent),
        FitStatus::Failed(_) => ("failed", tokens.bad),
    };
    // One line in every state: what is below must not move from under the pointer when a run begins or ends.
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let state = chip(ui, word, color);
        if let Some(row) = fit.shown_row()
            && row.report.iteration > 0
            && !fit.is_running()
        {
            judgement(ui, shared.session, row, &tokens);
        }
        // In the fit's own words "converged" reads as success: the criterion has a chip of its own.
        let reason = fit.reason.filter(|reason| *reason != StopReason::Converged.text());
        state.on_hover_text(reason.unwrap_or("What the fit of this frame is doing."));
        if let FitStatus::Failed(why) = &fit.status {
            ui.label(RichText::new(why).small().color(tokens.bad));
        }
    });
    // Always there: a branch that begins while a slider is dragged must not move the slider.
    branches(ui, shared);
    let line = egui::vec2(ui.available_width(), START_LINE);
    ui.allocate_ui_with_layout(line, egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.set_min_height(START_LINE);
        start(ui, shared);
    });
}

/// Three questions that are not one: does the paper's criterion hold, does the fit still move, is the echo explained.
fn judgement(ui: &mut Ui, session: &Session, row: &IterationRow, tokens: &Tokens) {
    if let Some(iou) = row.iou() {
        let least = row.report.iou.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        // Which settings stepped there: a fit by levels is no worse for masks that it was not asked for.
        let by_levels = session.fit.shown_config().is_some_and(|config| config.objective == EmLoss::NccDb);
        let em = row.report.terms.get("em").filter(|_| by_levels);
        let (word, color) = explained(em, (iou, least), tokens);
        let told = match em {
            Some(em) => format!("L_EM {em:.3}: up to {CLEAR} the levels of the measured maps are those of the body"),
            None => format!(
                "Mean IoU of the masks {iou:.3}: from 0.5 on most of the measured echo is explained by the fit, and little else is simulated"
            ),
        };
        let part = format!("; in part, where the masks of one view stay below {LITTLE} ({least:.3}).");
        chip(ui, word, color).on_hover_text(told + &part);
    }
    if let Some(settled) = session.fit.settled() {
        let (word, color) = if settled { ("settled", tokens.dim) } else { ("moving", tokens.warn) };
        chip(ui, word, color).on_hover_text(
            "Over the last ten iterations the loss changed by less than 0.1 %, no joint moved more than 2 mm, and none by more \
             than a fifth of what the learning rate lets it: the gradient is small. Or not: more iterations would change the fit.",
        );
    }
    if row.report.converged {
        let progress = match session.config.convergence {
            Convergence::Change => "L changed",
            Convergence::Improvement => "L fell",
        };
        let chip = chip(ui, "criterion", tokens.dim).named(egui::Role::Label, "Convergence criterion holds");
        chip.on_hover_text(format!(
            "The paper's criterion holds: L < 1, or {progress} by less than 0.5 % over five iterations; every joint finite and every bone within 0.5–1.5 of its reference. At iteration 0 it nearly always does: it is no success by itself."
        ));
    }
}

/// Height of what is said of the start, points.
const START_LINE: f32 = 18.0;
/// An IoU below which a view is not explained, whatever the others are.
const LITTLE: f64 = 0.3;

/// L_EM up to which levels are explained, and beyond which they are of something else: as the fit itself has it.
const CLEAR: f64 = MOST_BEGUN[0];
const UNLIKE: f64 = MOST_UNLIKE[0];

/// How well a fit explains maps, in words: by L_EM where levels were compared, else by masks of a mean and a least IoU; good only
/// where no view is bad.
fn explained(em: Option<f64>, (mean, least): (f64, f64), tokens: &Tokens) -> (&'static str, egui::Color32) {
    let (explains, poorly) = match em {
        Some(em) => (em <= CLEAR, if em <= UNLIKE { tokens.warn } else { tokens.bad }),
        None => (mean >= 0.5, iou_color(tokens, mean)),
    };
    match (explains, least >= LITTLE) {
        (true, true) => ("explained", tokens.ok),
        (true, false) => ("part explained", tokens.warn),
        (false, _) => ("not explained", poorly),
    }
}

/// How the start came about, a line that is always there: the rest is its tooltip. Where settings ask for another one, the
/// button that finds it.
fn start(ui: &mut Ui, shared: &mut Shared<'_>) {
    let tokens = Tokens::of(ui);
    if shared.session.needs_new_start() {
        return new_start(ui, shared, &tokens);
    }
    let found = shared.session.fit.found_start.as_ref().map(|found| &found.initialisation);
    let (text, color) = match found {
        None => ("Start: —", tokens.dim),
        Some(found) => match (&found.motion, found.notes.first()) {
            // Why, and everything else, is told where the pointer rests.
            (Some(Err(held)), _) => (held.split(';').next().unwrap_or(held), tokens.warn),
            (Some(Ok(note)), _) | (None, Some(note)) => (note.as_str(), tokens.dim),
            (None, None) => ("Start: from the peaks", tokens.dim),
        },
    };
    let line = ui.add(egui::Label::new(RichText::new(text).small().color(color)).truncate());
    if let Some(found) = found.filter(|found| !found.notes.is_empty()) {
        line.on_hover_text(found.notes.join("\n"));
    }
}

fn new_start(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let session = shared.session;
    let changed = session.fit.start_config.map_or_else(String::new, |old| difference(&old, &session.config));
    let tip = format!(
        "Settings that only a start reads have changed since this one was found: {changed}.\nFinds a new start and fits from there; the iterations of this frame are forgotten."
    );
    let button = egui::Button::new(RichText::new("↺ new start needed").small().color(tokens.warn)).small();
    if ui.add(button).on_hover_text(tip).clicked() {
        shared.invoke("Reset fit");
    }
}

fn branches(ui: &mut Ui, shared: &mut Shared<'_>) {
    let history = &shared.session.fit.history;
    let active = history.active_id();
    let name = |id: u32, parent: Option<(u32, usize)>, head: usize| match parent {
        None => format!("branch {id}: 0 → {head}"),
        Some((from, at)) => format!("branch {id}: from {from} at {at} → {head}"),
    };
    let mut chosen = active;
    let current = history.active().map_or_else(String::new, |b| name(b.id, b.parent, b.head()));
    egui::ComboBox::from_id_salt("branch")
        .width(ui.available_width() - 8.0)
        .selected_text(current)
        .show_ui(ui, |ui| {
            for b in history.branches() {
                let text = match history.departure(b) {
                    what if what.is_empty() => name(b.id, b.parent, b.head()),
                    what => format!("{}, {what}", name(b.id, b.parent, b.head())),
                };
                ui.selectable_value(&mut chosen, b.id, text);
            }
        })
        .response
        .named(egui::Role::ComboBox, "Branch")
        .on_hover_text(
            "Branches of this fit. Changing a setting at an earlier iteration starts a new one and keeps the old.",
        );
    if chosen != active {
        shared.send(Command::SelectBranch(chosen));
    }
}

fn numbers(ui: &mut Ui, shared: &Shared<'_>) {
    let tokens = Tokens::of(ui);
    let fit = &shared.session.fit;
    let Some(row) = fit.shown_row() else {
        // The same rows without numbers, so that nothing jumps while the next frame is prepared.
        let arrays =
            shared.session.data.dataset.iter().flat_map(|d| &d.info().views).map(|v| format!("IoU {}", v.array));
        let terms = TERMS.iter().filter(|term| term.scope == Scope::Always).map(|term| term.label);
        let names = ["Iteration", "L total"].into_iter().chain(terms).map(str::to_owned);
        for name in names.chain(arrays) {
            value_row(ui, &name, "—", "");
        }
        if let Some(error) = &shared.session.data.error {
            ui.label(RichText::new(error).small().color(tokens.bad));
        }
        return;
    };
    let report = &row.report;
    // Settings may have changed since the row was made: while the newest iteration is shown, the snapshot is the truth.
    let evaluation = fit.shown.as_ref().filter(|s| s.iteration == report.iteration).map(|s| &s.evaluation);
    let (loss, terms, iou) =
        evaluation.map_or((report.loss, report.terms, report.iou.clone()), |e| (e.loss, e.terms, e.iou.clone()));
    value_row(ui, "Iteration", &format!("{} / {}", report.iteration, fit.head()), "");
    if let Some(count) = fit.found_start.as_ref().and_then(|found| found.count.as_ref()) {
        let (people, chances) = (count.people(), count.probabilities.map(|p| format!("{:.0} %", 100.0 * p)));
        let chance = chances.get(people).cloned().unwrap_or_default();
        value_row(ui, "People counted", &format!("{people} ({chance})"), "").on_hover_text(format!(
            "0 to 4 and more: {}. Fitted: {}; “people” above overrides the count.",
            chances.join(", "),
            fit.initial.as_ref().map_or(0, |initial| initial.shape().persons)
        ));
    }
    value_row(ui, "L total", &format!("{loss:.5}"), "").on_hover_text(formula());
    for (term, value) in shown_terms(&terms) {
        value_row(ui, term.label, &format!("{value:.5}"), "").on_hover_text(term.tooltip());
    }
    let names = fit.problem.iter().flat_map(|p| &p.views).map(|v| v.array.as_str());
    for (name, iou) in names.zip(&iou) {
        ui.horizontal(|ui| {
            ui.label(RichText::new(format!("IoU {name}")).color(tokens.dim));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add_sized([26.0, 16.0], egui::Label::new(""));
                let (text, color) =
                    iou.map_or(("—".into(), tokens.dim), |x| (format!("{x:.3}"), iou_color(&tokens, x)));
                ui.label(RichText::new(text).font(theme::mono(12.0)).color(color));
            });
        })
        .response
        .on_hover_text("Forward-consistency IoU of the hard masks over the EM region.");
    }
    if let Some(majpe) = row.majpe_mm {
        value_row(ui, "MAJPE", &format!("{majpe:.1}"), "mm")
            .on_hover_text("Mean absolute joint position error against the data set's joints.");
    }
}

/// The terms that every fit has, and of the others those of a scope where one of them is not 0.
fn shown_terms(terms: &Terms) -> impl Iterator<Item = (TermId, f64)> {
    let there = |scope: Scope| terms.iter().any(|(term, value)| term.scope == scope && value != 0.0);
    terms.iter().filter(move |(term, _)| term.scope == Scope::Always || there(term.scope))
}

/// Every setting but those above, each group under its head; or those that are looked for.
fn sections(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, config: &mut FitConfig) {
    let search =
        egui::TextEdit::singleline(&mut state.search).hint_text("Search the settings").desired_width(f32::INFINITY);
    ui.add(search).named(egui::Role::SearchInput, "Search the settings");
    let rest = |field: &&Field| field.group != FieldGroup::Weights && field.key != PEOPLE;
    if !state.search.trim().is_empty() {
        let found: Vec<&Field> = FIELDS.iter().filter(|field| fits(field, &state.search)).collect();
        if found.is_empty() {
            ui.label(RichText::new("No setting is called that.").small().color(Tokens::of(ui).dim));
        }
        return rows(ui, &found, config);
    }
    for group in FieldGroup::ALL.into_iter().filter(|group| *group != FieldGroup::Weights) {
        let open = matches!(group, FieldGroup::Optimiser | FieldGroup::Radar | FieldGroup::Model);
        egui::CollapsingHeader::new(group.title()).default_open(open).show_unindented(ui, |ui| {
            if !group.help().is_empty() {
                ui.label(RichText::new(group.help()).small());
            }
            rows(ui, &group.fields().filter(rest).collect::<Vec<_>>(), config);
            if group == FieldGroup::Optimiser {
                ways(ui, shared);
            }
        });
    }
}

/// Whether every word that was typed is in a setting's label, key, group or help.
fn fits(field: &Field, search: &str) -> bool {
    let text = format!("{} {} {} {}", field.label, field.key, field.group.title(), field.help).to_lowercase();
    search.to_lowercase().split_whitespace().all(|word| text.contains(word))
}

/// How fits are run: no settings of a fit, and in no `FIT.toml`.
fn ways(ui: &mut Ui, shared: &mut Shared<'_>) {
    let mut warm = shared.session.warm_start;
    if ui
        .checkbox(&mut warm, "Warm start")
        .on_hover_text("Start the next frame from this frame's result instead of from its own peaks.")
        .changed()
    {
        shared.send(Command::SetWarmStart(warm));
    }
    let mut along = shared.session.along;
    let reach = shared.session.config.decode_frames;
    let tip = format!(
        "The {reach} frames on each side (decode_frames) decide with this one which of the bodies found in it is fitted, as in runs over many frames. The first frame of a sequence takes some seconds, the next ones no longer than usual. Changing it resets the fit."
    );
    if ui.checkbox(&mut along, "Start along the sequence").on_hover_text(tip).changed() {
        shared.send(Command::SetAlong(along));
    }
    let mut precision = shared.session.precision;
    ui.horizontal(|ui| {
        ui.label("Kernel");
        ui.selectable_value(&mut precision, Precision::F64, "f64")
            .on_hover_text("Double precision, the oracle: some seventy times as slow. Changing it resets the fit.");
        ui.selectable_value(&mut precision, Precision::F32, "f32")
            .on_hover_text("Single precision, right to five digits. Changing it resets the fit.");
    });
    if precision != shared.session.precision {
        shared.send(Command::SetPrecision(precision));
    }
    let mut auto = shared.session.view.run_on_open;
    if ui
        .checkbox(&mut auto, "Fit each frame when shown")
        .on_hover_text("Begin a run as soon as a frame without a fit is shown.")
        .changed()
    {
        shared.set_view(|v| v.run_on_open = auto);
    }
}

/// Every setting at once, by name, above everything whose height depends on the fit: no button moves under the pointer.
fn presets(ui: &mut Ui, config: &mut FitConfig) {
    let tokens = Tokens::of(ui);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.spacing_mut().button_padding.x = 6.0;
        for preset in Preset::ALL {
            let button = ui.selectable_label(*config == preset.config(), preset.name());
            let button = button.named(egui::Role::Button, &format!("Preset {}", preset.name()));
            let tip = match difference(config, &preset.config()) {
                what if what.is_empty() => preset.help().to_owned(),
                what => format!("{}\nSets {what}", preset.help()),
            };
            if button.on_hover_text(tip).clicked() {
                *config = preset.config();
            }
        }
    });
    let chosen = Preset::ALL.into_iter().find(|preset| *config == preset.config());
    let nearest = Preset::nearest(config);
    let (what, color) = match chosen {
        Some(preset) => (preset.brief().to_owned(), tokens.dim),
        None => (format!("{}, modified: {}", nearest.name(), difference(&nearest.config(), config)), tokens.warn),
    };
    let line = ui.add(egui::Label::new(RichText::new(what).small().color(color)).truncate());
    if let Some(preset) = chosen {
        line.on_hover_text(preset.help());
    }
}

#[cfg(test)]
mod explained_tests {
    use super::*;

    /// No red IoU stands beside a green chip, whatever the views say.
    #[test]
    fn what_is_said_of_a_fit_is_green_only_where_every_view_is() {
        let tokens = theme::DARK;
        for (first, second) in (0..=20).flat_map(|a| (0..=20).map(move |b| (f64::from(a) / 20.0, f64::from(b) / 20.0)))
        {
            let red = [first, second].iter().any(|iou| iou_color(&tokens, *iou) == tokens.bad);
            for em in [None, Some(0.06)] {
                let (word, color) = explained(em, (0.5 * (first + second), first.min(second)), &tokens);
                assert!(!(red && color == tokens.ok), "{word} with {first} and {second}");
            }
        }
        assert_eq!(explained(None, (0.51, 0.29), &tokens).0, "part explained");
        assert_eq!(explained(None, (0.6, 0.5), &tokens), ("explained", tokens.ok));
    }

    #[test]
    fn levels_are_judged_where_levels_were_compared() {
        let tokens = theme::DARK;
        let of = |em: f64| explained(Some(em), (0.42, 0.35), &tokens);
        assert_eq!(of(0.09), ("explained", tokens.ok));
        assert_eq!((of(0.3), of(0.5)), (("not explained", tokens.warn), ("not explained", tokens.bad)));
        assert_eq!(explained(None, (0.42, 0.35), &tokens).0, "not explained");
    }
}

#[cfg(all(test, feature = "dummies"))]
mod tests {
    use super::*;

    #[test]
    fn the_dummy_term_has_a_number_and_is_explained() {
        let terms = Terms::from_fn(|term| if term.key == "dummy" { 0.7 } else { 0.0 });
        let shown: Vec<(&str, f64)> = shown_terms(&terms).map(|(term, value)| (term.label, value)).collect();
        assert!(shown.contains(&("L_dummy", 0.7)) && shown.contains(&("L_joint", 0.0)), "{shown:?}");
        assert!(shown.iter().all(|(label, _)| !["L_sep", "L_coll"].contains(label)), "{shown:?}");
        assert!(
            formula().ends_with(" + w_prior·L_prior + w_net·L_net + w_given·L_given + w_dummy·L_dummy"),
            "{}",
            formula()
        );
        let said: Vec<String> = TERMS.iter().map(crate::mhp::Term::tooltip).collect();
        assert!(
            said.contains(&"L_dummy = ½ Σ ‖p‖², m². How far the joints are from the radar.".to_owned()),
            "{said:?}"
        );
    }
}
