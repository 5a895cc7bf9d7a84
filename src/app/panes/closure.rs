//! The closure test: the pose on screen through an independent radar, started and fitted as a new frame. The error, joint by joint,
//! the synthetic maps, and both skeletons in 3-D while this pane is in front.

use super::chain::colormap;
use super::extras::{Extras, publish};
use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::figure;
use crate::app::map_image::{Orientation, colorize};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _, value_row};
use crate::explore::{ClosureRequest, ClosureTest, Halt, closure_test};
use crate::session::{CubeView, Session};
use crate::task::Job;
use crate::worker::Snapshot;
use egui::{
    Align2, Color32, FontId, Rect, RichText, Role, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Closure",
    title: "Closure test",
    icon: &[
        Mark::Line(&[[2.0, 9.0], [2.0, 3.0], [13.0, 3.0]]),
        Mark::Line(&[[10.5, 1.0], [13.0, 3.0], [10.5, 5.0]]),
        Mark::Line(&[[14.0, 7.0], [14.0, 13.0], [3.0, 13.0]]),
        Mark::Line(&[[5.5, 11.0], [3.0, 13.0], [5.5, 15.0]]),
    ],
    help: "whether the pipeline could have recovered this pose from this radar at all",
    dock: Dock::BottomHigh,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| toolbar(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Levels below the strongest that are shown, dB.
const FLOOR_DB: f64 = -40.0;

/// How the test is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Choice {
    noise: f64,
    seed: u64,
    /// A test is on screen: it is run again where a session file is opened.
    tested: bool,
}

impl Default for Choice {
    fn default() -> Self {
        Self { noise: 0.02, seed: 1, tested: false }
    }
}

/// The test of a state that is under way.
type Asked = (Arc<Snapshot>, Job<ClosureTest, Halt>);
/// What came of one.
type Tested = (Arc<Snapshot>, Result<Arc<ClosureTest>, String>);

#[derive(Default)]
struct State {
    choice: Choice,
    job: Option<Asked>,
    test: Option<Tested>,
    pictures: Vec<TextureHandle>,
    drawn: Option<(bool, Arc<Extras>)>,
    /// A session file had a test on screen.
    again: bool,
}

impl PaneState for State {
    fn is_working(&self) -> bool {
        self.job.is_some() || self.again
    }

    fn stored_as(&self) -> Option<&'static str> {
        Some("closure")
    }

    fn stored(&self) -> serde_json::Result<Value> {
        serde_json::to_value(self.choice)
    }

    fn restore(&mut self, stored: Value, _: &Session) -> serde_json::Result<()> {
        self.choice = serde_json::from_value::<Option<Choice>>(stored)?.unwrap_or_default();
        self.again = self.choice.tested;
        Ok(())
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Once a frame has joints, one click tells whether their pose could have been recovered.";
    (session.fit.shown.is_none() || session.fit.problem.is_none()).then(|| Blank::new("No fit", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    if let Some((of, job)) = &mut state.job
        && let Some(answer) = job.poll()
    {
        state.test = Some((Arc::clone(of), answer.map(Arc::new).map_err(|halt| halt.to_string())));
        state.pictures.clear();
        (state.job, state.drawn) = (None, None);
    }
    let ready = session.fit.is_ready() && !session.fit.is_running();
    if state.again && ready && state.job.is_none() {
        state.again = false;
        state.job = begin(ui, session, state.choice);
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let tip = "This pose through antennas, chirps and FFTs, with skin and speckle of its own and without a room, then start and fit as on a new frame. Takes a second or two.";
        if let Some((_, job)) = &state.job {
            if ui.button("Stop").named(Role::Button, "Stop closure test").clicked() {
                job.cancel();
            }
            let at = job.progress().state();
            ui.spinner();
            let told = if at.total > 0 { format!("{} {}/{}", at.stage, at.done, at.total) } else { at.stage };
            ui.label(RichText::new(told).small().color(tokens.dim));
        } else if ui.add_enabled(!session.fit.is_running(), egui::Button::new("Test this pose")).on_hover_text(tip).clicked() {
            state.job = begin(ui, session, state.choice);
            state.choice.tested = true;
        }
        ui.separator();
        ui.label(RichText::new("noise").small().color(tokens.dim));
        let drag = egui::DragValue::new(&mut state.choice.noise).range(0.0..=1.0).speed(0.001).max_decimals(3);
        ui.add(drag).named(Role::SpinButton, "Noise of the receiver").on_hover_text(
            "In units of the echo of a square metre at 1 m: 0.002 is little, 0.05 much.",
        );
        ui.label(RichText::new("seed").small().color(tokens.dim));
        let drag = egui::DragValue::new(&mut state.choice.seed).speed(0.1);
        ui.add(drag).named(Role::SpinButton, "Seed of the test").on_hover_text("Of speckle and noise.");
        if let (Some((of, _)), Some(shown)) = (&state.test, &session.fit.shown)
            && !Arc::ptr_eq(of, shown)
        {
            ui.label(RichText::new("of another state of the fit").small().color(tokens.warn));
        }
    });
}

fn begin(ui: &Ui, session: &Session, choice: Choice) -> Option<Asked> {
    let (shown, dataset) = (session.fit.shown.as_ref()?, session.data.dataset.as_ref()?);
    let request = ClosureRequest {
        info: Arc::new(dataset.info().clone()),
        pose: shown.params.clone(),
        config: shown.config,
        precision: session.precision,
        noise: choice.noise,
        seed: choice.seed,
    };
    let (cores, ctx) = (session.explore.cores.clone(), ui.ctx().clone());
    let work = move |progress: &crate::task::Progress| closure_test(&request, (&cores, progress));
    Some((Arc::clone(shown), Job::start("closure-test", work, Halt::Failed, move || ctx.request_repaint())))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    if state.job.is_some() {
        // The progress moves while nothing else does.
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(100));
    }
    let test = match &state.test {
        None => {
            let text = "Could this pose have been recovered from this radar at all? The test measures it anew with an independent synthesis, and fits that.";
            ui.add(egui::Label::new(RichText::new(text).small().color(tokens.dim)).wrap());
            return;
        }
        Some((_, Err(why))) => {
            ui.add(egui::Label::new(RichText::new(why).small().color(tokens.bad)).wrap());
            return;
        }
        Some((_, Ok(test))) => Arc::clone(test),
    };
    let caption = figure::of(session, "closure test: synthetic maps in dB, error of each joint in mm");
    let area = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    ui.interact(area, ui.scope_id().with("closure"), Sense::hover())
        .widget_info(|| figure::spoken("Closure test result", caption.as_deref()));
    let views = &session.data.dataset.as_ref().map(|dataset| dataset.info().views.clone());
    let left = (0.3 * area.width()).clamp(180.0, 260.0);
    let (numbers, rest) = area.split_left_right_at_x(area.min.x + left);
    ui.scope_builder(egui::UiBuilder::new().max_rect(numbers.with_max_x(numbers.max.x - 8.0)), |ui| {
        egui::ScrollArea::vertical().id_salt("closure numbers").auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            table(ui, &test, &tokens);
        });
    });
    let wide = (0.5 * rest.width()).max(60.0);
    let (bars, maps) = rest.split_left_right_at_x(rest.min.x + wide);
    errors(ui, session, &test, bars.with_max_x(bars.max.x - 8.0), &tokens);
    if let Some(views) = views {
        if state.pictures.len() != test.maps.len() {
            state.pictures = pictures(ui, session, &test);
        }
        thumbnails(ui, views, &state.pictures, maps, &tokens);
    }
    if state.drawn.as_ref().is_none_or(|(dark, _)| *dark != tokens.dark) {
        let mut extras = Extras::default();
        extras.skeletons.push((test.truth.clone(), tokens.truth, 1.5));
        extras.skeletons.push((test.fitted.positions().to_vec(), tokens.warn, 2.0));
        extras.skeletons.push((test.start.positions().to_vec(), tokens.dim, 0.8));
        state.drawn = Some((tokens.dark, Arc::new(extras)));
    }
    if let Some((_, extras)) = &state.drawn {
        publish(ui.ctx(), "closure", Arc::clone(extras));
    }
}

fn table(ui: &mut Ui, test: &ClosureTest, tokens: &Tokens) {
    let [start, fit] = test.errors;
    value_row(ui, "MAJPE of the fit", &format!("{:.0}", fit.majpe_mm), "mm")
        .on_hover_text("Mean distance of the fitted joints to those that the maps were made of.");
    value_row(ui, "PA-MAJPE", &format!("{:.0}", fit.pa_majpe_mm), "mm");
    value_row(ui, "Middle off", &format!("{:.0}", test.middle_mm[1]), "mm");
    value_row(ui, "MAJPE of the start", &format!("{:.0}", start.majpe_mm), "mm");
    let iou = test.iou.map_or_else(|| "—".into(), |iou| format!("{iou:.3}"));
    value_row(ui, "IoU of the fit", &iou, "");
    for (text, color) in [("pose", tokens.truth), ("fit of it", tokens.warn), ("start", tokens.dim)] {
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(vec2(14.0, 8.0), Sense::hover());
            ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(2.0, color));
            ui.label(RichText::new(text).small().color(tokens.dim));
        });
    }
    if !test.assumed.is_empty() {
        let text = format!(
            "The FFTs of {} are not known: a radar with these widths was put in their place.",
            test.assumed.join(", ")
        );
        ui.add(egui::Label::new(RichText::new(text).small().color(tokens.warn)).wrap());
    }
}

/// The error of each joint as a bar.
fn errors(ui: &mut Ui, session: &Session, test: &ClosureTest, rect: Rect, tokens: &Tokens) {
    let Some(problem) = &session.fit.problem else { return };
    let most = test.joints_mm.iter().copied().fold(1.0, f64::max);
    ui.scope_builder(egui::UiBuilder::new().max_rect(rect), |ui| {
        ui.label(RichText::new("error of each joint, mm").small().color(tokens.dim));
        egui::ScrollArea::vertical().id_salt("closure joints").auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for (joint, mm) in test.joints_mm.iter().enumerate() {
                let (row, response) = ui.allocate_exact_size(vec2(ui.available_width(), 14.0), Sense::hover());
                let name = problem.skeleton.shown_name(joint % problem.skeleton.joints.len().max(1));
                response.widget_info(|| {
                    let mut info = egui::WidgetInfo::labeled(Role::Group, true, format!("Closure error of {name}"));
                    info.current_text_value = Some(format!("{mm:.0} mm"));
                    info
                });
                let painter = ui.painter().with_clip_rect(row.intersect(ui.clip_rect()));
                let label = (0.4 * row.width()).clamp(60.0, 110.0);
                painter.text(
                    row.left_center(),
                    Align2::LEFT_CENTER,
                    &name,
                    FontId::proportional(theme::CAPTION),
                    tokens.text,
                );
                let field = Rect::from_min_max(
                    pos2(row.min.x + label, row.min.y + 3.0),
                    pos2(row.max.x - 34.0, row.max.y - 3.0),
                );
                let length = (mm / most) as f32 * field.width().max(0.0);
                let color = tokens.side(problem.skeleton.side(joint % problem.skeleton.joints.len().max(1)));
                painter.rect_filled(Rect::from_min_size(field.min, vec2(length, field.height())), 0.0, color);
                painter.text(
                    row.right_center(),
                    Align2::RIGHT_CENTER,
                    format!("{mm:.0}"),
                    theme::mono(theme::CAPTION),
                    tokens.dim,
                );
            }
        });
    });
}

fn pictures(ui: &Ui, session: &Session, test: &ClosureTest) -> Vec<TextureHandle> {
    let Some(dataset) = &session.data.dataset else { return Vec::new() };
    let of = |(view, map): (&crate::radar::View, &Vec<f64>)| {
        let o = Orientation::of(view, CubeView::default());
        let most = map.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let level = |x: f64| (view.quantity.db_factor() * (x.max(0.0) / most).log10()).max(FLOOR_DB);
        let levels: Vec<f64> = o.picture(view, map).into_iter().map(level).collect();
        let image = colorize(o.size(view), &levels, (FLOOR_DB, 0.0), colormap(session), false, theme::NAN_CELL);
        ui.ctx().load_texture(format!("closure {}", view.array), image, TextureOptions::NEAREST)
    };
    dataset.info().views.iter().zip(&test.maps).map(of).collect()
}

fn thumbnails(ui: &Ui, views: &[crate::radar::View], pictures: &[TextureHandle], rect: Rect, tokens: &Tokens) {
    let count = pictures.len().max(1);
    let width = (rect.width() - 6.0 * (count - 1) as f32) / count as f32;
    if width < 24.0 || rect.height() < 40.0 {
        return;
    }
    for (k, (view, picture)) in views.iter().zip(pictures).enumerate() {
        let at = Rect::from_min_size(rect.min + vec2(k as f32 * (width + 6.0), 0.0), vec2(width, rect.height()));
        let plot = Rect::from_min_max(at.min + vec2(0.0, 15.0), at.max);
        let painter = ui.painter();
        let title = format!("{} anew, −40 to 0 dB", view.array);
        painter.with_clip_rect(at).text(at.min, Align2::LEFT_TOP, title, FontId::proportional(10.0), tokens.dim);
        painter.image(picture.id(), plot, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
        painter.rect_stroke(plot, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
        let response = ui.interact(plot, ui.scope_id().with(("closure map", k)), Sense::hover());
        response.widget_info(|| figure::spoken(&format!("Synthetic map of {}", view.array), None));
    }
}
