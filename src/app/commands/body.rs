//! The commands that move the body by hand, without a mouse.

use super::table::{ALT, NONE, SHIFT, has_frame};
use super::{CommandRow, Menu, Shortcut, UiAction};
use crate::geometry::Vec3;
use crate::session::{Command, Session};
use egui::Key;

/// How far one press moves, m.
const STEP_M: f64 = 0.02;

fn fitted(s: &Session) -> bool {
    s.fit.is_ready() && !s.shown_positions().is_empty()
}

/// The joint so many places after the selected one, round the body; the first or last where none is.
fn joint(s: &Session, by: isize) -> UiAction {
    let count = s.shown_positions().len().max(1) as isize;
    let from = s.joint.map_or(if by > 0 { -1 } else { 0 }, |joint| joint as isize);
    UiAction::Session(Command::SelectJoint(Some((from + by).rem_euclid(count) as usize)))
}

const fn nudge(
    label: &'static str,
    tooltip: &'static str,
    keys: &'static [Shortcut],
    act: fn(&Session) -> UiAction,
) -> CommandRow {
    CommandRow { label, title: None, tooltip, menu: Menu::Body, keys, enabled: fitted, act }
}

fn by(direction: Vec3) -> UiAction {
    UiAction::Session(Command::NudgeBody(direction.map(|x| STEP_M * x)))
}

/// Commands about the body, in the order of their menu.
pub(super) const COMMANDS: &[CommandRow] = &[
    CommandRow {
        label: "Next joint",
        title: None,
        tooltip: "Select the next joint of the skeleton; after the last the first.",
        menu: Menu::Body,
        keys: &[(NONE, Key::J)],
        enabled: has_frame,
        act: |s| joint(s, 1),
    },
    CommandRow {
        label: "Previous joint",
        title: None,
        tooltip: "Select the joint before in the skeleton; before the first the last.",
        menu: Menu::Body,
        keys: &[(SHIFT, Key::J)],
        enabled: has_frame,
        act: |s| joint(s, -1),
    },
    crate::app::panes::scene::MOVE_BODY,
    nudge(
        "Nudge to the left",
        "Move the selected joint, or with handles shown the whole person, 2 cm along y. It is one act until Alt is lifted.",
        &[(ALT, Key::ArrowLeft)],
        |_| by([0.0, 1.0, 0.0]),
    ),
    nudge(
        "Nudge to the right",
        "Move the selected joint, or with handles shown the whole person, 2 cm against y.",
        &[(ALT, Key::ArrowRight)],
        |_| by([0.0, -1.0, 0.0]),
    ),
    nudge(
        "Nudge away from the radar",
        "Move the selected joint, or with handles shown the whole person, 2 cm along x.",
        &[(ALT, Key::ArrowUp)],
        |_| by([1.0, 0.0, 0.0]),
    ),
    nudge(
        "Nudge towards the radar",
        "Move the selected joint, or with handles shown the whole person, 2 cm against x.",
        &[(ALT, Key::ArrowDown)],
        |_| by([-1.0, 0.0, 0.0]),
    ),
    nudge(
        "Nudge up",
        "Move the selected joint, or with handles shown the whole person, 2 cm up.",
        &[(ALT, Key::PageUp)],
        |_| by([0.0, 0.0, 1.0]),
    ),
    nudge(
        "Nudge down",
        "Move the selected joint, or with handles shown the whole person, 2 cm down.",
        &[(ALT, Key::PageDown)],
        |_| by([0.0, 0.0, -1.0]),
    ),
];
