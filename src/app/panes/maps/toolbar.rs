//! The line above the maps: scale and colours, comparison, what is seen, the legend of the masks.

use super::super::PaneState as _;
use super::region::BoxOf;
use super::{Shared, State};
use crate::app::commands::{AppAct, UserCommand, command};
use crate::app::map_image::Orientation;
use crate::app::map_plane::Plane;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::render::Colormap;
use crate::session::{Against, ColorRange, Compare, CubeAxes, CubeView, MapScale, ThirdAxis};
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Color32, RichText, Sense, Ui, vec2};

pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    egui::Frame::new().inner_margin(egui::Margin::symmetric(8, 2)).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing = vec2(3.0, 2.0);
            ui.spacing_mut().button_padding.x = 5.0;
            colours(ui, shared);
            ui.separator();
            comparison(ui, shared);
            ui.separator();
            focus(ui, shared, state);
            eraser(ui, shared, state);
            erased(ui, shared);
            cube(ui, shared);
            planes(ui, shared);
            // The legend goes where there is no room for it: its colours are told on the masks' read-out too.
            if ui.available_size_before_wrap().x > 230.0 {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), legend);
            }
        });
    });
}

/// The person or the whole map.
fn focus(ui: &mut Ui, shared: &mut Shared<'_>, state: &State) {
    let person = ui.selectable_label(!state.shows_all(), "Person").named(egui::Role::Button, "Show the person");
    if person.on_hover_text("The part of each map around the person, or all of it. Key: F").clicked() {
        shared.invoke("Person or whole");
    }
}

/// The eraser: what would the fit do without that echo?
fn eraser(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let armed = state.marking.armed.is_some_and(BoxOf::erases);
    let tip = command("Erase cells").map(UserCommand::tip).unwrap_or_default();
    if ui.selectable_label(armed, "Erase").named(egui::Role::Button, "Erase cells").on_hover_text(tip).clicked() {
        // Whatever way of erasing is in the hand is put down.
        if armed {
            state.marking.armed = None;
        } else {
            shared.invoke("Erase cells");
        }
    }
    if armed {
        for (what, name, tip) in BoxOf::ERASERS {
            let chosen = state.marking.armed == Some(what);
            let button = ui
                .selectable_label(chosen, name)
                .named(egui::Role::Button, &format!("Erase by {}", name.to_lowercase()));
            if button.on_hover_text(tip).clicked() {
                state.marking.armed = Some(what);
            }
        }
    }
}

/// What the erased cells change: how far the pose moved, and the numbers with and without them.
fn erased(ui: &mut Ui, shared: &Shared<'_>) {
    let Some(effect) = shared.session.erased_effect() else { return };
    let number = |x: Option<f64>, digits: usize| x.map_or_else(|| "—".to_owned(), |x| format!("{x:.digits$}"));
    let mut parts = vec![
        format!("L_EM {:.4} → {:.4}", effect.em[0], effect.em[1]),
        format!("IoU {} → {}", number(effect.iou[0], 3), number(effect.iou[1], 3)),
    ];
    if effect.majpe_mm.iter().any(Option::is_some) {
        parts.push(format!("MAJPE {} → {} mm", number(effect.majpe_mm[0], 0), number(effect.majpe_mm[1], 0)));
    }
    let text = format!("moved {:.0} mm", effect.moved_mm[0]);
    let tip = format!(
        "Without {} cells: the joints moved {:.0} mm in the mean, {:.0} mm at most.\nWith → without: {}.",
        effect.cells,
        effect.moved_mm[0],
        effect.moved_mm[1],
        parts.join(", ")
    );
    let label = ui.label(RichText::new(text).small().color(Tokens::of(ui).warn));
    label.widget_info(|| {
        let mut info = egui::WidgetInfo::labeled(egui::Role::Group, true, "Without the erased cells");
        info.current_text_value = Some(tip.clone());
        info
    });
    label.on_hover_text(tip);
}

/// Which axes of maps with three are drawn, and how the third is taken; nothing where no map has three.
fn cube(ui: &mut Ui, shared: &mut Shared<'_>) {
    let Some(dataset) = &shared.session.data.dataset else { return };
    let Some(view) = dataset.info().views.iter().find(|view| view.axes.len() == 3) else { return };
    let old = shared.session.view.cube;
    let mut cube = old;
    let of = |axes| Orientation::of(view, CubeView { axes, ..old });
    let pair = |axes| {
        let o = of(axes);
        format!("{} × {}", view.axes[o.vertical].shown_name(), view.axes[o.horizontal].shown_name())
    };
    let stays = MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    let (button, _) = MenuButton::new("Axes").config(stays).ui(ui, |ui| {
        for axes in [CubeAxes::First, CubeAxes::Second, CubeAxes::Others] {
            ui.selectable_value(&mut cube.axes, axes, pair(axes));
        }
        ui.separator();
        let Some(third) = of(cube.axes).collapsed.map(|axis| &view.axes[axis]) else { return };
        ui.label(RichText::new(third.shown_name()).small());
        ui.selectable_value(&mut cube.third, ThirdAxis::Largest, "largest");
        ui.selectable_value(&mut cube.third, ThirdAxis::Mean, "mean");
        let last = third.bins.saturating_sub(1);
        let mut bin = match cube.third {
            ThirdAxis::Bin(bin) => bin.min(last),
            ThirdAxis::Largest | ThirdAxis::Mean => last / 2,
        };
        let one = matches!(cube.third, ThirdAxis::Bin(_));
        if ui.selectable_label(one, "one bin").clicked() {
            cube.third = ThirdAxis::Bin(bin);
        }
        let text = format!("{:.2} {}", third.shown_at(bin as f64), third.shown_unit());
        let slider = ui.add(egui::Slider::new(&mut bin, 0..=last).text(text));
        if slider.named(egui::Role::Slider, "Bin of the third axis").changed() {
            cube.third = ThirdAxis::Bin(bin);
        }
    });
    let tip = "Which two axes of a map with three are drawn, and how the third is taken.";
    button.named(egui::Role::Button, "Axes of the maps").on_hover_text(tip);
    if cube != old {
        shared.set_view(|view| view.cube = cube);
        if cube.axes != old.axes {
            // What was seen of other axes means nothing.
            shared.app(AppAct::ResetViews);
        }
    }
}

/// The other coordinates of the maps, as far as they have some.
fn planes(ui: &mut Ui, shared: &mut Shared<'_>) {
    let Some(dataset) = &shared.session.data.dataset else { return };
    let old = shared.session.view.cube;
    let mut cube = old;
    let others = |plane: Plane| {
        let other = |view| {
            let o = Orientation::of(view, old);
            Plane::other(&view.axes[o.vertical], &view.axes[o.horizontal])
        };
        dataset.info().views.iter().any(move |view| other(view) == plane)
    };
    let (fan, unrolled) = (others(Plane::BirdsEye), others(Plane::Polar));
    if fan || !unrolled {
        let button = ui.add_enabled(fan, egui::Button::selectable(cube.birds_eye && fan, "Bird's-eye"));
        let tip = "Draw maps of range and angle on metres, with range rings and the edges of the field of view.";
        let why =
            "No map here has range and angle, nor depth and a side in metres: none can be drawn in other coordinates.";
        if button.on_hover_text(tip).on_disabled_hover_text(why).clicked() {
            cube.birds_eye = !cube.birds_eye;
        }
    }
    if unrolled {
        let button = ui.add(egui::Button::selectable(cube.polar, "Polar"));
        if button.on_hover_text("Draw maps whose axes are metres on range and angle.").clicked() {
            cube.polar = !cube.polar;
        }
    }
    if cube != old {
        shared.set_view(|view| view.cube = cube);
    }
}

fn colours(ui: &mut Ui, shared: &mut Shared<'_>) {
    let view = &shared.session.view;
    let (mut scale, mut name) = (view.scale, view.colormap.clone());
    egui::ComboBox::from_id_salt("scale")
        .width(50.0)
        .selected_text(if scale == MapScale::Decibel { "dB" } else { "linear" })
        .show_ui(ui, |ui| {
            ui.selectable_value(&mut scale, MapScale::Decibel, "dB")
                .on_hover_text("20 log₁₀ of an amplitude, 10 log₁₀ of a power, relative to the map's maximum.");
            ui.selectable_value(&mut scale, MapScale::Linear, "linear")
                .on_hover_text("The stored value divided by the map's maximum.");
        })
        .response
        .named(egui::Role::ComboBox, "Scale")
        .on_hover_text("Scale of the colours.");
    egui::ComboBox::from_id_salt("colormap")
        .width(66.0)
        .selected_text(&name)
        .show_ui(ui, |ui| {
            for map in Colormap::ALL.into_iter().filter(|map| *map != Colormap::Diverging) {
                let lower = map.name().to_lowercase();
                ui.horizontal(|ui| {
                    ramp(ui, map);
                    ui.selectable_value(&mut name, lower.clone(), lower);
                });
            }
        })
        .response
        .named(egui::Role::ComboBox, "Colour map")
        .on_hover_text("Colour map. Viridis, inferno and magma are perceptually uniform.");
    more(ui, shared);
    let view = &shared.session.view;
    if scale != view.scale || name != view.colormap {
        shared.set_view(|v| {
            if scale != v.scale && matches!(v.range, ColorRange::Fixed { .. }) {
                // Limits in dB mean nothing on a linear scale.
                v.range = ColorRange::default();
            }
            (v.scale, v.colormap) = (scale, name);
        });
    }
}

/// What is drawn on the maps, and how the limits are found.
fn more(ui: &mut Ui, shared: &mut Shared<'_>) {
    let mut view = shared.session.view.clone();
    let menu = ui.menu_button("Show", |ui| {
        ui.checkbox(&mut view.show_region, "EM region").on_hover_text("The cells that L_EM is computed on (dashed).");
        ui.checkbox(&mut view.show_skeleton, "Fitted skeleton")
            .on_hover_text("Joints and bones of the shown iteration.");
        ui.checkbox(&mut view.show_truth, "Truth")
            .on_hover_text("The data set's joints in metres, where it has them (green, as in 3-D).");
        ui.checkbox(&mut view.show_boxes, "Labelled boxes").on_hover_text("The data set's boxes on the maps (red).");
        ui.checkbox(&mut view.follow, "Follow the person")
            .on_hover_text("Maps and camera go with the person from frame to frame; the zoom stays.");
        ui.checkbox(&mut view.true_proportions, "True proportions")
            .on_hover_text("Draw maps whose axes are metres to scale.");
        ui.checkbox(&mut view.show_clipped, "Hatch clipped cells")
            .on_hover_text("Mark cells outside the colour limits.");
        ui.separator();
        ui.checkbox(&mut view.shared_range, "Same limits for H_sim")
            .on_hover_text("H_sim uses H_ori's colour limits, and keeps them over the steps of a run.");
        ui.separator();
        ui.label(RichText::new("Colour limits").small());
        if let ColorRange::Percentile { lo, hi } = &mut view.range {
            ui.add(egui::Slider::new(lo, 0.0..=50.0).text("lower percentile"));
            ui.add(egui::Slider::new(hi, 50.0..=100.0).text("upper percentile"));
        }
        let by_hand: Vec<&str> = views(shared).filter(|array| view.limits_of(array).is_some()).collect();
        if !by_hand.is_empty() {
            ui.label(RichText::new(format!("by hand: {}", by_hand.join(", "))).small());
        }
        if ui.button("Auto-contrast").on_hover_text("Every map from its 2nd to its 99.8th percentile. Key: C").clicked()
        {
            view.auto_contrast();
        }
    });
    let tip = "What is drawn on the maps, and how the colour limits are found.";
    menu.response.named(egui::Role::Button, "What the maps show").on_hover_text(tip);
    if view != shared.session.view {
        shared.set_view(|v| *v = view);
    }
}

/// Keys of the maps' arrays.
fn views<'a>(shared: &Shared<'a>) -> impl Iterator<Item = &'a str> {
    shared.session.data.dataset.iter().flat_map(|dataset| &dataset.info().views).map(|view| view.array.as_str())
}

fn comparison(ui: &mut Ui, shared: &mut Shared<'_>) {
    let mut mode = shared.session.view.compare;
    ui.selectable_value(&mut mode, Compare::Flip, "H_sim")
        .on_hover_text("H_sim alone. Hold Shift over a map to flip it with H_ori.");
    ui.selectable_value(&mut mode, Compare::Wipe, "Wipe")
        .on_hover_text("H_ori left of a line, H_sim right of it. Key: W");
    ui.selectable_value(&mut mode, Compare::Difference, "Difference")
        .on_hover_text("H_sim − H_ori, colours diverging about zero. Key: D");
    if mode != shared.session.view.compare {
        shared.set_view(|v| v.compare = mode);
    }
    if let Some(baseline) = shared.session.pins.baseline() {
        let on = shared.session.view.against == Against::Baseline;
        let tip = format!(
            "Compare with H_sim of the baseline {} ({}, iteration {}) instead of H_ori. Key: B",
            baseline.name,
            baseline.frame_name,
            baseline.iteration()
        );
        let text = format!("vs {}", baseline.name);
        let button = ui.selectable_label(on, text).named(egui::Role::Button, "Compare with the baseline");
        if button.on_hover_text(tip).clicked() {
            shared.invoke("Compare with the baseline");
        }
    }
}

fn legend(ui: &mut Ui) {
    let tokens = Tokens::of(ui);
    let entries: [(Color32, &str, &str); 3] = [
        (theme::MASK_BOTH, "both", "In the masks of H_ori and of H_sim."),
        (theme::MASK_ORI, "H_ori only", "Measured, not explained by the fit."),
        (theme::MASK_SIM, "H_sim only", "Simulated, not measured."),
    ];
    for (color, text, tip) in entries.into_iter().rev() {
        ui.label(RichText::new(text).small()).on_hover_text(tip);
        let (rect, _) = ui.allocate_exact_size(vec2(9.0, 9.0), Sense::hover());
        ui.painter().rect(rect, 1.0, color, egui::Stroke::new(1.0, tokens.dim), egui::StrokeKind::Inside);
    }
}

fn ramp(ui: &mut Ui, map: Colormap) {
    let (rect, _) = ui.allocate_exact_size(vec2(48.0, 10.0), Sense::hover());
    for i in 0..24 {
        let [r, g, b] = map.sample(f64::from(i) / 23.0);
        let x = rect.min.x + 2.0 * i as f32;
        let stripe = egui::Rect::from_min_size(egui::pos2(x, rect.min.y), vec2(2.0, rect.height()));
        ui.painter().rect_filled(stripe, 0.0, Color32::from_rgb(r, g, b));
    }
}
