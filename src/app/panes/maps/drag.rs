//! A joint dragged on a map, and the joint that is pointed at elsewhere.

use super::{State, overlay, screen, unit_at};
use crate::app::locate::moved_on;
use crate::app::map_image::Orientation;
use crate::app::panes::Shared;
use crate::geometry::Vec3;
use crate::radar::View;
use crate::session::{BodyMove, Command};
use egui::{Color32, Painter, PointerButton, Pos2, Rect, Stroke, Ui};

/// A joint in the hand. The three columns draw the same views: it is held in one of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Held {
    column: egui::Id,
    joint: usize,
    /// Where it was, m, world frame.
    start: Vec3,
    /// From the joint's mark to where it was pressed, picture coordinates.
    off: [f64; 2],
}

/// A drag that began on a joint's mark moves it in the map's plane. True while it does, so that it does not pan.
pub(super) fn joint(
    ui: &Ui,
    shared: &mut Shared<'_>,
    state: &mut State,
    response: &egui::Response,
    plot: Rect,
    (index, view, o): (usize, &View, Orientation),
) -> bool {
    let (session, window) = (shared.session, state.windows[index]);
    if response.drag_started_by(PointerButton::Primary)
        && session.view.show_skeleton
        && let Some(press) = ui.input(|i| i.pointer.press_origin())
    {
        let joint = overlay::joint_near(session, view, o, &|unit| screen(plot, window, unit), press);
        state.held = joint.and_then(|joint| {
            let shown = &session.fit.shown.as_ref()?.params;
            let (start, velocity) = (*shown.positions().get(joint)?, *shown.velocities().get(joint)?);
            let mark = o.unit_from_bins(view, &view.bins_of_moving(start, velocity));
            let at = unit_at(plot, window, press);
            Some(Held { column: response.id, joint, start, off: [at[0] - mark[0], at[1] - mark[1]] })
        });
    }
    let Some(held) = state.held.filter(|held| held.column == response.id) else { return false };
    if !response.dragged_by(PointerButton::Primary) {
        state.held = None;
        return false;
    }
    let (Some(pointer), true) = (response.interact_pointer_pos(), response.drag_delta() != egui::Vec2::ZERO) else {
        return true;
    };
    let at = unit_at(plot, window, pointer);
    let keep_bones = session.view.keep_bones;
    if let Some(to) = moved_on(view, o, held.start, [at[0] - held.off[0], at[1] - held.off[1]]) {
        shared.send(Command::DragBody(BodyMove::Joint { joint: held.joint, to, keep_bones }));
    } else {
        state.told = Some("This map does not say where that is: move the joint on another one, or in 3-D.");
    }
    true
}

/// A ring around the joint that is pointed at, here or in 3-D.
pub(super) fn ring(
    painter: &Painter,
    shared: &Shared<'_>,
    (view, o): (&View, Orientation),
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
) {
    let joints = overlay::joints_on(shared.session, view, o, to_screen);
    if let Some(at) = shared.pointed.joint.and_then(|joint| joints.get(joint)) {
        painter.circle_stroke(*at, 9.0, Stroke::new(3.0, Color32::from_black_alpha(150)));
        painter.circle_stroke(*at, 9.0, Stroke::new(1.5, Color32::WHITE));
    }
}
