//! The 3-D view: Gaussians, bones, truth, velocity, gradients, the radar and its field of view.
//!
//! The picture is drawn offscreen by [`SceneRenderer`] and shown as a texture; it is drawn again only when the scene, the
//! camera or the size changed.

mod build;
mod gizmo;
mod hand;

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared, lit};
use crate::app::commands::{CTRL, CommandRow, Menu, NONE, UiAction, always, has_frame};
use crate::app::figure;
use crate::app::map_image::Orientation;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _, grounded};
use crate::mhp::JointReturn;
use crate::render::{Camera, Scene, SceneRenderer, Undrawable, Vec2, Vec3, pick, shapes};
use crate::session::{Command, Session, SplatMode, ViewState};
use crate::worker::JobId;
use eframe::egui_wgpu::RenderState;
use eframe::wgpu;
use egui::{Align2, Color32, Key, Rect, RichText, Sense, TextureId, Ui, pos2, vec2};
use gizmo::Gizmo;
use hand::{Grab, Holds, Sight};
use serde_json::Value;

/// Radius that a camera at its start shows, m.
const RADIUS_M: f32 = 2.4;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Scene",
    title: "3-D",
    icon: &[
        Mark::Line(&[[8.0, 1.0], [14.5, 4.5], [14.5, 11.5], [8.0, 15.0], [1.5, 11.5], [1.5, 4.5], [8.0, 1.0]]),
        Mark::Line(&[[1.5, 4.5], [8.0, 8.0], [14.5, 4.5]]),
        Mark::Line(&[[8.0, 8.0], [8.0, 15.0]]),
    ],
    help: "Gaussians, bones and the radar in the room",
    dock: Dock::RightBottom,
    keys: &[(CTRL, Key::Num8)],
    margin: 0,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Looks from the radar.
pub(in crate::app) const FROM_RADAR: CommandRow = CommandRow {
    label: "View from the radar",
    title: None,
    tooltip: "Put the camera at the radar, looking along its boresight.",
    menu: Menu::View,
    keys: &[(NONE, Key::V)],
    enabled: always,
    act: |_| look(from_radar),
};

/// Looks from above.
pub(in crate::app) const FROM_ABOVE: CommandRow = CommandRow {
    label: "View from above",
    title: None,
    tooltip: "Put the camera above the scene.",
    menu: Menu::View,
    keys: &[(NONE, Key::T)],
    enabled: always,
    act: |_| look(|session| Camera::top(centre(session) * 0.7, RADIUS_M)),
};

/// Looks from the side.
pub(in crate::app) const FROM_SIDE: CommandRow = CommandRow {
    label: "View from the side",
    title: None,
    tooltip: "Put the camera to the right of the scene.",
    menu: Menu::View,
    keys: &[(NONE, Key::S)],
    enabled: always,
    act: |_| look(|session| Camera::side(centre(session) * 0.7, RADIUS_M)),
};

/// Handles that move and turn a whole person.
pub(in crate::app) const MOVE_BODY: CommandRow = CommandRow {
    label: "Move body",
    title: None,
    tooltip: "Show handles in 3-D that move and turn the whole body of the selected person; again to hide them.",
    menu: Menu::Body,
    keys: &[(NONE, Key::H)],
    enabled: has_frame,
    act: |s| {
        let mut view = s.view.clone();
        view.move_body = !view.move_body;
        UiAction::Session(Command::SetView(Box::new(view)))
    },
};

fn look(camera: fn(&Session) -> Camera) -> UiAction {
    UiAction::panes(move |states, session| states.of::<State>().camera = Some(camera(session)))
}

/// Camera and GPU objects.
#[derive(Default)]
struct State {
    renderer: Option<SceneRenderer>,
    texture: Option<(TextureId, u64)>,
    /// What of the body is in the hand.
    grab: Option<Grab>,
    camera: Option<Camera>,
    /// The fit that was on screen in the pass before, and where its person was, m.
    person: Option<(JobId, Vec3)>,
    /// The data set that the camera was placed for.
    dataset: Option<std::sync::Weak<crate::dataset::Dataset>>,
}

/// A camera as a session file keeps it: target x, y, z, distance, yaw, pitch.
type StoredCamera = [f32; 6];

impl PaneState for State {
    fn reset_view(&mut self) {
        self.camera = None;
    }

    fn focus(&mut self, session: &Session) {
        let positions = session.shown_positions();
        let camera = self.camera.get_or_insert_with(|| overview(session));
        match session.joint.and_then(|joint| positions.get(joint)) {
            Some(&p) => camera.focus(Vec3::from(p.map(|x| x as f32)), 1.1),
            None => camera.focus(centre(session), 1.1),
        }
    }

    fn show_all(&mut self) {
        self.camera = None;
    }

    fn stored_as(&self) -> Option<&'static str> {
        Some("camera")
    }

    /// The camera, where it was moved.
    fn stored(&self) -> serde_json::Result<Value> {
        let numbers = |c: Camera| [c.target.x, c.target.y, c.target.z, c.distance, c.yaw, c.pitch];
        serde_json::to_value(self.camera.map(numbers))
    }

    fn restore(&mut self, stored: Value, session: &Session) -> serde_json::Result<()> {
        let stored: Option<StoredCamera> = serde_json::from_value(stored)?;
        self.dataset = session.data.dataset.as_ref().map(std::sync::Arc::downgrade);
        self.person = None;
        self.camera =
            stored.filter(|numbers| numbers.iter().all(|x| x.is_finite())).map(|[x, y, z, distance, yaw, pitch]| {
                Camera { target: Vec3::new(x, y, z), distance, yaw, pitch, ..Camera::default() }
            });
        Ok(())
    }
}

impl State {
    /// The camera goes where the person goes from frame to frame.
    fn follow(&mut self, session: &Session) {
        let Some(shown) = session.fit.shown.as_ref().filter(|shown| shown.job == session.fit.job) else { return };
        let now = centre(session);
        if let Some((job, before)) = self.person.replace((shown.job, now))
            && job != shown.job
            && session.view.follow
            && let Some(camera) = &mut self.camera
        {
            camera.target += now - before;
        }
    }
}

/// The radar's own look at the room.
fn from_radar(session: &Session) -> Camera {
    let distance = centre(session).length().max(1.0);
    Camera { target: Vec3::X * distance, distance, ..Camera::from_radar() }
}

/// Radar and person in one picture.
fn overview(session: &Session) -> Camera {
    let person = centre(session);
    Camera::overview(person * 0.62, (person.length() * 0.62).max(RADIUS_M * 0.8))
}

/// The middle of the shown joints, or a place in front of the radar.
fn centre(session: &Session) -> Vec3 {
    let positions = session.shown_positions();
    if positions.is_empty() {
        return Vec3::new(3.0, 0.0, 0.0);
    }
    let sum = positions.iter().fold(Vec3::ZERO, |sum, p| sum + Vec3::from(p.map(|x| x as f32)));
    sum / positions.len() as f32
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "The Gaussians of a fit appear here when a frame is open.";
    session.data.dataset.is_none().then(|| Blank::new("Nothing in the scene", how))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let known = state.dataset.as_ref().and_then(std::sync::Weak::upgrade);
    if !known
        .is_some_and(|known| shared.session.data.dataset.as_ref().is_some_and(|d| std::sync::Arc::ptr_eq(&known, d)))
    {
        state.dataset = shared.session.data.dataset.as_ref().map(std::sync::Arc::downgrade);
        (state.camera, state.person) = (None, None);
    }
    if state.camera.is_none() && shared.session.fit.shown.is_some() {
        state.camera = Some(overview(shared.session));
    }
    state.follow(shared.session);
    let caption = figure::of(shared.session, "3-D, metres, z up");
    let rect = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    if rect.width() < 16.0 || rect.height() < 16.0 {
        return;
    }
    let response = ui.interact(rect, ui.scope_id().with("scene"), Sense::click_and_drag());
    let mut camera = state.camera.unwrap_or_else(|| overview(shared.session));
    let tokens = Tokens::of(ui);
    let scale = ui.ctx().pixels_per_point();
    let viewport = Vec2::new(rect.width() * scale, rect.height() * scale);
    let sight = Sight { camera, rect, viewport, scale };
    take_joint(ui, shared, state, &response, &sight, &tokens);
    let readout = move_body(ui, shared, state, &response, &sight);
    let glowing = glowing(ui, shared);
    let told = pointed(shared, &glowing);
    let spoken = readout.as_deref().or(told.as_deref()).or(caption.as_deref());
    response.widget_info(|| figure::spoken("3-D scene", spoken));
    if state.grab.is_none() {
        steer(ui, &response, rect, viewport, scale, &mut camera);
    }
    let sight = Sight { camera, ..sight };
    let (mut scene, mut labels) = build::scene(shared.session, &camera, &tokens, scale);
    for extras in super::extras::published(ui.ctx()) {
        build::extras(&mut scene, &mut labels, &extras, (&camera, shared.session), scale);
    }
    build::cell(&mut scene, shared, &tokens, scale);
    build::explored(&mut scene, shared, &tokens, scale);
    let gizmo = Gizmo::of(shared.session, &sight);
    if let Some(gizmo) = &gizmo {
        gizmo.draw(&mut scene, scale);
    }
    let corner = Vec2::new(34.0 * scale, viewport.y - 34.0 * scale);
    let (triad, letters) = shapes::corner_triad(&camera, viewport, corner, 20.0 * scale, 1.6 * scale);
    scene.overlay.extend(triad);
    paint(ui, shared.gpu, state, rect, viewport, &scene, &camera);
    if state.camera.is_some() {
        state.camera = Some(camera);
    }
    let painter = ui.painter().with_clip_rect(rect);
    for (letter, at) in ["x", "y", "z"].iter().zip(letters) {
        let at = rect.min + vec2(at.x, at.y) / scale;
        painter.text(at, Align2::CENTER_CENTER, letter, theme::mono(10.0), tokens.dim);
    }
    for (world, text, color) in labels {
        if let Some(seen) = camera.project(world, viewport) {
            let at = rect.min + vec2(seen.px.x, seen.px.y) / scale + vec2(6.0, -6.0);
            grounded(&painter, at, Align2::LEFT_BOTTOM, text, egui::FontId::proportional(theme::CAPTION), color);
        }
    }
    captions(&painter, rect, shared.session, &tokens, state);
    glow(&painter, shared, &glowing, &sight, &tokens);
    ring(&painter, shared, &sight, &tokens);
    if let Some(text) = readout {
        let font = theme::mono(theme::CAPTION);
        // In a corner, where it covers nothing of what is moved and is never cut off.
        grounded(&painter, rect.left_top() + vec2(5.0, 24.0), Align2::LEFT_TOP, text, font, tokens.text);
    }
    if let Some((taken, held)) = gizmo.map(|gizmo| gizmo.show(ui, &sight)) {
        let lost = matches!(state.grab, Some(Grab { holds: Holds::Arrow(..) | Holds::Ring(_), .. })) && !held;
        state.grab = if lost { None } else { taken.or(state.grab) };
    }
    interact(ui, shared, state, &response, rect, viewport, scale, &scene, &camera);
}

/// A drag that begins on a joint takes hold of it.
fn take_joint(
    ui: &Ui,
    shared: &Shared<'_>,
    state: &mut State,
    response: &egui::Response,
    sight: &Sight,
    tokens: &Tokens,
) {
    let is_joint = matches!(state.grab, Some(Grab { holds: Holds::Joint(_), .. }));
    if is_joint && !response.dragged_by(egui::PointerButton::Primary) {
        state.grab = None;
    }
    if !response.drag_started_by(egui::PointerButton::Primary) {
        return;
    }
    let Some(press) = ui.input(|i| i.pointer.press_origin()) else { return };
    let (scene, _) = build::scene(shared.session, &sight.camera, tokens, sight.scale);
    let hit = pick(&scene, &sight.camera, sight.pixel(press), sight.viewport).map(|id| id as usize);
    state.grab = hit.and_then(|joint| {
        let start = *shared.session.shown_positions().get(joint)?;
        Some(Grab { holds: Holds::Joint(joint), start, press })
    });
}

/// What is in the hand follows the pointer. Answers what is to be said of it.
fn move_body(
    ui: &Ui,
    shared: &mut Shared<'_>,
    state: &State,
    response: &egui::Response,
    sight: &Sight,
) -> Option<String> {
    let grab = state.grab?;
    let (pointer, delta) = ui.input(|i| (i.pointer.interact_pos(), i.pointer.delta()));
    let (pointer, axis) = (pointer?, hand::held_axis(ui));
    let session = shared.session;
    // A finger that rests asks for nothing, unless a key has turned it to another axis.
    if (delta != egui::Vec2::ZERO || ui.input(|i| !i.raw.events.is_empty()) || response.drag_started())
        && pointer != grab.press
        && let Some(moved) = grab.moved(sight, pointer, axis, session.view.keep_bones)
    {
        shared.send(Command::DragBody(moved));
    }
    let Holds::Joint(joint) = grab.holds else { return None };
    let (problem, p) = (session.fit.problem.as_ref()?, session.shown_positions().get(joint)?);
    let name = problem.skeleton.shown_name(joint % problem.skeleton.joints.len().max(1));
    let along = axis.map_or("X, Y or Z held: one axis", |axis| ["along x", "along y", "along z"][axis]);
    let text = format!("{name}\nx {:.2}  y {:.2}  z {:.2} m\n{along}", p[0], p[1], p[2]);
    Some(text.replace('-', "−"))
}

/// What is drawn of what is pointed at in other panes, in words.
fn pointed(shared: &Shared<'_>, glowing: &[JointReturn]) -> Option<String> {
    let session = shared.session;
    if let Some(basin) = shared.pointed.basin {
        let cloud = session.explore.restarts(session.fit.frame)?;
        let share = 100.0 * cloud.basins.get(basin)?.share;
        return Some(format!("mean body of basin {}: {share:.0} % of the starts", basin + 1));
    }
    let (view, [column, row]) = shared.pointed.cell?;
    let array = &session.data.dataset.as_ref()?.info().views.get(view)?.array;
    let one = |of: &JointReturn| {
        let name = lit::joint_name(session, of.joint);
        format!("{name} {:.0} %", 100.0 * of.amplitude_share)
    };
    let joints: Vec<String> = glowing.iter().map(one).collect();
    let glows = if joints.is_empty() { String::new() } else { format!("; glowing: {}", joints.join(", ")) };
    Some(format!("places of the cell of {array} at column {column}, row {row}{glows}"))
}

/// The joints that light the cell that is pointed at, strongest first.
fn glowing(ui: &Ui, shared: &Shared<'_>) -> Vec<JointReturn> {
    let session = shared.session;
    let found = || {
        let ((index, pixel), dataset) = (shared.pointed.cell?, session.data.dataset.as_ref()?);
        let (lit, view) = (lit::lit(ui.ctx(), session)?, dataset.info().views.get(index)?);
        let map = session.fit.shown.as_ref().and_then(|shown| shown.h_sim.get(index)).map(Vec::as_slice);
        let cell = lit::cell_at(view, Orientation::of(view, session.view.cube), pixel, map)?;
        Some(lit.returns.at(index, cell).into_iter().filter(|of| of.amplitude_share > 0.02).collect())
    };
    found().unwrap_or_default()
}

/// The joints that light the cell that is pointed at glow, as strongly as they do.
fn glow(painter: &egui::Painter, shared: &Shared<'_>, glowing: &[JointReturn], sight: &Sight, tokens: &Tokens) {
    for of in glowing {
        let Some(p) = shared.session.shown_positions().get(of.joint) else { continue };
        let Some(at) = sight.on_screen(Vec3::from(p.map(|x| x as f32))) else { continue };
        let share = of.amplitude_share.sqrt() as f32;
        for (size, strength) in [(1.0, 0.18), (0.7, 0.22), (0.4, 0.35)] {
            painter.circle_filled(at, size * (6.0 + 22.0 * share), tokens.warn.gamma_multiply(strength * share));
        }
    }
}

/// A ring around the joint that is pointed at, here or on a map.
fn ring(painter: &egui::Painter, shared: &Shared<'_>, sight: &Sight, tokens: &Tokens) {
    let joint = shared.pointed.joint.and_then(|joint| shared.session.shown_positions().get(joint));
    if let Some(at) = joint.and_then(|p| sight.on_screen(Vec3::from(p.map(|x| x as f32)))) {
        painter.circle_stroke(at, 9.0, egui::Stroke::new(3.0, tokens.canvas.gamma_multiply(0.7)));
        painter.circle_stroke(at, 9.0, egui::Stroke::new(1.5, tokens.text));
    }
}

/// Drag orbits, right or middle drag pans, the wheel zooms to the pointer.
fn steer(ui: &Ui, response: &egui::Response, rect: Rect, viewport: Vec2, scale: f32, camera: &mut Camera) {
    let drag = response.drag_delta() * scale;
    if response.dragged_by(egui::PointerButton::Primary) {
        camera.orbit(drag.x / scale, drag.y / scale);
    } else if response.dragged() {
        camera.pan(drag.x, drag.y, viewport);
    }
    if let Some(pointer) = response.hover_pos() {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let factor = (scroll * 0.003).exp() * pinch;
        if (factor - 1.0).abs() > 1e-4 {
            let t = (pointer - rect.min) / rect.size();
            let ndc = Vec2::new(2.0 * t.x - 1.0, 1.0 - 2.0 * t.y);
            camera.zoom(factor, Some(ndc), rect.aspect_ratio());
        }
    }
}

/// Says why there is no picture.
fn no_adapter(ui: &Ui, rect: Rect) {
    let how = "No graphics adapter: the 3-D view is not drawn.".to_owned();
    let font = egui::FontId::proportional(12.0);
    let galley = ui.painter().layout(how, font, Color32::GRAY, (rect.width() - 16.0).max(20.0));
    ui.painter().galley(rect.center() - 0.5 * galley.size(), galley, Color32::GRAY);
}

fn paint(
    ui: &Ui,
    gpu: Option<&RenderState>,
    state: &mut State,
    rect: Rect,
    viewport: Vec2,
    scene: &Scene,
    camera: &Camera,
) {
    let Some(gpu) = gpu else {
        return no_adapter(ui, rect);
    };
    let made = || SceneRenderer::new(&gpu.device, &gpu.queue, gpu.target_format);
    let renderer = state.renderer.get_or_insert_with(made);
    let size = [viewport.x.round().max(1.0) as u32, viewport.y.round().max(1.0) as u32];
    renderer.render(&gpu.device, &gpu.queue, size, scene, camera);
    let generation = renderer.target_generation();
    let stale = state.texture.is_none_or(|(_, known)| known != generation);
    if stale {
        let view = renderer.texture().create_view(&wgpu::TextureViewDescriptor::default());
        let mut egui_renderer = gpu.renderer.write();
        let filter = wgpu::FilterMode::Linear;
        let id = match state.texture {
            Some((id, _)) => {
                egui_renderer.update_egui_texture_from_wgpu_texture(&gpu.device, &view, filter, id);
                id
            }
            None => egui_renderer.register_native_texture(&gpu.device, &view, filter),
        };
        state.texture = Some((id, generation));
    }
    if let Some((id, _)) = state.texture {
        let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().with_clip_rect(rect).image(id, rect, all, Color32::WHITE);
    }
}

#[expect(clippy::too_many_arguments, reason = "what is drawn and where, all of it needed to pick")]
fn interact(
    ui: &Ui,
    shared: &mut Shared<'_>,
    state: &mut State,
    response: &egui::Response,
    rect: Rect,
    viewport: Vec2,
    scale: f32,
    scene: &Scene,
    camera: &Camera,
) {
    let Some(pointer) = response.hover_pos() else { return };
    let px = Vec2::new((pointer.x - rect.min.x) * scale, (pointer.y - rect.min.y) * scale);
    let hit = (!response.dragged()).then(|| pick(scene, camera, px, viewport)).flatten().map(|id| id as usize);
    shared.points.joint = hit.or(shared.points.joint);
    if response.double_clicked() {
        match hit {
            Some(joint) => {
                shared.send(Command::SelectJoint(Some(joint)));
                if let Some(p) = shared.session.shown_positions().get(joint)
                    && let Some(camera) = &mut state.camera
                {
                    camera.focus(Vec3::from(p.map(|x| x as f32)), 1.1);
                }
            }
            None => state.camera = None,
        }
    } else if response.clicked() {
        super::joint::select(shared, hit);
    }
    if let (Some(joint), Some(problem)) = (hit, &shared.session.fit.problem) {
        let joints = problem.skeleton.joints.len().max(1);
        let text = format!(
            "{}\ndrag: move · click: select · double click: focus",
            problem.skeleton.shown_name(joint % joints)
        );
        ui.ctx().set_cursor_icon(egui::CursorIcon::PointingHand);
        response.clone().on_hover_text_at_pointer(text);
    }
}

/// What the picture means, in words, in its corners.
fn captions(painter: &egui::Painter, rect: Rect, session: &Session, tokens: &Tokens, state: &State) {
    let small = egui::FontId::proportional(theme::CAPTION);
    let mode = if session.view.splat_mode == SplatMode::Splat { "splats" } else { "ellipsoids" };
    let text = format!("Gaussian {mode} at {:.1} σ · grid 1 m", session.view.splat_sigma);
    grounded(painter, rect.right_bottom() - vec2(5.0, 5.0), Align2::RIGHT_BOTTOM, text, small.clone(), tokens.dim);
    let mut x = rect.right() - 5.0;
    let has_truth = session.data.frame.as_ref().is_some_and(|f| f.truth.is_some()) && session.view.show_truth;
    let baseline = session.pins.baseline().filter(|_| session.view.show_baseline);
    let mut keys = build::who(session, tokens);
    keys.reverse();
    keys.extend(has_truth.then(|| ("truth".to_owned(), tokens.truth)));
    let drawn = session.sources.list().iter().filter(|source| source.shown);
    keys.extend(drawn.map(|source| (source.name().to_owned(), tokens.of_source(source))));
    keys.extend(baseline.map(|pin| (format!("baseline {}", pin.name), tokens.pin)));
    for (word, color) in keys {
        let at = pos2(x, rect.top() + 5.0);
        x = grounded(painter, at, Align2::RIGHT_TOP, word, small.clone(), color).left() - 4.0;
    }
    let skipped = state.renderer.as_ref().map(SceneRenderer::skipped).unwrap_or_default();
    if let Some(text) = not_drawn(skipped) {
        grounded(painter, rect.left_top() + vec2(5.0, 5.0), Align2::LEFT_TOP, text, small, tokens.bad);
    }
}

/// What of the scene cannot be drawn, and why.
fn not_drawn(Undrawable { not_finite, not_definite }: Undrawable) -> Option<String> {
    let of = |count: usize, why: &str| (count > 0).then(|| format!("{count} not drawn: {why}"));
    let parts = [of(not_finite, "not finite"), of(not_definite, "covariance not positive definite")];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join(" · "))
}

/// A pane of less than this width, points, has one menu instead of three.
const NARROW: f32 = 300.0;

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>) {
    let mut view = shared.session.view.clone();
    egui::Frame::new().inner_margin(egui::Margin::symmetric(8, 3)).show(ui, |ui| {
        let narrow = ui.available_width() < NARROW;
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            ui.spacing_mut().button_padding.x = 6.0;
            ui.selectable_value(&mut view.splat_mode, SplatMode::Splat, "Splats")
                .on_hover_text("Alpha-blended Gaussians, sorted by depth.");
            ui.selectable_value(&mut view.splat_mode, SplatMode::Ellipsoid, "Ellipsoids")
                .on_hover_text("Opaque surfaces at the stated number of standard deviations.");
            let what = if narrow {
                "What is drawn, moving the body by hand, the camera."
            } else {
                "What is drawn in the scene."
            };
            let show = ui.menu_button("Show", |ui| {
                drawn(ui, &mut view);
                if narrow {
                    ui.separator();
                    by_hand(ui, &mut view);
                    ui.separator();
                    camera(ui, shared);
                }
            });
            show.response.named(egui::Role::Button, "What the scene shows").on_hover_text(what);
            if !narrow {
                let menu = ui.menu_button("By hand", |ui| by_hand(ui, &mut view));
                menu.response.on_hover_text("Moving the body by hand.");
                ui.menu_button("Camera", |ui| camera(ui, shared));
            }
        });
    });
    if view != shared.session.view {
        shared.set_view(|v| *v = view);
    }
}

/// What is drawn in the scene.
fn drawn(ui: &mut Ui, view: &mut ViewState) {
    ui.horizontal(|ui| {
        let drag = egui::DragValue::new(&mut view.splat_sigma);
        let drag = ui.add(drag.range(0.5..=4.0).speed(0.02).fixed_decimals(1).suffix(" σ"));
        let drag = drag.named(egui::Role::SpinButton, "Standard deviations drawn");
        drag.on_hover_text("How many standard deviations of each Gaussian are drawn.");
        ui.label("of each Gaussian");
    });
    ui.checkbox(&mut view.show_velocity, "Velocity").on_hover_text("v of each joint, 0.3 s long.");
    ui.checkbox(&mut view.show_gradients, "Descent directions").on_hover_text(
        "−∂L/∂p at each joint: teal the electromagnetic part, amber the kinematic part, rose the temporal part.",
    );
    ui.checkbox(&mut view.show_truth, "Truth").on_hover_text("The data set's joints in metres, where it has them.");
    ui.checkbox(&mut view.show_initial, "Start pose");
    ui.checkbox(&mut view.show_baseline, "Baseline")
        .on_hover_text("The skeleton of the baseline among the pinned fits.");
    ui.checkbox(&mut view.show_grid, "Ground grid");
    ui.checkbox(&mut view.show_frustum, "Radar and field of view");
}

/// Moving the body by hand.
fn by_hand(ui: &mut Ui, view: &mut ViewState) {
    ui.checkbox(&mut view.keep_bones, "Bones keep their length").on_hover_text(
        "A joint that is dragged stays at its distance from the one that it hangs on, and takes along what hangs on it; off: it \
         moves alone.",
    );
    ui.checkbox(&mut view.move_body, "Move body")
        .on_hover_text("Handles that move and turn the whole body of the selected person.\nKey: H");
    let how =
        "Drag a joint, here or on a map;\nX, Y or Z held: along that axis only.\nAlt and the arrows move it by 2 cm.";
    ui.label(RichText::new(how).small());
}

/// Where the scene is seen from.
fn camera(ui: &mut Ui, shared: &mut Shared<'_>) {
    for row in [FROM_RADAR, FROM_ABOVE, FROM_SIDE] {
        if ui.button(row.label).clicked() {
            shared.acts.push((row.act)(shared.session));
            ui.close();
        }
    }
    ui.label(RichText::new("Drag orbits, right drag pans,\nwheel zooms, double click focuses.").small());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn why_something_is_not_drawn_is_said() {
        let said = |not_finite, not_definite| not_drawn(Undrawable { not_finite, not_definite }).unwrap_or_default();
        assert_eq!(said(0, 0), "");
        assert_eq!(said(2, 0), "2 not drawn: not finite");
        assert_eq!(said(1, 3), "1 not drawn: not finite · 3 not drawn: covariance not positive definite");
    }
}
