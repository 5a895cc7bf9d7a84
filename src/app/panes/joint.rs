//! The joint inspector: every parameter of the selected joint, its gradient split into what the maps, the body and the
//! frames around contribute, and fields to edit it by hand.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::{AppAct, CTRL};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::mhp::{Scope, TermGroup, TermId, Terms, Weight};
use crate::session::{Command, Session};
use egui::{Key, RichText, Ui};

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Joint",
    title: "Joint",
    icon: &[
        Mark::Line(&[[2.0, 14.5], [6.3, 9.7]]),
        Mark::Line(&[[9.7, 6.3], [14.5, 2.0]]),
        Mark::Ring([8.0, 8.0], 2.4),
    ],
    help: "every parameter of the selected joint, and its gradient",
    dock: Dock::RightTop,
    keys: &[(CTRL, Key::Num7)],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| picker(ui, shared)),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// What a click on a joint does, or on none where there is no joint: it is selected, and this pane shows it, also where it was
/// selected already and the pane is behind another.
pub(super) fn select(shared: &mut Shared<'_>, joint: Option<usize>) {
    if joint != shared.session.joint {
        shared.send(Command::SelectJoint(joint));
    }
    if joint.is_some() {
        shared.app(AppAct::ShowPane(&PANE));
    }
}

/// Values that are being edited.
#[derive(Default)]
struct State {
    edit: Option<(u64, u32, usize, Pppr)>,
}

impl PaneState for State {}

/// Names, units and step of a group's components.
fn components(group: Group) -> (&'static str, &'static [&'static str], &'static str, f64) {
    match group {
        Group::Position => ("Position p", &["x", "y", "z"], "m", 0.005),
        Group::LogScale => ("Log scale ln s", &["x", "y", "z"], "", 0.01),
        Group::Rotation => ("Rotation q", &["w", "x", "y", "z"], "", 0.005),
        Group::Velocity => ("Velocity v", &["x", "y", "z"], "m/s", 0.01),
        Group::Beta => ("Opacity β", &["β"], "", 0.02),
        Group::Omega => ("Doppler features ω", &[], "rad·s/m²", 0.01),
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let fitted = session.fit.problem.is_some() && session.fit.shown.is_some();
    let how = "The parameters of a joint appear here once a frame is fitted.";
    (!fitted).then(|| Blank::new("No joint", how))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let (Some(problem), Some(snapshot)) = (&session.fit.problem, &session.fit.shown) else { return };
    let joints = problem.skeleton.joints.len().max(1);
    let Some(joint) = session.joint.filter(|j| *j < snapshot.params.shape().total_joints()) else {
        let how = "Click a joint in the 3-D view or on a map, or choose one above.";
        return Blank::new("No joint selected", how).show(ui);
    };
    let key = (snapshot.job, snapshot.branch, snapshot.iteration);
    if state.edit.as_ref().is_none_or(|(job, branch, iteration, _)| (*job, *branch, *iteration) != key) {
        state.edit = Some((key.0, key.1, key.2, snapshot.params.clone()));
    }
    let Some((.., edited)) = &mut state.edit else { return };
    let evaluation = &snapshot.evaluation;
    let parts = parts(&snapshot.config, &evaluation.terms);
    let tokens = Tokens::of(ui);
    let editable = session.fit.is_ready() && !session.fit.is_running();
    let mut committed = false;
    egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        derived(ui, &snapshot.params, joint, &tokens);
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("gradient of").size(10.0).color(tokens.dim));
            for part in &parts {
                ui.label(RichText::new(format!("■ {}", part.label)).size(10.0).color(tokens.group(part.group)))
                    .on_hover_text(format!("Gradient of the weighted {}.", part.words));
            }
        });
        let grid = egui::Grid::new("joint parameters").num_columns(2 + parts.len());
        grid.spacing([6.0, 2.0]).min_col_width(44.0).show(ui, |ui| {
            for group in Group::ALL.into_iter().filter(|g| *g != Group::Omega) {
                let (title, names, unit, speed) = components(group);
                let title_text = if unit.is_empty() { title.to_owned() } else { format!("{title} / {unit}") };
                ui.label(RichText::new(title_text).small().color(tokens.text));
                ui.end_row();
                let slopes: Vec<_> = parts
                    .iter()
                    .map(|part| (part.group, evaluation.joint_gradient(part.group, &snapshot.config, group, joint)))
                    .collect();
                for (i, name) in names.iter().enumerate() {
                    ui.label(RichText::new(format!("   {name}")).color(tokens.dim));
                    let value = &mut edited.joint_mut(group, joint)[i];
                    let drag = egui::DragValue::new(value).update_while_editing(false).speed(speed).fixed_decimals(4);
                    let response = ui.add_enabled(editable, drag);
                    let spoken = format!("{title} {name}");
                    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, editable, &spoken));
                    let tip =
                        if editable { "Edit by hand. An edit starts a branch." } else { "Pause the run to edit." };
                    committed |= response.drag_stopped() || (response.changed() && !response.dragged());
                    response.on_hover_text(tip).on_disabled_hover_text(tip);
                    for (part, slopes) in &slopes {
                        ui.label(gradient(slopes[i], tokens.group(*part), &tokens));
                    }
                    ui.end_row();
                }
            }
        });
        ui.add_space(4.0);
        omega(ui, &snapshot.params, &evaluation.gradient, joint, &tokens);
    });
    debug_assert!(joint / joints < snapshot.params.shape().persons);
    if committed && *edited != snapshot.params {
        let params = Box::new(edited.clone());
        state.edit = None;
        shared.send(Command::EditParams(params));
    }
}

/// A part of the gradient that has a column of its own.
struct Part {
    group: TermGroup,
    /// `w_EM·L_EM`.
    label: String,
    /// `kinematic terms`.
    words: String,
}

/// The parts that a gradient under these settings has, of terms with these values: the temporal one only where something of it is
/// weighed.
fn parts(config: &FitConfig, values: &Terms) -> Vec<Part> {
    let is_there = |term: TermId| match term.scope {
        Scope::Always | Scope::People => true,
        Scope::Weighed => term.weight.of(config) > 0.0,
        Scope::Given => values[term] > 0.0,
    };
    let of_group = |group: TermGroup| {
        let weights: Vec<Weight> = group.weights().filter(|weight| weight.terms().any(is_there)).collect();
        let labels: Vec<String> = weights.iter().map(|w| format!("{}·{}", w.label(), w.sum_label())).collect();
        let count = weights.iter().map(|w| w.terms().count()).sum::<usize>();
        let words = format!("{} term{}", group.word(), if count == 1 { "" } else { "s" });
        (count > 0).then(|| Part { group, label: labels.join(" + "), words })
    };
    TermGroup::ALL.into_iter().filter_map(of_group).collect()
}

/// A joint chosen by name, and the one before or after.
fn picker(ui: &mut Ui, shared: &mut Shared<'_>) {
    let session = shared.session;
    let Some(problem) = &session.fit.problem else { return };
    let skeleton = &problem.skeleton;
    let joints = skeleton.joints.len().max(1);
    let total = session.shown_positions().len();
    let name = |j: usize| {
        let name = skeleton.shown_name(j % joints);
        if total > joints { format!("person {} · {name}", j / joints + 1) } else { name }
    };
    let mut chosen = session.joint;
    ui.horizontal(|ui| {
        let text = chosen.map_or_else(|| "choose a joint".into(), name);
        let combo = egui::ComboBox::from_id_salt("joint").width(150.0).selected_text(text);
        combo
            .show_ui(ui, |ui| {
                for j in 0..total {
                    ui.selectable_value(&mut chosen, Some(j), name(j));
                }
            })
            .response
            .named(egui::Role::ComboBox, "Joint");
        for (sign, step, spoken) in [("◂", total.saturating_sub(1), "Previous joint"), ("▸", 1, "Next joint")] {
            let tip = format!("{spoken} of the skeleton.");
            if crate::app::widgets::icon_button(ui, sign, spoken, &tip, total > 0, false).clicked() {
                chosen = Some(chosen.map_or(0, |j| (j + step) % total));
            }
        }
    });
    if chosen != session.joint {
        shared.send(Command::SelectJoint(chosen));
    }
}

/// What the parameters mean: scale in metres, opacity, range, radial velocity.
fn derived(ui: &mut Ui, params: &Pppr, joint: usize, tokens: &Tokens) {
    let p = params.position(joint);
    let range = crate::geometry::norm(p);
    let radial = if range > 0.0 { crate::geometry::dot(params.velocity(joint), p) / range } else { 0.0 };
    let [sx, sy, sz] = params.scale(joint).map(|s| s * 100.0);
    let direction = if radial.abs() < 5e-4 {
        "at rest"
    } else if radial < 0.0 {
        "approaching"
    } else {
        "receding"
    };
    let text = format!(
        "s {sx:.1} × {sy:.1} × {sz:.1} cm   α {:.3}\nrange {range:.3} m   v_r {radial:+.3} m/s, {direction}",
        params.opacity(joint)
    );
    ui.label(RichText::new(text).font(theme::mono(theme::CAPTION)).color(tokens.dim));
    ui.add_space(4.0);
}

fn gradient(value: f64, color: egui::Color32, tokens: &Tokens) -> RichText {
    let color = if value == 0.0 { tokens.dim } else { color };
    let text = if value == 0.0 { "0".to_owned() } else { format!("{value:+.1e}") };
    RichText::new(text.replace('-', "−")).font(theme::mono(theme::CAPTION)).color(color)
}

/// ω as bars: its mean drives the phase ramp, its deviations shape the spectrum.
fn omega(ui: &mut Ui, params: &Pppr, total: &Pppr, joint: usize, tokens: &Tokens) {
    let values = params.joint(Group::Omega, joint);
    if values.is_empty() {
        return;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let slope = total.joint(Group::Omega, joint).iter().map(|g| g.abs()).fold(0.0, f64::max);
    ui.label(
        RichText::new(format!("ω ({} features)   mean {mean:+.4}   largest |∂L| {slope:.1e}", values.len()))
            .small()
            .color(tokens.dim),
    )
    .on_hover_text(
        "Doppler features: the mean is the phase ramp, rad·s/m²; deviations shape the spectrum along a Doppler axis.",
    );
    let (rect, _) = ui.allocate_exact_size(egui::vec2(ui.available_width().min(260.0), 36.0), egui::Sense::hover());
    let largest = values.iter().map(|v| v.abs()).fold(1e-6, f64::max);
    let width = rect.width() / values.len() as f32;
    ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(1.0, tokens.stroke));
    for (i, v) in values.iter().enumerate() {
        let height = (v / largest) as f32 * rect.height() / 2.0;
        let x = rect.left() + width * i as f32;
        let bar = egui::Rect::from_two_pos(
            egui::pos2(x, rect.center().y),
            egui::pos2(x + (width - 1.0).max(1.0), rect.center().y - height),
        );
        ui.painter().rect_filled(bar, 0.0, tokens.accent);
    }
}

#[cfg(all(test, feature = "dummies"))]
mod tests {
    use super::*;
    use crate::body::PpprShape;
    use crate::mhp::Evaluation;

    #[test]
    fn the_dummy_term_is_part_of_the_temporal_gradient() {
        let labels = |config: FitConfig| {
            parts(&config, &Terms::default()).into_iter().map(|part| part.label).collect::<Vec<_>>()
        };
        assert_eq!(labels(FitConfig::default()), ["w_EM·L_EM", "w_kine·L_kine"]);
        let config = FitConfig { w_time: 8.0, w_dummy: 2.0, ..FitConfig::default() };
        assert_eq!(labels(config), ["w_EM·L_EM", "w_kine·L_kine", "w_time·L_time + w_dummy·L_dummy"]);
        let mut evaluation = Evaluation::zeros(PpprShape { persons: 1, joints: 2, doppler_features: 1 });
        evaluation.gradients[Weight::Dummy as usize].set_vec3(Group::Position, 1, [1.0, 2.0, 3.0]);
        evaluation.gradients[Weight::Time as usize].set_vec3(Group::Position, 1, [1.0, 1.0, 1.0]);
        let of = |group| evaluation.joint_gradient(group, &config, Group::Position, 1).to_vec();
        assert_eq!(of(TermGroup::Temporal), [10.0, 12.0, 14.0]);
        assert_eq!(of(TermGroup::Kinematic), [0.0; 3]);
    }
}
