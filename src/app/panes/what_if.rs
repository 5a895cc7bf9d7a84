//! Radar what-if: another radar before the pose on screen. Sliders at the left; what today's radar and the other would measure of
//! this pose, and what they would know of it, side by side; both kinds of ellipsoids in 3-D while this pane is in front.

use super::answered::Answered;
use super::chain::colormap;
use super::extras::{Extras, publish};
use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::figure;
use crate::app::map_image::{Orientation, colorize};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::explore::{IdleCores, RadarChange, Seen, WhatIf, preset_of, what_if};
use crate::radar::{View, ViewFft, Window};
use crate::session::{BackgroundTask, Command, CubeView, Session};
use crate::task::Progress;
use egui::{
    Align2, Color32, FontId, Rect, RichText, Role, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2,
};
use serde_json::Value;
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "WhatIf",
    title: "Radar what-if",
    icon: &[
        Mark::Dot([2.5, 8.0], 1.8),
        Mark::Line(&[[6.0, 4.0], [7.4, 8.0], [6.0, 12.0]]),
        Mark::Line(&[[9.5, 2.5], [11.3, 8.0], [9.5, 13.5]]),
        Mark::Line(&[[12.6, 1.0], [14.8, 8.0], [12.6, 15.0]]),
    ],
    help: "what another radar would see and know of this pose",
    dock: Dock::Centre,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: None,
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Levels below the strongest that are shown, dB.
const FLOOR_DB: f64 = -40.0;
/// The windows that are offered.
const WINDOWS: [Window; 4] =
    [Window::Rectangular, Window::Hann, Window::Hamming, Window::Chebyshev { sidelobe_db: 30.0 }];

#[derive(Default)]
struct State {
    view: usize,
    changes: Vec<RadarChange>,
    known: Answered<Vec<RadarChange>, Arc<WhatIf>>,
    pictures: Vec<[TextureHandle; 2]>,
    drawn: Option<(bool, Arc<Extras>)>,
    name: String,
}

impl PaneState for State {
    fn is_working(&self) -> bool {
        self.known.is_working()
    }

    fn stored_as(&self) -> Option<&'static str> {
        Some("what-if")
    }

    fn stored(&self) -> serde_json::Result<Value> {
        serde_json::to_value(&self.changes)
    }

    fn restore(&mut self, stored: Value, _: &Session) -> serde_json::Result<()> {
        self.changes = serde_json::from_value::<Option<Vec<RadarChange>>>(stored)?.unwrap_or_default();
        self.changes.retain(|change| change.check().is_ok());
        Ok(())
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Once a frame has joints, this shows what another radar would see of them.";
    (session.fit.shown.is_none() || session.fit.problem.is_none()).then(|| Blank::new("No fit", how))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let Some(dataset) = shared.session.data.dataset.clone() else { return };
    let views = dataset.info().views.clone();
    state.changes.resize(views.len(), RadarChange::default());
    state.view = state.view.min(views.len().saturating_sub(1));
    let tokens = Tokens::of(ui);
    let area = ui.available_rect_before_wrap();
    let side = (0.26 * area.width()).clamp(200.0, 280.0).min(0.5 * area.width());
    let (left, right) = area.split_left_right_at_x(area.min.x + side);
    ui.scope_builder(egui::UiBuilder::new().max_rect(left.with_max_x(left.max.x - 10.0)), |ui| {
        egui::ScrollArea::vertical().id_salt("what-if").auto_shrink(false).show(ui, |ui| {
            controls(ui, shared, state, &views, &tokens);
        });
    });
    follow(ui, shared.session, state);
    ui.scope_builder(egui::UiBuilder::new().max_rect(right), |ui| result(ui, shared, state, &tokens));
}

fn controls(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, views: &[View], tokens: &Tokens) {
    let Some(dataset) = shared.session.data.dataset.clone() else { return };
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for (k, view) in views.iter().enumerate() {
            ui.selectable_value(&mut state.view, k, RichText::new(&view.array).small());
        }
    });
    let Some(view) = views.get(state.view) else { return };
    let ffts = dataset.info().ffts();
    let known = ffts.get(state.view).and_then(Option::as_ref);
    let today: ViewFft = RadarChange::default().fft(view, known, &dataset.info().radar);
    let Some(change) = state.changes.get_mut(state.view) else { return };
    if known.is_none() {
        let text = "Its FFTs are not known: today's radar is one with these widths.";
        ui.add(egui::Label::new(RichText::new(text).small().color(tokens.warn)).wrap());
    }
    let line = today.setup.azimuth.or(today.setup.elevation);
    ui.spacing_mut().slider_width = (ui.available_width() - 84.0).max(60.0);
    let mut bandwidth = change.bandwidth_hz.unwrap_or(today.radar.bandwidth_hz) / 1e9;
    if slider(ui, "Bandwidth", &mut bandwidth, 0.2..=8.0, " GHz", true) {
        change.bandwidth_hz = Some(bandwidth * 1e9);
    }
    if let Some((count, window)) = line {
        let mut elements = change.elements.unwrap_or(count) as f64;
        if slider(ui, "Elements", &mut elements, 2.0..=256.0, "", true) {
            change.elements = Some(elements.round() as usize);
        }
        let mut chosen = change.window.unwrap_or(window);
        egui::ComboBox::from_id_salt("window")
            .width(120.0)
            .selected_text(chosen.name())
            .show_ui(ui, |ui| {
                for one in WINDOWS {
                    ui.selectable_value(&mut chosen, one, one.name());
                }
            })
            .response
            .named(Role::ComboBox, "Window")
            .on_hover_text("Over samples and elements.");
        if chosen != change.window.unwrap_or(window) {
            change.window = Some(chosen);
        }
    }
    slider(ui, "Raised", &mut change.raised_m, -1.5..=2.0, " m", false);
    slider(ui, "Tilted down", &mut change.tilt_deg, -45.0..=60.0, "°", false);
    let mut snr = change.snr_db.unwrap_or(40.0);
    if slider(ui, "SNR", &mut snr, 0.0..=70.0, " dB", false) {
        change.snr_db = Some(snr);
    }
    ui.horizontal(|ui| {
        let changed = !change.is_nothing();
        let back = ui.add_enabled(changed, egui::Button::new("As today").small());
        if back.on_hover_text("This view's radar as it is.").clicked() {
            *change = RadarChange::default();
        }
    });
    ui.separator();
    ui.label(RichText::new("Save as preset").small().color(tokens.dim));
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut state.name).hint_text("name").desired_width(100.0);
        ui.add(field).named(Role::TextInput, "Name of the preset");
        let named = !state.name.trim().is_empty();
        let save = ui.add_enabled(named, egui::Button::new("Save").small()).named(Role::Button, "Save as preset");
        let tip = "Keep this radar among your own: a manifest takes it by its name, radar = \"…\"; `mhp-inspector radars` lists it.";
        if save.on_hover_text(tip).clicked() {
            let (preset, name) = (preset_of(dataset.info(), &state.changes), state.name.trim().to_owned());
            let task = BackgroundTask::new(move || {
                let path = preset.save(&name).map_err(|error| error.to_string())?;
                Ok(format!("radar {name} kept in {}", path.display()))
            });
            shared.send(Command::RunTask(task));
        }
    });
}

/// A slider under its name; whether it was moved.
fn slider(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: std::ops::RangeInclusive<f64>,
    unit: &str,
    log: bool,
) -> bool {
    ui.label(RichText::new(name).small());
    let slider = egui::Slider::new(value, range).suffix(unit).logarithmic(log).max_decimals(2);
    ui.add(slider).named(Role::Slider, name).changed()
}

fn follow(ui: &Ui, session: &Session, state: &mut State) {
    if state.known.poll() {
        state.pictures.clear();
        state.drawn = None;
    }
    let changes = state.changes.clone();
    state.known.ask((ui, session), state.changes.clone(), "what-if", |_| {
        let (of, info) = (session.explored_state().ok()?, session.data.dataset.as_ref()?.info().clone());
        Some(move |with: (&IdleCores, &Progress)| what_if(&info, &of, &changes, with).map(Arc::new))
    });
}

fn result(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, tokens: &Tokens) {
    let session = shared.session;
    let found = match state.known.last() {
        None => {
            ui.label(RichText::new("Another radar looks …").small().color(tokens.dim));
            return;
        }
        Some(Err(why)) => {
            ui.label(RichText::new(why).small().color(tokens.bad));
            return;
        }
        Some(Ok(found)) => Arc::clone(found),
    };
    let caption = figure::of(session, "H_sim with noise, dB re max: today's radar and the other");
    let area = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    ui.interact(area, ui.scope_id().with("what-if maps"), Sense::hover())
        .widget_info(|| figure::spoken("Radar what-if result", caption.as_deref()));
    let numbers = numbers(&found);
    let high = 16.0 * numbers.len() as f32 + 8.0;
    let (above, maps) = area.split_top_bottom_at_y(area.min.y + high.min(0.5 * area.height()));
    let painter = ui.painter().with_clip_rect(above.intersect(ui.clip_rect()));
    let columns = [0.0, 200.0, 300.0].map(|x: f32| x.min(0.7 * above.width()));
    for (k, [name, a, b]) in numbers.iter().enumerate() {
        let y = above.min.y + 16.0 * k as f32;
        let font = if k == 0 { theme::strong(theme::CAPTION) } else { FontId::proportional(theme::CAPTION) };
        painter.text(
            pos2(above.min.x + columns[0], y),
            Align2::LEFT_TOP,
            name,
            FontId::proportional(theme::CAPTION),
            tokens.dim,
        );
        painter.text(pos2(above.min.x + columns[1] + 80.0, y), Align2::RIGHT_TOP, a, font.clone(), tokens.text);
        painter.text(pos2(above.min.x + columns[2] + 80.0, y), Align2::RIGHT_TOP, b, font, tokens.text);
    }
    let told: Vec<String> =
        numbers.iter().skip(1).map(|[name, a, b]| format!("{name}: today {a}, other {b}")).collect();
    let response = ui.interact(above, ui.scope_id().with("what-if numbers"), Sense::hover());
    response.widget_info(|| figure::spoken("What-if numbers", Some(&told.join("; "))));
    if state.pictures.is_empty() {
        state.pictures = pictures(ui, session, &found);
    }
    let columns = 2.0;
    let rows = state.pictures.len().max(1) as f32;
    let cell = vec2((maps.width() - 8.0) / columns, (maps.height() - 6.0 * (rows - 1.0)) / rows);
    if cell.x > 30.0 && cell.y > 40.0 {
        for (row, pair) in state.pictures.iter().enumerate() {
            let array = &found.today.views[row].array;
            for (column, (picture, word)) in pair.iter().zip(["today", "other"]).enumerate() {
                let at = maps.min + vec2(column as f32 * (cell.x + 8.0), row as f32 * (cell.y + 6.0));
                let rect = Rect::from_min_size(at, cell);
                let plot = Rect::from_min_max(rect.min + vec2(0.0, 15.0), rect.max);
                let title = format!("{array}, {word}");
                ui.painter().text(rect.min, Align2::LEFT_TOP, &title, FontId::proportional(10.0), tokens.dim);
                let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                ui.painter().image(picture.id(), plot, whole, Color32::WHITE);
                ui.painter().rect_stroke(plot, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
                let response = ui.interact(plot, ui.scope_id().with(("what-if", row, column)), Sense::hover());
                response.widget_info(|| figure::spoken(&format!("What-if map of {title}"), None));
            }
        }
    }
    if state.known.is_working() {
        let spinner = Rect::from_center_size(area.right_top() + vec2(-12.0, 10.0), vec2(14.0, 14.0));
        ui.put(spinner, egui::Spinner::new());
    }
    if state.drawn.as_ref().is_none_or(|(dark, _)| *dark != tokens.dark) {
        let mut extras = Extras::default();
        for (seen, color) in [(&found.today, tokens.dim), (&found.other, tokens.accent)] {
            for (at, covariance) in seen.known.positions.iter().zip(&seen.known.echo) {
                extras.ellipsoid(*at, covariance, 1.0, color, 1.0);
            }
        }
        state.drawn = Some((tokens.dark, Arc::new(extras)));
    }
    if let Some((_, extras)) = &state.drawn {
        publish(ui.ctx(), "what-if", Arc::clone(extras));
    }
}

fn numbers(found: &WhatIf) -> Vec<[String; 3]> {
    let both = [&found.today, &found.other];
    let row = |name: String, of: &dyn Fn(&Seen) -> String| {
        let [a, b] = both.map(of);
        [name, a, b]
    };
    let mut rows = vec![[String::new(), "today".into(), "other".into()]];
    for k in 0..found.today.views.len() {
        let array = &found.today.views[k].array;
        rows.push(row(format!("{array} range width"), &|seen| format!("{:.1} cm", 100.0 * seen.views[k].psf.range_m)));
        let angle = |seen: &Seen| seen.views[k].psf.azimuth_rad.max(seen.views[k].psf.elevation_rad).to_degrees();
        if angle(&found.today) > 0.0 {
            rows.push(row(format!("{array} angle width"), &|seen| format!("{:.2}°", angle(seen))));
        }
    }
    rows.push(row("directions the echo fixes".into(), &|seen| format!("{:.1}", seen.known.fixed[0])));
    rows.push(row("refits spread".into(), &|seen| format!("{:.1} mm", seen.known.spread_mm[0])));
    rows.push(row("open by the echo alone".into(), &|seen| format!("{:.0} mm", seen.known.spread_mm[1])));
    rows
}

fn pictures(ui: &Ui, session: &Session, found: &WhatIf) -> Vec<[TextureHandle; 2]> {
    let one = |seen: &Seen, k: usize, word: &str| {
        let (view, map) = (&seen.views[k], &seen.maps[k]);
        let o = Orientation::of(view, CubeView::default());
        let most = map.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let level = |x: f64| (view.quantity.db_factor() * (x.max(0.0) / most).log10()).max(FLOOR_DB);
        let levels: Vec<f64> = o.picture(view, map).into_iter().map(level).collect();
        let image = colorize(o.size(view), &levels, (FLOOR_DB, 0.0), colormap(session), false, theme::NAN_CELL);
        ui.ctx().load_texture(format!("what-if {} {word}", view.array), image, TextureOptions::NEAREST)
    };
    (0..found.today.views.len()).map(|k| [one(&found.today, k, "today"), one(&found.other, k, "other")]).collect()
}
