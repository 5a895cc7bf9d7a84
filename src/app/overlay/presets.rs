//! A frame fitted with two presets, side by side: the first thing that a new person sees.

use super::modal;
use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::value_row;
use crate::body::Skeleton;
use crate::config::Preset;
use crate::geometry::Vec3;
use crate::session::{Command, PresetCard, PresetFits};
use crate::study::FrameFit;
use egui::{Color32, Painter, Rect, RichText, Sense, Stroke, Ui, pos2, vec2};

/// Width of the card and height of a picture, points.
const WIDTH: f32 = 720.0;
const PICTURE: f32 = 190.0;
/// Height of what a preset is, and of all that is said of one.
const HELP: f32 = 46.0;
const CONTENT: f32 = 430.0;

/// Room around the bodies, m.
const MARGIN: f64 = 0.15;

/// What a body is seen from: the axes to the right and up, m, and what they are called.
struct Sight {
    title: &'static str,
    axes: [usize; 2],
    /// Which way each runs on screen: y grows to the left as a radar sees it.
    signs: [f64; 2],
}

const SIGHTS: [Sight; 2] = [
    Sight { title: "front", axes: [1, 2], signs: [-1.0, 1.0] },
    Sight { title: "above", axes: [1, 0], signs: [-1.0, 1.0] },
];

/// Draws the card; answers whether it is to be closed.
pub(super) fn show(ui: &Ui, shared: &mut Shared<'_>) -> bool {
    let tokens = Tokens::of(ui);
    let card = shared.session.presets.clone();
    let mut close = false;
    let response = modal(ui, "presets").show(ui.ctx(), |ui| {
        let screen = ui.ctx().content_rect();
        ui.set_width(WIDTH.min(screen.width() - 60.0));
        ui.label(RichText::new("One frame, two ways to fit it").font(theme::strong(16.0)));
        let text =
            "The paper's settings, and those that this program recommends. Either is one click in the Fit pane later.";
        ui.label(RichText::new(text).color(tokens.dim));
        ui.add_space(6.0);
        match &card {
            PresetCard::Closed => {}
            PresetCard::Fitting => {
                ui.horizontal(|ui| {
                    ui.add(egui::Spinner::new().size(14.0));
                    ui.label("Fitting this frame with both…");
                });
            }
            PresetCard::Shown(fits) => {
                let height = (screen.height() - 200.0).max(160.0);
                // The card was smaller while the fits were on their way.
                let area = egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height.min(CONTENT));
                area.show(ui, |ui| {
                    ui.columns(fits.fits.len(), |columns| {
                        for (ui, (preset, fit)) in columns.iter_mut().zip(&fits.fits) {
                            let column = |ui: &mut Ui| column(ui, shared, fits, *preset, fit, &tokens);
                            close |= ui.with_layout(egui::Layout::top_down(egui::Align::Min), column).inner;
                        }
                    });
                });
            }
        }
        ui.add_space(6.0);
        close |= ui.button("Close").clicked();
    });
    close || response.should_close()
}

fn column(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    fits: &PresetFits,
    preset: Preset,
    fit: &Result<FrameFit, String>,
    tokens: &Tokens,
) -> bool {
    ui.label(RichText::new(preset.name()).font(theme::strong(theme::TITLE)));
    ui.allocate_ui(vec2(ui.available_width(), HELP), |ui| {
        ui.set_min_height(HELP);
        ui.label(RichText::new(preset.help()).small().color(tokens.dim));
    });
    let fit = match fit {
        Ok(fit) => fit,
        Err(why) => {
            ui.label(RichText::new(why).color(tokens.bad));
            return false;
        }
    };
    if let Some(dataset) = &shared.session.data.dataset {
        picture(ui, fits, fit, &dataset.info().skeleton, preset, tokens);
    }
    numbers(ui, fit);
    ui.add_space(4.0);
    let take = ui.button(format!("Take {}", preset.name()));
    // Enter takes what is recommended, the arrow keys lead to the other one.
    if preset == Preset::Recommended && ui.memory(|memory| memory.focused().is_none()) {
        take.request_focus();
    }
    let take = take.clicked();
    if take {
        shared.send(Command::SetConfig(Box::new(preset.config())));
    }
    take
}

/// The figures of a fit.
fn numbers(ui: &mut Ui, fit: &FrameFit) {
    let numbers = &fit.numbers;
    if let Some(mm) = numbers.majpe_mm {
        value_row(ui, "MAJPE", &format!("{mm:.0}"), "mm");
    }
    if let Some(mm) = numbers.pa_majpe_mm {
        value_row(ui, "PA-MAJPE", &format!("{mm:.0}"), "mm");
    }
    let known: Vec<f64> = numbers.report.iou.iter().flatten().copied().collect();
    if !known.is_empty() {
        let iou = known.iter().sum::<f64>() / known.len() as f64;
        value_row(ui, "IoU, mean of views", &format!("{iou:.2}"), "");
    }
    let ms = numbers.init_ms.unwrap_or_default() + numbers.fit_ms;
    value_row(ui, "start and fit", &format!("{ms:.0}"), "ms");
}

/// The fitted body, over the truth where there is any, from the front and from above; both fits to one scale.
fn picture(ui: &mut Ui, fits: &PresetFits, fit: &FrameFit, skeleton: &Skeleton, preset: Preset, tokens: &Tokens) {
    let truth = fits.frame.truth.as_ref().map(|truth| truth.joints.as_slice()).unwrap_or_default();
    let bodies = fits.fits.iter().filter_map(|(_, fit)| fit.as_ref().ok()).map(|fit| fit.params.positions());
    let all: Vec<Vec3> = bodies.chain([truth]).flatten().copied().filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), PICTURE), Sense::hover());
    response.widget_info(|| {
        let what = format!("Body fitted with {}, from the front and from above", preset.name());
        egui::WidgetInfo::labeled(egui::Role::Image, true, what)
    });
    let halves = [rect.with_max_x(rect.center().x - 3.0), rect.with_min_x(rect.center().x + 3.0)];
    for (sight, half) in SIGHTS.iter().zip(halves) {
        let painter = ui.painter_at(half);
        painter.rect_filled(half, 3.0, tokens.raised);
        let title = pos2(half.left() + 5.0, half.top() + 3.0);
        let font = egui::FontId::proportional(theme::CAPTION);
        painter.text(title, egui::Align2::LEFT_TOP, sight.title, font, tokens.dim);
        let place = sight.place(&all, half);
        draw(&painter, truth, skeleton, &place, |_| (tokens.truth, 1.5));
        draw(&painter, fit.params.positions(), skeleton, &place, |bone| (tokens.side(skeleton.bone_side(bone)), 2.0));
    }
    let text = if truth.is_empty() { "No joints in 3-D are annotated." } else { "Thin: the truth." };
    ui.label(RichText::new(text).small().color(if truth.is_empty() { tokens.dim } else { tokens.truth }));
}

impl Sight {
    /// Where a point is in `rect`, so that all of `points` are seen to one scale.
    fn place(&self, points: &[Vec3], rect: Rect) -> impl Fn(Vec3) -> egui::Pos2 {
        let (axes, signs) = (self.axes, self.signs);
        let flat = move |p: Vec3| [signs[0] * p[axes[0]], signs[1] * p[axes[1]]];
        let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points.iter().map(|&point| flat(point)) {
            for k in 0..2 {
                (lo[k], hi[k]) = (lo[k].min(point[k]), hi[k].max(point[k]));
            }
        }
        let extent = |k: usize| (hi[k] - lo[k]).max(0.1) + 2.0 * MARGIN;
        let scale = (f64::from(rect.width()) / extent(0)).min(f64::from(rect.height()) / extent(1));
        let middle = [0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])];
        move |p| {
            let [x, y] = flat(p);
            rect.center() + vec2((scale * (x - middle[0])) as f32, (-scale * (y - middle[1])) as f32)
        }
    }
}

/// The bones of every person.
fn draw(
    painter: &Painter,
    joints: &[Vec3],
    skeleton: &Skeleton,
    place: &impl Fn(Vec3) -> egui::Pos2,
    look: impl Fn([usize; 2]) -> (Color32, f32),
) {
    for person in joints.chunks_exact(skeleton.joints.len().max(1)) {
        for &bone in &skeleton.bones {
            let [a, b] = bone.map(|joint| person[joint]);
            if a.iter().chain(&b).all(|x| x.is_finite()) {
                let (color, width) = look(bone);
                painter.line_segment([place(a), place(b)], Stroke::new(width, color));
            }
        }
    }
}
