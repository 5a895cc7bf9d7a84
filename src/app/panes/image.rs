//! The image plane: key points, boxes and mask in camera pixels. They are pixels, never metres, and are never compared
//! with the fit.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::CTRL;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Mark;
use crate::body::Skeleton;
use crate::dataset::{Frame, ImageAnnotations};
use crate::session::Session;
use egui::{Align2, Color32, ColorImage, FontId, Key, Rect, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2};
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Image",
    title: "Image plane",
    icon: &[
        Mark::Box([1.5, 2.5, 14.5, 13.5]),
        Mark::Ring([8.0, 6.2], 1.6),
        Mark::Line(&[[4.5, 13.0], [5.5, 10.0], [10.5, 10.0], [11.5, 13.0]]),
    ],
    help: "key points, boxes and masks in camera pixels",
    dock: Dock::RightBottom,
    keys: &[(CTRL, Key::Num9)],
    margin: 0,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: None,
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// The mask's texture.
#[derive(Default)]
struct State {
    mask: Option<(Arc<Frame>, TextureHandle)>,
}

impl PaneState for State {}

fn blank(session: &Session) -> Option<Blank> {
    let Some(frame) = &session.data.frame else {
        return Some(Blank::new("No frame", "Labels in camera pixels appear here."));
    };
    let how = "This frame has no key points, boxes or masks in camera pixels.";
    let how = || frame.notes.iter().fold(how.to_owned(), |text, note| format!("{text}\n{note}"));
    frame.image.is_none().then(|| Blank::new("No image labels", how()))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let Some(frame) = &shared.session.data.frame else { return };
    let Some(image) = &frame.image else { return };
    let [width, height] = image.size.map(|n| n.max(1) as f32);
    let tokens = Tokens::of(ui);
    let area = ui.available_rect_before_wrap().shrink2(vec2(8.0, 8.0));
    let area = Rect::from_min_max(area.min, area.max - vec2(0.0, 34.0));
    let scale = (area.width() / width).min(area.height() / height);
    let rect = Rect::from_center_size(area.center(), vec2(width, height) * scale);
    let response = ui.interact(rect, ui.scope_id().with("image plane"), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, "Image plane labels"));
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 0.0, tokens.canvas);
    paint_mask(ui, state, frame, image, rect);
    let at = |x: f64, y: f64| rect.min + vec2(x as f32, y as f32) * scale;
    for b in &image.boxes {
        let r = Rect::from_two_pos(at(b[0], b[1]), at(b[2], b[3]));
        painter.rect_stroke(r, 0.0, Stroke::new(1.5, tokens.warn), egui::StrokeKind::Middle);
        let score = format!("{:.2}", b[4]);
        painter.text(r.left_top() + vec2(3.0, 2.0), Align2::LEFT_TOP, score, theme::mono(10.0), tokens.warn);
    }
    if let Some(skeleton) = Skeleton::preset(&image.keypoint_skeleton) {
        for person in &image.keypoints {
            draw_keypoints(&painter, &skeleton, person, &at, &tokens);
        }
    }
    ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    let people = image.keypoints.len().max(image.boxes.len());
    let missing = if frame.notes.is_empty() { String::new() } else { format!(" · {}", frame.notes.join(" · ")) };
    let text = format!(
        "{width} × {height} px · {people} labelled {} · pixels of the camera, not metres: never compared with the fit{missing}",
        if people == 1 { "person" } else { "people" }
    );
    let font = FontId::proportional(theme::CAPTION);
    let galley = ui.painter().layout(text, font, tokens.dim, area.width());
    ui.painter().galley(pos2(area.left(), area.bottom() + 4.0), galley, tokens.dim);
    if let Some(pointer) = response.hover_pos() {
        let px = (pointer - rect.min) / scale;
        response.on_hover_text_at_pointer(format!("x {:.0} px, y {:.0} px", px.x, px.y));
    }
}

/// Key points fade with their score: a nose seen from behind has a score near zero.
fn draw_keypoints(
    painter: &egui::Painter,
    skeleton: &Skeleton,
    person: &[[f64; 3]],
    at: &dyn Fn(f64, f64) -> egui::Pos2,
    tokens: &Tokens,
) {
    let alpha = |score: f64| (0.15 + 0.85 * score.clamp(0.0, 1.0)) as f32;
    for &bone in &skeleton.bones {
        if let (Some(a), Some(b)) = (person.get(bone[0]), person.get(bone[1])) {
            let color = tokens.side(skeleton.bone_side(bone)).gamma_multiply(alpha(a[2].min(b[2])));
            painter.line_segment([at(a[0], a[1]), at(b[0], b[1])], Stroke::new(2.0, color));
        }
    }
    for (joint, p) in person.iter().enumerate() {
        let color = tokens.side(skeleton.side(joint)).gamma_multiply(alpha(p[2]));
        painter.circle_filled(at(p[0], p[1]), 3.0, color);
    }
}

fn paint_mask(ui: &Ui, state: &mut State, frame: &Arc<Frame>, image: &ImageAnnotations, rect: Rect) {
    if image.masks.is_empty() {
        return;
    }
    if !state.mask.as_ref().is_some_and(|(known, _)| Arc::ptr_eq(known, frame)) {
        let mut picture = ColorImage::filled(image.size, Color32::TRANSPARENT);
        for mask in &image.masks {
            for (pixel, &on) in picture.pixels.iter_mut().zip(mask) {
                if on {
                    *pixel = Color32::from_rgba_unmultiplied(120, 130, 145, 110);
                }
            }
        }
        let texture = ui.ctx().load_texture("image mask", picture, TextureOptions::NEAREST);
        state.mask = Some((Arc::clone(frame), texture));
    }
    if let Some((_, texture)) = &state.mask {
        let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().with_clip_rect(rect.intersect(ui.clip_rect())).image(texture.id(), rect, all, Color32::WHITE);
    }
}
