//! Loss, terms, IoU and MAJPE over the iterations, with flags where settings changed and a cursor that can be dragged.

use super::{Shared, empty};
use crate::app::theme::{self, Tokens};
use crate::session::{Branch, Command, Row};
use egui::{Color32, RichText, Ui};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints, Points, Text, VLine};

/// What the plot remembers.
#[derive(Default)]
pub(in crate::app) struct State {
    reset: bool,
    tab: Tab,
}

impl State {
    pub(in crate::app) fn reset(&mut self) {
        self.reset = true;
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Tab {
    #[default]
    Loss,
    Quality,
}

type Value = Box<dyn Fn(&Row) -> Option<f64>>;

struct Curve {
    key: String,
    name: String,
    value: Value,
    width: f32,
}

fn curve(key: &str, name: &str, width: f32, value: impl Fn(&Row) -> Option<f64> + 'static) -> Curve {
    Curve { key: key.into(), name: name.into(), value: Box::new(value), width }
}

pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let fit = &shared.session.fit;
    let Some(branch) = fit.branch().filter(|b| !b.rows.is_empty()) else {
        return empty(
            ui,
            "No iterations yet",
            "Press Enter to run the fit; loss, IoU and error appear here as it runs.",
        );
    };
    let curves = curves(shared, branch, state.tab);
    toolbar(ui, shared, state, &curves);
    let fit = &shared.session.fit;
    let log = shared.session.view.log_loss && state.tab == Tab::Loss;
    let hidden = &shared.session.view.hidden_curves;
    let tokens = Tokens::of(ui);
    let mut plot = Plot::new(("curves", state.tab == Tab::Loss))
        .x_axis_formatter(
            |mark, _| if mark.value.fract().abs() < 1e-9 { format!("{}", mark.value) } else { String::new() },
        )
        .show_grid([true, true])
        .grid_color(tokens.stroke)
        .allow_scroll(false)
        .set_margin_fraction(egui::vec2(0.02, 0.06))
        .include_x(0.0)
        .include_x(shared.session.config.iterations.min(20_000).max(fit.head()) as f64)
        .y_axis_min_width(44.0)
        .label_formatter(move |hover| label(hover, log));
    if log {
        plot = plot.y_axis_formatter(|mark, _| power(mark.value));
    }
    if state.tab == Tab::Quality {
        plot = plot.include_y(0.0).include_y(1.0);
    }
    if std::mem::take(&mut state.reset) {
        plot = plot.reset();
    }
    let lines: Vec<(Vec<PlotPoint>, &Curve)> =
        curves.iter().filter(|c| !hidden.contains(&c.key)).map(|c| (points(branch, c, log), c)).collect();
    let others: Vec<(u32, Vec<PlotPoint>)> = fit
        .history
        .branches()
        .iter()
        .filter(|b| b.id != branch.id)
        .filter_map(|b| Some((b.id, points(b, curves.first()?, log))))
        .collect();
    let shown = fit.shown_iteration();
    let response = plot.show(ui, |plot| {
        for (id, points) in &others {
            let name = format!("branch {id}");
            plot.line(Line::new(name, PlotPoints::Borrowed(points)).color(tokens.dim.gamma_multiply(0.5)).width(1.0));
        }
        for (points, c) in &lines {
            let color = tokens.curve(&c.key);
            if points.len() == 1 {
                let one: Vec<[f64; 2]> = points.iter().map(|p| [p.x, p.y]).collect();
                plot.points(Points::new(c.name.clone(), one).color(color).radius(2.5));
            }
            plot.line(Line::new(c.name.clone(), PlotPoints::Borrowed(points)).color(color).width(c.width));
        }
        let top = plot.plot_bounds().max()[1];
        let mut free_from = f32::NEG_INFINITY;
        for flag in &branch.flags {
            let x = flag.iteration as f64;
            plot.vline(VLine::new(flag.text.clone(), x).color(tokens.warn.gamma_multiply(0.7)).width(1.0));
            // A dragged slider leaves many flags; texts are written where there is room.
            let at = plot.screen_from_plot(PlotPoint::new(x, top)).x;
            if at < free_from {
                continue;
            }
            free_from = at + 12.0 + 5.5 * flag.text.chars().count() as f32;
            let text = RichText::new(format!("◆ {}", flag.text)).size(10.0);
            plot.text(
                Text::new("flag", PlotPoint::new(x, top), text).color(tokens.warn).anchor(egui::Align2::LEFT_TOP),
            );
        }
        plot.vline(VLine::new("shown iteration", shown as f64).color(tokens.accent).width(1.0));
        (plot.pointer_coordinate(), plot.response().clone())
    });
    let (pointer, inner) = response.inner;
    inner.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, "Curves"));
    if inner.clicked()
        && let Some(at) = pointer
    {
        shared.send(Command::GotoIteration(at.x.round().clamp(0.0, 1e9) as usize));
    }
}

fn curves(shared: &Shared<'_>, branch: &Branch, tab: Tab) -> Vec<Curve> {
    let arrays: Vec<String> =
        shared.session.fit.problem.iter().flat_map(|p| &p.views).map(|view| view.array.clone()).collect();
    match tab {
        Tab::Loss => {
            let mut curves = vec![
                curve("total", "L", 2.0, |r| Some(r.report.loss)),
                curve("em", "L_EM", 1.5, |r| Some(r.report.terms.em)),
                curve("bone", "L_bone", 1.5, |r| Some(r.report.terms.bone)),
                curve("rigid", "L_rigid", 1.5, |r| Some(r.report.terms.rigid)),
                curve("joint", "L_joint", 1.5, |r| Some(r.report.terms.joint)),
            ];
            let persons = shared.session.fit.initial.as_ref().map_or(1, |p| p.shape().persons);
            if persons > 1 {
                curves.push(curve("sep", "L_sep", 1.5, |r| Some(r.report.terms.sep)));
                curves.push(curve("coll", "L_coll", 1.5, |r| Some(r.report.terms.coll)));
            }
            curves
        }
        Tab::Quality => {
            let mut curves: Vec<Curve> = arrays
                .iter()
                .enumerate()
                .map(|(i, array)| {
                    curve(&format!("iou {i}"), &format!("IoU {array}"), 1.5, move |r| {
                        r.report.iou.get(i).copied().flatten()
                    })
                })
                .collect();
            if branch.rows.iter().any(|row| row.majpe_mm.is_some()) {
                curves.push(curve("majpe", "MAJPE / m", 1.5, |r| r.majpe_mm.map(|mm| mm / 1000.0)));
            }
            curves
        }
    }
}

/// The points of a curve; on a logarithmic scale values that are not positive have none.
fn points(branch: &Branch, curve: &Curve, log: bool) -> Vec<PlotPoint> {
    branch
        .rows
        .iter()
        .filter_map(|row| {
            let value = (curve.value)(row)?;
            let y = if log { (value > 1e-7).then(|| value.log10())? } else { value };
            y.is_finite().then(|| PlotPoint::new(row.report.iteration as f64, y))
        })
        .collect()
}

fn label(hover: &egui_plot::HoverPosition<'_>, log: bool) -> Option<String> {
    match hover {
        egui_plot::HoverPosition::NearDataPoint { plot_name, position, .. } => {
            let y = if log { 10f64.powf(position.y) } else { position.y };
            Some(format!("{plot_name}\niteration {}\n{y:.5}", position.x.round()))
        }
        egui_plot::HoverPosition::Elsewhere { .. } => None,
    }
}

/// A tick of a log₁₀ axis.
fn power(exponent: f64) -> String {
    let value = 10f64.powf(exponent);
    if !(0.001..10_000.0).contains(&value) {
        format!("{value:.0e}")
    } else if value < 0.1 {
        format!("{value:.3}")
    } else {
        format!("{value:.2}")
    }
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, curves: &[Curve]) {
    let tokens = Tokens::of(ui);
    let mut view = shared.session.view.clone();
    ui.horizontal_wrapped(|ui| {
        ui.selectable_value(&mut state.tab, Tab::Loss, "Loss").on_hover_text("The total and its unweighted terms.");
        ui.selectable_value(&mut state.tab, Tab::Quality, "IoU and error")
            .on_hover_text("Forward-consistency IoU of each view, and MAJPE where the data set has truth.");
        if state.tab == Tab::Loss {
            ui.checkbox(&mut view.log_loss, "log y").on_hover_text("Logarithmic vertical axis.");
        }
        ui.add_space(4.0);
        for c in curves {
            let on = !view.hidden_curves.contains(&c.key);
            let mut text = egui::text::LayoutJob::default();
            let font = egui::FontId::proportional(theme::CAPTION);
            let part = |color: Color32, on: bool| egui::TextFormat {
                font_id: font.clone(),
                color,
                strikethrough: if on { egui::Stroke::NONE } else { egui::Stroke::new(1.0, tokens.dim) },
                ..Default::default()
            };
            text.append("■ ", 0.0, part(if on { tokens.curve(&c.key) } else { tokens.stroke }, true));
            text.append(&c.name, 0.0, part(if on { tokens.text } else { tokens.dim }, on));
            let response = ui.add(egui::Label::new(text).sense(egui::Sense::click()).selectable(false).extend());
            let name = format!("Curve {}", c.name);
            response.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, on, &name));
            if response.on_hover_text("Click to show or hide.").clicked() {
                if on {
                    view.hidden_curves.push(c.key.clone());
                } else {
                    view.hidden_curves.retain(|key| *key != c.key);
                }
            }
        }
    });
    if view != shared.session.view {
        shared.set_view(|v| *v = view);
    }
}
