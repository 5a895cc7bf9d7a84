//! Calibration: cuts through a reflector's echo along every axis of a view, measured, beside the point spread that the forward model
//! has and the Gaussian that fits. A click on the map takes the reflector there; the refined widths can be kept as a radar.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::map_image::{Orientation, colorize};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::dataset::{DatasetInfo, FftText, Frame, RadarPreset};
use crate::radar::{AxisKind, LobeCut, Reflector, ReflectorMap, View, refined_widths, sine_deg, with_width};
use crate::session::{CubeView, Session};
use egui::{
    Align2, Color32, FontId, Rect, RichText, Role, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2,
};
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Calibration",
    title: "Calibration",
    icon: &[
        Mark::Ring([8.0, 8.0], 4.5),
        Mark::Line(&[[8.0, 1.0], [8.0, 6.0]]),
        Mark::Line(&[[8.0, 10.0], [8.0, 15.0]]),
        Mark::Line(&[[1.0, 8.0], [6.0, 8.0]]),
        Mark::Line(&[[10.0, 8.0], [15.0, 8.0]]),
    ],
    help: "point-spread widths, modelled and measured on a reflector",
    dock: Dock::Centre,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| toolbar(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Levels below the strongest that are shown, dB.
const FLOOR_DB: f64 = -40.0;

/// What is measured, and what was found.
#[derive(Default)]
struct State {
    view: usize,
    /// The cell, fractional bins, that was clicked; `None` measures all peaks that stand alone.
    at: Option<Vec<f64>>,
    found: Option<(Key, Result<Vec<Reflector>, String>)>,
    picture: Option<((u64, usize, usize), TextureHandle)>,
    name: String,
    said: Option<String>,
}

impl PaneState for State {}

/// Data set, frame, view, place.
type Key = (u64, usize, usize, Option<Vec<f64>>);

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a data set: its echoes tell how wide a point is in its maps, and whether the model has it right.";
    session.data.frame.is_none().then(|| Blank::new("No frame", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let Some(dataset) = shared.session.data.dataset.clone() else { return };
    let info = dataset.info();
    ui.horizontal_wrapped(|ui| {
        for (k, view) in info.views.iter().enumerate() {
            if ui.selectable_label(state.view == k, RichText::new(&view.array).small()).clicked() {
                (state.view, state.at) = (k, None);
            }
        }
        ui.separator();
        let all = ui.selectable_label(state.at.is_none(), RichText::new("All peaks that stand alone").small());
        if all.on_hover_text("Or click a reflector in the map.").clicked() {
            state.at = None;
        }
        ui.separator();
        let field = egui::TextEdit::singleline(&mut state.name).hint_text("name, e.g. lab-radar").desired_width(120.0);
        ui.add(field).named(Role::TextInput, "Name of the radar");
        let save = ui.add_enabled(!state.name.is_empty(), egui::Button::new(RichText::new("Save as radar").small()));
        let tip = "Keeps chirp, FFT configuration and the measured widths under this name: radar = \"name\" in a dataset.toml takes \
                   them.";
        if save.on_hover_text(tip).clicked() {
            state.said = Some(save_radar(info, state));
        }
        if let Some(said) = &state.said {
            ui.label(RichText::new(said).small().color(Tokens::of(ui).dim));
        }
    });
}

/// Keeps the radar; what was done, in words.
fn save_radar(info: &DatasetInfo, state: &State) -> String {
    let Some((_, Ok(found))) = &state.found else { return "Nothing is measured yet.".into() };
    let (Some(view), widths) = (info.views.get(state.view), refined_widths(found)) else {
        return "Nothing is measured yet.".into();
    };
    if widths.is_empty() {
        return "No echo stands alone: there is no width to keep.".into();
    }
    let psf = widths.into_iter().fold(view.psf, |psf, (kind, sigma)| with_width(psf, kind, sigma));
    let fft = info.calibration(state.view).fft;
    let radar = fft.as_ref().map_or_else(|| info.radar.clone(), |fft| fft.radar.clone());
    let about = format!("widths refined on {}", info.name);
    let preset = RadarPreset { about, radar, fft: fft.as_ref().map(FftText::of), psf: Some(psf) };
    match preset.save(&state.name) {
        Ok(path) => format!("Saved: {}", path.display()),
        Err(error) => error.to_string(),
    }
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let data = &shared.session.data;
    let (Some(dataset), Some(frame)) = (data.dataset.clone(), data.frame.clone()) else { return };
    let info = dataset.info();
    state.view = state.view.min(info.views.len().saturating_sub(1));
    let (Some(view), Some(map)) = (info.views.get(state.view), frame.maps.get(state.view)) else { return };
    let calibration = info.calibration(state.view);
    let key = (dataset.id(), frame.index, state.view, state.at.clone());
    if state.found.as_ref().is_none_or(|(known, _)| *known != key) {
        let measured = ReflectorMap::new(view, &map.data, calibration.fft.as_ref()).map(|map| match &state.at {
            None => map.isolated(),
            Some(at) => map.nearest_peak(at).into_iter().collect(),
        });
        state.found = Some((key, measured));
    }
    let tokens = Tokens::of(ui);
    let Some((_, found)) = &state.found else { return };
    ui.label(RichText::new(format!("Model: {}.", calibration.words())).small().color(tokens.dim));
    let found = match found {
        Ok(found) => found.clone(),
        Err(why) => {
            ui.label(RichText::new(format!("This view cannot be measured: {why}.")).color(tokens.dim));
            return;
        }
    };
    ui.add_space(4.0);
    let area = ui.available_rect_before_wrap();
    let side = (area.height()).min(0.42 * area.width());
    let left = Rect::from_min_size(area.min, vec2(side, area.height()));
    if side < 80.0 {
        return;
    }
    if let Some(at) = picture(ui, shared.session, state, (view, &frame), left, &found, &tokens) {
        state.at = Some(at);
    }
    cuts(ui, Rect::from_min_max(pos2(left.right() + 12.0, area.top()), area.max), &found, &tokens);
}

/// The map with the reflectors; the bins of a cell that was clicked.
fn picture(
    ui: &mut Ui,
    session: &Session,
    state: &mut State,
    (view, frame): (&View, &Arc<Frame>),
    rect: Rect,
    found: &[Reflector],
    tokens: &Tokens,
) -> Option<Vec<f64>> {
    let orientation = Orientation::of(view, CubeView::default());
    let which = (session.data.dataset.as_ref().map_or(0, |dataset| dataset.id()), frame.index, state.view);
    if state.picture.as_ref().is_none_or(|(known, _)| *known != which) {
        let map = frame.maps.get(state.view)?;
        let values = orientation.picture(view, &map.data);
        let most = values.iter().copied().filter(|x| x.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
        let factor = view.quantity.db_factor();
        let level = |x: &f64| if x.is_nan() { *x } else { (factor * (x.max(0.0) / most).log10()).max(FLOOR_DB) };
        let levels: Vec<f64> = values.iter().map(level).collect();
        let size = orientation.size(view);
        let image = colorize(size, &levels, (FLOOR_DB, 0.0), super::chain::colormap(session), false, theme::NAN_CELL);
        let texture = ui.ctx().load_texture("map of the calibration", image, TextureOptions::NEAREST);
        state.picture = Some((which, texture));
    }
    let (_, texture) = state.picture.as_ref()?;
    let response = ui.interact(rect, ui.scope_id().with("calibration map"), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(Role::Canvas, true, "Map with its reflectors"));
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(texture.id(), rect, whole, Color32::WHITE);
    for reflector in found {
        let unit = orientation.unit_from_bins(view, &reflector.bins);
        let at = rect.min + rect.size() * vec2(unit[0] as f32, unit[1] as f32);
        painter.circle_stroke(at, 6.0, Stroke::new(1.5, tokens.warn));
    }
    let pointer = response.clicked().then(|| response.interact_pointer_pos()).flatten();
    response.on_hover_text("Click a reflector to measure its echo.");
    let unit = (pointer? - rect.min) / rect.size();
    let [across, up] = orientation.bins_from_unit(view, [f64::from(unit.x), f64::from(unit.y)]);
    let mut bins = vec![0.0; view.axes.len()];
    (bins[orientation.horizontal], bins[orientation.vertical]) = (across, up);
    if let (Some(axis), Some(map)) = (orientation.collapsed, frame.maps.get(state.view)) {
        bins[axis] = strongest_behind(view, &map.data, &bins, axis);
    }
    Some(bins)
}

/// The bin of a collapsed axis where the map is largest behind a pixel.
fn strongest_behind(view: &View, map: &[f64], bins: &[f64], axis: usize) -> f64 {
    let value = |bin: usize| {
        let index = view.axes.iter().enumerate().fold(0, |index, (k, of)| {
            let at = if k == axis { bin } else { bins[k].round().clamp(0.0, (of.bins - 1) as f64) as usize };
            index * of.bins + at
        });
        map.get(index).copied().filter(|x| x.is_finite()).unwrap_or(f64::NEG_INFINITY)
    };
    (0..view.axes[axis].bins).max_by(|&a, &b| value(a).total_cmp(&value(b))).unwrap_or(0) as f64
}

/// One picture an axis of the FFTs: every reflector's cut, the model, and the Gaussian of the refined width.
fn cuts(ui: &mut Ui, area: Rect, found: &[Reflector], tokens: &Tokens) {
    let Some(first) = found.first() else {
        let text = "No echo stands alone here. Click a bright one in the map.";
        ui.painter().text(area.min, Align2::LEFT_TOP, text, FontId::proportional(theme::BODY), tokens.dim);
        return;
    };
    let widths = refined_widths(found);
    let height = area.height() / first.cuts.len().max(1) as f32;
    for (k, (kind, _)) in first.coordinates.iter().enumerate() {
        let rect = Rect::from_min_size(area.min + vec2(0.0, k as f32 * height), vec2(area.width(), height - 8.0));
        let cuts: Vec<&LobeCut> = found.iter().filter_map(|reflector| reflector.cuts.get(k)).collect();
        let refined = widths.iter().find(|(known, _)| known == kind).map(|(_, sigma)| *sigma);
        axis_cut(ui, rect, *kind, &cuts, refined, tokens);
    }
}

fn axis_cut(ui: &Ui, rect: Rect, kind: AxisKind, cuts: &[&LobeCut], refined: Option<f64>, tokens: &Tokens) {
    let Some(first) = cuts.first() else { return };
    let reach = cuts.iter().flat_map(|cut| &cut.offset).fold(3.0 * first.model_sigma, |most, x| most.max(x.abs()));
    let reach =
        if reach > 0.0 { reach.min(8.0 * first.model_sigma.max(refined.unwrap_or(0.0)).max(1e-6)) } else { 1.0 };
    let plot = Rect::from_min_max(rect.min + vec2(0.0, 34.0), rect.max - vec2(0.0, 16.0));
    if plot.height() < 24.0 || plot.width() < 60.0 {
        return;
    }
    let painter = ui.painter();
    let model = format!("model σ {}", width(kind, first.model_sigma));
    let measured = refined.map_or_else(
        || "no lobe of its own".to_owned(),
        |sigma| {
            format!(
                "measured σ {} ({:+.1} %)",
                width(kind, sigma),
                100.0 * (sigma / first.model_sigma.max(1e-12) - 1.0)
            )
        },
    );
    painter.text(rect.min, Align2::LEFT_TOP, title(kind), theme::strong(theme::CAPTION), tokens.text);
    let mut at = rect.min + vec2(0.0, 16.0);
    for (text, color) in [(model, tokens.accent), (measured, tokens.warn)] {
        at.x = painter.text(at, Align2::LEFT_TOP, text, FontId::proportional(theme::CAPTION), color).right() + 14.0;
    }
    painter.rect(plot, 2.0, tokens.canvas, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Inside);
    let inside = painter.with_clip_rect(plot.intersect(ui.clip_rect()));
    let place = |x: f64, y: f64| {
        let (x, y) = (0.5 + 0.5 * (x / reach) as f32, y.clamp(-0.05, 1.1) as f32);
        pos2(plot.left() + x * plot.width(), plot.bottom() - 3.0 - y / 1.1 * (plot.height() - 6.0))
    };
    let smooth = |of: &dyn Fn(f64) -> f64| -> Vec<egui::Pos2> {
        (0..=160).map(|i| reach * (f64::from(i) / 80.0 - 1.0)).map(|x| place(x, of(x))).collect()
    };
    if first.lobe(0.0).is_some() {
        inside.line(smooth(&|x| first.lobe(x).unwrap_or(0.0)), Stroke::new(1.0, tokens.dim));
    }
    inside.line(smooth(&|x| first.model(x)), Stroke::new(1.5, tokens.accent));
    if let Some(sigma) = refined {
        let fitted = move |x: f64| (-0.5 * (x / sigma).powi(2)).exp();
        let dashed = egui::Shape::dashed_line(&smooth(&fitted), Stroke::new(1.5, tokens.warn), 5.0, 4.0);
        inside.extend(dashed);
    }
    for cut in cuts {
        for (x, y) in cut.offset.iter().zip(&cut.measured) {
            inside.circle_filled(place(*x, *y), 2.0, tokens.text);
        }
    }
    let font = || theme::mono(10.0);
    let edge = if kind.is_angular() { format!("{:.1}°", sine_deg(reach)) } else { width(kind, reach) };
    let below = plot.bottom() + 2.0;
    painter.text(pos2(plot.left(), below), Align2::LEFT_TOP, format!("−{edge}"), font(), tokens.dim);
    painter.text(pos2(plot.right(), below), Align2::RIGHT_TOP, format!("+{edge}"), font(), tokens.dim);
    let words = if first.fft.is_some() {
        "points: measured · line: model · dashed: fitted · thin: window"
    } else {
        "points: measured · line: model · dashed: fitted"
    };
    painter.text(pos2(plot.center().x, below), Align2::CENTER_TOP, words, FontId::proportional(10.0), tokens.dim);
}

fn title(kind: AxisKind) -> &'static str {
    match kind {
        AxisKind::Doppler => "Radial speed",
        AxisKind::Elevation => "Elevation",
        kind if kind.is_angular() => "Azimuth",
        _ => "Range",
    }
}

/// A width as a person reads it.
fn width(kind: AxisKind, sigma: f64) -> String {
    match kind {
        AxisKind::Doppler => format!("{sigma:.3} m/s"),
        kind if kind.is_angular() => format!("{:.2}°", sigma.to_degrees()),
        _ => format!("{:.2} cm", 100.0 * sigma),
    }
}
