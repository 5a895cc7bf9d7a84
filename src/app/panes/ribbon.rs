//! τ under the finger: the IoU of the shown state at every τ beside the slider, without a refit; and on request the outlines of the
//! masks at τ and its neighbours on the maps, and the points that are kept at it in 3-D.

use super::extras::{Extras, publish};
use super::{PaneState, Shared};
use crate::app::theme::Tokens;
use crate::app::widgets::Named as _;
use crate::config::FitConfig;
use crate::explore::{Halt, TauClouds, TauRibbon, tau_clouds, tau_ribbon};
use crate::session::Session;
use crate::task::{Job, Progress};
use crate::worker::Snapshot;
use egui::{RichText, Role, Sense, Stroke, Ui, pos2, vec2};
use std::sync::Arc;

/// τ at the right end, %.
const MOST: f64 = 60.0;
/// Neighbours of τ, of which the masks are outlined too.
pub(super) const NEIGHBOURS: [f64; 3] = [2.0 / 3.0, 1.0, 1.5];
/// Height of the ribbon, points.
const HEIGHT: f32 = 40.0;

#[derive(Default)]
pub(super) struct Ribbon {
    job: Option<(Arc<Snapshot>, Job<TauRibbon, Halt>)>,
    known: Option<(Arc<Snapshot>, TauRibbon)>,
    clouds_job: Option<(CloudsOf, Job<TauClouds, Halt>)>,
    clouds: Option<(CloudsOf, Arc<TauClouds>)>,
    drawn: Option<(CloudsOf, bool, Arc<Extras>)>,
}

/// A state and a τ.
#[derive(Clone)]
struct CloudsOf(Arc<Snapshot>, f64);

impl PartialEq for CloudsOf {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) && self.1.to_bits() == other.1.to_bits()
    }
}

impl PaneState for Ribbon {
    fn is_working(&self) -> bool {
        self.clouds_job.is_some()
    }
}

fn take<K: Clone, T: Send + 'static>(job: &mut Option<(K, Job<T, Halt>)>) -> Option<(K, Result<T, Halt>)> {
    let (of, running) = job.as_mut()?;
    let answer = running.poll()?;
    let of = of.clone();
    *job = None;
    Some((of, answer))
}

impl Ribbon {
    /// Asks for the ribbon of the newest state: one at a time, so that a run does not starve it.
    fn follow(&mut self, ui: &Ui, session: &Session) {
        let (Some(shown), Some(problem)) = (&session.fit.shown, &session.fit.problem) else { return };
        if let Some((of, Ok(ribbon))) = take(&mut self.job) {
            self.known = Some((of, ribbon));
        }
        let there = self.known.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, shown));
        if there || self.job.is_some() {
            return;
        }
        let (of, problem, ctx) = (Arc::clone(shown), Arc::clone(problem), ui.ctx().clone());
        let work = move |_: &Progress| {
            let maps: Vec<(&[f64], &[f64])> =
                of.h_sim.iter().enumerate().map(|(k, sim)| (problem.map(k), sim.as_slice())).collect();
            Ok(tau_ribbon(&maps, &of.masks))
        };
        self.job =
            Some((Arc::clone(shown), Job::start("tau-ribbon", work, Halt::Failed, move || ctx.request_repaint())));
    }

    /// The points of the newest state at its τ, while they are asked for.
    fn follow_clouds(&mut self, ui: &Ui, session: &Session, tokens: &Tokens) {
        let Some(shown) = &session.fit.shown else { return };
        if let Some((of, Ok(clouds))) = take(&mut self.clouds_job) {
            self.clouds = Some((of, Arc::new(clouds)));
        }
        let asked = CloudsOf(Arc::clone(shown), session.config.tau_pct);
        let there = self.clouds.as_ref().is_some_and(|(of, _)| *of == asked);
        if !there && self.clouds_job.is_none() {
            let Ok(mut state) = session.explored_state() else { return };
            state.config.tau_pct = session.config.tau_pct;
            let (of, cores, ctx) = (Arc::clone(shown), session.explore.cores.clone(), ui.ctx().clone());
            let work = move |progress: &Progress| tau_clouds(&state, (&of.h_sim, &of.masks), (&cores, progress));
            self.clouds_job =
                Some((asked, Job::start("tau-clouds", work, Halt::Failed, move || ctx.request_repaint())));
        }
        let Some((of, clouds)) = &self.clouds else { return };
        let same = self.drawn.as_ref().is_some_and(|(known, dark, _)| known == of && *dark == tokens.dark);
        if !same {
            let mut extras = Extras::default();
            for (cloud, color, size) in clouds_of(clouds, tokens) {
                extras.points.extend(cloud.iter().map(|point| (point.position, size, color)));
            }
            self.drawn = Some((of.clone(), tokens.dark, Arc::new(extras)));
        }
        if let Some((.., extras)) = &self.drawn {
            publish(ui.ctx(), "tau", Arc::clone(extras));
        }
    }
}

/// The clouds with their colours and the size of their points, m.
fn clouds_of<'a>(
    clouds: &'a TauClouds,
    tokens: &Tokens,
) -> [(&'a [crate::representation::CloudPoint], egui::Color32, f64); 3] {
    [(&clouds.threshold, tokens.dim, 0.018), (&clouds.cfar, tokens.warn, 0.026), (&clouds.pppr, tokens.accent, 0.026)]
}

/// Draws the ribbon below the slider; a click or a drag on it sets τ.
pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, ribbon: &mut Ribbon, config: &mut FitConfig) {
    let session = shared.session;
    ribbon.follow(ui, session);
    let tokens = Tokens::of(ui);
    if session.view.show_clouds {
        ribbon.follow_clouds(ui, session, &tokens);
    }
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let told = told(ribbon, config.tau_pct);
    let hover = response.hover_pos().and_then(|at| {
        let tau = f64::from((at.x - rect.left()) / rect.width().max(1.0)) * MOST;
        let iou = ribbon.known.as_ref()?.1.at(tau)?;
        Some(format!("τ {tau:.1} %: IoU {iou:.3}\n"))
    });
    let told = format!("{}{told}", hover.unwrap_or_default());
    response.widget_info(|| {
        let mut info = egui::WidgetInfo::labeled(Role::Slider, true, "IoU at every τ");
        info.current_text_value = Some(told.clone());
        info
    });
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 2.0, tokens.canvas);
    painter.rect_stroke(rect, 2.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Inside);
    let x = |tau: f64| rect.left() + (tau / MOST).clamp(0.0, 1.0) as f32 * rect.width();
    let y = |iou: f64| rect.bottom() - 2.0 - iou.clamp(0.0, 1.0) as f32 * (rect.height() - 4.0);
    if let Some((_, known)) = &ribbon.known {
        let line = |of: &[Option<f64>]| -> Vec<egui::Pos2> {
            known.taus.iter().zip(of).filter_map(|(tau, iou)| Some(pos2(x(*tau), y((*iou)?)))).collect()
        };
        // What masks of the size have in common by chance.
        let chance: Vec<egui::Pos2> = known.taus.iter().map(|tau| pos2(x(*tau), y(tau / (200.0 - tau)))).collect();
        painter.add(egui::Shape::dashed_line(&chance, Stroke::new(1.0, tokens.stroke), 3.0, 3.0));
        for view in &known.views {
            painter.line(line(view), Stroke::new(0.8, tokens.dim.gamma_multiply(0.7)));
        }
        painter.line(line(&known.iou), Stroke::new(1.6, tokens.accent));
        if let Some((tau, iou)) = known.most_telling() {
            painter.circle_stroke(pos2(x(tau), y(iou)), 3.0, Stroke::new(1.2, tokens.text));
        }
    }
    painter.vline(x(config.tau_pct), rect.y_range(), Stroke::new(1.5, tokens.text));
    if (response.dragged() || response.clicked())
        && let Some(pointer) = response.interact_pointer_pos()
    {
        let share = f64::from((pointer.x - rect.left()) / rect.width().max(1.0));
        let tau = (2.0 * MOST * share).round() / 2.0;
        config.tau_pct = tau.clamp(0.5, MOST);
    }
    let tip = "The IoU of the masks of the iteration on screen at every τ, without a refit: all views' mean thick, each view thin, chance dashed; the ring is where agreement is farthest from chance. Click or drag to take a τ.";
    response.on_hover_text(format!("{told}\n{tip}"));
    switches(ui, shared, ribbon, &tokens);
}

fn told(ribbon: &Ribbon, tau: f64) -> String {
    let Some((_, known)) = &ribbon.known else { return "no state yet".into() };
    let iou = known.at(tau).map_or_else(|| "—".into(), |iou| format!("{iou:.3}"));
    let of = |x: Option<(f64, f64)>| x.map_or_else(|| "—".into(), |(tau, iou)| format!("τ {tau} % (IoU {iou:.3})"));
    format!(
        "IoU {iou} at τ {tau} %; largest at {}, farthest from chance at {}",
        of(known.best()),
        of(known.most_telling())
    )
}

fn switches(ui: &mut Ui, shared: &mut Shared<'_>, ribbon: &Ribbon, tokens: &Tokens) {
    let view = &shared.session.view;
    let (mut outlines, mut clouds) = (view.show_outlines, view.show_clouds);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(RichText::new("IoU, τ 0–60 %").small().color(tokens.dim));
        let button = ui.selectable_label(outlines, RichText::new("Outlines").small());
        let tip =
            "The outlines of both masks at τ, and thinner at two thirds and at one and a half of it, on the maps.";
        if button.named(Role::Button, "Mask outlines at τ").on_hover_text(tip).clicked() {
            outlines = !outlines;
        }
        let button = ui.selectable_label(clouds, RichText::new("Clouds").small());
        let tip = "The points that CFAR and a threshold at τ keep of H_ori, beside PPPR-PC, in 3-D (paper, figure 6).";
        if button.named(Role::Button, "Point clouds at τ").on_hover_text(tip).clicked() {
            clouds = !clouds;
        }
        if let (true, Some((_, known))) = (clouds, &ribbon.clouds) {
            for ((cloud, color, _), name) in clouds_of(known, tokens).into_iter().zip(["τ", "CFAR", "PPPR"]) {
                ui.label(RichText::new(format!("{name} {}", cloud.len())).small().color(color));
            }
        }
    });
    if (outlines, clouds) != (view.show_outlines, view.show_clouds) {
        shared.set_view(|view| (view.show_outlines, view.show_clouds) = (outlines, clouds));
    }
}
