//! The exact map beside the closed form: the shown fit's joints as signals over samples, chirps and antennas through windowed FFTs,
//! and where the closed form differs. Computed on demand, on a thread of its own.

use super::chain::colormap;
use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::map_image::{Orientation, colorize};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Mark;
use crate::mhp::{CellValue, FitError, simulate_signal};
use crate::radar::View;
use crate::render::Colormap;
use crate::session::{CubeView, Session};
use crate::task::Job;
use egui::{Align2, Color32, Rect, RichText, Role, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2};
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Signal",
    title: "Signal path",
    icon: &[Mark::Line(&[
        [1.0, 8.0],
        [2.5, 4.2],
        [4.0, 3.0],
        [5.5, 4.2],
        [8.0, 8.0],
        [10.5, 11.8],
        [12.0, 13.0],
        [13.5, 11.8],
        [15.0, 8.0],
    ])],
    help: "the map that the signals themselves give, beside the closed form",
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
/// Differences that are told apart, of the strongest cell.
const DIFFERENCE: f64 = 0.1;

/// What a map was made of: data set, frame, branch's iteration.
type Made = (u64, usize, usize, CellValue);

/// One map a view.
type Maps = Vec<Vec<f64>>;

/// The maps, or the work under way.
#[derive(Default)]
struct State {
    view: usize,
    cells: CellValue,
    /// Computed anew for whatever the fit shows, instead of when the button is pressed.
    follow: bool,
    asked: bool,
    job: Option<(Made, Job<Maps, FitError>)>,
    known: Option<(Made, Result<Maps, String>)>,
    pictures: Option<((Made, usize), [TextureHandle; 3], Told)>,
}

/// What is told of one view's maps.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Told {
    /// Largest difference over cells within 3 dB of the strongest, and over all; of the strongest.
    near: f64,
    all: f64,
}

impl PaneState for State {
    fn is_working(&self) -> bool {
        self.job.is_some()
    }
}

fn blank(session: &Session) -> Option<Blank> {
    if session.fit.shown.is_none() || session.fit.problem.is_none() {
        return Some(Blank::new("No fit", "Once a frame has joints, the map of their signals can be computed here."));
    }
    let ffts = session.data.dataset.as_ref().map(|dataset| dataset.info().ffts()).unwrap_or_default();
    let how = "This data set states its point-spread widths. Say its FFTs in a dataset.toml instead: [view.fft] with samples, chirps, \
               window and array; or a radar by its name, radar = \"iwr1843\".";
    ffts.iter().any(Option::is_none).then(|| Blank::new("FFTs not known", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let Some(dataset) = shared.session.data.dataset.clone() else { return };
    ui.horizontal_wrapped(|ui| {
        for (k, view) in dataset.info().views.iter().enumerate() {
            ui.selectable_value(&mut state.view, k, RichText::new(&view.array).small());
        }
        ui.separator();
        let tip = "A cell is the FFT's value at its centre, as a radar stores it, or the mean over its width, as the closed form has it \
                   (its I/12).";
        for (cells, word) in [(CellValue::Centre, "Cells' centres"), (CellValue::Mean, "Cells' means")] {
            ui.selectable_value(&mut state.cells, cells, RichText::new(word).small()).on_hover_text(tip);
        }
        ui.separator();
        if ui.button(RichText::new("Compute").small()).on_hover_text("Of the iteration that is shown.").clicked() {
            state.asked = true;
        }
        ui.checkbox(&mut state.follow, RichText::new("Follow the fit").small());
    });
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let (Some(dataset), Some(shown), Some(problem)) = (&session.data.dataset, &session.fit.shown, &session.fit.problem)
    else {
        return;
    };
    let made = (dataset.id(), session.fit.frame, shown.iteration, state.cells);
    let first = state.known.is_none() && state.job.is_none();
    let stale = state.known.as_ref().is_none_or(|(known, _)| *known != made);
    if stale && state.job.is_none() && (first || state.asked || state.follow) {
        state.asked = false;
        let (problem, params, config) = (Arc::clone(problem), shown.params.clone(), shown.config);
        let (ffts, cells, ctx) = (dataset.info().ffts(), state.cells, ui.ctx().clone());
        let broken = |message| FitError::WrongView { array: String::new(), reason: message };
        let work = move |_: &crate::task::Progress| simulate_signal(&problem, &ffts, &config, &params, cells);
        state.job = Some((made, Job::start("signal-path", work, broken, move || ctx.request_repaint())));
    }
    if let Some((of, job)) = &mut state.job
        && let Some(answer) = job.poll()
    {
        state.known = Some((*of, answer.map_err(|error| error.to_string())));
        state.job = None;
    }
    let tokens = Tokens::of(ui);
    let (of, maps) = match &state.known {
        None => {
            ui.label(RichText::new("Computing the signals …").color(tokens.dim));
            return;
        }
        Some((_, Err(why))) => {
            ui.label(RichText::new(why).color(tokens.bad));
            return;
        }
        Some((of, Ok(maps))) => (*of, maps),
    };
    let views = &problem.views;
    let at = state.view.min(views.len().saturating_sub(1));
    let (Some(view), Some(signal), Some(closed)) = (views.get(at), maps.get(at), shown.h_sim.get(at)) else { return };
    if of != made {
        let text = format!("Of iteration {}; the fit shows {}. Compute again, or follow the fit.", of.2, made.2);
        ui.label(RichText::new(text).small().color(tokens.warn));
    } else if state.pictures.as_ref().is_none_or(|(known, ..)| *known != (of, at)) {
        let (images, told) = pictures(session, view, closed, signal);
        let names = ["closed form", "signals", "difference"];
        let load = |k: usize| ui.ctx().load_texture(names[k], images[k].clone(), TextureOptions::NEAREST);
        state.pictures = Some(((of, at), [load(0), load(1), load(2)], told));
    }
    if let Some((_, textures, told)) = &state.pictures {
        draw(ui, textures, *told, &tokens);
    }
}

/// Both maps in dB, and the difference of the two in the same units.
fn pictures(session: &Session, view: &View, closed: &[f64], signal: &[f64]) -> ([egui::ColorImage; 3], Told) {
    let orientation = Orientation::of(view, CubeView::default());
    let size = orientation.size(view);
    let most = signal.iter().copied().filter(|x| x.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    let decibels = |map: &[f64]| {
        let level = |x: f64| (20.0 * (x.max(0.0) / most).log10()).max(FLOOR_DB);
        let levels: Vec<f64> = orientation.picture(view, map).into_iter().map(level).collect();
        colorize(size, &levels, (FLOOR_DB, 0.0), colormap(session), false, theme::NAN_CELL)
    };
    let across = [closed, signal].map(|map| orientation.picture(view, map));
    let difference: Vec<f64> = across[0].iter().zip(&across[1]).map(|(c, s)| (c - s) / most).collect();
    let image = colorize(size, &difference, (-DIFFERENCE, DIFFERENCE), Colormap::Diverging, false, theme::NAN_CELL);
    let half = most * 0.5f64.sqrt();
    let cells = closed.iter().zip(signal).map(|(c, s)| ((c - s).abs() / most, *s > half));
    let told = cells.fold(Told { near: 0.0, all: 0.0 }, |told, (x, near)| Told {
        near: if near { told.near.max(x) } else { told.near },
        all: told.all.max(x),
    });
    ([decibels(closed), decibels(signal), image], told)
}

fn draw(ui: &mut Ui, textures: &[TextureHandle; 3], told: Told, tokens: &Tokens) {
    let text = format!(
        "The closed form differs by at most {:.1} % of the strongest cell where the map is within 3 dB of it, {:.1} % anywhere.",
        100.0 * told.near,
        100.0 * told.all
    );
    ui.label(RichText::new(text).small().color(tokens.dim));
    ui.add_space(4.0);
    let area = ui.available_rect_before_wrap();
    let width = (area.width() - 16.0) / 3.0;
    if width < 40.0 || area.height() < 60.0 {
        return;
    }
    let titles = ["Closed form, dB", "Signals, dB", "Closed form − signals"];
    let scales = ["−40 to 0 dB", "−40 to 0 dB", "−10 % blue · red +10 % of the strongest"];
    for (k, texture) in textures.iter().enumerate() {
        let rect = Rect::from_min_size(area.min + vec2(k as f32 * (width + 8.0), 0.0), vec2(width, area.height()));
        let plot = Rect::from_min_max(rect.min + vec2(0.0, 18.0), rect.max - vec2(0.0, 16.0));
        let painter = ui.painter();
        painter.text(rect.min, Align2::LEFT_TOP, titles[k], theme::strong(theme::CAPTION), tokens.text);
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), plot, whole, Color32::WHITE);
        painter.rect_stroke(plot, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
        let below = pos2(plot.left(), plot.bottom() + 2.0);
        painter.text(below, Align2::LEFT_TOP, scales[k], egui::FontId::proportional(10.0), tokens.dim);
        let response = ui.interact(plot, ui.scope_id().with(("signal", k)), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(Role::Canvas, true, titles[k]));
    }
}
